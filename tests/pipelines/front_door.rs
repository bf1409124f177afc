//! `interpolate` and `Interpolator`: the chain of `auto` against direct solves, on all vertices and on some, in any order
//! inside, once and again.

use std::ops::ControlFlow;

use glam::DVec3;
use limitlab::Result;
use limitlab::assemble::LimitSystem;
use limitlab::interpolate::{Interpolator, Options, Tolerance, interpolate, interpolate_watched, limit_points};
use limitlab::mesh::features::Tags;
use limitlab::mesh::generate::permute_vertices;
use limitlab::mesh::order::Order;
use limitlab::mesh::{Mesh, Surface, builtin};
use limitlab::schemes::Scheme;
use limitlab::solvers::{Method, Outcome, Recorded, Solution, Stop};

use crate::common::meshes::distance;
use crate::common::pipelines::noisy_surface as noisy;

const MESHES: [&str; 5] = ["irregular-poly:300", "irregular-tri:300", "irregular-quad:300", "torus:8x9", "prism:7"];

fn options(method: Option<Method<'static>>) -> Options<'static> {
    Options { method, tolerance: Tolerance::Relative(1e-11), ..Options::default() }
}

fn every_third(n: usize) -> Vec<bool> {
    (0..n).map(|v| v % 3 != 1).collect()
}

/// Calls `visit` for every scheme on every mesh that it suits and is regular on.
fn for_each(visit: impl Fn(&str, &Surface, Scheme)) {
    for name in MESHES {
        let surface = noisy(name);
        for scheme in Scheme::ALL {
            let suits = scheme.first_unsuitable_face(surface.faces()).is_none();
            let regular = scheme != Scheme::MidEdge || surface.faces().uniform_size() == Some(3);
            if suits && regular {
                visit(&format!("{name}, {scheme}"), &surface, scheme);
            }
        }
    }
}

#[test]
fn auto_finds_what_a_factorization_finds() {
    for_each(|what, surface, scheme| {
        let auto = interpolate(surface, scheme, &options(None)).unwrap();
        let direct = interpolate(surface, scheme, &options(Some(Method::Ldlt))).unwrap();
        assert_eq!((auto.report.outcome, direct.report.outcome), (Outcome::Converged, Outcome::Converged), "{what}");
        assert_eq!((auto.method, direct.method), ("chebyshev", "ldlt"));
        let off = distance(&auto.points, &direct.points);
        assert!(off < 1e-8, "{what}: {off:e}");
    });
}

#[test]
fn some_vertices_are_interpolated_and_the_others_stay() {
    for_each(|what, surface, scheme| {
        let marks = every_third(surface.len());
        let some = |method| Options { interpolated: Some(&marks), ..options(method) };
        let auto = interpolate(surface, scheme, &some(None)).unwrap();
        assert_eq!((auto.report.outcome, auto.method), (Outcome::Converged, "chebyshev"), "{what}");
        let direct = interpolate(surface, scheme, &some(Some(Method::Ldlt))).unwrap();
        let off = distance(&auto.points, &direct.points);
        assert!(off < 1e-8, "{what}: {off:e}");
        // The errors are those of the rows in question, the others' control points their points to the last bit.
        let system = LimitSystem::new(surface, scheme).unwrap();
        let points = surface.positions();
        let error = |v: usize| (points[v] - system.a.row_times(v, &auto.points)).length();
        let errors: Vec<f64> = (0..surface.len()).filter(|&v| marks[v]).map(error).collect();
        let last = auto.report.last();
        assert!((last.max - errors.iter().copied().fold(0.0, f64::max)).abs() < 1e-14, "{what}");
        assert!((last.mean - errors.iter().sum::<f64>() / errors.len() as f64).abs() < 1e-14, "{what}");
        assert!((0..surface.len()).all(|v| marks[v] || auto.points[v] == points[v]), "{what}");
    });
    let surface = noisy("torus:8x9");
    let nobody = vec![false; surface.len()];
    let none = Options { interpolated: Some(&nobody), ..options(None) };
    let message = interpolate(&surface, Scheme::Nasri, &none).unwrap_err().to_string();
    assert!(message.contains("name at least one"), "{message}");
}

/// For some vertices the chain solves for a difference, which may be far smaller than the data: their last digits count.
#[test]
fn a_tolerance_below_the_last_digits_ends_the_chain_at_its_first_step() {
    for_each(|what, surface, scheme| {
        let marks = every_third(surface.len());
        for interpolated in [None, Some(&marks[..])] {
            let options = Options { tolerance: Tolerance::Relative(1e-18), interpolated, ..Options::default() };
            let found = interpolate(surface, scheme, &options).unwrap();
            assert_eq!((found.report.outcome, found.method), (Outcome::Rounding, "chebyshev"), "{what}");
            // Differences are of size 1 here and have smaller last digits than the tolerance, the data have larger ones.
            let far = surface.positions().iter().map(|p| *p + DVec3::splat(1000.0)).collect();
            let options = Options { tolerance: Tolerance::Absolute(1e-13), ..options };
            let found = interpolate(&surface.with_positions(far), scheme, &options).unwrap();
            assert_eq!((found.report.outcome, found.method), (Outcome::Rounding, "chebyshev"), "far {what}");
        }
    });
}

/// Prisms with many sides are nearly singular under Catmull-Clark: iterations stand still, a factorization does not.
#[test]
fn the_chain_ends_with_a_factorization() {
    let surface = noisy("prism:401");
    let found = interpolate(&surface, Scheme::CatmullClark, &options(None)).unwrap();
    let tight = Options { tolerance: Tolerance::Relative(1e-13), ..Options::default() };
    let tightest = interpolate(&surface, Scheme::CatmullClark, &tight).unwrap();
    for found in [found, tightest] {
        assert_eq!((found.report.outcome, found.method), (Outcome::Converged, "ldlt"), "{:?}", found.report.last());
    }
    // Singular, and the points have a part that no control mesh reaches: no factorization is tried.
    let surface = noisy("cube");
    let found = interpolate(&surface, Scheme::CatmullClark, &options(None)).unwrap();
    assert_eq!(found.method, "cg");
    assert_ne!(found.report.outcome, Outcome::Converged);
}

/// A run with a watch that goes on until it has seen `most` iterates: what it saw, and what came of it.
fn watched(
    surface: &Surface,
    scheme: Scheme,
    options: &Options,
    most: usize,
) -> (Vec<(&'static str, Recorded)>, Solution) {
    let mut seen = Vec::new();
    let found = interpolate_watched(surface, scheme, options, &mut |method, step| {
        seen.push((method, Recorded { iteration: step.iteration, errors: step.errors }));
        if seen.len() < most { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    });
    (seen, found.unwrap())
}

#[test]
fn a_watch_sees_what_is_recorded_and_changes_nothing() {
    let torus = noisy("torus:8x9");
    let tags = Tags { creases: vec![([0, 1], 10.0)], ..Tags::default() };
    let dart = torus.tagged(&tags).unwrap();
    let marks = every_third(torus.len());
    let some = Options { interpolated: Some(&marks), ..options(None) };
    let cases: [(&str, &Surface, Options, usize, &[&str]); 5] = [
        ("auto", &torus, options(None), 2, &["chebyshev"]),
        ("some vertices", &torus, some, 2, &["chebyshev"]),
        ("a dart", &dart, options(None), 1, &["chebyshev"]),
        ("the whole chain", &noisy("prism:401"), options(None), 2, &["chebyshev", "cg", "ldlt"]),
        ("by name", &dart, options(Some(Method::Pia)), 2, &["pia"]),
    ];
    for (what, surface, options, enough, methods) in cases {
        let scheme = Scheme::CatmullClark;
        let alone = interpolate(surface, scheme, &options).unwrap();
        let (seen, found) = watched(surface, scheme, &options, usize::MAX);
        assert_eq!((&found.points, &found.report), (&alone.points, &alone.report), "{what}");
        let of = |method: &str| -> Vec<Recorded> { seen.iter().filter(|s| s.0 == method).map(|s| s.1).collect() };
        assert_eq!(of(found.method), found.report.history, "{what}");
        let mut names: Vec<&str> = seen.iter().map(|s| s.0).collect();
        names.dedup();
        assert_eq!(names, methods, "{what}");
        assert_eq!(found.report.history.last().map(|last| last.iteration), Some(found.report.iterations), "{what}");
        // Whoever has seen enough gets the iterate that was seen last.
        let (_, stopped) = watched(surface, scheme, &options, enough);
        assert_eq!(stopped.report.outcome, Outcome::Stopped, "{what}");
        assert_eq!(stopped.report.history, of(methods[0])[..enough], "{what}");
        assert_eq!(stopped.report.iterations, stopped.report.history[enough - 1].iteration, "{what}");
    }
}

/// With a dart there are iterations within each step of GMRES: all count.
#[test]
fn the_most_iterations_hold_for_all_at_a_dart() {
    let tags = Tags { creases: vec![([0, 1], 10.0)], ..Tags::default() };
    let dart = noisy("torus:8x9").into_tagged(&tags).unwrap();
    let run = |max_iterations| {
        let options = Options { max_iterations, ..options(None) };
        let found = interpolate(&dart, Scheme::CatmullClark, &options).unwrap();
        let limits = limit_points(&dart.with_positions(found.points), Scheme::CatmullClark).unwrap();
        (found.report, distance(&limits, dart.positions()))
    };
    let tolerance = options(None).stop(dart.positions()).unwrap().tolerance;
    let (free, _) = run(10_000);
    assert!(free.outcome == Outcome::Converged && free.history.len() > 1, "{:?}", free.history);
    for most in 0..free.iterations {
        let (report, error) = run(most);
        // Short of what the block is asked for, the tolerance may be met.
        let outcome = if report.last().max <= tolerance { Outcome::Converged } else { Outcome::MaxIterations };
        assert_eq!((report.outcome, report.iterations), (outcome, most));
        assert!((report.last().max - error).abs() < 1e-13, "{most}: {:e}, {error:e}", report.last().max);
        assert_eq!(report.history.last().map(|last| last.iteration), Some(most));
    }
    assert_eq!(run(free.iterations).0, free);
}

/// So many iterations alone come to the same errors.
#[test]
fn a_history_of_corrections_tells_their_iterations() {
    let surface = noisy("irregular-quad:300");
    let history = interpolate(&surface, Scheme::CatmullClark, &options(None)).unwrap().report.history;
    assert!(history.len() > 2 && history[0].iteration == 0);
    for recorded in history {
        let limited = Options { max_iterations: recorded.iteration, ..options(None) };
        let report = interpolate(&surface, Scheme::CatmullClark, &limited).unwrap().report;
        assert_eq!((report.iterations, report.last()), (recorded.iteration, recorded.errors));
    }
}

/// Above the sizes from which surfaces are renumbered inside, and rows are breadth first.
#[test]
fn the_order_of_the_vertices_does_not_show() -> Result<()> {
    let good = noisy("irregular-poly:60000");
    let order = Order::Random(3).order(good.mesh(), good.incidence());
    let scattered = Surface::new(permute_vertices(good.mesh(), &order))?;
    let marks = every_third(good.len());
    let moved: Vec<bool> = order.iter().map(|&v| marks[v as usize]).collect();
    for (scheme, marks, moved) in
        [(Scheme::CatmullClark, None, None), (Scheme::Nasri, Some(&marks[..]), Some(&moved[..]))]
    {
        let plain = interpolate(&good, scheme, &Options { interpolated: marks, ..options(None) })?;
        let other = interpolate(&scattered, scheme, &Options { interpolated: moved, ..options(None) })?;
        assert_eq!(other.report.outcome, Outcome::Converged);
        let back: Vec<DVec3> = order.iter().map(|&v| plain.points[v as usize]).collect();
        let off = distance(&back, &other.points);
        assert!(off < 1e-8, "{scheme}: {off:e}");
    }
    Ok(())
}

#[test]
fn an_interpolator_goes_on_from_the_control_points_that_are_there() {
    for_each(|what, surface, scheme| {
        let marks = every_third(surface.len());
        for marks in [None, Some(&marks[..])] {
            let mut interpolator = Interpolator::new(surface, scheme, marks).unwrap();
            let stop = Stop { tolerance: 1e-11 * surface.diagonal(), max_iterations: 10_000 };
            let mut control = Vec::new();
            let mut points = surface.positions().to_vec();
            let cold = interpolator.solve(&points, &mut control, &stop);
            let once = Options { interpolated: marks, ..stop.into() };
            let same = interpolate(surface, scheme, &once).unwrap();
            assert_eq!((&control, &cold), (&same.points, &same.report), "{what}");
            // Nothing has moved: nothing is to be done.
            let again = interpolator.solve(&points, &mut control, &stop);
            assert_eq!((again.outcome, again.iterations), (Outcome::Converged, 0), "{what}");
            for step in 0..3 {
                points[2 + 3 * step] += DVec3::new(0.01, -0.02, 0.005);
                let warm = interpolator.solve(&points, &mut control, &stop);
                assert_eq!(warm.outcome, Outcome::Converged, "{what}");
                let fresh = interpolate(&surface.with_positions(points.clone()), scheme, &once).unwrap();
                let off = distance(&control, &fresh.points);
                assert!(off < 1e-8, "{what}: {off:e}");
            }
        }
    });
}

#[test]
fn points_that_are_not_finite_fail_once_and_leave_no_trace() {
    let surface = noisy("irregular-poly:300");
    let stop = Stop { tolerance: 1e-10, max_iterations: 1000 };
    for marks in [None, Some(&every_third(surface.len())[..])] {
        let mut interpolator = Interpolator::new(&surface, Scheme::CatmullClark, marks).unwrap();
        let mut control = Vec::new();
        let mut bad = surface.positions().to_vec();
        bad[6].y = f64::NAN;
        assert_eq!(interpolator.solve(&bad, &mut control, &stop).outcome, Outcome::Diverged);
        bad[6].y = f64::INFINITY;
        assert_eq!(interpolator.solve(&bad, &mut control, &stop).outcome, Outcome::Diverged);
        let report = interpolator.solve(surface.positions(), &mut control, &stop);
        let once = Options { interpolated: marks, ..stop.into() };
        let fresh = interpolate(&surface, Scheme::CatmullClark, &once).unwrap();
        assert_eq!((&report, &control), (&fresh.report, &fresh.points));
    }
}

#[test]
fn what_cannot_be_is_an_error_and_what_fails_is_an_outcome() {
    let flat = Surface::new(Mesh::new(vec![DVec3::ONE; 8], builtin::cube().faces)).unwrap();
    let message = interpolate(&flat, Scheme::Nasri, &Options::default()).unwrap_err().to_string();
    assert!(message.contains("give an absolute one"), "{message}");
    assert!(interpolate(&flat, Scheme::Loop, &Options::default()).is_err());
    let surface = noisy("torus:8x9");
    let few = Options { max_iterations: 3, ..options(Some(Method::Pia)) };
    assert_eq!(interpolate(&surface, Scheme::Nasri, &few).unwrap().report.outcome, Outcome::MaxIterations);
    let few = Options { method: None, ..few };
    assert_eq!(interpolate(&surface, Scheme::Nasri, &few).unwrap().report.outcome, Outcome::MaxIterations);
}
