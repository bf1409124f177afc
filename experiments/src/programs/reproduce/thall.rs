//! Thall: the error after 1, 2, 3, … iterations at his ω = ½ and at the best ω, under Catmull-Clark.

use crate::report::series::marker;
use crate::report::{Column, Columns, Figure, LinePlot, Scale, Series};
use limitlab::Result;
use limitlab::analysis::spectrum::{Extremes, spectrum};
use limitlab::schemes::Scheme;
use limitlab::solvers::jacobi::THALL_OMEGA;
use limitlab::solvers::{Method, Outcome, Stop, run as solve};

use crate::programs::reproduce::context::{Context, Item, Question, Subject};
use crate::programs::reproduce::corpus;

pub const ITERATIONS: Item = Item {
    id: "thall-iterations",
    title: "Thall's iteration: errors after 1, 2, 3, … steps at ω = ½ and at the best ω",
    question: Some(Question {
        asks: "How good are the first of Thall's iterations, and what would another ω gain?",
        answer: "Each of the first three shrinks the largest error on every mesh (T10). His ω = ½ is always safe (T6) \
                 and never above the ω of the least spectral radius, whose gain for each mesh's points is in T5.",
    }),
    run,
};

/// Iterates whose error has a column.
const SHOWN: [usize; 7] = [0, 1, 2, 3, 5, 10, 20];
/// Relative tolerances whose iterations have a column.
const TOLERANCES: [f64; 2] = [1e-3, 1e-6];
/// Largest mesh of a quick run.
const QUICK: usize = 1200;
const LIMIT: usize = 10_000;
/// The real models in the plot: the papers', and the one that is slowest.
const PLOTTED: [&str; 8] = [
    "psb_m104_horse_233v",
    "psb_m32_bird_1129v",
    "psb_m329_hand_6191v",
    "psb_m1630_hat_562v",
    "geomview_mushroom_226v",
    "bob_334v_quad",
    "spot_2930v_quad",
    "abstr_36v_poly",
];
/// Iterations in the plot.
const LONGEST: f64 = 120.0;

/// A run at one ω.
struct Row<'a> {
    subject: &'a Subject,
    name: &'static str,
    omega: f64,
    /// The ends of the spectrum of D⁻¹A.
    jacobi: Extremes,
    /// The largest of each iterate, relative to the diagonal of the bounding box.
    errors: Vec<f64>,
    outcome: Outcome,
}

fn run(context: &mut Context) -> Result<()> {
    let most = if context.quick { QUICK } else { usize::MAX };
    let subjects = context.subjects(corpus::THALL, most)?;
    let mut rows = Vec::new();
    for subject in &subjects {
        let system = subject.system(Scheme::CatmullClark)?;
        let jacobi = spectrum(&system)?.jacobi;
        let size = subject.surface.diagonal();
        let stop = Stop { tolerance: TOLERANCES[1] * size, max_iterations: LIMIT };
        for (name, omega) in [("ω = ½", THALL_OMEGA), ("best ω", jacobi.optimal_omega())] {
            let method = Method::Jacobi { omega: Some(omega) };
            let report = solve(&system, subject.surface.positions(), method, &stop).report;
            let errors = report.maxima().into_iter().map(|error| error / size).collect();
            rows.push(Row { subject, name, omega, jacobi, errors, outcome: report.outcome });
        }
    }
    let mut columns = Columns::<Row>::new()
        .col(Column::key("mesh"), |r| r.subject.name.clone())
        .col(Column::key("step"), |r| r.name)
        .col(Column::text("vertices"), |r| r.subject.surface.len())
        .col(Column::number("omega", 1e-6, 4), |r| r.omega)
        .col(Column::number("predicted_rho", 1e-6, 4), |r| r.jacobi.radius(r.omega));
    for k in SHOWN {
        let column = Column::number(format!("error_{k}"), 1e-6, 3).floor(1e-13);
        columns = columns.col(column, move |r| r.errors.get(k).copied());
    }
    for tolerance in TOLERANCES {
        let column = Column::count(format!("iterations_{tolerance:e}"));
        columns = columns.col(column, move |r| r.errors.iter().position(|&e| e <= tolerance));
    }
    let mut table =
        columns.col(Column::text("status"), |r| r.outcome.name()).table(ITERATIONS.id, ITERATIONS.title, &rows);
    table.note(
        "Catmull-Clark on all polygons. `error_k` = max_i ‖p_i − (A v)_i‖ / L after k iterations, L the diagonal of \
         the bounding box. Thall chose ω = ½ without tuning; it converges whenever A is non-singular. The best ω of the \
         matrix is 2/(λ_min + λ_max) of D⁻¹A; points may have another (T5). A status other than `converged` belongs to the tolerance 10⁻⁶.",
    );
    context.table(table)?;
    if context.quick {
        return Ok(());
    }
    let is_plotted = |name: &str| !context.real() || PLOTTED.contains(&name);
    let plotted = rows.iter().filter(|r| r.omega == THALL_OMEGA && is_plotted(&r.subject.name));
    let series: Vec<Series> = plotted
        .enumerate()
        .map(|(k, r)| Series::history(r.subject.name.as_str(), r.errors.iter().copied()).marker(marker(k)))
        .collect();
    let which = if context.real() { ", the slowest among them" } else { ", noise 0.1" };
    let title = format!("Thall's iteration (ω = ½) on {} of {} meshes{which}", series.len(), subjects.len());
    context.figure(
        ITERATIONS.id,
        &Figure::new(LinePlot {
            title,
            x_label: "iterations".into(),
            y_label: "max error / L".into(),
            x_range: Some((0.0, LONGEST)),
            y_scale: Scale::Log,
            arrows: "goes on".into(),
            series,
            ..LinePlot::default()
        }),
    )
}
