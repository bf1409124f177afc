use super::*;
use crate::mesh::builtin;
use crate::mesh::incidence::Incidence;
use crate::mesh::random::{random_polygons, random_triangulation};
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
        let (old, new) = [&mesh, &fine].map(|m| Incidence::new(&m.faces, m.len())).into();
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
        assert_eq!((d.vertices, d.edges, d.faces), (c.faces, c.edges, c.vertices));
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
    assert_eq!(permute_vertices(&moved, &crate::mesh::order::inverse(&order)), mesh);

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
        assert!(a.dot(b.cross(c)) > 0.0, "seen from the centre the face is turned round");
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
            assert_eq!(builtin::irregular_quad(n, seed).len(), n, "n = {n}, seed {seed}");
        }
    }
}

/// Seen in single flips: the two new triangles lie in faces of the same numbers as the old ones.
#[test]
fn flips_leave_each_triangle_an_eighth_of_the_quadrilateral() {
    let mut least: f64 = 1.0;
    let mut flips = 0;
    for seed in 0..40 {
        let mut mesh = builtin::icosahedron();
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        mesh.positions
            .iter_mut()
            .for_each(|p| *p += DVec3::from_array(std::array::from_fn(|_| rng.random_range(-0.6..0.6))));
        for attempt in 0..60 {
            let mut flipped = mesh.clone();
            flip_edges(&mut flipped, 1, 1000 * seed + attempt);
            let changed = mesh.faces.iter().zip(flipped.faces.iter()).filter(|(old, new)| old != new);
            let areas: Vec<DVec3> = changed
                .map(|(_, new)| {
                    let [a, b, c] = [0, 1, 2].map(|k| flipped.positions[new[k] as usize]);
                    (b - a).cross(c - a)
                })
                .collect();
            if let [a, b] = areas[..] {
                let whole = a + b;
                least = least.min(a.dot(whole).min(b.dot(whole)) / whole.length_squared());
                flips += 1;
            }
        }
    }
    // Many flips come near the limit, none goes beyond it.
    assert!(flips > 500, "{flips}");
    assert!((0.125..0.13).contains(&least), "{least}");
}
