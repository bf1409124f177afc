//! PLY (Stanford polygon file format): text and binary of either byte order.

use std::io::{self, Write};
use std::path::Path;

use glam::DVec3;

use super::Mesh;
use super::builder::Builder;
use super::io::{Lines, Loaded, WriteOptions, check_normals, write_text_rows};
use crate::text::Scanner;
use crate::text::parts::{Output, PART, read_rows};
use crate::{Result, parallel};

mod header;
mod values;

use header::{COORDINATES, Element, Format, Header, Keep, Kind};
use values::{Binary, ByteOrder, Text, Values};

/// Reads the bytes of a PLY file; `path` is for messages.
///
/// Positions are the properties `x y z` of the element `vertex`, faces the list `vertex_indices` or `vertex_index`
/// of the element `face`, in any numeric types; `nx ny nz` are kept as normals. Other properties and elements are
/// passed over and named in a remark. In text files numbers may be spread over lines; but where the first row of an
/// element has a line of its own, every row has.
///
/// # Errors
/// [`Error::Parse`](crate::Error::Parse) with the line, or in binary data with the byte and the element: an unknown
/// header statement or type, missing positions or faces, triangle strips, an index that is negative or no 32-bit
/// number, a face of fewer than three corners, a file that ends early, data after the last element.
///
/// ```
/// let text = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
///             element face 1\nproperty list uchar int vertex_indices\nend_header\n\
///             0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
/// let loaded = limitlab::mesh::ply::read_bytes(text.as_bytes(), "a.ply".as_ref())?;
/// assert_eq!(loaded.mesh.faces.face(0), [0, 1, 2]);
/// assert_eq!(loaded.lines.unwrap().faces, [13]);
/// # Ok::<(), limitlab::Error>(())
/// ```
pub fn read_bytes(bytes: &[u8], path: &Path) -> Result<Loaded> {
    read_in_parts(bytes, path, PART)
}

/// As [`read_bytes`], in parts of about `size` bytes.
pub(super) fn read_in_parts(bytes: &[u8], path: &Path, size: usize) -> Result<Loaded> {
    let mut scanner = Scanner::new(bytes, path);
    let Header { format, elements } = Header::read(&mut scanner, path)?;
    let order = match format {
        Format::Ascii => {
            let values = Text { scanner };
            return read_elements(&elements, values, Some(Lines::default()), path, size);
        }
        Format::BinaryLittleEndian => ByteOrder::Little,
        Format::BinaryBigEndian => ByteOrder::Big,
    };
    let values = Binary { path, bytes, at: scanner.offset(), order };
    read_elements(&elements, values, None, path, size)
}

/// Refuses the first bytes of a file, whole lines, if they are no PLY.
pub(super) fn check_head(head: &[u8], path: &Path) -> Result<()> {
    let mut s = Scanner::of_head(head, path);
    let read = Header::read(&mut s, path);
    // What a line beyond may hold is not known.
    if s.at_end() { Ok(()) } else { read.map(|_| ()) }
}

fn read_elements<V: Values>(
    elements: &[Element],
    mut values: V,
    lines: Option<Lines>,
    path: &Path,
    size: usize,
) -> Result<Loaded> {
    let mut read = Read { builder: Builder::new(lines), normals: Vec::new() };
    for element in elements {
        // Each row takes room in the file, so that the end of the file ends an absurd count.
        if !element.properties.is_empty() && element.count > 0 {
            let least: usize =
                element.properties.iter().map(|p| values.least_bytes(p.length.unwrap_or(p.scalar))).sum();
            let rows_at_most = values.bytes_left() / least;
            match element.kind {
                Kind::Vertex => read.builder.reserve_vertices(element.count, rows_at_most),
                Kind::Face => read.builder.reserve_faces(element.count, rows_at_most),
                Kind::Other => {}
            }
            let parts = |values: &V, wanted: u64| values.parts(element, wanted, size);
            values.begin_rows();
            read_rows(&mut values, element.count, &mut read, &parts, &V::follow, &|values, row, read| {
                read.row(values, element, row)
            })?;
        }
    }
    if !values.at_end() {
        let place = values.place();
        let what = "data after the last element: correct the counts in the header";
        return Err(values.error(place, what.into()));
    }
    let has_normals = elements.iter().flat_map(|e| &e.properties).any(|p| matches!(p.keep, Keep::Coordinate(3..)));
    let remarks = Vec::from_iter(not_kept(elements));
    Ok(read.builder.finish(path, has_normals.then_some(read.normals), remarks))
}

/// The rows of a file or of a part of it.
struct Read {
    builder: Builder,
    normals: Vec<DVec3>,
}

impl Read {
    fn row<V: Values>(&mut self, values: &mut V, element: &Element, row: u64) -> Result<()> {
        let (name, count) = (&element.name, element.count);
        let place = values.place();
        let mut coordinates = [0.0; 6];
        let mut has_normal = false;
        for property in &element.properties {
            let scalar = property.scalar;
            let wanted = |what: &str| format!("{what} {} of {name} {row} of {count}", property.name);
            let items = match property.length {
                None => 1,
                Some(length) => {
                    values.unsigned(length).ok_or_else(|| values.unexpected(wanted("the length of the list")))?
                }
            };
            match property.keep {
                Keep::Coordinate(k) => {
                    coordinates[k] = values.number(scalar).ok_or_else(|| values.unexpected(wanted("the number")))?;
                    has_normal |= k >= 3;
                }
                Keep::Corners => {
                    for _ in 0..items {
                        let corner = values
                            .unsigned(scalar)
                            .ok_or_else(|| values.unexpected(wanted("an index (0, 1, 2, …) in")))?;
                        self.builder.corner(corner);
                    }
                }
                Keep::No => values.skip(scalar, items).ok_or_else(|| values.unexpected(wanted("a value of")))?,
            }
        }
        let [x, y, z, nx, ny, nz] = coordinates;
        match element.kind {
            Kind::Vertex => self.builder.vertex(DVec3::new(x, y, z), place),
            Kind::Face => self.builder.end_face(place),
            Kind::Other => Ok(()),
        }
        .map_err(|what| values.error(place, what))?;
        values.end_row(format_args!("{name} {row} of {count}"))?;
        if has_normal {
            self.normals.push(DVec3::new(nx, ny, nz));
        }
        Ok(())
    }
}

impl Output for Read {
    fn empty(&self) -> Self {
        Read { builder: self.builder.empty(), normals: Vec::new() }
    }

    fn clear(&mut self) {
        self.builder.begin_part([0; 3]);
        self.normals.clear();
    }

    fn append(&mut self, parts: &[&Self]) -> bool {
        let builders: Vec<&Builder> = parts.iter().map(|part| &part.builder).collect();
        let fits = self.builder.append(&builders, &vec![0; parts.len()], 1.0);
        if fits {
            let normals: Vec<&[DVec3]> = parts.iter().map(|part| &part.normals[..]).collect();
            parallel::append_parts(&mut self.normals, &normals, |_, n| n);
        }
        fits
    }
}

/// The remark on what the mesh does not keep, if there is such.
fn not_kept(elements: &[Element]) -> Option<String> {
    let mut parts = Vec::new();
    for element in elements.iter().filter(|e| e.count > 0) {
        if element.kind == Kind::Other {
            parts.push(format!("element {} ({})", element.name, element.count));
            continue;
        }
        let dropped: Vec<&str> =
            element.properties.iter().filter(|p| p.keep == Keep::No).map(|p| p.name.as_str()).collect();
        if !dropped.is_empty() {
            parts.push(format!("{} properties {}", element.name, first_of(&dropped, " ")));
        }
    }
    (!parts.is_empty()).then(|| format!("not kept: {}", first_of(&parts, ", ")))
}

/// Joins names, as many as a line may hold.
fn first_of<T: AsRef<str>>(names: &[T], separator: &str) -> String {
    const SHOWN: usize = 20;
    let shown: Vec<&str> = names.iter().take(SHOWN).map(AsRef::as_ref).collect();
    let more = names.len() - shown.len();
    let more = if more > 0 { format!("{separator}and {more} more") } else { String::new() };
    shown.join(separator) + &more
}

/// Writes `mesh` as PLY, binary little-endian with doubles, with `normals` (one a vertex) as `nx ny nz` if given.
///
/// # Panics
/// If there are not as many normals as vertices.
pub fn write_to(out: &mut dyn Write, mesh: &Mesh, normals: Option<&[DVec3]>) -> io::Result<()> {
    write_control_to(out, mesh, &WriteOptions { normals, ..WriteOptions::default() })
}

/// As [`write_to`], or [`write_text_to`] where text is asked for, with comments in the header.
///
/// # Panics
/// If there are not as many normals as vertices.
pub fn write_control_to(out: &mut dyn Write, mesh: &Mesh, options: &WriteOptions) -> io::Result<()> {
    let short = write_header(out, mesh, &coordinates(mesh, options.normals), options)?;
    if options.ascii {
        return write_text_rows(out, mesh, options.normals);
    }
    write_binary_rows(out, mesh, short, |v, row| {
        if let Some(normals) = options.normals {
            push_point(row, normals[v]);
        }
    })
}

/// Numbers at the vertices of a mesh under a name, which is a word.
#[derive(Clone, Debug, PartialEq)]
pub struct Scalars {
    /// The property of the file.
    pub name: String,
    /// One a vertex.
    pub values: Vec<f64>,
}

/// Writes `mesh` as PLY, binary little-endian, with a colour and any number of scalars at each vertex: properties
/// `red green blue` (bytes), which every viewer shows, and doubles under their names; comments, lines without line ends, in
/// the header.
///
/// # Panics
/// If there is not one colour and one number of each name a vertex.
///
/// ```
/// use limitlab::mesh::{builtin, ply::{Scalars, read_bytes, write_painted_to}};
///
/// let cube = builtin::builtin("cube")?;
/// let height = Scalars { name: "height".into(), values: cube.positions.iter().map(|p| p.z).collect() };
/// let mut bytes = Vec::new();
/// write_painted_to(&mut bytes, &cube, &[[255, 0, 0]; 8], &[height], &[]).unwrap();
/// let read = read_bytes(&bytes, "cube.ply".as_ref())?;
/// assert_eq!(read.mesh, cube);
/// assert_eq!(read.remarks, ["not kept: vertex properties red green blue height"]);
/// # Ok::<(), limitlab::Error>(())
/// ```
pub fn write_painted_to(
    out: &mut dyn Write,
    mesh: &Mesh,
    colours: &[[u8; 3]],
    scalars: &[Scalars],
    comments: &[String],
) -> io::Result<()> {
    let is_whole = colours.len() == mesh.len() && scalars.iter().all(|s| s.values.len() == mesh.len());
    assert!(is_whole, "one colour and one number of each name a vertex");
    let mut properties = coordinates(mesh, None);
    properties.extend(["red", "green", "blue"].map(|name| ("uchar", name)));
    properties.extend(scalars.iter().map(|s| ("double", s.name.as_str())));
    let options = WriteOptions { comments, ..WriteOptions::default() };
    let short = write_header(out, mesh, &properties, &options)?;
    write_binary_rows(out, mesh, short, |v, row| {
        row.extend_from_slice(&colours[v]);
        scalars.iter().for_each(|s| row.extend_from_slice(&s.values[v].to_le_bytes()));
    })
}

fn push_point(row: &mut Vec<u8>, p: DVec3) {
    for coordinate in p.to_array() {
        row.extend_from_slice(&coordinate.to_le_bytes());
    }
}

/// Positions, each with what `extend` adds to the row of its vertex, then faces.
fn write_binary_rows(
    out: &mut dyn Write,
    mesh: &Mesh,
    short: bool,
    extend: impl Fn(usize, &mut Vec<u8>),
) -> io::Result<()> {
    let mut row = Vec::new();
    for (v, &position) in mesh.positions.iter().enumerate() {
        row.clear();
        push_point(&mut row, position);
        extend(v, &mut row);
        out.write_all(&row)?;
    }
    for face in mesh.faces.iter() {
        row.clear();
        let size = (face.len() as u32).to_le_bytes();
        row.extend_from_slice(if short { &size[..1] } else { &size });
        for &v in face {
            row.extend_from_slice(&v.to_le_bytes());
        }
        out.write_all(&row)?;
    }
    Ok(())
}

/// As [`write_to`], as text, a vertex or a face a line; all doubles read back equal.
///
/// # Panics
/// If there are not as many normals as vertices.
pub fn write_text_to(out: &mut dyn Write, mesh: &Mesh, normals: Option<&[DVec3]>) -> io::Result<()> {
    write_control_to(out, mesh, &WriteOptions { normals, ascii: true, ..WriteOptions::default() })
}

/// The properties of positions and normals: type and name.
fn coordinates(mesh: &Mesh, normals: Option<&[DVec3]>) -> Vec<(&'static str, &'static str)> {
    check_normals(mesh, normals);
    let count = if normals.is_some() { 6 } else { 3 };
    COORDINATES[..count].iter().map(|&name| ("double", name)).collect()
}

/// Writes the header. Whether a byte holds the size of every face.
fn write_header(
    out: &mut dyn Write,
    mesh: &Mesh,
    properties: &[(&str, &str)],
    options: &WriteOptions,
) -> io::Result<bool> {
    let faces = &mesh.faces;
    // The usual types unless something does not fit them.
    let short = faces.iter().all(|f| f.len() <= usize::from(u8::MAX));
    let length = if short { "uchar" } else { "uint" };
    let fits_int = faces.corners().iter().all(|&v| i32::try_from(v).is_ok());
    let index = if fits_int { "int" } else { "uint" };
    let format = if options.ascii { "ascii" } else { "binary_little_endian" };
    writeln!(out, "ply\nformat {format} 1.0")?;
    options.write_comments(out, "comment")?;
    writeln!(out, "element vertex {}", mesh.len())?;
    for (kind, name) in properties {
        writeln!(out, "property {kind} {name}")?;
    }
    write!(out, "element face {}\nproperty list {length} {index} vertex_indices\nend_header\n", faces.len())?;
    Ok(short)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(bytes: &[u8]) -> Result<Loaded> {
        read_bytes(bytes, Path::new("a.ply"))
    }

    fn refusal(bytes: &[u8]) -> String {
        let text = parse(bytes).unwrap_err().to_string();
        assert!(!text.contains('\n'), "{text}");
        text
    }

    fn triangle() -> Mesh {
        let faces = crate::mesh::Faces::from_lists([[0, 1, 2]]);
        Mesh::new(vec![DVec3::ZERO, DVec3::X, DVec3::new(0.0, 2.5, 0.0)], faces)
    }

    const XYZ: &str = "property float x\nproperty float y\nproperty float z\n";
    const FACE: &str = "element face 1\nproperty list uchar int vertex_indices\nend_header\n";

    fn ascii(vertex_properties: &str, rest: &str) -> String {
        format!("ply\nformat ascii 1.0\nelement vertex 3\n{vertex_properties}{rest}")
    }

    /// The triangle with every scalar type in use, lists of other things around, and the face before the vertices.
    /// `put` gets each value and the number of bytes and whether it is a float, to write it in its own way.
    fn motley(format: &str, mut put: impl FnMut(&mut Vec<u8>, f64, usize, bool)) -> Vec<u8> {
        let header = format!(
            "ply\r\nformat {format} 1.0\r\ncomment caf\u{e9} # x\r\nobj_info y\r\n\r\n\
             element face 1\r\nproperty char flag\r\nproperty list ushort short uv\r\n\
             property list int uint vertex_index\r\nproperty list uchar float32 w\r\n\
             element edge 2\r\nproperty uint16 a\r\nproperty uint8 b\r\n\
             element nothing 1000000000000\r\n\
             element vertex 3\r\nproperty int8 x\r\nproperty list uint32 float64 t\r\n\
             property double y\r\nproperty uint8 red\r\nproperty int16 z\r\n\
             property float nx\r\nproperty int32 ny\r\nproperty float nz\r\nend_header\r\n"
        );
        let mut bytes = header.into_bytes();
        let mut row = |row: &[(f64, usize, bool)]| {
            for &(value, size, float) in row {
                put(&mut bytes, value, size, float);
            }
        };
        let int = |value: f64, size| (value, size, false);
        let float = |value: f64, size| (value, size, true);
        row(&[int(-1.0, 1), int(2.0, 2), int(-300.0, 2), int(7.0, 2)]);
        row(&[int(3.0, 4), int(0.0, 4), int(1.0, 4), int(2.0, 4)]);
        row(&[int(1.0, 1), float(0.5, 4)]);
        row(&[int(65535.0, 2), int(255.0, 1), int(1.0, 2), int(2.0, 1)]);
        for (v, p) in triangle().positions.iter().enumerate() {
            row(&[int(p.x, 1), int(v as f64, 4)]);
            for _ in 0..v {
                row(&[float(1e-300, 8)]);
            }
            row(&[float(p.y, 8), int(9.0, 1), int(p.z, 2)]);
            row(&[float(0.25, 4), int(-70000.0, 4), float(0.0, 4)]);
        }
        bytes
    }

    #[test]
    fn all_types_lists_and_byte_orders() {
        let binary = |bytes: &mut Vec<u8>, value: f64, size: usize, float: bool, big: bool| {
            let mut raw = match (size, float) {
                (4, true) => (value as f32).to_le_bytes().to_vec(),
                (_, true) => value.to_le_bytes().to_vec(),
                (_, false) => (value as i64).to_le_bytes()[..size].to_vec(),
            };
            if big {
                raw.reverse();
            }
            bytes.extend(raw);
        };
        let cases = [
            motley("ascii", |b, x, _, _| b.extend(format!("{x}\r\n").bytes())),
            motley("binary_little_endian", |b, x, n, f| binary(b, x, n, f, false)),
            motley("binary_big_endian", |b, x, n, f| binary(b, x, n, f, true)),
        ];
        for (bytes, is_text) in cases.iter().zip([true, false, false]) {
            let loaded = parse(bytes).unwrap();
            assert_eq!(loaded.mesh, triangle());
            let normal = DVec3::new(0.25, -70000.0, 0.0);
            assert_eq!(loaded.normals, Some(vec![normal; 3]));
            assert_eq!(
                loaded.remarks,
                ["not kept: face properties flag uv w, element edge (2), \
                  element nothing (1000000000000), vertex properties t red"]
            );
            assert_eq!(loaded.lines.is_some(), is_text);
            if let Some(lines) = loaded.lines {
                assert_eq!(lines.faces, [25]);
                assert_eq!(lines.vertices, [39, 47, 56]);
            }
        }
    }

    #[test]
    fn colours_and_scalars_stand_after_the_positions() {
        let scalars = [("a", [0.5, -1e-300, 3.0]), ("b", [1.0, 2.0, f64::MAX])];
        let scalars = scalars.map(|(name, values)| Scalars { name: name.into(), values: values.into() });
        let colours = [[1, 2, 3], [4, 5, 6], [7, 8, 255]];
        let mut bytes = Vec::new();
        write_painted_to(&mut bytes, &triangle(), &colours, &scalars, &[]).unwrap();
        let mut expected = b"ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty double x\n\
            property double y\nproperty double z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n\
            property double a\nproperty double b\nelement face 1\n\
            property list uchar int vertex_indices\nend_header\n"
            .to_vec();
        for (v, p) in triangle().positions.iter().enumerate() {
            expected.extend(p.to_array().map(f64::to_le_bytes).concat());
            expected.extend(colours[v]);
            expected.extend(scalars.iter().flat_map(|s| s.values[v].to_le_bytes()));
        }
        expected.extend([3, 0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0]);
        assert!(bytes == expected);
        assert_eq!(parse(&bytes).unwrap().mesh, triangle());
    }

    #[test]
    fn a_header_of_old_line_ends_before_data_that_look_like_one() {
        let mut bytes = Vec::new();
        write_to(&mut bytes, &triangle(), None).unwrap();
        let end = b"end_header\n";
        let start = bytes.windows(end.len()).position(|w| w == end).unwrap() + end.len();
        let mut header = String::from_utf8(bytes[..start].to_vec()).unwrap();
        header = header.replace('\n', "\r");
        let mut body = bytes[start..].to_vec();
        body[0] = b'\n';
        let loaded = parse(&[header.as_bytes(), &body].concat()).unwrap();
        let x = loaded.mesh.positions[0].x;
        assert_eq!(x.to_bits(), u64::from(b'\n'));
    }

    #[test]
    fn faces_and_indices_beyond_the_usual_types_are_written_in_wider_ones() {
        let face: Vec<u32> = (0..300).chain([u32::MAX]).collect();
        let mesh = Mesh::new(Vec::new(), crate::mesh::Faces::from_lists([face]));
        let mut bytes = Vec::new();
        write_to(&mut bytes, &mesh, None).unwrap();
        assert_eq!(parse(&bytes).unwrap().mesh, mesh);
    }

    #[test]
    fn headers_of_all_line_ends_stand_before_the_same_bytes() {
        let mut bytes = Vec::new();
        write_to(&mut bytes, &triangle(), None).unwrap();
        let end = b"end_header\n";
        let start = bytes.windows(end.len()).position(|w| w == end).unwrap() + end.len();
        let header = String::from_utf8(bytes[..start].to_vec()).unwrap();
        for line_end in ["\n", "\r\n", "\r", "\n\r", " \n", "\t\r\n"] {
            // A first byte that could be taken for a line end too.
            for first in [b'\n', b'\r', 0] {
                let mut body = bytes[start..].to_vec();
                body[0] = first;
                let text = header.replace('\n', line_end);
                let loaded = parse(&[text.as_bytes(), &body].concat()).unwrap();
                assert_eq!(loaded.mesh.positions[0].x.to_bits(), u64::from(first), "{line_end:?}");
            }
        }
    }

    #[test]
    fn a_header_of_many_elements_takes_linear_time() {
        use std::fmt::Write;
        let mut text = ascii(XYZ, "");
        for n in 0..300_000 {
            write!(text, "element e{n} 1\nproperty int p\n").unwrap();
        }
        write!(text, "{FACE}0 0 0\n1 0 0\n0 1 0\n{}3 0 1 2\n", "5\n".repeat(300_000)).unwrap();
        let start = std::time::Instant::now();
        let loaded = parse(text.as_bytes()).unwrap();
        assert!(start.elapsed().as_secs() < 20, "the square of the elements would take minutes");
        assert!(loaded.remarks[0].ends_with("element e19 (1), and 299980 more"), "{}", loaded.remarks[0]);
    }

    #[test]
    fn rows_that_are_too_long_or_too_short_are_named() {
        let header = ascii(XYZ, FACE);
        for (body, message) in [
            ("0 0 0\n1 0\n0 1 0\n3 0 1 2\n", "11: the line ends where the number z of vertex 1 of 3"),
            ("0 0\n1 0 0\n0 1 0\n3 0 1 2\n", "10: vertex 0 of 3 has fewer values on its line"),
            ("0 0 0\n1 0 0 9\n0 1 0\n3 0 1 2\n", "11: \"9\" is one value too many for vertex 1 of 3"),
            ("0 0 0\n1 0 0\n3 0 1 2\n", "12: \"2\" is one value too many for vertex 2 of 3"),
            ("0 0 0 9 9 9\n1 0 0 9 9 9\n0 1 0 9 9 9\n3 0 1 2\n", "11: face 0 of 1 has fewer values on its line"),
        ] {
            let found = refusal(format!("{header}{body}").as_bytes());
            assert!(found.starts_with(&format!("a.ply, line {message}")), "{found}");
        }
        let found = refusal(format!("{header}0 0 0 9 9 9\n1 0 0 9 9 9\n.5 1 0 9 9 9\n3 0 1 2\n").as_bytes());
        assert!(found.contains("(line 10 goes on after the first row"), "{found}");
    }

    #[test]
    fn incomplete_normals_are_named() {
        let text = ascii(
            &format!("{XYZ}property float nx\nproperty float ny\n"),
            &format!("{FACE}0 0 0 1 1 1 0 0 1 1 0 1 0 1 1\n3 0 1 2\n"),
        );
        let loaded = parse(text.as_bytes()).unwrap();
        assert_eq!(loaded.normals, None);
        assert_eq!(loaded.remarks, ["not kept: vertex properties nx ny"]);
    }

    #[test]
    fn errors_in_the_header_name_the_line() {
        let plain = |rest: &str| ascii(XYZ, rest);
        for (text, message) in [
            (String::new(), "1: not a PLY file"),
            ("plywood\n".into(), "1: not a PLY file"),
            ("ply\nformat ascii 2.0\n".into(), "2: \"2.0\" is not the only version"),
            ("ply\nformat text 1.0\n".into(), "2: \"text\" is not a PLY format"),
            ("ply\nformat ascii 1.0 x\n".into(), "2: \"x\" is not the end of the line"),
            ("ply\nelement vertex x\n".into(), "2: \"x\" is not the number of elements vertex"),
            ("ply\nproperty float x\n".into(), "2: a property before the first element"),
            ("ply\nend_header\n".into(), "2: the header ends without a format"),
            ("ply\nblob\n".into(), "2: \"blob\" is not a PLY header statement"),
            ("ply\nformat ascii 1.0\n".into(), "2: the file ends where a PLY header statement"),
            (ascii("property long x\n", ""), "4: \"long\" is not a PLY type"),
            (ascii("property int\n", ""), "4: the line ends where the name of a property"),
            (ascii("property float x\nproperty int x\n", ""), "5: a second property \"x\""),
            (ascii("property list float int x\n", ""), "4: the length of a list must be a whole number"),
            (plain("element vertex 1\n"), "7: a second element vertex"),
            (plain("end_header\n"), "7: the header announces no element face: a point cloud"),
            (plain("element tristrips 1\n"), "7: faces as triangle strips are not read: convert"),
            (plain("element face 1\nend_header\n"), "8: the element face has no property list"),
            (
                plain("element face 1\nproperty list int float vertex_index\n"),
                "8: the vertices of a face must be whole numbers",
            ),
            (ascii("property float x\nproperty list int int y\n", FACE), "8: the element vertex has no property y"),
            ("ply\nformat ascii 1.0\nelement face 0\nend_header\n".into(), "4: the header announces no element vertex"),
        ] {
            let found = refusal(text.as_bytes());
            assert!(found.starts_with(&format!("a.ply, line {message}")), "{text}: {found}");
        }
    }

    #[test]
    fn errors_in_text_name_the_line() {
        for (body, message) in [
            ("0 0 0\n1 0 0\n0 one 0\n", "12: \"one\" is not the number y of vertex 2 of 3"),
            ("0 0 0\n1 0 0\n", "11: the file ends where the number x of vertex 2 of 3"),
            ("0 0 0 1 0 0 0 1 0\n3 0 1 -1\n", "11: \"-1\" is not an index (0, 1, 2, …) in vertex_indices"),
            ("0 0 0 1 0 0 0 1 0\n3 0 1 4294967296\n", "11: \"4294967296\" is not an index"),
            ("0 0 0 1 0 0 0 1 0\n2 0 1\n", "11: face 0 has 2 corners"),
            ("0 0 0 1 0 0 0 1 0\n1.5 0 1\n", "11: \"1.5\" is not the length of the list"),
            ("0 0 0 1 0 0 0 1 0\n3 0 1 2\n\n3 0 1 2\n", "13: data after the last element"),
            ("0 0 0 1 0 0 0 1 0\n1000000000000 0 1 2\n", "11: the file ends where an index"),
        ] {
            let found = refusal(ascii(XYZ, &format!("{FACE}{body}")).as_bytes());
            assert!(found.starts_with(&format!("a.ply, line {message}")), "{found}");
        }
    }

    #[test]
    fn errors_in_binary_data_name_the_byte_or_the_element() {
        let mut bytes = Vec::new();
        write_to(&mut bytes, &triangle(), None).unwrap();
        let face = bytes.len() - 13;
        let changed = |at: usize, value: u8| {
            let mut changed = bytes.clone();
            changed[at] = value;
            refusal(&changed)
        };
        let ends = |at: usize| refusal(&bytes[..at]);
        let what = "an index (0, 1, 2, …) in vertex_indices of face 0 of 1";
        assert_eq!(changed(face + 4, 0xFF), format!("a.ply: byte {}: the value is not {what}", face + 1));
        assert_eq!(changed(face, 200), format!("a.ply: the file ends where {what} should be: is it complete?"));
        let text = changed(face, 2);
        assert!(text.starts_with(&format!("a.ply: byte {face}: face 0 has 2 corners")), "{text}");
        assert_eq!(
            ends(face - 1),
            "a.ply: the file ends where the number z of vertex 2 of 3 should be: is it complete?"
        );
        assert_eq!(
            refusal(&[&bytes[..], b"\n x"].concat()),
            format!("a.ply: byte {}: data after the last element: correct the counts in the header", bytes.len())
        );
        parse(&[&bytes[..], b"\n"].concat()).unwrap();
    }

    #[test]
    fn absurd_counts_are_refused_at_the_end_of_the_data() {
        for format in ["ascii", "binary_big_endian"] {
            let header = |n: &str| format!("ply\nformat {format} 1.0\nelement vertex {n}\n{XYZ}{FACE}0 0 0\n");
            for count in ["1000000000000", "18446744073709551615"] {
                let found = refusal(header(count).as_bytes());
                assert!(found.contains("the file ends where the number"), "{found}");
            }
            let found = refusal(header("18446744073709551616").as_bytes());
            assert!(found.contains("is not the number of elements vertex"), "{found}");
        }
    }
}
