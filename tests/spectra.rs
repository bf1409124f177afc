//! Spectra, bounds, certificates, singular systems: computations held against closed forms, dense decompositions and
//! each other, on hundreds of meshes.

use std::f64::consts::TAU;

use glam::DVec3;
use limitlab::analysis::bracket::{bracket, element_bound};
use limitlab::analysis::certificate::{certify, eigenvalues_below};
use limitlab::analysis::eigen::{End, Request, extreme};
use limitlab::analysis::interval::interval;
use limitlab::analysis::order_study::{self, gauss_southwell, order_study, random_spread};
use limitlab::analysis::promise::Promise;
use limitlab::analysis::radius::spectral_radius;
use limitlab::analysis::singularity::{Prediction, Singularity, modes, numerical_kernel_dimension};
use limitlab::analysis::spectrum::{Operator, Source, ends, mesh_ends, symmetric};
use limitlab::analysis::valence_study::{regular_band, valence_study};
use limitlab::analysis::{comparison, dense};
use limitlab::assemble::{LimitSystem, Operator as MatrixFree, Scheme};
use limitlab::mesh::noise::add_noise;
use limitlab::mesh::{Faces, Mesh, Topology, builtin, generate};
use limitlab::solvers::gauss_seidel::sweep;
use limitlab::solvers::ssor::symmetric_sweep;
use limitlab::solvers::{Method, Outcome, Setup, Stop, run};

fn assemble(mesh: &Mesh, scheme: Scheme) -> LimitSystem {
    let topology = Topology::new(&mesh.faces, mesh.len());
    LimitSystem::new(mesh, &topology, scheme).expect("a closed mesh")
}

fn named(name: &str) -> Mesh {
    builtin::builtin(name).expect("a built-in mesh")
}

/// All eigenvalues of A on a torus grid, by the symbols.
fn torus_symbols(scheme: Scheme, n: usize, m: usize) -> Vec<f64> {
    let angles = |n: usize| (0..n).map(move |k| TAU * k as f64 / n as f64);
    let mut all: Vec<f64> = angles(n)
        .flat_map(|s| angles(m).map(move |t| (s, t)))
        .map(|(s, t)| match scheme {
            Scheme::CatmullClark => (2.0 + s.cos()) / 3.0 * (2.0 + t.cos()) / 3.0,
            Scheme::Nasri => (3.0 + s.cos()) / 4.0 * (3.0 + t.cos()) / 4.0,
            Scheme::ZhengCai => 0.5 + (1.0 + s.cos()) * (1.0 + t.cos()) / 8.0,
            Scheme::Loop | Scheme::Sqrt3 => 0.5 + (s.cos() + t.cos() + (s + t).cos()) / 6.0,
        })
        .collect();
    all.sort_by(f64::total_cmp);
    all
}

fn torus(scheme: Scheme, n: usize, m: usize) -> Mesh {
    if scheme.needs_triangles() { builtin::tri_torus(n, m) } else { builtin::torus(n, m) }
}

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
            let s = symmetric(&system, Operator::A);
            for end in [End::Lowest, End::Highest] {
                let request = Request { end, count: 7, tolerance: 1e-11, spectrum: (system.bounds.lambda_min, 1.0) };
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
            assert!((ends.lambda_min.value - exact[0]).abs() < 1e-9 * exact[0]);
            assert!((ends.lambda_max.value - 1.0).abs() < 1e-13);
            let jacobi = ends.jacobi_lambda_max.value * system.diagonal[0];
            assert!((jacobi - 1.0).abs() < 1e-13);
        }
    }
}

#[test]
fn a_regular_grid_attains_its_bounds_at_once() {
    let ends = ends(&assemble(&builtin::torus(64, 50), Scheme::CatmullClark)).expect("values");
    for e in [ends.lambda_min, ends.lambda_max, ends.jacobi_lambda_min, ends.jacobi_lambda_max] {
        assert_eq!(e.source, Source::Proven);
    }
    assert_eq!(ends.applications, 4);
    assert!((ends.lambda_min.value - 1.0 / 9.0).abs() < 1e-15);
    assert!((ends.jacobi_lambda_min.value - 0.25).abs() < 1e-15);
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
            (Operator::A, &all.a, (b.lambda_min, b.lambda_max)),
            (Operator::Jacobi, &all.jacobi, (b.jacobi_lambda_min, b.jacobi_lambda_max)),
        ] {
            let s = symmetric(&system, operator);
            for end in [End::Lowest, End::Highest] {
                let request = Request { end, count: 20, tolerance: 1e-10, spectrum };
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
            let topology = Topology::new(&mesh.faces, mesh.len());
            assert!(topology.is_closed() && topology.euler_characteristic(&mesh.faces) == 0);
            let all = dense::full_eigenvalues(&assemble(&mesh, scheme)).expect("below the limit");
            for (operator, values) in [(Operator::A, &all.a), (Operator::Jacobi, &all.jacobi)] {
                for end in [End::Lowest, End::Highest] {
                    let found = bracket(&mesh.faces, &topology, scheme, operator, end, 1e-9).expect("finite numbers");
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
        let topology = Topology::new(&mesh.faces, mesh.len());
        let found = mesh_ends(&mesh, &topology, scheme).expect("values");
        assert!(found.converged(), "{name}: {found:?}");
        let all = dense::full_eigenvalues(&assemble(&mesh, scheme)).expect("below the limit");
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
    let mesh = named("quad-sphere:7");
    let topology = Topology::new(&mesh.faces, mesh.len());
    let scheme = Scheme::CatmullClark;
    let found = bracket(&mesh.faces, &topology, scheme, Operator::A, End::Lowest, 1e-9)
        .expect("finite numbers")
        .expect("eight corners");
    assert_eq!((found.multiplicity, found.patches, found.kinds), (8, 8, 1));
    let system = assemble(&mesh, scheme);
    let request = Request { end: End::Lowest, count: 9, tolerance: 1e-10, spectrum: (0.0, 1.0) };
    let pairs = extreme(&symmetric(&system, Operator::A), &request).expect("large enough");
    for v in &pairs.values[..8] {
        assert!((v.value - found.value).abs() <= found.width + v.error, "{v:?} {found:?}");
    }
    assert!(pairs.values[8].value >= found.next);
}

/// The interval, the spectrum of A or D⁻¹A, and what valences prove of its lower end.
fn intervals(mesh: &Mesh, scheme: Scheme) -> [(limitlab::analysis::interval::Interval, f64, f64, f64); 2] {
    let topology = Topology::new(&mesh.faces, mesh.len());
    let operator = MatrixFree::new(&mesh.faces, &topology, scheme).expect("a closed mesh");
    let exact = mesh_ends(mesh, &topology, scheme).expect("values").spectrum();
    let b = operator.bounds();
    [(Operator::A, exact.a, b.lambda_min), (Operator::Jacobi, exact.jacobi, b.jacobi_lambda_min)].map(
        |(which, exact, bound)| {
            let found = interval(&operator, which).expect("finite numbers");
            (found, exact.min, exact.max, bound)
        },
    )
}

#[test]
fn cheap_intervals_are_proven_above_and_sharp_below() {
    for (name, mesh, scheme, _) in random_systems(120) {
        for (found, min, max, bound) in intervals(&mesh, scheme) {
            assert!(max <= found.high + 1e-12, "{name}: {found:?} {max}");
            // Small meshes are their own sample.
            assert!(found.least >= min - 1e-12, "{name}: {found:?} {min}");
            assert!((found.least - min).abs() <= 5e-3 * max, "{name}: {found:?} {min}");
            assert!(found.low >= bound, "{name}: {found:?} {bound}");
        }
    }
    for (name, scheme) in [
        ("irregular-quad:40000", Scheme::CatmullClark),
        ("irregular-quad:40000", Scheme::Nasri),
        ("irregular-poly:40000", Scheme::CatmullClark),
        ("irregular-tri:40000", Scheme::Loop),
        ("irregular-tri:40000", Scheme::Sqrt3),
        ("irregular-tri:40000", Scheme::CatmullClark),
        ("quad-sphere:6", Scheme::CatmullClark),
        ("torus:200x200", Scheme::CatmullClark),
    ] {
        for (found, min, max, _) in intervals(&named(name), scheme) {
            assert!(max <= found.high * (1.0 + 1e-12) && found.high < 1.06 * max, "{name}: {found:?} {max}");
            assert!(min <= found.least * (1.0 + 1e-9) && found.least < 1.03 * min, "{name}: {found:?} {min}");
            assert!(found.low <= min * (1.0 + 1e-12), "{name}: {found:?} {min}");
        }
    }
}

#[test]
fn elements_prove_at_least_what_valences_do() {
    let mut better = 0;
    for (name, mesh, scheme, system) in random_systems(120) {
        let topology = Topology::new(&mesh.faces, mesh.len());
        let all = dense::eigenvalues(&system).expect("small");
        let b = system.bounds;
        let last = all.a.len() - 1;
        for (operator, end, valences, exact) in [
            (Operator::A, End::Lowest, b.lambda_min, all.a[0]),
            (Operator::A, End::Highest, b.lambda_max, all.a[last]),
            (Operator::Jacobi, End::Lowest, b.jacobi_lambda_min, all.jacobi[0]),
            (Operator::Jacobi, End::Highest, b.jacobi_lambda_max, all.jacobi[last]),
        ] {
            let bound = element_bound(&mesh.faces, &topology, scheme, operator, end).expect("closed");
            let outwards = match end {
                End::Lowest => -1.0,
                End::Highest => 1.0,
            };
            assert!(outwards * (bound - exact) > -1e-12, "{name}: {bound} {exact}");
            assert!(outwards * (valences - bound) > -1e-12, "{name}: {bound} {valences}");
            better += usize::from(outwards * (valences - bound) > 1e-3);
        }
    }
    assert!(better > 50, "{better}");
}

/// Meshes of all kinds, small enough for dense eigenvalues.
fn random_systems(count: u64) -> impl Iterator<Item = (String, Mesh, Scheme, LimitSystem)> {
    (0..count).flat_map(|seed| {
        let triangles = generate::random_triangulation(seed);
        let polygons = generate::random_polygons(seed);
        Scheme::ALL.into_iter().filter_map(move |scheme| {
            let mesh = if scheme.needs_triangles() { triangles.clone() } else { polygons.clone() };
            if mesh.len() > 260 {
                return None;
            }
            let system = assemble(&mesh, scheme);
            Some((format!("{scheme}, seed {seed}"), mesh, scheme, system))
        })
    })
}

#[test]
fn proven_bounds_hold_on_hundreds_of_random_meshes() {
    let mut tried = 0;
    for (name, mesh, scheme, system) in random_systems(260) {
        let all = dense::eigenvalues(&system).expect("small");
        let b = system.bounds;
        let slack = 1e-12;
        let (low, high) = (all.a[0], all.a[all.a.len() - 1]);
        assert!(b.lambda_min <= low + slack, "{name}: {} > {low}", b.lambda_min);
        assert!((high - 1.0).abs() < 1e-11 && b.lambda_max == 1.0, "{name}: {high}");
        assert!(b.jacobi_lambda_min <= all.jacobi[0] + slack, "{name}");
        assert!(all.jacobi[all.a.len() - 1] <= b.jacobi_lambda_max + slack, "{name}");
        let ceiling = match scheme {
            Scheme::CatmullClark | Scheme::Nasri => 4.0,
            Scheme::Loop => 2.5,
            Scheme::Sqrt3 => 8.0 / 3.0,
            Scheme::ZhengCai => 2.0,
        };
        assert!(b.jacobi_lambda_max <= ceiling + slack, "{name}");
        let promise = Promise::new(&system.bounds);
        assert!(promise.safe_omega_jacobi >= 0.5 - slack);
        // The detective's theory against the numbers.
        let topology = Topology::new(&mesh.faces, mesh.len());
        let verdict = Singularity::detect(&mesh, &topology, scheme);
        let zeros = all.a.iter().filter(|l| l.abs() < 1e-10).count();
        assert_eq!(verdict.kernel_dimension(), zeros, "{name}");
        tried += 1;
    }
    assert!(tried > 300, "{tried} systems");
}

#[test]
fn promised_counts_are_kept_by_runs() {
    let mut tight = 0;
    for (name, mut mesh, _, system) in random_systems(60) {
        add_noise(&mut mesh, 0.1, 5);
        let tolerance = 1e-8 * mesh.diagonal();
        let promise = Promise::new(&system.bounds);
        let counts = promise.counts(&system, &mesh.positions, tolerance);
        let stop = Stop { tolerance, max_iterations: 5000 };
        let mut check = |setup: Setup, promised: f64| {
            if !promised.is_finite() {
                return;
            }
            let report = run(&system, &mesh.positions, setup, &stop).report;
            assert_eq!(report.outcome, Outcome::Converged, "{name} {setup:?}");
            let took = report.iterations as f64;
            assert!(took <= promised, "{name} {setup:?}: {took} > {promised}");
            tight += usize::from(took > 0.5 * promised);
        };
        check(Setup::Pia { omega: 1.0 }, counts.pia);
        check(Setup::Pia { omega: promise.omega_w_pia }, counts.w_pia);
        check(Setup::THALL, counts.thall);
        if promise.a.min > 0.0 {
            let spectrum = (promise.a.min, promise.a.max);
            check(Setup::Chebyshev { spectrum }, counts.chebyshev);
        }
    }
    assert!(tight > 50, "the promises are not idle: {tight}");
}

#[test]
fn counts_by_inertia_are_those_of_dense_eigenvalues() {
    for (name, _, _, system) in random_systems(40) {
        let all = dense::eigenvalues(&system).expect("small").a;
        for k in [0, 1, all.len() / 3, all.len() - 1] {
            // Between two eigenvalues, if they are apart.
            let before = if k == 0 { all[0] - 0.1 } else { all[k - 1] };
            if all[k] - before < 1e-6 {
                continue;
            }
            let sigma = 0.5 * (before + all[k]);
            match eigenvalues_below(&system, Operator::A, sigma) {
                Ok(found) => assert_eq!(found.below, k, "{name} {sigma}"),
                Err(e) => assert!(e.to_string().contains("another shift"), "{name}: {e}"),
            }
        }
    }
}

#[test]
fn certificates_lie_below_the_spectrum_and_close() {
    for name in ["quad-sphere:4", "prism:51", "irregular-quad:1000", "cube"] {
        let system = assemble(&named(name), Scheme::CatmullClark);
        let all = dense::full_eigenvalues(&system).expect("small");
        for (operator, values) in [(Operator::A, &all.a), (Operator::Jacobi, &all.jacobi)] {
            let (low, high) = (values[0], values[values.len() - 1]);
            let below = certify(&system, operator, End::Lowest, low).expect("fits");
            let below = below.expect("a factorization succeeds");
            assert!(below.bound <= low && below.bound > low - 1e-6, "{name} {below:?}");
            let above = certify(&system, operator, End::Highest, high).expect("fits");
            let above = above.expect("a factorization succeeds");
            assert!(above.bound >= high && above.bound < high + 1e-6, "{name} {above:?}");
            // What is no end of the spectrum is not certified.
            let wrong = certify(&system, operator, End::Lowest, low + 0.05).expect("fits");
            assert_eq!(wrong, None, "{name}");
        }
    }
}

/// On a torus the diagonal of S is 4/9 and its rows sum to 1: what rounding may hide, by the theorem's formula.
#[test]
fn the_margin_of_a_certificate_is_that_of_the_theorem() {
    let system = assemble(&named("torus:20x14"), Scheme::CatmullClark);
    let (n, u) = (280.0, 0.5 * f64::EPSILON);
    for (end, estimate, outwards) in [(End::Lowest, 1.0 / 9.0, -1.0), (End::Highest, 1.0, 1.0)] {
        let found = certify(&system, Operator::A, end, estimate).expect("small").expect("an end");
        let gamma = (n + 1.0) * u / (1.0 - (n + 1.0) * u);
        let factor = gamma / (1.0 - gamma) * n * (4.0 / 9.0 - found.sigma).abs();
        let entries = 6.0 * u * (1.0 + found.sigma.abs());
        assert!((found.margin / (factor + entries) - 1.0).abs() < 1e-9, "{found:?}");
        assert!((found.bound - (found.sigma + outwards * found.margin)).abs() < u);
        assert!((found.sigma - estimate - outwards * 1e-8 * estimate).abs() < 1e-6 * 1e-8, "{found:?}");
    }
}

#[test]
fn odd_prisms_are_certified_where_the_valence_bound_is_nothing() {
    for k in [5, 9, 21, 101] {
        let system = assemble(&builtin::prism(k), Scheme::CatmullClark);
        assert_eq!(system.bounds.lambda_min, 0.0);
        let low = ends(&system).expect("small").lambda_min.value;
        // theory: 0.82/k²
        assert!((low * (k * k) as f64 - 0.82).abs() < 0.06, "prism {k}: {low}");
        let proof = certify(&system, Operator::A, End::Lowest, low).expect("fits");
        assert!(proof.is_some_and(|c| c.bound > 0.999 * low), "{k}: {proof:?}");
    }
}

#[test]
fn the_detective_knows_its_suspects() {
    let kernel = |name: &str| {
        let mesh = named(name);
        let topology = Topology::new(&mesh.faces, mesh.len());
        let verdict = Singularity::detect(&mesh, &topology, Scheme::CatmullClark);
        let system = assemble(&mesh, Scheme::CatmullClark);
        let by_numbers = numerical_kernel_dimension(&system).expect("small enough");
        assert_eq!(verdict.kernel_dimension(), by_numbers, "{name}");
        // The null vectors are null vectors.
        let x: Vec<f64> = verdict.colouring.iter().map(|&c| f64::from(c)).collect();
        for i in 0..mesh.len() {
            assert!(system.m.row_times_scalar(i, &x).abs() < 1e-12, "{name} {i}");
        }
        by_numbers
    };
    assert_eq!(kernel("cube"), 1);
    assert_eq!(kernel("truncated-octahedron"), 1);
    assert_eq!(kernel("cubes:7"), 7);
    assert_eq!(kernel("cubes:200"), 200);
    for k in 3..12 {
        assert_eq!(kernel(&format!("prism:{k}")), usize::from(k % 2 == 0));
    }
    for name in ["tetrahedron", "dodecahedron", "torus:6x8", "quad-sphere:1"] {
        assert_eq!(kernel(name), 0, "{name}");
    }
    // A singular and a regular component.
    let mesh = generate::union(&[named("prism:6"), named("torus:5x5"), named("prism:5")]);
    let topology = Topology::new(&mesh.faces, mesh.len());
    let verdict = Singularity::detect(&mesh, &topology, Scheme::CatmullClark);
    assert_eq!((verdict.components, verdict.kernel_dimension()), (3, 1));
    assert_eq!(verdict.singular[0].vertices, 12);
    assert!(verdict.colouring[12..].iter().all(|&c| c == 0));
    for scheme in [Scheme::Nasri, Scheme::ZhengCai] {
        assert!(!Singularity::detect(&mesh, &topology, scheme).is_singular());
    }
}

/// A cube with one corner moved by δ has a part δ/8 along ±1, which no control points reach.
#[test]
fn a_part_out_of_reach_is_told_from_rounding() {
    let verdict = |mesh: &Mesh| {
        let topology = Topology::new(&mesh.faces, mesh.len());
        Singularity::detect(mesh, &topology, Scheme::CatmullClark)
    };
    for size in [1.0, 1e-6, 1e6] {
        let mut cube = named("cube");
        cube.positions.iter_mut().for_each(|p| *p *= size);
        for moved in [1e-2, 1e-4, 1e-6, 1e-9, 1e-12] {
            let mut mesh = cube.clone();
            mesh.positions[5].y += moved * size;
            let found = verdict(&mesh);
            assert!(found.excited, "{moved:e} of {size:e}");
            let part = found.singular[0].unreachable;
            assert!((part.length() - moved * size / 8.0).abs() < 1e-15 * size, "{moved:e} of {size:e}: {part}");
            if moved >= 1e-9 {
                // What is left of the error at the end, at every vertex.
                let stop = Stop { tolerance: 1e-3 * moved * size, max_iterations: 1000 };
                let system = assemble(&mesh, Scheme::CatmullClark);
                let report = run(&system, &mesh.positions, Setup::Pia { omega: 1.0 }, &stop).report;
                assert_ne!(report.outcome, Outcome::Converged);
                assert!((report.last().mean / part.length() - 1.0).abs() < 1e-3, "{moved:e} of {size:e}");
            }
        }
        // Turned, so that the coordinates are rounded.
        let turn = glam::DQuat::from_euler(glam::EulerRot::XYZ, 0.3, 1.1, -0.7);
        cube.positions.iter_mut().for_each(|p| *p = turn * *p);
        assert!(!verdict(&cube).excited, "{size:e}");
    }
    assert!(!verdict(&named("prism:1000")).excited);
}

#[test]
fn methods_do_on_singular_meshes_what_was_predicted() {
    for name in ["cube", "prism:8", "truncated-octahedron", "cubes:3"] {
        for excited in [false, true] {
            let mut mesh = named(name);
            if excited {
                add_noise(&mut mesh, 0.1, 1);
            }
            let topology = Topology::new(&mesh.faces, mesh.len());
            let verdict = Singularity::detect(&mesh, &topology, Scheme::CatmullClark);
            assert!(verdict.is_singular());
            assert_eq!(verdict.excited, excited, "{name}");
            let system = assemble(&mesh, Scheme::CatmullClark);
            let stop = Stop { tolerance: 1e-10 * mesh.diagonal(), max_iterations: 2000 };
            let spectrum = || limitlab::analysis::spectrum::spectrum(&system);
            for method in Method::ALL {
                let mut setup = comparison::standard_setup(&system, method, None, &spectrum).expect("dense spectra");
                if let Setup::Chebyshev { spectrum } = &mut setup {
                    let all = dense::eigenvalues(&system).expect("small").a;
                    spectrum.0 = all.into_iter().find(|&l| l > 1e-10).expect("not all zero");
                }
                let solution = run(&system, &mesh.positions, setup, &stop);
                let outcome = solution.report.outcome;
                let prediction = verdict.prediction(method);
                let expected = match prediction {
                    Prediction::Converges => panic!("{name} is singular"),
                    Prediction::Refuses => outcome == Outcome::Singular,
                    // Without fill the incomplete factor may break down: a result of its own.
                    _ if method == Method::PcgIc0 && outcome == Outcome::Breakdown => true,
                    Prediction::Drifts => outcome != Outcome::Converged,
                    Prediction::MinimumNorm | Prediction::SomeSolution => outcome == Outcome::Converged,
                };
                assert!(expected, "{name} {method} {outcome:?}, {prediction:?}");
                if prediction == Prediction::MinimumNorm {
                    let part: DVec3 = verdict
                        .colouring
                        .iter()
                        .zip(&solution.points)
                        .zip(&system.h)
                        .map(|((&c, &v), h)| f64::from(c) * v / *h)
                        .sum();
                    assert!(part.length() < 1e-8, "{name} {method}: {part}");
                }
            }
        }
    }
}

#[test]
fn two_quads_back_to_back_have_a_negative_eigenvalue() {
    let positions = vec![DVec3::ZERO, DVec3::X, DVec3::X + DVec3::Y, DVec3::Y];
    let mesh = Mesh::new(positions, Faces::from_lists([[0u32, 1, 2, 3], [3, 2, 1, 0]]));
    let topology = Topology::new(&mesh.faces, mesh.len());
    let system = LimitSystem::with_masks(&mesh, &topology, &Scheme::CatmullClark).expect("small");
    let all = dense::eigenvalues(&system).expect("small");
    assert!((all.a[0] + 1.0 / 7.0).abs() < 1e-14, "{:?}", all.a);
    assert!(system.bounds.lambda_min <= all.a[0] + 1e-14);
    assert!(system.bounds.jacobi_lambda_min <= all.jacobi[0] + 1e-14);
    // PIA diverges from a start that has a part in that mode.
    let mut points = mesh.positions.clone();
    points[0].z += 0.1;
    let stop = Stop { tolerance: 1e-10, max_iterations: 2000 };
    let report = run(&system, &points, Setup::Pia { omega: 1.0 }, &stop).report;
    assert_eq!(report.outcome, Outcome::Diverged);
}

#[test]
fn spectral_radii_of_sweeps_agree_with_dense_ones() {
    for (name, scheme) in [
        ("quad-sphere:3", Scheme::CatmullClark),
        ("irregular-quad:500", Scheme::Nasri),
        ("icosphere:2", Scheme::Loop),
        ("irregular-quad:560", Scheme::CatmullClark),
    ] {
        let system = assemble(&named(name), scheme);
        let zero = vec![DVec3::ZERO; system.len()];
        for omega in [0.8, 1.0, 1.3] {
            let plain = |x: &mut [DVec3]| sweep(&system, &zero, omega, 0..zero.len(), x);
            let both = |x: &mut [DVec3]| symmetric_sweep(&system, &zero, omega, None, x);
            let exact = dense::spectral_radius(&system, plain).expect("small");
            let found = spectral_radius(&system, plain).expect("a value");
            assert!((found.value - exact).abs() < 1e-5 * exact, "{name} SOR({omega}): {found:?} {exact}");
            let exact = dense::spectral_radius(&system, both).expect("small");
            let found = spectral_radius(&system, both).expect("a value");
            assert!((found.value - exact).abs() < 1e-5 * exact, "{name} SSOR({omega}): {found:?} {exact}");
        }
    }
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let system = assemble(&named("irregular-quad:9000"), Scheme::CatmullClark);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| {
            let modes = modes(&system, Operator::A, End::Lowest, 3).expect("modes");
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
    let s = symmetric(&system, Operator::A);
    let ask = |count| Request { end: End::Lowest, count, tolerance: 1e-9, spectrum: (0.0, 1.0) };
    assert!(extreme(&s, &ask(60)).is_err());
    let tiny = symmetric(&assemble(&named("cube"), Scheme::CatmullClark), Operator::A);
    let message = extreme(&tiny, &ask(1)).expect_err("too small").to_string();
    assert!(message.contains("dense"), "{message}");
}

#[test]
fn greedy_and_ordered_sweeps_solve_the_same_system() {
    let mut mesh = named("irregular-quad:400");
    add_noise(&mut mesh, 0.1, 1);
    let topology = Topology::new(&mesh.faces, mesh.len());
    for scheme in [Scheme::CatmullClark, Scheme::Nasri, Scheme::ZhengCai] {
        let system = assemble(&mesh, scheme);
        let stop = Stop { tolerance: 1e-10 * mesh.diagonal(), max_iterations: 2000 };
        let greedy = gauss_southwell(&system, &mesh.positions, &stop);
        assert_eq!(greedy.outcome, Outcome::Converged);
        assert!(greedy.max_error <= 1.01 * stop.tolerance);
        let direct = run(&system, &mesh.positions, Setup::Cholesky, &stop).points;
        for (a, b) in greedy.points.iter().zip(&direct) {
            assert!(a.distance(*b) < 1e-6 * mesh.diagonal());
        }
        let rows = order_study(&mesh, &topology, &system, &[1.0], 5, &stop).expect("rows");
        assert_eq!(rows.len(), 7 + 5 + 1);
        assert!(rows.iter().all(|r| r.outcome == Outcome::Converged));
        let spread = random_spread(&rows, 1.0).expect("five random orders");
        assert!(spread.rho[0] <= spread.rho[1] && spread.rho[1] <= spread.rho[2]);
        // SOR converges in every order; the reverse order has the transposed matrix's spectrum.
        let rho = |name: &str| rows.iter().find(|r| r.order == name).and_then(|r| r.rho);
        let (forward, backward) = (rho("file").expect("a row"), rho("reverse").expect("a row"));
        assert!((forward - backward).abs() < 1e-6 * forward);
    }
}

#[test]
fn the_spread_is_that_of_the_random_orders_at_one_omega() {
    let row = |order: &str, omega, rho, iterations| order_study::Row {
        order: order.into(),
        omega,
        rho: Some(rho),
        outcome: Outcome::Converged,
        iterations,
        max_error: 0.0,
    };
    let rows = [
        row("file", 1.0, 0.1, 1.0),
        row("random:1", 1.0, 0.5, 20.0),
        row("random:2", 1.0, 0.25, 26.0),
        row("random:3", 1.0, 0.75, 23.0),
        row("random:1", 1.1, 0.9, 90.0),
    ];
    let found = random_spread(&rows, 1.0).expect("three rows");
    assert_eq!((found.omega, found.runs), (1.0, 3));
    assert_eq!((found.rho, found.iterations), ([0.25, 0.5, 0.75], [20.0, 23.0, 26.0]));
    assert_eq!(random_spread(&rows, 1.1).expect("a row").rho, [0.9; 3]);
    assert_eq!(random_spread(&rows, 1.2), None);
}

#[test]
fn greedy_sweeps_count_as_many_updates_as_there_are_vertices() {
    let mut mesh = named("torus:8x6");
    add_noise(&mut mesh, 0.1, 1);
    let system = assemble(&mesh, Scheme::CatmullClark);
    for sweeps in [0, 1, 3] {
        let stop = Stop { tolerance: 0.0, max_iterations: sweeps };
        let greedy = gauss_southwell(&system, &mesh.positions, &stop);
        assert_eq!((greedy.outcome, greedy.updates), (Outcome::MaxIterations, 48 * sweeps));
    }
}

/// Without a proven bound the interval starts a little below the computed λ_min, or at 10⁻³ where that vanishes.
#[test]
fn an_estimated_chebyshev_interval_holds_the_spectrum() {
    for name in ["prism:5", "dodecahedron", "cube"] {
        let system = assemble(&named(name), Scheme::CatmullClark);
        assert_eq!(system.bounds.lambda_min, 0.0);
        let least = dense::eigenvalues(&system).expect("small").a[0];
        let spectrum = || limitlab::analysis::spectrum::spectrum(&system);
        let setup = comparison::standard_setup(&system, Method::Chebyshev, None, &spectrum).expect("dense spectra");
        let Setup::Chebyshev { spectrum: (low, high) } = setup else { panic!("{setup:?}") };
        assert_eq!(high, 1.0);
        if name == "cube" {
            assert_eq!(low, 1e-3);
        } else {
            assert!((0.95 * least..0.99 * least).contains(&low), "{name}: {low} for {least}");
        }
    }
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
