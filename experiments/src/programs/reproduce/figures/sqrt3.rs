//! Lin-Luo Fig. 5–7: the interpolatory √3 scheme and the blend by α.

use glam::DVec3;

use crate::report::render::Projection;
use crate::report::{ColourScale, Finish, Picture, Points, ShadedMesh, View};
use crate::studies::pictures::peak;
use limitlab::Result;
use limitlab::interpolate::lin_luo::surface::refine_n;
use limitlab::mesh::{Mesh, Surface};
use limitlab::schemes::Refinement;

use super::stand_ins::StandIn;
use super::{Album, FACES, GIVEN, Line, POINT, cage, maps, sheet, view};
use crate::programs::reproduce::corpus;

/// The mesh after `steps` of the unified scheme.
fn refined(surface: &Surface, alpha: &[f64], steps: usize) -> Result<Mesh> {
    Ok(refine_n(surface, alpha, steps)?.0.into_mesh())
}

/// An even number of steps, after which the original edges are back, up to [`FACES`] triangles.
fn shown(surface: &Surface, alpha: &[f64]) -> Result<ShadedMesh> {
    Ok(ShadedMesh::smooth(refined(surface, alpha, steps(surface.mesh()))?))
}

fn steps(mesh: &Mesh) -> usize {
    let mut steps = 2;
    while steps < 8 && mesh.faces.len() * 3_usize.pow(steps as u32 + 2) <= FACES {
        steps += 2;
    }
    steps
}

/// The part of the diagonal about the place where two surfaces are farthest apart that is shown close.
const NEAR: f64 = 0.12;

/// Fig. 5: modified Butterfly and the interpolatory √3 scheme, and beside them Labsik and Greiner's; where the last two
/// differ, and how smooth all three are.
pub fn against_butterfly(album: &mut Album) -> Result<()> {
    let subject = album.subject(&corpus::BOB_TRIANGLES, StandIn::Plain("tri-torus:12x7"))?;
    let mesh = subject.surface.mesh();
    let view = view(DVec3::Y, 35.0, 20.0);
    let butterfly = ShadedMesh::smooth(Refinement::Butterfly.refine_n(&subject.surface, 4)?);
    let ours = shown(&subject.surface, &vec![1.0; mesh.len()])?;
    let earlier = ShadedMesh::smooth(Refinement::LabsikGreiner.refine_n(&subject.surface, steps(mesh))?);
    // Both split the triangles in the same way, so that each vertex has its counterpart.
    let size = subject.surface.diagonal();
    let pairs = ours.mesh.positions.iter().zip(&earlier.mesh.positions);
    let distances: Vec<f64> = pairs.map(|(a, b)| 100.0 * a.distance(*b) / size).collect();
    let largest = distances.iter().copied().fold(0.0, f64::max);
    let scale = ColourScale::linear("(e): distance, % of L", (0.0, largest));
    // Lines of sight are parallel: what is not framed may lie behind an eye.
    let beside = View { projection: Projection::Orthographic, ..view };
    let middle = ours.mesh.positions[peak(&distances)];
    let near: Vec<DVec3> = mesh.positions.iter().copied().filter(|p| p.distance(middle) < NEAR * size).collect();
    let close = |(caption, surface): (&str, &ShadedMesh)| {
        let surface = surface.clone().finish(Finish::ReflectionLines);
        Picture::new(caption, beside).surface(surface).frame(&near)
    };
    let below = [("(f) reflections on (b)", &butterfly), ("(g) on (c)", &ours), ("(h) on (d)", &earlier)].map(close);
    let apart = ours.clone().scalars(distances, scale.clone());
    let above = [
        ("(a) the mesh", cage(mesh, GIVEN)),
        ("(b) modified Butterfly", butterfly),
        ("(c) interpolatory √3", ours),
        ("(d) Labsik-Greiner √3", earlier),
        ("(e) from (c) to (d)", apart),
    ];
    let whole = above.map(|(caption, surface)| Picture::new(caption, view).surface(surface).frame(&mesh.positions));
    let panels = whole.into_iter().chain(below).collect();
    let line = Line {
        name: "lin-luo-5",
        shows: "Lin-Luo Fig. 5: a mesh with a hole by modified Butterfly and by the interpolatory √3 scheme (α = 1), with \
                Labsik and Greiner's beside; below, how far the last two are apart, and the reflection lines of all three where that is farthest",
        subject: subject.points(),
        iterations: None,
        error: None,
    };
    let title = "Below: how far (d) is from (c), and reflection lines where it is farthest";
    album.add(&line, maps(4, (150, 135), scale, panels).headed(title))
}

/// Fig. 6: a bunny under the interpolatory √3 scheme, step by step.
pub fn bunny(album: &mut Album) -> Result<()> {
    let subject = album.subject(&corpus::BUNNY, StandIn::Bumps("icosphere:3"))?;
    let mesh = subject.surface.mesh();
    let alpha = vec![1.0; mesh.len()];
    let view = view(DVec3::Y, 0.0, 10.0);
    let panels = vec![
        Picture::new("(a) the mesh", view).surface(cage(mesh, GIVEN)),
        Picture::new("(b) one step", view).surface(cage(&refined(&subject.surface, &alpha, 1)?, super::CONTROL)),
        Picture::new(format!("(c) {} steps", steps(mesh)), view).surface(shown(&subject.surface, &alpha)?),
    ];
    let line = Line {
        name: "lin-luo-6",
        shows: "Lin-Luo Fig. 6: a bunny under the interpolatory √3 scheme (α = 1)",
        subject: subject.points(),
        iterations: None,
        error: None,
    };
    album.add(&line, sheet(3, (150, 145), panels).headed("Interpolatory √3 scheme, α = 1"))
}

/// Fig. 7: the surfaces for several α, and two through some vertices only.
pub fn parameters(album: &mut Album) -> Result<()> {
    let subject = album.subject(&corpus::TRIPOD, StandIn::Plain("star:5"))?;
    let mesh = subject.surface.mesh();
    let view = view(DVec3::Y, 35.0, 25.0);
    let all = |alpha: f64| vec![alpha; mesh.len()];
    let every = |step: usize| -> Vec<usize> { (0..mesh.len()).step_by(step).collect() };
    let mut panels = vec![Picture::new("control mesh", view).surface(cage(mesh, GIVEN))];
    for alpha in [1.0, 0.8, 0.5, 0.2, 0.0] {
        panels.push(Picture::new(format!("α = {alpha}"), view).surface(shown(&subject.surface, &all(alpha))?));
    }
    for (caption, chosen) in [("α = 1 at every 2nd", every(2)), ("α = 1 at every 4th", every(4))] {
        let mut alpha = all(0.0);
        for &v in &chosen {
            alpha[v] = 1.0;
        }
        let points =
            Points { positions: chosen.iter().map(|&v| mesh.positions[v]).collect(), radius: 1.1, colour: POINT };
        panels.push(Picture::new(caption, view).surface(shown(&subject.surface, &alpha)?).points(points));
    }
    let framed: Vec<DVec3> =
        (panels.iter()).flat_map(|p| p.surfaces.iter().flat_map(|s| &s.mesh.positions)).copied().collect();
    for panel in &mut panels {
        panel.framed = Some(framed.clone());
    }
    let line = Line {
        name: "lin-luo-7",
        shows: "Lin-Luo Fig. 7: the unified √3 scheme for α from 1 to 0, and with α = 1 at some vertices (red) and 0 \
                at the others",
        subject: subject.points(),
        iterations: None,
        error: None,
    };
    album.add(&line, sheet(4, (130, 120), panels).headed("Unified √3 scheme; red: α = 1 there, 0 elsewhere"))
}

/// How smooth the surfaces are: reflection lines for α = 0, ½, 1.
pub fn reflections(album: &mut Album) -> Result<()> {
    let subject = album.subject(&corpus::TRIPOD, StandIn::Plain("star:5"))?;
    let mesh = subject.surface.mesh();
    let view = view(DVec3::Y, 35.0, 25.0);
    let mut panels = Vec::new();
    for (caption, alpha) in [("α = 0", 0.0), ("α = ½", 0.5), ("α = 1", 1.0)] {
        let surface = shown(&subject.surface, &vec![alpha; mesh.len()])?.finish(Finish::ReflectionLines);
        panels.push(Picture::new(caption, view).surface(surface));
    }
    let line = Line {
        name: "lin-luo-reflections",
        shows: "The unified √3 scheme: reflection lines, which break where normals jump",
        subject: subject.points(),
        iterations: None,
        error: None,
    };
    album.add(&line, sheet(3, (170, 165), panels).headed("Unified √3 scheme: reflection lines"))
}
