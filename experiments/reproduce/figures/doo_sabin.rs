//! Zheng-Cai Fig. 3–5: input, auxiliary mesh, Doo-Sabin surface; Nasri's method beside it.
//!
//! The auxiliary systems are solved to rounding here, so that the type-V faces of the first refinement have the given
//! points as centroids without a correction.

use glam::DVec3;

use limitlab::Result;
use limitlab::assemble::Scheme;
use limitlab::mesh::Mesh;
use limitlab::report::{Picture, Points, Surface, View};
use limitlab::solvers::{Setup, Stop, run as solve};
use limitlab::subdivide::Refinement;
use limitlab::subdivide::doo_sabin::{Rule, limit_positions, refine_by};

use super::{Album, CONTROL, FACES, GIVEN, Line, POINT, cage, sheet, view};
use crate::context::Subject;

/// A control mesh, its first refinement, its surface.
struct Interpolant {
    control: Mesh,
    first: Mesh,
    surface: Surface,
    iterations: usize,
    error: f64,
}

impl Interpolant {
    /// Zheng and Cai's, or Nasri's.
    fn new(subject: &Subject, scheme: Scheme) -> Result<Self> {
        let rule = match scheme {
            Scheme::ZhengCai => Rule::ZhengCai,
            _ => Rule::DooSabin,
        };
        let system = subject.system(scheme)?;
        let stop = Stop {
            tolerance: 1e-12 * subject.mesh.diagonal(),
            max_iterations: 1000,
        };
        let setup = Setup::Sor {
            omega: 1.0,
            order: None,
        };
        let solution = solve(&system, &subject.mesh.positions, setup, &stop);
        let control = Mesh::new(solution.points, subject.mesh.faces.clone());
        let limits = limit_positions(rule, &control, &subject.topology)?;
        let distances = limits
            .iter()
            .zip(&subject.mesh.positions)
            .map(|(a, b)| a.distance(*b));
        let first = refine_by(rule, &control, &subject.topology)?;
        Ok(Interpolant {
            error: distances.fold(0.0, f64::max),
            surface: surface(&first)?,
            control,
            first,
            iterations: solution.report.iterations,
        })
    }
}

/// Doo-Sabin until facets are no longer seen.
fn surface(first: &Mesh) -> Result<Surface> {
    let mut levels = 1;
    while levels < 5 && (first.faces.corners().len() << (2 * levels)) < FACES {
        levels += 1;
    }
    Ok(Surface::smooth(
        Refinement::DooSabin.refine_n(first, levels)?,
    ))
}

/// Panels that show the same part of space.
fn panels(view: View, framed: &[DVec3], shown: Vec<(&str, Surface)>) -> Vec<Picture> {
    shown
        .into_iter()
        .map(|(caption, surface)| Picture::new(caption, view).surface(surface).frame(framed))
        .collect()
}

/// Fig. 3: the Doo-Sabin surface of a mesh, and the one through its vertices.
pub fn approximation(album: &mut Album) -> Result<()> {
    let subject = album.subject("closed/letterp_26v_poly.off", "irregular-poly:40")?;
    let plain = refine_by(Rule::DooSabin, &subject.mesh, &subject.topology)?;
    let found = Interpolant::new(&subject, Scheme::ZhengCai)?;
    let view = view(DVec3::Y, 25.0, 20.0);
    let framed = found.control.positions.clone();
    let shown = vec![
        ("(a) input", cage(&subject.mesh, GIVEN)),
        ("(b) first refinement of (a)", cage(&plain, CONTROL)),
        ("(c) its surface", surface(&plain)?),
        ("(d) auxiliary mesh", cage(&found.control, CONTROL)),
        ("(e) first refinement of (d)", cage(&found.first, CONTROL)),
        ("(f) surface through the vertices", found.surface),
    ];
    let mut panels = panels(view, &framed, shown);
    for at in [2, 5] {
        panels[at].points.push(Points {
            positions: subject.mesh.positions.clone(),
            radius: 1.0,
            colour: POINT,
        });
    }
    let line = Line {
        name: "zheng-cai-3",
        shows: "Zheng-Cai Fig. 3: approximation (above) and interpolation (below) by Doo-Sabin; given points red",
        subject: &subject,
        iterations: Some(found.iterations),
        error: Some(found.error),
    };
    album.add(&line, &sheet("", 3, (135, 140), panels))
}

/// Fig. 4: Zheng and Cai's method and Nasri's on one mesh.
pub fn against_nasri(album: &mut Album) -> Result<()> {
    let subject = album.subject("closed/psb_m1630_hat_562v.off", "irregular-tri:562")?;
    let new = Interpolant::new(&subject, Scheme::ZhengCai)?;
    let nasri = Interpolant::new(&subject, Scheme::Nasri)?;
    let view = view(DVec3::Y, 25.0, 20.0);
    let framed = subject.mesh.positions.clone();
    let shown = vec![
        ("(a) input, 562 vertices", cage(&subject.mesh, GIVEN)),
        ("(b) auxiliary mesh", cage(&new.control, CONTROL)),
        ("(c) its surface", new.surface),
        ("(d) Nasri's auxiliary mesh", cage(&nasri.control, CONTROL)),
        ("(e) its surface", nasri.surface),
    ];
    let line = Line {
        name: "zheng-cai-4",
        shows: "Zheng-Cai Fig. 4: their method (b, c) and Nasri's (d, e); on triangles both systems are the same",
        subject: &subject,
        iterations: Some(nasri.iterations),
        error: Some(nasri.error),
    };
    album.add(
        &line,
        &sheet("", 3, (140, 130), panels(view, &framed, shown)),
    )
}

/// Fig. 5: a large mesh.
pub fn large(album: &mut Album) -> Result<()> {
    let subject = album.subject("closed/spot_11533v.off", "irregular-tri:11540")?;
    let found = Interpolant::new(&subject, Scheme::ZhengCai)?;
    let view = view(DVec3::Y, 60.0, 12.0);
    let framed = subject.mesh.positions.clone();
    let shown = vec![
        ("(a) input", cage(&subject.mesh, GIVEN)),
        ("(b) auxiliary mesh", cage(&found.control, CONTROL)),
        ("(c) surface", found.surface),
    ];
    let line = Line {
        name: "zheng-cai-5",
        shows: "Zheng-Cai Fig. 5: a mesh of about the size of theirs (11 540 vertices, no file of it was found)",
        subject: &subject,
        iterations: Some(found.iterations),
        error: Some(found.error),
    };
    album.add(
        &line,
        &sheet("", 3, (150, 160), panels(view, &framed, shown)),
    )
}
