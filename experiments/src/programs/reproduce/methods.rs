//! All methods × all schemes × all meshes: iterations to 10⁻³, 10⁻⁶ and 10⁻¹⁰, and convergence plots.

use std::collections::BTreeMap;

use crate::report::{Cell, Column, Columns, Table};
use crate::studies::comparison as study;
use crate::studies::comparison::{Curve, convergence};
use crate::studies::style;
use limitlab::Result;
use limitlab::analysis::comparison::{Entry, entries};
use limitlab::analysis::spectrum::spectrum;
use limitlab::interpolate::interpolate;
use limitlab::schemes::Scheme;
use limitlab::solvers::anderson::WINDOW;
use limitlab::solvers::method::{SOR_OMEGA, SSOR_OMEGA};
use limitlab::solvers::{Errors, Method, Outcome, Recorded, Report, Stop, run as solve};

use crate::programs::reproduce::context::{Context, Item, Subject};
use crate::programs::reproduce::corpus;

pub const ALL: Item =
    Item { id: "all-methods", title: "Iterations of every method under every scheme on every mesh", run };

/// Meshes with convergence plots, one for every scheme they suit.
const PLOTTED: [&str; 4] = ["irregular-quad:1000", "irregular-tri:1000", "psb_m104_horse_233v", "spot_2930v_quad"];
/// The lines of a comparison, each a column: a method's name, and which of its lines where there are several.
const COLUMNS: [(&str, &str); 22] = [
    ("lu", ""),
    ("cholesky", "faer"),
    ("cholesky", "nalgebra-sparse"),
    ("ldlt", ""),
    ("jacobi", ""),
    ("thall", ""),
    ("gauss-seidel", ""),
    ("sor", ""),
    ("ssor", ""),
    ("pia", ""),
    ("w-pia", ""),
    ("chebyshev", "proven"),
    ("chebyshev", "estimated"),
    ("cg", "preconditioned by H"),
    ("cg", "on M itself"),
    ("pcg-jacobi", ""),
    ("pcg-ssor", ""),
    ("pcg-ic0", ""),
    ("anderson", "of pia"),
    ("anderson", "of thall"),
    ("anderson", "of jacobi"),
    ("heavy-ball", ""),
];
/// The column of the chain that chooses by itself.
const AUTO: &str = "auto";
/// Relative to the diagonal of the bounding box.
const TOLERANCES: [f64; 3] = [1e-3, 1e-6, 1e-10];
const LIMIT: usize = 10_000;
/// Larger meshes are left to the `scaling` program.
const LARGEST: usize = 20_000;
/// Largest mesh of a quick run.
const QUICK: usize = 300;

/// How every method comes to one tolerance, relative to the diagonal of the bounding box.
struct Row<'a> {
    subject: &'a Subject,
    scheme: Scheme,
    tolerance: f64,
    /// By column: the number of iterations, or how else the run ended.
    ended: BTreeMap<String, std::result::Result<usize, Outcome>>,
}

fn run(context: &mut Context) -> Result<()> {
    let most = if context.quick { QUICK } else { LARGEST };
    let subjects = context.subjects(&corpus::ALL_METHODS, most)?;
    let mut rows = Vec::new();
    for subject in &subjects {
        for scheme in Scheme::ALL {
            if subject.suits(scheme) {
                rows.extend(one(context, subject, scheme)?);
            }
        }
    }
    for tolerance in TOLERANCES {
        context.table(table(tolerance, &rows))?;
    }
    Ok(())
}

/// The rows of one tolerance, with a column for every line of the comparison.
fn table(tolerance: f64, rows: &[Row]) -> Table {
    let mut columns = Columns::<Row>::new()
        .col(Column::key("mesh"), |r| r.subject.name.clone())
        .col(Column::key("scheme"), |r| r.scheme.name())
        .col(Column::text("vertices"), |r| r.subject.surface.len().to_string());
    for name in COLUMNS.map(|(method, variant)| column_name(method, variant)).into_iter().chain([AUTO.into()]) {
        columns = columns.col(Column::count(name.clone()), move |r| {
            r.ended.get(&name).map(|ended| match ended {
                Ok(iterations) => Cell::from(*iterations),
                Err(outcome) => outcome.name().into(),
            })
        });
    }
    let mut table = columns.table(
        format!("{}--{tolerance:e}", ALL.id),
        format!("Iterations of every method to {tolerance:e}"),
        rows.iter().filter(|r| r.tolerance == tolerance),
    );
    table.note(format!(
        "Updates of all vertices until max_i ‖p_i − (A v)_i‖ ≤ {tolerance:e} of the bounding box's diagonal; start \
         V = P, file order for in-place sweeps, at most {LIMIT} iterations. A direct method makes one: the solve. \
         jacobi and w-pia run at their best ω, sor at ω = {SOR_OMEGA}, ssor and pcg-ssor at {SSOR_OMEGA}; anderson \
         keeps {WINDOW} differences, heavy-ball has an estimated interval; auto counts the iterations of all \
         corrections in mixed precision together. Where the tolerance was not reached, the cell says how the run \
         ended. Meshes of at most {LARGEST} vertices."
    ));
    table
}

/// The method, with the variant where the method has several.
fn column_name(method: &str, variant: &str) -> String {
    let several = COLUMNS.iter().filter(|column| column.0 == method).count() > 1;
    if several { format!("{method} {variant}") } else { method.into() }
}

/// A row for each of [`TOLERANCES`].
fn one<'a>(context: &mut Context, subject: &'a Subject, scheme: Scheme) -> Result<[Row<'a>; TOLERANCES.len()]> {
    let system = subject.system(scheme)?;
    let spectrum = spectrum(&system)?;
    let size = subject.surface.diagonal();
    let stop = |tolerance| Stop { tolerance: tolerance * size, max_iterations: LIMIT };
    let mut rows = TOLERANCES.map(|tolerance| Row { subject, scheme, tolerance, ended: BTreeMap::new() });
    let mut histories = Vec::new();
    let lines = entries(&system, &spectrum, &Method::ALL, None, "file")?;
    for (method, variant) in COLUMNS {
        let name = column_name(method, variant);
        let line = lines.iter().find(|l| column_name(l.method.name(), l.variant) == name);
        let Some(line) = line else {
            // No bound of λ_min is proven for this mesh.
            continue;
        };
        let mut report = solve(&system, subject.surface.positions(), line.method, &stop(TOLERANCES[2])).report;
        for Recorded { errors, .. } in &mut report.history {
            *errors = Errors { max: errors.max / size, mean: errors.mean / size };
        }
        for row in &mut rows {
            let reached = report.history.iter().find(|at| at.errors.max <= row.tolerance).map(|at| at.iteration);
            row.ended.insert(name.clone(), reached.ok_or(report.outcome));
        }
        if !line.method.is_direct() {
            histories.push((line, report));
        }
    }
    for row in &mut rows {
        let report = interpolate(&subject.surface, scheme, &stop(row.tolerance).into())?.report;
        let ended = match report.outcome {
            Outcome::Converged => Ok(report.iterations),
            other => Err(other),
        };
        row.ended.insert(AUTO.into(), ended);
    }
    if context.quick || !PLOTTED.contains(&subject.name.as_str()) {
        return Ok(rows);
    }
    let stem = format!("{}--{}-{scheme}", ALL.id, subject.name.replace(':', "-"));
    let keys = |line: &Entry| [line.method.to_string(), line.parameter.clone()];
    let runs = histories.iter().map(|(line, report)| (keys(line), &report.history[..]));
    context.histories(&stem, ["method", "parameter"], runs)?;
    let curve = |(line, report): &'_ (&Entry, Report)| Curve {
        name: study::name(line),
        style: style::of(line.method, line.variant),
        passes: line.method.passes(),
        history: report.history.clone(),
        outcome: report.outcome,
    };
    let curves: Vec<Curve> = histories.iter().map(curve).collect();
    context.figure(
        &stem,
        &convergence(format!("{} under {scheme}", context.caption(subject)), "max error / L", &curves),
    )?;
    Ok(rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_method_has_a_column() {
        for method in Method::ALL {
            assert!(COLUMNS.iter().any(|column| column.0 == method.name()), "{method}");
        }
    }
}
