//! Decay of the inverse of A along closed creases, away from them, and across them.

use crate::report::{Column, Columns};
use glam::DVec3;
use limitlab::Result;
use limitlab::assemble::Stages;
use limitlab::interpolate::staged;
use limitlab::mesh::features::{SHARP, Tags};
use limitlab::mesh::{Surface, builtin};
use limitlab::schemes::Scheme;
use limitlab::solvers::{Method, Stop};

use crate::programs::reproduce::context::{Context, Item, Question};

pub const DECAY: Item = Item {
    id: "open-decay",
    title: "Decay of the inverse along, away from and across closed creases",
    question: Some(Question {
        asks: "How far does it reach where a point moves beside a crease?",
        answer: "Along the crease its effect falls by a fixed factor a vertex, and away from it from column to column; \
                 a smooth point moves no crease and nothing beyond one.",
    }),
    run,
};

/// Rows and columns of the torus; the creases are its columns 0 and SIZE/2.
const SIZE: usize = 24;
/// Distances in the table.
const RINGS: usize = 9;

/// How far a scheme's control points move when one point moves by 1, at a distance.
struct Row {
    scheme: Scheme,
    distance: usize,
    /// The point lies on a crease: at its vertices, with their sign, and the most at the smooth ones.
    along: f64,
    along_ratio: Option<f64>,
    away: f64,
    away_ratio: Option<f64>,
    /// The point is a smooth one at this distance from the crease: the most on creases, and beyond them.
    on_creases: f64,
    beyond: f64,
}

/// The column of A⁻¹ of one vertex.
fn column(stages: &Stages, vertex: usize) -> Vec<f64> {
    let mut points = vec![DVec3::ZERO; stages.len()];
    points[vertex] = DVec3::X;
    let stop = Stop { tolerance: 1e-14, max_iterations: 3 };
    staged::run(stages, &points, Method::Cholesky, &stop).points.iter().map(|v| v.x).collect()
}

fn rows_of(scheme: Scheme) -> Result<Vec<Row>> {
    let name = if scheme.needs_triangles() { "tri-torus" } else { "torus" };
    let torus = Surface::new(builtin::builtin(&format!("{name}:{SIZE}x{SIZE}"))?)?;
    let at = |i: usize, j: usize| i % SIZE * SIZE + j % SIZE;
    let crease = |j: usize| (0..SIZE).map(move |i| ([at(i, j) as u32, at(i + 1, j) as u32], SHARP));
    let creases = crease(0).chain(crease(SIZE / 2)).collect();
    let surface = torus.into_tagged(&Tags { creases, ..Tags::default() })?;
    let stages = Stages::new(&surface, scheme, None)?;
    let most = |values: &[f64], columns: &mut dyn Iterator<Item = usize>| {
        let all = columns.flat_map(|j| (0..SIZE).map(move |i| at(i, j)));
        all.map(|v| values[v].abs()).fold(0.0, f64::max)
    };
    let from_crease = column(&stages, at(0, 0));
    let away = |k: usize| most(&from_crease, &mut [k, SIZE - k].into_iter());
    // The first of these is the ring next to the crease.
    let rows = (0..RINGS).map(|k| {
        let from_smooth = column(&stages, at(0, (k + 1).min(SIZE / 2 - 1)));
        Row {
            scheme,
            distance: k,
            along: from_crease[at(k, 0)],
            along_ratio: k.checked_sub(1).map(|before| from_crease[at(k, 0)] / from_crease[at(before, 0)]),
            away: away(k + 1),
            away_ratio: k.checked_sub(1).map(|before| away(k + 1) / away(before + 1)),
            on_creases: most(&from_smooth, &mut [0, SIZE / 2].into_iter()),
            beyond: most(&from_smooth, &mut (SIZE / 2 + 1..SIZE)),
        }
    });
    Ok(rows.collect())
}

/// All schemes, or two in a quick run.
fn run(context: &mut Context) -> Result<()> {
    // The same on any meshes.
    if context.real() {
        return Ok(());
    }
    let schemes = if context.quick { &Scheme::ALL[..2] } else { &Scheme::ALL[..] };
    let mut rows = Vec::new();
    for &scheme in schemes {
        rows.extend(rows_of(scheme)?);
    }
    let columns = Columns::<Row>::new()
        .col(Column::key("scheme"), |r| r.scheme.name())
        .col(Column::key("distance"), |r| r.distance.to_string())
        .col(Column::number("along", 1e-6, 4).floor(1e-12), |r| r.along)
        .col(Column::number("along_ratio", 1e-6, 6), |r| r.along_ratio)
        .col(Column::number("away", 1e-6, 4).floor(1e-12), |r| r.away)
        .col(Column::number("away_ratio", 1e-3, 4), |r| r.away_ratio)
        .col(Column::number("on_creases", 1e-12, 1), |r| r.on_creases)
        .col(Column::number("beyond", 1e-12, 1), |r| r.beyond);
    let mut table = columns.table(DECAY.id, DECAY.title, &rows);
    table.note(format!(
        "How far control points move where one point moves by 1, on a torus of {SIZE} × {SIZE} quads (triangles for Loop and √3) \
         with two closed creases, which divide it in two. `along`: the point lies on a crease; its vertices at this distance, \
         which is ρ^distance but for the factor of the point itself, ρ = −(2 − √3) = −0.267949 where curves have rows (1, 4, 1)/6, \
         −(3 − 2√2) = −0.171573 where they have (1, 6, 1)/8. `away`: the most at smooth vertices `distance` + 1 columns from the \
         crease, of the same point. `on_creases` and `beyond`: the point is a smooth one `distance` + 1 columns from a crease; \
         the most at vertices of creases, and on the other side of them: 0, exactly, as curves do not see smooth points, and the \
         two sides see each other through curves only.",
    ));
    context.table(table)
}
