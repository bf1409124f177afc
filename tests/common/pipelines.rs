//! Small meshes and measures for the tests of whole pipelines.

use glam::DVec3;
use limitlab::mesh::{Mesh, Surface, builtin, noise};

pub use super::meshes::distance;

/// Rounding of sums of some tens of terms of size 1.
pub const ROUNDING: f64 = 1e-12;

/// A built-in mesh with noise, so that nothing holds by symmetry.
pub fn noisy(name: &str) -> Mesh {
    let mut mesh = builtin::builtin(name).unwrap();
    noise::add_noise(&mut mesh, 0.1, 3);
    mesh
}

/// [`noisy`] as a surface.
pub fn noisy_surface(name: &str) -> Surface {
    Surface::new(noisy(name)).unwrap()
}

pub fn centroid(mesh: &Mesh, f: usize) -> DVec3 {
    let face = mesh.faces.face(f);
    let sum: DVec3 = face.iter().map(|&v| mesh.positions[v as usize]).sum();
    sum / face.len() as f64
}
