//! Counts by inertia and certified bounds.

use super::{assemble, named, random_systems, torus, torus_symbols};
use crate::common::tol;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, SymbolicCholeskyRaw, SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Par, Side};
use limitlab::analysis::dense;
use limitlab::analysis::inertia::{LARGEST_BACKWARD_ERROR, certify, certify_at, eigenvalues_below, rayleigh_enclosure};
use limitlab::analysis::subspace_iteration::End;
use limitlab::analysis::symmetric::{SymmetricForm, symmetric};
use limitlab::assemble::{Csr, LimitSystem};
use limitlab::mesh::builtin;
use limitlab::schemes::{Masks, Scheme};
use nalgebra_sparse::{CooMatrix, CsrMatrix};

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

/// Both ends of A and of D⁻¹A, with the dense eigenvalues there.
fn four_ends(all: &dense::Eigenvalues) -> [(SymmetricForm, End, f64); 4] {
    let last = all.a.len() - 1;
    [
        (SymmetricForm::A, End::Lowest, all.a[0]),
        (SymmetricForm::A, End::Highest, all.a[last]),
        (SymmetricForm::Jacobi, End::Lowest, all.jacobi[0]),
        (SymmetricForm::Jacobi, End::Highest, all.jacobi[last]),
    ]
}

#[test]
fn certificates_enclose_dense_eigenvalues_under_every_scheme() {
    let mut tried = 0;
    for (name, _, _, system) in random_systems(24) {
        let all = dense::full_eigenvalues(&system).expect("small");
        let slack = tol::eigenvalues(system.len(), 4.0);
        for (form, end, exact) in four_ends(&all) {
            let found = certify(&system, form, end, exact, 1e-10).expect("fits").expect("an end");
            let (low, high) = match end {
                End::Lowest => (found.bound, found.attained),
                End::Highest => (found.attained, found.bound),
            };
            assert!(low <= exact + slack && exact - slack <= high, "{name} {form:?} {end:?}: {found:?} {exact}");
            assert!(low <= high && high - low < 4e-10, "{name} {form:?} {end:?}: {found:?} {exact}");
            // What is no end of the spectrum is not certified.
            let inwards = if end == End::Lowest { 0.05 } else { -0.05 };
            assert_eq!(certify(&system, form, end, exact + inwards, 1e-10).expect("fits"), None, "{name}");
            tried += 1;
        }
    }
    assert!(tried > 200, "{tried}");
}

/// Tori by the symbols, prisms by theirs: λ_min is rational or a trigonometric number, and no other computation is asked.
#[test]
fn certificates_enclose_closed_forms() {
    for (scheme, n, m) in [
        (Scheme::CatmullClark, 20, 14),
        (Scheme::CatmullClark, 9, 7),
        (Scheme::Nasri, 9, 8),
        (Scheme::ZhengCai, 11, 5),
        (Scheme::Loop, 12, 9),
        (Scheme::Sqrt3, 10, 7),
        (Scheme::MidEdge, 9, 9),
        (Scheme::MidEdge, 8, 6),
    ] {
        let system = assemble(&torus(scheme, n, m), scheme);
        let symbols = torus_symbols(scheme, n, m);
        let a_ii = system.diagonal[0];
        let last = symbols.len() - 1;
        for (form, scale) in [(SymmetricForm::A, 1.0), (SymmetricForm::Jacobi, a_ii)] {
            for (end, exact) in [(End::Lowest, symbols[0] / scale), (End::Highest, symbols[last] / scale)] {
                let found = certify(&system, form, end, exact, 1e-11).expect("fits").expect("an end");
                let (low, high) = match end {
                    End::Lowest => (found.bound, found.attained),
                    End::Highest => (found.attained, found.bound),
                };
                let rounding = tol::rounding(4);
                assert!(low <= exact + rounding && exact - rounding <= high, "{scheme} {found:?} {exact}");
                assert!(high - low < 1e-10, "{scheme} {found:?} {exact}");
            }
        }
    }
    for k in [5, 9, 21, 101] {
        let system = assemble(&builtin::prism(k), Scheme::CatmullClark);
        assert_eq!(system.bounds.lambda_min, 0.0);
        let exact = prism_lambda_min(k);
        // theory: 0.82/k²
        assert!((exact * (k * k) as f64 - 0.82).abs() < 0.06, "prism {k}: {exact}");
        let found = certify(&system, SymmetricForm::A, End::Lowest, exact, 1e-9).expect("fits").expect("an end");
        assert!(found.bound <= exact && exact <= found.attained + tol::rounding(8), "{k}: {found:?} {exact}");
        assert!(exact - found.bound < 2.1 * found.margin + 1e-8 * exact, "{k}: {found:?} {exact}");
    }
}

/// λ_min of the Catmull-Clark matrix of an odd prism: the modes cos(2πjt/k) on both rings with opposite signs, or with equal
/// ones. All valences are 3, h = 1/24, M has 6 + 4/k + 4/4 + 4/4 on its diagonal; a neighbour on the ring shares a quad and
/// the k-gon, the one across two quads, the next but one across one quad, and all of a ring the k-gon.
fn prism_lambda_min(k: usize) -> f64 {
    let mut least = f64::INFINITY;
    for j in 0..k {
        let cos = (std::f64::consts::TAU * j as f64 / k as f64).cos();
        for sign in [1.0, -1.0] {
            let face = if j == 0 { 4.0 } else { 0.0 };
            let own = 6.0 + 2.0;
            let ring = 2.0 + 1.0;
            let across = 2.0 + 2.0;
            let diagonal = 1.0;
            let symbol = own + face + 2.0 * ring * cos + sign * (across + 2.0 * diagonal * cos);
            least = least.min(symbol / 24.0);
        }
    }
    least
}

/// A shift on the wrong side of λ_min is refused, however near it is, if it is farther than rounding can hide; what is claimed
/// at a shift on the right side stays below it.
#[test]
fn a_shift_beyond_the_end_has_no_certificate() {
    for (scheme, n, m) in [(Scheme::CatmullClark, 20, 14), (Scheme::Nasri, 12, 10), (Scheme::Loop, 12, 9)] {
        let system = assemble(&torus(scheme, n, m), scheme);
        let exact = torus_symbols(scheme, n, m)[0];
        for part in [1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12] {
            let at = |sigma: f64| certify_at(&system, SymmetricForm::A, End::Lowest, sigma).expect("fits");
            assert_eq!(at(exact + part), None, "{scheme} {part}");
            let below = at(exact - part).expect("positive definite");
            assert!(below.bound < exact && exact <= below.attained + tol::rounding(4), "{scheme} {part}: {below:?}");
            let above = certify_at(&system, SymmetricForm::A, End::Highest, 1.0 - part).expect("fits");
            assert_eq!(above, None, "{scheme} {part}");
        }
    }
}

/// On singular meshes a factorization may run to completion at a shift above λ_min = 0: without the margin that would be a
/// false proof. It happens, and the margin covers it each time.
#[test]
fn the_margin_is_needed_and_suffices() {
    let mut false_proofs = 0;
    for name in ["cube", "prism:6", "prism:8", "prism:20", "truncated-octahedron", "cubes:3"] {
        let system = assemble(&named(name), Scheme::CatmullClark);
        for k in 0..40 {
            let sigma = 1e-17 * 1.3f64.powi(k);
            let found = certify_at(&system, SymmetricForm::A, End::Lowest, sigma).expect("fits");
            if let Some(found) = found {
                false_proofs += usize::from(found.sigma > 0.0);
                assert!(found.bound <= 0.0, "{name}: {found:?}");
                assert!(found.attained >= 0.0, "{name}: {found:?}");
            }
        }
    }
    assert!(false_proofs > 0, "no factorization ran to completion at a shift that is too high");
}

/// γ_m of the module's documentation.
fn gamma(m: f64) -> f64 {
    let u = 0.5 * f64::EPSILON;
    m * u / (1.0 - m * u)
}

/// What rounding may hide, by the theorem: rows of the factor count, not columns, and each by its own diagonal entry.
#[test]
fn the_margin_of_a_certificate_is_that_of_the_theorem() {
    let u = 0.5 * f64::EPSILON;
    let margin = |rows: &[(f64, f64)], longest: (f64, f64), sigma: f64| {
        let terms = rows.iter().map(|&(entries, d)| (gamma(entries + 6.0), (d - sigma).abs()));
        let factor: f64 = terms.map(|(g, d)| g / (1.0 - g) * d).sum();
        let most = rows.iter().map(|r| (r.1 - sigma).abs()).fold(0.0, f64::max);
        factor + gamma(2.0 * longest.0 + 32.0) * longest.1 + 32.0 * u * sigma.abs() + u * most
    };
    // All rows of the factor of a tetrahedron's matrix are full, 1 to 4 entries; S has 2/5 and 1/5.
    let system = assemble(&named("tetrahedron"), Scheme::Loop);
    for sigma in [0.1, 0.19, -1.0] {
        let found = certify_at(&system, SymmetricForm::A, End::Lowest, sigma).expect("small").expect("λ_min is 1/5");
        let exact = margin(&[(1.0, 0.4), (2.0, 0.4), (3.0, 0.4), (4.0, 0.4)], (4.0, 1.0), sigma);
        assert!((found.margin / exact - 1.0).abs() < 1e-5, "{found:?} {exact}");
        assert!((found.sigma - found.margin - found.bound).abs() <= f64::EPSILON, "{found:?}");
    }
    // A hub with 50 on the diagonal and six leaves with 1: leaves are eliminated first, the hub last or last but one.
    let mut m = CooMatrix::new(7, 7);
    for leaf in 1..7 {
        m.push(leaf, leaf, 1.0);
        m.push(0, leaf, 1.0);
        m.push(leaf, 0, 1.0);
    }
    m.push(0, 0, 50.0);
    let m = Csr::try_from(&CsrMatrix::from(&m)).expect("a matrix");
    let system = LimitSystem::from_parts(vec![1.0; 7], m).expect("a system");
    let found = certify_at(&system, SymmetricForm::A, End::Lowest, 0.5).expect("small").expect("positive definite");
    let leaves = [(1.0, 1.0); 5];
    let expected = [[(1.0, 1.0), (7.0, 50.0)], [(6.0, 50.0), (2.0, 1.0)]]
        .map(|last| margin(&[&leaves[..], &last[..]].concat(), (7.0, 56.0), 0.5));
    let near = |exact: &f64| (found.margin / exact - 1.0).abs() < 1e-5;
    assert!(expected.iter().any(near), "{found:?} {expected:?}");
}

/// L of S − σ = LLᵀ in the order of the elimination, dense, with the entries that each row has in the pattern, and the order.
fn factor(s: &Csr, sigma: f64, threshold: SupernodalThreshold) -> (Vec<Vec<f64>>, Vec<f64>, Vec<usize>) {
    let n = s.len();
    let values: Vec<f64> =
        (0..n).flat_map(|i| s.row(i).map(move |(j, v)| if i == j { v - sigma } else { v })).collect();
    let pattern = SymbolicSparseColMatRef::new_checked(n, n, s.pattern().offsets(), None, s.pattern().columns());
    let params = CholeskySymbolicParams { supernodal_flop_ratio_threshold: threshold, ..Default::default() };
    let symbolic = factorize_symbolic_cholesky(pattern, Side::Upper, SymmetricOrdering::Amd, params).expect("fits");
    let mut l = vec![0.0; symbolic.len_val()];
    let need = symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default());
    let mut memory = MemBuffer::new(need);
    symbolic
        .factorize_numeric_llt(
            &mut l,
            SparseColMatRef::new(pattern, &values),
            Side::Upper,
            Default::default(),
            Par::Seq,
            MemStack::new(&mut memory),
            Default::default(),
        )
        .expect("positive definite");
    let (mut dense, mut entries) = (vec![vec![0.0; n]; n], vec![0.0; n]);
    let mut set = |i: usize, j: usize, value: f64| {
        dense[i][j] = value;
        entries[i] += 1.0;
    };
    match symbolic.raw() {
        SymbolicCholeskyRaw::Simplicial(raw) => {
            for j in 0..n {
                let range = raw.col_ptr()[j] as usize..raw.col_ptr()[j + 1] as usize;
                let column = raw.row_idx()[range.clone()].iter().zip(&l[range]);
                column.for_each(|(&i, &value)| set(i as usize, j, value));
            }
        }
        SymbolicCholeskyRaw::Supernodal(raw) => {
            for (k, &end) in raw.supernode_end().iter().enumerate() {
                let (block, end) = (raw.supernode(k), end as usize);
                let rows: Vec<usize> =
                    (block.start()..end).chain(block.pattern().iter().map(|&i| i as usize)).collect();
                for (column, j) in (block.start()..end).enumerate() {
                    let first = raw.col_ptr_for_val()[k] as usize + column * rows.len();
                    rows.iter().enumerate().skip(column).for_each(|(row, &i)| set(i, j, l[first + row]));
                }
            }
        }
    }
    let order = symbolic.perm().expect("an order").arrays().0.iter().map(|&i| i as usize).collect();
    (dense, entries, order)
}

/// The bound that all rests on, entry by entry, for both ways in which the factor is computed: residuals in twice the digits
/// (Ogita, Rump and Oishi 2005) against γ_min(m_i,m_j) (|L||L|ᵀ)_ij. With one rounding beside those of the sums in place of
/// six, as where a factor is rooted and divided by, a supernodal factor of these exceeds it by a quarter.
#[test]
fn factors_keep_the_bound_of_the_theorem() {
    for (name, scheme) in [("irregular-quad:260", Scheme::CatmullClark), ("irregular-tri:200", Scheme::Loop)] {
        let s = symmetric(&assemble(&named(name), scheme), SymmetricForm::A);
        for threshold in [SupernodalThreshold::FORCE_SIMPLICIAL, SupernodalThreshold::FORCE_SUPERNODAL] {
            let (l, entries, order) = factor(&s, 0.01, threshold);
            let mut worst = 0.0f64;
            for i in 0..l.len() {
                for j in 0..=i {
                    let mut high = s.get(order[i], order[j]) - if i == j { 0.01 } else { 0.0 };
                    let (mut low, mut absolute) = (0.0, 0.0);
                    for (x, y) in l[i][..=j].iter().zip(&l[j][..=j]) {
                        let product = -x * y;
                        let sum = high + product;
                        let part = sum - high;
                        low += (-x).mul_add(*y, -product) + ((high - (sum - part)) + (product - part));
                        high = sum;
                        absolute += product.abs();
                    }
                    let bound = gamma(entries[i].min(entries[j]) + 6.0) * absolute;
                    assert!((high + low).abs() <= 1.0001 * bound, "{name} ({i}, {j}): {} {bound}", high + low);
                    worst = worst.max((high + low).abs() / bound.max(f64::MIN_POSITIVE));
                }
            }
            assert!(worst > 0.02, "{name}: residuals are {worst} of what is allowed for");
        }
    }
}

/// Any vector will do: the quotient lies in its enclosure, and that between the ends of the spectrum.
#[test]
fn rayleigh_quotients_are_enclosed() {
    for (name, _, _, system) in random_systems(12) {
        let all = dense::full_eigenvalues(&system).expect("small");
        let n = system.len();
        for form in [SymmetricForm::A, SymmetricForm::Jacobi] {
            let (least, most) = match form {
                SymmetricForm::A => (all.a[0], all.a[n - 1]),
                SymmetricForm::Jacobi => (all.jacobi[0], all.jacobi[n - 1]),
            };
            for k in 0..n.min(7) {
                let mut x: Vec<f64> = (0..n).map(|i| ((i * (k + 1)) as f64).cos()).collect();
                x[k] = 1.0;
                let (low, high) = rayleigh_enclosure(&system, form, &x);
                let product: f64 = (0..n).map(|i| x[i] * system.m.row_times(i, &x)).sum();
                let metric = |i: usize| match form {
                    SymmetricForm::A => 1.0 / system.h[i],
                    SymmetricForm::Jacobi => system.m.get(i, i),
                };
                let quotient = product / (0..n).map(|i| metric(i) * x[i] * x[i]).sum::<f64>();
                assert!(low < quotient && quotient < high, "{name} {low} {quotient} {high}");
                assert!(high - low < 1e-11 * most, "{name} {low} {high}");
                assert!(least <= high && low <= most, "{name} {low} {high}: {least} {most}");
            }
        }
        let (low, high) = rayleigh_enclosure(&system, SymmetricForm::A, &vec![0.0; n]);
        assert!(low == f64::NEG_INFINITY && high == f64::INFINITY, "{name}: of no vector nothing is known");
    }
}

/// Counts beside an eigenvalue, nearer and nearer: right wherever the shift is farther from it than the backward error.
#[test]
fn counts_are_right_up_to_the_backward_error() {
    for (scheme, n, m) in [(Scheme::CatmullClark, 9, 7), (Scheme::Nasri, 9, 8), (Scheme::Loop, 8, 7)] {
        let system = assemble(&torus(scheme, n, m), scheme);
        let symbols = torus_symbols(scheme, n, m);
        let (mut counted, mut refused) = (0, 0);
        for k in [0, symbols.len() / 5, symbols.len() / 2] {
            for distance in [1e-3, 1e-6, 1e-9, 1e-11, 1e-13] {
                for sigma in [symbols[k] - distance, symbols[k] + distance] {
                    let Ok(found) = eigenvalues_below(&system, SymmetricForm::A, sigma) else {
                        refused += 1;
                        continue;
                    };
                    counted += 1;
                    let error = found.backward_error + tol::rounding(4);
                    assert!(error < 2.0 * LARGEST_BACKWARD_ERROR, "{found:?}");
                    let below = |s: f64| symbols.iter().filter(|l| **l < s).count();
                    let (least, most) = (below(sigma - error), below(sigma + error));
                    assert!((least..=most).contains(&found.below), "{scheme} {sigma}: {found:?} {least} {most}");
                }
            }
        }
        assert!(counted > 2 * refused, "{scheme}: {counted} counted, {refused} refused");
    }
}

/// The weights of the schemes are as good as a certificate takes them to be: 20 roundings, against closed forms at the
/// valences and faces whose cosines are roots.
#[test]
fn weights_are_within_their_roundings() {
    let (s2, s3, s5) = (2f64.sqrt(), 3f64.sqrt(), 5f64.sqrt());
    let cosines =
        [(3, -0.5), (4, 0.0), (5, (s5 - 1.0) / 4.0), (6, 0.5), (8, s2 / 2.0), (10, (s5 + 1.0) / 4.0), (12, s3 / 2.0)];
    for (n, cos) in cosines {
        let v = n as f64;
        let beta_loop = 3.0 / (11.0 - 8.0 * (0.375 + (0.375 + 0.25 * cos) * (0.375 + 0.25 * cos)));
        for (scheme, h, d) in [
            (Scheme::CatmullClark, 1.0 / (v * (v + 5.0)), v * (v - 1.0)),
            (Scheme::Loop, (1.0 - beta_loop) / v, v * beta_loop / (1.0 - beta_loop)),
            (Scheme::Sqrt3, (4.0 - 2.0 * cos) / (7.0 - 2.0 * cos) / v, 3.0 * v / (4.0 - 2.0 * cos)),
            (Scheme::Nasri, 1.0 / v, 0.0),
            (Scheme::ZhengCai, 0.5 / v, v),
            (Scheme::MidEdge, 0.5 / v, v),
        ] {
            let near = |a: f64, b: f64| (a - b).abs() <= 10.0 * f64::EPSILON * b.abs();
            assert!(near(scheme.h(n), h) && near(scheme.vertex_weight(n), d), "{scheme} {n}");
        }
        let face = Scheme::Nasri.face_weight(n, 1);
        assert!((face - (0.75 + 0.5 * cos) / v).abs() <= 10.0 * f64::EPSILON * face, "{n}");
    }
}
