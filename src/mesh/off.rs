//! Object File Format, as Geomview and its followers write it.

use std::io::{self, Write};
use std::path::Path;

use glam::DVec3;

use super::Mesh;
use super::builder::Builder;
use super::io::{Lines, Loaded, WriteOptions, check_normals, write_text_rows};
use super::magic::other_kind;
use crate::Result;
use crate::error::counted;
use crate::text::parts::{Output, PART, read_rows, rows_in_parts};
use crate::text::{Scanner, quoted};

/// What a vertex holds besides its position, by the letters before `OFF`.
#[derive(Default)]
struct Header {
    normals: bool,
    colours: bool,
    texture: bool,
    /// `N` before `C`, against Geomview's order.
    normals_before_colours: bool,
}

/// Reads the bytes of an OFF file; `path` is for messages.
///
/// The header may be missing, or have the counts on its line or glued to it; `C`, `N`, `ST` before `OFF` announce
/// vertex colours, normals (kept) and texture coordinates. Geomview's order is position, normal, colour, texture;
/// MeshLab puts the colour before the normal. Where there are both, the normals are where unit lengths are, and colours
/// within 0 to 255; if that does not decide, they are in Geomview's place under Geomview's header (`CNOFF`) and are not
/// kept under another (`NCOFF`).
///
/// Comments run from `#` to the line's end. Numbers may be spread over lines freely, except that a face with a
/// colour has a line of its own, and that the colour and texture coordinates of a vertex stand on the line on which its
/// other numbers end; where the first row has a line of its own, every row has. The number of edges is ignored; it may be missing if the counts
/// have a line of their own.
///
/// # Errors
/// [`Error::Parse`](crate::Error::Parse) with the line: `4OFF`, `nOFF` and binary files, with the way out; what is no number; a face of
/// fewer than three corners; a file that ends early; data after the last face, for then the counts are wrong.
///
/// ```
/// use limitlab::mesh::off::read_bytes;
/// let loaded = read_bytes(b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", "a.off".as_ref())?;
/// assert_eq!(loaded.mesh.faces.face(0), [0, 1, 2]);
/// assert_eq!(loaded.lines.unwrap().faces, [6]);
/// # Ok::<(), limitlab::Error>(())
/// ```
pub fn read_bytes(bytes: &[u8], path: &Path) -> Result<Loaded> {
    read_in_parts(bytes, path, PART)
}

/// As [`read_bytes`], in parts of about `size` bytes.
pub(super) fn read_in_parts(bytes: &[u8], path: &Path, size: usize) -> Result<Loaded> {
    let mut s = Scanner::new(bytes, path);
    let header = header(&mut s)?;
    let (vertices, faces) = counts(&mut s)?;
    let mut builder = Builder::new(Some(Lines::default()));
    // The least: "0 0 0\n" and "3 0 1 2\n".
    builder.reserve_vertices(vertices, s.rest().len() / 6);
    builder.reserve_faces(faces, s.rest().len() / 8);
    let mut read = Read { builder, normals: Normals::default(), extras: Vec::new(), coloured: 0 };
    let parts = rows_in_parts(size);

    s.begin_rows();
    read_rows(&mut s, vertices, &mut read, &parts, &Scanner::follow, &|s, v, read| {
        read.vertex(s, &header, v, vertices)
    })?;
    if faces > 0 {
        s.begin_rows();
    }
    read_rows(&mut s, faces, &mut read, &parts, &Scanner::follow, &|s, f, read| read.face(s, f, faces))?;
    s.skip_space();
    if !s.at_end() {
        return Err(s.error(format!(
            "data after the last of {vertices} vertices and {faces} faces: correct the counts in the header"
        )));
    }

    let Read { builder, normals, coloured, .. } = read;
    let normals = header.normals.then(|| normals.decide(&header));
    let mut not_kept = Vec::new();
    if header.colours {
        not_kept.push("vertex colours".to_string());
    }
    if header.texture {
        not_kept.push("texture coordinates".to_string());
    }
    if let Some(None) = normals {
        not_kept
            .push("normals, which cannot be told from the colours (write them as NOFF, without colours)".to_string());
    }
    if coloured > 0 {
        not_kept.push(format!("colours of {}", counted(coloured, "face")));
    }
    let mut remarks = Vec::new();
    if !not_kept.is_empty() {
        remarks.push(format!("not kept: {}", not_kept.join(", ")));
    }
    Ok(builder.finish(path, normals.flatten(), remarks))
}

/// The rows of a file or of a part of it.
struct Read {
    builder: Builder,
    normals: Normals,
    /// What follows the position of the present vertex.
    extras: Vec<f64>,
    /// How many faces have colours.
    coloured: usize,
}

impl Read {
    fn vertex(&mut self, s: &mut Scanner, header: &Header, v: u64, vertices: u64) -> Result<()> {
        let line = s.begin_row();
        let position =
            s.point().ok_or_else(|| s.unexpected(format_args!("a coordinate of vertex {v} of {vertices}")))?;
        if !header.is_plain() {
            vertex_extras(s, header, v, vertices, &mut self.extras)?;
            if header.normals {
                self.normals.push(&self.extras, header);
            }
        }
        s.end_row(format_args!("vertex {v} of {vertices}"))?;
        self.builder.vertex(position, line).map_err(|what| s.error_at(line, what))
    }

    fn face(&mut self, s: &mut Scanner, f: u64, faces: u64) -> Result<()> {
        let line = s.begin_row();
        let size: u64 =
            s.unsigned().ok_or_else(|| s.unexpected(format_args!("the number of corners of face {f} of {faces}")))?;
        for _ in 0..size {
            s.next_in_row();
            self.builder.corner(
                s.unsigned()
                    .ok_or_else(|| s.unexpected(format_args!("a corner (0, 1, 2, …) of face {f} of {faces}")))?,
            );
        }
        self.builder.end_face(line).map_err(|what| s.error_at(line, what))?;
        let mut extra = 0;
        if s.line() == line {
            numbers_to_line_end(s, |_| extra += 1)?;
        }
        match extra {
            0 => {}
            1 | 3 | 4 => self.coloured += 1,
            extra => {
                return Err(s.error(format!(
                    "face {f} has {extra} numbers after its {size} corners, a colour has 1, 3 or 4: \
                     correct the number of corners, or put each face on its own line"
                )));
            }
        }
        s.end_row(format_args!("face {f} of {faces}"))
    }
}

impl Output for Read {
    fn empty(&self) -> Self {
        Read { builder: self.builder.empty(), normals: Normals::default(), extras: Vec::new(), coloured: 0 }
    }

    fn clear(&mut self) {
        self.builder.begin_part([0; 3]);
        self.normals = Normals::default();
        self.coloured = 0;
    }

    fn append(&mut self, parts: &[&Self]) -> bool {
        let builders: Vec<&Builder> = parts.iter().map(|part| &part.builder).collect();
        let fits = self.builder.append(&builders, &vec![0; parts.len()], 1.0);
        if fits {
            for part in parts {
                self.normals.append(&part.normals);
                self.coloured += part.coloured;
            }
        }
        fits
    }
}

/// Refuses the first bytes of a file, whole lines, if they are no OFF.
pub(super) fn check_head(head: &[u8], path: &Path) -> Result<()> {
    let mut s = Scanner::of_head(head, path);
    let read = header(&mut s).and_then(|_| counts(&mut s));
    // What a line beyond may hold is not known.
    if s.at_end() { Ok(()) } else { read.map(|_| ()) }
}

/// Reads the header word, if there is one, up to counts that may be glued to it.
fn header(s: &mut Scanner) -> Result<Header> {
    let mut header = Header::default();
    if let Some(what) = other_kind(s.rest()).filter(|_| !s.rest().starts_with(b"OFF")) {
        return Err(s.error(format!("not an OFF file: {what}")));
    }
    s.skip_space();
    let word = s.peek_token();
    if !word.is_empty() && word.iter().all(u8::is_ascii_digit) {
        return Ok(header);
    }
    let wanted = "an OFF header (OFF, COFF, NOFF, …) or the number of vertices";
    let start = word.windows(3).position(|w| w.eq_ignore_ascii_case(b"OFF")).ok_or_else(|| s.unexpected(wanted))?;
    let (mut letters, counts) = (&word[..start], &word[start + 3..]);
    while let Some(letter) = letters.first() {
        letters = &letters[1..];
        match letter {
            b'C' | b'c' => {
                header.colours = true;
                header.normals_before_colours = header.normals;
            }
            b'N' => header.normals = true,
            b'S' | b's' if matches!(letters.first(), Some(b'T' | b't')) => {
                letters = &letters[1..];
                header.texture = true;
            }
            b'4' | b'n' => {
                return Err(s.error(format!(
                    "{} is not a mesh in space: its points have other than three coordinates; \
                     write x y z alone, under the header OFF",
                    quoted(word)
                )));
            }
            _ => return Err(s.unexpected(wanted)),
        }
    }
    if !counts.iter().all(u8::is_ascii_digit) {
        return Err(s.unexpected(wanted));
    }
    s.advance(start + 3);
    s.skip_blanks();
    if s.peek_token().eq_ignore_ascii_case(b"BINARY") {
        return Err(s.error("binary OFF is not read: convert the file to text OFF or to PLY"));
    }
    Ok(header)
}

/// Reads the numbers of vertices and faces, and passes over the number of edges. That one is on the line of the
/// number of faces, or alone on the next; a vertex is never alone there, for it has three numbers.
fn counts(s: &mut Scanner) -> Result<(u64, u64)> {
    s.skip_space();
    let vertices = s.unsigned().ok_or_else(|| s.unexpected("the number of vertices"))?;
    s.skip_space();
    let faces = s.unsigned().ok_or_else(|| s.unexpected("the number of faces"))?;
    s.skip_blanks();
    if s.at_line_end() {
        let mut ahead = s.clone();
        ahead.skip_space();
        if ahead.unsigned::<u64>().is_some() {
            ahead.skip_blanks();
            if ahead.at_line_end() {
                *s = ahead;
            }
        }
    } else {
        s.unsigned::<u64>().ok_or_else(|| s.unexpected("the number of edges"))?;
    }
    Ok((vertices, faces))
}

/// Reads what follows the position of a vertex: normal (3 numbers), colour (3 or 4) and texture coordinates (2).
fn vertex_extras(s: &mut Scanner, header: &Header, v: u64, vertices: u64, extras: &mut Vec<f64>) -> Result<()> {
    extras.clear();
    if header.normals {
        let first = s.point().ok_or_else(|| s.unexpected(format_args!("the normal of vertex {v} of {vertices}")))?;
        extras.extend(first.to_array());
    }
    if !header.colours && !header.texture {
        return Ok(());
    }
    let before = extras.len();
    numbers_to_line_end(s, |number| extras.push(number))?;
    let found = extras.len() - before;
    let fits = match found.checked_sub(header.texture_numbers()) {
        Some(colour) if header.colours => matches!(colour, 3 | 4),
        rest => rest == Some(0),
    };
    if fits {
        return Ok(());
    }
    Err(s.error(format!(
        "vertex {v} is followed by {found} numbers on its line, which are not the colour (3 or 4) or texture \
         coordinates (2) that the header announces"
    )))
}

impl Header {
    fn is_plain(&self) -> bool {
        !self.normals && !self.colours && !self.texture
    }

    fn texture_numbers(&self) -> usize {
        if self.texture { 2 } else { 0 }
    }
}

/// The normals of vertices that may have colours, as if before them and as if after.
struct Normals {
    before: Vec<DVec3>,
    after: Vec<DVec3>,
    /// Whether all of `before`, and all of `after`, can be normals and the rest colours.
    fit: [bool; 2],
}

impl Default for Normals {
    fn default() -> Self {
        Normals { before: Vec::new(), after: Vec::new(), fit: [true; 2] }
    }
}

impl Normals {
    /// Adds what follows the position of a vertex.
    fn push(&mut self, extras: &[f64], header: &Header) {
        self.before.push(DVec3::from_slice(extras));
        if !header.colours {
            return;
        }
        let both = &extras[..extras.len() - header.texture_numbers()];
        let (early, colour) = both.split_at(3);
        self.fit[0] &= can_be_normal(early) && can_be_colour(colour);
        let (colour, late) = both.split_at(both.len() - 3);
        self.fit[1] &= can_be_normal(late) && can_be_colour(colour);
        self.after.push(DVec3::from_slice(late));
    }

    /// Adds those of the vertices that follow.
    fn append(&mut self, next: &Normals) {
        self.before.extend_from_slice(&next.before);
        self.after.extend_from_slice(&next.after);
        self.fit = [0, 1].map(|k| self.fit[k] && next.fit[k]);
    }

    fn decide(self, header: &Header) -> Option<Vec<DVec3>> {
        match self.fit {
            [false, true] => Some(self.after),
            [true, false] => Some(self.before),
            _ => (!header.normals_before_colours).then_some(self.before),
        }
    }
}

/// Whether these are a unit vector as files hold them, rounded, or none.
fn can_be_normal(numbers: &[f64]) -> bool {
    let length = DVec3::from_slice(numbers).length();
    length == 0.0 || (length - 1.0).abs() < 0.01
}

fn can_be_colour(numbers: &[f64]) -> bool {
    numbers.iter().all(|x| (0.0..=255.0).contains(x))
}

fn numbers_to_line_end(s: &mut Scanner, mut each: impl FnMut(f64)) -> Result<()> {
    loop {
        s.skip_blanks();
        if s.at_line_end() {
            return Ok(());
        }
        each(s.number().ok_or_else(|| s.unexpected("a number or the end of the line"))?);
    }
}

/// Writes `mesh` as OFF, or as NOFF if there are `normals` (one a vertex). The number of edges is written as 0, which
/// readers ignore.
///
/// # Panics
/// If there are not as many normals as vertices.
pub fn write_to(out: &mut dyn Write, mesh: &Mesh, normals: Option<&[DVec3]>) -> io::Result<()> {
    write_control_to(out, mesh, &WriteOptions { normals, ..WriteOptions::default() })
}

/// As [`write_to`], with comments after the first line.
///
/// # Panics
/// If there are not as many normals as vertices.
pub fn write_control_to(out: &mut dyn Write, mesh: &Mesh, options: &WriteOptions) -> io::Result<()> {
    let normals = options.normals;
    check_normals(mesh, normals);
    writeln!(out, "{}", if normals.is_some() { "NOFF" } else { "OFF" })?;
    options.write_comments(out, "#")?;
    writeln!(out, "{} {} 0", mesh.len(), mesh.faces.len())?;
    write_text_rows(out, mesh, normals)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Loaded> {
        read_bytes(text.as_bytes(), Path::new("a.off"))
    }

    fn refusal(text: &str) -> String {
        let text = parse(text).unwrap_err().to_string();
        assert!(!text.contains('\n'), "{text}");
        text
    }

    const BODY: &str = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 1 2\n4 0 1 3 2\n";

    #[test]
    fn the_header_in_all_its_forms_gives_the_same_mesh() {
        let plain = parse(&format!("OFF\n4 2 5\n{BODY}")).unwrap();
        assert_eq!(plain.mesh.len(), 4);
        let faces: Vec<_> = plain.mesh.faces.iter().collect();
        assert_eq!(faces, [&[0, 1, 2][..], &[0, 1, 3, 2]]);
        for header in [
            "OFF 4 2 5\n",
            "OFF4 2 5\n",
            "off\n4 2\n",
            "4 2 5\n",
            "4 2\n",
            "\u{feff}OFF\r\n4 2 5\r\n",
            "# made by hand\n\n OFF # a comment\n# another\n4 # V\n\n2 # F\n5 # E\n",
            "OFF\n4\n2\n5\n",
            "OFF\n4\n2 5\n",
            "OFF\n4\n2\n",
            "OFF 4 2 5 ",
            "OFF\r4 2 5\r",
        ] {
            let loaded = parse(&format!("{header}{BODY}")).unwrap();
            assert_eq!(loaded.mesh, plain.mesh, "{header}");
            assert!(loaded.remarks.is_empty(), "{header}");
        }
    }

    #[test]
    fn numbers_may_be_spread_and_lines_stay_right() {
        let text = "OFF\n3 2 0\n0 0 0 1 0 0 # two\n\n0\n1\t0\n\n3 0\n 1\n2\n3 2 1 0";
        let loaded = parse(text).unwrap();
        assert_eq!(loaded.mesh.positions, [DVec3::ZERO, DVec3::X, DVec3::Y]);
        let lines = loaded.lines.unwrap();
        assert_eq!(lines.vertices, [3, 3, 5]);
        assert_eq!(lines.faces, [8, 11]);
        assert_eq!(loaded.mesh.faces.face(1), [2, 1, 0]);
    }

    #[test]
    fn normals_are_kept_colours_and_texture_coordinates_are_named() {
        let face = "3 0 1 2";
        let rows = |extra: &str| format!("\n3 1 0\n0 0 0 {extra}\n1 0 0 {extra}\n0 1 0 {extra}\n");
        for (header, extra, remark) in [
            ("NOFF", "0 0 2", None),
            ("COFF", "255 0 0", Some("not kept: vertex colours")),
            ("COFF", "0.5 .5 .5 1", Some("not kept: vertex colours")),
            ("STOFF", "0.1 0.2", Some("not kept: texture coordinates")),
            ("CNOFF", "0 0 2 1 1 1 1", Some("not kept: vertex colours")),
            ("STCNOFF", "0 0 2 9 9 9 .1 .2 # x", Some("not kept: vertex colours, texture coordinates")),
        ] {
            let loaded = parse(&format!("{header}{}{face}\n", rows(extra))).unwrap();
            assert_eq!(loaded.mesh.positions, [DVec3::ZERO, DVec3::X, DVec3::Y]);
            let normals = header.contains('N').then(|| vec![DVec3::Z * 2.0; 3]);
            assert_eq!(loaded.normals, normals);
            let remarks: Vec<_> = loaded.remarks.iter().map(String::as_str).collect();
            assert_eq!(remarks, Vec::from_iter(remark), "{header}");
        }
        let text = format!("OFF{}{face} 255 0 0\n", rows(""));
        assert_eq!(parse(&text).unwrap().remarks, ["not kept: colours of 1 face"]);
        let text = format!("OFF{}{face} 1\n", rows(""));
        assert_eq!(parse(&text).unwrap().remarks, ["not kept: colours of 1 face"]);
    }

    #[test]
    fn normals_are_found_before_and_after_colours() {
        let read = |word: &str, rows: [&str; 3]| {
            let [a, b, c] = rows;
            parse(&format!("{word}\n3 1 0\n0 0 0 {a}\n1 0 0 {b}\n0 1 0 {c}\n3 0 1 2\n")).unwrap()
        };
        let normals = [DVec3::X, DVec3::Y, DVec3::new(0.6, -0.8, 0.0)];
        let [x, y, z] = ["1 0 0", "0 1 0", "0.6 -0.8 0"];
        for colour in ["255 255 255 255", "200 10 0", ".5 .25 0 1", "0 0 0", "1 1 1", "1 0 0"] {
            for (texture, words) in [("", ["CNOFF", "NCOFF"]), (" .5 .5", ["STCNOFF", "NCSTOFF"])] {
                for word in words {
                    let first = [x, y, z].map(|n| format!("{n} {colour}{texture}"));
                    let last = [x, y, z].map(|n| format!("{colour} {n}{texture}"));
                    for rows in [first, last] {
                        let loaded = read(word, rows.each_ref().map(String::as_str));
                        assert_eq!(loaded.normals.as_deref(), Some(&normals[..]), "{word} {rows:?}");
                    }
                }
            }
        }
        // Either may be either, or neither fits.
        for row in ["1 0 0 0 1 0", "2 0 0 255 255 255"] {
            assert_eq!(
                read("CNOFF", [row; 3]).normals,
                Some(vec![DVec3::from_slice(&[row[..1].parse().unwrap(), 0.0, 0.0]); 3])
            );
            let loaded = read("NCOFF", [row; 3]);
            assert_eq!(loaded.normals, None);
            assert!(loaded.remarks[0].contains("cannot be told from the colours"), "{:?}", loaded.remarks);
        }
    }

    #[test]
    fn rows_that_are_too_long_or_too_short_are_named() {
        let long = "\"0\" is one value too many for vertex 1 of 4";
        let announced = "does the header announce all that a row holds, such as colours?)";
        for (text, start, end) in [
            ("4 1 0\n0 0 0\n1 0 0 0\n0 1 0\n0 0 1\n3 0 1 2\n", long, ""),
            ("4 1 0\n0 0 0\n1 0\n0 1 0\n0 0 1\n3 0 1 2\n", "the line ends where a coordinate of vertex 1", ""),
            ("4 1 0\n0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 1 2\n", "vertex 0 of 4 has fewer values on its line", ""),
            ("3 2 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1\n3 2 1 0\n", "face 0 of 2 has fewer values on its line", ""),
            ("3 2 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n3 2 1\n", "the line ends where a corner", ""),
            ("2 0 0\n0 0 0\n1 0 0\n0 1 0\n", "data after the last", "faces: correct the counts in the header"),
            ("2 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", "face 0 has 0 corners", "correct the counts in the header)"),
            ("2 1 0\n0 0 0 1 .5 0\n1 0 0 1 .5 0\n3 0 1 2\n", "face 0 has 1 corner,", announced),
        ] {
            let found = refusal(&format!("OFF\n{text}"));
            assert!(found.contains(start) && found.ends_with(end), "{found}");
        }
    }

    #[test]
    fn errors_name_the_line_and_what_to_do() {
        let in_space = "is not a mesh in space: its points have other than three coordinates";
        for (text, message) in [
            ("4OFF\n1 1 0\n".into(), format!("1: \"4OFF\" {in_space}")),
            ("# c\n4nOFF\n1 1 0\n".into(), format!("2: \"4nOFF\" {in_space}")),
            ("nOFF\n3\n".into(), format!("1: \"nOFF\" {in_space}")),
            ("OFF BINARY\n\0\0\0\u{8}".into(), "1: binary OFF is not read".into()),
            ("solid x\n".into(), "1: not an OFF file: it is an STL file".into()),
            ("mesh x\n".into(), "1: \"mesh\" is not an OFF header".into()),
            ("ZOFF\n".into(), "1: \"ZOFF\" is not an OFF header".into()),
            ("OFFSET\n".into(), "1: \"OFFSET\" is not an OFF header".into()),
            (String::new(), "1: the file ends where an OFF header".into()),
            ("OFF\n-4 2 0\n".into(), "2: \"-4\" is not the number of vertices".into()),
            ("OFF\n4 x 0\n".into(), "2: \"x\" is not the number of faces".into()),
            ("OFF\n4 2 x\n".into(), "2: \"x\" is not the number of edges".into()),
            (format!("OFF\n5 2 0\n{BODY}"), "7: \"2\" is one value too many for vertex 4 of 5".into()),
            (
                format!("OFF\n4 3 0\n{BODY}"),
                "8: the file ends where the number of corners of face 2 of 3 should be".into(),
            ),
            (
                format!("OFF\n4 1 0\n{BODY}"),
                "8: data after the last of 4 vertices and 1 faces: correct the counts".into(),
            ),
            ("OFF\n1 0 0\n0 zero 0\n".into(), "3: \"zero\" is not a coordinate of vertex 0 of 1".into()),
            ("OFF\n1 1 0\n0 0 0\n2 0 0\n".into(), "4: face 0 has 2 corners".into()),
            ("OFF\n1 1 0\n0 0 0\n3 0 0 -1\n".into(), "4: \"-1\" is not a corner".into()),
            ("OFF\n1 1 0\n0 0 0\n3 0 0 4294967296\n".into(), "4: \"4294967296\" is not a corner".into()),
            ("OFF\n1 1 0\n0 0 0\n3 0 0 0 0 0\n".into(), "4: face 0 has 2 numbers after its 3 corners".into()),
            ("OFF\n1 1 0\n0 0 0\n3 0 0 0 red\n".into(), "4: \"red\" is not a number or the end of the line".into()),
            (
                "COFF\n1 1 0\n0 0 0\n255 0 0\n3 0 0 0\n".into(),
                "3: vertex 0 is followed by 0 numbers on its line".into(),
            ),
        ] {
            let found = refusal(&text);
            assert!(found.starts_with(&format!("a.off, line {message}")), "{text}: {found}");
        }
    }

    #[test]
    fn indices_beyond_the_vertices_are_left_to_the_validation() {
        let loaded = parse("OFF\n1 1 0\nnan 0 -inf\n3 0 0 4294967295\n").unwrap();
        assert_eq!(loaded.mesh.faces.face(0), [0, 0, u32::MAX]);
        assert!(!loaded.mesh.positions[0].is_finite());
    }

    #[test]
    fn absurd_counts_are_refused_at_the_end_of_the_data() {
        for count in ["1000000000000", "18446744073709551615"] {
            let text = refusal(&format!("OFF\n{count} {count} 0\n0 0 0\n"));
            let start = "a.off, line 3: the file ends where a coordinate of vertex 1 of";
            assert!(text.starts_with(start), "{text}");
            let text = refusal(&format!("OFF\n1 1 0\n0 0 0\n{count} 0 0\n"));
            let start = "a.off, line 4: the file ends where a corner";
            assert!(text.starts_with(start), "{text}");
        }
    }
}
