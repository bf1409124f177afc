//! Labsik & Greiner's interpolatory √3 scheme (2000) on triangle meshes: a new vertex in every triangle, old
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
//!
//! Along sharp edges every second step interpolates by cubics, (−5, 60, 30, −4)/81; beyond the ends of curves the polygon goes
//! on by the mirrored point. What the mask of a triangle needs beyond a sharp edge xy of a triangle xyz is mirrored
//! too: x + y − z, then 2x − z and 2y − z. Sharp vertices count as regular.

use std::f64::consts::PI;

use glam::DVec3;

use super::interpolatory::{RegularMask, SQRT_3, tangents, vertices};
use super::refined;
use super::refinement::{Class, Refinement, RefinementRules, Size};
use super::ring::{Place, RingRule, Rings};
use super::sharp::mirrored;
use super::sqrt3::{flip, refined_topology};
use super::star::{Tangents, across, next_in_triangle, prev_in_triangle, require_room};
use super::thirds;
use crate::Result;
use crate::mesh::{Mesh, Surface};
use crate::pages::large;
use crate::parallel;

/// On the command line and in messages.
const NAME: &str = "labsik-greiner";

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
/// use limitlab::schemes::labsik_greiner::extraordinary_mask;
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

/// All that defines the refinement.
pub(super) const RULES: RefinementRules = RefinementRules {
    name: NAME,
    class: Class::Interpolatory,
    needs_triangles: true,
    check: |surface| thirds::require(surface, NAME),
    refine,
    refined_topology,
    refined_features: |surface, refined, topology| {
        refined::features_of_pieces(surface, refined, topology, thirds::pieces)
    },
    size: Size::in_three,
    limit_positions: |surface| vertices(NAME, surface),
    limit_normals,
};

/// One step.
///
/// A triangle of three regular vertices takes the 12-point mask, one with extraordinary vertices the mean of those
/// vertices' masks. Vertices and faces are numbered as by [`sqrt3::refine`](super::sqrt3::refine).
///
/// # Errors
/// As [`sqrt3::refine`](super::sqrt3::refine).
pub fn refine(surface: &Surface) -> Result<Mesh> {
    let mesh = surface.mesh();
    thirds::require(surface, NAME)?;
    require_room(mesh, 3)?;
    if surface.features().is_none() {
        let positions = refined::points_in_faces(surface, &|surface| smooth_points(surface, &rings(surface)));
        return Ok(Mesh::new(positions, flip(surface)));
    }
    let rings = rings(surface);
    let mut positions = smooth_points(surface, &rings);
    for f in beside_sharp_edges(surface) {
        positions[mesh.len() + f] = center(surface, &rings, f, |side| beyond(surface, side));
    }
    thirds::set_thirds(&mut positions, surface, |_, _| 1.0);
    Ok(Mesh::new(positions, flip(surface)))
}

fn rings(surface: &Surface) -> Rings<'_> {
    Rings::new(surface, RingRule { place: Place::Triangle, mask: extraordinary_mask, amplitudes })
}

/// The points of vertices and faces, those beside sharp edges as if these were not there.
fn smooth_points(surface: &Surface, rings: &Rings) -> Vec<DVec3> {
    let mesh = surface.mesh();
    let mut positions = large(Vec::with_capacity(mesh.len() + mesh.faces.len() + surface.boundary_edges()));
    parallel::append(&mut positions, &mesh.positions);
    parallel::extend(&mut positions, mesh.faces.len(), |_| |f| center(surface, rings, f, |_| None));
    positions
}

/// The new point of a triangle; `beyond(side)` is what is put across a side, if anything.
fn center(surface: &Surface, rings: &Rings, f: usize, beyond: impl Fn(u32) -> Option<DVec3>) -> DVec3 {
    let own = [0, 1, 2].map(|i| 3 * f as u32 + i);
    let extraordinary = own.map(|c| rings.is_extraordinary(c));
    let sharing = extraordinary.map(usize::from).iter().sum::<usize>();
    if sharing == 0 {
        return regular(surface, own, beyond);
    }
    let mut sum = DVec3::ZERO;
    for (c, extraordinary) in own.into_iter().zip(extraordinary) {
        if extraordinary {
            sum += rings.point(c);
        }
    }
    sum / sharing as f64
}

/// What is put across a side: beyond a sharp edge the mirrored vertex. Between two steps, when a triangle at a sharp edge
/// stands for two that reach beyond it, that is across its two other sides.
fn beyond(surface: &Surface, side: u32) -> Option<DVec3> {
    let (features, topology) = (surface.features()?, surface.topology());
    let is_sharp = |&c: &u32| features.is_sharp(topology, c);
    let found = match topology.twin(side) {
        _ if is_sharp(&side) => Some(side),
        Some(t) if features.is_midway() => {
            [next_in_triangle(t) as u32, prev_in_triangle(t) as u32].into_iter().find(is_sharp)
        }
        _ => None,
    };
    found.map(|c| mirrored(surface, c))
}

/// The triangles whose mask may reach beyond a sharp edge: those at one, their neighbours, and theirs.
fn beside_sharp_edges(surface: &Surface) -> Vec<usize> {
    let Some(features) = surface.features() else { return Vec::new() };
    let topology = surface.topology();
    let mut found: Vec<usize> = features.sharp_sides(topology).map(|c| c as usize / 3).collect();
    for _ in 0..2 {
        let sides = found.iter().flat_map(|&f| [0, 1, 2].map(|i| 3 * f as u32 + i));
        let neighbors: Vec<usize> = sides.filter_map(|c| topology.twin(c)).map(|t| t as usize / 3).collect();
        found.extend(neighbors);
        found.sort_unstable();
        found.dedup();
    }
    found
}

/// The regular mask at the triangle with these corners.
fn regular(surface: &Surface, own: [u32; 3], beyond: impl Fn(u32) -> Option<DVec3>) -> DVec3 {
    let (mesh, topology) = (surface.mesh(), surface.topology());
    let [corner, tip_weight, wing] = REGULAR;
    let at = |c: usize| mesh.positions[mesh.faces.corners()[c] as usize];
    let opposite = |c: u32| prev_in_triangle(across(topology, c));
    let mut near = DVec3::ZERO;
    let mut tips = DVec3::ZERO;
    let mut wings = DVec3::ZERO;
    for side in own {
        near += at(side as usize);
        if let Some(tip) = beyond(side) {
            // The wings there are mirrored at its sides, and their sum is twice the tip.
            tips += tip;
            wings += 2.0 * tip;
            continue;
        }
        let tip = opposite(side);
        tips += at(tip);
        // The two other sides of the triangle across: the one that ends at the tip and the one that leaves it.
        for side in [prev_in_triangle(tip as u32) as u32, tip as u32] {
            wings += beyond(side).unwrap_or_else(|| at(opposite(side)));
        }
    }
    corner * near + tip_weight * tips + wing * wings
}

/// The tangents of the limit surface at all smooth vertices, found in the mesh refined twice, which is what they cost. Sharp
/// vertices have none.
///
/// # Errors
/// As [`refine`].
pub fn limit_tangents(surface: &Surface) -> Result<Vec<Tangents>> {
    if let Some(found) = thirds::of_next(surface, |s| Refinement::LabsikGreiner.refined(s), limit_tangents)? {
        return Ok(found);
    }
    let twice = Refinement::LabsikGreiner.refined_n(surface, 2)?;
    Ok(tangents(&twice, surface.len(), &TANGENTS))
}

/// The unit normals of the limit surface at all vertices; zero where [`Tangents::normal`] is.
///
/// # Errors
/// As [`limit_tangents`].
pub fn limit_normals(surface: &Surface) -> Result<Vec<DVec3>> {
    let tangents = limit_tangents(surface)?;
    Ok(tangents.iter().map(Tangents::normal).collect())
}
