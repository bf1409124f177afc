//! Proven bounds against dense eigenvalues on random meshes, and closed-form spectra on regular tori.

use std::f64::consts::TAU;

use limitlab::analysis::dense;
use limitlab::analysis::spectrum::spectrum;
use limitlab::assemble::Operator;
use limitlab::mesh::{Mesh, Surface};
use limitlab::schemes::Scheme;
use rayon::prelude::*;

use crate::common::formulas::assemble;
use crate::common::meshes::*;
use crate::common::tol;

#[test]
fn all_eigenvalues_keep_to_the_proven_bounds() {
    (0..220u64).into_par_iter().for_each(|seed| {
        for scheme in Scheme::ALL {
            let mesh = small_mesh(scheme, seed);
            let bounds = system(&mesh, scheme).bounds;
            let plain = assemble(scheme, &mesh);
            let (values, jacobi) = (plain.eigenvalues(), plain.jacobi_eigenvalues());
            let slack = tol::eigenvalues(mesh.len(), 4.0);
            let what = format!("{scheme}, seed {seed}, {} vertices", mesh.len());
            let (min, max) = (values[0], values[values.len() - 1]);
            assert!(min >= bounds.lambda_min - slack, "{what}: {min} < {}", bounds.lambda_min);
            assert!(max <= bounds.lambda_max + slack, "{what}: {max}");
            assert!((max - 1.0).abs() <= slack, "{what}: the constant vector has {max}");
            let largest = jacobi[jacobi.len() - 1];
            assert!(largest <= bounds.jacobi_lambda_max + slack, "{what}: {largest} > {}", bounds.jacobi_lambda_max);
            // Thall's ω = ½ needs less than 4, always.
            assert!(largest < 4.0, "{what}");
        }
    });
}

/// ±1 in a colouring of quads with two colours, or cube roots of 1 in one of triangles with three, where all valences
/// are the same: nothing lies below what the valences allow.
#[test]
fn coloured_meshes_attain_the_lower_bounds() {
    use Scheme::*;
    for (name, schemes) in [
        ("cube", &[CatmullClark, Nasri, ZhengCai][..]),
        ("torus:6x4", &[CatmullClark, Nasri, ZhengCai]),
        ("octahedron", &[Loop, Sqrt3, Nasri, ZhengCai]),
        ("tri-torus:6x9", &[Loop, Sqrt3, Nasri, ZhengCai]),
    ] {
        let mesh = built_in(name);
        for &scheme in schemes {
            let bounds = system(&mesh, scheme).bounds;
            let plain = assemble(scheme, &mesh);
            let slack = tol::eigenvalues(mesh.len(), 4.0);
            let (least, jacobi) = (plain.eigenvalues()[0], plain.jacobi_eigenvalues()[0]);
            assert!((bounds.lambda_min - least).abs() < slack, "{name}, {scheme}: {least}, {bounds:?}");
            assert!((bounds.jacobi_lambda_min - jacobi).abs() < slack, "{name}, {scheme}: {jacobi}, {bounds:?}");
        }
    }
}

/// Where iterations in mixed precision start their interval: a little below the spectrum of ordinary meshes.
#[test]
fn the_usual_lambda_min_is_usual() {
    for scheme in Scheme::ALL {
        // Among quads the mid-edge scheme's λ_min is 0.
        let names = match scheme.needs_triangles() || scheme == Scheme::MidEdge {
            true => ["tri-torus:12x12", "irregular-tri:500"],
            false => ["torus:12x12", "irregular-quad:500"],
        };
        let usual = scheme.usual_lambda_min();
        for name in names {
            let least = dense::eigenvalues(&system(&built_in(name), scheme)).unwrap().a[0];
            assert!((0.7 * least..least + 1e-12).contains(&usual), "{scheme} on {name}: {usual} for {least}");
        }
    }
}

/// A few vertices of another valence, each by itself, hardly move λ_min from where a regular mesh has it.
#[test]
fn the_usual_lambda_min_of_nearly_regular_meshes_is_that_of_regular_ones() {
    let usual_of = |name, scheme| {
        let surface = Surface::new(built_in(name)).unwrap();
        Operator::new(&surface, scheme).unwrap().usual_lambda_min()
    };
    for (name, scheme) in [("quad-sphere:5", Scheme::CatmullClark), ("icosphere:4", Scheme::Loop)] {
        let usual = usual_of(name, scheme);
        let least = spectrum(&system(&built_in(name), scheme)).unwrap().a.min;
        assert!((0.98 * least..least).contains(&usual), "{scheme} on {name}: {usual} for {least}");
    }
    // A fiftieth of the vertices, 0.1076 already, and faces of another size.
    for (name, scheme) in [("quad-sphere:3", Scheme::CatmullClark), ("icosphere:4", Scheme::CatmullClark)] {
        let usual = usual_of(name, scheme);
        assert_eq!(usual, scheme.usual_lambda_min(), "{scheme} on {name}");
    }
}

#[test]
fn the_library_s_dense_eigenvalues_are_those_of_another_library() {
    for scheme in Scheme::ALL {
        for seed in 0..10 {
            let mesh = small_mesh(scheme, seed);
            let ours = dense::eigenvalues(&system(&mesh, scheme)).unwrap();
            let plain = assemble(scheme, &mesh);
            for (a, b) in [(&ours.a, plain.eigenvalues()), (&ours.jacobi, plain.jacobi_eigenvalues())] {
                assert_close(a, &b, tol::eigenvalues(mesh.len(), 4.0), &format!("{scheme} {seed}"));
            }
        }
    }
}

fn assert_close(found: &[f64], expected: &[f64], allowed: f64, what: &str) {
    assert_eq!(found.len(), expected.len());
    for (f, e) in found.iter().zip(expected) {
        assert!((f - e).abs() <= allowed, "{what}: {f} instead of {e}");
    }
}

/// The eigenvalues of A on a torus of `rows` × `columns`, from the symbol at all its angles.
fn symbol(scheme: Scheme, triangles: bool, rows: usize, columns: usize) -> Vec<f64> {
    let mut values = Vec::new();
    for i in 0..rows {
        for j in 0..columns {
            let (s, t) = (TAU * i as f64 / rows as f64, TAU * j as f64 / columns as f64);
            let six = s.cos() + t.cos() + (s + t).cos();
            values.push(match (scheme, triangles) {
                (Scheme::CatmullClark, false) => (2.0 + s.cos()) * (2.0 + t.cos()) / 9.0,
                (Scheme::Nasri, false) => (3.0 + s.cos()) * (3.0 + t.cos()) / 16.0,
                (Scheme::ZhengCai, false) => 0.5 + (1.0 + s.cos()) * (1.0 + t.cos()) / 8.0,
                (Scheme::Loop | Scheme::Sqrt3, _) => 0.5 + six / 6.0,
                // 2/3 at the vertex, 1/18 at each of six neighbours, which lie on two of its faces.
                (Scheme::Nasri | Scheme::ZhengCai, true) => (6.0 + six) / 9.0,
                // 30/66 + 6·4/3/66 at the vertex, (2 + 2·4/3)/66 at the neighbours.
                (Scheme::CatmullClark, true) => (38.0 + 28.0 / 3.0 * six) / 66.0,
                (Scheme::MidEdge, false) => 0.5 + (s.cos() + t.cos()) / 4.0,
                (Scheme::MidEdge, true) => 0.5 + six / 6.0,
            });
        }
    }
    values.sort_by(f64::total_cmp);
    values
}

fn hold_against_symbol(mesh: &Mesh, scheme: Scheme, triangles: bool, rows: usize, columns: usize) {
    let ours = dense::eigenvalues(&system(mesh, scheme)).unwrap();
    let expected = symbol(scheme, triangles, rows, columns);
    let what = format!("{scheme}, {rows}×{columns}");
    assert_close(&ours.a, &expected, tol::eigenvalues(mesh.len(), 1.0), &what);
    // The diagonal is constant, so D⁻¹A is a multiple of A.
    let own = symbol_diagonal(scheme, triangles);
    let scaled: Vec<f64> = expected.iter().map(|l| l / own).collect();
    assert_close(&ours.jacobi, &scaled, tol::eigenvalues(mesh.len(), 3.0), &what);
}

fn symbol_diagonal(scheme: Scheme, triangles: bool) -> f64 {
    match (scheme, triangles) {
        (Scheme::CatmullClark, false) => 4.0 / 9.0,
        (Scheme::CatmullClark, true) => 38.0 / 66.0,
        (Scheme::Nasri, false) => 9.0 / 16.0,
        (Scheme::ZhengCai, false) => 5.0 / 8.0,
        (Scheme::Loop | Scheme::Sqrt3 | Scheme::MidEdge, _) => 0.5,
        (Scheme::Nasri | Scheme::ZhengCai, true) => 2.0 / 3.0,
    }
}

#[test]
fn torus_spectra_in_closed_form() {
    for (rows, columns) in [(8, 6), (7, 5), (12, 10), (3, 4)] {
        let quads = built_in(&format!("torus:{rows}x{columns}"));
        for scheme in Scheme::ALL.into_iter().filter(|s| !s.needs_triangles()) {
            hold_against_symbol(&quads, scheme, false, rows, columns);
        }
        let triangles = built_in(&format!("tri-torus:{rows}x{columns}"));
        for scheme in Scheme::ALL {
            hold_against_symbol(&triangles, scheme, true, rows, columns);
        }
    }
}

/// Where the bounds are attained: tori with even sides; the smallest meshes have other closed forms.
#[test]
fn bounds_that_are_attained() {
    let smallest = |mesh: &Mesh, scheme| dense::eigenvalues(&system(mesh, scheme)).unwrap().a[0];
    for (scheme, expected) in [(Scheme::CatmullClark, 1.0 / 9.0), (Scheme::Nasri, 0.25), (Scheme::ZhengCai, 0.5)] {
        let mesh = built_in("torus:6x8");
        let slack = tol::eigenvalues(mesh.len(), 1.0);
        assert!((smallest(&mesh, scheme) - expected).abs() <= slack, "{scheme}");
        let bound = system(&mesh, scheme).bounds.lambda_min;
        assert!((bound - expected).abs() <= tol::rounding(1), "{scheme}");
    }
    // θ = φ = 2π/3: all three cosines are −½.
    for scheme in [Scheme::Loop, Scheme::Sqrt3] {
        let mesh = built_in("tri-torus:6x9");
        let bound = system(&mesh, scheme).bounds.lambda_min;
        assert!((bound - 0.25).abs() <= tol::rounding(1), "{scheme}");
        assert!((smallest(&mesh, scheme) - 0.25).abs() <= tol::eigenvalues(54, 1.0));
    }
    // At valence 3 the bounds 1/10 and 1/16 are not attained.
    let mesh = built_in("tetrahedron");
    for (scheme, bound, value) in [(Scheme::Loop, 0.1, 0.2), (Scheme::Sqrt3, 1.0 / 16.0, 1.0 / 6.0)] {
        assert!((system(&mesh, scheme).bounds.lambda_min - bound).abs() <= tol::rounding(1));
        assert!((smallest(&mesh, scheme) - value).abs() <= tol::eigenvalues(4, 1.0));
    }
}
