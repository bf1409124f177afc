//! Open and creased meshes: P13–P17, on what PIA §5 leaves open, and Z26.

use limitlab_factorizations::dense::{small_singular_values, small_symmetric_eigen};
use nalgebra::{DMatrix, DVector};

use limitlab::Result;
use limitlab::analysis::dense;
use limitlab::analysis::singularity::{Singularity, ZERO};
use limitlab::analysis::spectrum::spectrum;
use limitlab::assemble::{LimitSystem, Stages};
use limitlab::interpolate::staged;
use limitlab::mesh::features::{Rule, SHARP, Tags};
use limitlab::mesh::order::Order;
use limitlab::mesh::validate::Boundary;
use limitlab::mesh::{Faces, Mesh, Surface, builtin, generate};
use limitlab::schemes::{Masks, Scheme};
use limitlab::solvers::{Method, Outcome, Stop};

use super::Claim;
use super::finding::{Evidence, Finding};
use super::lab::{Lab, each, exact, largest, random_points, smallest};
use crate::programs::reproduce::context::Subject;
use crate::programs::reproduce::whole::{Relaxation, Whole};

const CC: Scheme = Scheme::CatmullClark;

/// What sums of some tens of terms of size 1 may lose.
const ROUNDING: f64 = 1e-12;
/// What rounding does to eigenvalues of matrices that cannot be diagonalised: some multiple of its root.
const DEFECTIVE: f64 = 1e-6;
/// Random meshes on which radii of sweeps are computed.
const SWEPT: usize = 24;
/// The most vertices of a real model that dense matrices are made of.
const DENSE: usize = 300;

/// Those about PIA §5.
pub const PIA: &[Claim] = &[
    Claim {
        id: "P13",
        title: "Open meshes and creases: when the matrix is singular",
        place: "§5",
        printed: "How to make the method effective for open meshes is an interesting topic.",
        slow: false,
        check: when_singular,
    },
    Claim {
        id: "P14",
        title: "Open meshes and creases: the spectrum",
        place: "§5",
        printed: "How to make the method effective for open meshes is an interesting topic.",
        slow: false,
        check: real_spectrum,
    },
    Claim {
        id: "P15",
        title: "Open meshes and creases: PIA, Jacobi, Gauss-Seidel and SOR converge",
        place: "§5",
        printed: "How to make the method effective for open meshes is an interesting topic.",
        slow: false,
        check: iterations_converge,
    },
    Claim {
        id: "P16",
        title: "Open meshes and creases: norms in which every error shrinks",
        place: "§2 and §5",
        printed: "e^{k+1} is always less than e^k; how to make the method effective for open meshes is of interest.",
        slow: false,
        check: norms,
    },
    Claim {
        id: "P17",
        title: "Semi-sharp curves through regular vertices leave the system symmetric",
        place: "§5",
        printed: "How to make the method effective for open meshes is an interesting topic.",
        slow: false,
        check: semi_sharp_curves,
    },
];

/// That about Zheng & Cai §5.
pub const ZHENG_CAI: &[Claim] = &[Claim {
    id: "Z26",
    title: "Extension to open meshes is straightforward",
    place: "§5",
    printed: "Although only closed meshes are discussed, extension to open meshes is straightforward.",
    slow: false,
    check: straightforward,
}];

/// Closed meshes by name, with whether all valences are 3, and whether the graph is bipartite.
const CLOSED: [(&str, bool, bool); 9] = [
    ("cube", true, true),
    ("prism:6", true, true),
    ("truncated-octahedron", true, true),
    ("prism:5", true, false),
    ("dodecahedron", true, false),
    ("tetrahedron", true, false),
    ("torus:4x4", false, true),
    ("octahedron", false, false),
    ("icosahedron", false, false),
];

fn examined(mesh: Mesh, boundary: Boundary) -> Result<Surface> {
    Surface::examined(mesh, None, boundary).map_err(limitlab::Error::Defects)
}

/// The mesh left as it is, and with a corner, a creased loop, a hole by either rule, one of these in another component:
/// with the number of components that nothing touches.
fn variants(mesh: &Mesh) -> Result<Vec<(Surface, usize)>> {
    let closed = Surface::new(mesh.clone())?;
    let corner = Tags { corners: vec![(0, SHARP)], ..Tags::default() };
    let face = mesh.faces.face(0);
    let sides = (0..face.len()).map(|k| ([face[k], face[(k + 1) % face.len()]], SHARP));
    let creased = Tags { creases: sides.collect(), ..Tags::default() };
    let lists: Vec<&[u32]> = mesh.faces.iter().skip(1).collect();
    let hole = Mesh::new(mesh.positions.clone(), Faces::from_lists(lists));
    let two = Surface::new(generate::union(&[mesh.clone(), mesh.clone()]))?;
    Ok(vec![
        (closed.clone(), 1),
        (closed.tagged(&corner)?, 0),
        (closed.tagged(&creased)?, 0),
        (examined(hole.clone(), Boundary::EdgeAndCorner)?, 0),
        (examined(hole.clone(), Boundary::EdgeOnly)?, 0),
        (two.clone(), 2),
        (two.tagged(&corner)?, 1),
        (examined(generate::union(&[hole, mesh.clone()]), Boundary::EdgeOnly)?, 1),
    ])
}

/// The singular values of all of A that vanish, and the least of the others.
fn kernel(surface: &Surface, scheme: Scheme) -> Result<(usize, f64)> {
    let values = small_singular_values(Whole::new(surface, scheme)?.dense());
    let zero = values.iter().filter(|&&x| x <= ZERO).count();
    Ok((zero, smallest(values.iter().copied().filter(|&x| x > ZERO))))
}

fn when_singular(lab: &Lab) -> Result<Finding> {
    let (mut made, mut singular, mut wrong) = (0usize, 0usize, 0usize);
    for (name, three, bipartite) in CLOSED {
        let mesh = builtin::builtin(name)?;
        for scheme in Scheme::ALL.into_iter().filter(|s| s.first_unsuitable_face(&mesh.faces).is_none()) {
            let has_kernel = match scheme {
                Scheme::CatmullClark => three && bipartite,
                Scheme::MidEdge => bipartite,
                Scheme::Loop | Scheme::Sqrt3 | Scheme::Nasri | Scheme::ZhengCai => false,
            };
            for (surface, untouched) in variants(&mesh)? {
                let expected = if has_kernel { untouched } else { 0 };
                made += 1;
                singular += usize::from(expected > 0);
                wrong += usize::from(kernel(&surface, scheme)?.0 != expected);
            }
        }
    }
    let (mut random, mut random_wrong, mut least) = (0usize, 0usize, f64::INFINITY);
    for scheme in Scheme::ALL {
        let rows = each(lab.creased(scheme), |subject| {
            let (dimension, least) = kernel(&subject.surface, scheme)?;
            Ok((dimension != Singularity::detect(&subject.surface, scheme).kernel_dimension(), least))
        })?;
        random += rows.len();
        random_wrong += rows.iter().filter(|r| r.0).count();
        least = smallest([least, smallest(rows.iter().map(|r| r.1))]);
    }
    let darts = colourings(lab)?;
    let [corner, path] = cured()?;
    Ok(Finding::settled(vec![
        Evidence::equal("meshes made for it whose kernel has another dimension, six schemes", wrong, 0.0),
        Evidence::above("singular ones among them", singular, 0.0),
        Evidence::shown("meshes made for it", made),
        Evidence::equal("random open and creased meshes whose kernel has another dimension", random_wrong, 0.0),
        Evidence::shown("random open and creased meshes, six schemes", random),
        Evidence::shown("least singular value of A that does not vanish on them", least),
        Evidence::at_most(
            "largest |A(±1)| on 3-valent bipartite meshes whose sharp and semi-sharp edges do not meet, Catmull-Clark",
            darts.image,
            ROUNDING,
        ),
        Evidence::shown("such meshes", darts.meshes),
        Evidence::above(
            "least singular value of A where two of these edges meet, or a vertex is semi-sharp",
            darts.cured,
            1e-4,
        ),
        Evidence::equal(
            "random meshes with darts and semi-sharp tags whose kernel has another dimension",
            darts.others,
            0.0,
        ),
        Evidence::shown("random meshes with darts and semi-sharp tags", darts.random),
        Evidence::at_most("departure of λ_min of a cube with one corner from .0334", (corner - 0.0334).abs(), 5e-5),
        Evidence::at_most(
            "departure of λ_min of a cube with a crease of two edges from .0239",
            (path - 0.0239).abs(),
            5e-5,
        ),
    ])
    .remark(
        "Without darts and semi-sharp tags the Catmull-Clark matrix is singular exactly where a component has no \
         boundary, crease or corner vertex, all valences 3 and a bipartite graph; that of the mid-edge scheme where it \
         has none of these vertices and a bipartite graph; the other four never. Darts, and semi-sharp edges that meet \
         no other, cure nothing; where two meet, for some steps only, they do. That such tags make nothing singular is \
         observed, not proven.",
    ))
}

/// What darts and semi-sharp tags do to kernels.
struct Colourings {
    image: f64,
    meshes: usize,
    cured: f64,
    random: usize,
    others: usize,
}

fn colourings(lab: &Lab) -> Result<Colourings> {
    let mut found = Colourings { image: 0.0, meshes: 0, cured: f64::INFINITY, random: 0, others: 0 };
    for (name, ..) in CLOSED.into_iter().filter(|c| c.1 && c.2) {
        let mesh = builtin::builtin(name)?;
        let closed = Surface::new(mesh.clone())?;
        for face in mesh.faces.iter() {
            let edge = |k: usize, s: f64| ([face[k], face[k + 1]], s);
            let of = |creases, corners| closed.tagged(&Tags { creases, corners, ..Tags::default() });
            // Edges that meet no other, sharp for ever and for a while.
            for tags in [vec![edge(0, SHARP)], vec![edge(0, 1.5)], vec![edge(0, SHARP), edge(2, 0.7)]] {
                let surface = of(tags, vec![])?;
                let colouring = Singularity::detect(&surface, CC).colouring;
                let x: Vec<f64> = colouring.iter().map(|&c| f64::from(c)).collect();
                // No ±1 is a theorem that was not applied.
                let image = if x.contains(&0.0) { f64::NAN } else { Whole::new(&surface, CC)?.image(&x) };
                found.image = largest([found.image, image]);
                found.meshes += 1;
            }
            // Two that meet, a vertex for a while.
            let meeting = vec![edge(0, SHARP), edge(1, 0.7)];
            for surface in
                [of(meeting, vec![])?, of(vec![edge(0, 1.5), edge(1, 0.7)], vec![])?, of(vec![], vec![(face[0], 0.7)])?]
            {
                let expected = Singularity::detect(&surface, CC).kernel_dimension();
                let (dimension, least) = kernel(&surface, CC)?;
                found.cured = smallest([found.cured, if dimension == expected { least } else { f64::NAN }]);
            }
        }
    }
    for scheme in [CC, Scheme::Loop] {
        let rows = each(lab.semi_sharp(scheme), |subject| {
            let expected = Singularity::detect(&subject.surface, scheme).kernel_dimension();
            Ok(kernel(&subject.surface, scheme)?.0 != expected)
        })?;
        found.random += rows.len();
        found.others += rows.iter().filter(|&&other| other).count();
    }
    Ok(found)
}

/// λ_min of a cube with one corner, and with a crease of two edges between darts.
fn cured() -> Result<[f64; 2]> {
    let cube = exact("cube")?.surface;
    let least = |tags: Tags| -> Result<f64> {
        let all = Whole::new(&cube.tagged(&tags)?, CC)?.eigenvalues()?;
        Ok(smallest(all.iter().map(|z| z.norm())))
    };
    let corner = least(Tags { corners: vec![(0, SHARP)], ..Tags::default() })?;
    let face = cube.faces().face(0);
    let path = vec![([face[0], face[1]], SHARP), ([face[1], face[2]], SHARP)];
    Ok([corner, least(Tags { creases: path, ..Tags::default() })?])
}

/// The eigenvalues of the stages: of corners, curves and the block, ascending.
fn of_stages(stages: &Stages) -> Result<Vec<f64>> {
    let mut all = stages.curves().eigenvalues();
    if !stages.block().is_empty() {
        all.extend(dense::eigenvalues(stages.block())?.a);
    }
    all.resize(stages.len(), 1.0);
    all.sort_unstable_by(f64::total_cmp);
    Ok(all)
}

fn real_spectrum(lab: &Lab) -> Result<Finding> {
    struct Row {
        least: f64,
        largest: f64,
        above_bound: f64,
        off: f64,
    }
    let mut rows = Vec::new();
    for scheme in Scheme::ALL {
        rows.extend(each(lab.creased(scheme), |subject| {
            let stages = Stages::new(&subject.surface, scheme, None)?;
            let all = of_stages(&stages)?;
            // 1 − 4w at the least.
            let curves = 1.0 - 4.0 * scheme.curve_weight();
            let bound = if stages.block().is_empty() { curves } else { curves.min(stages.block().bounds.lambda_min) };
            let mut whole = Whole::of(&stages).eigenvalues()?;
            whole.sort_unstable_by(|a, b| a.re.total_cmp(&b.re));
            let off = all.iter().zip(&whole).map(|(x, z)| (z - x).norm());
            Ok(Row { least: all[0], largest: all[all.len() - 1], above_bound: all[0] - bound, off: largest(off) })
        })?);
    }
    let mut evidence = vec![
        Evidence::above(
            "smallest eigenvalue of A, random open and creased meshes, six schemes",
            smallest(rows.iter().map(|r| r.least)),
            0.0,
        ),
        Evidence::at_most("largest eigenvalue of A", largest(rows.iter().map(|r| r.largest)), 1.0 + ROUNDING),
        Evidence::at_least(
            "smallest λ_min less its bound by curves and valences",
            smallest(rows.iter().map(|r| r.above_bound)),
            -ROUNDING,
        ),
        Evidence::at_most(
            "largest distance of an eigenvalue of all of A, which is not symmetric, from that of the stages",
            largest(rows.iter().map(|r| r.off)),
            1e-4,
        ),
        Evidence::shown("random open and creased meshes", rows.len()),
    ];
    let models = each(lab.open_models()?, |subject| {
        let stages = Stages::new(&subject.surface, Scheme::default_for(subject.surface.faces()), None)?;
        if stages.block().is_empty() {
            return Ok(None);
        }
        Ok(Some(spectrum(stages.block())?.a.min - stages.block().bounds.lambda_min))
    })?;
    let models: Vec<f64> = models.into_iter().flatten().collect();
    if !models.is_empty() {
        let least = smallest(models.iter().copied());
        evidence.push(Evidence::at_least("the same less of the smooth vertices of open models", least, -1e-9));
        evidence.push(Evidence::shown("open models by either rule of the boundary", models.len()));
    }
    let jordan = Jordan::new()?;
    Ok(Finding::settled(evidence)
        .also([
            Evidence::at_most(
                "departure of the eigenvalue of the triangle of side 7 under Loop from .366344",
                (jordan.lambda - 0.366344).abs(),
                5e-7,
            ),
            Evidence::equal("its algebraic multiplicity", jordan.algebraic, 3.0),
            Evidence::equal("its geometric multiplicity", jordan.geometric, 2.0),
            Evidence::at_most("singular value of A − λ that vanishes, the larger of two", jordan.vanishing, 1e-12),
            Evidence::above("the next one", jordan.next, 1e-4),
        ])
        .remark(
            "Real, in (0, 1] where A is non-singular, although A is not similar to a symmetric matrix: it need not be \
             diagonalisable.",
        ))
}

/// The eigenvalue that the curve and the smooth vertices of an equilateral triangle of side 7 share under Loop.
struct Jordan {
    whole: DMatrix<f64>,
    lambda: f64,
    algebraic: usize,
    geometric: usize,
    vanishing: f64,
    next: f64,
}

impl Jordan {
    fn new() -> Result<Self> {
        let surface = examined(generate::triangle(7), Boundary::EdgeOnly)?;
        let stages = Stages::new(&surface, Scheme::Loop, None)?;
        let curve = stages.curves().eigenvalues();
        let block = dense::eigenvalues(stages.block())?.a;
        let shared = |x: f64| block.iter().any(|y| (x - y).abs() <= ROUNDING);
        let lambda = smallest(curve.iter().copied().filter(|&x| shared(x)));
        let near = |list: &[f64]| list.iter().filter(|x| (*x - lambda).abs() <= ROUNDING).count();
        let whole = Whole::of(&stages).dense();
        let n = whole.nrows();
        let mut values: Vec<f64> =
            small_singular_values(&whole - DMatrix::identity(n, n) * lambda).iter().copied().collect();
        values.sort_unstable_by(f64::total_cmp);
        let geometric = values.iter().filter(|&&x| x <= ROUNDING).count();
        let [vanishing, next] =
            [geometric.saturating_sub(1), geometric].map(|k| values.get(k).copied().unwrap_or(f64::NAN));
        Ok(Jordan { lambda, algebraic: near(&curve) + near(&block), geometric, vanishing, next, whole })
    }

    /// ‖(I − A)^k e‖ over k(1 − λ)^k for two k, e being a principal vector that is no eigenvector.
    fn growth(&self, [first, second]: [usize; 2]) -> [f64; 2] {
        let n = self.whole.nrows();
        let shifted = &self.whole - DMatrix::identity(n, n) * self.lambda;
        // Of the null space of (A − λ)², what is orthogonal to that of A − λ.
        let null = |matrix: DMatrix<f64>, count: usize| -> Vec<DVector<f64>> {
            let gram = small_symmetric_eigen(matrix.transpose() * &matrix, f64::EPSILON, 0);
            let Some(gram) = gram else { return Vec::new() };
            let mut order: Vec<usize> = (0..n).collect();
            order.sort_unstable_by(|&a, &b| gram.eigenvalues[a].total_cmp(&gram.eigenvalues[b]));
            order[..count].iter().map(|&k| gram.eigenvectors.column(k).into_owned()).collect()
        };
        let eigenvectors = null(shifted.clone(), self.geometric);
        let candidates = null(&shifted * &shifted, self.algebraic).into_iter().map(|mut x| {
            for v in &eigenvectors {
                let along = v.dot(&x);
                x -= v * along;
            }
            x
        });
        let Some(mut error) = candidates.max_by(|a, b| a.norm().total_cmp(&b.norm())) else { return [f64::NAN; 2] };
        let mut found = [f64::NAN; 2];
        for k in 1..=second {
            error -= &self.whole * &error;
            let scaled = error.norm() / (k as f64 * (1.0 - self.lambda).powi(k as i32));
            if k == first {
                found[0] = scaled;
            }
            found[1] = scaled;
        }
        found
    }
}

/// The largest radius of one iteration over some meshes, all six schemes.
struct Radii {
    name: &'static str,
    largest: f64,
}

fn iterations_converge(lab: &Lab) -> Result<Finding> {
    const NAMES: [&str; 9] = [
        "PIA",
        "PIA with ω = 1.9",
        "Jacobi with ω = ½",
        "Gauss-Seidel in file order",
        "Gauss-Seidel, curves last",
        "Gauss-Seidel in random order",
        "SOR with ω = 0.5 in random order",
        "SOR with ω = 1.5 in random order",
        "SOR with ω = 1.9, curves last",
    ];
    let mut all = NAMES.map(|name| Radii { name, largest: 0.0 });
    let (mut over, mut meshes, mut left_out) = (f64::NEG_INFINITY, 0usize, 0usize);
    for scheme in Scheme::ALL {
        let random = lab.creased(scheme).iter().take(SWEPT);
        let models = lab.open_models()?.iter().filter(|s| s.suits(scheme) && s.surface.len() <= DENSE);
        for subject in random.chain(models) {
            let stages = Stages::new(&subject.surface, scheme, None)?;
            let stage = of_stages(&stages)?;
            if stage[0] < DEFECTIVE {
                left_out += 1;
                continue;
            }
            meshes += 1;
            let whole = Whole::of(&stages);
            let order = |order: Order| order.order(subject.surface.mesh(), subject.surface.incidence());
            let (file, random) = (order(Order::File), order(Order::Random(7)));
            let is_smooth = |v: u32| subject.surface.features().is_none_or(|f| f.is_smooth(v as usize));
            let (mut last, curves): (Vec<u32>, Vec<u32>) = file.iter().partition(|&&v| is_smooth(v));
            last.extend(curves);
            let relaxations = [
                Relaxation::Pia(1.0),
                Relaxation::Pia(1.9),
                Relaxation::Jacobi(0.5),
                Relaxation::Sor(1.0, &file),
                Relaxation::Sor(1.0, &last),
                Relaxation::Sor(1.0, &random),
                Relaxation::Sor(0.5, &random),
                Relaxation::Sor(1.5, &random),
                Relaxation::Sor(1.9, &last),
            ];
            for (radii, relaxation) in all.iter_mut().zip(relaxations) {
                let radius = whole.radius(relaxation)?;
                radii.largest = largest([radii.largest, radius]);
                if let Relaxation::Pia(1.0) = relaxation {
                    over = largest([over, radius - (1.0 - stage[0])]);
                }
            }
        }
    }
    let radii = all.iter().map(|r| Evidence::below(format!("largest spectral radius of {}", r.name), r.largest, 1.0));
    let stop = |subject: &Subject| Stop { tolerance: 1e-10 * subject.surface.diagonal(), max_iterations: 10_000 };
    let runs = each(lab.open_models()?, |subject| {
        let stages = Stages::new(&subject.surface, Scheme::default_for(subject.surface.faces()), None)?;
        let run = |method| staged::run(&stages, subject.surface.positions(), method, &stop(subject)).report.outcome;
        let methods = [Method::Pia, Method::Thall, Method::GaussSeidel { order: None }];
        Ok(methods.into_iter().filter(|&m| run(m) != Outcome::Converged).count())
    })?;
    let mut finding = Finding::settled(radii.collect()).also([
        Evidence::at_most("largest radius of PIA less that of its stages", over, DEFECTIVE),
        Evidence::shown("open and creased meshes, six schemes", meshes),
        Evidence::shown("of them singular, and left out", left_out),
    ]);
    if !runs.is_empty() {
        finding = finding.also([
            Evidence::equal(
                "runs of PIA, Jacobi and Gauss-Seidel on open models that did not converge",
                runs.iter().sum::<usize>(),
                0.0,
            ),
            Evidence::shown("open models by either rule of the boundary", runs.len()),
        ]);
    }
    Ok(finding.remark(
        "On all vertices together, curves and corners too, in whatever order: each error matrix is block triangular, \
         and its blocks are those of symmetric positive definite systems. PIA's radius is 1 − λ_min, that of curves \
         2/3 at the most.",
    ))
}

/// ‖I − A‖ in the norm of diag(w).
fn contraction(whole: &DMatrix<f64>, w: &[f64]) -> f64 {
    let n = w.len();
    let scaled = DMatrix::from_fn(n, n, |i, j| {
        let identity = if i == j { 1.0 } else { 0.0 };
        (identity - whole[(i, j)]) * (w[i] / w[j]).sqrt()
    });
    largest(small_singular_values(scaled).iter().copied())
}

/// h⁻¹ at smooth vertices; at the others what the rule makes of it.
fn weights(surface: &Surface, scheme: Scheme, other: impl Fn(Rule, f64) -> f64) -> Vec<f64> {
    let rule = |v: usize| surface.features().map_or(Rule::Smooth, |f| f.rules()[v]);
    // A vertex of the boundary has an edge more than faces.
    let mut valence: Vec<usize> = (0..surface.len()).map(|v| surface.incidence().face_count(v)).collect();
    surface.boundary_half_edges().iter().for_each(|&c| valence[surface.faces().corners()[c as usize] as usize] += 1);
    let weight = |v: usize| {
        let own = 1.0 / scheme.h(valence[v]);
        match rule(v) {
            Rule::Smooth => own,
            sharp => other(sharp, own),
        }
    };
    (0..surface.len()).map(weight).collect()
}

fn norms(lab: &Lab) -> Result<Finding> {
    /// Meshes nearer to singular ones need a K as large as 1/λ_min.
    const LEAST: f64 = 0.01;
    const POWERS: i32 = 8;
    let mut rows = Vec::new();
    for scheme in Scheme::ALL {
        rows.extend(each(&lab.creased(scheme)[..SWEPT.min(lab.creased(scheme).len())], |subject| {
            let stages = Stages::new(&subject.surface, scheme, None)?;
            if of_stages(&stages)?[0] < LEAST {
                return Ok(None);
            }
            let whole = Whole::of(&stages).dense();
            let plain = contraction(&whole, &weights(&subject.surface, scheme, |_, own| own));
            let by = |power: i32| {
                let k = 10.0f64.powi(power);
                let weight = |rule, _| if rule == Rule::Corner { k * k } else { k };
                contraction(&whole, &weights(&subject.surface, scheme, weight))
            };
            Ok(Some((plain, (0..=POWERS).find(|&power| by(power) < 1.0))))
        })?);
    }
    let rows: Vec<(f64, Option<i32>)> = rows.into_iter().flatten().collect();
    // Twenty triangles at a vertex of the boundary.
    let triangles = (1..=20).map(|k| [0, k, k + 1]);
    let fan = Mesh::new(random_points(22, 1), Faces::from_lists(triangles.collect::<Vec<_>>()));
    let fan = |scheme: Scheme| -> Result<f64> {
        let surface = examined(fan.clone(), Boundary::EdgeOnly)?;
        Ok(contraction(&Whole::new(&surface, scheme)?.dense(), &weights(&surface, scheme, |_, own| own)))
    };
    let jordan = Jordan::new()?;
    let [first, second] = jordan.growth([100, 200]);
    Ok(Finding::settled(vec![
        Evidence::equal(
            "random meshes on which no K up to 10⁸ makes ‖I − A‖ < 1, six schemes",
            rows.iter().filter(|r| r.1.is_none()).count(),
            0.0,
        ),
        Evidence::shown("random open and creased meshes with λ_min of 0.01 and more", rows.len()),
        Evidence::shown(
            "largest power of 10 needed for K",
            f64::from(rows.iter().filter_map(|r| r.1).max().unwrap_or(0)),
        ),
        Evidence::shown("of them with ‖I − A‖ ≥ 1 in the plain norm H⁻¹", rows.iter().filter(|r| r.0 >= 1.0).count()),
        Evidence::above(
            "‖I − A‖ in the plain norm H⁻¹, 20 triangles at a boundary vertex under Loop",
            fan(Scheme::Loop)?,
            1.0,
        ),
        Evidence::above("the same under Catmull-Clark", fan(CC)?, 1.0),
        Evidence::at_most(
            "departure from 1 of ‖e^k‖/(kρ^k) at k = 200 over that at 100, triangle of side 7",
            (second / first - 1.0).abs(),
            0.05,
        ),
    ])
    .remark(
        "W = diag(K² at corners, K on curves, 1/h at smooth vertices). The plain norm, with 1/h of its own valence at \
         every vertex, is not enough: many faces at a boundary vertex refute it. Where A cannot be diagonalised errors \
         fall like kρ^k, not ρ^k.",
    ))
}

/// What s leaves of the crease in the row of a regular vertex: row = θ·smooth + (1 − θ)·crease.
fn theta(sharpness: f64) -> f64 {
    0.5f64.powf(sharpness.floor()) * (1.0 - sharpness.fract() / 2.0)
}

/// Two loops of a torus of 6 × 6 vertices, straight through them, with their sharpness.
fn loops(sharpness: [f64; 2]) -> Vec<(Vec<u32>, f64)> {
    [0, 3].into_iter().zip(sharpness).map(|(j, s)| ((0..6).map(|i| 6 * i + j).collect(), s)).collect()
}

fn semi_sharp_curves(lab: &Lab) -> Result<Finding> {
    let (mut asymmetry, mut form, mut imaginary, mut least, mut count) = (0.0, 0.0, 0.0, f64::INFINITY, 0usize);
    for (scheme, name) in [(CC, "torus:6x6"), (Scheme::Loop, "tri-torus:6x6")] {
        let smooth = exact(name)?;
        let LimitSystem { h, m, .. } = smooth.system(scheme)?;
        for step in 1..=8 {
            let s = 0.5 * f64::from(step);
            let loops = loops([s, s + 0.7]);
            let sides = |(vertices, s): &(Vec<u32>, f64)| {
                let next = vertices.iter().cycle().skip(1);
                vertices.iter().zip(next).map(|(&a, &b)| ([a, b], *s)).collect::<Vec<_>>()
            };
            let tags = Tags { creases: loops.iter().flat_map(sides).collect(), ..Tags::default() };
            let whole = Whole::new(&smooth.surface.tagged(&tags)?, scheme)?;
            let n = whole.len();
            let mut scale: Vec<f64> = h.iter().map(|h| 1.0 / h).collect();
            let mut expected = DMatrix::from_fn(n, n, |i, j| m.get(i, j));
            for (vertices, s) in &loops {
                let theta = theta(*s);
                let (before, after) =
                    (vertices.iter().cycle().skip(vertices.len() - 1), vertices.iter().cycle().skip(1));
                for ((&v, &a), &b) in vertices.iter().zip(before).zip(after) {
                    let [v, a, b] = [v, a, b].map(|v| v as usize);
                    let weight = (1.0 / theta - 1.0) / h[v];
                    for (j, part) in [(v, 4.0), (a, 1.0), (b, 1.0)] {
                        expected[(v, j)] += weight * part / 6.0;
                    }
                    scale[v] /= theta;
                }
            }
            let a = whole.dense();
            let scaled = DMatrix::from_fn(n, n, |i, j| scale[i] * a[(i, j)]);
            asymmetry = largest([asymmetry, (&scaled - scaled.transpose()).amax()]);
            form = largest([form, (&scaled - expected).amax()]);
            let all = whole.eigenvalues()?;
            imaginary = largest([imaginary, largest(all.iter().map(|z| z.im.abs()))]);
            least = smallest([least, smallest(all.iter().map(|z| z.re))]);
            count += 1;
        }
    }
    // Where a semi-sharp edge ends on the boundary, its row is one of the curve alone.
    let mut ends = 0.0;
    for scheme in [CC, Scheme::Loop] {
        for step in 1..=8 {
            let s = 0.5 * f64::from(step);
            let surface = examined(generate::triangle(4), Boundary::EdgeOnly)?;
            // From the middle of the first side inward.
            let inward = ([2, 6], s);
            let tags = Tags { creases: vec![inward], boundary: Boundary::EdgeOnly, ..Tags::default() };
            let a = Whole::new(&surface.tagged(&tags)?, scheme)?.dense();
            let theta = theta(s);
            let row = [(1, theta / 6.0), (2, 1.0 - theta / 3.0), (3, theta / 6.0)];
            let expected = DVector::from_fn(a.ncols(), |j, _| row.iter().find(|r| r.0 == j).map_or(0.0, |r| r.1));
            ends = largest([ends, (a.row(2).transpose() - expected).amax()]);
        }
    }
    let mut irregular: f64 = 0.0;
    for scheme in [CC, Scheme::Loop] {
        let rows = each(lab.semi_sharp(scheme), |subject| Whole::new(&subject.surface, scheme)?.eigenvalues())?;
        irregular = largest([irregular, largest(rows.iter().flatten().map(|z| z.im.abs()))]);
    }
    Ok(Finding::settled(vec![
        Evidence::at_most("largest asymmetry of DA with D = 1/(θh) on the curves, 1/h beside", asymmetry, ROUNDING),
        Evidence::at_most(
            "largest departure of DA from M + Σ (1/θ − 1)/h · (1, 4, 1)/6 along the curves",
            form,
            ROUNDING,
        ),
        Evidence::at_most("largest |Im λ| of A", imaginary, 1e-9),
        Evidence::above("smallest eigenvalue of A", least, 0.0),
        Evidence::shown("tori with two semi-sharp loops, s = ½ … 4, Catmull-Clark and Loop", count),
        Evidence::at_most("largest departure of a row where a semi-sharp edge meets the boundary", ends, ROUNDING),
        Evidence::above("largest |Im λ| on random meshes with darts and semi-sharp tags anywhere", irregular, 1e-3),
    ])
    .remark(
        "Semi-sharp curves with one sharpness along each, straight through regular vertices, only add a positive \
         definite part to M. Elsewhere A is not similar to a symmetric matrix: there are complex eigenvalues.",
    ))
}

fn straightforward(lab: &Lab) -> Result<Finding> {
    let scheme = Scheme::ZhengCai;
    struct Row {
        least: f64,
        dominance: f64,
        sweeps: f64,
        jacobi: f64,
        off: f64,
    }
    let subjects: Vec<&Subject> = lab.creased(scheme).iter().chain(lab.open_models()?).collect();
    let rows = subjects.iter().map(|subject| {
        let stages = Stages::new(&subject.surface, scheme, None)?;
        let whole = Whole::of(&stages);
        let small = subject.surface.len() <= DENSE;
        let file: Vec<u32> = (0..subject.surface.len() as u32).collect();
        let radius = |relaxation| if small { whole.radius(relaxation) } else { Ok(0.0) };
        let size = subject.surface.diagonal();
        let stop = Stop { tolerance: 1e-11 * size, max_iterations: 1000 };
        let gauss_seidel = Method::GaussSeidel { order: None };
        let control = staged::run(&stages, subject.surface.positions(), gauss_seidel, &stop).points;
        let matrix = stages.matrix();
        let off = (0..control.len()).map(|v| matrix.row_times(v, &control).distance(subject.surface.positions()[v]));
        Ok(Row {
            least: if small { of_stages(&stages)?[0] } else { f64::INFINITY },
            dominance: smallest((0..whole.len()).map(|i| whole.excess(i))),
            sweeps: radius(Relaxation::Sor(1.0, &file))?,
            jacobi: radius(Relaxation::Jacobi(1.0))?,
            off: largest(off) / size,
        })
    });
    let rows = rows.collect::<Result<Vec<Row>>>()?;
    Ok(Finding::reproduced(vec![
        Evidence::above(
            "smallest diagonal entry less the sum of the others of its row, open and creased meshes",
            smallest(rows.iter().map(|r| r.dominance)),
            0.0,
        ),
        Evidence::at_least("smallest eigenvalue of A", smallest(rows.iter().map(|r| r.least)), 0.5 - ROUNDING),
        Evidence::below(
            "largest spectral radius of Gauss-Seidel on all of A",
            largest(rows.iter().map(|r| r.sweeps)),
            1.0,
        ),
        Evidence::below("that of undamped Jacobi", largest(rows.iter().map(|r| r.jacobi)), 1.0),
        Evidence::at_most(
            "largest distance of a limit point from its vertex over L after Gauss-Seidel",
            largest(rows.iter().map(|r| r.off)),
            1e-10,
        ),
        Evidence::shown("open and creased meshes", rows.len()),
    ])
    .remark(
        "With the row (1, 6, 1)/8 of a quadratic B-spline along boundaries and creases the system is as dominant as on \
         closed meshes, eigenvalues stay in [½, 1], Gauss-Seidel and Jacobi converge. Here of the control points; \
         the surface needs points of its curves, which the paper does not give: Chaikin's ¾a + ¼b are W with the edge as a \
         face of two corners, and with them both phases go as printed.",
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn variants_are_what_they_say() {
        let mesh = builtin::builtin("cube").unwrap();
        let singular: Vec<usize> =
            variants(&mesh).unwrap().iter().map(|(s, _)| Singularity::detect(s, CC).kernel_dimension()).collect();
        assert_eq!(singular, [1, 0, 0, 0, 0, 2, 1, 1]);
    }
}
