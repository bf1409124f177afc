//! Extreme eigenvalues, their multiplicities and modes, against symbols and dense eigenvalues.

use super::{assemble, named, torus, torus_symbols};
use limitlab::analysis::dense;
use limitlab::analysis::dirichlet_neumann::bracket;
use limitlab::analysis::singularity::modes;
use limitlab::analysis::spectrum::{ends, mesh_ends};
use limitlab::analysis::subspace_iteration::{EigenpairRequest, End, extreme};
use limitlab::analysis::symmetric::{SymmetricForm, symmetric};
use limitlab::analysis::valence_study::{regular_band, valence_study};
use limitlab::assemble::LimitSystem;
use limitlab::mesh::{Faces, Mesh, Surface, builtin, generate};
use limitlab::schemes::Scheme;

#[test]
fn dense_spectra_are_the_symbols_of_the_torus() {
    for scheme in Scheme::ALL {
        let found = dense::eigenvalues(&assemble(&torus(scheme, 12, 9), scheme)).expect("small");
        for (a, b) in found.a.iter().zip(torus_symbols(scheme, 12, 9)) {
            assert!((a - b).abs() < 1e-13, "{scheme}: {a} {b}");
        }
    }
}

#[test]
fn extreme_values_and_multiplicities_are_those_of_the_torus() {
    for scheme in Scheme::ALL {
        for (n, m) in [(40, 40), (41, 37), (60, 20)] {
            let system = assemble(&torus(scheme, n, m), scheme);
            let exact = torus_symbols(scheme, n, m);
            let s = symmetric(&system, SymmetricForm::A);
            for end in [End::Lowest, End::Highest] {
                let request =
                    EigenpairRequest { end, count: 7, tolerance: 1e-11, spectrum: (system.bounds.lambda_min, 1.0) };
                let found = extreme(&s, &request).expect("large enough");
                assert!(found.converged, "{scheme} {n}x{m} {end:?}");
                for (k, v) in found.values.iter().enumerate() {
                    let exact = match end {
                        End::Lowest => exact[k],
                        End::Highest => exact[exact.len() - 1 - k],
                    };
                    let error = (v.value - exact).abs();
                    assert!(error < 1e-11, "{scheme} {n}x{m} {end:?} {k}: {error:e}");
                    assert!(v.error <= v.residual && error <= v.residual + 1e-14);
                }
            }
            let ends = ends(&system).expect("no dense part");
            // The mid-edge scheme's is 0 on tori with even sides.
            assert!((ends.lambda_min.value - exact[0]).abs() < (1e-9 * exact[0]).max(1e-13));
            assert!((ends.lambda_max.value - 1.0).abs() < 1e-13);
            let jacobi = ends.jacobi_lambda_max.value * system.diagonal[0];
            assert!((jacobi - 1.0).abs() < 1e-13);
        }
    }
}

#[test]
fn clusters_that_no_polynomial_parts_are_those_of_the_torus() {
    // The sixteenth value is within a thousandth of the first: the inverse parts them.
    let (n, m) = (200, 130);
    for scheme in [Scheme::CatmullClark, Scheme::Loop] {
        let system = assemble(&torus(scheme, n, m), scheme);
        let exact = torus_symbols(scheme, n, m);
        let s = symmetric(&system, SymmetricForm::A);
        for end in [End::Lowest, End::Highest] {
            let request =
                EigenpairRequest { end, count: 7, tolerance: 1e-10, spectrum: (system.bounds.lambda_min, 1.0) };
            let found = extreme(&s, &request).expect("large enough");
            // A filter in S alone would take 240 products a vector, and dozens of them.
            assert!(found.converged && found.applications < 16 * 700, "{scheme} {end:?}: {}", found.applications);
            let from_end = |k: usize| if end == End::Lowest { exact[k] } else { exact[exact.len() - 1 - k] };
            for (k, (v, x)) in found.values.iter().zip(&found.vectors).enumerate() {
                assert!((v.value - from_end(k)).abs() < 1e-12, "{scheme} {end:?} {k}: {v:?} {}", from_end(k));
                let residual = (0..x.len()).map(|i| (s.row_times(i, x) - v.value * x[i]).powi(2)).sum::<f64>().sqrt();
                assert!((residual - v.residual).abs() < 1e-13 && residual < 1e-6, "{residual:e} {v:?}");
            }
        }
    }
}

#[test]
fn clusters_on_spheres_agree_with_dense_eigenvalues() {
    // Near-equal groups around the 8 vertices of valence 3, and the 12 of valence 5.
    for (name, scheme) in [
        ("quad-sphere:4", Scheme::CatmullClark),
        ("icosphere:3", Scheme::Loop),
        ("irregular-quad:1200", Scheme::Nasri),
        ("irregular-tri:1200", Scheme::Sqrt3),
    ] {
        let system = assemble(&named(name), scheme);
        let all = dense::full_eigenvalues(&system).expect("below the limit");
        let b = system.bounds;
        for (operator, exact, spectrum) in [
            (SymmetricForm::A, &all.a, (b.lambda_min, b.lambda_max)),
            (SymmetricForm::Jacobi, &all.jacobi, (b.jacobi_lambda_min, b.jacobi_lambda_max)),
        ] {
            let s = symmetric(&system, operator);
            for end in [End::Lowest, End::Highest] {
                let request = EigenpairRequest { end, count: 20, tolerance: 1e-10, spectrum };
                let found = extreme(&s, &request).expect("large enough");
                assert!(found.converged);
                for (k, v) in found.values.iter().enumerate() {
                    let exact = match end {
                        End::Lowest => exact[k],
                        End::Highest => exact[exact.len() - 1 - k],
                    };
                    assert!((v.value - exact).abs() < 1e-9, "{name} {end:?} {k}");
                }
            }
        }
        let ends = ends(&system).expect("values");
        assert!(ends.converged());
        for (value, exact) in [
            (ends.lambda_min.value, all.a[0]),
            (ends.lambda_max.value, all.a[all.a.len() - 1]),
            (ends.jacobi_lambda_min.value, all.jacobi[0]),
            (ends.jacobi_lambda_max.value, all.jacobi[all.a.len() - 1]),
        ] {
            assert!((value - exact).abs() <= 1e-8 * exact, "{name}: {value} {exact}");
        }
    }
}

/// A torus with as many equal defects, half a turn apart both ways: a quad with a cube on it, or a triangle with a
/// vertex in it.
fn torus_with_defects(scheme: Scheme, n: usize, defects: usize) -> Mesh {
    let plain = torus(scheme, n, n);
    let mut lists: Vec<Vec<u32>> = plain.faces.iter().map(<[u32]>::to_vec).collect();
    let mut positions = plain.positions.clone();
    for k in 0..defects {
        let first = k * (n / 2) * (n + 1);
        let begins = |f: &Vec<u32>| f[0] as usize == first;
        let face = lists.iter().position(begins).expect("a face begins there");
        let bottom = lists[face].clone();
        let m = bottom.len();
        let new = positions.len() as u32;
        if scheme.needs_triangles() {
            positions.push(positions[first]);
            lists[face] = vec![bottom[0], bottom[1], new];
            lists.extend([1, 2].map(|s| vec![bottom[s], bottom[(s + 1) % m], new]));
        } else {
            positions.extend(bottom.iter().map(|&v| plain.positions[v as usize]));
            let top = |s: usize| new + (s % m) as u32;
            lists[face] = (0..m).map(top).collect();
            lists.extend((0..m).map(|s| vec![bottom[s], bottom[(s + 1) % m], top(s + 1), top(s)]));
        }
    }
    Mesh::new(positions, Faces::from_lists(&lists))
}

#[test]
fn brackets_hold_the_ends_and_count_them() {
    let mut closed = Vec::new();
    for scheme in [Scheme::CatmullClark, Scheme::Loop, Scheme::Sqrt3] {
        let one = torus_with_defects(scheme, 30, 1);
        let mut meshes = vec![("apart", generate::union(&[one.clone(), one]))];
        if scheme == Scheme::CatmullClark {
            meshes.push(("together", torus_with_defects(scheme, 42, 2)));
        }
        for (kind, mesh) in meshes {
            let surface = Surface::new(mesh).expect("a closed mesh");
            assert_eq!(surface.topology().euler_characteristic(surface.faces()), 0);
            let system = LimitSystem::new(&surface, scheme).expect("a system");
            let all = dense::full_eigenvalues(&system).expect("below the limit");
            for (operator, values) in [(SymmetricForm::A, &all.a), (SymmetricForm::Jacobi, &all.jacobi)] {
                for end in [End::Lowest, End::Highest] {
                    let found = bracket(&surface, scheme, operator, end, 1e-9).expect("finite numbers");
                    let Some(found) = found else { continue };
                    closed.push((scheme, kind, operator, end, found.width));
                    let name = format!("{scheme}, {kind}, {operator:?} {end:?}: {found:?}");
                    let outwards = match end {
                        End::Lowest => -1.0,
                        End::Highest => 1.0,
                    };
                    let mut out: Vec<f64> = values.iter().map(|v| outwards * (v - found.value)).collect();
                    out.sort_by(|a, b| b.total_cmp(a));
                    // Nothing further out than the width, as many as are said within it, the next as far as is said.
                    assert!(out[0] <= found.width + 1e-13, "{name} {:e}", out[0]);
                    assert!(out[0] >= -1e-13, "{name} {:e}", out[0]);
                    let equal = out.iter().filter(|v| **v >= -found.width).count();
                    assert_eq!(equal, found.multiplicity, "{name}");
                    let next = outwards * (found.next - found.value);
                    assert!(out[equal] <= next + 1e-13, "{name} {:e}", out[equal]);
                    assert!(found.patches <= 2 && found.kinds == 1, "{name}");
                }
            }
        }
    }
    assert!(closed.len() >= 7, "{closed:?}");
}

#[test]
fn ends_of_meshes_have_the_multiplicities_of_dense_eigenvalues() {
    let three = generate::union(&[named("quad-sphere:3"), named("quad-sphere:3"), named("cube")]);
    let meshes = [
        ("a sphere of quads", named("quad-sphere:4"), Scheme::CatmullClark),
        ("a sphere of triangles", named("icosphere:3"), Scheme::Loop),
        ("a sphere of triangles", named("icosphere:3"), Scheme::Sqrt3),
        ("an odd torus", builtin::torus(31, 23), Scheme::CatmullClark),
        ("a torus of triangles", builtin::tri_torus(31, 23), Scheme::Loop),
        ("three components", three, Scheme::CatmullClark),
        ("defects", torus_with_defects(Scheme::Loop, 26, 2), Scheme::Loop),
        ("irregular quads", named("irregular-quad:700"), Scheme::CatmullClark),
        ("irregular polygons", named("irregular-poly:700"), Scheme::Nasri),
    ];
    let mut counted = 0;
    for (name, mesh, scheme) in meshes {
        let surface = Surface::new(mesh).expect("a closed mesh");
        let found = mesh_ends(&surface, scheme).expect("values");
        assert!(found.converged(), "{name}: {found:?}");
        let system = LimitSystem::new(&surface, scheme).expect("a system");
        let all = dense::full_eigenvalues(&system).expect("below the limit");
        for (estimate, values, lowest) in [
            (found.lambda_min, &all.a, true),
            (found.lambda_max, &all.a, false),
            (found.jacobi_lambda_min, &all.jacobi, true),
            (found.jacobi_lambda_max, &all.jacobi, false),
        ] {
            let exact = values[if lowest { 0 } else { values.len() - 1 }];
            let error = (estimate.value - exact).abs();
            assert!(error <= 1e-9 * exact + 1e-14, "{name} {scheme}: {estimate:?} {exact}");
            if let Some(m) = estimate.multiplicity {
                let slack = (m.within * exact).max(1e-12);
                let equal = values.iter().filter(|v| (*v - exact).abs() <= slack).count();
                assert_eq!(m.count, equal, "{name} {scheme}: {estimate:?}");
                counted += 1;
            }
        }
    }
    assert!(counted >= 34, "{counted} of 36 were decided");
}

#[test]
fn a_cluster_of_eight_on_a_sphere_of_quads() {
    // Held against a block iteration on the whole mesh.
    let surface = Surface::new(named("quad-sphere:7")).expect("a closed mesh");
    let scheme = Scheme::CatmullClark;
    let found =
        bracket(&surface, scheme, SymmetricForm::A, End::Lowest, 1e-9).expect("finite numbers").expect("eight corners");
    assert_eq!((found.multiplicity, found.patches, found.kinds), (8, 8, 1));
    let system = LimitSystem::new(&surface, scheme).expect("a system");
    let request = EigenpairRequest { end: End::Lowest, count: 9, tolerance: 1e-10, spectrum: (0.0, 1.0) };
    let pairs = extreme(&symmetric(&system, SymmetricForm::A), &request).expect("large enough");
    for v in &pairs.values[..8] {
        assert!((v.value - found.value).abs() <= found.width + v.error, "{v:?} {found:?}");
    }
    assert!(pairs.values[8].value >= found.next);
}

#[test]
fn modes_are_eigenvectors_in_clusters_of_the_torus() {
    // Dense, and by subspace iteration.
    for (n, m) in [(20, 20), (40, 40), (30, 25)] {
        for scheme in [Scheme::CatmullClark, Scheme::Loop] {
            let system = assemble(&torus(scheme, n, m), scheme);
            let symbols = torus_symbols(scheme, n, m);
            let found = modes(&system, SymmetricForm::A, End::Lowest, 7).expect("modes");
            assert!(found.converged && found.modes.len() == 7);
            for (mode, exact) in found.modes.iter().zip(&symbols) {
                let (lambda, x) = (mode.eigenvalue.value, &mode.values);
                assert!((lambda - exact).abs() < 1e-9, "{scheme} {n}x{m}: {lambda} {exact}");
                let residual = (0..x.len()).map(|i| (system.a.row_times(i, x) - lambda * x[i]).abs());
                assert!(residual.fold(0.0, f64::max) < 1e-4 * lambda, "{scheme} {n}x{m}: {lambda}");
                let largest = x.iter().fold(0.0f64, |most, x| most.max(x.abs()));
                assert!(largest == 1.0 && x.contains(&1.0));
            }
            let mut computed = 0;
            for cluster in &found.clusters {
                let equal = symbols.iter().filter(|exact| (**exact - cluster.value).abs() < 1e-8).count();
                assert!(computed < 7);
                computed += cluster.multiplicity;
                assert!(cluster.complete || computed == 7, "{scheme} {n}x{m}: {cluster:?}");
                assert_eq!(
                    cluster.multiplicity.min(equal),
                    if cluster.complete { equal } else { cluster.multiplicity }
                );
            }
            assert!(computed >= 7);
        }
    }
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let system = assemble(&named("irregular-quad:9000"), Scheme::CatmullClark);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| {
            let modes = modes(&system, SymmetricForm::A, End::Lowest, 3).expect("modes");
            (ends(&system).expect("values"), modes)
        })
    };
    assert_eq!(on(1), on(3));
}

#[test]
fn limits_are_told_with_what_would_do() {
    let system = assemble(&builtin::torus(70, 70), Scheme::CatmullClark);
    let message = dense::full_eigenvalues(&system).expect_err("too large").to_string();
    assert!(message.contains("4900") && message.contains("at most 4000"), "{message}");
    let s = symmetric(&system, SymmetricForm::A);
    let ask = |count| EigenpairRequest { end: End::Lowest, count, tolerance: 1e-9, spectrum: (0.0, 1.0) };
    assert!(extreme(&s, &ask(60)).is_err());
    let tiny = symmetric(&assemble(&named("cube"), Scheme::CatmullClark), SymmetricForm::A);
    let message = extreme(&tiny, &ask(1)).expect_err("too small").to_string();
    assert!(message.contains("dense"), "{message}");
}

#[test]
fn slow_modes_sit_where_the_valence_is_not_regular() {
    for scheme in [Scheme::Loop, Scheme::CatmullClark] {
        let rows = valence_study(scheme, [3, 5, 8, 12].into_iter()).expect("small");
        let band = regular_band(scheme);
        for row in &rows {
            assert!(row.a[0] > 0.0 && row.a.len() == row.vertices);
            let low = row.slow_pia.mode.eigenvalue.value;
            assert!((low - row.a[0]).abs() < 1e-9);
            assert!(row.slow_pia.mode.participation <= 1.0 + 1e-12);
            let bound = row.separated_a <= row.vertices && band.a.0 > 0.0;
            assert!(bound && row.slow_pia.near_star <= 1.0 + 1e-12);
        }
        // Valence 3 under Loop is a slow mode of its own.
        if scheme == Scheme::Loop {
            assert!(
                rows[0].separated_a > 0 && rows[0].slow_pia.near_star > 0.5,
                "{:?}",
                (rows[0].separated_a, rows[0].slow_pia.near_star)
            );
            assert!(rows[0].slow_pia.peak == 3 || rows[0].slow_pia.peak == 4);
        }
    }
}
