//! Serve: answers service messages, carries out their actions, and sends bursts.

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

/// Segments of the ring: more than a second of motion.
pub const RING: usize = 512;

/// Time a frame takes on the bus at 500 kbit/s, µs.
const FRAME_US: u64 = FRAME_BITS as u64 * 1_000_000 / 500_000;

/// Frames by which a burst may lag behind its share of the bus and still catch up.
const BEHIND: u64 = 3;

/// Time between two attempts to send while there is something to send, µs.
const BUSY_US: u64 = 1_000;

/// Time for the answer to leave before the block restarts, µs.
const FAREWELL_US: u64 = 50_000;

/// Facts that do not change while the block runs.
#[derive(Clone, Copy, Debug)]
pub struct Identity {
    /// Board that the firmware runs on.
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
    /// Blocks between two estimates according to that image.
    pub publish_every_blocks: u16,
    /// Zero of the force converter according to that image, codes.
    pub zero_code: f32,
}

/// Requests and copies of the samples in, answers and burst frames out.
///
/// Its steps are separate functions, so that their temporaries are not on the stack of every poll.
pub struct Serve<'a, M: RawMutex, R, K, T, C> {
    /// Input of requests.
    pub source: R,
    /// Store for image and settings.
    pub keep: K,
    /// Restart of the chip.
    pub restart: T,
    /// The object server, some kilobytes.
    pub server: &'a mut Server,
    /// The ring and the burst, some kilobytes.
    pub sender: &'a mut Sender<RING>,
    /// Copies of the samples.
    pub blocks: channel::Receiver<'a, M, RawBlock, DEPTH>,
    /// Bursts that the block itself orders, because its model does not fit.
    pub notices: &'a Signal<M, Order>,
    /// Frames for the bus.
    pub outgoing: channel::Sender<'a, M, RawFrame, OUTGOING>,
    /// Settings for the estimator.
    pub tuning: &'a Signal<M, Settings>,
    /// Facts shared with other runners.
    pub facts: &'a Facts,
    /// Facts that do not change.
    pub identity: Identity,
    /// Time.
    pub clock: C,
    /// Signs of life.
    pub liveness: &'a Liveness,
}

/// Work that is still to be done.
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
            // while an answer waits no further request is accepted
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
                    // missing samples end the taking of a zero, too
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
            // a frame about another burst changes nothing
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
            // fits for 136 years
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

    /// Sends as much of a burst as its share of the bus allows.
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

    /// Updates the facts shared with other runners.
    #[inline(never)]
    fn tell(&self) {
        let uptime_s = (self.clock.now_us() / 1_000_000) as u32;
        self.facts.changes.store(self.server.changes(), Ordering::Relaxed);
        self.facts.unlocked.store(self.server.is_unlocked(uptime_s), Ordering::Relaxed);
        self.facts.bursting.store(self.sender.state() != State::Idle, Ordering::Relaxed);
    }
}

/// Waits for a save and shows signs of life meanwhile.
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
mod tests;
