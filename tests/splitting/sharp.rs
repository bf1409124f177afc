//! Local matrices at boundary, crease, corner and dart vertices.

use std::f64::consts::PI;

use limitlab::analysis::splitting::{LocalScheme, SharpMask, SharpRow, SharpVertex, sharp_rows};

use super::{EIGEN, ROUNDING};

const SCHEMES: [LocalScheme; 2] = [LocalScheme::CatmullClark, LocalScheme::Loop];

fn row(scheme: LocalScheme, vertex: SharpVertex, valence: usize) -> SharpRow {
    sharp_rows(scheme, vertex, &[valence]).unwrap().remove(0)
}

fn close(mask: &SharpMask, expected: &[f64]) {
    assert_eq!(mask.weights.len(), expected.len());
    for (a, b) in mask.weights.iter().zip(expected) {
        assert!((a - b).abs() < EIGEN, "{}: {:?} for {expected:?}", mask.name, mask.weights);
    }
}

fn named<'a>(row: &'a SharpRow, name: &str) -> &'a SharpMask {
    row.masks.iter().find(|mask| mask.name == name).unwrap()
}

#[test]
fn eigenvalues_and_masks_are_the_closed_forms() {
    for scheme in SCHEMES {
        for vertex in SharpVertex::ALL {
            let first = *vertex.valences().start();
            let valences: Vec<usize> = (first..=12).chain([40]).collect();
            for row in sharp_rows(scheme, vertex, &valences).unwrap() {
                let what = format!("{scheme}, {vertex}, {}", row.valence);
                assert_eq!(row.eigenvalues.len(), row.positions.len(), "{what}");
                assert!(row.eigenvalue_error.is_none_or(|e| e < EIGEN), "{what}: {:?}", row.eigenvalue_error);
                assert_eq!(row.eigenvalue_error.is_none(), vertex == SharpVertex::Dart);
                assert!(row.limit_mask_error < EIGEN, "{what}: {:e}", row.limit_mask_error);
                for mask in &row.masks {
                    assert!(mask.residual < EIGEN, "{what}, {}: {:e}", mask.name, mask.residual);
                    let sum: f64 = mask.weights.iter().sum();
                    let expected = if mask.name == "limit" { 1.0 } else { 0.0 };
                    assert!((sum - expected).abs() < EIGEN, "{what}, {}: {sum}", mask.name);
                }
                let faces: usize = row.sectors.iter().map(|sector| sector.faces).sum();
                assert_eq!(faces, row.valence, "{what}");
            }
        }
    }
}

/// The largest eigenvalue of a mode that turns by `angle` from edge to edge.
fn mode(scheme: LocalScheme, angle: f64) -> f64 {
    match scheme {
        LocalScheme::Loop => 0.375 + 0.25 * angle.cos(),
        _ => (5.0 + angle.cos() + (0.5 * angle).cos() * (2.0 * (9.0 + angle.cos())).sqrt()) / 16.0,
    }
}

/// The largest modes inside a sector: cos(0) would be that of the curve itself.
#[test]
fn a_sector_has_a_tangent_plane_up_to_three_quads_and_five_triangles() {
    for (scheme, most) in [(LocalScheme::CatmullClark, 3), (LocalScheme::Loop, 5)] {
        for m in 1..=10 {
            let sector = &row(scheme, SharpVertex::Boundary, m).sectors[0];
            assert_eq!(sector.tangent_plane, m <= most, "{scheme}, {m}");
            for j in 1..m.min(3) {
                let expected = mode(scheme, PI * j as f64 / m as f64);
                assert!((sector.modes[j - 1] - expected).abs() < EIGEN, "{scheme}, {m}, {j}");
            }
            let corner = row(scheme, SharpVertex::Corner, m);
            assert_eq!(corner.sectors[0].tangent_plane, m == 1);
            assert_eq!(corner.masks.len(), if m == 1 { 3 } else { 1 });
            if m == 1 {
                let along = |ends: [f64; 2]| {
                    let others = vec![0.0; corner.positions.len() - 3];
                    [&[-1.0], &ends[..], &others].concat()
                };
                close(named(&corner, "along_first"), &along([1.0, 0.0]));
                close(named(&corner, "along_second"), &along([0.0, 1.0]));
            }
        }
        // Where the second mode is ½, to rounding, there is none.
        let equal = row(scheme, SharpVertex::Boundary, most + 1);
        assert!((equal.sectors[0].modes[1] - 0.5).abs() < ROUNDING);
        // A crease has one on each side or not.
        let crease = row(scheme, SharpVertex::Crease, 2 * most + 1);
        let planes: Vec<bool> = crease.sectors.iter().map(|s| s.tangent_plane).collect();
        assert_eq!(planes, [true, false]);
    }
}

#[test]
fn tangents_along_and_across_a_boundary() {
    // One quad: e_1 − e_0, and e_0 + e_1 − 2v, where ¼ has two places and one eigenvector.
    let one = row(LocalScheme::CatmullClark, SharpVertex::Boundary, 1);
    close(named(&one, "along"), &[0.0, -1.0, 1.0, 0.0]);
    close(named(&one, "across"), &[-1.0, 0.5, 0.5, 0.0]);
    assert_eq!(named(&one, "across").eigenvalue, 0.25);
    // Two quads, where ½ is double: the derivative of a bicubic B-spline across its boundary, whose phantom row is linear.
    let two = row(LocalScheme::CatmullClark, SharpVertex::Boundary, 2);
    assert!((named(&two, "across").eigenvalue - 0.5).abs() < EIGEN);
    close(named(&two, "across"), &[-1.0, -0.25, 1.0, -0.25, 0.25, 0.25]);
    // Three triangles: a regular boundary vertex.
    let three = row(LocalScheme::Loop, SharpVertex::Boundary, 3);
    assert!((named(&three, "across").eigenvalue - 0.5).abs() < EIGEN);
    close(named(&three, "across"), &[-1.0, -0.5, 1.0, 1.0, -0.5]);
    // A crease of even valence has the masks of its two sides, each without the other side.
    let crease = row(LocalScheme::CatmullClark, SharpVertex::Crease, 4);
    close(named(&crease, "across_left"), &[-1.0, -0.25, 1.0, -0.25, 0.0, 0.25, 0.25, 0.0, 0.0]);
    close(named(&crease, "across_right"), &[-1.0, -0.25, 0.0, -0.25, 1.0, 0.0, 0.0, 0.25, 0.25]);
}

#[test]
fn darts_have_their_exact_masks() {
    let dart = |scheme, n| row(scheme, SharpVertex::Dart, n);
    let three = dart(LocalScheme::CatmullClark, 3);
    close(&three.masks[0], &[0.405, 0.2, 0.15, 0.15, 0.0275, 0.04, 0.0275]);
    let four = dart(LocalScheme::CatmullClark, 4);
    let weights = [752.0, 210.0, 160.0, 180.0, 160.0, 29.0, 44.0, 44.0, 29.0].map(|x: f64| x / 1608.0);
    close(&four.masks[0], &weights);
    let looped = dart(LocalScheme::Loop, 3);
    close(&looped.masks[0], &[16.0, 9.0, 6.0, 6.0].map(|x: f64| x / 37.0));
    let five = dart(LocalScheme::CatmullClark, 5);
    let leading: Vec<f64> = five.masks[1..].iter().map(|mask| mask.eigenvalue).collect();
    assert!((leading[0] - 0.55).abs() < 5e-5 && (leading[1] - 0.5264).abs() < 5e-5, "{leading:?}");
    assert!(five.sectors[0].tangent_plane);
}

/// The sines about a smooth vertex vanish on an edge, so that it may as well be sharp: one of the two leading modes of a dart is
/// theirs, of eigenvalues that may be equal. The other is even about that edge.
#[test]
fn a_dart_has_a_tangent_plane_by_an_odd_and_an_even_mode() {
    for scheme in SCHEMES {
        for n in (3..=12).chain([40]) {
            let dart = row(scheme, SharpVertex::Dart, n);
            let [_, first, second] = &dart.masks[..] else { panic!("{scheme}, {n}: {} masks", dart.masks.len()) };
            let smooth = mode(scheme, 2.0 * PI / n as f64);
            let off = [first, second].map(|mask| (mask.eigenvalue - smooth).abs());
            assert!(off[0].min(off[1]) < EIGEN, "{scheme}, {n}: {off:?}");
            let product: f64 = first.weights.iter().zip(&second.weights).map(|(a, b)| a * b).sum();
            assert!(product.abs() < EIGEN, "{scheme}, {n}: {product:e}");
            assert!(dart.sectors[0].tangent_plane, "{scheme}, {n}");
        }
    }
}

#[test]
fn what_has_no_rules_is_refused_by_name() {
    for scheme in [LocalScheme::DooSabin, LocalScheme::Sqrt3 { alpha: 0.0 }, LocalScheme::LabsikGreiner] {
        let refused = sharp_rows(scheme, SharpVertex::Crease, &[4]).unwrap_err().to_string();
        assert!(refused.contains(scheme.name()) && refused.contains("catmull-clark or loop"), "{refused}");
    }
    for (vertex, valence) in [(SharpVertex::Dart, 2), (SharpVertex::Boundary, 0), (SharpVertex::Corner, 101)] {
        let refused = sharp_rows(LocalScheme::Loop, vertex, &[valence]).unwrap_err().to_string();
        assert!(refused.contains("is outside"), "{refused}");
    }
}
