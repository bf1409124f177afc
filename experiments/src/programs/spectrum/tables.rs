//! The tables, the histogram and the JSON object of what is found.

use serde_json::{Map, Value, json};

use super::findings::{Findings, Quantity, Rate};
use crate::cli::{Subject, number};
use crate::report::series::Bars;
use crate::report::{Column, Columns, Figure, LinePlot, Rule, Table};
use crate::studies::modes;
use limitlab::analysis::a_priori::{IterationCounts, Promise};
use limitlab::analysis::dense;
use limitlab::analysis::inertia::Certificate;
use limitlab::analysis::singularity::Singularity;
use limitlab::analysis::spectrum::{Extremes, Spectrum};
use limitlab::solvers::Method;

/// Of the histograms.
const BINS: usize = 60;

pub fn eigenvalues(subject: &Subject, found: &Findings, n: usize) -> Table {
    let columns = Columns::<Quantity>::new()
        .col(Column::key("quantity"), |q| q.name)
        .col(Column::number("value", 1e-7, 10), |q| q.estimate.value)
        .col(Column::number("residual", 1e3, 2).floor(1e-6), |q| q.estimate.residual)
        .col(Column::number("error", 1e3, 2).floor(1e-6), |q| q.estimate.error)
        .col(Column::text("source"), |q| q.estimate.source.name())
        .col(Column::count("multiplicity"), |q| q.estimate.multiplicity.map(|m| m.count))
        .col(Column::number("equal_within", 1e-3, 1), |q| q.estimate.multiplicity.map(|m| m.within))
        .col(Column::number("proven_bound", 1e-9, 10), |q| q.bound)
        .col(Column::number("certified", 1e-6, 10), |q| q.certificate.map(|c| c.bound))
        .col(Column::number("attained", 1e-6, 10), |q| q.certificate.map(|c| c.attained))
        .col(Column::number("excited_by_data", 1e-3, 6), |q| q.excited);
    let title = format!("Spectrum of {}", subject.title);
    let mut table = columns.table(subject.stem("spectrum"), title, &found.quantities());
    table.note(match &found.verdict {
        Some(verdict) => format!("{}, {}", subject.size, of_a_mesh(verdict)),
        None => format!("{}; {}", subject.size, of_a_system(found, n)),
    });
    table.note(format!(
        "`residual` is ‖Sx − λx‖₂ of the symmetric matrix similar to A or D⁻¹A: an eigenvalue lies that close. `error` \
         estimates the error of the value as the end of the spectrum. {} products of a matrix with a vector were made. \
         `multiplicity` counts the eigenvalues that equal this \
         end up to `equal_within`, relative, where that was decided. ω of Jacobi is safe below {:.6} by proof, below {:.6} by \
         the spectrum; of W-PIA below {:.6}.",
        found.ends.applications,
        found.promise.safe_omega_jacobi,
        found.spectrum().jacobi.critical_omega(),
        found.promise.safe_omega_pia
    ));
    table.note(format!(
        "Proven: `proven_bound`, by a theorem, from {} (its formula, to rounding); that the end lies between `certified` and `attained` (--certify), by a \
         Cholesky factorization and a Rayleigh quotient whose rounding is bounded before they are made; values of `source` \
         proven (a vector attains the bound, to rounding) and bracketed (within `error`, by counts of eigenvalues whose rounding \
         is bounded). Converged to `residual`, but not proven to be the end: lanczos; dense is as good as the backward error of \
         a dense eigenvalue solver. Measured: unconverged, and what the points excite.",
        if found.verdict.is_some() { "valences and face sizes alone" } else { "the entries (Gershgorin)" },
    ));
    if let Some((least, greatest)) = found.ends_of_curves() {
        table.note(format!(
            "All of this is about the smooth vertices. Those on curves have eigenvalues of their own, {} from {least:.6} to \
             {greatest:.6}, and each corner has 1: the spectrum of A is the union.",
            found.curves.len()
        ));
    }
    table.note(match &found.counts {
        Some(counts) => format!(
            "Iterations that suffice by proof for this tolerance from V = P: PIA {}, W-PIA {}, Thall {}, Chebyshev {}.",
            promised(counts.pia),
            promised(counts.w_pia),
            promised(counts.thall),
            promised(counts.chebyshev)
        ),
        None => "All points coincide: no tolerance is relative to their extent, and no iterations are promised.".into(),
    });
    table
}

/// The components of a mesh, and what theory says of its system.
fn of_a_mesh(verdict: &Singularity) -> String {
    let kernel = verdict.kernel_dimension();
    let components = |n: usize| format!("{n} {}", if n == 1 { "component" } else { "components" });
    let mut text = format!(
        "{}; {}",
        components(verdict.components),
        if kernel > 0 {
            format!(
                "**singular**: {} (the first begins at vertex {}) {} {}, the null vectors are \
                 their ±1 colourings, and the points {} a part that no control points reach.",
                components(kernel),
                verdict.singular[0].first_vertex,
                if kernel == 1 { "has" } else { "have" },
                verdict.set.condition().unwrap_or_default(),
                if verdict.excited { "have" } else { "do not have" }
            )
        } else {
            match verdict.set.condition() {
                Some(condition) => format!("non-singular: no component has {condition}."),
                None => "non-singular, as on every mesh under this scheme.".into(),
            }
        }
    );
    if kernel > 0 {
        text += &format!(
            " PIA {}; Gauss-Seidel {}; Cholesky {}.",
            verdict.prediction(Method::Pia).name(),
            verdict.prediction(Method::GaussSeidel { order: None }).name(),
            verdict.prediction(Method::Cholesky).name()
        );
    }
    text
}

/// What the computed spectrum says of a system without a mesh.
fn of_a_system(found: &Findings, n: usize) -> &'static str {
    if found.is_singular(n) {
        "**singular** to rounding: λ_min is below 4·N·ε·λ_max."
    } else if found.ends.lambda_min.value < 0.0 {
        "**indefinite**: λ_min is negative, and the methods for positive definite matrices need not converge."
    } else {
        "positive definite, as far as the computed λ_min tells."
    }
}

fn promised(count: f64) -> String {
    if count.is_finite() { count.to_string() } else { "unknown (no positive bound for λ_min)".into() }
}

pub fn rates(subject: &Subject, found: &Findings) -> Table {
    let mut columns = Columns::<Rate>::new()
        .col(Column::key("method"), |r| r.method)
        .col(Column::key("parameter"), |r| r.parameter.clone())
        .col(Column::number("rho", 1e-5, 6), |r| r.rho);
    if found.certified().is_some() {
        columns = columns.col(Column::number("certified", 1e-5, 6), |r| r.certified);
    }
    let title = format!("Predicted rates on {}", subject.title);
    let mut table = columns.table(subject.stem("spectrum-rates"), title, &found.rates());
    table.note(
        "Factors per iteration: the spectral radius of the error matrix; for Chebyshev and conjugate gradients the bound \
         from the condition number. They are as well known as the ends that they follow from; those of Gauss-Seidel, SOR and \
         SSOR are measured. What --certify proves stands in a column `certified`: no rate is greater."
            .to_string(),
    );
    table
}

pub fn full(subject: &Subject, full: &dense::Eigenvalues) -> Table {
    let columns = Columns::<usize>::new()
        .col(Column::key("index"), |i| i.to_string())
        .col(Column::number("a", 1e-9, 10), |&i| full.a[i])
        .col(Column::number("jacobi", 1e-9, 10), |&i| full.jacobi[i]);
    let title = format!("All eigenvalues of {}", subject.title);
    columns.table(subject.stem("spectrum-full"), title, &Vec::from_iter(0..full.a.len()))
}

pub fn histogram(subject: &Subject, full: &dense::Eigenvalues, promise: &Promise) -> Figure {
    let panel = |values: &[f64], name: &str, label: &str, bounds: Extremes| LinePlot {
        x_label: format!("eigenvalue of {label}"),
        y_label: "eigenvalues".into(),
        bars: vec![Bars::histogram(name, values, BINS)],
        vertical_lines: vec![Rule::new(bounds.min, "proven bounds"), Rule::new(bounds.max, "")],
        ..LinePlot::default()
    };
    let a = LinePlot { title: subject.caption(), ..panel(&full.a, "A", "A (PIA, CG, Chebyshev)", promise.a) };
    let jacobi = panel(&full.jacobi, "D⁻¹A", "D⁻¹A (Jacobi)", promise.jacobi);
    let mut figure = Figure::stack([a, jacobi]);
    figure.share_x = false;
    figure
}

pub fn json(subject: &Subject, found: &Findings, n: usize) -> Value {
    let e = &found.ends;
    let Spectrum { a, jacobi } = found.spectrum();
    let quantities = found.quantities();
    let each = |value: fn(&Quantity) -> Value| quantities.iter().map(|q| (q.name, value(q))).collect::<Value>();
    let promised = |count: fn(&IterationCounts) -> f64| found.counts.as_ref().map(|c| number(count(c)));
    let mut rho = Map::new();
    let rates = found.rates();
    for rate in &rates {
        rho.insert(rate.method.into(), number(rate.rho));
    }
    let mut object = json!({
        "lambda_min": number(e.lambda_min.value),
        "lambda_max": number(e.lambda_max.value),
        "lambda_min_bound": number(found.bounds.lambda_min),
        "jacobi_lambda_min": number(e.jacobi_lambda_min.value),
        "jacobi_lambda_max": number(e.jacobi_lambda_max.value),
        "jacobi_lambda_min_bound": number(found.bounds.jacobi_lambda_min),
        "jacobi_lambda_max_bound": number(found.bounds.jacobi_lambda_max),
        "residuals": each(|q| number(q.estimate.residual)),
        "multiplicities": each(|q| {
            let multiplicity = q.estimate.multiplicity;
            multiplicity.map(|m| json!({ "count": m.count, "within": m.within })).into()
        }),
        "sources": each(|q| q.estimate.source.name().into()),
        "converged": e.converged(),
        "applications": e.applications,
        "rho": rho,
        "optimal_omega": {
            "w-pia": number(a.optimal_omega()),
            "jacobi": number(jacobi.optimal_omega()),
        },
        "critical_omega_jacobi": number(jacobi.critical_omega()),
        "safe_omega_jacobi": number(found.promise.safe_omega_jacobi),
        "promised_iterations": {
            "pia": promised(|c| c.pia),
            "w-pia": promised(|c| c.w_pia),
            "thall": promised(|c| c.thall),
            "chebyshev": promised(|c| c.chebyshev),
        },
        "singular": found.is_singular(n),
        "kernel_dimension": found.kernel_dimension(n),
        "curves": found.ends_of_curves().map(|(least, greatest)| json!({
            "unknowns": found.curves.len(), "lambda_min": number(least), "lambda_max": number(greatest),
        })),
        "kernel_excited": found.verdict.as_ref().map(|v| v.excited),
    });
    if let Value::Object(map) = &mut object {
        let of_ends = |value: fn(&Certificate) -> f64| {
            let proven = |q: &Quantity| Some((q.name.to_owned(), number(value(q.certificate.as_ref()?))));
            quantities.iter().filter_map(proven).collect::<Map<_, _>>()
        };
        let of_rates = rates.iter().filter_map(|r| Some((r.method.to_owned(), number(r.certified?)))).collect();
        let proofs =
            [("certified", of_ends(|c| c.bound)), ("attained", of_ends(|c| c.attained)), ("certified_rho", of_rates)];
        for (field, values) in proofs.into_iter().filter(|(_, values)| !values.is_empty()) {
            map.insert(field.into(), Value::Object(values));
        }
        if let Some(verdict) = found.verdict.as_ref().filter(|v| v.is_singular()) {
            let all = Method::ALL.iter().map(|&m| (m.name().to_owned(), Value::from(verdict.prediction(m).name())));
            map.insert("predictions".into(), Value::Object(all.collect()));
        }
        if let Some(full) = &found.full {
            map.insert("eigenvalues".into(), json!({ "a": full.a, "jacobi": full.jacobi }));
        }
        if let Some(slow) = &found.modes {
            map.extend(modes::json(slow).map(|(field, value)| (field.to_owned(), value)));
        }
    }
    subject.json(object)
}
