//! What `Interpolator` allocates for further points: histories and coefficients, no array of N points. A program of its own,
//! as its allocator counts for the whole process.

use glam::DVec3;
use limitlab::interpolate::Interpolator;
use limitlab::mesh::generate::permute_vertices;
use limitlab::mesh::noise::move_vertices;
use limitlab::mesh::order::Order;
use limitlab::mesh::{Surface, builtin};
use limitlab::schemes::Scheme;
use limitlab::solvers::{Outcome, Stop};
use peak_alloc::PeakAlloc;

#[global_allocator]
static HEAP: PeakAlloc = PeakAlloc;

/// Bytes that a run may take for each of its iterations and corrections, whatever N is.
const AN_ITERATION: usize = 400;

fn main() -> limitlab::Result<()> {
    // In file order, with rows grouped; scattered, so that it is renumbered inside; in breadth-first rows.
    for (name, scheme) in [
        ("irregular-quad:20000", Scheme::CatmullClark),
        ("irregular-poly:20000", Scheme::Nasri),
        ("icosphere:5", Scheme::Loop),
        ("torus:256x256", Scheme::CatmullClark),
        ("quad-sphere:8", Scheme::CatmullClark),
    ] {
        let mesh = builtin::builtin(name)?;
        for random in [false, true] {
            let mut surface = Surface::new(mesh.clone())?;
            if random {
                let order = Order::Random(1).order(&mesh, surface.incidence());
                surface = Surface::new(permute_vertices(&mesh, &order))?;
            }
            move_vertices(&mut surface, 0.1, 1);
            let marks: Vec<bool> = (0..surface.len()).map(|v| v % 5 != 0).collect();
            for marks in [None, Some(&marks[..])] {
                further_points(name, &surface, scheme, marks)?;
            }
        }
    }
    println!("allocations: ok");
    Ok(())
}

fn further_points(name: &str, surface: &Surface, scheme: Scheme, marks: Option<&[bool]>) -> limitlab::Result<()> {
    let stop = Stop { tolerance: 1e-10 * surface.diagonal(), max_iterations: 10_000 };
    let mut interpolator = Interpolator::new(surface, scheme, marks)?;
    let (mut points, mut control) = (surface.positions().to_vec(), Vec::new());
    // The second time what only a start from control points needs is there too.
    for _ in 0..2 {
        points.iter_mut().step_by(7).for_each(|p| *p += DVec3::new(1e-3, 0.0, 2e-3));
        interpolator.solve(&points, &mut control, &stop);
    }
    for _ in 0..3 {
        points.iter_mut().step_by(3).for_each(|p| *p *= 1.01);
        HEAP.reset_peak_usage();
        let before = HEAP.current_usage();
        let report = interpolator.solve(&points, &mut control, &stop);
        let taken = HEAP.peak_usage() - before;
        assert_eq!(report.outcome, Outcome::Converged, "{name}");
        assert!(report.iterations > 0, "{name}");
        let allowed = AN_ITERATION * (report.iterations + 10);
        assert!(taken <= allowed, "{name}, {} vertices: {taken} bytes, {allowed} allowed", surface.len());
        assert!(allowed < 12 * surface.len(), "{name}: no array of N points fits into {allowed} bytes");
    }
    Ok(())
}
