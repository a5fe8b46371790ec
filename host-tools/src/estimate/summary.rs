//! All windows of a recording in a few numbers.

use model_core::sample::Reason;

use super::Estimate;

/// Number of stretches of the rail in the table by position.
const PLACES: usize = 10;

/// Preload over a recording.
#[derive(Clone, Debug, PartialEq)]
pub struct Summary {
    /// Windows in all.
    pub windows: usize,
    /// Windows with a preload.
    pub usable: usize,
    /// Windows without, by their most urgent reason.
    pub refused: Vec<(Reason, usize)>,
    /// Median preload, N; NaN without a usable window.
    pub preload_n: f64,
    /// Its standard deviation, N: scatter of the windows over the root of their number, and the law's.
    pub sigma_n: f64,
    /// The part of that which belongs to the law, N.
    pub model_n: f64,
    /// 5 % and 95 % of the windows lie below, N.
    pub spread_n: (f64, f64),
    /// By position, from the lowest on; empty where it was not measured.
    pub places: Vec<Place>,
}

/// Preload on one stretch of the rail.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Start of the stretch, m.
    pub from_m: f64,
    /// End, m.
    pub to_m: f64,
    /// Usable windows with their middle in it.
    pub windows: usize,
    /// Median preload, N; NaN without a window.
    pub preload_n: f64,
    /// Its standard deviation from noise alone, N.
    pub noise_n: f64,
}

impl Summary {
    /// Sums up.
    pub fn of(estimates: &[Estimate]) -> Self {
        let refused = |reason: Reason| {
            let count = estimates.iter().filter(|e| e.reasons.first() == Some(reason)).count();
            (count > 0).then_some((reason, count))
        };
        let found: Vec<_> = estimates.iter().filter_map(|e| e.preload.map(|p| (e.window.position_m, p))).collect();
        let mut values: Vec<f64> = found.iter().map(|(_, p)| p.value_n).collect();
        let mut models: Vec<f64> = found.iter().map(|(_, p)| p.model_n).collect();
        let preload_n = quantile(&mut values, 0.5);
        let model_n = quantile(&mut models, 0.5);
        let spread_n = (quantile(&mut values, 0.05), quantile(&mut values, 0.95));
        // standard deviation of a median of normal values
        let noise_n = 1.2533 * deviation(&values) / libm::sqrt(values.len() as f64);
        let (low, high) =
            found.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), (x, _)| (a.min(*x), b.max(*x)));
        let width = (high - low) / PLACES as f64;
        let places = if width > 0.0 && width.is_finite() {
            (0..PLACES)
                .map(|n| {
                    let is_here = |x: f64| (((x - low) / width) as usize).min(PLACES - 1) == n;
                    let mut here: Vec<f64> =
                        found.iter().filter(|(x, _)| is_here(*x)).map(|(_, p)| p.value_n).collect();
                    let median = quantile(&mut here, 0.5);
                    Place {
                        from_m: low + n as f64 * width,
                        to_m: low + (n + 1) as f64 * width,
                        windows: here.len(),
                        preload_n: median,
                        noise_n: 1.2533 * deviation(&here) / libm::sqrt(here.len() as f64),
                    }
                })
                .collect()
        } else {
            Vec::new()
        };
        Summary {
            windows: estimates.len(),
            usable: found.len(),
            refused: Reason::ALL.into_iter().filter_map(refused).collect(),
            preload_n,
            sigma_n: libm::hypot(noise_n, model_n),
            model_n,
            spread_n,
            places,
        }
    }
}

/// Quantile: the value below which a part of the values lies; NaN without values. Sorts them.
fn quantile(values: &mut [f64], part: f64) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    let place = part * values.len().saturating_sub(1) as f64;
    let (low, high) = (values.get(place as usize), values.get(libm::ceil(place) as usize));
    match (low, high) {
        (Some(low), Some(high)) => low + (high - low) * place.fract(),
        _ => f64::NAN,
    }
}

fn deviation(values: &[f64]) -> f64 {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    // one value has no scatter
    libm::sqrt(values.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / (n - 1.0).max(1.0))
}
