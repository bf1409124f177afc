//! Which systems are singular, and what methods do on them.

use super::{assemble, named};
use glam::DVec3;
use limitlab::analysis::singularity::{Prediction, Singularity, numerical_kernel_dimension};
use limitlab::analysis::{comparison, dense};
use limitlab::assemble::LimitSystem;
use limitlab::mesh::noise::add_noise;
use limitlab::mesh::{Mesh, Surface, generate};
use limitlab::schemes::{Masks, Scheme};
use limitlab::solvers::{Method, Outcome, Stop, run};

/// The dimension of the kernel, by theory and by numbers.
fn kernel_of(mesh: &Mesh, scheme: Scheme, name: &str) -> usize {
    let surface = Surface::new(mesh.clone()).unwrap();
    let verdict = Singularity::detect(&surface, scheme);
    let system = LimitSystem::new(&surface, scheme).expect("a system");
    let by_numbers = numerical_kernel_dimension(&system).expect("small enough");
    assert_eq!(verdict.kernel_dimension(), by_numbers, "{name}");
    // The null vectors are null vectors.
    let x: Vec<f64> = verdict.colouring.iter().map(|&c| f64::from(c)).collect();
    for i in 0..mesh.len() {
        assert!(system.m.row_times(i, &x).abs() < 1e-12, "{name} {i}");
    }
    by_numbers
}

#[test]
fn the_mid_edge_matrix_is_singular_on_bipartite_components() {
    let kernel = |name: &str| kernel_of(&named(name), Scheme::MidEdge, name);
    // Quads on a sphere, of any valence; even polygons; tori with even sides.
    for name in ["cube", "irregular-quad:300", "quad-sphere:2", "truncated-octahedron", "torus:6x8", "prism:6"] {
        assert_eq!(kernel(name), 1, "{name}");
    }
    assert_eq!(kernel("cubes:7"), 7);
    for name in ["tetrahedron", "dodecahedron", "torus:6x7", "tri-torus:6x6", "irregular-poly:300", "prism:5"] {
        assert_eq!(kernel(name), 0, "{name}");
    }
    let both = generate::union(&[named("quad-sphere:1"), named("icosahedron")]);
    assert_eq!(kernel_of(&both, Scheme::MidEdge, "a quad sphere and an icosahedron"), 1);
}

#[test]
fn the_detective_knows_its_suspects() {
    let kernel = |name: &str| kernel_of(&named(name), Scheme::CatmullClark, name);
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
    let surface = Surface::new(mesh).unwrap();
    let verdict = Singularity::detect(&surface, Scheme::CatmullClark);
    assert_eq!((verdict.components, verdict.kernel_dimension()), (3, 1));
    assert_eq!(verdict.singular[0].vertices, 12);
    assert!(verdict.colouring[12..].iter().all(|&c| c == 0));
    for scheme in [Scheme::Nasri, Scheme::ZhengCai] {
        assert!(!Singularity::detect(&surface, scheme).is_singular());
    }
}

/// A cube with one corner moved by δ has a part δ/8 along ±1, which no control points reach.
#[test]
fn a_part_out_of_reach_is_told_from_rounding() {
    let verdict = |mesh: &Mesh| {
        let surface = Surface::new(mesh.clone()).unwrap();
        Singularity::detect(&surface, Scheme::CatmullClark)
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
                let report = run(&system, &mesh.positions, Method::Pia, &stop).report;
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
            let surface = Surface::new(mesh).unwrap();
            let verdict = Singularity::detect(&surface, Scheme::CatmullClark);
            assert!(verdict.is_singular());
            assert_eq!(verdict.excited, excited, "{name}");
            let system = LimitSystem::new(&surface, Scheme::CatmullClark).expect("a system");
            let stop = Stop { tolerance: 1e-10 * surface.diagonal(), max_iterations: 2000 };
            let spectrum = || limitlab::analysis::spectrum::spectrum(&system);
            for method in Method::ALL {
                let mut method = comparison::with_spectrum(&system, method, &spectrum).expect("dense spectra");
                if let Method::Chebyshev { interval: Some(spectrum) } = &mut method {
                    let all = dense::eigenvalues(&system).expect("small").a;
                    spectrum.0 = all.into_iter().find(|&l| l > 1e-10).expect("not all zero");
                }
                let solution = run(&system, surface.positions(), method, &stop);
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

/// Edges alone and a weight at the vertex below the valence: on the cube λ = (9/4 ± 1)/(9/4 + 3) and (9/4 ± 3)/(9/4 + 3).
struct Light;

impl Masks for Light {
    fn h(&self, n: usize) -> f64 {
        1.0 / (2.25 + n as f64)
    }
    fn vertex_weight(&self, _: usize) -> f64 {
        2.25
    }
    fn edge_weight(&self) -> f64 {
        1.0
    }
    fn face_weight(&self, _: usize, _: usize) -> f64 {
        0.0
    }
    fn edges_only(&self) -> bool {
        true
    }
}

#[test]
fn own_masks_may_have_a_negative_eigenvalue() {
    let surface = Surface::new(named("cube")).unwrap();
    let system = LimitSystem::with_masks(&surface, &Light).expect("small");
    let all = dense::eigenvalues(&system).expect("small");
    assert!((all.a[0] + 1.0 / 7.0).abs() < 1e-14, "{:?}", all.a);
    assert!(system.bounds.lambda_min <= all.a[0] + 1e-14);
    assert!(system.bounds.jacobi_lambda_min <= all.jacobi[0] + 1e-14);
    // PIA diverges from a start that has a part in that mode.
    let mut points = surface.positions().to_vec();
    points[0].z += 0.1;
    let stop = Stop { tolerance: 1e-10, max_iterations: 2000 };
    let report = run(&system, &points, Method::Pia, &stop).report;
    assert_eq!(report.outcome, Outcome::Diverged);
}
