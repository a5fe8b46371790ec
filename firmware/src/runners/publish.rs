//! Publish: sends the block's frames when they are due, and never waits for the bus.

use core::sync::atomic::Ordering;

use can_wire::{Beside, Health, Kind, Publisher, RawFrame, Workings};
use embassy_futures::select::{Either3, select3};
use embassy_sync::blocking_mutex::raw::RawMutex;
use embassy_sync::channel::Receiver;
use embassy_sync::signal::Signal;
use model_core::sample::Reasons;

use crate::facts::Facts;
use crate::liveness::{Liveness, Member, REPORT_WITHIN_US};
use crate::log::{info, warning};
use crate::outbox::Outbox;
use crate::ports::{Clock, FrameSink, Offer};
use crate::runners::estimate::Report;
use crate::schedule::Every;

/// Period of heartbeats, µs.
const HEARTBEAT_US: u64 = 500_000;

/// Period of fault frames while nothing changes, µs.
const FAULT_US: u64 = 1_000_000;

/// Least time between two fault or state frames, µs: reasons that flicker must not fill the bus.
const PAUSE_US: u64 = 100_000;

/// Period of ripple frames, µs; half a second behind the fault frames.
const RIPPLE_US: u64 = 1_000_000;

/// Period of state frames while nothing changes, µs; a quarter of a second off fault and ripple frames.
const STATE_US: u64 = 1_000_000;

/// Period of misfit frames, µs; three quarters of a second behind the fault frames.
const MISFIT_US: u64 = 1_000_000;

/// Period of acting frames, µs; three eighths of a second behind the fault frames.
const ACTING_US: u64 = 1_000_000;

/// Period of log lines, µs.
const LOG_US: u64 = 1_000_000;

/// Time after which a controller without room is tried again, µs: four frames at 500 kbit/s.
const RETRY_US: u64 = 1_000;

/// Frames of service and bursts that may wait.
pub const OUTGOING: usize = 2;

/// Reports in, frames on the bus; in between it sends the frames of [`Serve`](crate::runners::serve::Serve), in their
/// order and none of them displaced.
///
/// Owner of the alive counters of the fault, acting, ripple, misfit, state and heartbeat frames.
pub struct Publish<'a, M: RawMutex, F, C> {
    /// The bus.
    pub sink: F,
    /// Makes the frames.
    pub publisher: Publisher,
    /// Input of reports.
    pub reports: &'a Signal<M, Report>,
    /// Input of frames of service and bursts.
    pub outgoing: Receiver<'a, M, RawFrame, OUTGOING>,
    /// Facts shared with other runners.
    pub facts: &'a Facts,
    /// Content of the heartbeat; frames dropped and state are filled in here.
    pub health: Health,
    /// Hash of the active parameter image, 0 without one.
    pub image: u32,
    /// Travel per ball pass, m, for the ripple frame.
    pub wavelength_m: f32,
    /// Content of the acting frame.
    pub beside: Beside,
    /// Time.
    pub clock: C,
    /// Signs of life.
    pub liveness: &'a Liveness,
}

impl<M: RawMutex, F: FrameSink, C: Clock> Publish<'_, M, F, C> {
    /// Publishes for ever.
    pub async fn run(mut self) -> ! {
        let start_us = self.clock.now_us();
        let mut outbox = Outbox::new();
        let mut heartbeat = Every::new(HEARTBEAT_US, start_us);
        let mut ripple = Every::new(RIPPLE_US, start_us + RIPPLE_US / 2);
        let mut misfit = Every::new(MISFIT_US, start_us + 3 * MISFIT_US / 4);
        let mut acting = Every::new(ACTING_US, start_us + 3 * ACTING_US / 8);
        let mut log = Every::new(LOG_US, start_us + LOG_US);
        let mut fault = Plan::<Reasons>::new(start_us, FAULT_US);
        let mut state = Plan::<Workings>::new(start_us + STATE_US / 4, STATE_US);
        let mut newest: Option<Report> = None;
        let mut serving: Option<RawFrame> = None;
        let mut bus = BusWatch::default();
        loop {
            let now_us = self.clock.now_us();
            if heartbeat.is_due(now_us) {
                self.health.frames_dropped = outbox.dropped();
                outbox.put(Kind::Heartbeat, self.publisher.heartbeat(&self.health));
            }
            let workings = self.workings(newest.as_ref());
            if state.is_due(now_us, workings) {
                outbox.put(Kind::State, self.publisher.state(&workings));
            }
            // sent even while no report comes: the parameters do not depend on samples
            if acting.is_due(now_us) {
                outbox.put(Kind::Acting, self.publisher.acting(&self.beside));
            }
            if let Some(report) = &newest {
                let reasons = report.frames.known.reasons;
                if fault.is_due(now_us, reasons) {
                    let frame = self.publisher.fault(reasons, report.lost_blocks);
                    self.facts.error_register.store(frame.data[2], Ordering::Relaxed);
                    outbox.put(Kind::Fault, frame);
                }
                if ripple.is_due(now_us) {
                    outbox.put(Kind::Ripple, self.publisher.ripple(report.ripple, self.wavelength_m));
                }
                if misfit.is_due(now_us) {
                    let tick = report.frames.known.tick;
                    outbox.put(Kind::Misfit, self.publisher.misfit(&report.verdict, tick));
                }
                if log.is_due(now_us) {
                    say(report, outbox.dropped());
                }
            }
            outbox.flush(&mut self.sink);
            if let Some(frame) = &serving
                && !self.sink.holds(frame.id)
                && self.sink.offer(frame) == Offer::Taken
            {
                serving = None;
            }
            self.facts.bus_offs.set(bus.count(self.sink.is_off()));
            self.facts.frames_dropped.set(outbox.dropped());
            self.liveness.report(Member::Publish);

            // a busy controller is checked often: a bus-off lasts only three milliseconds
            let all_out = outbox.is_empty() && serving.is_none() && self.sink.is_idle();
            let retry_us = if all_out { REPORT_WITHIN_US / 2 } else { RETRY_US };
            let wake_us = heartbeat.next_us().min(now_us + retry_us);
            let next = async {
                match serving {
                    None => self.outgoing.receive().await,
                    Some(_) => core::future::pending().await,
                }
            };
            match select3(self.reports.wait(), next, self.clock.sleep_until(wake_us)).await {
                Either3::First(report) => {
                    outbox.put(Kind::Estimate, report.frames.estimate);
                    outbox.put(Kind::Motion, report.frames.motion);
                    self.facts.lost_blocks.set(report.lost_blocks);
                    // later silence is reported by the estimate; going back to boot-up would look like a reset
                    self.health.operational |= report.fresh;
                    newest = Some(report);
                }
                Either3::Second(frame) => serving = Some(frame),
                Either3::Third(()) => {}
            }
        }
    }
}

impl<M: RawMutex, F, C> Publish<'_, M, F, C> {
    fn workings(&self, newest: Option<&Report>) -> Workings {
        let preload = newest.and_then(|report| report.frames.known.preload_n);
        Workings {
            image: self.image,
            changes: self.facts.changes.load(Ordering::Relaxed),
            limits: self.facts.limits().judge(preload.map(|p| p.value)),
            unlocked: self.facts.unlocked.load(Ordering::Relaxed),
            bursting: self.facts.bursting.load(Ordering::Relaxed),
        }
    }
}

/// Counts how often the controller has left the bus.
#[derive(Clone, Copy, Debug, Default)]
struct BusWatch {
    off: bool,
    count: u32,
}

impl BusWatch {
    fn count(&mut self, off: bool) -> u32 {
        if off && !self.off {
            self.count = self.count.saturating_add(1);
            warning!("bus-off, the {=u32}th", self.count);
        }
        self.off = off;
        self.count
    }
}

/// When a fault or state frame is due: every second, and soon after its content changes.
#[derive(Clone, Copy, Debug)]
struct Plan<T> {
    repeat: Every,
    told: Option<T>,
    not_before_us: u64,
}

impl<T: PartialEq> Plan<T> {
    const fn new(first_us: u64, period_us: u64) -> Self {
        Plan { repeat: Every::new(period_us, first_us), told: None, not_before_us: first_us }
    }

    fn is_due(&mut self, now_us: u64, said: T) -> bool {
        if now_us < self.not_before_us {
            return false;
        }
        let due = self.repeat.is_due(now_us) || self.told.as_ref() != Some(&said);
        if due {
            self.told = Some(said);
            self.not_before_us = now_us + PAUSE_US;
        }
        due
    }
}

/// Writes the log line, once a second.
fn say(report: &Report, dropped: u32) {
    let known = &report.frames.known;
    let reason = known.reasons.first().map_or("trusted", |r| r.name());
    let number = |m: Option<model_core::sample::Measured>| m.map_or((f32::NAN, f32::NAN), |m| (m.value, m.sigma));
    let (preload, sigma) = number(known.preload_n);
    let (drag, _) = number(known.drag_force_n);
    let (speed, _) = number(known.speed_m_s);
    let amplitude = report.ripple.map_or(f32::NAN, |r| r.amplitude_n);
    info!(
        "{=str}: preload {=f32} N +- {=f32}, drag {=f32} N, {=f32} m/s, {=f32} degC, ripple {=f32} N",
        reason,
        preload,
        sigma,
        drag,
        speed,
        known.temperature_degc.unwrap_or(f32::NAN),
        amplitude
    );
    if report.lost_blocks > 0 || dropped > 0 {
        warning!("since start-up: {=u32} blocks lost, {=u32} frames dropped", report.lost_blocks, dropped);
    }
}

#[cfg(test)]
mod tests {
    use can_wire::service::{LimitState, Limits};
    use can_wire::{BoardKind, Message, NodeId, ResetCause, decode};
    use embassy_sync::blocking_mutex::raw::NoopRawMutex;
    use embassy_sync::channel::Channel;
    use model_core::consistency::Verdict;
    use model_core::left_out::Acting;
    use model_core::monitor::Monitor;
    use model_core::params::Params;
    use model_core::sample::{Estimate, Measured, Reason};

    use super::*;
    use crate::Frames;
    use crate::runners::rehearsal::{Controller, Desk};

    fn monitor() -> Monitor {
        Params::ZHOU_2023.build().unwrap()
    }

    fn publish<'a>(
        desk: &'a Desk,
        bus: &'a Controller,
        reports: &'a Signal<NoopRawMutex, Report>,
        outgoing: &'a Channel<NoopRawMutex, RawFrame, OUTGOING>,
        facts: &'a Facts,
        liveness: &'a Liveness,
    ) -> Publish<'a, NoopRawMutex, &'a Controller, &'a Desk> {
        Publish {
            sink: bus,
            publisher: Publisher::new(NodeId::FIRST),
            reports,
            outgoing: outgoing.receiver(),
            facts,
            health: Health {
                reset_cause: ResetCause::Pin,
                board: BoardKind::Unknown,
                boot_count: 3,
                frames_dropped: 0,
                operational: false,
            },
            image: 0xABCD,
            wavelength_m: 0.0143,
            beside: Beside { acting: Acting::NONE, record: true, calibrated: true },
            clock: desk,
            liveness,
        }
    }

    fn report(publisher: &mut Publisher, reasons: &[Reason]) -> Report {
        let mut known: Estimate = monitor().stale(0);
        known.reasons = Reasons::NONE;
        reasons.iter().for_each(|r| known.reasons.insert(*r));
        Report {
            frames: Frames::of(known, publisher),
            fresh: true,
            lost_blocks: 2,
            ripple: None,
            verdict: Verdict::NONE,
        }
    }

    /// Reports every 100 ms, with the reasons that `reasons` names for that time in ms.
    async fn feed(desk: &Desk, reports: &Signal<NoopRawMutex, Report>, reasons: impl Fn(u64) -> Vec<Reason>) {
        let mut publisher = Publisher::new(NodeId::FIRST);
        for at_ms in (100..).step_by(100) {
            desk.sleep_until(1000 * at_ms).await;
            reports.signal(report(&mut publisher, &reasons(at_ms)));
        }
    }

    /// When frames of this kind went out, ms.
    fn times(bus: &Controller, kind: Kind) -> Vec<u64> {
        let id = kind.identifier(NodeId::FIRST);
        bus.log.borrow().iter().filter(|(_, f)| f.id == id).map(|(t, _)| t / 1000).collect()
    }

    fn last(bus: &Controller, kind: Kind) -> RawFrame {
        let id = kind.identifier(NodeId::FIRST);
        bus.log.borrow().iter().rev().find(|(_, f)| f.id == id).unwrap().1
    }

    #[test]
    fn every_frame_has_its_rate() {
        let (desk, bus, liveness) = (Desk::new(), Controller::new(), Liveness::new());
        let (reports, outgoing, facts) = (Signal::new(), Channel::new(), Facts::new());
        let both = embassy_futures::join::join(
            feed(&desk, &reports, |_| vec![Reason::NoMotion]),
            publish(&desk, &bus, &reports, &outgoing, &facts, &liveness).run(),
        );
        desk.run_watching(3_050_000, both, || bus.transmit(desk.now_us()));
        let every = |first: u64, step: usize| (first..=3050).step_by(step).collect::<Vec<_>>();
        assert_eq!(times(&bus, Kind::Estimate), every(100, 100));
        assert_eq!(times(&bus, Kind::Motion), every(100, 100));
        // beside estimate, motion and fault or ripple it is the fourth: it waits for a mailbox
        assert_eq!(times(&bus, Kind::Heartbeat), [0, 501, 1001, 1501, 2001, 2501, 3001]);
        assert_eq!(times(&bus, Kind::Ripple), every(500, 1000));
        // at the first check after it was due
        assert_eq!(times(&bus, Kind::State), [251, 1251, 2251]);
        assert_eq!(times(&bus, Kind::Fault), [100, 1000, 2000, 3000]);
        assert_eq!(times(&bus, Kind::Misfit), every(751, 1000));
        assert_eq!(times(&bus, Kind::Acting), every(400, 1000));
        let frame = last(&bus, Kind::Heartbeat);
        let Ok((_, Message::Heartbeat(beat))) = decode(frame.id, &frame.data) else { panic!("{frame:?}") };
        assert_eq!((beat.boot_count, beat.frames_dropped, beat.counter), (3, 0, 6));
    }

    #[test]
    fn a_change_of_reasons_is_told_at_once_but_flicker_is_not() {
        let (desk, bus, liveness) = (Desk::new(), Controller::new(), Liveness::new());
        let (reports, outgoing, facts) = (Signal::new(), Channel::new(), Facts::new());
        let reasons = |at_ms| if at_ms < 1300 { vec![Reason::NoMotion] } else { vec![] };
        let both = embassy_futures::join::join(
            feed(&desk, &reports, reasons),
            publish(&desk, &bus, &reports, &outgoing, &facts, &liveness).run(),
        );
        desk.run_watching(1_950_000, both, || bus.transmit(desk.now_us()));
        assert_eq!(times(&bus, Kind::Fault), [100, 1000, 1300]);

        let mut plan = Plan::new(0, FAULT_US);
        let mut flicker = Reasons::NONE;
        flicker.insert(Reason::Reversing);
        let told =
            (0..1000).filter(|t| plan.is_due(1000 * t, if t % 2 == 0 { flicker } else { Reasons::NONE })).count();
        assert!(told <= 10, "{told}");
    }

    #[test]
    fn what_was_changed_and_where_the_preload_lies_is_told_at_once() {
        let (desk, bus, liveness) = (Desk::new(), Controller::new(), Liveness::new());
        let (reports, outgoing, facts) = (Signal::new(), Channel::new(), Facts::new());
        let mut publisher = Publisher::new(NodeId::FIRST);
        let mut report = report(&mut publisher, &[]);
        report.frames.known.preload_n = Some(Measured { value: 1500.0, sigma: 10.0 });
        let change = async {
            desk.sleep_until(600_000).await;
            facts.changes.store(1, Ordering::Relaxed);
            facts.set_limits(&Limits { warn_below_n: Some(2000), alarm_below_n: Some(1000), ..Limits::OFF });
            desk.sleep_until(1_500_000).await;
            reports.signal(report);
            desk.sleep_until(1_700_000).await;
            report.frames.known.preload_n = Some(Measured { value: 999.0, sigma: 10.0 });
            reports.signal(report);
        };
        let both =
            embassy_futures::join::join(change, publish(&desk, &bus, &reports, &outgoing, &facts, &liveness).run());
        desk.run_watching(2_000_000, both, || bus.transmit(desk.now_us()));
        let told: Vec<_> = bus
            .log
            .borrow()
            .iter()
            .filter_map(|(at_us, frame)| match decode(frame.id, &frame.data) {
                Ok((_, Message::State(m))) => Some((at_us / 1000, m.image, m.changes, m.limits)),
                _ => None,
            })
            .collect();
        let [first, changed, regular, warned, alarmed] = told[..] else { panic!("{told:?}") };
        assert_eq!(first, (251, 0xABCD, 0, LimitState::NotJudged));
        // within the time between two checks
        assert!((600..=650).contains(&changed.0) && changed.2 == 1, "{changed:?}");
        assert_eq!((regular.0, regular.2), (1251, 1));
        // behind estimate, motion and fault it waits for a mailbox
        assert_eq!((warned.0, warned.3), (1501, LimitState::Warning));
        assert!((1700..=1701).contains(&alarmed.0) && alarmed.3 == LimitState::Alarm, "{alarmed:?}");
    }

    #[test]
    fn a_bus_that_nobody_acknowledges_costs_nothing_but_frames() {
        let (desk, bus, liveness) = (Desk::new(), Controller::new(), Liveness::new());
        let (reports, outgoing, facts) = (Signal::new(), Channel::new(), Facts::new());
        let both = embassy_futures::join::join(
            feed(&desk, &reports, |_| vec![]),
            publish(&desk, &bus, &reports, &outgoing, &facts, &liveness).run(),
        );
        let mut silent_ms = 0;
        desk.run_watching(5_050_000, both, || {
            liveness.report(Member::Acquire);
            liveness.report(Member::Estimate);
            liveness.report(Member::Serve);
            if liveness.take_all() {
                silent_ms = desk.now_us() / 1000;
            }
            assert!(desk.now_us() / 1000 - silent_ms <= 100, "publish hangs");
            if desk.now_us() > 5_000_000 {
                bus.transmit(desk.now_us());
            }
        });
        // the bus came back at 5 s: one frame of each kind, the newest
        for kind in Kind::ALL {
            assert_eq!(times(&bus, kind).len(), 1, "{kind:?}");
        }
        let frame = last(&bus, Kind::Estimate);
        let Ok((_, Message::Estimate(newest))) = decode(frame.id, &frame.data) else { panic!("{frame:?}") };
        assert_eq!(newest.counter, (50 - 1) % 16);
        let frame = last(&bus, Kind::Heartbeat);
        let Ok((_, Message::Heartbeat(beat))) = decode(frame.id, &frame.data) else { panic!("{frame:?}") };
        // displaced by then: 48 or 49 estimates and motions, 9 heartbeats, 4 ripples, 4 misfits, 4 images,
        // 5 faults
        assert!((118..=128).contains(&beat.frames_dropped), "{}", beat.frames_dropped);
    }
}
