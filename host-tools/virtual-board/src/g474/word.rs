//! A register by its offset, for peripherals described here and not by a vendor's table.

use rigless::soc::{Access, Layout, ReadAction, RegisterSpec, Width, WriteModify};

/// Words in one peripheral's block of 1 KiB.
const WORDS: usize = 256;

/// Readable, writable 32-bit words that hold what is written, over the whole block. Any further
/// behaviour of a register is in its model.
pub(crate) static BLOCK: [RegisterSpec; WORDS] = {
    const WORD: RegisterSpec = RegisterSpec {
        name: "word",
        offset: 0,
        width: Width::W32,
        reset: 0,
        access: Access::ReadWrite,
        read: ReadAction::None,
        write: WriteModify::None,
        fields: &[],
    };
    let mut words = [WORD; WORDS];
    let mut n = 0;
    while n < WORDS {
        words[n].offset = 4 * n as u32;
        n += 1;
    }
    words
};

/// One 32-bit register of a block, by its byte offset.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Word(pub(crate) u16);

impl Word {
    /// The register `bytes` after this one.
    pub(crate) const fn plus(self, bytes: usize) -> Self {
        Self(self.0 + bytes as u16)
    }
}

impl Layout for Word {
    const REGISTERS: &'static [RegisterSpec] = &BLOCK;

    fn from_index(index: usize) -> Option<Self> {
        (index < WORDS).then_some(Self(4 * index as u16))
    }

    fn index(self) -> usize {
        usize::from(self.0 / 4)
    }
}

/// A peripheral of which only the storage matters: what the firmware sets up there has no effect on
/// what this crate shows.
#[derive(Debug)]
pub(crate) struct Stored;

impl rigless::device::Device for Stored {
    type Register = Word;
}
