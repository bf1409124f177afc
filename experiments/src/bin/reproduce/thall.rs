//! Thall: the error after 1, 2, 3, … iterations at his ω = ½ and at the best ω, under Catmull-Clark.

use limitlab::Result;
use limitlab::analysis::spectrum::spectrum;
use limitlab::schemes::Scheme;
use limitlab::solvers::jacobi::THALL_OMEGA;
use limitlab::solvers::{Method, Stop, run as solve};
use limitlab_experiments::report::{Column, Figure, LinePlot, Scale, Series, Table};

use crate::context::{Context, Item};
use crate::corpus;

pub const ITERATIONS: Item = Item {
    id: "thall-iterations",
    title: "Thall's iteration: errors after 1, 2, 3, … steps at ω = ½ and at the best ω",
    run,
};

/// Iterates whose error has a column.
const SHOWN: [usize; 7] = [0, 1, 2, 3, 5, 10, 20];
/// Relative tolerances whose iterations have a column.
const TOLERANCES: [f64; 2] = [1e-3, 1e-6];
/// Largest mesh of a quick run.
const QUICK: usize = 1200;
const LIMIT: usize = 10_000;
/// Meshes in the plot.
const PLOTTED: usize = 8;

fn run(context: &mut Context) -> Result<()> {
    let mut columns = vec![
        Column::key("mesh"),
        Column::key("step"),
        Column::text("vertices"),
        Column::number("omega", 1e-6, 4),
        Column::number("predicted_rho", 1e-6, 4),
    ];
    for k in SHOWN {
        columns.push(Column::number(format!("error_{k}"), 1e-6, 3).floor(1e-13));
    }
    for tolerance in TOLERANCES {
        columns.push(Column::count(format!("iterations_{tolerance:e}")));
    }
    columns.push(Column::text("status"));
    let mut table = Table::new(ITERATIONS.id, ITERATIONS.title, columns);
    table.note(
        "Catmull-Clark on all polygons. `error_k` = max_i ‖p_i − (A v)_i‖ / L after k iterations, L the diagonal of \
         the bounding box. Thall chose ω = ½ without tuning; it converges whenever A is non-singular. The best ω is \
         2/(λ_min + λ_max) of D⁻¹A. A status other than `converged` belongs to the tolerance 10⁻⁶.",
    );
    let most = if context.quick { QUICK } else { usize::MAX };
    let mut series = Vec::new();
    for subject in context.subjects(corpus::THALL, most)? {
        let system = subject.system(Scheme::CatmullClark)?;
        let jacobi = spectrum(&system)?.jacobi;
        let size = subject.surface.diagonal();
        let stop = Stop { tolerance: TOLERANCES[1] * size, max_iterations: LIMIT };
        for (name, omega) in [("ω = ½", THALL_OMEGA), ("best ω", jacobi.optimal_omega())] {
            let solution = solve(&system, subject.surface.positions(), Method::Jacobi { omega: Some(omega) }, &stop);
            let errors: Vec<f64> = solution.report.history.iter().map(|e| e.max / size).collect();
            let mut row = vec![
                subject.name.as_str().into(),
                name.into(),
                subject.surface.len().to_string().into(),
                omega.into(),
                jacobi.radius(omega).into(),
            ];
            row.extend(SHOWN.map(|k| errors.get(k).copied().into()));
            row.extend(TOLERANCES.map(|t| errors.iter().position(|&e| e <= t).into()));
            row.push(solution.report.outcome.name().into());
            table.push(row);
            if omega == THALL_OMEGA && series.len() < PLOTTED {
                series.push(Series::history(subject.name.as_str(), errors));
            }
        }
    }
    context.table(table)?;
    if context.quick {
        return Ok(());
    }
    context.figure(
        ITERATIONS.id,
        &Figure::new(LinePlot {
            title: "Thall's iteration, ω = ½".into(),
            x_label: "iterations".into(),
            y_label: "max error / L".into(),
            x_range: Some((0.0, 120.0)),
            y_scale: Scale::Log,
            series,
            ..LinePlot::default()
        }),
    )
}
