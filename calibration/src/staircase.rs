//! Preload from the drag at many speeds, with a known friction law.
//!
//! ```text
//! minimise  Σ ((F_i - F_seal - D(F_p; ν_i, V_i))/σ_i)²       over ln F_p and, where asked, F_seal
//! ```
//!
//! D is Eq. 21 of Zhou 2023 through the exact geometry; its derivative `dD/dlnF_p = D·(dlnF_f/dlnQ)/(dlnF_p/dlnQ)` is
//! exact too, so that Gauss-Newton steps converge in a handful. The range of speeds decides how well a constant seal
//! drag is distinguished from preload: with the paper's curve, 20 speeds of 0.1 to 6 m/min and a noise of 1 % + 0.1 N,
//! F_p is known to 0.35 % with known seals and to 2.3 % with their constant fitted jointly (physics.md E.4).

use simulation::guide::GuideSet;

/// Quantile of the normal distribution for a 95 % interval.
const QUANTILE_95: f64 = 1.959_963_985;

/// Relative change of the preload below which the search ends.
const CONVERGED: f64 = 1e-12;

/// Drag at one speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// Carriage speed, m/s; its sign is ignored.
    pub speed_m_s: f64,
    /// Viscosity of the oil, cSt.
    pub viscosity_cst: f64,
    /// Drag force against the motion, N; viscous seal drag already subtracted.
    pub drag_n: f64,
    /// Its standard deviation, N, above 0.
    pub sigma_n: f64,
}

/// Knowledge of the constant seal drag.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Seals {
    /// Known, N.
    Known(f64),
    /// Unknown: fitted jointly with the preload. Its sign is left free, so that its interval is valid.
    Fitted,
}

/// A fitted number with its 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fitted {
    /// Best value.
    pub value: f64,
    /// Standard deviation.
    pub sigma: f64,
    /// 95 % interval.
    pub interval: [f64; 2],
}

/// Result of a staircase.
#[derive(Clone, Debug, PartialEq)]
pub struct Staircase {
    /// Preload, N. Its interval is that of ln F_p.
    pub preload_n: Fitted,
    /// Constant seal drag, N, where it was fitted.
    pub seal_drag_n: Option<Fitted>,
    /// Residual of every step over its σ, in the order given.
    pub residuals: Vec<f64>,
    /// Sum of squared residuals over the degrees of freedom; where it is above 1, the intervals are widened by its
    /// root.
    pub chi2_per_freedom: f64,
}

/// Why a staircase does not determine the preload.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Unfit {
    /// Too few steps for the numbers to be fitted.
    #[error("{steps} speeds are too few; {needed} are needed")]
    TooFew {
        /// Steps that were given.
        steps: usize,
        /// Fewest that will do.
        needed: usize,
    },
    /// A step has a number that is not finite, or a σ that is not above 0.
    #[error("speed number {0} has a drag, speed, viscosity or deviation that cannot be used")]
    BadStep(usize),
    /// No preload gives these forces: the seals alone explain them, or the geometry carries no such load.
    #[error("no preload within the contact's geometry makes these forces")]
    NoPreload,
    /// The speeds do not distinguish preload and seals.
    #[error("these speeds do not tell the preload from the drag of the seals; take a wider range of speeds")]
    NotSeparable,
}

/// Fits one preload, and the constant seal drag where asked, to all steps.
///
/// # Errors
/// [`Unfit`].
pub fn fit(set: &GuideSet, steps: &[Step], seals: Seals) -> Result<Staircase, Unfit> {
    let parameters = if seals == Seals::Fitted { 2 } else { 1 };
    if steps.len() <= parameters {
        return Err(Unfit::TooFew { steps: steps.len(), needed: parameters + 1 });
    }
    let usable = |s: &Step| {
        let all = [s.speed_m_s, s.viscosity_cst, s.drag_n, s.sigma_n];
        all.iter().all(|x| x.is_finite()) && s.sigma_n > 0.0 && s.viscosity_cst > 0.0
    };
    if let Some(n) = steps.iter().position(|s| !usable(s)) {
        return Err(Unfit::BadStep(n + 1));
    }
    let mut seal = if let Seals::Known(n) = seals { n } else { 0.0 };
    let mut ln_p = start(set, steps, seal).ok_or(Unfit::NoPreload)?;
    let mut now = Normal::of(set, steps, ln_p, seal).ok_or(Unfit::NoPreload)?;
    for _ in 0..60 {
        let (by_p, by_seal) = now.step(seals).ok_or(Unfit::NotSeparable)?;
        // halved until it helps: far from the solution the law is not linear
        let mut scale = 1.0;
        let better = loop {
            let (p, s) = (ln_p + scale * by_p, seal + scale * by_seal);
            match Normal::of(set, steps, p, s) {
                Some(next) if next.chi2 <= now.chi2 => break Some((p, s, next)),
                _ if scale < 1e-6 => break None,
                _ => scale *= 0.5,
            }
        };
        // no direction leads down any more: this is the minimum
        let Some((p, s, next)) = better else { break };
        (ln_p, seal, now) = (p, s, next);
        if (scale * by_p).abs() < CONVERGED {
            break;
        }
    }
    let (variance_p, variance_seal) = now.variances(seals).ok_or(Unfit::NotSeparable)?;
    let chi2_per_freedom = now.chi2 / (steps.len() - parameters) as f64;
    let widened = libm::sqrt(chi2_per_freedom.max(1.0));
    let sigma_p = widened * libm::sqrt(variance_p);
    let preload = libm::exp(ln_p);
    let reach = QUANTILE_95 * sigma_p;
    let seal_drag_n = (seals == Seals::Fitted).then(|| {
        let sigma = widened * libm::sqrt(variance_seal);
        Fitted { value: seal, sigma, interval: [seal - QUANTILE_95 * sigma, seal + QUANTILE_95 * sigma] }
    });
    Ok(Staircase {
        preload_n: Fitted {
            value: preload,
            sigma: preload * sigma_p,
            interval: [preload * libm::exp(-reach), preload * libm::exp(reach)],
        },
        seal_drag_n,
        residuals: now.residuals,
        chi2_per_freedom,
    })
}

/// Median of the preloads from single steps, as ln F_p.
fn start(set: &GuideSet, steps: &[Step], seal: f64) -> Option<f64> {
    let scale = set.hersey_scale();
    let single = |s: &Step| set.exact().working_point(s.drag_n - seal, s.viscosity_cst * scale, s.speed_m_s);
    let mut preloads: Vec<f64> = steps.iter().filter_map(single).map(|point| point.preload_n).collect();
    preloads.sort_by(f64::total_cmp);
    preloads.get(preloads.len() / 2).map(|p| libm::log(*p))
}

/// The normal equations at one place: weighted sums over the steps.
struct Normal {
    chi2: f64,
    residuals: Vec<f64>,
    /// of squared derivatives with respect to ln F_p and the seal drag, and of their product
    pp: f64,
    ss: f64,
    ps: f64,
    /// of derivatives times residuals
    pr: f64,
    sr: f64,
}

impl Normal {
    fn of(set: &GuideSet, steps: &[Step], ln_p: f64, seal: f64) -> Option<Self> {
        let (exact, friction) = (set.exact(), set.exact().friction());
        let q = exact.load_of_preload(libm::exp(ln_p))?;
        // the same for every step
        let film_exponent = exact.hersey_load_exponent(q);
        let preload_exponent = exact.preload_load_exponent(q);
        let mut sums = Normal {
            chi2: 0.0,
            residuals: Vec::with_capacity(steps.len()),
            pp: 0.0,
            ss: 0.0,
            ps: 0.0,
            pr: 0.0,
            sr: 0.0,
        };
        for step in steps {
            let h = exact.hersey(q, step.viscosity_cst * set.hersey_scale(), step.speed_m_s);
            let mu = friction.coefficient(h);
            let drag = exact.guide().loaded_balls() * q * mu;
            let by_load = 1.0 + film_exponent * h * friction.slope(h) / mu;
            let p = drag * by_load / preload_exponent / step.sigma_n;
            let s = 1.0 / step.sigma_n;
            let r = (step.drag_n - seal - drag) / step.sigma_n;
            sums.chi2 += r * r;
            sums.pp += p * p;
            sums.ss += s * s;
            sums.ps += p * s;
            sums.pr += p * r;
            sums.sr += s * r;
            sums.residuals.push(r);
        }
        Some(sums)
    }

    /// Determinant relative to the product of the diagonal: 1 less the squared correlation.
    fn determinant(&self) -> Option<f64> {
        let determinant = self.pp * self.ss - self.ps * self.ps;
        (determinant > 1e-9 * self.pp * self.ss).then_some(determinant)
    }

    fn step(&self, seals: Seals) -> Option<(f64, f64)> {
        match seals {
            Seals::Known(_) => Some((self.pr / self.pp, 0.0)),
            Seals::Fitted => {
                let d = self.determinant()?;
                Some(((self.ss * self.pr - self.ps * self.sr) / d, (self.pp * self.sr - self.ps * self.pr) / d))
            }
        }
    }

    fn variances(&self, seals: Seals) -> Option<(f64, f64)> {
        match seals {
            Seals::Known(_) => Some((1.0 / self.pp, 0.0)),
            Seals::Fitted => self.determinant().map(|d| (self.ss / d, self.pp / d)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SPEEDS: usize = 20;

    /// Approximately normal numbers: sums of twelve uniform ones from a linear congruence.
    struct Noise(u64);

    impl Noise {
        fn next(&mut self) -> f64 {
            let mut sum = -6.0;
            for _ in 0..12 {
                self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                sum += (self.0 >> 11) as f64 / (1u64 << 53) as f64;
            }
            sum
        }
    }

    /// 20 speeds from 0.1 to 6 m/min in equal ratios at 3 kN and 100 cSt, noise of 1 % + 0.1 N.
    fn steps(set: &GuideSet, seal: f64, noise: &mut Noise) -> Vec<Step> {
        let q = set.exact().load_of_preload(3000.0).expect("within the geometry");
        (0..SPEEDS)
            .map(|n| {
                let speed_m_s = 0.1 / 60.0 * libm::pow(60.0, n as f64 / (SPEEDS - 1) as f64);
                let drag = set.exact().drag_force_n(q, 100.0, speed_m_s) + seal;
                let sigma_n = 0.01 * drag + 0.1;
                Step { speed_m_s, viscosity_cst: 100.0, drag_n: drag + sigma_n * noise.next(), sigma_n }
            })
            .collect()
    }

    struct Trials {
        rms: f64,
        stated: f64,
        covered: f64,
        seal_covered: f64,
    }

    fn trials(seal: f64, seals: Seals, seeds: u64) -> Trials {
        let set = GuideSet::zhou_2023();
        let (mut square, mut stated, mut covered, mut seal_covered) = (0.0, 0.0, 0u32, 0u32);
        let inside = |f: &Fitted, truth: f64| u32::from(f.interval[0] <= truth && truth <= f.interval[1]);
        for seed in 0..seeds {
            let mut noise = Noise(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15));
            let found = fit(&set, &steps(&set, seal, &mut noise), seals).expect("fits");
            let error = found.preload_n.value / 3000.0 - 1.0;
            square += error * error;
            stated += found.preload_n.sigma / found.preload_n.value;
            covered += inside(&found.preload_n, 3000.0);
            seal_covered += found.seal_drag_n.as_ref().map_or(1, |f| inside(f, seal));
        }
        let count = seeds as f64;
        Trials {
            rms: libm::sqrt(square / count),
            stated: stated / count,
            covered: f64::from(covered) / count,
            seal_covered: f64::from(seal_covered) / count,
        }
    }

    #[test]
    fn with_the_curve_known_a_staircase_gives_half_a_percent() {
        let of = trials(0.0, Seals::Known(0.0), 2000);
        println!("rms {:.5}, stated {:.5}, covered {:.4}", of.rms, of.stated, of.covered);
        assert!(of.rms <= 0.005, "{}", of.rms);
        // physics.md E.4: 0.35 %
        assert!((of.rms - 0.0035).abs() < 0.0006, "{}", of.rms);
        assert!((0.93..=0.985).contains(&of.covered), "{}", of.covered);
    }

    #[test]
    fn with_the_seals_unknown_the_stated_interval_covers_the_truth() {
        let of = trials(4.0, Seals::Fitted, 2000);
        println!("rms {:.4}, stated {:.4}, covered {:.4} {:.4}", of.rms, of.stated, of.covered, of.seal_covered);
        assert!((0.93..=0.985).contains(&of.covered), "{}", of.covered);
        assert!((0.93..=0.985).contains(&of.seal_covered), "{}", of.seal_covered);
        assert!((of.stated / of.rms - 1.0).abs() < 0.2, "{} {}", of.stated, of.rms);
    }

    #[test]
    fn without_noise_the_truth_comes_back() {
        let set = GuideSet::zhou_2023();
        let exact: Vec<Step> = steps(&set, 4.0, &mut Noise(1))
            .into_iter()
            .map(|s| {
                let q = set.exact().load_of_preload(3000.0).expect("within");
                Step { drag_n: set.exact().drag_force_n(q, 100.0, s.speed_m_s) + 4.0, ..s }
            })
            .collect();
        for seals in [Seals::Known(4.0), Seals::Fitted] {
            let found = fit(&set, &exact, seals).expect("fits");
            assert!((found.preload_n.value / 3000.0 - 1.0).abs() < 1e-9, "{found:?}");
            assert!(found.seal_drag_n.is_none_or(|s| (s.value - 4.0).abs() < 1e-7));
        }
    }

    #[test]
    fn what_cannot_be_fitted_is_refused() {
        let set = GuideSet::zhou_2023();
        let all = steps(&set, 0.0, &mut Noise(1));
        assert_eq!(fit(&set, &all[..2], Seals::Fitted), Err(Unfit::TooFew { steps: 2, needed: 3 }));
        assert_eq!(fit(&set, &all, Seals::Known(100.0)), Err(Unfit::NoPreload));
        let same = vec![all[3]; 5];
        assert_eq!(fit(&set, &same, Seals::Fitted), Err(Unfit::NotSeparable));
        assert!(fit(&set, &same, Seals::Known(0.0)).is_ok());
        let bad = [Step { sigma_n: 0.0, ..all[0] }, all[1], all[2]];
        assert_eq!(fit(&set, &bad, Seals::Fitted), Err(Unfit::BadStep(1)));
    }
}
