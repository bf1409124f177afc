//! Matrices to and from nalgebra-sparse, faer and sprs: what comes back is the same, entry by entry against triplets,
//! and what cannot be taken over is refused.

use std::sync::Arc;

use faer::sparse::{SparseColMat, SparseRowMat, SymbolicSparseColMat, SymbolicSparseRowMat, Triplet as FaerTriplet};
use limitlab::Error;
use limitlab::assemble::Csr;
use limitlab::assemble::csr::Pattern;
use nalgebra_sparse::{CooMatrix, CsrMatrix};
use proptest::prelude::*;
use sprs::{CsMat, CsMatI, TriMat};

type Triplets = Vec<(usize, usize, f64)>;

/// A square matrix of up to 12 rows as sorted triplets, no place twice; some values are zeros.
fn triplets() -> impl Strategy<Value = (usize, Triplets)> {
    (0..12usize).prop_flat_map(|n| {
        let value = prop_oneof![Just(0.0), Just(-0.0), -1e3..1e3f64, Just(f64::MAX), Just(5e-324)];
        let places = proptest::collection::btree_map((0..n.max(1), 0..n.max(1)), value, 0..=n * n);
        places.prop_map(move |all| (n, all.into_iter().map(|((i, j), a)| (i, j, a)).collect()))
    })
}

fn ours(n: usize, triplets: &Triplets) -> Csr {
    let mut offsets = vec![0; n + 1];
    triplets.iter().for_each(|t| offsets[t.0 + 1] += 1);
    for i in 0..n {
        offsets[i + 1] += offsets[i];
    }
    let columns = triplets.iter().map(|t| t.1 as u32).collect();
    Csr::new(Arc::new(Pattern::new(offsets, columns)), triplets.iter().map(|t| t.2).collect())
}

/// The bits too: zeros have signs.
fn same(a: &Csr, b: &Csr) -> bool {
    let bits = |m: &Csr| m.values().iter().map(|v| v.to_bits()).collect::<Vec<_>>();
    a.pattern() == b.pattern() && bits(a) == bits(b)
}

proptest! {
    #[test]
    fn matrices_come_back_bit_by_bit((n, triplets) in triplets()) {
        let matrix = ours(n, &triplets);
        let back = [
            Csr::try_from(&CsrMatrix::from(&matrix)),
            Csr::try_from(&SparseRowMat::<u32, f64>::from(&matrix)),
            Csr::try_from(&SparseRowMat::<usize, f64>::from(&matrix)),
            Csr::try_from(&SparseColMat::<u32, f64>::from(&matrix)),
            Csr::try_from(&SparseColMat::<u64, f64>::from(&matrix)),
            Csr::try_from(&CsMat::from(&matrix)),
            Csr::try_from(&CsMatI::<f64, u32>::from(&matrix)),
            Csr::try_from(&CsMat::from(&matrix).to_csc()),
        ];
        for (k, back) in back.into_iter().enumerate() {
            prop_assert!(same(&back.unwrap(), &matrix), "way {}", k);
        }
        prop_assert!(same(&matrix.transpose().transpose(), &matrix));
        for &(i, j, a) in &triplets {
            prop_assert_eq!(matrix.transpose().get(j, i).to_bits(), a.to_bits());
        }
    }

    #[test]
    fn other_libraries_mean_the_same_entries((n, triplets) in triplets()) {
        let matrix = ours(n, &triplets);
        let mut coo = CooMatrix::new(n, n);
        triplets.iter().for_each(|&(i, j, a)| coo.push(i, j, a));
        prop_assert!(same(&Csr::try_from(&CsrMatrix::from(&coo)).unwrap(), &matrix));
        let faer: Vec<_> = triplets.iter().map(|&(i, j, a)| FaerTriplet::new(i, j, a)).collect();
        let columns = SparseColMat::<usize, f64>::try_new_from_triplets(n, n, &faer).unwrap();
        let rows = SparseRowMat::<usize, f64>::try_new_from_triplets(n, n, &faer).unwrap();
        prop_assert!(same(&Csr::try_from(&columns).unwrap(), &matrix));
        prop_assert!(same(&Csr::try_from(&rows).unwrap(), &matrix));
        let mut sprs = TriMat::new((n, n));
        triplets.iter().for_each(|&(i, j, a)| sprs.add_triplet(i, j, a));
        prop_assert!(same(&Csr::try_from(&sprs.to_csc::<usize>()).unwrap(), &matrix));
        // And from here to there.
        for &(i, j, a) in &triplets {
            prop_assert_eq!(CsrMatrix::from(&matrix).index_entry(i, j).into_value().to_bits(), a.to_bits());
            let faer = SparseColMat::<usize, f64>::from(&matrix);
            prop_assert_eq!(faer.get(i, j).unwrap().to_bits(), a.to_bits());
            let faer = SparseRowMat::<u32, f64>::from(&matrix);
            prop_assert_eq!(faer.get(i, j).unwrap().to_bits(), a.to_bits());
            prop_assert_eq!(CsMat::from(&matrix).get(i, j).unwrap().to_bits(), a.to_bits());
        }
    }
}

fn refused(result: Result<Csr, Error>) -> String {
    match result {
        Err(Error::Matrix(what)) => what,
        other => panic!("{other:?}"),
    }
}

#[test]
fn what_is_not_square_or_not_sorted_is_refused() {
    let wide = "a matrix of 2 rows and 3 columns: it must be square";
    assert_eq!(refused(Csr::try_from(&CsrMatrix::<f64>::zeros(2, 3))), wide);
    assert_eq!(refused(Csr::try_from(&CsMat::<f64>::zero((2, 3)))), wide);
    let none: [FaerTriplet<usize, usize, f64>; 0] = [];
    assert_eq!(refused(Csr::try_from(&SparseColMat::try_new_from_triplets(2, 3, &none).unwrap())), wide);
    assert_eq!(refused(Csr::try_from(&SparseRowMat::try_new_from_triplets(2, 3, &none).unwrap())), wide);

    for indices in [vec![0u32, 1, 0], vec![0, 1, 1]] {
        let told = "1: index";
        let rows = SymbolicSparseRowMat::new_unsorted_checked(2, 2, vec![0u32, 1, 3], None, indices.clone());
        let line = refused(Csr::try_from(&SparseRowMat::new(rows, vec![1.0; 3])));
        assert!(line.starts_with(&format!("row {told} {} does not ascend", indices[2])), "{line}");
        let columns = SymbolicSparseColMat::new_unsorted_checked(2, 2, vec![0u32, 1, 3], None, indices.clone());
        let line = refused(Csr::try_from(&SparseColMat::new(columns, vec![1.0; 3])));
        assert!(line.starts_with(&format!("column {told} {} does not ascend", indices[2])), "{line}");
    }
}

/// faer may leave room at the end of each column.
#[test]
fn columns_with_room_to_spare_are_read_to_their_ends_only() {
    let columns = SymbolicSparseColMat::new_checked(2, 2, vec![0u32, 2, 4], Some(vec![2, 1]), vec![0u32, 1, 1, 0]);
    let matrix = Csr::try_from(&SparseColMat::new(columns, vec![1.0, 2.0, 3.0, 9.0])).unwrap();
    assert_eq!(matrix, ours(2, &vec![(0, 0, 1.0), (1, 0, 2.0), (1, 1, 3.0)]));
}
