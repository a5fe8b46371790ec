//! Sources of columns: a form of a mechanism at values of its shape, a parameter of the law, or an unnamed curve.

use simulation::curve::{AddedCurve, Axis, Curve};
use simulation::mechanism::{Added, Context, Definition, Id, Sign};

use crate::fit::story;

/// Number of amplitudes from which a cause counts as a table.
const TABLE: usize = 12;

/// Causes that delay the whole channel: by a time, or by a filter.
pub(crate) const LATE: [Id; 2] = [Id::TimeMisalignment, Id::ForceLowpass];

/// Causes that act unevenly, and may differ on other rows: a resonance depends on what excites it, rounding on
/// where the force lies between two steps.
pub(crate) const UNEVEN_BY_NATURE: [Id; 2] = [Id::StructuralResonance, Id::ForceQuantisation];

/// Where a set of columns comes from.
#[derive(Clone, Debug)]
pub(crate) enum Source {
    /// A form of a mechanism, at values of its shape parameters.
    Mechanism { definition: &'static Definition, form: usize, shape: Vec<f64> },
    /// A parameter of the law, free of its tolerance.
    Shift { parameter: usize },
    /// An unnamed curve.
    Story { curve: Curve },
}

impl Source {
    /// Whether both stand for the same cause.
    pub(crate) fn is_kin(&self, other: &Self) -> bool {
        match (self, other) {
            (Source::Mechanism { definition: a, .. }, Source::Mechanism { definition: b, .. }) => a.id == b.id,
            (Source::Shift { parameter: a }, Source::Shift { parameter: b }) => a == b,
            (Source::Story { curve: a }, Source::Story { curve: b }) => a.axis == b.axis && a.carrier == b.carrier,
            _ => false,
        }
    }

    /// Whether both are one cause in the same form and with the same shape.
    pub(crate) fn is_same(&self, other: &Self) -> bool {
        let shape_of = |source: &Self| match source {
            Source::Mechanism { form, shape, .. } => Some((*form, shape.clone())),
            _ => None,
        };
        self.is_kin(other) && shape_of(self) == shape_of(other)
    }

    /// Whether it is a form of this mechanism.
    pub(crate) fn is(&self, id: Id) -> bool {
        matches!(self, Source::Mechanism { definition, .. } if definition.id == id)
    }

    /// Whether it is a form of one of these mechanisms.
    pub(crate) fn is_any(&self, ids: &[Id]) -> bool {
        ids.iter().any(|id| self.is(*id))
    }

    pub(crate) fn is_story(&self) -> bool {
        matches!(self, Source::Story { .. })
    }

    /// Whether it is a law parameter that is off.
    pub(crate) fn is_shift(&self) -> bool {
        matches!(self, Source::Shift { .. })
    }

    /// Whether it is this law parameter.
    pub(crate) fn is_shift_of(&self, number: usize) -> bool {
        matches!(self, Source::Shift { parameter } if *parameter == number)
    }

    /// Name in a report.
    pub(crate) fn id(&self) -> &'static str {
        match self {
            Source::Mechanism { definition, .. } => definition.id.name(),
            Source::Shift { .. } => "parameter-shift",
            Source::Story { .. } => "unknown",
        }
    }

    /// Order among causes that a recording cannot tell apart: the lowest leads.
    pub(crate) fn simplicity(&self) -> u8 {
        match self {
            Source::Mechanism { definition, .. } => definition.simplicity,
            Source::Shift { .. } => 0,
            Source::Story { .. } => u8::MAX,
        }
    }

    /// Whether it is tied to places along the rail.
    pub(crate) fn is_phase_bound(&self) -> bool {
        match self {
            Source::Mechanism { definition, form, .. } => definition.forms[*form].phase_bound,
            Source::Story { curve } => curve.axis == Axis::Position,
            Source::Shift { .. } => false,
        }
    }

    /// Whether it is the first form of a mechanism.
    pub(crate) fn is_minimal(&self) -> bool {
        matches!(self, Source::Mechanism { form: 0, .. })
    }

    /// Number of amplitudes of a form; 0 for a shift, and for a curve, which has knots instead.
    pub(crate) fn amplitudes(&self) -> usize {
        match self {
            Source::Mechanism { definition, form, .. } => definition.forms[*form].amplitudes.len(),
            _ => 0,
        }
    }

    /// Whether it is a table: with an entry wherever it acts it follows anything.
    pub(crate) fn is_table(&self) -> bool {
        self.amplitudes() >= TABLE
    }

    /// Shape parameter of this name, where its form has one.
    pub(crate) fn number(&self, name: &str) -> Option<f64> {
        let Source::Mechanism { definition, form, shape } = self else { return None };
        definition.forms[*form].shape.iter().zip(shape).find(|(what, _)| what.name == name).map(|(_, value)| *value)
    }

    /// Number of shape parameters.
    pub(crate) fn shapes(&self) -> usize {
        match self {
            Source::Mechanism { shape, .. } => shape.len(),
            _ => 0,
        }
    }

    /// Least and largest value of every amplitude.
    pub(crate) fn bounds(&self, amplitudes: usize) -> Vec<(f64, f64)> {
        match self {
            Source::Mechanism { definition, form, .. } => definition.forms[*form]
                .amplitudes
                .iter()
                .map(|amplitude| match amplitude.sign {
                    Sign::Positive => (amplitude.least, amplitude.most),
                    Sign::Negative => (-amplitude.most, -amplitude.least),
                    Sign::Free => (-amplitude.most, amplitude.most),
                })
                .collect(),
            _ => vec![(f64::NEG_INFINITY, f64::INFINITY); amplitudes],
        }
    }
}

/// Columns of a mechanism or a curve over the rows of these runs, concatenated.
pub(crate) fn raw_columns(source: &Source, contexts: &[Context<'_>]) -> Option<Vec<Vec<f64>>> {
    let count = match source {
        Source::Mechanism { definition, form, .. } => definition.forms[*form].amplitudes.len(),
        Source::Shift { .. } => return None,
        Source::Story { curve } => story::count(curve),
    };
    let mut columns = vec![Vec::new(); count];
    let mut shown = false;
    for context in contexts {
        let own = match source {
            Source::Mechanism { definition, form, shape } => (definition.forms[*form].columns)(context, shape),
            Source::Story { curve } => Some(story::columns(curve, context)),
            Source::Shift { .. } => None,
        };
        shown |= own.is_some();
        let rows = context.run.len();
        let mut own = own.unwrap_or_default().into_iter();
        for column in &mut columns {
            match own.next() {
                Some(mut own) if own.len() == rows => {
                    own.iter_mut().filter(|x| !x.is_finite()).for_each(|x| *x = 0.0);
                    // the first run's column is moved, not copied
                    if column.is_empty() { *column = own } else { column.append(&mut own) }
                }
                _ => column.resize(column.len() + rows, 0.0),
            }
        }
    }
    shown.then_some(columns)
}

/// Sum of columns, each times its amplitude.
pub(crate) fn weighted(columns: &[Vec<f64>], amplitudes: &[f64]) -> Vec<f64> {
    let rows = columns.first().map_or(0, Vec::len);
    (0..rows).map(|n| columns.iter().zip(amplitudes).map(|(column, x)| column[n] * x).sum()).collect()
}

/// A named cause as an entry of an augmented simulation.
pub(crate) fn added(source: &Source, amplitudes: &[f64]) -> Option<Added> {
    match source {
        Source::Mechanism { definition, form, shape } => {
            Some(Added { id: definition.id, form: *form, shape: shape.clone(), amplitudes: amplitudes.to_vec() })
        }
        _ => None,
    }
}

/// An unnamed curve as entries of an augmented simulation.
pub(crate) fn added_curves(source: &Source, amplitudes: &[f64]) -> Vec<AddedCurve> {
    match source {
        Source::Story { curve } => story::added(curve, amplitudes),
        _ => Vec::new(),
    }
}
