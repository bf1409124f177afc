//! Labsik & Greiner's interpolatory √3 scheme: masks found a second way, polynomials, eigenvalues, the limit.

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use limitlab::analysis::splitting::{LocalScheme, SplittingMatrix};
use limitlab::mesh::Surface;
use limitlab::schemes::{Refinement, labsik_greiner};
use limitlab_factorizations::dense::small_svd;
use nalgebra::{DMatrix, DVector};

use super::ROUNDING;
use super::meshes::*;

/// The twelve points of the regular mask, for the triangle (0,0), (1,0), (0,1) of the lattice, in the order of
/// `REGULAR`: corners, opposite, next to those.
const STENCIL: [(usize, f64, f64); 12] = [
    (0, 0.0, 0.0),
    (0, 1.0, 0.0),
    (0, 0.0, 1.0),
    (1, 1.0, 1.0),
    (1, -1.0, 1.0),
    (1, 1.0, -1.0),
    (2, -1.0, 0.0),
    (2, 0.0, -1.0),
    (2, 2.0, -1.0),
    (2, 2.0, 0.0),
    (2, 0.0, 2.0),
    (2, -1.0, 2.0),
];

/// Monomials up to degree 3: ten conditions on three weights have one solution, the published weights.
#[test]
fn the_regular_mask_is_the_one_that_reproduces_cubics() {
    let exponents = (0..=3i32).flat_map(|d| (0..=d).map(move |i| (i, d - i)));
    let mut rows = Vec::new();
    let mut wanted = Vec::new();
    for (p, q) in exponents {
        let mut row = [0.0; 3];
        for (orbit, x, y) in STENCIL {
            row[orbit] += x.powi(p) * y.powi(q);
        }
        rows.extend(row);
        wanted.push((1.0f64 / 3.0).powi(p + q));
    }
    let system = DMatrix::from_row_slice(wanted.len(), 3, &rows);
    let wanted = DVector::from_vec(wanted);
    let svd = small_svd(system.clone());
    assert!(svd.singular_values.min() > 0.1, "one solution");
    let weights = svd.solve(&wanted, 1e-12).unwrap();
    assert!((&system * &weights - wanted).amax() < ROUNDING);
    for (w, published) in weights.iter().zip(labsik_greiner::REGULAR) {
        assert!((w - published).abs() < ROUNDING);
    }
}

/// The weights are found from the conditions by a linear solve: the blend of the ring, applied at the angles between
/// neighbours, has to give 1 on constants, μ on the first harmonic, μ² on the second and on the bowl (0 in the middle,
/// 1 on the ring), and 0 on the others.
#[test]
fn extraordinary_masks_follow_from_their_eigenvalues() {
    for n in 3..=40 {
        let mu = 2.0 / 3.0 * (PI / n as f64).cos();
        assert!((labsik_greiner::subdominant(n) - mu).abs() < 1e-15);
        let angle = |j: usize| TAU * j as f64 / n as f64;
        let between = PI / n as f64;
        let mut rows: Vec<Vec<f64>> = vec![vec![1.0; n + 1]];
        let mut wanted = vec![1.0];
        let mut bowl = vec![1.0; n + 1];
        bowl[0] = 0.0;
        rows.push(bowl);
        wanted.push(mu * mu);
        for k in 1..=n / 2 {
            // At n = 3 the second harmonic is the first.
            let eigenvalue = match k {
                1 => mu,
                2 => mu * mu,
                _ => 0.0,
            };
            for part in [f64::cos, f64::sin] {
                let wave = |j: usize| part(k as f64 * angle(j));
                rows.push([0.0].into_iter().chain((0..n).map(wave)).collect());
                wanted.push(eigenvalue * part(k as f64 * between));
            }
        }
        let system = DMatrix::from_fn(rows.len(), n + 1, |i, j| rows[i][j]);
        let weights = small_svd(system).solve(&DVector::from_vec(wanted), 1e-9).unwrap();
        let (center, ring) = labsik_greiner::extraordinary_mask(n);
        assert!((center - weights[0]).abs() < 1e-12, "{n}");
        for (j, w) in ring.iter().enumerate() {
            assert!((w - weights[j + 1]).abs() < 1e-12, "{n} {j}");
        }
        // Neighbours 0 and 1 are the triangle's own.
        for j in 0..n {
            assert!((ring[j] - ring[(n + 1 - j) % n]).abs() < 1e-15);
        }
    }
}

/// As another implementation of the paper (OpenMesh) lists them.
#[test]
fn masks_at_valence_3_and_4_as_listed_elsewhere() {
    let (center, ring) = labsik_greiner::extraordinary_mask(3);
    let expected = [4.0 / 27.0, 4.0 / 27.0, -5.0 / 27.0];
    assert!((center - 8.0 / 9.0).abs() < 1e-15);
    assert!(ring.iter().zip(expected).all(|(w, e)| (w - e).abs() < 1e-15));
    let (center, ring) = labsik_greiner::extraordinary_mask(4);
    let expected = [2.0 / 9.0, 2.0 / 9.0, -1.0 / 9.0, -1.0 / 9.0];
    assert!((center - 7.0 / 9.0).abs() < 1e-15);
    assert!(ring.iter().zip(expected).all(|(w, e)| (w - e).abs() < 1e-15));
}

/// At valence 6 the formula, which is not used there, reproduces quadratics on the lattice as the regular mask does.
#[test]
fn the_formula_continues_to_valence_6() {
    let (center, ring) = labsik_greiner::extraordinary_mask(6);
    let steps: [(f64, f64); 6] = [(1.0, 0.0), (0.0, 1.0), (-1.0, 1.0), (-1.0, 0.0), (0.0, -1.0), (1.0, -1.0)];
    for (p, q) in [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)] {
        let at = |(x, y): (f64, f64)| x.powi(p) * y.powi(q);
        let terms = ring.iter().zip(steps).map(|(w, step)| w * at(step));
        let found = center * at((0.0, 0.0)) + terms.sum::<f64>();
        assert!((found - at((1.0 / 3.0, 1.0 / 3.0))).abs() < 1e-15, "{p} {q}");
    }
}

fn neighbors(surface: &Surface, v: u32, w: u32) -> Vec<u32> {
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
            _ => return ring,
        }
    }
}

/// The vertex across side (v, w) of a face: found by looking at every face.
fn across(surface: &Surface, v: u32, w: u32) -> u32 {
    let found = surface
        .faces()
        .iter()
        .find_map(|face| (0..3).find_map(|i| (face[i] == w && face[(i + 1) % 3] == v).then(|| face[(i + 2) % 3])));
    found.unwrap()
}

#[test]
fn new_points_equal_their_masks() {
    let mut kinds = [0; 4];
    // Rings up to 16 neighbours and wider ones take different ways.
    let wide = [7, 8, 9, 15, 16, 17, 40].map(|k| scattered(bipyramid(k), k.into()));
    for surface in triangle_meshes().into_iter().chain(wide) {
        let fine = labsik_greiner::refine(&surface).unwrap();
        assert_eq!(&fine.positions[..surface.len()], surface.positions());
        let at = |v: u32| surface.positions()[v as usize];
        let is_regular = |v: u32| surface.incidence().face_count(v as usize) == 6;
        for (f, face) in surface.faces().iter().enumerate() {
            let irregular: Vec<usize> = (0..3).filter(|&i| !is_regular(face[i])).collect();
            kinds[irregular.len()] += 1;
            let expected = if irregular.is_empty() {
                let [corner, opposite, wing] = labsik_greiner::REGULAR;
                let mut sum = DVec3::ZERO;
                for i in 0..3 {
                    let (v, w) = (face[i], face[(i + 1) % 3]);
                    let tip = across(&surface, v, w);
                    sum += corner * at(v) + opposite * at(tip);
                    sum += wing * (at(across(&surface, v, tip)) + at(across(&surface, tip, w)));
                }
                sum
            } else {
                let blend = |&i: &usize| {
                    let ring = neighbors(&surface, face[i], face[(i + 1) % 3]);
                    let (center, weights) = labsik_greiner::extraordinary_mask(ring.len());
                    let terms = ring.iter().zip(weights).map(|(&u, w)| w * at(u));
                    center * at(face[i]) + terms.sum::<DVec3>()
                };
                irregular.iter().map(blend).sum::<DVec3>() / irregular.len() as f64
            };
            assert!((fine.positions[surface.len() + f] - expected).length() < ROUNDING);
        }
    }
    assert!(kinds.iter().all(|&count| count >= 8), "{kinds:?}");
}

/// After two steps a triangular lattice is a third as wide; a cubic stays a cubic.
#[test]
fn cubics_stay_on_the_regular_lattice() {
    let size = 12;
    let cubic = |i: f64, j: f64| {
        let (x, y) = (i / 8.0, j / 8.0);
        DVec3::new(
            1.0 + x - 2.0 * y,
            x * x - 3.0 * x * y + 0.5 * y * y,
            x * x * x - 2.0 * x * x * y + 0.7 * x * y * y + 1.3 * y * y * y,
        )
    };
    let plain = tri_torus(size, size);
    let lattice = |v: usize| ((v / size as usize) as f64, (v % size as usize) as f64);
    let mut surface = plain.clone();
    let mut parameters = plain;
    for v in 0..surface.len() {
        let (i, j) = lattice(v);
        surface.positions_mut()[v] = cubic(i, j);
        parameters.positions_mut()[v] = DVec3::new(i, j, 0.0);
    }
    let mut seen = 0;
    for steps in 1..=2 {
        let fine = Refinement::LabsikGreiner.refine_n(&surface, steps).unwrap();
        // Linear functions are reproduced, so the parameters tell where a new point belongs: away from the seam.
        let places = Refinement::LabsikGreiner.refine_n(&parameters, steps).unwrap();
        for (point, place) in fine.positions.iter().zip(&places.positions) {
            if place.min_element() < 0.0 || !(4.0..=7.0).contains(&place.x) || !(4.0..=7.0).contains(&place.y) {
                continue;
            }
            assert!((*point - cubic(place.x, place.y)).length() < ROUNDING);
            seen += 1;
        }
    }
    assert!(seen > 60, "{seen}");
}

/// On three rings, two steps: 1, μ², μ², and μ⁴ for the quadratics; the pair leads.
#[test]
fn the_local_matrix_has_the_eigenvalues_of_the_mask() {
    for n in (3..=20).chain([50]).filter(|&n| n != 6) {
        let matrix = SplittingMatrix::new(LocalScheme::LabsikGreiner, n).unwrap();
        let square = labsik_greiner::subdominant(n).powi(2);
        let modes = matrix.modes().unwrap();
        let own = |k: usize| -> Vec<f64> {
            let modes = modes.iter().filter(|m| m.frequency == k);
            modes.map(|m| m.value.norm()).collect()
        };
        assert!((own(0)[0] - 1.0).abs() < 1e-12);
        assert!((own(1)[0] - square).abs() < 1e-12, "{n}");
        let others = [own(0)[1], own(1)[1]].into_iter().chain((2..=n / 2).map(|k| own(k)[0]));
        for other in others {
            assert!(other < square - 1e-3, "{n} {other} {square}");
        }
        let has = |k: usize| {
            let near = |m: &f64| (m - square * square).abs() < 1e-9;
            own(k).iter().any(near)
        };
        assert!(has(0) && (n < 5 || has(2)), "{n}");
    }
    // Regular: 3^{−degree} as often as there are monomials, as cubics are reproduced, and nothing else up to the pair.
    let regular = SplittingMatrix::new(LocalScheme::LabsikGreiner, 6).unwrap();
    let values = regular.eigenvalues().unwrap();
    for degree in 0..=3 {
        let near = values.iter().filter(|z| (*z - 3f64.powi(-degree)).norm() < 1e-9);
        assert!(near.count() > degree as usize, "{degree}");
    }
    assert!(values[3].norm() < 0.2);
}

/// Both tangents lie in the left invariant subspace of the matrix, on three rings: seen by what the mesh's own unit
/// vectors give. A star of regular vertices, refined nowhere, in which two steps are one round.
#[test]
fn the_regular_tangent_mask_is_the_matrix_s() {
    let surface = tri_torus(14, 14);
    let matrix = SplittingMatrix::new(LocalScheme::LabsikGreiner, 6).unwrap();
    let space = matrix.eigenspaces().unwrap().into_iter().find(|s| (s.value - 1.0 / 3.0).norm() < 1e-9).unwrap();
    assert_eq!(space.multiplicity(), 2);
    let v = 14 * 7 + 7;
    let layout = LocalScheme::LabsikGreiner.layout();
    let star = layout.walk(&surface, surface.incidence().corners_at(v)[0], 6, 3).unwrap();
    // Random points: the plane of the tangents is that of the subspace's two sums.
    for seed in 0..5 {
        let surface = scattered(surface.clone(), seed);
        let normal = Refinement::LabsikGreiner.limit_normals(&surface).unwrap()[v];
        let sum = |k: usize| -> DVec3 {
            let terms = star.iter().enumerate();
            terms.map(|(i, &w)| space.left[(i, k)] * surface.positions()[w as usize]).sum()
        };
        let expected = sum(0).cross(sum(1)).normalize();
        assert!(normal.cross(expected).length() < 1e-10);
    }
}

/// Around every vertex of a mesh refined deep, the ring is an affine image of a regular polygon's: what is left of the
/// other modes shrinks by their eigenvalue.
#[test]
fn deep_rings_are_affine_images_of_the_characteristic_one() {
    let first_harmonic = |surface: &Surface, v: u32| {
        let mut star = Vec::new();
        surface.topology().star(surface.faces(), v as usize, &mut star);
        let corners = surface.faces().corners();
        let ring: Vec<DVec3> = star
            .iter()
            .map(|&c| {
                let next = if c % 3 == 2 { c - 2 } else { c + 1 };
                surface.positions()[corners[next as usize] as usize] - surface.positions()[v as usize]
            })
            .collect();
        let n = ring.len() as f64;
        let wave = |part: fn(f64) -> f64| -> DVec3 {
            let terms = ring.iter().enumerate();
            terms.map(|(j, p)| 2.0 / n * part(TAU * j as f64 / n) * *p).sum()
        };
        let (a, b) = (wave(f64::cos), wave(f64::sin));
        let size = (a.length_squared() + b.length_squared()).sqrt();
        let rest = ring.iter().enumerate().map(|(j, p)| {
            let angle = TAU * j as f64 / n;
            (*p - angle.cos() * a - angle.sin() * b).length() / size
        });
        rest.fold(0.0, f64::max)
    };
    for k in [3, 4, 5, 8] {
        let surface = scattered(bipyramid(k), 3);
        let levels = [4, 6].map(|l| Refinement::LabsikGreiner.refined_n(&surface, l).unwrap());
        // Apices have valence k.
        let [before, after] = levels.each_ref().map(|m| first_harmonic(m, k));
        let mu = labsik_greiner::subdominant(k as usize);
        assert!(after < 1.001 * mu * mu * before, "{k}: {before:e} {after:e}");
        assert!(before > 1e-3, "the test sees other modes");
    }
}
