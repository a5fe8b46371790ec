//! Does the model fit? The block checks whether its preload depends on anything that it must not depend on.
//!
//! A preload belongs to the block, not to speed, direction, place or temperature. Where the model lacks something, the
//! estimates disagree along one of these axes; their common level is the measurand and never a misfit.
//! The innovation of a trusted estimate is the part of the drag that the model does not explain:
//!
//! ```text
//! y = (ln p̂ - r)/(dlnF_p/dlnF_f) + r     r: slow mean of ln p̂, over ten minutes of motion
//! ```
//!
//! Consecutive estimates in one bin of an axis make one passage, and passages are compared by an analysis of variance,
//! see [`bins`]. A misfit must be significant and relevant, and must last: [`SIGNIFICANT`], [`RELEVANT`], [`LASTING`].
//!
//! Limits: an effect that acts alike along all axes stays unseen, so anything at one speed, one place and one
//! temperature; and along temperature the oil cannot be told from a preload that itself follows temperature. The desk
//! can.

pub mod bins;

use bins::{Bins, Finding};

use crate::monitor::WorkingPoint;
use crate::num;
use crate::params::Params;
use crate::sample::{BLOCK_PERIOD_S, Estimate};

/// Standard deviations from which a disagreement is significant. Smaller: with hundreds of evaluations an hour, chance
/// makes one. Larger: effects of relevant size are reported later.
pub const SIGNIFICANT: f32 = 5.0;

/// Share of the drag force from which a disagreement is relevant, RMS over the bins. Smaller: the known inaccuracy of
/// friction law, viscosity cubic and sensors is reported. Larger: errors of preload that a user cares about pass.
pub const RELEVANT: f32 = 0.01;

/// Evaluations in a row that must agree before the verdict changes, either way.
pub const LASTING: u8 = 4;

/// Hysteresis: a misfit ends only below this part of both limits.
const RELEASE: f32 = 0.6;

/// Time constant of the reference, s of trusted motion.
const REFERENCE_S: f32 = 600.0;

/// Share of a passage's deviation that the level of an axis takes over: it follows a drift over sixteen passages.
/// Temperature itself changes as slowly as a drift, so its axis does not follow.
const FOLLOW: f32 = 1.0 / 16.0;

/// Width of a bin of position at the start, m; it doubles when the stroke needs more bins than there are.
const PLACE_BIN_M: f32 = 0.01;

/// Quantity that an estimate must not depend on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Axis {
    /// Speed, in equal ratios over the calibrated range.
    Speed = 0,
    /// Direction of motion.
    Direction = 1,
    /// Place along the rail, from where the block was switched on.
    Position = 2,
    /// Temperature of the block, over the range of the oil.
    Temperature = 3,
}

impl Axis {
    /// All of them, in the order of their codes.
    pub const ALL: [Axis; 4] = [Axis::Speed, Axis::Direction, Axis::Position, Axis::Temperature];

    /// The name used in tables, CSV and JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Axis::Speed => "speed",
            Axis::Direction => "direction",
            Axis::Position => "position",
            Axis::Temperature => "temperature",
        }
    }
}

/// The block's judgement of its model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Verdict {
    /// The axis on which the estimates disagree most, by share of the drag; `None` before any axis was seen well
    /// enough.
    pub worst: Option<(Axis, Finding)>,
    /// Tick since which the model does not fit; `None` while it fits or too little was seen.
    pub misfit_since: Option<u32>,
    /// Bit n: axis n of [`Axis::ALL`] was seen well enough to be judged.
    pub judged: u8,
}

impl Verdict {
    /// Nothing was seen yet.
    pub const NONE: Verdict = Verdict { worst: None, misfit_since: None, judged: 0 };
}

/// Constants of the check, derived from the parameters.
#[derive(Clone, Copy, Debug)]
pub struct Consistency {
    ln_speed_from: f32,
    speed_bins_per_ln: f32,
    degc_from: f32,
    temperature_bins_per_k: f32,
    /// weight of one publishing period
    reference_share: f32,
}

/// Bins of speed and of temperature.
const BINS: usize = 16;

/// Bins of position.
const PLACES: usize = bins::MOST;

impl Consistency {
    /// For parameters that [`Params::check`] accepts.
    pub fn new(params: &Params) -> Self {
        // a range may start at rest; below a tenth of a percent of its end it is one bin
        let from = params.range.speed_from_m_s.max(1e-3 * params.range.speed_to_m_s);
        let span = num::ln(params.range.speed_to_m_s) - num::ln(from);
        let oil = &params.viscosity;
        let period_s = f32::from(params.publish_every_blocks) * BLOCK_PERIOD_S;
        Consistency {
            ln_speed_from: num::ln(from),
            speed_bins_per_ln: BINS as f32 / span.max(1e-3),
            degc_from: oil.from_degc,
            temperature_bins_per_k: BINS as f32 / (oil.to_degc - oil.from_degc),
            reference_share: period_s / REFERENCE_S,
        }
    }

    /// Takes the newest estimate with its working point; `None` where it is not trusted.
    ///
    /// Call it once for every estimate, trusted or not.
    pub fn step(&self, watch: &mut Watch, estimate: &Estimate, at: Option<WorkingPoint>) {
        let trusted = match (estimate.preload_n, estimate.speed_m_s, estimate.temperature_degc, at) {
            (Some(preload), Some(speed), Some(degc), Some(at)) if preload.value > 0.0 && at.per_force > 0.0 => {
                Some((preload.value, speed.value, degc, at))
            }
            _ => None,
        };
        match trusted {
            Some((preload, speed, degc, at)) => self.take(watch, preload, speed, degc, at),
            None => {
                watch.speed.interrupt(FOLLOW);
                watch.direction.interrupt(FOLLOW);
                watch.position.interrupt(FOLLOW);
                watch.temperature.interrupt(0.0);
            }
        }
        watch.judge(estimate.tick);
    }

    fn take(&self, watch: &mut Watch, preload_n: f32, speed_m_s: f32, degc: f32, at: WorkingPoint) {
        let level = num::ln(preload_n) - *watch.origin.get_or_insert(num::ln(preload_n));
        let y = (level - watch.reference) / at.per_force + watch.reference;
        // a plain mean at first, then an exponential one
        watch.seen += 1.0;
        watch.reference += (level - watch.reference) * (1.0 / watch.seen).max(self.reference_share);
        let v = speed_m_s.abs().max(f32::MIN_POSITIVE);
        watch.speed.take(bin((num::ln(v) - self.ln_speed_from) * self.speed_bins_per_ln, BINS), y, FOLLOW);
        watch.direction.take(usize::from(speed_m_s < 0.0), y, FOLLOW);
        let place = watch.place.bin(at.place_m, &mut watch.position);
        watch.position.take(place, y, FOLLOW);
        watch.temperature.take(bin((degc - self.degc_from) * self.temperature_bins_per_k, BINS), y, 0.0);
    }
}

fn bin(at: f32, bins: usize) -> usize {
    // the cast puts negative values and NaN into the first bin
    (at as usize).min(bins - 1)
}

/// State of the check: everything that estimates change, 2.5 kB.
#[derive(Clone, Copy, Debug)]
pub struct Watch {
    speed: Bins,
    direction: Bins,
    position: Bins,
    temperature: Bins,
    place: Places,
    reference: f32,
    origin: Option<f32>,
    /// number of estimates in the reference
    seen: f32,
    /// the axis to be evaluated next
    turn: u8,
    findings: [Option<Finding>; 4],
    /// evaluations in a row that speak against the verdict
    against: u8,
    /// tick of the first of them
    against_since: u32,
    misfit_since: Option<u32>,
}

impl Watch {
    /// Nothing seen.
    pub const fn new() -> Self {
        Watch {
            speed: Bins::new(),
            direction: Bins::new(),
            position: Bins::new(),
            temperature: Bins::new(),
            place: Places::UNUSED,
            reference: 0.0,
            origin: None,
            seen: 0.0,
            turn: 0,
            findings: [None; 4],
            against: 0,
            against_since: 0,
            misfit_since: None,
        }
    }

    /// What is known so far.
    #[cold]
    #[inline(never)]
    pub fn verdict(&self) -> Verdict {
        let worst = Axis::ALL
            .into_iter()
            .zip(self.findings)
            .filter_map(|(axis, finding)| finding.map(|f| (axis, f)))
            .reduce(|a, b| if worse(&b.1) > worse(&a.1) { b } else { a });
        let judged = self.findings.iter().enumerate().fold(0, |set, (n, f)| set | u8::from(f.is_some()) << n);
        Verdict { worst, misfit_since: self.misfit_since, judged }
    }

    /// Evaluates one axis, in turn, where it has changed; so the cost of a step stays small.
    #[cold]
    #[inline(never)]
    fn judge(&mut self, tick: u32) {
        let turn = usize::from(self.turn);
        self.turn = (self.turn + 1) % 4;
        let found = match turn {
            0 => self.speed.evaluate(FOLLOW),
            1 => self.direction.evaluate(FOLLOW),
            2 => self.position.evaluate(FOLLOW),
            _ => self.temperature.evaluate(0.0),
        };
        let Some(found) = found else { return };
        if let Some(place) = self.findings.get_mut(turn) {
            *place = found;
        }
        let limit = if self.misfit_since.is_some() { RELEASE } else { 1.0 };
        let any =
            self.findings.iter().flatten().any(|f| f.strength >= limit * SIGNIFICANT && f.share >= limit * RELEVANT);
        if any == self.misfit_since.is_some() {
            self.against = 0;
            return;
        }
        if self.against == 0 {
            self.against_since = tick;
        }
        self.against += 1;
        if self.against >= LASTING {
            self.misfit_since = any.then_some(self.against_since);
            self.against = 0;
        }
    }
}

impl Default for Watch {
    fn default() -> Self {
        Self::new()
    }
}

/// Key by which findings are compared: the share, where it is significant at all.
fn worse(finding: &Finding) -> f32 {
    if finding.strength >= RELEASE * SIGNIFICANT { finding.share } else { 0.0 }
}

/// Mapping of places on the rail to bins of one width, which doubles until the stroke fits.
#[derive(Clone, Copy, Debug)]
struct Places {
    /// 0 before the first place
    width_m: f32,
    /// number of the first bin, counted from place 0
    first: i32,
}

impl Places {
    const UNUSED: Places = Places { width_m: 0.0, first: 0 };

    /// The bin of a place, after making room for it.
    #[cold]
    #[inline(never)]
    fn bin(&mut self, place_m: f32, bins: &mut Bins) -> usize {
        // no rail is longer; NaN counts as place 0
        let place_m = place_m.clamp(-LONGEST_M, LONGEST_M);
        const LAST: i32 = PLACES as i32 - 1;
        if self.width_m == 0.0 {
            self.width_m = PLACE_BIN_M;
            self.first = floor(place_m / PLACE_BIN_M) - LAST / 2;
        }
        let mut number = floor(place_m / self.width_m);
        // 2^24 times the width is more than any rail
        for _ in 0..24 {
            let low = number - self.first;
            if (0..=LAST).contains(&low) {
                break;
            }
            let (from, to) = bins.used();
            let (from, to) = (self.first + from as i32, self.first + to as i32);
            if number.max(to) - number.min(from) <= LAST {
                // there is room at the other end
                let first = if low < 0 { number } else { number - LAST };
                bins.shift(self.first - first);
                self.first = first;
            } else {
                bins.merge_pairs(self.first.rem_euclid(2) as usize);
                self.first = self.first.div_euclid(2);
                self.width_m *= 2.0;
                number = floor(place_m / self.width_m);
            }
        }
        (number - self.first).clamp(0, LAST) as usize
    }
}

/// Longest rail, m, to either side.
const LONGEST_M: f32 = 1e4;

fn floor(x: f32) -> i32 {
    let whole = x as i32;
    if whole as f32 > x { whole.saturating_sub(1) } else { whole }
}

#[cfg(test)]
mod tests;
