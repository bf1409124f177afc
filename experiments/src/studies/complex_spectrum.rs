//! The tables, the picture and the JSON object about a spectrum that may be complex; spectral radii of sweeps.

use glam::DVec3;
use serde_json::{Map, Value, json};

use crate::cli::{Input, Progress, Subject, number};
use crate::report::{Column, Columns, Figure, LinePlot, Series, Table};
use limitlab::analysis::complex_spectrum::ComplexSpectrum;
use limitlab::analysis::dense::LARGEST_COMPLEX;
use limitlab::analysis::singularity::Singularity;
use limitlab::analysis::spectral_radius::{SpectralRadius, spectral_radius};
use limitlab::analysis::spectrum::{Extremes, Spectra};
use limitlab::analysis::symmetric::SymmetricForm;
use limitlab::solvers::jacobi::THALL_OMEGA;
use limitlab::solvers::method::{SOR_OMEGA, SSOR_OMEGA};
use limitlab::solvers::ssor::symmetric_sweep;
use limitlab::solvers::system::sweep;
use limitlab::solvers::{Method, System};
use limitlab::{Error, Result};

/// What there is to say of the whole matrix of a mesh with darts or semi-sharp vertices.
pub struct ComplexFindings {
    /// Of A and of D⁻¹A.
    relaxations: [Relaxation; 2],
    sweeps: Vec<(Method<'static>, f64, SpectralRadius)>,
    verdict: Singularity,
}

/// A or D⁻¹A: real and imaginary parts of the eigenvalues, and what they make of relaxation.
struct Relaxation {
    name: &'static str,
    eigenvalues: Vec<(f64, f64)>,
    ends: Extremes,
    /// The largest |Im λ|.
    imaginary: f64,
    critical_omega: f64,
    optimal_omega: f64,
    /// At ω = ½, 1 and the optimal one.
    radii: [f64; 3],
}

impl Relaxation {
    /// Of a spectrum that is known in full.
    fn new(spectrum: &ComplexSpectrum, form: SymmetricForm) -> Option<Self> {
        let optimal_omega = spectrum.optimal_omega(form);
        let at = |omega| spectrum.radius(form, omega);
        let eigenvalues = spectrum.eigenvalues(form)?;
        Some(Relaxation {
            name: match form {
                SymmetricForm::A => "A",
                SymmetricForm::Jacobi => "D⁻¹A",
            },
            ends: spectrum.ends(form),
            imaginary: eigenvalues.iter().map(|z| z.im.abs()).fold(0.0, f64::max),
            critical_omega: spectrum.critical_omega(form),
            optimal_omega,
            radii: [at(THALL_OMEGA)?, at(1.0)?, at(optimal_omega)?],
            eigenvalues: {
                let mut all: Vec<(f64, f64)> = eigenvalues.iter().map(|z| (z.re, z.im)).collect();
                all.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
                all
            },
        })
    }
}

/// The spectral radii of Gauss-Seidel, SOR and SSOR in file order, each with its ω, named on a bar while it is computed.
///
/// # Errors
/// As [`spectral_radius`].
pub fn radii_of_sweeps<S: System>(
    system: &S,
    progress: &Progress,
) -> Result<Vec<(Method<'static>, f64, SpectralRadius)>> {
    let zero = vec![DVec3::ZERO; system.len()];
    let zero = &zero[..];
    let radius = |method: Method<'static>, omega: f64, sweep: &dyn Fn(&mut [DVec3])| -> Result<_> {
        progress.message(format!("spectral radius of {method}"));
        Ok((method, omega, spectral_radius(system, sweep)?))
    };
    let sor = |omega: f64| move |x: &mut [DVec3]| sweep(system, zero, omega, 0..zero.len(), x);
    let order = None;
    Ok(vec![
        radius(Method::GaussSeidel { order }, 1.0, &sor(1.0))?,
        radius(Method::Sor { omega: SOR_OMEGA, order }, SOR_OMEGA, &sor(SOR_OMEGA))?,
        radius(Method::Ssor { omega: SSOR_OMEGA, order }, SSOR_OMEGA, &|x| {
            symmetric_sweep(system, zero, SSOR_OMEGA, None, x);
        })?,
    ])
}

impl ComplexFindings {
    /// All eigenvalues of A and D⁻¹A, and the radii of sweeps if they are wanted; the bar says which are computed.
    ///
    /// # Errors
    /// More than [`LARGEST_COMPLEX`] vertices; if a computation does not converge.
    pub fn new(input: &Input, sweeps: bool, progress: &Progress) -> Result<Self> {
        let system = input.stages()?.whole();
        let too_many = || {
            Error::Computation(format!(
                "it has {} vertices with darts or semi-sharp ones among them, so that eigenvalues may be complex: all are \
                 computed up to {LARGEST_COMPLEX}; use a coarser mesh, or make darts corners",
                System::len(&system)
            ))
        };
        if System::len(&system) > LARGEST_COMPLEX {
            return Err(too_many());
        }
        progress.message("all eigenvalues");
        let spectrum = ComplexSpectrum::full(&system)?;
        let relaxations = [SymmetricForm::A, SymmetricForm::Jacobi].map(|form| Relaxation::new(&spectrum, form));
        let [Some(a), Some(jacobi)] = relaxations else { return Err(too_many()) };
        Ok(ComplexFindings {
            relaxations: [a, jacobi],
            sweeps: if sweeps { radii_of_sweeps(&system, progress)? } else { Vec::new() },
            verdict: Singularity::detect(&input.surface, input.scheme),
        })
    }

    /// Method, its parameter, the spectral radius of its error matrix.
    fn radii(&self) -> Vec<(&'static str, String, f64)> {
        let [a, jacobi] = &self.relaxations;
        let optimal = |r: &Relaxation| format!("ω={:.6} (optimal)", r.optimal_omega);
        let mut rows = vec![
            ("pia", "ω=1".into(), a.radii[1]),
            ("w-pia", optimal(a), a.radii[2]),
            ("thall", "ω=0.5".into(), jacobi.radii[0]),
            ("jacobi", "ω=1".into(), jacobi.radii[1]),
            ("jacobi_optimal", optimal(jacobi), jacobi.radii[2]),
        ];
        for (method, omega, radius) in &self.sweeps {
            rows.push((method.name(), format!("ω={omega}, file order"), radius.value));
        }
        rows
    }

    /// The eigenvalues in numbers, and the predicted rates.
    pub fn tables(&self, subject: &Subject) -> [Table; 2] {
        let columns = Columns::<Relaxation>::new()
            .col(Column::key("matrix"), |r| r.name)
            .col(Column::number("real_min", 1e-7, 10), |r| r.ends.min)
            .col(Column::number("real_max", 1e-7, 10), |r| r.ends.max)
            .col(Column::number("imaginary_max", 1e-7, 6).floor(1e-9), |r| r.imaginary)
            .col(Column::number("omega_critical", 1e-6, 6), |r| r.critical_omega)
            .col(Column::number("omega_optimal", 1e-4, 6), |r| r.optimal_omega);
        let title = format!("Spectrum of {}", subject.title);
        let mut table = columns.table(subject.stem("spectrum"), title, &self.relaxations);
        table.note(format!("{}; {}", subject.size, self.singularity()));
        table.note(
            "All eigenvalues of the whole matrix by a dense computation: at darts and semi-sharp vertices no diagonal makes A \
             symmetric, and eigenvalues may be complex. What is proven of symmetric matrices is left out: bounds of λ_min, ω \
             that are safe, iterations that suffice. Beyond `omega_critical` = min 2 Re λ/|λ|² relaxation diverges.",
        );
        let columns = Columns::<(&str, String, f64)>::new()
            .col(Column::key("method"), |&(method, ..)| method)
            .col(Column::key("parameter"), |(_, parameter, _)| parameter.clone())
            .col(Column::number("rho", 1e-5, 6), |&(.., rho)| rho);
        let title = format!("Predicted rates on {}", subject.title);
        let mut rates = columns.table(subject.stem("spectrum-rates"), title, &self.radii());
        rates.note("Factors per iteration: the spectral radius of the error matrix; of PIA and Jacobi max |1 − ωλ|.");
        [table, rates]
    }

    /// What theory says, which is one direction only.
    fn singularity(&self) -> String {
        let condition = self.verdict.set.condition();
        match (self.verdict.singular.first(), condition) {
            (Some(first), Some(condition)) => format!(
                "**singular**: {} of {} components (the first begins at vertex {}) with {condition}, and no curve, corner or \
                 semi-sharp curve there that would cure it; the null vectors are their ±1 colourings.",
                self.verdict.kernel_dimension(),
                self.verdict.components,
                first.first_vertex,
            ),
            (_, Some(condition)) => {
                format!("no component is singular by theory: none has {condition} with darts alone.")
            }
            _ => "no component is singular by theory.".into(),
        }
    }

    /// All eigenvalues.
    pub fn full_table(&self, subject: &Subject) -> Table {
        let [a, jacobi] = &self.relaxations;
        let columns = Columns::<usize>::new()
            .col(Column::key("index"), |i| i.to_string())
            .col(Column::number("a_real", 1e-7, 10), |&i| a.eigenvalues[i].0)
            .col(Column::number("a_imaginary", 1e-7, 10), |&i| a.eigenvalues[i].1)
            .col(Column::number("jacobi_real", 1e-7, 10), |&i| jacobi.eigenvalues[i].0)
            .col(Column::number("jacobi_imaginary", 1e-7, 10), |&i| jacobi.eigenvalues[i].1);
        let title = format!("All eigenvalues of {}", subject.title);
        columns.table(subject.stem("spectrum-full"), title, &Vec::from_iter(0..a.eigenvalues.len()))
    }

    /// The eigenvalues in the plane.
    pub fn figure(&self, subject: &Subject) -> Figure {
        let panel = |relaxation: &Relaxation| LinePlot {
            x_label: format!("Re λ of {}", relaxation.name),
            y_label: "Im λ".into(),
            series: vec![Series::cloud(relaxation.name, relaxation.eigenvalues.iter().copied())],
            ..LinePlot::default()
        };
        let [a, jacobi] = self.relaxations.each_ref().map(panel);
        let mut figure = Figure::stack([LinePlot { title: subject.caption(), ..a }, jacobi]);
        figure.share_x = false;
        figure
    }

    /// The fields of the JSON object; `lambda_min` and its like are those of real parts.
    pub fn json(&self, full: bool) -> Value {
        let [a, jacobi] = &self.relaxations;
        let rho: Map<String, Value> =
            self.radii().into_iter().map(|(method, _, value)| (method.into(), number(value))).collect();
        let mut object = json!({
            "lambda_min": number(a.ends.min),
            "lambda_max": number(a.ends.max),
            "imaginary_max": number(a.imaginary),
            "lambda_min_bound": null,
            "jacobi_lambda_min": number(jacobi.ends.min),
            "jacobi_lambda_max": number(jacobi.ends.max),
            "jacobi_imaginary_max": number(jacobi.imaginary),
            "rho": rho,
            "optimal_omega": { "w-pia": number(a.optimal_omega), "jacobi": number(jacobi.optimal_omega) },
            "critical_omega_pia": number(a.critical_omega),
            "critical_omega_jacobi": number(jacobi.critical_omega),
            "singular": self.verdict.is_singular(),
            "kernel_dimension": self.verdict.kernel_dimension(),
        });
        if full {
            object["eigenvalues"] = json!({ "a": a.eigenvalues, "jacobi": jacobi.eigenvalues });
        }
        object
    }
}
