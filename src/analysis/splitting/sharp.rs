//! Splitting matrices at boundary, crease, corner and dart vertices: eigenvalues, limit and tangent masks, whether there is a
//! tangent plane.
//!
//! The star of a vertex v among quads or triangles is refined from itself alone: from v, the ends e_j of its edges and, among
//! quads, the opposite corners f_j of its faces. Sharp edges divide it into *sectors*, of m faces each, and the curve v, e_0,
//! e_m is refined without what lies inside a sector. So the matrix is block triangular, with the eigenvalues of the curve, 1,
//! ½ and ¼ (at a corner 1, ½ and ½), and those of the inside of each sector: with θ_j = jπ/m, j = 1…m − 1,
//!
//! - Catmull-Clark (5 + cos θ_j ± cos(θ_j/2)√(2(9 + cos θ_j)))/16, and ¼;
//! - Loop ⅜ + ¼cos θ_j.
//!
//! Along a curve, e_m − e_0 is the left eigenvector of ½; across it, that of j = 1. The surface of a sector has a tangent plane
//! if the second of its modes is below ½: Catmull-Clark up to 3 faces, Loop up to 5. At a corner it has one if it is a single
//! face. At a dart there is one sector, bent around the end of the curve, and no closed form of the eigenvalues.

use std::fmt;
use std::ops::RangeInclusive;

use faer::Mat;
use glam::DVec3;
use limitlab_factorizations::dense::{eigenvalues, svd};
use nalgebra::{Complex, DMatrix, DVector};

use super::scheme::LocalScheme;
use super::spectrum::LEAD;
use super::{VALENCES, largest_difference, sort};
use crate::error::{Error, Result};
use crate::mesh::features::{SHARP, Tags};
use crate::mesh::incidence::{next_in, prev_in};
use crate::mesh::validate::Boundary;
use crate::mesh::{Faces, Mesh, Surface};
use crate::parallel;
use crate::schemes::local_limit::{Star, StarRule};

/// Where in a mesh a local matrix is that of a vertex which is not smooth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SharpVertex {
    /// On a boundary, with as many faces as the valence.
    Boundary,
    /// Inside, on a crease that leaves half of the faces on each side, the smaller half on the left.
    Crease,
    /// On a boundary, with as many faces as the valence, and at rest.
    Corner,
    /// Inside, where one sharp edge ends.
    Dart,
}

impl SharpVertex {
    /// All of them.
    pub const ALL: [SharpVertex; 4] =
        [SharpVertex::Boundary, SharpVertex::Crease, SharpVertex::Corner, SharpVertex::Dart];

    /// One word in lower case.
    pub fn name(self) -> &'static str {
        match self {
            SharpVertex::Boundary => "boundary",
            SharpVertex::Crease => "crease",
            SharpVertex::Corner => "corner",
            SharpVertex::Dart => "dart",
        }
    }

    /// How many faces it may have.
    pub fn valences(self) -> RangeInclusive<usize> {
        match self {
            SharpVertex::Boundary | SharpVertex::Corner => 1..=*VALENCES.end(),
            SharpVertex::Crease | SharpVertex::Dart => VALENCES,
        }
    }
}

impl SharpVertex {
    /// Passes if a scheme has local matrices at such vertices: Catmull-Clark and Loop.
    ///
    /// # Errors
    /// [`Error::Unknown`] for others.
    pub fn require_rules(self, scheme: LocalScheme) -> Result<()> {
        self.rule(scheme).map(|_| ())
    }

    fn rule(self, scheme: LocalScheme) -> Result<StarRule> {
        match scheme {
            LocalScheme::CatmullClark => Ok(StarRule::CatmullClark),
            LocalScheme::Loop => Ok(StarRule::Loop),
            LocalScheme::DooSabin
            | LocalScheme::Sqrt3 { .. }
            | LocalScheme::Blend { .. }
            | LocalScheme::PushBack { .. }
            | LocalScheme::LabsikGreiner
            | LocalScheme::Kobbelt => Err(Error::Unknown(format!(
                "{} has no local matrix at a {self} vertex: choose catmull-clark or loop",
                scheme.name()
            ))),
        }
    }
}

impl fmt::Display for SharpVertex {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// A left eigenvector of a local matrix.
#[derive(Clone, Debug)]
pub struct SharpMask {
    /// What it is the mask of: `limit`, `along`, `across`, ….
    pub name: &'static str,
    /// Its eigenvalue λ.
    pub eigenvalue: f64,
    /// One weight a position: of the limit with sum 1, of tangents with ±1 as the largest.
    pub weights: Vec<f64>,
    /// The largest entry of Sᵀw − λw.
    pub residual: f64,
}

/// The faces between two sharp edges.
#[derive(Clone, Debug)]
pub struct SharpSector {
    /// How many they are.
    pub faces: usize,
    /// The eigenvalues of its inside, falling.
    pub modes: Vec<f64>,
    /// Whether the surface has a tangent plane there.
    pub tangent_plane: bool,
}

/// What the local matrix of one valence is like at a vertex that is not smooth.
#[derive(Clone, Debug)]
pub struct SharpRow {
    /// How many faces the vertex has.
    pub valence: usize,
    /// The names of the positions: `v`, `e0`, …, `f0`, ….
    pub positions: Vec<String>,
    /// All eigenvalues, by falling modulus.
    pub eigenvalues: Vec<Complex<f64>>,
    /// max |computed − formula| over all eigenvalues, both sorted; none at a dart.
    pub eigenvalue_error: Option<f64>,
    /// The limit mask, then those of tangents where there are some.
    pub masks: Vec<SharpMask>,
    /// max |computed − formula| of the limit mask; at a dart against the row of A.
    pub limit_mask_error: f64,
    /// One; of a crease that on the left and that on the right.
    pub sectors: Vec<SharpSector>,
}

/// Rows of a scheme for several valences, in parallel.
///
/// # Errors
/// [`Error::Unknown`] for a scheme that has no rules of sharp edges here, or a valence outside
/// [`SharpVertex::valences`]; if eigenvalues do not converge.
///
/// ```
/// use limitlab::analysis::splitting::{LocalScheme, SharpVertex, sharp_rows};
/// // A regular boundary vertex: two quads.
/// let rows = sharp_rows(LocalScheme::CatmullClark, SharpVertex::Boundary, &[2])?;
/// let limit = &rows[0].masks[0].weights;
/// assert!((limit[0] - 2.0 / 3.0).abs() < 1e-14 && (limit[1] - 1.0 / 6.0).abs() < 1e-14);
/// assert!(rows[0].sectors[0].tangent_plane);
/// # Ok::<(), limitlab::Error>(())
/// ```
pub fn sharp_rows(scheme: LocalScheme, vertex: SharpVertex, valences: &[usize]) -> Result<Vec<SharpRow>> {
    parallel::try_map(valences, |&n| LocalStar::new(scheme, vertex, n)?.row())
}

/// A star with its local matrix, in the order v, e_0, …, f_0, ….
struct LocalStar {
    rule: StarRule,
    vertex: SharpVertex,
    /// Faces.
    valence: usize,
    /// Edges: one more than faces on a boundary.
    edges: usize,
    matrix: DMatrix<f64>,
}

impl LocalStar {
    /// The refinement of unit vectors, three at a time. Inside a mesh the star is closed far away by a vertex at NaN, as in
    /// [`SplittingMatrix`](super::SplittingMatrix).
    fn new(scheme: LocalScheme, vertex: SharpVertex, valence: usize) -> Result<Self> {
        let rule = vertex.rule(scheme)?;
        let range = vertex.valences();
        if !range.contains(&valence) {
            let (first, last) = (range.start(), range.end());
            return Err(Error::Unknown(format!(
                "valence {valence} is outside {first}..{last}, those of a {vertex} vertex"
            )));
        }
        let open = matches!(vertex, SharpVertex::Boundary | SharpVertex::Corner);
        let edges = valence + usize::from(open);
        let faces = if open { fan(rule, valence) } else { scheme.layout().closed(valence, 1) };
        let size = 1 + edges + if rule == StarRule::CatmullClark { valence } else { 0 };
        let count = size + usize::from(!open);
        let mut star = LocalStar { rule, vertex, valence, edges, matrix: DMatrix::zeros(size, size) };
        let mesh = Mesh::new(vec![DVec3::ZERO; count], faces);
        let tags = Tags {
            boundary: Boundary::EdgeOnly,
            creases: if open { Vec::new() } else { star.sharp().map(|j| ([0, 1 + j as u32], SHARP)).collect() },
            corners: if vertex == SharpVertex::Corner { vec![(0, SHARP)] } else { Vec::new() },
        };
        let mut surface =
            Surface::examined(mesh, None, Boundary::EdgeOnly).map_err(Error::Defects)?.into_tagged(&tags)?;
        let refined = Surface::of_valid(scheme.step(&surface)?);
        let places = star.places(&refined, scheme.root_after_step(0));
        for first in (0..size).step_by(3) {
            let columns = first..size.min(first + 3);
            let points = surface.positions_mut();
            points.fill(DVec3::ZERO);
            points[size..].fill(DVec3::NAN);
            columns.clone().enumerate().for_each(|(axis, column)| points[column][axis] = 1.0);
            let after = scheme.step(&surface)?.positions;
            for (row, &place) in places.iter().enumerate() {
                for (axis, column) in columns.clone().enumerate() {
                    star.matrix[(row, column)] = after[place as usize][axis];
                }
            }
        }
        Ok(star)
    }

    /// The sharp edges, by number.
    fn sharp(&self) -> impl Iterator<Item = usize> + use<> {
        let second = match self.vertex {
            SharpVertex::Boundary | SharpVertex::Corner => Some(self.valence),
            SharpVertex::Crease => Some(self.valence / 2),
            SharpVertex::Dart => None,
        };
        std::iter::once(0).chain(second)
    }

    /// The vertices at the positions in the refined star, whose edge 0 is half-edge `root`.
    fn places(&self, refined: &Surface, root: u32) -> Vec<u32> {
        let (faces, topology) = (refined.faces(), refined.topology());
        let mut star = Vec::new();
        topology.star(faces, 0, &mut star);
        let turn = star.iter().position(|&c| c == root).unwrap_or(0);
        star.rotate_left(turn);
        let range = |c: u32| faces.range(topology.incidence.face_of(c));
        let at = |c: u32| faces.corners()[c as usize];
        let mut places = vec![0];
        places.extend(star.iter().map(|&c| at(next_in(&range(c), c))));
        if self.edges > self.valence {
            places.extend(star.last().map(|&c| at(prev_in(&range(c), c))));
        }
        if self.rule == StarRule::CatmullClark {
            places.extend(star.iter().map(|&c| at(next_in(&range(c), next_in(&range(c), c)))));
        }
        places
    }

    /// The positions inside each sector; at a dart all of them, as there is no curve that is refined by itself.
    fn insides(&self) -> Vec<Vec<usize>> {
        let (edges, faces) = (self.edges, self.valence);
        let quads = self.rule == StarRule::CatmullClark;
        let inside = |from: usize, to: usize| -> Vec<usize> {
            let opposite = (from..to).filter(|_| quads).map(|j| 1 + edges + j);
            (from + 1..to).map(|j| 1 + j).chain(opposite).collect()
        };
        match self.vertex {
            SharpVertex::Boundary | SharpVertex::Corner => vec![inside(0, faces)],
            SharpVertex::Crease => vec![inside(0, faces / 2), inside(faces / 2, faces)],
            SharpVertex::Dart => Vec::new(),
        }
    }

    fn row(self) -> Result<SharpRow> {
        let size = self.matrix.nrows();
        let insides = self.insides();
        let curve: Vec<usize> = match self.vertex {
            SharpVertex::Dart => (0..size).collect(),
            _ => std::iter::once(0).chain(self.sharp().map(|j| 1 + j)).collect(),
        };
        let mut eigenvalues = eigenvalues_of(&self.part(&curve))?;
        let mut sectors = Vec::new();
        for inside in &insides {
            let modes = eigenvalues_of(&self.part(inside))?;
            eigenvalues.extend(&modes);
            let modes: Vec<f64> = modes.iter().map(|z| z.re).collect();
            // m − 1 edges, among quads m opposite corners beside.
            let faces = match self.rule {
                StarRule::CatmullClark => inside.len().div_ceil(2),
                StarRule::Loop => inside.len() + 1,
            };
            let tangent_plane = match self.vertex {
                SharpVertex::Corner => faces == 1,
                _ => modes.get(1).is_none_or(|&second| second < 0.5 - LEAD),
            };
            sectors.push(SharpSector { faces, modes, tangent_plane });
        }
        sort(&mut eigenvalues);
        let limit = self.limit_mask()?;
        let expected = self.limit_formula();
        let limit_mask_error = limit.weights.iter().zip(&expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let mut masks = vec![limit];
        match self.vertex {
            SharpVertex::Boundary | SharpVertex::Crease => {
                let mut along = vec![0.0; size];
                self.sharp().zip([-1.0, 1.0]).for_each(|(j, weight)| along[1 + j] = weight);
                let names: &[&str] = if insides.len() == 1 { &["across"] } else { &["across_left", "across_right"] };
                let across = names.iter().zip(&insides).zip(&sectors);
                let across = across.map(|((name, inside), sector)| {
                    let all: Vec<usize> = curve.iter().chain(inside).copied().collect();
                    let own: Vec<f64> = all.iter().map(|&i| along[i]).collect();
                    // The curve's own bend where there is no inside.
                    let eigenvalue = sector.modes.first().copied().unwrap_or(0.25);
                    let found = left_eigenvector(&self.part(&all), eigenvalue, Some(&own))?;
                    let mut weights = vec![0.0; size];
                    all.iter().zip(found.iter()).for_each(|(&i, &weight)| weights[i] = weight);
                    Ok(self.tangent(name, eigenvalue, weights))
                });
                let across = across.collect::<Result<Vec<_>>>()?;
                masks.push(self.mask("along", 0.5, along));
                masks.extend(across);
            }
            SharpVertex::Corner if self.valence == 1 => {
                for (name, edge) in [("along_first", 1), ("along_second", 2)] {
                    let mut weights = vec![0.0; size];
                    (weights[0], weights[edge]) = (-1.0, 1.0);
                    masks.push(self.mask(name, 0.5, weights));
                }
            }
            SharpVertex::Corner => {}
            SharpVertex::Dart => {
                let [first, second] = [1, 2].map(|k| eigenvalues[k]);
                let third = eigenvalues.get(3).map_or(0.0, |z| z.norm());
                let tangent_plane = first.im == 0.0 && second.im == 0.0 && second.re - third > LEAD;
                if first.im == 0.0 && second.im == 0.0 {
                    let one = left_eigenvector(&self.matrix, first.re, None)?;
                    let equal = first.re - second.re < LEAD;
                    let other = left_eigenvector(&self.matrix, second.re, equal.then_some(one.as_slice()))?;
                    masks.push(self.tangent("first", first.re, one.as_slice().to_vec()));
                    masks.push(self.tangent("second", second.re, other.as_slice().to_vec()));
                }
                sectors.push(SharpSector { faces: self.valence, modes: Vec::new(), tangent_plane });
            }
        }
        Ok(SharpRow {
            valence: self.valence,
            positions: self.positions(),
            eigenvalue_error: self.formula().map(|formula| largest_difference(&formula, &eigenvalues)),
            eigenvalues,
            masks,
            limit_mask_error,
            sectors,
        })
    }

    /// The rows and columns of some positions.
    fn part(&self, positions: &[usize]) -> DMatrix<f64> {
        DMatrix::from_fn(positions.len(), positions.len(), |i, j| self.matrix[(positions[i], positions[j])])
    }

    fn positions(&self) -> Vec<String> {
        let opposite = self.matrix.nrows() - 1 - self.edges;
        let names = (0..self.edges).map(|j| format!("e{j}")).chain((0..opposite).map(|j| format!("f{j}")));
        std::iter::once("v".to_owned()).chain(names).collect()
    }

    fn mask(&self, name: &'static str, eigenvalue: f64, weights: Vec<f64>) -> SharpMask {
        let w = DVector::from_vec(weights);
        let residual = (self.matrix.tr_mul(&w) - &w * eigenvalue).amax();
        SharpMask { name, eigenvalue, weights: w.as_slice().to_vec(), residual }
    }

    /// Scaled so that the largest weight is ±1, and that of v is negative, which is into the sector; where that is 0, so that the
    /// first of the largest is 1.
    fn tangent(&self, name: &'static str, eigenvalue: f64, weights: Vec<f64>) -> SharpMask {
        let largest = weights.iter().fold(0.0f64, |m, &w| if w.abs() > m.abs() + LEAD { w } else { m });
        let scale = if weights[0].abs() > LEAD { -largest.abs() * weights[0].signum() } else { largest };
        self.mask(name, eigenvalue, weights.iter().map(|w| w / scale).collect())
    }

    fn limit_mask(&self) -> Result<SharpMask> {
        let w = left_eigenvector(&self.matrix, 1.0, None)?;
        let sum = w.sum();
        Ok(self.mask("limit", 1.0, w.iter().map(|w| w / sum).collect()))
    }

    /// The limit mask in closed form; at a dart the row of A.
    fn limit_formula(&self) -> Vec<f64> {
        let size = self.matrix.nrows();
        let mut mask = vec![0.0; size];
        match self.vertex {
            SharpVertex::Corner => mask[0] = 1.0,
            SharpVertex::Boundary | SharpVertex::Crease => {
                mask[0] = 2.0 / 3.0;
                self.sharp().for_each(|j| mask[1 + j] = 1.0 / 6.0);
            }
            SharpVertex::Dart => {
                let face = if self.rule == StarRule::Loop { 3 } else { 4 };
                let row = Star::dart(self.valence, face).row(self.rule);
                mask = [vec![row.own], row.edges, row.faces].concat();
                mask.truncate(size);
            }
        }
        mask
    }

    /// All eigenvalues in closed form.
    fn formula(&self) -> Option<Vec<Complex<f64>>> {
        let mut all = match self.vertex {
            SharpVertex::Boundary | SharpVertex::Crease => vec![1.0, 0.5, 0.25],
            SharpVertex::Corner => vec![1.0, 0.5, 0.5],
            SharpVertex::Dart => return None,
        };
        let ends: Vec<usize> =
            self.sharp().chain((self.vertex == SharpVertex::Crease).then_some(self.valence)).collect();
        ends.windows(2).for_each(|ends| all.extend(sector_formula(self.rule, ends[1] - ends[0])));
        let mut all: Vec<Complex<f64>> = all.into_iter().map(Complex::from).collect();
        sort(&mut all);
        Some(all)
    }
}

/// The eigenvalues of the inside of a sector of m faces.
fn sector_formula(rule: StarRule, m: usize) -> Vec<f64> {
    let angles = (1..m).map(|j| std::f64::consts::PI * j as f64 / m as f64);
    match rule {
        StarRule::Loop => angles.map(|angle| 0.375 + 0.25 * angle.cos()).collect(),
        StarRule::CatmullClark => {
            let pair = |angle: f64| {
                let (middle, spread) = (5.0 + angle.cos(), (0.5 * angle).cos() * (2.0 * (9.0 + angle.cos())).sqrt());
                [(middle + spread) / 16.0, (middle - spread) / 16.0]
            };
            angles.flat_map(pair).chain([0.25]).collect()
        }
    }
}

/// A vertex on a boundary with its faces, in the order of positions.
fn fan(rule: StarRule, valence: usize) -> Faces {
    let mut faces = Faces::default();
    for j in 0..valence as u32 {
        let (here, next, opposite) = (1 + j, 2 + j, valence as u32 + 2 + j);
        match rule {
            StarRule::CatmullClark => faces.push(&[0, here, opposite, next]),
            StarRule::Loop => faces.push(&[0, here, next]),
        }
    }
    faces
}

/// By falling modulus.
fn eigenvalues_of(matrix: &DMatrix<f64>) -> Result<Vec<Complex<f64>>> {
    let dense = Mat::from_fn(matrix.nrows(), matrix.ncols(), |i, j| matrix[(i, j)]);
    let mut all = eigenvalues(&dense).map_err(|e| Error::Computation(format!("eigenvalues of a star: {e:?}")))?;
    sort(&mut all);
    Ok(all)
}

/// A unit left eigenvector of a known eigenvalue, orthogonal to `other` if there is one: the last right singular vector of
/// Sᵀ − λ with that below.
fn left_eigenvector(matrix: &DMatrix<f64>, eigenvalue: f64, other: Option<&[f64]>) -> Result<DVector<f64>> {
    let n = matrix.nrows();
    let rows = n + usize::from(other.is_some());
    let shifted = Mat::from_fn(rows, n, |i, j| match other {
        Some(other) if i == n => other[j],
        _ => matrix[(j, i)] - if i == j { eigenvalue } else { 0.0 },
    });
    let svd = svd(&shifted).map_err(|e| Error::Computation(format!("singular values of a star: {e:?}")))?;
    Ok(DVector::from_fn(n, |i, _| svd.V()[(i, n - 1)]))
}
