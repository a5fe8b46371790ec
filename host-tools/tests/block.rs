//! `guideblock block`, `record` and `eds`: a block in memory, one behind a serial adapter, and logs of a bus.
#![allow(clippy::expect_used, reason = "a test fails by panicking")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::Duration;

use can_wire::NodeId;
use can_wire::burst::Order;
use host_tools::block::Client;
use host_tools::bus::desk::{Desk, Setup};
use host_tools::bus::{Bus, BusError, Event};
use host_tools::candump::Frame;
use host_tools::recording;

/// A folder of this test's own.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("guideblock-block-{}-{name}", std::process::id()));
        let _ = fs::remove_dir_all(&path);
        fs::create_dir_all(&path).expect("a folder");
        Folder(path)
    }

    fn file(&self, name: &str) -> String {
        self.0.join(name).to_str().expect("text").to_owned()
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn guideblock(arguments: &[&str]) -> (Option<i32>, String, String) {
    let output: Output = Command::new(env!("CARGO_BIN_EXE_guideblock"))
        .args(arguments)
        .stdin(Stdio::null())
        .output()
        .expect("the binary of this package");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("text");
    (output.status.code(), text(output.stdout), text(output.stderr))
}

/// A bus on which everything said is written down, as candump would.
struct Logged {
    desk: Desk,
    log: String,
}

impl Logged {
    fn note(&mut self, frame: &can_wire::RawFrame) {
        let micros = host_tools::candump::Micros(self.desk.now().as_micros() as u64);
        self.log += &format!("{}\n", Frame::new(Some(micros), "can0", frame.id, &frame.data));
    }
}

impl Bus for Logged {
    fn send(&mut self, frame: &can_wire::RawFrame) -> Result<(), BusError> {
        self.note(frame);
        self.desk.send(frame)
    }
    fn receive(&mut self, wait: Duration) -> Result<Event, BusError> {
        let event = self.desk.receive(wait)?;
        if let Event::Frame(heard) = &event {
            self.note(&heard.frame);
        }
        Ok(event)
    }
    fn now(&self) -> Duration {
        self.desk.now()
    }
}

/// The log of a burst that somebody else ordered, and of one more.
fn log_of_two_bursts(setup: Setup, blocks: u16) -> String {
    let mut bus = Logged { desk: Desk::new(setup), log: "# made for a test\n".to_owned() };
    for past in [50, 0] {
        let order = Order { blocks, past, asked: true };
        Client::new(&mut bus, NodeId::FIRST).burst(order, &mut |_| {}).expect("comes");
    }
    bus.log
}

#[test]
fn a_block_in_memory_is_asked_and_set() {
    let (status, stdout, stderr) = guideblock(&["block", "identify", "--bus", "desk"]);
    assert_eq!((status, stderr.as_str()), (Some(0), ""));
    assert!(stdout.starts_with("node,1\nboard,unknown\nserial,0AF6EDE5\n"), "{stdout}");
    let (_, json, _) = guideblock(&["block", "identify", "--json", "--bus", "desk"]);
    assert!(json.contains(r#""version":[0,1,0],"starts":1,"reset_cause":"power-on""#), "{json}");
    let (status, stdout, _) = guideblock(&["block", "get", "burst-load", "--bus", "desk"]);
    assert_eq!((status, stdout.as_str()), (Some(0), "20\n"));
    let (status, stdout, _) = guideblock(&["block", "tare", "--bus", "desk"]);
    assert_eq!((status, stdout.as_str()), (Some(0), "zero_shift_codes,12\n"));
}

#[test]
fn what_is_wrong_has_its_exit_status_and_says_what_to_do() {
    let folder = Folder::new("wrong");
    let long = folder.file("long.bin");
    fs::write(&long, [0; 1025]).expect("writable");
    for (arguments, status, says) in [
        (&["identify", "--bus", "desk", "--node", "7"][..], 3, "node 7 does not answer"),
        (&["identify"], 2, "name the bus"),
        (&["identify", "--bus", "slcan:/dev/guideblock-nobody"], 2, "/dev/guideblock-nobody: there is no such file"),
        (&["identify", "--bus", "tests/cli/bus.log"], 2, "can only be listened to"),
        (
            &["set", "warn-below", "2000", "--key", "0x123", "--bus", "desk"],
            1,
            "wrong key: the block has another one; give its own with --key",
        ),
        (&["set", "warn-below", "-5", "--bus", "desk"], 2, "warn-below: \"-5\" is not a whole number from 0 to 65535"),
        (
            &["identify", "--bus", "foo"],
            2,
            "foo: there is no such file; a bus is candump text in a FILE or -, slcan:PORT, ",
        ),
        (&["set", "warn-below", "70000", "--bus", "desk"], 2, "from 0 to 65535"),
        (&["set", "publishing-period", "15", "--bus", "desk"], 1, "Publishing period (2003.0)"),
        (&["set", "save", "1", "--bus", "desk"], 2, "takes no value"),
        (&["set", "preload", "1", "--bus", "desk"], 2, "there is no \"preload\"; it is one of: "),
        (&["load-image", &long, "--bus", "desk"], 2, "an image has 1 to 1024 bytes, this has 1025"),
    ] {
        let all: Vec<&str> = [&["block"], arguments].concat();
        let (got, _, stderr) = guideblock(&all);
        assert_eq!(got, Some(status), "{arguments:?}: {stderr}");
        assert!(stderr.contains(says), "{arguments:?}: {stderr}");
    }
}

#[test]
fn bursts_of_a_log_become_a_recording_that_diagnose_takes() {
    let folder = Folder::new("diagnose");
    let (log, run) = (folder.file("bus.log"), folder.file("run.csv"));
    let setup = Setup { moves: true, ..Setup::default() };
    fs::write(&log, log_of_two_bursts(setup, 600)).expect("writable");
    let (status, _, stderr) = guideblock(&["record", "--from", &log, "--out", &run]);
    assert_eq!(status, Some(0), "{stderr}");
    assert!(stderr.contains("19200 rows of 2 bursts, 0 of them not whole: 0 segments lost"), "{stderr}");
    assert!(stderr.contains("no --parameters"), "{stderr}");
    let (read, losses) = recording::open(Path::new(&run), &[], &[], &recording::silent).expect("a recording");
    assert_eq!((losses.problems.len(), read.parts.len(), read.time_s.len()), (0, 2, 19_200));
    // 50 mm/s against 20 N: force in the sense of the motion, as the contract has it
    let position = read.position_m.as_ref().expect("measured");
    let forward = position[160] > position[0];
    assert_eq!(read.drag_force_n[80] > 10.0, forward, "{} N", read.drag_force_n[80]);
    let simulation = folder.file("sim.toml");
    let text =
        "schema = \"guideblock.simulation/1\"\n[guide]\nlaw = \"coulomb-viscous\"\n[axis]\nmoved_mass_kg = 0.0\n";
    fs::write(&simulation, text).expect("writable");
    let json = folder.file("out.json");
    let (status, _, stderr) = guideblock(&["diagnose", &run, "--simulation", &simulation, "--json", &json]);
    assert!(matches!(status, Some(0 | 1)), "{status:?} {stderr}");
    let json = fs::read_to_string(json).expect("written");
    assert!(json.contains("\"guideblock.diagnosis/1\"") && json.contains("\"samples\": 19200"), "{json}");
}

#[test]
fn a_log_with_holes_gives_what_is_there_and_says_what_is_not() {
    let folder = Folder::new("holes");
    let (log, run) = (folder.file("bus.log"), folder.file("run.csv"));
    let text = log_of_two_bursts(Setup::default(), 200);
    // a logger that misses every 97th frame of the block
    let kept: Vec<&str> = text
        .lines()
        .enumerate()
        .filter(|(n, line)| !(line.contains(" 481#") && n % 97 == 0))
        .map(|(_, line)| line)
        .collect();
    fs::write(&log, kept.join("\n")).expect("writable");
    let (status, _, stderr) = guideblock(&["record", "--from", &log, "--out", &run, "--as", "raw"]);
    assert_eq!(status, Some(1), "{stderr}");
    assert!(stderr.contains("2 bursts, 2 of them not whole"), "{stderr}");
    let raw = recording::raw::read("run.csv", &fs::read(&run).expect("written")[..]).expect("a raw recording");
    assert!((370..400).contains(&raw.blocks.len()), "{}", raw.blocks.len());
    // what came is what was sampled: at rest, forces of 2058 to 2062
    assert!(raw.blocks.iter().all(|b| b.force.iter().all(|f| (2058..=2062).contains(f)) && b.position == [0; 16]));
    // no burst at all is unusable
    fs::write(&log, "(1.0) can0 181#0011223344556677\n").expect("writable");
    let (status, _, stderr) = guideblock(&["record", "--from", &log, "--out", &folder.file("none.csv")]);
    assert_eq!(status, Some(3), "{stderr}");
    assert!(stderr.contains("no burst of node 1; order one with"), "{stderr}");
}

#[test]
fn a_recording_is_appended_to_and_nothing_else_is_touched() {
    let folder = Folder::new("append");
    let run = folder.file("run.csv");
    let burst = ["block", "burst", "--blocks", "30", "--out", &run, "--bus", "desk"];
    assert_eq!(guideblock(&burst).0, Some(0));
    let first = fs::read(&run).expect("written");
    fs::write(&run, &first[..first.len() - 7]).expect("writable");
    assert_eq!(guideblock(&burst).0, Some(0));
    let both = fs::read(&run).expect("written");
    assert_eq!(both[..first.len() - 7], first[..first.len() - 7]);
    let (read, losses) = recording::open(Path::new(&run), &[], &[], &recording::silent).expect("a recording");
    assert_eq!((read.parts.len(), losses.rows, losses.lost), (2, 960, 1), "{losses:?}");
    fs::write(&run, "something else\n").expect("writable");
    let (status, _, stderr) = guideblock(&burst);
    assert_eq!(status, Some(3), "{stderr}");
    assert!(stderr.contains("name another file"), "{stderr}");
    assert_eq!(fs::read(&run).expect("there"), b"something else\n");
}

#[test]
fn what_arrived_is_on_disk_when_the_recorder_is_killed() {
    let folder = Folder::new("killed");
    let run = folder.file("run.csv");
    let text = log_of_two_bursts(Setup { moves: true, ..Setup::default() }, 300);
    let lines: Vec<&str> = text.lines().collect();
    let mut child = Command::new(env!("CARGO_BIN_EXE_guideblock"))
        .args(["record", "--from", "-", "--out", &run])
        .stdin(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .expect("the binary of this package");
    let mut pipe = child.stdin.take().expect("piped");
    let fed = lines[..lines.len() / 3].join("\n") + "\n";
    std::io::Write::write_all(&mut pipe, fed.as_bytes()).expect("it reads");
    // every block of which all segments have been fed
    let expected = fed.matches(" 481#").count() / 6 * 16;
    let rows = || fs::read_to_string(&run).map_or(0, |text| text.lines().count());
    for _ in 0..500 {
        if rows() > expected {
            break;
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    child.kill().expect("it runs");
    child.wait().expect("it ends");
    let (read, losses) = recording::open(Path::new(&run), &[], &[], &recording::silent).expect("a recording");
    assert!(read.time_s.len() >= expected, "{} rows of {expected}", read.time_s.len());
    assert_eq!(losses.problems.len(), 0, "{losses:?}");
    drop(pipe);
}

#[test]
#[cfg(unix)]
fn a_can_interface_is_reached_through_can_utils() {
    use std::os::unix::fs::PermissionsExt;
    let folder = Folder::new("utils");
    let (log, run) = (folder.file("bus.log"), folder.file("run.csv"));
    fs::write(&log, log_of_two_bursts(Setup::default(), 100)).expect("writable");
    let program = |name: &str, script: String| {
        let path = folder.file(name);
        fs::write(&path, format!("#!/bin/sh\n{script}\n")).expect("writable");
        fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).expect("ours");
    };
    program("candump", format!("test \"$*\" = \"-L can7\" && cat {log}"));
    program("cansend", format!("echo \"$*\" >> {}", folder.file("sent")));
    let record = |path: String| {
        let output = Command::new(env!("CARGO_BIN_EXE_guideblock"))
            .args(["record", "--from", "socketcan:can7", "--out", &run])
            .env("PATH", path)
            .stdin(Stdio::null())
            .output()
            .expect("the binary of this package");
        (output.status.code(), String::from_utf8(output.stderr).expect("text"))
    };
    let path = format!("{}:{}", folder.0.display(), std::env::var("PATH").expect("a path"));
    let (status, stderr) = record(path);
    assert_eq!(status, Some(0), "{stderr}");
    assert!(stderr.contains("3200 rows of 2 bursts, 0 of them not whole"), "{stderr}");
    // on a live bus it asks for what it lacks
    let sent = fs::read_to_string(folder.file("sent")).expect("it spoke");
    assert!(sent.lines().all(|line| line.starts_with("can7 501#")), "{sent}");
    let (status, stderr) = record("/nowhere".to_owned());
    assert_eq!(status, Some(2), "{stderr}");
    assert!(stderr.contains("candump cannot be started") && stderr.contains("install can-utils"), "{stderr}");
}

#[test]
fn eds_prints_what_is_in_the_repository() {
    let (status, stdout, _) = guideblock(&["eds"]);
    assert_eq!(status, Some(0));
    assert!(stdout == include_str!("../../can-wire/guideblock.eds"));
}

/// A serial adapter with a block behind it, on a pseudo terminal.
#[cfg(unix)]
mod adapter {
    use super::*;
    use host_tools::bus::slcan::{encode, parse};
    use rustix::event::{PollFd, PollFlags, Timespec, poll};
    use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
    use std::sync::atomic::{AtomicBool, Ordering};

    /// Answers commands and passes frames until `stop`.
    fn serve(master: &std::os::fd::OwnedFd, mut desk: Desk, stop: &AtomicBool) {
        let (mut line, mut open) = (Vec::new(), false);
        while !stop.load(Ordering::Relaxed) {
            let mut fds = [PollFd::new(master, PollFlags::IN)];
            let millisecond = Timespec { tv_sec: 0, tv_nsec: 1_000_000 };
            let mut bytes = [0; 256];
            let ready = poll(&mut fds, Some(&millisecond)).unwrap_or(0) > 0;
            // an error means that nobody has the other end open
            let count = if ready { rustix::io::read(master, &mut bytes).unwrap_or(0) } else { 0 };
            for byte in &bytes[..count] {
                if *byte != b'\r' {
                    line.push(*byte);
                    continue;
                }
                let answer: &[u8] = match (&line[..], parse(&line)) {
                    (_, Some(frame)) if open => {
                        desk.send(&frame).expect("memory");
                        b"z\r"
                    }
                    (b"O", _) if !open => {
                        open = true;
                        b"\r"
                    }
                    (b"C", _) if open => {
                        open = false;
                        b"\r"
                    }
                    (b"S6" | b"", _) => b"\r",
                    _ => b"\x07",
                };
                rustix::io::write(master, answer).expect("there is room");
                line.clear();
            }
            while open && let Ok(Event::Frame(heard)) = desk.receive(Duration::from_millis(1)) {
                rustix::io::write(master, &encode(&heard.frame)).expect("there is room");
            }
        }
    }

    #[test]
    fn a_block_behind_a_serial_adapter_is_asked_and_gives_its_burst() {
        let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).expect("a pseudo terminal");
        grantpt(&master).expect("granted");
        unlockpt(&master).expect("unlocked");
        let port = ptsname(&master, Vec::new()).expect("a name").into_string().expect("text");
        let (bus, stop) = (format!("slcan:{port}"), AtomicBool::new(false));
        let folder = Folder::new("adapter");
        std::thread::scope(|scope| {
            let desk = Desk::new(Setup { moves: true, ..Setup::default() });
            scope.spawn(|| serve(&master, desk, &stop));
            let (status, stdout, stderr) = guideblock(&["block", "get", "burst-state", "--bus", &bus]);
            let run = folder.file("run.csv");
            let burst = ["block", "burst", "--blocks", "100", "--past", "40", "--out", &run, "--bus", &bus];
            let (took, _, said) = guideblock(&burst);
            stop.store(true, Ordering::Relaxed);
            assert_eq!((status, stdout.as_str()), (Some(0), "0\n"), "{stderr}");
            assert_eq!(took, Some(0), "{said}");
            assert!(said.contains("100 blocks, 1600 rows; 0 left out by the block, 0 segments lost"), "{said}");
        });
    }
}
