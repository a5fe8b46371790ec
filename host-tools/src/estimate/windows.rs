//! A run cut into windows: is this steady motion, and what are force and speed in it?
//!
//! Speeds are those of four quarters, from their mean positions (or mean velocities), so that the steps of an encoder
//! average out. The noise of the mean force follows from the scatter of the rows and their correlation ρ from row to
//! row, `σ² = s²/n·(1+ρ)/(1-ρ)`, as on the block.

use std::ops::Range;

use model_core::sample::{Reason, Reasons};
use simulation::run::{Part, Run};

use super::Settings;

/// Largest spread of speeds within a window, of their mean; the block's.
const STEADY_SPREAD: f64 = 0.05;

/// Fewest rows from which a window's noise can be estimated.
const FEWEST_ROWS: usize = 16;

/// Rows that a window is made to hold at least: more than the fewest, so that a clock with jitter does not fall below.
const USUAL_ROWS: f64 = 20.0;

/// Shortest window at the end of a part, relative to a whole one.
const SHORTEST: f64 = 0.5;

/// A window of a run: its motion, force and temperature.
#[derive(Clone, Debug, PartialEq)]
pub struct Window {
    /// Its rows.
    pub rows: Range<usize>,
    /// Its middle, s.
    pub time_s: f64,
    /// Mean position, m; NaN where it was not measured.
    pub position_m: f64,
    /// Speed, m/s, signed.
    pub speed_m_s: f64,
    /// Acceleration, m/s², signed.
    pub acceleration_m_s2: f64,
    /// Distance covered, m.
    pub travel_m: f64,
    /// Mean force, N, with the sign of the recording.
    pub force_n: f64,
    /// Standard deviation of that mean, N.
    pub force_sigma_n: f64,
    /// Mean temperature of the block, °C; NaN where it was not measured.
    pub temperature_degc: f64,
    /// Reasons against using it that follow from its motion.
    pub reasons: Reasons,
}

/// Length of the windows of a part, s: as long as asked for, and long enough to hold rows that noise can be told from.
pub fn window_s(run: &Run, part: &Part, every_s: f64) -> f64 {
    let time = &run.time_s[part.rows.clone()];
    let (first, last) = (time.first().copied().unwrap_or(0.0), time.last().copied().unwrap_or(0.0));
    // one row has no step, 0/0, and `max` passes over it
    every_s.max(USUAL_ROWS * (last - first) / time.len().saturating_sub(1) as f64)
}

/// Cuts a run. Every row is in one window, but for those that end a part too early to make one.
pub fn windows(run: &Run, settings: &Settings, zero_speed_m_s: f64) -> Vec<Window> {
    let mut all = Vec::new();
    for part in &run.parts {
        let mut course = Course { direction: 0.0, travel_m: 0.0, is_first: true };
        for (mut window, speeds) in measured(run, &cut(run, part, window_s(run, part, settings.every_s))) {
            window.reasons = course.judge(&window, &speeds, settings, zero_speed_m_s);
            all.push(window);
        }
    }
    all
}

/// Rows below which a second thread costs more than it saves.
const FEW_ROWS: usize = 100_000;

/// Windows with the speeds within them, measured by several threads where there are many rows; in order.
fn measured(run: &Run, cut: &[Range<usize>]) -> Vec<(Window, Vec<f64>)> {
    let all = |rows: &[Range<usize>]| rows.iter().map(|rows| measure(run, rows.clone())).collect::<Vec<_>>();
    let rows = cut.last().map_or(0, |last| last.end) - cut.first().map_or(0, |first| first.start);
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    if rows < FEW_ROWS || threads < 2 {
        return all(cut);
    }
    std::thread::scope(|scope| {
        let shares: Vec<_> = cut.chunks(cut.len().div_ceil(threads)).map(|share| scope.spawn(|| all(share))).collect();
        shares.into_iter().flat_map(|t| t.join().unwrap_or_else(|p| std::panic::resume_unwind(p))).collect()
    })
}

fn cut(run: &Run, part: &Part, length_s: f64) -> Vec<Range<usize>> {
    let time = &run.time_s;
    let mut all = Vec::new();
    let (mut from, mut reach) = (part.rows.start, FEWEST_ROWS);
    while from < part.rows.end {
        // a little early rather than a row late: times are rounded
        let end = time[from] + length_s * (1.0 - 1e-9);
        // windows are about as long as the one before: bisecting the whole rest would touch all of it
        while from + reach < part.rows.end && time[from + reach] < end {
            reach *= 2;
        }
        let near = &time[from..part.rows.end.min(from + reach + 1)];
        let to = from + near.partition_point(|t| *t < end);
        let is_whole = to < part.rows.end;
        let length = time[to - 1] - time[from];
        if to - from >= FEWEST_ROWS && (is_whole || length >= SHORTEST * length_s) {
            all.push(from..to);
        }
        from = to;
    }
    all
}

/// A window and the speeds within it, in order.
fn measure(run: &Run, rows: Range<usize>) -> (Window, Vec<f64>) {
    let time = &run.time_s[rows.clone()];
    let quarter = |column: &[f64]| -> [f64; 4] {
        std::array::from_fn(|n| mean(&column[rows.start + n * rows.len() / 4..rows.start + (n + 1) * rows.len() / 4]))
    };
    let at = quarter(&run.time_s);
    let duration = time[time.len() - 1] - time[0];
    let (speeds, position_m) = match (&run.position_m, &run.velocity_m_s) {
        (Some(x), None) => {
            let place = quarter(x);
            ((0..3).map(|n| (place[n + 1] - place[n]) / (at[n + 1] - at[n])).collect(), place.iter().sum::<f64>() / 4.0)
        }
        (position, Some(velocity)) => {
            (quarter(velocity).to_vec(), position.as_ref().map_or(f64::NAN, |x| mean(&x[rows.clone()])))
        }
        // the reader refuses such a run
        (None, None) => (vec![f64::NAN; 4], f64::NAN),
    };
    let speed_m_s = mean(&speeds);
    let apart = if speeds.len() == 3 { 0.5 * (at[3] + at[2] - at[1] - at[0]) } else { at[3] - at[0] };
    let acceleration_m_s2 = (speeds[speeds.len() - 1] - speeds[0]) / apart;
    let (force_n, force_sigma_n) = noise(&run.drag_force_n[rows.clone()]);
    let temperature_degc = run.temperature_block_degc.as_ref().map_or(f64::NAN, |column| {
        let measured = column[rows.clone()].iter().filter(|t| t.is_finite());
        let (sum, count) = measured.fold((0.0, 0usize), |(sum, count), t| (sum + t, count + 1));
        sum / count as f64
    });
    let window = Window {
        time_s: time[0] + 0.5 * duration,
        position_m,
        speed_m_s,
        acceleration_m_s2,
        travel_m: speed_m_s.abs() * duration,
        force_n,
        force_sigma_n,
        temperature_degc,
        reasons: Reasons::NONE,
        rows,
    };
    (window, speeds)
}

fn mean(column: &[f64]) -> f64 {
    column.iter().sum::<f64>() / column.len() as f64
}

/// Mean and its standard deviation.
fn noise(force: &[f64]) -> (f64, f64) {
    let centre = mean(force);
    let (mut square, mut lagged, mut last) = (0.0, 0.0, 0.0);
    for f in force {
        let d = f - centre;
        square += d * d;
        lagged += d * last;
        last = d;
    }
    let n = force.len() as f64;
    let rho = if square > 0.0 { (lagged / square).clamp(0.0, 0.99) } else { 0.0 };
    (centre, (square / (n * (n - 1.0)) * (1.0 + rho) / (1.0 - rho)).sqrt())
}

/// State of the motion from window to window of a part.
struct Course {
    direction: f64,
    travel_m: f64,
    is_first: bool,
}

impl Course {
    fn judge(&mut self, window: &Window, speeds: &[f64], settings: &Settings, zero_speed: f64) -> Reasons {
        let mut reasons = Reasons::NONE;
        let was_first = std::mem::replace(&mut self.is_first, false);
        if speeds.iter().all(|v| v.abs() < zero_speed) {
            (self.direction, self.travel_m) = (0.0, 0.0);
            reasons.insert(Reason::NoMotion);
            return reasons;
        }
        let direction = window.speed_m_s.signum();
        let turned = speeds.iter().any(|v| *v * direction < -zero_speed);
        if turned || direction != self.direction {
            // the turn lies in this window or right before it; what the last quarters covered counts for the next
            let last = speeds[speeds.len() - 1];
            self.direction = if turned { last.signum() } else { direction };
            self.travel_m = if turned { 0.0 } else { window.travel_m };
            // where a part starts in steady motion no reversal is known
            reasons.insert(if was_first && !turned { Reason::Settling } else { Reason::Reversing });
        } else {
            reasons.insert_if(self.travel_m < settings.presliding_guard_m, Reason::Reversing);
            self.travel_m += window.travel_m;
        }
        let (low, high) = speeds.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(*v), b.max(*v)));
        reasons.insert_if(high - low > STEADY_SPREAD * window.speed_m_s.abs() + zero_speed, Reason::Accelerating);
        // an unknown speed
        reasons.insert_if(!(high - low).is_finite(), Reason::EncoderStuck);
        reasons
    }
}
