//! Thall's surfaces with and without given normals (his Fig. 7), and the wiggle beside an end cap (his Fig. 8).

use glam::DVec3;

use crate::report::{Colour, Finish, Picture, Points, Vectors, View};
use limitlab::Result;
use limitlab::interpolate::normals::{Rotation, rotate_rings};
use limitlab::interpolate::thall::normal_deviations;
use limitlab::mesh::{Faces, Mesh, Surface, builtin};
use limitlab::schemes::{Refinement, Scheme, catmull_clark};
use limitlab::solvers::Method;

use super::{Album, Line, POINT, control, limit_surface, plain, sheet, view};

const NORMAL: Colour = Colour(30, 140, 60);
/// Steps of conjugate gradients: enough for rounding level on these small meshes.
const STEPS: usize = 60;

/// A bone: points of the sphere moved to the surface y² + z² = R(x)² about the x axis, with its normals.
fn bone() -> Result<(Mesh, Vec<DVec3>)> {
    const LENGTH: f64 = 2.0;
    const WAIST: f64 = 0.42;
    const KNOB: f64 = 0.75;
    let mut mesh = builtin::builtin("quad-sphere:2")?;
    let mut normals = Vec::with_capacity(mesh.len());
    for p in &mut mesh.positions {
        let t = p.x;
        let around = DVec3::new(0.0, p.y, p.z);
        // R² = (1 − t²) w², w = WAIST + KNOB t²; of the gradient, the half.
        let w = WAIST + KNOB * t * t;
        let slope = -t * w * w + (1.0 - t * t) * w * 2.0 * KNOB * t;
        normals.push(DVec3::new(-slope / LENGTH, w * p.y, w * p.z).normalize());
        *p = DVec3::new(LENGTH * t, 0.0, 0.0) + w * around;
    }
    Ok((mesh, normals))
}

/// The largest angle between the limit normals of a refinement's first vertices and the given ones, in degrees.
fn largest_deviation(refined: &Surface, given: &[DVec3]) -> Result<f64> {
    let found = catmull_clark::limit_normals(refined)?;
    let angles = normal_deviations(&found[..given.len()], given);
    Ok(angles.into_iter().fold(0.0, f64::max).to_degrees())
}

/// Fig. 7: a bone through points alone and through points with normals.
pub fn bones(album: &mut Album) -> Result<()> {
    let (mesh, normals) = bone()?;
    let subject = plain("quad-sphere:2 as a bone", mesh)?;
    let system = subject.system(Scheme::CatmullClark)?;
    let (cage, error) = control(&subject, &system, Method::Cg, STEPS);
    let given: Vec<Option<DVec3>> = normals.iter().copied().map(Some).collect();
    let turned = rotate_rings(&cage, Refinement::CatmullClark, &given, Rotation::default())?;
    let deviations = [largest_deviation(&cage, &normals)?, largest_deviation(&turned.surface, &normals)?];
    let surfaces =
        [limit_surface(Refinement::CatmullClark, &cage)?, limit_surface(Refinement::CatmullClark, &turned.surface)?];
    let view = view(DVec3::Y, 15.0, 20.0);
    let framed = subject.surface.positions();
    let arrows = Vectors {
        tails: framed.to_vec(),
        vectors: normals.iter().map(|n| 0.22 * *n).collect(),
        width: 0.7,
        colour: NORMAL,
    };
    // The arrows whole.
    let tips = arrows.tails.iter().zip(&arrows.vectors).map(|(&tail, &arrow)| tail + arrow);
    let framed: Vec<DVec3> = framed.iter().copied().chain(tips).collect();
    let mut panels = Vec::new();
    for (surface, (caption, deviation)) in
        surfaces.iter().zip([("(a) points", deviations[0]), ("(b) and normals", deviations[1])])
    {
        let deviation = if deviation < 0.05 { "< 0.1".into() } else { format!("{deviation:.1}") };
        let caption = format!("{caption}: off by {deviation}°");
        panels.push(Picture::new(caption, view).surface(surface.clone()).vectors(arrows.clone()).frame(&framed));
    }
    for (surface, caption) in surfaces.into_iter().zip(["(c) reflections of (a)", "(d) of (b)"]) {
        panels.push(Picture::new(caption, view).surface(surface.finish(Finish::ReflectionLines)).frame(&framed));
    }
    let line = Line {
        name: "thall-7-normals",
        shows: "Thall Fig. 7: a bone through points alone and with normals (green) by turned rings; below, what that \
                does to reflection lines",
        subject: subject.points(),
        iterations: None,
        error: Some(error),
    };
    album.add(&line, sheet(2, (200, 125), panels))
}

/// The medial radius of the slab, but for its border.
const RADIUS: f64 = 0.5;

/// A flat slab around a grid of medial atoms: one sheet above, one below, each a radius away, and the crest of the
/// border atoms at η times their radius outwards. The border atoms lie so far inwards that the crest is the same
/// for all η and all border radii.
fn slab(eta: f64, border_radius: f64) -> Mesh {
    const ATOMS: [usize; 2] = [6, 4];
    let [nx, nz] = ATOMS;
    // −1 and 1 at the ends of a row of atoms, else 0.
    let side = |i: usize, n: usize| match i {
        0 => -1.0,
        i if i == n - 1 => 1.0,
        _ => 0.0,
    };
    let inward = eta * border_radius - RADIUS;
    let atom = |i: usize, k: usize| {
        DVec3::new(
            i as f64 - (nx - 1) as f64 / 2.0 - inward * side(i, nx),
            0.0,
            k as f64 - (nz - 1) as f64 / 2.0 - inward * side(k, nz),
        )
    };
    let radius = |i: usize, k: usize| {
        if side(i, nx) == 0.0 && side(k, nz) == 0.0 { RADIUS } else { border_radius }
    };
    let count = nx * nz;
    let mut positions = Vec::new();
    for y in [DVec3::Y, DVec3::NEG_Y] {
        for k in 0..nz {
            positions.extend((0..nx).map(|i| atom(i, k) + radius(i, k) * y));
        }
    }
    // The border, counter-clockwise seen from above (y upward, z towards the reader).
    let border: Vec<(usize, usize)> = (0..nx - 1)
        .map(|i| (i, nz - 1))
        .chain((1..nz).rev().map(|k| (nx - 1, k)))
        .chain((1..nx).rev().map(|i| (i, 0)))
        .chain((0..nz - 1).map(|k| (0, k)))
        .collect();
    for &(i, k) in &border {
        let outward = DVec3::new(side(i, nx), 0.0, side(k, nz)).normalize();
        positions.push(atom(i, k) + eta * border_radius * outward);
    }
    let at = |sheet: usize, i: usize, k: usize| (sheet * count + k * nx + i) as u32;
    let mut faces = Faces::default();
    for k in 0..nz - 1 {
        for i in 0..nx - 1 {
            faces.push(&[at(0, i, k), at(0, i, k + 1), at(0, i + 1, k + 1), at(0, i + 1, k)]);
            faces.push(&[at(1, i, k), at(1, i + 1, k), at(1, i + 1, k + 1), at(1, i, k + 1)]);
        }
    }
    for (b, &(i, k)) in border.iter().enumerate() {
        let next = (b + 1) % border.len();
        let (j, l) = border[next];
        let (crest, after) = ((2 * count + b) as u32, (2 * count + next) as u32);
        faces.push(&[crest, after, at(0, j, l), at(0, i, k)]);
        faces.push(&[at(1, i, k), at(1, j, l), after, crest]);
    }
    Mesh::new(positions, faces)
}

/// Fig. 8: a slab's end caps with η = 1, with a longer crest, and with smaller border atoms.
///
/// Every coordinate is interpolated on its own by the same matrix, so heights do not depend on η or on where an atom
/// lies in the plane of the slab: the wiggle goes only where the heights that are asked for change.
pub fn end_cap(album: &mut Album) -> Result<()> {
    let across = View::around(DVec3::Y, 0.0, 0.0);
    let oblique = view(DVec3::Y, 30.0, 30.0);
    let (mut panels, mut below) = (Vec::new(), Vec::new());
    let mut last = None;
    for (letters, eta, radius) in [(["(a)", "(d)"], 1.0, 1.0), (["(b)", "(e)"], 1.5, 1.0), (["(c)", "(f)"], 1.5, 0.8)] {
        let subject = plain("slab of 6×4 medial atoms", slab(eta, radius * RADIUS))?;
        let system = subject.system(Scheme::CatmullClark)?;
        let (cage, error) = control(&subject, &system, Method::Cg, STEPS);
        let surface = limit_surface(Refinement::CatmullClark, &cage)?;
        let heights = surface.mesh.positions.iter().map(|p| p.y);
        let over = 100.0 * (heights.fold(0.0, f64::max) / RADIUS - 1.0);
        let caption = format!("{} η = {eta}, r × {radius}: {over:+.1} %", letters[0]);
        panels.push(Picture::new(caption, across).surface(surface.clone()).points(Points {
            positions: subject.surface.positions().to_vec(),
            radius: 1.1,
            colour: POINT,
        }));
        below.push(
            Picture::new(format!("{} reflections", letters[1]), oblique)
                .surface(surface.finish(Finish::ReflectionLines)),
        );
        last = Some((subject, error));
    }
    panels.append(&mut below);
    let Some((subject, error)) = last else {
        return Ok(());
    };
    let line = Line {
        name: "thall-8-end-cap",
        shows: "Thall Fig. 8: beside an end cap the surface rises above the points, by as much for η = 1 as for 1.5 \
                with the border atoms moved inwards; less where the border atoms' radius is smaller too",
        subject: subject.points(),
        iterations: None,
        error: Some(error),
    };
    album.add(&line, sheet(3, (170, 110), panels))
}
