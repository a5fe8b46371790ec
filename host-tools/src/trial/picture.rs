//! The picture of one answer: residual before and after the diagnosis, over time and over the axis that matters.
//!
//! ```text
//! before   recorded - law with its constants moved as the diagnosis moved them (as given where it wrote none)
//! after    recorded - law with what the diagnosis added
//! hidden   true noise-free force - law: what an analyser would have had to find
//! ```
//! Means over cells, so that the noise does not hide them.

use std::fs;
use std::path::Path;

use simulation::Simulation;
use simulation::motion::Motion;
use simulation::run::Run;

use super::score::holdout::floats;
use super::score::truth::Truth;
use crate::recording::{self, Mapping, silent};
use crate::report::chart::Chart;
use crate::simulate::Simulated;

/// Cells over time.
const MOMENTS: usize = 160;
/// Cells over an axis.
const CELLS: usize = 28;
/// Height of a picture, px: many stand under one another.
const HEIGHT: f64 = 150.0;

/// Forces of all rows of a record, N; NaN where the law has no value.
struct Rest {
    before: Vec<f64>,
    after: Option<Vec<f64>>,
    hidden: Option<Vec<f64>>,
    time_s: Vec<f64>,
    velocity_m_s: Vec<f64>,
    axis: Option<Axis>,
}

/// An abscissa of the second picture.
struct Axis {
    name: String,
    unit: &'static str,
    values: Vec<f64>,
    /// Forces are shown against the motion.
    is_signed: bool,
}

/// The pictures of one record; none where nothing can be drawn, as for a spoiled file. `results` is the folder of the
/// run.
pub fn pictures(folder: &Path, results: &Path, id: &str, truth: &Truth, main_axis: Option<&str>) -> Vec<String> {
    let Some(rest) = rest(folder, results, id, truth, main_axis) else { return Vec::new() };
    let step_s = {
        let steps = rest.time_s.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > 0.0);
        super::score::tally::median(steps.collect()).unwrap_or(1.0)
    };
    // pauses between runs would take most of the width
    let moments: Vec<f64> = (0..rest.time_s.len()).map(|n| n as f64 * step_s).collect();
    let even: Vec<f64> = vec![1.0; moments.len()];
    let mut out = vec![chart(&rest, &format!("{id} over time"), "time without pauses (s)", &moments, &even, MOMENTS)];
    if let Some(axis) = &rest.axis {
        let direction: Vec<f64> = rest.velocity_m_s.iter().map(|v| if *v < 0.0 { -1.0 } else { 1.0 }).collect();
        let (sign, how) = if axis.is_signed { (&direction, ", against the motion") } else { (&even, "") };
        let title = format!("{id} over {}{how}", axis.name);
        out.push(chart(&rest, &title, &format!("{} ({})", axis.name, axis.unit), &axis.values, sign, CELLS));
    }
    out
}

fn chart(rest: &Rest, title: &str, x: &str, values: &[f64], sign: &[f64], cells: usize) -> String {
    let line = |force: &[f64]| means(values, force, sign, cells);
    let mut chart = Chart::new(title, x, "force left (N)").height(HEIGHT).from_zero();
    chart = chart.line("before", line(&rest.before));
    if let Some(hidden) = &rest.hidden {
        chart = chart.dashed("hidden", line(hidden));
    }
    // last, so that colours stay where a diagnosis added nothing
    if let Some(after) = &rest.after {
        chart = chart.line("after", line(after));
    }
    chart.svg()
}

/// Means over cells of equal numbers of rows.
fn means(values: &[f64], force: &[f64], sign: &[f64], cells: usize) -> Vec<(f64, f64)> {
    let mut rows: Vec<(f64, f64)> = values
        .iter()
        .zip(force.iter().zip(sign))
        .filter(|(x, (f, _))| x.is_finite() && f.is_finite())
        .map(|(x, (f, s))| (*x, f * s))
        .collect();
    rows.sort_by(|a, b| a.0.total_cmp(&b.0));
    let size = rows.len().div_ceil(cells).max(1);
    let mut out: Vec<(f64, f64)> = Vec::with_capacity(cells);
    for cell in rows.chunks(size) {
        let n = cell.len() as f64;
        out.push((cell.iter().map(|r| r.0).sum::<f64>() / n, cell.iter().map(|r| r.1).sum::<f64>() / n));
    }
    out
}

fn rest(folder: &Path, results: &Path, id: &str, truth: &Truth, main_axis: Option<&str>) -> Option<Rest> {
    let record = folder.join("records").join(id);
    let simulation = |path: &Path| Simulation::from_toml(&fs::read_to_string(path).ok()?).ok();
    let augmented = simulation(&results.join(format!("{id}.toml")));
    let given = match &augmented {
        Some(augmented) => Simulation { mechanisms: Vec::new(), curves: Vec::new(), ..augmented.clone() },
        None => simulation(&record.join("simulation.toml"))?,
    };
    // the file holds a gain of a column as a mapping
    let mappings: Vec<Mapping> =
        given.columns.iter().map(|(name, text)| Mapping::new(name, text).ok()).collect::<Option<_>>()?;
    let runs: Vec<(Run, Motion)> = truth
        .files()
        .iter()
        .map(|name| {
            let (run, _) = recording::open(&record.join(name), &mappings, &[], &silent).ok()?;
            let motion = Motion::of(&run);
            Some((run, motion))
        })
        .collect::<Option<_>>()?;
    let left = |simulation: &Simulation| -> Option<Vec<f64>> {
        let mut out = Vec::new();
        for (run, motion) in &runs {
            let force_n = Simulated::of(simulation, run, motion).ok()?.force_n;
            let stands = |n: usize| motion.velocity_m_s[n].abs() < simulation.axis.zero_speed_m_s;
            out.extend((0..run.len()).map(|n| if stands(n) { f64::NAN } else { run.drag_force_n[n] - force_n[n] }));
        }
        Some(out)
    };
    let before = left(&given)?;
    let recorded: Vec<f64> = runs.iter().flat_map(|(run, _)| run.drag_force_n.iter().copied()).collect();
    let is = floats(&folder.join("answers").join(format!("{id}.truth-force.npy"))).ok();
    let hidden = is.filter(|is| is.len() == recorded.len()).map(|is| {
        is.iter().zip(recorded.iter().zip(&before)).map(|(is, (recorded, before))| is - recorded + before).collect()
    });
    Some(Rest {
        after: augmented.as_ref().and_then(left),
        hidden,
        time_s: runs.iter().flat_map(|(run, _)| run.time_s.iter().copied()).collect(),
        velocity_m_s: runs.iter().flat_map(|(_, motion)| motion.velocity_m_s.iter().copied()).collect(),
        axis: main(&runs, truth, main_axis),
        before,
    })
}

/// The first axis of the truth that the recording has, else the one that the diagnosis states, else speed.
fn main(runs: &[(Run, Motion)], truth: &Truth, stated: Option<&str>) -> Option<Axis> {
    let period_m = truth.effects.iter().find_map(|effect| effect.place.wavelengths_m.first().copied());
    let wanted = truth.effects.iter().flat_map(|effect| effect.place.axes.iter().map(String::as_str));
    wanted.chain(stated).chain(["velocity"]).find_map(|name| axis(runs, name, period_m))
}

fn axis(runs: &[(Run, Motion)], name: &str, period_m: Option<f64>) -> Option<Axis> {
    let column = |of: fn(&Run) -> Option<&Vec<f64>>| -> Option<Vec<f64>> {
        let columns: Option<Vec<&Vec<f64>>> = runs.iter().map(|(run, _)| of(run)).collect();
        Some(columns?.into_iter().flatten().copied().collect())
    };
    let motion = |of: fn(&Motion) -> &Vec<f64>| -> Vec<f64> {
        runs.iter().flat_map(|(_, motion)| of(motion).iter().copied()).collect()
    };
    let (unit, is_signed, values) = match name {
        "velocity" => ("m/s", true, motion(|m| &m.velocity_m_s).iter().map(|v| v.abs()).collect()),
        "position" => ("m", false, motion(|m| &m.position_m)),
        "direction" => ("-1 or 1", false, motion(|m| &m.velocity_m_s).iter().map(|v| v.signum()).collect()),
        "acceleration" => ("m/s²", false, motion(|m| &m.acceleration_m_s2)),
        "preload" => ("N", true, column(|run| run.preload_n.as_ref())?),
        "load" => ("N", true, column(|run| run.external_load_n.as_ref())?),
        "temperature" => ("°C", true, column(|run| run.temperature_block_degc.as_ref())?),
        "temperature-difference" => {
            let (block, rail) =
                (column(|run| run.temperature_block_degc.as_ref())?, column(|run| run.temperature_rail_degc.as_ref())?);
            ("K", true, block.iter().zip(&rail).map(|(block, rail)| block - rail).collect())
        }
        "travel" => ("m", true, travelled(runs, false)),
        "reversal-distance" => ("m", true, travelled(runs, true)),
        "wavelength" => {
            let period_m = period_m?;
            ("m", false, motion(|m| &m.position_m).iter().map(|y| y.rem_euclid(period_m)).collect())
        }
        _ => return None,
    };
    let name = if name == "wavelength" { "place within the period" } else { name };
    Some(Axis { name: name.to_owned(), unit, values, is_signed })
}

/// Travel since the first row, or since the last reversal.
fn travelled(runs: &[(Run, Motion)], since_reversal: bool) -> Vec<f64> {
    let (mut out, mut travel_m) = (Vec::new(), 0.0);
    for (run, motion) in runs {
        for part in &run.parts {
            let (mut from_m, mut side) = (travel_m, 0.0);
            for n in part.rows.clone() {
                if n > part.rows.start {
                    travel_m += (motion.position_m[n] - motion.position_m[n - 1]).abs();
                }
                let v = motion.velocity_m_s[n];
                if v * side < 0.0 {
                    from_m = travel_m;
                }
                if v != 0.0 {
                    side = v;
                }
                out.push(if since_reversal { travel_m - from_m } else { travel_m });
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_are_taken_over_equal_numbers_of_rows() {
        let x: Vec<f64> = (0..100).map(f64::from).collect();
        let mut y: Vec<f64> = x.iter().map(|x| if *x < 50.0 { 1.0 } else { -1.0 }).collect();
        y[7] = f64::NAN;
        let sign: Vec<f64> = x.iter().map(|x| if *x < 50.0 { 1.0 } else { -1.0 }).collect();
        let got = means(&x, &y, &sign, 4);
        assert_eq!(got.len(), 4);
        assert!(got.iter().all(|(_, mean)| *mean == 1.0) && got.is_sorted_by(|a, b| a.0 < b.0));
        assert!(means(&[], &[], &[], 4).is_empty());
    }

    #[test]
    fn what_a_diagnosis_adds_is_taken_off_what_was_left() {
        const LAW: &str = "schema = \"guideblock.simulation/1\"\n[lubricant]\nviscosity_cst = 100.0\n[operation]\npreload_n = 1000.0\n";
        let seal = "[[mechanism]]\nid = \"seal-drag\"\nform = \"minimal\"\ndrag_n = 2.0\n";
        let folder = std::env::temp_dir().join(format!("guideblock-picture-{}", std::process::id()));
        for part in ["records/r1", "answers", "run"] {
            fs::create_dir_all(folder.join(part)).unwrap();
        }
        let velocity = |n: usize| -> f64 { if n % 100 < 50 { 0.1 } else { -0.05 } };
        let rows = |force: &dyn Fn(usize) -> f64| -> String {
            let row = |n: usize| format!("{:.2},{},{:.9}\n", 0.01 * n as f64, velocity(n), force(n));
            std::iter::once("time_s,velocity_m_s,drag_force_n\n".to_owned()).chain((0..400).map(row)).collect()
        };
        let recording = folder.join("records/r1/recording.csv");
        fs::write(&recording, rows(&|n| n as f64)).unwrap();
        fs::write(folder.join("records/r1/simulation.toml"), LAW).unwrap();
        let (run, _) = recording::open(&recording, &[], &[], &silent).unwrap();
        let law = Simulated::of(&Simulation::from_toml(LAW).unwrap(), &run, &Motion::of(&run)).unwrap().force_n;
        fs::write(&recording, rows(&|n| law[n] + 2.0 * velocity(n).signum())).unwrap();
        let truth = Truth::default();
        let results = folder.join("run");
        let left = |of: &dyn Fn(&Rest) -> Option<Vec<f64>>| {
            let rest = rest(&folder, &results, "r1", &truth, None).unwrap();
            let force = of(&rest)?;
            let signed = force.iter().zip(&rest.velocity_m_s).map(|(f, v)| f * v.signum());
            Some((signed.sum::<f64>() / force.len() as f64 * 1e6).round() / 1e6)
        };
        assert_eq!(left(&|rest| Some(rest.before.clone())), Some(2.0));
        assert_eq!(left(&|rest| rest.after.clone()), None, "the diagnosis wrote no simulation");
        fs::write(results.join("r1.toml"), format!("{LAW}{seal}")).unwrap();
        assert_eq!(left(&|rest| Some(rest.before.clone())), Some(2.0));
        assert_eq!(left(&|rest| rest.after.clone()).map(f64::abs), Some(0.0));
        let drawn = pictures(&folder, &results, "r1", &truth, Some("direction"));
        assert_eq!(drawn.len(), 2);
        assert!(drawn[1].contains("r1 over direction") && drawn.iter().all(|svg| !svg.contains("NaN")));
        fs::remove_dir_all(&folder).unwrap();
    }
}
