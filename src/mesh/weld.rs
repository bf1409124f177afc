//! Welding of vertices at the same position, and the seams that ask for it.

use glam::DVec3;
use rayon::slice::ParallelSliceMut;

use super::{Faces, Mesh, Surface};

/// A mesh without vertices at the same position, and where those of the original went.
#[derive(Clone, Debug, PartialEq)]
pub struct Welded {
    /// In the order of the first vertex at each position; the faces, corner for corner.
    pub mesh: Mesh,
    /// The new number of every old vertex.
    pub place: Vec<u32>,
}

/// Equal for equal positions: zeros of either sign are one.
fn bits(position: DVec3) -> [u64; 3] {
    position.to_array().map(|x| (x + 0.0).to_bits())
}

/// Joins vertices whose coordinates are equal, zeros of either sign alike. A face may name a vertex twice then: the validator
/// tells. O(N log N), in parallel.
///
/// ```
/// use limitlab::mesh::{Faces, Mesh, weld::weld};
/// use glam::DVec3;
/// // Two triangles side by side, with vertices of their own.
/// let points = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::X, DVec3::ONE, DVec3::Y];
/// let welded = weld(&Mesh::new(points, Faces::from_lists([[0, 1, 2], [3, 4, 5]])));
/// assert_eq!(welded.place, [0, 1, 2, 1, 3, 2]);
/// assert_eq!(welded.mesh.faces.face(1), [1, 3, 2]);
/// ```
///
/// # Panics
/// If a face names a vertex that is not there.
pub fn weld(mesh: &Mesh) -> Welded {
    let key = |v: u32| bits(mesh.positions[v as usize]);
    let mut sorted: Vec<u32> = (0..mesh.len() as u32).collect();
    sorted.par_sort_unstable_by_key(|&v| (key(v), v));
    let mut first = vec![0u32; mesh.len()];
    for group in sorted.chunk_by(|&a, &b| key(a) == key(b)) {
        group.iter().for_each(|&v| first[v as usize] = group[0]);
    }
    let mut place = vec![0u32; mesh.len()];
    let mut positions = Vec::with_capacity(mesh.len());
    for v in 0..mesh.len() {
        let lead = first[v] as usize;
        // The first of a group comes before the others.
        place[v] = if lead == v { positions.len() as u32 } else { place[lead] };
        if lead == v {
            positions.push(mesh.positions[v]);
        }
    }
    let mut faces: Faces = mesh.faces.clone();
    faces.corners_mut().iter_mut().for_each(|v| *v = place[*v as usize]);
    Welded { mesh: Mesh::new(positions, faces), place }
}

/// How many boundary edges lie on another one, end on end by the last bit, and the first of them by its ends: seams, where
/// an exporter has split vertices. O(b log b) for b boundary edges.
///
/// ```
/// use limitlab::mesh::{Faces, Mesh, Surface, validate::Boundary, weld::seams};
/// use glam::DVec3;
/// // Two triangles side by side, with vertices of their own.
/// let points = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::X, DVec3::ONE, DVec3::Y];
/// let mesh = Mesh::new(points, Faces::from_lists([[0, 1, 2], [3, 4, 5]]));
/// let surface = Surface::examined(mesh, None, Boundary::EdgeAndCorner).unwrap();
/// assert_eq!(seams(&surface), Some((2, [1, 2])));
/// ```
pub fn seams(surface: &Surface) -> Option<(usize, [u32; 2])> {
    if surface.is_closed() {
        return None;
    }
    let (incidence, faces, points) = (surface.incidence(), surface.faces(), surface.positions());
    let side = |&c: &u32| {
        let ends = [c, incidence.next(faces, c)].map(|c| faces.corners()[c as usize]);
        let [a, b] = ends.map(|v| bits(points[v as usize]));
        (a.min(b), a.max(b), c, ends)
    };
    let mut sides: Vec<_> = surface.boundary_half_edges().iter().map(side).collect();
    sides.sort_unstable();
    let groups = sides.chunk_by(|s, t| (s.0, s.1) == (t.0, t.1)).filter(|group| group.len() > 1);
    let (mut count, mut first) = (0, None);
    for group in groups {
        count += group.len();
        let here = (group[0].2, group[0].3);
        first = first.map_or(Some(here), |first: (u32, [u32; 2])| Some(first.min(here)));
    }
    first.map(|(_, ends)| (count, ends))
}
