//! From faces to the rows of the matrix-free [`Operator`](super::Operator).

use std::ops::Range;

use rayon::prelude::*;

use super::codes::Codes;
use super::rows::Short;
use super::scheme::{Masks, Scheme};
use super::stencil::{Kind, LargeFaces, Listed, Ring, Rings};
use super::system::FaceBlocks;
use crate::error::{Error, Result};
use crate::mesh::incidence::{next_in, prev_in};
use crate::mesh::order::Numbering;
use crate::mesh::topology::NONE;
use crate::mesh::{Faces, Incidence, Topology};
use crate::pages::large;

/// Rows of one task.
const CHUNK: usize = 4096;
/// Faces with more corners are summed as a whole: their corners are stored once, not once a pair.
const LARGE: usize = 8;

/// What a large face adds between the places s and t: `identity·δ + constant + cosine·cos(2π(s−t)/m)`.
#[derive(Clone, Copy, Debug, Default)]
struct Modes {
    identity: f64,
    constant: f64,
    cosine: f64,
}

impl Modes {
    /// The modes of the scheme's circulant, if it has these only.
    fn of(scheme: Scheme, size: usize) -> Option<Modes> {
        let turn = |k: usize| (std::f64::consts::TAU * k as f64 / size as f64).cos();
        let f = |k| scheme.face_weight(size, k);
        // The two places furthest apart on the wave lose fewest digits.
        let half = size / 2;
        let cosine = (f(1) - f(half)) / (turn(1) - turn(half));
        let constant = f(1) - cosine * turn(1);
        let modes = Modes {
            identity: f(0) - constant - cosine,
            constant,
            cosine,
        };
        let rounding = 64.0 * f64::EPSILON * f(0).abs();
        let fits = (1..size).all(|k| (constant + cosine * turn(k) - f(k)).abs() <= rounding);
        fits.then_some(modes)
    }
}

/// What the rows are built from.
pub(super) struct Source<'a> {
    faces: &'a Faces,
    incidence: &'a Incidence,
    /// The sides without an opposite, where there are such.
    open: Option<&'a Topology>,
    /// Which row is that of which vertex; the k-th of the k-th unless told.
    numbering: Option<&'a Numbering>,
    scheme: Scheme,
    /// By row, as all that is made here.
    pub(super) valences: Vec<u32>,
    /// By face size; `None` for faces whose corners are coupled one by one.
    modes: Vec<Option<Modes>>,
    /// The number of every large face; empty if there are none.
    large: Vec<u32>,
    /// What the corners of a face that is not large add to each other.
    blocks: FaceBlocks,
    half_edge: f64,
}

/// The entries of a listed row while it is made.
#[derive(Default)]
struct Entries {
    neighbours: Vec<u32>,
    weights: Vec<f64>,
    short: Short,
    pairs: Vec<(u32, f64)>,
}

/// Adds to the entry of a vertex, or makes it.
fn add(entries: &mut Vec<(u32, f64)>, vertex: u32, weight: f64) {
    match entries.iter_mut().find(|e| e.0 == vertex) {
        Some(entry) => entry.1 += weight,
        None => entries.push((vertex, weight)),
    }
}

impl<'a> Source<'a> {
    /// # Panics
    /// If the numbering is not of these vertices.
    pub(super) fn new(
        faces: &'a Faces,
        (incidence, open): (&'a Incidence, Option<&'a Topology>),
        scheme: Scheme,
        numbering: Option<&'a Numbering>,
    ) -> Self {
        let n = incidence.vertices();
        let order = numbering.map(Numbering::order);
        assert!(
            order.is_none_or(|order| order.len() == n),
            "one entry a vertex"
        );
        let vertex = |k: usize| order.map_or(k, |order| order[k] as usize);
        let valences = (0..n)
            .into_par_iter()
            .with_min_len(CHUNK)
            .map(|k| match open {
                None => incidence.face_count(vertex(k)) as u32,
                Some(topology) => topology.edge_valence(faces, vertex(k)) as u32,
            })
            .collect();
        let mut source = Source {
            faces,
            incidence,
            open,
            numbering,
            scheme,
            valences,
            modes: Vec::new(),
            large: Vec::new(),
            blocks: FaceBlocks::new(faces, &scheme),
            half_edge: 0.5 * scheme.edge_weight(),
        };
        if scheme.edges_only() || faces.uniform_size().is_some_and(|size| size <= LARGE) {
            return source;
        }
        let largest = faces.iter().map(<[u32]>::len).max().unwrap_or(0);
        let mut occurs = vec![false; largest + 1];
        faces.iter().for_each(|f| occurs[f.len()] = true);
        source.modes = occurs
            .iter()
            .enumerate()
            .map(|(size, &occurs)| {
                if occurs && size > LARGE {
                    Modes::of(scheme, size)
                } else {
                    None
                }
            })
            .collect();
        if source.modes.iter().any(Option::is_some) {
            let mut count = 0;
            source.large = faces
                .iter()
                .map(|f| match source.modes[f.len()] {
                    Some(_) => {
                        count += 1;
                        count - 1
                    }
                    None => NONE,
                })
                .collect();
        }
        source
    }

    /// The vertex of a row.
    fn vertex(&self, k: usize) -> usize {
        self.numbering
            .map_or(k, |numbering| numbering.order()[k] as usize)
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
        self.numbering
            .map_or(v, |numbering| numbering.place()[v as usize])
    }

    fn modes(&self, size: usize) -> Option<Modes> {
        self.modes.get(size).copied().flatten()
    }

    /// The kind of every row.
    pub(super) fn kinds(&self) -> Vec<Kind> {
        let n = self.valences.len();
        let of_size = |size: usize| match size {
            _ if self.scheme.edges_only() => Kind::Edges,
            3 => Kind::Edges,
            4 => Kind::Quads,
            _ => Kind::Listed,
        };
        if let Some(size) = self.faces.uniform_size() {
            return vec![of_size(size); n];
        }
        let incidence = self.incidence;
        (0..n)
            .into_par_iter()
            .with_min_len(CHUNK)
            .map(|k| {
                let mut kinds = incidence
                    .corners_at(self.vertex(k))
                    .iter()
                    .map(|&c| of_size(self.faces.range(incidence.face_of(c)).len()));
                let first = kinds.next().unwrap_or(Kind::Edges);
                if kinds.all(|k| k == first) {
                    first
                } else {
                    Kind::Listed
                }
            })
            .collect()
    }

    pub(super) fn offsets(&self, kinds: &[Kind], listed: &Listed) -> Result<Vec<u32>> {
        let mut offsets = large(Vec::with_capacity(kinds.len() + 1));
        offsets.push(0);
        let mut end = 0u32;
        for (v, kind) in kinds.iter().enumerate() {
            let length = match kind {
                Kind::Quads => 2 * self.valences[v],
                Kind::Edges => self.valences[v],
                Kind::Listed => listed.entries(v).len() as u32,
            };
            end = end.checked_add(length).ok_or_else(|| {
                Error::Computation(
                    "the operator would have more neighbours than 32-bit indices reach; use a smaller mesh"
                        .into(),
                )
            })?;
            offsets.push(end);
        }
        Ok(offsets)
    }

    /// The neighbours of all rows.
    pub(super) fn codes(&self, kinds: &[Kind], offsets: Vec<u32>, listed: &Listed) -> Codes {
        // Where all faces are of one size, the corners of a face take no look-up.
        match self.faces.uniform_size() {
            Some(3) => self.codes_by(kinds, offsets, listed, |c| c / 3 * 3..c / 3 * 3 + 3),
            Some(4) => self.codes_by(kinds, offsets, listed, |c| c / 4 * 4..c / 4 * 4 + 4),
            _ => self.codes_by(kinds, offsets, listed, |c| {
                self.faces.range(self.incidence.face_of(c as u32))
            }),
        }
    }

    /// `corners_by` tells the corners of the face of a corner.
    fn codes_by(
        &self,
        kinds: &[Kind],
        offsets: Vec<u32>,
        listed: &Listed,
        corners_by: impl Fn(usize) -> Range<usize> + Sync,
    ) -> Codes {
        let incidence = self.incidence;
        let corners = self.faces.corners();
        Codes::new(offsets, |k, row| {
            self.fetch_ahead(k);
            let v = self.vertex(k);
            match kinds[k] {
                Kind::Quads => {
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
                Kind::Edges => {
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
                Kind::Listed => {
                    for (slot, &w) in row.iter_mut().zip(&listed.neighbours[listed.entries(k)]) {
                        *slot = self.row(w);
                    }
                }
            }
        })
    }

    /// The entries of the row of vertex `v`, of valence `n`, of M off the diagonal, large faces aside: one for each end
    /// of an edge, however many faces have it, and one for each other corner of a face, by ascending vertices. Returns
    /// the part of the diagonal that is no part of a large face's sum.
    fn list(&self, v: usize, n: u32, entries: &mut Entries) -> f64 {
        self.list_usual(v, n, entries)
            .unwrap_or_else(|| self.list_any(v, n, entries))
    }

    fn list_any(&self, v: usize, n: u32, entries: &mut Entries) -> f64 {
        let pairs = &mut entries.pairs;
        pairs.clear();
        let incidence = self.incidence;
        let mut own = self.scheme.vertex_weight(n as usize);
        for &c in incidence.corners_at(v) {
            let f = incidence.face_of(c);
            let range = self.faces.range(f);
            let size = range.len();
            let place = c as usize - range.start;
            let face = &self.faces.corners()[range];
            // The ends of edges first, where the next face at v looks for them.
            let (ahead, behind) = (face[(place + 1) % size], face[(place + size - 1) % size]);
            if let Some(modes) = self.modes(size) {
                own += modes.identity;
                if self.half_edge != 0.0 {
                    add(pairs, ahead, self.half_edge);
                    add(pairs, behind, self.half_edge);
                }
                continue;
            }
            let block = &self.blocks.by_size[size];
            own += block[0];
            add(pairs, ahead, block[1]);
            add(pairs, behind, block[size - 1]);
            for (steps, &weight) in block.iter().enumerate().take(size - 1).skip(2) {
                let t = place + steps;
                let corner = if t < size { t } else { t - size };
                pairs.push((face[corner], weight));
            }
        }
        pairs.sort_unstable_by_key(|e| e.0);
        (entries.neighbours, entries.weights) = pairs.iter().copied().unzip();
        own
    }

    /// The usual case, the same to the last bit: few faces at the vertex, none of them large, that share edges which
    /// one of them leaves on and another enters, and no vertex otherwise. `None` in all other cases.
    fn list_usual(&self, v: usize, n: u32, entries: &mut Entries) -> Option<f64> {
        /// Faces at a vertex.
        const FEW: usize = 8;
        let at = self.incidence.corners_at(v);
        if at.len() > FEW {
            return None;
        }
        let (mut leaving, mut entering) = ([(0, 0.0); FEW], [(0, 0.0); FEW]);
        let (leaving, entering) = (&mut leaving[..at.len()], &mut entering[..at.len()]);
        let short = &mut entries.short;
        short.clear();
        let mut own = self.scheme.vertex_weight(n as usize);
        for ((out, into), &c) in leaving.iter_mut().zip(entering.iter_mut()).zip(at) {
            let range = self.faces.range(self.incidence.face_of(c));
            if range.len() < 3 || self.modes(range.len()).is_some() {
                return None;
            }
            let block = &self.blocks.by_size[range.len()];
            own += block[0];
            let corners = self.faces.corners();
            let mut other = next_in(&range, c);
            *out = (corners[other as usize], block[1]);
            for &weight in &block[2..block.len() - 1] {
                other = next_in(&range, other);
                short.add(corners[other as usize], weight);
            }
            *into = (
                corners[next_in(&range, other) as usize],
                block[block.len() - 1],
            );
        }
        for &(w, one) in &*leaving {
            let (_, other) = entering.iter().find(|e| e.0 == w)?;
            short.add(w, one + other);
        }
        short.sort_into(&mut entries.neighbours, &mut entries.weights)?;
        Some(own)
    }

    /// The weights of rows whose faces are all quads, or all triangles.
    pub(super) fn rings(&self) -> Rings<f64> {
        let greatest = self.valences.iter().copied().max().unwrap_or(0) as usize;
        let s = self.scheme;
        let ring = |n: usize, size: usize| {
            let (x, h) = (n as f64, s.h(n.max(1)));
            let (face, opposite) = if s.edges_only() {
                ([0.0; 3], 0.0)
            } else {
                let at = |steps| s.face_weight(size, steps);
                ([at(0), at(1), at(size - 1)], at(2))
            };
            Ring::new(
                h * (s.vertex_weight(n.max(1)) + x * face[0]),
                h * (s.edge_weight() + face[1] + face[2]),
                h * opposite,
            )
        };
        let rings = |size| (0..=greatest).map(|n| ring(n, size)).collect();
        Rings {
            quads: rings(4),
            edges: rings(3),
        }
    }

    /// The listed rows; `h` by valence.
    pub(super) fn listed(&self, kinds: &[Kind], h: &[f64]) -> (Listed, LargeFaces) {
        let mut large = LargeFaces {
            offsets: vec![0],
            ..LargeFaces::default()
        };
        for face in self.faces.iter().filter(|_| !self.large.is_empty()) {
            if let Some(modes) = self.modes(face.len()) {
                large.corners.extend(face.iter().map(|&v| self.row(v)));
                large.offsets.push(large.corners.len() as u32);
                large.constant.push(modes.constant);
                large.cosine.push(modes.cosine);
            }
        }
        let incidence = self.incidence;
        let listed = Listed::collect(kinds, |k, listed, entries: &mut Entries| {
            self.fetch_ahead(k);
            let v = self.vertex(k);
            let own = self.list(v, self.valences[k], entries);
            let h = h[self.valences[k] as usize];
            listed.own.push(h * own);
            listed.h.push(h);
            listed.weights.extend(entries.weights.iter().map(|w| h * w));
            listed.neighbours.extend(&entries.neighbours);
            for &c in incidence.corners_at(v) {
                let f = incidence.face_of(c);
                if let Some(&number) = self.large.get(f).filter(|&&number| number != NONE) {
                    let place = c as usize - self.faces.range(f).start;
                    listed.corners.push((number, place as u32));
                }
            }
        });
        (listed, large)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::builtin::builtin;
    use crate::mesh::generate::random_polygons;

    #[test]
    fn usual_rows_are_listed_as_all_others_to_the_last_bit() {
        let large = builtin("irregular-poly:3000").unwrap();
        let mut usual = 0;
        for mesh in (0..40).map(random_polygons).chain([large]) {
            let incidence = Incidence::new(&mesh.faces, mesh.len());
            for scheme in [Scheme::CatmullClark, Scheme::Nasri, Scheme::ZhengCai] {
                let source = Source::new(&mesh.faces, (&incidence, None), scheme, None);
                let (mut one, mut other) = (Entries::default(), Entries::default());
                for v in 0..mesh.len() {
                    let n = source.valences[v];
                    let Some(own) = source.list_usual(v, n, &mut one) else {
                        continue;
                    };
                    let expected = source.list_any(v, n, &mut other);
                    assert_eq!(own.to_bits(), expected.to_bits(), "{scheme}, row {v}");
                    assert_eq!(one.neighbours, other.neighbours, "{scheme}, row {v}");
                    let bits =
                        |e: &Entries| e.weights.iter().map(|w| w.to_bits()).collect::<Vec<_>>();
                    assert_eq!(bits(&one), bits(&other), "{scheme}, row {v}");
                    usual += 1;
                }
            }
        }
        assert!(usual > 6000, "{usual}");
    }
}
