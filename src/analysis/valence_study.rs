//! Spectrum against valence: what one extraordinary vertex in a regular surrounding does to the spectrum, and which
//! vertices the slow modes live on.
//!
//! What it shows: the slow modes sit on vertices of *low* valence. Under Loop λ_min is 0.227 next to valence 3 and
//! 0.238 for the valences 6 to 30 tried (the modes of the valence 4 vertices that the mesh needs elsewhere); under
//! Catmull-Clark it rises with the valence of the poles and its mode peaks on the vertices of valence 3. A vertex of
//! high valence adds nothing at the slow end of these meshes.

use super::dense;
use super::singularity::{SlowMode, modes};
use super::subspace_iteration::End;
use super::symmetric::SymmetricForm;
use crate::assemble::LimitSystem;
use crate::error::Result;
use crate::mesh::generate::quad_split;
use crate::mesh::{Mesh, Surface, builtin};
use crate::schemes::Scheme;

/// The spectra of infinite regular meshes: A and D⁻¹A of valence 4 in quads or 6 in triangles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Band {
    /// The least and the greatest value of the symbol of A; the greatest is 1.
    pub a: (f64, f64),
    /// The same of D⁻¹A: those of A over its constant diagonal entry.
    pub jacobi: (f64, f64),
}

/// The regular band from the [symbols](Scheme::regular_symbol), the diagonal being constant.
pub fn regular_band(scheme: Scheme) -> Band {
    let (least, diagonal) = scheme.regular_symbol();
    Band { a: (least, 1.0), jacobi: (least / diagonal, 1.0 / diagonal) }
}

/// What one valence does.
#[derive(Clone, Debug)]
pub struct ValenceRow {
    /// The valence of the two extraordinary vertices of the [`star_mesh`].
    pub valence: usize,
    /// The number of vertices N of that mesh.
    pub vertices: usize,
    /// All eigenvalues, ascending: for histograms.
    pub a: Vec<f64>,
    /// The same of D⁻¹A.
    pub jacobi: Vec<f64>,
    /// Eigenvalues outside the regular band by more than 1e-9.
    pub separated_a: usize,
    /// The same of D⁻¹A, outside its band.
    pub separated_jacobi: usize,
    /// The mode of the least eigenvalue of A, which slows PIA.
    pub slow_pia: Located,
    /// The mode of the greatest eigenvalue of D⁻¹A, which limits ω.
    pub limiting_jacobi: Located,
    /// The mode of the least eigenvalue of D⁻¹A, which slows Jacobi.
    pub slow_jacobi: Located,
}

/// A mode, and where it lives.
#[derive(Clone, Debug)]
pub struct Located {
    /// Its eigenvalue and eigenvector.
    pub mode: SlowMode,
    /// The part of Σx² (of the error itself) at the two extraordinary vertices and the vertices of their faces.
    pub near_star: f64,
    /// The vertex of the largest entry and its valence.
    pub peak: usize,
    /// The valence of `peak`.
    pub peak_valence: usize,
}

/// A mesh with two vertices of valence `k`, numbered first k and k + 1, as far apart as its size allows: triangles
/// with valence 6 around ([`builtin::star`]), or quads with valence 4 around, on which Euler's formula puts 2k
/// vertices of valence 3 half-way between (and none else).
pub fn star_mesh(scheme: Scheme, k: usize) -> (Mesh, [usize; 2]) {
    let mesh =
        if scheme.needs_triangles() { builtin::star(k) } else { quad_split(&quad_split(&builtin::bipyramid(k))) };
    (mesh, [k, k + 1])
}

/// One row a valence. The spectra are dense: 24k + 2 vertices of quads, 16k + 2 of triangles.
///
/// # Errors
/// A valence so large that the mesh exceeds [`dense::LARGEST_FULL`].
pub fn valence_study(scheme: Scheme, valences: impl Iterator<Item = usize>) -> Result<Vec<ValenceRow>> {
    valences.map(|k| row(scheme, k)).collect()
}

fn row(scheme: Scheme, valence: usize) -> Result<ValenceRow> {
    let (mesh, poles) = star_mesh(scheme, valence);
    let surface = Surface::new(mesh)?;
    let system = LimitSystem::new(&surface, scheme)?;
    let all = dense::full_eigenvalues(&system)?;
    let band = regular_band(scheme);
    let outside = |values: &[f64], (lo, hi): (f64, f64)| {
        let tolerance = 1e-9;
        values.iter().filter(|&&x| x < lo - tolerance || x > hi + tolerance).count()
    };
    let mut near = vec![false; surface.len()];
    for pole in poles {
        for &c in surface.incidence().corners_at(pole) {
            for &w in surface.faces().face(surface.incidence().face_of(c)) {
                near[w as usize] = true;
            }
        }
    }
    let locate = |form, end| -> Result<Located> {
        let mode = modes(&system, form, end, 1)?.modes.remove(0);
        let total: f64 = mode.values.iter().map(|x| x * x).sum();
        let inside: f64 = mode.values.iter().zip(&near).filter(|(_, near)| **near).map(|(x, _)| x * x).sum();
        let peak =
            (0..surface.len()).fold(0, |best, i| if mode.values[i].abs() > mode.values[best].abs() { i } else { best });
        Ok(Located { near_star: inside / total, peak, peak_valence: surface.incidence().face_count(peak), mode })
    };
    Ok(ValenceRow {
        valence,
        vertices: surface.len(),
        separated_a: outside(&all.a, band.a),
        separated_jacobi: outside(&all.jacobi, band.jacobi),
        slow_pia: locate(SymmetricForm::A, End::Lowest)?,
        limiting_jacobi: locate(SymmetricForm::Jacobi, End::Highest)?,
        slow_jacobi: locate(SymmetricForm::Jacobi, End::Lowest)?,
        a: all.a,
        jacobi: all.jacobi,
    })
}
