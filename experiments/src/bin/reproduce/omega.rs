//! ω sweeps: iterations and rates over ω, with the predicted thresholds and optima.

use limitlab::Result;
use limitlab::analysis::sweep::{rounding_floor, sweep};
use limitlab::schemes::Scheme;
use limitlab::solvers::method::SOR_OMEGA;
use limitlab::solvers::{Method, Stop};
use limitlab_experiments::report::{Column, Table};
use limitlab_experiments::studies::sweep as study;

use crate::context::{Context, Item, Subject};
use crate::corpus;

pub const SWEEPS: Item =
    Item { id: "omega-sweeps", title: "Iterations over ω for Jacobi, PIA and SOR, predicted and measured", run };

const METHODS: [Method<'static>; 3] =
    [Method::Jacobi { omega: None }, Method::Pia, Method::Sor { omega: SOR_OMEGA, order: None }];
/// Relative to the diagonal of the bounding box.
const TOLERANCE: f64 = 1e-10;
const LIMIT: usize = 10_000;
/// Sweeps of a quick run.
const QUICK: usize = 1;

fn run(context: &mut Context) -> Result<()> {
    let mut summary = Table::new(
        SWEEPS.id,
        SWEEPS.title,
        vec![
            Column::key("mesh"),
            Column::key("scheme"),
            Column::key("method"),
            Column::number("omega_critical", 1e-6, 6),
            Column::number("omega_critical_data", 1e-4, 6),
            Column::number("omega_first_divergence", 1e-9, 4),
            Column::number("omega_optimal", 1e-6, 6),
            Column::number("omega_best_on_grid", 0.051, 4),
            Column::count("iterations_best"),
            Column::number("rho_optimal", 1e-6, 4),
        ],
    );
    summary.note(
        "Tolerance 10⁻¹⁰ of the bounding box's diagonal, start V = P. `omega_critical` = 2/λ_max is the threshold of \
         the matrix (D⁻¹A for Jacobi, A for PIA), `omega_critical_data` that of the eigenvectors which the data \
         excite, `omega_first_divergence` the first ω of the grid at which the run diverged. SOR has no closed form: \
         only its best ω on the grid is given. Each mesh has a table and a picture of its own.",
    );
    let mut subjects = context.list(&corpus::SWEEPS)?;
    if context.quick {
        subjects.truncate(QUICK);
    }
    for (subject, scheme) in &subjects {
        one(context, subject, *scheme, &mut summary)?;
    }
    context.table(summary)
}

fn one(context: &mut Context, subject: &Subject, scheme: Scheme, summary: &mut Table) -> Result<()> {
    let system = subject.system(scheme)?;
    let grids: Vec<(Method, Vec<f64>)> = METHODS.iter().map(|&m| (m, study::default_grid(m))).collect();
    let size = subject.surface.diagonal();
    let stop = Stop { tolerance: TOLERANCE * size, max_iterations: LIMIT };
    let found = sweep(&system, subject.surface.positions(), &grids, None, &stop, rounding_floor(size), &|_| {})?;
    for &method in &METHODS {
        let thresholds = found.thresholds.iter().find(|t| t.method == method);
        let best = found.best(method);
        let diverged =
            found.rows.iter().find(|r| r.method == method && r.outcome == limitlab::solvers::Outcome::Diverged);
        summary.push(vec![
            subject.name.as_str().into(),
            scheme.name().into(),
            method.name().into(),
            thresholds.map(|t| t.matrix.critical_omega()).into(),
            thresholds.and_then(|t| t.data).map(|d| d.critical_omega()).into(),
            diverged.map(|r| r.omega).into(),
            thresholds.map(|t| t.matrix.optimal_omega()).into(),
            best.map(|r| r.omega).into(),
            best.map(|r| r.iterations).into(),
            thresholds.map(|t| t.matrix.radius(t.matrix.optimal_omega())).into(),
        ]);
    }
    let stem = format!("{}--{}-{scheme}", SWEEPS.id, subject.name.replace([':', ' '], "-"));
    let title = format!("{} under {scheme}", subject.name);
    let about = format!(
        "{} vertices, {} faces; start V = P; tolerance 10⁻¹⁰ of the bounding box's diagonal.",
        subject.surface.len(),
        subject.surface.faces().len()
    );
    let table = study::table(stem.clone(), format!("ω sweep on {title}"), about, &found);
    context.table(table)?;
    context.figure(&stem, &study::plot(title, &METHODS, &found))
}
