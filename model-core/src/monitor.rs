//! The on-board pipeline as one pure step: counts in, an [`Estimate`] out at the publishing rate.
//!
//! [`Params`] is what a person or a calibration sets, [`Monitor`] the checked and precomputed model,
//! [`State`] all that a block of samples may change. No clock, no I/O: time is the tick inside the block.

use crate::Error;
use crate::encoder::Encoder;
use crate::left_out::Passage;
use crate::num;
use crate::params::Params;
use crate::reduced::{Inversion, OutOfDomain};
use crate::ripple::{OrderTracker, Ripple};
use crate::sample::{
    BLOCK_HZ, BLOCK_PERIOD_S, Estimate, Measured, Motion, RawBlock, Reason, Reasons, SAMPLE_HZ, SAMPLES_PER_BLOCK,
};
use crate::window::{BLOCKS, Summary, View, WINDOW_S, Window};

/// Largest difference between the speeds of two quarters of the window, over the mean speed, that still
/// counts as steady. Smaller: ordinary speed ripple silences the block. Larger: the drag of an
/// accelerating carriage is taken for that of a steady one.
const STEADY_SPREAD: f32 = 0.05;

/// Counts by which two quarters of a perfectly steady motion can differ: each border is rounded once.
const ROUNDING_COUNTS: i32 = 2;

/// Largest share of the drag force that inertia may have in the window's mean.
const INERTIA_SHARE: f32 = 0.01;

/// Share of a known mass, whose inertia is taken off, that still counts as unknown.
const INERTIA_DOUBT: f32 = 0.1;

/// Distance from a window's newest sample back to the mean place of its samples, over the counts in the window: these
/// begin one sample before the first of its 512.
const MEAN_BEHIND: f32 = 511.0 / 1024.0;

/// Fewer counts than this in a window are no motion that a speed could be read from.
const STANDSTILL_COUNTS: i32 = 8;

/// The checked model: immutable, the same for every block of samples.
#[derive(Clone, Copy, Debug)]
pub struct Monitor {
    params: Params,
    guard_counts: i32,
    wavelengths_per_count: f32,
    /// mass whose inertia is not taken off the force, kg
    unknown_mass_kg: f32,
    left_out: bool,
}

/// Place and sensitivity of a trusted estimate: what [`consistency`](crate::consistency) needs beside it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorkingPoint {
    /// Mean place of the window, m, from where the block was switched on.
    pub place_m: f32,
    /// dlnF_p/dlnF_f of the law.
    pub per_force: f32,
}

impl Params {
    /// Checks the parameters and builds the model.
    ///
    /// # Errors
    /// Those of [`Params::check`].
    pub fn build(&self) -> Result<Monitor, Error> {
        let mut monitor = Monitor { params: *self, ..Monitor::UNSET };
        monitor.derive()?;
        Ok(monitor)
    }
}

/// Everything that samples change.
#[derive(Clone, Copy, Debug)]
pub struct State {
    window: Window,
    encoder: Encoder,
    ripple: OrderTracker,
    expected_tick: Option<u32>,
    /// blocks still to come before the last gap has left the window
    gap: usize,
    /// blocks that never came, since start-up
    lost: u32,
    working_point: Option<WorkingPoint>,
}

impl State {
    /// Nothing seen yet.
    pub const fn new() -> Self {
        State {
            window: Window::new(),
            encoder: Encoder::new(),
            ripple: OrderTracker::new(),
            expected_tick: None,
            gap: 0,
            lost: 0,
            working_point: None,
        }
    }

    /// Blocks that never came since start-up, saturating.
    pub fn lost_blocks(&self) -> u32 {
        self.lost
    }

    /// Working point of the newest estimate; `None` when that has no preload.
    pub fn working_point(&self) -> Option<WorkingPoint> {
        self.working_point
    }

    /// Ball-pass ripple of the drag force, once enough travel has shown it.
    pub fn ripple(&self) -> Option<Ripple> {
        self.ripple.ripple()
    }
}

impl Default for State {
    fn default() -> Self {
        Self::new()
    }
}

impl Monitor {
    /// The published set, not calibrated, with nothing derived from it yet: initial value for [`set_up`](Self::set_up).
    pub const UNSET: Monitor = Monitor {
        params: Params::ZHOU_2023,
        guard_counts: 0,
        wavelengths_per_count: 0.0,
        unknown_mass_kg: 0.0,
        left_out: false,
    };

    /// Builds the model in place: `fill` writes the parameters.
    ///
    /// # Errors
    /// Those of `fill` and of [`Params::check`]. The model must then be set up anew before it is used.
    pub fn set_up<T, E: From<Error>>(&mut self, fill: impl FnOnce(&mut Params) -> Result<T, E>) -> Result<T, E> {
        let told = fill(&mut self.params)?;
        self.derive()?;
        Ok(told)
    }

    #[cold]
    #[inline(never)]
    fn derive(&mut self) -> Result<(), Error> {
        let p = &self.params;
        p.check()?;
        let own = p.left_out.pull.inertia_kg;
        self.unknown_mass_kg = if own > 0.0 { INERTIA_DOUBT * own } else { p.moved_mass_kg };
        self.left_out = !p.left_out.acting().is_empty();
        self.guard_counts = (p.presliding_guard_m / p.calibration.metres_per_count.abs()) as i32;
        self.wavelengths_per_count = p.calibration.metres_per_count / p.ball_pass_wavelength_m;
        Ok(())
    }

    /// The parameters it was built from.
    pub fn params(&self) -> &Params {
        &self.params
    }

    /// Takes one block; answers an estimate every [`Params::publish_every_blocks`] blocks.
    ///
    /// A tick that is not the expected one means lost samples: the window starts anew.
    #[inline(never)]
    pub fn step(&self, state: &mut State, block: &RawBlock) -> Option<Estimate> {
        self.follow_ticks(state, block.tick);
        let calibration = &self.params.calibration;
        let mut summary = Summary::new(&block.force, &block.temperature, 0, &calibration.force);
        let force_n = calibration.force.newtons(summary.force_code());
        let step = state.encoder.step(
            &block.position,
            force_n,
            calibration.metres_per_count,
            self.params.braking_limit_m_s2,
            1.0 / SAMPLE_HZ as f32,
        );
        summary.counts = step.counts;
        state.window.push(summary);
        state.gap = state.gap.saturating_sub(1);
        self.track_ripple(state, force_n, step.counts, step.position);
        let due = block.tick.wrapping_add(1).is_multiple_of(u32::from(self.params.publish_every_blocks));
        due.then(|| {
            let (estimate, at) = self.estimate(state, block.tick);
            state.working_point = at;
            estimate
        })
    }

    /// Estimate when no block came: without values, with the reason [`Reason::Stale`].
    pub fn stale(&self, tick: u32) -> Estimate {
        let mut reasons = Reasons::NONE;
        reasons.insert(Reason::Stale);
        reasons.insert_if(!self.params.calibrated, Reason::NotCalibrated);
        Estimate {
            tick,
            preload_n: None,
            drag_force_n: None,
            speed_m_s: None,
            temperature_degc: None,
            motion: Motion::Unknown,
            reasons,
        }
    }

    fn follow_ticks(&self, state: &mut State, tick: u32) {
        if let Some(expected) = state.expected_tick
            && tick != expected
        {
            state.lost = state.lost.saturating_add(tick.wrapping_sub(expected));
            state.window.clear();
            state.ripple.clear();
            state.encoder.interrupted();
            state.gap = BLOCKS;
        }
        state.expected_tick = Some(tick.wrapping_add(1));
    }

    fn track_ripple(&self, state: &mut State, force_n: f32, counts: i32, position: i32) {
        if state.encoder.since_reversal() < self.guard_counts {
            state.ripple.clear();
            return;
        }
        let travel = counts as f32 * self.wavelengths_per_count;
        let middle = (position as f32 - 0.5 * counts as f32) * self.wavelengths_per_count;
        let drag = if travel < 0.0 { -force_n } else { force_n };
        state.ripple.step(drag, middle, travel.abs());
    }

    fn estimate(&self, state: &State, tick: u32) -> (Estimate, Option<WorkingPoint>) {
        let p = &self.params;
        let mut reasons = Reasons::NONE;
        reasons.insert_if(!p.calibrated, Reason::NotCalibrated);
        reasons.insert_if(state.gap > 0, Reason::SamplesLost);
        reasons.insert_if(state.encoder.stuck(), Reason::EncoderStuck);
        // a force at a rail is reported at once, even while the window fills
        let at_rail = state.window.at_rail();
        reasons.insert_if(at_rail, Reason::ForceAtRail);
        let stuck = state.window.is_frozen();
        reasons.insert_if(stuck, Reason::ForceStuck);
        let Some(view) = state.window.view() else {
            reasons.insert(Reason::Settling);
            return (Estimate { reasons, ..self.stale(tick) }, None);
        };
        let temperature = p.calibration.thermistor.degc(view.temperature_code);
        reasons.insert_if(temperature.is_none(), Reason::TemperatureMissing);

        let speed = self.speed(&view);
        let motion = self.motion(state, &view, speed);
        match motion {
            Motion::Rest => reasons.insert(Reason::NoMotion),
            Motion::Reversing => reasons.insert(Reason::Reversing),
            Motion::Accelerating => reasons.insert(Reason::Accelerating),
            Motion::Unknown | Motion::Forward | Motion::Backward => {}
        }
        let encoder_speaks = !state.encoder.stuck();
        let steady = encoder_speaks && matches!(motion, Motion::Forward | Motion::Backward);
        let drag = (steady && !at_rail && !stuck).then(|| self.drag(&view, speed));
        let preload = match drag {
            Some(drag) => self.preload(state, &view, drag, speed, temperature, &mut reasons),
            None => {
                // a temperature outside the viscosity's range is reported at standstill, too
                let known = temperature.is_none_or(|t| p.viscosity.at(t).is_some());
                reasons.insert_if(!known, Reason::TemperatureOutOfRange);
                None
            }
        };
        let preload = preload.filter(|_| reasons.is_empty());
        let estimate = Estimate {
            tick,
            preload_n: preload.map(|(preload, _)| preload),
            drag_force_n: drag,
            speed_m_s: encoder_speaks.then_some(speed),
            temperature_degc: temperature,
            motion: if encoder_speaks { motion } else { Motion::Unknown },
            reasons,
        };
        let place_m = || self.place_m(state, &view);
        (estimate, preload.map(|(_, per_force)| WorkingPoint { place_m: place_m(), per_force }))
    }

    /// Mean place of the window, m, from where the block was switched on.
    fn place_m(&self, state: &State, view: &View) -> f32 {
        (state.encoder.position() as f32 - MEAN_BEHIND * view.counts() as f32)
            * self.params.calibration.metres_per_count
    }

    /// `v = q·counts/T`; its σ from rounding at both ends, `q sqrt(2/12)/T`, and from the quarters' scatter.
    fn speed(&self, view: &View) -> Measured {
        let q = self.params.calibration.metres_per_count;
        let mean = view.counts() as f32 / 4.0;
        let mut square = 0.0;
        for n in view.quarters {
            let d = n as f32 - mean;
            square += d * d;
        }
        // variance of the mean of four quarters, scaled to counts per window, plus the rounding of its ends
        let variance = 16.0 * square / 12.0 + 1.0 / 6.0;
        Measured { value: view.counts() as f32 * q / WINDOW_S, sigma: num::sqrt(variance) * q.abs() / WINDOW_S }
    }

    fn motion(&self, state: &State, view: &View, speed: Measured) -> Motion {
        let counts = view.counts();
        let turned =
            view.quarters.iter().any(|q| *q > ROUNDING_COUNTS) && view.quarters.iter().any(|q| *q < -ROUNDING_COUNTS);
        if counts.abs() < STANDSTILL_COUNTS && !turned {
            return Motion::Rest;
        }
        // part of the window may lie before the last reversal, or within the presliding zone behind it
        if turned || state.encoder.since_reversal() < self.guard_counts.saturating_add(counts.abs()) {
            return Motion::Reversing;
        }
        let allowed = STEADY_SPREAD * counts.abs() as f32 / 4.0 + ROUNDING_COUNTS as f32;
        if view.spread() as f32 > allowed {
            return Motion::Accelerating;
        }
        let [first, .., last] = view.quarters;
        let beyond_rounding = ((last - first).abs() - ROUNDING_COUNTS).max(0);
        let acceleration = self.acceleration_m_s2(beyond_rounding).abs();
        let force = self.params.calibration.force.newtons(view.force_code).abs();
        if self.unknown_mass_kg * acceleration > INERTIA_SHARE * force {
            return Motion::Accelerating;
        }
        if speed.value > 0.0 { Motion::Forward } else { Motion::Backward }
    }

    /// Acceleration, m/s², that makes this difference of counts between the outer quarters, whose centres lie 3/4 of
    /// the window apart.
    fn acceleration_m_s2(&self, counts: i32) -> f32 {
        const QUARTER_S: f32 = 0.25 * WINDOW_S;
        counts as f32 * self.params.calibration.metres_per_count / (3.0 * QUARTER_S * QUARTER_S)
    }

    /// Drag force of the window, N, positive against the motion, with its σ from noise, gain, ripple and offset.
    fn drag(&self, view: &View, speed: Measured) -> Measured {
        let scale = &self.params.calibration.force;
        let u = &self.params.uncertainty;
        let force = scale.newtons(view.force_code);
        let drag = if speed.value < 0.0 { -force } else { force };
        let noise = view.force_sigma * scale.newtons_per_code;
        let gain = u.force_gain * drag;
        // a window shorter than a ball pass sees one flank of the ripple: sinc-like, bounded by λ/(πL)
        let passes = view.counts() as f32 * self.wavelengths_per_count;
        let unaveraged = (core::f32::consts::FRAC_1_PI / passes.abs()).min(1.0);
        let ripple = u.ball_pass_ripple * unaveraged * drag;
        let variance = noise * noise + gain * gain + ripple * ripple + u.force_offset_n * u.force_offset_n;
        Measured { value: drag, sigma: num::sqrt(variance) }
    }

    /// `F_p` of the contacts' share of the drag, and
    /// `(σ_p/F_p)² = S_F²(σ_F²/F_f² + σ_μ²) + S_n²(σ_ν² + σ_V²)`, S the law's elasticities.
    fn preload(
        &self,
        state: &State,
        view: &View,
        drag: Measured,
        speed: Measured,
        temperature: Option<f32>,
        reasons: &mut Reasons,
    ) -> Option<(Measured, f32)> {
        let p = &self.params;
        let v = speed.value.abs();
        reasons.insert_if(drag.value <= 0.0, Reason::ForceAssists);
        reasons.insert_if(v < p.range.speed_from_m_s || v > p.range.speed_to_m_s, Reason::SpeedOutOfRange);
        let temperature = temperature?;
        let Some(oil) = p.viscosity.at(temperature) else {
            reasons.insert(Reason::TemperatureOutOfRange);
            return None;
        };
        let contacts = drag.value - p.seals.coulomb_n - p.seals.viscous_n_s_m * v;
        let at = if self.left_out {
            self.solve_left_out(state, view, contacts, speed.value, oil.cst)
        } else {
            self.invert(contacts, oil.cst * p.viscosity_number_per_cst * v)
        };
        let Ok(at) = at else {
            reasons.insert_if(drag.value > 0.0, Reason::LoadOutOfRange);
            return None;
        };
        if at.preload_n < p.range.preload_from_n || at.preload_n > p.range.preload_to_n {
            reasons.insert(Reason::LoadOutOfRange);
            return None;
        }
        let u = &p.uncertainty;
        let force = (drag.sigma * drag.sigma + u.seals_n * u.seals_n) / (contacts * contacts) + u.friction * u.friction;
        let warmth = oil.per_kelvin * u.temperature_k;
        let pace = speed.sigma / v;
        let film = u.viscosity * u.viscosity + warmth * warmth + pace * pace;
        let relative = at.per_force * at.per_force * force + at.per_viscous_speed * at.per_viscous_speed * film;
        Some((Measured { value: at.preload_n, sigma: at.preload_n * num::sqrt(relative) }, at.per_force))
    }

    /// The inversion with the left-out mechanisms.
    #[inline(never)]
    fn solve_left_out(
        &self,
        state: &State,
        view: &View,
        contacts_n: f32,
        speed_m_s: f32,
        viscosity_cst: f32,
    ) -> Result<Inversion<f32>, OutOfDomain> {
        let p = &self.params;
        let [first, .., last] = view.quarters;
        let passage = Passage {
            speed_m_s,
            acceleration_m_s2: self.acceleration_m_s2(last - first),
            force_rate_n_s: state.window.force_change() * p.calibration.force.newtons_per_code
                / ((BLOCKS - 1) as f32 * BLOCK_PERIOD_S),
            viscosity_cst,
            place_m: p.left_out.start_m + self.place_m(state, view),
            travel_m: view.counts() as f32 * p.calibration.metres_per_count,
        };
        p.left_out
            .preload(&p.law, p.viscosity_number_per_cst, contacts_n, &passage, |force, film| self.invert(force, film))
    }

    /// The inversion on its own, so that its cost can be counted in the image.
    #[inline(never)]
    fn invert(&self, contacts_n: f32, viscous_speed: f32) -> Result<Inversion<f32>, OutOfDomain> {
        self.params.law.invert(contacts_n, viscous_speed)
    }
}

const _: () = {
    // the window must hold whole blocks of whole samples, and the rates must divide
    assert!(BLOCK_HZ as usize * SAMPLES_PER_BLOCK == SAMPLE_HZ as usize);
    assert!(BLOCK_PERIOD_S * BLOCK_HZ as f32 == 1.0);
};

#[cfg(test)]
mod tests;
