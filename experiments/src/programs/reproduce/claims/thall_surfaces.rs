//! Thall's surfaces: irregular faces, error metrics, normals and attributes (T12–T17), frozen creases (T29).

use glam::{DQuat, DVec3};

use limitlab::Result;
use limitlab::assemble::LimitSystem;
use limitlab::interpolate::normals::{Rotation, rotate_rings};
use limitlab::interpolate::thall::{
    AttributeRule, MedialAtom, medial_shifts, normal_deviations, refine_attributes, scaled_distances,
};
use limitlab::mesh::Surface;
use limitlab::mesh::features::{SHARP, Tags};
use limitlab::schemes::{Refinement, Scheme, catmull_clark};
use limitlab::solvers::{Method, Stop, run};

use super::finding::{Evidence, Finding};
use super::lab::{Lab, distance, each, exact, largest, median, random_points};
use crate::programs::reproduce::creases::{Artifacts, Crease, closed_loop, torus_loop};

const CC: Scheme = Scheme::CatmullClark;

/// What sums of some tens of terms of size 1 may lose.
const ROUNDING: f64 = 1e-12;

pub fn regularisation(lab: &Lab) -> Result<Finding> {
    // Eq. 14 itself: the quad's centroid is the polygon's.
    let mut centroids = 0.0f64;
    for m in 3..=12 {
        let p = random_points(m, m as u64);
        let size = m as f64;
        let others: DVec3 = p[2..m - 1].iter().sum();
        let near = p[0] + p[1] + p[m - 1];
        let fourth = 4.0 / size * others - (size - 4.0) / size * near;
        let mean: DVec3 = p.iter().sum::<DVec3>() / size;
        centroids = largest([centroids, mean.distance((near + fourth) / 4.0)]);
    }
    let rows = each(&lab.polygons()[..60], |subject| {
        let surface = &subject.surface;
        let mesh = surface.mesh();
        let fine = Refinement::CatmullClark.refined(surface)?;
        let limits = catmull_clark::limit_positions(surface)?;
        let from_quads = catmull_clark::limit_positions(&fine)?;
        let normals = catmull_clark::limit_normals(surface)?;
        let normals_from_quads = catmull_clark::limit_normals(&fine)?;
        let angles = normal_deviations(&normals_from_quads[..mesh.len()], &normals);
        let defined = angles.iter().zip(&normals).filter(|(_, n)| **n != DVec3::ZERO);
        Ok((distance(&limits, &from_quads[..mesh.len()]) / mesh.diagonal(), largest(defined.map(|(a, _)| *a))))
    })?;
    Ok(Finding::reproduced(vec![
        Evidence::at_most("largest distance of centroids by Eq. 14, faces of 3…12 corners", centroids, ROUNDING),
        Evidence::at_most(
            "largest distance of limit points over L, by R and by splitting first, 60 random meshes",
            largest(rows.iter().map(|r| r.0)),
            ROUNDING,
        ),
        Evidence::at_most("largest angle of their normals", largest(rows.iter().map(|r| r.1)), 1e-9),
    ]))
}

pub fn quads_after_one_split(lab: &Lab) -> Result<Finding> {
    let rows = each(&lab.polygons()[..60], |subject| {
        let extraordinary =
            |surface: &Surface| (0..surface.len()).filter(|&v| surface.incidence().face_count(v) != 4).count();
        let others = |surface: &Surface| surface.faces().iter().filter(|f| f.len() != 4).count();
        let once = Refinement::CatmullClark.refined(&subject.surface)?;
        let twice = Refinement::CatmullClark.refined(&once)?;
        let expected = extraordinary(&subject.surface) + others(&subject.surface);
        Ok([
            others(&once) + others(&twice),
            extraordinary(&once).abs_diff(expected),
            extraordinary(&twice).abs_diff(expected),
        ])
    })?;
    let total = |k: usize| rows.iter().map(|r| r[k]).sum::<usize>();
    Ok(Finding::reproduced(vec![
        Evidence::equal("faces that are no quads after one and two splits, 60 random meshes", total(0), 0.0),
        Evidence::equal(
            "extraordinary vertices after one split, less those before and the faces that were no quads",
            total(1),
            0.0,
        ),
        Evidence::equal("the same after two splits", total(2), 0.0),
    ]))
}

pub fn metrics(_: &Lab) -> Result<Finding> {
    // On the unit sphere the given normals are the points, and every medial atom is the ball itself.
    let subject = exact("irregular-tri:300")?;
    let surface = &subject.surface;
    let mesh = surface.mesh();
    let given: Vec<DVec3> = mesh.positions.iter().map(|p| p.normalize()).collect();
    let system = subject.system(CC)?;
    let stop = Stop { tolerance: 0.0, max_iterations: 100 };
    let control = run(&system, &mesh.positions, Method::Thall, &stop).points;
    let control = surface.with_positions(control);
    let limits = catmull_clark::limit_positions(&control)?;
    let normals = catmull_clark::limit_normals(&control)?;
    let radius = vec![0.1; mesh.len()];
    let start = catmull_clark::limit_positions(surface)?;
    let angles = normal_deviations(&normals, &given);
    let ball = MedialAtom::fit(mesh.positions.iter().copied().zip(given.iter().copied()));
    let shifts = medial_shifts(&mesh.faces, (&limits, &normals), (&mesh.positions, &given));
    let shifts: Vec<f64> = shifts.into_iter().flatten().collect();
    Ok(Finding::in_part(
        vec![
            Evidence::at_most(
                "metric 1 after 100 iterations, r = 0.1, irregular-tri:300 on the unit sphere",
                largest(scaled_distances(&limits, &mesh.positions, &radius)),
                1e-4,
            ),
            Evidence::shown("metric 1 before", largest(scaled_distances(&start, &mesh.positions, &radius))),
            Evidence::above(
                "metric 2: largest angle to the sphere's normals after the iterations",
                largest(angles),
                0.01,
            ),
            Evidence::at_most(
                "metric 3: distance of the fitted medial atom from the sphere's own",
                ball.map_or(f64::NAN, |b| b.position.length() + (b.radius - 1.0).abs()),
                ROUNDING,
            ),
            Evidence::shown("metric 3: median shift of the atoms of the triangles", median(shifts)),
        ],
        "Metrics 1 and 2 are as described. Metric 3 refers to a construction of another chapter of the thesis, which is \
         not at hand: its numbers are those of a least-squares ball that stands in for it.",
    ))
}

pub fn disjoint_rings(lab: &Lab) -> Result<Finding> {
    /// Vertices that lie in the 1-rings of more than one of the first `original` vertices.
    fn shared(surface: &Surface, original: usize) -> usize {
        let mut owner = vec![usize::MAX; surface.len()];
        let mut shared = vec![false; surface.len()];
        for v in 0..original {
            for &c in surface.incidence().corners_at(v) {
                for &w in surface.faces().face(surface.incidence().face_of(c)) {
                    let w = w as usize;
                    shared[w] |= owner[w] != usize::MAX && owner[w] != v;
                    owner[w] = v;
                }
            }
        }
        shared.iter().filter(|&&s| s).count()
    }
    let rows = each(&lab.polygons()[..60], |subject| {
        let n = subject.surface.len();
        let once = Refinement::CatmullClark.refined(&subject.surface)?;
        let twice = Refinement::CatmullClark.refined(&once)?;
        Ok([shared(&once, n), shared(&twice, n)])
    })?;
    let total = |k: usize| rows.iter().map(|r| r[k]).sum::<usize>();
    Ok(Finding::reproduced(vec![
        Evidence::equal("vertices in several original 1-rings after two subdivisions, 60 random meshes", total(1), 0.0),
        Evidence::above("the same after one subdivision", total(0), 0.0),
    ]))
}

pub fn rotated_rings(_: &Lab) -> Result<Finding> {
    let subject = exact("irregular-poly:200")?;
    let surface = &subject.surface;
    let mesh = surface.mesh();
    let limits = catmull_clark::limit_positions(surface)?;
    let wanted: Vec<DVec3> = catmull_clark::limit_normals(surface)?
        .into_iter()
        .zip(random_points(mesh.len(), 1))
        .map(|(n, axis)| DQuat::from_axis_angle(axis.normalize(), 0.4) * n)
        .collect();
    let given: Vec<Option<DVec3>> = wanted.iter().copied().map(Some).collect();
    let turned = rotate_rings(surface, Refinement::CatmullClark, &given, Rotation::default())?;
    let after = catmull_clark::limit_positions(&turned.surface)?;
    let normals = catmull_clark::limit_normals(&turned.surface)?;
    Ok(Finding::reproduced(vec![
        Evidence::at_most(
            "largest angle between wanted and found normals, turned by up to 0.4, irregular-poly:200",
            largest(normal_deviations(&normals[..mesh.len()], &wanted)),
            1e-10,
        ),
        Evidence::at_most(
            "largest move of a limit point over L",
            distance(&limits, &after[..mesh.len()]) / mesh.diagonal(),
            ROUNDING,
        ),
        Evidence::shown("rings turned", turned.turned.len()),
    ]))
}

pub fn attributes(_: &Lab) -> Result<Finding> {
    let subject = exact("irregular-poly:200")?;
    let n = subject.surface.len();
    let values = random_points(n, 1);
    let after = |rule: AttributeRule| -> Result<f64> {
        let mut surface = subject.surface.clone();
        let mut now = values.clone();
        for _ in 0..3 {
            now = refine_attributes(&surface, now, rule)?;
            surface = Refinement::CatmullClark.refined(&surface)?;
        }
        Ok(distance(&now[..n], &values))
    };
    let system = LimitSystem::new(&subject.surface, CC)?;
    let stop = Stop { tolerance: 1e-10, max_iterations: 1 };
    let control = run(&system, &values, Method::Cholesky, &stop).points;
    let limits = catmull_clark::limit_positions(&subject.surface.with_positions(control))?;
    Ok(Finding::reproduced(vec![
        Evidence::equal(
            "largest change of a random value at an original vertex, three midpoint splits, irregular-poly:200",
            after(AttributeRule::Midpoint)?,
            0.0,
        ),
        Evidence::above("the same by Catmull-Clark", after(AttributeRule::Scheme)?, 0.01),
        Evidence::at_most("the same in the limit, values interpolated first", distance(&limits, &values), 1e-9),
    ])
    .remark("The paper expects some creep of interpolated values too: that of the iterations left out."))
}

pub fn frozen_creases(_: &Lab) -> Result<Finding> {
    const LEVELS: usize = 5;
    let subject = exact("torus:10x8")?;
    let size = subject.surface.diagonal();
    let tags = Tags { creases: closed_loop(torus_loop(10, 8, 2), SHARP), ..Tags::default() };
    let [resting, averaged, solved] = Crease::ALL.map(|crease| {
        let control = crease.control(&subject.surface, &tags)?;
        Artifacts::new(&control, subject.surface.positions(), LEVELS)
    });
    let (resting, averaged, solved) = (resting?, averaged?, solved?);
    Ok(Finding::reproduced(vec![
        Evidence::above(
            "vertices that rest: turn of the crease at a vertex in degrees, torus:10x8",
            resting.turn,
            10.0,
        ),
        Evidence::above("the same: angle between facets on one side of it, in degrees", resting.jump, 10.0),
        Evidence::above(
            "vertices averaged along the crease: distance of a limit point from its vertex over L",
            averaged.gap / size,
            1e-3,
        ),
        Evidence::shown("the same: turn in degrees", averaged.turn),
        Evidence::at_most(
            "vertices solved for: distance of a limit point from its vertex over L",
            solved.gap / size,
            1e-9,
        ),
        Evidence::below("the same: turn in degrees, after 5 refinements", solved.turn, 2.0),
        Evidence::below(
            "the same: angle between facets on one side, in degrees, after 5 refinements",
            solved.jump,
            5.0,
        ),
        Evidence::shown("vertices that rest: distance of a limit point from its vertex over L", resting.gap / size),
    ])
    .remark(
        "Frozen vertices that rest give a polygon with a kink in the surface at each, on both sides; frozen ones that \
         are averaged along the crease give a smooth curve that misses them. With the crease rules in the matrix there \
         is neither: (1, 4, 1)/6 along the crease first, then the smooth vertices. The picture is \
         `figures--thall-creases.png`.",
    ))
}
