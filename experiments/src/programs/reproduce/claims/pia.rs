//! Progressive iterative interpolation: P1–P12. Those about Catmull-Clark are checked in [`pia_catmull_clark`].

use std::ops::ControlFlow;

use glam::DVec3;

use limitlab::Result;
use limitlab::analysis::splitting::LocalScheme;
use limitlab::assemble::LimitSystem;
use limitlab::interpolate::pia::{TwoStepsBack, passes};
use limitlab::schemes::loop_scheme::loop_beta;
use limitlab::schemes::{Refinement, Scheme};
use limitlab::solvers::{Method, Outcome, Stop, run_watched};

use super::finding::{Evidence, Finding};
use super::lab::{
    Lab, each, ends, entries_per_vertex, exact, largest, limit_by_powers, random_points, smallest, solve_random,
};
use super::{Claim, pia_catmull_clark};
use crate::programs::reproduce::corpus;

const ROUNDING: f64 = 1e-12;

pub const CLAIMS: &[Claim] = &[
    Claim {
        id: "P1",
        title: "Table 1: iterations and errors of four models",
        place: "§4, Table 1",
        printed: "Horse, Bird, Hand, Boy: 12, 9, 3, 6 iterations, with maximum and average errors.",
        slow: false,
        check: table_1,
    },
    Claim {
        id: "P2",
        title: "The Mushroom, a quadrilateral mesh",
        place: "§4, Fig. 7",
        printed: "Mushroom, quadrilateral: 8 iterations, maximum error 0.000813821, average 0.000235506.",
        slow: false,
        check: mushroom,
    },
    Claim {
        id: "P3",
        title: "Loop's limit formula",
        place: "§2, Eq. 1",
        printed: "V_∞ = β_n V + (1 − β_n) Q with β_n = 3/(11 − 8(3/8 + (3/8 + ¼cos(2π/n))²)).",
        slow: false,
        check: loop_limit,
    },
    Claim {
        id: "P4",
        title: "B = D S and the properties of B",
        place: "§2.1",
        printed: "Rows of B are non-negative with sum 1, have n_i + 1 entries, equal beside the diagonal; S is \
                  symmetric; nβ_n/(1−β_n) ≥ 2n/3 for n ≥ 3.",
        slow: false,
        check: properties,
    },
    Claim {
        id: "P5",
        title: "Propositions 1 and 2: S positive definite, convergence under Loop",
        place: "§2.1",
        printed: "S is positive definite, the eigenvalues of B lie in (0, 1], and the iteration converges.",
        slow: true,
        check: loop_convergence,
    },
    Claim {
        id: "P6",
        title: "C = H M with M symmetric, weights 4 and 1",
        place: "§3, Eq. 2",
        printed: "The Catmull-Clark matrix is H M; M is symmetric with n², 4 an edge, 1 a face; ‖C‖_∞ = 1.",
        slow: false,
        check: pia_catmull_clark::catmull_clark_matrix,
    },
    Claim {
        id: "P7",
        title: "Propositions 3 and 4: M positive definite, convergence under Catmull-Clark",
        place: "§3",
        printed: "M is positive definite, and the iteration converges (marked as not completely correct).",
        slow: true,
        check: pia_catmull_clark::when_singular,
    },
    Claim {
        id: "P8",
        title: "The quadratic form of M",
        place: "§3, proof of Proposition 3",
        printed: "xᵀMx = Σ_F (x_i+x_j+x_k+x_r) + Σ_E (x_i+x_j) + Σ (n²−3n) x_i².",
        slow: false,
        check: pia_catmull_clark::quadratic_form,
    },
    Claim {
        id: "P9",
        title: "Convergence on arbitrary meshes",
        place: "§3 and §5",
        printed: "The proof holds for quadrilateral meshes only; arbitrary meshes are future work.",
        slow: true,
        check: pia_catmull_clark::arbitrary_meshes,
    },
    Claim {
        id: "P10",
        title: "The algorithm as printed",
        place: "§2",
        printed: "In the prose e = V − V^k; in the algorithm CurrentMaxError is never reset.",
        slow: false,
        check: algorithm,
    },
    Claim {
        id: "P11",
        title: "The error always decreases",
        place: "§2",
        printed: "It can be proved that e^{k+1} is always less than e^k.",
        slow: false,
        check: monotone,
    },
    Claim {
        id: "P12",
        title: "O(mn) time",
        place: "§4",
        printed: "The method can handle very huge meshes, its complexity is O(mn).",
        slow: true,
        check: linear_time,
    },
];

/// The paper's tolerance in mesh units, and the agreement of errors that single precision explains.
const TOLERANCE: f64 = 1e-3;

const AGREEMENT: f64 = 2e-5;

/// |measured/printed − 1|, the larger of both errors.
fn departure(errors: limitlab::solvers::Errors, printed: (f64, f64)) -> f64 {
    largest([(errors.max / printed.0 - 1.0).abs(), (errors.mean / printed.1 - 1.0).abs()])
}

fn table_1(lab: &Lab) -> Result<Finding> {
    if !lab.context.real() {
        return Ok(Finding::not_reproducible(
            "Needs the four models of the Princeton Shape Benchmark: run with --meshes DIR.",
        ));
    }
    let lines = [
        ("Horse", corpus::HORSE, 12, (0.000912016, 0.00022811)),
        ("Bird", corpus::BIRD, 9, (0.000766811, 8.8345e-5)),
        ("Hand", corpus::HAND, 3, (0.000914111, 0.000164207)),
        ("Boy", corpus::BOY, 6, (0.000913795, 9.5615e-5)),
    ];
    let mut evidence = Vec::new();
    for (name, model, printed, errors) in lines {
        let subject = lab.context.model(&model)?;
        let run = passes(&subject.system(Scheme::Loop)?, subject.surface.positions(), TOLERANCE, 1000);
        evidence.push(Evidence::equal(format!("{name}: passes of the loop"), run.passes, printed as f64));
        evidence.push(Evidence::at_most(
            format!("{name}: relative departure of the printed errors"),
            departure(run.errors, errors),
            AGREEMENT,
        ));
    }
    Ok(Finding::reproduced(evidence).remark(
        "Iterations are passes of the paper's loop, one more than updates. The Boy's 26 boundary edges are treated as \
         interior ones.",
    ))
}

fn mushroom(lab: &Lab) -> Result<Finding> {
    if !lab.context.real() {
        return Ok(Finding::not_reproducible(
            "Needs the mushroom of 226 vertices that comes with geomview: run with --meshes DIR.",
        ));
    }
    let printed = (0.000813821, 0.000235506);
    let subject = lab.context.model(&corpus::MUSHROOM)?;
    let system = subject.system(Scheme::CatmullClark)?;
    let points = subject.surface.positions();
    let surface = passes(&system, points, TOLERANCE, 1000);
    let masks = LimitSystem::with_masks(&subject.surface, &TwoStepsBack)?;
    let reading = passes(&masks, points, TOLERANCE, 1000);
    let triangles = subject.surface.faces().iter().filter(|f| f.len() == 3).count();
    Ok(Finding::corrected(
        "relative departure of the printed errors, on the Catmull-Clark surface (print), with the face point two \
         corners back (right)",
        departure(surface.errors, printed),
        departure(reading.errors, printed),
        AGREEMENT,
    )
    .also([
        Evidence::equal("passes of the loop, face point two corners back", reading.passes, 8.0),
        Evidence::above("triangles of the mesh", triangles, 0.0),
        Evidence::shown("maximum error with the true limit mask", surface.errors.max),
        Evidence::shown("mean error with the true limit mask", surface.errors.mean),
    ])
    .remark(
        "The mesh is not quadrilateral. The printed figures come out with a mask that is wrong on its triangles, so \
         that row does not interpolate the Catmull-Clark surface there.",
    ))
}

fn loop_limit(_: &Lab) -> Result<Finding> {
    let mut worst = 0.0f64;
    for n in 3..=50 {
        let mask = limit_by_powers(LocalScheme::Loop, n)?;
        let c = 0.375 + 0.25 * (std::f64::consts::TAU / n as f64).cos();
        let beta = 3.0 / (11.0 - 8.0 * (0.375 + c * c));
        for (i, w) in mask.iter().enumerate() {
            let printed = if i == 0 { beta } else { (1.0 - beta) / n as f64 };
            worst = largest([worst, (w - printed).abs()]);
        }
    }
    Ok(Finding::reproduced(vec![Evidence::at_most(
        "largest deviation from the first row of S^64, n = 3…50",
        worst,
        ROUNDING,
    )]))
}

fn properties(lab: &Lab) -> Result<Finding> {
    struct Row {
        sum: f64,
        least: f64,
        misses: usize,
        spread: f64,
        asymmetry: f64,
    }
    let rows = each(lab.triangles(), |subject| {
        let system = subject.system(Scheme::Loop)?;
        let mut row = Row { sum: 0.0, least: f64::INFINITY, misses: 0, spread: 0.0, asymmetry: 0.0 };
        for i in 0..system.len() {
            let entries: Vec<(usize, f64)> = system.a.row(i).collect();
            row.sum = largest([row.sum, (entries.iter().map(|e| e.1).sum::<f64>() - 1.0).abs()]);
            row.least = smallest([row.least, smallest(entries.iter().map(|e| e.1))]);
            row.misses += entries.len().abs_diff(subject.surface.incidence().face_count(i) + 1);
            let others = || entries.iter().filter(|e| e.0 != i).map(|e| e.1);
            row.spread = largest([row.spread, largest(others()) - smallest(others())]);
            for (j, m) in system.m.row(i) {
                row.asymmetry = largest([row.asymmetry, (m - system.m.get(j, i)).abs()]);
            }
        }
        Ok(row)
    })?;
    let part = |n: usize| {
        let beta = loop_beta(n);
        n as f64 * beta / (1.0 - beta) - 2.0 * n as f64 / 3.0
    };
    Ok(Finding::reproduced(vec![
        Evidence::at_most(
            "largest deviation of a row sum of B from 1, random triangle meshes",
            largest(rows.iter().map(|r| r.sum)),
            ROUNDING,
        ),
        Evidence::above("smallest stored entry", smallest(rows.iter().map(|r| r.least)), 0.0),
        Evidence::equal("entries more or fewer than n_i + 1", rows.iter().map(|r| r.misses).sum::<usize>(), 0.0),
        Evidence::at_most(
            "largest difference of two entries of a row beside the diagonal",
            largest(rows.iter().map(|r| r.spread)),
            ROUNDING,
        ),
        Evidence::equal("largest |s_ij − s_ji|", largest(rows.iter().map(|r| r.asymmetry)), 0.0),
        Evidence::above("smallest nβ_n/(1−β_n) − 2n/3, n = 4…1000", smallest((4..=1000).map(part)), 0.0),
        Evidence::at_most("its size at n = 3, where equality holds", part(3).abs(), ROUNDING),
    ]))
}

fn loop_convergence(lab: &Lab) -> Result<Finding> {
    let rows = each(lab.triangles(), |subject| {
        let system = subject.system(Scheme::Loop)?;
        let ends = ends(&system)?;
        let outcome = solve_random(&system, Method::Pia, 1e-9, 10_000).report.outcome;
        Ok((ends.min, ends.max, ends.min - system.bounds.lambda_min, outcome))
    })?;
    Ok(Finding::reproduced(vec![
        Evidence::above("smallest eigenvalue of B, random triangle meshes", smallest(rows.iter().map(|r| r.0)), 0.0),
        Evidence::at_most("largest eigenvalue of B", largest(rows.iter().map(|r| r.1)), 1.0 + ROUNDING),
        Evidence::equal(
            "runs from random points that did not converge to 10⁻⁹",
            rows.iter().filter(|r| r.3 != Outcome::Converged).count(),
            0.0,
        ),
        Evidence::at_least(
            "smallest λ_min less its bound min (3β_n − 1)/2",
            smallest(rows.iter().map(|r| r.2)),
            -ROUNDING,
        ),
        Evidence::shown("meshes", rows.len()),
    ]))
}

fn algorithm(_: &Lab) -> Result<Finding> {
    let subject = exact("irregular-tri:233")?;
    let limits = |points: Vec<DVec3>| -> Result<Vec<DVec3>> {
        Refinement::Loop.limit_positions(&subject.surface.with_positions(points))
    };
    let given = subject.surface.positions();
    const PASSES: usize = 100;
    // e = V − V^k moves every vertex to its own place: nothing ever changes.
    let prose = given.to_vec();
    let (mut box_points, mut reset, mut never) = (given.to_vec(), TOLERANCE + 1.0, TOLERANCE + 1.0);
    let (mut passes_reset, mut passes_never) = (0usize, 0usize);
    for _ in 0..PASSES {
        let now = limits(box_points.clone())?;
        let largest_error = largest(given.iter().zip(&now).map(|(p, q)| p.distance(*q)));
        if reset > TOLERANCE {
            passes_reset += 1;
        }
        if never > TOLERANCE {
            passes_never += 1;
        }
        reset = largest_error;
        never = never.max(largest_error);
        for ((v, p), q) in box_points.iter_mut().zip(given).zip(&now) {
            *v += *p - *q;
        }
    }
    let error = |points: Vec<DVec3>| -> Result<f64> {
        Ok(largest(given.iter().zip(limits(points)?).map(|(p, q)| p.distance(q))))
    };
    Ok(Finding::corrected(
        "maximum error after 100 passes with e = V − V^k (print), e = V − V_∞^k (right), irregular-tri:233",
        error(prose)?,
        error(box_points)?,
        TOLERANCE,
    )
    .also([
        Evidence::equal(
            "passes of 100 in which the loop goes on without a reset of CurrentMaxError",
            passes_never,
            PASSES as f64,
        ),
        Evidence::below("the same with a reset in every pass", passes_reset, PASSES as f64),
    ])
    .remark("The algorithm box has the right e; CurrentMaxError has to start from 0 in every pass."))
}

/// Points whose first error under PIA on a system with rows of B is 1 at a vertex of valence 3, −1 at its neighbours,
/// and even elsewhere, so that wᵀe = 0 with w = H⁻¹1: P = Σ_k B^k e.
fn points_of_growing_error(system: &LimitSystem, valence_3: usize) -> Vec<DVec3> {
    let n = system.len();
    let mut error = vec![f64::NAN; n];
    for (j, _) in system.a.row(valence_3) {
        error[j] = -1.0;
    }
    error[valence_3] = 1.0;
    let (mut near, mut far) = (0.0, 0.0);
    for (e, h) in error.iter().zip(&system.h) {
        if e.is_nan() {
            far += 1.0 / h;
        } else {
            near += e / h;
        }
    }
    let even = -near / far;
    let mut term: Vec<DVec3> = (error.iter()).map(|&e| DVec3::X * if e.is_nan() { even } else { e }).collect();
    let mut points = vec![DVec3::ZERO; n];
    for _ in 0..2000 {
        points.iter_mut().zip(&term).for_each(|(p, t)| *p += *t);
        term = (0..n).map(|i| system.a.row_times(i, &term)).collect();
    }
    points
}

/// The largest ratio of successive errors under PIA, in the maximum norm and in ‖H^-½·‖₂.
fn growth(system: &LimitSystem, points: &[DVec3]) -> [f64; 2] {
    let mut last: Option<[f64; 2]> = None;
    let mut worst = [0.0f64; 2];
    let stop = Stop { tolerance: 1e-8, max_iterations: 60 };
    run_watched(system, points, Method::Pia, &stop, &mut |step| {
        let energy: f64 = (0..system.len())
            .map(|i| (points[i] - system.a.row_times(i, step.points)).length_squared() / system.h[i])
            .sum();
        let now = [step.errors.max, energy.sqrt()];
        if let Some(before) = last {
            worst = [0, 1].map(|k| worst[k].max(now[k] / before[k]));
        }
        last = Some(now);
        ControlFlow::Continue(())
    });
    worst
}

fn monotone(lab: &Lab) -> Result<Finding> {
    let star = exact("star:3")?;
    let system = star.system(Scheme::Loop)?;
    // Vertex 3 is an apex of the bipyramid.
    let constructed = growth(&system, &points_of_growing_error(&system, 3));
    let rows = each(&lab.triangles()[..100], |subject| {
        let system = subject.system(Scheme::Loop)?;
        let points = random_points(system.len(), system.len() as u64);
        Ok(growth(&system, &points))
    })?;
    let norm = |n: usize| 2.0 * (1.0 - loop_beta(n));
    let regular = exact("tri-torus:12x7")?.system(Scheme::Loop)?;
    let row_norm = |system: &LimitSystem| {
        let row = |i: usize| system.a.row(i).map(|(j, b)| if i == j { (1.0 - b).abs() } else { b.abs() }).sum::<f64>();
        largest((0..system.len()).map(row))
    };
    let energy = rows.iter().map(|r| r[1]).chain([constructed[1]]);
    Ok(Finding::refuted(vec![
        Evidence::above("largest max e^{k+1} over max e^k under Loop, star:3, points made for it", constructed[0], 1.0),
        Evidence::shown(
            "the same on 100 random triangle meshes with random points",
            largest(rows.iter().map(|r| r[0])),
        ),
        Evidence::below("largest ratio of ‖H^-½ e‖₂ at successive steps on all of them", largest(energy), 1.0),
        Evidence::above("smallest 2(1 − β_n) of the valences 3, 4, 5", smallest((3..6).map(norm)), 1.0),
        Evidence::at_most("largest 2(1 − β_n) of the valences 6…200", largest((6..=200).map(norm)), 1.0 + ROUNDING),
        Evidence::at_most("‖I − B‖_∞ on tri-torus:12x7, all valences 6", row_norm(&regular), 1.0 + ROUNDING),
    ])
    .remark(
        "I − B is symmetric in the norm ‖H^-½·‖₂ with eigenvalues in [0, 1), so there every error shrinks. In the \
         maximum norm ‖I − B‖_∞ = max 2(1 − β_n), which is 6/5 at valence 3 and above 1 only where some valence is below \
         6, as β_n ≥ ½ from there on: with valences from 6 on no error grows. An error of 1 at a vertex of valence 3, −1 at \
         its neighbours and Σe/h = 0 grows to 6/5: P = Σ_k B^k e has it. Random points show no growth.",
    ))
}

fn linear_time(_: &Lab) -> Result<Finding> {
    const LEVELS: std::ops::RangeInclusive<usize> = 2..=6;
    let (mut entries, mut counts) = (Vec::new(), Vec::new());
    for level in LEVELS {
        let system = exact(&format!("icosphere:{level}"))?.system(Scheme::Loop)?;
        entries.push(entries_per_vertex(&system));
        counts.push(solve_random(&system, Method::Pia, 1e-6, 1000).report.iterations);
    }
    let spread = |v: &[f64]| largest(v.iter().copied()) / smallest(v.iter().copied());
    let iterations: Vec<f64> = counts.iter().map(|&n| n as f64).collect();
    let levels =
        LEVELS.zip(&counts).map(|(level, &count)| Evidence::shown(format!("iterations, icosphere:{level}"), count));
    Ok(Finding::reproduced(vec![
        Evidence::at_most(
            "entries of B a vertex, largest over smallest, icosphere:2 … 6 (162 to 40 962 vertices)",
            spread(&entries),
            1.05,
        ),
        Evidence::at_most(
            "iterations to 10⁻⁶ from random points on them, largest over smallest",
            spread(&iterations),
            1.25,
        ),
    ])
    .also(levels)
    .remark("λ_min(B) ≥ min (3β_n − 1)/2 > 0 bounds m whatever n is."))
}
