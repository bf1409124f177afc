//! Lin-Luo §5: how far the unified √3 surface shrinks or bulges over α, the "popping effect".

use limitlab::Result;
use limitlab::interpolate::lin_luo::surface::popping;
use limitlab_experiments::report::{Column, Figure, LinePlot, Rule, Series, Table};

use crate::context::{Context, Item};
use crate::corpus;

pub const POPPING: Item =
    Item { id: "popping", title: "Lin-Luo §5: how far the unified √3 surface shrinks or bulges over α", run };

/// α in eighths, up to 2.
const EIGHTHS: std::ops::RangeInclusive<usize> = 0..=16;
/// Steps: the volume is then within about 3⁻⁵ of the limit's change.
const LEVELS: usize = 5;

fn run(context: &mut Context) -> Result<()> {
    let mut table = Table::new(
        POPPING.id,
        POPPING.title,
        vec![
            Column::key("mesh"),
            Column::key("alpha"),
            Column::number("volume_ratio", 1e-6, 5),
            Column::number("vertex_mean", 1e-6, 3).floor(1e-9),
            Column::number("vertex_max", 1e-6, 3).floor(1e-9),
            Column::number("center_mean", 1e-6, 3).floor(1e-9),
            Column::number("center_max", 1e-6, 3).floor(1e-9),
            Column::number("center_outward", 1e-6, 3).floor(1e-9),
        ],
    );
    table.note(format!(
        "The same α at all vertices: 0 is Kobbelt's approximating scheme, 1 the interpolating one. `volume_ratio` is \
         the volume after {LEVELS} steps over that of the mesh. Distances are those of the vertices, and of the \
         triangles' centres, from where they were, over the diagonal of the bounding box; `center_outward` is signed \
         along the normals. The jump that a viewer sees between mesh and surface is least where the ratio passes 1."
    ));
    let mut subjects = context.list(&corpus::POPPING)?;
    if context.quick {
        subjects.truncate(1);
    }
    let mut series = Vec::new();
    for (subject, ()) in &subjects {
        let mut curve = Vec::new();
        for eighths in EIGHTHS {
            let alpha = eighths as f64 / 8.0;
            let found = popping(&subject.surface, &vec![alpha; subject.surface.len()], LEVELS)?;
            curve.push((alpha, found.volume_ratio));
            table.push(vec![
                subject.name.as_str().into(),
                alpha.to_string().into(),
                found.volume_ratio.into(),
                found.vertex_mean.into(),
                found.vertex_max.into(),
                found.center_mean.into(),
                found.center_max.into(),
                found.center_outward.into(),
            ]);
        }
        series.push(Series::line(subject.name.as_str(), curve));
    }
    context.table(table)?;
    if context.quick {
        return Ok(());
    }
    context.figure(
        POPPING.id,
        &Figure::new(LinePlot {
            title: "Volume of the surface over that of the mesh".into(),
            x_label: "α".into(),
            y_label: "volume ratio".into(),
            horizontal_lines: vec![Rule::new(1.0, "the mesh's own")],
            series,
            ..LinePlot::default()
        }),
    )
}
