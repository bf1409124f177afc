//! Line preconditioner on quad meshes: iterations, estimated time, and whether it pays.

use glam::DVec3;

use crate::cli::STAND_IN_NOISE;
use crate::report::{Column, Columns};
use limitlab::Result;
use limitlab::analysis::line_preconditioner::{Count, LinePreconditioner, Regularity, count};
use limitlab::assemble::LimitSystem;
use limitlab::interpolate::interpolate;
use limitlab::mesh::noise::move_vertices;
use limitlab::schemes::{Refinement, Scheme};
use limitlab::solvers::Stop;

use crate::programs::reproduce::context::{Context, Item, Question, Subject};
use crate::programs::reproduce::corpus;

pub const LINES: Item = Item {
    id: "lines",
    title: "Line solves along edge loops as a preconditioner for Catmull-Clark",
    question: Some(Question {
        asks: "Does a preconditioner made for regular quads pay?",
        answer: "In iterations, not in time: finding its chains, and its solves around irregular vertices, cost more \
                 than the iterations that they save.",
    }),
    run,
};

/// Vertices of the largest mesh of a quick run.
const QUICK: usize = 6000;
/// Relative to the diagonal of the bounding box.
const TOLERANCE: f64 = 1e-10;
const LIMIT: usize = 1000;

/// Nanoseconds a vertex at 10⁶ vertices on two threads, as measured on the machine of the report `scaling`.
mod cost {
    /// Of `auto`: what precedes its iterations; one iteration with its share of what surrounds them.
    pub const SETUP: f64 = 130.0;
    pub const ITERATION: f64 = 3.6;
    /// To find the chains, in the order of `auto`.
    pub const CHAINS: f64 = 80.0;
    /// The differences e = P − A V in double precision.
    pub const RESIDUAL: f64 = 5.0;
    /// B e in single precision, and the update of V.
    pub const LINES: f64 = 24.0;
    /// The same in the best order seen, the rows of a torus.
    pub const LINES_AT_BEST: f64 = 16.0;
    /// To invert the matrix of a star; to solve on it before and after the lines.
    pub const STAR: f64 = 11_000.0;
    pub const RELAX: f64 = 1_800.0;
}

/// A refined mesh and the runs on it.
struct Row<'a> {
    subject: &'a Subject,
    levels: usize,
    regularity: Regularity,
    /// Conjugate gradients preconditioned by H, and by line solves.
    plain: Count,
    lines: Count,
    /// Iterations of `auto`.
    auto: usize,
}

impl<'a> Row<'a> {
    fn new(subject: &'a Subject, levels: usize) -> Result<Self> {
        let mut surface = Refinement::CatmullClark.refined_n(&subject.surface, levels)?;
        move_vertices(&mut surface, STAND_IN_NOISE.amplitude, STAND_IN_NOISE.seed);
        let system = LimitSystem::new(&surface, Scheme::CatmullClark)?;
        let stop = Stop { tolerance: TOLERANCE * surface.diagonal(), max_iterations: LIMIT };
        let points = surface.positions();
        let regularity = Regularity::new(&surface);
        let preconditioner = LinePreconditioner::new(&system, &regularity)?;
        let scaled = |r: &[DVec3]| r.iter().zip(&system.h).map(|(r, h)| *r * *h).collect();
        let plain = count(&system, points, &stop, scaled)?;
        let lines = count(&system, points, &stop, |r| preconditioner.apply(r))?;
        let auto = interpolate(&surface, Scheme::CatmullClark, &stop.into())?.report.iterations;
        Ok(Row { subject, levels, regularity, plain, lines, auto })
    }

    /// The time of `auto` over that of the preconditioned iteration.
    fn time_ratio(&self) -> f64 {
        let stars = |each: f64| (1.0 - self.regularity.share()) * each;
        let one = cost::RESIDUAL + cost::LINES + stars(cost::RELAX);
        let setup = cost::SETUP + cost::CHAINS + stars(cost::STAR);
        let auto = cost::SETUP + self.auto as f64 * cost::ITERATION;
        auto / (setup + self.lines.iterations as f64 * one + cost::RESIDUAL)
    }
}

fn run(context: &mut Context) -> Result<()> {
    let subjects = if context.real() {
        context.list(&corpus::LINES)?
    } else {
        // As they are: the noise comes after the refinements.
        let built_in = corpus::LINES.built_in.iter();
        built_in.map(|&(name, levels)| Ok((Subject::built_in(name)?, levels))).collect::<Result<_>>()?
    };
    let rows: Vec<Row> = subjects
        .iter()
        // Every refinement makes four vertices of one, but for a few.
        .filter(|(subject, levels)| !context.quick || subject.surface.len() << (2 * levels) <= QUICK)
        .map(|(subject, levels)| Row::new(subject, *levels))
        .collect::<Result<_>>()?;
    let mut table = Columns::<Row>::new()
        .col(Column::key("mesh"), |r| r.subject.name.clone())
        .col(Column::key("refined"), |r| r.levels.to_string())
        .col(Column::text("vertices"), |r| r.regularity.regular.len())
        .col(Column::number("regular", 1e-9, 4), |r| r.regularity.share())
        .col(Column::number("mean_chain", 1e-9, 3), |r| r.regularity.mean_chain())
        .col(Column::number("kappa", 0.01, 4), |r| r.plain.kappa)
        .col(Column::number("kappa_lines", 0.01, 4), |r| r.lines.kappa)
        .col(Column::count("auto_iterations"), |r| r.auto)
        .col(Column::count("lines_iterations"), |r| r.lines.iterations)
        .col(Column::number("time_ratio", 0.1, 3), Row::time_ratio)
        .table(LINES.id, LINES.title, &rows);
    table.note(format!(
        "`regular`: share of vertices of valence 4 among quads. Chains of edges go straight through them; `mean_chain` \
         counts the regular vertices on one. `lines` solves with tridiag(1, 4, 1) along every chain, then across, \
         symmetrised, between exact solves on the two rings around each irregular vertex: the inverse of the matrix on \
         a regular torus. `kappa` is that of A, and of the preconditioned matrix, as conjugate gradients saw it; \
         iterations are those of `auto` and of preconditioned conjugate gradients to {TOLERANCE:e} of the bounding \
         box's diagonal. Noise {STAND_IN_NOISE} on every mesh, after refinement."
    ));
    table.note(format!(
        "`time_ratio` estimates, for 10⁶ vertices as regular as these and two threads, the time of `auto` over that of \
         `lines`, from faces to control points: ({s} + {i} k) / ({s} + {c} + {q} σ + {r} + m ({r} + {l} + {x} σ)) with \
         k and m the two numbers of iterations, σ = 1 − regular; measured nanoseconds a vertex: {s} for incidence, order \
         and operator, {i} for an iteration of `auto`, {c} for finding the chains, {r} for a residual, {l} for the line \
         solves in single precision and an update, {q} and {x} per irregular vertex for inverting and applying \
         its star.",
        s = cost::SETUP,
        i = cost::ITERATION,
        c = cost::CHAINS,
        r = cost::RESIDUAL,
        l = cost::LINES,
        q = cost::STAR,
        x = cost::RELAX,
    ));
    table.note(format!(
        "Verdict: it wins in iterations, ten to one, and not in time: `auto` spends more than half of its time before its \
         first iteration, finding the chains comes on top of that, and every irregular vertex costs its star. With \
         chains for nothing, no irregular vertex, line solves at the {best} ns of the rows of a torus, two \
         iterations instead of 28 of `auto` would make the ratio {:.2}.",
        (cost::SETUP + 28.0 * cost::ITERATION)
            / (cost::SETUP + 2.0 * (cost::RESIDUAL + cost::LINES_AT_BEST) + cost::RESIDUAL),
        best = cost::LINES_AT_BEST,
    ));
    context.table(table)
}
