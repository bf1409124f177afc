//! Spectra, bounds, certificates, singular systems: computations held against closed forms, dense decompositions and
//! each other, on hundreds of meshes.

mod bounds;
mod certificates;
mod ends;
mod hypotheses;
mod iteration_matrices;
mod singular;
mod sweeps;

use limitlab::assemble::LimitSystem;
use limitlab::mesh::{Mesh, Surface, builtin, random};
use limitlab::schemes::Scheme;
use std::f64::consts::TAU;

fn assemble(mesh: &Mesh, scheme: Scheme) -> LimitSystem {
    let surface = Surface::new(mesh.clone()).expect("a closed mesh");
    LimitSystem::new(&surface, scheme).expect("a system")
}

fn named(name: &str) -> Mesh {
    builtin::builtin(name).expect("a built-in mesh")
}

/// All eigenvalues of A on a torus grid, by the symbols.
fn torus_symbols(scheme: Scheme, n: usize, m: usize) -> Vec<f64> {
    let angles = |n: usize| (0..n).map(move |k| TAU * k as f64 / n as f64);
    let mut all: Vec<f64> = angles(n)
        .flat_map(|s| angles(m).map(move |t| (s, t)))
        .map(|(s, t)| match scheme {
            Scheme::CatmullClark => (2.0 + s.cos()) / 3.0 * (2.0 + t.cos()) / 3.0,
            Scheme::Nasri => (3.0 + s.cos()) / 4.0 * (3.0 + t.cos()) / 4.0,
            Scheme::ZhengCai => 0.5 + (1.0 + s.cos()) * (1.0 + t.cos()) / 8.0,
            Scheme::Loop | Scheme::Sqrt3 => 0.5 + (s.cos() + t.cos() + (s + t).cos()) / 6.0,
            Scheme::MidEdge => 0.5 + (s.cos() + t.cos()) / 4.0,
        })
        .collect();
    all.sort_by(f64::total_cmp);
    all
}

fn torus(scheme: Scheme, n: usize, m: usize) -> Mesh {
    if scheme.needs_triangles() { builtin::tri_torus(n, m) } else { builtin::torus(n, m) }
}

/// Meshes of all kinds, small enough for dense eigenvalues.
fn random_systems(count: u64) -> impl Iterator<Item = (String, Surface, Scheme, LimitSystem)> {
    (0..count).flat_map(|seed| {
        let triangles = Surface::new(random::random_triangulation(seed)).expect("a closed mesh");
        let polygons = Surface::new(random::random_polygons(seed)).expect("a closed mesh");
        Scheme::ALL.into_iter().filter_map(move |scheme| {
            let surface = if scheme.needs_triangles() { triangles.clone() } else { polygons.clone() };
            if surface.len() > 260 {
                return None;
            }
            let system = LimitSystem::new(&surface, scheme).expect("a system");
            Some((format!("{scheme}, seed {seed}"), surface, scheme, system))
        })
    })
}
