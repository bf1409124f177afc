//! The one assembler: any [`Masks`] over any mesh into H, M and A.

use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;

use super::bounds::SpectralBounds;
use super::csr::{Csr, Pattern};
use super::scheme::{Masks, Scheme};
use crate::error::{Error, Result};
use crate::mesh::topology::{next_in, prev_in};
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
        let n = mesh.len();
        let valence = valences(&mesh.faces, topology);
        let blocks = FaceBlocks::new(&mesh.faces, masks);
        let h: Vec<f64> = valence.par_iter().map(|&n| masks.h(n as usize)).collect();
        let chunks: Vec<Rows> = (0..n.div_ceil(CHUNK))
            .into_par_iter()
            .map(|k| {
                let rows = k * CHUNK..((k + 1) * CHUNK).min(n);
                assemble_rows(rows, &mesh.faces, topology, &blocks, |v| {
                    masks.vertex_weight(valence[v] as usize)
                })
            })
            .collect();
        let m = concatenate(n, &chunks)?;
        drop(chunks);
        let a = m.scale_rows(&h);
        let diagonal = a.diagonal();
        let bounds = SpectralBounds::gershgorin(&diagonal);
        Ok(LimitSystem {
            h,
            m,
            a,
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
        for face in faces.iter() {
            let size = face.len();
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
        }
        FaceBlocks {
            by_size,
            half_edge,
            sides_only: masks.edges_only(),
        }
    }
}

/// Some consecutive rows of M.
struct Rows {
    lengths: Vec<u32>,
    columns: Vec<u32>,
    values: Vec<f64>,
}

fn assemble_rows(
    rows: std::ops::Range<usize>,
    faces: &Faces,
    topology: &Topology,
    blocks: &FaceBlocks,
    vertex_weight: impl Fn(usize) -> f64,
) -> Rows {
    let corners = faces.corners();
    let mut out = Rows {
        lengths: Vec::with_capacity(rows.len()),
        columns: Vec::with_capacity(rows.len() * 9),
        values: Vec::with_capacity(rows.len() * 9),
    };
    let has_boundary = topology.boundary_edges() > 0;
    let mut entries: Vec<(u32, f64)> = Vec::new();
    for v in rows {
        entries.clear();
        let mut own = vertex_weight(v);
        for &c in topology.incidence.corners_at(v) {
            let range = faces.range(topology.incidence.face_of(c));
            let block = &blocks.by_size[range.len()];
            own += block[0];
            let (next, prev) = (next_in(&range, c), prev_in(&range, c));
            if blocks.sides_only {
                entries.push((corners[next as usize], block[1]));
                entries.push((corners[prev as usize], block[range.len() - 1]));
            } else {
                let place = c as usize - range.start;
                let face = &corners[range];
                entries.extend(
                    face[place + 1..]
                        .iter()
                        .copied()
                        .zip(block[1..].iter().copied()),
                );
                entries.extend(
                    face[..place]
                        .iter()
                        .copied()
                        .zip(block[block.len() - place..].iter().copied()),
                );
            }
            if has_boundary {
                // A side without a face across it brings the edge's other half itself.
                for (side, end) in [(c, next), (prev, prev)] {
                    if topology.twin(side).is_none() {
                        entries.push((corners[end as usize], blocks.half_edge));
                    }
                }
            }
        }
        entries.push((v as u32, own));
        // Stable: the contributions to one entry stay in ascending order of faces.
        entries.sort_by_key(|e| e.0);
        let before = out.columns.len();
        for same in entries.chunk_by(|a, b| a.0 == b.0) {
            out.columns.push(same[0].0);
            out.values.push(same.iter().map(|e| e.1).sum());
        }
        out.lengths.push((out.columns.len() - before) as u32);
    }
    out
}

fn concatenate(n: usize, chunks: &[Rows]) -> Result<Csr> {
    let total: usize = chunks.iter().map(|c| c.columns.len()).sum();
    if u32::try_from(total).is_err() {
        return Err(Error::Computation(format!(
            "the matrix would have {total} entries, more than 32-bit indices reach; use a smaller mesh or one \
             without very large faces"
        )));
    }
    let mut offsets = Vec::with_capacity(n + 1);
    offsets.push(0u32);
    let mut end = 0u32;
    for length in chunks.iter().flat_map(|c| &c.lengths) {
        end += length;
        offsets.push(end);
    }
    let columns: Vec<&[u32]> = chunks.iter().map(|c| c.columns.as_slice()).collect();
    let values: Vec<&[f64]> = chunks.iter().map(|c| c.values.as_slice()).collect();
    let (columns, values) = rayon::join(|| columns.concat(), || values.concat());
    Ok(Csr::new(Arc::new(Pattern::new(offsets, columns)), values))
}
