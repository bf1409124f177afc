//! USD as text (`.usda`): one mesh prim with its creases and corners, which Blender, Houdini and usdview keep.

mod scene;
#[cfg(test)]
mod tests;
mod tokens;

use std::io::{self, Write};
use std::path::Path;

use glam::DVec3;

use super::io::{Loaded, WriteOptions, check_normals};
use super::magic::other_kind;
use super::validate::Boundary;
use super::{Mesh, bounding_box};
use crate::text::parts::write_in_parts;
use crate::text::{push_nine_digits, push_number, push_unsigned};
use crate::{Error, Result};

/// How the text of such a file begins.
const HEADER: &[u8] = b"#usda";
const BINARY: &[u8] = b"PXR-USDC";
const ARCHIVE: &[u8] = b"PK";

/// Numbers of a line, where they are not one vertex or face each.
const PER_LINE: usize = 16;

/// What the head of a USD file says of all coordinates in it. What is `None` is not said, and USD's default holds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StageMetadata {
    /// `upAxis`: whether z is upward, not y as USD has it unless told.
    pub is_z_up: Option<bool>,
    /// `metersPerUnit`, positive.
    pub meters_per_unit: Option<f64>,
}

/// Reads the bytes of a `.usda` file; `path` is for messages.
///
/// The file has one mesh, a prim `def Mesh "name"`, at any depth; in `over`, `class` and variants none is looked for, and
/// references are not followed. Of it are read `points`, `faceVertexCounts`, `faceVertexIndices`, `normals` (one a vertex),
/// `subdivisionScheme`, `interpolateBoundary`, and as [tags](super::file_tags::FileTags) `creaseIndices`, `creaseLengths`,
/// `creaseSharpnesses` (one a crease, or one an edge), `cornerIndices` and `cornerSharpnesses`; of the head `upAxis` and
/// `metersPerUnit`. The rest of the scene is passed over as text; what of the mesh is not kept is remarked: transforms, so that the points are in the mesh's own
/// coordinates, primvars, normals of corners, holes, a left-handed orientation. O(bytes); nothing is allocated for a token.
///
/// # Errors
/// [`Error::Parse`] with the line: binary USD; no mesh, or a second one; brackets and strings without end; arrays that
/// are given twice, over time, or not of their form; face sizes, crease lengths and sharpnesses that do not add up; a
/// crease of fewer than two vertices, a vertex of a crease or a corner that there is not; a negative sharpness.
///
/// ```
/// let text = r#"#usda 1.0
/// def Mesh "triangle"
/// {
///     point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
///     int[] faceVertexCounts = [3]
///     int[] faceVertexIndices = [0, 1, 2]
///     int[] cornerIndices = [2]
///     float[] cornerSharpnesses = [10]
/// }
/// "#;
/// let loaded = limitlab::mesh::usd::read_bytes(text.as_bytes(), "a.usda".as_ref())?;
/// assert_eq!(loaded.mesh.faces.face(0), [0, 1, 2]);
/// assert_eq!((loaded.tags.corners[0].vertex, loaded.tags.corners[0].line), (2, 7));
/// # Ok::<(), limitlab::Error>(())
/// ```
pub fn read_bytes(bytes: &[u8], path: &Path) -> Result<Loaded> {
    check_head(bytes, path)?;
    scene::read(bytes, path)
}

/// Refuses the first bytes of a file if they are not those of USD as text.
pub(super) fn check_head(head: &[u8], path: &Path) -> Result<()> {
    let text = head.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(head);
    if text.starts_with(HEADER) {
        return Ok(());
    }
    let what = if head.starts_with(BINARY) {
        "binary USD is not read: save it as text, .usda".into()
    } else if head.starts_with(ARCHIVE) {
        "an archive, such as .usdz, is not read: unpack it, and save the scene as .usda".into()
    } else if let Some(what) = other_kind(head) {
        format!("not a USD file: {what}")
    } else {
        return Err(Error::parse(
            path,
            Some(1),
            "the first line is not \"#usda 1.0\": the file is no USD, or not as text",
        ));
    };
    Err(Error::parse(path, None, what))
}

/// Writes `mesh` as a mesh prim that is its faces, with `normals` (one a vertex) if given.
///
/// # Panics
/// If there are not as many normals as vertices.
pub fn write_to(out: &mut dyn Write, mesh: &Mesh, normals: Option<&[DVec3]>) -> io::Result<()> {
    write_control_to(out, mesh, &WriteOptions { normals, ..WriteOptions::default() })
}

/// Writes `mesh` as a mesh prim that is refined by the subdivision of `options`, with its sharp edges (a crease each), sharp vertices and
/// the rule of its boundary; a boundary that is treated as interior is USD's `none`. The head has what they say of the stage.
///
/// USD has points in single precision (`point3f`), and nine significant digits are written, which hold it: read here, a
/// coordinate is off by 5·10⁻⁹ of itself at most; read elsewhere, by 6·10⁻⁸, and beyond 3.4·10³⁸ it is infinite.
///
/// # Panics
/// If there are not as many normals as vertices.
pub fn write_control_to(out: &mut dyn Write, mesh: &Mesh, options: &WriteOptions) -> io::Result<()> {
    let &WriteOptions { normals, subdivision, tags, .. } = options;
    check_normals(mesh, normals);
    out.write_all(b"#usda 1.0\n")?;
    options.write_comments(out, "#")?;
    out.write_all(b"(\n    defaultPrim = \"mesh\"\n")?;
    if let Some(meters) = options.stage.meters_per_unit {
        writeln!(out, "    metersPerUnit = {meters}")?;
    }
    if let Some(is_z_up) = options.stage.is_z_up {
        writeln!(out, "    upAxis = \"{}\"", if is_z_up { 'Z' } else { 'Y' })?;
    }
    out.write_all(b")\n\ndef Mesh \"mesh\"\n{\n")?;
    writeln!(out, "    uniform token subdivisionScheme = \"{subdivision}\"")?;
    if let Some(rule) = tags.and_then(|tags| boundary_token(tags.boundary)) {
        writeln!(out, "    uniform token interpolateBoundary = \"{rule}\"")?;
    }
    if let Some((lo, hi)) = bounding_box(&mesh.positions) {
        write_points(out, "float3[] extent", &[lo, hi])?;
        out.write_all(b"\n")?;
    }
    let faces = &mesh.faces;
    write_whole(out, "faceVertexCounts", faces.len(), |f| faces.range(f).len() as u32)?;
    write_list(out, "int[] faceVertexIndices", faces.len(), 1, |text, f| {
        for (k, &v) in faces.face(f).iter().enumerate() {
            if k > 0 {
                text.extend_from_slice(b", ");
            }
            push_unsigned(text, v.into());
        }
    })?;
    out.write_all(b"\n")?;
    write_points(out, "point3f[] points", &mesh.positions)?;
    out.write_all(b"\n")?;
    if let Some(normals) = normals {
        write_points(out, "normal3f[] normals", normals)?;
        out.write_all(b" (\n        interpolation = \"vertex\"\n    )\n")?;
    }
    let (creases, corners) = tags.map_or((&[][..], &[][..]), |tags| (&tags.creases, &tags.corners));
    if !creases.is_empty() {
        write_whole(out, "creaseIndices", 2 * creases.len(), |k| creases[k / 2].0[k % 2])?;
        write_whole(out, "creaseLengths", creases.len(), |_| 2)?;
        write_numbers(out, "creaseSharpnesses", creases.len(), |k| creases[k].1)?;
    }
    if !corners.is_empty() {
        write_whole(out, "cornerIndices", corners.len(), |k| corners[k].0)?;
        write_numbers(out, "cornerSharpnesses", corners.len(), |k| corners[k].1)?;
    }
    out.write_all(b"}\n")
}

/// USD's name of a rule of the boundary; `None` where none is to be said.
fn boundary_token(boundary: Boundary) -> Option<&'static str> {
    match boundary {
        Boundary::EdgeAndCorner => Some("edgeAndCorner"),
        Boundary::EdgeOnly => Some("edgeOnly"),
        Boundary::AsInterior => Some("none"),
        Boundary::Refuse => None,
    }
}

fn write_whole(out: &mut dyn Write, name: &str, count: usize, number: impl Fn(usize) -> u32 + Sync) -> io::Result<()> {
    write_list(out, &format!("int[] {name}"), count, PER_LINE, |text, k| {
        push_unsigned(text, number(k).into());
    })?;
    out.write_all(b"\n")
}

fn write_numbers(
    out: &mut dyn Write,
    name: &str,
    count: usize,
    number: impl Fn(usize) -> f64 + Sync,
) -> io::Result<()> {
    write_list(out, &format!("float[] {name}"), count, PER_LINE, |text, k| push_number(text, number(k)))?;
    out.write_all(b"\n")
}

fn write_points(out: &mut dyn Write, name: &str, points: &[DVec3]) -> io::Result<()> {
    write_list(out, name, points.len(), 1, |text, v| {
        let mut before = b'(';
        for coordinate in points[v].to_array() {
            if before == b',' {
                text.extend_from_slice(b", ");
            } else {
                text.push(before);
            }
            push_nine_digits(text, coordinate);
            before = b',';
        }
        text.push(b')');
    })
}

/// Writes `name = [ … ]` without the end of the line, so many items a line, each by `push`.
fn write_list(
    out: &mut dyn Write,
    name: &str,
    count: usize,
    per_line: usize,
    push: impl Fn(&mut Vec<u8>, usize) + Sync,
) -> io::Result<()> {
    write!(out, "    {name} = [")?;
    write_in_parts(out, count, &|range, text| {
        for k in range {
            if k > 0 {
                text.push(b',');
            }
            text.extend_from_slice(if k % per_line == 0 { b"\n        " } else { b" " });
            push(text, k);
        }
    })?;
    out.write_all(if count > 0 { b"\n    ]" } else { b"]" })
}
