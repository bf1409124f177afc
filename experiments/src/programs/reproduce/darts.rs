//! PIA on meshes with darts, of which no proof of convergence is known: a search for divergence by hill climbing over
//! tags and edges, and the same for SOR, which does diverge.

use chacha20::ChaCha8Rng;
use nalgebra::Complex;
use rand::{Rng, RngExt, SeedableRng};
use rayon::prelude::*;

use crate::report::{Column, Columns};
use limitlab::Result;
use limitlab::analysis::singularity::Singularity;
use limitlab::mesh::features::{Rule, SHARP, Tags};
use limitlab::mesh::generate::{dual, flip_edges, merge_faces, quad_split, ring_sphere};
use limitlab::mesh::io::WriteOptions;
use limitlab::mesh::random::random_edge;
use limitlab::mesh::{Mesh, Surface, builtin, io};
use limitlab::schemes::Scheme;

use crate::programs::reproduce::context::{Context, Item, Question};
use crate::programs::reproduce::whole::{Relaxation, Whole};

pub const DARTS: Item = Item {
    id: "dart-search",
    title: "PIA on meshes with darts: a search for divergence",
    question: Some(Question {
        asks: "Is there a mesh with darts on which PIA diverges?",
        answer: "A long search found none; the same search finds meshes on which SOR with ω = 1.8 diverges. Whether \
                 there is one is open.",
    }),
    run,
};

/// Of the control: it diverges on some of these meshes.
const OMEGA: f64 = 1.8;

/// What is made of a triangulation.
#[derive(Clone, Copy)]
enum Kind {
    Triangles,
    /// All valences 3: λ_min of the smooth mesh is nearest to 0 here.
    Dual,
    Quads,
    Merged,
}

impl Kind {
    fn name(self) -> &'static str {
        match self {
            Kind::Triangles => "triangles",
            Kind::Dual => "duals of triangles",
            Kind::Quads => "quads",
            Kind::Merged => "polygons",
        }
    }

    fn of(self, triangles: &Mesh, seed: u64) -> Mesh {
        match self {
            Kind::Triangles => triangles.clone(),
            Kind::Dual => dual(triangles),
            Kind::Quads => quad_split(triangles),
            Kind::Merged => merge_faces(triangles, triangles.len(), 6, seed),
        }
    }
}

/// What is climbed.
#[derive(Clone, Copy, PartialEq)]
enum Goal {
    /// ρ(I − A).
    Pia,
    /// By how much that exceeds the ρ of the mesh without tags.
    Rise,
    /// max |Im λ|.
    Imaginary,
    /// ρ of SOR in file order.
    Sor,
}

impl Goal {
    fn name(self) -> &'static str {
        match self {
            Goal::Pia => "ρ of PIA",
            Goal::Rise => "rise of ρ of PIA",
            Goal::Imaginary => "|Im λ|",
            Goal::Sor => "ρ of SOR(1.8)",
        }
    }
}

/// Climbs of one kind.
#[derive(Clone, Copy)]
struct Search {
    scheme: Scheme,
    kind: Kind,
    goal: Goal,
    /// Vertices of the triangulations at the start, from and below.
    vertices: (usize, usize),
    starts: u64,
    steps: usize,
}

const fn climb(scheme: Scheme, kind: Kind, goal: Goal, vertices: (usize, usize)) -> Search {
    Search { scheme, kind, goal, vertices, starts: 20, steps: 400 }
}

const fn large(scheme: Scheme, kind: Kind, vertices: (usize, usize)) -> Search {
    Search { scheme, kind, goal: Goal::Pia, vertices, starts: 16, steps: 10 }
}

const SEARCHES: [Search; 16] = [
    climb(Scheme::CatmullClark, Kind::Dual, Goal::Pia, (5, 34)),
    climb(Scheme::CatmullClark, Kind::Quads, Goal::Pia, (4, 14)),
    climb(Scheme::CatmullClark, Kind::Merged, Goal::Pia, (8, 60)),
    climb(Scheme::CatmullClark, Kind::Triangles, Goal::Pia, (5, 60)),
    climb(Scheme::Loop, Kind::Triangles, Goal::Pia, (5, 60)),
    large(Scheme::CatmullClark, Kind::Dual, (90, 110)),
    large(Scheme::Loop, Kind::Triangles, (180, 220)),
    climb(Scheme::CatmullClark, Kind::Dual, Goal::Rise, (5, 34)),
    climb(Scheme::CatmullClark, Kind::Triangles, Goal::Rise, (5, 60)),
    climb(Scheme::Loop, Kind::Triangles, Goal::Rise, (5, 60)),
    climb(Scheme::CatmullClark, Kind::Dual, Goal::Imaginary, (5, 34)),
    climb(Scheme::CatmullClark, Kind::Quads, Goal::Imaginary, (4, 14)),
    climb(Scheme::Loop, Kind::Triangles, Goal::Imaginary, (5, 60)),
    climb(Scheme::CatmullClark, Kind::Dual, Goal::Sor, (5, 34)),
    climb(Scheme::CatmullClark, Kind::Quads, Goal::Sor, (4, 14)),
    climb(Scheme::Loop, Kind::Triangles, Goal::Sor, (5, 60)),
];

/// A mesh with darts, and what is known of its matrix.
struct Found {
    surface: Surface,
    tags: Tags,
    goal: f64,
    rho: f64,
    real: f64,
    imaginary: f64,
}

impl Found {
    /// `None` without darts, or where the eigenvalues are not found. The null vectors that every mesh without creases
    /// and corners has under the scheme are left out.
    fn new(search: &Search, mesh: Mesh, edges: &[[u32; 2]]) -> Option<Self> {
        let smooth = Surface::new(mesh).ok()?;
        let exists = |edge: &&[u32; 2]| smooth.incidence().half_edge(smooth.faces(), **edge).is_some();
        let creases = edges.iter().filter(exists).map(|&edge| (edge, SHARP)).collect();
        let tags = Tags { creases, ..Tags::default() };
        let surface = smooth.into_tagged(&tags).ok()?;
        if surface.features()?.count(Rule::Dart) == 0 {
            return None;
        }
        let whole = Whole::new(&surface, search.scheme).ok()?;
        let mut all = whole.eigenvalues().ok()?;
        all.sort_unstable_by(|a, b| a.norm().total_cmp(&b.norm()));
        all.drain(..Singularity::detect(&surface, search.scheme).kernel_dimension());
        let most = |of: fn(&Complex<f64>) -> f64| all.iter().map(of).fold(f64::NEG_INFINITY, f64::max);
        let (rho, real, imaginary) = (most(|z| (1.0 - z).norm()), -most(|z| -z.re), most(|z| z.im.abs()));
        let goal = match search.goal {
            Goal::Pia => rho,
            Goal::Rise => rho - smooth_rho(search, &surface).ok()?,
            Goal::Imaginary => imaginary,
            Goal::Sor => {
                let order: Vec<u32> = (0..whole.len() as u32).collect();
                whole.radius(Relaxation::Sor(OMEGA, &order)).ok()?
            }
        };
        Some(Found { surface, tags, goal, rho, real, imaginary })
    }
}

/// The best of a climb, and the extremes of all that was tried.
struct Climb {
    best: Option<Found>,
    tried: usize,
    vertices: usize,
    rho: f64,
    real: f64,
    imaginary: f64,
}

impl Climb {
    fn none() -> Self {
        Climb { best: None, tried: 0, vertices: 0, rho: 0.0, real: f64::INFINITY, imaginary: 0.0 }
    }

    /// From one start: one edge more or one less is sharp, or edges of the triangulation flip; what is no worse stays.
    fn new(search: &Search, seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let vertices = rng.random_range(search.vertices.0..search.vertices.1);
        let mut triangles = match rng.random_range(0..3) {
            0 => builtin::irregular_tri(vertices.max(8), rng.next_u64()),
            1 => builtin::bipyramid(vertices.max(5) - 2),
            _ => ring_sphere(vertices.max(5)),
        };
        let merged = rng.next_u64();
        let first = search.kind.of(&triangles, merged).faces;
        let sharp = rng.random_range(1..=vertices.div_ceil(4));
        let mut edges: Vec<[u32; 2]> = (0..sharp).map(|_| random_edge(&first, &mut rng)).collect();
        let mut climb = Climb::none();
        for _ in 0..search.steps {
            let (mut next, mut sharp) = (triangles.clone(), edges.clone());
            match rng.random_range(0..5) {
                0 => flip_edges(&mut next, rng.random_range(1..4), rng.next_u64()),
                1 if sharp.len() > 1 => drop(sharp.swap_remove(rng.random_range(0..sharp.len()))),
                _ => sharp.push(random_edge(&search.kind.of(&next, merged).faces, &mut rng)),
            }
            let Some(found) = Found::new(search, search.kind.of(&next, merged), &sharp) else { continue };
            climb.tried += 1;
            climb.vertices = climb.vertices.max(found.surface.len());
            climb.rho = climb.rho.max(found.rho);
            climb.real = climb.real.min(found.real);
            climb.imaginary = climb.imaginary.max(found.imaginary);
            if climb.best.as_ref().is_none_or(|best| found.goal >= best.goal) {
                (triangles, edges, climb.best) = (next, sharp, Some(found));
            }
        }
        climb
    }

    fn join(self, other: Self) -> Self {
        let goal = |climb: &Self| climb.best.as_ref().map_or(f64::NEG_INFINITY, |best| best.goal);
        let best = if goal(&other) > goal(&self) { other.best } else { self.best };
        Climb {
            best,
            tried: self.tried + other.tried,
            vertices: self.vertices.max(other.vertices),
            rho: self.rho.max(other.rho),
            real: self.real.min(other.real),
            imaginary: self.imaginary.max(other.imaginary),
        }
    }
}

/// ρ of PIA on the mesh without tags.
fn smooth_rho(search: &Search, surface: &Surface) -> Result<f64> {
    let smooth = Surface::new(surface.mesh().clone())?;
    let all = Whole::new(&smooth, search.scheme)?.eigenvalues()?;
    Ok(all.iter().map(|z| (1.0 - z).norm()).fold(0.0, f64::max))
}

fn run(context: &mut Context) -> Result<()> {
    // The same on any meshes, and long.
    if context.real() || context.quick {
        return Ok(());
    }
    struct Row {
        search: &'static Search,
        climb: Climb,
        smooth: Option<f64>,
        file: Option<String>,
    }
    let mut rows = Vec::new();
    for (k, search) in (0..).zip(&SEARCHES) {
        let climbs = (0..search.starts).into_par_iter().map(|start| Climb::new(search, 1000 * k + start));
        let climb = climbs.reduce(Climb::none, Climb::join);
        let (mut smooth, mut file) = (None, None);
        if let Some(best) = &climb.best {
            smooth = Some(smooth_rho(search, &best.surface)?);
            let name = format!("{}--{}.obj", DARTS.id, k + 1);
            let comments = context.provenance().lines();
            let options = WriteOptions { tags: Some(&best.tags), comments: &comments, ..WriteOptions::default() };
            io::write_control(&context.folder().join(&name), best.surface.mesh(), &options)?;
            file = Some(name);
        }
        rows.push(Row { search, climb, smooth, file });
    }
    let best = |row: &Row, of: fn(&Found) -> f64| row.climb.best.as_ref().map(of);
    let mut table = Columns::<Row>::new()
        .col(Column::key("scheme"), |r| r.search.scheme.name())
        .col(Column::key("faces"), |r| r.search.kind.name())
        .col(Column::key("climbed"), |r| r.search.goal.name())
        .col(Column::key("steps"), |r| r.search.steps.to_string())
        .col(Column::text("matrices"), |r| r.climb.tried)
        .col(Column::text("vertices_at_most"), |r| r.climb.vertices)
        .col(Column::number("pia_rho", 1e-6, 6), |r| Some(r.climb.rho))
        .col(Column::number("least_re", 1e-6, 3).floor(1e-9), |r| Some(r.climb.real))
        .col(Column::number("largest_im", 1e-6, 3).floor(1e-9), |r| Some(r.climb.imaginary))
        .col(Column::number("climbed_to", 1e-6, 6), move |r| best(r, |b| b.goal))
        .col(Column::number("pia_rho_there", 1e-6, 6), move |r| best(r, |b| b.rho))
        .col(Column::number("pia_rho_without_tags", 1e-6, 6), |r| r.smooth)
        .col(Column::text("mesh"), |r| r.file.clone().unwrap_or_default())
        .table(DARTS.id, DARTS.title, &rows);
    let tried: usize = rows.iter().map(|r| r.climb.tried).sum();
    table.note(format!(
        "{tried} matrices A of closed meshes with sharp edges that end in darts, from fixed seeds. A step makes an \
         edge sharp or smooth, or flips edges of the triangulation that the mesh is made from, and is kept where the \
         quantity in `climbed` does not fall. `pia_rho`, `least_re` and `largest_im` are the largest ρ(I − A), the \
         least Re λ and the largest |Im λ| of all matrices of the row, without the null vectors ±1 that darts leave. \
         PIA would diverge at `pia_rho` above 1. The last columns are of the mesh climbed to, which is the file \
         beside, with OpenSubdiv's tags; `pia_rho_without_tags` is 1 where it is singular without them. That SOR(1.8) \
         is found to diverge says that such a search can find divergence. Whether PIA always converges with darts is \
         open.",
    ));
    context.table(table)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_climb_climbs_and_its_best_is_as_it_says() {
        let search = Search { starts: 1, steps: 120, ..climb(Scheme::Loop, Kind::Triangles, Goal::Sor, (8, 16)) };
        let short = Climb::new(&Search { steps: 1, ..search }, 12_000);
        let long = Climb::new(&search, 12_000);
        let (start, best) = (short.best.unwrap(), long.best.unwrap());
        assert!(best.goal > start.goal + 0.1, "{} from {}", best.goal, start.goal);
        assert!(long.tried > 100 && long.rho < 1.0 && long.real > 0.0);
        let whole = Whole::new(&best.surface, Scheme::Loop).unwrap();
        let order: Vec<u32> = (0..whole.len() as u32).collect();
        assert_eq!(whole.radius(Relaxation::Sor(OMEGA, &order)).unwrap(), best.goal);
        assert!(best.surface.features().unwrap().count(Rule::Dart) > 0);
    }

    #[test]
    fn null_vectors_that_darts_leave_are_left_out() {
        let search = climb(Scheme::CatmullClark, Kind::Dual, Goal::Pia, (4, 5));
        let found = Found::new(&search, builtin::cube(), &[[0, 1]]).unwrap();
        assert!(found.real > 0.1 && found.rho < 0.9, "{} {}", found.real, found.rho);
        assert!(Found::new(&search, builtin::cube(), &[]).is_none());
    }
}
