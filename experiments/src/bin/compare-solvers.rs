//! Every method on the same system, start, norm and tolerance: `compare-solvers [MESH…]`.

use std::process::ExitCode;

use clap::Parser;
use serde_json::{Value, json};

use limitlab::Result;
use limitlab::analysis::comparison::{self, Row};
use limitlab::analysis::spectrum::spectrum;
use limitlab::mesh::order::Order;
use limitlab::solvers::{Method, Stop};
use limitlab_experiments::cli::{self, CommonFlags, Input, List, MeshFlags, OutputFlags, Progress, StopFlags, number};
use limitlab_experiments::report::{Column, Figure, LinePlot, Scale, Series, Table};

/// Runs every method on the same system from the same start V = P, and prints iterations, errors, observed and
/// predicted rate, and the seconds of set-up and solve apart.
#[derive(Parser)]
#[command(name = "compare-solvers", version)]
struct Arguments {
    /// Mesh files (.obj, .off, .ply) or built-in names; torus:32x32 with --noise 0.1 unless told
    #[arg(value_name = "MESH")]
    meshes: Vec<String>,
    /// Methods, separated by commas; all unless told
    #[arg(long, value_name = "NAME,…")]
    method: Option<List<Method>>,
    /// Vertex order of in-place sweeps: file, reverse, bfs, rcm, morton, valence, multicolour, random or random:SEED
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

fn main() -> ExitCode {
    let mut arguments = Arguments::parse();
    cli::exit(|| {
        arguments.common.apply()?;
        arguments.mesh.or_built_in(&mut arguments.meshes, &["torus:32x32"]);
        run(&arguments)
    })
}

fn run(arguments: &Arguments) -> Result<()> {
    if arguments.mesh.print_defects(&arguments.meshes, &arguments.common)? {
        return Ok(());
    }
    arguments.output.prepare()?;
    let mut results = Vec::new();
    for name in &arguments.meshes {
        let input = arguments.mesh.input(name, &arguments.common)?;
        let stop = input.stop(&arguments.stop)?;
        let rows = compare(&input, arguments, &stop)?;
        let table = table(&input, stop.tolerance * input.frame.scale(), &rows);
        let stem = input.stem("compare-solvers");
        table.write(&arguments.output.out)?;
        plot(&input, &rows).render()?.save(&arguments.output.out.join(format!("{stem}.png")))?;
        if !arguments.output.json {
            cli::print(&table.to_markdown())?;
        }
        results.push(json(&input, &rows));
    }
    cli::finish(&results, &arguments.output, &arguments.common)
}

/// The rows, their errors in mesh units.
fn compare(input: &Input, arguments: &Arguments, stop: &Stop) -> Result<Vec<Row>> {
    let system = input.system()?;
    let order = arguments.order.order(&input.mesh, &input.topology().incidence);
    let methods = match &arguments.method {
        Some(list) => list.0.clone(),
        None => Method::ALL.to_vec(),
    };
    let spectrum = spectrum(&system)?;
    let lines = comparison::entries(&system, &spectrum, &methods, Some(&order), &arguments.order.to_string())?;
    let progress = Progress::new(&input.name, lines.len(), arguments.common.quiet);
    let mut rows = comparison::compare(
        &system,
        &spectrum,
        &input.mesh.positions,
        &lines,
        stop,
        input.mesh.diagonal(),
        &mut || progress.step(),
    )?;
    for errors in rows.iter_mut().flat_map(|row| &mut row.solution.report.history) {
        *errors = *errors * input.frame.scale();
    }
    Ok(rows)
}

fn table(input: &Input, tolerance: f64, rows: &[Row]) -> Table {
    let mut table = Table::new(
        input.stem("compare-solvers"),
        format!("All methods on {} under {}", input.label, input.scheme),
        vec![
            Column::key("method"),
            Column::key("parameter"),
            Column::text("status"),
            Column::count("iterations"),
            Column::number("max_error", 1e-6, 3),
            Column::number("mean_error", 1e-6, 3),
            Column::number("observed_rate", 1e-3, 4),
            Column::number("predicted_rate", 1e-6, 4),
            Column::count("fill"),
            Column::time("seconds_setup"),
            Column::time("seconds_solve"),
        ],
    );
    table.note(format!(
        "{} vertices, {} faces; start V = P; stop at max_i ‖p_i − (A v)_i‖ ≤ {tolerance:e} (mesh units). Rates are factors \
         per iteration; `fill` counts the stored entries of the factors, where the library tells.",
        input.mesh.len(),
        input.mesh.faces.len()
    ));
    for row in rows {
        let report = &row.solution.report;
        let last = report.last();
        table.push(vec![
            row.method.name().into(),
            row.parameter.as_str().into(),
            report.outcome.name().into(),
            report.iterations.into(),
            last.max.into(),
            last.mean.into(),
            row.observed_rate.into(),
            row.predicted_rate.into(),
            row.solution.fill.into(),
            row.solution.setup_seconds.into(),
            row.solution.solve_seconds.into(),
        ]);
        if let Some(detail) = &report.detail {
            table.note(format!("{} ({}): {detail}", row.method, row.parameter));
        }
    }
    table
}

fn plot(input: &Input, rows: &[Row]) -> Figure {
    let series = rows
        .iter()
        .filter(|row| !row.method.is_direct())
        .map(|row| {
            let name = format!("{} ({})", row.method, row.parameter);
            Series::history(name, row.solution.report.history.iter().map(|e| e.max))
        })
        .collect();
    Figure::new(LinePlot {
        title: format!("{} under {}", input.label, input.scheme),
        x_label: "iterations".into(),
        y_label: "max error (mesh units)".into(),
        y_scale: Scale::Log,
        series,
        ..LinePlot::default()
    })
}

fn json(input: &Input, rows: &[Row]) -> Value {
    let rows: Vec<Value> = rows
        .iter()
        .map(|row| {
            let report = &row.solution.report;
            let last = report.last();
            json!({
                "method": row.method.name(),
                "parameter": row.parameter,
                "iterations": report.iterations,
                "status": report.outcome.name(),
                "detail": report.detail,
                "max_error": number(last.max),
                "mean_error": number(last.mean),
                "observed_rate": row.observed_rate.map(number),
                "predicted_rate": row.predicted_rate.map(number),
                "fill": row.solution.fill,
                "seconds": {
                    "setup": number(row.solution.setup_seconds),
                    "solve": number(row.solution.solve_seconds),
                },
            })
        })
        .collect();
    input.json(json!({ "rows": rows }))
}
