//! What Lin and Luo leave to the eye and to others: modified Butterfly beside (L14), other schemes blended (L15); and
//! what they say of Maillot and Stam's push-back (L16).

use glam::DVec3;

use limitlab::Result;
use limitlab::analysis::splitting::{Blended, LocalScheme, SplittingMatrix, characteristic_map};
use limitlab::interpolate::lin_luo::curve::{self, Ends};
use limitlab::interpolate::lin_luo::surface::{largest_fold, refine_n, volume};
use limitlab::mesh::{Mesh, Surface};
use limitlab::schemes::{Refinement, blend};

use super::Claim;
use super::finding::{Evidence, Finding};
use super::lab::{Lab, distance, exact, largest, largest_kink, random_points};
use crate::programs::reproduce::corpus;

pub const CLAIMS: &[Claim] = &[
    Claim {
        id: "L14",
        title: "A model with a hole, by modified Butterfly and by the interpolatory √3 scheme",
        place: "§4, Fig. 5",
        printed: "A model with valences 5 to 8 by both schemes, side by side, without a word on which is smoother.",
        slow: false,
        check: against_butterfly,
    },
    Claim {
        id: "L15",
        title: "Other schemes can be treated in a similar way",
        place: "§7",
        printed: "The focus is on √3 subdivision, but some other schemes can be treated in a similar way.",
        slow: true,
        check: other_schemes,
    },
    Claim {
        id: "L16",
        title: "Push-back cannot have a C¹ limit surface",
        place: "§1",
        printed: "Maillot and Stam's way of placing new edge vertices is not based on carrying the curve case over to surfaces: the essential \
                  reason why it cannot produce a C¹ limit surface.",
        slow: false,
        check: push_back,
    },
];

/// Σ 3θ²l²/A over edges, θ the angle and A the area of both faces: bending of a mesh of triangles, of no unit.
fn bending(surface: &Surface) -> f64 {
    let (faces, topology, points) = (surface.faces(), surface.topology(), surface.positions());
    let area = |f: usize| {
        let [a, b, c] = [0, 1, 2].map(|k| points[faces.face(f)[k] as usize]);
        0.5 * (b - a).cross(c - a)
    };
    let edges = topology.edge_sides().filter_map(|c| {
        let [f, g] = [c, topology.twin(c)?].map(|c| topology.incidence.face_of(c));
        let (a, b) = (area(f), area(g));
        let ends = [c as usize, 3 * f + (c as usize + 1) % 3].map(|c| points[faces.corners()[c] as usize]);
        let angle = a.cross(b).length().atan2(a.dot(b));
        Some(3.0 * angle.powi(2) * ends[0].distance_squared(ends[1]) / (a.length() + b.length()))
    });
    edges.sum()
}

fn against_butterfly(lab: &Lab) -> Result<Finding> {
    let subject = lab.context.subject(&corpus::BOB_TRIANGLES)?;
    let surface = &subject.surface;
    let ones = vec![1.0; surface.len()];
    let mut evidence = Vec::new();
    // 256 and 243 triangles for one.
    for (name, fine) in [
        ("modified Butterfly", Refinement::Butterfly.refined_n(surface, 4)?),
        ("Lin-Luo, α = 1", refine_n(surface, &ones, 5)?.0),
        ("Labsik-Greiner", Refinement::LabsikGreiner.refined_n(surface, 5)?),
    ] {
        evidence.push(Evidence::shown(format!("bending energy, {name}"), bending(&fine)));
        evidence
            .push(Evidence::shown(format!("largest angle between neighbouring faces, {name}"), largest_fold(&fine)));
        evidence.push(Evidence::shown(
            format!("volume over the mesh's, {name}"),
            volume(fine.mesh()) / volume(surface.mesh()),
        ));
    }
    Ok(Finding::not_decided(
        evidence,
        format!(
            "The paper leaves Fig. 5 to the eye. On {}, 256 and 243 times as many triangles. The bending energy is \
             Σ 3θ²l²/A over edges, θ the angle between their faces and A the area of these.",
            subject.name
        ),
    ))
}

/// How far a step on data that do not change along one direction of a torus is from the four-point scheme of the other. New
/// vertices on edges along that direction are to have the value of both ends; the blend gives them P − Δ²P.
fn along_a_line(scheme: Refinement, name: &str) -> Result<f64> {
    let surface = exact(name)?.surface;
    // A function of the first index alone, on a torus of 12 by 7.
    let columns = random_points(12, 5);
    let values: Vec<DVec3> = (0..surface.len()).map(|v| columns[v / 7]).collect();
    let fine: Mesh = blend::refine(&surface.with_positions(values), scheme, 1.0)?;
    let (expected, _) = curve::refine(&columns, &[0.0; 12], Ends::Closed);
    // The nearest of the 24 values that vertices would have.
    let off = fine.positions.iter().map(|p| expected.iter().map(|e| e.distance(*p)).fold(f64::INFINITY, f64::min));
    Ok(largest(off))
}

fn other_schemes(_: &Lab) -> Result<Finding> {
    let mut evidence = Vec::new();
    for (of, refinement, torus, name) in [
        (Blended::Loop, Refinement::Loop, "tri-torus:12x7", "Loop"),
        (Blended::CatmullClark, Refinement::CatmullClark, "torus:12x7", "Catmull-Clark"),
    ] {
        evidence.push(Evidence::above(
            format!("{name}, α = 1: distance of a step from the four-point scheme's, data of one index alone, {torus}"),
            along_a_line(refinement, torus)?,
            0.01,
        ));
        let surface = exact(torus)?.surface;
        let random = surface.with_positions(random_points(surface.len(), 1));
        let kept = blend::refine(&random, refinement, 1.0)?;
        evidence.push(Evidence::equal(
            format!("{name}, α = 1: largest move of an old vertex"),
            distance(&kept.positions[..random.len()], random.positions()),
            0.0,
        ));
        // Away from extraordinary vertices, with points at random.
        let mut fine = random;
        let mut kinks = Vec::new();
        for level in 1..=6 {
            fine = Surface::new(blend::refine(&fine, refinement, 1.0)?)?;
            kinks.push(largest_kink(&fine, fine.positions(), level));
        }
        evidence.push(Evidence::at_most(
            format!("{name}, α = 1: jump of first divided differences after 6 steps over that after 3, {torus}, random points"),
            kinks[5] / kinks[2],
            0.5,
        ));
        for alpha in [0.5, 1.0] {
            let scheme = LocalScheme::Blend { of, alpha };
            let mut failing = 0;
            for n in 4..=12 {
                let leads = SplittingMatrix::new(scheme, n)?.pair_leads()?;
                let check = characteristic_map(scheme, n, scheme.map_rings())?.refine(3)?.check();
                failing += usize::from(!(leads && check.regular && check.injective));
            }
            evidence.push(Evidence::equal(
                format!(
                    "{name}, α = {alpha}: valences of 4…12 without λ_1 = λ_2 > λ_3 and a regular and injective map"
                ),
                failing,
                0.0,
            ));
        }
        let modes = SplittingMatrix::new(LocalScheme::Blend { of, alpha: 1.0 }, 3)?.modes()?;
        let modulus = |pair: bool| {
            let own = modes.iter().filter(|m| (m.frequency == 1) == pair).map(|m| m.value.norm());
            own.filter(|&x| x < 1.0 - 1e-9).fold(0.0, f64::max)
        };
        let margin = format!("{name}, α = 1: λ_1 of frequency 1 less the largest other modulus at valence 3");
        let difference = modulus(true) - modulus(false);
        evidence.push(match of {
            Blended::Loop => Evidence::below(margin, difference, 0.0),
            Blended::CatmullClark => Evidence::above(margin, difference, 0.0),
        });
        for n in [3, 4, 5, 6, 8, 12] {
            let mut last = f64::NAN;
            for alpha in (0..=40).map(|step| 0.05 * f64::from(step)) {
                if !SplittingMatrix::new(LocalScheme::Blend { of, alpha }, n)?.pair_leads()? {
                    break;
                }
                last = alpha;
            }
            evidence.push(Evidence::shown(
                format!("{name}: largest α, of 0, 0.05 … 2, up to which the pair leads at valence {n}"),
                last,
            ));
        }
    }
    Ok(Finding::settled(evidence).remark(
        "With Δ the displacement of the old vertices, these become P + (1 − α)Δ, and new ones what the scheme makes of P − αΔ. At \
         α = 1 it interpolates. But data that do not change along one direction give a surface that does: vertices between equal \
         points go to P − Δ²P, where the four-point scheme has P. On regular \
         triangles the ends of an edge weigh 61/128 and the two opposite vertices 1/8, so it is not Butterfly. At extraordinary \
         vertices the blend of Catmull-Clark has a tangent plane at valences 3 to 12, that of Loop from 4 on; at 3 a complex pair \
         of rotation-invariant modes passes λ_1, as with √3 (L4). Numerical: by eigenvalues, signs of corners' angles of refined maps and \
         jumps on regular meshes; no proof of C¹.",
    ))
}

/// By the same criterion as L15: with β = 1 at all vertices, the scheme being Loop's or Catmull-Clark's.
fn push_back(_: &Lab) -> Result<Finding> {
    const VALENCES: std::ops::RangeInclusive<usize> = 3..=10;
    let fails = |of, n| -> Result<bool> {
        let scheme = LocalScheme::PushBack { of, beta: 1.0 };
        if !SplittingMatrix::new(scheme, n)?.pair_leads()? {
            return Ok(true);
        }
        let check = characteristic_map(scheme, n, scheme.map_rings())?.refine(3)?.check();
        Ok(!(check.regular && check.injective))
    };
    let count = |of, mut valences: std::ops::RangeInclusive<usize>| -> Result<usize> {
        valences.try_fold(0, |sum, n| Ok(sum + usize::from(fails(of, n)?)))
    };
    let what = "of 3…10 without λ_1 = λ_2 > λ_3 and a regular and injective map";
    let surface = exact("torus:12x7")?.surface;
    let columns = random_points(12, 5);
    let along = surface.with_positions((0..surface.len()).map(|v| columns[v / 7]).collect());
    let fine = blend::push_back(&along, Refinement::CatmullClark, 1.0)?;
    let (expected, _) = curve::refine(&columns, &[0.0; 12], Ends::Closed);
    let off = fine.positions.iter().map(|p| expected.iter().map(|e| e.distance(*p)).fold(f64::INFINITY, f64::min));
    Ok(Finding::refuted(vec![
        Evidence::equal(format!("Catmull-Clark pushed back: valences {what}"), count(Blended::CatmullClark, VALENCES)?, 0.0),
        Evidence::equal(format!("Loop pushed back: valences {what}"), count(Blended::Loop, VALENCES)?, 1.0),
        Evidence::equal("of these at valence 3", count(Blended::Loop, 3..=3)?, 1.0),
        Evidence::at_most(
            "Catmull-Clark pushed back: distance of a step from the four-point scheme's, data of one index alone, torus:12x7",
            largest(off),
            1e-13,
        ),
    ])
    .remark(
        "Old vertices moved back to where they were, new ones by the mean of what their edge's ends, or their face's corners, were moved, as \
         Lin and Luo tell it. Pushed back, Catmull-Clark meets the condition at every valence tried, as their own blend does (L15), and Loop at all \
         but 3, where rotation-invariant modes pass λ_1, as their own blend of Loop does. Of data that do not change along one direction \
         pushed-back Catmull-Clark makes the four-point curves, and their blend does not. Numerical, and no proof of C¹, as in \
         L15; which smoothing Maillot and Stam themselves took is not known here.",
    ))
}
