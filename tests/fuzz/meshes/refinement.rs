//! Refinement: closed manifolds stay closed manifolds of the same genus.

use limitlab::mesh::{Surface, Topology};
use limitlab::schemes::Refinement;

use super::super::surface::euler_if_closed;
use super::{on_any_threads, suitable, systems};

pub fn keeps_surfaces(surface: &Surface, euler: i64) {
    for refinement in Refinement::ALL {
        step(refinement, surface, euler);
    }
}

/// One step, if the faces allow it.
fn step(refinement: Refinement, surface: &Surface, euler: i64) -> Option<Surface> {
    let fine = on_any_threads(|| refinement.refine(surface).ok());
    let of_any = [Refinement::CatmullClark, Refinement::DooSabin, Refinement::MidEdge];
    let needs_triangles = !of_any.contains(&refinement);
    let refused = needs_triangles && surface.faces().uniform_size() != Some(3);
    assert_eq!(fine.is_none(), refused, "{refinement}");
    let fine = fine?;
    assert_eq!(euler_if_closed(&fine), Some(euler), "{refinement}");
    assert!(fine.positions.iter().all(|p| p.is_finite()), "{refinement}");
    let finer = refinement.refined(surface).unwrap();
    assert!(*finer.mesh() == fine, "{refinement}: another mesh");
    assert!(*finer.topology() == Topology::new(&fine.faces, fine.len()), "{refinement}: another topology");
    let normals = refinement.limit_normals(&finer).unwrap();
    assert!(normals.iter().all(|n| n.length() < 0.5 || (n.length() - 1.0).abs() < 1e-12), "{refinement}");
    Some(finer)
}

/// Refines until tasks are shared out among threads, and solves there. What is computed has been held against formulas
/// on small meshes; here the operator is held against the explicit matrix, and threads against each other.
pub fn large(surface: &Surface, euler: i64, tolerance: f64) {
    const ENOUGH: usize = 5000;
    let triangles = surface.faces().uniform_size() == Some(3);
    let refinement = if triangles { Refinement::Loop } else { Refinement::DooSabin };
    let mut surface = surface.clone();
    while surface.len() < ENOUGH {
        surface = step(refinement, &surface, euler).unwrap();
    }
    for scheme in suitable(surface.mesh()) {
        systems::large(&surface, scheme, tolerance);
    }
}
