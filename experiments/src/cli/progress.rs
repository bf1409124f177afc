//! Progress bars: on a terminal only, and only for work that lasts.

use std::io::IsTerminal;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// A bar on standard error that appears after a moment, hides where standard error is no terminal, and vanishes
/// when dropped. It may be advanced from several threads.
pub struct Progress {
    bar: ProgressBar,
    quiet: bool,
    start: Instant,
    count: AtomicU64,
}

/// What ends sooner shows no bar.
const PATIENCE: Duration = Duration::from_millis(700);
/// Parts of a bar whose steps are not counted.
const PARTS: u64 = 1000;

impl Progress {
    /// A bar of `steps` steps with a title; none if `quiet`.
    pub fn new(title: &str, steps: usize, quiet: bool) -> Self {
        let template = "{prefix} {wide_bar} {pos}/{len} {elapsed} {msg}";
        let progress = Progress::styled(title, template, quiet);
        progress.bar.set_length(steps as u64);
        progress
    }

    /// A count of unknown length; none if `quiet`.
    pub fn open(title: &str, quiet: bool) -> Self {
        Progress::styled(title, "{prefix} {spinner} {pos} {elapsed} {msg}", quiet)
    }

    /// A bar that is told how far the work is ([`part`](Self::part)); none if `quiet`.
    pub fn toward(title: &str, quiet: bool) -> Self {
        let progress = Progress::styled(title, "{prefix} {wide_bar} {elapsed} {msg}", quiet);
        progress.bar.set_length(PARTS);
        progress
    }

    fn styled(title: &str, template: &str, quiet: bool) -> Self {
        let style = ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_spinner());
        Progress {
            bar: ProgressBar::hidden().with_style(style).with_prefix(title.to_owned()),
            quiet,
            start: Instant::now(),
            count: AtomicU64::new(0),
        }
    }

    /// One step more.
    pub fn step(&self) {
        self.count.fetch_add(1, Ordering::Relaxed);
        self.show(|bar| bar.set_position(self.count.load(Ordering::Relaxed)));
    }

    /// How much is done, from 0 to 1.
    pub fn part(&self, done: f64) {
        self.show(|bar| bar.set_position((done.clamp(0.0, 1.0) * PARTS as f64) as u64));
    }

    /// Says what is being worked at.
    pub fn message(&self, text: impl Into<String>) {
        self.show(|bar| bar.set_message(text.into()));
    }

    /// Changes the bar if it is time to show one.
    fn show(&self, change: impl FnOnce(&ProgressBar)) {
        if self.quiet || self.start.elapsed() < PATIENCE {
            return;
        }
        if self.bar.is_hidden() && std::io::stderr().is_terminal() {
            self.bar.set_draw_target(ProgressDrawTarget::stderr());
        }
        change(&self.bar);
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
