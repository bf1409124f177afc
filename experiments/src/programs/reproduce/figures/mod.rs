//! Pictures of the papers, rendered anew: meshes, interpolating surfaces, errors.
//!
//! A picture is `figures--NAME.png`; the table `figures` says what each shows, on which mesh, and how far the surface
//! is from the points.

mod creases;
mod curves;
mod doo_sabin;
mod errors;
mod limits;
mod normals;
mod sqrt3;
mod stand_ins;

use crate::report::{Column, Columns, Figure, ShadedMesh, Table};
use crate::studies::pictures::{CONTROL, FINE_EDGE, FINEST_EDGE, GIVEN, POINT, cage, maps, power, sheet, view};
use glam::DVec3;
use limitlab::Result;
use limitlab::assemble::LimitSystem;
use limitlab::mesh::{Mesh, Surface, diagonal};
use limitlab::schemes::Refinement;
use limitlab::solvers::{Method, Stop, run as solve};

use crate::programs::reproduce::context::{Context, Item, Question, Subject};
use crate::programs::reproduce::corpus::Model;
pub use doo_sabin::surface as doo_sabin_surface;
use stand_ins::StandIn;

pub const ALL: Item = Item {
    id: "figures",
    title: "Pictures of the papers' surfaces, of errors and of slow modes",
    question: Some(Question {
        asks: "What do the papers' surfaces look like?",
        answer: "Their figures from these computations, then the errors at the vertices and the modes that make a \
                 method slow. The table says what each picture shows.",
    }),
    run,
};

/// Faces that a surface is refined to, at most.
const FACES: usize = 400_000;

fn run(context: &mut Context) -> Result<()> {
    let mut album = Album::new(context);
    limits::thall_series(&mut album)?;
    if !album.context.quick {
        limits::thall_animation(&mut album)?;
        limits::pia(&mut album)?;
        normals::bones(&mut album)?;
        normals::end_cap(&mut album)?;
        errors::error_maps(&mut album)?;
        errors::slow_modes(&mut album)?;
        doo_sabin::approximation(&mut album)?;
        doo_sabin::against_nasri(&mut album)?;
        doo_sabin::large(&mut album)?;
        doo_sabin::with_normals(&mut album)?;
        doo_sabin::scaled_faces(&mut album)?;
        doo_sabin::with_handles(&mut album)?;
        creases::frozen(&mut album)?;
        creases::same_points(&mut album)?;
        curves::relation(&mut album)?;
        curves::samples(&mut album)?;
        curves::stencils(&mut album)?;
        sqrt3::against_butterfly(&mut album)?;
        sqrt3::bunny(&mut album)?;
        sqrt3::parameters(&mut album)?;
        sqrt3::reflections(&mut album)?;
    }
    let Album { table, .. } = album;
    context.table(table)
}

/// Pictures with their table.
struct Album<'a> {
    context: &'a mut Context,
    table: Table,
    /// The names of the shapes that took the places of models.
    stand_ins: Vec<String>,
}

/// What the table says of a picture.
struct Line<'a> {
    /// Of the file.
    name: &'a str,
    shows: &'a str,
    /// The name and the points of the mesh.
    subject: (&'a str, &'a [DVec3]),
    iterations: Option<usize>,
    /// The largest distance of a given point from its limit point.
    error: Option<f64>,
}

impl<'a> Album<'a> {
    fn new(context: &'a mut Context) -> Self {
        let mut table = columns().table(ALL.id, ALL.title, []);
        table.note(
            "Each picture is the file `figures--PICTURE.png` beside this one. Surfaces are refined and their vertices \
             then put on the limit surface, with its normals (Loop, Catmull-Clark), or refined until facets are no \
             longer seen (Doo-Sabin, √3). `iterations` and `error_percent`, the largest distance of a given point \
             from its limit point in percent of the bounding box's diagonal, are those of the last surface in the \
             picture. A model that is not at hand has a shape in its place that says so in the picture; thall-7, thall-8, \
             zheng-cai-6 to 8 and lin-luo-2 to 4 are of meshes of their own and the same everywhere.",
        );
        if context.real() {
            table.note(
                "Sources of the models: horse, bird, hand, boy and hat are of the Princeton Shape Benchmark (Shilane, \
                 Min, Kazhdan & Funkhouser 2004; copyright 2003 Princeton University); the mushroom is Geomview's; \
                 the bunny is of the Stanford 3D Scanning Repository; spot and bob are Keenan Crane's; letter P and \
                 tripod are CGAL's. At the slits in the boy's temple and at the spot on his cheek (pia-6-boy) the model \
                 itself is folded, by 115° and more.",
            );
        }
        Album { context, table, stand_ins: Vec::new() }
    }

    /// The model where it is at hand, else a shape in its place.
    fn subject(&mut self, model: &Model, stand_in: StandIn) -> Result<Subject> {
        if self.context.real() {
            return self.context.model(model);
        }
        let subject = stand_in.subject()?;
        self.stand_ins.push(subject.name.clone());
        Ok(subject)
    }

    fn add(&mut self, line: &Line, figure: Figure) -> Result<()> {
        self.list(line);
        let figure = self.named(line, figure);
        self.context.figure(&format!("{}--{}", ALL.id, line.name), &figure)
    }

    /// A shape that stands in for a model says so.
    fn named(&self, line: &Line, figure: Figure) -> Figure {
        let (name, _) = line.subject;
        if !self.stand_ins.iter().any(|stand_in| stand_in == name) {
            return figure;
        }
        let note = format!("stand-in: {name}");
        if figure.title.is_empty() {
            return figure.headed(note);
        }
        let title = format!("{} ({note})", figure.title);
        figure.title(title)
    }

    /// As [`add`](Self::add), figures one after the other.
    fn animate(&mut self, line: &Line, figures: Vec<Figure>) -> Result<()> {
        self.list(line);
        let figures: Vec<Figure> = figures.into_iter().map(|figure| self.named(line, figure)).collect();
        self.context.animation(&format!("{}--{}", ALL.id, line.name), &figures)
    }

    fn list(&mut self, line: &Line) {
        self.table.push(columns().row(line));
    }
}

fn columns<'r>() -> Columns<'static, Line<'r>> {
    Columns::new()
        .col(Column::key("picture"), |line: &Line| line.name.to_owned())
        .col(Column::text("shows"), |line| line.shows)
        .col(Column::text("mesh"), |line| line.subject.0)
        .col(Column::text("vertices"), |line| line.subject.1.len().to_string())
        .col(Column::count("iterations"), |line| line.iterations)
        .col(Column::number("error_percent", 1e-6, 3).floor(1e-9), |line| {
            line.error.map(|e| 100.0 * e / diagonal(line.subject.1))
        })
}

/// A mesh of our own.
fn plain(name: &str, mesh: Mesh) -> Result<Subject> {
    Ok(Subject { name: name.to_owned(), surface: Surface::new(mesh)? })
}

/// The control points after so many steps from V = P, and the largest error that they leave.
fn control(subject: &Subject, system: &LimitSystem, method: Method, iterations: usize) -> (Surface, f64) {
    let stop = Stop { tolerance: 0.0, max_iterations: iterations };
    let solution = solve(system, subject.surface.positions(), method, &stop);
    let error = solution.report.last().max;
    (subject.surface.with_positions(solution.points), error)
}

/// The scheme's limit surface of a control mesh: as many refinements as [`FACES`] allows, then limit points and
/// limit normals.
pub fn limit_surface(scheme: Refinement, control: &Surface) -> Result<ShadedMesh> {
    let mut levels = 1;
    while levels < 5 && (control.faces().corners().len() << (2 * levels)) < FACES {
        levels += 1;
    }
    let refined = scheme.refined_n(control, levels)?;
    let points = scheme.limit_positions(&refined)?;
    let normals = scheme.limit_normals(&refined)?;
    Ok(ShadedMesh::with_normals(Mesh::new(points, refined.into_mesh().faces), normals))
}
