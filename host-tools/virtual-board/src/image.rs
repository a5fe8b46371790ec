//! Content of the linked image: symbols, section sizes, and calls.

use std::collections::BTreeMap;

use object::elf::{SHF_ALLOC, SHF_EXECINSTR, SHF_WRITE, SHT_NOBITS};
use object::{Object, ObjectSection, ObjectSymbol, SectionFlags, SectionKind};

use crate::Error;

/// A symbol of the image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Symbol {
    /// Its address, with the Thumb bit of a function cleared.
    pub address: u32,
    /// Its size in bytes, zero where the linker gives none.
    pub size: u32,
}

/// Bytes the image takes, by what they are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Sizes {
    /// Instructions and the literals between them.
    pub text: u32,
    /// Constants and the vector table.
    pub rodata: u32,
    /// Initialised variables, which take flash and RAM.
    pub data: u32,
    /// Variables that start as zero or uninitialised, RAM only.
    pub bss: u32,
}

impl Sizes {
    /// Bytes of flash.
    #[must_use]
    pub fn flash(&self) -> u32 {
        self.text + self.rodata + self.data
    }

    /// Bytes of RAM before any stack.
    #[must_use]
    pub fn ram(&self) -> u32 {
        self.data + self.bss
    }
}

/// The symbols and section sizes of an ELF image.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Symbols {
    by_name: BTreeMap<String, Symbol>,
    /// Bytes the image takes.
    pub sizes: Sizes,
    /// Executable sections: address and bytes.
    code: Vec<(u32, Vec<u8>)>,
    /// Where instructions begin or end, from the mapping symbols `$t` and `$d`: true where they begin.
    mapping: BTreeMap<u32, bool>,
}

/// Reads the symbols and section sizes of an ELF image.
///
/// # Errors
///
/// [`Error::Image`] for bytes that are not a 32-bit ELF file.
pub fn symbols(elf: &[u8]) -> Result<Symbols, Error> {
    let file = object::read::elf::ElfFile32::<object::Endianness>::parse(elf)
        .map_err(|error| Error::Image(error.to_string()))?;
    let mut symbols = Symbols::default();
    for section in file.sections() {
        let SectionFlags::Elf { sh_flags, .. } = section.flags() else { continue };
        let has = |flag: u32| sh_flags & u64::from(flag) != 0;
        if !has(SHF_ALLOC) {
            continue;
        }
        let size = narrow(section.size());
        let stored = section.elf_section_header().sh_type.get(file.endian()) != SHT_NOBITS
            && section.kind() != SectionKind::UninitializedData;
        let total = match (stored, has(SHF_WRITE), has(SHF_EXECINSTR)) {
            (false, ..) => &mut symbols.sizes.bss,
            (true, true, _) => &mut symbols.sizes.data,
            (true, false, true) => &mut symbols.sizes.text,
            (true, false, false) => &mut symbols.sizes.rodata,
        };
        *total += size;
        if stored && has(SHF_EXECINSTR) {
            let bytes = section.data().map_err(|error| Error::Image(error.to_string()))?;
            symbols.code.push((narrow(section.address()), bytes.to_vec()));
        }
    }
    for symbol in file.symbols() {
        let Ok(name) = symbol.name() else { continue };
        let address = narrow(symbol.address());
        if let Some(kind) = name.strip_prefix('$') {
            symbols.mapping.insert(address, kind.starts_with('t'));
        } else if !name.is_empty() && !symbol.is_undefined() {
            let address = if symbol.kind() == object::SymbolKind::Text { address & !1 } else { address };
            symbols.by_name.insert(name.to_owned(), Symbol { address, size: narrow(symbol.size()) });
        }
    }
    Ok(symbols)
}

/// A field of a 32-bit file, which `object` widens.
fn narrow(value: u64) -> u32 {
    u32::try_from(value).unwrap_or(u32::MAX)
}

impl Symbols {
    /// The symbol of this name, as it stands in the file (mangled unless `no_mangle`).
    ///
    /// # Errors
    ///
    /// [`Error::NoSymbol`].
    pub fn find(&self, name: &str) -> Result<Symbol, Error> {
        self.by_name.get(name).copied().ok_or_else(|| Error::NoSymbol(name.to_owned()))
    }

    /// Every symbol with its name, by name.
    pub fn iter(&self) -> impl Iterator<Item = (&str, Symbol)> {
        self.by_name.iter().map(|(name, symbol)| (name.as_str(), *symbol))
    }

    /// Return addresses of calls of the function at `target`: after each `bl` to it.
    pub(crate) fn returns_of(&self, target: u32) -> Vec<u32> {
        let mut returns = Vec::new();
        for (base, bytes) in &self.code {
            let halves: Vec<u16> = bytes.as_chunks().0.iter().map(|half| u16::from_le_bytes(*half)).collect();
            let mut at = 0;
            while at < halves.len() {
                let address = base + 2 * at as u32;
                let is_code = self.mapping.range(..=address).next_back().is_none_or(|(_, code)| *code);
                let wide = is_code && halves[at] >> 11 >= 0b11101;
                if wide
                    && let Some(&second) = halves.get(at + 1)
                    && branch_with_link(address, halves[at], second) == Some(target)
                {
                    returns.push(address + 4);
                }
                at += if wide { 2 } else { 1 };
            }
        }
        returns
    }
}

/// The target of the `bl` these halfwords at `address` are, DDI 0403E.b A7.7.18 encoding T1.
fn branch_with_link(address: u32, first: u16, second: u16) -> Option<u32> {
    if first >> 11 != 0b11110 || second & 0xD000 != 0xD000 {
        return None;
    }
    let sign = u32::from(first >> 10 & 1);
    let inverted = |bit: u16| !(u32::from(second >> bit & 1) ^ sign) & 1;
    let offset = sign << 24
        | inverted(13) << 23
        | inverted(11) << 22
        | u32::from(first & 0x3FF) << 12
        | u32::from(second & 0x7FF) << 1;
    let extended = ((offset << 7) as i32) >> 7;
    Some(address.wrapping_add(4).wrapping_add_signed(extended))
}

#[cfg(test)]
mod tests {
    use super::branch_with_link;

    #[test]
    fn a_call_is_read_in_both_directions() {
        // The offset counts from the address after the instruction: +0x100, then -8.
        assert_eq!(branch_with_link(0x0800_0000, 0xF000, 0xF880), Some(0x0800_0104));
        assert_eq!(branch_with_link(0x0800_1000, 0xF7FF, 0xFFFC), Some(0x0800_0FFC));
        // The same bits without the link are no call.
        assert_eq!(branch_with_link(0x0800_0000, 0xF000, 0xB880), None);
    }
}
