//! Mismatch (measured less simulated) over every axis on which it can be located, bin by bin, before and after.

use simulation::Simulation;
use simulation::law::Missing;
use simulation::mechanism::Context;
use simulation::motion::Motion;
use simulation::run::Run;
use simulation::session::joined;

/// Bins of an axis.
const BINS: usize = 60;

/// Fewest rows of a bin that is shown.
const FEWEST: usize = 8;

/// A stretch of an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bin {
    /// Its middle, in the unit of the axis.
    pub at: f64,
    /// Mean mismatch of the simulation as given, N; NaN where the file leaves numbers to be fitted.
    pub before_n: f64,
    /// Mean mismatch with what was found, N.
    pub after_n: f64,
    /// Scatter of the remaining mismatch, 1 σ of a row, N.
    pub scatter_n: f64,
}

/// An axis with its bins.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisView {
    /// Name, as in a diagnosis.
    pub axis: &'static str,
    /// Unit.
    pub unit: &'static str,
    /// In rising order.
    pub bins: Vec<Bin>,
}

/// Name, unit, whether it is counted against the motion, and the value of a row.
type Column = (&'static str, &'static str, fn(&Context<'_>, usize) -> f64);

/// The axes that have a value in every row; those of waves and frequencies have none.
const AXES: [Column; 12] = [
    ("velocity", "m/s", |c, n| c.motion.velocity_m_s[n].abs()),
    ("direction", "", |c, n| c.direction[n]),
    ("position", "m", |c, n| if c.motion.has_position { c.motion.position_m[n] } else { f64::NAN }),
    ("time", "s", |c, n| c.run.time_s[n] - c.run.time_s[0]),
    ("travel", "m", |c, n| c.travel_m[n]),
    ("acceleration", "m/s²", |c, n| c.motion.acceleration_m_s2[n]),
    // a part that starts in motion has no reversal before it
    ("reversal-distance", "m", |c, n| if c.since_reversal_m[n] < 0.02 { c.since_reversal_m[n] } else { f64::NAN }),
    ("dwell", "s", |c, n| if c.dwell_s[n] > 0.0 && c.since_reversal_m[n] < 0.002 { c.dwell_s[n] } else { f64::NAN }),
    ("preload", "N", |c, n| c.steady.preload_n.get(n).copied().unwrap_or(f64::NAN)),
    ("load", "N", |c, n| c.run.external_load_n.as_ref().map_or(f64::NAN, |x| x[n])),
    ("temperature", "°C", |c, n| c.run.temperature_block_degc.as_ref().map_or(f64::NAN, |x| x[n])),
    ("temperature-difference", "K", |c, n| match (&c.run.temperature_block_degc, &c.run.temperature_rail_degc) {
        (Some(block), Some(rail)) => block[n] - rail[n],
        _ => f64::NAN,
    }),
];

/// Axes along which missing friction would change its sign with the direction: there the mismatch is counted against
/// the motion.
const ODD: [&str; 7] = ["velocity", "travel", "time", "reversal-distance", "dwell", "preload", "temperature"];

/// The mismatch of all runs over every axis that varies.
///
/// # Errors
/// [`Missing`] where the augmented simulation has no value for a run.
pub fn views(runs: &[Run], given: &Simulation, augmented: &Simulation) -> Result<Vec<AxisView>, Missing> {
    let mut rows: Vec<Vec<(f64, f64, f64, f64)>> = vec![Vec::new(); AXES.len()];
    let session = joined(given, runs);
    for run in session.as_deref().unwrap_or(runs) {
        let motion = Motion::of(run);
        let after = augmented.force(run, &motion)?;
        // a file that leaves its law to be fitted has no force by itself
        let before = given.force(run, &motion).unwrap_or_else(|_| vec![f64::NAN; run.len()]);
        let context = Context::of(augmented, run, &motion)?;
        for n in (0..run.len()).filter(|n| !context.at_rest[*n] && after[*n].is_finite()) {
            let measured = run.drag_force_n[n];
            let (b, a) = (measured - before[n], measured - after[n]);
            for ((_, _, of), rows) in AXES.iter().zip(&mut rows) {
                let x = of(&context, n);
                if x.is_finite() {
                    rows.push((x, b, a, context.direction[n]));
                }
            }
        }
    }
    let view = |((axis, unit, _), rows): (&Column, Vec<(f64, f64, f64, f64)>)| {
        let bins = binned(&rows, ODD.contains(axis));
        (bins.len() > 1).then_some(AxisView { axis, unit, bins })
    };
    Ok(AXES.iter().zip(rows).filter_map(view).collect())
}

fn binned(rows: &[(f64, f64, f64, f64)], is_odd: bool) -> Vec<Bin> {
    let (low, high) = rows.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), row| (a.min(row.0), b.max(row.0)));
    let width = (high - low) / BINS as f64;
    if width.is_nan() || width <= 0.0 {
        return Vec::new();
    }
    let mut sums = vec![[0.0; 5]; BINS];
    for (x, before, after, direction) in rows {
        let sign = if is_odd { *direction } else { 1.0 };
        // the last bin holds its end, too
        let bin = (((x - low) / width) as usize).min(BINS - 1);
        let (b, a) = (sign * before, sign * after);
        for (sum, x) in sums[bin].iter_mut().zip([1.0, *x, b, a, a * a]) {
            *sum += x;
        }
    }
    sums.iter()
        .filter(|s| s[0] >= FEWEST as f64)
        .map(|[count, x, before, after, square]| Bin {
            at: x / count,
            before_n: before / count,
            after_n: after / count,
            scatter_n: (square / count - (after / count).powi(2)).max(0.0).sqrt(),
        })
        .collect()
}
