//! The normals of an OBJ file, which stand at the corners of its faces, as normals of vertices.

use std::path::Path;

use glam::DVec3;

use super::obj::{parsed, skip_blanks, skip_statement};
use crate::text::Scanner;
use crate::{Error, Result};

/// The normal of each of the `vertices`, zero for one without; as in the file, not normalised. `None` if no corner has
/// a normal.
///
/// # Errors
/// [`Error::Parse`] with the line: a component that is no number, a corner whose normal or vertex the file lacks, and a
/// vertex whose corners have different normals, as across a sharp edge.
pub(super) fn read(bytes: &[u8], path: &Path, vertices: usize) -> Result<Option<Vec<DVec3>>> {
    let mut s = Scanner::new(bytes, path);
    let mut normals: Vec<DVec3> = Vec::new();
    // Vertices read so far, which negative references count back from; corners with a normal, and their lines.
    let mut seen = 0;
    let mut corners: Vec<(u64, u64, usize)> = Vec::new();
    loop {
        s.skip_space();
        skip_blanks(&mut s);
        if s.at_end() {
            break;
        }
        if s.at_line_end() {
            continue;
        }
        let line = s.line();
        let keyword = s.peek_token();
        match keyword {
            b"v" => seen += 1,
            b"vn" => {
                s.advance(2);
                let mut normal = DVec3::ZERO;
                for axis in 0..3 {
                    skip_blanks(&mut s);
                    normal[axis] = s.number().ok_or_else(|| {
                        let number = normals.len() + 1;
                        s.unexpected(format_args!("component {} of vn {number}", axis + 1))
                    })?;
                }
                normals.push(normal);
            }
            b"f" => {
                s.advance(1);
                loop {
                    skip_blanks(&mut s);
                    if s.at_line_end() {
                        break;
                    }
                    let token = s.peek_token();
                    let (vertex, references) =
                        token.split_at(token.iter().position(|&b| b == b'/').unwrap_or(token.len()));
                    let vertex = std::str::from_utf8(vertex).ok().and_then(|v| v.parse().ok());
                    if let (Some(vertex), [_, Some(normal)]) = (vertex, parsed(references)) {
                        let place = |reference: i64, count: usize| {
                            let index = if reference < 0 { count as i64 + reference } else { reference - 1 };
                            u64::try_from(index).unwrap_or(u64::MAX)
                        };
                        corners.push((place(vertex, seen), place(normal, normals.len()), line));
                    }
                    s.advance(token.len());
                }
            }
            _ => {}
        }
        skip_statement(&mut s, keyword);
    }
    if corners.is_empty() {
        return Ok(None);
    }
    let mut found = vec![None; vertices];
    for (vertex, normal, line) in corners {
        let refuse = |what: String| Err(Error::parse(path, Some(line), what));
        let at = usize::try_from(normal).ok().and_then(|i| normals.get(i));
        let place = usize::try_from(vertex).ok().and_then(|v| found.get_mut(v));
        let (Some(&normal), Some(place)) = (at, place) else {
            return refuse(format!(
                "a corner refers to a vertex or normal that the file lacks: it has {vertices} vertices and {} normals",
                normals.len()
            ));
        };
        if place.replace(normal).is_some_and(|before| before != normal) {
            return refuse(format!(
                "vertex {vertex} has different normals at its corners: shade the mesh smooth, or give a text file with \
                 lines `vertex nx ny nz`"
            ));
        }
    }
    let found = found.into_iter().map(Option::unwrap_or_default);
    Ok(Some(found.collect()))
}

#[cfg(test)]
mod tests {
    use super::*;

    const POINTS: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 9 9 9\n";

    fn parse(text: &str) -> Result<Option<Vec<DVec3>>> {
        read(format!("{POINTS}{text}").as_bytes(), Path::new("a.obj"), 4)
    }

    #[test]
    fn corners_of_all_forms_give_their_vertices_normals() {
        let text = "vn 0 0 1 # up\nvn 1 0 \\\n 0\nf 1//1 2/7/2 -2//-2\nf 1 2 3\nf 3//1 1//1 2//2\n";
        let found = parse(text).unwrap().unwrap();
        assert_eq!(found, [DVec3::Z, DVec3::X, DVec3::Z, DVec3::ZERO]);
        assert_eq!(parse("vn 0 0 1\nf 1 2/1 3\n").unwrap(), None);
    }

    #[test]
    fn every_text_comes_to_an_end() {
        for text in ["vn 0 0 1\nf 1//1 2//1 0\\x", "f 1//1 \\", "f \\ \n", "f 1 2 \\", "\\", "\\\n\\x\n"] {
            let _ = parse(text);
        }
    }

    #[test]
    fn errors_name_the_line() {
        for (text, what) in [
            ("vn 0 up 1\n", "line 5: \"up\" is not component 2 of vn 1"),
            ("vn 0 0 1\nf 1//2 2//1 3//1\n", "line 6: a corner refers"),
            ("vn 0 0 1\nf 1//-2 2//1 3//1\n", "line 6: a corner refers"),
            ("vn 0 0 1\nf 1//1 2//1 7//1\n", "line 6: a corner refers"),
            ("vn 0 0 1\nvn 1 0 0\nf 1//1 2//1 3//1\nf 1//2 2//1 3//1\n", "line 8: vertex 0 has different normals"),
        ] {
            let error = parse(text).unwrap_err().to_string();
            assert!(error.contains(what), "{error}");
        }
    }
}
