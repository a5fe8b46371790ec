//! A table of working points as CSV, row by row as it comes.

use std::cell::RefCell;
use std::io::{self, Read, Write};
use std::rc::Rc;

use host_tools::calculator::{self, Motion, Oil};
use simulation::guide::GuideSet;

use super::{Direction, Shared};
use crate::cmd::{Failure, Input, output, say};

/// Where the numbers of a row come from.
struct Columns {
    given: Option<usize>,
    /// the force column has the sign of the velocity
    is_signed: bool,
    speed: Option<(usize, f64)>,
    viscosity: Option<usize>,
    temperature: Option<usize>,
    seal_drag: Option<usize>,
}

impl Columns {
    fn of(direction: Direction, header: &csv::StringRecord) -> Self {
        let place = |name: &str| header.iter().position(|column| column.trim() == name);
        let first = |names: &[&str]| names.iter().find_map(|name| place(name));
        let speed = first(&["speed_m_s", "velocity_m_s"]).map(|n| (n, 1.0));
        let given = first(direction.words().1);
        Columns {
            given,
            is_signed: given.is_some() && given == place("drag_force_n") && place("speed_m_s").is_none(),
            speed: speed.or_else(|| place("speed_m_min").map(|n| (n, 1.0 / 60.0))),
            viscosity: place("viscosity_cst"),
            temperature: first(&["temperature_degc", "temperature_block_degc"]),
            seal_drag: place("seal_drag_n"),
        }
    }
}

/// Why a row has no result.
struct Unusable {
    /// Short, for the column `reason`.
    reason: String,
    /// Column of the table, from 1; 0 for the whole row.
    column: usize,
    what: String,
}

pub(super) fn many(
    direction: Direction,
    given: Option<f64>,
    shared: &Shared,
    set: &GuideSet,
    input: Input,
) -> Result<(), Failure> {
    let (option, names, result) = direction.words();
    let writer = Rc::new(RefCell::new(csv::WriterBuilder::new().flexible(true).from_writer(output())));
    let source = FlushFirst { reader: input.reader, writer: Rc::clone(&writer) };
    let mut reader = csv::ReaderBuilder::new().flexible(true).from_reader(source);
    let header = reader.headers().map_err(|why| Failure::Data(format!("{}: {why}", input.name)))?.clone();
    if header.is_empty() {
        return Err(Failure::Data(format!(
            "{}: it is empty; a table starts with the names of its columns",
            input.name
        )));
    }
    let columns = Columns::of(direction, &header);
    if columns.given.is_none() && given.is_none() {
        let names = names.join(" or ");
        return Err(Failure::Data(format!("{}: there is no column {names}; add it or give {option}", input.name)));
    }
    if columns.speed.is_none() && shared.speed().is_none() {
        let what = "there is no column speed_m_s, velocity_m_s or speed_m_min; add one or give --speed";
        return Err(Failure::Data(format!("{}: {what}", input.name)));
    }
    writer.borrow_mut().write_record(header.iter().chain([result, "reason"])).map_err(written)?;
    let (mut rows, mut usable) = (0u64, 0u64);
    let mut record = csv::StringRecord::new();
    loop {
        match reader.read_record(&mut record) {
            Ok(false) => break,
            Ok(true) => {}
            Err(why) => match why.into_kind() {
                csv::ErrorKind::Io(error) if error.kind() == io::ErrorKind::BrokenPipe => return Err(error.into()),
                csv::ErrorKind::Io(error) => return Err(Failure::Data(format!("{}: {error}", input.name))),
                csv::ErrorKind::Utf8 { pos, err } => {
                    let line = pos.map_or(0, |p| p.line());
                    say(format_args!(
                        "{}: line {line}, column {}: not UTF-8; the row is left out",
                        input.name,
                        err.field() + 1
                    ));
                    rows += 1;
                    continue;
                }
                _ => continue,
            },
        }
        rows += 1;
        let answer = row(direction, given, shared, set, &columns, &record);
        let (value, reason) = match answer {
            Ok((value, outside)) => {
                usable += 1;
                (value.to_string(), outside)
            }
            Err(why) => {
                let line = record.position().map_or(0, csv::Position::line);
                let column = if why.column == 0 { String::new() } else { format!(", column {}", why.column) };
                say(format_args!("{}: line {line}{column}: {}", input.name, why.what));
                (String::new(), why.reason)
            }
        };
        let short = header.len().saturating_sub(record.len());
        // a short row is filled up, so that the result stands under its name
        let cells = record.iter().chain(std::iter::repeat_n("", short));
        writer
            .borrow_mut()
            .write_record(cells.take(header.len()).chain([value.as_str(), reason.as_str()]))
            .map_err(written)?;
    }
    writer.borrow_mut().flush()?;
    if usable == 0 {
        return Err(Failure::Data(format!("{}: none of {rows} rows is usable", input.name)));
    }
    if usable < rows {
        say(format_args!("{}: {} of {rows} rows have no result", input.name, rows - usable));
    }
    Ok(())
}

fn row(
    direction: Direction,
    given: Option<f64>,
    shared: &Shared,
    set: &GuideSet,
    columns: &Columns,
    record: &csv::StringRecord,
) -> Result<(f64, String), Unusable> {
    let cell = |place: Option<usize>, name: &str, fallback: Option<f64>| -> Result<Option<f64>, Unusable> {
        let Some(n) = place else { return Ok(fallback) };
        let text = record.get(n).unwrap_or_default().trim();
        if text.is_empty() {
            return Ok(fallback);
        }
        match fast_float2::parse::<f64, _>(text) {
            Ok(x) if x.is_finite() => Ok(Some(x)),
            _ => Err(Unusable {
                reason: format!("{name} is not a number"),
                column: n + 1,
                what: format!("{name} must be a number, not {text:?}"),
            }),
        }
    };
    let missing = |name: &str, place: Option<usize>| Unusable {
        reason: format!("{name} is missing"),
        column: place.map_or(0, |n| n + 1),
        what: format!("{name} is missing"),
    };
    let name = direction.words().1[0];
    let x = cell(columns.given, name, given)?.ok_or_else(|| missing(name, columns.given))?;
    let factor = columns.speed.map_or(1.0, |(_, factor)| factor);
    let at = columns.speed.map(|(n, _)| n);
    let speed = cell(at, "speed_m_s", shared.speed().map(|v| v / factor))?.ok_or_else(|| missing("speed_m_s", at))?;
    let speed_m_s = speed * factor;
    let oil = match cell(columns.viscosity, "viscosity_cst", None)? {
        Some(nu) => Oil::Viscosity(nu),
        None => match cell(columns.temperature, "temperature_degc", None)? {
            // an option on the command line overrides the oil of the guide
            Some(t) if shared.viscosity.is_none() => Oil::Temperature(t),
            _ => shared.oil(),
        },
    };
    let seal_drag_n = cell(columns.seal_drag, "seal_drag_n", shared.seal_drag)?.unwrap_or(0.0);
    let x = if columns.is_signed && speed_m_s < 0.0 { -x } else { x };
    let answer = direction.ask(set, x, Motion { speed_m_s, oil, seal_drag_n }).map_err(|why| {
        let place = match why.input {
            "force_n" | "preload_n" => columns.given,
            "speed_m_s" => at,
            "viscosity_cst" => columns.viscosity,
            "temperature_degc" => columns.temperature,
            _ => columns.seal_drag,
        };
        Unusable { reason: format!("{} out of range", why.input), column: place.map_or(0, |n| n + 1), what: why.what }
    })?;
    Ok((direction.result(&answer), calculator::outside_measured(&answer).join("; ")))
}

fn written(why: csv::Error) -> Failure {
    match why.into_kind() {
        csv::ErrorKind::Io(error) => Failure::Output(error),
        _ => Failure::Output(io::Error::other("a row cannot be written as CSV")),
    }
}

/// Flushes the output before it waits for more input, so that a live source sees its results at once.
struct FlushFirst<R, W: Write> {
    reader: R,
    writer: Rc<RefCell<csv::Writer<W>>>,
}

impl<R: Read, W: Write> Read for FlushFirst<R, W> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.writer.borrow_mut().flush()?;
        self.reader.read(buffer)
    }
}
