//! Charts as self-contained SVG: lines, points with error bars, bands, bars, marked regions, and maps over two axes.
//!
//! Colours are CSS classes (those of Okabe and Ito, told apart by colour-blind readers), so that one file serves light
//! and dark screens and print; lines differ in style as well, so that no meaning rests on colour alone.

use std::fmt::Write;

use super::scale::{Scale, Spacing, label};

const WIDTH: f64 = 1000.0;
pub(super) const LEFT: f64 = 92.0;
pub(super) const RIGHT: f64 = 960.0;
const TOP: f64 = 64.0;
/// Largest mean width of a letter of 12 px, px; there are no font metrics here.
const LETTER: f64 = 6.9;
/// Largest number of drawn points of a line; more are thinned to the extremes of each column of pixels.
const MOST_POINTS: usize = 4000;

const STYLE: &str = "\
.c text{font:12px system-ui,'Segoe UI','DejaVu Sans',sans-serif;fill:#1b1f23}\
.c .head{font-size:17px;font-weight:600}.c .soft{fill:#57606a}\
.c .paper{fill:#fff}.c .panel{fill:none;stroke:#8c959f}.c .grid{stroke:#d8dee4}\
.c .line{fill:none;stroke-width:2;stroke-linejoin:round}.c .dash{stroke-dasharray:7 4}.c .dots{stroke-dasharray:2 3}\
.c .s0{stroke:#0072b2;color:#0072b2}.c .s1{stroke:#d55e00;color:#d55e00}.c .s2{stroke:#009e73;color:#009e73}\
.c .s3{stroke:#aa4499;color:#aa4499}.c .s4{stroke:#b8860b;color:#b8860b}.c .s5{stroke:#57606a;color:#57606a}\
.c .dot{fill:currentColor;stroke:none}.c .area{fill:currentColor;fill-opacity:.25;stroke:none}.c .bar{fill:currentColor;stroke:none}\
.c .region{fill:#e69f00;fill-opacity:.22}\
@media screen and (prefers-color-scheme:dark){\
.c text{fill:#e6edf3}.c .soft{fill:#9da7b1}.c .paper{fill:#0d1117}.c .panel{stroke:#6e7681}.c .grid{stroke:#30363d}\
.c .s0{stroke:#56b4e9;color:#56b4e9}.c .s1{stroke:#f0883e;color:#f0883e}.c .s2{stroke:#3fb98f;color:#3fb98f}\
.c .s3{stroke:#e58fc8;color:#e58fc8}.c .s4{stroke:#e3c04f;color:#e3c04f}.c .s5{stroke:#9da7b1;color:#9da7b1}}";

/// How a series is drawn.
#[derive(Clone, Debug)]
enum Mark {
    Line(&'static str, Vec<(f64, f64)>),
    Points(Vec<(f64, f64, f64)>),
    Band(Vec<(f64, f64, f64)>),
    Bars(Vec<(f64, f64, f64)>),
}

/// One chart: series over a common pair of axes. Values that are not finite leave gaps.
#[derive(Clone, Debug)]
pub struct Chart {
    title: String,
    x: (String, Spacing),
    y: (String, Spacing),
    height: f64,
    from_zero: bool,
    series: Vec<(String, Mark)>,
    regions: Vec<(f64, f64, String)>,
    notes: Vec<(f64, f64, String)>,
}

impl Chart {
    /// An empty chart; labels carry the unit, as in `speed (m/s)`.
    pub fn new(title: &str, x: &str, y: &str) -> Self {
        Chart {
            title: title.to_owned(),
            x: (x.to_owned(), Spacing::Linear),
            y: (y.to_owned(), Spacing::Linear),
            height: 330.0,
            from_zero: false,
            series: Vec::new(),
            regions: Vec::new(),
            notes: Vec::new(),
        }
    }

    /// Logarithmic abscissa; values that are not positive are left out.
    #[must_use]
    pub fn log_x(mut self) -> Self {
        self.x.1 = Spacing::Logarithmic;
        self
    }

    /// Logarithmic ordinate.
    #[must_use]
    pub fn log_y(mut self) -> Self {
        self.y.1 = Spacing::Logarithmic;
        self
    }

    /// The ordinate includes zero.
    #[must_use]
    pub fn from_zero(mut self) -> Self {
        self.from_zero = true;
        self
    }

    /// Height of the panel, px; 330 unless told.
    #[must_use]
    pub fn height(mut self, pixels: f64) -> Self {
        self.height = pixels;
        self
    }

    /// A solid line through (x, y).
    #[must_use]
    pub fn line(self, name: &str, points: Vec<(f64, f64)>) -> Self {
        self.with(name, Mark::Line("", points))
    }

    /// A dashed line.
    #[must_use]
    pub fn dashed(self, name: &str, points: Vec<(f64, f64)>) -> Self {
        self.with(name, Mark::Line(" dash", points))
    }

    /// A dotted line.
    #[must_use]
    pub fn dotted(self, name: &str, points: Vec<(f64, f64)>) -> Self {
        self.with(name, Mark::Line(" dots", points))
    }

    /// Points (x, y, half the length of the error bar); 0 draws no bar.
    #[must_use]
    pub fn points(self, name: &str, points: Vec<(f64, f64, f64)>) -> Self {
        self.with(name, Mark::Points(points))
    }

    /// An area between (x, lower, upper).
    #[must_use]
    pub fn band(self, name: &str, points: Vec<(f64, f64, f64)>) -> Self {
        self.with(name, Mark::Band(points))
    }

    /// Bars from zero, (from x, to x, height).
    #[must_use]
    pub fn bars(self, name: &str, bars: Vec<(f64, f64, f64)>) -> Self {
        self.with(name, Mark::Bars(bars))
    }

    /// Marks a stretch of the abscissa.
    #[must_use]
    pub fn region(mut self, from: f64, to: f64, name: &str) -> Self {
        self.regions.push((from, to, name.to_owned()));
        self
    }

    /// Writes a note beside a point.
    #[must_use]
    pub fn note(mut self, x: f64, y: f64, text: &str) -> Self {
        self.notes.push((x, y, text.to_owned()));
        self
    }

    fn with(mut self, name: &str, mark: Mark) -> Self {
        self.series.push((name.to_owned(), mark));
        self
    }

    /// The picture, 1000 px wide; coordinates are written to 0.1 px.
    pub fn svg(&self) -> String {
        let (mut xs, mut ys) = (Vec::new(), Vec::new());
        for (_, mark) in &self.series {
            match mark {
                Mark::Line(_, points) => points.iter().filter(|p| p.1.is_finite()).for_each(|(x, y)| {
                    xs.push(*x);
                    ys.push(*y);
                }),
                Mark::Points(points) => points.iter().for_each(|(x, y, bar)| {
                    xs.push(*x);
                    ys.extend([y - bar, y + bar]);
                }),
                Mark::Band(points) => points.iter().for_each(|(x, low, high)| {
                    xs.push(*x);
                    ys.extend([*low, *high]);
                }),
                Mark::Bars(bars) => bars.iter().for_each(|(from, to, y)| {
                    xs.extend([*from, *to]);
                    ys.extend([0.0, *y]);
                }),
            }
        }
        if self.from_zero {
            ys.push(0.0);
        }
        let frame = Frame {
            x: Scale::over(xs.into_iter(), self.x.1, 10.0),
            y: Scale::around(ys.into_iter(), self.y.1, 6.0),
            top: TOP,
            height: self.height,
        };
        let mut out = String::new();
        frame.grid(&mut out, &self.x.0, &self.y.0);
        for (n, (from, to, name)) in self.regions.iter().enumerate() {
            let (a, b) = (frame.x(from.max(frame.x.from)), frame.x(to.min(frame.x.to)));
            let (top, height) = (frame.top, frame.height);
            put(
                &mut out,
                &format!(
                    "<rect class=\"region\" x=\"{a:.1}\" y=\"{top:.1}\" width=\"{:.1}\" height=\"{height:.1}\"/>",
                    (b - a).max(2.0)
                ),
            );
            text(&mut out, 0.5 * (a + b), top + 15.0 * (n + 1) as f64, "middle", "soft", name);
        }
        for (n, (_, mark)) in self.series.iter().enumerate() {
            frame.draw(&mut out, n, mark);
        }
        for (x, y, note) in &self.notes {
            text(&mut out, frame.x(*x) + 8.0, frame.y(*y) - 6.0, "start", "", note);
        }
        text(&mut out, LEFT, 26.0, "start", "head", &self.title);
        self.legend(&mut out);
        close(&out, TOP + self.height + 48.0, &self.title)
    }

    fn legend(&self, out: &mut String) {
        let mut x = LEFT;
        for (n, (name, mark)) in self.series.iter().enumerate().filter(|(_, (name, _))| !name.is_empty()) {
            let y = TOP - 18.0;
            let class = format!("s{}", n % 6);
            match mark {
                Mark::Line(style, _) => {
                    put(out, &format!("<path class=\"line {class}{style}\" d=\"M{x:.1} {y:.1}h26\"/>"))
                }
                Mark::Points(_) => {
                    put(out, &format!("<circle class=\"dot {class}\" cx=\"{:.1}\" cy=\"{y:.1}\" r=\"4\"/>", x + 13.0))
                }
                Mark::Band(_) | Mark::Bars(_) => put(
                    out,
                    &format!(
                        "<rect class=\"area {class}\" x=\"{x:.1}\" y=\"{:.1}\" width=\"26\" height=\"10\"/>",
                        y - 5.0
                    ),
                ),
            }
            text(out, x + 32.0, y + 4.0, "start", "soft", name);
            x += 32.0 + LETTER * name.chars().count() as f64 + 18.0;
        }
    }
}

/// A map over two axes: cells coloured by a value, blue below and orange above zero.
#[derive(Clone, Debug)]
pub struct Map<'a> {
    /// Title.
    pub title: &'a str,
    /// Names of the columns, from left to right, and what they are.
    pub columns: (&'a str, &'a [String]),
    /// Names of the rows, from the top down, and what they are.
    pub rows: (&'a str, &'a [String]),
    /// Values, row by row; NaN is drawn empty.
    pub values: &'a [Vec<f64>],
    /// What the values are, with unit.
    pub quantity: &'a str,
}

impl Map<'_> {
    /// The picture, 1000 px wide. The strongest colour stands for the largest absolute value.
    pub fn svg(&self) -> String {
        let most = self.values.iter().flatten().filter(|v| v.is_finite()).fold(0.0, |m: f64, v| m.max(v.abs()));
        let (columns, rows) = (self.columns.1.len().max(1) as f64, self.rows.1.len().max(1) as f64);
        let (width, height) = ((RIGHT - LEFT) / columns, (360.0 / rows).clamp(14.0, 34.0));
        let mut out = String::new();
        text(&mut out, LEFT, 26.0, "start", "head", self.title);
        text(
            &mut out,
            LEFT,
            46.0,
            "start",
            "soft",
            &format!("{}; strongest colour: ±{}", self.quantity, label(most, most / 50.0)),
        );
        for (r, row) in self.values.iter().enumerate() {
            let y = TOP + height * r as f64;
            for (c, value) in row.iter().enumerate().filter(|(_, v)| v.is_finite()) {
                let class = if *value < 0.0 { "s0" } else { "s1" };
                let strength = if most > 0.0 { value.abs() / most } else { 0.0 };
                put(
                    &mut out,
                    &format!(
                        "<rect class=\"bar {class}\" fill-opacity=\"{strength:.2}\" x=\"{:.1}\" y=\"{y:.1}\" width=\"{:.1}\" height=\"{:.1}\"><title>{}</title></rect>",
                        LEFT + width * c as f64,
                        width - 1.0,
                        height - 1.0,
                        label(*value, most / 500.0)
                    ),
                );
            }
            if let Some(name) = self.rows.1.get(r) {
                text(&mut out, LEFT - 6.0, y + 0.5 * height + 4.0, "end", "soft", name);
            }
        }
        let bottom = TOP + height * rows;
        put(
            &mut out,
            &format!(
                "<rect class=\"panel\" x=\"{LEFT}\" y=\"{TOP}\" width=\"{:.1}\" height=\"{:.1}\"/>",
                RIGHT - LEFT,
                bottom - TOP
            ),
        );
        let every = (LETTER * 6.0 / width).ceil().max(1.0) as usize;
        for (c, name) in self.columns.1.iter().enumerate().step_by(every) {
            text(&mut out, LEFT + width * (c as f64 + 0.5), bottom + 16.0, "middle", "soft", name);
        }
        text(&mut out, 0.5 * (LEFT + RIGHT), bottom + 34.0, "middle", "soft", self.columns.0);
        let middle = 0.5 * (TOP + bottom);
        put(
            &mut out,
            &format!(
                "<text class=\"soft\" text-anchor=\"middle\" transform=\"translate(18 {middle:.1}) rotate(-90)\">{}</text>",
                escape(self.rows.0)
            ),
        );
        close(&out, bottom + 48.0, self.title)
    }
}

struct Frame {
    x: Scale,
    y: Scale,
    top: f64,
    height: f64,
}

impl Frame {
    fn x(&self, value: f64) -> f64 {
        LEFT + (RIGHT - LEFT) * self.x.share(value)
    }

    fn y(&self, value: f64) -> f64 {
        self.top + self.height * (1.0 - self.y.share(value).clamp(-0.02, 1.02))
    }

    fn grid(&self, out: &mut String, x_name: &str, y_name: &str) {
        let bottom = self.top + self.height;
        for mark in self.y.marks() {
            let y = self.y(mark);
            put(out, &format!("<path class=\"grid\" d=\"M{LEFT} {y:.1}H{RIGHT}\"/>"));
            text(out, LEFT - 6.0, y + 4.0, "end", "soft", &self.y.label(mark));
        }
        for mark in self.x.marks() {
            let x = self.x(mark);
            put(out, &format!("<path class=\"grid\" d=\"M{x:.1} {:.1}V{bottom:.1}\"/>", self.top));
            text(out, x, bottom + 16.0, "middle", "soft", &self.x.label(mark));
        }
        put(
            out,
            &format!(
                "<rect class=\"panel\" x=\"{LEFT}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\"/>",
                self.top,
                RIGHT - LEFT,
                self.height
            ),
        );
        text(out, 0.5 * (LEFT + RIGHT), bottom + 34.0, "middle", "soft", x_name);
        let middle = self.top + 0.5 * self.height;
        put(
            out,
            &format!(
                "<text class=\"soft\" text-anchor=\"middle\" transform=\"translate(18 {middle:.1}) rotate(-90)\">{}</text>",
                escape(y_name)
            ),
        );
    }

    fn draw(&self, out: &mut String, n: usize, mark: &Mark) {
        let class = format!("s{}", n % 6);
        let drawable = |x: f64, y: f64| self.x.can_show(x) && self.y.can_show(y);
        match mark {
            Mark::Line(style, points) => {
                for run in thinned(points).split(|(x, y)| !drawable(*x, *y)).filter(|run| !run.is_empty()) {
                    let path = self.path(run.iter().copied());
                    put(out, &format!("<path class=\"line {class}{style}\" d=\"{path}\"/>"));
                }
            }
            Mark::Points(points) => {
                let radius = if points.len() > 400 { 1.5 } else { 3.5 };
                for (x, y, bar) in points.iter().filter(|(x, y, _)| drawable(*x, *y)) {
                    let (px, py) = (self.x(*x), self.y(*y));
                    if *bar > 0.0 {
                        put(
                            out,
                            &format!(
                                "<path class=\"line {class}\" style=\"stroke-width:1\" d=\"M{px:.1} {:.1}V{:.1}\"/>",
                                self.y(y - bar),
                                self.y(y + bar)
                            ),
                        );
                    }
                    put(out, &format!("<circle class=\"dot {class}\" cx=\"{px:.1}\" cy=\"{py:.1}\" r=\"{radius}\"/>"));
                }
            }
            Mark::Band(points) => {
                for run in points.split(|(x, low, high)| !(drawable(*x, *low) && drawable(*x, *high))) {
                    let corners = run.iter().map(|p| (p.0, p.2)).chain(run.iter().rev().map(|p| (p.0, p.1)));
                    if run.len() > 1 {
                        put(out, &format!("<path class=\"area {class}\" d=\"{}Z\"/>", self.path(corners)));
                    }
                }
            }
            Mark::Bars(bars) => {
                for (from, to, y) in bars.iter().filter(|(from, _, y)| drawable(*from, *y)) {
                    let (a, b) = (self.x(*from), self.x(*to));
                    let (zero, top) = (self.y(0.0_f64.max(self.y.from)), self.y(*y));
                    put(
                        out,
                        &format!(
                            "<rect class=\"bar {class}\" x=\"{a:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\"/>",
                            zero.min(top),
                            (b - a - 1.0).max(0.8),
                            (zero - top).abs().max(0.5)
                        ),
                    );
                }
            }
        }
    }

    fn path(&self, corners: impl Iterator<Item = (f64, f64)>) -> String {
        let mut path = String::new();
        for (x, y) in corners {
            let letter = if path.is_empty() { 'M' } else { 'L' };
            // writing into a String cannot fail
            let _ = write!(path, "{letter}{:.1} {:.1}", self.x(x), self.y(y));
        }
        path
    }
}

/// The least and the largest value of every stretch of rows: what a column of pixels can show. A stretch without any is
/// a gap; a gap within a stretch is narrower than a pixel.
fn thinned(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    if points.len() <= MOST_POINTS {
        return points.to_vec();
    }
    let size = points.len().div_ceil(MOST_POINTS / 2);
    let mut out = Vec::with_capacity(MOST_POINTS);
    for stretch in points.chunks(size) {
        let by = |a: &&(f64, f64), b: &&(f64, f64)| a.1.total_cmp(&b.1);
        let known = || stretch.iter().filter(|(_, y)| y.is_finite());
        if let (Some(low), Some(high)) = (known().min_by(by), known().max_by(by)) {
            let (first, second) = if low.0 <= high.0 { (low, high) } else { (high, low) };
            out.extend([*first, *second]);
        } else {
            out.extend(stretch.first());
        }
    }
    out
}

pub(super) fn put(out: &mut String, element: &str) {
    out.push_str(element);
    out.push('\n');
}

pub(super) fn text(out: &mut String, x: f64, y: f64, anchor: &str, class: &str, what: &str) {
    put(
        out,
        &format!("<text class=\"{class}\" x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{}</text>", escape(what)),
    );
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

pub(super) fn close(body: &str, height: f64, title: &str) -> String {
    format!(
        "<svg class=\"c\" xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height:.0}\" role=\"img\" aria-label=\"{}\">\n\
         <style>{STYLE}</style>\n<rect class=\"paper\" width=\"{WIDTH}\" height=\"{height:.0}\"/>\n{body}</svg>\n",
        escape(title)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_split_lines_and_text_is_escaped() {
        let svg = Chart::new("a < b", "x (m)", "y (N)")
            .line("one", vec![(0.0, 1.0), (1.0, 2.0), (2.0, f64::NAN), (3.0, 4.0), (4.0, 4.5)])
            .svg();
        assert_eq!(svg.matches("<path class=\"line s0\" d=\"M").count(), 3, "legend and two runs");
        assert!(svg.contains("a &lt; b") && !svg.contains("a < b") && !svg.contains("NaN"));
    }

    #[test]
    fn long_lines_keep_their_extremes() {
        let mut points: Vec<_> = (0..100_000).map(|n| (f64::from(n), 0.0)).collect();
        points[77_777].1 = 9.0;
        points[33_333].1 = -9.0;
        // not measured here and there, and for a while
        points[77_776].1 = f64::NAN;
        points[33_334].1 = f64::NAN;
        points[50_000..60_000].iter_mut().for_each(|p| p.1 = f64::NAN);
        let thin = thinned(&points);
        assert!(thin.len() <= MOST_POINTS + 2);
        assert!(thin.contains(&(77_777.0, 9.0)) && thin.contains(&(33_333.0, -9.0)));
        assert!(thin.is_sorted_by(|a, b| a.0 <= b.0));
        assert!((150..=210).contains(&thin.iter().filter(|p| p.1.is_nan()).count()));
    }

    #[test]
    fn what_a_logarithm_cannot_show_is_left_out() {
        let svg = Chart::new("t", "x", "y")
            .log_x()
            .points("p", vec![(0.0, 1.0, 0.0), (1.0, 2.0, 0.1), (100.0, 3.0, 0.1)])
            .svg();
        assert_eq!(svg.matches("<circle").count(), 3, "two points and the legend");
    }
}
