//! The layout table of all cyclic frames.

use super::{MessageLayout, Scale, Signal};
use crate::acting::Source;
use crate::fault::error_code;
use crate::frame::Kind;
use crate::heartbeat::{BoardKind, NmtState, ResetCause};
use crate::number::{MAX_U16, NO_I16, NO_U16};
use crate::service::LimitState;
use model_core::sample::{Motion, Reason};

/// All frames, highest priority first.
pub static MESSAGES: [MessageLayout; Kind::ALL.len()] = [
    MessageLayout {
        kind: Kind::Fault,
        name: "Fault",
        comment: "Everything that stands against the estimate. Bytes 0 to 2 are the CANopen emergency object. Also sent at once when the reasons change.",
        cycle_ms: 1000,
        signals: &[
            Signal { values: &ERROR_CODES, ..whole("error_code", 0, 16, "CiA 301 emergency error code.") },
            whole(
                "error_register",
                16,
                8,
                "CiA 301 error register: bit 0 any error, bit 3 temperature, bit 7 manufacturer's own.",
            ),
            reason(Reason::NotCalibrated, "not_calibrated", "No parameter record, or one that is not calibrated."),
            reason(Reason::ForceAtRail, "force_at_rail", "Force converter at an end of its range."),
            reason(Reason::ForceStuck, "force_stuck", "Force code does not move at all."),
            reason(Reason::EncoderStuck, "encoder_stuck", "Encoder fell silent at full speed."),
            reason(Reason::TemperatureMissing, "temperature_missing", "Thermometer open or short."),
            reason(
                Reason::TemperatureOutOfRange,
                "temperature_out_of_range",
                "Temperature outside the range the oil is known for.",
            ),
            reason(Reason::SamplesLost, "samples_lost", "Samples lost within the window."),
            reason(Reason::NoMotion, "no_motion", "The carriage stands."),
            reason(Reason::Reversing, "reversing", "The carriage turns round."),
            reason(Reason::Accelerating, "accelerating", "The speed changes too much."),
            reason(Reason::Settling, "settling", "The window is not full yet."),
            reason(Reason::SpeedOutOfRange, "speed_out_of_range", "Speed outside the calibrated range."),
            reason(Reason::LoadOutOfRange, "load_out_of_range", "Drag force or preload outside the calibrated range."),
            reason(Reason::ForceAssists, "force_assists", "Something outside the guide pushes the carriage."),
            reason(Reason::Stale, "stale", "No new samples came."),
            whole("lost_blocks", 40, 8, "Blocks of samples (10 ms) lost since start-up; 255: that and more."),
            COUNTER,
            CRC,
        ],
    },
    MessageLayout {
        kind: Kind::Estimate,
        name: "Estimate",
        comment: "Preload and how sure it is, or why there is none.",
        cycle_ms: 100,
        signals: &[
            unsigned("preload", 0, scale(1, 0), "N", "Preload. Available exactly when quality is 0."),
            unsigned(
                "sigma",
                16,
                scale(1, 0),
                "N",
                "Standard deviation of the preload. Available exactly when quality is 0.",
            ),
            signed(
                "drag_force",
                32,
                scale(1, 2),
                "N",
                "Drag force in steady motion, positive against the motion, seals included.",
            ),
            COUNTER,
            Signal {
                values: &QUALITY,
                ..code("quality", 52, "0: preload may be trusted; else the most urgent reason why not.")
            },
            CRC,
        ],
    },
    MessageLayout {
        kind: Kind::Motion,
        name: "Motion",
        comment: "What the carriage did while the estimate was taken.",
        cycle_ms: 100,
        signals: &[
            signed("speed", 0, scale(1, 1), "mm/s", "Carriage speed, positive towards larger positions."),
            signed("temperature", 16, scale(1, 2), "degC", "Temperature of the block."),
            Signal {
                scale: scale(10, 0),
                unit: "us",
                ..whole("time", 32, 16, "Time of the newest block of samples; wraps every 0.65536 s.")
            },
            COUNTER,
            Signal { values: &MOTION, ..code("motion", 52, "What the carriage does.") },
            CRC,
        ],
    },
    MessageLayout {
        kind: Kind::Acting,
        name: "Acting",
        comment: "What acts beside the drag law in the parameters that the block runs, and where they come from.",
        cycle_ms: 1000,
        signals: &[
            whole("seal", 0, 1, "Friction of seals, wipers and cage."),
            whole("viscous", 1, 1, "Friction that grows with speed and not with load."),
            whole("oil", 2, 1, "Oil that the law does not have."),
            whole("asymmetry", 3, 1, "Friction that differs between the directions."),
            whole("load", 4, 1, "Known load on the block."),
            whole("pull", 5, 1, "Force that does not come from the guide."),
            whole("sensor", 6, 1, "Offset, gain and lag of the force channel."),
            whole("waves", 7, 1, "Waves along the rail."),
            whole("rail", 8, 1, "Table along the rail."),
            COUNTER,
            Signal { raw_max: 2, values: &SOURCES, ..code("source", 52, "Where the parameters come from.") },
            CRC,
        ],
    },
    MessageLayout {
        kind: Kind::Ripple,
        name: "Ripple",
        comment: "Ball-pass ripple of the drag force: mean + amplitude*cos(2*pi*position/wavelength - phase).",
        cycle_ms: 1000,
        signals: &[
            unsigned("amplitude", 0, scale(1, 3), "N", "Amplitude, half of peak to peak."),
            signed("phase", 16, scale(1, 4), "rad", "Phase at position 0. Available exactly when the amplitude is."),
            unsigned("wavelength", 32, scale(1, 3), "mm", "Carriage travel per ball entering the loaded zone."),
            COUNTER,
            CRC,
        ],
    },
    MessageLayout {
        kind: Kind::Misfit,
        name: "Misfit",
        comment: "Whether the model that the block runs fits what it sees: the axis on which its estimates disagree most.",
        cycle_ms: 1000,
        signals: &[
            unsigned("strength", 0, scale(1, 2), "", "How surely they disagree, in standard deviations."),
            unsigned("share", 16, scale(1, 2), "%", "By how much they disagree, share of the drag force."),
            unsigned(
                "since",
                32,
                scale(1, 0),
                "s",
                "For how long the model has not fitted. Available exactly while it does not.",
            ),
            COUNTER,
            Signal { raw_max: 4, values: &AXES, ..code("axis", 52, "The axis on which the estimates disagree most.") },
            CRC,
        ],
    },
    MessageLayout {
        kind: Kind::State,
        name: "State",
        comment: "What the block works with, and what has been changed on it. Also sent at once when it changes.",
        cycle_ms: 1000,
        signals: &[
            whole("image", 0, 32, "Hash of the active parameter image; 0: none, the built-in parameters."),
            whole("changes", 32, 16, "Changes accepted since the start; 65535: that and more."),
            COUNTER,
            Signal { values: &LIMITS, ..whole("limits", 52, 2, "On which side of its limits the preload lies.") },
            whole("unlocked", 54, 1, "The block takes changes."),
            whole("bursting", 55, 1, "A burst is under way."),
            CRC,
        ],
    },
    MessageLayout {
        kind: Kind::Heartbeat,
        name: "Heartbeat",
        comment: "Sign of life and what happened to the block. Byte 0 is the CANopen heartbeat.",
        cycle_ms: 500,
        signals: &[
            Signal { values: &NMT_STATE, ..whole("nmt_state", 0, 8, "CiA 301 state of the block.") },
            Signal { values: &RESET_CAUSE, ..code("reset_cause", 8, "What started the block.") },
            Signal { values: &BOARD, ..code("board", 12, "What the firmware runs on.") },
            whole("boot_count", 16, 16, "Starts since the supply was switched on; 65535: that and more."),
            whole("frames_dropped", 32, 16, "Frames that found no free mailbox since the start; 65535: that and more."),
            COUNTER,
            CRC,
        ],
    },
];

const AXES: [(i32, &str); 5] = [(0, "not judged"), (1, "speed"), (2, "direction"), (3, "position"), (4, "temperature")];

pub(super) const COUNTER: Signal = code("counter", 48, "Alive counter, one more in each frame of this identifier.");

pub(super) const CRC: Signal = whole(
    "crc",
    56,
    8,
    "CRC-8/AUTOSAR (polynomial 0x2F, start and final XOR 0xFF) over the identifier as 2 bytes, low first, then bytes 0 to 6.",
);

const fn scale(factor: u16, decimals: u8) -> Scale {
    Scale { factor, decimals }
}

/// An unsigned number without unit that uses all its codes.
pub(super) const fn whole(name: &'static str, start_bit: u8, length: u8, comment: &'static str) -> Signal {
    Signal {
        name,
        start_bit,
        length,
        signed: false,
        scale: scale(1, 0),
        unit: "",
        raw_min: 0,
        raw_max: (1 << length) - 1,
        comment,
        values: &[],
    }
}

/// An unsigned code of four bits.
const fn code(name: &'static str, start_bit: u8, comment: &'static str) -> Signal {
    whole(name, start_bit, 4, comment)
}

/// The bit of a reason in the fault frame.
const fn reason(reason: Reason, name: &'static str, comment: &'static str) -> Signal {
    whole(name, 24 + reason as u8, 1, comment)
}

/// A u16 that may be not available.
const fn unsigned(
    name: &'static str,
    start_bit: u8,
    scale: Scale,
    unit: &'static str,
    comment: &'static str,
) -> Signal {
    const NOT_AVAILABLE: &[(i32, &str)] = &[(NO_U16 as i32, "not available")];
    Signal { scale, unit, raw_max: MAX_U16 as i64, values: NOT_AVAILABLE, ..whole(name, start_bit, 16, comment) }
}

/// An i16 that may be not available.
const fn signed(name: &'static str, start_bit: u8, scale: Scale, unit: &'static str, comment: &'static str) -> Signal {
    const NOT_AVAILABLE: &[(i32, &str)] = &[(NO_I16 as i32, "not available")];
    const LIMIT: i64 = i16::MAX as i64;
    Signal {
        signed: true,
        scale,
        unit,
        raw_min: -LIMIT,
        raw_max: LIMIT,
        values: NOT_AVAILABLE,
        ..whole(name, start_bit, 16, comment)
    }
}

const QUALITY: [(i32, &str); Reason::ALL.len() + 1] = {
    let mut table = [(0, "trusted"); Reason::ALL.len() + 1];
    let mut n = 0;
    while n < Reason::ALL.len() {
        table[n + 1] = (Reason::ALL[n] as i32, Reason::ALL[n].name());
        n += 1;
    }
    table
};

/// Reasons with an error code of their own.
const ERRORS: usize = {
    let (mut n, mut count) = (0, 0);
    while n < Reason::ALL.len() {
        count += (error_code(Reason::ALL[n]) != 0) as usize;
        n += 1;
    }
    count
};

const ERROR_CODES: [(i32, &str); ERRORS + 1] = {
    let mut table = [(0, "no error"); ERRORS + 1];
    let (mut n, mut at) = (0, 1);
    while n < Reason::ALL.len() {
        let code = error_code(Reason::ALL[n]);
        if code != 0 {
            table[at] = (code as i32, Reason::ALL[n].name());
            at += 1;
        }
        n += 1;
    }
    table
};

/// Value table of an enum that has `ALL` and `name`.
macro_rules! value_table {
    ($name:ident, $of:ty) => {
        const $name: [(i32, &str); <$of>::ALL.len()] = {
            let mut table = [(0, ""); <$of>::ALL.len()];
            let mut n = 0;
            while n < table.len() {
                table[n] = (<$of>::ALL[n] as i32, <$of>::ALL[n].name());
                n += 1;
            }
            table
        };
    };
}

value_table!(SOURCES, Source);
value_table!(MOTION, Motion);
value_table!(NMT_STATE, NmtState);
value_table!(RESET_CAUSE, ResetCause);
value_table!(BOARD, BoardKind);
value_table!(LIMITS, LimitState);
