//! Open and creased meshes: rows against refinement by hand, closed forms, all methods on the stages, the front door.

mod closed_forms;
mod decay;
mod dual;
mod general;
mod methods;
mod naive;
mod refinement;
mod rows;
mod thirds;
mod witness;

use glam::DVec3;
use limitlab::mesh::features::Tags;
pub use limitlab::mesh::random::random_points;
use limitlab::mesh::validate::Boundary;
use limitlab::mesh::{Faces, Mesh, Surface, random};
use limitlab::schemes::Scheme;

use crate::common::meshes::small_mesh;

/// As [`random::random_creased`], of a mesh on which the scheme is defined.
pub fn random_creased(scheme: Scheme, seed: u64) -> Option<(Surface, Tags)> {
    random::random_creased(&small_mesh(scheme, seed), seed)
}

/// As [`random::random_semi_sharp`], of a mesh on which the scheme is defined.
pub fn random_semi_sharp(scheme: Scheme, seed: u64) -> Option<(Surface, Tags)> {
    random::random_semi_sharp(&small_mesh(scheme, seed), seed)
}

/// A grid of p × q vertices, of quads or of triangles.
pub fn grid(p: usize, q: usize, triangles: bool) -> Mesh {
    let mut faces = Faces::default();
    for i in 0..p as u32 - 1 {
        for j in 0..q as u32 - 1 {
            let at = |i: u32, j: u32| i * q as u32 + j;
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            match triangles {
                true => {
                    faces.push(&[a, b, c]);
                    faces.push(&[a, c, d]);
                }
                false => faces.push(&[a, b, c, d]),
            }
        }
    }
    let positions = (0..p * q).map(|k| DVec3::new((k / q) as f64, (k % q) as f64, ((k * k) % 7) as f64 * 0.1));
    Mesh::new(positions.collect(), faces)
}

pub fn open(mesh: Mesh, boundary: Boundary) -> Surface {
    Surface::examined(mesh, None, boundary).unwrap()
}
