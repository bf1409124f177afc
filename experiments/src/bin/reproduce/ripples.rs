//! How much interpolating surfaces ripple, iteration by iteration, against the fairest one (Halstead, Kass & DeRose).

use limitlab::Result;
use limitlab::interpolate::halstead::{Fairness, Weights, fit, follow};
use limitlab::interpolate::zheng_cai::Constraints;
use limitlab::schemes::Scheme;
use limitlab::schemes::catmull_clark::limit_normals;
use limitlab::solvers::{Method, Stop};
use limitlab_experiments::report::{Column, Figure, LinePlot, Scale, Series, Table};

use crate::context::{Context, Item};
use crate::corpus;

pub const RIPPLES: Item = Item {
    id: "ripples",
    title: "Interpolation error, fairness energy and normals per iteration, against the fairest surface",
    run,
};

const METHODS: [(&str, Method); 4] = [
    ("pia", Method::Pia),
    ("thall", Method::Thall),
    ("gauss-seidel", Method::GaussSeidel { order: None }),
    ("cg", Method::Cg),
];
/// Iterates with a row, besides the last.
const SHOWN: [usize; 8] = [0, 1, 2, 3, 5, 10, 20, 50];
/// Relative to the diagonal of the bounding box.
const TOLERANCE: f64 = 1e-8;

fn run(context: &mut Context) -> Result<()> {
    let mut table = Table::new(
        RIPPLES.id,
        RIPPLES.title,
        vec![
            Column::key("mesh"),
            Column::key("method"),
            Column::key("iteration"),
            Column::number("max_error", 1e-4, 3).floor(1e-9),
            Column::number("thin_plate_ratio", 1e-4, 4),
            Column::number("membrane_ratio", 1e-4, 4),
            Column::number("normal_deviation_mean_degrees", 1e-3, 4),
            Column::number("normal_deviation_max_degrees", 1e-3, 4),
        ],
    );
    table.note(
        "Catmull-Clark. The reference is the fairest surface that meets the points (least thin-plate plus membrane \
         energy, control mesh two refinements down): energies are ratios to its own, normals are compared with its \
         normals at the points. `max_error` is relative to the diagonal of the bounding box. The last row of a method is \
         the converged surface: where the deviation passes through a minimum before, stopping early gives a smoother \
         surface at the price of the error shown.",
    );
    let subject = context.subject(&corpus::BOB)?;
    if context.quick {
        return Ok(());
    }
    let system = subject.system(Scheme::CatmullClark)?;
    let fairness = Fairness::new(&subject.surface)?;
    let all = Constraints::default();
    let fairest = fit(&fairness, subject.surface.positions(), &all, Weights::default())?;
    let mut normals = limit_normals(&fairest.surface)?;
    normals.truncate(subject.surface.len());
    let size = subject.surface.diagonal();
    let stop = Stop { tolerance: TOLERANCE * size, max_iterations: 1000 };
    let (mut energies, mut deviations) = (Vec::new(), Vec::new());
    for (name, method) in METHODS {
        let (rows, _) = follow(&subject.surface, &system, &fairness, &normals, method, &stop)?;
        let last = rows.len().saturating_sub(1);
        for row in &rows {
            if !SHOWN.contains(&row.iteration) && row.iteration != last {
                continue;
            }
            table.push(vec![
                subject.name.as_str().into(),
                name.into(),
                row.iteration.to_string().into(),
                (row.errors.max / size).into(),
                (row.energies.thin_plate / fairest.energies.thin_plate).into(),
                (row.energies.membrane / fairest.energies.membrane).into(),
                row.deviation_mean.to_degrees().into(),
                row.deviation_max.to_degrees().into(),
            ]);
        }
        let curve = |value: &dyn Fn(&limitlab::interpolate::halstead::Row) -> f64| {
            Series::line(name, rows.iter().map(|row| (row.errors.max / size, value(row))).collect::<Vec<_>>())
        };
        energies.push(curve(&|row| row.energies.thin_plate / fairest.energies.thin_plate));
        deviations.push(curve(&|row| row.deviation_mean.to_degrees()));
    }
    context.table(table)?;
    let panel = |y_label: &str, series| LinePlot {
        x_label: "max error / L (iterations go to the left)".into(),
        y_label: y_label.into(),
        x_scale: Scale::Log,
        series,
        ..LinePlot::default()
    };
    context.figure(
        RIPPLES.id,
        &Figure::stack([panel("thin plate / fairest", energies), panel("mean deviation (°)", deviations)])
            .title(format!("{}: ripples against accuracy", subject.name)),
    )
}
