//! Responses of a column of simulated force to its program's own assumptions.
//!
//! A program known only by its column assumed a viscosity and a preload, both within a tolerance. Friction of
//! lubricated contacts depends on viscosity `η`, speed `V` and preload `Q` through the Hersey number `η V / p`, with
//! Hertz's `p ~ Q^(1/3)`, and is otherwise proportional to the load:
//!
//! ```text
//! dF/d ln η = dF/d ln V
//! dF/d ln Q = F - (1/3) dF/d ln V
//! ```
//!
//! This holds for the Hersey number with the speed of the carriage. With the slip speed in the contacts, which grow
//! with the load, the third has the opposite sign, and a program with one convention looks like one with the other and
//! another viscosity.
//!
//! The curve over speed is the column's own, taken within one part of the profile, where the preload is constant. What
//! varies with the acceleration within a cell of speed is the program's inertia; neither factor scales it.

use std::ops::Range;

use super::Factors;
use crate::motion::Motion;
use crate::run::Run;

/// Error of a force known only by its column, as a share of its change with viscosity or preload, where contacts are
/// not purely Hertzian: for example where preload changes the contact angle.
pub const ERROR_OF_COLUMN: f64 = 0.05;

/// Width of a cell of speed, in ln V.
const CELL: f64 = 0.05;

/// Cells to either side that a slope is fitted over.
const REACH: usize = 4;

/// Largest change of an acceleration within its window, as a share of its largest value, that counts as hardly any.
const EVEN: f64 = 0.2;

/// Least share of the scatter within cells of speed that must vary with the acceleration to be an inertia.
const IS_INERTIA: f64 = 0.5;

/// Force of the program, N, had it assumed another friction, preload and viscosity, and the inertia in it, N. Without a
/// `preload_n` column, changing the preload has no effect.
pub(super) fn changed(
    run: &Run,
    force: &[f64],
    motion: &Motion,
    direction: &[f64],
    factors: &Factors,
) -> (Vec<f64>, Vec<f64>) {
    let (velocity, acceleration) = (&motion.velocity_m_s, &motion.acceleration_m_s2);
    let parts: Vec<Part> =
        run.profile_parts().into_iter().map(|rows| Part::of(rows, velocity, force, direction)).collect();
    let mass = mass(&parts, (acceleration, direction), force, &is_even(motion, run));
    let inertia: Vec<f64> = acceleration.iter().map(|a| if mass == 0.0 { 0.0 } else { mass * a }).collect();
    if *factors == Factors::default() {
        return (force.to_vec(), inertia);
    }
    let preload = if run.preload_n.is_some() { factors.preload } else { 1.0 };
    let gain = factors.friction * preload;
    let shift = libm::log(factors.viscosity) - libm::log(preload) / 3.0;
    let mut out: Vec<f64> = force.to_vec();
    for part in &parts {
        let curve = Curve::of(part, |n| direction[n] * (force[n] - inertia[n]), velocity);
        for (n, cell) in part.sorted.iter().zip(part.cell_of()) {
            let moved = direction[*n] * curve.step(cell, velocity[*n].abs().ln(), shift);
            out[*n] = inertia[*n] + gain * (force[*n] - inertia[*n] + moved);
        }
    }
    (out, inertia)
}

/// Rows of a part, sorted by speed and divided into cells of speed.
struct Part {
    sorted: Vec<usize>,
    /// Index into `sorted` of every cell's first entry, and the end.
    bounds: Vec<usize>,
}

impl Part {
    fn of(rows: Range<usize>, velocity: &[f64], force: &[f64], direction: &[f64]) -> Self {
        let told = |n: usize| direction[n] != 0.0 && velocity[n] != 0.0 && force[n].is_finite();
        let mut keyed: Vec<(i32, usize)> =
            rows.filter(|n| told(*n)).map(|n| ((velocity[n].abs().ln() / CELL).floor() as i32, n)).collect();
        keyed.sort_unstable();
        let mut bounds: Vec<usize> =
            (0..keyed.len()).filter(|at| *at == 0 || keyed[*at].0 != keyed[at - 1].0).collect();
        bounds.push(keyed.len());
        Part { sorted: keyed.into_iter().map(|(_, n)| n).collect(), bounds }
    }

    fn cells(&self) -> impl Iterator<Item = &[usize]> {
        self.bounds.windows(2).map(|pair| &self.sorted[pair[0]..pair[1]])
    }

    /// Cell of every entry of `sorted`.
    fn cell_of(&self) -> impl Iterator<Item = usize> {
        self.bounds.windows(2).enumerate().flat_map(|(cell, pair)| std::iter::repeat_n(cell, pair[1] - pair[0]))
    }
}

/// Rows around which the acceleration hardly changes: at corners of the speed a derived acceleration is wrong. All rows
/// where those are few.
fn is_even(motion: &Motion, run: &Run) -> Vec<bool> {
    let (a, reach) = (&motion.acceleration_m_s2, motion.acceleration_reach);
    let largest = a.iter().map(|a| a.abs()).filter(|a| a.is_finite()).fold(0.0, f64::max);
    let mut even = vec![false; a.len()];
    for rows in run.part_rows() {
        for n in rows.start + reach..rows.end.saturating_sub(reach) {
            even[n] = (a[n + reach] - a[n - reach]).abs() < EVEN * largest;
        }
    }
    let count = even.iter().filter(|even| **even).count();
    if 2 * count < even.len() { vec![true; even.len()] } else { even }
}

/// Mass whose inertia the column contains, kg.
fn mass(parts: &[Part], (acceleration, direction): (&[f64], &[f64]), force: &[f64], even: &[bool]) -> f64 {
    let (mut aa, mut ay, mut yy) = (0.0, 0.0, 0.0);
    for cell in parts.iter().flat_map(Part::cells) {
        let cell: Vec<usize> = cell.iter().copied().filter(|n| even[*n]).collect();
        let count = cell.len().max(1) as f64;
        let mean = |of: &dyn Fn(usize) -> f64| cell.iter().map(|n| of(*n)).sum::<f64>() / count;
        let (a, y) = (|n: usize| direction[n] * acceleration[n], |n: usize| direction[n] * force[n]);
        let (a0, y0) = (mean(&a), mean(&y));
        for n in cell {
            let (a, y) = (a(n) - a0, y(n) - y0);
            (aa, ay, yy) = (aa + a * a, ay + a * y, yy + y * y);
        }
    }
    if aa > 0.0 && ay * ay > IS_INERTIA * aa * yy { ay / aa } else { 0.0 }
}

/// Friction over ln V, cell by cell.
struct Curve {
    points: Vec<(f64, f64)>,
    slopes: Vec<f64>,
}

impl Curve {
    fn of(part: &Part, friction: impl Fn(usize) -> f64, velocity: &[f64]) -> Self {
        let points: Vec<(f64, f64)> = part
            .cells()
            .map(|cell| {
                let count = cell.len() as f64;
                let x = cell.iter().map(|n| velocity[*n].abs().ln()).sum::<f64>() / count;
                (x, cell.iter().map(|n| friction(*n)).sum::<f64>() / count)
            })
            .collect();
        let slopes = (0..points.len()).map(|at| slope(&points, at)).collect();
        Curve { points, slopes }
    }

    /// Change over a step of ln V from a point in a cell: the mean of the slopes at both ends is exact for a parabola.
    fn step(&self, cell: usize, x: f64, step: f64) -> f64 {
        0.5 * (self.slope_at(cell, x) + self.slope_at(cell, x + step)) * step
    }

    /// Slope at a point, interpolated between the two neighbouring cells and constant beyond the outermost; the search
    /// for them starts at `cell`.
    fn slope_at(&self, cell: usize, x: f64) -> f64 {
        let mut below = cell;
        while below + 1 < self.points.len() && self.points[below + 1].0 <= x {
            below += 1;
        }
        while below > 0 && self.points[below].0 > x {
            below -= 1;
        }
        let above = (below + 1).min(self.points.len() - 1);
        let width = self.points[above].0 - self.points[below].0;
        let share = if width > 0.0 { ((x - self.points[below].0) / width).clamp(0.0, 1.0) } else { 0.0 };
        self.slopes[below] + share * (self.slopes[above] - self.slopes[below])
    }
}

/// Slope of the parabola through the cells around one.
fn slope(points: &[(f64, f64)], at: usize) -> f64 {
    let around = &points[at.saturating_sub(REACH)..(at + REACH + 1).min(points.len())];
    let (x0, y0) = points[at];
    let (mut s, mut m) = ([0.0; 5], [0.0; 3]);
    for (x, y) in around {
        let (x, y) = (x - x0, y - y0);
        for (k, power) in [1.0, x, x * x, x * x * x, x * x * x * x].into_iter().enumerate() {
            s[k] += power;
        }
        m = [m[0] + y, m[1] + x * y, m[2] + x * x * y];
    }
    let c = [s[2] * s[4] - s[3] * s[3], s[1] * s[4] - s[2] * s[3], s[1] * s[3] - s[2] * s[2]];
    let determinant = s[0] * c[0] - s[1] * c[1] + s[2] * c[2];
    if around.len() > 4 && determinant > 1e-12 {
        let d = [s[0] * s[4] - s[2] * s[2], s[0] * s[3] - s[1] * s[2]];
        return (-c[1] * m[0] + d[0] * m[1] - d[1] * m[2]) / determinant;
    }
    let line = s[0] * s[2] - s[1] * s[1];
    if line > 1e-12 { (s[0] * m[1] - s[1] * m[0]) / line } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Simulation;
    use crate::profile::{Conditions, Order, Staircase};
    use crate::run::{Break, Part};

    #[test]
    fn gains_move_the_friction_and_not_the_inertia() {
        let rows = 4000;
        let velocity: Vec<f64> = (0..rows).map(|n| 0.3 * (n as f64 * 0.01).sin()).collect();
        let law = |v: f64| v.signum() * (3.0 + 5.0 * v.abs() + 2.0 * (-v.abs() / 0.02).exp());
        let force: Vec<f64> = velocity.iter().map(|v| law(*v)).collect();
        let direction: Vec<f64> = velocity.iter().map(|v| if v.abs() < 1e-3 { 0.0 } else { v.signum() }).collect();
        let run = Run {
            time_s: (0..rows).map(|n| n as f64 * 0.01).collect(),
            drag_force_n: force.clone(),
            parts: vec![Part { rows: 0..rows, segment: None, starts: Break::Start }],
            ..Run::default()
        };
        let acceleration: Vec<f64> = (0..rows).map(|n| ((n * 7919) % 101) as f64 * 0.01 - 0.5).collect();
        let heavy: Vec<f64> = force.iter().zip(&acceleration).map(|(f, a)| f + 20.0 * a).collect();
        let factors = Factors { friction: 1.1, viscosity: 1.1, ..Factors::default() };
        let motion = Motion {
            position_m: vec![0.0; rows],
            velocity_m_s: velocity.clone(),
            acceleration_m_s2: acceleration.clone(),
            reach: 1,
            acceleration_reach: 2,
            has_position: false,
        };
        let (told, _) = changed(&run, &heavy, &motion, &direction, &factors);
        for n in (0..rows).filter(|n| velocity[*n].abs() > 0.01) {
            let v = velocity[n].abs();
            let exact = velocity[n].signum() * 1.1 * (3.0 + 5.5 * v + 2.0 * (-1.1 * v / 0.02).exp());
            let found = told[n] - 20.0 * acceleration[n];
            assert!((found - exact).abs() < 0.02, "{v}: {found} for {exact}");
        }
    }

    /// Error of the force change when preload or viscosity changes, relative to that change: the paper's own law, known
    /// only by its column, at preloads over a decade.
    #[test]
    fn a_column_errs_by_a_few_hundredths_of_a_change() {
        let mut worst = 0.0f64;
        for preload_n in [500.0, 1500.0, 4500.0, 9000.0] {
            let text = format!(
                "schema = \"guideblock.simulation/1\"\n[guide]\nparameters = \"zhou-2023\"\n[lubricant]\n\
                 viscosity_cst = 100.0\n[operation]\npreload_n = {preload_n:?}\n"
            );
            let simulation = Simulation::from_toml(&text).expect("sound");
            let conditions = Conditions { preload_n: Some(preload_n), ..Conditions::default() };
            let speeds_m_s = vec![0.003, 0.006, 0.012, 0.025, 0.05, 0.1];
            let staircase = Staircase { speeds_m_s, order: Order::Both, ..Staircase::default() };
            let course = staircase.course(200.0, &conditions).expect("legal");
            let (run, motion) = (&course.run, &course.motion);
            let law = |factors: &Factors| simulation.steady(factors, run, motion).expect("complete");
            let given = law(&Factors::default());
            for (preload, viscosity) in [(0.05, 0.0), (0.0, 0.05)] {
                let factors = Factors { preload: 1.0 + preload, viscosity: 1.0 + viscosity, ..Factors::default() };
                let exact = law(&factors).force_n;
                let (told, _) = changed(run, &given.force_n, motion, &given.direction, &factors);
                let moves = |n: &usize| given.direction[*n] != 0.0 && motion.acceleration_m_s2[*n].abs() < 1e-3;
                let rms = |of: &dyn Fn(usize) -> f64| {
                    let squares: Vec<f64> = (0..run.len()).filter(moves).map(|n| of(n) * of(n)).collect();
                    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
                };
                let share = rms(&|n| told[n] - exact[n]) / rms(&|n| exact[n] - given.force_n[n]);
                println!("{preload_n} N, preload {preload}, viscosity {viscosity}: {share:.3}");
                worst = worst.max(share);
            }
        }
        assert!(worst < ERROR_OF_COLUMN, "{worst}");
    }
}
