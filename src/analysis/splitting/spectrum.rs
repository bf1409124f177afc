//! Eigenvalues, invariant subspaces and masks of a splitting matrix, by Fourier blocks.

use std::f64::consts::TAU;

use faer::Mat;
use limitlab_factorizations::dense::{complex_eigenvalues, complex_svd, small_qr, svd};
use nalgebra::{Complex, DMatrix, DVector};

use super::matrix::SplittingMatrix;
use super::{falling, sort};
use crate::error::{Error, Result};

/// Eigenvalues of one block that are closer than this share an invariant subspace: a defective eigenvalue of
/// multiplicity a, whose computed values scatter by ε^{1/a}, stays together up to a = 4.
const CLUSTER: f64 = 1e-4;

/// Means of clusters closer than this, in different blocks, are one eigenvalue; means are good to rounding.
const EQUAL: f64 = 1e-9;

/// Moduli closer than this count as equal. Simple eigenvalues of the blocks are good to 1e-14; near a collision of two,
/// to the square root of that.
pub const LEAD: f64 = 1e-7;

/// An eigenvalue with the frequency k ≤ n/2 of its block. For 0 < k < n/2 its conjugate belongs to block n−k.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mode {
    /// The eigenvalue λ, in general complex.
    pub value: Complex<f64>,
    /// k: how often the phase of the eigenvector turns in going once around the star.
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
        [residual(matrix, &self.right), residual(&matrix.transpose(), &self.left)]
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
    /// Within a block, one eigenvector of a cluster is found and the block reduced to its orthogonal complement, as
    /// often as the cluster has members: a Schur form with the cluster first. Defective eigenvalues need no special
    /// case, and residuals stay at rounding.
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
                let [right, left] = self.invariant_subspaces(&block, frequency, &cluster)?;
                let size = cluster.len() as f64;
                let real = cluster.iter().map(|z| z.re).sum::<f64>() / size;
                let imaginary = cluster.iter().map(|z| z.im.abs()).sum::<f64>() / size;
                let columns = |basis: DMatrix<Complex<f64>>, side| {
                    let vectors = basis.column_iter();
                    vectors.flat_map(|v| self.real_columns(frequency, &v.into_owned(), side)).collect()
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
            let basis = |columns: Vec<DVector<f64>>| small_qr(DMatrix::from_columns(&columns)).q();
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
        let [_, basis] = self.invariant_subspaces(&block, 0, &[1.0.into()])?;
        let vector = basis.column(0).into_owned();
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

    /// Whether the [`leading_pair`](Self::leading_pair) is real and beats all other eigenvalues but λ_0 = 1 by more
    /// than [`LEAD`]: Reif's condition λ_0 > λ_1 = λ_2 > λ_3, without which characteristic map and tangent masks say
    /// nothing about the surface.
    ///
    /// # Errors
    /// As [`modes`](Self::modes).
    pub fn pair_leads(&self) -> Result<bool> {
        let modes = self.modes()?;
        let Some(at) = modes.iter().position(|m| m.frequency == 1) else {
            return Ok(false);
        };
        let pair = modes[at].value;
        // The first is λ_0; of the others none may come close, and the sort puts the largest first.
        let next = (1..modes.len()).find(|&i| i != at).map_or(0.0, |i| modes[i].value.norm());
        Ok(at > 0 && pair.im.abs() < EQUAL && pair.norm() - next > LEAD)
    }

    /// The tangent masks, cosine and sine: a basis of the left eigenspace of the [`leading_pair`](Self::leading_pair),
    /// scaled so that the first orbit has the weights cos(2πj/n) and sin(2πj/n). N weights each.
    ///
    /// # Errors
    /// As [`leading_pair`](Self::leading_pair).
    pub fn tangent_masks(&self) -> Result<[DVector<f64>; 2]> {
        let vector = self.frequency_one(Side::Left)?;
        let columns = self.real_columns(1, &vector, Side::Left);
        <[_; 2]>::try_from(columns).map_err(|_| Error::Computation("frequency 1 has two masks".into()))
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
        Ok(x.iter().zip(&y).map(|(&x, &y)| glam::DVec2::new(x, y)).collect())
    }

    /// The eigenvector of block 1 for the leading eigenvalue, 1 at the first orbit.
    fn frequency_one(&self, side: Side) -> Result<DVector<Complex<f64>>> {
        let lambda = self.leading_pair()?;
        let [right, left] = self.invariant_subspaces(&self.block(1), 1, &[lambda.into()])?;
        let basis = if side == Side::Right { right } else { left };
        let vector = basis.column(0);
        let first = vector[0];
        if first.norm() < EQUAL {
            return Err(Error::Computation(format!(
                "{} at valence {}: the leading eigenvector of frequency 1 vanishes on the first orbit",
                self.scheme, self.valence
            )));
        }
        Ok(vector.map(|z| z / first))
    }

    /// Orthonormal bases of the right and the left invariant subspace of a cluster of block `k`, real where the block
    /// is.
    fn invariant_subspaces(
        &self,
        block: &DMatrix<Complex<f64>>,
        k: usize,
        cluster: &[Complex<f64>],
    ) -> Result<[DMatrix<Complex<f64>>; 2]> {
        let right = invariant_subspace(block, cluster)?;
        let left = invariant_subspace(&block.adjoint(), cluster)?;
        if self.is_real(k) {
            return Ok([real_basis(&right)?, real_basis(&left)?]);
        }
        Ok([right, left])
    }

    /// Whether block k is real: e^{2πik/n} = ±1.
    fn is_real(&self, k: usize) -> bool {
        k == 0 || 2 * k == self.valence
    }

    /// The real and imaginary parts of x_(o,s) = v_o e^{2πiks/n}, of a real block the real part alone. A left
    /// vector of block 0 weighs the sum of an orbit, hence 1/n at each of its positions.
    fn real_columns(&self, k: usize, vector: &DVector<Complex<f64>>, side: Side) -> Vec<DVector<f64>> {
        let n = self.valence;
        let centre = self.scheme.layout().centre();
        let own = if k == 0 { centre } else { 0 };
        let share = if k == 0 && side == Side::Left { 1.0 / n as f64 } else { 1.0 };
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
    let values = complex_eigenvalues(&dense)
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

/// Groups of values within [`CLUSTER`] of another of the group; λ and λ̄ count as close.
fn clusters(values: Vec<Complex<f64>>) -> Vec<Vec<Complex<f64>>> {
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

/// An orthonormal basis of the right invariant subspace that belongs to the eigenvalues nearest to the mean of a
/// cluster (λ and λ̄ being one), as many as the cluster has.
///
/// Each step takes the last right singular vector of B − λ as eigenvector and goes on with B on the other ones. λ is
/// computed anew each time: the values of a defective eigenvalue move when one of them is taken away.
fn invariant_subspace(block: &DMatrix<Complex<f64>>, cluster: &[Complex<f64>]) -> Result<DMatrix<Complex<f64>>> {
    let failed = |e: &dyn std::fmt::Debug| Error::Computation(format!("singular values of a Fourier block: {e:?}"));
    let size = block.nrows();
    let mean = cluster.iter().map(folded).sum::<Complex<f64>>() / cluster.len() as f64;
    let distance = |z: &Complex<f64>| (folded(z) - mean).norm();
    let mut basis = DMatrix::zeros(size, cluster.len());
    let mut complement: DMatrix<Complex<f64>> = DMatrix::identity(size, size);
    for mut column in basis.column_iter_mut() {
        let reduced = complement.adjoint() * block * &complement;
        let values = eigenvalues(&reduced)?;
        let nearest = values.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
        let Some(&lambda) = nearest else { break };
        let order = reduced.nrows();
        let shifted = Mat::from_fn(order, order, |i, j| reduced[(i, j)] - if i == j { lambda } else { 0.0.into() });
        let svd = complex_svd(&shifted).map_err(|e| failed(&e))?;
        let vectors = DMatrix::from_fn(order, order, |i, j| svd.V()[(i, j)]);
        column.copy_from(&(&complement * vectors.column(order - 1)));
        complement *= vectors.columns(0, order - 1);
    }
    Ok(basis)
}

/// A real orthonormal basis of a subspace that contains the conjugates of its vectors.
fn real_basis(basis: &DMatrix<Complex<f64>>) -> Result<DMatrix<Complex<f64>>> {
    let dimension = basis.ncols();
    let parts = Mat::from_fn(basis.nrows(), 2 * dimension, |i, j| {
        if j < dimension { basis[(i, j)].re } else { basis[(i, j - dimension)].im }
    });
    let svd = svd(&parts).map_err(|e| Error::Computation(format!("singular values of a basis: {e:?}")))?;
    Ok(DMatrix::from_fn(basis.nrows(), dimension, |i, j| svd.U()[(i, j)].into()))
}

/// λ and λ̄ as one.
fn folded(z: &Complex<f64>) -> Complex<f64> {
    Complex::new(z.re, z.im.abs())
}

/// ‖v − QQᵀv‖/‖v‖: how far a vector is from the subspace spanned by the orthonormal columns of Q.
pub fn distance_to_space(vector: &DVector<f64>, basis: &DMatrix<f64>) -> f64 {
    (vector - basis * (basis.transpose() * vector)).norm() / vector.norm()
}
