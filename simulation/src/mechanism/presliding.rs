//! What happens within the first tenths of a millimetre after a reversal or a start.

use super::column::{drag, odd, shown};
use super::definition::{Definition, Form, Kind, Sign, amplitude, scale};
use super::{Context, Id};

/// `F = D (1 - a e^(-s/s_0))` after a reversal; from one direction into the other a is 2. Richer: two lengths, as
/// slip elements of different reach make them.
pub(super) const PRESLIDING: Definition = Definition {
    id: Id::Presliding,
    kind: Kind::Physics,
    forms: &[
        Form {
            name: "exponential",
            shape: &[scale("length_m", "m", 1e-5, 1e-3, 7)],
            amplitudes: &[amplitude("share", "", Sign::Negative, -2.0)],
            columns: |c, s| shown([fading(c, s[0])]),
            phase_bound: false,
        },
        Form {
            name: "two-lengths",
            shape: &[scale("length_m", "m", 1e-5, 3e-4, 6)],
            amplitudes: &[
                amplitude("share", "", Sign::Negative, -1.5),
                amplitude("long_share", "", Sign::Negative, -0.5),
            ],
            columns: |c, s| shown([fading(c, s[0]), fading(c, 4.0 * s[0])]),
            phase_bound: false,
        },
        Form {
            name: "slip-elements",
            shape: &[scale("length_m", "m", 2e-5, 1e-3, 7)],
            amplitudes: &[amplitude("share", "", Sign::Negative, -2.0)],
            // elements whose reach is spread evenly up to the length: what has not slipped yet
            columns: |c, s| shown([odd(c, |n| drag(c, n) * (1.0 - c.since_reversal_m[n] / s[0]).max(0.0).powi(2))]),
            phase_bound: false,
        },
    ],
    axis: "reversal-distance",
    statement: "After a reversal the friction builds up over a displacement (presliding) instead of at once.",
    falsifier: "The length must be the same in micrometres at every frequency; a filter's would be the same in milliseconds.",
    next_experiment: "P5",
    simplicity: 3,
};

/// `F = D a log(1 + t_rest/t_0) e^(-s/s_0)`, t_0 = 1 s.
pub(super) const BREAKAWAY_DWELL: Definition = Definition {
    id: Id::BreakawayDwell,
    kind: Kind::Physics,
    forms: &[Form {
        name: "logarithmic",
        shape: &[scale("length_m", "m", 2e-5, 2e-3, 6)],
        amplitudes: &[amplitude("share_per_decade", "", Sign::Positive, 0.1)],
        columns: |c, s| {
            shown([odd(c, |n| drag(c, n) * (-c.since_reversal_m[n] / s[0]).exp() * (1.0 + c.dwell_s[n]).log10())])
        },
        phase_bound: false,
    }],
    axis: "dwell",
    statement: "After a rest the carriage breaks away with a force that grows with the time it stood.",
    falsifier: "Rests of 1, 10 and 100 s must raise the first force by equal steps.",
    next_experiment: "P7",
    simplicity: 4,
};

/// Play between drive and carriage: after a reversal no force until it is taken up.
pub(super) const COUPLING_BACKLASH: Definition = Definition {
    id: Id::CouplingBacklash,
    kind: Kind::Sensor,
    forms: &[Form {
        name: "gap",
        shape: &[scale("gap_m", "m", 1e-5, 1e-3, 8)],
        amplitudes: &[amplitude("share", "", Sign::Negative, -1.0)],
        columns: |c, s| shown([odd(c, |n| if c.since_reversal_m[n] < s[0] { drag(c, n) } else { 0.0 })]),
        phase_bound: false,
    }],
    axis: "reversal-distance",
    statement: "Play in the coupling: after a reversal the drive moves without a force until the play is taken up.",
    falsifier: "Within the play the force must be zero, not rising; the play must be the same in micrometres everywhere.",
    next_experiment: "P5",
    simplicity: 5,
};

fn fading(c: &Context<'_>, length_m: f64) -> Vec<f64> {
    odd(c, |n| drag(c, n) * (-c.since_reversal_m[n] / length_m).exp())
}
