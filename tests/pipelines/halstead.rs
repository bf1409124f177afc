//! Fair interpolation: constraints, minimality, affine maps, singular meshes, errors per iteration.

use glam::DVec3;
use limitlab::assemble::LimitSystem;
use limitlab::interpolate::halstead::{Fairness, LEVELS, Weights, fit, follow};
use limitlab::interpolate::zheng_cai::Constraints;
use limitlab::mesh::{Surface, builtin};
use limitlab::schemes::{Refinement, Scheme, catmull_clark};
use limitlab::solvers::{Method, Outcome, Stop, run};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::common::pipelines::{distance, noisy, noisy_surface};

/// All points, nothing else.
const ALL: Constraints = Constraints { interpolated: None, normals: None, handles: None };

/// Rounding of a system of some thousand unknowns, for points of size 1.
const SOLVED: f64 = 1e-10;

fn limits_and_normals(surface: &Surface, originals: usize) -> (Vec<DVec3>, Vec<DVec3>) {
    let mut limits = catmull_clark::limit_positions(surface).unwrap();
    let mut normals = catmull_clark::limit_normals(surface).unwrap();
    limits.truncate(originals);
    normals.truncate(originals);
    (limits, normals)
}

const MESHES: [&str; 4] = ["torus:4x5", "icosahedron", "irregular-poly:30", "cube"];

#[test]
fn the_fit_meets_points_and_normals() {
    for name in MESHES {
        let surface = noisy_surface(name);
        let fairness = Fairness::new(&surface).unwrap();
        let plain = fit(&fairness, surface.positions(), &ALL, Weights::default()).unwrap();
        let (limits, before) = limits_and_normals(&plain.surface, surface.len());
        assert!(distance(&limits, surface.positions()) < SOLVED, "{name}");
        let wanted: Vec<Option<DVec3>> = before
            .iter()
            .enumerate()
            .map(|(v, n)| (v % 2 == 0).then(|| *n + 0.3 * DVec3::new((v as f64).sin(), 0.5, (v as f64).cos())))
            .collect();
        let wishes = Constraints { normals: Some(&wanted), ..ALL };
        let with = fit(&fairness, surface.positions(), &wishes, Weights::default()).unwrap();
        let (limits, found) = limits_and_normals(&with.surface, surface.len());
        assert!(distance(&limits, surface.positions()) < SOLVED);
        for (n, wanted) in found.iter().zip(&wanted) {
            assert!(wanted.is_none_or(|w| n.cross(w.normalize()).length() < 1e-8), "{name}");
        }
        // A further constraint costs energy.
        let weights = Weights::default();
        assert!(with.energies.weighted(weights) > plain.energies.weighted(weights));
    }
}

/// The energies by differences of limit points on a fine grid, over the same part of the surface: all but the
/// quarters beside extraordinary vertices.
#[test]
fn energies_are_those_of_second_differences() {
    const DEEPER: usize = 4;
    // In units of the quads of the first refinement.
    let h = 0.5f64.powi((LEVELS + DEEPER) as i32 - 1);
    for name in ["cube", "tetrahedron", "bipyramid:5"] {
        let surface = noisy_surface(name);
        let fairness = Fairness::new(&surface).unwrap();
        let mut fine = fairness.fine.clone();
        let mut counted = vec![true; fine.faces().len()];
        for level in 0..DEEPER {
            // A quarter has the number of its parent's corner.
            counted = counted.iter().flat_map(|&c| [c; 4]).collect();
            fine = Refinement::CatmullClark.refined(&fine).unwrap();
            if level == 0 {
                for (counted, face) in counted.iter_mut().zip(fine.faces().iter()) {
                    *counted = face.iter().all(|&v| fine.incidence().face_count(v as usize) == 4);
                }
            }
        }
        let limits = catmull_clark::limit_positions(&fine).unwrap();
        let corners = fine.faces().corners();
        let at = |c: u32| limits[corners[c as usize] as usize];
        let mut star = Vec::new();
        let (mut thin_plate, mut membrane) = (0.0, 0.0);
        for (v, &here) in limits.iter().enumerate() {
            fine.topology().star(fine.faces(), v, &mut star);
            // Each face around it gives a quarter of its area.
            let faces = star.iter().filter(|&&c| counted[fine.incidence().face_of(c)]).count();
            if faces == 0 {
                continue;
            }
            assert_eq!(star.len(), 4);
            let next = |c: u32| fine.incidence().next(fine.faces(), c);
            let [e, n, w, s] = [0, 1, 2, 3].map(|k| at(next(star[k])));
            let [ne, nw, sw, se] = [0, 1, 2, 3].map(|k| at(next(next(star[k]))));
            let [uu, vv, uv] = [e - 2.0 * here + w, n - 2.0 * here + s, (ne - nw + sw - se) / 4.0];
            let [u, v] = [(e - w) / 2.0, (n - s) / 2.0];
            let area = 0.25 * faces as f64 * h * h;
            thin_plate += area * (uu.length_squared() + 2.0 * uv.length_squared() + vv.length_squared()) / h.powi(4);
            membrane += area * (u.length_squared() + v.length_squared()) / (h * h);
        }
        let found = fairness.energies_of(&surface).unwrap();
        assert!((found.thin_plate / thin_plate - 1.0).abs() < 0.01, "{name}: {} {thin_plate}", found.thin_plate);
        assert!((found.membrane / membrane - 1.0).abs() < 0.01, "{name}: {} {membrane}", found.membrane);
    }
}

/// xᵀKx is least among all x that meet the points: the derivative along every direction in the null space of the
/// limit masks vanishes, and the interpolating control mesh of the given faces, where there is one, costs more.
#[test]
fn the_fit_is_the_fairest() {
    for (name, weights) in MESHES.iter().zip([
        Weights::default(),
        Weights { thin_plate: 1.0, membrane: 0.01 },
        Weights { thin_plate: 0.0, membrane: 1.0 },
        Weights::default(),
    ]) {
        let surface = noisy_surface(name);
        let fairness = Fairness::new(&surface).unwrap();
        let best = fit(&fairness, surface.positions(), &ALL, weights).unwrap();
        let mut rng = ChaCha8Rng::seed_from_u64(11);
        for _ in 0..5 {
            let mut step = best.surface.clone();
            for p in step.positions_mut() {
                *p = DVec3::from_array(std::array::from_fn(|_| rng.random_range(-1.0..1.0)));
            }
            // The own weight n/(n+5) takes the limit of each original vertex to zero; rings are disjoint.
            let limits = catmull_clark::limit_positions(&step).unwrap();
            for (v, limit) in limits[..surface.len()].iter().enumerate() {
                let n = step.incidence().face_count(v) as f64;
                step.positions_mut()[v] -= (n + 5.0) / n * *limit;
            }
            let gradient = |k: &limitlab::assemble::Csr| -> f64 {
                (0..step.len()).map(|i| step.positions()[i].dot(k.row_times(i, best.surface.positions()))).sum()
            };
            let (thin, membrane) = (gradient(&fairness.thin_plate), gradient(&fairness.membrane));
            let slope = weights.thin_plate * thin + weights.membrane * membrane;
            let scale = best.energies.weighted(weights) + fairness.energies(step.positions()).weighted(weights);
            assert!(slope.abs() < SOLVED * scale, "{name} {slope:e} {scale:e}");
        }
        let system = LimitSystem::new(&surface, Scheme::CatmullClark).unwrap();
        let solution = run(&system, surface.positions(), Method::Lu, &Stop { tolerance: 1e-12, max_iterations: 10 });
        if solution.report.outcome == Outcome::Converged {
            let control = surface.with_positions(solution.points);
            let other = fairness.energies_of(&control).unwrap();
            assert!(best.energies.weighted(weights) <= other.weighted(weights), "{name}");
        } else {
            assert_eq!(*name, "cube");
        }
    }
}

#[test]
fn the_fit_follows_affine_maps() {
    let surface = noisy_surface("irregular-poly:30");
    let map = |p: &DVec3| DVec3::new(p.x + 2.0 * p.y, p.z - 3.0, 0.5 * p.x - p.y + 4.0 * p.z);
    let moved: Vec<DVec3> = surface.positions().iter().map(map).collect();
    let fairness = Fairness::new(&surface).unwrap();
    let here = fit(&fairness, surface.positions(), &ALL, Weights::default()).unwrap();
    let there = fit(&fairness, &moved, &ALL, Weights::default()).unwrap();
    let here: Vec<DVec3> = here.surface.positions().iter().map(map).collect();
    assert!(distance(&here, there.surface.positions()) < 10.0 * SOLVED);
}

#[test]
fn weights_and_normals_without_sense_are_errors() {
    let surface = Surface::new(builtin::icosahedron()).unwrap();
    let fairness = Fairness::new(&surface).unwrap();
    for (thin_plate, membrane) in [(1.0, 0.0), (-1.0, 1.0), (f64::NAN, 1.0), (1.0, f64::INFINITY)] {
        let weights = Weights { thin_plate, membrane };
        let text = fit(&fairness, surface.positions(), &ALL, weights).unwrap_err().to_string();
        assert!(text.contains("fairness weights"), "{text}");
    }
    let mut normals = vec![None; 12];
    normals[3] = Some(DVec3::ZERO);
    let refused = |wishes: Constraints| {
        let found = fit(&fairness, surface.positions(), &wishes, Weights::default());
        found.unwrap_err().to_string()
    };
    let text = refused(Constraints { normals: Some(&normals), ..ALL });
    assert!(text.contains("vertex 3"), "{text}");
    let mut marks = vec![true; 12];
    marks[3] = false;
    normals[3] = Some(DVec3::Z);
    let text = refused(Constraints { interpolated: Some(&marks), normals: Some(&normals), ..ALL });
    assert!(text.contains("vertex 3: a normal is given where"), "{text}");
    let text = refused(Constraints { handles: Some(&[1.0; 12]), ..ALL });
    assert!(text.contains("type-V faces"), "{text}");
    let text = refused(Constraints { interpolated: Some(&[false; 12]), ..ALL });
    assert!(text.contains("no vertex"), "{text}");
}

/// With fewer points the surface is fairer, still meets those, and is determined: at an optimum the energy's gradient
/// is a combination of the constraints, so no admissible direction lowers it.
#[test]
fn a_subset_is_met_by_a_fairer_surface() {
    for name in MESHES {
        let surface = noisy_surface(name);
        let fairness = Fairness::new(&surface).unwrap();
        let weights = Weights::default();
        let all = fit(&fairness, surface.positions(), &ALL, weights).unwrap();
        let marks: Vec<bool> = (0..surface.len()).map(|v| v % 3 != 1).collect();
        let wishes = Constraints { interpolated: Some(&marks), ..ALL };
        let some = fit(&fairness, surface.positions(), &wishes, weights).unwrap();
        let (limits, _) = limits_and_normals(&some.surface, surface.len());
        let mut moved = 0.0f64;
        for (v, marked) in marks.iter().enumerate() {
            let off = limits[v].distance(surface.positions()[v]);
            assert!(!marked || off < SOLVED, "{name} {v}");
            moved = moved.max(off);
        }
        assert!(moved > 1e-3, "{name}: the others are free");
        assert!(some.errors.max < SOLVED);
        let energy = some.energies.weighted(weights);
        assert!(energy < all.energies.weighted(weights) * (1.0 - 1e-4), "{name}");
        // Moving towards another surface through the same points costs energy to second order only.
        let towards = |t: f64| {
            let pairs = some.surface.positions().iter().zip(all.surface.positions());
            let x: Vec<DVec3> = pairs.map(|(a, b)| a.lerp(*b, t)).collect();
            fairness.energies(&x).weighted(weights) - energy
        };
        let ratio = towards(-0.5) / towards(0.5);
        assert!((ratio - 1.0).abs() < 1e-6, "{name} {ratio}");
    }
    // Two components, one of them held by nothing.
    let one = noisy("torus:4x5");
    let n = one.len();
    let mut two = one.clone();
    for p in &one.positions {
        two.positions.push(*p + 10.0 * DVec3::X);
    }
    for face in one.faces.iter() {
        let moved: Vec<u32> = face.iter().map(|v| v + n as u32).collect();
        two.faces.push(&moved);
    }
    let two = Surface::new(two).unwrap();
    let marks: Vec<bool> = (0..2 * n).map(|v| v < n).collect();
    let wishes = Constraints { interpolated: Some(&marks), ..ALL };
    let fairness = Fairness::new(&two).unwrap();
    let error = fit(&fairness, two.positions(), &wishes, Weights::default()).unwrap_err();
    assert!(error.to_string().contains("component of vertex 20"), "{error}");
}

#[test]
fn every_iterate_is_measured_and_the_last_is_the_control_mesh() {
    let surface = noisy_surface("quad-sphere:2");
    let system = LimitSystem::new(&surface, Scheme::CatmullClark).unwrap();
    let fairness = Fairness::new(&surface).unwrap();
    let normals: Vec<DVec3> = surface.positions().iter().map(|p| p.normalize()).collect();
    let stop = Stop { tolerance: 1e-8, max_iterations: 2000 };
    let (rows, solution) = follow(&surface, &system, &fairness, &normals, Method::Pia, &stop).unwrap();
    assert_eq!(solution.report.outcome, Outcome::Converged);
    assert_eq!(rows.len(), solution.report.iterations + 1);
    let errors: Vec<_> = rows.iter().map(|r| r.errors).collect();
    assert_eq!(errors, solution.report.history);
    // The start is the plain surface of the given mesh, the end interpolates: two ways to the same numbers.
    let fine = Refinement::CatmullClark.refine_n(&surface, LEVELS).unwrap();
    assert_eq!(rows[0].energies, fairness.energies(&fine.positions));
    let control = surface.with_positions(solution.points);
    let last = rows[rows.len() - 1];
    assert_eq!(last.energies, fairness.energies_of(&control).unwrap());
    let (_, found) = limits_and_normals(&control, surface.len());
    let worst = found.iter().zip(&normals).map(|(a, b)| a.angle_between(*b)).fold(0.0, f64::max);
    assert!((last.deviation_max - worst).abs() < 1e-7);
    // Interpolating noise ripples: the energy grows from the start, and the fairest surface lies below the end.
    let weights = Weights::default();
    let fair = fit(&fairness, surface.positions(), &ALL, weights).unwrap();
    assert!(last.energies.weighted(weights) > rows[0].energies.weighted(weights));
    assert!(fair.energies.weighted(weights) < last.energies.weighted(weights));
}
