//! Single eigenpairs of a symmetric tridiagonal matrix T: by bisection on Sturm counts and a twisted factorization,
//! O(k) a value, where a full decomposition would take O(k²) or more.

/// T with the diagonal `alphas` and the off-diagonal `betas`, one shorter.
#[derive(Clone, Copy, Debug)]
pub struct Tridiagonal<'a> {
    /// k ≥ 1 diagonal entries.
    pub alphas: &'a [f64],
    /// k − 1 off-diagonal entries.
    pub betas: &'a [f64],
}

/// The two ends of a unit eigenvector.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VectorEnds {
    /// Its square is the weight of the start vector where T comes from a Lanczos process.
    pub first: f64,
    /// Its modulus times the next β is the residual of the Ritz value there.
    pub last: f64,
}

impl Tridiagonal<'_> {
    /// An interval around all eigenvalues (Gershgorin).
    fn range(&self) -> (f64, f64) {
        let k = self.alphas.len();
        let beta = |i: usize| self.betas.get(i).map_or(0.0, |b| b.abs());
        (0..k).fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), i| {
            let radius = beta(i) + if i > 0 { beta(i - 1) } else { 0.0 };
            (lo.min(self.alphas[i] - radius), hi.max(self.alphas[i] + radius))
        })
    }

    /// How many eigenvalues are less than `x`: the negative pivots of T − x (Sylvester).
    pub fn count_below(&self, x: f64) -> usize {
        let mut count = 0;
        let mut d = 1.0;
        for (i, a) in self.alphas.iter().enumerate() {
            let b = if i > 0 { self.betas[i - 1] } else { 0.0 };
            d = a - x - b * b / d;
            if d == 0.0 {
                // An eigenvalue of a leading block: x moves by less than rounding.
                d = f64::MIN_POSITIVE.sqrt();
            }
            count += usize::from(d < 0.0);
        }
        count
    }

    /// The eigenvalue number `index`, from 0 upwards, to rounding.
    pub fn eigenvalue(&self, index: usize) -> f64 {
        let (mut lo, mut hi) = self.range();
        let scale = lo.abs().max(hi.abs());
        lo -= 4.0 * f64::EPSILON * scale;
        hi += 4.0 * f64::EPSILON * scale;
        loop {
            let middle = 0.5 * (lo + hi);
            if middle <= lo || middle >= hi || hi - lo <= f64::EPSILON * scale {
                return middle;
            }
            if self.count_below(middle) > index {
                hi = middle;
            } else {
                lo = middle;
            }
        }
    }

    /// The ends of the unit eigenvector of the computed eigenvalue `theta`, by a factorization of T − θ from both
    /// sides, joined where the residual is least (Parlett and Dhillon 1997).
    pub fn vector_ends(&self, theta: f64) -> VectorEnds {
        let k = self.alphas.len();
        let safe = |d: f64| {
            if d == 0.0 { f64::EPSILON * f64::EPSILON } else { d }
        };
        let mut down = vec![0.0; k];
        let mut up = vec![0.0; k];
        for i in 0..k {
            let before = if i > 0 { self.betas[i - 1].powi(2) / down[i - 1] } else { 0.0 };
            down[i] = safe(self.alphas[i] - theta - before);
        }
        for i in (0..k).rev() {
            let after = if i + 1 < k { self.betas[i].powi(2) / up[i + 1] } else { 0.0 };
            up[i] = safe(self.alphas[i] - theta - after);
        }
        let gamma = |i: usize| (down[i] + up[i] - (self.alphas[i] - theta)).abs();
        let twist = (0..k).fold(0, |best, i| if gamma(i) < gamma(best) { i } else { best });
        let (mut z, mut squares) = (1.0f64, 1.0f64);
        for i in (0..twist).rev() {
            z *= -self.betas[i] / down[i];
            squares += z * z;
        }
        let first = z;
        z = 1.0;
        for i in twist..k - 1 {
            z *= -self.betas[i] / up[i + 1];
            squares += z * z;
        }
        let norm = squares.sqrt();
        VectorEnds { first: first / norm, last: z / norm }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use chacha20::ChaCha8Rng;
    use nalgebra::{DMatrix, SymmetricEigen};
    use rand::{RngExt, SeedableRng};

    #[test]
    fn the_second_difference_in_closed_form() {
        let k = 57;
        let (alphas, betas) = (vec![2.0; k], vec![-1.0; k - 1]);
        let t = Tridiagonal { alphas: &alphas, betas: &betas };
        for j in [0, 1, 28, 56] {
            let angle = (j + 1) as f64 * std::f64::consts::PI / (k + 1) as f64;
            let value = t.eigenvalue(j);
            assert!((value - (2.0 - 2.0 * angle.cos())).abs() < 1e-14);
            let ends = t.vector_ends(value);
            let expected = (2.0 / (k + 1) as f64).sqrt() * angle.sin();
            assert!((ends.first.abs() - expected.abs()).abs() < 1e-12, "{ends:?}");
            assert!((ends.last.abs() - expected.abs()).abs() < 1e-12);
        }
    }

    #[test]
    fn random_matrices_against_a_full_decomposition() {
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        for k in 1..40 {
            let alphas: Vec<f64> = (0..k).map(|_| rng.random_range(-1.0..1.0)).collect();
            let betas: Vec<f64> = (1..k).map(|_| rng.random_range(-1.0..1.0)).collect();
            let t = Tridiagonal { alphas: &alphas, betas: &betas };
            let dense = DMatrix::from_fn(k, k, |i, j| match i.abs_diff(j) {
                0 => alphas[i],
                1 => betas[i.min(j)],
                _ => 0.0,
            });
            let eigen = SymmetricEigen::new(dense);
            let mut order: Vec<usize> = (0..k).collect();
            order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
            for (index, &at) in order.iter().enumerate() {
                let value = t.eigenvalue(index);
                assert!((value - eigen.eigenvalues[at]).abs() < 1e-13);
                let ends = t.vector_ends(value);
                let exact = eigen.eigenvectors.column(at);
                assert!((ends.first.abs() - exact[0].abs()).abs() < 1e-8, "{k} {index}");
                assert!((ends.last.abs() - exact[k - 1].abs()).abs() < 1e-8, "{k} {index}");
            }
        }
    }
}
