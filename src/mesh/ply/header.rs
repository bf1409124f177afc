//! The header of a PLY file: which elements follow, with which properties, and which of them a mesh keeps.

use std::collections::HashSet;
use std::path::Path;

use super::super::magic::other_kind;
use crate::text::{Scanner, quoted};
use crate::{Error, Result};

/// What the mesh keeps of a vertex: its position and its normal.
pub(super) const COORDINATES: [&str; 6] = ["x", "y", "z", "nx", "ny", "nz"];

pub(super) struct Header {
    pub format: Format,
    pub elements: Vec<Element>,
}

#[derive(Clone, Copy)]
pub(super) enum Format {
    Ascii,
    BinaryLittleEndian,
    BinaryBigEndian,
}

pub(super) struct Element {
    pub name: String,
    pub kind: Kind,
    pub count: u64,
    pub properties: Vec<Property>,
}

#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Vertex,
    Face,
    Other,
}

pub(super) struct Property {
    pub name: String,
    /// The type of a list's length; `None` for a single value.
    pub length: Option<Scalar>,
    pub scalar: Scalar,
    pub keep: Keep,
}

#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Keep {
    /// Among [`COORDINATES`].
    Coordinate(usize),
    Corners,
    No,
}

#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn of(word: &[u8]) -> Option<Self> {
        Some(match word {
            b"char" | b"int8" => Scalar::I8,
            b"uchar" | b"uint8" => Scalar::U8,
            b"short" | b"int16" => Scalar::I16,
            b"ushort" | b"uint16" => Scalar::U16,
            b"int" | b"int32" => Scalar::I32,
            b"uint" | b"uint32" => Scalar::U32,
            b"float" | b"float32" => Scalar::F32,
            b"double" | b"float64" => Scalar::F64,
            _ => return None,
        })
    }

    pub fn is_float(self) -> bool {
        matches!(self, Scalar::F32 | Scalar::F64)
    }

    pub fn bytes(self) -> usize {
        match self {
            Scalar::I8 | Scalar::U8 => 1,
            Scalar::I16 | Scalar::U16 => 2,
            Scalar::I32 | Scalar::U32 | Scalar::F32 => 4,
            Scalar::F64 => 8,
        }
    }
}

impl Header {
    pub fn read(s: &mut Scanner, path: &Path) -> Result<Self> {
        if s.peek_token() != b"ply" {
            let what = other_kind(s.rest()).unwrap_or("its first line is not \"ply\"");
            return Err(Error::parse(path, Some(1), format!("not a PLY file: {what}")));
        }
        s.token();
        s.skip_blanks();
        if !s.at_line_end() {
            return Err(s.unexpected("the end of the line"));
        }
        // Only then may `end_header` and a single '\r' be followed by data that start with the byte of '\n'.
        let lone_returns = matches!(s.rest(), [b'\r', next, ..] if *next != b'\n');
        s.skip_line();

        let mut format = None;
        let mut elements: Vec<Element> = Vec::new();
        let mut names = HashSet::new();
        loop {
            s.skip_blanks();
            match s.peek_token() {
                b"end_header" => break,
                b"comment" | b"obj_info" => s.skip_to_line_end(),
                b"format" => format = Some(read_format(s)?),
                b"element" => {
                    let element = read_element(s)?;
                    if !names.insert(element.name.clone()) {
                        return Err(s.error(format!("a second element {}", element.name)));
                    }
                    elements.push(element);
                }
                b"property" => match elements.last_mut() {
                    Some(element) => read_property(s, element)?,
                    None => return Err(s.error("a property before the first element")),
                },
                _ if s.at_line_end() && !s.at_end() => {}
                _ => return Err(s.unexpected("a PLY header statement")),
            }
            s.skip_blanks();
            if !s.at_line_end() {
                return Err(s.unexpected("the end of the line"));
            }
            s.skip_line();
        }
        s.token();
        s.skip_blanks();
        if !s.at_line_end() {
            return Err(s.unexpected("the end of the line"));
        }
        let format = format.ok_or_else(|| s.error("the header ends without a format statement"))?;
        check(&mut elements).map_err(|what| s.error(what))?;
        match s.rest() {
            [b'\r', ..] if lone_returns => s.advance(1),
            _ => s.skip_line_break(),
        }
        Ok(Header { format, elements })
    }
}

fn next_word<'a>(s: &mut Scanner<'a>) -> &'a [u8] {
    s.skip_blanks();
    s.token()
}

fn read_format(s: &mut Scanner) -> Result<Format> {
    next_word(s);
    s.skip_blanks();
    let format = match s.peek_token() {
        b"ascii" => Format::Ascii,
        b"binary_little_endian" => Format::BinaryLittleEndian,
        b"binary_big_endian" => Format::BinaryBigEndian,
        _ => {
            return Err(s.unexpected("a PLY format (ascii, binary_little_endian or binary_big_endian)"));
        }
    };
    s.token();
    s.skip_blanks();
    if s.peek_token() != b"1.0" {
        return Err(s.unexpected("the only version of PLY, 1.0"));
    }
    s.token();
    Ok(format)
}

fn read_element(s: &mut Scanner) -> Result<Element> {
    next_word(s);
    let name = next_word(s);
    let kind = match name {
        b"vertex" => Kind::Vertex,
        b"face" => Kind::Face,
        b"tristrips" => {
            return Err(
                s.error("faces as triangle strips are not read: convert the file to single faces (element face)")
            );
        }
        _ => Kind::Other,
    };
    s.skip_blanks();
    let name = String::from_utf8_lossy(name).escape_debug().to_string();
    let count = s.unsigned().ok_or_else(|| s.unexpected(format_args!("the number of elements {name}")))?;
    Ok(Element { name, kind, count, properties: Vec::new() })
}

fn read_property(s: &mut Scanner, element: &mut Element) -> Result<()> {
    next_word(s);
    s.skip_blanks();
    let is_list = s.peek_token() == b"list";
    if is_list {
        s.token();
    }
    let length = if is_list {
        let length = read_type(s)?;
        if length.is_float() {
            return Err(s.error("the length of a list must be a whole number"));
        }
        Some(length)
    } else {
        None
    };
    let scalar = read_type(s)?;
    s.skip_blanks();
    if s.at_line_end() {
        return Err(s.unexpected("the name of a property"));
    }
    let name = s.token();
    let keep = match (element.kind, name) {
        (Kind::Vertex, _) if length.is_none() => {
            COORDINATES.iter().position(|c| c.as_bytes() == name).map_or(Keep::No, Keep::Coordinate)
        }
        (Kind::Face, b"vertex_indices" | b"vertex_index") if is_list => {
            if scalar.is_float() {
                return Err(s.error("the vertices of a face must be whole numbers"));
            }
            Keep::Corners
        }
        _ => Keep::No,
    };
    if keep != Keep::No && element.properties.iter().any(|p| p.keep == keep) {
        return Err(s.error(format!("a second property {}", quoted(name))));
    }
    element.properties.push(Property {
        name: String::from_utf8_lossy(name).escape_debug().to_string(),
        length,
        scalar,
        keep,
    });
    Ok(())
}

fn read_type(s: &mut Scanner) -> Result<Scalar> {
    s.skip_blanks();
    let scalar =
        Scalar::of(s.peek_token()).ok_or_else(|| s.unexpected("a PLY type (char, uchar, short, …, float, double)"))?;
    s.token();
    Ok(scalar)
}

/// Checks that positions and faces are there; normals are kept only if complete.
fn check(elements: &mut [Element]) -> std::result::Result<(), String> {
    let keeps = |e: &Element, keep| e.properties.iter().any(|p| p.keep == keep);
    let vertex = elements
        .iter_mut()
        .find(|e| e.kind == Kind::Vertex)
        .ok_or("the header announces no element vertex: not a mesh")?;
    if let Some(missing) = (0..3).find(|&k| !keeps(vertex, Keep::Coordinate(k))) {
        return Err(format!("the element vertex has no property {}: a mesh needs x, y and z", COORDINATES[missing]));
    }
    if !(3..6).all(|k| keeps(vertex, Keep::Coordinate(k))) {
        for property in &mut vertex.properties {
            if matches!(property.keep, Keep::Coordinate(3..)) {
                property.keep = Keep::No;
            }
        }
    }
    let face = elements
        .iter()
        .find(|e| e.kind == Kind::Face)
        .ok_or("the header announces no element face: a point cloud is not a mesh")?;
    if !keeps(face, Keep::Corners) {
        return Err("the element face has no property list vertex_indices: a mesh needs it".into());
    }
    Ok(())
}
