//! A mesh as readers make it: bounded by 32-bit indices and by the bytes that are there, whole or in parts.

use std::path::Path;

use glam::DVec3;

use super::attributes::Attributes;
use super::file_tags::FileTags;
use super::io::{Lines, Loaded};
use super::usd::StageMetadata;
use super::weld::{Welded, weld};
use super::{Faces, Mesh};
use crate::{pages, parallel};

/// What is wrong with a face of fewer than three corners.
pub(super) fn few_corners(face: usize, size: usize) -> String {
    let s = if size == 1 { "" } else { "s" };
    format!("face {face} has {size} corner{s}, a face needs at least 3: remove it")
}

/// A mesh while it is read, within the limits of 32-bit indices. What is refused is said without the place, which
/// the reader knows.
pub(super) struct Builder {
    /// Vertices, faces and corners of the parts of the file before, if this is a part.
    before: [usize; 3],
    positions: Vec<DVec3>,
    offsets: Vec<u32>,
    corners: Vec<u32>,
    lines: Option<Lines>,
}

impl Builder {
    /// `lines` is empty, or `None` where they are not kept.
    pub fn new(lines: Option<Lines>) -> Self {
        Builder { before: [0; 3], positions: Vec::new(), offsets: vec![0], corners: Vec::new(), lines }
    }

    /// Forgets what was read, to read a part of a file that has so many vertices, faces and corners before it.
    pub fn begin_part(&mut self, before: [usize; 3]) {
        self.before = before;
        self.positions.clear();
        self.offsets.truncate(1);
        self.corners.clear();
        if let Some(lines) = &mut self.lines {
            lines.vertices.clear();
            lines.faces.clear();
        }
    }

    /// Another one that keeps lines if this does.
    pub fn empty(&self) -> Self {
        Builder::new(self.lines.is_some().then(Lines::default))
    }

    /// Vertices, faces and corners so far, with those before the part.
    pub fn counts(&self) -> [usize; 3] {
        let here = [self.positions.len(), self.offsets.len() - 1, self.corners.len()];
        [0, 1, 2].map(|k| self.before[k] + here[k])
    }

    /// Adds the parts that follow, whose lines are counted from one after `lines[k]`, and makes room for `times` as much. If
    /// they are more than 32-bit indices can name, nothing is added, and the answer is no.
    pub fn append(&mut self, parts: &[&Builder], lines: &[usize], times: f64) -> bool {
        let [vertices, faces, corners]: [usize; 3] =
            [0, 1, 2].map(|k| parts.iter().map(|part| part.counts()[k] - part.before[k]).sum());
        let before = self.corners.len();
        if (self.positions.len() + vertices).max(before + corners) > u32::MAX as usize {
            return false;
        }
        make_room(&mut self.positions, vertices, times);
        make_room(&mut self.corners, corners, times);
        make_room(&mut self.offsets, faces, times);
        if let Some(lines) = &mut self.lines {
            make_room(&mut lines.vertices, vertices, times);
            make_room(&mut lines.faces, faces, times);
        }
        fn of<'a, T>(parts: &[&'a Builder], array: impl Fn(&'a Builder) -> &'a [T]) -> Vec<&'a [T]> {
            parts.iter().map(|part| array(part)).collect()
        }
        let starts = parallel::starts(parts.iter().map(|part| part.corners.len()));
        parallel::append_parts(&mut self.positions, &of(parts, |part| &part.positions), |_, p| p);
        parallel::append_parts(&mut self.corners, &of(parts, |part| &part.corners), |_, v| v);
        parallel::append_parts(&mut self.offsets, &of(parts, |part| &part.offsets[1..]), |k, end| {
            end + (before + starts[k]) as u32
        });
        if let Some(all) = &mut self.lines {
            let shifted = |k: usize, line: u32| saturate(lines[k] + line as usize);
            let of_parts = || parts.iter().filter_map(|part| part.lines.as_ref());
            let [vertices, faces] =
                [Vec::from_iter(of_parts().map(|l| &l.vertices[..])), Vec::from_iter(of_parts().map(|l| &l.faces[..]))];
            parallel::append_parts(&mut all.vertices, &vertices, shifted);
            parallel::append_parts(&mut all.faces, &faces, shifted);
        }
        true
    }

    /// Makes room for the vertices that a header announces, at most as many as the file can still hold, so that an
    /// absurd count asks for no memory.
    pub fn reserve_vertices(&mut self, count: u64, at_most: usize) {
        let count = capped(count, at_most);
        make_room(&mut self.positions, count, 1.0);
        if let Some(lines) = &mut self.lines {
            make_room(&mut lines.vertices, count, 1.0);
        }
    }

    /// The same for faces.
    pub fn reserve_faces(&mut self, count: u64, at_most: usize) {
        let count = capped(count, at_most);
        make_room(&mut self.offsets, count, 1.0);
        // Quads, as triangles take no more than address space for it.
        make_room(&mut self.corners, 4 * count, 1.0);
        if let Some(lines) = &mut self.lines {
            make_room(&mut lines.faces, count, 1.0);
        }
    }

    /// Those of the parts before too, as everywhere where nothing else is said.
    pub fn vertices(&self) -> usize {
        self.before[0] + self.positions.len()
    }

    pub fn faces(&self) -> usize {
        self.before[1] + self.offsets.len() - 1
    }

    /// Those of this part alone, and of the face being read too.
    pub fn corners(&self) -> usize {
        self.corners.len()
    }

    /// Takes back the corners from the `first` on, of a face that is not ended.
    pub fn forget_corners(&mut self, first: usize) {
        self.corners.truncate(first);
    }

    #[inline]
    pub fn vertex(&mut self, position: DVec3, line: usize) -> std::result::Result<(), String> {
        if self.vertices() == u32::MAX as usize {
            return Err("more vertices than 32-bit indices can name, 4294967295".into());
        }
        self.positions.push(position);
        if let Some(lines) = &mut self.lines {
            lines.vertices.push(saturate(line));
        }
        Ok(())
    }

    /// Adds a corner to the face that the next [`end_face`](Self::end_face) closes.
    pub fn corner(&mut self, vertex: u32) {
        self.corners.push(vertex);
    }

    #[inline]
    pub fn end_face(&mut self, line: usize) -> std::result::Result<(), String> {
        let size = self.corners.len() - self.offsets[self.offsets.len() - 1] as usize;
        if size < 3 {
            return Err(few_corners(self.faces(), size));
        }
        if self.before[2] + self.corners.len() > u32::MAX as usize {
            return Err("more face corners than 32-bit indices can name, 4294967295".into());
        }
        self.offsets.push(self.corners.len() as u32);
        if let Some(lines) = &mut self.lines {
            lines.faces.push(saturate(line));
        }
        Ok(())
    }

    pub fn finish(self, path: &Path, normals: Option<Vec<DVec3>>, remarks: Vec<String>) -> Loaded {
        Loaded {
            name: path.display().to_string(),
            mesh: Mesh::new(self.positions, Faces::from_parts(self.offsets, self.corners)),
            lines: self.lines,
            normals,
            tags: FileTags::default(),
            attributes: Attributes::default(),
            subdivision: None,
            stage: StageMetadata::default(),
            checksum: None,
            remarks,
        }
    }
}

/// Makes one vertex of those at one position, for formats that split them, in the order of the first at each; `what` says what
/// was split, and `why`.
pub(super) fn joined(loaded: Loaded, what: &str, why: &str) -> Loaded {
    let before = loaded.mesh.len();
    let Welded { mesh, place } = weld(&loaded.mesh);
    if mesh.len() == before {
        return loaded;
    }
    let lines = loaded.lines.map(|mut lines| {
        let mut next = 0;
        let mut place = place.iter();
        lines.vertices.retain(|_| {
            let is_first = place.next() == Some(&next);
            next += u32::from(is_first);
            is_first
        });
        lines
    });
    let mut remarks = loaded.remarks;
    remarks.push(format!("{before} {what} lie at {} positions, each of which is one vertex: {why}", mesh.len()));
    Loaded { mesh, lines, remarks, ..loaded }
}

/// Makes room for `more` items, and at once for `times` as many where there is none: to move a large array takes longer than to
/// make it.
fn make_room<T>(vector: &mut Vec<T>, more: usize, times: f64) {
    if vector.capacity() - vector.len() < more {
        vector.reserve(more.max((more as f64 * times) as usize));
        *vector = pages::large(std::mem::take(vector));
    }
}

fn capped(count: u64, at_most: usize) -> usize {
    usize::try_from(count).unwrap_or(usize::MAX).min(at_most)
}

fn saturate(line: usize) -> u32 {
    u32::try_from(line).unwrap_or(u32::MAX)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::Result;
    use crate::mesh::{obj, off, ply};

    /// A mesh with all that is told about it, or the message.
    fn told(result: Result<Loaded>) -> String {
        result.map_or_else(|error| error.to_string(), |loaded| format!("{loaded:?}"))
    }

    const STATEMENTS: [&str; 36] = [
        "v 0 0 0",
        "v 1.5 -2e3 .5",
        "v 1 2 3 0.5",
        "v\t1 2\\",
        "3",
        "vt 0.25 1 # a",
        "vn 0 0 1",
        "vt 1 \\",
        "f 1 2 3",
        "f 1 2 3 4 ",
        "f -1 -2 -3",
        "f 1/1/1 2/2/2 3//1",
        "f 1/-1/-1 2/1 -2//-1",
        " f 2 1 4294967295 # all",
        "f 1 2 \\",
        "3 # b",
        "f 1 2",
        "f 1 2 0",
        "f 1/x 2 3",
        "f -9 1 2",
        "v 1 2 x",
        "v 1 2",
        "g a \\",
        "usemtl c:\\d\\",
        "o b",
        "s off",
        "l 1 2",
        "blob 1",
        "blob \\",
        "t crease 2/1/0 0 1 10",
        "t corner 1/1/0 0 2.5",
        "t interpolateboundary 1/0/0 2",
        "t crease 2/1 0",
        "# c \\",
        "",
        " \t",
    ];
    const ROWS: [&str; 12] = [
        "0 0 0",
        "1 2.5 -3e1 ",
        "1 2",
        "1 2 x",
        "0 0 0 255 0 0",
        "0 0 0 0 1 0 9 9 9",
        "",
        "# a",
        "\t0 1 0 # b",
        "3 0 1 2",
        "4 0 1 2 3",
        "0 0 0 1 1 1",
    ];
    const FACES: [&str; 9] =
        ["3 0 1 2", "4 0 1 2 3 ", "3 2 1 0 1 0 0", "3 0 1", "2 0 1", "3 0 1 -2", " # b", "", "5 0 1 2 3 4"];

    proptest! {
        /// However a file is cut, its mesh, lines and remarks are the same, or what is wrong with it.
        #[test]
        fn parts_of_all_sizes_give_the_same_mesh_or_message(
            statements in prop::collection::vec(prop::sample::select(&STATEMENTS[..]), 0..30),
            plain in prop::collection::vec(prop::sample::select(&["v 0 0 1", "v 1 2 3", "f 1 2 3", "f -1 1 2", "vt 1", "f 1/1 2/-1 1", "g x"][..]), 0..30),
            rows in prop::collection::vec((prop::sample::select(&ROWS[..]), 0..4usize), 0..20),
            faces in prop::collection::vec((prop::sample::select(&FACES[..]), 0..4usize), 0..20),
            wrong in (-1..=1i64, -1..=1i64),
            end in prop::sample::select(&["\n", "\r\n", "\r", "\n\r", "\n\n", " \n#\n"][..]),
            header in prop::sample::select(&["OFF", "COFF", "NOFF", "CNOFF"][..]),
            size in 1..120usize,
            cut in 0..3usize,
        ) {
            // Three in four rows are what nearly all files have.
            let usual = |rows: &[(&str, usize)], usual: &str| -> Vec<String> {
                rows.iter().map(|&(odd, k)| if k == 0 { odd } else { usual }.to_owned()).collect()
            };
            let row = if header == "OFF" { "0.5 1 2" } else { "0.5 1 2 0 0 1" };
            let (rows, faces) = (usual(&rows, row), usual(&faces, "3 0 1 2"));
            let count = |rows: &[String], wrong: i64| {
                let there = rows.iter().filter(|row| !matches!(row.trim_ascii().bytes().next(), None | Some(b'#'))).count();
                (there as i64 + wrong).max(0)
            };
            let counts = (count(&rows, wrong.0), count(&faces, wrong.1));
            let off = vec![header.to_owned(), format!("{} {} 0", counts.0, counts.1)];
            let ply = format!("ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty double y\nproperty int z\n\
                              element face {}\nproperty list uchar int vertex_index\nend_header", counts.0, counts.1);
            let ply = ply.lines().map(str::to_owned).collect();
            for (name, read, head, body) in [
                ("a.obj", obj::read_in_parts as fn(&[u8], &Path, usize) -> Result<Loaded>, Vec::new(), Vec::from_iter(statements.iter().map(|&s| s.to_owned()))),
                ("b.obj", obj::read_in_parts, Vec::new(), Vec::from_iter(plain.iter().map(|&s| s.to_owned()))),
                ("a.off", off::read_in_parts, off, [rows.clone(), faces.clone()].concat()),
                ("a.ply", ply::read_in_parts, ply, [rows, faces].concat()),
            ] {
                let text = [head, body].concat().join(end) + end;
                let bytes = &text.as_bytes()[..text.len().saturating_sub(cut)];
                let one = told(read(bytes, Path::new(name), usize::MAX));
                prop_assert_eq!(told(read(bytes, Path::new(name), size)), one, "{}: {:?}", name, text);
            }
        }

        /// Rows of a table that could be rows of the one before.
        #[test]
        fn a_part_ends_with_its_table(vertices in 3..12usize, faces in 1..12usize, size in 1..120usize) {
            let mut text = format!("ply\nformat ascii 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\nproperty float \
                z\nproperty int w\nelement face {faces}\nproperty list uchar int vertex_index\nend_header\n");
            text += &"3 0 1 2\n".repeat(vertices + faces);
            let loaded = ply::read_in_parts(text.as_bytes(), Path::new("a.ply"), size).unwrap();
            prop_assert_eq!((loaded.mesh.len(), loaded.mesh.faces.len()), (vertices, faces));
        }

        #[test]
        fn parts_of_binary_files_give_the_same_mesh_or_message(
            faces in prop::collection::vec(prop::collection::vec(0..9u32, 2..6), 0..30),
            points in prop::collection::vec(-9..9i32, 0..30),
            big: bool,
            size in 1..100usize,
            cut in 0..40usize,
        ) {
            let order = |x: u32| if big { x.to_be_bytes() } else { x.to_le_bytes() };
            let format = if big { "big" } else { "little" };
            let mut bytes = format!("ply\nformat binary_{format}_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty \
                float z\nelement face {}\nproperty uchar a\nproperty list uchar uint vertex_index\nend_header\n", points.len(), faces.len()).into_bytes();
            for &x in &points {
                [x, 2 * x, -x].iter().for_each(|&x| bytes.extend_from_slice(&order((x as f32).to_bits())));
            }
            for face in &faces {
                bytes.extend_from_slice(&[7, face.len() as u8]);
                face.iter().for_each(|&v| bytes.extend_from_slice(&order(v)));
            }
            bytes.truncate(bytes.len() - cut.saturating_sub(30).min(bytes.len()));
            let one = told(ply::read_in_parts(&bytes, Path::new("a.ply"), usize::MAX));
            prop_assert_eq!(told(ply::read_in_parts(&bytes, Path::new("a.ply"), size)), one);
        }
    }

    #[test]
    fn room_is_bounded_by_the_bytes_that_are_there() {
        let mut builder = Builder::new(Some(Lines::default()));
        builder.reserve_vertices(u64::MAX, 100);
        builder.reserve_faces(u64::MAX, 100);
        assert!(builder.positions.capacity() < 1000);
        assert!(builder.corners.capacity() < 1000);
    }
}
