//! The table and the picture of eigenvalues over ω.

use serde_json::{Value, json};

use super::style;
use crate::cli::number;
use crate::report::{Colour, Column, Columns, Figure, LinePlot, Rule, Series, Table, palette};
use limitlab::analysis::trajectories::Trajectories;
use limitlab::error::short;
use limitlab::solvers::Method;

/// A method by its name and, where it sweeps, its order, with its look.
pub struct Followed {
    pub name: String,
    pub colour: Colour,
    pub found: Trajectories,
}

impl Followed {
    pub fn new(name: impl Into<String>, method: Method, found: Trajectories) -> Self {
        Followed { name: name.into(), colour: style::of(method, "").colour, found }
    }
}

/// ω whose eigenvalues are drawn in the plane.
const SHOWN: usize = 6;

/// Imaginary parts below this are those of rounding.
const REAL: f64 = 1e-6;

/// A row a method and ω: the radius, the dominant eigenvalue, the ends of the real ones, the largest modulus of the others.
pub fn table(id: String, caption: &str, all: &[Followed]) -> Table {
    struct Row {
        method: String,
        omega: f64,
        dominant: (f64, f64),
        real: Option<(f64, f64)>,
        pairs: Option<f64>,
    }
    let mut rows = Vec::new();
    for Followed { name, found, .. } in all {
        for (omega, values) in &found.rows {
            let real = || values.iter().filter(|z| z.im.abs() <= REAL).map(|z| z.re);
            rows.push(Row {
                method: name.clone(),
                omega: *omega,
                dominant: values.first().map_or((0.0, 0.0), |z| (z.re, z.im.abs())),
                real: real().reduce(f64::min).zip(real().reduce(f64::max)),
                pairs: values.iter().filter(|z| z.im.abs() > REAL).map(|z| z.norm()).reduce(f64::max),
            });
        }
    }
    let mut table = Columns::<Row>::new()
        .col(Column::key("method"), |r| r.method.clone())
        .col(Column::key("omega"), |r| short(r.omega))
        .col(Column::number("rho", 1e-5, 5), |r| r.dominant.0.hypot(r.dominant.1))
        .col(Column::number("real", 1e-3, 5), |r| r.dominant.0)
        .col(Column::number("imaginary", 1e-3, 4).floor(1e-4), |r| r.dominant.1)
        .col(Column::number("real_min", 1e-3, 4).floor(1e-4), |r| r.real.map(|ends| ends.0))
        .col(Column::number("real_max", 1e-3, 4).floor(1e-4), |r| r.real.map(|ends| ends.1))
        .col(Column::number("complex_modulus", 1e-3, 4).floor(1e-4), |r| r.pairs)
        .table(id, format!("Eigenvalues over ω on {caption}"), &rows);
    table.note(
        "`real` and `imaginary` are those of the dominant eigenvalue of T, of modulus ρ; `real_min` and `real_max` the ends of the real \
         eigenvalues; `complex_modulus` the largest modulus of those that are not real.",
    );
    for Followed { name, found, .. } in all {
        table.note(said(name, found));
    }
    table
}

/// What became of the dominant eigenvalue, in a sentence.
fn said(method: &str, found: &Trajectories) -> String {
    let best = format!("ρ is least at ω = {:.3}, {:.5}", found.best.0, found.best.1);
    match found.change {
        None => format!("{method}: the dominant eigenvalue is positive and real at all ω; {best}."),
        Some((omega, change)) => format!(
            "{method}: the dominant eigenvalue is positive and real up to ω = {omega:.3}, where it {}; {best}.",
            change.name()
        ),
    }
}

/// All eigenvalues, for a file.
pub fn eigenvalue_table(id: String, caption: &str, all: &[Followed]) -> Table {
    let mut rows: Vec<(&str, f64, usize, f64, f64)> = Vec::new();
    for Followed { name, found, .. } in all {
        for (omega, values) in &found.rows {
            rows.extend(values.iter().enumerate().map(|(k, z)| (&**name, *omega, k, z.re, z.im)));
        }
    }
    Columns::<(&str, f64, usize, f64, f64)>::new()
        .col(Column::key("method"), |r| r.0)
        .col(Column::key("omega"), |r| short(r.1))
        .col(Column::key("index"), |r| r.2.to_string())
        .col(Column::number("real", 1e-6, 10), |r| r.3)
        .col(Column::number("imaginary", 1e-6, 10), |r| r.4)
        .table(id, format!("Eigenvalues over ω on {caption}"), &rows)
}

/// For each method the eigenvalues in the plane at some ω, and beside it all moduli over ω.
pub fn figure(caption: &str, all: &[Followed]) -> Figure {
    let mut panels = Vec::new();
    for Followed { name, colour, found } in all {
        let step = found.rows.len().div_ceil(SHOWN).max(1);
        let chosen = found.rows.iter().step_by(step).enumerate();
        let series = chosen.map(|(k, (omega, values))| {
            Series::cloud(format!("ω = {}", short(*omega)), values.iter().map(|z| (z.re, z.im))).colour(palette(k))
        });
        let series: Vec<Series> = series.collect();
        let reach = series.iter().flat_map(|s| &s.points).map(|p| p.0.hypot(p.1)).fold(1.0, f64::max) * 1.05;
        panels.push(LinePlot {
            title: format!("{name}: eigenvalues"),
            x_label: "Re λ".into(),
            y_label: "Im λ".into(),
            x_range: Some((-reach, reach)),
            y_range: Some((-reach, reach)),
            equal_units: true,
            series,
            ..LinePlot::default()
        });
        let of = |wanted: fn(f64, f64) -> bool| {
            let rows = found.rows.iter();
            let all = rows.flat_map(|(omega, values)| values.iter().map(|z| (*omega, *z)));
            all.filter(|(_, z)| wanted(z.re, z.im.abs())).map(|(omega, z)| (omega, z.norm())).collect::<Vec<_>>()
        };
        let radius = found.rows.iter().map(|(omega, values)| (*omega, values.first().map_or(0.0, |z| z.norm())));
        let mut series = vec![
            Series::cloud("not real", of(|_, im| im > REAL)).colour(palette(5)),
            Series::cloud("negative", of(|re, im| im <= REAL && re < 0.0)).colour(palette(3)),
            Series::cloud("positive", of(|re, im| im <= REAL && re >= 0.0)).colour(palette(2)),
            Series::line("ρ", radius).colour(*colour),
        ];
        series.retain(|s| !s.points.is_empty());
        let mut rules = vec![Rule::new(found.best.0, "best ω")];
        rules.extend(found.change.map(|(omega, change)| Rule::new(omega, change.name())));
        panels.push(LinePlot {
            title: format!("{name}: moduli over ω"),
            x_label: "ω".into(),
            y_label: "|λ|".into(),
            series,
            vertical_lines: rules,
            ..LinePlot::default()
        });
    }
    let height = 22 + 340 * all.len() as u32;
    Figure { title: caption.into(), width: 900, height, columns: 2, share_x: false, ..Figure::row(panels) }
}

/// The field of the JSON object.
pub fn json(all: &[Followed]) -> Value {
    let one = |Followed { name, found, .. }: &Followed| {
        let change = found.change.map(|(omega, change)| json!({ "omega": number(omega), "how": change.name() }));
        json!({
            "method": name,
            "best_omega": number(found.best.0),
            "best_rho": number(found.best.1),
            "change": change,
            "rho": found.rows.iter().map(|(omega, all)| json!([omega, all.first().map(|z| z.norm())])).collect::<Vec<_>>(),
        })
    };
    all.iter().map(one).collect()
}
