//! Axes along which a curve can lie.

use crate::mechanism::Context;

/// Axis along which a curve can lie.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// Direction of motion, -1 or 1; at rest the last one.
    Direction,
    /// Speed, m/s, without sign.
    Velocity,
    /// Known vertical load on the block, N.
    Load,
    /// Preload that was measured, N.
    Preload,
    /// Position along the rail, m.
    Position,
    /// Time since the first row of the run, s.
    Time,
    /// Distance travelled since the first row of the run, m.
    Travel,
    /// Temperature of the block, °C.
    Temperature,
    /// Temperature of the block less that of the rail, K.
    TemperatureDifference,
    /// Acceleration along travel, m/s².
    Acceleration,
    /// Distance since the last reversal or the last start after a rest, m.
    ReversalDistance,
    /// How long the carriage rested before the present movement, s.
    Dwell,
    /// Time of the recording modulo a period, s: for effects in step with another machine's clock.
    Clock,
    /// Time since the carriage last set out or turned within a part of the run, s.
    SinceTurn,
}

impl Axis {
    /// All of them.
    pub const ALL: [Axis; 14] = [
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
        Axis::Clock,
        Axis::SinceTurn,
    ];

    /// Name in files and reports.
    pub const fn name(self) -> &'static str {
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
            Axis::Clock => "clock",
            Axis::SinceTurn => "time-since-turn",
        }
    }

    /// The axis of this name; `None` where there is none.
    pub fn of_name(name: &str) -> Option<Self> {
        Axis::ALL.into_iter().find(|axis| axis.name() == name)
    }

    /// Unit of its values.
    pub const fn unit(self) -> &'static str {
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

    /// Least and largest value of a knot, in the unit of the axis; unsigned quantities start at 0.
    pub const fn ends(self) -> [f64; 2] {
        match self {
            Axis::Direction => [-1.0, 1.0],
            Axis::Velocity
            | Axis::Preload
            | Axis::Travel
            | Axis::ReversalDistance
            | Axis::Dwell
            | Axis::Clock
            | Axis::SinceTurn => [0.0, 1e12],
            // after a jump back, the clock may lie before its first row
            Axis::Load
            | Axis::Position
            | Axis::Time
            | Axis::Temperature
            | Axis::TemperatureDifference
            | Axis::Acceleration => [-1e12, 1e12],
        }
    }

    /// Value of every row of a run, in [`Axis::unit`], NaN where it is unknown; `None` where the run does not measure
    /// it. A clock returns the time of the recording; the period belongs to the curve.
    pub fn values(self, context: &Context<'_>) -> Option<Vec<f64>> {
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
}

/// Time since the direction of motion last changed, for every row of a run; NaN where that was before the row's part.
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
