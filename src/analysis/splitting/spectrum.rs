//! Eigenvalues, invariant subspaces and masks of a splitting matrix, by Fourier blocks.

use std::f64::consts::TAU;

use faer::Mat;
use nalgebra::{Complex, DMatrix, DVector};

use super::matrix::SplittingMatrix;
use crate::error::{Error, Result};

/// Eigenvalues of one block that are closer than this share an invariant subspace: a defective eigenvalue of
/// multiplicity a, whose computed values scatter by ε^{1/a}, stays together up to a = 4.
const CLUSTER: f64 = 1e-4;

/// Means of clusters closer than this, in different blocks, are one eigenvalue; means are good to rounding.
const EQUAL: f64 = 1e-9;

/// An eigenvalue with the frequency k ≤ n/2 of its block. For 0 < k < n/2 its conjugate belongs to block n−k.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mode {
    pub value: Complex<f64>,
    pub frequency: usize,
}

/// A cluster of equal eigenvalues with its left and right invariant subspaces. Single eigenvectors of a multiple
/// eigenvalue are arbitrary; these subspaces are not.
#[derive(Clone, Debug)]
pub struct Eigenspace {
    /// λ with Im λ ≥ 0; one that is not real stands for λ and λ̄ together.
    pub value: Complex<f64>,
    /// Frequencies k ≤ n/2 of the blocks that have it.
    pub frequencies: Vec<usize>,
    /// N×m, orthonormal columns X with S·X = X·(XᵀSX); m is the algebraic multiplicity of λ (with λ̄).
    pub right: DMatrix<f64>,
    /// N×m, orthonormal columns Y with SᵀY = Y·(YᵀSᵀY): the masks that belong to λ.
    pub left: DMatrix<f64>,
}

impl Eigenspace {
    /// m, counting λ and λ̄.
    pub fn multiplicity(&self) -> usize {
        self.right.ncols()
    }

    /// ‖S·X − X·(XᵀSX)‖ and ‖SᵀY − Y·(YᵀSᵀY)‖, the largest entries.
    pub fn residuals(&self, matrix: &DMatrix<f64>) -> [f64; 2] {
        let residual = |s: &DMatrix<f64>, x: &DMatrix<f64>| {
            let image = s * x;
            (&image - x * (x.transpose() * &image)).amax()
        };
        [
            residual(matrix, &self.right),
            residual(&matrix.transpose(), &self.left),
        ]
    }
}

/// Which eigenvector of a block.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Side {
    Right,
    Left,
}

impl SplittingMatrix {
    /// The eigenvalues of the blocks 0 ≤ k ≤ n/2, each with its frequency, by falling modulus. O(n·m³) for m orbits.
    ///
    /// # Errors
    /// If the eigenvalues of a block do not converge.
    pub fn modes(&self) -> Result<Vec<Mode>> {
        let mut modes = Vec::new();
        for frequency in 0..=self.valence / 2 {
            let values = eigenvalues(&self.block(frequency))?;
            modes.extend(values.into_iter().map(|value| Mode { value, frequency }));
        }
        modes.sort_by(|a, b| falling(&a.value, &b.value));
        Ok(modes)
    }

    /// All N eigenvalues with their multiplicities, by falling modulus.
    ///
    /// # Errors
    /// As [`modes`](Self::modes).
    pub fn eigenvalues(&self) -> Result<Vec<Complex<f64>>> {
        Ok(all_eigenvalues(&self.modes()?, self.valence))
    }

    /// The invariant subspaces of all eigenvalues, by falling modulus. Their dimensions add up to N.
    ///
    /// Within a block, the values λ_i of a cluster have as invariant subspace the kernel of Π(B − λ_i), which is
    /// found by a singular value decomposition; defective eigenvalues need no special case.
    ///
    /// # Errors
    /// As [`modes`](Self::modes).
    pub fn eigenspaces(&self) -> Result<Vec<Eigenspace>> {
        struct Part {
            value: Complex<f64>,
            frequency: usize,
            right: Vec<DVector<f64>>,
            left: Vec<DVector<f64>>,
        }
        let mut parts: Vec<Part> = Vec::new();
        for frequency in 0..=self.valence / 2 {
            let block = self.block(frequency);
            for cluster in clusters(eigenvalues(&block)?) {
                let identity = DMatrix::identity(block.nrows(), block.nrows());
                let product = cluster.iter().fold(identity.clone(), |product, &value| {
                    product * (&block - &identity * value)
                });
                let [right, left] = kernels(product, cluster.len(), self.is_real(frequency));
                let size = cluster.len() as f64;
                let real = cluster.iter().map(|z| z.re).sum::<f64>() / size;
                let imaginary = cluster.iter().map(|z| z.im.abs()).sum::<f64>() / size;
                let columns = |vectors: Vec<DVector<Complex<f64>>>, side| {
                    vectors
                        .iter()
                        .flat_map(|v| self.real_columns(frequency, v, side))
                        .collect()
                };
                parts.push(Part {
                    value: Complex::new(real, imaginary),
                    frequency,
                    right: columns(right, Side::Right),
                    left: columns(left, Side::Left),
                });
            }
        }
        parts.sort_by(|a, b| falling(&a.value, &b.value));
        // Rounding may shuffle values of the same modulus, so equal ones need not be neighbours.
        let mut groups: Vec<Vec<Part>> = Vec::new();
        for part in parts {
            let equal = |g: &&mut Vec<Part>| (g[0].value - part.value).norm() < EQUAL;
            match groups.iter_mut().find(equal) {
                Some(group) => group.push(part),
                None => groups.push(vec![part]),
            }
        }
        let space = |parts: Vec<Part>| {
            let basis = |columns: Vec<DVector<f64>>| DMatrix::from_columns(&columns).qr().q();
            Eigenspace {
                value: parts[0].value,
                frequencies: parts.iter().map(|p| p.frequency).collect(),
                right: basis(parts.iter().flat_map(|p| p.right.clone()).collect()),
                left: basis(parts.iter().flat_map(|p| p.left.clone()).collect()),
            }
        };
        Ok(groups.into_iter().map(space).collect())
    }

    /// The limit mask: the left eigenvector of λ_0 = 1 with sum 1. N weights.
    ///
    /// # Errors
    /// As [`modes`](Self::modes).
    pub fn limit_mask(&self) -> Result<DVector<f64>> {
        let block = self.block(0);
        let vector = eigenvector(&block, 1.0.into(), true, Side::Left);
        // Real, and so its first column is the vector itself.
        let mask = self.real_columns(0, &vector, Side::Left).swap_remove(0);
        let sum = mask.sum();
        Ok(mask / sum)
    }

    /// The leading eigenvalue of block 1: for a scheme with a tangent plane the subdominant pair λ_1 = λ_2, one
    /// from block 1 and one from block n−1.
    ///
    /// # Errors
    /// [`Error::Computation`] if it is not real, so that there are neither tangent masks nor a characteristic map.
    pub fn leading_pair(&self) -> Result<f64> {
        let leading = eigenvalues(&self.block(1))?[0];
        if leading.im.abs() > EQUAL {
            return Err(Error::Computation(format!(
                "{} at valence {}: the leading eigenvalues of frequency 1 are the complex pair {:.6} ± {:.6}i; \
                 there is no characteristic map",
                self.scheme,
                self.valence,
                leading.re,
                leading.im.abs()
            )));
        }
        Ok(leading.re)
    }

    /// The tangent masks, cosine and sine: a basis of the left eigenspace of the [`leading_pair`](Self::leading_pair),
    /// scaled so that the first orbit has the weights cos(2πj/n) and sin(2πj/n). N weights each.
    ///
    /// # Errors
    /// As [`leading_pair`](Self::leading_pair).
    pub fn tangent_masks(&self) -> Result<[DVector<f64>; 2]> {
        let vector = self.frequency_one(Side::Left)?;
        let columns = self.real_columns(1, &vector, Side::Left);
        <[_; 2]>::try_from(columns)
            .map_err(|_| Error::Computation("frequency 1 has two masks".into()))
    }

    /// The right eigenvectors of the [`leading_pair`](Self::leading_pair) as points of the plane: the control net of
    /// the characteristic map, with position (0, 1, 0), about a face (0, 0, 0), at (1, 0). N points.
    ///
    /// # Errors
    /// As [`leading_pair`](Self::leading_pair).
    pub fn characteristic_net(&self) -> Result<Vec<glam::DVec2>> {
        let vector = self.frequency_one(Side::Right)?;
        let [x, y] = <[_; 2]>::try_from(self.real_columns(1, &vector, Side::Right))
            .map_err(|_| Error::Computation("frequency 1 has two eigenvectors".into()))?;
        Ok(x.iter()
            .zip(&y)
            .map(|(&x, &y)| glam::DVec2::new(x, y))
            .collect())
    }

    /// The eigenvector of block 1 for the leading eigenvalue, 1 at the first orbit.
    fn frequency_one(&self, side: Side) -> Result<DVector<Complex<f64>>> {
        let lambda = self.leading_pair()?;
        let vector = eigenvector(&self.block(1), lambda.into(), false, side);
        let first = vector[0];
        if first.norm() < EQUAL {
            return Err(Error::Computation(format!(
                "{} at valence {}: the leading eigenvector of frequency 1 vanishes on the first orbit",
                self.scheme, self.valence
            )));
        }
        Ok(vector.map(|z| z / first))
    }

    /// Whether block k is real: e^{2πik/n} = ±1.
    fn is_real(&self, k: usize) -> bool {
        k == 0 || 2 * k == self.valence
    }

    /// The real and imaginary parts of x_(o,s) = v_o e^{2πiks/n}, of a real block the real part alone. A left
    /// vector of block 0 weighs the sum of an orbit, hence 1/n at each of its positions.
    fn real_columns(
        &self,
        k: usize,
        vector: &DVector<Complex<f64>>,
        side: Side,
    ) -> Vec<DVector<f64>> {
        let n = self.valence;
        let centre = self.scheme.layout().centre();
        let own = if k == 0 { centre } else { 0 };
        let share = if k == 0 && side == Side::Left {
            1.0 / n as f64
        } else {
            1.0
        };
        let value = |i: usize| {
            if i < centre {
                return if k == 0 { vector[0] } else { 0.0.into() };
            }
            let (orbit, sector) = ((i - centre) / n, (i - centre) % n);
            let turn = Complex::cis(TAU * ((k * sector) % n) as f64 / n as f64);
            vector[own + orbit] * turn * share
        };
        let mut columns = vec![DVector::from_fn(self.size(), |i, _| value(i).re)];
        if !self.is_real(k) {
            columns.push(DVector::from_fn(self.size(), |i, _| value(i).im));
        }
        columns
    }
}

/// The eigenvalues of a block, by falling modulus.
///
/// # Errors
/// If they do not converge.
pub(super) fn eigenvalues(block: &DMatrix<Complex<f64>>) -> Result<Vec<Complex<f64>>> {
    let size = block.nrows();
    let dense = Mat::from_fn(size, size, |i, j| {
        let z = block[(i, j)];
        faer::c64::new(z.re, z.im)
    });
    let values = dense
        .eigenvalues()
        .map_err(|e| Error::Computation(format!("eigenvalues of a Fourier block: {e:?}")))?;
    let mut values: Vec<_> = values.iter().map(|z| Complex::new(z.re, z.im)).collect();
    sort(&mut values);
    Ok(values)
}

/// The eigenvalues of all blocks 0 ≤ k < n from those of 0 ≤ k ≤ n/2.
pub(super) fn all_eigenvalues(modes: &[Mode], n: usize) -> Vec<Complex<f64>> {
    let mut all = Vec::new();
    for mode in modes {
        all.push(mode.value);
        if mode.frequency > 0 && 2 * mode.frequency < n {
            all.push(mode.value.conj());
        }
    }
    all
}

/// By falling modulus, then real part, then imaginary part.
pub(super) fn sort(values: &mut [Complex<f64>]) {
    values.sort_by(falling);
}

fn falling(a: &Complex<f64>, b: &Complex<f64>) -> std::cmp::Ordering {
    let modulus = b.norm().total_cmp(&a.norm());
    modulus
        .then(b.re.total_cmp(&a.re))
        .then(b.im.total_cmp(&a.im))
}

/// Groups of values within [`CLUSTER`] of another of the group; λ and λ̄ count as close.
fn clusters(values: Vec<Complex<f64>>) -> Vec<Vec<Complex<f64>>> {
    let folded = |z: &Complex<f64>| Complex::new(z.re, z.im.abs());
    let mut groups: Vec<Vec<Complex<f64>>> = Vec::new();
    for value in values {
        let near = |group: &Vec<Complex<f64>>| {
            let close = |z: &Complex<f64>| (folded(z) - folded(&value)).norm() < CLUSTER;
            group.iter().any(close)
        };
        match groups.iter_mut().find(|g| near(g)) {
            Some(group) => group.push(value),
            None => groups.push(vec![value]),
        }
    }
    groups
}

/// Orthonormal bases of the right and the left kernel of a matrix whose kernel has this dimension; real where the
/// matrix is.
fn kernels(
    matrix: DMatrix<Complex<f64>>,
    dimension: usize,
    real: bool,
) -> [Vec<DVector<Complex<f64>>>; 2] {
    if real {
        let svd = matrix.map(|z| z.re).svd(true, true);
        let last = smallest(&svd.singular_values, dimension);
        let (u, v) = (svd.u.unwrap_or_default(), svd.v_t.unwrap_or_default());
        return [
            last.iter()
                .map(|&i| v.row(i).transpose().map(Complex::from))
                .collect(),
            last.iter()
                .map(|&i| u.column(i).map(Complex::from))
                .collect(),
        ];
    }
    let svd = matrix.svd(true, true);
    let last = smallest(&svd.singular_values, dimension);
    let (u, v) = (svd.u.unwrap_or_default(), svd.v_t.unwrap_or_default());
    [
        last.iter().map(|&i| v.row(i).adjoint()).collect(),
        last.iter().map(|&i| u.column(i).into_owned()).collect(),
    ]
}

fn smallest(values: &DVector<f64>, count: usize) -> Vec<usize> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
    order.truncate(count);
    order
}

fn eigenvector(
    block: &DMatrix<Complex<f64>>,
    value: Complex<f64>,
    real: bool,
    side: Side,
) -> DVector<Complex<f64>> {
    let shifted = block - DMatrix::identity(block.nrows(), block.nrows()) * value;
    let [right, left] = kernels(shifted, 1, real);
    let mut vectors = if side == Side::Right { right } else { left };
    vectors.swap_remove(0)
}

/// ‖v − QQᵀv‖/‖v‖: how far a vector is from the subspace spanned by the orthonormal columns of Q.
pub fn distance_to_space(vector: &DVector<f64>, basis: &DMatrix<f64>) -> f64 {
    (vector - basis * (basis.transpose() * vector)).norm() / vector.norm()
}
