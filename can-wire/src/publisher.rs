//! The sender's side: encoding of all cyclic frames.

use crate::frame::Kind;
use crate::{
    Beside, Health, NodeId, RawFrame, Workings, acting, estimate, fault, heartbeat, misfit, motion, ripple, state,
};
use model_core::consistency::Verdict;
use model_core::ripple::Ripple;
use model_core::sample::{Estimate, Reasons};

/// Makes the frames of one block; owns the alive counters.
///
/// A counter advances with every frame made, sent or not: a frame that found no free mailbox shows as a step
/// of two at the receiver.
#[derive(Clone, Debug)]
pub struct Publisher {
    node: NodeId,
    /// one per kind, in the order of [`Kind::ALL`]
    counters: [u8; Kind::ALL.len()],
}

impl Publisher {
    /// All counters at 0.
    pub const fn new(node: NodeId) -> Self {
        Publisher { node, counters: [0; Kind::ALL.len()] }
    }

    /// The node whose frames these are.
    pub const fn node(&self) -> NodeId {
        self.node
    }

    /// Preload, drag force and quality, see [`estimate`](mod@crate::estimate).
    pub fn estimate(&mut self, estimate: &Estimate) -> RawFrame {
        let (identifier, counter) = self.next(Kind::Estimate);
        estimate::encode(identifier, counter, estimate)
    }

    /// Speed, temperature and time, see [`motion`](mod@crate::motion).
    pub fn motion(&mut self, estimate: &Estimate) -> RawFrame {
        let (identifier, counter) = self.next(Kind::Motion);
        motion::encode(identifier, counter, estimate)
    }

    /// Sign of life, see [`heartbeat`](mod@crate::heartbeat).
    pub fn heartbeat(&mut self, health: &Health) -> RawFrame {
        let (identifier, counter) = self.next(Kind::Heartbeat);
        heartbeat::encode(identifier, counter, health)
    }

    /// All reasons that hold, and the blocks lost since start-up, see [`fault`](mod@crate::fault).
    pub fn fault(&mut self, reasons: Reasons, lost_blocks: u32) -> RawFrame {
        let (identifier, counter) = self.next(Kind::Fault);
        fault::encode(identifier, counter, reasons, lost_blocks)
    }

    /// Ball-pass ripple, see [`ripple`](mod@crate::ripple).
    pub fn ripple(&mut self, ripple: Option<Ripple>, wavelength_m: f32) -> RawFrame {
        let (identifier, counter) = self.next(Kind::Ripple);
        ripple::encode(identifier, counter, ripple, wavelength_m)
    }

    /// Whether the model fits, at a tick, see [`misfit`](mod@crate::misfit).
    pub fn misfit(&mut self, verdict: &Verdict, tick: u32) -> RawFrame {
        let (identifier, counter) = self.next(Kind::Misfit);
        misfit::encode(identifier, counter, verdict, tick)
    }

    /// Mechanisms that act beside the drag law, see [`acting`](mod@crate::acting).
    pub fn acting(&mut self, beside: &Beside) -> RawFrame {
        let (identifier, counter) = self.next(Kind::Acting);
        acting::encode(identifier, counter, beside)
    }

    /// Parameter image in use and changes made, see [`state`](mod@crate::state).
    pub fn state(&mut self, workings: &Workings) -> RawFrame {
        let (identifier, counter) = self.next(Kind::State);
        state::encode(identifier, counter, workings)
    }

    /// Identifier and counter of the next frame.
    fn next(&mut self, kind: Kind) -> (u16, u8) {
        let slot = &mut self.counters[kind as usize];
        let counter = *slot;
        *slot = counter.wrapping_add(1) & 0xF;
        (kind.identifier(self.node), counter)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{BoardKind, ResetCause, decode};
    use model_core::left_out::Acting;
    use model_core::params::Params;

    #[test]
    fn each_kind_has_its_own_counter_that_wraps_at_16() {
        let node = NodeId::new(100).unwrap();
        let estimate = Params::ZHOU_2023.build().unwrap().stale(0);
        let health = Health {
            reset_cause: ResetCause::Unknown,
            board: BoardKind::Unknown,
            boot_count: 0,
            frames_dropped: 0,
            operational: false,
        };
        let beside = Beside { acting: Acting::NONE, record: true, calibrated: true };
        let mut publisher = Publisher::new(node);
        assert_eq!(publisher.node(), node);
        // one kind runs ahead: this must not affect the others
        publisher.ripple(None, 0.0143);
        for round in 0..40 {
            let frames = [
                publisher.fault(Reasons::NONE, 0),
                publisher.estimate(&estimate),
                publisher.motion(&estimate),
                publisher.acting(&beside),
                publisher.ripple(None, 0.0143),
                publisher.misfit(&Verdict::NONE, 0),
                publisher.state(&Workings::default()),
                publisher.heartbeat(&health),
            ];
            for (kind, frame) in Kind::ALL.into_iter().zip(frames) {
                let (from, message) = decode(frame.id, &frame.data).unwrap();
                assert_eq!((from, message.kind()), (node, kind));
                let ahead = u8::from(kind == Kind::Ripple);
                assert_eq!(message.counter(), (round + ahead) % 16);
            }
        }
    }
}
