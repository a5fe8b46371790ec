//! Interface of both boards to the driver of a run.

use rigless::machine::Board;

use crate::Nanos;
use crate::outcome::RawSample;
use crate::wire::Wire;

/// A board as a bench and the driver of a run see it.
pub(crate) trait Hardware: Board + 'static {
    /// Puts a 12-bit code on the force channel.
    fn set_force(&mut self, code: u16);
    /// Puts a 12-bit code on the temperature channel.
    fn set_temperature(&mut self, code: u16);
    /// Moves the encoder evenly from where it stands at `now` to `counts` at `by`.
    fn move_encoder(&mut self, now: Nanos, counts: i64, by: Nanos);
    /// Delays the service of the converter's next word until the following one has overrun it.
    fn lose_conversion(&mut self);
    /// Has the flash's ECC, if there is one, report an error that it cannot correct.
    fn find_flash_error(&mut self);
    /// The bus outside the CAN controller.
    fn wire(&mut self) -> &mut Wire;
    /// Has the CAN controller look at the bus, after the bench queued a frame.
    fn look_at_bus(&mut self, now: Nanos);
    /// Samples delivered so far, oldest first.
    fn samples(&mut self) -> &mut Vec<RawSample>;
}

/// The widest code of either converter.
pub(crate) const MAX_CODE: u16 = 0xFFF;
