//! Answers service messages, carries out what they ask for, and sends bursts.

use core::sync::atomic::Ordering;

use can_wire::burst::{Cause, FRAME_BITS, Order, Sender, State};
use can_wire::service::server::Server;
use can_wire::service::{Action, BlockState, REQUEST_BASE, Settings, UploadState};
use can_wire::{BoardKind, RawFrame, ResetCause};
use embassy_futures::select::{Either, Either3, select, select3};
use embassy_sync::blocking_mutex::raw::RawMutex;
use embassy_sync::channel;
use embassy_sync::signal::Signal;
use model_core::sample::RawBlock;

use crate::facts::Facts;
use crate::liveness::{Liveness, Member, REPORT_WITHIN_US};
use crate::log::{info, warning};
use crate::ports::{Clock, FrameSource, Keep, KeepError, Kept, Restart};
use crate::runners::acquire::DEPTH;
use crate::runners::publish::OUTGOING;
use crate::standing::{Standing, ZeroTaking};

/// Segments of the ring: a second and more of motion.
pub const RING: usize = 512;

/// Time a frame takes on the bus at 500 kbit/s, µs.
const FRAME_US: u64 = FRAME_BITS as u64 * 1_000_000 / 500_000;

/// Frames that a burst may be behind its share of the bus and make up for.
const BEHIND: u64 = 3;

/// While there is something to send, one looks again after this time, µs.
const BUSY_US: u64 = 1_000;

/// Time for the answer to leave before the block starts anew, µs.
const FAREWELL_US: u64 = 50_000;

/// What does not change while the block runs.
#[derive(Clone, Copy, Debug)]
pub struct Identity {
    /// What the firmware runs on.
    pub board: BoardKind,
    /// The chip's unique identifier, lowest word first.
    pub unique: [u32; 3],
    /// Firmware version: major, minor, patch.
    pub version: [u16; 3],
    /// What started the block.
    pub reset_cause: ResetCause,
    /// Starts since the supply was switched on.
    pub boot_count: u16,
    /// Hash of the active parameter image, 0 without one.
    pub active_image: u32,
    /// Blocks between two estimates as that image says.
    pub publish_every_blocks: u16,
    /// Zero of the force converter as that image says, codes.
    pub zero_code: f32,
}

/// Requests and copies of the samples in, answers and burst frames out.
///
/// Its steps are functions of their own, so that what they need for a moment is not on the stack of every poll.
pub struct Serve<'a, M: RawMutex, R, K, T, C> {
    /// Where requests come from.
    pub source: R,
    /// Where things are kept.
    pub keep: K,
    /// How the chip is started anew.
    pub restart: T,
    /// The object server, some kilobytes.
    pub server: &'a mut Server,
    /// The ring and the burst, some kilobytes.
    pub sender: &'a mut Sender<RING>,
    /// Copies of the samples.
    pub blocks: channel::Receiver<'a, M, RawBlock, DEPTH>,
    /// Bursts that the block itself wants, because it noticed something.
    pub notices: &'a Signal<M, Order>,
    /// Frames for the bus.
    pub outgoing: channel::Sender<'a, M, RawFrame, OUTGOING>,
    /// Settings for the estimator.
    pub tuning: &'a Signal<M, Settings>,
    /// What others know and want to know.
    pub facts: &'a Facts,
    /// What never changes.
    pub identity: Identity,
    /// Time.
    pub clock: C,
    /// Signs of life.
    pub liveness: &'a Liveness,
}

/// What is still to be done.
#[derive(Default)]
struct Pending {
    answer: Option<RawFrame>,
    /// carried out when the answer is out
    action: Option<Action>,
    restart_at_us: Option<u64>,
    zero: Option<ZeroTaking>,
}

impl<M: RawMutex, R: FrameSource, K: Keep, T: Restart, C: Clock> Serve<'_, M, R, K, T, C> {
    /// Serves for ever.
    pub async fn run(mut self) -> ! {
        let mut pending = Pending::default();
        let mut standing = Standing::new();
        let mut share = Share { credit: 0, since_us: self.clock.now_us() };
        if *self.server.settings() != Settings::DELIVERED {
            self.apply(*self.server.settings());
        }
        loop {
            let now_us = self.clock.now_us();
            if let Some(order) = self.notices.try_take() {
                let _ = self.burst(order, Cause::Notice);
            }
            if let Some(answer) = &pending.answer
                && self.outgoing.try_send(*answer).is_ok()
            {
                pending.answer = None;
            }
            if pending.answer.is_none()
                && let Some(action) = pending.action.take()
            {
                self.carry_out(action, &mut pending).await;
            }
            if pending.restart_at_us.is_some_and(|at_us| now_us >= at_us) {
                pending.restart_at_us = None;
                self.restart.restart();
            }
            self.send_burst(&mut share, pending.answer.is_some());
            self.tell();
            self.liveness.report(Member::Serve);

            let busy = pending.answer.is_some() || self.sender.state() != State::Idle;
            let pause_us = if busy { BUSY_US } else { REPORT_WITHIN_US / 2 };
            let wake_us = pending.restart_at_us.unwrap_or(u64::MAX).min(now_us + pause_us);
            // while an answer waits no further request is taken
            let request = async {
                match pending.answer {
                    None => self.source.frame().await,
                    Some(_) => core::future::pending().await,
                }
            };
            match select3(request, self.blocks.receive(), self.clock.sleep_until(wake_us)).await {
                Either3::First(frame) => self.take(&frame, &standing, &mut pending),
                Either3::Second(block) => {
                    standing.step(&block, self.clock.now_us());
                    self.sender.append(&block);
                    if let Some(zero) = &mut pending.zero
                        && let Some(taken) = zero.step(&block, standing.is_standing(self.clock.now_us()))
                    {
                        pending.zero = None;
                        self.zeroed(taken);
                    }
                }
                Either3::Third(()) => {
                    // samples that stopped coming end a zero too
                    if pending.zero.is_some() && !standing.is_standing(self.clock.now_us()) {
                        pending.zero = None;
                        self.zeroed(None);
                    }
                }
            }
        }
    }

    #[inline(never)]
    fn take(&mut self, frame: &RawFrame, standing: &Standing, pending: &mut Pending) {
        let now_us = self.clock.now_us();
        if frame.id < REQUEST_BASE {
            // what is not about this burst changes nothing
            let _ = self.sender.asked(frame, ms(now_us));
            return;
        }
        let block = self.state(!standing.is_standing(now_us));
        let answer = self.server.handle(frame, &block);
        (pending.answer, pending.action) = (answer.frame, answer.action);
    }

    #[inline(never)]
    fn state(&self, moving: bool) -> BlockState {
        let Identity { board, unique, version, reset_cause, boot_count, active_image, publish_every_blocks, .. } =
            self.identity;
        BlockState {
            moving,
            // 136 years
            uptime_s: (self.clock.now_us() / 1_000_000) as u32,
            error_register: self.facts.error_register.load(Ordering::Relaxed),
            board,
            unique,
            version,
            reset_cause,
            boot_count,
            lost_blocks: self.facts.lost_blocks.get(),
            frames_dropped: self.facts.frames_dropped.get(),
            bus_offs: self.facts.bus_offs.get(),
            active_image,
            image_publish_every_blocks: publish_every_blocks,
            burst_state: self.sender.state() as u8,
            burst_dropped: self.sender.dropped(),
        }
    }

    async fn carry_out(&mut self, action: Action, pending: &mut Pending) {
        match action {
            Action::Apply(settings) => self.apply(settings),
            Action::Keep(settings) => {
                let kept = self.save(Kept::Settings, &settings.to_bytes()).await;
                self.server.kept(kept.is_ok());
            }
            Action::SaveImage => {
                let outcome = match self.save_image().await {
                    Ok(()) => UploadState::Saved,
                    Err(KeepError::Full) => UploadState::Full,
                    Err(_) => UploadState::Failed,
                };
                self.server.saved(outcome);
            }
            Action::TakeZero => pending.zero = Some(ZeroTaking::new(self.zero_in_use())),
            Action::ClearCounters => {
                self.facts.lost_blocks.clear();
                self.facts.frames_dropped.clear();
                self.facts.bus_offs.clear();
            }
            Action::Burst(order) => {
                let _ = self.burst(order, Cause::Command);
            }
            Action::EndBurst => self.sender.end(),
            Action::Restart => pending.restart_at_us = Some(self.clock.now_us() + FAREWELL_US),
        }
    }

    #[inline(never)]
    fn burst(&mut self, order: Order, cause: Cause) -> bool {
        let started = self.sender.start(order, cause, self.identity.active_image, ms(self.clock.now_us()));
        if started {
            info!("burst of {=u16} blocks, {=u16} of them past", order.blocks, order.past);
        }
        started
    }

    fn apply(&mut self, settings: Settings) {
        self.facts.set_limits(&settings.limits);
        self.tuning.signal(settings);
    }

    #[inline(never)]
    fn zeroed(&mut self, above_sixteenths: Option<i16>) {
        match self.server.zeroed(above_sixteenths) {
            Some(settings) => self.apply(settings),
            None => warning!("no zero taken: the carriage moved, or something pulls"),
        }
    }

    /// The zero in use, sixteenths of a code.
    fn zero_in_use(&self) -> i32 {
        let shift = self.server.settings().zero_shift_sixteenths;
        // a legal zero lies within the converter's range
        (self.identity.zero_code * 16.0) as i32 + i32::from(shift)
    }

    async fn save_image(&mut self) -> Result<(), KeepError> {
        let saving = self.keep.save(Kept::Image, self.server.image());
        alive(saving, &self.clock, self.liveness).await
    }

    async fn save(&mut self, what: Kept, bytes: &[u8]) -> Result<(), KeepError> {
        alive(self.keep.save(what, bytes), &self.clock, self.liveness).await
    }

    /// Puts out as much of a burst as its share of the bus allows.
    #[inline(never)]
    fn send_burst(&mut self, share: &mut Share, answer_waits: bool) {
        share.earn(self.clock.now_us(), self.server.settings().burst_load_percent);
        while !answer_waits && !self.outgoing.is_full() && share.credit >= Share::FRAME {
            let Some(frame) = self.sender.next(ms(self.clock.now_us())) else { break };
            share.credit -= Share::FRAME;
            // there was room, and nobody else sends
            let _ = self.outgoing.try_send(frame);
        }
    }

    /// Tells others what they want to know.
    #[inline(never)]
    fn tell(&self) {
        let uptime_s = (self.clock.now_us() / 1_000_000) as u32;
        self.facts.changes.store(self.server.changes(), Ordering::Relaxed);
        self.facts.unlocked.store(self.server.is_unlocked(uptime_s), Ordering::Relaxed);
        self.facts.bursting.store(self.sender.state() != State::Idle, Ordering::Relaxed);
    }
}

/// Waits for something to be saved and shows signs of life meanwhile.
async fn alive(
    saving: impl Future<Output = Result<(), KeepError>>,
    clock: &impl Clock,
    liveness: &Liveness,
) -> Result<(), KeepError> {
    let mut saving = core::pin::pin!(saving);
    loop {
        let look = clock.sleep_until(clock.now_us() + REPORT_WITHIN_US / 2);
        match select(&mut saving, look).await {
            Either::First(kept) => {
                if let Err(why) = kept {
                    warning!("not kept: {=str}", why.name());
                }
                return kept;
            }
            Either::Second(()) => liveness.report(Member::Serve),
        }
    }
}

/// A burst's share of the bus.
struct Share {
    /// time on the bus that may be used, hundredths of µs
    credit: u64,
    since_us: u64,
}

impl Share {
    const FRAME: u64 = 100 * FRAME_US;

    fn earn(&mut self, now_us: u64, percent: u8) {
        let earned = (now_us - self.since_us) * u64::from(percent);
        (self.credit, self.since_us) = ((self.credit + earned).min(BEHIND * Self::FRAME), now_us);
    }
}

/// Milliseconds, which wrap.
fn ms(us: u64) -> u32 {
    (us / 1000) as u32
}

#[cfg(test)]
mod tests {
    use can_wire::burst::{Receiver, Record};
    use can_wire::service::server::DELIVERED_KEY;
    use can_wire::service::{Abort, Field, OBJECTS, Object, UploadState, client, client::Reply};
    use can_wire::{Beside, Health, NodeId, Publisher, crc32};
    use embassy_sync::blocking_mutex::raw::NoopRawMutex;
    use embassy_sync::channel::Channel;
    use model_core::left_out::Acting;
    use model_core::sample::SAMPLES_PER_BLOCK;
    use std::cell::{Cell, RefCell};
    use std::rc::Rc;

    use super::*;
    use crate::ports::FrameSink;
    use crate::runners::estimate::Report;
    use crate::runners::publish::Publish;
    use crate::runners::rehearsal::{Controller, Desk, Inbox};
    use crate::timeline::BLOCK_US;

    const NODE: NodeId = NodeId::FIRST;

    type Saved = Rc<RefCell<Vec<(Kept, Vec<u8>)>>>;

    /// A store that takes as long as flash does.
    struct Flash<'a>(&'a Desk, Saved, Result<(), KeepError>);
    impl Keep for Flash<'_> {
        async fn save(&mut self, what: Kept, bytes: &[u8]) -> Result<(), KeepError> {
            self.0.sleep_until(self.0.now_us() + 700_000).await;
            self.1.borrow_mut().push((what, bytes.to_vec()));
            self.2
        }
    }

    struct Button(Rc<Cell<u32>>);
    impl Restart for Button {
        fn restart(&mut self) {
            self.0.set(self.0.get() + 1);
        }
    }

    /// What a client does and what came of it.
    #[derive(Default)]
    struct Seen {
        replies: Vec<Reply>,
        records: Vec<Record>,
        sampled: Vec<RawBlock>,
        kept: Saved,
        restarts: Rc<Cell<u32>>,
        settings: Vec<Settings>,
        facts: Facts,
        burst_frames: Vec<u64>,
        silent_us: u64,
        bus_offs: u32,
    }

    fn object(field: Field) -> &'static Object {
        OBJECTS.iter().find(|o| o.field == field).unwrap()
    }

    fn write(field: Field, value: u32) -> (&'static Object, RawFrame) {
        (object(field), client::write(NODE, object(field), value))
    }

    fn read(field: Field) -> (&'static Object, RawFrame) {
        (object(field), client::read(NODE, object(field)))
    }

    /// Samples at rest until `moves_at_ms`, then in motion.
    fn block(tick: u32, moves_at_ms: u32) -> RawBlock {
        const N: usize = SAMPLES_PER_BLOCK;
        let travelled = (tick * 10).saturating_sub(moves_at_ms) as u16;
        RawBlock {
            tick,
            force: std::array::from_fn(|n| 2060 + (tick as u16).wrapping_mul(7).wrapping_add(n as u16 * 5) % 4),
            temperature: [1850; N],
            position: std::array::from_fn(|n| {
                travelled.wrapping_mul(50).wrapping_add(n as u16 * u16::from(travelled > 0))
            }),
        }
    }

    /// Runs a block and a client that says `script` one by one, each when the one before was answered; it asks for
    /// what of a burst is missing. Every eleventh frame of a burst is lost, and the bus is off when `off` says so.
    fn converse(
        script: &[(u64, (&'static Object, RawFrame))],
        for_us: u64,
        moves_at_ms: u32,
        flash: Result<(), KeepError>,
        off: impl Fn(u64) -> bool,
    ) -> Seen {
        let mut seen = Seen::default();
        let (desk, bus, inbox, liveness) = (Desk::new(), Controller::new(), Inbox::default(), Liveness::new());
        let (reports, tuning, notices) = (Signal::<NoopRawMutex, Report>::new(), Signal::new(), Signal::new());
        let (copies, outgoing) = (Channel::new(), Channel::new());
        let facts = Facts::new();
        let mut server = Server::new(NODE, DELIVERED_KEY, Settings::DELIVERED);
        let mut sender = Sender::new(NODE, 0);
        let identity = Identity {
            board: BoardKind::Stm32g474,
            unique: [1, 2, 3],
            version: [0, 1, 0],
            reset_cause: ResetCause::PowerOn,
            boot_count: 1,
            active_image: 0xABCD,
            publish_every_blocks: 10,
            zero_code: 2048.0,
        };
        let serve = Serve {
            source: &inbox,
            keep: Flash(&desk, Rc::clone(&seen.kept), flash),
            restart: Button(Rc::clone(&seen.restarts)),
            server: &mut server,
            sender: &mut sender,
            blocks: copies.receiver(),
            notices: &notices,
            outgoing: outgoing.sender(),
            tuning: &tuning,
            facts: &facts,
            identity,
            clock: &desk,
            liveness: &liveness,
        };
        let health = Health {
            reset_cause: ResetCause::PowerOn,
            board: BoardKind::Stm32g474,
            boot_count: 1,
            frames_dropped: 0,
            operational: false,
        };
        let publish = Publish {
            sink: &bus,
            publisher: Publisher::new(NODE),
            reports: &reports,
            outgoing: outgoing.receiver(),
            facts: &facts,
            health,
            image: 0,
            beside: Beside { acting: Acting::NONE, record: false, calibrated: false },
            wavelength_m: 0.0143,
            clock: &desk,
            liveness: &liveness,
        };
        let sampled = RefCell::new(Vec::new());
        let feed = async {
            for tick in 0..u32::MAX {
                desk.sleep_until(u64::from(tick + 1) * BLOCK_US).await;
                let block = block(tick, moves_at_ms);
                sampled.borrow_mut().push(block);
                let _ = copies.try_send(block);
            }
        };
        // the client's clock
        let beat = async {
            for at_us in (0..u64::MAX).step_by(1000) {
                desk.sleep_until(at_us).await;
            }
        };
        let mut receiver = Receiver::new(NODE);
        let (mut step, mut waiting, mut read_frames, mut last_asked_us, mut count) = (0, false, 0, 0, 0);
        let mut heard_us = 0;
        let all = embassy_futures::join::join4(feed, beat, publish.run(), serve.run());
        desk.run_watching(for_us, all, || {
            let now_us = desk.now_us();
            [Member::Acquire, Member::Estimate].into_iter().for_each(|m| liveness.report(m));
            if liveness.take_all() {
                heard_us = now_us;
            }
            seen.silent_us = seen.silent_us.max(now_us - heard_us);
            // a controller with nothing to send never leaves the bus
            let now_off = off(now_us) && (bus.off.get() || !FrameSink::is_idle(&&bus));
            seen.bus_offs += u32::from(now_off && !bus.off.replace(now_off));
            bus.off.set(now_off);
            if off(now_us) {
                return;
            }
            bus.transmit(now_us);
            let log = bus.log.borrow();
            for (at_us, frame) in &log[read_frames..] {
                if (0x480..0x500).contains(&frame.id) {
                    seen.burst_frames.push(*at_us);
                    count += 1;
                    if count % 11 != 0 {
                        receiver.take(frame).unwrap();
                    }
                } else if waiting && let Some(reply) = client::reply(NODE, script[step].1.0, frame) {
                    seen.replies.push(reply);
                    (waiting, step) = (false, step + 1);
                }
            }
            read_frames = log.len();
            while let Some(record) = receiver.next_record() {
                seen.records.push(record);
            }
            if receiver.ask_due() || receiver.is_under_way() && now_us - last_asked_us >= 20_000 {
                last_asked_us = now_us;
                inbox.put(receiver.ask().unwrap());
            }
            if let Some((from_us, (_, request))) = script.get(step)
                && !waiting
                && now_us >= *from_us
            {
                inbox.put(*request);
                waiting = true;
            }
            if let Some(settings) = tuning.try_take() {
                seen.settings.push(settings);
            }
        });
        seen.sampled = sampled.into_inner();
        seen.facts = facts;
        seen
    }

    fn blocks(seen: &Seen) -> Vec<RawBlock> {
        seen.records.iter().filter_map(|r| if let Record::Block(b) = r { Some(*b) } else { None }).collect()
    }

    #[test]
    fn it_tells_who_it_is_and_changes_nothing_while_it_moves() {
        let warn = || write(Field::WarnBelow, 2000);
        let script = [
            (0, read(Field::Board)),
            (0, read(Field::ImageActive)),
            (0, warn()),
            // nothing known about motion yet
            (0, write(Field::Key, DELIVERED_KEY)),
            (0, warn()),
            (700_000, warn()),
            (700_000, write(Field::PublishingPeriod, 50)),
            (1_000_000, read(Field::Changes)),
            (2_100_000, warn()),
        ];
        let seen = converse(&script, 2_500_000, 2000, Ok(()), |_| false);
        let expected = [
            Reply::Value(2),
            Reply::Value(0xABCD),
            Reply::Refused(Abort::Locked),
            Reply::Taken,
            Reply::Refused(Abort::State),
            Reply::Taken,
            Reply::Taken,
            Reply::Value(2),
            Reply::Refused(Abort::State),
        ];
        assert_eq!(seen.replies, expected);
        assert_eq!(seen.facts.limits().warn_below_n, Some(2000));
        assert_eq!(seen.settings.last().and_then(|s| s.publish_every_blocks), Some(5));
        assert!(seen.facts.unlocked.load(Ordering::Relaxed) && seen.facts.changes.load(Ordering::Relaxed) == 2);
    }

    #[test]
    fn a_burst_is_complete_in_spite_of_loss_and_bus_off_and_keeps_its_share() {
        let order = Order { blocks: 400, past: 50, asked: true };
        // off for 5 ms in every 200
        let off = |us: u64| (1_000..6_000).contains(&(us % 200_000));
        let seen = converse(&[(1_500_000, write(Field::BurstOrder, order.value()))], 9_000_000, 0, Ok(()), off);
        assert_eq!(seen.replies, [Reply::Taken]);
        let got = blocks(&seen);
        let from = got[0].tick as usize;
        assert_eq!(got, seen.sampled[from..from + 400]);
        assert!((95..=102).contains(&from), "{from}");
        let Some(Record::Trailer(trailer)) = seen.records.last() else { panic!("no trailer") };
        assert_eq!((trailer.blocks, trailer.dropped), (400, 0));
        assert_eq!(seen.facts.bus_offs.get(), seen.bus_offs);
        assert!(seen.bus_offs >= 18, "{}", seen.bus_offs);
        // the share of any quarter of a second, and the frames it may be behind
        for (n, from_us) in seen.burst_frames.iter().enumerate() {
            let within = seen.burst_frames[n..].iter().take_while(|at| *at - from_us < 250_000).count();
            assert!(within as u64 * FRAME_US <= 250_000 / 5 + 6 * FRAME_US, "{within} at {from_us}");
        }
        assert!(seen.silent_us <= REPORT_WITHIN_US, "{}", seen.silent_us);
        assert!(!seen.facts.bursting.load(Ordering::Relaxed));
    }

    #[test]
    fn an_image_is_kept_while_the_block_stays_alive() {
        let image: Vec<u8> = (0..300_u32).map(|n| (n * 11) as u8).collect();
        let domain = object(Field::Image);
        for result in [Ok(()), Err(KeepError::Memory)] {
            let mut script =
                vec![(700_000, write(Field::Key, DELIVERED_KEY)), (0, (domain, client::begin(NODE, domain, 300)))];
            let parts: Vec<&[u8]> = image.chunks(client::SEGMENT).collect();
            for (n, part) in parts.iter().enumerate() {
                script.push((0, (domain, client::segment(NODE, part, n % 2 == 1, n + 1 == parts.len()))));
            }
            script.push((0, write(Field::ImageChecksum, crc32(&image))));
            script.push((2_500_000, read(Field::ImageState)));
            script.push((0, write(Field::Restart, u32::from_le_bytes(*b"rset"))));
            let seen = converse(&script, 3_000_000, u32::MAX, result, |_| false);
            let state = if result.is_ok() { UploadState::Saved } else { UploadState::Failed };
            let [.., checksum, told, restart] = &seen.replies[..] else { panic!("{:?}", seen.replies) };
            assert_eq!((checksum, told, restart), (&Reply::Taken, &Reply::Value(state as u32), &Reply::Taken));
            assert_eq!(*seen.kept.borrow(), [(Kept::Image, image.clone())]);
            assert_eq!(seen.restarts.get(), 1);
            assert!(seen.silent_us <= REPORT_WITHIN_US, "{}", seen.silent_us);
        }
    }

    #[test]
    fn a_zero_is_taken_at_rest_and_settings_are_kept_on_command() {
        let script = [
            (700_000, write(Field::Key, DELIVERED_KEY)),
            (0, write(Field::TakeZero, u32::from_le_bytes(*b"zero"))),
            (2_200_000, read(Field::ZeroShift)),
            (0, write(Field::Save, u32::from_le_bytes(*b"save"))),
        ];
        let seen = converse(&script, 4_000_000, u32::MAX, Ok(()), |_| false);
        // the force is 2060 to 2063, the zero 2048: 13.5 codes
        assert_eq!(seen.replies[2], Reply::Value(216));
        let settings = Settings { zero_shift_sixteenths: 216, ..Settings::DELIVERED };
        assert_eq!(seen.settings, [settings]);
        assert_eq!(*seen.kept.borrow(), [(Kept::Settings, settings.to_bytes().to_vec())]);
        // what was not kept is said
        let ask = [script[0], script[3], (2_500_000, read(Field::Save))];
        for (result, value) in [(Ok(()), 1), (Err(KeepError::NoStore), 0)] {
            let seen = converse(&ask, 4_000_000, u32::MAX, result, |_| false);
            assert_eq!(seen.replies, [Reply::Taken, Reply::Taken, Reply::Value(value)]);
        }
        // motion ends it
        let seen = converse(&script[..3], 4_000_000, 1500, Ok(()), |_| false);
        assert_eq!((seen.replies[2], seen.settings.len()), (Reply::Value(0), 0));
    }

    #[test]
    fn a_notice_starts_a_burst_by_itself() {
        let (desk, inbox, liveness) = (Desk::new(), Inbox::default(), Liveness::new());
        let (tuning, notices) = (Signal::<NoopRawMutex, Settings>::new(), Signal::new());
        let (copies, outgoing, facts) = (Channel::new(), Channel::new(), Facts::new());
        let mut server = Server::new(NODE, DELIVERED_KEY, Settings::DELIVERED);
        let mut sender = Sender::new(NODE, 0);
        let serve = Serve {
            source: &inbox,
            keep: Flash(&desk, Rc::default(), Ok(())),
            restart: Button(Rc::default()),
            server: &mut server,
            sender: &mut sender,
            blocks: copies.receiver(),
            notices: &notices,
            outgoing: outgoing.sender(),
            tuning: &tuning,
            facts: &facts,
            identity: Identity {
                board: BoardKind::Unknown,
                unique: [0; 3],
                version: [0; 3],
                reset_cause: ResetCause::Unknown,
                boot_count: 1,
                active_image: 5,
                publish_every_blocks: 10,
                zero_code: 2048.0,
            },
            clock: &desk,
            liveness: &liveness,
        };
        notices.signal(Order { blocks: 10, past: 0, asked: true });
        let mut receiver = Receiver::new(NODE);
        desk.run_watching(200_000, serve.run(), || {
            while let Ok(frame) = outgoing.try_receive() {
                receiver.take(&frame).unwrap();
            }
        });
        let Some(Record::Header(header)) = receiver.next_record() else { panic!("no header") };
        assert_eq!((header.cause, header.blocks, header.image), (Cause::Notice, 10, 5));
    }
}
