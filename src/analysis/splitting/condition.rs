//! Lin & Luo's eigenvalue condition (§6) for their blended √3 scheme, over α: λ_0 = 1 > λ_1 = λ_2 > λ_3, and for
//! n > 3 also λ_3 = λ_4, claimed there for all α in \[0, 2\].

use nalgebra::{Complex, DMatrix};

use super::matrix::SplittingMatrix;
use super::scheme::LocalScheme;
use super::spectrum::{LEAD, Mode, all_eigenvalues, eigenvalues};
use crate::error::Result;
use crate::parallel;

/// The leading eigenvalues of S̃ = R·S·S on three rings at one α.
#[derive(Clone, Debug, PartialEq)]
pub struct Condition {
    /// The valence n of the vertex.
    pub valence: usize,
    /// The blend parameter α; the claim is about 0 ≤ α ≤ 2.
    pub alpha: f64,
    /// λ_1 … λ_4, by falling modulus, with multiplicity; λ_0 = 1 is left out.
    pub lambda: [Complex<f64>; 4],
    /// The frequencies k ≤ n/2 of the blocks that λ_1 and, after the pair of frequency 1 is taken out, the next
    /// largest belong to.
    pub leading_frequency: usize,
    /// The frequency of the largest modulus beside λ_0 and the leading pair of frequency 1.
    pub next_frequency: usize,
    /// |leading eigenvalue of frequency 1| less the largest other modulus (but 1): positive where that pair leads.
    pub margin: f64,
    /// 1 > λ_1 = λ_2 > λ_3 in modulus, λ_1 and λ_2 real.
    pub holds: bool,
    /// λ_3 is at least double, as claimed for n > 3; a conjugate does not count.
    pub third_equals_fourth: bool,
}

/// An α at which [`Condition::holds`] changes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// The valence n of the vertex.
    pub valence: usize,
    /// The blend parameter α, between 0 and 2, to 1e-12.
    pub alpha: f64,
    /// Whether the condition holds just above.
    pub holds_above: bool,
    /// The frequency of the eigenvalue that meets λ_1 there; 1 where the two leading of frequency 1 meet and turn
    /// complex.
    pub frequency: usize,
}

/// The Fourier blocks of S̃ as polynomials of α. One step is affine in α, so a round of two is quadratic, and three
/// values of α determine it.
struct Blend {
    valence: usize,
    /// By frequency 0 ≤ k ≤ n/2: the blocks at α = 0, 1, 2.
    blocks: Vec<[DMatrix<Complex<f64>>; 3]>,
}

impl Blend {
    fn new(valence: usize) -> Result<Self> {
        let at = |alpha| SplittingMatrix::on_rings(LocalScheme::Sqrt3 { alpha }, valence, 3);
        let matrices = [at(0.0)?, at(1.0)?, at(2.0)?];
        let blocks = (0..=valence / 2).map(|k| matrices.each_ref().map(|m| m.block(k)));
        Ok(Blend { valence, blocks: blocks.collect() })
    }

    /// All eigenvalues at one α, by falling modulus.
    fn modes(&self, alpha: f64) -> Result<Vec<Mode>> {
        let weights = [(alpha - 1.0) * (alpha - 2.0) / 2.0, alpha * (2.0 - alpha), alpha * (alpha - 1.0) / 2.0];
        let mut modes = Vec::new();
        for (frequency, [a, b, c]) in self.blocks.iter().enumerate() {
            let [x, y, z] = weights.map(Complex::from);
            let block = a * x + b * y + c * z;
            let values = eigenvalues(&block)?;
            modes.extend(values.into_iter().map(|value| Mode { value, frequency }));
        }
        modes.sort_by(|a, b| b.value.norm().total_cmp(&a.value.norm()));
        Ok(modes)
    }

    fn condition(&self, alpha: f64) -> Result<Condition> {
        let mut modes = self.modes(alpha)?;
        // λ_0 = 1, of frequency 0, with the constant vector.
        let distance = |m: &Mode| (m.value - 1.0).norm();
        let one = (0..modes.len())
            .filter(|&i| modes[i].frequency == 0)
            .min_by(|&i, &j| distance(&modes[i]).total_cmp(&distance(&modes[j])));
        if let Some(one) = one {
            modes.remove(one);
        }
        let values = all_eigenvalues(&modes, self.valence);
        let lambda = [values[0], values[1], values[2], values[3]];
        let leading_frequency = modes[0].frequency;
        let pair = modes.iter().position(|m| m.frequency == 1).map(|i| modes.remove(i));
        let pair = pair.map_or(Complex::from(0.0), |m| m.value);
        let next = modes[0];
        let margin = pair.norm() - next.value.norm();
        Ok(Condition {
            valence: self.valence,
            alpha,
            lambda,
            leading_frequency,
            next_frequency: next.frequency,
            margin,
            holds: margin > LEAD && pair.norm() < 1.0 - LEAD && pair.im.abs() < LEAD,
            third_equals_fourth: values[3..].iter().any(|z| (z - lambda[2]).norm() < LEAD),
        })
    }
}

/// The condition at every valence and α, valence by valence. Three matrices a valence; then n/2 eigenvalue problems of
/// order 6 for each α. Valences are worked on in parallel.
///
/// # Errors
/// [`Error::Unknown`](crate::Error::Unknown) for a valence outside [`VALENCES`](super::VALENCES).
pub fn condition_over_alpha(valences: &[usize], alphas: &[f64]) -> Result<Vec<Condition>> {
    let all = parallel::try_map(valences, |&n| -> Result<Vec<_>> {
        let blend = Blend::new(n)?;
        alphas.iter().map(|&alpha| blend.condition(alpha)).collect()
    });
    Ok(all?.concat())
}

/// Where over \[0, 2\] the condition begins or ceases to hold at valence `n`: between neighbours of a grid of 401
/// values of α, then by bisection to 1e-12.
///
/// # Errors
/// As [`condition_over_alpha`].
pub fn crossings(valence: usize) -> Result<Vec<Crossing>> {
    const STEPS: usize = 400;
    let blend = Blend::new(valence)?;
    let grid = |k: usize| 2.0 * k as f64 / STEPS as f64;
    let mut found = Vec::new();
    let mut before = blend.condition(grid(0))?.holds;
    for k in 1..=STEPS {
        let holds = blend.condition(grid(k))?.holds;
        if holds != before {
            let (mut low, mut high) = (grid(k - 1), grid(k));
            while high - low > 1e-12 {
                let middle = (low + high) / 2.0;
                if blend.condition(middle)?.holds == before {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            found.push(Crossing {
                valence,
                alpha: high,
                holds_above: holds,
                frequency: blend.condition(high)?.next_frequency,
            });
        }
        before = holds;
    }
    Ok(found)
}
