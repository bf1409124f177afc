//! ε-pseudospectra of iteration matrices: where ‖(z − T)⁻¹‖ ≥ 1/ε in the complex plane (Trefethen and Embree 2005).
//!
//! An eigenvalue of some T + E with ‖E‖ ≤ ε is there, and what ρ(T) does not tell of ‖T^k‖: with ρ_ε the largest modulus in the
//! ε-pseudospectrum, sup_k ‖T^k‖ ≥ (ρ_ε − 1)/ε and ‖T^k‖ ≤ ρ_ε^{k+1}/ε for all ε. The norm is the energy norm where there
//! is one, else the Euclidean.
//!
//! σ_min(z − T) on a grid: T is brought to Hessenberg form once, H; z − H to a triangle R by rotations, and a Lanczos process
//! with (RᴴR)⁻¹ finds σ_min. O(N³), then O(N²) a point.

use limitlab_factorizations::dense::hessenberg;
use nalgebra::{Complex, DMatrix};

use super::iteration_matrix::IterationMatrix;
use super::tridiagonal::Tridiagonal;
use crate::error::{Error, Result};
use crate::parallel;

/// Largest N: a picture of some thousand points takes half a minute there.
pub const LARGEST: usize = 400;

/// A relative change of 1/σ² that is none; so many in a row end the process, and so many steps.
const TOLERANCE: f64 = 1e-7;
const LOOKS: usize = 2;
const STEPS: usize = 100;

/// σ_min(z − T) at the points z = `re[k]` + i `im[j]`, row by row: entry j·(length of `re`) + k.
///
/// # Errors
/// More than [`LARGEST`] unknowns.
///
/// ```
/// use limitlab::analysis::iteration_matrix::IterationMatrix;
/// use limitlab::analysis::pseudospectrum::least_singular_values;
/// use limitlab::assemble::LimitSystem;
/// use limitlab::mesh::{Surface, builtin};
/// use limitlab::schemes::Scheme;
/// use limitlab::solvers::Method;
///
/// let surface = Surface::new(builtin::builtin("torus:5x5")?)?;
/// let system = LimitSystem::new(&surface, Scheme::Nasri)?;
/// // Of a normal matrix it is the distance to the spectrum: PIA has eigenvalues from 0 to below ¾.
/// let pia = IterationMatrix::new(&system, Method::Pia)?;
/// let found = least_singular_values(&pia, &[-1.0, -0.25], &[0.0])?;
/// assert!((found[0] - 1.0).abs() < 1e-6 && (found[1] - 0.25).abs() < 1e-6);
/// # Ok::<(), limitlab::Error>(())
/// ```
pub fn least_singular_values(t: &IterationMatrix, re: &[f64], im: &[f64]) -> Result<Vec<f64>> {
    let n = t.len();
    if n > LARGEST {
        return Err(Error::Computation(format!(
            "pseudospectra of {n} vertices: they are computed up to {LARGEST}; use a coarser mesh"
        )));
    }
    if n == 0 {
        return Ok(vec![f64::INFINITY; re.len() * im.len()]);
    }
    let t = t.in_best_coordinates();
    let hessenberg = hessenberg(DMatrix::from_fn(n, n, |i, j| t[(i, j)]));
    let parts = parallel::map(re.len() * im.len(), 1, |range| -> Vec<f64> {
        range.map(|at| least(&hessenberg, Complex::new(re[at % re.len()], im[at / re.len()]))).collect()
    });
    Ok(parts.concat())
}

/// σ_min(z − H).
fn least(h: &DMatrix<f64>, z: Complex<f64>) -> f64 {
    let n = h.nrows();
    // By rows.
    let mut r: Vec<Complex<f64>> = (0..n * n)
        .map(|at| {
            let (i, j) = (at / n, at % n);
            Complex::from(-h[(i, j)]) + if i == j { z } else { Complex::from(0.0) }
        })
        .collect();
    for k in 0..n - 1 {
        let (upper, lower) = r[k * n..(k + 2) * n].split_at_mut(n);
        let length = upper[k].norm().hypot(lower[k].norm());
        if length == 0.0 {
            continue;
        }
        let (a, b) = (upper[k] / length, lower[k] / length);
        for (x, y) in upper[k..].iter_mut().zip(&mut lower[k..]) {
            (*x, *y) = (a.conj() * *x + b.conj() * *y, a * *y - b * *x);
        }
    }
    if (0..n).any(|i| r[i * n + i] == Complex::from(0.0)) {
        return 0.0;
    }
    let start: Vec<Complex<f64>> =
        (0..n).map(|i| Complex::new(1.0 + (0.618_033_988_75 * (i + 1) as f64).fract(), 0.5)).collect();
    let norm = length(&start);
    let mut v: Vec<Complex<f64>> = start.into_iter().map(|x| x / norm).collect();
    let mut before = vec![Complex::from(0.0); n];
    let (mut alphas, mut betas): (Vec<f64>, Vec<f64>) = (Vec::new(), Vec::new());
    let (mut last, mut still) = (0.0f64, 0);
    loop {
        let mut w = v.clone();
        solve(&r, &mut w);
        let alpha = v.iter().zip(&w).map(|(v, w)| (v.conj() * w).re).sum::<f64>();
        let beta = betas.last().copied().unwrap_or(0.0);
        for ((w, v), u) in w.iter_mut().zip(&v).zip(&before) {
            *w -= v * alpha + u * beta;
        }
        alphas.push(alpha);
        let value = Tridiagonal { alphas: &alphas, betas: &betas }.eigenvalue(alphas.len() - 1);
        if !value.is_finite() {
            return 0.0;
        }
        still = if value - last <= TOLERANCE * value { still + 1 } else { 0 };
        last = value;
        let next = length(&w);
        if still == LOOKS || alphas.len() == STEPS || next <= f64::EPSILON * value {
            return value.sqrt().recip();
        }
        betas.push(next);
        before = std::mem::replace(&mut v, w.into_iter().map(|w| w / next).collect());
    }
}

fn length(x: &[Complex<f64>]) -> f64 {
    x.iter().map(|x| x.norm_sqr()).sum::<f64>().sqrt()
}

/// `x` becomes (RᴴR)⁻¹x.
fn solve(r: &[Complex<f64>], x: &mut [Complex<f64>]) {
    let n = x.len();
    // Rᴴw = x, from the first row on.
    for i in 0..n {
        let row = &r[i * n..(i + 1) * n];
        let w = x[i] / row[i].conj();
        x[i] = w;
        for (x, r) in x[i + 1..].iter_mut().zip(&row[i + 1..]) {
            *x -= r.conj() * w;
        }
    }
    // R y = w, from the last row on.
    for i in (0..n).rev() {
        let row = &r[i * n..(i + 1) * n];
        let known: Complex<f64> = row[i + 1..].iter().zip(&x[i + 1..]).map(|(r, x)| r * x).sum();
        x[i] = (x[i] - known) / row[i];
    }
}
