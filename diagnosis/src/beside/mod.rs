//! Searches without a fit: in a channel, or in the noise before it is estimated.
//!
//! ```text
//! speed        a recorded speed that is noisier than another; moved: what looks like its noise and is none
//! ringing      a structure that rings, mistaken for noise; spectra: peaks at every speed
//! events       spots that no form of the library represents; pulses: the matched filter that finds them
//! corners      whether they lie where the acceleration changes, as no dirt does
//! bursts       braking for tenths of a second, or pushing to one side
//! transients   narrow-band sounds that come and go
//! gap          play of a few micrometres
//! ```

pub(crate) mod bursts;
pub(crate) mod corners;
pub(crate) mod events;
pub(crate) mod gap;
mod moved;
pub(crate) mod pulses;
pub(crate) mod ringing;
pub(crate) mod spectra;
pub(crate) mod speed;
pub(crate) mod transients;
