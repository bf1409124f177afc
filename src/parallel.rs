//! Parallel loops over arrays, cut into chunks of a fixed length, so that what is summed up by chunks does
//! not depend on the number of threads.
//!
//! What divides, steals and joins work is compiled once, over the numbers of chunks, and the work of a chunk called through a
//! pointer. As chains of parallel iterators, each of which is compiled for itself, loops took two fifths of the
//! library's machine code, and of its build; compiled once for a type of element, still an eighth.

mod team;

use std::marker::PhantomData;
use std::mem::MaybeUninit;
use std::ops::Range;
use std::slice;

use rayon::prelude::*;

use crate::pages::large;

pub use team::team;

/// Elements of a chunk where nothing is summed up.
const CHUNK: usize = 4096;

/// Calls `body(k)` for every k below `count`, once each.
fn share(count: usize, body: &(dyn Fn(usize) + Sync)) {
    if !team::share(count, body) {
        (0..count).into_par_iter().for_each(body);
    }
}

/// An array whose parts threads take, each once.
struct Shared<'a, T> {
    first: *mut T,
    length: usize,
    array: PhantomData<&'a mut [T]>,
}

// SAFETY: all that it gives another thread are exclusive references to different elements, which may be sent.
unsafe impl<T: Send> Sync for Shared<'_, T> {}

impl<'a, T> Shared<'a, T> {
    fn new(array: &'a mut [T]) -> Self {
        Shared { first: array.as_mut_ptr(), length: array.len(), array: PhantomData }
    }

    /// The k-th part of `size` elements, the last of fewer.
    ///
    /// # Safety
    /// No part may be taken twice, nor parts of different sizes of one array.
    #[allow(clippy::mut_from_ref)]
    unsafe fn part(&self, k: usize, size: usize) -> &mut [T] {
        let (start, end) = (k * size, self.length.min((k + 1) * size));
        assert!(start <= end, "a part of the array");
        // SAFETY: start ≤ end ≤ length, so that the elements are in the array, which is borrowed exclusively for 'a; by the
        // contract nothing else refers to them.
        unsafe { slice::from_raw_parts_mut(self.first.add(start), end - start) }
    }
}

/// Calls `body(first, part)` for the chunks of `a` of `size` elements, `first` the index of the first of them.
///
/// # Panics
/// If `size` is 0.
pub fn chunks<A: Send>(a: &mut [A], size: usize, body: impl Fn(usize, &mut [A]) + Sync) {
    fn shared<A: Send>(a: &mut [A], size: usize, body: &(dyn Fn(usize, &mut [A]) + Sync)) {
        if a.len() <= size {
            if !a.is_empty() {
                body(0, a);
            }
            return;
        }
        let count = a.len().div_ceil(size);
        let a = Shared::new(a);
        // SAFETY: every k comes once, and all parts have this size.
        share(count, &|k| body(k * size, unsafe { a.part(k, size) }));
    }
    shared(a, size, &body);
}

/// As [`chunks`], each with a place for what it adds up: `body(first, part, &mut sums[k])` for the k-th chunk.
///
/// # Panics
/// If there is not one sum a chunk.
pub fn chunks_with<A: Send, S: Send>(
    a: &mut [A],
    size: usize,
    sums: &mut [S],
    body: impl Fn(usize, &mut [A], &mut S) + Sync,
) {
    // A vector of () takes no memory.
    let mut nothing = vec![(); a.len()];
    chunks_of_two(a, &mut nothing, size, sums, |first, a, _, sum| body(first, a, sum));
}

/// As [`chunks_with`], over two arrays of equal length.
pub fn chunks_of_two<A: Send, B: Send, S: Send>(
    a: &mut [A],
    b: &mut [B],
    size: usize,
    sums: &mut [S],
    body: impl Fn(usize, &mut [A], &mut [B], &mut S) + Sync,
) {
    type Body<'a, A, B, S> = &'a (dyn Fn(usize, &mut [A], &mut [B], &mut S) + Sync);
    fn shared<A: Send, B: Send, S: Send>(a: &mut [A], b: &mut [B], size: usize, sums: &mut [S], body: Body<A, B, S>) {
        match sums {
            [] => {}
            [sum] => body(0, a, b, sum),
            _ => {
                let count = sums.len();
                let (a, b, sums) = (Shared::new(a), Shared::new(b), Shared::new(sums));
                share(count, &|k| {
                    // SAFETY: every k comes once, and all parts of an array have one size.
                    let (a, b, sum) = unsafe { (a.part(k, size), b.part(k, size), sums.part(k, 1)) };
                    body(k * size, a, b, &mut sum[0]);
                });
            }
        }
    }
    assert_eq!(a.len(), b.len(), "arrays of equal length");
    assert_eq!(sums.len(), a.len().div_ceil(size), "one sum a chunk");
    shared(a, b, size, sums, &body);
}

/// The vector of `item(k)` for all k below `count`, each called for through a pointer. What is made is not dropped if one panics.
fn collect_shared<R: Send>(count: usize, item: &(dyn Fn(usize) -> R + Sync)) -> Vec<R> {
    if count <= 1 {
        return (0..count).map(item).collect();
    }
    let mut vector = Vec::with_capacity(count);
    let places = Shared::new(&mut vector.spare_capacity_mut()[..count]);
    share(count, &|k| {
        // SAFETY: every k comes once.
        let place = unsafe { places.part(k, 1) };
        place[0].write(item(k));
    });
    // SAFETY: the memory was reserved, and each of the `count` places written: `share` comes to every k or panics.
    unsafe { vector.set_len(count) };
    vector
}

/// What `body` makes of the ranges of `size` indices below `count`, in their order.
///
/// # Panics
/// If `size` is 0.
pub fn map<R: Send>(count: usize, size: usize, body: impl Fn(Range<usize>) -> R + Sync) -> Vec<R> {
    collect_shared(count.div_ceil(size), &|k| body(k * size..count.min((k + 1) * size)))
}

/// What `item` makes of every element, in their order, or the first error among these.
///
/// # Errors
/// Those of `item`.
pub fn try_map<T: Sync, R: Send, E: Send>(items: &[T], item: impl Fn(&T) -> Result<R, E> + Sync) -> Result<Vec<R>, E> {
    collect_shared(items.len(), &|k| item(&items[k])).into_iter().collect()
}

/// What `body(range, part)` makes of parts of an array, each with the rows that it belongs to, in their order.
pub fn parts<A: Send, R: Send>(
    parts: Vec<(Range<usize>, &mut [A])>,
    body: impl Fn(Range<usize>, &mut [A]) -> R + Sync,
) -> Vec<R> {
    let mut parts = parts;
    let count = parts.len();
    let parts = Shared::new(&mut parts);
    collect_shared(count, &|k| {
        // SAFETY: every k comes once.
        let (range, part) = &mut unsafe { parts.part(k, 1) }[0];
        body(range.clone(), part)
    })
}

/// Calls `body(item)` for each.
pub fn tasks<T: Send>(items: Vec<T>, body: impl Fn(T) + Sync) {
    let mut items: Vec<Option<T>> = items.into_iter().map(Some).collect();
    chunks(&mut items, 1, |_, item| {
        if let Some(item) = item[0].take() {
            body(item);
        }
    });
}

/// Calls `visit(i)` for all i below `count`.
pub fn each(count: usize, visit: impl Fn(usize) + Sync) {
    map(count, CHUNK, |range| range.for_each(&visit));
}

/// All items that `body` makes of the ranges of `size` indices below `count`, in their order.
pub fn flat_map<R: Send>(count: usize, size: usize, body: impl Fn(Range<usize>) -> Vec<R> + Sync) -> Vec<R> {
    map(count, size, body).into_iter().flatten().collect()
}

/// Calls `change(i, &mut a[i])` for all i.
pub fn change<A: Send>(a: &mut [A], change: impl Fn(usize, &mut A) + Sync) {
    chunks(a, CHUNK, |first, part| {
        for (i, a) in (first..).zip(part) {
            change(i, a);
        }
    });
}

/// Sets `a[i] = item(i)`.
pub fn fill<T: Send>(a: &mut [T], item: impl Fn(usize) -> T + Sync) {
    change(a, |i, slot| *slot = item(i));
}

/// The vector of `item(i)` for all i below `count`.
pub fn collect<T: Send>(count: usize, item: impl Fn(usize) -> T + Sync) -> Vec<T> {
    let mut vector = Vec::new();
    extend(&mut vector, count, |_| &item);
    vector
}

/// Appends `count` items: `start(i)` makes those of a chunk from the i-th on, one after the other.
///
/// Memory is touched once, by the thread that makes an item: a million points take 1.7 ms, and 2.9 if they are cleared
/// first, as a slice must be.
pub fn extend<T: Send, F: FnMut(usize) -> T>(vector: &mut Vec<T>, count: usize, start: impl Fn(usize) -> F + Sync) {
    if vector.capacity() - vector.len() < count {
        vector.reserve(count);
        *vector = large(std::mem::take(vector));
    }
    let length = vector.len();
    let spare: &mut [MaybeUninit<T>] = &mut vector.spare_capacity_mut()[..count];
    chunks(spare, CHUNK, |first, part| {
        let mut item = start(first);
        for (i, slot) in (first..).zip(part) {
            slot.write(item(i));
        }
    });
    // SAFETY: the memory was reserved, and each of the `count` places after the last element was written above: the
    // chunks cover the slice, and the loop each chunk. (A panic of `item` leaves the length as it was.)
    unsafe { vector.set_len(length + count) };
}

/// Appends a copy of `values`.
pub fn append<T: Copy + Send + Sync>(vector: &mut Vec<T>, values: &[T]) {
    extend(vector, values.len(), |_| |i| values[i]);
}

/// Where parts of such lengths start, one after the other, and where the last ends.
pub fn starts(lengths: impl Iterator<Item = usize>) -> Vec<usize> {
    let mut starts = vec![0];
    let mut end = 0;
    starts.extend(lengths.map(|length| {
        end += length;
        end
    }));
    starts
}

/// Where rows of such lengths start, one after the other, and the end.
///
/// # Errors
/// The end, if it does not fit 32 bits.
pub fn offsets(rows: usize, length: impl Fn(usize) -> u32 + Sync) -> Result<Vec<u32>, u64> {
    let sums = map(rows, CHUNK, |range| range.map(|i| u64::from(length(i))).sum::<u64>());
    let mut end = 0;
    let after = |sum| {
        end += sum;
        end - sum
    };
    let starts: Vec<u64> = sums.into_iter().map(after).collect();
    if u32::try_from(end).is_err() {
        return Err(end);
    }
    let mut offsets = large(Vec::with_capacity(rows + 1));
    offsets.push(0);
    extend(&mut offsets, rows, |first| {
        let mut end = starts[first / CHUNK] as u32;
        let length = &length;
        move |i| {
            end += length(i);
            end
        }
    });
    Ok(offsets)
}

/// Appends `item(k, x)` for the elements x of every part, the k-th, one part after the other.
pub fn append_parts<T: Copy + Send + Sync>(
    vector: &mut Vec<T>,
    parts: &[&[T]],
    item: impl Fn(usize, T) -> T + Send + Sync,
) {
    let starts = starts(parts.iter().map(|part| part.len()));
    extend(vector, starts[parts.len()], |first| {
        // The last part that starts here or before, which is not empty.
        let mut k = starts[..parts.len()].partition_point(|&start| start <= first) - 1;
        let mut rest = parts[k][first - starts[k]..].iter();
        let item = &item;
        move |_| loop {
            match rest.next() {
                Some(&x) => return item(k, x),
                None => {
                    k += 1;
                    rest = parts[k].iter();
                }
            }
        }
    });
}

/// Does `work` by all threads while `here` runs on this one, and gives what that gives once both are done.
pub fn beside<R>(work: impl FnOnce() + Send, here: impl FnOnce() -> R) -> R {
    rayon::in_place_scope(|scope| {
        scope.spawn(|_| work());
        here()
    })
}

/// The number of threads.
pub fn threads() -> usize {
    rayon::current_num_threads()
}

/// The first number below `count` of which `is_it` holds.
pub fn find_first(count: usize, is_it: impl Fn(usize) -> bool + Sync) -> Option<usize> {
    fn shared(count: usize, chunk: &(dyn Fn(Range<usize>) -> Option<usize> + Sync)) -> Option<usize> {
        let range = |k: usize| k * CHUNK..count.min((k + 1) * CHUNK);
        (0..count.div_ceil(CHUNK)).into_par_iter().find_map_first(|k| chunk(range(k)))
    }
    shared(count, &|mut range| range.find(|&i| is_it(i)))
}

/// Whether `holds` of every number below `count`.
pub fn all(count: usize, holds: impl Fn(usize) -> bool + Sync) -> bool {
    find_first(count, |i| !holds(i)).is_none()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chunks_cover_an_array_once() {
        for n in [0, 1, 5, 10, 10_000] {
            let (mut a, mut b) = (vec![0usize; n], vec![0usize; n]);
            chunks(&mut a, 5, |first, part| part.iter_mut().enumerate().for_each(|(k, a)| *a += first + k));
            assert!(a.iter().copied().eq(0..n));
            let mut sums = vec![0; n.div_ceil(3)];
            chunks_of_two(&mut a, &mut b, 3, &mut sums, |first, a, b, sum| {
                assert_eq!((a[0], a.len()), (first, b.len()));
                b.copy_from_slice(a);
                *sum += a.iter().sum::<usize>();
            });
            assert_eq!(a, b);
            assert!(sums.iter().copied().eq(a.chunks(3).map(|a| a.iter().sum::<usize>())));
            let ranges = map(n, 5, |range| range);
            assert!(ranges.iter().all(|r| !r.is_empty() && r.len() <= 5));
            assert!(ranges.into_iter().flatten().eq(0..n));
        }
    }

    #[test]
    fn offsets_are_running_sums() {
        for n in [0, 1, 4095, 4096, 4097, 20_000] {
            let length = |i: usize| (i * i % 7) as u32;
            let mut expected = vec![0];
            (0..n).for_each(|i| expected.push(expected[i] + length(i)));
            assert_eq!(offsets(n, length), Ok(expected));
        }
        let most = |i: usize| if i < 2 { u32::MAX / 2 } else { (i == 5000).into() };
        assert_eq!(offsets(5001, most).unwrap()[5001], u32::MAX);
        assert_eq!(offsets(5002, |i| most(i) + u32::from(i == 5001)), Err(1 << 32));
    }

    #[test]
    fn items_are_appended_in_order() {
        for n in [0, 1, 4095, 4096, 4097, 20_000] {
            let mut words = vec!["before".to_string()];
            extend(&mut words, n, |first| {
                let mut next = first;
                move |i| {
                    assert_eq!(i, next);
                    next += 1;
                    i.to_string()
                }
            });
            assert_eq!(words[0], "before");
            assert!(words[1..].iter().enumerate().all(|(i, word)| *word == i.to_string()));
            assert_eq!(words.len(), n + 1);
            assert!(collect(n, |i| 2 * i).into_iter().eq((0..n).map(|i| 2 * i)));
            assert_eq!(find_first(n, |i| i >= 4096), (n > 4096).then_some(4096));
        }
    }

    #[test]
    fn parts_are_appended_in_order() {
        let lengths = [0, 3, 0, 0, 5000, 4096, 0, 1];
        let parts: Vec<Vec<u32>> = lengths.iter().map(|&n| (0..n).collect()).collect();
        let parts: Vec<&[u32]> = parts.iter().map(|part| &part[..]).collect();
        let mut all = vec![7];
        append_parts(&mut all, &parts, |k, x| x + 10_000 * k as u32);
        append_parts(&mut all, &[], |_, x| x);
        append_parts(&mut all, &[&[][..]], |_, x| x);
        let expected = (0..8).flat_map(|k| (0..lengths[k]).map(move |x| x + 10_000 * k as u32));
        assert!(all.into_iter().eq([7].into_iter().chain(expected)));
        assert_eq!(starts([2, 0, 3].into_iter()), [0, 2, 2, 5]);
    }

    #[test]
    fn a_panic_appends_nothing() {
        let mut words = vec![String::new()];
        let made = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
            extend(&mut words, 9000, |_| |i: usize| if i == 8999 { panic!("the last") } else { i.to_string() });
        }));
        assert!(made.is_err() && words.len() == 1);
    }
}
