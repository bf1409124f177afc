//! Singularity of limit systems: whether one is singular, why, whether the data excite it, and what each method makes of
//! it.
//!
//! Theory, on closed meshes with all valences ≥ 3: each scheme has its [`SingularSet`]. Under Catmull-Clark A is singular
//! exactly when some connected component has all valences 3 and a bipartite edge graph; its null vector is the ±1
//! colouring. Schemes with positive lower bounds are never singular. A component with a boundary, crease or corner vertex
//! is none of these: its null vector would vanish there, and with the sums over its edges everywhere. Darts, of edges that are
//! sharp for ever or for some steps, cure nothing: one step takes the ±1 vector to 0 at vertices of valence 3, at midpoints and
//! at centroids. Where two semi-sharp edges meet, or a vertex is semi-sharp itself, it leaves ½ and more.

use glam::DVec3;

use super::dense;
use super::inertia::eigenvalues_below;
use super::subspace_iteration::{self, Cluster, EigenpairRequest, Eigenpairs, Eigenvalue, End};
use super::symmetric::{SymmetricForm, scales, symmetric};
use crate::assemble::LimitSystem;
use crate::error::Result;
use crate::mesh::Surface;
use crate::mesh::incidence::{next_in, prev_in};
use crate::schemes::{Scheme, SingularSet};
use crate::solvers::{Accelerated, Method};

/// A component on which A is singular.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SingularComponent {
    /// The least number of its vertices.
    pub first_vertex: usize,
    /// How many vertices it has.
    pub vertices: usize,
    /// The mean of ±p_i over the component, signed by the colouring: the constant part of the error that no control
    /// points can remove. In mesh units.
    pub unreachable: DVec3,
}

/// The verdict of theory.
#[derive(Clone, Debug, PartialEq)]
pub struct Singularity {
    /// Which components the scheme's matrix is singular on.
    pub set: SingularSet,
    /// Connected components of the mesh.
    pub components: usize,
    /// Components on which A is singular, by first vertex; one null vector each.
    pub singular: Vec<SingularComponent>,
    /// The null vectors, all in one: ±1 on singular components, 0 elsewhere. Restricted to one component it is
    /// that component's null vector, of A and of D⁻¹A.
    pub colouring: Vec<i8>,
    /// Whether the points have a part that no control points reach, beyond rounding: then there is no solution.
    pub excited: bool,
}

/// What a method will do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Prediction {
    /// Non-singular: the solution.
    Converges,
    /// Singular, not excited: the solution of least ‖H^-½V‖₂, whose null part is that of the points, zero.
    MinimumNorm,
    /// Singular, not excited: one of the solutions; which one depends on the method.
    SomeSolution,
    /// Singular and excited: the error stalls at the unreachable part while V grows along the null vector.
    Drifts,
    /// Singular: a factorization that looks at its pivots, or at the smallest eigenvalue, says so.
    Refuses,
}

impl Prediction {
    /// What the method does, in words.
    pub fn name(self) -> &'static str {
        match self {
            Prediction::Converges => "converges",
            Prediction::MinimumNorm => "converges to the minimum-norm solution",
            Prediction::SomeSolution => "converges to some solution",
            Prediction::Drifts => "drifts",
            Prediction::Refuses => "refuses",
        }
    }
}

impl Singularity {
    /// Decides from the mesh alone. The points are the mesh's positions. O(corners).
    pub fn detect(surface: &Surface, scheme: Scheme) -> Self {
        let (mesh, topology) = (surface.mesh(), surface.topology());
        let (component, components) = topology.components(&mesh.faces);
        let set = scheme.singular_set();
        let mut verdict =
            Singularity { set, components, singular: Vec::new(), colouring: vec![0; mesh.len()], excited: false };
        let SingularSet::Bipartite { valence } = set else {
            return verdict;
        };
        let mut colour = colour(surface);
        let mut regular = vec![false; components];
        let held = surface.features().map(|features| features.held_at_first(surface));
        for v in 0..mesh.len() {
            let bad = valence.is_some_and(|valence| topology.incidence.face_count(v) != valence)
                || held.as_ref().is_some_and(|held| held[v])
                || neighbours(surface, v).any(|w| colour[w] == colour[v]);
            if bad {
                regular[component[v] as usize] = true;
            }
        }
        let mut found: Vec<Option<usize>> = vec![None; components];
        let largest = mesh.positions.iter().fold(0.0f64, |m, p| m.max(p.abs().max_element()));
        for v in 0..mesh.len() {
            let c = component[v] as usize;
            if regular[c] {
                colour[v] = 0;
                continue;
            }
            let at = *found[c].get_or_insert_with(|| {
                verdict.singular.push(SingularComponent { first_vertex: v, vertices: 0, unreachable: DVec3::ZERO });
                verdict.singular.len() - 1
            });
            let here = &mut verdict.singular[at];
            here.vertices += 1;
            here.unreachable += f64::from(colour[v]) * mesh.positions[v];
        }
        for here in &mut verdict.singular {
            here.unreachable /= here.vertices as f64;
            // The mean of n numbers by a plain sum: rounding errors of a small multiple of ε times their size.
            let rounding = 64.0 * f64::EPSILON * largest;
            verdict.excited |= here.unreachable.abs().max_element() > rounding;
        }
        verdict.colouring = colour;
        verdict
    }

    /// The number of independent null vectors.
    pub fn kernel_dimension(&self) -> usize {
        self.singular.len()
    }

    /// Whether A has a null vector.
    pub fn is_singular(&self) -> bool {
        !self.singular.is_empty()
    }

    /// What `method` will do from V = P, its parameters within their limits: an ω below the critical one, for
    /// Chebyshev an interval that begins at the least positive eigenvalue.
    ///
    /// Simultaneous and sweeping relaxations of a semidefinite system converge if it is soluble (Keller 1965), and
    /// else move by the same step along the null space in each iteration.
    pub fn prediction(&self, method: Method) -> Prediction {
        if !self.is_singular() {
            return Prediction::Converges;
        }
        let soluble = match method {
            Method::Lu | Method::Cholesky | Method::SecondCholesky | Method::Ldlt => return Prediction::Refuses,
            // Updates lie in the range of A = H M, which is H^-1-orthogonal to the null space.
            Method::Pia
            | Method::WPia { .. }
            | Method::Anderson { of: Accelerated::Pia { .. }, .. }
            | Method::HeavyBall { .. }
            | Method::Chebyshev { .. }
            | Method::Cg => Prediction::MinimumNorm,
            Method::Jacobi { .. }
            | Method::Thall
            | Method::GaussSeidel { .. }
            | Method::Sor { .. }
            | Method::Ssor { .. }
            | Method::PlainCg
            | Method::PcgJacobi
            | Method::PcgSsor { .. }
            | Method::PcgIc0
            | Method::Anderson { of: Accelerated::Jacobi { .. }, .. } => Prediction::SomeSolution,
        };
        if self.excited { Prediction::Drifts } else { soluble }
    }
}

/// ±1 by breadth-first levels along edges.
pub(super) fn colour(surface: &Surface) -> Vec<i8> {
    let mesh = surface.mesh();
    let mut colour = vec![0i8; mesh.len()];
    let mut queue: Vec<usize> = Vec::with_capacity(mesh.len());
    for seed in 0..mesh.len() {
        if colour[seed] != 0 {
            continue;
        }
        colour[seed] = 1;
        let mut next = queue.len();
        queue.push(seed);
        while let Some(&v) = queue.get(next) {
            next += 1;
            for w in neighbours(surface, v) {
                if colour[w] == 0 {
                    colour[w] = -colour[v];
                    queue.push(w);
                }
            }
        }
    }
    colour
}

/// The other ends of the edges at `v`; on closed meshes each comes twice.
fn neighbours<'a>(surface: &'a Surface, v: usize) -> impl Iterator<Item = usize> + 'a {
    let (mesh, topology) = (surface.mesh(), surface.topology());
    let corners = mesh.faces.corners();
    topology.incidence.corners_at(v).iter().flat_map(move |&c| {
        let range = mesh.faces.range(topology.incidence.face_of(c));
        [next_in(&range, c), prev_in(&range, c)].map(|d| corners[d as usize] as usize)
    })
}

/// Eigenvalues of A below this count as zero: far above rounding, far below any eigenvalue that is not zero on meshes
/// of fewer than some ten thousand vertices in a chain of prisms.
pub const ZERO: f64 = 1e-10;

/// The number of eigenvalues of A that are zero to [`ZERO`], by numbers alone: dense for small systems, else the
/// inertia of A − [`ZERO`], which rounding moves by a tenth of that at most. Holds for any matrix with λ_min ≥ 0.
///
/// # Errors
/// As [`eigenvalues_below`].
pub fn numerical_kernel_dimension(system: &LimitSystem) -> Result<usize> {
    if system.len() <= dense::LARGEST {
        let all = dense::eigenvalues(system)?.a;
        return Ok(all.iter().filter(|l| l.abs() <= ZERO).count());
    }
    Ok(eigenvalues_below(system, SymmetricForm::A, ZERO)?.below)
}

/// Relative accuracy of the eigenvalues of modes, within which they count as equal.
const ACCURACY: f64 = 1e-9;

/// A slow mode: an eigenvector of A or D⁻¹A at an end of the spectrum.
#[derive(Clone, Debug, PartialEq)]
pub struct SlowMode {
    /// The eigenvalue of A or D⁻¹A, with its error.
    pub eigenvalue: Eigenvalue,
    /// The eigenvector at the vertices, of largest entry 1: what a control net's error looks like.
    pub values: Vec<f64>,
    /// (Σ x²)²/(N Σ x⁴) of the symmetric matrix' eigenvector: 1 if spread evenly, 1/N on a single vertex.
    pub participation: f64,
}

/// Modes at one end of a spectrum.
#[derive(Clone, Debug, PartialEq)]
pub struct SlowModes {
    /// From the end inwards, those of a multiple eigenvalue one after the other.
    pub modes: Vec<SlowMode>,
    /// Their distinct eigenvalues, in the same order.
    pub clusters: Vec<Cluster>,
    /// Whether all eigenvalues have their accuracy, 1e-9 relative.
    pub converged: bool,
}

/// The `count` modes at one end, with multiplicity: null and near-null vectors at the lowest. In a multiple
/// eigenvalue's space the vectors are an arbitrary basis, orthonormal before they are scaled. Dense up to
/// [`dense::LARGEST`] vertices, where every multiplicity is known; by [subspace iteration](subspace_iteration) beyond, where
/// that of the last eigenvalue may be larger.
///
/// # Errors
/// As [`subspace_iteration::extreme`] and [`dense::eigenpairs`].
///
/// ```
/// use limitlab::analysis::singularity::modes;
/// use limitlab::analysis::{subspace_iteration::End, symmetric::SymmetricForm};
/// use limitlab::assemble::LimitSystem;
/// use limitlab::mesh::{Surface, builtin};
/// use limitlab::schemes::Scheme;
///
/// let icosahedron = Surface::new(builtin::builtin("icosahedron")?)?;
/// let system = LimitSystem::new(&icosahedron, Scheme::Loop)?;
/// let slowest = modes(&system, SymmetricForm::A, End::Lowest, 5)?;
/// // The graph's eigenvalue −√5 has multiplicity 3, −1 has 5.
/// assert_eq!(slowest.clusters.iter().map(|c| c.multiplicity).collect::<Vec<_>>(), [3, 5]);
/// # Ok::<(), limitlab::Error>(())
/// ```
pub fn modes(system: &LimitSystem, form: SymmetricForm, end: End, count: usize) -> Result<SlowModes> {
    let s = symmetric(system, form);
    let pairs = if system.len() <= dense::LARGEST {
        let (values, mut vectors) = dense::eigenpairs(&s)?;
        let eigenvalue = |(value, x): (f64, &Vec<f64>)| {
            let (_, residual) = super::lanczos::rayleigh(&s, x);
            Eigenvalue { value, residual, error: residual }
        };
        let mut values: Vec<Eigenvalue> = values.into_iter().zip(&vectors).map(eigenvalue).collect();
        if end == End::Highest {
            values.reverse();
            vectors.reverse();
        }
        Eigenpairs { values, vectors, converged: true, applications: 0 }
    } else {
        let b = &system.bounds;
        let spectrum = match form {
            SymmetricForm::A => (b.lambda_min, b.lambda_max),
            SymmetricForm::Jacobi => (b.jacobi_lambda_min, b.jacobi_lambda_max),
        };
        subspace_iteration::extreme(&s, &EigenpairRequest { end, count, tolerance: ACCURACY, spectrum })?
    };
    let mut clusters = pairs.clusters(ACCURACY);
    // All pairs of a small matrix are known: the last one is no part of a larger cluster.
    if let Some(last) = clusters.last_mut().filter(|_| pairs.values.len() == system.len()) {
        last.complete = true;
    }
    let mut before = 0;
    clusters.retain(|cluster| {
        let is_reached = before < count;
        before += cluster.multiplicity;
        is_reached
    });
    let scale = scales(system, form);
    let mode = |(eigenvalue, x): (Eigenvalue, Vec<f64>)| {
        let squares: f64 = x.iter().map(|x| x * x).sum();
        let fourth: f64 = x.iter().map(|x| x.powi(4)).sum();
        let mut values: Vec<f64> = x.iter().zip(&scale).map(|(x, s)| x * s).collect();
        let largest = values.iter().fold(0.0f64, |m, &v| if v.abs() > m.abs() { v } else { m });
        values.iter_mut().for_each(|v| *v /= largest);
        SlowMode { eigenvalue, values, participation: squares * squares / (x.len() as f64 * fourth) }
    };
    let modes = pairs.values.into_iter().zip(pairs.vectors).take(count).map(mode).collect();
    Ok(SlowModes { modes, clusters, converged: pairs.converged })
}
