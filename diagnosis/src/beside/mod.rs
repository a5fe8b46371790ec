//! What shows without a fit: in a channel, or in the noise before it is learnt.
//!
//! ```text
//! speed        a recorded speed that is worse than that of the position
//! ringing      a structure that rings, taken for noise; spectra: what stands out at every speed
//! events       spots that no form of the library has a place for; pulses: what finds them
//! bursts       what brakes for tenths of a second
//! gap          play of a few micrometres
//! ```

pub(crate) mod bursts;
pub(crate) mod events;
pub(crate) mod gap;
pub(crate) mod pulses;
pub(crate) mod ringing;
pub(crate) mod spectra;
pub(crate) mod speed;
