//! The receiver's side: decoding of all cyclic frames.

use crate::frame::{self, Kind};
use crate::{
    ActingMessage, EstimateMessage, FaultMessage, HeartbeatMessage, MisfitMessage, MotionMessage, NodeId, Reject,
    RippleMessage, StateMessage, acting, estimate, fault, heartbeat, misfit, motion, ripple, state,
};

/// Content of a frame, in SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Message {
    /// Reasons against the estimate.
    Fault(FaultMessage),
    /// Preload, drag force, quality.
    Estimate(EstimateMessage),
    /// Speed, temperature, time.
    Motion(MotionMessage),
    /// Mechanisms that act beside the drag law.
    Acting(ActingMessage),
    /// Ball-pass ripple.
    Ripple(RippleMessage),
    /// Whether the model fits.
    Misfit(MisfitMessage),
    /// Parameter image in use, changes.
    State(StateMessage),
    /// Sign of life.
    Heartbeat(HeartbeatMessage),
}

impl Message {
    /// The kind of frame it came in.
    pub const fn kind(&self) -> Kind {
        match self {
            Message::Fault(_) => Kind::Fault,
            Message::Estimate(_) => Kind::Estimate,
            Message::Motion(_) => Kind::Motion,
            Message::Acting(_) => Kind::Acting,
            Message::Ripple(_) => Kind::Ripple,
            Message::Misfit(_) => Kind::Misfit,
            Message::State(_) => Kind::State,
            Message::Heartbeat(_) => Kind::Heartbeat,
        }
    }

    /// The alive counter, 0 to 15, for [`Alive::accept`](crate::Alive::accept).
    pub const fn counter(&self) -> u8 {
        match self {
            Message::Fault(m) => m.counter,
            Message::Estimate(m) => m.counter,
            Message::Motion(m) => m.counter,
            Message::Acting(m) => m.counter,
            Message::Ripple(m) => m.counter,
            Message::Misfit(m) => m.counter,
            Message::State(m) => m.counter,
            Message::Heartbeat(m) => m.counter,
        }
    }
}

/// Checks a frame and reads it. The alive counter is left to [`Alive`](crate::Alive).
///
/// # Errors
/// In this order: [`Reject::UnknownIdentifier`], [`Reject::NodeRange`], [`Reject::Length`], [`Reject::Crc`],
/// then [`Reject::UndefinedCode`] and [`Reject::Contradiction`], which a sound block never causes.
pub fn decode(id: u16, data: &[u8]) -> Result<(NodeId, Message), Reject> {
    let (kind, node) = Kind::of(id)?;
    let data = frame::open(id, data)?;
    let message = match kind {
        Kind::Fault => Message::Fault(fault::decode(data)?),
        Kind::Estimate => Message::Estimate(estimate::decode(data)?),
        Kind::Motion => Message::Motion(motion::decode(data)?),
        Kind::Acting => Message::Acting(acting::decode(data)?),
        Kind::Ripple => Message::Ripple(ripple::decode(data)?),
        Kind::Misfit => Message::Misfit(misfit::decode(data)?),
        Kind::State => Message::State(state::decode(data)?),
        Kind::Heartbeat => Message::Heartbeat(heartbeat::decode(data)?),
    };
    Ok((node, message))
}
