//! Single mechanisms against their physics.

use super::*;
use crate::law::Factors;

/// The columns of the first form of this name.
fn columns(id: Id, form: &str, context: &Context<'_>, shape: &[f64]) -> Option<Columns> {
    let form = definition(id).forms.iter().find(|own| own.name == form).expect(form);
    (form.columns)(context, shape)
}

/// 1 kHz, with a velocity; at rest for the first and the last 0.2 s.
fn driven(seconds: f64, velocity: impl Fn(f64) -> f64) -> Run {
    let rows = (seconds * 1e3) as usize;
    let time_s: Vec<f64> = (0..rows).map(|n| n as f64 * 1e-3).collect();
    let rests = |t: f64| t < 0.2 || t > seconds - 0.2;
    let velocities: Vec<f64> = time_s.iter().map(|t| if rests(*t) { 0.0 } else { velocity(*t) }).collect();
    let mut x = 0.0;
    let positions = velocities.iter().scan(0.0, |before, v| {
        x += 0.5e-3 * (*before + v);
        *before = *v;
        Some(x)
    });
    Run {
        position_m: Some(positions.collect()),
        velocity_m_s: Some(velocities),
        drag_force_n: vec![0.0; rows],
        parts: vec![Part { rows: 0..rows, segment: None, starts: Break::Start }],
        time_s,
        ..Run::default()
    }
}

#[test]
fn seal_drag_is_the_same_against_both_directions_and_inertia_is_mass_times_acceleration() {
    let run = driven(4.0, |t| 0.1 * (3.0 * t).sin());
    let motion = Motion::of(&run);
    let context = Context::of(&simulations()[1], &run, &motion).expect("complete");
    let seal = columns(Id::SealDrag, "minimal", &context, &[]).expect("moves").remove(0);
    for (n, x) in seal.iter().enumerate() {
        let v = motion.velocity_m_s[n];
        assert_eq!(*x, if v.abs() < 3e-5 { 0.0 } else { v.signum() }, "{n}");
    }
    assert_eq!(columns(Id::Inertia, "minimal", &context, &[]), Some(vec![motion.acceleration_m_s2.clone()]));
}

/// Each half of the contacts is on Eq. 20 at its own load, whichever speed the Hersey number has.
#[test]
fn an_external_load_leaves_either_half_on_the_law_at_its_own_load() {
    // t = 0.6: W/F_p = 1.6^1.5 - 0.4^1.5
    let (up, down) = (1.6f64.powf(1.5), 0.4f64.powf(1.5));
    for hersey in ["slip", "carriage"] {
        let simulation = simulation(&format!(
            "[guide]\nhersey = \"{hersey}\"\ncontact_angle_mode = \"fixed\"\n[lubricant]\nviscosity_cst = 100\n\
             [operation]\npreload_n = 1000"
        ));
        for speed in [0.001, 0.02, 0.8] {
            let mut run = driven(2.0, |_| speed);
            run.external_load_n = Some(vec![(up - down) * 1000.0; run.len()]);
            let motion = Motion::of(&run);
            let context = Context::of(&simulation, &run, &motion).expect("complete");
            let column = columns(Id::ExternalLoad, "minimal", &context, &[]).expect("loaded").remove(0);
            let at = |load: f64| {
                let factors = Factors { preload: load, ..Factors::default() };
                simulation.steady(&factors, &run, &motion).expect("complete").force_n[1000]
            };
            let halves = 0.5 * (at(up) + at(down));
            let got = context.steady.force_n[1000] + column[1000];
            assert!((got / halves - 1.0).abs() < 1e-3, "{hersey} at {speed} m/s: {got} for {halves} N");
        }
    }
}

#[test]
fn an_external_load_acts_as_the_table_of_the_preloaded_contact_says() {
    // W/F_p and the factor on the drag where friction is proportional to load
    for (ratio, factor) in [(0.5, 1.011), (1.0, 1.042), (2.0, 1.18), (2.0 * 2f64.sqrt(), 1.414), (4.0, 2.0)] {
        let mut run = driven(2.0, |_| 0.1);
        run.external_load_n = Some(vec![-ratio * 3000.0; run.len()]);
        let motion = Motion::of(&run);
        let simulation = simulation(
            "[guide]\nmu_stribeck = 0\nmu_viscous = 0\ncontact_angle_mode = \"fixed\"\n[lubricant]\nviscosity_cst = 100\n\
             [operation]\npreload_n = 3000",
        );
        let context = Context::of(&simulation, &run, &motion).expect("complete");
        let column = columns(Id::ExternalLoad, "minimal", &context, &[]).expect("loaded").remove(0);
        let got = 1.0 + column[1000] / context.steady.force_n[1000];
        assert!((got - factor).abs() < 1.5e-3, "{ratio}: {got}");
    }
}

#[test]
fn oil_that_thins_is_the_law_with_the_oil_of_its_grade() {
    let run = rich(12_000);
    let motion = Motion::of(&run);
    let with_oil = simulation("[guide]\n[operation]\npreload_n = 3000");
    let constant = simulation("[guide]\n[lubricant]\nviscosity_cst = 100\n[operation]\npreload_n = 3000");
    let context = Context::of(&constant, &run, &motion).expect("complete");
    let truth = with_oil.steady(&Factors::default(), &run, &motion).expect("complete").force_n;
    let column = columns(Id::ViscosityTemperature, "minimal", &context, &[40.0]).expect("warm").remove(0);
    for n in 0..run.len() {
        let got = context.steady.force_n[n] + column[n];
        assert!((got - truth[n]).abs() < 1e-4 * (1.0 + truth[n].abs()), "{n}: {got} {}", truth[n]);
    }
    // a law that follows the temperature leaves nothing out
    let context = Context::of(&with_oil, &run, &motion).expect("complete");
    assert!(columns(Id::ViscosityTemperature, "minimal", &context, &[40.0]).is_none());
}

#[test]
fn preload_acts_as_the_law_with_another_preload() {
    let run = rich(12_000);
    let motion = Motion::of(&run);
    let constant = &simulations()[1];
    let context = Context::of(constant, &run, &motion).expect("complete");
    let less =
        constant.steady(&Factors { preload: 0.99, ..Factors::default() }, &run, &motion).expect("complete").force_n;
    let column = columns(Id::PreloadLoss, "minimal", &context, &[]).expect("travels").remove(0);
    for n in (0..run.len()).step_by(97).filter(|n| context.travel_m[*n] > 0.1) {
        // the amplitude for a loss of 1 % here, at this preload; at a lighter one the loss would be larger
        let amplitude = -0.01 * context.relative_load(n).powf(2.0 / 3.0) / context.travel_m[n];
        let got = context.steady.force_n[n] + amplitude * column[n];
        assert!((got - less[n]).abs() < 1e-4 * (1.0 + less[n].abs()), "{n}");
    }
}

#[test]
fn self_heating_follows_power_with_its_time_constant() {
    let run = driven(100.0, |_| 0.1);
    let motion = Motion::of(&run);
    let context = Context::of(&simulations()[1], &run, &motion).expect("complete");
    let column = columns(Id::SelfHeating, "minimal", &context, &[60.0]).expect("works").remove(0);
    for n in [10_000, 50_000, 99_000] {
        let power = 0.1 * context.steady.drag_n[n];
        let expected = power * -(-(run.time_s[n] - 0.2) / 60.0).exp_m1() * context.by_viscosity_n[n];
        assert!((column[n] / expected - 1.0).abs() < 1e-4, "{n}");
    }
}

#[test]
fn presliding_builds_up_over_its_length_and_remembers_unfinished_strokes() {
    // strokes of 2 mm, 0.5 Hz; then of 20 µm
    let long = driven(9.0, |t| 1e-3 * 3.0 * (3.0 * t).sin());
    let motion = Motion::of(&long);
    let context = Context::of(&simulations()[1], &long, &motion).expect("complete");
    let length = 1e-4;
    let column = columns(Id::Presliding, "minimal", &context, &[length]).expect("turns").remove(0);
    let mut checked = 0;
    for (n, x) in column.iter().enumerate().skip(3000) {
        let s = context.since_reversal_m[n];
        if s > 2e-5 && s < 5e-4 && context.steady.direction[n] != 0.0 {
            let expected = -2.0 * context.steady.force_n[n] * (-s / length).exp();
            assert!((x - expected).abs() < 0.03 * context.steady.drag_n[n], "{n}: {x} {expected}");
            checked += 1;
        }
    }
    assert!(checked > 500, "{checked}");
    let slip = columns(Id::Presliding, "maxwell-slip", &context, &[length]).expect("turns");
    let late = (3000..8800).filter(|n| context.steady.direction[*n] == -context.direction[*n]).count();
    assert!(late <= 6, "{late} rows in which the turn is seen late");
    for n in (3000..long.len()).filter(|n| context.steady.direction[*n] == context.direction[*n]) {
        let s = context.since_reversal_m[n];
        if s > 1.02 * length {
            assert!(slip.iter().all(|column| column[n].abs() < 1e-9), "{n}: all elements slip");
        } else if s > 0.35 * length && s < 0.55 * length {
            assert!(slip[1][n] == 0.0 && slip[3][n] * context.direction[n] < 0.0, "{n}: one by one");
        }
    }
    let short = driven(9.0, |t| 3e-5 * 3.0 * (3.0 * t).sin());
    let motion = Motion::of(&short);
    let context = Context::of(&simulations()[1], &short, &motion).expect("complete");
    let column = columns(Id::Presliding, "minimal", &context, &[1e-3]).expect("turns").remove(0);
    // strokes of 6 % of the presliding length: hardly any friction builds up, in either direction
    for n in (2500..8500).filter(|n| context.steady.direction[*n] != 0.0) {
        assert!((column[n] + context.steady.force_n[n]).abs() < 0.2 * context.steady.drag_n[n], "{n}");
    }
}

#[test]
fn breakaway_grows_with_the_rest_and_is_gone_after_a_length() {
    // three starts in one direction after rests of 0.2, 1 and 10 s
    let run = driven(16.0, |t| match t {
        t if t < 1.0 => 0.01,
        t if t < 2.0 => 0.0,
        t if t < 3.0 => 0.01,
        t if t < 13.0 => 0.0,
        _ => 0.01,
    });
    let motion = Motion::of(&run);
    let context = Context::of(&simulations()[1], &run, &motion).expect("complete");
    let column = columns(Id::BreakawayDwell, "minimal", &context, &[1e-3]).expect("rests").remove(0);
    for (start, rest) in [(200, 0.2f64), (2000, 1.0), (13_000, 10.0)] {
        let n = start + 100;
        let expected = context.steady.force_n[n] * (1.0 + rest).log10() * (-1.0f64).exp();
        assert!((column[n] / expected - 1.0).abs() < 0.1, "{rest}: {} {expected}", column[n]);
        assert!(column[start + 900].abs() < 0.01 * column[n].abs());
    }
    let moving = driven(4.0, |t| 0.1 + 0.05 * t.sin());
    let part = Part { rows: 0..3000, segment: None, starts: Break::Start };
    let cut = Run {
        time_s: moving.time_s[500..3500].to_vec(),
        position_m: moving.position_m.as_ref().map(|x| x[500..3500].to_vec()),
        velocity_m_s: moving.velocity_m_s.as_ref().map(|v| v[500..3500].to_vec()),
        drag_force_n: vec![0.0; 3000],
        parts: vec![part],
        ..Run::default()
    };
    let motion = Motion::of(&cut);
    let context = Context::of(&simulations()[1], &cut, &motion).expect("complete");
    assert!(columns(Id::BreakawayDwell, "minimal", &context, &[1e-3]).is_none());
    assert!(columns(Id::Presliding, "minimal", &context, &[1e-4]).is_none());
}

#[test]
fn ripples_are_sines_of_the_place() {
    let run = rich(12_000);
    let motion = Motion::of(&run);
    let context = Context::of(&simulations()[1], &run, &motion).expect("complete");
    let ripple = columns(Id::DriveRipple, "two-orders", &context, &[0.01]).expect("has a position");
    let balls = columns(Id::BallPass, "minimal", &context, &[0.0143]).expect("has a position");
    for n in (0..run.len()).step_by(31) {
        let angle = std::f64::consts::TAU * motion.position_m[n] / 0.01;
        for (column, expected) in
            ripple.iter().zip([angle.sin(), angle.cos(), (2.0 * angle).sin(), (2.0 * angle).cos()])
        {
            assert!((column[n] - expected).abs() < 1e-9, "{n}");
        }
        let angle = std::f64::consts::TAU * motion.position_m[n] / 0.0143;
        assert!((balls[0][n] - context.by_preload_n[n] * angle.sin()).abs() < 1e-7, "{n}");
    }
    assert!((2.0 * context.geometry.ball_pitch_m - 0.0143).abs() < 1e-5);
}

#[test]
fn a_place_that_the_stroke_does_not_reach_costs_nothing() {
    let run = rich(4000);
    let motion = Motion::of(&run);
    let context = Context::of(&simulations()[1], &run, &motion).expect("complete");
    let (least, most) =
        motion.position_m.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(*x), b.max(*x)));
    for id in [Id::RailJoint, Id::Contamination] {
        assert!(columns(id, "minimal", &context, &[0.5 * (least + most)]).is_some());
        assert!(columns(id, "minimal", &context, &[least - 0.06]).is_none());
        assert!(columns(id, "minimal", &context, &[most + 0.06]).is_none());
    }
}

#[test]
fn mixed_friction_is_for_laws_without_it() {
    let run = rich(4000);
    let motion = Motion::of(&run);
    for (k, simulation) in simulations().iter().enumerate() {
        let context = Context::of(simulation, &run, &motion).expect("complete");
        assert_eq!(columns(Id::Stribeck, "minimal", &context, &[0.01]).is_some(), k != 0, "{k}");
    }
}

/// Loads of 1:10 and an oil that thins, so that the speed alone does not say how thick the film is.
fn of_many_films() -> Run {
    let rows = 12_000;
    let preload_n = (0..rows).map(|n| 800.0 + 7200.0 * (n / 100 % 7) as f64 / 6.0).collect();
    Run { preload_n: Some(preload_n), ..rich(rows) }
}

#[test]
fn mixed_friction_that_a_law_lacks_is_that_of_eq_20() {
    let run = of_many_films();
    let motion = Motion::of(&run);
    let text = |k: f64| {
        simulation(&format!("[guide]\nmu_stribeck = {k}\nstribeck_exponent = 2e9\n[operation]\npreload_n = 3000"))
    };
    let (with, without) = (text(0.0016), text(0.0));
    let truth = with.steady(&Factors::default(), &run, &motion).expect("complete").force_n;
    let context = Context::of(&without, &run, &motion).expect("complete");
    let missing: Vec<f64> = truth.iter().zip(&context.steady.force_n).map(|(with, without)| with - without).collect();
    // the speed whose film makes the exponent 1, from the law's own Hersey number
    let speed = |n: usize| {
        let film = (context.relative_load(n)).cbrt() * context.steady.viscosity_cst[n] / 100.0;
        context.speed_m_s(n) * film / (2e9 * context.steady.hersey[n])
    };
    let fast = (0..run.len()).filter(|n| context.speed_m_s(*n) > 0.05).collect::<Vec<_>>();
    let column = columns(Id::Stribeck, "minimal", &context, &[speed(fast[0])]).expect("lacks it").remove(0);
    let largest = fast.iter().map(|n| column[*n].abs()).fold(0.0, f64::max);
    let amplitude =
        fast.iter().find(|n| column[**n].abs() == largest).map(|n| missing[*n] / column[*n]).expect("moves");
    for n in fast {
        let error = (amplitude * column[n] - missing[n]).abs();
        assert!(error < 0.01 * (amplitude * largest).abs(), "{n}: {} {}", amplitude * column[n], missing[n]);
    }
}

#[test]
fn shear_stress_saturates_with_the_hersey_number() {
    let run = of_many_films();
    let motion = Motion::of(&run);
    let context = Context::of(&simulations()[0], &run, &motion).expect("complete");
    let column = columns(Id::TractionSaturation, "minimal", &context, &[0.2]).expect("moves").remove(0);
    let moving = (0..run.len()).filter(|n| context.speed_m_s(*n) > 1e-3);
    let mut left: Vec<(f64, f64)> =
        moving.map(|n| (context.steady.hersey[n], 1.0 - column[n].abs() / context.viscous_n[n])).collect();
    left.sort_by(|a, b| a.0.total_cmp(&b.0));
    assert!(left[0].1 > 0.99 && left.last().expect("moves").1 < 0.6, "{:?} {:?}", left[0], left.last());
    for two in left.windows(2) {
        assert!(two[1].1 < two[0].1 + 0.01, "{two:?}");
    }
}
