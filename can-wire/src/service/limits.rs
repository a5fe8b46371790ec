//! Warning and alarm limits of the preload.

use super::Abort;

/// A limit that is switched off.
pub(crate) const OFF: u16 = 0xFFFF;

/// Limits of the preload, N. `None` is off.
///
/// Where set, `alarm_below ≤ warn_below ≤ warn_above ≤ alarm_above`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Limits {
    /// Alarm below this.
    pub alarm_below_n: Option<u16>,
    /// Warning below this.
    pub warn_below_n: Option<u16>,
    /// Warning above this.
    pub warn_above_n: Option<u16>,
    /// Alarm above this.
    pub alarm_above_n: Option<u16>,
}

/// Position of the preload relative to its limits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum LimitState {
    /// No limit is set, or no preload is known.
    #[default]
    NotJudged = 0,
    /// Within all limits.
    Within = 1,
    /// Beyond a warning limit.
    Warning = 2,
    /// Beyond an alarm limit.
    Alarm = 3,
}

impl LimitState {
    /// All states, by code.
    pub const ALL: [LimitState; 4] =
        [LimitState::NotJudged, LimitState::Within, LimitState::Warning, LimitState::Alarm];

    /// The name used in tables, CSV and JSON.
    pub const fn name(self) -> &'static str {
        match self {
            LimitState::NotJudged => "not-judged",
            LimitState::Within => "within",
            LimitState::Warning => "warning",
            LimitState::Alarm => "alarm",
        }
    }
}

impl Limits {
    /// No limit is set.
    pub const OFF: Limits = Limits { alarm_below_n: None, warn_below_n: None, warn_above_n: None, alarm_above_n: None };

    /// The limits from low to high.
    pub(crate) fn rising(self) -> [Option<u16>; 4] {
        [self.alarm_below_n, self.warn_below_n, self.warn_above_n, self.alarm_above_n]
    }

    /// The limits from a list as that of [`rising`](Self::rising).
    ///
    /// # Errors
    /// [`Abort::Incompatible`] when they do not rise, [`Abort::TooHigh`] for one that no preload can have.
    pub(crate) fn of(rising: [Option<u16>; 4]) -> Result<Limits, Abort> {
        let mut before = 0;
        for limit in rising.into_iter().flatten() {
            if limit > crate::number::MAX_U16 {
                return Err(Abort::TooHigh);
            }
            if limit < before {
                return Err(Abort::Incompatible);
            }
            before = limit;
        }
        let [alarm_below_n, warn_below_n, warn_above_n, alarm_above_n] = rising;
        Ok(Limits { alarm_below_n, warn_below_n, warn_above_n, alarm_above_n })
    }

    /// Judges a preload, N; without a preload, or without limits, it is not judged.
    pub fn judge(&self, preload_n: Option<f32>) -> LimitState {
        let Some(preload_n) = preload_n.filter(|p| p.is_finite()) else { return LimitState::NotJudged };
        if *self == Limits::OFF {
            return LimitState::NotJudged;
        }
        let below = |limit: Option<u16>| limit.is_some_and(|l| preload_n < f32::from(l));
        let above = |limit: Option<u16>| limit.is_some_and(|l| preload_n > f32::from(l));
        if below(self.alarm_below_n) || above(self.alarm_above_n) {
            LimitState::Alarm
        } else if below(self.warn_below_n) || above(self.warn_above_n) {
            LimitState::Warning
        } else {
            LimitState::Within
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_preload_is_judged() {
        let limits = Limits::of([Some(1000), Some(1500), Some(4000), None]).unwrap();
        for (preload, state) in [
            (999.9, LimitState::Alarm),
            (1000.0, LimitState::Warning),
            (1499.0, LimitState::Warning),
            (1500.0, LimitState::Within),
            (4000.0, LimitState::Within),
            (4000.1, LimitState::Warning),
            (60_000.0, LimitState::Warning),
            (f32::NAN, LimitState::NotJudged),
        ] {
            assert_eq!(limits.judge(Some(preload)), state, "{preload}");
        }
        assert_eq!(limits.judge(None), LimitState::NotJudged);
        assert_eq!(Limits::OFF.judge(Some(1.0)), LimitState::NotJudged);
    }

    #[test]
    fn limits_rise() {
        assert_eq!(Limits::of([Some(2), Some(1), None, None]), Err(Abort::Incompatible));
        assert_eq!(Limits::of([Some(2), None, None, Some(1)]), Err(Abort::Incompatible));
        assert_eq!(Limits::of([None, None, None, Some(0xFFFC)]), Err(Abort::TooHigh));
        assert!(Limits::of([Some(2), Some(2), Some(2), Some(2)]).is_ok());
        assert_eq!(Limits::of([None; 4]), Ok(Limits::OFF));
    }
}
