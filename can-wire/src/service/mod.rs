//! Service messages: read a block's identity and state and write its settings, one object at a time.
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
//! **A refused request changes nothing**: whatever the reason, it leaves the block as it was, an image that is being
//! sent included, and is answered with an abort code. No answer is sent to frames with another identifier or another
//! length, nor to an abort, which ends an image that is being sent. Bytes that a request does not use are ignored.
//!
//! **Who may write**: everything but the key and the burst order is read-only until the [key](server::Server)
//! has been written, and again five minutes after the last accepted write. Nothing but the key and the burst order is
//! accepted while the carriage moves or its motion is not known. Each write accepted under the key counts as a change
//! (object 2009.1).
//!
//! [`OBJECTS`] is the one table of all objects: the server checks against it and the EDS is written from it.

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

/// Identifier of requests, without the node.
pub const REQUEST_BASE: u16 = 0x600;

/// Identifier of answers, without the node.
pub const ANSWER_BASE: u16 = 0x580;
