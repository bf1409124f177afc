//! Zheng-Cai Fig. 3–8: auxiliary meshes, corrected first refinements, Doo-Sabin surfaces, given normals and
//! shape handles; Nasri's method beside theirs.

use glam::DVec3;

use crate::report::{Colour, ColourScale, Paint, Picture, Points, ShadedMesh, Vectors, View};
use limitlab::Result;
use limitlab::interpolate::nasri;
use limitlab::interpolate::zheng_cai::{Constraints, PhaseOne, TwoPhase, interpolate};
use limitlab::mesh::{Surface, builtin};
use limitlab::schemes::Refinement;
use limitlab::solvers::{Method, Stop};

use super::stand_ins::StandIn;
use super::{Album, CONTROL, FACES, FINEST_EDGE, GIVEN, Line, POINT, cage, maps, plain, sheet, view};
use crate::programs::reproduce::context::Subject;
use crate::programs::reproduce::corpus;

/// Doo-Sabin until facets are no longer seen.
pub fn surface(first: &Surface) -> Result<ShadedMesh> {
    let mut levels = 1;
    while levels < 5 && (first.faces().corners().len() << (2 * levels)) < FACES {
        levels += 1;
    }
    Ok(ShadedMesh::smooth(Refinement::DooSabin.refine_n(first, levels)?))
}

/// The two-phase method with the paper's settings.
fn two_phase(subject: &Subject, constraints: &Constraints) -> Result<TwoPhase> {
    let phase = PhaseOne::default();
    interpolate(&subject.surface, constraints, &phase)
}

/// The largest distance of the centroid of a type-V face from its point, over all that are interpolated.
fn largest_error(subject: &Subject, found: &TwoPhase, is_interpolated: impl Fn(usize) -> bool) -> f64 {
    let mesh = found.first.surface.mesh();
    let distance = |v: usize| {
        let face = mesh.faces.face(found.first.first_vertex_face + v);
        let sum: DVec3 = face.iter().map(|&c| mesh.positions[c as usize]).sum();
        (sum / face.len() as f64).distance(subject.surface.positions()[v])
    };
    (0..subject.surface.len()).filter(|&v| is_interpolated(v)).map(distance).fold(0.0, f64::max)
}

/// Panels that show the same part of space.
fn panels(view: View, framed: &[DVec3], shown: Vec<(&str, ShadedMesh)>) -> Vec<Picture> {
    shown.into_iter().map(|(caption, surface)| Picture::new(caption, view).surface(surface).frame(framed)).collect()
}

/// Fig. 3: the Doo-Sabin surface of a mesh, and the one through its vertices.
pub fn approximation(album: &mut Album) -> Result<()> {
    let subject = album.subject(&corpus::LETTER, StandIn::Plain("truncated-octahedron"))?;
    let approximating = Refinement::DooSabin.refined(&subject.surface)?;
    let found = two_phase(&subject, &Constraints::default())?;
    let auxiliary = found.auxiliary.surface.mesh();
    let shown = vec![
        ("(a) input", cage(subject.surface.mesh(), GIVEN)),
        ("(b) refined once", cage(approximating.mesh(), CONTROL)),
        ("(c) its surface", surface(&approximating)?),
        ("(d) auxiliary mesh", cage(auxiliary, CONTROL)),
        ("(e) refined, corrected", cage(found.first.surface.mesh(), CONTROL)),
        ("(f) its surface", surface(&found.first.surface)?),
    ];
    let view = view(DVec3::Y, 25.0, 20.0);
    let mut panels = panels(view, &auxiliary.positions, shown);
    for at in [2, 5] {
        panels[at].points.push(Points { positions: subject.surface.positions().to_vec(), radius: 1.0, colour: POINT });
    }
    let line = Line {
        name: "zheng-cai-3",
        shows: "Zheng-Cai Fig. 3: approximation (above) and interpolation (below) by Doo-Sabin; given points red",
        subject: subject.points(),
        iterations: Some(found.auxiliary.updates.len()),
        error: Some(largest_error(&subject, &found, |_| true)),
    };
    album.add(&line, sheet(3, (135, 140), panels))
}

/// Fig. 4: Zheng and Cai's method and Nasri's on one mesh.
pub fn against_nasri(album: &mut Album) -> Result<()> {
    let subject = album.subject(&corpus::HAT, StandIn::Knot("tri-torus:70x8"))?;
    let found = two_phase(&subject, &Constraints::default())?;
    let stop = Stop { tolerance: 1e-10 * subject.surface.diagonal(), max_iterations: 10 };
    let solution = nasri::control_points(&subject.surface, None, Method::Lu, &stop)?;
    let nasri = subject.surface.with_positions(solution.points);
    // On triangles the two meshes are iterates of one system.
    let auxiliary = found.auxiliary.surface.positions();
    let size = subject.surface.diagonal();
    let distances: Vec<f64> = auxiliary.iter().zip(nasri.positions()).map(|(a, b)| a.distance(*b) / size).collect();
    // No less than rounding.
    let top = 10f64.powf(distances.iter().copied().fold(1e-15, f64::max).log10().ceil());
    let scale = ColourScale::logarithmic("(f): distance / L", (1e-3 * top, top));
    let apart = ShadedMesh::smooth(nasri.mesh().clone()).scalars(distances, scale.clone()).edges(FINEST_EDGE);
    let shown = vec![
        ("(a) input", cage(subject.surface.mesh(), GIVEN)),
        ("(b) auxiliary mesh", cage(found.auxiliary.surface.mesh(), CONTROL)),
        ("(c) its surface", surface(&found.first.surface)?),
        ("(d) Nasri's mesh", cage(nasri.mesh(), CONTROL)),
        ("(e) its surface", surface(&Refinement::DooSabin.refined(&nasri)?)?),
        ("(f) from (b) to (d)", apart),
    ];
    let view = view(DVec3::Y, 25.0, 20.0);
    let line = Line {
        name: "zheng-cai-4",
        shows: "Zheng-Cai Fig. 4: their method (b, c; iterations are theirs) and Nasri's (d, e); on triangles both \
                systems are the same, and what is left between (b) and (d) is the tolerance of the iteration (f)",
        subject: subject.points(),
        iterations: Some(found.auxiliary.updates.len()),
        error: Some(largest_error(&subject, &found, |_| true)),
    };
    let panels = panels(view, subject.surface.positions(), shown);
    let title = "On triangles Zheng and Cai's system (b, c) is Nasri's (d, e)";
    album.add(&line, maps(3, (150, 130), scale, panels).headed(title))
}

/// Fig. 5: a large mesh.
pub fn large(album: &mut Album) -> Result<()> {
    let subject = album.subject(&corpus::SPOT, StandIn::Knot("torus:360x32"))?;
    let found = two_phase(&subject, &Constraints::default())?;
    let shown = vec![
        ("(a) input", cage(subject.surface.mesh(), GIVEN)),
        ("(b) auxiliary mesh", cage(found.auxiliary.surface.mesh(), CONTROL)),
        ("(c) surface", surface(&found.first.surface)?),
    ];
    let line = Line {
        name: "zheng-cai-5",
        shows: "Zheng-Cai Fig. 5: a mesh of about the size of theirs (11 540 vertices, no file of it was found)",
        subject: subject.points(),
        iterations: Some(found.auxiliary.updates.len()),
        error: Some(largest_error(&subject, &found, |_| true)),
    };
    let view = view(DVec3::Y, 60.0, 12.0);
    let panels = panels(view, subject.surface.positions(), shown);
    album.add(&line, sheet(3, (135, 150), panels))
}

/// Colour of given normals, as in the paper.
const NORMAL: Colour = Colour(30, 140, 60);
/// The angle between a given normal and the axis, in degrees.
const TILT: f64 = 40.0;

/// A long bipyramid with its tips at the left and the right, which are interpolated, with and without normals.
struct Tagged {
    subject: Subject,
    tips: [usize; 2],
    marks: Vec<bool>,
    normals: Vec<Option<DVec3>>,
}

impl Tagged {
    fn new() -> Result<Self> {
        let name = "bipyramid:6";
        let mut mesh = builtin::builtin(name)?;
        // Its axis is z: lay it along x and stretch it.
        for p in &mut mesh.positions {
            *p = DVec3::new(1.7 * p.z, p.y, -p.x);
        }
        let by_x = |a: &usize, b: &usize| mesh.positions[*a].x.total_cmp(&mesh.positions[*b].x);
        let left = (0..mesh.len()).min_by(by_x).unwrap_or(0);
        let right = (0..mesh.len()).max_by(by_x).unwrap_or(0);
        let (sin, cos) = TILT.to_radians().sin_cos();
        let mut marks = vec![false; mesh.len()];
        let mut normals = vec![None; mesh.len()];
        for (v, x) in [(left, -cos), (right, cos)] {
            marks[v] = true;
            normals[v] = Some(DVec3::new(x, sin, 0.0));
        }
        Ok(Tagged { subject: plain(name, mesh)?, tips: [left, right], marks, normals })
    }

    fn solve(&self, with_normals: bool, handle: f64) -> Result<TwoPhase> {
        let handles: Vec<f64> = (self.marks.iter()).map(|&is_tip| if is_tip { handle } else { 1.0 }).collect();
        two_phase(
            &self.subject,
            &Constraints {
                interpolated: Some(&self.marks),
                normals: with_normals.then_some(&self.normals),
                handles: Some(&handles),
            },
        )
    }

    fn points(&self) -> Points {
        Points {
            positions: self.tips.map(|v| self.subject.surface.positions()[v]).to_vec(),
            radius: 2.0,
            colour: POINT,
        }
    }

    fn arrows(&self) -> Vectors {
        Vectors {
            tails: self.tips.map(|v| self.subject.surface.positions()[v]).to_vec(),
            vectors: (self.tips.iter()).filter_map(|&v| self.normals[v]).map(|n| 0.6 * n).collect(),
            width: 1.4,
            colour: NORMAL,
        }
    }

    /// What all pictures show: the mesh and the arrows.
    fn framed(&self) -> Vec<DVec3> {
        let arrows = self.arrows();
        let heads = arrows.tails.iter().zip(&arrows.vectors).map(|(&t, &v)| t + v);
        self.subject.surface.positions().iter().copied().chain(heads).collect()
    }

    /// The first refinement with the type-V faces of the tips in another colour.
    fn first(&self, found: &TwoPhase) -> ShadedMesh {
        let mesh = found.first.surface.mesh();
        let mut colours = vec![CONTROL; mesh.faces.len()];
        for v in self.tips {
            colours[found.first.first_vertex_face + v] = POINT;
        }
        ShadedMesh { paint: Some(Paint::Faces(colours)), ..cage(mesh, CONTROL) }
    }

    fn line<'a>(&'a self, name: &'a str, shows: &'a str, found: &TwoPhase) -> Line<'a> {
        Line {
            name,
            shows,
            subject: self.subject.points(),
            iterations: Some(found.auxiliary.updates.len()),
            error: Some(largest_error(&self.subject, found, |v| self.marks[v])),
        }
    }
}

/// Fig. 6: two interpolated vertices, without and with normals.
pub fn with_normals(album: &mut Album) -> Result<()> {
    let tagged = Tagged::new()?;
    let (free, held) = (tagged.solve(false, 1.0)?, tagged.solve(true, 1.0)?);
    let view = view(DVec3::Y, 20.0, 15.0);
    let mut panels = panels(
        view,
        &tagged.framed(),
        vec![
            ("(a) input", cage(tagged.subject.surface.mesh(), GIVEN)),
            ("(b) refined, corrected", tagged.first(&free)),
            ("(c) its surface", surface(&free.first.surface)?),
            ("(d) input, normals", cage(tagged.subject.surface.mesh(), GIVEN)),
            ("(e) refined, corrected", tagged.first(&held)),
            ("(f) its surface", surface(&held.first.surface)?),
        ],
    );
    for at in [0, 2, 3, 5] {
        panels[at].points.push(tagged.points());
    }
    for at in [3, 4, 5] {
        panels[at].vectors.push(tagged.arrows());
    }
    let shows = "Zheng-Cai Fig. 6: the leftmost and the rightmost vertex are interpolated, below with given normals \
                 (green); their faces red";
    let line = tagged.line("zheng-cai-6", shows, &held);
    album.add(&line, sheet(3, (150, 115), panels))
}

/// Fig. 7: what a shape handle does to a type-V face.
pub fn scaled_faces(album: &mut Album) -> Result<()> {
    let tagged = Tagged::new()?;
    let tip = tagged.subject.surface.positions()[tagged.tips[1]];
    let mut last = tagged.solve(false, 1.0)?;
    let mut pictures = Vec::new();
    let mut framed = Vec::new();
    for (caption, handle) in [("(a) s = 1", 1.0), ("(b) s = 0.4", 0.4), ("(c) s = 2.5", 2.5)] {
        last = tagged.solve(false, handle)?;
        let face = last.first.first_vertex_face + tagged.tips[1];
        let corners = last.first.surface.faces().face(face);
        let corners: Vec<DVec3> = (corners.iter()).map(|&c| last.first.surface.positions()[c as usize]).collect();
        let rays = Vectors {
            tails: vec![tip; corners.len()],
            vectors: corners.iter().map(|c| *c - tip).collect(),
            width: 0.9,
            colour: NORMAL,
        };
        let mut picture = Picture::new(caption, view(DVec3::Y, 75.0, 20.0)).surface(tagged.first(&last));
        picture.points.push(tagged.points());
        picture.vectors.push(rays);
        pictures.push(picture);
        framed.extend(last.first.surface.positions());
    }
    for picture in &mut pictures {
        picture.framed = Some(framed.clone());
    }
    let shows = "Zheng-Cai Fig. 7: the type-V face of an interpolated vertex (red) scaled by s about its centroid, which \
                 is the given point; lines to its corners green";
    let line = tagged.line("zheng-cai-7", shows, &last);
    album.add(&line, sheet(3, (130, 125), pictures))
}

/// Fig. 8: the same with shape handles.
pub fn with_handles(album: &mut Album) -> Result<()> {
    let tagged = Tagged::new()?;
    let view = view(DVec3::Y, 20.0, 15.0);
    let mut pictures = Vec::new();
    let mut last = tagged.solve(false, 1.0)?;
    for (caption, with_normals, handle) in [
        ("(a) s = 0.4", false, 0.4),
        ("(b) s = 0.4, normals", true, 0.4),
        ("(c) s = 2.5", false, 2.5),
        ("(d) s = 2.5, normals", true, 2.5),
    ] {
        last = tagged.solve(with_normals, handle)?;
        let shown = vec![(caption, surface(&last.first.surface)?)];
        let mut panel = panels(view, &tagged.framed(), shown);
        for picture in &mut panel {
            picture.points.push(tagged.points());
            if with_normals {
                picture.vectors.push(tagged.arrows());
            }
        }
        pictures.append(&mut panel);
    }
    let shows = "Zheng-Cai Fig. 8: the surfaces of Fig. 6 with shape handles 0.4 (slim) and 2.5 (round) at the \
                 interpolated vertices";
    let line = tagged.line("zheng-cai-8", shows, &last);
    album.add(&line, sheet(2, (170, 115), pictures))
}
