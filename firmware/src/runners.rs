//! The five activities of the block. Each is a struct with an endless `run`, generic over [`ports`](crate::ports).
//!
//! They share one executor and one priority: none computes longer than a fraction of a block's 10 ms, and none
//! waits for anything but samples, messages and the clock, in particular never for the bus.

pub mod acquire;
pub mod estimate;
pub mod publish;
pub mod serve;
pub mod supervise;

#[cfg(test)]
pub(crate) mod rehearsal;
