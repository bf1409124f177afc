//! Catmull-Clark subdivision (Catmull & Clark 1978) of any polygon mesh: new face points at centroids,
//! edge points (Thall Eq. 12), vertex points (Thall Eq. 13); limit and tangent masks after Halstead, Kass &
//! DeRose 1993, beside non-quads by the regularisation of Thall §2.3. Sharp edges after DeRose, Kass & Truong 1998.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::local_limit::{Star, StarRule};
use super::refined::{self, Of, set_rows};
use super::refinement::{Class, Refinement, RefinementRules, Size};
use super::scheme::{CUBIC, Circulant, Definition, PaperNames, SingularSet};
use super::sharp::{self, Across};
use super::star::{Circle, Tangents, across, centroid, for_each_star, require_room, require_rules, sides};
use crate::Result;
use crate::mesh::edge_numbers::{EdgeNumbers, FirstSides};
use crate::mesh::incidence::{next_in, prev_in};
use crate::mesh::{Faces, Mesh, Surface, Topology};
use crate::pages::large;
use crate::parallel;

/// h(n) = 1/(n(n+5)), d(n) = n² − n, w = 2, a face of m corners adds 4/m between all of them.
///
/// λ_min(A) ≥ (n−3)/(n+5) at the least valence n, and A is singular exactly on bipartite components of valence 3, from
/// `xᵀMx = Σ_F (4/|F|)(Σ_{i∈F} x_i)² + 2 Σ_ij (x_i+x_j)² + Σ n(n−3) x_i²`: the edge terms vanish only for x_j = −x_i along
/// every edge, the last only where n = 3, and the face terms then vanish by themselves, as all faces are even.
/// λ_min(A) is 0.086 to 0.111 on irregular meshes of 20 000 vertices and on tori.
pub(super) const DEFINITION: Definition = Definition {
    name: "catmull-clark",
    paper_names: PaperNames { system: "C", diagonal: "H", symmetric: "M" },
    h: |n| 1.0 / (n as f64 * (n as f64 + 5.0)),
    vertex_weight: |n| n as f64 * n as f64 - n as f64,
    edge_weight: 2.0,
    circulant: Some(|m| Circulant { identity: 0.0, constant: 4.0 / m, cosine: 0.0 }),
    needs_triangles: false,
    lambda_min_at: |n, _| (n as f64 - 3.0) / (n as f64 + 5.0),
    usual_lambda_min: 0.085,
    singular: SingularSet::Bipartite { valence: Some(3) },
    // ((2 + cos θ)/3)((2 + cos φ)/3).
    regular_symbol: (1.0 / 9.0, 4.0 / 9.0),
    refinement: Refinement::CatmullClark,
    first_rule: None,
    curve_weight: CUBIC,
    star_rule: Some(StarRule::CatmullClark),
};

/// All that defines the refinement.
pub(super) const RULES: RefinementRules = RefinementRules {
    name: "catmull-clark",
    class: Class::Primal,
    needs_triangles: false,
    check: require_rules,
    refine,
    refined_topology,
    refined_features: |surface, refined, topology| {
        refined::features_of_pieces(surface, refined, topology, refined::halves_in_quads)
    },
    size: |c| Size {
        vertices: c.vertices + c.edges() + c.faces,
        faces: c.corners,
        corners: 4 * c.corners,
        has_features: c.has_features,
    },
    limit_positions,
    limit_normals,
};

/// One step.
///
/// Vertices of the result: old vertices, then one for each edge (in order of its first half-edge), then one
/// for each face. Faces of the result: one quad for each old corner, in corner order, as
/// (vertex, edge leaving it, face, edge entering it).
///
/// The points of sharp edges are their midpoints, of crease vertices (a + 6v + b)/8 with the neighbours a and b along the
/// curve; corners rest; darts follow the rule of smooth vertices; what is semi-sharp blends these with the smooth points.
///
/// # Errors
/// [`Error::Open`](crate::Error::Open) if the mesh has a boundary that is treated as interior,
/// [`Error::TooLarge`](crate::Error::TooLarge) if 32-bit indices do not reach the result.
pub fn refine(surface: &Surface) -> Result<Mesh> {
    require_rules(surface)?;
    require_room(surface.mesh(), 4)?;
    let edges = surface.topology().edge_numbers();
    let mut positions = refined::points(surface, &edges, &[Of::Vertices, Of::Edges, Of::Faces], &smooth_points);
    sharp::set_refined(&mut positions, surface, &edges, |v| surface.positions()[v]);
    Ok(Mesh::new(positions, split(surface, &edges)))
}

/// The new points of vertices, edges and faces where nothing is sharp.
fn smooth_points(surface: &Surface, edges: &FirstSides) -> Vec<DVec3> {
    let (mesh, topology) = (surface.mesh(), surface.topology());
    let (old, incidence) = (&mesh.positions, &topology.incidence);
    let corners = mesh.faces.corners();
    let mut centers = large(Vec::with_capacity(mesh.faces.len()));
    parallel::extend(&mut centers, mesh.faces.len(), |_| |f| centroid(old, mesh.faces.face(f)));
    let mut positions = large(Vec::with_capacity(mesh.len() + topology.edges() + centers.len()));
    let vertex = |v: usize| {
        let star = incidence.corners_at(v);
        let mut sum = DVec3::ZERO;
        for &c in star {
            let w = corners[incidence.next(&mesh.faces, c) as usize];
            sum += old[w as usize] + centers[incidence.face_of(c)];
        }
        let n = star.len() as f64;
        (n - 2.0) / n * old[v] + sum / (n * n)
    };
    parallel::extend(&mut positions, mesh.len(), |_| vertex);
    edges.extend(&mut positions, |c| {
        let [one, other] =
            [c, across(topology, c)].map(|c| old[corners[c as usize] as usize] + centers[incidence.face_of(c)]);
        0.25 * one + 0.25 * other
    });
    positions.append(&mut centers);
    positions
}

/// The topology of `refined`, which is what [`refine`] made of the surface.
pub(super) fn refined_topology(surface: &Surface, refined: &Mesh) -> Topology {
    refined::of_quads(surface, refined)
}

/// One step by Thall's in-place rule (Eq. 20 and 22): first the points of faces and edges, then each old vertex
/// from its new neighbours alone, ((n²−3n) v + Σ_j (4 e'_j − f'_j))/n², written over its old place. The result is
/// that of [`refine`] up to rounding, numbered alike; the only array of points is that of the result, but for the old
/// places of vertices that are not smooth. (The middle line of the printed Eq. 22 has −(1/n²)v for −(1/n)v; its last line,
/// used here, is right.)
///
/// # Errors
/// As [`refine`].
pub fn refine_in_place(mut surface: Surface) -> Result<Mesh> {
    require_rules(&surface)?;
    require_room(surface.mesh(), 4)?;
    let mut points = surface.take_positions();
    let mut sharp: Vec<(usize, DVec3)> = Vec::new();
    if let Some(features) = surface.features() {
        sharp.extend((0..points.len()).filter(|&v| !features.is_smooth(v)).map(|v| (v, points[v])));
    }
    let (mesh, topology) = (surface.mesh(), surface.topology());
    let numbers = topology.edge_numbers();
    let (vertices, edges) = (topology.incidence.vertices(), topology.edges());
    let corners = mesh.faces.corners();
    points.resize(vertices + edges + mesh.faces.len(), DVec3::ZERO);
    let face_point = |c: u32| vertices + edges + topology.incidence.face_of(c);
    for (f, face) in mesh.faces.iter().enumerate() {
        points[vertices + edges + f] = centroid(&points, face);
    }
    for (e, c) in topology.edge_sides().enumerate() {
        let t = across(topology, c);
        let ends = points[corners[c as usize] as usize] + points[corners[t as usize] as usize];
        points[vertices + e] = 0.25 * (ends + points[face_point(c)] + points[face_point(t)]);
    }
    for v in 0..vertices {
        let star = topology.incidence.corners_at(v);
        let n = star.len() as f64;
        let neighbors: DVec3 =
            star.iter().map(|&c| 4.0 * points[vertices + numbers.of(c) as usize] - points[face_point(c)]).sum();
        points[v] = ((n * n - 3.0 * n) * points[v] + neighbors) / (n * n);
    }
    sharp::set_refined(&mut points, &surface, &numbers, |v| sharp[sharp.partition_point(|s| s.0 < v)].1);
    let faces = split(&surface, &numbers);
    Ok(Mesh::new(points, faces))
}

/// The faces of the refined mesh: (vertex, edge leaving it, face, edge entering it) for each old corner.
pub(super) fn split(surface: &Surface, edges: &EdgeNumbers) -> Faces {
    let (mesh, topology) = (surface.mesh(), surface.topology());
    let vertices = topology.incidence.vertices() as u32;
    let first_face = vertices + topology.edges() as u32;
    let corners = mesh.faces.corners();
    let incidence = &topology.incidence;
    let mut quads = large(vec![0; 4 * corners.len()]);
    set_rows(&mut quads, |c| {
        [
            corners[c as usize],
            vertices + edges.of(c),
            first_face + incidence.face_of(c) as u32,
            vertices + edges.of(incidence.prev(&mesh.faces, c)),
        ]
    });
    Faces::of_size(4, quads)
}

/// The limit mask of a vertex of valence `n` among quads: the weight of the vertex, of each edge neighbour, of
/// each opposite corner of a quad: (n², 4, 1)/(n(n+5)).
pub fn limit_mask(n: usize) -> [f64; 3] {
    let n = n as f64;
    let scale = 1.0 / (n * (n + 5.0));
    [n * n * scale, 4.0 * scale, scale]
}

/// The limit points of all vertices, of any valence and beside faces of any size:
/// ((n²−n) v + Σ_j 2 e_j + Σ_F 4 c_F)/(n(n+5)), c_F the centroids, which is [`limit_mask`] with the
/// opposite corner of each face replaced by 4c_F − v − e_j − e_{j+1} (Thall Eq. 14). On curves (a + 4v + b)/6 with the
/// neighbours a and b along the curve; corners rest; at darts [`dart_mask`], with opposite corners replaced likewise; what is
/// semi-sharp has the rows of its steps.
///
/// # Errors
/// [`Error::Open`](crate::Error::Open) if the mesh has a boundary that is treated as interior.
pub fn limit_positions(surface: &Surface) -> Result<Vec<DVec3>> {
    let (mesh, topology) = (surface.mesh(), surface.topology());
    require_rules(surface)?;
    let mut limits = vec![DVec3::ZERO; mesh.len()];
    for face in mesh.faces.iter() {
        let center = 4.0 * centroid(&mesh.positions, face);
        for (v, w) in sides(face) {
            limits[v] += 2.0 * mesh.positions[w] + center;
        }
    }
    for (v, limit) in limits.iter_mut().enumerate() {
        let n = topology.incidence.face_count(v) as f64;
        *limit = ((n * n - n) * mesh.positions[v] + *limit) / (n * (n + 5.0));
    }
    sharp::set_limits(&mut limits, surface, CUBIC, Some(StarRule::CatmullClark));
    Ok(limits)
}

/// The regularised opposite corner of the face of corner `c` of `v`, seen from there: 4c_F − v − e_j − e_{j+1} − v. In a quad
/// it is the opposite corner.
fn opposite(surface: &Surface, c: u32, v: usize) -> DVec3 {
    let (mesh, incidence) = (surface.mesh(), surface.incidence());
    let seen = |c: u32| mesh.positions[mesh.faces.corners()[c as usize] as usize] - mesh.positions[v];
    let center = centroid(&mesh.positions, mesh.faces.face(incidence.face_of(c)));
    4.0 * (center - mesh.positions[v]) - seen(incidence.next(&mesh.faces, c)) - seen(incidence.prev(&mesh.faces, c))
}

/// The limit mask of a dart of valence `n` among quads: the weight of the vertex, then for each of its n edges,
/// counter-clockwise from the sharp one, of the edge neighbour and of the opposite corner of the quad that follows. The left
/// eigenvector for 1 of a step on its star, by repetition: O(n).
///
/// ```
/// use limitlab::schemes::catmull_clark::dart_mask;
/// let mask = dart_mask(3);
/// let exact = [81. / 200., 1. / 5., 11. / 400., 3. / 20., 1. / 25., 3. / 20., 11. / 400.];
/// assert!(mask.iter().zip(exact).all(|(found, exact)| (found - exact).abs() < 1e-15));
/// ```
pub fn dart_mask(n: usize) -> Vec<f64> {
    let row = Star::dart(n, 4).row(StarRule::CatmullClark);
    let around = row.edges.iter().zip(&row.faces).flat_map(|(&edge, &face)| [edge, face]);
    std::iter::once(row.own).chain(around).collect()
}

/// The weights of the tangent across the boundary at a vertex of `m` faces there. `None` from four on: the limit normals of
/// its faces differ.
///
/// With θ = π/m and λ = (5 + cos θ + cos(θ/2)√(2(9 + cos θ)))/16, the left eigenvector for λ of a step on the star is
/// (8λ − 2) sin jθ on the inner neighbours e_1 … e_{m−1}, cos(θ/2) sin (j − ½)θ on the opposite corners; its sum is 0; and the
/// column of e_0 leaves its weight there, q − s/8 over λ − 1/4, where q is what comes from the inner weights beside it and s the
/// sum of all inner ones. With one face λ = 1/4 is double, and e_0 + e_1 − 2v its only left eigenvector.
fn across_boundary(m: usize) -> Option<Across> {
    let theta = PI / m as f64;
    let half = (0.5 * theta).cos();
    let lambda = (5.0 + theta.cos() + half * (2.0 * (9.0 + theta.cos())).sqrt()) / 16.0;
    match m {
        1 => return Some(Across { edges: vec![1.0; 2], faces: vec![0.0] }),
        2 | 3 => {}
        _ => return None,
    }
    let mut edges: Vec<f64> = (0..=m).map(|j| (8.0 * lambda - 2.0) * (theta * j as f64).sin()).collect();
    let faces: Vec<f64> = (0..m).map(|j| half * (theta * (j as f64 + 0.5)).sin()).collect();
    let sum: f64 = edges[1..m].iter().chain(&faces).sum();
    let beside = edges[1] / 16.0 + faces[0] / 4.0;
    let end = (beside - sum / 8.0) / (lambda - 0.25);
    (edges[0], edges[m]) = (end, end);
    Some(Across { edges, faces })
}

/// A_n = 1 + cos(2π/n) + cos(π/n)·√(2(9 + cos(2π/n))) (Thall Eq. 15): the subdominant eigenvalue is (4+A_n)/16.
pub fn tangent_constant(n: usize) -> f64 {
    let cosine = (TAU / n as f64).cos();
    1.0 + cosine + (PI / n as f64).cos() * (2.0 * (9.0 + cosine)).sqrt()
}

/// The cosine tangent mask of valence `n`: for j = 0…n−1 the weights of edge neighbour j,
/// A_n cos(2πj/n), and of the opposite corner of the face between neighbours j and j+1,
/// cos(2πj/n) + cos(2π(j+1)/n). The sine mask has sines in their place. (Halstead et al. give as second
/// tangent the cosine mask turned by one sector, which spans the same plane.)
pub fn tangent_mask(n: usize) -> Vec<[f64; 2]> {
    let constant = tangent_constant(n);
    let mut circle = Circle::default();
    let circle = circle.of(n);
    (0..n).map(|j| [constant * circle[j].x, circle[j].x + circle[(j + 1) % n].x]).collect()
}

/// The tangents of the limit surface at all vertices. At a boundary vertex with up to three faces and no sharp edge between
/// them one goes along the boundary and one across it; at a corner with one face they go along its sides. All others that are
/// not smooth have none: from four faces on the normals of the faces at a boundary vertex differ, a crease has one normal a
/// side, a corner one a face; those of darts are not computed.
///
/// # Errors
/// As [`limit_positions`].
pub fn limit_tangents(surface: &Surface) -> Result<Vec<Tangents>> {
    let (mesh, topology) = (surface.mesh(), surface.topology());
    require_rules(surface)?;
    let corners = mesh.faces.corners();
    let mut tangents = Vec::with_capacity(mesh.len());
    let mut circle = Circle::default();
    let centers: Vec<DVec3> = mesh.faces.iter().map(|face| centroid(&mesh.positions, face)).collect();
    for_each_star(surface, |v, star| {
        let n = star.len();
        let constant = tangent_constant(n);
        let circle = circle.of(n);
        let center = mesh.positions[v];
        let mut pair = Tangents::default();
        for (j, &c) in star.iter().enumerate() {
            let f = topology.incidence.face_of(c);
            let range = mesh.faces.range(f);
            let leaving = mesh.positions[corners[next_in(&range, c) as usize] as usize] - center;
            let entering = mesh.positions[corners[prev_in(&range, c) as usize] as usize] - center;
            // The regularised opposite corner 4c_F − v − e_j − e_{j+1}, seen from v.
            let opposite = 4.0 * (centers[f] - center) - leaving - entering;
            pair.add(constant * circle[j], leaving);
            pair.add(circle[j] + circle[(j + 1) % n], opposite);
        }
        tangents.push(pair);
    });
    sharp::set_tangents(&mut tangents, surface, across_boundary, |c, v| opposite(surface, c, v));
    Ok(tangents)
}

/// The unit normals of the limit surface at all vertices; zero where [`Tangents::normal`] is.
///
/// # Errors
/// As [`limit_tangents`].
pub fn limit_normals(surface: &Surface) -> Result<Vec<DVec3>> {
    let tangents = limit_tangents(surface)?;
    Ok(tangents.iter().map(Tangents::normal).collect())
}
