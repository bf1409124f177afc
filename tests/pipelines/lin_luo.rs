//! Lin-Luo's unified schemes for curves and surfaces.

use std::f64::consts::TAU;

use glam::DVec3;
use limitlab::interpolate::lin_luo::curve::{self, Ends};
use limitlab::interpolate::lin_luo::surface::{choose, largest_fold, popping, refine_n, volume};
use limitlab::mesh::{Mesh, Surface, builtin};
use limitlab::schemes::{Refinement, sqrt3};

use crate::common::pipelines::{ROUNDING, distance, noisy_surface};

fn polygon(n: usize) -> Vec<DVec3> {
    let point = |i: usize| {
        let i = i as f64;
        DVec3::new((2.3 * i).sin() + i, (1.7 * i).cos() * 3.0, (0.9 * i * i).sin())
    };
    (0..n).map(point).collect()
}

/// The two ends (§3), by their own definitions.
#[test]
fn curve_ends_are_the_four_point_scheme_and_the_cubic_spline() {
    let p = polygon(9);
    let at = |i: usize| p[i % 9];
    let (four_point, _) = curve::refine(&p, &[0.0; 9], Ends::Closed);
    let (spline, _) = curve::refine(&p, &[1.0; 9], Ends::Closed);
    for i in 0..9 {
        let (a, b, c, d) = (at(i + 8), at(i), at(i + 1), at(i + 2));
        assert_eq!(four_point[2 * i], b);
        assert!(four_point[2 * i + 1].distance((9.0 * (b + c) - a - d) / 16.0) < ROUNDING);
        assert!(spline[2 * i].distance((a + 6.0 * b + c) / 8.0) < ROUNDING);
        assert!(spline[2 * i + 1].distance((b + c) / 2.0) < ROUNDING);
        // Eq. 3: the four-point point is the midpoint less the mean of the spline's displacements.
        let delta = |i: usize| spline[2 * (i % 9)] - at(i);
        let from_spline = (b + c) / 2.0 - (delta(i) + delta(i + 1)) / 2.0;
        assert!(four_point[2 * i + 1].distance(from_spline) < ROUNDING);
    }
    // Between the ends, with mixed parameters, each point blends the two by its own α.
    let alpha: Vec<f64> = (0..9).map(|i| i as f64 / 8.0).collect();
    let (mixed, parameters) = curve::refine(&p, &alpha, Ends::Closed);
    for (i, a) in parameters.iter().enumerate() {
        let blend = (1.0 - a) * four_point[i] + *a * spline[i];
        assert!(mixed[i].distance(blend) < ROUNDING);
    }
    assert_eq!((parameters[4], parameters[5]), (alpha[2], 0.5 * (alpha[2] + alpha[3])));
}

#[test]
fn open_curves_keep_their_ends_and_lines_and_are_the_closed_ones_inside() {
    let p = polygon(9);
    let alpha: Vec<f64> = (0..9).map(|i| 0.3 * i as f64).collect();
    let (open, parameters) = curve::refine(&p, &alpha, Ends::Open);
    let (closed, others) = curve::refine(&p, &alpha, Ends::Closed);
    assert_eq!((open.len(), parameters.len()), (17, 17));
    assert_eq!(parameters[..], others[..17]);
    assert_eq!(open[3..14], closed[3..14]);
    let (fine, _) = curve::refine_n(&p, &alpha, Ends::Open, 6);
    assert_eq!(fine.len(), 8 * 64 + 1);
    assert!(fine[0].distance(p[0]) < ROUNDING && fine[512].distance(p[8]) < ROUNDING);
    // At α = 1 the limit of a point inside is the cubic B-spline's.
    let (spline, _) = curve::refine_n(&p, &[1.0; 9], Ends::Open, 14);
    for i in 1..8 {
        let limit = (p[i - 1] + 4.0 * p[i] + p[i + 1]) / 6.0;
        assert!(spline[i << 14].distance(limit) < 1e-7);
    }
    let line: Vec<DVec3> = (0..5).map(|i| DVec3::new(i as f64, 2.0, -3.0 * i as f64)).collect();
    let (fine, _) = curve::refine_n(&line, &alpha[..5], Ends::Open, 4);
    for (k, point) in fine.iter().enumerate() {
        let t = k as f64 / 16.0;
        assert!(point.distance(DVec3::new(t, 2.0, -3.0 * t)) < ROUNDING);
    }
    assert_eq!(curve::refine(&p[..1], &alpha[..1], Ends::Open).0, p[..1]);
}

#[test]
fn a_curve_passes_through_the_points_whose_alpha_is_zero() {
    let p = polygon(8);
    let alpha: Vec<f64> = (0..8).map(|i| [0.0, 0.6, 1.0, 0.0][i % 4]).collect();
    let (fine, _) = curve::refine_n(&p, &alpha, Ends::Closed, 6);
    for (i, a) in alpha.iter().enumerate() {
        let moved = fine[i << 6].distance(p[i]);
        assert!(if *a == 0.0 { moved == 0.0 } else { moved > 1e-2 });
    }
}

/// The jump scheme is the scheme itself: differences of first divided differences follow its mask.
#[test]
fn jumps_follow_their_own_mask() {
    let alpha = 0.7;
    let p = polygon(12);
    let second =
        |p: &[DVec3], h: f64| -> Vec<DVec3> { curve::divided_differences(p, 2, h).iter().map(|d| *d * h).collect() };
    let (fine, _) = curve::refine(&p, &[alpha; 12], Ends::Closed);
    let (coarse, fine) = (second(&p, 1.0), second(&fine, 0.5));
    let (outer, inner) = ((alpha - 1.0) / 8.0, (3.0 - alpha) / 4.0);
    for i in 0..12 {
        // Jump i sits at point i + 1, so at point 2i + 2 of the refined polygon: jump 2i + 1.
        let (a, b, c) = (coarse[(i + 11) % 12], coarse[i], coarse[(i + 1) % 12]);
        assert!(fine[(2 * i + 1) % 24].distance(outer * (a + c) + inner * b) < ROUNDING);
        assert!(fine[(2 * i + 2) % 24].distance(0.25 * (b + c)) < ROUNDING);
    }
    // The norm bounds what any data do.
    let jumps = curve::jumps(&p, &[alpha; 12], 8, 1);
    for steps in 1..=8 {
        assert!(jumps[steps as usize] <= curve::jump_norm(alpha, steps) * jumps[0] + ROUNDING);
    }
}

#[test]
fn the_radius_is_1_at_the_ends_of_the_range_and_that_of_a_lone_kink_within() {
    let (low, high) = curve::C1_RANGE;
    assert!((curve::fixed_point_radius(low) - 1.0).abs() < ROUNDING);
    assert!((curve::fixed_point_radius(high) - 1.0).abs() < ROUNDING);
    // The radius is that of the mask around a point, found by iterating a lone kink.
    for alpha in [-1.0f64, 0.5, 2.0, 5.0] {
        let mut kink = vec![DVec3::ZERO; 16];
        kink[8] = DVec3::Y;
        let jumps = curve::jumps(&kink, &[alpha; 16], 14, 1);
        let bound = curve::fixed_point_radius(alpha).powi(14);
        assert!(jumps[14] > 1e-3 * bound, "{alpha}: the data's rate is not below the radius");
    }
}

/// The spline is C² and the four-point scheme is not.
#[test]
fn jumps_of_second_differences_fade_for_the_spline_alone() {
    let p = polygon(10);
    let second = |a: f64| curve::jumps(&p, &[a; 10], 12, 2);
    assert!(second(1.0)[12] < 1e-2 * second(1.0)[2]);
    assert!(second(0.0)[12] > 0.5 * second(0.0)[2]);
}

#[test]
fn a_closed_spline_of_a_regular_polygon_is_nearly_a_circle() {
    let n = 40;
    let circle: Vec<DVec3> =
        (0..n).map(|i| DVec3::new((TAU * i as f64 / n as f64).cos(), (TAU * i as f64 / n as f64).sin(), 0.0)).collect();
    let (fine, _) = curve::refine_n(&circle, &vec![0.0; n], Ends::Closed, 5);
    assert!(fine.iter().all(|p| (p.length() - 1.0).abs() < 1e-4));
}

#[test]
fn surface_ends_and_chosen_vertices() {
    let surface = noisy_surface("icosphere:1");
    let zero = refine_n(&surface, &vec![0.0; surface.len()], 3).unwrap().0;
    let kobbelt = Refinement::Sqrt3.refine_n(&surface, 3).unwrap();
    assert_eq!(*zero.faces(), kobbelt.faces);
    assert!(distance(zero.positions(), &kobbelt.positions) < ROUNDING);
    let chosen: Vec<bool> = (0..surface.len()).map(|v| v % 3 == 0).collect();
    let alpha = choose(&chosen, 0.25);
    let (fine, parameters) = refine_n(&surface, &alpha, 4).unwrap();
    for (v, &marked) in chosen.iter().enumerate() {
        assert_eq!(parameters[v], if marked { 1.0 } else { 0.25 });
        assert_eq!(fine.positions()[v] == surface.positions()[v], marked);
    }
}

#[test]
fn an_alpha_outside_the_range_is_an_error_that_names_the_vertex() {
    let surface = Surface::new(builtin::icosahedron()).unwrap();
    for bad in [-0.1, 2.1, f64::NAN, f64::INFINITY] {
        let mut alpha = vec![1.0; 12];
        alpha[7] = bad;
        let text = refine_n(&surface, &alpha, 1).unwrap_err().to_string();
        assert!(text.contains("vertex 7") && text.contains("to 2"), "{text}");
    }
}

#[test]
fn volumes_in_closed_form() {
    let cube = builtin::cube();
    assert!((volume(&cube) - 8.0).abs() < ROUNDING);
    let mut far = cube.clone();
    far.positions.iter_mut().for_each(|p| *p = 0.5 * *p + DVec3::splat(1e4));
    assert!((volume(&far) - 1.0).abs() < 1e-10);
    let inside_out = Mesh::new(cube.positions.iter().map(|p| -*p).collect(), cube.faces);
    assert!((volume(&inside_out) + 8.0).abs() < ROUNDING);
}

/// On convex meshes the approximating end shrinks, the interpolating end bulges, and between them the volume
/// grows with α. At α = 0 the vertices go to their limits by the mask.
#[test]
fn the_volume_grows_from_shrinking_to_bulging() {
    for name in ["icosahedron", "icosphere:1", "octahedron"] {
        let surface = Surface::new(builtin::builtin(name).unwrap()).unwrap();
        let row = |k: u32| popping(&surface, &vec![f64::from(k) / 10.0; surface.len()], 6).unwrap();
        let rows: Vec<_> = (0..=10).map(row).collect();
        assert!(rows[0].volume_ratio < 1.0 && rows[10].volume_ratio > 1.0, "{name}");
        assert!(rows.windows(2).all(|w| w[0].volume_ratio < w[1].volume_ratio));
        assert!(rows[0].center_outward < 0.0 || name != "icosahedron");
        assert!(rows[10].center_outward > 0.0 && rows[10].vertex_max == 0.0);
        let limits = sqrt3::limit_positions(&surface).unwrap();
        let shrink = distance(&limits, surface.positions()) / surface.diagonal();
        // A vertex keeps 2/3 − a_n of its way to the limit a step: 1/3 at valence 6, less below.
        assert!((rows[0].vertex_max - shrink).abs() < (1.0 + ROUNDING) * 3f64.powi(-6) * shrink);
    }
}

/// The folds of a C¹ surface fade with the edges; where no tangent plane exists (valence 3 at α = 1) they do not.
#[test]
fn folds_fade_where_the_surface_is_smooth() {
    let folds = |surface: &Surface, a: f64| -> Vec<f64> {
        let alpha = vec![a; surface.len()];
        (0..=7).map(|k| largest_fold(&refine_n(surface, &alpha, k).unwrap().0)).collect()
    };
    let regular = noisy_surface("tri-torus:8x6");
    for a in [0.0, 0.5, 1.0] {
        let found = folds(&regular, a);
        assert!(found[7] < 0.35 * found[1], "{a}: {found:?}");
    }
    let tetrahedron = Surface::new(builtin::tetrahedron()).unwrap();
    let (smooth, rough) = (folds(&tetrahedron, 0.0), folds(&tetrahedron, 1.0));
    assert!(smooth[7] < 0.3 * smooth[1], "{smooth:?}");
    assert!(rough[7] > 1.0, "{rough:?}");
}
