//! Spectra of open meshes in closed form: of the stages, and of the whole matrix, which is not symmetric.

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use limitlab::analysis::dense;
use limitlab::assemble::Stages;
use limitlab::mesh::generate::{disc, triangle};
use limitlab::mesh::validate::Boundary;
use limitlab::mesh::{Faces, Mesh, Surface};
use limitlab::schemes::Scheme;
use limitlab_factorizations::dense::small_eigenvalues;
use nalgebra::DMatrix;

use super::{grid, open};

/// Of the curves: T(φ).
fn curve(scheme: Scheme, angle: f64) -> f64 {
    1.0 - 2.0 * scheme.curve_weight() * (1.0 - angle.cos())
}

fn cycle(scheme: Scheme, k: usize) -> impl Iterator<Item = f64> {
    (0..k).map(move |j| curve(scheme, TAU * j as f64 / k as f64))
}

/// The symbol of a scheme of polygons on regular quads.
fn symbol(scheme: Scheme, theta: f64, phi: f64) -> f64 {
    let [a, b] = [theta.cos(), phi.cos()];
    match scheme {
        Scheme::CatmullClark => (2.0 + a) / 3.0 * (2.0 + b) / 3.0,
        Scheme::Nasri => (3.0 + a) / 4.0 * (3.0 + b) / 4.0,
        Scheme::ZhengCai => 0.5 + 0.125 * (1.0 + a) * (1.0 + b),
        Scheme::MidEdge => 0.5 + 0.25 * (a + b),
        Scheme::Loop | Scheme::Sqrt3 => panic!("triangles"),
    }
}

/// `defect` is what rounding does to eigenvalues of the whole matrix: more where it cannot be diagonalised.
fn hold(surface: &Surface, scheme: Scheme, mut expected: Vec<f64>, defect: f64) {
    let n = surface.len();
    let stages = Stages::new(surface, scheme, None).unwrap();
    let mut found = stages.curves().eigenvalues();
    if !stages.block().is_empty() {
        found.extend(dense::eigenvalues(stages.block()).unwrap().a);
    }
    found.resize(n, 1.0);
    let matrix = stages.matrix();
    let whole = DMatrix::from_fn(n, n, |i, j| matrix.get(i, j));
    let schur = small_eigenvalues(whole, 1e-14, 10_000).unwrap();
    let mut schur: Vec<f64> = schur.iter().map(|x| x.re).collect();
    for list in [&mut found, &mut expected, &mut schur] {
        list.sort_unstable_by(f64::total_cmp);
    }
    assert_eq!(expected.len(), n, "{scheme}");
    for (k, &value) in expected.iter().enumerate() {
        let [stages, whole] = [found[k], schur[k]].map(|x| (x - value).abs());
        assert!(stages <= 1e-12, "{scheme}: {value} of {n}, by stages {stages:e} off");
        assert!(whole <= defect, "{scheme}: {value} of {n}, of the whole {whole:e} off");
    }
}

const POLYGONS: [Scheme; 4] = [Scheme::CatmullClark, Scheme::Nasri, Scheme::ZhengCai, Scheme::MidEdge];

#[test]
fn grids() {
    let angles = |p: usize| (1..p - 1).map(move |i| PI * i as f64 / (p - 1) as f64);
    for (p, q) in [(4, 5), (3, 3), (7, 4)] {
        for scheme in POLYGONS {
            let inner: Vec<f64> =
                angles(p).flat_map(|theta| angles(q).map(move |phi| symbol(scheme, theta, phi))).collect();
            let sides = [p, p, q, q].into_iter().flat_map(|k| angles(k).map(|angle| curve(scheme, angle)));
            let corners = [1.0; 4].into_iter().chain(sides);
            let all = inner.iter().copied().chain(corners).collect();
            hold(&open(grid(p, q, false), Boundary::EdgeAndCorner), scheme, all, 1e-7);
            let all = inner.iter().copied().chain(cycle(scheme, 2 * (p + q) - 4)).collect();
            hold(&open(grid(p, q, false), Boundary::EdgeOnly), scheme, all, 1e-7);
        }
    }
}

#[test]
fn bands() {
    let (p, q) = (5, 6);
    let mut faces = Faces::default();
    for i in 0..p - 1 {
        for j in 0..q {
            let at = |i: u32, j: u32| i * q + j % q;
            faces.push(&[at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
    }
    let points = (0..p * q).map(|k| DVec3::new((k % q) as f64, (k / q) as f64, (k % 3) as f64)).collect();
    let surface = open(Mesh::new(points, faces), Boundary::EdgeAndCorner);
    for scheme in POLYGONS {
        let rows = (1..p - 1).map(|i| PI * f64::from(i) / f64::from(p - 1));
        let inner =
            rows.flat_map(|theta| (0..q).map(move |k| symbol(scheme, theta, TAU * f64::from(k) / f64::from(q))));
        let rims = cycle(scheme, q as usize).chain(cycle(scheme, q as usize));
        hold(&surface, scheme, inner.chain(rims).collect(), 1e-7);
    }
}

#[test]
fn fans_and_discs() {
    for n in [3, 4, 5, 6, 9, 20] {
        let x = n as f64;
        let cosine = (TAU / x).cos();
        let part = 0.625 - (0.375 + 0.25 * cosine).powi(2);
        // The neighbours together have part/(part + 3/8) of the limit.
        let by_loop = 0.375 / (0.375 + part);
        let by_sqrt3 = 1.0 / (1.0 + 3.0 * (4.0 - 2.0 * cosine) / 9.0);
        for (scheme, own) in [(Scheme::Loop, by_loop), (Scheme::Sqrt3, by_sqrt3)] {
            let all = std::iter::once(own).chain(cycle(scheme, n)).collect();
            hold(&open(disc(n, 3), Boundary::EdgeOnly), scheme, all, 1e-7);
        }
        let all = std::iter::once(x / (x + 5.0)).chain(cycle(Scheme::CatmullClark, 2 * n)).collect();
        hold(&open(disc(n, 4), Boundary::EdgeOnly), Scheme::CatmullClark, all, 1e-7);
    }
}

/// Of side 7, the block and the curve share an eigenvalue, and the whole matrix has a Jordan block there: its eigenvalues by
/// rounding are off like √ε.
#[test]
fn triangles() {
    for m in [2, 3, 4, 7, 10] {
        let t = TAU / (3 * m) as f64;
        let inner = (1..m).flat_map(|a| (1..m - a).map(move |b| (a as f64, b as f64)));
        let inner = inner
            .map(|(a, b)| 0.5 + ((t * (2.0 * a + b)).cos() + (t * (a + 2.0 * b)).cos() + (t * (a - b)).cos()) / 6.0);
        let inner: Vec<f64> = inner.collect();
        let surface = open(triangle(m), Boundary::EdgeOnly);
        for scheme in [Scheme::Loop, Scheme::Sqrt3] {
            hold(&surface, scheme, inner.iter().copied().chain(cycle(scheme, 3 * m)).collect(), 1e-6);
        }
    }
}
