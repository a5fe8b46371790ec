//! The readings of the Hersey number that the paper leaves open, and what each predicts on the measured grid.
//!
//! The paper gives `H = η u/P` without units. A reading fixes the number that stands for the viscosity and the
//! speed that stands for u; the pressure is the maximum one, in Pa.

use model_core::contact::{Guide, HerseySpeed};
use model_core::exact::Exact;
use model_core::reference::zhou_2023::{FRICTION, GUIDE};

/// Density that turns 100 cSt into 0.088 Pa·s, kg/m³; assumed.
pub const OIL_DENSITY_KG_M3: f64 = 880.0;

pub use simulation::profile::paper_grid::{LATERAL_N, SPEEDS_M_MIN};

/// One reading.
#[derive(Clone, Copy, Debug)]
pub struct Convention {
    /// `C1` to `C8`.
    pub name: &'static str,
    /// In words.
    pub reading: &'static str,
    /// What multiplies the speed in m/s: the viscosity's number, times 60 if u counts in m/min.
    pub viscosity_number: f64,
    /// Which speed u is.
    pub speed: HerseySpeed,
}

const fn reading(name: &'static str, reading: &'static str, viscosity_number: f64, speed: HerseySpeed) -> Convention {
    Convention { name, reading, viscosity_number, speed }
}

/// All readings.
pub const CONVENTIONS: [Convention; 8] = [
    reading("C1", "0.088 Pa·s, carriage speed in m/s (pure SI)", 0.088, HerseySpeed::Carriage),
    reading("C2", "0.088 Pa·s, carriage speed in m/min", 0.088 * 60.0, HerseySpeed::Carriage),
    reading("C3", "the number 100, carriage speed in m/s", 100.0, HerseySpeed::Carriage),
    reading("C4", "0.088 Pa·s, sliding speed in m/s (pure SI)", 0.088, HerseySpeed::Slip),
    reading("C5", "0.088 Pa·s, sliding speed in m/min", 0.088 * 60.0, HerseySpeed::Slip),
    reading("C6", "the number 100, sliding speed in m/s", 100.0, HerseySpeed::Slip),
    reading("C7", "88 mPa·s, sliding speed in m/s", 88.0, HerseySpeed::Slip),
    reading("C8", "the number 100, sliding speed in m/min", 6000.0, HerseySpeed::Slip),
];

/// Place of C2 in [`CONVENTIONS`].
pub const C2: usize = 1;
/// Place of C6 in [`CONVENTIONS`], the reading that the parameter set of this program takes.
pub const C6: usize = 5;

/// Predictions of a reading on the measured grid.
#[derive(Clone, Copy, Debug, serde::Serialize)]
pub struct Score {
    /// Smallest and largest `k_s H`.
    pub exponent: (f64, f64),
    /// Smallest and largest Hersey number, in the reading's unit.
    pub hersey: (f64, f64),
    /// Share of the grid past the minimum of Eq. 20, in full film.
    pub full_film: f64,
    /// Measured speed of the smallest friction at 500, 1500, 4500 and 7500 N, m/min.
    pub speed_of_minimum: [f64; 4],
    /// Fall of the friction from 0.1 m/min to its minimum at 500 N: larger over smaller, less one.
    pub fall_500: f64,
    /// Rise of the friction from its minimum to 6 m/min at 4500 and 7500 N, a ratio less one.
    pub rise: [f64; 2],
    /// Fall from 0.1 m/min to the minimum at 9500 N: larger over smaller, less one.
    pub fall_9500: f64,
    /// Rise from the minimum to 6 m/min at the smallest and the largest load, 500 and 9500 N.
    pub rise_at_ends: [f64; 2],
    /// Largest less smallest friction at 8500 N, over the mean of the speeds.
    pub spread_8500: f64,
    /// Friction at 500 N over that at 9500 N, less one, at 0.1 m/min and at 6 m/min.
    pub fall_with_load: [f64; 2],
    /// Smallest and largest drag force, N.
    pub drag_n: (f64, f64),
    /// Largest over smallest friction among 0.1, 2 and 6 m/min at 7500 or 8500 N, the worse of the two.
    pub spread_of_table_2: f64,
    /// Error of the preload that Eq. 21 makes of the two quoted minima, a ratio less one.
    pub error_of_quoted: [Option<f64>; 2],
}

/// The minima that the paper quotes: lateral force in N, friction coefficient, speed in m/min.
pub const QUOTED_MINIMA: [(f64, f64, f64); 2] = [(500.0, 0.00166, 0.6), (1500.0, 0.00197, 0.6)];

/// Smallest and largest.
fn extremes(values: impl IntoIterator<Item = f64>) -> (f64, f64) {
    values.into_iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)))
}

impl Convention {
    /// The paper's guide under this reading, with one groove conformity for rail and slider.
    pub fn model(&self, conformity: f64) -> Exact {
        let guide =
            Guide { hersey_speed: self.speed, conformity_rail: conformity, conformity_slider: conformity, ..GUIDE };
        Exact::new(guide, FRICTION)
    }

    /// Hersey number at a load per ball in N and a carriage speed in m/min.
    pub fn hersey(&self, model: &Exact, q: f64, speed_m_min: f64) -> f64 {
        model.hersey(q, self.viscosity_number, speed_m_min / 60.0)
    }

    /// Scores the reading for one groove conformity. `None` if a measured load is beyond the groove's geometry.
    pub fn score(&self, conformity: f64) -> Option<Score> {
        let model = self.model(conformity);
        let mut loads = [0.0; 10];
        for (q, lateral) in loads.iter_mut().zip(LATERAL_N) {
            *q = model.load_of_lateral_force(lateral)?;
        }
        let hersey = loads.map(|q| SPEEDS_M_MIN.map(|speed| self.hersey(&model, q, speed)));
        let friction = hersey.map(|row| row.map(|h| FRICTION.coefficient(h)));
        let [at_500, at_1500, .., at_7500, at_8500, at_9500] = friction;
        let at_4500 = friction[4];
        let lowest = |row: &[f64; 20]| extremes(*row).0;
        let speed_of_minimum = |row: &[f64; 20]| {
            let smallest = lowest(row);
            row.iter().position(|&mu| mu == smallest).map_or(f64::NAN, |n| SPEEDS_M_MIN[n])
        };
        let rise = |row: &[f64; 20]| row[19] / lowest(row) - 1.0;
        // 0.1, 2 and 6 m/min
        let of_table_2 = |row: &[f64; 20]| {
            let (low, high) = extremes([row[0], row[11], row[19]]);
            high / low
        };
        let (low, high) = extremes(at_8500);
        let drag = loads.iter().zip(&friction).flat_map(|(q, row)| row.map(|mu| model.guide().loaded_balls() * q * mu));
        let h = extremes(hersey.into_iter().flatten());
        let k_s = FRICTION.stribeck_exponent;
        let past = hersey.iter().flatten().filter(|&&h| h > FRICTION.hersey_of_minimum()).count();
        Some(Score {
            exponent: (k_s * h.0, k_s * h.1),
            hersey: h,
            full_film: past as f64 / 200.0,
            speed_of_minimum: [&at_500, &at_1500, &at_4500, &at_7500].map(speed_of_minimum),
            fall_500: at_500[0] / lowest(&at_500) - 1.0,
            fall_9500: at_9500[0] / lowest(&at_9500) - 1.0,
            rise: [&at_4500, &at_7500].map(rise),
            rise_at_ends: [&at_500, &at_9500].map(rise),
            spread_8500: (high - low) / (at_8500.iter().sum::<f64>() / 20.0),
            fall_with_load: [0, 19].map(|n| at_500[n] / at_9500[n] - 1.0),
            drag_n: extremes(drag),
            spread_of_table_2: of_table_2(&at_7500).max(of_table_2(&at_8500)),
            error_of_quoted: QUOTED_MINIMA.map(|(force, mu, speed)| self.preload_error(&model, force, mu, speed)),
        })
    }

    /// Preload that Eq. 21 makes of a quoted friction coefficient, over the true one, less one.
    ///
    /// The drag force is `F_f = 4 Z_b Q μ` (Eq. 6) at the lateral force in N; the speed is in m/min. `None` where
    /// no load within the geometry makes that drag.
    pub fn preload_error(&self, model: &Exact, lateral_n: f64, coefficient: f64, speed_m_min: f64) -> Option<f64> {
        let q = model.load_of_lateral_force(lateral_n)?;
        let drag = model.guide().loaded_balls() * q * coefficient;
        let found = model.working_point(drag, self.viscosity_number, speed_m_min / 60.0)?;
        Some(found.preload_n / model.preload_n(q) - 1.0)
    }
}

/// Largest groove conformity with which C6 still reaches full film at 9500 N and 6 m/min.
pub fn conformity_of_full_film() -> f64 {
    let c6 = &CONVENTIONS[C6];
    let reaches = |f| {
        let model = c6.model(f);
        model.load_of_lateral_force(9500.0).is_some_and(|q| c6.hersey(&model, q, 6.0) > FRICTION.hersey_of_minimum())
    };
    let (mut low, mut high) = (0.505, 0.54);
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if reaches(middle) { low = middle } else { high = middle }
    }
    low
}
