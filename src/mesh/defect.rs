//! Kinds of mesh defects, their places, and the words for both.

use std::fmt;

use serde::Serialize;

/// The kinds of defects, in the order in which they are reported: what must be repaired first comes first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum DefectKind {
    /// The mesh has no vertices.
    NoVertices,
    /// The mesh has no faces.
    NoFaces,
    /// A face names a vertex that does not exist. No topology is built, and defects that need one are not told.
    IndexOutOfRange,
    /// A face of fewer than three corners.
    TooFewCorners,
    /// A face that names a vertex more than once.
    RepeatedVertex,
    /// A coordinate that is not a number, or infinite.
    NonFiniteCoordinate,
    /// An edge with more than two face sides.
    NonManifoldEdge,
    /// An edge along which its two faces run in the same direction.
    InconsistentOrientation,
    /// The faces at a vertex, joined where they share an edge at it, fall into more than one umbrella.
    NonManifoldVertex,
    /// A vertex of no face.
    IsolatedVertex,
    /// An edge with one face side, where [`Boundary::Refuse`](super::validate::Boundary::Refuse) holds.
    BoundaryEdge,
    /// A vertex of faces with fewer than three edges.
    LowValence,
}

impl DefectKind {
    pub(super) fn title(self, count: usize) -> String {
        let (one, many) = match self {
            DefectKind::NoVertices => return "no vertices".into(),
            DefectKind::NoFaces => return "no faces".into(),
            DefectKind::IndexOutOfRange => ("index out of range", "indices out of range"),
            DefectKind::TooFewCorners => ("face with fewer than three corners", "faces with fewer than three corners"),
            DefectKind::RepeatedVertex => ("face with a repeated vertex", "faces with a repeated vertex"),
            DefectKind::NonFiniteCoordinate => {
                ("vertex with a coordinate that is not finite", "vertices with a coordinate that is not finite")
            }
            DefectKind::NonManifoldEdge => ("edge with more than two faces", "edges with more than two faces"),
            DefectKind::InconsistentOrientation => {
                ("edge with two faces in the same direction", "edges with two faces in the same direction")
            }
            DefectKind::NonManifoldVertex => ("non-manifold vertex", "non-manifold vertices"),
            DefectKind::IsolatedVertex => ("isolated vertex", "isolated vertices"),
            DefectKind::LowValence => ("vertex of valence below three", "vertices of valence below three"),
            DefectKind::BoundaryEdge => ("boundary edge", "boundary edges"),
        };
        format!("{count} {}", if count == 1 { one } else { many })
    }
}

/// One defect and its place. Vertices and faces are numbered from 0, lines of the file from 1.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Defect {
    /// What is wrong.
    pub kind: DefectKind,
    /// The face, or the first of those on the edge; `None` where a vertex or the whole mesh is at fault.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub face: Option<u32>,
    /// The second of the two faces that disagree about their orientation.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub other_face: Option<u32>,
    /// The vertex, the index that names none, or the first end of an edge.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub vertex: Option<u32>,
    /// The second end of an edge.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub other_vertex: Option<u32>,
    /// The line of the face, or of the vertex where there is no face.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub line: Option<u32>,
    /// The line of the second face.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub other_line: Option<u32>,
    /// By kind: vertices of the mesh, corners, faces on the edge, umbrellas, valence.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub count: Option<u32>,
}

impl Defect {
    pub(super) fn new(kind: DefectKind) -> Self {
        Defect {
            kind,
            face: None,
            other_face: None,
            vertex: None,
            other_vertex: None,
            line: None,
            other_line: None,
            count: None,
        }
    }

    pub(super) fn at_vertex(kind: DefectKind, vertex: u32) -> Self {
        Defect { vertex: Some(vertex), ..Defect::new(kind) }
    }

    pub(super) fn at_face(kind: DefectKind, face: usize) -> Self {
        Defect { face: Some(face as u32), ..Defect::new(kind) }
    }

    pub(super) fn at_edge(kind: DefectKind, face: usize, ends: [u32; 2]) -> Self {
        Defect { vertex: Some(ends[0]), other_vertex: Some(ends[1]), ..Defect::at_face(kind, face) }
    }
}

/// The place in words: `face 7, line 91, vertices 4 and 9`; empty for a mesh without vertices or faces.
impl fmt::Display for Defect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut parts = Vec::new();
        match (self.face, self.other_face) {
            (Some(a), Some(b)) => parts.push(format!("faces {a} and {b}")),
            (Some(a), None) => parts.push(format!("face {a}")),
            _ => {}
        }
        let line = match (self.line, self.other_line) {
            (Some(a), Some(b)) => Some(format!("lines {a} and {b}")),
            (line, _) => line.map(|l| format!("line {l}")),
        };
        if self.face.is_some() {
            parts.extend(line.clone());
        }
        match (self.vertex, self.other_vertex) {
            (Some(a), Some(b)) => parts.push(format!("vertices {a} and {b}")),
            (Some(a), None) => parts.push(format!("vertex {a}")),
            _ => {}
        }
        if self.face.is_none() {
            parts.extend(line);
        }
        if let Some(n) = self.count {
            match self.kind {
                DefectKind::IndexOutOfRange => parts.push(format!("the mesh has {n} vertices")),
                DefectKind::TooFewCorners => parts.push(format!("corners: {n}")),
                DefectKind::NonManifoldEdge => parts.push(format!("{n} face sides")),
                DefectKind::NonManifoldVertex => parts.push(format!("{n} umbrellas")),
                DefectKind::LowValence => parts.push(format!("valence {n}")),
                _ => {}
            }
        }
        f.write_str(&parts.join(", "))
    }
}
