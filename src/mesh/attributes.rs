//! Texture coordinates, shading normals, groups and materials of OBJ files, which go from a mesh to its control mesh.
//!
//! They are kept as the file has them, byte for byte: nothing here is computed with, and what is odd to us may be right to
//! the tool that reads the control mesh.

use std::fmt;
use std::io::{self, Write};

use super::topology::NONE;
use crate::parallel;

/// What an OBJ file says of the faces of a mesh and of their corners beyond its geometry and its
/// [sharpness](super::file_tags).
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Attributes {
    /// Texture coordinates, `vt`.
    pub texture: CornerLines,
    /// Normals, `vn`. They shade the faces of the file, and keep hard edges hard; they are not those of another surface
    /// through its points.
    pub normals: CornerLines,
    /// `o`, `g`, `s`, `usemtl`, `mtllib` and their kin in the order of the file, each with the number of the face before
    /// which it stands, which may be one past the last.
    pub statements: Vec<(u32, Box<[u8]>)>,
}

/// Lines that the corners of faces refer to.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct CornerLines {
    /// Those of the parts of the file before, while a part is read.
    before: usize,
    count: usize,
    /// One after the other, each with its end.
    lines: Vec<u8>,
    /// The line of every corner, from 0, [`NONE`] for none; empty if no corner has one.
    of_corner: Vec<u32>,
}

/// Statements about faces by what they are.
pub(super) const STATEMENTS: [(&str, &[&[u8]]); 3] = [
    ("group names (g, o)", &[b"g", b"o"]),
    ("smoothing groups (s)", &[b"s"]),
    ("material statements", &[b"usemtl", b"mtllib", b"usemap", b"maplib"]),
];

impl CornerLines {
    /// The number of lines.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether there are no lines.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// The line that a corner refers to, from 0.
    pub fn of_corner(&self, corner: usize) -> Option<u32> {
        self.of_corner.get(corner).copied().filter(|&line| line != NONE)
    }

    /// Forgets what was read, to read a part of a file that has so many lines before it.
    pub(super) fn begin_part(&mut self, before: usize) {
        self.before = before;
        self.count = 0;
        self.lines.clear();
        self.of_corner.clear();
    }

    /// Adds those of the part that follows; `corners` is the number of all corners before it.
    fn append(&mut self, next: &CornerLines, corners: usize) {
        self.count += next.count;
        parallel::append(&mut self.lines, &next.lines);
        if !next.of_corner.is_empty() {
            self.of_corner.resize(corners, NONE);
            parallel::append(&mut self.of_corner, &next.of_corner);
        }
    }

    /// Takes back the references of the corners from the `first` on.
    pub(super) fn forget_corners(&mut self, first: usize) {
        self.of_corner.truncate(first);
    }

    /// Adds a line, without its end.
    pub(super) fn push(&mut self, line: &[u8]) {
        self.lines.extend_from_slice(line);
        self.lines.push(b'\n');
        self.count += 1;
    }

    /// Lets `corner`, which comes after all that refer to a line so far, refer to one: from 1, or back from −1 for the last
    /// one here. The line may come later.
    pub(super) fn refer(&mut self, corner: usize, reference: i64) {
        let line = if reference < 0 { (self.before + self.count) as i64 + reference } else { reference - 1 };
        self.of_corner.resize(corner, NONE);
        // What reaches before the first is no line, as what lies beyond the last.
        self.of_corner.push(u32::try_from(line).unwrap_or(NONE - 1));
    }

    /// Takes references to lines that are not there from their corners, and says how many; `corners` is the number of all.
    pub(super) fn finish(&mut self, corners: usize) -> usize {
        if self.of_corner.is_empty() {
            return 0;
        }
        self.of_corner.resize(corners, NONE);
        let mut missing = 0;
        for line in self.of_corner.iter_mut().filter(|line| **line != NONE && **line as usize >= self.count) {
            *line = NONE;
            missing += 1;
        }
        missing
    }

    fn of_corners(&self, corners: &[u32]) -> Self {
        let of_corner = match self.of_corner.is_empty() {
            true => Vec::new(),
            false => corners.iter().map(|&c| self.of_corner[c as usize]).collect(),
        };
        CornerLines { of_corner, ..self.clone() }
    }

    pub(super) fn write_to(&self, out: &mut dyn Write) -> io::Result<()> {
        out.write_all(&self.lines)
    }
}

impl Attributes {
    /// Whether the file says nothing of the kind.
    pub fn is_empty(&self) -> bool {
        self.texture.is_empty() && self.normals.is_empty() && self.statements.is_empty()
    }

    /// Adds those of the part that follows; `corners` is the number of all before it, and `faces` is added to the numbers of
    /// its faces.
    pub(super) fn append(&mut self, next: &Attributes, corners: usize, faces: u32) {
        self.texture.append(&next.texture, corners);
        self.normals.append(&next.normals, corners);
        self.statements.extend(next.statements.iter().map(|(face, text)| (face + faces, text.clone())));
    }

    /// Those of a mesh whose faces and corners were these, the faces in their order.
    ///
    /// # Panics
    /// If a corner does not exist.
    pub fn of_corners(&self, faces: &[u32], corners: &[u32]) -> Self {
        let statements = self.statements.iter();
        Attributes {
            texture: self.texture.of_corners(corners),
            normals: self.normals.of_corners(corners),
            statements: statements
                .map(|(face, text)| (faces.partition_point(|f| f < face) as u32, text.clone()))
                .collect(),
        }
    }
}

/// How many there are of each kind: `24 texture coordinates (vt), 2 material statements`.
impl fmt::Display for Attributes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let is_of = |words: &[&[u8]], text: &[u8]| {
            let keyword = text.split(u8::is_ascii_whitespace).next().unwrap_or_default();
            words.contains(&keyword)
        };
        let of_kind = |words: &[&[u8]]| self.statements.iter().filter(|(_, text)| is_of(words, text)).count();
        let lines = [("texture coordinates (vt)", self.texture.len()), ("normals (vn)", self.normals.len())];
        let statements = STATEMENTS.map(|(what, words)| (what, of_kind(words)));
        let counts = lines.into_iter().chain(statements).filter(|&(_, count)| count > 0);
        let parts: Vec<String> = counts.map(|(what, count)| format!("{count} {what}")).collect();
        f.write_str(&parts.join(", "))
    }
}
