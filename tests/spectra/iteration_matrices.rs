//! Iteration matrices: against their definition entry by entry, singular values by another library, Kahan's determinant,
//! and what theory says of sweeps and their reverses.

use std::f64::consts::{PI, TAU};

use super::{assemble, named, torus};
use glam::DVec3;
use limitlab::analysis::iteration_matrix::{Hump, IterationMatrix, Norm, outermost_eigenvalues, sort};
use limitlab::analysis::pseudospectrum::least_singular_values;
use limitlab::analysis::torus_symbol::{Colouring, eigenvalues, front, front_radius, stencil};
use limitlab::analysis::young::{Young, ordering_vector, sor_pair};
use limitlab::assemble::{LimitSystem, Operator, Stages};
use limitlab::mesh::order::Order;
use limitlab::mesh::validate::Boundary;
use limitlab::mesh::{Faces, Mesh, Surface};
use limitlab::schemes::Scheme;
use limitlab::solvers::Method;
use limitlab_factorizations::dense::{
    small_lu, small_singular_values, small_symmetric_eigen, small_symmetric_eigenvalues,
};
use nalgebra::{Complex, DMatrix};

fn entries(t: &IterationMatrix) -> DMatrix<f64> {
    DMatrix::from_fn(t.len(), t.len(), |i, j| t.entry(i, j))
}

fn order_of(mesh: &Mesh, order: Order) -> Vec<u32> {
    let surface = Surface::new(mesh.clone()).expect("a closed mesh");
    order.order(surface.mesh(), surface.incidence())
}

/// I − N⁻¹A with N as textbooks have it, for a sweep in `order`.
/// A complex matrix as a real one of twice its size, which has its singular values and, of a Hermitian one, its eigenvalues.
fn real(matrix: &DMatrix<Complex<f64>>) -> DMatrix<f64> {
    let [rows, columns] = [matrix.nrows(), matrix.ncols()];
    DMatrix::from_fn(2 * rows, 2 * columns, |i, j| {
        let z = matrix[(i % rows, j % columns)];
        match (i < rows, j < columns) {
            (true, true) | (false, false) => z.re,
            (true, false) => -z.im,
            (false, true) => z.im,
        }
    })
}

fn sweep(system: &LimitSystem, omega: f64, order: &[u32]) -> DMatrix<f64> {
    let n = system.len();
    let place = limitlab::mesh::order::inverse(order);
    let a = DMatrix::from_fn(n, n, |i, j| system.a.get(i, j));
    let splitting = DMatrix::from_fn(n, n, |i, j| match place[j].cmp(&place[i]) {
        std::cmp::Ordering::Less => a[(i, j)],
        std::cmp::Ordering::Equal => a[(i, i)] / omega,
        std::cmp::Ordering::Greater => 0.0,
    });
    DMatrix::identity(n, n) - small_lu(splitting).solve(&a).expect("a triangle without zeros on its diagonal")
}

#[test]
fn matrices_are_those_of_the_textbook_on_both_back_ends() {
    for (name, scheme) in
        [("prism:7", Scheme::CatmullClark), ("irregular-tri:30", Scheme::Loop), ("cube", Scheme::Nasri)]
    {
        let mesh = named(name);
        let system = assemble(&mesh, scheme);
        let n = system.len();
        let operator = Operator::new(&Surface::new(mesh.clone()).unwrap(), scheme).unwrap();
        let orders = [Order::File, Order::Multicolour, Order::Random(3)].map(|order| order_of(&mesh, order));
        let a = DMatrix::from_fn(n, n, |i, j| system.a.get(i, j));
        let identity = DMatrix::<f64>::identity(n, n);
        let scaled = DMatrix::from_fn(n, n, |i, j| a[(i, j)] / a[(i, i)]);
        let mut cases = vec![
            (Method::Pia, &identity - &a),
            (Method::WPia { omega: Some(1.3) }, &identity - 1.3 * &a),
            (Method::Thall, &identity - 0.5 * &scaled),
            (Method::Jacobi { omega: Some(0.7) }, &identity - 0.7 * &scaled),
        ];
        for sweeps in &orders {
            let reverse: Vec<u32> = sweeps.iter().rev().copied().collect();
            let order = Some(&sweeps[..]);
            cases.push((Method::GaussSeidel { order }, sweep(&system, 1.0, sweeps)));
            cases.push((Method::Sor { omega: 1.4, order }, sweep(&system, 1.4, sweeps)));
            let both = sweep(&system, 0.8, &reverse) * sweep(&system, 0.8, sweeps);
            cases.push((Method::Ssor { omega: 0.8, order }, both));
        }
        cases.push((Method::GaussSeidel { order: None }, sweep(&system, 1.0, &orders[0])));
        for (method, expected) in cases {
            for t in [IterationMatrix::new(&system, method), IterationMatrix::new(&operator, method)] {
                let worst = (entries(&t.unwrap()) - &expected).abs().max();
                assert!(worst < 1e-13, "{name}, {method}: {worst:e}");
            }
        }
    }
    let system = assemble(&named("cube"), Scheme::Nasri);
    for method in Method::ALL {
        assert_eq!(IterationMatrix::new(&system, method).is_ok(), method.is_stationary(), "{method}");
    }
}

/// Kahan: det T = (1 − ω)^N for SOR, so that |ω − 1| ≤ ρ. Where M is definite: ‖T‖ < 1 in the energy norm, and its square is
/// the radius of SSOR, whose eigenvalues are real and not negative.
#[test]
fn sweeps_have_the_determinant_and_the_norm_of_theory() {
    let meshes = [("irregular-quad:30", Scheme::CatmullClark), ("irregular-tri:30", Scheme::Loop)];
    for (name, scheme) in meshes.into_iter().chain([("irregular-poly:40", Scheme::Nasri), ("star:5", Scheme::ZhengCai)])
    {
        let surface = Surface::new(named(name)).expect("a closed mesh");
        let system = assemble(&named(name), scheme);
        let n = system.len();
        for (order, omega) in [(Order::File, 1.5), (Order::Multicolour, 0.7), (Order::Bfs, 1.0), (Order::File, 1.1)] {
            let order = order.order(surface.mesh(), surface.incidence());
            let order = Some(&order[..]);
            let sor = IterationMatrix::new(&system, Method::Sor { omega, order }).unwrap();
            let values = sor.eigenvalues().unwrap();
            let radius = values[0].norm();
            assert!(values.windows(2).all(|z| z[0].norm() >= z[1].norm() - 1e-12), "{name}");
            assert!((omega - 1.0).abs() <= radius + 1e-12, "{name}: {omega} {radius}");
            if omega != 1.0 {
                let mean = values.iter().map(|z| z.norm().ln()).sum::<f64>() / n as f64;
                assert!((mean - (1.0 - omega).abs().ln()).abs() < 1e-6, "{name}: {mean}");
            } else {
                assert!(values[n - 1].norm() < 1e-12, "{name}: the first vertex forgets what it was");
            }
            let [energy, euclidean, _] = Norm::ALL.map(|norm| sor.norm(norm).unwrap());
            let energy = energy.expect("M is definite");
            assert!(euclidean.unwrap() >= radius - 1e-10 && energy >= radius - 1e-10, "{name}");
            let ssor = IterationMatrix::new(&system, Method::Ssor { omega, order }).unwrap();
            let values = ssor.eigenvalues().unwrap();
            assert!(energy < 1.0 && (energy * energy - values[0].re).abs() < 1e-9, "{name}, {scheme}: {energy}");
            assert!(values.iter().all(|z| z.im.abs() < 1e-9 && z.re > -1e-9), "{name}");
        }
    }
}

#[test]
fn norms_and_powers_agree_with_a_second_library() {
    let mesh = named("irregular-quad:40");
    let system = assemble(&mesh, Scheme::CatmullClark);
    let order = order_of(&mesh, Order::Bfs);
    let t = IterationMatrix::new(&system, Method::Sor { omega: 1.2, order: Some(&order) }).unwrap();
    let matrix = entries(&t);
    let n = matrix.nrows();
    // M^½ by an eigendecomposition, where the library has a Cholesky factor.
    let m = DMatrix::from_fn(n, n, |i, j| system.m.get(i, j));
    let eigen = small_symmetric_eigen(m, f64::EPSILON, 0).unwrap();
    let power = |p: f64| {
        let scale = DMatrix::from_diagonal(&eigen.eigenvalues.map(|x| x.powf(p)));
        &eigen.eigenvectors * scale * eigen.eigenvectors.transpose()
    };
    let largest = |matrix: &DMatrix<f64>| small_singular_values(matrix.clone())[0];
    let powers = t.powers(5, 0.0).unwrap();
    assert_eq!(powers.len(), 5);
    let mut power_of_t = DMatrix::identity(n, n);
    for norms in powers {
        power_of_t *= &matrix;
        let rows = power_of_t.row_iter().map(|row| row.iter().map(|x| x.abs()).sum::<f64>());
        let expected =
            [largest(&(power(0.5) * &power_of_t * power(-0.5))), largest(&power_of_t), rows.fold(0.0, f64::max)];
        for (found, expected) in norms.into_iter().zip(expected) {
            assert!((found.unwrap() - expected).abs() < 1e-8 * expected, "{found:?} {expected}");
        }
    }
    assert_eq!(Norm::ALL.map(|norm| t.norm(norm).unwrap()), t.powers(9, 2.0).unwrap()[0]);
    assert!(t.powers(99, 1e-3).unwrap().len() < 30);
}

/// A shift of order n has w = cos(π/(n + 1)) (a Jordan block), the norm 1 and ρ = 0; a normal matrix has w = ρ. By 720
/// angles and a dense eigendecomposition otherwise.
#[test]
fn numerical_radii_are_those_of_closed_forms_and_of_brute_force() {
    let system = assemble(&named("prism:7"), Scheme::CatmullClark);
    let n = system.len();
    let shift = IterationMatrix::of_step(&system, |x| {
        x.rotate_right(1);
        x[0] = DVec3::ZERO;
    });
    let shift = shift.unwrap();
    let expected = (PI / (n as f64 + 1.0)).cos();
    assert!((shift.numerical_radius().unwrap() - expected).abs() < 1e-9);
    assert!((shift.norm(Norm::Euclidean).unwrap().unwrap() - 1.0).abs() < 1e-12);
    // Powers of a shift vanish.
    assert_eq!(shift.powers(2 * n, 0.0).unwrap().last().unwrap()[1], Some(0.0));
    let sweep = IterationMatrix::new(&system, Method::Sor { omega: 1.5, order: None }).unwrap();
    let matrix = entries(&sweep).map(|x| Complex::new(x, 0.0));
    let at = |k: u32| {
        let turned = &matrix * Complex::from_polar(1.0, PI * f64::from(k) / 720.0);
        small_symmetric_eigenvalues(real(&((&turned + turned.adjoint()) * Complex::new(0.5, 0.0)))).max()
    };
    let brute = (0..=720).map(at).fold(0.0, f64::max);
    let found = sweep.numerical_radius().unwrap();
    assert!(found >= brute - 1e-9 && found <= brute * 1.00001, "{found} {brute}");
}

#[test]
fn the_outermost_eigenvalues_are_those_of_the_dense_matrix() {
    let system = assemble(&named("irregular-quad:120"), Scheme::CatmullClark);
    // Colour by colour, where eigenvalues are well conditioned.
    let order = order_of(&named("irregular-quad:120"), Order::Multicolour);
    let order = Some(&order[..]);
    for method in [Method::Sor { omega: 1.1, order }, Method::Ssor { omega: 1.0, order }, Method::Pia] {
        let all = IterationMatrix::new(&system, method).unwrap().eigenvalues().unwrap();
        let found = outermost_eigenvalues(&system, method, 6).unwrap();
        assert_eq!(found.len(), 6);
        for (ritz, expected) in found.iter().zip(&all) {
            assert!(ritz.residual < 1e-8 && (ritz.value - expected).norm() < 1e-7, "{method}: {ritz:?} {expected}");
        }
    }
    let mut values =
        [(-0.5, 0.0), (0.3, 0.4), (0.5, 0.0), (0.3, -0.4), (0.6, 0.0)].map(|(re, im)| Complex::new(re, im));
    sort(&mut values);
    assert_eq!(values.map(|z| (z.re, z.im)), [(0.6, 0.0), (0.5, 0.0), (0.3, 0.4), (0.3, -0.4), (-0.5, 0.0)]);
    assert_eq!(Hump::new([0.5, 0.4, 0.1], 0.5), Some(Hump { height: 1.6, length: 2 }));
}

#[test]
fn what_has_no_iteration_matrix_is_refused() {
    let system = assemble(&named("torus:50x50"), Scheme::CatmullClark);
    let message = IterationMatrix::new(&system, Method::Pia).unwrap_err().to_string();
    assert!(message.contains("2500 vertices"), "{message}");
    let message = outermost_eigenvalues(&system, Method::Cg, 3).unwrap_err().to_string();
    assert!(message.starts_with("cg has no iteration matrix"), "{message}");
    // No definite M, no energy: an even torus under mid-edge.
    let singular = assemble(&named("torus:4x4"), Scheme::MidEdge);
    let t = IterationMatrix::new(&singular, Method::GaussSeidel { order: None }).unwrap();
    assert!(!t.has_energy() && t.norm(Norm::Energy).unwrap().is_none());
}

/// Block Fourier analysis against dense matrices, on tori that are not square.
#[test]
fn symbols_of_coloured_sweeps_are_the_dense_eigenvalues() {
    for scheme in Scheme::ALL {
        let sides = if scheme.needs_triangles() { [6, 9] } else { [4, 6] };
        let colouring = Colouring::usual(scheme);
        let system = assemble(&torus(scheme, sides[0], sides[1]), scheme);
        // The stencil is that of the assembler.
        for (d, a) in stencil(scheme) {
            let at = |k: usize| (d[k] + sides[k] as i32) as usize % sides[k];
            let entry = system.a.get(0, at(0) * sides[1] + at(1));
            assert!((entry - a).abs() < 1e-15, "{scheme} {d:?}: {entry} {a}");
        }
        let order = colouring.order(sides);
        for method in [
            Method::Pia,
            Method::Jacobi { omega: Some(0.7) },
            Method::GaussSeidel { order: Some(&order) },
            Method::Sor { omega: 1.3, order: Some(&order) },
            Method::Ssor { omega: 0.9, order: Some(&order) },
        ] {
            let dense = IterationMatrix::new(&system, method).unwrap().eigenvalues().unwrap();
            let symbols = eigenvalues(scheme, sides, method, &colouring).unwrap();
            assert_eq!(symbols.len(), dense.len(), "{scheme}, {method}");
            // Multiple eigenvalues of a matrix that is not normal are good to the root of rounding.
            for z in &symbols {
                let near = |w: &Complex<f64>| (w - z).norm() < 1e-6;
                let [here, there] = [&symbols, &dense].map(|all| all.iter().filter(|w| near(w)).count());
                assert_eq!(here, there, "{scheme}, {method}: {z}");
            }
        }
    }
    let refused = |sides, colouring: &Colouring| {
        eigenvalues(Scheme::Nasri, sides, Method::GaussSeidel { order: None }, colouring).unwrap_err().to_string()
    };
    assert!(refused([5, 6], &Colouring::usual(Scheme::Nasri)).contains("do not divide"));
    assert!(refused([6, 6], &Colouring::usual(Scheme::MidEdge)).contains("one colour"));
}

/// In the energy norm a sweep row by row acts as the symbol of a front where the torus is not cut: its powers are not below that of
/// the symbol for some steps, though its radius is.
#[test]
fn powers_of_a_front_follow_its_symbol_and_not_its_radius() {
    for (scheme, omega) in [(Scheme::CatmullClark, 1.1), (Scheme::Nasri, 1.1), (Scheme::ZhengCai, 1.0)] {
        let system = assemble(&torus(scheme, 16, 16), scheme);
        let surface = Surface::new(torus(scheme, 16, 16)).unwrap();
        let order = Order::Bfs.order(surface.mesh(), surface.incidence());
        let t = IterationMatrix::new(&system, Method::Sor { omega, order: Some(&order) }).unwrap();
        let (rho, symbol) = (t.eigenvalues().unwrap()[0].norm(), front_radius(scheme, omega, [64, 64]));
        let powers = t.powers(3, 0.0).unwrap();
        let rate = powers[2][0].unwrap().powf(1.0 / 3.0);
        assert!(rho < 0.85 * symbol, "{scheme}: {rho} {symbol}");
        assert!(rate > 0.95 * symbol, "{scheme}: {rate} {symbol}");
        // Of the other half plane the symbol is the conjugate.
        let theta = [0.7, -1.3];
        let diagonal = stencil(scheme)[0].1;
        let after: Complex<f64> = stencil(scheme)
            .iter()
            .filter(|(d, _)| *d > [0, 0])
            .map(|&(d, a)| a * Complex::from_polar(1.0, f64::from(d[0]) * theta[0] + f64::from(d[1]) * theta[1]))
            .sum();
        let expected = 1.0 - omega * (after + after.conj() + diagonal) / (diagonal + omega * after.conj());
        assert!((front(scheme, omega, theta) - expected).norm() < 1e-15);
    }
}

/// Young's relation between the eigenvalues of SOR and Jacobi: on an even torus under mid-edge by colours, and on the inner
/// vertices of an open grid row by row, the model problem of the textbooks.
#[test]
fn youngs_theory_holds_where_faces_do_not_couple() {
    let (p, q) = (7, 9);
    let points = (0..p * q).map(|v| DVec3::new((v / q) as f64, (v % q) as f64, 0.0)).collect();
    let cells = (0..p - 1).flat_map(|i| (0..q - 1).map(move |j| (i * q + j) as u32));
    let quads = cells.map(|v| [v, v + q as u32, v + q as u32 + 1, v + 1]);
    let open = Surface::examined(Mesh::new(points, Faces::from_lists(quads)), None, Boundary::EdgeAndCorner).unwrap();
    let grid = Stages::new(&open, Scheme::MidEdge, None).unwrap().block().clone();
    let torus_order = Colouring::usual(Scheme::MidEdge).order([6, 8]);
    let cosines = |n: usize, full: bool| {
        let angle = move |k: usize| if full { TAU * k as f64 / n as f64 } else { PI * (k + 1) as f64 / (n - 1) as f64 };
        (0..if full { n } else { n - 2 }).map(move |k| angle(k).cos()).collect::<Vec<f64>>()
    };
    for (system, order, sides, full) in [
        (&assemble(&named("torus:6x8"), Scheme::MidEdge), Some(&torus_order[..]), [6, 8], true),
        (&grid, None, [p, q], false),
    ] {
        assert!(ordering_vector(&system.a, order).is_some());
        let [a, b] = sides.map(|n| cosines(n, full));
        let mu: Vec<f64> = a.iter().flat_map(|a| b.iter().map(move |b| 0.5 * (a + b))).collect();
        for omega in [1.0, 1.2, 1.5] {
            let dense = IterationMatrix::new(system, Method::Sor { omega, order }).unwrap().eigenvalues().unwrap();
            for &mu in &mu {
                for wanted in sor_pair(mu, omega) {
                    let nearest = dense.iter().map(|z| (z - wanted).norm()).fold(f64::INFINITY, f64::min);
                    // Pairs that meet, and the many zeros of Gauss-Seidel, are defective.
                    assert!(nearest < 1e-5, "μ = {mu}, ω = {omega}: {wanted} is {nearest:e} away");
                }
            }
        }
    }
    let found = Young::new(&grid, None).unwrap();
    let mu = 0.5 * ((PI / 6.0).cos() + (PI / 8.0).cos());
    let omega = 2.0 / (1.0 + (1.0 - mu * mu).sqrt());
    assert!(found.consistent && (found.jacobi - mu).abs() < 1e-12 && (found.gauss_seidel - mu * mu).abs() < 1e-9);
    assert!((found.omega.unwrap() - omega).abs() < 1e-12 && (found.best.0 - omega).abs() < 2e-3, "{found:?}");
    // A pair that meets is good to the root of rounding.
    assert!((found.rho.unwrap() - (omega - 1.0)).abs() < 1e-6, "{found:?}");
    // Faces couple: not so.
    let faces = Young::new(&assemble(&named("torus:6x6"), Scheme::Nasri), None).unwrap();
    assert!(!faces.consistent && (faces.gauss_seidel - faces.jacobi.powi(2)).abs() > 0.05, "{faces:?}");
}

/// σ_min(z − T) by another library, in coordinates of its own.
#[test]
fn pseudospectra_are_those_of_singular_values() {
    let system = assemble(&named("prism:9"), Scheme::Nasri);
    let t = IterationMatrix::new(&system, Method::Sor { omega: 1.3, order: None }).unwrap();
    let n = t.len();
    let m = DMatrix::from_fn(n, n, |i, j| system.m.get(i, j));
    let eigen = small_symmetric_eigen(m, f64::EPSILON, 0).unwrap();
    let power = |p: f64| {
        let scale = DMatrix::from_diagonal(&eigen.eigenvalues.map(|x| x.powf(p)));
        &eigen.eigenvectors * scale * eigen.eigenvectors.transpose()
    };
    let in_energy = (power(0.5) * entries(&t) * power(-0.5)).map(|x| Complex::new(x, 0.0));
    let (re, im) = ([-0.6, -0.2, 0.1, 0.7], [0.0, 0.3]);
    let found = least_singular_values(&t, &re, &im).unwrap();
    for (j, &y) in im.iter().enumerate() {
        for (k, &x) in re.iter().enumerate() {
            let shifted = DMatrix::identity(n, n) * Complex::new(x, y) - &in_energy;
            let expected = small_singular_values(real(&shifted)).min();
            let found = found[j * re.len() + k];
            assert!((found - expected).abs() < 1e-5 * expected, "{x} + {y}i: {found} {expected}");
        }
    }
}
