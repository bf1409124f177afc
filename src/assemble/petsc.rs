//! PETSc's binary files: a [system](StreamedSystem) written for its solvers, and their solution read back.
//!
//! All numbers are big-endian, and an index has the width that PETSc was configured with (`PetscInt`), 4 bytes or 8:
//!
//! ```text
//! matrix   1211216, rows, columns, entries | length of each row | columns of all entries | their values
//! vector   1211214, n                      | n values
//! indices  1211218, n                      | n indices
//! ```
//!
//! Indices but for the values, which are doubles (MatLoad, VecLoad and ISLoad in the PETSc users manual, Balay et al. 2022).
//! Points are one vector, x, y, z of each in turn, as a `MATMAIJ` of three takes them.

use std::fs::File;
use std::io::{self, BufReader, ErrorKind, Read, Write};
use std::ops::Range;
use std::path::Path;

use glam::DVec3;

use super::curves::Curves;
use super::stages::free;
use super::streamed::StreamedSystem;
use crate::error::{Error, Result};
use crate::memory::require;
use crate::mesh::Surface;
use crate::mesh::magic::other_kind;
use crate::parallel;
use crate::schemes::Scheme;

/// The width of an index.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Index {
    /// 4 bytes, PETSc's default.
    Bits32,
    /// 8 bytes, of a PETSc that is configured with 64-bit indices.
    Bits64,
}

impl Index {
    /// 32 or 64.
    pub fn bits(self) -> u32 {
        match self {
            Index::Bits32 => 32,
            Index::Bits64 => 64,
        }
    }

    fn put(self, index: u64, bytes: &mut Vec<u8>) {
        let all = index.to_be_bytes();
        bytes.extend_from_slice(match self {
            Index::Bits32 => &all[4..],
            Index::Bits64 => &all,
        });
    }
}

/// The file of the vertex of each row, beside which a solution is read.
pub const ORDER: &str = "order.petsc";

/// What a file holds, by its first number.
const MATRIX: u64 = 1_211_216;
const VECTOR: u64 = 1_211_214;
const INDICES: u64 = 1_211_218;
const KINDS: [(u64, &str); 3] = [(MATRIX, "a matrix"), (VECTOR, "a vector"), (INDICES, "a list of indices")];

/// Rows that are made before they are written, and those of one task.
const BLOCK: usize = 1 << 16;
const TASK: usize = 1 << 11;

/// A system that is written row by row.
///
/// ```
/// use limitlab::assemble::StreamedSystem;
/// use limitlab::assemble::petsc::{Export, Index};
/// use limitlab::mesh::{Surface, builtin};
/// use limitlab::schemes::Scheme;
///
/// let surface = Surface::new(builtin::builtin("tetrahedron")?)?;
/// let system = StreamedSystem::new(&surface, Scheme::Loop, &[0, 1, 2, 3])?;
/// let export = Export::new(&system, Index::Bits32)?;
/// let mut bytes = Vec::new();
/// export.write_matrix(&mut bytes).unwrap();
/// // Four numbers, four lengths, and 16 entries of 4 + 8 bytes.
/// assert_eq!((export.entries(), bytes.len()), (16, 4 * 4 + 4 * 4 + 16 * 12));
/// assert_eq!(bytes[..8], [0, 0x12, 0x7b, 0x50, 0, 0, 0, 4]);
/// # Ok::<(), limitlab::Error>(())
/// ```
pub struct Export<'a> {
    system: &'a StreamedSystem,
    index: Index,
    lengths: Vec<u32>,
    entries: u64,
}

impl<'a> Export<'a> {
    /// Counts the entries. O(entries), as each of the writers.
    ///
    /// # Errors
    /// [`Error::TooLarge`] where 32-bit indices, which are signed, do not count entries and interleaved coordinates.
    pub fn new(system: &'a StreamedSystem, index: Index) -> Result<Self> {
        let lengths = parallel::flat_map(system.len(), TASK, |rows| {
            let mut entries = Vec::new();
            let length = |k| {
                system.row(k, &mut entries);
                entries.len() as u32
            };
            rows.map(length).collect()
        });
        let entries = lengths.iter().map(|&length| u64::from(length)).sum();
        check_index(system.len() as u64, entries, index)?;
        Ok(Export { system, index, lengths, entries })
    }

    /// The stored entries of M.
    pub fn entries(&self) -> u64 {
        self.entries
    }

    /// Writes M. The rows are made twice, a block of them at a time, on all threads: the format has all columns before all
    /// values.
    ///
    /// # Errors
    /// Those of `out`.
    pub fn write_matrix(&self, out: &mut dyn Write) -> io::Result<()> {
        let n = self.system.len() as u64;
        let mut head = Vec::new();
        [MATRIX, n, n, self.entries].into_iter().for_each(|number| self.index.put(number, &mut head));
        out.write_all(&head)?;
        self.write_blocks(out, |rows, bytes| {
            self.lengths[rows].iter().for_each(|&length| self.index.put(length.into(), bytes));
        })?;
        self.write_entries(out, |column, _, bytes| self.index.put(column.into(), bytes))?;
        self.write_entries(out, |_, value, bytes| bytes.extend_from_slice(&value.to_be_bytes()))
    }

    /// Writes what `put` makes of the column and the value of every entry.
    fn write_entries(&self, out: &mut dyn Write, put: impl Fn(u32, f64, &mut Vec<u8>) + Sync) -> io::Result<()> {
        self.write_blocks(out, |rows, bytes| {
            let mut entries = Vec::new();
            for k in rows {
                self.system.row(k, &mut entries);
                entries.iter().for_each(|&(column, value)| put(column, value, bytes));
            }
        })
    }

    /// Writes R, the right-hand side of `M V = R` for the points of all vertices.
    ///
    /// # Errors
    /// Those of `out`.
    ///
    /// # Panics
    /// If there is not one point a vertex.
    pub fn write_right_hand_side(&self, points: &[DVec3], out: &mut dyn Write) -> io::Result<()> {
        let right = self.system.right_hand_side(points);
        self.write_head(VECTOR, 3 * right.len(), out)?;
        self.write_blocks(out, |rows, bytes| {
            let numbers = right[rows].iter().flat_map(|r| r.to_array());
            numbers.for_each(|x| bytes.extend_from_slice(&x.to_be_bytes()));
        })
    }

    /// Writes h by row.
    ///
    /// # Errors
    /// Those of `out`.
    pub fn write_weights(&self, out: &mut dyn Write) -> io::Result<()> {
        self.write_head(VECTOR, self.system.len(), out)?;
        self.write_blocks(out, |rows, bytes| {
            rows.for_each(|k| bytes.extend_from_slice(&self.system.weight(k).to_be_bytes()));
        })
    }

    /// Writes the vertex of each row.
    ///
    /// # Errors
    /// Those of `out`.
    pub fn write_order(&self, out: &mut dyn Write) -> io::Result<()> {
        self.write_head(INDICES, self.system.len(), out)?;
        let vertices = self.system.vertices();
        self.write_blocks(out, |rows, bytes| {
            vertices[rows].iter().for_each(|&v| self.index.put(v.into(), bytes));
        })
    }

    fn write_head(&self, kind: u64, count: usize, out: &mut dyn Write) -> io::Result<()> {
        let mut head = Vec::new();
        [kind, count as u64].into_iter().for_each(|number| self.index.put(number, &mut head));
        out.write_all(&head)
    }

    /// Writes what `fill` gives for all rows, in order.
    fn write_blocks(&self, out: &mut dyn Write, fill: impl Fn(Range<usize>, &mut Vec<u8>) + Sync) -> io::Result<()> {
        let n = self.system.len();
        for first in (0..n).step_by(BLOCK) {
            let block = parallel::flat_map(BLOCK.min(n - first), TASK, |rows| {
                let mut bytes = Vec::new();
                fill(first + rows.start..first + rows.end, &mut bytes);
                bytes
            });
            out.write_all(&block)?;
        }
        Ok(())
    }
}

/// Refuses what signed indices of this width do not count.
fn check_index(rows: u64, entries: u64, index: Index) -> Result<()> {
    let most = match index {
        Index::Bits32 => i32::MAX as u64,
        Index::Bits64 => i64::MAX as u64,
    };
    if entries.max(3 * rows) <= most {
        return Ok(());
    }
    Err(Error::TooLarge {
        what: format!(
            "a matrix of {rows} rows has {entries} entries, and its right-hand side {} numbers, of which PETSc's {}-bit \
             indices count {most}",
            3 * rows,
            index.bits()
        ),
        advice: "write 64-bit indices, for a PETSc that is configured with them",
    })
}

/// Reads a vector.
///
/// # Errors
/// [`Error::Io`]; [`Error::Parse`] where the file is of another kind or byte order, shorter or longer than it says, or holds what
/// is not finite; [`Error::Memory`].
pub fn read_vector(path: &Path) -> Result<Vec<f64>> {
    let (mut body, count, _) = open(path, VECTOR)?;
    let mut values = Vec::with_capacity(count);
    for k in 0..count {
        let x = body.double()?;
        if !x.is_finite() {
            let what = format!("number {k} is {x}: the solver that wrote it did not converge");
            return Err(Error::parse(path, None, what));
        }
        values.push(x);
    }
    Ok(values)
}

/// Reads points from a vector that interleaves their coordinates.
///
/// # Errors
/// As [`read_vector`]; a length that is no multiple of three.
///
/// ```
/// let path = std::env::temp_dir().join(format!("limitlab-doc-{}.petsc", std::process::id()));
/// let numbers = [1.0f64, 2.0, 3.0].map(f64::to_be_bytes);
/// std::fs::write(&path, [&1_211_214u32.to_be_bytes()[..], &3u32.to_be_bytes(), &numbers.concat()].concat()).unwrap();
/// assert_eq!(limitlab::assemble::petsc::read_points(&path)?, [glam::DVec3::new(1.0, 2.0, 3.0)]);
/// # std::fs::remove_file(&path).unwrap();
/// # Ok::<(), limitlab::Error>(())
/// ```
pub fn read_points(path: &Path) -> Result<Vec<DVec3>> {
    let numbers = read_vector(path)?;
    let (points, rest) = numbers.as_chunks::<3>();
    if !rest.is_empty() {
        let what = format!("{} numbers, and points have three each: x, y, z in turn", numbers.len());
        return Err(Error::parse(path, None, what));
    }
    Ok(points.iter().map(|&p| DVec3::from_array(p)).collect())
}

/// Reads a list of indices below 2³².
///
/// # Errors
/// As [`read_vector`]; an index that is negative, or too large.
pub fn read_indices(path: &Path) -> Result<Vec<u32>> {
    let (mut body, count, index) = open(path, INDICES)?;
    let mut indices = Vec::with_capacity(count);
    for k in 0..count {
        let i = body.index(index)?;
        let i = u32::try_from(i).map_err(|_| {
            Error::parse(path, None, format!("index {k} is {i}: vertices are numbered from 0 to 2^32 − 1"))
        })?;
        indices.push(i);
    }
    Ok(indices)
}

/// The control points of a solution of the exported system: those of its rows from the file at `path`, in the order that
/// [`ORDER`] beside it tells, and those on curves and at corners, which are known without. Whether it is a solution is not
/// looked at: [`limit_points`](crate::interpolate::limit_points) tells.
///
/// # Errors
/// As [`read_points`] and [`read_indices`]; rows that are not those of the smooth vertices of this surface.
pub fn read_control(path: &Path, surface: &Surface, scheme: Scheme) -> Result<Vec<DVec3>> {
    let beside = path.with_file_name(ORDER);
    let order = read_indices(&beside).map_err(|e| match e {
        Error::Io { path, source, .. } if source.kind() == ErrorKind::NotFound => {
            let what = "there is no such file: a solution is read in the folder of the system that was solved";
            Error::parse(&path, None, what)
        }
        other => other,
    })?;
    let solved = read_points(path)?;
    if solved.len() != order.len() {
        let what = format!("{} points, and the system beside it has {} rows", solved.len(), order.len());
        return Err(Error::parse(path, None, what));
    }
    let marks = free(surface, None)?;
    let is_free = |v: usize| marks.as_ref().is_none_or(|marks| marks[v]);
    let n = surface.len();
    let smooth = (0..n).filter(|&v| is_free(v)).count();
    let of_another = |what: String| {
        Err(Error::parse(
            &beside,
            None,
            format!("{what}: the system is of another mesh, or of other creases and corners"),
        ))
    };
    if order.len() != smooth {
        return of_another(format!("{} rows, and this mesh has {smooth} smooth vertices", order.len()));
    }
    let mut control = surface.positions().to_vec();
    Curves::new(surface, scheme, None)?.solve(&mut control);
    let mut is_met = vec![false; n];
    for (k, (&v, point)) in order.iter().zip(solved).enumerate() {
        let v = v as usize;
        if v >= n || !is_free(v) || is_met[v] {
            let why = match v {
                _ if v >= n => "which this mesh does not have",
                _ if is_free(v) => "as one before it is",
                _ => "which is not smooth in this mesh",
            };
            return of_another(format!("row {k} is that of vertex {v}, {why}"));
        }
        is_met[v] = true;
        control[v] = point;
    }
    Ok(control)
}

/// The rest of a file after its head.
struct Body<'a> {
    path: &'a Path,
    file: BufReader<File>,
}

impl Body<'_> {
    fn bytes<const N: usize>(&mut self) -> Result<[u8; N]> {
        let mut bytes = [0; N];
        self.file.read_exact(&mut bytes).map_err(|e| Error::io(self.path, "read", e))?;
        Ok(bytes)
    }

    fn double(&mut self) -> Result<f64> {
        self.bytes().map(f64::from_be_bytes)
    }

    fn index(&mut self, index: Index) -> Result<i64> {
        Ok(match index {
            Index::Bits32 => i32::from_be_bytes(self.bytes()?).into(),
            Index::Bits64 => i64::from_be_bytes(self.bytes()?),
        })
    }
}

/// A file of this kind: what follows its head, how many numbers that are, and the width of its indices.
fn open(path: &Path, kind: u64) -> Result<(Body<'_>, usize, Index)> {
    let refused = |e| Error::io(path, "read", e);
    let file = File::open(path).map_err(refused)?;
    let size = file.metadata().map_err(refused)?.len();
    let mut body = Body { path, file: BufReader::with_capacity(1 << 16, file) };
    let mut first = Vec::new();
    (&mut body.file).take(8).read_to_end(&mut first).map_err(refused)?;
    let index = width(&first, kind).map_err(|what| Error::parse(path, None, what))?;
    let short = || Error::parse(path, None, "the file ends within its head: is it complete?");
    let count = match (index, <[u8; 8]>::try_from(&first[..])) {
        (_, Err(_)) => return Err(short()),
        (Index::Bits32, Ok([_, _, _, _, count @ ..])) => i32::from_be_bytes(count).into(),
        (Index::Bits64, Ok(_)) if size < 16 => return Err(short()),
        (Index::Bits64, Ok(_)) => body.index(index)?,
    };
    let (head, each) = match (index, kind) {
        (Index::Bits32, INDICES) => (8, 4),
        (Index::Bits32, _) => (8, 8),
        (Index::Bits64, _) => (16, 8),
    };
    // Negative sizes too are not those of the file.
    let expected = i128::from(count) * each + head;
    if expected != i128::from(size) {
        let why = if expected > size.into() { "is it complete?" } else { "it goes on after them" };
        let what =
            format!("{count} numbers are announced, {expected} bytes with the head, and the file has {size}: {why}");
        return Err(Error::parse(path, None, what));
    }
    require(size, || format!("{}: its numbers", path.display()), "use a smaller system")?;
    Ok((body, (size - head as u64) as usize / each as usize, index))
}

/// The width of the indices of a file of this kind, by its first bytes; or what is wrong with them.
fn width(first: &[u8], kind: u64) -> std::result::Result<Index, String> {
    let name = |kind: u64| KINDS.iter().find(|known| known.0 == kind).map(|known| known.1);
    let wanted = name(kind).unwrap_or_default();
    if first.is_empty() {
        return Err(format!("the file is empty: {wanted} of PETSc begins with the number {kind}"));
    }
    let narrow = first.first_chunk::<4>();
    let wide = first.first_chunk::<8>();
    let big = [
        (narrow.map(|b| u64::from(u32::from_be_bytes(*b))), Index::Bits32),
        (wide.map(|b| u64::from_be_bytes(*b)), Index::Bits64),
    ];
    for (number, index) in big {
        match number.map(|number| (number == kind, name(number))) {
            Some((true, _)) => return Ok(index),
            Some((false, Some(other))) => return Err(format!("it holds {other}, and {wanted} is needed")),
            Some((false, None)) | None => {}
        }
    }
    let little = [narrow.map(|b| u64::from(u32::from_le_bytes(*b))), wide.map(|b| u64::from_le_bytes(*b))];
    if little.into_iter().flatten().any(|number| name(number).is_some()) {
        return Err("its bytes are in little-endian order: PETSc's binary files are big-endian on every machine".into());
    }
    let what = other_kind(first).map_or_else(|| format!("it begins with the bytes {first:02x?}"), str::to_owned);
    Err(format!("no binary file of PETSc: {what}, and {wanted} begins with the number {kind}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_32_bits_do_not_count_is_told_with_its_numbers() {
        let most = i32::MAX as u64;
        for (rows, entries, fits) in
            [(10, most, true), (10, most + 1, false), (most / 3, 1, true), (most / 3 + 1, 1, false)]
        {
            assert_eq!(check_index(rows, entries, Index::Bits32).is_ok(), fits, "{rows} {entries}");
            check_index(rows, entries, Index::Bits64).unwrap();
        }
        let text = check_index(300_000_000, 2_700_000_000, Index::Bits32).unwrap_err().to_string();
        for part in ["300000000 rows", "2700000000 entries", "32-bit indices count 2147483647", "64-bit indices, for"] {
            assert!(text.contains(part), "{text}");
        }
    }
}
