//! Thall's algorithm: T1–T18. Those about surfaces are checked in [`thall_surfaces`]; the local matrices and masks of
//! his appendix are in [`thall_masks`](super::thall_masks).

use std::ops::ControlFlow;

use glam::DVec3;

use limitlab::Result;
use limitlab::analysis::dense;
use limitlab::analysis::inertia::certify;
use limitlab::analysis::spectrum::spectrum;
use limitlab::analysis::splitting::{LocalScheme, SplittingMatrix};
use limitlab::analysis::subspace_iteration::End;
use limitlab::analysis::symmetric::{SymmetricForm, scales, symmetric};
use limitlab::assemble::LimitSystem;
use limitlab::interpolate::thall::{Inverse, LocalIteration};
use limitlab::mesh::Surface;
use limitlab::schemes::{Refinement, Scheme, catmull_clark};
use limitlab::solvers::{Method, Outcome, Stop, solve};

use super::finding::{Evidence, Finding};
use super::lab::{
    Lab, distance, each, ends, entries_per_vertex, exact, excess, history, iterates, iterations, largest,
    limit_by_powers, median, platonic_map, quad_star, random_points, smallest, solve_random, subject,
};
use super::{Claim, thall_surfaces};
use crate::programs::reproduce::context::Subject;

const CC: Scheme = Scheme::CatmullClark;

/// What sums of some tens of terms of size 1 may lose.
const ROUNDING: f64 = 1e-12;
/// The most vertices of a mesh whose modes are computed one by one.
const DENSE: usize = 600;

pub const CLAIMS: &[Claim] = &[
    Claim {
        id: "T1",
        title: "The limit mask is the limit of repeated subdivision",
        place: "§2.2, Eq. 1",
        printed: "The limit point of a vertex of valence n among quads is (n² v + Σ 4e + f)/(n(n+5)).",
        slow: false,
        check: limit_mask,
    },
    Claim {
        id: "T2",
        title: "The inverse mask gives the wanted limit while the neighbours stay",
        place: "§2.2 and §5, Eq. 2 and 18",
        printed: "v + δ = (n+5)/n [v_limit − Σ(4e + f)/(n(n+5))] has the limit v_limit.",
        slow: false,
        check: inverse_mask,
    },
    Claim {
        id: "T3",
        title: "Iteration by local masks = damped Jacobi in matrix form",
        place: "§2.2, Eq. 3 to 5",
        printed: "The iteration v + δ/2 by local masks is v − ½D⁻¹(Av − v_limit), iterate by iterate.",
        slow: false,
        check: matrix_form,
    },
    Claim {
        id: "T4",
        title: "The factor in front of the neighbours",
        place: "§2.2, Eq. 4 and the display after it",
        printed: "The neighbours' part of a row of A is 1/(n+5) Σ(4e + f).",
        slow: false,
        check: neighbour_factor,
    },
    Claim {
        id: "T5",
        title: "ω = ½ needs no tuning",
        place: "§2.2",
        printed: "ω = ½ was a guess, and the iteration converges so fast that no tuning was deemed necessary.",
        slow: true,
        check: best_omega,
    },
    Claim {
        id: "T6",
        title: "Convergence of the iteration",
        place: "§2.2",
        printed: "A full proof of convergence is pending.",
        slow: true,
        check: convergence,
    },
    Claim {
        id: "T7",
        title: "Diagonal dominance of the global matrix",
        place: "§2.2 and §5",
        printed: "The global matrix is diagonally dominant (§5; §2.2 says so too and denies it).",
        slow: true,
        check: dominance,
    },
    Claim {
        id: "T8",
        title: "Spectral radius 1, second and third eigenvalue ½",
        place: "§2.2",
        printed: "The global matrix has the spectral radius 1, and its second and third eigenvalues are 0.5.",
        slow: false,
        check: global_eigenvalues,
    },
    Claim {
        id: "T9",
        title: "Masks and inverse masks of valence 4 and 3",
        place: "§2.2, Eq. 6 to 9",
        printed: "Limit and inverse of valence 4 and 3 in numbers; in Eq. 9 the neighbours weigh 4/9 and 1/9.",
        slow: false,
        check: masks_in_numbers,
    },
    Claim {
        id: "T10",
        title: "One or two iterations give a good approximation",
        place: "§2.2 and §5",
        printed: "Only one or two iterations often produce a good approximation to the desired boundary.",
        slow: true,
        check: first_iterations,
    },
    Claim {
        id: "T11",
        title: "O(nm) time with m small",
        place: "abstract, §2.1",
        printed: "The time is O(nm) for n vertices and m iterations; m is small and so the algorithm effectively O(n).",
        slow: true,
        check: linear_time,
    },
    Claim {
        id: "T12",
        title: "The regularised neighbourhood has the same limit",
        place: "§2.3, Eq. 12 to 14",
        printed: "Replacing each other face by a quad of the same centroid keeps limit point and tangent plane.",
        slow: false,
        check: thall_surfaces::regularisation,
    },
    Claim {
        id: "T13",
        title: "After one split all faces are quads",
        place: "§2.3",
        printed: "After the first split the mesh is regular, and no further extraordinary vertices arise.",
        slow: false,
        check: thall_surfaces::quads_after_one_split,
    },
    Claim {
        id: "T14",
        title: "Three metrics of the error",
        place: "§2.4",
        printed: "Distance over r, angle of normals and medial shift measure the surface; normals are not interpolated.",
        slow: false,
        check: thall_surfaces::metrics,
    },
    Claim {
        id: "T15",
        title: "1-rings are disjoint after two subdivisions",
        place: "§2.5",
        printed: "Local 1-neighbourhoods of initial vertices are disjoint after 2 subdivisions.",
        slow: false,
        check: thall_surfaces::disjoint_rings,
    },
    Claim {
        id: "T16",
        title: "Rotated 1-rings interpolate normals",
        place: "§2.5",
        printed: "Turning a 1-ring about its limit point gives the wanted normal and leaves the limit point.",
        slow: false,
        check: thall_surfaces::rotated_rings,
    },
    Claim {
        id: "T17",
        title: "Attributes: midpoint rule against the scheme's own",
        place: "§2.6",
        printed: "The midpoint rule keeps values at original vertices; the scheme's own rule makes them creep.",
        slow: false,
        check: thall_surfaces::attributes,
    },
    Claim {
        id: "T18",
        title: "Closed two-sided meshes always give an invertible matrix",
        place: "§2.7",
        printed: "The method needs a non-singular matrix; closed two-sided boundary meshes always give one.",
        slow: false,
        check: singular_meshes,
    },
];

fn limit_mask(_: &Lab) -> Result<Finding> {
    let mut powers = 0.0f64;
    for n in 3..=50 {
        let [vertex, edge, face] = {
            let x = n as f64;
            [x * x, 4.0, 1.0].map(|w| w / (x * (x + 5.0)))
        };
        let mask = limit_by_powers(LocalScheme::CatmullClark, n)?;
        for (i, w) in mask.iter().enumerate() {
            let printed = if i == 0 {
                vertex
            } else if i <= n {
                edge
            } else {
                face
            };
            powers = largest([powers, (w - printed).abs()]);
        }
    }
    // Another way: subdivision does not move limit points.
    let mut kept = 0.0f64;
    for n in 3..=20 {
        let star = Surface::new(quad_star(n))?;
        let star = star.with_positions(random_points(star.len(), n as u64));
        let before = catmull_clark::limit_positions(&star)?;
        let after = catmull_clark::limit_positions(&Refinement::CatmullClark.refined_n(&star, 3)?)?;
        kept = largest([kept, distance(&before, &after[..before.len()])]);
    }
    Ok(Finding::reproduced(vec![
        Evidence::at_most("largest deviation from the first row of S^64, n = 3…50", powers, ROUNDING),
        Evidence::at_most(
            "largest move of a limit point under three subdivisions, random stars n = 3…20",
            kept,
            ROUNDING,
        ),
    ]))
}

fn inverse_mask(_: &Lab) -> Result<Finding> {
    let mut worst = 0.0f64;
    for n in [3, 4, 5, 7, 12, 20] {
        let star = subject("", quad_star(n));
        let points = random_points(star.surface.len(), 1);
        let wanted = random_points(1, 2)[0];
        // Eq. 2 at the apex, written out.
        let (mut edges, mut opposite) = (DVec3::ZERO, DVec3::ZERO);
        for &c in star.surface.incidence().corners_at(n) {
            let face = star.surface.faces().face(star.surface.incidence().face_of(c));
            let place = face.iter().position(|&v| v as usize == n).unwrap_or(0);
            edges += points[face[(place + 1) % 4] as usize];
            opposite += points[face[(place + 2) % 4] as usize];
        }
        let sum = 4.0 * edges + opposite;
        let x = n as f64;
        let mut moved = star.surface.with_positions(points);
        moved.positions_mut()[n] = (x + 5.0) / x * (wanted - sum / (x * (x + 5.0)));
        let limits = catmull_clark::limit_positions(&moved)?;
        worst = largest([worst, limits[n].distance(wanted)]);
    }
    Ok(Finding::reproduced(vec![Evidence::at_most(
        "largest distance of the new limit from the wanted one, n = 3…20",
        worst,
        ROUNDING,
    )]))
}

/// The first `count` iterates by local masks.
fn local_iterates(subject: &Subject, inverse: Inverse, count: usize) -> Vec<Vec<DVec3>> {
    let mut method = LocalIteration::new(&subject.surface, inverse);
    let stop = Stop { tolerance: 0.0, max_iterations: count };
    let mut found = Vec::new();
    solve(&mut method, &stop, &mut |step| {
        if step.iteration > 0 {
            found.push(step.points.to_vec());
        }
        ControlFlow::Continue(())
    });
    found
}

fn matrix_form(lab: &Lab) -> Result<Finding> {
    const COUNT: usize = 50;
    let compare = |name: &str, inverse: Inverse| -> Result<f64> {
        let subject = lab.context.stand_in(name)?;
        let system = subject.system(CC)?;
        let matrix = iterates(&system, subject.surface.positions(), Method::Thall, COUNT);
        let local = local_iterates(&subject, inverse, COUNT);
        let pairs = matrix.iter().zip(&local);
        let size = subject.surface.diagonal();
        Ok(largest(pairs.map(|(a, b)| distance(a, b) / size)))
    };
    let exact = |name: &str| -> Result<Evidence> {
        Ok(Evidence::at_most(
            format!("largest difference of 50 iterates over L, {name}"),
            compare(name, Inverse::Exact)?,
            ROUNDING,
        ))
    };
    Ok(Finding::reproduced(vec![
        exact("irregular-quad:200")?,
        exact("irregular-poly:200")?,
        exact("irregular-tri:200")?,
        Evidence::shown(
            "the same with the quads' factor (n+5)/n beside other faces, irregular-poly:200",
            compare("irregular-poly:200", Inverse::Regular)?,
        ),
    ])
    .remark(
        "Beside faces that are no quads the fourth corner of Eq. 14 moves with v. The identity needs the inverse \
         that knows this; with the factor (n+5)/n as it stands the iteration is another one, which converges too.",
    ))
}

fn neighbour_factor(_: &Lab) -> Result<Finding> {
    let (mut printed, mut right) = (0.0f64, 0.0f64);
    for n in 3..=12 {
        let mask = limit_by_powers(LocalScheme::CatmullClark, n)?;
        let x = n as f64;
        for (i, w) in mask.iter().enumerate().skip(1) {
            let part = if i <= n { 4.0 } else { 1.0 };
            printed = largest([printed, (w - part / (x + 5.0)).abs()]);
            right = largest([right, (w - part / (x * (x + 5.0))).abs()]);
        }
    }
    Ok(Finding::corrected(
        "largest deviation of a neighbour's weight from the limit mask, n = 3…12",
        printed,
        right,
        ROUNDING,
    )
    .remark("The factor is 1/(n(n+5)), as in Eq. 1 to 3."))
}

/// What Jacobi's iteration with some ω does on the points of a mesh.
struct Tuning {
    /// 2/(λ_min + λ_max) of D⁻¹A: the least spectral radius.
    of_matrix: f64,
    /// The one of fewest iterations.
    of_data: f64,
    /// Iterations to 10⁻⁶ L at ½, at the former and at the latter.
    at_half: f64,
    at_matrix: f64,
    at_data: f64,
    /// Of the first error, in the norm in which the modes of D⁻¹A are orthogonal: its part in modes that ½ shrinks by less
    /// than the spectral radius ρ at the ω of the matrix.
    slow_part: f64,
}

impl Tuning {
    /// `None` where the matrix is singular, so that no ω is best.
    fn new(subject: &Subject) -> Result<Option<Self>> {
        let system = subject.system(CC)?;
        let jacobi = spectrum(&system)?.jacobi;
        if jacobi.min < 1e-9 {
            return Ok(None);
        }
        let of_matrix = jacobi.optimal_omega();
        let count = |omega| {
            let found = iterations(&system, subject, Method::Jacobi { omega: Some(omega) }, 1e-6);
            found.map_or(f64::NAN, |n| n.max(1) as f64)
        };
        let (at_half, at_matrix) = (count(0.5), count(of_matrix));
        let mut best = if at_half <= at_matrix { (0.5, at_half) } else { (of_matrix, at_matrix) };
        for step in 6..=39 {
            let omega = 0.05 * f64::from(step);
            let n = count(omega);
            if n < best.1 {
                best = (omega, n);
            }
        }
        let slow = 2.0 * of_matrix * jacobi.min;
        let slow_part = Self::part_below(slow, &system, subject.surface.positions())?;
        Ok(Some(Tuning { of_matrix, of_data: best.0, at_half, at_matrix, at_data: best.1, slow_part }))
    }

    /// The part of the first error in modes with eigenvalues below a `bound`.
    fn part_below(bound: f64, system: &LimitSystem, points: &[DVec3]) -> Result<f64> {
        if system.len() > DENSE {
            return Ok(f64::NAN);
        }
        let (values, modes) = dense::eigenpairs(&symmetric(system, SymmetricForm::Jacobi))?;
        let error = (0..).zip(points).map(|(i, p)| *p - system.a.row_times(i, points));
        // The modes of D⁻¹A are s·x; of D⁻¹e the part x is x·(D⁻¹e/s).
        let scaled: Vec<DVec3> = error
            .zip(&system.diagonal)
            .zip(scales(system, SymmetricForm::Jacobi))
            .map(|((e, a), s)| e / (a * s))
            .collect();
        let (mut slow, mut all) = (0.0, 0.0);
        for (value, mode) in values.iter().zip(&modes) {
            let part = mode.iter().zip(&scaled).map(|(x, e)| *x * *e).sum::<DVec3>().length_squared();
            all += part;
            if *value < bound {
                slow += part;
            }
        }
        Ok((slow / all).sqrt())
    }
}

fn best_omega(lab: &Lab) -> Result<Finding> {
    let found = each(lab.subjects()?, Tuning::new)?;
    let rows: Vec<(&String, Tuning)> =
        lab.subjects()?.iter().zip(found).filter_map(|(subject, tuning)| Some((&subject.name, tuning?))).collect();
    let of = |get: fn(&Tuning) -> f64| rows.iter().map(move |(_, tuning)| get(tuning));
    let costs = || of(|t| t.at_half / t.at_matrix);
    let is_faster = |t: &Tuning| t.at_half < t.at_matrix;
    // By its symmetry points of a dodecahedron excite few modes.
    let name = "the dodecahedron".to_owned();
    let dodecahedron = Tuning::new(&exact("dodecahedron")?)?.map(|tuning| (&name, tuning));
    let with_it = || rows.iter().chain(&dodecahedron);
    let slow_parts = |faster: bool| {
        let these = with_it().filter(move |(_, t)| is_faster(t) == faster && !t.slow_part.is_nan());
        these.map(|(_, t)| t.slow_part).collect::<Vec<f64>>()
    };
    let fastest = with_it().min_by(|(_, a), (_, b)| {
        let ratio = |t: &Tuning| t.at_half / t.at_matrix;
        ratio(a).total_cmp(&ratio(b))
    });
    Ok(Finding::settled(vec![
        Evidence::at_most(
            "median of iterations at ω = ½ over those at the matrix's best ω, to 10⁻⁶ L",
            median(costs().collect()),
            2.0,
        ),
        Evidence::shown("the largest such ratio", largest(costs())),
        Evidence::shown("the smallest such ratio", smallest(costs())),
        Evidence::below(
            "the ratio on the dodecahedron itself",
            dodecahedron.as_ref().map_or(f64::NAN, |(_, t)| t.at_half / t.at_matrix),
            1.0,
        ),
        Evidence::shown("meshes on which ω = ½ is the faster", rows.iter().filter(|(_, t)| is_faster(t)).count()),
        Evidence::shown("meshes", rows.len()),
        Evidence::at_least("smallest best ω of the matrix, 2/(λ_min + λ_max) of D⁻¹A", smallest(of(|t| t.of_matrix)), 0.5),
        Evidence::shown("median best ω of the matrix", median(of(|t| t.of_matrix).collect())),
        Evidence::shown("largest best ω of the matrix", largest(of(|t| t.of_matrix))),
        Evidence::shown("smallest best ω for the data, of 0.3, 0.35 … 1.95 and these two", smallest(of(|t| t.of_data))),
        Evidence::shown("median best ω for the data", median(of(|t| t.of_data).collect())),
        Evidence::shown("largest best ω for the data", largest(of(|t| t.of_data))),
        Evidence::shown(
            "median of iterations at ω = ½ over those at the best ω for the data",
            median(of(|t| t.at_half / t.at_data).collect()),
        ),
        Evidence::shown("the largest of these ratios", largest(of(|t| t.at_half / t.at_data))),
        Evidence::shown(
            "part of the first error in modes that ½ shrinks by less than the spectral radius at that ω, largest where ½ is the faster, the dodecahedron too",
            largest(slow_parts(true)),
        ),
        Evidence::shown("the same, median of the other meshes", median(slow_parts(false))),
    ])
    .remark(format!(
        "The guess is always safe (T6), and never above the matrix's best ω, which makes the error of the worst points \
         shrink fastest: both ends of the spectrum by ρ = 1 − ωλ_min alike. Points do not excite them alike. ω = ½ shrinks by \
         less than ρ only modes with λ < 2ωλ_min. Where the first error has no part in these to speak of, but one at the upper \
         end, it needs fewer iterations: on {} {:.0} against {:.0}. The part is one of the norm in which the modes are \
         orthogonal, on meshes of at most {DENSE} vertices.",
        fastest.map_or("", |(name, _)| name),
        fastest.map_or(f64::NAN, |(_, t)| t.at_half),
        fastest.map_or(f64::NAN, |(_, t)| t.at_matrix),
    )))
}

fn convergence(lab: &Lab) -> Result<Finding> {
    struct Row {
        inverse: f64,
        jacobi_max: f64,
        lambda_min: f64,
        outcome: Option<Outcome>,
    }
    let rows = each(lab.polygons(), |subject| {
        let system = subject.system(CC)?;
        let ends = ends(&system)?;
        // Slower ones need more iterations than are of use here.
        let outcome =
            (ends.jacobi_min > 1e-3).then(|| solve_random(&system, Method::Thall, 1e-6, 60_000).report.outcome);
        Ok(Row {
            inverse: largest(system.diagonal.iter().map(|a| 1.0 / a)),
            jacobi_max: ends.jacobi_max,
            lambda_min: ends.min,
            outcome,
        })
    })?;
    let ran = rows.iter().filter_map(|r| r.outcome);
    Ok(Finding::settled(vec![
        Evidence::below("largest 1/a_ii on random meshes", largest(rows.iter().map(|r| r.inverse)), 4.0),
        Evidence::below("largest eigenvalue of D⁻¹A on them", largest(rows.iter().map(|r| r.jacobi_max)), 4.0),
        Evidence::at_least("smallest eigenvalue of A on them", smallest(rows.iter().map(|r| r.lambda_min)), -ROUNDING),
        Evidence::equal(
            "runs at ω = ½ that did not converge to 10⁻⁶ from random points, of those with λ_min(D⁻¹A) > 10⁻³",
            ran.clone().filter(|&o| o != Outcome::Converged).count(),
            0.0,
        ),
        Evidence::shown("runs", ran.count()),
        Evidence::shown("meshes", rows.len()),
    ])
    .also(no_larger_omega()?)
    .remark(
        "Rows of A sum to 1, so λ_max(D⁻¹A) ≤ max 1/a_ii = max n(n+5)/(n² − n + 4Σ 1/|F|) < 4: ω = ½ < 2/λ_max converges \
         whenever A is non-singular. On maps with all valences 3 and faces of k corners the bound is attained.",
    ))
}

/// Maps on which ½ is all but the largest ω that converges.
fn no_larger_omega() -> Result<[Evidence; 4]> {
    const CORNERS: [u32; 4] = [5, 7, 11, 13];
    let (mut deviation, mut max, mut min, mut proven) = (0.0f64, 0.0f64, f64::INFINITY, f64::INFINITY);
    for k in CORNERS {
        let system = subject(format!("PSL(2, {k})"), platonic_map(k)).system(CC)?;
        let ends = ends(&system)?;
        let proof = certify(&system, SymmetricForm::A, End::Lowest, ends.min, 1e-8)?;
        proven = smallest([proven, proof.map_or(f64::NAN, |proof| proof.bound)]);
        let k = f64::from(k);
        deviation = largest([deviation, (ends.jacobi_max - 4.0 * k / (k + 2.0)).abs()]);
        (max, min) = (largest([max, ends.jacobi_max]), smallest([min, ends.min]));
    }
    Ok([
        Evidence::at_most(
            "deviation of λ_max(D⁻¹A) from 4k/(k+2) on the maps of PSL(2, k), k = 5, 7, 11, 13, all valences 3, faces of k corners",
            deviation,
            ROUNDING,
        ),
        Evidence::shown("the largest of these", max),
        Evidence::above("smallest eigenvalue of A on these maps", min, 1e-3),
        Evidence::above("the same as factorizations prove it, all rounding bounded", proven, 1e-3),
    ])
}

fn dominance(lab: &Lab) -> Result<Finding> {
    let (mut printed, mut right) = (0.0f64, 0.0f64);
    for n in 3..=20 {
        let star = subject("", quad_star(n));
        let system = star.system(CC)?;
        let found = excess(&system, n);
        let x = n as f64;
        printed = largest([printed, -found]);
        right = largest([right, (found - (x - 5.0) / (x + 5.0)).abs()]);
    }
    let mut finding = Finding::corrected(
        "shortfall of diagonal dominance (print: none), deviation from (n−5)/(n+5) (right); valences 3…20 in quads",
        printed,
        right,
        ROUNDING,
    );
    let classes = [("3", 3..=3), ("4", 4..=4), ("5", 5..=5), ("6 and more", 6..=usize::MAX)];
    for (name, class) in classes {
        let counts = each(lab.subjects()?, |subject| {
            let system = subject.system(CC)?;
            let of_class = |i: &usize| class.contains(&subject.surface.incidence().face_count(*i));
            let rows: Vec<usize> = (0..system.len()).filter(of_class).collect();
            let dominant = rows.iter().filter(|&&i| excess(&system, i) > ROUNDING).count();
            Ok((dominant, rows.len()))
        })?;
        let [dominant, rows] = [0, 1].map(|k| counts.iter().map(|c| if k == 0 { c.0 } else { c.1 }).sum::<usize>());
        finding = finding.also([
            Evidence::shown(format!("strictly dominant rows of valence {name} on the meshes"), dominant),
            Evidence::shown(format!("rows of valence {name}"), rows),
        ]);
    }
    Ok(finding.remark(
        "Among quads a row has the excess (n−5)/(n+5): strictly dominant from valence 6, weakly at 5, not at 3 and 4. \
         Beside triangles rows are more dominant, beside larger faces less.",
    ))
}

fn global_eigenvalues(_: &Lab) -> Result<Finding> {
    let local = SplittingMatrix::new(LocalScheme::CatmullClark, 4)?.eigenvalues()?;
    let right = largest((1..3).map(|k| (local[k] - 0.5).norm()));
    let (mut printed, mut radius) = (0.0f64, 0.0f64);
    for name in ["torus:8x8", "torus:12x20", "quad-sphere:2"] {
        let all = limitlab::analysis::dense::eigenvalues(&exact(name)?.system(CC)?)?.a;
        radius = largest([radius, (all[all.len() - 1] - 1.0).abs()]);
        for k in 2..4 {
            printed = largest([printed, (all[all.len() - k] - 0.5).abs()]);
        }
    }
    Ok(Finding::corrected(
        "largest deviation from 0.5 of the second and third eigenvalue of the global matrix (print), of the local one \
         of valence 4 (right)",
        printed,
        right,
        ROUNDING,
    )
    .also([Evidence::at_most("deviation of the global spectral radius from 1", radius, ROUNDING)])
    .remark(
        "½, ½ belong to the splitting matrix of one vertex. Those of the global matrix tend to 1 as meshes grow; \
         checked on torus:8x8, torus:12x20 and quad-sphere:2.",
    ))
}

fn masks_in_numbers(_: &Lab) -> Result<Finding> {
    let deviation = |n: usize, vertex: f64, edge: f64, face: f64| -> Result<f64> {
        let mask = limit_by_powers(LocalScheme::CatmullClark, n)?;
        let printed = |i: usize| [vertex, edge, face][if i == 0 { 0 } else { 1 + (i - 1) / n }];
        Ok(largest(mask.iter().enumerate().map(|(i, w)| (w - printed(i)).abs())))
    };
    // An inverse c [limit − a Σe − b Σf] is right if the limit of what it returns is the one asked for.
    let inverse = |n: usize, c: f64, a: f64, b: f64| -> Result<f64> {
        let mask = limit_by_powers(LocalScheme::CatmullClark, n)?;
        let edges = (mask[0] * c * a - mask[1]).abs();
        let faces = (mask[0] * c * b - mask[1 + n]).abs();
        Ok(largest([(mask[0] * c - 1.0).abs(), edges, faces]))
    };
    Ok(Finding::corrected(
        "largest weight left over in the limit of Eq. 9's inverse",
        inverse(3, 8.0 / 3.0, 4.0 / 9.0, 1.0 / 9.0)?,
        inverse(3, 8.0 / 3.0, 1.0 / 6.0, 1.0 / 24.0)?,
        ROUNDING,
    )
    .also([
        Evidence::at_most("Eq. 6, largest deviation", deviation(4, 4.0 / 9.0, 1.0 / 9.0, 1.0 / 36.0)?, ROUNDING),
        Evidence::at_most("Eq. 7, the same as Eq. 9", inverse(4, 9.0 / 4.0, 1.0 / 9.0, 1.0 / 36.0)?, ROUNDING),
        Evidence::at_most("Eq. 8, largest deviation", deviation(3, 3.0 / 8.0, 1.0 / 6.0, 1.0 / 24.0)?, ROUNDING),
    ])
    .remark("In Eq. 9 the neighbours weigh 1/6 and 1/24, as in Eq. 11."))
}

fn first_iterations(lab: &Lab) -> Result<Finding> {
    let runs = each(lab.subjects()?, |subject| Ok(history(&subject.system(CC)?, subject, Method::Thall, 3)))?;
    let after = |k: usize| runs.iter().map(move |r| r.get(k).copied().unwrap_or(f64::NAN));
    // How much of the error an iteration leaves, at worst.
    let left = |k: usize| largest(after(k).zip(after(k - 1)).map(|(now, before)| now / before));
    let mut evidence: Vec<Evidence> = (1..=3)
        .map(|k| {
            Evidence::below(format!("largest error after iteration {k} over the one before, worst mesh"), left(k), 1.0)
        })
        .collect();
    for k in 0..=3 {
        evidence
            .push(Evidence::shown(format!("largest error over L after {k}, median mesh"), median(after(k).collect())));
        evidence.push(Evidence::shown(format!("largest error over L after {k}, worst mesh"), largest(after(k))));
    }
    evidence.push(Evidence::shown("meshes", runs.len()));
    Ok(Finding::not_decided(
        evidence,
        "The paper has no number for a good approximation, so that none can be held against these: whether one or two \
         iterations are enough depends on the reader's tolerance. What it does say, that the approximations are successively \
         closer (§2.1), holds on all of these meshes. L is the diagonal of the bounding box.",
    ))
}

fn linear_time(_: &Lab) -> Result<Finding> {
    const LEVELS: std::ops::RangeInclusive<usize> = 3..=7;
    let solved = |name: &str| -> Result<(f64, usize)> {
        let system = exact(name)?.system(CC)?;
        let report = solve_random(&system, Method::Thall, 1e-6, 20_000).report;
        Ok((entries_per_vertex(&system), report.iterations))
    };
    let (mut entries, mut counts) = (Vec::new(), Vec::new());
    for level in LEVELS {
        let (own, count) = solved(&format!("quad-sphere:{level}"))?;
        entries.push(own);
        counts.push(count);
    }
    let spread = |v: &[f64]| largest(v.iter().copied()) / smallest(v.iter().copied());
    let iterations: Vec<f64> = counts.iter().map(|&n| n as f64).collect();
    let levels =
        LEVELS.zip(&counts).map(|(level, &count)| Evidence::shown(format!("iterations, quad-sphere:{level}"), count));
    const PRISMS: [&str; 3] = ["prism:9", "prism:17", "prism:33"];
    let mut on_prisms = Vec::new();
    for name in PRISMS {
        on_prisms.push(solved(name)?.1 as f64);
    }
    let prisms =
        PRISMS.iter().zip(&on_prisms).map(|(name, &n)| Evidence::shown(format!("iterations, {name}"), n as usize));
    Ok(Finding::corrected(
        "iterations to 10⁻⁶ from random points, largest over smallest, on prism:9, 17 and 33 (print: any mesh), on \
         quad-sphere:3 … 7 (right: λ_min bounded below)",
        spread(&on_prisms),
        spread(&iterations),
        1.25,
    )
    .also([Evidence::at_most(
        "entries of A a vertex, largest over smallest, quad-sphere:3 … 7 (386 to 98 306 vertices)",
        spread(&entries),
        1.05,
    )])
    .also(levels)
    .also(prisms)
    .remark(
        "The time is O(nm), and m does not depend on n where λ_min(A) is bounded below, as it is with valences from 4 on \
         (λ_min ≥ 1/9): there the algorithm is O(n). It is not where regions of valence 3 grow: on odd prisms λ_min falls \
         like 1/k², and m grows like k².",
    ))
}

fn singular_meshes(_: &Lab) -> Result<Finding> {
    let mut evidence = Vec::new();
    for name in ["cube", "prism:6", "truncated-octahedron"] {
        let ends = ends(&exact(name)?.system(CC)?)?;
        evidence.push(Evidence::at_most(format!("smallest |eigenvalue| of A, {name}"), ends.min.abs(), 1e-13));
    }
    for name in ["prism:7", "dodecahedron", "torus:4x4"] {
        let ends = ends(&exact(name)?.system(CC)?)?;
        evidence.push(Evidence::above(format!("smallest eigenvalue of A, {name}"), ends.min, 1e-3));
    }
    Ok(Finding::refuted(evidence).remark(
        "The cube is closed and two-sided. A is singular exactly when a component has all valences 3 and a bipartite \
         vertex graph; the kernel is the ±1 colouring (P7).",
    ))
}
