//! Numbers for the edges of a mesh, without a table.

use crate::parallel;

/// Which half-edges are the first of their edges, and the edges in the order of these: a bit and half a bit of counts a
/// half-edge, few enough to stay in a cache.
pub(crate) struct FirstSides {
    /// For every 64 half-edges: which are first, and how many before them are.
    words: Vec<(u64, u32)>,
    edges: u32,
}

impl FirstSides {
    /// Of `count` half-edges.
    pub(super) fn new(count: usize, is_first: impl Fn(u32) -> bool + Sync) -> Self {
        let mut words: Vec<(u64, u32)> = parallel::collect(count.div_ceil(64), |k| {
            let sides = 64 * k as u32..count.min(64 * (k + 1)) as u32;
            let bits = sides.enumerate().fold(0, |bits, (i, c)| bits | u64::from(is_first(c)) << i);
            (bits, bits.count_ones())
        });
        let mut before = 0;
        for (_, count) in &mut words {
            before += std::mem::replace(count, before);
        }
        FirstSides { words, edges: before }
    }

    /// The number of the edge whose first half-edge is `first`.
    #[inline]
    pub(crate) fn edge(&self, first: u32) -> u32 {
        let (bits, before) = self.words[first as usize / 64];
        before + (bits & !(u64::MAX << (first % 64))).count_ones()
    }

    /// The first half-edges of the edges from number `edge` on, ascending.
    pub(crate) fn firsts_from(&self, edge: u32) -> impl Iterator<Item = u32> {
        let mut cursor = Cursor { next: u32::MAX, word: 0, bits: 0 };
        (edge..self.edges).map(move |edge| cursor.first_of(edge, &self.words))
    }

    /// Appends to `values` what `value` makes of the first half-edge of every edge.
    pub(crate) fn extend<T: Send>(&self, values: &mut Vec<T>, value: impl Fn(u32) -> T + Sync) {
        parallel::extend(values, self.edges as usize, |first| {
            let mut firsts = self.firsts_from(first as u32);
            let value = &value;
            move |_| value(firsts.next().expect("as many first half-edges as edges"))
        });
    }
}

/// The edges of a manifold, numbered by their first half-edges: the order of
/// [`Topology::edge_sides`](super::Topology::edge_sides). A number comes from these bits instead of from a table.
pub(crate) struct EdgeNumbers<'a> {
    twins: &'a [u32],
    firsts: FirstSides,
}

impl<'a> EdgeNumbers<'a> {
    /// From the opposite of every half-edge, [`NONE`](super::topology::NONE), the greatest number, on a boundary.
    pub(super) fn new(twins: &'a [u32]) -> Self {
        EdgeNumbers { twins, firsts: FirstSides::new(twins.len(), |c| c <= twins[c as usize]) }
    }

    /// The edge of half-edge `c`.
    #[inline]
    pub(crate) fn of(&self, c: u32) -> u32 {
        self.firsts.edge(c.min(self.twins[c as usize]))
    }

    /// The first half-edge of every edge.
    pub(crate) fn firsts(&self) -> &FirstSides {
        &self.firsts
    }

    /// The first half-edges of the edges from number `edge` on, ascending.
    pub(crate) fn firsts_from(&self, edge: u32) -> impl Iterator<Item = u32> {
        self.firsts.firsts_from(edge)
    }

    /// Appends to `values` what `value` makes of the first half-edge of every edge.
    pub(crate) fn extend<T: Send>(&self, values: &mut Vec<T>, value: impl Fn(u32) -> T + Sync) {
        self.firsts.extend(values, value);
    }
}

/// Where a walk over the edges is.
struct Cursor {
    /// The edge that comes next.
    next: u32,
    word: usize,
    /// The first half-edges of the word that are still to come.
    bits: u64,
}

impl Cursor {
    #[inline]
    fn first_of(&mut self, edge: u32, words: &[(u64, u32)]) -> u32 {
        if edge != self.next {
            self.word = words.partition_point(|&(_, before)| before <= edge) - 1;
            let (bits, before) = words[self.word];
            self.bits = (before..edge).fold(bits, |bits, _| bits & (bits - 1));
        }
        while self.bits == 0 {
            self.word += 1;
            self.bits = words[self.word].0;
        }
        let first = 64 * self.word as u32 + self.bits.trailing_zeros();
        self.bits &= self.bits - 1;
        self.next = edge + 1;
        first
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Topology;

    #[test]
    fn edges_are_numbered_by_their_first_half_edges() {
        // Several words, several tasks, and a word without any first half-edge.
        for name in ["tetrahedron", "irregular-poly:500", "torus:150x130", "tri-torus:80x80"] {
            let mesh = crate::mesh::builtin::builtin(name).unwrap();
            let topology = Topology::new(&mesh.faces, mesh.len());
            let twins = topology.twins().to_vec();
            let half = twins.len() as u32 / 2;
            // Half-edge c opposite to c + count/2: all first ones before all others.
            let apart: Vec<u32> = (half..2 * half).chain(0..half).collect();
            for twins in [twins, apart] {
                let firsts: Vec<u32> = (0..2 * half).filter(|&c| c <= twins[c as usize]).collect();
                let numbers = EdgeNumbers::new(&twins);
                let mut found = Vec::new();
                numbers.extend(&mut found, |c| c);
                assert_eq!(found, firsts, "{name}");
                for (e, &c) in (0..).zip(&firsts) {
                    assert_eq!([numbers.of(c), numbers.of(twins[c as usize])], [e; 2]);
                }
            }
        }
    }
}
