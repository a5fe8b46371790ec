//! The block's rail table of a mechanism tied to a place: the library's own columns, sampled along the rail.

use model_core::left_out::rail::{KNOTS, RailTable};
use model_core::left_out::wave::Acts;
use model_core::params::Params;
use simulation::Simulation;
use simulation::mechanism::{Added, Context};
use simulation::motion::Motion;
use simulation::run::{Break, Part, Run};

/// Places sampled for each knot, to find where the lines between knots are furthest off.
const FINE: usize = 8;

/// Largest error of the interpolation, relative to the largest value.
const COARSE: f64 = 0.02;

/// Fills the block's one table.
pub(super) fn of(simulation: &Simulation, params: &mut Params, added: &Added, acts: Acts) -> Result<String, String> {
    if params.left_out.rail.knots != 0 {
        return Err(
            "the block has one table along the rail, and it is taken; leave the smaller of the two out".to_owned()
        );
    }
    let place = added.shape.first().copied().unwrap_or(0.0);
    let (length, pitch) = loaded_length_and_pitch_m(simulation);
    // the effect ends where the loaded length has passed the place; a patch of dirt rises and falls over a pitch at
    // either end, and its corners should fall on knots
    let (reach, lines) = if matches!(acts, Acts::Preload | Acts::Interference) {
        (length, KNOTS - 1)
    } else {
        let pitches = ((length / pitch).round() as usize + 1).clamp(1, KNOTS - 1);
        (length + pitch, (KNOTS - 1) / pitches * pitches)
    };
    let (from, to, lines) = match (added.form().map(|form| form.name), added.shape.as_slice()) {
        // it is a table already: its entries become the knots
        (Some("profile"), [from, to]) => (*from, *to, added.amplitudes.len().clamp(2, KNOTS) - 1),
        _ => (place - 0.5 * reach, place + 0.5 * reach, lines),
    };
    let fine = FINE * lines;
    let at = |n: usize| from + (to - from) * n as f64 / fine as f64;
    let values = sample(simulation, added, acts, &(0..=fine).map(at).collect::<Vec<_>>())
        .ok_or("the simulation has no value for it; check its numbers")?;
    let largest = values.iter().fold(0.0f64, |a, v| a.max(v.abs()));
    let scale = (largest / f64::from(i16::MAX)) as f32;
    let mut table = RailTable {
        acts,
        from_m: from as f32,
        step_m: ((to - from) / lines as f64) as f32,
        knots: (lines + 1) as u8,
        scale,
        ..RailTable::NONE
    };
    for (knot, value) in table.values.as_flattened_mut().iter_mut().zip(values.iter().step_by(FINE)) {
        // within ±i16::MAX by the choice of scale; a cast saturates
        *knot = (value / f64::from(scale)).round() as i16;
    }
    let line = |n: usize| {
        let (knot, share) = (n / FINE, (n % FINE) as f64 / FINE as f64);
        let at = |k: usize| values[(k * FINE).min(fine)];
        at(knot) + share * (at(knot + 1) - at(knot))
    };
    let worst = values.iter().enumerate().fold(0.0f64, |a, (n, v)| a.max((v - line(n)).abs()));
    if worst > COARSE * largest {
        return Err(format!(
            "{lines} lines are {:.1} % off its largest value; it is too steep for the block's table",
            100.0 * worst / largest
        ));
    }
    params.left_out.rail = table;
    Ok(format!(
        "a table of {} knots from {from:.3} to {to:.3} m, its lines {:.2} % off at most",
        lines + 1,
        100.0 * worst / largest
    ))
}

fn loaded_length_and_pitch_m(simulation: &Simulation) -> (f64, f64) {
    let run_and_motion = still(simulation, &[0.0]);
    let geometry =
        run_and_motion.and_then(|(run, motion)| Context::of(simulation, &run, &motion).ok().map(|c| c.geometry));
    geometry.map_or((0.093, 0.0072), |g| (g.loaded_length_m, g.ball_pitch_m))
}

/// Relative preload, or friction in N, at each place.
fn sample(simulation: &Simulation, added: &Added, acts: Acts, places: &[f64]) -> Option<Vec<f64>> {
    let (run, motion) = still(simulation, places)?;
    let context = Context::of(simulation, &run, &motion).ok()?;
    let force = added.force_n(&context)?;
    let by_preload = &context.by_preload_n;
    let load = &context.steady.load_per_ball_n;
    let one = |(n, (force, by)): (usize, (&f64, &f64))| match acts {
        Acts::Preload => force / by,
        Acts::Interference => force / by * load.get(n).map_or(1.0, |q| (q / 150.0).powf(2.0 / 3.0)),
        Acts::Drag | Acts::Force => *force,
    };
    let values: Vec<f64> = force.iter().zip(by_preload).enumerate().map(one).collect();
    values.iter().all(|v| v.is_finite()).then_some(values)
}

/// A slow passage over these places, with all other inputs of the law held constant.
fn still(simulation: &Simulation, places: &[f64]) -> Option<(Run, Motion)> {
    const SPEED: f64 = 0.02;
    let rows = places.len();
    let first = *places.first()?;
    let run = Run {
        time_s: places.iter().map(|x| (x - first) / SPEED).collect(),
        drag_force_n: vec![1.0; rows],
        position_m: Some(places.to_vec()),
        velocity_m_s: Some(vec![SPEED; rows]),
        acceleration_m_s2: Some(vec![0.0; rows]),
        preload_n: Some(vec![simulation.preload_n.unwrap_or(3000.0); rows]),
        temperature_block_degc: Some(vec![30.0; rows]),
        parts: vec![Part { rows: 0..rows, segment: None, starts: Break::Start }],
        ..Run::default()
    };
    let motion = Motion::of(&run);
    Some((run, motion))
}
