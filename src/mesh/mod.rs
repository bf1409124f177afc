//! Polygon meshes: positions and faces, topology, validation, files, built-in meshes, vertex orders.
//! This room knows no matrices.

pub mod builtin;
pub mod colours;
mod defect;
mod degenerate;
pub mod generate;
pub mod io;
pub mod noise;
pub mod obj;
mod obj_normals;
pub mod off;
pub mod order;
pub mod ply;
mod text;
pub mod topology;
pub mod validate;

use glam::DVec3;

pub use topology::{Incidence, Topology};

/// A polygon mesh: one position a vertex, faces of any size as vertex indices in counter-clockwise order
/// seen from outside. Vertices and faces are numbered from 0 in file order.
///
/// Nothing is checked on construction: the validator reports every defect.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    pub positions: Vec<DVec3>,
    pub faces: Faces,
}

/// The faces of a mesh in one flat array: face `f` holds `corners[offsets[f]..offsets[f + 1]]`. The index of an
/// entry of `corners` is called a *corner*; it also names the half-edge that leaves the corner's vertex for the
/// next one of the face.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Faces {
    offsets: Vec<u32>,
    corners: Vec<u32>,
}

impl Default for Faces {
    fn default() -> Self {
        Faces {
            offsets: vec![0],
            corners: Vec::new(),
        }
    }
}

impl Faces {
    /// Faces from the two arrays.
    ///
    /// # Panics
    /// If `offsets` does not start at 0, descends, or does not end at `corners.len()`.
    pub fn from_parts(offsets: Vec<u32>, corners: Vec<u32>) -> Self {
        assert!(offsets.first() == Some(&0), "offsets start at 0");
        assert!(
            offsets.last().map(|&l| l as usize) == Some(corners.len()),
            "offsets end at the number of corners"
        );
        assert!(offsets.is_sorted(), "offsets ascend");
        Faces { offsets, corners }
    }

    /// Faces from a list of index lists.
    pub fn from_lists<F: AsRef<[u32]>>(lists: impl IntoIterator<Item = F>) -> Self {
        let mut faces = Faces::default();
        for face in lists {
            faces.push(face.as_ref());
        }
        faces
    }

    /// Appends a face.
    ///
    /// # Panics
    /// If the corners no longer fit 32 bits; readers refuse such files before.
    pub fn push(&mut self, face: &[u32]) {
        self.corners.extend_from_slice(face);
        let end = u32::try_from(self.corners.len()).expect("corners fit 32-bit indices");
        self.offsets.push(end);
    }

    pub fn with_capacity(faces: usize, corners: usize) -> Self {
        let mut offsets = Vec::with_capacity(faces + 1);
        offsets.push(0);
        Faces {
            offsets,
            corners: Vec::with_capacity(corners),
        }
    }

    /// The number of faces.
    pub fn len(&self) -> usize {
        self.offsets.len() - 1
    }

    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The vertices of face `f`.
    pub fn face(&self, f: usize) -> &[u32] {
        &self.corners[self.range(f)]
    }

    /// The corners of face `f`.
    pub fn range(&self, f: usize) -> std::ops::Range<usize> {
        self.offsets[f] as usize..self.offsets[f + 1] as usize
    }

    pub fn iter(&self) -> impl ExactSizeIterator<Item = &[u32]> + '_ {
        self.offsets
            .windows(2)
            .map(|w| &self.corners[w[0] as usize..w[1] as usize])
    }

    pub fn offsets(&self) -> &[u32] {
        &self.offsets
    }

    pub fn corners(&self) -> &[u32] {
        &self.corners
    }

    pub fn corners_mut(&mut self) -> &mut [u32] {
        &mut self.corners
    }

    /// The face size that all faces share, if they do.
    pub fn uniform_size(&self) -> Option<usize> {
        let first = self.face_sizes().next()?;
        self.face_sizes().all(|s| s == first).then_some(first)
    }

    fn face_sizes(&self) -> impl Iterator<Item = usize> + '_ {
        self.offsets.windows(2).map(|w| (w[1] - w[0]) as usize)
    }
}

impl Mesh {
    pub fn new(positions: Vec<DVec3>, faces: Faces) -> Self {
        Mesh { positions, faces }
    }

    /// The number of vertices N.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// The diagonal of the axis-parallel bounding box: the length L that relative tolerances refer to. Points
    /// that are not finite do not count; 0 for no points.
    pub fn diagonal(&self) -> f64 {
        bounding_box(&self.positions).map_or(0.0, |(lo, hi)| (hi - lo).length())
    }
}

/// The corners of the smallest axis-parallel box around all finite points.
pub fn bounding_box(points: &[DVec3]) -> Option<(DVec3, DVec3)> {
    points
        .iter()
        .filter(|p| p.is_finite())
        .fold(None, |bounds, &p| match bounds {
            None => Some((p, p)),
            Some((lo, hi)) => Some((p.min(lo), p.max(hi))),
        })
}
