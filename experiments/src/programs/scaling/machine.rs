//! The processor's name, memory bandwidth by STREAM's triad, and the heap that a run takes.

use std::hint::black_box;
use std::time::Instant;

use peak_alloc::PeakAlloc;
use rayon::prelude::*;
use sysinfo::{CpuRefreshKind, RefreshKind, System};

/// What the processor calls itself, as far as it does.
pub fn processor() -> String {
    let system = System::new_with_specifics(RefreshKind::nothing().with_cpu(CpuRefreshKind::nothing()));
    let brand = system.cpus().first().map(|cpu| cpu.brand().trim().to_owned()).unwrap_or_default();
    if brand.is_empty() { "an unnamed processor".into() } else { brand }
}

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

/// Counts the heap, where a binary has it as its allocator. (What the system counts, the resident set, says nothing of a
/// run: memory that an earlier run has let go is taken again.)
static HEAP: PeakAlloc = PeakAlloc;

/// The most bytes of heap that `work` holds at once, beyond what was held before.
pub fn peak_memory<T>(work: impl FnOnce() -> T) -> (T, usize) {
    HEAP.reset_peak_usage();
    let before = HEAP.current_usage();
    let result = work();
    (result, HEAP.peak_usage().saturating_sub(before))
}
