//! Estimate: runs the pipeline over the blocks, and reports `stale` when no blocks come.

use can_wire::Publisher;
use can_wire::burst::Order;
use can_wire::service::Settings;
use embassy_futures::select::{Either, select};
use embassy_sync::blocking_mutex::raw::RawMutex;
use embassy_sync::channel::Receiver;
use embassy_sync::signal::Signal;
use model_core::consistency::{Consistency, Verdict, Watch};
use model_core::monitor::{Monitor, State};
use model_core::params::Params;
use model_core::ripple::Ripple;
use model_core::sample::RawBlock;

use crate::liveness::{Liveness, Member, REPORT_WITHIN_US};
use crate::ports::Clock;
use crate::runners::acquire::DEPTH;
use crate::timeline::BLOCK_US;
use crate::{Frames, process_block};

/// Publishing periods without an estimate before `stale` is reported on the bus.
const STALE_AFTER_PERIODS: u64 = 3;

/// The burst that a block sends by itself when it notices that its model does not fit: one minute, with the second
/// before.
pub const NOTICE: Order = Order { blocks: NOTICE_BLOCKS, past: 100, asked: false };

/// Blocks of one minute.
const NOTICE_BLOCKS: u16 = 6000;

/// Report to the publisher, at the publishing rate.
#[derive(Clone, Copy, Debug)]
pub struct Report {
    /// The finished frames.
    pub frames: Frames,
    /// Whether it is made from new samples.
    pub fresh: bool,
    /// Blocks lost since start-up.
    pub lost_blocks: u32,
    /// Ball-pass ripple, if known.
    pub ripple: Option<Ripple>,
    /// Whether the model fits.
    pub verdict: Verdict,
}

/// Blocks in, finished frames out. A report that was not fetched is replaced by the next.
///
/// Owner of the alive counters of the estimate and motion frames. They go on, with reason `stale`, when no
/// samples come, so that a receiver can tell a blind block from a dead one.
pub struct Estimate<'a, M: RawMutex, C> {
    /// The checked model from the parameter record; settings of the block change it.
    pub monitor: &'a mut Monitor,
    /// Settings of the block; used from the next block of samples on.
    pub tuning: &'a Signal<M, Settings>,
    /// State that samples change, some kilobytes.
    pub state: &'a mut State,
    /// State of the check whether the model fits.
    pub watch: &'a mut Watch,
    /// Makes the frames.
    pub publisher: Publisher,
    /// Input of blocks.
    pub blocks: Receiver<'a, M, RawBlock, DEPTH>,
    /// Output of reports.
    pub reports: &'a Signal<M, Report>,
    /// Output of the order for a burst, when the model stops fitting.
    pub notices: &'a Signal<M, Order>,
    /// Time.
    pub clock: C,
    /// Signs of life.
    pub liveness: &'a Liveness,
}

impl<M: RawMutex, C: Clock> Estimate<'_, M, C> {
    /// Estimates for ever.
    pub async fn run(mut self) -> ! {
        let of_record = Tunable::of(self.monitor.params());
        let mut period_us = u64::from(of_record.publish_every_blocks) * BLOCK_US;
        let mut fit = Consistency::new(self.monitor.params());
        let mut stale_at_us = self.clock.now_us() + STALE_AFTER_PERIODS * period_us;
        let mut newest = (0_u32, self.clock.now_us());
        let mut fitted = true;
        loop {
            if let Some(settings) = self.tuning.try_take() {
                tune(self.monitor, of_record, &settings);
                period_us = u64::from(self.monitor.params().publish_every_blocks) * BLOCK_US;
                fit = Consistency::new(self.monitor.params());
                stale_at_us = self.clock.now_us() + STALE_AFTER_PERIODS * period_us;
            }
            let wake_us = stale_at_us.min(self.clock.now_us() + REPORT_WITHIN_US / 2);
            match select(self.blocks.receive(), self.clock.sleep_until(wake_us)).await {
                Either::First(block) => {
                    newest = (block.tick, self.clock.now_us());
                    let frames = process_block(self.monitor, self.state, &mut self.publisher, &block);
                    if let Some(frames) = frames {
                        stale_at_us = self.clock.now_us() + STALE_AFTER_PERIODS * period_us;
                        watch_fit(&fit, self.watch, &frames, self.state);
                        self.report(frames, true);
                    }
                }
                Either::Second(()) if self.clock.now_us() >= stale_at_us => {
                    stale_at_us += period_us;
                    let (tick, at_us) = newest;
                    let silent_blocks = (self.clock.now_us() - at_us) / BLOCK_US;
                    // ticks wrap
                    let stale = self.monitor.stale(tick.wrapping_add(silent_blocks as u32));
                    let frames = Frames::of(stale, &mut self.publisher);
                    watch_fit(&fit, self.watch, &frames, self.state);
                    self.report(frames, false);
                }
                Either::Second(()) => {}
            }
            let fits = self.watch.verdict().misfit_since.is_none();
            if fitted && !fits {
                self.notices.signal(NOTICE);
            }
            fitted = fits;
            self.liveness.report(Member::Estimate);
        }
    }

    fn report(&self, frames: Frames, fresh: bool) {
        self.reports.signal(Report {
            frames,
            fresh,
            lost_blocks: self.state.lost_blocks(),
            ripple: if fresh { self.state.ripple() } else { None },
            verdict: self.watch.verdict(),
        });
    }
}

/// The parameters that settings change. The whole set is too large for a copy.
#[derive(Clone, Copy, Debug)]
struct Tunable {
    zero_code: f32,
    publish_every_blocks: u16,
}

impl Tunable {
    fn of(params: &Params) -> Tunable {
        Tunable { zero_code: params.calibration.force.zero_code, publish_every_blocks: params.publish_every_blocks }
    }

    fn put_into(self, monitor: &mut Monitor) -> Result<(), model_core::Error> {
        monitor.set_up(|params| {
            params.calibration.force.zero_code = self.zero_code;
            params.publish_every_blocks = self.publish_every_blocks;
            Ok(())
        })
    }
}

/// Puts the settings into the model; where that would make an illegal one, the model stays.
#[inline(never)]
fn tune(monitor: &mut Monitor, of_record: Tunable, settings: &Settings) {
    let in_use = Tunable::of(monitor.params());
    let tuned = Tunable {
        zero_code: of_record.zero_code + f32::from(settings.zero_shift_sixteenths) / 16.0,
        publish_every_blocks: settings.publish_every_blocks.unwrap_or(of_record.publish_every_blocks),
    };
    if tuned.put_into(monitor).is_err() {
        // was legal before, so this succeeds
        let _ = in_use.put_into(monitor);
    }
}

/// One step of the check of the model, at the publishing rate. A function of its own, so that its cost can be measured.
#[inline(never)]
pub fn watch_fit(fit: &Consistency, watch: &mut Watch, frames: &Frames, state: &State) {
    fit.step(watch, &frames.known, state.working_point());
}

#[cfg(test)]
mod tests {
    use can_wire::{Message, NodeId, decode};
    use embassy_sync::blocking_mutex::raw::NoopRawMutex;
    use embassy_sync::channel::Channel;
    use model_core::sample::{Reason, SAMPLES_PER_BLOCK};

    use super::*;
    use crate::runners::rehearsal::Desk;

    const N: usize = SAMPLES_PER_BLOCK;

    fn block(tick: u32) -> RawBlock {
        RawBlock { tick, force: [2100; N], temperature: [2048; N], position: [tick as u16; N] }
    }

    #[test]
    fn frames_are_those_of_the_pipeline_and_go_on_when_samples_stop() {
        let desk = Desk::new();
        let liveness = Liveness::new();
        let blocks = Channel::<NoopRawMutex, RawBlock, DEPTH>::new();
        let reports = Signal::<NoopRawMutex, Report>::new();
        let tuning = Signal::new();
        let mut monitor = Params { publish_every_blocks: 10, ..Params::ZHOU_2023 }.build().unwrap();
        let mut state = State::new();
        let estimate = Estimate {
            monitor: &mut monitor,
            tuning: &tuning,
            state: &mut state,
            watch: &mut Watch::new(),
            publisher: Publisher::new(NodeId::FIRST),
            blocks: blocks.receiver(),
            reports: &reports,
            notices: &Signal::new(),
            clock: &desk,
            liveness: &liveness,
        };
        // 40 blocks of 10 ms, then silence
        let feed = async {
            for tick in 0..40 {
                desk.sleep_until(u64::from(tick + 1) * BLOCK_US).await;
                blocks.try_send(block(tick)).unwrap();
            }
        };
        let mut seen = Vec::new();
        desk.run_watching(1_000_500, embassy_futures::join::join(feed, estimate.run()), || {
            if let Some(report) = reports.try_take() {
                seen.push((desk.now_us(), report));
            }
        });

        let times: Vec<u64> = seen.iter().map(|(t, _)| *t / 1000).collect();
        assert_eq!(times, [100, 200, 300, 400, 700, 800, 900, 1000]);

        let mut state = State::new();
        let mut publisher = Publisher::new(NodeId::FIRST);
        let mut expected = (0..40).filter_map(|t| process_block(&monitor, &mut state, &mut publisher, &block(t)));
        for (n, (at_us, report)) in seen.iter().enumerate() {
            assert_eq!(report.fresh, n < 4);
            if report.fresh {
                assert_eq!(Some(report.frames), expected.next());
            } else {
                assert!(report.frames.known.reasons.contains(Reason::Stale));
                // the last block, tick 39, came at 400 ms
                assert_eq!(u64::from(report.frames.known.tick), 39 + (at_us - 400_000) / BLOCK_US);
            }
            let frame = report.frames.estimate;
            let Ok((_, Message::Estimate(message))) = decode(frame.id, &frame.data) else { panic!("{frame:?}") };
            assert_eq!(usize::from(message.counter), n);
        }
    }

    #[test]
    fn it_reports_even_when_nothing_comes() {
        let desk = Desk::new();
        let liveness = Liveness::new();
        let blocks = Channel::<NoopRawMutex, RawBlock, DEPTH>::new();
        let reports = Signal::<NoopRawMutex, Report>::new();
        let tuning = Signal::new();
        let mut monitor = Params { publish_every_blocks: 1000, ..Params::ZHOU_2023 }.build().unwrap();
        let mut state = State::new();
        let estimate = Estimate {
            monitor: &mut monitor,
            tuning: &tuning,
            state: &mut state,
            watch: &mut Watch::new(),
            publisher: Publisher::new(NodeId::FIRST),
            blocks: blocks.receiver(),
            reports: &reports,
            notices: &Signal::new(),
            clock: &desk,
            liveness: &liveness,
        };
        liveness.report(Member::Acquire);
        liveness.report(Member::Publish);
        liveness.report(Member::Serve);
        let mut heard_us = Vec::new();
        desk.run_watching(1_000_000, estimate.run(), || {
            if liveness.take_all() {
                heard_us.push(desk.now_us());
                liveness.report(Member::Acquire);
                liveness.report(Member::Publish);
                liveness.report(Member::Serve);
            }
        });
        assert!(heard_us.len() > 9);
        assert!(heard_us.windows(2).all(|w| w[1] - w[0] <= REPORT_WITHIN_US));
    }
    #[test]
    fn what_is_set_holds_from_then_on() {
        let desk = Desk::new();
        let liveness = Liveness::new();
        let blocks = Channel::<NoopRawMutex, RawBlock, DEPTH>::new();
        let reports = Signal::<NoopRawMutex, Report>::new();
        let tuning = Signal::new();
        let mut monitor = Params { publish_every_blocks: 10, ..Params::ZHOU_2023 }.build().unwrap();
        let mut state = State::new();
        let estimate = Estimate {
            monitor: &mut monitor,
            tuning: &tuning,
            state: &mut state,
            watch: &mut Watch::new(),
            publisher: Publisher::new(NodeId::FIRST),
            blocks: blocks.receiver(),
            reports: &reports,
            notices: &Signal::new(),
            clock: &desk,
            liveness: &liveness,
        };
        let feed = async {
            for tick in 0..40 {
                desk.sleep_until(u64::from(tick + 1) * BLOCK_US).await;
                blocks.try_send(block(tick)).unwrap();
                if tick == 21 {
                    tuning.signal(Settings { publish_every_blocks: Some(2), ..Settings::DELIVERED });
                }
                if tick == 30 {
                    // a zero beyond the converter's range makes an illegal model: the one in use stays
                    tuning.signal(Settings { zero_shift_sixteenths: i16::MAX, ..Settings::DELIVERED });
                }
            }
        };
        let mut times = Vec::new();
        desk.run_watching(400_500, embassy_futures::join::join(feed, estimate.run()), || {
            if reports.try_take().is_some() {
                times.push(desk.now_us() / 1000);
            }
        });
        assert_eq!(times, [100, 200, 240, 260, 280, 300, 320, 340, 360, 380, 400]);
    }

    #[test]
    fn a_zero_that_was_taken_moves_the_zero_code() {
        let settings = Settings { zero_shift_sixteenths: -24, ..Settings::DELIVERED };
        let mut tuned = Params::ZHOU_2023.build().unwrap();
        tune(&mut tuned, Tunable::of(&Params::ZHOU_2023), &settings);
        let before = Params::ZHOU_2023.calibration.force.zero_code;
        assert_eq!(tuned.params().calibration.force.zero_code, before - 1.5);
    }
}
