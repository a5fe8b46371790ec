//! Runs of an axis: motion, drag force, temperature and, where a rig measures it, the true preload.
//!
//! CSV with one header row, SI units, `time_s` strictly increasing, columns in any order, unknown ones ignored,
//! an empty cell meaning "not measured":
//!
//! | column | needed | meaning |
//! |---|---|---|
//! | `time_s` | yes | one clock for all columns |
//! | `position_m`, `velocity_m_s` | one of the two | along the rail, signed |
//! | `drag_force_n` | yes | force the drive applies to the carriage, positive towards +position |
//! | `preload_n` | no | reference preload |
//! | `temperature_block_degc` | no | |
//! | `segment` | no | a new number starts a new part |
//!
//! A gap (more than 1.5 median steps), a new segment and a first jump of the clock backwards start a new part:
//! nothing is interpolated across them. Whether the units can be meant is not judged here.

use std::io::Read;

use super::{Fault, Losses, Unusable};

/// Rows below which a recording says too little to be used.
pub const MIN_ROWS: usize = 200;

/// Steps longer than this many median steps are gaps.
const GAP_STEPS: f64 = 1.5;

/// One row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisSample {
    /// Time, s.
    pub time_s: f64,
    /// Position, m.
    pub position_m: Option<f64>,
    /// Velocity, m/s, signed.
    pub velocity_m_s: Option<f64>,
    /// Force the drive applies to the carriage, N.
    pub drag_force_n: f64,
    /// Reference preload, N.
    pub preload_n: Option<f64>,
    /// Temperature of the block, °C.
    pub temperature_block_degc: Option<f64>,
    /// Number of the gap-free part it belongs to, from 0.
    pub part: usize,
}

/// A run of an axis.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisRecording {
    /// The usable rows, in the order of the file.
    pub samples: Vec<AxisSample>,
    /// What could not be used, and what was found on the way.
    pub losses: Losses,
}

impl AxisRecording {
    /// The gap-free part with most rows.
    pub fn longest_part(&self) -> &[AxisSample] {
        // `max_by_key` would take the last of equals; the first is the one a reader expects
        self.samples
            .chunk_by(|a, b| a.part == b.part)
            .reduce(|a, b| if b.len() > a.len() { b } else { a })
            .unwrap_or(&[])
    }
}

/// Reads a run; `file` is its name in messages.
///
/// # Errors
/// [`Unusable`] when the file cannot be read, lacks a column, leaves fewer than [`MIN_ROWS`] rows, or has a
/// force that never changes.
pub fn read(file: &str, input: impl Read) -> Result<AxisRecording, Unusable> {
    let mut reader = csv::ReaderBuilder::new().flexible(true).trim(csv::Trim::All).from_reader(input);
    let io = |error: csv::Error| Unusable::Io { file: file.to_owned(), source: error.into() };
    let columns = Columns::find(file, reader.headers().map_err(io)?)?;
    let mut losses = Losses::default();
    let mut rows: Vec<Row> = Vec::new();
    let mut record = csv::StringRecord::new();
    while reader.read_record(&mut record).map_err(io)? {
        losses.rows += 1;
        let line = record.position().map_or(0, csv::Position::line);
        match columns.row(&record, line) {
            Ok(row) => rows.push(row),
            Err((column, fault)) => {
                losses.lost += 1;
                losses.note(line, column, fault);
            }
        }
    }
    let samples = split(rows, &mut losses);
    losses.problems.sort_by_key(|problem| problem.line);
    if samples.len() < MIN_ROWS {
        return Err(Unusable::too_few(file, samples.len(), "rows", MIN_ROWS, &losses));
    }
    let value_n = samples[0].drag_force_n;
    if samples.iter().all(|s| s.drag_force_n == value_n) {
        return Err(Unusable::ConstantForce { file: file.to_owned(), value_n });
    }
    Ok(AxisRecording { samples, losses })
}

/// Where the columns stand.
struct Columns {
    cells: usize,
    time: usize,
    force: usize,
    position: Option<usize>,
    velocity: Option<usize>,
    preload: Option<usize>,
    temperature: Option<usize>,
    segment: Option<usize>,
}

/// A row that can be used as it stands.
struct Row {
    line: u64,
    segment: Option<f64>,
    sample: AxisSample,
}

impl Columns {
    fn find(file: &str, header: &csv::StringRecord) -> Result<Self, Unusable> {
        let place = |name: &str| header.iter().position(|n| n.trim_start_matches('\u{feff}') == name);
        let missing = |column| Unusable::MissingColumn {
            file: file.to_owned(),
            line: 1,
            column,
            found: header.iter().collect::<Vec<_>>().join(", "),
        };
        let (position, velocity) = (place("position_m"), place("velocity_m_s"));
        if position.is_none() && velocity.is_none() {
            return Err(missing("position_m or velocity_m_s"));
        }
        Ok(Columns {
            cells: header.len(),
            time: place("time_s").ok_or_else(|| missing("time_s"))?,
            force: place("drag_force_n").ok_or_else(|| missing("drag_force_n"))?,
            position,
            velocity,
            preload: place("preload_n"),
            temperature: place("temperature_block_degc"),
            segment: place("segment"),
        })
    }

    fn row(&self, record: &csv::StringRecord, line: u64) -> Result<Row, (Option<&'static str>, Fault)> {
        if record.len() < self.cells {
            return Err((None, Fault::ShortLine { found: record.len(), expected: self.cells }));
        }
        let cell = |place: Option<usize>, name: &'static str| match place {
            Some(place) => number(record.get(place).unwrap_or("")).map_err(|fault| (Some(name), fault)),
            None => Ok(None),
        };
        let needed =
            |place: usize, name: &'static str| cell(Some(place), name)?.ok_or((Some(name), Fault::NotMeasured));
        let time_s = needed(self.time, "time_s")?;
        let drag_force_n = needed(self.force, "drag_force_n")?;
        let position_m = cell(self.position, "position_m")?;
        let velocity_m_s = cell(self.velocity, "velocity_m_s")?;
        if position_m.is_none() && velocity_m_s.is_none() {
            return Err((Some("position_m"), Fault::NotMeasured));
        }
        Ok(Row {
            line,
            segment: cell(self.segment, "segment")?,
            sample: AxisSample {
                time_s,
                position_m,
                velocity_m_s,
                drag_force_n,
                preload_n: cell(self.preload, "preload_n")?,
                temperature_block_degc: cell(self.temperature, "temperature_block_degc")?,
                part: 0,
            },
        })
    }
}

/// A cell as a number, `None` when it is empty.
fn number(cell: &str) -> Result<Option<f64>, Fault> {
    if cell.is_empty() {
        return Ok(None);
    }
    match cell.parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(Some(number)),
        Ok(_) => Err(Fault::NotFinite { cell: cell.to_owned() }),
        Err(_) => Err(Fault::NotANumber { cell: cell.to_owned() }),
    }
}

/// Drops rows whose time makes no sense and numbers the gap-free parts.
fn split(rows: Vec<Row>, losses: &mut Losses) -> Vec<AxisSample> {
    let step_s = median_step(&rows);
    let mut samples: Vec<AxisSample> = Vec::with_capacity(rows.len());
    let (mut part, mut segment, mut jumped) = (0, None, false);
    for row in rows {
        if let Some(before) = samples.last() {
            let (from_s, to_s) = (before.time_s, row.sample.time_s);
            if to_s == from_s {
                losses.lost += 1;
                losses.note(row.line, Some("time_s"), Fault::TimeRepeated { time_s: to_s });
                continue;
            }
            if to_s < from_s {
                if jumped {
                    losses.lost += 1;
                    losses.note(row.line, Some("time_s"), Fault::TimeBackward { from_s, to_s });
                    continue;
                }
                jumped = true;
                part += 1;
                losses.note(row.line, Some("time_s"), Fault::ClockJump { from_s, to_s });
            } else if row.segment != segment {
                part += 1;
            } else if to_s - from_s > GAP_STEPS * step_s {
                part += 1;
                losses.note(row.line, Some("time_s"), Fault::Gap { missing_s: to_s - from_s - step_s, step_s });
            }
        }
        segment = row.segment;
        samples.push(AxisSample { part, ..row.sample });
    }
    samples
}

fn median_step(rows: &[Row]) -> f64 {
    let mut steps: Vec<_> =
        rows.windows(2).map(|w| w[1].sample.time_s - w[0].sample.time_s).filter(|step| *step > 0.0).collect();
    steps.sort_by(f64::total_cmp);
    steps.get(steps.len() / 2).copied().unwrap_or(f64::INFINITY)
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str = "time_s,position_m,drag_force_n,preload_n,temperature_block_degc\n";

    /// 300 rows at 100 Hz, the row with an index of `changed` replaced.
    fn run(changed: &[(usize, &str)]) -> String {
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

    fn messages(changed: &[(usize, &str)]) -> (AxisRecording, Vec<String>) {
        let recording = read("a.csv", run(changed).as_bytes()).expect("usable");
        let messages = recording.losses.problems.iter().map(ToString::to_string).collect();
        (recording, messages)
    }

    #[test]
    fn a_sound_file_is_one_part() {
        let (recording, messages) = messages(&[]);
        assert_eq!(messages, Vec::<String>::new());
        assert_eq!(recording.longest_part().len(), 300);
        let third = recording.samples[2];
        assert_eq!((third.time_s, third.position_m, third.drag_force_n), (0.02, Some(2e-4), 0.2));
        assert_eq!(
            (third.preload_n, third.temperature_block_degc, third.velocity_m_s),
            (Some(3000.0), Some(24.0), None)
        );
    }

    #[test]
    fn spoilt_cells_cost_their_row_and_are_named() {
        for (line, message) in [
            (
                "0.10,0.0010,1.x,3000,24",
                "line 12: column drag_force_n: \"1.x\" is not a number (decimal mark is the point); the row is left out",
            ),
            ("0.10,0.0010,inf,3000,24", "line 12: column drag_force_n: \"inf\" is not finite; the row is left out"),
            (
                "0.10,0.0010,,3000,24",
                "line 12: column drag_force_n: not measured here, but every row needs it; the row is left out",
            ),
            (
                "0.10,,1.0,3000,24",
                "line 12: column position_m: not measured here, but every row needs it; the row is left out",
            ),
            ("0.10,0.0010", "line 12: 2 cells instead of 5; the row is left out"),
            ("0.09,0.0010,1.0,3000,24", "line 12: column time_s: time 0.09 s again; the row is left out"),
        ] {
            let (recording, got) = messages(&[(10, line)]);
            assert_eq!(got[0], message);
            // the row left out leaves a gap
            assert_eq!(got.len(), 2, "{got:?}");
            assert!(got[1].ends_with("what follows is a part of its own"));
            assert_eq!((recording.losses.lost, recording.samples.len()), (1, 299));
        }
        let (recording, got) = messages(&[(10, "0.10,0.0010,1.0,,")]);
        assert_eq!(got, Vec::<String>::new());
        assert_eq!(recording.samples[10].preload_n, None);
    }

    #[test]
    fn gaps_and_clock_jumps_start_parts() {
        let (recording, got) = messages(&[
            (100, "1.02,0.01,1.0,,"),
            (101, "1.03,0.01,1.0,,"),
            (102, "1.04,0.01,1.0,,"),
            (103, "1.05,0.01,1.0,,"),
        ]);
        assert_eq!(
            got[0],
            "line 102: column time_s: 0.020 s without samples (median step 0.0100 s); what follows is a part of its own"
        );
        // 1.04 and 1.05 come twice: once jumping back, and from then on backwards is a lost row
        assert_eq!(
            got[1],
            "line 106: column time_s: clock jumps back from 1.05 s to 1.04 s; what follows is a part of its own"
        );
        assert_eq!(recording.samples[0].part, 0);
        assert_eq!(recording.samples[299].part, 2);
        assert_eq!(recording.longest_part().len(), 196);
        let (recording, got) = messages(&[(50, "0.10,0.01,1.0,,"), (150, "0.20,0.01,1.0,,")]);
        assert_eq!(recording.losses.lost, 1, "{got:?}");
        assert!(
            got.iter().any(|m| m == "line 152: column time_s: time 0.2 s lies before 1.49 s; the row is left out"),
            "{got:?}"
        );
    }

    #[test]
    fn a_new_segment_is_a_part_without_a_word() {
        let mut text = "segment,drag_force_n,velocity_m_s,time_s\n".to_owned();
        for n in 0..300 {
            let segment = n / 150;
            text += &format!("{segment},{n},0.1,{}\n", f64::from(n) / 100.0 + 60.0 * f64::from(segment));
        }
        let recording = read("a.csv", text.as_bytes()).expect("usable");
        assert_eq!(recording.losses.problems, []);
        assert_eq!(recording.samples[299].part, 1);
        assert_eq!(recording.longest_part()[0].time_s, 0.0);
    }

    #[test]
    fn what_cannot_be_used_is_refused() {
        let refused = |text: &str| read("a.csv", text.as_bytes()).expect_err("unusable").to_string();
        assert_eq!(
            refused("time_s,drag_force_n\n0,1\n"),
            "a.csv: line 1: no column position_m or velocity_m_s; the header row has: time_s, drag_force_n"
        );
        assert_eq!(
            refused("time_s,position_m,force\n"),
            "a.csv: line 1: no column drag_force_n; the header row has: time_s, position_m, force"
        );
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
    }
}
