//! The one assembler: any [`Masks`] over any mesh into H, M and A.

use std::ops::Range;
use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;

use super::bounds::SpectralBounds;
use super::csr::{Csr, Pattern};
use super::scheme::{Masks, Scheme};
use crate::error::{Error, Result};
use crate::mesh::topology::{next_in, prev_in, split_rows};
use crate::mesh::{Faces, Mesh, Topology};

/// Rows handed to one task: large enough to pay for it, small enough to share out evenly.
const CHUNK: usize = 8192;

/// The limit system `A V = P` of one mesh: `A = H·M` explicitly, with both factors.
///
/// V and P are N×3. `M V = H⁻¹P` is the same system with a symmetric matrix; for Zheng-Cai it is their Eq. 6,
/// entry by entry (right-hand side `2m·I`).
#[derive(Clone, Debug)]
pub struct LimitSystem {
    /// The diagonal of H, positive.
    pub h: Vec<f64>,
    /// M, symmetric to the last bit.
    pub m: Csr,
    /// A = H·M; every row sums to 1.
    pub a: Csr,
    /// diag A.
    pub diagonal: Vec<f64>,
    /// What valences and face sizes prove about the spectrum of A.
    pub bounds: SpectralBounds,
}

impl LimitSystem {
    /// Assembles the system of `scheme` on a mesh that the validator has passed.
    ///
    /// Linear in the corners (and in Σ|F|² where faces couple all their corners); no hashing; deterministic
    /// for any number of threads.
    ///
    /// # Errors
    /// A face that is no triangle under Loop or √3; a boundary under a scheme whose masks need whole faces;
    /// more than 2³² − 1 entries.
    ///
    /// ```
    /// use limitlab::assemble::{LimitSystem, Scheme};
    /// use limitlab::mesh::{builtin, Topology};
    ///
    /// let mesh = builtin::builtin("tetrahedron")?;
    /// let topology = Topology::new(&mesh.faces, mesh.len());
    /// let system = LimitSystem::new(&mesh, &topology, Scheme::Loop)?;
    /// // β₃ = 2/5, and the three neighbours share the rest.
    /// assert!((system.a.get(0, 0) - 0.4).abs() < 1e-15);
    /// assert!((system.a.get(0, 1) - 0.2).abs() < 1e-15);
    /// # Ok::<(), limitlab::Error>(())
    /// ```
    pub fn new(mesh: &Mesh, topology: &Topology, scheme: Scheme) -> Result<Self> {
        check_faces(&mesh.faces, scheme)?;
        check_boundary(topology, scheme)?;
        let mut system = Self::with_masks(mesh, topology, &scheme)?;
        if topology.is_closed() {
            system.bounds = SpectralBounds::closed(
                scheme,
                &valences(&mesh.faces, topology),
                mesh.faces.uniform_size() == Some(3),
                &system.diagonal,
            );
        }
        Ok(system)
    }

    /// As [`new`](Self::new), for any masks. M is symmetric if the face weights are. The bounds are
    /// Gershgorin's.
    ///
    /// # Errors
    /// More than 2³² − 1 entries.
    pub fn with_masks(mesh: &Mesh, topology: &Topology, masks: &impl Masks) -> Result<Self> {
        let valence = valences(&mesh.faces, topology);
        let largest = valence.par_iter().copied().max().unwrap_or(0) as usize;
        let by_valence: Vec<[f64; 2]> = (0..=largest)
            .map(|n| [masks.h(n), masks.vertex_weight(n)])
            .collect();
        let rows = Rows {
            faces: &mesh.faces,
            topology,
            blocks: FaceBlocks::new(&mesh.faces, masks),
            by_valence: &by_valence,
            valence: &valence,
        };
        let arrays = match rows.fill(rows.greatest_lengths())? {
            Ok(arrays) => arrays,
            // Not a manifold.
            Err(lengths) => match rows.fill(lengths)? {
                Ok(arrays) => arrays,
                Err(_) => unreachable!("the lengths found are those of the rows"),
            },
        };
        let h = valence.par_iter().map(|&n| by_valence[n as usize][0]);
        let bounds = SpectralBounds::gershgorin(&arrays.diagonal);
        let pattern = Arc::new(Pattern::new(arrays.offsets, arrays.columns));
        Ok(LimitSystem {
            h: h.collect(),
            m: Csr::new(Arc::clone(&pattern), arrays.m),
            a: Csr::new(pattern, arrays.a),
            diagonal: arrays.diagonal,
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

    /// The right-hand side `H⁻¹P` of `M V = H⁻¹P`; for Zheng-Cai the `2m·I` of their Eq. 6.
    ///
    /// # Panics
    /// If there is not one point a vertex.
    pub fn symmetric_right_hand_side(&self, points: &[DVec3]) -> Vec<DVec3> {
        assert_eq!(points.len(), self.len(), "one point a vertex");
        points.iter().zip(&self.h).map(|(&p, &h)| p / h).collect()
    }
}

/// Refuses faces that `scheme` is not defined on.
pub(super) fn check_faces(faces: &Faces, scheme: Scheme) -> Result<()> {
    if let Some(f) = scheme.first_unsuitable_face(faces) {
        return Err(Error::Computation(format!(
            "face {f} has {} corners, and the scheme {scheme} is defined on triangles only; triangulate the \
             mesh or use --scheme catmull-clark, nasri or zheng-cai",
            faces.face(f).len()
        )));
    }
    Ok(())
}

/// Refuses boundaries that `scheme` is not defined on.
pub(super) fn check_boundary(topology: &Topology, scheme: Scheme) -> Result<()> {
    if topology.boundary_edges() > 0 && !scheme.edges_only() {
        return Err(Error::Computation(format!(
            "{} boundary edges, and the masks of {scheme} need whole faces around every vertex; close the \
             holes, or use --boundary as-interior with --scheme loop or sqrt3 on triangles",
            topology.boundary_edges()
        )));
    }
    Ok(())
}

/// The number of edges at every vertex: the valence n of the masks, on a boundary too.
pub fn valences(faces: &Faces, topology: &Topology) -> Vec<u32> {
    (0..topology.incidence.vertices())
        .into_par_iter()
        .with_min_len(CHUNK)
        .map(|v| {
            if topology.boundary_edges() == 0 {
                topology.incidence.face_count(v) as u32
            } else {
                topology.edge_valence(faces, v) as u32
            }
        })
        .collect()
}

/// For every face size that occurs, what a face adds between a corner and the one k steps further: its
/// circulant, and half of the edge weight at its sides (the other half comes from the face across). Adding
/// the halves face by face, in ascending order of faces, makes M symmetric to the last bit.
pub(super) struct FaceBlocks {
    pub(super) by_size: Vec<Vec<f64>>,
    half_edge: f64,
    /// Only the corner itself and its two neighbours matter.
    sides_only: bool,
}

impl FaceBlocks {
    pub(super) fn new(faces: &Faces, masks: &impl Masks) -> Self {
        let half_edge = 0.5 * masks.edge_weight();
        let mut by_size: Vec<Vec<f64>> = Vec::new();
        let mut add = |size: usize| {
            if by_size.len() <= size {
                by_size.resize(size + 1, Vec::new());
            }
            if by_size[size].is_empty() {
                by_size[size] = (0..size)
                    .map(|k| {
                        let side = k == 1 || k + 1 == size;
                        masks.face_weight(size, k) + if side { half_edge } else { 0.0 }
                    })
                    .collect();
            }
        };
        match faces.uniform_size() {
            Some(size) => add(size),
            None => faces.iter().for_each(|face| add(face.len())),
        }
        FaceBlocks {
            by_size,
            half_edge,
            sides_only: masks.edges_only(),
        }
    }
}

/// What the rows are made from.
struct Rows<'a> {
    faces: &'a Faces,
    topology: &'a Topology,
    blocks: FaceBlocks,
    /// The entry of H and the vertex weight.
    by_valence: &'a [[f64; 2]],
    valence: &'a [u32],
}

/// All rows of M and A.
struct Arrays {
    offsets: Vec<u32>,
    columns: Vec<u32>,
    m: Vec<f64>,
    a: Vec<f64>,
    diagonal: Vec<f64>,
}

/// One row while it is made.
#[derive(Default)]
struct Row {
    /// Column in the upper half; in the lower the place of the contribution, which keeps the contributions to one
    /// entry in the order of faces.
    keys: Vec<u64>,
    contributions: Vec<f64>,
    columns: Vec<u32>,
    values: Vec<f64>,
    /// The place of the diagonal entry.
    own: usize,
}

impl Row {
    #[inline]
    fn add(&mut self, column: u32, value: f64) {
        let key = u64::from(column) << 32 | self.contributions.len() as u64;
        self.keys.push(key);
        self.contributions.push(value);
    }

    /// Sums the contributions to each entry.
    fn sum(&mut self, row: usize) {
        self.keys.sort_unstable();
        self.columns.clear();
        self.values.clear();
        let mut last = None;
        for &key in &self.keys {
            let column = (key >> 32) as u32;
            let value = self.contributions[key as u32 as usize];
            if last == Some(column) {
                if let Some(sum) = self.values.last_mut() {
                    *sum += value;
                }
                continue;
            }
            if column as usize == row {
                self.own = self.columns.len();
            }
            self.columns.push(column);
            self.values.push(value);
            last = Some(column);
        }
    }
}

/// Moves rows that are shorter than their place together by `shift(from, to)`, in ascending order, and returns the
/// new end.
fn close_gaps(
    offsets: &mut [u32],
    lengths: &[u32],
    mut shift: impl FnMut(Range<usize>, usize),
) -> usize {
    let mut end = 0;
    for (offset, &length) in offsets.iter_mut().zip(lengths) {
        let start = *offset as usize;
        if start != end {
            shift(start..start + length as usize, end);
        }
        *offset = end as u32;
        end += length as usize;
    }
    offsets[lengths.len()] = end as u32;
    end
}

impl Rows<'_> {
    /// The greatest length of every row on a manifold, attained where faces share an edge or a vertex at most.
    fn greatest_lengths(&self) -> Vec<u32> {
        let incidence = &self.topology.incidence;
        let length = |v: usize| {
            let edges = self.valence[v];
            if self.blocks.sides_only {
                return edges + 1;
            }
            let at = incidence.corners_at(v);
            let others = at.iter().map(|&c| {
                let size = self.faces.range(incidence.face_of(c)).len() as u32;
                size.saturating_sub(3)
            });
            edges + 1 + others.sum::<u32>()
        };
        (0..self.valence.len())
            .into_par_iter()
            .with_min_len(CHUNK)
            .map(length)
            .collect()
    }

    /// All rows, if their lengths are at most these; otherwise their true lengths.
    fn fill(&self, lengths: Vec<u32>) -> Result<std::result::Result<Arrays, Vec<u32>>> {
        let total: u64 = lengths.par_iter().map(|&l| u64::from(l)).sum();
        if u32::try_from(total).is_err() {
            return Err(Error::Computation(format!(
                "the matrix would have {total} entries, more than 32-bit indices reach; use a smaller mesh or one \
                 without very large faces"
            )));
        }
        let mut offsets = Vec::with_capacity(lengths.len() + 1);
        offsets.push(0u32);
        let mut end = 0u32;
        for length in &lengths {
            end += length;
            offsets.push(end);
        }
        let mut columns = vec![0u32; end as usize];
        let mut m = vec![0.0; end as usize];
        let mut a = vec![0.0; end as usize];
        let mut diagonal = vec![0.0; lengths.len()];
        let mut lengths = lengths;
        let parts = split_rows(&offsets, CHUNK, &mut columns)
            .into_par_iter()
            .zip(split_rows(&offsets, CHUNK, &mut m))
            .zip(split_rows(&offsets, CHUNK, &mut a))
            .zip(diagonal.par_chunks_mut(CHUNK))
            .zip(lengths.par_chunks_mut(CHUNK));
        let misfits = parts.map_init(Row::default, |row, parts| {
            let (((((rows, columns), (_, m)), (_, a)), diagonal), lengths) = parts;
            let first = offsets[rows.start] as usize;
            let mut fit = true;
            for ((v, diagonal), length) in rows.zip(diagonal).zip(lengths) {
                self.row(v, row);
                let h = self.by_valence[self.valence[v] as usize][0];
                *diagonal = h * row.values[row.own];
                let start = offsets[v] as usize - first;
                let range = start..start + row.columns.len();
                if row.columns.len() <= *length as usize {
                    columns[range.clone()].copy_from_slice(&row.columns);
                    m[range.clone()].copy_from_slice(&row.values);
                    for (a, m) in a[range].iter_mut().zip(&row.values) {
                        *a = h * m;
                    }
                } else {
                    fit = false;
                }
                *length = row.columns.len() as u32;
            }
            usize::from(!fit)
        });
        let fit = misfits.sum::<usize>() == 0;
        if fit {
            let filled = close_gaps(&mut offsets, &lengths, |from, to| {
                columns.copy_within(from.clone(), to);
                m.copy_within(from.clone(), to);
                a.copy_within(from, to);
            });
            columns.truncate(filled);
            m.truncate(filled);
            a.truncate(filled);
        }
        Ok(if fit {
            Ok(Arrays {
                offsets,
                columns,
                m,
                a,
                diagonal,
            })
        } else {
            Err(lengths)
        })
    }

    /// Row `v` of M.
    fn row(&self, v: usize, row: &mut Row) {
        let (faces, topology, blocks) = (self.faces, self.topology, &self.blocks);
        let corners = faces.corners();
        let has_boundary = topology.boundary_edges() > 0;
        row.keys.clear();
        row.contributions.clear();
        let [_, mut own] = self.by_valence[self.valence[v] as usize];
        for &c in topology.incidence.corners_at(v) {
            let range = faces.range(topology.incidence.face_of(c));
            let block = &blocks.by_size[range.len()];
            own += block[0];
            let (next, prev) = (next_in(&range, c), prev_in(&range, c));
            if blocks.sides_only {
                row.add(corners[next as usize], block[1]);
                row.add(corners[prev as usize], block[range.len() - 1]);
            } else {
                let place = c as usize - range.start;
                let face = &corners[range];
                for (&w, &weight) in face[place + 1..].iter().zip(&block[1..]) {
                    row.add(w, weight);
                }
                for (&w, &weight) in face[..place].iter().zip(&block[block.len() - place..]) {
                    row.add(w, weight);
                }
            }
            if has_boundary {
                // A side without a face across it brings the edge's other half itself.
                for (side, end) in [(c, next), (prev, prev)] {
                    if topology.twin(side).is_none() {
                        row.add(corners[end as usize], blocks.half_edge);
                    }
                }
            }
        }
        row.add(v as u32, own);
        row.sum(v);
    }
}
