//! Reasons to reject a frame.

/// Why a frame, or a counter, is rejected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reject {
    /// No guide block sends this identifier.
    UnknownIdentifier(u16),
    /// The identifier is one of a guide block but for its node, 0.
    NodeRange,
    /// The frame has this many data bytes instead of 8.
    Length(usize),
    /// The CRC in byte 7 does not belong to identifier and data.
    Crc {
        /// CRC computed from the frame received.
        expected: u8,
        /// Byte 7 of the frame received.
        found: u8,
    },
    /// The field holds a code that has no meaning.
    UndefinedCode {
        /// Name of the field, as on the page of its frame.
        field: &'static str,
        /// The code.
        code: u16,
    },
    /// The field contradicts another one of the same frame.
    Contradiction {
        /// Name of the field, as on the page of its frame.
        field: &'static str,
    },
    /// The alive counter has not moved on: the frame is a copy, or the sender hangs.
    RepeatedCounter(u8),
}

impl Reject {
    /// The name used in tables, CSV and JSON; the same for all frames rejected for the same reason.
    pub const fn name(self) -> &'static str {
        match self {
            Reject::UnknownIdentifier(_) => "unknown-identifier",
            Reject::NodeRange => "node-range",
            Reject::Length(_) => "length",
            Reject::Crc { .. } => "crc",
            Reject::UndefinedCode { .. } => "undefined-code",
            Reject::Contradiction { .. } => "contradiction",
            Reject::RepeatedCounter(_) => "repeated-counter",
        }
    }
}

impl core::fmt::Display for Reject {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Reject::UnknownIdentifier(id) => {
                write!(f, "identifier {id:#05X} is none of a guide block's; ignore the frame")
            }
            Reject::NodeRange => write!(f, "node 0 is no guide block; ignore the frame"),
            Reject::Length(n) => write!(
                f,
                "{n} data bytes instead of 8; look for another device on this identifier, or a gateway that cuts frames"
            ),
            Reject::Crc { expected, found } => write!(
                f,
                "CRC is {found:#04X}, identifier and data give {expected:#04X}; drop the frame and look for another device on this identifier, or a gateway that alters frames"
            ),
            Reject::UndefinedCode { field, code } => {
                write!(
                    f,
                    "{field} holds {code:#X}, which has no meaning here; use a reader as new as the block's firmware"
                )
            }
            Reject::Contradiction { field } => {
                write!(f, "{field} contradicts the rest of the frame; use a reader as new as the block's firmware")
            }
            Reject::RepeatedCounter(counter) => write!(
                f,
                "alive counter stays at {counter}; drop the copy, and check the block when no other frame follows"
            ),
        }
    }
}

impl core::error::Error for Reject {}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    #[test]
    fn texts_name_the_culprit() {
        for (reject, text) in [
            (Reject::UnknownIdentifier(0x42), "identifier 0x042 is none of a guide block's; ignore the frame"),
            (Reject::NodeRange, "node 0 is no guide block; ignore the frame"),
            (
                Reject::Length(3),
                "3 data bytes instead of 8; look for another device on this identifier, or a gateway that cuts frames",
            ),
            (
                Reject::Crc { expected: 0xA, found: 0xFF },
                "CRC is 0xFF, identifier and data give 0x0A; drop the frame and look for another device on this identifier, or a gateway that alters frames",
            ),
            (
                Reject::UndefinedCode { field: "motion", code: 9 },
                "motion holds 0x9, which has no meaning here; use a reader as new as the block's firmware",
            ),
            (
                Reject::Contradiction { field: "preload" },
                "preload contradicts the rest of the frame; use a reader as new as the block's firmware",
            ),
            (
                Reject::RepeatedCounter(4),
                "alive counter stays at 4; drop the copy, and check the block when no other frame follows",
            ),
        ] {
            assert_eq!(reject.to_string(), text);
        }
    }
}
