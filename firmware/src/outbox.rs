//! Outbox of frames for the bus: one place for each identifier, the newest frame wins.
//!
//! No bus condition blocks the runners that fill it. While nobody acknowledges, or after bus-off, every
//! new frame displaces the older one with its identifier, here and in the controller, and the displaced
//! one is counted. So when the bus comes back it gets at most one frame of each kind, the newest, and never
//! a queue of old ones.

use can_wire::{Kind, RawFrame};

use crate::ports::{FrameSink, Offer};

/// One place for each kind of frame.
#[derive(Clone, Copy, Debug, Default)]
pub struct Outbox {
    /// in the order of [`Kind::ALL`], most urgent first
    waiting: [Option<RawFrame>; Kind::ALL.len()],
    dropped: u32,
}

impl Outbox {
    /// Nothing waits.
    pub const fn new() -> Self {
        Outbox { waiting: [None; Kind::ALL.len()], dropped: 0 }
    }

    /// Puts a frame in, in place of an older one of its kind.
    pub fn put(&mut self, kind: Kind, frame: RawFrame) {
        if self.waiting[kind as usize].replace(frame).is_some() {
            self.count_drop();
        }
    }

    /// Offers all waiting frames, most urgent first, and keeps those for which the controller has no room.
    pub fn flush(&mut self, sink: &mut impl FrameSink) {
        let mut withdrawn = 0;
        for place in &mut self.waiting {
            let Some(frame) = place else { continue };
            match sink.offer(frame) {
                Offer::Taken => *place = None,
                Offer::Busy => {}
                Offer::Withdrawing => withdrawn += 1,
            }
        }
        for _ in 0..withdrawn {
            self.count_drop();
        }
    }

    /// Nothing waits.
    pub fn is_empty(&self) -> bool {
        self.waiting.iter().all(Option::is_none)
    }

    /// Frames displaced by newer ones since start-up, saturating. One that went out in the very instant of
    /// its withdrawal is counted too.
    pub fn dropped(&self) -> u32 {
        self.dropped
    }

    fn count_drop(&mut self) {
        self.dropped = self.dropped.saturating_add(1);
    }
}

#[cfg(test)]
mod tests {
    use can_wire::NodeId;

    use super::*;
    use crate::runners::rehearsal::Controller;

    fn frame(id: u16, n: u8) -> RawFrame {
        RawFrame { id, data: [n; 8] }
    }

    #[test]
    fn eight_frames_pass_three_mailboxes() {
        let mut outbox = Outbox::new();
        let controller = Controller::new();
        for kind in Kind::ALL.into_iter().rev() {
            outbox.put(kind, frame(kind.identifier(NodeId::FIRST), 1));
        }
        for _ in 0..2 {
            outbox.flush(&mut &controller);
            assert!(!outbox.is_empty());
            controller.transmit(0);
        }
        outbox.flush(&mut &controller);
        assert!(outbox.is_empty());
        controller.transmit(0);
        let ids: Vec<u16> = controller.sent().iter().map(|f| f.id).collect();
        assert_eq!(ids, [0x81, 0x181, 0x281, 0x301, 0x381, 0x401, 0x681, 0x701]);
        assert_eq!(outbox.dropped(), 0);
    }

    #[test]
    fn a_silent_bus_gets_the_newest_of_each_kind_when_it_returns() {
        let mut outbox = Outbox::new();
        let controller = Controller::new();
        for n in 0..100 {
            outbox.put(Kind::Estimate, frame(0x181, n));
            outbox.put(Kind::Motion, frame(0x281, n));
            outbox.flush(&mut &controller);
            // the controller has dropped the frame that it was asked to withdraw
            outbox.flush(&mut &controller);
        }
        assert_eq!(outbox.dropped(), 2 * 99);
        controller.transmit(0);
        assert_eq!(controller.sent(), [frame(0x181, 99), frame(0x281, 99)]);
    }

    #[test]
    fn a_frame_that_never_reached_the_controller_counts_as_well() {
        let mut outbox = Outbox::new();
        outbox.put(Kind::Ripple, frame(0x381, 0));
        outbox.put(Kind::Ripple, frame(0x381, 1));
        assert_eq!(outbox.dropped(), 1);
    }
}
