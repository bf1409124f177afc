//! Meshes at random and by name, and small tools, for the claims.

use std::cell::OnceCell;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::ControlFlow;
use std::sync::OnceLock;

use glam::DVec3;
use nalgebra::DMatrix;
use rayon::prelude::*;

use limitlab::Result;
use limitlab::analysis::dense;
use limitlab::analysis::splitting::{LocalScheme, SplittingMatrix};
use limitlab::assemble::LimitSystem;
pub use limitlab::mesh::random::random_points;
use limitlab::mesh::validate::Boundary;
use limitlab::mesh::{Faces, Mesh, Surface, builtin, features::Tags, generate, random};
use limitlab::schemes::Scheme;
use limitlab::solvers::{Method, Outcome, Solution, Stop, run, run_watched};

use crate::programs::reproduce::context::{Context, Subject};
use crate::programs::reproduce::corpus;

/// Random meshes of [`Lab::polygons`] and [`Lab::triangles`], and the most vertices of each.
pub const RANDOM_MESHES: usize = 300;
pub const RANDOM_VERTICES: usize = 120;
/// The most vertices of [`Lab::subjects`].
const MODEL_VERTICES: usize = 3000;
/// Random meshes with holes and creases of [`Lab::creased`], of each kind of faces.
const CREASED_MESHES: usize = 60;

/// A run of the program as the claims see it, with the random meshes made once.
pub struct Lab<'a> {
    pub context: &'a Context,
    polygons: OnceCell<Vec<Subject>>,
    triangles: OnceCell<Vec<Subject>>,
    subjects: OnceCell<Vec<Subject>>,
    creased: [OnceCell<Vec<Subject>>; 2],
    semi_sharp: [OnceCell<Vec<Subject>>; 2],
    open: OnceCell<Vec<Subject>>,
}

impl<'a> Lab<'a> {
    pub fn new(context: &'a Context) -> Self {
        Lab {
            context,
            polygons: OnceCell::new(),
            triangles: OnceCell::new(),
            subjects: OnceCell::new(),
            creased: Default::default(),
            semi_sharp: Default::default(),
            open: OnceCell::new(),
        }
    }

    /// Closed polygon meshes at random, all valences at least 3: spheres, tori, sums and unions of those, duals,
    /// quads, mixed polygons, triangles.
    pub fn polygons(&self) -> &[Subject] {
        self.polygons.get_or_init(|| small("random-polygons", random::random_polygons))
    }

    /// Closed triangle meshes at random.
    pub fn triangles(&self) -> &[Subject] {
        self.triangles.get_or_init(|| small("random-triangles", random::random_triangulation))
    }

    /// Open and creased meshes at random without darts, of faces on which the scheme is defined.
    pub fn creased(&self, scheme: Scheme) -> &[Subject] {
        let make = || self.with_features("random-creased", scheme, random::random_creased);
        self.creased[usize::from(scheme.needs_triangles())].get_or_init(make)
    }

    /// The same with darts and semi-sharp edges and vertices.
    pub fn semi_sharp(&self, scheme: Scheme) -> &[Subject] {
        let make = || self.with_features("random-semi-sharp", scheme, random::random_semi_sharp);
        self.semi_sharp[usize::from(scheme.needs_triangles())].get_or_init(make)
    }

    /// From the closed meshes at random, the k-th by the seed k.
    fn with_features(
        &self,
        name: &str,
        scheme: Scheme,
        make: fn(&Mesh, u64) -> Option<(Surface, Tags)>,
    ) -> Vec<Subject> {
        let closed = if scheme.needs_triangles() { self.triangles() } else { self.polygons() };
        let made = (0..).zip(closed).filter_map(|(seed, subject)| {
            let (surface, _) = make(subject.surface.mesh(), seed)?;
            // Some meshes are left as they were.
            surface.features().is_some().then(|| Subject { name: format!("{name}:{seed}"), surface })
        });
        made.take(CREASED_MESHES).collect()
    }

    /// The open real models, none where these are not at hand, by either rule of the boundary; of at most
    /// [`MODEL_VERTICES`] vertices.
    pub fn open_models(&self) -> Result<&[Subject]> {
        if self.open.get().is_none() {
            let mut found = Vec::new();
            if self.context.real() {
                for file in self.context.files("open")? {
                    for boundary in [Boundary::EdgeAndCorner, Boundary::EdgeOnly] {
                        found.push(self.context.read(&file, boundary)?);
                    }
                }
                found.retain(|subject| subject.surface.len() <= MODEL_VERTICES);
            }
            return Ok(self.open.get_or_init(|| found));
        }
        Ok(self.open.get().map_or(&[], Vec::as_slice))
    }

    /// The closed real models, or stand-ins of several kinds, of at most [`MODEL_VERTICES`] vertices.
    pub fn subjects(&self) -> Result<&[Subject]> {
        if self.subjects.get().is_none() {
            let found = self.context.subjects(&corpus::CLAIMS, MODEL_VERTICES)?;
            return Ok(self.subjects.get_or_init(|| found));
        }
        Ok(self.subjects.get().map_or(&[], Vec::as_slice))
    }
}

fn small(name: &str, make: fn(u64) -> Mesh) -> Vec<Subject> {
    let mut found = Vec::with_capacity(RANDOM_MESHES);
    let mut seed = 0;
    while found.len() < RANDOM_MESHES {
        let mesh = make(seed);
        if mesh.len() <= RANDOM_VERTICES {
            found.push(subject(format!("{name}:{seed}"), mesh));
        }
        seed += 1;
    }
    found
}

pub fn subject(name: impl Into<String>, mesh: Mesh) -> Subject {
    let surface = Surface::new(mesh).expect("a valid mesh");
    Subject { name: name.into(), surface }
}

/// A built-in mesh without noise.
pub fn exact(name: &str) -> Result<Subject> {
    Subject::built_in(name)
}

/// A closed mesh of quads in which vertices `n` and n + 1 have valence n.
pub fn quad_star(n: usize) -> Mesh {
    generate::quad_split(&builtin::bipyramid(n))
}

/// The map of PSL(2, p) for a prime p ≥ 5, points at random: all p(p² − 1)/6 vertices have valence 3, all faces p corners.
/// Its darts are the elements of the group; S of order 2 turns one round, R = ST of order 3 leads to the next at its
/// vertex, and T = SR of order p to the next of its face.
pub fn platonic_map(p: u32) -> Mesh {
    type Element = [u32; 4];
    // Up to sign: the first entry that is not 0 is at most p/2.
    let signed = |g: Element| {
        let first = g.into_iter().find(|&x| x != 0).unwrap_or(0);
        if 2 * first > p { g.map(|x| (p - x) % p) } else { g }
    };
    let times = |[a, b, c, d]: Element, [e, f, g, h]: Element| {
        signed([a * e + b * g, a * f + b * h, c * e + d * g, c * f + d * h].map(|x| x % p))
    };
    let (s, t) = ([0, p - 1, 1, 0], [1, 1, 0, 1]);
    let r = times(s, t);
    let one = signed([1, 0, 0, 1]);
    // From the unit on, by the two generators; each vertex takes its three darts at once.
    let (mut vertex_of, mut vertices, mut ahead) = (BTreeMap::new(), 0, vec![one]);
    let mut darts = Vec::new();
    while let Some(dart) = ahead.pop() {
        if vertex_of.contains_key(&dart) {
            continue;
        }
        for own in [dart, times(dart, r), times(times(dart, r), r)] {
            vertex_of.insert(own, vertices);
            darts.push(own);
            ahead.push(times(own, s));
        }
        vertices += 1;
    }
    let mut seen = BTreeSet::new();
    let mut faces: Vec<Vec<u32>> = Vec::new();
    for first in darts {
        let mut face = Vec::new();
        let mut dart = first;
        while seen.insert(dart) {
            face.push(vertex_of[&dart]);
            dart = times(dart, t);
        }
        if !face.is_empty() {
            faces.push(face);
        }
    }
    Mesh::new(random_points(vertices as usize, u64::from(p)), Faces::from_lists(&faces))
}

/// max ‖a_i − b_i‖
pub fn distance(a: &[DVec3], b: &[DVec3]) -> f64 {
    assert_eq!(a.len(), b.len(), "as many of one as of the other");
    largest(a.iter().zip(b).map(|(a, b)| a.distance(*b)))
}

/// The largest of some numbers; NaN if one is.
pub fn largest(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().fold(f64::NEG_INFINITY, |m, x| if m.is_nan() || x.is_nan() { f64::NAN } else { m.max(x) })
}

/// The smallest of some numbers; NaN if one is.
pub fn smallest(values: impl IntoIterator<Item = f64>) -> f64 {
    -largest(values.into_iter().map(|x| -x))
}

/// The middle of some numbers; the lower of two. NaN if there is none.
pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let middle = values.len().saturating_sub(1) / 2;
    values.get(middle).copied().unwrap_or(f64::NAN)
}

/// All of `subjects` in parallel, in their order.
///
/// What divides the work is compiled once, not for each of the claims.
pub fn each<T: Send + Sync>(
    subjects: &[Subject],
    work: impl Fn(&Subject) -> Result<T> + Sync + Send,
) -> Result<Vec<T>> {
    fn run(count: usize, task: &(dyn Fn(usize) + Sync)) {
        (0..count).into_par_iter().with_max_len(1).for_each(task);
    }
    let results: Vec<OnceLock<Result<T>>> = subjects.iter().map(|_| OnceLock::new()).collect();
    run(subjects.len(), &|k| {
        results[k].get_or_init(|| work(&subjects[k]));
    });
    results.into_iter().filter_map(OnceLock::into_inner).collect()
}

/// The limit mask by repetition alone: the first row of S^64.
pub fn limit_by_powers(scheme: LocalScheme, n: usize) -> Result<Vec<f64>> {
    let mut power: DMatrix<f64> = SplittingMatrix::new(scheme, n)?.entries;
    for _ in 0..6 {
        power = &power * &power;
    }
    Ok(power.row(0).iter().copied().collect())
}

/// The ends of the spectra of A and D⁻¹A of one small mesh.
#[derive(Clone, Copy, Debug)]
pub struct Ends {
    pub min: f64,
    pub max: f64,
    pub jacobi_min: f64,
    pub jacobi_max: f64,
}

/// # Errors
/// More than 600 vertices.
pub fn ends(system: &LimitSystem) -> Result<Ends> {
    let all = dense::eigenvalues(system)?;
    let at = |list: &[f64], last: bool| {
        let end = if last { list.last() } else { list.first() };
        end.copied().unwrap_or(f64::NAN)
    };
    Ok(Ends {
        min: at(&all.a, false),
        max: at(&all.a, true),
        jacobi_min: at(&all.jacobi, false),
        jacobi_max: at(&all.jacobi, true),
    })
}

/// Solves with structureless points, which excite every eigenvector, to `tolerance` times the largest coordinate 1.
pub fn solve_random(system: &LimitSystem, method: Method, tolerance: f64, limit: usize) -> Solution {
    let points = random_points(system.len(), system.len() as u64);
    let stop = Stop { tolerance, max_iterations: limit };
    run(system, &points, method, &stop)
}

/// The first `count` iterates after the start V = P.
pub fn iterates(system: &LimitSystem, points: &[DVec3], method: Method, count: usize) -> Vec<Vec<DVec3>> {
    let stop = Stop { tolerance: 0.0, max_iterations: count };
    let mut found = Vec::with_capacity(count);
    run_watched(system, points, method, &stop, &mut |step| {
        if step.iteration > 0 {
            found.push(step.points.to_vec());
        }
        ControlFlow::Continue(())
    });
    found
}

/// Iterations from V = P to `tolerance` of the bounding box's diagonal; `None` if it was not reached.
pub fn iterations(system: &LimitSystem, subject: &Subject, method: Method, tolerance: f64) -> Option<usize> {
    let stop = Stop { tolerance: tolerance * subject.surface.diagonal(), max_iterations: 20_000 };
    let report = run(system, subject.surface.positions(), method, &stop).report;
    (report.outcome == Outcome::Converged).then_some(report.iterations)
}

/// max_i ‖p_i − (A v)_i‖ after each iteration, relative to the bounding box's diagonal; entry 0 is the start.
pub fn history(system: &LimitSystem, subject: &Subject, method: Method, count: usize) -> Vec<f64> {
    let stop = Stop { tolerance: 0.0, max_iterations: count };
    let report = run(system, subject.surface.positions(), method, &stop).report;
    let size = subject.surface.diagonal();
    report.maxima().into_iter().map(|error| error / size).collect()
}

/// The largest second difference along straight lines of edges through vertices of an even valence, halved as often as there are
/// `levels`: the jump of first divided differences, which tends to 0 exactly where these are continuous.
pub fn largest_kink(surface: &Surface, values: &[DVec3], levels: usize) -> f64 {
    let (faces, topology) = (surface.faces(), surface.topology());
    let (mut star, mut found) = (Vec::new(), 0.0f64);
    for v in 0..surface.len() {
        topology.star(faces, v, &mut star);
        let half = star.len() / 2;
        if star.len() % 2 == 1 {
            continue;
        }
        let end = |k: usize| values[faces.corners()[topology.incidence.next(faces, star[k]) as usize] as usize];
        for k in 0..half {
            found = largest([found, (end(k) - 2.0 * values[v] + end(k + half)).length()]);
        }
    }
    found * 2f64.powi(levels as i32)
}

/// Stored entries of A a vertex.
pub fn entries_per_vertex(system: &LimitSystem) -> f64 {
    system.a.values().len() as f64 / system.len() as f64
}

/// (diagonal − Σ |others|) of row `i` of A.
pub fn excess(system: &LimitSystem, i: usize) -> f64 {
    system.a.row(i).map(|(j, a)| if i == j { a } else { -a.abs() }).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_nan_is_not_lost_among_numbers() {
        assert_eq!(largest([1.0, 3.0, 2.0]), 3.0);
        assert_eq!(smallest([1.0, 3.0, 2.0]), 1.0);
        assert!(largest([1.0, f64::NAN, 2.0]).is_nan());
        assert!(smallest([f64::NAN, 2.0]).is_nan());
        assert_eq!(median(vec![3.0, 1.0, 2.0]), 2.0);
    }

    #[test]
    fn platonic_maps_are_those_of_the_groups_order() {
        for p in [5, 7, 11] {
            let map = subject("", platonic_map(p));
            let (surface, k) = (&map.surface, p as usize);
            assert_eq!(surface.len(), k * (k * k - 1) / 6);
            assert_eq!(surface.faces().uniform_size(), Some(k));
            assert!((0..surface.len()).all(|v| surface.incidence().face_count(v) == 3));
            // Klein's quartic has genus 3.
            let euler = surface.len() as i64 + surface.faces().len() as i64 - surface.topology().edges() as i64;
            assert_eq!(euler, [2, -4, -50][[5, 7, 11].iter().position(|&q| q == p).unwrap()]);
        }
    }

    #[test]
    fn the_quad_star_has_its_valence_at_the_apex() {
        let star = subject("", quad_star(9));
        assert_eq!(star.surface.incidence().face_count(9), 9);
        assert_eq!(star.surface.faces().uniform_size(), Some(4));
    }
}
