//! Meshes that a scheme refuses, and open ones under the papers' treatment of the boundary.

use limitlab::Error;
use limitlab::assemble::LimitSystem;
use limitlab::mesh::validate::Boundary;
use limitlab::mesh::{Faces, Mesh, Surface};
use limitlab::schemes::Scheme;

use crate::common::formulas::assemble;
use crate::common::meshes::*;
use crate::common::tol;

/// The error, whose two formats are one line.
fn refused(surface: &Surface, scheme: Scheme) -> Error {
    let error = LimitSystem::new(surface, scheme).unwrap_err();
    let line = error.to_string();
    assert!(!line.contains('\n') && line == format!("{error:?}"), "{line}");
    error
}

#[test]
fn loop_and_sqrt3_name_the_first_face_that_is_no_triangle() {
    for scheme in [Scheme::Loop, Scheme::Sqrt3] {
        for seed in 0..40 {
            let surface = Surface::new(small_polygons(seed)).unwrap();
            let Some(first) = surface.faces().iter().position(|f| f.len() != 3) else {
                assert!(LimitSystem::new(&surface, scheme).is_ok());
                continue;
            };
            let error = refused(&surface, scheme);
            let size = surface.faces().face(first).len();
            assert!(
                error.to_string().starts_with(&format!("face {first} has {size} corners, and {scheme} is")),
                "{error}"
            );
            let Error::NotTriangles { face, corners, scheme: name } = error else { panic!("{error}") };
            assert_eq!((face, corners, name), (first, size, scheme.name()));
        }
    }
}

/// A triangulated torus without the faces around a vertex and one more: boundary vertices of several valences.
fn open_torus() -> Mesh {
    let mesh = built_in("tri-torus:7x6");
    let kept: Vec<Vec<u32>> = (mesh.faces.iter().enumerate())
        .filter(|(f, face)| *f > 2 && !face.contains(&40))
        .map(|(_, face)| face.to_vec())
        .collect();
    // Vertex 40 has no face left: it goes.
    let faces = kept.iter().map(|f| f.iter().map(|&v| v - u32::from(v > 40)).collect::<Vec<_>>());
    let mut positions = mesh.positions;
    positions.remove(40);
    Mesh::new(positions, Faces::from_lists(faces))
}

#[test]
fn vertices_that_are_joined_twice_are_refused() {
    for m in [3, 5, 6] {
        let line = Surface::new(double_torus_row(m)).unwrap_err().to_string();
        let start = format!("{m} edges with more than two faces (first: face 0, vertices 0 and {m}, 4 face sides)");
        assert!(line.starts_with(&start), "{line}");
    }
}

#[test]
fn an_open_mesh_needs_masks_of_edges_alone() {
    let Error::Defects(report) = Surface::new(open_torus()).unwrap_err() else { panic!("an open mesh") };
    assert!(report.is_open_only());
    let surface = Surface::examined(open_torus(), None, Boundary::AsInterior).unwrap();
    for scheme in [Scheme::CatmullClark, Scheme::Nasri, Scheme::ZhengCai] {
        let error = refused(&surface, scheme);
        assert!(matches!(error, Error::Open { edges, .. } if edges == surface.boundary_edges()), "{error}");
    }
    for scheme in [Scheme::Loop, Scheme::Sqrt3] {
        let system = LimitSystem::new(&surface, scheme).unwrap();
        let plain = assemble(scheme, surface.mesh());
        for (i, theirs) in plain.a.row_iter().enumerate() {
            let sum: f64 = system.a.row_values(i).iter().sum();
            assert!((sum - 1.0).abs() <= tol::rounding(8), "{scheme}, row {i}");
            assert_eq!(system.a.row(i).len(), theirs.nnz());
            for (&j, &a) in theirs.col_indices().iter().zip(theirs.values()) {
                assert!((system.a.get(i, j) - a).abs() <= tol::rounding(2), "{scheme}");
                assert_eq!(system.m.get(i, j).to_bits(), system.m.get(j, i).to_bits());
            }
        }
        let values = plain.eigenvalues();
        assert!(values[0] >= system.bounds.lambda_min - tol::eigenvalues(surface.len(), 1.0));
    }
}
