//! Open and creased meshes: the stages of their systems, spectra and proven bounds of the smooth vertices, iterations
//! predicted and made; decay of the inverse around creases.

use limitlab::Result;
use limitlab::analysis::spectrum::{Spectrum, spectrum};
use limitlab::assemble::Stages;
use limitlab::error::Error;
use limitlab::interpolate::{Options, Tolerance, interpolate, limit_points, staged};
use limitlab::mesh::features::{Rule, Tags};
use limitlab::mesh::validate::Boundary;
use limitlab::mesh::{Faces, Mesh, Surface};
use limitlab::schemes::Scheme;
use limitlab::solvers::{Method, Solution, Stop};
use limitlab_experiments::report::{Column, Columns};

use crate::context::{Context, Item, Subject};
use crate::corpus;
use crate::open_decay;

pub const OPEN_MESHES: Item =
    Item { id: "open-meshes", title: "Open and creased meshes: spectra of the smooth vertices, iterations", run };

/// Relative to the diagonal of the bounding box.
const TOLERANCE: f64 = 1e-10;
const LIMIT: usize = 10_000;
/// Meshes of a quick run.
const QUICK: usize = 2;
/// Faces between two holes of a built-in mesh, at the least.
const BETWEEN: usize = 40;

/// A mesh under the scheme that suits its faces.
struct Row {
    subject: Subject,
    scheme: Scheme,
    stages: Stages,
    /// Of the smooth vertices, if there are any.
    spectrum: Option<Spectrum>,
    pia: Solution,
    thall: Solution,
    gauss_seidel: Solution,
    auto: Solution,
    /// The largest distance of a limit point from its vertex, over the diagonal.
    off: f64,
}

impl Row {
    fn new(subject: Subject) -> Result<Self> {
        let surface = &subject.surface;
        let scheme = Scheme::default_for(surface.faces());
        let stages = Stages::new(surface, scheme, None)?;
        let size = surface.diagonal();
        let stop = Stop { tolerance: TOLERANCE * size, max_iterations: LIMIT };
        let by = |method| staged::run(&stages, surface.positions(), method, &stop);
        let options =
            Options { tolerance: Tolerance::Relative(TOLERANCE), max_iterations: LIMIT, ..Options::default() };
        let auto = interpolate(surface, scheme, &options)?;
        let limits = limit_points(&surface.with_positions(auto.points.clone()), scheme)?;
        let distances = limits.iter().zip(surface.positions()).map(|(a, b)| a.distance(*b));
        Ok(Row {
            scheme,
            spectrum: if stages.block().is_empty() { None } else { Some(spectrum(stages.block())?) },
            pia: by(Method::Pia),
            thall: by(Method::Thall),
            gauss_seidel: by(Method::GaussSeidel { order: None }),
            off: distances.fold(0.0, f64::max) / size,
            auto,
            stages,
            subject,
        })
    }

    fn count(&self, rule: Rule) -> String {
        self.subject.surface.features().map_or(0, |f| f.count(rule)).to_string()
    }
}

fn run(context: &mut Context) -> Result<()> {
    let mut subjects = if context.real() { models(context)? } else { stand_ins(context)? };
    if context.quick {
        subjects.truncate(QUICK);
    }
    let rows = subjects.into_iter().map(Row::new).collect::<Result<Vec<Row>>>()?;
    let mut table = Columns::<Row>::new()
        .col(Column::key("mesh"), |r| r.subject.name.clone())
        .col(Column::key("boundary"), |r| r.subject.surface.boundary().name())
        .col(Column::key("scheme"), |r| r.scheme.name())
        .col(Column::text("smooth"), |r| r.stages.block().len().to_string())
        .col(Column::text("on_curves"), |r| r.count(Rule::Crease))
        .col(Column::text("corners"), |r| r.count(Rule::Corner))
        .col(Column::number("lambda_min", 1e-6, 4), |r| r.spectrum.map(|s| s.a.min))
        .col(Column::number("lambda_min_bound", 1e-9, 4), |r| r.spectrum.map(|_| r.stages.block().bounds.lambda_min))
        .col(Column::number("pia_rho", 1e-6, 4), |r| r.spectrum.map(|s| s.a.radius(1.0)))
        .col(Column::count("pia"), |r| r.pia.report.iterations)
        .col(Column::count("thall"), |r| r.thall.report.iterations)
        .col(Column::count("gauss_seidel"), |r| r.gauss_seidel.report.iterations)
        .col(Column::count("auto"), |r| r.auto.report.iterations)
        .col(Column::text("status"), |r| r.auto.report.outcome.name())
        .col(Column::number("auto_error", 1.0, 2).floor(TOLERANCE), |r| r.off)
        .table(OPEN_MESHES.id, OPEN_MESHES.title, &rows);
    table.note(
        "Catmull-Clark, on triangles Loop. Curves are solved first, exactly; `lambda_min` is that of the smooth vertices, \
         `lambda_min_bound` follows from their valences, `pia_rho` = 1 − λ_min. Iterations from V = P on the smooth vertices \
         to 10⁻¹⁰ of the bounding box's diagonal: PIA, Thall's ω = ½, Gauss-Seidel in file order, `auto`. `auto_error` is the \
         largest distance of a limit point from its vertex over the diagonal, on curves and corners too, by rows that no \
         solver has seen.",
    );
    context.table(table)?;
    // No model is involved: the results stand with those on built-in meshes.
    if context.real() { Ok(()) } else { context.table(open_decay::table(context.quick)?) }
}

/// The open models.
fn models(context: &Context) -> Result<Vec<Subject>> {
    let mut subjects = Vec::new();
    for file in context.files("open")? {
        let [sharp, smooth] = RULES.map(|boundary| context.read(&file, boundary));
        add(&mut subjects, sharp?, smooth?);
    }
    Ok(subjects)
}

const RULES: [Boundary; 2] = [Boundary::EdgeAndCorner, Boundary::EdgeOnly];

/// A mesh by the first rule, and by the second if that makes a difference.
fn add(subjects: &mut Vec<Subject>, sharp: Subject, smooth: Subject) {
    let differs = sharp.surface.features() != smooth.surface.features();
    subjects.push(sharp);
    subjects.extend(differs.then_some(smooth));
}

/// Built-in meshes with holes, and a torus with two creased loops, three corners on them.
fn stand_ins(context: &Context) -> Result<Vec<Subject>> {
    let mut subjects = Vec::new();
    for name in corpus::OPENED {
        let subject = context.stand_in(name)?;
        let holes = opened(subject.surface.mesh());
        let [sharp, smooth] = RULES.map(|boundary| {
            let surface = Surface::examined(holes.clone(), None, boundary).map_err(Error::Defects)?;
            Ok::<_, Error>(Subject { name: format!("{name} with holes"), surface })
        });
        add(&mut subjects, sharp?, smooth?);
    }
    const N: u32 = 32;
    let torus = context.stand_in("torus:32x32")?;
    let along = |j: u32| (0..N).map(move |i| ([i * N + j, (i + 1) % N * N + j], 10.0));
    let tags = Tags {
        creases: along(0).chain(along(N / 2)).collect(),
        corners: [0, 10 * N, N / 2].map(|v| (v, 10.0)).to_vec(),
        boundary: Boundary::EdgeAndCorner,
    };
    let surface = torus.surface.tagged(&tags)?;
    subjects.push(Subject { name: "torus:32x32 with creases".into(), surface });
    Ok(subjects)
}

/// Without some faces, no two of which share a vertex.
fn opened(mesh: &Mesh) -> Mesh {
    let mut taken = vec![false; mesh.len()];
    let mut last = 0;
    let mut kept = Faces::default();
    for (f, face) in mesh.faces.iter().enumerate() {
        let free = face.iter().all(|&v| !taken[v as usize]);
        if f >= last + BETWEEN && free {
            last = f;
            // Their neighbours are left whole, so that no vertex loses two faces.
            let near = mesh.faces.iter().filter(|other| other.iter().any(|v| face.contains(v)));
            near.flatten().for_each(|&v| taken[v as usize] = true);
        } else {
            kept.push(face);
        }
    }
    Mesh::new(mesh.positions.clone(), kept)
}
