//! A reader of Matrix Market's array format, which sprs does not read.

use std::path::Path;

/// The columns of a `matrix array real general` file.
pub fn read_array(path: &Path) -> Vec<Vec<f64>> {
    let text = std::fs::read_to_string(path).unwrap();
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("%%MatrixMarket matrix array real general"));
    let mut numbers = lines.filter(|l| !l.starts_with('%')).flat_map(str::split_whitespace);
    let mut size = || numbers.next().unwrap().parse::<usize>().unwrap();
    let (rows, columns) = (size(), size());
    let values: Vec<f64> = numbers.map(|t| t.parse().unwrap()).collect();
    assert_eq!(values.len(), rows * columns);
    values.chunks(rows.max(1)).map(<[f64]>::to_vec).collect()
}
