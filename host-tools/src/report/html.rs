//! A run as one self-contained page: what was checked, the picture, why there was no preload where there was none.

use std::fmt::Write;

use model_core::sample::Reason;

use crate::judgement::{Point, silence};

const STYLE: &str = "\
:root{color-scheme:light dark}\
body{font:16px/1.5 system-ui,'Segoe UI','DejaVu Sans',sans-serif;max-width:1000px;margin:2em auto;padding:0 1em;background:#fff;color:#1b1f23}\
h1{font-size:1.5em}h2{font-size:1.15em;margin-top:2em}svg{width:100%;height:auto}\
table{border-collapse:collapse}th,td{text-align:left;padding:.2em 1.2em .2em 0;border-bottom:1px solid #d8dee4}td.n{text-align:right}\
li{margin:.2em 0}li.fail{font-weight:600}footer{margin-top:3em;font-size:.85em}\
@media screen and (prefers-color-scheme:dark){body{background:#0d1117;color:#e6edf3}th,td{border-color:#30363d}}\
@media print{body{margin:0}}";

/// The page. `facts` are lines of the terminal: a mark in the first six columns, then text.
pub fn page(title: &str, facts: &[String], picture: &str, points: &[Point]) -> String {
    let mut body = String::new();
    // writing into a String cannot fail
    let _ = writeln!(body, "<h1>{}</h1>\n<ul>", escape(title));
    for fact in facts {
        let (mark, text) = fact.split_at_checked(6).unwrap_or(("", fact));
        let class = if mark.starts_with("FAIL") { " class=\"fail\"" } else { "" };
        let lead = if mark.trim().is_empty() { String::new() } else { format!("<b>{}</b> ", escape(mark.trim())) };
        let _ = writeln!(body, "<li{class}>{lead}{}</li>", escape(text.trim()));
    }
    let _ = writeln!(body, "</ul>\n{picture}");
    let reasons = silence(points);
    if !reasons.is_empty() {
        let _ = writeln!(
            body,
            "<h2>Why the block gave no preload</h2>\n<table>\n<tr><th>reason</th><th>readings</th><th>it means</th></tr>"
        );
        for (reason, count) in reasons {
            let (name, meaning) = (reason.name(), meaning(reason));
            let _ = writeln!(body, "<tr><td>{name}</td><td class=\"n\">{count}</td><td>{meaning}</td></tr>");
        }
        let _ = writeln!(body, "</table>");
    }
    let _ = writeln!(
        body,
        "<footer>The block is a condition monitor, not a safety component. The band has two standard deviations on \
         either side.</footer>"
    );
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width\">\n<title>{}</title>\n<style>{STYLE}</style>\n</head>\n\
         <body>\n{body}</body>\n</html>\n",
        escape(title)
    )
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// What a reason means to the person at the machine.
fn meaning(reason: Reason) -> &'static str {
    match reason {
        Reason::NotCalibrated => "no parameter record, or one that is not calibrated",
        Reason::ForceAtRail => "the force converter is at an end of its range: overload or broken bridge",
        Reason::ForceStuck => "the force code does not move at all: look at the bridge and its amplifier",
        Reason::EncoderStuck => "the encoder fell silent at full speed: look at scale and cable",
        Reason::TemperatureMissing => "thermometer open or short",
        Reason::TemperatureOutOfRange => "the oil's viscosity is not known at this temperature",
        Reason::SamplesLost => "samples were lost, the window fills anew",
        Reason::NoMotion => "the carriage stands: there is no drag force to read",
        Reason::Reversing => "the carriage has just turned round: the contacts still slide into their new direction",
        Reason::Accelerating => "speed changes: part of the force is inertia",
        Reason::Settling => "the first third of a second after start",
        Reason::SpeedOutOfRange => "slower or faster than the calibration covers",
        Reason::LoadOutOfRange => "drag force or preload beyond what the calibration covers",
        Reason::ForceAssists => "something outside the guide pushes the carriage",
        Reason::Stale => "no new samples came",
    }
}
