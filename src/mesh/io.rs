//! Mesh files by their extension: what reading gives, what is written.
//!
//! The readers refuse what is not their format, with the line. They do not judge the mesh: indices beyond the last
//! vertex, coordinates that are not finite, and so on, are for [`validate`](super::validate) to collect.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::Path;
use std::str::FromStr;

use glam::DVec3;

use super::attributes::Attributes;
use super::features::Tags;
use super::file_tags::{FileTags, Subdivision};
use super::usd::StageMetadata;
use super::validate::Boundary;
use super::{Mesh, gltf, obj, obj_normals, off, ply, stl, usd};
use crate::memory::require;
use crate::output::write_file;
use crate::text::parts::write_in_parts;
use crate::text::{push_point, push_unsigned};
use crate::{Error, Result, names, pages, parallel};

/// Bytes by which a format is told, before the rest is read.
const HEAD: usize = 1 << 16;

/// Bytes that a thread reads at once.
const READ_AT_ONCE: usize = 1 << 20;

/// A mesh with what its file tells about it.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// The path as it was given.
    pub name: String,
    /// Positions and faces as in the file, numbered from 0; not validated.
    pub mesh: Mesh,
    /// Where each vertex and face stands; `None` for binary files and glTF.
    pub lines: Option<Lines>,
    /// One normal a vertex, as in the file: not checked, not normalised. OFF, PLY and USD only; for OBJ see
    /// [`read_normals`].
    pub normals: Option<Vec<DVec3>>,
    /// What is sharp. OBJ and USD only.
    pub tags: FileTags,
    /// Texture coordinates, normals of corners, groups, materials. OBJ only.
    pub attributes: Attributes,
    /// The scheme that the file is made for, if it says that. USD only.
    pub subdivision: Option<Subdivision>,
    /// What holds for all coordinates of the file. USD and glTF only.
    pub stage: StageMetadata,
    /// CRC-32 of the bytes of the file, as zlib has it; `None` from the readers of one format. Of a `.gltf` without its
    /// buffers.
    pub checksum: Option<u32>,
    /// What a user should know, a sentence each: above all what the file holds and the mesh does not keep.
    pub remarks: Vec<String>,
}

/// The 1-based line of each vertex and of each face; lines beyond 2³² − 1 are given as that number.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Lines {
    /// One line a vertex.
    pub vertices: Vec<u32>,
    /// One line a face.
    pub faces: Vec<u32>,
}

/// The formats of mesh files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Wavefront OBJ, `.obj`.
    Obj,
    /// Object File Format, `.off`.
    Off,
    /// Stanford polygon file format, `.ply`: text and binary are read.
    Ply,
    /// USD as text, `.usda`.
    Usd,
    /// Stereolithography, `.stl`: text and binary. Not written.
    Stl,
    /// glTF 2.0, `.glb` and `.gltf`. Not written.
    Gltf,
}

/// What is written with a mesh beside positions and faces, and how. The default is nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct WriteOptions<'a> {
    /// One a vertex.
    pub normals: Option<&'a [DVec3]>,
    /// The scheme that refines a control mesh. USD only.
    pub subdivision: Subdivision,
    /// Sharp edges and vertices, and the rule of the boundary. OBJ and USD only.
    pub tags: Option<&'a Tags>,
    /// What the file of the mesh, whose faces these are, said of them. OBJ only.
    pub attributes: Option<&'a Attributes>,
    /// What holds for all coordinates of the file. USD only.
    pub stage: StageMetadata,
    /// PLY as text; the other formats always are.
    pub ascii: bool,
    /// Lines without line ends that stand near the top of the file, for people.
    pub comments: &'a [String],
}

impl WriteOptions<'_> {
    /// Writes each comment as a line that opens with `sign`.
    pub(crate) fn write_comments(&self, out: &mut dyn Write, sign: &str) -> io::Result<()> {
        self.comments.iter().try_for_each(|comment| writeln!(out, "{sign} {comment}"))
    }
}

impl FromStr for Format {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let all = [
            ("off", Format::Off),
            ("obj", Format::Obj),
            ("ply", Format::Ply),
            ("usda", Format::Usd),
            ("stl", Format::Stl),
            ("gltf", Format::Gltf),
        ];
        names::find("format", text, &all, &[("usd", Format::Usd), ("glb", Format::Gltf)])
    }
}

impl Format {
    /// The format that the ending of a name tells.
    ///
    /// # Errors
    /// [`Error::Parse`] for an unknown ending, and for none, but for names in `/dev`, which are taken for OBJ.
    pub fn of(path: &Path) -> Result<Self> {
        let extension = path.extension().unwrap_or_default().to_string_lossy();
        match extension.to_ascii_lowercase().as_str() {
            "obj" => Ok(Format::Obj),
            "off" => Ok(Format::Off),
            "ply" => Ok(Format::Ply),
            "usda" => Ok(Format::Usd),
            "stl" => Ok(Format::Stl),
            "glb" | "gltf" => Ok(Format::Gltf),
            "usd" | "usdc" | "usdz" => {
                Err(Error::parse(path, None, "USD is read and written as text only: let the name end in .usda"))
            }
            // Standard streams, and the pipes that shells make, have names without ending.
            "" if path.starts_with("/dev") => Ok(Format::Obj),
            _ => {
                let what = "not a known mesh format: the name must end in .usda, .obj, .off or .ply; .stl, .glb and \
                            .gltf are read";
                Err(Error::parse(path, None, what))
            }
        }
    }

    /// As [`of`](Self::of), for a mesh that is written.
    ///
    /// # Errors
    /// [`Error::Parse`] for a format that is read only, too.
    pub fn of_output(path: &Path) -> Result<Self> {
        Self::of(path)?.written(path)
    }

    /// This format, for a mesh that is written; `path` is for the message.
    ///
    /// # Errors
    /// [`Error::Parse`] for a format that is read only.
    pub fn written(self, path: &Path) -> Result<Self> {
        match self {
            Format::Obj | Format::Off | Format::Ply | Format::Usd => return Ok(self),
            Format::Stl | Format::Gltf => {}
        }
        // Both have triangles alone, and as many copies of a vertex as it has faces or normals.
        let what = "STL and glTF are read and not written, for they keep neither quads nor vertices: choose .usda, .obj, \
                    .off or .ply";
        Err(Error::parse(path, None, what))
    }

    /// Memory for each byte of a file while it is read, itself included; measured on the densest files: binary, of
    /// positions and triangles alone.
    fn memory_per_byte(self) -> u64 {
        match self {
            Format::Obj | Format::Off | Format::Ply | Format::Usd => 3,
            Format::Stl => 5,
            Format::Gltf => 8,
        }
    }

    /// Reads a file.
    fn read_file(self, path: &Path) -> Result<Vec<u8>> {
        let refused = |e| Error::io(path, "read", e);
        let file = File::open(path).map_err(refused)?;
        let found = file.metadata().map_err(refused)?;
        if !found.is_file() {
            return self.read_all(file, path);
        }
        let head = self.read_head(&file, path)?;
        if head.len() < HEAD {
            return Ok(head);
        }
        self.require_room(found.len(), path)?;
        read_whole(&file, head, found.len()).map_err(refused)
    }

    /// Reads all bytes of a stream, only if the first can be of this format and memory has room for the mesh.
    fn read_all(self, mut source: impl Read, path: &Path) -> Result<Vec<u8>> {
        let mut bytes = self.read_head(&mut source, path)?;
        let mut there = 0;
        // As much again as is there already, until there is no more.
        while bytes.len() >= HEAD.max(2 * there) {
            there = bytes.len();
            self.require_room(2 * there as u64, path)?;
            source.by_ref().take(there as u64).read_to_end(&mut bytes).map_err(|e| Error::io(path, "read", e))?;
        }
        Ok(bytes)
    }

    /// Reads the first bytes, [`HEAD`] unless there are fewer, and refuses what cannot be of this format.
    fn read_head(self, source: impl Read, path: &Path) -> Result<Vec<u8>> {
        let mut bytes = Vec::new();
        source.take(HEAD as u64).read_to_end(&mut bytes).map_err(|e| Error::io(path, "read", e))?;
        if bytes.len() < HEAD {
            return Ok(bytes);
        }
        // Whole lines, unless the last is longer than a header's lines are.
        let end = bytes.iter().rev().take(1 << 12).position(|&b| matches!(b, b'\n' | b'\r'));
        let lines = bytes.len() - end.unwrap_or(0);
        match self {
            Format::Obj => obj::check_head(&bytes[..lines], path),
            Format::Off => off::check_head(&bytes[..lines], path),
            Format::Ply => ply::check_head(&bytes[..lines], path),
            Format::Usd => usd::check_head(&bytes[..lines], path),
            Format::Stl => stl::check_head(&bytes, path),
            Format::Gltf => gltf::check_head(&bytes, path),
        }?;
        Ok(bytes)
    }

    fn require_room(self, size: u64, path: &Path) -> Result<()> {
        require(
            self.memory_per_byte().saturating_mul(size),
            || format!("{}: the mesh", path.display()),
            "use a smaller one",
        )
    }

    fn parse(self, bytes: &[u8], path: &Path) -> Result<Loaded> {
        let loaded = match self {
            Format::Obj => obj::read_bytes(bytes, path),
            Format::Off => off::read_bytes(bytes, path),
            Format::Ply => ply::read_bytes(bytes, path),
            Format::Usd => usd::read_bytes(bytes, path),
            Format::Stl => stl::read_bytes(bytes, path),
            Format::Gltf => gltf::read_bytes(bytes, path),
        }?;
        Ok(Loaded { checksum: Some(checksum(bytes)), ..loaded })
    }
}

/// CRC-32, by parts.
fn checksum(bytes: &[u8]) -> u32 {
    let parts = parallel::map(bytes.len(), READ_AT_ONCE, |range| {
        let mut part = crc32fast::Hasher::new();
        part.update(&bytes[range]);
        part
    });
    let mut all = crc32fast::Hasher::new();
    parts.iter().for_each(|part| all.combine(part));
    all.finalize()
}

/// The bytes of a file of which `head` has been read, and which has `size` in all, as far as is known.
fn read_whole(mut file: &File, head: Vec<u8>, size: u64) -> io::Result<Vec<u8>> {
    let size = usize::try_from(size).unwrap_or(usize::MAX);
    let mut bytes = head;
    #[cfg(unix)]
    if let Some(rest) = size.checked_sub(bytes.len()) {
        use std::os::unix::fs::FileExt;
        // Memory that the system clears anyway, in large pages, by all threads.
        let head = std::mem::replace(&mut bytes, pages::large(vec![0; size]));
        let (start, end) = bytes.split_at_mut(head.len());
        start.copy_from_slice(&head);
        let mut results: Vec<io::Result<()>> = (0..rest.div_ceil(READ_AT_ONCE)).map(|_| Ok(())).collect();
        parallel::chunks_with(end, READ_AT_ONCE, &mut results, |first, part, result| {
            *result = file.read_exact_at(part, (head.len() + first) as u64);
        });
        match results.into_iter().collect::<io::Result<()>>() {
            Ok(()) => file.seek(SeekFrom::Start(size as u64)).map(|_| ())?,
            // It has become shorter.
            Err(e) if e.kind() == io::ErrorKind::UnexpectedEof => bytes = head,
            Err(e) => return Err(e),
        }
    }
    // What has been added since, or all.
    file.read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// Whether a name ends as mesh files do.
pub fn has_mesh_ending(path: &Path) -> bool {
    path.extension().is_some() && Format::of(path).is_ok()
}

/// Checks early that a file of this name can be written as a mesh.
///
/// # Errors
/// As [`Format::of_output`].
pub fn check_name(path: &Path) -> Result<()> {
    Format::of_output(path).map(|_| ())
}

/// Reads a mesh file, whose extension (`.obj`, `.off`, `.ply`, `.usda`, `.stl`, `.glb` or `.gltf` in any case) names its format;
/// what lies in `/dev` and has none is OBJ.
///
/// # Errors
/// [`Error::Io`] if the file cannot be read; [`Error::Parse`], with the line where there is one, if it is not what
/// its format says.
pub fn read(path: &Path) -> Result<Loaded> {
    let format = Format::of(path)?;
    format.parse(&format.read_file(path)?, path)
}

/// Reads a mesh from a stream, to its end, such as standard input; `name` is for messages.
///
/// # Errors
/// As [`read`].
///
/// ```
/// use limitlab::mesh::io::{Format, read_from};
/// let text = "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
/// let loaded = read_from(text.as_bytes(), Format::Off, "standard input".as_ref())?;
/// assert_eq!(loaded.mesh.len(), 3);
/// # Ok::<(), limitlab::Error>(())
/// ```
pub fn read_from(source: impl Read, format: Format, name: &Path) -> Result<Loaded> {
    format.parse(&format.read_all(source, name)?, name)
}

/// Reads the normals of a mesh file, one a vertex and zero for a vertex without, as in the file; `None` if it has none.
/// In an OBJ file all corners of a vertex must have the same.
///
/// # Errors
/// As [`read`], and for OBJ: a vertex whose corners have different normals, a corner that refers to a normal which is
/// not there.
pub fn read_normals(path: &Path) -> Result<Option<Vec<DVec3>>> {
    let format = Format::of(path)?;
    let Format::Obj = format else {
        return Ok(read(path)?.normals);
    };
    let bytes = format.read_file(path)?;
    let loaded = obj::read_bytes(&bytes, path)?;
    obj_normals::read(&bytes, path, loaded.mesh.len())
}

/// Writes a mesh file, with `normals` (one a vertex) if given, in the format that the extension names. All doubles
/// read back equal, but from USD, which holds [nine digits](usd::write_control_to). The file appears as a whole or not at
/// all ([`write_file`]).
///
/// # Errors
/// As [`Format::of_output`]; [`Error::Io`] if the file cannot be written.
///
/// # Panics
/// If there are not as many normals as vertices.
pub fn write(path: &Path, mesh: &Mesh, normals: Option<&[DVec3]>) -> Result<()> {
    write_control(path, mesh, &WriteOptions { normals, ..WriteOptions::default() })
}

/// As [`write()`], a control mesh: with what of `options` the format has. [`left_out`] says what it has not.
///
/// # Errors
/// As [`write()`].
///
/// # Panics
/// If there are not as many normals as vertices.
pub fn write_control(path: &Path, mesh: &Mesh, options: &WriteOptions) -> Result<()> {
    let format = Format::of_output(path)?;
    write_file(path, |out| write_control_to(out, format, mesh, options))
}

/// As [`write_control`], to a stream.
///
/// # Errors
/// Those of the stream.
///
/// # Panics
/// If there are not as many normals as vertices; if the format is [not written](Format::written).
pub fn write_control_to(out: &mut dyn Write, format: Format, mesh: &Mesh, options: &WriteOptions) -> io::Result<()> {
    match format {
        Format::Obj => obj::write_control_to(out, mesh, options),
        Format::Off => off::write_control_to(out, mesh, options),
        Format::Ply => ply::write_control_to(out, mesh, options),
        Format::Usd => usd::write_control_to(out, mesh, options),
        Format::Stl | Format::Gltf => panic!("a format that is written"),
    }
}

/// What a reader of the file would miss, because the format has no place for it: a sentence each.
pub fn left_out(format: Format, options: &WriteOptions) -> Vec<String> {
    let mut left_out = Vec::new();
    let has_sharp = options.tags.is_some_and(|tags| !(tags.creases.is_empty() && tags.corners.is_empty()));
    // Edge-and-corner is what is taken where a file says nothing.
    let has_rule = options.tags.is_some_and(|t| matches!(t.boundary, Boundary::EdgeOnly | Boundary::AsInterior));
    match format {
        Format::Obj | Format::Usd | Format::Stl | Format::Gltf => {}
        Format::Off | Format::Ply if has_sharp => {
            left_out.push("creases and corners are not written: use .usda or .obj".into());
        }
        Format::Off | Format::Ply if has_rule => {
            left_out.push("the rule of the boundary is not written: use .usda or .obj".into());
        }
        Format::Off | Format::Ply => {}
    }
    match (format, options.attributes) {
        (Format::Off | Format::Ply | Format::Usd, Some(attributes)) if !attributes.is_empty() => {
            left_out.push(format!("not written: {attributes}: use .obj"));
        }
        (Format::Obj | Format::Off | Format::Ply | Format::Usd | Format::Stl | Format::Gltf, _) => {}
    }
    left_out
}

pub(super) fn check_normals(mesh: &Mesh, normals: Option<&[DVec3]>) {
    assert!(normals.is_none_or(|n| n.len() == mesh.len()), "one normal for each vertex");
}

/// Writes `rows` lines, whose text `push` appends.
pub(super) fn write_rows(
    out: &mut dyn Write,
    rows: usize,
    push: impl Fn(&mut Vec<u8>, usize) + Sync,
) -> io::Result<()> {
    write_in_parts(out, rows, &|rows, text| {
        for row in rows {
            push(text, row);
            text.push(b'\n');
        }
    })
}

/// Writes positions and faces as OFF and text PLY have them: `x y z` and, where there are normals, `nx ny nz`; then a face's
/// size and its vertices.
pub(super) fn write_text_rows(out: &mut dyn Write, mesh: &Mesh, normals: Option<&[DVec3]>) -> io::Result<()> {
    write_rows(out, mesh.len(), |text, v| {
        push_point(text, mesh.positions[v]);
        if let Some(normals) = normals {
            text.push(b' ');
            push_point(text, normals[v]);
        }
    })?;
    write_rows(out, mesh.faces.len(), |text, f| {
        let face = mesh.faces.face(f);
        push_unsigned(text, face.len() as u64);
        for &v in face {
            text.push(b' ');
            push_unsigned(text, u64::from(v));
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Faces;

    #[test]
    fn formats_are_known_by_extension() {
        let folder = tempfile::tempdir().unwrap();
        let mesh = Mesh::new(vec![DVec3::ZERO, DVec3::X, DVec3::Y], Faces::from_lists([[0, 1, 2]]));
        for name in ["a.obj", "a.OFF", "a.Ply", "a.Usda"] {
            let path = folder.path().join(name);
            write(&path, &mesh, None).unwrap();
            let loaded = read(&path).unwrap();
            assert_eq!(loaded.mesh, mesh);
            assert_eq!(loaded.name, path.display().to_string());
            assert!(loaded.remarks.is_empty(), "{:?}", loaded.remarks);
        }
        for name in ["/dev/stdout", "/dev/fd/63"] {
            check_name(Path::new(name)).unwrap();
        }
        for name in ["a.3ds", "obj", ".off", ""] {
            let path = folder.path().join(name);
            for error in [write(&path, &mesh, None).err(), read(&path).err()] {
                let text = error.unwrap().to_string();
                assert!(
                    text.ends_with("must end in .usda, .obj, .off or .ply; .stl, .glb and .gltf are read"),
                    "{text}"
                );
            }
        }
        for name in ["a.stl", "a.GLB", "a.gltf"] {
            let path = folder.path().join(name);
            for error in [write(&path, &mesh, None).err(), check_name(&path).err()] {
                let text = error.unwrap().to_string();
                assert!(text.contains("are read and not written"), "{text}");
            }
            assert!(!path.exists() && has_mesh_ending(&path));
        }
        for name in ["a.usd", "a.usdc", "a.USDZ"] {
            let text = check_name(Path::new(name)).unwrap_err().to_string();
            assert!(text.ends_with("let the name end in .usda"), "{text}");
        }
    }

    /// More than a thread reads and writes at once.
    #[test]
    fn large_files_are_read_and_written_whole() {
        let folder = tempfile::tempdir().unwrap();
        let mut mesh = crate::mesh::builtin::builtin("irregular-quad:40000").unwrap();
        crate::mesh::noise::add_noise(&mut mesh, 0.1, 1);
        for (ending, size) in [("obj", 3 << 20), ("off", 3 << 20), ("ply", 1 << 20)] {
            let path = folder.path().join(format!("a.{ending}"));
            write(&path, &mesh, None).unwrap();
            let loaded = read(&path).unwrap();
            assert!(loaded.mesh == mesh && loaded.remarks.is_empty(), "{ending}");
            let bytes = std::fs::read(&path).unwrap();
            assert!(bytes.len() > size);
            assert_eq!(loaded.checksum, Some(crc32fast::hash(&bytes)));
            let streamed = read_from(&bytes[..], ending.parse().unwrap(), &path).unwrap();
            assert!(streamed.mesh == mesh && streamed.lines == loaded.lines && streamed.checksum == loaded.checksum);
            if let Some(lines) = loaded.lines {
                let head = if ending == "off" { 2 } else { 0 };
                let first = head + mesh.len() as u32 + 1;
                assert!(lines.vertices.into_iter().eq(head + 1..first));
                assert!(lines.faces.into_iter().eq(first..first + mesh.faces.len() as u32));
            }
        }
    }

    #[test]
    fn missing_files_and_folders_are_errors_of_the_system() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.off");
        let text = read(&path).unwrap_err().to_string();
        assert!(text.contains("a.off: cannot read: "), "{text}");
        std::fs::create_dir(&path).unwrap();
        assert!(matches!(read(&path), Err(Error::Io { .. })));
    }

    #[test]
    fn a_large_file_of_another_kind_is_refused_by_its_first_bytes() {
        let folder = tempfile::tempdir().unwrap();
        for (start, told) in [
            ("", ["zero bytes"; 3]),
            ("ply\nformat text 1.0\n", ["it is a PLY file", "it is a PLY file", "\"text\" is not a PLY format"]),
            ("OFF\nx", ["it is an OFF file", "is not the number of vertices", "it is an OFF file"]),
            ("\x1F\u{8b}", ["is not an OBJ statement", "is not an OFF header", "first line is not \"ply\""]),
        ] {
            for (ending, told) in ["obj", "off", "ply"].into_iter().zip(told) {
                let path = folder.path().join(format!("a.{ending}"));
                std::fs::write(&path, start).unwrap();
                // Sparse, and more than there is memory for: refused without being read.
                File::options().write(true).open(&path).unwrap().set_len(1 << 34).unwrap();
                let text = read(&path).unwrap_err().to_string();
                assert!(text.contains(told), "{ending} {start:?}: {text}");
            }
        }
    }

    #[test]
    fn a_large_file_may_begin_with_a_long_comment() {
        let folder = tempfile::tempdir().unwrap();
        let comment = "x".repeat(200_000);
        let triangle = "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
        let ply = "property float x\nproperty float y\nproperty float z\nelement face 1\n\
                   property list uchar int vertex_indices\nend_header\n";
        for (name, text) in [
            ("a.obj", format!("# {comment}\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")),
            ("a.off", format!("# {comment}\nOFF\n3 1 0\n{triangle}")),
            ("a.ply", format!("ply\nformat ascii 1.0\ncomment {comment}\nelement vertex 3\n{ply}{triangle}")),
        ] {
            let path = folder.path().join(name);
            std::fs::write(&path, text).unwrap();
            assert_eq!(read(&path).unwrap().mesh.faces.len(), 1, "{name}");
        }
    }

    #[test]
    #[should_panic(expected = "one normal for each vertex")]
    fn normals_must_match_the_vertices() {
        check_normals(&Mesh::new(vec![DVec3::X], Faces::default()), Some(&[]));
    }
}
