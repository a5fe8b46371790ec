//! The receiver's check of alive counters.

use crate::Reject;
use crate::frame::{Kind, NodeId};

/// Counters have four bits.
const MODULUS: u8 = 16;

/// No frame seen yet; no counter has this value.
const UNSEEN: u8 = 0xFF;

/// Nodes of one bus.
const NODES: usize = NodeId::LAST.get() as usize;

/// The last counter of every frame on one bus. 1016 bytes.
#[derive(Clone, Debug)]
pub struct Alive {
    last: [[u8; NODES]; Kind::ALL.len()],
}

impl Alive {
    /// Nothing seen yet.
    pub const fn new() -> Self {
        Alive { last: [[UNSEEN; NODES]; Kind::ALL.len()] }
    }

    /// Takes the counter of a frame that [`decode`](crate::decode) accepted; returns how many frames before it are
    /// missing, 0 for the first. Missing frames are counted modulo 16, and 15 of them look like a repeated
    /// one: the receiver must detect silence by its clock, not by the counter.
    ///
    /// # Errors
    /// [`Reject::RepeatedCounter`] when it has not moved on, also after the sender has started anew
    /// (see [`forget`](Self::forget)); [`Reject::UnknownIdentifier`] and [`Reject::NodeRange`] as in `decode`;
    /// [`Reject::UndefinedCode`] for a counter above 15.
    pub fn accept(&mut self, id: u16, counter: u8) -> Result<u8, Reject> {
        let (kind, node) = Kind::of(id)?;
        if counter >= MODULUS {
            return Err(Reject::UndefinedCode { field: "counter", code: counter.into() });
        }
        let last = &mut self.last[kind as usize][usize::from(node.get()) - 1];
        let skipped = match *last {
            UNSEEN => 0,
            before => match counter.wrapping_sub(before) % MODULUS {
                0 => return Err(Reject::RepeatedCounter(counter)),
                step => step - 1,
            },
        };
        *last = counter;
        Ok(skipped)
    }

    /// Forgets a node's counters: for a receiver that learns from the heartbeat that the block has started anew.
    pub fn forget(&mut self, node: NodeId) {
        for kind in &mut self.last {
            kind[usize::from(node.get()) - 1] = UNSEEN;
        }
    }
}

impl Default for Alive {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_what_is_missing_and_refuses_what_is_repeated() {
        for first in 0..16 {
            for step in 0..16 {
                let mut alive = Alive::new();
                assert_eq!(alive.accept(0x185, first), Ok(0));
                let next = (first + step) % 16;
                let expected = if step == 0 { Err(Reject::RepeatedCounter(next)) } else { Ok(step - 1) };
                assert_eq!(alive.accept(0x185, next), expected);
                // the same counter again is a repetition, whether the frame was refused or not
                assert_eq!(alive.accept(0x185, next), Err(Reject::RepeatedCounter(next)));
            }
        }
    }

    #[test]
    fn identifiers_do_not_disturb_each_other() {
        let mut alive = Alive::new();
        for counter in [3, 4] {
            for kind in Kind::ALL {
                for node in 1..=127 {
                    let id = kind.identifier(NodeId::new(node).unwrap());
                    assert_eq!(alive.accept(id, counter), Ok(0));
                }
            }
        }
    }

    #[test]
    fn forgetting_concerns_one_node() {
        let mut alive = Alive::new();
        for id in [0x185, 0x705, 0x186] {
            assert_eq!(alive.accept(id, 0), Ok(0));
        }
        alive.forget(NodeId::new(5).unwrap());
        assert_eq!(alive.accept(0x185, 0), Ok(0));
        assert_eq!(alive.accept(0x705, 0), Ok(0));
        assert_eq!(alive.accept(0x186, 0), Err(Reject::RepeatedCounter(0)));
    }

    #[test]
    fn what_is_no_counter_of_ours_is_refused() {
        let mut alive = Alive::new();
        assert_eq!(alive.accept(0x180, 0), Err(Reject::NodeRange));
        assert_eq!(alive.accept(0x7FF, 0), Err(Reject::UnknownIdentifier(0x7FF)));
        assert_eq!(alive.accept(0x185, 16), Err(Reject::UndefinedCode { field: "counter", code: 16 }));
    }

    #[test]
    fn as_small_as_stated() {
        assert_eq!(size_of::<Alive>(), 1016);
    }
}
