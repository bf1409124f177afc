//! Large pages of memory for large arrays: a hint to the operating system.
//!
//! Memory that a program touches for the first time is cleared page by page, and where work per vertex takes tens of
//! nanoseconds, that is a large part of it: pages of 4 KB are cleared at 2.5 GB/s, pages of 2 MB at 12, on the machine
//! of the reports.

use crate::parallel;

/// Smaller arrays are left to the allocator, which uses memory anew that was given back: that needs no clearing.
#[cfg(target_os = "linux")]
const LEAST: usize = 1 << 20;

/// `vector`, with large pages wherever its memory is touched for the first time from now on. Without a meaning for the
/// result of a program, and without an effect on systems other than Linux.
pub fn large<T>(vector: Vec<T>) -> Vec<T> {
    #[cfg(target_os = "linux")]
    {
        const PAGE: usize = 4096;
        let (start, size) = (vector.as_ptr() as usize, vector.capacity() * size_of::<T>());
        if size >= LEAST {
            let (first, end) = (start.next_multiple_of(PAGE), (start + size) / PAGE * PAGE);
            // SAFETY: the range lies within memory that the vector owns, and the advice changes no value in it, only
            // the size of the pages that will back it. Where it is refused, all stays as it was.
            unsafe { libc::madvise(first as *mut libc::c_void, end - first, libc::MADV_HUGEPAGE) };
        }
    }
    vector
}

/// A [large] array of `count` times `value`, written by all threads: they share the work of the first touch.
pub fn filled<T: Copy + Send + Sync>(count: usize, value: T) -> Vec<T> {
    let mut vector = large(Vec::with_capacity(count));
    parallel::extend(&mut vector, count, |_| |_| value);
    vector
}

/// A copy in a [large] array, written by all threads.
pub fn copied<T: Copy + Send + Sync>(values: &[T]) -> Vec<T> {
    let mut vector = large(Vec::with_capacity(values.len()));
    parallel::append(&mut vector, values);
    vector
}
