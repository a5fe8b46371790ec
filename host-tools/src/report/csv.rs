//! Messages as rows of CSV: one row a message, an empty cell where that kind of message has no such number.

use can_wire::Message;
use model_core::consistency::Axis;
use model_core::sample::{Reason, Reasons};

use crate::candump::Micros;
use crate::decode::Decoded;

/// Content of `quality` when the preload may be trusted.
pub const TRUSTED: &str = "trusted";

/// The name of an estimate's quality.
pub fn quality(reason: Option<Reason>) -> &'static str {
    reason.map_or(TRUSTED, Reason::name)
}

/// The columns, units in their names.
pub const COLUMNS: [&str; 33] = [
    "time_s",
    "node",
    "message",
    "counter",
    "preload_n",
    "sigma_n",
    "drag_force_n",
    "quality",
    "speed_m_s",
    "temperature_degc",
    "motion",
    "block_time_us",
    "reasons",
    "lost_blocks",
    "error_code",
    "amplitude_n",
    "phase_rad",
    "wavelength_m",
    "state",
    "reset",
    "boot_count",
    "frames_dropped",
    "image",
    "changes",
    "limits",
    "unlocked",
    "bursting",
    "misfit_axis",
    "misfit_strength",
    "misfit_share",
    "misfit_since_s",
    "acting",
    "parameter_source",
];

/// The header row, without the line's end.
pub fn header() -> String {
    COLUMNS.join(",")
}

/// Appends a message as one row, the line's end included.
///
/// Written cell by cell: names and numbers need no quotes, and a serialiser that checks for them takes four times as
/// long, which matters in a log of millions of frames.
pub fn row(out: &mut Vec<u8>, decoded: &Decoded) {
    let mut row = Row { out, cells: 0 };
    row.time(decoded.time);
    row.count(decoded.node.get());
    match decoded.message {
        Message::Estimate(m) => {
            row.name("estimate");
            row.count(m.counter);
            row.number(m.preload_n);
            row.number(m.sigma_n);
            row.number(m.drag_force_n);
            row.name(quality(m.quality));
        }
        Message::Motion(m) => {
            row.name("motion");
            row.count(m.counter);
            row.up_to("speed_m_s");
            row.number(m.speed_m_s);
            row.number(m.temperature_degc);
            row.name(m.motion.name());
            row.count(m.time_us);
        }
        Message::Fault(m) => {
            row.name("fault");
            row.count(m.counter);
            row.up_to("reasons");
            row.name(&names(m.reasons).join(" "));
            row.count(m.lost_blocks);
            row.count(m.error_code);
        }
        Message::Ripple(m) => {
            row.name("ripple");
            row.count(m.counter);
            row.up_to("amplitude_n");
            row.number(m.amplitude_n);
            row.number(m.phase_rad);
            row.number(m.wavelength_m);
        }
        Message::Acting(m) => {
            row.name("acting");
            row.count(m.counter);
            row.up_to("acting");
            row.name(&m.acting.names().collect::<Vec<_>>().join(" "));
            row.name(m.source.name());
        }
        Message::Misfit(m) => {
            row.name("misfit");
            row.count(m.counter);
            row.up_to("misfit_axis");
            row.name(m.axis.map_or("", Axis::name));
            row.number(m.strength);
            row.number(m.share);
            row.number(m.since_s);
        }
        Message::State(m) => {
            row.name("state");
            row.count(m.counter);
            row.up_to("image");
            row.name(&hash(m.image));
            row.count(m.changes);
            row.name(m.limits.name());
            row.count(u8::from(m.unlocked));
            row.count(u8::from(m.bursting));
        }
        Message::Heartbeat(m) => {
            row.name("heartbeat");
            row.count(m.counter);
            row.up_to("state");
            row.name(m.state.name());
            row.name(m.reset_cause.name());
            row.count(m.boot_count);
            row.count(m.frames_dropped);
        }
    }
    row.finish();
}

/// A row under construction.
struct Row<'a> {
    out: &'a mut Vec<u8>,
    cells: usize,
}

impl Row<'_> {
    fn cell(&mut self, text: &[u8]) {
        if self.cells > 0 {
            self.out.push(b',');
        }
        self.out.extend_from_slice(text);
        self.cells += 1;
    }

    fn name(&mut self, name: &str) {
        self.cell(name.as_bytes());
    }

    fn count(&mut self, count: impl itoa::Integer) {
        self.cell(itoa::Buffer::new().format(count).as_bytes());
    }

    fn number(&mut self, number: Option<f32>) {
        match number {
            Some(number) => self.cell(ryu::Buffer::new().format(number).as_bytes()),
            None => self.cell(b""),
        }
    }

    /// Seconds with six decimals.
    fn time(&mut self, time: Option<Micros>) {
        self.cell(b"");
        if let Some(Micros(micros)) = time {
            self.out.extend_from_slice(itoa::Buffer::new().format(micros / 1_000_000).as_bytes());
            // adding a million keeps the leading zeros; its digit 1 is replaced by the point
            let at = self.out.len();
            self.out.extend_from_slice(itoa::Buffer::new().format(1_000_000 + micros % 1_000_000).as_bytes());
            self.out[at] = b'.';
        }
    }

    /// Leaves cells empty up to a column.
    fn up_to(&mut self, column: &str) {
        let empty = COLUMNS.iter().skip(self.cells).take_while(|name| **name != column).count();
        self.empty(empty);
    }

    fn empty(&mut self, cells: usize) {
        self.out.extend(std::iter::repeat_n(b',', cells));
        self.cells += cells;
    }

    fn finish(mut self) {
        self.empty(COLUMNS.len() - self.cells);
        self.out.push(b'\n');
    }
}

/// A parameter image's hash as people compare it.
pub fn hash(hash: u32) -> String {
    format!("{hash:08x}")
}

/// The names of a set of reasons, most urgent first.
pub fn names(set: Reasons) -> Vec<&'static str> {
    set.iter().map(Reason::name).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use can_wire::{EstimateMessage, MotionMessage, NodeId};
    use model_core::sample::Motion;

    #[test]
    fn every_row_has_every_column_and_its_cells_in_place() {
        let messages = [
            Message::Estimate(EstimateMessage {
                preload_n: Some(3000.5),
                sigma_n: None,
                drag_force_n: Some(-1e-7),
                quality: None,
                counter: 3,
            }),
            Message::Motion(MotionMessage {
                speed_m_s: Some(0.1),
                temperature_degc: None,
                motion: Motion::Forward,
                time_us: 70,
                counter: 15,
            }),
        ];
        let mut out = Vec::new();
        for (time, message) in [Some(Micros(1_700_000_000_000_070)), None].into_iter().zip(messages) {
            row(&mut out, &Decoded { time, node: NodeId::FIRST, message });
        }
        let mut reader = csv::ReaderBuilder::new().has_headers(false).from_reader(out.as_slice());
        let rows: Vec<_> = reader.records().map(|row| row.expect("as many cells in every row")).collect();
        let cell = |row: usize, name: &str| {
            rows[row].get(COLUMNS.iter().position(|c| *c == name).expect("a column")).expect("a cell").to_owned()
        };
        assert_eq!(rows[0].len(), COLUMNS.len());
        assert_eq!(cell(0, "time_s"), "1700000000.000070");
        assert_eq!(
            (cell(0, "preload_n"), cell(0, "sigma_n"), cell(0, "drag_force_n")),
            ("3000.5".into(), String::new(), "-1e-7".into())
        );
        assert_eq!((cell(0, "quality"), cell(0, "counter")), ("trusted".into(), "3".into()));
        assert_eq!(
            (cell(1, "time_s"), cell(1, "speed_m_s"), cell(1, "motion")),
            (String::new(), "0.1".into(), "forward".into())
        );
        assert_eq!((cell(1, "block_time_us"), cell(1, "frames_dropped")), ("70".into(), String::new()));
    }
}
