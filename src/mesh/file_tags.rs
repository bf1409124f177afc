//! Sharpness as mesh files tell it: sharp edges and vertices with the lines they stand on, the rule of the boundary, and
//! the scheme that a file was made for.

use std::fmt;
use std::path::Path;

use super::Surface;
use super::features::{Tags, checked};
use super::origin::Origin;
use super::validate::Boundary;
use crate::error::short;
use crate::{Error, Result};

/// What a file says is sharp. Vertices are in the mesh; whether edges are, is for [`checked`](Self::checked).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FileTags {
    /// What boundary edges are, if the file says it.
    pub boundary: Option<Boundary>,
    /// Edges in the order of the file. Sharpnesses are numbers from 0 on.
    pub creases: Vec<CreaseTag>,
    /// Vertices in the order of the file. Sharpnesses are numbers from 0 on.
    pub corners: Vec<CornerTag>,
}

/// The sharpness of an edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CreaseTag {
    /// The vertices that it joins, from 0.
    pub ends: [u32; 2],
    /// 0 for smooth, [`SHARP`](super::features::SHARP) and more for ever.
    pub sharpness: f64,
    /// Where it stands, from 1.
    pub line: u32,
}

/// The sharpness of a vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CornerTag {
    /// From 0.
    pub vertex: u32,
    /// 0 for smooth, [`SHARP`](super::features::SHARP) and more for ever.
    pub sharpness: f64,
    /// Where it stands, from 1.
    pub line: u32,
}

/// The scheme that a mesh is meant for, as USD knows them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Subdivision {
    /// `catmullClark`.
    CatmullClark,
    /// `loop`.
    Loop,
    /// `bilinear`: faces are divided, and stay where they are.
    Bilinear,
    /// `none`: the mesh is its faces.
    #[default]
    None,
}

impl Subdivision {
    pub(super) const ALL: [Subdivision; 4] =
        [Subdivision::CatmullClark, Subdivision::Loop, Subdivision::Bilinear, Subdivision::None];

    /// USD's token.
    pub fn name(self) -> &'static str {
        match self {
            Subdivision::CatmullClark => "catmullClark",
            Subdivision::Loop => "loop",
            Subdivision::Bilinear => "bilinear",
            Subdivision::None => "none",
        }
    }
}

impl fmt::Display for Subdivision {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FileTags {
    /// Whether nothing is sharp. A rule of the boundary may be there.
    pub fn is_empty(&self) -> bool {
        self.creases.is_empty() && self.corners.is_empty()
    }

    /// The tags for a surface of the file's faces, where `boundary` is the rule; `origin` tells where each vertex of the
    /// file went, if it is not the same one. O(tags).
    ///
    /// # Errors
    /// [`Error::Parse`] with the line: an edge that the surface lacks, a sharpness that has no rows.
    ///
    /// # Panics
    /// If the mesh, or `origin`, lacks a vertex of a tag: then it is not the file's.
    pub fn checked(&self, path: &Path, surface: &Surface, origin: Option<&Origin>, boundary: Boundary) -> Result<Tags> {
        let mut tags = Tags { boundary, creases: Vec::new(), corners: Vec::new() };
        for &CreaseTag { ends, sharpness, line } in &self.creases {
            check_crease(path, line as usize, surface, ends, origin, sharpness, &mut tags.creases)?;
        }
        for &CornerTag { vertex, sharpness, line } in &self.corners {
            check_corner(path, line as usize, vertex, sharpness)?;
            tags.corners.extend(there(origin, vertex).map(|v| (v, sharpness)));
        }
        Ok(tags)
    }

    /// Refuses tags of vertices that a mesh of so many lacks.
    pub(super) fn check_vertices(&self, path: &Path, vertices: usize) -> Result<()> {
        let of_creases = self.creases.iter().flat_map(|c| c.ends.map(|v| (v, c.line)));
        let of_corners = self.corners.iter().map(|c| (c.vertex, c.line));
        match of_creases.chain(of_corners).find(|&(v, _)| v as usize >= vertices) {
            Some((v, line)) => Err(Error::parse(path, Some(line as usize), not_there(v, vertices))),
            None => Ok(()),
        }
    }
}

/// What is wrong with a vertex that a mesh of so many lacks.
pub(super) fn not_there(vertex: impl fmt::Display, vertices: usize) -> String {
    format!("vertex {vertex} is not in the mesh: it has {vertices}, numbered from 0")
}

/// Refuses what no rule of sharpness can mean, as the rest of a sentence.
pub(super) fn check_sharpness(sharpness: f64) -> std::result::Result<(), String> {
    if sharpness >= 0.0 {
        return Ok(());
    }
    Err(format!("the sharpness {}: a number from 0 on is needed", short(sharpness)))
}

/// The vertices that a vertex of a file became.
pub(super) fn there(origin: Option<&Origin>, v: u32) -> impl Iterator<Item = u32> + Clone + '_ {
    let same = origin.is_none().then_some(v);
    same.into_iter().chain(origin.into_iter().flat_map(move |origin| origin.of_vertex(v)))
}

/// Adds a crease of the file to those of the surface, on all edges that it became. Refuses one that is no edge of the
/// surface, or has no rows.
pub(super) fn check_crease(
    path: &Path,
    line: usize,
    surface: &Surface,
    ends: [u32; 2],
    origin: Option<&Origin>,
    sharpness: f64,
    creases: &mut Vec<([u32; 2], f64)>,
) -> Result<()> {
    let refuse = |what: String| Error::parse(path, Some(line), format!("edge {}–{} {what}", ends[0], ends[1]));
    let before = creases.len();
    let [from, to] = ends.map(|v| there(origin, v));
    let pairs = from.flat_map(|a| to.clone().map(move |b| [a, b]));
    let is_edge = |&ends: &[u32; 2]| surface.incidence().half_edge(surface.faces(), ends).is_some();
    creases.extend(pairs.filter(is_edge).map(|ends| (ends, sharpness)));
    if creases.len() == before {
        return Err(refuse("is not in the mesh: its vertices, numbered from 0, share no edge".into()));
    }
    checked(sharpness).map_err(refuse)
}

/// Refuses the sharpness of a vertex that has no rows.
pub(super) fn check_corner(path: &Path, line: usize, vertex: u32, sharpness: f64) -> Result<()> {
    let refuse = |what: String| Error::parse(path, Some(line), format!("vertex {vertex} {what}"));
    checked(sharpness).map_err(refuse)
}
