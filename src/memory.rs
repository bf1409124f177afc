//! The machine's memory: what a computation requires, compared with what is available before the work begins, and the cache.

use std::hint::black_box;
use std::sync::LazyLock;

use sysinfo::System;

use crate::error::{Error, Result};

/// Less than this is not looked at, since to look takes longer than the work.
const SMALL: u64 = 16 << 20;
/// What a process takes beside the arrays that are counted: buffers, small arrays, what its allocator leaves unused.
const BESIDE: u64 = 16 << 20;

/// Passes if `bytes` of memory are available: as the system and the control group of the process tell, in one piece of
/// addresses (`ulimit -v`). `what` names what needs them, as the subject of a sentence; `advice` is what to do.
///
/// # Errors
/// [`Error::Memory`] with both numbers.
pub(crate) fn require(bytes: u64, what: impl FnOnce() -> String, advice: &'static str) -> Result<()> {
    if bytes < SMALL {
        return Ok(());
    }
    let needed = bytes + BESIDE;
    let available = physical().min(addresses(needed));
    if needed <= available {
        return Ok(());
    }
    Err(Error::Memory { what: what(), needed, available, advice })
}

/// Passes if a small computation finds room: that is looked at once, by the program.
///
/// # Errors
/// [`Error::Memory`] with the bytes needed and available.
pub fn require_small() -> Result<()> {
    require(SMALL, || "the program".into(), "raise the limit (ulimit -v)")
}

/// The memory that the system can give without taking it from another process; all of it where that is not known.
fn physical() -> u64 {
    let mut system = System::new();
    system.refresh_memory();
    if system.total_memory() == 0 {
        return u64::MAX;
    }
    let free = system.available_memory() + system.free_swap();
    // What files occupy of a group's memory makes way.
    let of_group = system.cgroup_limits().map(|group| group.total_memory.saturating_sub(group.rss) + group.free_swap);
    of_group.map_or(free, |group| free.min(group))
}

/// The largest piece of addresses that the process is given, up to `wanted` bytes, to a hundredth. Nothing is touched.
fn addresses(wanted: u64) -> u64 {
    let given = |bytes: u64| {
        let mut piece = Vec::<u8>::new();
        usize::try_from(bytes).is_ok_and(|bytes| piece.try_reserve_exact(bytes).is_ok() && black_box(&piece).is_empty())
    };
    if given(wanted) {
        return wanted;
    }
    let (mut least, mut most) = (0, wanted);
    while most - least > wanted / 100 {
        let middle = least + (most - least) / 2;
        if given(middle) {
            least = middle;
        } else {
            most = middle;
        }
    }
    least
}

/// Bytes of the last cache before memory, which processors may share, as Linux tells; 32 MiB where it is not told. For
/// the length of passes only: no result depends on it.
pub(crate) fn last_level_cache() -> usize {
    static SIZE: LazyLock<usize> = LazyLock::new(|| {
        let of_level = |k: usize| {
            let file = format!("/sys/devices/system/cpu/cpu0/cache/index{k}/size");
            std::fs::read_to_string(file).ok().as_deref().and_then(bytes)
        };
        (0..8).map_while(of_level).max().unwrap_or(32 << 20)
    });
    *SIZE
}

/// A size as `48K` or `32M`.
fn bytes(size: &str) -> Option<usize> {
    let size = size.trim_end();
    let unit = size.find(|c: char| !c.is_ascii_digit()).unwrap_or(size.len());
    let factor = match &size[unit..] {
        "" => 1,
        "K" => 1 << 10,
        "M" => 1 << 20,
        "G" => 1 << 30,
        _ => return None,
    };
    size[..unit].parse::<usize>().ok()?.checked_mul(factor)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_of_caches_are_read() {
        let read = ["48K\n", "491520K", "32M", "1G", "512", "", "K", "12 K", "99999999999999999999K"].map(bytes);
        assert_eq!(read[..5], [48 << 10, 480 << 20, 32 << 20, 1 << 30, 512].map(Some));
        assert_eq!(read[5..], [None; 4]);
        assert!(last_level_cache() >= 1 << 15);
    }

    #[test]
    fn what_no_machine_has_is_refused_with_both_numbers() {
        require(SMALL - 1, || unreachable!(), "").unwrap();
        require(SMALL, || "a small thing".into(), "").unwrap();
        let error = require(1 << 60, || "the matrix".into(), "take a smaller mesh").unwrap_err();
        let text = error.to_string();
        assert!(text.starts_with("the matrix needs 1152921504 GB of memory, of which "), "{text}");
        assert!(text.ends_with(" are available; take a smaller mesh"), "{text}");
    }
}
