//! All methods × all schemes × all meshes: iterations to 10⁻³, 10⁻⁶ and 10⁻¹⁰, and convergence plots.

use limitlab::Result;
use limitlab::analysis::comparison::entries;
use limitlab::analysis::spectrum::spectrum;
use limitlab::assemble::Scheme;
use limitlab::report::{Column, Figure, LinePlot, Scale, Series, Table};
use limitlab::solvers::{Method, Stop, run as solve};

use crate::context::{Context, Item, Subject};

pub const ALL: Item = Item {
    id: "all-methods",
    title: "Iterations of every method under every scheme on every mesh",
    run,
};

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
const PLOTTED: [&str; 4] = [
    "irregular-quad:1000",
    "irregular-tri:1000",
    "psb_m104_horse_233v",
    "spot_2930v_quad",
];
/// Relative to the diagonal of the bounding box.
const TOLERANCES: [f64; 3] = [1e-3, 1e-6, 1e-10];
const LIMIT: usize = 10_000;
/// Larger meshes are left to the `scaling` program.
const LARGEST: usize = 20_000;
/// Largest mesh of a quick run.
const QUICK: usize = 300;

fn run(context: &mut Context) -> Result<()> {
    let mut columns = vec![
        Column::key("mesh"),
        Column::key("scheme"),
        Column::key("method"),
        Column::key("variant"),
        Column::text("vertices"),
        Column::text("status"),
    ];
    for tolerance in TOLERANCES {
        columns.push(Column::count(format!("iterations_{tolerance:e}")));
    }
    columns.push(Column::number("final_error", 0.5, 3).floor(1e-10));
    let mut table = Table::new(ALL.id, ALL.title, columns);
    table.note(format!(
        "Start V = P, file order for in-place sweeps, at most {LIMIT} iterations; tolerances and `final_error` = \
         max_i ‖p_i − (A v)_i‖ relative to the diagonal of the bounding box. An empty cell: not reached. A direct \
         method makes one iteration: the solve. Meshes of at most {LARGEST} vertices."
    ));
    let most = if context.quick { QUICK } else { LARGEST };
    for subject in context.subjects(&STAND_INS, most)? {
        for scheme in Scheme::ALL {
            if subject.suits(scheme) {
                one(context, &subject, scheme, &mut table)?;
            }
        }
    }
    context.table(table)
}

fn one(context: &Context, subject: &Subject, scheme: Scheme, table: &mut Table) -> Result<()> {
    let system = subject.system(scheme)?;
    let spectrum = spectrum(&system)?;
    let size = subject.mesh.diagonal();
    let stop = Stop {
        tolerance: TOLERANCES[2] * size,
        max_iterations: LIMIT,
    };
    let mut series = Vec::new();
    for entry in entries(&system, &spectrum, &Method::ALL, None, "file")? {
        let report = solve(&system, &subject.mesh.positions, entry.setup, &stop).report;
        let errors: Vec<f64> = report.history.iter().map(|e| e.max / size).collect();
        let mut row = vec![
            subject.name.as_str().into(),
            scheme.name().into(),
            entry.method.name().into(),
            entry.variant.into(),
            subject.mesh.len().to_string().into(),
            report.outcome.name().into(),
        ];
        row.extend(TOLERANCES.map(|t| errors.iter().position(|&e| e <= t).into()));
        row.push(errors.last().copied().into());
        table.push(row);
        if !entry.method.is_direct() {
            let name = format!("{} ({})", entry.method, entry.parameter);
            series.push(Series::history(name, errors));
        }
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
