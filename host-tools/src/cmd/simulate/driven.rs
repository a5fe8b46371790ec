//! A whole recording of a driven profile.

use std::path::Path;

use host_tools::recording::Column;
use host_tools::simulate::{self, Simulated};
use serde_json::json;
use simulation::Simulation;
use simulation::law::Missing;
use simulation::profile::Course;
use simulation::run::Run;

use super::super::Failure;
use super::super::progress::Bar;
use super::profile::{Name, told};
use super::{Arguments, Told, put, rms};

pub(super) fn run(arguments: &Arguments, name: Name, simulation: &Simulation, out: &Path) -> Result<Told, Failure> {
    let profile = &arguments.profile;
    let sensors = arguments.sensors.sensors()?;
    let bar = Bar::busy("simulating");
    let Course { mut run, motion } = profile.drive(name, simulation)?;
    let unusable = |why: Missing| Failure::Data(format!("{}: {why}", arguments.simulation_name()));
    let simulated = Simulated::of(simulation, &run, &motion).map_err(unusable)?;
    let hidden = simulate::not_shown(simulation, &run, &motion).map_err(unusable)?;
    if let Some(row) = simulated.force_n.iter().position(|f| !f.is_finite()) {
        let preload = run.preload_n.as_ref().map_or(f64::NAN, |column| column[row]);
        return Err(Failure::Usage(format!(
            "--profile {}: the law has no value at a preload of {preload} N: the contact's geometry carries no such load",
            told(name)
        )));
    }
    run.drag_force_n = simulated.force_n;
    let clean = arguments.html.is_some().then(|| run.drag_force_n.clone());
    sensors.apply(&mut run, arguments.sensors.seed).map_err(|why| Failure::Usage(format!("--{why}")))?;
    if !arguments.sensors.has_velocity() {
        run.velocity_m_s = None;
    }
    drop(bar);
    let written = write(out, &run);
    let rows = run.len();
    let duration_s = run.time_s.last().copied().unwrap_or(0.0);
    let fastest = motion.velocity_m_s.iter().fold(0.0f64, |a, v| a.max(v.abs()));
    let travel: f64 = motion.position_m.windows(2).map(|w| (w[1] - w[0]).abs()).sum();
    let mut lines = vec![format!(
        "{}: {rows} samples, {duration_s:.1} s at {} Hz, {} segments, up to {fastest:.4} m/s, {travel:.2} m travelled; \
         force {:.3} N rms",
        told(name),
        profile.rate_hz(name),
        run.parts.len(),
        rms(&run.drag_force_n)
    )];
    lines.extend(hidden.iter().map(|line| format!("{}: {line}", told(name))));
    let object = json!({
        "schema": "guideblock.driven/1",
        "profile": told(name),
        "simulation": arguments.simulation_name(),
        "samples": rows,
        "rate_hz": profile.rate_hz(name),
        "duration_s": duration_s,
        "segments": run.parts.len(),
        "travel_m": travel,
        "fastest_m_s": fastest,
        "force_rms_n": rms(&run.drag_force_n),
        "seed": arguments.sensors.seed,
        "sensors": {
            "noise_relative": sensors.noise_relative,
            "noise_n": sensors.noise_n,
            "quantum_n": sensors.quantum_n,
            "lowpass_hz": sensors.lowpass_hz,
            "rails_n": sensors.rails_n.map(|(low, high)| [low, high]),
            "speed_noise_m_s": sensors.speed_noise_m_s,
            "position_quantum_m": sensors.position_quantum_m,
            "temperature_noise_k": sensors.temperature_noise_k,
        },
    });
    let mut page = String::new();
    if let Some(clean) = clean {
        let facts = vec![
            vec!["samples".to_owned(), rows.to_string()],
            vec!["length (s)".to_owned(), format!("{duration_s:.1}")],
            vec!["segments".to_owned(), run.parts.len().to_string()],
            vec!["travel (m)".to_owned(), format!("{travel:.2}")],
            vec!["rms of the force (N)".to_owned(), format!("{:.3}", rms(&run.drag_force_n))],
        ];
        let recorded = ("as the sensors show it", &run.drag_force_n[..]);
        let law = ("as the law says it", &clean[..]);
        let forces = if run.drag_force_n == clean { vec![law] } else { vec![recorded, law] };
        let title = format!("Profile {}", told(name));
        page = simulate::page(&title, &lines[0], &run.time_s, &motion, &forces, &facts);
    }
    Ok(Told { written, lines, object, page })
}

/// Writes all columns that the run has.
fn write(out: &Path, run: &Run) -> Result<(), Failure> {
    let mut segment = Vec::with_capacity(run.len());
    for part in &run.parts {
        // numbers of segments are small
        segment.resize(part.rows.end, part.segment.unwrap_or(0) as f64);
    }
    let columns: Vec<Column<'_>> = [
        ("time_s", Some(&run.time_s)),
        ("position_m", run.position_m.as_ref()),
        ("velocity_m_s", run.velocity_m_s.as_ref()),
        ("drag_force_n", Some(&run.drag_force_n)),
        ("preload_n", run.preload_n.as_ref()),
        ("external_load_n", run.external_load_n.as_ref()),
        ("temperature_block_degc", run.temperature_block_degc.as_ref()),
        ("temperature_rail_degc", run.temperature_rail_degc.as_ref()),
        ("temperature_ambient_degc", run.temperature_ambient_degc.as_ref()),
        ("segment", Some(&segment)),
    ]
    .into_iter()
    .filter_map(|(name, column)| Some(Column::numbers(name, column?)))
    .collect();
    put(out, &columns)
}
