//! The core's results, reduced to a page of text that must be the same on every machine.
//!
//! The page holds, for the golden vectors of both Hersey conventions and both builds of the law, the worst
//! relative error of the preload and a hash over the bits of every result; then a hash over the estimates
//! of the whole pipeline on pseudo-random blocks. The same text on x86-64, in the emulators and on a chip
//! means the same bits.
#![no_std]
#![forbid(unsafe_code)]

pub mod rivals;

use core::fmt::{Result, Write};
use model_core::fixed::{self, Newtons, ViscousSpeed};
use model_core::monitor::State;
use model_core::params::Params;
use model_core::reduced::{DragLaw, Reduced};
use model_core::reference::zhou_2023::{FRICTION, GUIDE, GUIDE_CARRIAGE_SPEED};
use model_core::sample::{Estimate, Measured, RawBlock};

/// Golden vectors of the slip convention inside the paper's domain.
pub const SLIP: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/slip.bin"));
/// Golden vectors of the carriage-speed convention inside the paper's domain.
pub const CARRIAGE: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/carriage.bin"));

/// The constants the vectors were made with, f64.
pub const SLIP_LAW: Reduced<f64> = Reduced::of(&GUIDE, &FRICTION, 600.0);
/// The same for the carriage-speed convention.
pub const CARRIAGE_LAW: Reduced<f64> = Reduced::of(&GUIDE_CARRIAGE_SPEED, &FRICTION, 600.0);

/// One golden working point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Drag force, N.
    pub drag_force_n: f32,
    /// Viscosity times speed, in the convention's unit.
    pub viscous_speed: f32,
    /// Preload the reference computes, N.
    pub preload_n: f64,
}

/// The points of a packed table, see `build.rs`.
pub fn points(table: &[u8]) -> impl Iterator<Item = Point> + '_ {
    let (rows, _) = table.as_chunks::<16>();
    rows.iter().map(|&[a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p]| Point {
        drag_force_n: f32::from_le_bytes([a, b, c, d]),
        viscous_speed: f32::from_le_bytes([e, f, g, h]),
        preload_n: f64::from_le_bytes([i, j, k, l, m, n, o, p]),
    })
}

/// FNV-1a, 32 bits, over words.
#[derive(Clone, Copy, Debug)]
pub struct Hash(pub u32);

impl Hash {
    /// The empty hash.
    pub const fn new() -> Self {
        Hash(0x811c_9dc5)
    }

    /// Adds the four bytes of a word.
    pub fn word(&mut self, word: u32) {
        for byte in word.to_le_bytes() {
            self.0 = (self.0 ^ u32::from(byte)).wrapping_mul(0x0100_0193);
        }
    }

    fn measured(&mut self, m: Option<Measured>) {
        match m {
            Some(m) => {
                self.word(m.value.to_bits());
                self.word(m.sigma.to_bits());
            }
            None => self.word(0xdead_0000),
        }
    }

    fn estimate(&mut self, e: &Estimate) {
        self.word(e.tick);
        self.measured(e.preload_n);
        self.measured(e.drag_force_n);
        self.measured(e.speed_m_s);
        self.word(e.temperature_degc.map_or(0xdead_0001, f32::to_bits));
        self.word(u32::from(e.reasons.bits()) << 8 | e.motion as u32);
    }
}

impl Default for Hash {
    fn default() -> Self {
        Self::new()
    }
}

/// Worst relative error of the preload over a table, and the hash of all results, in f32.
pub fn float(table: &[u8], law: &Reduced<f32>) -> (f64, Hash) {
    let (mut worst, mut hash) = (0.0f64, Hash::new());
    for p in points(table) {
        match law.invert(p.drag_force_n, p.viscous_speed) {
            Ok(i) => {
                worst = worst.max(relative(f64::from(i.preload_n), p.preload_n));
                for x in
                    [i.preload_n, i.load_per_ball_n, i.film, i.friction_coefficient, i.per_force, i.per_viscous_speed]
                {
                    hash.word(x.to_bits());
                }
            }
            Err(_) => worst = f64::INFINITY,
        }
    }
    (worst, hash)
}

/// The same in fixed point.
pub fn integer(table: &[u8], law: &fixed::Reduced) -> (f64, Hash) {
    let (mut worst, mut hash) = (0.0f64, Hash::new());
    for p in points(table) {
        match law.preload(Newtons::from_f32(p.drag_force_n), ViscousSpeed::from_f32(p.viscous_speed)) {
            Ok(preload) => {
                worst = worst.max(relative(preload.to_f64(), p.preload_n));
                hash.word(preload.to_bits() as u32);
                hash.word((preload.to_bits() >> 32) as u32);
            }
            Err(_) => worst = f64::INFINITY,
        }
    }
    (worst, hash)
}

/// `|got/want - 1|`
pub fn relative(got: f64, want: f64) -> f64 {
    let r = got / want - 1.0;
    if r < 0.0 { -r } else { r }
}

/// Hash of every estimate of the pipeline over `blocks` pseudo-random but plausible blocks: drifting
/// force and temperature, motion with stops, reversals, gaps, rails and dead sensors.
pub fn pipeline(blocks: u32) -> Option<(u32, Hash)> {
    let params = Params { calibrated: true, publish_every_blocks: 1, ..Params::ZHOU_2023 };
    let monitor = params.build().ok()?;
    let mut state = State::new();
    let mut hash = Hash::new();
    let mut seed = 1u64;
    let mut random = |below: u32| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((seed >> 33) as u32) % below
    };
    let (mut tick, mut position, mut rate, mut level, mut trusted) = (0u32, 0u32, 0i32, 2300u32, 0u32);
    for n in 0..blocks {
        if n % 150 == 0 {
            rate = random(25) as i32 - 12;
            level = if rate < 0 { 1600 + random(250) } else { 2240 + random(250) };
        }
        let trouble = n / 600 % 6;
        let mut block = RawBlock { tick, force: [0; 16], temperature: [0; 16], position: [0; 16] };
        for ((force, temperature), at) in block.force.iter_mut().zip(&mut block.temperature).zip(&mut block.position) {
            *force = if trouble == 3 && n % 150 == 75 { 4095 } else { (level + random(9)) as u16 };
            *temperature = if trouble == 4 { 4095 } else { (1800 + n / 100 % 200) as u16 };
            position = position.wrapping_add_signed(rate);
            *at = position as u16;
        }
        tick = tick.wrapping_add(if trouble == 5 && n % 77 == 0 { 4 } else { 1 });
        if let Some(e) = monitor.step(&mut state, &block) {
            trusted += u32::from(e.preload_n.is_some());
            hash.estimate(&e);
        }
    }
    if let Some(r) = state.ripple() {
        hash.word(r.amplitude_n.to_bits());
        hash.word(r.phase_rad.to_bits());
    }
    Some((trusted, hash))
}

/// Writes the page.
///
/// # Errors
/// Only what `out` itself returns.
pub fn report(out: &mut impl Write) -> Result {
    for (name, table, law) in [("slip", SLIP, &SLIP_LAW), ("carriage", CARRIAGE, &CARRIAGE_LAW)] {
        let (worst, hash) = float(table, &law.to_f32());
        writeln!(out, "{name} f32: {} vectors, worst {worst:.3e}, bits {:08x}", points(table).count(), hash.0)?;
        match fixed::Reduced::of(law) {
            Ok(law) => {
                let (worst, hash) = integer(table, &law);
                writeln!(
                    out,
                    "{name} fixed: {} vectors, worst {worst:.3e}, bits {:08x}",
                    points(table).count(),
                    hash.0
                )?;
            }
            Err(e) => writeln!(out, "{name} fixed: {e}")?,
        }
    }
    match pipeline(20_000) {
        Some((trusted, hash)) => writeln!(out, "pipeline: 20000 blocks, {trusted} trusted, bits {:08x}", hash.0),
        None => writeln!(out, "pipeline: parameters refused"),
    }
}
