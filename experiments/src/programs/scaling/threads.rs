//! Parallel speed-up: one thread against all of them, for each method and for STREAM.

use std::time::Instant;

use crate::cli::{Printer, Progress};
use crate::report::{Column, Columns, Provenance};
use limitlab::Result;
use limitlab::assemble::Operator;
use limitlab::error::Error;
use limitlab::mesh::Surface;
use limitlab::mesh::breadth_first::in_fronts;
use limitlab::mesh::colours::in_colours;
use limitlab::schemes::Scheme;
use limitlab::solvers::Method;
use limitlab::solvers::coloured::Coloured;
use limitlab::solvers::system::Rows;
use limitlab::solvers::wavefront::Wavefront;

use super::machine::triad;
use super::{Arguments, CHEBYSHEV, Way, estimate, family, go, noisy};

/// Products or sweeps of one measurement.
const ITERATIONS: usize = 8;

/// The methods that iterate, as far as they use several threads.
const WAYS: [Way; 7] = [
    Way::Auto,
    Way::Plain,
    Way::Free(CHEBYSHEV),
    Way::Free(Method::Cg),
    Way::Waves,
    Way::Colours,
    Way::Stored(CHEBYSHEV),
];

/// Runs `work` on so many threads.
pub fn on_threads<T: Send>(count: usize, work: impl FnOnce() -> T + Send) -> Result<T> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(count)
        .build()
        .map_err(|e| Error::Computation(format!("cannot start {count} threads: {e}")))?;
    Ok(pool.install(work))
}

/// A part of a method's run, on one thread and on all.
struct Row {
    scheme: Scheme,
    name: String,
    method: String,
    part: &'static str,
    seconds: [f64; 2],
    /// Of STREAM's triad.
    bandwidth: [f64; 2],
}

/// Writes the table of quads under Catmull-Clark and triangles under Loop.
pub fn gains(
    arguments: &Arguments,
    all: usize,
    progress: &Progress,
    printer: &mut Printer,
    provenance: &Provenance,
) -> Result<()> {
    let runs = usize::from(arguments.runs).max(2);
    let columns = Columns::<Row>::new()
        .col(Column::key("scheme"), |r| r.scheme.name())
        .col(Column::key("mesh"), |r| r.name.clone())
        .col(Column::key("method"), |r| r.method.clone())
        .col(Column::key("part"), |r| r.part)
        .col(Column::time("seconds_on_one"), |r| r.seconds[0])
        .col(Column::time("seconds_on_all"), |r| r.seconds[1])
        .col(Column::time("gain"), |r| r.seconds[0] / r.seconds[1])
        .col(Column::time("gain_of_triad"), |r| r.bandwidth[1] / r.bandwidth[0]);
    let mut table = columns.table("scaling-threads", format!("One thread beside {all}"), &[]);
    table.note(format!(
        "Good order; the fastest of {runs} runs. Gain: seconds on one thread over seconds on {all}. STREAM's triad \
         is measured with as many threads around each scheme's measurements: what it gains is what memory allows where \
         memory decides. Set-up is topology, order and operator or matrix; products and sweeps are one each."
    ));
    for scheme in [Scheme::CatmullClark, Scheme::Loop] {
        let name = family(scheme, arguments.gains);
        let surface = Surface::new(noisy(&name)?)?;
        let before = [on_threads(1, triad)?, on_threads(all, triad)?];
        let mut seconds = Vec::new();
        let estimate = estimate(scheme)?;
        for way in WAYS {
            progress.message(format!("one thread beside {all}: {name}: {}", way.name()));
            for part in ["whole", "set-up", "solve"] {
                seconds.push((way.name(), part, [f64::INFINITY; 2]));
            }
            let first = seconds.len() - 3;
            for _ in 0..runs {
                for (k, count) in [1, all].into_iter().enumerate() {
                    let parts = on_threads(count, || {
                        let mesh = surface.mesh().clone();
                        let start = Instant::now();
                        let outcome = go(mesh, scheme, way, estimate, arguments.tol)?;
                        let whole = start.elapsed().as_secs_f64();
                        let solve = outcome.map_or(f64::NAN, |o| o.solve_seconds);
                        Ok::<_, Error>([whole, whole - solve, solve])
                    })??;
                    for (row, part) in seconds[first..].iter_mut().zip(parts) {
                        row.2[k] = row.2[k].min(part);
                    }
                }
            }
        }
        progress.message(format!("one thread beside {all}: {name}: products and sweeps"));
        for (k, count) in [1, all].into_iter().enumerate() {
            let single = on_threads(count, || kernels(&surface, scheme, runs))??;
            for (name, time) in single {
                match seconds.iter_mut().find(|row| row.0 == name) {
                    Some(row) => row.2[k] = time,
                    None => seconds.push((name.into(), "once", [time; 2])),
                }
            }
        }
        let after = [on_threads(1, triad)?, on_threads(all, triad)?];
        let bandwidth = [0, 1].map(|k| before[k].max(after[k]));
        table.note(format!(
            "STREAM triad around {scheme}: {:.1} GB/s on one thread, {:.1} GB/s on {all}.",
            bandwidth[0] / 1e9,
            bandwidth[1] / 1e9
        ));
        for (method, part, seconds) in seconds {
            let name = name.clone();
            table.push(columns.row(&Row { scheme, name, method, part, seconds, bandwidth }));
        }
        table.write(&arguments.out, provenance)?;
        progress.step();
    }
    printer.table(&table)
}

/// The building blocks, each with its seconds: products and sweeps in double precision, the operator.
fn kernels(surface: &Surface, scheme: Scheme, runs: usize) -> Result<Vec<(&'static str, f64)>> {
    let fastest = |work: &mut dyn FnMut()| {
        (0..runs).fold(f64::INFINITY, |best, _| {
            let start = Instant::now();
            work();
            best.min(start.elapsed().as_secs_f64())
        })
    };
    let [fronts, colours] = [in_fronts, in_colours].map(|number| number(surface.faces(), surface.incidence()));
    let build = |numbering| Operator::in_order(surface, scheme, Some(numbering));
    let mut built = Ok(());
    let operator = fastest(&mut || built = build(&fronts).map(drop));
    built?;
    let (front, coloured) = (build(&fronts)?, build(&colours)?);
    let points = fronts.there(surface.positions());
    let mut image = points.clone();
    let mut nothing = vec![(); surface.len()];
    let mut rows = Rows::new(surface.len());
    let product = fastest(&mut || {
        for _ in 0..ITERATIONS {
            rows.product(&front, &points, &mut image, &mut nothing, |_, ax, y, (), _| *y = ax);
        }
    });
    let waves = Wavefront::new(&front);
    let in_waves = fastest(&mut || waves.relax(1.0, ITERATIONS, &points, &mut image));
    let points = colours.there(surface.positions());
    let sweeps = Coloured::new(&coloured);
    let by_colours = fastest(&mut || sweeps.relax(1.0, ITERATIONS, &points, &mut image));
    let one = |seconds: f64| seconds / ITERATIONS as f64;
    Ok(vec![
        ("operator in fronts", operator),
        ("product", one(product)),
        ("sweep in waves", one(in_waves)),
        ("sweep by colours", one(by_colours)),
    ])
}
