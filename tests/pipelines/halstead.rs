//! Fair interpolation of closed, open and creased meshes: constraints, minimality, energies in closed form and by
//! differences, affine maps, singular meshes, errors per iteration.

use std::collections::BTreeSet;
use std::ops::ControlFlow;

use chacha20::ChaCha8Rng;
use glam::DVec3;
use limitlab::assemble::LimitSystem;
use limitlab::interpolate::halstead::{Fairness, LEVELS, Solver, Weights, fit, fit_watched, follow};
use limitlab::interpolate::zheng_cai::Constraints;
use limitlab::interpolate::{Options, interpolate};
use limitlab::mesh::features::{Rule, Tags};
use limitlab::mesh::validate::Boundary;
use limitlab::mesh::{Faces, Mesh, Surface, builtin};
use limitlab::schemes::{Refinement, Scheme, catmull_clark};
use limitlab::solvers::{Method, Outcome, Recorded, Step, Stop};
use rand::{RngExt, SeedableRng};

use crate::common::pipelines::{distance, noisy, noisy_surface};
use crate::open::{grid, open, random_creased};

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

fn rule(surface: &Surface, v: usize) -> Rule {
    surface.features().map_or(Rule::Smooth, |features| features.rules()[v])
}

fn creased(surface: &Surface, walk: &[u32]) -> Surface {
    let creases = walk.windows(2).map(|side| ([side[0], side[1]], 10.0)).collect();
    surface.tagged(&Tags { boundary: surface.boundary(), creases, corners: Vec::new() }).unwrap()
}

/// The closed ones; a grid with corners, and with one-face vertices on its curve; creases around a tube, around a face, and
/// from a boundary to itself.
fn surfaces() -> Vec<(String, Surface)> {
    let closed = MESHES.map(|name| (name.to_owned(), noisy_surface(name)));
    let torus = noisy_surface("torus:4x5");
    let [kept, smooth] = [Boundary::EdgeAndCorner, Boundary::EdgeOnly].map(|rule| open(grid(4, 5, false), rule));
    let sharp = [
        ("tube", creased(&torus, &[0, 1, 2, 3, 4, 0])),
        ("face", creased(&noisy_surface("cube"), &[4, 5, 7, 6, 4])),
        ("halves", creased(&kept, &[5, 6, 7, 8, 9])),
        ("grid", kept),
        ("edge-only", smooth),
    ];
    closed.into_iter().chain(sharp.map(|(name, surface)| (name.to_owned(), surface))).collect()
}

/// As [`surfaces`], and random ones.
fn many_surfaces() -> Vec<(String, Surface)> {
    let random =
        (0..16).filter_map(|seed| Some((format!("seed {seed}"), random_creased(Scheme::CatmullClark, seed)?.0)));
    surfaces().into_iter().chain(random).collect()
}

#[test]
fn the_fit_meets_points_and_normals() {
    for (name, surface) in surfaces() {
        let fairness = Fairness::new(&surface).unwrap();
        let plain = fit(&fairness, surface.positions(), &ALL, Weights::default()).unwrap();
        let (limits, before) = limits_and_normals(&plain.surface, surface.len());
        assert!(distance(&limits, surface.positions()) < SOLVED, "{name}");
        let wanted: Vec<Option<DVec3>> = before
            .iter()
            .enumerate()
            .map(|(v, n)| {
                (v % 2 == 0 && rule(&surface, v) == Rule::Smooth)
                    .then(|| *n + 0.3 * DVec3::new((v as f64).sin(), 0.5, (v as f64).cos()))
            })
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

/// The energies by differences of limit points at the corners of small quads, over the same part of the surface: all but
/// the quarters beside extraordinary vertices. Nothing is taken from beyond a boundary or crease.
#[test]
fn energies_are_those_of_second_differences() {
    const DEEPER: usize = 4;
    // In units of the quads of the first refinement.
    let h = 0.5f64.powi((LEVELS + DEEPER) as i32 - 1);
    let small = ["cube", "tetrahedron", "bipyramid:5"].map(|name| (name.to_owned(), noisy_surface(name)));
    let sharp = many_surfaces().into_iter().filter(|(_, surface)| surface.features().is_some());
    for (name, surface) in sharp.chain(small) {
        let fairness = Fairness::new(&surface).unwrap();
        let mut fine = fairness.fine.clone();
        let mut counted = vec![true; fine.faces().len()];
        for level in 0..DEEPER {
            // A quarter has the number of its parent's corner.
            counted = counted.iter().flat_map(|&c| [c; 4]).collect();
            fine = Refinement::CatmullClark.refined(&fine).unwrap();
            if level == 0 {
                let around = Around::new(&fine);
                for (f, counted) in counted.iter_mut().enumerate() {
                    *counted = fine.faces().range(f).all(|c| around.is_regular(c as u32));
                }
            }
        }
        let limits = catmull_clark::limit_positions(&fine).unwrap();
        let around = Around::new(&fine);
        let at = |c: u32| limits[fine.faces().corners()[c as usize] as usize];
        let incidence = fine.incidence();
        let next = |c: u32| incidence.next(fine.faces(), c);
        let prev = |c: u32| incidence.prev(fine.faces(), c);
        let (mut thin_plate, mut membrane) = (0.0, 0.0);
        for f in (0..fine.faces().len()).filter(|&f| counted[f]) {
            let first = fine.faces().range(f).start as u32;
            let [a, b, c, d] = [0, 1, 2, 3].map(|k| at(first + k));
            let [u, v, uv] = [(b - a + c - d) / 2.0, (d - a + c - b) / 2.0, a - b + c - d];
            // Along each direction of the quad, at those of its corners where the surface goes on.
            let mut second = [(DVec3::ZERO, 0.0); 2];
            for k in 0..4 {
                let c = first + k as u32;
                let back = around.counter_clockwise(c).map(|c| at(prev(c)) + at(next(first + k as u32)));
                let ahead = around.clockwise(c).map(|c| at(next(c)) + at(prev(first + k as u32)));
                for (direction, ends) in [(k % 2, back), ((k + 1) % 2, ahead)] {
                    if let Some(ends) = ends {
                        second[direction].0 += ends - 2.0 * at(c);
                        second[direction].1 += 1.0;
                    }
                }
            }
            let [uu, vv] = second.map(|(sum, count)| sum / count);
            thin_plate += (uu.length_squared() + 2.0 * uv.length_squared() + vv.length_squared()) / (h * h);
            membrane += u.length_squared() + v.length_squared();
        }
        let found = fairness.energies_of(&surface).unwrap();
        assert!((found.thin_plate / thin_plate - 1.0).abs() < 0.01, "{name}: {} {thin_plate}", found.thin_plate);
        assert!((found.membrane / membrane - 1.0).abs() < 0.01, "{name}: {} {membrane}", found.membrane);
    }
}

/// The corners about a vertex as far as no sharp edge lies between them.
struct Around<'a> {
    surface: &'a Surface,
    sharp: BTreeSet<u32>,
}

impl<'a> Around<'a> {
    fn new(surface: &'a Surface) -> Self {
        let firsts = surface.features().map_or(&[][..], |features| features.sharp_half_edges());
        let sides = firsts.iter().flat_map(|&c| [Some(c), surface.topology().twin(c)]);
        Around { surface, sharp: sides.flatten().collect() }
    }

    fn clockwise(&self, c: u32) -> Option<u32> {
        self.surface.topology().clockwise(self.surface.faces(), c).filter(|_| !self.sharp.contains(&c))
    }

    fn counter_clockwise(&self, c: u32) -> Option<u32> {
        let other = self.surface.topology().counter_clockwise(self.surface.faces(), c)?;
        (!self.sharp.contains(&self.surface.incidence().prev(self.surface.faces(), c))).then_some(other)
    }

    /// Whether four faces meet smoothly, two along a curve, or one at a corner.
    fn is_regular(&self, c: u32) -> bool {
        let mut faces = 1;
        let mut last = c;
        while let Some(other) = self.counter_clockwise(last).filter(|&other| other != c) {
            (last, faces) = (other, faces + 1);
        }
        if self.counter_clockwise(last).is_none() {
            let mut last = c;
            while let Some(other) = self.clockwise(last) {
                (last, faces) = (other, faces + 1);
            }
        }
        let regular = match rule(self.surface, self.surface.faces().corners()[c as usize] as usize) {
            Rule::Smooth => 4,
            Rule::Crease => 2,
            Rule::Corner => 1,
            Rule::Dart | Rule::SemiSharp => unreachable!("they are refused"),
        };
        faces == regular
    }
}

/// Splines on a grid of 3 × 2 quads, with its parameters u = 2x and v = 2y, whose energies are known.
#[test]
fn splines_with_natural_ends_have_their_energies_in_closed_form() {
    let mut mesh = grid(4, 3, false);
    mesh.positions.iter_mut().for_each(|p| p.z = 0.0);
    let flat = open(mesh, Boundary::EdgeAndCorner);
    // From boundary to boundary along x = 1.
    for (surface, is_creased) in [(flat.clone(), false), (creased(&flat, &[3, 4, 5]), true)] {
        let fairness = Fairness::new(&surface).unwrap();
        let energies = |height: &dyn Fn(f64, f64) -> f64| {
            let points = fairness.fine.positions().iter().map(|p| DVec3::Z * height(p.x, p.y));
            let found = fairness.energies(&points.collect::<Vec<_>>());
            [found.thin_plate, found.membrane]
        };
        let near = |found: [f64; 2], expected: [f64; 2]| {
            let close = found.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-12);
            assert!(close, "{found:?} for {expected:?}, creased: {is_creased}");
        };
        near(energies(&|_, _| 1.0), [0.0, 0.0]);
        near(energies(&|x, _| x), [0.0, 6.0]);
        // uv/4, on [0, 6] × [0, 4].
        near(energies(&|x, y| x * y), [2.0 * 24.0 / 16.0, (6.0 * 64.0 + 4.0 * 216.0) / 3.0 / 16.0]);
        // Bent at the knots u = 2 and u = 4: S_uu is 1 there, 0 at all others, and linear between. On the curve there is no
        // bend, each side being flat.
        let bent = |at: f64| energies(&|x, _| (x - at).max(0.0))[0];
        assert!((bent(2.0) - 4.0 / 3.0).abs() < 1e-12, "{}", bent(2.0));
        assert!((bent(1.0) - if is_creased { 0.0 } else { 4.0 / 3.0 }).abs() < 1e-12, "{}", bent(1.0));
        // What is flat stays so.
        let tilted = |p: &DVec3| DVec3::new(p.x, p.y, 0.3 * p.x - 0.7 * p.y + 1.0);
        let points: Vec<DVec3> = surface.positions().iter().map(tilted).collect();
        let fair = fit(&fairness, &points, &ALL, Weights::default()).unwrap();
        assert!(fair.surface.positions().iter().all(|p| (p.z - tilted(p).z).abs() < SOLVED));
        assert!(fairness.energies_of(&surface.with_positions(points)).unwrap().thin_plate.abs() < 1e-12);
    }
}

/// xᵀKx is least among all x that meet the points: the derivative along every direction in the null space of the
/// limit masks vanishes, and the interpolating control mesh of the given faces, where there is one, costs more.
#[test]
fn the_fit_is_the_fairest() {
    let weights = [
        Weights::default(),
        Weights { thin_plate: 1.0, membrane: 0.01 },
        Weights { thin_plate: 0.0, membrane: 1.0 },
        Weights::default(),
    ];
    for ((name, surface), weights) in many_surfaces().into_iter().zip(weights.into_iter().cycle()) {
        let fairness = Fairness::new(&surface).unwrap();
        let forms = fairness.forms().unwrap();
        let best = fit(&fairness, surface.positions(), &ALL, weights).unwrap();
        let mut rng = ChaCha8Rng::seed_from_u64(11);
        for _ in 0..5 {
            let mut step = best.surface.clone();
            for p in step.positions_mut() {
                *p = DVec3::from_array(std::array::from_fn(|_| rng.random_range(-1.0..1.0)));
            }
            // The own weight takes the limit of each original vertex to zero; rings are disjoint.
            let limits = catmull_clark::limit_positions(&step).unwrap();
            for (v, limit) in limits[..surface.len()].iter().enumerate() {
                let n = step.incidence().face_count(v) as f64;
                let own = match rule(&surface, v) {
                    Rule::Smooth => n / (n + 5.0),
                    Rule::Crease => 2.0 / 3.0,
                    Rule::Corner => 1.0,
                    Rule::Dart | Rule::SemiSharp => unreachable!("they are refused"),
                };
                step.positions_mut()[v] -= *limit / own;
            }
            let gradient = |k: &limitlab::assemble::Csr| -> f64 {
                (0..step.len()).map(|i| step.positions()[i].dot(k.row_times(i, best.surface.positions()))).sum()
            };
            let [thin, membrane] = forms.each_ref().map(gradient);
            let slope = weights.thin_plate * thin + weights.membrane * membrane;
            let scale = best.energies.weighted(weights) + fairness.energies(step.positions()).weighted(weights);
            assert!(slope.abs() < SOLVED * scale, "{name} {slope:e} {scale:e}");
        }
        let solution = interpolate(&surface, Scheme::CatmullClark, &Options::default()).unwrap();
        if solution.report.outcome == Outcome::Converged {
            let control = surface.with_positions(solution.points);
            let other = fairness.energies_of(&control).unwrap();
            assert!(best.energies.weighted(weights) <= other.weighted(weights), "{name}");
        } else {
            assert_eq!(name, "cube");
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

/// Vertices without a patch or a mask are refused by name, and so are normals where the surface has none.
#[test]
fn what_has_no_energy_is_refused_by_name() {
    let refused = |surface: &Surface| Fairness::new(surface).unwrap_err().to_string();
    let flat = open(grid(4, 5, false), Boundary::EdgeAndCorner);
    assert!(refused(&creased(&flat, &[5, 6, 7])).starts_with("vertex 7 is a dart"));
    let semi_sharp = Tags { boundary: flat.boundary(), creases: vec![([6, 7], 1.5)], corners: Vec::new() };
    assert!(refused(&flat.tagged(&semi_sharp).unwrap()).starts_with("vertex 6 is semi-sharp"));
    let torus = builtin::builtin("torus:4x5").unwrap();
    let pierced = Mesh::new(torus.positions, Faces::from_lists(torus.faces.iter().skip(1)));
    assert!(refused(&open(pierced, Boundary::AsInterior)).contains("close the holes"));
    let fairness = Fairness::new(&flat).unwrap();
    let mut normals = vec![None; flat.len()];
    (normals[4], normals[6]) = (Some(DVec3::Z), Some(DVec3::Z));
    let wishes = Constraints { normals: Some(&normals), ..ALL };
    let error = fit(&fairness, flat.positions(), &wishes, Weights::default()).unwrap_err();
    assert!(error.to_string().contains("vertex 4 is sharp"), "{error}");
}

/// With fewer points the surface is fairer, still meets those, and is determined: at an optimum the energy's gradient
/// is a combination of the constraints, so no admissible direction lowers it.
#[test]
fn a_subset_is_met_by_a_fairer_surface() {
    for (name, surface) in surfaces() {
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
    let seen: Vec<_> = rows.iter().map(|r| Recorded { iteration: r.iteration, errors: r.errors }).collect();
    assert_eq!(seen, solution.report.history);
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

/// The sum over elements is the product with the matrix of all entries, which knows no kinds of elements and no blocks.
#[test]
fn elements_are_the_matrix() {
    let large = ["quad-sphere:4", "icosphere:3", "bipyramid:40", "prism:30"];
    let large = large.map(|name| (name.to_owned(), noisy_surface(name)));
    for (name, surface) in many_surfaces().into_iter().chain(large) {
        let fairness = Fairness::new(&surface).unwrap();
        let forms = fairness.forms().unwrap();
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let x: Vec<DVec3> = (0..fairness.fine.len())
            .map(|_| DVec3::from_array(std::array::from_fn(|_| rng.random_range(-1.0..1.0))))
            .collect();
        for (thin_plate, membrane, k) in [(1.0, 0.0, &forms[0]), (0.0, 1.0, &forms[1])] {
            let found = fairness.gradient(&x, Weights { thin_plate, membrane });
            let expected: Vec<DVec3> = (0..x.len()).map(|i| k.row_times(i, &x)).collect();
            let size = expected.iter().map(|p| p.length()).fold(0.0, f64::max);
            assert!(distance(&found, &expected) < 1e-13 * size, "{name}");
        }
    }
}

/// Two ways to one minimiser, under all conditions: the energy to 1e-8 of itself and better, the control points as well as the
/// factorization's refinement tells them.
#[test]
fn iterations_and_the_factorization_find_the_same() {
    let larger = ["quad-sphere:3", "bipyramid:9"].map(|name| (name.to_owned(), noisy_surface(name)));
    for (number, (name, surface)) in many_surfaces().into_iter().chain(larger).enumerate() {
        let fairness = Fairness::new(&surface).unwrap();
        let n = surface.len();
        let mut rng = ChaCha8Rng::seed_from_u64(number as u64);
        let marks: Vec<bool> = (0..n).map(|v| v == 0 || rng.random_bool(0.7)).collect();
        let normal = |v: usize, rng: &mut ChaCha8Rng| {
            let may = rule(&surface, v) == Rule::Smooth && rng.random_bool(0.5);
            may.then(|| DVec3::from_array(std::array::from_fn(|_| rng.random_range(0.1..1.0))))
        };
        let normals: Vec<Option<DVec3>> = (0..n).map(|v| normal(v, &mut rng)).collect();
        let fewer: Vec<Option<DVec3>> = (0..n).map(|v| normals[v].filter(|_| marks[v])).collect();
        // A component without a mark has no place.
        let held = {
            let (component, count) = surface.topology().components(surface.faces());
            (0..count as u32).all(|c| (0..n).any(|v| component[v] == c && marks[v]))
        };
        let mut wishes = vec![ALL, Constraints { normals: Some(&normals), ..ALL }];
        if held {
            wishes.push(Constraints { interpolated: Some(&marks), ..ALL });
            wishes.push(Constraints { interpolated: Some(&marks), normals: Some(&fewer), ..ALL });
        }
        let weights = Weights { thin_plate: 1.0, membrane: [1.0, 0.1][number % 2] };
        for (k, wishes) in wishes.iter().enumerate() {
            let stop = Stop { tolerance: 1e-12, max_iterations: 10_000 };
            let [iterated, factored] = [Solver::Iterations, Solver::Factorization].map(|solver| {
                let mut watch = |_: &Step| ControlFlow::Continue(());
                fit_watched(&fairness, surface.positions(), wishes, weights, solver, &stop, &mut watch).unwrap()
            });
            assert_eq!(iterated.report.outcome, Outcome::Converged, "{name} {k}");
            let [found, expected] = [&iterated, &factored].map(|fit| fit.energies.weighted(weights));
            assert!((found / expected - 1.0).abs() < 1e-10, "{name} {k}: {found} {expected}");
            let off = distance(iterated.surface.positions(), factored.surface.positions());
            assert!(off < 1e-9, "{name} {k}: {off:e}");
        }
    }
}

/// All sums are over blocks, in their order.
#[test]
fn the_fit_does_not_depend_on_the_number_of_threads() {
    let surface = noisy_surface("quad-sphere:5");
    let found = [1, 2, 3].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let fairness = Fairness::new(&surface).unwrap();
            fit(&fairness, surface.positions(), &ALL, Weights::default()).unwrap()
        })
    });
    assert!(found[0].report.iterations > 10);
    for other in &found[1..] {
        assert_eq!(found[0].surface.positions(), other.surface.positions());
        assert_eq!(found[0].energies, other.energies);
        assert_eq!(found[0].report, other.report);
    }
}
