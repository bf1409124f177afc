//! The matrix-free operator and everything fast that is built on it, held against the explicit matrix: all schemes;
//! regular, irregular, mixed, large-faced, multi-component and open meshes.

use std::ops::ControlFlow;

use glam::{DVec3, Vec3A};
use limitlab::assemble::{LimitSystem, Operator};
use limitlab::interpolate::{Options, interpolate, interpolate_watched};
use limitlab::mesh::breadth_first::in_fronts;
use limitlab::mesh::colours::in_colours;
use limitlab::mesh::generate::{dual, permute_vertices, shuffle_faces, union};
use limitlab::mesh::order::{Numbering, Order, colouring};
use limitlab::mesh::random::random_polygons;
use limitlab::mesh::space_filling::{along_curve, is_scattered};
use limitlab::mesh::validate::Boundary;
use limitlab::mesh::{Faces, Incidence, Mesh, Surface, builtin::builtin, noise::add_noise};
use limitlab::schemes::Scheme;
use limitlab::solvers::chebyshev::{Recurrence, promised_iterations};
use limitlab::solvers::coloured::Coloured;
use limitlab::solvers::gauss_seidel::{Sor, by_colours, by_colours_watched, in_waves};
use limitlab::solvers::iteration::Iterate;
use limitlab::solvers::local_update::{Editor, decay};
use limitlab::solvers::system::{Rows, System};
use limitlab::solvers::wavefront::Wavefront;
use limitlab::solvers::{Method, Outcome, Recorded, Step, Stop, mixed, run, solve};

fn mesh(name: &str) -> Mesh {
    let mut mesh = builtin(name).expect("a built-in mesh");
    add_noise(&mut mesh, 0.1, 1);
    mesh
}

fn surface(name: &str) -> Surface {
    Surface::new(mesh(name)).expect("a closed mesh")
}

/// A disc of 9 triangles.
fn open() -> Surface {
    let fan = [[0u32, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]];
    let strip = [[2, 1, 6], [2, 6, 3], [3, 6, 7], [3, 7, 4], [5, 4, 7]];
    let mesh = Mesh::new(rough(8), Faces::from_lists(fan.iter().chain(&strip)));
    Surface::examined(mesh, None, Boundary::AsInterior).expect("an open mesh")
}

/// Every kind of closed mesh: each face kind alone and mixed, faces of up to 300 corners, several components.
fn surfaces() -> impl Iterator<Item = (String, Surface)> {
    let mut meshes: Vec<(String, Mesh)> = [
        "tetrahedron",
        "cube",
        "torus:5x4",
        "quad-sphere:3",
        "icosphere:2",
        "prism:5",
        "prism:8",
        "prism:9",
        "prism:300",
        "bipyramid:30",
        "tri-torus:6x5",
        "irregular-tri:500",
        "irregular-poly:500",
        "irregular-quad:600",
        "cubes:4",
    ]
    .iter()
    .map(|name| (name.to_string(), mesh(name)))
    .collect();
    let several = union(&[mesh("prism:12"), mesh("torus:4x3"), mesh("icosphere:1")]);
    meshes.push(("three components".into(), several));
    meshes.push(("dual of a bipyramid".into(), dual(&mesh("bipyramid:40"))));
    meshes.extend((0..20).map(|seed| (format!("random polygons {seed}"), random_polygons(seed))));
    meshes.into_iter().map(|(name, mesh)| (name, Surface::new(mesh).expect("a closed mesh")))
}

/// The operator with its rows in fronts.
fn in_front_order(case: &Both) -> (Operator, Numbering) {
    let numbering = in_fronts(case.surface.faces(), case.surface.incidence());
    let operator = Operator::in_order(&case.surface, case.scheme, Some(&numbering));
    (operator.expect("an operator"), numbering)
}

struct Both {
    name: String,
    surface: Surface,
    scheme: Scheme,
    explicit: LimitSystem,
    operator: Operator,
}

fn both(name: &str, surface: Surface, scheme: Scheme) -> Both {
    Both {
        name: format!("{name}, {scheme}"),
        scheme,
        explicit: LimitSystem::new(&surface, scheme).expect("an explicit system"),
        operator: Operator::new(&surface, scheme).expect("an operator"),
        surface,
    }
}

fn all() -> impl Iterator<Item = Both> {
    surfaces().flat_map(|(name, surface)| {
        Scheme::ALL
            .into_iter()
            .filter(|s| s.first_unsuitable_face(surface.faces()).is_none())
            .map(|scheme| both(&name, surface.clone(), scheme))
            .collect::<Vec<_>>()
    })
}

/// Points without any smoothness, of length below 2.
fn rough(n: usize) -> Vec<DVec3> {
    (0..n)
        .map(|i| {
            let t = i as f64;
            DVec3::new((12.9898 * t).sin(), (78.233 * t).cos(), (37.719 * t).sin())
        })
        .collect()
}

/// The rounding of a mean of a thousand points of length below 2: the greatest valences here.
const ROUNDING: f64 = 1000.0 * f64::EPSILON;

fn assert_close(what: &str, a: &[DVec3], b: &[DVec3], tolerance: f64) {
    assert_eq!(a.len(), b.len(), "{what}");
    for (i, (a, b)) in a.iter().zip(b).enumerate() {
        assert!((*a - *b).length() <= tolerance, "{what}, vertex {i}: {a} against {b}");
    }
}

fn product<S: System>(system: &S, x: &[DVec3]) -> Vec<DVec3> {
    let mut out = vec![DVec3::ZERO; x.len()];
    let mut nothing = vec![(); x.len()];
    Rows::new(x.len()).product(system, x, &mut out, &mut nothing, |_, ax, out, (), _| *out = ax);
    out
}

#[test]
fn rows_equal_the_explicit_matrix() {
    for case in all() {
        let Both { name, explicit, operator, .. } = &case;
        let x = rough(explicit.len());
        let expected = product(explicit, &x);
        assert_close(name, &product(operator, &x), &expected, ROUNDING);
        let single: Vec<DVec3> = (0..x.len()).map(|i| operator.row(i, &x)).collect();
        assert_close(name, &single, &expected, ROUNDING);
        for (i, ax) in expected.iter().enumerate() {
            let (h, d) = (explicit.h[i], explicit.diagonal[i]);
            assert!((operator.weights()[i] - h).abs() <= ROUNDING * h, "{name}");
            assert!((operator.diagonal()[i] - d).abs() <= ROUNDING, "{name}");
            let m = explicit.m.row_times(i, &x);
            let difference = (operator.symmetric_row(i, &x) - m).length();
            assert!(difference <= ROUNDING / h, "{name}");
            let jacobi = (operator.jacobi_row(i, &x) - *ax / d).length();
            assert!(jacobi <= 4.0 * ROUNDING / d, "{name}");
        }
        assert_eq!(operator.bounds().lambda_min, explicit.bounds.lambda_min);
    }
}

#[test]
fn single_precision_rows_agree_to_single_rounding() {
    for case in all() {
        let x = rough(case.operator.len());
        let expected = product(&case.explicit, &x);
        let single: Vec<Vec3A> = x.iter().map(|p| p.as_vec3a()).collect();
        let mut sums = Vec::new();
        case.operator.all_sums(&single, &mut sums);
        let n = x.len();
        let mut image = vec![Vec3A::ZERO; n];
        case.operator.product(0..n, (&single, 0), (&sums, 0), &mut image);
        for (ax, expected) in image.iter().zip(&expected) {
            let difference = (ax.as_dvec3() - *expected).length();
            assert!(difference <= 4e-6, "{}: {difference}", case.name);
        }
    }
}

#[test]
fn renumbering_permutes_rows_and_the_front_order_is_a_permutation() {
    for case in all() {
        let n = case.operator.len();
        let x = rough(n);
        let expected = product(&case.explicit, &x);
        let front = in_fronts(case.surface.faces(), case.surface.incidence());
        let shuffled = Order::Random(5).order(case.surface.mesh(), case.surface.incidence());
        let file = Numbering::new((0..n as u32).collect());
        for numbering in [front, Numbering::new(shuffled), file] {
            let moved = Operator::in_order(&case.surface, case.scheme, Some(&numbering)).expect("an operator");
            let once = product(&moved, &numbering.there(&x));
            assert_close(&case.name, &numbering.back(&once), &expected, ROUNDING);
            assert_eq!(numbering.back(moved.diagonal()), case.operator.diagonal());
            assert_eq!(numbering.back(moved.weights()), case.operator.weights());
            assert_eq!(moved.bounds(), case.operator.bounds());
        }
    }
}

#[test]
fn distances_beyond_16_bits_are_stored_in_full() {
    // 40 002 vertices in random order: most neighbours are further than 2¹⁵ apart in one row or another.
    let ordered = surface("torus:200x201");
    let n = ordered.len();
    let order = Order::Random(3).order(ordered.mesh(), ordered.incidence());
    let shuffled = Surface::new(permute_vertices(ordered.mesh(), &order)).expect("a closed mesh");
    for scheme in [Scheme::CatmullClark, Scheme::Nasri] {
        let case = both("shuffled torus", shuffled.clone(), scheme);
        assert!(case.operator.reach() > 1 << 15);
        let x = rough(n);
        assert_close(&case.name, &product(&case.operator, &x), &product(&case.explicit, &x), ROUNDING);
        let near = in_front_order(&case).0;
        assert!(near.reach() < 1 << 11);
        assert!(near.sweep_bytes() < case.operator.sweep_bytes());
    }
}

#[test]
fn a_boundary_treated_as_interior_is_the_same_in_both() {
    let open = open();
    for scheme in [Scheme::Loop, Scheme::Sqrt3] {
        let case = both("open", open.clone(), scheme);
        let x = rough(8);
        let expected = product(&case.explicit, &x);
        assert_close(&case.name, &product(&case.operator, &x), &expected, ROUNDING);
    }
    assert!(Operator::new(&open, Scheme::CatmullClark).is_err());
}

#[test]
fn bands_change_no_bit() {
    for (name, count) in [
        ("torus:60x40", 21),
        ("irregular-quad:3000", 8),
        ("icosphere:4", 2),
        ("irregular-poly:20000", 9),
        ("irregular-poly:20000", 24),
    ] {
        let surface = surface(name);
        for scheme in Scheme::ALL {
            if scheme.first_unsuitable_face(surface.faces()).is_some() {
                continue;
            }
            let front = in_fronts(surface.faces(), surface.incidence());
            let operator = Operator::in_order(&surface, scheme, Some(&front)).expect("an operator");
            let r = rough(surface.len());
            let recurrence = Recurrence::new((0.1, 1.0));
            let first = recurrence.coefficients().1;
            let iterate = |band| {
                let mut x: Vec<DVec3> = r.iter().map(|&r| first * r).collect();
                let wavefront = Wavefront::in_bands(&operator, band);
                let mut scratch = wavefront.scratch();
                wavefront.iterate(recurrence, count, &r, &mut x, &mut scratch);
                x
            };
            let plain = iterate(None);
            let reach = operator.reach();
            for band in [reach, reach + 17, 2 * reach, 10 * surface.len()] {
                assert!(iterate(Some(band)) == plain, "{name}, {scheme}, bands of {band}");
            }
            // The same iterates as by the method that works with residuals from x = r's own start.
            let zero = vec![DVec3::ZERO; r.len()];
            let mut before = zero.clone();
            let mut x = zero;
            let mut steps = recurrence;
            for _ in 0..count {
                let (gamma, tau) = steps.coefficients();
                let ax = product(&operator, &x);
                let next: Vec<DVec3> =
                    (0..r.len()).map(|i| x[i] + gamma * (x[i] - before[i]) + tau * (r[i] - ax[i])).collect();
                before = std::mem::replace(&mut x, next);
                steps.step();
            }
            assert_close(name, &plain, &x, 1e-11);
        }
    }
}

#[test]
fn iterations_go_on_from_a_new_residual_as_if_they_had_not_been_stopped() {
    let case = both("irregular-quad:3000", surface("irregular-quad:3000"), Scheme::CatmullClark);
    let r = rough(case.surface.len());
    let wavefront = Wavefront::in_bands(&case.operator, None);
    let mut scratch = wavefront.scratch();
    let start = Recurrence::new((0.1, 1.0));
    let mut from = |recurrence: Recurrence, momentum: &[DVec3], r: &[DVec3], count| {
        let (_, tau) = recurrence.coefficients();
        let mut x: Vec<DVec3> = momentum.iter().zip(r).map(|(&m, &r)| m + tau * r).collect();
        let next = wavefront.iterate(recurrence, count, r, &mut x, &mut scratch);
        let (gamma, _) = next.coefficients();
        let momentum: Vec<DVec3> = x.iter().zip(scratch.before()).map(|(&x, &b)| gamma * (x - b)).collect();
        (next, momentum, x)
    };
    let zero = vec![DVec3::ZERO; r.len()];
    let (_, _, whole) = from(start, &zero, &r, 17);
    // Groups of an even and of an odd number, and of one, which makes no product.
    let (mut recurrence, mut momentum, mut sum) = (start, zero.clone(), zero);
    for count in [6, 1, 3, 7] {
        let ax = product(&case.operator, &sum);
        let rest: Vec<DVec3> = r.iter().zip(ax).map(|(&r, ax)| r - ax).collect();
        let step;
        (recurrence, momentum, step) = from(recurrence, &momentum, &rest, count);
        sum.iter_mut().zip(step).for_each(|(sum, step)| *sum += step);
    }
    assert_close("irregular-quad:3000", &sum, &whole, 1e-11);
}

/// New residuals cost no iterations: with a restart at each, three or four more were needed.
#[test]
fn mixed_precision_takes_the_iterations_of_one_run_of_the_recurrence() {
    for (name, scheme) in [
        ("irregular-quad:3000", Scheme::CatmullClark),
        ("irregular-tri:3000", Scheme::Loop),
        ("irregular-tri:3000", Scheme::Sqrt3),
        ("irregular-poly:3000", Scheme::Nasri),
        ("quad-sphere:5", Scheme::CatmullClark),
        ("icosphere:5", Scheme::Loop),
    ] {
        let case = both(name, surface(name), scheme);
        let points = case.surface.positions();
        let first = Rows::new(points.len()).errors(&case.operator, points, points).max;
        // Three residuals between the first and the last.
        let stop = Stop { tolerance: 1e-13 * first, max_iterations: 1000 };
        let (_, report) = mixed::solve(&case.operator, points, &stop);
        assert_eq!(report.outcome, Outcome::Converged, "{name}, {scheme}");
        let least = case.operator.usual_lambda_min().max(case.operator.bounds().lambda_min);
        let promised = promised_iterations((least, 1.0), 1e-13) as usize;
        let made = report.iterations;
        assert!(report.history.len() >= 4 && made <= promised + 1, "{name}, {scheme}: {made} for {promised}");
    }
}

fn in_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads").install(work)
}

#[test]
fn mixed_precision_meets_the_tolerance_with_any_number_of_threads() {
    for case in all() {
        let points = case.surface.positions();
        let stop = Stop { tolerance: 1e-11 * case.surface.diagonal(), max_iterations: 10_000 };
        let bound = case.explicit.bounds.lambda_min;
        let solve = || mixed::solve(&case.operator, points, &stop);
        let (control, report) = in_threads(1, solve);
        // Where the bound is 0, λ_min may be too small, or 0 (the cube).
        if bound > 0.0 {
            assert_eq!(report.outcome, Outcome::Converged, "{}", case.name);
        }
        if report.outcome == Outcome::Converged {
            let error = Rows::new(points.len()).errors(&case.explicit, points, &control);
            assert!(error.max <= stop.tolerance * (1.0 + 1e-2), "{}", case.name);
        }
        assert!(in_threads(2, solve) == (control, report), "{}", case.name);
    }
}

#[test]
fn sweeps_in_waves_are_the_sweeps_one_after_the_other() {
    // Sums over faces, one each and three, which follow the iterate; with rows of quads alone beside them.
    let cases = [
        ("torus:60x40", 200, Scheme::CatmullClark),
        ("irregular-quad:3000", 700, Scheme::CatmullClark),
        ("irregular-poly:6000", 1000, Scheme::CatmullClark),
        ("irregular-poly:6000", 1000, Scheme::Nasri),
    ];
    for (name, band, scheme) in cases {
        let case = both(name, surface(name), scheme);
        let (operator, numbering) = in_front_order(&case);
        let points = numbering.there(case.surface.positions());
        for count in [1, 8, 11] {
            let mut expected = points.clone();
            Wavefront::in_bands(&operator, None).relax(1.1, count, &points, &mut expected);
            let mut sor = Sor::new(&operator, &points, 1.1, None);
            for _ in 0..count {
                sor.advance().expect("a sweep");
            }
            assert!(sor.points() == expected, "{name}");
            for threads in [1, 2, 3] {
                let mut x = points.clone();
                let waves = Wavefront::in_bands(&operator, Some(band));
                in_threads(threads, || waves.relax(1.1, count, &points, &mut x));
                assert!(x == expected, "{name}, {count} sweeps, {threads} threads");
            }
        }
    }
}

#[test]
fn sweeps_by_colours_are_the_sweeps_one_after_the_other() {
    // The last two have more rows of a colour than a task, or than wait together.
    let large = [
        ("irregular-poly:20000", Scheme::Nasri),
        ("irregular-quad:30000", Scheme::CatmullClark),
        ("icosphere:7", Scheme::Loop),
    ];
    let large = large.map(|(name, scheme)| both(name, surface(name), scheme));
    let open = both("open", open(), Scheme::Sqrt3);
    for case in all().chain(large).chain([open]) {
        let (faces, incidence) = (case.surface.faces(), case.surface.incidence());
        let numbering = in_colours(faces, incidence);
        let operator = Operator::in_order(&case.surface, case.scheme, Some(&numbering)).expect("an operator");
        let points = numbering.there(case.surface.positions());
        let order = Order::Multicolour.order(case.surface.mesh(), incidence);
        let mut sor = Sor::new(&operator, &points, 1.1, None);
        let mut explicit = Sor::new(&case.explicit, case.surface.positions(), 1.1, Some(&order));
        for _ in 0..3 {
            sor.advance().expect("a sweep");
            explicit.advance().expect("a sweep");
        }
        let coloured = Coloured::new(&operator);
        // Sums over faces that follow the iterate differ by rounding from those that each row makes.
        let length = case.surface.diagonal();
        let same = |x: &[DVec3], expected: &[DVec3]| match operator.sums_follow() {
            true => assert_close(&case.name, x, expected, 10.0 * ROUNDING * length),
            false => assert!(x == expected, "{}", case.name),
        };
        let colours = colouring(faces, incidence);
        let colours = colours.into_iter().max().expect("vertices") as usize + 1;
        assert!(coloured.colours() <= colours, "{}", case.name);
        for threads in [1, 2, 3] {
            let mut x = points.clone();
            in_threads(threads, || coloured.relax(1.1, 3, &points, &mut x));
            same(&x, sor.points());
        }
        let back = numbering.back(sor.points());
        assert_close(&case.name, &back, explicit.points(), 10.0 * ROUNDING * length);
        // In any other order runs are short, and right.
        if case.surface.len() < 2000 {
            let mut sor = Sor::new(&case.operator, &points, 0.9, None);
            sor.advance().expect("a sweep");
            let mut x = points.clone();
            Coloured::new(&case.operator).relax(0.9, 1, &points, &mut x);
            same(&x, sor.points());
        }
    }
}

#[test]
fn gauss_seidel_by_colours_solves_and_knows_when_it_cannot() {
    let solve = |name: &str, tolerance| {
        let case = both(name, surface(name), Scheme::CatmullClark);
        let numbering = in_colours(case.surface.faces(), case.surface.incidence());
        let operator = Operator::in_order(&case.surface, case.scheme, Some(&numbering)).expect("an operator");
        let points = numbering.there(case.surface.positions());
        let stop = Stop { tolerance, max_iterations: 1000 };
        let (control, report) = by_colours(&operator, &points, 1.0, &stop);
        let control = numbering.back(&control);
        let errors = Rows::new(points.len()).errors(&case.explicit, case.surface.positions(), &control);
        (report, errors.max)
    };
    let (report, error) = solve("irregular-quad:3000", 1e-10);
    assert_eq!(report.outcome, Outcome::Converged);
    assert!(error <= 1.01e-10 && report.last().max <= 1e-10, "{error:e}");
    // A watch may stop at the second look, after eight sweeps.
    let case = both("irregular-quad:300", surface("irregular-quad:300"), Scheme::CatmullClark);
    let numbering = in_colours(case.surface.faces(), case.surface.incidence());
    let operator = Operator::in_order(&case.surface, case.scheme, Some(&numbering)).expect("an operator");
    let points = numbering.there(case.surface.positions());
    let stop = Stop { tolerance: 1e-10, max_iterations: 1000 };
    let mut seen = Vec::new();
    let (control, report) = by_colours_watched(&operator, &points, 1.0, &stop, &mut |step| {
        seen.push(Recorded { iteration: step.iteration, errors: step.errors });
        if step.iteration < 8 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    });
    assert_eq!((report.outcome, report.iterations, report.history), (Outcome::Stopped, 8, seen));
    assert_eq!(control, by_colours(&operator, &points, 1.0, &Stop { max_iterations: 8, ..stop }).0);
    // A singular matrix with noisy points, and a tolerance below rounding.
    for (name, tolerance, outcome) in
        [("cube", 1e-10, Outcome::Stagnated), ("irregular-quad:3000", 1e-18, Outcome::Rounding)]
    {
        let (report, _) = solve(name, tolerance);
        assert_eq!(report.outcome, outcome, "{name}");
        assert!(report.iterations < 500, "{name}");
    }
}

/// 163 842 vertices, above the size from which iterations are grouped, and what they are solved to.
fn large() -> (Both, Operator, Numbering, Stop) {
    let case = both("icosphere:7", surface("icosphere:7"), Scheme::Loop);
    let (operator, numbering) = in_front_order(&case);
    let stop = Stop { tolerance: 1e-10 * case.surface.diagonal(), max_iterations: 1000 };
    (case, operator, numbering, stop)
}

#[test]
fn gauss_seidel_in_waves_solves_large_meshes() {
    let (case, operator, numbering, stop) = large();
    let points = numbering.there(case.surface.positions());
    let (control, report) = in_waves(&operator, &points, 1.0, &stop);
    assert_eq!(report.outcome, Outcome::Converged);
    let mut sor = Sor::new(&operator, &points, 1.0, None);
    let reference = solve(&mut sor, &stop, &mut |_| ControlFlow::Continue(()));
    assert!(report.iterations >= reference.iterations);
    assert!(report.iterations < reference.iterations + 8);
    assert_close("icosphere:7", &control, sor.points(), 10.0 * stop.tolerance);
    let few = Stop { max_iterations: 3, ..stop };
    let (_, report) = in_waves(&operator, &points, 1.0, &few);
    assert_eq!((report.outcome, report.iterations), (Outcome::MaxIterations, 3));
    let (_, report) = in_waves(&operator, &points, 2.5, &stop);
    assert_eq!(report.outcome, Outcome::Diverged);
}

#[test]
fn large_meshes_take_the_banded_way_with_the_same_result_as_the_explicit_method() {
    let (case, operator, numbering, stop) = large();
    let points = numbering.there(case.surface.positions());
    let bound = operator.bounds().lambda_min;
    let solve = || mixed::solve(&operator, &points, &stop);
    let one = in_threads(1, solve);
    assert!(one == in_threads(2, solve));
    assert_eq!(one.1.outcome, Outcome::Converged);
    let method = Method::Chebyshev { interval: Some((bound, 1.0)) };
    let reference = run(&case.explicit, case.surface.positions(), method, &stop);
    let expected = numbering.there(&reference.points);
    // Both are within tolerance/λ_min of the solution, in a norm close to the greatest difference.
    assert_close("icosphere:7", &one.0, &expected, 2.0 * stop.tolerance / bound);
    assert!(one.1.iterations <= reference.report.iterations + 8);
}

#[test]
fn mixed_precision_stalls_on_inconsistent_data_of_a_singular_matrix() {
    let case = both("cube", surface("cube"), Scheme::CatmullClark);
    let stop = Stop { tolerance: 1e-10, max_iterations: 10_000 };
    let (_, report) = mixed::solve(&case.operator, case.surface.positions(), &stop);
    assert_eq!(report.outcome, Outcome::Stagnated);
    // The cube's own points have no part in the kernel.
    let exact = Surface::new(builtin("cube").expect("a mesh")).expect("a closed mesh");
    let exact = both("cube", exact, Scheme::CatmullClark);
    let (_, report) = mixed::solve(&exact.operator, exact.surface.positions(), &stop);
    assert_eq!(report.outcome, Outcome::Converged);
}

#[test]
fn an_interval_that_is_too_short_is_corrected() {
    // Odd prisms have λ_min ≈ 0.82/k² and no proven bound.
    let mut prism = mesh("prism:7");
    add_noise(&mut prism, 0.2, 9);
    let case = both("prism:7", Surface::new(prism).expect("a closed mesh"), Scheme::CatmullClark);
    let stop = Stop { tolerance: 1e-10, max_iterations: 10_000 };
    let (control, report) = mixed::solve(&case.operator, case.surface.positions(), &stop);
    assert_eq!(report.outcome, Outcome::Converged, "{report:?}");
    let lu = run(&case.explicit, case.surface.positions(), Method::Lu, &stop);
    assert_close("prism:7", &control, &lu.points, 1e-8);
}

#[test]
fn scatter_is_recognised_and_mended() {
    for name in ["torus:300x300", "irregular-quad:90000", "irregular-tri:90000", "icosphere:6"] {
        let mesh = mesh(name);
        assert!(!is_scattered(&mesh.faces), "{name}");
        let order = Order::Random(2).order(&mesh, &Incidence::new(&mesh.faces, mesh.len()));
        for scattered in [permute_vertices(&mesh, &order), shuffle_faces(&permute_vertices(&mesh, &order), 4)] {
            assert!(is_scattered(&scattered.faces), "{name}");
            let (mended, order, face_order) = along_curve(&scattered).expect("good indices");
            assert!(!is_scattered(&mended.faces), "{name}");
            for (k, &v) in order.order().iter().enumerate() {
                assert_eq!(mended.positions[k], scattered.positions[v as usize]);
            }
            // The same faces from the same corners on, each once, in another order.
            for (face, &f) in mended.faces.iter().zip(&face_order) {
                let theirs = face.iter().map(|&v| order.order()[v as usize]);
                assert!(theirs.eq(scattered.faces.face(f as usize).iter().copied()), "{name}");
            }
            let mut each = face_order;
            each.sort_unstable();
            assert!(each.into_iter().eq(0..scattered.faces.len() as u32), "{name}");
        }
    }
    let wrong = Mesh::new(rough(3), Faces::from_lists([[0u32, 1, 7]]));
    assert!(along_curve(&wrong).is_none());
}

#[test]
fn the_inverse_decays_as_on_the_infinite_grid() {
    // T⁻¹ of T = [1 4 1]/6 has the entries √3 (−q)^|k|, q = 2 − √3, and A = T ⊗ T; largest in ring m: 3 q^m.
    let case = both("torus:64x64", surface("torus:64x64"), Scheme::CatmullClark);
    let rings = decay(&case.operator, 1000, 1e-10);
    let q = 2.0 - 3f64.sqrt();
    assert!(rings.len() >= 17, "{rings:?}");
    for (m, &entry) in rings.iter().enumerate() {
        let exact = 3.0 * q.powi(m as i32);
        assert!((entry - exact).abs() <= 2e-11, "ring {m}: {entry} against {exact}");
    }
}

#[test]
fn local_edits_give_what_solving_anew_gives() {
    for case in all().filter(|c| c.explicit.bounds.lambda_min > 0.05) {
        let points = case.surface.positions();
        let n = points.len();
        let tolerance = 1e-11 * case.surface.diagonal();
        let stop = Stop { tolerance, max_iterations: 1000 };
        let bound = case.explicit.bounds.lambda_min;
        let (control, _) = mixed::solve(&case.operator, points, &stop);
        let mut editor = Editor::new(&case.operator, points.to_vec(), control);
        let moves: Vec<(u32, DVec3)> =
            [0, n / 3, n - 1].map(|v| (v as u32, points[v] + DVec3::new(0.1, -0.2, 0.05))).to_vec();
        // Twice: an edit leaves a solution to edit.
        for moves in [&moves[..1], &moves[1..]] {
            let edit = editor.edit(moves, tolerance, usize::MAX);
            assert!(edit.max_error <= tolerance, "{}", case.name);
        }
        let errors = Rows::new(n).errors(&case.explicit, editor.points(), editor.control());
        assert!(errors.max <= 1.01 * tolerance, "{}: {errors:?}", case.name);
        assert_eq!(editor.points()[n - 1], points[n - 1] + DVec3::new(0.1, -0.2, 0.05));
        let lu = run(&case.explicit, editor.points(), Method::Lu, &stop);
        // The residuals of both, times ‖A⁻¹‖ ≤ √κ(H)/λ_min.
        let h = &case.explicit.h;
        let (low, high) = h.iter().fold((f64::MAX, 0.0f64), |(l, u), &h| (l.min(h), u.max(h)));
        let factor = (n as f64 * high / low).sqrt() / bound;
        assert_close(&case.name, editor.control(), &lu.points, 2.0 * factor * tolerance);
    }
}

#[test]
fn an_edit_of_many_points_solves_all_anew() {
    let case = both("icosphere:5", surface("icosphere:5"), Scheme::Loop);
    let points = case.surface.positions();
    let n = points.len();
    let tolerance = 1e-10 * case.surface.diagonal();
    let stop = Stop { tolerance, max_iterations: 1000 };
    let (control, _) = mixed::solve(&case.operator, points, &stop);
    let mut editor = Editor::new(&case.operator, points.to_vec(), control);
    for (count, anew) in [(1, false), (n / 10, true), (n, true), (2, false)] {
        let moves: Vec<(u32, DVec3)> = (0..count)
            .map(|k| k * n / count)
            .map(|v| (v as u32, editor.points()[v] + DVec3::new(0.01, 0.02, 0.0)))
            .collect();
        let edit = editor.edit(&moves, tolerance, usize::MAX);
        assert_eq!(edit.anew, anew, "{count} points: {edit:?}");
        assert!(edit.max_error <= tolerance, "{edit:?}");
        let errors = Rows::new(n).errors(&case.explicit, editor.points(), editor.control());
        assert!(errors.max <= 1.01 * tolerance, "{count} points: {errors:?}");
        // The whole solution costs no more relaxations than a few steps of the edit.
        assert!(!anew || edit.relaxations < n / 10, "{edit:?}");
    }
}

#[test]
fn the_work_of_an_edit_does_not_grow_with_the_mesh() {
    let work = |name| {
        let case = both(name, surface(name), Scheme::Loop);
        let points = case.surface.positions();
        let stop = Stop { tolerance: 1e-10, max_iterations: 1000 };
        let (control, _) = mixed::solve(&case.operator, points, &stop);
        let mut editor = Editor::new(&case.operator, points.to_vec(), control);
        let edit = editor.edit(&[(20, points[20] + DVec3::X)], 1e-8, usize::MAX);
        (edit.touched, case.surface.len())
    };
    let (small, _) = work("icosphere:5");
    let (large, n) = work("icosphere:7");
    assert!(large <= 2 * small && 50 * large < n, "{small} and {large} of {n}");
}

/// What `auto` works on shows in the first iterate that its watch sees.
#[test]
fn a_file_in_narrow_order_is_left_in_it() {
    let (rows, columns) = (450, 450);
    let torus = mesh("torus:450x450");
    // Rows from both ends, so that the last is not far from the first.
    let folded: Vec<u32> = (0..rows)
        .flat_map(|k| (0..columns).map(move |j| if k % 2 == 0 { k / 2 } else { rows - 1 - k / 2 } * columns + j))
        .collect();
    for (mesh, is_narrow) in [(permute_vertices(&torus, &folded), true), (torus, false)] {
        let surface = Surface::new(mesh).expect("a closed mesh");
        let mut same = None;
        let watch = &mut |_: &'static str, step: &Step| {
            same.get_or_insert(step.points == surface.positions());
            ControlFlow::Break(())
        };
        interpolate_watched(&surface, Scheme::CatmullClark, &Options::default(), watch).expect("a system");
        assert_eq!(same, Some(is_narrow));
    }
}

#[test]
fn auto_returns_to_file_order_and_meets_the_tolerance() {
    // Above and below the size from which vertices are renumbered, in good and in random order.
    for name in ["irregular-quad:3000", "irregular-quad:60000", "icosphere:6", "irregular-poly:60000"] {
        let good = surface(name);
        let order = Order::Random(2).order(good.mesh(), good.incidence());
        let scattered = shuffle_faces(&permute_vertices(good.mesh(), &order), 4);
        for surface in [good, Surface::new(scattered).expect("a closed mesh")] {
            let scheme = Scheme::default_for(surface.faces());
            let stop = Stop { tolerance: 1e-10 * surface.diagonal(), max_iterations: 1000 };
            let found = interpolate(&surface, scheme, &stop.into()).expect("a system");
            assert_eq!(found.report.outcome, Outcome::Converged, "{name}");
            let explicit = LimitSystem::new(&surface, scheme).expect("an explicit system");
            let errors = Rows::new(surface.len()).errors(&explicit, surface.positions(), &found.points);
            assert!(errors.max <= 1.01 * stop.tolerance, "{name}: {errors:?}");
        }
    }
    // Nearly singular: κ grows like k², beyond what corrections of the interval reach. Conjugate gradients finish.
    let mut prism = mesh("prism:401");
    add_noise(&mut prism, 0.1, 3);
    let stop = Stop { tolerance: 1e-9, max_iterations: 10_000 };
    let prism = Surface::new(prism).expect("a closed mesh");
    let found = interpolate(&prism, Scheme::CatmullClark, &stop.into()).expect("a system");
    assert_eq!(found.report.outcome, Outcome::Converged, "{:?}", found.report);
}
