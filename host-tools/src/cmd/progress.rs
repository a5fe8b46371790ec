//! A progress bar on standard error: only on a terminal, and only where something takes longer than a moment.

use std::io::{IsTerminal, stderr};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Time from which work gets a bar.
const MOMENT: Duration = Duration::from_secs(1);

/// A bar that clears itself away.
pub(crate) struct Bar {
    bar: Option<ProgressBar>,
    start: Instant,
}

impl Bar {
    /// A bar over bytes.
    pub(crate) fn of_bytes(name: &str) -> Self {
        Self::new(name, "{msg} {bar:30} {bytes} of {total_bytes}, {eta} left")
    }

    /// A spinner for work of unknown length; it is shown at once.
    pub(crate) fn busy(name: &str) -> Self {
        let bar = Self::new(name, "{spinner} {msg}, {elapsed}");
        if let Some(bar) = &bar.bar {
            bar.enable_steady_tick(MOMENT);
        }
        bar
    }

    fn new(name: &str, template: &str) -> Self {
        let bar = stderr().is_terminal().then(|| {
            let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr());
            if let Ok(style) = ProgressStyle::with_template(template) {
                bar.set_style(style);
            }
            bar.set_message(name.to_owned());
            bar
        });
        Bar { bar, start: Instant::now() }
    }

    /// Updates the bar; may be called from any thread.
    pub(crate) fn at(&self, done: u64, of: u64) {
        if let Some(bar) = &self.bar
            && self.start.elapsed() > MOMENT
        {
            bar.set_length(of);
            bar.set_position(done);
        }
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
