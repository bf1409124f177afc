//! The matrix-free twin of [`LimitSystem`](super::LimitSystem): A, M and D⁻¹A from connectivity alone.

use std::sync::OnceLock;

use glam::DVec3;
use rayon::prelude::*;

use super::bounds::{SpectralBounds, usual_lambda_min};
use super::codes::Neighbours;
use super::scheme::{Masks, Scheme};
use super::source::Source;
use super::stencil::{Kind, LargeFaces, Listed, Point, Stencil, runs};
use super::system::{check_boundary, check_faces};
use crate::error::Result;
use crate::mesh::order::Numbering;
use crate::mesh::topology::NONE;
use crate::mesh::{Faces, Incidence, Topology};
use crate::pages::large;

/// Rows of one task.
const CHUNK: usize = 4096;
/// Room for so many neighbours of a listed row.
const USUAL: usize = 12;

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
    /// h by valence.
    h: Vec<f64>,
    /// h and a_ii by row, of use to some methods only: made when first asked for.
    weights: OnceLock<Vec<f64>>,
    diagonal: OnceLock<Vec<f64>>,
    bounds: SpectralBounds,
    usual_lambda_min: f64,
}

impl Operator {
    /// The operator of `scheme` on a mesh that the validator has passed. O(corners), in parallel.
    ///
    /// # Errors
    /// As [`LimitSystem::new`](super::LimitSystem::new); more than 2³² − 1 neighbours.
    pub fn new(faces: &Faces, topology: &Topology, scheme: Scheme) -> Result<Self> {
        Self::in_order(faces, topology, scheme, None)
    }

    /// As [`new`](Self::new), with the rows in another order: the k-th is that of the vertex at place k, and its
    /// neighbours are rows too.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    ///
    /// # Panics
    /// If the numbering is of another number of vertices.
    pub fn in_order(
        faces: &Faces,
        topology: &Topology,
        scheme: Scheme,
        numbering: Option<&Numbering>,
    ) -> Result<Self> {
        check_boundary(topology, scheme)?;
        let open = (topology.boundary_edges() > 0).then_some(topology);
        Self::build(
            faces,
            (&topology.incidence, open),
            topology.is_closed(),
            scheme,
            numbering,
        )
    }

    /// As [`in_order`](Self::in_order), on a mesh that is [closed](Incidence::is_closed): a topology is not needed.
    ///
    /// # Errors
    /// A face that is no triangle under Loop or √3; more than 2³² − 1 neighbours.
    ///
    /// # Panics
    /// If the numbering is of another number of vertices.
    pub fn closed_in_order(
        faces: &Faces,
        incidence: &Incidence,
        scheme: Scheme,
        numbering: Option<&Numbering>,
    ) -> Result<Self> {
        Self::build(faces, (incidence, None), true, scheme, numbering)
    }

    fn build(
        faces: &Faces,
        sides: (&Incidence, Option<&Topology>),
        closed: bool,
        scheme: Scheme,
        numbering: Option<&Numbering>,
    ) -> Result<Self> {
        check_faces(faces, scheme)?;
        let source = Source::new(faces, sides, scheme, numbering);
        let kinds = source.kinds();
        let greatest = source.valences.iter().copied().max().unwrap_or(0);
        let h: Vec<f64> = (0..=greatest)
            .map(|n| scheme.h(n.max(1) as usize))
            .collect();
        let (mut listed, large) = source.listed(&kinds, &h);
        let offsets = source.offsets(&kinds, &listed)?;
        let runs = runs(&kinds, &offsets);
        let codes = source.codes(&kinds, offsets, &listed);
        listed.neighbours = Vec::new();
        let double = source.rings();
        let stencil = Stencil {
            runs,
            codes,
            kinds,
            single: double.single(),
            double,
            listed,
            large,
        };
        // Rows of a run that is not listed are alike.
        let (valences, diagonal): (Vec<u32>, Vec<f64>) = (0..stencil.runs.len())
            .into_par_iter()
            .flat_map_iter(|k| {
                let run = stencil.run(k);
                match stencil.kinds[run.start] {
                    Kind::Listed => run,
                    _ => run.start..run.start + 1,
                }
            })
            .map(|i| (source.valences[i], stencil.diagonal(i)))
            .unzip();
        let triangles = faces.uniform_size() == Some(3);
        let bounds = if closed {
            SpectralBounds::closed(scheme, &valences, triangles, &diagonal)
        } else {
            SpectralBounds::gershgorin(&diagonal)
        };
        Ok(Operator {
            stencil,
            h,
            weights: OnceLock::new(),
            diagonal: OnceLock::new(),
            bounds,
            usual_lambda_min: usual_lambda_min(scheme),
        })
    }

    /// The number of vertices N.
    pub fn len(&self) -> usize {
        self.stencil.codes.rows()
    }

    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The diagonal of H.
    pub fn weights(&self) -> &[f64] {
        self.weights.get_or_init(|| self.by_row(|i| self.weight(i)))
    }

    /// diag A.
    pub fn diagonal(&self) -> &[f64] {
        self.diagonal
            .get_or_init(|| self.by_row(|i| self.stencil.diagonal(i)))
    }

    fn by_row(&self, value: impl Fn(usize) -> f64 + Send + Sync) -> Vec<f64> {
        let rows = (0..self.len()).into_par_iter().with_min_len(CHUNK);
        rows.map(value).collect()
    }

    /// h_i.
    fn weight(&self, i: usize) -> f64 {
        match self.stencil.valence(i) {
            Some(n) => self.h[n],
            None => self.stencil.listed.weight(i),
        }
    }

    /// What valences and face sizes prove about the spectrum of A.
    pub fn bounds(&self) -> SpectralBounds {
        self.bounds
    }

    /// What the scheme's [λ_min usually is](super::bounds::usual_lambda_min).
    pub fn usual_lambda_min(&self) -> f64 {
        self.usual_lambda_min
    }

    /// (A x)_i.
    #[inline]
    pub fn row(&self, i: usize, x: &[DVec3]) -> DVec3 {
        self.stencil.row(i, x)
    }

    /// (A x)_i, where `points` holds x from vertex `start` on, as far as the row [reaches](Self::reach).
    ///
    /// # Panics
    /// If the row reaches beyond the points; with large faces.
    #[inline]
    pub fn row_within<P: Point>(&self, i: usize, points: (&[P], usize)) -> P {
        assert!(self.stencil.large.constant.is_empty(), "no large faces");
        self.stencil.row_within(i, points)
    }

    /// (M x)_i = (A x)_i / h_i.
    pub fn symmetric_row(&self, i: usize, x: &[DVec3]) -> DVec3 {
        self.row(i, x) / self.weight(i)
    }

    /// (D⁻¹A x)_i, D = diag A.
    pub fn jacobi_row(&self, i: usize, x: &[DVec3]) -> DVec3 {
        self.row(i, x) / self.stencil.diagonal(i)
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

    /// Calls `visit(slot, x_i, (A x)_i)` for every row i of `rows`, in ascending order. `slots(m)` gives what the next
    /// m rows are visited with. `window` holds x from vertex `start` on, as far as the rows [reach](Self::reach),
    /// and `moments` comes from [`moments`](Self::moments) of the whole x.
    ///
    /// # Panics
    /// If a row reaches beyond the window.
    #[inline(always)]
    pub fn rows<P: Point, I: Iterator>(
        &self,
        rows: std::ops::Range<usize>,
        window: (&[P], usize),
        moments: &[[P; 3]],
        slots: impl FnMut(usize) -> I,
        visit: impl FnMut(I::Item, P, P),
    ) {
        self.stencil.rows(rows, window, moments, slots, visit);
    }

    /// The greatest distance in the vertex order between a row and its neighbours; `None` with large faces, whose
    /// corners may be anywhere.
    pub fn reach(&self) -> Option<usize> {
        let large = !self.stencil.large.constant.is_empty();
        (!large).then_some(self.stencil.codes.reach())
    }

    /// Bytes of the operator itself that one sweep over A reads.
    pub fn sweep_bytes(&self) -> usize {
        let s = &self.stencil;
        let code = match s.codes.neighbours() {
            Neighbours::Near(_) => 2,
            Neighbours::Far(_) => 4,
        };
        let listed = 8 * s.listed.weights.len() + 40 * s.listed.own.len();
        let large = 4 * s.large.corners.len() + 8 * s.listed.corners.len();
        5 * self.len() + code * self.entries() + listed + large
    }

    /// Neighbours of all rows together.
    pub fn entries(&self) -> usize {
        self.stencil
            .codes
            .offsets()
            .last()
            .map_or(0, |&end| end as usize)
    }
}

/// One list of all parts, one after the other. In parallel.
fn concat<T: Copy + Default + Send + Sync>(
    parts: &[Listed],
    list: impl Fn(&Listed) -> &[T] + Sync,
) -> Vec<T> {
    let mut all = large(vec![
        T::default();
        parts.iter().map(|part| list(part).len()).sum()
    ]);
    let mut rest = all.as_mut_slice();
    let mut pairs = Vec::with_capacity(parts.len());
    for part in parts {
        let (place, after) = rest.split_at_mut(list(part).len());
        pairs.push((place, part));
        rest = after;
    }
    pairs
        .into_par_iter()
        .for_each(|(place, part)| place.copy_from_slice(list(part)));
    all
}

impl Listed {
    /// Puts together the listed rows of these kinds, in their order: `fill(i, …)` adds those of row `i`, but for its
    /// starts. In parallel.
    pub(super) fn collect<T: Default>(
        kinds: &[Kind],
        fill: impl Fn(usize, &mut Listed, &mut T) + Sync,
    ) -> Listed {
        let mut all = Listed::default();
        if !kinds.contains(&Kind::Listed) {
            return all;
        }
        let mut parts: Vec<Listed> = (0..kinds.len().div_ceil(CHUNK))
            .into_par_iter()
            .map_init(T::default, |scratch, k| {
                let mut part = Listed {
                    weights: Vec::with_capacity(USUAL * CHUNK),
                    neighbours: Vec::with_capacity(USUAL * CHUNK),
                    ..Listed::default()
                };
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
        let (mut weights, mut corners) = (0, 0);
        for part in &mut parts {
            part.starts.iter_mut().for_each(|s| *s += weights);
            part.large_starts.iter_mut().for_each(|s| *s += corners);
            weights += part.weights.len() as u32;
            corners += part.corners.len() as u32;
        }
        all.slots = vec![NONE; kinds.len()];
        let listed = parts.iter().flat_map(|part| &part.slots);
        for (slot, &i) in (0..).zip(listed) {
            all.slots[i as usize] = slot;
        }
        all.own = concat(&parts, |part| &part.own);
        all.h = concat(&parts, |part| &part.h);
        all.starts = concat(&parts, |part| &part.starts);
        all.starts.push(weights);
        all.weights = concat(&parts, |part| &part.weights);
        all.neighbours = concat(&parts, |part| &part.neighbours);
        all.large_starts = concat(&parts, |part| &part.large_starts);
        all.large_starts.push(corners);
        all.corners = concat(&parts, |part| &part.corners);
        all
    }

    /// The weights of listed row `i`.
    pub(super) fn entries(&self, i: usize) -> std::ops::Range<usize> {
        let slot = self.slots[i] as usize;
        self.starts[slot] as usize..self.starts[slot + 1] as usize
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

    /// h of listed row `i`.
    fn weight(&self, i: usize) -> f64 {
        self.h[self.slots[i] as usize]
    }

    /// a_ii of listed row `i`.
    pub(super) fn diagonal(&self, i: usize, large: &LargeFaces) -> f64 {
        let slot = self.slots[i] as usize;
        let faces: f64 = self
            .large_at(i)
            .iter()
            .map(|&(f, _)| large.constant[f as usize] + large.cosine[f as usize])
            .sum();
        self.own[slot] + self.h[slot] * faces
    }
}
