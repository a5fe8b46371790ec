//! Layout of all frames as one table: the source of the DBC, the documentation and the cross-checks.
//!
//! Little-endian only, no floating-point and no multiplexed signals: several DBC tools get those wrong.
//! Every offset is 0. Bits that no signal covers are 0. Texts are ASCII without quotes, as DBC wants them.

mod dbc;
mod exchanges;
mod table;

pub use dbc::dbc;
pub use exchanges::{EXCHANGES, ExchangeLayout};
pub use table::MESSAGES;

use crate::frame::Kind;
use core::fmt::{self, Display};

/// One kind of frame.
#[derive(Clone, Copy, Debug)]
pub struct MessageLayout {
    /// Its identifier without the node.
    pub kind: Kind,
    /// Name, a C identifier.
    pub name: &'static str,
    /// What it is for.
    pub comment: &'static str,
    /// Time between two of them, ms, as the block is delivered.
    pub cycle_ms: u16,
    /// Its signals by rising start bit.
    pub signals: &'static [Signal],
}

/// One field of a frame.
#[derive(Clone, Copy, Debug)]
pub struct Signal {
    /// Name, a C identifier.
    pub name: &'static str,
    /// Its lowest bit: 8·byte + bit, bit 0 the lowest of a byte.
    pub start_bit: u8,
    /// Number of bits.
    pub length: u8,
    /// Whether it is signed, in two's complement.
    pub signed: bool,
    /// Factor from raw to physical.
    pub scale: Scale,
    /// Physical unit; empty for codes and counts.
    pub unit: &'static str,
    /// Smallest raw number; codes in `values` may lie outside.
    pub raw_min: i64,
    /// Largest raw number; codes in `values` may lie outside.
    pub raw_max: i64,
    /// What it means.
    pub comment: &'static str,
    /// Meaning of raw codes.
    pub values: &'static [(i32, &'static str)],
}

/// A decimal factor, exact: `factor·10^-decimals`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Scale {
    /// Whole number.
    pub factor: u16,
    /// Decimal places to shift it right by, up to 9.
    pub decimals: u8,
}

impl Scale {
    /// A raw number times the factor, as a decimal text without needless zeros.
    pub fn physical(self, raw: i64) -> impl Display {
        Decimal { digits: raw * i64::from(self.factor), decimals: self.decimals }
    }
}

/// `digits·10^-decimals`
struct Decimal {
    digits: i64,
    decimals: u8,
}

impl Display for Decimal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let one = 10u64.pow(u32::from(self.decimals));
        let sign = if self.digits < 0 { "-" } else { "" };
        let (whole, mut fraction) = (self.digits.unsigned_abs() / one, self.digits.unsigned_abs() % one);
        write!(f, "{sign}{whole}")?;
        let mut places = usize::from(self.decimals);
        while places > 0 && fraction.is_multiple_of(10) {
            fraction /= 10;
            places -= 1;
        }
        if places > 0 { write!(f, ".{fraction:0places$}") } else { Ok(()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::{LENGTH, NodeId, seal};
    use crate::{Message, Publisher, decode};
    use model_core::sample::{Reason, Reasons};
    use std::string::{String, ToString};
    use std::vec::Vec;

    /// Numbers from a fixed seed: xorshift64.
    struct Random(u64);

    impl Random {
        fn below(&mut self, n: u64) -> u64 {
            self.0 ^= self.0 << 13;
            self.0 ^= self.0 >> 7;
            self.0 ^= self.0 << 17;
            self.0 % n
        }

        /// A random raw number of the signal: often one of its limits or codes.
        fn raw(&mut self, signal: &Signal) -> i64 {
            let span = u64::try_from(signal.raw_max - signal.raw_min).unwrap() + 1;
            match self.below(4) {
                0 if !signal.values.is_empty() => {
                    let n = self.below(signal.values.len().try_into().unwrap());
                    signal.values[usize::try_from(n).unwrap()].0.into()
                }
                1 => [signal.raw_min, signal.raw_max][usize::from(self.below(2) == 1)],
                _ => signal.raw_min + i64::try_from(self.below(span)).unwrap(),
            }
        }
    }

    fn put(data: &mut u64, signal: &Signal, raw: i64) {
        let mask = (1u64 << signal.length) - 1;
        *data |= (raw as u64 & mask) << signal.start_bit;
    }

    fn get(data: u64, signal: &Signal) -> i64 {
        let unused = 64 - u32::from(signal.length);
        let top = data << (unused - u32::from(signal.start_bit));
        if signal.signed { (top as i64) >> unused } else { (top >> unused) as i64 }
    }

    /// What the decoder made of a signal, in the table's unit; `None` when not available or not in the message.
    fn decoded(message: &Message, name: &str) -> Option<f64> {
        let si = |x: Option<f32>| x.map(f64::from);
        let code = |x: u8| Some(f64::from(x));
        match (message, name) {
            (m, "counter") => code(m.counter()),
            (Message::Fault(m), "error_code") => Some(f64::from(m.error_code)),
            (Message::Fault(m), "error_register") => code(m.error_register),
            (Message::Fault(m), "lost_blocks") => code(m.lost_blocks),
            (Message::Fault(m), name) => {
                let reason = Reason::ALL.into_iter().find(|r| r.name().replace('-', "_") == name);
                code(m.reasons.contains(reason.unwrap_or_else(|| panic!("{name}"))).into())
            }
            (Message::Estimate(m), "preload") => si(m.preload_n),
            (Message::Estimate(m), "sigma") => si(m.sigma_n),
            (Message::Estimate(m), "drag_force") => si(m.drag_force_n),
            (Message::Estimate(m), "quality") => code(m.quality.map_or(0, |r| r as u8)),
            (Message::Motion(m), "speed") => si(m.speed_m_s).map(|v| v * 1e3),
            (Message::Motion(m), "temperature") => si(m.temperature_degc),
            (Message::Motion(m), "time") => Some(f64::from(m.time_us)),
            (Message::Motion(m), "motion") => code(m.motion as u8),
            (Message::Ripple(m), "amplitude") => si(m.amplitude_n),
            (Message::Ripple(m), "phase") => si(m.phase_rad),
            (Message::Ripple(m), "wavelength") => si(m.wavelength_m).map(|v| v * 1e3),
            (Message::Misfit(m), "strength") => si(m.strength),
            (Message::Misfit(m), "share") => si(m.share).map(|s| 100.0 * s),
            (Message::Misfit(m), "since") => si(m.since_s),
            (Message::Misfit(m), "axis") => code(m.axis.map_or(0, |axis| axis as u8 + 1)),
            (Message::State(m), "image") => Some(f64::from(m.image)),
            (Message::State(m), "changes") => Some(f64::from(m.changes)),
            (Message::State(m), "limits") => code(m.limits as u8),
            (Message::State(m), "unlocked") => code(m.unlocked.into()),
            (Message::State(m), "bursting") => code(m.bursting.into()),
            (Message::Acting(m), "source") => code(m.source as u8),
            (Message::Acting(m), name) => code(m.acting.names().any(|own| own == name).into()),
            (Message::Heartbeat(m), "nmt_state") => code(m.state as u8),
            (Message::Heartbeat(m), "reset_cause") => code(m.reset_cause as u8),
            (Message::Heartbeat(m), "board") => code(m.board as u8),
            (Message::Heartbeat(m), "boot_count") => Some(f64::from(m.boot_count)),
            (Message::Heartbeat(m), "frames_dropped") => Some(f64::from(m.frames_dropped)),
            (m, name) => panic!("{name} of {m:?}"),
        }
    }

    #[test]
    fn table_and_decoder_agree() {
        let node = NodeId::new(42).unwrap();
        let mut random = Random(0x9E37_79B9_7F4A_7C15);
        for layout in &MESSAGES {
            let mut taken = 0;
            while taken < 2000 {
                let mut data = 0;
                for signal in layout.signals {
                    put(&mut data, signal, random.raw(signal));
                }
                let mut frame = seal(layout.kind.identifier(node), &data.to_le_bytes());
                if layout.kind == Kind::Fault {
                    // code, register and reasons depend on each other: random ones would never be accepted
                    let reasons = Reasons::from_bits((data >> 24) as u16);
                    frame = Publisher::new(node).fault(reasons, random.below(300).try_into().unwrap());
                }
                let Ok((_, message)) = decode(frame.id, &frame.data) else { continue };
                taken += 1;
                let data = u64::from_le_bytes(frame.data);
                for signal in layout.signals.iter().filter(|s| s.name != "crc") {
                    let raw = get(data, signal);
                    let number = (signal.raw_min..=signal.raw_max).contains(&raw);
                    let expected: f64 = signal.scale.physical(raw).to_string().parse().unwrap();
                    match decoded(&message, signal.name) {
                        Some(value) if number => {
                            // f32 on the decoder's side
                            assert!(
                                (value - expected).abs() <= 1e-7 * expected.abs(),
                                "{} {value} {expected}",
                                signal.name
                            )
                        }
                        None if !number => {}
                        other => panic!("{} {raw}: {other:?}", signal.name),
                    }
                }
            }
        }
    }

    #[test]
    fn signals_fill_their_frame_without_overlap() {
        for (kind, layout) in Kind::ALL.into_iter().zip(&MESSAGES) {
            assert_eq!(layout.kind, kind);
            let mut end = 0;
            for signal in layout.signals {
                assert!(signal.start_bit >= end, "{} {}", layout.name, signal.name);
                end = signal.start_bit + signal.length;
            }
            assert_eq!(usize::from(end), 8 * LENGTH);
        }
    }

    #[test]
    fn every_reason_has_its_bit_under_its_name() {
        for reason in Reason::ALL {
            let bit = 24 + reason as u8;
            let signal = MESSAGES[0].signals.iter().find(|s| s.start_bit == bit).unwrap();
            assert_eq!((signal.name, signal.length), (reason.name().replace('-', "_").as_str(), 1));
        }
    }

    #[test]
    fn texts_suit_a_dbc() {
        let plain = |text: &str| text.is_ascii() && !text.contains(['"', '\\']);
        for layout in &MESSAGES {
            assert!(plain(layout.comment) && !layout.comment.is_empty());
            let mut names = Vec::new();
            for signal in layout.signals {
                assert!(signal.name.chars().all(|c| c.is_ascii_lowercase() || c == '_') && signal.name.len() <= 32);
                assert!(!names.contains(&signal.name), "{}", signal.name);
                names.push(signal.name);
                assert!(plain(signal.comment) && !signal.comment.is_empty() && plain(signal.unit));
                assert!(signal.values.iter().all(|(_, meaning)| plain(meaning)));
            }
        }
    }

    #[test]
    fn decimals_are_exact_and_short() {
        for (raw, factor, decimals, text) in [
            (0, 1, 4, "0"),
            (1, 1, 2, "0.01"),
            (-1, 1, 4, "-0.0001"),
            (-32767, 1, 4, "-3.2767"),
            (65531, 1, 3, "65.531"),
            (14300, 1, 3, "14.3"),
            (100, 1, 2, "1"),
            (-12000, 1, 3, "-12"),
            (65535, 10, 0, "655350"),
            (1010, 1, 3, "1.01"),
        ] {
            assert_eq!(Scale { factor, decimals }.physical(raw).to_string(), text);
        }
    }

    #[test]
    fn the_dbc_in_the_repository_is_that_of_node_1() {
        let mut text = String::new();
        dbc(NodeId::FIRST, &mut text).unwrap();
        assert!(
            text == include_str!("../../guideblock.dbc"),
            "write can-wire/guideblock.dbc anew: guideblock dbc > can-wire/guideblock.dbc"
        );
    }

    #[test]
    fn other_nodes_have_their_identifiers() {
        let mut text = String::new();
        dbc(NodeId::LAST, &mut text).unwrap();
        for line in [
            "BO_ 255 GuideBlock127_Fault: 8 GuideBlock127",
            "BO_ 511 GuideBlock127_Estimate: 8 GuideBlock127",
            "BO_ 767 GuideBlock127_Motion: 8 GuideBlock127",
            "BO_ 1023 GuideBlock127_Ripple: 8 GuideBlock127",
            "BO_ 895 GuideBlock127_Acting: 8 GuideBlock127",
            "BO_ 1151 GuideBlock127_Misfit: 8 GuideBlock127",
            "BO_ 1791 GuideBlock127_State: 8 GuideBlock127",
            "BO_ 1919 GuideBlock127_Heartbeat: 8 GuideBlock127",
            "BO_ 1279 GuideBlock127_Burst: 8 GuideBlock127",
            "BO_ 1663 GuideBlock127_Request: 8 Vector__XXX",
            "BA_ \"GenMsgCycleTime\" BO_ 1919 500;",
        ] {
            assert!(text.lines().any(|l| l == line), "{line}");
        }
    }
}
