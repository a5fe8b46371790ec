//! Why a run could not be made or could not go on.

use std::fmt;

/// Why a run could not be made or could not go on. The text says what to do about it.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum Error {
    /// The image is not an ELF file this crate can read.
    Image(String),
    /// The image has no symbol of this name.
    NoSymbol(String),
    /// No call instruction of the image reaches this function, so its calls cannot be counted.
    NeverCalled(String),
    /// Bytes do not lie within the chip's flash.
    OutsideFlash {
        /// Where they should have gone.
        address: u32,
        /// How many there are.
        length: usize,
    },
    /// The emulator refused the board, the image or an access.
    Emulator(String),
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Image(why) => write!(f, "the image cannot be read ({why}): pass the ELF file the linker wrote"),
            Self::NoSymbol(name) => write!(
                f,
                "the image has no symbol `{name}`: keep it with #[unsafe(no_mangle)] and #[inline(never)], and do not strip"
            ),
            Self::NeverCalled(name) => {
                write!(f, "nothing in the image calls `{name}` directly: mark it #[inline(never)] and call it by name")
            }
            Self::OutsideFlash { address, length } => {
                write!(f, "{length} bytes at {address:#010x} are not in the chip's flash: check memory.x and the chip")
            }
            Self::Emulator(why) => write!(f, "the emulator stopped: {why}"),
        }
    }
}

impl std::error::Error for Error {}
