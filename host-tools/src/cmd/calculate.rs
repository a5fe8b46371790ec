//! What `preload` and `drag` share: one working point or a table of them, in either direction.

mod table;

use std::io::Write;
use std::path::{Path, PathBuf};

use host_tools::calculator::{self, Answer, Motion, Oil, Refusal};
use host_tools::report::number::significant;
use serde_json::json;
use simulation::guide::GuideSet;
use simulation::published::{Provenance, Value};

use super::simulation_file::text;
use super::{Failure, open, output, say};

/// Inputs beside the force or the preload.
#[derive(clap::Args)]
pub(super) struct Shared {
    /// Speed of the carriage, m/s; its sign is ignored
    #[arg(long, value_name = "M/S", allow_negative_numbers = true)]
    speed: Option<f64>,
    /// Speed of the carriage, m/min
    #[arg(long, value_name = "M/MIN", conflicts_with = "speed", allow_negative_numbers = true)]
    speed_m_min: Option<f64>,
    /// Kinematic viscosity of the oil, cSt
    #[arg(long, value_name = "CST")]
    viscosity: Option<f64>,
    /// Temperature of the oil, °C; the guide file's oil tells the viscosity
    #[arg(long, value_name = "DEGC", conflicts_with = "viscosity", allow_negative_numbers = true)]
    temperature: Option<f64>,
    /// Drag of the seals at that speed, N
    #[arg(long, value_name = "N")]
    seal_drag: Option<f64>,
    /// Simulation file, of which the guide and its lubricant are used; without it, the set zhou-2023
    #[arg(long, value_name = "FILE.toml")]
    guide: Option<PathBuf>,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
    /// Read a table from standard input and print it with the result as further columns
    #[arg(long, conflicts_with = "json")]
    csv: bool,
    /// Table to read, as with --csv; - is standard input
    #[arg(value_name = "TABLE.csv", conflicts_with_all = ["json", "csv"])]
    table: Option<PathBuf>,
}

/// Direction in which the model is evaluated.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Direction {
    /// Force in, preload out.
    Preload,
    /// Preload in, force out.
    Drag,
}

impl Direction {
    /// Option, columns that hold the input, column of the result.
    const fn words(self) -> (&'static str, &'static [&'static str], &'static str) {
        match self {
            Direction::Preload => ("--force", &["force_n", "drag_force_n"], "calculated_preload_n"),
            Direction::Drag => ("--preload", &["preload_n"], "calculated_force_n"),
        }
    }

    fn ask(self, set: &GuideSet, x: f64, motion: Motion) -> Result<Answer, Refusal> {
        match self {
            Direction::Preload => calculator::preload(set, x, motion),
            Direction::Drag => calculator::drag(set, x, motion),
        }
    }

    const fn result(self, answer: &Answer) -> f64 {
        match self {
            Direction::Preload => answer.preload_n,
            Direction::Drag => answer.force_n,
        }
    }
}

pub(super) fn run(direction: Direction, given: Option<f64>, shared: &Shared) -> Result<(), Failure> {
    let set = match &shared.guide {
        Some(path) => guide(path)?,
        None => GuideSet::zhou_2023(),
    };
    match (&shared.table, shared.csv) {
        (Some(path), _) => table::many(direction, given, shared, &set, open(path)?),
        (None, true) => table::many(direction, given, shared, &set, open(Path::new("-"))?),
        (None, false) => one(direction, given, shared, &set),
    }
}

/// Reads the guide of a simulation file.
pub(super) fn guide(path: &Path) -> Result<GuideSet, Failure> {
    GuideSet::from_toml(&text(path)?).map_err(|why| Failure::Data(format!("{}: {why}", path.display())))
}

impl Shared {
    fn speed(&self) -> Option<f64> {
        self.speed.or(self.speed_m_min.map(|v| v / 60.0))
    }

    fn oil(&self) -> Oil {
        match (self.viscosity, self.temperature) {
            (Some(nu), _) => Oil::Viscosity(nu),
            (None, Some(t)) => Oil::Temperature(t),
            (None, None) => Oil::Unsaid,
        }
    }
}

fn one(direction: Direction, given: Option<f64>, shared: &Shared, set: &GuideSet) -> Result<(), Failure> {
    let need = |what: &str| Failure::Usage(format!("{what} is missing; or give a table with --csv"));
    let x = given.ok_or_else(|| need(direction.words().0))?;
    let speed_m_s = shared.speed().ok_or_else(|| need("--speed or --speed-m-min"))?;
    let motion = Motion { speed_m_s, oil: shared.oil(), seal_drag_n: shared.seal_drag.unwrap_or(0.0) };
    let answer = direction.ask(set, x, motion).map_err(|why| Failure::Usage(why.to_string()))?;
    let outside = calculator::outside_measured(&answer);
    // a viscosity that was given needs no oil of the set
    let is_used = |section: &str| section != "lubricant" || matches!(motion.oil, Oil::Temperature(_));
    let assumed: Vec<(&str, Value, &str)> = set
        .entries()
        .iter()
        .filter(|e| is_used(e.section))
        .filter_map(|e| match e.provenance {
            Provenance::Assumed(why) => Some((e.key, e.value, why)),
            Provenance::Stated(_) | Provenance::File => None,
        })
        .collect();
    let mut out = output();
    if shared.json {
        let plain = |value: &Value| match value {
            Value::Number(x) => json!(x),
            Value::Name(name) => json!(name),
        };
        let assumed: Vec<_> =
            assumed.iter().map(|(key, value, why)| json!({"key": key, "value": plain(value), "why": why})).collect();
        let object = json!({
            "schema": "guideblock.working-point/1",
            "parameters": set.parameters().name,
            "working_point": answer,
            "outside_measured": outside,
            "assumed": assumed,
        });
        writeln!(out, "{object:#}")?;
        return Ok(out.flush()?);
    }
    for q in answer.quantities() {
        writeln!(out, "{:<24} {:>14} {:<13} {}", q.name, six_digits(q.value), q.unit, q.meaning)?;
    }
    writeln!(out, "{:<24} {:>14}", "regime", answer.regime.name())?;
    if !assumed.is_empty() {
        writeln!(out, "\nASSUMED ({}):", set.parameters().name)?;
    }
    for (key, value, why) in assumed {
        writeln!(out, "{key:<24} {:>14} {:<13} {why}", value.to_string(), "")?;
    }
    out.flush()?;
    for line in outside {
        say(line);
    }
    Ok(())
}

/// Six significant digits, as a person reads them.
pub(super) fn six_digits(x: f64) -> String {
    significant(x, 6)
}
