//! SLCAN, the text that serial CAN adapters speak (Lawicel's protocol).
//!
//! ```text
//! t1818 0011223344556677 CR     a frame: identifier, length, data, perhaps a time stamp of four digits
//! S6 CR  O CR  C CR             500 kbit/s, open, close
//! ```
//!
//! Answers to commands are a CR, with `z` before it after a frame was sent, or a BEL for a refusal.

use std::io::{self, Read, Write};
use std::time::{Duration, Instant};

use can_wire::RawFrame;

use super::{Bus, BusError, Event, Heard, io_error};
use crate::candump::Micros;

/// Closes what may be open, and opens with 500 kbit/s.
const OPEN: &[u8] = b"\r\rC\rS6\rO\r";

/// A device with bytes both ways, and a wait for them.
pub trait Port: Read + Write {
    /// Whether bytes can be read within this time.
    ///
    /// # Errors
    /// Those of the system.
    fn wait(&mut self, time: Duration) -> io::Result<bool>;
}

/// An adapter on a port.
#[derive(Debug)]
pub struct Slcan<P> {
    name: String,
    port: P,
    /// bytes of a line that has not ended
    line: Vec<u8>,
    buffer: Vec<u8>,
    read: usize,
    since: Instant,
    /// false while refusals are legal: an adapter that was closed refuses to close
    opened: bool,
}

impl<P: Port> Slcan<P> {
    /// Opens the bus behind an adapter.
    ///
    /// # Errors
    /// [`BusError::Io`].
    pub fn new(name: &str, port: P) -> Result<Self, BusError> {
        let mut bus = Slcan {
            name: name.to_owned(),
            port,
            line: Vec::new(),
            buffer: Vec::new(),
            read: 0,
            since: Instant::now(),
            opened: false,
        };
        bus.write(OPEN)?;
        Ok(bus)
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), BusError> {
        self.port.write_all(bytes).and_then(|()| self.port.flush()).map_err(|e| io_error(&self.name, e))
    }

    /// The next frame in what has been read.
    fn buffered(&mut self) -> Result<Option<RawFrame>, BusError> {
        while let Some(byte) = self.buffer.get(self.read).copied() {
            self.read += 1;
            match byte {
                b'\r' | b'\n' => {
                    let frame = parse(&self.line);
                    self.line.clear();
                    if frame.is_some() {
                        self.opened = true;
                        return Ok(frame);
                    }
                }
                7 => {
                    self.line.clear();
                    if self.opened {
                        return Err(BusError::Refused(self.name.clone()));
                    }
                }
                byte if self.line.len() < 64 => self.line.push(byte),
                _ => {}
            }
        }
        (self.buffer, self.read) = (Vec::new(), 0);
        Ok(None)
    }
}

impl<P: Port> Bus for Slcan<P> {
    fn send(&mut self, frame: &RawFrame) -> Result<(), BusError> {
        self.write(&encode(frame))
    }

    fn receive(&mut self, wait: Duration) -> Result<Event, BusError> {
        let deadline = Instant::now() + wait;
        loop {
            if let Some(frame) = self.buffered()? {
                let micros = u64::try_from(self.since.elapsed().as_micros()).unwrap_or(u64::MAX);
                return Ok(Event::Frame(Heard { time: Some(Micros(micros)), frame }));
            }
            let left = deadline.saturating_duration_since(Instant::now());
            if !self.port.wait(left).map_err(|e| io_error(&self.name, e))? {
                return Ok(Event::Silence);
            }
            let mut bytes = [0; 512];
            match self.port.read(&mut bytes) {
                Ok(0) => return Ok(Event::End),
                Ok(n) => self.buffer.extend(&bytes[..n]),
                Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
                // the other side of a pseudo terminal is gone
                Err(e) if e.raw_os_error() == Some(5) => return Ok(Event::End),
                Err(e) => return Err(io_error(&self.name, e)),
            }
        }
    }

    fn now(&self) -> Duration {
        self.since.elapsed()
    }
}

/// A frame as the adapter takes it.
pub fn encode(frame: &RawFrame) -> Vec<u8> {
    let mut text = format!("t{:03X}8", frame.id & 0x7FF);
    text.extend(frame.data.iter().map(|byte| format!("{byte:02X}")));
    text.push('\r');
    text.into_bytes()
}

/// The frame in a line without its end; `None` for answers, and for frames that no block sends.
pub fn parse(line: &[u8]) -> Option<RawFrame> {
    let text = std::str::from_utf8(line).ok()?;
    let rest = text.strip_prefix('t')?;
    let (id, rest) = (rest.get(..3)?, rest.get(3..)?);
    let (length, rest) = (rest.get(..1)?, rest.get(1..)?);
    // a time stamp may follow
    if length != "8" || !matches!(rest.len(), 16 | 20) || !text.bytes().skip(1).all(|b| b.is_ascii_hexdigit()) {
        return None;
    }
    let id = u16::from_str_radix(id, 16).ok().filter(|id| *id <= 0x7FF)?;
    let mut data = [0; 8];
    for (n, byte) in data.iter_mut().enumerate() {
        *byte = u8::from_str_radix(rest.get(2 * n..2 * n + 2)?, 16).ok()?;
    }
    Some(RawFrame { id, data })
}

/// Opens a serial port.
///
/// # Errors
/// [`BusError`].
#[cfg(unix)]
pub(super) fn open(path: &str) -> Result<Box<dyn Bus>, BusError> {
    Ok(Box::new(Slcan::new(path, serial::Serial::open(path).map_err(|e| io_error(path, e))?)?))
}

/// There are no serial ports here.
///
/// # Errors
/// [`BusError::NotHere`].
#[cfg(not(unix))]
pub(super) fn open(path: &str) -> Result<Box<dyn Bus>, BusError> {
    Err(BusError::NotHere(path.to_owned()))
}

#[cfg(unix)]
mod serial {
    use std::fs::{File, OpenOptions};
    use std::io::{self, Read, Write};
    use std::time::Duration;

    use rustix::event::{PollFd, PollFlags, Timespec, poll};
    use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};

    use super::Port;

    /// A serial port in raw mode.
    #[derive(Debug)]
    pub(super) struct Serial(File);

    impl Serial {
        pub(super) fn open(path: &str) -> io::Result<Self> {
            use std::os::unix::fs::OpenOptionsExt;
            // a port without carrier must not block the opening, nor become our terminal
            let flags = rustix::fs::OFlags::NONBLOCK | rustix::fs::OFlags::NOCTTY;
            let flags = i32::try_from(flags.bits()).unwrap_or_default();
            let file = OpenOptions::new().read(true).write(true).custom_flags(flags).open(path)?;
            let mut attributes = tcgetattr(&file).map_err(|e| {
                if e == rustix::io::Errno::NOTTY { io::Error::other("is no serial port") } else { e.into() }
            })?;
            attributes.make_raw();
            // USB adapters accept any speed; real ports get the usual one
            attributes.set_speed(115_200)?;
            tcsetattr(&file, OptionalActions::Now, &attributes)?;
            Ok(Serial(file))
        }
    }

    impl Port for Serial {
        fn wait(&mut self, time: Duration) -> io::Result<bool> {
            let mut fds = [PollFd::new(&self.0, PollFlags::IN)];
            let timeout = Timespec::try_from(time).ok();
            match poll(&mut fds, timeout.as_ref()) {
                Ok(ready) => Ok(ready > 0),
                Err(rustix::io::Errno::INTR) => Ok(false),
                Err(e) => Err(e.into()),
            }
        }
    }

    impl Read for Serial {
        fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
            self.0.read(into)
        }
    }

    impl Write for Serial {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            loop {
                match self.0.write(bytes) {
                    Err(e) if e.kind() == io::ErrorKind::WouldBlock => {
                        let mut fds = [PollFd::new(&self.0, PollFlags::OUT)];
                        poll(&mut fds, None)?;
                    }
                    other => return other,
                }
            }
        }

        fn flush(&mut self) -> io::Result<()> {
            self.0.flush()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::VecDeque;

    const FRAME: RawFrame = RawFrame { id: 0x185, data: [0, 0x11, 0x22, 0x33, 0x44, 0x55, 0x66, 0xFF] };

    /// An adapter that has said all it will ever say, a few bytes at a time.
    struct Script(VecDeque<u8>, Vec<u8>);
    impl Read for Script {
        fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
            let n = into.len().min(3);
            self.0.read(&mut into[..n])
        }
    }
    impl Write for Script {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.1.write(bytes)
        }
        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }
    impl Port for Script {
        fn wait(&mut self, _: Duration) -> io::Result<bool> {
            Ok(!self.0.is_empty())
        }
    }

    #[test]
    fn frames_survive_the_way_there_and_back() {
        assert_eq!(encode(&FRAME), b"t185800112233445566FF\r");
        assert_eq!(parse(b"t185800112233445566FF"), Some(FRAME));
        assert_eq!(parse(b"t185800112233445566ff1A2B"), Some(FRAME));
        for line in [
            "",
            "z",
            "t1852AABB",
            "T0000018580011223344556677",
            "r1858",
            "t98580011223344556677",
            "t185+0011223344556677",
        ] {
            assert_eq!(parse(line.as_bytes()), None, "{line}");
        }
    }

    #[test]
    fn an_adapter_is_opened_and_listened_to() {
        // closing is refused, as it is closed; the rest is accepted; half a frame is left from before
        let said = b"\x07\r\r\r566FF\rt185800112233445566FF\rz\rt1234\rt18580011223344556";
        let port = Script(said.iter().copied().collect(), Vec::new());
        let mut bus = Slcan::new("adapter", port).expect("opens");
        let Ok(Event::Frame(heard)) = bus.receive(Duration::ZERO) else { panic!("no frame") };
        assert_eq!(heard.frame, FRAME);
        assert!(matches!(bus.receive(Duration::ZERO), Ok(Event::Silence)));
        bus.send(&FRAME).expect("takes it");
        assert_eq!(bus.port.1, b"\r\rC\rS6\rO\rt185800112233445566FF\r");
        // later on, a BEL is a refusal
        bus.port.0.extend(b"6FF\r\x07");
        assert!(matches!(bus.receive(Duration::ZERO), Ok(Event::Frame(_))));
        assert!(matches!(bus.receive(Duration::ZERO), Err(BusError::Refused(_))));
    }
}
