//! Thall's local iteration, metrics, normals and attributes.

use std::f64::consts::PI;
use std::ops::ControlFlow;

use glam::{DQuat, DVec3};
use limitlab::assemble::LimitSystem;
use limitlab::interpolate::normals::{Rotation, rotate_rings};
use limitlab::interpolate::thall::*;
use limitlab::mesh::{Faces, Mesh, Surface, builtin};
use limitlab::schemes::{Refinement, Scheme, catmull_clark};
use limitlab::solvers::iteration::Iterate;
use limitlab::solvers::{Method, Outcome, Stop, run, run_watched, solve};

use crate::common::pipelines::{ROUNDING, centroid, distance, noisy_surface};

const MESHES: [&str; 5] = ["torus:7x5", "quad-sphere:2", "dodecahedron", "irregular-poly:60", "icosphere:1"];

fn run_local(surface: &Surface, inverse: Inverse, iterations: usize) -> Vec<Vec<DVec3>> {
    let mut local = LocalIteration::new(surface, inverse);
    let mut iterates = vec![local.points().to_vec()];
    for _ in 0..iterations {
        local.errors();
        local.advance().unwrap();
        iterates.push(local.points().to_vec());
    }
    iterates
}

#[test]
fn local_masks_are_jacobi_with_one_half_iterate_by_iterate() {
    for name in MESHES {
        let surface = noisy_surface(name);
        let system = LimitSystem::new(&surface, Scheme::CatmullClark).unwrap();
        let iterates = run_local(&surface, Inverse::Exact, 12);
        let stop = Stop { tolerance: 0.0, max_iterations: 12 };
        run_watched(&system, surface.positions(), Method::Thall, &stop, &mut |step| {
            let error = distance(step.points, &iterates[step.iteration]);
            assert!(error < ROUNDING, "{name} {}: {error:e}", step.iteration);
            ControlFlow::Continue(())
        });
    }
}

/// v + δ has the given limit when the other vertices stay, beside faces of any size; with R held fixed it has
/// not, except on quads.
#[test]
fn the_inverse_mask_gives_the_wanted_limit_of_one_vertex() {
    for (name, quads) in [("torus:7x5", true), ("dodecahedron", false), ("irregular-poly:60", false)] {
        let surface = noisy_surface(name);
        for inverse in [Inverse::Exact, Inverse::Regular] {
            let step = &run_local(&surface, inverse, 1)[1];
            let mut worst: f64 = 0.0;
            for (v, moved) in step.iter().enumerate() {
                let mut one = surface.clone();
                one.positions_mut()[v] += 2.0 * (*moved - surface.positions()[v]);
                let limit = catmull_clark::limit_positions(&one).unwrap()[v];
                worst = worst.max(limit.distance(surface.positions()[v]));
            }
            if quads || inverse == Inverse::Exact {
                assert!(worst < ROUNDING, "{name} {worst:e}");
            } else {
                assert!(worst > 1e-3, "{name} {worst:e}");
            }
        }
    }
}

#[test]
fn both_inverses_converge_to_the_direct_solution() {
    let surface = noisy_surface("irregular-poly:60");
    let system = LimitSystem::new(&surface, Scheme::CatmullClark).unwrap();
    let stop = Stop { tolerance: 1e-13, max_iterations: 5000 };
    let exact = run(&system, surface.positions(), Method::Lu, &stop).points;
    for inverse in [Inverse::Exact, Inverse::Regular] {
        let mut local = LocalIteration::new(&surface, inverse);
        let report = solve(&mut local, &stop, &mut |_| ControlFlow::Continue(()));
        assert_eq!(report.outcome, Outcome::Converged);
        assert!(distance(local.points(), &exact) < 1e-9);
    }
}

#[test]
fn local_iterates_follow_affine_maps() {
    let surface = noisy_surface("irregular-poly:60");
    let map = |p: DVec3| DVec3::new(p.x + 2.0 * p.y, p.z - 3.0, 0.5 * p.x - p.y + 4.0 * p.z);
    let moved = surface.with_positions(surface.positions().iter().map(|p| map(*p)).collect());
    let (here, there) = (run_local(&surface, Inverse::Exact, 6), run_local(&moved, Inverse::Exact, 6));
    for (a, b) in here.iter().zip(&there) {
        let a: Vec<DVec3> = a.iter().map(|p| map(*p)).collect();
        assert!(distance(&a, b) < ROUNDING);
    }
}

/// Points and normals of a sphere: the atom is its centre and radius, whichever involutes are taken.
#[test]
fn medial_metrics_in_closed_form() {
    let mesh = builtin::icosahedron();
    let center = DVec3::new(1.0, -2.0, 0.5);
    let normals: Vec<DVec3> = mesh.positions.iter().map(|p| p.normalize()).collect();
    let at =
        |radius: f64, shift: DVec3| -> Vec<DVec3> { normals.iter().map(|n| center + shift + radius * *n).collect() };
    let given = at(2.0, DVec3::ZERO);
    let involutes = Faces::from_lists([vec![0u32, 1], vec![2, 7, 5], vec![3]]);
    let atom = MedialAtom::fit((0..4).map(|v| (given[v], normals[v]))).unwrap();
    assert!((atom.radius - 2.0).abs() < ROUNDING && atom.position.distance(center) < ROUNDING);
    // A surface of another radius has the same centre; a moved one is off by shift over the given radius.
    let same = medial_shifts(&involutes, (&at(1.7, DVec3::ZERO), &normals), (&given, &normals));
    assert!(same[0].unwrap() < ROUNDING && same[1].unwrap() < ROUNDING && same[2].is_none());
    let shift = DVec3::new(0.3, 0.0, 0.4);
    let moved = medial_shifts(&involutes, (&at(2.0, shift), &normals), (&given, &normals));
    assert!((moved[0].unwrap() - 0.25).abs() < ROUNDING);
    // Over the given radius, not the new one.
    let larger = medial_shifts(&involutes, (&at(5.0, shift), &normals), (&given, &normals));
    assert!((larger[0].unwrap() - 0.25).abs() < ROUNDING);
    let scaled = scaled_distances(&at(2.0, shift), &given, &[2.0; 12]);
    assert!(scaled.iter().all(|d| (d - 0.25).abs() < ROUNDING));
}

#[test]
fn normal_deviation_is_the_angle() {
    let turn = |angle: f64| DQuat::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), angle) * DVec3::Y;
    for wanted in [0.0, 1e-9, 0.3, 2.0, PI - 1e-9, PI] {
        let found = normal_deviations(&[turn(wanted)], &[DVec3::Y])[0];
        assert!((found - wanted).abs() < 1e-15 + ROUNDING * wanted, "{wanted}");
    }
    assert_eq!(normal_deviations(&[DVec3::ZERO], &[DVec3::Y]), [PI]);
}

fn primal(name: &str) -> (Surface, Vec<Refinement>) {
    let surface = noisy_surface(name);
    let mut schemes = vec![Refinement::CatmullClark];
    if surface.faces().uniform_size() == Some(3) {
        schemes.extend([Refinement::Loop, Refinement::Sqrt3]);
    }
    (surface, schemes)
}

/// Directions that lean away from the vertex normals by up to about a radian; none at every third vertex.
fn leaning(surface: &Surface) -> Vec<Option<DVec3>> {
    let outward = catmull_clark::limit_normals(surface).unwrap();
    let lean = |v: usize| DVec3::new((v as f64).sin(), (3.0 * v as f64).cos(), (v as f64).cos());
    (0..surface.len()).map(|v| (v % 3 != 2).then(|| 1.5 * outward[v] + lean(v))).collect()
}

/// Exactly the wanted normals, and all limit points where they were; spread over levels too.
#[test]
fn turned_rings_have_the_given_normals_and_keep_the_limits() {
    for name in MESHES {
        let (surface, schemes) = primal(name);
        let wanted = leaning(&surface);
        for scheme in schemes {
            let before = scheme.limit_positions(&surface).unwrap();
            let untouched = scheme.limit_normals(&surface).unwrap();
            for levels in [1, 3] {
                let rotation = Rotation { levels, ..Rotation::default() };
                let result = rotate_rings(&surface, scheme, &wanted, rotation).unwrap();
                assert_eq!(result.refinements, levels + 1);
                // One more refinement: nothing depends on the level where it is looked at.
                let fine = scheme.refined(&result.surface).unwrap();
                let limits = scheme.limit_positions(&fine).unwrap();
                assert!(distance(&before, &limits[..surface.len()]) < ROUNDING);
                let found = scheme.limit_normals(&fine).unwrap();
                for (v, normal) in wanted.iter().enumerate() {
                    let expected = normal.map_or(untouched[v], |n| n.normalize());
                    assert!(found[v].distance(expected) < ROUNDING, "{name} {scheme} {v}");
                }
            }
        }
    }
}

#[test]
fn rings_turn_only_beyond_the_threshold_and_stop_at_the_tolerance() {
    let surface = noisy_surface("irregular-poly:60");
    let wanted = leaning(&surface);
    let before = catmull_clark::limit_normals(&surface).unwrap();
    let rotation = Rotation { threshold: 0.4, tolerance: 0.1, levels: 2 };
    let result = rotate_rings(&surface, Refinement::CatmullClark, &wanted, rotation).unwrap();
    let after = catmull_clark::limit_normals(&result.surface).unwrap();
    let (mut turned, mut left) = (0, 0);
    for (v, normal) in wanted.iter().enumerate() {
        let Some(normal) = normal.map(DVec3::normalize) else {
            continue;
        };
        let (off, now) = (before[v].angle_between(normal), after[v].angle_between(normal));
        if off > 0.4 {
            assert!((now - 0.1).abs() < 1e-7, "{v}: {off} {now}");
            turned += 1;
        } else {
            assert!(after[v].distance(before[v]) < ROUNDING);
            left += 1;
        }
    }
    assert_eq!(result.turned.len(), turned);
    assert!(turned > 3 && left > 3, "the test sees both: {turned} {left}");
    // A normal within the tolerance is right, whatever the threshold.
    let rotation = Rotation { threshold: 0.0, tolerance: 0.4, levels: 1 };
    let tolerant = rotate_rings(&surface, Refinement::CatmullClark, &wanted, rotation).unwrap().turned;
    assert!(tolerant.iter().map(|t| t.0).eq(result.turned.iter().map(|t| t.0)));
    assert!(tolerant.iter().all(|t| t.1 > 0.0));
}

#[test]
fn normals_without_sense_are_errors_that_name_the_vertex() {
    let surface = Surface::new(builtin::icosahedron()).unwrap();
    let refused = |normal: DVec3| {
        let mut normals = vec![None; surface.len()];
        normals[4] = Some(normal);
        let result = rotate_rings(&surface, Refinement::Loop, &normals, Rotation::default());
        result.unwrap_err().to_string()
    };
    for normal in [DVec3::ZERO, DVec3::NAN, DVec3::splat(f64::INFINITY)] {
        assert!(refused(normal).contains("vertex 4") && refused(normal).contains("no direction"));
    }
    assert!(refused(-surface.positions()[4]).contains("vertex 4: the given normal is opposite"));
    let flat = surface.with_positions(surface.positions().iter().map(|p| DVec3::X * p.x).collect());
    let normals = vec![Some(DVec3::Z); surface.len()];
    let result = rotate_rings(&flat, Refinement::Loop, &normals, Rotation::default());
    assert!(result.unwrap_err().to_string().contains("vertex 0: the surface has no normal"));
}

/// Values stay by the midpoint rule, creep by the scheme's own, and come back where they interpolate.
#[test]
fn attributes_stay_creep_or_interpolate() {
    let surface = noisy_surface("irregular-poly:60");
    let values: Vec<DVec3> =
        (0..surface.len()).map(|v| DVec3::new((v as f64).sin(), v as f64 / 60.0, (0.3 * v as f64).cos())).collect();
    let refine = |values: Vec<DVec3>, rule| refine_attributes(&surface, values, rule).unwrap();
    let mid = refine(values.clone(), AttributeRule::Midpoint);
    assert_eq!(mid[..surface.len()], values);
    let fine = catmull_clark::refine(&surface).unwrap();
    assert_eq!(mid.len(), fine.len());
    let field = surface.with_positions(values.clone());
    let first_face = surface.len() + surface.topology().edges();
    for f in 0..surface.faces().len() {
        assert!(mid[first_face + f].distance(centroid(field.mesh(), f)) < ROUNDING);
        // The new quads name edge points between their even vertices: the numbering is that of the mesh.
        let quad = fine.faces.face(surface.faces().range(f).start);
        let face = surface.faces().face(f);
        let mean = 0.5 * (values[face[0] as usize] + values[face[1] as usize]);
        assert!(mid[quad[1] as usize].distance(mean) < ROUNDING);
    }
    let crept = refine(values.clone(), AttributeRule::Scheme);
    assert!(distance(&crept[..surface.len()], &values) > 1e-2);
    // The limit system is that of the points: solved for the values, their limits are the given ones.
    let system = LimitSystem::new(&surface, Scheme::CatmullClark).unwrap();
    let stop = Stop { tolerance: 1e-13, max_iterations: 10 };
    let control = run(&system, &values, Method::Lu, &stop).points;
    let refined = Surface::new(Mesh::new(refine(control, AttributeRule::Scheme), fine.faces)).unwrap();
    let limits = catmull_clark::limit_positions(&refined).unwrap();
    assert!(distance(&limits[..surface.len()], &values) < 1e-10);
}
