//! Iteration matrices of the splittings on the papers' models: eigenvalues, norms, powers; Young's theory; regular tori in
//! closed form.

use rayon::prelude::*;

use crate::report::{Column, Columns, Table};
use crate::studies::iteration_matrix::{Found, Wish, columns, plane, powers, pseudospectra};
use crate::studies::trajectories::{self, Followed};
use limitlab::Result;
use limitlab::analysis::comparison::with_spectrum;
use limitlab::analysis::iteration_matrix::IterationMatrix;
use limitlab::analysis::pseudospectrum::LARGEST as SMALL;
use limitlab::analysis::spectrum::spectrum;
use limitlab::analysis::torus_symbol::{Colouring, eigenvalues, front_radius};
use limitlab::analysis::trajectories::Trajectories;
use limitlab::analysis::young::Young;
use limitlab::assemble::LimitSystem;
use limitlab::error::short;
use limitlab::mesh::order::Order;
use limitlab::schemes::Scheme;
use limitlab::solvers::method::SOR_OMEGA;
use limitlab::solvers::{Method, Stop, run as solve};

use crate::programs::reproduce::context::{Context, Item, Question, Subject};
use crate::programs::reproduce::corpus;

pub const SPLITTINGS: Item = Item {
    id: "splittings",
    title: "Iteration matrices of the splittings: eigenvalues, norms, powers",
    question: Some(Question {
        asks: "Why does a front with the least spectral radius take the most sweeps?",
        answer: "Its iteration matrix is far from normal: for as many sweeps as it takes the front across the mesh, errors shrink \
                 by the symbol of the front and not by the radius, which tells of later (Z6).",
    }),
    run,
};

/// Relative to the diagonal of the bounding box.
const TOLERANCE: f64 = 1e-10;
const ORDERS: [Order; 3] = [Order::File, Order::Bfs, Order::Multicolour];

/// A method on a mesh under a scheme.
struct Row {
    mesh: String,
    scheme: Scheme,
    found: Found,
    iterations: usize,
}

fn run(context: &mut Context) -> Result<()> {
    let mut subjects = context.list(&corpus::SPLITTINGS)?;
    let orders = if context.quick { &ORDERS[..1] } else { &ORDERS[..] };
    if context.quick {
        subjects.truncate(1);
    }
    let mut rows = Vec::new();
    let mut theory = Vec::new();
    for (subject, scheme) in &subjects {
        let system = subject.system(*scheme)?;
        let all = methods(subject, &system, *scheme, orders, context.quick)?;
        if !context.quick {
            pictures(context, subject, *scheme, &all)?;
            theory.extend(young(subject, *scheme, &system)?);
        }
        rows.extend(all);
    }
    context.table(main_table(&rows))?;
    if context.quick {
        return Ok(());
    }
    // The other schemes. Under mid-edge a torus with even sides has a singular matrix.
    let others = [("torus:12x12", Scheme::ZhengCai), ("torus:11x12", Scheme::MidEdge), ("icosphere:2", Scheme::Sqrt3)];
    for (name, scheme) in others.into_iter().filter(|_| !context.real()) {
        let subject = Subject::built_in(name)?;
        theory.extend(young(&subject, scheme, &subject.system(scheme)?)?);
    }
    context.table(young_table(&theory))?;
    if let Some((subject, scheme)) = subjects.iter().find(|(subject, _)| subject.surface.len() <= SMALL) {
        over_omega(context, subject, *scheme)?;
    }
    if !context.real() {
        let table = tori()?;
        context.table(table)?;
    }
    Ok(())
}

fn methods(subject: &Subject, system: &LimitSystem, scheme: Scheme, orders: &[Order], quick: bool) -> Result<Vec<Row>> {
    let spectra = spectrum(system)?;
    let points = subject.surface.positions();
    let stop = Stop { tolerance: TOLERANCE * subject.surface.diagonal(), max_iterations: 10_000 };
    let in_order = |order: Order| order.order(subject.surface.mesh(), subject.surface.incidence());
    let vertices: Vec<Vec<u32>> = orders.iter().map(|&order| in_order(order)).collect();
    let coloured = in_order(Order::Multicolour);
    let mut jobs: Vec<(Method, String)> = Vec::new();
    if !quick {
        jobs.extend([(Method::Pia, String::new()), (Method::Jacobi { omega: None }, String::new())]);
    }
    for (name, order) in orders.iter().zip(&vertices) {
        let order = Some(&order[..]);
        jobs.push((Method::GaussSeidel { order }, name.to_string()));
        jobs.push((Method::Sor { omega: SOR_OMEGA, order }, name.to_string()));
    }
    if !quick {
        jobs.push((Method::Ssor { omega: 1.0, order: Some(&coloured) }, Order::Multicolour.to_string()));
    }
    let one = |(method, order): &(Method, String)| -> Result<Row> {
        let method = with_spectrum(system, *method, &|| Ok(spectra))?;
        // They take the longest: of SOR alone.
        let pseudospectra = !quick && system.len() <= SMALL && matches!(method, Method::Sor { .. });
        let wish = Wish { full: false, pseudospectra };
        let found = Found::new(system, method, order, wish)?;
        let iterations = solve(system, points, method, &stop).report.iterations;
        Ok(Row { mesh: subject.name.clone(), scheme, found, iterations })
    };
    jobs.par_iter().map(one).collect()
}

fn main_table(rows: &[Row]) -> Table {
    let keys = Columns::<Row>::new()
        .col(Column::key("mesh"), |r| r.mesh.clone())
        .col(Column::key("scheme"), |r| r.scheme.name());
    let mut table = columns(keys, |r| &r.found).col(Column::count("iterations"), |r| r.iterations).table(
        SPLITTINGS.id,
        SPLITTINGS.title,
        rows,
    );
    table.note(
        "T = I − N⁻¹A takes the error of an iterate to that of the next. `hump` is max ‖T^k‖/ρ^k in the energy norm ‖e‖² = eᵀMe, \
         `steps` the least k with ‖T^k‖ ≤ 10⁻⁶ there, `steps_by_rho` that with ρ^k ≤ 10⁻⁶; `iterations` those from V = P to 10⁻¹⁰ of the \
         diagonal. By T*T = T_SSOR the square of the energy norm of a sweep is the radius of SSOR.",
    );
    table.note(
        "Where `hump` is 1, T is normal in the energy norm, and the radius tells all: PIA and Jacobi. By colours it is small. A front \
         has the largest: its `steps` are those of its symbol (`splittings--tori`), not of its radius. On a torus the pseudospectra of \
         row by row and of breadth first are nearly the same for ε ≥ 10^-1.5, though their eigenvalues are not.",
    );
    table
}

/// The pictures of a mesh: eigenvalues, powers, and pseudospectra where they are small enough.
fn pictures(context: &mut Context, subject: &Subject, scheme: Scheme, rows: &[Row]) -> Result<()> {
    let stem = |what: &str| format!("{}--{}-{scheme}-{what}", SPLITTINGS.id, subject.name.replace([':', ' '], "-"));
    let caption = format!("{} under {scheme}", context.caption(subject));
    let all: Vec<&Found> = rows.iter().map(|row| &row.found).collect();
    let swept: Vec<&Found> = all.iter().copied().filter(|found| found.is_swept()).collect();
    context.figure(&stem("eigenvalues"), &plane(&caption, &all))?;
    if let Some(figure) = powers(&caption, &swept) {
        context.figure(&stem("powers"), &figure)?;
    }
    if let Some(figure) = pseudospectra(&caption, &swept) {
        context.figure(&stem("pseudospectra"), &figure)?;
    }
    Ok(())
}

/// A mesh, a scheme, an order of the sweeps, and what Young's theory says of these.
type Theory = (String, Scheme, Order, Young);

fn young(subject: &Subject, scheme: Scheme, system: &LimitSystem) -> Result<Vec<Theory>> {
    let one = |&order: &Order| {
        let vertices = order.order(subject.surface.mesh(), subject.surface.incidence());
        Ok((subject.name.clone(), scheme, order, Young::new(system, Some(&vertices))?))
    };
    ORDERS.par_iter().map(one).collect()
}

fn young_table(rows: &[Theory]) -> Table {
    let mut table = Columns::<Theory>::new()
        .col(Column::key("mesh"), |r| r.0.clone())
        .col(Column::key("scheme"), |r| r.1.name())
        .col(Column::key("order"), |r| r.2.to_string())
        .col(Column::text("consistent"), |r| if r.3.consistent { "yes" } else { "no" })
        .col(Column::number("rho_jacobi", 1e-5, 5), |r| r.3.jacobi)
        .col(Column::number("its_square", 1e-5, 5), |r| r.3.jacobi.powi(2))
        .col(Column::number("rho_gauss_seidel", 1e-4, 5), |r| r.3.gauss_seidel)
        .col(Column::number("omega_young", 1e-5, 5), |r| r.3.omega)
        .col(Column::number("rho_by_young", 1e-5, 5), |r| r.3.omega.map(|omega| omega - 1.0))
        .col(Column::number("rho_there", 1e-3, 5), |r| r.3.rho)
        .col(Column::number("omega_best", 5e-3, 4), |r| r.3.best.0)
        .col(Column::number("rho_best", 2e-3, 4), |r| r.3.best.1)
        .table(format!("{}--young", SPLITTINGS.id), "Young's theory of SOR, and what is so", rows);
    table.note(
        "Were the order consistent with A, ρ of Gauss-Seidel would be ρ(J)² with J = I − D⁻¹A, the best ω 2/(1 + √(1 − ρ(J)²)), and ρ = ω − \
         1 there. Faces couple their corners in rings of odd length, and edges go round a torus of 11 rows in such, so that no \
         order is; where ρ(J) ≥ 1 the formula has no value. \
         ρ(J)² overstates the radius of Gauss-Seidel, and where there is one, the best ω is nearer to 1.",
    );
    table
}

/// The eigenvalues of SOR over ω on one mesh.
fn over_omega(context: &mut Context, subject: &Subject, scheme: Scheme) -> Result<()> {
    let system = subject.system(scheme)?;
    let omegas: Vec<f64> = (1..20).map(|k| f64::from(k) / 10.0).collect();
    let mut all = Vec::new();
    let vertices = Order::Multicolour.order(subject.surface.mesh(), subject.surface.incidence());
    for order in [None, Some(&vertices[..])] {
        let method = Method::Sor { omega: 1.0, order };
        let name = if order.is_some() { "sor, multicolour" } else { "sor, file" };
        all.push(Followed::new(name, method, Trajectories::new(&system, method, &omegas)?));
    }
    let caption = format!("{} under {scheme}", context.caption(subject));
    let table = trajectories::table(format!("{}--over-omega", SPLITTINGS.id), &caption, &all);
    context.figure(&table.id, &trajectories::figure(&caption, &all))?;
    context.table(table)
}

/// A sweep on a regular torus.
struct OnTorus {
    scheme: Scheme,
    method: &'static str,
    omega: f64,
    order: &'static str,
    rho: f64,
    closed: f64,
    rate: Option<f64>,
}

/// Powers after which the rate of a front is looked at: a wave has not crossed the torus.
const POWER: usize = 8;
const SIDE: usize = 18;

/// The closed forms beside dense matrices.
fn tori() -> Result<Table> {
    let mut rows = Vec::new();
    for scheme in [Scheme::CatmullClark, Scheme::Nasri, Scheme::ZhengCai, Scheme::Loop, Scheme::MidEdge] {
        let kind = if scheme.needs_triangles() { "tri-torus" } else { "torus" };
        let subject = Subject::built_in(&format!("{kind}:{SIDE}x{SIDE}"))?;
        let system = subject.system(scheme)?;
        let colouring = Colouring::usual(scheme);
        let colours = colouring.order([SIDE, SIDE]);
        let front = Order::Bfs.order(subject.surface.mesh(), subject.surface.incidence());
        for omega in [1.0, SOR_OMEGA] {
            let coloured = Some(&colours[..]);
            for (name, method) in [
                ("file", Method::Sor { omega, order: None }),
                ("bfs", Method::Sor { omega, order: Some(&front) }),
                ("colours", Method::Sor { omega, order: coloured }),
                ("colours", Method::Ssor { omega, order: coloured }),
            ] {
                let t = IterationMatrix::new(&system, method)?;
                let rho = t.eigenvalues()?.first().map_or(0.0, |z| z.norm());
                let closed = match name {
                    "colours" => eigenvalues(scheme, [SIDE; 2], method, &colouring)?.first().map_or(0.0, |z| z.norm()),
                    _ => front_radius(scheme, omega, [8 * SIDE; 2]),
                };
                let power = t.powers(POWER, 0.0)?.last().and_then(|norms| norms[0]);
                let rate = power.map(|norm| norm.powf(1.0 / POWER as f64));
                rows.push(OnTorus { scheme, method: method.name(), omega, order: name, rho, closed, rate });
            }
        }
    }
    let mut table = Columns::<OnTorus>::new()
        .col(Column::key("scheme"), |r| r.scheme.name())
        .col(Column::key("method"), |r| r.method)
        .col(Column::key("omega"), |r| short(r.omega))
        .col(Column::key("order"), |r| r.order)
        .col(Column::number("rho", 1e-4, 5), |r| r.rho)
        .col(Column::number("symbol", 1e-5, 5), |r| r.closed)
        .col(Column::number("rate", 1e-4, 5), |r| r.rate)
        .table(format!("{}--tori", SPLITTINGS.id), "Sweeps on a regular torus, and their symbols", &rows);
    table.note(format!(
        "SOR and SSOR on the {SIDE} × {SIDE} torus, of triangles under Loop. `symbol` by colours is the largest modulus of an eigenvalue of the blocks, which \
         are all eigenvalues: `rho` to rounding. Of `file` (row by row) and `bfs` it is max |T̂| of a front on the plane; `rho` \
         lies below, but `rate`, ‖T^{POWER}‖^(1/{POWER}) in the energy norm, does not. Under mid-edge A is singular there: ρ = 1, and no energy \
         norm."
    ));
    Ok(table)
}
