//! All methods × all schemes × all meshes: iterations to 10⁻³, 10⁻⁶ and 10⁻¹⁰, and convergence plots.

use std::collections::BTreeMap;

use crate::report::{Cell, Column, Columns, Table};
use crate::studies::comparison as study;
use crate::studies::comparison::{Curve, convergence};
use crate::studies::histories::sampled;
use crate::studies::style;
use limitlab::Result;
use limitlab::analysis::comparison::{Entry, entries};
use limitlab::analysis::spectrum::spectrum;
use limitlab::interpolate::interpolate;
use limitlab::schemes::Scheme;
use limitlab::solvers::anderson::WINDOW;
use limitlab::solvers::method::{SOR_OMEGA, SSOR_OMEGA};
use limitlab::solvers::{Errors, Method, Outcome, Recorded, Report, Stop, run as solve};

use crate::programs::reproduce::context::{Context, Item, Question, Subject};
use crate::programs::reproduce::corpus;

pub const ALL: Item = Item {
    id: "all-methods",
    title: "Iterations of every method under every scheme on every mesh",
    question: Some(Question {
        asks: "Which method needs the fewest iterations, and which the least work?",
        answer: "Conjugate gradients with incomplete Cholesky, then with symmetric sweeps, need the fewest. In passes over the matrix \
                 those preconditioned by H or by the diagonal cost about as little: each table has medians and winners above it.",
    }),
    run,
};

/// Meshes with convergence plots, one for every scheme they suit.
const PLOTTED: [&str; 4] = ["irregular-quad:1000", "irregular-tri:1000", "psb_m104_horse_233v", "spot_2930v_quad"];
/// The lines of a comparison, each a column: a method's name, and which of its lines where there are several.
const COLUMNS: [(&str, &str); 22] = [
    ("lu", ""),
    ("cholesky", "faer"),
    ("cholesky", "nalgebra-sparse"),
    ("ldlt", ""),
    ("jacobi", ""),
    ("thall", ""),
    ("gauss-seidel", ""),
    ("sor", ""),
    ("ssor", ""),
    ("pia", ""),
    ("w-pia", ""),
    ("chebyshev", "proven"),
    ("chebyshev", "estimated"),
    ("cg", "preconditioned by H"),
    ("cg", "on M itself"),
    ("pcg-jacobi", ""),
    ("pcg-ssor", ""),
    ("pcg-ic0", ""),
    ("anderson", "of pia"),
    ("anderson", "of thall"),
    ("anderson", "of jacobi"),
    ("heavy-ball", ""),
];
/// The column of the chain that chooses by itself.
const AUTO: &str = "auto";
/// Relative to the diagonal of the bounding box.
const TOLERANCES: [f64; 3] = [1e-3, 1e-6, 1e-10];
const LIMIT: usize = 10_000;
/// Larger meshes are left to the `scaling` program.
const LARGEST: usize = 20_000;
/// A median is whole or a half.
const MEDIAN_DIGITS: usize = 6;
/// Largest mesh of a quick run.
const QUICK: usize = 300;

/// How every method comes to one tolerance, relative to the diagonal of the bounding box.
struct Row<'a> {
    subject: &'a Subject,
    scheme: Scheme,
    tolerance: f64,
    /// By column: the number of iterations, or how else the run ended.
    ended: BTreeMap<String, std::result::Result<usize, Outcome>>,
}

fn run(context: &mut Context) -> Result<()> {
    let most = if context.quick { QUICK } else { LARGEST };
    let subjects = context.subjects(&corpus::ALL_METHODS, most)?;
    let mut rows = Vec::new();
    for subject in &subjects {
        for scheme in Scheme::ALL {
            if subject.suits(scheme) {
                rows.extend(one(context, subject, scheme)?);
            }
        }
    }
    for tolerance in TOLERANCES {
        context.table(table(tolerance, &rows))?;
    }
    Ok(())
}

/// The rows of one tolerance, with a column for every line of the comparison.
fn table(tolerance: f64, rows: &[Row]) -> Table {
    let mut columns = Columns::<Row>::new()
        .col(Column::key("mesh"), |r| r.subject.name.clone())
        .col(Column::key("scheme"), |r| r.scheme.name())
        .col(Column::text("vertices"), |r| r.subject.surface.len());
    for name in COLUMNS.map(|(method, variant)| column_name(method, variant)).into_iter().chain([AUTO.into()]) {
        columns = columns.col(Column::count(name.clone()), move |r| {
            r.ended.get(&name).map(|ended| match ended {
                Ok(iterations) => Cell::from(*iterations),
                Err(outcome) => outcome.name().into(),
            })
        });
    }
    let rows: Vec<&Row> = rows.iter().filter(|r| r.tolerance == tolerance).collect();
    let mut table = columns.table(
        format!("{}--{tolerance:e}", ALL.id),
        format!("Iterations of every method to {tolerance:e}"),
        rows.iter().copied(),
    );
    table.summary = Some(Box::new(summary(&rows)));
    table.note(format!(
        "Updates of all vertices until max_i ‖p_i − (A v)_i‖ ≤ {tolerance:e} of the bounding box's diagonal; start \
         V = P, file order for in-place sweeps, at most {LIMIT} iterations. A direct method makes one: the solve. \
         jacobi and w-pia run at their best ω, sor at ω = {SOR_OMEGA}, ssor and pcg-ssor at {SSOR_OMEGA}; anderson \
         keeps {WINDOW} differences, heavy-ball has an estimated interval; auto counts the iterations of all \
         corrections in mixed precision together. Where the tolerance was not reached, the cell says how the run \
         ended. Meshes of at most {LARGEST} vertices. The CSV file beside a picture has the errors of iterations 0 to 100, \
         then of every tenth, from 1000 of every hundredth, and of the last."
    ));
    table
}

/// The iterations of a row by the name of its column; infinitely many where the tolerance was not reached.
fn iterations(row: &Row, name: &str) -> Option<f64> {
    row.ended.get(name).map(|ended| ended.as_ref().map_or(f64::INFINITY, |&iterations| iterations as f64))
}

/// A method that iterates in the summary: the name of its column, and its passes, of which `auto` has no number.
type Line = (String, Option<usize>);

/// Medians by scheme of the methods that iterate, and how often each is the best.
fn summary(rows: &[&Row]) -> Table {
    let iterative = |(name, variant)| {
        let method = Method::ALL.into_iter().find(|method| method.name() == name)?;
        Some((column_name(name, variant), Some(method.passes()?)))
    };
    let lines: Vec<Line> = COLUMNS.into_iter().filter_map(iterative).chain([(AUTO.to_owned(), None)]).collect();
    let count = |row: &Row, line: &Line| iterations(row, &line.0);
    let work = |row: &Row, line: &Line| Some(iterations(row, &line.0)? * line.1? as f64);
    // In how many rows a line has the least of all lines, alone or with others.
    let wins = |line: &Line, of: &dyn Fn(&Row, &Line) -> Option<f64>| {
        let least = |row: &Row| lines.iter().filter_map(|other| of(row, other)).fold(f64::INFINITY, f64::min);
        rows.iter().filter(|row| of(row, line).is_some_and(|own| own.is_finite() && own == least(row))).count()
    };
    let mut columns = Columns::<Line>::new().col(Column::key("method"), |line| line.0.clone());
    for scheme in Scheme::ALL.into_iter().filter(|scheme| rows.iter().any(|row| row.scheme == *scheme)) {
        columns = columns.col(Column::number(scheme.name(), 0.0, MEDIAN_DIGITS), move |line| {
            median(rows.iter().filter(|row| row.scheme == scheme).filter_map(|row| count(row, line)))
        });
    }
    let mut table = columns
        .col(Column::count("fewest_iterations"), |line| wins(line, &count))
        .col(Column::count("passes_an_iteration"), |line| line.1)
        .col(Column::number("median_passes", 0.0, MEDIAN_DIGITS), |line| {
            median(rows.iter().filter_map(|row| work(row, line)))
        })
        .col(Column::count("fewest_passes"), |line| line.1.map(|_| wins(line, &work)))
        .table("", "", &lines);
    table.note(format!(
        "Medians over the meshes, by scheme; in how many of the {} rows below a method needs the fewest iterations, alone or \
         with others; and work in passes over the entries of A, those that test the error among them (an incomplete \
         factor's two solves are one). A run that did not reach the tolerance counts as longer than any. Direct methods \
         are left out; the passes of `auto`, in single precision and many at a time, compare with none.",
        rows.len()
    ));
    table
}

/// The median; in words if the tolerance was not reached there, empty of nothing.
fn median(values: impl Iterator<Item = f64>) -> Cell {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    let (Some(&low), Some(&high)) = (values.get(values.len().saturating_sub(1) / 2), values.get(values.len() / 2))
    else {
        return Cell::Empty;
    };
    if high.is_finite() { (low.midpoint(high)).into() } else { "not reached".into() }
}

/// The method, with the variant where the method has several.
fn column_name(method: &str, variant: &str) -> String {
    let several = COLUMNS.iter().filter(|column| column.0 == method).count() > 1;
    if several { format!("{method} {variant}") } else { method.into() }
}

/// A row for each of [`TOLERANCES`].
fn one<'a>(context: &mut Context, subject: &'a Subject, scheme: Scheme) -> Result<[Row<'a>; TOLERANCES.len()]> {
    let system = subject.system(scheme)?;
    let spectrum = spectrum(&system)?;
    let size = subject.surface.diagonal();
    let stop = |tolerance| Stop { tolerance: tolerance * size, max_iterations: LIMIT };
    let mut rows = TOLERANCES.map(|tolerance| Row { subject, scheme, tolerance, ended: BTreeMap::new() });
    let mut histories = Vec::new();
    let lines = entries(&system, &spectrum, &Method::ALL, None, "file")?;
    for (method, variant) in COLUMNS {
        let name = column_name(method, variant);
        let line = lines.iter().find(|l| column_name(l.method.name(), l.variant) == name);
        let Some(line) = line else {
            // No bound of λ_min is proven for this mesh.
            continue;
        };
        let mut report = solve(&system, subject.surface.positions(), line.method, &stop(TOLERANCES[2])).report;
        for Recorded { errors, .. } in &mut report.history {
            *errors = Errors { max: errors.max / size, mean: errors.mean / size };
        }
        for row in &mut rows {
            let reached = report.history.iter().find(|at| at.errors.max <= row.tolerance).map(|at| at.iteration);
            row.ended.insert(name.clone(), reached.ok_or(report.outcome));
        }
        if !line.method.is_direct() {
            histories.push((line, report));
        }
    }
    for row in &mut rows {
        let report = interpolate(&subject.surface, scheme, &stop(row.tolerance).into())?.report;
        let ended = match report.outcome {
            Outcome::Converged => Ok(report.iterations),
            other => Err(other),
        };
        row.ended.insert(AUTO.into(), ended);
    }
    if context.quick || !PLOTTED.contains(&subject.name.as_str()) {
        return Ok(rows);
    }
    let stem = format!("{}--{}-{scheme}", ALL.id, subject.name.replace(':', "-"));
    let keys = |line: &Entry| [line.method.to_string(), line.parameter.clone()];
    let kept: Vec<_> = histories.iter().map(|(line, report)| (keys(line), sampled(&report.history))).collect();
    let runs = kept.iter().map(|(keys, history)| (keys.clone(), &history[..]));
    context.histories(&stem, ["method", "parameter"], runs)?;
    let curve = |(line, report): &'_ (&Entry, Report)| Curve {
        name: study::name(line),
        style: style::of(line.method, line.variant),
        passes: line.method.passes(),
        history: report.history.clone(),
        outcome: report.outcome,
    };
    let curves: Vec<Curve> = histories.iter().map(curve).collect();
    context.figure(
        &stem,
        &convergence(format!("{} under {scheme}", context.caption(subject)), "max error / L", &curves),
    )?;
    Ok(rows)
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use limitlab::assemble::LimitSystem;
    use limitlab::assemble::bounds::SpectralBounds;
    use limitlab::assemble::weights::Point;
    use limitlab::solvers::System;
    use limitlab::solvers::system::Entries;

    use super::*;

    #[test]
    fn every_method_has_a_column() {
        for method in Method::ALL {
            assert!(COLUMNS.iter().any(|column| column.0 == method.name()), "{method}");
        }
    }

    /// A system that counts the rows that are asked of it.
    struct Counted<'a>(&'a LimitSystem, AtomicUsize);

    impl System for Counted<'_> {
        fn len(&self) -> usize {
            self.0.len()
        }

        fn weights(&self) -> &[f64] {
            self.0.weights()
        }

        fn diagonal(&self) -> &[f64] {
            self.0.diagonal()
        }

        fn bounds(&self) -> SpectralBounds {
            self.0.bounds()
        }

        fn stored(&self) -> Option<Entries<'_>> {
            self.0.stored()
        }

        fn row<P: Point>(&self, i: usize, x: &[P]) -> P {
            self.1.fetch_add(1, Ordering::Relaxed);
            self.0.row(i, x)
        }
    }

    #[test]
    fn an_iteration_makes_the_passes_that_are_said() {
        let subject = Subject::built_in("irregular-tri:100").unwrap();
        let system = subject.system(Scheme::Loop).unwrap();
        let rows_of = |method: Method, max_iterations| {
            let counted = Counted(&system, AtomicUsize::new(0));
            let stop = Stop { tolerance: 1e-12, max_iterations };
            let report = solve(&counted, subject.surface.positions(), method, &stop).report;
            assert_eq!(report.iterations, max_iterations, "{method}");
            counted.1.into_inner()
        };
        for method in Method::ALL {
            let Some(passes) = method.passes() else {
                assert!(method.is_direct(), "{method}");
                continue;
            };
            // Solves with a factor ask for no rows.
            let with_factor = usize::from(method == Method::PcgIc0);
            let rows = rows_of(method, 4) - rows_of(method, 3);
            assert_eq!(rows, (passes - with_factor) * system.len(), "{method}");
        }
    }

    #[test]
    fn the_summary_is_that_of_the_table() {
        let subject = Subject::built_in("tetrahedron").unwrap();
        // Numbers without a pattern; every seventh run does not end, chebyshev's proven bound is missing twice.
        let names: Vec<String> = COLUMNS.map(|(m, v)| column_name(m, v)).into_iter().chain([AUTO.into()]).collect();
        let row = |k: usize| {
            let ended = names.iter().enumerate().filter(|(c, _)| !(k < 2 && *c == 11)).map(|(c, name)| {
                let n = (7 * k + 5 * c * c + k * c) % 23 + 1;
                (name.clone(), if n.is_multiple_of(7) { Err(Outcome::MaxIterations) } else { Ok(n) })
            });
            let scheme = [Scheme::Loop, Scheme::Sqrt3][k % 2];
            Row { subject: &subject, scheme, tolerance: 1e-6, ended: ended.collect() }
        };
        let table = table(1e-6, &(0..9).map(row).collect::<Vec<_>>());
        let csv = table.to_csv();
        let lines: Vec<Vec<&str>> = csv.lines().map(|line| line.split(',').collect()).collect();
        let (header, rows) = lines.split_first().unwrap();
        let cost = |row: &[&str], name: &str| -> Option<f64> {
            let text = row[header.iter().position(|h| *h == name).unwrap()];
            (!text.is_empty()).then(|| text.parse().unwrap_or(f64::INFINITY))
        };
        let middle = |mut all: Vec<f64>| {
            all.sort_by(|a, b| a.partial_cmp(b).unwrap());
            let n = all.len();
            let value = if n % 2 == 1 { all[n / 2] } else { (all[n / 2 - 1] + all[n / 2]) / 2.0 };
            if value.is_finite() { value.to_string() } else { "not reached".into() }
        };
        let summary = table.summary.unwrap().to_csv();
        let mut summary = summary.lines();
        let titles = "method,loop,sqrt3,fewest_iterations,passes_an_iteration,median_passes,fewest_passes";
        assert_eq!(summary.next(), Some(titles));
        let iterative: Vec<&String> = names[4..].iter().collect();
        let factor = |name: &str| match name {
            "gauss-seidel" | "sor" | "pcg-ic0" => 2.0,
            "ssor" | "pcg-ssor" => 3.0,
            _ => 1.0,
        };
        for name in &iterative {
            let of =
                |scheme: &str| middle(rows.iter().filter(|r| r[1] == scheme).filter_map(|r| cost(r, name)).collect());
            let best = |among: &[&String], weight: &dyn Fn(&str) -> f64| {
                let wins = |row: &&Vec<&str>| {
                    let least =
                        among.iter().filter_map(|m| Some(cost(row, m)? * weight(m))).fold(f64::INFINITY, f64::min);
                    cost(row, name).is_some_and(|own| own < f64::INFINITY && own * weight(name) == least)
                };
                rows.iter().filter(wins).count()
            };
            let mut expected = format!("{name},{},{},{}", of("loop"), of("sqrt3"), best(&iterative, &|_| 1.0));
            if *name == AUTO {
                expected += ",,,";
            } else {
                let work = middle(rows.iter().filter_map(|r| Some(cost(r, name)? * factor(name))).collect());
                let others = &iterative[..iterative.len() - 1];
                expected += &format!(",{},{work},{}", factor(name), best(others, &factor));
            }
            assert_eq!(summary.next(), Some(expected.as_str()));
        }
        assert_eq!(summary.next(), None);
    }
}
