//! The files a demo leaves behind.

use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::Path;

use host_tools::candump::{Frame, Micros};
use host_tools::judgement::Point;
use host_tools::recording::raw;
use host_tools::report::{html, svg};
use model_core::sample::RawBlock;
use virtual_board::SentFrame;

use super::Failure;

/// Their names.
pub(super) const NAMES: [&str; 6] =
    ["report.html", "picture.svg", "estimates.csv", "demo.candump.log", "demo.raw.csv", "demo.record"];

/// What a demo leaves.
pub(super) struct Remains<'a> {
    /// What was played to which board.
    pub(super) title: &'a str,
    /// What the terminal said at the end.
    pub(super) facts: &'a [String],
    /// The readings.
    pub(super) points: &'a [Point],
    /// All frames of the bus.
    pub(super) frames: &'a [SentFrame],
    /// The converters' samples.
    pub(super) blocks: &'a [RawBlock],
    /// The parameter record in the block's flash.
    pub(super) record: &'a [u8],
}

/// Writes all files and returns a hint which to look at.
pub(super) fn write(folder: &Path, remains: &Remains<'_>) -> Result<String, Failure> {
    let Remains { title, facts, points, frames, blocks, record } = *remains;
    fs::create_dir_all(folder).map_err(|error| Failure::file(folder, error))?;
    let mut said = String::new();
    let [report, figure, readings, log, samples, flash] = NAMES;
    let mut file = |name: &str, what: &str, content: &dyn Fn(&mut dyn Write) -> std::io::Result<()>| {
        let path = folder.join(name);
        let written = File::create(&path).and_then(|file| {
            let mut out = BufWriter::new(file);
            content(&mut out)?;
            out.flush()
        });
        written.map_err(|error| Failure::file(&path, error))?;
        said += &format!("{:<40}{what}\n", path.display().to_string());
        Ok::<(), Failure>(())
    };
    let picture = svg::picture(title, "estimate of the block with ± 2σ, against the truth of the rig", points);
    file(report, "start here: verdict and picture on one page", &|out| {
        out.write_all(html::page(title, facts, &picture, points).as_bytes())
    })?;
    file(figure, "the picture alone", &|out| out.write_all(picture.as_bytes()))?;
    file(readings, "every reading beside the truth", &|out| estimates(out, points))?;
    file(log, "the bus, for `guideblock decode`", &|out| bus(out, frames))?;
    file(samples, "the converters' samples, for `guideblock replay --parameters demo.record`", &|out| {
        let mut writer = raw::Writer::new(out)?;
        for block in blocks {
            writer.block(block)?;
        }
        writer.finish()
    })?;
    file(flash, "the block's parameters, for `guideblock parameters --show`", &|out| out.write_all(record))?;
    Ok(said)
}

fn estimates(out: &mut dyn Write, points: &[Point]) -> std::io::Result<()> {
    let mut writer = csv::Writer::from_writer(out);
    for point in points {
        writer.serialize(point)?;
    }
    writer.flush()
}

fn bus(out: &mut dyn Write, frames: &[SentFrame]) -> std::io::Result<()> {
    for frame in frames {
        writeln!(out, "{}", Frame::new(Some(Micros(frame.at / 1000)), "can0", frame.id, frame.data()))?;
    }
    Ok(())
}
