//! The whole loop on the real image in one test. An effect that its parameters lack acts on the axis. The block
//! reports that its model does not fit and sends a burst; `diagnose` names the cause; the image made from that is
//! loaded over the bus, survives a reset, and the preload is right again.
//!
//! On the G474 only: the emulated F405 drops what is written to its flash.

mod axis;
mod desk;

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use can_wire::NodeId;
use can_wire::parameters::{ADDRESS, image_hash};
use can_wire::service::server::DELIVERED_KEY;
use can_wire::service::{Field, objects};
use host_tools::block::Client;
use host_tools::bus::Bus;
use host_tools::bus::emulated::link;
use model_core::params::Params;
use model_core::viscosity::ViscosityCubic;
use simulation::mechanism::Id;
use system_tests::image::{BENCH, firmware, record};
use virtual_board::{Chip, Outcome, VirtualBoard};

use axis::{Axis, HONEST, Told, World};
use desk::{Desk, explain};

/// An effect concealed from a block, and the required outcome.
struct Concealed {
    name: &'static str,
    world: World,
    /// the block's parameters
    own: Params,
    /// viscosity that the desk's simulation of the axis assumes, cSt
    cst: f32,
    /// what `diagnose` must name
    effect: Id,
    /// travel after which a misfit must have been reported, m
    within_m: f64,
    /// bursts ordered beside the one that the block sends by itself, and the pause before each
    more_bursts: u32,
    pause: Duration,
}

const fn seconds(n: u64) -> Duration {
    Duration::from_secs(n)
}

/// Seed of the noise of axis and sensors: `GUIDEBLOCK_LOOP_SEED`, to try others than the usual one.
fn seed() -> u64 {
    std::env::var("GUIDEBLOCK_LOOP_SEED").ok().map_or(5, |text| text.parse().expect("a whole number"))
}

/// Runs a block on an axis with this desk at its bus.
fn with_desk(name: &str, world: World, own: Params, talk: impl FnOnce(&mut Desk<'_>, &Told, &Path) + Send) -> Outcome {
    let run = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("loop-{name}.csv"));
    let told = Arc::new(Told::default());
    let (bus, linked) = link(Axis::new(world, Arc::clone(&told), seed()));
    std::thread::scope(|scope| {
        let talking = scope.spawn(move || {
            // dropped when this closure ends, even by a panic, which ends the board's run, too
            let mut bus = bus;
            talk(&mut Desk::new(&mut bus, &run), &told, &run);
        });
        let (elf, record) = (firmware(Chip::Stm32g474), record(own));
        let run = VirtualBoard::new(Chip::Stm32g474, &elf).with_flash(ADDRESS, &record).run(linked);
        talking.join().expect("the desk's side holds");
        run.expect("the image runs").0
    })
}

fn closes(concealed: &Concealed) {
    let Concealed { name, within_m, .. } = *concealed;
    let outcome = with_desk(name, concealed.world, concealed.own, |desk, told, run| {
        // the block notices the misfit
        desk.until(seconds(1200), Desk::does_not_fit);
        let misfit = desk.misfit.expect("one was heard");
        println!("{name}: misfit after {:.2} m, {:.0?}: {misfit:?}", told.travel_m(), desk.bus.now());
        assert!(told.travel_m() <= within_m, "{} m", told.travel_m());
        // and sends bursts
        let mut rows = desk.take_burst();
        for _ in 0..concealed.more_bursts {
            desk.wait(concealed.pause);
            desk.order_burst();
            rows = desk.take_burst();
        }
        let travel = told.travel_m();
        println!("{name}: {rows} rows of {} bursts, {travel:.1} m", desk.bursts);
        let before = desk.error();
        // the desk explains
        let bytes = explain(run, concealed.own, concealed.cst, concealed.effect);
        // the block gets the new image
        told.halt();
        desk.until(seconds(120), |_| told.is_home());
        desk.wait(seconds(1));
        let mut client = Client::new(desk.bus, NodeId::FIRST);
        client.unlock(DELIVERED_KEY).expect("the key");
        client.load_image(&bytes, |_, _| {}).expect("kept");
        client.write(Field::Restart, objects::RESTART).expect("at rest");
        let hash = image_hash(&bytes).expect("an image");
        desk.until(seconds(5), |d| d.image == hash);
        (desk.misfit, desk.errors) = (None, Vec::new());
        // and is right on the next run, which is as long as the first
        told.run();
        let from = told.travel_m();
        desk.until(seconds(1800), |d| d.does_not_fit() || told.travel_m() >= from + travel);
        let after = desk.error();
        println!(
            "{name}: preload error {:.2} % before, {:.2} % after; {:?}",
            100.0 * before,
            100.0 * after,
            desk.misfit
        );
        // the block has judged, and the model fits
        assert!(desk.misfit.is_some_and(|m| m.axis.is_some() && m.since_s.is_none()), "{:?}", desk.misfit);
        assert!(5.0 * after <= before, "{after} after {before}");
    });
    assert_eq!(outcome.resets.len(), 1, "{:?}", outcome.resets);
}

#[test]
fn a_seal_wiper_is_noticed_explained_and_learned() {
    closes(&Concealed {
        name: "wiper",
        world: World { wiper_n: 4.0, ..HONEST },
        own: BENCH,
        cst: BENCH.viscosity.at(30.0).expect("inside the oil's range").cst,
        effect: Id::SealDrag,
        within_m: 10.0,
        // within one burst every speed occurs once, and a slow drift of the drag would pass for run-in
        more_bursts: 2,
        pause: seconds(0),
    });
}

#[test]
fn a_rail_profile_is_noticed_explained_and_learned() {
    closes(&Concealed {
        name: "rail",
        world: World { rail: |x| 0.04 * (x * std::f64::consts::TAU / 0.3).sin(), stroke_m: 0.3, ..HONEST },
        own: BENCH,
        cst: BENCH.viscosity.at(30.0).expect("inside the oil's range").cst,
        effect: Id::RailStraightness,
        within_m: 12.0,
        more_bursts: 0,
        pause: seconds(0),
    });
}

#[test]
fn a_warm_up_with_the_wrong_viscosity_is_noticed_explained_and_learned() {
    // the block assumes the viscosity at 40 °C at every temperature
    let flat = ViscosityCubic { ln: [4.605_170_2, 0.0, 0.0, 0.0], ..ViscosityCubic::VG100 };
    closes(&Concealed {
        name: "warm-up",
        world: World { degc: |t| 36.0 - 14.0 * (-t / 300.0).exp(), ..HONEST },
        own: Params { viscosity: flat, ..BENCH },
        cst: 100.0,
        effect: Id::ViscosityTemperature,
        within_m: 8.0,
        more_bursts: 3,
        pause: seconds(60),
    });
}

#[test]
fn ten_minutes_with_nothing_concealed_are_no_misfit() {
    let world = World { degc: |t| 36.0 - 14.0 * (-t / 300.0).exp(), ..HONEST };
    let outcome = with_desk("honest", world, BENCH, |desk, told, _| {
        desk.until(seconds(700), |d| d.does_not_fit() || d.bus.now() >= seconds(600));
        let error = desk.error();
        println!("honest: {:.1} m, preload error {:.2} %, {:?}", told.travel_m(), 100.0 * error, desk.misfit);
        assert!(desk.misfit.is_some_and(|m| m.axis.is_some() && m.since_s.is_none()), "{:?}", desk.misfit);
        assert!(desk.bursts == 0 && error < 0.02, "{} bursts, {error}", desk.bursts);
    });
    assert!(outcome.resets.is_empty(), "{:?}", outcome.resets);
}
