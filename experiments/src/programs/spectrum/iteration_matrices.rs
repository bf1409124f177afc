//! The iteration matrices of stationary methods: `spectrum MESH --iteration-matrix METHOD[:ω],…`.

use serde_json::Value;

use super::Arguments;
use crate::cli::{self, Matrix, Progress};
use crate::report::Provenance;
use crate::studies::iteration_matrix;
use limitlab::Result;
use limitlab::analysis::complex_spectrum::ComplexSpectrum;
use limitlab::analysis::spectrum::spectrum;
use limitlab::solvers::Method;

/// What begins the names of its files.
const STEMS: [&str; 4] = [
    "spectrum-iteration",
    "spectrum-iteration-eigenvalues",
    "spectrum-iteration-powers",
    "spectrum-iteration-pseudospectra",
];

/// Writes what there is to say of the iteration matrices of `methods`, and gives the JSON object.
pub fn write(name: &str, methods: &[Method<'static>], arguments: &Arguments, provenance: &Provenance) -> Result<Value> {
    let problem = arguments.mesh.problem(name, &arguments.stop, arguments.order, &arguments.common)?;
    let subject = &problem.subject;
    arguments.output.settle(STEMS.map(|stem| subject.stem(stem)))?;
    let progress = Progress::new(name, methods.len(), arguments.common.quiet);
    let order = (&problem.order[..], &*arguments.order.to_string());
    let wish = iteration_matrix::Wish { full: arguments.full, pseudospectra: arguments.pseudospectra };
    let all = match problem.matrix() {
        Matrix::Symmetric(system) => {
            iteration_matrix::all(system, &|| spectrum(system), methods, order, wish, &progress)
        }
        Matrix::General(system, _) => {
            iteration_matrix::all(system, &|| ComplexSpectrum::new(system), methods, order, wish, &progress)
        }
    };
    let all = all.map_err(|e| limitlab::Error::mesh(name, e.to_string()))?;
    drop(progress);
    let (out, made) = (&arguments.output.out, &provenance.about(&subject.source));
    let table = iteration_matrix::table(subject, &all);
    table.write(out, made)?;
    if !arguments.output.json {
        cli::print_table(&table)?;
    }
    iteration_matrix::eigenvalue_table(subject, &all)
        .write_csv_file(&out.join(format!("{}.csv", subject.stem(STEMS[1]))), made)?;
    let (caption, drawn) = (subject.caption(), all.iter().collect::<Vec<_>>());
    arguments.output.figure(&table.id, &iteration_matrix::plane(&caption, &drawn), made)?;
    if let Some(table) = iteration_matrix::power_table(subject, &all) {
        table.write_csv_file(&out.join(format!("{}.csv", table.id)), made)?;
    }
    let further = [iteration_matrix::powers(&caption, &drawn), iteration_matrix::pseudospectra(&caption, &drawn)];
    for (stem, figure) in STEMS[2..].iter().zip(further) {
        if let Some(figure) = figure {
            arguments.output.figure(&subject.stem(stem), &figure, made)?;
        }
    }
    Ok(subject.json(iteration_matrix::json(&all)))
}
