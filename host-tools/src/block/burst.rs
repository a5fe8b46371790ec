//! Reception of bursts, with asking for lost segments.

use std::time::Duration;

use can_wire::NodeId;
use can_wire::burst::{Order, Receiver, Record};
use can_wire::service::Field;

use super::{Client, ClientError};
use crate::bus::{Bus, BusError, Event, Heard};

/// Time between two asking frames while nothing new arrives.
const ASK_AGAIN: Duration = Duration::from_millis(20);

/// Time without a segment after which a burst has broken off.
const PATIENCE: Duration = Duration::from_secs(40);

/// The bursts of one block, put in order as they come.
#[derive(Debug)]
pub struct Listening {
    receiver: Receiver,
    asked_at: Duration,
}

/// Outcome of a burst.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Outcome {
    /// Whether every segment has arrived and the CRC is right.
    pub intact: bool,
    /// Blocks that arrived.
    pub blocks: u32,
    /// Blocks that the block left out because its ring was full.
    pub dropped: u16,
    /// Segments lost for good.
    pub lost: u32,
}

impl Listening {
    /// Listens to this node.
    pub fn new(node: NodeId) -> Self {
        Listening { receiver: Receiver::new(node), asked_at: Duration::ZERO }
    }

    /// Takes a frame; `each` gets the records that it completes, in order.
    pub fn hear(&mut self, heard: &Heard, each: &mut dyn FnMut(&Record)) {
        // frames of other kinds are refused, as they should be
        if self.receiver.take(&heard.frame).is_ok() {
            self.read(each);
        }
    }

    /// Asks for what is missing, when it is time.
    ///
    /// # Errors
    /// [`BusError`].
    pub fn ask(&mut self, bus: &mut dyn Bus) -> Result<(), BusError> {
        let now = bus.now();
        let again = self.receiver.is_under_way() && now.saturating_sub(self.asked_at) >= ASK_AGAIN;
        if bus.can_send() && (self.receiver.ask_due() || again) {
            self.asked_at = now;
            if let Some(asking) = self.receiver.ask() {
                bus.send(&asking)?;
            }
        }
        Ok(())
    }

    /// Ends listening: nothing more will arrive.
    pub fn end(&mut self, each: &mut dyn FnMut(&Record)) {
        self.receiver.give_up();
        self.read(each);
    }

    /// Whether a burst has begun and not ended.
    pub fn is_under_way(&self) -> bool {
        self.receiver.is_under_way()
    }

    /// Whether the last burst is whole.
    pub fn is_intact(&self) -> bool {
        self.receiver.is_intact()
    }

    /// Segments that are lost, of all bursts so far.
    pub fn lost(&self) -> u32 {
        self.receiver.lost()
    }

    fn read(&mut self, each: &mut dyn FnMut(&Record)) {
        while let Some(record) = self.receiver.next_record() {
            each(&record);
        }
    }
}

impl Client<'_> {
    /// Orders a burst and receives it to its end; `each` gets its records in order.
    ///
    /// # Errors
    /// [`ClientError::BrokenOff`] when no more segments arrive; otherwise as [`write`](Client::write). `each` has then
    /// got all records that arrived.
    pub fn burst(&mut self, order: Order, each: &mut dyn FnMut(&Record)) -> Result<Outcome, ClientError> {
        let mut listening = Listening::new(self.node);
        let (mut blocks, mut trailer) = (0, None);
        let mut count = |record: &Record| {
            match record {
                Record::Block(_) => blocks += 1,
                Record::Trailer(t) => trailer = Some(*t),
                Record::Header(_) => {}
            }
            each(record);
        };
        match self.write(Field::BurstOrder, order.value()) {
            // the answer may have got lost
            Ok(()) | Err(ClientError::Silent { .. }) => {}
            Err(why) => return Err(why),
        }
        let mut last = self.bus.now();
        while !listening.receiver.is_intact() {
            match self.bus.receive(ASK_AGAIN)? {
                Event::Frame(heard) => {
                    let before = listening.receiver.is_under_way();
                    listening.hear(&heard, &mut count);
                    if before || listening.receiver.is_under_way() {
                        last = self.bus.now();
                    }
                    if before && !listening.receiver.is_under_way() && !listening.receiver.is_intact() {
                        break;
                    }
                }
                Event::Silence => {}
                Event::End => break,
            }
            listening.ask(self.bus)?;
            if self.bus.now().saturating_sub(last) > PATIENCE {
                break;
            }
        }
        // the block keeps the end of the burst until it hears that it arrived
        for _ in 0..10 {
            listening.ask(self.bus)?;
            if let Event::Frame(heard) = self.bus.receive(ASK_AGAIN)? {
                listening.hear(&heard, &mut |_| {});
            }
        }
        let Some(trailer) = trailer else { return Err(ClientError::BrokenOff(self.node.get())) };
        Ok(Outcome { intact: listening.is_intact(), blocks, dropped: trailer.dropped, lost: listening.lost() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bus::desk::{Desk, Setup};

    #[test]
    fn a_burst_comes_whole_over_a_bus_that_loses_frames() {
        let mut desk = Desk::new(Setup { loss: 50, moves: true, ..Setup::default() });
        let mut blocks = Vec::new();
        let order = Order { blocks: 300, past: 40, asked: true };
        let outcome = Client::new(&mut desk, NodeId::FIRST)
            .burst(order, &mut |record| {
                if let Record::Block(block) = record {
                    blocks.push(*block);
                }
            })
            .expect("comes");
        assert_eq!(outcome, Outcome { intact: true, blocks: 300, dropped: 0, lost: 0 });
        let from = desk.sampled.iter().position(|b| b.tick == blocks[0].tick).expect("sampled");
        assert_eq!(blocks, desk.sampled[from..from + 300]);
    }
}
