//! Refinement: closed manifolds stay closed manifolds of the same genus.

use limitlab::mesh::{Mesh, Topology};
use limitlab::schemes::Refinement;

use super::super::surface::Surface;
use super::{Case, on_any_threads, suitable, systems};

pub fn keeps_surfaces(mesh: &Mesh, topology: &Topology, euler: i64) {
    for refinement in Refinement::ALL {
        step(refinement, mesh, topology, euler);
    }
}

/// One step, if the faces allow it.
fn step(refinement: Refinement, mesh: &Mesh, topology: &Topology, euler: i64) -> Option<(Mesh, Topology)> {
    let fine = on_any_threads(|| refinement.refine(mesh, topology).ok());
    let of_any = [Refinement::CatmullClark, Refinement::DooSabin, Refinement::MidEdge];
    let needs_triangles = !of_any.contains(&refinement);
    let refused = needs_triangles && mesh.faces.uniform_size() != Some(3);
    assert_eq!(fine.is_none(), refused, "{refinement}");
    let fine = fine?;
    assert_eq!(Surface::of(&fine), Surface::Closed { euler }, "{refinement}");
    assert!(fine.positions.iter().all(|p| p.is_finite()), "{refinement}");
    let finer = refinement.refined_topology(mesh, topology, &fine);
    assert!(finer == Topology::new(&fine.faces, fine.len()), "{refinement}: another topology");
    let normals = refinement.limit_normals(&fine, &finer).unwrap();
    assert!(normals.iter().all(|n| n.length() < 0.5 || (n.length() - 1.0).abs() < 1e-12), "{refinement}");
    Some((fine, finer))
}

/// Refines until tasks are shared out among threads, and solves there. What is computed has been held against formulas
/// on small meshes; here the operator is held against the explicit matrix, and threads against each other.
pub fn large(case: &Case, topology: &Topology) {
    const ENOUGH: usize = 5000;
    let Surface::Closed { euler } = Surface::of(&case.mesh) else { return };
    let triangles = case.mesh.faces.uniform_size() == Some(3);
    let refinement = if triangles { Refinement::Loop } else { Refinement::DooSabin };
    let (mut mesh, mut topology) = (case.mesh.clone(), topology.clone());
    while mesh.len() < ENOUGH {
        (mesh, topology) = step(refinement, &mesh, &topology, euler).unwrap();
    }
    for scheme in suitable(&mesh) {
        systems::large(&mesh, &topology, scheme, case.tolerance);
    }
}
