//! A run of an axis out of the columns of a file: what a row needs and what cannot be meant.
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
//! | `segment` | no | whole number; a new one starts a new part |
//!
//! A gap (more than 1.5 median steps of its segment), a new segment and a first jump of the clock backwards start a new part:
//! nothing is interpolated across them.

use std::io::Read;

use simulation::run::{Part, Run};

use super::columns::{Header, Need, Numbers, Places, Wanted, check_mappings};
use super::{Cost, Fault, Losses, Mapping, Progress, Selection, Unusable, numbers, parts, silent, units};

/// Rows below which a recording says too little to be used.
pub const MIN_ROWS: usize = 200;

/// Share of rows without one of the two columns of motion up to which those rows are given up; above, the column is.
const MOTION_ROWS: f64 = 0.01;

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

/// Names of the columns that mean something in a run.
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
    let (wanted, numbers) = numbers(file, bytes, |header| choose(header, mappings), selections, progress)?;
    assemble(file, &wanted, numbers)
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
    let motion = |wanted: &&mut Wanted| matches!(&*wanted.name, "position_m" | "velocity_m_s");
    match &mut wanted.iter_mut().filter(motion).collect::<Vec<_>>()[..] {
        [] => {
            let advice = "; --column position_m=COLUMN:SCALE reads it from another one";
            return Err(header.missing("position_m or velocity_m_s", advice));
        }
        [only] => only.need = Need::Everywhere,
        _ => {}
    }
    Ok(wanted)
}

/// Makes a run of columns.
pub(super) fn assemble(file: &str, wanted: &[Wanted], numbers: Numbers) -> Result<(Run, Losses), Unusable> {
    let Numbers { columns, places, mut losses, .. } = numbers;
    let mut rows = Rows { columns: wanted.iter().map(|wanted| &*wanted.name).zip(columns).collect(), places };
    let mut found = Losses::default();
    rows.complete_motion(&mut found);
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
        Err(wrong) => Err(Unusable::Units { file: file.to_owned(), column: wrong.column, why: wrong.why }),
        Ok(units::Sign::Opposite) => {
            let mut said = Losses::default();
            said.note(rows.places.place(0), Some("velocity_m_s"), Fault::OppositeVelocity, Cost::AsSaid);
            losses.absorb(said);
            Ok((run, losses))
        }
        Ok(units::Sign::Same) => Ok((run, losses)),
    }
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

    /// Makes the columns of motion complete: gives up rows, or where that would be many and the other column is
    /// there, the column.
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

    /// Drops rows whose time makes no sense and finds where parts start.
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
mod tests {
    use simulation::run::Break;

    use super::*;

    const HEADER: &str = "time_s,position_m,drag_force_n,preload_n,temperature_block_degc\n";

    /// 300 rows at 100 Hz, the row with an index of `changed` replaced.
    fn rows(changed: &[(usize, &str)]) -> String {
        let mut text = HEADER.to_owned();
        for n in 0..300 {
            match changed.iter().find(|(row, _)| *row == n) {
                Some((_, line)) => text += line,
                None => {
                    text += &format!("{:.2},{:.4},{:.1},3000,24", n as f64 / 100.0, n as f64 * 1e-4, n as f64 / 10.0)
                }
            }
            text.push('\n');
        }
        text
    }

    fn messages(text: &str) -> (Run, Losses, Vec<String>) {
        let (run, losses) = read("a.csv", text.as_bytes()).expect("usable");
        let messages = losses.problems.iter().map(ToString::to_string).collect();
        assert_eq!(losses.rejected.values().sum::<u64>(), losses.lost);
        assert_eq!(losses.rows - losses.lost, run.len() as u64);
        let covered: Vec<_> = run.parts.iter().flat_map(|part| part.rows.clone()).collect();
        assert_eq!(covered, (0..run.len()).collect::<Vec<_>>(), "parts cover every row once");
        for part in &run.parts {
            assert!(run.time_s[part.rows.clone()].windows(2).all(|w| w[0] < w[1]), "time rises within {part:?}");
        }
        (run, losses, messages)
    }

    fn refused(text: &str) -> String {
        read("a.csv", text.as_bytes()).expect_err("unusable").to_string()
    }

    fn breaks(run: &Run) -> Vec<(usize, Break)> {
        run.parts.iter().map(|part| (part.rows.start, part.starts)).collect()
    }

    #[test]
    fn a_sound_file_is_one_part() {
        let (run, losses, messages) = messages(&rows(&[]));
        assert_eq!(messages, Vec::<String>::new());
        assert_eq!(losses, Losses { rows: 300, ..Losses::default() });
        assert_eq!(run.parts, [Part { rows: 0..300, segment: None, starts: Break::Start }]);
        assert_eq!((run.time_s[2], run.drag_force_n[2]), (0.02, 0.2));
        assert_eq!(run.position_m.expect("there")[2], 2e-4);
        assert_eq!(run.preload_n, Some(vec![3000.0; 300]));
        assert_eq!(run.temperature_block_degc, Some(vec![24.0; 300]));
        assert_eq!((run.velocity_m_s, run.external_load_n), (None, None));
    }

    #[test]
    fn spoilt_cells_cost_their_row_and_are_named() {
        for (line, message) in [
            (
                "0.10,0.0010,1.x,3000,24",
                "line 12: column drag_force_n: \"1.x\" is not a number (decimal mark is the point); the row is left out",
            ),
            ("0.10,0.0010,inf,3000,24", "line 12: column drag_force_n: \"inf\" is not finite; the row is left out"),
            ("0.10,0.0010,1e999,3000,24", "line 12: column drag_force_n: \"1e999\" is not finite; the row is left out"),
            ("nan,0.0010,1,3000,24", "line 12: column time_s: \"nan\" is not finite; the row is left out"),
            (
                "-1e308,0.0010,1,3000,24",
                "line 12: column time_s: \"-1e308\" is larger than anything that is measured, in any unit; the row is left out",
            ),
            (
                "0.10,0.0010,,3000,24",
                "line 12: column drag_force_n: not measured here, but every row needs it; the row is left out",
            ),
            (
                "0.10,,1.0,3000,24",
                "line 12: column position_m: not measured here, but every row needs it; the row is left out",
            ),
            ("0.10,0.0010", "line 12: 2 cells instead of 5; the row is left out"),
            (
                "0,10,0,0010,1,0,3000,24",
                "line 12: 8 cells instead of 5 (a decimal comma? then separate the columns with `;`); the row is left out",
            ),
            ("0.09,0.0010,1.0,3000,24", "line 12: column time_s: time 0.09 s again; the row is left out"),
            (
                "0.03,0.0010,1.0,3000,24",
                "line 12: column time_s: time 0.03 s stands between 0.09 s and 0.11 s; the row is left out",
            ),
            (
                "7.5,0.0010,1.0,3000,24",
                "line 12: column time_s: time 7.5 s stands between 0.09 s and 0.11 s; the row is left out",
            ),
            (
                "\0\0\0\0\0",
                "line 12: zero bytes instead of a number: the recorder lost power while writing; the row is left out",
            ),
            (
                "0.1\0,0.001,1,1,1",
                "line 12: column time_s: zero bytes instead of a number: the recorder lost power while writing; \
                 the row is left out",
            ),
            ("0.10,\"0.0010,1.0,3000,24", "line 12: 2 cells instead of 5; the row is left out"),
        ] {
            let (run, losses, got) = messages(&rows(&[(10, line)]));
            assert_eq!(got[0], message);
            // the row left out leaves a gap
            assert_eq!(got.len(), 2, "{got:?}");
            assert!(got[1].ends_with("what follows is a part of its own"));
            assert_eq!((losses.lost, losses.gaps, run.len()), (1, 1, 299));
            assert_eq!(breaks(&run), [(0, Break::Start), (10, Break::Gap)]);
        }
    }

    #[test]
    fn what_is_not_needed_costs_only_its_cell() {
        let (run, losses, got) = messages(&rows(&[
            (10, "0.10,0.0010,1.0,,"),
            (11, "0.11,0.0011,1.1,nan,24"),
            (12, "0.12,0.0012,1.2,3000,warm"),
            (13, "0.13,\"0.0013\", 1.3 ,3000,24,,"),
        ]));
        assert_eq!(
            got,
            [
                "line 13: column preload_n: \"nan\" is not finite; it counts as not measured",
                "line 14: column temperature_block_degc: \"warm\" is not a number (decimal mark is the point); \
                 it counts as not measured"
            ]
        );
        assert_eq!((losses.lost, run.len(), run.parts.len()), (0, 300, 1));
        let preload = run.preload_n.expect("there");
        let temperature = run.temperature_block_degc.expect("there");
        assert!(preload[10].is_nan() && preload[11].is_nan() && preload[12] == 3000.0);
        assert!(temperature[10].is_nan() && temperature[11] == 24.0 && temperature[12].is_nan());
        assert_eq!((run.position_m.expect("there")[13], run.drag_force_n[13]), (0.0013, 1.3));
    }

    #[test]
    fn line_ends_marks_blanks_and_comments_change_nothing() {
        let plain = messages(&rows(&[]));
        for text in [
            rows(&[]).replace('\n', "\r\n"),
            format!("\u{feff}{}", rows(&[])),
            rows(&[]).replace(',', " , "),
            format!("# made by hand\n\n{}\n\n", rows(&[]).trim_end()).replace("\n1.00,", "\n# a break\n\n1.00,"),
            rows(&[]).trim_end().to_owned(),
            // whatever stands in a column that nobody asked for
            rows(&[]).replace(",24\n", ",24,Stra\u{df}e;\"\n").replace("degc\n", "degc,note\n"),
            rows(&[]).replace(",24\n", ",24,\"a, b\"\n").replace("degc\n", "degc,note\n"),
        ] {
            assert_eq!(messages(&text), plain, "{}", &text[..200]);
        }
        let mut latin = rows(&[]).replace(",24\n", ",24,#\n").replace("degc\n", "degc,note\n").into_bytes();
        latin.iter_mut().filter(|byte| **byte == b'#').for_each(|byte| *byte = 0xdf);
        assert_eq!(read("a.csv", &*latin).expect("usable").0, plain.0);
        let mut latin = rows(&[(10, "0.10,0.0010,1.0#,3000,24")]).into_bytes();
        latin.iter_mut().filter(|byte| **byte == b'#').for_each(|byte| *byte = 0xb0);
        assert_eq!(
            read("a.csv", &*latin).expect("usable").1.problems[0].to_string(),
            "line 12: column drag_force_n: \"1.0\u{fffd}\" is not a number (decimal mark is the point); the row is left out"
        );
    }

    #[test]
    fn other_separators_and_decimal_commas_are_read_and_said() {
        let (plain, _, _) = messages(&rows(&[]));
        for (text, message) in [
            (
                rows(&[]).replace(',', ";").replace('.', ","),
                "line 1: columns are separated by ';' and the decimal mark is ',': read like that",
            ),
            (
                rows(&[]).replace(',', ";"),
                "line 1: columns are separated by ';' and the decimal mark is '.': read like that",
            ),
            (
                rows(&[]).replace(',', "\t").replace('.', ","),
                "line 1: columns are separated by '\\t' and the decimal mark is ',': read like that",
            ),
        ] {
            let (run, losses, got) = messages(&text);
            assert_eq!(got, [message]);
            assert_eq!((run, losses.lost), (plain.clone(), 0));
        }
        let (_, _, got) = messages(&rows(&[(10, "0.10,0.001,1.x,3000,24")]).replace(',', ";").replace('.', ","));
        assert_eq!(
            got[1],
            "line 12: column drag_force_n: \"1,x\" is not a number (decimal mark is the point); the row is left out"
        );
    }

    #[test]
    fn a_recorder_that_was_cut_off_loses_its_last_row() {
        let text = rows(&[]);
        for (cut, message) in [
            (
                ",24\n",
                Some("line 301: the file ends after 4 of 5 cells: the recorder was cut off; the row is left out"),
            ),
            (
                "4\n",
                Some(
                    "line 301: column temperature_block_degc: the file ends within \"2\", which is shorter than the cell \
                     above and has no line end: the recorder was cut off; the row is left out",
                ),
            ),
            ("\n", None),
            ("", None),
        ] {
            let (run, _, got) = messages(text.strip_suffix(cut).expect("that end"));
            assert_eq!(got.first().map(|m| &**m), message);
            assert_eq!(run.len(), 300 - usize::from(message.is_some()));
        }
    }

    #[test]
    fn gaps_and_clock_jumps_start_parts() {
        let (run, losses, got) = messages(&rows(&[
            (100, "1.02,0.01,1.0,,"),
            (101, "1.03,0.01,1.0,,"),
            (102, "1.04,0.01,1.0,,"),
            (103, "1.05,0.01,1.0,,"),
        ]));
        assert_eq!(
            got,
            [
                "line 102: column time_s: 0.020 s without samples (median step 0.0100 s); what follows is a part of its \
                 own",
                "line 106: column time_s: clock jumps back from 1.05 s to 1.04 s; what follows is a part of its own"
            ]
        );
        assert_eq!((losses.lost, losses.gaps), (0, 1));
        assert_eq!(breaks(&run), [(0, Break::Start), (100, Break::Gap), (104, Break::ClockJump)]);
        assert_eq!(run.longest_part(), 104..300);
        // rows of a second jump are lost until time goes on
        let twice = rows(&[]) + &rows(&[]).replace(HEADER, "") + &rows(&[]).replace(HEADER, "") + "2.995,1,1,1,1\n";
        let (run, losses, got) = messages(&twice);
        assert_eq!(
            got[1],
            "line 602: column time_s: time 0 s lies before 2.99 s and the clock jumped back before (several runs in one \
             file? give each a number in a column segment); the row is left out"
        );
        // at the same time as the last one of the second
        assert_eq!((losses.lost, losses.rejected["time-backward"], losses.rejected["time-repeated"]), (300, 299, 1));
        assert_eq!(breaks(&run), [(0, Break::Start), (300, Break::ClockJump)]);
        assert_eq!(losses.found, 301);
        assert_eq!(losses.problems.len(), Losses::KEPT);
        assert_eq!(
            losses.describe("a.csv")[5..],
            ["a.csv: 296 more problems of these kinds", "a.csv: 300 of 901 rows lost"]
        );
    }

    #[test]
    fn a_new_segment_is_a_part_without_a_word() {
        let mut text = "segment,drag_force_n,velocity_m_s,time_s\n".to_owned();
        for n in 0..300 {
            let segment = n / 100;
            // warmed up, then the clock was set to zero
            let start_s = [0.0, 60.0, 0.0][segment as usize];
            text += &format!("{segment},{n},0.1,{}\n", f64::from(n % 100) / 100.0 + start_s);
        }
        let (run, _, got) = messages(&text);
        assert_eq!(got, Vec::<String>::new());
        assert_eq!(breaks(&run), [(0, Break::Start), (100, Break::Segment), (200, Break::Segment)]);
        assert_eq!(run.parts[2].segment, Some(2));
        // every segment may have a rate of its own
        let slower: String = (0..300).map(|n| format!("{},{n},0.1,{}\n", n / 250, n * (1 + 9 * (n / 250)))).collect();
        let (run, losses, got) = messages(&format!("segment,drag_force_n,velocity_m_s,time_s\n{slower}"));
        assert_eq!((losses.gaps, got), (0, Vec::new()));
        assert_eq!(breaks(&run), [(0, Break::Start), (250, Break::Segment)]);
        let (_, _, got) = messages(&text.replace("\n1,150,", "\n1.5,150,"));
        assert_eq!(got[0], "line 152: column segment: \"1.5\" is not a whole number; the row is left out");
    }

    #[test]
    fn a_column_of_motion_is_complete_or_not_there() {
        let file = |position: fn(usize) -> bool, velocity: fn(usize) -> bool| {
            let mut text = "time_s,position_m,velocity_m_s,drag_force_n\n".to_owned();
            for n in 0..300 {
                let x = if position(n) { format!("{}", n as f64 / 1000.0) } else { String::new() };
                let v = if velocity(n) { "0.1" } else { "" };
                text += &format!("{},{x},{v},{n}\n", n as f64 / 100.0);
            }
            text
        };
        let (run, _, got) = messages(&file(|_| true, |n| n % 10 == 0));
        assert_eq!(
            got,
            ["line 3: column velocity_m_s: not measured in 270 rows; the column is left out, position_m is there"]
        );
        assert_eq!((run.len(), run.velocity_m_s), (300, None));
        let (run, losses, got) = messages(&file(|_| true, |n| n != 7));
        assert_eq!(
            got[0],
            "line 9: column velocity_m_s: not measured here, but every row needs it; the row is left out"
        );
        assert_eq!((run.len(), losses.gaps), (299, 1));
        assert_eq!(run.velocity_m_s, Some(vec![0.1; 299]));
    }

    #[test]
    fn what_cannot_be_used_is_refused() {
        for (text, message) in [
            ("", "a.csv: the file is empty"),
            ("\u{feff}\n\n", "a.csv: the file is empty"),
            (HEADER, "a.csv: 0 usable rows of 0 rows, at least 200 are needed"),
            (
                "time_s,drag_force_n\n0,1\n",
                "a.csv: line 1: no column position_m or velocity_m_s; the header row has: time_s, drag_force_n; \
                 --column position_m=COLUMN:SCALE reads it from another one",
            ),
            (
                "time_s,position_m,force\n",
                "a.csv: line 1: no column drag_force_n; the header row has: time_s, position_m, force; \
                 --column drag_force_n=COLUMN:SCALE reads it from another one",
            ),
            (
                "time_s,position_m,position_m,drag_force_n\n",
                "a.csv: line 1: column position_m is there twice (columns 2 and 3); name the one that is not meant \
                 differently",
            ),
            (
                "0.0,0.0,1.0\n0.1,0.0,1.0\n",
                "a.csv: line 1: numbers where the names of the columns should stand; put a line above it, as \
                 `time_s,position_m,drag_force_n`",
            ),
            (
                "PK\u{3}\u{4}...",
                "a.csv: this is a spreadsheet or zip archive, not a recording; save the sheet as CSV, or unpack the archive",
            ),
            (
                "\0\0\0\u{1}",
                "a.csv: this is no text (zero bytes where the header row should stand), not a recording; save the \
                 recording as CSV or Parquet",
            ),
            (
                "time_s,drag_force_n\r0,1\r",
                "a.csv: this is text with bare carriage returns as line ends, not a recording; save it with line feeds",
            ),
            (
                "# schema: guideblock.raw/1\ntick,sample\n",
                "a.csv: this is a raw recording of a block, not a recording; `guideblock replay` sends it through the \
                 block's pipeline",
            ),
        ] {
            assert_eq!(refused(text), message);
        }
        assert_eq!(
            refused(&format!("{HEADER}0,0,1,,\n0.1,0,x,,\n")),
            "a.csv: 1 usable rows of 2 rows, at least 200 are needed; first problem: line 3: column drag_force_n: \
             \"x\" is not a number (decimal mark is the point); the row is left out"
        );
        let flat: String = (0..250).map(|n| format!("{n},0,7.5,,\n")).collect();
        assert_eq!(
            refused(&format!("{HEADER}{flat}")),
            "a.csv: column drag_force_n is 7.5 N in every row: sensor not connected, or the wrong column"
        );
        let utf16: Vec<u8> = [0xff, 0xfe].into_iter().chain(HEADER.bytes().flat_map(|byte| [byte, 0])).collect();
        assert_eq!(
            read("a.csv", &*utf16).expect_err("unusable").to_string(),
            "a.csv: this is UTF-16 text, not a recording; save it as UTF-8"
        );
    }

    #[test]
    fn mappings_and_selections_read_foreign_tables() {
        let mut text = "t,x_mm,T_k,gtau,drive,kind\n".to_owned();
        for n in 0..600 {
            text += &format!("{},{},{},{},{}.0,{}\n", n / 2, n / 2, 300, n, n % 2 + 1, ["a", "b"][n % 2]);
        }
        let mappings: Vec<Mapping> =
            ["time_s=t:0.01", "position_m=x_mm:0.001", "temperature_block_degc=T_k:1:-273.15", "drag_force_n=gtau:-2"]
                .map(|text| text.parse().expect("sound"))
                .to_vec();
        let with = |mappings: &[Mapping], selections: &[&str]| {
            let selections: Vec<Selection> = selections.iter().map(|text| text.parse().expect("sound")).collect();
            from_bytes("a.csv", text.clone().into_bytes(), mappings, &selections, &silent)
        };
        for selection in [&["drive=2"][..], &["kind=b"], &["drive=2", "kind=b"]] {
            let (run, losses) = with(&mappings, selection).expect("usable");
            assert_eq!(losses, Losses { rows: 300, ..Losses::default() });
            assert_eq!((run.len(), run.time_s[100], run.drag_force_n[1]), (300, 1.0, -6.0));
            assert_eq!(run.position_m.expect("there")[299], 0.299);
            assert_eq!(run.temperature_block_degc.expect("there")[0], 300.0 - 273.15);
        }
        let error = |mappings: &[&str], selections: &[&str]| {
            let all: Vec<Mapping> = mappings.iter().map(|text| text.parse().expect("sound")).collect();
            with(&all, selections).expect_err("refused").to_string()
        };
        assert_eq!(
            with(&mappings, &["drive=3", "kind=a"]).expect_err("refused").to_string(),
            "a.csv: no row has drive = 3 and kind = a; column drive has: 1.0, 2.0; column kind has: a, b"
        );
        assert_eq!(
            with(&mappings, &["axis=1"]).expect_err("refused").to_string(),
            "a.csv: line 1: no column axis; the header row has: t, x_mm, T_k, gtau, drive, kind (asked for by --where axis=1)"
        );
        assert_eq!(
            error(&["time_s=time:0.01"], &[]),
            "a.csv: line 1: no column time; the header row has: t, x_mm, T_k, gtau, drive, kind (asked for by --column \
             time_s=time:...)"
        );
        assert!(error(&["drag=gtau:2"], &[]).starts_with(
            "--column drag=...: nothing reads a column drag; there are: time_s, drag_force_n, position_m"
        ));
        assert_eq!(error(&["time_s=t", "time_s=t:2"], &[]), "--column time_s=... is given twice");
    }
}
