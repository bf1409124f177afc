//! Comparison of a fresh table with a committed one, within the tolerance of each column.

use super::table::{CsvFile, Kind, Table};
use limitlab::Result;
use std::collections::HashMap;
use std::fmt;
use std::path::Path;

/// One way in which a fresh table departs from the committed file, as one line of text: table, row, column and
/// both values.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference(String);

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// Looks every row of `fresh` up in the file `committed_csv` by its key columns and compares the other cells.
///
/// `fresh` may hold a subset of the committed rows, in any order, but no other rows; both hold the same columns.
/// Cells are compared in the form that CSV gives them (10 significant digits), so that a table always agrees
/// with its own file:
/// - keys and texts are equal character by character;
/// - counts are integers that differ by at most 1;
/// - numbers a, b agree if |a − b| ≤ max(tolerance · max(|a|, |b|), floor) with the column's relative tolerance
///   and absolute floor ([`ROUNDING_FLOOR`](super::table::ROUNDING_FLOOR) unless set); NaN agrees with NaN, an
///   infinity with itself;
/// - a count or number that is empty or words on either side is compared as text;
/// - times and remarks are not compared.
///
/// No difference means an empty list.
///
/// ```
/// use limitlab_experiments::report::{Column, Table, compare};
///
/// let mut table = Table::new("counts", "Counts", vec![Column::key("mesh"), Column::count("iterations")]);
/// table.push(vec!["cube".into(), 12_usize.into()]);
/// let dir = tempfile::tempdir()?;
/// std::fs::write(dir.path().join("counts.csv"), "mesh,iterations\ncube,13\ntorus,40\n")?;
/// assert!(compare(&table, &dir.path().join("counts.csv"))?.is_empty());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`Error::Io`](limitlab::Error::Io) if the file cannot be read, [`Error::Parse`](limitlab::Error::Parse) if it is no
/// table.
pub fn compare(fresh: &Table, committed_csv: &Path) -> Result<Vec<Difference>> {
    let committed = CsvFile::read(committed_csv)?;
    let mut differences = Vec::new();
    let mut report = |what: String| {
        // A cell may hold a line break; a difference does not.
        let line = format!("{}: {what}", fresh.id).replace(['\n', '\r'], " ");
        differences.push(Difference(line));
    };

    // Where each column of `fresh` stands in the file.
    let place: Vec<Option<usize>> =
        fresh.columns.iter().map(|column| committed.header.iter().position(|name| *name == column.name)).collect();
    for (column, place) in fresh.columns.iter().zip(&place) {
        if place.is_none() {
            report(format!("column {} is not in the committed file", column.name));
        }
    }
    for name in &committed.header {
        if fresh.columns.iter().all(|column| column.name != *name) {
            report(format!("column {name} is in the committed file only"));
        }
    }

    let keys: Vec<usize> = (0..fresh.columns.len()).filter(|&c| fresh.columns[c].kind == Kind::Key).collect();
    let Some(committed_keys) = keys.iter().map(|&c| place[c]).collect::<Option<Vec<_>>>() else {
        return Ok(differences); // rows cannot be looked up; the missing key column is reported above
    };
    let key_of =
        |row: &[String], columns: &[usize]| -> Vec<String> { columns.iter().map(|&c| row[c].clone()).collect() };

    let mut rows: HashMap<Vec<String>, &[String]> = HashMap::new();
    for row in &committed.rows {
        let key = key_of(row, &committed_keys);
        let name = key.join(", ");
        if rows.insert(key, row).is_some() {
            report(format!("row [{name}] is in the committed file twice"));
        }
    }

    for row in fresh.csv_rows() {
        let key = key_of(&row, &keys);
        let name = key.join(", ");
        // Taken out, so that a second fresh row with the same key is not found.
        let Some(old) = rows.remove(&key) else {
            report(format!("row [{name}] is not in the committed file, or fresh twice"));
            continue;
        };
        for (c, column) in fresh.columns.iter().enumerate() {
            let Some(place) = place[c] else { continue };
            let (new, old) = (&row[c], &old[place]);
            if let Some(reason) = disagreement(column.kind, new, old) {
                report(format!("row [{name}], {}: fresh {new:?}, committed {old:?}{reason}", column.name));
            }
        }
    }
    Ok(differences)
}

/// Why two cells of a column disagree, if they do.
fn disagreement(kind: Kind, a: &str, b: &str) -> Option<String> {
    if a == b {
        return None;
    }
    match kind {
        Kind::Time | Kind::Remark => None,
        Kind::Key | Kind::Text => Some(String::new()),
        Kind::Count => match (a.parse::<i64>(), b.parse::<i64>()) {
            (Ok(a), Ok(b)) if a.abs_diff(b) <= 1 => None,
            (Ok(_), Ok(_)) => Some(" (may differ by 1)".to_owned()),
            _ => Some(String::new()),
        },
        Kind::Number { tolerance, floor, .. } => match (a.parse::<f64>(), b.parse::<f64>()) {
            // An infinity would be within any tolerance of itself only: |a − b| is NaN or infinite.
            (Ok(a), Ok(b)) if a.is_finite() && b.is_finite() => {
                let (distance, size) = ((a - b).abs(), a.abs().max(b.abs()));
                let far = distance > (tolerance * size).max(floor);
                far.then(|| {
                    let relative = distance / size;
                    format!(" (relative difference {relative:.1e}, allowed {tolerance:.1e})")
                })
            }
            _ => Some(String::new()),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::super::provenance::Provenance;
    use super::super::table::{Cell, Column};
    use super::*;
    use limitlab::Error;

    const COMMITTED: &str = "mesh,omega,verdict,iterations,max_error,seconds\n\
        cube,0.8,agrees,12,0.001,1.5\n\
        torus,0.8,agrees,40,2e-14,9.0\n\
        torus,1,diverged,,inf,9.0\n";

    fn columns() -> Vec<Column> {
        vec![
            Column::key("mesh"),
            Column::key("omega"),
            Column::text("verdict"),
            Column::count("iterations"),
            Column::number("max_error", 1e-3, 4),
            Column::time("seconds"),
        ]
    }

    fn row(mesh: &str, omega: f64, verdict: &str, iterations: Option<i64>, max_error: f64) -> Vec<Cell> {
        let seconds = 77.0; // never agrees
        vec![mesh.into(), omega.into(), verdict.into(), iterations.into(), max_error.into(), seconds.into()]
    }

    fn differences(columns: Vec<Column>, rows: Vec<Vec<Cell>>) -> Vec<String> {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("sweep.csv");
        std::fs::write(&path, COMMITTED).unwrap();
        let mut table = Table::new("sweep", "Sweep", columns);
        rows.into_iter().for_each(|row| table.push(row));
        let found = compare(&table, &path).unwrap();
        found.iter().map(Difference::to_string).collect()
    }

    #[test]
    fn within_the_tolerances_nothing_is_reported() {
        let rows = vec![
            // Another order; ω with the last bits of a sum; counts off by 1 to either side; the number at 0.99
            // of its tolerance.
            row("torus", 1.0, "diverged", None, f64::INFINITY),
            row("cube", 0.1 + 0.7, "agrees", Some(13), 0.001 * (1.0 - 0.99e-3)),
            row("torus", 0.8, "agrees", Some(39), 9e-13), // below the floor
        ];
        assert_eq!(differences(columns(), rows), [""; 0]);
    }

    #[test]
    fn a_subset_of_the_rows_will_do_but_no_other_row() {
        let rows = vec![row("cube", 0.8, "agrees", Some(12), 1e-3)];
        assert_eq!(differences(columns(), rows), [""; 0]);
        assert_eq!(differences(columns(), vec![]), [""; 0]);
        let rows = vec![row("cube", 0.9, "agrees", Some(12), 1e-3)];
        assert_eq!(
            differences(columns(), rows),
            ["sweep: row [cube, 0.9] is not in the committed file, or fresh twice"]
        );
        let rows = vec![row("cube", 0.8, "agrees", Some(12), 1e-3); 2];
        assert_eq!(differences(columns(), rows).len(), 1);
    }

    #[test]
    fn each_kind_reports_what_is_outside() {
        for (fresh, expected) in [
            (
                row("cube", 0.8, "differs", Some(12), 1e-3),
                r#"sweep: row [cube, 0.8], verdict: fresh "differs", committed "agrees""#,
            ),
            (
                row("cube", 0.8, "agrees", Some(14), 1e-3),
                r#"sweep: row [cube, 0.8], iterations: fresh "14", committed "12" (may differ by 1)"#,
            ),
            (row("cube", 0.8, "agrees", None, 1e-3), r#"sweep: row [cube, 0.8], iterations: fresh "", committed "12""#),
            (
                row("cube", 0.8, "agrees", Some(12), 1.0011e-3),
                r#"sweep: row [cube, 0.8], max_error: fresh "0.0010011", committed "0.001" (relative difference 1.1e-3, allowed 1.0e-3)"#,
            ),
            (
                row("cube", 0.8, "agrees", Some(12), f64::NAN),
                r#"sweep: row [cube, 0.8], max_error: fresh "NaN", committed "0.001""#,
            ),
            (
                row("torus", 1.0, "diverged", None, f64::NEG_INFINITY),
                r#"sweep: row [torus, 1], max_error: fresh "-inf", committed "inf""#,
            ),
            (
                row("torus", 0.8, "agrees", Some(40), 1.1e-12),
                r#"sweep: row [torus, 0.8], max_error: fresh "1.1e-12", committed "2e-14" (relative difference 9.8e-1, allowed 1.0e-3)"#,
            ),
        ] {
            assert_eq!(differences(columns(), vec![fresh]), [expected]);
        }
    }

    #[test]
    fn remarks_are_not_compared() {
        let mut columns = columns();
        columns[2] = Column::remark("verdict");
        let rows = vec![row("cube", 0.8, "other words", Some(12), 1e-3)];
        assert_eq!(differences(columns, rows), [""; 0]);
    }

    #[test]
    fn a_floor_of_its_own_replaces_the_rounding_floor() {
        let mut columns = columns();
        columns[4] = columns[4].clone().floor(0.0);
        let rows = vec![row("torus", 0.8, "agrees", Some(40), 3e-14)];
        assert_eq!(differences(columns, rows).len(), 1);
    }

    /// Of the tolerance and the floor the larger counts, not both; and the tolerance is of the larger number.
    #[test]
    fn numbers_agree_within_the_tolerance_or_the_floor() {
        let agree = |fresh: f64, committed: f64, tolerance: f64, floor: f64| {
            let kind = Kind::Number { tolerance, floor, digits: 4 };
            let [a, b] = [fresh, committed].map(|x| x.to_string());
            let there = disagreement(kind, &a, &b).is_none();
            assert_eq!(there, disagreement(kind, &b, &a).is_none(), "{a} and {b}");
            there
        };
        assert!(agree(1.0, 1.0009, 1e-3, 1e-3));
        assert!(!agree(1.0, 1.0015, 1e-3, 1e-3));
        assert!(agree(1.0, 1.0015, 1e-3, 2e-3) && agree(1.0, 1.0015, 2e-3, 1e-3));
        // 1/9 of the larger, 1/8 of the smaller.
        assert!(agree(8.0, 9.0, 0.115, 0.0) && !agree(8.0, 9.0, 0.105, 0.0));
    }

    #[test]
    fn columns_must_be_the_same() {
        let mut columns = columns();
        columns[2] = Column::text("remark");
        let rows = vec![row("cube", 0.8, "agrees", Some(12), 1e-3)];
        assert_eq!(
            differences(columns, rows),
            [
                "sweep: column remark is not in the committed file",
                "sweep: column verdict is in the committed file only"
            ]
        );
        let mut columns = self::columns();
        columns[0] = Column::key("model");
        let rows = vec![row("cube", 0.8, "agrees", Some(12), 1e-3)];
        assert_eq!(differences(columns, rows).len(), 2);
    }

    #[test]
    fn a_table_agrees_with_its_own_file_at_tolerance_zero() {
        let dir = tempfile::tempdir().unwrap();
        let columns = vec![Column::key("k"), Column::number("x", 0.0, 3).floor(0.0)];
        let mut table = Table::new("own", "Own", columns);
        for (i, x) in [1.0 / 3.0, f64::NAN, -1e-300, 0.1 + 0.2].into_iter().enumerate() {
            table.push(vec![i.into(), x.into()]);
        }
        table.write(dir.path(), &Provenance::default()).unwrap();
        assert_eq!(compare(&table, &dir.path().join("own.csv")).unwrap(), []);
    }

    #[test]
    fn a_missing_file_is_an_error() {
        let table = Table::new("none", "None", columns());
        let error = compare(&table, Path::new("no/such/none.csv")).unwrap_err();
        assert!(matches!(error, Error::Io { .. }), "{error}");
        assert!(error.to_string().contains("none.csv"));
    }
}
