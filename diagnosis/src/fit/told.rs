//! What the runs can show at all: the lengths that they pass over, the periods that they resolve, and preloads and
//! temperatures that differ.

use simulation::mechanism::{Context, Id, Search};
use simulation::run::Run;

use crate::fit::source::Source;

/// Ratio of largest to least preload from which forms that differ by their load are told apart.
const SEVERAL: f64 = 1.3;

/// Range of a temperature, K, from which a cause that follows it is told from a number of the law that is off: about what two
/// sensors differ by, and a hundredth of the friction by way of the oil. A constant temperature is a constant factor.
const WARMED_K: f64 = 0.5;

/// Share of the rows that a range of temperatures leaves out at either end: single readings are no warming.
const LEFT_OUT: f64 = 0.02;

/// See the module.
pub(super) struct Told {
    /// Whether preloads differ so much that a share of the preload and a change of the interference are
    /// distinguishable.
    has_several_loads: bool,
    /// Whether the block's temperature changes, and whether its difference to the rail's does.
    has_warmed: bool,
    has_warmed_unevenly: bool,
    /// Stroke and travel of the longest run, m.
    stroke_m: f64,
    travel_m: f64,
    /// Shortest period that the acceleration resolves, s.
    period_s: f64,
    /// Both ends of what all runs pass over, m.
    pub(super) rail_m: (f64, f64),
}

impl Told {
    pub(super) fn of(contexts: &[Context<'_>]) -> Self {
        let block = |run: &Run| run.temperature_block_degc.clone();
        Told {
            has_several_loads: has_several_loads(contexts),
            has_warmed: range_k(contexts, block) >= WARMED_K,
            has_warmed_unevenly: range_k(contexts, block_above_rail) >= WARMED_K,
            stroke_m: contexts.iter().map(|c| length_m(ends_m([c]))).fold(0.0, f64::max),
            travel_m: contexts.iter().filter_map(|c| c.travel_m.last().copied()).fold(0.0, f64::max),
            period_s: contexts.iter().map(period_s).fold(0.0, f64::max),
            rail_m: ends_m(contexts),
        }
    }

    /// Keeps the mass of a ringing structure at zero where the acceleration does not resolve its period: such a mass follows
    /// the errors of a derived acceleration.
    pub(super) fn bind(&self, source: &Source, bounds: &mut [(f64, f64)]) {
        let Source::Mechanism { definition, form, .. } = source else { return };
        if definition.id != Id::StructuralResonance || highest_hz(source) * self.period_s <= 1.0 {
            return;
        }
        let amplitudes = definition.forms[*form].amplitudes.iter().zip(bounds);
        amplitudes.filter(|(what, _)| what.unit == "kg").for_each(|(_, bounds)| *bounds = (0.0, 0.0));
    }

    /// Whether the runs show at least half of every length of a source, and lengths since a turn are at least
    /// `seen_from_m`.
    pub(super) fn is_told(&self, source: &Source, seen_from_m: f64) -> bool {
        let Source::Mechanism { definition, form, shape } = source else { return true };
        if definition.forms[*form].is_of_share() && !self.has_several_loads {
            return false;
        }
        match definition.id {
            Id::ViscosityTemperature if !self.has_warmed => return false,
            Id::ThermalPreload if !self.has_warmed_unevenly => return false,
            _ => {}
        }
        definition.forms[*form].shape.iter().zip(shape).all(|(parameter, value)| match parameter.search {
            Search::AlongStroke => *value <= 2.0 * self.stroke_m,
            Search::AlongTravel => *value <= 2.0 * self.travel_m,
            Search::SinceTurn => *value >= seen_from_m,
            _ => true,
        })
    }
}

/// Shortest period that a run's acceleration resolves, s: 0 for a measured one, and for a derived one the window that it
/// is derived over.
fn period_s(context: &Context<'_>) -> f64 {
    let window = 2.0 * context.motion.acceleration_reach as f64 + 1.0;
    if context.run.acceleration_m_s2.is_some() { 0.0 } else { window * context.run.step_s().max(0.0) }
}

/// Highest frequency of a ringing structure, Hz; 0 for another source.
fn highest_hz(source: &Source) -> f64 {
    source.number("frequency_hz").map_or(0.0, |hz| hz * source.number("ratio").unwrap_or(1.0))
}

/// Both ends of what these runs pass over, m; the first lies beyond the second where there is none.
fn ends_m<'c>(contexts: impl IntoIterator<Item = &'c Context<'c>>) -> (f64, f64) {
    let positions = contexts.into_iter().flat_map(|context| &context.motion.position_m).filter(|x| x.is_finite());
    positions.fold((f64::INFINITY, f64::NEG_INFINITY), |(from, to), x| (from.min(*x), to.max(*x)))
}

fn length_m((from, to): (f64, f64)) -> f64 {
    (to - from).max(0.0)
}

fn has_several_loads(contexts: &[Context<'_>]) -> bool {
    let preloads = contexts.iter().flat_map(|context| &context.steady.preload_n).filter(|p| p.is_finite());
    let (least, most) = preloads.fold((f64::INFINITY, 0.0f64), |(least, most), p| (least.min(*p), most.max(*p)));
    most > SEVERAL * least
}

/// By how much the block is warmer than the rail, K.
fn block_above_rail(run: &Run) -> Option<Vec<f64>> {
    let (block, rail) = (run.temperature_block_degc.as_ref()?, run.temperature_rail_degc.as_ref()?);
    Some(block.iter().zip(rail).map(|(block, rail)| block - rail).collect())
}

/// Range of a temperature over the rows of all runs that have it, but for the few at either end, K.
fn range_k(contexts: &[Context<'_>], of: impl Fn(&Run) -> Option<Vec<f64>>) -> f64 {
    let columns = contexts.iter().filter_map(|context| of(context.run));
    let mut all: Vec<f64> = columns.flatten().filter(|kelvin| kelvin.is_finite()).collect();
    let Some(last) = all.len().checked_sub(1) else { return 0.0 };
    let few = (LEFT_OUT * all.len() as f64) as usize;
    let mut nth = |at: usize| *all.select_nth_unstable_by(at, f64::total_cmp).1;
    nth(last - few) - nth(few)
}

#[cfg(test)]
mod tests {
    use simulation::Simulation;
    use simulation::mechanism::definition;
    use simulation::motion::Motion;
    use simulation::run::{Break, Part};

    use super::*;

    /// Strokes of 0.2 m at 500 Hz.
    fn run() -> Run {
        let time_s: Vec<f64> = (0..5000).map(|n| 0.002 * f64::from(n)).collect();
        Run {
            drag_force_n: vec![0.0; time_s.len()],
            position_m: Some(time_s.iter().map(|t| 0.1 * (2.0 * t).sin()).collect()),
            parts: vec![Part { rows: 0..time_s.len(), segment: None, starts: Break::Start }],
            time_s,
            ..Run::default()
        }
    }

    #[test]
    fn ringing_faster_than_a_derived_acceleration_has_no_mass() {
        let law = "schema = \"guideblock.simulation/1\"\n[guide]\nlaw = \"coulomb-viscous\"\ncoulomb_n = 20.0\n\
                   viscous_n_s_m = 200.0\noffset_n = 0.0\n[axis]\nmoved_mass_kg = 100.0\n";
        let simulation = Simulation::from_toml(law).expect("legal");
        let derived = run();
        let measured = Run { acceleration_m_s2: Some(vec![0.0; derived.len()]), ..derived.clone() };
        let highest_hz = |run: &Run| {
            let motion = Motion::of(run);
            let contexts = [Context::of(&simulation, run, &motion).expect("complete")];
            let told = Told::of(&contexts);
            let of = |hz: &f64| Source::Mechanism {
                definition: definition(Id::StructuralResonance),
                form: 0,
                shape: vec![*hz, 0.05],
            };
            let has_mass = |hz: &f64| {
                let mut bounds = [(0.0, 1.0); 2];
                told.bind(&of(hz), &mut bounds);
                bounds == [(0.0, 1.0); 2]
            };
            (1..=10).map(|k| 30.0 * f64::from(k)).filter(has_mass).fold(0.0, f64::max)
        };
        assert_eq!(highest_hz(&measured), 300.0);
        // a parabola through five positions
        assert_eq!(highest_hz(&derived), 90.0);
    }
}
