use super::*;

fn all() -> Vec<(&'static str, Box<dyn Profile>)> {
    let speeds: Vec<f64> = SPEEDS_M_MIN.iter().map(|v| v / 60.0).collect();
    vec![
        (
            "ladder",
            Box::new(Ladder {
                preloads_n: vec![1000.0, 5000.0],
                speeds_m_s: speeds.clone(),
                stroke_m: 0.04,
                repeats: 1,
                and_down: true,
            }),
        ),
        ("map", Box::new(Map { speeds_m_s: vec![0.01, 0.1], length_m: 0.5, repeats: 2 })),
        (
            "reversal",
            Box::new(Reversal { amplitudes_m: vec![1e-5, 2e-3], frequencies_hz: vec![0.05, 0.5], periods: 3 }),
        ),
        ("modulation", Box::new(Modulation { speed_m_s: 0.0537, frequencies_hz: vec![0.13, 1.0], periods: 3 })),
        ("dwell", Box::new(Dwell { dwells_s: vec![1.0, 10.0], speed_m_s: 0.1 / 60.0, stroke_m: 0.005, repeats: 2 })),
        ("warm-up", Box::new(WarmUp { speed_m_s: 0.1, stroke_m: 0.3, duration_s: 200.0, ambient_degc: 22.0 })),
    ]
}

/// Position, velocity and acceleration of every row belong together, and each motion ends where it began or goes on
/// from where it was.
#[test]
fn motions_are_whole() {
    let drive = Drive { rate_hz: 500.0, ..Drive::default() };
    for (name, profile) in all() {
        let run = profile.run(&drive).unwrap();
        let (x, v, a) = (run.position_m.unwrap(), run.velocity_m_s.unwrap(), run.acceleration_m_s2.unwrap());
        assert_eq!(run.parts.last().map(|p| p.rows.end), Some(x.len()), "{name}");
        for n in 1..x.len() {
            // the mean of two velocities is exact but where the acceleration changes between two rows
            let step = 0.5 * (v[n] + v[n - 1]) / drive.rate_hz;
            let bend = (a[n] - a[n - 1]).abs() / (drive.rate_hz * drive.rate_hz);
            assert!((x[n] - x[n - 1] - step).abs() <= bend + 1e-12, "{name}: row {n}");
            assert!(
                (v[n] - v[n - 1]).abs() <= (a[n].abs().max(a[n - 1].abs()) + 1e-9) / drive.rate_hz * 1.001,
                "{name}"
            );
        }
    }
}

#[test]
fn strokes_have_the_speed_that_was_asked_for() {
    let ladder = Ladder { preloads_n: Vec::new(), speeds_m_s: vec![0.02], stroke_m: 0.1, repeats: 1, and_down: false };
    let run = ladder.run(&Drive::default()).unwrap();
    let steady = run.velocity_m_s.unwrap().iter().filter(|v| (**v - 0.02).abs() < 2e-5).count();
    assert!(steady > 900, "{steady}");
    assert!(run.preload_n.is_none());
}

#[test]
fn what_cannot_be_driven_is_refused() {
    let map = |speed: f64, length: f64| Map { speeds_m_s: vec![speed], length_m: length, repeats: 1 };
    assert!(matches!(map(1.0, 0.5).run(&Drive::default()), Err(Undrivable::TooShort { .. })));
    assert!(matches!(map(0.0, 0.5).run(&Drive::default()), Err(Undrivable::NotPositive("speed"))));
    assert!(matches!(map(1e-9, 0.5).run(&Drive::default()), Err(Undrivable::TooLong(_))));
    let none = Map { speeds_m_s: vec![], length_m: 0.5, repeats: 1 };
    assert!(matches!(none.run(&Drive::default()), Err(Undrivable::Empty("speed"))));
}
