//! Eigenvalues of iteration matrices on regular tori in closed form: the symbols of the schemes, and block Fourier analysis of
//! sweeps by colours.
//!
//! On an n × m torus a row of A is a stencil, Σ_d a_d x_{i+d}, and e^{iθ·i} is an eigenvector of A with the symbol
//! Â(θ) = Σ_d a_d e^{iθ·d}, θ = 2π(k/n, l/m). So it is of PIA, 1 − ωÂ, and of Jacobi, 1 − ωÂ/a_0. A sweep by colours that repeat
//! every p × q vertices couples pq frequencies: on the vectors u_r e^{iθ·c}, c the cell of p × q vertices and r the place in it,
//! θ = 2π(kp/n, lq/m), A acts as a pq × pq matrix Â(θ), whose entry rs is the part of the stencil at r that meets s, and the sweep as
//! T̂ = I − ω(D + ωL̂)⁻¹Â with L̂ the entries of colours relaxed before; the n m/(pq) blocks have all eigenvalues.
//!
//! Row by row there is no such class, but away from where the torus is cut every row has the same part of its stencil
//! before it, P = {d : d < 0}: there a sweep acts as the [symbol of a front](front) T̂(θ) = 1 − ωÂ/(a_0 + ωL̂), L̂ = Σ_{d ∈ P} a_d e^{iθ·d},
//! and so it does in any order that advances as a front over a region that grows with the torus. For each k the limit of ‖T^k‖ is
//! no less than max |T̂|^k, whatever ρ(T) is: the sum of the a_d before is (1 − a_0)/2 < a_0 under all schemes, so that what a
//! sweep carries along decays geometrically, and a wave in the midst of the region does not feel its edge.

use std::f64::consts::TAU;

use faer::Mat;
use limitlab_factorizations::dense;
use nalgebra::Complex;

use super::dense::unsymmetric_values;
use super::iteration_matrix::sort;
use crate::error::{Error, Result};
use crate::schemes::Scheme;
use crate::solvers::Method;
use crate::solvers::jacobi::THALL_OMEGA;

/// The stencil of a scheme on a regular torus: offsets d = (di, dj), the centre first, and a_d; quads for schemes of polygons,
/// triangles with the diagonal (1, 1), as [`tri_torus`](crate::mesh::builtin::tri_torus) has them, for schemes of triangles.
///
/// Catmull-Clark is (1, 4, 1)/6 in both directions, Nasri (1, 6, 1)/8; under Zheng-Cai it is the mean of V and Nasri's first
/// step with ½, ⅛ and so on, under Loop and √3 ½ and six times 1/12, under mid-edge ½ and four times ⅛.
pub fn stencil(scheme: Scheme) -> Vec<([i32; 2], f64)> {
    let product = |side: f64, middle: f64| {
        let part = move |d: i32| if d == 0 { middle } else { side };
        move |[i, j]: [i32; 2]| part(i) * part(j)
    };
    let ring = |edge: f64, corner: f64, centre: f64| {
        move |[i, j]: [i32; 2]| match i.abs() + j.abs() {
            0 => centre,
            1 => edge,
            _ => corner,
        }
    };
    let square = (0..9).map(|k| [(k + 4) % 9 / 3 - 1, (k + 4) % 9 % 3 - 1]);
    let filled = |value: &dyn Fn([i32; 2]) -> f64| square.clone().map(|d| (d, value(d))).collect::<Vec<_>>();
    let all = match scheme {
        Scheme::CatmullClark => filled(&product(1.0 / 6.0, 2.0 / 3.0)),
        Scheme::Nasri => filled(&product(1.0 / 8.0, 3.0 / 4.0)),
        Scheme::ZhengCai => filled(&ring(1.0 / 16.0, 1.0 / 32.0, 5.0 / 8.0)),
        Scheme::MidEdge => filled(&ring(1.0 / 8.0, 0.0, 0.5)),
        Scheme::Loop | Scheme::Sqrt3 => filled(&|[i, j]: [i32; 2]| match (i, j) {
            (0, 0) => 0.5,
            (1, -1) | (-1, 1) => 0.0,
            _ => 1.0 / 12.0,
        }),
    };
    all.into_iter().filter(|(_, a)| *a != 0.0).collect()
}

/// A colouring of a torus that repeats every `period` vertices.
#[derive(Clone, Debug, PartialEq)]
pub struct Colouring {
    period: [usize; 2],
    /// Of the vertex (i, j) that at `(i mod p)·q + j mod q`.
    colours: Vec<u32>,
}

impl Colouring {
    /// # Panics
    /// If there is not one colour a vertex of the period.
    pub fn new(period: [usize; 2], colours: Vec<u32>) -> Self {
        assert_eq!(colours.len(), period[0] * period[1], "one colour a vertex of the period");
        Colouring { period, colours }
    }

    /// The fewest colours under a scheme: two under mid-edge, red and black; three on triangles, i + j mod 3; else four,
    /// as the [greedy colouring](crate::mesh::order::Order::Multicolour) of a torus with even sides has them.
    pub fn usual(scheme: Scheme) -> Self {
        match scheme {
            Scheme::MidEdge => Colouring::new([2, 2], vec![0, 1, 1, 0]),
            Scheme::Loop | Scheme::Sqrt3 => Colouring::new([3, 3], vec![0, 1, 2, 1, 2, 0, 2, 0, 1]),
            Scheme::CatmullClark | Scheme::Nasri | Scheme::ZhengCai => Colouring::new([2, 2], vec![0, 1, 2, 3]),
        }
    }

    /// The vertices i·m + j of an n × m torus, colour by colour.
    pub fn order(&self, [n, m]: [usize; 2]) -> Vec<u32> {
        let mut order: Vec<u32> = (0..(n * m) as u32).collect();
        order.sort_by_key(|&v| self.colours[self.class([v as usize / m, v as usize % m])]);
        order
    }

    fn class(&self, [i, j]: [usize; 2]) -> usize {
        let [p, q] = self.period;
        i % p * q + j % q
    }
}

/// All n·m eigenvalues of T of a stationary method on the n × m torus under `scheme`, sweeps colour by colour, sorted as those
/// of an [iteration matrix](super::iteration_matrix::IterationMatrix). O(n m p²q²).
///
/// # Errors
/// A method that is not stationary or whose ω is open; sides below 4, or that the colouring's period does not divide; two
/// neighbours of one colour.
///
/// ```
/// use limitlab::analysis::torus_symbol::{Colouring, eigenvalues};
/// use limitlab::schemes::Scheme;
/// use limitlab::solvers::Method;
///
/// let scheme = Scheme::CatmullClark;
/// let gauss_seidel = Method::GaussSeidel { order: None };
/// let all = eigenvalues(scheme, [24, 24], gauss_seidel, &Colouring::usual(scheme))?;
/// assert_eq!(all.len(), 576);
/// assert!((all[0].norm() - 0.5206).abs() < 1e-4);
/// # Ok::<(), limitlab::Error>(())
/// ```
pub fn eigenvalues(
    scheme: Scheme,
    sides: [usize; 2],
    method: Method,
    colouring: &Colouring,
) -> Result<Vec<Complex<f64>>> {
    let refused = |why: String| Error::Computation(format!("{method} on a torus: {why}"));
    let [n, m] = sides;
    let [p, q] = colouring.period;
    if n < 4 || m < 4 {
        return Err(refused(format!("{n} × {m} is too small: sides of at least 4")));
    }
    let stencil = stencil(scheme);
    let angles = |[n, m]: [usize; 2]| (0..n).flat_map(move |k| (0..m).map(move |l| (k, l)));
    let angle = |k: usize, n: usize| TAU * k as f64 / n as f64;
    let scalar =
        |omega: f64| angles(sides).map(|(k, l)| 1.0 - omega * symbol(&stencil, [angle(k, n), angle(l, m)])).collect();
    let open = || refused("its ω is open".into());
    let sweep = |omega: f64, back: bool| -> Result<Vec<Complex<f64>>> {
        if !n.is_multiple_of(p) || !m.is_multiple_of(q) {
            return Err(refused(format!("the colours repeat every {p} × {q} vertices, which do not divide {n} × {m}")));
        }
        let mut all = Vec::with_capacity(n * m);
        for (k, l) in angles([n / p, m / q]) {
            // −θ has the conjugate block: one of the two, or a θ that is its own opposite and has a real block.
            let opposite = ((n / p - k) % (n / p), (m / q - l) % (m / q));
            if (k, l) > opposite {
                continue;
            }
            let theta = [angle(k, n / p), angle(l, m / q)];
            let block = Block::new(&stencil, colouring, theta, (k, l) == opposite).map_err(|e| refused(e.into()))?;
            all.extend(unsymmetric_values(&block.sweep(omega, back))?);
        }
        Ok(all)
    };
    let mut all = match method {
        Method::Pia => scalar(1.0),
        Method::WPia { omega } => scalar(omega.ok_or_else(open)?),
        Method::Thall => scalar(THALL_OMEGA / stencil[0].1),
        Method::Jacobi { omega } => scalar(omega.ok_or_else(open)? / stencil[0].1),
        Method::GaussSeidel { .. } => sweep(1.0, false)?,
        Method::Sor { omega, .. } => sweep(omega, false)?,
        Method::Ssor { omega, .. } => sweep(omega, true)?,
        Method::Lu
        | Method::Cholesky
        | Method::SecondCholesky
        | Method::Ldlt
        | Method::Chebyshev { .. }
        | Method::Cg
        | Method::PlainCg
        | Method::PcgJacobi
        | Method::PcgSsor { .. }
        | Method::PcgIc0
        | Method::Anderson { .. }
        | Method::HeavyBall { .. } => return Err(refused("it has no iteration matrix".into())),
    };
    sort(&mut all);
    Ok(all)
}

/// Σ_d a_d e^{iθ·d}, real for a symmetric stencil.
fn symbol(stencil: &[([i32; 2], f64)], theta: [f64; 2]) -> Complex<f64> {
    stencil.iter().map(|&(d, a)| wave(d, theta) * a).sum()
}

fn wave(d: [i32; 2], theta: [f64; 2]) -> Complex<f64> {
    Complex::from_polar(1.0, f64::from(d[0]) * theta[0] + f64::from(d[1]) * theta[1])
}

/// The symbol T̂(θ) of SOR where rows advance as a front: each is relaxed after those at d < 0, lexicographically.
///
/// ```
/// use limitlab::analysis::torus_symbol::front;
/// use limitlab::schemes::Scheme;
/// use std::f64::consts::PI;
///
/// // At the highest frequency L̂ = (1/9 − 4/9)/2, and |T̂| = |L̂|/(4/9 + L̂).
/// assert!((front(Scheme::CatmullClark, 1.0, [PI, PI]).norm() - 0.6).abs() < 1e-15);
/// ```
pub fn front(scheme: Scheme, omega: f64, theta: [f64; 2]) -> Complex<f64> {
    let stencil = stencil(scheme);
    let before: Complex<f64> = stencil.iter().filter(|(d, _)| *d < [0, 0]).map(|&(d, a)| wave(d, theta) * a).sum();
    1.0 - symbol(&stencil, theta) * omega / (before * omega + stencil[0].1)
}

/// max |T̂| of a [front] over the frequencies of an n × m torus.
pub fn front_radius(scheme: Scheme, omega: f64, [n, m]: [usize; 2]) -> f64 {
    let angle = |k: usize, n: usize| TAU * k as f64 / n as f64;
    let all = (0..n).flat_map(|k| (0..m).map(move |l| [angle(k, n), angle(l, m)]));
    all.map(|theta| front(scheme, omega, theta).norm()).fold(0.0, f64::max)
}

/// Â(θ) and the colours, as real matrices: of order pq where it is real, else (Re −Im; Im Re) of twice that, whose
/// eigenvalues are those of θ and of −θ.
struct Block {
    a: Mat<f64>,
    colours: Vec<u32>,
}

impl Block {
    fn new(
        stencil: &[([i32; 2], f64)],
        colouring: &Colouring,
        theta: [f64; 2],
        real: bool,
    ) -> std::result::Result<Self, &'static str> {
        let [p, q] = colouring.period;
        let classes = p * q;
        let order = if real { classes } else { 2 * classes };
        let mut a = Mat::<f64>::zeros(order, order);
        for r in 0..classes {
            for &(d, value) in stencil {
                let at = [(r / q) as i32 + d[0], (r % q) as i32 + d[1]];
                let (p, q) = (p as i32, q as i32);
                let s = colouring.class([at[0].rem_euclid(p) as usize, at[1].rem_euclid(q) as usize]);
                if d != [0, 0] && colouring.colours[r] == colouring.colours[s] {
                    return Err("two neighbours have one colour");
                }
                // The cells of neighbours differ by a factor each; u_r takes what is within one.
                let entry = wave([at[0].div_euclid(p), at[1].div_euclid(q)], theta) * value;
                a[(r, s)] += entry.re;
                if !real {
                    a[(r, s + classes)] -= entry.im;
                    a[(r + classes, s)] += entry.im;
                    a[(r + classes, s + classes)] += entry.re;
                }
            }
        }
        let colours = colouring.colours.iter().cycle().take(order).copied().collect();
        Ok(Block { a, colours })
    }

    /// I − ω(D + ωL)⁻¹A, or that after which comes the sweep in the reverse order.
    fn sweep(&self, omega: f64, and_back: bool) -> Mat<f64> {
        let n = self.a.nrows();
        let once = |back: bool| {
            let before = |i: usize, j: usize| {
                if back { self.colours[j] > self.colours[i] } else { self.colours[j] < self.colours[i] }
            };
            let splitting = Mat::from_fn(n, n, |i, j| match () {
                () if i == j => self.a[(i, i)] / omega,
                () if before(i, j) => self.a[(i, j)],
                () => 0.0,
            });
            let mut step = self.a.clone();
            dense::solve(&splitting, step.as_mut());
            Mat::from_fn(n, n, |i, j| f64::from(u8::from(i == j)) - step[(i, j)])
        };
        if and_back { dense::product(once(true).as_ref(), once(false).as_ref()) } else { once(false) }
    }
}
