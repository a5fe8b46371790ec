//! The release images that `verify` builds, and parameter records for their flash.

use can_wire::parameters::{self, ParameterRecord};
use model_core::params::Params;
use virtual_board::{Chip, Symbols};

/// Both boards.
pub const CHIPS: [Chip; 2] = [Chip::Stm32f405, Chip::Stm32g474];

/// The unmodified release image of a board.
///
/// # Panics
/// When it has not been built.
pub fn firmware(chip: Chip) -> Vec<u8> {
    read(match chip {
        Chip::Stm32f405 => "f405",
        Chip::Stm32g474 => "g474",
    })
}

/// An image of `target/images`.
///
/// # Panics
/// When it has not been built.
pub fn read(name: &str) -> Vec<u8> {
    let path = crate::root().join("target/images").join(name).with_extension("elf");
    std::fs::read(&path).unwrap_or_else(|e| {
        panic!(
            "{}: {e}; ./verify builds the images, and so does `. ./install.sh; build_images f405 g474`",
            path.display()
        )
    })
}

/// The paper's guide on the project's bench, marked calibrated, publishing at 10 Hz.
pub const BENCH: Params = Params { calibrated: true, ..Params::ZHOU_2023 };

/// A parameter record for the block's flash, node 1.
///
/// # Panics
/// When the record does not encode, which the wire crate's own tests rule out.
pub fn record(params: Params) -> Vec<u8> {
    let mut buffer = [0; parameters::MAX_SIZE];
    parameters::encode(&ParameterRecord { node: 1, params }, &mut buffer).expect("a legal record").to_vec()
}

/// The one symbol whose (mangled) name holds all fragments; the compiler's own tables start with a dot.
///
/// # Panics
/// When there is none or more than one: the function was renamed, inlined or duplicated.
pub fn symbol(symbols: &Symbols, fragments: &[&str]) -> String {
    let hits: Vec<&str> = symbols
        .iter()
        .map(|(name, _)| name)
        .filter(|n| !n.starts_with('.') && fragments.iter().all(|f| n.contains(f)))
        .collect();
    assert_eq!(hits.len(), 1, "{fragments:?}: {hits:?}");
    hits[0].to_owned()
}

/// Placement of an image in memory.
#[derive(Debug)]
pub struct Placed {
    /// Load address and bytes of every segment that is stored in flash.
    pub segments: Vec<(u32, Vec<u8>)>,
    /// Entry point.
    pub entry: u32,
    /// Whether floats are passed in registers.
    pub hard_float: bool,
    table: Vec<u8>,
}

impl Placed {
    /// Reads an ELF image.
    ///
    /// # Panics
    /// When it is not a 32-bit little-endian Arm image with a vector table section.
    pub fn of(elf: &[u8]) -> Self {
        use object::elf::{EF_ARM_ABI_FLOAT_HARD, EM_ARM, PT_LOAD};
        use object::read::elf::{ElfFile32, FileHeader, ProgramHeader};
        use object::{LittleEndian, Object, ObjectSection};
        let file = ElfFile32::<LittleEndian>::parse(elf).expect("a 32-bit ELF file");
        let header = file.elf_header();
        assert_eq!(header.e_machine.get(LittleEndian), EM_ARM);
        let stored = |p: &&object::elf::ProgramHeader32<LittleEndian>| {
            p.p_type(LittleEndian) == PT_LOAD && p.p_filesz(LittleEndian) > 0
        };
        let segments = file.elf_program_headers().iter().filter(stored);
        let segments = segments
            .map(|p| (p.p_paddr(LittleEndian), p.data(LittleEndian, elf).expect("inside the file").to_vec()))
            .collect();
        let table = file.section_by_name(".vector_table").expect("a vector table").data().expect("stored").to_vec();
        Placed {
            segments,
            entry: header.e_entry.get(LittleEndian),
            hard_float: header.e_flags(LittleEndian) & EF_ARM_ABI_FLOAT_HARD != 0,
            table,
        }
    }

    /// Number of words in the vector table.
    pub fn vectors(&self) -> usize {
        self.table.len() / 4
    }

    /// A word of the vector table.
    ///
    /// # Panics
    /// Beyond its end.
    pub fn vector(&self, n: usize) -> u32 {
        let b = &self.table[4 * n..4 * n + 4];
        u32::from_le_bytes([b[0], b[1], b[2], b[3]])
    }
}
