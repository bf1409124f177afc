//! Prefetching: a hint to the processor that memory will be read soon.
//!
//! Sweeps over rows, and walks over a mesh, know long before what they are going to read. With the hint, the processor
//! fetches it while other work goes on; without, it waits for each cache line.

/// Points between the one that a sweep works on and the one that it fetches. Tuned.
pub const POINTS_AHEAD: usize = 32;

/// Fetches the line of memory where `slice[i]` begins; `i` may lie beyond the end. Without a meaning for the result of
/// a program, and without an effect on processors other than x86-64.
#[inline(always)]
pub fn prefetch<T>(slice: &[T], i: usize) {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        let address = slice.as_ptr().wrapping_add(i);
        // SAFETY: a prefetch is a hint. It changes no value, and an address that is not mapped is not a fault.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(address.cast()) }
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (slice, i);
}
