//! What the noise looks like, and the filter that makes it white.
//!
//! Friction noise is coloured and its slow part looks like drift, wear and warm-up. The filter has two stages:
//!
//! 1. an autoregression of the order that the information criterion asks for (exact from the first row of a stretch
//!    on: Durbin and Levinson's predictors of every lower order),
//! 2. first-order shelves, one an octave, for the slow part that no short autoregression sees. Their heights come
//!    from the Haar (Allan) variance of what stage 1 leaves. Towards rest the noise is never taken to fall, and a
//!    variance that few differences tell is taken larger than it looks.
//!
//! Both are linear and the same for every column, so that a fit stays unbiased whatever they get wrong; what they get
//! wrong about the size of the noise is the matter of [`crate::locks`].

/// Longest autoregression.
const MAX_ORDER: usize = 16;

/// A filter that makes the noise white with variance 1.
#[derive(Clone, Debug)]
pub(crate) struct Whitening {
    /// Predictors of order 0, 1, ..; the last is that of the stationary filter.
    predictors: Vec<Vec<f64>>,
    /// 1/σ of the innovation of each order.
    gains: Vec<f64>,
    shelves: Vec<Shelf>,
}

/// `H(s) = (s + ω_z)/(s + ω_p)`, bilinear.
#[derive(Clone, Copy, Debug)]
struct Shelf {
    b: [f64; 2],
    a: f64,
    at_rest: f64,
}

impl Shelf {
    /// Lets the power below `frequency` (of the sampling rate) through by 1/`ratio`.
    fn new(frequency: f64, ratio: f64) -> Self {
        let omega = std::f64::consts::TAU * frequency;
        let quarter = ratio.sqrt().sqrt();
        let (pole, zero) = (omega * quarter, omega / quarter);
        Shelf {
            b: [(2.0 + zero) / (2.0 + pole), (zero - 2.0) / (2.0 + pole)],
            a: (pole - 2.0) / (2.0 + pole),
            at_rest: zero / pole,
        }
    }

    /// As if the first row had lasted for ever before it.
    fn apply(&self, x: &mut [f64]) {
        let Some(first) = x.first() else { return };
        let (mut before, mut out) = (*first, *first * self.at_rest);
        for x in x {
            let next = self.b[0] * *x + self.b[1] * before - self.a * out;
            before = *x;
            out = next;
            *x = next;
        }
    }
}

impl Whitening {
    /// Leaves everything as it is.
    pub(crate) fn none() -> Self {
        Whitening { predictors: vec![Vec::new()], gains: vec![1.0], shelves: Vec::new() }
    }

    /// Of residuals of variance about 1, stretch by stretch.
    pub(crate) fn of(stretches: &[Vec<f64>]) -> Self {
        let mut whitening = autoregression(stretches);
        let longest = stretches.iter().map(Vec::len).max().unwrap_or(0);
        let levels = (1..).take_while(|level| longest >> level >= 2).count();
        let mut heights = vec![1.0; levels];
        for _ in 0..3 {
            let white: Vec<Vec<f64>> = stretches.iter().map(|x| whitening.applied(x)).collect();
            let measured = haar(&white, levels);
            for (height, measured) in heights.iter_mut().zip(measured) {
                *height *= measured;
            }
            let reference = heights.first().copied().unwrap_or(1.0).max(1e-9);
            let mut guarded: Vec<f64> = heights.iter().map(|height| height / reference).collect();
            for level in 1..levels {
                guarded[level] = guarded[level].max(guarded[level - 1]);
            }
            whitening.shelves = (1..levels)
                .filter(|level| guarded[*level] > 1.02 * guarded[level - 1])
                .map(|level| Shelf::new(0.5 / f64::from(1u32 << level.min(30)), guarded[level] / guarded[level - 1]))
                .collect();
        }
        whitening
    }

    /// Order of the autoregression.
    pub(crate) fn order(&self) -> usize {
        self.predictors.len() - 1
    }

    /// Filters the rows of one stretch.
    pub(crate) fn apply(&self, x: &mut Vec<f64>, spare: &mut Vec<f64>) {
        spare.clear();
        let order = self.order();
        for n in 0..x.len().min(order) {
            let predicted: f64 = self.predictors[n].iter().enumerate().map(|(k, phi)| phi * x[n - 1 - k]).sum();
            spare.push((x[n] - predicted) * self.gains[n]);
        }
        let (phi, gain) = (&self.predictors[order], self.gains[order]);
        if order == 0 {
            spare.extend(x.iter().map(|x| x * gain));
        } else {
            // newest last, as the window has it
            let reversed: Vec<f64> = phi.iter().rev().map(|phi| -phi * gain).collect();
            spare.extend(x.iter().skip(order).map(|x| x * gain));
            let filtered = spare.get_mut(order..).unwrap_or_default();
            // tap by tap over all rows: rows do not wait for one another, and every sum keeps its order
            pulp::Arch::new().dispatch(|| {
                for (n, phi) in reversed.iter().enumerate() {
                    for (sum, x) in filtered.iter_mut().zip(&x[n..]) {
                        *sum += phi * x;
                    }
                }
            });
        }
        for shelf in &self.shelves {
            shelf.apply(spare);
        }
        std::mem::swap(x, spare);
    }

    fn applied(&self, x: &[f64]) -> Vec<f64> {
        let (mut out, mut spare) = (x.to_vec(), Vec::new());
        self.apply(&mut out, &mut spare);
        out
    }
}

/// Durbin and Levinson's recursion on the pooled autocovariance.
fn autoregression(stretches: &[Vec<f64>]) -> Whitening {
    let rows: usize = stretches.iter().map(Vec::len).sum();
    let covariance: Vec<f64> = (0..=MAX_ORDER)
        .map(|lag| {
            let sum: f64 = stretches
                .iter()
                .filter(|x| x.len() > lag)
                .map(|x| x[lag..].iter().zip(&x[..x.len() - lag]).map(|(a, b)| a * b).sum::<f64>())
                .sum();
            sum / rows.max(1) as f64
        })
        .collect();
    let mut whitening = Whitening::none();
    let mut variance = covariance[0];
    if !(variance > 0.0) {
        return whitening;
    }
    whitening.gains[0] = 1.0 / variance.sqrt();
    let mut best = (rows as f64 * variance.ln(), 0);
    for order in 1..=MAX_ORDER {
        let before = &whitening.predictors[order - 1];
        let predicted: f64 = before.iter().enumerate().map(|(k, phi)| phi * covariance[order - 1 - k]).sum();
        let reflection = (covariance[order] - predicted) / variance;
        let mut phi: Vec<f64> = (0..order - 1).map(|k| before[k] - reflection * before[order - 2 - k]).collect();
        phi.push(reflection);
        variance *= 1.0 - reflection * reflection;
        if !(variance > 1e-12 * covariance[0]) {
            break;
        }
        whitening.predictors.push(phi);
        whitening.gains.push(1.0 / variance.sqrt());
        let criterion = rows as f64 * variance.ln() + order as f64 * (rows as f64).ln();
        if criterion < best.0 {
            best = (criterion, order);
        }
    }
    whitening.predictors.truncate(best.1 + 1);
    whitening.gains.truncate(best.1 + 1);
    whitening
}

/// Variance of Haar's differences, level by level: 1 at every level for white noise of variance 1.
fn haar(stretches: &[Vec<f64>], levels: usize) -> Vec<f64> {
    let (mut sums, mut counts) = (vec![0.0; levels], vec![0usize; levels]);
    for stretch in stretches {
        let mut means = stretch.clone();
        for level in 0..levels {
            let pairs = means.len() / 2;
            if pairs == 0 {
                break;
            }
            for k in 0..pairs {
                // sums of white noise, halved in variance at every step, keep the variance 1
                let (a, b) = (means[2 * k], means[2 * k + 1]);
                sums[level] += 0.5 * (a - b) * (a - b);
                means[k] = (a + b) * std::f64::consts::FRAC_1_SQRT_2;
            }
            counts[level] += pairs;
            means.truncate(pairs);
        }
    }
    let mut variances = Vec::with_capacity(levels);
    for level in 0..levels {
        let count = counts[level] as f64;
        let before = variances.last().copied().unwrap_or(1.0);
        variances.push(if counts[level] < 4 {
            before
        } else {
            let variance = sums[level] / count;
            // few differences: rather too much noise than too little
            if count < 200.0 { variance * (1.0 + 1.0 / count.sqrt()) } else { variance }
        });
    }
    variances
}

/// Standard deviation from the median of the sizes: blind to tails.
pub(crate) fn robust_sigma(x: &[f64]) -> f64 {
    if x.is_empty() {
        return 0.0;
    }
    let mut sizes: Vec<f64> = x.iter().map(|x| x.abs()).collect();
    let middle = sizes.len() / 2;
    1.4826 * *sizes.select_nth_unstable_by(middle, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;

    fn white(rows: usize, seed: u64) -> Vec<f64> {
        let mut state = seed;
        let mut uniform = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as f64 / f64::from(1u32 << 31)
        };
        (0..rows).map(|_| (0..12).map(|_| uniform()).sum::<f64>() - 6.0).collect()
    }

    fn red(rows: usize, rho: f64, seed: u64) -> Vec<f64> {
        let mut x = 0.0;
        white(rows, seed)
            .into_iter()
            .map(|e| {
                x = rho * x + e * (1.0 - rho * rho).sqrt();
                x
            })
            .collect()
    }

    #[test]
    fn noise_of_several_memories_comes_out_white_at_every_scale() {
        let stretches: Vec<Vec<f64>> = (0..8)
            .map(|n| {
                let parts = [red(8192, 0.6, 3 + n), red(8192, 0.98, 103 + n), red(8192, 0.998, 203 + n)];
                (0..8192).map(|k| parts.iter().map(|p| p[k]).sum::<f64>() / 3f64.sqrt()).collect()
            })
            .collect();
        let whitening = Whitening::of(&stretches);
        let white: Vec<Vec<f64>> = stretches.iter().map(|x| whitening.applied(x)).collect();
        for (level, variance) in haar(&white, 9).into_iter().enumerate() {
            assert!((0.45..1.35).contains(&variance), "level {level}: {variance}");
        }
    }

    #[test]
    fn white_noise_is_left_alone() {
        let whitening = Whitening::of(&[white(20_000, 5)]);
        assert!(whitening.order() <= 1);
        let out = whitening.applied(&white(1000, 6));
        let sigma = (out.iter().map(|x| x * x).sum::<f64>() / 1000.0).sqrt();
        assert!((sigma - 1.0).abs() < 0.1, "{sigma}");
    }
}
