//! The process around a program: threads, signals, standard error, exit status.

use std::fmt::Display;
use std::hint::black_box;
use std::io::Write;
use std::process::ExitCode;
use std::sync::mpsc::{Sender, channel};
use std::thread;

use rayon::{ThreadBuilder, ThreadPoolBuilder};

use limitlab::error::{Error, Result};
use limitlab::memory::require_small;

/// Runs a program's body: exit status 0, or 1 with the one line `error: …` on standard error. Bad arguments end
/// with 2 in clap, before.
pub fn exit(body: impl FnOnce() -> Result<()>) -> ExitCode {
    match body() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            say(format_args!("error: {}", error.to_string().replace('\n', " ")));
            ExitCode::FAILURE
        }
    }
}

/// Writes one line to standard error. Where that cannot be written, nobody is left to be told: the exit status speaks.
pub fn say(text: impl Display) {
    let _ = writeln!(std::io::stderr(), "{text}");
}

/// Starts the threads of the whole process, of which more than the processors would only wait for each other: `asked`,
/// or as many as there are processors. Where the system refuses some of them (`RLIMIT_NPROC`, as in containers), those
/// that it gives do the work; where it refuses all, the main thread does. Results do not depend on it.
///
/// # Errors
/// If threads were started before; if memory is short already.
pub(super) fn start_threads(asked: Option<u16>, remark: impl Fn(String)) -> Result<()> {
    let processors = thread::available_parallelism().map_or(1, usize::from);
    let wanted = asked.map_or(processors, usize::from).min(processors);
    if asked.is_some_and(|n| usize::from(n) > wanted) {
        remark(format!("threads: {wanted}, as many as there are processors; more would not help"));
    }
    // Each waits for its part in the pool: a pool that could not be completed cannot be built anew.
    let workers: Vec<Sender<ThreadBuilder>> = (0..wanted)
        .map_while(|_| {
            let (give, part) = channel::<ThreadBuilder>();
            let work = move || part.recv().map_or((), ThreadBuilder::run);
            thread::Builder::new().spawn(work).ok().map(|_| give)
        })
        .collect();
    if workers.len() < wanted {
        remark(format!("threads: {} of {wanted}, the system gives no more", workers.len().max(1)));
    }
    let built = if workers.is_empty() {
        ThreadPoolBuilder::new().num_threads(1).use_current_thread().build_global()
    } else {
        let hand_out =
            |part: ThreadBuilder| workers[part.index()].send(part).map_err(|_| std::io::ErrorKind::BrokenPipe.into());
        ThreadPoolBuilder::new().num_threads(workers.len()).spawn_handler(hand_out).build_global()
    };
    built.map_err(|e| Error::Computation(format!("cannot start threads: {e}")))?;
    // An allocator may set addresses aside for every thread that comes to it: now, so that what is available is known.
    rayon::broadcast(|_| drop(black_box(vec![0u8; 64])));
    require_small()
}

/// Where addresses are limited (`ulimit -v`), all threads share one arena of the allocator. glibc would set 64 MB of
/// addresses aside for each, and where it finds them only later, takes them from work that was found to have room: a run in
/// thirty of those near a limit ended by an abort. To be called before other threads are started.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
pub(super) fn share_addresses() {
    let limits = std::fs::read_to_string("/proc/self/limits").unwrap_or_default();
    let soft = limits.lines().find_map(|line| line.strip_prefix("Max address space")?.split_whitespace().next());
    if soft.is_some_and(|soft| soft != "unlimited") {
        // SAFETY: the call sets a parameter of the allocator, and touches no memory of the program; there is no other
        // thread yet that it could meet. Where it is refused, all stays as it was.
        unsafe { libc::mallopt(libc::M_ARENA_MAX, 1) };
    }
}

#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
pub(super) fn share_addresses() {}

/// From now on SIGHUP, SIGINT and SIGTERM remove temporary files and say which files are complete, before they end the
/// process as they would have without; a file that reaches its size limit (SIGXFSZ) is an error of writing. A signal
/// that is ignored (`nohup`) stays so. Where the system gives no thread for it, signals end the process at once.
#[cfg(unix)]
pub(super) fn heed_signals() {
    use std::sync::Arc;
    use std::sync::atomic::AtomicBool;

    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGXFSZ};
    use signal_hook::iterator::Signals;
    use signal_hook::low_level::{emulate_default_handler, signal_name};

    // What is heeded does not end the process; there is nothing to be done, since the call that writes fails.
    let _ = signal_hook::flag::register(SIGXFSZ, Arc::<AtomicBool>::default());
    let (give, registered) = channel::<Signals>();
    let wait = move || {
        let signal = registered.recv().ok().and_then(|mut signals| signals.forever().next());
        if let Some(signal) = signal {
            let complete = limitlab::output::abandon();
            let kept = match complete.as_slice() {
                [] => "no file was written".into(),
                [one] => format!("{} is complete", one.display()),
                [.., last] => format!("{} files are complete, the last {}", complete.len(), last.display()),
            };
            say(format_args!("error: stopped by {}: {kept}", signal_name(signal).unwrap_or("a signal")));
            let _ = emulate_default_handler(signal);
        }
    };
    if thread::Builder::new().spawn(wait).is_ok()
        && let Ok(signals) = Signals::new([SIGHUP, SIGINT, SIGTERM].into_iter().filter(|&s| !is_ignored(s)))
    {
        let _ = give.send(signals);
    }
}

#[cfg(not(unix))]
pub(super) fn heed_signals() {}

/// Whether the process was started with this signal ignored, as far as the system tells.
#[cfg(unix)]
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| u64::from_str_radix(line.strip_prefix("SigIgn:")?.trim(), 16).ok());
    mask.is_some_and(|mask| mask >> (signal - 1) & 1 == 1)
}
