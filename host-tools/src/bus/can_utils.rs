//! A CAN interface of Linux through the programs `candump` and `cansend` of can-utils.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use can_wire::RawFrame;

use super::{Bus, BusError, Event, Heard, io_error, log};

/// `candump -L` receives, `cansend` sends.
pub(super) struct Interface {
    name: String,
    listener: Child,
    heard: Receiver<Heard>,
    since: Instant,
}

impl Interface {
    pub(super) fn open(name: &str) -> Result<Self, BusError> {
        let mut listener = Command::new("candump")
            .args(["-L", name])
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .spawn()
            .map_err(|source| BusError::NoProgram { program: "candump", source })?;
        let (sender, heard) = channel();
        if let Some(output) = listener.stdout.take() {
            std::thread::spawn(move || {
                for line in BufReader::new(output).split(b'\n').map_while(Result::ok) {
                    if let Some(heard) = log::heard(&line)
                        && sender.send(heard).is_err()
                    {
                        break;
                    }
                }
            });
        }
        Ok(Interface { name: name.to_owned(), listener, heard, since: Instant::now() })
    }
}

impl Bus for Interface {
    fn send(&mut self, frame: &RawFrame) -> Result<(), BusError> {
        let data: String = frame.data.iter().map(|byte| format!("{byte:02X}")).collect();
        let status = Command::new("cansend")
            .args([&self.name, &format!("{:03X}#{data}", frame.id)])
            .status()
            .map_err(|source| BusError::NoProgram { program: "cansend", source })?;
        if status.success() {
            return Ok(());
        }
        Err(io_error(&self.name, std::io::Error::other("cansend could not send; is the interface up?")))
    }

    fn receive(&mut self, wait: Duration) -> Result<Event, BusError> {
        match self.heard.recv_timeout(wait) {
            Ok(heard) => Ok(Event::Frame(heard)),
            Err(RecvTimeoutError::Timeout) => Ok(Event::Silence),
            Err(RecvTimeoutError::Disconnected) => Ok(Event::End),
        }
    }

    fn now(&self) -> Duration {
        self.since.elapsed()
    }
}

impl Drop for Interface {
    fn drop(&mut self) {
        let _ = self.listener.kill();
        let _ = self.listener.wait();
    }
}
