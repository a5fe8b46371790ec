//! Client of a block: reads and writes its objects, loads an image, orders a burst.

mod burst;
mod load;

use std::time::Duration;

use can_wire::service::client::{self, Reply};
use can_wire::service::server::ZeroState;
use can_wire::service::{Abort, Field, OBJECTS, Object, UploadState, objects};
use can_wire::{NodeId, RawFrame};

use crate::bus::{Bus, BusError, Event};

pub use burst::{Listening, Outcome};

/// Longest wait for an answer. A block answers within a few milliseconds; bridges and gateways take longer.
const ANSWER_WITHIN: Duration = Duration::from_millis(500);

/// Number of times that a request without an answer is sent.
const ATTEMPTS: usize = 3;

/// Number of checks, a fifth of a second apart, for the zero, which takes a second.
const ZERO_LOOKS: usize = 15;

/// Why a block did not do what it was asked for.
#[derive(Debug, thiserror::Error)]
pub enum ClientError {
    /// The bus does not work.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// Nobody answered.
    #[error("node {node} does not answer; is the block powered, on this bus at 500 kbit/s, and is that its node?")]
    Silent {
        /// Who was asked.
        node: u8,
    },
    /// The block refused.
    #[error("node {node}: {name} ({index:04X}.{sub}): {why}")]
    Refused {
        /// Who refused.
        node: u8,
        /// The object's name.
        name: &'static str,
        /// Its place.
        index: u16,
        /// Its part.
        sub: u8,
        /// Why.
        why: Abort,
    },
    /// The key is not that of the block.
    #[error("node {0}: wrong key: the block has another one; give its own with --key")]
    WrongKey(u8),
    /// The answer is none that a block gives.
    #[error("node {node}: {name}: the answer is none that a block gives; is another device on this node?")]
    Strange {
        /// Who answered.
        node: u8,
        /// The object's name.
        name: &'static str,
    },
    /// The image is not one that can be sent.
    #[error("an image has 1 to {max} bytes, this has {0}", max = can_wire::service::MAX_IMAGE)]
    ImageSize(usize),
    /// The block could not keep the image.
    #[error("node {node}: the image arrived but was not kept ({}); the one before stays", .state.name())]
    NotKept {
        /// Who.
        node: u8,
        /// What became of it.
        state: UploadState,
    },
    /// The settings were not kept.
    #[error("node {0}: the settings hold until the next start only: the block could not keep them")]
    NotSaved(u8),
    /// The zero was not taken.
    #[error("node {0}: no zero was taken: the carriage moved, or more than a tenth of the range pulls at the sensor")]
    NoZero(u8),
    /// A burst did not end.
    #[error("node {0}: the burst broke off; order it anew")]
    BrokenOff(u8),
}

/// One block on one bus.
pub struct Client<'a> {
    bus: &'a mut dyn Bus,
    node: NodeId,
}

/// Identity and state of a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Identity {
    /// Node on the bus.
    pub node: u8,
    /// Board, by name.
    pub board: &'static str,
    /// CRC-32 of the chip's unique identifier.
    pub serial: u32,
    /// The chip's unique identifier, lowest word first.
    pub unique: [u32; 3],
    /// Firmware version: major, minor, patch.
    pub version: [u16; 3],
    /// Starts since the supply was switched on.
    pub starts: u32,
    /// What started it.
    pub reset_cause: &'static str,
    /// Hash of the image in use; 0: none.
    pub active_image: u32,
    /// Changes accepted since the start.
    pub changes: u32,
    /// Whether it accepts changes.
    pub unlocked: bool,
}

/// The object that holds this field.
pub fn object(field: Field) -> &'static Object {
    // the table is in the order of its fields, which its tests assert
    &OBJECTS[field as usize]
}

impl<'a> Client<'a> {
    /// A client of this node.
    pub fn new(bus: &'a mut dyn Bus, node: NodeId) -> Self {
        Client { bus, node }
    }

    /// The value of an object.
    ///
    /// # Errors
    /// [`ClientError`].
    pub fn read(&mut self, field: Field) -> Result<u32, ClientError> {
        let object = object(field);
        match self.ask(object, &client::read(self.node, object), true)? {
            Reply::Value(value) => Ok(value),
            other => Err(self.otherwise(object, other)),
        }
    }

    /// Sets an object.
    ///
    /// # Errors
    /// [`ClientError`]. After [`ClientError::Silent`] it is not known whether the block accepted it.
    pub fn write(&mut self, field: Field, value: u32) -> Result<(), ClientError> {
        let object = object(field);
        // writing a value again is harmless, giving a command again is not
        let again = object.low != object.high && !matches!(field, Field::BurstOrder | Field::ImageChecksum);
        match self.ask(object, &client::write(self.node, object, value), again)? {
            Reply::Taken => Ok(()),
            other => Err(self.otherwise(object, other)),
        }
    }

    /// Writes the key, so that the block accepts changes.
    ///
    /// # Errors
    /// [`ClientError::WrongKey`].
    pub fn unlock(&mut self, key: u32) -> Result<(), ClientError> {
        self.write(Field::Key, key).map_err(|error| match error {
            ClientError::Refused { node, why: Abort::Value, .. } => ClientError::WrongKey(node),
            other => other,
        })
    }

    /// Reads its identity.
    ///
    /// # Errors
    /// [`ClientError`].
    pub fn identify(&mut self) -> Result<Identity, ClientError> {
        let revision = self.read(Field::Revision)?;
        let [patch_low, patch_high, minor, major] = revision.to_le_bytes();
        let [board, reset_cause] = [self.read(Field::Board)?, self.read(Field::ResetCause)?].map(|n| n as u8);
        Ok(Identity {
            node: self.node.get(),
            board: can_wire::BoardKind::from_code(board).map_or("another", can_wire::BoardKind::name),
            serial: self.read(Field::Serial)?,
            unique: [self.read(Field::UniqueLow)?, self.read(Field::UniqueMiddle)?, self.read(Field::UniqueHigh)?],
            version: [major.into(), minor.into(), u16::from_le_bytes([patch_low, patch_high])],
            starts: self.read(Field::BootCount)?,
            reset_cause: can_wire::ResetCause::from_code(reset_cause).map_or("another", can_wire::ResetCause::name),
            active_image: self.read(Field::ImageActive)?,
            changes: self.read(Field::Changes)?,
            unlocked: self.read(Field::Unlocked)? != 0,
        })
    }

    /// Takes the zero of the force, which takes a second, and returns the whole shift, codes.
    ///
    /// # Errors
    /// [`ClientError::NoZero`] when the block took none; otherwise as [`write`](Self::write).
    pub fn take_zero(&mut self) -> Result<f64, ClientError> {
        self.write(Field::TakeZero, objects::TAKE_ZERO)?;
        for _ in 0..ZERO_LOOKS {
            self.pause(Duration::from_millis(200))?;
            let state = self.read(Field::TakeZero)?;
            if state == ZeroState::Taken as u32 {
                let shift = self.read(Field::ZeroShift)? as u16;
                return Ok(f64::from(i16::from_le_bytes(shift.to_le_bytes())) / 16.0);
            }
            if state != ZeroState::Taking as u32 {
                break;
            }
        }
        Err(ClientError::NoZero(self.node.get()))
    }

    /// Has the settings kept over a reset.
    ///
    /// # Errors
    /// [`ClientError::NotSaved`]; otherwise as [`write`](Self::write).
    pub fn save(&mut self) -> Result<(), ClientError> {
        self.write(Field::Save, objects::SAVE)?;
        self.pause(Duration::from_millis(100))?;
        // a block does not answer while it saves
        match self.read(Field::Save)? {
            0 => Err(ClientError::NotSaved(self.node.get())),
            _ => Ok(()),
        }
    }

    /// Lets time pass on the bus.
    fn pause(&mut self, time: Duration) -> Result<(), ClientError> {
        let end = self.bus.now() + time;
        while self.bus.now() < end {
            let left = end.saturating_sub(self.bus.now());
            if self.bus.receive(left)? == Event::End {
                return Err(ClientError::Silent { node: self.node.get() });
            }
        }
        Ok(())
    }

    /// Sends a request and waits for its answer; with `again`, repeats it without one.
    fn ask(&mut self, object: &Object, request: &RawFrame, again: bool) -> Result<Reply, ClientError> {
        let silent = ClientError::Silent { node: self.node.get() };
        for _ in 0..if again { ATTEMPTS } else { 1 } {
            self.bus.send(request)?;
            let deadline = self.bus.now() + ANSWER_WITHIN;
            while self.bus.now() < deadline {
                match self.bus.receive(deadline.saturating_sub(self.bus.now()))? {
                    Event::Frame(heard) => {
                        if let Some(reply) = client::reply(self.node, object, &heard.frame) {
                            return Ok(reply);
                        }
                    }
                    Event::Silence => {}
                    Event::End => return Err(silent),
                }
            }
        }
        Err(silent)
    }

    fn otherwise(&self, object: &Object, reply: Reply) -> ClientError {
        let (node, name) = (self.node.get(), object.name());
        match reply {
            Reply::Refused(why) => ClientError::Refused { node, name, index: object.index, sub: object.sub, why },
            _ => ClientError::Strange { node, name },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bus::desk::{Desk, Setup};
    use can_wire::service::server::DELIVERED_KEY;

    #[test]
    fn fields_are_found() {
        for expected in &OBJECTS {
            assert_eq!(object(expected.field).field, expected.field);
        }
    }

    #[test]
    fn a_block_is_asked_and_set_over_a_bus_that_loses_frames() {
        let mut desk = Desk::new(Setup { loss: 50, ..Setup::default() });
        let mut client = Client::new(&mut desk, NodeId::FIRST);
        let identity = client.identify().expect("answers");
        assert_eq!((identity.version, identity.unlocked, identity.starts), ([0, 1, 0], false, 1));
        let locked = client.write(Field::WarnBelow, 2000).expect_err("locked");
        assert_eq!(locked.to_string(), "node 1: Warning below (2002.2): the block is locked; give its key");
        client.unlock(DELIVERED_KEY).expect("the key");
        client.write(Field::WarnBelow, 2000).expect("unlocked");
        assert_eq!(client.read(Field::WarnBelow).expect("answers"), 2000);
    }

    #[test]
    fn a_zero_is_taken() {
        let mut desk = Desk::new(Setup::default());
        let mut client = Client::new(&mut desk, NodeId::FIRST);
        client.unlock(DELIVERED_KEY).expect("the key");
        assert_eq!(client.take_zero().expect("at rest"), 12.0);
    }

    #[test]
    fn settings_are_kept_or_it_is_said() {
        for keeps in [true, false] {
            let mut desk = Desk::new(Setup { keeps, ..Setup::default() });
            let mut client = Client::new(&mut desk, NodeId::FIRST);
            client.unlock(DELIVERED_KEY).expect("the key");
            assert_eq!(client.save().is_ok(), keeps);
        }
    }

    #[test]
    fn who_is_not_there_is_said() {
        let mut desk = Desk::new(Setup::default());
        let mut client = Client::new(&mut desk, NodeId::LAST);
        let error = client.identify().expect_err("nobody").to_string();
        assert!(error.starts_with("node 127 does not answer"), "{error}");
    }
}
