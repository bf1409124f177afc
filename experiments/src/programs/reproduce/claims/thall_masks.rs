//! Thall's appendix, splitting matrices and masks, and what is settled about ω: T19–T31.

use glam::DVec3;
use nalgebra::DVector;

use limitlab::Result;
use limitlab::analysis::splitting::spectrum::distance_to_space;
use limitlab::analysis::splitting::thall::{PrintedNumber, ThallTables, formula_mask};
use limitlab::analysis::splitting::{LocalScheme, SplittingMatrix, thall_tables};
use limitlab::schemes::Scheme;
use limitlab::schemes::catmull_clark::{refine, refine_in_place};
use limitlab::solvers::{Method, Outcome};

use super::finding::{Evidence, Finding};
use super::lab::{
    Lab, distance, each, ends, exact, iterates, largest, limit_by_powers, random_points, smallest, solve_random,
};
use super::{Claim, thall_surfaces};

const ROUNDING: f64 = 1e-12;

pub const CLAIMS: &[Claim] = &[
    Claim {
        id: "T19",
        title: "Splitting matrix of valence 4",
        place: "§3.1",
        printed: "The 9×9 matrix entry by entry, with eigenvalues 1, 0.5, 0.5.",
        slow: false,
        check: matrix_of_valence_4,
    },
    Claim {
        id: "T20",
        title: "Tangent masks of valence 4; Havemann's are no such",
        place: "§3.1",
        printed: "m_2, m_3 span the left eigenspace of λ_2 = λ_3; Havemann's masks do not lie in it.",
        slow: false,
        check: tangent_masks_4,
    },
    Claim {
        id: "T21",
        title: "Splitting matrix of valence 3, and its λ_2",
        place: "§4",
        printed: "The 7×7 matrix; λ_2 = λ_3 = 0.4109705080055 = (9+√17)/32; m_2, m_3, whose product points inward.",
        slow: false,
        check: matrix_of_valence_3,
    },
    Claim {
        id: "T22",
        title: "λ_2 = λ_3 = (4 + A_n)/16",
        place: "§3.1 and §4.1, Eq. 15 and 16",
        printed: "The subdominant eigenvalues at valence n, with A_n = 1 + cos(2π/n) + cos(π/n)√(2(9 + cos(2π/n))).",
        slow: false,
        check: subdominant,
    },
    Claim {
        id: "T23",
        title: "Table I: limit masks of valence 3 to 12",
        place: "Table I",
        printed: "The limit masks of valences 3 to 12 in numbers.",
        slow: false,
        check: table_1,
    },
    Claim {
        id: "T24",
        title: "Tables II and III: tangent masks of valence 3 and 4",
        place: "Tables II and III",
        printed: "The tangent masks c_2, c_3 of valence 3 and 4 in numbers, by the formulas.",
        slow: false,
        check: tables_2_and_3,
    },
    Claim {
        id: "T25",
        title: "The in-place rule equals the usual one",
        place: "§5.1, Eq. 20 to 22",
        printed: "Eq. 21 rewritten in new edge and face points; the middle line of Eq. 22 has −v/n².",
        slow: false,
        check: in_place,
    },
    Claim {
        id: "T26",
        title: "A full step over-corrects",
        place: "§2.2 and §5",
        printed: "Putting v + δ in place of v (ω = 1) is expected to over-correct.",
        slow: false,
        check: full_step,
    },
    Claim {
        id: "T27",
        title: "The method extends to Loop subdivision",
        place: "abstract, §1",
        printed: "The argument for Catmull-Clark may be trivially extended to Loop subdivision of triangle meshes.",
        slow: true,
        check: other_schemes,
    },
    Claim {
        id: "T28",
        title: "Map between the tables' order and the formulas'",
        place: "§4.1",
        printed: "e_1 of the tables is e_2 of Halstead's formulas, and so on; the f are as in the formulas.",
        slow: false,
        check: index_map,
    },
    Claim {
        id: "T29",
        title: "Frozen creases give artifacts",
        place: "§2.7",
        printed: "Freezing vertices and edges of the initial mesh is suspected to produce undesirable artifacts.",
        slow: false,
        check: thall_surfaces::frozen_creases,
    },
    Claim {
        id: "T30",
        title: "The iteration is called SOR on a Jacobi iteration",
        place: "§2.2 and §5",
        printed: "The iterative process performs a successive overrelaxation on a Jacobi iteration.",
        slow: false,
        check: not_sor,
    },
    Claim {
        id: "T31",
        title: "Order of valences after Eq. 11",
        place: "§2.2, Eq. 10 and 11",
        printed: "The two iterations are for a vertex of valence 3 or 4 respectively.",
        slow: false,
        check: order_of_valences,
    },
];

/// The largest |printed − computed| of the entries chosen; NaN if there is none.
fn deviation(tables: &ThallTables, choose: impl Fn(&PrintedNumber) -> bool) -> f64 {
    let chosen: Vec<f64> =
        tables.entries.iter().filter(|e| choose(e)).map(|e| (e.printed - e.computed).abs()).collect();
    if chosen.is_empty() {
        return f64::NAN;
    }
    largest(chosen)
}

/// The largest distance of the masks chosen from the left eigenspace of λ_2 = λ_3; NaN if there is none.
fn membership(tables: &ThallTables, valence: usize, choose: impl Fn(&str) -> bool) -> Vec<f64> {
    tables.memberships.iter().filter(|m| m.valence == valence && choose(&m.mask)).map(|m| m.distance).collect()
}

fn or_nan(values: Vec<f64>, fold: fn(Vec<f64>) -> f64) -> f64 {
    if values.is_empty() { f64::NAN } else { fold(values) }
}

fn is_matrix(e: &PrintedNumber) -> bool {
    e.item.starts_with("S[")
}

fn matrix_of_valence_4(_: &Lab) -> Result<Finding> {
    let tables = thall_tables()?;
    let eigenvalues = SplittingMatrix::new(LocalScheme::CatmullClark, 4)?.eigenvalues()?;
    let printed = [1.0, 0.5, 0.5];
    let pairs = eigenvalues.iter().zip(printed);
    Ok(Finding::reproduced(vec![
        Evidence::at_most(
            "largest deviation of the 81 entries",
            deviation(&tables, |e| e.valence == 4 && is_matrix(e)),
            ROUNDING,
        ),
        Evidence::at_most(
            "largest deviation of the eigenvalues",
            largest(pairs.map(|(z, p)| (z - p).norm())),
            ROUNDING,
        ),
    ]))
}

fn tangent_masks_4(_: &Lab) -> Result<Finding> {
    let tables = thall_tables()?;
    let own = |mask: &str| !mask.starts_with("Havemann");
    let scaled = tables.memberships.iter().filter(|m| !own(&m.mask));
    Ok(Finding::reproduced(vec![
        Evidence::at_most(
            "largest relative distance of l_2, l_3, m_2, m_3 from the left eigenspace",
            or_nan(membership(&tables, 4, own), largest),
            ROUNDING,
        ),
        Evidence::above(
            "smallest such distance of Havemann's masks",
            or_nan(membership(&tables, 4, |m| !own(m)), smallest),
            0.01,
        ),
        Evidence::shown(
            "largest of the same with Havemann's edge weights times A_n",
            largest(scaled.map(|m| m.distance_scaled)),
        ),
    ]))
}

fn matrix_of_valence_3(_: &Lab) -> Result<Finding> {
    let tables = thall_tables()?;
    let computed = SplittingMatrix::new(LocalScheme::CatmullClark, 3)?.leading_pair()?;
    let closed = (9.0 + 17f64.sqrt()) / 32.0;
    let inward = tables.orientations.iter().filter(|o| o.valence == 3 && o.masks == "printed").map(|o| o.sine);
    Ok(Finding::corrected(
        "deviation of λ_2 from the computed one",
        deviation(&tables, |e| e.valence == 3 && e.item.starts_with('λ')),
        (computed - closed).abs(),
        ROUNDING,
    )
    .also([
        Evidence::at_most(
            "largest deviation of the 49 entries",
            deviation(&tables, |e| e.valence == 3 && is_matrix(e)),
            ROUNDING,
        ),
        Evidence::at_most(
            "largest relative distance of l_2, l_3, m_2, m_3 from the left eigenspace",
            or_nan(membership(&tables, 3, |_| true), largest),
            ROUNDING,
        ),
        Evidence::below("sine of m_2 × m_3 as printed, positive outward", largest(inward), 0.0),
        Evidence::shown("λ_2 computed", computed),
    ])
    .remark("The printed decimals lack a 0: (9+√17)/32 = 0.41009705…, and the closed form is right."))
}

fn subdominant(_: &Lab) -> Result<Finding> {
    let mut worst = 0.0f64;
    for n in 3..=50 {
        let all = SplittingMatrix::new(LocalScheme::CatmullClark, n)?.eigenvalues()?;
        let angle = std::f64::consts::TAU / n as f64;
        let a = 1.0 + angle.cos() + (angle / 2.0).cos() * (2.0 * (9.0 + angle.cos())).sqrt();
        worst = largest([worst, (all[1] - (4.0 + a) / 16.0).norm(), (all[2] - (4.0 + a) / 16.0).norm()]);
    }
    Ok(Finding::reproduced(vec![Evidence::at_most(
        "largest deviation of λ_2 and λ_3 from the formula, n = 3…50",
        worst,
        ROUNDING,
    )])
    .remark("The print counts j modulo n+1 in the masks beside it; modulo n is meant."))
}

fn table_1(_: &Lab) -> Result<Finding> {
    Ok(table_1_from(&thall_tables()?))
}

fn table_1_from(tables: &ThallTables) -> Finding {
    Finding::reproduced(vec![Evidence::at_most(
        "largest deviation of all weights",
        deviation(tables, |e| e.place == "Table I"),
        ROUNDING,
    )])
}

fn tables_2_and_3(_: &Lab) -> Result<Finding> {
    let tables = thall_tables()?;
    let slip = |e: &PrintedNumber| e.place == "Table II" && e.item.starts_with("c_3");
    // Column c_3 of Table II is the formula's shift the other way round: two sectors on is one back.
    let other_way = formula_mask(3, 2);
    let printed: Vec<f64> = tables.entries.iter().filter(|e| slip(e)).map(|e| e.printed).collect();
    let pairs = printed.iter().zip(other_way.iter().skip(1));
    Ok(Finding::corrected(
        "largest deviation of column c_3 of Table II from 4 c_3 by the formula (print), shifted the other way (right)",
        deviation(&tables, slip),
        if printed.len() == 6 { largest(pairs.map(|(p, c)| (p - 4.0 * c).abs())) } else { f64::NAN },
        ROUNDING,
    )
    .also([
        Evidence::at_most(
            "largest deviation of all other entries of both tables",
            deviation(&tables, |e| ["Table II", "Table III"].contains(&e.place) && !slip(e)),
            ROUNDING,
        ),
        Evidence::at_most(
            "largest relative distance of the printed masks from the left eigenspaces",
            or_nan([3, 4].into_iter().flat_map(|n| membership(&tables, n, |m| m.starts_with("m_"))).collect(), largest),
            ROUNDING,
        ),
    ])
    .remark("Column c_3 spans the same tangent plane; its sense is why m_2 × m_3 points inward at valence 3 only."))
}

fn in_place(lab: &Lab) -> Result<Finding> {
    let rows = each(&lab.polygons()[..60], |subject| {
        let usual = refine(&subject.surface)?;
        let own = refine_in_place(subject.surface.clone())?;
        Ok(distance(&usual.positions, &own.positions) / subject.surface.diagonal())
    })?;
    // The middle line with −v/n² as printed and −v/n, against Eq. 21, on random stars.
    let (mut printed, mut right) = (0.0f64, 0.0f64);
    for n in 3..=12 {
        let x = n as f64;
        let points = random_points(2 * n + 1, n as u64);
        let (v, e, f) = (points[0], &points[1..=n], &points[n + 1..]);
        let usual = (x - 2.0) / x * v + e.iter().sum::<DVec3>() / (x * x) + f.iter().sum::<DVec3>() / (x * x);
        let new_edge = |j: usize| (v + e[j] + f[(j + n - 1) % n] + f[j]) / 4.0;
        let sum: DVec3 = (0..n).map(|j| 4.0 * new_edge(j) - f[(j + n - 1) % n]).sum();
        let line = |own: f64| (x - 2.0) / x * v - own * v + sum / (x * x);
        printed = largest([printed, usual.distance(line(1.0 / (x * x)))]);
        right = largest([right, usual.distance(line(1.0 / x))]);
    }
    Ok(Finding::corrected(
        "largest distance of the middle line of Eq. 22 from Eq. 21, random stars n = 3…12",
        printed,
        right,
        ROUNDING,
    )
    .also([Evidence::at_most(
        "largest difference over L of meshes refined by the last line and by Eq. 21, 60 random meshes",
        largest(rows),
        ROUNDING,
    )])
    .remark("The middle line needs −v/n; the last line is right."))
}

fn full_step(lab: &Lab) -> Result<Finding> {
    let step = Method::Jacobi { omega: Some(1.0) };
    let quads = exact("torus:12x12")?;
    let quads_system = quads.system(Scheme::CatmullClark)?;
    let on_quads = ends(&quads_system)?;
    let triangles = lab.context.stand_in("icosphere:2")?;
    let triangles_system = triangles.system(Scheme::CatmullClark)?;
    let on_triangles = ends(&triangles_system)?;
    let ended = |system, wanted| usize::from(solve_random(system, step, 1e-9, 5000).report.outcome == wanted);
    Ok(Finding::reproduced(vec![
        Evidence::above("λ_max(D⁻¹A) − 1 on torus:12x12: part of an error by which a full step overshoots", on_quads.jacobi_max - 1.0, 0.0),
        Evidence::at_most("deviation of the critical ω on torus:12x12 from 8/9", (2.0 / on_quads.jacobi_max - 8.0 / 9.0).abs(), ROUNDING),
        Evidence::equal("runs at ω = 1 there that diverged, of 1", ended(&quads_system, Outcome::Diverged), 1.0),
        Evidence::above("λ_max(D⁻¹A) on icosphere:2", on_triangles.jacobi_max, 1.0),
        Evidence::below("and so it only oscillates there", on_triangles.jacobi_max, 2.0),
        Evidence::equal("runs at ω = 1 there that converged, of 1", ended(&triangles_system, Outcome::Converged), 1.0),
    ])
    .remark("On quads a full step diverges: the spectrum of D⁻¹A on a regular torus is [1/4, 9/4]. Among triangles it overshoots and converges."))
}

fn other_schemes(lab: &Lab) -> Result<Finding> {
    let mut evidence = Vec::new();
    // Of 1/a_ii, and of λ_min.
    let bounds = [
        (Scheme::CatmullClark, 4.0, 0.0),
        (Scheme::Loop, 2.5, 0.1),
        (Scheme::Sqrt3, 8.0 / 3.0, 1.0 / 16.0),
        (Scheme::Nasri, 4.0, 0.25),
        (Scheme::ZhengCai, 2.0, 0.5),
    ];
    for (scheme, bound, least) in bounds {
        let subjects = if scheme.needs_triangles() { lab.triangles() } else { lab.polygons() };
        let rows = each(subjects, |subject| {
            let system = subject.system(scheme)?;
            let inverse = largest(system.diagonal.iter().map(|a| 1.0 / a));
            let ends = ends(&system)?;
            let slow = scheme == Scheme::CatmullClark && ends.jacobi_min < 1e-3;
            let outcome = (!slow).then(|| solve_random(&system, Method::Thall, 1e-6, 60_000).report.outcome);
            Ok((inverse, outcome, ends.min))
        })?;
        let stuck = rows.iter().filter(|r| r.1.is_some_and(|o| o != Outcome::Converged)).count();
        evidence.push(Evidence::at_most(
            format!("largest 1/a_ii under {scheme} on random meshes"),
            largest(rows.iter().map(|r| r.0)),
            bound + ROUNDING,
        ));
        evidence.push(Evidence::at_least(
            format!("smallest eigenvalue of A under {scheme} on random meshes"),
            smallest(rows.iter().map(|r| r.2)),
            least - ROUNDING,
        ));
        evidence.push(Evidence::equal(format!("runs at ω = ½ under {scheme} that did not converge"), stuck, 0.0));
    }
    Ok(Finding::settled(evidence).remark(
        "λ_max(D⁻¹A) ≤ max 1/a_ii ≤ 4 under these five schemes, and λ_min(A) ≥ min (3β_n − 1)/2 > 0 under Loop and √3 (1/10 and \
         1/16 at valence 3), ¼ under Nasri, ½ under Zheng-Cai; under Catmull-Clark A is as in P7. So ω = ½ converges \
         whenever the matrix is non-singular, as it always is but under Catmull-Clark. \
         So it is under mid-edge, where a_ii = ½ and A is singular on bipartite components alone. Runs from random points; Catmull-Clark where λ_min(D⁻¹A) > 10⁻³.",
    ))
}

fn index_map(_: &Lab) -> Result<Finding> {
    let (mut mapped, mut unmapped) = (0.0f64, f64::INFINITY);
    for n in 3..=12 {
        let spaces = SplittingMatrix::new(LocalScheme::CatmullClark, n)?.eigenspaces()?;
        let left = &spaces[1].left;
        for shift in 0..2 {
            let table = formula_mask(n, shift);
            // Table order v, f, e with f_j between e_{j−1} and e_j, into v, e, f with f_j between e_j and e_{j+1}.
            let own = |edge: usize| {
                let mut mask = DVector::zeros(2 * n + 1);
                for j in 0..n {
                    mask[1 + j] = table[1 + n + (j + edge) % n];
                    mask[1 + n + j] = table[1 + (j + 1) % n];
                }
                distance_to_space(&mask, left)
            };
            mapped = largest([mapped, own(0)]);
            unmapped = smallest([unmapped, own(n - 1)]);
        }
    }
    Ok(Finding::reproduced(vec![
        Evidence::at_most(
            "largest relative distance of the mapped formulas from the left eigenspace, n = 3…12",
            mapped,
            1e-10,
        ),
        Evidence::above("smallest such distance without the map", unmapped, 0.01),
    ]))
}

fn not_sor(lab: &Lab) -> Result<Finding> {
    let subject = lab.context.stand_in("irregular-quad:200")?;
    let system = subject.system(Scheme::CatmullClark)?;
    let points = subject.surface.positions();
    let sor = Method::Sor { omega: 0.5, order: None };
    let by_sor = &iterates(&system, points, sor, 1)[0];
    let jacobi = &iterates(&system, points, Method::Thall, 1)[0];
    // Eq. 3 at every vertex by the limit mask alone, all neighbours old.
    let limits = limitlab::schemes::catmull_clark::limit_positions(&subject.surface)?;
    let by_eq_3: Vec<DVec3> = (0..points.len())
        .map(|v| {
            let n = subject.surface.incidence().face_count(v) as f64;
            points[v] + 0.5 * (n + 5.0) / n * (points[v] - limits[v])
        })
        .collect();
    let size = subject.surface.diagonal();
    Ok(Finding::corrected(
        "distance over L of the first iterate of Eq. 3 from SOR with ω = ½ (print), from damped Jacobi (right), irregular-quad:200",
        distance(&by_eq_3, by_sor) / size,
        distance(&by_eq_3, jacobi) / size,
        ROUNDING,
    )
    .remark("Damped (under-relaxed) Jacobi; SOR would use updated neighbours at once."))
}

fn order_of_valences(_: &Lab) -> Result<Finding> {
    let inverse = |n: usize| -> Result<f64> { Ok(1.0 / limit_by_powers(LocalScheme::CatmullClark, n)?[0]) };
    let (three, four) = (inverse(3)?, inverse(4)?);
    let deviation = |first: f64, second: f64| largest([(9.0 / 4.0 - first).abs(), (8.0 / 3.0 - second).abs()]);
    Ok(Finding::corrected(
        "deviation of the factors 9/4 and 8/3 from the inverse weights of the valences named",
        deviation(three, four),
        deviation(four, three),
        ROUNDING,
    )
    .remark("Eq. 10 is for valence 4, Eq. 11 for valence 3."))
}

#[cfg(test)]
mod tests {
    use super::super::finding::Verdict;
    use super::*;

    #[test]
    fn one_broken_printed_weight_changes_the_verdict() {
        let mut tables = thall_tables().unwrap();
        assert_eq!(table_1_from(&tables).verdict(), Verdict::Reproduced);
        let entry = tables.entries.iter_mut().rfind(|e| e.place == "Table I");
        entry.unwrap().printed *= 1.0 + 1e-6;
        assert_eq!(table_1_from(&tables).verdict(), Verdict::NotConfirmed);
        tables.entries.clear();
        assert_eq!(table_1_from(&tables).verdict(), Verdict::NotConfirmed);
    }
}
