//! Polygon meshes: positions and faces, topology, validation, files, built-in meshes, vertex orders.
//! This room knows no matrices.

pub mod attributes;
mod boundary;
pub mod breadth_first;
mod builder;
pub mod builtin;
pub mod colours;
mod cuthill_mckee;
mod defect;
mod degenerate;
pub(crate) mod edge_numbers;
pub mod features;
pub mod file_tags;
pub mod frame;
pub mod generate;
pub mod gltf;
pub mod incidence;
pub mod io;
pub(crate) mod magic;
pub mod noise;
pub(crate) mod numbering;
pub mod obj;
mod obj_normals;
pub mod off;
pub mod order;
pub mod origin;
pub mod ply;
pub mod random;
pub(crate) mod renumbered;
pub mod repair;
pub mod space_filling;
pub mod stl;
pub mod surface;
pub mod topology;
pub mod usd;
pub mod validate;
pub mod vertex_data;
pub mod weld;

use std::sync::OnceLock;

use crate::pages::{copied, filled};
use crate::parallel;
use glam::DVec3;
use incidence::split_rows;

pub use incidence::Incidence;
pub use surface::Surface;
pub use topology::Topology;

/// Faces or points of one task.
const CHUNK: usize = 1 << 16;

/// A polygon mesh: one position a vertex, faces of any size as vertex indices in counter-clockwise order
/// seen from outside. Vertices and faces are numbered from 0 in file order.
///
/// Nothing is checked on construction: the validator reports every defect.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    /// One point a vertex; their unit of length is what is called mesh units.
    pub positions: Vec<DVec3>,
    /// The faces, as indices into the positions.
    pub faces: Faces,
}

/// The faces of a mesh in one flat array: face `f` holds `corners[offsets[f]..offsets[f + 1]]`. The index of an
/// entry of `corners` is called a *corner*; it also names the half-edge that leaves the corner's vertex for the
/// next one of the face.
///
/// Where all faces have the same size, offsets take no memory until [`offsets`](Self::offsets) is called.
#[derive(Clone, Debug)]
pub struct Faces {
    count: usize,
    /// Of every face; 0 without faces, `None` if sizes differ.
    size: Option<usize>,
    /// Where each face starts, and the end, if sizes differ.
    offsets: Vec<u32>,
    /// The same if sizes do not differ, once asked for.
    uniform_offsets: OnceLock<Vec<u32>>,
    corners: Vec<u32>,
}

impl Default for Faces {
    fn default() -> Self {
        Faces { count: 0, size: Some(0), offsets: Vec::new(), uniform_offsets: OnceLock::new(), corners: Vec::new() }
    }
}

impl PartialEq for Faces {
    fn eq(&self, other: &Self) -> bool {
        (self.count, self.size) == (other.count, other.size)
            && self.corners == other.corners
            && self.offsets == other.offsets
    }
}

impl Eq for Faces {}

impl Faces {
    /// Faces from the two arrays.
    ///
    /// # Panics
    /// If `offsets` does not start at 0, descends, or does not end at `corners.len()`.
    pub fn from_parts(offsets: Vec<u32>, corners: Vec<u32>) -> Self {
        assert!(offsets.first() == Some(&0), "offsets start at 0");
        assert!(offsets.last().map(|&l| l as usize) == Some(corners.len()), "offsets end at the number of corners");
        // The least size and the greatest.
        let count = offsets.len() - 1;
        let sizes = parallel::map(count, CHUNK, |range| {
            let (mut least, mut greatest) = (u32::MAX, 0);
            for f in range {
                assert!(offsets[f] <= offsets[f + 1], "offsets ascend");
                let size = offsets[f + 1] - offsets[f];
                (least, greatest) = (least.min(size), greatest.max(size));
            }
            (least, greatest)
        });
        let sizes = sizes.into_iter().fold((u32::MAX, 0), |a, b| (a.0.min(b.0), a.1.max(b.1)));
        let (size, offsets) =
            if count == 0 || sizes.0 == sizes.1 { (Some(sizes.1 as usize), Vec::new()) } else { (None, offsets) };
        Faces { count, size, offsets, corners, ..Faces::default() }
    }

    /// Faces of `size` corners each.
    ///
    /// # Panics
    /// If `size` is 0 or does not divide the number of corners, or 32 bits do not number these.
    pub fn of_size(size: usize, corners: Vec<u32>) -> Self {
        assert!(corners.len().is_multiple_of(size), "whole faces");
        assert!(corners.len() <= u32::MAX as usize, "corners fit 32-bit indices");
        let count = corners.len() / size;
        Faces { count, size: Some(if count == 0 { 0 } else { size }), corners, ..Faces::default() }
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
        match self.size {
            Some(size) if size == face.len() => {}
            Some(_) if self.count == 0 => self.size = Some(face.len()),
            Some(_) => {
                self.offsets = self.offsets().to_vec();
                self.size = None;
            }
            None => {}
        }
        self.corners.extend_from_slice(face);
        let end = u32::try_from(self.corners.len()).expect("corners fit 32-bit indices");
        if self.size.is_none() {
            self.offsets.push(end);
        }
        self.uniform_offsets = OnceLock::new();
        self.count += 1;
    }

    /// Room for so many corners.
    pub fn with_capacity(corners: usize) -> Self {
        Faces { corners: Vec::with_capacity(corners), ..Faces::default() }
    }

    /// The number of faces.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether there are no faces.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// The vertices of face `f`.
    #[inline]
    pub fn face(&self, f: usize) -> &[u32] {
        &self.corners[self.range(f)]
    }

    /// The corners of face `f`.
    #[inline]
    pub fn range(&self, f: usize) -> std::ops::Range<usize> {
        match self.size {
            Some(size) => size * f..size * (f + 1),
            None => self.offsets[f] as usize..self.offsets[f + 1] as usize,
        }
    }

    /// The faces in order, each as its vertices.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = &[u32]> + '_ {
        (0..self.count).map(|f| self.face(f))
    }

    /// Where each face starts in [`corners`](Self::corners), and the end. O(1) where sizes differ; otherwise the first
    /// call makes the array.
    pub fn offsets(&self) -> &[u32] {
        let Some(size) = self.size else {
            return &self.offsets;
        };
        self.uniform_offsets.get_or_init(|| (0..=self.count).map(|f| (size * f) as u32).collect())
    }

    /// The vertex of every corner, face after face.
    pub fn corners(&self) -> &[u32] {
        &self.corners
    }

    /// The vertex of every corner, to renumber vertices in place; the sizes of faces stay.
    pub fn corners_mut(&mut self) -> &mut [u32] {
        &mut self.corners
    }

    /// A copy, made by all threads.
    pub(crate) fn copied(&self) -> Faces {
        Faces {
            count: self.count,
            size: self.size,
            offsets: copied(&self.offsets),
            uniform_offsets: OnceLock::new(),
            corners: copied(&self.corners),
        }
    }

    /// The faces in another order, the k-th of them face `order[k]`, with the vertices that `corners` has in place of this
    /// one's. In parallel.
    ///
    /// # Panics
    /// If `order` names a face that does not exist, or there is not one vertex a corner.
    pub(crate) fn in_order(&self, order: &[u32], corners: &[u32]) -> Faces {
        assert_eq!(corners.len(), self.corners.len(), "one vertex a corner");
        let gathered = self.rows_in_order(order, corners);
        match self.size {
            Some(0) => Faces { count: order.len(), ..Faces::default() },
            Some(size) => Faces::of_size(size, gathered),
            None => Faces::from_parts(self.offsets_in_order(order), gathered),
        }
    }

    /// Of one value a corner, those of the faces in another order.
    pub(crate) fn rows_in_order<T: Copy + Default + Send + Sync>(&self, order: &[u32], values: &[T]) -> Vec<T> {
        if let Some(size @ 1..) = self.size {
            let mut rows = filled(size * order.len(), T::default());
            parallel::chunks(&mut rows, CHUNK / 8 * size, |first, part| {
                for (row, &f) in part.chunks_exact_mut(size).zip(&order[first / size..]) {
                    row.copy_from_slice(&values[self.range(f as usize)]);
                }
            });
            return rows;
        }
        let offsets = self.offsets_in_order(order);
        let mut rows = filled(offsets[order.len()] as usize, T::default());
        parallel::parts(split_rows(&offsets, CHUNK / 8, &mut rows), |faces, mut part| {
            for &f in &order[faces] {
                let range = self.range(f as usize);
                let (row, rest) = part.split_at_mut(range.len());
                row.copy_from_slice(&values[range]);
                part = rest;
            }
        });
        rows
    }

    /// Where each face starts in that order, and the end.
    fn offsets_in_order(&self, order: &[u32]) -> Vec<u32> {
        let mut offsets = vec![0; order.len() + 1];
        parallel::fill(&mut offsets[1..], |k| self.range(order[k] as usize).len() as u32);
        for k in 0..order.len() {
            offsets[k + 1] += offsets[k];
        }
        offsets
    }

    /// The face size that all faces share, if they do.
    pub fn uniform_size(&self) -> Option<usize> {
        self.size.filter(|_| self.count > 0)
    }
}

impl Mesh {
    /// A mesh of these parts, unchecked.
    pub fn new(positions: Vec<DVec3>, faces: Faces) -> Self {
        Mesh { positions, faces }
    }

    /// The number of vertices N.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Whether there are no vertices.
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// The [`diagonal`] of its positions.
    pub fn diagonal(&self) -> f64 {
        diagonal(&self.positions)
    }
}

/// The diagonal of the axis-parallel bounding box of points: the length L that relative tolerances refer to. Points
/// that are not finite do not count; 0 for no points.
pub fn diagonal(points: &[DVec3]) -> f64 {
    bounding_box(points).map_or(0.0, |(lo, hi)| frame::distance(lo, hi))
}

/// The corners of the smallest axis-parallel box around all finite points.
pub fn bounding_box(points: &[DVec3]) -> Option<(DVec3, DVec3)> {
    let joined = |(lo, hi): (DVec3, DVec3), (least, most): (DVec3, DVec3)| (lo.min(least), hi.max(most));
    let boxes = parallel::map(points.len(), CHUNK, |range| {
        let finite = points[range].iter().filter(|p| p.is_finite());
        finite.map(|&p| (p, p)).reduce(joined)
    });
    boxes.into_iter().flatten().reduce(joined)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_are_the_same_however_they_were_made() {
        let lists: [&[&[u32]]; 7] = [
            &[],
            &[&[0, 1, 2], &[3, 4, 5]],
            &[&[0, 1, 2], &[3, 4, 5], &[6, 7, 8, 9]],
            &[&[0, 1, 2, 3], &[3, 4, 5], &[6, 7, 8, 9]],
            &[&[], &[]],
            &[&[], &[1, 2, 3]],
            &[&[1, 2, 3], &[], &[1, 2, 3]],
        ];
        for lists in lists {
            let mut pushed = Faces::default();
            let mut offsets = vec![0];
            for face in lists {
                pushed.push(face);
                offsets.push(pushed.corners().len() as u32);
                // Asked for in between, and still right afterwards.
                assert_eq!(pushed.offsets(), offsets);
            }
            let made = Faces::from_parts(offsets.clone(), lists.concat());
            assert_eq!(made, pushed);
            assert_eq!(made, Faces::from_lists(lists));
            assert_eq!(made.offsets(), offsets);
            assert_eq!(made.iter().collect::<Vec<_>>(), lists);
            let mut sizes: Vec<usize> = lists.iter().map(|f| f.len()).collect();
            sizes.dedup();
            let size = (sizes.len() == 1).then(|| sizes[0]);
            assert_eq!(made.uniform_size(), size);
            if let Some(size @ 1..) = size {
                assert_eq!(Faces::of_size(size, lists.concat()), made);
            }
            for (f, list) in lists.iter().enumerate() {
                assert_eq!(made.range(f), offsets[f] as usize..offsets[f + 1] as usize);
                assert_eq!(made.face(f), *list);
            }
        }
        assert_ne!(
            Faces::from_lists([vec![0, 1, 2], vec![3, 4, 5, 6]]),
            Faces::from_lists([vec![0, 1, 2, 3], vec![4, 5, 6]])
        );
        assert_eq!(Faces::of_size(3, Vec::new()), Faces::default());
    }

    #[test]
    #[should_panic(expected = "offsets ascend")]
    fn offsets_that_descend_are_refused() {
        Faces::from_parts(vec![0, 3, 1, 6], vec![0; 6]);
    }
}
