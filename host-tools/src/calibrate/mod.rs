//! A friction law from strokes at known load, or over the speed alone, and the reports about it.
//!
//! ```text
//! recordings -> strokes -> cells (load, viscosity, speed, force)
//!     -> both conventions fitted -> the better one -> difference of the directions taken off -> fitted again
//!     -> doubts, pattern in the residuals -> guide file, parameter record of the block
//! ```

mod axis_words;
mod constants;
mod guide_words;
mod page;
mod products;
pub mod strokes;

use calibration::cell::Cell;
use calibration::convention::Comparison;
use calibration::direction::{Asymmetry, BELIEVED};
use calibration::doubts::{Doubt, doubts};
use calibration::fit::{FrictionFit, NoFit, Seals};
use calibration::lack_of_fit;
use calibration::levels::levels;
use model_core::contact::HerseySpeed;
use simulation::guide::GuideSet;

pub use axis_words::{describe as describe_axis, object as axis_object};
pub use constants::Constant;
pub use guide_words::{describe as describe_guide, doubts as guide_doubts, object as guide_object};
pub use page::{axis as axis_page, guide as guide_page};
pub use products::{Unfit, axis_file, guide_file, record};

/// Kind of reference load of a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reference {
    /// Preload, Eq. 1.
    Preload,
    /// Lateral force on a split block, Eq. 2.
    Lateral,
}

/// How recordings are read. SI units.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Length of the windows in which strokes are searched for, s; longer where a window would hold too few rows.
    pub every_s: f64,
    /// Speed below which the carriage counts as standing, m/s.
    pub zero_speed_m_s: f64,
    /// What `preload_n` is.
    pub reference: Reference,
    /// Reference load where a recording has none, N.
    pub preload_n: Option<f64>,
    /// Segments that were measured without seals.
    pub seals_off: Vec<i64>,
    /// A constant drag of the seals is fitted even where no stroke shows it alone.
    pub fits_seals: bool,
    /// The convention to use; where there is none the strokes decide, or the guide's own where they cannot.
    pub convention: Option<HerseySpeed>,
}

/// A calibrated guide.
#[derive(Clone, Debug)]
pub struct Calibration {
    /// The guide as it was given, under the convention that is used. Its constants are not yet the fitted ones.
    pub set: GuideSet,
    /// The fit that counts.
    pub fit: FrictionFit,
    /// Its constants with their intervals.
    pub constants: Vec<Constant>,
    /// The cells that were fitted; the difference of the directions is taken off.
    pub cells: Vec<Cell>,
    /// Which drag of the seals was fitted along.
    pub seals: Seals,
    /// Deviance with carriage speed less that with slip; positive supports slip.
    pub convention_difference: f64,
    /// The convention that the strokes support; `None` where they cannot tell.
    pub decision: Option<HerseySpeed>,
    /// Difference of the directions; `None` where only one was measured.
    pub asymmetry: Option<Asymmetry>,
    /// The fits of either direction alone (+1, -1), where there are enough strokes.
    pub directions: Vec<(f64, FrictionFit)>,
    /// What the strokes leave open.
    pub doubts: Vec<Doubt>,
    /// Probability of the pattern in the residuals; `None` where no stroke was repeated.
    pub pattern: Option<f64>,
    /// The strokes by load, speed and direction.
    pub grid: Vec<GridCell>,
}

/// All strokes of one load, speed and direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GridCell {
    /// Reference load, N.
    pub reference_n: f64,
    /// Speed, m/s.
    pub speed_m_s: f64,
    /// Direction, -1 or 1.
    pub direction: f64,
    /// Hersey number.
    pub hersey: f64,
    /// Strokes.
    pub strokes: usize,
    /// Mean friction coefficient, Eq. 7, the seals' drag taken off where it was fitted.
    pub friction: f64,
    /// Its standard deviation.
    pub friction_sigma: f64,
    /// Mean residual over its standard deviation.
    pub residual: f64,
}

impl Calibration {
    /// Whether the difference of the directions is significant, and was taken off.
    pub fn is_asymmetric(&self) -> bool {
        self.asymmetry.is_some_and(|a| a.p_value < BELIEVED)
    }
}

/// Calibrates a guide.
///
/// # Errors
/// [`NoFit`].
pub fn calibrate(cells: &[Cell], set: &GuideSet, settings: &Settings) -> Result<Calibration, NoFit> {
    let seals = seals(cells, settings);
    let comparison = Comparison::of(cells, set, seals)?;
    let decision = comparison.decision();
    let convention = settings.convention.or(decision).unwrap_or(set.exact().guide().hersey_speed);
    let (set, mut fit) = comparison.under(convention).clone();
    let mut cells = cells.to_vec();
    let asymmetry = Asymmetry::of(&cells, &fit);
    if let Some(found) = asymmetry.filter(|a| a.p_value < BELIEVED) {
        cells = found.taken_off(&cells);
        fit = FrictionFit::of(&cells, set.exact(), set.hersey_scale(), seals)?;
    }
    let directions = [1.0, -1.0]
        .into_iter()
        .filter_map(|d| {
            let own: Vec<Cell> = cells.iter().copied().filter(|c| c.direction == d).collect();
            (own.len() < cells.len()).then_some(())?;
            FrictionFit::of(&own, set.exact(), set.hersey_scale(), seals).ok().map(|fit| (d, fit))
        })
        .collect();
    let (grid, groups) = grid(&cells, &fit, &set);
    let normed: Vec<f64> = fit.residuals_n.iter().zip(&fit.sigmas_n).map(|(e, s)| e / s).collect();
    Ok(Calibration {
        doubts: doubts(&cells, &fit),
        pattern: lack_of_fit::p_value(&normed, &groups, fit.covariance.nrows()),
        convention_difference: comparison.difference(),
        set,
        constants: constants::constants(&fit),
        fit,
        cells,
        seals,
        decision,
        asymmetry,
        directions,
        grid,
    })
}

/// Which drag of the seals strokes without load or without seals can show.
fn seals(cells: &[Cell], settings: &Settings) -> Seals {
    let is_loaded = |c: &&Cell| c.load_per_ball_n > 0.0;
    if cells.iter().all(|c| !c.has_seals) {
        return Seals::TakenOff;
    }
    let alone: Vec<f64> =
        cells.iter().filter(|c| c.has_seals && c.load_per_ball_n == 0.0).map(|c| c.speed_m_s).collect();
    let bare: Vec<f64> = cells.iter().filter(is_loaded).filter(|c| !c.has_seals).map(|c| c.speed_m_s).collect();
    match levels(if alone.len() >= bare.len() { &alone } else { &bare }).1.len() {
        0 if settings.fits_seals => Seals::Constant,
        0 => Seals::TakenOff,
        1 | 2 => Seals::Constant,
        _ => Seals::WithSpeed,
    }
}

/// The strokes by load, speed and direction, and the number of the group of every stroke.
fn grid(cells: &[Cell], fit: &FrictionFit, set: &GuideSet) -> (Vec<GridCell>, Vec<usize>) {
    let loads = levels(&cells.iter().map(|c| c.reference_n).collect::<Vec<_>>()).0;
    let speeds = levels(&cells.iter().map(|c| c.speed_m_s).collect::<Vec<_>>()).0;
    let key = |n: usize| (loads[n], speeds[n], cells[n].direction > 0.0, cells[n].has_seals);
    let mut members: std::collections::BTreeMap<_, Vec<usize>> = std::collections::BTreeMap::new();
    for n in 0..cells.len() {
        members.entry(key(n)).or_default().push(n);
    }
    let mut groups = vec![0; cells.len()];
    let mut all = Vec::with_capacity(members.len());
    for (number, rows) in members.values().enumerate() {
        for n in rows {
            groups[*n] = number;
        }
        let count = rows.len() as f64;
        let mean = |of: &dyn Fn(usize) -> f64| rows.iter().map(|n| of(*n)).sum::<f64>() / count;
        let load = mean(&|n| cells[n].load_per_ball_n);
        let normal = set.exact().guide().loaded_balls() * load;
        let seal = |n: usize| {
            let worn = f64::from(u8::from(cells[n].has_seals));
            worn * (fit.seal_drag_n.unwrap_or(0.0) + fit.seal_viscous_n_s_m.unwrap_or(0.0) * cells[n].speed_m_s)
        };
        let sigma = mean(&|n| fit.sigmas_n[n]) / count.sqrt();
        all.push(GridCell {
            reference_n: mean(&|n| cells[n].reference_n),
            speed_m_s: mean(&|n| cells[n].speed_m_s),
            direction: cells[rows[0]].direction,
            hersey: mean(&|n| cells[n].hersey(set.exact(), set.hersey_scale())),
            strokes: rows.len(),
            friction: mean(&|n| cells[n].force_n - seal(n)) / normal,
            friction_sigma: sigma / normal,
            residual: mean(&|n| fit.residuals_n[n]) / sigma,
        });
    }
    (all, groups)
}
