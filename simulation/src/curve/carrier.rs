//! Carriers: the factor that a curve's height multiplies.

use crate::mechanism::Context;

/// Factor that a curve's height multiplies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Carrier {
    /// 1: the same force in both directions. Heights in N.
    Even,
    /// The direction of motion, -1 or 1. Heights in N, positive against the motion.
    Odd,
    /// The law's drag, N, against the motion. Heights are shares of it.
    Drag,
}

impl Carrier {
    /// All of them.
    pub const ALL: [Carrier; 3] = [Carrier::Even, Carrier::Odd, Carrier::Drag];

    /// Name in a file.
    pub const fn name(self) -> &'static str {
        match self {
            Carrier::Even => "even",
            Carrier::Odd => "odd",
            Carrier::Drag => "drag",
        }
    }

    /// How a force on it acts, in words.
    pub const fn words(self) -> &'static str {
        match self {
            Carrier::Even => "the same in both directions",
            Carrier::Odd => "against the motion",
            Carrier::Drag => "in proportion to the drag",
        }
    }

    /// Unit of a height.
    pub const fn unit(self) -> &'static str {
        match self {
            Carrier::Even | Carrier::Odd => "N",
            Carrier::Drag => "share of the drag",
        }
    }

    /// Its value in a row of a run; 0 where the law has no value.
    pub fn of(self, context: &Context<'_>, row: usize) -> f64 {
        match self {
            Carrier::Even => 1.0,
            Carrier::Odd => context.direction[row],
            Carrier::Drag => {
                let drag = context.steady.drag_n.get(row).copied().filter(|x| x.is_finite());
                context.direction[row] * drag.unwrap_or(0.0)
            }
        }
    }
}
