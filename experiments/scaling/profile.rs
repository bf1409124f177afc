//! Bytes and flops of one sweep, against the bandwidth measured in the same run.

use std::time::Instant;

use glam::{DVec3, Vec3A};
use limitlab::Result;
use limitlab::assemble::{LimitSystem, Operator, Scheme};
use limitlab::mesh::order::in_fronts;
use limitlab::mesh::{Mesh, Topology};
use limitlab::report::{Column, Table};
use limitlab::solvers::chebyshev::{Chebyshev, Recurrence};
use limitlab::solvers::iteration::Iterate;
use limitlab::solvers::system::{Rows, System};
use limitlab::solvers::wavefront::Wavefront;

use crate::baseline::Plain;
use crate::machine::triad;

/// Iterations of one measurement, and measurements of which the best counts.
const ITERATIONS: usize = 17;
const RUNS: usize = 5;

/// The table of one mesh: Chebyshev iterations, error norm included where the method takes it.
pub fn profile(name: &str, mesh: &Mesh, scheme: Scheme, threads: usize) -> Result<Table> {
    let n = mesh.len() as f64;
    let points = &mesh.positions;
    let topology = Topology::new(&mesh.faces, mesh.len());
    let explicit = LimitSystem::new(mesh, &topology, scheme)?;
    let free = Operator::new(&mesh.faces, &topology, scheme)?;
    let fronts = in_fronts(&mesh.faces, &topology.incidence);
    let front = Operator::in_order(&mesh.faces, &topology, scheme, Some(&fronts))?;
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
    let mut table = Table::new(
        "scaling-profile",
        format!("One Chebyshev iteration on {name} under {scheme}, {threads} threads"),
        vec![
            Column::key("kernel"),
            Column::number("bytes_per_vertex", 0.0, 4),
            Column::number("flops_per_vertex", 0.0, 4),
            Column::time("nanoseconds_per_vertex"),
            Column::time("gigabytes_per_second"),
            Column::time("share_of_triad"),
        ],
    );
    table.note(format!(
        "{} vertices. Bytes are those that must pass between memory and processor if every array is read once; STREAM's \
         triad moves {:.1} GB/s in this run. A share above 1 says that iterations share a pass over memory.",
        mesh.len(),
        bandwidth / 1e9
    ));
    let mut push = |kernel: &str, bytes: f64, flops: f64, seconds: f64| {
        let rate = bytes * n / seconds;
        table.push(vec![
            kernel.into(),
            bytes.into(),
            flops.into(),
            (1e9 * seconds / n).into(),
            (1e-9 * rate).into(),
            (rate / bandwidth).into(),
        ]);
    };
    if let Some(plain) = Plain::new(mesh, scheme) {
        let seconds = best(|| plain.chebyshev(points, (0.1, 1.0), 0.0, ITERATIONS).1);
        // Product (2), residual (3), norm (1), step (3), update (3 arrays).
        let neighbours = free.entries() as f64 / n;
        push(
            "plain: index-only, double, one pass an operation",
            12.0 * 24.0 + 4.0 * neighbours + 4.0,
            free_flops,
            seconds,
        );
    }
    push(
        "stored matrix, fused, double",
        double + 12.0 * entries + 4.0,
        stored_flops,
        iterations(&explicit, points),
    );
    push(
        "matrix-free, fused, double, file order",
        double + index(&free),
        free_flops,
        iterations(&free, points),
    );
    push(
        "matrix-free, fused, double, front order",
        double + index(&front),
        free_flops,
        iterations(&front, &moved),
    );
    let mut rows = Rows::new(mesh.len());
    let mut image = moved.clone();
    let mut nothing = vec![(); mesh.len()];
    push(
        "matrix-free, double, front order, product alone",
        2.0 * 24.0 + index(&front),
        free_flops - 21.0,
        best(|| {
            for _ in 0..ITERATIONS {
                let image = &mut image;
                rows.product(&front, &moved, image, &mut nothing, |_, ax, y, (), _| {
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
    push(
        "matrix-free, single, one by one",
        single + index(&front),
        without_norm,
        waves(&alone, &singles),
    );
    push(
        "matrix-free, double, in groups",
        double + index(&front),
        without_norm,
        waves(&grouped, &moved),
    );
    push(
        "matrix-free, single, in groups",
        single + index(&front),
        without_norm,
        waves(&grouped, &singles),
    );
    Ok(table)
}

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

fn waves<P: limitlab::assemble::stencil::Point>(wavefront: &Wavefront, r: &[P]) -> f64 {
    let recurrence = Recurrence::new((0.1, 1.0));
    let mut x = r.to_vec();
    let mut other = r.to_vec();
    best(|| {
        rayon::scope(|_| wavefront.iterate(recurrence, ITERATIONS, r, &mut x, &mut other));
        ITERATIONS - 1
    })
}
