//! Convergence histories, the errors of iterate after iterate, in JSON and in CSV.

use std::path::Path;

use serde_json::{Value, json};

use crate::cli::number;
use crate::report::{Column, Columns, Provenance};
use limitlab::Result;
use limitlab::solvers::Recorded;

/// An array with an object an iterate: `iteration`, `max_error` and `mean_error`.
pub fn json(history: &[Recorded]) -> Value {
    let entry = |recorded: &Recorded| {
        json!({
            "iteration": recorded.iteration,
            "max_error": number(recorded.errors.max),
            "mean_error": number(recorded.errors.mean),
        })
    };
    history.iter().map(entry).collect()
}

/// Writes one CSV file with a row an iterate: two columns called `keys` that tell the runs apart, then the fields of
/// [`json()`].
///
/// # Errors
/// If it cannot be written.
pub fn write<'a>(
    path: &Path,
    keys: [&str; 2],
    runs: impl IntoIterator<Item = ([String; 2], &'a [Recorded])>,
    provenance: &Provenance,
) -> Result<()> {
    let columns = Columns::<([String; 2], Recorded)>::new()
        .col(Column::key(keys[0]), |(run, _)| run[0].clone())
        .col(Column::key(keys[1]), |(run, _)| run[1].clone())
        .col(Column::key("iteration"), |(_, at)| at.iteration)
        .col(Column::number("max_error", 1e-6, 3), |(_, at)| at.errors.max)
        .col(Column::number("mean_error", 1e-6, 3), |(_, at)| at.errors.mean);
    let mut table = columns.table("", "", &[]);
    for (run, history) in runs {
        for &at in history {
            table.push(columns.row(&(run.clone(), at)));
        }
    }
    table.write_csv_file(path, provenance)
}
