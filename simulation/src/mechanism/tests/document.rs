//! `docs/mechanisms.md` is made from the library: this test checks that both agree.

use std::fmt::Write;
use std::path::Path;

use super::*;

const PREFACE: &str = "# The mechanisms

What a simulation of a ball guide may have left out, and what a measurement can do that looks like it. `guideblock
diagnose` names one of these where a recording and a simulation disagree; an entry `[[mechanism]]` of a simulation file
adds one:

```toml
[[mechanism]]
id = \"presliding\"
form = \"minimal\"       # may be left out: the first one
length_m = 0.00012
part = 1.0
```

A form adds `Σ amplitude·column` to the law's force, in the sign of `drag_force_n`. Columns depend on the run and on the
form's shape parameters; the table gives the range that is searched, a file may go beyond it. Where the last column says
\"phase\" the form is tied to a place or a phase along the rail and means nothing to a recording whose positions have
another zero.

Symbols: V velocity, a acceleration, x position, s travel since the last reversal or start, F_law the friction that the
law says (without sign unless V's sign stands beside it), F_p preload, Q load per ball, ν viscosity. Preload and oil act
through the law's own derivatives `dF_law/dlnF_p` and `dF_law/dlnν`; what changes the interference e between balls and
raceways (wear, warmth, an uneven rail) through `dF_law/de = dF_law/dlnF_p·(Q/150 N)^(-2/3)`, because a micrometre is a
large part of a light preload and a small one of a heavy one: amplitudes are the relative preload at 150 N per ball. A law that knows neither takes its friction for both:
proportional to the load, and falling with the oil (there its viscous part alone, where it has one).

This page is generated from the library; a test compares the two. Rewrite it with
`GUIDEBLOCK_WRITE_DOCS=1 cargo test --profile desk -p simulation mechanisms_page`.
";

/// A number as people write it.
fn number(x: f64) -> String {
    if x != 0.0 && !(1e-3..1e5).contains(&x.abs()) { format!("{x:e}") } else { format!("{x}") }
}

fn sentence(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| format!("{}{}.", first.to_uppercase(), letters.as_str()))
}

fn page() -> String {
    let mut text = PREFACE.to_owned();
    let mut kind = None;
    for definition in library() {
        if kind != Some(definition.kind) {
            kind = Some(definition.kind);
            let title = if definition.kind == Kind::Physics { "Physics" } else { "Sensors" };
            let _ = writeln!(text, "\n## {title}");
        }
        let _ = writeln!(text, "\n### `{}`\n", definition.id);
        let _ = writeln!(text, "{}\n", sentence(definition.statement));
        let _ = writeln!(text, "- Wrong if: {}.", definition.falsifier);
        let _ = writeln!(text, "- Easily taken for: {}.", definition.confused_with);
        let _ = writeln!(text, "- Shows over: {}. Settled by: `{}`.", definition.axis, definition.next_experiment);
        let _ = writeln!(text, "\n| form | equation | shape | amplitudes | |\n|---|---|---|---|---|");
        for form in definition.forms {
            let unit = |unit: &str| if unit.is_empty() { String::new() } else { format!(" {unit}") };
            let of = |p: &ShapeParameter| match p.search {
                Search::Grid
                | Search::EitherSide
                | Search::AlongStroke
                | Search::AlongTravel
                | Search::SinceTurn
                | Search::Wave => {
                    format!("`{}` {} to {}{}", p.name, number(p.from), number(p.to), unit(p.unit))
                }
                Search::Place => format!("`{}`: a place of the stroke", p.name),
                Search::StrokeStart | Search::StrokeEnd => format!("`{}`: an end of the stroke", p.name),
            };
            let shape: Vec<String> = form.shape.iter().map(of).collect();
            let of = |a: &Amplitude| {
                let sign = match a.sign {
                    Sign::Positive if a.most.is_finite() => format!(" {} to {}", a.least, a.most),
                    Sign::Positive => " ≥ 0".to_owned(),
                    Sign::Negative => " ≤ 0".to_owned(),
                    Sign::Free => String::new(),
                };
                let unit = if a.unit.is_empty() { String::new() } else { format!(" ({})", a.unit) };
                format!("`{}`{unit}{sign}", a.name)
            };
            let amplitudes: Vec<String> = match form.amplitudes {
                [first, .., last] if form.amplitudes.len() > 8 => vec![format!("{} .. {}", of(first), of(last))],
                all => all.iter().map(of).collect(),
            };
            let _ = writeln!(
                text,
                "| {} | {} | {} | {} | {} |",
                form.name,
                form.equation.replace('|', "\\|"),
                if shape.is_empty() { "none".to_owned() } else { shape.join(", ") },
                amplitudes.join(", "),
                if form.phase_bound { "phase" } else { "" }
            );
        }
    }
    text
}

#[test]
fn the_mechanisms_page_is_that_of_the_library() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/mechanisms.md");
    if std::env::var_os("GUIDEBLOCK_WRITE_DOCS").is_some() {
        std::fs::write(&path, page()).expect("the page can be written");
    }
    let written = std::fs::read_to_string(&path).expect("docs/mechanisms.md exists");
    for (line, (is, should)) in written.lines().zip(page().lines()).enumerate() {
        assert_eq!(is, should, "docs/mechanisms.md, line {}: rewrite it as its own text says", line + 1);
    }
    assert_eq!(written, page());
    // it is complete by construction only if the library is
    for id in Id::ALL {
        assert!(written.contains(&format!("\n### `{id}`\n")), "{id}");
    }
}
