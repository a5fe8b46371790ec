//! The test profiles on the command line.

use clap::ValueEnum;
use simulation::profile::{Dwell, Ladder, Map, Modulation, Profile, Reversal, SPEEDS_M_MIN, WarmUp};

/// A profile and its options.
#[derive(clap::Args)]
pub(super) struct ProfileArguments {
    /// Test profile to drive
    #[arg(long, value_enum, id = "profile")]
    profile: Option<Name>,
    /// Speeds, m/min
    #[arg(long, value_name = "M/MIN,...", value_delimiter = ',', requires = "profile")]
    speeds: Vec<f64>,
    /// Preloads of a ladder, N
    #[arg(long, value_name = "N,...", value_delimiter = ',', requires = "profile")]
    loads: Vec<f64>,
    /// Length of a stroke, m
    #[arg(long, value_name = "M", requires = "profile")]
    stroke: Option<f64>,
    /// Length of the rail that a map covers, m
    #[arg(long, value_name = "M", requires = "profile")]
    length: Option<f64>,
    /// Strokes to and fro, periods, or rounds
    #[arg(long, value_name = "N", requires = "profile")]
    repeats: Option<usize>,
    /// Go down the staircase again
    #[arg(long, requires = "profile")]
    down: bool,
    /// Amplitudes of reversal sinusoids, m
    #[arg(long, value_name = "M,...", value_delimiter = ',', requires = "profile")]
    amplitudes: Vec<f64>,
    /// Frequencies, Hz
    #[arg(long, value_name = "HZ,...", value_delimiter = ',', requires = "profile")]
    frequencies: Vec<f64>,
    /// Times of rest, s
    #[arg(long, value_name = "S,...", value_delimiter = ',', requires = "profile")]
    dwells: Vec<f64>,
    /// Duration of a warm-up, s; the pause takes half and the second running a tenth of it
    #[arg(long, value_name = "S", requires = "profile")]
    duration: Option<f64>,
    /// Rows a second
    #[arg(long, value_name = "HZ", default_value_t = 200.0)]
    pub(super) rate: f64,
    /// Acceleration of ramps, m/s²
    #[arg(long, value_name = "M/S2", default_value_t = 1.0)]
    pub(super) acceleration: f64,
    /// Preload, N; goes before that of the simulation file
    #[arg(long, value_name = "N", requires = "profile")]
    pub(super) preload: Option<f64>,
    /// Temperature, of the oil or of the surroundings, °C
    #[arg(long, value_name = "DEGC", default_value_t = 25.0)]
    pub(super) temperature: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Name {
    /// strokes to and fro at rising speeds
    Staircase,
    /// the staircase at several preloads
    Ladder,
    /// the full stroke, slow and fast
    Map,
    /// sinusoids about one place
    Reversal,
    /// speed swinging about a mean
    Modulation,
    /// rest, start slowly, rest longer
    Dwell,
    /// to and fro, a pause, and on
    WarmUp,
}

/// Options of which every profile takes some.
const OPTIONS: [&str; 10] =
    ["speeds", "loads", "stroke", "length", "repeats", "down", "amplitudes", "frequencies", "dwells", "duration"];

impl Name {
    const fn takes(self) -> &'static [&'static str] {
        match self {
            Name::Staircase => &["speeds", "stroke", "repeats", "down"],
            Name::Ladder => &["speeds", "loads", "stroke", "repeats", "down"],
            Name::Map => &["speeds", "length", "repeats"],
            Name::Reversal => &["amplitudes", "frequencies", "repeats"],
            Name::Modulation => &["speeds", "frequencies", "repeats"],
            Name::Dwell => &["dwells", "speeds", "stroke", "repeats"],
            Name::WarmUp => &["duration", "speeds", "stroke"],
        }
    }
}

impl ProfileArguments {
    /// Name of the profile.
    pub(super) fn name(&self) -> String {
        let value = self.profile.and_then(|name| name.to_possible_value());
        value.map_or_else(String::new, |value| value.get_name().to_owned())
    }

    /// The profile. The error is one of usage.
    pub(super) fn profile(&self) -> Result<Box<dyn Profile>, String> {
        let Some(name) = self.profile else { return Err("give a recording or --profile".to_owned()) };
        let is_given = [
            !self.speeds.is_empty(),
            !self.loads.is_empty(),
            self.stroke.is_some(),
            self.length.is_some(),
            self.repeats.is_some(),
            self.down,
            !self.amplitudes.is_empty(),
            !self.frequencies.is_empty(),
            !self.dwells.is_empty(),
            self.duration.is_some(),
        ];
        if let Some((stray, _)) =
            OPTIONS.iter().zip(is_given).find(|(option, given)| *given && !name.takes().contains(option))
        {
            let takes: Vec<String> = name.takes().iter().map(|option| format!("--{option}")).collect();
            return Err(format!("--profile {} takes no --{stray}; it takes {}", self.name(), takes.join(", ")));
        }
        let or = |given: &[f64], usual: &[f64]| if given.is_empty() { usual.to_vec() } else { given.to_vec() };
        let speeds = |usual: &[f64]| -> Vec<f64> { or(&self.speeds, usual).iter().map(|v| v / 60.0).collect() };
        let speed = |usual: f64| -> Result<f64, String> {
            match speeds(&[usual]).as_slice() {
                [one] => Ok(*one),
                _ => Err(format!("--profile {} takes one speed", self.name())),
            }
        };
        let stroke = |usual: f64| self.stroke.unwrap_or(usual);
        Ok(match name {
            Name::Staircase | Name::Ladder => Box::new(Ladder {
                preloads_n: if name == Name::Staircase {
                    Vec::new()
                } else {
                    or(&self.loads, &[500.0, 1500.0, 2500.0, 3500.0, 4500.0, 5500.0, 6500.0, 7500.0, 8500.0, 9500.0])
                },
                speeds_m_s: speeds(&SPEEDS_M_MIN),
                // five ball-pass lengths
                stroke_m: stroke(0.072),
                repeats: self.repeats.unwrap_or(1),
                and_down: self.down,
            }),
            Name::Map => Box::new(Map {
                speeds_m_s: speeds(&[0.6, 6.0]),
                length_m: self.length.unwrap_or(0.5),
                repeats: self.repeats.unwrap_or(5),
            }),
            Name::Reversal => Box::new(Reversal {
                amplitudes_m: or(&self.amplitudes, &[1e-4, 2e-3]),
                frequencies_hz: or(&self.frequencies, &[0.05, 0.5]),
                periods: self.repeats.unwrap_or(5),
            }),
            Name::Modulation => Box::new(Modulation {
                speed_m_s: speed(3.0)?,
                frequencies_hz: or(&self.frequencies, &[0.1, 1.0, 5.0]),
                periods: self.repeats.unwrap_or(3),
            }),
            Name::Dwell => Box::new(Dwell {
                dwells_s: or(&self.dwells, &[1.0, 10.0, 100.0]),
                speed_m_s: speed(0.1)?,
                stroke_m: stroke(0.005),
                repeats: self.repeats.unwrap_or(2),
            }),
            Name::WarmUp => Box::new(WarmUp {
                speed_m_s: speed(6.0)?,
                stroke_m: stroke(0.3),
                duration_s: self.duration.unwrap_or(3600.0),
                ambient_degc: self.temperature,
            }),
        })
    }
}
