//! Start-up, static memory, and one task for each runner.

use core::panic::PanicInfo;

use can_wire::burst::{Order, Sender};
use can_wire::service::Settings as Set;
use can_wire::service::server::{DELIVERED_KEY, Server};
use can_wire::{Beside, Health, Publisher, RawFrame};
use cortex_m::peripheral::SCB;
use defmt_rtt as _;
use embassy_executor::Spawner;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use embassy_sync::signal::Signal;
use firmware::boot::Settings;
use firmware::facts::Facts;
use firmware::liveness::Liveness;
use firmware::runners::acquire::{Acquire, DEPTH};
use firmware::runners::estimate::{Estimate, Report};
use firmware::runners::publish::{OUTGOING, Publish};
use firmware::runners::serve::{Identity, RING, Serve};
use firmware::runners::supervise::Supervise;
use model_core::consistency::Watch;
use model_core::monitor::State;
use model_core::sample::RawBlock;
use static_cell::{ConstStaticCell, StaticCell};

use crate::board::{self, Bus, Dog, Ears, ImageStore, Reset, Sampler, Uptime};

type Mutex = CriticalSectionRawMutex;

static BLOCKS: Channel<Mutex, RawBlock, DEPTH> = Channel::new();
static REPORTS: Signal<Mutex, Report> = Signal::new();
static COPIES: Channel<Mutex, RawBlock, DEPTH> = Channel::new();
static OUT: Channel<Mutex, RawFrame, OUTGOING> = Channel::new();
static NOTICES: Signal<Mutex, Order> = Signal::new();
static TUNING: Signal<Mutex, Set> = Signal::new();
static SETTINGS: ConstStaticCell<Settings> = ConstStaticCell::new(Settings::UNSET);
static SERVER: StaticCell<Server> = StaticCell::new();
static SENDER: StaticCell<Sender<RING>> = StaticCell::new();
static FACTS: Facts = Facts::new();
static STATE: ConstStaticCell<State> = ConstStaticCell::new(State::new());
static WATCH: ConstStaticCell<Watch> = ConstStaticCell::new(Watch::new());
static LIVENESS: Liveness = Liveness::new();

/// Version of this firmware: major, minor, patch.
const VERSION: [u16; 3] = [
    number(env!("CARGO_PKG_VERSION_MAJOR")),
    number(env!("CARGO_PKG_VERSION_MINOR")),
    number(env!("CARGO_PKG_VERSION_PATCH")),
];

/// Parses a whole number at compile time.
const fn number(text: &str) -> u16 {
    let (bytes, mut n, mut value) = (text.as_bytes(), 0, 0);
    while n < bytes.len() {
        value = 10 * value + (bytes[n] - b'0') as u16;
        n += 1;
    }
    value
}

#[embassy_executor::main]
async fn main(spawner: Spawner) {
    let mut board = board::start();
    let settings = SETTINGS.take();
    defmt::unwrap!(settings.load(&board.parameters).ok(), "the built-in parameters do not build");
    board.ears.listen(settings.node);
    let params = settings.monitor.params();
    defmt::info!(
        "guide block {=str} on {=str}: reset by {=str}, start {=u16}; parameter record {=str}, node {=u8}, calibrated {=bool}",
        env!("CARGO_PKG_VERSION"),
        board::KIND.name(),
        board.reset_cause.name(),
        board.boot_count,
        settings.record_state(),
        settings.node.get(),
        params.calibrated
    );
    let (image, set) = (settings.image_hash, settings.set);
    let beside =
        Beside { acting: params.left_out.acting(), record: settings.refused.is_none(), calibrated: params.calibrated };
    let wavelength_m = params.ball_pass_wavelength_m;
    let (publish_every_blocks, zero_code) = (params.publish_every_blocks, params.calibration.force.zero_code);
    let health = Health {
        reset_cause: board.reset_cause,
        board: board::KIND,
        boot_count: board.boot_count,
        frames_dropped: 0,
        operational: false,
    };
    spawner.spawn(defmt::unwrap!(acquire(Acquire {
        source: board.sampler,
        blocks: BLOCKS.sender(),
        copies: COPIES.sender(),
        clock: Uptime,
        liveness: &LIVENESS,
    })));
    spawner.spawn(defmt::unwrap!(estimate(Estimate {
        monitor: &mut settings.monitor,
        tuning: &TUNING,
        state: STATE.take(),
        watch: WATCH.take(),
        publisher: Publisher::new(settings.node),
        blocks: BLOCKS.receiver(),
        reports: &REPORTS,
        notices: &NOTICES,
        clock: Uptime,
        liveness: &LIVENESS,
    })));
    spawner.spawn(defmt::unwrap!(publish(Publish {
        sink: board.bus,
        publisher: Publisher::new(settings.node),
        reports: &REPORTS,
        outgoing: OUT.receiver(),
        facts: &FACTS,
        health,
        image,
        beside,
        wavelength_m,
        clock: Uptime,
        liveness: &LIVENESS,
    })));
    let identity = Identity {
        board: board::KIND,
        unique: board.unique,
        version: VERSION,
        reset_cause: board.reset_cause,
        boot_count: board.boot_count,
        active_image: image,
        publish_every_blocks,
        zero_code,
    };
    spawner.spawn(defmt::unwrap!(serve(Serve {
        source: board.ears,
        keep: board.store,
        restart: Reset,
        server: SERVER.init_with(|| Server::new(settings.node, DELIVERED_KEY, set)),
        // two successive starts begin with different burst numbers
        sender: SENDER.init_with(|| Sender::new(settings.node, (board.boot_count as u8).wrapping_mul(31))),
        blocks: COPIES.receiver(),
        notices: &NOTICES,
        outgoing: OUT.sender(),
        tuning: &TUNING,
        facts: &FACTS,
        identity,
        clock: Uptime,
        liveness: &LIVENESS,
    })));
    spawner.spawn(defmt::unwrap!(supervise(Supervise {
        watchdog: board.watchdog,
        clock: Uptime,
        liveness: &LIVENESS
    })));
}

#[embassy_executor::task]
async fn acquire(runner: Acquire<'static, Mutex, Sampler, Uptime>) {
    runner.run().await;
}

#[embassy_executor::task]
async fn estimate(runner: Estimate<'static, Mutex, Uptime>) {
    runner.run().await;
}

#[embassy_executor::task]
async fn publish(runner: Publish<'static, Mutex, Bus, Uptime>) {
    runner.run().await;
}

#[embassy_executor::task]
async fn serve(runner: Serve<'static, Mutex, Ears, ImageStore, Reset, Uptime>) {
    runner.run().await;
}

#[embassy_executor::task]
async fn supervise(runner: Supervise<'static, Dog, Uptime>) {
    runner.run().await;
}

/// Logs the place and restarts at once; the heartbeat then shows a reset by software. A hard fault instead ends in an
/// endless loop of cortex-m-rt, and so in a reset by the watchdog.
#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    let (file, line) = info.location().map_or(("unknown", 0), |l| (l.file(), l.line()));
    defmt::error!("panic at {=str}:{=u32}", file, line);
    defmt::flush();
    SCB::sys_reset()
}
