//! Correspondence of a welded or repaired mesh with its file: which vertex became which, and the control mesh in the
//! numbering of the file.

use std::collections::BTreeMap;

use glam::DVec3;

use super::topology::NONE;
use super::{Faces, Mesh};

/// Where the vertices of a file went.
///
/// What is written in return for the file keeps its numbers: vertices 0 to N − 1 are those of the file, one that no face has
/// at its own position. Where a vertex of the file became several, because sheets were cut apart, all but the first come
/// after these. Faces are those of the mesh, in their order.
#[derive(Clone, Debug)]
pub struct Origin {
    vertices: usize,
    /// The first vertex of the file for each of the mesh.
    sources: Vec<u32>,
    /// The vertex of the mesh for each that is written; [`NONE`] for one that no face has.
    place: Vec<u32>,
    /// The vertices of the file that are written more than once, with the further numbers; ascending.
    copies: Vec<(u32, u32)>,
    /// The positions of those that no face has.
    at_rest: Vec<(u32, DVec3)>,
    faces: Faces,
}

/// What the vertices and faces of a mesh are called in its file; by default as in the mesh.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Numbers {
    /// By vertex of the mesh, where the numbers are others.
    pub vertices: Option<Vec<u32>>,
    /// By face of the mesh, where the numbers are others.
    pub faces: Option<Vec<u32>>,
}

impl Numbers {
    /// The number of a vertex in the file.
    ///
    /// # Panics
    /// If there is no such vertex.
    pub fn vertex(&self, v: u32) -> u32 {
        self.vertices.as_ref().map_or(v, |numbers| numbers[v as usize])
    }

    /// The number of a face in the file.
    ///
    /// # Panics
    /// If there is no such face.
    pub fn face(&self, f: u32) -> u32 {
        self.faces.as_ref().map_or(f, |numbers| numbers[f as usize])
    }
}

impl Origin {
    /// Of `mesh`, whose corners came from `corners` of the file's; the same ones where this is `None`.
    /// O(corners), and O(s log s) for the s corners at vertices that became several.
    ///
    /// # Panics
    /// If a face of the file names a vertex that is not there, or a corner does not exist.
    pub fn new(file: &Mesh, mesh: &Mesh, corners: Option<&[u32]>) -> Self {
        let mut place = vec![NONE; file.len()];
        let mut further: BTreeMap<(u32, u32), u32> = BTreeMap::new();
        let mut written = mesh.faces.clone();
        let mut sources = vec![NONE; mesh.len()];
        for (c, name) in written.corners_mut().iter_mut().enumerate() {
            let there = *name;
            let here = file.faces.corners()[corners.map_or(c, |corners| corners[c] as usize)];
            if place[here as usize] == NONE {
                place[here as usize] = there;
            }
            *name = here;
            sources[there as usize] = sources[there as usize].min(here);
            if place[here as usize] != there {
                *name = *further.entry((here, there)).or_insert_with(|| {
                    place.push(there);
                    place.len() as u32 - 1
                });
            }
        }
        let copies = further.into_iter().map(|((here, _), name)| (here, name)).collect();
        let rest = (0..file.len()).filter(|&v| place[v] == NONE);
        let at_rest = rest.map(|v| (v as u32, file.positions[v])).collect();
        Origin { vertices: file.len(), sources, place, copies, at_rest, faces: written }
    }

    /// The number of vertices of the file.
    pub fn vertices(&self) -> usize {
        self.vertices
    }

    /// The vertices of the mesh that a vertex of the file became.
    ///
    /// # Panics
    /// If the file has no such vertex.
    pub fn of_vertex(&self, v: u32) -> impl Iterator<Item = u32> + Clone + '_ {
        assert!((v as usize) < self.vertices, "a vertex of the file");
        let start = self.copies.partition_point(|&(of, _)| of < v);
        let copies = self.copies[start..].iter().take_while(move |&&(of, _)| of == v).map(|&(_, name)| name);
        std::iter::once(v).chain(copies).map(|name| self.place[name as usize]).filter(|&there| there != NONE)
    }

    /// The vertex of the mesh for each that is written, `None` for one that no face has.
    pub fn places(&self) -> impl ExactSizeIterator<Item = Option<u32>> + '_ {
        self.place.iter().map(|&there| (there != NONE).then_some(there))
    }

    /// The first number under which each vertex of the mesh is written, which tells copies from what they were cut from;
    /// 2³² − 1 for one that no face has.
    pub fn numbers(&self) -> Vec<u32> {
        let mut numbers = vec![NONE; self.sources.len()];
        for (there, number) in self.places().zip(0..) {
            let Some(there) = there else { continue };
            let slot = &mut numbers[there as usize];
            *slot = number.min(*slot);
        }
        numbers
    }

    /// The first vertex of the file for each of the mesh; 2³² − 1 for one that no face has.
    pub fn sources(&self) -> &[u32] {
        &self.sources
    }

    /// The faces that are written.
    pub fn faces(&self) -> &Faces {
        &self.faces
    }

    /// The mesh that is written, with the positions of those of the mesh.
    pub fn written(&self, positions: &[DVec3]) -> Mesh {
        let mut points = self.spread(positions);
        self.at_rest.iter().for_each(|&(v, p)| points[v as usize] = p);
        Mesh::new(points, self.faces.clone())
    }

    /// Values by vertex of the mesh for those that are written; zero for one that no face has.
    pub fn spread<T: Copy + Default>(&self, values: &[T]) -> Vec<T> {
        self.places().map(|there| there.map_or_else(T::default, |there| values[there as usize])).collect()
    }
}
