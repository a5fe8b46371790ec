//! What was found beside the fits.

use crate::events::Spots;
use crate::play::Play;
use crate::ringing::Heard;
use crate::speed::SetAside;

/// What was found beside the fits.
pub(crate) struct Aside<'a> {
    pub(crate) spots: Option<&'a Spots>,
    pub(crate) speed: Option<SetAside>,
    pub(crate) heard: Option<&'a Heard>,
    pub(crate) play: Option<&'a Play>,
}
