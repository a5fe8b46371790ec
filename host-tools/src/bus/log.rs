//! candump text as a bus that can only be listened to.

use std::fs::File;
use std::io::{BufRead, BufReader, stdin};
use std::time::{Duration, Instant};

use can_wire::RawFrame;

use super::{Bus, BusError, Event, Heard, io_error};
use crate::candump::{self, Line};

/// A log, or what a pipe delivers.
pub(super) struct Log {
    name: String,
    reader: Box<dyn BufRead>,
    line: Vec<u8>,
    since: Instant,
}

impl Log {
    pub(super) fn open(file: &str) -> Result<Self, BusError> {
        let (name, reader): (_, Box<dyn BufRead>) = match file {
            "-" => ("standard input", Box::new(stdin().lock())),
            file => (file, Box::new(BufReader::new(File::open(file).map_err(|e| io_error(file, e))?))),
        };
        Ok(Log { name: name.to_owned(), reader, line: Vec::new(), since: Instant::now() })
    }
}

impl Bus for Log {
    fn send(&mut self, _: &RawFrame) -> Result<(), BusError> {
        Err(BusError::ListenOnly(self.name.clone()))
    }

    /// Waits for the next line, however long that takes.
    fn receive(&mut self, _: Duration) -> Result<Event, BusError> {
        loop {
            self.line.clear();
            if self.reader.read_until(b'\n', &mut self.line).map_err(|e| io_error(&self.name, e))? == 0 {
                return Ok(Event::End);
            }
            if let Some(heard) = heard(&self.line) {
                return Ok(Event::Frame(heard));
            }
        }
    }

    fn can_send(&self) -> bool {
        false
    }

    fn now(&self) -> Duration {
        self.since.elapsed()
    }
}

/// The frame in a line, if it is one that a block sends or takes.
pub(super) fn heard(line: &[u8]) -> Option<Heard> {
    let text = std::str::from_utf8(line).ok()?;
    let Ok(Line::Frame(frame)) = candump::parse(text) else { return None };
    let data = frame.data().try_into().ok()?;
    Some(Heard { time: frame.time, frame: RawFrame { id: frame.id, data } })
}
