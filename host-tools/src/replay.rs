//! Replay of a raw recording through the block's own pipeline: the same frames again, bit for bit.
//!
//! Estimate and motion frames follow from the samples alone and are replayed. Fault, ripple and heartbeat frames
//! depend on the block's clock and state, not on the samples; they are not. If the block sent
//! `stale` estimates while its sampler stood, its alive counters run ahead of the replay's by their number.

use can_wire::parameters::ParameterRecord;
use can_wire::{NodeId, Publisher, RawFrame};
use model_core::monitor::{Monitor, State};
use model_core::params::Params;
use model_core::sample::{BLOCK_HZ, Estimate, RawBlock};

use crate::candump::Micros;

/// What an unprogrammed block runs with: node 1, the published parameters, not calibrated. It gives no preload.
pub const UNPROGRAMMED: ParameterRecord = ParameterRecord { node: 1, params: Params::ZHOU_2023 };

/// The pipeline of one block.
#[derive(Debug)]
pub struct Replay {
    monitor: Monitor,
    state: State,
    publisher: Publisher,
}

/// What the block sent after one block of samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sent {
    /// End of the newest samples in it, from the block's start.
    pub time: Micros,
    /// The estimate frame and the motion frame.
    pub frames: [RawFrame; 2],
    /// Content of both, unrounded.
    pub estimate: Estimate,
}

/// Why a parameter record cannot be used for a replay.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BadParameters {
    /// The node is not 1 to 127.
    #[error("node {0} is not 1 to 127")]
    NodeId(u8),
    /// The parameters are refused.
    #[error(transparent)]
    Params(#[from] model_core::Error),
}

impl Replay {
    /// A block that has just started with this record.
    ///
    /// # Errors
    /// [`BadParameters`], which records that went through [`can_wire::parameters`] never cause.
    pub fn new(record: &ParameterRecord) -> Result<Self, BadParameters> {
        let node = NodeId::new(record.node).ok_or(BadParameters::NodeId(record.node))?;
        Ok(Replay { monitor: record.params.build()?, state: State::new(), publisher: Publisher::new(node) })
    }

    /// Takes a block; returns what was sent, if an estimate was due.
    pub fn block(&mut self, block: &RawBlock) -> Option<Sent> {
        let estimate = self.monitor.step(&mut self.state, block)?;
        Some(Sent {
            time: end_of(estimate.tick),
            frames: [self.publisher.estimate(&estimate), self.publisher.motion(&estimate)],
            estimate,
        })
    }
}

/// When the samples of a block end, from the block's start.
pub fn end_of(tick: u32) -> Micros {
    Micros((u64::from(tick) + 1) * 1_000_000 / u64::from(BLOCK_HZ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use can_wire::Message;
    use model_core::sample::Reason;

    /// 50 mm/s forwards at 20 N and 25 °C.
    fn block(tick: u32) -> RawBlock {
        let sample = |n: usize| tick as usize * 16 + n;
        RawBlock {
            tick,
            force: std::array::from_fn(|n| 2458 + (sample(n) % 3) as u16),
            temperature: [2048; 16],
            position: std::array::from_fn(|n| (sample(n) * 25 / 4) as u16),
        }
    }

    #[test]
    fn a_calibrated_block_speaks_and_a_gap_silences_it() {
        let record = ParameterRecord { node: 5, params: Params { calibrated: true, ..Params::ZHOU_2023 } };
        let mut replay = Replay::new(&record).expect("legal");
        let mut qualities = Vec::new();
        for tick in (0..100).chain(105..200) {
            if let Some(sent) = replay.block(&block(tick)) {
                let (node, Message::Estimate(message)) =
                    can_wire::decode(sent.frames[0].id, &sent.frames[0].data).expect("sound")
                else {
                    panic!("not an estimate")
                };
                assert_eq!(node.get(), 5);
                assert_eq!(sent.frames[1].id, 0x285);
                assert_eq!(sent.time, Micros(u64::from(sent.estimate.tick + 1) * 10_000));
                assert_eq!(message.preload_n.is_some(), sent.estimate.preload_n.is_some());
                qualities.push((sent.estimate.tick, message.quality));
            }
        }
        assert_eq!(qualities[0], (9, Some(Reason::Settling)));
        assert_eq!(qualities[5], (59, None));
        assert_eq!(qualities[10], (109, Some(Reason::SamplesLost)));
        assert_eq!(qualities[14], (149, None));
    }

    #[test]
    fn an_unprogrammed_block_never_gives_a_preload() {
        let mut replay = Replay::new(&UNPROGRAMMED).expect("legal");
        for sent in (0..200).filter_map(|tick| replay.block(&block(tick))) {
            assert_eq!(sent.estimate.preload_n, None);
            assert_eq!(sent.estimate.reasons.first(), Some(Reason::NotCalibrated));
        }
    }
}
