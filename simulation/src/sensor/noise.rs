//! Seeded noise, the same on every machine.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};

/// White Gaussian noise of unit variance.
///
/// ChaCha with 8 rounds (Bernstein 2008), the seed spread by `seed_from_u64`, drives the Marsaglia polar method;
/// logarithm and square root come from `libm`, so a seed gives the same numbers everywhere.
#[derive(Clone, Debug)]
pub struct Noise {
    source: ChaCha8Rng,
    spare: Option<f64>,
}

impl Noise {
    /// One of the independent sequences for a seed.
    pub fn new(seed: u64, stream: u64) -> Self {
        let mut source = ChaCha8Rng::seed_from_u64(seed);
        source.set_stream(stream);
        Noise { source, spare: None }
    }

    /// The next value.
    pub fn gaussian(&mut self) -> f64 {
        if let Some(spare) = self.spare.take() {
            return spare;
        }
        loop {
            let (x, y) = (self.even(), self.even());
            let square = x * x + y * y;
            if square > 0.0 && square < 1.0 {
                let scale = libm::sqrt(-2.0 * libm::log(square) / square);
                self.spare = Some(y * scale);
                return x * scale;
            }
        }
    }

    /// The next uniform number between -1 and 1, from the same sequence.
    pub fn even(&mut self) -> f64 {
        // the upper 53 bits fill the mantissa
        (self.source.next_u64() >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn is_gaussian_and_white_and_repeats() {
        let values = |seed, stream| {
            let mut noise = Noise::new(seed, stream);
            (0..100_000).map(|_| noise.gaussian()).collect::<Vec<f64>>()
        };
        let x = values(7, 0);
        let moment = |power: i32| x.iter().map(|v| v.powi(power)).sum::<f64>() / x.len() as f64;
        // standard errors of the first four moments at 1e5 samples: 0.003, 0.0045, 0.012, 0.031
        for (power, expected, tolerance) in [(1, 0.0, 0.013), (2, 1.0, 0.018), (3, 0.0, 0.05), (4, 3.0, 0.13)] {
            assert!((moment(power) - expected).abs() < tolerance, "{power}: {}", moment(power));
        }
        let lagged = x.windows(2).map(|w| w[0] * w[1]).sum::<f64>() / x.len() as f64;
        assert!(lagged.abs() < 0.013, "{lagged}");
        assert_eq!(x, values(7, 0));
        for other in [values(8, 0), values(7, 1)] {
            let common = x.iter().zip(&other).map(|(a, b)| a * b).sum::<f64>() / x.len() as f64;
            assert!(common.abs() < 0.013, "{common}");
        }
    }
}
