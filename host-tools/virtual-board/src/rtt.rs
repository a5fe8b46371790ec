//! The debugger's end of RTT up-channel 0, where the firmware logs to.

use rigless::emulator::Host;
use rigless::soc::Width;

use crate::image::Symbols;

/// Offsets into SEGGER's control block: 16 bytes of identifier, two counts, then the first
/// up-channel's name, buffer, size, write offset, read offset.
const BUFFER: u64 = 28;
const SIZE: u64 = 32;
const WRITTEN: u64 = 36;
const READ: u64 = 40;

/// The terminal and every byte it took.
#[derive(Debug, Default)]
pub(crate) struct Terminal {
    block: Option<u64>,
    bytes: Vec<u8>,
}

impl Terminal {
    /// The terminal of an image; of an image without RTT it takes nothing.
    pub(crate) fn find(symbols: &Symbols) -> Self {
        let block = symbols.find("_SEGGER_RTT").ok().map(|symbol| u64::from(symbol.address));
        Self { block, bytes: Vec::new() }
    }

    /// Takes what the firmware wrote since the last call.
    pub(crate) fn drain(&mut self, host: &mut dyn Host) {
        let Some(block) = self.block else { return };
        let mut word = |offset| host.read(block + offset, Width::W32).unwrap_or(0);
        let (written, mut read) = (word(WRITTEN), word(READ));
        if written == read {
            return;
        }
        let (buffer, size) = (word(BUFFER), word(SIZE));
        // Before start-up code has set the block up its words are whatever RAM held.
        if written >= size || read >= size {
            return;
        }
        while read != written {
            let byte = host.read(buffer + read, Width::W8).unwrap_or(0);
            self.bytes.push((byte & 0xFF) as u8);
            read = (read + 1) % size;
        }
        // RAM takes every write; a refusal would show as bytes read twice.
        drop(host.write(block + READ, Width::W32, read));
    }

    pub(crate) fn into_bytes(self) -> Vec<u8> {
        self.bytes
    }
}
