//! Zheng and Cai's interpolation with Doo-Sabin surfaces, and Nasri's: Z1–Z25. Type-V faces are checked in
//! [`faces`], iteration counts and times in [`zheng_cai_speed`].

use std::f64::consts::TAU;

use glam::DVec3;

use limitlab::Result;
use limitlab::analysis::order_study::order_study;
use limitlab::analysis::spectral_radius::sweep_radius;
use limitlab::assemble::{LimitSystem, Stages};
use limitlab::interpolate::zheng_cai::{Constraints, PhaseOne, interpolate};
use limitlab::mesh::Surface;
use limitlab::mesh::order::Order;
use limitlab::schemes::doo_sabin::CornerRule;
use limitlab::schemes::{Refinement, Scheme};
use limitlab::solvers::system::sweep;
use limitlab::solvers::{Method, Outcome, Stop};

use super::finding::{Evidence, Finding};
use super::lab::{Lab, each, ends, exact, excess, largest, median, smallest, solve_random};
use super::{Claim, zheng_cai_faces as faces, zheng_cai_fronts as fronts, zheng_cai_speed};
use crate::programs::reproduce::context::Subject;

const ROUNDING: f64 = 1e-12;

const GAUSS_SEIDEL: Method = Method::GaussSeidel { order: None };

pub const CLAIMS: &[Claim] = &[
    Claim {
        id: "Z1",
        title: "Doo-Sabin weights and their rewritten form",
        place: "§2 and §3.1, Eq. 1 to 3",
        printed: "α_ij of Eq. 1 is (V_i + A)/2 + Δ_i with the perturbation of Eq. 3.",
        slow: false,
        check: weights,
    },
    Claim {
        id: "Z2",
        title: "Valence 4 after one step; centroids are interpolated",
        place: "§2",
        printed: "After one step all vertices have valence 4, the number of non-quads stays, centroids stay.",
        slow: false,
        check: after_one_step,
    },
    Claim {
        id: "Z3",
        title: "The constraint row and its sums",
        place: "§3.1 and §3.2, Eq. 5 and 6",
        printed: "The coefficient of V is m + Σ1/m_i; those of the others sum to Σ(1 − 1/m_i) < m.",
        slow: false,
        check: row_sums,
    },
    Claim {
        id: "Z4",
        title: "Strictly diagonally dominant, always non-singular",
        place: "§3.2",
        printed: "The linear system is diagonally dominant and always non-singular.",
        slow: true,
        check: never_singular,
    },
    Claim {
        id: "Z5",
        title: "Gauss-Seidel and Jacobi converge on every mesh",
        place: "§3.2, Eq. 7",
        printed: "Both iterations converge because of the diagonal dominance.",
        slow: true,
        check: both_converge,
    },
    Claim {
        id: "Z6",
        title: "The order of Gauss-Seidel",
        place: "§3.2 and §5",
        printed: "The order affects the speed of convergence; which one to choose is worth investigating.",
        slow: true,
        check: order,
    },
    Claim {
        id: "Z7",
        title: "Perturbed type-V faces: centroid, plane, smallest change",
        place: "§3.3, Eq. 8 to 17",
        printed: "Eq. 17 is the smallest change that puts the centroid on I and the face into a plane.",
        slow: false,
        check: faces::perturbation,
    },
    Claim {
        id: "Z8",
        title: "Step 4 of the pseudo-code",
        place: "§3.4",
        printed: "ε_k = [(W_c − W_k)·n] n + (V − W_c).",
        slow: false,
        check: faces::pseudo_code,
    },
    Claim {
        id: "Z9",
        title: "Iterations at 0.3 % on two models",
        place: "§3.5",
        printed: "A model of 562 vertices takes three iterations, one of 11 540 two.",
        slow: false,
        check: zheng_cai_speed::sweeps,
    },
    Claim {
        id: "Z10",
        title: "Speed against Nasri's system by Gaussian elimination",
        place: "§3.5",
        printed: "4.9 ms against 1.4 s at 562 vertices, about 286 times.",
        slow: false,
        check: zheng_cai_speed::speed,
    },
    Claim {
        id: "Z11",
        title: "Nasri's method fails at 11 540 vertices",
        place: "§3.5",
        printed: "Nasri's method failed because of the large size of the linear system (512 MB of memory).",
        slow: false,
        check: zheng_cai_speed::size,
    },
    Claim {
        id: "Z12",
        title: "When Nasri's matrix is non-singular",
        place: "§1, §3, Remark 1",
        printed: "It is unclear in which situations the matrix of Nasri's method is non-singular.",
        slow: true,
        check: nasri_non_singular,
    },
    Claim {
        id: "Z13",
        title: "Linear complexity at fixed iterations",
        place: "Remark 1",
        printed: "With a fixed number of iterations the complexity is linear in the number of vertices.",
        slow: false,
        check: zheng_cai_speed::linear_time,
    },
    Claim {
        id: "Z14",
        title: "Exact interpolation from an approximate auxiliary mesh",
        place: "Remark 2",
        printed: "The surface interpolates exactly although the auxiliary mesh is approximate.",
        slow: false,
        check: faces::exact_interpolation,
    },
    Claim {
        id: "Z15",
        title: "Given normals; n and −n give the same",
        place: "§4.1",
        printed: "With n in place of the average normal the surface has that normal, and n and −n are the same.",
        slow: false,
        check: faces::given_normals,
    },
    Claim {
        id: "Z16",
        title: "Shape handles",
        place: "§4.2",
        printed: "W' = D + S(W − D) adjusts the shape; centroid and plane of each face stay.",
        slow: false,
        check: faces::shape_handles,
    },
    Claim {
        id: "Z17",
        title: "A subset of the vertices",
        place: "§2 and §3",
        printed: "Vertices that are not interpolated keep V_j = I_j, and the system is still soluble.",
        slow: true,
        check: subset,
    },
    Claim {
        id: "Z18",
        title: "A planar face's plane is the tangent plane",
        place: "§2",
        printed: "A planar face and the tangent plane at its centroid coincide.",
        slow: false,
        check: faces::tangent_plane,
    },
    Claim {
        id: "Z19",
        title: "Provably well-conditioned",
        place: "Remark 1",
        printed: "The linear system is provably well-conditioned in all situations.",
        slow: true,
        check: well_conditioned,
    },
    Claim {
        id: "Z20",
        title: "Five iterations are enough",
        place: "§3.4",
        printed: "ITE_MAX = 5 gives a pretty good approximation in most cases.",
        slow: true,
        check: zheng_cai_speed::five_iterations,
    },
    Claim {
        id: "Z21",
        title: "Type-V faces are separated",
        place: "§3.3",
        printed: "All faces of the first refinement that belong to interpolation points are separated.",
        slow: false,
        check: faces::separated_faces,
    },
    Claim {
        id: "Z22",
        title: "Time of the adjusting phase against the auxiliary mesh",
        place: "§3.5",
        printed: "37 ms against 4.9 ms, 491 ms against 79 ms: six to eight times.",
        slow: true,
        check: zheng_cai_speed::phases,
    },
    Claim {
        id: "Z23",
        title: "On triangle meshes Nasri's matrix is the paper's",
        place: "§3.5 (not said there)",
        printed: "The two methods are compared on two models, as if their systems were different.",
        slow: false,
        check: same_on_triangles,
    },
    Claim {
        id: "Z24",
        title: "A given normal nearly in the face's plane",
        place: "§4.1 (not said there)",
        printed: "Any normal may be required.",
        slow: false,
        check: faces::normal_in_plane,
    },
    Claim {
        id: "Z25",
        title: "Sign in the middle of Eq. 17",
        place: "§3.3, Eq. 11 to 17",
        printed: "ε_k = ((W_k − D)·n) n − (λ − (λ·n) n)/2, D not defined.",
        slow: false,
        check: faces::middle_line,
    },
];

fn weights(_: &Lab) -> Result<Finding> {
    let mut worst = 0.0f64;
    for m in 3..=50 {
        let size = m as f64;
        let cosine = |k: usize| (TAU * k as f64 / size).cos();
        for (k, weight) in CornerRule::DooSabin.circulant(m).into_iter().enumerate() {
            // Eq. 1 for j ≠ i, (m+5)/(4m) else.
            let first = match k {
                0 => (size + 5.0) / (4.0 * size),
                _ => (3.0 + 2.0 * cosine(k)) / (4.0 * size),
            };
            // Eq. 2 and 3: Δ adds (1 + 2cos)/(4m) at j and takes the sum of all from i.
            let delta = |k: usize| (1.0 + 2.0 * cosine(k)) / (4.0 * size);
            let taken: f64 = (1..m).map(delta).sum();
            let second = match k {
                0 => 0.5 + 0.5 / size - taken,
                _ => 0.5 / size + delta(k),
            };
            worst = largest([worst, (first - weight).abs(), (second - weight).abs()]);
        }
    }
    Ok(Finding::reproduced(vec![Evidence::at_most(
        "largest difference of the weights of Eq. 1, of Eq. 2 with 3, and of those used here, m = 3…50",
        worst,
        ROUNDING,
    )]))
}

fn after_one_step(lab: &Lab) -> Result<Finding> {
    let rows = each(&lab.polygons()[..60], |subject| {
        let surface = &subject.surface;
        let others = |surface: &Surface| surface.faces().iter().filter(|f| f.len() != 4).count();
        let of_other_valence =
            |surface: &Surface| (0..surface.len()).filter(|&v| surface.incidence().face_count(v) != 4).count();
        let expected = others(surface) + of_other_valence(surface);
        let (mut not_four, mut changed, mut moved) = (0, 0, 0.0f64);
        let mut now = surface.clone();
        for _ in 0..3 {
            let fine = Refinement::DooSabin.refined(&now)?;
            not_four += of_other_valence(&fine);
            changed += others(&fine).abs_diff(expected);
            // Type-F faces come first, in the order of the old faces.
            let center = |surface: &Surface, f: usize| faces::centroid(surface.mesh(), f);
            let step = (0..now.faces().len()).map(|f| center(&now, f).distance(center(&fine, f)));
            moved = largest([moved, largest(step) / surface.diagonal()]);
            now = fine;
        }
        Ok((not_four, changed, moved))
    })?;
    Ok(Finding::reproduced(vec![
        Evidence::equal(
            "vertices of another valence than 4 at levels 1 to 3, 60 random meshes",
            rows.iter().map(|r| r.0).sum::<usize>(),
            0.0,
        ),
        Evidence::equal(
            "non-quads at these levels, less non-quads and non-4-valent vertices at the start",
            rows.iter().map(|r| r.1).sum::<usize>(),
            0.0,
        ),
        Evidence::at_most(
            "largest move of a face's centroid in a step, over L",
            largest(rows.iter().map(|r| r.2)),
            ROUNDING,
        ),
    ]))
}

fn row_sums(lab: &Lab) -> Result<Finding> {
    let rows = each(lab.polygons(), |subject| {
        let system = subject.system(Scheme::ZhengCai)?;
        let incidence = subject.surface.incidence();
        let (mut worst, mut gap) = (0.0f64, f64::INFINITY);
        for v in 0..system.len() {
            let sizes = || {
                incidence
                    .corners_at(v)
                    .iter()
                    .map(|&c| subject.surface.faces().range(incidence.face_of(c)).len() as f64)
            };
            let m = incidence.face_count(v) as f64;
            let others: f64 = system.m.row(v).filter(|(j, _)| *j != v).map(|(_, z)| z).sum();
            let diagonal = system.m.get(v, v);
            let printed: f64 = sizes().map(|s| 1.0 - 1.0 / s).sum();
            worst = largest([
                worst,
                (diagonal - m - sizes().map(|s| 1.0 / s).sum::<f64>()).abs() / m,
                (others - printed).abs() / m,
            ]);
            gap = smallest([gap, (m - others) / m]);
        }
        Ok((worst, gap))
    })?;
    Ok(Finding::reproduced(vec![
        Evidence::at_most(
            "largest deviation of a row's two sums over m, random meshes",
            largest(rows.iter().map(|r| r.0)),
            ROUNDING,
        ),
        Evidence::above("smallest 1 − Σ(1 − 1/m_i)/m", smallest(rows.iter().map(|r| r.1)), 0.0),
    ]))
}

fn never_singular(lab: &Lab) -> Result<Finding> {
    let rows = each(lab.polygons(), |subject| {
        let system = subject.system(Scheme::ZhengCai)?;
        let least = smallest((0..system.len()).map(|i| excess(&system, i)));
        Ok((least, ends(&system)?.min))
    })?;
    Ok(Finding::reproduced(vec![
        Evidence::above("smallest excess of a row of A, random meshes", smallest(rows.iter().map(|r| r.0)), 0.0),
        Evidence::at_least("smallest eigenvalue of A", smallest(rows.iter().map(|r| r.1)), 0.5 - ROUNDING),
        Evidence::shown("meshes", rows.len()),
    ]))
}

fn both_converge(lab: &Lab) -> Result<Finding> {
    let rows = each(lab.polygons(), |subject| {
        let system = subject.system(Scheme::ZhengCai)?;
        let ends = ends(&system)?;
        let zero = vec![DVec3::ZERO; system.len()];
        let radius = sweep_radius(&system, |x| sweep(&system, &zero, 1.0, 0..zero.len(), x))?;
        let failed = [GAUSS_SEIDEL, Method::Jacobi { omega: Some(1.0) }]
            .into_iter()
            .filter(|&s| solve_random(&system, s, 1e-9, 2000).report.outcome != Outcome::Converged);
        Ok((radius, (1.0 - ends.jacobi_min).max(ends.jacobi_max - 1.0), failed.count()))
    })?;
    let radii = |k: usize| rows.iter().map(move |r| if k == 0 { r.0 } else { r.1 });
    Ok(Finding::reproduced(vec![
        Evidence::equal(
            "runs from random points that did not converge to 10⁻⁹, two a mesh",
            rows.iter().map(|r| r.2).sum::<usize>(),
            0.0,
        ),
        Evidence::below("largest spectral radius of Gauss-Seidel in file order, random meshes", largest(radii(0)), 1.0),
        Evidence::below("largest spectral radius of Jacobi", largest(radii(1)), 1.0),
        Evidence::shown("median radius of Gauss-Seidel", median(radii(0).collect())),
        Evidence::shown("median radius of Jacobi", median(radii(1).collect())),
    ]))
}

fn order(lab: &Lab) -> Result<Finding> {
    const OF_THE_PAPERS: [Scheme; 5] =
        [Scheme::CatmullClark, Scheme::Loop, Scheme::Sqrt3, Scheme::Nasri, Scheme::ZhengCai];
    const MESHES: [&str; 6] = [
        "torus:16x16",
        "irregular-quad:300",
        "irregular-poly:300",
        "tri-torus:16x16",
        "icosphere:2",
        "irregular-tri:300",
    ];
    let (mut spreads, mut costs, mut coloured) = (Vec::new(), Vec::new(), Vec::new());
    for name in MESHES {
        let subject = lab.context.stand_in(name)?;
        for scheme in OF_THE_PAPERS.into_iter().filter(|&s| subject.suits(s)) {
            let system = subject.system(scheme)?;
            let stop = Stop { tolerance: 1e-10 * subject.surface.diagonal(), max_iterations: 10_000 };
            let rows = order_study(&subject.surface, &system, &[1.0], 5, &stop)?;
            // The greedy method has no radius, and its updates are no sweeps.
            let swept = || rows.iter().filter(|r| r.rho.is_some());
            let radii = || swept().filter_map(|r| r.rho);
            let least = smallest(swept().map(|r| r.iterations));
            spreads.push(largest(radii()) - smallest(radii()));
            costs.push(largest(swept().map(|r| r.iterations)) / least);
            let own = swept().filter(|r| r.order == Order::Multicolour.to_string());
            coloured.push(largest(own.map(|r| r.iterations)) / least);
        }
    }
    let mut evidence = vec![
        Evidence::above("largest ratio of sweeps between two orders of twelve", largest(costs.iter().copied()), 1.1),
        Evidence::at_most("largest ratio of multicolour to the fastest order", largest(coloured), 1.25),
        Evidence::shown("median ratio of the slowest to the fastest", median(costs)),
        Evidence::shown("largest difference of the spectral radius", largest(spreads)),
        Evidence::shown("meshes, under all schemes that suit", MESHES.len()),
    ];
    evidence.extend(fronts::evidence()?);
    Ok(Finding::settled(evidence).remark(
        "The order does change the speed. Colour by colour is the fastest or not much behind, and the one that can \
         run in parallel; a front (breadth first, reverse Cuthill-McKee) is slowest on regular meshes: its error shrinks by the \
         symbol of the front, whatever the radius is.",
    ))
}

fn nasri_non_singular(lab: &Lab) -> Result<Finding> {
    let spectra = |subjects: &[Subject]| {
        each(subjects, |subject| {
            let system = subject.system(Scheme::Nasri)?;
            let whole = ends(&system)?;
            // Every third vertex interpolated: a principal submatrix.
            let marks: Vec<bool> = (0..system.len()).map(|v| v % 3 == 0).collect();
            let part = ends(Stages::new(&subject.surface, Scheme::Nasri, Some(&marks))?.block())?;
            Ok([whole.min, whole.max, part.min, part.max])
        })
    };
    let rows = spectra(lab.polygons())?;
    let triangles = spectra(lab.triangles())?;
    let all = |k: usize| rows.iter().map(move |r| r[k]);
    Ok(Finding::settled(vec![
        Evidence::at_least("smallest eigenvalue of Nasri's matrix, random meshes", smallest(all(0)), 0.25 - ROUNDING),
        Evidence::at_most("largest", largest(all(1)), 1.0 + ROUNDING),
        Evidence::at_least("smallest with every third vertex interpolated", smallest(all(2)), 0.25 - ROUNDING),
        Evidence::at_most("largest with every third vertex interpolated", largest(all(3)), 1.0 + ROUNDING),
        Evidence::at_least(
            "smallest on random triangle meshes",
            smallest(triangles.iter().map(|r| r[0])),
            0.5 - ROUNDING,
        ),
        Evidence::shown("meshes", rows.len() + triangles.len()),
    ])
    .remark("Always: the eigenvalues lie in [¼, 1] on every closed mesh, in [½, 1] on triangles, for subsets too."))
}

fn subset(lab: &Lab) -> Result<Finding> {
    let rows = each(lab.polygons(), |subject| {
        let marks: Vec<bool> = (0..subject.surface.len()).map(|v| v % 3 == 0).collect();
        let constraints = Constraints { interpolated: Some(&marks), ..Constraints::default() };
        let phase = PhaseOne { max_iterations: 500, eps: 1e-12, ..PhaseOne::default() };
        let done = interpolate(&subject.surface, &constraints, &phase)?;
        let part = ends(Stages::new(&subject.surface, Scheme::ZhengCai, Some(&marks))?.block())?;
        let free = (0..marks.len()).filter(|&v| !marks[v]);
        let moved = free.map(|v| done.auxiliary.surface.positions()[v].distance(subject.surface.positions()[v]));
        let held = (0..marks.len()).filter(|&v| marks[v]);
        let off = held.map(|v| {
            faces::centroid(done.first.surface.mesh(), done.first.first_vertex_face + v)
                .distance(subject.surface.positions()[v])
        });
        Ok((
            largest(moved.chain([0.0])),
            largest(off) / subject.surface.diagonal(),
            part.min,
            usize::from(!done.auxiliary.passed),
        ))
    })?;
    Ok(Finding::reproduced(vec![
        Evidence::equal(
            "largest move of a vertex not interpolated, random meshes, every third interpolated",
            largest(rows.iter().map(|r| r.0)),
            0.0,
        ),
        Evidence::at_most("largest distance of a centroid from I over L", largest(rows.iter().map(|r| r.1)), ROUNDING),
        Evidence::at_least(
            "smallest eigenvalue of the remaining system",
            smallest(rows.iter().map(|r| r.2)),
            0.5 - ROUNDING,
        ),
        Evidence::equal(
            "runs of Gauss-Seidel that did not settle to 10⁻¹² L",
            rows.iter().map(|r| r.3).sum::<usize>(),
            0.0,
        ),
    ]))
}

fn well_conditioned(lab: &Lab) -> Result<Finding> {
    let rows = each(lab.polygons(), |subject| {
        let ends = ends(&subject.system(Scheme::ZhengCai)?)?;
        Ok(ends.max / ends.min)
    })?;
    Ok(Finding::reproduced(vec![Evidence::at_most(
        "largest condition number λ_max/λ_min of A, random meshes",
        largest(rows),
        2.0 + ROUNDING,
    )])
    .remark(
        "The face blocks (I + J/|F|)/2 have the eigenvalues ½ and 1, so κ ≤ 2 in the norm ‖H^-½·‖₂. Nasri's system has κ ≤ 4 (Z12).",
    ))
}

fn same_on_triangles(lab: &Lab) -> Result<Finding> {
    let difference = |subject: &Subject| -> Result<f64> {
        let [nasri, own] = [Scheme::Nasri, Scheme::ZhengCai].map(|s| subject.system(s));
        let (nasri, own): (LimitSystem, LimitSystem) = (nasri?, own?);
        let pairs = nasri.a.values().iter().zip(own.a.values());
        Ok(largest(pairs.map(|(a, b)| (a - b).abs())))
    };
    let triangles = each(lab.triangles(), difference)?;
    let quads = difference(&exact("torus:8x8")?)?;
    Ok(Finding::settled(vec![
        Evidence::at_most(
            "largest difference of an entry of the two matrices, random triangle meshes",
            largest(triangles),
            ROUNDING,
        ),
        Evidence::above("the same on quads, torus:8x8", quads, 0.01),
    ])
    .remark(
        "1 + 2cos(2π/3) = 0 makes Δ_i of Eq. 3 vanish on triangles. Models of the Princeton Shape Benchmark consist of \
         triangles, so the comparison of §3.5 is one of solvers only.",
    ))
}
