//! ω sweeps: iterations and rates over ω, with the predicted thresholds and optima.

use crate::report::{Column, Columns};
use crate::studies::sweep as study;
use limitlab::Result;
use limitlab::analysis::spectrum::spectrum;
use limitlab::analysis::sweep::{OmegaSweep, Thresholds, rounding_floor, sweep};
use limitlab::schemes::Scheme;
use limitlab::solvers::method::SOR_OMEGA;
use limitlab::solvers::{Method, Outcome, Stop};

use crate::programs::reproduce::context::{Context, Item, Question, Subject};
use crate::programs::reproduce::corpus;

pub const SWEEPS: Item = Item {
    id: "omega-sweeps",
    title: "Iterations over ω for Jacobi, PIA and SOR, predicted and measured",
    question: Some(Question {
        asks: "At which ω is an iteration fastest, and at which does it diverge?",
        answer: "Where the spectrum says: runs diverge from 2/λ_max on, and are fastest near 2/(λ_min + λ_max), with \
                 λ_min and λ_max those of the eigenvectors that the data excite.",
    }),
    run,
};

const METHODS: [Method<'static>; 3] =
    [Method::Jacobi { omega: None }, Method::Pia, Method::Sor { omega: SOR_OMEGA, order: None }];
/// Relative to the diagonal of the bounding box.
const TOLERANCE: f64 = 1e-10;
const LIMIT: usize = 10_000;
/// Sweeps of a quick run.
const QUICK: usize = 1;

/// A method on a mesh under a scheme.
struct Row<'a> {
    subject: &'a Subject,
    scheme: Scheme,
    found: &'a OmegaSweep,
    method: Method<'static>,
}

impl Row<'_> {
    /// SOR has none.
    fn thresholds(&self) -> Option<&Thresholds> {
        self.found.thresholds.iter().find(|t| t.method == self.method)
    }

    fn first_divergence(&self) -> Option<f64> {
        let mut rows = self.found.rows.iter();
        rows.find(|r| r.method == self.method && r.outcome == Outcome::Diverged).map(|r| r.omega)
    }
}

fn run(context: &mut Context) -> Result<()> {
    let mut subjects = context.list(&corpus::SWEEPS)?;
    if context.quick {
        subjects.truncate(QUICK);
    }
    let mut sweeps = Vec::new();
    for (subject, scheme) in &subjects {
        sweeps.push((subject, *scheme, one(context, subject, *scheme)?));
    }
    let rows: Vec<Row> = sweeps
        .iter()
        .flat_map(|&(subject, scheme, ref found)| METHODS.map(|method| Row { subject, scheme, found, method }))
        .collect();
    let mut summary = Columns::<Row>::new()
        .col(Column::key("mesh"), |r| r.subject.name.clone())
        .col(Column::key("scheme"), |r| r.scheme.name())
        .col(Column::key("method"), |r| r.method.name())
        .col(Column::number("omega_critical", 1e-6, 6), |r| r.thresholds().map(|t| t.critical_omega))
        .col(Column::number("omega_critical_data", 1e-4, 6), |r| {
            r.thresholds().and_then(|t| t.data).map(|d| d.critical_omega())
        })
        .col(Column::number("omega_first_divergence", 1e-9, 4), Row::first_divergence)
        .col(Column::number("omega_optimal", 1e-6, 6), |r| r.thresholds().map(|t| t.optimal_omega))
        .col(Column::number("omega_best_on_grid", 0.051, 4), |r| r.found.best(r.method).map(|b| b.omega))
        .col(Column::count("iterations_best"), |r| r.found.best(r.method).map(|b| b.iterations))
        .col(Column::number("rho_optimal", 1e-6, 4), |r| r.thresholds().map(|t| t.optimal_rho))
        .table(SWEEPS.id, SWEEPS.title, &rows);
    summary.note(
        "Tolerance 10⁻¹⁰ of the bounding box's diagonal, start V = P. `omega_critical` = 2/λ_max is the threshold of \
         the matrix (D⁻¹A for Jacobi, A for PIA), `omega_critical_data` that of the eigenvectors which the data \
         excite, `omega_first_divergence` the first ω of the grid at which the run diverged. SOR has no closed form: \
         only its best ω on the grid is given. Each mesh has a table and a picture of its own.",
    );
    context.table(summary)
}

/// The sweep on one mesh, with a table and a picture of its own.
fn one(context: &mut Context, subject: &Subject, scheme: Scheme) -> Result<OmegaSweep> {
    let system = subject.system(scheme)?;
    let grids: Vec<(Method, Vec<f64>)> = METHODS.iter().map(|&m| (m, study::default_grid(m))).collect();
    let size = subject.surface.diagonal();
    let stop = Stop { tolerance: TOLERANCE * size, max_iterations: LIMIT };
    let points = subject.surface.positions();
    let found =
        sweep((&system, &spectrum(&system)?), (points, points), &grids, None, &stop, rounding_floor(size), &|_| {})?;
    let stem = format!("{}--{}-{scheme}", SWEEPS.id, subject.name.replace([':', ' '], "-"));
    let title = format!("{} under {scheme}", subject.name);
    let about = format!(
        "{} vertices, {} faces; start V = P; tolerance 10⁻¹⁰ of the bounding box's diagonal.",
        subject.surface.len(),
        subject.surface.faces().len()
    );
    let table = study::table(stem.clone(), format!("ω sweep on {title}"), about, &found);
    context.table(table)?;
    let title = format!("{} under {scheme}, to 10⁻¹⁰ of the diagonal", context.caption(subject));
    context.figure(&stem, &study::plot(title, &METHODS, &found))?;
    Ok(found)
}
