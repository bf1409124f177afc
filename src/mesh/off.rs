//! Object File Format, as Geomview and its followers write it.

use std::io::{self, Write};
use std::path::Path;

use glam::DVec3;

use super::Mesh;
use super::io::{Builder, Lines, Loaded, check_normals, write_rows};
use super::text::{Scanner, push_point, push_unsigned, quoted};
use crate::{Error, Result};

/// What a vertex holds besides its position, by the letters before `OFF`.
#[derive(Default)]
struct Header {
    normals: bool,
    colours: bool,
    texture: bool,
}

/// Reads the bytes of an OFF file; `path` is for messages.
///
/// The header may be missing, or have the counts on its line or glued to it; `C`, `N`, `ST` before `OFF` announce
/// vertex colours, normals (kept) and texture coordinates (in Geomview's order: position, normal, colour, texture).
/// Comments run from `#` to the line's end. Numbers may be spread over lines freely, except that the colour of a
/// face, and the colours and texture coordinates of a vertex, stand on the line on which its other numbers end. The
/// number of edges is ignored; it may be missing if the counts have a line of their own.
///
/// # Errors
/// [`Error::Parse`] with the line: `4OFF`, `nOFF` and binary files, with the way out; what is no number; a face of
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
    let mut s = Scanner::new(bytes, path);
    let header = header(&mut s)?;
    let (vertices, faces) = counts(&mut s)?;
    let mut builder = Builder::new(Some(Lines::default()));
    // The least: "0 0 0\n" and "3 0 1 2\n".
    builder.reserve_vertices(vertices, s.rest().len() / 6);
    builder.reserve_faces(faces, s.rest().len() / 8);

    let mut normals = header.normals.then(Vec::new);
    for v in 0..vertices {
        s.skip_space();
        let line = s.line();
        let position =
            s.point().ok_or_else(|| s.unexpected(format_args!("a coordinate of vertex {v} of {vertices}")))?;
        if let Some(normals) = &mut normals {
            normals
                .push(s.point().ok_or_else(|| s.unexpected(format_args!("the normal of vertex {v} of {vertices}")))?);
        }
        if header.colours || header.texture {
            vertex_extras(&mut s, &header, v)?;
        }
        builder.vertex(position, line).map_err(|what| Error::parse(path, Some(line), what))?;
    }

    let mut coloured = 0;
    for f in 0..faces {
        s.skip_space();
        let line = s.line();
        let size: u64 =
            s.unsigned().ok_or_else(|| s.unexpected(format_args!("the number of corners of face {f} of {faces}")))?;
        for _ in 0..size {
            s.skip_space();
            builder.corner(
                s.unsigned()
                    .ok_or_else(|| s.unexpected(format_args!("a corner (0, 1, 2, …) of face {f} of {faces}")))?,
            );
        }
        builder.end_face(line).map_err(|what| Error::parse(path, Some(line), what))?;
        match numbers_to_line_end(&mut s)? {
            0 => {}
            1 | 3 | 4 => coloured += 1,
            extra => {
                return Err(s.error(format!(
                    "face {f} has {extra} numbers after its {size} corners, a colour has 1, 3 or 4: \
                     correct the number of corners, or put each face on its own line"
                )));
            }
        }
    }
    s.skip_space();
    if !s.at_end() {
        return Err(s.error(format!(
            "data after the last of {vertices} vertices and {faces} faces: correct the counts in the header"
        )));
    }

    let mut not_kept = Vec::new();
    if header.colours {
        not_kept.push("vertex colours".to_string());
    }
    if header.texture {
        not_kept.push("texture coordinates".to_string());
    }
    if coloured > 0 {
        not_kept.push(format!("colours of {coloured} faces"));
    }
    let mut remarks = Vec::new();
    if !not_kept.is_empty() {
        remarks.push(format!("not kept: {}", not_kept.join(", ")));
    }
    Ok(builder.finish(path, normals, remarks))
}

/// Reads the header word, if there is one, up to counts that may be glued to it.
fn header(s: &mut Scanner) -> Result<Header> {
    let mut header = Header::default();
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
            b'C' | b'c' => header.colours = true,
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

/// Passes over the colour (3 or 4 numbers) and the texture coordinates (2) of a vertex.
fn vertex_extras(s: &mut Scanner, header: &Header, v: u64) -> Result<()> {
    let found = numbers_to_line_end(s)?;
    let texture = if header.texture { 2 } else { 0 };
    let fits = match found.checked_sub(texture) {
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

fn numbers_to_line_end(s: &mut Scanner) -> Result<usize> {
    let mut count = 0;
    loop {
        s.skip_blanks();
        if s.at_line_end() {
            return Ok(count);
        }
        s.number().ok_or_else(|| s.unexpected("a number or the end of the line"))?;
        count += 1;
    }
}

/// Writes `mesh` as OFF, or as NOFF if there are `normals` (one a vertex). The number of edges is written as 0, which
/// readers ignore.
///
/// # Panics
/// If there are not as many normals as vertices.
pub fn write_to(out: &mut dyn Write, mesh: &Mesh, normals: Option<&[DVec3]>) -> io::Result<()> {
    check_normals(mesh, normals);
    let word = if normals.is_some() { "NOFF" } else { "OFF" };
    writeln!(out, "{word}\n{} {} 0", mesh.len(), mesh.faces.len())?;
    write_rows(out, mesh.len(), |text, v| {
        push_point(text, mesh.positions[v])?;
        if let Some(normals) = normals {
            text.push(b' ');
            push_point(text, normals[v])?;
        }
        Ok(())
    })?;
    write_rows(out, mesh.faces.len(), |text, f| {
        let face = mesh.faces.face(f);
        push_unsigned(text, face.len() as u64);
        for &v in face {
            text.push(b' ');
            push_unsigned(text, u64::from(v));
        }
        Ok(())
    })
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
        assert_eq!(parse(&text).unwrap().remarks, ["not kept: colours of 1 faces"]);
        let text = format!("OFF{}{face} 1\n", rows(""));
        assert_eq!(parse(&text).unwrap().remarks, ["not kept: colours of 1 faces"]);
    }

    #[test]
    fn errors_name_the_line_and_what_to_do() {
        let in_space = "is not a mesh in space: its points have other than three coordinates";
        for (text, message) in [
            ("4OFF\n1 1 0\n".into(), format!("1: \"4OFF\" {in_space}")),
            ("# c\n4nOFF\n1 1 0\n".into(), format!("2: \"4nOFF\" {in_space}")),
            ("nOFF\n3\n".into(), format!("1: \"nOFF\" {in_space}")),
            ("OFF BINARY\n\0\0\0\u{8}".into(), "1: binary OFF is not read".into()),
            ("solid x\n".into(), "1: \"solid\" is not an OFF header".into()),
            ("ZOFF\n".into(), "1: \"ZOFF\" is not an OFF header".into()),
            ("OFFSET\n".into(), "1: \"OFFSET\" is not an OFF header".into()),
            (String::new(), "1: the file ends where an OFF header".into()),
            ("OFF\n-4 2 0\n".into(), "2: \"-4\" is not the number of vertices".into()),
            ("OFF\n4 x 0\n".into(), "2: \"x\" is not the number of faces".into()),
            ("OFF\n4 2 x\n".into(), "2: \"x\" is not the number of edges".into()),
            (format!("OFF\n5 2 0\n{BODY}"), "7: face 0 has 2 corners".into()),
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
