//! Frames of random content on one side, what went into them on the other: food for independent decoders.
//!
//! `random_frames COUNT SEED` prints one frame a line: a candump log entry, then for every signal its name in
//! the DBC, the raw integer and the physical value in the DBC's unit (empty: not available), all separated by
//! commas. The expected numbers come from the generator, not from the encoder.

use can_wire::service::LimitState;
use can_wire::{Beside, BoardKind, Health, Kind, NodeId, Publisher, RawFrame, ResetCause, Workings};
use model_core::consistency::bins::Finding;
use model_core::consistency::{Axis, Verdict};
use model_core::left_out::Acting;
use model_core::ripple::Ripple;
use model_core::sample::{Estimate, Measured, Motion, Reason, Reasons};
use std::io::{BufWriter, Write};

/// xorshift64*.
struct Random(u64);

impl Random {
    fn below(&mut self, n: u32) -> u32 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        let high = self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 32;
        ((high * u64::from(n)) >> 32) as u32
    }

    fn one_of<T: Copy>(&mut self, all: &[T]) -> T {
        all[self.below(all.len() as u32) as usize]
    }

    /// A whole number, its limits more often than chance would have it.
    fn between(&mut self, low: i32, high: i32) -> i32 {
        match self.below(16) {
            0 => low,
            1 => high,
            _ => low + self.below((high - low) as u32 + 1) as i32,
        }
    }
}

/// Signals of a frame as a decoder must find them: name, raw, physical.
#[derive(Default)]
struct Expected(Vec<(&'static str, i64, String)>);

impl Expected {
    /// A code or a count.
    fn whole(&mut self, name: &'static str, raw: impl Into<i64>) {
        let raw = raw.into();
        self.0.push((name, raw, raw.to_string()));
    }

    /// A number of `digits·10^-decimals` in the DBC's unit, which is 10^-`shift` of the SI unit; answers it in SI.
    fn number(&mut self, name: &'static str, digits: i32, decimals: u8, shift: u8) -> f32 {
        self.0.push((name, digits.into(), format!("{digits}e-{decimals}")));
        let si = format!("{digits}e-{}", decimals + shift);
        // what no number is would be sent as not available, and be noticed
        si.parse().unwrap_or(f32::NAN)
    }

    /// A number that is not available.
    fn nothing(&mut self, name: &'static str, raw: i64) {
        self.0.push((name, raw, String::new()));
    }
}

const U16: (i32, i32) = (0, 0xFFFB);
const I16: (i32, i32) = (-0x7FFF, 0x7FFF);
const NO_U16: i64 = 0xFFFF;
const NO_I16: i64 = -0x8000;

/// CiA 301 code and register of each reason, written down a second time on purpose.
const EMERGENCY: [(u16, u8); 16] = [
    (0, 0),
    (0x6300, 0x81),
    (0x5010, 0x81),
    (0x5011, 0x81),
    (0x5012, 0x81),
    (0x5013, 0x09),
    (0x4200, 0x09),
    (0x6100, 0x81),
    (0, 0),
    (0, 0),
    (0, 0),
    (0, 0),
    (0xFF0C, 0x81),
    (0xFF0D, 0x81),
    (0x9000, 0x81),
    (0x6101, 0x81),
];

fn unknown() -> Estimate {
    Estimate {
        tick: 0,
        preload_n: None,
        drag_force_n: None,
        speed_m_s: None,
        temperature_degc: None,
        motion: Motion::Unknown,
        reasons: Reasons::NONE,
    }
}

fn estimate(random: &mut Random, publisher: &mut Publisher, out: &mut Expected) -> RawFrame {
    let mut estimate = unknown();
    let quality = random.below(16) as u8;
    match Reason::from_code(quality) {
        None => {
            let value = out.number("preload", random.between(U16.0, U16.1), 0, 0);
            let sigma = out.number("sigma", random.between(U16.0, U16.1), 0, 0);
            estimate.preload_n = Some(Measured { value, sigma });
        }
        Some(reason) => {
            out.nothing("preload", NO_U16);
            out.nothing("sigma", NO_U16);
            estimate.reasons.insert(reason);
            // less urgent ones must not show
            estimate.reasons.insert_if(random.below(2) == 1, Reason::Stale);
        }
    }
    if random.below(4) == 0 {
        out.nothing("drag_force", NO_I16);
    } else {
        let value = out.number("drag_force", random.between(I16.0, I16.1), 2, 0);
        estimate.drag_force_n = Some(Measured { value, sigma: 0.0 });
    }
    out.whole("quality", quality);
    publisher.estimate(&estimate)
}

fn motion(random: &mut Random, publisher: &mut Publisher, out: &mut Expected) -> RawFrame {
    let mut estimate = unknown();
    if random.below(4) == 0 {
        out.nothing("speed", NO_I16);
    } else {
        let value = out.number("speed", random.between(I16.0, I16.1), 1, 3);
        estimate.speed_m_s = Some(Measured { value, sigma: 0.0 });
    }
    if random.below(4) == 0 {
        out.nothing("temperature", NO_I16);
    } else {
        estimate.temperature_degc = Some(out.number("temperature", random.between(I16.0, I16.1), 2, 0));
    }
    estimate.tick = random.below(u32::MAX);
    let time_us = u64::from(estimate.tick) * 10_000 % 655_360;
    out.0.push(("time", (time_us / 10) as i64, time_us.to_string()));
    estimate.motion = random.one_of(&Motion::ALL);
    out.whole("motion", estimate.motion as u8);
    publisher.motion(&estimate)
}

fn ripple(random: &mut Random, publisher: &mut Publisher, out: &mut Expected) -> RawFrame {
    let ripple = if random.below(4) == 0 {
        out.nothing("amplitude", NO_U16);
        out.nothing("phase", NO_I16);
        None
    } else {
        let amplitude_n = out.number("amplitude", random.between(U16.0, U16.1), 3, 0);
        let phase_rad = out.number("phase", random.between(I16.0, I16.1), 4, 0);
        Some(Ripple { amplitude_n, phase_rad })
    };
    let wavelength_m = out.number("wavelength", random.between(U16.0, U16.1), 3, 3);
    publisher.ripple(ripple, wavelength_m)
}

fn state(random: &mut Random, publisher: &mut Publisher, out: &mut Expected) -> RawFrame {
    let workings = Workings {
        image: random.one_of(&[0, 1, u32::MAX, 0x8000_0000, 0x1234_5678]) ^ random.below(u32::MAX),
        changes: random.between(0, 0x1_FFFF) as u32,
        limits: random.one_of(&LimitState::ALL),
        unlocked: random.below(2) == 1,
        bursting: random.below(2) == 1,
    };
    out.whole("image", workings.image);
    out.whole("changes", workings.changes.min(0xFFFF));
    out.whole("limits", workings.limits as u8);
    out.whole("unlocked", workings.unlocked);
    out.whole("bursting", workings.bursting);
    publisher.state(&workings)
}

fn heartbeat(random: &mut Random, publisher: &mut Publisher, out: &mut Expected) -> RawFrame {
    let health = Health {
        reset_cause: random.one_of(&ResetCause::ALL),
        board: random.one_of(&BoardKind::ALL),
        boot_count: random.between(0, 0xFFFF) as u16,
        frames_dropped: random.between(0, 0x1_FFFF) as u32,
        operational: random.below(2) == 1,
    };
    out.whole("nmt_state", if health.operational { 5 } else { 0 });
    out.whole("reset_cause", health.reset_cause as u8);
    out.whole("board", health.board as u8);
    out.whole("boot_count", health.boot_count);
    out.whole("frames_dropped", health.frames_dropped.min(0xFFFF));
    publisher.heartbeat(&health)
}

fn fault(random: &mut Random, publisher: &mut Publisher, out: &mut Expected) -> RawFrame {
    // thinly set, so that every reason is the most urgent one now and then
    let thin = random.below(0x1_0000) & random.below(0x1_0000) & random.below(0x1_0000);
    let bits = thin as u16 & !1;
    let held = (1..16).filter(|n| bits >> n & 1 == 1).map(|n| EMERGENCY[n]);
    out.whole("error_code", held.clone().map(|e| e.0).find(|c| *c != 0).unwrap_or(0));
    out.whole("error_register", held.fold(0, |all, e| all | e.1));
    for reason in Reason::ALL {
        // as in the DBC
        let name: &'static str = reason.name().replace('-', "_").leak();
        out.whole(name, bits >> reason as u16 & 1);
    }
    let lost = random.between(0, 400) as u32;
    out.whole("lost_blocks", lost.min(255));
    publisher.fault(Reasons::from_bits(bits), lost)
}

fn misfit(random: &mut Random, publisher: &mut Publisher, out: &mut Expected) -> RawFrame {
    let mut verdict = Verdict::NONE;
    let axis = random.below(5) as u8;
    if let Some(on) = Axis::ALL.into_iter().find(|on| *on as u8 + 1 == axis) {
        let strength = out.number("strength", random.between(U16.0, U16.1), 2, 0);
        // the wire has percent, the message a part of 1
        let share = out.number("share", random.between(U16.0, U16.1), 2, 2);
        verdict.worst = Some((on, Finding { strength, share }));
    } else {
        out.nothing("strength", NO_U16);
        out.nothing("share", NO_U16);
    }
    let tick = random.below(u32::MAX);
    if random.below(2) == 0 {
        out.nothing("since", NO_U16);
    } else {
        let seconds = random.between(U16.0, U16.1);
        let _ = out.number("since", seconds, 0, 0);
        verdict.misfit_since = Some(tick.wrapping_sub(100 * seconds as u32));
    }
    out.whole("axis", axis);
    publisher.misfit(&verdict, tick)
}

fn acting(random: &mut Random, publisher: &mut Publisher, out: &mut Expected) -> RawFrame {
    let beside = Beside {
        acting: Acting::from_bits(random.below(512) as u16),
        record: random.below(4) != 0,
        calibrated: random.below(2) == 1,
    };
    for (n, name) in Acting::NAMES.into_iter().enumerate() {
        out.whole(name, beside.acting.bits() >> n & 1);
    }
    out.whole("source", if beside.record { 2 - u8::from(beside.calibrated) } else { 0 });
    publisher.acting(&beside)
}

fn main() -> std::io::Result<()> {
    let mut arguments = std::env::args().skip(1).map(|a| a.parse::<u64>());
    let (Some(Ok(count)), Some(Ok(seed))) = (arguments.next(), arguments.next()) else {
        eprintln!("usage: random_frames COUNT SEED");
        std::process::exit(2);
    };
    let mut out = BufWriter::new(std::io::stdout().lock());
    let mut random = Random(seed.max(1));
    let mut publisher = Publisher::new(NodeId::FIRST);
    let mut counters = [0u8; Kind::ALL.len()];
    for n in 0..count {
        let mut expected = Expected::default();
        let kind = random.one_of(&Kind::ALL);
        let make = match kind {
            Kind::Fault => fault,
            Kind::Estimate => estimate,
            Kind::Motion => motion,
            Kind::Ripple => ripple,
            Kind::Acting => acting,
            Kind::Misfit => misfit,
            Kind::State => state,
            Kind::Heartbeat => heartbeat,
        };
        let frame = make(&mut random, &mut publisher, &mut expected);
        let counter = &mut counters[kind as usize];
        expected.whole("counter", *counter);
        *counter = (*counter + 1) % 16;
        write!(out, "({}.{:06}) can0 {:03X}#", n / 1000, n % 1000 * 1000, frame.id)?;
        for byte in frame.data {
            write!(out, "{byte:02X}")?;
        }
        for (name, raw, physical) in &expected.0 {
            write!(out, ",{name},{raw},{physical}")?;
        }
        writeln!(out)?;
    }
    out.flush()
}
