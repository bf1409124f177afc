//! Permutations of the vertices with their inverses.

use super::incidence::split_rows;
use super::topology::{NONE, Scatter};
use crate::pages::{filled, large};
use crate::parallel;
use crate::prefetch::prefetch;

/// The place of every vertex: `inverse(o)[o[k]] = k`. In parallel.
///
/// # Panics
/// If `order` is not a permutation.
pub fn inverse(order: &[u32]) -> Vec<u32> {
    let places = Scatter::new(order.len());
    parallel::each(order.len(), |k| places.set(order[k], k as u32));
    let places = places.into_vec();
    // As many numbers as places: one that occurs twice leaves a place empty.
    let missing = parallel::find_first(places.len(), |v| places[v] == NONE);
    assert_eq!(missing, None, "a vertex that does not occur in the order");
    places
}

/// An order with its inverse: the way there and back.
#[derive(Clone, Debug)]
pub struct Numbering {
    order: Vec<u32>,
    place: Vec<u32>,
}

impl Numbering {
    /// # Panics
    /// If `order` is not a permutation.
    pub fn new(order: Vec<u32>) -> Self {
        Numbering { place: inverse(&order), order }
    }

    /// The vertex at every place.
    pub fn order(&self) -> &[u32] {
        &self.order
    }

    /// The place of every vertex.
    pub fn place(&self) -> &[u32] {
        &self.place
    }

    /// Values by vertex, put in order. In parallel.
    ///
    /// # Panics
    /// If there is not one value a vertex.
    pub fn there<T: Copy + Send + Sync>(&self, values: &[T]) -> Vec<T> {
        gather(values, &self.order)
    }

    /// As [`there`](Self::there), into memory that is there already.
    ///
    /// # Panics
    /// If there is not one value, and one place in `out`, a vertex.
    pub fn there_into<T: Copy + Send + Sync>(&self, values: &[T], out: &mut [T]) {
        let n = self.order.len();
        assert!(values.len() == n && out.len() == n, "one value a vertex");
        parallel::fill(out, |k| fetched(values, &self.order, k));
    }

    /// Values in this order, by vertex again. In parallel.
    ///
    /// # Panics
    /// If there is not one value a vertex.
    pub fn back<T: Copy + Send + Sync>(&self, values: &[T]) -> Vec<T> {
        gather(values, &self.place)
    }

    /// As [`back`](Self::back), into memory that is there already: fresh pages cost more than the copy.
    ///
    /// # Panics
    /// If there is not one value, and one place in `out`, a vertex.
    pub fn back_into<T: Copy + Send + Sync>(&self, values: &[T], out: &mut [T]) {
        let n = self.place.len();
        assert!(values.len() == n && out.len() == n, "one value a vertex");
        parallel::fill(out, |v| fetched(values, &self.place, v));
    }
}

/// Rows of values, each moved to the place of its vertex: those at place k from `starts[k]` on become those of vertex v =
/// `order[k]`, `ends[v]..ends[v + 1]`. In parallel.
///
/// # Panics
/// If a row lies beyond the values.
pub(crate) fn rows_back<T: Copy + Default + Send + Sync>(
    numbering: &Numbering,
    values: &[T],
    starts: &[u32],
    ends: &[u32],
) -> Vec<T> {
    /// Rows of one task.
    const CHUNK: usize = 4096;
    /// Rows between one look-up and the next.
    const AHEAD: usize = 16;
    let place = numbering.place();
    let mut moved = filled(ends[place.len()] as usize, T::default());
    parallel::parts(split_rows(ends, CHUNK, &mut moved), |rows, mut part| {
        for v in rows {
            if let Some(&k) = place.get(v + 2 * AHEAD) {
                prefetch(starts, k as usize);
            }
            if let Some(&k) = place.get(v + AHEAD) {
                prefetch(values, starts[k as usize] as usize);
            }
            let (row, rest) = part.split_at_mut((ends[v + 1] - ends[v]) as usize);
            let start = starts[place[v] as usize] as usize;
            row.copy_from_slice(&values[start..start + row.len()]);
            part = rest;
        }
    });
    moved
}

/// Turns lengths, of which the k-th stands at place k + 1, into where rows start, and the end.
pub(crate) fn add_up(lengths: &mut [u32]) {
    for k in 1..lengths.len() {
        lengths[k] += lengths[k - 1];
    }
}

/// The k-th is `values[order[k]]`.
fn gather<T: Copy + Send + Sync>(values: &[T], order: &[u32]) -> Vec<T> {
    assert_eq!(values.len(), order.len(), "one value a vertex");
    let mut gathered = large(Vec::with_capacity(order.len()));
    parallel::extend(&mut gathered, order.len(), |_| |k| fetched(values, order, k));
    gathered
}

/// `values[order[k]]`; a later one is fetched, as a processor cannot foresee where it is.
#[inline(always)]
fn fetched<T: Copy>(values: &[T], order: &[u32], k: usize) -> T {
    const AHEAD: usize = 16;
    if let Some(&v) = order.get(k + AHEAD) {
        prefetch(values, v as usize);
    }
    values[order[k] as usize]
}
