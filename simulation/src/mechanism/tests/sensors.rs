//! Sensor effects, applied to a known force.

use std::f64::consts::TAU;

use super::*;

/// A run whose law is a column, so that any force can be put in.
fn recorded(rows: usize, dt: f64, force: impl Fn(f64) -> f64) -> Run {
    let time_s: Vec<f64> = (0..rows).map(|n| n as f64 * dt).collect();
    Run {
        velocity_m_s: Some(vec![0.1; rows]),
        drag_force_n: vec![0.0; rows],
        simulated_force_n: Some(time_s.iter().map(|t| force(*t)).collect()),
        parts: vec![Part { rows: 0..rows, segment: None, starts: Break::Start }],
        time_s,
        ..Run::default()
    }
}

fn column(run: &Run, id: Id, form: usize, shape: &[f64]) -> Vec<f64> {
    let motion = Motion::of(run);
    let simulation = simulation("");
    let context = Context::of(&simulation, run, &motion).expect("has its column");
    (definition(id).forms[form].columns)(&context, shape).expect("shows").remove(0)
}

/// Amplitude and phase at a frequency, over the last whole periods.
fn line(column: &[f64], dt: f64, frequency: f64) -> (f64, f64) {
    let rows = ((10.0 / frequency) / dt).round() as usize;
    let start = column.len() - rows;
    let (mut s, mut c) = (0.0, 0.0);
    for (n, x) in column.iter().enumerate().skip(start) {
        let angle = TAU * frequency * n as f64 * dt;
        s += x * angle.sin();
        c += x * angle.cos();
    }
    let scale = 2.0 / rows as f64;
    ((s * s + c * c).sqrt() * scale, c.atan2(s))
}

#[test]
fn a_low_pass_has_the_gain_and_phase_of_its_time_constant() {
    let (dt, frequency, tau) = (1e-3, 5.0, 0.02);
    let run = recorded(20_000, dt, |t| 30.0 * (TAU * frequency * t).sin());
    let force = run.simulated_force_n.as_ref().expect("given");
    let w = TAU * frequency * tau;
    for order in [1, 2] {
        let change = column(&run, Id::ForceLowpass, order - 1, &[tau]);
        let out: Vec<f64> = change.iter().zip(force).map(|(change, force)| change + force).collect();
        let (gain, phase) = line(&out, dt, frequency);
        let expected = 30.0 / (1.0 + w * w).sqrt().powi(order as i32);
        assert!((gain / expected - 1.0).abs() < 1e-3, "{order}: {gain} {expected}");
        assert!((phase + order as f64 * w.atan()).abs() < 1e-3, "{order}: {phase}");
    }
}

#[test]
fn a_resonance_has_the_gain_and_phase_of_its_oscillator() {
    let (dt, frequency) = (1e-3, 20.0);
    let run = recorded(20_000, dt, |t| 30.0 * (TAU * frequency * t).sin());
    let force = run.simulated_force_n.as_ref().expect("given");
    let change = column(&run, Id::StructuralResonance, 0, &[30.0, 0.1]);
    let out: Vec<f64> = change.iter().zip(force).map(|(change, force)| change + force).collect();
    let r: f64 = 20.0 / 30.0;
    let (real, imaginary) = (1.0 - r * r, 2.0 * 0.1 * r);
    let (gain, phase) = line(&out, dt, frequency);
    assert!((gain * (real * real + imaginary * imaginary).sqrt() / 30.0 - 1.0).abs() < 3e-3, "{gain}");
    assert!((phase + imaginary.atan2(real)).abs() < 3e-3, "{phase}");
}

#[test]
fn a_resonance_above_the_sampling_is_not_shown() {
    let run = recorded(2000, 0.01, |t| (TAU * t).sin());
    let motion = Motion::of(&run);
    let simulation = simulation("");
    let context = Context::of(&simulation, &run, &motion).expect("has its column");
    let form = &definition(Id::StructuralResonance).forms[0];
    assert!((form.columns)(&context, &[60.0, 0.1]).is_none());
    assert!((form.columns)(&context, &[10.0, 0.1]).is_some());
}

#[test]
fn a_delay_is_a_delay_and_its_small_form_its_slope() {
    let of = |t: f64| 20.0 + 5.0 * (3.0 * t).sin();
    let run = recorded(10_000, 1e-3, of);
    let exact = column(&run, Id::TimeMisalignment, 1, &[0.0123]);
    let small = column(&run, Id::TimeMisalignment, 0, &[]);
    for n in (100..9900).step_by(37) {
        let t = run.time_s[n];
        assert!((exact[n] - (of(t - 0.0123) - of(t))).abs() < 1e-4, "{n}");
        assert!((small[n] + 15.0 * (3.0 * t).cos()).abs() < 1e-3, "{n}");
    }
    let early = column(&run, Id::TimeMisalignment, 1, &[-0.0123]);
    assert!((early[5000] - (of(5.0123) - of(5.0))).abs() < 1e-4);
}

/// Where the motion turns the friction jumps from one sign to the other, between two rows.
#[test]
fn a_turn_between_two_rows_is_a_jump_and_no_slope() {
    let (dt, rows, turn) = (5e-3, 400, 200.3);
    let mut run = recorded(rows, dt, |_| 0.0);
    let speed = |n: usize| 0.01 * (turn - n as f64) * dt;
    run.velocity_m_s = Some((0..rows).map(speed).collect());
    run.simulated_force_n = Some((0..rows).map(|n| 20.0 * speed(n).signum()).collect());
    let late = |delay: f64| column(&run, Id::TimeMisalignment, 1, &[delay])[202];
    // 1.7 rows behind the turn
    assert_eq!([late(1.6 * dt), late(1.8 * dt)], [0.0, 40.0]);
    let tau = 3e-3;
    let out = column(&run, Id::ForceLowpass, 0, &[tau])[201];
    assert!((out - 40.0 * (-0.7 * dt / tau).exp()).abs() < 1e-9, "{out}");
}

/// At rest the law has no force: a late channel shows either none, or the force with which the carriage stopped.
#[test]
fn a_late_channel_shows_a_rest_late() {
    let mut run = recorded(3000, 1e-3, |_| 20.0);
    let moving = |speed: f64| (0..3000).map(|n| if (1000..2000).contains(&n) { 0.0 } else { speed }).collect();
    (run.velocity_m_s, run.simulated_force_n) = (Some(moving(0.1)), Some(moving(20.0)));
    let rows = [990, 1005, 1020, 1500, 2005, 2020];
    let of = |form| rows.map(|n| column(&run, Id::TimeMisalignment, form, &[0.01])[n]);
    assert_eq!(of(1), [0.0, 20.0, 0.0, 0.0, -20.0, 0.0]);
    assert_eq!(of(2), [0.0, 20.0, 20.0, 20.0, 0.0, 0.0]);
}

#[test]
fn the_force_channel_ends_counts_scales_and_drifts() {
    let of = |t: f64| 50.0 * t.sin();
    let run = recorded(7000, 1e-3, of);
    let limit = column(&run, Id::ForceSaturation, 0, &[40.0]);
    let step = column(&run, Id::ForceQuantisation, 1, &[4.0]);
    let gain = column(&run, Id::ForceGain, 0, &[]);
    let drift = column(&run, Id::ForceDrift, 0, &[]);
    for n in (1..7000).step_by(13) {
        let (t, force) = (run.time_s[n], of(run.time_s[n]));
        assert!((force + limit[n] - force.clamp(-40.0, 40.0)).abs() < 1e-12);
        assert!(((force + step[n]) / 4.0).fract().abs() < 1e-9 && step[n].abs() <= 2.0, "{n}");
        assert_eq!(gain[n], force);
        assert!((drift[n] - t).abs() < 1e-9);
    }
    let motion = Motion::of(&run);
    let simulation = simulation("");
    let context = Context::of(&simulation, &run, &motion).expect("has its column");
    let form = &definition(Id::ForceSaturation).forms[0];
    assert!((form.columns)(&context, &[60.0]).is_none(), "a limit that nothing exceeds");
}

#[test]
fn play_takes_the_force_away_over_its_gap_after_a_reversal_only() {
    let run = rich(120_000);
    let motion = Motion::of(&run);
    let simulation = &simulations()[1];
    let context = Context::of(simulation, &run, &motion).expect("complete");
    let form = &definition(Id::CouplingBacklash).forms[0];
    let column = (form.columns)(&context, &[3e-4]).expect("turns").remove(0);
    let (mut open, mut first) = (0, true);
    for (n, x) in column.iter().enumerate() {
        assert!(*x == 0.0 || (*x + context.steady.force_n[n]).abs() < 1e-12);
        open += usize::from(*x != 0.0);
        first &= context.direction[n] == context.direction[0];
        assert!(!first || *x == 0.0, "{n}: before the first reversal");
    }
    assert!(open > 100, "{open}");
}

#[test]
fn play_opens_where_the_force_turns_and_be_it_before_the_carriage_does() {
    // a mass that is braked: at 0.1 m/s throughout, pushed until 1 s and held back from then on
    let run = recorded(400, 0.005, |t| if t < 1.0 { 10.0 } else { -10.0 });
    let taken = column(&run, Id::CouplingBacklash, 0, &[5e-3]);
    for (n, taken) in taken.iter().enumerate() {
        let since_s = n as f64 * 0.005 - 1.0;
        if (since_s - 0.05).abs() > 0.006 {
            let expected = if (-1e-9..0.05).contains(&since_s) { 10.0 } else { 0.0 };
            assert_eq!(*taken, expected, "{since_s} s");
        }
    }
}

#[test]
fn the_flank_is_not_known_before_the_first_row_in_a_rest_and_between_two_rows() {
    // strokes of 0.1 m there and back at 0.1 m/s, with rests of a second; the second one goes on the same way
    let at_m = |t: f64| match t {
        t if t < 1.0 => 0.1 * t,
        t if t < 2.0 => 0.1,
        t if t < 3.0 => 0.1 * (t - 1.0),
        t => 0.2 - 0.1 * (t - 3.0),
    };
    let time_s: Vec<f64> = (0..800).map(|n| 0.005 * f64::from(n)).collect();
    let run = Run {
        drag_force_n: vec![0.0; time_s.len()],
        position_m: Some(time_s.iter().map(|t| at_m(*t)).collect()),
        parts: vec![Part { rows: 0..time_s.len(), segment: None, starts: Break::Start }],
        time_s,
        ..Run::default()
    };
    let motion = Motion::of(&run);
    let context = Context::of(&simulations()[1], &run, &motion).expect("complete");
    let (since_m, least_m) = (context.since_push_m(), context.surely_since_push_m());
    let near = |x: f64, expected: f64| assert!((x - expected).abs() < 0.002, "{x} for {expected}");
    // 0.5 s: no flank was known at the start; 2.5 s: half a stroke since the rest, in which no row shows a change
    for (row, least) in [(100, 0.05), (500, 0.05)] {
        assert!(since_m[row] > 100.0, "{row}");
        near(least_m[row], least);
    }
    // 3.5 s: half a stroke since the reversal, which lies within one row
    near(since_m[700], 0.05);
    near(least_m[700], 0.05);
    assert!(since_m.iter().zip(&least_m).all(|(since, least)| least <= since));
    assert!(least_m[700] < since_m[700]);
}

#[test]
fn noise_of_the_speed_bends_the_law_as_its_second_derivative_says() {
    let run = rich(12_000);
    let motion = Motion::of(&run);
    let simulation = &simulations()[0];
    let context = Context::of(simulation, &run, &motion).expect("complete");
    let form = &definition(Id::SpeedNoise).forms[0];
    let columns = (form.columns)(&context, &[]).expect("curved");
    let (delta, mut worst) = (1e-4, 0.0f64);
    let shifted = |by: f64| {
        let mut other = motion.clone();
        for v in &mut other.velocity_m_s {
            *v += by * v.signum();
        }
        simulation.steady(&crate::law::Factors::default(), &run, &other).expect("complete").force_n
    };
    let (up, down) = (shifted(delta), shifted(-delta));
    for n in (0..run.len()).filter(|n| motion.velocity_m_s[*n].abs() > 5e-3) {
        let bend = (up[n] - 2.0 * context.steady.force_n[n] + down[n]) / (delta * delta);
        worst = worst.max((columns[0][n] + 0.5 * bend).abs() / (1.0 + bend.abs()));
        assert_eq!(columns[1][n], 0.0, "the measured speed has the right sign");
    }
    assert!(worst < 0.02, "{worst}");
}

#[test]
fn the_step_of_a_channel_is_read_from_its_values() {
    let of = |t: f64| 50.0 * t.sin();
    let mut run = recorded(7000, 1e-3, of);
    // counts of 0.305 N from 0.11 N on, written with three decimals
    run.drag_force_n =
        run.time_s.iter().map(|t| (((of(*t) / 0.305).round() * 0.305 + 0.11) * 1e3).round() / 1e3).collect();
    let error = column(&run, Id::ForceQuantisation, 0, &[1e-7]);
    for n in (0..7000).step_by(7) {
        let counted = of(run.time_s[n]) + error[n];
        let k = (counted - 0.11) / 0.305;
        assert!((k - k.round()).abs() < 0.01 && error[n].abs() < 0.16, "{n}: {counted}");
    }
    // with noise of a fifth of a step, against the mean over many draws
    let noisy = column(&run, Id::ForceQuantisation, 0, &[0.2]);
    let draws: Vec<f64> = (0..4000).map(|k| normal_quantile((f64::from(k) + 0.5) / 4000.0) * 0.2 * 0.305).collect();
    for n in (0..7000).step_by(701) {
        let force = of(run.time_s[n]);
        let mean = draws.iter().map(|e| ((force + e - 0.11) / 0.305).round() * 0.305 + 0.11).sum::<f64>() / 4000.0;
        assert!((force + noisy[n] - mean).abs() < 2e-3, "{n}: {} {mean}", force + noisy[n]);
    }
    run.drag_force_n = run.time_s.iter().map(|t| of(*t)).collect();
    let motion = Motion::of(&run);
    let simulation = simulation("");
    let context = Context::of(&simulation, &run, &motion).expect("has its column");
    let form = &definition(Id::ForceQuantisation).forms[0];
    assert!((form.columns)(&context, &[0.1]).is_none(), "values that do not repeat have no step");
}

/// Quantile of the standard normal distribution at a probability, by bisection.
fn normal_quantile(p: f64) -> f64 {
    let (mut low, mut high) = (-8.0, 8.0);
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if 0.5 * libm::erfc(-middle / std::f64::consts::SQRT_2) < p { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}
