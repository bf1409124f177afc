//! Assembly, sweeps and methods, beside the libraries that can do the same: `cargo bench --bench systems`.
//!
//! One irregular quad sphere, Catmull-Clark, three right-hand sides. The number of vertices is 100 000 unless the
//! environment variable `LIMITLAB_BENCH_VERTICES` says otherwise.

#![allow(missing_docs, reason = "the functions that criterion's macro writes")]

#[path = "../experiments/src/programs/scaling/baseline.rs"]
mod baseline;

use std::hint::black_box;

use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use faer::Mat;
use faer::sparse::SparseColMat;
use faer::sparse::linalg::matmul::sparse_dense_matmul;
use faer::{Accum, Par};
use glam::DVec3;
use limitlab::assemble::{Csr, LimitSystem, Operator};
use limitlab::interpolate::interpolate;
use limitlab::mesh::breadth_first::in_fronts;
use limitlab::mesh::noise::add_noise;
use limitlab::mesh::{Incidence, Mesh, Surface, Topology, builtin::builtin};
use limitlab::schemes::Scheme;
use limitlab::solvers::chebyshev::{Chebyshev, Recurrence};
use limitlab::solvers::system::{Rows, System};
use limitlab::solvers::wavefront::Wavefront;
use limitlab::solvers::{Method, Stop, mixed, run, solve};
use nalgebra::DMatrix;
use nalgebra_sparse::{CooMatrix, CsrMatrix};

const SCHEME: Scheme = Scheme::CatmullClark;
/// Below the smallest eigenvalue of such meshes.
const INTERVAL: (f64, f64) = (0.07, 1.0);

fn mesh() -> Mesh {
    let n = std::env::var("LIMITLAB_BENCH_VERTICES").ok().and_then(|n| n.parse().ok()).unwrap_or(100_000);
    let mut mesh = builtin(&format!("irregular-quad:{n}")).expect("an even number of vertices");
    add_noise(&mut mesh, 0.1, 1);
    mesh
}

/// (row, column, value) of every stored entry.
fn triplets(a: &Csr) -> Vec<(usize, usize, f64)> {
    (0..a.len()).flat_map(|i| a.row(i).map(move |(j, value)| (i, j, value))).collect()
}

fn assembly(c: &mut Criterion) {
    let surface = Surface::new(mesh()).expect("a closed mesh");
    let (faces, incidence, n) = (surface.faces(), surface.incidence(), surface.len());
    let system = LimitSystem::new(&surface, SCHEME).expect("a system");
    let entries = triplets(&system.a);
    let mut group = c.benchmark_group("assembly");
    group.sample_size(10);
    group.bench_function("incidence", |b| b.iter(|| Incidence::new(faces, n)));
    group.bench_function("topology", |b| b.iter(|| Topology::new(faces, n)));
    group.bench_function("A and M, explicit", |b| {
        b.iter(|| LimitSystem::new(&surface, SCHEME));
    });
    group.bench_function("operator", |b| {
        b.iter(|| Operator::new(&surface, SCHEME));
    });
    group.bench_function("front order", |b| b.iter(|| in_fronts(faces, incidence)));
    let fronts = in_fronts(faces, incidence);
    group.bench_function("operator in front order", |b| {
        b.iter(|| Operator::in_order(&surface, SCHEME, Some(&fronts)));
    });
    // The libraries are given A's entries, summed already: their part is the conversion only.
    group.bench_function("faer, from triplets", |b| {
        let triplets: Vec<_> =
            entries.iter().map(|&(i, j, a)| faer::sparse::Triplet::new(i as u32, j as u32, a)).collect();
        b.iter(|| SparseColMat::<u32, f64>::try_new_from_triplets(n, n, &triplets));
    });
    group.bench_function("sprs, from triplets", |b| {
        b.iter(|| {
            let mut triplets = sprs::TriMatI::<f64, u32>::new((n, n));
            for &(i, j, a) in &entries {
                triplets.add_triplet(i, j, a);
            }
            triplets.to_csr::<u32>()
        });
    });
    group.bench_function("nalgebra-sparse, from triplets", |b| {
        b.iter(|| {
            let mut triplets = CooMatrix::new(n, n);
            for &(i, j, a) in &entries {
                triplets.push(i, j, a);
            }
            CsrMatrix::from(&triplets)
        });
    });
    group.finish();
}

fn product<S: System>(rows: &mut Rows, system: &S, x: &[DVec3], y: &mut [DVec3]) {
    let mut nothing = vec![(); x.len()];
    rows.product(system, x, y, &mut nothing, |_, ax, y, (), _| *y = ax);
}

fn sweep(c: &mut Criterion) {
    let surface = Surface::new(mesh()).expect("a closed mesh");
    let n = surface.len();
    let system = LimitSystem::new(&surface, SCHEME).expect("a system");
    let file = Operator::new(&surface, SCHEME).expect("an operator");
    let fronts = in_fronts(surface.faces(), surface.incidence());
    let front = Operator::in_order(&surface, SCHEME, Some(&fronts));
    let front = front.expect("an operator");
    let x = surface.positions();
    let moved = fronts.there(x);
    let mut y = vec![DVec3::ZERO; n];
    let mut rows = Rows::new(n);
    let mut group = c.benchmark_group("A times three columns");
    group.sample_size(20);
    group.bench_function("stored", |b| b.iter(|| product(&mut rows, &system, x, &mut y)));
    group.bench_function("matrix-free, file order", |b| {
        b.iter(|| product(&mut rows, &file, x, &mut y));
    });
    group.bench_function("matrix-free, front order", |b| {
        b.iter(|| product(&mut rows, &front, &moved, &mut y));
    });

    let entries = triplets(&system.a);
    let columns = |i: usize, axis: usize| x[i][axis];
    let faer_triplets: Vec<_> =
        entries.iter().map(|&(i, j, a)| faer::sparse::Triplet::new(i as u32, j as u32, a)).collect();
    let a = SparseColMat::<u32, f64>::try_new_from_triplets(n, n, &faer_triplets).expect("a matrix");
    let right = Mat::from_fn(n, 3, columns);
    let mut left = Mat::<f64>::zeros(n, 3);
    group.bench_function("faer", |b| {
        b.iter(|| {
            sparse_dense_matmul(left.as_mut(), Accum::Replace, a.as_ref(), right.as_ref(), 1.0, Par::rayon(0));
        });
    });
    let mut triplets = sprs::TriMatI::<f64, u32>::new((n, n));
    let mut coo = CooMatrix::new(n, n);
    for &(i, j, a) in &entries {
        triplets.add_triplet(i, j, a);
        coo.push(i, j, a);
    }
    let a = triplets.to_csr::<u32>();
    let three: [Vec<f64>; 3] = [0, 1, 2].map(|axis| (0..n).map(|i| columns(i, axis)).collect());
    let mut out = vec![0.0; n];
    group.bench_function("sprs, column by column", |b| {
        b.iter(|| {
            for column in &three {
                out.fill(0.0);
                sprs::prod::mul_acc_mat_vec_csr(a.view(), column.as_slice(), out.as_mut_slice());
                black_box(&out);
            }
        });
    });
    let a = CsrMatrix::from(&coo);
    let right = DMatrix::from_fn(n, 3, columns);
    let mut left = DMatrix::zeros(n, 3);
    group.bench_function("nalgebra-sparse", |b| {
        use nalgebra_sparse::ops::{Op, serial::spmm_csr_dense};
        b.iter(|| spmm_csr_dense(0.0, &mut left, 1.0, Op::NoOp(&a), Op::NoOp(&right)));
    });
    group.finish();
}

fn methods(c: &mut Criterion) {
    let surface = Surface::new(mesh()).expect("a closed mesh");
    let points = surface.positions();
    let system = LimitSystem::new(&surface, SCHEME).expect("a system");
    let fronts = in_fronts(surface.faces(), surface.incidence());
    let front = Operator::in_order(&surface, SCHEME, Some(&fronts));
    let front = front.expect("an operator");
    let moved = fronts.there(points);
    let stop = Stop { tolerance: 1e-10 * surface.diagonal(), max_iterations: 1000 };
    let mut group = c.benchmark_group("solve to 1e-10");
    group.sample_size(10);
    group.bench_function("auto, from faces to control points", |b| {
        let solved = |mesh| interpolate(&Surface::new(mesh).expect("a closed mesh"), SCHEME, &stop.into());
        b.iter_batched(|| surface.mesh().clone(), solved, BatchSize::LargeInput);
    });
    group.bench_function("mixed precision", |b| {
        b.iter(|| mixed::solve(&front, &moved, &stop));
    });
    let plain = baseline::Plain::new(surface.mesh(), SCHEME).expect("quads only");
    group.bench_function("plain index-only chebyshev", |b| {
        b.iter(|| plain.chebyshev(points, INTERVAL, stop.tolerance, stop.max_iterations));
    });
    group.bench_function("matrix-free chebyshev, fused, double", |b| {
        b.iter(|| {
            let mut method = Chebyshev::new(&front, &moved, INTERVAL);
            solve(&mut method, &stop, &mut |_| std::ops::ControlFlow::Continue(()))
        });
    });
    let singles: Vec<glam::Vec3A> = moved.iter().map(|p| p.as_vec3a()).collect();
    let mut current = singles.clone();
    let wavefront = Wavefront::new(&front);
    let mut scratch = wavefront.scratch();
    group.bench_function("16 iterations in single precision, in groups", |b| {
        b.iter(|| {
            let recurrence = Recurrence::new(INTERVAL);
            wavefront.iterate(recurrence, 17, &singles, &mut current, &mut scratch);
        });
    });
    let methods = [
        ("stored, chebyshev", Method::Chebyshev { interval: Some(INTERVAL) }),
        ("stored, pia", Method::Pia),
        ("stored, thall", Method::Thall),
        ("stored, gauss-seidel", Method::GaussSeidel { order: None }),
        ("stored, sor", Method::Sor { omega: 1.1, order: None }),
        ("stored, ssor", Method::Ssor { omega: 1.0, order: None }),
        ("stored, cg", Method::Cg),
        ("stored, pcg-jacobi", Method::PcgJacobi),
        ("stored, pcg-ssor", Method::PcgSsor { omega: 1.0 }),
        ("stored, pcg-ic0", Method::PcgIc0),
        ("faer, cholesky", Method::Cholesky),
    ];
    for (name, method) in methods {
        group.bench_function(name, |b| b.iter(|| run(&system, points, method, &stop)));
    }
    group.finish();
}

criterion_group!(benches, assembly, sweep, methods);
criterion_main!(benches);
