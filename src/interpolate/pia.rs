//! Progressive iterative interpolation as its authors ran it: the counts and errors of their Table 1.

use glam::DVec3;

use crate::Result;
use crate::assemble::LimitSystem;
use crate::mesh::Surface;
use crate::schemes::{Masks, Scheme};
use crate::solvers::{Errors, Method, Outcome, Stop, run};

/// A run of the paper's algorithm, counted as its Table 1 counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Passes {
    /// How the run ended: converged if the errors got within the tolerance in time.
    pub outcome: Outcome,
    /// Updates of all vertices made.
    pub updates: usize,
    /// The passes of the paper's loop: the last one only finds that the error is small enough, and its update is
    /// not needed. `updates + 1`.
    pub passes: usize,
    /// The errors that the last pass sees, in mesh units.
    pub errors: Errors,
}

/// PIA with ω = 1 from V = P until the largest difference is at most `tolerance`, in mesh units (PIA §2, with the
/// reset of CurrentMaxError that the printed algorithm lacks).
///
/// # Panics
/// If there is not one point a vertex.
pub fn passes(system: &LimitSystem, points: &[DVec3], tolerance: f64, limit: usize) -> Passes {
    let stop = Stop { tolerance, max_iterations: limit };
    let report = run(system, points, Method::Pia, &stop).report;
    Passes { outcome: report.outcome, updates: report.iterations, passes: report.iterations + 1, errors: report.last() }
}

/// PIA's first step, V = P + (P − A P): a quasi-interpolant, as Litke, Levin & Schröder (2001) fit surfaces by, a fixed mask on the
/// 1-ring of each vertex in place of a system. On regular meshes A sends a polynomial to itself plus a multiple of its Laplacian
/// and fourth derivatives, so I − A lowers the degree by two, and (I − A)² P vanishes for cubics: V = 2P − A P has the limit points P
/// exactly then. k steps do so up to degree 2k + 1 (as far as the scheme has polynomials, which is 3).
///
/// Along one direction 2 − (1, 4, 1)/6 = (−1, 8, −1)/6 is the quasi-interpolant of cubic B-splines. Which mask Litke et al. take at
/// extraordinary vertices, and which of the masks on the 1-ring that reproduce cubics at regular ones (a family of one parameter
/// under Catmull-Clark; the product of two (−1, 8, −1)/6 is another of it), could not be established.
///
/// # Errors
/// As [`limit_points`](super::limit_points).
///
/// ```
/// use limitlab::interpolate::limit_points;
/// use limitlab::interpolate::pia::quasi_interpolant;
/// use limitlab::mesh::{Surface, builtin::builtin};
/// use limitlab::schemes::Scheme;
/// let sphere = Surface::new(builtin("icosphere:3")?)?;
/// let control = sphere.with_positions(quasi_interpolant(&sphere, Scheme::Loop)?);
/// let error = |limits: Vec<glam::DVec3>| limits[400].distance(sphere.positions()[400]);
/// assert!(error(limit_points(&control, Scheme::Loop)?) < 0.03 * error(limit_points(&sphere, Scheme::Loop)?));
/// # Ok::<(), limitlab::Error>(())
/// ```
pub fn quasi_interpolant(surface: &Surface, scheme: Scheme) -> Result<Vec<DVec3>> {
    let limits = super::limit_points(surface, scheme)?;
    Ok(surface.positions().iter().zip(limits).map(|(p, limit)| 2.0 * p - limit).collect())
}

/// The masks behind the printed errors of the paper's Mushroom, whose 32 triangles are no quads: weights n², 4 an
/// edge and 1 a face over n(n+5), where the "face point" of a corner is the corner two steps back. On quads that is
/// the opposite corner, and the mask is right; on a triangle it is an edge neighbour, M is not symmetric, and the
/// limit surface is not met.
#[derive(Clone, Copy, Debug)]
pub struct TwoStepsBack;

impl Masks for TwoStepsBack {
    fn h(&self, n: usize) -> f64 {
        Scheme::CatmullClark.h(n)
    }

    fn vertex_weight(&self, n: usize) -> f64 {
        (n * n) as f64
    }

    fn edge_weight(&self) -> f64 {
        4.0
    }

    fn face_weight(&self, size: usize, steps: usize) -> f64 {
        if steps + 2 == size { 1.0 } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::builtin;

    #[test]
    fn two_steps_back_is_right_on_quads_and_wrong_on_triangles() {
        for (name, equal) in [("quad-sphere:2", true), ("prism:3", false)] {
            let mesh = builtin::builtin(name).expect("a built-in mesh");
            let surface = Surface::new(mesh.clone()).unwrap();
            let right = LimitSystem::new(&surface, Scheme::CatmullClark).expect("closed");
            let printed = LimitSystem::with_masks(&surface, &TwoStepsBack).expect("small");
            let difference = (0..mesh.len())
                .flat_map(|i| (0..mesh.len()).map(move |j| (i, j)))
                .map(|(i, j)| (right.a.get(i, j) - printed.a.get(i, j)).abs())
                .fold(0.0, f64::max);
            assert_eq!(difference < 1e-15, equal, "{name}: {difference:e}");
            for i in 0..mesh.len() {
                let sum: f64 = printed.a.row_values(i).iter().sum();
                assert!((sum - 1.0).abs() < 1e-15, "{name}, row {i} sums to {sum}");
            }
        }
    }

    /// Cubic in the numbers of rows and columns, away from where these start again; a quartic is missed.
    #[test]
    fn the_first_step_reproduces_cubics_on_regular_meshes() {
        let n = 16usize;
        for (name, scheme) in [("torus", Scheme::CatmullClark), ("tri-torus", Scheme::Loop)] {
            let mut mesh = builtin::builtin(&format!("{name}:{n}x{n}")).expect("a built-in mesh");
            for (v, p) in mesh.positions.iter_mut().enumerate() {
                // Of the lattice that the triangles are regular in, or of any other: an affine map keeps the degree.
                let [x, y] = [v / n, v % n].map(|k| k as f64 - 8.0);
                *p = DVec3::new(x * x * y - 2.0 * y * y * y, x * x * x + x * y, x.powi(4));
            }
            let surface = Surface::new(mesh).expect("closed");
            let control = surface.with_positions(quasi_interpolant(&surface, scheme).expect("closed"));
            let limits = crate::interpolate::limit_points(&control, scheme).expect("closed");
            let inside = (0..n * n).filter(|v| [v / n, v % n].iter().all(|k| (3..n - 3).contains(k)));
            for v in inside {
                let off = (limits[v] - surface.positions()[v]).abs();
                assert!(off.x.max(off.y) < 1e-11 && off.z > 0.1, "{name}, {v}: {off}");
            }
        }
    }

    #[test]
    fn a_pass_more_than_updates() {
        let mesh = builtin::builtin("icosphere:1").expect("a built-in mesh");
        let surface = Surface::new(mesh.clone()).unwrap();
        let system = LimitSystem::new(&surface, Scheme::Loop).expect("triangles");
        let run = passes(&system, &mesh.positions, 1e-3, 100);
        // The algorithm of the paper, by hand.
        let mut v = mesh.positions.clone();
        let mut k = 0;
        let largest = loop {
            let e: Vec<DVec3> = (0..v.len()).map(|i| mesh.positions[i] - system.a.row_times(i, &v)).collect();
            let largest = e.iter().map(|e| e.length()).fold(0.0, f64::max);
            k += 1;
            if largest <= 1e-3 {
                break largest;
            }
            v.iter_mut().zip(&e).for_each(|(v, e)| *v += *e);
        };
        assert_eq!((run.passes, run.updates), (k, k - 1));
        assert!((run.errors.max - largest).abs() < 1e-15);
    }
}
