//! Liveness: which runners have shown a sign of life since the watchdog was fed.

use core::sync::atomic::{AtomicU8, Ordering};

/// Runner that must report.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Member {
    /// [`Acquire`](crate::runners::acquire::Acquire).
    Acquire = 0,
    /// [`Estimate`](crate::runners::estimate::Estimate).
    Estimate = 1,
    /// [`Publish`](crate::runners::publish::Publish).
    Publish = 2,
    /// [`Serve`](crate::runners::serve::Serve).
    Serve = 3,
}

/// Longest time a runner may go without reporting, and time between two checks of the supervisor, µs.
///
/// So the watchdog is fed at least every 200 ms. Its nominal 500 ms are 340 ms when the oscillator that clocks it
/// runs at 47 kHz instead of 32 kHz (the F405's may).
pub const REPORT_WITHIN_US: u64 = 100_000;

/// The members heard since the last feeding.
#[derive(Debug, Default)]
pub struct Liveness {
    heard: AtomicU8,
}

impl Liveness {
    const ALL: u8 = 0b1111;

    /// Nobody heard yet.
    pub const fn new() -> Self {
        Liveness { heard: AtomicU8::new(0) }
    }

    /// A sign of life.
    pub fn report(&self, member: Member) {
        self.heard.fetch_or(1 << member as u8, Ordering::Relaxed);
    }

    /// Whether all have reported; if so, all have to report again.
    pub fn take_all(&self) -> bool {
        self.heard.compare_exchange(Self::ALL, 0, Ordering::Relaxed, Ordering::Relaxed).is_ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_silent_member_is_enough() {
        for silent in [Member::Acquire, Member::Estimate, Member::Publish, Member::Serve] {
            let liveness = Liveness::new();
            for member in [Member::Acquire, Member::Estimate, Member::Publish, Member::Serve] {
                if member != silent {
                    liveness.report(member);
                    liveness.report(member);
                }
            }
            assert!(!liveness.take_all(), "{silent:?}");
            liveness.report(silent);
            assert!(liveness.take_all());
            assert!(!liveness.take_all(), "everyone reports anew");
        }
    }
}
