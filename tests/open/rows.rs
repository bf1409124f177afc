//! Rows of A: they are the left eigenvectors of refinement, so that a step by hand and the rows of the finer mesh give what
//! the rows of the mesh give; and the rows of smooth vertices are those of a closed mesh, to the last bit.

use glam::DVec3;
use limitlab::assemble::{LimitSystem, Stages};
use limitlab::interpolate::limit_points;
use limitlab::mesh::features::Tags;
use limitlab::mesh::validate::Boundary;
use limitlab::mesh::{Faces, Mesh, Surface};
use limitlab::schemes::Scheme;

use super::naive::Creased;
use super::{open, random_creased, random_points, random_semi_sharp};
use crate::common::meshes::{built_in, small_mesh};

fn limits(surface: &Surface, scheme: Scheme) -> Vec<DVec3> {
    let stages = Stages::new(surface, scheme, None).unwrap();
    let matrix = stages.matrix();
    let by_rows: Vec<DVec3> = (0..surface.len()).map(|v| matrix.row_times(v, surface.positions())).collect();
    for (a, b) in by_rows.iter().zip(limit_points(surface, scheme).unwrap()) {
        assert!(a.distance(b) < 1e-14, "stored and matrix-free");
    }
    by_rows
}

type Random = fn(Scheme, u64) -> Option<(Surface, Tags)>;

fn hold_against_a_step(
    (scheme, random): (Scheme, Random),
    step: fn(&Creased) -> Creased,
    is_held: impl Fn(&Surface, usize) -> bool,
) -> usize {
    let mut held = 0;
    for seed in 0..200 {
        let Some((surface, tags)) = random(scheme, seed) else { continue };
        let coarse = limits(&surface, scheme);
        let finer = step(&Creased::of(&surface, &tags));
        let fine = limits(&finer.surface(), scheme);
        for v in (0..surface.len()).filter(|&v| is_held(&surface, v)) {
            let off = coarse[v].distance(fine[v]);
            assert!(off <= 1e-14, "{scheme}, seed {seed}, vertex {v}: {off:e}");
            held += 1;
        }
    }
    held
}

#[test]
fn rows_are_kept_by_a_step_of_catmull_clark() {
    let held = hold_against_a_step((Scheme::CatmullClark, random_creased), Creased::catmull_clark, |_, _| true);
    assert!(held > 3000, "{held}");
}

#[test]
fn rows_are_kept_by_a_step_of_loop() {
    let held = hold_against_a_step((Scheme::Loop, random_creased), Creased::loop_step, |_, _| true);
    assert!(held > 3000, "{held}");
}

/// Darts, semi-sharp edges and vertices: what is left of the sharpness on the finer mesh gives the row there.
#[test]
fn rows_with_darts_and_semi_sharp_edges_are_kept_by_a_step() {
    let random = random_semi_sharp as Random;
    let held = hold_against_a_step((Scheme::CatmullClark, random), Creased::catmull_clark, |_, _| true);
    assert!(held > 3000, "{held}");
    let held = hold_against_a_step((Scheme::Loop, random), Creased::loop_step, |_, _| true);
    assert!(held > 3000, "{held}");
}

/// In odd steps curves rest, so that only smooth vertices say anything.
#[test]
fn rows_of_smooth_vertices_are_kept_by_a_step_of_sqrt3() {
    let smooth = |surface: &Surface, v: usize| surface.features().is_none_or(|f| f.is_smooth(v));
    let held = hold_against_a_step((Scheme::Sqrt3, random_creased), Creased::sqrt3, smooth);
    assert!(held > 1000, "{held}");
}

/// Two steps of √3 on a curve: (4, 19, 4)/27 at the vertex, (10, 16, 1)/27 beside it (Kobbelt); two of Doo-Sabin: Chaikin's
/// (3, 1)/4.
#[test]
fn curve_weights_are_the_left_eigenvectors_of_the_curves_refinement() {
    let [a, v, b] = random_points(3, 1)[..] else { panic!() };
    let value = |w: f64, [a, v, b]: [DVec3; 3]| w * a + (1.0 - 2.0 * w) * v + w * b;
    let cubic = [10.0 * a + 16.0 * v + b, 4.0 * a + 19.0 * v + 4.0 * b, a + 16.0 * v + 10.0 * b].map(|p| p / 27.0);
    let w = Scheme::Sqrt3.curve_weight();
    assert!(value(w, [a, v, b]).distance(value(w, cubic)) < 1e-15);
    // The middle of a span of a quadratic B-spline is a knot of the next level, and then the middle of two points.
    let chaikin = [0.25 * a + 0.75 * v, 0.75 * v + 0.25 * b];
    for scheme in [Scheme::Nasri, Scheme::ZhengCai, Scheme::MidEdge] {
        assert!(value(scheme.curve_weight(), [a, v, b]).distance(0.5 * (chaikin[0] + chaikin[1])) < 1e-15);
    }
}

#[test]
fn rows_of_smooth_vertices_are_those_of_the_closed_mesh() {
    for scheme in Scheme::ALL {
        for seed in 0..40 {
            let closed = small_mesh(scheme, seed);
            let kept: Vec<&[u32]> = closed.faces.iter().skip(1).collect();
            let mesh = Mesh::new(closed.positions.clone(), Faces::from_lists(kept));
            let Ok(surface) = Surface::examined(mesh, None, Boundary::EdgeOnly) else { continue };
            let full = LimitSystem::new(&Surface::new(closed).unwrap(), scheme).unwrap();
            let matrix = Stages::new(&surface, scheme, None).unwrap().matrix();
            let features = surface.features().unwrap();
            for v in (0..surface.len()).filter(|&v| features.is_smooth(v)) {
                let row = |m: &limitlab::assemble::Csr| m.row(v).collect::<Vec<_>>();
                assert_eq!(row(&matrix), row(&full.a), "{scheme}, seed {seed}, vertex {v}");
            }
        }
    }
}

#[test]
fn a_triangle_and_an_open_cube() {
    let triangle = Mesh::new(vec![DVec3::ZERO, DVec3::X, DVec3::Y], Faces::from_lists([[0, 1, 2]]));
    let corners = open(triangle.clone(), Boundary::EdgeAndCorner);
    let rows = |surface: &Surface| Stages::new(surface, Scheme::Loop, None).unwrap().matrix();
    for i in 0..3 {
        for j in 0..3 {
            let expected = if i == j { 1.0 } else { 0.0 };
            assert_eq!(rows(&corners).get(i, j), expected);
            let expected = if i == j { 1.0 - 2.0 / 6.0 } else { 1.0 / 6.0 };
            assert_eq!(rows(&open(triangle.clone(), Boundary::EdgeOnly)).get(i, j), expected);
        }
    }
    // A cube without its top: (1/6, 2/3, 1/6) on the rim, n = 3 at the bottom.
    let cube = built_in("cube");
    let kept: Vec<&[u32]> = cube.faces.iter().skip(1).collect();
    let surface = open(Mesh::new(cube.positions.clone(), Faces::from_lists(kept)), Boundary::EdgeAndCorner);
    let features = surface.features().unwrap();
    assert_eq!(features.curves().len(), 1);
    assert!(features.curves()[0].closed && features.curves()[0].vertices.len() == 4);
}
