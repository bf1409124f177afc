//! Line preconditioner on quad meshes: tridiagonal solves along lines of edges through regular vertices.
//!
//! Where all valences are 4 and all faces quads, Catmull-Clark's symmetric matrix is a tensor product along the two
//! families of edge lines, M = C ⊗ C with C = tridiag(1, 4, 1), and M⁻¹ is a pass of tridiagonal solves along one
//! family, then one along the other. On a whole mesh the lines have no two families: three pairwise crossing ones
//! meet around a corner of a subdivided cube. But every regular vertex lies on two [chains](Regularity), and
//!
//! B = ½ Eᵀ C⁻¹ σ C⁻¹ E
//!
//! needs no families: E copies a vertex's number to its two places on chains, C⁻¹ solves along every chain, σ swaps the
//! two places of a vertex. It is M⁻¹ on a regular torus and nearly so some rings away from irregular vertices.
//!
//! **B is positive definite on every mesh.** C has its eigenvalues in [2, 6], so C⁻¹ turns no vector by more than
//! arcsin((3 − 1)/(3 + 1)) = 30° (Wielandt). As σEx = Ex, both y = C⁻¹Ex and σy lie within 30° of Ex, hence
//! ⟨x, B x⟩ = ½⟨y, σy⟩ ≥ ½ cos 60° ‖y‖².
//!
//! The [`LinePreconditioner`] adds what is missing at irregular vertices: before and after B, the matrix is solved exactly on
//! the two rings around each, one after the other and back (symmetric multiplicative Schwarz). Then the condition number
//! is 1.002 on quads refined twice: three iterations in place of thirty. It does not pay all the same: see the
//! table `lines` of `reproduce`.
//!
//! Weaker on such meshes, with lines alone or on the rectangular patches of the motorcycle graph (Eppstein et al. 2008):
//! lines along both families added κ = 4.4 (3.0 with stars), B alone 3.7, tensor solves on patches with the diagonal
//! between them 6.3, with Schur complements as lines between them 3.7 (2.6 with stars).

use glam::DVec3;
use nalgebra::DMatrix;

use super::tridiagonal::Tridiagonal;
use crate::assemble::{Csr, LimitSystem};
use crate::error::{Error, Result};
use crate::mesh::Surface;
use crate::parallel;
use crate::solvers::Stop;

/// What of a mesh is regular.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Regularity {
    /// Of valence 4, not on a boundary, and in quads only.
    pub regular: Vec<bool>,
    /// The lines of edges that go straight on through regular vertices and end at others: the regular vertices of
    /// each, and whether it is closed. Every regular vertex comes twice. Lines without regular vertices are left out.
    pub chains: Vec<(Vec<u32>, bool)>,
}

impl Regularity {
    /// O(corners).
    pub fn new(surface: &Surface) -> Self {
        let (faces, topology) = (surface.faces(), surface.topology());
        let n = topology.incidence.vertices();
        let mut star = Vec::new();
        let regular: Vec<bool> = (0..n)
            .map(|v| {
                let quads = |&c: &u32| faces.range(topology.incidence.face_of(c)).len() == 4;
                topology.incidence.face_count(v) == 4
                    && topology.star(faces, v, &mut star)
                    && star.len() == 4
                    && star.iter().all(quads)
            })
            .collect();
        let chains = chains(surface, &regular);
        Regularity { regular, chains }
    }

    /// The share of regular vertices.
    pub fn share(&self) -> f64 {
        let count = self.regular.iter().filter(|&&r| r).count();
        count as f64 / self.regular.len().max(1) as f64
    }

    /// The mean number of regular vertices on a chain; 0 without chains.
    pub fn mean_chain(&self) -> f64 {
        let places: usize = self.chains.iter().map(|(v, _)| v.len()).sum();
        places as f64 / self.chains.len().max(1) as f64
    }
}

/// The straight lines of half-edges through regular vertices.
fn chains(surface: &Surface, regular: &[bool]) -> Vec<(Vec<u32>, bool)> {
    let (faces, topology) = (surface.faces(), surface.topology());
    let tail = |c: u32| faces.corners()[c as usize] as usize;
    // Opposite around a regular vertex: two quarters on.
    let quarter = |c: u32| topology.counter_clockwise(faces, c);
    let halfedges = faces.corners().len() as u32;
    let ends = (0..halfedges).filter(|&c| !regular[tail(c)]);
    let mut seen = vec![false; halfedges as usize];
    let mut chains = Vec::new();
    // What the lines with ends leave is closed.
    for start in ends.chain(0..halfedges) {
        let mut line = Vec::new();
        let mut next = Some(start);
        while let Some(c) = next
            && !seen[c as usize]
            && let Some(back) = topology.twin(c)
        {
            seen[c as usize] = true;
            seen[back as usize] = true;
            if !regular[tail(back)] {
                break;
            }
            line.push(tail(back) as u32);
            next = quarter(back).and_then(quarter);
        }
        if !line.is_empty() {
            chains.push((line, regular[tail(start)]));
        }
    }
    chains
}

/// An approximate inverse of Catmull-Clark's M from the chains of a closed mesh; symmetric and positive definite.
pub struct LinePreconditioner<'a> {
    m: &'a Csr,
    regularity: &'a Regularity,
    /// The two places of a regular vertex: chain, and index in it.
    places: Vec<[(u32, u32); 2]>,
    stars: Vec<Star>,
}

/// A factor's diagonal entry below this is rounding: the diagonal of M is at least 6.
const SINGULAR: f64 = 1e-6;

/// The vertices around an irregular one, and the inverse of M between them.
struct Star {
    vertices: Vec<u32>,
    inverse: DMatrix<f64>,
}

impl<'a> LinePreconditioner<'a> {
    /// # Errors
    /// If M is singular on a star: a mesh of a few vertices of valence 3.
    ///
    /// # Panics
    /// If the system and the regularity are of meshes with another number of vertices.
    pub fn new(system: &'a LimitSystem, regularity: &'a Regularity) -> Result<Self> {
        assert_eq!(system.len(), regularity.regular.len(), "of one mesh");
        let mut places = vec![[(u32::MAX, 0); 2]; system.len()];
        for (k, (line, _)) in (0..).zip(&regularity.chains) {
            for (i, &v) in (0..).zip(line) {
                let [first, second] = &mut places[v as usize];
                *(if first.0 == u32::MAX { first } else { second }) = (k, i);
            }
        }
        let irregular = (0..system.len()).filter(|&v| !regularity.regular[v]);
        let stars = irregular.map(|v| Star::new(&system.m, v)).collect::<Result<_>>()?;
        Ok(LinePreconditioner { m: &system.m, regularity, places, stars })
    }

    /// B r.
    pub fn apply(&self, r: &[DVec3]) -> Vec<DVec3> {
        let mut x = vec![DVec3::ZERO; r.len()];
        for star in &self.stars {
            star.relax(self.m, r, &mut x);
        }
        let rest: Vec<DVec3> = (0..r.len()).map(|i| r[i] - self.m.row_times(i, &x)).collect();
        for (x, z) in x.iter_mut().zip(self.lines(&rest)) {
            *x += z;
        }
        for star in self.stars.iter().rev() {
            star.relax(self.m, r, &mut x);
        }
        x
    }

    /// ½ Eᵀ C⁻¹ σ C⁻¹ E r, and r over the diagonal at irregular vertices.
    fn lines(&self, r: &[DVec3]) -> Vec<DVec3> {
        let solve = |value: &(dyn Fn(u32, (u32, u32)) -> DVec3 + Sync)| -> Vec<Vec<DVec3>> {
            let chains = &self.regularity.chains;
            parallel::map(chains.len(), 1, |range| {
                let (line, closed) = &chains[range.start];
                let places = (0..).map(|i| (range.start as u32, i));
                let mut x: Vec<DVec3> = line.iter().zip(places).map(|(&v, p)| value(v, p)).collect();
                solve_line(&mut x, *closed);
                x
            })
        };
        let first = solve(&|v, _| r[v as usize]);
        let second = solve(&|v, place| {
            let [a, b] = self.places[v as usize];
            let (k, i) = if a == place { b } else { a };
            first[k as usize][i as usize]
        });
        let at = |(k, i): (u32, u32)| second[k as usize][i as usize];
        (0..r.len())
            .map(|v| match self.regularity.regular[v] {
                true => 0.5 * (at(self.places[v][0]) + at(self.places[v][1])),
                false => r[v] / self.m.get(v, v),
            })
            .collect()
    }
}

impl Star {
    fn new(m: &Csr, centre: usize) -> Result<Self> {
        let mut vertices = vec![centre as u32];
        for _ in 0..2 {
            for i in 0..vertices.len() {
                for (j, _) in m.row(vertices[i] as usize) {
                    if !vertices.contains(&(j as u32)) {
                        vertices.push(j as u32);
                    }
                }
            }
        }
        let k = vertices.len();
        let entry = |i, j| m.get(vertices[i] as usize, vertices[j] as usize);
        let factor = DMatrix::from_fn(k, k, entry).cholesky();
        // The pivots are squares of the factor's diagonal; those of a singular matrix end at rounding.
        let least = factor.as_ref().map_or(0.0, |f| f.l_dirty().diagonal().min());
        match factor {
            Some(factor) if least > SINGULAR => Ok(Star { vertices, inverse: factor.inverse() }),
            _ => Err(Error::Computation(format!("the matrix around vertex {centre} is singular"))),
        }
    }

    /// Makes M x = r hold at the star's vertices, by changing x there.
    fn relax(&self, m: &Csr, r: &[DVec3], x: &mut [DVec3]) {
        let rest = |&v: &u32| r[v as usize] - m.row_times(v as usize, x);
        let e: Vec<DVec3> = self.vertices.iter().map(rest).collect();
        // The inverse is symmetric: its columns are its rows.
        for (&v, row) in self.vertices.iter().zip(self.inverse.column_iter()) {
            x[v as usize] += row.iter().zip(&e).map(|(a, e)| *a * *e).sum::<DVec3>();
        }
    }
}

/// x ← C⁻¹ x, C = tridiag(1, 4, 1), with corner entries 1 on a closed line.
fn solve_line(x: &mut [DVec3], closed: bool) {
    if closed {
        // C = (1 − g S)(1 − g Sᵀ)/(−g) with the cyclic shift S: a recursion each way, started by going round once.
        let g = 3f64.sqrt() - 2.0;
        let round = 1.0 - g.powi(x.len() as i32);
        let start = |sum: DVec3, x: &DVec3| *x + g * sum;
        let mut last = x.iter().fold(DVec3::ZERO, start) / round;
        for x in x.iter_mut() {
            *x += g * last;
            last = *x;
        }
        let mut last = x.iter().rev().fold(DVec3::ZERO, start) / round;
        for x in x.iter_mut().rev() {
            last = *x + g * last;
            *x = -g * last;
        }
        return;
    }
    // Elimination: the pivots are 4 − 1/(the one before).
    let mut inverse = Vec::with_capacity(x.len());
    let (mut pivot, mut last) = (4.0, DVec3::ZERO);
    for x in x.iter_mut() {
        *x = (*x - last) / pivot;
        last = *x;
        inverse.push(1.0 / pivot);
        pivot = 4.0 - 1.0 / pivot;
    }
    let mut last = DVec3::ZERO;
    for (x, inverse) in x.iter_mut().zip(inverse).rev() {
        *x -= inverse * last;
        last = *x;
    }
}

/// How fast conjugate gradients were.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Count {
    /// Until max_i ‖p_i − (A v)_i‖ was within the tolerance.
    pub iterations: usize,
    /// λ_max/λ_min of B M as the iterations saw it (the eigenvalues of their Lanczos matrix), a lower bound.
    pub kappa: f64,
}

/// Conjugate gradients on M V = H⁻¹P from V = P with the symmetric positive definite `precondition`.
///
/// # Errors
/// If they break down, or need more iterations than allowed.
pub fn count(
    system: &LimitSystem,
    points: &[DVec3],
    stop: &Stop,
    precondition: impl Fn(&[DVec3]) -> Vec<DVec3>,
) -> Result<Count> {
    let product = |x: &[DVec3]| -> Vec<DVec3> { parallel::collect(x.len(), |i| system.m.row_times(i, x)) };
    let dot = |a: &[DVec3], b: &[DVec3]| -> f64 { a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum() };
    let mut r = system.symmetric_right_hand_side(points);
    for (r, mx) in r.iter_mut().zip(product(points)) {
        *r -= mx;
    }
    let mut direction = vec![DVec3::ZERO; r.len()];
    let (mut alphas, mut betas): (Vec<f64>, Vec<f64>) = Default::default();
    // ⟨r, B r⟩ and the step of the last iteration.
    let mut last: Option<(f64, f64)> = None;
    let error = |r: &[DVec3]| {
        let errors = r.iter().zip(&system.h).map(|(r, h)| r.length() * h);
        errors.fold(0.0, f64::max)
    };
    while error(&r) > stop.tolerance {
        let z = precondition(&r);
        let rho = dot(&r, &z);
        let beta = last.map_or(0.0, |(before, _)| rho / before);
        for (d, z) in direction.iter_mut().zip(&z) {
            *d = *z + beta * *d;
        }
        let image = product(&direction);
        let step = rho / dot(&direction, &image);
        if !(rho > 0.0 && step > 0.0) || alphas.len() == stop.max_iterations {
            return Err(Error::Computation(format!(
                "conjugate gradients: no result after {} iterations, ⟨r, B r⟩ = {rho:e}",
                alphas.len()
            )));
        }
        for (r, image) in r.iter_mut().zip(&image) {
            *r -= step * *image;
        }
        alphas.push(1.0 / step + last.map_or(0.0, |(_, before)| beta / before));
        betas.extend(last.map(|(_, before)| beta.sqrt() / before));
        last = Some((rho, step));
    }
    let lanczos = Tridiagonal { alphas: &alphas, betas: &betas };
    let kappa = match alphas.len() {
        0 => 1.0,
        k => lanczos.eigenvalue(k - 1) / lanczos.eigenvalue(0),
    };
    Ok(Count { iterations: alphas.len(), kappa })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::noise::add_noise;
    use crate::mesh::{Mesh, builtin, generate};
    use crate::schemes::Scheme;

    fn noisy(name: &str) -> Mesh {
        let mut mesh = builtin::builtin(name).unwrap();
        add_noise(&mut mesh, 0.1, 1);
        mesh
    }

    fn parts(mesh: &Mesh) -> (Surface, Regularity, LimitSystem) {
        let surface = Surface::new(mesh.clone()).unwrap();
        let regularity = Regularity::new(&surface);
        let system = LimitSystem::new(&surface, Scheme::CatmullClark).unwrap();
        (surface, regularity, system)
    }

    #[test]
    fn chains_pass_every_regular_vertex_twice_and_cover_its_edges() {
        let cubes = generate::quad_split(&builtin::builtin("cubes:2").unwrap());
        let meshes = [
            (noisy("torus:8x6"), 48, 14),
            (noisy("quad-sphere:3"), 378, 12 + 21),
            (cubes, 36, 2 * (12 + 3)),
            (noisy("icosphere:2"), 0, 0),
        ];
        for (mesh, regular, chains) in &meshes {
            let surface = Surface::new(mesh.clone()).unwrap();
            let found = Regularity::new(&surface);
            assert_eq!(found.regular.iter().filter(|&&r| r).count(), *regular);
            assert_eq!(found.chains.len(), *chains);
        }
        for name in ["irregular-quad:500", "irregular-poly:500", "quad-sphere:3"] {
            let mesh = noisy(name);
            let (surface, found, _) = parts(&mesh);
            let mut visits = vec![0; mesh.len()];
            for &v in found.chains.iter().flat_map(|(line, _)| line) {
                visits[v as usize] += 1;
            }
            assert!((0..mesh.len()).all(|v| visits[v] == 2 * u32::from(found.regular[v])));
            let edge = |c: u32| {
                let tail = |c: u32| mesh.faces.corners()[c as usize] as usize;
                found.regular[tail(c)] || surface.topology().twin(c).is_some_and(|t| found.regular[tail(t)])
            };
            let edges = surface.topology().edge_sides().filter(|&c| edge(c)).count();
            let passed = |(line, closed): &(Vec<u32>, bool)| line.len() + usize::from(!closed);
            assert_eq!(found.chains.iter().map(passed).sum::<usize>(), edges);
        }
    }

    #[test]
    fn a_line_is_solved_exactly() {
        for closed in [true, false] {
            for n in 1..30 {
                let x: Vec<DVec3> = (0..n).map(|i| DVec3::splat((i as f64).sin())).collect();
                let mut y = x.clone();
                solve_line(&mut y, closed);
                let at = |i: usize| match i {
                    0 if closed => y[n - 1],
                    i if i == n + 1 && closed => y[0],
                    i => if i > 0 { y.get(i - 1).copied() } else { None }.unwrap_or_default(),
                };
                for (i, x) in x.iter().enumerate() {
                    let c = at(i) + 4.0 * at(i + 1) + at(i + 2);
                    assert!((c - *x).length() < 1e-14, "{closed} {n} {i}");
                }
            }
        }
    }

    #[test]
    fn exact_on_a_torus_and_symmetric_positive_everywhere() {
        for name in ["torus:9x7", "irregular-quad:200", "irregular-poly:150"] {
            let mesh = noisy(name);
            let (_, regularity, system) = parts(&mesh);
            let b = LinePreconditioner::new(&system, &regularity).unwrap();
            let x = &mesh.positions;
            let y: Vec<DVec3> = x.iter().rev().copied().collect();
            let dot = |a: &[DVec3], b: &[DVec3]| a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum::<f64>();
            let (bx, by) = (b.apply(x), b.apply(&y));
            assert!((dot(&y, &bx) - dot(x, &by)).abs() < 1e-12 * dot(x, &bx));
            if name.starts_with("torus") {
                for (i, x) in x.iter().enumerate() {
                    assert!((system.m.row_times(i, &bx) - *x).length() < 1e-13);
                }
            }
        }
    }

    #[test]
    fn few_iterations_where_irregular_vertices_are_apart() {
        let mesh = noisy("quad-sphere:4");
        let (_, regularity, system) = parts(&mesh);
        let stop = Stop { tolerance: 1e-10 * mesh.diagonal(), max_iterations: 100 };
        let b = LinePreconditioner::new(&system, &regularity).unwrap();
        let plain = |r: &[DVec3]| r.iter().zip(&system.h).map(|(r, h)| *r * *h).collect();
        let [plain, lines] = [
            count(&system, &mesh.positions, &stop, plain).unwrap(),
            count(&system, &mesh.positions, &stop, |r| b.apply(r)).unwrap(),
        ];
        assert!((20..35).contains(&plain.iterations) && (8.0..9.1).contains(&plain.kappa));
        assert!(lines.iterations <= 3 && lines.kappa < 1.01, "{lines:?}");
        let less = Stop { max_iterations: lines.iterations - 1, ..stop };
        assert!(count(&system, &mesh.positions, &less, |r| b.apply(r)).is_err());
    }

    #[test]
    fn a_singular_matrix_is_refused() {
        let (_, regularity, system) = parts(&builtin::builtin("cube").unwrap());
        assert!(LinePreconditioner::new(&system, &regularity).is_err());
    }
}
