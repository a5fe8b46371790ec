//! The simulation driven by a recording's own motion.

use std::collections::BTreeMap;
use std::io::Read;
use std::path::Path;

use host_tools::recording::{Column, Losses, Mapping, axis, table};
use host_tools::simulate::{self, Silence, Simulated, silences};
use serde_json::json;
use simulation::Simulation;
use simulation::law::Missing;
use simulation::motion::Motion;
use simulation::run::Run;

use super::super::progress::Bar;
use super::super::recordings::with_progress;
use super::super::{Failure, say};
use super::{Arguments, Told, put, rms};

pub(super) fn run(
    arguments: &Arguments,
    input: &Path,
    simulation: &Simulation,
    mappings: &[Mapping],
    out: &Path,
) -> Result<Told, Failure> {
    let file = open(arguments, input, mappings)?;
    let run = &file.run;
    let bar = Bar::busy("simulating");
    let motion = Motion::of(run);
    let unusable = |why: Missing| Failure::Data(format!("{}: {why}", run.name));
    let simulated = Simulated::of(simulation, run, &motion).map_err(unusable)?;
    let hidden = simulate::not_shown(simulation, run, &motion).map_err(unusable)?;
    drop(bar);
    let mut force_n = simulated.force_n.clone();
    let mut silent: BTreeMap<Silence, usize> = BTreeMap::new();
    for (row, why) in silences(simulation, run, &motion, &simulated) {
        force_n[row] = f64::NAN;
        *silent.entry(why).or_default() += 1;
    }
    let all = file.all_s.as_deref().unwrap_or(&run.time_s);
    let left_out = all.len() - run.len();
    if left_out > 0 {
        silent.insert(Silence::LeftOut, left_out);
    }
    let placed;
    let cells = if left_out > 0 {
        placed = simulate::among_all(all, &run.time_s, &force_n);
        &placed
    } else {
        &force_n
    };
    let written = put(out, &[Column::numbers("time_s", all), Column::numbers("simulated_force_n", cells)]);
    let values = force_n.iter().filter(|f| f.is_finite()).count();
    let difference: Vec<f64> = run.drag_force_n.iter().zip(&force_n).map(|(f, s)| f - s).collect();
    let mut lines: Vec<String> =
        silent.iter().map(|(why, n)| format!("{}: {n} of {} cells are empty: {why}", run.name, all.len())).collect();
    lines.extend(hidden.iter().map(|line| format!("{}: {line}", run.name)));
    if values == 0 {
        lines.iter().for_each(say);
        return Err(Failure::Data(format!("{}: no sample has a simulated force", run.name)));
    }
    lines.push(format!(
        "{values} of {} samples have a simulated force, rms {:.3} N; the recorded force differs from it by {:.3} N rms",
        all.len(),
        rms(&force_n),
        rms(&difference)
    ));
    let object = json!({
        "schema": "guideblock.simulated/1",
        "recording": run.name,
        "simulation": arguments.simulation_name(),
        "samples": all.len(),
        "values": values,
        "empty": silent.iter().map(|(why, n)| (why.id().to_owned(), json!(n))).collect::<serde_json::Map<_, _>>(),
        "simulated_rms_n": rms(&force_n),
        "recorded_rms_n": rms(&run.drag_force_n),
        "difference_rms_n": rms(&difference),
    });
    let mut page = String::new();
    if arguments.html.is_some() {
        let mut facts = vec![
            vec!["samples".to_owned(), all.len().to_string()],
            vec!["with a simulated force".to_owned(), values.to_string()],
            vec!["rms of the simulated force (N)".to_owned(), format!("{:.3}", rms(&force_n))],
            vec!["rms of recorded less simulated (N)".to_owned(), format!("{:.3}", rms(&difference))],
        ];
        facts.extend(silent.iter().map(|(why, n)| vec![format!("empty: {why}"), n.to_string()]));
        page = simulate::page(
            &format!("Simulation of {}", run.name),
            lines.last().map_or("", String::as_str),
            &run.time_s,
            &motion,
            &[("recorded", &run.drag_force_n), ("simulated", &force_n)],
            &facts,
        );
    }
    Ok(Told { written, lines, object, page })
}

/// A recording and, where rows of it could not be used, the times of all.
struct Recorded {
    run: Run,
    all_s: Option<Vec<f64>>,
}

fn open(arguments: &Arguments, input: &Path, mappings: &[Mapping]) -> Result<Recorded, Failure> {
    let recording = &arguments.recording;
    let mappings = recording.with(mappings);
    let selections = &recording.selections;
    // a pipe can be read only once
    let mut piped = Vec::new();
    let is_pipe = input == Path::new("-");
    let (run, losses) = if is_pipe {
        std::io::stdin()
            .lock()
            .read_to_end(&mut piped)
            .map_err(|error| Failure::Usage(format!("standard input: {error}")))?;
        axis::from_bytes("standard input", piped.clone(), &mappings, selections, &host_tools::recording::silent)?
    } else {
        with_progress(input, |progress| host_tools::recording::open(input, &mappings, selections, progress))?
    };
    for line in losses.describe(&run.name) {
        say(line);
    }
    let mut all_s = None;
    if losses.lost > 0 {
        let time: Vec<_> = mappings.iter().filter(|mapping| mapping.name == "time_s").cloned().collect();
        let (table, _): (_, Losses) = if is_pipe {
            table::from_bytes(&run.name, piped, &["time_s"], &[], &time, selections, &host_tools::recording::silent)?
        } else {
            with_progress(input, |progress| table::open(input, &["time_s"], &[], &time, selections, progress))?
        };
        all_s = table.column("time_s").map(<[f64]>::to_vec);
    }
    Ok(Recorded { run, all_s })
}
