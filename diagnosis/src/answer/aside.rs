//! What was found without a fit.

use crate::answer::play::Play;
use crate::beside::events::Spots;
use crate::beside::ringing::Heard;
use crate::beside::speed::SetAside;

/// What was found without a fit.
pub(crate) struct Aside<'a> {
    pub(crate) spots: Option<&'a Spots>,
    pub(crate) speed: Option<SetAside>,
    pub(crate) heard: Option<&'a Heard>,
    pub(crate) play: Option<&'a Play>,
}
