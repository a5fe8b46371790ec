//! The CAN bus outside the controller: acknowledgement, frames of other nodes, frames sent.

use std::collections::VecDeque;

use rigless::chip::can::{Frame, Id};

use crate::Nanos;
use crate::outcome::SentFrame;

/// Bits between the end of a frame and the next start: the intermission of ISO 11898-1.
const INTERMISSION_BITS: u64 = 3;
/// An error flag and its delimiter, which follow a frame that failed.
const ERROR_FRAME_BITS: u64 = 6 + 8;
/// The transmit error counter at which a node calls itself error passive.
const ERROR_PASSIVE: u32 = 128;
/// The transmit error counter at which a node leaves the bus.
const BUS_OFF: u32 = 256;
/// The counter at which a controller warns.
const ERROR_WARNING: u32 = 96;

/// How one transmission ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Ended {
    /// Some node acknowledged it.
    Acknowledged,
    /// No node did.
    Unacknowledged,
    /// A bit on the wire differed from the bit sent.
    Disturbed,
}

/// The far side of the transceiver, the same for both controllers.
#[derive(Debug)]
pub(crate) struct Wire {
    /// Whether some other node acknowledges.
    pub(crate) acknowledges: bool,
    /// Whether every transmission of ours meets a bit error.
    pub(crate) disturbed: bool,
    /// Frames that left the controller and were acknowledged, oldest first.
    pub(crate) sent: Vec<SentFrame>,
    /// Transmissions no node acknowledged.
    pub(crate) unacknowledged: u64,
    /// Frames other nodes wait to send, oldest first.
    inbox: VecDeque<Frame>,
    /// The transmit error counter of the controller under test, ISO 11898-1 fault confinement.
    transmit_errors: u32,
}

impl Default for Wire {
    fn default() -> Self {
        Self {
            acknowledges: true,
            disturbed: false,
            sent: Vec::new(),
            unacknowledged: 0,
            inbox: VecDeque::new(),
            transmit_errors: 0,
        }
    }
}

impl Wire {
    /// Bits a transmission of the controller holds the bus for, intermission included.
    pub(crate) fn bits_for_own(&self, frame: &Frame) -> u64 {
        let bits = if self.acknowledges && !self.disturbed {
            u64::from(frame.bits_on_the_wire())
        } else {
            u64::from(frame.bits_through_acknowledge()) + ERROR_FRAME_BITS
        };
        bits + INTERMISSION_BITS
    }

    /// Bits a frame of another node holds the bus for, intermission included.
    pub(crate) fn bits_for_other(frame: &Frame) -> u64 {
        u64::from(frame.bits_on_the_wire()) + INTERMISSION_BITS
    }

    /// Ends a transmission of the controller at `at` and counts it.
    pub(crate) fn end_own(&mut self, at: Nanos, frame: &Frame) -> Ended {
        if self.disturbed {
            self.transmit_errors += 8;
            return Ended::Disturbed;
        }
        if !self.acknowledges {
            self.unacknowledged += 1;
            // ISO 11898-1: a node that is error passive does not count missing acknowledgements,
            // so a node alone on the bus never reaches bus-off.
            if self.transmit_errors < ERROR_PASSIVE {
                self.transmit_errors += 8;
            }
            return Ended::Unacknowledged;
        }
        self.transmit_errors = self.transmit_errors.saturating_sub(1);
        let id = match frame.id {
            Id::Standard(id) => id,
            // The product sends no extended frames; the low bits are enough to see one happened.
            Id::Extended(id) => (id & 0x7FF) as u16,
        };
        self.sent.push(SentFrame::new(at, id, frame.payload()));
        Ended::Acknowledged
    }

    /// Queues a frame of another node. It goes out as soon as the bus is free and wins arbitration.
    pub(crate) fn queue(&mut self, id: u16, data: &[u8]) {
        let data = &data[..data.len().min(8)];
        self.inbox.push_back(Frame::data_frame(Id::Standard(id & 0x7FF), data));
    }

    /// The frame another node would send now.
    pub(crate) fn offered(&self) -> Option<&Frame> {
        self.inbox.front()
    }

    /// Removes the frame [`Wire::offered`] named, which has crossed the wire.
    pub(crate) fn take_offered(&mut self) -> Option<Frame> {
        self.inbox.pop_front()
    }

    /// The transmit error counter, at most 255 as registers show it.
    pub(crate) fn transmit_error_count(&self) -> u32 {
        self.transmit_errors.min(255)
    }

    /// Whether the controller must warn.
    pub(crate) fn warns(&self) -> bool {
        self.transmit_errors >= ERROR_WARNING
    }

    /// Whether the controller is error passive.
    pub(crate) fn passive(&self) -> bool {
        self.transmit_errors >= ERROR_PASSIVE
    }

    /// Whether the controller has taken itself off the bus.
    pub(crate) fn bus_off(&self) -> bool {
        self.transmit_errors >= BUS_OFF
    }

    /// The controller has seen 128 times eleven recessive bits, or was reset: counters to zero.
    pub(crate) fn recover(&mut self) {
        self.transmit_errors = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::{Ended, Wire};
    use rigless::chip::can::{Frame, Id};

    #[test]
    fn a_node_alone_turns_passive_and_stays_on_the_bus() {
        let mut wire = Wire { acknowledges: false, ..Wire::default() };
        let frame = Frame::data_frame(Id::Standard(1), &[0; 8]);
        for _ in 0..1_000 {
            assert_eq!(wire.end_own(0, &frame), Ended::Unacknowledged);
        }
        assert!(wire.passive() && !wire.bus_off());
        assert_eq!(wire.transmit_error_count(), 128);
        assert_eq!(wire.unacknowledged, 1_000);
        assert!(wire.sent.is_empty());
    }

    #[test]
    fn bit_errors_lead_to_bus_off_after_thirty_two_attempts() {
        let mut wire = Wire { disturbed: true, ..Wire::default() };
        let frame = Frame::data_frame(Id::Standard(1), &[]);
        for _ in 0..31 {
            wire.end_own(0, &frame);
        }
        assert!(!wire.bus_off());
        wire.end_own(0, &frame);
        assert!(wire.bus_off());
        wire.recover();
        assert_eq!(wire.transmit_error_count(), 0);
    }
}
