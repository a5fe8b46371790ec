//! The virtual rig: the physics of a recording as the block's converters and encoder would see it.

pub mod front_end;
pub mod noise;
pub mod track;

use model_core::sample::{RawBlock, SAMPLE_HZ, SAMPLES_PER_BLOCK};

use front_end::FrontEnd;
use track::Track;

/// A run seen through a front end.
#[derive(Clone, Debug)]
pub struct Rig {
    track: Track,
    front_end: FrontEnd,
    zero: i64,
}

impl Rig {
    /// Starts where the run starts.
    pub fn new(track: Track, front_end: FrontEnd) -> Self {
        let zero = front_end.encoder_count(track.at(0.0).position_m);
        Rig { track, front_end, zero }
    }

    /// The run.
    pub fn track(&self) -> &Track {
        &self.track
    }

    /// Codes of the force and the temperature converter at a time of the run. Noise is drawn anew at each call.
    pub fn codes(&mut self, time_s: f64) -> (u16, u16) {
        let world = self.track.at(time_s);
        (self.front_end.force_code(world.drag_force_n), self.front_end.temperature_code(world.temperature_degc))
    }

    /// Encoder counts at a time of the run; the encoder is at zero where the run starts.
    pub fn encoder_count(&self, time_s: f64) -> i64 {
        self.front_end.encoder_count(self.track.at(time_s).position_m) - self.zero
    }

    /// The whole run as an ideal sampler would record it: every block complete, the first one with tick 0.
    pub fn record(&mut self) -> Vec<RawBlock> {
        let blocks = (self.track.duration_s() * f64::from(SAMPLE_HZ)) as u64 / SAMPLES_PER_BLOCK as u64;
        (0..u32::try_from(blocks).unwrap_or(u32::MAX))
            .map(|tick| {
                let empty = [0; SAMPLES_PER_BLOCK];
                let mut block = RawBlock { tick, force: empty, temperature: empty, position: empty };
                for n in 0..SAMPLES_PER_BLOCK {
                    let number = u64::from(tick) * SAMPLES_PER_BLOCK as u64 + n as u64;
                    let time_s = number as f64 / f64::from(SAMPLE_HZ);
                    (block.force[n], block.temperature[n]) = self.codes(time_s);
                    // the counter of the chip shows the low 16 bits
                    block.position[n] = self.encoder_count(time_s) as u16;
                }
                block
            })
            .collect()
    }
}
