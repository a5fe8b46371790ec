//! `guideblock estimate`

use std::io::Write;
use std::path::{Path, PathBuf};

use calibration::staircase::Staircase;
use host_tools::estimate::{self, Basis, Estimate, Settings, Summary};
use host_tools::recording::{Cells, Column, Kind, write};
use serde_json::json;

use super::outputs::{self, Files};
use super::recordings::RecordingArguments;
use super::simulation_file::SimulationFile;
use super::{Failure, output, say};

/// Preload over a whole recording, with its band
///
/// Cuts the recording into windows of steady motion and inverts the drag law in each. The band is two
/// standard deviations: noise of the force within the window, and what the simulation file's tolerance
/// says of friction and viscosity, which no longer recording makes smaller. A window that must not be
/// trusted has a reason instead of a preload. With --staircase one preload is fitted to all speeds.
#[derive(clap::Args)]
#[command(verbatim_doc_comment, allow_negative_numbers = true)]
pub(crate) struct Arguments {
    /// Recording, CSV or Parquet; - is standard input
    #[arg(value_name = "RECORDING")]
    input: PathBuf,
    /// Simulation file with the guide, its lubricant and their tolerance; without it, the set zhou-2023
    #[arg(long, visible_alias = "simulation", value_name = "FILE.toml")]
    guide: Option<PathBuf>,
    /// Kinematic viscosity of the oil, cSt; goes before that of the file
    #[arg(long, value_name = "CST")]
    viscosity: Option<f64>,
    /// Length of a window, s; at low rates longer, for 20 rows in each
    #[arg(long, value_name = "S", default_value_t = 0.25, value_parser = positive)]
    every: f64,
    /// Constant drag of the seals, N
    #[arg(long, value_name = "N", default_value_t = 0.0, value_parser = not_negative)]
    seal_drag: f64,
    /// Drag of the seals that grows with speed, N s/m
    #[arg(long, value_name = "N_S/M", default_value_t = 0.0, value_parser = not_negative)]
    seal_viscous: f64,
    /// Standard deviation of the seals' drag, N
    #[arg(long, value_name = "N", default_value_t = 0.0, value_parser = not_negative)]
    seal_sigma: f64,
    /// Fit one preload to all speeds of the recording
    #[arg(long)]
    staircase: bool,
    /// With --staircase: the constant drag of the seals is not known and is fitted along
    #[arg(long, requires = "staircase", conflicts_with = "seal_drag")]
    fit_seals: bool,
    /// Where the windows are written, .csv or .parquet; without it, as CSV to standard output
    #[arg(long, value_name = "OUT")]
    out: Option<PathBuf>,
    /// Print the summary as one JSON object to standard output, and the windows only with --out
    #[arg(long)]
    json: bool,
    /// Page with charts
    #[arg(long, value_name = "OUT.html")]
    html: Option<PathBuf>,
    #[command(flatten)]
    recording: RecordingArguments,
}

fn not_negative(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|x: &f64| x.is_finite() && *x >= 0.0)
        .ok_or_else(|| "expected a number from 0 on".to_owned())
}

fn positive(text: &str) -> Result<f64, String> {
    not_negative(text).ok().filter(|x| *x > 0.0).ok_or_else(|| "expected a number above 0".to_owned())
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let files = Files::default().reads("RECORDING", [&arguments.input]).reads("--guide", &arguments.guide);
    files.writes("--out", &arguments.out).writes("--html", &arguments.html).check()?;
    if let Some(out) = &arguments.out
        && Kind::of(out).is_none()
    {
        return Err(Failure::file(out, "name it .csv or .parquet, so that it is clear what to write"));
    }
    let SimulationFile { simulation, mappings } =
        SimulationFile::or_published(arguments.guide.as_deref())?.with_viscosity(arguments.viscosity)?;
    let (run, _) = arguments.recording.open(&arguments.input, &mappings)?;
    let settings = Settings {
        every_s: arguments.every,
        seal_coulomb_n: arguments.seal_drag,
        seal_viscous_n_s_m: arguments.seal_viscous,
        seal_sigma_n: arguments.seal_sigma,
        ..Settings::default()
    };
    let window_s = run.parts.iter().fold(arguments.every, |s, part| s.max(estimate::window_s(&run, part, s)));
    if window_s > 1.001 * arguments.every {
        let asked = arguments.every;
        say(format_args!("{}: windows up to {window_s:.3} s long, not {asked} s, to hold 20 rows each", run.name));
    }
    let unusable = |why: &dyn std::fmt::Display| Failure::Data(format!("{}: {why}", run.name));
    let estimates = estimate::estimate(&run, &simulation, &settings).map_err(|why| unusable(&why))?;
    let summary = Summary::of(&estimates);
    let staircase = if arguments.staircase {
        Some(estimate::staircase(&estimates, &simulation, arguments.fit_seals).map_err(|why| unusable(&why))?)
    } else {
        None
    };
    let lines = describe(&summary, staircase.as_ref());
    let basis = Basis::of(&simulation);
    let uncalibrated = basis.as_ref().and_then(Basis::warning);
    // files first, so that closing standard output early does not cost them
    if let Some(path) = &arguments.html {
        let lead = lines.first().map_or("", String::as_str);
        let page = estimate::page(&run.name, lead, uncalibrated.as_deref(), &estimates, &summary, staircase.as_ref());
        outputs::put(path, page)?;
    }
    if let Some(line) = &uncalibrated {
        say(line);
    }
    match (&arguments.out, arguments.json) {
        (Some(out), _) => table(out, &estimates)?,
        (None, false) => table(Path::new("-"), &estimates)?,
        (None, true) => {}
    }
    if arguments.json {
        let mut out = output();
        writeln!(out, "{:#}", object(&run.name, window_s, basis.as_ref(), &summary, staircase.as_ref()))?;
        out.flush()?;
    } else if arguments.out.is_some() {
        let mut out = output();
        for line in &lines {
            writeln!(out, "{line}")?;
        }
        out.flush()?;
    } else {
        for line in &lines {
            say(line);
        }
    }
    if summary.windows == 0 {
        let what = format!(
            "no stretch without a gap is long enough for a window ({window_s:.3} s); record longer ones, or shorten --every"
        );
        return Err(unusable(&what));
    }
    if summary.usable == 0 && staircase.is_none() {
        return Err(unusable(&"no window has a preload"));
    }
    // the process ends here; freeing the columns would only take time
    std::mem::forget(run);
    Ok(())
}

/// Writes the windows.
fn table(path: &Path, estimates: &[Estimate]) -> Result<(), Failure> {
    let of = |f: &dyn Fn(&Estimate) -> f64| -> Vec<f64> { estimates.iter().map(f).collect() };
    let preload = |f: &dyn Fn(&estimate::Preload) -> f64| of(&|e| e.preload.as_ref().map_or(f64::NAN, f));
    let numbers = [
        ("time_s", of(&|e| e.window.time_s)),
        ("position_m", of(&|e| e.window.position_m)),
        ("speed_m_s", of(&|e| e.window.speed_m_s)),
        ("drag_force_n", of(&|e| e.window.force_n)),
        ("drag_sigma_n", of(&|e| e.window.force_sigma_n)),
        ("viscosity_cst", of(&|e| e.viscosity_cst)),
        ("preload_n", preload(&|p| p.value_n)),
        ("sigma_n", preload(&|p| p.sigma_n())),
        ("noise_sigma_n", preload(&|p| p.noise_n)),
        ("lower_n", preload(&|p| p.band().0)),
        ("upper_n", preload(&|p| p.band().1)),
    ];
    let reasons: Vec<String> =
        estimates.iter().map(|e| e.reasons.iter().map(|r| r.name()).collect::<Vec<_>>().join(" ")).collect();
    let mut columns: Vec<Column<'_>> = numbers.iter().map(|(name, column)| Column::numbers(name, column)).collect();
    columns.push(Column { name: "reason", cells: Cells::Texts(&reasons) });
    write(path, &columns).map_err(|error| outputs::of(path, error))
}

/// The summary in lines, the answer first.
fn describe(summary: &Summary, staircase: Option<&Staircase>) -> Vec<String> {
    let mut lines = Vec::new();
    if let Some(found) = staircase {
        let p = &found.preload_n;
        lines.push(format!(
            "preload {:.0} N from all speeds, 95 % {:.0} to {:.0} N with the friction law as given",
            p.value, p.interval[0], p.interval[1]
        ));
        if let Some(seal) = &found.seal_drag_n {
            lines.push(format!(
                "constant seal drag {:.2} N, 95 % {:.2} to {:.2} N",
                seal.value, seal.interval[0], seal.interval[1]
            ));
        }
    }
    if summary.usable > 0 {
        lines.push(format!(
            "preload {:.0} N +- {:.0} N (two sigma, of which the law {:.0} N); 90 % of the windows {:.0} to {:.0} N",
            summary.preload_n,
            2.0 * summary.sigma_n,
            2.0 * summary.model_n,
            summary.spread_n.0,
            summary.spread_n.1
        ));
    }
    let refused: Vec<String> = summary.refused.iter().map(|(reason, n)| format!("{} {n}", reason.name())).collect();
    let refused = if refused.is_empty() { String::new() } else { format!("; without: {}", refused.join(", ")) };
    lines.push(format!("{} of {} windows have a preload{refused}", summary.usable, summary.windows));
    for place in summary.places.iter().filter(|place| place.windows > 0) {
        lines.push(format!(
            "  {:>9.4} to {:>9.4} m  {:>6} windows  {:>8.1} N +- {:.1} (noise only)",
            place.from_m,
            place.to_m,
            place.windows,
            place.preload_n,
            2.0 * place.noise_n
        ));
    }
    lines
}

fn object(
    name: &str,
    every_s: f64,
    basis: Option<&Basis>,
    summary: &Summary,
    staircase: Option<&Staircase>,
) -> serde_json::Value {
    // JSON has no NaN: what is not known is null
    let fitted = |f: &calibration::staircase::Fitted| json!({"value": f.value, "sigma": f.sigma, "ci95": f.interval});
    json!({
        "schema": "guideblock.estimate/1",
        "recording": name,
        "law": basis,
        "every_s": every_s,
        "windows": summary.windows,
        "usable": summary.usable,
        "refused": summary.refused.iter().map(|(r, n)| (r.name().to_owned(), json!(n))).collect::<serde_json::Map<_, _>>(),
        "preload_n": summary.preload_n,
        "sigma_n": summary.sigma_n,
        "model_sigma_n": summary.model_n,
        "windows_90_percent_n": [summary.spread_n.0, summary.spread_n.1],
        "by_position": summary.places.iter().map(|p| json!({
            "from_m": p.from_m, "to_m": p.to_m, "windows": p.windows, "preload_n": p.preload_n, "noise_sigma_n": p.noise_n,
        })).collect::<Vec<_>>(),
        "staircase": staircase.map(|s| json!({
            "preload_n": fitted(&s.preload_n),
            "seal_drag_n": s.seal_drag_n.as_ref().map(fitted),
            "chi2_per_freedom": s.chi2_per_freedom,
            "speeds": s.residuals.len(),
        })),
    })
}
