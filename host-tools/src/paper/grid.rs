//! What the paper says of its measured grid, ruled upon under every reading of the Hersey number.
//!
//! The figures of the paper are not at hand: these are statements of its text. Where a word such as "about constant"
//! needs a bound, the statement names the bound that was taken.

use serde::Serialize;

use super::claims::Verdict;
use super::convention::Score;

/// A statement about the measured grid, under one reading.
#[derive(Clone, Debug, Serialize)]
pub struct Ruling {
    /// What the equations give.
    pub computed: String,
    /// What became of it.
    pub verdict: Verdict,
}

/// A statement about the measured grid, under every reading, `C1` first.
#[derive(Clone, Debug, Serialize)]
pub struct GridClaim {
    /// Where the paper makes it.
    pub place: &'static str,
    /// What the paper states.
    pub stated: &'static str,
    /// One ruling for each reading.
    pub rulings: Vec<Ruling>,
}

/// Judges every statement under every reading; `scores` in the order of the readings.
pub fn grid_claims(scores: &[Score]) -> Vec<GridClaim> {
    let claim = |place, stated, rule: &dyn Fn(&Score) -> (bool, String)| GridClaim {
        place,
        stated,
        rulings: scores
            .iter()
            .map(|score| {
                let (holds, computed) = rule(score);
                Ruling { computed, verdict: if holds { Verdict::Holds } else { Verdict::Contradicted } }
            })
            .collect(),
    };
    let pc = |x: f64| format!("{:.0} %", 100.0 * x);
    vec![
        claim("3.3, 5 (1)", "mixed and full film both occur", &|s| {
            (s.full_film > 0.0 && s.full_film < 1.0, format!("{:.1} % full", 100.0 * s.full_film))
        }),
        claim("2.2, 5 (2)", "smallest friction at 0.6 m/min, 500 N and 1500 N", &|s| {
            let [a, b, ..] = s.speed_of_minimum;
            (a == 0.6 && b == 0.6, format!("{a}, {b}"))
        }),
        claim("2.2, Fig. 3", "drag falls slightly with speed, then rises; the more, the larger the load", &|s| {
            // at one load the drag goes with the friction
            let [light, heavy] = s.rise_at_ends;
            let text =
                format!("rises {} at 500 N; falls {}, rises {} at 9500 N", pc(light), pc(s.fall_9500), pc(heavy));
            (s.fall_9500 > 0.0 && heavy > 0.0 && heavy > light, text)
        }),
        claim("Fig. 5b", "falls slowly to a plateau at 4500 and 7500 N (rise at most 5 %)", &|s| {
            let falls = s.speed_of_minimum[2] > 1.0 && s.speed_of_minimum[3] > 1.0;
            (falls && s.rise.iter().all(|r| *r <= 0.05), format!("+{}, +{}", pc(s.rise[0]), pc(s.rise[1])))
        }),
        claim("Fig. 5b", "about constant at 8500 N (spread at most 15 %)", &|s| {
            (s.spread_8500 <= 0.15, pc(s.spread_8500))
        }),
        claim("Fig. 5a", "falls with load at 0.1 m/min (sign only)", &|s| {
            (s.fall_with_load[0] > 0.0, format!("{:+.1} %", 100.0 * s.fall_with_load[0]))
        }),
        claim("Fig. 10", "drag of tens of newtons (at most 100 N)", &|s| {
            (s.drag_n.1 <= 100.0, format!("{:.1} to {:.0} N", s.drag_n.0, s.drag_n.1))
        }),
        claim("Table 2", "errors within 18.9 % if friction is flat at 7500 and 8500 N (ratio at most 1.47)", &|s| {
            // the model may be off by 18.9 % either way
            (s.spread_of_table_2 <= 1.189 / 0.811, format!("{:.2}", s.spread_of_table_2))
        }),
        claim("abstract", "preload from the quoted minima within 18.91 %", &|s| {
            let errors = s.error_of_quoted.map(|e| e.unwrap_or(f64::NAN));
            (errors.iter().all(|e| e.abs() <= 0.1891), format!("{}, {}", pc(errors[0]), pc(errors[1])))
        }),
    ]
}

/// How many of the statements a reading meets, of how many.
pub fn met(claims: &[GridClaim], convention: usize) -> (usize, usize) {
    let is_met = |claim: &&GridClaim| claim.rulings.get(convention).is_some_and(|r| r.verdict == Verdict::Holds);
    (claims.iter().filter(is_met).count(), claims.len())
}
