//! The grid that Zhou et al. 2023 measured: every lateral force at every speed.

/// Lateral forces on the split block, N.
pub const LATERAL_N: [f64; 10] = [500.0, 1500.0, 2500.0, 3500.0, 4500.0, 5500.0, 6500.0, 7500.0, 8500.0, 9500.0];

/// Carriage speeds, m/min.
pub const SPEEDS_M_MIN: [f64; 20] =
    [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 4.5, 5.0, 5.5, 6.0];
