//! Thall's numbers. Where the paper has a slip, the test holds the slip.

use limitlab::analysis::splitting::thall::PrintedNumber;
use limitlab::analysis::splitting::thall_tables;

use super::EIGEN;

fn difference(entry: &PrintedNumber) -> f64 {
    (entry.printed - entry.computed).abs()
}

#[test]
fn matrices_and_table_i_are_right_entry_by_entry() {
    let tables = thall_tables().unwrap();
    let of = |test: &dyn Fn(&PrintedNumber) -> bool| -> Vec<PrintedNumber> {
        tables.entries.iter().filter(|e| test(e)).cloned().collect()
    };
    let matrices = of(&|e| e.item.starts_with('S'));
    assert_eq!(matrices.len(), 81 + 49);
    assert!(matrices.iter().all(|e| difference(e) < EIGEN));
    let masks = of(&|e| e.place == "Table I");
    assert_eq!(masks.len(), (3..=12).map(|n| 2 * n + 1).sum::<usize>());
    assert!(masks.iter().all(|e| difference(e) < EIGEN));
}

#[test]
fn a_digit_is_missing_in_the_eigenvalue_of_valence_3() {
    let tables = thall_tables().unwrap();
    let lambda = |n| {
        let found = tables.entries.iter().find(|e| e.item.starts_with('λ') && e.valence == n);
        found.unwrap()
    };
    assert!(difference(lambda(4)) < EIGEN);
    assert!((difference(lambda(3)) - 8.735e-4).abs() < 1e-6);
    assert!((lambda(3).computed - 0.410_097_050_800_55).abs() < EIGEN);
}

#[test]
fn tables_ii_and_iii_follow_the_formulas_but_for_c_3_at_valence_3() {
    let tables = thall_tables().unwrap();
    for entry in tables.entries.iter().filter(|e| e.item.starts_with('c')) {
        let slip =
            entry.valence == 3 && ["c_3[f_2]", "c_3[f_3]", "c_3[e_1]", "c_3[e_3]"].contains(&entry.item.as_str());
        assert_eq!(difference(entry) > 1e-9, slip, "{entry:?}");
    }
}

#[test]
fn printed_masks_are_in_the_left_eigenspace_but_havemanns_are_not() {
    let tables = thall_tables().unwrap();
    assert_eq!(tables.memberships.len(), 10);
    for m in &tables.memberships {
        if m.mask.starts_with("Havemann") {
            assert!(m.distance > 0.5, "{m:?}");
            // They would be with edges weighing A_4 = 4 times as much.
            assert!(m.distance_scaled < EIGEN, "{m:?}");
        } else {
            // MATLAB's have 14 decimals.
            assert!(m.distance < 1e-13, "{m:?}");
        }
    }
}

#[test]
fn the_printed_normal_of_valence_3_points_inward() {
    let tables = thall_tables().unwrap();
    let signs: Vec<(usize, &str, bool)> =
        tables.orientations.iter().map(|o| (o.valence, o.masks, o.sine > 0.0)).collect();
    assert_eq!(
        signs,
        [(3, "printed", false), (3, "by the formulas", true), (4, "printed", true), (4, "by the formulas", true),]
    );
}
