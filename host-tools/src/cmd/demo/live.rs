//! The bus as it comes: a line every few seconds, and one at every change of what the block says.

use std::io::{self, IsTerminal, Write};
use std::ops::ControlFlow;

use can_wire::{BoardKind, Message};
use host_tools::candump::{Frame, Micros};
use host_tools::decode::{Decoder, Joiner, Reading, Tally};
use host_tools::emulated::{Listener, seconds};
use host_tools::judgement::Point;
use host_tools::report::table;
use host_tools::rig::track::Track;
use model_core::sample::Reason;
use virtual_board::SentFrame;

use super::Failure;

/// Time between printed readings while nothing changes, s.
const EVERY_S: f64 = 5.0;

/// What was seen of a run.
pub(super) struct Seen {
    /// The readings, each with the truth.
    pub(super) points: Vec<Point>,
    /// The board that the image says it runs on.
    pub(super) board: Option<BoardKind>,
    /// What became of the frames.
    pub(super) tally: Tally,
}

/// Prints while the board runs, and remembers.
pub(super) struct Live {
    track: Track,
    decoder: Decoder,
    joiner: Joiner,
    points: Vec<Point>,
    board: Option<BoardKind>,
    pause: Pause,
    next_s: f64,
    progress: bool,
    output: io::Result<()>,
}

/// Largest number of changes of reason in one silence that are listed in order; more are listed as a set.
const TOLD_IN_ORDER: usize = 6;

/// Since when the block has given no preload, and for which reasons.
#[derive(Default)]
struct Pause {
    since_s: Option<f64>,
    reasons: Vec<Reason>,
}

impl Pause {
    fn describe(&self, since_s: f64, until_s: f64) -> String {
        let mut names: Vec<_> = self.reasons.iter().map(|reason| reason.name()).collect();
        let mut order = String::new();
        if names.len() > TOLD_IN_ORDER {
            order = format!(", in {} turns", names.len());
            names.sort_unstable();
            names.dedup();
        }
        format!("{since_s:>14.3}        no preload for {:.1} s: {}{order}", until_s - since_s, names.join(", "))
    }
}

impl Live {
    /// Prints the header; `track` knows the truth.
    pub(super) fn new(track: Track) -> Self {
        Live {
            track,
            decoder: Decoder::new(None),
            joiner: Joiner::default(),
            points: Vec::new(),
            board: None,
            pause: Pause::default(),
            next_s: 0.0,
            progress: io::stderr().is_terminal(),
            // readings are printed while there is a preload: the truth takes the place of the reason against it
            output: writeln!(io::stdout(), "{:.*}  truth/N", table::WIDTH_WITHOUT_REASON, table::HEADER),
        }
    }

    /// What was seen.
    ///
    /// # Errors
    /// Those of standard output during the run.
    pub(super) fn finish(self) -> Result<Seen, Failure> {
        if self.progress {
            let _ = write!(io::stderr(), "\r{:20}\r", "");
        }
        self.output?;
        if let (Some(since_s), Some(last)) = (self.pause.since_s, self.points.last()) {
            writeln!(io::stdout(), "{}", self.pause.describe(since_s, last.time_s))?;
        }
        Ok(Seen { points: self.points, board: self.board, tally: self.decoder.tally().clone() })
    }

    fn reading(&mut self, time_s: f64, reading: &Reading) -> io::Result<()> {
        let truth_n = self.track.at(time_s).preload_n;
        self.points.push(Point::new(time_s, reading, truth_n));
        let spoke = match reading.estimate.quality {
            Some(reason) => {
                self.pause.since_s.get_or_insert(time_s);
                if self.pause.reasons.last() != Some(&reason) {
                    self.pause.reasons.push(reason);
                }
                return Ok(());
            }
            None => std::mem::take(&mut self.pause),
        };
        if let Some(since_s) = spoke.since_s {
            writeln!(io::stdout(), "{}", spoke.describe(since_s, time_s))?;
        }
        if spoke.since_s.is_some() || time_s >= self.next_s {
            self.next_s = time_s + EVERY_S;
            let line = table::reading(reading);
            let truth = truth_n.map_or_else(|| "--".to_owned(), |n| format!("{n:.0}"));
            writeln!(io::stdout(), "{line:<width$}  {truth:>7}", width = table::WIDTH_WITHOUT_REASON)?;
        }
        Ok(())
    }

    fn progress(&self, time_s: f64) {
        if self.progress {
            let _ = write!(io::stderr(), "\r{time_s:.0} of {:.0} s\r", self.track.duration_s());
        }
    }
}

impl Listener for Live {
    fn frame(&mut self, sent: &SentFrame) -> ControlFlow<()> {
        let time_s = seconds(sent.at);
        let frame = Frame::new(Some(Micros(sent.at / 1000)), "can0", sent.id, sent.data());
        let Some(decoded) = self.decoder.frame(&frame) else { return ControlFlow::Continue(()) };
        if let Message::Heartbeat(beat) = decoded.message {
            self.board = Some(beat.board);
            self.progress(time_s);
        }
        if let Some(reading) = self.joiner.take(&decoded) {
            self.output = self.reading(time_s, &reading);
        }
        match self.output {
            Ok(()) => ControlFlow::Continue(()),
            Err(_) => ControlFlow::Break(()),
        }
    }
}
