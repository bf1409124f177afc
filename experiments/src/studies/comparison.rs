//! The table, the picture and the JSON rows of a comparison of methods.

use std::str::FromStr;

use serde_json::{Value, json};

use crate::cli::number;
use crate::report::{Column, Figure, LinePlot, Scale, Series, Table};
use limitlab::analysis::comparison::Row;
use limitlab::analysis::own::Named;
use limitlab::solvers::{Method, Solution};
use limitlab::{Error, Result};

/// A method that may be asked for, or the chain that chooses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Asked {
    Auto,
    Method(Method<'static>),
}

impl FromStr for Asked {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        match name {
            AUTO => Ok(Asked::Auto),
            _ => name.parse().map(Asked::Method).map_err(|e: Error| Error::Unknown(format!("{e}, {AUTO}"))),
        }
    }
}

const AUTO: &str = "auto";

/// The row of `auto`, whose parameter is the method that came to the end. Its history has an entry for each correction, so
/// that no rate is observed.
pub fn auto_row(solution: Solution) -> Row<'static> {
    Row {
        method: Named::Own(AUTO.into()),
        variant: "",
        parameter: solution.method.into(),
        solution,
        observed_rate: None,
        predicted_rate: None,
    }
}

/// One row a method; `about` says which system, start and tolerance. What an outcome has for a reason is a note.
pub fn table(id: String, title: String, about: String, rows: &[Row]) -> Table {
    let mut table = Table::new(
        id,
        title,
        vec![
            Column::key("method"),
            Column::key("parameter"),
            Column::text("status"),
            Column::count("iterations"),
            Column::number("max_error", 1e-6, 3),
            Column::number("mean_error", 1e-6, 3),
            Column::number("observed_rate", 1e-3, 4),
            Column::number("predicted_rate", 1e-6, 4),
            Column::count("fill"),
            Column::time("seconds_setup"),
            Column::time("seconds_solve"),
        ],
    );
    table.note(format!(
        "{about} Rates are factors per iteration; `fill` counts the stored entries of the factors, where the library tells."
    ));
    for row in rows {
        let report = &row.solution.report;
        let last = report.last();
        table.push(vec![
            row.method.name().into(),
            row.parameter.as_str().into(),
            report.outcome.name().into(),
            report.iterations.into(),
            last.max.into(),
            last.mean.into(),
            row.observed_rate.into(),
            row.predicted_rate.into(),
            row.solution.fill.into(),
            row.solution.setup_seconds.into(),
            row.solution.solve_seconds.into(),
        ]);
        if let Some(detail) = &report.detail {
            table.note(format!("{} ({}): {detail}", row.method, row.parameter));
        }
    }
    table
}

/// The maximum errors over the iterations, a line for each method that iterates; `unit` is what errors are measured in.
pub fn figure(title: String, unit: &str, rows: &[Row]) -> Figure {
    let series = rows
        .iter()
        // A history by corrections has no place over iterations.
        .filter(|row| {
            !row.method.is_direct() && row.solution.report.history.len() == row.solution.report.iterations + 1
        })
        .map(|row| {
            let name = match row.parameter.as_str() {
                "" => row.method.to_string(),
                parameter => format!("{} ({parameter})", row.method),
            };
            Series::history(name, row.solution.report.history.iter().map(|e| e.max))
        })
        .collect();
    Figure::new(LinePlot {
        title,
        x_label: "iterations".into(),
        y_label: format!("max error ({unit})"),
        y_scale: Scale::Log,
        series,
        ..LinePlot::default()
    })
}

/// The rows as `compare-solvers --json` has them: a number that is not finite is `null`.
pub fn json(rows: &[Row]) -> Value {
    let row = |row: &Row| {
        let report = &row.solution.report;
        let last = report.last();
        json!({
            "method": row.method.name(),
            "parameter": row.parameter,
            "iterations": report.iterations,
            "status": report.outcome.name(),
            "detail": report.detail,
            "max_error": number(last.max),
            "mean_error": number(last.mean),
            "observed_rate": row.observed_rate.map(number),
            "predicted_rate": row.predicted_rate.map(number),
            "fill": row.solution.fill,
            "seconds": {
                "setup": number(row.solution.setup_seconds),
                "solve": number(row.solution.solve_seconds),
            },
        })
    };
    rows.iter().map(row).collect()
}
