//! Scales of charts: from values to places, and the marks in between.

/// How values are spaced.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Spacing {
    /// Evenly.
    Linear,
    /// By their logarithm; only positive values have a place.
    Logarithmic,
}

/// A stretch of values.
#[derive(Clone, Copy, Debug)]
pub struct Scale {
    /// Value at the start.
    pub from: f64,
    /// Value at the end.
    pub to: f64,
    spacing: Spacing,
    step: f64,
}

impl Scale {
    /// Exactly over the values, about `marks` marks.
    pub fn over(values: impl Iterator<Item = f64>, spacing: Spacing, marks: f64) -> Self {
        let usable = |v: &f64| v.is_finite() && (spacing == Spacing::Linear || *v > 0.0);
        let (from, to) =
            values.filter(usable).fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
        let (from, to) = if from <= to { (from, to) } else { (0.1, 1.0) };
        let (from, to) = match spacing {
            Spacing::Linear if to - from < 1e-12 * to.abs() || to == from => {
                let reach = if from == 0.0 { 1.0 } else { 0.05 * from.abs() };
                (from - reach, to + reach)
            }
            Spacing::Logarithmic if to < 1.01 * from => (0.8 * from, 1.25 * to),
            _ => (from, to),
        };
        Scale { from, to, spacing, step: nice_step((to - from) / marks) }
    }

    /// Over the values and on to the next marks.
    pub fn around(values: impl Iterator<Item = f64>, spacing: Spacing, marks: f64) -> Self {
        let over = Self::over(values, spacing, marks);
        match spacing {
            Spacing::Linear => {
                // a mark that the data pass by a hair serves as well
                let (from, to) = (
                    (over.from / over.step + 0.02).floor() * over.step,
                    (over.to / over.step - 0.02).ceil() * over.step,
                );
                Scale { from, to: if to > from { to } else { from + over.step }, ..over }
            }
            Spacing::Logarithmic => Scale { from: over.from / 1.15, to: over.to * 1.15, ..over },
        }
    }

    /// Whether a value has a place.
    pub fn can_show(&self, value: f64) -> bool {
        value.is_finite() && (self.spacing == Spacing::Linear || value > 0.0)
    }

    /// Where a value stands, 0 at the start and 1 at the end.
    pub fn share(&self, value: f64) -> f64 {
        match self.spacing {
            Spacing::Linear => (value - self.from) / (self.to - self.from),
            Spacing::Logarithmic => (value.max(1e-300) / self.from).ln() / (self.to / self.from).ln(),
        }
    }

    /// Values worth a line and a number.
    pub fn marks(&self) -> Vec<f64> {
        match self.spacing {
            Spacing::Linear => {
                let first = (self.from / self.step - 1e-9).ceil();
                let count = ((self.to - first * self.step) / self.step + 1e-9).floor().max(0.0) as usize + 1;
                (0..count).map(|n| (first + n as f64) * self.step).collect()
            }
            Spacing::Logarithmic => {
                let decades = (self.to / self.from).log10();
                let steps: &[f64] = if decades < 2.5 { &[1.0, 2.0, 5.0] } else { &[1.0] };
                let stride = if decades > 9.0 { 3 } else { 1 };
                let (first, last) = (self.from.log10().floor() as i32, self.to.log10().ceil() as i32);
                (first..=last)
                    .filter(|power| power % stride == 0)
                    .flat_map(|power| steps.iter().map(move |n| n * 10f64.powi(power)))
                    .filter(|mark| *mark >= self.from * 0.999 && *mark <= self.to * 1.001)
                    .collect()
            }
        }
    }

    /// A mark's number.
    pub fn label(&self, mark: f64) -> String {
        match self.spacing {
            Spacing::Linear => label(mark, self.step),
            Spacing::Logarithmic => label(mark, mark),
        }
    }
}

/// 1, 2 or 5 times a power of ten, not below `least`.
fn nice_step(least: f64) -> f64 {
    let power = 10f64.powf(least.log10().floor());
    [1.0, 2.0, 5.0].into_iter().map(|n| n * power).find(|step| *step >= 0.999 * least).unwrap_or(10.0 * power)
}

/// A number with the digits that a step of this size needs; powers of ten where they read better.
pub fn label(value: f64, step: f64) -> String {
    let step = step.abs();
    if value == 0.0 || value.abs() < 1e-9 * step {
        return "0".to_owned();
    }
    if !(1e-4..1e6).contains(&value.abs()) {
        let digits = (value.abs().log10().floor() - step.log10().floor()).clamp(0.0, 4.0) as usize;
        return format!("{value:.digits$e}");
    }
    let digits = (-(step * 1.000_001).log10().floor()).clamp(0.0, 9.0) as usize;
    format!("{value:.digits$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn linear_marks_are_round_and_cover() {
        let scale = Scale::around([0.13, 0.97].into_iter(), Spacing::Linear, 6.0);
        assert_eq!((scale.from, scale.to), (0.0, 1.0));
        let labels: Vec<_> = scale.marks().iter().map(|m| scale.label(*m)).collect();
        assert_eq!(labels, ["0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert!((scale.share(0.25) - 0.25).abs() < 1e-12);
    }

    #[test]
    fn logarithmic_marks_are_decades_or_their_parts() {
        let wide = Scale::over([1e-13, 1e-9].into_iter(), Spacing::Logarithmic, 10.0);
        let labels: Vec<_> = wide.marks().iter().map(|m| wide.label(*m)).collect();
        assert_eq!(labels, ["1e-13", "1e-12", "1e-11", "1e-10", "1e-9"]);
        let narrow = Scale::over([0.1, 6.0].into_iter(), Spacing::Logarithmic, 10.0);
        let labels: Vec<_> = narrow.marks().iter().map(|m| narrow.label(*m)).collect();
        assert_eq!(labels, ["0.1", "0.2", "0.5", "1", "2", "5"]);
        assert!((wide.share(1e-11) - 0.5).abs() < 1e-12);
        assert!(!wide.can_show(0.0));
    }

    #[test]
    fn one_value_and_no_value_have_a_scale() {
        for values in [vec![], vec![3.0], vec![0.0], vec![f64::NAN]] {
            let scale = Scale::around(values.into_iter(), Spacing::Linear, 6.0);
            assert!(scale.to > scale.from && !scale.marks().is_empty());
        }
    }
}
