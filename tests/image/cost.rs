//! What the image costs: instructions counted in the emulator, flash, RAM and stack. The README's table is this
//! test's output: `cargo test --profile desk -p system-tests --test cost -- --nocapture`.

use can_wire::parameters::ADDRESS;
use model_core::monitor::Params;
use system_tests::axis::{Feed, readings};
use system_tests::image::{BENCH, CHIPS, Placed, firmware, read, record, symbol};
use virtual_board::{Chip, VirtualBoard, run_bare, symbols};

/// Instructions of one f32 inversion with its sensitivities.
const INVERSION: u64 = 300;
/// Instructions from 16 raw samples to the finished frames.
const BLOCK: u64 = 2500;
const FLASH: u32 = 64 * 1024;
const RAM: u32 = 12 * 1024;
const STACK: u32 = 2 * 1024;

fn path(t: f64) -> f64 {
    if t < 2.0 { 0.05 * t } else { 0.1 - 0.08 * (t - 2.0) }
}

#[test]
fn images_keep_their_limits() {
    // an estimate with every block, so that every block is a worst case
    let params = Params { publish_every_blocks: 1, ..BENCH };
    println!("| | limit | STM32F405RG | STM32G474RE |");
    let mut rows: Vec<[u64; 5]> = Vec::new();
    for chip in CHIPS {
        let elf = firmware(chip);
        let table = symbols(&elf).expect("an ELF image");
        let inversion = symbol(&table, &["monitor", "Monitor", "invert"]);
        let block = symbol(&table, &["firmware", "process_block"]);
        let feed = Feed::new(readings(&params, 4.0, 3000.0, 30.0, path));
        let (outcome, _) = VirtualBoard::new(chip, &elf)
            .with_flash(ADDRESS, &record(params))
            .counting(&inversion)
            .counting(&block)
            .run(feed)
            .expect("the image runs");
        let (inversion, block) = (outcome.costs[&inversion], outcome.costs[&block]);
        assert!(inversion.calls > 100 && block.calls > 200, "{inversion:?} {block:?}");
        let (flash, ram) = (table.sizes.flash(), table.sizes.ram());
        assert!(inversion.max <= INVERSION, "{chip:?}: {inversion:?}");
        assert!(block.max <= BLOCK, "{chip:?}: {block:?}");
        assert!(flash <= FLASH, "{chip:?}: {flash} B of flash");
        assert!(ram <= RAM, "{chip:?}: {ram} B of RAM");
        assert!(
            outcome.stack_bytes > 0 && outcome.stack_bytes <= STACK,
            "{chip:?}: {} B of stack",
            outcome.stack_bytes
        );
        rows.push([inversion.max, block.max, flash.into(), ram.into(), outcome.stack_bytes.into()]);
    }
    let names = [
        ("instructions, one f32 inversion (worst)", INVERSION),
        ("instructions, 16 raw samples to finished frames (worst)", BLOCK),
        ("flash, bytes", FLASH.into()),
        ("static RAM, bytes", RAM.into()),
        ("stack high-water, bytes", STACK.into()),
    ];
    for (n, (name, limit)) in names.iter().enumerate() {
        println!("| {name} | {limit} | {} | {} |", rows[0][n], rows[1][n]);
    }
}

/// The same inversion (no sensitivities) in other people's arithmetic, on the on-target program.
#[test]
fn own_arithmetic_is_the_cheapest_that_is_exact_enough() {
    let elf = read("on-target");
    let table = symbols(&elf).expect("an ELF image");
    let variants = ["preload_own", "preload_libm", "preload_micromath", "invert_float", "invert_fixed"];
    let names: Vec<String> = variants.iter().map(|v| symbol(&table, &["rivals", v])).collect();
    let bare = run_bare(&elf, 60_000_000_000, &names).expect("the emulator takes the image");
    println!("| inversion | instructions, typical | worst |");
    let worst: Vec<u64> = variants
        .iter()
        .zip(&names)
        .map(|(variant, name)| {
            let cost = bare.costs[name];
            assert!(cost.calls >= 200, "{variant}: {cost:?}");
            println!("| {variant} | {} | {} |", cost.min, cost.max);
            cost.max
        })
        .collect();
    assert!(worst[0] < worst[1] && worst[3] <= INVERSION, "{worst:?}");
}

/// The image lies where the chip's flash and RAM are; ranges as `probe-rs chip info` prints them.
#[test]
fn images_fit_the_chips_memory_map_and_vector_table() {
    for (chip, flash, ram) in [
        (Chip::Stm32f405, 0x0800_0000..0x0810_0000u32, 0x2000_0000..0x2002_0000u32),
        (Chip::Stm32g474, 0x0800_0000..0x0808_0000, 0x2000_0000..0x2002_0000),
    ] {
        let image = Placed::of(&firmware(chip));
        for (address, bytes) in &image.segments {
            let end = address + bytes.len() as u32;
            assert!(flash.contains(address) && end <= ADDRESS, "{chip:?}: {address:#x} to {end:#x}");
        }
        let word = |n: usize| image.vector(n);
        assert!(ram.contains(&(word(0) - 8)) && word(0) % 8 == 0, "{chip:?}: stack pointer {:#x}", word(0));
        assert!(word(1) & 1 == 1 && flash.contains(&word(1)), "{chip:?}: reset vector {:#x}", word(1));
        assert_eq!(word(1) & !1, image.entry & !1, "{chip:?}: the entry point is the reset vector");
        for n in 2..image.vectors() {
            let v = word(n);
            assert!(v == 0 || v & 1 == 1 && flash.contains(&v), "{chip:?}: vector {n} is {v:#x}");
        }
        assert!(image.hard_float, "{chip:?}: hard-float ABI");
    }
}
