//! Test doubles of the ports: a clock that jumps to the next event, a sampler with a script, a bus
//! controller with three mailboxes.

use std::cell::{Cell, RefCell};
use std::collections::VecDeque;
use std::pin::pin;
use std::rc::Rc;
use std::task::{Context, Poll, Waker};

use can_wire::RawFrame;

use crate::ports::{Clock, FrameSink, FrameSource, Interruption, Offer, SampleRun, SampleSource, Samples};
use crate::timeline::BLOCK_US;

/// Virtual time.
pub(crate) struct Desk {
    now_us: Cell<u64>,
    next_us: Cell<u64>,
}

impl Desk {
    pub(crate) fn new() -> Self {
        Desk { now_us: Cell::new(0), next_us: Cell::new(u64::MAX) }
    }

    /// Runs `future` until the clock would pass `until_us`, and calls `watch` at every instant at which
    /// something was due.
    pub(crate) fn run_watching(&self, until_us: u64, future: impl Future, mut watch: impl FnMut()) {
        let mut future = pin!(future);
        let mut context = Context::from_waker(Waker::noop());
        while self.now_us.get() <= until_us {
            // messages between runners take no time, but a few rounds of polling
            for _ in 0..4 {
                self.next_us.set(u64::MAX);
                let _ = future.as_mut().poll(&mut context);
            }
            watch();
            self.now_us.set(self.next_us.get());
        }
    }
}

impl Clock for &Desk {
    fn now_us(&self) -> u64 {
        self.now_us.get()
    }

    async fn sleep_until(&self, us: u64) {
        std::future::poll_fn(|_| {
            if self.now_us.get() >= us {
                return Poll::Ready(());
            }
            self.next_us.set(self.next_us.get().min(us));
            Poll::Pending
        })
        .await;
    }
}

impl Desk {
    pub(crate) fn now_us(&self) -> u64 {
        self.now_us.get()
    }

    pub(crate) async fn sleep_until(&self, us: u64) {
        Clock::sleep_until(&self, us).await;
    }
}

/// What the sampler does next.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Event {
    /// A block, a block's time later.
    Block,
    /// An overrun, a block's time later.
    Overrun,
    /// An overrun at once.
    Broken,
    /// Nothing, until it is started again.
    Silence,
}

/// A sampler that follows a script; behind its end, blocks for ever.
pub(crate) struct Script<'a> {
    desk: &'a Desk,
    events: VecDeque<Event>,
    pub(crate) starts: Rc<Cell<usize>>,
}

impl<'a> Script<'a> {
    pub(crate) fn new(desk: &'a Desk, events: Vec<Event>) -> Self {
        Script { desk, events: events.into(), starts: Rc::default() }
    }
}

impl SampleSource for Script<'_> {
    type Run<'b>
        = ScriptRun<'b>
    where
        Self: 'b;

    fn start(&mut self) -> ScriptRun<'_> {
        self.starts.set(self.starts.get() + 1);
        ScriptRun { desk: self.desk, events: &mut self.events, next_us: self.desk.now_us() }
    }
}

pub(crate) struct ScriptRun<'a> {
    desk: &'a Desk,
    events: &'a mut VecDeque<Event>,
    next_us: u64,
}

impl SampleRun for ScriptRun<'_> {
    async fn block(&mut self, into: &mut Samples) -> Result<(), Interruption> {
        self.next_us += BLOCK_US;
        match self.events.pop_front().unwrap_or(Event::Block) {
            Event::Block => {
                self.desk.sleep_until(self.next_us).await;
                *into = Samples::EMPTY;
                Ok(())
            }
            Event::Overrun => {
                self.desk.sleep_until(self.next_us).await;
                Err(Interruption::ConverterOverrun)
            }
            Event::Broken => Err(Interruption::RingOverrun),
            Event::Silence => std::future::pending().await,
        }
    }
}

/// Three mailboxes, sent by identifier.
pub(crate) struct Controller {
    mailboxes: RefCell<[Option<RawFrame>; 3]>,
    /// Frames sent, with the time of [`transmit`](Self::transmit), µs.
    pub(crate) log: RefCell<Vec<(u64, RawFrame)>>,
    /// Whether the controller has left the bus.
    pub(crate) off: Cell<bool>,
}

impl Controller {
    pub(crate) fn new() -> Self {
        Controller { mailboxes: RefCell::default(), log: RefCell::default(), off: Cell::new(false) }
    }

    /// The bus takes all frames that wait.
    pub(crate) fn transmit(&self, now_us: u64) {
        let mut waiting: Vec<RawFrame> = self.mailboxes.borrow_mut().iter_mut().filter_map(Option::take).collect();
        waiting.sort_by_key(|f| f.id);
        self.log.borrow_mut().extend(waiting.into_iter().map(|f| (now_us, f)));
    }

    pub(crate) fn sent(&self) -> Vec<RawFrame> {
        self.log.borrow().iter().map(|(_, f)| *f).collect()
    }
}

impl FrameSink for &Controller {
    fn offer(&mut self, frame: &RawFrame) -> Offer {
        let mut mailboxes = self.mailboxes.borrow_mut();
        if let Some(older) = mailboxes.iter_mut().find(|m| m.is_some_and(|f| f.id == frame.id)) {
            *older = None;
            return Offer::Withdrawing;
        }
        match mailboxes.iter_mut().find(|m| m.is_none()) {
            Some(free) => {
                *free = Some(*frame);
                Offer::Taken
            }
            None => Offer::Busy,
        }
    }

    fn holds(&self, id: u16) -> bool {
        self.mailboxes.borrow().iter().flatten().any(|f| f.id == id)
    }

    fn is_idle(&self) -> bool {
        self.mailboxes.borrow().iter().all(Option::is_none)
    }

    fn is_off(&self) -> bool {
        self.off.get()
    }
}

/// Frames from elsewhere, as a test puts them in.
#[derive(Default)]
pub(crate) struct Inbox(RefCell<VecDeque<RawFrame>>);

impl Inbox {
    pub(crate) fn put(&self, frame: RawFrame) {
        self.0.borrow_mut().push_back(frame);
    }
}

impl FrameSource for &Inbox {
    async fn frame(&mut self) -> RawFrame {
        std::future::poll_fn(|_| self.0.borrow_mut().pop_front().map_or(Poll::Pending, Poll::Ready)).await
    }
}
