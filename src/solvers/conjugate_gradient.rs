//! Conjugate gradients on the symmetric system `M V = H⁻¹P`, with a choice of preconditioner.
//!
//! The three coordinates share their step sizes (CG on the block system I₃ ⊗ M), so a rotation of the data
//! rotates every iterate. Written in the differences e = P − A V: the residual of the symmetric system is
//! H⁻¹e. One product with A and two further passes an iteration; four arrays of N points.

use glam::DVec3;

use super::incomplete_cholesky::IncompleteCholesky;
use super::iteration::{Errors, Failure, Iterate, Outcome};
use super::ssor::symmetric_sweep;
use super::system::{Rows, System};

/// An approximate inverse of M.
pub enum Preconditioner {
    /// Diagonal: z = s ∘ e, with the H⁻¹ of the residual H⁻¹e taken into s.
    Scaling(Vec<f64>),
    /// A symmetric SOR sweep from zero.
    Ssor { omega: f64 },
    /// Incomplete Cholesky of M without fill.
    IncompleteCholesky(IncompleteCholesky),
}

impl Preconditioner {
    /// None: plain CG on M, which sees the spread of valences too.
    pub fn identity<S: System>(system: &S) -> Self {
        Preconditioner::Scaling(system.weights().iter().map(|h| 1.0 / h).collect())
    }

    /// H: CG then sees the spectrum of A.
    pub fn weights<S: System>(system: &S) -> Self {
        Preconditioner::Scaling(vec![1.0; system.len()])
    }

    /// diag(M)⁻¹: CG then sees the spectrum of D⁻¹A.
    pub fn jacobi<S: System>(system: &S) -> Self {
        Preconditioner::Scaling(system.diagonal().iter().map(|d| 1.0 / d).collect())
    }
}

/// Conjugate gradients at work.
pub struct ConjugateGradient<'a, S> {
    system: &'a S,
    points: &'a [DVec3],
    preconditioner: Preconditioner,
    current: Vec<DVec3>,
    /// e = P − A V, by recurrence between true evaluations.
    residual: Vec<DVec3>,
    direction: Vec<DVec3>,
    /// A·direction, then the preconditioned residual.
    work: Vec<DVec3>,
    /// ⟨H⁻¹e, z⟩ of the last direction update; `None` asks for a fresh start.
    rho: Option<f64>,
    recursive: Option<Errors>,
    trusted: f64,
    rows: Rows,
}

/// Beyond this loss against the last true residual, the recurrence is checked by a product: rounding makes the
/// two drift apart by about ε times the largest residual seen. Derived: 10⁻¹⁰ leaves six digits.
const DRIFT: f64 = 1e-10;

impl<'a, S: System> ConjugateGradient<'a, S> {
    /// Starts from V = P.
    pub fn new(system: &'a S, points: &'a [DVec3], preconditioner: Preconditioner) -> Self {
        let n = points.len();
        ConjugateGradient {
            system,
            points,
            preconditioner,
            current: points.to_vec(),
            residual: vec![DVec3::ZERO; n],
            direction: vec![DVec3::ZERO; n],
            work: vec![DVec3::ZERO; n],
            rho: None,
            recursive: None,
            trusted: f64::INFINITY,
            rows: Rows::new(n),
        }
    }

    /// Evaluates e = P − A V by a product.
    fn evaluate(&mut self) -> Errors {
        let totals = self.rows.residual(
            self.system,
            self.points,
            &self.current,
            &mut self.residual,
            |_, e, out, _| *out = e,
        );
        totals.errors
    }
}

impl<S: System> Iterate for ConjugateGradient<'_, S> {
    fn errors(&mut self) -> Errors {
        match self.recursive {
            Some(errors) if errors.max > DRIFT * self.trusted => errors,
            _ => {
                let errors = self.evaluate();
                self.trusted = errors.max;
                self.rho = None;
                errors
            }
        }
    }

    fn advance(&mut self) -> Result<(), Failure> {
        let h = self.system.weights();
        // z = B H⁻¹ e
        let residual = &self.residual;
        let rho = match &self.preconditioner {
            Preconditioner::Scaling(s) => {
                self.rows
                    .pass_one(&mut self.work, |i, z, tally| {
                        *z = s[i] * residual[i];
                        tally.dot(residual[i].dot(*z) / h[i]);
                    })
                    .dot
            }
            Preconditioner::Ssor { omega } => {
                self.work.fill(DVec3::ZERO);
                symmetric_sweep(self.system, residual, *omega, None, &mut self.work);
                self.rows
                    .pass_one(&mut self.work, |i, z, tally| {
                        tally.dot(residual[i].dot(*z) / h[i]);
                    })
                    .dot
            }
            Preconditioner::IncompleteCholesky(factor) => {
                for ((z, e), h) in self.work.iter_mut().zip(residual).zip(h) {
                    *z = *e / *h;
                }
                factor.solve(&mut self.work);
                self.rows
                    .pass_one(&mut self.work, |i, z, tally| {
                        tally.dot(residual[i].dot(*z) / h[i]);
                    })
                    .dot
            }
        };
        if !(rho > 0.0 && rho.is_finite()) {
            return Err(breakdown(format!("⟨r, B r⟩ = {rho:e} is not positive")));
        }
        // p ← z + β p
        let beta = self.rho.map_or(0.0, |before| rho / before);
        let work = &self.work;
        self.rows
            .pass_one(&mut self.direction, |i, p, _| *p = work[i] + beta * *p);
        // q ← A p
        let (system, direction) = (self.system, &self.direction);
        let mut nothing = vec![(); direction.len()];
        let curvature = self
            .rows
            .product(system, direction, &mut self.work, &mut nothing, |i, ap, q, (), tally| {
                *q = ap;
                tally.dot(direction[i].dot(ap) / h[i]);
            })
            .dot;
        if !(curvature > 0.0 && curvature.is_finite()) {
            return Err(breakdown(format!(
                "⟨p, M p⟩ = {curvature:e} is not positive: M is singular or indefinite along the search direction"
            )));
        }
        let alpha = rho / curvature;
        // V ← V + α p, e ← e − α q
        let work = &self.work;
        let totals = self
            .rows
            .pass(&mut self.current, &mut self.residual, |i, v, e, tally| {
                *v += alpha * direction[i];
                *e -= alpha * work[i];
                tally.error(*e);
            });
        self.rho = Some(rho);
        self.recursive = Some(totals.errors);
        Ok(())
    }

    fn points(&self) -> &[DVec3] {
        &self.current
    }
}

fn breakdown(detail: String) -> Failure {
    Failure {
        outcome: Outcome::Breakdown,
        detail,
    }
}
