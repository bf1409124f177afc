//! Ripples of interpolating surfaces: fairness energy by iteration, against the fairest surface (Halstead, Kass & DeRose).

use crate::report::{Column, Columns, Figure, LinePlot, Scale, Series};
use crate::studies::style;
use limitlab::Result;
use limitlab::interpolate::halstead::{Fairness, FairnessRow, Weights, fit, follow};
use limitlab::interpolate::zheng_cai::Constraints;
use limitlab::schemes::Scheme;
use limitlab::schemes::catmull_clark::limit_normals;
use limitlab::solvers::{Method, Stop};

use crate::programs::reproduce::context::{Context, Item, Question};
use crate::programs::reproduce::corpus;

pub const RIPPLES: Item = Item {
    id: "ripples",
    title: "Interpolation error, fairness energy and normals per iteration, against the fairest surface",
    question: Some(Question {
        asks: "Do more iterations make a fairer surface?",
        answer: "No. The error falls, but the normals of PIA are nearest to those of the fairest surface after few \
                 iterations; stopping there has the price of the error shown.",
    }),
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
/// The least error in the picture, relative to the diagonal: below it nothing changes.
const SMALLEST_SHOWN: f64 = 1e-4;

fn run(context: &mut Context) -> Result<()> {
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
    let mut runs = Vec::new();
    for (name, method) in METHODS {
        runs.push((name, method, follow(&subject.surface, &system, &fairness, &normals, method, &stop)?.0));
    }
    let shown = runs.iter().flat_map(|(name, _, rows)| {
        let last = rows.len().saturating_sub(1);
        let rows = rows.iter().filter(move |row| SHOWN.contains(&row.iteration) || row.iteration == last);
        rows.map(move |row| (*name, row))
    });
    let error = |row: &FairnessRow| row.errors.max / size;
    let thin_plate = |row: &FairnessRow| row.energies.thin_plate / fairest.energies.thin_plate;
    let deviation = |row: &FairnessRow| row.deviation_mean.to_degrees();
    let mut table = Columns::<(&str, &FairnessRow)>::new()
        .col(Column::key("mesh"), |_| subject.name.clone())
        .col(Column::key("method"), |(name, _)| *name)
        .col(Column::key("iteration"), |(_, row)| row.iteration.to_string())
        .col(Column::number("max_error", 1e-4, 3).floor(1e-9), |(_, row)| error(row))
        .col(Column::number("thin_plate_ratio", 1e-4, 4), |(_, row)| thin_plate(row))
        .col(Column::number("membrane_ratio", 1e-4, 4), |(_, row)| row.energies.membrane / fairest.energies.membrane)
        .col(Column::number("normal_deviation_mean_degrees", 1e-3, 4), |(_, row)| deviation(row))
        .col(Column::number("normal_deviation_max_degrees", 1e-3, 4), |(_, row)| row.deviation_max.to_degrees())
        .table(RIPPLES.id, RIPPLES.title, &shown.collect::<Vec<_>>());
    table.note(
        "Catmull-Clark. The reference is the fairest surface that meets the points (least thin-plate plus membrane \
         energy, control mesh two refinements down): energies are ratios to its own, normals are compared with its \
         normals at the points. `max_error` is relative to the diagonal of the bounding box. The last row of a method is \
         the converged surface: where the deviation passes through a minimum before, stopping early gives a smoother \
         surface at the price of the error shown.",
    );
    context.table(table)?;
    let starts = runs.iter().filter_map(|(_, _, rows)| rows.first()).map(error);
    let largest = starts.fold(SMALLEST_SHOWN, f64::max);
    let panel = |y_label: &str, names: bool, value: &dyn Fn(&FairnessRow) -> f64| LinePlot {
        x_label: "largest distance from the points / L: iterations go to the left".into(),
        y_label: y_label.into(),
        x_scale: Scale::Log,
        x_range: Some((SMALLEST_SHOWN, 1.5 * largest)),
        y_range: Some((0.0, 1.05 * runs.iter().flat_map(|(.., rows)| rows).map(value).fold(1.0, f64::max))),
        arrows: if names { "goes on, level".into() } else { String::new() },
        series: runs
            .iter()
            .map(|(name, method, rows)| {
                let name = if names { *name } else { "" };
                Series::line(name, rows.iter().map(|row| (error(row), value(row)))).style(style::of(*method, ""))
            })
            .collect(),
        ..LinePlot::default()
    };
    context.figure(
        RIPPLES.id,
        &Figure::stack([
            panel("bending energy (fairest: 1)", true, &thin_plate),
            panel("normals off the fairest (°)", false, &deviation),
        ])
        .title(format!("{}: ripples against accuracy, beside the fairest surface", context.caption(&subject))),
    )
}
