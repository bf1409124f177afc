//! Thin-plate and membrane energies of a Catmull-Clark surface as quadratic forms.
//!
//! A quad of the mesh refined once is the unit square of a parameter plane. Over it the energies are
//! ∫ S_uu² + 2S_uv² + S_vv² and ∫ S_u² + S_v², summed over the coordinates. On a regular patch (bicubic B-spline, 16
//! control points) they are exact: tensor products of the Gram matrices of the cubic B-spline's derivatives.
//!
//! **What is approximated.** A face of the second refinement with an extraordinary corner is split once more, and
//! three of its quarters are regular and counted exactly; the fourth, beside the extraordinary vertex, is left out
//! (1/64 of a unit square's area). It cannot be counted in this parametrisation: the halves of ever smaller rings have
//! thin-plate energies that grow like (4λ²)^k, λ > ½ the subdominant eigenvalue of valences above 4.

use std::sync::Arc;

use glam::DVec3;

use super::LEVELS;
use crate::assemble::Csr;
use crate::assemble::csr::Pattern;
use crate::mesh::Surface;
use crate::mesh::incidence::{next_in, prev_in};
use crate::schemes::Refinement;
use crate::{Error, Result};

/// How much of each energy the fairness holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weights {
    /// The factor of ∫ S_uu² + 2S_uv² + S_vv²: finite, 0 or more.
    pub thin_plate: f64,
    /// The factor of ∫ S_u² + S_v²: finite; positive in [`fit`](super::fit()), so that its system is regular.
    pub membrane: f64,
}

impl Default for Weights {
    fn default() -> Self {
        Weights { thin_plate: 1.0, membrane: 1.0 }
    }
}

/// The two energies: squared mesh units, for a unit square of parameters a quad of the first refinement.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Energies {
    /// ∫ S_uu² + 2S_uv² + S_vv², the second-order energy, unweighted.
    pub thin_plate: f64,
    /// ∫ S_u² + S_v², the first-order energy, unweighted.
    pub membrane: f64,
}

impl Energies {
    /// The fairness: both, weighted.
    pub fn weighted(&self, weights: Weights) -> f64 {
        weights.thin_plate * self.thin_plate + weights.membrane * self.membrane
    }
}

/// The energies of all surfaces over the connectivity of one mesh.
#[derive(Clone, Debug)]
pub struct Fairness {
    /// The mesh refined [`LEVELS`] times: the connectivity, and the positions of the plain surface.
    pub fine: Surface,
    /// Quadratic forms in the fine control points, on one pattern.
    pub thin_plate: Csr,
    /// The form of the membrane energy, symmetric and positive semi-definite as the other.
    pub membrane: Csr,
}

impl Fairness {
    /// Refines a closed mesh and assembles the forms. Time and memory O(16·corners), times the 256 entries of a
    /// patch.
    ///
    /// # Errors
    /// A mesh that is not closed, has creases or corners, or is too large.
    pub fn new(surface: &Surface) -> Result<Self> {
        match surface.features() {
            None if !surface.is_closed() => {
                return Err(Error::Open { edges: surface.boundary_edges(), scheme: "fair interpolation" });
            }
            Some(_) => {
                let what =
                    "fair interpolation, which has no energies of patches beside natural boundaries and creases,";
                return Err(Error::Creased { what });
            }
            None => {}
        }
        let fine = Refinement::CatmullClark.refined_n(surface, LEVELS)?;
        let finer = Refinement::CatmullClark.refined(&fine)?;
        let masks = StepMasks::new(&fine);
        let [thin_plate, membrane] = patch_grams();
        let mut triplets = Vec::new();
        let mut local = Vec::new();
        for f in 0..fine.faces().len() {
            if let Some(patch) = regular_patch(&fine, f) {
                // Halving the parameters' sides: second derivatives ×4, their squares ×16, areas ×¼.
                for (i, &row) in patch.iter().enumerate() {
                    for (j, &column) in patch.iter().enumerate() {
                        let values = [4.0 * thin_plate[i][j], membrane[i][j]];
                        triplets.push((row, column, values));
                    }
                }
                continue;
            }
            // A quarter of a fine face has the number of the corner that it lies at.
            for quarter in fine.faces().range(f) {
                let Some(patch) = regular_patch(&finer, quarter) else {
                    continue;
                };
                masks.pull_back(&patch, &mut local);
                for &(row, ref own) in &local {
                    for &(column, ref other) in &local {
                        let form = |gram: &Gram| -> f64 {
                            let rows = own.iter().zip(gram);
                            rows.map(|(a, g)| a * other.iter().zip(g).map(|(b, g)| b * g).sum::<f64>()).sum()
                        };
                        let values = [16.0 * form(&thin_plate), form(&membrane)];
                        triplets.push((row, column, values));
                    }
                }
            }
        }
        let [thin_plate, membrane] = sum_triplets(fine.len(), &triplets);
        Ok(Fairness { fine, thin_plate, membrane })
    }

    /// The energies of a surface, from its control points at the fine level.
    ///
    /// # Panics
    /// If there is not one point a fine vertex.
    pub fn energies(&self, points: &[DVec3]) -> Energies {
        assert_eq!(points.len(), self.fine.len(), "one point a fine vertex");
        let form = |k: &Csr| -> f64 {
            let rows = points.iter().enumerate();
            rows.map(|(i, p)| p.dot(k.row_times(i, points))).sum()
        };
        Energies { thin_plate: form(&self.thin_plate), membrane: form(&self.membrane) }
    }

    /// The energies of the surface of a control mesh with the given mesh's own connectivity.
    ///
    /// # Errors
    /// As the refinement.
    ///
    /// # Panics
    /// If the connectivity is another.
    pub fn energies_of(&self, control: &Surface) -> Result<Energies> {
        let fine = Refinement::CatmullClark.refine_n(control, LEVELS)?;
        Ok(self.energies(&fine.positions))
    }
}

type Gram = [[f64; 16]; 16];

/// The cubic B-spline's four pieces on [0, 1] as coefficients of 1, t, t², t³.
const PIECES: [[f64; 4]; 4] = [
    [1.0 / 6.0, -0.5, 0.5, -1.0 / 6.0],
    [4.0 / 6.0, 0.0, -1.0, 0.5],
    [1.0 / 6.0, 0.5, 0.5, -0.5],
    [0.0, 0.0, 0.0, 1.0 / 6.0],
];

/// ∫₀¹ of products of the `order`-th derivatives of the pieces.
fn line_gram(order: usize) -> [[f64; 4]; 4] {
    let derivative = |mut p: [f64; 4]| {
        for _ in 0..order {
            p = [p[1], 2.0 * p[2], 3.0 * p[3], 0.0];
        }
        p
    };
    let pieces = PIECES.map(derivative);
    let integral = |p: &[f64; 4], q: &[f64; 4]| {
        let mut sum = 0.0;
        for (i, a) in p.iter().enumerate() {
            for (j, b) in q.iter().enumerate() {
                sum += a * b / (i + j + 1) as f64;
            }
        }
        sum
    };
    pieces.map(|p| pieces.map(|q| integral(&p, &q)))
}

/// The two energies of a unit patch; control point (i, j) of u and v has number 4i + j.
fn patch_grams() -> [Gram; 2] {
    let [g0, g1, g2] = [0, 1, 2].map(line_gram);
    let form = |entry: &dyn Fn([usize; 2], [usize; 2]) -> f64| -> Gram {
        let place = |a: usize| [a / 4, a % 4];
        std::array::from_fn(|a| std::array::from_fn(|b| entry(place(a), place(b))))
    };
    [
        form(&|[i, j], [k, l]| g2[i][k] * g0[j][l] + 2.0 * g1[i][k] * g1[j][l] + g0[i][k] * g2[j][l]),
        form(&|[i, j], [k, l]| g1[i][k] * g0[j][l] + g0[i][k] * g1[j][l]),
    ]
}

/// For corner k of a face, the numbers of its vertex and of the three points around it outside the face: backwards
/// along u, diagonally, backwards along v, in the frame whose u is the corner's leaving edge.
const PLACES: [[usize; 4]; 4] =
    [[4 + 1, 1, 0, 4], [8 + 1, 8, 12, 12 + 1], [8 + 2, 12 + 2, 12 + 3, 8 + 3], [4 + 2, 4 + 3, 3, 2]];

/// The 16 control points of face `f` if its patch is a bicubic spline: four corners of valence 4, quads all around.
pub(super) fn regular_patch(surface: &Surface, f: usize) -> Option<[u32; 16]> {
    let (faces, topology) = (surface.faces(), surface.topology());
    let corners = faces.corners();
    let range = faces.range(f);
    if range.len() != 4 {
        return None;
    }
    let mut patch = [0; 16];
    for (c, places) in range.zip(&PLACES) {
        let v = corners[c];
        let star = topology.incidence.corners_at(v as usize);
        let quads = star.iter().all(|&c| faces.range(topology.incidence.face_of(c)).len() == 4);
        if star.len() != 4 || !quads {
            return None;
        }
        let beside = topology.counter_clockwise(faces, c as u32)?;
        let across = topology.counter_clockwise(faces, beside)?;
        let diagonal = faces.range(topology.incidence.face_of(across));
        let next = next_in(&diagonal, across);
        patch[places[0]] = v;
        patch[places[1]] = corners[next as usize];
        patch[places[2]] = corners[next_in(&diagonal, next) as usize];
        patch[places[3]] = corners[prev_in(&diagonal, across) as usize];
    }
    Some(patch)
}

/// The Catmull-Clark step of a quad mesh as masks of single new vertices.
struct StepMasks<'a> {
    surface: &'a Surface,
    /// The first half-edge of every edge.
    edges: Vec<u32>,
}

impl<'a> StepMasks<'a> {
    fn new(surface: &'a Surface) -> Self {
        StepMasks { surface, edges: surface.topology().edge_sides().collect() }
    }

    /// Calls `add` with the old vertices and weights of new vertex `w`, numbered as the refinement numbers it.
    /// A vertex may come more than once.
    fn mask(&self, w: usize, add: &mut impl FnMut(u32, f64)) {
        let (faces, incidence) = (self.surface.faces(), self.surface.incidence());
        let corners = faces.corners();
        let (v, e) = (self.surface.len(), self.edges.len());
        let mut face = |f: usize, weight: f64| {
            for &x in faces.face(f) {
                add(x, weight / faces.face(f).len() as f64);
            }
        };
        if w >= v + e {
            return face(w - v - e, 1.0);
        }
        if w >= v {
            let c = self.edges[w - v];
            let sides = [Some(c), self.surface.topology().twin(c)];
            for c in sides.into_iter().flatten() {
                face(incidence.face_of(c), 0.25);
            }
            for c in sides.into_iter().flatten() {
                add(corners[c as usize], 0.25);
            }
            return;
        }
        let star = incidence.corners_at(w);
        let n = star.len() as f64;
        for &c in star {
            face(incidence.face_of(c), 1.0 / (n * n));
        }
        for &c in star {
            let range = faces.range(incidence.face_of(c));
            add(corners[next_in(&range, c) as usize], 1.0 / (n * n));
        }
        add(w as u32, (n - 2.0) / n);
    }

    /// The 16 control points of a patch of the refined mesh in terms of old ones: each old vertex that matters with
    /// its 16 weights.
    fn pull_back(&self, patch: &[u32; 16], local: &mut Vec<(u32, [f64; 16])>) {
        local.clear();
        for (k, &w) in patch.iter().enumerate() {
            self.mask(w as usize, &mut |x, weight| {
                // Some thirty vertices: looking through them beats any table.
                match local.iter_mut().find(|(y, _)| *y == x) {
                    Some((_, weights)) => weights[k] += weight,
                    None => {
                        let mut weights = [0.0; 16];
                        weights[k] = weight;
                        local.push((x, weights));
                    }
                }
            });
        }
    }
}

/// Symmetric matrices on one pattern from triplets (row, column, values), equal places summed in their order.
fn sum_triplets<const K: usize>(n: usize, triplets: &[(u32, u32, [f64; K])]) -> [Csr; K] {
    let mut starts = vec![0usize; n + 1];
    for t in triplets {
        starts[t.0 as usize + 1] += 1;
    }
    for i in 0..n {
        starts[i + 1] += starts[i];
    }
    let mut slots = starts.clone();
    let mut by_row = vec![(0u32, 0u32); triplets.len()];
    for (index, t) in triplets.iter().enumerate() {
        let slot = &mut slots[t.0 as usize];
        by_row[*slot] = (t.1, index as u32);
        *slot += 1;
    }
    let mut offsets = vec![0u32];
    let mut columns = Vec::new();
    let mut values: [Vec<f64>; K] = std::array::from_fn(|_| Vec::new());
    for i in 0..n {
        let row = &mut by_row[starts[i]..starts[i + 1]];
        row.sort_unstable();
        for same in row.chunk_by(|a, b| a.0 == b.0) {
            columns.push(same[0].0);
            for (k, values) in values.iter_mut().enumerate() {
                values.push(same.iter().map(|s| triplets[s.1 as usize].2[k]).sum());
            }
        }
        offsets.push(columns.len() as u32);
    }
    let pattern = Arc::new(Pattern::new(offsets, columns));
    values.map(|values| Csr::new(Arc::clone(&pattern), values))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{builtin, noise};

    fn energy(gram: &Gram, f: impl Fn(f64, f64) -> f64) -> f64 {
        let x: Vec<f64> = (0..16).map(|a| f((a / 4) as f64, (a % 4) as f64)).collect();
        (0..16).flat_map(|a| (0..16).map(move |b| (a, b))).map(|(a, b)| x[a] * gram[a][b] * x[b]).sum()
    }

    #[test]
    fn patch_energies_of_polynomials_in_closed_form() {
        let [thin, membrane] = patch_grams();
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} {b}");
        // Splines reproduce linear functions from their values: u + 2v has the gradient (1, 2).
        near(energy(&membrane, |u, v| u + 2.0 * v), 5.0);
        near(energy(&thin, |u, v| 3.0 + u + 2.0 * v), 0.0);
        // Control values u² give u² + ⅓: S_uu = 2; uv gives uv: S_uv = 1.
        near(energy(&thin, |u, _| u * u), 4.0);
        near(energy(&thin, |u, v| u * v), 2.0);
        // ∫ (2t)² over the unit patch between grid values 1 and 2.
        near(energy(&membrane, |_, v| v * v), 28.0 / 3.0);
    }

    /// Autocorrelations of the cubic B-spline and its derivatives: values of the B-spline of degree 7.
    #[test]
    fn line_grams_sum_to_the_known_autocorrelations() {
        let known = [
            [2416.0 / 5040.0, 1191.0 / 5040.0, 120.0 / 5040.0, 1.0 / 5040.0],
            [2.0 / 3.0, -1.0 / 8.0, -1.0 / 5.0, -1.0 / 120.0],
            [8.0 / 3.0, -3.0 / 2.0, 0.0, 1.0 / 6.0],
        ];
        for (order, known) in known.iter().enumerate() {
            let gram = line_gram(order);
            for (shift, expected) in known.iter().enumerate() {
                let sum: f64 = (0..4 - shift).map(|i| gram[i][i + shift]).sum();
                assert!((sum - expected).abs() < 1e-14, "{order} {shift}");
            }
        }
    }

    /// The form on the fine control points is the plain sum over all regular patches one level further, however the
    /// faces lie.
    #[test]
    fn the_form_is_the_sum_over_the_regular_patches_of_the_next_level() {
        for name in ["torus:4x5", "cube", "icosahedron", "irregular-poly:30", "star:7"] {
            let mut mesh = builtin::builtin(name).expect("a built-in mesh");
            noise::add_noise(&mut mesh, 0.1, 5);
            let surface = Surface::new(mesh).expect("closed");
            let fairness = Fairness::new(&surface).expect("closed");
            let finer = Refinement::CatmullClark.refined_n(&surface, LEVELS + 1).expect("closed");
            let grams = patch_grams();
            let mut expected = [0.0; 2];
            let mut patches = 0;
            for f in 0..finer.faces().len() {
                let Some(patch) = regular_patch(&finer, f) else {
                    continue;
                };
                patches += 1;
                for (sum, gram) in expected.iter_mut().zip(&grams) {
                    for (a, row) in gram.iter().enumerate() {
                        let p = finer.positions()[patch[a] as usize];
                        for (b, g) in row.iter().enumerate() {
                            *sum += g * p.dot(finer.positions()[patch[b] as usize]);
                        }
                    }
                }
            }
            let found = fairness.energies_of(&surface).expect("closed");
            assert!(patches > finer.faces().len() / 2);
            assert!((found.thin_plate / (16.0 * expected[0]) - 1.0).abs() < 1e-11, "{name}");
            assert!((found.membrane / expected[1] - 1.0).abs() < 1e-11, "{name}");
        }
    }
}
