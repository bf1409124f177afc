//! Counts by inertia and certified lower bounds.

use super::{assemble, named, random_systems};
use limitlab::analysis::dense;
use limitlab::analysis::inertia::{certify, eigenvalues_below};
use limitlab::analysis::spectrum::ends;
use limitlab::analysis::subspace_iteration::End;
use limitlab::analysis::symmetric::SymmetricForm;
use limitlab::mesh::builtin;
use limitlab::schemes::Scheme;

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
            match eigenvalues_below(&system, SymmetricForm::A, sigma) {
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
        for (operator, values) in [(SymmetricForm::A, &all.a), (SymmetricForm::Jacobi, &all.jacobi)] {
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
        let found = certify(&system, SymmetricForm::A, end, estimate).expect("small").expect("an end");
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
        let proof = certify(&system, SymmetricForm::A, End::Lowest, low).expect("fits");
        assert!(proof.is_some_and(|c| c.bound > 0.999 * low), "{k}: {proof:?}");
    }
}
