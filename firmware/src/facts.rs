//! Shared facts: single words that one runner writes and others read at any time.

use core::sync::atomic::{AtomicBool, AtomicU8, AtomicU16, AtomicU32, Ordering};

use can_wire::service::Limits;

/// No limit; the largest preload on the bus is below it.
const OFF: u16 = u16::MAX;

/// A count that can be set to 0 without its owner knowing.
#[derive(Debug, Default)]
pub struct Count {
    now: AtomicU32,
    at_clearing: AtomicU32,
}

impl Count {
    const fn new() -> Self {
        Count { now: AtomicU32::new(0), at_clearing: AtomicU32::new(0) }
    }

    /// The owner's count since start-up.
    pub fn set(&self, count: u32) {
        self.now.store(count, Ordering::Relaxed);
    }

    /// The count since it was cleared.
    pub fn get(&self) -> u32 {
        self.now.load(Ordering::Relaxed).wrapping_sub(self.at_clearing.load(Ordering::Relaxed))
    }

    /// Counts from here on.
    pub fn clear(&self) {
        self.at_clearing.store(self.now.load(Ordering::Relaxed), Ordering::Relaxed);
    }
}

/// Facts that Publish and Serve share.
#[derive(Debug)]
pub struct Facts {
    /// Blocks of samples lost. Written by Publish.
    pub lost_blocks: Count,
    /// Frames displaced by newer ones. Written by Publish.
    pub frames_dropped: Count,
    /// Times the controller left the bus. Written by Publish.
    pub bus_offs: Count,
    /// CiA 301 error register. Written by Publish.
    pub error_register: AtomicU8,
    /// Changes that were accepted. Written by Serve.
    pub changes: AtomicU32,
    /// Whether the block accepts changes. Written by Serve.
    pub unlocked: AtomicBool,
    /// Whether a burst is under way. Written by Serve.
    pub bursting: AtomicBool,
    /// Limits of the preload from low to high. Written by Serve.
    limits: [AtomicU16; 4],
}

impl Facts {
    /// Nothing known.
    pub const fn new() -> Self {
        Facts {
            lost_blocks: Count::new(),
            frames_dropped: Count::new(),
            bus_offs: Count::new(),
            error_register: AtomicU8::new(0),
            changes: AtomicU32::new(0),
            unlocked: AtomicBool::new(false),
            bursting: AtomicBool::new(false),
            limits: [const { AtomicU16::new(OFF) }; 4],
        }
    }

    /// Uses these limits from now on.
    pub fn set_limits(&self, limits: &Limits) {
        let Limits { alarm_below_n, warn_below_n, warn_above_n, alarm_above_n } = *limits;
        for (place, limit) in self.limits.iter().zip([alarm_below_n, warn_below_n, warn_above_n, alarm_above_n]) {
            place.store(limit.unwrap_or(OFF), Ordering::Relaxed);
        }
    }

    /// The limits of the preload.
    pub fn limits(&self) -> Limits {
        let [alarm_below_n, warn_below_n, warn_above_n, alarm_above_n] =
            [0, 1, 2, 3].map(|n| self.limits.get(n).map(|l| l.load(Ordering::Relaxed)).filter(|l| *l != OFF));
        Limits { alarm_below_n, warn_below_n, warn_above_n, alarm_above_n }
    }
}

impl Default for Facts {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cleared_count_goes_on_from_there() {
        let count = Count::new();
        count.set(7);
        count.clear();
        assert_eq!(count.get(), 0);
        count.set(9);
        assert_eq!(count.get(), 2);
    }

    #[test]
    fn limits_survive() {
        let facts = Facts::new();
        assert_eq!(facts.limits(), Limits::OFF);
        let limits = Limits { warn_below_n: Some(2000), alarm_above_n: Some(0), ..Limits::OFF };
        facts.set_limits(&limits);
        assert_eq!(facts.limits(), limits);
    }
}
