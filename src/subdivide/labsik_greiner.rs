//! Labsik & Greiner's interpolatory √3 scheme (2000) on closed triangle meshes: a new vertex in every triangle, old
//! edges flipped, old vertices left where they are, so limit points are the vertices themselves.
//!
//! The 12-point mask of a triangle of three regular vertices (valence 6) is the only symmetric one on these points
//! that reproduces cubics. At an extraordinary vertex the new points of its triangles are blends of the vertex and
//! its ring. Such a rule is a circulant, so its Fourier coefficients are its eigenvalues. Ask that it reproduces
//! constants, has the eigenvalues 1, μ, μ, μ², μ², μ² of a quadratic reparametrised by a similarity, and no others,
//! and μ = ⅔cos(π/n), by which the centroids of a regular n-gon's triangles lie nearer than its corners (1/√3 at
//! valence 6, as the scale of the scheme wants it). This determines the mask ([`extraordinary_mask`]).
//! OpenMesh's subdivider of that name, which cites the paper, has the same numbers at every valence; the paper
//! itself was not at hand.

use std::f64::consts::PI;

use glam::DVec3;

use super::interpolatory::{RegularMask, SQRT_3, tangents};
use super::sqrt3::{flip, refined_topology};
use super::star::{
    Circle, Harmonics, Tangents, next_in_triangle, prev_in_triangle, refuse, require_room,
    require_triangles, twin,
};
use crate::Result;
use crate::mesh::{Mesh, Topology};

/// The regular mask: the corners of the triangle, the vertices opposite to its sides, the six next to those.
pub const REGULAR: [f64; 3] = [32.0 / 81.0, -1.0 / 81.0, -2.0 / 81.0];

/// The tangents at a regular vertex, in units of 1/695 700 of a lattice step's inverse.
const TANGENTS: RegularMask = RegularMask {
    weights: &[
        (1, 0, [166_842.0, 0.0]),
        (2, 0, [-11_349.0, 0.0]),
        // 10 128 √3 at 30°.
        (1, 1, [-15_192.0, -5_064.0 * SQRT_3]),
        (3, 0, [-38.0, 0.0]),
        (2, 1, [382.5, 130.5 * SQRT_3]),
        (1, 2, [387.0, 126.0 * SQRT_3]),
    ],
};

/// μ = ⅔cos(π/n): the subdominant eigenvalue of one step (of which each turns by π/n) at valence `n`.
pub fn subdominant(n: usize) -> f64 {
    2.0 / 3.0 * (PI / n as f64).cos()
}

/// The amplitudes of the harmonics 0, 1, 2 of the mask, times n. At n = 3 the second harmonic is the mirror image of
/// the first, and the quadratics are one fewer; at n = 4 it vanishes in the middle of the triangles.
fn amplitudes(n: usize) -> [f64; 3] {
    let mu = subdominant(n);
    let second = if n == 3 { 0.0 } else { 2.0 * mu * mu };
    [mu * mu, 2.0 * mu, second]
}

/// The mask of the new point between neighbours 0 and 1 of a vertex of valence `n` ≠ 6: the weight of the vertex,
/// 1 − μ², and those of the neighbours in circular order,
/// w_j = (μ² + 2μ cos((2j−1)π/n) + 2μ² cos(2(2j−1)π/n))/n, at n = 3 without the last term.
///
/// # Panics
/// If `n` < 3, where the scheme has no rule.
///
/// ```
/// use limitlab::subdivide::labsik_greiner::extraordinary_mask;
/// let (center, ring) = extraordinary_mask(4);
/// let expected = [2.0 / 9.0, 2.0 / 9.0, -1.0 / 9.0, -1.0 / 9.0];
/// assert!((center - 7.0 / 9.0).abs() < 1e-15);
/// assert!(ring.iter().zip(expected).all(|(w, e)| (w - e).abs() < 1e-15));
/// ```
pub fn extraordinary_mask(n: usize) -> (f64, Vec<f64>) {
    assert!(n >= 3, "valence at least 3");
    let [a0, a1, a2] = amplitudes(n);
    let weight = |j: usize| {
        let angle = (2.0 * j as f64 - 1.0) * PI / n as f64;
        (a0 + a1 * angle.cos() + a2 * (2.0 * angle).cos()) / n as f64
    };
    (1.0 - a0, (0..n).map(weight).collect())
}

/// One step.
///
/// A triangle of three regular vertices takes the 12-point mask, one with extraordinary vertices the mean of those
/// vertices' masks. Vertices and faces are numbered as by [`sqrt3::refine`](super::sqrt3::refine).
///
/// # Errors
/// [`Error::Mesh`](crate::Error::Mesh) if the mesh is not a closed manifold, a face is no triangle (the first is
/// named), a vertex has valence < 3, or the result is too large for 32-bit indices.
///
/// # Panics
/// If `topology` is not that of `mesh`.
pub fn refine(mesh: &Mesh, topology: &Topology) -> Result<Mesh> {
    require_triangles(mesh, topology, "labsik-greiner")?;
    require_room(mesh, 3)?;
    let old = &mesh.positions;
    let corners = mesh.faces.corners();
    let is_regular = |v: u32| topology.incidence.face_count(v as usize) == 6;
    let opposite = |c: u32| twin_opposite(topology, c);

    let mut positions = Vec::with_capacity(mesh.len() + mesh.faces.len());
    positions.extend_from_slice(old);
    let [corner, across, wing] = REGULAR;
    positions.extend(mesh.faces.iter().enumerate().map(|(f, face)| {
        if !face.iter().all(|&v| is_regular(v)) {
            return DVec3::ZERO;
        }
        let mut near = DVec3::ZERO;
        let mut tips = DVec3::ZERO;
        let mut wings = DVec3::ZERO;
        for side in 3 * f as u32..3 * f as u32 + 3 {
            near += old[corners[side as usize] as usize];
            let tip = opposite(side);
            tips += old[corners[tip] as usize];
            // The two other sides of the triangle across: the one that ends at the tip and the one that leaves it.
            for beyond in [prev_in_triangle(tip as u32), tip] {
                wings += old[corners[opposite(beyond as u32)] as usize];
            }
        }
        corner * near + across * tips + wing * wings
    }));

    let new = &mut positions[mesh.len()..];
    let mut star = Vec::new();
    let mut circle = Circle::default();
    for v in (0..mesh.len() as u32).filter(|&v| !is_regular(v)) {
        topology.star(&mesh.faces, v as usize, &mut star);
        let n = star.len();
        if n < 3 {
            return refuse(format!(
                "vertex {v} has valence {n}, for which labsik-greiner has no rule: remove it"
            ));
        }
        // Even places of this circle are the neighbours, odd ones the triangles.
        let circle = circle.of(2 * n);
        let neighbor = |&c: &u32| old[corners[next_in_triangle(c)] as usize];
        let ring = Harmonics::of(star.iter().map(neighbor), circle, 2);
        let amplitudes = amplitudes(n);
        for (j, &c) in star.iter().enumerate() {
            let point =
                (1.0 - amplitudes[0]) * old[v as usize] + ring.at(circle, 2 * j + 1, amplitudes);
            let face = mesh.faces.face(c as usize / 3);
            let sharing = face.iter().filter(|&&w| !is_regular(w)).count();
            new[c as usize / 3] += point / sharing as f64;
        }
    }
    Ok(Mesh::new(positions, flip(mesh, topology)))
}

/// The tangents of the limit surface at all vertices, found in the mesh refined twice, which is what they cost.
///
/// # Errors
/// As [`refine`].
///
/// # Panics
/// If `topology` is not that of `mesh`.
pub fn limit_tangents(mesh: &Mesh, topology: &Topology) -> Result<Vec<Tangents>> {
    let once = refine(mesh, topology)?;
    let finer = refined_topology(mesh, topology, &once);
    let twice = refine(&once, &finer)?;
    let finest = refined_topology(&once, &finer, &twice);
    Ok(tangents(&twice, &finest, mesh.len(), &TANGENTS))
}

/// The unit normals of the limit surface at all vertices; zero where [`Tangents::normal`] is.
///
/// # Errors
/// As [`limit_tangents`].
///
/// # Panics
/// If `topology` is not that of `mesh`.
pub fn limit_normals(mesh: &Mesh, topology: &Topology) -> Result<Vec<DVec3>> {
    let tangents = limit_tangents(mesh, topology)?;
    Ok(tangents.iter().map(Tangents::normal).collect())
}

/// The corner opposite to half-edge `c` in the triangle across it.
fn twin_opposite(topology: &Topology, c: u32) -> usize {
    prev_in_triangle(twin(topology, c))
}
