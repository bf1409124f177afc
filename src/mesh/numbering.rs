//! Permutations of the vertices with their inverses.

use crate::parallel;

/// The place of every vertex: `inverse(o)[o[k]] = k`.
///
/// # Panics
/// If `order` is not a permutation.
pub fn inverse(order: &[u32]) -> Vec<u32> {
    let mut inverse = vec![u32::MAX; order.len()];
    for (k, &v) in order.iter().enumerate() {
        let place = &mut inverse[v as usize];
        assert_eq!(*place, u32::MAX, "vertex {v} occurs twice in the order");
        *place = k as u32;
    }
    inverse
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
        parallel::fill(out, |k| values[self.order[k] as usize]);
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
        parallel::fill(out, |v| values[self.place[v] as usize]);
    }
}

/// The k-th is `values[order[k]]`.
fn gather<T: Copy + Send + Sync>(values: &[T], order: &[u32]) -> Vec<T> {
    assert_eq!(values.len(), order.len(), "one value a vertex");
    parallel::collect(order.len(), |k| values[order[k] as usize])
}
