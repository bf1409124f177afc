//! Kobbelt's interpolatory scheme (1996) on closed meshes of quads: the four-point rule (−1, 9, 9, −1)/16 (Dyn, Levin & Gregory
//! 1987) along edges, then across faces; old vertices stay.
//!
//! At an extraordinary vertex (valence n ≠ 4) no edge goes straight on. With the neighbours l_j in circular order, k_j the corner
//! opposite to the vertex between l_j and l_{j+1}, the point of the edge to l_i takes in place of the missing one
//!
//! X_i = (4/n) Σ l_j − (l_{i−1} + l_i + l_{i+1}) + c (k_{i−2} + k_{i−1} + k_i + k_{i+1}) − (4c/n) Σ k_j,  c = 1/9,
//!
//! which is l_{i+2} at valence 4. Kobbelt asks that the points of faces come out the same along both directions. On the face between
//! the edges i and i + 1 of an extraordinary vertex they differ by 9/256 of X_{i+1} − X_i + l_{i+2} − l_{i−1} − c (k_{i+2} − k_{i−2}),
//! c = 1/9 being the ratio of the rule's weights; so this determines X but for what is the same for all i, and that its mean is that
//! of l fixes the rest. The paper was not at hand; the one implementation with a rule for all valences that was found
//! (`kobbelt_subdivision.hpp` on GitHub) has this form with c = 1/5, ω/(4 + ω) beside weights of (8 + ω)/16, under which the two
//! directions disagree on those faces by up to 1/320 of the data. One face further from the vertex they disagree whatever c is, as what
//! lies straight on in one direction is missing in the other, and so where two extraordinary vertices share a face: a
//! point of a face is the mean of both.

use glam::{DVec2, DVec3};

use super::catmull_clark::split;
use super::refined;
use super::star::{Tangents, by_valence, refuse, require_room, twin};
use crate::Result;
use crate::mesh::edge_numbers::EdgeNumbers;
use crate::mesh::{Mesh, Surface};
use crate::pages::large;
use crate::parallel;

/// The rule of four points: the outer two, the inner two.
pub const FOUR_POINTS: [f64; 2] = [-0.0625, 0.5625];

/// c: minus the ratio of the rule's weights.
const CORNERS: f64 = 1.0 / 9.0;

/// Corners of the next two rings of a sector, whose weights make a tangent: (1, 0), (1, 1), (2, 0), (2, 1), (1, 2), (2, 2), the first
/// number along its first edge, the second along the next sector's.
const ORBITS: usize = 6;

/// Between four points in a row.
fn between<T: std::ops::Add<Output = T>>(points: [T; 4]) -> T
where
    f64: std::ops::Mul<T, Output = T>,
{
    let [a, b, c, d] = points;
    FOUR_POINTS[1] * (b + c) + FOUR_POINTS[0] * (a + d)
}

/// Refuses what the scheme has no rules for: faces other than quads, boundaries, sharp edges and vertices.
///
/// # Errors
/// Which of these it is, with the face.
pub fn check(surface: &Surface) -> Result<()> {
    let faces = surface.faces();
    if let Some(f) = parallel::find_first(faces.len(), |f| faces.range(f).len() != 4) {
        let corners = faces.face(f).len();
        return refuse(format!(
            "face {f} has {corners} corners: Kobbelt's scheme takes quads; a Catmull-Clark step makes them"
        ));
    }
    if !surface.is_closed() || surface.features().is_some() {
        return refuse("Kobbelt's scheme is built for closed meshes without sharp edges and vertices".into());
    }
    Ok(())
}

/// One step. Vertices and faces are numbered as by [`catmull_clark::refine`](super::catmull_clark::refine): old vertices, which
/// stay, then one for each edge, then one for each face. Time and memory proportional to the mesh.
///
/// # Errors
/// Those of [`check`]; [`Error::TooLarge`](crate::Error::TooLarge).
///
/// ```
/// use limitlab::mesh::{Surface, builtin::builtin};
/// use limitlab::schemes::kobbelt;
/// let cube = Surface::new(builtin("cube")?)?;
/// let fine = kobbelt::refine(&cube)?;
/// assert_eq!(fine.positions[..8], *cube.positions());
/// assert_eq!((fine.len(), fine.faces.len()), (8 + 12 + 6, 24));
/// # Ok::<(), limitlab::Error>(())
/// ```
pub fn refine(surface: &Surface) -> Result<Mesh> {
    check(surface)?;
    step(surface)
}

/// The step on any closed mesh: about faces that are no quads it has no meaning.
pub(crate) fn step(surface: &Surface) -> Result<Mesh> {
    let (mesh, topology) = (surface.mesh(), surface.topology());
    require_room(mesh, 4)?;
    let edges = topology.edge_numbers();
    let old = mesh.len();
    let mut positions = large(Vec::with_capacity(old + topology.edges() + mesh.faces.len()));
    parallel::append(&mut positions, &mesh.positions);
    let means = Walk { surface }.means();
    edges.extend(&mut positions, |c| {
        let walk = Walk { surface };
        let t = twin(topology, c);
        between([walk.beyond(c, &means), walk.origin(c), walk.origin(t), walk.beyond(t, &means)])
    });
    let of_edges = positions[old..].to_vec();
    parallel::extend(&mut positions, mesh.faces.len(), |_| {
        |f| of_face(surface, &edges, &of_edges, mesh.faces.range(f).start as u32)
    });
    Ok(Mesh::new(positions, split(surface, &edges)))
}

/// One step, with its topology.
///
/// # Errors
/// As [`refine`].
pub fn refined(surface: &Surface) -> Result<Surface> {
    let mesh = refine(surface)?;
    let topology = refined::of_quads(surface, &mesh);
    Ok(Surface::of_topology(mesh, topology))
}

/// `levels` steps; none gives a copy.
///
/// # Errors
/// As [`refine`].
pub fn refined_n(surface: &Surface, levels: usize) -> Result<Surface> {
    check(surface)?;
    (0..levels).try_fold(surface.clone(), |coarse, _| refined(&coarse))
}

/// The point of the face with the corner `c`, from those of edges: the mean along both directions.
fn of_face(surface: &Surface, edges: &EdgeNumbers, of_edges: &[DVec3], c: u32) -> DVec3 {
    let walk = Walk { surface };
    let at = |c: u32| of_edges[edges.of(c) as usize];
    let opposite = |c: u32| at(walk.next(walk.next(twin(surface.topology(), c))));
    let along = |c: u32| {
        let other = walk.next(walk.next(c));
        between([opposite(c), at(c), at(other), opposite(other)])
    };
    0.5 * (along(c) + along(walk.next(c)))
}

/// Steps on the half-edges of a closed mesh.
#[derive(Clone, Copy)]
struct Walk<'a> {
    surface: &'a Surface,
}

impl Walk<'_> {
    fn next(self, c: u32) -> u32 {
        self.surface.incidence().next(self.surface.faces(), c)
    }

    /// The next half-edge from the same vertex.
    fn turned(self, c: u32) -> u32 {
        twin(self.surface.topology(), self.surface.incidence().prev(self.surface.faces(), c))
    }

    fn back(self, c: u32) -> u32 {
        self.next(twin(self.surface.topology(), c))
    }

    fn origin(self, c: u32) -> DVec3 {
        self.surface.positions()[self.surface.faces().corners()[c as usize] as usize]
    }

    fn end(self, c: u32) -> DVec3 {
        self.origin(self.next(c))
    }

    fn opposite(self, c: u32) -> DVec3 {
        self.end(self.next(c))
    }

    /// (4/n)(Σ l − c Σ k) of every vertex.
    fn means(self) -> Vec<DVec3> {
        let incidence = self.surface.incidence();
        parallel::collect(self.surface.len(), |v| {
            let star = incidence.corners_at(v);
            let sum: DVec3 = star.iter().map(|&c| self.end(c) - CORNERS * self.opposite(c)).sum();
            4.0 / star.len() as f64 * sum
        })
    }

    /// X of the edge from the origin of half-edge `c`.
    fn beyond(self, c: u32, means: &[DVec3]) -> DVec3 {
        let v = self.surface.faces().corners()[c as usize] as usize;
        let next = self.turned(c);
        if self.surface.incidence().face_count(v) == 4 {
            return self.end(self.turned(next));
        }
        let before = self.back(c);
        let ends = self.end(before) + self.end(c) + self.end(next);
        let corners = self.opposite(self.back(before)) + self.opposite(before) + self.opposite(c) + self.opposite(next);
        means[v] - ends + CORNERS * corners
    }

    /// Points on the next two rings in the sector of half-edge `c`, all of whose vertices but its origin are regular.
    fn sector(self, c: u32) -> [DVec3; ORBITS] {
        let straight = |c: u32| self.turned(self.turned(twin(self.surface.topology(), c)));
        let (first, second) = (straight(c), straight(self.turned(c)));
        let along_second = self.next(self.next(twin(self.surface.topology(), second)));
        let far = self.turned(self.turned(self.next(self.next(c))));
        [
            self.end(c),
            self.opposite(c),
            self.end(first),
            self.end(self.next(first)),
            self.end(along_second),
            self.end(self.next(far)),
        ]
    }
}

/// The subdominant eigenvalue of a step at valence `n` with the weights of its left eigenvector: of the harmonic e^{iφj},
/// φ = 2π/n, in which the points of sector j are those of sector 0 times e^{iφj}. 6 × 6 complex numbers, by powers: the ratio of
/// its first two eigenvalues is below ⅗.
fn tangent_mask(n: usize) -> (f64, [DVec2; ORBITS]) {
    const POWERS: usize = 90;
    let turn = DVec2::from_angle(std::f64::consts::TAU / n as f64);
    let back = DVec2::new(turn.x, -turn.y);
    let (z, zz) = (|x: DVec2| turn.rotate(x), |x: DVec2| back.rotate(x));
    // The columns of the step.
    let step = |[l, k, m, right, left, far]: [DVec2; ORBITS]| {
        let beyond = CORNERS * (zz(zz(k)) + zz(k) + k + z(k)) - (zz(l) + l + z(l));
        let edge = between([beyond, DVec2::ZERO, l, m]);
        let across_first = between([zz(k), l, k, left]);
        let across_second = between([z(k), z(l), k, right]);
        let across_far = between([z(right), z(m), left, far]);
        [edge, between([zz(across_first), edge, across_second, across_far]), l, across_first, across_second, k]
    };
    let columns: [[DVec2; ORBITS]; ORBITS] = std::array::from_fn(|p| {
        let mut unit = [DVec2::ZERO; ORBITS];
        unit[p] = DVec2::X;
        step(unit)
    });
    let mut mask = [DVec2::X; ORBITS];
    let mut lambda = 0.0;
    for _ in 0..POWERS {
        mask = columns.map(|column| column.iter().zip(mask).map(|(s, y)| s.rotate(y)).sum());
        lambda = mask[0].length();
        // So that the first is 1: the phase is that of its axis.
        let unit = DVec2::new(mask[0].x, -mask[0].y) / (lambda * lambda);
        mask = mask.map(|y| unit.rotate(y));
    }
    (lambda, mask)
}

/// The subdominant eigenvalue of a step at valence `n` ≥ 3; ½ at 4.
///
/// # Panics
/// If `n` < 3.
pub fn subdominant(n: usize) -> f64 {
    assert!(n >= 3, "valence at least 3");
    tangent_mask(n).0
}

/// The tangents of the limit surface at all vertices, by masks on the next two rings of the mesh refined once, which is what they
/// cost. At valence 4 they are (8, −1)/12 along both lines.
///
/// # Errors
/// As [`refine`].
pub fn limit_tangents(surface: &Surface) -> Result<Vec<Tangents>> {
    let fine = refined(surface)?;
    let masks = by_valence(surface.incidence(), |n| if n < 3 { [DVec2::ZERO; ORBITS] } else { tangent_mask(n).1 });
    let topology = fine.topology();
    Ok(parallel::collect(surface.len(), |v| {
        let walk = Walk { surface: &fine };
        let start = topology.incidence.corners_at(v)[0];
        let n = topology.incidence.face_count(v);
        let center = fine.positions()[v];
        let mut pair = Tangents::default();
        let mut c = start;
        for j in 0..n {
            let turn = DVec2::from_angle(std::f64::consts::TAU * j as f64 / n as f64);
            for (mask, point) in masks[n].iter().zip(walk.sector(c)) {
                pair.add(DVec2::new(mask.x, -mask.y).rotate(turn), point - center);
            }
            c = walk.turned(c);
        }
        pair
    }))
}

/// The unit normals of the limit surface at all vertices; zero where [`Tangents::normal`] is.
///
/// # Errors
/// As [`limit_tangents`].
pub fn limit_normals(surface: &Surface) -> Result<Vec<DVec3>> {
    Ok(limit_tangents(surface)?.iter().map(Tangents::normal).collect())
}
