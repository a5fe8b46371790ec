//! Dirt in the contacts: short, braking, at places that do not repeat, and nothing else that is short.
#![allow(clippy::expect_used, clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

mod common;

use simulation::profile::{Order, Staircase};
use simulation::sensor::Noise;

use crate::common::{NOISE_N, USUAL, ids, outcome, recorded, simulation, strokes};

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
    assert!(found.mechanisms[0].confidence < 0.9 && found.mechanisms[0].statement.contains("run slower"));
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

/// At 50 rows a second no spot lasts for three rows: a length is all but a duration, and yet all of them brake.
#[test]
fn dirt_of_two_rows_is_named_with_less_confidence() {
    let simulation = simulation("");
    let speeds_m_s = vec![0.05, 0.08];
    let course = Staircase { speeds_m_s, length_m: 1.0, order: Order::Both, ..Staircase::default() };
    let course = course.course(50.0, &USUAL).unwrap();
    let found = outcome(&recorded(&simulation, course, dirt(6.0 * NOISE_N, 2e-3, 1.0)), &simulation).diagnosis;
    assert_eq!(ids(&found), ["contamination"]);
    assert!(found.mechanisms[0].confidence < 0.9 && found.mechanisms[0].statement.contains("run slower"));
}

const PLAY: &str = "\n[[mechanism]]\nid = \"coupling-backlash\"\nform = \"minimal\"\ngap_m = 2e-4\npart = 1.0\n";

/// Play takes the whole force of many rows, and dirt has next to nothing of such a mismatch.
#[test]
fn dirt_is_seen_beside_play() {
    let (simulation, with_play) = (simulation(""), simulation(PLAY));
    let found = outcome(&recorded(&with_play, strokes(), dirt(3.5 * NOISE_N, 1e-3, 1.0)), &simulation).diagnosis;
    assert_eq!(ids(&found), ["coupling-backlash", "contamination"]);
    assert!(found.mechanisms[1].share_of_mismatch < 0.005, "{:?}", found.mechanisms);
}
