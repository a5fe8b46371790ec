//! Bar chart of the shares of a whole: a bar for each, with its name and number.

use std::fmt::Write;

use super::chart::{LEFT, RIGHT, close, put, text};

/// Height of a bar, and from one to the next, px.
const BAR: f64 = 18.0;
const STEP: f64 = 30.0;
const TOP: f64 = 48.0;

/// Room for the names, and for the numbers behind the bars, px.
const NAMES: f64 = 230.0;
const NUMBERS: f64 = 64.0;

/// The picture, 1000 px wide: shares from 0 to 1 with their names and the number of their colour, from the top down.
pub fn svg(title: &str, shares: &[(&str, f64, usize)]) -> String {
    let (left, width) = (LEFT + NAMES, RIGHT - NUMBERS - LEFT - NAMES);
    let mut out = String::new();
    text(&mut out, LEFT, 26.0, "start", "head", title);
    for (n, (name, share, colour)) in shares.iter().enumerate() {
        let y = TOP + STEP * n as f64;
        let long = width * if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.0 };
        text(&mut out, left - 10.0, y + 0.75 * BAR, "end", "", name);
        let mut bar = String::new();
        let _ = write!(
            bar,
            "<rect class=\"bar s{}\" x=\"{left:.1}\" y=\"{y:.1}\" width=\"{:.1}\" height=\"{BAR:.1}\"/>",
            colour % 6,
            long.max(1.0)
        );
        put(&mut out, &bar);
        text(&mut out, left + long + 8.0, y + 0.75 * BAR, "start", "soft", &format!("{:.1} %", 100.0 * share));
    }
    close(&out, TOP + STEP * shares.len() as f64, title)
}

#[cfg(test)]
mod tests {
    use super::svg;

    #[test]
    fn a_bar_is_as_long_as_its_share_and_names_are_escaped() {
        let picture = svg("Shares", &[("seal & wiper", 0.5, 0), ("left over", 0.25, 5)]);
        let widths: Vec<f64> = picture
            .split("class=\"bar ")
            .skip(1)
            .map(|bar| bar.split("width=\"").nth(1).unwrap().split('"').next().unwrap().parse().unwrap())
            .collect();
        assert!(widths.len() == 2 && (widths[0] - 2.0 * widths[1]).abs() < 0.11, "{widths:?}");
        assert!(picture.contains("seal &amp; wiper") && picture.contains("25.0 %"));
    }
}
