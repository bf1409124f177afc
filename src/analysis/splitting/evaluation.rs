//! Exact evaluation of subdivision surfaces at any parameter, by eigendecomposition (Stam 1998): of Catmull-Clark and Loop
//! about an extraordinary vertex, of Doo-Sabin about an extraordinary face, as Zheng & Cai suggest (2005, Remark 2).
//!
//! Away from the middle the surface consists of polynomial patches, which a round of refinement brings ever nearer to it. A point
//! at the distance 2^-k in the parameters lies in a patch of the control points after k rounds, M S^{k−1} V: S on two rings is the
//! splitting matrix, and M leads from two rings to the third, which a patch reaches. On an invariant subspace with the right
//! basis R and the left one L, S^k is R Tᵏ (LᵀR)⁻¹Lᵀ, T = (LᵀR)⁻¹LᵀSR being λ or, where that is defective, a small matrix.

use glam::DVec3;
use limitlab_factorizations::dense::small_lu;
use nalgebra::{DMatrix, DVector};

use super::matrix::{SplittingMatrix, rows};
use super::scheme::LocalScheme;
use super::star::Layout;
use crate::error::{Error, Result};

/// Rings of control points that determine the surface on the faces about a vertex, or between an extraordinary face and
/// its neighbours.
pub const RINGS: usize = 2;

/// A surface about one extraordinary vertex or face, prepared for control points that come later.
///
/// ```
/// use glam::DVec3;
/// use limitlab::analysis::splitting::evaluation::RINGS;
/// use limitlab::analysis::splitting::{ExactSurface, LocalScheme};
/// use limitlab::mesh::Surface;
/// use limitlab::mesh::builtin::builtin;
/// use limitlab::schemes::catmull_clark;
///
/// // A corner of a cube whose quads were split: vertex 0, with three of them.
/// let surface = Surface::new(builtin("quad-sphere:2")?)?;
/// let scheme = LocalScheme::CatmullClark;
/// let root = surface.incidence().corners_at(0)[0];
/// let star = scheme.layout().walk(&surface, root, 3, RINGS)?;
/// let control: Vec<DVec3> = star.iter().map(|&v| surface.positions()[v as usize]).collect();
/// let exact = ExactSurface::new(scheme, 3)?;
/// let limits = catmull_clark::limit_positions(&surface)?;
/// assert!(exact.point(&control, 0, [0.0, 0.0]).distance(limits[0]) < 1e-12);
/// assert!(exact.point(&control, 0, [1.0, 0.0]).distance(limits[star[1] as usize]) < 1e-12);
/// # Ok::<(), limitlab::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct ExactSurface {
    /// The scheme, [`CatmullClark`](LocalScheme::CatmullClark), [`Loop`](LocalScheme::Loop) or
    /// [`DooSabin`](LocalScheme::DooSabin).
    pub scheme: LocalScheme,
    /// Sectors n about the middle vertex or face.
    pub valence: usize,
    parts: Vec<Part>,
    /// From two rings to the third after one round.
    outward: DMatrix<f64>,
}

/// S on one invariant subspace.
#[derive(Clone, Debug)]
struct Part {
    right: DMatrix<f64>,
    /// (LᵀR)⁻¹Lᵀ: the coordinates in the basis.
    coordinates: DMatrix<f64>,
    power: DMatrix<f64>,
}

impl ExactSurface {
    /// The eigendecomposition of the splitting matrix on two rings: O(n·m³) for m orbits.
    ///
    /// # Errors
    /// A scheme without polynomial patches, a valence outside [`VALENCES`](super::VALENCES), or eigenvalues that do not
    /// converge.
    pub fn new(scheme: LocalScheme, valence: usize) -> Result<Self> {
        match scheme {
            LocalScheme::CatmullClark | LocalScheme::Loop | LocalScheme::DooSabin => {}
            LocalScheme::Sqrt3 { .. }
            | LocalScheme::Blend { .. }
            | LocalScheme::PushBack { .. }
            | LocalScheme::LabsikGreiner
            | LocalScheme::Kobbelt => {
                let what = format!("surfaces of {scheme} have no polynomial patches to evaluate: refine them");
                return Err(Error::Computation(what));
            }
        }
        let matrix = SplittingMatrix::on_rings(scheme, valence, RINGS)?;
        let parts = matrix.eigenspaces()?.into_iter().map(|space| {
            let left = space.left.transpose();
            let gram = small_lu(&left * &space.right);
            let solved = |rest: DMatrix<f64>| {
                let defective = || {
                    Error::Computation(format!(
                        "{scheme} at valence {valence}: bases of λ = {} are orthogonal",
                        space.value
                    ))
                };
                gram.solve(&rest).ok_or_else(defective)
            };
            let power = solved(&left * &matrix.entries * &space.right)?;
            Ok(Part { coordinates: solved(left.clone())?, power, right: space.right })
        });
        let parts = parts.collect::<Result<Vec<Part>>>()?;
        Ok(ExactSurface { scheme, valence, parts, outward: rows(scheme, valence, RINGS, RINGS + 1)? })
    }

    /// The limit point at the parameters (u, v) ∈ \[0, 1\]² of a sector, Loop u + v ≤ 1: u along its first edge, v along the next
    /// sector's; about a face, from its centre towards the corner of the sector. `control` are the positions of two rings in the
    /// order of [`Layout`], as [`Layout::walk`] finds them in a mesh whose other vertices there are regular. O(N²) for N of them,
    /// however near to the middle.
    ///
    /// # Panics
    /// If there are not so many positions, or the parameters are outside.
    pub fn point(&self, control: &[DVec3], sector: usize, [u, v]: [f64; 2]) -> DVec3 {
        let layout = self.scheme.layout();
        assert_eq!(control.len(), layout.len(self.valence, RINGS), "two rings of control points");
        let triangles = layout == Layout::Triangles;
        let reach = if triangles { u + v } else { u.max(v) };
        assert!(u >= 0.0 && v >= 0.0 && reach <= 1.0, "parameters of a sector");
        if reach == 0.0 {
            return self.after(control, None)[0];
        }
        // 2^k·reach lies in (1, 2].
        let rounds = (-reach.log2()).floor() as i32 + 1;
        // In two factors, as 2¹⁰²⁴ is no double.
        let [u, v] = [u, v].map(|x| x * 2f64.powi(rounds / 2) * 2f64.powi(rounds - rounds / 2));
        let points = self.after(control, Some(rounds as u32 - 1));
        let at = |i: i64, j: i64| points[layout.position(self.valence, sector, i, j) as usize];
        match layout {
            Layout::Triangles => box_spline(at, u, v),
            Layout::Quads => tensor(at, u, v, cubic),
            // The corner (0, 0) of a sector lies at the parameters (½, ½).
            Layout::QuadsAboutFace => tensor(at, u, v, quadratic),
        }
    }

    /// Three rings one round after `rounds` others; without a number, the limit of all.
    fn after(&self, control: &[DVec3], rounds: Option<u32>) -> Vec<DVec3> {
        let mut ring = vec![DVec3::ZERO; control.len()];
        for axis in 0..3 {
            let x = DVector::from_iterator(control.len(), control.iter().map(|p| p[axis]));
            let mut y = DVector::zeros(control.len());
            let kept = if rounds.is_some() { self.parts.len() } else { 1 };
            for part in &self.parts[..kept] {
                let power =
                    rounds.map_or(DMatrix::identity(part.power.nrows(), part.power.nrows()), |k| part.power.pow(k));
                y += &part.right * (power * (&part.coordinates * &x));
            }
            for (point, y) in ring.iter_mut().zip(y.iter()) {
                point[axis] = *y;
            }
        }
        if rounds.is_none() {
            return ring;
        }
        let row = |i: usize| ring.iter().enumerate().map(|(j, p)| self.outward[(i, j)] * *p).sum();
        (0..self.outward.nrows()).map(row).collect()
    }
}

/// A tensor-product spline: `basis(t)` weighs the points from one before the cell of t on.
fn tensor<const K: usize>(at: impl Fn(i64, i64) -> DVec3, u: f64, v: f64, basis: fn(f64) -> [f64; K]) -> DVec3 {
    // Up to the far end of the second cell.
    let [(i, s), (j, t)] = [u, v].map(|x| (x.floor().min(1.0), x - x.floor().min(1.0)));
    let (a, b) = (basis(s), basis(t));
    let mut sum = DVec3::ZERO;
    for (p, a) in (i as i64 - 1..).zip(a) {
        for (q, b) in (j as i64 - 1..).zip(b) {
            sum += a * b * at(p, q);
        }
    }
    sum
}

/// The uniform cubic B-splines on a cell.
fn cubic(t: f64) -> [f64; 4] {
    let r = 1.0 - t;
    [r * r * r, 4.0 - 6.0 * t * t + 3.0 * t * t * t, 4.0 - 6.0 * r * r + 3.0 * r * r * r, t * t * t].map(|x| x / 6.0)
}

/// The uniform quadratic ones.
fn quadratic(t: f64) -> [f64; 3] {
    let r = 1.0 - t;
    [0.5 * r * r, 0.5 + t * r, 0.5 * t * t]
}

/// The quartic box spline of a regular triangulation, in Bernstein's form, on one of the three cells between u + v = 1 and 2.
fn box_spline(at: impl Fn(i64, i64) -> DVec3, u: f64, v: f64) -> DVec3 {
    // The corners of the cell, counter-clockwise, and the weights of the latter two.
    let (corners, [v, w]) = if u >= 1.0 {
        ([[1, 0], [2, 0], [1, 1]], [u - 1.0, v])
    } else if v >= 1.0 {
        ([[0, 1], [1, 1], [0, 2]], [u, v - 1.0])
    } else {
        ([[1, 1], [0, 1], [1, 0]], [1.0 - u, 1.0 - v])
    };
    let weights = [1.0 - v - w, v, w];
    let mut sum = DVec3::ZERO;
    for k in 0..3 {
        let [p, q, r] = [0, 1, 2].map(|step| corners[(k + step) % 3]);
        let [u, v, w] = [0, 1, 2].map(|step| weights[(k + step) % 3]);
        let [u2, v2, w2] = [u, v, w].map(|x| x * x);
        // Point a + b − c, and what is beside it.
        let beyond = |a: [i64; 2], b: [i64; 2], c: [i64; 2]| at(a[0] + b[0] - c[0], a[1] + b[1] - c[1]);
        let corner = 6.0 * u2 * u2
            + 24.0 * u2 * u * (v + w)
            + u2 * (24.0 * v2 + 60.0 * v * w + 24.0 * w2)
            + u * (8.0 * v2 * v + 36.0 * v2 * w + 36.0 * v * w2 + 8.0 * w2 * w)
            + (v2 * v2 + 6.0 * v2 * v * w + 12.0 * v2 * w2 + 6.0 * v * w2 * w + w2 * w2);
        sum += corner * at(p[0], p[1]);
        // Across the edge pq.
        let across = u2 * u2
            + 6.0 * u2 * u * v
            + 12.0 * u2 * v2
            + 6.0 * u * v2 * v
            + v2 * v2
            + w * (2.0 * u2 * u + 6.0 * u2 * v + 6.0 * u * v2 + 2.0 * v2 * v);
        sum += across * beyond(p, q, r);
        // The two others at p: straight on from q, and from r.
        sum += (u2 * u2 + 2.0 * u2 * u * w) * beyond(p, p, q);
        sum += (u2 * u2 + 2.0 * u2 * u * v) * beyond(p, p, r);
    }
    sum / 12.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::random::random_points;
    use crate::mesh::{Mesh, Surface};

    const SCHEMES: [LocalScheme; 3] = [LocalScheme::CatmullClark, LocalScheme::Loop, LocalScheme::DooSabin];

    /// By refinement alone: positions of a finer mesh about the middle pushed to their limits, of Doo-Sabin centroids of faces.
    #[test]
    fn points_are_those_of_refinement() {
        const ROUNDS: u32 = 4;
        for scheme in SCHEMES {
            for n in [3, 4, 5, 6, 7, 9, 12] {
                let layout = scheme.layout();
                let faces = layout.closed(n, 4);
                let points = random_points(layout.len(n, 4) + 1, n as u64);
                let mut surface = Surface::new(Mesh::new(points, faces)).expect("closed");
                let control = layout.walk(&surface, 0, n, RINGS).expect("a star");
                let control: Vec<DVec3> = control.iter().map(|&v| surface.positions()[v as usize]).collect();
                let exact = ExactSurface::new(scheme, n).expect("patches");
                let mut root = 0;
                for _ in 0..ROUNDS {
                    surface = Surface::of_valid(scheme.step(&surface).expect("a step"));
                    root = scheme.root_after_step(root);
                }
                let steps = 1 << ROUNDS;
                let found = layout.walk(&surface, root, n, steps + 1).expect("a star");
                let limits = match scheme {
                    LocalScheme::CatmullClark => {
                        crate::schemes::catmull_clark::limit_positions(&surface).expect("limits")
                    }
                    LocalScheme::Loop => crate::schemes::loop_scheme::limit_positions(&surface).expect("limits"),
                    _ => surface.positions().to_vec(),
                };
                let at = |s: usize, i: i64, j: i64| limits[found[layout.position(n, s, i, j) as usize] as usize];
                let mut worst = 0.0f64;
                for sector in [0, n - 1] {
                    for i in 0..=steps as i64 {
                        for j in 0..=steps as i64 {
                            let expected = match layout {
                                Layout::Triangles if i + j > steps as i64 => continue,
                                // A face keeps its centroid.
                                Layout::QuadsAboutFace if (i, j) == (0, 0) => {
                                    control[..n].iter().sum::<DVec3>() / n as f64
                                }
                                Layout::QuadsAboutFace => {
                                    0.25 * (at(sector, i - 1, j - 1)
                                        + at(sector, i, j - 1)
                                        + at(sector, i, j)
                                        + at(sector, i - 1, j))
                                }
                                _ => at(sector, i, j),
                            };
                            let parameters = [i, j].map(|x| x as f64 / steps as f64);
                            worst = worst.max(exact.point(&control, sector, parameters).distance(expected));
                        }
                    }
                }
                assert!(worst < 1e-12, "{scheme} {n}: {worst:e}");
            }
        }
    }

    /// Where refinement hardly follows: of the characteristic net, all of it λ_1, a point half as far is λ_1 times the former.
    #[test]
    fn points_of_the_characteristic_map_shrink_by_the_subdominant_eigenvalue() {
        for scheme in SCHEMES {
            for n in [3, 5, 8] {
                let exact = ExactSurface::new(scheme, n).expect("patches");
                let matrix = SplittingMatrix::on_rings(scheme, n, RINGS).expect("a matrix");
                let control: Vec<DVec3> =
                    matrix.characteristic_net().expect("a net").iter().map(|p| p.extend(0.0)).collect();
                let at = |k: i32| exact.point(&control, 1, [0.4, 0.3].map(|x| x * 0.5f64.powi(k)));
                let lambda = scheme.subdominant_formula(n).expect("a formula");
                assert!(at(12).distance(lambda.powi(7) * at(5)) < 1e-7 * at(12).length(), "{scheme} {n}");
                for tiny in [0.0, 5e-324, 1e-310] {
                    assert!(exact.point(&control, 1, [tiny, 0.0]).length() < 1e-14, "{scheme} {n}");
                }
            }
        }
    }

    #[test]
    fn a_scheme_without_patches_is_refused() {
        assert!(ExactSurface::new(LocalScheme::LabsikGreiner, 5).unwrap_err().to_string().contains("refine them"));
    }
}
