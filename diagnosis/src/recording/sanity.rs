//! Sanity: defects of a recording before any physics, that is rows that cannot be compared, and faulty channels.

use simulation::law::Steady;
use simulation::motion::Motion;
use simulation::run::{Break, Run};

use crate::numbers::rounding::quantum;
use crate::numbers::statistics::mean;
use crate::recording::ends::ChannelEnds;
use crate::recording::moving::derived_acceleration;
use crate::report::DataQuality;

/// Largest credible force, N: no guide carries more.
const LARGEST_N: f64 = 1e9;

/// Fewest rows for a judgement.
pub(crate) const FEWEST_ROWS: usize = 200;

/// What decides which rows of a run can be compared.
pub(crate) struct Comparable<'a> {
    pub(crate) run: &'a Run,
    pub(crate) motion: &'a Motion,
    pub(crate) steady: &'a Steady,
    /// Sign of the velocity before it was smoothed.
    pub(crate) recorded: &'a [f64],
    /// Rows of unknown acceleration, if any.
    pub(crate) unresolved: &'a [bool],
    pub(crate) is_averaged: bool,
}

impl<'a> Comparable<'a> {
    /// Of a run that was simulated: nothing was smoothed or averaged.
    pub(crate) fn as_driven(run: &'a Run, motion: &'a Motion, steady: &'a Steady) -> Self {
        Comparable { run, motion, steady, recorded: &steady.direction, unresolved: &[], is_averaged: false }
    }

    /// Marks the rows that can be compared, and counts the others.
    ///
    /// The law has no value at rest. Around a start, a stop or a reversal (within the window of differentiation), and
    /// after a break, the sign of the velocity is unknown.
    pub(crate) fn rows(&self, quality: &mut DataQuality) -> Vec<bool> {
        let Comparable { run, motion, steady, recorded, unresolved, is_averaged } = *self;
        let rows = run.len();
        let mut keep = vec![true; rows];
        let mut reject = |name, which: &mut dyn FnMut(usize) -> bool| {
            let mut count = 0;
            for (n, keep) in keep.iter_mut().enumerate() {
                if *keep && which(n) {
                    *keep = false;
                    count += 1;
                }
            }
            if count > 0 {
                *quality.rejected.entry(name).or_insert(0) += count;
            }
        };
        reject("no-finite-force", &mut |n| !run.drag_force_n[n].is_finite());
        let clipped = beside_clipped(run);
        reject(CLIPPED, &mut |n| clipped[n]);
        reject("slower-than-zero-speed", &mut |n| steady.direction[n] == 0.0 || recorded[n] == 0.0);
        let near = self.near_turns();
        reject("around-start-stop-reversal", &mut |n| near[n]);
        let blur = blur_m_s(run, motion);
        reject("speed-not-resolved", &mut |n| blur[n] > RESOLVED * motion.velocity_m_s[n].abs());
        reject("acceleration-not-resolved", &mut |n| unresolved.get(n) == Some(&true));
        let step_s = run.step_s();
        let changes = |n: usize| motion.acceleration_m_s2[n].abs() * step_s > STEADY * motion.velocity_m_s[n].abs();
        reject("speed-changes-within-average", &mut |n| is_averaged && changes(n));
        reject("law-without-value", &mut |n| !steady.force_n[n].is_finite());
        quality.samples += rows;
        quality.gaps += run.parts.iter().filter(|part| matches!(part.starts, Break::Gap | Break::ClockJump)).count();
        quality.used += keep.iter().filter(|keep| **keep).count();
        keep
    }

    /// Rows around a start, a stop or a reversal, and after a break.
    fn near_turns(&self) -> Vec<bool> {
        let (direction, recorded, reach) = (&self.steady.direction, self.recorded, self.motion.reach);
        let mut near = vec![false; self.run.len()];
        for part in &self.run.parts {
            // a part after a break begins like a turn: how the carriage got there was not recorded
            if !matches!(part.starts, Break::Start) {
                near[part.rows.start..(part.rows.start + reach).min(part.rows.end)].fill(true);
            }
            for n in part.rows.clone().skip(1) {
                if direction[n] != direction[n - 1] || recorded[n] != recorded[n - 1] {
                    let from = n.saturating_sub(reach).max(part.rows.start);
                    near[from..(n + reach).min(part.rows.end)].fill(true);
                }
            }
        }
        near
    }
}

/// Rows beside one at an end of the force channel.
fn beside_clipped(run: &Run) -> Vec<bool> {
    let ends = ChannelEnds::of(&run.drag_force_n);
    let mut clipped = vec![false; run.len()];
    for part in &run.parts {
        for n in part.rows.clone().filter(|n| ends.has(run.drag_force_n[*n])) {
            let from = n.saturating_sub(BESIDE_CLIPPED).max(part.rows.start);
            clipped[from..(n + BESIDE_CLIPPED + 1).min(part.rows.end)].fill(true);
        }
    }
    clipped
}

/// Largest accepted relative error of the speed: friction at low speed changes with its logarithm.
const RESOLVED: f64 = 0.03;

/// Largest accepted relative change of the speed within an average: the law at the mean speed equals the mean of the
/// law to within a 24th of the square of this change.
const STEADY: f64 = 0.15;

/// Error of a derived velocity where the acceleration changes within the window, m/s: for a cubic, the slope of a
/// parabola through `2m + 1` rows errs by `j Δt² (3m² + 3m - 1)/30`, with the jerk `j`.
fn blur_m_s(run: &Run, motion: &Motion) -> Vec<f64> {
    let rows = run.len();
    let mut blur = vec![0.0; rows];
    if run.velocity_m_s.is_some() {
        return blur;
    }
    let (m, step) = (motion.reach, run.step_s());
    let reach = m as f64;
    let factor = step * step * (3.0 * reach * reach + 3.0 * reach - 1.0) / 30.0;
    for part in &run.parts {
        for n in part.rows.clone() {
            let (from, to) = (n.saturating_sub(m).max(part.rows.start), (n + m).min(part.rows.end - 1));
            if to > from {
                let jerk =
                    (motion.acceleration_m_s2[to] - motion.acceleration_m_s2[from]) / ((to - from) as f64 * step);
                blur[n] = jerk.abs() * factor;
            }
        }
    }
    blur
}

/// Checks the channels of one run. Defects are added to the warnings; returns a reason if the run cannot be used.
pub(crate) fn channels(run: &Run, quality: &mut DataQuality) -> Option<String> {
    let name = |text: String| named(run, text);
    let force = &run.drag_force_n;
    let (low, high) = extremes(force);
    if run.len() < FEWEST_ROWS {
        return Some(name(format!("{} rows; at least {FEWEST_ROWS} are needed", run.len())));
    }
    if low < -LARGEST_N || high > LARGEST_N {
        return Some(name(format!("the force reaches {:.1e} N: is its unit meant?", high.max(-low))));
    }
    if !(high > low) {
        return Some(name("the force never changes: the channel is stuck or not connected".to_owned()));
    }
    if let Some(share) = at_rails(force, low, high) {
        quality.warnings.push(name(format!(
            "{:.1} % of the force lies on the edge of its range: it may be clipped",
            100.0 * share
        )));
    }
    if let Some((from, rows)) = longest_still(force) {
        let at = run.time_s.get(from).copied().unwrap_or(0.0);
        quality.warnings.push(name(format!("the force does not change over {rows} rows from {at:.3} s on: stuck")));
    }
    if let Some(step) = quantum(force) {
        let spread = (high - low).max(1e-12);
        if step > 1e-3 * spread {
            quality.warnings.push(name(format!("the force comes in steps of {step:.3e} N")));
        }
    }
    let step = run.step_s();
    let late = run
        .parts
        .iter()
        .flat_map(|part| run.time_s[part.rows.clone()].windows(2))
        .filter(|pair| ((pair[1] - pair[0]) / step - 1.0).abs() > 0.2)
        .count();
    if late * 100 > run.len() {
        quality.warnings.push(name(format!("{late} sampling intervals differ from the median by more than 20 %")));
    }
    if step > SLOW_S {
        quality.warnings.push(name(format!("rows are {step:.3} s apart: is time_s in seconds?")));
    }
    None
}

/// Time between rows above which its unit is questioned, s.
const SLOW_S: f64 = 1.0;

/// Ratio of recorded to simulated force, or its inverse, above which the unit is questioned: no guide is that far off.
const OTHER_UNIT: f64 = 3.0;

/// Questions the unit of the force where its size differs much from the simulation's; both are RMS, N.
pub(crate) fn scale(recorded_n: f64, simulated_n: f64, quality: &mut DataQuality) {
    let ratio = recorded_n / simulated_n;
    if ratio.is_finite() && ratio > 0.0 && !(1.0 / OTHER_UNIT..=OTHER_UNIT).contains(&ratio) {
        quality.warnings.push(format!(
            "the recorded force is {ratio:.3e} times the simulation's: is its unit N? (a number in kN is 0.001 of one in N, in \
             kgf 0.102, in lbf 0.225)"
        ));
    }
}

/// Checks force against motion, as [`channels`] checks each alone.
pub(crate) fn moves(run: &Run, motion: &Motion, quality: &mut DataQuality) -> Option<String> {
    if let Some(reason) = unit(run, motion) {
        return Some(named(run, reason));
    }
    let (mut power, mut size) = (0.0, 0.0);
    for (force, velocity) in run.drag_force_n.iter().zip(&motion.velocity_m_s) {
        power += force * velocity;
        size += (force * velocity).abs();
    }
    if power < -0.2 * size {
        let text = "the force brakes nowhere: it points along the motion; is its sign reversed?";
        quality.warnings.push(named(run, text.to_owned()));
    }
    if is_magnitude(&run.drag_force_n, &motion.velocity_m_s) {
        let text = "the force has one sign, and one size, in both directions: is it a magnitude? Multiply it by the sign of the \
                    velocity";
        quality.warnings.push(named(run, text.to_owned()));
    }
    None
}

/// Share of the moving rows whose force has one sign from which it has no other, and difference of the mean forces of both
/// directions, of their mean, from which friction acts: that of a magnitude is what the sensor's zero makes of it.
const ONE_SIGN: f64 = 0.99;
const NO_FRICTION: f64 = 0.2;

/// Share of the fastest speed from which a row moves.
const MOVING: f64 = 0.02;

/// Whether a force, N, was recorded without its sign: it does not change with the direction of the velocity, m/s.
fn is_magnitude(force_n: &[f64], velocity_m_s: &[f64]) -> bool {
    let fastest = velocity_m_s.iter().filter(|v| v.is_finite()).fold(0.0f64, |most, v| most.max(v.abs()));
    let moving = || force_n.iter().zip(velocity_m_s).filter(|(f, v)| f.is_finite() && v.abs() > MOVING * fastest);
    let of =
        |forwards: bool| moving().filter(move |(_, v)| (**v > 0.0) == forwards).map(|(f, _)| *f).collect::<Vec<_>>();
    let (forwards, backwards) = (of(true), of(false));
    let (few, many) = (forwards.len().min(backwards.len()), forwards.len() + backwards.len());
    let pushing = moving().filter(|(f, _)| **f > 0.0).count() as f64 / many as f64;
    let (there, back) = (mean(&forwards), mean(&backwards));
    10 * few > many
        && pushing.max(1.0 - pushing) >= ONE_SIGN
        && (there - back).abs() < NO_FRICTION * 0.5 * (there + back).abs()
}

fn named(run: &Run, text: String) -> String {
    if run.name.is_empty() { text } else { format!("{}: {text}", run.name) }
}

pub(crate) fn extremes(x: &[f64]) -> (f64, f64) {
    x.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(*x), high.max(*x)))
}

/// Share of rows at exactly the largest or smallest value, where it exceeds what a quantised signal would show.
fn at_rails(x: &[f64], low: f64, high: f64) -> Option<f64> {
    let step = quantum(x).unwrap_or(0.0);
    [low, high]
        .iter()
        .map(|edge| {
            let on = x.iter().filter(|x| **x == *edge).count();
            let beside = if step > 0.0 {
                x.iter().filter(|x| ((**x - edge).abs() - step).abs() < 0.5 * step).count()
            } else {
                0
            };
            (on, beside)
        })
        .filter(|(on, beside)| *on >= 5 && on * 200 > x.len() && *on > 3 * beside)
        .map(|(on, _)| on as f64 / x.len() as f64)
        .max_by(f64::total_cmp)
}

/// Rejection reason of a row at an end of the force channel, where the force is unknown, and of its neighbours.
const CLIPPED: &str = "near-an-end-of-the-force-channel";

/// Rows to either side of a saturated one that are excluded as well: where only noise keeps a force off the end, its
/// residual is biased.
const BESIDE_CLIPPED: usize = 10;

/// Whether speeds and accelerations are possible for a carriage: with a unit wrong by 60 or 1000 they are not. Returns
/// the complaint.
fn unit(run: &Run, motion: &Motion) -> Option<String> {
    let rms = |x: &[f64]| (x.iter().map(|x| x * x).sum::<f64>() / x.len().max(1) as f64).sqrt();
    let mut speeds: Vec<f64> = motion.velocity_m_s.iter().map(|v| v.abs()).filter(|v| v.is_finite()).collect();
    // glitches are few
    let most = speeds.len() * 19 / 20;
    let speed = if speeds.is_empty() { 0.0 } else { *speeds.select_nth_unstable_by(most, f64::total_cmp).1 };
    if speed > FASTEST_M_S {
        return Some(format!("the carriage would move at {speed:.0} m/s: is the unit of time or of position meant?"));
    }
    if let (Some(position), Some(velocity)) = (&run.position_m, &run.velocity_m_s) {
        let way: f64 = run
            .parts
            .iter()
            .flat_map(|part| part.rows.clone().skip(1))
            .map(|n| (position[n] - position[n - 1]).abs())
            .sum();
        let told: f64 = run
            .parts
            .iter()
            .flat_map(|part| part.rows.clone().skip(1))
            .map(|n| 0.5 * (velocity[n] + velocity[n - 1]).abs() * (run.time_s[n] - run.time_s[n - 1]).abs())
            .sum();
        if way > 0.0 && told > 0.0 && !(0.1..10.0).contains(&(told / way)) {
            return Some(format!(
                "speed times time is {:.3} times the way that position tells: one of the units is not what it says",
                told / way
            ));
        }
    }
    if let Some(measured) = &run.acceleration_m_s2 {
        let told = rms(&measured.iter().copied().filter(|a| a.is_finite()).collect::<Vec<_>>());
        let derived = rms(&motion.velocity_m_s) * std::f64::consts::TAU / (run.step_s() * run.len() as f64);
        if derived > 1e3 * told.max(1e-3) {
            return Some("the motion needs accelerations that the acceleration channel does not show".to_owned());
        }
        if let Some(ratio) = derived_acceleration(run).and_then(|derived| of_another_unit(measured, &derived)) {
            return Some(format!(
                "the motion accelerates {ratio:.3e} times as much as the acceleration channel says, in step with it: one of the \
                 units is not what it says (time in minutes is 3600, position in mm 1000, acceleration in mm/s² 0.001)"
            ));
        }
    }
    None
}

/// Ratio of derived to measured acceleration, or its inverse, above which a unit is wrong: in 890 recordings of the
/// concealed trials it is 0.08 to 1.9 (noise makes it small), and above 900 in those with minutes or millimetres.
const OTHER_ACCELERATION: f64 = 30.0;

/// Correlation of derived and measured acceleration from which their ratio tells.
const IN_STEP: f64 = 0.5;

/// How many times the measured acceleration the derived one is, where no noise explains that.
fn of_another_unit(measured: &[f64], derived: &[f64]) -> Option<f64> {
    let rows = measured.iter().zip(derived).filter(|(m, d)| (**m * **d).is_finite());
    let [mm, md, dd] = rows.fold([0.0; 3], |[mm, md, dd], (m, d)| [mm + m * m, md + m * d, dd + d * d]);
    let (ratio, step) = (md / mm, md / (mm * dd).sqrt());
    (step > IN_STEP && !(1.0 / OTHER_ACCELERATION..OTHER_ACCELERATION).contains(&ratio)).then_some(ratio)
}

/// Speed above that of any ball-guided carriage, m/s: catalogues end at 5 m/s, custom designs at 10.
const FASTEST_M_S: f64 = 12.0;

/// Longest sequence of rows with the same value (first row, length), if it is suspiciously long.
fn longest_still(x: &[f64]) -> Option<(usize, usize)> {
    let (mut best, mut start) = ((0, 0), 0);
    for n in 1..=x.len() {
        if n == x.len() || x[n] != x[start] {
            if n - start > best.1 {
                best = (start, n - start);
            }
            start = n;
        }
    }
    (best.1 > (x.len() / 20).max(50)).then_some(best)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_acceleration_of_another_unit_is_told_from_a_noisy_one() {
        let noise = |n: usize| (43_758.545_3 * (12.9898 * n as f64).sin()).rem_euclid(1.0) - 0.5;
        let derived: Vec<f64> = (0..2000).map(|n| (n as f64 * 0.0171).sin() + 0.3 * noise(n)).collect();
        let of = |scale: f64, noisy: f64| -> Vec<f64> {
            (0..2000).map(|n| scale * (n as f64 * 0.0171).sin() + noisy * noise(n + 5000)).collect()
        };
        let minutes = of_another_unit(&of(1.0 / 3600.0, 1e-4), &derived).expect("told");
        assert!((minutes / 3600.0 - 1.0).abs() < 0.1, "{minutes}");
        assert!(of_another_unit(&of(1000.0, 10.0), &derived).is_some_and(|ratio| (0.0009..0.0011).contains(&ratio)));
        // as it should be, an accelerometer in g, one that sees nothing but noise, and one that is dead
        for (scale, noisy) in [(1.0, 0.1), (0.102, 0.1), (1.0, 20.0), (0.0, 1e-4), (0.0, 0.0)] {
            assert_eq!(of_another_unit(&of(scale, noisy), &derived), None, "{scale} {noisy}");
        }
    }

    #[test]
    fn rails_and_stuck_channels_are_seen() {
        let smooth: Vec<f64> = (0..2000).map(|n| (f64::from(n) * 0.0171).sin() * 3.0).collect();
        let clipped: Vec<f64> = smooth.iter().map(|x| x.min(2.5)).collect();
        let (low, high) = extremes(&clipped);
        assert!(at_rails(&clipped, low, high).is_some_and(|share| (0.1..0.3).contains(&share)));
        let (low, high) = extremes(&smooth);
        assert_eq!(at_rails(&smooth, low, high), None);
        let mut stuck = smooth;
        stuck[700..900].fill(1.0);
        assert_eq!(longest_still(&stuck), Some((700, 200)));
    }

    #[test]
    fn rows_behind_a_break_are_not_compared_and_the_first_of_a_recording_are() {
        let time_s: Vec<f64> = (0..1000).map(|n| 0.01 * f64::from(n)).collect();
        let part = |rows, starts| simulation::run::Part { rows, segment: None, starts };
        let run = Run {
            position_m: Some(time_s.iter().map(|t| 0.1 * t).collect()),
            drag_force_n: time_s.iter().map(|t| 20.0 + t.sin()).collect(),
            parts: vec![
                part(0..300, Break::Start),
                part(300..600, Break::Segment),
                part(600..900, Break::Gap),
                part(900..1000, Break::ClockJump),
            ],
            time_s,
            ..Run::default()
        };
        let motion = Motion::of(&run);
        let steady = Steady { force_n: vec![20.0; 1000], direction: vec![1.0; 1000], ..Steady::default() };
        let keep = Comparable::as_driven(&run, &motion, &steady).rows(&mut DataQuality::default());
        let left_out: Vec<usize> = (0..1000).filter(|n| !keep[*n]).collect();
        let behind = |start: usize| start..start + motion.reach;
        assert_eq!(left_out, behind(300).chain(behind(600)).chain(behind(900)).collect::<Vec<usize>>());
    }
}
