//! The faces of a scattered mesh once more, in an order in which neighbours lie near each other in memory: made once for
//! all that runs over the mesh, and the way back to the order of the file.

use std::sync::{Arc, OnceLock};

use glam::DVec3;

use super::edge_numbers::FirstSides;
use super::incidence::split_rows;
use super::numbering::{Numbering, inverse, rows_back};
use super::topology::NONE;
use super::{Faces, Incidence, Mesh, Surface, Topology};
use crate::pages::copied;
use crate::parallel;

/// Vertices of one task.
const CHUNK: usize = 4096;

/// Vertices [along a space-filling curve](super::space_filling), faces by smallest vertex. Each face begins with the corner
/// that it begins with in the file.
#[derive(Clone, Debug)]
pub(crate) struct Renumbered {
    pub(crate) faces: Faces,
    pub(crate) incidence: Incidence,
    pub(crate) numbering: Numbering,
    /// The face of the file at each place.
    face_order: Vec<u32>,
    face_place: OnceLock<Vec<u32>>,
    topology: OnceLock<Arc<Topology>>,
}

impl Renumbered {
    pub(super) fn new(faces: Faces, incidence: Incidence, numbering: Numbering, face_order: Vec<u32>) -> Self {
        let (face_place, topology) = (OnceLock::new(), OnceLock::new());
        Renumbered { faces, incidence, numbering, face_order, face_place, topology }
    }

    /// The place of each face of the file.
    pub(crate) fn face_place(&self) -> &[u32] {
        self.face_place.get_or_init(|| inverse(&self.face_order))
    }

    /// The topology of these faces, but that the corners at a vertex come in the order that they have in the file: whatever
    /// is summed over them has the same last bits.
    pub(crate) fn topology(&self) -> &Topology {
        self.shared_topology()
    }

    fn shared_topology(&self) -> &Arc<Topology> {
        self.topology.get_or_init(|| {
            let (faces, incidence) = (&self.faces, &self.incidence);
            let mut corners = copied(incidence.corners());
            parallel::parts(split_rows(incidence.offsets(), CHUNK, &mut corners), |rows, mut part| {
                for v in rows {
                    let (row, rest) = part.split_at_mut(incidence.face_count(v));
                    row.sort_unstable_by_key(|&c| self.face_order[incidence.face_of(c)]);
                    part = rest;
                }
            });
            let incidence = Incidence::from_parts(copied(incidence.offsets()), corners, faces);
            Arc::new(Topology::of(Arc::new(incidence), faces))
        })
    }

    /// The corner of the file that corner `c` here is.
    #[inline]
    fn in_file(&self, file: &Faces, c: u32) -> u32 {
        let f = self.incidence.face_of(c);
        let place = c - self.faces.range(f).start as u32;
        file.range(self.face_order[f] as usize).start as u32 + place
    }

    /// The corner here that corner `c` of face `f` of the file is.
    #[inline]
    pub(crate) fn corner(&self, file: &Faces, f: usize, c: u32) -> u32 {
        let place = c - file.range(f).start as u32;
        self.faces.range(self.face_place()[f] as usize).start as u32 + place
    }

    /// The incidence of the faces in the file.
    pub(super) fn incidence_of(&self, file: &Faces) -> Incidence {
        let (offsets, corners) = self.of_vertices(file, self.topology().incidence.corners());
        Incidence::from_parts(offsets, corners, file)
    }

    /// Rows of corners, as many at each vertex as it has, in the order and by the numbers of the file; and where each starts.
    pub(crate) fn of_vertices(&self, file: &Faces, corners: &[u32]) -> (Vec<u32>, Vec<u32>) {
        let place = self.numbering.place();
        let offsets = parallel::offsets(place.len(), |v| self.incidence.face_count(place[v] as usize) as u32);
        let offsets = offsets.expect("as many corners as before");
        // First in this order, where faces that meet are near; then row by row, each from one place.
        let moved = parallel::collect(corners.len(), |k| self.in_file(file, corners[k]));
        let rows = rows_back(&self.numbering, &moved, self.incidence.offsets(), &offsets);
        (offsets, rows)
    }

    /// Of one value a corner, those of the corners of the file.
    pub(crate) fn of_corners<T: Copy + Default + Send + Sync>(&self, values: &[T]) -> Vec<T> {
        self.faces.rows_in_order(self.face_place(), values)
    }

    /// Which half-edges are the first of their edges, in the order of the file.
    pub(crate) fn first_sides(&self) -> FirstSides {
        let (topology, faces) = (self.topology(), &self.faces);
        let twins = topology.twins();
        FirstSides::new(twins.len(), |c| {
            let t = twins[c as usize];
            if t == NONE {
                return true;
            }
            let face = |c| self.face_order[topology.incidence.face_of(c)];
            let in_file = |c| (face(c), c - faces.range(topology.incidence.face_of(c)).start as u32);
            in_file(c) <= in_file(t)
        })
    }

    /// The surface in this order, with points that are given in the order of the file. Its corners at a vertex come as in
    /// the file. All vertices count as smooth.
    pub(crate) fn surface(&self, points: &[DVec3]) -> Surface {
        let mesh = Mesh::new(self.numbering.there(points), self.faces.copied());
        Surface::near(mesh, Arc::clone(self.shared_topology()))
    }

    /// The topology of the faces in the file, whose incidence is known.
    pub(super) fn topology_of(&self, file: &Faces, incidence: Arc<Incidence>) -> Topology {
        let here = self.topology();
        let there = |c: u32| if c == NONE { NONE } else { self.in_file(file, c) };
        let moved = parallel::collect(here.twins().len(), |c| there(here.twins()[c]));
        let twins = self.of_corners(&moved);
        let mut boundary: Vec<u32> = here.boundary_half_edges().iter().map(|&c| there(c)).collect();
        boundary.sort_unstable();
        Topology::open(incidence, twins, boundary)
    }
}
