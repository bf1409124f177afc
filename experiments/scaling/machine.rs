//! What the machine gives: memory bandwidth by STREAM's triad, and the process's memory.

use std::hint::black_box;
use std::time::Instant;

use rayon::prelude::*;

/// Bytes per second of `a ← b + s·c` on arrays far larger than the caches, as STREAM counts them (24 bytes an
/// entry; McCalpin 1995), the best of several runs.
pub fn triad() -> f64 {
    const ENTRIES: usize = 20_000_000;
    const CHUNK: usize = 1 << 16;
    let mut a = vec![0.0f64; ENTRIES];
    let b = vec![1.0f64; ENTRIES];
    let c = vec![2.0f64; ENTRIES];
    let mut best = f64::INFINITY;
    for _ in 0..8 {
        let s = black_box(3.0);
        let start = Instant::now();
        a.par_chunks_mut(CHUNK).zip(b.par_chunks(CHUNK)).zip(c.par_chunks(CHUNK)).for_each(|((a, b), c)| {
            for ((a, b), c) in a.iter_mut().zip(b).zip(c) {
                *a = b + s * c;
            }
        });
        black_box(&a);
        best = best.min(start.elapsed().as_secs_f64());
    }
    24.0 * ENTRIES as f64 / best
}

/// The memory that `work` needs beyond what was held before, in bytes, where the system tells (Linux).
pub fn peak_memory<T>(work: impl FnOnce() -> T) -> (T, Option<u64>) {
    // 5 resets the peak of the resident set (proc(5)).
    let reset = std::fs::write("/proc/self/clear_refs", "5").is_ok();
    let before = status("VmRSS:");
    let result = work();
    let peak = status("VmHWM:");
    let more = match (reset, before, peak) {
        (true, Some(before), Some(peak)) => Some(peak.saturating_sub(before)),
        _ => None,
    };
    (result, more)
}

/// A line of /proc/self/status, in bytes.
fn status(name: &str) -> Option<u64> {
    let text = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find(|l| l.starts_with(name))?;
    let kilobytes: u64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(1024 * kilobytes)
}
