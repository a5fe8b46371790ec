//! A carriage on a staircase of speeds, with effects acting on it that the block may not know of.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use host_tools::rig::front_end::{ChannelNoise, FrontEnd};
use host_tools::rig::noise::Noise;
use model_core::params::Params;
use model_core::reduced::DragLaw;
use system_tests::image::BENCH;
use virtual_board::{Bench, Nanos, Pins};

/// Preload of the axis, N.
pub(crate) const PRELOAD_N: f64 = 3000.0;
/// A stroke each way at every step, m/s.
const SPEEDS: [f64; 6] = [0.02, 0.05, 0.09, 0.05, 0.02, 0.01];
/// Acceleration at the ends of a stroke, m/s².
const ACCELERATION: f64 = 1.0;
/// Time step of the axis, ns and s: that at which the desk reads the bus.
const STEP: Nanos = 500_000;
const STEP_S: f64 = STEP as f64 * 1e-9;
/// Random wander of the drag on every axis: standard deviation, as a share, and its correlation times, s.
const WANDERS: f64 = 0.003;
const WANDERING_S: [f64; 2] = [5.0, 1200.0];

/// Effects on the axis; the block knows of them only through its sensors.
#[derive(Clone, Copy)]
pub(crate) struct World {
    /// Friction beside the law, N.
    pub(crate) wiper_n: f64,
    /// Relative preload that is added at a place of the rail, m.
    pub(crate) rail: fn(place_m: f64) -> f64,
    /// Temperature, °C, at a time since the run began.
    pub(crate) degc: fn(time_s: f64) -> f64,
    /// Length of a stroke, m.
    pub(crate) stroke_m: f64,
}

/// An axis without concealed effects.
pub(crate) const HONEST: World = World { wiper_n: 0.0, rail: |_| 0.0, degc: |_| 30.0, stroke_m: 0.1 };

/// Messages between desk and axis.
#[derive(Default)]
pub(crate) struct Told {
    halt: AtomicBool,
    home: AtomicBool,
    travel_um: AtomicU64,
}

impl Told {
    /// Tells the carriage to go home and stay there.
    pub(crate) fn halt(&self) {
        self.halt.store(true, Ordering::Relaxed);
    }

    /// Begins the next run. In between the axis has cooled down.
    pub(crate) fn run(&self) {
        self.home.store(false, Ordering::Relaxed);
        self.halt.store(false, Ordering::Relaxed);
    }

    /// Whether it stands at home, where the encoder has its zero.
    pub(crate) fn is_home(&self) -> bool {
        self.home.load(Ordering::Relaxed)
    }

    /// Travel so far, m.
    pub(crate) fn travel_m(&self) -> f64 {
        self.travel_um.load(Ordering::Relaxed) as f64 * 1e-6
    }
}

/// The axis.
pub(crate) struct Axis {
    world: World,
    front: FrontEnd,
    noise: Noise,
    wandering: [f64; 2],
    told: Arc<Told>,
    began: Nanos,
    x: f64,
    v: f64,
    stroke: usize,
    travel: f64,
}

impl Axis {
    pub(crate) fn new(world: World, told: Arc<Told>, seed: u64) -> Self {
        Axis {
            world,
            front: FrontEnd::new(BENCH.calibration, ChannelNoise::BENCH, seed),
            noise: Noise::new(seed + 1),
            wandering: [0.0; 2],
            told,
            began: 0,
            x: 0.0,
            v: 0.0,
            stroke: 0,
            travel: 0.0,
        }
    }

    /// Moves by one step; returns the direction of the stroke, 0 at home.
    fn roll(&mut self, now: Nanos) -> f64 {
        let out = self.stroke.is_multiple_of(2);
        if self.v == 0.0 && out && self.told.halt.load(Ordering::Relaxed) {
            self.told.home.store(true, Ordering::Relaxed);
            (self.began, self.stroke, self.x) = (now, 0, 0.0);
            return 0.0;
        }
        let direction = if out { 1.0 } else { -1.0 };
        let left = if out { self.world.stroke_m - self.x } else { self.x };
        let wanted = SPEEDS[self.stroke / 2 % SPEEDS.len()].min((2.0 * ACCELERATION * left.max(0.0)).sqrt());
        self.v = wanted.min(self.v + ACCELERATION * STEP_S);
        if left <= self.v * STEP_S || self.v < 1e-3 && left < 1e-4 {
            (self.stroke, self.v) = (self.stroke + 1, 0.0);
        }
        self.x += direction * self.v * STEP_S;
        self.travel += self.v * STEP_S;
        self.told.travel_um.store((self.travel * 1e6) as u64, Ordering::Relaxed);
        direction
    }

    fn drag_n(&mut self, degc: f64) -> f64 {
        let cst = Params::ZHOU_2023.viscosity.at(degc as f32).expect("inside the oil's range").cst;
        let viscous_speed = f64::from(cst * BENCH.viscosity_number_per_cst) * self.v;
        let preload = PRELOAD_N * (1.0 + (self.world.rail)(self.x));
        let contacts = BENCH.law.drag_force(preload as f32, viscous_speed as f32).expect("inside the law");
        for (part, time) in self.wandering.iter_mut().zip(WANDERING_S) {
            *part += -*part * STEP_S / time + WANDERS * (2.0 * STEP_S / time).sqrt() * self.noise.gaussian();
        }
        f64::from(contacts) * (1.0 + self.wandering.iter().sum::<f64>()) + self.world.wiper_n
    }
}

impl Bench for Axis {
    fn step(&mut self, now: Nanos, pins: &mut Pins<'_>) -> Option<Nanos> {
        let direction = self.roll(now);
        let degc = (self.world.degc)((now - self.began) as f64 * 1e-9);
        let force = if self.v > 0.0 { direction * self.drag_n(degc) } else { 0.0 };
        pins.force_code(self.front.force_code(force));
        pins.temperature_code(self.front.temperature_code(Some(degc)));
        pins.move_encoder_to(self.front.encoder_count(self.x), now + STEP);
        // no run needs more; this ends the run of a desk that waits for ever
        (now < 3_600_000_000_000).then_some(now + STEP)
    }
}
