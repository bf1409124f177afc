//! Errors at the vertices while a method goes on: which part of a mesh is slow, and what ripples look like.

use std::ops::ControlFlow;

use serde_json::{Value, json};

use super::comparison::is_over_iterations;
use super::pictures::{Framed, MOST_MAPS, Maps, power};
use crate::cli::{OutputFlags, Problem};
use crate::report::{ColourScale, Provenance};
use limitlab::Result;
use limitlab::analysis::comparison::MethodRow;
use limitlab::analysis::custom_methods::Named;
use limitlab::mesh::ply::Scalars;
use limitlab::solvers::{Method, Step, System, run_from};

/// The part of the largest error that has the first colour.
const LEAST: f64 = 1e-2;

/// The method of a row, if it has an error at every vertex after every iteration: direct methods and the chain that chooses
/// by itself have none.
pub(super) fn method_over_iterations<'a>(row: &MethodRow<'a>) -> Option<Method<'a>> {
    match row.method {
        Named::Ours(method) if is_over_iterations(row) => Some(method),
        Named::Ours(_) | Named::Own(_) => None,
    }
}

/// Runs a method on the system of a mesh once more, and tells `see` the errors ‖p_i − (A v)_i‖ after the iterations `at`,
/// ascending, as far as the run gets: one a vertex in units of [`Problem::scale`], 0 where a vertex is no unknown.
pub(super) fn watch(
    problem: &Problem,
    system: &impl System,
    method: Method,
    at: &[usize],
    see: &mut dyn FnMut(usize, &[f64]),
) {
    let Some((surface, _, vertices)) = problem.mesh() else { return };
    let (points, start) = problem.data();
    let mut errors = vec![0.0; surface.len()];
    let last = at.last().copied().unwrap_or(0);
    let each = &mut |step: &Step| {
        if at.binary_search(&step.iteration).is_ok() {
            for (i, &p) in points.iter().enumerate() {
                let vertex = vertices.map_or(i, |vertices| vertices[i] as usize);
                errors[vertex] = (p - system.row(i, step.points)).length();
            }
            see(step.iteration, &errors);
        }
        if step.iteration >= last { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    run_from(system, points, start, method, &problem.stop, each);
}

/// The errors of one row of a comparison at the vertices that are written for those of the mesh file, in mesh units.
pub struct ErrorMaps {
    /// The method, and its variant.
    label: String,
    /// The iterations, and their errors.
    maps: Vec<(usize, Vec<f64>)>,
}

/// The errors of a row after the iterations `at`, ascending, those that its run has; `None` if it has none.
pub fn measure(problem: &Problem, system: &impl System, row: &MethodRow, at: &[usize]) -> Option<ErrorMaps> {
    let method = method_over_iterations(row)?;
    let mut maps = Vec::new();
    watch(problem, system, method, at, &mut |k, errors| {
        let errors: Vec<f64> = errors.iter().map(|e| problem.scale * e).collect();
        maps.push((k, problem.file_values(&errors)));
    });
    let label = [row.method.name(), row.variant].into_iter().filter(|word| !word.is_empty());
    let label = label.collect::<Vec<_>>().join(" ");
    (!maps.is_empty()).then_some(ErrorMaps { label, maps })
}

impl ErrorMaps {
    /// What its files are called.
    pub fn id(&self, stem: &str) -> String {
        format!("{stem}-errors-{}", self.label.replace(' ', "-"))
    }

    /// Writes `STEM-errors-METHOD.ply` and a picture; gives the JSON object about them.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn write(self, problem: &Problem, stem: &str, output: &OutputFlags, made: &Provenance) -> Result<Value> {
        let Some(mesh) = problem.file_mesh() else { return Ok(Value::Null) };
        let id = self.id(stem);
        let ErrorMaps { label, maps } = self;
        let iterations: Vec<usize> = maps.iter().map(|(k, _)| *k).collect();
        // Errors that have diverged beyond all numbers take the last colour.
        let largest = |(_, errors): &(usize, Vec<f64>)| errors.iter().copied().fold(0.0, f64::max).min(f64::MAX);
        let most: Vec<f64> = maps.iter().map(largest).collect();
        let units = most.iter().map(|&most| if most > 0.0 { most } else { 1.0 }).collect();
        let scalars = maps.into_iter().map(|(k, values)| Scalars { name: format!("error_{k}"), values }).collect();
        let maps =
            Maps { mesh: &mesh, scalars, units, scale: ColourScale::logarithmic("error / largest", (LEAST, 1.0)) };
        let file = output.out.join(format!("{id}.ply"));
        maps.write_ply(&file, iterations.len() - 1, made)?;
        let all = iterations.len();
        let of = if all > MOST_MAPS { format!(" ({MOST_MAPS} of {all})") } else { String::new() };
        let title = format!("{}: errors of {label} after k iterations{of}", problem.subject.caption());
        let captions = iterations.iter().zip(most).map(|(k, most)| format!("k = {k}: largest {}", power(most)));
        output.figure(&id, &maps.figure(title, captions.take(MOST_MAPS), Framed::Whole), made)?;
        Ok(json!({ "file": file.display().to_string(), "iterations": iterations }))
    }
}
