//! Effects of a single channel, and effects without a name: neither is passed off as physics of the library.
#![allow(clippy::expect_used, clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use diagnosis::report::{Diagnosis, Verdict};
use diagnosis::{Options, Outcome, Refused, diagnose};
use simulation::Simulation;
use simulation::motion::Motion;
use simulation::profile::{Conditions, Course, Order, Staircase};
use simulation::run::{Break, Part, Run};
use simulation::sensor::Noise;

const GUIDE: &str = "schema = \"guideblock.simulation/1\"\n[guide]\nparameters = \"zhou-2023\"\n[lubricant]\n\
                     viscosity_cst = 100.0\n[operation]\npreload_n = 3000.0\n";

const USUAL: Conditions = Conditions { preload_n: Some(3000.0), temperature_degc: Some(40.0), external_load_n: None };

/// White noise of the force, N.
const NOISE_N: f64 = 0.3;

/// More than a minute of strokes at eight speeds, at 200 Hz.
fn strokes() -> Course {
    let speeds_m_s = vec![0.003, 0.006, 0.012, 0.025, 0.04, 0.06, 0.08, 0.1];
    Staircase { speeds_m_s, length_m: 0.15, order: Order::Both, ..Staircase::default() }.course(200.0, &USUAL).unwrap()
}

fn simulation(more: &str) -> Simulation {
    Simulation::from_toml(&format!("{GUIDE}{more}")).unwrap()
}

/// The law's force with noise plus a force against the motion, N: `brake` of time, speed and travel.
fn recorded(simulation: &Simulation, course: Course, brake: impl Fn(f64, f64, f64) -> f64) -> Run {
    let force = simulation.force(&course.run, &course.motion).unwrap();
    let mut noise = Noise::new(7, 0);
    let (mut travel_m, mut before) = (0.0, course.motion.position_m[0]);
    let mut drag_force_n = Vec::new();
    for (n, force) in force.iter().enumerate() {
        let (x, v) = (course.motion.position_m[n], course.motion.velocity_m_s[n]);
        travel_m += (x - before).abs();
        before = x;
        let braked = if v == 0.0 { 0.0 } else { v.signum() * brake(course.run.time_s[n], v.abs(), travel_m) };
        drag_force_n.push(force + braked + NOISE_N * noise.gaussian());
    }
    Run { drag_force_n, ..course.run }
}

fn nothing(_: f64, _: f64, _: f64) -> f64 {
    0.0
}

fn outcome(run: &Run, simulation: &Simulation) -> Outcome {
    diagnose(std::slice::from_ref(run), &[], simulation, &Options::default())
}

fn ids(diagnosis: &Diagnosis) -> Vec<&str> {
    diagnosis.mechanisms.iter().map(|found| found.id.as_str()).collect()
}

/// The only number of the only finding.
fn number(diagnosis: &Diagnosis) -> f64 {
    let [found] = diagnosis.mechanisms.as_slice() else { panic!("{:#?}", diagnosis.mechanisms) };
    let [number] = found.parameters.as_slice() else { panic!("{found:#?}") };
    assert!(number.ci95[0] < number.value && number.value < number.ci95[1], "{number:?}");
    number.value
}

/// Sum of the shares of the mismatch: those of the findings and the unexplained one.
fn shared_out(diagnosis: &Diagnosis) -> f64 {
    diagnosis.mechanisms.iter().map(|found| found.share_of_mismatch).sum::<f64>()
        + diagnosis.unexplained.share_of_mismatch
}

#[test]
fn a_channel_that_ends_is_named_its_rows_set_aside_and_not_found_again() {
    let simulation = simulation("");
    let mut run = recorded(&simulation, strokes(), nothing);
    let limit = 0.95 * run.drag_force_n.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    let clipped = run.drag_force_n.iter().filter(|x| x.abs() >= limit).count();
    run.drag_force_n.iter_mut().for_each(|x| *x = x.clamp(-limit, limit));
    let found = outcome(&run, &simulation);
    assert_eq!(ids(&found.diagnosis), ["force-saturation"]);
    assert!((number(&found.diagnosis) / limit - 1.0).abs() < 1e-9);
    assert!((shared_out(&found.diagnosis) - 1.0).abs() < 1e-9, "{}", shared_out(&found.diagnosis));
    assert_eq!(found.diagnosis.p_no_mismatch, 0.0);
    assert!(found.diagnosis.data_quality.rejected["near-an-end-of-the-force-channel"] >= clipped);
    let again = outcome(&run, &found.augmented.unwrap());
    assert_eq!(ids(&again.diagnosis), [""; 0]);
}

#[test]
fn a_step_is_named_where_it_is_coarser_than_the_noise_and_not_where_noise_carries_over_it() {
    let simulation = simulation("");
    let noisy = recorded(&simulation, strokes(), nothing);
    let counted = |step: f64| {
        let drag_force_n = noisy.drag_force_n.iter().map(|x| (x / step).round() * step).collect();
        outcome(&Run { drag_force_n, ..noisy.clone() }, &simulation).diagnosis
    };
    let coarse = counted(1.5);
    assert_eq!(ids(&coarse), ["force-quantisation"]);
    let step = &coarse.mechanisms[0].parameters[0];
    assert_eq!(step.name, "step_n");
    assert!((step.value / 1.5 - 1.0).abs() < 1e-6 && step.ci95[0] < 1.5 && 1.5 < step.ci95[1], "{step:?}");
    assert!((shared_out(&coarse) - 1.0).abs() < 1e-9, "{}", shared_out(&coarse));
    assert_eq!(ids(&counted(0.2)), [""; 0]);
}

#[test]
fn a_recorded_speed_that_only_adds_noise_is_set_aside_and_said_so() {
    let simulation = simulation("[axis]\nmoved_mass_kg = 10.0\n");
    let of = |noise_m_s: f64| {
        let course = strokes();
        let mut noise = Noise::new(3, 0);
        let recorded_speed = course.motion.velocity_m_s.iter().map(|v| v + noise_m_s * noise.gaussian()).collect();
        let run = Run { acceleration_m_s2: None, ..recorded(&simulation, course, nothing) };
        outcome(&Run { velocity_m_s: Some(recorded_speed), ..run }, &simulation).diagnosis
    };
    let noisy = of(1e-3);
    assert_eq!(ids(&noisy), ["speed-noise"]);
    assert!((number(&noisy).sqrt() / 1e-3 - 1.0).abs() < 0.05, "{}", number(&noisy).sqrt());
    assert!(noisy.data_quality.warnings.iter().any(|line| line.contains("recorded speed")), "{:?}", noisy.data_quality);
    assert_eq!(ids(&of(0.0)), [""; 0]);
}

#[test]
fn a_speed_in_another_unit_is_refused_and_not_taken_for_noise() {
    let simulation = simulation("[axis]\nmoved_mass_kg = 40.0\n");
    let course = strokes();
    let velocity_m_s = Some(course.motion.velocity_m_s.iter().map(|v| 1e3 * v).collect());
    let run = Run { velocity_m_s, ..recorded(&simulation, course, nothing) };
    let found = outcome(&run, &simulation).diagnosis;
    assert_eq!(ids(&found), [""; 0]);
    let warnings = &found.data_quality.warnings;
    assert!(warnings.iter().any(|line| line.contains("m/s")), "{warnings:?}");
}

/// Times in minutes make speeds of a few metres per second, which a carriage may have; the acceleration knows better.
#[test]
fn times_in_minutes_are_told_by_the_acceleration() {
    let simulation = simulation("");
    let course = strokes();
    let acceleration_m_s2 = Some(course.motion.acceleration_m_s2.clone());
    let run = Run { acceleration_m_s2, velocity_m_s: None, ..recorded(&simulation, course, nothing) };
    assert_eq!(outcome(&run, &simulation).diagnosis.verdict, Verdict::Match);
    let time_s = run.time_s.iter().map(|t| t / 60.0).collect();
    let found = outcome(&Run { time_s, ..run }, &simulation).diagnosis;
    assert_eq!((found.verdict, ids(&found).len()), (Verdict::InsufficientData, 0), "{found:#?}");
    let warnings = &found.data_quality.warnings;
    assert!(warnings.iter().any(|line| line.contains("time in minutes is 3600")), "{warnings:?}");
}

#[test]
fn a_clamp_on_another_machine_s_clock_is_unknown_with_its_period() {
    let simulation = simulation("");
    let period_s = 5.37;
    let clamp = |t: f64, _: f64, _: f64| if t.rem_euclid(period_s) < 0.35 * period_s { 0.8 } else { 0.0 };
    let found = outcome(&recorded(&simulation, strokes(), clamp), &simulation).diagnosis;
    assert_eq!(ids(&found), ["unknown"]);
    let [place] = found.regions.as_slice() else { panic!("{:?}", found.regions) };
    assert_eq!((place.axis, place.unit), ("frequency", "Hz"));
    assert!((place.from * period_s - 1.0).abs() < 5e-3, "{place:?}");
    assert!(found.holdout.rmse_after_n < 0.7 * found.holdout.rmse_calibrated_n, "{:?}", found.holdout);
}

#[test]
fn a_clamp_is_heard_above_noise_that_remembers_and_that_noise_is_none() {
    let simulation = simulation("");
    let period_s = 5.37;
    let of = |height_n: f64| {
        let clamp = |t: f64, _: f64, _: f64| if t.rem_euclid(period_s) < 0.35 * period_s { height_n } else { 0.0 };
        let mut run = recorded(&simulation, strokes(), clamp);
        // noise correlated over tenths of a second and over seconds
        let mut noise = Noise::new(31, 0);
        let (mut slow, mut slower) = (0.0, 0.0);
        for force in &mut run.drag_force_n {
            slow = 0.97 * slow + 0.24 * noise.gaussian();
            slower = 0.998 * slower + 0.06 * noise.gaussian();
            *force += NOISE_N * (slow + slower);
        }
        outcome(&run, &simulation).diagnosis
    };
    let found = of(1.0);
    assert_eq!(ids(&found), ["unknown"]);
    let [place] = found.regions.as_slice() else { panic!("{:?}", found.regions) };
    assert!((place.from * period_s - 1.0).abs() < 5e-3, "{place:?}");
    assert_eq!(ids(&of(0.0)), [""; 0]);
}

#[test]
fn what_goes_with_the_time_of_a_recording_is_scored_there_and_not_carried_to_another() {
    let simulation = simulation("");
    let bump = |t: f64, _: f64, _: f64| 1.5 * (-((t - 60.0) / 20.0).powi(2)).exp();
    let run = recorded(&simulation, strokes(), bump);
    let own = outcome(&run, &simulation).diagnosis;
    assert_eq!(ids(&own), ["unknown"]);
    assert_eq!(own.regions[0].axis, "time");
    assert!(own.holdout.rmse_after_n < 0.95 * own.holdout.rmse_calibrated_n, "{:?}", own.holdout);
    let other = recorded(&simulation, strokes(), nothing);
    let both = diagnose(std::slice::from_ref(&run), std::slice::from_ref(&other), &simulation, &Options::default());
    let holdout = &both.diagnosis.holdout;
    assert_eq!(ids(&both.diagnosis), ["unknown"]);
    assert_eq!(holdout.rmse_after_n.to_bits(), holdout.rmse_calibrated_n.to_bits(), "{holdout:?}");
    assert_eq!(both.diagnosis.mechanisms[0].carried_over, None);
}

#[test]
fn a_force_that_no_cause_of_the_library_follows_gets_no_name() {
    let simulation = simulation("");
    // air drag, with the square of speed: it rises faster with speed than seals or grease
    let air = |_: f64, v: f64, _: f64| 200.0 * v * v;
    let found = outcome(&recorded(&simulation, strokes(), air), &simulation).diagnosis;
    assert_eq!(ids(&found), ["unknown"]);
    // a wiper that touches at random, for some tenths of a second
    let mut draws = Noise::new(21, 0);
    let touches: Vec<bool> = (0..2000).map(|_| draws.gaussian() > 0.8).collect();
    let wiper = |t: f64, _: f64, _: f64| if touches[(t / 0.7) as usize % touches.len()] { 1.5 } else { 0.0 };
    let found = outcome(&recorded(&simulation, strokes(), wiper), &simulation).diagnosis;
    assert_eq!(ids(&found), ["unknown"]);
    // no curve can follow it: the exported law is the calibrated one
    assert_eq!(found.holdout.rmse_after_n.to_bits(), found.holdout.rmse_calibrated_n.to_bits(), "{:?}", found.holdout);
}

#[test]
fn dirt_brakes_over_one_length_and_what_pushes_as_often_is_no_dirt() {
    let simulation = simulation("");
    let mut draws = Noise::new(5, 0);
    let mut places_m = vec![0.02];
    while places_m.len() < 300 {
        places_m.push(places_m[places_m.len() - 1] + 0.02 + 0.03 * draws.gaussian().abs());
    }
    // 1 mm of travel each: no place repeats
    let hit = |travel_m: f64| places_m.iter().position(|place| (travel_m - place).abs() < 5e-4);
    let dirt = |_: f64, _: f64, travel_m: f64| hit(travel_m).map_or(0.0, |_| 6.0);
    let found = outcome(&recorded(&simulation, strokes(), dirt), &simulation).diagnosis;
    assert_eq!(ids(&found), ["contamination"]);
    let both = |_: f64, _: f64, travel_m: f64| hit(travel_m).map_or(0.0, |k| if k % 2 == 0 { 6.0 } else { -6.0 });
    let found = outcome(&recorded(&simulation, strokes(), both), &simulation).diagnosis;
    assert!(!ids(&found).contains(&"contamination"), "{:?}", ids(&found));
}

/// Pulses of this height, N, and length, m of travel, at places that do not repeat: even ones brake, odd ones act `odd`
/// times as much.
fn dirt(height_n: f64, length_m: f64, odd: f64) -> impl Fn(f64, f64, f64) -> f64 {
    let mut draws = Noise::new(5, 0);
    let mut places_m = vec![0.02];
    while places_m.len() < 300 {
        places_m.push(places_m[places_m.len() - 1] + 0.02 + 0.03 * draws.gaussian().abs());
    }
    move |_, _, travel_m| {
        let near = |place: &f64| (1.0 - 2.0 * (travel_m - place).abs() / length_m).max(0.0);
        let hit = places_m.iter().position(|place| near(place) > 0.0);
        hit.map_or(0.0, |k| near(&places_m[k]) * height_n * if k % 2 == 0 { 1.0 } else { odd })
    }
}

#[test]
fn dirt_whose_single_rows_do_not_stand_out_is_found_by_its_shape() {
    let simulation = simulation("");
    // no row is beyond 3 standard deviations of the noise
    let found = outcome(&recorded(&simulation, strokes(), dirt(3.0 * NOISE_N, 2e-3, 1.0)), &simulation).diagnosis;
    assert_eq!(ids(&found), ["contamination"]);
    let [_, length, height] = found.mechanisms[0].parameters.as_slice() else { panic!("{:?}", found.mechanisms) };
    assert!((1e-3..3e-3).contains(&length.value), "{length:?}");
    assert!((0.5..2.0).contains(&(height.value / (3.0 * NOISE_N))), "{height:?}");
}

/// Noise of just over half a step does not always dither the force across it, and a stretch of one count more has the
/// length of a spot.
#[test]
fn spots_of_one_count_of_the_channel_are_no_dirt() {
    let simulation = simulation("");
    let step_n = 1.8 * NOISE_N;
    let counted = |height_n: f64| {
        let mut run = recorded(&simulation, strokes(), dirt(height_n, 2e-3, 1.0));
        run.drag_force_n.iter_mut().for_each(|force| *force = (*force / step_n).round() * step_n);
        ids(&outcome(&run, &simulation).diagnosis).contains(&"contamination")
    };
    assert!(counted(3.0 * step_n) && !counted(1.2 * step_n));
}

#[test]
fn few_spots_are_dirt_if_they_are_high_and_none_as_high_pushes() {
    let simulation = simulation("");
    let all = dirt(15.0 * NOISE_N, 2e-3, 1.0);
    let sparse = |travel_m: f64| if travel_m % 1.2 < 0.1 { all(0.0, 0.0, travel_m) } else { 0.0 };
    let rolled = |_: f64, _: f64, travel_m: f64| sparse(travel_m);
    let found = outcome(&recorded(&simulation, strokes(), rolled), &simulation).diagnosis;
    assert_eq!(ids(&found), ["contamination"]);
    // pulses within one stretch push instead of braking
    let one =
        |_: f64, _: f64, travel_m: f64| sparse(travel_m) * if (1.2..1.3).contains(&travel_m) { -1.0 } else { 1.0 };
    let found = outcome(&recorded(&simulation, strokes(), one), &simulation).diagnosis;
    assert!(!ids(&found).contains(&"contamination"), "{:?}", ids(&found));
}

/// At one speed a length is a duration: dirt is the more likely cause, and the report says what would decide it.
#[test]
fn dirt_at_one_speed_is_named_with_less_confidence() {
    let simulation = simulation("");
    let course = Staircase { speeds_m_s: vec![0.06; 12], length_m: 0.2, order: Order::Both, ..Staircase::default() };
    let course = course.course(1000.0, &USUAL).unwrap();
    let found = outcome(&recorded(&simulation, course, dirt(5.0 * NOISE_N, 1.5e-3, 1.0)), &simulation).diagnosis;
    assert_eq!(ids(&found), ["contamination"]);
    assert!(found.mechanisms[0].confidence < 0.9 && found.mechanisms[0].statement.contains("run at another"));
}

#[test]
fn tails_of_either_sign_and_spikes_of_one_duration_are_no_dirt() {
    let simulation = simulation("");
    let pushing = dirt(3.0 * NOISE_N, 2e-3, -1.0);
    let found = outcome(&recorded(&simulation, strokes(), pushing), &simulation).diagnosis;
    assert!(!ids(&found).contains(&"contamination"), "{:?}", ids(&found));
    for (spike_n, skewed) in [(8.0, false), (8.0, true)] {
        let mut draws = Noise::new(33, 0);
        // outliers of any size, one row in a hundred
        let tails: Vec<f64> = (0..20_000)
            .map(|_| if draws.gaussian() > 2.33 { spike_n * NOISE_N * draws.gaussian() } else { 0.0 })
            .map(|x| if skewed { x.abs() } else { x })
            .collect();
        let spikes = |t: f64, _: f64, _: f64| tails[(t * 200.0).round() as usize % tails.len()];
        let found = outcome(&recorded(&simulation, strokes(), spikes), &simulation).diagnosis;
        assert!(!ids(&found).contains(&"contamination"), "{skewed}: {:?}", ids(&found));
    }
}

#[test]
fn what_does_not_carry_over_is_said_to_make_things_worse() {
    let simulation = simulation("");
    let dragging = recorded(&simulation, strokes(), |_, _, _| 3.0);
    let clean = recorded(&simulation, strokes(), nothing);
    let warnings = |holdout: Run| {
        let outcome = diagnose(std::slice::from_ref(&dragging), &[holdout], &simulation, &Options::default());
        outcome.diagnosis.data_quality.warnings
    };
    let is_said = |warnings: Vec<String>| warnings.iter().any(|line| line.contains("does not carry over"));
    assert!(is_said(warnings(clean)));
    assert!(!is_said(warnings(dragging.clone())));
}

/// Time in minutes makes speeds 60 times as high, but slow strokes then still look like a fast carriage: the mean
/// passes.
#[test]
fn a_time_in_minutes_is_no_recording_of_a_carriage() {
    let simulation = simulation("");
    let speeds_m_s = vec![0.05, 0.1, 0.2, 0.3];
    let course = Staircase { speeds_m_s, length_m: 0.3, order: Order::Both, ..Staircase::default() };
    let mut run = recorded(&simulation, course.course(200.0, &USUAL).unwrap(), nothing);
    run.velocity_m_s = None;
    run.acceleration_m_s2 = None;
    let read = outcome(&run, &simulation).diagnosis;
    assert_eq!(read.verdict, Verdict::Match, "{:?}", read.data_quality.warnings);
    run.time_s.iter_mut().for_each(|t| *t /= 60.0);
    let Outcome { diagnosis, refused, .. } = outcome(&run, &simulation);
    assert_eq!(diagnosis.verdict, Verdict::InsufficientData);
    assert!(diagnosis.data_quality.warnings.iter().any(|line| line.contains("the unit of time")), "{diagnosis:?}");
    assert!(matches!(refused, Some(Refused::File(_))), "{refused:?}");
}

#[test]
fn a_force_without_its_sign_is_asked_about() {
    let simulation = simulation("");
    let signed = recorded(&simulation, strokes(), nothing);
    let asks = |change: fn(f64) -> f64| {
        let mut run = signed.clone();
        run.drag_force_n.iter_mut().for_each(|force| *force = change(*force));
        outcome(&run, &simulation).diagnosis.data_quality.warnings.iter().any(|line| line.contains("is it a magnitude"))
    };
    assert!(asks(f64::abs) && asks(|force| -force.abs()));
    // a force with one sign is legal, too: a weight on the carriage beside friction in both directions
    assert!(!asks(|force| force) && !asks(|force| force + 60.0));
}

#[test]
fn calibration_does_not_follow_what_the_law_cannot_know() {
    // preload and friction compensate each other, and the block is off by more than either tolerance
    let simulation = simulation("[tolerance]\npreload = 0.05\nfriction = 0.03\nviscosity = 0.05\n");
    for (percent, spike_n) in [(0.0, 8.0), (12.0, 0.0), (12.0, 8.0)] {
        let course = strokes();
        let law = simulation.force(&course.run, &course.motion).unwrap();
        let mut run = recorded(&simulation, course, nothing);
        let turns = run.position_m.clone().unwrap();
        let mut since_m = 1.0;
        for n in 2..law.len() {
            run.drag_force_n[n] += percent / 100.0 * law[n];
            let step = turns[n] - turns[n - 1];
            since_m =
                if step * (turns[n - 1] - turns[n - 2]) < 0.0 || step == 0.0 { 0.0 } else { since_m + step.abs() };
            // missing friction after a reversal
            run.drag_force_n[n] -= spike_n * step.signum() * (-since_m / 2e-3f64).exp();
        }
        let held = outcome(&run, &simulation).diagnosis.holdout;
        assert!(held.rmse_calibrated_n < 1.02 * held.rmse_before_n, "{percent} % and {spike_n} N: {held:?}");
    }
}

#[test]
fn the_interval_of_a_number_that_is_off_knows_of_those_beside_it() {
    let simulation = simulation("[tolerance]\npreload = 0.05\nfriction = 0.03\nviscosity = 0.05\n");
    for percent in [-40.0, -35.0, -30.0, 40.0, 60.0, 80.0] {
        let course = strokes();
        let law = simulation.force(&course.run, &course.motion).unwrap();
        let mut run = recorded(&simulation, course, nothing);
        run.drag_force_n.iter_mut().zip(&law).for_each(|(force, law)| *force += percent / 100.0 * law);
        let found = outcome(&run, &simulation).diagnosis;
        assert_eq!(ids(&found), ["parameter-shift"], "{percent} %");
        for number in &found.mechanisms[0].parameters {
            // at one preload, an error of the preload within its tolerance cannot be told from friction
            let [low, high] = number.ci95;
            assert!(high - low > 0.02 && low * percent > 0.0 && high * percent > 0.0, "{percent} %: {number:?}");
        }
    }
}

/// At a constant temperature its effect is a constant: nothing tells it from an error of the viscosity itself.
#[test]
fn a_viscosity_that_is_off_is_no_effect_of_a_temperature_that_does_not_change() {
    let assumed = simulation("");
    for viscosity_cst in [50.0, 250.0] {
        let given = GUIDE.replace("viscosity_cst = 100.0", &format!("viscosity_cst = {viscosity_cst}"));
        let oil = Simulation::from_toml(&given).unwrap();
        let course = Staircase::default().course(50.0, &Conditions { temperature_degc: Some(30.0), ..USUAL }).unwrap();
        let run = recorded(&oil, course, nothing);
        let found = outcome(&run, &assumed).diagnosis;
        assert_eq!(ids(&found), ["parameter-shift"], "{viscosity_cst} cSt");
        assert_eq!(found.mechanisms[0].parameters[0].name, "viscosity", "{viscosity_cst} cSt");
        assert!(
            found.holdout.rmse_calibrated_n <= found.holdout.rmse_before_n,
            "{viscosity_cst} cSt: {:?}",
            found.holdout
        );
        let off = viscosity_cst / 100.0 - 1.0;
        assert!((number(&found) - off).abs() < 0.1 * off.abs(), "{viscosity_cst} cSt: {}", number(&found));
    }
}

/// A law far off, with two numbers that nearly imitate each other: the rounding of cells decides where a linear step
/// leads, and must not decide what is found.
#[test]
fn a_law_that_is_far_off_is_never_a_match_however_its_cells_are_rounded() {
    let simulation = simulation("[tolerance]\npreload = 0.05\nfriction = 0.03\nviscosity = 0.05\n");
    let clean = recorded(&simulation, strokes(), nothing);
    for factor in [1.3, 0.5] {
        for step_n in [1e-3, 1e-4] {
            let mut run = clean.clone();
            run.drag_force_n.iter_mut().for_each(|force| *force = (factor * *force / step_n).round() * step_n);
            let found = outcome(&run, &simulation).diagnosis;
            assert!(!found.mechanisms.is_empty(), "{factor}, {step_n} N");
            assert!(
                found.mechanisms.iter().all(|m| m.id == "parameter-shift"),
                "{factor}, {step_n} N: {:?}",
                ids(&found)
            );
            let held = &found.holdout;
            assert!(found.p_no_mismatch < 1e-3, "{factor}, {step_n} N: {}", found.p_no_mismatch);
            assert!(held.rmse_after_n < 1.1 * found.noise_floor_n, "{factor}, {step_n} N: {held:?}");
            let numbers = found.mechanisms.iter().flat_map(|m| &m.parameters);
            assert!(numbers.flat_map(|number| number.ci95).all(f64::is_finite), "{factor}, {step_n} N");
        }
    }
}

/// A column of another program, read as if for another preload.
#[test]
fn a_simulation_that_stays_far_from_the_force_is_never_a_match() {
    let law = simulation("");
    let course = Staircase::default().course(20.0, &USUAL).unwrap();
    let simulated_force_n = Some(law.force(&course.run, &course.motion).unwrap());
    let mut run = Run { simulated_force_n, ..recorded(&law, course, nothing) };
    for (force, law) in run.drag_force_n.iter_mut().zip(run.simulated_force_n.iter().flatten()) {
        *force = law + 0.2 * (*force - law);
    }
    for preload in [14.0, 20.0] {
        let off = format!("schema = \"guideblock.simulation/1\"\n[simulated_force]\npreload = {preload}\n");
        let found = outcome(&run, &Simulation::from_toml(&off).unwrap()).diagnosis;
        let held = &found.holdout;
        assert!(held.rmse_after_n < 3.0 * found.noise_floor_n || found.verdict != Verdict::Match, "{held:?}");
        assert!(found.p_no_mismatch < 1e-3);
    }
}

/// Preload, friction and viscosity nearly compensate each other: an error of 4 % in one used to be named as 12 % of the
/// other sign, and another one was left off by 30 of its tolerances.
#[test]
fn a_number_that_is_off_takes_none_of_those_beside_it_out_of_their_tolerance() {
    let simulation = simulation("[tolerance]\npreload = 0.004\nfriction = 0.004\nviscosity = 0.004\n");
    for percent in [-5.0, -4.0, -3.0, 3.0, 4.0, 5.0] {
        let course = strokes();
        let law = simulation.force(&course.run, &course.motion).unwrap();
        let mut run = recorded(&simulation, course, nothing);
        run.drag_force_n.iter_mut().zip(&law).for_each(|(force, law)| *force += percent / 100.0 * law);
        let found = outcome(&run, &simulation).diagnosis;
        assert_eq!(ids(&found), ["parameter-shift"], "{percent} %");
        let [number] = found.mechanisms[0].parameters.as_slice() else { panic!("{percent} %: {found:#?}") };
        let [low, high] = number.ci95;
        // as uncertain as the tolerances of the others, and no more
        assert!(low < percent / 100.0 && percent / 100.0 < high && high - low < 0.05, "{percent} %: {number:?}");
    }
}

/// Slow strokes in one direction, and a force sensor with an offset: two numbers of the law together come near it.
#[test]
fn one_fault_of_the_sensor_is_not_two_numbers_of_the_law() {
    let simulation = simulation("[tolerance]\npreload = 0.003\nfriction = 0.003\nviscosity = 0.01\n");
    let slow = Staircase { speeds_m_s: vec![0.005, 0.01, 0.012], length_m: 0.6, strokes: 3, ..Staircase::default() };
    let whole = recorded(&simulation, slow.course(200.0, &USUAL).unwrap(), nothing);
    let position_m = whole.position_m.clone().unwrap();
    let forwards: Vec<usize> = (1..whole.len()).filter(|n| position_m[*n] > position_m[n - 1]).collect();
    let mut parts: Vec<Part> = Vec::new();
    for (row, n) in forwards.iter().enumerate() {
        match parts.last_mut().filter(|_| forwards[row - 1] + 1 == *n) {
            Some(part) => part.rows.end = row + 1,
            None => parts.push(Part { rows: row..row + 1, segment: None, starts: Break::Gap }),
        }
    }
    parts[0].starts = Break::Start;
    let cut = |column: &Vec<f64>| forwards.iter().map(|n| column[*n]).collect::<Vec<f64>>();
    for offset_n in [-2.0, -1.5, 1.5] {
        let run = Run {
            time_s: cut(&whole.time_s),
            drag_force_n: cut(&whole.drag_force_n).into_iter().map(|force| force + offset_n).collect(),
            position_m: Some(cut(&position_m)),
            preload_n: whole.preload_n.as_ref().map(cut),
            temperature_block_degc: whole.temperature_block_degc.as_ref().map(cut),
            parts: parts.clone(),
            ..Run::default()
        };
        let found = outcome(&run, &simulation).diagnosis;
        let [named] = found.mechanisms.as_slice() else { panic!("{offset_n} N: {found:#?}") };
        let set: Vec<&str> = std::iter::once(&named.id).chain(&named.equivalents).map(String::as_str).collect();
        assert!(set.contains(&"force-offset") && set.contains(&"gravity-tilt"), "{offset_n} N: {set:?}");
    }
}

/// Strokes to and fro without rests, at 500 Hz; each entry: period in s, half a stroke in m.
fn to_and_fro(strokes: &[(f64, f64)]) -> Course {
    let (rate_hz, seconds) = (500.0, 20.0);
    let rows = (seconds * rate_hz) as usize;
    let position = |n: usize| {
        let (period_s, half_m) = strokes[n / rows];
        0.3 + half_m * (1.0 - (std::f64::consts::TAU * (n % rows) as f64 / rate_hz / period_s).cos())
    };
    let all = rows * strokes.len();
    let run = Run {
        time_s: (0..all).map(|n| n as f64 / rate_hz).collect(),
        position_m: Some((0..all).map(|n| (position(n) * 1e7).round() / 1e7).collect()),
        drag_force_n: vec![0.0; all],
        parts: vec![Part { rows: 0..all, segment: None, starts: Break::Start }],
        ..Run::default()
    };
    let motion = Motion::of(&run);
    Course { run, motion }
}

/// The force of a drive that keeps its force while the carriage rests, as `channel` distorts it.
fn held(run: &Run, moving: &[f64], channel: impl Fn(&[f64]) -> Vec<f64>) -> Run {
    let mut last = moving.iter().copied().find(|force| *force != 0.0).unwrap_or(0.0);
    let held: Vec<f64> = moving
        .iter()
        .map(|force| {
            last = if *force == 0.0 { last } else { *force };
            last
        })
        .collect();
    let mut noise = Noise::new(7, 0);
    let drag_force_n = channel(&held).iter().map(|force| force + NOISE_N * noise.gaussian()).collect();
    Run { drag_force_n, ..run.clone() }
}

#[test]
fn a_force_that_is_late_by_rows_is_late_and_no_noise_at_the_turns() {
    let simulation = simulation("");
    let course = to_and_fro(&[(10.0, 0.1), (5.0, 0.1), (2.0, 0.08), (1.0, 0.05)]);
    let force = simulation.force(&course.run, &course.motion).unwrap();
    for rows in [5, 15] {
        let late = |force: &[f64]| (0..force.len()).map(|n| force[n.saturating_sub(rows)]).collect();
        let found = outcome(&held(&course.run, &force, late), &simulation).diagnosis;
        let first = &found.mechanisms[0];
        assert_eq!(first.id, "time-misalignment", "{found:#?}");
        let delay = first.parameters.iter().find(|parameter| parameter.name == "delay_s").unwrap();
        assert!((delay.value - rows as f64 / 500.0).abs() < 1e-3, "{delay:?}");
        assert!(found.holdout.rmse_after_n < 0.25 * found.holdout.rmse_calibrated_n, "{:?}", found.holdout);
    }
}

#[test]
fn a_filter_is_found_where_the_drive_holds_its_force_at_rest() {
    let simulation = simulation("");
    let course = strokes();
    let force = simulation.force(&course.run, &course.motion).unwrap();
    let filtered = |force: &[f64]| {
        let (mut y, keep) = (force[0], (-0.005f64 / 0.02).exp());
        let next = |u: &f64| {
            y = keep * y + (1.0 - keep) * u;
            y
        };
        force.iter().map(next).collect()
    };
    let found = outcome(&held(&course.run, &force, filtered), &simulation).diagnosis;
    assert_eq!(ids(&found), ["force-lowpass"], "{found:#?}");
    let time = found.mechanisms[0].parameters.iter().find(|parameter| parameter.name == "time_s").unwrap();
    assert!((time.value / 0.02 - 1.0).abs() < 0.2, "{time:?}");
}

/// Along a stroke the force hardly changes with time: a late force shows only where the stroke starts and stops.
#[test]
fn a_force_that_is_late_is_late_although_the_law_hardly_changes_along_the_stroke() {
    let simulation = simulation("[tolerance]\nrelevance = 0.02\n");
    let speeds_m_s = vec![0.02, 0.03, 0.04, 0.05, 0.06, 0.08];
    let with_rests = Staircase { speeds_m_s, length_m: 0.15, pause_s: 1.0, order: Order::Both, ..Staircase::default() };
    let mut run = recorded(&simulation, with_rests.course(200.0, &USUAL).unwrap(), nothing);
    let on_time = outcome(&run, &simulation).diagnosis;
    assert_eq!(ids(&on_time), [""; 0], "{on_time:#?}");
    run.drag_force_n.rotate_right(1);
    let late = outcome(&run, &simulation).diagnosis;
    assert_eq!(ids(&late), ["time-misalignment"], "{late:#?}");
    assert!((number(&late) - 0.005).abs() < 1e-3, "{late:#?}");
}
