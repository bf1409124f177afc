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

/// The iterates from 0 to 100, then every tenth to 1000, every hundredth to 10 000 and so on, and the last: as many as a
/// curve shows.
pub fn sampled(history: &[Recorded]) -> Vec<Recorded> {
    let is_kept = |at: &Recorded| {
        let digits = at.iteration.checked_ilog10().unwrap_or(0);
        at.iteration.is_multiple_of(10usize.pow(digits.saturating_sub(1)))
    };
    let (last, before) = history.split_last().map_or((None, history), |(last, before)| (Some(last), before));
    before.iter().filter(|at| is_kept(at)).chain(last).copied().collect()
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

#[cfg(test)]
mod tests {
    use super::*;
    use limitlab::solvers::Errors;

    #[test]
    fn a_sample_has_two_digits_and_the_end() {
        let errors = Errors { max: 0.0, mean: 0.0 };
        let history: Vec<Recorded> = (0..=1234).map(|iteration| Recorded { iteration, errors }).collect();
        let kept = |history| sampled(history).iter().map(|at| at.iteration).collect::<Vec<_>>();
        let expected = (0..=100).chain((110..=1000).step_by(10)).chain([1100, 1200, 1234]);
        assert_eq!(kept(&history), expected.collect::<Vec<_>>());
        assert_eq!(kept(&history[..1]), [0]);
        assert_eq!(kept(&[]), [0; 0]);
    }
}
