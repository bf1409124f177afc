//! glTF 2.0, as Blender and most exporters write it: `.glb`, and `.gltf` with its buffers in files beside or in itself.

mod buffers;
mod document;
#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use glam::DVec3;

use super::builder::{Builder, joined};
use super::io::Loaded;
use super::magic::other_kind;
use super::usd::StageMetadata;
use crate::{Error, Result};
use buffers::{Buffers, Container, FLOAT, UNSIGNED_BYTE, UNSIGNED_INT, UNSIGNED_SHORT};
use document::{Document, Primitive};

const TRIANGLES: u64 = 4;

/// Reads the bytes of a `.glb` or `.gltf` file; `path` is for messages, and buffers in files of their own lie beside it.
///
/// The file has one mesh, of any number of primitives that are triangles, each with an accessor `POSITION` and, unless every three
/// vertices are a triangle, `indices`. The node that places the mesh has its transform and those above it applied, in double
/// precision; where these mirror, faces are turned over, as the specification says. Vertices at one position, to the last bit, are
/// one, in the order of the first, for glTF splits a vertex wherever normals or texture coordinates differ; this is remarked, and so
/// is what is not kept: other attributes, materials, skins and morph targets, points and lines. O(N log N).
///
/// # Errors
/// [`Error::Parse`] with the line of the JSON or the part of it, such as `accessors[3]`: no mesh, several (by name), or one that several
/// nodes place; strips and fans; a required extension that is not about looks, such as Draco's compression; sparse accessors;
/// what reaches beyond its view, buffer or vertices; a buffer that cannot be read.
///
/// ```
/// // Three points and a triangle without indices.
/// let text = r#"{
///     "asset": {"version": "2.0"},
///     "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
///     "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
///     "bufferViews": [{"buffer": 0, "byteLength": 36}],
///     "buffers": [{"byteLength": 36, "uri":
///         "data:;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]
/// }"#;
/// let loaded = limitlab::mesh::gltf::read_bytes(text.as_bytes(), "a.gltf".as_ref())?;
/// assert_eq!(loaded.mesh.faces.face(0), [0, 1, 2]);
/// assert_eq!(loaded.mesh.positions[1].to_array(), [1.0, 0.0, 0.0]);
/// # Ok::<(), limitlab::Error>(())
/// ```
pub fn read_bytes(bytes: &[u8], path: &Path) -> Result<Loaded> {
    check_head(bytes, path)?;
    let container = Container::of(bytes, path)?;
    let document = container.document(path)?;
    let refused = |what: String| Error::parse(path, None, what);
    let (mesh, transform, mut remarks) = document.placed_mesh().map_err(refused)?;
    let buffers = Buffers::load(&document, container.binary, path)?;
    let mut scene =
        Reader { document: &document, buffers: &buffers, builder: Builder::new(None), first: BTreeMap::new() };
    let (mut not_kept, mut others) = (BTreeSet::new(), 0);
    for (p, primitive) in mesh.primitives.iter().enumerate() {
        let place = format!("meshes[0].primitives[{p}]");
        not_kept.extend(primitive.not_kept());
        match primitive.mode.unwrap_or(TRIANGLES) {
            0..TRIANGLES => others += 1,
            TRIANGLES => scene
                .triangles(primitive, transform.determinant() < 0.0)
                .map_err(|what| refused(format!("{place}: {what}")))?,
            mode @ (5 | 6) => {
                let what = format!("{place}: mode {mode}, strips and fans are not read: export triangles");
                return Err(refused(what));
            }
            mode => return Err(refused(format!("{place}: {mode} is no mode of glTF"))),
        }
    }
    if others > 0 {
        not_kept.insert(format!("primitives of points and lines ({others})"));
    }
    if !not_kept.is_empty() {
        remarks.push(format!("not kept: {}", Vec::from_iter(not_kept).join(", ")));
    }
    let mut loaded = scene.builder.finish(path, None, remarks);
    if transform != glam::DMat4::IDENTITY {
        for p in &mut loaded.mesh.positions {
            *p = transform.transform_point3(*p);
        }
    }
    // The format has them so: metres, and y upward.
    loaded.stage = StageMetadata { is_z_up: Some(false), meters_per_unit: Some(1.0) };
    Ok(joined(loaded, "vertices", "glTF splits them where normals or texture coordinates differ"))
}

/// Refuses the first bytes of a file if they are neither those of binary glTF nor of JSON.
pub(super) fn check_head(head: &[u8], path: &Path) -> Result<()> {
    if head.starts_with(buffers::MAGIC) || head.trim_ascii_start().starts_with(b"{") {
        return Ok(());
    }
    let what = other_kind(head).unwrap_or("it begins neither as .glb does, with \"glTF\", nor as JSON, with \"{\"");
    Err(Error::parse(path, None, format!("not a glTF file: {what}")))
}

struct Reader<'a> {
    document: &'a Document,
    buffers: &'a Buffers<'a>,
    builder: Builder,
    /// The first vertex of each accessor of positions, which primitives may share.
    first: BTreeMap<usize, usize>,
}

impl Reader<'_> {
    fn triangles(&mut self, primitive: &Primitive, mirrored: bool) -> std::result::Result<(), String> {
        let accessor = *primitive.attributes.get("POSITION").ok_or("it has no POSITION")?;
        let points = self.buffers.elements(self.document, accessor, "VEC3", &[FLOAT])?;
        let first = match self.first.get(&accessor) {
            Some(&first) => first,
            None => {
                let first = self.builder.vertices();
                self.builder.reserve_vertices(points.count as u64, points.count);
                for i in 0..points.count {
                    let [x, y, z] = [0, 1, 2].map(|k| points.float(i, k));
                    self.builder.vertex(DVec3::new(x, y, z), 0)?;
                }
                self.first.insert(accessor, first);
                first
            }
        };
        let kinds = [UNSIGNED_BYTE, UNSIGNED_SHORT, UNSIGNED_INT];
        let indices = match primitive.indices {
            Some(index) => Some((index, self.buffers.elements(self.document, index, "SCALAR", &kinds)?)),
            None => None,
        };
        let count = indices.as_ref().map_or(points.count, |(_, elements)| elements.count);
        if !count.is_multiple_of(3) {
            return Err(format!("its {count} corners are no whole number of triangles"));
        }
        let order = if mirrored { [0, 2, 1] } else { [0, 1, 2] };
        self.builder.reserve_faces((count / 3) as u64, count);
        for triangle in 0..count / 3 {
            for k in order.map(|k| 3 * triangle + k) {
                let vertex = match &indices {
                    None => k,
                    Some((index, elements)) => match elements.unsigned(k) as usize {
                        vertex if vertex < points.count => vertex,
                        vertex => {
                            return Err(format!(
                                "index {k} of accessors[{index}] is {vertex}, and there are {} vertices",
                                points.count
                            ));
                        }
                    },
                };
                self.builder.corner((first + vertex) as u32);
            }
            self.builder.end_face(0)?;
        }
        Ok(())
    }
}
