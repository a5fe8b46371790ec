//! Preload from a drag force to which the left-out mechanisms contribute.
//!
//! ```text
//! C    = s·F - A                                            drag of the contacts
//! N(p) = (m₀/m₁)·M(p) + part·(1 - m₀/m₁)                    m₀, m₁: friction with the law's oil, with the block's
//! M(p) = 1 + gain + s·asymmetry + load(p) + k(p)·ρ
//! ```
//!
//! N depends only weakly on the preload, through load and k. So `D(p) = C/n` is inverted for a guessed n, and the
//! secant method finds n = N(p). The last small step uses the law's own slope.

use super::wave::Acts;
use super::{LeftOut, Passage};
use crate::num;
use crate::reduced::{Inversion, OutOfDomain, Reduced};

/// Load per ball, N, at which an interference is stated as the relative preload that it causes.
const REFERENCE_LOAD_N: f32 = 150.0;

/// Largest number of secant steps.
const STEPS: usize = 4;

/// Relative step in N below which the law's slope, known to 1e-3, is as good as another inversion.
const NEAR: f32 = 1e-3;

/// Contributions of a window's place: relative preload, interference (as in [`Acts`]), friction (N) and force (N).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Place {
    preload: f32,
    interference: f32,
    drag_n: f32,
    force_n: f32,
}

impl Place {
    fn add(&mut self, acts: Acts, x: f32) {
        match acts {
            Acts::Preload => self.preload += x,
            Acts::Drag => self.drag_n += x,
            Acts::Force => self.force_n += x,
            Acts::Interference => self.interference += x,
        }
    }
}

impl LeftOut {
    fn place(&self, passage: &Passage) -> Place {
        let mut place = Place::default();
        for wave in self.waves.iter().filter(|w| w.acts()) {
            place.add(wave.acts, wave.mean(passage));
        }
        if self.rail.knots != 0 {
            place.add(self.rail.acts, self.rail.mean(passage));
        }
        place
    }

    /// Preload that makes this drag force (N, positive against the motion) together with everything that was left out.
    ///
    /// `number_per_cst` turns cSt into the law's viscosity; `invert` is the law's inversion.
    ///
    /// # Errors
    /// [`OutOfDomain`] as [`Reduced::invert`]; also where the left-out forces account for the whole drag.
    pub fn preload(
        &self,
        law: &Reduced<f32>,
        number_per_cst: f32,
        drag_n: f32,
        passage: &Passage,
        invert: impl Fn(f32, f32) -> Result<Inversion<f32>, OutOfDomain>,
    ) -> Result<Inversion<f32>, OutOfDomain> {
        let sign = passage.sign();
        let speed = passage.speed_m_s.abs();
        let law_cst = self.oil.of_law_cst(passage.viscosity_cst);
        let with_oil = passage.viscosity_cst * number_per_cst * speed;
        let with_law = law_cst * number_per_cst * speed;
        let place = self.place(passage);
        let along = self.pull.force_n(passage)
            + self.sensor.shift_n(passage.force_rate_n_s)
            + place.force_n
            + self.asymmetry.viscous_n_s_m * speed;
        let mut against = place.drag_n;
        if self.seal.acts() {
            against += self.seal.drag_n(passage.speed_m_s);
        }
        if self.viscous.acts() {
            against += self.viscous.drag_n(passage.speed_m_s, law_cst);
        }
        let contacts = drag_n - against - sign * along;
        let constant = 1.0 + self.sensor.gain_error + sign * self.asymmetry.part;
        let by_preload = place.preload != 0.0 || place.interference != 0.0 || self.load.acts();
        if !by_preload && !self.oil.acts() {
            return invert(contacts / constant, with_oil);
        }
        let correction = |at: &Inversion<f32>| {
            let own = law.local(at.load_per_ball_n, with_law);
            let mut law_times = constant;
            if by_preload {
                let mut preload = place.preload;
                if place.interference != 0.0 {
                    let load = at.load_per_ball_n / REFERENCE_LOAD_N;
                    let root = num::rough_cbrt(load);
                    // one Newton step makes it exact to the last digits
                    let root = root - (root * root * root - load) / (3.0 * root * root);
                    preload += place.interference / (root * root);
                }
                if self.load.acts() {
                    let ratio = self.load.ratio(sign, at.preload_n);
                    let friction = |times: f32| law.friction(times * own.load_root, with_law);
                    law_times += self.load.rise(ratio, own.friction, friction);
                    preload += self.load.preload_per_load * ratio;
                }
                law_times += own.per_preload * preload;
            }
            if self.oil.acts() {
                let ratio = own.friction * law.mu_coulomb / at.friction_coefficient;
                law_times = ratio * law_times + self.oil.part * (1.0 - ratio);
            }
            law_times
        };
        // corrections are small: the first guess takes the drag as proportional to preload (k = 1)
        let mut n = constant + place.preload + place.interference;
        let mut answer = invert(contacts / n, with_oil)?;
        let mut told = correction(&answer);
        let mut next = told;
        for _ in 0..STEPS {
            let (n_before, told_before) = (n, told);
            n = next;
            answer = invert(contacts / n, with_oil)?;
            told = correction(&answer);
            // intersection of the secant with N = n
            let slope = ((told - told_before) / (n - n_before)).clamp(-0.5, 0.5);
            next = if slope.is_finite() { n + (told - n) / (1.0 - slope) } else { told };
            if (next - n).abs() < NEAR * n.abs() {
                break;
            }
        }
        // the last step is small enough for the law's own slope
        answer.preload_n -= answer.preload_n * answer.per_force * ((next - n) / n);
        Ok(answer)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::left_out::friction::{Asymmetry, SealDrag, ViscousDrag};
    use crate::left_out::load::ExternalLoad;
    use crate::left_out::oil::Oil;
    use crate::left_out::pull::Pull;
    use crate::left_out::rail::RailTable;
    use crate::left_out::sensor::Sensor;
    use crate::left_out::wave::Wave;
    use crate::params::Params;
    use crate::reduced::DragLaw;

    const PASSAGE: Passage = Passage {
        speed_m_s: 0.02,
        acceleration_m_s2: 0.004,
        force_rate_n_s: 0.3,
        viscosity_cst: 61.0,
        place_m: 0.31,
        travel_m: 0.0064,
    };

    /// The module's equation forwards, in f64: what is measured at a preload.
    fn force(own: &LeftOut, law: &Reduced<f64>, preload: f64, passage: &Passage) -> f64 {
        let (sign, v) = (f64::from(passage.sign()), f64::from(passage.speed_m_s).abs());
        let with = |cst: f32, p: f64| law.drag_force(p, f64::from(cst) * v).expect("inside");
        let law_cst = own.oil.of_law_cst(passage.viscosity_cst);
        let d0 = with(law_cst, preload);
        let d1 = with(passage.viscosity_cst, preload);
        let step = 1e-4;
        let k = libm::log(with(law_cst, preload * (1.0 + step)) / with(law_cst, preload * (1.0 - step)))
            / libm::log((1.0 + step) / (1.0 - step));
        let place = own.place(passage);
        let mut m = 1.0 + f64::from(own.sensor.gain_error) + sign * f64::from(own.asymmetry.part);
        let load = law.invert(d0, f64::from(law_cst) * v).expect("inside").load_per_ball_n;
        let by_load = libm::cbrt(f64::from(REFERENCE_LOAD_N) / load);
        let mut rho = f64::from(place.preload) + f64::from(place.interference) * by_load * by_load;
        if own.load.acts() {
            let ratio = own.load.ratio(passage.sign(), preload as f32);
            let friction = |times: f64| law.local(times * times * times * load, f64::from(law_cst) * v).friction;
            let here = friction(1.0) as f32;
            m += f64::from(own.load.rise(ratio, here, |times| friction(f64::from(times)) as f32));
            rho += f64::from(own.load.preload_per_load * ratio);
        }
        m += k * rho;
        let against = f64::from(place.drag_n)
            + f64::from(own.seal.drag_n(passage.speed_m_s))
            + f64::from(own.viscous.drag_n(passage.speed_m_s, law_cst));
        let along = f64::from(own.pull.force_n(passage))
            + f64::from(own.sensor.shift_n(passage.force_rate_n_s))
            + f64::from(place.force_n)
            + f64::from(own.asymmetry.viscous_n_s_m) * v;
        d0 * m + f64::from(own.oil.part) * (d1 - d0) + against + sign * along
    }

    fn all() -> LeftOut {
        let mut rail = RailTable { step_m: 0.02, knots: 50, scale: 2e-5, ..RailTable::NONE };
        for (n, value) in rail.values.as_flattened_mut().iter_mut().enumerate() {
            *value = ((n * 7919) % 4001) as i16 - 2000;
        }
        LeftOut {
            seal: SealDrag { coulomb_n: [3.0, 2.5], per_decade_n: 0.4, smooth_m_s: 1e-3 },
            viscous: ViscousDrag { at_100_mm_s_n: [2.0, 2.2], at_100_cst_n: 0.7, exponent: 0.8 },
            oil: Oil { part: 0.93, law_cst: 100.0 },
            asymmetry: Asymmetry { part: 0.04, viscous_n_s_m: 3.0 },
            load: ExternalLoad { load_n: [500.0, -300.0], part: 1.0, preload_per_load: 0.05 },
            pull: Pull { force_n: 0.8, per_m_n_m: 1.5, inertia_kg: 12.0 },
            sensor: Sensor { offset_n: -0.6, gain_error: 0.02, lag_s: 0.02 },
            start_m: 0.0,
            waves: [
                Wave { acts: Acts::Preload, wavelength_m: 0.0143, sine: [0.02, 0.01, 0.0], cosine: [0.015, 0.0, 0.0] },
                Wave {
                    acts: Acts::Interference,
                    wavelength_m: 0.6,
                    sine: [0.06, 0.0, 0.01],
                    cosine: [0.03, 0.02, 0.0],
                },
                Wave { acts: Acts::Force, wavelength_m: 0.005, sine: [0.4, 0.0, 0.0], cosine: [0.3, 0.0, 0.0] },
            ],
            rail,
        }
    }

    /// Largest relative error of the preload over preloads, speeds and directions.
    fn worst(own: &LeftOut) -> f64 {
        use crate::reference::zhou_2023::{FRICTION, GUIDE_PRODUCTION};
        let law = Reduced::of(&GUIDE_PRODUCTION, &FRICTION, 600.0);
        let narrow = Params::ZHOU_2023.law;
        let mut worst = 0.0f64;
        for preload in [600.0, 1500.0, 3000.0, 7500.0] {
            for speed_m_s in [0.002, -0.01, 0.05, -0.1f32] {
                let passage = Passage { speed_m_s, travel_m: 0.32 * speed_m_s, ..PASSAGE };
                let measured = force(own, &law, preload, &passage) as f32;
                let got = own.preload(&narrow, 1.0, measured, &passage, |f, b| narrow.invert(f, b)).expect("inside");
                worst = worst.max((f64::from(got.preload_n) / preload - 1.0).abs());
            }
        }
        worst
    }

    #[test]
    fn every_mechanism_alone_and_all_together_give_the_preload_back() {
        let alone: [fn(&mut LeftOut, &LeftOut); 9] = [
            |l, a| l.seal = a.seal,
            |l, a| l.viscous = a.viscous,
            |l, a| l.oil = a.oil,
            |l, a| l.asymmetry = a.asymmetry,
            |l, a| l.load = a.load,
            |l, a| l.pull = a.pull,
            |l, a| l.sensor = a.sensor,
            |l, a| l.waves = a.waves,
            |l, a| l.rail = a.rail,
        ];
        for (n, set) in alone.into_iter().enumerate() {
            let mut own = LeftOut::NOTHING;
            set(&mut own, &all());
            assert_eq!(own.check(500.0), Ok(()));
            let worst = worst(&own);
            assert!(worst < 1e-5, "{n}: {worst:.1e}");
        }
        let worst = worst(&all());
        assert!(worst < 1e-5, "all: {worst:.1e}");
    }

    #[test]
    fn more_than_all_of_the_force_taken_away_is_no_preload() {
        let own = all();
        let law = Params::ZHOU_2023.law;
        for force in [0.0, 1.0, f32::NAN] {
            assert_eq!(own.preload(&law, 1.0, force, &PASSAGE, |f, b| law.invert(f, b)), Err(OutOfDomain::Force));
        }
    }
}
