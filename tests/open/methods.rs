//! Every method on open and creased meshes, the front door, the statement of singularity.

use glam::DVec3;
use limitlab::Error;
use limitlab::analysis::comparison::with_spectrum;
use limitlab::analysis::singularity::Singularity;
use limitlab::analysis::spectrum::spectrum;
use limitlab::assemble::{LimitSystem, StagedOperator, Stages};
use limitlab::interpolate::normals::{Rotation, rotate_rings};
use limitlab::interpolate::{Interpolator, Options, Tolerance, interpolate, limit_points, staged};
use limitlab::mesh::features::{Rule, Tags};
use limitlab::mesh::generate::union;
use limitlab::mesh::validate::Boundary;
use limitlab::mesh::{Faces, Mesh, Surface};
use limitlab::schemes::Scheme;
use limitlab::solvers::local_update::Editor;
use limitlab::solvers::{Method, Outcome, Stop};
use limitlab_factorizations::dense::{small_lu, small_singular_values};
use nalgebra::{DMatrix, DVector};

use super::{grid, open, random_creased, random_points, random_semi_sharp};
use crate::common::meshes::built_in;

/// By dense elimination on the whole matrix.
fn dense(stages: &Stages, points: &[DVec3]) -> Vec<DVec3> {
    let n = points.len();
    let matrix = stages.matrix();
    let factors = small_lu(DMatrix::from_fn(n, n, |i, j| matrix.get(i, j)));
    let solved = [0, 1, 2].map(|axis| factors.solve(&DVector::from_fn(n, |i, _| points[i][axis])).unwrap());
    (0..n).map(|i| DVec3::new(solved[0][i], solved[1][i], solved[2][i])).collect()
}

fn distance(a: &[DVec3], b: &[DVec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max)
}

#[test]
fn where_no_vertex_is_smooth_every_method_is_done_at_once() {
    let corners = (0..8).map(|v| (v, 10.0)).collect();
    let cube = Surface::new(built_in("cube")).unwrap();
    let cube = cube.tagged(&Tags { corners, ..Tags::default() }).unwrap();
    let stages = Stages::new(&cube, Scheme::CatmullClark, None).unwrap();
    for method in Method::ALL {
        // Nothing is known of no rows: what is open stays so.
        let open = with_spectrum(stages.block(), method, &|| spectrum(stages.block())).unwrap();
        assert_eq!(open, method);
        let options = Options { method: Some(method), ..Options::default() };
        let found = interpolate(&cube, Scheme::CatmullClark, &options).unwrap();
        assert_eq!((found.report.outcome, found.points.as_slice()), (Outcome::Converged, cube.positions()), "{method}");
    }
}

#[test]
fn every_method_finds_what_elimination_finds() {
    let stop = Stop { tolerance: 1e-11, max_iterations: 20_000 };
    for scheme in Scheme::ALL {
        let mut tried = 0;
        for seed in 0..400 {
            let Some((surface, _)) = random_creased(scheme, seed) else { continue };
            let stages = Stages::new(&surface, scheme, None).unwrap();
            let block = stages.block();
            // What is nearly singular takes too long.
            if block.len() < 3 || spectrum(block).unwrap().a.min < 0.02 {
                continue;
            }
            let points = surface.positions();
            let expected = dense(&stages, points);
            for method in Method::ALL {
                let method = with_spectrum(block, method, &|| spectrum(block)).unwrap();
                let found = staged::run(&stages, points, method, &stop);
                assert_eq!(found.report.outcome, Outcome::Converged, "{scheme}, seed {seed}, {method}");
                let off = distance(&found.points, &expected);
                assert!(off <= 1e-8, "{scheme}, seed {seed}, {method}: {off:e}");
            }
            let found = interpolate(&surface, scheme, &Options::from(stop)).unwrap();
            assert_eq!(found.report.outcome, Outcome::Converged);
            let limits = limit_points(&surface.with_positions(found.points), scheme).unwrap();
            assert!(distance(&limits, points) <= 2.0 * stop.tolerance, "{scheme}, seed {seed}");
            tried += 1;
            if tried == 12 {
                break;
            }
        }
        assert!(tried == 12, "{scheme}: {tried}");
    }
}

#[test]
fn a_subset_goes_through_the_same_stages() {
    for scheme in Scheme::ALL {
        for seed in 0..60 {
            let Some((surface, _)) = random_creased(scheme, seed) else { continue };
            let n = surface.len();
            let marks: Vec<bool> = (0..n).map(|v| (v * v + v / 3) % 5 < 3).collect();
            let options =
                Options { interpolated: Some(&marks), tolerance: Tolerance::Absolute(1e-11), ..Options::default() };
            let order: Vec<u32> = (0..n as u32).rev().collect();
            let sweep = Method::GaussSeidel { order: Some(&order) };
            let by_sweeps = interpolate(&surface, scheme, &Options { method: Some(sweep), ..options }).unwrap();
            let by_auto = interpolate(&surface, scheme, &options).unwrap();
            assert!(distance(&by_sweeps.points, &by_auto.points) <= 1e-8, "{scheme}, seed {seed}");
            let limits = limit_points(&surface.with_positions(by_auto.points.clone()), scheme).unwrap();
            for v in 0..n {
                let reached = if marks[v] { limits[v] } else { by_auto.points[v] };
                assert!(reached.distance(surface.positions()[v]) <= 2e-11, "{scheme}, seed {seed}, vertex {v}");
            }
        }
    }
}

#[test]
fn points_that_move_are_followed() {
    let (surface, _) = (0..).find_map(|seed| random_creased(Scheme::Loop, seed)).unwrap();
    let mut interpolator = Interpolator::new(&surface, Scheme::Loop, None).unwrap();
    let stages = Stages::new(&surface, Scheme::Loop, None).unwrap();
    let stop = Stop { tolerance: 1e-12, max_iterations: 1000 };
    let mut control = Vec::new();
    for seed in 0..4 {
        let points = random_points(surface.len(), seed);
        assert_eq!(interpolator.solve(&points, &mut control, &stop).outcome, Outcome::Converged);
        assert!(distance(&control, &dense(&stages, &points)) <= 1e-9);
    }
}

#[test]
fn local_edits_on_curves_and_beside_them_are_full_solves() {
    let stop = Stop { tolerance: 1e-12, max_iterations: 1000 };
    for scheme in Scheme::ALL {
        let mut tried = 0;
        for seed in 0..400 {
            let Some((surface, _)) = random_creased(scheme, seed) else { continue };
            let stages = Stages::new(&surface, scheme, None).unwrap();
            let (block, Some(features)) = (stages.block(), surface.features()) else { continue };
            // What is nearly singular takes too long.
            if block.len() < 3 || spectrum(block).unwrap().a.min < 0.02 {
                continue;
            }
            let n = surface.len();
            let operator = StagedOperator::new(&surface, scheme).unwrap();
            // The curves are found where the start lacks them.
            let mut start = dense(&stages, surface.positions());
            operator.fixed().iter().for_each(|&c| start[c as usize] += DVec3::ONE);
            let mut editor = Editor::staged(&operator, surface.positions().to_vec(), start);
            editor.edit(&[], stop.tolerance, usize::MAX);
            let rules = [Rule::Crease, Rule::Corner, Rule::Smooth];
            let of = |rule: Rule| (0..n).filter(move |&v| features.rules()[v] == rule);
            for (k, rule) in rules.into_iter().enumerate() {
                for v in of(rule).take(2) {
                    let moves = [(v as u32, editor.points()[v] + DVec3::new(0.3, 0.1 * k as f64, -0.2))];
                    let edit = editor.edit(&moves, stop.tolerance, usize::MAX);
                    assert!(edit.max_error <= stop.tolerance);
                    let expected = dense(&stages, editor.points());
                    for (w, (a, b)) in editor.control().iter().zip(&expected).enumerate() {
                        let off = a.distance(*b);
                        let least = if features.is_smooth(w) { 1e-9 } else { 1e-13 };
                        assert!(off <= least, "{scheme}, seed {seed}, {rule:?} {v}, at {w}: {off:e}");
                    }
                }
            }
            // All at once: solved anew.
            let moves: Vec<(u32, DVec3)> = (0..n as u32).zip(random_points(n, seed + 5)).collect();
            editor.edit(&moves, stop.tolerance, usize::MAX);
            assert!(distance(editor.control(), &dense(&stages, editor.points())) <= 1e-9, "{scheme}, seed {seed}");
            tried += 1;
            if tried == 12 {
                break;
            }
        }
        assert!(tried == 12, "{scheme}: {tried}");
    }
    // Far from the edit nothing is touched, on the curve neither; and many edits at once solve all anew.
    let surface = open(grid(120, 110, false), Boundary::EdgeAndCorner);
    let operator = StagedOperator::new(&surface, Scheme::CatmullClark).unwrap();
    let mut control = Vec::new();
    let mut interpolator = Interpolator::new(&surface, Scheme::CatmullClark, None).unwrap();
    interpolator.solve(surface.positions(), &mut control, &stop);
    let mut editor = Editor::staged(&operator, surface.positions().to_vec(), control);
    let edit = editor.edit(&[(50, surface.positions()[50] + DVec3::Z)], 1e-9, usize::MAX);
    assert!(!edit.anew && edit.touched < 1500, "{edit:?}");
    let mut anew = Vec::new();
    interpolator.solve(editor.points(), &mut anew, &stop);
    assert!(distance(editor.control(), &anew) <= 1e-7);
    let moved = editor.points().iter().map(|&p| p + DVec3::new(0.0, 0.0, (0.1 * p.x).sin()));
    let moves: Vec<(u32, DVec3)> = (0..).zip(moved).collect();
    let edit = editor.edit(&moves, 1e-9, usize::MAX);
    assert!(edit.anew && edit.max_error <= 1e-9, "{edit:?}");
    interpolator.solve(editor.points(), &mut anew, &stop);
    assert!(distance(editor.control(), &anew) <= 1e-7);
}

/// Theorem: A is singular exactly where a component without boundary, crease and corner is singular by itself.
#[test]
fn the_verdict_is_that_of_the_smallest_eigenvalue() {
    for scheme in Scheme::ALL {
        for seed in 0..150 {
            let Some((surface, _)) = random_creased(scheme, seed) else { continue };
            if surface.len() > 80 {
                continue;
            }
            let stages = Stages::new(&surface, scheme, None).unwrap();
            let n = surface.len();
            let matrix = stages.matrix();
            let values = small_singular_values(DMatrix::from_fn(n, n, |i, j| matrix.get(i, j)));
            let verdict = Singularity::detect(&surface, scheme).is_singular();
            assert_eq!(values.min() < 1e-10, verdict, "{scheme}, seed {seed}: {:e}", values.min());
            let bounds = stages.block().bounds;
            if !stages.block().is_empty() {
                let ends = limitlab::analysis::dense::eigenvalues(stages.block()).unwrap();
                assert!(ends.a[0] >= bounds.lambda_min - 1e-12 && ends.a.iter().all(|&x| x <= 1.0 + 1e-12));
                assert!(ends.jacobi[0] >= bounds.jacobi_lambda_min - 1e-12);
                assert!(ends.jacobi.iter().all(|&x| x <= bounds.jacobi_lambda_max + 1e-12));
            }
        }
    }
    // A cube is singular under Catmull-Clark; with one corner it is not.
    let cube = Surface::new(built_in("cube")).unwrap();
    assert!(Singularity::detect(&cube, Scheme::CatmullClark).is_singular());
    let tagged = cube.tagged(&Tags { corners: vec![(0, 10.0)], ..Tags::default() }).unwrap();
    assert!(!Singularity::detect(&tagged, Scheme::CatmullClark).is_singular());
    let block = Stages::new(&tagged, Scheme::CatmullClark, None).unwrap();
    let least = limitlab::analysis::dense::eigenvalues(block.block()).unwrap().a[0];
    assert!((least - 0.0334).abs() < 5e-5, "{least}");
    // Nor is one without its top, but a whole one beside that.
    let kept: Vec<&[u32]> = cube.faces().iter().skip(1).collect();
    let opened = Mesh::new(cube.positions().to_vec(), Faces::from_lists(kept));
    let verdict = |mesh| Singularity::detect(&open(mesh, Boundary::EdgeAndCorner), Scheme::CatmullClark);
    assert!(!verdict(opened.clone()).is_singular());
    let both = verdict(union(&[opened, cube.into_mesh()]));
    assert_eq!((both.components, both.singular.len(), both.singular[0].first_vertex), (2, 1, 8));
}

/// The chain with GMRES on darts and semi-sharp vertices, and LU of all.
#[test]
fn darts_and_semi_sharp_vertices_are_interpolated() {
    for scheme in [Scheme::CatmullClark, Scheme::Loop] {
        let mut tried = 0;
        for seed in 0..120 {
            let Some((surface, _)) = random_semi_sharp(scheme, seed) else { continue };
            let stages = Stages::new(&surface, scheme, None).unwrap();
            let n = surface.len();
            let matrix = stages.matrix();
            // What is nearly singular takes too long.
            if small_singular_values(DMatrix::from_fn(n, n, |i, j| matrix.get(i, j))).min() < 0.02 {
                continue;
            }
            let points = surface.positions();
            let expected = dense(&stages, points);
            let options = Options { tolerance: Tolerance::Absolute(1e-11), ..Options::default() };
            for method in [None, Some(Method::Lu)] {
                let found = interpolate(&surface, scheme, &Options { method, ..options }).unwrap();
                assert_eq!(found.report.outcome, Outcome::Converged, "{scheme}, seed {seed}, {method:?}");
                assert!(distance(&found.points, &expected) < 1e-8, "{scheme}, seed {seed}, {method:?}");
                assert!(found.report.last().max <= 1e-11);
            }
            let limits = limit_points(&surface.with_positions(expected), scheme).unwrap();
            assert!(distance(&limits, points) < 1e-12 * n as f64, "{scheme}, seed {seed}");
            // Points that move, from the control points that are there.
            let mut interpolator = Interpolator::new(&surface, scheme, None).unwrap();
            let stop = Stop { tolerance: 1e-11, max_iterations: 10_000 };
            let mut control = Vec::new();
            for seed in 0..3 {
                let points = random_points(n, seed);
                assert_eq!(interpolator.solve(&points, &mut control, &stop).outcome, Outcome::Converged);
                assert!(distance(&control, &dense(&stages, &points)) < 1e-8);
            }
            tried += 1;
        }
        assert!(tried > 40, "{scheme}: {tried}");
    }
}

#[test]
fn what_cannot_be_is_refused_by_name() {
    let cube = Surface::new(built_in("cube")).unwrap();
    let dart = cube.tagged(&Tags { creases: vec![([0, 1], 10.0)], ..Tags::default() }).unwrap();
    assert_eq!(dart.features().unwrap().count(Rule::Dart), 2);
    assert!(matches!(Stages::new(&dart, Scheme::Nasri, None), Err(Error::Dart { vertex: 0, .. })));
    assert!(matches!(LimitSystem::new(&dart, Scheme::CatmullClark), Err(Error::Creased { .. })));
    let cholesky = Options { method: Some(Method::Cholesky), ..Options::default() };
    let refused = interpolate(&dart, Scheme::CatmullClark, &cholesky);
    assert!(matches!(refused, Err(Error::Unsymmetric { vertex: 0, method: "cholesky", .. })));
    let semi = cube.tagged(&Tags { creases: vec![([0, 1], 2.5)], ..Tags::default() }).unwrap();
    assert_eq!(semi.features().unwrap().count(Rule::SemiSharp), 2);
    assert!(matches!(Stages::new(&semi, Scheme::ZhengCai, None), Err(Error::SemiSharp { vertex: 0, .. })));
    let corner = cube.tagged(&Tags { corners: vec![(3, 12.0)], ..Tags::default() }).unwrap();
    assert!(matches!(LimitSystem::new(&corner, Scheme::CatmullClark), Err(Error::Creased { .. })));
    let message = |tags: Tags| cube.tagged(&tags).unwrap_err().to_string();
    let creases = |edge, sharpness| Tags { creases: vec![(edge, sharpness)], ..Tags::default() };
    assert!(message(creases([0, 6], 10.0)).contains("edge 0–6 does not exist"));
    assert!(message(creases([0, 60], 10.0)).contains("edge 0–60 does not exist"));
    assert!(message(creases([0, 1], -1.0)).contains("sharpness -1"));
    assert!(message(creases([0, 1], f64::NAN)).contains("sharpness NaN"));
    assert!(message(Tags { corners: vec![(8, 10.0)], ..Tags::default() }).contains("vertex 8 does not exist"));
    let contradiction = Tags { boundary: Boundary::AsInterior, corners: vec![(0, 10.0)], ..Tags::default() };
    assert!(message(contradiction).contains("contradict"));
    // Sharpness zero is none.
    assert!(cube.tagged(&creases([0, 1], 0.0)).unwrap().features().is_none());
}

/// Of smooth vertices of open and creased meshes: all limit points stay, and the normals are those given.
#[test]
fn turned_rings_beside_curves_have_the_given_normals() {
    for scheme in [Scheme::CatmullClark, Scheme::Loop, Scheme::Sqrt3] {
        let (mut turned, refinement) = (0, scheme.refinement());
        for seed in 0..40 {
            let Some((surface, _)) = random_creased(scheme, seed) else { continue };
            let Some(features) = surface.features() else { continue };
            if surface.len() > 60 {
                continue;
            }
            let before = refinement.limit_positions(&surface).unwrap();
            let found = refinement.limit_normals(&surface).unwrap();
            let lean = random_points(surface.len(), seed + 9);
            let is_given = |v: usize| v % 3 != 2 && features.is_smooth(v) && found[v] != DVec3::ZERO;
            let wanted: Vec<Option<DVec3>> =
                (0..surface.len()).map(|v| is_given(v).then(|| found[v] + 0.4 * lean[v])).collect();
            for levels in [1, 2] {
                let rotation = Rotation { levels, ..Rotation::default() };
                let result = rotate_rings(&surface, refinement, &wanted, rotation).unwrap();
                let fine = refinement.refined(&result.surface).unwrap();
                let limits = refinement.limit_positions(&fine).unwrap();
                assert!(distance(&before, &limits[..surface.len()]) < 1e-12, "{scheme}, seed {seed}");
                let after = refinement.limit_normals(&fine).unwrap();
                for v in 0..surface.len() {
                    let expected = wanted[v].map_or(found[v], |n| n.normalize());
                    assert!(after[v].distance(expected) < 1e-9, "{scheme}, seed {seed}, vertex {v}");
                    turned += usize::from(wanted[v].is_some());
                }
            }
        }
        assert!(turned > 200, "{scheme}: {turned}");
    }
}

/// What has no rules for boundaries says so, and gives no wrong answer.
#[test]
fn rings_on_a_boundary_are_not_turned() {
    let surface = open(super::grid(5, 6, false), Boundary::EdgeAndCorner);
    let mut normals = vec![None; surface.len()];
    normals[8] = Some(DVec3::Z);
    let turn = |normals: &[Option<DVec3>]| {
        rotate_rings(
            &surface,
            Scheme::CatmullClark.refinement(),
            normals,
            Rotation { levels: 1, ..Rotation::default() },
        )
    };
    assert!(turn(&normals).is_ok());
    normals[0] = Some(DVec3::Z);
    let message = turn(&normals).unwrap_err().to_string();
    assert!(message.contains("vertex 0 is sharp"), "{message}");
}

#[test]
fn a_mesh_without_smooth_vertices_has_its_control_points_by_elimination() {
    let surface = open(super::grid(2, 6, false), Boundary::EdgeOnly);
    let stages = Stages::new(&surface, Scheme::CatmullClark, None).unwrap();
    assert!(stages.block().is_empty());
    let expected = dense(&stages, surface.positions());
    for method in [None, Some(Method::Cholesky), Some(Method::Pia), Some(Method::Cg), Some(Method::Lu)] {
        let found = interpolate(&surface, Scheme::CatmullClark, &Options { method, ..Options::default() }).unwrap();
        assert_eq!(found.report.outcome, Outcome::Converged, "{method:?}");
        assert!(distance(&found.points, &expected) < 1e-14, "{method:?}");
    }
}
