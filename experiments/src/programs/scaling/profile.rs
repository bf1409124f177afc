//! Bytes and flops of one iteration, against the bandwidth measured in the same run, on one thread and on all.

use std::time::Instant;

use crate::report::{Column, Columns, Table};
use glam::{DVec3, Vec3A};
use limitlab::Result;
use limitlab::assemble::{LimitSystem, Operator};
use limitlab::mesh::breadth_first::in_fronts;
use limitlab::mesh::colours::in_colours;
use limitlab::mesh::{Mesh, Surface};
use limitlab::schemes::Scheme;
use limitlab::solvers::chebyshev::{Chebyshev, Recurrence};
use limitlab::solvers::coloured::Coloured;
use limitlab::solvers::iteration::Iterate;
use limitlab::solvers::system::{Rows, System};
use limitlab::solvers::wavefront::Wavefront;

use crate::programs::scaling::baseline::Plain;
use crate::programs::scaling::machine::triad;
use crate::programs::scaling::threads::on_threads;

/// Iterations of one measurement, and measurements of which the best counts.
const ITERATIONS: usize = 17;
const RUNS: usize = 5;

/// One iteration of a kernel; bytes and flops are those of a vertex.
struct Row {
    kernel: &'static str,
    threads: usize,
    bytes: f64,
    flops: f64,
    seconds: f64,
    /// Of STREAM's triad, in bytes a second.
    bandwidth: f64,
}

/// The table of one mesh on one thread and on all: Chebyshev iterations, error norm included where the method takes it,
/// and sweeps of Gauss-Seidel.
pub fn profile(name: &str, mesh: &Mesh, scheme: Scheme, all: usize) -> Result<Table> {
    let n = mesh.len() as f64;
    let columns = Columns::<Row>::new()
        .col(Column::key("kernel"), |r| r.kernel)
        .col(Column::key("threads"), |r| r.threads.to_string())
        .col(Column::number("bytes_per_vertex", 0.0, 4), |r| r.bytes)
        .col(Column::number("flops_per_vertex", 0.0, 4), |r| r.flops)
        .col(Column::time("nanoseconds_per_vertex"), |r| 1e9 * r.seconds / n)
        .col(Column::time("gigabytes_per_second"), |r| 1e-9 * (r.bytes * n / r.seconds))
        .col(Column::time("share_of_triad"), |r| r.bytes * n / r.seconds / r.bandwidth);
    let mut threads = vec![1, all];
    threads.dedup();
    let (mut rows, mut triads) = (Vec::new(), Vec::new());
    for count in threads {
        let bandwidth = on_threads(count, || kernels(mesh, scheme, &mut rows))??;
        triads.push(format!("{:.1} GB/s on {count}", bandwidth / 1e9));
    }
    let mut table = columns.table("scaling-profile", format!("One iteration on {name} under {scheme}"), &rows);
    table.note(format!(
        "{} vertices. Bytes are those that must pass between memory and processor if every array is read once; STREAM's \
         triad moves {} threads in this run. A share above 1 says that iterations share a pass over memory.",
        mesh.len(),
        triads.join(", ")
    ));
    Ok(table)
}

/// The rows of the threads that this runs on, and the bandwidth of STREAM's triad.
fn kernels(mesh: &Mesh, scheme: Scheme, rows: &mut Vec<Row>) -> Result<f64> {
    let threads = rayon::current_num_threads();
    let n = mesh.len() as f64;
    let points = &mesh.positions;
    let surface = Surface::new(mesh.clone())?;
    let explicit = LimitSystem::new(&surface, scheme)?;
    let free = Operator::new(&surface, scheme)?;
    let fronts = in_fronts(&mesh.faces, surface.incidence());
    let front = Operator::in_order(&surface, scheme, Some(&fronts))?;
    let moved = fronts.there(points);
    let bandwidth = triad();
    let entries = explicit.m.values().len() as f64 / n;
    // A multiplication and an addition for each of three coordinates; without stored weights one addition a
    // neighbour and a multiplication a kind of neighbour. The update: 5 operations a coordinate, the norm 2.
    let stored_flops = 3.0 * (2.0 * entries + 7.0);
    let free_flops = 3.0 * (free.entries() as f64 / n + 5.0 + 7.0);
    // Point arrays: the iterate, the one before (read and written), the right-hand side.
    let double = 4.0 * 24.0;
    let single = 4.0 * 16.0;
    let index = |operator: &Operator| operator.sweep_bytes() as f64 / n;
    let mut push = |kernel, bytes, flops, seconds| {
        rows.push(Row { kernel, threads, bytes, flops, seconds, bandwidth });
    };
    if let Some(plain) = Plain::new(mesh, scheme) {
        let seconds = best(|| plain.chebyshev(points, (0.1, 1.0), 0.0, ITERATIONS).1);
        let neighbours = free.entries() as f64 / n;
        push("yardstick: index-only, fused, double", double + 4.0 * neighbours + 4.0, free_flops, seconds);
    }
    push("stored matrix, fused, double", double + 12.0 * entries + 4.0, stored_flops, iterations(&explicit, points));
    push("matrix-free, fused, double, file order", double + index(&free), free_flops, iterations(&free, points));
    push("matrix-free, fused, double, front order", double + index(&front), free_flops, iterations(&front, &moved));
    let mut products = Rows::new(mesh.len());
    let mut image = moved.clone();
    let mut nothing = vec![(); mesh.len()];
    push(
        "matrix-free, double, front order, product alone",
        2.0 * 24.0 + index(&front),
        free_flops - 21.0,
        best(|| {
            for _ in 0..ITERATIONS {
                let image = &mut image;
                products.product(&front, &moved, image, &mut nothing, |_, ax, y, (), _| {
                    *y = ax;
                });
            }
            ITERATIONS
        }),
    );
    let singles: Vec<Vec3A> = moved.iter().map(|p| p.as_vec3a()).collect();
    let alone = Wavefront::in_bands(&front, None);
    let grouped = Wavefront::new(&front);
    let without_norm = free_flops - 6.0;
    push("matrix-free, single, one by one", single + index(&front), without_norm, waves(&alone, &singles));
    push("matrix-free, double, in groups", double + index(&front), without_norm, waves(&grouped, &moved));
    push("matrix-free, single, in groups", single + index(&front), without_norm, waves(&grouped, &singles));
    // The iterate is read and written, the points and the diagonal are read; no norm, no momentum.
    let sweep = 3.0 * 24.0 + 8.0;
    let sweep_flops = free_flops - 12.0;
    let mut sweeps = |kernel: &'static str, operator: &Operator, p: &[DVec3], relax: Relax| {
        let mut x = p.to_vec();
        let seconds = best(|| {
            relax(ITERATIONS, p, &mut x);
            ITERATIONS
        });
        push(kernel, sweep + index(operator), sweep_flops, seconds);
    };
    sweeps("Gauss-Seidel, front order, one by one", &front, &moved, &|k, p, x| alone.relax(1.0, k, p, x));
    sweeps("Gauss-Seidel, front order, in waves", &front, &moved, &|k, p, x| grouped.relax(1.0, k, p, x));
    let colours = in_colours(&mesh.faces, surface.incidence());
    let operator = Operator::in_order(&surface, scheme, Some(&colours))?;
    let coloured = Coloured::new(&operator);
    sweeps("Gauss-Seidel, by colours", &operator, &colours.there(points), &|k, p, x| coloured.relax(1.0, k, p, x));
    Ok(bandwidth)
}

/// Sweeps, so many, for given points.
type Relax<'a> = &'a dyn Fn(usize, &[DVec3], &mut [DVec3]);

/// Seconds of an iteration: the best of several runs.
fn best(mut run: impl FnMut() -> usize) -> f64 {
    (0..RUNS)
        .map(|_| {
            let start = Instant::now();
            let count = run();
            start.elapsed().as_secs_f64() / count as f64
        })
        .fold(f64::INFINITY, f64::min)
}

fn iterations<S: System>(system: &S, points: &[DVec3]) -> f64 {
    let mut method = Chebyshev::new(system, points, (0.1, 1.0));
    best(|| {
        for _ in 0..ITERATIONS {
            method.errors();
            // The recurrence of Chebyshev iterations does not break down.
            let _ = method.advance();
        }
        ITERATIONS
    })
}

fn waves<P: limitlab::assemble::weights::Point>(wavefront: &Wavefront, r: &[P]) -> f64 {
    let recurrence = Recurrence::new((0.1, 1.0));
    let mut x = r.to_vec();
    let mut scratch = wavefront.scratch();
    best(|| {
        rayon::scope(|_| wavefront.iterate(recurrence, ITERATIONS, r, &mut x, &mut scratch));
        ITERATIONS - 1
    })
}
