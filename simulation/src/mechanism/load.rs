//! Loads beside the preload.

use super::Id;
use super::column::{even, shown};
use super::definition::{Definition, Form, Kind, Sign, amplitude};

/// `ΣQ/ΣQ_0 = ((1+t)^1.5 + (1-t)^1.5)/2`, `(1+t)^1.5 - (1-t)^1.5 = W/F_p`
pub(super) const EXTERNAL_LOAD: Definition = Definition {
    id: Id::ExternalLoad,
    kind: Kind::Physics,
    forms: &[Form {
        name: "preloaded-rows",
        shape: &[],
        amplitudes: &[amplitude("share", "", Sign::Positive, 1.0)],
        columns: |c, _| {
            let load = c.run.external_load_n.as_ref()?;
            let preload = &c.steady.preload_n;
            (!preload.is_empty()).then_some(())?;
            shown([even(c, |n| {
                let ratio = load[n].abs() / preload[n];
                // drag grows with the sum of the loads as it does with the preload
                if ratio.is_finite() { c.by_preload_n[n] * ratio_of_loads(ratio).ln() } else { 0.0 }
            })])
        },
        phase_bound: false,
    }],
    axis: "load",
    statement: "The load on the block changes the forces on its balls, and with them the drag.",
    falsifier: "Known weights of either sign must raise the drag alike, four percent at a load equal to the preload.",
    next_experiment: "P9",
    simplicity: 2,
};

/// `ΔF ~ F_p-dependent drag · (lever force)²`: pitch and yaw of the block.
pub(super) const MOMENT_LOAD: Definition = Definition {
    id: Id::MomentLoad,
    kind: Kind::Physics,
    forms: &[Form {
        name: "quadratic",
        shape: &[],
        amplitudes: &[amplitude("at_100_n", "", Sign::Positive, 0.05)],
        columns: |c, _| {
            (!c.steady.preload_n.is_empty()).then_some(())?;
            shown([even(c, |n| {
                let force = c.steady.force_n[n] / 100.0;
                if force.is_finite() { c.by_preload_n[n] * force * force } else { 0.0 }
            })])
        },
        phase_bound: false,
    }],
    axis: "load",
    statement: "The drive pulls beside the guide: the moment loads some balls more, and spin adds drag.",
    falsifier: "Pulling at another height must change it with the square of the lever.",
    next_experiment: "P9",
    simplicity: 6,
};

/// Sum of the ball loads over that without external load, for a load over preload.
fn ratio_of_loads(ratio: f64) -> f64 {
    let difference = |t: f64| (1.0 + t).powf(1.5) - (1.0 - t).max(0.0).powf(1.5);
    // beyond t = 1 one side is unloaded: the other carries the load alone
    let (mut low, mut high) = (0.0, 1.0f64.max(ratio.powf(2.0 / 3.0)));
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if difference(middle) < ratio { low = middle } else { high = middle }
    }
    0.5 * ((1.0 + low).powf(1.5) + (1.0 - low).max(0.0).powf(1.5))
}

#[cfg(test)]
mod tests {
    use super::ratio_of_loads;

    /// Hertz rows of a preloaded block; decompression at a load of 2√2 preloads.
    #[test]
    fn loads_add_up_as_hertz_says() {
        for (load, drag) in
            [(0.0, 1.0), (0.5, 1.011), (1.0, 1.042), (2.0, 1.18), (2.0 * 2f64.sqrt(), 1.414), (4.0, 2.0)]
        {
            assert!((ratio_of_loads(load) - drag).abs() < 2e-3, "{load}: {}", ratio_of_loads(load));
        }
    }
}
