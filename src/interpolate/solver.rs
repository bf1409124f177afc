//! Interpolation by limit surfaces: the control mesh whose limit surface passes through the vertices of a given one.
//!
//! [`interpolate`] does it once, [`Interpolator`] again and again for points that move. Unless a method is asked for,
//! both follow one chain, `auto`:
//!
//! 1. [Chebyshev in single precision with double-precision corrections](crate::solvers::mixed) on the [matrix-free
//!    operator](Operator). It needs no inner products, its iterations share passes over memory, and it moves half the
//!    bytes. The interval starts at what λ_min usually is, or at the proven bound where that is higher; a correction that
//!    gains less than promised stretches it, down to the proven bound at the most. Others let the recurrence go on.
//! 2. Where that makes no progress (λ_min below 10⁻⁴, a singular matrix), conjugate gradients on the same operator from
//!    V = P: their count grows with √κ only, and they need no interval.
//! 3. Where these make none either, and the points have no part that no control mesh reaches, LDLᵀ: a factorization tells
//!    a nearly singular matrix from a singular one.
//!
//! *Order.* A large mesh whose vertices lie [scattered](crate::mesh::space_filling::is_scattered) in memory has been
//! renumbered along a space-filling curve by [`Surface`]. From [`ORDERED`] vertices on, the rows of the operator are [breadth
//! first](breadth_first::in_fronts), which gives it the narrow band that groups of iterations need. Below, all arrays stay
//! in cache in any order, and rows are [grouped by kind](breadth_first::in_kinds) only; so they are for mixed faces under
//! Nasri and Zheng-Cai, where iterations are too few to pay for the search, and in files whose own order keeps to a band as
//! narrow. Results come back in the order of the surface.
//!
//! *Boundaries, creases, some vertices only.* What is known before is computed first, as in [`Stages`]: curves exactly, and
//! V_j = P_j at corners and at vertices that are not interpolated. From these, and P at all others, the unknown is a
//! difference X, zero where V is known: the rows there are fixed, and A_SS X_S = (P − A V)_S is solved by the same chain.
//!
//! *Darts and semi-sharp vertices.* Their rows are not those of H·M. They are held while the others are solved for, and moved by
//! GMRES on what is left of A at them, a solution of the others for each product; LU of all takes the place of LDLᵀ. Methods by
//! name that need no symmetry run on all of A, all vertices at once, in any order. Curves are not solved before: whatever the
//! order, the iterations of the curves stay among themselves and converge at least as fast as 2/3 under PIA, so that an exact
//! start saves next to nothing; and one matrix has one predicted rate.
//!
//! Direct methods lose at every size tried, by `reports/scaling.md`.

use std::ops::ControlFlow;
use std::time::Instant;

use glam::DVec3;

use super::staged;
use crate::analysis::comparison::with_spectrum;
use crate::analysis::complex_spectrum::ComplexSpectrum;
use crate::analysis::failed::Failed;
use crate::analysis::spectrum::spectrum;
use crate::assemble::curves::Curves;
use crate::assemble::stages::free;
use crate::assemble::stars::StarRows;
use crate::assemble::{LimitSystem, Operator, RowOrder, Stages};
use crate::error::{Error, Result};
use crate::memory::require;
#[cfg(doc)]
use crate::mesh::breadth_first;
use crate::mesh::features::Features;
use crate::mesh::order::Numbering;
use crate::mesh::{Faces, Mesh, Surface, diagonal};
use crate::parallel;
use crate::schemes::Scheme;
use crate::solvers::conjugate_gradient::{ConjugateGradient, Preconditioner};
use crate::solvers::gmres::gmres;
use crate::solvers::iteration::{largest, solve_in_scale};
use crate::solvers::mixed::{self, Workspace};
use crate::solvers::system::Rows;
use crate::solvers::{Errors, Iterate, Method, Outcome, Recorded, Report, Solution, Step, Stop, run_watched};

/// From this many vertices on, the rows of the operator are breadth first. Tuned.
pub const ORDERED: usize = 200_000;
/// From this usual λ_min on (Nasri's), a score of iterations suffice, and on mixed faces that order does not pay. Tuned.
const FEW: f64 = 0.25;

/// How near the limit points have to come.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Tolerance {
    /// In parts of the diagonal of the bounding box.
    Relative(f64),
    /// In the units of the points.
    Absolute(f64),
}

/// What is asked of [`interpolate`]. `Options::default()` is `auto` for all vertices, to 10⁻¹⁰ of the diagonal.
///
/// ```
/// use limitlab::interpolate::{Options, Tolerance};
/// use limitlab::solvers::Method;
/// let options = Options { method: Some(Method::Cg), tolerance: Tolerance::Absolute(1e-6), ..Options::default() };
/// assert_eq!(options.max_iterations, 10_000);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options<'a> {
    /// `auto` unless one is named; open parameters come from the spectrum.
    pub method: Option<Method<'a>>,
    /// max_i ‖p_i − (A v)_i‖₂ at the end.
    pub tolerance: Tolerance,
    /// The most iterations of each method that is tried.
    pub max_iterations: usize,
    /// One mark a vertex: those interpolated. The other control points stay at their points. All unless told.
    pub interpolated: Option<&'a [bool]>,
}

impl Default for Options<'_> {
    fn default() -> Self {
        let tolerance = Tolerance::Relative(1e-10);
        Options { method: None, tolerance, max_iterations: 10_000, interpolated: None }
    }
}

impl From<Stop> for Options<'_> {
    fn from(stop: Stop) -> Self {
        let Stop { tolerance, max_iterations } = stop;
        Options { tolerance: Tolerance::Absolute(tolerance), max_iterations, ..Options::default() }
    }
}

impl Options<'_> {
    /// The stopping rule on these points.
    ///
    /// # Errors
    /// A relative tolerance where all points coincide.
    pub fn stop(&self, points: &[DVec3]) -> Result<Stop> {
        let tolerance = match self.tolerance {
            Tolerance::Absolute(tolerance) => tolerance,
            Tolerance::Relative(part) => match diagonal(points) {
                extent if extent > 0.0 => part * extent,
                _ => {
                    let what =
                        "all points coincide, so no tolerance can be relative to their extent: give an absolute one";
                    return Err(Error::Computation(what.into()));
                }
            },
        };
        Ok(Stop { tolerance, max_iterations: self.max_iterations })
    }
}

/// Solves `A V = P` for the vertices P of a surface. How the run ended is in the solution's report: a run that did not
/// converge is no error.
///
/// # Errors
/// Faces or a boundary that the scheme is not defined on; memory; no vertex to interpolate; those of
/// [`Options::stop`] and [`with_spectrum`].
///
/// # Panics
/// If there is not one mark a vertex.
///
/// ```
/// use limitlab::interpolate::{Options, interpolate};
/// use limitlab::mesh::{Surface, builtin};
/// use limitlab::schemes::Scheme;
/// use limitlab::solvers::Outcome;
///
/// let surface = Surface::new(builtin::builtin("quad-sphere:3")?)?;
/// let found = interpolate(&surface, Scheme::CatmullClark, &Options::default())?;
/// assert_eq!((found.report.outcome, found.method), (Outcome::Converged, "chebyshev"));
/// let control = surface.with_positions(found.points);
/// let limits = Scheme::CatmullClark.refinement().limit_positions(&control)?;
/// assert!(limits[7].distance(surface.positions()[7]) < 1e-9);
/// # Ok::<(), limitlab::Error>(())
/// ```
pub fn interpolate(surface: &Surface, scheme: Scheme, options: &Options) -> Result<Solution> {
    interpolate_watched(surface, scheme, options, &mut unwatched)
}

/// Sees iterates, each with the name of the method that is at work, and says whether to go on: one that stops a method
/// ends the run.
pub type Watch<'w> = dyn FnMut(&'static str, &Step) -> ControlFlow<()> + Send + 'w;

/// The watch of who does not look.
pub(super) fn unwatched(_: &'static str, _: &Step) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

/// As [`interpolate`], with a watch. Of a method that is named it sees every iterate: all vertices, or those of the
/// [block](Stages::block). Of `auto` it sees the iterates whose errors are known, in the order of the
/// operator's rows, and where some vertices are known, the difference X.
///
/// # Errors
/// As [`interpolate`].
///
/// # Panics
/// As [`interpolate`].
pub fn interpolate_watched(
    surface: &Surface,
    scheme: Scheme,
    options: &Options,
    watch: &mut Watch,
) -> Result<Solution> {
    let stop = options.stop(surface.positions())?;
    let marks = options.interpolated;
    if let Some(method) = options.method {
        return by_method(surface, scheme, marks, method, &stop, watch);
    }
    require_memory(surface.mesh())?;
    let start = Instant::now();
    let mut interpolator = Interpolator::new(surface, scheme, marks)?;
    let setup_seconds = start.elapsed().as_secs_f64();
    let start = Instant::now();
    let mut points = Vec::new();
    let (method, report) = interpolator.solve_into(surface.positions(), &mut points, &stop, watch);
    let solve_seconds = start.elapsed().as_secs_f64();
    let found = Solution { points, method, report, setup_seconds, solve_seconds, fill: None };
    let unreachable = || Failed::new((surface, scheme), marks, false, &found.report, &stop).unreachable().is_some();
    if !no_progress(found.report.outcome) || unreachable() {
        return Ok(found);
    }
    drop(interpolator);
    let unsymmetric = surface.features().is_some_and(Features::has_stars);
    let last = if unsymmetric { Method::Lu } else { Method::Ldlt };
    let direct = by_method(surface, scheme, marks, last, &stop, watch)?;
    Ok(Solution { setup_seconds: setup_seconds + solve_seconds + direct.setup_seconds, ..direct })
}

/// The limit points A V of control points, the vertices of a surface: by the rows of its curves, corners, and smooth
/// vertices, without a stored matrix. O(corners).
///
/// # Errors
/// As [`Interpolator::new`].
///
/// ```
/// use limitlab::interpolate::limit_points;
/// use limitlab::mesh::{Surface, builtin};
/// use limitlab::schemes::Scheme;
/// // β₃ = 2/5 at the vertex itself, 1/5 at each of its neighbours, and these four points add up to 0.
/// let tetrahedron = Surface::new(builtin::builtin("tetrahedron")?)?;
/// let limits = limit_points(&tetrahedron, Scheme::Loop)?;
/// assert!(limits[0].distance(0.2 * tetrahedron.positions()[0]) < 1e-15);
/// # Ok::<(), limitlab::Error>(())
/// ```
pub fn limit_points(surface: &Surface, scheme: Scheme) -> Result<Vec<DVec3>> {
    let control = surface.positions();
    let free = free(surface, None)?;
    let there = |points: &[DVec3]| surface.renumbered().map(|inside| inside.numbering.there(points));
    let marks = match (surface.renumbered(), &free) {
        (Some(inside), Some(marks)) => Some(inside.numbering.there(marks)),
        (_, marks) => marks.clone(),
    };
    let (operator, _) = Operator::inside(surface, scheme, RowOrder::Given(None), marks.as_deref())?;
    let points = there(control);
    let points = points.as_deref().unwrap_or(control);
    let mut limits = vec![DVec3::ZERO; control.len()];
    let mut nothing = vec![(); control.len()];
    Rows::new(control.len()).product(&operator, points, &mut limits, &mut nothing, |_, ax, limit, (), _| *limit = ax);
    if let Some(inside) = surface.renumbered() {
        limits = inside.numbering.back(&limits);
    }
    if let Some(free) = free {
        for (limit, (free, &v)) in limits.iter_mut().zip(free.iter().zip(control)) {
            if !free {
                *limit = v;
            }
        }
        let curves = Curves::new(surface, scheme, None)?;
        curves.rows(|v, w, [a, b]| limits[v] = (1.0 - 2.0 * w) * control[v] + w * (control[a] + control[b]));
        if let Some(stars) = StarRows::new(surface, scheme, None)? {
            for (&v, limit) in stars.vertices().iter().zip(stars.product(control)) {
                limits[v as usize] = limit;
            }
        }
    }
    Ok(limits)
}

/// The last two steps of the chain on a stored system of any origin: conjugate gradients, LDLᵀ where they make no progress.
/// The watch sees every iterate.
///
/// # Panics
/// If there is not one point a vertex.
pub fn solve_stored(system: &LimitSystem, points: &[DVec3], stop: &Stop, watch: &mut Watch) -> Solution {
    let mut by = |method: Method| run_watched(system, points, method, stop, &mut |step| watch(method.name(), step));
    let found = by(Method::Cg);
    if no_progress(found.report.outcome) { by(Method::Ldlt) } else { found }
}

/// Whether an iteration ended without getting nearer.
fn no_progress(outcome: Outcome) -> bool {
    matches!(outcome, Outcome::Stagnated | Outcome::Diverged | Outcome::Breakdown)
}

/// By one method on the stored matrix; the order of a sweep is one of all vertices.
fn by_method(
    surface: &Surface,
    scheme: Scheme,
    marks: Option<&[bool]>,
    method: Method,
    stop: &Stop,
    watch: &mut Watch,
) -> Result<Solution> {
    let start = Instant::now();
    let watch = &mut |step: &Step| watch(method.name(), step);
    let stages = Stages::new(surface, scheme, marks)?;
    if let Some(stars) = stages.stars() {
        if method.needs_symmetry() {
            return Err(method.refused_at(stars.vertices()[0] as usize));
        }
        let system = stages.whole();
        let method = with_spectrum(&system, method, &|| ComplexSpectrum::new(&system))?;
        let seconds = start.elapsed().as_secs_f64();
        let mut solution = run_watched(&system, surface.positions(), method, stop, watch);
        solution.setup_seconds += seconds;
        return Ok(solution);
    }
    let order = method.order().map(|order| stages.order(order));
    let block = stages.block();
    let method = with_spectrum(block, method.in_order(order.as_deref()), &|| spectrum(block))?;
    let seconds = start.elapsed().as_secs_f64();
    let mut solution = staged::run_watched(&stages, surface.positions(), method, stop, watch);
    solution.setup_seconds += seconds;
    Ok(solution)
}

/// Refuses a mesh whose topology, operator and iterates memory has no room for. The numbers are measured.
///
/// # Errors
/// [`Error::Memory`].
pub fn require_memory(mesh: &Mesh) -> Result<()> {
    let corners = mesh.faces.corners().len();
    // Lists of neighbours, where faces are not all of one size.
    let mixed = if mesh.faces.uniform_size().is_none() { 24 } else { 0 };
    let bytes = 64 * mesh.len() as u64 + (32 + mixed) * corners as u64;
    require(bytes, || format!("the work on {} vertices and {corners} corners", mesh.len()), "use a smaller mesh")
}

/// Whether the vertices of each face lie as near to each other as breadth first, whose fronts are some 4 √N wide: files
/// written slice by slice, or front by front. Ends at the first face where they do not.
fn is_narrow(faces: &Faces, n: usize) -> bool {
    const WIDTH: f64 = 8.0;
    let width = (WIDTH * (n as f64).sqrt()) as u32;
    parallel::all(faces.len(), |f| {
        let ends = faces.face(f).iter().fold((u32::MAX, 0), |(low, high), &v| (low.min(v), high.max(v)));
        ends.1.saturating_sub(ends.0) <= width
    })
}

/// Interpolation for points that move: the operator, the order of its rows and all arrays are kept from one set of points
/// to the next. Where points move smoothly, the nearest start is the last control mesh moved as they were,
/// V + P − P_before: the error is then (A − I)(P − P_before), by which A hardly changes smooth points.
///
/// ```
/// use limitlab::interpolate::Interpolator;
/// use limitlab::mesh::{Surface, builtin};
/// use limitlab::schemes::Scheme;
/// use limitlab::solvers::{Outcome, Stop};
///
/// let surface = Surface::new(builtin::builtin("icosphere:3")?)?;
/// let mut interpolator = Interpolator::new(&surface, Scheme::Loop, None)?;
/// let stop = Stop { tolerance: 1e-10, max_iterations: 1000 };
/// let mut points = surface.positions().to_vec();
/// let mut control = Vec::new();
/// let cold = interpolator.solve(&points, &mut control, &stop);
/// // A point moves: on from the control points that are there.
/// points[5] *= 1.01;
/// let warm = interpolator.solve(&points, &mut control, &stop);
/// assert!(cold.outcome == Outcome::Converged && warm.outcome == Outcome::Converged);
/// assert!(warm.iterations < cold.iterations);
/// # Ok::<(), limitlab::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Interpolator {
    operator: Operator,
    /// The order of the rows, where that is not the surface's.
    numbering: Option<Numbering>,
    /// What is solved first.
    curves: Curves,
    /// What is solved with the block, and not by its operator.
    stars: Option<StarRows>,
    /// By row: those of the block, where some are not.
    free: Option<Vec<bool>>,
    rows: Rows,
    workspace: Workspace,
    /// What is known before the block, in the order of the surface; only where there are curves.
    known: Vec<DVec3>,
    /// In the order of the rows, as far as they are needed: P, what A X has to be on the block, and the iterate.
    points: Vec<DVec3>,
    right: Vec<DVec3>,
    iterate: Vec<DVec3>,
}

impl Interpolator {
    /// For the faces of a surface, and all of its vertices or those marked. O(corners).
    ///
    /// # Errors
    /// As [`Operator::new`]; no vertex marked.
    ///
    /// # Panics
    /// If there is not one mark a vertex.
    pub fn new(surface: &Surface, scheme: Scheme, interpolated: Option<&[bool]>) -> Result<Self> {
        let free = free(surface, interpolated)?;
        let faces = surface.renumbered().map_or(surface.faces(), |inside| &inside.faces);
        // Among mixed faces the search costs twice as much.
        let few = scheme.usual_lambda_min() >= FEW && faces.uniform_size().is_none();
        let is_ordered = surface.len() >= ORDERED && !few && !is_narrow(faces, surface.len());
        let order = if is_ordered { RowOrder::Fronts } else { RowOrder::Kinds };
        let marks = match (surface.renumbered(), free) {
            (Some(inside), Some(marks)) => Some(inside.numbering.there(&marks)),
            (_, marks) => marks,
        };
        let (operator, rows) = Operator::inside(surface, scheme, order, marks.as_deref())?;
        let free = marks.map(|marks| rows.as_ref().map_or(marks.clone(), |rows| rows.there(&marks)));
        let numbering = match (surface.renumbered(), rows) {
            (Some(inside), Some(rows)) => Some(Numbering::new(rows.there(inside.numbering.order()))),
            (Some(inside), None) => Some(inside.numbering.clone()),
            (None, rows) => rows,
        };
        let workspace = Workspace::new(&operator);
        let [known, points, right, iterate] = [const { Vec::new() }; 4];
        Ok(Interpolator {
            curves: Curves::new(surface, scheme, interpolated)?,
            stars: StarRows::new(surface, scheme, interpolated)?,
            rows: Rows::new(surface.len()),
            operator,
            numbering,
            free,
            workspace,
            known,
            points,
            right,
            iterate,
        })
    }

    /// Solves `A V = P`, by the first two steps of the chain, for P = `points` from V = `control`, which becomes the
    /// solution; one that is empty, or holds what is not finite, stands for V = P. From the second set of points on no array of N points is allocated, unless
    /// the second step is needed.
    ///
    /// # Panics
    /// If there is not one point a vertex in both.
    pub fn solve(&mut self, points: &[DVec3], control: &mut Vec<DVec3>, stop: &Stop) -> Report {
        self.solve_watched(points, control, stop, &mut unwatched).1
    }

    /// As [`solve`](Self::solve), watched as [`interpolate_watched`] is; also the name of the method that came to the end.
    ///
    /// # Panics
    /// As [`solve`](Self::solve).
    pub fn solve_watched(
        &mut self,
        points: &[DVec3],
        control: &mut Vec<DVec3>,
        stop: &Stop,
        watch: &mut Watch,
    ) -> (&'static str, Report) {
        // What a failed solution left is no start.
        if !parallel::all(control.len(), |v| control[v].is_finite()) {
            control.clear();
        }
        self.solve_into(points, control, stop, watch)
    }

    fn solve_into(
        &mut self,
        points: &[DVec3],
        control: &mut Vec<DVec3>,
        stop: &Stop,
        watch: &mut Watch,
    ) -> (&'static str, Report) {
        match self.stars.take() {
            None => self.solve_block(points, control, stop, watch),
            Some(stars) => {
                let found = self.solve_with(&stars, points, control, stop, watch);
                self.stars = Some(stars);
                found
            }
        }
    }

    /// With darts and semi-sharp vertices D beside the smooth ones S: `(A_DD − A_DS A_SS⁻¹ A_SD) V_D` is known by a solution
    /// on S for each product, and V_D is found by GMRES. The watch sees all vertices at the end of each round. All iterations
    /// on S count, and what is left of the most that are allowed is all that a solution may take.
    fn solve_with(
        &mut self,
        stars: &StarRows,
        points: &[DVec3],
        control: &mut Vec<DVec3>,
        stop: &Stop,
        watch: &mut Watch,
    ) -> (&'static str, Report) {
        /// What the solutions on S are asked for, in parts of what is needed.
        const PART: f64 = 0.1;
        /// Relative to a direction of GMRES.
        const DIRECTION: f64 = 1e-12;
        const PRODUCTS: usize = 300;
        /// Rounds of GMRES: the second corrects what the directions' solutions have left.
        const ROUNDS: usize = 4;
        let at = |values: &[DVec3]| -> Vec<DVec3> { stars.vertices().iter().map(|&v| values[v as usize]).collect() };
        let wanted = at(points);
        let mut held = points.to_vec();
        if !control.is_empty() {
            stars.vertices().iter().for_each(|&v| held[v as usize] = control[v as usize]);
        }
        let within =
            |tolerance: f64, made: usize| Stop { tolerance, max_iterations: stop.max_iterations.saturating_sub(made) };
        let mut history = Vec::new();
        let mut iterations = 0;
        let smooth = self.free.as_ref().map_or(points.len(), |free| free.iter().filter(|free| **free).count());
        let count = (smooth + wanted.len()) as f64;
        let mut round = 0;
        loop {
            let inner = within(PART * stop.tolerance, iterations);
            let (method, found) = self.solve_block(&held, control, &inner, &mut unwatched);
            iterations += found.iterations;
            let residual: Vec<DVec3> = wanted.iter().zip(stars.product(control)).map(|(&p, ax)| p - ax).collect();
            let mut errors = found.last();
            errors.mean = (smooth as f64 * errors.mean + residual.iter().map(|r| r.length()).sum::<f64>()) / count;
            errors.max =
                residual.iter().map(|r| r.length()).fold(errors.max, |a, b| if b > a || b.is_nan() { b } else { a });
            history.push(Recorded { iteration: iterations, errors });
            let told = watch(method, &Step { iteration: iterations, errors, points: control });
            let reached = stop.reached(errors.max, largest(points));
            let is_over = iterations >= stop.max_iterations;
            if reached.is_some() || no_progress(found.outcome) || told.is_break() || is_over || round == ROUNDS {
                // Short of the part of the tolerance that the block was asked for, it may be met.
                let outcome = match (reached, found.outcome) {
                    (Some(reached), _) => reached,
                    (None, Outcome::Converged | Outcome::Rounding) if told.is_break() => Outcome::Stopped,
                    (None, Outcome::Converged | Outcome::Rounding) if is_over => Outcome::MaxIterations,
                    (None, Outcome::Converged | Outcome::Rounding) => Outcome::Stagnated,
                    (None, other) => other,
                };
                let detail = found.detail.filter(|_| reached.is_none());
                return (method, Report { outcome, iterations, history, detail });
            }
            let mut moved = Vec::new();
            let solved = gmres(
                |direction| {
                    let mut held = vec![DVec3::ZERO; points.len()];
                    for (&v, &x) in stars.vertices().iter().zip(direction) {
                        held[v as usize] = x;
                    }
                    moved.clear();
                    let inner = within(DIRECTION, iterations);
                    let (_, found) = self.solve_block(&held, &mut moved, &inner, &mut unwatched);
                    iterations += found.iterations;
                    let error = found.last().max;
                    let is_rough = error.is_nan() || error > DIRECTION.sqrt();
                    if (no_progress(found.outcome) || found.outcome == Outcome::MaxIterations) && is_rough {
                        return Err(());
                    }
                    Ok(stars.product(&moved))
                },
                &residual,
                PART * stop.tolerance / errors.max,
                PRODUCTS,
            );
            if let Ok(solved) = solved {
                for (&v, &x) in stars.vertices().iter().zip(&solved.solution) {
                    held[v as usize] += x;
                }
            }
            round += 1;
        }
    }

    /// The smooth vertices, all others held.
    fn solve_block(
        &mut self,
        points: &[DVec3],
        control: &mut Vec<DVec3>,
        stop: &Stop,
        watch: &mut Watch,
    ) -> (&'static str, Report) {
        let n = self.operator.len();
        assert!(points.len() == n && (control.is_empty() || control.len() == n), "one point a vertex");
        let cold = control.is_empty();
        if self.numbering.is_none() && self.free.is_none() {
            return chain(&self.operator, points, 0.0, control, &mut self.workspace, stop, watch);
        }
        let points: &[DVec3] = match self.curves.is_empty() {
            true => points,
            false => {
                self.known.clear();
                self.known.extend_from_slice(points);
                self.curves.solve(&mut self.known);
                &self.known
            }
        };
        let points: &[DVec3] = match &self.numbering {
            Some(numbering) => {
                match self.points.len() == n {
                    true => numbering.there_into(points, &mut self.points),
                    false => self.points = numbering.there(points),
                }
                &self.points
            }
            None => points,
        };
        match &self.numbering {
            // The unknown is a difference then.
            _ if cold && self.free.is_some() => {
                self.iterate.clear();
                self.iterate.resize(n, DVec3::ZERO);
            }
            _ if cold => self.iterate.clear(),
            Some(numbering) => {
                self.iterate.resize(n, DVec3::ZERO);
                numbering.there_into(control, &mut self.iterate);
            }
            None => self.iterate.clone_from(control),
        }
        let (method, report) = match &self.free {
            None => chain(&self.operator, points, 0.0, &mut self.iterate, &mut self.workspace, stop, watch),
            Some(free) => {
                // The mean is that of the vertices in question.
                let share = n as f64 / free.iter().filter(|free| **free).count().max(1) as f64;
                let of_block = |errors: Errors| Errors { mean: share * errors.mean, ..errors };
                let watch = &mut |method: &'static str, step: &Step| {
                    watch(method, &Step { errors: of_block(step.errors), ..*step })
                };
                self.right.resize(n, DVec3::ZERO);
                self.rows.residual(&self.operator, points, points, &mut self.right, |i, e, right, _| {
                    *right = if free[i] { e } else { DVec3::ZERO };
                });
                if !cold {
                    parallel::change(&mut self.iterate, |i, x| *x = if free[i] { *x - points[i] } else { DVec3::ZERO });
                }
                let size = largest(points);
                let (operator, right, workspace) = (&self.operator, &self.right, &mut self.workspace);
                let (method, mut report) = chain(operator, right, size, &mut self.iterate, workspace, stop, watch);
                parallel::change(&mut self.iterate, |i, x| *x += points[i]);
                report.history.iter_mut().for_each(|recorded| recorded.errors = of_block(recorded.errors));
                (method, report)
            }
        };
        match &self.numbering {
            Some(numbering) => {
                if cold {
                    // Memory that is there already: fresh pages cost more than the copy.
                    *control = std::mem::take(&mut self.points);
                }
                numbering.back_into(&self.iterate, control);
            }
            None => control.clone_from(&self.iterate),
        }
        (method, report)
    }
}

/// The first two steps, for points that are differences of data of a `size`, or 0 for data themselves.
fn chain(
    operator: &Operator,
    points: &[DVec3],
    size: f64,
    control: &mut Vec<DVec3>,
    workspace: &mut Workspace,
    stop: &Stop,
    watch: &mut Watch,
) -> (&'static str, Report) {
    let by_mixed = &mut |step: &Step| watch("chebyshev", step);
    let report = mixed::solve_within(operator, points, size, control, workspace, stop, by_mixed);
    if !matches!(report.outcome, Outcome::Stagnated | Outcome::Diverged) {
        return ("chebyshev", report);
    }
    let mut cg = ConjugateGradient::new(operator, points, Preconditioner::weights(operator));
    let report = solve_in_scale(&mut cg, size.max(largest(points)), stop, &mut |step| watch("cg", step));
    control.copy_from_slice(cg.points());
    ("cg", report)
}
