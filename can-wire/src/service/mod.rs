//! Service messages: ask a block what it is and set what may be set, one object at a time.
//!
//! Laid out as CANopen's SDO (CiA 301), so that any CANopen master or PLC block can be used; the block claims
//! no conformance beyond that. Requests go to `0x600 + n`, each is answered from `0x580 + n`, and there is one
//! client at a time. Always 8 data bytes; service messages carry no counter and no CRC of their own, since
//! CiA 301 leaves no room for them: a client reads back what it has set, and an image has its CRC-32.
//!
//! ```text
//! byte  0         1       3     4                          7
//!      +---------+-------+-----+----------------------------+
//!      | command | index | sub | up to four bytes, or abort |
//!      | u8      | u16   | u8  | code, or size of an image  |
//!      +---------+-------+-----+----------------------------+
//! ```
//!
//! | request | command | answer | command |
//! |---|---|---|---|
//! | read | `0x40` | value of 4, 2, 1 bytes | `0x43`, `0x4B`, `0x4F` |
//! | write 4, 2, 1 bytes, or the object's length | `0x23`, `0x2B`, `0x2F`, `0x22` | taken | `0x60` |
//! | begin an image, size in bytes 4 to 7 | `0x21` | begun | `0x60` |
//! | up to 7 bytes of it; `t` toggles, `n` bytes unused, `c` last | `000t nnnc` | taken | `001t 0000` |
//! | abort | `0x80` | none | |
//! | | | refused: [`Abort`] | `0x80` |
//!
//! **What is not taken changes nothing**: a request that is refused, for whatever reason, leaves the block as it
//! was, an image that is being sent included, and is answered with an abort code. Not answered at all are frames
//! with another identifier or another length, and an abort, which ends an image that is being sent.
//! Bytes that a request does not use are not looked at.
//!
//! **Who may write**: everything but the key and the burst order is read-only until the [key](server::Server)
//! has been written, and again five minutes after the last write that was taken. Nothing but the key and
//! the burst order is taken while the carriage moves or its motion is not known. Each write that was taken
//! under the key counts as a change (object 2009.1).
//!
//! [`OBJECTS`] is the one table of what can be asked and set: the server checks against it and the EDS is
//! written from it.

mod abort;
pub mod client;
mod eds;
mod limits;
pub mod objects;
mod request;
pub mod server;
mod settings;
mod upload;

pub use abort::Abort;
pub use eds::eds;
pub use limits::{LimitState, Limits};
pub use objects::{Access, Field, OBJECTS, Object, Type};
pub use server::{Action, Answer, BlockState, Server};
pub use settings::{BadSettings, Settings};
pub use upload::{MAX_IMAGE, UploadState};

/// Where requests go, without the node.
pub const REQUEST_BASE: u16 = 0x600;

/// Where answers come from, without the node.
pub const ANSWER_BASE: u16 = 0x580;
