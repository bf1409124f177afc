//! Kobbelt's interpolatory scheme on quads: the tensor product of the four-point scheme, and what it is at extraordinary vertices.

use glam::DVec3;
use limitlab::analysis::splitting::{LocalScheme, SplittingMatrix};
use limitlab::mesh::Surface;
use limitlab::mesh::builtin::builtin;
use limitlab::mesh::random::random_points;
use limitlab::schemes::Refinement;
use limitlab::schemes::kobbelt::{limit_normals, limit_tangents, refine, refined, refined_n, subdominant};

/// Random points on a built-in mesh, refined so often by Catmull-Clark's faces.
fn random(name: &str, splits: usize) -> Surface {
    let surface = Surface::new(builtin(name).unwrap()).unwrap();
    let surface = Refinement::CatmullClark.refined_n(&surface, splits).unwrap();
    let points = random_points(surface.len(), 7);
    surface.with_positions(points)
}

fn between([a, b, c, d]: [DVec3; 4]) -> DVec3 {
    (9.0 * (b + c) - a - d) / 16.0
}

#[test]
fn on_a_grid_it_is_the_tensor_product_of_the_four_point_scheme() {
    let (n, m) = (7usize, 9usize);
    let surface = random(&format!("torus:{n}x{m}"), 0);
    let fine = refine(&surface).unwrap();
    assert_eq!(fine.positions[..n * m], *surface.positions());
    let faces = Refinement::CatmullClark.refine(&surface).unwrap().faces;
    assert!(fine.faces == faces);
    // By columns, then by rows.
    let wrap = |k: i64, n: usize| k.rem_euclid(n as i64) as usize;
    let at = |i: i64, j: i64| surface.positions()[wrap(i, n) * m + wrap(j, m)];
    let column = |i: i64, j: i64| between([-1, 0, 1, 2].map(|k| at(i + k, j)));
    let row = |i: i64, j: i64| between([-1, 0, 1, 2].map(|k| at(i, j + k)));
    let both = |i: i64, j: i64| between([-1, 0, 1, 2].map(|k| column(i, j + k)));
    for (f, face) in surface.faces().iter().enumerate() {
        // The corners are (i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1).
        let (i, j) = ((face[0] as usize / m) as i64, (face[0] as usize % m) as i64);
        let new = |k: usize| fine.positions[faces.face(4 * f)[k] as usize];
        assert!(new(1).distance(column(i, j)) < 1e-15);
        assert!(new(3).distance(row(i, j)) < 1e-15);
        assert!(new(2).distance(both(i, j)) < 1e-15);
    }
}

#[test]
fn it_reproduces_cubics_along_both_directions() {
    let n = 16usize;
    let mut surface = random("torus:16x16", 0);
    let cubic = |x: f64, y: f64| DVec3::new(x, x * x * x * y.powi(3) - 3.0 * x * y * y, y * y - x.powi(3));
    for (v, p) in surface.positions_mut().iter_mut().enumerate() {
        *p = cubic((v / n) as f64 - 8.0, (v % n) as f64 - 8.0);
    }
    let fine = refine(&surface).unwrap();
    let faces = Refinement::CatmullClark.refine(&surface).unwrap().faces;
    let mut quartic_missed = false;
    for f in 0..surface.faces().len() {
        let corner = surface.faces().face(f)[0] as usize;
        let [x, y] = [corner / n, corner % n];
        if ![x, y].iter().all(|k| (3..12).contains(k)) {
            continue;
        }
        let [x, y] = [x as f64 - 8.0, y as f64 - 8.0];
        for (k, [dx, dy]) in [(1, [0.5, 0.0]), (2, [0.5, 0.5]), (3, [0.0, 0.5])] {
            let found = fine.positions[faces.face(4 * f)[k] as usize];
            assert!(found.distance(cubic(x + dx, y + dy)) < 1e-10, "face {f}");
        }
        let fourth = |x: f64| DVec3::splat(x.powi(4));
        quartic_missed |= between([-1.0, 0.0, 1.0, 2.0].map(|k| fourth(x + k))).distance(fourth(x + 0.5)) > 0.1;
    }
    assert!(quartic_missed);
}

#[test]
fn both_directions_across_a_face_agree_about_an_extraordinary_vertex_and_not_one_face_further() {
    for (name, splits) in [("cube", 2), ("bipyramid:7", 2), ("irregular-quad:40", 2)] {
        let surface = random(name, splits);
        let fine = refine(&surface).unwrap();
        // Quad c of the refined mesh is (vertex, edge leaving it, face, edge entering it).
        let new = |c: u32, k: usize| fine.positions[fine.faces.face(c as usize)[k] as usize];
        let next = |c: u32| surface.incidence().next(surface.faces(), c);
        let opposite = |c: u32| new(next(next(surface.topology().twin(c).unwrap())), 1);
        let is_regular = |&v: &u32| surface.incidence().face_count(v as usize) == 4;
        let mut apart = 0.0f64;
        for f in 0..surface.faces().len() as u32 {
            let along = |c: u32| {
                let other = next(next(c));
                between([opposite(c), new(c, 1), new(other, 1), opposite(other)])
            };
            let (off, found) = (along(4 * f).distance(along(4 * f + 1)), new(4 * f, 2));
            assert!((0.5 * (along(4 * f) + along(4 * f + 1))).distance(found) < 1e-15);
            if surface.faces().face(f as usize).iter().all(is_regular) {
                apart = apart.max(off);
            } else {
                assert!(off < 1e-14, "{name}, face {f}: {off:e}");
            }
        }
        assert!(apart > 1e-3, "{name}: {apart:e}");
    }
}

/// A left eigenvector turns a step into a factor; at valence 4 it is the derivative of the four-point scheme's limit.
#[test]
fn tangents_shrink_by_the_subdominant_eigenvalue() {
    for name in ["cube", "irregular-quad:60", "bipyramid:9"] {
        let surface = random(name, 1);
        let (coarse, fine) = (limit_tangents(&surface).unwrap(), limit_tangents(&refined(&surface).unwrap()).unwrap());
        for v in 0..surface.len() {
            let lambda = subdominant(surface.incidence().face_count(v));
            let off = (fine[v].cosine - lambda * coarse[v].cosine).length()
                + (fine[v].sine - lambda * coarse[v].sine).length();
            assert!(off < 1e-11, "{name}, vertex {v}: {off:e}");
        }
    }
    let surface = random("torus:8x8", 0);
    let fine = refined(&surface).unwrap();
    let tangents = limit_tangents(&surface).unwrap();
    let mut star = Vec::new();
    fine.topology().star(fine.faces(), 0, &mut star);
    let first = fine.incidence().corners_at(0)[0];
    assert_eq!(star[0], first, "the star begins at the first corner");
    let point = |c: u32| fine.positions()[fine.faces().corners()[c as usize] as usize];
    let next = |c: u32| fine.incidence().next(fine.faces(), c);
    let turned = |c: u32| fine.topology().counter_clockwise(fine.faces(), c).unwrap();
    let line = |c: u32| {
        let near = next(c);
        let far = next(turned(turned(fine.topology().twin(c).unwrap())));
        point(near) - point(far) / 8.0
    };
    assert!(tangents[0].cosine.distance(line(star[0]) - line(star[2])) < 1e-14);
    assert!(tangents[0].sine.distance(line(star[1]) - line(star[3])) < 1e-14);
}

#[test]
fn the_subdominant_eigenvalue_is_that_of_the_local_matrix() {
    for n in [3, 4, 5, 7, 12] {
        let matrix = SplittingMatrix::new(LocalScheme::Kobbelt, n).unwrap();
        assert!((matrix.leading_pair().unwrap() - subdominant(n)).abs() < 1e-12, "{n}");
        assert!(matrix.pair_leads().unwrap(), "{n}");
    }
    assert!((subdominant(4) - 0.5).abs() < 1e-14);
}

/// The normals of the faces about a vertex tend to those by masks, as fast as the ratio of two eigenvalues says.
#[test]
fn normals_are_those_of_the_limit() {
    let surface = Surface::new(builtin("irregular-quad:40").unwrap()).unwrap();
    let normals = limit_normals(&surface).unwrap();
    let off = |levels: usize| -> Vec<f64> {
        let fine = refined_n(&surface, levels).unwrap();
        let area = |v: usize| -> DVec3 {
            let faces = fine.incidence().corners_at(v).iter().map(|&c| fine.faces().face(fine.incidence().face_of(c)));
            let at = |face: &[u32], k: usize| fine.positions()[face[k] as usize];
            faces.map(|face| (at(face, 2) - at(face, 0)).cross(at(face, 3) - at(face, 1))).sum()
        };
        normals.iter().enumerate().map(|(v, normal)| area(v).normalize().distance(*normal)).collect()
    };
    for (v, (coarse, fine)) in off(2).into_iter().zip(off(5)).enumerate() {
        assert!(fine < 0.6 * coarse + 2e-3, "vertex {v}: {coarse} {fine}");
    }
}

#[test]
fn other_meshes_are_refused() {
    let refusal = |name: &str| refine(&Surface::new(builtin(name).unwrap()).unwrap()).unwrap_err().to_string();
    assert!(refusal("icosahedron").contains("takes quads"), "{}", refusal("icosahedron"));
    assert!(refusal("prism:5").contains("face"));
}
