//! `guideblock`: the desk's side of the smart guide block.
//!
//! Results go to standard output, everything said about them to standard error. Exit status: 0 ok, 1 a check
//! failed, 2 wrong usage, 3 unusable data. A closed pipe ends the program quietly.
#![forbid(unsafe_code)]

mod cmd;

use std::process::ExitCode;

use clap::Parser;

/// Preload of a ball guide, measured by the block itself: decode its bus, replay its samples, run its firmware.
#[derive(Parser)]
#[command(name = "guideblock", version, max_term_width = 100)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(clap::Subcommand)]
enum Command {
    Decode(cmd::decode::Arguments),
    Replay(cmd::replay::Arguments),
    Convert(cmd::convert::Arguments),
    Dbc(cmd::dbc::Arguments),
    Eds(cmd::eds::Arguments),
    Record(cmd::record::Arguments),
    Block(cmd::block::Arguments),
    Parameters(cmd::parameters::Arguments),
    Trial(cmd::trial::Arguments),
    Preload(cmd::preload::Arguments),
    Drag(cmd::drag::Arguments),
    Estimate(cmd::estimate::Arguments),
    Calibrate(cmd::calibrate::Arguments),
    Diagnose(cmd::diagnose::Arguments),
    Image(cmd::image::Arguments),
    Simulate(Box<cmd::simulate::Arguments>),
    Paper(cmd::paper::Arguments),
    #[cfg(feature = "emulator")]
    Demo(cmd::demo::Arguments),
}

fn main() -> ExitCode {
    let outcome = match Arguments::parse().command {
        Command::Decode(arguments) => cmd::decode::run(arguments),
        Command::Replay(arguments) => cmd::replay::run(arguments),
        Command::Convert(arguments) => cmd::convert::run(arguments),
        Command::Dbc(arguments) => cmd::dbc::run(arguments),
        Command::Eds(arguments) => cmd::eds::run(arguments),
        Command::Record(arguments) => cmd::record::run(arguments),
        Command::Block(arguments) => cmd::block::run(arguments),
        Command::Parameters(arguments) => cmd::parameters::run(arguments),
        Command::Trial(arguments) => cmd::trial::run(arguments),
        Command::Preload(arguments) => cmd::preload::run(&arguments),
        Command::Drag(arguments) => cmd::drag::run(&arguments),
        Command::Estimate(arguments) => cmd::estimate::run(&arguments),
        Command::Calibrate(arguments) => cmd::calibrate::run(&arguments),
        Command::Diagnose(arguments) => cmd::diagnose::run(arguments),
        Command::Image(arguments) => cmd::image::run(&arguments),
        Command::Simulate(arguments) => cmd::simulate::run(&arguments),
        Command::Paper(arguments) => cmd::paper::run(arguments),
        #[cfg(feature = "emulator")]
        Command::Demo(arguments) => cmd::demo::run(arguments),
    };
    cmd::exit_code(outcome)
}
