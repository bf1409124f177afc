//! Lin & Luo's eigenvalue condition.

use limitlab::analysis::splitting::{
    LocalScheme, SplittingMatrix, condition_over_alpha, crossings,
};

#[test]
fn crossings_probe() {
    for n in [3, 4, 5, 6, 7, 8, 12, 20, 50] {
        for c in crossings(n).unwrap() {
            println!("{c:?}");
        }
    }
    for c in condition_over_alpha(&[3, 4, 5, 6], &[0.0, 0.5, 1.0, 1.5, 2.0]).unwrap() {
        println!("{c:?}");
    }
    let _ = SplittingMatrix::new(LocalScheme::Loop, 3);
}
