//! Progress bars: on a terminal only, and only for work that lasts.

use std::fmt::Display;
use std::io::IsTerminal;
use std::sync::mpsc::{self, RecvTimeoutError, Sender};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// A bar on standard error that appears after a moment, its clock moving from then on, hides where standard error is no
/// terminal, and vanishes when dropped. It may be advanced from several threads.
pub struct Progress {
    bar: ProgressBar,
    quiet: bool,
    /// Shows the bar once it is time; ends when the sender is dropped.
    appearance: Option<(Sender<()>, JoinHandle<()>)>,
}

/// What ends sooner shows no bar.
const PATIENCE: Duration = Duration::from_millis(700);
/// Between two drawings of the clock.
const TICK: Duration = Duration::from_millis(250);
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
        let bar = ProgressBar::hidden().with_style(style).with_prefix(title.to_owned());
        let shown = !quiet && std::io::stderr().is_terminal();
        let appearance = if shown { appearance(bar.clone()) } else { None };
        Progress { bar, quiet, appearance }
    }

    /// One step more.
    pub fn step(&self) {
        self.bar.inc(1);
    }

    /// How much is done, from 0 to 1.
    pub fn part(&self, done: f64) {
        self.bar.set_position((done.clamp(0.0, 1.0) * PARTS as f64) as u64);
    }

    /// Says what is being worked at.
    pub fn message(&self, text: impl Into<String>) {
        self.bar.set_message(text.into());
    }

    /// Says something above the bar, which stays; nothing if quiet.
    pub fn line(&self, text: impl Display) {
        if !self.quiet {
            self.bar.suspend(|| super::say(text));
        }
    }
}

/// Shows a bar after a moment, from a thread of its own: the work need not call for it. A bar without a thread stays
/// hidden.
fn appearance(bar: ProgressBar) -> Option<(Sender<()>, JoinHandle<()>)> {
    let (alive, wait) = mpsc::channel();
    let show = move || {
        if wait.recv_timeout(PATIENCE) == Err(RecvTimeoutError::Timeout) {
            bar.set_draw_target(ProgressDrawTarget::stderr());
            bar.enable_steady_tick(TICK);
        }
    };
    let thread = thread::Builder::new().spawn(show).ok()?;
    Some((alive, thread))
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some((alive, thread)) = self.appearance.take() {
            drop(alive);
            // It cannot panic, and a bar is not worth one more.
            let _ = thread.join();
        }
        self.bar.finish_and_clear();
    }
}
