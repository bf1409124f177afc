//! Reading Matrix Market files: `matrix`, `coordinate` or `array`, `real` or `integer`, `general` or `symmetric`.
//!
//! The banner's words may be in any case; comments (`%` where a line begins) and empty lines may stand anywhere after
//! it; lines end with LF, CR LF or CR. An entry takes a line in coordinate files, and what is listed twice is summed,
//! as the format has it. Of a symmetric matrix the format stores the lower triangle; the upper one is taken as well,
//! and both, if they agree to the last bit.
//!
//! The first bytes decide whether the rest is read at all. Sizes that the header announces are held against the bytes
//! that are there and against the memory available before anything is allocated for them.

use std::fmt;
use std::fs::{self, File};
use std::io::{ErrorKind, Read};
use std::ops::RangeInclusive;
use std::path::Path;
use std::sync::Arc;

use glam::DVec3;

use super::super::convert::check_size;
use super::super::csr::{Csr, Pattern};
use super::super::system::LimitSystem;
use crate::memory::require;
use crate::mesh::magic::other_kind;
use crate::text::{Scanner, quoted};
use crate::{Error, Result};

/// The file that a system's folder has for each part; H may be missing.
const PARTS: [&str; 3] = ["M.mtx", "H.mtx", "P.mtx"];
const BANNER: &[u8] = b"%%MatrixMarket";
/// What a file's banner may say, for messages.
const READ: &str = "read are matrix, coordinate or array, real or integer, general or symmetric";
const SMALLER: &str = "use a smaller one";

/// Reads a square matrix with all its entries, those of both triangles if it is symmetric. Of a dense matrix (`array`)
/// zeros are left out; of a sparse one they stay.
///
/// O(N + entries) and a sort of each row; at most 64 bytes an entry beside the text.
///
/// # Errors
/// [`Error::Io`]; [`Error::Parse`] with the line of what is not in the format, not finite, or announced and not there;
/// [`Error::Memory`]; [`Error::Matrix`] if it is not square, or 32-bit indices do not suffice.
///
/// ```
/// use limitlab::assemble::matrix_market::read_matrix;
///
/// let path = std::env::temp_dir().join(format!("limitlab-doc-{}.mtx", std::process::id()));
/// std::fs::write(&path, "%%MatrixMarket matrix coordinate real symmetric\n2 2 3\n1 1 2\n2 1 -1\n2 2 2\n").unwrap();
/// let m = read_matrix(&path)?;
/// assert_eq!((m.get(0, 1), m.get(1, 0), m.values().len()), (-1.0, -1.0, 4));
/// # std::fs::remove_file(&path).unwrap();
/// # Ok::<(), limitlab::Error>(())
/// ```
pub fn read_matrix(path: &Path) -> Result<Csr> {
    let bytes = read_bytes(path)?;
    Text::new(&bytes, path)?.matrix()
}

/// Reads an N×1 matrix: a vector.
///
/// # Errors
/// As [`read_matrix`]; another number of columns.
pub fn read_vector(path: &Path) -> Result<Vec<f64>> {
    let bytes = read_bytes(path)?;
    let text = Text::new(&bytes, path)?;
    text.has_columns(1..=1, "a vector has 1")?;
    text.array()
}

/// Reads an N×3 matrix as N points. With one column or two, the other coordinates are 0.
///
/// # Errors
/// As [`read_matrix`]; another number of columns.
pub fn read_points(path: &Path) -> Result<Vec<DVec3>> {
    let bytes = read_bytes(path)?;
    let text = Text::new(&bytes, path)?;
    text.has_columns(1..=3, "points have 3, or 1 or 2 if the others are 0")?;
    let n = text.rows;
    let columns = text.array()?;
    let at = |i: usize, axis: usize| columns.get(axis * n + i).copied().unwrap_or(0.0);
    Ok((0..n).map(|i| DVec3::new(at(i, 0), at(i, 1), at(i, 2))).collect())
}

/// Reads the system `A V = P`, A = H·M, of a folder as `assemble` writes it: M.mtx (symmetric), H.mtx (N×1, the diagonal
/// of H; the identity if there is no such file) and P.mtx (N×3, N×2 or N×1). Other files are not looked at.
///
/// # Errors
/// Those of the readers and of [`LimitSystem::from_parts`], with the file's name; a part that is not there.
///
/// ```
/// use limitlab::assemble::matrix_market::{read_system, write_points, write_symmetric, write_vector};
/// use limitlab::assemble::LimitSystem;
/// use limitlab::schemes::Scheme;
/// use limitlab::mesh::{Surface, builtin};
/// use limitlab::output::write_file;
///
/// let surface = Surface::new(builtin::builtin("octahedron")?)?;
/// let system = LimitSystem::new(&surface, Scheme::Loop)?;
/// let folder = std::env::temp_dir().join(format!("limitlab-doc-{}", std::process::id()));
/// limitlab::output::create_dir(&folder)?;
/// write_file(&folder.join("M.mtx"), |out| write_symmetric(&system.m, &[], out))?;
/// write_file(&folder.join("H.mtx"), |out| write_vector(&system.h, &[], out))?;
/// write_file(&folder.join("P.mtx"), |out| write_points(surface.positions(), &[], out))?;
/// let (read, points) = read_system(&folder)?;
/// assert_eq!((read.a, points.as_slice()), (system.a, surface.positions()));
/// # std::fs::remove_dir_all(&folder).unwrap();
/// # Ok::<(), limitlab::Error>(())
/// ```
pub fn read_system(folder: &Path) -> Result<(LimitSystem, Vec<DVec3>)> {
    let [m, h, p] = PARTS.map(|name| folder.join(name));
    for (name, part) in
        [("M.mtx", "the symmetric matrix M"), ("P.mtx", "the right-hand side P, a column for each axis")]
    {
        if is_missing(&folder.join(name)) {
            return Err(Error::parse(folder, None, format!("there is no {name} in this folder: it holds {part}")));
        }
    }
    let matrix = read_matrix(&m)?;
    let weights = if is_missing(&h) { vec![1.0; matrix.len()] } else { read_vector(&h)? };
    let points = read_points(&p)?;
    for (path, count) in [(&h, weights.len()), (&p, points.len())] {
        if count != matrix.len() {
            let n = matrix.len();
            return Err(Error::parse(path, None, format!("{count} rows beside a matrix M of {n}: both need as many")));
        }
    }
    let system = LimitSystem::from_parts(weights, matrix).map_err(|e| match e {
        Error::Matrix(what) => Error::parse(folder, None, what),
        other => other,
    })?;
    Ok((system, points))
}

/// Whether a folder lacks this name; a link to nothing is no lack.
pub fn is_missing(path: &Path) -> bool {
    fs::symlink_metadata(path).is_err_and(|e| e.kind() == ErrorKind::NotFound)
}

/// The bytes of a file; the rest of it is read only if the first are those of a Matrix Market file, and memory has room.
fn read_bytes(path: &Path) -> Result<Vec<u8>> {
    const HEAD: u64 = 1 << 12;
    let refused = |e| Error::io(path, "read", e);
    let mut file = File::open(path).map_err(refused)?;
    let mut bytes = Vec::new();
    (&mut file).take(HEAD).read_to_end(&mut bytes).map_err(refused)?;
    check_start(&bytes, path)?;
    if bytes.len() as u64 == HEAD {
        let size = file.metadata().map_err(refused)?.len();
        require(size, || format!("{}: its text", path.display()), SMALLER)?;
        file.read_to_end(&mut bytes).map_err(refused)?;
    }
    Ok(bytes)
}

fn check_start(bytes: &[u8], path: &Path) -> Result<()> {
    let text = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
    if text.len() >= BANNER.len() && text[..BANNER.len()].eq_ignore_ascii_case(BANNER) {
        return Ok(());
    }
    let what = match other_kind(text) {
        Some(what) => format!("not a Matrix Market file: {what}"),
        None if text.is_empty() => "the file is empty: a Matrix Market file begins with %%MatrixMarket".into(),
        None => "not a Matrix Market file, whose first line begins with %%MatrixMarket: write it as such \
                 (scipy.io.mmwrite, MatrixMarket.jl, mmwrite.m)"
            .into(),
    };
    let line = (!text.is_empty()).then_some(1);
    Err(Error::parse(path, line, what))
}

/// The banner and the sizes of a file, and the place where its entries begin.
struct Text<'a> {
    path: &'a Path,
    sparse: bool,
    integer: bool,
    symmetric: bool,
    rows: usize,
    columns: usize,
    /// Numbers of an array, lines of a sparse matrix.
    entries: usize,
    body: Scanner<'a>,
}

impl<'a> Text<'a> {
    fn new(bytes: &'a [u8], path: &'a Path) -> Result<Self> {
        let mut scanner = Scanner::new(bytes, path).with_comment(b'%');
        let line = scanner.rest();
        scanner.skip_to_line_end();
        let line = &line[..line.len() - scanner.rest().len()];
        let words = line.split(u8::is_ascii_whitespace).filter(|w| !w.is_empty());
        let words: Vec<String> = words.map(|w| String::from_utf8_lossy(w).to_ascii_lowercase()).collect();
        let mut words = words.iter().map(String::as_str);
        let banner = words.next().unwrap_or_default();
        if !banner.as_bytes().eq_ignore_ascii_case(BANNER) {
            return Err(scanner.error(format!("{} is not %%MatrixMarket: correct it", quoted(banner.as_bytes()))));
        }
        // The choice among two words, whether it is the first; another word is refused by its name.
        let mut choose = |what: &str, first: &str, second: &str| match words.next() {
            Some(word) if word == first => Ok(true),
            Some(word) if word == second => Ok(false),
            Some(word) => Err(scanner.error(format!("{} is no {what} that is read: {READ}", quoted(word.as_bytes())))),
            None => Err(scanner.error(format!("the line ends where the {what} should be: {READ}"))),
        };
        choose("object", "matrix", "matrix")?;
        let sparse = choose("format", "coordinate", "array")?;
        let integer = choose("kind of number", "integer", "real")?;
        let symmetric = choose("symmetry", "symmetric", "general")?;
        if let Some(word) = words.next() {
            return Err(scanner.error(format!("{} is one word too many: {READ}", quoted(word.as_bytes()))));
        }
        scanner.skip_space();
        let at = scanner.line();
        let mut size = |what: &str| {
            scanner.skip_blanks();
            let size = scanner.unsigned::<u64>().and_then(|size| usize::try_from(size).ok());
            size.ok_or_else(|| scanner.unexpected(what))
        };
        let (rows, columns) = (size("the number of rows")?, size("the number of columns")?);
        let entries = if sparse { Some(size("the number of entries")?) } else { dense(rows, columns, symmetric) };
        scanner.skip_blanks();
        if !scanner.at_line_end() {
            return Err(scanner.unexpected("the end of the line with the sizes"));
        }
        if symmetric && rows != columns {
            let what =
                format!("a symmetric matrix of {rows} rows and {columns} columns: correct one of them, or the banner");
            return Err(scanner.error_at(at, what));
        }
        let (least, thing) = if sparse { ("1 1 1\n".len(), "lines of entries") } else { ("1\n".len(), "numbers") };
        // The last line may lack its end.
        let most = (scanner.rest().len() + 1) / least;
        let Some(entries) = entries.filter(|&entries| entries <= most) else {
            let announced = entries.map_or("more than 2^64".into(), |e| e.to_string());
            let what = format!(
                "{announced} {thing} are announced, and what is left of the file holds {most} at most: is it complete?"
            );
            return Err(scanner.error_at(at, what));
        };
        Ok(Text { path, sparse, integer, symmetric, rows, columns, entries, body: scanner })
    }

    fn has_columns(&self, allowed: RangeInclusive<usize>, wanted: &str) -> Result<()> {
        if allowed.contains(&self.columns) {
            return Ok(());
        }
        Err(Error::parse(self.path, None, format!("a matrix of {} columns: {wanted}", self.columns)))
    }

    /// The finite number that is `what`.
    fn number(&self, scanner: &mut Scanner, what: &dyn fmt::Display) -> Result<f64> {
        let word = scanner.peek_token();
        let wrong = |scanner: &Scanner, why: &str| Err(scanner.error(format!("{what} is {}: {why}", quoted(word))));
        match scanner.number() {
            None => Err(scanner.unexpected(what)),
            Some(x) if !x.is_finite() => wrong(scanner, "a finite number is needed; repair it where it comes from"),
            Some(x) if self.integer && x.fract() != 0.0 => {
                wrong(scanner, "the banner says integer; write real there if it is meant")
            }
            Some(x) => Ok(x),
        }
    }

    /// Calls `visit(scanner, i, j, a)` for every stored entry, counted from 0, in the order of the file; `scanner` tells
    /// its line.
    fn each(&self, mut visit: impl FnMut(&Scanner, usize, usize, f64) -> Result<()>) -> Result<()> {
        let mut scanner = self.body.clone();
        let count = self.entries;
        if self.sparse {
            scanner.begin_rows();
        }
        let (mut i, mut j) = (0, 0);
        for k in 1..=count {
            let what = Entry { k, count };
            if self.sparse {
                scanner.begin_row();
                i = index(&mut scanner, "row", self.rows, &what)?;
                scanner.next_in_row();
                j = index(&mut scanner, "column", self.columns, &what)?;
                scanner.next_in_row();
                let value = self.number(&mut scanner, &what)?;
                scanner.end_row(&what)?;
                visit(&scanner, i, j, value)?;
            } else {
                scanner.skip_space();
                let value = self.number(&mut scanner, &what)?;
                visit(&scanner, i, j, value)?;
                i += 1;
                if i == self.rows {
                    j += 1;
                    i = if self.symmetric { j } else { 0 };
                }
            }
        }
        scanner.skip_space();
        if !scanner.at_end() {
            return Err(scanner.error(format!("the file goes on after {count} entries, as many as are announced")));
        }
        Ok(())
    }

    /// All entries by columns.
    fn array(&self) -> Result<Vec<f64>> {
        let size = (self.rows as u64).saturating_mul(self.columns as u64);
        require(size.saturating_mul(8), || format!("{}: its array", self.path.display()), SMALLER)?;
        let mut all = vec![0.0; self.rows * self.columns];
        self.each(|_, i, j, value| {
            all[j * self.rows + i] += value;
            if self.symmetric && i != j {
                all[i * self.rows + j] += value;
            }
            Ok(())
        })?;
        self.finite(&all)?;
        Ok(all)
    }

    /// Refuses sums that are not finite; single numbers have been looked at.
    fn finite(&self, values: &[f64]) -> Result<()> {
        if values.iter().all(|v| v.is_finite()) {
            return Ok(());
        }
        let what =
            "entries of one place, which the format sums, go beyond the largest double: remove what is there twice";
        Err(Error::parse(self.path, None, what))
    }

    fn matrix(&self) -> Result<Csr> {
        let n = self.rows;
        let named = |e: Error| Error::parse(self.path, None, e.to_string());
        let all = if self.symmetric { 2 * self.entries } else { self.entries };
        check_size(n, self.columns, all).map_err(named)?;
        // Triplets, rows, and of symmetric matrices both triangles and their transposed.
        let bytes = 16 * self.entries as u64 + 24 * all as u64 + 16 * (n as u64 + 1);
        require(bytes, || format!("{}: the matrix", self.path.display()), SMALLER)?;
        let mut lower = Vec::with_capacity(self.entries);
        let mut upper = Vec::new();
        self.each(|_, i, j, value| {
            let (row, column) = (i as u32, j as u32);
            if !self.sparse && value == 0.0 {
                // A dense matrix may well be sparse.
            } else if self.symmetric && i < j {
                upper.push((column, row, value));
            } else {
                lower.push((row, column, value));
            }
            Ok(())
        })?;
        let lower = by_rows(n, lower);
        self.finite(lower.values())?;
        if !self.symmetric {
            return Ok(lower);
        }
        let both = if upper.is_empty() {
            lower
        } else {
            let upper = by_rows(n, upper);
            self.finite(upper.values())?;
            self.merge(&lower, &upper)?
        };
        let mirrored = both.transpose();
        let rows = (0..n).map(|i| both.row(i).chain(mirrored.row(i).skip_while(move |&(j, _)| j <= i)));
        Csr::from_sorted_rows(rows.map(|row| row.map(|(j, value)| (j as u32, value)))).map_err(named)
    }

    /// The lower triangle of a symmetric matrix, given by entries of it and by entries of the upper one, transposed.
    fn merge(&self, lower: &Csr, upper: &Csr) -> Result<Csr> {
        let mut rows = Vec::with_capacity(lower.len());
        for i in 0..lower.len() {
            let mut row: Vec<(u32, f64)> = lower.row(i).map(|(j, value)| (j as u32, value)).collect();
            for (j, value) in upper.row(i) {
                let column = j as u32;
                match row.binary_search_by_key(&column, |e| e.0) {
                    Err(place) => row.insert(place, (column, value)),
                    Ok(place) if row[place].1 == value => {}
                    Ok(place) => return Err(self.disagreement(i, j, row[place].1, value)),
                }
            }
            rows.push(row);
        }
        Csr::from_sorted_rows(rows.into_iter().map(|row| row.into_iter()))
    }

    /// The error of entries (i, j) and (j, i) that differ, i > j, at the line of the latter.
    fn disagreement(&self, i: usize, j: usize, below: f64, above: f64) -> Error {
        let found = self.each(|scanner, row, column, _| {
            if (row, column) != (j, i) {
                return Ok(());
            }
            Err(scanner.error(format!(
                "entry ({}, {}) is {above:e} and entry ({}, {}) is {below:e}: a symmetric matrix has equal ones; write \
                 the lower triangle alone, or general in the banner",
                j + 1,
                i + 1,
                i + 1,
                j + 1
            )))
        });
        found.expect_err("the entry was there when the file was read before")
    }
}

/// An entry's number, in words.
struct Entry {
    k: usize,
    count: usize,
}

impl fmt::Display for Entry {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "entry {} of {}", self.k, self.count)
    }
}

/// The numbers that an array stores; `None` if they are more than can be counted.
fn dense(rows: usize, columns: usize, symmetric: bool) -> Option<usize> {
    if symmetric { Some(rows.checked_mul(rows.checked_add(1)?)? / 2) } else { rows.checked_mul(columns) }
}

/// The index here, counted from 1 in the file.
fn index(scanner: &mut Scanner, side: &str, size: usize, of: &dyn fmt::Display) -> Result<usize> {
    let word = scanner.peek_token();
    match scanner.unsigned::<usize>() {
        None => Err(scanner.unexpected(format_args!("the {side} of {of}"))),
        Some(k) if (1..=size).contains(&k) => Ok(k - 1),
        Some(_) => Err(scanner.error(format!(
            "the {side} of {of} is {}: the matrix has {size}, counted from 1; correct it, or the sizes",
            quoted(word)
        ))),
    }
}

/// Triplets (row, column, value) as rows: sorted, and those of one place summed in their order.
fn by_rows(n: usize, mut triplets: Vec<(u32, u32, f64)>) -> Csr {
    triplets.sort_by_key(|t| (t.0, t.1));
    let mut offsets = vec![0u32; n + 1];
    let (mut columns, mut values): (Vec<u32>, Vec<f64>) = (Vec::new(), Vec::new());
    for same in triplets.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        offsets[same[0].0 as usize + 1] += 1;
        columns.push(same[0].1);
        values.push(same[1..].iter().fold(same[0].2, |sum, t| sum + t.2));
    }
    for i in 0..n {
        offsets[i + 1] += offsets[i];
    }
    Csr::new(Arc::new(Pattern::new(offsets, columns)), values)
}
