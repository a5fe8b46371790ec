//! Order tracking of the ball-pass ripple: amplitude and phase of the drag force at one wavelength of travel.
//!
//! Balls enter the loaded zone once per `λ = 2·pitch` of carriage travel (physics.md E30), whatever the
//! speed. The drag is mixed with sine and cosine of the position and averaged over travel, not over time.
//! An accuracy of 1e-3 is enough here, so `micromath` serves; nothing of it reaches the preload.

use crate::num;
use micromath::F32;

/// Wavelengths over which the average forgets. Fewer: noise and friction steps leak in. More: it takes
/// longer to see a change.
const MEMORY: f32 = 8.0;

/// Wavelengths of uninterrupted travel before there is an answer.
const LEARN: f32 = 12.0;

/// Ripple of the drag force at the tracked wavelength.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ripple {
    /// Amplitude, N (half of peak to peak).
    pub amplitude_n: f32,
    /// Phase at position 0 (where the block was switched on), rad, -π to π:
    /// `drag = mean + amplitude·cos(2πx/λ - phase)`.
    pub phase_rad: f32,
}

/// What the tracker remembers.
#[derive(Clone, Copy, Debug, Default)]
pub struct OrderTracker {
    mean: f32,
    cosine: f32,
    sine: f32,
    /// wavelengths travelled since the last reset
    travelled: f32,
}

impl OrderTracker {
    /// Nothing learnt.
    pub const fn new() -> Self {
        OrderTracker { mean: 0.0, cosine: 0.0, sine: 0.0, travelled: 0.0 }
    }

    /// Takes a block: mean drag force (N, positive against the motion), position at its middle and travel
    /// within it, both in wavelengths. A block without travel changes nothing.
    pub fn step(&mut self, drag_n: f32, position: f32, travel: f32) {
        if travel <= 0.0 {
            return;
        }
        if self.travelled == 0.0 {
            self.mean = drag_n;
        }
        let share = (travel / MEMORY).min(1.0);
        let deviation = drag_n - self.mean;
        self.mean += share * deviation;
        let turn = position - position as i32 as f32;
        let angle = F32(turn * core::f32::consts::TAU);
        self.cosine += share * (deviation * angle.cos().0 - self.cosine);
        self.sine += share * (deviation * angle.sin().0 - self.sine);
        self.travelled = (self.travelled + travel).min(2.0 * LEARN);
    }

    /// Forgets everything: after a gap or a reversal the phase of what was learnt may not hold.
    pub fn clear(&mut self) {
        *self = Self::new();
    }

    /// The ripple, `None` before enough travel.
    pub fn ripple(&self) -> Option<Ripple> {
        (self.travelled >= LEARN).then(|| Ripple {
            amplitude_n: 2.0 * num::sqrt(self.cosine * self.cosine + self.sine * self.sine),
            phase_rad: F32(self.sine).atan2(F32(self.cosine)).0,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_amplitude_and_phase_in_either_direction() {
        for (sign, phase) in [(1.0f64, 0.3f64), (-1.0, -2.0), (1.0, 2.9)] {
            let mut t = OrderTracker::new();
            for n in 0..4000 {
                let x = sign * f64::from(n) * 0.07;
                let drag = 20.0 + 0.4 * libm::cos(core::f64::consts::TAU * x - phase);
                t.step(drag as f32, x as f32, 0.07);
            }
            let r = t.ripple().expect("learnt");
            assert!((r.amplitude_n - 0.4).abs() < 0.02, "{r:?}");
            let off = libm::remainder(f64::from(r.phase_rad) - phase, core::f64::consts::TAU);
            assert!(off.abs() < 0.1, "{r:?} against {phase}");
        }
    }

    #[test]
    fn a_smooth_drag_has_none() {
        let mut t = OrderTracker::new();
        assert_eq!(t.ripple(), None);
        for n in 0..1000 {
            // eleven wavelengths are not enough, twelve are
            if n == 157 {
                assert_eq!(t.ripple(), None);
            }
            t.step(20.0, n as f32 * 0.07, 0.07);
        }
        assert!(t.ripple().expect("learnt").amplitude_n < 1e-3);
        t.clear();
        assert_eq!(t.ripple(), None);
    }
}
