//! Phases of motion in closed form: rest, a smooth change of speed, constant speed, oscillations.

use core::f64::consts::TAU;

/// A stretch of motion. Speeds are signed, m/s; lengths m; durations s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Phase {
    /// Standing.
    Rest { duration_s: f64 },
    /// From one speed to another.     `V = V_0 + ΔV (3 s² - 2 s³)`, `s = t/T`
    ///
    /// The acceleration starts and ends at zero and is `1.5 ΔV/T` in the middle.
    Ramp { from: f64, to: f64, duration_s: f64 },
    /// Constant speed.
    Cruise { velocity: f64, duration_s: f64 },
    /// `x = A (1 - cos 2πft)`: from rest, to `2A` and back, `cycles` times.
    Sinusoid { amplitude_m: f64, frequency_hz: f64, cycles: f64 },
    /// `V = V_0 (1 + d sin 2πft)`
    Modulated { mean: f64, depth: f64, frequency_hz: f64, cycles: f64 },
}

/// Position from the start of the phase, velocity and acceleration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct State {
    pub(super) position_m: f64,
    pub(super) velocity_m_s: f64,
    pub(super) acceleration_m_s2: f64,
}

impl Phase {
    pub(super) fn duration_s(&self) -> f64 {
        match *self {
            Phase::Rest { duration_s } | Phase::Ramp { duration_s, .. } | Phase::Cruise { duration_s, .. } => {
                duration_s
            }
            Phase::Sinusoid { frequency_hz, cycles, .. } | Phase::Modulated { frequency_hz, cycles, .. } => {
                cycles / frequency_hz
            }
        }
    }

    /// The motion `t` seconds into the phase, 0 to its duration.
    pub(super) fn at(&self, t: f64) -> State {
        let state = |position_m, velocity_m_s, acceleration_m_s2| State { position_m, velocity_m_s, acceleration_m_s2 };
        match *self {
            Phase::Rest { .. } => state(0.0, 0.0, 0.0),
            Phase::Cruise { velocity, .. } => state(velocity * t, velocity, 0.0),
            Phase::Ramp { from, to, duration_s } => {
                let (s, change) = (t / duration_s, to - from);
                state(
                    from * t + change * duration_s * s * s * s * (1.0 - 0.5 * s),
                    from + change * s * s * (3.0 - 2.0 * s),
                    6.0 * change / duration_s * s * (1.0 - s),
                )
            }
            Phase::Sinusoid { amplitude_m, frequency_hz, .. } => {
                let omega = TAU * frequency_hz;
                let (sin, cos) = (libm::sin(omega * t), libm::cos(omega * t));
                state(amplitude_m * (1.0 - cos), amplitude_m * omega * sin, amplitude_m * omega * omega * cos)
            }
            Phase::Modulated { mean, depth, frequency_hz, .. } => {
                let omega = TAU * frequency_hz;
                let (sin, cos) = (libm::sin(omega * t), libm::cos(omega * t));
                state(mean * (t + depth / omega * (1.0 - cos)), mean * (1.0 + depth * sin), mean * depth * omega * cos)
            }
        }
    }

    /// Travel from start to end, m; exact by definition of the phase, so that no rounding accumulates.
    pub(super) fn travel_m(&self) -> f64 {
        match *self {
            Phase::Rest { .. } | Phase::Sinusoid { .. } => 0.0,
            Phase::Cruise { velocity, duration_s } => velocity * duration_s,
            Phase::Ramp { from, to, duration_s } => 0.5 * (from + to) * duration_s,
            Phase::Modulated { mean, frequency_hz, cycles, .. } => mean * cycles / frequency_hz,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn velocity_and_acceleration_are_the_derivatives() {
        let phases = [
            Phase::Rest { duration_s: 1.0 },
            Phase::Ramp { from: -0.02, to: 0.1, duration_s: 0.3 },
            Phase::Cruise { velocity: -0.05, duration_s: 2.0 },
            Phase::Sinusoid { amplitude_m: 1e-4, frequency_hz: 0.5, cycles: 2.0 },
            Phase::Modulated { mean: 0.01, depth: 0.8, frequency_hz: 1.0, cycles: 3.0 },
        ];
        for phase in phases {
            let (end, h) = (phase.duration_s(), 1e-5);
            assert_eq!(phase.at(0.0).position_m, 0.0, "{phase:?}");
            assert!((phase.at(end).position_m - phase.travel_m()).abs() < 1e-15, "{phase:?}");
            for n in 1..20 {
                let t = end * f64::from(n) / 20.0;
                let (a, b, now) = (phase.at(t - h), phase.at(t + h), phase.at(t));
                let slope = |x: f64, y: f64| (y - x) / (2.0 * h);
                assert!((slope(a.position_m, b.position_m) - now.velocity_m_s).abs() < 1e-8, "{phase:?} at {t}");
                assert!((slope(a.velocity_m_s, b.velocity_m_s) - now.acceleration_m_s2).abs() < 1e-6, "{phase:?}");
            }
        }
        let ramp = phases[1];
        assert_eq!((ramp.at(0.0).velocity_m_s, ramp.at(0.3).velocity_m_s), (-0.02, 0.1));
        assert!((ramp.at(0.15).acceleration_m_s2 - 1.5 * 0.12 / 0.3).abs() < 1e-12);
    }
}
