//! The refinement steps: counts, topology, regular grids, affine maps, refused meshes, names.

use glam::{DMat3, DVec3};
use limitlab::mesh::validate::Boundary;
use limitlab::mesh::{Faces, Mesh, Surface};
use limitlab::schemes::{Class, Refinement, catmull_clark, doo_sabin, loop_scheme, sqrt3};

use super::ROUNDING;
use super::meshes::*;
use crate::common::meshes::random_points;

fn meshes_for(scheme: Refinement) -> Vec<Surface> {
    match scheme {
        Refinement::CatmullClark | Refinement::DooSabin | Refinement::MidEdge => polygon_meshes(),
        Refinement::Loop | Refinement::Sqrt3 | Refinement::Butterfly | Refinement::LabsikGreiner => triangle_meshes(),
    }
}

#[test]
fn test_meshes_are_as_irregular_as_claimed() {
    let sizes: Vec<usize> =
        polygon_meshes().iter().flat_map(|s| s.faces().iter().map(<[u32]>::len).collect::<Vec<_>>()).collect();
    let valences: Vec<usize> = triangle_meshes()
        .iter()
        .flat_map(|s| (0..s.len()).map(|v| s.incidence().face_count(v)).collect::<Vec<_>>())
        .collect();
    for k in 3..=12 {
        assert!(sizes.contains(&k) && valences.contains(&k), "{k}");
    }
    for surface in polygon_meshes() {
        let euler = surface.topology().euler_characteristic(surface.faces());
        assert_manifold(&surface, euler);
    }
}

#[test]
fn counts_and_topology_after_each_step() {
    for scheme in Refinement::ALL {
        for mut coarse in meshes_for(scheme) {
            for level in 1..=2 {
                let (v, e, f) = (coarse.len(), coarse.topology().edges(), coarse.faces().len());
                let c = coarse.faces().corners().len();
                let euler = coarse.topology().euler_characteristic(coarse.faces());
                let fine = Surface::new(scheme.refine(&coarse).unwrap()).unwrap();
                let expected = match scheme {
                    Refinement::CatmullClark => (v + e + f, c),
                    Refinement::Loop | Refinement::Butterfly => (v + e, 4 * f),
                    Refinement::DooSabin => (c, f + e + v),
                    Refinement::Sqrt3 | Refinement::LabsikGreiner => (v + f, c),
                    Refinement::MidEdge => (e, f + v),
                };
                assert_eq!((fine.len(), fine.faces().len()), expected, "{scheme} {level}");
                assert_manifold(&fine, euler);
                match scheme {
                    Refinement::CatmullClark => assert_eq!(fine.faces().uniform_size(), Some(4)),
                    Refinement::DooSabin | Refinement::MidEdge => {
                        assert!((0..fine.len()).all(|v| fine.incidence().face_count(v) == 4));
                    }
                    _ => assert_eq!(fine.faces().uniform_size(), Some(3)),
                }
                coarse = fine;
            }
        }
    }
}

#[test]
fn valences_of_old_vertices_stay() {
    for scheme in Refinement::ALL {
        if scheme.class() == Class::Dual {
            continue;
        }
        for surface in meshes_for(scheme) {
            let fine = Surface::new(scheme.refine_n(&surface, 1).unwrap()).unwrap();
            let (old, new) = (surface.incidence(), fine.incidence());
            for v in 0..surface.len() {
                assert_eq!(old.face_count(v), new.face_count(v), "{scheme}");
            }
        }
    }
}

#[test]
fn faces_are_numbered_as_documented() {
    // The tetrahedron's base [2, 1, 0] is face 0; face 1 is [0, 1, 3], across half-edge 1 (from 1 to 0).
    let surface = tetrahedron();
    let refine = |scheme: Refinement| scheme.refine_n(&surface, 1).unwrap().faces;
    assert_eq!(refine(Refinement::CatmullClark).face(1), [1, 4 + 1, 10, 4]);
    assert_eq!(refine(Refinement::Loop).face(0), [2, 4, 4 + 2]);
    assert_eq!(refine(Refinement::Loop).face(3), [4, 5, 6]);
    assert_eq!(refine(Refinement::Butterfly), refine(Refinement::Loop));
    assert_eq!(refine(Refinement::Sqrt3).face(1), [1, 4 + 1, 4]);
    assert_eq!(refine(Refinement::LabsikGreiner), refine(Refinement::Sqrt3));
    let doo_sabin = refine(Refinement::DooSabin);
    assert_eq!(doo_sabin.face(1), [3, 4, 5]);
    assert_eq!(doo_sabin.face(4 + 1), [2, 1, 4, 3]);
    // The face of vertex 3 is made of its three corners, the last of faces 1 to 3.
    let mut last = doo_sabin.face(4 + 6 + 3).to_vec();
    last.sort_unstable();
    assert_eq!(last, [5, 8, 11]);
    // The edges of the tetrahedron make an octahedron; face 0 has the edges of half-edges 0 to 2 in their order.
    let mid_edge = refine(Refinement::MidEdge);
    assert_eq!((mid_edge.len(), mid_edge.uniform_size()), (4 + 4, Some(3)));
    assert_eq!(mid_edge.face(0), [0, 1, 2]);
}

#[test]
fn affine_maps_commute_with_refinement() {
    let matrix = DMat3::from_cols_array(&[1.1, 0.2, -0.7, 0.4, -0.9, 0.3, 0.6, 0.5, 1.3]);
    let map = |p: &DVec3| matrix * *p + DVec3::new(3.0, -2.0, 1.0);
    for scheme in Refinement::ALL {
        for surface in meshes_for(scheme) {
            let mapped = surface.with_positions(surface.positions().iter().map(map).collect());
            let first = scheme.refine_n(&surface, 2).unwrap();
            let expected: Vec<DVec3> = first.positions.iter().map(map).collect();
            let found = scheme.refine_n(&mapped, 2).unwrap();
            assert!(distance(&found.positions, &expected) < ROUNDING, "{scheme}");
        }
    }
}

/// One step of uniform knot insertion along a cyclic sequence: masks for old points and for points between.
fn insert_knots(data: &[DVec3], even: [f64; 3], odd: [f64; 2]) -> Vec<DVec3> {
    let n = data.len();
    (0..n)
        .flat_map(|i| {
            let (before, here, after) = (data[(i + n - 1) % n], data[i], data[(i + 1) % n]);
            [even[0] * before + even[1] * here + even[2] * after, odd[0] * here + odd[1] * after]
        })
        .collect()
}

/// [`insert_knots`] along both directions of a torus grid.
fn insert_knots_on_torus(
    positions: &[DVec3],
    rows: usize,
    columns: usize,
    even: [f64; 3],
    odd: [f64; 2],
) -> Vec<Vec<DVec3>> {
    let wide: Vec<Vec<DVec3>> = positions.chunks(columns).map(|row| insert_knots(row, even, odd)).collect();
    let mut fine = vec![vec![DVec3::ZERO; 2 * columns]; 2 * rows];
    for j in 0..2 * columns {
        let column: Vec<DVec3> = wide.iter().map(|row| row[j]).collect();
        for (i, point) in insert_knots(&column, even, odd).into_iter().enumerate() {
            fine[i][j] = point;
        }
    }
    fine
}

#[test]
fn catmull_clark_on_a_regular_grid_is_cubic_knot_insertion() {
    let (rows, columns) = (5, 6);
    let surface = scattered(torus(5, 6), 3);
    let fine = catmull_clark::refine(&surface).unwrap();
    let expected = insert_knots_on_torus(surface.positions(), rows, columns, [0.125, 0.75, 0.125], [0.5, 0.5]);
    for i in 0..rows {
        for j in 0..columns {
            // The first corner's quad: (2i, 2j), next row, both, next column.
            let quad = fine.faces.face(4 * (i * columns + j));
            for (&v, (a, b)) in quad.iter().zip([(0, 0), (1, 0), (1, 1), (0, 1)]) {
                let difference = fine.positions[v as usize] - expected[2 * i + a][2 * j + b];
                assert!(difference.length() < ROUNDING);
            }
        }
    }
}

#[test]
fn doo_sabin_on_a_regular_grid_is_quadratic_knot_insertion() {
    let (rows, columns) = (5, 6);
    let surface = scattered(torus(5, 6), 4);
    let fine = doo_sabin::refine(&surface).unwrap();
    // Chaikin: (3 here + after)/4, then (here + 3 after)/4.
    let expected = insert_knots_on_torus(surface.positions(), rows, columns, [0.0, 0.75, 0.25], [0.25, 0.75]);
    for i in 0..rows {
        for j in 0..columns {
            let quad = fine.faces.face(i * columns + j);
            for (&v, (a, b)) in quad.iter().zip([(0, 0), (1, 0), (1, 1), (0, 1)]) {
                let difference = fine.positions[v as usize] - expected[2 * i + a][2 * j + b];
                assert!(difference.length() < ROUNDING);
            }
        }
    }
}

#[test]
fn steps_equal_their_masks_evaluated_face_by_face() {
    for surface in polygon_meshes() {
        let fine = catmull_clark::refine(&surface).unwrap();
        for v in 0..surface.len() {
            let star = star(&surface, v);
            let n = star.valence as f64;
            let expected = (n - 2.0) / n * surface.positions()[v] + (star.neighbors + star.centroids) / (n * n);
            assert!((fine.positions[v] - expected).length() < ROUNDING);
        }
        for rule in [doo_sabin::CornerRule::DooSabin, doo_sabin::CornerRule::ZhengCai] {
            let points = doo_sabin::corner_points(surface.mesh(), rule);
            for (f, face) in surface.faces().iter().enumerate() {
                let m = face.len();
                let weights = rule.circulant(m);
                for (i, c) in surface.faces().range(f).enumerate() {
                    let terms = face.iter().enumerate();
                    let expected: DVec3 =
                        terms.map(|(j, &v)| weights[(m + j - i) % m] * surface.positions()[v as usize]).sum();
                    assert!((points[c] - expected).length() < ROUNDING);
                }
            }
        }
    }
    for surface in triangle_meshes() {
        let looped = loop_scheme::refine(&surface).unwrap();
        let flipped = sqrt3::refine(&surface).unwrap();
        for v in 0..surface.len() {
            let star = star(&surface, v);
            for (fine, [a, b]) in
                [(&looped, loop_scheme::vertex_mask(star.valence)), (&flipped, sqrt3::vertex_mask(star.valence))]
            {
                let expected = a * surface.positions()[v] + b * star.neighbors;
                assert!((fine.positions[v] - expected).length() < ROUNDING);
            }
        }
        for (f, face) in surface.faces().iter().enumerate() {
            let points: Vec<DVec3> = face.iter().map(|&v| surface.positions()[v as usize]).collect();
            let third = (points[0] + points[1] + points[2]) / 3.0;
            assert!((flipped.positions[surface.len() + f] - third).length() < ROUNDING);
        }
        // The middle triangle of face f holds the points of its edges; each is ⅜, ⅜, ⅛, ⅛.
        for (f, face) in surface.faces().iter().enumerate() {
            for (i, &e) in looped.faces.face(4 * f + 3).iter().enumerate() {
                let (v, w) = (face[i], face[(i + 1) % 3]);
                let mut expected = 0.375 * (surface.positions()[v as usize] + surface.positions()[w as usize]);
                for other in surface.faces().iter() {
                    let forward = (0..3).find(|&k| (other[k], other[(k + 1) % 3]) == (v, w));
                    let backward = (0..3).find(|&k| (other[k], other[(k + 1) % 3]) == (w, v));
                    if let Some(k) = forward.or(backward) {
                        expected += 0.125 * surface.positions()[other[(k + 2) % 3] as usize];
                    }
                }
                assert!((looped.positions[e as usize] - expected).length() < ROUNDING);
            }
        }
    }
}

#[test]
fn published_weights() {
    let near = |a: &[f64], b: &[f64]| a.len() == b.len() && a.iter().zip(b).all(|(x, y)| (x - y).abs() < 1e-14);
    let doo_sabin = doo_sabin::CornerRule::DooSabin;
    assert!(near(&doo_sabin.circulant(4), &[9. / 16., 3. / 16., 1. / 16., 3. / 16.]));
    assert!(near(&doo_sabin.circulant(3), &[2. / 3., 1. / 6., 1. / 6.]));
    assert!(near(&loop_scheme::vertex_mask(6), &[5. / 8., 1. / 16.]));
    assert!(near(&loop_scheme::vertex_mask(3), &[7. / 16., 3. / 16.]));
    assert!(near(&loop_scheme::limit_mask(6), &[0.5, 1. / 12.]));
    assert!(near(&loop_scheme::limit_mask(3), &[0.4, 0.2]));
    assert!(near(&sqrt3::vertex_mask(6), &[2. / 3., 1. / 18.]));
    assert!(near(&sqrt3::vertex_mask(3), &[4. / 9., 5. / 27.]));
    assert!(near(&sqrt3::limit_mask(6), &[0.5, 1. / 12.]));
    assert!(near(&catmull_clark::limit_mask(4), &[4. / 9., 1. / 9., 1. / 36.]));
    assert!(near(&catmull_clark::limit_mask(3), &[3. / 8., 1. / 6., 1. / 24.]));
    for n in 3..40 {
        let [a, b] = loop_scheme::limit_mask(n);
        let [c, d] = sqrt3::limit_mask(n);
        let [v, e, f] = catmull_clark::limit_mask(n);
        let size = n as f64;
        assert!(near(&[a + size * b, c + size * d, v + size * (e + f)], &[1.0; 3]));
        let sums = [doo_sabin, doo_sabin::CornerRule::ZhengCai].map(|r| r.circulant(n).iter().sum());
        assert!(near(&sums, &[1.0; 2]), "{sums:?}");
    }
}

#[test]
fn meshes_that_cannot_be_refined_are_refused_with_their_place() {
    let message = |scheme: Refinement, surface: &Surface| {
        let text = scheme.refine(surface).unwrap_err().to_string();
        assert!(!text.contains('\n'));
        text
    };
    let mut open = tetrahedron().into_mesh();
    open.faces = Faces::from_lists(open.faces.iter().take(3));
    let open = Surface::examined(open, None, Boundary::AsInterior).unwrap();
    for scheme in Refinement::ALL {
        assert!(message(scheme, &open).contains("3 boundary edges"));
    }
    for scheme in [Refinement::Loop, Refinement::Sqrt3, Refinement::Butterfly, Refinement::LabsikGreiner] {
        let text = message(scheme, &pyramid(5));
        assert!(text.contains("face 0 has 5 corners") && text.contains(scheme.name()));
    }
}

#[test]
fn meshes_with_defects_are_no_surfaces() {
    let mut lonely = tetrahedron().into_mesh();
    lonely.positions.push(DVec3::X);
    let mut turned = tetrahedron().into_mesh();
    turned.faces.corners_mut().swap(0, 1);
    let digon = Mesh::new(vec![DVec3::ZERO, DVec3::X], Faces::from_lists([[0, 1]]));
    // Two tetrahedra that share vertex 3.
    let mut faces = tetrahedron().faces().clone();
    for face in tetrahedron().faces().iter() {
        faces.push(&[0, 1, 2].map(|i| if face[i] == 3 { 3 } else { face[i] + 4 }));
    }
    let pinched = Mesh::new(random_points(7, 1), faces);
    let pillow = Mesh::new(vec![DVec3::ZERO, DVec3::X, DVec3::Y], Faces::from_lists([[0, 1, 2], [0, 2, 1]]));
    for (mesh, told) in [
        (lonely, "isolated vertex (vertex 4)"),
        (turned, "3 edges with two faces in the same direction"),
        (digon, "face with fewer than three corners (face 0, corners: 2)"),
        (pinched, "non-manifold vertex (vertex 3, 2 umbrellas)"),
        (pillow, "3 vertices of valence below three (first: vertex 0, valence 2)"),
    ] {
        let text = Surface::new(mesh).unwrap_err().to_string();
        assert!(text.contains(told) && !text.contains('\n'), "{text}");
    }
}

#[test]
fn refine_n_repeats_the_step() {
    let surface = stacked(5, 12);
    for scheme in Refinement::ALL {
        assert_eq!(scheme.refine_n(&surface, 0).unwrap(), *surface.mesh());
        let once = Surface::new(scheme.refine(&surface).unwrap()).unwrap();
        let twice = scheme.refine(&once).unwrap();
        assert_eq!(scheme.refine_n(&surface, 2).unwrap(), twice);
        assert_eq!(*scheme.refined_n(&surface, 2).unwrap().mesh(), twice);
    }
}

#[test]
fn names_read_back_and_unknown_ones_list_all() {
    for scheme in Refinement::ALL {
        assert_eq!(scheme.to_string().parse::<Refinement>().unwrap(), scheme);
    }
    let text = "catmull".parse::<Refinement>().unwrap_err().to_string();
    for scheme in Refinement::ALL {
        assert!(text.contains(scheme.name()));
    }
}

/// Thall Eq. 22: the old vertices from their new neighbours alone.
#[test]
fn catmull_clark_in_place_is_the_usual_step() {
    for surface in polygon_meshes() {
        let usual = catmull_clark::refine(&surface).unwrap();
        let in_place = catmull_clark::refine_in_place(surface).unwrap();
        assert_eq!(in_place.faces, usual.faces);
        assert!(distance(&in_place.positions, &usual.positions) < ROUNDING);
    }
}
