//! The freedom of Zheng and Cai's first refined mesh (§5): none of it used, the best shape handles, all of it; beside
//! Nasri's surface, and the fairest one of Catmull-Clark.

use std::ops::ControlFlow;

use crate::report::{Column, Columns, Picture};
use crate::studies::pictures::{sheet, view};
use glam::DVec3;
use limitlab::Result;
use limitlab::interpolate::fair_refinement::{FairRefinement, FirstFairness, fair_handles, fairest};
use limitlab::interpolate::halstead::{Energies, Fairness, Solver, Weights, fit, fit_watched};
use limitlab::interpolate::nasri;
use limitlab::interpolate::zheng_cai::{Constraints, FirstRefinement, PhaseOne, interpolate};
use limitlab::mesh::Surface;
use limitlab::schemes::Refinement;
use limitlab::schemes::catmull_clark::limit_normals;
use limitlab::schemes::doo_sabin::{CornerRule, face_normals};
use limitlab::solvers::{Method, Step, Stop};

use super::figures::{doo_sabin_surface, limit_surface};
use crate::programs::reproduce::context::{Context, Item, Question, Subject};
use crate::programs::reproduce::corpus;

pub const FREEDOM: Item = Item {
    id: "zheng-cai-freedom",
    title: "Zheng-Cai §5: what the freedom of the first refined mesh is worth",
    question: Some(Question {
        asks: "How are the degrees of freedom and the shape handles of Zheng and Cai's surface used best?",
        answer: "By least energy, which has one minimum for either. There is little to gain, and the best handles take most \
                 of it (Z32).",
    }),
    run,
};

/// Relative to the diagonal of the bounding box.
const TOLERANCE: f64 = 1e-10;

/// All points, nothing else.
const ALL: Constraints = Constraints { interpolated: None, normals: None, handles: None };

/// What is measured of one surface.
struct Row {
    surface: &'static str,
    iterations: Option<usize>,
    energies: Energies,
    /// The largest distance of a limit point from its point.
    error: f64,
    /// The surface's normals at the points.
    normals: Vec<DVec3>,
    /// Least and largest, and how many turn their face over.
    handles: Option<(f64, f64, usize)>,
}

/// The surfaces through the points of a mesh.
pub struct Surfaces {
    pub two_phase: FirstRefinement,
    /// With the system of phase one solved.
    pub exact: FirstRefinement,
    /// Not corrected.
    pub nasri: FirstRefinement,
    pub handles: Vec<f64>,
    pub handled: FairRefinement,
    pub free: FairRefinement,
}

impl Surfaces {
    /// # Errors
    /// Those of the computations.
    pub fn new(surface: &Surface, fairness: &FirstFairness, weights: Weights) -> Result<Self> {
        let points = surface.positions();
        let stop = Stop { tolerance: TOLERANCE * surface.diagonal(), max_iterations: 10_000 };
        let two_phase = interpolate(surface, &ALL, &PhaseOne::default())?.first;
        let solved = PhaseOne { max_iterations: 1000, eps: 1e-14, ..PhaseOne::default() };
        let exact = interpolate(surface, &ALL, &solved)?.first;
        let control = nasri::control_points(surface, None, Method::Cg, &stop)?.points;
        let nasri = FirstRefinement::new(&surface.with_positions(control), CornerRule::DooSabin, points, &ALL)?;
        let first = two_phase.surface.positions();
        let mut watch = |_: &Step| ControlFlow::Continue(());
        let handled = fair_handles(fairness, first, points, &ALL, weights, &stop, &mut watch)?;
        let free = fairest(fairness, first, points, &ALL, weights, &stop, &mut watch)?;
        Ok(Surfaces { two_phase, exact, nasri, handles: handled.handles, handled: handled.refined, free })
    }

    /// A first refined mesh with the vertices of a fair one.
    pub fn with(&self, fair: &FairRefinement) -> Surface {
        self.two_phase.surface.with_positions(fair.points.clone())
    }
}

fn rows(surface: &Surface, found: &Surfaces, fairness: &FirstFairness, catmull_clark: Row) -> Vec<Row> {
    let first_face = found.two_phase.first_vertex_face;
    let row = |name, refined: &Surface, iterations, handles| {
        let (mesh, points) = (refined.mesh(), surface.positions());
        let normals = face_normals(mesh)[first_face..first_face + points.len()].to_vec();
        let off = |v: usize| {
            let face = mesh.faces.face(first_face + v);
            let centroid = face.iter().map(|&c| mesh.positions[c as usize]).sum::<DVec3>() / face.len() as f64;
            centroid.distance(points[v])
        };
        let error = (0..points.len()).map(off).fold(0.0, f64::max);
        Row { surface: name, iterations, energies: fairness.energies(refined.positions()), error, normals, handles }
    };
    let ends = |ends: (f64, f64, usize), &s: &f64| (ends.0.min(s), ends.1.max(s), ends.2 + usize::from(s <= 0.0));
    let handles = found.handles.iter().fold((f64::INFINITY, f64::NEG_INFINITY, 0), ends);
    let [handled, free] = [&found.handled, &found.free].map(|fair| (found.with(fair), Some(fair.report.iterations)));
    vec![
        row("two-phase", &found.two_phase.surface, None, None),
        row("two-phase, solved", &found.exact.surface, None, None),
        row("nasri", &found.nasri.surface, None, None),
        row("best handles", &handled.0, handled.1, Some(handles)),
        row("all freedom", &free.0, free.1, None),
        catmull_clark,
    ]
}

fn run(context: &mut Context) -> Result<()> {
    let models = if context.quick { &corpus::FREEDOM[..1] } else { &corpus::FREEDOM[..] };
    let weights = Weights::default();
    let mut measured: Vec<(Subject, Vec<Row>)> = Vec::new();
    for model in models {
        let subject = context.subject(model)?;
        let surface = &subject.surface;
        let fairness = FirstFairness::new(surface)?;
        let found = Surfaces::new(surface, &fairness, weights)?;
        let fair = fit(&Fairness::new(surface)?, surface.positions(), &ALL, weights)?;
        let mut normals = limit_normals(&fair.surface)?;
        normals.truncate(surface.len());
        let halstead = Row {
            surface: "halstead",
            iterations: Some(fair.report.iterations),
            energies: fair.energies,
            error: fair.errors.max,
            normals,
            handles: None,
        };
        let rows = rows(surface, &found, &fairness, halstead);
        if !context.quick && model.file == corpus::HAT.file {
            let framed = surface.positions();
            let shown = [
                ("(a) two-phase", doo_sabin_surface(&found.two_phase.surface)?),
                ("(b) best handles", doo_sabin_surface(&found.with(&found.handled))?),
                ("(c) all freedom", doo_sabin_surface(&found.with(&found.free))?),
                ("(d) halstead, Catmull-Clark", limit_surface(Refinement::CatmullClark, &fair.surface)?),
            ];
            let view = view(DVec3::Y, 25.0, 20.0);
            let panels =
                shown.into_iter().map(|(caption, mesh)| Picture::new(caption, view).surface(mesh).frame(framed));
            let title =
                format!("{}: surfaces through the same points, fairer from (a) to (c)", context.caption(&subject));
            context.figure(FREEDOM.id, &sheet(2, (200, 180), panels.collect()).headed(title))?;
        }
        measured.push((subject, rows));
    }
    let all = measured.iter().flat_map(|(subject, rows)| rows.iter().map(move |row| (subject, rows, row)));
    let free = |rows: &[Row]| rows.iter().find(|row| row.surface == "all freedom").map(|row| row.energies);
    let ratio = |(_, rows, row): &(&Subject, &Vec<Row>, &Row), of: fn(&Energies) -> f64| {
        free(rows).map(|least| of(&row.energies) / of(&least))
    };
    let deviation = |(_, rows, row): &(&Subject, &Vec<Row>, &Row)| {
        let fairest = rows.last().map_or(&[][..], |row| row.normals.as_slice());
        let angles = row.normals.iter().zip(fairest).map(|(a, b)| a.angle_between(*b).to_degrees());
        angles.sum::<f64>() / row.normals.len() as f64
    };
    let mut table = Columns::<(&Subject, &Vec<Row>, &Row)>::new()
        .col(Column::key("mesh"), |(subject, ..)| subject.name.clone())
        .col(Column::text("vertices"), |(subject, ..)| subject.surface.len())
        .col(Column::key("surface"), |(.., row)| row.surface)
        .col(Column::count("iterations"), |(.., row)| row.iterations)
        .col(Column::number("energy_ratio", 1e-4, 5), |at| ratio(at, |e| e.weighted(Weights::default())))
        .col(Column::number("thin_plate_ratio", 1e-4, 5), |at| ratio(at, |e| e.thin_plate))
        .col(Column::number("membrane_ratio", 1e-4, 5), |at| ratio(at, |e| e.membrane))
        .col(Column::number("normal_deviation_mean_degrees", 1e-3, 4), deviation)
        .col(Column::number("least_handle", 1e-4, 4), |(.., row)| row.handles.map(|h| h.0))
        .col(Column::number("largest_handle", 1e-4, 4), |(.., row)| row.handles.map(|h| h.1))
        .col(Column::count("handles_not_positive"), |(.., row)| row.handles.map(|h| h.2))
        .col(Column::number("max_error", 1e-4, 3).floor(1e-8), |(subject, _, row)| {
            row.error / subject.surface.diagonal()
        })
        .table(FREEDOM.id, FREEDOM.title, &all.collect::<Vec<_>>());
    table.note(
        "Energies of the limit surfaces, thin plate plus membrane, with the parameters of the mesh refined once by \
         Catmull-Clark; ratios are to the least by Doo-Sabin with all freedom. `two-phase` is as in the paper (five sweeps \
         at most), `solved` with its system solved, `nasri` an ordinary first step after Nasri's system; `best handles` \
         scales each face of the two-phase mesh about its point by the number that makes the whole surface fairest; \
         `all freedom` moves all corners of the first refined mesh that leave the points where they are. `halstead` is the \
         fairest Catmull-Clark surface, whose normals at the points the others are compared with. Iterations are \
         conjugate gradients to 10⁻¹⁰ of the diagonal. `max_error` is relative to the diagonal.",
    );
    context.table(table)?;
    growth(context)
}

/// Vertices of growing meshes; the first in quick runs too.
const SIZES: [usize; 4] = [1000, 4000, 16_000, 64_000];

/// Iterations on meshes of one kind.
fn growth(context: &mut Context) -> Result<()> {
    let sizes = if context.quick { &SIZES[..1] } else { &SIZES[..] };
    let weights = Weights::default();
    let mut rows: Vec<(Subject, [usize; 3])> = Vec::new();
    for size in sizes {
        let subject = context.stand_in(&format!("irregular-quad:{size}"))?;
        let surface = &subject.surface;
        let (points, first) = (surface.positions(), interpolate(surface, &ALL, &PhaseOne::default())?.first.surface);
        let stop = Stop { tolerance: TOLERANCE * surface.diagonal(), max_iterations: 10_000 };
        let mut watch = |_: &Step| ControlFlow::Continue(());
        let fairness = FirstFairness::new(surface)?;
        let handled = fair_handles(&fairness, first.positions(), points, &ALL, weights, &stop, &mut watch)?.refined;
        let free = fairest(&fairness, first.positions(), points, &ALL, weights, &stop, &mut watch)?;
        let way = Solver::Iterations;
        let halstead = fit_watched(&Fairness::new(surface)?, points, &ALL, weights, way, &stop, &mut watch)?.found()?;
        let iterations = [handled.report, free.report, halstead.report].map(|report| report.iterations);
        rows.push((subject, iterations));
    }
    let mut table = Columns::<(Subject, [usize; 3])>::new()
        .col(Column::key("mesh"), |(subject, _)| subject.name.clone())
        .col(Column::text("vertices"), |(subject, _)| subject.surface.len())
        .col(Column::count("best_handles"), |(_, iterations)| iterations[0])
        .col(Column::count("all_freedom"), |(_, iterations)| iterations[1])
        .col(Column::count("halstead"), |(_, iterations)| iterations[2])
        .table(format!("{}--growth", FREEDOM.id), "Iterations to the fairest surface over the size of the mesh", &rows);
    table.note(
        "Built-in meshes with noise, whatever the others are. Conjugate gradients to 10⁻¹⁰ of the diagonal: by the best \
         handles, all freedom of the first refined mesh, and the fairest Catmull-Clark surface.",
    );
    context.table(table)
}
