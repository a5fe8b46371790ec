//! Position of the encoder: a straight line in time from one count to another.

use crate::Nanos;

/// The encoder's position as a whole number of counts, moving evenly or standing still.
///
/// Counts change one at a time, at equal distances in time, so an edge belongs to each of them.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Motion {
    from: i64,
    to: i64,
    begins: Nanos,
    ends: Nanos,
}

impl Motion {
    /// Moves evenly from wherever it stands at `now` to `counts`, which it reaches at `by`.
    ///
    /// A `by` that is not after `now` is a jump: all edges fall on `now`.
    pub(crate) fn move_to(&mut self, now: Nanos, counts: i64, by: Nanos) {
        *self = Self { from: self.at(now), to: counts, begins: now, ends: by };
    }

    /// The count at `now`; before the movement began, its first count.
    pub(crate) fn at(&self, now: Nanos) -> i64 {
        if now >= self.ends {
            return self.to;
        }
        // Here `begins <= now < ends` or `now < begins < ends`, so the span is never zero.
        let done = i128::from(now.saturating_sub(self.begins));
        let span = i128::from(self.ends - self.begins);
        // Between `from` and `to`, so the cast keeps it.
        self.from + (i128::from(self.to - self.from) * done / span) as i64
    }
}

#[cfg(test)]
mod tests {
    use super::Motion;

    #[test]
    fn counts_are_spread_evenly_and_end_where_told() {
        let mut motion = Motion::default();
        motion.move_to(1_000, 4, 1_400);
        let seen: Vec<i64> = (0..=5).map(|step| motion.at(1_000 + 100 * step)).collect();
        assert_eq!(seen, [0, 1, 2, 3, 4, 4]);
        assert_eq!(motion.at(0), 0, "before it began");
    }

    #[test]
    fn a_new_target_starts_from_the_count_reached() {
        let mut motion = Motion::default();
        motion.move_to(0, 100, 1_000);
        motion.move_to(500, -50, 1_500);
        assert_eq!(motion.at(500), 50);
        assert_eq!(motion.at(1_000), 0);
        assert_eq!(motion.at(2_000), -50);
    }

    #[test]
    fn a_target_in_the_past_is_a_jump() {
        let mut motion = Motion::default();
        motion.move_to(700, 9, 700);
        assert_eq!(motion.at(700), 9);
    }
}
