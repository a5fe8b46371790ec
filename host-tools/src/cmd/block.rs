//! `guideblock block`

mod names;

use std::fs;
use std::io::Write;
use std::path::PathBuf;

use can_wire::NodeId;
use can_wire::burst::Order;
use can_wire::service::server::DELIVERED_KEY;
use can_wire::service::{Field, objects};
use host_tools::block::{Client, ClientError};
use host_tools::bus::{self, Source};
use host_tools::report::csv::hash;

use super::progress::Bar;
use super::record::{Target, of_bus};
use super::{Failure, node, output, say};

/// Asks and sets a block over its bus
///
///     guideblock block identify --bus slcan:/dev/ttyACM0
///     guideblock block set warn-below 2000 --bus socketcan:can0
///     guideblock block burst --blocks 3000 --parameters block.record --out burst.csv --bus slcan:/dev/ttyACM0
///
/// `--bus desk` is a block in memory, to try commands with. What changes anything needs the block's key, is
/// refused while the carriage moves, and holds until the next start, or for good after `set save`.
#[derive(clap::Args)]
#[command(verbatim_doc_comment, allow_negative_numbers = true)]
pub(crate) struct Arguments {
    /// slcan:PORT, socketcan:INTERFACE, or desk
    #[arg(long, value_name = "BUS", global = true)]
    bus: Option<Source>,
    /// The block's node, 1 to 127
    #[arg(long, value_name = "N", value_parser = node, default_value = "1", global = true)]
    node: NodeId,
    /// The block's key, decimal or 0x...; without it that of a block as delivered
    #[arg(long, value_name = "KEY", value_parser = key, global = true)]
    key: Option<u32>,
    #[command(subcommand)]
    what: What,
}

#[derive(clap::Subcommand)]
enum What {
    /// Prints what the block is
    Identify {
        /// As one JSON object
        #[arg(long)]
        json: bool,
    },
    /// Prints an object's value, or those of all
    Get {
        /// Name, such as warn-below; without it all that can be read
        object: Option<String>,
    },
    /// Sets an object
    #[command(allow_negative_numbers = true)]
    Set {
        /// Name: warn-below, alarm-below, warn-above, alarm-above (N or off), publishing-period (ms), burst-load (%),
        /// save, clear-counters, restart
        object: String,
        /// Value; none for commands
        value: Option<String>,
    },
    /// Takes the zero of the force: nothing may pull at the sensor
    Tare,
    /// Loads a parameter image; it is used from the next start on
    LoadImage {
        /// The image, 1 to 1024 bytes
        file: PathBuf,
        /// Start the block anew afterwards
        #[arg(long)]
        restart: bool,
    },
    /// Orders a burst of raw samples and records it
    #[command(allow_negative_numbers = true)]
    Burst {
        /// Blocks of 10 ms, 1 to 65535
        #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
        blocks: u16,
        /// Blocks of them from before the order; the block remembers about a second
        #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u16).range(..=0x7FFF))]
        past: u16,
        #[command(flatten)]
        target: Target,
    },
}

fn key(text: &str) -> Result<u32, String> {
    let number = match text.strip_prefix("0x") {
        Some(digits) => u32::from_str_radix(digits, 16),
        None => text.parse(),
    };
    number.map_err(|_| "a key is a whole number below 2^32, or 0x and hexadecimal digits".to_owned())
}

/// A client's error as a failure: a refusal by the block counts as a failed check.
fn of_client(error: ClientError) -> Failure {
    match error {
        ClientError::Refused { .. }
        | ClientError::WrongKey(_)
        | ClientError::NotKept { .. }
        | ClientError::NotSaved(_)
        | ClientError::NoZero(_) => {
            say(format_args!("guideblock: {error}"));
            Failure::Check
        }
        ClientError::Bus(error) => of_bus(error),
        ClientError::ImageSize(_) => Failure::Usage(error.to_string()),
        ClientError::Silent { .. } | ClientError::Strange { .. } | ClientError::BrokenOff(_) => Failure::data(error),
    }
}

pub(crate) fn run(arguments: Arguments) -> Result<(), Failure> {
    let Some(source) = &arguments.bus else {
        return Err(Failure::Usage("name the bus: --bus slcan:PORT, socketcan:INTERFACE or desk".to_owned()));
    };
    let mut bus = bus::open(source).map_err(of_bus)?;
    let mut client = Client::new(&mut *bus, arguments.node);
    let key = arguments.key.unwrap_or(DELIVERED_KEY);
    match arguments.what {
        What::Identify { json } => identify(&mut client, json),
        What::Get { object } => get(&mut client, object.as_deref()),
        What::Set { object, value } => names::set(&mut client, key, &object, value.as_deref()),
        What::Tare => {
            client.unlock(key).map_err(of_client)?;
            let shift = client.take_zero().map_err(of_client)?;
            let mut out = output();
            writeln!(out, "zero_shift_codes,{shift}")?;
            Ok(out.flush()?)
        }
        What::LoadImage { file, restart } => {
            let image = fs::read(&file).map_err(|error| Failure::io(&file, error))?;
            client.unlock(key).map_err(of_client)?;
            let bar = Bar::of_bytes("loading");
            client.load_image(&image, |sent, of| bar.at(sent as u64, of as u64)).map_err(of_client)?;
            drop(bar);
            if restart {
                client.write(Field::Restart, objects::RESTART).map_err(of_client)?;
            }
            say(format_args!("{} bytes loaded and kept; in use from the block's next start on", image.len()));
            Ok(())
        }
        What::Burst { blocks, past, target } => burst(&mut client, Order { blocks, past, asked: true }, &target),
    }
}

fn identify(client: &mut Client, json: bool) -> Result<(), Failure> {
    let identity = client.identify().map_err(of_client)?;
    let mut out = output();
    if json {
        writeln!(out, "{}", serde_json::to_string(&identity).map_err(Failure::data)?)?;
        return Ok(out.flush()?);
    }
    let [low, middle, high] = identity.unique;
    let [major, minor, patch] = identity.version;
    writeln!(out, "node,{}\nboard,{}\nserial,{:08X}", identity.node, identity.board, identity.serial)?;
    writeln!(out, "unique,{high:08X}{middle:08X}{low:08X}\nfirmware,{major}.{minor}.{patch}")?;
    writeln!(out, "starts,{}\nreset_cause,{}", identity.starts, identity.reset_cause)?;
    writeln!(out, "active_image,{}\nchanges,{}", hash(identity.active_image), identity.changes)?;
    writeln!(out, "unlocked,{}", identity.unlocked)?;
    Ok(out.flush()?)
}

fn get(client: &mut Client, name: Option<&str>) -> Result<(), Failure> {
    let mut out = output();
    match name {
        Some(name) => {
            let field = names::readable(name)?;
            writeln!(out, "{}", names::shown(field, client.read(field).map_err(of_client)?))?;
        }
        None => {
            for (name, field) in names::all_readable() {
                writeln!(out, "{name},{}", names::shown(field, client.read(field).map_err(of_client)?))?;
            }
        }
    }
    Ok(out.flush()?)
}

fn burst(client: &mut Client, order: Order, target: &Target) -> Result<(), Failure> {
    target.files().check()?;
    let mut recorder = target.open()?;
    let bar = Bar::of_bytes("burst, blocks");
    let (mut failed, mut blocks) = (Ok(()), 0);
    let outcome = client.burst(order, &mut |record| {
        blocks += u64::from(matches!(record, can_wire::burst::Record::Block(_)));
        bar.at(blocks, order.blocks.into());
        if failed.is_ok() {
            failed = recorder.append(record);
        }
    });
    drop(bar);
    failed.and_then(|()| recorder.sync())?;
    let outcome = outcome.map_err(of_client)?;
    say(format_args!(
        "{}: {} blocks, {} rows; {} left out by the block, {} segments lost",
        target.path().display(),
        outcome.blocks,
        recorder.rows(),
        outcome.dropped,
        outcome.lost
    ));
    if outcome.intact { Ok(()) } else { Err(Failure::Check) }
}
