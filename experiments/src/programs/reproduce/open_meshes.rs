//! Open and creased meshes: the stages of their systems, spectra and proven bounds of the smooth vertices, iterations
//! predicted and made; decay of the inverse around creases.

use crate::cli::STAND_IN_NOISE;
use crate::report::{Column, Columns, Figure, SparsityPlot};
use limitlab::Result;
use limitlab::analysis::spectrum::{Spectrum, spectrum};
use limitlab::assemble::Stages;
use limitlab::error::Error;
use limitlab::interpolate::{Options, Tolerance, interpolate, limit_points, staged};
use limitlab::mesh::features::{Rule, SHARP, Tags};
use limitlab::mesh::noise::add_noise;
use limitlab::mesh::order::inverse;
use limitlab::mesh::validate::Boundary;
use limitlab::mesh::{Faces, Mesh, Surface, builtin};
use limitlab::schemes::Scheme;
use limitlab::solvers::{Method, Report, Solution, Stop};

use crate::programs::reproduce::context::{Context, Item, Question, Subject};
use crate::programs::reproduce::corpus;
use crate::programs::reproduce::creases::{closed_loop, knot, rims, split_cube, torus_loop};
use crate::programs::reproduce::whole::Whole;

pub const OPEN_MESHES: Item = Item {
    id: "open-meshes",
    title: "Open and creased meshes: spectra of the smooth vertices, iterations",
    question: Some(Question {
        asks: "Do the methods converge on open and creased meshes?",
        answer: "As on closed ones: the matrix is singular in known cases only (P13), its spectrum real and bounded \
                 without darts (P14), and PIA, ω = ½, Gauss-Seidel and SOR converge (P15).",
    }),
    run,
};

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
        .col(Column::text("smooth"), |r| r.stages.block().len())
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
    // The same on any meshes.
    if context.real() {
        return Ok(());
    }
    creased(context)
}

/// A creased mesh made here, under Catmull-Clark.
struct Creased {
    subject: Subject,
    stages: Stages,
    /// Of all of A.
    rho: f64,
    imaginary: f64,
    pia: Report,
    thall: Report,
    gauss_seidel: Report,
    auto: Report,
    off: f64,
}

impl Creased {
    fn new((name, closed, tags): (&str, Mesh, Tags)) -> Result<Self> {
        let surface = Surface::new(closed)?.into_tagged(&tags)?;
        let scheme = Scheme::CatmullClark;
        let stages = Stages::new(&surface, scheme, None)?;
        let whole = Whole::of(&stages);
        let all = whole.eigenvalues()?;
        let size = surface.diagonal();
        let stop = Stop { tolerance: TOLERANCE * size, max_iterations: LIMIT };
        let by = |method| whole.run(surface.positions(), method, &stop);
        let auto = interpolate(&surface, scheme, &Options::from(stop))?;
        let limits = limit_points(&surface.with_positions(auto.points), scheme)?;
        let distances = limits.iter().zip(surface.positions()).map(|(a, b)| a.distance(*b));
        Ok(Creased {
            rho: all.iter().map(|z| (1.0 - z).norm()).fold(0.0, f64::max),
            imaginary: all.iter().map(|z| z.im.abs()).fold(0.0, f64::max),
            pia: by(Method::Pia),
            thall: by(Method::Thall),
            gauss_seidel: by(Method::GaussSeidel { order: None }),
            auto: auto.report,
            off: distances.fold(0.0, f64::max) / size,
            stages,
            subject: Subject { name: name.into(), surface },
        })
    }
}

/// A cube, a torus and a knot with creases, corners, darts and semi-sharp edges.
fn creased_meshes() -> Vec<(&'static str, Mesh, Tags)> {
    let tagged = |creases: Vec<_>, corners: &[u32]| {
        let corners = corners.iter().map(|&v| (v, SHARP)).collect();
        Tags { creases, corners, ..Tags::default() }
    };
    let torus = || builtin::torus(16, 12);
    let around = |j: u32, sharpness: f64| closed_loop(torus_loop(16, 12, j), sharpness);
    let (rings, sides) = (48, 6);
    let along = |j: u32, sharpness: f64| closed_loop(torus_loop(rings, sides, j), sharpness);
    // From smooth to as good as sharp and back.
    let ramp = |j: u32| -> Vec<_> {
        let sharpness = |i: usize| 4.0 * (1.0 - (i as f64 - 23.5).abs() / 24.0);
        along(j, 0.0).into_iter().enumerate().map(|(i, (edge, _))| (edge, sharpness(i))).collect()
    };
    let knot = || knot(rings as usize, sides as usize);
    let part = |edges: Vec<([u32; 2], f64)>| edges.into_iter().take(10).collect::<Vec<_>>();
    let both = |[a, b]: [Vec<([u32; 2], f64)>; 2]| [a, b].concat();
    vec![
        ("cube, two rims", split_cube(), tagged(rims(SHARP), &[])),
        ("cube, two rims of sharpness 1.5", split_cube(), tagged(rims(1.5), &[])),
        ("torus:16x12, two loops, corners", torus(), tagged(both([around(0, SHARP), around(6, SHARP)]), &[0, 48, 6])),
        (
            "torus:16x12, creases between darts",
            torus(),
            tagged(both([part(around(0, SHARP)), part(around(6, SHARP))]), &[]),
        ),
        ("torus:16x12, loops of sharpness 1 and 2.5", torus(), tagged(both([around(0, 1.0), around(6, 2.5)]), &[])),
        ("knot, two loops", knot(), tagged(both([along(0, SHARP), along(3, SHARP)]), &[])),
        (
            "knot, creases between darts, a corner",
            knot(),
            tagged(both([part(along(0, SHARP)), part(along(3, SHARP))]), &[30]),
        ),
        ("knot, a ramp of sharpness 0 to 4", knot(), tagged(ramp(0), &[])),
    ]
}

fn creased(context: &mut Context) -> Result<()> {
    let mut meshes = creased_meshes();
    if context.quick {
        meshes.truncate(QUICK);
    }
    for (_, mesh, _) in &mut meshes {
        add_noise(mesh, STAND_IN_NOISE.amplitude, STAND_IN_NOISE.seed);
    }
    let rows = meshes.into_iter().map(Creased::new).collect::<Result<Vec<Creased>>>()?;
    let count = |rule| move |r: &Creased| r.subject.surface.features().map_or(0, |f| f.count(rule)).to_string();
    let table = Columns::<Creased>::new()
        .col(Column::key("mesh"), |r| r.subject.name.clone())
        .col(Column::text("smooth"), |r| r.stages.block().len())
        .col(Column::text("on_curves"), count(Rule::Crease))
        .col(Column::text("curves"), |r| r.subject.surface.features().map_or(0, |f| f.curves().len()))
        .col(Column::text("corners"), count(Rule::Corner))
        .col(Column::text("darts"), count(Rule::Dart))
        .col(Column::text("semi_sharp"), count(Rule::SemiSharp))
        .col(Column::number("pia_rho", 1e-6, 4), |r| Some(r.rho))
        .col(Column::number("largest_im", 1e-4, 2).floor(1e-6), |r| Some(r.imaginary))
        .col(Column::count("pia"), |r| r.pia.iterations)
        .col(Column::count("thall"), |r| r.thall.iterations)
        .col(Column::count("gauss_seidel"), |r| r.gauss_seidel.iterations)
        .col(Column::count("auto"), |r| r.auto.iterations)
        .col(Column::text("status"), |r| r.auto.outcome.name())
        .col(Column::number("auto_error", 1.0, 2).floor(TOLERANCE), |r| Some(r.off));
    let title = "Creased meshes made here: vertices by their rule, all of A, iterations";
    let mut table = table.table(format!("{}--creased", OPEN_MESHES.id), title, &rows);
    table.note(
        "Under Catmull-Clark. `pia_rho` is the spectral radius of I − A and `largest_im` the largest |Im λ|, of all of \
         A: it is not symmetric where there are curves, nor similar to a symmetric matrix where there are darts or \
         irregular semi-sharp edges. PIA, Thall's ω = ½ and Gauss-Seidel (file order) run on all vertices together \
         from V = P, corners and curves too, to 10⁻¹⁰ of the bounding box's diagonal.",
    );
    context.table(table)?;
    if context.quick { Ok(()) } else { blocks(context) }
}

/// The pattern of A in file order, and with corners first, then curves, then the smooth vertices.
fn blocks(context: &mut Context) -> Result<()> {
    let (rings, sides) = (48, 6);
    let creases = [0, 3].map(|j| closed_loop(torus_loop(rings, sides, j), SHARP)).concat();
    let corners = [0, 16 * sides, 24 * sides + 3].map(|v| (v, SHARP)).to_vec();
    let mesh = knot(rings as usize, sides as usize);
    let surface = Surface::new(mesh)?.into_tagged(&Tags { creases, corners, ..Tags::default() })?;
    let matrix = Stages::new(&surface, Scheme::CatmullClark, None)?.matrix();
    let mut order: Vec<u32> = (0..surface.len() as u32).collect();
    let file = inverse(&order);
    if let Some(features) = surface.features() {
        // Along the curves, one after the other.
        let mut place = vec![usize::MAX; surface.len()];
        features.curves().iter().flat_map(|c| &c.vertices).enumerate().for_each(|(k, &v)| place[v as usize] = k);
        let block = |v: u32| match features.rules()[v as usize] {
            Rule::Corner => 0,
            Rule::Crease => 1,
            Rule::Smooth | Rule::Dart | Rule::SemiSharp => 2,
        };
        order.sort_by_key(|&v| (block(v), place[v as usize]));
    }
    let plot = |caption: &str, place: &[u32]| {
        let row = |i: usize| matrix.row(i).map(move |(j, _)| (place[i], place[j]));
        SparsityPlot::new(caption, matrix.len(), (0..matrix.len()).flat_map(row))
    };
    let panels = [plot("file order", &file), plot("corners, curves, smooth vertices", &inverse(&order))];
    let figure = Figure { width: 560, height: 310, ..Figure::row(panels) };
    context.figure(
        &format!("{}--blocks", OPEN_MESHES.id),
        &figure.title("A of a knot with two creases and three corners under catmull-clark"),
    )
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
