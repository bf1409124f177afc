//! Meshes thinned out by vertex clustering (Rossignac and Borrel 1993): one vertex for all in a cell of a grid.

use glam::DVec3;

use limitlab::mesh::{Faces, Mesh, bounding_box};

/// Corners that a thinned mesh may have for each vertex: as many as triangles have.
const CORNERS: usize = 6;
/// Cells along the longest side of the box at most: two in three of the bits of a key.
const FINEST: u64 = 1 << 20;

/// What is left of a mesh of which only so much can be shown.
#[derive(Clone, Debug, PartialEq)]
pub struct Thinned {
    /// What each vertex of the mesh has become.
    pub place: Vec<u32>,
    /// The first vertex of each that is left.
    pub first: Vec<u32>,
    pub faces: Faces,
}

impl Thinned {
    /// The mesh itself if it has at most so many vertices, and corners; else by the finest grid that leaves so many.
    /// O(corners log corners) for each grid that is tried, some twenty.
    pub fn new(mesh: &Mesh, most: usize) -> Self {
        let fits = |vertices: usize, corners: usize| vertices <= most && corners <= CORNERS * most;
        if fits(mesh.len(), mesh.faces.corners().len()) {
            let all: Vec<u32> = (0..mesh.len() as u32).collect();
            return Thinned { place: all.clone(), first: all, faces: mesh.faces.clone() };
        }
        // One cell holds everything.
        let (mut coarse, mut fine) = (1, FINEST);
        let mut found = Self::by_grid(mesh, coarse);
        while fine > coarse + 1 {
            let middle = (coarse + fine) / 2;
            let tried = Self::by_grid(mesh, middle);
            if fits(tried.first.len(), tried.faces.corners().len()) {
                (coarse, found) = (middle, tried);
            } else {
                fine = middle;
            }
        }
        found
    }

    /// By `cells` along the longest side of the box.
    fn by_grid(mesh: &Mesh, cells: u64) -> Self {
        let (least, greatest) = bounding_box(&mesh.positions).unwrap_or_default();
        let longest = (greatest - least).max_element();
        let key = |p: &DVec3| -> u64 {
            let at = ((*p - least) / longest * cells as f64).to_array();
            at.iter().fold(0, |key, &x| key * (FINEST + 1) + (x as u64).min(cells - 1))
        };
        let keys: Vec<u64> = mesh.positions.iter().map(key).collect();
        let mut by_cell: Vec<u32> = (0..mesh.len() as u32).collect();
        by_cell.sort_unstable_by_key(|&v| (keys[v as usize], v));
        let mut place = vec![0; mesh.len()];
        let mut first: Vec<u32> = Vec::new();
        for cell in by_cell.chunk_by(|&a, &b| keys[a as usize] == keys[b as usize]) {
            cell.iter().for_each(|&v| place[v as usize] = first.len() as u32);
            first.push(cell[0]);
        }
        let mut faces: Vec<Vec<u32>> = mesh.faces.iter().filter_map(|face| kept(face, &place)).collect();
        faces.sort_unstable();
        faces.dedup();
        Thinned { place, first, faces: Faces::from_lists(faces) }
    }

    /// Edges by their ends, without those that have become points.
    pub fn edges(&self, edges: impl IntoIterator<Item = [u32; 2]>) -> Vec<[u32; 2]> {
        let moved = edges.into_iter().map(|ends| ends.map(|v| self.place[v as usize]));
        let mut left: Vec<[u32; 2]> = moved.filter(|[a, b]| a != b).map(|[a, b]| [a.min(b), a.max(b)]).collect();
        left.sort_unstable();
        left.dedup();
        left
    }
}

/// A face after its corners have moved, begun at the least; `None` if fewer than three are left.
fn kept(face: &[u32], place: &[u32]) -> Option<Vec<u32>> {
    let mut corners: Vec<u32> = face.iter().map(|&v| place[v as usize]).collect();
    corners.dedup();
    if corners.first() == corners.last() {
        corners.pop();
    }
    let least = (0..corners.len()).min_by_key(|&k| corners[k])?;
    corners.rotate_left(least);
    (corners.len() >= 3).then_some(corners)
}

#[cfg(test)]
mod tests {
    use limitlab::mesh::builtin::builtin;

    use super::*;

    #[test]
    fn a_mesh_that_fits_stays_as_it_is() {
        let mesh = builtin("torus:5x4").unwrap();
        let thinned = Thinned::new(&mesh, 20);
        assert_eq!((thinned.place.len(), &thinned.faces), (20, &mesh.faces));
        assert_eq!(thinned.edges([[3, 1], [1, 3], [2, 2]]), [[1, 3]]);
    }

    #[test]
    fn a_large_mesh_keeps_its_shape() {
        for name in ["torus:90x60", "icosphere:5"] {
            let mesh = builtin(name).unwrap();
            let most = 900;
            let thinned = Thinned::new(&mesh, most);
            let left = thinned.first.len();
            assert!(left <= most && left > most / 3, "{name}: {left}");
            assert!(thinned.faces.corners().len() <= CORNERS * most);
            // A closed surface still: about as many corners for each vertex as before.
            let corners = |faces: &Faces, n: usize| faces.corners().len() as f64 / n as f64;
            assert!(corners(&thinned.faces, left) > 0.8 * corners(&mesh.faces, mesh.len()), "{name}");
            for (v, &there) in thinned.place.iter().enumerate() {
                let stands = mesh.positions[thinned.first[there as usize] as usize];
                assert!(stands.distance(mesh.positions[v]) < 0.15 * mesh.diagonal());
            }
            for face in thinned.faces.iter() {
                assert!(face.len() >= 3 && face.iter().all(|&v| (v as usize) < left));
            }
        }
    }

    /// Two sheets of 4 × 4 squares, one close above the other, in two cells a side: one square of each has a corner in
    /// all four.
    #[test]
    fn cells_reach_to_the_end_of_the_box_and_faces_that_fall_together_are_one() {
        let (mut positions, mut faces) = (Vec::new(), Faces::default());
        for k in 0..2 {
            let first = 25 * k;
            for i in 0..25 {
                positions.push(DVec3::new(f64::from(i % 5), f64::from(i / 5), 0.1 * f64::from(k)));
            }
            for i in (0..20).filter(|i| i % 5 < 4) {
                faces.push(&[0, 1, 6, 5].map(|step| first + i + step));
            }
        }
        let thinned = Thinned::by_grid(&Mesh::new(positions, faces), 2);
        let mut first = thinned.first.clone();
        first.sort_unstable();
        assert_eq!(first, [0, 2, 10, 12]);
        assert_eq!((thinned.faces.len(), thinned.faces.face(0).len()), (1, 4));
    }

    #[test]
    fn corners_that_fall_together_are_one() {
        assert_eq!(kept(&[0, 1, 2, 3], &[5, 4, 3, 5]), Some(vec![3, 5, 4]));
        assert_eq!(kept(&[0, 1, 2, 3], &[5, 4, 4, 3]), Some(vec![3, 5, 4]));
        assert_eq!(kept(&[0, 1, 2, 3], &[5, 5, 3, 3]), None);
    }

    #[test]
    fn few_vertices_with_too_many_corners_are_fewer() {
        let mut mesh = builtin("tri-torus:5x5").unwrap();
        let turned: Vec<Vec<u32>> = mesh.faces.iter().map(|face| face.iter().rev().copied().collect()).collect();
        turned.iter().for_each(|face| mesh.faces.push(face));
        let thinned = Thinned::new(&mesh, mesh.len());
        assert!(thinned.first.len() < mesh.len() && thinned.faces.corners().len() <= CORNERS * mesh.len());
    }

    #[test]
    fn all_in_one_point_is_one_vertex() {
        let mut mesh = builtin("torus:5x4").unwrap();
        mesh.positions.fill(DVec3::ONE);
        let thinned = Thinned::new(&mesh, 10);
        assert_eq!((thinned.first.len(), thinned.faces.len()), (1, 0));
    }
}
