//! The matrix-free twin of [`LimitSystem`](super::LimitSystem): A, M and D⁻¹A from connectivity alone.

use glam::DVec3;
use rayon::prelude::*;

use super::bounds::SpectralBounds;
use super::scheme::{Masks, Scheme};
use super::source::{Encode, Source, fill_rows};
use super::stencil::{Code, Kind, LargeFaces, Listed, Neighbours, Point, Stencil, runs};
use super::system::check_mesh;
use crate::error::Result;
use crate::mesh::topology::NONE;
use crate::mesh::{Faces, Topology};

/// Rows of one task.
const CHUNK: usize = 4096;
/// Consecutive vertices among which equal valences are brought together: few enough to leave the order's locality
/// alone, enough for runs that a branch predictor follows. Tuned on an irregular quad sphere.
const GROUP: usize = 256;

/// A = H·M without stored entries: a row knows its neighbours, and its weights follow from valence and face size.
///
/// Per vertex of valence 4 among quads, a sweep over A reads 8 neighbours of 2 bytes (as distances from the row,
/// where the vertex order keeps them below 2¹⁵; else 4 bytes), 4 bytes for where they start and 1 for the kind of
/// row: 21 bytes (37) against the 9·(8 + 4) + 4 = 112 of the explicit matrix. To this come the arrays of points:
/// 24 bytes a vertex each, 16 in single precision. Weights are stored for rows with mixed face sizes only, and
/// faces of more than 8 corners are summed once a sweep: O(|F|), not O(|F|²).
#[derive(Clone, Debug)]
pub struct Operator {
    pub(super) stencil: Stencil,
    h: Vec<f64>,
    diagonal: Vec<f64>,
    bounds: SpectralBounds,
}

impl Operator {
    /// The operator of `scheme` on a mesh that the validator has passed. O(corners), in parallel.
    ///
    /// # Errors
    /// As [`LimitSystem::new`](super::LimitSystem::new); more than 2³² − 1 neighbours.
    pub fn new(faces: &Faces, topology: &Topology, scheme: Scheme) -> Result<Self> {
        check_mesh(faces, topology, scheme)?;
        let source = Source::new(faces, topology, scheme);
        let n = source.valences.len();
        let kinds = source.kinds();
        let greatest = source.valences.iter().copied().max().unwrap_or(0);
        let by_valence: Vec<f64> = (0..=greatest)
            .map(|n| scheme.h(n.max(1) as usize))
            .collect();
        let h = gather(&by_valence, &source.valences);
        let (mut listed, large) = source.listed(&kinds, &h);
        let offsets = source.offsets(&kinds, &listed)?;
        let neighbours = match source.fill::<i16>(&kinds, &offsets, &listed) {
            Some(near) => Neighbours::Near(near),
            None => Neighbours::Far(source.fill(&kinds, &offsets, &listed).unwrap_or_default()),
        };
        listed.neighbours = Vec::new();
        let double = source.rings();
        let diagonal: Vec<f64> = (0..n)
            .into_par_iter()
            .with_min_len(CHUNK)
            .map(|i| match kinds[i] {
                Kind::Listed => listed.diagonal(i, &large),
                kind => double.own(kind, source.valences[i] as usize),
            })
            .collect();
        let bounds = if topology.is_closed() {
            let triangles = faces.uniform_size() == Some(3);
            SpectralBounds::closed(scheme, &source.valences, triangles, &diagonal)
        } else {
            SpectralBounds::gershgorin(&diagonal)
        };
        Ok(Operator {
            stencil: Stencil {
                runs: runs(&kinds, &offsets),
                offsets,
                kinds,
                neighbours,
                single: double.single(),
                double,
                listed,
                large,
            },
            h,
            diagonal,
            bounds,
        })
    }

    /// The number of vertices N.
    pub fn len(&self) -> usize {
        self.h.len()
    }

    pub fn is_empty(&self) -> bool {
        self.h.is_empty()
    }

    /// The diagonal of H.
    pub fn weights(&self) -> &[f64] {
        &self.h
    }

    /// diag A.
    pub fn diagonal(&self) -> &[f64] {
        &self.diagonal
    }

    /// What valences and face sizes prove about the spectrum of A.
    pub fn bounds(&self) -> SpectralBounds {
        self.bounds
    }

    /// (A x)_i.
    #[inline]
    pub fn row(&self, i: usize, x: &[DVec3]) -> DVec3 {
        self.stencil.row(i, x)
    }

    /// (M x)_i = (A x)_i / h_i.
    pub fn symmetric_row(&self, i: usize, x: &[DVec3]) -> DVec3 {
        self.row(i, x) / self.h[i]
    }

    /// (D⁻¹A x)_i, D = diag A.
    pub fn jacobi_row(&self, i: usize, x: &[DVec3]) -> DVec3 {
        self.row(i, x) / self.diagonal[i]
    }

    /// Calls `visit(j, a_ij)` for every neighbour j ≠ i of vertex `i`; a vertex that is joined to `i` more than once
    /// comes as often, with a part of the entry each time. O(neighbours + corners of large faces at `i`).
    pub fn neighbours(&self, i: usize, visit: impl FnMut(usize, f64)) {
        self.stencil.entries(i, visit);
    }

    /// Sums over the large faces that the rows of one sweep share; empty without such faces.
    pub fn moments<P: Point>(&self, x: &[P], moments: &mut Vec<[P; 3]>) {
        self.stencil.moments(x, moments);
    }

    /// Calls `visit(k, (A x)_i)` for the k-th row i of `rows`. `window` holds x from vertex `start` on, as far as
    /// the rows [reach](Self::reach), and `moments` comes from [`moments`](Self::moments) of the whole x.
    ///
    /// # Panics
    /// If a row reaches beyond the window.
    #[inline(always)]
    pub fn rows<P: Point>(
        &self,
        rows: std::ops::Range<usize>,
        (window, start): (&[P], usize),
        moments: &[[P; 3]],
        visit: impl FnMut(usize, P),
    ) {
        self.stencil.rows(rows, window, start, moments, visit);
    }

    /// The greatest distance in the vertex order between a row and its neighbours; `None` with large faces, whose
    /// corners may be anywhere.
    pub fn reach(&self) -> Option<usize> {
        if !self.stencil.large.constant.is_empty() {
            return None;
        }
        let rows = (0..self.len()).into_par_iter().with_min_len(CHUNK);
        match &self.stencil.neighbours {
            Neighbours::Near(near) => near
                .par_iter()
                .with_min_len(CHUNK)
                .map(|d| usize::from(d.unsigned_abs()))
                .max(),
            Neighbours::Far(far) => rows
                .map(|i| {
                    let range =
                        self.stencil.offsets[i] as usize..self.stencil.offsets[i + 1] as usize;
                    far[range]
                        .iter()
                        .map(|&j| i.abs_diff(j as usize))
                        .max()
                        .unwrap_or(0)
                })
                .max(),
        }
        .or(Some(0))
    }

    /// Bytes of the operator itself that one sweep over A reads.
    pub fn sweep_bytes(&self) -> usize {
        let s = &self.stencil;
        let code = match s.neighbours {
            Neighbours::Near(_) => 2,
            Neighbours::Far(_) => 4,
        };
        let listed = 8 * s.listed.weights.len() + 40 * s.listed.own.len();
        let large = 4 * s.large.corners.len() + 8 * s.listed.corners.len();
        5 * self.len() + code * self.entries() + listed + large
    }

    /// Neighbours of all rows together.
    pub fn entries(&self) -> usize {
        self.stencil.offsets.last().map_or(0, |&end| end as usize)
    }

    /// An order for fast sweeps: breadth first, so that every row's neighbours lie in a narrow band; and among
    /// `GROUP` consecutive vertices by kind of row, so that equal rows follow each other. O(entries).
    pub fn front_order(&self) -> Vec<u32> {
        let mut order = match &self.stencil.neighbours {
            Neighbours::Near(near) => self.breadth_first(near),
            Neighbours::Far(far) => self.breadth_first(far),
        };
        let stencil = &self.stencil;
        order.par_chunks_mut(GROUP).for_each(|group| {
            group.sort_by_key(|&v| {
                let v = v as usize;
                let length = stencil.offsets[v + 1] - stencil.offsets[v];
                (length, stencil.kinds[v] as u8)
            });
        });
        order
    }

    fn breadth_first<C: Code>(&self, codes: &[C]) -> Vec<u32> {
        let n = self.len();
        let stencil = &self.stencil;
        let mut seen = vec![0u64; n.div_ceil(64)];
        let mut face_seen = vec![false; stencil.large.constant.len()];
        let mut order: Vec<u32> = Vec::with_capacity(n);
        let meet = |v: usize, seen: &mut [u64], order: &mut Vec<u32>| {
            let bit = 1u64 << (v % 64);
            if seen[v / 64] & bit == 0 {
                seen[v / 64] |= bit;
                order.push(v as u32);
            }
        };
        let mut next = 0;
        for seed in 0..n {
            meet(seed, &mut seen, &mut order);
            while let Some(&v) = order.get(next) {
                next += 1;
                let v = v as usize;
                let range = stencil.offsets[v] as usize..stencil.offsets[v + 1] as usize;
                for &c in &codes[range] {
                    meet(c.place(v, 0), &mut seen, &mut order);
                }
                for &(f, _) in stencil.listed.large_at(v) {
                    let f = f as usize;
                    if !std::mem::replace(&mut face_seen[f], true) {
                        for &w in stencil.large.corners_of(f) {
                            meet(w as usize, &mut seen, &mut order);
                        }
                    }
                }
            }
        }
        order
    }

    /// The same operator on the vertices in another order: row k is that of vertex `order[k]`.
    ///
    /// # Panics
    /// If `order` is not a permutation of the vertices.
    pub fn renumbered(&self, order: &[u32]) -> Operator {
        assert_eq!(order.len(), self.len(), "one entry a vertex");
        let old = &self.stencil;
        let place = crate::mesh::order::inverse(order);
        let mut offsets = Vec::with_capacity(order.len() + 1);
        let mut end = 0u32;
        offsets.push(0);
        for &v in order {
            end += old.offsets[v as usize + 1] - old.offsets[v as usize];
            offsets.push(end);
        }
        let neighbours = match &old.neighbours {
            Neighbours::Near(codes) => renumber(codes, &old.offsets, order, &place, &offsets),
            Neighbours::Far(codes) => renumber(codes, &old.offsets, order, &place, &offsets),
        };
        let kinds = gather(&old.kinds, order);
        let listed = old.listed.renumbered(order, &kinds);
        let mut large = old.large.clone();
        for v in &mut large.corners {
            *v = place[*v as usize];
        }
        Operator {
            stencil: Stencil {
                runs: runs(&kinds, &offsets),
                offsets,
                kinds,
                neighbours,
                double: old.double.clone(),
                single: old.single.clone(),
                listed,
                large,
            },
            h: gather(&self.h, order),
            diagonal: gather(&self.diagonal, order),
            bounds: self.bounds,
        }
    }
}

/// `values` in another order: the k-th is that of vertex `order[k]`.
pub fn gather<T: Copy + Send + Sync>(values: &[T], order: &[u32]) -> Vec<T> {
    order
        .par_iter()
        .with_min_len(CHUNK)
        .map(|&v| values[v as usize])
        .collect()
}

fn renumber<C: Code>(
    codes: &[C],
    old_offsets: &[u32],
    order: &[u32],
    place: &[u32],
    offsets: &[u32],
) -> Neighbours {
    fn rows<C: Code, D: Encode>(
        codes: &[C],
        old_offsets: &[u32],
        order: &[u32],
        place: &[u32],
        offsets: &[u32],
    ) -> Option<Vec<D>> {
        fill_rows(offsets, |k, row| {
            let v = order[k] as usize;
            let old = &codes[old_offsets[v] as usize..old_offsets[v + 1] as usize];
            for (new, c) in row.iter_mut().zip(old) {
                *new = D::encode(k, place[c.place(v, 0)])?;
            }
            Some(())
        })
    }
    match rows::<C, i16>(codes, old_offsets, order, place, offsets) {
        Some(near) => Neighbours::Near(near),
        // Every vertex has a code of 32 bits.
        None => {
            Neighbours::Far(rows(codes, old_offsets, order, place, offsets).unwrap_or_default())
        }
    }
}

impl Listed {
    /// Puts together the listed rows of these kinds, in their order: `fill(i, …)` adds those of row `i`, but for its
    /// starts. In parallel.
    pub(super) fn collect(
        kinds: &[Kind],
        fill: impl Fn(usize, &mut Listed, &mut Vec<(u32, f64)>) + Sync,
    ) -> Listed {
        let mut all = Listed::default();
        if !kinds.contains(&Kind::Listed) {
            return all;
        }
        let parts: Vec<Listed> = (0..kinds.len().div_ceil(CHUNK))
            .into_par_iter()
            .map_init(Vec::new, |scratch, k| {
                let mut part = Listed::default();
                let rows = k * CHUNK..((k + 1) * CHUNK).min(kinds.len());
                for i in rows.filter(|&i| kinds[i] == Kind::Listed) {
                    part.slots.push(i as u32);
                    part.starts.push(part.weights.len() as u32);
                    part.large_starts.push(part.corners.len() as u32);
                    fill(i, &mut part, scratch);
                }
                part
            })
            .collect();
        all.slots = vec![NONE; kinds.len()];
        for part in parts {
            let (weights, corners) = (all.weights.len() as u32, all.corners.len() as u32);
            for (k, &i) in (all.own.len() as u32..).zip(&part.slots) {
                all.slots[i as usize] = k;
            }
            all.starts.extend(part.starts.iter().map(|s| s + weights));
            all.large_starts
                .extend(part.large_starts.iter().map(|s| s + corners));
            all.own.extend(part.own);
            all.h.extend(part.h);
            all.weights.extend(part.weights);
            all.neighbours.extend(part.neighbours);
            all.corners.extend(part.corners);
        }
        all.starts.push(all.weights.len() as u32);
        all.large_starts.push(all.corners.len() as u32);
        all
    }

    /// The weights of listed row `i`.
    pub(super) fn entries(&self, i: usize) -> std::ops::Range<usize> {
        let slot = self.slots[i] as usize;
        self.starts[slot] as usize..self.starts[slot + 1] as usize
    }

    /// The rows in another order, one after the other in memory again: row k is that of vertex `order[k]`.
    fn renumbered(&self, order: &[u32], kinds: &[Kind]) -> Listed {
        Listed::collect(kinds, |k, listed, _| {
            let v = order[k] as usize;
            let slot = self.slots[v] as usize;
            let weights = self.entries(v);
            listed.own.push(self.own[slot]);
            listed.h.push(self.h[slot]);
            listed.weights.extend_from_slice(&self.weights[weights]);
            listed.corners.extend_from_slice(self.large_at(v));
        })
    }

    /// The large faces at vertex `i`, each with the place of `i` in it.
    pub(super) fn large_at(&self, i: usize) -> &[(u32, u32)] {
        match self.slots.get(i) {
            Some(&slot) if slot != NONE => {
                let slot = slot as usize;
                &self.corners
                    [self.large_starts[slot] as usize..self.large_starts[slot + 1] as usize]
            }
            _ => &[],
        }
    }

    fn diagonal(&self, i: usize, large: &LargeFaces) -> f64 {
        let slot = self.slots[i] as usize;
        let faces: f64 = self
            .large_at(i)
            .iter()
            .map(|&(f, _)| large.constant[f as usize] + large.cosine[f as usize])
            .sum();
        self.own[slot] + self.h[slot] * faces
    }
}
