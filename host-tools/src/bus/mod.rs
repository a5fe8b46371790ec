//! Buses to blocks: a log, a serial adapter, a CAN interface, a block in memory.
//!
//! ```text
//! FILE, -              candump text, only to listen to
//! slcan:/dev/ttyACM0   serial adapter that speaks SLCAN (Lawicel), set to 500 kbit/s
//! socketcan:can0       CAN interface of Linux, through candump and cansend of can-utils
//! desk                 a block in memory at rest on a desk: to try commands with
//! ```

mod can_utils;
pub mod desk;
#[cfg(feature = "emulator")]
pub mod emulated;
mod log;
pub mod slcan;

use std::io;
use std::str::FromStr;
use std::time::Duration;

use can_wire::RawFrame;

use crate::candump::Micros;
use crate::files;

/// A frame as received.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Heard {
    /// Its time, if the source gives one.
    pub time: Option<Micros>,
    /// The frame.
    pub frame: RawFrame,
}

/// Why a bus cannot be used any more.
#[derive(Debug, thiserror::Error)]
pub enum BusError {
    /// It cannot be opened, read or written.
    #[error("{name}: {}{}", files::why(source), advice(name, source))]
    Io {
        /// What the user called it.
        name: String,
        /// What the system says.
        source: io::Error,
    },
    /// A log cannot be spoken to.
    #[error("{0} can only be listened to; give a live bus: slcan:PORT, socketcan:INTERFACE or desk")]
    ListenOnly(String),
    /// A helper program is not there.
    #[error("{program} cannot be started ({source}); install can-utils, or use slcan:PORT")]
    NoProgram {
        /// Its name.
        program: &'static str,
        /// What the system says.
        source: io::Error,
    },
    /// The adapter says no.
    #[error("{0}: the adapter refused a command; is it an SLCAN adapter, and is the bus connected?")]
    Refused(String),
    /// This kind of bus does not exist on this system.
    #[error("{0}: serial ports are used on Unix systems only")]
    NotHere(String),
}

/// What arrived within a waiting time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// A frame with an 11-bit identifier and eight bytes.
    Frame(Heard),
    /// Nothing.
    Silence,
    /// Nothing more will arrive: a log has been read to its end, or the other side is gone.
    End,
}

/// A bus as a desk sees it. Frames that no block sends or takes are left out.
pub trait Bus {
    /// Sends a frame.
    ///
    /// # Errors
    /// [`BusError`].
    fn send(&mut self, frame: &RawFrame) -> Result<(), BusError>;

    /// Waits at most `wait` for the next frame.
    ///
    /// # Errors
    /// [`BusError`].
    fn receive(&mut self, wait: Duration) -> Result<Event, BusError>;

    /// Whether frames can be sent on it.
    fn can_send(&self) -> bool {
        true
    }

    /// Time on this bus since it was opened: wall-clock time, except for buses in memory.
    fn now(&self) -> Duration;
}

/// A bus as named on the command line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Source {
    /// candump text in a file; `-` is standard input.
    Candump(String),
    /// A serial adapter.
    Slcan(String),
    /// A CAN interface of Linux.
    SocketCan(String),
    /// A block in memory.
    Desk,
}

impl FromStr for Source {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.split_once(':') {
            _ if text.is_empty() => {
                Err("name a bus: a candump FILE, -, slcan:PORT, socketcan:INTERFACE or desk".into())
            }
            Some(("slcan", port)) if !port.is_empty() => Ok(Source::Slcan(port.to_owned())),
            Some(("socketcan", interface)) if is_interface(interface) => Ok(Source::SocketCan(interface.to_owned())),
            Some(("socketcan", other)) => Err(format!("{other:?} is no name of a CAN interface such as can0")),
            Some(("candump", file)) if !file.is_empty() => Ok(Source::Candump(file.to_owned())),
            _ if text == "desk" => Ok(Source::Desk),
            _ => Ok(Source::Candump(text.to_owned())),
        }
    }
}

/// Whether a text is the name of an interface: letters and digits, so that no program takes it for an option.
fn is_interface(text: &str) -> bool {
    !text.is_empty() && text.len() < 16 && text.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_')
}

/// Opens a bus.
///
/// # Errors
/// [`BusError`].
pub fn open(source: &Source) -> Result<Box<dyn Bus>, BusError> {
    Ok(match source {
        Source::Candump(file) => Box::new(log::Log::open(file)?),
        Source::Slcan(port) => slcan::open(port)?,
        Source::SocketCan(interface) => Box::new(can_utils::Interface::open(interface)?),
        Source::Desk => Box::new(desk::Desk::new(desk::Setup::default())),
    })
}

/// What to do about a bus that cannot be opened.
fn advice(name: &str, error: &io::Error) -> &'static str {
    match error.kind() {
        io::ErrorKind::NotFound if !name.starts_with("/dev/") => {
            "; a bus is candump text in a FILE or -, slcan:PORT, socketcan:INTERFACE, or desk"
        }
        io::ErrorKind::PermissionDenied if name.starts_with("/dev/") => {
            "; serial ports belong to the group dialout: `sudo usermod -aG dialout $USER`, then log in again"
        }
        _ => "",
    }
}

fn io_error(name: &str, source: io::Error) -> BusError {
    BusError::Io { name: name.to_owned(), source }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sources_are_named() {
        for (text, source) in [
            ("-", Source::Candump("-".into())),
            ("logs/a.log", Source::Candump("logs/a.log".into())),
            ("candump:slcan", Source::Candump("slcan".into())),
            ("slcan:/dev/ttyACM0", Source::Slcan("/dev/ttyACM0".into())),
            ("socketcan:can0", Source::SocketCan("can0".into())),
            ("desk", Source::Desk),
        ] {
            assert_eq!(text.parse(), Ok(source), "{text}");
        }
        for text in ["", "socketcan:", "socketcan:-h", "socketcan:can0;ls"] {
            assert!(text.parse::<Source>().is_err(), "{text}");
        }
    }
}
