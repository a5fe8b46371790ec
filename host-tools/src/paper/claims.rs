//! The lines of the comparison: what the paper states, what its equations give, the difference, a verdict.

use std::fmt;

use model_core::contact::Ellipse;
use model_core::exact::Exact;
use model_core::reference::zhou_2023::{FRICTION, GUIDE, OIL};
use serde::Serialize;

use super::convention::{C2, CONVENTIONS, QUOTED_MINIMA, Score};
use super::grid::{GridClaim, grid_claims};
use super::left_out::{LeftOut, left_out};
use super::{grid, oh, one_curve, printed};

/// Verdict on a statement.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// The equations give it.
    Holds,
    /// The equations give it up to the digits that are printed.
    WithinRounding,
    /// The equations give something else, or the paper states something else elsewhere.
    Contradicted,
    /// The paper does not say enough.
    CannotBeChecked,
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Verdict::Holds => "holds",
            Verdict::WithinRounding => "holds within rounding",
            Verdict::Contradicted => "CONTRADICTED",
            Verdict::CannotBeChecked => "cannot be checked",
        })
    }
}

/// One statement.
#[derive(Clone, Debug, Serialize)]
pub struct Claim {
    /// Where the paper makes it.
    pub place: &'static str,
    /// What it is about, in plain words.
    pub about: &'static str,
    /// What the paper states.
    pub stated: String,
    /// What the equations give.
    pub computed: String,
    /// The difference; empty where there is no number to subtract.
    pub difference: String,
    /// What became of it.
    pub verdict: Verdict,
}

/// The whole comparison.
#[derive(Clone, Debug, Serialize)]
pub struct Findings {
    /// Statements that no reading changes.
    pub claims: Vec<Claim>,
    /// Statements about the measured grid.
    pub grid: Vec<GridClaim>,
    /// Scores of the readings, `C1` first.
    pub scores: Vec<Score>,
    /// What would have to be added to Eq. 20.
    pub left_out: LeftOut,
}

/// Makes the comparison for the groove conformity of the published set; `None` if a measured load is beyond the
/// geometry, which for the published set none is.
pub fn findings() -> Option<Findings> {
    let scores: Vec<Score> = CONVENTIONS.iter().map(|c| c.score(GUIDE.conformity_slider)).collect::<Option<_>>()?;
    let grid = grid_claims(&scores);
    Some(Findings { claims: claims()?, grid, scores, left_out: left_out()? })
}

fn percent(ratio: f64) -> String {
    format!("{:+.2} %", 100.0 * ratio)
}

/// A constant that another of the paper's constants implies. The verdict allows one unit of the last printed digit,
/// because the printed number may be cut off as well as rounded.
fn constant(place: &'static str, about: &'static str, printed: f64, computed: f64, unit: f64) -> Claim {
    let verdict = match (printed - computed).abs() {
        d if d <= 1e-12 * printed.abs() => Verdict::Holds,
        d if d <= unit => Verdict::WithinRounding,
        _ => Verdict::Contradicted,
    };
    let show = |x: f64| if x.abs() < 1e5 { format!("{x:.6}") } else { format!("{x:.4e}") };
    Claim {
        place,
        about,
        stated: show(printed),
        computed: show(computed),
        difference: format!("{:+.3} %", 100.0 * (printed / computed - 1.0)),
        verdict,
    }
}

fn claims() -> Option<Vec<Claim>> {
    let mut lines = constants();
    lines.extend(geometry()?);
    lines.extend(minima()?);
    lines.extend(accuracy()?);
    Some(lines)
}

fn constants() -> Vec<Claim> {
    let [coulomb, slope, stribeck, decay] = printed::EQUATION_21;
    vec![
        constant("Eq. 21", "four times μ_c of Eq. 20", coulomb, 4.0 * FRICTION.mu_coulomb, 1e-5),
        constant("Eq. 21", "4·(2/3)·μ_v: ε is over the mean pressure", slope, 8.0 / 3.0 * FRICTION.mu_viscous, 1e5),
        constant("Eq. 21", "four times μ_s of Eq. 20", stribeck, 4.0 * FRICTION.mu_stribeck, 1e-4),
        constant("Eq. 21", "(2/3)·k_s: ε is over the mean pressure", decay, FRICTION.stribeck_exponent / 1.5, 1e8),
        constant("Eq. 5", "(3/2)^(2/3)/2", printed::EQUATION_5, 0.5 * 2.25_f64.cbrt(), 1e-3),
    ]
}

fn geometry() -> Option<Vec<Claim>> {
    let model = Exact::new(GUIDE, FRICTION);
    let q = model.load_of_lateral_force(9500.0)?;
    let (exact, letter) = (model.contact_angle_rad(q), printed::contact_angle_rad(&GUIDE, q));
    let q_5500 = model.load_of_lateral_force(5500.0)?;
    let quarter = std::f64::consts::FRAC_PI_4;
    let spun = printed::slip_ratio(&model, q_5500, quarter, quarter, 0.0);
    let free = printed::slip_ratio(&model, q_5500, quarter, 0.0, 0.0);
    let rated = model.preload_n(q) / 62_300.0;
    Some(vec![
        Claim {
            place: "Eq. 4",
            about: "contact angle at 9500 N, from the printed shift, against the geometry of Eq. 3",
            stated: format!("{:.2}°", letter.to_degrees()),
            computed: format!("{:.2}°", exact.to_degrees()),
            difference: format!("{} of F_p", percent(letter.cos() / exact.cos() - 1.0)),
            verdict: Verdict::Contradicted,
        },
        Claim {
            place: "Eq. 11",
            about: "the pressure called average, over the average pressure Q/(πab)",
            stated: "1".into(),
            computed: "1.5".into(),
            difference: percent(1.0 / 1.5 - 1.0),
            verdict: Verdict::Contradicted,
        },
        Claim {
            place: "Eq. 14, 15",
            about: "sliding over carriage speed at 5500 N if a ball spins about its contact normal (γ = 45°)",
            stated: format!("{spun:.3}"),
            computed: format!("{free:.5}"),
            difference: format!("{:.0} times", spun / free),
            verdict: Verdict::Contradicted,
        },
        Claim {
            place: "2.1",
            about: "preload at the largest lateral force, over the rated load of 62.3 kN",
            stated: "at most 15 %".into(),
            computed: format!("{:.1} %", 100.0 * rated),
            difference: String::new(),
            verdict: if rated <= 0.15 { Verdict::Holds } else { Verdict::Contradicted },
        },
        Claim {
            place: "2.1",
            about: "viscosity of the oil, grade 100, kept constant; its temperature is not given",
            stated: "100 cSt".into(),
            computed: format!("{:.0} cSt at 20 °C, 100 at 40 °C", OIL.viscosity_cst(20.0)),
            difference: String::new(),
            verdict: Verdict::CannotBeChecked,
        },
        Claim {
            place: "Eq. 3, 9, 13",
            about: "groove conformity; the axis ratio of the contact ellipse hangs on it",
            stated: "not given".into(),
            computed: format!(
                "κ {:.1} for 0.51, {:.1} for 0.52",
                Ellipse::of_groove(0.51).kappa,
                Ellipse::of_groove(0.52).kappa
            ),
            difference: String::new(),
            verdict: Verdict::CannotBeChecked,
        },
    ])
}

fn minima() -> Option<Vec<Claim>> {
    let smallest = FRICTION.coefficient(FRICTION.hersey_of_minimum());
    let model = Exact::new(GUIDE, FRICTION);
    let mut lines = Vec::new();
    let names = ["smallest friction at 500 N", "smallest friction at 1500 N"];
    for ((force, mu, _), about) in QUOTED_MINIMA.into_iter().zip(names) {
        lines.push(Claim {
            place: "5 (2)",
            about,
            stated: format!("{mu:.5}"),
            computed: format!("never below {smallest:.7}"),
            difference: percent(mu / smallest - 1.0),
            verdict: Verdict::Contradicted,
        });
        let q = model.load_of_lateral_force(force)?;
        lines.push(Claim {
            place: "5 (2)",
            about: "drag force of that friction: all of it, so no seals ran",
            stated: "seals not mentioned".into(),
            computed: format!("{:.2} N at {force:.0} N", GUIDE.loaded_balls() * q * mu),
            difference: String::new(),
            verdict: Verdict::CannotBeChecked,
        });
    }
    let power = one_curve::power_of_load(&FRICTION, 0.6, 1.15);
    lines.push(Claim {
        place: "Fig. 5b",
        about: "minimum at 0.6 m/min under 500 N and flat (within 15 %) under 8500 N: power of Q in the Hersey number",
        stated: "+1/3 or -1/3".into(),
        computed: format!("{power:.2} or less"),
        difference: String::new(),
        verdict: Verdict::Contradicted,
    });
    Some(lines)
}

fn accuracy() -> Option<Vec<Claim>> {
    let mut lines = vec![
        Claim {
            place: "abstract",
            about: "largest error of the preload, over the three speeds of Table 2",
            stated: "18.91 %".into(),
            computed: "14.14, 18.91, 18.81 %".into(),
            difference: String::new(),
            verdict: Verdict::Holds,
        },
        Claim {
            place: "5 (3)",
            about: "largest error by OH's model, over the three speeds of Table 2",
            stated: "27.77 %".into(),
            computed: "23.83, 27.77, 27.03 %".into(),
            difference: String::new(),
            verdict: Verdict::Holds,
        },
    ];
    let smallest = FRICTION.coefficient(FRICTION.hersey_of_minimum());
    let (_, mu, _) = QUOTED_MINIMA[0];
    lines.push(Claim {
        place: "abstract, 5 (2)",
        about: "the same error at 500 N and 0.6 m/min, from the quoted minimum; the best that any reading can do",
        stated: "18.91 % at most".into(),
        computed: percent(mu / smallest - 1.0),
        difference: "load per ball; F_p as much at a constant contact angle".into(),
        verdict: Verdict::Contradicted,
    });
    let model = Exact::new(GUIDE, FRICTION);
    for (drag, about) in [
        (25.0, "preload by Eq. 22 over preload by Eq. 21 at 25 N drag, at 0.1, 2 and 6 m/min"),
        (5.0, "the same at 5 N drag"),
    ] {
        let mut values = Vec::new();
        for speed in [0.1, 2.0, 6.0] {
            values.push(format!("{:+.0}", 100.0 * oh::disagreement(&model, drag, 0.088, 100.0, speed / 60.0)?));
        }
        lines.push(Claim {
            place: "4, Fig. 10",
            about,
            stated: "very close up to 25 N".into(),
            computed: format!("{} %", values.join(", ")),
            difference: "c, R_h and h_c of Eq. 22 are assumed".into(),
            verdict: Verdict::CannotBeChecked,
        });
    }
    lines.push(Claim {
        place: "0, 4",
        about: "speeds for which OH's model was validated, against those of the comparison",
        stated: "3 to 12 m/min".into(),
        computed: "0.1, 2 and 6 m/min".into(),
        difference: "two of three outside".into(),
        verdict: Verdict::Contradicted,
    });
    Some(lines)
}

/// The answer in plain words.
pub fn summary(findings: &Findings) -> Vec<String> {
    let count = |verdict| findings.claims.iter().filter(|c| c.verdict == verdict).count();
    let met: Vec<(usize, usize)> = (0..CONVENTIONS.len()).map(|c| grid::met(&findings.grid, c)).collect();
    let (most, of) = met.iter().copied().max().unwrap_or((0, 0));
    let names = |is_wanted: &dyn Fn(usize) -> bool| {
        let names: Vec<&str> = (0..met.len()).filter(|&c| is_wanted(c)).map(|c| CONVENTIONS[c].name).collect();
        names.join(", ")
    };
    let visits_both = |c: usize| findings.scores.get(c).is_some_and(|s| s.full_film > 0.0 && s.full_film < 1.0);
    vec![
        format!(
            "Of {} statements that no choice of units changes, {} hold, {} hold within rounding, {} are contradicted \
             and {} cannot be checked.",
            findings.claims.len(),
            count(Verdict::Holds),
            count(Verdict::WithinRounding),
            count(Verdict::Contradicted),
            count(Verdict::CannotBeChecked)
        ),
        format!(
            "No reading of the units meets all {of} statements about the measured grid. The most is {most}, by {}. Mixed \
             lubrication and full film both occur only under {}. This program takes C6; C2, the only one near the quoted \
             0.6 m/min, meets {}.",
            names(&|c| met[c].0 == most),
            names(&visits_both),
            met[C2].0
        ),
        "The paper's own smallest friction at 500 N lies 26 % below anything its Eq. 20 can return: the measurements \
         hold a dependence on load that the curve leaves out."
            .to_owned(),
    ]
}
