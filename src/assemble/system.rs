//! Explicit assembly: any [`Masks`] over any mesh into H, M and A.

use std::sync::Arc;

use glam::DVec3;

use super::bounds::SpectralBounds;
use super::csr::{Csr, Pattern};
use super::gather::{FaceBlocks, Gather};
use crate::error::{Error, Result};
use crate::mesh::{Incidence, Surface};
use crate::parallel;
use crate::schemes::{Masks, Scheme};

/// The limit system `A V = P` of one mesh: `A = H·M` explicitly, with both factors.
///
/// V and P are N×3. `M V = H⁻¹P` is the same system with a symmetric matrix; for Zheng-Cai it is their Eq. 6,
/// entry by entry (right-hand side `2m·I`). A system of other origin is made [from its parts](Self::from_parts).
#[derive(Clone, Debug)]
pub struct LimitSystem {
    /// The diagonal of H, positive.
    pub h: Vec<f64>,
    /// M, symmetric to the last bit.
    pub m: Csr,
    /// A = H·M; every row sums to 1 if it is that of a scheme.
    pub a: Csr,
    /// diag A.
    pub diagonal: Vec<f64>,
    /// What is proven about the spectrum of A: by valences and face sizes, or by the entries.
    pub bounds: SpectralBounds,
}

impl LimitSystem {
    /// Assembles the system of `scheme` on a mesh.
    ///
    /// Linear in the corners (and in Σ|F|² where faces couple all their corners); no hashing; deterministic
    /// for any number of threads.
    ///
    /// # Errors
    /// A face that is no triangle under Loop or √3; a boundary that is treated as interior, under a scheme whose masks need
    /// whole faces; other boundaries and creases, on which A has [`Stages`](super::Stages); more than 2³² − 1 entries.
    ///
    /// ```
    /// use limitlab::assemble::LimitSystem;
    /// use limitlab::schemes::Scheme;
    /// use limitlab::mesh::{Surface, builtin};
    ///
    /// let surface = Surface::new(builtin::builtin("tetrahedron")?)?;
    /// let system = LimitSystem::new(&surface, Scheme::Loop)?;
    /// // β₃ = 2/5, and the three neighbours share the rest.
    /// assert!((system.a.get(0, 0) - 0.4).abs() < 1e-15);
    /// assert!((system.a.get(0, 1) - 0.2).abs() < 1e-15);
    /// # Ok::<(), limitlab::Error>(())
    /// ```
    pub fn new(surface: &Surface, scheme: Scheme) -> Result<Self> {
        check(surface, scheme)?;
        require_one_block(surface)?;
        let mut system = Self::with_masks(surface, &scheme)?;
        if surface.is_closed() {
            let triangles = surface.faces().uniform_size() == Some(3);
            system.bounds = SpectralBounds::closed(scheme, &valences(surface), triangles, &system.diagonal);
        }
        Ok(system)
    }

    /// As [`new`](Self::new), for any masks. M is symmetric if the face weights are. The bounds are
    /// Gershgorin's.
    ///
    /// # Errors
    /// More than 2³² − 1 entries.
    pub fn with_masks(surface: &Surface, masks: &impl Masks) -> Result<Self> {
        let Assembled { h, m, a, diagonal } = rows_of(surface, masks, None)?;
        let bounds = SpectralBounds::gershgorin(&diagonal);
        Ok(LimitSystem { h, m, a, diagonal, bounds })
    }

    /// The number of vertices N.
    pub fn len(&self) -> usize {
        self.h.len()
    }

    /// Whether there are no vertices.
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

/// H, M and A.
pub(super) struct Assembled {
    pub(super) h: Vec<f64>,
    pub(super) m: Csr,
    pub(super) a: Csr,
    pub(super) diagonal: Vec<f64>,
}

/// All rows; those of vertices that are not marked `free` are rows of I, so that M is symmetric on the others only.
pub(super) fn rows_of(surface: &Surface, masks: &impl Masks, free: Option<&[bool]>) -> Result<Assembled> {
    let mut valence = valences(surface);
    if let Some(free) = free {
        parallel::change(&mut valence, |v, n| *n = if free[v] { *n } else { 0 });
    }
    let largest = valence.iter().copied().max().unwrap_or(0) as usize;
    let weights = |n: usize| if n == 0 { [1.0, 1.0] } else { [masks.h(n), masks.vertex_weight(n)] };
    let by_valence: Vec<[f64; 2]> = (0..=largest).map(weights).collect();
    let blocks = FaceBlocks::new(surface.faces(), masks);
    let near = surface.renumbered().map(|inside| inside.numbering.there(&valence));
    let rows = Gather::new(surface, &blocks, &by_valence, near.as_deref().unwrap_or(&valence));
    let arrays = rows.arrays()?;
    let h = parallel::collect(valence.len(), |v| by_valence[valence[v] as usize][0]);
    let pattern = Arc::new(Pattern::new(arrays.offsets, arrays.columns));
    Ok(Assembled {
        h,
        m: Csr::new(Arc::clone(&pattern), arrays.m),
        a: Csr::new(pattern, arrays.a),
        diagonal: arrays.diagonal,
    })
}

/// Refuses a mesh on which A is not H·M.
pub(super) fn require_one_block(surface: &Surface) -> Result<()> {
    match surface.features() {
        Some(_) => Err(Error::Creased { what: "A = H·M with a symmetric M" }),
        None => Ok(()),
    }
}

/// Refuses faces and boundaries that `scheme` is not defined on.
pub(super) fn check(surface: &Surface, scheme: Scheme) -> Result<()> {
    let faces = surface.faces();
    if let Some(face) = scheme.first_unsuitable_face(faces) {
        return Err(Error::NotTriangles { face, corners: faces.face(face).len(), scheme: scheme.name() });
    }
    if !surface.is_closed() && surface.features().is_none() && !scheme.edges_only() {
        return Err(Error::Open { edges: surface.boundary_edges(), scheme: scheme.name() });
    }
    Ok(())
}

/// The number of edges at every smooth vertex: the valence n of the masks, on a boundary that is treated as interior too.
pub fn valences(surface: &Surface) -> Vec<u32> {
    let by_faces = |incidence: &Incidence| parallel::collect(incidence.vertices(), |v| incidence.face_count(v) as u32);
    match surface.renumbered() {
        _ if !surface.is_closed() && surface.features().is_none() => {
            parallel::collect(surface.len(), |v| surface.topology().edge_valence(surface.faces(), v) as u32)
        }
        Some(inside) => inside.numbering.back(&by_faces(&inside.incidence)),
        None => by_faces(surface.incidence()),
    }
}
