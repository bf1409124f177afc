//! Progress bars: on a terminal only, and only for work that lasts.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

/// A bar on standard error that appears after a moment, hides where standard error is no terminal, and vanishes
/// when dropped. It may be advanced from several threads.
pub struct Progress {
    bar: ProgressBar,
    start: Instant,
    count: AtomicU64,
}

/// What ends sooner shows no bar.
const PATIENCE: Duration = Duration::from_millis(700);

impl Progress {
    /// A bar of `steps` steps with a title; none if `quiet`.
    pub fn new(title: &str, steps: usize, quiet: bool) -> Self {
        let bar = if quiet {
            ProgressBar::hidden()
        } else {
            ProgressBar::new(steps as u64)
        };
        let style = ProgressStyle::with_template("{prefix} {wide_bar} {pos}/{len} {elapsed} {msg}")
            .unwrap_or_else(|_| ProgressStyle::default_bar());
        bar.set_style(style);
        bar.set_prefix(title.to_owned());
        Progress {
            bar,
            start: Instant::now(),
            count: AtomicU64::new(0),
        }
    }

    /// A count of unknown length; none if `quiet`.
    pub fn open(title: &str, quiet: bool) -> Self {
        let progress = Progress::new(title, 0, quiet);
        let style = ProgressStyle::with_template("{prefix} {spinner} {pos} {elapsed} {msg}")
            .unwrap_or_else(|_| ProgressStyle::default_spinner());
        progress.bar.unset_length();
        progress.bar.set_style(style);
        progress
    }

    /// One step more.
    pub fn step(&self) {
        self.count.fetch_add(1, Ordering::Relaxed);
        if self.start.elapsed() >= PATIENCE {
            self.bar.set_position(self.count.load(Ordering::Relaxed));
        }
    }

    /// Says what is being worked at.
    pub fn message(&self, text: impl Into<String>) {
        if self.start.elapsed() >= PATIENCE {
            self.bar.set_message(text.into());
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
