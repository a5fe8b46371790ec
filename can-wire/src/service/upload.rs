//! Upload of a parameter image into the block.

use super::Abort;
use super::request::Segment;

/// Largest size of an image, bytes.
pub const MAX_IMAGE: usize = 1024;

/// State of the last image sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum UploadState {
    /// None was sent since the start.
    None = 0,
    /// Part of its bytes have arrived.
    Receiving = 1,
    /// All its bytes have arrived; its CRC has not been given yet.
    Complete = 2,
    /// It is being written to flash.
    Saving = 3,
    /// It is in flash and used from the next start on.
    Saved = 4,
    /// It was not saved; the previous image stays.
    Failed = 5,
    /// It was not saved for lack of room: the block makes room at its next start and then accepts it.
    Full = 6,
}

impl UploadState {
    /// All states, by code.
    pub const ALL: [UploadState; 7] = [
        UploadState::None,
        UploadState::Receiving,
        UploadState::Complete,
        UploadState::Saving,
        UploadState::Saved,
        UploadState::Failed,
        UploadState::Full,
    ];

    /// The name used in tables, CSV and JSON.
    pub const fn name(self) -> &'static str {
        match self {
            UploadState::None => "none",
            UploadState::Receiving => "receiving",
            UploadState::Complete => "complete",
            UploadState::Saving => "saving",
            UploadState::Saved => "saved",
            UploadState::Failed => "failed",
            UploadState::Full => "no room left: restart the block and send it again",
        }
    }

    /// The state with this code.
    pub fn from_code(code: u8) -> Option<UploadState> {
        Self::ALL.into_iter().find(|s| *s as u8 == code)
    }
}

/// The bytes of an image as far as they have arrived.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Upload {
    bytes: [u8; MAX_IMAGE],
    size: usize,
    received: usize,
    toggle: bool,
    pub(crate) state: UploadState,
}

impl Upload {
    pub(crate) const fn new() -> Self {
        Upload { bytes: [0; MAX_IMAGE], size: 0, received: 0, toggle: false, state: UploadState::None }
    }

    /// Begins a new image; the previous bytes are dropped.
    pub(crate) fn begin(&mut self, size: u32) -> Result<(), Abort> {
        let size = usize::try_from(size).map_err(|_| Abort::TooLong)?;
        if size == 0 {
            return Err(Abort::TooShort);
        }
        if size > MAX_IMAGE {
            return Err(Abort::TooLong);
        }
        (self.size, self.received, self.toggle, self.state) = (size, 0, false, UploadState::Receiving);
        Ok(())
    }

    /// Takes a segment; everything is checked before anything changes.
    pub(crate) fn segment(&mut self, segment: &Segment) -> Result<(), Abort> {
        if self.state != UploadState::Receiving {
            return Err(Abort::Command);
        }
        if segment.toggle != self.toggle {
            return Err(Abort::Toggle);
        }
        let bytes = segment.bytes();
        let end = self.received + bytes.len();
        if end > self.size {
            return Err(Abort::TooLong);
        }
        if segment.last != (end == self.size) || bytes.is_empty() {
            return Err(Abort::Length);
        }
        let place = self.bytes.get_mut(self.received..end).ok_or(Abort::TooLong)?;
        place.copy_from_slice(bytes);
        (self.received, self.toggle) = (end, !self.toggle);
        if segment.last {
            self.state = UploadState::Complete;
        }
        Ok(())
    }

    /// Accepts the image for saving if all its bytes have arrived and the CRC matches.
    pub(crate) fn commit(&mut self, crc: u32) -> Result<(), Abort> {
        if self.state != UploadState::Complete {
            return Err(Abort::State);
        }
        if crate::checksum::crc32(self.image()) != crc {
            return Err(Abort::Value);
        }
        self.state = UploadState::Saving;
        Ok(())
    }

    /// The client has given up.
    pub(crate) fn abort(&mut self) {
        if self.state == UploadState::Receiving {
            (self.size, self.received, self.state) = (0, 0, UploadState::None);
        }
    }

    /// The bytes that have arrived.
    pub(crate) fn image(&self) -> &[u8] {
        self.bytes.get(..self.received).unwrap_or_default()
    }
}
