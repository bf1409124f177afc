//! Baseline of the measurements: Chebyshev iteration as one would write it first. Index-only in double precision,
//! vertices in file order, 32-bit neighbours, and one pass over the arrays for each operation: product, residual with
//! its norm, update. No fusion, no single precision, no order. It belongs to the measurements, not to the library.

use glam::DVec3;
use limitlab::mesh::{Incidence, Mesh};
use limitlab::schemes::{Masks, Scheme};
use limitlab::solvers::chebyshev::Recurrence;
use rayon::prelude::*;

const CHUNK: usize = 4096;

/// A = H·M on a closed mesh of quads only, or of triangles only.
pub struct Plain {
    offsets: Vec<u32>,
    neighbours: Vec<u32>,
    /// By valence: the weights of the vertex, of edge neighbours, of opposite corners.
    weights: Vec<[f64; 3]>,
    /// Neighbours in each face: one on triangles, two on quads.
    per_face: usize,
}

impl Plain {
    /// `None` unless all faces are triangles or all are quads.
    pub fn new(mesh: &Mesh, scheme: Scheme) -> Option<Plain> {
        let size = mesh.faces.uniform_size().filter(|s| (3..=4).contains(s))?;
        let incidence = Incidence::new(&mesh.faces, mesh.len());
        let per_face = size - 2;
        let mut offsets = vec![0u32];
        let mut neighbours = Vec::with_capacity(per_face * mesh.faces.corners().len());
        let mut greatest = 0;
        for v in 0..mesh.len() {
            for step in 1..=per_face {
                for &c in incidence.corners_at(v) {
                    let face = mesh.faces.face(incidence.face_of(c));
                    neighbours.push(face[(c as usize % size + step) % size]);
                }
            }
            offsets.push(neighbours.len() as u32);
            greatest = greatest.max(incidence.face_count(v));
        }
        let face = |steps| {
            if scheme.edges_only() { 0.0 } else { scheme.face_weight(size, steps) }
        };
        let weights = (0..=greatest)
            .map(|n| {
                let n = n.max(1);
                let h = scheme.h(n);
                let own = scheme.vertex_weight(n) + n as f64 * face(0);
                [h * own, h * (scheme.edge_weight() + face(1) + face(size - 1)), h * face(2)]
            })
            .collect();
        Some(Plain { offsets, neighbours, weights, per_face })
    }

    fn row(&self, i: usize, x: &[DVec3]) -> DVec3 {
        let row = &self.neighbours[self.offsets[i] as usize..self.offsets[i + 1] as usize];
        let n = row.len() / self.per_face;
        let (near, across) = row.split_at(n);
        let sum = |list: &[u32]| {
            let mut sum = DVec3::ZERO;
            for &j in list {
                sum += x[j as usize];
            }
            sum
        };
        let [own, edge, opposite] = self.weights[n];
        own * x[i] + edge * sum(near) + opposite * sum(across)
    }

    /// `y ← A x`.
    pub fn product(&self, x: &[DVec3], y: &mut [DVec3]) {
        y.par_chunks_mut(CHUNK).enumerate().for_each(|(k, y)| {
            for (t, y) in y.iter_mut().enumerate() {
                *y = self.row(k * CHUNK + t, x);
            }
        });
    }

    /// Control points, the number of iterations, and whether the tolerance was met.
    pub fn chebyshev(
        &self,
        points: &[DVec3],
        interval: (f64, f64),
        tolerance: f64,
        most: usize,
    ) -> (Vec<DVec3>, usize, bool) {
        let n = points.len();
        let mut recurrence = Recurrence::new(interval);
        let mut x = points.to_vec();
        let mut step = vec![DVec3::ZERO; n];
        let mut work = vec![DVec3::ZERO; n];
        for iteration in 0.. {
            self.product(&x, &mut work);
            work.par_iter_mut().zip(points).with_min_len(CHUNK).for_each(|(w, p)| *w = *p - *w);
            let largest = work.par_iter().with_min_len(CHUNK).map(|e| e.length_squared()).reduce(|| 0.0, f64::max);
            let converged = largest.sqrt() <= tolerance;
            if converged || iteration == most {
                return (x, iteration, converged);
            }
            let (gamma, tau) = recurrence.coefficients();
            step.par_iter_mut().zip(&work).with_min_len(CHUNK).for_each(|(s, e)| *s = gamma * *s + tau * *e);
            x.par_iter_mut().zip(&step).with_min_len(CHUNK).for_each(|(x, s)| *x += *s);
            recurrence.step();
        }
        unreachable!("the loop ends by its own conditions")
    }
}
