//! What Thall says of ripples, continuity and attributes beside (T32–T36).

use glam::{DQuat, DVec3};

use limitlab::Result;
use limitlab::analysis::splitting::evaluation::RINGS;
use limitlab::analysis::splitting::{ExactSurface, LocalScheme, SplittingMatrix};
use limitlab::interpolate::normals::{Rotation, rotate_rings};
use limitlab::interpolate::thall::{AttributeRule, normal_deviations, refine_attributes};
use limitlab::mesh::{Incidence, Surface};
use limitlab::schemes::{Refinement, catmull_clark};

use super::Claim;
use super::finding::{Evidence, Finding};
use super::lab::{Lab, distance, exact, largest, largest_kink, random_points, smallest};

pub const CLAIMS: &[Claim] = &[
    Claim {
        id: "T32",
        title: "Rotation spread over levels against ripples",
        place: "§2.5",
        printed: "It might be useful to space the rotation out over several subdivision steps, for a smoother surface.",
        slow: false,
        check: spread_rotation,
    },
    Claim {
        id: "T33",
        title: "Minimal rotation within a tolerance against ripples",
        place: "§2.5",
        printed: "It is possible that ripples can be reduced by a perturbation that is just within a tolerance.",
        slow: false,
        check: minimal_rotation,
    },
    Claim {
        id: "T34",
        title: "Smoothing after the rotation against ripples",
        place: "§2.5",
        printed: "The ring of unperturbed vertices around each turned ring can be averaged, to reduce rippling.",
        slow: false,
        check: smoothing,
    },
    Claim {
        id: "T35",
        title: "The surface is C² almost everywhere",
        place: "abstract and §1",
        printed: "The interpolating surface is C² almost everywhere.",
        slow: false,
        check: almost_everywhere,
    },
    Claim {
        id: "T36",
        title: "Attributes by the midpoint rule are C⁰, by the scheme smooth",
        place: "§2.6",
        printed: "The midpoint rule gives continuity of order 0 of the coordinates, the scheme's own of order 2.",
        slow: false,
        check: order_of_attributes,
    },
];

/// Where ripples are measured.
const LEVEL: usize = 5;
/// How far given normals are from those of the surface, in radians.
const TILT: f64 = 0.2;
const MESH: &str = "irregular-poly:60";

/// A control mesh and normals that it has not.
struct Tilted {
    control: Surface,
    wanted: Vec<DVec3>,
    given: Vec<Option<DVec3>>,
}

impl Tilted {
    fn new() -> Result<Self> {
        let control = exact(MESH)?.surface;
        let normals = catmull_clark::limit_normals(&control)?;
        let axes = random_points(control.len(), 1);
        let turned =
            normals.into_iter().zip(axes).map(|(n, axis)| DQuat::from_axis_angle(n.cross(axis).normalize(), TILT) * n);
        let wanted: Vec<DVec3> = turned.collect();
        let given = wanted.iter().copied().map(Some).collect();
        Ok(Tilted { control, wanted, given })
    }

    fn by(&self, rotation: Rotation) -> Result<(Surface, usize)> {
        let found = rotate_rings(&self.control, Refinement::CatmullClark, &self.given, rotation)?;
        Ok((found.surface, found.refinements))
    }

    /// The largest angle from the wanted normals, and the largest distance of limit points from those of the control mesh.
    fn misses(&self, surface: &Surface) -> Result<(f64, f64)> {
        let normals = catmull_clark::limit_normals(surface)?;
        let limits = catmull_clark::limit_positions(surface)?;
        let before = catmull_clark::limit_positions(&self.control)?;
        let n = self.control.len();
        Ok((largest(normal_deviations(&normals[..n], &self.wanted)), distance(&limits[..n], &before)))
    }
}

/// Σ ∠² of the limit normals at both ends of every edge after [`LEVEL`] refinements: ∫ κ₁² + κ₂² but for a factor.
fn bending((surface, refinements): (&Surface, usize)) -> Result<f64> {
    let fine = Refinement::CatmullClark.refined_n(surface, LEVEL - refinements)?;
    let normals = catmull_clark::limit_normals(&fine)?;
    let (faces, topology) = (fine.faces(), fine.topology());
    let squared = topology.edge_sides().map(|c| {
        let [v, w] = [c, topology.incidence.next(faces, c)].map(|c| normals[faces.corners()[c as usize] as usize]);
        v.cross(w).length().atan2(v.dot(w)).powi(2)
    });
    Ok(squared.sum())
}

fn spread_rotation(_: &Lab) -> Result<Finding> {
    let tilted = Tilted::new()?;
    let by = |levels| tilted.by(Rotation { levels, ..Rotation::default() });
    let plain = bending((&tilted.control, 0))?;
    let at_once = by(1)?;
    let spread = by(3)?;
    let (off, moved) = tilted.misses(&spread.0)?;
    let [at_once, spread] = [at_once, spread].map(|(surface, refinements)| bending((&surface, refinements)));
    let (at_once, spread) = (at_once?, spread?);
    Ok(Finding::reproduced(vec![
        Evidence::at_most("largest angle from the wanted normals, turned in three parts, irregular-poly:60", off, 1e-9),
        Evidence::at_most("largest move of a limit point", moved, 1e-12),
        Evidence::below("bending energy, in three parts over at once", spread / at_once, 1.0),
        Evidence::shown("bending energy, at once over without given normals", at_once / plain),
    ])
    .remark(format!(
        "Normals {TILT} off. The bending energy is Σ ∠² of the limit normals at the ends of all edges after {LEVEL} refinements. \
         What is turned at a finer level turns less of the surface, and all parts are met exactly.",
    )))
}

fn minimal_rotation(_: &Lab) -> Result<Finding> {
    const TOLERANCE: f64 = 0.5 * TILT;
    let tilted = Tilted::new()?;
    let exactly = tilted.by(Rotation::default())?;
    let within = tilted.by(Rotation { tolerance: TOLERANCE, ..Rotation::default() })?;
    let (off, moved) = tilted.misses(&within.0)?;
    let [exactly, within] = [exactly, within].map(|(surface, refinements)| bending((&surface, refinements)));
    Ok(Finding::reproduced(vec![
        Evidence::at_most(
            "largest angle from the wanted normals less the tolerance of 0.1, irregular-poly:60",
            off - TOLERANCE,
            1e-9,
        ),
        Evidence::at_most("largest move of a limit point", moved, 1e-12),
        Evidence::below("bending energy, within the tolerance over exact", within? / exactly?, 1.0),
    ]))
}

fn smoothing(_: &Lab) -> Result<Finding> {
    let tilted = Tilted::new()?;
    let (turned, refinements) = tilted.by(Rotation::default())?;
    // In no ring of an original vertex, but next to one.
    let incidence = Incidence::new(turned.faces(), turned.len());
    let mut in_ring = vec![false; turned.len()];
    for v in 0..tilted.control.len() {
        for &c in incidence.corners_at(v) {
            turned.faces().face(incidence.face_of(c)).iter().for_each(|&w| in_ring[w as usize] = true);
        }
    }
    let mut means = Vec::new();
    for v in (0..turned.len()).filter(|&v| !in_ring[v]) {
        let corners = incidence.corners_at(v);
        let faces = || corners.iter().map(|&c| turned.faces().face(incidence.face_of(c)));
        if !faces().flatten().any(|&w| in_ring[w as usize]) {
            continue;
        }
        // The corner after v in each face: every neighbour once.
        let neighbours = faces().map(|face| {
            let place = face.iter().position(|&w| w as usize == v).unwrap_or(0);
            turned.positions()[face[(place + 1) % face.len()] as usize]
        });
        means.push((v, neighbours.sum::<DVec3>() / corners.len() as f64));
    }
    let smoothed = |share: f64| {
        let mut surface = turned.clone();
        for &(v, mean) in &means {
            let point = &mut surface.positions_mut()[v];
            *point += share * (mean - *point);
        }
        surface
    };
    let (full, half) = (smoothed(1.0), smoothed(0.5));
    let (off, moved) = tilted.misses(&full)?;
    let before = bending((&turned, refinements))?;
    Ok(Finding::not_decided(
        vec![
            Evidence::at_most("largest angle from the wanted normals after smoothing, irregular-poly:60", off, 1e-9),
            Evidence::at_most("largest move of a limit point", moved, 1e-12),
            Evidence::shown(
                "bending energy over that without smoothing, vertices at the mean of their neighbours",
                bending((&full, refinements))? / before,
            ),
            Evidence::shown("the same, vertices half-way there", bending((&half, refinements))? / before),
            Evidence::shown("vertices averaged", means.len()),
        ],
        "Those beside a turned ring are averaged, all at once; the rings stay, and with them points and normals. The paper names \
         neither a rule of averaging nor a measure of ripples, and by the bending energy much depends on the rule.",
    ))
}

fn almost_everywhere(_: &Lab) -> Result<Finding> {
    const STEP: f64 = 0.05;
    let (mut jump, mut size) = (0.0f64, 0.0f64);
    for n in [3, 5, 8] {
        let scheme = LocalScheme::CatmullClark;
        let exact = ExactSurface::new(scheme, n)?;
        let control = random_points(scheme.layout().len(n, RINGS), n as u64);
        // Second derivatives where two bicubic patches meet, from either side: of a cubic they follow from four points.
        let second = |at: &dyn Fn(f64) -> DVec3| {
            let difference =
                |k: f64| (at((k - 1.0) * STEP) - 2.0 * at(k * STEP) + at((k + 1.0) * STEP)) / (STEP * STEP);
            2.0 * difference(1.0) - difference(2.0)
        };
        for other in [0.6, 0.8] {
            // Within a sector, on the line between two patches of its refinement; and from a sector to the one before.
            let inside = [1.0, -1.0].map(|side| second(&|t| exact.point(&control, 1, [0.5 + side * t, other])));
            let across =
                [second(&|t| exact.point(&control, 1, [other, t])), second(&|t| exact.point(&control, 0, [t, other]))];
            for [a, b] in [inside, across] {
                jump = largest([jump, a.distance(b)]);
                size = largest([size, a.length()]);
            }
        }
    }
    let ratio = |n: usize| -> Result<f64> {
        let modes = SplittingMatrix::new(LocalScheme::CatmullClark, n)?.modes()?;
        let pair = modes.iter().filter(|m| m.frequency == 1).map(|m| m.value.norm()).fold(0.0, f64::max);
        // Of the quadratic modes: frequencies 0, but for λ_0, and 2.
        let quadratic = modes.iter().filter(|m| matches!(m.frequency, 0 | 2) && m.value.norm() < 1.0 - 1e-9);
        Ok(quadratic.map(|m| m.value.norm()).fold(0.0, f64::max) / (pair * pair))
    };
    let mut evidence = vec![
        Evidence::at_most(
            "largest jump of a second derivative between patches about vertices of valence 3, 5, 8",
            jump / size,
            1e-8,
        ),
        Evidence::at_most(
            "|μ/λ² − 1| at valence 4, λ the subdominant eigenvalue, μ the largest of the modes of curvature",
            (ratio(4)? - 1.0).abs(),
            1e-12,
        ),
    ];
    let others = (5..=50).map(ratio).collect::<Result<Vec<f64>>>()?;
    evidence.push(Evidence::above(
        "least μ/λ² of the valences 5…50: curvature grows without bound",
        smallest(others),
        1.0,
    ));
    evidence.push(Evidence::below("μ/λ² at valence 3: curvature vanishes", ratio(3)?, 1.0));
    Ok(Finding::reproduced(evidence).remark(
        "Everywhere but at extraordinary vertices, where second derivatives go like (μ/λ²)^k towards the vertex. Jumps are relative \
         to the largest second derivative; the points are exact ones (Z30), so that cubics give derivatives without a limit.",
    ))
}

fn order_of_attributes(_: &Lab) -> Result<Finding> {
    const LEVELS: [usize; 2] = [3, 6];
    let start = exact("torus:8x8")?.surface;
    // Jumps of first divided differences along straight lines of edges.
    let kinks = |rule: AttributeRule| -> Result<[f64; 2]> {
        let mut values = random_points(start.len(), 1);
        let mut surface = start.clone();
        let mut found = [0.0; 2];
        for level in 1..=LEVELS[1] {
            values = refine_attributes(&surface, values, rule)?;
            surface = Refinement::CatmullClark.refined(&surface)?;
            if let Some(place) = LEVELS.iter().position(|&l| l == level) {
                found[place] = largest_kink(&surface, &values, level);
            }
        }
        Ok(found)
    };
    let [midpoint, scheme] = [AttributeRule::Midpoint, AttributeRule::Scheme].map(kinks);
    let ([midpoint, scheme], halves) = ([midpoint?, scheme?], 2f64.powi((LEVELS[1] - LEVELS[0]) as i32));
    Ok(Finding::reproduced(vec![
        Evidence::at_least(
            "jump of first divided differences after 6 midpoint splits over that after 3, random values on torus:8x8",
            midpoint[1] / midpoint[0],
            0.5,
        ),
        Evidence::at_most(
            "the same by the scheme, times 8: a bounded second derivative halves it at each level",
            halves * scheme[1] / scheme[0],
            1.5,
        ),
    ])
    .remark("Order 2 but at extraordinary vertices (T35)."))
}
