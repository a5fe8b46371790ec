//! A run of an axis from the columns of a file: columns needed, checks of rows and units.
//!
//! One row a sample, SI units, `time_s` strictly increasing, columns in any order, unknown ones ignored, an empty cell
//! meaning "not measured":
//!
//! | column | needed | meaning |
//! |---|---|---|
//! | `time_s` | yes | one clock for all columns |
//! | `position_m`, `velocity_m_s` | one of the two | along the rail, signed |
//! | `drag_force_n` | yes | force the drive applies to the carriage, positive towards +position |
//! | `preload_n` | no | reference preload |
//! | `external_load_n` | no | known vertical load on the block |
//! | `temperature_block_degc`, `temperature_rail_degc`, `temperature_ambient_degc` | no | |
//! | `acceleration_m_s2` | no | measured acceleration along travel |
//! | `simulated_force_n` | no | what another program says the drag force should be |
//! | `segment` | no | whole number, or the name of a part; a new one starts a new part |
//!
//! A gap (more than 1.5 median steps of its segment), a new segment and a first jump of the clock backwards start a new
//! part: nothing is interpolated across them.

use std::io::Read;

use simulation::run::{Part, Run};

use super::columns::{Header, Need, Numbers, Places, Wanted, check_mappings};
use super::source::Source;
use super::{Cost, Fault, Losses, Mapping, Place, Progress, Selection, Unusable, parts, segments, silent, units};

/// Fewest rows of a usable recording.
pub const MIN_ROWS: usize = 200;

/// Largest share of rows that are dropped because one of the two columns of motion is empty; above it, the column is.
const MOTION_ROWS: f64 = 0.01;

/// Share of rows whose time is before that of the row above beyond which no order of parts is meant.
const BACKWARDS: f64 = 0.25;

/// The columns that mean something in a run, and what their empty and spoilt cells cost.
const COLUMNS: [(&str, Need); 12] = [
    ("time_s", Need::Everywhere),
    ("drag_force_n", Need::Everywhere),
    ("position_m", Need::Sound),
    ("velocity_m_s", Need::Sound),
    ("segment", Need::Sound),
    ("acceleration_m_s2", Need::Anything),
    ("preload_n", Need::Anything),
    ("external_load_n", Need::Anything),
    ("temperature_block_degc", Need::Anything),
    ("temperature_rail_degc", Need::Anything),
    ("temperature_ambient_degc", Need::Anything),
    ("simulated_force_n", Need::Anything),
];

/// Names of the columns of a run.
pub fn names() -> [&'static str; COLUMNS.len()] {
    COLUMNS.map(|(name, _)| name)
}

/// Reads a run as it stands in a CSV or Parquet file; `file` is its name in messages.
///
/// # Errors
/// As [`open`](super::open).
pub fn read(file: &str, mut input: impl Read) -> Result<(Run, Losses), Unusable> {
    let mut bytes = Vec::new();
    input.read_to_end(&mut bytes).map_err(|source| Unusable::Io { file: file.to_owned(), source })?;
    from_bytes(file, bytes, &[], &[], &silent)
}

/// [`open`](super::open) for a file that is in memory; `file` is its name in messages.
///
/// # Errors
/// As [`open`](super::open).
pub fn from_bytes(
    file: &str,
    bytes: Vec<u8>,
    mappings: &[Mapping],
    selections: &[Selection],
    progress: Progress,
) -> Result<(Run, Losses), Unusable> {
    check_mappings(mappings, &names())?;
    let source = Source::of(file, bytes)?;
    let read = from_source(file, &source, mappings, selections, progress);
    // giving many pages back takes as long as a tenth of the reading; nobody has to wait for it
    std::thread::spawn(move || drop(source));
    read
}

fn from_source(
    file: &str,
    source: &Source,
    mappings: &[Mapping],
    selections: &[Selection],
    progress: Progress,
) -> Result<(Run, Losses), Unusable> {
    let mut wanted = choose(source.header(), mappings)?;
    let mut unusable = Losses::default();
    if let Source::Parquet(_) = source {
        leave_out(source, &mut wanted, &mut unusable, |wanted| {
            wanted.need != Need::Everywhere && wanted.name != "segment" && wanted.name == wanted.told
        });
    }
    let read = |wanted: &[Wanted]| source.numbers(file, wanted.to_vec(), selections, progress);
    let (mut wanted, mut numbers) = segments::read(source, wanted, read)?;
    if numbers.places.len() == 0 {
        let is_of_motion = |wanted: &Wanted| wanted.need == Need::Sound && wanted.name != "segment";
        leave_out(source, &mut wanted, &mut unusable, is_of_motion);
        if unusable.found > 0 {
            (wanted, numbers) = segments::read(source, wanted, read)?;
        }
    }
    for (wanted, spoilt) in wanted.iter().zip(&numbers.spoilt) {
        if *spoilt > 0 && *spoilt == numbers.places.len() as u64 {
            numbers.losses.gather(&wanted.told, *spoilt);
        }
    }
    numbers.losses.absorb(unusable);
    assemble(file, &wanted, numbers)
}

/// Takes out columns that hold no numbers; one column of motion always stays.
fn leave_out(source: &Source, wanted: &mut Vec<Wanted>, losses: &mut Losses, may_go: impl Fn(&Wanted) -> bool) {
    let first = match source {
        Source::Text(opening, _) => Place::Line(opening.line + 1),
        Source::Parquet(_) => Place::Row(1),
    };
    let is_motion = |wanted: &Wanted| matches!(&*wanted.name, "position_m" | "velocity_m_s");
    let mut place = 0;
    while let Some(column) = wanted.get(place) {
        let is_last = is_motion(column) && wanted.iter().filter(|wanted| is_motion(wanted)).count() == 1;
        match source.no_numbers(column.place) {
            Some(found) if may_go(column) && !is_last => {
                losses.note(first, Some(&column.told), Fault::NoNumbers { found }, Cost::AsSaid);
                wanted.remove(place);
            }
            _ => place += 1,
        }
    }
    settle_motion(wanted);
}

/// The columns that a file has of a run.
pub(super) fn choose(header: &Header, mappings: &[Mapping]) -> Result<Vec<Wanted>, Unusable> {
    let mut wanted = Vec::new();
    for (name, need) in COLUMNS {
        match header.wanted(name, need, mappings)? {
            Some(column) => wanted.push(Wanted { whole: name == "segment", ..column }),
            None if need == Need::Everywhere => {
                return Err(header.missing(name, &format!("; --column {name}=COLUMN:SCALE reads it from another one")));
            }
            None => {}
        }
    }
    if settle_motion(&mut wanted) == 0 {
        let advice = "; --column position_m=COLUMN:SCALE reads it from another one";
        return Err(header.missing("position_m or velocity_m_s", advice));
    }
    Ok(wanted)
}

/// How many columns of motion there are; a single one is needed in every row.
fn settle_motion(wanted: &mut [Wanted]) -> usize {
    let motion = |wanted: &&mut Wanted| matches!(&*wanted.name, "position_m" | "velocity_m_s");
    let mut motion: Vec<_> = wanted.iter_mut().filter(motion).collect();
    if let [only] = &mut motion[..] {
        only.need = Need::Everywhere;
    }
    motion.len()
}

/// Makes a run of columns.
pub(super) fn assemble(file: &str, wanted: &[Wanted], numbers: Numbers) -> Result<(Run, Losses), Unusable> {
    let Numbers { columns, places, mut losses, .. } = numbers;
    let mut rows = Rows { columns: wanted.iter().map(|wanted| &*wanted.name).zip(columns).collect(), places };
    let mut found = Losses::default();
    rows.complete_motion(&mut found);
    let falls = rows.column("time_s").map_or(0, |time| time.windows(2).filter(|w| w[1] < w[0]).count());
    if falls as f64 > BACKWARDS * rows.places.len() as f64 {
        return Err(Unusable::Backwards { file: file.to_owned(), falls, rows: rows.places.len() });
    }
    let parts = rows.split(&mut found);
    losses.absorb(found);
    let rows_left = parts.last().map_or(0, |part| part.rows.end);
    if rows_left < MIN_ROWS {
        return Err(Unusable::too_few(file, rows_left, "rows", MIN_ROWS, &losses));
    }
    let mut take = |name| rows.take(name);
    let run = Run {
        name: file.to_owned(),
        time_s: take("time_s").unwrap_or_default(),
        drag_force_n: take("drag_force_n").unwrap_or_default(),
        position_m: take("position_m"),
        velocity_m_s: take("velocity_m_s"),
        acceleration_m_s2: take("acceleration_m_s2"),
        preload_n: take("preload_n"),
        external_load_n: take("external_load_n"),
        temperature_block_degc: take("temperature_block_degc"),
        temperature_rail_degc: take("temperature_rail_degc"),
        temperature_ambient_degc: take("temperature_ambient_degc"),
        simulated_force_n: take("simulated_force_n"),
        parts,
    };
    let value_n = run.drag_force_n[0];
    if run.drag_force_n.iter().all(|force| *force == value_n) {
        return Err(Unusable::ConstantForce { file: file.to_owned(), value_n });
    }
    match units::check(&run) {
        Err(wrong) => {
            let (file, column, fix) = (file.to_owned(), wrong.column, fix(&wrong, wanted));
            Err(Unusable::Units { file, column, why: wrong.why, fix })
        }
        Ok(units::Sign::Opposite) => {
            let mut said = Losses::default();
            said.note(rows.places.place(0), Some("velocity_m_s"), Fault::OppositeVelocity, Cost::AsSaid);
            losses.absorb(said);
            Ok((run, losses))
        }
        Ok(units::Sign::Same) => Ok((run, losses)),
    }
}

/// The options that read a column in the units which it may be in.
fn fix(wrong: &units::Wrong, wanted: &[Wanted]) -> String {
    let option = |(unit, name, scale): &(&str, &str, &str)| {
        // the file's own name and scale of a mapped column stand on the command line or in the simulation file
        let is_plain = wanted.iter().any(|wanted| wanted.name == *name && wanted.told == *name);
        let column = if is_plain { name } else { "COLUMN" };
        format!("{unit}: --column {name}={column}:{scale}")
    };
    let options: Vec<_> = wrong.fixes.iter().map(option).collect();
    if options.is_empty() { String::new() } else { format!(" If {}", options.join("; if ")) }
}

/// Columns by name and where their rows stood.
struct Rows<'a> {
    columns: Vec<(&'a str, Vec<f64>)>,
    places: Places,
}

impl Rows<'_> {
    fn column(&self, name: &str) -> Option<&[f64]> {
        self.columns.iter().find(|(n, _)| *n == name).map(|(_, column)| &**column)
    }

    /// A column of which at least one row was measured.
    fn take(&mut self, name: &str) -> Option<Vec<f64>> {
        let place = self.columns.iter().position(|(n, _)| *n == name)?;
        let (_, column) = self.columns.swap_remove(place);
        column.iter().any(|value| !value.is_nan()).then_some(column)
    }

    /// Keeps only some rows.
    fn keep(&mut self, is_kept: &[bool]) {
        for (_, column) in &mut self.columns {
            let mut row = 0;
            column.retain(|_| {
                row += 1;
                is_kept[row - 1]
            });
        }
        self.places = self.places.keep(is_kept);
    }

    /// Makes the columns of motion complete: drops rows or, where these would be many and the other column exists, the
    /// column.
    fn complete_motion(&mut self, losses: &mut Losses) {
        let names = ["position_m", "velocity_m_s"];
        let empty = names.map(|name| self.column(name).map(|c| c.iter().filter(|value| value.is_nan()).count()));
        let [Some(position), Some(velocity)] = empty else { return };
        if position == 0 && velocity == 0 {
            return;
        }
        let (worse, other) = if velocity >= position { (1, 0) } else { (0, 1) };
        let count = position.max(velocity);
        if count as f64 > MOTION_ROWS * self.places.len() as f64 {
            let first = self.column(names[worse]).and_then(|c| c.iter().position(|value| value.is_nan())).unwrap_or(0);
            let fault = Fault::MotionColumn { rows: count, instead: names[other] };
            losses.note(self.places.place(first), Some(names[worse]), fault, Cost::AsSaid);
            self.columns.retain(|(name, _)| *name != names[worse]);
        }
        let mut is_kept = vec![true; self.places.len()];
        for name in names {
            for (row, value) in self.column(name).unwrap_or_default().iter().enumerate() {
                if value.is_nan() && is_kept[row] {
                    is_kept[row] = false;
                    losses.reject(self.places.place(row), Some(name), Fault::NotMeasured);
                }
            }
        }
        if is_kept.contains(&false) {
            self.keep(&is_kept);
        }
    }

    /// Drops rows with a senseless time and finds where parts start.
    fn split(&mut self, losses: &mut Losses) -> Vec<Part> {
        let time = self.column("time_s").unwrap_or_default();
        let (parts, is_kept) = parts::split(time, self.column("segment"), &self.places, losses);
        if !is_kept.is_empty() {
            self.keep(&is_kept);
        }
        parts
    }
}

#[cfg(test)]
mod tests;
