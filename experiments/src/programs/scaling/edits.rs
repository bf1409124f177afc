//! Local updates against full solves, and the decay of the inverse that makes them local.

use std::time::Instant;

use crate::report::{Column, Columns, Table};
use glam::DVec3;
use limitlab::Result;
use limitlab::analysis::interval::interval;
use limitlab::analysis::symmetric::SymmetricForm;
use limitlab::assemble::Operator;
use limitlab::mesh::breadth_first::in_fronts;
use limitlab::mesh::{Mesh, Surface};
use limitlab::schemes::Scheme;
use limitlab::solvers::local_update::{Edit, Editor, decay};
use limitlab::solvers::{Stop, mixed};

/// Rings that the table of the decay shows.
const RINGS: usize = 20;

/// An edit and the same solved anew.
pub struct Row {
    scheme: Scheme,
    name: String,
    moved: usize,
    vertices: usize,
    edit: Edit,
    edit_seconds: f64,
    anew_seconds: f64,
    /// The largest between the two results.
    difference: f64,
    tolerance: f64,
}

/// The table of edits; the tolerance `tol` is relative.
pub fn edits_table(tol: f64, rows: &[Row]) -> Table {
    let columns = Columns::<Row>::new()
        .col(Column::key("scheme"), |r| r.scheme.name())
        .col(Column::key("mesh"), |r| r.name.clone())
        .col(Column::key("points_moved"), |r| r.moved.to_string())
        .col(Column::count("vertices"), |r| r.vertices)
        .col(Column::number("vertices_touched", 0.05, 6), |r| r.edit.touched as f64)
        .col(Column::number("relaxations", 0.05, 6), |r| r.edit.relaxations as f64)
        .col(Column::text("way"), |r| if r.edit.anew { "anew" } else { "local" })
        .col(Column::time("edit_seconds"), |r| r.edit_seconds)
        .col(Column::time("anew_seconds"), |r| r.anew_seconds)
        .col(Column::time("anew_over_edit"), |r| r.anew_seconds / r.edit_seconds)
        .col(Column::number("difference_over_tolerance", 0.5, 3), |r| r.difference / r.tolerance);
    let mut table = columns.table("scaling-edits", "Local edits beside solving anew", rows);
    table.note(format!(
        "Points far apart are moved by a hundredth of the bounding box's diagonal L, and control points relaxed around \
         them until no residual is above {tol:e}·L, or all solved anew where the first relaxations tell that this takes \
         less. Anew: mixed precision on the same operator from V = P. The difference is the largest between the two \
         results."
    ));
    table
}

/// Edits of one mesh, for 1, 10, 100, … points, up to a tenth of all.
pub fn edits(name: &str, mesh: Mesh, scheme: Scheme, tol: f64, rows: &mut Vec<Row>) -> Result<Operator> {
    let surface = Surface::new(mesh)?;
    let n = surface.len();
    let fronts = in_fronts(surface.faces(), surface.incidence());
    let operator = Operator::in_order(&surface, scheme, Some(&fronts))?;
    let points = fronts.there(surface.positions());
    let length = surface.diagonal();
    let stop = Stop { tolerance: tol * length, max_iterations: 10_000 };
    let (control, _) = mixed::solve(&operator, &points, &stop);
    let mut editor = Editor::new(&operator, points, control);
    for count in (0..).map(|k| 10usize.pow(k)).take_while(|c| 10 * c <= n) {
        let shift = DVec3::new(0.01, 0.0, 0.0) * length;
        let moves: Vec<(u32, DVec3)> =
            (0..count).map(|k| (2 * k + 1) * n / (2 * count)).map(|v| (v as u32, editor.points()[v] + shift)).collect();
        let start = Instant::now();
        let edit = editor.edit(&moves, stop.tolerance, usize::MAX);
        let edit_seconds = start.elapsed().as_secs_f64();
        let start = Instant::now();
        let (anew, _) = mixed::solve(&operator, editor.points(), &stop);
        let anew_seconds = start.elapsed().as_secs_f64();
        let pairs = editor.control().iter().zip(&anew);
        let difference = pairs.map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
        rows.push(Row {
            scheme,
            name: name.to_owned(),
            moved: count,
            vertices: n,
            edit,
            edit_seconds,
            anew_seconds,
            difference,
            tolerance: stop.tolerance,
        });
    }
    Ok(operator)
}

/// The largest entry of a column of the inverse on a ring of neighbours, and what bounds it: `factor`·`rate`^`ring`.
struct Ring<'a> {
    name: &'a str,
    ring: usize,
    entry: f64,
    /// The entry of the ring before.
    before: Option<f64>,
    factor: f64,
    rate: f64,
}

/// The largest entry of the middle column of A⁻¹ ring by ring, each with its ratio to the one before.
pub fn decay_table(operators: &[(String, Operator)]) -> Result<Table> {
    let columns = Columns::<Ring>::new()
        .col(Column::key("mesh"), |r| r.name)
        .col(Column::key("ring"), |r| r.ring.to_string())
        .col(Column::number("largest_entry", 0.01, 4), |r| r.entry)
        .col(Column::number("ratio", 0.01, 4), |r| r.before.map(|before| r.entry / before))
        // At the vertex itself ‖A⁻¹‖ is all that is known.
        .col(Column::number("bound", 0.05, 4), |r| r.before.map(|_| r.factor * r.rate.powi(r.ring as i32)));
    let mut rows = Vec::new();
    for (name, operator) in operators {
        let vertex = operator.len() / 2;
        let rings = decay(operator, vertex, 1e-12);
        let proven = operator.bounds().lambda_min;
        let least = if proven > 0.0 { proven } else { interval(operator, SymmetricForm::A)?.low };
        let root = (1.0 / least).sqrt();
        let h = operator.weights();
        let greatest = h.iter().copied().fold(0.0, f64::max);
        let factor = (greatest / h[vertex]).sqrt() * 0.5 * (1.0 + root).powi(2);
        let rate = (root - 1.0) / (root + 1.0);
        for (ring, &entry) in rings.iter().enumerate().take(RINGS) {
            let before = ring.checked_sub(1).map(|before| rings[before]);
            rows.push(Ring { name, ring, entry, before, factor, rate });
        }
    }
    let mut table = columns.table("scaling-decay", "Decay of the inverse of A from ring to ring", &rows);
    table.note(
        "Largest entry of one column of A⁻¹ among the vertices of each ring of neighbours. On an infinite regular quad \
         grid it is 3·(2 − √3)^ring under Catmull-Clark: ratio 0.2679. The bound (Demko, Moss and Smith 1984) is \
         √(h_max/h_j)·(1+√κ)²/2·((√κ−1)/(√κ+1))^ring with κ = 1/λ_min: λ_min as proven by valences where that is \
         positive, else as estimated.",
    );
    Ok(table)
}
