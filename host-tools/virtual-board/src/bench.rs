//! The world around the board, and what it may do to the pins.

use crate::hardware::{Hardware, MAX_CODE};
use crate::image::Symbols;
use crate::outcome::{RawSample, SentFrame};
use crate::{Error, Nanos};

/// The world around the board: a model of the guide block, a test, a person at a table.
///
/// The board calls it at the start of the run and then at every instant it asked for.
pub trait Bench: Send {
    /// Acts on the pins at `now` and returns the instant of the next call.
    ///
    /// An instant not after `now` means one nanosecond later. `None` ends the run. Between two calls
    /// the board runs alone, so a bench that must react fast has to step often; a thousand steps a
    /// second cost little.
    fn step(&mut self, now: Nanos, pins: &mut Pins<'_>) -> Option<Nanos>;
}

/// Everything outside the chip, as a [`Bench`] reaches it during one step.
pub struct Pins<'a> {
    pub(crate) now: Nanos,
    pub(crate) hardware: &'a mut dyn Hardware,
    pub(crate) symbols: &'a Symbols,
    pub(crate) frames_seen: &'a mut usize,
    pub(crate) samples_seen: &'a mut usize,
    pub(crate) hangs: &'a mut Vec<u32>,
}

impl Pins<'_> {
    /// Puts a code on the force channel from now on: every 12-bit conversion returns exactly this.
    ///
    /// 0 to 4095; more is taken as 4095, as a saturated amplifier reads.
    pub fn force_code(&mut self, code: u16) {
        self.hardware.set_force(code.min(MAX_CODE));
    }

    /// Puts a code on the temperature channel from now on. Range as for [`Pins::force_code`].
    pub fn temperature_code(&mut self, code: u16) {
        self.hardware.set_temperature(code.min(MAX_CODE));
    }

    /// Moves the encoder from where it stands to `counts`, at constant speed, arriving at `by`.
    ///
    /// The board puts the A and B edges on the pins in quadrature order, one per count, evenly
    /// spread. A leads B upwards. A movement still under way ends where it is; a `by` that is not
    /// after now is a jump. Counts are absolute, and zero at power-up; the chip's counter shows the
    /// low 16 bits of what it counted since the firmware started it.
    pub fn move_encoder_to(&mut self, counts: i64, by: Nanos) {
        self.hardware.move_encoder(self.now, counts, by);
    }

    /// Whether some other node on the bus acknowledges frames. It does at power-up.
    pub fn acknowledge(&mut self, acknowledged: bool) {
        self.hardware.wire().acknowledges = acknowledged;
    }

    /// Whether every frame the board sends meets a bit error. Thirty-two attempts lead to bus-off.
    pub fn disturb_bus(&mut self, disturbed: bool) {
        self.hardware.wire().disturbed = disturbed;
    }

    /// Another node sends a data frame with an 11-bit identifier and up to eight bytes.
    ///
    /// It takes the bus when it is free and its identifier wins, so the firmware sees it at least a
    /// frame's length later. Bits above the eleventh and bytes above the eighth do not travel.
    pub fn receive(&mut self, id: u16, data: &[u8]) {
        self.hardware.wire().queue(id, data);
        self.hardware.look_at_bus(self.now);
    }

    /// Makes the converter lose a conversion: the DMA controller is late for the next word, and the
    /// word after it overruns.
    ///
    /// As on silicon the converter then sets `OVR`, asks for no further transfer and, on the F405,
    /// ignores its trigger until the firmware has cleared the flag.
    pub fn lose_conversion(&mut self) {
        self.hardware.lose_conversion();
    }

    /// Makes `FLASH_ECCR` of the STM32G474 report that a double word of its second bank was read that the ECC cannot
    /// correct. No effect on the STM32F405, whose flash has no ECC.
    ///
    /// The NMI that comes with it on silicon does not come: the emulated core has no line for it.
    pub fn find_flash_error(&mut self) {
        self.hardware.find_flash_error();
    }

    /// Hangs the core for good at the first instruction of a function, next time it gets there.
    ///
    /// On the STM32G474 the instruction is replaced by a branch to itself, so interrupts go on being
    /// served. On the STM32F405, whose emulated flash cannot be written while the core runs, the
    /// core is held there as if interrupts were masked. A reset undoes both.
    ///
    /// # Errors
    ///
    /// [`Error::NoSymbol`] if the image has no such symbol; the board runs on.
    pub fn hang(&mut self, function: &str) -> Result<(), Error> {
        self.hangs.push(self.symbols.find(function)?.address);
        Ok(())
    }

    /// Frames that left the controller since the last call, oldest first.
    pub fn take_frames(&mut self) -> Vec<SentFrame> {
        take_new(&self.hardware.wire().sent, self.frames_seen)
    }

    /// Samples the converter delivered since the last call, oldest first.
    pub fn take_samples(&mut self) -> Vec<RawSample> {
        take_new(self.hardware.samples(), self.samples_seen)
    }
}

/// The items past `seen`, which then counts them all.
fn take_new<T: Copy>(items: &[T], seen: &mut usize) -> Vec<T> {
    let new = items[*seen..].to_vec();
    *seen = items.len();
    new
}
