//! Driven profiles from options of the command line.

use clap::ValueEnum;
use simulation::Simulation;
use simulation::file::Law;
use simulation::guide::Lubricant;
use simulation::profile::{
    Conditions, Course, Dwell, Ladder, Map, Modulation, Order, Reversal, Staircase, Unfit, WarmUp, Warming,
};

use super::super::{Failure, say};

/// Temperature of block and rail where the oil needs one and none is given, °C: that of a data sheet's viscosity.
const DEGC: f64 = 40.0;

/// How the axis is driven.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Name {
    /// every speed, forth and back, up and down the list (P1; P3 with --temperature, P9 with --external-load)
    Staircase,
    /// the staircase at every preload, one segment each (P2)
    Ladder,
    /// whole stroke at constant speed, forth and back (P4; with staircase P10)
    Map,
    /// small sinusoids, every amplitude at every frequency (P5)
    Reversal,
    /// a speed that swells and falls and never turns (P6; added mass: axis.moved_mass_kg of the simulation)
    Modulation,
    /// ever longer rests, a slow start after each (P7; P0's rests with --dwells 30,30)
    Dwell,
    /// running, a stop, running again; block and rail warm up and cool down (P8)
    #[value(alias = "warm-up")]
    Warmup,
}

/// Order of the speeds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Direction {
    /// as listed
    Up,
    /// from the last to the first
    Down,
    /// up, then down, one segment each
    Both,
}

/// Options of the profiles.
#[derive(clap::Args, Clone, Debug, Default)]
#[command(next_help_heading = "Profiles")]
pub(super) struct ProfileArguments {
    /// Drive a test profile instead of reading a recording, and write a whole recording of it
    #[arg(long, value_name = "NAME")]
    pub(super) profile: Option<Name>,
    /// Samples a second, Hz [default: 250; ladder and warmup 100, reversal and modulation 1000]
    #[arg(long, value_name = "HZ", requires = "profile")]
    rate: Option<f64>,
    /// Preload of the block, N; goes before operation.preload_n of the simulation (not ladder)
    #[arg(long, value_name = "N", requires = "profile")]
    preload: Option<f64>,
    /// Known vertical load on the block, N, as a column; plain laws ignore it
    #[arg(long, value_name = "N", requires = "profile")]
    external_load: Option<f64>,
    /// Temperature of block and rail, °C, as columns (not warmup) [default: none, or 40 where the oil needs one]
    #[arg(long, value_name = "DEGC", requires = "profile")]
    temperature: Option<f64>,
    /// Speeds, m/s, separated by commas (staircase, ladder, map); one speed (modulation, dwell, warmup)
    /// [default: the paper's 20 from 0.1 to 6 m/min; map 0.01,0.1, modulation 0.01, dwell 0.00167, warmup 0.1]
    #[arg(long, value_name = "M/S", requires = "profile", value_delimiter = ',', verbatim_doc_comment)]
    speeds: Vec<f64>,
    /// The same in m/min
    #[arg(long, value_name = "M/MIN", requires = "profile", value_delimiter = ',', conflicts_with = "speeds")]
    speeds_m_min: Vec<f64>,
    /// Preloads, N (ladder) [default: those of the paper's ten lateral forces, 500 to 9500 N, in this guide]
    #[arg(long, value_name = "N", requires = "profile", value_delimiter = ',')]
    preloads: Vec<f64>,
    /// Travel at constant speed at least, m (staircase, ladder) [default: 0.072];
    /// stroke (map, warmup) [default: 0.5]; way after each dwell (dwell) [default: 0.01]
    #[arg(long, value_name = "M", requires = "profile", verbatim_doc_comment)]
    length: Option<f64>,
    /// Time at constant speed at least, s (staircase, ladder) [default: 2], at each frequency (modulation) [default: 10]
    #[arg(long, value_name = "S", requires = "profile")]
    hold: Option<f64>,
    /// How often forth and back (staircase, ladder: at each speed) [default: 1]; (map) [default: 5]
    #[arg(long, value_name = "N", requires = "profile")]
    strokes: Option<u32>,
    /// Order of the speeds (staircase, ladder; a ladder has one segment per preload and no both) [default: both; ladder
    /// up]
    #[arg(long, requires = "profile")]
    order: Option<Direction>,
    /// Rest at the ends of a stroke, s (staircase, ladder, map) [default: 0.2]
    #[arg(long, value_name = "S", requires = "profile")]
    pause: Option<f64>,
    /// Largest acceleration of a change of speed, m/s² (all but reversal) [default: 0.5]
    #[arg(long, value_name = "M/S2", requires = "profile")]
    acceleration: Option<f64>,
    /// Amplitudes, m (reversal) [default: 1e-6,1e-5,1e-4,2e-3]
    #[arg(long, value_name = "M", requires = "profile", value_delimiter = ',')]
    amplitudes: Vec<f64>,
    /// Frequencies, Hz (reversal) [default: 0.05,0.5] (modulation) [default: 0.1,1,5]
    #[arg(long, value_name = "HZ", requires = "profile", value_delimiter = ',')]
    frequencies: Vec<f64>,
    /// Periods of each (reversal) [default: 5], at least (modulation) [default: 3]
    #[arg(long, value_name = "N", requires = "profile")]
    cycles: Option<u32>,
    /// Amplitude of the speed over its mean, 0 to 0.99 (modulation) [default: 0.8]
    #[arg(long, value_name = "SHARE", requires = "profile")]
    depth: Option<f64>,
    /// Rests, s, none shorter than the one before (dwell) [default: 1,10,100,1000]
    #[arg(long, value_name = "S", requires = "profile", value_delimiter = ',')]
    dwells: Vec<f64>,
    /// Running, s (warmup) [default: 7200]
    #[arg(long, value_name = "S", requires = "profile")]
    run: Option<f64>,
    /// Stop after it, s (warmup) [default: 3600]
    #[arg(long, value_name = "S", requires = "profile")]
    stop: Option<f64>,
    /// Running again, s (warmup) [default: 600]
    #[arg(long, value_name = "S", requires = "profile")]
    resume: Option<f64>,
    /// Temperature of the surroundings, °C (warmup) [default: 22]
    #[arg(long, value_name = "DEGC", requires = "profile")]
    ambient: Option<f64>,
    /// How far the block warms while running, K (warmup) [default: 10]
    #[arg(long, value_name = "K", requires = "profile")]
    block_rise: Option<f64>,
    /// Time constant of the block, s (warmup) [default: 900]
    #[arg(long, value_name = "S", requires = "profile")]
    block_time: Option<f64>,
    /// How far the rail warms while running, K (warmup) [default: 4]
    #[arg(long, value_name = "K", requires = "profile")]
    rail_rise: Option<f64>,
    /// Time constant of the rail, s (warmup) [default: 2700]
    #[arg(long, value_name = "S", requires = "profile")]
    rail_time: Option<f64>,
}

impl Name {
    /// Options that apply to this profile beside the common ones.
    const fn takes(self) -> &'static [&'static str] {
        match self {
            Name::Staircase => {
                &["preload", "temperature", "speeds", "length", "hold", "strokes", "order", "pause", "acceleration"]
            }
            Name::Ladder => {
                &["preloads", "temperature", "speeds", "length", "hold", "strokes", "order", "pause", "acceleration"]
            }
            Name::Map => &["preload", "temperature", "speeds", "length", "strokes", "pause", "acceleration"],
            Name::Reversal => &["preload", "temperature", "amplitudes", "frequencies", "cycles"],
            Name::Modulation => {
                &["preload", "temperature", "speeds", "depth", "frequencies", "cycles", "hold", "acceleration"]
            }
            Name::Dwell => &["preload", "temperature", "dwells", "speeds", "length", "acceleration"],
            Name::Warmup => &[
                "preload",
                "speeds",
                "length",
                "run",
                "stop",
                "resume",
                "ambient",
                "block-rise",
                "block-time",
                "rail-rise",
                "rail-time",
                "acceleration",
            ],
        }
    }

    const fn rate_hz(self) -> f64 {
        match self {
            Name::Staircase | Name::Map | Name::Dwell => 250.0,
            Name::Ladder | Name::Warmup => 100.0,
            Name::Reversal | Name::Modulation => 1000.0,
        }
    }
}

impl ProfileArguments {
    /// Samples a second.
    pub(super) fn rate_hz(&self, name: Name) -> f64 {
        self.rate.unwrap_or(name.rate_hz())
    }

    /// Drives the profile.
    pub(super) fn drive(&self, name: Name, simulation: &Simulation) -> Result<Course, Failure> {
        self.refuse_what_means_nothing(name)?;
        let conditions = self.conditions(name, simulation)?;
        let unfit = |why: Unfit| {
            let option =
                if matches!(why, Unfit::OutOfRange { .. } | Unfit::Nothing(_) | Unfit::NotOne(_)) { "--" } else { "" };
            Failure::Usage(format!("--profile {}: {option}{why}", told(name)))
        };
        self.course(name, simulation, &conditions).map_err(unfit)
    }

    fn course(&self, name: Name, simulation: &Simulation, conditions: &Conditions) -> Result<Course, Unfit> {
        let rate_hz = self.rate_hz(name);
        let acceleration = |from: f64| self.acceleration.unwrap_or(from);
        match name {
            Name::Staircase => self.staircase(Staircase::default()).course(rate_hz, conditions),
            Name::Ladder => {
                let from = match (&simulation.law, &self.preloads[..]) {
                    (_, [_, ..]) | (Law::CoulombViscous { .. } | Law::Column { .. }, _) => Ladder {
                        preloads_n: self.preloads.clone(),
                        staircase: Staircase { order: Order::Up, ..Staircase::default() },
                    },
                    (Law::Guide(set), []) => Ladder::of_paper(set.exact())?,
                };
                Ladder { staircase: self.staircase(from.staircase), ..from }.course(rate_hz, conditions)
            }
            Name::Map => {
                let from = Map::default();
                Map {
                    speeds_m_s: self.speeds_or(from.speeds_m_s),
                    length_m: self.length.unwrap_or(from.length_m),
                    strokes: self.strokes.unwrap_or(from.strokes),
                    pause_s: self.pause.unwrap_or(from.pause_s),
                    acceleration_m_s2: acceleration(from.acceleration_m_s2),
                }
                .course(rate_hz, conditions)
            }
            Name::Reversal => {
                let from = Reversal::default();
                Reversal {
                    amplitudes_m: or(&self.amplitudes, from.amplitudes_m),
                    frequencies_hz: or(&self.frequencies, from.frequencies_hz),
                    cycles: self.cycles.unwrap_or(from.cycles),
                }
                .course(rate_hz, conditions)
            }
            Name::Modulation => {
                let from = Modulation::default();
                Modulation {
                    speed_m_s: self.speed_or(from.speed_m_s)?,
                    depth: self.depth.unwrap_or(from.depth),
                    frequencies_hz: or(&self.frequencies, from.frequencies_hz),
                    cycles: self.cycles.unwrap_or(from.cycles),
                    hold_s: self.hold.unwrap_or(from.hold_s),
                    acceleration_m_s2: acceleration(from.acceleration_m_s2),
                }
                .course(rate_hz, conditions)
            }
            Name::Dwell => {
                let from = Dwell::default();
                Dwell {
                    dwells_s: or(&self.dwells, from.dwells_s),
                    speed_m_s: self.speed_or(from.speed_m_s)?,
                    length_m: self.length.unwrap_or(from.length_m),
                    acceleration_m_s2: acceleration(from.acceleration_m_s2),
                }
                .course(rate_hz, conditions)
            }
            Name::Warmup => {
                let from = WarmUp::default();
                let warming = |rise: Option<f64>, time: Option<f64>, from: Warming| Warming {
                    rise_k: rise.unwrap_or(from.rise_k),
                    time_s: time.unwrap_or(from.time_s),
                };
                WarmUp {
                    speed_m_s: self.speed_or(from.speed_m_s)?,
                    length_m: self.length.unwrap_or(from.length_m),
                    run_s: self.run.unwrap_or(from.run_s),
                    stop_s: self.stop.unwrap_or(from.stop_s),
                    resume_s: self.resume.unwrap_or(from.resume_s),
                    ambient_degc: self.ambient.unwrap_or(from.ambient_degc),
                    block: warming(self.block_rise, self.block_time, from.block),
                    rail: warming(self.rail_rise, self.rail_time, from.rail),
                    acceleration_m_s2: acceleration(from.acceleration_m_s2),
                }
                .course(rate_hz, conditions)
            }
        }
    }

    fn staircase(&self, from: Staircase) -> Staircase {
        Staircase {
            speeds_m_s: self.speeds_or(from.speeds_m_s),
            length_m: self.length.unwrap_or(from.length_m),
            hold_s: self.hold.unwrap_or(from.hold_s),
            strokes: self.strokes.unwrap_or(from.strokes),
            order: self.order.map_or(from.order, |order| match order {
                Direction::Up => Order::Up,
                Direction::Down => Order::Down,
                Direction::Both => Order::Both,
            }),
            pause_s: self.pause.unwrap_or(from.pause_s),
            acceleration_m_s2: self.acceleration.unwrap_or(from.acceleration_m_s2),
        }
    }

    fn speeds_or(&self, from: Vec<f64>) -> Vec<f64> {
        if self.speeds_m_min.is_empty() {
            return or(&self.speeds, from);
        }
        self.speeds_m_min.iter().map(|v| v / 60.0).collect()
    }

    fn speed_or(&self, from: f64) -> Result<f64, Unfit> {
        match self.speeds_or(vec![from])[..] {
            [one] => Ok(one),
            _ => Err(Unfit::NotOne("speeds")),
        }
    }

    fn refuse_what_means_nothing(&self, name: Name) -> Result<(), Failure> {
        let given = [
            ("preload", self.preload.is_some()),
            ("temperature", self.temperature.is_some()),
            ("speeds", !self.speeds.is_empty() || !self.speeds_m_min.is_empty()),
            ("preloads", !self.preloads.is_empty()),
            ("length", self.length.is_some()),
            ("hold", self.hold.is_some()),
            ("strokes", self.strokes.is_some()),
            ("order", self.order.is_some()),
            ("pause", self.pause.is_some()),
            ("acceleration", self.acceleration.is_some()),
            ("amplitudes", !self.amplitudes.is_empty()),
            ("frequencies", !self.frequencies.is_empty()),
            ("cycles", self.cycles.is_some()),
            ("depth", self.depth.is_some()),
            ("dwells", !self.dwells.is_empty()),
            ("run", self.run.is_some()),
            ("stop", self.stop.is_some()),
            ("resume", self.resume.is_some()),
            ("ambient", self.ambient.is_some()),
            ("block-rise", self.block_rise.is_some()),
            ("block-time", self.block_time.is_some()),
            ("rail-rise", self.rail_rise.is_some()),
            ("rail-time", self.rail_time.is_some()),
        ];
        if name == Name::Ladder && self.order == Some(Direction::Both) {
            let what = "a ladder has one segment per preload; give --order up or down";
            return Err(Failure::Usage(format!("--profile ladder: {what}")));
        }
        match given.iter().find(|(option, is_given)| *is_given && !name.takes().contains(option)) {
            None => Ok(()),
            Some((option, _)) => Err(Failure::Usage(format!(
                "--{option} means nothing to --profile {}, which takes: --rate, --external-load, --{}",
                told(name),
                name.takes().join(", --")
            ))),
        }
    }

    fn conditions(&self, name: Name, simulation: &Simulation) -> Result<Conditions, Failure> {
        let mut conditions = Conditions {
            preload_n: self.preload.or(simulation.preload_n),
            external_load_n: self.external_load,
            temperature_degc: self.temperature,
        };
        match &simulation.law {
            Law::Guide(set) => {
                if conditions.preload_n.is_none() && name != Name::Ladder {
                    let what = "the simulation has no operation.preload_n; give --preload";
                    return Err(Failure::Usage(format!("--profile {}: {what}", told(name))));
                }
                let needs_temperature = matches!(set.lubricant(), Lubricant::Walther(_));
                if needs_temperature && name != Name::Warmup && conditions.temperature_degc.is_none() {
                    say(format_args!(
                        "block and rail at {DEGC} °C, which the oil's viscosity needs; --temperature gives another one"
                    ));
                    conditions.temperature_degc = Some(DEGC);
                }
            }
            // the law has no preload, so it must not write a column of one
            Law::CoulombViscous { .. } => conditions.preload_n = self.preload,
            Law::Column { .. } => {
                let what = "the simulation has no law, only a recording's column simulated_force_n; add [guide]";
                return Err(Failure::Data(format!("--profile {}: {what}", told(name))));
            }
        }
        Ok(conditions)
    }
}

/// Its name on the command line.
pub(super) fn told(name: Name) -> String {
    name.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
}

/// The given values, or the usual ones if there are none.
fn or(given: &[f64], usual: Vec<f64>) -> Vec<f64> {
    if given.is_empty() { usual } else { given.to_vec() }
}
