//! Popping effect (Lin-Luo §5): shrinking and bulging of the unified √3 surface over α.

use crate::report::series::marker;
use crate::report::{Column, Columns, Figure, LinePlot, Rule, Series};
use limitlab::Result;
use limitlab::interpolate::lin_luo::surface::{Popping, popping};

use crate::programs::reproduce::context::{Context, Item, Question, Subject};
use crate::programs::reproduce::corpus;

pub const POPPING: Item = Item {
    id: "popping",
    title: "Lin-Luo §5: how far the unified √3 surface shrinks or bulges over α",
    question: Some(Question {
        asks: "How far does Lin and Luo's surface shrink or bulge over α?",
        answer: "It shrinks at α = 0, bulges at α = 1 and beyond, and keeps the volume at an α in between (L6).",
    }),
    run,
};

/// α in eighths, up to 2.
const EIGHTHS: std::ops::RangeInclusive<usize> = 0..=16;
/// Steps: the volume is then within about 3⁻⁵ of the limit's change.
const LEVELS: usize = 5;

fn run(context: &mut Context) -> Result<()> {
    let mut subjects = context.list(&corpus::POPPING)?;
    if context.quick {
        subjects.truncate(1);
    }
    let mut runs = Vec::new();
    for (subject, ()) in &subjects {
        for alpha in EIGHTHS.map(|eighths| eighths as f64 / 8.0) {
            runs.push((subject, alpha, popping(&subject.surface, &vec![alpha; subject.surface.len()], LEVELS)?));
        }
    }
    let mut table = Columns::<(&Subject, f64, Popping)>::new()
        .col(Column::key("mesh"), |(subject, ..)| subject.name.clone())
        .col(Column::key("alpha"), |(_, alpha, _)| alpha.to_string())
        .col(Column::number("volume_ratio", 1e-6, 5), |(.., found)| found.volume_ratio)
        .col(Column::number("vertex_mean", 1e-6, 3).floor(1e-9), |(.., found)| found.vertex_mean)
        .col(Column::number("vertex_max", 1e-6, 3).floor(1e-9), |(.., found)| found.vertex_max)
        .col(Column::number("center_mean", 1e-6, 3).floor(1e-9), |(.., found)| found.center_mean)
        .col(Column::number("center_max", 1e-6, 3).floor(1e-9), |(.., found)| found.center_max)
        .col(Column::number("center_outward", 1e-6, 3).floor(1e-9), |(.., found)| found.center_outward)
        .table(POPPING.id, POPPING.title, &runs);
    table.note(format!(
        "The same α at all vertices: 0 is Kobbelt's approximating scheme, 1 the interpolating one. `volume_ratio` is \
         the volume after {LEVELS} steps over that of the mesh. Distances are those of the vertices, and of the \
         triangles' centres, from where they were, over the diagonal of the bounding box; `center_outward` is signed \
         along the normals. The jump that a viewer sees between mesh and surface is least where the ratio passes 1."
    ));
    context.table(table)?;
    if context.quick {
        return Ok(());
    }
    let curves = runs.chunk_by(|(a, ..), (b, ..)| a.name == b.name);
    let series = curves
        .enumerate()
        .map(|(k, runs)| {
            let ratios = runs.iter().map(|(_, alpha, found)| (*alpha, found.volume_ratio));
            Series::line(context.caption(runs[0].0), ratios).marker(marker(k))
        })
        .collect();
    context.figure(
        POPPING.id,
        &Figure::new(LinePlot {
            title: "Unified √3 scheme: volume of the surface over that of the mesh".into(),
            x_label: "α (0 approximates, 1 interpolates)".into(),
            y_label: "volume ratio".into(),
            x_range: Some((0.0, 2.0)),
            horizontal_lines: vec![Rule::new(1.0, "the mesh's own")],
            series,
            ..LinePlot::default()
        }),
    )
}
