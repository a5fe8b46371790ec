//! The firmware image in an emulated board, with a run of an axis at its pins.

use std::ops::ControlFlow;

use model_core::sample::{BLOCK_HZ, RawBlock, SAMPLE_HZ, SAMPLES_PER_BLOCK};
use virtual_board::{Bench, Nanos, Pins, RawSample, SentFrame};

use crate::rig::Rig;

/// How often the rig acts on the pins, ns: once a sample period of the board, at a phase of its own.
const PERIOD: Nanos = 1_000_000_000 / SAMPLE_HZ as Nanos;

/// Time without a frame after power-up after which an image never sends one: it is built for another board, or hangs.
const PATIENCE: Nanos = 500_000_000;

/// Listener to the frames of a running board.
pub trait Listener: Send {
    /// A frame has left the board. `Break` ends the run.
    fn frame(&mut self, frame: &SentFrame) -> ControlFlow<()>;
}

/// Plays a run to a board's pins from power-up on, and ends with it, or when a board never speaks at all.
#[derive(Debug)]
pub struct RigBench<L> {
    rig: Rig,
    listener: L,
    spoke: bool,
}

impl<L: Listener> RigBench<L> {
    /// The run's first row is the world at power-up.
    pub fn new(rig: Rig, listener: L) -> Self {
        RigBench { rig, listener, spoke: false }
    }

    /// Gives the listener back.
    pub fn into_listener(self) -> L {
        self.listener
    }
}

impl<L: Listener> Bench for RigBench<L> {
    fn step(&mut self, now: Nanos, pins: &mut Pins<'_>) -> Option<Nanos> {
        for frame in pins.take_frames() {
            self.spoke = true;
            if self.listener.frame(&frame).is_break() {
                return None;
            }
        }
        let (now_s, next) = (seconds(now), now + PERIOD);
        if now_s > self.rig.track().duration_s() || !self.spoke && now > PATIENCE {
            return None;
        }
        let (force, temperature) = self.rig.codes(now_s);
        pins.force_code(force);
        pins.temperature_code(temperature);
        pins.move_encoder_to(self.rig.encoder_count(seconds(next)), next);
        Some(next)
    }
}

/// Virtual time in seconds.
pub fn seconds(nanos: Nanos) -> f64 {
    nanos as f64 * 1e-9
}

/// The blocks that the firmware makes of the samples its converters delivered.
///
/// Ticks are given as the firmware gives them: counted while samples flow; after an interruption by the clock,
/// rounded to whole blocks, and at least one is skipped. What is left of an interrupted block is dropped.
pub fn blocks(samples: &[RawSample]) -> Vec<RawBlock> {
    let Some(first) = samples.first() else { return Vec::new() };
    let mut blocks = Vec::with_capacity(samples.len() / SAMPLES_PER_BLOCK);
    let mut next = 0;
    for (n, flow) in samples.chunk_by(|a, b| b.at - a.at < PERIOD + PERIOD / 2).enumerate() {
        if n > 0 {
            let elapsed = flow.first().map_or(0.0, |s| seconds(s.at - first.at));
            next = ((elapsed * f64::from(BLOCK_HZ)).round() as u32).max(next + 1);
        }
        for chunk in flow.as_chunks::<SAMPLES_PER_BLOCK>().0 {
            blocks.push(RawBlock {
                tick: next,
                force: std::array::from_fn(|n| chunk[n].force_code),
                temperature: std::array::from_fn(|n| chunk[n].temperature_code),
                position: std::array::from_fn(|n| chunk[n].encoder_count),
            });
            next += 1;
        }
    }
    blocks
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_make_blocks_and_interruptions_make_gaps() {
        let sample = |n: u64, shift: Nanos| RawSample {
            at: 7_000_000 + n * PERIOD + shift,
            force_code: n as u16,
            temperature_code: 1850,
            encoder_count: 0,
        };
        // 40 samples, a pause, 40 more: the second run starts 25 ms + 50 ms after the first
        let samples: Vec<_> = (0..40).map(|n| sample(n, 0)).chain((40..80).map(|n| sample(n, 50_000_000))).collect();
        let blocks = blocks(&samples);
        let ticks: Vec<_> = blocks.iter().map(|b| b.tick).collect();
        assert_eq!(ticks, [0, 1, 8, 9]);
        assert_eq!(blocks[1].force[15], 31);
        assert_eq!(blocks[2].force[0], 40);
    }
}
