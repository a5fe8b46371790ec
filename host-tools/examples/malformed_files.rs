//! Hands `diagnose` recordings and simulation files that nobody should hand in, and looks for a panic or a report that
//! breaks its own rules.
//!
//! `malformed COUNT SEED [FOLDER]` makes COUNT pairs from SEED: motions that stand still or run one way, forces that are
//! constant, huge or tiny, few rows, cells that are no numbers, lines cut or shuffled; laws, tolerances and mechanisms with
//! numbers from the ends of the scale. Every pair goes the whole way of the command: reading, diagnosis, JSON, page,
//! exported simulation and its force. What fails is written to FOLDER as `N.csv` and `N.toml`; exit status 1 then.

use std::any::Any;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::panic::catch_unwind;
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use diagnosis::report::{Diagnosis, Estimate, Verdict};
use diagnosis::{Options, diagnose};
use host_tools::diagnosed;
use host_tools::recording::{axis, silent};
use simulation::Simulation;
use simulation::mechanism::{Id, definition};
use simulation::motion::Motion;

/// xorshift64*.
struct Random(u64);

impl Random {
    fn new(seed: u64) -> Self {
        // neighbouring seeds begin far apart, and 0 is no state
        Random(seed.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1)
    }

    fn bits(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_F491_4F6C_DD1D)
    }

    fn below(&mut self, n: usize) -> usize {
        (((self.bits() >> 32) * n as u64) >> 32) as usize
    }

    fn one_of<T: Copy>(&mut self, all: &[T]) -> T {
        all[self.below(all.len())]
    }

    fn once_in(&mut self, n: usize) -> bool {
        self.below(n) == 0
    }

    /// 0 to 1.
    fn part(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// Cells that a table may hold in place of a sound number.
const CELLS: [&str; 16] = [
    "",
    "nan",
    "inf",
    "-inf",
    "1e308",
    "-1e308",
    "5e-324",
    "-0",
    "abc",
    "1,5",
    " ",
    "\"",
    "1e999",
    "0x10",
    "--1",
    "18446744073709551616",
];

/// Numbers that a simulation file may hold where one is expected.
const NUMBERS: [&str; 18] = [
    "0.0", "-0.0", "1.0", "-1.0", "1e-300", "1e-12", "1e-6", "1e-3", "0.05", "0.5", "10.0", "1e3", "1e5", "1e6",
    "1e300", "-1e6", "nan", "inf",
];

fn recording(random: &mut Random) -> Vec<u8> {
    // most recordings are odd in one or two ways only: others do not get past the reader
    let odds = random.one_of(&[2, 6, 12]);
    let rows = match random.once_in(odds) {
        true => random.one_of(&[0, 1, 2, 19, 20, 21, 199, 200, 201, 256]),
        false => 250 + random.below(250),
    };
    let mut pick = |sound: f64, odd: &[f64]| if random.once_in(odds) { random.one_of(odd) } else { sound };
    let step = pick(0.01, &[1e-6, 1e-3, 5e-3, 0.1, 1.0, 3600.0]);
    let size = pick(20.0, &[1e-300, 1e-6, 0.1, 1e4, 1e9, 1e300]);
    let reach = pick(0.05, &[0.0, 1e-9, 1e-4, 0.01, 10.0, 1e6]);
    let turn = pick(0.02, &[0.005, 0.1, 1.0]);
    let noise = pick(0.01, &[0.0, 1e-9, 0.3]);
    let preload = pick(3000.0, &[0.0, -100.0, 500.0, 1e6, 1e12]);
    let [motion, force] =
        [pick(6.0, &[0.0, 1.0, 2.0, 3.0, 4.0, 5.0]) as u8, pick(5.0, &[0.0, 1.0, 2.0, 3.0, 4.0]) as u8];
    // an effect that the law leaves out, so that the search has something to find
    let effect = random.below(6);
    let names = [
        "time_s",
        "position_m",
        "velocity_m_s",
        "drag_force_n",
        "preload_n",
        "external_load_n",
        "temperature_block_degc",
        "temperature_rail_degc",
        "temperature_ambient_degc",
        "acceleration_m_s2",
        "segment",
        "simulated_force_n",
    ];
    let mut shown: Vec<usize> = (0..names.len()).filter(|&n| matches!(n, 0 | 1 | 3) || random.once_in(3)).collect();
    if random.once_in(4) {
        shown.retain(|&n| n != 1);
        shown.push(2);
    }
    if random.once_in(40) {
        let dropped = random.below(shown.len());
        shown.remove(dropped);
    }
    let broken = if random.once_in(odds) { random.one_of(&[1000, 100, 10, 2]) } else { 0 };
    let broken_column = random.below(names.len());
    let mut text = shown.iter().map(|&n| names[n]).collect::<Vec<_>>().join(",") + "\n";
    let mut place = 0.0;
    for n in 0..rows {
        let t = n as f64;
        let speed = match motion {
            0 => 0.0,
            1 => reach,
            2 => reach * (turn * t).cos().signum(),
            3 => reach * (1.0 + 0.8 * (turn * t).sin()),
            4 => reach * (random.part() - 0.5),
            5 => {
                if n % 100 < 50 {
                    reach
                } else {
                    0.0
                }
            }
            _ => reach * (turn * t).cos(),
        };
        place += speed * step;
        let chance = random.part() - 0.5;
        let sign = if speed == 0.0 { 0.0 } else { speed.signum() };
        let known = match force {
            0 => 1.0,
            1 => 0.0,
            2 => chance,
            3 => t,
            4 => (t / 50.0).floor(),
            _ => sign * (1.0 + 0.3 * speed.abs()) + noise * chance,
        };
        let left_out = match effect {
            0 => 0.05,
            1 => 0.1 * (place / 0.003).sin(),
            2 => 0.1 * sign * (-speed.abs() / 0.01).exp(),
            3 => 0.1 * (turn * t).sin() * reach,
            4 => 0.1 * sign * (-t / 400.0).exp(),
            _ => 0.0,
        };
        let load = size * (known + left_out);
        let values = [
            t * step,
            place,
            speed,
            load,
            if random.once_in(50) { preload * 2.0 } else { preload },
            50.0 * chance,
            20.0 + 0.01 * t,
            21.0,
            20.0,
            speed * turn,
            (t / 100.0).floor(),
            load * 0.9,
        ];
        for (at, &column) in shown.iter().enumerate() {
            text += if at == 0 { "" } else { "," };
            if broken > 0 && (random.once_in(broken) || broken == 2 && column == broken_column) {
                text += random.one_of(&CELLS);
            } else {
                let _ = write!(text, "{}", values[column]);
            }
        }
        text.push('\n');
    }
    let mut bytes = text.into_bytes();
    if random.once_in(8) {
        spoil(random, &mut bytes);
    }
    bytes
}

/// Cuts, doubles or flips some of a text.
fn spoil(random: &mut Random, bytes: &mut Vec<u8>) {
    if bytes.is_empty() {
        return;
    }
    for _ in 0..=random.below(3) {
        let at = random.below(bytes.len().max(1));
        match random.below(5) {
            0 => bytes.truncate(at),
            1 => bytes.insert(at, random.one_of(b"\0\xff\r\n,;\"#.-e9")),
            2 if at < bytes.len() => bytes[at] = random.bits() as u8,
            3 => {
                let to = (at + random.below(200)).min(bytes.len());
                let piece = bytes[at..to].to_vec();
                bytes.splice(at..at, piece);
            }
            _ => {
                let to = (at + random.below(200)).min(bytes.len());
                bytes.drain(at..to);
            }
        }
    }
}

/// A sound number, or one of [`NUMBERS`] once in `odds`.
fn number(random: &mut Random, odds: usize, sound: &str) -> String {
    if random.once_in(odds) { random.one_of(&NUMBERS).to_owned() } else { sound.to_owned() }
}

fn simulation_file(random: &mut Random) -> Vec<u8> {
    let mut text = "schema = \"guideblock.simulation/1\"\n".to_owned();
    let is_guide = random.once_in(2);
    // most files are nearly sound: others do not get past the reader
    let odds = random.one_of(&[3, 30, 30, 1000]);
    match random.below(8) {
        0 => {}
        1..=3 if !is_guide => text += "[guide]\nlaw = \"coulomb-viscous\"\n",
        _ if is_guide => text += "[guide]\nparameters = \"zhou-2023\"\n",
        _ => {
            let [coulomb, viscous, offset] = ["20.0", "5.0", "0.0"].map(|sound| number(random, odds, sound));
            let _ = writeln!(
                text,
                "[guide]\nlaw = \"coulomb-viscous\"\ncoulomb_n = {coulomb}\nviscous_n_s_m = {viscous}\noffset_n = {offset}"
            );
        }
    }
    if is_guide {
        for (key, sound) in [
            ("ball_diameter_m", "0.00635"),
            ("balls_per_row", "13"),
            ("contact_angle_deg", "45.0"),
            ("conformity", "0.51"),
            ("young_modulus_pa", "2.08e11"),
            ("poisson_ratio", "0.3"),
            ("mu_coulomb", "0.00182"),
            ("mu_viscous", "8.74e6"),
            ("mu_stribeck", "0.0016"),
            ("stribeck_exponent", "7.43e10"),
        ] {
            if random.once_in(12) {
                let _ = writeln!(text, "{key} = {}", number(random, odds, sound));
            }
        }
        let [viscosity, preload] = ["100.0", "3000.0"].map(|sound| number(random, odds, sound));
        let _ = writeln!(text, "[lubricant]\nviscosity_cst = {viscosity}\n[operation]\npreload_n = {preload}");
    }
    if random.once_in(2) {
        let [mass, zero] = ["10.0", "3e-5"].map(|sound| number(random, odds, sound));
        let place = random.one_of(&["absolute", "relative"]);
        let _ =
            writeln!(text, "[axis]\nmoved_mass_kg = {mass}\nzero_speed_m_s = {zero}\nposition_reference = \"{place}\"");
    }
    if random.once_in(3) {
        text += "[tolerance]\n";
        for key in ["preload", "friction", "viscosity", "friction_terms", "mass", "relevance"] {
            if random.once_in(2) {
                let _ = writeln!(text, "{key} = {}", number(random, odds, "0.05"));
            }
        }
    }
    for _ in 0..random.one_of(&[0, 0, 0, 1, 1, 2, 5]) {
        let definition = definition(random.one_of(Id::ALL));
        let form = &definition.forms[random.below(definition.forms.len())];
        let id = definition.id.name();
        let _ = writeln!(text, "[[mechanism]]\nid = \"{id}\"\nform = \"{}\"", form.name);
        for shape in form.shape {
            let sound = format!("{:e}", shape.from + random.part() * (shape.to - shape.from));
            let _ = writeln!(text, "{} = {}", shape.name, number(random, odds, &sound));
        }
        for amplitude in form.amplitudes {
            let _ =
                writeln!(text, "{} = {}", amplitude.name, number(random, odds, &format!("{:e}", amplitude.typical)));
        }
    }
    let mut bytes = text.into_bytes();
    if random.once_in(10) {
        spoil(random, &mut bytes);
    }
    bytes
}

/// What a report must keep, whatever it is about.
fn broken_rule(found: &Diagnosis) -> Option<String> {
    let share = |x: f64| (-1e-9..=1.0 + 1e-9).contains(&x);
    if !share(found.p_no_mismatch) {
        return Some(format!("p_no_mismatch is {}", found.p_no_mismatch));
    }
    if matches!(found.verdict, Verdict::Match | Verdict::InsufficientData) && !found.mechanisms.is_empty() {
        return Some("a match with a cause".to_owned());
    }
    if matches!(found.verdict, Verdict::Explained | Verdict::Ambiguous) && found.mechanisms.is_empty() {
        return Some("explained by nothing".to_owned());
    }
    if found.verdict == Verdict::InsufficientData && found.data_quality.warnings.is_empty() {
        return Some("insufficient data without a reason".to_owned());
    }
    for cause in &found.mechanisms {
        if !share(cause.share_of_mismatch) || !share(cause.confidence) {
            return Some(format!("{}: share {}, confidence {}", cause.id, cause.share_of_mismatch, cause.confidence));
        }
        let is_number = |p: &&Estimate| p.value.is_finite() && p.ci95.iter().all(|end| end.is_finite());
        if let Some(bad) = cause.parameters.iter().find(|p| !is_number(p)) {
            return Some(format!("{}: {} is {} {:?}", cause.id, bad.name, bad.value, bad.ci95));
        }
        // of two parameters either may be off
        if cause.id != "parameter-shift" && cause.equivalents.contains(&cause.id) {
            return Some(format!("{} is its own equivalent", cause.id));
        }
    }
    let errors =
        [found.noise_floor_n, found.holdout.rmse_before_n, found.holdout.rmse_calibrated_n, found.holdout.rmse_after_n];
    errors.iter().any(|e| !e.is_finite() || *e < 0.0).then(|| format!("errors {errors:?}"))
}

/// The whole way of the command; what came of it in a word, or what is wrong.
fn one(recording: &[u8], simulation: &[u8], is_thorough: bool) -> Result<&'static str, String> {
    let Ok(text) = std::str::from_utf8(simulation) else { return Ok("no text") };
    let Ok(simulation) = Simulation::from_toml(text) else { return Ok("no simulation") };
    let Ok((run, _)) = axis::from_bytes("a.csv", recording.to_vec(), &[], &[], &silent) else {
        return Ok("no recording");
    };
    let runs = [run];
    let holdout = if is_thorough { &runs[..] } else { &[] };
    let outcome = diagnose(&runs, holdout, &simulation, &Options { seed: 0 });
    let found = &outcome.diagnosis;
    if let Some(rule) = broken_rule(found) {
        return Err(rule);
    }
    let json = serde_json::to_string(found).map_err(|why| why.to_string())?;
    if let Some(augmented) = &outcome.augmented {
        let again = Simulation::from_toml(&augmented.to_toml()).map_err(|why| format!("exported: {why}"))?;
        for run in &runs {
            let _ = again.force(run, &Motion::of(run));
        }
        if let Ok(views) = diagnosed::views(&runs, &simulation, augmented) {
            let _ = diagnosed::page("a.csv", found, &views);
        }
    }
    if is_thorough {
        let again = diagnose(&runs, holdout, &simulation, &Options { seed: 0 });
        if serde_json::to_string(&again.diagnosis).ok().as_deref() != Some(&json) {
            return Err("another report the second time".to_owned());
        }
    }
    Ok(found.verdict.name())
}

fn words(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<String>().cloned();
    text.or_else(|| panic.downcast_ref::<&str>().map(|s| (*s).to_owned())).unwrap_or_default()
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let parsed =
        (arguments.first().and_then(|n| n.parse::<u64>().ok()), arguments.get(1).and_then(|n| n.parse::<u64>().ok()));
    let (Some(count), Some(seed)) = parsed else {
        eprintln!("malformed COUNT SEED [FOLDER]");
        return ExitCode::from(2);
    };
    let folder = Path::new(arguments.get(2).map_or(".", String::as_str));
    let (mut outcomes, mut failures) = (BTreeMap::<String, u64>::new(), 0);
    let mut slowest = (0.0, 0);
    for n in 0..count {
        let mut random = Random::new(seed.wrapping_mul(1_000_003).wrapping_add(n));
        let (recording, simulation) = (recording(&mut random), simulation_file(&mut random));
        let begun = Instant::now();
        let outcome = catch_unwind(|| one(&recording, &simulation, n % 16 == 0));
        let seconds = begun.elapsed().as_secs_f64();
        if seconds > slowest.0 {
            slowest = (seconds, n);
        }
        let wrong = match outcome {
            Ok(Ok(word)) => {
                *outcomes.entry(word.to_owned()).or_insert(0) += 1;
                continue;
            }
            Ok(Err(rule)) => rule,
            Err(panic) => format!("panic: {}", words(&*panic)),
        };
        failures += 1;
        println!("{n}: {wrong}");
        let written = std::fs::write(folder.join(format!("{n}.csv")), &recording)
            .and_then(|()| std::fs::write(folder.join(format!("{n}.toml")), &simulation));
        if let Err(why) = written {
            eprintln!("{}: {why}", folder.display());
        }
    }
    for (word, count) in outcomes {
        println!("{count:8} {word}");
    }
    println!("{failures:8} failed; slowest {:.3} s, number {}", slowest.0, slowest.1);
    ExitCode::from(u8::from(failures > 0))
}
