//! Vertex orders of Gauss-Seidel compared, which Zheng-Cai §5 leave open.

use crate::report::{Column, Columns};
use limitlab::Result;
use limitlab::analysis::order_study::{OrderRow, order_study, random_spread};
use limitlab::schemes::Scheme;
use limitlab::solvers::Stop;

use crate::programs::reproduce::context::{Context, Item, Question, Subject};
use crate::programs::reproduce::corpus;

pub const ORDERS: Item = Item {
    id: "orders",
    title: "Gauss-Seidel and SOR in many vertex orders (open in Zheng-Cai §5)",
    question: Some(Question {
        asks: "Does the order of Gauss-Seidel matter?",
        answer: "For the number of sweeps, never for whether they converge. Colour by colour is the fastest or not \
                 much behind, and may run in parallel; fronts are the slowest on regular meshes (Z6).",
    }),
    run,
};

const OMEGAS: [f64; 2] = [1.0, 1.1];
const RANDOM: u64 = 20;
/// Relative to the diagonal of the bounding box.
const TOLERANCE: f64 = 1e-10;

/// One order, or one figure of the random ones together.
struct Line {
    order: String,
    omega: f64,
    rho: Option<f64>,
    sweeps: f64,
}

fn run(context: &mut Context) -> Result<()> {
    if context.quick {
        return Ok(());
    }
    let subjects = context.list(&corpus::ORDERS)?;
    let mut records = Vec::new();
    for (subject, schemes) in &subjects {
        for &scheme in *schemes {
            let system = subject.system(scheme)?;
            let stop = Stop { tolerance: TOLERANCE * subject.surface.diagonal(), max_iterations: 10_000 };
            let rows = order_study(&subject.surface, &system, &OMEGAS, RANDOM, &stop)?;
            records.extend(lines(&rows).into_iter().map(|line| (subject, scheme, line)));
        }
    }
    let mut table = Columns::<(&Subject, Scheme, Line)>::new()
        .col(Column::key("mesh"), |(subject, ..)| subject.name.clone())
        .col(Column::key("scheme"), |(_, scheme, _)| scheme.name())
        .col(Column::key("omega"), |(.., line)| line.omega.to_string())
        .col(Column::key("order"), |(.., line)| line.order.clone())
        .col(Column::number("rho", 0.02, 4), |(.., line)| line.rho)
        .col(Column::number("sweeps", 0.05, 4).floor(1.01), |(.., line)| line.sweeps)
        .table(ORDERS.id, ORDERS.title, &records);
    table.note(format!(
        "Sweeps to {TOLERANCE:e} of the bounding box's diagonal from V = P, and the spectral radius of the sweep. \
         `random` orders: least, mean and greatest of {RANDOM} seeds. `greedy` relaxes the largest residual first \
         (Gauss-Southwell, ω = 1): its sweeps are updates / N."
    ));
    table.note(
        "Fronts (breadth first, reverse Cuthill-McKee, row by row) are the slowest on regular meshes, though their \
         spectral radius may be the least: the error is carried along the front. Colour by colour is the best or \
         within a few sweeps of it and may run in parallel. The order is worth up to a half, never more.",
    );
    context.table(table)
}

/// Each order that does not depend on chance, then the random ones at each ω.
fn lines(rows: &[OrderRow]) -> Vec<Line> {
    let alone = rows.iter().filter(|r| !r.order.starts_with("random:"));
    let mut lines: Vec<Line> =
        alone.map(|r| Line { order: r.order.clone(), omega: r.omega, rho: r.rho, sweeps: r.iterations }).collect();
    for spread in OMEGAS.into_iter().filter_map(|omega| random_spread(rows, omega)) {
        for (k, name) in ["least", "mean", "greatest"].into_iter().enumerate() {
            let order = format!("random, {name}");
            lines.push(Line { order, omega: spread.omega, rho: Some(spread.rho[k]), sweeps: spread.iterations[k] });
        }
    }
    lines
}
