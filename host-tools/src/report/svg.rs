//! The picture of a run: estimate against truth, why there was none, drag force, speed, temperature.
//!
//! Hand-written SVG. Colours are CSS classes, so that one file serves light and dark screens and print; they are
//! those of Okabe and Ito, told apart by colour-blind readers, and no meaning rests on colour alone: lines
//! differ in style, silences in their row.

use std::fmt::Write;

use model_core::sample::Reason;

use crate::judgement::{Point, silence};

const WIDTH: f64 = 1000.0;
const LEFT: f64 = 92.0;
const RIGHT: f64 = 945.0;
/// Share of a step that data may stand out beyond the last mark.
const HAIR: f64 = 0.02;
/// From the upper edge of a panel up to its title and legend.
const TITLE_RISE: f64 = 9.0;
/// Between the lower edge of a panel and the upper one of the next.
const GUTTER: f64 = 40.0;
/// Largest mean width of a letter of 12 px, px; there are no font metrics here.
const LETTER: f64 = 6.9;
/// Height of a row of the strip.
const ROW: f64 = 17.0;

const STYLE: &str = "\
text{font:12px system-ui,'Segoe UI','DejaVu Sans',sans-serif;fill:#1b1f23}\
.head{font-size:17px;font-weight:600}.name{font-weight:600}.soft{fill:#57606a}\
.paper{fill:#fff}.panel{fill:none;stroke:#8c959f}.grid{stroke:#d8dee4}\
.line{fill:none;stroke-linejoin:round;stroke-linecap:round}\
.estimate{stroke:#0072b2;stroke-width:2}.band{fill:#56b4e9;fill-opacity:.4}\
.truth{stroke:#1b1f23;stroke-width:1.3;stroke-dasharray:5 4}\
.drag{stroke:#d55e00;stroke-width:2}.speed{stroke:#57606a;stroke-width:1.5}.temperature{stroke:#aa4499;stroke-width:2}\
.stripe{fill:#f3f5f7}.standing{fill:#8c959f}.turning{fill:#e69f00}.changing{fill:#009e73}.window{fill:#56b4e9}\
.sensor{fill:#d55e00}.range{fill:#cc79a7}.unset{fill:#0072b2}\
@media screen and (prefers-color-scheme:dark){\
text{fill:#e6edf3}.soft{fill:#9da7b1}.paper{fill:#0d1117}.panel{stroke:#6e7681}.grid{stroke:#30363d}\
.estimate{stroke:#56b4e9}.band{fill:#0072b2;fill-opacity:.55}.truth{stroke:#e6edf3}.drag{stroke:#f0883e}\
.speed{stroke:#9da7b1}.temperature{stroke:#e58fc8}.stripe{fill:#161b22}}";

/// A run as a self-contained SVG of 1000 px width.
///
/// Points in the order of time; none give an empty frame. Coordinates are written to 0.1 px.
pub fn picture(title: &str, subtitle: &str, points: &[Point]) -> String {
    let mut drawing = Drawing {
        body: String::new(),
        y: 52.0,
        time: Axis::around(points.iter().map(|p| p.time_s).chain([0.0]), 12.0),
    };
    drawing.text(LEFT, 26.0, "start", "head", title);
    drawing.text(LEFT, 45.0, "start", "soft", subtitle);
    drawing.preload(points);
    drawing.silences(points);
    drawing.drag(points);
    drawing.speed(points);
    drawing.temperature(points);
    drawing.close()
}

/// A stretch of values, a little larger than the data, with its marks.
#[derive(Clone, Copy)]
struct Axis {
    from: f64,
    to: f64,
    step: f64,
}

impl Axis {
    /// Over the data, ending at marks.
    fn around(values: impl Iterator<Item = f64>, marks: f64) -> Self {
        let Axis { from, to, .. } = Self::over(values);
        let step = nice_step((to - from) / marks);
        // a mark that the data miss or pass by a hair serves as well
        Axis { from: (from / step + HAIR).floor() * step, to: (to / step - HAIR).ceil() * step, step }
    }

    /// Exactly over the data; never of no length.
    fn over(values: impl Iterator<Item = f64>) -> Self {
        let (from, to) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
        let (from, to) = if from <= to { (from, to) } else { (0.0, 1.0) };
        // a single value stands in the middle, with a hundredth of it, or 1, to either side
        let (from, to) =
            if to > from { (from, to) } else { (from - (0.01 * from.abs()).max(1.0), to + (0.01 * to.abs()).max(1.0)) };
        Axis { from, to, step: nice_step((to - from) / 12.0) }
    }

    fn marks(self) -> impl Iterator<Item = f64> {
        let first = (self.from / self.step - 1e-9).ceil();
        let count = ((self.to - first * self.step) / self.step + 1e-9).floor() as usize + 1;
        (0..count).map(move |n| (first + n as f64) * self.step)
    }

    fn share(self, value: f64) -> f64 {
        (value - self.from) / (self.to - self.from)
    }
}

/// 1, 2 or 5 times a power of ten, not below `least`.
fn nice_step(least: f64) -> f64 {
    let power = 10f64.powf(least.log10().floor());
    [1.0, 2.0, 5.0].into_iter().map(|n| n * power).find(|step| *step >= least).unwrap_or(10.0 * power)
}

/// A panel's place on the page.
#[derive(Clone, Copy)]
struct Panel {
    top: f64,
    height: f64,
    axis: Axis,
}

impl Panel {
    fn y(self, value: f64) -> f64 {
        self.top + self.height * (1.0 - self.axis.share(value))
    }
}

/// A line of the legend: its CSS class, whether it is an area, and what it says.
type Key<'a> = (&'a str, bool, &'a str);

struct Drawing {
    body: String,
    /// lower edge of what has been drawn
    y: f64,
    time: Axis,
}

impl Drawing {
    fn preload(&mut self, points: &[Point]) {
        let ends = points.iter().flat_map(|p| {
            let (value, width) = (p.preload_n.map(f64::from), p.sigma_n.map(|s| 2.0 * f64::from(s)));
            [value.zip(width).map(|(v, w)| v - w), value.zip(width).map(|(v, w)| v + w), p.truth_n]
        });
        let keys = [("estimate", false, "estimate of the block"), ("band", true, "± 2σ"), ("truth", false, "truth")];
        let panel = self.panel("Preload (N)", 250.0, Axis::around(ends.flatten(), 6.0), &keys);
        let known = |p: &Point| Some((f64::from(p.preload_n?), 2.0 * f64::from(p.sigma_n?)));
        for run in runs(points, known) {
            let upper = run.iter().map(|(t, (v, w))| (*t, v + w));
            let lower = run.iter().rev().map(|(t, (v, w))| (*t, v - w));
            let outline = self.path(panel, upper.chain(lower));
            self.push(format_args!("<path class=\"band\" d=\"{outline}Z\"/>"));
        }
        self.curve("estimate", panel, points, |p| p.preload_n.map(f64::from));
        // last, so that a good estimate does not hide it
        self.curve("truth", panel, points, |p| p.truth_n);
    }

    fn silences(&mut self, points: &[Point]) {
        let reasons = silence(points);
        let top = self.y + GUTTER;
        self.text(LEFT, top - TITLE_RISE, "start", "name", "Why the block gave no preload");
        let total = points.len().max(1) as f64;
        let spoke = points.iter().filter(|p| p.reason.is_none()).count() as f64;
        let share = format!("preload given in {:.0} % of all readings", 100.0 * spoke / total);
        self.text(RIGHT, top - TITLE_RISE, "end", "soft", &share);
        let period = usual_step(points);
        for (n, (reason, count)) in reasons.iter().enumerate() {
            let y = top + ROW * n as f64;
            self.push(format_args!(
                "<rect class=\"stripe\" x=\"{LEFT}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\"/>",
                y + 1.0,
                RIGHT - LEFT,
                ROW - 2.0
            ));
            for run in runs(points, |p| (p.reason == Some(*reason)).then_some(())) {
                // a reading stands for the time since the one before
                let (Some(first), Some(last)) = (run.first(), run.last()) else { continue };
                let (x0, x1) = (self.x((first.0 - period).max(self.time.from)), self.x(last.0));
                self.push(format_args!(
                    "<rect class=\"{}\" x=\"{x0:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\"/>",
                    class_of(*reason),
                    y + 3.0,
                    (x1 - x0).max(1.2),
                    ROW - 6.0
                ));
            }
            let percent = format!("{:.1} %", 100.0 * *count as f64 / total);
            self.text(RIGHT + 8.0, y + 12.5, "start", "soft", &percent);
        }
        self.y = top + ROW * reasons.len().max(1) as f64;
        // names over the stripes, last, so that no bar covers them
        for (n, (reason, _)) in reasons.iter().enumerate() {
            let y = top + ROW * n as f64 + 12.5;
            self.text(LEFT - 6.0, y, "end", "soft", short_name(*reason));
        }
    }

    fn drag(&mut self, points: &[Point]) {
        let known = |p: &Point| p.drag_force_n.map(f64::from);
        let axis = Axis::around(points.iter().filter_map(known), 4.0);
        let panel = self.panel("Drag force in steady motion (N)", 110.0, axis, &[]);
        self.curve("drag", panel, points, known);
    }

    fn speed(&mut self, points: &[Point]) {
        let known = |p: &Point| p.speed_m_s.map(|v| 1000.0 * f64::from(v));
        let axis = Axis::around(points.iter().filter_map(known), 4.0);
        let panel = self.panel("Speed (mm/s)", 80.0, axis, &[]);
        self.curve("speed", panel, points, known);
    }

    fn temperature(&mut self, points: &[Point]) {
        let known = |p: &Point| p.temperature_degc.map(f64::from);
        let axis = Axis::around(points.iter().filter_map(known), 3.0);
        let panel = self.panel("Temperature of the block (°C)", 80.0, axis, &[]);
        self.curve("temperature", panel, points, known);
        let bottom = self.y;
        for mark in self.time.marks() {
            self.text(self.x(mark), bottom + 16.0, "middle", "soft", &plain(mark, self.time.step));
        }
        self.text(0.5 * (LEFT + RIGHT), bottom + 34.0, "middle", "soft", "time (s)");
        self.y = bottom + 34.0;
    }

    /// Frame, grid, marks, title on the left and legend on the right of the line above.
    fn panel(&mut self, title: &str, height: f64, axis: Axis, keys: &[Key<'_>]) -> Panel {
        let panel = Panel { top: self.y + GUTTER, height, axis };
        let bottom = panel.top + height;
        for mark in axis.marks() {
            let y = panel.y(mark);
            self.push(format_args!("<path class=\"grid\" d=\"M{LEFT} {y:.1}H{RIGHT}\"/>"));
            self.text(LEFT - 6.0, y + 4.0, "end", "soft", &plain(mark, axis.step));
        }
        for mark in self.time.marks() {
            let x = self.x(mark);
            self.push(format_args!("<path class=\"grid\" d=\"M{x:.1} {:.1}V{bottom:.1}\"/>", panel.top));
        }
        self.push(format_args!(
            "<rect class=\"panel\" x=\"{LEFT}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{height:.1}\"/>",
            panel.top,
            RIGHT - LEFT
        ));
        self.text(LEFT, panel.top - TITLE_RISE, "start", "name", title);
        self.legend(panel.top - TITLE_RISE, keys);
        self.y = bottom;
        panel
    }

    /// Keys side by side, the last one ending at the right edge of the panel.
    fn legend(&mut self, y: f64, keys: &[Key<'_>]) {
        const SWATCH: f64 = 26.0;
        const AFTER_SWATCH: f64 = 6.0;
        const BETWEEN: f64 = 18.0;
        let width = |text: &str| SWATCH + AFTER_SWATCH + LETTER * text.chars().count() as f64 + BETWEEN;
        let mut x = RIGHT + BETWEEN - keys.iter().map(|(_, _, text)| width(text)).sum::<f64>();
        for (class, area, text) in keys {
            let (to, middle) = (x + SWATCH, y - 4.0);
            match area {
                true => self.push(format_args!(
                    "<rect class=\"{class}\" x=\"{x:.1}\" y=\"{:.1}\" width=\"{SWATCH}\" height=\"10\"/>",
                    middle - 5.0
                )),
                false => self.push(format_args!("<path class=\"line {class}\" d=\"M{x:.1} {middle:.1}H{to:.1}\"/>")),
            }
            self.text(to + AFTER_SWATCH, y, "start", "soft", text);
            x += width(text);
        }
    }

    fn curve(&mut self, class: &str, panel: Panel, points: &[Point], value: impl Fn(&Point) -> Option<f64>) {
        for run in runs(points, value) {
            let line = self.path(panel, run.into_iter());
            self.push(format_args!("<path class=\"line {class}\" d=\"{line}\"/>"));
        }
    }

    fn path(&self, panel: Panel, corners: impl Iterator<Item = (f64, f64)>) -> String {
        let mut path = String::new();
        for (time, value) in corners {
            let letter = if path.is_empty() { 'M' } else { 'L' };
            // writing into a String cannot fail
            let _ = write!(path, "{letter}{:.1} {:.1}", self.x(time), panel.y(value));
        }
        path
    }

    fn x(&self, time: f64) -> f64 {
        LEFT + (RIGHT - LEFT) * self.time.share(time)
    }

    fn text(&mut self, x: f64, y: f64, anchor: &str, class: &str, text: &str) {
        let text = text.replace('&', "&amp;").replace('<', "&lt;");
        self.push(format_args!(
            "<text class=\"{class}\" x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{text}</text>"
        ));
    }

    fn push(&mut self, element: std::fmt::Arguments<'_>) {
        // writing into a String cannot fail
        let _ = writeln!(self.body, "{element}");
    }

    fn close(self) -> String {
        let height = self.y + 14.0;
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height:.0}\" role=\"img\" \
             aria-label=\"preload, drag force, speed and temperature over time\">\n\
             <style>{STYLE}</style>\n\
             <rect class=\"paper\" width=\"{WIDTH}\" height=\"{height:.0}\"/>\n{}</svg>\n",
            self.body
        )
    }
}

/// The stretches over which there is a value and no reading is missing.
fn runs<T>(points: &[Point], value: impl Fn(&Point) -> Option<T>) -> Vec<Vec<(f64, T)>> {
    let step = usual_step(points);
    let mut all: Vec<Vec<(f64, T)>> = Vec::new();
    let mut before: Option<f64> = None;
    for point in points {
        let Some(value) = value(point) else {
            before = None;
            continue;
        };
        match (all.last_mut(), before) {
            (Some(run), Some(time)) if point.time_s - time < 1.5 * step => run.push((point.time_s, value)),
            _ => all.push(vec![(point.time_s, value)]),
        }
        before = Some(point.time_s);
    }
    all
}

/// The median time between readings, s.
fn usual_step(points: &[Point]) -> f64 {
    let mut steps: Vec<_> = points.windows(2).map(|w| w[1].time_s - w[0].time_s).collect();
    steps.sort_by(f64::total_cmp);
    steps.get(steps.len() / 2).copied().unwrap_or(0.0)
}

/// What a mark says: as many decimals as its step has.
fn plain(mark: f64, step: f64) -> String {
    let decimals = (-step.log10().floor()).max(0.0) as usize;
    // no "-0"
    format!("{:.decimals$}", mark + 0.0)
}

/// The colour class of a reason: its own for ordinary states of an axis, that of its kind for faults.
fn class_of(reason: Reason) -> &'static str {
    match reason {
        Reason::NoMotion => "standing",
        Reason::Reversing => "turning",
        Reason::Accelerating => "changing",
        Reason::Settling | Reason::SamplesLost | Reason::Stale => "window",
        Reason::ForceAtRail | Reason::ForceStuck | Reason::EncoderStuck | Reason::TemperatureMissing => "sensor",
        Reason::TemperatureOutOfRange | Reason::SpeedOutOfRange | Reason::LoadOutOfRange | Reason::ForceAssists => {
            "range"
        }
        Reason::NotCalibrated => "unset",
    }
}

/// Short enough for the margin.
fn short_name(reason: Reason) -> &'static str {
    match reason {
        Reason::NotCalibrated => "not calib.",
        Reason::ForceAtRail => "force rail",
        Reason::ForceStuck => "force stuck",
        Reason::EncoderStuck => "enc. stuck",
        Reason::TemperatureMissing => "no temp.",
        Reason::TemperatureOutOfRange => "temp. range",
        Reason::SamplesLost => "lost",
        Reason::SpeedOutOfRange => "speed range",
        Reason::LoadOutOfRange => "load range",
        Reason::ForceAssists => "assisted",
        Reason::NoMotion => "standing",
        Reason::Reversing => "reversing",
        Reason::Accelerating => "accelerating",
        Reason::Settling => "settling",
        Reason::Stale => "stale",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(n: u32, preload_n: Option<f32>) -> Point {
        Point {
            time_s: f64::from(n) / 10.0,
            preload_n,
            sigma_n: preload_n.map(|_| 50.0),
            truth_n: Some(3000.0),
            reason: preload_n.is_none().then_some(Reason::Reversing),
            drag_force_n: preload_n.map(|_| 20.0),
            speed_m_s: Some(0.05),
            temperature_degc: Some(25.0),
        }
    }

    #[test]
    fn axes_end_at_round_marks() {
        for (from, to, marks) in [
            (2211.0, 3240.0, &[2200.0, 2400.0, 2600.0, 2800.0, 3000.0, 3200.0, 3400.0][..]),
            (-0.3, 0.7, &[-0.4, -0.2, 0.0, 0.2, 0.4, 0.6, 0.8]),
            (24.0, 24.0, &[23.0, 23.5, 24.0, 24.5, 25.0]),
        ] {
            let axis = Axis::around([from, to].into_iter(), 6.0);
            let got: Vec<_> = axis.marks().collect();
            assert_eq!(got.len(), marks.len(), "{got:?}");
            assert!(got.iter().zip(marks).all(|(a, b)| (a - b).abs() < 1e-9), "{got:?}");
        }
        assert_eq!(plain(-0.0, 0.5), "0.0");
        assert_eq!(plain(2400.0, 200.0), "2400");
    }

    #[test]
    fn a_silence_or_a_lost_reading_breaks_the_line() {
        let mut points: Vec<_> = (0..40).map(|n| point(n, (n != 10).then_some(3000.0))).collect();
        points.remove(25);
        let found = runs(&points, |p| p.preload_n);
        let ends: Vec<_> = found.iter().map(|run| (run[0].0, run[run.len() - 1].0)).collect();
        assert_eq!(ends, [(0.0, 0.9), (1.1, 2.4), (2.6, 3.9)]);
    }

    #[test]
    fn every_silence_is_drawn_and_named() {
        let points: Vec<_> = (0..40).map(|n| point(n, (n % 10 != 5).then_some(3000.0))).collect();
        let drawn = picture("a < b & c", "", &points);
        assert_eq!(drawn.matches("<rect class=\"turning\"").count(), 4);
        assert_eq!(drawn.matches("<path class=\"band\"").count(), 5);
        assert!(drawn.contains(">reversing</text>") && drawn.contains(">10.0 %</text>"));
        assert!(drawn.contains("a &lt; b &amp; c"));
        assert!(!drawn.contains("NaN") && !drawn.contains("inf"));
        assert!(!picture("nothing", "", &[]).contains("NaN"));
    }
}
