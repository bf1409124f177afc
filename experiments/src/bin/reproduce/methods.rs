//! All methods × all schemes × all meshes: iterations to 10⁻³, 10⁻⁶ and 10⁻¹⁰, and convergence plots.

use limitlab::Result;
use limitlab::analysis::comparison::{SOR_OMEGA, SSOR_OMEGA, entries};
use limitlab::analysis::spectrum::spectrum;
use limitlab::schemes::Scheme;
use limitlab::solvers::anderson::WINDOW;
use limitlab::solvers::{Method, Stop, run as solve};
use limitlab_experiments::report::{Cell, Column, Figure, LinePlot, Scale, Series, Table};

use crate::context::{Context, Item, Subject};

pub const ALL: Item =
    Item { id: "all-methods", title: "Iterations of every method under every scheme on every mesh", run };

const STAND_INS: [&str; 9] = [
    "cube",
    "icosahedron",
    "prism:17",
    "torus:32x32",
    "quad-sphere:4",
    "icosphere:3",
    "irregular-quad:1000",
    "irregular-tri:1000",
    "irregular-poly:1000",
];
/// Meshes with convergence plots, one for every scheme they suit.
const PLOTTED: [&str; 4] = ["irregular-quad:1000", "irregular-tri:1000", "psb_m104_horse_233v", "spot_2930v_quad"];
/// The lines of a comparison that have a column.
const COLUMNS: [(Method, &str); 22] = [
    (Method::Lu, ""),
    (Method::Cholesky, "faer"),
    (Method::Cholesky, "nalgebra-sparse"),
    (Method::Ldlt, ""),
    (Method::Jacobi, ""),
    (Method::Thall, ""),
    (Method::GaussSeidel, ""),
    (Method::Sor, ""),
    (Method::Ssor, ""),
    (Method::Pia, ""),
    (Method::WPia, ""),
    (Method::Chebyshev, "proven"),
    (Method::Chebyshev, "estimated"),
    (Method::Cg, "preconditioned by H"),
    (Method::Cg, "on M itself"),
    (Method::PcgJacobi, ""),
    (Method::PcgSsor, ""),
    (Method::PcgIc0, ""),
    (Method::Anderson, "of pia"),
    (Method::Anderson, "of thall"),
    (Method::Anderson, "of jacobi"),
    (Method::HeavyBall, ""),
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
    for subject in context.subjects(&STAND_INS, most)? {
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
            let mut table = Table::new(
                format!("{}--{tolerance:e}", ALL.id),
                format!("Iterations of every method to {tolerance:e}"),
                columns,
            );
            table.note(format!(
                "Updates of all vertices until max_i ‖p_i − (A v)_i‖ ≤ {tolerance:e} of the bounding box's diagonal; \
                 start V = P, file order for in-place sweeps, at most {LIMIT} iterations. A direct method makes one: \
                 the solve. jacobi and w-pia run at their best ω, sor at ω = {SOR_OMEGA}, ssor and pcg-ssor at \
                 {SSOR_OMEGA}; anderson keeps {WINDOW} differences, heavy-ball has an estimated interval. Where the tolerance was not reached, the cell says how the run ended. Meshes of at \
                 most {LARGEST} vertices."
            ));
            table
        })
        .collect()
}

/// The method, with the variant where the method has several.
fn column_name(method: Method, variant: &str) -> String {
    match method {
        Method::Cholesky | Method::Anderson | Method::Chebyshev | Method::Cg => format!("{method} {variant}"),
        Method::Lu
        | Method::Ldlt
        | Method::Jacobi
        | Method::Thall
        | Method::GaussSeidel
        | Method::Sor
        | Method::Ssor
        | Method::Pia
        | Method::WPia
        | Method::HeavyBall
        | Method::PcgJacobi
        | Method::PcgSsor
        | Method::PcgIc0 => method.name().into(),
    }
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
        let line = lines.iter().find(|l| column_name(l.method, l.variant) == name);
        let Some(line) = line else {
            // No bound of λ_min is proven for this mesh.
            rows.iter_mut().for_each(|row| row.push(Cell::Empty));
            continue;
        };
        let report = solve(&system, subject.surface.positions(), line.setup, &stop).report;
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
