//! The desk at the block's bus: it listens while it waits, records bursts and diagnoses them.

use std::path::Path;
use std::time::Duration;

use can_wire::burst::{Order, Record};
use can_wire::parameters;
use can_wire::service::{Field, client};
use can_wire::{Message, MisfitMessage, NodeId, decode};
use diagnosis::{Options, diagnose};
use host_tools::block::{Listening, object};
use host_tools::bus::emulated::Emulated;
use host_tools::bus::{Bus, Event};
use host_tools::image::{self, Circumstances};
use host_tools::recorder::{Kind, Recorder};
use host_tools::recording;
use model_core::params::Params;
use simulation::Simulation;
use simulation::mechanism::Id;
use system_tests::image::{BENCH, record};

use crate::axis::PRELOAD_N;

/// The desk: its bus, and what it has heard.
pub(crate) struct Desk<'a> {
    pub(crate) bus: &'a mut Emulated,
    listening: Listening,
    recorder: Recorder,
    /// bursts that ended
    pub(crate) bursts: u32,
    /// relative errors of the preloads received since the last call of [`error`](Self::error)
    pub(crate) errors: Vec<f64>,
    pub(crate) misfit: Option<MisfitMessage>,
    /// hash of the image in use, from the newest state frame
    pub(crate) image: u32,
}

impl<'a> Desk<'a> {
    /// Records into a new file.
    pub(crate) fn new(bus: &'a mut Emulated, run: &Path) -> Self {
        let _ = std::fs::remove_file(run);
        let recorder = Recorder::open(run, Kind::Run, BENCH.calibration).expect("a file");
        let listening = Listening::new(NodeId::FIRST);
        Desk { bus, listening, recorder, bursts: 0, errors: Vec::new(), misfit: None, image: 0 }
    }

    /// Listens until `done`, or panics after `within`.
    pub(crate) fn until(&mut self, within: Duration, mut done: impl FnMut(&Self) -> bool) {
        let end = self.bus.now() + within;
        while !done(self) {
            assert!(self.bus.now() < end, "waited {within:?}: {:?}, {} bursts", self.misfit, self.bursts);
            let heard = match self.bus.receive(Duration::from_millis(50)).expect("a bus") {
                Event::Frame(heard) => heard,
                Event::Silence => continue,
                Event::End => panic!("the board's run ended: {:?}", self.misfit),
            };
            let (recorder, bursts) = (&mut self.recorder, &mut self.bursts);
            self.listening.hear(&heard, &mut |record| {
                recorder.append(record).expect("room");
                *bursts += u32::from(matches!(record, Record::Trailer(_)));
            });
            self.listening.ask(self.bus).expect("a bus");
            match decode(heard.frame.id, &heard.frame.data) {
                Ok((_, Message::Misfit(misfit))) => self.misfit = Some(misfit),
                Ok((_, Message::State(state))) => self.image = state.image,
                Ok((_, Message::Estimate(estimate))) => {
                    self.errors.extend(estimate.preload_n.map(|n| f64::from(n) / PRELOAD_N - 1.0));
                }
                _ => {}
            }
        }
    }

    pub(crate) fn wait(&mut self, time: Duration) {
        let end = self.bus.now() + time;
        self.until(time + Duration::from_secs(1), |d| d.bus.now() >= end);
    }

    /// Whether the newest misfit frame reports a misfit.
    pub(crate) fn does_not_fit(&self) -> bool {
        self.misfit.is_some_and(|m| m.since_s.is_some())
    }

    /// Waits for the present or next burst and writes it to disk; returns the rows of the recording so far.
    pub(crate) fn take_burst(&mut self) -> u64 {
        let before = self.bursts;
        self.until(Duration::from_secs(120), |d| d.bursts > before);
        assert!(self.listening.is_intact() && self.listening.lost() == 0, "a burst with gaps");
        self.recorder.sync().expect("a disk");
        self.recorder.rows()
    }

    /// Orders a burst without waiting for the answer: a client that waits would swallow frames of a burst that the
    /// block may have begun by itself, because the misfit ended and began anew. Such a block refuses the order, and its
    /// own burst, which is as long, serves as well.
    pub(crate) fn order_burst(&mut self) {
        let order = Order { blocks: 6000, past: 0, asked: true };
        let request = client::write(NodeId::FIRST, object(Field::BurstOrder), order.value());
        self.bus.send(&request).expect("a bus");
    }

    /// RMS of the relative errors since the last call.
    pub(crate) fn error(&mut self) -> f64 {
        let errors = std::mem::take(&mut self.errors);
        assert!(errors.len() > 100, "{} preloads", errors.len());
        (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt()
    }
}

/// Diagnoses a recording, which must name `effect` first, and makes an image from the findings. `cst`: viscosity that
/// the simulation of this axis assumes, cSt.
pub(crate) fn explain(run: &Path, own: Params, cst: f32, effect: Id) -> Vec<u8> {
    let text = format!(
        "schema = \"guideblock.simulation/1\"\n[guide]\nparameters = \"zhou-2023\"\n[lubricant]\nviscosity_cst = {cst}\n[operation]\npreload_n = {PRELOAD_N:?}\n"
    );
    let simulation = Simulation::from_toml(&text).expect("a simulation");
    let (run, _) = recording::open(run, &[], &[], &recording::silent).expect("a recording");
    let outcome = diagnose(&[run], &[], &simulation, &Options { seed: 0 });
    println!("verdict {}", outcome.diagnosis.verdict.name());
    for cause in &outcome.diagnosis.mechanisms {
        println!(
            "{:.0} % {}, confidence {:.2}, equivalents {:?}",
            100.0 * cause.share_of_mismatch,
            cause.id,
            cause.confidence,
            cause.equivalents
        );
        for p in &cause.parameters {
            println!("    {} = {:.4} {} {:.4?}", p.name, p.value, p.unit, p.ci95);
        }
    }
    let named = outcome.diagnosis.mechanisms.first().map(|cause| cause.id.as_str());
    assert_eq!(named, Some(effect.name()));
    // through a file, as `diagnose --export` writes and `image` reads it
    let exported = outcome.augmented.expect("something to export").to_toml();
    let augmented = Simulation::from_toml(&exported).expect("what was written can be read");
    let base = parameters::decode(&record(own)).expect("the block's own");
    let told = Circumstances { keep_law: true, ..Circumstances::default() };
    image::build(&augmented, &base, &told).unwrap_or_else(|why| panic!("{why}")).bytes
}
