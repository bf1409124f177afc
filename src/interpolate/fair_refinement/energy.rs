//! Thin-plate and membrane energies of a Doo-Sabin surface as quadratic forms over its first refined mesh.
//!
//! After one step every vertex has four faces. The square between their centroids is the unit square of a parameter
//! plane; it is a quad of the given mesh's Catmull-Clark refinement, so that energies are in the units of
//! [`halstead`](crate::interpolate::halstead). Where the four faces are quads, the surface over the square is a
//! biquadratic B-spline of 9 control points, and its energies are exact: tensor products of the Gram matrices of
//! the quadratic B-spline's derivatives.
//!
//! A square has one corner in a face of the given mesh, with p corners, and the opposite one in the face of a vertex,
//! with m. All that its energy depends on are the p + m + 1 vertices of the four faces: one matrix serves all squares
//! with the same (p, m).
//!
//! **What is left out.** A square with another face than quads is divided as the next step divides it: three of
//! the quarters, or two, are splines. The others are divided again, and what is then no spline, 1/16 of the square at such
//! a face, is left out, as by Catmull-Clark. It cannot be counted in this parametrisation: the subdominant eigenvalue is
//! ½ whatever the face, so that each further ring adds the same thin-plate energy.

use glam::DVec3;
use nalgebra::DMatrix;

use crate::interpolate::halstead::elements::{Elements, Kind, require_room};
use crate::interpolate::halstead::energy::{Energies, WHOLE, Weights};
use crate::memory::require;
use crate::mesh::Surface;
use crate::parallel;
use crate::schemes::Refinement;
use crate::schemes::doo_sabin::CornerRule;
use crate::{Error, Result};

/// Divisions of a square that is no spline.
const DIVISIONS: usize = 2;
/// Corners of one task.
const CHUNK: usize = 16_384;

/// The energies of all Doo-Sabin surfaces over the first refinement of one mesh.
#[derive(Clone, Debug)]
pub struct FirstFairness<'a> {
    pub(super) given: &'a Surface,
    pub(super) elements: Elements,
}

impl<'a> FirstFairness<'a> {
    /// Lists the vertices that each square takes, and makes the matrices. Time and memory O(corners), 250 B a corner
    /// with all that [`fairest`](super::fairest) keeps; O(n³) beside, and in every product, for each face and vertex of a
    /// great valence n.
    ///
    /// # Errors
    /// A mesh with creases, corners or a boundary: curves hold the surface there, and not its faces; one that is too
    /// large for memory or for 32-bit numbers.
    pub fn new(given: &'a Surface) -> Result<Self> {
        /// Of the elements, and of what the iterations keep, a corner.
        const BYTES: u64 = 250;
        Refinement::DooSabin.check(given)?;
        if given.features().is_some() {
            return Err(Error::Creased { what: "the fairest first refinement" });
        }
        Refinement::DooSabin.check_size(given, 1)?;
        let (faces, topology) = (given.faces(), given.topology());
        let corners = faces.corners();
        let what = || format!("the energy of the surface of {} vertices", given.len());
        require(BYTES * corners.len() as u64, what, "use a coarser mesh, or another method")?;
        let sizes = |c: u32| {
            let incidence = given.incidence();
            [faces.range(incidence.face_of(c)).len(), incidence.face_count(corners[c as usize] as usize)]
        };
        let mut pairs = parallel::flat_map(corners.len(), CHUNK, |range| {
            let mut pairs: Vec<[usize; 2]> = range.map(|c| sizes(c as u32)).collect();
            pairs.sort_unstable();
            pairs.dedup();
            pairs
        });
        pairs.sort_unstable();
        pairs.dedup();
        for &[p, m] in &pairs {
            require_room(p + m + 1, p.max(m))?;
        }
        let kinds = parallel::map(pairs.len(), 1, |k| {
            let [p, m] = pairs[k.start];
            let [thin_plate, membrane] = square(p, m, 0);
            Kind::new(p + m + 1, |i, j| [thin_plate[(i, j)], membrane[(i, j)]])
        });
        let list = |c: u32, vertices: &mut Vec<u32>| {
            let range = faces.range(given.incidence().face_of(c));
            let first = c as usize - range.start;
            vertices.extend((0..range.len()).map(|k| (range.start + (first + k) % range.len()) as u32));
            let twin = |c: u32| topology.twin(c).unwrap_or(c);
            let next_vertex = |c: u32| twin(given.incidence().prev(faces, c));
            let mut at = next_vertex(c);
            while at != c {
                vertices.push(at);
                at = next_vertex(at);
            }
            vertices.extend([twin(c), given.incidence().next(faces, next_vertex(c))]);
            pairs.partition_point(|pair| *pair < sizes(c)) as u32
        };
        let elements = Elements::of_list(given, corners.to_vec(), kinds, &list)?;
        Ok(FirstFairness { given, elements })
    }

    /// The energies of the surface of a first refined mesh, from its vertices in the order of
    /// [`refine_by`](crate::schemes::doo_sabin::refine_by): one a corner of the given mesh. In parallel, the same for any
    /// number of threads.
    ///
    /// # Panics
    /// If there is not one point a corner.
    pub fn energies(&self, points: &[DVec3]) -> Energies {
        self.require_points(points);
        let [thin_plate, membrane] = self.elements.energies(&self.elements.there(points));
        Energies { thin_plate, membrane }
    }

    /// K x, half the gradient of the weighted energies, at the vertices x of the first refined mesh.
    ///
    /// # Panics
    /// As [`energies`](Self::energies).
    pub fn gradient(&self, points: &[DVec3], weights: Weights) -> Vec<DVec3> {
        self.require_points(points);
        let forms = self.elements.weighted(weights);
        let mut product = vec![DVec3::ZERO; points.len()];
        self.elements.apply(&forms, &self.elements.there(points), &mut product, &|_, _: &[DVec3], _: &mut [DVec3]| ());
        self.elements.back(&product)
    }

    pub(super) fn require_points(&self, points: &[DVec3]) {
        assert_eq!(points.len(), self.given.faces().corners().len(), "one point a corner");
    }
}

/// The pieces of the quadratic B-spline on [0, 1] as coefficients of 1, t, t².
const PIECES: [[f64; 3]; 3] = [[0.5, -1.0, 0.5], [0.5, 1.0, -1.0], [0.0, 0.0, 0.5]];

/// ∫₀¹ of products of the `order`-th derivatives of the pieces.
fn line_gram(order: usize) -> [[f64; 3]; 3] {
    let derivative = |mut p: [f64; 3]| {
        for _ in 0..order {
            p = [p[1], 2.0 * p[2], 0.0];
        }
        p
    };
    let pieces = PIECES.map(derivative);
    let integral = |p: &[f64; 3], q: &[f64; 3]| {
        let terms = (0..9).map(|k| (k / 3, k % 3));
        terms.map(|(i, j)| p[i] * q[j] / (i + j + 1) as f64).sum()
    };
    pieces.map(|p| pieces.map(|q| integral(&p, &q)))
}

/// The places in the 3 × 3 control points of a spline of the vertices of a square, in the order of [`around`].
const PLACES: [[usize; 2]; 9] = [[1, 1], [2, 1], [2, 2], [1, 2], [0, 1], [0, 0], [1, 0], [2, 0], [0, 2]];

/// The two energies of a square that is a spline.
fn spline() -> [DMatrix<f64>; 2] {
    let [g0, g1, g2] = [0, 1, 2].map(line_gram);
    let form = |entry: &dyn Fn([usize; 2], [usize; 2]) -> f64| {
        DMatrix::from_fn(9, 9, |i, j| {
            let ([iu, iv], [ju, jv]) = (PLACES[i], PLACES[j]);
            entry([iu, ju], [iv, jv])
        })
    };
    [
        form(&|[i, j], [k, l]| g2[i][j] * g0[k][l] + 2.0 * g1[i][j] * g1[k][l] + g0[i][j] * g2[k][l]),
        form(&|[i, j], [k, l]| g1[i][j] * g0[k][l] + g0[i][j] * g1[k][l]),
    ]
}

/// The four faces of a vertex counter-clockwise, each from the vertex on: one with p corners, the quad of the side that
/// enters the vertex in it, one with m, the quad of the side that leaves. The vertices have numbers: those of the first
/// face, the others of the third, the remaining one of the last quad, that of the other.
fn around(p: usize, m: usize) -> [Vec<usize>; 4] {
    let opposite = |k: usize| if k == 0 { 0 } else { p + k - 1 };
    [
        (0..p).collect(),
        vec![0, p - 1, p + m, opposite(1)],
        (0..m).map(opposite).collect(),
        vec![0, opposite(m - 1), p + m - 1, 1],
    ]
}

/// Thin plate and membrane of a square between a face with p corners and one with m, after so many divisions.
fn square(p: usize, m: usize, divisions: usize) -> [DMatrix<f64>; 2] {
    if [p, m] == [4, 4] {
        return spline();
    }
    let points = p + m + 1;
    let mut sums = [(); 2].map(|()| DMatrix::zeros(points, points));
    if divisions == DIVISIONS {
        return sums;
    }
    let faces = around(p, m);
    for k in 0..4 {
        // Of the quarter in the k-th face: the others as they lie about it.
        let [own, after, opposite, before] = [0, 1, 2, 3].map(|turn| &faces[(k + turn) % 4]);
        let n = own.len();
        let mut new: Vec<(&[usize], usize)> = (0..n).map(|j| (own.as_slice(), j)).collect();
        new.extend([(after.as_slice(), 0), (opposite, 0), (before, 0), (before, before.len() - 1), (after, 1)]);
        let mut step = DMatrix::zeros(n + 5, points);
        for (row, (face, j)) in new.into_iter().enumerate() {
            for (i, weight) in CornerRule::DooSabin.circulant(face.len()).into_iter().enumerate() {
                step[(row, face[(i + j) % face.len()])] += weight;
            }
        }
        // Halving the parameters' sides: second derivatives ×4, their squares ×16, areas ×¼; the first energy stays.
        for ((sum, quarter), factor) in sums.iter_mut().zip(square(n, 4, divisions + 1)).zip([WHOLE, 1.0]) {
            *sum += factor * step.transpose() * quarter * &step;
        }
    }
    sums
}
