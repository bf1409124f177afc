//! Progressive iterative interpolation as its authors ran it: the counts and errors of their Table 1.

use glam::DVec3;

use crate::assemble::LimitSystem;
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
    use crate::mesh::{Surface, builtin};

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
