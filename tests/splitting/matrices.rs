//! The matrices themselves, their eigenvalues, subspaces and masks.

use limitlab::analysis::splitting::{Blended, LocalScheme, SplittingMatrix, distance_to_space, rows};
use limitlab_factorizations::dense::eigenvalues;
use nalgebra::{Complex, DMatrix, DVector};

use super::{EIGEN, ROUNDING, SCHEMES};

const BLENDS: [LocalScheme; 10] = [
    LocalScheme::Sqrt3 { alpha: 0.5 },
    LocalScheme::Sqrt3 { alpha: 1.0 },
    LocalScheme::Sqrt3 { alpha: 1.5 },
    LocalScheme::LabsikGreiner,
    LocalScheme::Blend { of: Blended::CatmullClark, alpha: 0.5 },
    LocalScheme::Blend { of: Blended::CatmullClark, alpha: 1.0 },
    LocalScheme::Blend { of: Blended::Loop, alpha: 1.0 },
    LocalScheme::PushBack { of: Blended::CatmullClark, beta: 1.0 },
    LocalScheme::PushBack { of: Blended::Loop, beta: 0.5 },
    LocalScheme::Kobbelt,
];

#[test]
fn sizes_are_those_of_the_literature() {
    let size = |scheme, n| SplittingMatrix::new(scheme, n).unwrap().size();
    for n in [3, 6, 11] {
        assert_eq!(size(LocalScheme::CatmullClark, n), 2 * n + 1);
        assert_eq!(size(LocalScheme::Loop, n), n + 1);
        assert_eq!(size(LocalScheme::DooSabin, n), n);
        assert_eq!(size(LocalScheme::Sqrt3 { alpha: 0.0 }, n), n + 1);
        assert_eq!(size(LocalScheme::Sqrt3 { alpha: 1.0 }, n), 6 * n + 1);
    }
}

#[test]
fn a_matrix_closes_on_its_least_rings_and_no_fewer() {
    for scheme in BLENDS {
        for n in [3, 5, 6, 9] {
            let least = scheme.least_rings();
            for rings in 1..least {
                let refused = SplittingMatrix::on_rings(scheme, n, rings).unwrap_err().to_string();
                assert!(refused.contains(&format!("take {least} or more")), "{refused}");
            }
            assert!(SplittingMatrix::on_rings(scheme, n, least).is_ok());
        }
    }
}

#[test]
fn without_blending_the_matrix_is_the_scheme_s_own() {
    for (of, own) in [(Blended::CatmullClark, LocalScheme::CatmullClark), (Blended::Loop, LocalScheme::Loop)] {
        let plain = SplittingMatrix::new(LocalScheme::Blend { of, alpha: 0.0 }, 5).unwrap();
        assert!((plain.entries - SplittingMatrix::new(own, 5).unwrap().entries).amax() < ROUNDING);
    }
}

#[test]
fn valences_out_of_range_are_refused_with_the_range() {
    for n in [0, 2, 101, 1_000_000_000] {
        let refused = SplittingMatrix::new(LocalScheme::Loop, n).unwrap_err().to_string();
        assert!(refused.contains("outside 3..100"), "{refused}");
    }
}

#[test]
fn rows_sum_to_one_and_are_the_same_in_every_sector() {
    for scheme in SCHEMES.into_iter().chain(BLENDS) {
        for n in [3, 4, 5, 6, 7, 12, 50] {
            for rings in [scheme.least_rings(), 3] {
                let s = SplittingMatrix::on_rings(scheme, n, rings).unwrap();
                let sums = &s.entries * DVector::from_element(s.size(), 1.0);
                assert!(sums.iter().all(|x| (x - 1.0).abs() < ROUNDING), "{scheme} {n}");
                // The order of summation differs between sectors.
                assert!(s.circulance() < ROUNDING, "{scheme} {n} {:e}", s.circulance());
            }
        }
    }
}

/// The plain one-ring formulas, written out: an implementation that shares nothing with the refinement.
#[test]
fn loop_and_sqrt3_matrices_entry_by_entry() {
    for n in 3..=50 {
        let turn = std::f64::consts::TAU / n as f64;
        let root: f64 = 0.375 + 0.25 * turn.cos();
        let loop_vertex = 0.375 + root * root;
        let s = SplittingMatrix::new(LocalScheme::Loop, n).unwrap().entries;
        let expected = DMatrix::from_fn(n + 1, n + 1, |i, j| {
            let apart = (i + n - j.max(1)) % n;
            match (i, j) {
                (0, 0) => loop_vertex,
                (0, _) => (1.0 - loop_vertex) / n as f64,
                (_, 0) => 0.375,
                _ if apart == 0 => 0.375,
                // At valence 3 the two neighbours are distinct still.
                _ if apart == 1 || apart == n - 1 => 0.125,
                _ => 0.0,
            }
        });
        assert!((&s - &expected).amax() < ROUNDING, "Loop {n}");

        // √3, two steps: q_j = (v + e_j + e_{j+1})/3, v' = (1−a)v + a·mean(e); then v'' = (1−a)v' + a·mean(q),
        // e''_j = (v' + q_{j−1} + q_j)/3.
        let a = (4.0 - 2.0 * turn.cos()) / 9.0;
        let share = 1.0 / n as f64;
        let s = SplittingMatrix::new(LocalScheme::Sqrt3 { alpha: 0.0 }, n).unwrap().entries;
        let expected = DMatrix::from_fn(n + 1, n + 1, |i, j| {
            let apart = (i + n - j.max(1)) % n;
            let around = match apart {
                0 => 2.0 / 9.0,
                _ if apart == 1 || apart == n - 1 => 1.0 / 9.0,
                _ => 0.0,
            };
            match (i, j) {
                (0, 0) => (1.0 - a) * (1.0 - a) + a / 3.0,
                (0, _) => share * ((1.0 - a) * a + a * 2.0 / 3.0),
                (_, 0) => (1.0 - a) / 3.0 + 2.0 / 9.0,
                _ => a * share / 3.0 + around,
            }
        });
        assert!((&s - &expected).amax() < ROUNDING, "√3 {n}: {:e}", (&s - &expected).amax());
    }
}

#[test]
fn eigenvalues_masks_and_subspaces_meet_the_closed_forms() {
    let valences: Vec<usize> = (3..=50).collect();
    for scheme in SCHEMES {
        for row in rows(scheme, &valences).unwrap() {
            let n = row.valence;
            assert!(row.eigenvalue_error.unwrap() < EIGEN, "{scheme} {n} {:?}", row.eigenvalue_error);
            let formula = row.lambda_subdominant_formula.unwrap();
            assert!((row.lambda_subdominant - formula).norm() < EIGEN, "{scheme} {n}");
            assert!(row.limit_mask_error.unwrap() < EIGEN, "{scheme} {n}");
            assert!(row.tangent_mask_distance.unwrap() < EIGEN, "{scheme} {n} {:?}", row.tangent_mask_distance);
            assert!(row.residual_right < EIGEN, "{scheme} {n} {:e}", row.residual_right);
            assert!(row.residual_left < EIGEN, "{scheme} {n} {:e}", row.residual_left);
            let [cosine, sine] = row.tangent_masks.unwrap();
            let (first, turn) = (scheme.layout().centre(), std::f64::consts::TAU / n as f64);
            for j in 0..n {
                let (s, c) = (turn * j as f64).sin_cos();
                assert!((cosine[first + j] - c).abs() < EIGEN && (sine[first + j] - s).abs() < EIGEN);
            }
        }
    }
}

/// A dense eigenvalue computation of the whole matrix, which knows nothing of Fourier blocks.
#[test]
fn blocks_have_the_eigenvalues_of_the_whole_matrix() {
    for scheme in SCHEMES {
        for n in [3, 4, 5, 6, 7, 8, 13, 50] {
            let s = SplittingMatrix::new(scheme, n).unwrap();
            let ours = s.eigenvalues().unwrap();
            let whole = faer::Mat::from_fn(s.size(), s.size(), |i, j| s.entries[(i, j)]);
            let mut theirs: Vec<Complex<f64>> = eigenvalues(&whole).unwrap();
            assert_eq!(ours.len(), theirs.len());
            for z in ours {
                let nearest = (0..theirs.len())
                    .min_by(|&i, &j| (theirs[i] - z).norm().total_cmp(&(theirs[j] - z).norm()))
                    .unwrap();
                let w = theirs.swap_remove(nearest);
                // Multiple eigenvalues of a matrix that is not normal: the square root of rounding.
                assert!((z - w).norm() < 1e-7, "{scheme} {n}: {z} {w}");
            }
        }
    }
}

/// Traces of powers do not suffer from defective eigenvalues.
#[test]
fn traces_of_powers_are_power_sums_of_eigenvalues() {
    for scheme in SCHEMES.into_iter().chain(BLENDS) {
        for n in [3, 4, 6, 9] {
            let s = SplittingMatrix::on_rings(scheme, n, 3).unwrap();
            let eigenvalues = s.eigenvalues().unwrap();
            let mut power = s.entries.clone();
            for k in 1..=4 {
                let sum: Complex<f64> = eigenvalues.iter().map(|z| z.powi(k)).sum();
                assert!((sum - power.trace()).norm() < 1e-11, "{scheme} {n} {k}");
                power = &power * &s.entries;
            }
        }
    }
}

#[test]
fn invariant_subspaces_fill_the_space_also_where_eigenvalues_are_defective() {
    for scheme in SCHEMES.into_iter().chain(BLENDS) {
        for n in [3, 4, 5, 6, 8, 20] {
            for rings in [scheme.least_rings(), 3] {
                let s = SplittingMatrix::on_rings(scheme, n, rings).unwrap();
                let spaces = s.eigenspaces().unwrap();
                let total: usize = spaces.iter().map(|e| e.multiplicity()).sum();
                assert_eq!(total, s.size(), "{scheme} {n} {rings}");
                for space in &spaces {
                    assert_eq!(space.left.ncols(), space.right.ncols());
                    let gram = space.right.transpose() * &space.right;
                    let identity = DMatrix::identity(gram.nrows(), gram.nrows());
                    assert!((gram - identity).amax() < EIGEN);
                    for residual in space.residuals(&s.entries) {
                        assert!(residual < EIGEN, "{scheme} {n} {rings} λ = {} {residual:e}", space.value);
                    }
                }
                // Left spaces annihilate the right spaces of other eigenvalues.
                let product = spaces[0].left.transpose() * &spaces[1].right;
                assert!(product.amax() < EIGEN, "{scheme} {n} {rings}");
            }
        }
    }
}

#[test]
fn more_rings_keep_the_leading_eigenvalues_and_the_masks() {
    for scheme in SCHEMES {
        for n in [3, 5, 8] {
            let small = SplittingMatrix::new(scheme, n).unwrap();
            let large = SplittingMatrix::on_rings(scheme, n, 3).unwrap();
            let (a, b) = (small.limit_mask().unwrap(), large.limit_mask().unwrap());
            assert!((b.rows(0, small.size()) - &a).amax() < EIGEN, "{scheme} {n}");
            assert!(b.rows(small.size(), large.size() - small.size()).amax() < EIGEN);
            let (a, b) = (small.eigenvalues().unwrap(), large.eigenvalues().unwrap());
            assert!((a[1] - b[1]).norm() < EIGEN && (a[2] - b[2]).norm() < EIGEN);
        }
    }
}

#[test]
fn the_interpolating_scheme_keeps_its_vertex() {
    for n in [3, 4, 5, 6, 7, 30] {
        for scheme in BLENDS {
            if let LocalScheme::Sqrt3 { alpha }
            | LocalScheme::Blend { alpha, .. }
            | LocalScheme::PushBack { beta: alpha, .. } = scheme
                && alpha != 1.0
            {
                continue;
            }
            let s = SplittingMatrix::new(scheme, n).unwrap();
            let mask = s.limit_mask().unwrap();
            assert!((mask[0] - 1.0).abs() < EIGEN);
            assert!(mask.rows(1, s.size() - 1).amax() < EIGEN, "{scheme} {n}");
        }
    }
}

/// A mask is the limit of powers: S^k tends to 1·lᵀ.
#[test]
fn powers_tend_to_the_limit_mask() {
    for scheme in SCHEMES.into_iter().chain(BLENDS) {
        for n in [3, 4, 7] {
            let s = SplittingMatrix::new(scheme, n).unwrap();
            let power = s.entries.pow(128);
            let mask = s.limit_mask().unwrap();
            for row in power.row_iter() {
                assert!((row.transpose() - &mask).amax() < EIGEN, "{scheme} {n}");
            }
        }
    }
}

#[test]
fn distances_to_a_subspace() {
    let basis = DMatrix::from_column_slice(3, 1, &[1.0, 0.0, 0.0]);
    assert_eq!(distance_to_space(&DVector::from_vec(vec![2.0, 0.0, 0.0]), &basis), 0.0);
    assert_eq!(distance_to_space(&DVector::from_vec(vec![0.0, 3.0, 0.0]), &basis), 1.0);
}
