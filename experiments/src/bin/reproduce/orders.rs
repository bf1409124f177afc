//! Does the order of Gauss-Seidel matter? Zheng-Cai §5 leave it open.

use limitlab::Result;
use limitlab::analysis::order_study::{Row, order_study, random_spread};
use limitlab::schemes::Scheme;
use limitlab::solvers::Stop;
use limitlab_experiments::report::{Column, Table};

use crate::context::{Context, Item};
use crate::corpus;

pub const ORDERS: Item =
    Item { id: "orders", title: "Gauss-Seidel and SOR in many vertex orders (open in Zheng-Cai §5)", run };

const OMEGAS: [f64; 2] = [1.0, 1.1];
const RANDOM: u64 = 20;
/// Relative to the diagonal of the bounding box.
const TOLERANCE: f64 = 1e-10;

fn run(context: &mut Context) -> Result<()> {
    let mut table = Table::new(
        ORDERS.id,
        ORDERS.title,
        vec![
            Column::key("mesh"),
            Column::key("scheme"),
            Column::key("omega"),
            Column::key("order"),
            Column::number("rho", 0.02, 4),
            Column::number("sweeps", 0.05, 4).floor(1.01),
        ],
    );
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
    if context.quick {
        return Ok(());
    }
    for (subject, schemes) in context.list(&corpus::ORDERS)? {
        for &scheme in schemes {
            let system = subject.system(scheme)?;
            let stop = Stop { tolerance: TOLERANCE * subject.surface.diagonal(), max_iterations: 10_000 };
            let rows = order_study(&subject.surface, &system, &OMEGAS, RANDOM, &stop)?;
            push(&mut table, &subject.name, scheme, &rows);
        }
    }
    context.table(table)
}

fn push(table: &mut Table, mesh: &str, scheme: Scheme, rows: &[Row]) {
    let mut line = |omega: f64, order: String, rho: Option<f64>, sweeps: f64| {
        table.push(vec![
            mesh.into(),
            scheme.name().into(),
            omega.to_string().into(),
            order.into(),
            rho.into(),
            sweeps.into(),
        ]);
    };
    for row in rows.iter().filter(|r| !r.order.starts_with("random:")) {
        line(row.omega, row.order.clone(), row.rho, row.iterations);
    }
    for omega in OMEGAS {
        let Some(spread) = random_spread(rows, omega) else {
            continue;
        };
        for (k, name) in ["least", "mean", "greatest"].into_iter().enumerate() {
            line(omega, format!("random, {name}"), Some(spread.rho[k]), spread.iterations[k]);
        }
    }
}
