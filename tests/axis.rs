//! An axis as a list of raw samples, fed to a board one converter trigger at a time.
//!
//! The list is indexed by sample, not by time, so two boards that boot at different speeds see the very same
//! samples and must send the very same frames.

use host_tools::rig::front_end::{ChannelNoise, FrontEnd};
use model_core::params::Params;
use model_core::reduced::DragLaw;
use virtual_board::{Bench, Nanos, Pins, SentFrame};

/// What the sensors read at one trigger.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sample {
    /// Code of the force converter.
    pub force_code: u16,
    /// Code of the temperature converter.
    pub temperature_code: u16,
    /// Counts of the encoder since its zero.
    pub encoder_count: i64,
}

/// Length of a converter period, s.
pub const SAMPLE_S: f64 = 1.0 / 1600.0;

/// The readings of an axis that moves along `path` (s -> m) with this preload and temperature.
///
/// The force follows the block's own law with seals; at rest it is 5 N.
///
/// # Panics
/// When the law does not cover the motion.
pub fn readings(params: &Params, seconds: f64, preload_n: f32, degc: f32, path: impl Fn(f64) -> f64) -> Vec<Sample> {
    let mut front = FrontEnd::new(params.calibration, ChannelNoise::BENCH, 11);
    let nu = params.viscosity.at(degc).map_or(0.0, |v| v.cst) * params.viscosity_number_per_cst;
    (0..(seconds / SAMPLE_S) as usize)
        .map(|n| {
            let t = n as f64 * SAMPLE_S;
            let speed = ((path(t + 1e-3) - path(t - 1e-3)) / 2e-3) as f32;
            let contacts = params.law.drag_force(preload_n, nu * speed.abs()).unwrap_or_default();
            let seals = params.seals.coulomb_n + params.seals.viscous_n_s_m * speed.abs();
            let drag = if speed == 0.0 { 5.0 } else { (contacts + seals) * speed.signum() };
            Sample {
                force_code: front.force_code(f64::from(drag)),
                temperature_code: front.temperature_code(Some(f64::from(degc))),
                encoder_count: front.encoder_count(path(t)),
            }
        })
        .collect()
}

/// Something done to the board before a sample is taken.
pub type Event = Box<dyn FnMut(&mut Pins<'_>) + Send>;

/// Feeds readings to a board and collects its frames.
pub struct Feed {
    readings: Vec<Sample>,
    events: Vec<(usize, Event)>,
    delivered: usize,
    /// fraction of a sample that a stopped converter is behind
    overdue: f64,
    counts: i64,
    last_progress: Nanos,
    /// When the readings were used up.
    done_at: Option<Nanos>,
    /// Whether the run goes on, with the last reading, until the caller's deadline.
    pub until: Option<Nanos>,
    /// Frames sent, with the number of samples delivered before each.
    pub frames: Vec<(usize, SentFrame)>,
}

/// Interval at which the feed checks whether the next sample was taken: a third of a converter period.
const LOOK: Nanos = 200_000;
/// Time after the last sample for the last frames to leave.
const TAIL: Nanos = 30_000_000;
/// Time without a sample after which the list advances by time, so that a run with a stopped converter ends, too.
const PATIENCE: Nanos = 5_000_000;

impl Feed {
    /// A feed without events.
    pub fn new(readings: Vec<Sample>) -> Self {
        Feed {
            readings,
            events: Vec::new(),
            delivered: 0,
            overdue: 0.0,
            counts: 0,
            last_progress: 0,
            done_at: None,
            until: None,
            frames: Vec::new(),
        }
    }

    /// Adds an event before the sample with this number is taken.
    #[must_use]
    pub fn at(mut self, sample: usize, event: impl FnMut(&mut Pins<'_>) + Send + 'static) -> Self {
        self.events.push((sample, Box::new(event)));
        self.events.sort_by_key(|(at, _)| *at);
        self
    }

    /// Keeps the board running until this instant.
    #[must_use]
    pub fn until(mut self, end: Nanos) -> Self {
        self.until = Some(end);
        self
    }
}

impl Bench for Feed {
    fn step(&mut self, now: Nanos, pins: &mut Pins<'_>) -> Option<Nanos> {
        let new = pins.take_samples().len();
        if new > 0 {
            self.delivered += new;
            self.last_progress = now;
        } else if self.delivered > 0 && now - self.last_progress > PATIENCE {
            // no conversions: time goes on without them
            self.overdue += LOOK as f64 * 1e-9 / SAMPLE_S;
            self.delivered += self.overdue as usize;
            self.overdue = self.overdue.fract();
        }
        self.frames.extend(pins.take_frames().into_iter().map(|f| (self.delivered, f)));
        while self.events.first().is_some_and(|(at, _)| *at <= self.delivered) {
            let (_, mut event) = self.events.remove(0);
            event(pins);
        }
        let reading = *self.readings.get(self.delivered).or(self.readings.last())?;
        pins.force_code(reading.force_code);
        pins.temperature_code(reading.temperature_code);
        if reading.encoder_count != self.counts {
            self.counts = reading.encoder_count;
            // all edges well before the next trigger
            pins.move_encoder_to(reading.encoder_count, now + LOOK / 2);
        }
        if self.delivered >= self.readings.len() {
            self.done_at.get_or_insert(now);
        }
        let end = match self.until {
            Some(end) => end,
            None => self.done_at.map_or(Nanos::MAX, |at| at + TAIL),
        };
        (now < end).then_some(now + LOOK)
    }
}
