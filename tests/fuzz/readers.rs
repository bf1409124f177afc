//! Any bytes through the readers: of the six mesh formats, of normals in OBJ files, of lists of vertices, normals and
//! numbers. What is refused is refused in one line; what is read can be written, and reads back equal.

use std::fmt::Debug;
use std::io::Write;
use std::path::Path;

use limitlab::Result;
use limitlab::mesh::io::Loaded;
use limitlab::mesh::validate::{Boundary, validate};
use limitlab::mesh::{gltf, stl, vertex_data};
use tempfile::NamedTempFile;

use super::formats::{FORMATS, Format, Read, writes_and_reads_back};
use super::surface::euler_if_closed;

/// Vertices of the mesh that lists are about.
const VERTICES: usize = 12;
/// Corners up to which the second opinion is asked for.
const SMALL: usize = 10_000;

/// The first byte chooses the reader, the others are the file.
pub fn check(data: &[u8]) {
    let Some((&kind, bytes)) = data.split_first() else { return };
    // Bytes that the corpus has keep their readers.
    match kind {
        6 | 192.. => mesh_of(&FORMATS[3], bytes),
        7 | 128..144 => mesh(".stl", stl::read_bytes, bytes),
        8 | 144..160 => mesh(".glb", gltf::read_bytes, bytes),
        _ => match kind % 6 {
            3 => vertices(bytes),
            4 => normals(bytes),
            5 => numbers(bytes),
            format => mesh_of(&FORMATS[format as usize], bytes),
        },
    }
}

/// What was read, unless the reader refused it as it should.
fn accepted<T>(result: Result<T>) -> Option<T> {
    result.map_err(|e| one_line(&e.to_string())).ok()
}

/// Also no carriage returns and escape sequences, with which a file could rewrite the terminal.
fn one_line(text: &str) {
    assert!(!text.is_empty() && !text.contains(char::is_control), "not one line: {text:?}");
}

fn mesh_of(format: &Format, bytes: &[u8]) {
    mesh(format.ending, format.read, bytes);
}

fn mesh(ending: &str, read: Read, bytes: &[u8]) {
    let path = Path::new("x.mesh");
    let Some(Loaded { mesh, lines, normals, remarks, tags, .. }) = accepted(read(bytes, path)) else { return };
    assert!(lines.iter().all(|l| l.vertices.len() == mesh.len() && l.faces.len() == mesh.faces.len()));
    remarks.iter().for_each(|remark| one_line(remark));
    let vertices = tags.creases.iter().flat_map(|c| c.ends).chain(tags.corners.iter().map(|c| c.vertex));
    assert!(vertices.max().is_none_or(|v| (v as usize) < mesh.len()));
    let sharpnesses = tags.creases.iter().map(|c| c.sharpness).chain(tags.corners.iter().map(|c| c.sharpness));
    assert!(sharpnesses.into_iter().all(|s| s >= 0.0));
    let finite = mesh.positions.iter().all(|p| p.is_finite());
    let lines = lines.as_ref().map(|l| (&l.vertices[..], &l.faces[..]));
    for boundary in [Boundary::Refuse, Boundary::AsInterior] {
        let report = validate(&mesh, lines, boundary);
        one_line(&report.summary_line());
        report.remarks.iter().for_each(|remark| one_line(remark));
        assert!(serde_json::to_value(&report).is_ok());
        if boundary == Boundary::Refuse && mesh.faces.corners().len() <= SMALL {
            let valid = finite && euler_if_closed(&mesh).is_some();
            assert_eq!(report.is_valid(), valid, "{}", report.summary_line());
        }
    }
    // An OBJ file has its normals at the corners.
    let normals = match ending {
        ".obj" => {
            let file = file(bytes, ending);
            accepted(limitlab::mesh::io::read_normals(file.path())).flatten()
        }
        _ => normals,
    };
    assert!(normals.as_ref().is_none_or(|n| n.len() == mesh.len()));
    // An OBJ file without vertices is taken for something else.
    if !mesh.is_empty() && finite && normals.iter().flatten().all(|n| n.is_finite()) {
        writes_and_reads_back(&mesh, normals.as_deref());
    }
}

fn file(bytes: &[u8], ending: &str) -> NamedTempFile {
    let mut file = tempfile::Builder::new().suffix(ending).tempfile().unwrap();
    file.write_all(bytes).unwrap();
    file
}

fn vertices(bytes: &[u8]) {
    let listed = file(bytes, ".txt");
    let from_file = accepted(vertex_data::vertex_marks(listed.path().to_str().unwrap(), VERTICES));
    // A comment of a file may be in any encoding.
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    let from_text = accepted(vertex_data::vertex_marks(text, VERTICES));
    if text.contains('#') {
        assert_eq!(from_text, None, "a comment stands in files only");
    } else if !text.contains('\0') {
        // Zero bytes cannot be given on a command line.
        assert_eq!(from_text, from_file);
    }
    let Some(marks) = from_file else { return };
    let chosen: Vec<String> = (0..VERTICES).filter(|&v| marks[v]).map(|v| v.to_string()).collect();
    assert_eq!(vertex_data::vertex_marks(&chosen.join(","), VERTICES).unwrap(), marks);
}

fn normals(bytes: &[u8]) {
    let read = |bytes: &[u8]| vertex_data::normals(file(bytes, ".txt").path(), VERTICES);
    rows_read_back(accepted(read(bytes)), |n| format!("{:?} {:?} {:?}", n.x, n.y, n.z), |text| read(text.as_bytes()));
}

fn numbers(bytes: &[u8]) {
    // Vertices without a number get one that no file holds.
    let read = |bytes: &[u8]| {
        let file = file(bytes, ".txt");
        let numbers = vertex_data::numbers(file.path().to_str().unwrap(), VERTICES, f64::NEG_INFINITY)?;
        Ok(numbers.into_iter().map(|x| (x != f64::NEG_INFINITY).then_some(x)).collect())
    };
    rows_read_back(accepted(read(bytes)), |x| format!("{x:?}"), |text| read(text.as_bytes()));
}

/// Lines `vertex …` of what was read give the same again; equal by their text, so that NaN is.
fn rows_read_back<T: Debug>(
    rows: Option<Vec<Option<T>>>,
    row: impl Fn(&T) -> String,
    read: impl Fn(&str) -> Result<Vec<Option<T>>>,
) {
    let Some(rows) = rows else { return };
    assert_eq!(rows.len(), VERTICES);
    let lines = rows.iter().enumerate().filter_map(|(v, value)| Some(format!("{v} {}\n", row(value.as_ref()?))));
    let back = read(&lines.collect::<String>()).unwrap();
    assert_eq!(format!("{back:?}"), format!("{rows:?}"));
}
