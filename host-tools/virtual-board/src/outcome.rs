//! What a run leaves behind.

use std::collections::BTreeMap;
use std::fmt;

use crate::Nanos;

/// A CAN data frame that left the controller and was acknowledged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SentFrame {
    /// End of the frame on the wire.
    pub at: Nanos,
    /// The 11-bit identifier.
    pub id: u16,
    bytes: [u8; 8],
    length: u8,
}

impl SentFrame {
    pub(crate) fn new(at: Nanos, id: u16, data: &[u8]) -> Self {
        let mut bytes = [0; 8];
        for (byte, sent) in bytes.iter_mut().zip(data) {
            *byte = *sent;
        }
        Self { at, id, bytes, length: data.len().min(8) as u8 }
    }

    /// The data bytes, none to eight.
    #[must_use]
    pub fn data(&self) -> &[u8] {
        &self.bytes[..usize::from(self.length)]
    }
}

/// One sample as the hardware took it: two conversions and the encoder count of one trigger.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RawSample {
    /// The instant of the trigger, at which the encoder count is latched.
    pub at: Nanos,
    /// The converted force channel, 12 bits.
    pub force_code: u16,
    /// The converted temperature channel, 12 bits.
    pub temperature_code: u16,
    /// TIM3's counter at the trigger.
    pub encoder_count: u16,
}

/// Why the chip restarted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum ResetCause {
    /// The independent watchdog was not fed in time.
    Watchdog,
    /// The firmware asked for it (`SYSRESETREQ`), as a panic handler may.
    Software,
    /// Something this crate has no name for, in the emulator's own words.
    Other(&'static str),
}

/// One restart of the chip.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Reset {
    /// When.
    pub at: Nanos,
    /// Why.
    pub cause: ResetCause,
}

/// What the instructions of one function cost, over every call the run made of it.
///
/// Counted from the function's first instruction to the instruction after the call, callees
/// included. Calls during which an interrupt or exception was taken are left out of the figures and
/// counted in [`Cost::interrupted`], because the handler's instructions are not the function's.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Cost {
    /// Undisturbed calls.
    pub calls: u64,
    /// Calls left out because an exception was taken meanwhile.
    pub interrupted: u64,
    /// Fewest instructions of an undisturbed call, zero when there was none.
    pub min: u64,
    /// Most instructions of an undisturbed call, zero when there was none.
    pub max: u64,
    /// Instructions of the last undisturbed call, zero when there was none.
    pub last: u64,
}

/// Everything a run leaves behind.
///
/// Two runs with the same chip, image, flash contents and bench are equal in every field.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Outcome {
    /// Virtual time at which the bench ended the run.
    pub ended: Nanos,
    /// Instructions the core executed.
    pub instructions: u64,
    /// Acknowledged frames, oldest first.
    pub frames: Vec<SentFrame>,
    /// Transmissions no node acknowledged. The controllers repeat each until one does.
    pub unacknowledged: u64,
    /// Every sample the converter delivered whole to memory, oldest first.
    pub samples: Vec<RawSample>,
    /// Bytes of RTT up-channel 0: defmt's frames, undecoded.
    pub rtt: Vec<u8>,
    /// Restarts, oldest first.
    pub resets: Vec<Reset>,
    /// Deepest use of the main stack in bytes, over all power-ups of the run.
    pub stack_bytes: u32,
    /// Instruction counts of the functions asked for, by name.
    pub costs: BTreeMap<String, Cost>,
    /// Accesses of the image to which the emulated chip does not respond as silicon would.
    pub gaps: Vec<Gap>,
}

/// An access of the image to a register without a model.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Gap {
    /// Nothing answers at this address: silicon would fault or read zero, the emulator reads zero.
    Unmapped {
        /// The address.
        address: u64,
        /// Program counter of the first access.
        program_counter: u64,
    },
    /// The register stores what is written and does nothing else.
    StoredOnly {
        /// The peripheral.
        peripheral: &'static str,
        /// The register, by address.
        address: u64,
        /// Program counter of the first access.
        program_counter: u64,
    },
}

impl fmt::Display for Gap {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unmapped { address, program_counter } => {
                write!(f, "nothing at {address:#010x}, first touched from {program_counter:#010x}")
            }
            Self::StoredOnly { peripheral, address, program_counter } => write!(
                f,
                "{peripheral} register at {address:#010x} only stores, first touched from {program_counter:#010x}"
            ),
        }
    }
}
