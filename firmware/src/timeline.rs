//! Numbering of blocks: while samples flow they count the time; the clock counts the time lost in between.

use model_core::sample::BLOCK_HZ;

/// Length of a block, µs.
pub const BLOCK_US: u64 = 1_000_000 / BLOCK_HZ as u64;

/// Numbers the blocks of all runs of the sampler.
#[derive(Clone, Copy, Debug, Default)]
pub struct Timeline {
    started_us: Option<u64>,
    next: u32,
}

impl Timeline {
    /// Before the first run.
    pub const fn new() -> Self {
        Timeline { started_us: None, next: 0 }
    }

    /// A run starts at `now_us`. The first one starts at tick 0, every later one at the tick given by the clock, but
    /// leaves out at least one tick, since an interruption always costs samples.
    pub fn resume(&mut self, now_us: u64) {
        let Some(started_us) = self.started_us else {
            self.started_us = Some(now_us);
            return;
        };
        let elapsed = (now_us.saturating_sub(started_us) + BLOCK_US / 2) / BLOCK_US;
        // the ticks of the protocol wrap as well
        let by_clock = elapsed as u32;
        let behind_gap = self.next.wrapping_add(1);
        let clock_is_ahead = by_clock.wrapping_sub(behind_gap) < u32::MAX / 2;
        self.next = if clock_is_ahead { by_clock } else { behind_gap };
    }

    /// The number of the block that has just arrived.
    pub fn tick(&mut self) -> u32 {
        let tick = self.next;
        self.next = tick.wrapping_add(1);
        tick
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_of_one_run_follow_each_other() {
        let mut timeline = Timeline::new();
        timeline.resume(65_000);
        assert_eq!([timeline.tick(), timeline.tick(), timeline.tick()], [0, 1, 2]);
    }

    #[test]
    fn a_restart_jumps_by_the_whole_blocks_lost() {
        // started at 65 ms, blocks 0 and 1, restarted 100 ms after the start
        for (restart_us, expected) in [(165_000, 10), (169_999, 10), (170_000, 11), (174_999, 11)] {
            let mut timeline = Timeline::new();
            timeline.resume(65_000);
            let _ = (timeline.tick(), timeline.tick());
            timeline.resume(restart_us);
            assert_eq!(timeline.tick(), expected, "{restart_us}");
        }
    }

    #[test]
    fn the_shortest_interruption_still_shows() {
        let mut timeline = Timeline::new();
        timeline.resume(0);
        let _ = (timeline.tick(), timeline.tick());
        timeline.resume(20_100);
        assert_eq!(timeline.tick(), 3);
    }

    #[test]
    fn ticks_wrap_and_so_does_a_gap_there() {
        let mut timeline = Timeline { started_us: Some(0), next: u32::MAX };
        assert_eq!([timeline.tick(), timeline.tick()], [u32::MAX, 0]);
        let mut timeline = Timeline { started_us: Some(0), next: u32::MAX };
        timeline.resume((u64::from(u32::MAX) + 6) * BLOCK_US);
        assert_eq!(timeline.tick(), 5);
    }
}
