//! Iterations, measured rate and predicted ρ over ω: `sweep-omega [MESH…]`.

use std::process::ExitCode;

use clap::Parser;
use serde_json::{Map, Value, json};

use limitlab::Result;
use limitlab::analysis::sweep::{Sweep, rounding_floor, sweep};
use limitlab::cli::{
    self, CommonFlags, Grid, Input, List, MeshFlags, OutputFlags, Progress, StopFlags, number,
};
use limitlab::error::Error;
use limitlab::mesh::order::Order;
use limitlab::report::{Column, Figure, LinePlot, Marker, Rule, Scale, Series, Table};
use limitlab::solvers::Method;

/// Sweeps the damping ω of Jacobi, PIA and SOR: iterations to the tolerance and the measured rate, with the
/// predicted spectral radius ρ(ω), the critical and the optimal ω beside them.
#[derive(Parser)]
#[command(name = "sweep-omega", version)]
struct Arguments {
    /// Mesh files (.obj, .off, .ply) or built-in names; unless told, four built-in ones with --noise 0.1
    #[arg(value_name = "MESH")]
    meshes: Vec<String>,
    /// Methods to sweep: jacobi, pia, sor
    #[arg(long, value_name = "NAME,…", default_value = "jacobi,pia,sor")]
    method: List<Method>,
    /// Values of ω from A to B, both included; unless told, 0.05 to the first value beyond each method's threshold
    #[arg(long, value_name = "A:B:STEP")]
    omega: Option<Grid>,
    /// Vertex order of SOR: file, reverse, bfs, rcm, morton, valence, multicolour or random[:SEED]
    #[arg(long, value_name = "NAME", default_value_t = Order::File)]
    order: Order,
    #[command(flatten)]
    mesh: MeshFlags,
    #[command(flatten)]
    stop: StopFlags,
    #[command(flatten)]
    output: OutputFlags,
    #[command(flatten)]
    common: CommonFlags,
}

/// What `sweep-omega` runs on without arguments.
const BUILT_IN: [&str; 4] = [
    "torus:32x32",
    "quad-sphere:4",
    "icosphere:3",
    "irregular-quad:1000",
];
/// The default grids: beyond 2/λ_max(D⁻¹A) on regular quads, and over all of (0, 2] for the others.
const JACOBI_GRID: &str = "0.05:1.2:0.05";
const WIDE_GRID: &str = "0.05:2:0.05";

fn main() -> ExitCode {
    let mut arguments = Arguments::parse();
    cli::exit(|| {
        arguments.common.apply()?;
        for method in &arguments.method.0 {
            if !matches!(method, Method::Jacobi | Method::Pia | Method::Sor) {
                return Err(Error::Unknown(format!(
                    "{method} has no ω to sweep; choose among jacobi, pia and sor"
                )));
            }
        }
        if arguments.meshes.is_empty() {
            arguments.meshes = BUILT_IN.map(String::from).to_vec();
            arguments.mesh.default_noise();
        }
        arguments.output.prepare()?;
        run(&arguments)
    })
}

fn run(arguments: &Arguments) -> Result<()> {
    let mut results = Vec::new();
    for name in &arguments.meshes {
        let Some(input) = arguments.mesh.input(name, &arguments.common)? else {
            continue;
        };
        let sweep = sweep_one(&input, arguments)?;
        let table = table(&input, arguments, &sweep);
        table.write(&arguments.output.out)?;
        plot(&input, arguments, &sweep).render()?.save(
            &arguments
                .output
                .out
                .join(format!("{}.png", input.stem("sweep-omega"))),
        )?;
        if !arguments.output.json {
            cli::print(&table.to_markdown())?;
        }
        results.push(json(&input, arguments, &sweep));
    }
    cli::finish(results, &arguments.output, &arguments.common)
}

fn grid(arguments: &Arguments, method: Method) -> Vec<f64> {
    if let Some(grid) = &arguments.omega {
        return grid.0.clone();
    }
    let text = if method == Method::Jacobi {
        JACOBI_GRID
    } else {
        WIDE_GRID
    };
    text.parse::<Grid>().map(|g| g.0).unwrap_or_default()
}

fn sweep_one(input: &Input, arguments: &Arguments) -> Result<Sweep> {
    let system = input.system()?;
    let order = arguments
        .order
        .order(&input.mesh, &input.topology.incidence);
    let grids: Vec<(Method, Vec<f64>)> = arguments
        .method
        .0
        .iter()
        .map(|&m| (m, grid(arguments, m)))
        .collect();
    let runs = grids.iter().map(|(_, g)| g.len()).sum();
    let progress = Progress::new(&input.name, runs, arguments.common.quiet);
    sweep(
        &system,
        &input.mesh.positions,
        &grids,
        Some(&order),
        &arguments.stop.stop(&input.mesh),
        rounding_floor(input.mesh.diagonal()),
        &|| progress.step(),
    )
}

fn table(input: &Input, arguments: &Arguments, sweep: &Sweep) -> Table {
    let mut table = Table::new(
        input.stem("sweep-omega"),
        format!("ω sweep on {} under {}", input.label, input.scheme),
        vec![
            Column::key("method"),
            Column::key("omega"),
            Column::text("status"),
            Column::count("iterations"),
            Column::number("predicted_rho", 1e-6, 4),
            Column::number("predicted_rho_data", 1e-4, 4),
            Column::number("observed_rate", 1e-2, 4),
            Column::number("max_error", 1e-3, 3),
        ],
    );
    table.note(format!(
        "{} vertices, {} faces; start V = P; stop at max_i ‖p_i − (A v)_i‖ ≤ {:e} (mesh units). `predicted_rho` is \
         the spectral radius of the error matrix, `predicted_rho_data` the same over the eigenvectors that the data \
         excite, `observed_rate` the factor per iteration fitted to the tail of the history.",
        input.mesh.len(),
        input.mesh.faces.len(),
        arguments.stop.stop(&input.mesh).tolerance
    ));
    for t in &sweep.thresholds {
        let mut text = format!(
            "{}: eigenvalues in [{:.6}, {:.6}], ω_crit = {:.6}, ω_opt = {:.6} with ρ = {:.6}",
            t.method,
            t.matrix.min,
            t.matrix.max,
            t.matrix.critical_omega(),
            t.matrix.optimal_omega(),
            t.matrix.radius(t.matrix.optimal_omega())
        );
        if let Some(data) = t.data {
            text += &format!(
                "; the data excite [{:.6}, {:.6}], so ω_crit = {:.6} for this run",
                data.min,
                data.max,
                data.critical_omega()
            );
        }
        if let Some(best) = sweep.best(t.method) {
            text += &format!(
                "; best on the grid: ω = {} with {} iterations",
                best.omega, best.iterations
            );
        }
        table.note(text + ".");
    }
    for row in &sweep.rows {
        table.push(vec![
            row.method.name().into(),
            row.omega.to_string().into(),
            row.outcome.name().into(),
            row.iterations.into(),
            row.predicted_rho.into(),
            row.predicted_rho_data.into(),
            row.observed_rate.into(),
            row.errors.max.into(),
        ]);
    }
    table
}

fn plot(input: &Input, arguments: &Arguments, sweep: &Sweep) -> Figure {
    let mut iterations = LinePlot {
        title: format!("{} under {}", input.label, input.scheme),
        x_label: "ω".into(),
        y_label: "iterations to converge".into(),
        y_scale: Scale::Log,
        ..LinePlot::default()
    };
    let mut rates = LinePlot {
        x_label: "ω".into(),
        y_label: "factor per iteration".into(),
        y_range: Some((0.0, 1.5)),
        horizontal_lines: vec![Rule::new(1.0, "")],
        ..LinePlot::default()
    };
    for (k, &method) in arguments.method.0.iter().enumerate() {
        let colour = limitlab::report::palette(k);
        let rows = || sweep.rows.iter().filter(move |r| r.method == method);
        let converged = limitlab::solvers::Outcome::Converged;
        iterations.series.push(
            Series::line(
                method.name(),
                rows()
                    .filter(|r| r.outcome == converged)
                    .map(|r| (r.omega, r.iterations as f64)),
            )
            .marker(Marker::Circle)
            .colour(colour),
        );
        rates.series.push(
            Series::line(
                format!("{method}: predicted ρ(ω)"),
                rows().map(|r| (r.omega, r.predicted_rho)),
            )
            .colour(colour),
        );
        rates.series.push(
            Series::scatter(
                format!("{method}: measured"),
                rows().filter_map(|r| r.observed_rate.map(|rate| (r.omega, rate))),
            )
            .colour(colour),
        );
    }
    for t in &sweep.thresholds {
        if t.method == Method::Jacobi {
            for (at, label) in [
                (t.matrix.optimal_omega(), "Jacobi ω_opt"),
                (t.matrix.critical_omega(), "Jacobi ω_crit"),
            ] {
                iterations.vertical_lines.push(Rule::new(at, label));
                rates.vertical_lines.push(Rule::new(at, ""));
            }
        }
    }
    Figure::stack([iterations, rates])
}

fn json(input: &Input, arguments: &Arguments, sweep: &Sweep) -> Value {
    let rows: Vec<Value> = sweep
        .rows
        .iter()
        .map(|row| {
            json!({
                "method": row.method.name(),
                "omega": number(row.omega),
                "iterations": row.iterations,
                "status": row.outcome.name(),
                "predicted_rho": number(row.predicted_rho),
                "predicted_rho_data": row.predicted_rho_data.map(number),
                "observed_rate": row.observed_rate.map(number),
                "max_error": number(row.errors.max),
            })
        })
        .collect();
    let (mut best, mut critical, mut critical_data, mut optimal) =
        (Map::new(), Map::new(), Map::new(), Map::new());
    for &method in &arguments.method.0 {
        let omega = sweep.best(method).map_or(Value::Null, |r| number(r.omega));
        best.insert(method.name().into(), omega);
    }
    for t in &sweep.thresholds {
        let name = t.method.name();
        critical.insert(name.into(), number(t.matrix.critical_omega()));
        optimal.insert(name.into(), number(t.matrix.optimal_omega()));
        let data = t.data.map_or(Value::Null, |d| number(d.critical_omega()));
        critical_data.insert(name.into(), data);
    }
    input.json(json!({
        "rows": rows,
        "best": best,
        "optimal_omega": optimal,
        "critical_omega": critical,
        "critical_omega_data": critical_data,
    }))
}
