//! A smooth function of one variable as polynomials over equal segments, for millions of rows.
//!
//! Degree 7 through the Chebyshev nodes of each segment; segments are halved until the polynomial agrees with the
//! function between the nodes. A cube root, the inverted preload law and Walther's equation need 1 to 64 of them.

use std::f64::consts::PI;

/// Coefficients per segment.
const TERMS: usize = 8;

/// Relative error between the nodes below which segments are not halved further.
const TOLERANCE: f64 = 1e-11;

/// Most segments: a function that needs more is not smooth.
const MOST_SEGMENTS: usize = 1024;

/// The table of one function.
#[derive(Clone, Debug)]
pub(super) struct Table {
    from: f64,
    to: f64,
    per_unit: f64,
    segments: Vec<[f64; TERMS]>,
}

impl Table {
    /// Tabulates `f` from `from` to `to`; `None` unless that is an interval and `f` smooth and finite in it.
    pub(super) fn of(from: f64, to: f64, f: impl Fn(f64) -> f64) -> Option<Self> {
        if !(from < to && (to - from).is_finite()) {
            return None;
        }
        let mut count = 1;
        while count <= MOST_SEGMENTS {
            let width = (to - from) / count as f64;
            let segments: Vec<_> =
                (0..count).map(|n| segment(from + (n as f64 + 0.5) * width, 0.5 * width, &f)).collect();
            let table = Table { from, to, per_unit: 1.0 / width, segments };
            // 20 points per segment, none of them a node
            let places = (0..20 * count).map(|n| from + (n as f64 + 0.5) * width / 20.0);
            let agrees = |x: f64| {
                let want = f(x);
                (table.at(x) - want).abs() <= TOLERANCE * want.abs()
            };
            if places.into_iter().all(agrees) {
                return Some(table);
            }
            count *= 2;
        }
        None
    }

    /// Whether a point lies in the table.
    pub(super) fn covers(&self, x: f64) -> bool {
        x >= self.from && x <= self.to
    }

    /// The function at a point that [`Self::covers`]; NaN for NaN.
    pub(super) fn at(&self, x: f64) -> f64 {
        let place = (x - self.from) * self.per_unit;
        let index = (place as usize).min(self.segments.len() - 1);
        let t = 2.0 * (place - index as f64) - 1.0;
        let [c0, c1, c2, c3, c4, c5, c6, c7] = self.segments[index];
        let t2 = t * t;
        // in pairs: two short dependency chains instead of one
        (c0 + t2 * (c2 + t2 * (c4 + t2 * c6))) + t * (c1 + t2 * (c3 + t2 * (c5 + t2 * c7)))
    }
}

/// Powers of t from -1 to 1 of the polynomial through the Chebyshev nodes of one segment.
fn segment(centre: f64, half: f64, f: &impl Fn(f64) -> f64) -> [f64; TERMS] {
    let nodes: [f64; TERMS] = std::array::from_fn(|n| libm::cos(PI * (2.0 * n as f64 + 1.0) / (2.0 * TERMS as f64)));
    // Newton's divided differences, then expanded
    let mut d = nodes.map(|t| f(centre + half * t));
    for order in 1..TERMS {
        for n in (order..TERMS).rev() {
            d[n] = (d[n] - d[n - 1]) / (nodes[n] - nodes[n - order]);
        }
    }
    let mut power = [0.0; TERMS];
    power[0] = d[TERMS - 1];
    for n in (0..TERMS - 1).rev() {
        for k in (1..TERMS).rev() {
            power[k] = power[k - 1] - nodes[n] * power[k];
        }
        power[0] = d[n] - nodes[n] * power[0];
    }
    power
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn follows_a_cube_root_and_refuses_a_step() {
        let table = Table::of(1.0, 30.0, libm::cbrt).expect("smooth");
        for n in 0..=1000 {
            let x = 1.0 + 29e-3 * f64::from(n);
            assert!((table.at(x) / libm::cbrt(x) - 1.0).abs() < 2e-11, "{x}");
        }
        assert!(table.covers(1.0) && table.covers(30.0) && !table.covers(30.1) && !table.covers(f64::NAN));
        assert!(Table::of(0.0, 1.0, |x| f64::from(x > 0.3)).is_none());
        assert!(Table::of(1.0, 1.0, |x| x).is_none());
        assert!(Table::of(0.0, f64::NAN, |x| x).is_none());
    }
}
