//! The plain reference: H and M of every scheme, straight from their formulas, through the triplets of nalgebra-sparse
//! and with dense eigenvalues by nalgebra. It shares no code with the assembler.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use limitlab::mesh::Mesh;
use limitlab::schemes::Scheme;
use limitlab_factorizations::dense::small_symmetric_eigenvalues;
use nalgebra::DMatrix;
use nalgebra_sparse::convert::serial::convert_csr_dense;
use nalgebra_sparse::{CooMatrix, CsrMatrix};

pub struct Plain {
    pub h: Vec<f64>,
    pub m: CsrMatrix<f64>,
    pub a: CsrMatrix<f64>,
}

/// A face side of the mesh, from a vertex to the next.
fn sides(mesh: &Mesh) -> impl Iterator<Item = (usize, usize)> {
    mesh.faces.iter().flat_map(|face| (0..face.len()).map(|k| (face[k] as usize, face[(k + 1) % face.len()] as usize)))
}

/// How often every pair of vertices is joined: two sides make an edge, and so does a single one on a boundary.
fn edges(mesh: &Mesh) -> BTreeMap<(usize, usize), usize> {
    let mut count: BTreeMap<(usize, usize), usize> = BTreeMap::new();
    for (v, w) in sides(mesh) {
        *count.entry((v.min(w), v.max(w))).or_default() += 1;
    }
    count.values_mut().for_each(|c| *c = c.div_ceil(2));
    count
}

fn beta(scheme: Scheme, n: f64) -> f64 {
    let cosine = (TAU / n).cos();
    match scheme {
        Scheme::Loop => 3.0 / (11.0 - 8.0 * (3.0 / 8.0 + (3.0 / 8.0 + 0.25 * cosine).powi(2))),
        Scheme::Sqrt3 => 1.0 / (1.0 + (4.0 - 2.0 * cosine) / 3.0),
        _ => unreachable!("{scheme} has no beta"),
    }
}

fn weights(scheme: Scheme, n: f64) -> (f64, f64) {
    match scheme {
        Scheme::CatmullClark => (1.0 / (n * (n + 5.0)), n * n - n),
        Scheme::Loop | Scheme::Sqrt3 => {
            let b = beta(scheme, n);
            ((1.0 - b) / n, n * b / (1.0 - b))
        }
        Scheme::Nasri => (1.0 / n, 0.0),
        Scheme::ZhengCai | Scheme::MidEdge => (1.0 / (2.0 * n), n),
    }
}

pub fn assemble(scheme: Scheme, mesh: &Mesh) -> Plain {
    let count = mesh.len();
    let edges = edges(mesh);
    let mut valence = vec![0usize; count];
    for (&(v, w), &times) in &edges {
        valence[v] += times;
        valence[w] += times;
    }
    let mut m = CooMatrix::new(count, count);
    let mut diagonal = CooMatrix::new(count, count);
    let mut h = Vec::new();
    for (v, &n) in valence.iter().enumerate() {
        let (hv, d) = weights(scheme, n as f64);
        h.push(hv);
        diagonal.push(v, v, hv);
        m.push(v, v, d);
    }
    let edge = match scheme {
        Scheme::CatmullClark => 2.0,
        Scheme::Loop | Scheme::Sqrt3 | Scheme::MidEdge => 1.0,
        Scheme::Nasri | Scheme::ZhengCai => 0.0,
    };
    if edge > 0.0 {
        for (&(v, w), &times) in &edges {
            m.push(v, w, edge * times as f64);
            m.push(w, v, edge * times as f64);
        }
    }
    for face in mesh.faces.iter() {
        let size = face.len() as f64;
        for (i, &v) in face.iter().enumerate() {
            for (j, &w) in face.iter().enumerate() {
                let entry = match scheme {
                    Scheme::CatmullClark => 4.0 / size,
                    Scheme::Loop | Scheme::Sqrt3 | Scheme::MidEdge => continue,
                    Scheme::Nasri => {
                        let own = if i == j { 0.25 } else { 0.0 };
                        let angle = TAU * (i as f64 - j as f64) / size;
                        own + (3.0 + 2.0 * angle.cos()) / (4.0 * size)
                    }
                    Scheme::ZhengCai => 1.0 / size,
                };
                m.push(v as usize, w as usize, entry);
            }
        }
    }
    let m = CsrMatrix::from(&m);
    let a = &CsrMatrix::from(&diagonal) * &m;
    Plain { h, m, a }
}

impl Plain {
    pub fn dense_a(&self) -> DMatrix<f64> {
        convert_csr_dense(&self.a)
    }

    pub fn dense_m(&self) -> DMatrix<f64> {
        convert_csr_dense(&self.m)
    }

    /// The eigenvalues of A, ascending, from H^½MH^½.
    pub fn eigenvalues(&self) -> Vec<f64> {
        let scale: Vec<f64> = self.h.iter().map(|h| h.sqrt()).collect();
        self.scaled_eigenvalues(&scale)
    }

    /// The eigenvalues of D⁻¹A = diag(M)⁻¹M, ascending.
    pub fn jacobi_eigenvalues(&self) -> Vec<f64> {
        let scale: Vec<f64> = self.dense_m().diagonal().map(|d| 1.0 / d.sqrt()).as_slice().to_vec();
        self.scaled_eigenvalues(&scale)
    }

    fn scaled_eigenvalues(&self, scale: &[f64]) -> Vec<f64> {
        let mut matrix = self.dense_m();
        for i in 0..scale.len() {
            for j in 0..scale.len() {
                matrix[(i, j)] *= scale[i] * scale[j];
            }
        }
        let mut values = small_symmetric_eigenvalues(matrix).as_slice().to_vec();
        values.sort_by(f64::total_cmp);
        values
    }
}
