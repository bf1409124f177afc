//! Small meshes and measures for the tests of whole pipelines.

use glam::DVec3;
use limitlab::mesh::{Mesh, Topology, builtin, noise};

/// Rounding of sums of some tens of terms of size 1.
pub const ROUNDING: f64 = 1e-12;

pub fn topology(mesh: &Mesh) -> Topology {
    Topology::new(&mesh.faces, mesh.len())
}

/// A built-in mesh with noise, so that nothing holds by symmetry.
pub fn noisy(name: &str) -> Mesh {
    let mut mesh = builtin::builtin(name).unwrap();
    noise::add_noise(&mut mesh, 0.1, 3);
    mesh
}

pub fn distance(a: &[DVec3], b: &[DVec3]) -> f64 {
    assert_eq!(a.len(), b.len());
    let distances = a.iter().zip(b).map(|(p, q)| p.distance(*q));
    distances.fold(0.0, f64::max)
}

pub fn centroid(mesh: &Mesh, f: usize) -> DVec3 {
    let face = mesh.faces.face(f);
    let sum: DVec3 = face.iter().map(|&v| mesh.positions[v as usize]).sum();
    sum / face.len() as f64
}
