//! Dirichlet-Neumann bracketing: two-sided bounds of an end of a spectrum, with its multiplicity, by work around
//! exceptional vertices only.
//!
//! With σ = 1 for the lower end and −1 for the upper, σM is a sum of one element a face and one number a vertex,
//!
//! `σ xᵀMx = Σ_F x_Fᵀ(t_F I + σB_F)x_F + Σ_i c_i g_i x_i²`,
//!
//! B_F being what face F adds between its corners, the circulant of the scheme, t_F the least number that makes the
//! element positive semidefinite, and g_i = 1/h_i for A, m_ii for D⁻¹A. So every eigenvalue of σA (σD⁻¹A) is at
//! least min c_i, and where c_i is less than a number μ at a few vertices only, the eigenvalues below μ belong to
//! their surroundings. Take disjoint patches around these vertices. Leaving away all elements that do not lie
//! within a patch makes the form smaller, and what is left falls apart into patches ("Neumann") and vertices with
//! c_i ≥ μ; vectors that vanish but in the inside of one patch ("Dirichlet") do not couple to another patch. By
//! Courant and Fischer, for every s ≤ μ
//!
//! `Σ_patches #{Dirichlet eigenvalues < s} ≤ #{eigenvalues < s} ≤ Σ_patches #{Neumann eigenvalues < s}`
//!
//! (Dirichlet-Neumann bracketing: Reed and Simon IV, XIII.15). Modes below μ decay exponentially away from the
//! exceptional vertices, so the two sides meet as the patches grow. Where they meet they give the end of the
//! spectrum, and the number of eigenvalues that are equal to it within the accuracy. The counts come from
//! factorizations (Sylvester's law of inertia) at shifts that are moved by more than rounding may hide, one for each kind of
//! patch: patches that a renumbering maps onto each other are computed once. The cost does not depend on N but for one look at every vertex.

use std::f64::consts::TAU;
use std::sync::Arc;

use chacha20::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

use super::inertia::{LARGEST_BACKWARD_ERROR, inertia};
use super::lanczos;
use super::subspace_iteration::End;
use super::symmetric::SymmetricForm;
use crate::assemble::Csr;
use crate::assemble::csr::Pattern;
use crate::assemble::system::valences;
use crate::error::Result;
use crate::mesh::topology::NONE;
use crate::mesh::{Faces, Surface, Topology};
use crate::parallel;
use crate::schemes::{Masks, Scheme};

/// Larger faces have no patch: their elements are dense.
const LARGEST_FACE: usize = 64;
/// Exceptional vertices at most, and at most this part of all.
const EXCEPTIONAL: usize = 256;
const PART: usize = 200;
/// Vertices of all kinds of patches together at most.
const MOST_VERTICES: usize = 200_000;
/// Rings of faces of the first patches.
const FIRST_RINGS: usize = 4;
/// Patches grow by this factor at most from one attempt to the next.
const LEAP: f64 = 3.0;
/// The least relative accuracy of a result where patches cannot grow as far as is asked.
const LEAST_TOLERANCE: f64 = 2e-6;
/// Rings without a mode below the level at which to give up.
const UNBOUND_RINGS: usize = 60;
/// What a mode is bound by, over the last change of its value, from where on the decay is read off.
const RESOLVED: f64 = 3.0;
/// How far below the accuracy the estimated error is to be before the first attempt to factor.
const SPARE: f64 = 4.0;
/// Attempts to factor at most.
const FACTORED: usize = 3;
/// Corners to start from when patches are compared, at most.
const STARTS: usize = 48;
/// Lanczos steps for the lowest eigenvalue of a patch at most.
const STEPS: usize = 4000;
/// What rounding may hide in a count: that of the factorization, and as much again, which is far above that of the entries of
/// a patch (fewer than 10³ roundings each, of rows that sum to a few units).
const ALLOWANCE: f64 = 2.0 * LARGEST_BACKWARD_ERROR;
/// Potentials closer than this are one: they differ by rounding.
const ROUNDING: f64 = 1e-12;

/// An end of the spectrum between two proven bounds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bracket {
    /// The least eigenvalue of the patches, as the Lanczos process has it.
    pub value: f64,
    /// The end of the spectrum lies within this distance of the value.
    pub width: f64,
    /// Eigenvalues within `width` of the value, with multiplicity.
    pub multiplicity: usize,
    /// No other eigenvalue lies between this and the value.
    pub next: f64,
    /// What was computed: rings of faces around the exceptional vertices, patches, kinds of them, vertices of all
    /// kinds together.
    pub rings: usize,
    /// Disjoint patches, each around one exceptional vertex or several close to each other.
    pub patches: usize,
    /// Kinds of patches; those that a renumbering maps onto each other are of one kind.
    pub kinds: usize,
    /// Vertices of one patch of each kind, added up.
    pub vertices: usize,
}

/// σM as elements and potentials.
struct Form<'a> {
    faces: &'a Faces,
    topology: &'a Topology,
    /// By face size: σ times what a face adds between a corner and the one k steps further.
    couplings: Vec<Vec<f64>>,
    /// By face size: t.
    shifts: Vec<f64>,
    /// c_i and g_i.
    potential: Vec<f64>,
    metric: Vec<f64>,
}

impl<'a> Form<'a> {
    /// `None` if the mesh has a boundary or a face that is too large.
    fn new(surface: &'a Surface, scheme: Scheme, which: SymmetricForm, end: End) -> Option<Self> {
        let faces = surface.faces();
        let mut occurs = [false; LARGEST_FACE + 1];
        for face in faces.iter() {
            *occurs.get_mut(face.len())? = true;
        }
        if !surface.is_closed() {
            return None;
        }
        let topology = surface.topology();
        let sign = match end {
            End::Lowest => 1.0,
            End::Highest => -1.0,
        };
        let mut couplings = vec![Vec::new(); LARGEST_FACE + 1];
        let mut shifts = vec![0.0; LARGEST_FACE + 1];
        for size in (1..=LARGEST_FACE).filter(|&size| occurs[size]) {
            couplings[size] = coupling(scheme, size);
            couplings[size].iter_mut().for_each(|b| *b *= sign);
            let least = eigenvalues(&couplings[size]);
            shifts[size] = -least.into_iter().fold(f64::INFINITY, f64::min);
        }
        let valences = valences(surface);
        let incidence = &topology.incidence;
        let pairs = parallel::collect(valences.len(), |v| {
            let n = valences[v];
            let (mut diagonal, mut shift) = (scheme.vertex_weight(n as usize), 0.0);
            for &c in incidence.corners_at(v) {
                let size = faces.range(incidence.face_of(c)).len();
                diagonal += scheme.face_weight(size, 0);
                shift += shifts[size];
            }
            let g = match which {
                SymmetricForm::A => 1.0 / scheme.h(n as usize),
                SymmetricForm::Jacobi => diagonal,
            };
            ((sign * diagonal - shift) / g, g)
        });
        let (potential, metric) = pairs.into_iter().unzip();
        Some(Form { faces, topology, couplings, shifts, potential, metric })
    }

    /// μ and the vertices with c_i < μ: as many as are allowed.
    fn exceptional(&self) -> (f64, Vec<u32>) {
        let n = self.potential.len();
        let mut sorted = self.potential.clone();
        let place = (n / PART).clamp(1, EXCEPTIONAL).min(n - 1);
        let (_, &mut level, _) = sorted.select_nth_unstable_by(place, f64::total_cmp);
        let level = level - ROUNDING;
        let found = (0..n as u32).filter(|&v| self.potential[v as usize] < level);
        (level, found.collect())
    }
}

/// What a face of `size` corners adds to M between a corner and the one k steps further, k = 0, 1, …, but for k = 0
/// nothing.
fn coupling(scheme: Scheme, size: usize) -> Vec<f64> {
    (0..size)
        .map(|k| match k {
            0 => 0.0,
            _ => {
                // Half of the edge's weight; a face of two corners has it twice.
                let sides = usize::from(k == 1) + usize::from(k + 1 == size);
                scheme.face_weight(size, k) + 0.5 * scheme.edge_weight() * sides as f64
            }
        })
        .collect()
}

/// The eigenvalues of the symmetric circulant with this first row, by frequency.
fn eigenvalues(row: &[f64]) -> Vec<f64> {
    let m = row.len();
    (0..m)
        .map(|k| {
            let turn = |(s, b): (usize, &f64)| b * (TAU * ((k * s) % m) as f64 / m as f64).cos();
            row.iter().enumerate().map(turn).sum()
        })
        .collect()
}

/// Whether every element's null space is that of one vector of alternating signs: then a vector on which all
/// elements vanish is ±1 in a two-colouring, up to a factor for each component.
pub fn alternation_is_all(faces: &Faces, scheme: Scheme) -> bool {
    let mut alternates = [None; LARGEST_FACE + 1];
    faces.iter().all(|face| {
        let size = face.len();
        let Some(known) = alternates.get_mut(size) else {
            return false;
        };
        *known.get_or_insert_with(|| {
            let mut values = eigenvalues(&coupling(scheme, size));
            let Some(alternating) = (size % 2 == 0).then(|| values.swap_remove(size / 2)) else {
                return false;
            };
            values.iter().all(|l| *l > alternating + 1e-9)
        })
    })
}

/// The lower bounds min c_i (upper: max) that elements and potentials alone prove: at least as good as those of
/// [`SpectralBounds`](crate::assemble::bounds::SpectralBounds), as they know the sizes of the faces at each vertex.
/// `None` on meshes with a boundary or a face of more than 64 corners. O(corners).
pub fn element_bound(surface: &Surface, scheme: Scheme, which: SymmetricForm, end: End) -> Option<f64> {
    let form = Form::new(surface, scheme, which, end)?;
    let least = form.potential.iter().copied().fold(f64::INFINITY, f64::min);
    Some(match end {
        End::Lowest => least,
        End::Highest => -least,
    })
}

/// Encloses the end of the spectrum of A or D⁻¹A to `tolerance` relative, if it belongs to modes around a few
/// exceptional vertices; less accurately, but to 1e-6, where patches meet before, or would have more than 200 000
/// vertices. `None` if this fails, and on meshes with a boundary or a face of more than 64 corners.
///
/// Time: O(N) once, and for each kind of patch a Lanczos process in each of a few attempts and two factorizations
/// or a few more.
///
/// # Errors
/// If the Lanczos process of a patch meets numbers that are not finite.
///
/// ```
/// use limitlab::analysis::dirichlet_neumann::bracket;
/// use limitlab::analysis::{subspace_iteration::End, symmetric::SymmetricForm};
/// use limitlab::schemes::Scheme;
/// use limitlab::mesh::{Surface, builtin};
///
/// let surface = Surface::new(builtin::builtin("quad-sphere:7")?)?;
/// let found = bracket(&surface, Scheme::CatmullClark, SymmetricForm::A, End::Lowest, 1e-8)?;
/// // One mode around each of the eight vertices of valence 3, below the edge 1/9 of the continuum.
/// let found = found.expect("eight exceptional vertices");
/// assert_eq!((found.multiplicity, found.kinds), (8, 1));
/// assert!((found.value - 0.1103503).abs() < 1e-7 && found.next > 0.1106);
/// # Ok::<(), limitlab::Error>(())
/// ```
pub fn bracket(
    surface: &Surface,
    scheme: Scheme,
    which: SymmetricForm,
    end: End,
    tolerance: f64,
) -> Result<Option<Bracket>> {
    let Some(form) = Form::new(surface, scheme, which, end) else {
        return Ok(None);
    };
    let (level, seeds) = form.exceptional();
    if seeds.is_empty() {
        return Ok(None);
    }
    let sign = match end {
        End::Lowest => 1.0,
        End::Highest => -1.0,
    };
    let mut attempts: Vec<Attempt> = Vec::new();
    let mut rings = FIRST_RINGS;
    let mut factored = 0;
    loop {
        let patches = match Patches::new(&form, &seeds, rings) {
            Some(patches) if patches.vertices() <= MOST_VERTICES => patches,
            _ => break,
        };
        attempts.push(Attempt::new(&form, patches, rings)?);
        let here = &attempts[attempts.len() - 1];
        let width = tolerance * here.value.abs();
        match decay(&attempts, level) {
            Some(rate) => {
                let missing = (SPARE * here.excess(&attempts, rate) / width).ln();
                if missing <= 0.0 {
                    if let Some(found) = here.close(&form, width, level, sign) {
                        return Ok(Some(found));
                    }
                    factored += 1;
                    if factored == FACTORED {
                        return Ok(None);
                    }
                }
                let needed = rings as f64 + missing.max(1.0) / rate;
                rings = (1.03 * needed).clamp(rings as f64 + 1.0, LEAP * rings as f64) as usize;
            }
            // No mode is bound yet, or nothing can be said of its decay.
            None if rings < UNBOUND_RINGS => rings += rings / 2,
            None => return Ok(None),
        }
    }
    // Patches cannot grow any more: with what there is, less accurate.
    let Some((here, rate)) = attempts.last().zip(decay(&attempts, level)) else {
        return Ok(None);
    };
    let excess = SPARE * here.excess(&attempts, rate);
    let mut width = 10.0 * tolerance * here.value.abs();
    while width <= LEAST_TOLERANCE * here.value.abs() {
        if width >= excess
            && let Some(found) = here.close(&form, width, level, sign)
        {
            return Ok(Some(found));
        }
        width *= 10.0;
    }
    Ok(None)
}

/// Patches of one size.
struct Attempt {
    rings: usize,
    patches: Patches,
    dirichlet: Vec<Csr>,
    /// The least Dirichlet eigenvalue.
    value: f64,
}

/// The factor per ring, as a logarithm, by which the value of growing patches approaches its limit; `None` unless a
/// mode is seen to be bound below `level`.
fn decay(attempts: &[Attempt], level: f64) -> Option<f64> {
    let [.., first, last, here] = attempts else {
        return None;
    };
    let change = (last.value - here.value).max(f64::EPSILON * here.value.abs());
    let before = first.value - here.value;
    let bound = level - here.value > RESOLVED * change && before > change;
    bound.then(|| (before / change).ln() / (last.rings - first.rings) as f64)
}

impl Attempt {
    fn new(form: &Form, patches: Patches, rings: usize) -> Result<Self> {
        let dirichlet: Vec<Csr> = patches.kinds.iter().map(|k| k.matrix(form, true)).collect();
        let lowest: Vec<f64> = dirichlet.iter().map(lowest).collect::<Result<_>>()?;
        let value = lowest.iter().copied().fold(f64::INFINITY, f64::min);
        Ok(Attempt { rings, patches, dirichlet, value })
    }

    /// By how much the value of the last of these attempts is still too high, about.
    fn excess(&self, attempts: &[Attempt], rate: f64) -> f64 {
        let last = &attempts[attempts.len() - 2];
        let change = (last.value - self.value).max(f64::EPSILON * self.value.abs());
        change * (-rate * (self.rings - last.rings) as f64).exp()
    }

    /// Decides by factorizations whether the end of the spectrum lies within `width` of the value.
    fn close(&self, form: &Form, width: f64, level: f64, sign: f64) -> Option<Bracket> {
        let counts = &self.patches.counts;
        let count = |matrices: &[Csr], s: f64| {
            let mut sum = 0;
            for (matrix, count) in matrices.iter().zip(counts) {
                sum += count * inertia(matrix, s).ok()?.below;
            }
            Some(sum)
        };
        // Counts that rounding can only make greater, and smaller.
        let at_most = |matrices: &[Csr], s: f64| count(matrices, s + ALLOWANCE);
        let at_least = |matrices: &[Csr], s: f64| count(matrices, s - ALLOWANCE);
        let kinds = &self.patches.kinds;
        let neumann: Vec<Csr> = kinds.iter().map(|k| k.matrix(form, false)).collect();
        let highest = self.value + width;
        let half = 0.5 * (self.value + level);
        let (beneath, to_half) = rayon::join(|| at_most(&neumann, self.value - width), || at_most(&neumann, half));
        if beneath? > 0 {
            return None;
        }
        let multiplicity = at_least(&self.dirichlet, highest)?;
        // No matter if that one factorization is not stable.
        let next = if to_half == Some(multiplicity) { half } else { highest };
        if multiplicity == 0 || next == highest && at_most(&neumann, highest)? != multiplicity {
            return None;
        }
        Some(Bracket {
            value: sign * self.value,
            width,
            multiplicity,
            next: sign * next,
            rings: self.rings,
            patches: counts.iter().sum(),
            kinds: kinds.len(),
            vertices: self.patches.vertices(),
        })
    }
}

/// The least eigenvalue of a patch, as a Rayleigh quotient.
fn lowest(s: &Csr) -> Result<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(0x50_6174_6368);
    let start = (0..s.len()).map(|_| rng.random_range(-1.0..1.0)).collect();
    let limits =
        lanczos::LanczosLimits { tolerance: 1e-12, max_steps: STEPS, least_weight: 0.0, ends: lanczos::Wanted::Lowest };
    Ok(lanczos::extremes(s, start, limits)?.low.value)
}

/// Disjoint patches around the exceptional vertices, one of each kind and how many of it there are.
struct Patches {
    kinds: Vec<Patch>,
    counts: Vec<usize>,
}

/// A patch: its vertices in the order of a walk that only its structure and its start decide.
struct Patch {
    vertices: Vec<u32>,
    /// The faces within it, as places in `vertices`.
    corners: Vec<u32>,
    sizes: Vec<u32>,
    /// What the walk met: patches with the same code are the same.
    code: Vec<u32>,
}

impl Patches {
    /// The patches of all vertices within `rings` rings of faces of the exceptional ones; patches that touch become
    /// one. `None` if they are too large, or a walk does not reach all of one.
    fn new(form: &Form, seeds: &[u32], rings: usize) -> Option<Self> {
        let n = form.potential.len();
        let incidence = &form.topology.incidence;
        // The seed that each vertex belongs to, and the seeds that belong together.
        let mut owner = vec![NONE; n];
        let mut group: Vec<u32> = (0..seeds.len() as u32).collect();
        for (k, &v) in (0..).zip(seeds) {
            owner[v as usize] = k;
        }
        let mut front = seeds.to_vec();
        let mut next = Vec::new();
        let mut total = front.len();
        for _ in 0..rings {
            for &v in &front {
                let own = owner[v as usize];
                for &c in incidence.corners_at(v as usize) {
                    for &w in form.faces.face(incidence.face_of(c)) {
                        let other = owner[w as usize];
                        if other == NONE {
                            owner[w as usize] = own;
                            next.push(w);
                        } else {
                            join(&mut group, own, other);
                        }
                    }
                }
            }
            front.clear();
            std::mem::swap(&mut front, &mut next);
            total += front.len();
        }
        // Patches whose last rings touch: none of their faces is shared, but the walks must not leave a patch.
        for &v in &front {
            for &c in incidence.corners_at(v as usize) {
                for &w in form.faces.face(incidence.face_of(c)) {
                    if owner[w as usize] != NONE {
                        join(&mut group, owner[v as usize], owner[w as usize]);
                    }
                }
            }
        }
        if total > 2 * n / 3 && seeds.len() > 1 && (0..seeds.len()).all(|k| root(&group, k) == 0) {
            return None;
        }
        let mut found = Patches { kinds: Vec::new(), counts: Vec::new() };
        let mut place = vec![NONE; n];
        for k in (0..seeds.len()).filter(|&k| group[k] as usize == k) {
            let members = (k..seeds.len()).filter(|&l| root(&group, l) == k);
            let starts: Vec<u32> =
                members.flat_map(|l| incidence.corners_at(seeds[l] as usize).iter().copied()).take(STARTS).collect();
            let inside = |w: u32| {
                let owner = owner[w as usize];
                owner != NONE && root(&group, owner as usize) == k
            };
            let mut walk = Walk { form, place: &mut place };
            let known = found.kinds.iter().position(|kind| {
                starts.iter().any(|&c| {
                    let mut code = kind.code.iter();
                    let vertices = walk.go(c, inside, |x| code.next() == Some(&x));
                    vertices.is_some() && code.next().is_none()
                })
            });
            if let Some(kind) = known {
                found.counts[kind] += 1;
                continue;
            }
            let mut code = Vec::new();
            let vertices = walk.go(starts[0], inside, |x| {
                code.push(x);
                true
            })?;
            found.kinds.push(Patch::new(form, vertices, code));
            found.counts.push(1);
            if found.vertices() > MOST_VERTICES {
                return None;
            }
        }
        // Non-manifold vertices may hide part of a patch from the walks.
        let walked: usize =
            found.kinds.iter().zip(&found.counts).map(|(kind, count)| kind.vertices.len() * count).sum();
        (walked == total).then_some(found)
    }

    /// Vertices of all kinds.
    fn vertices(&self) -> usize {
        self.kinds.iter().map(|k| k.vertices.len()).sum()
    }
}

/// Numbers the vertices of a patch.
struct Walk<'a> {
    form: &'a Form<'a>,
    /// By vertex; NONE between walks.
    place: &'a mut [u32],
}

impl Walk<'_> {
    /// From the vertex of corner `start` through all vertices `inside`, around each in counter-clockwise order from
    /// the corner where it was met first. `meet` is told what comes: the size of each face at each vertex, and the
    /// places of its corners, NONE for those outside. `None` as soon as it says no, or if a star is not closed.
    fn go(&mut self, start: u32, inside: impl Fn(u32) -> bool, mut meet: impl FnMut(u32) -> bool) -> Option<Vec<u32>> {
        let corners = self.form.faces.corners();
        let first = corners[start as usize];
        let mut vertices = vec![first];
        let mut entries = vec![start];
        self.place[first as usize] = 0;
        let done = self.around(&inside, &mut meet, &mut vertices, &mut entries);
        for &v in &vertices {
            self.place[v as usize] = NONE;
        }
        done.map(|()| vertices)
    }

    fn around(
        &mut self,
        inside: &impl Fn(u32) -> bool,
        meet: &mut impl FnMut(u32) -> bool,
        vertices: &mut Vec<u32>,
        entries: &mut Vec<u32>,
    ) -> Option<()> {
        let Form { faces, topology, .. } = self.form;
        let corners = faces.corners();
        let mut k = 0;
        while k < vertices.len() {
            let mut c = entries[k];
            for _ in 0..topology.incidence.face_count(vertices[k] as usize) {
                let range = faces.range(topology.incidence.face_of(c));
                if !meet(range.len() as u32) {
                    return None;
                }
                let (before, after) = (range.start..c as usize, c as usize..range.end);
                for d in after.chain(before) {
                    let w = corners[d];
                    if self.place[w as usize] == NONE && inside(w) {
                        self.place[w as usize] = vertices.len() as u32;
                        vertices.push(w);
                        entries.push(d as u32);
                    }
                    if !meet(self.place[w as usize]) {
                        return None;
                    }
                }
                c = topology.counter_clockwise(faces, c)?;
            }
            if c != entries[k] {
                return None;
            }
            k += 1;
        }
        Some(())
    }
}

impl Patch {
    fn new(form: &Form, vertices: Vec<u32>, code: Vec<u32>) -> Self {
        // Each vertex brings the faces that no earlier one has.
        let (mut corners, mut sizes) = (Vec::new(), Vec::new());
        let mut at = code.iter();
        for (k, &v) in (0..).zip(&vertices) {
            for _ in 0..form.topology.incidence.face_count(v as usize) {
                let Some(&size) = at.next() else { break };
                let face = &at.as_slice()[..size as usize];
                if face.iter().all(|&w| w != NONE && w >= k) {
                    corners.extend_from_slice(face);
                    sizes.push(size);
                }
                at = at.as_slice()[size as usize..].iter();
            }
        }
        Patch { vertices, corners, sizes, code }
    }

    /// The symmetric matrix of the patch: all of it with the elements of the faces within it; or the inside, the
    /// vertices all of whose faces lie within it.
    fn matrix(&self, form: &Form, inside_only: bool) -> Csr {
        let n = self.vertices.len();
        let metric: Vec<f64> = self.vertices.iter().map(|&v| form.metric[v as usize]).collect();
        let mut rows: Vec<Vec<(u32, f64)>> = vec![Vec::new(); n];
        let mut faces_at = vec![0usize; n];
        let mut rest = self.corners.as_slice();
        for &size in &self.sizes {
            let size = size as usize;
            let (face, after) = rest.split_at(size);
            rest = after;
            for (s, &i) in face.iter().enumerate() {
                faces_at[i as usize] += 1;
                let row = &mut rows[i as usize];
                row.push((i, form.shifts[size] / metric[i as usize]));
                for (t, &j) in face.iter().enumerate().filter(|&(t, _)| t != s) {
                    let scale = (metric[i as usize] * metric[j as usize]).sqrt();
                    row.push((j, form.couplings[size][(t + size - s) % size] / scale));
                }
            }
        }
        let mut number = vec![NONE; n];
        let mut count = 0;
        for (k, &v) in self.vertices.iter().enumerate() {
            if !inside_only || faces_at[k] == form.topology.incidence.face_count(v as usize) {
                number[k] = count;
                count += 1;
            }
        }
        let mut offsets = vec![0u32];
        let (mut columns, mut values) = (Vec::new(), Vec::new());
        for (k, mut row) in rows.into_iter().enumerate() {
            if number[k] == NONE {
                continue;
            }
            row.push((k as u32, form.potential[self.vertices[k] as usize]));
            row.sort_by_key(|e| e.0);
            for same in row.chunk_by(|a, b| a.0 == b.0) {
                let column = number[same[0].0 as usize];
                if column != NONE {
                    columns.push(column);
                    values.push(same.iter().map(|e| e.1).sum());
                }
            }
            offsets.push(columns.len() as u32);
        }
        Csr::new(Arc::new(Pattern::new(offsets, columns)), values)
    }
}

/// The root of `k`; groups point to smaller numbers.
fn root(group: &[u32], mut k: usize) -> usize {
    while group[k] as usize != k {
        k = group[k] as usize;
    }
    k
}

fn join(group: &mut [u32], a: u32, b: u32) {
    if a != b {
        let (a, b) = (root(group, a as usize), root(group, b as usize));
        group[a.max(b)] = a.min(b) as u32;
    }
}
