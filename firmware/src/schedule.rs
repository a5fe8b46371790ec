//! Schedule of periodic events.

/// An event with a fixed period.
#[derive(Clone, Copy, Debug)]
pub struct Every {
    period_us: u64,
    next_us: u64,
}

impl Every {
    /// Due at `first_us` and then every `period_us`.
    pub const fn new(period_us: u64, first_us: u64) -> Self {
        Every { period_us, next_us: first_us }
    }

    /// Whether it is due. Periods that were missed are skipped, not made up for.
    pub fn is_due(&mut self, now_us: u64) -> bool {
        let due = now_us >= self.next_us;
        if due {
            let missed = (now_us - self.next_us) / self.period_us;
            self.next_us += (missed + 1) * self.period_us;
        }
        due
    }

    /// When it is due next, µs.
    pub const fn next_us(&self) -> u64 {
        self.next_us
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_keeps_its_phase() {
        let mut every = Every::new(500, 100);
        let due: Vec<u64> = (0..2000).filter(|t| every.is_due(*t)).collect();
        assert_eq!(due, [100, 600, 1100, 1600]);
    }

    #[test]
    fn missed_periods_are_skipped() {
        let mut every = Every::new(500, 0);
        assert!(every.is_due(1730));
        assert_eq!(every.next_us(), 2000);
        assert!(!every.is_due(1999));
        assert!(every.is_due(2000));
    }
}
