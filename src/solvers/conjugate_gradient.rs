//! Conjugate gradients on the symmetric system `M V = H⁻¹P`, with a choice of preconditioner.
//!
//! The three coordinates share their step sizes (CG on the block system I₃ ⊗ M), so a rotation of the data
//! rotates every iterate. Written in the differences e = P − A V: the residual of the symmetric system is
//! H⁻¹e. One product with A and two further passes an iteration, the inner products among them (one more, or
//! two, with a preconditioner that is no scaling); four arrays of N points.

use glam::DVec3;

use super::incomplete_cholesky::IncompleteCholesky;
use super::iteration::{Errors, Failure, Iterate, Outcome, WarmStart};
use super::ssor::symmetric_sweep_with;
use super::system::{Rows, System};

/// An approximate inverse of M.
pub enum Preconditioner {
    /// Diagonal: z = s ∘ e, with the H⁻¹ of the residual H⁻¹e taken into s.
    Scaling(Vec<f64>),
    /// A symmetric SOR sweep from zero.
    Ssor {
        /// The relaxation factor, 0 < ω < 2.
        omega: f64,
    },
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
    sums: Vec<DVec3>,
    /// ⟨H⁻¹e, z⟩ of the last direction update; `None` asks for a fresh start of the directions.
    rho: Option<f64>,
    /// ⟨H⁻¹e, z⟩ of the current residual, where the pass that made it could tell.
    next_rho: Option<f64>,
    recursive: Option<Errors>,
    /// An estimate of how far rounding has taken the recurrence from the true residual since the last product:
    /// each update of V by d leaves a few ελ_max‖d‖₂. Large where V grows: on singular systems.
    drift: f64,
    rows: Rows,
}

/// The recurrence is replaced by a product where its estimated drift from the true residual exceeds this part of the
/// error: then the first digit of the error still holds.
const DRIFT: f64 = 0.1;

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
            sums: Vec::new(),
            rho: None,
            next_rho: None,
            recursive: None,
            drift: 0.0,
            rows: Rows::new(n),
        }
    }

    /// Evaluates e = P − A V by a product; the recurrence goes on from there.
    fn evaluate(&mut self) -> Errors {
        self.drift = 0.0;
        self.next_rho = None;
        let totals =
            self.rows.residual(self.system, self.points, &self.current, &mut self.residual, |_, e, out, _| *out = e);
        totals.errors
    }
}

impl<S: System> Iterate for ConjugateGradient<'_, S> {
    fn errors(&mut self) -> Errors {
        match self.recursive {
            Some(errors) if self.drift <= DRIFT * errors.max => errors,
            _ => self.evaluate(),
        }
    }

    /// By a product. If the recurrence had lost touch, the search directions start afresh.
    fn confirm(&mut self, errors: Errors) -> Errors {
        let truth = self.evaluate();
        if (truth.max - errors.max).abs() > 0.1 * errors.max {
            self.rho = None;
        }
        truth
    }

    fn advance(&mut self) -> Result<(), Failure> {
        let h = self.system.weights();
        // z = B H⁻¹ e; a scaling is applied where z is used.
        let residual = &self.residual;
        let rho = match &self.preconditioner {
            Preconditioner::Scaling(s) => match self.next_rho.take() {
                Some(rho) => rho,
                None => {
                    // A vector of () takes no memory.
                    let mut nothing = vec![(); residual.len()];
                    self.rows
                        .pass_one(&mut nothing, |i, (), tally| {
                            tally.dot(s[i] * residual[i].length_squared() / h[i]);
                        })
                        .dot
                }
            },
            Preconditioner::Ssor { omega } => {
                self.work.fill(DVec3::ZERO);
                symmetric_sweep_with(self.system, residual, *omega, None, &mut self.work, &mut self.sums);
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
        let squares = match &self.preconditioner {
            Preconditioner::Scaling(s) => self.rows.pass_one(&mut self.direction, |i, p, tally| {
                *p = s[i] * residual[i] + beta * *p;
                tally.dot(p.length_squared());
            }),
            _ => self.rows.pass_one(&mut self.direction, |i, p, tally| {
                *p = work[i] + beta * *p;
                tally.dot(p.length_squared());
            }),
        };
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
        let (current, residual) = (&mut self.current, &mut self.residual);
        let totals = match &self.preconditioner {
            Preconditioner::Scaling(s) => self.rows.pass(current, residual, |i, v, e, tally| {
                *v += alpha * direction[i];
                *e -= alpha * work[i];
                tally.error(*e);
                tally.dot(s[i] * e.length_squared() / h[i]);
            }),
            _ => self.rows.pass(current, residual, |i, v, e, tally| {
                *v += alpha * direction[i];
                *e -= alpha * work[i];
                tally.error(*e);
            }),
        };
        if let Preconditioner::Scaling(_) = self.preconditioner {
            self.next_rho = Some(totals.dot);
        }
        self.rho = Some(rho);
        self.recursive = Some(totals.errors);
        self.drift += 4.0 * f64::EPSILON * self.system.lambda_max() * alpha * squares.dot.sqrt();
        Ok(())
    }

    fn points(&self) -> &[DVec3] {
        &self.current
    }
}

impl<S: System> WarmStart for ConjugateGradient<'_, S> {
    fn start_at(&mut self, at: &[DVec3]) {
        self.current.copy_from_slice(at);
        (self.rho, self.next_rho, self.recursive) = (None, None, None);
    }
}

fn breakdown(detail: String) -> Failure {
    Failure { outcome: Outcome::Breakdown, detail }
}
