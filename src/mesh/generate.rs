//! New meshes from old ones, and random ones from a seed: splits, duals, unions, edge flips, merged faces,
//! renumberings. Everything is deterministic, and linear in the size of the mesh for bounded valences.
//!
//! The operations expect closed meshes without defects and give such again, unless they say otherwise.

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use rand::{Rng, RngExt, SeedableRng, seq::SliceRandom};
use rand_chacha::ChaCha8Rng;

use super::topology::{NONE, Topology, next_in, prev_in};
use super::{Faces, Mesh, builtin};

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
    ends.iter()
        .map(|&[a, b]| (positions[a as usize] + positions[b as usize]) / 2.0)
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
    let mut faces = Faces::with_capacity(corners, 4 * corners);
    for f in 0..mesh.faces.len() {
        let range = mesh.faces.range(f);
        for c in range.clone() {
            let before = prev_in(&range, c as u32) as usize;
            faces.push(&[
                mesh.faces.corners()[c],
                v + edge[c],
                v + e + f as u32,
                v + edge[before],
            ]);
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
    let mut faces = Faces::with_capacity(4 * mesh.faces.len(), 12 * mesh.faces.len());
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
    let mut faces = Faces::with_capacity(mesh.len(), mesh.faces.corners().len());
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
        mesh.faces
            .iter()
            .last()
            .and_then(|f| f.try_into().ok())
            .expect("the last face is a triangle")
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
    let mut faces = Faces::with_capacity(a.faces.len() + b.faces.len() - 2, 0);
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
    let mut faces = Faces::with_capacity(order.len(), mesh.faces.corners().len());
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
    // Keeps slivers away, and with them triangles that look turned round from another side.
    const LEAST_SHARE: f64 = 0.125;
    assert!(
        mesh.faces.is_empty() || mesh.faces.uniform_size() == Some(3),
        "all faces are triangles"
    );
    let topology = Topology::new(&mesh.faces, mesh.len());
    let positions = &mesh.positions;
    let corners = mesh.faces.corners_mut();
    if corners.is_empty() {
        return;
    }
    let mut valence: Vec<u32> = (0..positions.len())
        .map(|v| topology.incidence.face_count(v) as u32)
        .collect();
    let mut twin: Vec<u32> = (0..corners.len() as u32)
        .map(|c| topology.twin(c).unwrap_or(NONE))
        .collect();
    let next = |c: u32| if c % 3 == 2 { c - 2 } else { c + 1 };
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    for _ in 0..attempts {
        // Triangles (a, b, x) and (b, a, y) become (a, y, x) and (y, b, x).
        let c = rng.random_range(0..corners.len() as u32);
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
            let (start, other) = if valence[x as usize] <= valence[y as usize] {
                (xa, y)
            } else {
                (yb, x)
            };
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
        for (at, v) in [
            (t, a),
            (t + 1, y),
            (t + 2, x),
            (u, y),
            (u + 1, b),
            (u + 2, x),
        ] {
            corners[at as usize] = v;
        }
        let [from_bx, from_xa, from_ay, from_yb] = outer;
        for (p, q) in [
            (t, from_ay),
            (t + 1, u + 2),
            (t + 2, from_xa),
            (u, from_yb),
            (u + 1, from_bx),
        ] {
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

/// Removes up to `removals` random edges, each of which joins its two faces to one of at most `max_size`
/// corners, where both ends keep a valence of at least 3 and the two faces share nothing but the edge. Fewer
/// are removed only when no edge is left that can be: `mesh.faces.len()` tells. Vertices stay.
pub fn merge_faces(mesh: &Mesh, removals: usize, max_size: usize, seed: u64) -> Mesh {
    let topology = Topology::new(&mesh.faces, mesh.len());
    let corners = mesh.faces.corners();
    let mut face_of: Vec<u32> = (0..corners.len() as u32)
        .map(|c| topology.incidence.face_of(c) as u32)
        .collect();
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
    let mut valence: Vec<usize> = (0..mesh.len())
        .map(|v| topology.incidence.face_count(v))
        .collect();
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
        around(c, &next, &mut |k| {
            seen[corners[k as usize] as usize] = attempt
        });
        seen[a] = usize::MAX;
        seen[b] = usize::MAX;
        let mut apart = true;
        around(d, &next, &mut |k| {
            apart &= seen[corners[k as usize] as usize] != attempt
        });
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
    let mut faces = Faces::with_capacity(mesh.faces.len(), corners.len());
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
    let rings = ((PI / h).round() as usize)
        .saturating_sub(1)
        .clamp(1, (n - 2) / 3);
    let latitude = |k: usize| PI * (k + 1) as f64 / (rings + 1) as f64;
    // Three vertices in every ring, and the others in proportion to what its length asks for beyond.
    let spare = n - 2 - 3 * rings;
    let wish: Vec<f64> = (0..rings)
        .map(|k| (TAU * latitude(k).sin() / h - 3.0).max(0.0) + f64::MIN_POSITIVE)
        .collect();
    let total: f64 = wish.iter().sum();
    let mut granted = 0;
    let mut sum = 0.0;
    let sizes: Vec<usize> = wish
        .iter()
        .enumerate()
        .map(|(k, w)| {
            sum += w;
            let upto = if k + 1 == rings {
                spare
            } else {
                (spare as f64 * (sum / total)).round() as usize
            };
            let size = 3 + upto - granted;
            granted = upto;
            size
        })
        .collect();

    let mut positions = vec![DVec3::Z];
    let mut faces = Faces::with_capacity(2 * n - 4, 6 * n - 12);
    // The angle of vertex j in ring k of the given size; odd rings are turned by half a step.
    let angle = |k: usize, size: usize, j: usize| {
        TAU * (j as f64 + if k % 2 == 1 { 0.5 } else { 0.0 }) / size as f64
    };
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
                let advance_above = j == size
                    || i < above_size && angle(k - 1, above_size, i + 1) < angle(k, size, j + 1);
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

/// A random closed triangulation of a few to about two thousand vertices: a sphere, a torus, a connected sum, or
/// two components, with valences from 3 to 1000, edges flipped at random, vertices and faces in random order.
pub fn random_triangulation(seed: u64) -> Mesh {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut mesh = match rng.random_range(0..8) {
        0 => connected_sum(&random_base(&mut rng), &random_base(&mut rng)),
        1 => union(&[random_base(&mut rng), random_base(&mut rng)]),
        _ => random_base(&mut rng),
    };
    // None in a quarter of the cases, which keeps the largest valences.
    let attempts = rng.random_range(0..4) * mesh.len();
    flip_edges(&mut mesh, attempts, rng.next_u64());
    shuffle(&mesh, &mut rng)
}

fn random_base(rng: &mut ChaCha8Rng) -> Mesh {
    match rng.random_range(0..6) {
        0 => builtin::tetrahedron(),
        1 => builtin::bipyramid(rng.random_range(3..40)),
        2 => builtin::bipyramid(rng.random_range(3..=1000)),
        3 => builtin::tri_torus(rng.random_range(3..12), rng.random_range(3..12)),
        4 => builtin::icosphere(rng.random_range(0..3)),
        _ => ring_sphere(rng.random_range(5..400)),
    }
}

/// A random closed polygon mesh from a [`random_triangulation`]: mixed polygons, its dual, quads, or itself.
pub fn random_polygons(seed: u64) -> Mesh {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let triangles = random_triangulation(rng.next_u64());
    let mut merged = || {
        let removals = rng.random_range(0..=triangles.faces.len());
        let max_size = rng.random_range(4..12);
        merge_faces(&triangles, removals, max_size, rng.next_u64())
    };
    let mesh = match seed % 5 {
        0 => merged(),
        1 => dual(&triangles),
        2 => quad_split(&triangles),
        3 => quad_split(&merged()),
        _ => triangles,
    };
    shuffle(&mesh, &mut rng)
}

fn shuffle(mesh: &Mesh, rng: &mut ChaCha8Rng) -> Mesh {
    let mut order: Vec<u32> = (0..mesh.len() as u32).collect();
    order.shuffle(rng);
    shuffle_faces(&permute_vertices(mesh, &order), rng.next_u64())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::topology::Incidence;
    use crate::mesh::validate::{Boundary, Counts, validate};

    /// The counts of a mesh without defects.
    fn counts(mesh: &Mesh, what: impl std::fmt::Display) -> Counts {
        let report = validate(mesh, None, Boundary::Refuse);
        assert!(report.is_valid(), "{what}: {}", report.summary_line());
        report.counts.unwrap()
    }

    fn shape(mesh: &Mesh) -> (usize, usize, usize, i64) {
        let c = counts(mesh, "mesh");
        (c.vertices, c.edges, c.faces, c.euler_characteristic)
    }

    #[test]
    fn random_meshes_are_valid_and_varied() {
        let (mut tori, mut pairs, mut higher, mut largest, mut polygons) = (0, 0, 0, 0, 0);
        for seed in 0..400 {
            let triangles = random_triangulation(seed);
            assert_eq!(triangles.faces.uniform_size(), Some(3));
            let c = counts(&triangles, seed);
            // Closed triangulations: 3F = 2E.
            assert_eq!(3 * c.faces, 2 * c.edges);
            tori += usize::from(c.components == 1 && c.euler_characteristic == 0);
            higher += usize::from(c.euler_characteristic < 0);
            pairs += usize::from(c.components == 2);
            largest = largest.max(c.max_valence);
            assert_eq!(triangles, random_triangulation(seed));

            let mesh = random_polygons(seed);
            counts(&mesh, seed);
            polygons += usize::from(mesh.faces.uniform_size().is_none());
        }
        assert!(tori > 20 && pairs > 20 && higher > 0 && polygons > 100);
        assert!(largest > 900);
    }

    #[test]
    fn splits_add_up() {
        for seed in 0..40 {
            let mesh = random_polygons(seed);
            let c = counts(&mesh, seed);
            let split = counts(&quad_split(&mesh), seed);
            assert_eq!(split.vertices, c.vertices + c.edges + c.faces);
            assert_eq!((split.faces, split.edges), (2 * c.edges, 4 * c.edges));
            assert_eq!(split.euler_characteristic, c.euler_characteristic);
            assert_eq!(quad_split(&mesh).faces.uniform_size(), Some(4));

            let mesh = random_triangulation(seed);
            let c = counts(&mesh, seed);
            let fine = midpoint_split(&mesh);
            let split = counts(&fine, seed);
            assert_eq!(split.vertices, c.vertices + c.edges);
            assert_eq!((split.faces, split.components), (4 * c.faces, c.components));
            // Old vertices keep their valence, new ones have six.
            let (old, new) = [&mesh, &fine]
                .map(|m| Incidence::new(&m.faces, m.len()))
                .into();
            for v in 0..fine.len() {
                let expected = if v < mesh.len() { old.face_count(v) } else { 6 };
                assert_eq!(new.face_count(v), expected);
            }
        }
        // On an open mesh: a square, then four.
        let square = [DVec3::ZERO, DVec3::X, DVec3::X + DVec3::Y, DVec3::Y];
        let square = Mesh::new(square.to_vec(), Faces::from_lists([[0, 1, 2, 3]]));
        let split = quad_split(&square);
        let p = |v: usize| split.positions[v].truncate().to_array();
        assert_eq!((split.len(), split.faces.len()), (9, 4));
        assert_eq!((p(4), p(7), p(8)), ([0.5, 0.0], [0.0, 0.5], [0.5, 0.5]));
        assert_eq!(split.faces.face(0), [0, 4, 8, 7]);
    }

    #[test]
    fn the_dual_of_the_dual_is_the_mesh_again() {
        for seed in 0..40 {
            let mesh = random_triangulation(seed);
            let c = counts(&mesh, seed);
            let dual_mesh = dual(&mesh);
            let d = counts(&dual_mesh, seed);
            assert_eq!(
                (d.vertices, d.edges, d.faces),
                (c.faces, c.edges, c.vertices)
            );
            assert_eq!((d.min_valence, d.max_valence), (3, 3));
            let again = dual(&dual_mesh);
            // Up to the corner at which a face starts.
            for (a, b) in mesh.faces.iter().zip(again.faces.iter()) {
                let mut rotated = b.to_vec();
                let start = b.iter().position(|&v| v == a[0]).unwrap();
                rotated.rotate_left(start);
                assert_eq!(a, rotated);
            }
        }
        assert_eq!(shape(&dual(&builtin::octahedron())), (8, 12, 6, 2));
        assert_eq!(shape(&dual(&builtin::torus(7, 5))), (35, 70, 35, 0));
    }

    #[test]
    fn sums_and_unions_add_up() {
        let (torus, sphere) = (builtin::tri_torus(5, 4), builtin::icosahedron());
        let mut sum = torus.clone();
        for genus in 2..5 {
            sum = connected_sum(&sum, &torus);
            let c = counts(&sum, genus);
            assert_eq!(c.euler_characteristic, 2 - 2 * genus);
            assert_eq!((c.components, c.vertices), (1, 17 * genus as usize + 3));
        }
        assert_eq!(shape(&connected_sum(&torus, &sphere)), (29, 87, 58, 0));
        let both = union(&[torus, sphere, builtin::cube()]);
        assert_eq!(shape(&both), (40, 102, 66, 4));
        assert_eq!(counts(&both, "union").components, 3);
        assert_eq!(union(&[]), Mesh::new(Vec::new(), Faces::default()));
    }

    #[test]
    fn renumbering_and_shuffling_keep_the_mesh() {
        let mesh = builtin::irregular_poly(100, 3);
        let order: Vec<u32> = (0..100).map(|k| (k * 37 + 11) % 100).collect();
        let moved = permute_vertices(&mesh, &order);
        for (k, &v) in order.iter().enumerate() {
            assert_eq!(moved.positions[k], mesh.positions[v as usize]);
        }
        assert_eq!(
            permute_vertices(&moved, &super::super::order::inverse(&order)),
            mesh
        );

        // As a set of cyclic sequences the faces are the same; as a sequence they are not.
        let canonical = |mesh: &Mesh| {
            let mut faces: Vec<Vec<u32>> = mesh.faces.iter().map(<[u32]>::to_vec).collect();
            for face in &mut faces {
                let least = (0..face.len()).min_by_key(|&k| face[k]).unwrap();
                face.rotate_left(least);
            }
            faces.sort();
            faces
        };
        let shuffled = shuffle_faces(&mesh, 5);
        assert_ne!(shuffled.faces, mesh.faces);
        assert_eq!(canonical(&shuffled), canonical(&mesh));
    }

    #[test]
    fn flips_keep_every_count_but_valences() {
        for (mut mesh, name) in [
            (builtin::tri_torus(3, 3), "the smallest torus grid"),
            (builtin::tri_torus(20, 10), "torus"),
            (builtin::icosphere(3), "sphere"),
            (builtin::tetrahedron(), "tetrahedron"),
            (builtin::bipyramid(500), "bipyramid"),
        ] {
            let before = shape(&mesh);
            let (positions, faces) = (mesh.positions.clone(), mesh.faces.clone());
            flip_edges(&mut mesh, 20 * before.1, 9);
            assert_eq!(shape(&mesh), before, "{name}");
            assert_eq!(mesh.positions, positions);
            if name == "torus" || name == "sphere" {
                assert_ne!(mesh.faces, faces);
                let c = counts(&mesh, name);
                assert!(c.min_valence == 3 && c.max_valence > 7);
            }
        }
        let mut unchanged = builtin::icosphere(1);
        flip_edges(&mut unchanged, 0, 9);
        assert_eq!(unchanged, builtin::icosphere(1));
    }

    #[test]
    fn flips_on_a_star_shaped_sphere_leave_no_fold() {
        let mesh = builtin::irregular_tri(800, 4);
        for face in mesh.faces.iter() {
            let [a, b, c] = [0, 1, 2].map(|k| mesh.positions[face[k] as usize]);
            assert!(
                a.dot(b.cross(c)) > 0.0,
                "seen from the centre the face is turned round"
            );
        }
    }

    #[test]
    fn merged_faces_are_as_many_and_as_large_as_asked() {
        for seed in 0..60 {
            let mesh = random_triangulation(seed);
            let before = counts(&mesh, seed);
            for (removals, max_size) in [(0, 8), (before.faces / 10, 8), (before.faces, 5)] {
                let merged = merge_faces(&mesh, removals, max_size, seed);
                let after = counts(&merged, seed);
                let gone = before.faces - after.faces;
                assert_eq!(before.edges - after.edges, gone);
                assert_eq!(after.euler_characteristic, before.euler_characteristic);
                assert!(gone <= removals && merged.faces.iter().all(|f| f.len() <= max_size));
            }
            assert_eq!(merge_faces(&mesh, 0, 8, seed), mesh);
        }
        // Where all valences are 6 there is room for a tenth.
        let mesh = builtin::tri_torus(20, 20);
        assert_eq!(merge_faces(&mesh, 120, 6, 1).faces.len(), 800 - 120);
        assert_eq!(merge_faces(&builtin::cube(), 12, 9, 1), builtin::cube());
    }

    #[test]
    fn ring_spheres_of_every_size_are_even() {
        for n in (5..300).chain([1000, 9999]) {
            let mesh = ring_sphere(n);
            assert_eq!(shape(&mesh), (n, 3 * n - 6, 2 * n - 4, 2));
            for face in mesh.faces.iter() {
                let [a, b, c] = [0, 1, 2].map(|k| mesh.positions[face[k] as usize]);
                assert!(a.dot(b.cross(c)) > 0.0, "n = {n}");
            }
            if n > 50 {
                assert!(counts(&mesh, n).max_valence <= 9);
            }
        }
    }

    #[test]
    fn irregular_quads_exist_for_every_size_and_seed_tried() {
        for n in (26..60).step_by(2) {
            for seed in 0..500 {
                assert_eq!(
                    builtin::irregular_quad(n, seed).len(),
                    n,
                    "n = {n}, seed {seed}"
                );
            }
        }
    }
}
