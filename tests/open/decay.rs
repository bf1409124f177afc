//! Decay of the inverse of A along closed creases, away from them, and across them.

use glam::DVec3;
use limitlab::assemble::Stages;
use limitlab::interpolate::staged;
use limitlab::mesh::Surface;
use limitlab::mesh::features::Tags;
use limitlab::schemes::Scheme;
use limitlab::solvers::{Method, Stop};
use limitlab_factorizations::dense::small_lu;
use nalgebra::{DMatrix, DVector};

use crate::common::meshes::built_in;

const SIZE: usize = 16;

fn at(i: usize, j: usize) -> usize {
    i % SIZE * SIZE + j % SIZE
}

/// A torus with two closed creases.
fn creased(scheme: Scheme) -> Stages {
    let name = if scheme.needs_triangles() { "tri-torus:16x16" } else { "torus:16x16" };
    let crease = |j: usize| (0..SIZE).map(move |i| ([at(i, j) as u32, at(i + 1, j) as u32], 10.0));
    let tags = Tags { creases: crease(0).chain(crease(SIZE / 2)).collect(), ..Tags::default() };
    Stages::new(&Surface::new(built_in(name)).unwrap().tagged(&tags).unwrap(), scheme, None).unwrap()
}

/// A column of the inverse by stages, and by elimination on the whole matrix.
fn columns(stages: &Stages, vertex: usize) -> [Vec<f64>; 2] {
    let n = stages.len();
    let mut points = vec![DVec3::ZERO; n];
    points[vertex] = DVec3::X;
    let stop = Stop { tolerance: 1e-15, max_iterations: 2 };
    let found = staged::run(stages, &points, Method::Cholesky, &stop).points.iter().map(|v| v.x).collect();
    let matrix = stages.matrix();
    let dense = small_lu(DMatrix::from_fn(n, n, |i, j| matrix.get(i, j)));
    let right = DVector::from_fn(n, |i, _| if i == vertex { 1.0 } else { 0.0 });
    [found, dense.solve(&right).unwrap().as_slice().to_vec()]
}

#[test]
fn creases_carry_changes_along_and_are_walls_across() {
    for scheme in Scheme::ALL {
        let stages = creased(scheme);
        let ratio = match scheme {
            Scheme::CatmullClark | Scheme::Loop | Scheme::Sqrt3 => 2.0 - 3f64.sqrt(),
            Scheme::Nasri | Scheme::ZhengCai | Scheme::MidEdge => 3.0 - 2.0 * 2f64.sqrt(),
        };
        let [found, dense] = columns(&stages, at(3, 0));
        for (v, (a, b)) in found.iter().zip(&dense).enumerate() {
            assert!((a - b).abs() < 1e-13, "{scheme}, vertex {v}: {a} for {b}");
        }
        for k in 0..5 {
            let [here, next] = [found[at(3 + k, 0)], found[at(4 + k, 0)]];
            assert!((next / here + ratio).abs() < 1e-3 * ratio, "{scheme}, {k}: {}", next / here);
        }
        assert!((found[at(4, 0)] / found[at(3, 0)] + ratio).abs() < 1e-8);
        // The same both ways round, past the vertex at which the curve is begun.
        for k in 1..SIZE / 2 {
            let [a, b] = [found[at(3 + k, 0)], found[at(3 + SIZE - k, 0)]];
            assert!((a - b).abs() < 1e-14, "{scheme}, {k}: {a} and {b}");
        }
        // The other crease knows nothing of it.
        assert!((0..SIZE).all(|i| found[at(i, SIZE / 2)] == 0.0));
        // Under Catmull-Clark a product: along the crease, and away from it.
        if scheme == Scheme::CatmullClark {
            for i in 0..5 {
                for j in 0..4 {
                    let expected = found[at(3 + i, 0)] * (-ratio).powi(j as i32);
                    assert!((found[at(3 + i, j)] - expected).abs() < 1e-4 * expected.abs(), "{i}, {j}");
                }
            }
        }
        // A smooth point moves neither curves nor the other side.
        let [found, dense] = columns(&stages, at(5, 2));
        for (v, (a, b)) in found.iter().zip(&dense).enumerate() {
            assert!((a - b).abs() < 1e-13, "{scheme}, vertex {v}");
            let same_side = (1..SIZE / 2).contains(&(v % SIZE));
            assert!(same_side || *a == 0.0, "{scheme}, vertex {v}: {a}");
        }
        assert!(found[at(5, 2)] > 1.0 && found[at(5, 1)].abs() > 1e-3);
    }
}
