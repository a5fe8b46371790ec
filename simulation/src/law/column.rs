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
//! varies with the acceleration within a cell of speed is the program's inertia; neither of the two scales it. Where the
//! acceleration is doubtful, at corners of a machine's moves, inertia is what the force has beyond that curve.

mod curve;

use std::ops::Range;

use super::Factors;
use crate::motion::{Corner, Motion};
use crate::run::Run;

use curve::{Point, Smooth, smooth};

/// Error of a force known only by its column, as a share of its change with viscosity or preload, where contacts are
/// not purely Hertzian: for example where preload changes the contact angle.
pub const ERROR_OF_COLUMN: f64 = 0.05;

/// Width of a cell of speed, in ln V.
const CELL: f64 = 0.05;

/// Error of velocity and acceleration at a corner, relative to the velocity and the largest acceleration, with which a
/// row still tells of inertia.
const TOLD: f64 = 0.03;

/// Change of friction with ln V that is reckoned with at corners of the speed, relative to the friction.
const STEEP: f64 = 0.3;

/// Change of friction, relative to the friction, where the speed may be all error: the row rests or has turned, and
/// friction is off by once or twice itself.
const AT_REST: f64 = 3.0;

/// Error of a row's friction that counts as none, relative to the friction.
const EXACT: f64 = 3e-4;

/// Error of a row's friction from which its curve tells that better, relative to the friction on the curve.
const DOUBTFUL: f64 = 0.01;

/// Weight of a row of whose friction nothing is known, 1/N².
const UNKNOWN: f64 = 1e-100;

/// Least share of the scatter within cells of speed that must vary with the acceleration to be an inertia.
const IS_INERTIA: f64 = 0.5;

/// Friction of a force without its inertia, N, positive against the motion. At rest, where a column does not contain it,
/// that of the row of its part that moved last, or first where the part begins at rest; 0 in a part without motion.
pub(super) fn drag(run: &Run, friction_n: impl Iterator<Item = f64>, direction: &[f64]) -> Vec<f64> {
    let mut drag: Vec<f64> = friction_n.zip(direction).map(|(friction, sign)| friction * sign).collect();
    for rows in run.profile_parts() {
        let moves = |n: &usize| direction[*n] != 0.0;
        let mut last = rows.clone().find(moves).map_or(0.0, |n| drag[n]);
        for n in rows {
            if moves(&n) {
                last = drag[n];
            } else {
                drag[n] = last;
            }
        }
    }
    drag
}

/// Force of the program, N, had it assumed another friction, preload and viscosity, and the inertia in it, N. Without a
/// `preload_n` column, changing the preload has no effect.
pub(super) fn changed(
    run: &Run,
    force: &[f64],
    motion: &Motion,
    direction: &[f64],
    factors: &Factors,
) -> (Vec<f64>, Vec<f64>) {
    let (velocity, acceleration) = (&motion.sharp_velocity(run), &motion.acceleration_m_s2);
    let corners = motion.corners(run);
    let parts: Vec<Part> =
        run.profile_parts().into_iter().map(|rows| Part::of(rows, velocity, force, direction)).collect();
    let mass = mass(&parts, velocity, (acceleration, direction), force, &corners);
    if mass == 0.0 && *factors == Factors::default() {
        return (force.to_vec(), vec![0.0; force.len()]);
    }
    let mut inertia: Vec<f64> = acceleration.iter().map(|a| if mass == 0.0 { 0.0 } else { mass * a }).collect();
    let preload = if run.preload_n.is_some() { factors.preload } else { 1.0 };
    let gain = factors.friction * preload;
    let shift = libm::log(factors.viscosity) - libm::log(preload) / 3.0;
    let mut out: Vec<f64> = force.to_vec();
    for part in &parts {
        let friction = |n: usize| direction[n] * (force[n] - inertia[n]);
        let curve = Curve::of(part, velocity, friction, |n| off(&corners[n], velocity[n], mass));
        for (n, cell) in part.sorted.iter().zip(part.cell_of()) {
            let ln_v = velocity[*n].abs().ln();
            let usual = curve.value_at(cell, ln_v);
            if mass.abs() * corners[*n].acceleration_m_s2 > DOUBTFUL * usual.abs() {
                inertia[*n] = force[*n] - direction[*n] * usual;
            }
            let moved = direction[*n] * curve.step(cell, ln_v, shift);
            out[*n] = factors.mass * inertia[*n] + gain * (force[*n] - inertia[*n] + moved);
            inertia[*n] *= factors.mass;
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

/// Mass whose inertia the column contains, kg; found without the rows at corners, where derived motion is wrong.
fn mass(
    parts: &[Part],
    velocity: &[f64],
    (acceleration, direction): (&[f64], &[f64]),
    force: &[f64],
    corners: &[Corner],
) -> f64 {
    let largest = acceleration.iter().map(|a| a.abs()).filter(|a| a.is_finite()).fold(0.0, f64::max);
    let is_told = |n: &usize| {
        corners[*n].velocity_m_s < TOLD * velocity[*n].abs() && corners[*n].acceleration_m_s2 <= TOLD * largest
    };
    let (mut aa, mut ay, mut yy) = (0.0, 0.0, 0.0);
    for cell in parts.iter().flat_map(Part::cells) {
        let cell: Vec<usize> = cell.iter().copied().filter(is_told).collect();
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

/// How far the friction of a row may be off its curve: over ln V, and in N.
fn off(corner: &Corner, velocity_m_s: f64, mass: f64) -> (f64, f64) {
    let (velocity, inertia) = (corner.velocity_m_s / velocity_m_s.abs(), mass.abs() * corner.acceleration_m_s2);
    (velocity, if mass == 0.0 { 0.0 } else { inertia })
}

/// Friction over ln V, cell by cell.
struct Curve {
    points: Vec<Point>,
    smooth: Vec<Smooth>,
}

impl Curve {
    /// Of one part; `off` says how far a row may be off the curve, over ln V and in N.
    fn of(part: &Part, velocity: &[f64], friction: impl Fn(usize) -> f64, off: impl Fn(usize) -> (f64, f64)) -> Self {
        let square = part.sorted.iter().map(|n| friction(*n).powi(2)).sum::<f64>() / part.sorted.len().max(1) as f64;
        let exact = (EXACT * EXACT * square).max(f64::EPSILON * f64::EPSILON);
        let weight = |n: usize| {
            let (over_ln_v, force) = off(n);
            let share = STEEP * over_ln_v + AT_REST * over_ln_v * over_ln_v;
            // never 0: a cell of such rows alone has a mean, too
            (1.0 / (exact + square * share * share + force * force)).max(UNKNOWN)
        };
        let point = |cell: &[usize]| {
            let sum: f64 = cell.iter().map(|n| weight(*n)).sum();
            let mean = |of: &dyn Fn(usize) -> f64| cell.iter().map(|n| weight(*n) * of(*n)).sum::<f64>() / sum;
            // errors at corners are alike in all rows of a cell: more of them are no better than one
            let variance = (cell.len() as f64 / sum - exact).max(0.0);
            Point { x: mean(&|n| velocity[n].abs().ln()), y: mean(&friction), variance }
        };
        let points: Vec<Point> = part.cells().map(point).collect();
        let smooth = smooth(&points);
        Curve { points, smooth }
    }

    /// Change over a step of ln V from a point in a cell: the mean of the slopes at both ends is exact for a parabola.
    fn step(&self, cell: usize, x: f64, step: f64) -> f64 {
        0.5 * (self.slope_at(cell, x) + self.slope_at(cell, x + step)) * step
    }

    /// Slope at a point, interpolated between the two neighbouring cells and constant beyond the outermost; the search
    /// for them starts at `cell`.
    fn slope_at(&self, cell: usize, x: f64) -> f64 {
        self.between(cell, x, |smooth| smooth.slope)
    }

    /// Friction at a point, in the same way, N.
    fn value_at(&self, cell: usize, x: f64) -> f64 {
        self.between(cell, x, |smooth| smooth.y)
    }

    fn between(&self, cell: usize, x: f64, of: impl Fn(&Smooth) -> f64) -> f64 {
        let mut below = cell;
        while below + 1 < self.points.len() && self.points[below + 1].x <= x {
            below += 1;
        }
        while below > 0 && self.points[below].x > x {
            below -= 1;
        }
        let above = (below + 1).min(self.points.len() - 1);
        let width = self.points[above].x - self.points[below].x;
        let share = if width > 0.0 { ((x - self.points[below].x) / width).clamp(0.0, 1.0) } else { 0.0 };
        let (below, above) = (of(&self.smooth[below]), of(&self.smooth[above]));
        below + share * (above - below)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Simulation;
    use crate::profile::{Conditions, Course, Order, Staircase};
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

    fn zhou(preload_n: f64) -> (Simulation, Conditions) {
        let text = format!(
            "schema = \"guideblock.simulation/1\"\n[guide]\nparameters = \"zhou-2023\"\n[lubricant]\n\
             viscosity_cst = 100.0\n[operation]\npreload_n = {preload_n:?}\n"
        );
        let conditions = Conditions { preload_n: Some(preload_n), ..Conditions::default() };
        (Simulation::from_toml(&text).expect("sound"), conditions)
    }

    fn rms_where(moves: impl Fn(usize) -> bool, of: &[f64]) -> f64 {
        let squares: Vec<f64> = (0..of.len()).filter(|n| moves(*n)).map(|n| of[n] * of[n]).collect();
        (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
    }

    fn difference(a: &[f64], b: &[f64]) -> Vec<f64> {
        a.iter().zip(b).map(|(a, b)| a - b).collect()
    }

    /// Error of the force change when preload or viscosity changes, relative to that change: the paper's own law, known
    /// only by its column, at preloads over a decade.
    #[test]
    fn a_column_errs_by_a_few_hundredths_of_a_change() {
        let mut worst = 0.0f64;
        for preload_n in [500.0, 1500.0, 4500.0, 9000.0] {
            let (simulation, conditions) = zhou(preload_n);
            let speeds_m_s = vec![0.003, 0.006, 0.012, 0.025, 0.05, 0.1];
            let staircase = Staircase { speeds_m_s, order: Order::Both, ..Staircase::default() };
            let course = staircase.course(200.0, &conditions).expect("legal");
            let (run, motion) = (&course.run, &course.motion);
            let law = |factors: &Factors| simulation.steady(factors, run, motion).expect("complete");
            let given = law(&Factors::default());
            let moves = |n: usize| given.direction[n] != 0.0 && motion.acceleration_m_s2[n].abs() < 1e-3;
            for (preload, viscosity) in [(0.05, 0.0), (0.0, 0.05)] {
                let factors = Factors { preload: 1.0 + preload, viscosity: 1.0 + viscosity, ..Factors::default() };
                let exact = law(&factors).force_n;
                let (told, _) = changed(run, &given.force_n, motion, &given.direction, &factors);
                let of_change = rms_where(moves, &difference(&exact, &given.force_n));
                let share = rms_where(moves, &difference(&told, &exact)) / of_change;
                println!("{preload_n} N, preload {preload}, viscosity {viscosity}: {share:.3}");
                worst = worst.max(share);
            }
        }
        assert!(worst < ERROR_OF_COLUMN, "{worst}");
    }

    /// A machine that moves a mass, known only by positions to the micrometre at 50 rows a second: few rows between rest
    /// and speed, and none of their derived motions right. Its column, the same with another viscosity, and the run, the
    /// exact motion of which is told beside.
    struct Machine {
        run: Run,
        given: Vec<f64>,
        thicker: Vec<f64>,
        friction: Vec<f64>,
        motion: Motion,
    }

    /// By how much the oil is thicker.
    fn thicker_oil() -> Factors {
        Factors { viscosity: 1.05, ..Factors::default() }
    }

    fn machine(preload_n: f64, mass: f64) -> Machine {
        let (simulation, conditions) = zhou(preload_n);
        let speeds_m_s = vec![0.012, 0.03, 0.04, 0.07, 0.11, 0.2];
        let staircase = Staircase { speeds_m_s, acceleration_m_s2: 1.5, strokes: 3, ..Staircase::default() };
        let Course { mut run, motion } = staircase.course(50.0, &conditions).expect("legal");
        let law = |factors: &Factors| simulation.steady(factors, &run, &motion).expect("complete").force_n;
        let moved = |friction: &[f64]| -> Vec<f64> {
            friction.iter().zip(&motion.acceleration_m_s2).map(|(force, a)| force + mass * a).collect()
        };
        let friction = law(&Factors::default());
        let (given, thicker) = (moved(&friction), moved(&law(&thicker_oil())));
        let position_m = motion.position_m.iter().map(|x| (1e6 * x).round() * 1e-6).collect();
        run = Run { position_m: Some(position_m), velocity_m_s: None, acceleration_m_s2: None, ..run };
        Machine { run, given, thicker, friction, motion }
    }

    #[test]
    fn corners_of_a_machine_s_moves_bend_no_slope() {
        let mut worst = 0.0f64;
        for (preload_n, mass) in [(900.0, 0.0), (900.0, 8.0), (4500.0, 0.0), (4500.0, 8.0)] {
            let Machine { run, given, thicker, motion, .. } = machine(preload_n, mass);
            let derived = Motion::of(&run);
            let (told, _) = changed(&run, &given, &derived, &zhou(preload_n).0.direction(&derived), &thicker_oil());
            let moves = |n: usize| motion.velocity_m_s[n].abs() > 1e-3 && motion.acceleration_m_s2[n] == 0.0;
            let share =
                rms_where(moves, &difference(&told, &thicker)) / rms_where(moves, &difference(&thicker, &given));
            println!("{preload_n} N, {mass} kg: {share:.3}");
            worst = worst.max(share);
        }
        assert!(worst < 0.2, "{worst}");
    }

    /// Friction at corners is what its curve says: less off than 8 kg times a derived acceleration, by far.
    #[test]
    fn corners_of_a_machine_s_moves_are_inertia_and_no_friction() {
        let Machine { run, given, friction, motion, .. } = machine(900.0, 8.0);
        let derived = Motion::of(&run);
        let (force, inertia) = changed(&run, &given, &derived, &zhou(900.0).0.direction(&derived), &Factors::default());
        let moves = |n: usize| motion.velocity_m_s[n].abs() > 0.01;
        let off = rms_where(moves, &difference(&difference(&force, &inertia), &friction));
        let corners: Vec<f64> = motion
            .acceleration_m_s2
            .iter()
            .zip(&derived.acceleration_m_s2)
            .map(|(a, derived)| 8.0 * (a - derived))
            .collect();
        println!("{off:.3} N of {:.2} N; corners {:.2} N", rms_where(moves, &friction), rms_where(moves, &corners));
        assert!(off < 0.2 * rms_where(moves, &corners), "{off}");
    }

    /// A speed that is all error, beyond what the square of a number can hold.
    #[test]
    fn a_row_of_which_nothing_is_known_leaves_the_others_alone() {
        let velocity: Vec<f64> =
            std::iter::once(1e-300).chain((0..200).map(|n| 0.01 * (0.01 * f64::from(n)).exp())).collect();
        let direction = vec![1.0; velocity.len()];
        let friction = |n: usize| 5.0 + 10.0 * velocity[n];
        let force: Vec<f64> = (0..velocity.len()).map(friction).collect();
        let part = super::Part::of(0..velocity.len(), &velocity, &force, &direction);
        let corner = Corner { velocity_m_s: 1e-3, acceleration_m_s2: 0.0 };
        let known = |n: usize| if n == 0 { off(&corner, velocity[0], 0.0) } else { (0.0, 0.0) };
        let curve = Curve::of(&part, &velocity, friction, known);
        let last = curve.smooth.last().expect("a slope").slope;
        assert!(curve.smooth.iter().all(|smooth| smooth.slope.is_finite()), "{:?}", curve.smooth);
        assert!((last - 10.0 * velocity[200]).abs() < 0.05, "{last}");
    }
}
