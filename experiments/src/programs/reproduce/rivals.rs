//! Every way through given points that the papers name, and those of this house, on the same meshes: how near, how fair, at
//! what cost, and what each of them needs.

use std::time::Instant;

use glam::DVec3;

use crate::report::series::marker;
use crate::report::{Cell, Column, Columns, Figure, LinePlot, Scale, Series, Table, palette};
use limitlab::Result;
use limitlab::analysis::comparison::entries;
use limitlab::analysis::spectrum::{Spectrum, spectrum};
use limitlab::assemble::{LimitSystem, Operator};
use limitlab::interpolate::bending::bending;
use limitlab::interpolate::halstead::{Fairness, Weights, fit};
use limitlab::interpolate::lin_luo::{limit, surface::refine_n};
use limitlab::interpolate::pia::quasi_interpolant;
use limitlab::interpolate::surface::{SurfaceOptions, surface};
use limitlab::interpolate::thall::normal_deviations;
use limitlab::interpolate::zheng_cai::{self, Constraints, PhaseOne};
use limitlab::interpolate::{interpolate, limit_points, nearest};
use limitlab::mesh::{Mesh, Surface};
use limitlab::schemes::{Refinement, Scheme, blend, doo_sabin, kobbelt};
use limitlab::solvers::anderson::WINDOW;
use limitlab::solvers::{Accelerated, Errors, Method, Outcome, Stop, run as solve};

use crate::programs::reproduce::context::{Context, Item, Question, Subject};
use crate::programs::reproduce::corpus::{self, Model};

pub const RIVALS: Item = Item {
    id: "rivals",
    title: "Ways through given points that the papers name, on the same meshes",
    question: Some(Question {
        asks: "How do the methods that the papers name compare, on the same meshes?",
        answer: "Methods that solve the same system end on the same surface and differ in cost alone. Nearest points instead of limit \
                 points end on another, whose normals are further from those of the fairest, or not at all; one fixed mask instead of a \
                 system misses the points by 0.7 to 5.4 % of the diagonal.",
    }),
    run,
};

/// Relative to the diagonal of the bounding box.
const TOLERANCE: f64 = 1e-6;
const LIMIT: usize = 10_000;
/// Refinements of the surfaces that are measured: 64 faces for each, or 81 under the √3 schemes.
const LEVELS: usize = 3;
const THIRDS: usize = 4;
const MESHES: [Model; 5] = [corpus::HORSE, corpus::HAT, corpus::BOB, corpus::MUSHROOM, corpus::SPOT_COARSE];
/// Of a quick run.
const QUICK: usize = 1;
/// The two whose surfaces are drawn: of triangles and of quads.
const DRAWN: [usize; 2] = [0, 2];
/// As many go by turns in pictures, as markers do.
const COLOURS: usize = 7;
/// Bytes of a point.
const POINT: f64 = 24.0;

/// One way, and where it is from.
struct Rival {
    name: &'static str,
    source: &'static str,
    /// What is done, or why it is not known.
    rule: &'static str,
    needs: &'static str,
    way: Way,
}

enum Way {
    /// The control mesh of the scheme that the faces suggest, by a method with so many arrays of points.
    Solve(Method<'static>, f64),
    /// Some other surface; none on meshes that it is not defined on.
    Make(fn(&Case) -> Result<Option<Made>>),
    /// Its rule could not be established.
    Unknown,
}

/// A mesh, and what its surfaces are held against.
struct Case<'a> {
    subject: &'a Subject,
    system: LimitSystem,
    spectrum: Spectrum,
    scheme: Scheme,
    fairness: Fairness,
    fairest: Made,
    size: f64,
}

/// A surface through the points, or near them.
struct Made {
    /// Of which scheme.
    scheme: &'static str,
    iterations: Cell,
    /// The surface's points at the given ones, and its unit normals there.
    points: Vec<DVec3>,
    normals: Vec<DVec3>,
    bending: f64,
    /// The thin-plate energy, of Catmull-Clark surfaces.
    thin_plate: Option<f64>,
    /// What is held beside the mesh and the result.
    bytes: f64,
    seconds: f64,
}

const PIA: Accelerated = Accelerated::Pia { omega: None };

/// The rival that solves under the scheme of the mesh.
const AUTO: &str = "auto";

/// The papers' rivals in the order of their years; first those that solve the system.
const RIVALS_OF_THE_PAPERS: [Rival; 25] = [
    Rival {
        name: "pia",
        source: "PIA §2, §3",
        rule: "V ← V + (P − A V)",
        needs: "a limit mask; λ_min > 0",
        way: Way::Solve(Method::Pia, 2.0),
    },
    Rival {
        name: "w-pia",
        source: "Deng & Ma 2012",
        rule: "V ← V + ω(P − A V), ω = 2/(λ_min + λ_max)",
        needs: "both ends of the spectrum",
        way: Way::Solve(Method::WPia { omega: None }, 2.0),
    },
    Rival {
        name: "gs-pia",
        source: "Gauss-Seidel on PIA's system",
        rule: "v_i ← v_i + (p_i − (A V)_i)/a_ii, in place",
        needs: "a vertex order",
        way: Way::Solve(Method::GaussSeidel { order: None }, 1.0),
    },
    Rival {
        name: "cg-pia",
        source: "conjugate gradients on PIA's system",
        rule: "least error in the energy norm over the Krylov space",
        needs: "A = H·M with a symmetric M",
        way: Way::Solve(Method::Cg, 4.0),
    },
    Rival {
        name: "anderson",
        source: "Anderson 1965",
        rule: "the last updates of PIA combined so that their residual is least",
        needs: "inner products; a window",
        way: Way::Solve(Method::Anderson { of: PIA, window: WINDOW }, 2.0 * WINDOW as f64 + 5.0),
    },
    Rival {
        name: "heavy-ball",
        source: "Polyak 1964",
        rule: "PIA with momentum",
        needs: "both ends of the spectrum",
        way: Way::Solve(Method::HeavyBall { interval: None }, 2.0),
    },
    Rival {
        name: "thall",
        source: "Thall Eq. 3",
        rule: "V ← V + ½ D⁻¹(P − A V)",
        needs: "nothing else",
        way: Way::Solve(Method::Thall, 2.0),
    },
    Rival {
        name: "chebyshev",
        source: "this house",
        rule: "the best polynomial on an interval",
        needs: "an interval, proven or estimated",
        way: Way::Solve(Method::Chebyshev { interval: None }, 2.0),
    },
    Rival {
        name: "ldlt",
        source: "this house",
        rule: "sparse LDLᵀ of M",
        needs: "the stored matrix, and room for its factor",
        way: Way::Solve(Method::Ldlt, 1.0),
    },
    Rival {
        name: AUTO,
        source: "this house",
        rule: "Chebyshev in single precision, corrected in double; others where it makes no progress",
        needs: "nothing else",
        way: Way::Make(|case| solved(case, case.scheme)),
    },
    Rival {
        name: "catmull-clark",
        source: "Halstead et al. 1993 §3, Thall §2",
        rule: "A V = P under Catmull-Clark, by auto",
        needs: "any polygons",
        way: Way::Make(|case| solved(case, Scheme::CatmullClark)),
    },
    Rival {
        name: "sqrt3",
        source: "this house",
        rule: "A V = P under Kobbelt's √3, by auto",
        needs: "triangles",
        way: Way::Make(|case| solved(case, Scheme::Sqrt3)),
    },
    Rival {
        name: "mid-edge",
        source: "this house",
        rule: "A V = P under Peters and Reif's mid-edge scheme, by auto",
        needs: "any polygons",
        way: Way::Make(|case| solved(case, Scheme::MidEdge)),
    },
    Rival {
        name: "nasri",
        source: "Nasri 1987",
        rule: "A V = P under Doo-Sabin, by auto",
        needs: "any polygons",
        way: Way::Make(|case| solved(case, Scheme::Nasri)),
    },
    Rival {
        name: "zheng-cai",
        source: "Zheng & Cai 2005",
        rule: "at most five sweeps, then faces moved to their points and flattened",
        needs: "any polygons",
        way: Way::Make(two_phase),
    },
    Rival {
        name: "halstead",
        source: "Halstead et al. 1993 §4",
        rule: "the least thin-plate and membrane energy under A V = P, two refinements down",
        needs: "any polygons; 4 KB a vertex",
        way: Way::Make(|case| fairest(case.subject, &case.fairness).map(Some)),
    },
    Rival {
        name: "butterfly",
        source: "Zorin et al. 1996",
        rule: "an interpolatory refinement",
        needs: "triangles; no system",
        way: Way::Make(|case| kept(case.subject, Refinement::Butterfly, LEVELS)),
    },
    Rival {
        name: "labsik-greiner",
        source: "Labsik & Greiner 2000",
        rule: "an interpolatory refinement",
        needs: "triangles; no system",
        way: Way::Make(|case| kept(case.subject, Refinement::LabsikGreiner, THIRDS)),
    },
    Rival {
        name: "lin-luo",
        source: "Lin & Luo §4",
        rule: "the unified √3 scheme at α = 1",
        needs: "triangles; no system",
        way: Way::Make(unified),
    },
    Rival {
        name: "kobbelt",
        source: "Kobbelt 1996",
        rule: "an interpolatory refinement: the four-point rule along edges, then across faces; the constant at extraordinary \
               vertices is the one by which both directions across a face agree",
        needs: "quads, closed; no system",
        way: Way::Make(kobbelts),
    },
    Rival {
        name: "maillot-stam",
        source: "Maillot & Stam 2001, as Lin & Luo §1 tell it",
        rule: "in part: Loop or Catmull-Clark, old vertices pushed back, new ones by the mean of their edge or face; their own choice of \
               smoothing, and how far they push back by default, would take the paper (Comput. Graph. Forum 20(3))",
        needs: "triangles or quads; no system",
        way: Way::Make(pushed_back),
    },
    Rival {
        name: "maekawa",
        source: "Maekawa et al. 2007, as PIA §1, §2 tell it",
        rule: "in part: V ← V + P − Q(V), Q the nearest points of the limit surface, found on the mesh refined three times. Its local \
               adjusting, which PIA says to be needless, would take the paper (Comput.-Aided Des. 39(4))",
        needs: "nearest points of the surface",
        way: Way::Make(nearest_points),
    },
    Rival {
        name: "litke",
        source: "Litke et al. 2001",
        rule: "in part: a quasi-interpolant, V = 2P − A P, a fixed mask on the 1-ring that has the right limit points for cubics on regular \
               meshes; it is PIA's first step. Of theirs PIA §1 says no more than that it is one: their masks, at extraordinary vertices above \
               all, it would take the paper (Visualization 2001)",
        needs: "a limit mask; no system",
        way: Way::Make(quasi),
    },
    Rival {
        name: "zheng-cai-2006",
        source: "Zheng & Cai 2006",
        rule: "not established: PIA §1 says that it has two phases and always works; for their rules it would take the paper (Trans. Vis. \
               Comput. Graph. 12(3)), and no public source of them was found",
        needs: "not known here",
        way: Way::Unknown,
    },
    Rival {
        name: "lai-cheng",
        source: "Lai & Cheng 2006",
        rule: "not established: the abstract asks for a Catmull-Clark surface through the vertices that is similar to the limit surface of \
               the mesh, by a system that need not be soluble; it would take the paper (Visual Computer 22(9)) for what similar is, and for \
               the step that makes the interpolation exact",
        needs: "any polygons; an approximate solution",
        way: Way::Unknown,
    },
];

/// A rival on a mesh.
type Row<'a> = (&'a str, &'a Rival, &'a Case<'a>, Made);

fn run(context: &mut Context) -> Result<()> {
    let meshes = if context.quick { QUICK } else { MESHES.len() };
    let subjects: Vec<Subject> = MESHES[..meshes].iter().map(|model| context.subject(model)).collect::<Result<_>>()?;
    let cases: Vec<Case> = subjects.iter().map(Case::new).collect::<Result<_>>()?;
    let mut rows: Vec<Row> = Vec::new();
    for case in &cases {
        for rival in &RIVALS_OF_THE_PAPERS {
            let made = match rival.way {
                Way::Solve(method, arrays) => Some(case.solve(method, arrays)?),
                Way::Make(make) => {
                    let start = Instant::now();
                    make(case)?.map(|made| Made { seconds: start.elapsed().as_secs_f64(), ..made })
                }
                Way::Unknown => None,
            };
            rows.extend(made.map(|made| (case.subject.name.as_str(), rival, case, made)));
        }
    }
    context.table(rules())?;
    context.table(table(&rows))?;
    context.times(|_| Ok(times(&rows)))?;
    if context.quick {
        return Ok(());
    }
    let panels = DRAWN.map(|k| panel(context.caption(&subjects[k]), &rows, &subjects[k].name));
    context.figure(RIVALS.id, &Figure::stack(panels).title("Surfaces through the same points: fairness"))
}

/// What every rival does, and what it needs: those too whose rule is not known.
fn rules() -> Table {
    let mut table = Columns::<Rival>::new()
        .col(Column::key("rival"), |rival| rival.name)
        .col(Column::text("source"), |rival| rival.source)
        .col(Column::text("rule"), |rival| rival.rule)
        .col(Column::text("needs"), |rival| rival.needs)
        .table(format!("{}--rules", RIVALS.id), "What each of the rivals does and needs", &RIVALS_OF_THE_PAPERS);
    table.note(
        "Only what the four papers or a public source establish is built. V are control points, P the given points, A the limit \
         matrix, D its diagonal.",
    );
    table
}

fn table(rows: &[Row]) -> Table {
    let mut table = Columns::<Row>::new()
        .col(Column::key("mesh"), |(mesh, ..)| *mesh)
        .col(Column::key("rival"), |(_, rival, ..)| rival.name)
        .col(Column::text("scheme"), |(.., made)| made.scheme)
        .col(Column::count("iterations"), |(.., made)| made.iterations.clone())
        .col(Column::number("max_error", 1e-3, 3).floor(1e-6), |(_, _, case, made)| Some(case.errors(made)?.max))
        .col(Column::number("mean_error", 1e-3, 3).floor(1e-6), |(_, _, case, made)| Some(case.errors(made)?.mean))
        .col(Column::number("bending_ratio", 1e-4, 4), |(_, _, case, made)| case.bending(made))
        .col(Column::number("thin_plate_ratio", 1e-4, 4), |(_, _, case, made)| {
            Some(made.thin_plate.filter(|_| !made.failed())? / case.fairest.thin_plate?)
        })
        .col(Column::number("normal_deviation_mean_degrees", 1e-3, 4), |(_, _, case, made)| {
            Some(case.deviations(made)?.0)
        })
        .col(Column::number("normal_deviation_max_degrees", 1e-3, 4), |(_, _, case, made)| {
            Some(case.deviations(made)?.1)
        })
        .col(Column::number("bytes_per_vertex", 1e-3, 3), |(.., made)| made.bytes)
        .table(RIVALS.id, RIVALS.title, rows);
    table.note(format!(
        "What each rival does and needs: [rules]({}--rules.md). Methods solve `A V = P` under Loop on triangles, else under \
         Catmull-Clark, from V = P to {TOLERANCE:e} of the bounding box's diagonal, to which errors at the vertices are relative; \
         `auto` and all else but the two phases solve as far. `bending_ratio` is ∫ κ₁² + κ₂² dA over that of the fairest \
         surface (`halstead`), of the surface after {LEVELS} refinements ({THIRDS} under √3 schemes) with its own limit points and \
         normals (of faces under `lin-luo` and `maillot-stam`); of interpolatory schemes, whose curvature is not bounded, it grows with the \
         levels. `thin_plate_ratio` is that of \
         [ripples](ripples.md), for Catmull-Clark surfaces. Normals at the points are compared with those of the fairest surface. \
         `bytes_per_vertex` is what is held beside the mesh and the result: the matrix-free operator and arrays of points, \
         for `ldlt` the matrix and its factor. Where a method did not end, the row says how, and nothing else.",
        RIVALS.id
    ));
    table
}

fn times(rows: &[Row]) -> Table {
    let mut table = Columns::<Row>::new()
        .col(Column::key("mesh"), |(mesh, ..)| *mesh)
        .col(Column::key("rival"), |(_, rival, ..)| rival.name)
        .col(Column::time("seconds"), |(.., made)| made.seconds)
        .table(format!("{}--times", RIVALS.id), "Seconds of the rivals", rows);
    table.note(
        "Of methods, the set-up and all iterations, without the spectrum that some are told. Of all else, the surface too: its \
         refinements, its limit points and normals.",
    );
    table
}

/// Bending over the distance of the normals from the fairest surface's, a marker a surface, the same on every mesh.
fn panel(caption: String, rows: &[Row], mesh: &str) -> LinePlot {
    let surfaces = rows.iter().filter(|(of, rival, ..)| *of == mesh && matches!(rival.way, Way::Make(_)));
    let series = surfaces.filter_map(|(_, rival, case, made)| {
        // `auto` solves under the scheme of the mesh, which may be one of the others.
        let name = if rival.name == AUTO { case.scheme.name() } else { rival.name };
        if rival.name == AUTO && RIVALS_OF_THE_PAPERS.iter().any(|other| other.name == name) {
            return None;
        }
        let at = (case.deviations(made)?.0, case.bending(made)?);
        let k = RIVALS_OF_THE_PAPERS.iter().position(|known| known.name == rival.name)?;
        // The fairest surface is the measure itself.
        (at.0 > 0.0).then(|| Series::scatter(name, [at]).marker(marker(k)).colour(palette(k + k / COLOURS)))
    });
    LinePlot {
        title: caption,
        x_label: "normals off the fairest, mean (°)".into(),
        y_label: "bending (fairest: 1)".into(),
        x_scale: Scale::Log,
        series: series.collect(),
        ..LinePlot::default()
    }
}

impl Made {
    /// Whether a method ended without a result.
    fn failed(&self) -> bool {
        matches!(self.iterations, Cell::Text(_))
    }
}

impl<'a> Case<'a> {
    fn new(subject: &'a Subject) -> Result<Self> {
        let scheme = Scheme::default_for(subject.surface.faces());
        let fairness = Fairness::new(&subject.surface)?;
        let fairest = fairest(subject, &fairness)?;
        let size = subject.surface.diagonal();
        let system = subject.system(scheme)?;
        Ok(Case { subject, spectrum: spectrum(&system)?, system, scheme, fairness, fairest, size })
    }

    fn stop(&self) -> Stop {
        Stop { tolerance: TOLERANCE * self.size, max_iterations: LIMIT }
    }

    /// Relative to the diagonal.
    fn errors(&self, made: &Made) -> Option<Errors> {
        if made.failed() {
            return None;
        }
        let points = self.subject.surface.positions();
        let distances = made.points.iter().zip(points).map(|(q, p)| q.distance(*p) / self.size);
        let (sum, max) = distances.fold((0.0, 0.0f64), |(sum, max), d| (sum + d, max.max(d)));
        Some(Errors { max, mean: sum / points.len() as f64 })
    }

    fn bending(&self, made: &Made) -> Option<f64> {
        (!made.failed()).then(|| made.bending / self.fairest.bending)
    }

    /// Of the normals from those of the fairest surface: mean and largest, in degrees.
    fn deviations(&self, made: &Made) -> Option<(f64, f64)> {
        if made.failed() {
            return None;
        }
        let found = normal_deviations(&made.normals, &self.fairest.normals);
        let max = found.iter().copied().fold(0.0, f64::max);
        Some(((found.iter().sum::<f64>() / found.len() as f64).to_degrees(), max.to_degrees()))
    }

    fn solve(&self, method: Method<'static>, arrays: f64) -> Result<Made> {
        let lines = entries(&self.system, &self.spectrum, &[method], None, "file")?;
        let solution = solve(&self.system, self.subject.surface.positions(), lines[0].method, &self.stop());
        let held = match solution.fill {
            // A column and a value an entry.
            Some(fill) => 12.0 * (self.system.a.values().len() + fill) as f64,
            None => Operator::new(&self.subject.surface, self.scheme)?.sweep_bytes() as f64,
        };
        let n = self.system.len() as f64;
        let made =
            self.control(self.scheme, solution.points, count(solution.report.outcome, solution.report.iterations))?;
        Ok(Made { bytes: held / n + POINT * arrays, seconds: solution.setup_seconds + solution.solve_seconds, ..made })
    }

    /// What a control mesh makes.
    fn control(&self, scheme: Scheme, control: Vec<DVec3>, iterations: Cell) -> Result<Made> {
        let given = self.subject.surface.positions();
        let control = self.subject.surface.with_positions(control);
        let normals = match scheme.first_rule() {
            Some(rule) => doo_sabin::limit_normals(rule, &control)?,
            None => scheme.refinement().limit_normals(&control)?,
        };
        let thin_plate = match scheme == Scheme::CatmullClark {
            true => Some(self.fairness.energies_of(&control)?.thin_plate),
            false => None,
        };
        let points = limit_points(&control, scheme)?;
        let levels = if scheme == Scheme::Sqrt3 { THIRDS } else { LEVELS };
        let request = SurfaceOptions { levels, limit: true, normals: true, ..SurfaceOptions::default() };
        let made = surface(control, scheme, given, &request)?;
        let bending = bending(made.surface.mesh(), &made.normals.unwrap_or_default());
        Ok(Made { scheme: scheme.name(), iterations, points, normals, bending, thin_plate, bytes: 0.0, seconds: 0.0 })
    }
}

/// How many iterations, or how else the run ended.
fn count(outcome: Outcome, iterations: usize) -> Cell {
    if outcome == Outcome::Converged { iterations.into() } else { outcome.name().into() }
}

/// By `auto`, which holds three arrays in single precision beside two in double.
fn solved(case: &Case, scheme: Scheme) -> Result<Option<Made>> {
    const SINGLE: f64 = 16.0;
    let surface = &case.subject.surface;
    if !case.subject.suits(scheme) {
        return Ok(None);
    }
    let solution = interpolate(surface, scheme, &case.stop().into())?;
    let bytes = Operator::new(surface, scheme)?.sweep_bytes() as f64 / surface.len() as f64;
    let made = case.control(scheme, solution.points, count(solution.report.outcome, solution.report.iterations))?;
    Ok(Some(Made { bytes: bytes + 3.0 * SINGLE + 2.0 * POINT, ..made }))
}

/// Zheng and Cai's two phases with their own settings.
fn two_phase(case: &Case) -> Result<Option<Made>> {
    let surface = &case.subject.surface;
    let found = zheng_cai::interpolate(surface, &Constraints::default(), &PhaseOne::default())?;
    let first = &found.first;
    let all = doo_sabin::face_normals(first.surface.mesh());
    let positions = first.surface.positions();
    let centroid = |v: usize| {
        let face = first.surface.faces().face(first.first_vertex_face + v);
        face.iter().map(|&c| positions[c as usize]).sum::<DVec3>() / face.len() as f64
    };
    let fine = Refinement::DooSabin.refined_n(&first.surface, LEVELS - 1)?;
    let mesh = Mesh::new(Refinement::DooSabin.limit_positions(&fine)?, fine.faces().clone());
    Ok(Some(Made {
        scheme: Scheme::ZhengCai.name(),
        iterations: found.auxiliary.updates.len().into(),
        points: (0..surface.len()).map(centroid).collect(),
        normals: all[first.first_vertex_face..][..surface.len()].to_vec(),
        bending: bending(&mesh, &Refinement::DooSabin.limit_normals(&fine)?),
        thin_plate: None,
        // A sum a face.
        bytes: POINT * surface.faces().len() as f64 / surface.len() as f64,
        seconds: 0.0,
    }))
}

/// The fairest surface.
fn fairest(subject: &Subject, fairness: &Fairness) -> Result<Made> {
    /// As its documentation says.
    const BYTES: f64 = 4000.0;
    const SCHEME: Refinement = Refinement::CatmullClark;
    let start = Instant::now();
    let found = fit(fairness, subject.surface.positions(), &Constraints::default(), Weights::default())?;
    let first = |mut all: Vec<DVec3>| {
        all.truncate(subject.surface.len());
        all
    };
    let points = first(SCHEME.limit_positions(&found.surface)?);
    let normals = first(SCHEME.limit_normals(&found.surface)?);
    // The control mesh is two refinements down.
    let fine = SCHEME.refined(&found.surface)?;
    let mesh = Mesh::new(SCHEME.limit_positions(&fine)?, fine.faces().clone());
    Ok(Made {
        scheme: SCHEME.name(),
        iterations: count(found.report.outcome, found.report.iterations),
        points,
        normals,
        bending: bending(&mesh, &SCHEME.limit_normals(&fine)?),
        thin_plate: Some(found.energies.thin_plate),
        bytes: BYTES,
        seconds: start.elapsed().as_secs_f64(),
    })
}

/// A refinement that keeps the vertices.
fn kept(subject: &Subject, refinement: Refinement, levels: usize) -> Result<Option<Made>> {
    let surface = &subject.surface;
    if refinement.needs_triangles() && surface.faces().uniform_size() != Some(3) {
        return Ok(None);
    }
    let fine = refinement.refined_n(surface, levels)?;
    Ok(Some(interpolatory(
        refinement.name(),
        &fine,
        &refinement.limit_normals(&fine)?,
        refinement.limit_normals(surface)?,
    )))
}

/// The unified √3 scheme where it interpolates.
fn unified(case: &Case) -> Result<Option<Made>> {
    let surface = &case.subject.surface;
    if surface.faces().uniform_size() != Some(3) {
        return Ok(None);
    }
    let alpha = vec![1.0; surface.len()];
    let (fine, _) = refine_n(surface, &alpha, THIRDS)?;
    let normals = limit::limits(surface, &alpha)?.normals;
    Ok(Some(interpolatory("unified-sqrt3", &fine, &of_faces(&fine), normals)))
}

/// Kobbelt's scheme.
fn kobbelts(case: &Case) -> Result<Option<Made>> {
    let surface = &case.subject.surface;
    if surface.faces().uniform_size() != Some(4) {
        return Ok(None);
    }
    let fine = kobbelt::refined_n(surface, LEVELS)?;
    let normals = kobbelt::limit_normals(surface)?;
    Ok(Some(interpolatory("kobbelt", &fine, &kobbelt::limit_normals(&fine)?, normals)))
}

/// Push-back as far as the vertices were moved.
fn pushed_back(case: &Case) -> Result<Option<Made>> {
    let scheme = case.scheme.refinement();
    let step = |coarse: Surface, _| Surface::new(blend::push_back(&coarse, scheme, 1.0)?);
    let fine = (0..LEVELS).try_fold(case.subject.surface.clone(), step)?;
    let all = of_faces(&fine);
    let normals = all[..case.subject.surface.len()].to_vec();
    Ok(Some(interpolatory(scheme.name(), &fine, &all, normals)))
}

/// By nearest points, which take the places of the vertices' limit points.
fn nearest_points(case: &Case) -> Result<Option<Made>> {
    let found = nearest::interpolate(&case.subject.surface, case.scheme.refinement(), &case.stop())?;
    let iterations = count(found.report.outcome, found.report.iterations);
    let fine = 4f64.powi(nearest::LEVELS as i32);
    let made = case.control(case.scheme, found.control.into_mesh().positions, iterations)?;
    // The refined points, and a foot with its normal.
    Ok(Some(Made { points: found.feet, normals: found.normals, bytes: (fine + 2.0) * POINT, ..made }))
}

/// A mask in place of a system.
fn quasi(case: &Case) -> Result<Option<Made>> {
    let control = quasi_interpolant(&case.subject.surface, case.scheme)?;
    case.control(case.scheme, control, Cell::Empty).map(Some)
}

/// The normals at the vertices as the sums of those of their faces, by area: of schemes that have no masks for them.
fn of_faces(fine: &Surface) -> Vec<DVec3> {
    let mut normals = vec![DVec3::ZERO; fine.len()];
    for face in fine.faces().iter() {
        let at = |k: usize| fine.positions()[face[k] as usize];
        let area: DVec3 = (2..face.len()).map(|k| (at(k - 1) - at(0)).cross(at(k) - at(0))).sum();
        face.iter().for_each(|&v| normals[v as usize] += area);
    }
    normals.iter().map(|normal| normal.normalize_or_zero()).collect()
}

/// A refined mesh whose first vertices are the given points.
fn interpolatory(scheme: &'static str, fine: &Surface, fine_normals: &[DVec3], normals: Vec<DVec3>) -> Made {
    Made {
        scheme,
        iterations: Cell::Empty,
        points: fine.positions()[..normals.len()].to_vec(),
        bending: bending(fine.mesh(), fine_normals),
        normals,
        thin_plate: None,
        bytes: 0.0,
        seconds: 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn methods_of_one_system_end_on_one_surface_and_refinements_keep_the_points() {
        let subject = Subject::built_in("irregular-tri:60").unwrap();
        let case = Case::new(&subject).unwrap();
        let mut solved = 0;
        let auto = super::solved(&case, Scheme::Loop).unwrap().unwrap();
        for rival in &RIVALS_OF_THE_PAPERS {
            match rival.way {
                Way::Solve(method, arrays) => {
                    let made = case.solve(method, arrays).unwrap();
                    assert!(case.errors(&made).unwrap().max <= 1.001 * TOLERANCE, "{}", rival.name);
                    assert!((made.bending / auto.bending - 1.0).abs() < 1e-3, "{}", rival.name);
                    solved += 1;
                }
                Way::Make(make) => {
                    // Refinements have no iterations; one of them, the mask, is none that keeps the points.
                    let made = make(&case).unwrap().filter(|made| made.iterations == Cell::Empty);
                    let max = made.map(|made| case.errors(&made).unwrap().max);
                    assert!(max.is_none_or(|max| (max == 0.0) != (rival.name == "litke")), "{}: {max:?}", rival.name);
                }
                Way::Unknown => assert!(rival.rule.contains("it would take"), "{}", rival.name),
            }
        }
        assert_eq!(solved, 9);
    }
}
