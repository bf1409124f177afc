//! Lin & Luo's eigenvalue condition, §6: it does not hold over all of [0, 2].

use limitlab::analysis::splitting::{LocalScheme, SplittingMatrix, condition_over_alpha, crossings};

use super::EIGEN;

/// Found with an independent implementation, to the digits given.
const CROSSINGS: [(usize, f64); 7] =
    [(3, 0.7992), (4, 1.716), (5, 1.817), (6, 1.886), (7, 1.923), (8, 1.942), (12, 1.961)];

#[test]
fn the_condition_ceases_to_hold_once_and_where_it_was_found_to() {
    for (n, alpha) in CROSSINGS {
        let found = crossings(n).unwrap();
        assert_eq!(found.len(), 1, "{n}");
        assert!((found[0].alpha - alpha).abs() < 5.1e-4, "{n} {}", found[0].alpha);
        assert!(!found[0].holds_above);
        assert_eq!(found[0].frequency, 0);
    }
    // From valence 21 on, a pair of frequency 2 is there first.
    assert_eq!(crossings(20).unwrap()[0].frequency, 0);
    for n in [21, 50, 100] {
        let found = crossings(n).unwrap();
        assert_eq!((found.len(), found[0].frequency), (1, 2));
        assert!(found[0].alpha > 1.75 && found[0].alpha < 1.95);
    }
}

/// The two sides of each crossing, with matrices read off at that very α: the sweep interpolates between three.
#[test]
fn matrices_on_both_sides_of_a_crossing_agree_with_the_sweep() {
    for n in [3, 4, 6, 12, 30] {
        let crossing = crossings(n).unwrap()[0];
        for (alpha, leads) in [(crossing.alpha - 1e-4, true), (crossing.alpha + 1e-4, false)] {
            let scheme = LocalScheme::Sqrt3 { alpha };
            assert_eq!(SplittingMatrix::new(scheme, n).unwrap().pair_leads().unwrap(), leads);
        }
    }
}

#[test]
fn the_sweep_has_the_eigenvalues_of_the_matrices() {
    let alphas = [0.0, 0.3, 0.7, 1.0, 1.3, 2.0];
    for n in [3, 4, 5, 6, 9, 16] {
        for condition in condition_over_alpha(&[n], &alphas).unwrap() {
            let scheme = LocalScheme::Sqrt3 { alpha: condition.alpha };
            let matrix = SplittingMatrix::on_rings(scheme, n, 3).unwrap();
            let eigenvalues = matrix.eigenvalues().unwrap();
            for (ours, direct) in condition.lambda.iter().zip(&eigenvalues[1..]) {
                assert!((ours.norm() - direct.norm()).abs() < 1e-7, "{n} {}", condition.alpha);
            }
            assert_eq!(condition.holds, matrix.pair_leads().unwrap());
        }
    }
}

#[test]
fn for_four_edges_and_more_the_condition_holds_up_to_three_halves() {
    let valences: Vec<usize> = (4..=50).collect();
    let alphas: Vec<f64> = (0..=30).map(|k| k as f64 * 0.05).collect();
    for condition in condition_over_alpha(&valences, &alphas).unwrap() {
        assert!(condition.holds, "{condition:?}");
    }
}

/// The pair of frequency 1 stays at 1/9 there for every α; a rotation-invariant complex pair overtakes it.
#[test]
fn at_valence_three_a_complex_pair_leads() {
    let conditions = condition_over_alpha(&[3], &[0.0, 0.5, 1.0, 1.5, 2.0]).unwrap();
    let holds: Vec<bool> = conditions.iter().map(|c| c.holds).collect();
    assert_eq!(holds, [true, true, false, false, false]);
    let leading = conditions[2].lambda[0];
    assert!((leading.re - 0.0859).abs() < 5e-5 && (leading.im.abs() - 0.1020).abs() < 5e-5);
    assert_eq!(conditions[2].leading_frequency, 0);
    for condition in &conditions {
        let scheme = LocalScheme::Sqrt3 { alpha: condition.alpha };
        let pair = SplittingMatrix::new(scheme, 3).unwrap().leading_pair().unwrap();
        assert!((pair - 1.0 / 9.0).abs() < EIGEN);
    }
}

#[test]
fn the_third_eigenvalue_is_not_always_double() {
    let doubled = |n, alpha: f64| condition_over_alpha(&[n], &[alpha]).unwrap()[0].third_equals_fourth;
    // A simple rotation-invariant eigenvalue comes third at small valences, a pair of frequency 2 at large ones.
    assert!(!doubled(4, 0.0) && !doubled(5, 1.5) && !doubled(6, 1.0) && !doubled(4, 1.0));
    assert!(doubled(8, 1.0) && doubled(12, 0.0) && doubled(50, 1.0));
}

#[test]
fn valences_out_of_range_are_refused() {
    for n in [2, 101] {
        assert!(condition_over_alpha(&[n], &[0.0]).is_err());
        assert!(crossings(n).is_err());
    }
}
