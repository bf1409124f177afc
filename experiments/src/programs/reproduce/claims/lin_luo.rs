//! Lin and Luo's unified curve and √3 schemes: L1–L13.

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use limitlab_factorizations::dense::small_lu;
use nalgebra::{DMatrix, DVector};

use limitlab::Result;
use limitlab::analysis::splitting::{
    LocalScheme, SplittingMatrix, characteristic_map, condition_over_alpha, crossings,
};
use limitlab::interpolate::lin_luo::curve::{self, Ends, fixed_point_radius, jump_norm, jumps};
use limitlab::interpolate::lin_luo::surface::{choose, largest_fold, popping, refine_n, volume};
use limitlab::mesh::{Mesh, Surface};
use limitlab::schemes::{Refinement, labsik_greiner, sqrt3, unified_sqrt3};

use super::Claim;
use super::finding::{Evidence, Finding};
use super::lab::{Lab, distance, exact, largest, limit_by_powers, random_points, smallest};

const ROUNDING: f64 = 1e-12;

pub const CLAIMS: &[Claim] = &[
    Claim {
        id: "L1",
        title: "The four-point scheme from the B-spline's displacements",
        place: "§3, Eq. 3",
        printed: "New points of the four-point scheme are midpoints less half the B-spline's displacements beside.",
        slow: false,
        check: four_points,
    },
    Claim {
        id: "L2",
        title: "The unified curve scheme and its two ends",
        place: "§3, Fig. 3",
        printed: "α = 0 is the four-point scheme, α = 1 the cubic B-spline, and curves between lie between.",
        slow: false,
        check: curve_ends,
    },
    Claim {
        id: "L3",
        title: "Kobbelt's √3 step and its limit",
        place: "§2, Eq. 1 and 2",
        printed: "New vertices at centroids; old ones relaxed by (4 − 2cos(2π/n))/9.",
        slow: false,
        check: sqrt3_step,
    },
    Claim {
        id: "L4",
        title: "The interpolatory √3 scheme is explicit, interpolates and is C¹",
        place: "abstract and §4, Eq. 5 and 6",
        printed: "The explicit mask at any valence keeps old vertices and produces a C¹ limit surface.",
        slow: false,
        check: interpolatory,
    },
    Claim {
        id: "L5",
        title: "The blended scheme, its ends and the sign of Δ",
        place: "§4 and §5, Eq. 4 and 7 to 11",
        printed: "f(P, α) = (P + αΔ(P))/3 and q − (1 − α)Δ(q), with Δ = new − old (§3).",
        slow: false,
        check: blend,
    },
    Claim {
        id: "L6",
        title: "Shrinking and bulge are smaller for 0 < α < 1",
        place: "§5",
        printed: "For α in (0, 1) the surface shrinks or bulges less than at the ends.",
        slow: true,
        check: less_popping,
    },
    Claim {
        id: "L7",
        title: "Interpolation of chosen vertices",
        place: "§5, Fig. 7",
        printed: "Vertices with α = 1 are interpolated, those with α = 0 approached.",
        slow: false,
        check: chosen_vertices,
    },
    Claim {
        id: "L8",
        title: "The eigenvalue condition for α in [0, 2]",
        place: "§6",
        printed: "λ_0 = 1, λ_1 = λ_2 > λ_3 (= λ_4 for n > 3) of R·S·S for all α in [0, 2].",
        slow: true,
        check: condition,
    },
    Claim {
        id: "L9",
        title: "Characteristic maps of Fig. 8",
        place: "§6, Fig. 8",
        printed: "The characteristic maps for valence 3, 4, 5, 7, 8 are regular and injective (α not told).",
        slow: true,
        check: maps,
    },
    Claim {
        id: "L10",
        title: "Labsik and Greiner's mask has no simple closed form",
        place: "abstract and §1",
        printed: "The weights of the existing interpolatory √3 mask at extraordinary vertices are not explicit.",
        slow: false,
        check: explicit_mask,
    },
    Claim {
        id: "L11",
        title: "The curve scheme is C¹ for α in [0, 1], points apart",
        place: "§3",
        printed: "With α_i in [0, 1] the non-uniform scheme produces a C¹ curve.",
        slow: false,
        check: smooth_curves,
    },
    Claim {
        id: "L12",
        title: "The curve scheme is C¹ for any constant α",
        place: "§3",
        printed: "With a constant α, no range given, the scheme produces a C¹ curve.",
        slow: false,
        check: range,
    },
    Claim {
        id: "L13",
        title: "The sense of α",
        place: "§3 against §5",
        printed: "One parameter α controls how near curve and surface come to the control points.",
        slow: false,
        check: senses,
    },
];

/// One B-spline step of a closed polygon: moved points and midpoints.
fn b_spline(p: &[DVec3]) -> (Vec<DVec3>, Vec<DVec3>) {
    let n = p.len();
    let at = |i: usize| p[i % n];
    let moved = (0..n).map(|i| (at(i + n - 1) + 6.0 * at(i) + at(i + 1)) / 8.0);
    let middle = (0..n).map(|i| (at(i) + at(i + 1)) / 2.0);
    (moved.collect(), middle.collect())
}

/// Even and odd points of a refined polygon.
fn split(points: &[DVec3]) -> (Vec<DVec3>, Vec<DVec3>) {
    let pick = |odd: usize| points.iter().skip(odd).step_by(2).copied().collect();
    (pick(0), pick(1))
}

fn four_points(_: &Lab) -> Result<Finding> {
    let p = random_points(12, 1);
    let n = p.len();
    let (moved, middle) = b_spline(&p);
    let delta: Vec<DVec3> = moved.iter().zip(&p).map(|(q, p)| *q - *p).collect();
    let by_eq_3: Vec<DVec3> = (0..n).map(|i| middle[i] - 0.5 * (delta[i] + delta[(i + 1) % n])).collect();
    let at = |i: usize| p[i % n];
    let direct: Vec<DVec3> = (0..n).map(|i| (9.0 * (at(i) + at(i + 1)) - at(i + n - 1) - at(i + 2)) / 16.0).collect();
    Ok(Finding::reproduced(vec![Evidence::at_most(
        "largest distance of Eq. 3 from the weights (−1, 9, 9, −1)/16, a random polygon",
        distance(&by_eq_3, &direct),
        ROUNDING,
    )]))
}

fn curve_ends(_: &Lab) -> Result<Finding> {
    let p = random_points(12, 1);
    let n = p.len();
    let at = |i: usize| p[i % n];
    let (moved, middle) = b_spline(&p);
    let (even_1, odd_1) = split(&curve::refine(&p, &vec![1.0; n], Ends::Closed).0);
    let (even_0, odd_0) = split(&curve::refine(&p, &vec![0.0; n], Ends::Closed).0);
    let four: Vec<DVec3> = (0..n).map(|i| (9.0 * (at(i) + at(i + 1)) - at(i + n - 1) - at(i + 2)) / 16.0).collect();
    // In between: points after six levels on the segment between those of the ends.
    let fine = |alpha: f64| curve::refine_n(&p, &vec![alpha; n], Ends::Closed, 6).0;
    let (low, high) = (fine(0.0), fine(1.0));
    let mut outside = 0.0f64;
    for alpha in [0.25, 0.5, 0.75] {
        let now = fine(alpha);
        // At control points, where the curve moves from the point to the B-spline's.
        for i in (0..now.len()).step_by(64) {
            let (a, b) = (low[i], high[i]);
            let t = (now[i] - a).dot(b - a) / (b - a).length_squared();
            outside = largest([outside, -t, t - 1.0]);
        }
    }
    Ok(Finding::reproduced(vec![
        Evidence::at_most(
            "largest distance from the cubic B-spline at α = 1",
            largest([distance(&even_1, &moved), distance(&odd_1, &middle)]),
            ROUNDING,
        ),
        Evidence::at_most(
            "largest distance from the four-point scheme at α = 0",
            largest([distance(&even_0, &p), distance(&odd_0, &four)]),
            ROUNDING,
        ),
        Evidence::at_most(
            "how far the images of control points at α = ¼, ½, ¾ pass an end of the way from α = 0 to 1, in parts of it",
            outside,
            0.0,
        ),
    ]))
}

fn sqrt3_step(_: &Lab) -> Result<Finding> {
    let mut limit = 0.0f64;
    for n in 3..=50 {
        let mask = limit_by_powers(LocalScheme::Sqrt3 { alpha: 0.0 }, n)?;
        let a = (4.0 - 2.0 * (TAU / n as f64).cos()) / 9.0;
        let beta = 1.0 / (1.0 + 3.0 * a);
        for (i, w) in mask.iter().enumerate() {
            let wanted = if i == 0 { beta } else { (1.0 - beta) / n as f64 };
            limit = largest([limit, (w - wanted).abs()]);
        }
    }
    let surface = star(9)?;
    let mesh = surface.mesh();
    let fine = sqrt3::refine(&surface)?;
    let relaxed = displaced(mesh, |_, p, d| p + d);
    let centers: Vec<DVec3> =
        mesh.faces.iter().map(|f| f.iter().map(|&v| mesh.positions[v as usize]).sum::<DVec3>() / 3.0).collect();
    Ok(Finding::reproduced(vec![
        Evidence::at_most(
            "largest distance from Eq. 1 and 2, random points on star:9",
            largest([
                distance(&fine.positions[..mesh.len()], &relaxed),
                distance(&fine.positions[mesh.len()..], &centers),
            ]),
            ROUNDING,
        ),
        Evidence::at_most(
            "largest deviation of the limit mask 1/(1+3a_n) from the first row of S^64, n = 3…50",
            limit,
            ROUNDING,
        ),
    ]))
}

/// Random points on star:K, which has the valences 4, 6 and K.
fn star(k: usize) -> Result<Surface> {
    let star = exact(&format!("star:{k}"))?.surface;
    Ok(star.with_positions(random_points(star.len(), k as u64)))
}

/// `f(vertex, position, Δ)` at every vertex, Δ = a_n (mean of the neighbours − position), from the faces alone.
fn displaced(mesh: &Mesh, f: impl Fn(usize, DVec3, DVec3) -> DVec3) -> Vec<DVec3> {
    let mut sums = vec![(DVec3::ZERO, 0.0); mesh.len()];
    for face in mesh.faces.iter() {
        for k in 0..3 {
            let sum = &mut sums[face[k] as usize];
            sum.0 += mesh.positions[face[(k + 1) % 3] as usize];
            sum.1 += 1.0;
        }
    }
    let all = sums.into_iter().zip(&mesh.positions).enumerate();
    all.map(|(v, ((sum, n), &p))| {
        let a = (4.0 - 2.0 * (TAU / n).cos()) / 9.0;
        f(v, p, a * (sum / n - p))
    })
    .collect()
}

fn interpolatory(_: &Lab) -> Result<Finding> {
    let at_3 = condition_over_alpha(&[3], &[1.0])?;
    let modes = SplittingMatrix::new(LocalScheme::Sqrt3 { alpha: 1.0 }, 3)?.modes()?;
    let modulus = |frequency: usize| {
        // λ_0 = 1 is of frequency 0.
        let own = modes.iter().filter(|m| m.frequency == frequency).map(|m| m.value.norm());
        own.filter(|&x| x < 1.0 - 1e-9).fold(f64::NAN, f64::max)
    };
    let others: Vec<usize> = (4..=50).collect();
    let failing = condition_over_alpha(&others, &[1.0])?.iter().filter(|c| !c.holds).count();
    // Eq. 5 with 6 written out.
    let mut mask = 0.0f64;
    let mut kept = 0.0f64;
    for k in [3, 4, 5, 7, 12] {
        let surface = star(k)?;
        let mesh = surface.mesh();
        let (fine, _) = unified_sqrt3::refine(&surface, &vec![1.0; mesh.len()])?;
        let parts = displaced(mesh, |_, p, d| (p - d) / 3.0);
        let wanted: Vec<DVec3> = mesh.faces.iter().map(|f| f.iter().map(|&v| parts[v as usize]).sum()).collect();
        mask = largest([mask, distance(&fine.positions[mesh.len()..], &wanted)]);
        kept = largest([kept, distance(&fine.positions[..mesh.len()], &mesh.positions)]);
    }
    let fold = |name: &str, levels: usize| -> Result<f64> {
        let surface = exact(name)?.surface;
        let (fine, _) = refine_n(&surface, &vec![1.0; surface.len()], levels)?;
        Ok(largest_fold(&fine))
    };
    Ok(Finding::refuted(vec![
        Evidence::below(
            "|λ_1| of frequency 1 less the largest other modulus at valence 3",
            largest(at_3.iter().map(|c| c.margin)),
            0.0,
        ),
        Evidence::shown("modulus of the leading pair of frequency 1 at valence 3", modulus(1)),
        Evidence::shown("modulus of the complex pair of frequency 0 at valence 3", modulus(0)),
        Evidence::above(
            "largest angle between neighbouring faces after 8 steps, tetrahedron (valence 3)",
            fold("tetrahedron", 8)?,
            0.5,
        ),
        Evidence::shown("the same, octahedron (valence 4)", fold("octahedron", 8)?),
        Evidence::shown("the same, icosahedron (valence 5)", fold("icosahedron", 8)?),
        Evidence::equal("valences 4 to 50 at which λ_1 = λ_2 > λ_3 fails at α = 1", failing, 0.0),
        Evidence::at_most("largest distance of new vertices from Eq. 5 with the explicit Eq. 6", mask, ROUNDING),
        Evidence::equal("largest move of an old vertex", kept, 0.0),
    ])
    .remark(
        "The mask is explicit and interpolates, as printed. At valence 3 a complex pair of rotation-invariant modes \
         decays more slowly than the pair that spans the tangent plane: the surface comes to a point, with the folds \
         shown, and is not C¹.",
    ))
}

fn blend(_: &Lab) -> Result<Finding> {
    let surface = star(7)?;
    let mesh = surface.mesh();
    let alpha: Vec<f64> = (0..mesh.len()).map(|v| (v % 11) as f64 / 5.0).collect();
    let (fine, parameters) = unified_sqrt3::refine(&surface, &alpha)?;
    // Eq. 10 and the form under Eq. 11, in which no Δ occurs: the sign of Δ inside decides.
    let formed = |sign: f64| {
        let parts = displaced(mesh, |v, p, d| (p + sign * alpha[v] * d) / 3.0);
        let new: Vec<DVec3> = mesh.faces.iter().map(|f| f.iter().map(|&v| parts[v as usize]).sum()).collect();
        let old = displaced(mesh, |v, p, d| p - sign * (1.0 - alpha[v]) * d);
        [old, new].concat()
    };
    let expanded = expanded(mesh, &alpha);
    let means = mesh.faces.iter().map(|f| f.iter().map(|&v| alpha[v as usize]).sum::<f64>() / 3.0);
    let ends = |value: f64| unified_sqrt3::refine(&surface, &vec![value; mesh.len()]);
    let kobbelt = sqrt3::refine(&surface)?;
    Ok(Finding::corrected(
        "largest distance of Eq. 9 and 11 from their expanded forms, with Δ = new − old (print), old − new (right)",
        distance(&formed(1.0), &expanded),
        distance(&formed(-1.0), &expanded),
        ROUNDING,
    )
    .also([
        Evidence::at_most(
            "largest distance of the scheme here from the expanded forms",
            distance(&fine.positions, &expanded),
            ROUNDING,
        ),
        Evidence::at_most(
            "largest distance from the √3 scheme at α = 0",
            distance(&ends(0.0)?.0.positions, &kobbelt.positions),
            ROUNDING,
        ),
        Evidence::equal(
            "largest move of an old vertex at α = 1",
            distance(&ends(1.0)?.0.positions[..mesh.len()], &mesh.positions),
            0.0,
        ),
        Evidence::at_most(
            "largest deviation of a new vertex's α from Eq. 7",
            largest(parameters[mesh.len()..].iter().zip(means).map(|(a, b)| (a - b).abs())),
            ROUNDING,
        ),
    ])
    .remark(
        "The expanded forms (6), (10) and below (11) are right; Δ in Eq. 4, 9 and 11 is old − new, in §3 new − old.",
    ))
}

/// Eq. 10 at all faces and the expanded form of Eq. 11 at all vertices, with the printed weights.
fn expanded(mesh: &Mesh, alpha: &[f64]) -> Vec<DVec3> {
    let mut stars = vec![(DVec3::ZERO, 0.0); mesh.len()];
    for face in mesh.faces.iter() {
        for k in 0..3 {
            let star = &mut stars[face[k] as usize];
            star.0 += mesh.positions[face[(k + 1) % 3] as usize];
            star.1 += 1.0;
        }
    }
    let at = |v: usize| {
        let (sum, n) = stars[v];
        (mesh.positions[v], sum / n, (TAU / n).cos(), alpha[v])
    };
    let old = (0..mesh.len()).map(|v| {
        let (q, mean, cosine, a) = at(v);
        (5.0 + 4.0 * a + 2.0 * (1.0 - a) * cosine) / 9.0 * q + (1.0 - a) * (4.0 - 2.0 * cosine) / 9.0 * mean
    });
    let part = |v: usize| {
        let (p, mean, cosine, a) = at(v);
        (9.0 + 4.0 * a - 2.0 * a * cosine) / 27.0 * p - (4.0 * a - 2.0 * a * cosine) / 27.0 * mean
    };
    let new = mesh.faces.iter().map(|f| f.iter().map(|&v| part(v as usize)).sum());
    old.chain(new).collect()
}

fn less_popping(lab: &Lab) -> Result<Finding> {
    let mut subjects = Vec::new();
    for name in ["octahedron", "icosahedron", "icosphere:2", "star:8"] {
        subjects.push(exact(name)?);
    }
    subjects.push(lab.context.stand_in("irregular-tri:250")?);
    let (mut shrink, mut bulge) = (f64::NEG_INFINITY, f64::NEG_INFINITY);
    let (mut at_0, mut at_1) = (Vec::new(), Vec::new());
    for subject in &subjects {
        let ratio = |alpha: f64| -> Result<f64> {
            let alphas = vec![alpha; subject.surface.len()];
            Ok(popping(&subject.surface, &alphas, 5)?.volume_ratio)
        };
        let (low, high) = (ratio(0.0)?, ratio(1.0)?);
        at_0.push(low);
        at_1.push(high);
        for alpha in [0.1, 0.25, 0.5, 0.75, 0.9] {
            let now = ratio(alpha)?;
            shrink = shrink.max(low - now);
            bulge = bulge.max(now - high);
        }
    }
    Ok(Finding::reproduced(vec![
        Evidence::below(
            "largest volume ratio at α = 0 less one at 0 < α < 1 (below 0: shrinks less), five meshes",
            shrink,
            0.0,
        ),
        Evidence::below("largest volume ratio at 0 < α < 1 less that at α = 1 (below 0: bulges less)", bulge, 0.0),
        Evidence::shown("smallest volume ratio at α = 0", smallest(at_0)),
        Evidence::shown("largest volume ratio at α = 1", largest(at_1)),
    ])
    .remark("Volume after five steps over that of the mesh; α = 0.1, 0.25, 0.5, 0.75, 0.9."))
}

fn chosen_vertices(_: &Lab) -> Result<Finding> {
    let subject = exact("irregular-tri:100")?;
    let n = subject.surface.len();
    let marks: Vec<bool> = (0..n).map(|v| v % 4 == 0).collect();
    let (fine, _) = refine_n(&subject.surface, &choose(&marks, 0.0), 4)?;
    let moved = |marked: bool| {
        let of = (0..n).filter(|&v| marks[v] == marked);
        of.map(|v| fine.positions()[v].distance(subject.surface.positions()[v])).collect::<Vec<_>>()
    };
    Ok(Finding::reproduced(vec![
        Evidence::equal(
            "largest move of a vertex with α = 1 in four steps, irregular-tri:100",
            largest(moved(true)),
            0.0,
        ),
        Evidence::above("smallest move of a vertex with α = 0", smallest(moved(false)), 1e-3),
    ]))
}

fn condition(_: &Lab) -> Result<Finding> {
    let valences: Vec<usize> = (3..=12).collect();
    let at_2 = condition_over_alpha(&valences, &[2.0])?;
    let grid: Vec<f64> = (0..=200).map(|k| k as f64 / 100.0).collect();
    let over = condition_over_alpha(&valences, &grid)?;
    let broken = |c: &&limitlab::analysis::splitting::Condition| !c.holds;
    let below = over.iter().filter(|c| c.valence > 3 && c.alpha <= 1.5).filter(broken).count();
    let mut finding = Finding::refuted(vec![
        Evidence::below(
            "largest |λ_1| − |λ_3| at α = 2 over valences 3 to 12",
            largest(at_2.iter().map(|c| c.margin)),
            0.0,
        ),
        Evidence::equal("failures at valences 4 to 12 and α ≤ 1.5, steps of 0.01", below, 0.0),
        Evidence::shown("points of 2010 at which the condition fails", over.iter().filter(broken).count()),
        Evidence::above(
            "points with n > 3 at which |λ_3| = |λ_4| fails",
            over.iter().filter(|c| c.valence > 3 && !c.third_equals_fourth).count(),
            0.0,
        ),
    ]);
    for n in valences {
        // Where the condition ceases to hold; the last place if there are several.
        let end = crossings(n)?.into_iter().filter(|c| !c.holds_above).map(|c| c.alpha).next_back();
        finding = finding
            .also([Evidence::shown(format!("α at which it ceases to hold at valence {n}"), end.unwrap_or(f64::NAN))]);
    }
    Ok(finding.remark(
        "What overtakes λ_1 is rotation-invariant: a simple eigenvalue from valence 4 on, a complex pair at valence 3. The blend needs three rings, 1 + 6n vertices.",
    ))
}

fn maps(_: &Lab) -> Result<Finding> {
    const FIGURE: [usize; 5] = [3, 4, 5, 7, 8];
    let failing = |alpha: f64| -> Result<usize> {
        let scheme = LocalScheme::Sqrt3 { alpha };
        let mut failing = 0;
        for n in FIGURE {
            // No map where the leading pair is complex.
            let good = match characteristic_map(scheme, n, scheme.map_rings()) {
                Ok(net) => {
                    let check = net.refine(3)?.check();
                    check.regular && check.injective
                }
                Err(_) => false,
            };
            failing += usize::from(!good);
        }
        Ok(failing)
    };
    let mut evidence = Vec::new();
    for alpha in [0.0, 0.5] {
        evidence.push(Evidence::equal(
            format!("maps of the five that are not regular and injective at α = {alpha}"),
            failing(alpha)?,
            0.0,
        ));
    }
    for alpha in [1.0, 1.5] {
        evidence.push(Evidence::shown(format!("the same at α = {alpha}"), failing(alpha)?));
    }
    Ok(Finding::reproduced(evidence).remark(
        "Checked by the signs of all corner angles of the refined nets and the winding of their outer ring. \
         Where a map exists, it need not decide: at valence 3 and α = 1 other modes are larger (L4).",
    ))
}

fn explicit_mask(_: &Lab) -> Result<Finding> {
    // The eigenvalues that the mask is made of, found again in the matrix of three rings and two steps.
    let (mut pair, mut margin) = (0.0f64, f64::INFINITY);
    for n in (3..=50).filter(|&n| n != 6) {
        let modes = SplittingMatrix::new(LocalScheme::LabsikGreiner, n)?.modes()?;
        let of = |frequency: usize| {
            let own = modes.iter().filter(move |m| m.frequency == frequency);
            own.map(|m| m.value.norm())
        };
        let leading = of(1).next().unwrap_or(f64::NAN);
        let square = (2.0 / 3.0 * (PI / n as f64).cos()).powi(2);
        pair = largest([pair, (leading - square).abs()]);
        let others = (0..=n / 2).filter_map(|k| of(k).nth(usize::from(k < 2)));
        margin = smallest([margin, leading - largest(others)]);
    }
    let mut listed = 0.0f64;
    let lists: [(usize, &[f64]); 2] = [
        (3, &[8.0 / 9.0, 4.0 / 27.0, 4.0 / 27.0, -5.0 / 27.0]),
        (4, &[7.0 / 9.0, 2.0 / 9.0, 2.0 / 9.0, -1.0 / 9.0, -1.0 / 9.0]),
    ];
    for (n, list) in lists {
        let (center, ring) = labsik_greiner::extraordinary_mask(n);
        let found = [center].into_iter().chain(ring);
        listed = largest(found.zip(list).map(|(w, l)| (w - l).abs()).chain([listed]));
    }
    // What the eigenvalues 1, μ, μ, μ², μ², μ² ask of the n weights, solved by elimination: harmonics of the ring from μ² on by
    // falling order, and none beyond the second.
    let mut solved = 0.0f64;
    for n in 5..=100 {
        let mu = labsik_greiner::subdominant(n);
        let angle = |j: usize| (2.0 * j as f64 - 1.0) * PI / n as f64;
        // cos 0, cos 1, sin 1, cos 2, …: n of them; with n even the last cosine vanishes on all of the ring.
        let harmonic = |k: usize| (k.div_ceil(2), k % 2 == 1);
        let mut rows: Vec<(usize, bool)> = (0..n).map(harmonic).collect();
        if n % 2 == 0 {
            rows[n - 1] = (n / 2, false);
        }
        let matrix = DMatrix::from_fn(n, n, |row, j| {
            let (k, cosine) = rows[row];
            let phase = k as f64 * angle(j);
            if cosine || k == 0 { phase.cos() } else { phase.sin() }
        });
        let wanted = DVector::from_fn(n, |row, _| match rows[row] {
            (0, _) => mu * mu,
            (1, true) => mu,
            (2, true) => mu * mu,
            _ => 0.0,
        });
        let weights = small_lu(matrix).solve(&wanted);
        let (_, ring) = labsik_greiner::extraordinary_mask(n);
        let off = weights.map_or(f64::NAN, |weights| largest(weights.iter().zip(&ring).map(|(w, r)| (w - r).abs())));
        solved = largest([solved, off]);
    }
    let mut finding = Finding::refuted(vec![
        Evidence::at_most(
            "largest deviation of the closed form from the weights that its eigenvalues determine, by elimination, valences 5 to 100",
            solved,
            ROUNDING,
        ),
        Evidence::at_most(
            "largest deviation of the mask (μ² + 2μ cos + 2μ² cos 2)/n, μ = ⅔cos(π/n), from the fractions in \
                           use at valence 3 and 4",
            listed,
            ROUNDING,
        ),
        Evidence::at_most("largest deviation of λ_1 = λ_2 of R·S·S from μ², valences 3 to 50", pair, 1e-9),
        Evidence::above("λ_1 less the largest other modulus, least over these valences", margin, 0.0),
    ]);
    for name in ["tetrahedron", "octahedron", "icosahedron", "star:8"] {
        let surface = exact(name)?.surface;
        let shape = |fine: &Surface| (volume(fine.mesh()) / volume(surface.mesh()), largest_fold(fine));
        let theirs = shape(&Refinement::LabsikGreiner.refined_n(&surface, 8)?);
        let ours = shape(&refine_n(&surface, &vec![1.0; surface.len()], 8)?.0);
        for (scheme, (volume, fold)) in [("Labsik-Greiner", theirs), ("Lin-Luo", ours)] {
            finding = finding.also([
                Evidence::shown(format!("volume over the mesh's, {name}, {scheme}"), volume),
                Evidence::shown(
                    format!("largest angle between neighbouring faces after 8 steps, {name}, {scheme}"),
                    fold,
                ),
            ]);
        }
    }
    Ok(finding.remark(
        "A closed form there is, and no longer than Eq. 6: a mask on one ring whose eigenvalues are 1, μ, μ, μ², μ², μ². \
         Labsik and Greiner's paper is not at hand: the rule is that of OpenMesh's subdivider of this name, which cites it, \
         and it follows from those eigenvalues. The surfaces differ most at valence 3, where Lin and Luo's is not C¹ \
         (L4) and this one's leading pair dominates.",
    ))
}

fn smooth_curves(_: &Lab) -> Result<Finding> {
    let uniform = largest((0..=20).map(|k| jump_norm(k as f64 / 20.0, 10)));
    let points = random_points(10, 3);
    let alpha: Vec<f64> = random_points(10, 4).iter().map(|p| (p.x + 1.0) / 2.0).collect();
    let measured = jumps(&points, &alpha, 14, 1);
    Ok(Finding::reproduced(vec![
        Evidence::below("largest ‖S^10‖ of the rule of the jumps of first differences, α = 0, 0.05, … 1", uniform, 1.0),
        Evidence::at_most(
            "largest jump of first divided differences at level 14 over that at level 4, a random polygon with α_i at random",
            measured[14] / measured[4],
            0.01,
        ),
    ])
    .remark("The norm below 1 proves C¹ for each constant α; points with α of their own are measured."))
}

fn range(_: &Lab) -> Result<Finding> {
    let inside = largest((0..=15).map(|k| jump_norm(-1.7 + 0.5 * k as f64, 15)));
    let outside = smallest([-2.2, 6.2].map(fixed_point_radius));
    let ends = largest([-2.0, 6.0].map(|alpha| (fixed_point_radius(alpha) - 1.0).abs()));
    let points = random_points(10, 3);
    let measured = jumps(&points, &[6.2; 10], 12, 1);
    Ok(Finding::corrected(
        "factor of the jumps of first differences: least radius at α = −2.2 and 6.2 (print: any α), largest ‖S^15‖ for \
         −1.7 ≤ α ≤ 5.8 (right)",
        outside,
        inside,
        1.0 - ROUNDING,
    )
    .also([
        Evidence::at_most("deviation of the radius from 1 at α = −2 and 6", ends, ROUNDING),
        Evidence::above(
            "jump of a random polygon at level 12 over that at level 4, α = 6.2",
            measured[12] / measured[4],
            1.0,
        ),
    ])
    .remark("C¹ exactly for −2 < α < 6, as far as tried."))
}

fn senses(_: &Lab) -> Result<Finding> {
    let points = random_points(10, 3);
    let curve_moves = |alpha: f64| {
        let (even, _) = split(&curve::refine(&points, &[alpha; 10], Ends::Closed).0);
        distance(&even, &points)
    };
    let surface = star(7)?;
    let mesh = surface.mesh();
    let (fine, _) = unified_sqrt3::refine(&surface, &vec![1.0; mesh.len()])?;
    Ok(Finding::corrected(
        "largest move of a control point of the curve, with α = 1 interpolating as for surfaces (print), α = 0 (right)",
        curve_moves(1.0),
        curve_moves(0.0),
        ROUNDING,
    )
    .also([Evidence::equal(
        "largest move of a control point of the surface at α = 1",
        distance(&fine.positions[..mesh.len()], &mesh.positions),
        0.0,
    )])
    .remark("The senses are opposite: curves interpolate at α = 0, surfaces at α = 1."))
}
