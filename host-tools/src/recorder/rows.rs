//! Rows of text from the records of a burst.

use std::io::Write;

use can_wire::burst::Record;
use model_core::calibration::{Calibration, ForceScale};
use model_core::sample::{BLOCK_HZ, RawBlock, SAMPLE_HZ};

/// The header of a recording that diagnose takes.
const RUN: &str = "time_s,position_m,drag_force_n,temperature_block_degc,segment\n";

/// The header of a raw one.
const RAW: &str =
    "# schema: guideblock.raw/1\n# sample_rate_hz: 1600\ntick,sample,force_code,temperature_code,encoder_count\n";

/// What is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// SI units, for `diagnose`.
    Run,
    /// Codes and counts, for `replay`.
    Raw,
}

impl Kind {
    pub(super) const fn header(self) -> &'static str {
        match self {
            Kind::Run => RUN,
            Kind::Raw => RAW,
        }
    }

    pub(super) fn first_line(self) -> &'static str {
        self.header().lines().next().unwrap_or_default()
    }
}

/// Makes rows, and remembers where the last ones ended.
#[derive(Debug)]
pub(super) struct Rows {
    kind: Kind,
    calibration: Calibration,
    segment: u64,
    /// tick and last count of the block before
    before: Option<(u32, u16)>,
    /// counts since the beginning of the segment, unbroken
    counts: i64,
    /// added to ticks so that time never goes back, blocks
    shift: u64,
    /// first tick that is not written, shift included
    next: u64,
    written: u64,
}

impl Rows {
    pub(super) fn new(kind: Kind, calibration: Calibration) -> Self {
        Rows { kind, calibration, segment: 0, before: None, counts: 0, shift: 0, next: 0, written: 0 }
    }

    pub(super) fn written(&self) -> u64 {
        self.written
    }

    /// Continues after the rows that a file already has.
    pub(super) fn carry_on(&mut self, text: &str) {
        // a row that was cut may hold half a number: only whole rows are read
        let whole = text.rsplit_once('\n').map_or("", |(whole, _)| whole);
        for row in whole.lines().rev().take(64) {
            let cells: Vec<&str> = row.split(',').collect();
            let last = match (self.kind, &cells[..]) {
                (Kind::Run, [time, _, _, _, segment]) => {
                    let blocks = time.parse::<f64>().ok().map(|t| (t * f64::from(BLOCK_HZ)) as u64 + 1);
                    blocks.zip(segment.parse().ok())
                }
                (Kind::Raw, [tick, _, _, _, _]) => tick.parse::<u64>().ok().map(|t| (t + 1, 0)),
                _ => None,
            };
            if let Some((next, segment)) = last {
                (self.next, self.segment) = (next, segment);
                return;
            }
        }
    }

    /// Appends the rows of a record.
    pub(super) fn of(&mut self, record: &Record, text: &mut Vec<u8>) {
        match record {
            Record::Header(_) | Record::Trailer(_) => self.before = None,
            Record::Block(block) => self.block(block, text),
        }
    }

    fn block(&mut self, block: &RawBlock, text: &mut Vec<u8>) {
        let follows = self.before.is_some_and(|(tick, _)| tick.wrapping_add(1) == block.tick);
        if !follows {
            self.segment += 1;
            self.counts = i64::from(block.position[0]);
        }
        let mut tick = u64::from(block.tick) + self.shift;
        if tick < self.next {
            // the block has restarted: continue the time after a pause of one second
            self.shift = self.next + u64::from(BLOCK_HZ) - u64::from(block.tick);
            tick = u64::from(block.tick) + self.shift;
        }
        let mut last = if follows { self.before.map_or(0, |(_, count)| count) } else { block.position[0] };
        let samples = block.force.iter().zip(&block.temperature).zip(&block.position).enumerate();
        for (n, ((force, temperature), count)) in samples {
            // counts wrap: a step is at most half of them
            self.counts += i64::from(count.wrapping_sub(last) as i16);
            last = *count;
            // memory takes all that is written to it
            let _ = match self.kind {
                Kind::Raw => writeln!(text, "{tick},{n},{force},{temperature},{count}"),
                Kind::Run => self.run_row(tick * 16 + n as u64, *force, *temperature, text),
            };
            self.written += 1;
        }
        self.before = Some((block.tick, last));
        self.next = tick + 1;
    }

    fn run_row(&self, sample: u64, force: u16, temperature: u16, text: &mut Vec<u8>) -> std::io::Result<()> {
        let Calibration { force: ForceScale { zero_code, newtons_per_code, .. }, thermistor, .. } = &self.calibration;
        let time_s = sample as f64 / f64::from(SAMPLE_HZ);
        let position_m = self.counts as f64 * f64::from(self.calibration.metres_per_count);
        let force_n = (f64::from(force) - f64::from(*zero_code)) * f64::from(*newtons_per_code);
        write!(text, "{time_s},{position_m:.9},{force_n:.6},")?;
        if let Some(degc) = thermistor.degc(f32::from(temperature)) {
            write!(text, "{degc:.3}")?;
        }
        writeln!(text, ",{}", self.segment)
    }
}
