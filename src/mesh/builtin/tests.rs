use super::*;
use crate::mesh::validate::{Boundary, validate};

/// Six times the signed volume: positive if the faces are counter-clockwise seen from outside.
fn volume(mesh: &Mesh) -> f64 {
    let p = |v: u32| mesh.positions[v as usize];
    mesh.faces
        .iter()
        .map(|f| {
            let fan = f[1..].windows(2).map(|w| p(w[0]).cross(p(w[1])));
            p(f[0]).dot(fan.sum())
        })
        .sum()
}

#[test]
fn every_mesh_is_valid_and_outward_with_the_promised_counts() {
    // Vertices, faces, V − E + F, least and greatest valence.
    for (name, v, f, euler, min, max) in [
        ("cube", 8, 6, 2, 3, 3),
        ("tetrahedron", 4, 4, 2, 3, 3),
        ("octahedron", 6, 8, 2, 4, 4),
        ("icosahedron", 12, 20, 2, 5, 5),
        ("dodecahedron", 20, 12, 2, 3, 3),
        ("truncated-octahedron", 24, 14, 2, 3, 3),
        ("prism:3", 6, 5, 2, 3, 3),
        ("prism:1000", 2000, 1002, 2, 3, 3),
        ("bipyramid:3", 5, 6, 2, 3, 4),
        ("bipyramid:9", 11, 18, 2, 4, 9),
        ("star:3", 50, 96, 2, 3, 6),
        ("star:17", 274, 544, 2, 4, 17),
        ("torus:3x3", 9, 9, 0, 4, 4),
        ("torus:7x4", 28, 28, 0, 4, 4),
        ("tri-torus:3x3", 9, 18, 0, 6, 6),
        ("tri-torus:5x8", 40, 80, 0, 6, 6),
        ("icosphere:0", 12, 20, 2, 5, 5),
        ("icosphere:3", 642, 1280, 2, 5, 6),
        ("quad-sphere:0", 8, 6, 2, 3, 3),
        ("quad-sphere:4", 1538, 1536, 2, 3, 4),
        ("cubes:5", 40, 30, 10, 3, 3),
    ] {
        let mesh = builtin(name).unwrap();
        let report = validate(&mesh, None, Boundary::Refuse);
        assert!(report.is_valid(), "{name}: {}", report.summary_line());
        assert!(report.remarks.is_empty(), "{name}: {:?}", report.remarks);
        let c = report.counts.unwrap();
        let found = (c.vertices, c.faces, c.euler_characteristic, c.min_valence, c.max_valence);
        assert_eq!(found, (v, f, euler, min, max), "{name}");
        assert_eq!(c.components, if name == "cubes:5" { 5 } else { 1 }, "{name}");
        assert!(volume(&mesh) > 0.0, "{name}");
    }
}

#[test]
fn volumes_are_the_known_ones() {
    let golden = (1.0 + 5f64.sqrt()) / 2.0;
    // Circumradius 1: the edge of the icosahedron is 1/sin 72°, of the dodecahedron 2/(√3 φ).
    let icosahedron_edge = 1.0 / (TAU / 5.0).sin();
    let dodecahedron_edge = 2.0 / (3f64.sqrt() * golden);
    for (name, expected) in [
        ("cube", 8.0),
        ("tetrahedron", 8.0 / 3.0),
        ("octahedron", 4.0 / 3.0),
        ("icosahedron", 5.0 / 12.0 * (3.0 + 5f64.sqrt()) * icosahedron_edge.powi(3)),
        ("dodecahedron", (15.0 + 7.0 * 5f64.sqrt()) / 4.0 * dodecahedron_edge.powi(3)),
        // Edge √2.
        ("truncated-octahedron", 8.0 * 2f64.sqrt() * 2f64.sqrt().powi(3)),
        ("prism:4", 4.0),
        ("bipyramid:6", 3f64.sqrt()),
        ("cubes:3", 24.0),
    ] {
        let found = volume(&builtin(name).unwrap()) / 6.0;
        assert!((found - expected).abs() < 1e-14 * expected, "{name}: {found} {expected}");
    }
    // Fine meshes approach the sphere, 4π/3, and the torus of radii 2 and 1, 4π², quadratically.
    for (coarse, fine, limit) in [
        ("icosphere:3", "icosphere:4", TAU * 2.0 / 3.0),
        ("quad-sphere:4", "quad-sphere:5", TAU * 2.0 / 3.0),
        ("torus:32x16", "torus:64x32", TAU * TAU),
        ("tri-torus:32x16", "tri-torus:64x32", TAU * TAU),
    ] {
        let error = |name| limit - volume(&builtin(name).unwrap()) / 6.0;
        let ratio = error(coarse) / error(fine);
        assert!((3.8..4.2).contains(&ratio), "{coarse}: {ratio}");
    }
}

#[test]
fn spheres_and_stars_lie_on_the_unit_sphere() {
    for name in ["icosahedron", "dodecahedron", "icosphere:3", "quad-sphere:3", "star:8", "irregular-tri:300"] {
        for p in builtin(name).unwrap().positions {
            assert!((p.length() - 1.0).abs() < 4.0 * f64::EPSILON, "{name}");
        }
    }
}

#[test]
fn grids_are_numbered_row_by_row() {
    let (n, m) = (6, 5);
    for (mesh, diagonal) in [(torus(n, m), false), (tri_torus(n, m), true)] {
        let topology = Topology::new(&mesh.faces, mesh.len());
        for c in topology.edge_sides() {
            let range = mesh.faces.range(topology.incidence.face_of(c));
            let [a, b] = [c, next_in(&range, c)].map(|c| mesh.faces.corners()[c as usize] as usize);
            let step = ((b / m + n - a / m) % n, (b % m + m - a % m) % m);
            let back = ((n - step.0) % n, (m - step.1) % m);
            let allowed = [(1, 0), (0, 1), (1, 1)];
            let allowed = &allowed[..if diagonal { 3 } else { 2 }];
            assert!(allowed.contains(&step) || allowed.contains(&back), "{step:?}");
        }
    }
}

#[test]
fn a_star_has_its_valences_where_they_are_promised() {
    let k = 11;
    let mesh = star(k);
    let topology = Topology::new(&mesh.faces, mesh.len());
    for v in 0..mesh.len() {
        let expected = match v {
            v if v < k => 4,
            v if v < k + 2 => k,
            _ => 6,
        };
        assert_eq!(topology.edge_valence(&mesh.faces, v), expected);
    }
}

#[test]
fn irregular_meshes_have_exactly_the_vertices_asked_for() {
    for n in (5..120).chain([1000, 4321]) {
        for seed in 0..3 {
            for kind in ["tri", "poly", "quad"] {
                if kind == "quad" && (n % 2 == 1 || n < 26) {
                    continue;
                }
                let name = format!("irregular-{kind}:{n}:{seed}");
                let mesh = builtin(&name).unwrap();
                assert_eq!(mesh.len(), n, "{name}");
                let report = validate(&mesh, None, Boundary::Refuse);
                assert!(report.is_valid(), "{name}: {}", report.summary_line());
                let c = report.counts.unwrap();
                assert_eq!((c.components, c.euler_characteristic), (1, 2), "{name}");
                let size = mesh.faces.uniform_size();
                match kind {
                    "tri" => assert_eq!(size, Some(3)),
                    "quad" => assert_eq!(size, Some(4)),
                    _ => assert!(mesh.faces.iter().all(|f| f.len() <= 8)),
                }
            }
        }
    }
    // Irregular indeed, and different for every seed.
    let counts = |name: &str| {
        let report = validate(&builtin(name).unwrap(), None, Boundary::Refuse);
        report.counts.unwrap()
    };
    assert!(counts("irregular-tri:2000").max_valence > 8);
    assert_eq!(counts("irregular-tri:2000").min_valence, 3);
    assert_eq!(builtin("irregular-tri:200").unwrap(), builtin("irregular-tri:200:1").unwrap());
    assert_ne!(builtin("irregular-tri:200").unwrap(), builtin("irregular-tri:200:2").unwrap());
    let sizes = builtin("irregular-poly:2000").unwrap();
    for n in 3..=8 {
        assert!(sizes.faces.iter().any(|f| f.len() == n), "{n}-gons");
    }
}

#[test]
fn wrong_names_and_parameters_say_what_is_right() {
    let error = |name: &str| builtin(name).unwrap_err().to_string();
    for (pattern, _) in NAMES {
        assert!(error("cbue").contains(pattern));
    }
    for (name, part) in [
        ("cube:3", "takes no parameter"),
        ("prism", "write prism:K"),
        ("prism:2", "from 3 to 11184810"),
        ("prism:x", "K is `x`"),
        ("torus:8", "write torus:NxM"),
        ("torus:2x5", "N is `2`"),
        ("torus:5x", "M is ``"),
        ("torus:5000x5000", "N times M must not exceed 16777216"),
        ("icosphere:11", "from 0 to 10"),
        ("icosphere:-1", "K is `-1`"),
        ("icosphere:99999999999999999999", "from 0 to 10"),
        ("quad-sphere:11", "from 0 to 10"),
        ("cubes:0", "from 1"),
        ("irregular-tri:4", "from 5"),
        ("irregular-quad:27", "even"),
        ("irregular-quad:24", "from 26"),
        ("irregular-tri:50:x", "SEED"),
        ("irregular-tri:50:1:2", "SEED"),
        ("", "built-in are cube,"),
    ] {
        let message = error(name);
        assert!(message.contains(part), "{name}: {message}");
        assert!(!message.contains('\n'));
    }
}

#[test]
fn every_listed_name_can_be_built() {
    for (pattern, _) in NAMES {
        let name = (pattern.split('[').next().unwrap()).replace("NxM", "4x5").replace(":N", ":30").replace(":K", ":3");
        assert_eq!(builtin(&name).unwrap(), builtin(&name.to_uppercase()).unwrap(), "{name}");
    }
}
