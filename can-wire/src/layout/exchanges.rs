//! Layout of frames that are sent on request: bursts and service messages.

use super::Signal;
use super::table::{COUNTER, CRC, whole};
use crate::burst::{ASK_BASE, DATA_BASE};
use crate::service::{ANSWER_BASE, REQUEST_BASE};

/// A kind of frame that belongs to an exchange.
#[derive(Clone, Copy, Debug)]
pub struct ExchangeLayout {
    /// Its identifier without the node.
    pub base: u16,
    /// Name, a C identifier.
    pub name: &'static str,
    /// What it is for.
    pub comment: &'static str,
    /// Whether the block sends it; otherwise its client does.
    pub from_block: bool,
    /// Its signals by rising start bit.
    pub signals: &'static [Signal],
}

/// All of them, highest priority first.
pub static EXCHANGES: [ExchangeLayout; 4] = [
    ExchangeLayout {
        base: DATA_BASE,
        name: "Burst",
        comment: "Raw samples, packed without loss: six bytes of a stream. Only while a burst is under way.",
        from_block: true,
        signals: &[
            whole("segment", 0, 48, "Bytes of the stream."),
            whole("sequence", 48, 7, "Number of the segment, modulo 128."),
            whole("begins", 55, 1, "A record begins with this segment."),
            CRC,
        ],
    },
    ExchangeLayout {
        base: ASK_BASE,
        name: "Asking",
        comment: "To the block: how far the receiver of a burst is and what it lacks.",
        from_block: false,
        signals: &[
            whole("next", 0, 8, "The first segment that is not there yet."),
            whole("missing", 8, 40, "Bit i: segment next + i is to be sent again."),
            COUNTER,
            whole("burst", 52, 4, "Number of the burst, modulo 16."),
            CRC,
        ],
    },
    service(ANSWER_BASE, "Answer", "Answer to a service request, laid out as CANopen's SDO.", true),
    service(REQUEST_BASE, "Request", "To the block: service request, laid out as CANopen's SDO.", false),
];

const fn service(base: u16, name: &'static str, comment: &'static str, from_block: bool) -> ExchangeLayout {
    const SIGNALS: &[Signal] = &[
        whole("command", 0, 8, "CiA 301 command specifier."),
        whole("index", 8, 16, "Index of the object; the EDS lists them all."),
        whole("sub", 24, 8, "Part of the object."),
        whole("value", 32, 32, "Value, low byte first; an abort code where the command is 128."),
    ];
    ExchangeLayout { base, name, comment, from_block, signals: SIGNALS }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::NodeId;
    use crate::burst::frames::{Asking, Segment};
    use crate::service::{OBJECTS, client};

    fn get(exchange: &ExchangeLayout, data: [u8; 8], name: &str) -> u64 {
        let signal = exchange.signals.iter().find(|s| s.name == name).unwrap();
        u64::from_le_bytes(data) >> signal.start_bit & ((1 << signal.length) - 1)
    }

    #[test]
    fn signals_lie_where_the_encoders_put_them() {
        let [burst, asking, _, request] = &EXCHANGES;
        let node = NodeId::FIRST;
        let frame = Segment { sequence: 0x55, begins: true, bytes: [1, 2, 3, 4, 5, 6] }.encode(node);
        assert_eq!(frame.id, burst.base + 1);
        let found = ["segment", "sequence", "begins", "crc"].map(|name| get(burst, frame.data, name));
        assert_eq!(found, [0x0605_0403_0201, 0x55, 1, frame.data[7].into()]);
        let frame = Asking { next: 9, missing: 0x81_0000_0003, number: 0xA, counter: 5 }.encode(node);
        assert_eq!(frame.id, asking.base + 1);
        let found = ["next", "missing", "counter", "burst"].map(|name| get(asking, frame.data, name));
        assert_eq!(found, [9, 0x81_0000_0003, 5, 0xA]);
        let object = OBJECTS.iter().find(|o| (o.index, o.sub) == (0x2002, 3)).unwrap();
        let frame = client::write(node, object, 0x1234);
        assert_eq!(frame.id, request.base + 1);
        let found = ["command", "index", "sub", "value"].map(|name| get(request, frame.data, name));
        assert_eq!(found, [0x2B, 0x2002, 3, 0x1234]);
    }

    #[test]
    fn signals_fill_their_frame_without_overlap() {
        for exchange in &EXCHANGES {
            let mut end = 0;
            for signal in exchange.signals {
                assert_eq!(signal.start_bit, end, "{} {}", exchange.name, signal.name);
                end += signal.length;
                assert!(!signal.comment.contains(['"', '\\']) && signal.comment.is_ascii());
            }
            assert_eq!(end, 64, "{}", exchange.name);
        }
    }
}
