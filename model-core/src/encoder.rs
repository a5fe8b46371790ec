//! The encoder: counts without wrap, travel since the last reversal, and detection of a dead scale.

use crate::sample::SAMPLES_PER_BLOCK;

/// Counts against the direction of travel that are dither of a standing scale, not a reversal.
const DITHER_COUNTS: i32 = 2;

/// How far the last moving block may fall short of uniform motion up to its very last count, in counts, for
/// the stop to be called abrupt. Smaller: counting noise hides a dead encoder. Larger: a hard stop of the
/// axis looks like one.
const SHORTFALL_COUNTS: f32 = 1.5;

/// Shortfall of the hardest braking that the axis can do, in counts, from which a dead encoder can be told from a stop
/// at all. Below it (slow motion) a dead encoder reads as standstill, which gives no number either.
const VISIBLE_COUNTS: f32 = 3.0;

/// Share of the drag force before the stop that must remain for the encoder, not the axis, to have stopped.
const FORCE_REMAINS: f32 = 0.7;

/// Result of one block of counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Step {
    /// Counts travelled in the block, signed.
    pub counts: i32,
    /// Position at the block's last sample, counts since the first sample seen.
    pub position: i32,
}

/// What the encoder remembers between blocks.
#[derive(Clone, Copy, Debug)]
pub struct Encoder {
    last_code: Option<u16>,
    position: i32,
    /// furthest point in the direction of travel
    extreme: i32,
    /// +1, -1, or 0 before the first motion
    direction: i32,
    /// where the motion in this direction began
    turned_at: i32,
    previous: Block,
    suspect: Option<f32>,
    stuck: bool,
}

#[derive(Clone, Copy, Debug, Default)]
struct Block {
    counts: i32,
    force: f32,
}

impl Encoder {
    /// Nothing known yet.
    pub const fn new() -> Self {
        Encoder {
            last_code: None,
            position: 0,
            extreme: 0,
            direction: 0,
            turned_at: 0,
            previous: Block { counts: 0, force: 0.0 },
            suspect: None,
            stuck: false,
        }
    }

    /// Takes a block of counts and the block's mean force, N.
    ///
    /// `metres_per_count` and `braking_limit_m_s2` decide which stops an axis can make. At most 32 767 counts
    /// between two samples: 262 m/s at 5 µm.
    pub fn step(
        &mut self,
        codes: &[u16; SAMPLES_PER_BLOCK],
        force_n: f32,
        metres_per_count: f32,
        braking_limit_m_s2: f32,
        sample_period_s: f32,
    ) -> Step {
        let mut last = match self.last_code {
            Some(code) => code,
            None => codes[0],
        };
        let mut counts = 0;
        // samples up to and including the last one that moved
        let mut moving = 0;
        for (n, code) in codes.iter().enumerate() {
            let moved = i32::from(code.wrapping_sub(last) as i16);
            if moved != 0 {
                moving = n + 1;
            }
            counts += moved;
            last = *code;
        }
        self.last_code = Some(last);
        self.position = self.position.wrapping_add(counts);
        self.follow_direction();
        self.watch(counts, moving, force_n, metres_per_count, braking_limit_m_s2, sample_period_s);
        self.previous = Block { counts, force: force_n };
        Step { counts, position: self.position }
    }

    fn follow_direction(&mut self) {
        let ahead = self.position.wrapping_sub(self.extreme);
        if self.direction == 0 {
            if ahead.wrapping_abs() > DITHER_COUNTS {
                self.direction = ahead.signum();
                self.extreme = self.position;
            }
        } else if ahead.wrapping_mul(self.direction) >= 0 {
            self.extreme = self.position;
        } else if ahead.wrapping_abs() > DITHER_COUNTS {
            self.turned_at = self.extreme;
            self.direction = -self.direction;
            self.extreme = self.position;
        }
    }

    /// A scale that dies leaves a trace that no axis can make: uniform motion up to the very last count, then nothing,
    /// while the drag force goes on. Braking from speed v at deceleration a leaves a shortfall of v²/2a.
    fn watch(
        &mut self,
        counts: i32,
        moving: usize,
        force_n: f32,
        metres_per_count: f32,
        braking_limit_m_s2: f32,
        sample_period_s: f32,
    ) {
        if counts != 0 {
            self.stuck = false;
        }
        if counts == 0
            && let Some(force_before) = self.suspect
        {
            let remains = force_n * force_before > 0.0 && force_n.abs() >= FORCE_REMAINS * force_before.abs();
            self.stuck |= remains;
        }
        self.suspect = None;
        if moving < SAMPLES_PER_BLOCK && self.previous.counts != 0 {
            let rate = self.previous.counts as f32 / SAMPLES_PER_BLOCK as f32;
            let speed = rate * metres_per_count / sample_period_s;
            let by_braking = speed * speed / (2.0 * braking_limit_m_s2 * metres_per_count.abs());
            let shortfall = (rate * moving as f32 - counts as f32).abs();
            if by_braking > VISIBLE_COUNTS && shortfall < SHORTFALL_COUNTS + rate.abs() {
                self.suspect = Some(self.previous.force);
            }
        }
    }

    /// Samples were lost: counts may have wrapped unseen, so travel begins anew here.
    pub fn interrupted(&mut self) {
        *self = Encoder { position: self.position, extreme: self.position, turned_at: self.position, ..Self::new() };
    }

    /// Travel in the present direction since the last reversal (or the first motion), counts.
    pub fn since_reversal(&self) -> i32 {
        self.extreme.wrapping_sub(self.turned_at).wrapping_abs()
    }

    /// Whether the encoder fell silent at speed while the drag force went on. Holds until it counts again.
    pub fn stuck(&self) -> bool {
        self.stuck
    }

    /// Position, counts since the first sample seen.
    pub fn position(&self) -> i32 {
        self.position
    }
}

impl Default for Encoder {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD: f32 = 1.0 / 1600.0;
    const COUNT: f32 = 5e-6;

    /// Feeds a motion given as position in counts over the sample number.
    fn drive(blocks: usize, position: impl Fn(usize) -> f64, force: impl Fn(usize) -> f32) -> (Encoder, Vec) {
        let mut encoder = Encoder::new();
        let mut stuck = Vec::default();
        for b in 0..blocks {
            let codes = core::array::from_fn(|n| libm::floor(position(16 * b + n)) as i64 as u16);
            encoder.step(&codes, force(b), COUNT, 5.0, PERIOD);
            stuck.0[b] = encoder.stuck();
        }
        (encoder, stuck)
    }

    struct Vec([bool; 64]);
    impl Default for Vec {
        fn default() -> Self {
            Vec([false; 64])
        }
    }

    #[test]
    fn counts_through_the_wrap_in_both_directions() {
        for sign in [1.0, -1.0] {
            let (encoder, _) = drive(64, |n| sign * 100.0 * n as f64, |_| 10.0);
            assert_eq!(encoder.position(), (sign * 100.0) as i32 * (64 * 16 - 1));
        }
    }

    #[test]
    fn travel_since_reversal_ignores_dither() {
        // forward 320 counts, back 200, with one count of dither throughout
        let path = |n: usize| {
            let x = if n < 320 { n as f64 } else { 640.0 - n as f64 };
            x + (n % 2) as f64
        };
        let (encoder, _) = drive(32, path, |_| 10.0);
        assert!((encoder.since_reversal() - 192).abs() <= 3, "{}", encoder.since_reversal());
    }

    #[test]
    fn a_dead_encoder_is_told_from_a_stop() {
        // 0.1 m/s = 12.5 counts a sample, dead in the middle of block 10; every phase within a block
        for phase in 0..16 {
            let dead = 160 + phase;
            let path = move |n: usize| 12.5 * n.min(dead) as f64;
            let (_, stuck) = drive(20, path, |_| 20.0);
            assert!(!stuck.0[9], "phase {phase}");
            assert!(stuck.0[12], "phase {phase}");
            // the same stop with the force gone is a collision or a clutch, not a dead encoder
            let (_, stuck) = drive(20, path, |b| if b > 10 { 1.0 } else { 20.0 });
            assert!(!stuck.0[12], "phase {phase}");
        }
        // braking at 2 m/s², held by a force that stays
        let stop = |n: usize| {
            let t = (n as f64 - 160.0).max(0.0) * f64::from(PERIOD);
            let t = t.min(0.1 / 2.0);
            12.5 * n.min(160) as f64 + (0.1 * t - t * t) / 5e-6
        };
        let (_, stuck) = drive(40, stop, |_| 20.0);
        assert!(stuck.0.iter().all(|s| !s));
    }

    #[test]
    fn counting_again_clears_it() {
        let path = |n: usize| if n < 165 { 12.5 * n as f64 } else { 12.5 * 165.0 + 12.5 * (n as f64 - 320.0).max(0.0) };
        let (encoder, stuck) = drive(30, path, |_| 20.0);
        assert!(stuck.0[15]);
        assert!(!encoder.stuck());
    }
}
