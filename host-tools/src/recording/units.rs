//! Check whether the numbers of a run can be in the units that its columns are named after.
//!
//! The limits lie far beyond any axis on ball guides, so that none is refused; a wrong unit that stays within them (a
//! force in kN, a clock in ms beside a position alone) cannot be found here. Ninety of a hundred rows have to be at or
//! beyond a limit: a spike is no unit.

use simulation::run::Run;

/// Fastest travel, m/s. Ball guides end at 5 to 10 m/s, where the balls leave the return.
const SPEED_M_S: f64 = 20.0;

/// Longest travel, m. The longest tracks of joined rails reach some 100 m.
const TRAVEL_M: f64 = 500.0;

/// Largest forces, N: drive, preload and load. Static load ratings of the largest blocks are near 1 MN.
const FORCE_N: f64 = 1e6;

/// Largest error of a load cell's zero, N: a block without preload may read this far below 0.
const LOAD_ZERO_N: f64 = 10.0;

/// Largest acceleration, m/s². Ball guides take up to 500.
const ACCELERATION_M_S2: f64 = 1e4;

/// Shortest time step, s: no force sensor is sampled at 1 MHz.
const STEP_S: f64 = 1e-6;

/// Temperatures of a machine with balls in plastic returns and grease, °C. 200 K is -73 °C.
const TEMPERATURE_DEGC: [f64; 2] = [-80.0, 200.0];

/// Ratio of travel to integrated velocity from which, or below the inverse of which, one is in another unit. A factor
/// of 1.5 is a poor calibration; a factor of ten is none.
const TRAVEL_RATIO: f64 = 10.0;

/// Correlation from which travel and integrated velocity are the same motion.
const SAME_MOTION: f64 = 0.95;

/// Of windows of many rows one in fifty has to be too fast, of at least so many: a wrap of the position is no speed.
const FASTEST: f64 = 0.98;
const FEWEST_WINDOWS: usize = 50;

/// Windows that a short run is cut into for that, as far as they hold enough rows.
const SPEED_WINDOWS: usize = 150;

/// Rows that a statement about a column rests on.
const LOOKED_AT: usize = 20_000;

/// Windows in which travel and summed velocity are compared, and the fewest and most rows of one: enough that the
/// steps of an encoder count little.
const WINDOWS: usize = 2_000;
const WINDOW_ROWS: [usize; 2] = [10, 200];

/// A wrong unit.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Wrong {
    /// The column whose unit is in doubt.
    pub(super) column: &'static str,
    /// What is seen, and which unit it may be.
    pub(super) why: String,
    /// Units that may be meant, the column that is then in them, and its scale.
    pub(super) fixes: &'static [Fix],
}

/// A unit, a column and its scale.
pub(super) type Fix = (&'static str, &'static str, &'static str);

const SPEED_IN_MM: &[Fix] = &[("mm/s", "velocity_m_s", "0.001"), ("mm/min", "velocity_m_s", "1.6666666666666667e-5")];
const PLACE_IN_MM: &[Fix] = &[("mm", "position_m", "0.001"), ("min", "time_s", "60")];
const ACCELERATION_IN_MM: &[Fix] = &[("mm/s²", "acceleration_m_s2", "0.001")];
const TIME_IN_MIN: &[Fix] = &[("min", "time_s", "60"), ("h", "time_s", "3600")];

/// How velocity and position agree on the direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Sign {
    /// They agree, or one is not there.
    Same,
    /// The velocity is positive where the position falls.
    Opposite,
}

/// Checks every column.
pub(super) fn check(run: &Run) -> Result<Sign, Wrong> {
    let wrong = |column, why: String, fixes| Err(Wrong { column, why, fixes });
    let step_s = median_step(run);
    if step_s < STEP_S {
        return wrong("time_s", format!("the median step is {step_s:.3e} s; time in min or h?"), TIME_IN_MIN);
    }
    if let Some(speed) = run.velocity_m_s.as_deref().map(|v| usual(v, f64::abs))
        && speed > SPEED_M_S
    {
        return wrong("velocity_m_s", format!("usual speeds reach {speed:.1} m/s; in mm/s or mm/min?"), SPEED_IN_MM);
    }
    if let Some(position) = &run.position_m {
        let (low, high) =
            position.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(*x), high.max(*x)));
        if high - low > TRAVEL_M {
            return wrong(
                "position_m",
                format!("it spans {:.1} m; in mm or um?", high - low),
                &[("mm", "position_m", "0.001"), ("um", "position_m", "1e-6")],
            );
        }
        let speeds: Vec<_> =
            pairs(run).map(|n| (position[n + 1] - position[n]) / (run.time_s[n + 1] - run.time_s[n])).collect();
        // half of the rows are enough to tell a fast axis from the noise of a position that stands still
        let speed = quantile(&speeds, f64::abs, 0.5);
        if speed > SPEED_M_S {
            return wrong(
                "position_m",
                format!("it changes by {speed:.1} m/s; position in mm, or time in min?"),
                PLACE_IN_MM,
            );
        }
        // an axis that is mostly slow shows it where it is fast; over many rows the noise of an encoder is nothing
        let speeds = window_speeds(run, position);
        let speed = quantile(&speeds, f64::abs, FASTEST);
        if speeds.len() >= FEWEST_WINDOWS && speed > SPEED_M_S {
            return wrong(
                "position_m",
                format!("it changes by up to {speed:.1} m/s; position in mm, or time in min?"),
                PLACE_IN_MM,
            );
        }
    }
    let forces: [(_, _, &[Fix]); 3] = [
        ("drag_force_n", Some(&run.drag_force_n), &[("mN", "drag_force_n", "0.001")]),
        ("preload_n", run.preload_n.as_ref(), &[("mN", "preload_n", "0.001")]),
        ("external_load_n", run.external_load_n.as_ref(), &[("mN", "external_load_n", "0.001")]),
    ];
    for (column, values, fixes) in forces {
        if let Some(force) = values.map(|values| usual(values, f64::abs))
            && force > FORCE_N
        {
            return wrong(column, format!("usual forces reach {force:.4e} N; in mN?"), fixes);
        }
    }
    if let Some(preload) = &run.preload_n
        && usual(preload, |force| force) < LOAD_ZERO_N
        && let least = quantile(preload, |force| force, 0.1)
        && least < -LOAD_ZERO_N
    {
        let why = format!(
            "it is as low as {least:.1} N and hardly ever above 0; a preload is positive: a load cell of the other sign?"
        );
        return wrong("preload_n", why, &[("so", "preload_n", "-1")]);
    }
    if let Some(acceleration) = run.acceleration_m_s2.as_deref().map(|a| usual(a, f64::abs))
        && acceleration > ACCELERATION_M_S2
    {
        return wrong(
            "acceleration_m_s2",
            format!("usual accelerations reach {acceleration:.4e} m/s²; in mm/s²?"),
            ACCELERATION_IN_MM,
        );
    }
    let temperatures: [(_, _, &[Fix]); 3] = [
        ("temperature_block_degc", &run.temperature_block_degc, &[("K", "temperature_block_degc", "1:-273.15")]),
        ("temperature_rail_degc", &run.temperature_rail_degc, &[("K", "temperature_rail_degc", "1:-273.15")]),
        ("temperature_ambient_degc", &run.temperature_ambient_degc, &[("K", "temperature_ambient_degc", "1:-273.15")]),
    ];
    for (column, values, fixes) in temperatures {
        let Some(values) = values else { continue };
        let middle = quantile(values, |t| t, 0.5);
        if middle > TEMPERATURE_DEGC[1] {
            return wrong(column, format!("it is {middle:.1} °C; in K?"), fixes);
        }
        if middle < TEMPERATURE_DEGC[0] {
            return wrong(
                column,
                format!("it is {middle:.1} °C; another unit, or a sensor that is not connected?"),
                &[],
            );
        }
    }
    travel_against_velocity(run)
}

/// Compares windows of travel with the velocity summed over them.
fn travel_against_velocity(run: &Run) -> Result<Sign, Wrong> {
    let (Some(position), Some(velocity)) = (&run.position_m, &run.velocity_m_s) else { return Ok(Sign::Same) };
    let stride = (run.len() / WINDOWS).max(WINDOW_ROWS[0]);
    let rows = stride.min(WINDOW_ROWS[1]);
    let (mut travelled, mut summed, mut product) = (0.0, 0.0, 0.0);
    for part in &run.parts {
        let mut from = part.rows.start;
        while from + rows < part.rows.end {
            let to = from + rows;
            let sum: f64 =
                (from..to).map(|n| 0.5 * (velocity[n] + velocity[n + 1]) * (run.time_s[n + 1] - run.time_s[n])).sum();
            let travel = position[to] - position[from];
            travelled += travel * travel;
            summed += sum * sum;
            product += travel * sum;
            from += stride;
        }
    }
    if travelled == 0.0 || summed == 0.0 {
        return Ok(Sign::Same);
    }
    let correlation = product / (travelled * summed).sqrt();
    if correlation.abs() < SAME_MOTION {
        return Ok(Sign::Same);
    }
    let ratio = product.abs() / summed;
    if ratio >= TRAVEL_RATIO {
        let why =
            format!("it changes {ratio:.1} times as fast as velocity_m_s says; position in mm, or velocity in m/min?");
        let fixes =
            &[("position in mm", "position_m", "0.001"), ("velocity in m/min", "velocity_m_s", "0.016666666666666666")];
        return Err(Wrong { column: "position_m", why, fixes });
    }
    if ratio <= 1.0 / TRAVEL_RATIO {
        let why = format!("it is {:.1} times as fast as position_m changes", 1.0 / ratio);
        let (hint, fixes) = swap_hint(ratio);
        return Err(Wrong { column: "velocity_m_s", why: why + hint, fixes });
    }
    Ok(if correlation < 0.0 { Sign::Opposite } else { Sign::Same })
}

/// Which unit makes such a ratio of travel to summed velocity.
fn swap_hint(ratio: f64) -> (&'static str, &'static [Fix]) {
    match ratio {
        r if r < 2e-4 => ("; velocity in mm/min?", &[("so", "velocity_m_s", "1.6666666666666667e-5")]),
        r if r < 5e-3 => (
            "; velocity in mm/s, or time in ms?",
            &[("velocity in mm/s", "velocity_m_s", "0.001"), ("time in ms", "time_s", "0.001")],
        ),
        r if r < 0.1 => ("; velocity in m/min?", &[("so", "velocity_m_s", "0.016666666666666666")]),
        _ => ("", &[]),
    }
}

/// Rows whose next one is of the same part, evenly over the run and not more than needed.
fn pairs(run: &Run) -> impl Iterator<Item = usize> {
    let stride = (run.len() / LOOKED_AT).max(1);
    run.parts.iter().flat_map(move |part| (part.rows.start..part.rows.end.saturating_sub(1)).step_by(stride))
}

/// Speeds over windows of many rows.
fn window_speeds(run: &Run, position: &[f64]) -> Vec<f64> {
    let rows = (run.len() / SPEED_WINDOWS).clamp(WINDOW_ROWS[0], WINDOW_ROWS[1]);
    let stride = (run.len() / WINDOWS).max(rows);
    let windows = run.parts.iter().flat_map(|part| {
        let end = part.rows.end;
        (part.rows.start..end).step_by(stride).map(move |from| (from, from + rows, end))
    });
    windows
        .filter(|(_, to, end)| to < end)
        .map(|(from, to, _)| (position[to] - position[from]) / (run.time_s[to] - run.time_s[from]))
        .collect()
}

fn median_step(run: &Run) -> f64 {
    let steps: Vec<_> = pairs(run).map(|n| run.time_s[n + 1] - run.time_s[n]).collect();
    // a run of single rows has no step that could be wrong
    if steps.is_empty() { f64::INFINITY } else { quantile(&steps, |step| step, 0.5) }
}

/// Value that nine of ten measured rows do not exceed.
fn usual(column: &[f64], of: impl Fn(f64) -> f64) -> f64 {
    quantile(column, of, 0.9)
}

/// A quantile of the measured ones among rows evenly over a column; NaN without any.
fn quantile(column: &[f64], of: impl Fn(f64) -> f64, share: f64) -> f64 {
    let stride = (column.len() / LOOKED_AT).max(1);
    let mut looked_at: Vec<f64> = column.iter().step_by(stride).filter(|x| !x.is_nan()).map(|x| of(*x)).collect();
    if looked_at.is_empty() {
        return f64::NAN;
    }
    let place = ((looked_at.len() - 1) as f64 * share) as usize;
    *looked_at.select_nth_unstable_by(place, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use simulation::run::{Break, Part};

    use super::*;

    /// A reciprocating axis: 2 kHz for 10 s, stroke and speed in SI units, an encoder of 1 um and a noisy force.
    fn run(stroke_m: f64, speed_m_s: f64) -> Run {
        let time_s: Vec<f64> = (0..20_000).map(|n| f64::from(n) / 2000.0).collect();
        let rate = 2.0 * speed_m_s / stroke_m;
        let position = |t: &f64| (0.5 * stroke_m * (rate * t).sin() * 1e6).round() * 1e-6;
        let velocity = |t: &f64| speed_m_s * (rate * t).cos();
        let len = time_s.len();
        Run {
            position_m: Some(time_s.iter().map(position).collect()),
            velocity_m_s: Some(time_s.iter().map(velocity).collect()),
            drag_force_n: time_s.iter().map(|t| 20.0 * velocity(t).signum()).collect(),
            temperature_block_degc: Some(vec![24.0; len]),
            preload_n: Some(vec![3000.0; len]),
            acceleration_m_s2: Some(vec![0.5; len]),
            parts: vec![Part { rows: 0..len, segment: None, starts: Break::Start }],
            time_s,
            ..Run::default()
        }
    }

    fn scaled(column: &mut Option<Vec<f64>>, factor: f64) {
        column.iter_mut().flatten().for_each(|value| *value *= factor);
    }

    /// Time in minutes beside a position alone: most of the run is slow even then.
    #[test]
    fn minutes_show_where_the_axis_is_fast() {
        let mut run = run(0.5, 0.7);
        run.velocity_m_s = None;
        run.acceleration_m_s2 = None;
        // nine tenths of the run at a fiftieth of the speed
        let (mut t, mut x) = (0.0, 0.0);
        let position: Vec<f64> = (0..20_000)
            .map(|n| {
                t += 5e-4;
                x += 5e-4 * if n > 18_000 { 0.7 } else { 0.014 };
                x
            })
            .collect();
        run.position_m = Some(position);
        assert_eq!(check(&run), Ok(Sign::Same));
        run.time_s.iter_mut().for_each(|time| *time /= 60.0);
        let wrong = check(&run).expect_err("42 m/s");
        assert!(wrong.column == "position_m" && wrong.why.contains("time in min"), "{wrong:?}");
    }

    /// A ladder of 30 s at 100 Hz in mm, half of it slower than 20 mm/s, without a velocity to compare with.
    #[test]
    fn millimetres_show_in_a_short_recording() {
        let mut run = run(0.25, 0.1);
        run.velocity_m_s = None;
        run.time_s = (0..3000).map(|n| f64::from(n) / 100.0).collect();
        run.parts = vec![Part { rows: 0..3000, segment: None, starts: Break::Start }];
        let to_and_fro = |n: usize| if (n / 100).is_multiple_of(2) { 1.0 } else { -1.0 };
        let speeds = (0..3000).map(|n| to_and_fro(n) * [0.5, 1.0, 1.9, 4.0, 8.0][n / 600]);
        let place = |x: &mut f64, speed: f64| {
            *x += 0.01 * speed;
            Some(*x)
        };
        run.position_m = Some(speeds.scan(0.0, place).collect());
        assert_eq!(check(&run), Ok(Sign::Same), "8 m/s");
        scaled(&mut run.position_m, 10.0);
        let wrong = check(&run).expect_err("80 m/s");
        assert!(wrong.column == "position_m" && wrong.why.contains("80.0 m/s; position in mm"), "{wrong:?}");
    }

    #[test]
    fn no_axis_is_refused() {
        // from breakaway tests to the fastest linear motors, short strokes to long tracks, as they are and in part
        for stroke_m in [0.001, 0.25, 3.0, 60.0] {
            for speed_m_s in [1e-5, 1e-3, 0.1, 2.0, 10.0] {
                // no axis turns round faster than balls can follow
                if 2.0 * speed_m_s * speed_m_s / stroke_m > 500.0 {
                    continue;
                }
                let mut run = run(stroke_m, speed_m_s);
                assert_eq!(check(&run), Ok(Sign::Same), "{stroke_m} m, {speed_m_s} m/s");
                scaled(&mut run.velocity_m_s, 1.5);
                assert_eq!(check(&run), Ok(Sign::Same));
                run.velocity_m_s = None;
                assert_eq!(check(&run), Ok(Sign::Same));
                let spike = run.position_m.as_mut().expect("there");
                spike[5000] = 9.0;
                assert_eq!(check(&run), Ok(Sign::Same));
            }
        }
        // a block without preload: noise of the load cell about a zero that is a little off
        let mut unloaded = run(0.25, 0.1);
        unloaded.preload_n.iter_mut().flatten().enumerate().for_each(|(n, p)| *p = (n % 7) as f64 - 9.0);
        assert_eq!(check(&unloaded), Ok(Sign::Same));
        // a load cell that is wild in a few rows, or changes its sign
        for share in [0.05, 0.5] {
            let mut some = run(0.25, 0.1);
            let count = (share * some.len() as f64) as usize;
            some.preload_n.iter_mut().flatten().take(count).for_each(|p| *p = -*p);
            assert_eq!(check(&some), Ok(Sign::Same));
        }
        // strokes without preload beside negative ones do not hide those
        let mut ladder = run(0.25, 0.1);
        scaled(&mut ladder.preload_n, -1.0);
        ladder.preload_n.iter_mut().flatten().take(12_000).for_each(|p| *p = 0.0);
        assert_eq!(check(&ladder).map_err(|wrong| wrong.column), Err("preload_n"));
        // an axis that stands still under a changing force
        let mut still = run(0.25, 0.1);
        still.position_m = Some(vec![0.1; still.len()]);
        scaled(&mut still.velocity_m_s, 0.0);
        assert_eq!(check(&still), Ok(Sign::Same));
    }

    /// A change to a sound run, and what is said about it.
    type Case<'a> = (&'a dyn Fn(&mut Run), &'a str);

    #[test]
    fn units_that_cannot_be_meant_are_told() {
        let wrong = |change: &dyn Fn(&mut Run)| {
            let mut run = run(0.25, 0.1);
            change(&mut run);
            check(&run).map_err(|wrong| format!("{}: {}", wrong.column, wrong.why)).expect_err("refused")
        };
        let time = |run: &mut Run, factor: f64| run.time_s.iter_mut().for_each(|t| *t *= factor);
        let cases: [Case; 14] = [
            (
                &|run| scaled(&mut run.velocity_m_s, 1000.0),
                "velocity_m_s: usual speeds reach 98.7 m/s; in mm/s or mm/min?",
            ),
            (
                &|run| scaled(&mut run.velocity_m_s, 60.0),
                "velocity_m_s: it is 60.0 times as fast as position_m changes; velocity in m/min?",
            ),
            (
                &|run| scaled(&mut run.position_m, 60.0),
                "position_m: it changes 60.0 times as fast as velocity_m_s says; position in mm, or velocity in m/min?",
            ),
            (
                &|run| {
                    scaled(&mut run.position_m, 1000.0);
                    run.velocity_m_s = None;
                },
                "position_m: it changes by 70.0 m/s; position in mm, or time in min?",
            ),
            (&|run| scaled(&mut run.position_m, 1e6), "position_m: it spans 250000.0 m; in mm or um?"),
            (
                &|run| time(run, 1000.0),
                "velocity_m_s: it is 1000.0 times as fast as position_m changes; velocity in mm/s, or time in ms?",
            ),
            (
                &|run| time(run, 1.0 / 60.0),
                "position_m: it changes 60.0 times as fast as velocity_m_s says; position in mm, or velocity in m/min?",
            ),
            (&|run| time(run, 1.0 / 3600.0), "time_s: the median step is 1.389e-7 s; time in min or h?"),
            (
                &|run| run.drag_force_n.iter_mut().for_each(|f| *f *= 1e5),
                "drag_force_n: usual forces reach 2.0000e6 N; in mN?",
            ),
            (&|run| scaled(&mut run.preload_n, 1000.0), "preload_n: usual forces reach 3.0000e6 N; in mN?"),
            (
                &|run| scaled(&mut run.preload_n, -1.0),
                "preload_n: it is as low as -3000.0 N and hardly ever above 0; a preload is positive: a load cell of the \
                 other sign?",
            ),
            (
                &|run| scaled(&mut run.acceleration_m_s2, 1e5),
                "acceleration_m_s2: usual accelerations reach 5.0000e4 m/s²; in mm/s²?",
            ),
            (
                &|run| run.temperature_block_degc.iter_mut().flatten().for_each(|t| *t += 273.15),
                "temperature_block_degc: it is 297.1 °C; in K?",
            ),
            (
                &|run| scaled(&mut run.temperature_block_degc, -10.0),
                "temperature_block_degc: it is -240.0 °C; another unit, or a sensor that is not connected?",
            ),
        ];
        for (change, message) in cases {
            assert_eq!(wrong(change), message);
        }
        let mut opposite = run(0.25, 0.1);
        scaled(&mut opposite.velocity_m_s, -1.0);
        assert_eq!(check(&opposite), Ok(Sign::Opposite));
    }
}
