//! Construction of the matrix-free [`Operator`](super::Operator): from faces to rows.

use std::ops::Range;

use super::neighbours::Codes;
use super::weights::{RowKind, RowShape, RowWeights, WeightsByValence};
use crate::error::{Error, Result};
use crate::mesh::breadth_first::{in_fronts, in_fronts_along, in_kinds};
use crate::mesh::incidence::{next_in, prev_in, split_rows};
use crate::mesh::order::Numbering;
use crate::mesh::{Faces, Incidence, Topology};
use crate::pages::large;
use crate::parallel;
use crate::prefetch::prefetch;
use crate::schemes::{Masks, Scheme};

/// Vertices of one task.
const CHUNK: usize = 4096;

/// The order of the rows.
#[derive(Clone, Copy, Debug)]
pub(crate) enum RowOrder<'a> {
    /// That of the vertices, or this one.
    Given(Option<&'a Numbering>),
    /// [In fronts](in_fronts).
    Fronts,
    /// [In kinds](in_kinds).
    Kinds,
}

/// The neighbours of all vertices, of v from `starts[v]` on.
pub(super) struct Neighbourhoods {
    starts: Vec<u32>,
    vertices: Vec<u32>,
}

/// What the rows are built from: all by vertex, as faces come, and put into the order of the rows at the end.
pub(super) struct RowSource<'a> {
    faces: &'a Faces,
    incidence: &'a Incidence,
    /// The sides without an opposite, where there are such.
    open: Option<&'a Topology>,
    scheme: Scheme,
    /// A fixed row is a vertex without edges.
    pub(super) shapes: Vec<RowShape>,
}

impl<'a> RowSource<'a> {
    /// Without `free`, no vertex is fixed.
    ///
    /// # Panics
    /// If there is not one mark a vertex.
    pub(super) fn new(
        faces: &'a Faces,
        (incidence, open): (&'a Incidence, Option<&'a Topology>),
        scheme: Scheme,
        free: Option<&'a [bool]>,
    ) -> Self {
        let n = incidence.vertices();
        assert!(free.is_none_or(|free| free.len() == n), "one mark a vertex");
        let valence = |v: usize| match open {
            _ if free.is_some_and(|free| !free[v]) => 0,
            None => incidence.face_count(v) as u32,
            Some(topology) => topology.edge_valence(faces, v) as u32,
        };
        let shapes = shapes(faces, incidence, scheme, valence);
        RowSource { faces, incidence, open, scheme, shapes }
    }

    /// Where the neighbours of each row start, and the end, of rows of such shapes.
    ///
    /// # Errors
    /// More than 2³² − 1 neighbours.
    pub(super) fn offsets(&self, shapes: &[RowShape]) -> Result<Vec<u32>> {
        let among_polygons = u32::from(self.scheme.edge_weight() != 0.0);
        let length = |i: usize| {
            let n = shapes[i].valence();
            match shapes[i].kind() {
                RowKind::Quads => 2 * n,
                RowKind::Edges => n,
                RowKind::Polygons => among_polygons * n,
            }
        };
        parallel::offsets(shapes.len(), length).map_err(|neighbours| too_many(neighbours, shapes.len()))
    }

    /// The numbering of the rows if one is to be made, and if they are to be put in order, the neighbours by vertex: where
    /// these are listed first, faces that meet are near, and a row comes from one place then.
    ///
    /// # Errors
    /// As [`offsets`](Self::offsets).
    pub(super) fn in_order(&self, order: &RowOrder) -> Result<(Option<Numbering>, Option<Neighbourhoods>)> {
        let (faces, incidence) = (self.faces, self.incidence);
        // Where no vertex is fixed, the lists of triangles are what the search goes along.
        let is_free = |v: usize| self.shapes[v].valence() > 0;
        let is_listed =
            self.open.is_none() && faces.uniform_size() == Some(3) && parallel::all(self.shapes.len(), is_free);
        match order {
            RowOrder::Given(None) => Ok((None, None)),
            RowOrder::Given(Some(numbering)) => {
                assert_eq!(numbering.order().len(), self.shapes.len(), "one row a vertex");
                Ok((None, Some(self.neighbourhoods()?)))
            }
            RowOrder::Kinds => match in_kinds(faces, incidence) {
                Some(numbering) => Ok((Some(numbering), Some(self.neighbourhoods()?))),
                None => Ok((None, None)),
            },
            RowOrder::Fronts if is_listed => {
                let neighbours = self.neighbourhoods()?;
                let numbering = in_fronts_along(faces, incidence, (&neighbours.starts, &neighbours.vertices));
                Ok((Some(numbering), Some(neighbours)))
            }
            // The search is one thread's work.
            RowOrder::Fronts => {
                let (numbering, neighbours) = rayon::join(|| in_fronts(faces, incidence), || self.neighbourhoods());
                Ok((Some(numbering), Some(neighbours?)))
            }
        }
    }

    fn neighbourhoods(&self) -> Result<Neighbourhoods> {
        let starts = self.offsets(&self.shapes)?;
        let mut vertices = large(vec![0; starts[starts.len() - 1] as usize]);
        // Where all faces are of one size, the corners of a face take no look-up.
        match self.faces.uniform_size() {
            Some(3) => self.list(&starts, &mut vertices, |c| c / 3 * 3..c / 3 * 3 + 3),
            Some(4) => self.list(&starts, &mut vertices, |c| c / 4 * 4..c / 4 * 4 + 4),
            _ => self.list(&starts, &mut vertices, |c| self.faces.range(self.incidence.face_of(c as u32))),
        }
        Ok(Neighbourhoods { starts, vertices })
    }

    /// `corners_by` tells the corners of the face of a corner.
    fn list(&self, starts: &[u32], vertices: &mut [u32], corners_by: impl Fn(usize) -> Range<usize> + Sync) {
        parallel::parts(split_rows(starts, CHUNK, vertices), |vertices, mut part| {
            for v in vertices {
                let (row, rest) = part.split_at_mut((starts[v + 1] - starts[v]) as usize);
                self.neighbours(v, row, &corners_by);
                part = rest;
            }
        });
    }

    /// The neighbours of all rows, which start at `offsets`; `runs` are the first rows of those of equal kind and valence. The
    /// k-th row is that of the k-th vertex, or by a numbering, from what [`in_order`](Self::in_order) has listed.
    pub(super) fn codes(
        &self,
        numbering: Option<(&Numbering, &Neighbourhoods)>,
        offsets: Vec<u32>,
        runs: Vec<u32>,
    ) -> Codes {
        /// Rows between one look-up and the next. Tuned.
        const AHEAD: usize = 12;
        let Some((numbering, Neighbourhoods { starts, vertices: neighbours })) = numbering else {
            let corners_by = |c: usize| self.faces.range(self.incidence.face_of(c as u32));
            return Codes::new(offsets, runs, |v, row| self.neighbours(v, row, corners_by));
        };
        let (order, place) = (numbering.order(), numbering.place());
        Codes::new(offsets, runs, |k, row| {
            if let Some(&v) = order.get(k + 2 * AHEAD) {
                prefetch(starts, v as usize);
            }
            if let Some(&v) = order.get(k + AHEAD) {
                prefetch(neighbours, starts[v as usize] as usize);
                prefetch(neighbours, starts[v as usize + 1] as usize);
            }
            let there = &neighbours[starts[order[k] as usize] as usize..];
            let moved = |row: &mut [u32], there: &[u32]| {
                for (slot, &w) in row.iter_mut().zip(there) {
                    *slot = place[w as usize];
                }
            };
            // Without a loop for the usual lengths.
            match row.len() {
                4 => moved(&mut row[..4], &there[..4]),
                6 => moved(&mut row[..6], &there[..6]),
                8 => moved(&mut row[..8], &there[..8]),
                _ => moved(row, there),
            }
        })
    }

    /// The neighbours of a vertex.
    #[inline(always)]
    fn neighbours(&self, v: usize, row: &mut [u32], corners_by: impl Fn(usize) -> Range<usize>) {
        if row.is_empty() {
            return;
        }
        let (incidence, corners) = (self.incidence, self.faces.corners());
        match self.shapes[v].kind() {
            RowKind::Quads => {
                let (edge, opposite) = row.split_at_mut(row.len() / 2);
                let at = incidence.corners_at(v).iter();
                for ((edge, opposite), &c) in edge.iter_mut().zip(opposite).zip(at) {
                    let range = corners_by(c as usize);
                    let place = c as usize - range.start;
                    let face = &corners[range];
                    *edge = face[(place + 1) % 4];
                    *opposite = face[(place + 2) % 4];
                }
            }
            // Every edge leaves v in one of its faces; on a boundary it may only enter.
            RowKind::Edges | RowKind::Polygons => match self.open {
                None => {
                    for (slot, &c) in row.iter_mut().zip(incidence.corners_at(v)) {
                        *slot = corners[next_in(&corners_by(c as usize), c) as usize];
                    }
                }
                Some(topology) => {
                    let mut slots = row.iter_mut();
                    for &c in incidence.corners_at(v) {
                        let range = corners_by(c as usize);
                        let into = prev_in(&range, c);
                        if let Some(slot) = slots.next() {
                            *slot = corners[next_in(&range, c) as usize];
                        }
                        if topology.twin(into).is_none()
                            && let Some(slot) = slots.next()
                        {
                            *slot = corners[into as usize];
                        }
                    }
                }
            },
        }
    }

    /// The greatest valence of a row.
    pub(super) fn greatest_valence(&self) -> u32 {
        let greatest = |rows: Range<usize>| self.shapes[rows].iter().map(|s| s.valence()).max();
        parallel::map(self.shapes.len(), CHUNK, greatest).into_iter().flatten().max().unwrap_or(0)
    }

    /// The weights of rows by valence, times h.
    pub(super) fn rings(&self) -> WeightsByValence<f64> {
        let greatest = self.greatest_valence() as usize;
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

/// The shape of the row of every vertex.
fn shapes(
    faces: &Faces,
    incidence: &Incidence,
    scheme: Scheme,
    valence: impl Fn(usize) -> u32 + Sync,
) -> Vec<RowShape> {
    let edges_only = scheme.edges_only();
    let of_size = |size: usize| match size {
        _ if edges_only => RowKind::Edges,
        3 => RowKind::Edges,
        4 => RowKind::Quads,
        _ => RowKind::Polygons,
    };
    // Where all faces are of one size, they need not be looked at.
    let uniform = faces.uniform_size().map(of_size);
    let kind = |v: usize| {
        if let Some(kind) = uniform {
            return kind;
        }
        // One bit for each kind that occurs: no branch on what there is no pattern in.
        let met = incidence.corners_at(v).iter().fold(0, |met, &c| {
            let kind = of_size(faces.range(incidence.face_of(c)).len());
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
    };
    parallel::collect(incidence.vertices(), |v| match valence(v) {
        0 => RowShape::new(RowKind::Edges, 0),
        n => RowShape::new(kind(v), n),
    })
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
        let source = RowSource::new(faces, (incidence, None), Scheme::CatmullClark, None);
        let mut shapes = vec![RowShape::new(RowKind::Quads, 1 << 28); 8];
        let message = source.offsets(&shapes).unwrap_err().to_string();
        assert!(message.contains("4294967296 neighbours in 8 rows, more than 2³² − 1"), "{message}");
        shapes[3] = RowShape::new(RowKind::Quads, (1 << 28) - 1);
        assert_eq!(source.offsets(&shapes).unwrap().last(), Some(&(u32::MAX - 1)));
    }

    #[test]
    fn a_shape_is_a_kind_and_a_valence() {
        for kind in [RowKind::Quads, RowKind::Edges, RowKind::Polygons] {
            for valence in [0, 3, 4, 1 << 29] {
                let shape = RowShape::new(kind, valence);
                assert_eq!((shape.kind(), shape.valence()), (kind, valence));
            }
        }
    }
}
