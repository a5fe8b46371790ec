//! Supervise: feeds the watchdog as long as all runners work.

use crate::liveness::{Liveness, REPORT_WITHIN_US};
use crate::ports::{Clock, Watchdog};

/// Nominal timeout of the watchdog, µs.
pub const WATCHDOG_US: u32 = 500_000;

/// Feeds only when acquire, estimate, publish and serve have all reported since the last feeding.
pub struct Supervise<'a, W, C> {
    /// The watchdog.
    pub watchdog: W,
    /// Time.
    pub clock: C,
    /// Signs of life.
    pub liveness: &'a Liveness,
}

impl<W: Watchdog, C: Clock> Supervise<'_, W, C> {
    /// Supervises for ever.
    pub async fn run(mut self) -> ! {
        let mut look_us = self.clock.now_us();
        loop {
            look_us += REPORT_WITHIN_US;
            self.clock.sleep_until(look_us).await;
            if self.liveness.take_all() {
                self.watchdog.feed();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;
    use std::rc::Rc;

    use super::*;
    use crate::liveness::Member;
    use crate::runners::rehearsal::Desk;

    struct Bowl<'a>(&'a Desk, Rc<RefCell<Vec<u64>>>);
    impl Watchdog for Bowl<'_> {
        fn feed(&mut self) {
            self.1.borrow_mut().push(self.0.now_us() / 1000);
        }
    }

    #[test]
    fn the_dog_is_fed_until_someone_falls_silent() {
        let (desk, liveness, fed) = (Desk::new(), Liveness::new(), Rc::default());
        let supervise = Supervise { watchdog: Bowl(&desk, Rc::clone(&fed)), clock: &desk, liveness: &liveness };
        let reporting = async {
            for at_us in (0..).step_by(10_000) {
                desk.sleep_until(at_us).await;
                liveness.report(Member::Acquire);
                liveness.report(Member::Publish);
                liveness.report(Member::Serve);
                if at_us < 350_000 {
                    liveness.report(Member::Estimate);
                }
            }
        };
        desk.run_watching(2_000_000, embassy_futures::join::join(reporting, supervise.run()), || {});
        assert_eq!(*fed.borrow(), [100, 200, 300, 400]);
    }
}
