//! Zheng and Cai's faces of the first refinement, where the surface meets its points (Z7, Z8, Z14–Z16, Z18, Z21,
//! Z24, Z25).

use glam::DVec3;

use limitlab::Result;
use limitlab::interpolate::thall::normal_deviations;
use limitlab::interpolate::zheng_cai::{Auxiliary, Constraints, FirstRefinement, PhaseOne, auxiliary};
use limitlab::mesh::{Mesh, Surface};
use limitlab::schemes::Refinement;
use limitlab::schemes::doo_sabin::{CornerRule, face_normals, refine_by};

use super::finding::{Evidence, Finding};
use super::lab::{Lab, each, largest, median, random_points};
use crate::programs::reproduce::context::Subject;

const ROUNDING: f64 = 1e-12;

pub(super) fn centroid(mesh: &Mesh, f: usize) -> DVec3 {
    let face = mesh.faces.face(f);
    face.iter().map(|&v| mesh.positions[v as usize]).sum::<DVec3>() / face.len() as f64
}

/// Two-phase interpolation after `sweeps` sweeps, with what the correction did: the rings before it.
struct Corrected {
    auxiliary: Auxiliary,
    before: Mesh,
    after: FirstRefinement,
}

fn corrected(subject: &Subject, sweeps: usize, constraints: &Constraints) -> Result<Corrected> {
    let phase = PhaseOne { max_iterations: sweeps, eps: 0.0, ..PhaseOne::default() };
    let surface = &subject.surface;
    let auxiliary = auxiliary(surface, constraints.interpolated, &phase)?;
    let before = refine_by(CornerRule::ZhengCai, &auxiliary.surface)?;
    let after = FirstRefinement::new(&auxiliary.surface, CornerRule::ZhengCai, surface.positions(), constraints)?;
    Ok(Corrected { auxiliary, before, after })
}

/// Corner positions of the type-V face of `v`.
fn ring(mesh: &Mesh, first_vertex_face: usize, v: usize) -> Vec<DVec3> {
    let face = mesh.faces.face(first_vertex_face + v);
    face.iter().map(|&c| mesh.positions[c as usize]).collect()
}

fn mean(points: &[DVec3]) -> DVec3 {
    points.iter().sum::<DVec3>() / points.len() as f64
}

/// Eq. 10.
fn average_normal(ring: &[DVec3]) -> DVec3 {
    let center = mean(ring);
    let next = ring.iter().cycle().skip(1);
    let area: DVec3 = ring.iter().zip(next).map(|(a, b)| (a - center).cross(b - center)).sum();
    area.normalize()
}

const POLYGONS: &str = "irregular-poly:300";

pub(super) fn perturbation(lab: &Lab) -> Result<Finding> {
    let subject = lab.context.stand_in(POLYGONS)?;
    let done = corrected(&subject, 2, &Constraints::default())?;
    let first = done.after.first_vertex_face;
    let size = subject.surface.diagonal();
    let (mut off, mut flat, mut across) = (0.0f64, 0.0f64, 0.0f64);
    for v in 0..subject.surface.len() {
        let (old, new) = (ring(&done.before, first, v), ring(done.after.surface.mesh(), first, v));
        let (n, point) = (average_normal(&old), subject.surface.positions()[v]);
        off = largest([off, mean(&new).distance(point) / size]);
        flat = largest([flat, largest(new.iter().map(|w| (w - point).dot(n).abs() / size))]);
        // Smallest change: orthogonal to all changes that keep centroid and plane.
        let mut free = random_points(new.len(), v as u64);
        free.iter_mut().for_each(|d| *d -= d.dot(n) * n);
        let center = mean(&free);
        let change = old.iter().zip(&new).map(|(a, b)| *b - *a);
        let product: f64 = change.zip(&free).map(|(e, d)| e.dot(*d - center)).sum();
        across = largest([across, product.abs() / size]);
    }
    Ok(Finding::reproduced(vec![
        Evidence::at_most(
            format!("largest distance of a centroid from I over L, {POLYGONS}, two sweeps"),
            off,
            ROUNDING,
        ),
        Evidence::at_most("largest distance of a corner from the plane over L", flat, ROUNDING),
        Evidence::at_most(
            "largest product of the change with an admissible other one over L (0: no smaller change)",
            across,
            ROUNDING,
        ),
    ]))
}

pub(super) fn pseudo_code(lab: &Lab) -> Result<Finding> {
    let subject = lab.context.stand_in(POLYGONS)?;
    let done = corrected(&subject, 2, &Constraints::default())?;
    let first = done.after.first_vertex_face;
    let size = subject.surface.diagonal();
    let (mut printed, mut right) = (0.0f64, 0.0f64);
    for v in 0..subject.surface.len() {
        let old = ring(&done.before, first, v);
        let (n, center) = (average_normal(&old), mean(&old));
        let target = subject.surface.positions()[v];
        let moved = |to: DVec3| {
            let new: Vec<DVec3> = old.iter().map(|w| *w + (center - *w).dot(n) * n + (to - center)).collect();
            mean(&new).distance(target) / size
        };
        printed = largest([printed, moved(done.auxiliary.surface.positions()[v])]);
        right = largest([right, moved(target)]);
    }
    Ok(Finding::corrected(
        "largest distance of a centroid from I over L, with V (print) and I (right) in step 4",
        printed,
        right,
        ROUNDING,
    )
    .remark("Step 4 needs (I − W_c), as Eq. 17 has it: V is the vertex of the auxiliary mesh."))
}

pub(super) fn exact_interpolation(lab: &Lab) -> Result<Finding> {
    let subject = lab.context.stand_in(POLYGONS)?;
    let size = subject.surface.diagonal();
    let done = corrected(&subject, 1, &Constraints::default())?;
    let off = |mesh: &Mesh| {
        let points = subject.surface.positions().iter().enumerate();
        largest(points.map(|(v, p)| centroid(mesh, done.after.first_vertex_face + v).distance(*p) / size))
    };
    Ok(Finding::reproduced(vec![
        Evidence::above(
            format!("largest distance of a centroid from I over L after one sweep, {POLYGONS}, not corrected"),
            off(&done.before),
            1e-3,
        ),
        Evidence::at_most("the same corrected, at level 1", off(done.after.surface.mesh()), ROUNDING),
        Evidence::at_most("the same at level 4", off(&done.after.at_level(4)?), ROUNDING),
    ]))
}

/// One normal a vertex, off the average one by up to 0.8.
fn tilted_normals(subject: &Subject, sign: f64) -> Result<Vec<Option<DVec3>>> {
    let done = corrected(subject, 5, &Constraints::default())?;
    let first = done.after.first_vertex_face;
    let random = random_points(subject.surface.len(), 7);
    Ok((0..subject.surface.len())
        .map(|v| Some(sign * (average_normal(&ring(&done.before, first, v)) + 0.5 * random[v])))
        .collect())
}

pub(super) fn given_normals(lab: &Lab) -> Result<Finding> {
    let subject = lab.context.stand_in(POLYGONS)?;
    let refined = |sign: f64| -> Result<(FirstRefinement, Vec<DVec3>)> {
        let normals = tilted_normals(&subject, sign)?;
        let constraints = Constraints { normals: Some(&normals), ..Constraints::default() };
        let unit = normals.iter().flatten().map(|n| n.normalize()).collect();
        Ok((corrected(&subject, 5, &constraints)?.after, unit))
    };
    let (plus, wanted) = refined(1.0)?;
    let (minus, _) = refined(-1.0)?;
    let fine = plus.at_level(3)?;
    let first = plus.first_vertex_face;
    let normals = face_normals(&fine);
    let found: Vec<DVec3> = (0..wanted.len())
        .map(|v| {
            let n = normals[first + v];
            if n.dot(wanted[v]) < 0.0 { -n } else { n }
        })
        .collect();
    Ok(Finding::reproduced(vec![
        Evidence::at_most(
            format!("largest angle of the surface's normal with ±n at level 3, {POLYGONS}"),
            largest(normal_deviations(&found, &wanted)),
            1e-9,
        ),
        Evidence::at_most(
            "largest difference over L of the meshes for n and −n",
            super::lab::distance(plus.surface.positions(), minus.surface.positions()) / subject.surface.diagonal(),
            1e-15,
        ),
    ]))
}

pub(super) fn shape_handles(lab: &Lab) -> Result<Finding> {
    let subject = lab.context.stand_in(POLYGONS)?;
    let n = subject.surface.len();
    let handles: Vec<f64> = (0..n).map(|v| [0.4, 1.0, 2.5][v % 3]).collect();
    let plain = corrected(&subject, 5, &Constraints::default())?.after;
    let constraints = Constraints { handles: Some(&handles), ..Constraints::default() };
    let scaled = corrected(&subject, 5, &constraints)?.after;
    let size = subject.surface.diagonal();
    let first = plain.first_vertex_face;
    let (mut form, mut off) = (0.0f64, 0.0f64);
    let (mut before, mut after) = (Vec::new(), Vec::new());
    for (v, &handle) in handles.iter().enumerate() {
        let (a, b) = (ring(plain.surface.mesh(), first, v), ring(scaled.surface.mesh(), first, v));
        let d = mean(&a);
        let wrong = a.iter().zip(&b).map(|(a, b)| (*b - (d + handle * (*a - d))).length() / size);
        form = largest([form, largest(wrong)]);
        off = largest([off, mean(&b).distance(subject.surface.positions()[v]) / size]);
        before.push(average_normal(&a));
        after.push(average_normal(&b));
    }
    Ok(Finding::reproduced(vec![
        Evidence::at_most(
            format!("largest distance over L from D + S(W − D), {POLYGONS}, S = 0.4, 1, 2.5"),
            form,
            ROUNDING,
        ),
        Evidence::at_most("largest distance of a centroid from I over L", off, ROUNDING),
        Evidence::at_most(
            "largest angle between the normals with and without handles",
            largest(normal_deviations(&after, &before)),
            1e-9,
        ),
    ]))
}

pub(super) fn tangent_plane(lab: &Lab) -> Result<Finding> {
    let subject = lab.context.stand_in("irregular-poly:60")?;
    let done = corrected(&subject, 5, &Constraints::default())?.after;
    let first = done.first_vertex_face;
    let at_start = face_normals(done.surface.mesh());
    let n = subject.surface.len();
    // The largest angle between a type-V face's plane and the faces beside it.
    let beside = |surface: &Surface| {
        let normals = face_normals(surface.mesh());
        let mut worst = Vec::new();
        for v in 0..n {
            let range = surface.faces().range(first + v);
            let across = range.filter_map(|c| surface.topology().twin(c as u32));
            let pairs = across.map(|t| normals[surface.incidence().face_of(t)]);
            let angles: Vec<f64> = pairs.map(|m| normal_deviations(&[m], &[normals[first + v]])[0]).collect();
            worst.push(largest(angles));
        }
        median(worst)
    };
    let level = |levels: usize| Refinement::DooSabin.refined_n(&done.surface, levels);
    let (second, sixth) = (level(1)?, level(5)?);
    let kept = face_normals(sixth.mesh());
    Ok(Finding::reproduced(vec![
        Evidence::at_most(
            "largest angle between the planes of a type-V face at levels 1 and 6, irregular-poly:60",
            largest(normal_deviations(&kept[first..first + n], &at_start[first..first + n])),
            1e-9,
        ),
        Evidence::at_most(
            "median angle with the faces beside it at level 6 over that at level 2",
            beside(&sixth) / beside(&second),
            0.25,
        ),
    ]))
}

pub(super) fn separated_faces(lab: &Lab) -> Result<Finding> {
    let rows = each(lab.polygons(), |subject| {
        let fine = refine_by(CornerRule::ZhengCai, &subject.surface)?;
        let first = subject.surface.faces().len() + subject.surface.topology().edges();
        let mut uses = vec![0usize; fine.len()];
        for f in first..fine.faces.len() {
            for &v in fine.faces.face(f) {
                uses[v as usize] += 1;
            }
        }
        Ok(uses.iter().filter(|&&u| u != 1).count())
    })?;
    Ok(Finding::reproduced(vec![Evidence::equal(
        "vertices of the first refinement that do not lie in exactly one type-V face, random meshes",
        rows.iter().sum::<usize>(),
        0.0,
    )]))
}

pub(super) fn normal_in_plane(lab: &Lab) -> Result<Finding> {
    let subject = lab.context.stand_in("irregular-poly:60")?;
    let plain = corrected(&subject, 5, &Constraints::default())?;
    let first = plain.after.first_vertex_face;
    let flat = ring(&plain.before, first, 0);
    let normal = average_normal(&flat);
    let side = normal.cross(flat[0] - mean(&flat)).normalize();
    let area = |ring: &[DVec3], n: DVec3| {
        let center = mean(ring);
        let next = ring.iter().cycle().skip(1);
        ring.iter().zip(next).map(|(a, b)| (a - center).cross(b - center)).sum::<DVec3>().dot(n).abs()
    };
    let refined = |given: DVec3| {
        let mut normals = vec![None; subject.surface.len()];
        normals[0] = Some(given);
        let constraints = Constraints { normals: Some(&normals), ..Constraints::default() };
        corrected(&subject, 5, &constraints)
    };
    const TILT: f64 = 1e-3;
    let given = (side + TILT * normal).normalize();
    let tilted = refined(given)?.after;
    let ratio = area(&ring(tilted.surface.mesh(), first, 0), given) / area(&flat, normal);
    Ok(Finding::settled(vec![
        Evidence::at_most(
            "area of a type-V face whose given normal is tilted by 0.001 from its plane, over that of the average normal",
            ratio,
            1.01 * TILT,
        ),
        Evidence::equal("normals in the plane that are refused, of 1", usize::from(refined(side).is_err()), 1.0),
    ])
    .remark("The area shrinks by the cosine between given and average normal: the face collapses to a line."))
}

pub(super) fn middle_line(lab: &Lab) -> Result<Finding> {
    let subject = lab.context.stand_in(POLYGONS)?;
    let done = corrected(&subject, 2, &Constraints::default())?;
    let first = done.after.first_vertex_face;
    let size = subject.surface.diagonal();
    let (mut printed, mut right) = (0.0f64, 0.0f64);
    for v in 0..subject.surface.len() {
        let old = ring(&done.before, first, v);
        let (n, d) = (average_normal(&old), subject.surface.positions()[v]);
        let center = mean(&old);
        // Eq. 16 with D = I: λ − (λ·n)n = 2[(W_c − I) − ((W_c − I)·n)n].
        let along = 2.0 * ((center - d) - (center - d).dot(n) * n);
        for w in &old {
            let last = (center - *w).dot(n) * n + (d - center);
            let line = |sign: f64| sign * (*w - d).dot(n) * n - 0.5 * along;
            printed = largest([printed, line(1.0).distance(last) / size]);
            right = largest([right, line(-1.0).distance(last) / size]);
        }
    }
    Ok(Finding::corrected(
        "largest distance over L of the second line of Eq. 17 from its last, with + (print) and − (right) at ((W_k − D)·n)n",
        printed,
        right,
        ROUNDING,
    )
    .remark("D stands for I throughout."))
}
