//! The table and the picture of an ω sweep.

use super::style;
use crate::cli::{Grid, Progress};
use crate::report::{Column, Columns, Figure, LinePlot, Rule, Scale, Series, Table, readable};
use limitlab::analysis::sweep::{OmegaSweep, SweepEvent, SweepRow};
use limitlab::error::{counted, short};
use limitlab::solvers::{Method, Outcome, Step};

/// The grids unless told: Jacobi's reaches beyond 2/λ_max(D⁻¹A) on regular quads, the others over all of (0, 2].
pub fn default_grid(method: Method) -> Vec<f64> {
    let text = if matches!(method, Method::Jacobi { .. }) { "0.05:1.2:0.05" } else { "0.05:2:0.05" };
    text.parse::<Grid>().map(|g| g.0).unwrap_or_default()
}

/// A method at one ω, in words.
pub fn name(method: Method, omega: f64) -> String {
    format!("{method} (ω={})", short(omega))
}

/// Names on a bar the run that began last, and counts those that have ended.
pub fn show(progress: &Progress, event: &SweepEvent) {
    match event {
        SweepEvent::Iterate(method, omega, Step { iteration: 0, .. }) => progress.message(name(*method, *omega)),
        SweepEvent::Iterate(..) => {}
        SweepEvent::Row(_) => progress.step(),
    }
}

/// One row a method and ω. `about` says which mesh, start and tolerance.
pub fn table(id: String, title: String, about: String, sweep: &OmegaSweep) -> Table {
    let mut table = columns().table(id, title, &sweep.rows);
    table.note(format!(
        "{about} `predicted_rho` is the spectral radius of the error matrix, `predicted_rho_data` the same over the \
         eigenvectors that the data excite, `observed_rate` the factor per iteration fitted to the tail of the \
         history."
    ));
    for t in &sweep.thresholds {
        let mut text = format!(
            "{}: eigenvalues in [{:.6}, {:.6}], ω_crit = {:.6}, ω_opt = {:.6} with ρ = {:.6}",
            t.method, t.ends.min, t.ends.max, t.critical_omega, t.optimal_omega, t.optimal_rho
        );
        if let Some(data) = t.data {
            text += &format!(
                "; the data excite [{:.6}, {:.6}], so ω_crit = {:.6} for this run",
                data.min,
                data.max,
                data.critical_omega()
            );
        }
        if let Some(best) = sweep.best(t.method) {
            text += &format!(
                "; best on the grid: ω = {} with {}",
                short(best.omega),
                counted(best.iterations, "iteration")
            );
        }
        table.note(text + ".");
    }
    table
}

/// A line a method: the best ω on the grid, and what is predicted beside it.
pub fn best(methods: &[Method<'static>], sweep: &OmegaSweep) -> String {
    let line = |&method: &Method<'static>| {
        let mut line = match sweep.best(method) {
            None => format!("{method}: no run converged"),
            Some(best) => format!(
                "{method}: best ω = {} with {}, predicted ρ = {}",
                short(best.omega),
                counted(best.iterations, "iteration"),
                readable(best.predicted_rho, 4)
            ),
        };
        if let Some(t) = sweep.thresholds.iter().find(|t| t.method == method) {
            let [omega, rho] = [t.optimal_omega, t.optimal_rho].map(|x| readable(x, 4));
            line += &format!("; predicted best ω = {omega} with ρ = {rho}");
        }
        line
    };
    methods.iter().map(line).collect::<Vec<_>>().join("\n")
}

fn columns() -> Columns<'static, SweepRow> {
    Columns::<SweepRow>::new()
        .col(Column::key("method"), |r| r.method.name())
        .col(Column::key("omega"), |r| short(r.omega))
        .col(Column::text("status"), |r| r.outcome.name())
        .col(Column::count("iterations"), |r| r.iterations)
        .col(Column::number("predicted_rho", 1e-4, 4), |r| r.predicted_rho)
        .col(Column::number("predicted_rho_data", 1e-3, 4).detail(), |r| r.predicted_rho_data)
        .col(Column::number("observed_rate", 1e-2, 4).detail(), |r| r.observed_rate)
        .col(Column::number("max_error", 1e-2, 3).detail(), |r| r.errors.max)
}

/// Iterations above, rates below, over ω. Where a run does not converge, an arrowhead at the upper edge says so; all rates are
/// shown.
pub fn plot(title: String, methods: &[Method<'static>], sweep: &OmegaSweep) -> Figure {
    let rates = sweep.rows.iter().flat_map(|r| [Some(r.predicted_rho), r.observed_rate]).flatten();
    let largest = rates.filter(|rate| rate.is_finite()).fold(1.0, f64::max);
    let mut iterations = LinePlot {
        title,
        x_label: "ω".into(),
        y_label: "iterations to converge".into(),
        arrows: "not converged".into(),
        y_scale: Scale::Log,
        ..LinePlot::default()
    };
    let mut rates = LinePlot {
        x_label: "ω".into(),
        y_label: "factor per iteration".into(),
        y_range: Some((0.0, 1.05 * largest)),
        horizontal_lines: vec![Rule::new(1.0, "")],
        ..LinePlot::default()
    };
    for &method in methods {
        let style = style::of(method, "");
        let rows = || sweep.rows.iter().filter(move |r| r.method == method);
        let count = |r: &SweepRow| match r.outcome {
            Outcome::Converged => r.iterations as f64,
            _ => f64::INFINITY,
        };
        iterations.series.push(Series::line(method.name(), rows().map(|r| (r.omega, count(r)))).style(style));
        rates.series.push(
            Series::line(format!("{method}: predicted ρ(ω)"), rows().map(|r| (r.omega, r.predicted_rho)))
                .colour(style.colour)
                .dash(style.dash),
        );
        rates.series.push(
            Series::scatter(
                format!("{method}: measured"),
                rows().filter_map(|r| r.observed_rate.map(|rate| (r.omega, rate))),
            )
            .marker(style.marker)
            .colour(style.colour),
        );
    }
    for t in &sweep.thresholds {
        if matches!(t.method, Method::Jacobi { .. }) {
            for (at, label) in [(t.optimal_omega, "Jacobi ω_{opt}"), (t.critical_omega, "Jacobi ω_{crit}")] {
                iterations.vertical_lines.push(Rule::new(at, label));
                rates.vertical_lines.push(Rule::new(at, ""));
            }
        }
    }
    Figure::stack([iterations, rates])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::Panel;
    use limitlab::analysis::spectrum::spectrum;
    use limitlab::analysis::sweep::sweep;
    use limitlab::assemble::LimitSystem;
    use limitlab::mesh::{Surface, builtin};
    use limitlab::schemes::Scheme;
    use limitlab::solvers::Stop;

    /// Every rate has its place in the picture, those of runs that diverge too, and every run that did not converge its sign.
    #[test]
    fn nothing_is_cut_without_a_sign() {
        let surface = Surface::new(builtin::builtin("torus:8x6").unwrap()).unwrap();
        let system = LimitSystem::new(&surface, Scheme::CatmullClark).unwrap();
        let points = surface.positions();
        let method = Method::Jacobi { omega: None };
        let grids = [(method, vec![0.5, 1.0, 1.5, 2.0])];
        let stop = Stop { tolerance: 1e-10, max_iterations: 200 };
        let spectrum = spectrum(&system).unwrap();
        let found = sweep((&system, &spectrum), (points, points), &grids, None, &stop, 0.0, &|_| {}).unwrap();
        let figure = plot("a torus".into(), &[method], &found);
        assert_eq!(figure.illegible().unwrap(), [""; 0]);
        let [Panel::Lines(iterations), Panel::Lines(rates)] = &figure.panels[..] else { panic!("two plots") };
        let (_, top) = rates.y_range.unwrap();
        let largest = rates.series.iter().flat_map(|s| &s.points).map(|p| p.1).fold(0.0, f64::max);
        assert!(largest > 1.5 && largest < top, "{largest} {top}");
        let counts: Vec<f64> = iterations.series[0].points.iter().map(|p| p.1).collect();
        assert!(counts[0].is_finite() && counts[3] == f64::INFINITY, "{counts:?}");
    }
}
