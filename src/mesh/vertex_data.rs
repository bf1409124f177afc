//! Per-vertex data from text: lists of vertices, normals, numbers.

use std::path::Path;

use glam::DVec3;

use super::file_tags::{check_corner, check_crease, not_there, there};
use super::io::{self, has_mesh_ending};
use super::origin::Origin;
use super::{Surface, magic};
use crate::error::{Error, Result};
use crate::text::{Scanner, quoted};

/// Reads `LIST|FILE` of vertices: numbers and ranges `A..B` (both ends included), separated by commas or white
/// space; in a file `#` starts a comment. One mark a vertex comes back.
///
/// # Errors
/// What is no number, and a vertex that the mesh lacks, with the line in a file.
pub fn vertex_marks(text: &str, vertices: usize) -> Result<Vec<bool>> {
    let path = Path::new(text);
    let is_file = path.is_file();
    let bytes = if is_file { read(path)? } else { text.into() };
    if !is_file && let Some(at) = text.find('#') {
        let what = format!("{} would be a comment in a file, and {} is none", quoted(&bytes[at..]), quoted(&bytes));
        return Err(Error::Unknown(what));
    }
    let mut s = Scanner::new(&bytes, path);
    let mut marks = vec![false; vertices];
    loop {
        s.skip_space();
        if s.at_end() {
            break;
        }
        for item in s.token().split(|&b| b == b',').filter(|i| !i.is_empty()) {
            let refuse = |what: &str| {
                let what = format!("{} {what}", quoted(item));
                if is_file { s.error(what) } else { Error::Unknown(what) }
            };
            let range = std::str::from_utf8(item).ok().and_then(|item| {
                let (from, to) = item.split_once("..").unwrap_or((item, item));
                Some((from.parse::<usize>().ok()?, to.parse::<usize>().ok()?))
            });
            let (from, to) = range
                .ok_or_else(|| refuse("is neither a vertex, a range A..B nor a file: vertices are numbered from 0"))?;
            if from > to {
                return Err(refuse(&format!("is a reversed range: write {to}..{from}")));
            }
            if to >= vertices {
                return Err(refuse(&format!("names a vertex that the mesh lacks: it has {vertices}, numbered from 0")));
            }
            marks[from..=to].fill(true);
        }
    }
    Ok(marks)
}

/// Reads the normals of a mesh file (one a vertex; a zero vector is none), or of a text file with lines
/// `vertex nx ny nz`.
///
/// # Errors
/// A file that cannot be read or holds no normals, another number of vertices, lines of another form, a vertex with
/// two normals.
pub fn normals(path: &Path, vertices: usize) -> Result<Vec<Option<DVec3>>> {
    if !has_mesh_ending(path) {
        let rows = rows::<3>(path, vertices, "vertex nx ny nz")?;
        return Ok(rows.into_iter().map(|r| r.map(DVec3::from)).collect());
    }
    let Some(normals) = io::read_normals(path)? else {
        return Err(Error::parse(
            path,
            None,
            "holds no normals that can be told from other numbers: export them, in OFF as NOFF without colours, or \
             use a text file with lines `vertex nx ny nz`",
        ));
    };
    if normals.len() != vertices {
        let what = format!("holds {} normals for a mesh of {vertices} vertices: one a vertex is needed", normals.len());
        return Err(Error::parse(path, None, what));
    }
    let some = |n: DVec3| (n != DVec3::ZERO).then_some(n);
    Ok(normals.into_iter().map(some).collect())
}

/// Reads `NUMBER|FILE`: one number for all vertices, or a file with lines `vertex number`, and `otherwise` for the
/// vertices that it does not name.
///
/// # Errors
/// As [`normals`], for files.
pub fn numbers(text: &str, vertices: usize, otherwise: f64) -> Result<Vec<f64>> {
    if let Ok(number) = text.parse() {
        return Ok(vec![number; vertices]);
    }
    let rows = rows::<1>(Path::new(text), vertices, "vertex number")?;
    let value = |row: Option<[f64; 1]>| row.map_or(otherwise, |[x]| x);
    Ok(rows.into_iter().map(value).collect())
}

/// Reads sharp edges: lines `a b sharpness`, a and b the ends of an edge. Where vertices are numbered otherwise than those of
/// the surface, `origin` tells where each went.
///
/// # Errors
/// Lines of another form, an edge that the mesh lacks, a sharpness that is none, with the line.
pub fn creases(path: &Path, surface: &Surface, origin: Option<&Origin>) -> Result<Vec<([u32; 2], f64)>> {
    let mut creases = Vec::new();
    let vertices = origin.map_or(surface.len(), Origin::vertices);
    lines(path, vertices, "a b sharpness", |line, ends: [usize; 2], [sharpness]: [f64; 1]| {
        check_crease(path, line, surface, ends.map(|v| v as u32), origin, sharpness, &mut creases)
    })?;
    Ok(creases)
}

/// Reads sharp vertices of a surface: lines `vertex sharpness`, numbered as in [`creases`].
///
/// # Errors
/// Lines of another form, a vertex that the mesh lacks, a sharpness that is none, with the line.
pub fn corners(path: &Path, surface: &Surface, origin: Option<&Origin>) -> Result<Vec<(u32, f64)>> {
    let mut corners = Vec::new();
    let vertices = origin.map_or(surface.len(), Origin::vertices);
    lines(path, vertices, "vertex sharpness", |line, [v]: [usize; 1], [sharpness]: [f64; 1]| {
        check_corner(path, line, v as u32, sharpness)?;
        corners.extend(there(origin, v as u32).map(|v| (v, sharpness)));
        Ok(())
    })?;
    Ok(corners)
}

/// The lines of a text file as a vertex and K numbers each.
fn rows<const K: usize>(path: &Path, vertices: usize, form: &str) -> Result<Vec<Option<[f64; K]>>> {
    let mut rows = vec![None; vertices];
    lines(path, vertices, form, |line, [vertex]: [usize; 1], row: [f64; K]| {
        if rows[vertex].replace(row).is_some_and(|before| before != row) {
            let what = format!("vertex {vertex} is given twice, and differently: keep one");
            return Err(Error::parse(path, Some(line), what));
        }
        Ok(())
    })?;
    Ok(rows)
}

/// Calls `visit(line, vertices, numbers)` for the lines of a text file of V vertices and K numbers each, of which there has to
/// be one: who names a file means that it says something.
fn lines<const V: usize, const K: usize>(
    path: &Path,
    vertices: usize,
    form: &str,
    mut visit: impl FnMut(usize, [usize; V], [f64; K]) -> Result<()>,
) -> Result<()> {
    let bytes = read(path)?;
    let mut s = Scanner::new(&bytes, path);
    s.skip_space();
    if s.at_end() {
        return Err(Error::parse(path, None, format!("has no line `{form}`: leave the file out where none is meant")));
    }
    while !s.at_end() {
        let line = s.line();
        let mut ends = [0; V];
        for (k, end) in ends.iter_mut().enumerate() {
            s.skip_blanks();
            let place = s.clone();
            let which = if k == 0 { "the" } else { "the next" };
            let what = format_args!("{which} vertex (0, 1, 2, …) of a line `{form}`");
            *end = s.unsigned().ok_or_else(|| place.unexpected(what))?;
        }
        let mut row = [0.0; K];
        for x in &mut row {
            s.skip_blanks();
            let place = s.clone();
            let number = s.number().filter(|number| number.is_finite());
            *x = number.ok_or_else(|| place.unexpected(format_args!("a finite number of a line `{form}`")))?;
        }
        s.skip_blanks();
        if !s.at_line_end() {
            return Err(s.unexpected(format_args!("the end of a line `{form}`")));
        }
        if let Some(vertex) = ends.iter().find(|&&v| v >= vertices) {
            return Err(s.error(not_there(vertex, vertices)));
        }
        visit(line, ends, row)?;
        s.skip_space();
    }
    Ok(())
}

fn read(path: &Path) -> Result<Vec<u8>> {
    let bytes = std::fs::read(path).map_err(|e| Error::io(path, "read", e))?;
    match magic::other_kind(&bytes) {
        Some(what) => Err(Error::parse(path, None, format!("not a text file: {what}"))),
        None => Ok(bytes),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(text: &str) -> tempfile::NamedTempFile {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), text).unwrap();
        file
    }

    #[test]
    fn vertices_are_numbers_and_ranges_in_lists_and_files() {
        let marked = |text: &str| -> Vec<usize> {
            let marks = vertex_marks(text, 10).unwrap();
            (0..10).filter(|&v| marks[v]).collect()
        };
        assert_eq!(marked("0, 3..5,9"), [0, 3, 4, 5, 9]);
        let comment = vertex_marks("1 #2.txt", 10).unwrap_err().to_string();
        assert_eq!(comment, "\"#2.txt\" would be a comment in a file, and \"1 #2.txt\" is none");
        let listed = file("# chosen\n0 3..5 # a range\n\n9\n");
        assert_eq!(marked(listed.path().to_str().unwrap()), [0, 3, 4, 5, 9]);
        let refused = |text: &str| vertex_marks(text, 10).unwrap_err().to_string();
        assert!(refused("3,x").starts_with("\"x\" is neither"));
        assert!(refused("5..10").contains("the mesh lacks: it has 10"));
        assert!(refused("5..4").contains("\"5..4\" is a reversed range: write 4..5"));
        assert!(refused(file("1 2#3\n").path().to_str().unwrap()).contains(", line 1: \"2#3\""));
        let bad = file("1\n2 ten\n");
        assert!(refused(bad.path().to_str().unwrap()).contains(", line 2: \"ten\""));
    }

    #[test]
    fn rows_are_read_once_a_vertex_and_errors_name_the_line() {
        let good = file("2 0 0 1 # up\n\n0 1e-3 2 -3\n2 0 0 1\n");
        let found = normals(good.path(), 3).unwrap();
        assert_eq!(found, [Some(DVec3::new(1e-3, 2.0, -3.0)), None, Some(DVec3::Z)]);
        for (text, what) in [
            ("0 1 2\n", ", line 1: the line ends where a finite number of a line `vertex nx ny nz`"),
            ("0 1 2 3 4\n", ", line 1: \"4\" is not the end of a line `vertex nx ny nz`"),
            ("\n-1 1 2 3\n", ", line 2: \"-1\" is not the vertex (0, 1, 2, …) of a line"),
            (
                "# x\r0 1 2 -1.#IND\r",
                ", line 2: \"-1.#IND\" is not a finite number of a line `vertex nx ny nz`: it stands",
            ),
            ("0 1 2 nan\n", ", line 1: \"nan\" is not a finite number"),
            ("0 0 0 1\n3 1 2 3\n", ", line 2: vertex 3 is not in the mesh"),
            ("1 0 0 1\n1 0 0 2\n", ", line 2: vertex 1 is given twice"),
        ] {
            let error = normals(file(text).path(), 3).unwrap_err().to_string();
            assert!(error.contains(what), "{error}");
        }
        assert!(normals(Path::new("/nowhere/normals.txt"), 3).is_err());
        assert_eq!(numbers("0.5", 3, 1.0).unwrap(), [0.5; 3]);
        let few = file("1 2.5\n");
        assert_eq!(numbers(few.path().to_str().unwrap(), 3, 1.0).unwrap(), [1.0, 2.5, 1.0]);
    }

    #[test]
    fn normals_of_a_mesh_file_fit_the_mesh() {
        let folder = tempfile::tempdir().unwrap();
        let mesh = super::super::builtin::tetrahedron();
        let mut given = mesh.positions.clone();
        given[2] = DVec3::ZERO;
        for name in ["a.off", "a.ply", "a.obj"] {
            let path = folder.path().join(name);
            io::write(&path, &mesh, Some(&given)).unwrap();
            let found = normals(&path, 4).unwrap();
            assert_eq!(found[0], Some(given[0]));
            assert_eq!(found[2], None);
            assert!(normals(&path, 5).unwrap_err().to_string().contains("4 normals for a mesh of 5"));
        }
        let path = folder.path().join("plain.obj");
        io::write(&path, &mesh, None).unwrap();
        assert!(normals(&path, 4).unwrap_err().to_string().contains("holds no normals"));
    }
}
