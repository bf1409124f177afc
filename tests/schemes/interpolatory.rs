//! The schemes that keep their vertices: modified Butterfly, and Lin-Luo's unified √3 at α = 1.

use std::f64::consts::TAU;

use chacha20::ChaCha8Rng;
use glam::DVec3;
use limitlab::mesh::Surface;
use limitlab::schemes::{Refinement, butterfly, labsik_greiner, sqrt3, unified_sqrt3};
use rand::{RngExt, SeedableRng};

use super::ROUNDING;
use super::meshes::*;

#[test]
fn butterfly_keeps_its_vertices() {
    for surface in triangle_meshes() {
        let fine = Refinement::Butterfly.refine_n(&surface, 3).unwrap();
        assert_eq!(&fine.positions[..surface.len()], surface.positions());
    }
}

#[test]
fn butterfly_masks_are_the_published_ones() {
    let near = |n: usize, expected: &[f64]| {
        let mask = butterfly::extraordinary_mask(n);
        mask.len() == n && mask.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-15)
    };
    assert!(near(3, &[5.0 / 12.0, -1.0 / 12.0, -1.0 / 12.0]));
    assert!(near(4, &[3.0 / 8.0, 0.0, -1.0 / 8.0, 0.0]));
    for n in 5..30 {
        let angle = |j: usize| TAU * j as f64 / n as f64;
        let published: Vec<f64> =
            (0..n).map(|j| (0.25 + angle(j).cos() + 0.5 * (2.0 * angle(j)).cos()) / n as f64).collect();
        assert!(near(n, &published));
    }
    for n in 3..30 {
        let mask = butterfly::extraordinary_mask(n);
        let harmonic = |k: usize| {
            let terms = mask.iter().enumerate();
            terms.map(|(j, s)| s * (TAU * (j * k) as f64 / n as f64).cos()).sum::<f64>()
        };
        // The mask is affine, and the ring of edge points has the first harmonic of the ring, halved.
        assert!((butterfly::CENTER + harmonic(0) - 1.0).abs() < 1e-14);
        assert!((harmonic(1) - 0.5).abs() < 1e-14);
    }
    // On a planar regular star the valence-6 mask is that of the regular stencil: both keep a plane.
    let [end, opposite, wing] = butterfly::REGULAR;
    assert_eq!(2.0 * end + 2.0 * opposite + 4.0 * wing, 1.0);
}

/// The weighted mean of the ring around v in counter-clockwise order, starting at w, found by matching sides.
fn extraordinary_point(surface: &Surface, v: u32, w: u32) -> DVec3 {
    let mut ring = vec![w];
    loop {
        let last = ring[ring.len() - 1];
        let next = surface.faces().iter().find_map(|face| {
            (0..3).find_map(|i| {
                let (a, b, c) = (face[i], face[(i + 1) % 3], face[(i + 2) % 3]);
                (a == v && b == last).then_some(c)
            })
        });
        match next {
            Some(next) if next != w => ring.push(next),
            _ => break,
        }
    }
    let mask = butterfly::extraordinary_mask(ring.len());
    let terms = ring.iter().zip(mask);
    let sum: DVec3 = terms.map(|(&u, s)| s * surface.positions()[u as usize]).sum();
    butterfly::CENTER * surface.positions()[v as usize] + sum
}

#[test]
fn butterfly_edge_points_equal_their_masks() {
    let mut kinds = [0; 3];
    // Rings up to 16 neighbours and wider ones take different ways.
    let wide = [7, 8, 9, 15, 16, 17, 40].map(|k| scattered(bipyramid(k), k.into()));
    for surface in triangle_meshes().into_iter().chain(wide) {
        let fine = butterfly::refine(&surface).unwrap();
        let regular = |v: u32| surface.incidence().face_count(v as usize) == 6;
        for (f, face) in surface.faces().iter().enumerate() {
            for (i, &e) in fine.faces.face(4 * f + 3).iter().enumerate() {
                let (v, w) = (face[i], face[(i + 1) % 3]);
                let expected = match (regular(v), regular(w)) {
                    (false, false) => 0.5 * (extraordinary_point(&surface, v, w) + extraordinary_point(&surface, w, v)),
                    (false, true) => extraordinary_point(&surface, v, w),
                    (true, false) => extraordinary_point(&surface, w, v),
                    // Next test.
                    (true, true) => {
                        kinds[0] += 1;
                        continue;
                    }
                };
                kinds[if regular(v) == regular(w) { 2 } else { 1 }] += 1;
                assert!((fine.positions[e as usize] - expected).length() < ROUNDING);
            }
        }
    }
    assert!(kinds.iter().all(|&count| count > 20), "{kinds:?}");
}

/// A polynomial surface over the lattice coordinates (i, j) of a vertex of a torus grid, which is smooth away
/// from the seam where the coordinates wrap.
fn cubic(i: f64, j: f64) -> DVec3 {
    let (x, y) = (i / 8.0, j / 8.0);
    DVec3::new(
        1.0 + x - 2.0 * y,
        x * x - 3.0 * x * y + 0.5 * y * y,
        x * x * x - 2.0 * x * x * y + 0.7 * x * y * y + 1.3 * y * y * y,
    )
}

#[test]
fn butterfly_reproduces_cubics_on_the_regular_lattice() {
    let size = 9;
    let mut surface = tri_torus(size, size);
    for (v, p) in surface.positions_mut().iter_mut().enumerate() {
        *p = cubic((v / 9) as f64, (v % 9) as f64);
    }
    let fine = Refinement::Butterfly.refine_n(&surface, 1).unwrap();
    let mut seen = 0;
    for (f, face) in surface.faces().iter().enumerate() {
        for (i, &e) in fine.faces.face(4 * f + 3).iter().enumerate() {
            let lattice = |v: u32| ((v / size) as f64, (v % size) as f64);
            let (v, w) = (lattice(face[i]), lattice(face[(i + 1) % 3]));
            // Away from the seam by more than the stencil's reach.
            if [v.0, v.1, w.0, w.1].iter().any(|x| !(2.0..=6.0).contains(x)) {
                continue;
            }
            let expected = cubic(0.5 * (v.0 + w.0), 0.5 * (v.1 + w.1));
            assert!((fine.positions[e as usize] - expected).length() < ROUNDING);
            seen += 1;
        }
    }
    assert!(seen > 50);
}

/// The masks of regular vertices are the derivative of what the schemes reproduce: cubics, on a lattice large enough.
#[test]
fn regular_tangents_are_the_derivatives_of_cubics() {
    let size = 12usize;
    let lattice = |v: usize| ((v / size) as f64, (v % size) as f64);
    let mut surface = tri_torus(12, 12);
    for v in 0..surface.len() {
        let (i, j) = lattice(v);
        surface.positions_mut()[v] = cubic(i, j);
    }
    let found = [butterfly::limit_tangents(&surface).unwrap(), labsik_greiner::limit_tangents(&surface).unwrap()];
    for tangents in found {
        // One mask for all vertices, so the ratios of the lengths are known once one of them is.
        let mut scale = None;
        for v in (0..surface.len()).filter(|&v| {
            let (i, j) = lattice(v);
            (4.0..=7.0).contains(&i) && (4.0..=7.0).contains(&j)
        }) {
            let (i, j) = lattice(v);
            let h = 1e-3;
            // A central difference of a cubic errs by h² times its third derivative.
            let along = |a: f64, b: f64| {
                let difference = cubic(i + h * a, j + h * b) - cubic(i - h * a, j - h * b);
                difference / (2.0 * h)
            };
            let expected = along(1.0, 0.0).cross(along(0.0, 1.0));
            let cross = tangents[v].cosine.cross(tangents[v].sine);
            let ratio = *scale.get_or_insert(cross.length() / expected.length());
            assert!((cross / ratio).distance(expected) < 1e-6 * expected.length(), "{v}");
        }
    }
}

#[test]
fn unified_sqrt3_ends_at_the_approximating_and_the_interpolating_scheme() {
    for surface in triangle_meshes() {
        let (fine, alpha) = unified_sqrt3::refine(&surface, &vec![0.0; surface.len()]).unwrap();
        let kobbelt = sqrt3::refine(&surface).unwrap();
        assert!(distance(&fine.positions, &kobbelt.positions) < ROUNDING);
        assert_eq!(fine.faces, kobbelt.faces);
        assert_eq!(alpha, vec![0.0; fine.len()]);
        let (fine, alpha) = unified_sqrt3::refine(&surface, &vec![1.0; surface.len()]).unwrap();
        assert_eq!(&fine.positions[..surface.len()], surface.positions());
        assert!(alpha.iter().all(|a| (a - 1.0).abs() < 1e-15));
    }
}

/// The printed expanded forms: Eq. 10 in Eq. 8, the second line of Eq. 11, Eq. 7.
#[test]
fn unified_sqrt3_equals_the_papers_formulas() {
    let mut rng = ChaCha8Rng::seed_from_u64(31);
    for surface in triangle_meshes() {
        let alpha: Vec<f64> = (0..surface.len()).map(|_| rng.random_range(0.0..2.0)).collect();
        let (fine, refined) = unified_sqrt3::refine(&surface, &alpha).unwrap();
        let mut shares = Vec::new();
        for (v, &a) in alpha.iter().enumerate() {
            let star = star(&surface, v);
            let cosine = (TAU / star.valence as f64).cos();
            let mean = star.neighbors / star.valence as f64;
            let point = surface.positions()[v];
            shares.push((9.0 + 4.0 * a - 2.0 * a * cosine) / 27.0 * point - (4.0 * a - 2.0 * a * cosine) / 27.0 * mean);
            let moved = (5.0 + 4.0 * a + 2.0 * (1.0 - a) * cosine) / 9.0 * point
                + (1.0 - a) * (4.0 - 2.0 * cosine) / 9.0 * mean;
            assert!((fine.positions[v] - moved).length() < ROUNDING);
        }
        for (f, face) in surface.faces().iter().enumerate() {
            let new = surface.len() + f;
            let expected: DVec3 = face.iter().map(|&v| shares[v as usize]).sum();
            assert!((fine.positions[new] - expected).length() < ROUNDING);
            let mean = face.iter().map(|&v| alpha[v as usize]).sum::<f64>() / 3.0;
            assert!((refined[new] - mean).abs() < 1e-15);
        }
        assert_eq!(refined[..surface.len()], alpha);
    }
}

#[test]
fn unified_sqrt3_keeps_planes_and_refuses_parameters_without_meaning() {
    let mut surface = tri_torus(8, 8);
    for (v, p) in surface.positions_mut().iter_mut().enumerate() {
        *p = DVec3::new((v / 8) as f64, (v % 8) as f64, 0.0);
    }
    let alpha: Vec<f64> = (0..64).map(|v| f64::from(v) / 32.0).collect();
    let (fine, _) = unified_sqrt3::refine(&surface, &alpha).unwrap();
    // Away from the seam the lattice's stars are symmetric: a point stays, and the new one is the centroid.
    for v in (8..56).filter(|v| (1..7).contains(&(v % 8))) {
        assert!((fine.positions[v] - surface.positions()[v]).length() < ROUNDING);
    }
    for bad in [-0.01, 2.01, f64::NAN, f64::INFINITY] {
        let mut alpha = alpha.clone();
        alpha[5] = bad;
        let error = unified_sqrt3::refine(&surface, &alpha).unwrap_err();
        assert!(error.to_string().contains("at vertex 5"));
    }
    let quads = torus(3, 3);
    let error = unified_sqrt3::refine(&quads, &[1.0; 9]).unwrap_err();
    assert!(error.to_string().contains("face 0 has 4 corners"));
}
