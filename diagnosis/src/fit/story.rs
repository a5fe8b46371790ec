//! Curves without a story: what the mismatch looks like along each axis, whatever causes it.
//!
//! A curve is piecewise linear in the axis' value and multiplies one of three carriers: 1 (the same in both
//! directions), the direction of motion, the law's drag. Curves locate a mismatch, compete with the library (what only
//! a curve explains has no name here) and stand in for the unknown in the augmented simulation.

use simulation::mechanism::Context;

/// What a curve multiplies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Carrier {
    /// Additive, the same in both directions.
    Even,
    /// Changes sign with the direction.
    Odd,
    /// Proportional to the law's drag.
    Drag,
}

impl Carrier {
    /// Its value in a row of a run; 0 where the law has none.
    pub(crate) fn of(self, context: &Context<'_>, row: usize) -> f64 {
        match self {
            Carrier::Even => 1.0,
            Carrier::Odd => context.direction[row],
            Carrier::Drag => {
                let drag = context.steady.drag_n.get(row).copied().filter(|x| x.is_finite());
                context.direction[row] * drag.unwrap_or(0.0)
            }
        }
    }

    pub(crate) fn words(self) -> &'static str {
        match self {
            Carrier::Even => "the same in both directions",
            Carrier::Odd => "against the motion",
            Carrier::Drag => "in proportion to the drag",
        }
    }
}

/// Axes of the contract that a curve can lie along.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Axis {
    Direction,
    Velocity,
    Load,
    Preload,
    Position,
    Time,
    Travel,
    Temperature,
    TemperatureDifference,
    Acceleration,
    ReversalDistance,
    Dwell,
    /// Time within a period: what follows another machine's clock. Found by spectrum, hence not among [`Axis::ALL`].
    Clock,
    /// Time since the carriage has set out or turned. No axis of the contract: it keeps what a channel makes of a turn out
    /// of the noise.
    SinceTurn,
}

impl Axis {
    pub(crate) const ALL: [Axis; 12] = [
        Axis::Direction,
        Axis::Velocity,
        Axis::Load,
        Axis::Preload,
        Axis::Position,
        Axis::Time,
        Axis::Travel,
        Axis::Temperature,
        Axis::TemperatureDifference,
        Axis::Acceleration,
        Axis::ReversalDistance,
        Axis::Dwell,
    ];

    pub(crate) fn name(self) -> &'static str {
        match self {
            Axis::Direction => "direction",
            Axis::Velocity => "velocity",
            Axis::Load => "load",
            Axis::Preload => "preload",
            Axis::Position => "position",
            Axis::Time => "time",
            Axis::Travel => "travel",
            Axis::Temperature => "temperature",
            Axis::TemperatureDifference => "temperature-difference",
            Axis::Acceleration => "acceleration",
            Axis::ReversalDistance => "reversal-distance",
            Axis::Dwell => "dwell",
            Axis::Clock => "frequency",
            Axis::SinceTurn => "time since a turn",
        }
    }

    pub(crate) fn of_name(name: &str) -> Option<Self> {
        Axis::ALL.into_iter().find(|axis| axis.name() == name)
    }

    pub(crate) fn unit(self) -> &'static str {
        match self {
            Axis::Direction => "1",
            Axis::Velocity => "m/s",
            Axis::Load | Axis::Preload => "N",
            Axis::Position | Axis::Travel | Axis::ReversalDistance => "m",
            Axis::Time | Axis::Dwell | Axis::Clock | Axis::SinceTurn => "s",
            Axis::Temperature | Axis::TemperatureDifference => "degC",
            Axis::Acceleration => "m/s2",
        }
    }

    /// Value of every row of a run; `None` where it is not known.
    pub(crate) fn values(self, context: &Context<'_>) -> Option<Vec<f64>> {
        let (run, motion) = (context.run, context.motion);
        match self {
            Axis::Direction => Some(context.direction.clone()),
            Axis::Velocity => Some(motion.velocity_m_s.iter().map(|v| v.abs()).collect()),
            Axis::Load => run.external_load_n.clone(),
            Axis::Preload => run.preload_n.clone(),
            Axis::Position => motion.has_position.then(|| motion.position_m.clone()),
            Axis::Time => {
                let first = run.time_s.first().copied().unwrap_or(0.0);
                Some(run.time_s.iter().map(|t| t - first).collect())
            }
            Axis::Travel => Some(context.travel_m.clone()),
            Axis::Temperature => run.temperature_block_degc.clone(),
            Axis::TemperatureDifference => {
                let (block, rail) = (run.temperature_block_degc.as_ref()?, run.temperature_rail_degc.as_ref()?);
                Some(block.iter().zip(rail).map(|(block, rail)| block - rail).collect())
            }
            Axis::Acceleration => Some(motion.acceleration_m_s2.clone()),
            Axis::ReversalDistance => Some(context.since_reversal_m.clone()),
            Axis::Dwell => Some(context.dwell_s.clone()),
            Axis::Clock => Some(run.time_s.clone()),
            Axis::SinceTurn => Some(since_turn_s(context)),
        }
    }

    fn knots(self, values: &[f64]) -> Vec<f64> {
        let mut sorted: Vec<f64> = values.iter().copied().filter(|x| x.is_finite()).collect();
        sorted.sort_unstable_by(f64::total_cmp);
        let (Some(first), Some(last)) = (sorted.first().copied(), sorted.last().copied()) else { return Vec::new() };
        let span = last - first;
        let uniform = |count: usize| (0..=count).map(|k| first + span * k as f64 / count as f64).collect();
        let quantiles = |count: usize| {
            let mut knots: Vec<f64> = (0..=count).map(|k| sorted[(sorted.len() - 1) * k / count]).collect();
            knots.dedup_by(|b, a| *b - *a <= 0.02 * span);
            knots
        };
        match self {
            Axis::Direction | Axis::Clock | Axis::SinceTurn => Vec::new(),
            Axis::ReversalDistance => vec![0.0, 2e-5, 5e-5, 1e-4, 2e-4, 4e-4, 1e-3],
            Axis::Dwell => vec![0.0, 0.3, 1.0, 3.0, 10.0, 100.0, 1000.0],
            Axis::Position => uniform(24),
            Axis::Time => uniform(12),
            Axis::Travel => uniform(8),
            Axis::Velocity | Axis::Load | Axis::Preload => {
                // geometric: friction changes with the logarithm of these
                let low = sorted[sorted.len() / 50].max(1e-3 * last.abs());
                if !(low > 0.0) || last / low < 1.05 {
                    return Vec::new();
                }
                let count = ((last / low).ln() / 0.45).ceil().clamp(2.0, 9.0) as usize;
                (0..=count).map(|k| low * (last / low).powf(k as f64 / count as f64)).collect()
            }
            Axis::Temperature | Axis::TemperatureDifference if span < 0.3 => Vec::new(),
            Axis::Temperature | Axis::TemperatureDifference => quantiles(5),
            Axis::Acceleration => quantiles(6),
        }
    }
}

/// Time since the direction of motion last changed, of every row of a run; not a number where that was before its part.
fn since_turn_s(context: &Context<'_>) -> Vec<f64> {
    let (direction, time_s) = (&context.steady.direction, &context.run.time_s);
    let mut out = vec![f64::NAN; time_s.len()];
    for part in &context.run.parts {
        let mut turned_s = f64::NAN;
        for n in part.rows.clone().skip(1) {
            if direction[n] != direction[n - 1] {
                turned_s = time_s[n];
            }
            out[n] = time_s[n] - turned_s;
        }
    }
    out
}

/// Rows since a turn at which its curve has knots.
const SINCE_TURN: [f64; 10] = [0.0, 1.0, 2.0, 3.0, 5.0, 8.0, 13.0, 21.0, 34.0, 55.0];

/// Knots of a curve that repeats.
const CLOCK_KNOTS: usize = 12;

/// A curve along an axis.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Curve {
    pub(crate) axis: Axis,
    pub(crate) carrier: Carrier,
    pub(crate) knots: Vec<f64>,
}

impl Curve {
    /// Every curve that these runs can show. `compared`: rows of all runs, laid end to end.
    pub(crate) fn all(contexts: &[Context<'_>], compared: &[bool]) -> Vec<Curve> {
        let mut curves = Vec::new();
        for axis in Axis::ALL {
            let mut values = Vec::new();
            let mut start = 0;
            for context in contexts {
                if let Some(column) = axis.values(context) {
                    values.extend(column.iter().zip(&compared[start..]).filter(|(_, c)| **c).map(|(x, _)| *x));
                }
                start += context.run.len();
            }
            if axis == Axis::Direction {
                if values.contains(&1.0) && values.contains(&-1.0) {
                    curves.push(Curve { axis, carrier: Carrier::Even, knots: Vec::new() });
                }
                continue;
            }
            if values.len() < 200 {
                continue;
            }
            let knots = axis.knots(&values);
            if knots.len() < 2 {
                continue;
            }
            let carriers: &[Carrier] = match axis {
                Axis::Position | Axis::Time | Axis::Load => &[Carrier::Even, Carrier::Odd, Carrier::Drag],
                Axis::Acceleration => &[Carrier::Even],
                Axis::Temperature | Axis::TemperatureDifference => &[Carrier::Odd, Carrier::Drag, Carrier::Even],
                Axis::Travel => &[Carrier::Odd, Carrier::Drag],
                _ => &[Carrier::Odd],
            };
            curves.extend(carriers.iter().map(|carrier| Curve { axis, carrier: *carrier, knots: knots.clone() }));
        }
        curves
    }

    /// What follows every turn for some rows. `None` where the runs do not all have rows of a time.
    pub(crate) fn since_turn(contexts: &[Context<'_>]) -> Option<Curve> {
        let step_s = contexts.iter().map(|context| context.run.step_s()).fold(0.0, f64::max);
        let knots = SINCE_TURN.iter().map(|rows| rows * step_s).collect();
        (step_s > 0.0).then_some(Curve { axis: Axis::SinceTurn, carrier: Carrier::Drag, knots })
    }

    /// One column a knot, over the rows of one run; zeros where the run does not show the axis.
    pub(crate) fn columns(&self, context: &Context<'_>) -> Vec<Vec<f64>> {
        let rows = context.run.len();
        if self.axis == Axis::Direction {
            return vec![vec![1.0; rows], context.steady.drag_n.clone()];
        }
        let mut columns = vec![vec![0.0; rows]; self.knots.len()];
        self.each(context, |row, low, [below, above]| {
            columns[low][row] = below;
            columns[low + 1][row] = above;
        });
        if let Some(idle) = self.idle_knot() {
            columns.remove(idle);
        }
        if self.axis == Axis::Clock
            && let (Some(end), [start, ..]) = (columns.pop(), columns.as_mut_slice())
        {
            start.iter_mut().zip(end).for_each(|(start, end)| *start += end);
        }
        columns
    }

    /// The curve that repeats after a period, s.
    pub(crate) fn clock(period_s: f64, carrier: Carrier) -> Self {
        let knots = (0..=CLOCK_KNOTS).map(|k| period_s * k as f64 / CLOCK_KNOTS as f64).collect();
        Curve { axis: Axis::Clock, carrier, knots }
    }

    /// Period of a clock, s.
    pub(crate) fn period_s(&self) -> Option<f64> {
        self.knots.last().copied().filter(|_| self.axis == Axis::Clock)
    }

    /// Takes the curve with these heights, one a column, from a force over the rows of one run.
    pub(crate) fn take_from(&self, context: &Context<'_>, heights: &[f64], force: &mut [f64]) {
        if let (Axis::Direction, [even, drag]) = (self.axis, heights) {
            for (force, own) in force.iter_mut().zip(&context.steady.drag_n) {
                *force -= even + drag * own;
            }
            return;
        }
        let mut heights = heights.to_vec();
        if let Some(idle) = self.idle_knot() {
            heights.insert(idle, 0.0);
        }
        if self.axis == Axis::Clock {
            heights.extend(heights.first().copied());
        }
        self.each(context, |row, low, [below, above]| force[row] -= below * heights[low] + above * heights[low + 1]);
    }

    /// Number of columns.
    pub(crate) fn len(&self) -> usize {
        match self.axis {
            Axis::Direction => 2,
            Axis::Clock => self.knots.len() - 1,
            _ => self.knots.len() - usize::from(self.idle_knot().is_some()),
        }
    }

    /// Far from a reversal, and without a rest before, there is nothing left of either.
    fn idle_knot(&self) -> Option<usize> {
        match self.axis {
            Axis::ReversalDistance | Axis::SinceTurn => Some(self.knots.len() - 1),
            Axis::Dwell => Some(0),
            _ => None,
        }
    }

    /// Of every row that shows the axis: the knot below, and how much of the carrier it and the one above have.
    fn each(&self, context: &Context<'_>, mut of: impl FnMut(usize, usize, [f64; 2])) {
        let Some(values) = self.axis.values(context) else { return };
        let last = self.knots.len() - 2;
        for (n, value) in values.iter().enumerate().filter(|(_, value)| value.is_finite()) {
            let value = &self.period_s().map_or(*value, |period| value.rem_euclid(period));
            let carrier = self.carrier.of(context, n);
            let low = self.knots.partition_point(|knot| knot <= value).saturating_sub(1).min(last);
            let share = ((value - self.knots[low]) / (self.knots[low + 1] - self.knots[low])).clamp(0.0, 1.0);
            of(n, low, [(1.0 - share) * carrier, share * carrier]);
        }
    }
}
