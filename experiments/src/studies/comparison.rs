//! The table, the picture and the JSON rows of a comparison of methods.

use std::str::FromStr;

use serde_json::{Value, json};

use super::style;
use crate::report::{Column, Columns, Figure, LinePlot, Scale, Series, Style, Table};
use limitlab::analysis::comparison::{Entry, MethodRow};
use limitlab::analysis::custom_methods::Named;
use limitlab::solvers::{Method, Outcome, Recorded, Solution};
use limitlab::{Error, Result, names};

/// A method that may be asked for, or the chain that chooses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Asked {
    Auto,
    Method(Method<'static>),
}

impl FromStr for Asked {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        let mut all = vec![(AUTO, Asked::Auto)];
        all.extend(Method::ALL.map(|method| (method.name(), Asked::Method(method))));
        names::find("method", name, &all, &Method::ALIASES.map(|(alias, method)| (alias, Asked::Method(method))))
    }
}

/// What the chain that chooses is called.
pub const AUTO: &str = "auto";

/// The row of `auto`, whose parameter is the method that came to the end. Its history has an entry for each correction, so
/// that no rate is observed.
pub fn auto_row(solution: Solution) -> MethodRow<'static> {
    MethodRow {
        method: Named::Own(AUTO.into()),
        variant: "",
        parameter: solution.method.into(),
        solution,
        observed_rate: None,
        predicted_rate: None,
    }
}

/// One row a method; `about` says which system, start and tolerance. What an outcome has for a reason is a note.
pub fn table(id: String, title: String, about: String, rows: &[MethodRow]) -> Table {
    let mut table = columns().table(id, title, rows);
    table.note(format!(
        "{about} Rates are factors per iteration; `fill` counts the stored entries of the factors, where the library tells."
    ));
    for row in rows {
        if let Some(detail) = &row.solution.report.detail {
            table.note(format!("{} ({}): {detail}", row.method, row.parameter));
        }
    }
    table
}

fn columns<'r>() -> Columns<'static, MethodRow<'r>> {
    Columns::new()
        .col(Column::key("method"), |r: &MethodRow| r.method.name().to_owned())
        .col(Column::key("parameter"), |r| r.parameter.clone())
        .col(Column::text("status"), |r| r.solution.report.outcome.name())
        .col(Column::count("iterations"), |r| r.solution.report.iterations)
        .col(Column::number("max_error", 1e-6, 3), |r| r.solution.report.last().max)
        .col(Column::number("mean_error", 1e-6, 3).detail(), |r| r.solution.report.last().mean)
        .col(Column::number("observed_rate", 1e-3, 4).detail(), |r| r.observed_rate)
        .col(Column::number("predicted_rate", 1e-6, 4).detail(), |r| r.predicted_rate)
        .col(Column::count("fill").detail(), |r| r.solution.fill)
        .col(Column::time("seconds_setup").detail(), |r| r.solution.setup_seconds)
        .col(Column::time("seconds_solve"), |r| r.solution.solve_seconds)
}

/// Whether a row's errors have a place over iterations: those of direct methods and histories by corrections have none.
pub(super) fn is_over_iterations(row: &MethodRow) -> bool {
    !row.method.is_direct() && row.solution.report.history.len() == row.solution.report.iterations + 1
}

/// The method with its parameter.
pub fn label(row: &MethodRow) -> String {
    with_parameter(row.method.name(), &row.parameter)
}

/// The line of a comparison, as its row will be called.
pub fn name(entry: &Entry) -> String {
    with_parameter(entry.method.name(), &entry.parameter)
}

fn with_parameter(method: &str, parameter: &str) -> String {
    if parameter.is_empty() { method.into() } else { format!("{method} ({parameter})") }
}

/// A run in a figure of convergence.
pub struct Curve {
    pub name: String,
    pub style: Style,
    /// Of the matrix, for an iteration; where they are not known the curve stands over the iterations alone.
    pub passes: Option<usize>,
    pub history: Vec<Recorded>,
    pub outcome: Outcome,
}

/// Errors over iterations, and beside it over passes over the matrix, which tell what iterations of different methods cost.
/// Where a run did not converge, its curve goes on.
pub fn convergence(title: String, y_label: &str, curves: &[Curve]) -> Figure {
    let panel = |x_label: &str, names: bool, passes: &dyn Fn(&Curve) -> Option<usize>| LinePlot {
        x_label: x_label.into(),
        arrows: if names { "not converged".into() } else { String::new() },
        y_label: y_label.into(),
        y_scale: Scale::Log,
        series: curves
            .iter()
            .map(|curve| {
                let passes = passes(curve);
                let points = curve.history.iter().filter_map(|recorded| {
                    passes.map(|passes| ((recorded.iteration * passes) as f64, recorded.errors.max))
                });
                let name = if names { curve.name.clone() } else { String::new() };
                let goes_on = curve.outcome != Outcome::Converged;
                Series { goes_on, ..Series::line(name, points).style(curve.style) }
            })
            .collect(),
        ..LinePlot::default()
    };
    let panels =
        [panel("iterations", false, &|_| Some(1)), panel("passes over the matrix", true, &|curve| curve.passes)];
    Figure { width: 860, height: 340, ..Figure::row(panels) }.title(title)
}

/// The maximum errors of every method that iterates; `unit` is what errors are measured in.
pub fn figure(title: String, unit: &str, rows: &[MethodRow]) -> Figure {
    let curve = |row: &MethodRow| Curve {
        name: label(row),
        style: style::of_row(row),
        passes: row.method.passes(),
        history: row.solution.report.history.clone(),
        outcome: row.solution.report.outcome,
    };
    let curves: Vec<Curve> = rows.iter().filter(|row| !row.method.is_direct()).map(curve).collect();
    convergence(title, &format!("max error ({unit})"), &curves)
}

/// The rows as `compare-solvers --json` has them: the columns of the table, the durations in an object of their own,
/// and what an outcome has for a reason.
pub fn json(rows: &[MethodRow]) -> Value {
    let mut objects = columns().table("", "", rows).to_json();
    for (row, object) in rows.iter().zip(objects.as_array_mut().into_iter().flatten()) {
        object["seconds"] = json!({
            "setup": object["seconds_setup"].take(),
            "solve": object["seconds_solve"].take(),
        });
        object["detail"] = json!(row.solution.report.detail);
        if let Value::Object(fields) = object {
            fields.remove("seconds_setup");
            fields.remove("seconds_solve");
        }
    }
    objects
}
