//! Carry-over: how much of a cause is present in rows that no step of the search has seen.
//!
//! ```text
//! r + f = x f + L t + noise      r: residual there with everything as found, f: force of the cause,
//!                                L: effects of the law's own parameters, all whitened by the noise there
//! x = 1 + <f', r> / <f', f'>     f': f less what L imitates; 1: all of it is there, 0: nothing
//! σ(x) = <f', f'>^(-1/2)
//! ```

use crate::noise::rows::Rows;
use crate::numbers::linear::{Cholesky, Symmetric, dot, products, remove};
use crate::report::Carried;

/// Standard errors by which a share must differ from one half to be judged.
const SURE: f64 = 2.0;

/// Standard error of a share from which these rows tell nothing of the cause: all of it and nothing of it are
/// indistinguishable, and whatever else is missing would be taken for a multiple of it.
const TELLS_NOTHING: f64 = 1.0;

/// Residual on scored rows, whitened by the noise there, and the effects of the law's own parameters.
pub(crate) struct Scored {
    rows: Rows,
    left: Vec<f32>,
    law: Vec<Vec<f32>>,
}

impl Scored {
    /// `left`, `law`, and the forces of all causes: one entry per row of all scored runs.
    pub(crate) fn new(rows: &Rows, left: &[f64], law: &[Vec<f64>], forces: &[Vec<f64>]) -> Self {
        let mut rows = rows.clone();
        // the noise model must not include the colour of the causes
        rows.learn(&without(&rows, left, law.iter().chain(forces)), &[]);
        let law = rows.white_all(&law.iter().map(Vec::as_slice).collect::<Vec<_>>());
        Scored { left: rows.white(left), law, rows }
    }

    /// Share of a force that is present; `None` where these rows tell nothing of it.
    pub(crate) fn share(&self, force: &[f64]) -> Option<Carried> {
        let mut force = self.rows.white(force);
        remove(&mut force, &self.law.iter().map(Vec::as_slice).collect::<Vec<_>>());
        self.share_of_white(&force)
    }

    /// The same for a shift of a law parameter: shifts of other parameters would imitate it, so those stay as they were
    /// found.
    pub(crate) fn share_of_shift(&self, force: &[f64]) -> Option<Carried> {
        self.share_of_white(&self.rows.white(force))
    }

    fn share_of_white(&self, force: &[f32]) -> Option<Carried> {
        let of = products(&[force], &[force, &self.left]);
        let sigma = 1.0 / of[0].sqrt();
        if !(sigma < TELLS_NOTHING) {
            return None;
        }
        let share = 1.0 + of[1] / of[0];
        Some(Carried { share, ci95: [share - 1.96 * sigma, share + 1.96 * sigma] })
    }
}

/// A column less what others imitate of it on the compared rows.
fn without<'o>(rows: &Rows, column: &[f64], others: impl Iterator<Item = &'o Vec<f64>> + Clone) -> Vec<f64> {
    let plain: Vec<Vec<f64>> = others.clone().map(|other| rows.plain(other)).collect();
    let of = rows.plain(column);
    let mut a = Symmetric::zeros(plain.len());
    for i in 0..plain.len() {
        (0..=i).for_each(|j| a.set(i, j, dot(&plain[i], &plain[j])));
    }
    let b: Vec<f64> = plain.iter().map(|other| dot(other, &of)).collect();
    let mut left = column.to_vec();
    for (other, x) in others.zip(Cholesky::of(&a).solve(&b)) {
        left.iter_mut().zip(other).for_each(|(left, other)| *left -= x * other);
    }
    left
}

/// Whether most of a cause is present; `None` where that is undecided.
pub(crate) fn is_there(carried: &Carried) -> Option<bool> {
    let sigma = (carried.ci95[1] - carried.ci95[0]) / (2.0 * 1.96);
    let beyond = (carried.share - 0.5) / sigma;
    (beyond.abs() > SURE).then_some(beyond > 0.0)
}

#[cfg(test)]
mod tests {
    use simulation::run::{Break, Part, Run};
    use simulation::sensor::Noise;

    use super::*;

    #[test]
    fn a_share_is_what_is_there_whatever_the_law_s_numbers_do() {
        let count = 8000;
        let time_s: Vec<f64> = (0..count).map(|n| n as f64 * 5e-3).collect();
        let parts = vec![Part { rows: 0..count, segment: None, starts: Break::Start }];
        let run = Run { time_s: time_s.clone(), drag_force_n: vec![1.0; count], parts, ..Run::default() };
        let rows = Rows::new(&[run], &vec![true; count], 1);
        let law: Vec<f64> = time_s.iter().map(|t| (0.9 * t).sin()).collect();
        let force: Vec<f64> = time_s.iter().map(|t| 0.3 * (0.9 * t).sin() + 0.2 * (2.3 * t).cos()).collect();
        for (n, (share, there)) in [(1.0, Some(true)), (0.2, Some(false)), (-1.0, Some(false))].into_iter().enumerate()
        {
            let mut noise = Noise::new(5, n as u64);
            let of = |(force, law): (&f64, &f64)| (share - 1.0) * force + 0.7 * law + 0.4 * noise.gaussian();
            let left: Vec<f64> = force.iter().zip(&law).map(of).collect();
            let carried = Scored::new(&rows, &left, std::slice::from_ref(&law), std::slice::from_ref(&force))
                .share(&force)
                .expect("it acts");
            assert!(carried.ci95[0] < share && share < carried.ci95[1], "{carried:?} of {share}");
            assert!(carried.ci95[1] - carried.ci95[0] < 0.3 && is_there(&carried) == there, "{carried:?}");
        }
        // a force that the law imitates almost completely is undecided
        let alike: Vec<f64> = law.iter().zip(&force).map(|(law, force)| law + 0.01 * force).collect();
        let mut noise = Noise::new(6, 0);
        let left: Vec<f64> = law.iter().map(|_| 0.4 * noise.gaussian()).collect();
        let carried = Scored::new(&rows, &left, std::slice::from_ref(&law), &[]).share(&alike);
        assert_eq!(carried.and_then(|carried| is_there(&carried)), None);
        // so is one that hardly acts there, whatever the residual
        let left: Vec<f64> = force.iter().map(|force| 3.0 * force + 0.4 * noise.gaussian()).collect();
        let faint: Vec<f64> = force.iter().map(|force| 1e-3 * force).collect();
        assert_eq!(Scored::new(&rows, &left, &[law], &[]).share(&faint), None);
    }
}
