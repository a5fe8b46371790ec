//! What goes into the on-board pipeline, what comes out, and why a value may not be trusted.

/// Samples of one block.
pub const SAMPLES_PER_BLOCK: usize = 16;

/// Sampling rate of force, temperature and position, Hz. One timer starts all three.
pub const SAMPLE_HZ: u32 = 1600;

/// Blocks per second.
pub const BLOCK_HZ: u32 = SAMPLE_HZ / SAMPLES_PER_BLOCK as u32;

/// Length of one block, s.
pub const BLOCK_PERIOD_S: f32 = 1.0 / BLOCK_HZ as f32;

/// One block as converters and encoder delivered it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RawBlock {
    /// Number of block periods since start-up; wraps after 497 days. A jump means that samples were lost.
    pub tick: u32,
    /// Codes of the force converter, 0 to 4095.
    pub force: [u16; SAMPLES_PER_BLOCK],
    /// Codes of the temperature converter, 0 to 4095.
    pub temperature: [u16; SAMPLES_PER_BLOCK],
    /// Encoder counts, the low 16 bits, taken at the same instants as the codes.
    pub position: [u16; SAMPLES_PER_BLOCK],
}

/// A value with its standard deviation, same unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// Best value.
    pub value: f32,
    /// Standard deviation (1 σ) of all that is known to disturb it.
    pub sigma: f32,
}

/// Why an estimate carries no preload.
///
/// The number is the bit in [`Reasons`] and the code on the bus. Several may hold at once; the one with the
/// smallest number is the one to look at first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum Reason {
    /// No parameter record, or one that does not say it is calibrated.
    NotCalibrated = 1,
    /// A force code lies at an end of the converter's range: overload, broken bridge or short.
    ForceAtRail = 2,
    /// The force code has not moved by a single count over a whole window.
    ForceStuck = 3,
    /// The encoder fell silent at full speed while the drag force went on.
    EncoderStuck = 4,
    /// Thermometer open or short.
    TemperatureMissing = 5,
    /// Temperature outside the range that the oil's viscosity is known for.
    TemperatureOutOfRange = 6,
    /// Samples were lost within the window (converter overrun, restart of the sampler).
    SamplesLost = 7,
    /// The carriage stands.
    NoMotion = 8,
    /// The carriage turned round, or has not yet left the presliding zone after it.
    Reversing = 9,
    /// The speed changes too much within the window for a steady drag force.
    Accelerating = 10,
    /// The window is not full yet.
    Settling = 11,
    /// Speed outside the calibrated range.
    SpeedOutOfRange = 12,
    /// Drag force or preload outside the calibrated range.
    LoadOutOfRange = 13,
    /// The force drives the carriage instead of braking it: something outside the guide pushes.
    ForceAssists = 14,
    /// No new samples came: nothing newer is known.
    Stale = 15,
}

impl Reason {
    /// All reasons, most urgent first.
    pub const ALL: [Reason; 15] = [
        Reason::NotCalibrated,
        Reason::ForceAtRail,
        Reason::ForceStuck,
        Reason::EncoderStuck,
        Reason::TemperatureMissing,
        Reason::TemperatureOutOfRange,
        Reason::SamplesLost,
        Reason::NoMotion,
        Reason::Reversing,
        Reason::Accelerating,
        Reason::Settling,
        Reason::SpeedOutOfRange,
        Reason::LoadOutOfRange,
        Reason::ForceAssists,
        Reason::Stale,
    ];

    /// The name used in tables, CSV and JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Reason::NotCalibrated => "not-calibrated",
            Reason::ForceAtRail => "force-at-rail",
            Reason::ForceStuck => "force-stuck",
            Reason::EncoderStuck => "encoder-stuck",
            Reason::TemperatureMissing => "temperature-missing",
            Reason::TemperatureOutOfRange => "temperature-out-of-range",
            Reason::SamplesLost => "samples-lost",
            Reason::NoMotion => "no-motion",
            Reason::Reversing => "reversing",
            Reason::Accelerating => "accelerating",
            Reason::Settling => "settling",
            Reason::SpeedOutOfRange => "speed-out-of-range",
            Reason::LoadOutOfRange => "load-out-of-range",
            Reason::ForceAssists => "force-assists",
            Reason::Stale => "stale",
        }
    }

    /// The reason with this code; `None` for 0 (trusted) and codes above 15.
    pub fn from_code(code: u8) -> Option<Reason> {
        Self::ALL.into_iter().find(|r| *r as u8 == code)
    }
}

/// A set of reasons; empty means that the estimate may be trusted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Reasons(u16);

impl Reasons {
    /// No reason against the estimate.
    pub const NONE: Reasons = Reasons(0);

    /// Adds a reason.
    #[inline]
    pub fn insert(&mut self, reason: Reason) {
        self.0 |= 1 << reason as u16;
    }

    /// Adds a reason if it holds.
    #[inline]
    pub fn insert_if(&mut self, holds: bool, reason: Reason) {
        self.0 |= u16::from(holds) << reason as u16;
    }

    /// Whether the reason is in the set.
    pub fn contains(self, reason: Reason) -> bool {
        self.0 >> reason as u16 & 1 == 1
    }

    /// No reason at all: the estimate may be trusted.
    pub fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// The most urgent reason.
    pub fn first(self) -> Option<Reason> {
        Reason::from_code(self.first_code())
    }

    /// Code of the most urgent reason, 0 when there is none.
    pub fn first_code(self) -> u8 {
        if self.0 == 0 { 0 } else { self.0.trailing_zeros() as u8 }
    }

    /// Bit n set: the reason with code n holds. Bit 0 is never set.
    pub const fn bits(self) -> u16 {
        self.0
    }

    /// The set with these bits; bit 0 is ignored.
    pub const fn from_bits(bits: u16) -> Self {
        Reasons(bits & !1)
    }

    /// The reasons in the set, most urgent first.
    pub fn iter(self) -> impl Iterator<Item = Reason> {
        Reason::ALL.into_iter().filter(move |r| self.contains(*r))
    }
}

/// What the carriage does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Motion {
    /// Not known yet, or no longer.
    Unknown = 0,
    /// Standing.
    Rest = 1,
    /// Steady, towards larger positions.
    Forward = 2,
    /// Steady, towards smaller positions.
    Backward = 3,
    /// Turning round, or just after it.
    Reversing = 4,
    /// Gaining or losing speed.
    Accelerating = 5,
}

impl Motion {
    /// All states.
    pub const ALL: [Motion; 6] =
        [Motion::Unknown, Motion::Rest, Motion::Forward, Motion::Backward, Motion::Reversing, Motion::Accelerating];

    /// The name used in tables, CSV and JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Motion::Unknown => "unknown",
            Motion::Rest => "rest",
            Motion::Forward => "forward",
            Motion::Backward => "backward",
            Motion::Reversing => "reversing",
            Motion::Accelerating => "accelerating",
        }
    }

    /// The state with this code.
    pub fn from_code(code: u8) -> Option<Motion> {
        Self::ALL.into_iter().find(|m| *m as u8 == code)
    }
}

/// What the block knows at one instant. Every number that is not known is `None`, never a guess.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Tick of the newest block in it.
    pub tick: u32,
    /// Preload, N; only when [`reasons`](Self::reasons) is empty.
    pub preload_n: Option<Measured>,
    /// Drag force in steady motion, N, positive when it opposes the motion; seals included.
    pub drag_force_n: Option<Measured>,
    /// Carriage speed, m/s, signed.
    pub speed_m_s: Option<Measured>,
    /// Temperature of the block, °C.
    pub temperature_degc: Option<f32>,
    /// What the carriage does.
    pub motion: Motion,
    /// Why there is no preload; empty when there is one.
    pub reasons: Reasons,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reasons_keep_their_codes_and_order() {
        for (n, reason) in Reason::ALL.into_iter().enumerate() {
            assert_eq!(reason as usize, n + 1);
            assert_eq!(Reason::from_code(n as u8 + 1), Some(reason));
            let mut set = Reasons::NONE;
            set.insert(reason);
            assert_eq!(set.bits(), 2 << n);
            assert_eq!(set.first(), Some(reason));
            assert!(Reason::ALL[..n].iter().all(|o| o.name() != reason.name()));
        }
        assert_eq!(Reason::from_code(0), None);
        assert_eq!(Reason::from_code(16), None);
        assert_eq!(Reasons::from_bits(1), Reasons::NONE);
        let mut two = Reasons::NONE;
        two.insert(Reason::Stale);
        two.insert_if(true, Reason::ForceAtRail);
        two.insert_if(false, Reason::NotCalibrated);
        assert_eq!(two.first_code(), 2);
        assert!(two.iter().eq([Reason::ForceAtRail, Reason::Stale]));
    }

    #[test]
    fn motion_codes_are_stable() {
        for (n, m) in Motion::ALL.into_iter().enumerate() {
            assert_eq!(m as usize, n);
            assert_eq!(Motion::from_code(n as u8), Some(m));
        }
        assert_eq!(Motion::from_code(6), None);
    }
}
