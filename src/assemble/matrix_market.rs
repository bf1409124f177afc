//! Matrix Market files (Boisvert, Pozo, Remington, NIST 1996): coordinate format for sparse matrices, array format for
//! vectors and points; the [reader](mod@read) takes what other programs write too.

pub mod read;

use std::io::{self, Write};

use glam::DVec3;

pub use self::read::{is_missing, read_matrix, read_points, read_system, read_vector};
use super::csr::Csr;

/// Writes the first line of a file, and `comments`, lines without line ends, after it.
fn write_banner(kind: &str, comments: &[String], out: &mut dyn Write) -> io::Result<()> {
    writeln!(out, "%%MatrixMarket matrix {kind}")?;
    comments.iter().try_for_each(|comment| writeln!(out, "% {comment}"))
}

/// Writes `matrix` as `matrix coordinate real general`, entries by rows, 17 significant digits.
pub fn write_general(matrix: &Csr, comments: &[String], out: &mut dyn Write) -> io::Result<()> {
    let n = matrix.len();
    write_banner("coordinate real general", comments, out)?;
    writeln!(out, "{n} {n} {}", matrix.values().len())?;
    for i in 0..n {
        for (j, a) in matrix.row(i) {
            writeln!(out, "{} {} {a:.16e}", i + 1, j + 1)?;
        }
    }
    Ok(())
}

/// Writes the lower triangle of the symmetric `matrix` as `matrix coordinate real symmetric`.
pub fn write_symmetric(matrix: &Csr, comments: &[String], out: &mut dyn Write) -> io::Result<()> {
    let n = matrix.len();
    let lower = |i: usize| matrix.row(i).take_while(move |&(j, _)| j <= i);
    let entries: usize = (0..n).map(|i| lower(i).count()).sum();
    write_banner("coordinate real symmetric", comments, out)?;
    writeln!(out, "{n} {n} {entries}")?;
    for i in 0..n {
        for (j, a) in lower(i) {
            writeln!(out, "{} {} {a:.16e}", i + 1, j + 1)?;
        }
    }
    Ok(())
}

/// Writes `values` as an N×1 `matrix array real general`.
pub fn write_vector(values: &[f64], comments: &[String], out: &mut dyn Write) -> io::Result<()> {
    write_banner("array real general", comments, out)?;
    writeln!(out, "{} 1", values.len())?;
    for v in values {
        writeln!(out, "{v:.16e}")?;
    }
    Ok(())
}

/// Writes `points` as an N×3 `matrix array real general`, column by column.
pub fn write_points(points: &[DVec3], comments: &[String], out: &mut dyn Write) -> io::Result<()> {
    write_banner("array real general", comments, out)?;
    writeln!(out, "{} 3", points.len())?;
    for axis in 0..3 {
        for p in points {
            writeln!(out, "{:.16e}", p[axis])?;
        }
    }
    Ok(())
}
