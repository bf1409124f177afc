//! All methods × all schemes × all meshes: iterations to 10⁻³, 10⁻⁶ and 10⁻¹⁰, and convergence plots.

use limitlab::Result;
use limitlab::analysis::comparison::entries;
use limitlab::analysis::spectrum::spectrum;
use limitlab::interpolate::interpolate;
use limitlab::schemes::Scheme;
use limitlab::solvers::anderson::WINDOW;
use limitlab::solvers::method::{SOR_OMEGA, SSOR_OMEGA};
use limitlab::solvers::{Method, Outcome, Stop, run as solve};
use limitlab_experiments::report::{Cell, Column, Figure, LinePlot, Scale, Series, Table};

use crate::context::{Context, Item, Subject};
use crate::corpus;

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
/// Relative to the diagonal of the bounding box.
const TOLERANCES: [f64; 3] = [1e-3, 1e-6, 1e-10];
const LIMIT: usize = 10_000;
/// Larger meshes are left to the `scaling` program.
const LARGEST: usize = 20_000;
/// Largest mesh of a quick run.
const QUICK: usize = 300;

fn run(context: &mut Context) -> Result<()> {
    let mut tables = empty_tables();
    let most = if context.quick { QUICK } else { LARGEST };
    for subject in context.subjects(&corpus::ALL_METHODS, most)? {
        for scheme in Scheme::ALL {
            if subject.suits(scheme) {
                one(context, &subject, scheme, &mut tables)?;
            }
        }
    }
    for table in tables {
        context.table(table)?;
    }
    Ok(())
}

/// One table a tolerance, with a column for every line of the comparison.
fn empty_tables() -> Vec<Table> {
    TOLERANCES
        .iter()
        .map(|tolerance| {
            let mut columns = vec![Column::key("mesh"), Column::key("scheme"), Column::text("vertices")];
            columns.extend(COLUMNS.map(|(method, variant)| Column::count(column_name(method, variant))));
            columns.push(Column::count("auto"));
            let mut table = Table::new(
                format!("{}--{tolerance:e}", ALL.id),
                format!("Iterations of every method to {tolerance:e}"),
                columns,
            );
            table.note(format!(
                "Updates of all vertices until max_i ‖p_i − (A v)_i‖ ≤ {tolerance:e} of the bounding box's diagonal; \
                 start V = P, file order for in-place sweeps, at most {LIMIT} iterations. A direct method makes one: \
                 the solve. jacobi and w-pia run at their best ω, sor at ω = {SOR_OMEGA}, ssor and pcg-ssor at \
                 {SSOR_OMEGA}; anderson keeps {WINDOW} differences, heavy-ball has an estimated interval; auto counts the \
                 iterations of all corrections in mixed precision together. Where the tolerance was not reached, the cell says how the run ended. Meshes of at \
                 most {LARGEST} vertices."
            ));
            table
        })
        .collect()
}

/// The method, with the variant where the method has several.
fn column_name(method: &str, variant: &str) -> String {
    let several = COLUMNS.iter().filter(|column| column.0 == method).count() > 1;
    if several { format!("{method} {variant}") } else { method.into() }
}

fn one(context: &Context, subject: &Subject, scheme: Scheme, tables: &mut [Table]) -> Result<()> {
    let system = subject.system(scheme)?;
    let spectrum = spectrum(&system)?;
    let size = subject.surface.diagonal();
    let stop = Stop { tolerance: TOLERANCES[2] * size, max_iterations: LIMIT };
    let mut rows: Vec<Vec<Cell>> = TOLERANCES
        .iter()
        .map(|_| vec![subject.name.as_str().into(), scheme.name().into(), subject.surface.len().to_string().into()])
        .collect();
    let mut series = Vec::new();
    let lines = entries(&system, &spectrum, &Method::ALL, None, "file")?;
    for (method, variant) in COLUMNS {
        let name = column_name(method, variant);
        let line = lines.iter().find(|l| column_name(l.method.name(), l.variant) == name);
        let Some(line) = line else {
            // No bound of λ_min is proven for this mesh.
            rows.iter_mut().for_each(|row| row.push(Cell::Empty));
            continue;
        };
        let report = solve(&system, subject.surface.positions(), line.method, &stop).report;
        let errors: Vec<f64> = report.history.iter().map(|e| e.max / size).collect();
        for (row, tolerance) in rows.iter_mut().zip(TOLERANCES) {
            row.push(match errors.iter().position(|&e| e <= tolerance) {
                Some(iterations) => iterations.into(),
                None => report.outcome.name().into(),
            });
        }
        if !line.method.is_direct() {
            let name = format!("{} ({})", line.method, line.parameter);
            series.push(Series::history(name, errors));
        }
    }
    for (row, tolerance) in rows.iter_mut().zip(TOLERANCES) {
        let stop = Stop { tolerance: tolerance * size, max_iterations: LIMIT };
        let report = interpolate(&subject.surface, scheme, &stop.into())?.report;
        row.push(match report.outcome {
            Outcome::Converged => report.iterations.into(),
            other => other.name().into(),
        });
    }
    for (table, row) in tables.iter_mut().zip(rows) {
        table.push(row);
    }
    if context.quick || !PLOTTED.contains(&subject.name.as_str()) {
        return Ok(());
    }
    let stem = format!("{}--{}-{scheme}", ALL.id, subject.name.replace(':', "-"));
    context.figure(
        &stem,
        &Figure::new(LinePlot {
            title: format!("{} under {scheme}", subject.name),
            x_label: "iterations".into(),
            y_label: "max error / L".into(),
            y_scale: Scale::Log,
            series,
            ..LinePlot::default()
        }),
    )
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
