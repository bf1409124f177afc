//! Operations on meshes: splits, duals, unions, edge flips, merged faces, renumberings. Everything is deterministic, and linear in the size of the mesh for bounded valences.
//!
//! The operations expect closed meshes without defects and give such again, unless they say otherwise.

use std::f64::consts::{PI, TAU};

use chacha20::ChaCha8Rng;
use glam::DVec3;
use rand::{RngExt, SeedableRng, seq::SliceRandom};

use super::incidence::{next_in, prev_in};
use super::topology::{NONE, Topology};
use super::{Faces, Mesh};

/// For every half-edge the number of its edge, and the two ends of every edge, numbered by
/// [`Topology::edge_sides`].
fn number_edges(faces: &Faces, topology: &Topology) -> (Vec<u32>, Vec<[u32; 2]>) {
    let mut edge = vec![0; faces.corners().len()];
    let mut ends = Vec::with_capacity(topology.edges());
    for c in topology.edge_sides() {
        let range = faces.range(topology.incidence.face_of(c));
        let end = faces.corners()[next_in(&range, c) as usize];
        edge[c as usize] = ends.len() as u32;
        if let Some(d) = topology.twin(c) {
            edge[d as usize] = ends.len() as u32;
        }
        ends.push([faces.corners()[c as usize], end]);
    }
    (edge, ends)
}

fn midpoints(positions: &[DVec3], ends: &[[u32; 2]]) -> impl Iterator<Item = DVec3> {
    ends.iter().map(|&[a, b]| (positions[a as usize] + positions[b as usize]) / 2.0)
}

fn centroid(mesh: &Mesh, f: usize) -> DVec3 {
    let face = mesh.faces.face(f);
    let sum: DVec3 = face.iter().map(|&v| mesh.positions[v as usize]).sum();
    sum / face.len() as f64
}

/// Every n-gon becomes n quads about its centroid, through the midpoints of its edges: V + E + F vertices, in
/// this order, and as many faces as there were corners. The mesh may be open.
pub fn quad_split(mesh: &Mesh) -> Mesh {
    let topology = Topology::new(&mesh.faces, mesh.len());
    let (edge, ends) = number_edges(&mesh.faces, &topology);
    let (v, e) = (mesh.len() as u32, ends.len() as u32);
    let mut positions = mesh.positions.clone();
    positions.extend(midpoints(&mesh.positions, &ends));
    positions.extend((0..mesh.faces.len()).map(|f| centroid(mesh, f)));
    let corners = mesh.faces.corners().len();
    let mut faces = Faces::with_capacity(4 * corners);
    for f in 0..mesh.faces.len() {
        let range = mesh.faces.range(f);
        for c in range.clone() {
            let before = prev_in(&range, c as u32) as usize;
            faces.push(&[mesh.faces.corners()[c], v + edge[c], v + e + f as u32, v + edge[before]]);
        }
    }
    Mesh::new(positions, faces)
}

/// Every triangle becomes four through the midpoints of its edges: V + E vertices, the old ones first. The mesh
/// may be open.
///
/// # Panics
/// If a face is not a triangle.
pub fn midpoint_split(mesh: &Mesh) -> Mesh {
    let topology = Topology::new(&mesh.faces, mesh.len());
    let (edge, ends) = number_edges(&mesh.faces, &topology);
    let v = mesh.len() as u32;
    let mut positions = mesh.positions.clone();
    positions.extend(midpoints(&mesh.positions, &ends));
    let mut faces = Faces::with_capacity(12 * mesh.faces.len());
    for (f, face) in mesh.faces.iter().enumerate() {
        let &[a, b, c] = face else {
            panic!("face {f} is not a triangle");
        };
        let first = mesh.faces.range(f).start;
        let [ab, bc, ca] = [0, 1, 2].map(|k| v + edge[first + k]);
        for triangle in [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]] {
            faces.push(&triangle);
        }
    }
    Mesh::new(positions, faces)
}

/// The dual: a vertex at the centroid of every face, a face for every vertex. All valences are the old face
/// sizes and the reverse. Without defects if no two faces of `mesh` share more than one edge, so for every
/// triangulation.
pub fn dual(mesh: &Mesh) -> Mesh {
    let topology = Topology::new(&mesh.faces, mesh.len());
    let positions = (0..mesh.faces.len()).map(|f| centroid(mesh, f)).collect();
    let mut faces = Faces::with_capacity(mesh.faces.corners().len());
    let (mut star, mut face) = (Vec::new(), Vec::new());
    for v in 0..mesh.len() {
        topology.star(&mesh.faces, v, &mut star);
        face.clear();
        face.extend(star.iter().map(|&c| topology.incidence.face_of(c) as u32));
        faces.push(&face);
    }
    Mesh::new(positions, faces)
}

/// All meshes in one, their vertices and faces one mesh after the other.
pub fn union(meshes: &[Mesh]) -> Mesh {
    let mut positions = Vec::new();
    let (mut offsets, mut corners) = (vec![0u32], Vec::new());
    for mesh in meshes {
        let (first_vertex, first_corner) = (positions.len() as u32, corners.len() as u32);
        positions.extend_from_slice(&mesh.positions);
        corners.extend(mesh.faces.corners().iter().map(|&v| v + first_vertex));
        offsets.extend(mesh.faces.offsets()[1..].iter().map(|&o| o + first_corner));
    }
    Mesh::new(positions, Faces::from_parts(offsets, corners))
}

/// The connected sum of two triangulations: the last face of each is removed and the two holes are glued, so
/// that genera add up and V = V₁ + V₂ − 3. The second mesh is moved and turned inside out as needed only in
/// combinatorics; its positions are shifted beside the first.
///
/// # Panics
/// If a mesh has no faces or its last face is not a triangle.
pub fn connected_sum(a: &Mesh, b: &Mesh) -> Mesh {
    let last = |mesh: &Mesh| -> [u32; 3] {
        mesh.faces.iter().last().and_then(|f| f.try_into().ok()).expect("the last face is a triangle")
    };
    let ([a0, a1, a2], [b0, b1, b2]) = (last(a), last(b));
    // Opposite directions along the seam.
    let seam = [(b0, a0), (b1, a2), (b2, a1)];
    let shift = DVec3::X * (a.diagonal() + b.diagonal()) / 2.0;
    let mut positions = a.positions.clone();
    let renumbered: Vec<u32> = (0..b.len() as u32)
        .map(|v| {
            if let Some(&(_, glued)) = seam.iter().find(|&&(s, _)| s == v) {
                return glued;
            }
            positions.push(b.positions[v as usize] + shift);
            positions.len() as u32 - 1
        })
        .collect();
    let mut faces = Faces::default();
    for face in a.faces.iter().take(a.faces.len() - 1) {
        faces.push(face);
    }
    let mut moved = Vec::new();
    for face in b.faces.iter().take(b.faces.len() - 1) {
        moved.clear();
        moved.extend(face.iter().map(|&v| renumbered[v as usize]));
        faces.push(&moved);
    }
    Mesh::new(positions, faces)
}

/// The same mesh with vertex `order[k]` as its k-th. Faces keep their order. Valid on any mesh.
///
/// # Panics
/// If `order` is not a permutation of the vertices.
pub fn permute_vertices(mesh: &Mesh, order: &[u32]) -> Mesh {
    assert_eq!(order.len(), mesh.len(), "one entry a vertex");
    let inverse = super::order::inverse(order);
    let positions = order.iter().map(|&v| mesh.positions[v as usize]).collect();
    let mut faces = mesh.faces.clone();
    for v in faces.corners_mut() {
        *v = inverse[*v as usize];
    }
    Mesh::new(positions, faces)
}

/// The same mesh with its faces in random order, each starting at a random corner. Valid on any mesh.
pub fn shuffle_faces(mesh: &Mesh, seed: u64) -> Mesh {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut order: Vec<usize> = (0..mesh.faces.len()).collect();
    order.shuffle(&mut rng);
    let mut faces = Faces::with_capacity(mesh.faces.corners().len());
    let mut face = Vec::new();
    for f in order {
        face.clear();
        face.extend_from_slice(mesh.faces.face(f));
        if !face.is_empty() {
            let start = rng.random_range(0..face.len());
            face.rotate_left(start);
        }
        faces.push(&face);
    }
    Mesh::new(mesh.positions.clone(), faces)
}

/// Flips the diagonal of two adjacent triangles, `attempts` times for a random edge, where afterwards no two
/// vertices are joined twice, all valences are at least 3, and the two triangles do not fold over each other:
/// each keeps at least an eighth of the vector area of the quadrilateral. Counts, genus, orientation and
/// positions stay.
///
/// # Panics
/// If a face is not a triangle.
pub fn flip_edges(mesh: &mut Mesh, attempts: usize, seed: u64) {
    /// Edges drawn and looked at together before the first of them is tried.
    const AHEAD: usize = 64;
    // Keeps slivers away, and with them triangles that look turned round from another side.
    const LEAST_SHARE: f64 = 0.125;
    assert!(mesh.faces.is_empty() || mesh.faces.uniform_size() == Some(3), "all faces are triangles");
    let topology = Topology::new(&mesh.faces, mesh.len());
    let positions = &mesh.positions;
    let corners = mesh.faces.corners_mut();
    if corners.is_empty() {
        return;
    }
    let mut valence: Vec<u32> = (0..positions.len()).map(|v| topology.incidence.face_count(v) as u32).collect();
    let mut twin: Vec<u32> = (0..corners.len() as u32).map(|c| topology.twin(c).unwrap_or(NONE)).collect();
    let next = |c: u32| if c % 3 == 2 { c - 2 } else { c + 1 };
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut drawn = Vec::new();
    for attempt in 0..attempts {
        if attempt % AHEAD == 0 {
            let count = AHEAD.min(attempts - attempt);
            drawn.clear();
            drawn.extend((0..count).map(|_| rng.random_range(0..corners.len() as u32)));
            read_ahead(&drawn, &twin, corners, &valence, positions);
        }
        // Triangles (a, b, x) and (b, a, y) become (a, y, x) and (y, b, x).
        let c = drawn[attempt % AHEAD];
        let d = twin[c as usize];
        if d == NONE {
            continue;
        }
        let [bx, xa] = [next(c), next(next(c))];
        let [ay, yb] = [next(d), next(next(d))];
        let [a, b, x, y] = [c, d, xa, yb].map(|c| corners[c as usize]);
        if valence[a as usize] <= 3 || valence[b as usize] <= 3 {
            continue;
        }
        let joined = {
            // Around the one of x and y with fewer edges, looking for the other.
            let (start, other) = if valence[x as usize] <= valence[y as usize] { (xa, y) } else { (yb, x) };
            let mut around = start;
            loop {
                if corners[next(around) as usize] == other {
                    break true;
                }
                around = twin[next(next(around)) as usize];
                if around == start || around == NONE {
                    break false;
                }
            }
        };
        if joined {
            continue;
        }
        let [pa, pb, px, py] = [a, b, x, y].map(|v| positions[v as usize]);
        let area = |p: DVec3, q: DVec3, r: DVec3| (q - p).cross(r - p);
        let (first, second) = (area(pa, py, px), area(py, pb, px));
        let whole = first + second;
        let least = LEAST_SHARE * whole.length_squared();
        // Both are 0 where the quadrilateral has no area.
        if first.dot(whole).min(second.dot(whole)) <= least {
            continue;
        }
        let outer = [bx, xa, ay, yb].map(|c| twin[c as usize]);
        let (t, u) = (c - c % 3, d - d % 3);
        for (at, v) in [(t, a), (t + 1, y), (t + 2, x), (u, y), (u + 1, b), (u + 2, x)] {
            corners[at as usize] = v;
        }
        let [from_bx, from_xa, from_ay, from_yb] = outer;
        for (p, q) in [(t, from_ay), (t + 1, u + 2), (t + 2, from_xa), (u, from_yb), (u + 1, from_bx)] {
            twin[p as usize] = q;
            if q != NONE {
                twin[q as usize] = p;
            }
        }
        valence[a as usize] -= 1;
        valence[b as usize] -= 1;
        valence[x as usize] += 1;
        valence[y as usize] += 1;
    }
}

/// Reads what the flips of the drawn edges will look at, if those before them leave it there. These reads do not
/// depend on each other, so that a processor waits for many places of a large mesh at once.
fn read_ahead(drawn: &[u32], twin: &[u32], corners: &[u32], valence: &[u32], positions: &[DVec3]) {
    for &c in drawn {
        let d = twin[c as usize];
        for c in [c, d].into_iter().filter(|&c| c != NONE) {
            let first = (c - c % 3) as usize;
            for &v in &corners[first..first + 3] {
                std::hint::black_box(valence[v as usize]);
                std::hint::black_box(positions[v as usize].x);
            }
        }
    }
}

/// Removes up to `removals` random edges, each of which joins its two faces to one of at most `max_size`
/// corners, where both ends keep a valence of at least 3 and the two faces share nothing but the edge. Fewer
/// are removed only when no edge is left that can be: `mesh.faces.len()` tells. Vertices stay.
pub fn merge_faces(mesh: &Mesh, removals: usize, max_size: usize, seed: u64) -> Mesh {
    let topology = Topology::new(&mesh.faces, mesh.len());
    let corners = mesh.faces.corners();
    let mut face_of: Vec<u32> = (0..corners.len() as u32).map(|c| topology.incidence.face_of(c) as u32).collect();
    let (mut next, mut previous) = (vec![0u32; corners.len()], vec![0u32; corners.len()]);
    let mut start: Vec<u32> = mesh.faces.offsets()[..mesh.faces.len()].to_vec();
    let mut size: Vec<usize> = mesh.faces.iter().map(<[u32]>::len).collect();
    for f in 0..mesh.faces.len() {
        let range = mesh.faces.range(f);
        for c in range.clone() {
            next[c] = next_in(&range, c as u32);
            previous[c] = prev_in(&range, c as u32);
        }
    }
    let mut valence: Vec<usize> = (0..mesh.len()).map(|v| topology.incidence.face_count(v)).collect();
    // The attempt at which a vertex was last seen on the first of the two faces.
    let mut seen = vec![usize::MAX; mesh.len()];
    let mut edges: Vec<u32> = topology.edge_sides().collect();
    edges.shuffle(&mut ChaCha8Rng::seed_from_u64(seed));
    let mut left = removals;
    for (attempt, &c) in edges.iter().enumerate() {
        if left == 0 {
            break;
        }
        let Some(d) = topology.twin(c) else { continue };
        let [a, b] = [c, d].map(|c| corners[c as usize] as usize);
        let [f, g] = [c, d].map(|c| face_of[c as usize] as usize);
        let merged = size[f] + size[g] - 2;
        if f == g || merged > max_size || valence[a] <= 3 || valence[b] <= 3 {
            continue;
        }
        let around = |first: u32, next: &[u32], visit: &mut dyn FnMut(u32)| {
            let mut k = next[first as usize];
            while k != first {
                visit(k);
                k = next[k as usize];
            }
        };
        around(c, &next, &mut |k| seen[corners[k as usize] as usize] = attempt);
        seen[a] = usize::MAX;
        seen[b] = usize::MAX;
        let mut apart = true;
        around(d, &next, &mut |k| apart &= seen[corners[k as usize] as usize] != attempt);
        if !apart {
            continue;
        }
        around(d, &next, &mut |k| face_of[k as usize] = f as u32);
        let (after_c, before_c) = (next[c as usize], previous[c as usize]);
        let (after_d, before_d) = (next[d as usize], previous[d as usize]);
        for (p, q) in [(before_c, after_d), (before_d, after_c)] {
            next[p as usize] = q;
            previous[q as usize] = p;
        }
        start[f] = after_c;
        size[f] = merged;
        size[g] = 0;
        valence[a] -= 1;
        valence[b] -= 1;
        left -= 1;
    }
    let mut faces = Faces::with_capacity(corners.len());
    let mut face = Vec::new();
    for f in (0..size.len()).filter(|&f| size[f] > 0) {
        face.clear();
        let mut c = start[f];
        for _ in 0..size[f] {
            face.push(corners[c as usize]);
            c = next[c as usize];
        }
        faces.push(&face);
    }
    Mesh::new(mesh.positions.clone(), faces)
}

/// A triangulation of the unit sphere with exactly `n` ≥ 5 nearly even vertices: the north pole, rings of
/// latitude, the south pole. 2n − 4 triangles.
///
/// # Panics
/// If `n` < 5.
pub fn ring_sphere(n: usize) -> Mesh {
    assert!(n >= 5, "two poles and a ring of three");
    // The edge of n even triangles pairs on the sphere: 4π = (2n) (√3/4) h².
    let h = (8.0 * PI / (3f64.sqrt() * n as f64)).sqrt();
    let rings = ((PI / h).round() as usize).saturating_sub(1).clamp(1, (n - 2) / 3);
    let latitude = |k: usize| PI * (k + 1) as f64 / (rings + 1) as f64;
    // Three vertices in every ring, and the others in proportion to what its length asks for beyond.
    let spare = n - 2 - 3 * rings;
    let wish: Vec<f64> = (0..rings).map(|k| (TAU * latitude(k).sin() / h - 3.0).max(0.0) + f64::MIN_POSITIVE).collect();
    let total: f64 = wish.iter().sum();
    let mut granted = 0;
    let mut sum = 0.0;
    let sizes: Vec<usize> = wish
        .iter()
        .enumerate()
        .map(|(k, w)| {
            sum += w;
            let upto = if k + 1 == rings { spare } else { (spare as f64 * (sum / total)).round() as usize };
            let size = 3 + upto - granted;
            granted = upto;
            size
        })
        .collect();

    let mut positions = vec![DVec3::Z];
    let mut faces = Faces::with_capacity(6 * n - 12);
    // The angle of vertex j in ring k of the given size; odd rings are turned by half a step.
    let angle = |k: usize, size: usize, j: usize| TAU * (j as f64 + if k % 2 == 1 { 0.5 } else { 0.0 }) / size as f64;
    let mut first = 1u32;
    for (k, &size) in sizes.iter().enumerate() {
        let (sin, cos) = latitude(k).sin_cos();
        for j in 0..size {
            let (s, c) = angle(k, size, j).sin_cos();
            positions.push(DVec3::new(sin * c, sin * s, cos));
        }
        let here = |j: usize| first + (j % size) as u32;
        if k == 0 {
            for j in 0..size {
                faces.push(&[here(j), here(j + 1), 0]);
            }
        } else {
            // A strip to the ring above, always across the shorter way round.
            let above_size = sizes[k - 1];
            let above = |i: usize| first - above_size as u32 + (i % above_size) as u32;
            let (mut i, mut j) = (0, 0);
            while i < above_size || j < size {
                let advance_above =
                    j == size || i < above_size && angle(k - 1, above_size, i + 1) < angle(k, size, j + 1);
                if advance_above {
                    faces.push(&[here(j), above(i + 1), above(i)]);
                    i += 1;
                } else {
                    faces.push(&[here(j), here(j + 1), above(i)]);
                    j += 1;
                }
            }
        }
        first += size as u32;
    }
    let last = sizes[rings - 1];
    let lowest = |j: usize| first - last as u32 + (j % last) as u32;
    for j in 0..last {
        faces.push(&[lowest(j + 1), lowest(j), first]);
    }
    positions.push(DVec3::NEG_Z);
    Mesh::new(positions, faces)
}

/// An open disc: a vertex 0 with `n` faces of `size` corners about it, their other corners on a circle.
///
/// # Panics
/// If n or `size` is below 3.
pub fn disc(n: usize, size: usize) -> Mesh {
    assert!(n >= 3 && size >= 3, "three faces of three corners at the least");
    let rim = (size - 2) * n;
    let mut faces = Faces::default();
    for k in 0..n {
        let corners = (0..size - 1).map(|j| (1 + ((size - 2) * k + j) % rim) as u32);
        faces.push(&std::iter::once(0).chain(corners).collect::<Vec<_>>());
    }
    let on_circle = |k: usize| {
        let (sin, cos) = (TAU * k as f64 / rim as f64).sin_cos();
        DVec3::new(cos, sin, 0.0)
    };
    Mesh::new(std::iter::once(DVec3::Z).chain((1..=rim).map(on_circle)).collect(), faces)
}

/// An open triangle with `m` edges a side: a regular grid of m² triangles, not flat.
pub fn triangle(m: usize) -> Mesh {
    let number = |a: usize, b: usize| (a * (2 * m + 3 - a) / 2 + b) as u32;
    let mut faces = Faces::default();
    let mut points = Vec::new();
    for a in 0..=m {
        for b in 0..=m - a {
            points.push(DVec3::new(a as f64, b as f64, (a * b) as f64));
            if a + b < m {
                faces.push(&[number(a, b), number(a + 1, b), number(a, b + 1)]);
            }
            if a + b + 1 < m {
                faces.push(&[number(a + 1, b), number(a + 1, b + 1), number(a, b + 1)]);
            }
        }
    }
    Mesh::new(points, faces)
}

#[cfg(test)]
mod tests;
