//! Extraction of strokes at steady speed and known load from a recording.
//!
//! Windows of steady motion (those of `estimate`) that follow one another with the same direction, speed and reference
//! load are one stroke; starts, stops, reversals and the presliding after them are left out.

use std::collections::BTreeMap;
use std::ops::Range;

use calibration::cell::Cell;
use model_core::sample::Reason;
use simulation::guide::{GuideSet, Lubricant};
use simulation::run::Run;

use super::{Reference, Settings};
use crate::estimate::{self, Window, window_s, windows};
use crate::recording::table::Table;

/// Reference load below which a block counts as unloaded, N.
const UNLOADED_N: f64 = 1.0;

/// Largest relative difference of speeds and loads within one stroke.
const SAME: f64 = 0.05;

/// A stroke with its force, and the cell that it makes where its load is known.
#[derive(Clone, Debug, PartialEq)]
pub struct Stroke {
    /// Velocity, m/s, signed.
    pub velocity_m_s: f64,
    /// Mean force of the drive, N, with the sign of the recording.
    pub force_n: f64,
    /// Load, viscosity and friction; `None` without a reference load.
    pub cell: Option<Cell>,
}

/// Strokes, and how many windows of the recording are in none for which reason.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Strokes {
    /// The strokes, in order of time.
    pub all: Vec<Stroke>,
    /// Windows left out.
    pub left_out: BTreeMap<&'static str, usize>,
    /// Length of the longest windows, s; `None` for a table, which is not cut.
    pub window_s: Option<f64>,
}

/// What a stroke needs that was not recorded.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Missing {
    /// The oil's viscosity falls with temperature, and there is none.
    #[error(
        "no column temperature_block_degc, which the oil's viscosity needs; give --viscosity CST for an oil at one temperature"
    )]
    Temperature,
    /// A reference load that the geometry has no load per ball for.
    #[error(
        "a reference load of {0} N is beyond what the balls of this guide can carry; check the unit and the sign of preload_n"
    )]
    Load(f64),
}

/// The strokes of a run. Without a guide they have a velocity and a force and no cell.
///
/// # Errors
/// [`Missing`].
pub fn of_run(run: &Run, guide: Option<&GuideSet>, settings: &Settings) -> Result<Strokes, Missing> {
    let cut = estimate::Settings { every_s: settings.every_s, ..estimate::Settings::default() };
    let mut strokes = Strokes::default();
    let mut open: Option<(Window, f64, Range<usize>)> = None;
    let mut close = |open: &mut Option<(Window, f64, Range<usize>)>| -> Result<(), Missing> {
        if let Some((window, reference, rows)) = open.take() {
            strokes.all.push(stroke(run, guide, settings, &window, reference, rows)?);
        }
        Ok(())
    };
    let mut left_out = BTreeMap::new();
    for window in windows(run, &cut, settings.zero_speed_m_s) {
        if let Some(reason) = window.reasons.iter().find(|r| *r != Reason::LoadOutOfRange) {
            *left_out.entry(reason.name()).or_default() += 1;
            close(&mut open)?;
            continue;
        }
        let reference = reference(run, window.rows.clone(), settings);
        let same = |a: f64, b: f64| (a - b).abs() <= SAME * b.abs().max(a.abs()) || (a.is_nan() && b.is_nan());
        match &mut open {
            Some((first, load, rows))
                if rows.end == window.rows.start
                    && same(first.speed_m_s, window.speed_m_s)
                    && (same(*load, reference) || (load.abs().max(reference.abs()) < UNLOADED_N))
                    && part(run, rows.start) == part(run, window.rows.start) =>
            {
                rows.end = window.rows.end;
            }
            _ => {
                close(&mut open)?;
                let rows = window.rows.clone();
                open = Some((window, reference, rows));
            }
        }
    }
    close(&mut open)?;
    strokes.left_out = left_out;
    strokes.window_s = run.parts.iter().map(|part| window_s(run, part, settings.every_s)).reduce(f64::max);
    Ok(strokes)
}

/// The strokes of a table: a row is the mean of one, or of several, at constant speed.
///
/// # Errors
/// [`Missing`].
pub fn of_table(table: &Table, guide: Option<&GuideSet>, settings: &Settings) -> Result<Strokes, Missing> {
    let column = |name: &str| table.column(name);
    let mut strokes = Strokes::default();
    let (Some(velocity), Some(force)) = (column("velocity_m_s"), column("drag_force_n")) else { return Ok(strokes) };
    let value = |name: &str, n: usize| column(name).map_or(f64::NAN, |c| c[n]);
    for n in 0..table.len() {
        if velocity[n] == 0.0 {
            *strokes.left_out.entry(Reason::NoMotion.name()).or_default() += 1;
            continue;
        }
        let reference = Some(value("preload_n", n)).filter(|x| x.is_finite()).or(settings.preload_n);
        let temperature = value("temperature_block_degc", n);
        // whole numbers up to 2^53 are exact
        let segment = Some(value("segment", n)).filter(|s| s.is_finite()).map(|s| s as i64);
        let mut cell =
            cell(guide, settings, velocity[n], force[n], reference.unwrap_or(f64::NAN), temperature, segment)?;
        if let Some(cell) = &mut cell {
            cell.sigma_n = value("drag_force_sigma_n", n);
        }
        strokes.all.push(Stroke { velocity_m_s: velocity[n], force_n: force[n], cell });
    }
    Ok(strokes)
}

fn stroke(
    run: &Run,
    guide: Option<&GuideSet>,
    settings: &Settings,
    first: &Window,
    reference: f64,
    rows: Range<usize>,
) -> Result<Stroke, Missing> {
    let mean = |column: &[f64]| column[rows.clone()].iter().sum::<f64>() / rows.len() as f64;
    let force_n = mean(&run.drag_force_n);
    let velocity_m_s = match (&run.velocity_m_s, &run.position_m) {
        (Some(velocity), _) => mean(velocity),
        (None, Some(x)) => {
            let last = rows.end - 1;
            (x[last] - x[rows.start]) / (run.time_s[last] - run.time_s[rows.start])
        }
        (None, None) => first.speed_m_s,
    };
    let temperature = run.temperature_block_degc.as_ref().map_or(f64::NAN, |c| finite_mean(&c[rows.clone()]));
    let segment = part(run, rows.start).and_then(|n| run.parts[n].segment);
    let cell = cell(guide, settings, velocity_m_s, force_n, reference, temperature, segment)?;
    Ok(Stroke { velocity_m_s, force_n, cell })
}

fn cell(
    guide: Option<&GuideSet>,
    settings: &Settings,
    velocity_m_s: f64,
    force_n: f64,
    reference_n: f64,
    temperature_degc: f64,
    segment: Option<i64>,
) -> Result<Option<Cell>, Missing> {
    let Some(set) = guide.filter(|_| reference_n.is_finite()) else { return Ok(None) };
    let viscosity_cst = match set.lubricant() {
        Lubricant::Constant(nu) => nu,
        Lubricant::Walther(oil) if temperature_degc.is_finite() => oil.viscosity_cst(temperature_degc),
        Lubricant::Walther(_) => return Err(Missing::Temperature),
    };
    let load = match settings.reference {
        _ if reference_n.abs() < UNLOADED_N => Some(0.0),
        Reference::Preload => set.exact().load_of_preload(reference_n),
        Reference::Lateral => set.exact().load_of_lateral_force(reference_n),
    };
    let direction = velocity_m_s.signum();
    Ok(Some(Cell {
        load_per_ball_n: load.ok_or(Missing::Load(reference_n))?,
        reference_n,
        viscosity_cst,
        speed_m_s: velocity_m_s.abs(),
        direction,
        has_seals: !segment.is_some_and(|s| settings.seals_off.contains(&s)),
        force_n: direction * force_n,
        sigma_n: f64::NAN,
    }))
}

/// Reference load of some rows, N: the mean of what was measured, else what is set; NaN where neither is.
fn reference(run: &Run, rows: Range<usize>, settings: &Settings) -> f64 {
    let measured = run.preload_n.as_ref().map_or(f64::NAN, |c| finite_mean(&c[rows]));
    if measured.is_finite() { measured } else { settings.preload_n.unwrap_or(f64::NAN) }
}

fn finite_mean(column: &[f64]) -> f64 {
    let (sum, count) =
        column.iter().filter(|x| x.is_finite()).fold((0.0, 0usize), |(sum, count), x| (sum + x, count + 1));
    sum / count as f64
}

fn part(run: &Run, row: usize) -> Option<usize> {
    run.parts.iter().position(|part| part.rows.contains(&row))
}
