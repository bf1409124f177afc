//! Lin-Luo Fig. 2–4: the curve scheme, and the stencil of the interpolatory √3 scheme.

use std::f64::consts::TAU;

use glam::DVec3;

use crate::report::{Colour, Dash, Figure, LinePlot, Marker, Series, palette};
use limitlab::Result;
use limitlab::analysis::splitting::Layout;
use limitlab::error::Error;
use limitlab::interpolate::lin_luo::curve::{Ends, refine, refine_n};
use limitlab::mesh::{Mesh, Surface};
use limitlab::schemes::unified_sqrt3;

use super::{Album, Line, plain};
use crate::programs::reproduce::context::Subject;

const POLYGON: Colour = Colour(150, 150, 150);
/// Levels after which a curve looks smooth.
const LEVELS: usize = 6;

fn polygon(points: &[(f64, f64)]) -> Vec<DVec3> {
    points.iter().map(|&(x, y)| DVec3::new(x, y, 0.0)).collect()
}

fn flat(points: &[DVec3]) -> impl Iterator<Item = (f64, f64)> {
    points.iter().map(|p| (p.x, p.y))
}

/// Segments, each on its own.
fn segments(pairs: impl IntoIterator<Item = (DVec3, DVec3)>) -> Vec<(f64, f64)> {
    let gap = (f64::NAN, f64::NAN);
    pairs.into_iter().flat_map(|(a, b)| [(a.x, a.y), (b.x, b.y), gap]).collect()
}

fn line<'a>(name: &'a str, shows: &'a str, subject: (&'a str, &'a [DVec3])) -> Line<'a> {
    Line { name, shows, subject, iterations: None, error: None }
}

/// Fig. 2: a step of the cubic B-spline and one of the four-point scheme.
pub fn relation(album: &mut Album) -> Result<()> {
    let corners = [(0.0, 0.0), (1.2, 2.0), (3.2, 2.6), (4.6, 0.9), (6.4, 0.4)];
    let p = &polygon(&corners);
    let every_second =
        |points: &[DVec3], from: usize| -> Vec<DVec3> { points.iter().skip(from).step_by(2).copied().collect() };
    let spline = refine(p, &[1.0; 5], Ends::Open).0;
    let four_point = refine(p, &[0.0; 5], Ends::Open).0;
    let (moved, middle) = (every_second(&spline, 0), every_second(&spline, 1));
    let new = every_second(&four_point, 1);
    let pairs = |a: &[DVec3], b: &[DVec3]| segments(a.iter().copied().zip(b.iter().copied()).collect::<Vec<_>>());
    let curve = |alpha: f64| refine_n(p, &[alpha; 5], Ends::Open, LEVELS).0;
    let plot = LinePlot {
        equal_units: true,
        without_axes: true,
        series: vec![
            Series::line("control points P_{i}^{0}", flat(p)).colour(POLYGON).marker(Marker::Circle),
            Series::scatter("midpoints P_{i}^{1}", flat(&middle)).marker(Marker::Square).colour(palette(0)),
            Series::scatter("B-spline's P_{i}^{2}", flat(&moved)).marker(Marker::Triangle).colour(palette(0)),
            Series::scatter("four-point's P_{i}^{3}", flat(&new)).marker(Marker::Diamond).colour(palette(1)),
            Series::line("Δ(P_{i})", pairs(p, &moved)).colour(palette(0)),
            Series::line("−(Δ(P_{i}) + Δ(P_{i+1}))/2", pairs(&middle, &new)).colour(palette(1)),
            Series::line("B-spline curve", flat(&curve(1.0))).colour(palette(0)).dash(Dash::Dotted),
            Series::line("four-point curve", flat(&curve(0.0))).colour(palette(1)).dash(Dash::Dotted),
        ],
        ..LinePlot::default()
    };
    let shows =
        "Lin-Luo Fig. 2: new points of the four-point scheme from the displacements of the cubic B-spline's step";
    let figure = Figure { width: 480, height: 165, ..Figure::new(plot) };
    album.add(&line("lin-luo-2", shows, ("polygon of 5 points", p)), figure)
}

/// Fig. 3: curves for several α; ends and α a point of its own beside.
pub fn samples(album: &mut Album) -> Result<()> {
    let corners = [(0.0, 0.0), (0.4, 2.2), (1.9, 1.2), (3.3, 2.4), (4.2, 0.6), (2.4, -0.8)];
    let p = &polygon(&corners);
    let all = |alpha: f64| vec![alpha; p.len()];
    let drawn = |ends: Ends| {
        let closing = if ends == Ends::Closed { &p[..1] } else { &[] };
        Series::line("", flat(&[p, closing].concat())).colour(POLYGON).marker(Marker::Circle)
    };
    let curve = |alpha: &[f64], ends: Ends| {
        let mut points = refine_n(p, alpha, ends, LEVELS).0;
        if ends == Ends::Closed {
            points.push(points[0]);
        }
        points
    };
    // One legend serves both.
    let samples = |ends: Ends| -> Vec<Series> {
        let curves = [0.0, 0.25, 0.5, 0.75, 1.0].into_iter().enumerate();
        let curves = curves.map(|(i, alpha)| {
            let name = match ends {
                Ends::Closed => String::new(),
                Ends::Open => format!("α = {alpha}"),
            };
            Series::line(name, flat(&curve(&all(alpha), ends))).colour(palette(i))
        });
        [drawn(ends)].into_iter().chain(curves).collect()
    };
    let chosen = [0, 2, 4];
    let mut alpha = all(1.0);
    for i in chosen {
        alpha[i] = 0.0;
    }
    let held: Vec<DVec3> = chosen.map(|i| p[i]).to_vec();
    let panels = [
        LinePlot { title: "closed".into(), series: samples(Ends::Closed), ..LinePlot::default() },
        LinePlot { title: "open".into(), series: samples(Ends::Open), ..LinePlot::default() },
        LinePlot {
            title: "α = 0 or 1".into(),
            series: vec![
                drawn(Ends::Closed),
                Series::line("curve", flat(&curve(&alpha, Ends::Closed))).colour(palette(0)),
                Series::scatter("α = 0", flat(&held)).marker(Marker::Square).colour(palette(1)),
            ],
            ..LinePlot::default()
        },
    ];
    let panels = panels.map(|panel| LinePlot {
        equal_units: true,
        without_axes: true,
        x_range: Some((-0.5, 4.9)),
        y_range: Some((-1.3, 2.9)),
        ..panel
    });
    let figure = Figure { width: 690, height: 180, ..Figure::row(panels) };
    let shows = "Lin-Luo Fig. 3: the unified curve scheme for α from 0 (four-point) to 1 (B-spline), closed and open, and \
                 with α = 0 at some points";
    album.add(&line("lin-luo-3", shows, ("polygon of 6 points", p)), figure)
}

/// A vertex of valence n with three rings about it in the plane, closed by a vertex far away.
fn star(n: usize) -> Result<Subject> {
    let layout = Layout::Triangles;
    let axis = |s: usize| {
        let angle = TAU * s as f64 / n as f64;
        DVec3::new(angle.cos(), angle.sin(), 0.0)
    };
    let position = |index: usize| {
        let label = layout.label(n, index);
        let mut parts = label.split([':', ',']).map(str::parse::<usize>);
        let mut next = || parts.next().and_then(|p| p.ok());
        match (next(), next(), next()) {
            (Some(s), Some(i), Some(j)) => i as f64 * axis(s) + j as f64 * axis(s + 1),
            _ => DVec3::ZERO,
        }
    };
    let mut points: Vec<DVec3> = (0..layout.len(n, 3)).map(position).collect();
    points.push(DVec3::ZERO);
    let faces = layout.closed(n, 3);
    if points.iter().any(|p| !p.is_finite()) {
        return Err(Error::Computation(format!("no star of valence {n}")));
    }
    plain(&format!("star of valence {n}"), Mesh::new(points, faces))
}

/// The weights of the new vertex in face 0, read off from the refinement of unit vectors.
fn weights(surface: &Surface) -> Result<Vec<f64>> {
    let n = surface.len();
    let alpha = vec![1.0; n];
    let mut unit = surface.clone();
    (0..n)
        .map(|v| {
            unit.positions_mut().fill(DVec3::ZERO);
            unit.positions_mut()[v] = DVec3::X;
            let (fine, _) = unified_sqrt3::refine(&unit, &alpha)?;
            Ok(fine.positions[n].x)
        })
        .collect()
}

/// Fig. 4: the stencil of a new vertex beside regular vertices and beside an extraordinary one.
pub fn stencils(album: &mut Album) -> Result<()> {
    let mut panels = Vec::new();
    let mut last = None;
    for (title, n) in [("regular", 6), ("a corner of valence 7", 7)] {
        let subject = star(n)?;
        let mesh = subject.surface.mesh();
        let apex = mesh.len() as u32 - 1;
        let inner = mesh.faces.iter().filter(|face| !face.contains(&apex));
        let at = |v: u32| mesh.positions[v as usize];
        let edges = inner.flat_map(|f| (0..3).map(|k| (at(f[k]), at(f[(k + 1) % 3]))));
        let mut series = vec![Series::line("", segments(edges)).colour(Colour(205, 205, 205))];
        // Vertices of one weight together, the largest first.
        let weights = weights(&subject.surface)?;
        let mut order: Vec<usize> = (0..mesh.len()).collect();
        order.retain(|&v| weights[v].abs() > 1e-12);
        order.sort_by(|&a, &b| weights[b].total_cmp(&weights[a]));
        let alike = order.chunk_by(|&a, &b| (weights[a] - weights[b]).abs() < 1e-9);
        for (k, group) in alike.enumerate() {
            let name = format!("{:.5} × {}", weights[group[0]], group.len()).replace('-', "−");
            let points = group.iter().map(|&v| at(v as u32));
            series.push(
                Series::scatter(name, flat(&points.collect::<Vec<_>>()))
                    .marker(crate::report::series::marker(k))
                    .colour(palette(k)),
            );
        }
        let face = mesh.faces.face(0);
        let center = face.iter().map(|&v| at(v)).sum::<DVec3>() / 3.0;
        series.push(Series::scatter("the new vertex", flat(&[center])).marker(Marker::Plus).colour(Colour(0, 0, 0)));
        panels.push(LinePlot {
            title: title.into(),
            equal_units: true,
            without_axes: true,
            series,
            ..LinePlot::default()
        });
        last = Some(subject);
    }
    let Some(subject) = last else { return Ok(()) };
    let figure = Figure { width: 620, height: 200, ..Figure::row(panels) }
        .headed("Weights of a new vertex, times the number of vertices that have them");
    let shows = "Lin-Luo Fig. 4: the weights of a new vertex of the interpolatory √3 scheme, with how many vertices have \
                 each";
    album.add(&line("lin-luo-4", shows, subject.points()), figure)
}
