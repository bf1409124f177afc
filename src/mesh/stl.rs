//! STL (stereolithography): triangles without vertices of their own, as text and binary.

use std::path::Path;

use glam::DVec3;

use super::builder::{Builder, joined};
use super::io::{Lines, Loaded};
use super::magic::other_kind;
use crate::text::{Scanner, quoted};
use crate::{Error, Result};

/// How text begins, and what many a binary file has in its head too.
const SOLID: &[u8] = b"solid";
/// The head of a binary file: 80 bytes of anything, and the number of triangles.
const HEAD: usize = 84;
/// Bytes of a triangle: the normal, three corners, in single precision, and two bytes.
const TRIANGLE: usize = 50;

/// Reads the bytes of an STL file; `path` is for messages.
///
/// A file is binary if its size is the one that its head announces, and if it is no text: text opens with the word `solid`, and
/// words may be in capitals, several solids may follow each other. The triangles are the faces, in the order of the file.
/// Corners at one position, to the last bit, are one vertex, in the order of the first, which is remarked; text is read in
/// double precision. Normals of triangles are passed over, for they follow from the corners. O(N log N).
///
/// # Errors
/// [`Error::Parse`] with the line of text, or with the byte: a word out of its place, what is no number, another number of
/// triangles than the head announces.
///
/// ```
/// let text = "solid one\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n\
///             facet normal 0 0 1\nouter loop\nvertex 0 1 0\nvertex 1 0 0\nvertex 1 1 0\nendloop\nendfacet\nendsolid\n";
/// let loaded = limitlab::mesh::stl::read_bytes(text.as_bytes(), "a.stl".as_ref())?;
/// assert_eq!((loaded.mesh.len(), loaded.mesh.faces.face(1)), (4, &[2, 1, 3][..]));
/// assert_eq!(loaded.lines.unwrap().faces, [2, 9]);
/// # Ok::<(), limitlab::Error>(())
/// ```
pub fn read_bytes(bytes: &[u8], path: &Path) -> Result<Loaded> {
    check_head(bytes, path)?;
    let announced = announced(bytes);
    let loaded = match announced {
        Some(count) if has_size(bytes, count) => read_binary(bytes, count, path),
        _ if is_text(bytes) => read_text(bytes, path),
        Some(count) => Err(wrong_size(bytes, count, path)),
        None => Err(Error::parse(
            path,
            None,
            format!("the {} bytes are fewer than the {HEAD} of a binary head: is it complete?", bytes.len()),
        )),
    }?;
    Ok(joined(loaded, "corners of triangles", "STL has no vertices of its own"))
}

/// Refuses the first bytes of a file if they are those of another kind: but zeros, which a binary head may have.
pub(super) fn check_head(head: &[u8], path: &Path) -> Result<()> {
    if head.starts_with(b"\0") || opens_with_solid(head) {
        return Ok(());
    }
    match other_kind(head) {
        Some(what) if !announced(head).is_some_and(|count| has_size(head, count)) => {
            Err(Error::parse(path, None, format!("not an STL file: {what}")))
        }
        _ => Ok(()),
    }
}

fn opens_with_solid(bytes: &[u8]) -> bool {
    let text = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes).trim_ascii_start();
    text.get(..SOLID.len()).is_some_and(|word| word.eq_ignore_ascii_case(SOLID))
}

fn is_text(bytes: &[u8]) -> bool {
    opens_with_solid(bytes) && !bytes[..bytes.len().min(HEAD)].contains(&0)
}

/// The number of triangles in a binary head.
fn announced(bytes: &[u8]) -> Option<u32> {
    bytes.get(HEAD - 4..)?.first_chunk().map(|&count| u32::from_le_bytes(count))
}

fn has_size(bytes: &[u8], count: u32) -> bool {
    (HEAD as u64 + TRIANGLE as u64 * u64::from(count)) == bytes.len() as u64
}

fn wrong_size(bytes: &[u8], count: u32, path: &Path) -> Error {
    let there = (bytes.len() - HEAD) / TRIANGLE;
    let what = if there < count as usize {
        format!("the file ends after {there} of the {count} triangles that its head announces: is it complete?")
    } else {
        let end = HEAD + TRIANGLE * count as usize;
        format!(
            "byte {end}: data after the last of {count} triangles: correct the count in the head (byte {})",
            HEAD - 4
        )
    };
    Error::parse(path, None, what)
}

fn read_binary(bytes: &[u8], count: u32, path: &Path) -> Result<Loaded> {
    let mut builder = Builder::new(None);
    builder.reserve_vertices(3 * u64::from(count), bytes.len());
    builder.reserve_faces(count.into(), bytes.len());
    let mut coloured = 0;
    for (f, triangle) in bytes[HEAD..].chunks_exact(TRIANGLE).enumerate() {
        let float = |k: usize| f64::from(f32::from_le_bytes([0, 1, 2, 3].map(|byte| triangle[4 * k + byte])));
        let corners = [3, 6, 9].map(|k| DVec3::new(float(k), float(k + 1), float(k + 2)));
        let place = HEAD + TRIANGLE * f;
        push(&mut builder, corners, [place; 3], place)
            .map_err(|what| Error::parse(path, None, format!("byte {place}: {what}")))?;
        coloured += usize::from(triangle[TRIANGLE - 2..] != [0; 2]);
    }
    let remarks = (coloured > 0).then(|| format!("not kept: attributes of {coloured} triangles, such as colours"));
    Ok(builder.finish(path, None, Vec::from_iter(remarks)))
}

fn read_text(bytes: &[u8], path: &Path) -> Result<Loaded> {
    let mut s = Scanner::new(bytes, path);
    let mut builder = Builder::new(Some(Lines::default()));
    loop {
        word(&mut s, "solid")?;
        // The name may be anything.
        s.skip_to_line_end();
        loop {
            s.skip_space();
            let line = s.line();
            if is_word(&s, "endsolid") {
                s.skip_line();
                break;
            }
            let facet = format!("facet or endsolid after {} triangles", builder.faces());
            if !is_word(&s, "facet") {
                return Err(s.unexpected(facet));
            }
            s.token();
            word(&mut s, "normal")?;
            for _ in 0..3 {
                s.skip_space();
                s.token();
            }
            word(&mut s, "outer")?;
            word(&mut s, "loop")?;
            let (mut corners, mut lines) = ([DVec3::ZERO; 3], [0; 3]);
            for (k, (corner, line)) in corners.iter_mut().zip(&mut lines).enumerate() {
                word(&mut s, "vertex")?;
                *line = s.line();
                *corner = s.point().ok_or_else(|| {
                    s.unexpected(format_args!("a coordinate of corner {k} of triangle {}", builder.faces()))
                })?;
            }
            word(&mut s, "endloop")?;
            word(&mut s, "endfacet")?;
            push(&mut builder, corners, lines, line).map_err(|what| s.error_at(line, what))?;
        }
        s.skip_space();
        if s.at_end() {
            return Ok(builder.finish(path, None, Vec::new()));
        }
    }
}

fn push(builder: &mut Builder, corners: [DVec3; 3], lines: [usize; 3], line: usize) -> std::result::Result<(), String> {
    for (corner, line) in corners.into_iter().zip(lines) {
        let vertex = builder.vertices() as u32;
        builder.vertex(corner, line)?;
        builder.corner(vertex);
    }
    builder.end_face(line)
}

fn is_word(s: &Scanner, wanted: &str) -> bool {
    s.peek_token().eq_ignore_ascii_case(wanted.as_bytes())
}

fn word(s: &mut Scanner, wanted: &str) -> Result<()> {
    s.skip_space();
    if !is_word(s, wanted) {
        return Err(s.unexpected(quoted(wanted.as_bytes())));
    }
    s.token();
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(bytes: &[u8]) -> Result<Loaded> {
        read_bytes(bytes, Path::new("a.stl"))
    }

    fn refusal(bytes: &[u8]) -> String {
        let text = parse(bytes).unwrap_err().to_string();
        assert!(!text.contains('\n'), "{text}");
        text
    }

    const CORNERS: [[[f32; 3]; 3]; 2] =
        [[[0.0, 0.0, 0.0], [1.5, 0.0, -0.1], [0.0, 1.0, 0.0]], [[0.0, 1.0, 0.0], [1.5, 0.0, -0.1], [1.0, 1.0, 1e-30]]];

    fn binary(head: &[u8], attribute: [u8; 2]) -> Vec<u8> {
        let mut bytes = head.to_vec();
        bytes.resize(80, 0);
        bytes.extend((CORNERS.len() as u32).to_le_bytes());
        for triangle in CORNERS {
            bytes.extend([[9f32; 3]].iter().chain(&triangle).flatten().flat_map(|x| x.to_le_bytes()));
            bytes.extend(attribute);
        }
        bytes
    }

    fn text() -> String {
        let facet = |t: [[f32; 3]; 3]| {
            let vertices: String = t.iter().map(|[x, y, z]| format!("vertex {x} {y} {z}\n")).collect();
            format!("facet normal 0 0 nan\n outer loop\n{vertices}endloop\nendfacet\n")
        };
        format!("solid two words\n{}endsolid\n", CORNERS.map(facet).concat())
    }

    #[test]
    fn corners_at_one_position_are_one_vertex_and_triangles_keep_their_order() {
        let points = [[0.0, 0.0, 0.0], [1.5, 0.0, -0.1], [0.0, 1.0, 0.0], [1.0, 1.0, 1e-30]];
        let single = points.map(|p: [f64; 3]| DVec3::from(p.map(|x| f64::from(x as f32))));
        let double = points.map(DVec3::from);
        let upper = text().to_uppercase().replace('\n', "\r\n");
        for (bytes, points, lines) in [
            (binary(b"exported", [0; 2]), single, None),
            (binary(b"solid by a program that says so", [0; 2]), single, None),
            (binary(b"", [0; 2]), single, None),
            (binary(b"{ PK", [0; 2]), single, None),
            (text().into_bytes(), double, Some([4, 5, 6, 13])),
            (upper.into_bytes(), double, Some([4, 5, 6, 13])),
        ] {
            let loaded = parse(&bytes).unwrap();
            assert_eq!(loaded.mesh.positions, points);
            assert_eq!(loaded.mesh.faces.corners(), [0, 1, 2, 2, 1, 3]);
            assert_eq!(loaded.lines.as_ref().map(|l| &l.vertices[..]), lines.as_ref().map(|l| &l[..]));
            assert!(loaded.lines.is_none_or(|l| l.faces == [2, 9]));
            let what = "6 corners of triangles lie at 4 positions, each of which is one vertex: STL has no vertices of its own";
            assert_eq!(loaded.remarks, [what]);
        }
        let remarks = parse(&binary(b"", [0, 128])).unwrap().remarks;
        assert_eq!(remarks[0], "not kept: attributes of 2 triangles, such as colours");
    }

    #[test]
    fn solids_follow_each_other_and_a_triangle_alone_has_nothing_to_join() {
        let two = text() + &text().replace("1.5", "2.5");
        let mesh = parse(two.as_bytes()).unwrap().mesh;
        assert_eq!((mesh.len(), mesh.faces.corners()), (5, &[0, 1, 2, 2, 1, 3, 0, 4, 2, 2, 4, 3][..]));
        let one = &text()[..text().match_indices("facet").nth(2).unwrap().0];
        let loaded = parse((one.to_owned() + "endsolid").as_bytes()).unwrap();
        assert_eq!((loaded.mesh.len(), loaded.remarks.len()), (3, 0));
        assert!(parse(b"solid nothing\nendsolid nothing\n").unwrap().mesh.is_empty());
    }

    #[test]
    fn errors_in_text_name_the_line() {
        let changed = |from: &str, to: &str| refusal(text().replacen(from, to, 1).as_bytes());
        for (from, to, message) in [
            ("facet", "face", "2: \"face\" is not facet or endsolid after 0 triangles"),
            ("normal", "norm", "2: \"norm\" is not \"normal\""),
            ("outer", "inner", "3: \"inner\" is not \"outer\""),
            ("vertex", "point", "4: \"point\" is not \"vertex\""),
            (
                "1.5",
                "1,5",
                "5: \"1,5\" is not a coordinate of corner 1 of triangle 0: write numbers with a decimal point",
            ),
            ("endloop", "vertex 1 1 1\nendloop", "7: \"vertex\" is not \"endloop\""),
            ("endsolid", "", "16: the file ends where facet or endsolid after 2 triangles should be"),
            ("endsolid", "endsolid\nrest", "17: \"rest\" is not \"solid\""),
        ] {
            let found = changed(from, to);
            assert!(found.starts_with(&format!("a.stl, line {message}")), "{found}");
        }
    }

    #[test]
    fn errors_in_binary_files_name_the_byte_or_the_triangle() {
        let whole = binary(b"", [0; 2]);
        assert_eq!(
            refusal(&whole[..whole.len() - 1]),
            "a.stl: the file ends after 1 of the 2 triangles that its head announces: is it complete?"
        );
        assert_eq!(
            refusal(&[&whole[..], b"x"].concat()),
            "a.stl: byte 184: data after the last of 2 triangles: correct the count in the head (byte 80)"
        );
        assert!(refusal(&whole[..83]).starts_with("a.stl: the 83 bytes are fewer than the 84 of a binary head"));
        let solid = binary(b"solid", [0; 2]);
        assert!(refusal(&solid[..150]).contains("after 1 of the 2 triangles"));
        assert!(refusal(b"\x1F\x8B").starts_with("a.stl: not an STL file: it is compressed by gzip"));
        let absurd = [&whole[..80], &[0xFF; 4], &whole[84..]].concat();
        assert!(refusal(&absurd).contains("after 2 of the 4294967295 triangles"));
    }
}
