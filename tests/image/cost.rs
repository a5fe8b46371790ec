//! Cost of the image: instructions counted in the emulator, flash, RAM and stack. The README's table is this
//! test's output (`cargo test --profile desk -p system-tests --test cost -- --nocapture`), and the test checks that.

use can_wire::parameters::ADDRESS;
use model_core::fixed;
use model_core::params::Params;
use model_core::reduced::Reduced;
use on_target::{Point, SLIP, points, relative, rivals};
use system_tests::axis::{Feed, readings};
use system_tests::image::{BENCH, CHIPS, Placed, firmware, read, record, symbol};
use system_tests::root;
use virtual_board::{Chip, VirtualBoard, run_bare, symbols};

/// Limit of instructions of one f32 inversion with its sensitivities.
const INVERSION: u64 = 300;
/// Limit of instructions from 16 raw samples to the finished frames.
const BLOCK: u64 = 2500;
/// The same with all left-out mechanisms acting.
const BLOCK_AUGMENTED: u64 = 2 * BLOCK;
/// Limit of instructions of the check of the model, per estimate, beside those of the block.
const WATCH: u64 = BLOCK / 2;
const FLASH: u32 = 96 * 1024;
const RAM: u32 = 14 * 1024;
const STACK: u32 = 2 * 1024;

fn path(t: f64) -> f64 {
    if t < 2.0 { 0.05 * t } else { 0.1 - 0.08 * (t - 2.0) }
}

#[test]
fn images_keep_their_limits() {
    // an estimate with every block, so that every block is a worst case
    let params = Params { publish_every_blocks: 1, ..BENCH };
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
        // flash holds source paths, whose length depends on the machine: rounded up to the next 8 KiB
        let flash_kib = u64::from(flash).div_ceil(8 * 1024) * 8;
        rows.push([inversion.max, block.max, flash_kib, ram.into(), outcome.stack_bytes.into()]);
    }
    let names = [
        ("instructions, one f32 inversion, worst", INVERSION),
        ("instructions, 16 raw samples to finished frames, worst", BLOCK),
        ("flash, KiB, up to the next 8", u64::from(FLASH) / 1024),
        ("static RAM, bytes", RAM.into()),
        ("stack high-water, bytes", STACK.into()),
    ];
    let lines = names.iter().enumerate();
    in_readme(lines.map(|(n, (name, limit))| format!("| {name} | {limit} | {} | {} |", rows[0][n], rows[1][n])));
}

/// A block with all left-out mechanisms, each with a small part of the drag.
fn augmented() -> Params {
    use model_core::left_out::rail::RailTable;
    use model_core::left_out::wave::{Acts, Wave};
    use model_core::left_out::{LeftOut, friction, load, oil, pull, sensor};
    let wave = Wave { acts: Acts::Preload, wavelength_m: 0.0143, sine: [0.004; 3], cosine: [0.003; 3] };
    let mut rail = RailTable { from_m: -0.2, step_m: 0.01, knots: 64, scale: 1e-6, ..RailTable::NONE };
    for (n, value) in rail.values.as_flattened_mut().iter_mut().enumerate() {
        *value = (n as i16 % 7) * 1000;
    }
    let left_out = LeftOut {
        seal: friction::SealDrag { coulomb_n: [0.5, 0.6], per_decade_n: 0.1, smooth_m_s: 1e-4 },
        viscous: friction::ViscousDrag { at_100_mm_s_n: [0.2, 0.3], at_100_cst_n: 0.1, exponent: 0.7 },
        oil: oil::Oil { part: 0.9, law_cst: 150.0 },
        asymmetry: friction::Asymmetry { part: 0.01, viscous_n_s_m: 0.5 },
        load: load::ExternalLoad { load_n: [300.0, 200.0], part: 1.0, preload_per_load: 0.02 },
        pull: pull::Pull { force_n: 0.1, per_m_n_m: 0.2, inertia_kg: 10.0 },
        sensor: sensor::Sensor { offset_n: 0.1, gain_error: 0.01, lag_s: 0.01 },
        start_m: 0.1,
        waves: [
            wave,
            Wave { acts: Acts::Interference, wavelength_m: 0.6, ..wave },
            Wave { acts: Acts::Force, wavelength_m: 0.005, ..wave },
        ],
        rail,
    };
    Params { publish_every_blocks: 1, left_out, ..BENCH }
}

#[test]
fn a_block_with_everything_costs_at_most_twice_as_much() {
    for chip in CHIPS {
        let params = augmented();
        let elf = firmware(chip);
        let table = symbols(&elf).expect("an ELF image");
        let block = symbol(&table, &["firmware", "process_block"]);
        // the closure within it carries its name, too
        let solve = table.iter().map(|(name, _)| name).find(|n| n.ends_with("solve_left_out"));
        let solve = solve.expect("a function of its own").to_owned();
        let watch = symbol(&table, &["estimate", "watch_fit"]);
        let feed = Feed::new(readings(&params, 4.0, 3000.0, 30.0, path));
        let (outcome, _) = VirtualBoard::new(chip, &elf)
            .with_flash(ADDRESS, &record(params))
            .counting(&block)
            .counting(&solve)
            .counting(&watch)
            .run(feed)
            .expect("the image runs");
        let [block, solve, watch] = [block, solve, watch].map(|name| outcome.costs[&name]);
        println!(
            "{chip:?}: block at most {} instructions, of them beside the law {}; watch {}; stack {} B",
            block.max, solve.max, watch.max, outcome.stack_bytes
        );
        assert!(watch.calls > 100 && watch.max <= WATCH, "{chip:?}: {watch:?}");
        assert!(solve.calls > 100, "{solve:?}");
        assert!(block.max <= BLOCK_AUGMENTED, "{chip:?}: {block:?}");
        assert!(outcome.stack_bytes <= 2 * STACK, "{chip:?}: {} B of stack", outcome.stack_bytes);
    }
}

/// Prints lines of a table and asserts that the README has them.
fn in_readme(lines: impl Iterator<Item = String>) {
    let readme = std::fs::read_to_string(root().join("README.md")).expect("the README");
    let mut missing = Vec::new();
    for line in lines {
        println!("{line}");
        if !readme.lines().any(|l| l == line) {
            missing.push(line);
        }
    }
    assert!(missing.is_empty(), "the README's table must read:\n{}", missing.join("\n"));
}

/// The same inversion (without sensitivities) with elementary functions of other crates, in the on-target program.
#[test]
fn own_arithmetic_is_the_cheapest_that_is_exact_enough() {
    let elf = read("on-target");
    let table = symbols(&elf).expect("an ELF image");
    let variants = ["preload_own", "preload_libm", "preload_micromath", "invert_float", "invert_fixed"];
    let names: Vec<String> = variants.iter().map(|v| symbol(&table, &["rivals", v])).collect();
    let bare = run_bare(&elf, 60_000_000_000, &names).expect("the emulator takes the image");
    let costs: Vec<_> = variants.iter().zip(&names).map(|(variant, name)| (variant, bare.costs[name])).collect();
    for (variant, cost) in &costs {
        assert!(cost.calls >= 200, "{variant}: {cost:?}");
    }
    // worst errors of the preload over the golden vectors, slip convention
    let law = on_target::SLIP_LAW.to_f32();
    let worst = |f: fn(&Reduced<f32>, f32, f32) -> Option<f32>| {
        let error = |p: Point| f(&law, p.drag_force_n, p.viscous_speed).map(|got| relative(got.into(), p.preload_n));
        points(SLIP).map(|p| error(p).expect("inside the law")).fold(0.0, f64::max)
    };
    let fixed = on_target::integer(SLIP, &fixed::Reduced::of(&on_target::SLIP_LAW).expect("constants that fit")).0;
    let errors = [
        worst(rivals::preload_own),
        worst(rivals::preload_libm),
        worst(rivals::preload_micromath),
        on_target::float(SLIP, &law).0,
        fixed,
    ];
    let titles = [
        "own `exp` and `cbrt`, preload only",
        "`libm`, preload only",
        "`micromath`, preload only",
        "**the core's f32 inversion**, with sensitivities",
        "the core's fixed-point inversion, preload only",
    ];
    let lines = titles.iter().zip(&costs).zip(errors);
    in_readme(lines.map(|((title, (_, cost)), error)| format!("| {title} | {} | {error:.1e} |", cost.max)));
    assert!(costs[0].1.max < costs[1].1.max && costs[3].1.max <= INVERSION);
}

/// The image lies where the chip's flash and RAM are; ranges as `probe-rs chip info` prints them.
#[test]
fn images_fit_the_chips_memory_map_and_vector_table() {
    for (chip, flash, ram) in [
        (Chip::Stm32f405, 0x0800_0000..0x0810_0000u32, 0x2000_0000..0x2002_0000u32),
        (Chip::Stm32g474, 0x0800_0000..0x0808_0000, 0x2000_0000..0x2002_0000),
    ] {
        let elf = firmware(chip);
        let (image, table) = (Placed::of(&elf), symbols(&elf).expect("an ELF image"));
        for (address, bytes) in &image.segments {
            let end = address + bytes.len() as u32;
            assert!(flash.contains(address) && end <= ADDRESS, "{chip:?}: {address:#x} to {end:#x}");
        }
        let word = |n: usize| image.vector(n);
        assert!(ram.contains(&(word(0) - 8)) && word(0) % 8 == 0, "{chip:?}: stack pointer {:#x}", word(0));
        // the stack lies below all variables and ends where the RAM begins
        let address = |name: &str| table.find(name).expect("of the linker").address;
        assert_eq!((address("_stack_end"), address("_stack_start")), (ram.start, word(0)), "{chip:?}");
        let first = ["__sdata", "__sbss", "__suninit"].map(address).into_iter().min();
        assert!(first >= Some(word(0)), "{chip:?}: variables from {first:#x?}");
        assert!(word(1) & 1 == 1 && flash.contains(&word(1)), "{chip:?}: reset vector {:#x}", word(1));
        assert_eq!(word(1) & !1, image.entry & !1, "{chip:?}: the entry point is the reset vector");
        for n in 2..image.vectors() {
            let v = word(n);
            assert!(v == 0 || v & 1 == 1 && flash.contains(&v), "{chip:?}: vector {n} is {v:#x}");
        }
        assert!(image.hard_float, "{chip:?}: hard-float ABI");
    }
}
