//! Fairness of the iterates of a method: how much the surface ripples while its error falls, and whether stopping early
//! helps.

use std::ops::ControlFlow;

use glam::DVec3;

use super::energy::{Energies, Fairness};
use crate::assemble::LimitSystem;
use crate::interpolate::thall::normal_deviations;
use crate::mesh::Surface;
use crate::schemes::catmull_clark;
use crate::solvers::{Errors, Method, Solution, Stop, run_watched};
use crate::{Error, Result};

/// One iterate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FairnessRow {
    /// The number of updates made; 0 for the start.
    pub iteration: usize,
    /// Interpolation error, in mesh units.
    pub errors: Errors,
    /// The energies of its surface, unweighted.
    pub energies: Energies,
    /// The angle between the surface's normals at the given points and the wanted ones, in radians.
    pub deviation_max: f64,
    /// The mean of the same angles over the vertices, in radians.
    pub deviation_mean: f64,
}

/// Runs a method on the Catmull-Clark system of `mesh` and measures every iterate, the start first: its errors, the
/// energies of its surface, its normals against `normals`. Each measurement refines twice.
///
/// # Errors
/// As the refinement.
///
/// # Panics
/// As [`run_watched`], and if `fairness` is not that of a mesh with the same faces or there is not one normal a
/// vertex.
pub fn follow(
    surface: &Surface,
    system: &LimitSystem,
    fairness: &Fairness,
    normals: &[DVec3],
    method: Method,
    stop: &Stop,
) -> Result<(Vec<FairnessRow>, Solution)> {
    let mut rows = Vec::new();
    let mut failure: Option<Error> = None;
    let mut iterate = surface.clone();
    let solution = run_watched(system, surface.positions(), method, stop, &mut |step| {
        iterate.positions_mut().copy_from_slice(step.points);
        match measure(&iterate, fairness, normals) {
            Ok((energies, deviation_max, deviation_mean)) => {
                rows.push(FairnessRow {
                    iteration: step.iteration,
                    errors: step.errors,
                    energies,
                    deviation_max,
                    deviation_mean,
                });
                ControlFlow::Continue(())
            }
            Err(e) => {
                failure = Some(e);
                ControlFlow::Break(())
            }
        }
    });
    match failure {
        Some(e) => Err(e),
        None => Ok((rows, solution)),
    }
}

/// The energies of a control mesh's surface, and the largest and the mean deviation of its normals.
///
/// # Errors
/// As the refinement.
///
/// # Panics
/// As [`follow`].
pub fn measure(surface: &Surface, fairness: &Fairness, normals: &[DVec3]) -> Result<(Energies, f64, f64)> {
    let energies = fairness.energies_of(surface)?;
    let found = catmull_clark::limit_normals(surface)?;
    let deviations = normal_deviations(&found, normals);
    let max = deviations.iter().copied().fold(0.0, f64::max);
    let mean = deviations.iter().sum::<f64>() / deviations.len() as f64;
    Ok((energies, max, mean))
}
