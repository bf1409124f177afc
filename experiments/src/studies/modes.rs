//! Slowest modes of a system: their eigenvalues as a table, and at the vertices as CSV, as a picture and as PLY.

use serde_json::{Value, json};

use super::pictures::{Framed, MOST_MAPS, Maps, peak};
use crate::cli::{OutputFlags, Subject, number};
use crate::report::{ColourScale, Column, Columns, Provenance, Table, readable};
use limitlab::Result;
use limitlab::analysis::singularity::{SlowMode, SlowModes};
use limitlab::analysis::subspace_iteration::Cluster;
use limitlab::mesh::Mesh;
use limitlab::mesh::ply::Scalars;

/// The participation of a mode that has a place on the mesh.
const LOCAL: f64 = 0.1;

/// An eigenvalue with its modes.
struct Line<'m> {
    /// Of the first one, from 1.
    first: usize,
    modes: &'m [SlowMode],
    /// Whether the multiplicity is that which `multiplicity` says, and no larger one.
    complete: bool,
    multiplicity: usize,
}

impl Line<'_> {
    fn multiplicity(&self) -> String {
        if self.complete { self.multiplicity.to_string() } else { format!("at least {}", self.multiplicity) }
    }
}

/// The distinct eigenvalues, each with those of its modes that were asked for.
fn lines(found: &SlowModes) -> Vec<Line<'_>> {
    let mut before = 0;
    let line = |cluster: &Cluster| {
        let first = before;
        before += cluster.multiplicity;
        Line {
            first: first + 1,
            modes: &found.modes[first..before.min(found.modes.len())],
            complete: cluster.complete,
            multiplicity: cluster.multiplicity,
        }
    };
    found.clusters.iter().map(line).collect()
}

/// One row an eigenvalue.
pub fn table(subject: &Subject, found: &SlowModes) -> Table {
    let columns = Columns::<Line>::new()
        .col(Column::key("modes"), |line| match line.modes.len() {
            1 => line.first.to_string(),
            several => format!("{}–{}", line.first, line.first + several - 1),
        })
        .col(Column::number("eigenvalue", 1e-7, 10), |line| line.modes[0].eigenvalue.value)
        .col(Column::text("multiplicity"), Line::multiplicity)
        .col(Column::number("residual", 1e3, 2).floor(1e-6), |line| {
            line.modes.iter().map(|mode| mode.eigenvalue.residual).fold(0.0, f64::max)
        })
        .col(Column::number("pia_rate", 1e-5, 6), |line| (1.0 - line.modes[0].eigenvalue.value).abs())
        .col(Column::count("largest_at"), |line| peak(&line.modes[0].values))
        .col(Column::number("participation", 1e-3, 3), |line| line.modes[0].participation);
    let title = format!("Slowest modes of {}", subject.title);
    let mut table = columns.table(subject.stem("spectrum-modes"), title, &lines(found));
    table.note(
        "The least eigenvalues of A, equal ones (to 1e-9, relative) in one row with their multiplicity. `pia_rate` is 1 − λ, the factor by \
         which PIA shrinks an error of this shape in an iteration. `largest_at` is the vertex where the first of these modes \
         is largest, `participation` 1 if it is spread evenly, 1/N if it is at a single vertex.",
    );
    if !found.converged {
        table.note(
            "**Not converged**: the residuals say how near an eigenvalue is; ask for more modes to part a cluster.",
        );
    }
    table
}

/// One row a vertex, after one with the eigenvalues.
fn vertex_table(found: &SlowModes, scalars: &[Scalars]) -> Table {
    let name = |s: &Scalars| Column::number(s.name.as_str(), 1e-3, 6).floor(1e-3);
    let columns = [Column::key("vertex")].into_iter().chain(scalars.iter().map(name)).collect();
    let mut table = Table::new("", "", columns);
    let values = found.modes.iter().map(|mode| mode.eigenvalue.value.into());
    table.push(["eigenvalue".into()].into_iter().chain(values).collect());
    for v in 0..scalars.first().map_or(0, |s| s.values.len()) {
        let values = scalars.iter().map(|s| s.values[v].into());
        table.push([v.into()].into_iter().chain(values).collect());
    }
    table
}

/// Writes the files: the table, `STEM-vertices.csv`, and on a mesh `STEM.ply` and a picture.
///
/// # Errors
/// If a file cannot be written.
pub fn write(
    table: &Table,
    subject: &Subject,
    found: &SlowModes,
    mesh: Option<&Mesh>,
    output: &OutputFlags,
    made: &Provenance,
) -> Result<()> {
    table.write(&output.out, made)?;
    let scalars: Vec<Scalars> = (1..)
        .zip(&found.modes)
        .map(|(k, mode)| Scalars { name: format!("mode_{k}"), values: mode.values.clone() })
        .collect();
    let file = |ending: &str| output.out.join(format!("{}{ending}", table.id));
    vertex_table(found, &scalars).write_csv_file(&file("-vertices.csv"), made)?;
    let Some(mesh) = mesh.filter(|_| !scalars.is_empty()) else { return Ok(()) };
    let all = scalars.len();
    let scale = ColourScale::signed("mode, largest 1", 1.0);
    let maps = Maps { mesh, scalars, units: vec![1.0; all], scale };
    maps.write_ply(&file(".ply"), 0, made)?;
    let of = if all > MOST_MAPS { format!(" ({MOST_MAPS} of {all})") } else { String::new() };
    let captions = lines(found).into_iter().flat_map(|line| {
        let more = if line.multiplicity == 1 { String::new() } else { format!(" ({}-fold)", line.multiplicity()) };
        (line.first..).zip(line.modes).map(move |(k, mode)| {
            let place = match mode.participation {
                ..LOCAL => format!(", at vertex {}", peak(&mode.values)),
                _ => String::new(),
            };
            format!("mode {k}: λ = {}{more}{place}", readable(mode.eigenvalue.value, 4))
        })
    });
    let title = format!("{}: slowest modes{of}", subject.caption());
    output.figure(&table.id, &maps.figure(title, captions.take(MOST_MAPS), Framed::Near), made)
}

/// The fields `modes`, with an object each, and `mode_clusters`, with one an eigenvalue.
pub fn json(found: &SlowModes) -> [(&'static str, Value); 2] {
    let mode = |mode: &SlowMode| {
        json!({
            "value": number(mode.eigenvalue.value),
            "residual": number(mode.eigenvalue.residual),
            "participation": number(mode.participation),
        })
    };
    let cluster = |line: Line| {
        json!({
            "value": number(line.modes[0].eigenvalue.value),
            "multiplicity": line.multiplicity,
            "complete": line.complete,
        })
    };
    [
        ("modes", found.modes.iter().map(mode).collect()),
        ("mode_clusters", lines(found).into_iter().map(cluster).collect()),
    ]
}
