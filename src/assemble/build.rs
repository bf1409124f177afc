//! Construction of the matrix-free [`Operator`](super::Operator): from faces to rows.

use std::ops::Range;

use super::face_sums::Polygons;
use super::neighbours::Codes;
use super::weights::{RowKind, RowWeights, WeightsByValence};
use crate::error::{Error, Result};
use crate::mesh::incidence::{next_in, prev_in};
use crate::mesh::order::Numbering;
use crate::mesh::{Faces, Incidence, Topology};
use crate::pages::large;
use crate::parallel;
use crate::schemes::{Masks, Scheme};

/// What the rows are built from.
pub(super) struct RowSource<'a> {
    faces: &'a Faces,
    incidence: &'a Incidence,
    /// The sides without an opposite, where there are such.
    open: Option<&'a Topology>,
    /// Which row is that of which vertex; the k-th of the k-th unless told.
    numbering: Option<&'a Numbering>,
    scheme: Scheme,
    /// By row, as all that is made here.
    pub(super) valences: Vec<u32>,
}

impl<'a> RowSource<'a> {
    /// # Panics
    /// If the numbering is not of these vertices.
    pub(super) fn new(
        faces: &'a Faces,
        (incidence, open): (&'a Incidence, Option<&'a Topology>),
        scheme: Scheme,
        (numbering, free): (Option<&'a Numbering>, Option<&'a [bool]>),
    ) -> Self {
        let n = incidence.vertices();
        let order = numbering.map(Numbering::order);
        assert!(order.is_none_or(|order| order.len() == n), "one entry a vertex");
        assert!(free.is_none_or(|free| free.len() == n), "one mark a vertex");
        let vertex = |k: usize| order.map_or(k, |order| order[k] as usize);
        let valences = parallel::collect(n, |k| match open {
            _ if free.is_some_and(|free| !free[vertex(k)]) => 0,
            None => incidence.face_count(vertex(k)) as u32,
            Some(topology) => topology.edge_valence(faces, vertex(k)) as u32,
        });
        RowSource { faces, incidence, open, numbering, scheme, valences }
    }

    /// The vertex of a row.
    fn vertex(&self, k: usize) -> usize {
        self.numbering.map_or(k, |numbering| numbering.order()[k] as usize)
    }

    /// Fetches what rows after `k` will read, where they are not in the file's order.
    #[inline(always)]
    fn fetch_ahead(&self, k: usize) {
        if let Some(numbering) = self.numbering {
            self.incidence.fetch_ahead(self.faces, numbering.order(), k);
        }
    }

    /// The row of a vertex.
    fn row(&self, v: u32) -> u32 {
        self.numbering.map_or(v, |numbering| numbering.place()[v as usize])
    }

    /// The kind of every row; a fixed one is a vertex without edges.
    pub(super) fn kinds(&self) -> Vec<RowKind> {
        let edges_only = self.scheme.edges_only();
        let of_size = |size: usize| match size {
            _ if edges_only => RowKind::Edges,
            3 => RowKind::Edges,
            4 => RowKind::Quads,
            _ => RowKind::Polygons,
        };
        let n = self.valences.len();
        // Where all faces are of one size, they need not be looked at.
        if let Some(kind) = self.faces.uniform_size().map(of_size) {
            return parallel::collect(n, |k| if self.valences[k] == 0 { RowKind::Edges } else { kind });
        }
        let incidence = self.incidence;
        parallel::collect(n, |k| {
            if self.valences[k] == 0 {
                return RowKind::Edges;
            }
            self.fetch_ahead(k);
            // One bit for each kind that occurs: no branch on what there is no pattern in.
            let at = incidence.corners_at(self.vertex(k)).iter();
            let met = at.fold(0, |met, &c| {
                let kind = of_size(self.faces.range(incidence.face_of(c)).len());
                met | 1u8 << kind as u8
            });
            let only = |kind: RowKind| met == 1 << kind as u8;
            if only(RowKind::Quads) {
                RowKind::Quads
            } else if only(RowKind::Edges) {
                RowKind::Edges
            } else {
                RowKind::Polygons
            }
        })
    }

    /// The faces that are summed, and the rows that read them.
    pub(super) fn polygons(&self, kinds: &[RowKind]) -> Polygons {
        let rows = (kinds, self.valences.as_slice());
        Polygons::new(self.faces, self.incidence, self.scheme, self.numbering, rows)
    }

    /// Where the neighbours of each row start, and the end.
    ///
    /// # Errors
    /// More than 2³² − 1 neighbours.
    pub(super) fn offsets(&self, kinds: &[RowKind]) -> Result<Vec<u32>> {
        let among_polygons = u32::from(self.scheme.edge_weight() != 0.0);
        let lengths = || {
            kinds.iter().zip(&self.valences).map(|(kind, n)| match kind {
                RowKind::Quads => 2 * n,
                RowKind::Edges => *n,
                RowKind::Polygons => among_polygons * n,
            })
        };
        let mut offsets = large(Vec::with_capacity(kinds.len() + 1));
        offsets.push(0);
        let mut end = 0u32;
        for length in lengths() {
            end = end.checked_add(length).ok_or_else(|| too_many(lengths().map(u64::from).sum(), kinds.len()))?;
            offsets.push(end);
        }
        Ok(offsets)
    }

    /// The neighbours of all rows; `runs` are the first rows of those of equal kind and valence.
    pub(super) fn codes(&self, kinds: &[RowKind], offsets: Vec<u32>, runs: Vec<u32>) -> Codes {
        // Where all faces are of one size, the corners of a face take no look-up.
        match self.faces.uniform_size() {
            Some(3) => self.codes_by(kinds, (offsets, runs), |c| c / 3 * 3..c / 3 * 3 + 3),
            Some(4) => self.codes_by(kinds, (offsets, runs), |c| c / 4 * 4..c / 4 * 4 + 4),
            _ => self.codes_by(kinds, (offsets, runs), |c| self.faces.range(self.incidence.face_of(c as u32))),
        }
    }

    /// `corners_by` tells the corners of the face of a corner.
    fn codes_by(
        &self,
        kinds: &[RowKind],
        (offsets, runs): (Vec<u32>, Vec<u32>),
        corners_by: impl Fn(usize) -> Range<usize> + Sync,
    ) -> Codes {
        let incidence = self.incidence;
        let corners = self.faces.corners();
        Codes::new(offsets, runs, |k, row| {
            if row.is_empty() {
                return;
            }
            self.fetch_ahead(k);
            let v = self.vertex(k);
            match kinds[k] {
                RowKind::Quads => {
                    let (edge, opposite) = row.split_at_mut(row.len() / 2);
                    let at = incidence.corners_at(v).iter();
                    for ((edge, opposite), &c) in edge.iter_mut().zip(opposite).zip(at) {
                        let range = corners_by(c as usize);
                        let place = c as usize - range.start;
                        let face = &corners[range];
                        *edge = self.row(face[(place + 1) % 4]);
                        *opposite = self.row(face[(place + 2) % 4]);
                    }
                }
                RowKind::Edges | RowKind::Polygons => {
                    // Every edge leaves v in one of its faces; on a boundary it may only enter.
                    let mut slots = row.iter_mut();
                    for &c in incidence.corners_at(v) {
                        let range = corners_by(c as usize);
                        let into = prev_in(&range, c);
                        if let Some(slot) = slots.next() {
                            *slot = self.row(corners[next_in(&range, c) as usize]);
                        }
                        if let Some(topology) = self.open
                            && topology.twin(into).is_none()
                            && let Some(slot) = slots.next()
                        {
                            *slot = self.row(corners[into as usize]);
                        }
                    }
                }
            }
        })
    }

    /// The weights of rows by valence, times h.
    pub(super) fn rings(&self) -> WeightsByValence<f64> {
        let greatest = self.valences.iter().copied().max().unwrap_or(0) as usize;
        let s = self.scheme;
        let weights = |n: usize| (s.h(n.max(1)), s.vertex_weight(n.max(1)), n as f64);
        // Where all faces are of one size.
        let ring = |n: usize, size: usize| {
            let (h, own, x) = weights(n);
            let (face, across) = if s.edges_only() {
                ([0.0; 3], 0.0)
            } else {
                let at = |steps| s.face_weight(size, steps);
                ([at(0), at(1), at(size - 1)], at(2))
            };
            RowWeights::new(h * (own + x * face[0]), h * (s.edge_weight() + face[1] + face[2]), h * across)
        };
        let rings = |size| (0..=greatest).map(|n| ring(n, size)).collect();
        // Of any size: the part of the faces that is no part of their sums does not depend on it.
        let polygons = |n: usize| {
            let (h, own, x) = weights(n);
            RowWeights::new(h * (own + x * s.circulant(4).identity), h * s.edge_weight(), h)
        };
        let mut all =
            WeightsByValence { quads: rings(4), edges: rings(3), polygons: (0..=greatest).map(polygons).collect() };
        // Fixed rows.
        all.edges[0] = RowWeights::new(0.0, 0.0, 0.0);
        all
    }
}

/// More neighbours than 32-bit numbers count: from 5.4·10⁸ vertices on among quads of valence 4, 7.1·10⁸ among triangles.
fn too_many(neighbours: u64, rows: usize) -> Error {
    Error::TooLarge {
        what: format!("the operator would have {neighbours} neighbours in {rows} rows, more than 2³² − 1"),
        advice: "use a smaller mesh",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Surface, builtin};

    /// As many edges as a mesh of half a billion vertices has, of which there is no room for here.
    #[test]
    fn more_neighbours_than_32_bits_count_are_refused_with_their_number() {
        let surface = Surface::new(builtin::builtin("cube").unwrap()).unwrap();
        let (faces, incidence) = (surface.faces(), surface.incidence());
        let mut source = RowSource::new(faces, (incidence, None), Scheme::CatmullClark, (None, None));
        source.valences.fill(1 << 28);
        let kinds = source.kinds();
        let message = source.offsets(&kinds).unwrap_err().to_string();
        assert!(message.contains("4294967296 neighbours in 8 rows, more than 2³² − 1"), "{message}");
        source.valences[3] -= 1;
        assert_eq!(source.offsets(&kinds).unwrap().last(), Some(&(u32::MAX - 1)));
    }
}
