//! PIA Fig. 3–7 and Thall's surfaces: meshes beside limit surfaces through their vertices.

use glam::DVec3;

use crate::report::{Figure, Picture, Points};
use limitlab::Result;
use limitlab::schemes::{Refinement, Scheme};
use limitlab::solvers::Method;

use super::stand_ins::StandIn;
use super::{Album, GIVEN, Line, POINT, cage, control, limit_surface, sheet, view};
use crate::programs::reproduce::context::Subject;
use crate::programs::reproduce::corpus::{self, Model};

/// A figure of the PIA paper.
struct Printed {
    name: &'static str,
    caption: &'static str,
    model: Model,
    stand_in: StandIn,
    scheme: Scheme,
    /// Updates: the paper's iterations less one.
    updates: usize,
    up: DVec3,
    /// Of the eye, in degrees.
    azimuth: f64,
    elevation: f64,
    /// The part of the height, from the top, that is shown.
    shown: f64,
    /// Of a panel, in points.
    size: (u32, u32),
}

const PRINTED: [Printed; 5] = [
    Printed {
        name: "pia-3-horse",
        caption: "PIA Fig. 3 (horse): mesh and Loop surface, 12 iterations",
        model: corpus::HORSE,
        stand_in: StandIn::Knot("tri-torus:39x6"),
        scheme: Scheme::Loop,
        updates: 11,
        up: DVec3::Y,
        azimuth: 30.0,
        elevation: 12.0,
        shown: 1.0,
        size: (190, 190),
    },
    Printed {
        name: "pia-4-bird",
        caption: "PIA Fig. 4 (bird): mesh and Loop surface, 9 iterations",
        model: corpus::BIRD,
        stand_in: StandIn::Bumps("icosphere:3"),
        scheme: Scheme::Loop,
        updates: 8,
        up: DVec3::Y,
        azimuth: 60.0,
        elevation: 12.0,
        shown: 1.0,
        size: (190, 190),
    },
    Printed {
        name: "pia-5-hand",
        caption: "PIA Fig. 5 (hand): mesh and Loop surface, 3 iterations",
        model: corpus::HAND,
        stand_in: StandIn::Knot("tri-torus:206x30"),
        scheme: Scheme::Loop,
        updates: 2,
        up: DVec3::NEG_Y,
        azimuth: 20.0,
        elevation: 12.0,
        shown: 1.0,
        size: (172, 182),
    },
    Printed {
        name: "pia-6-boy",
        caption: "PIA Fig. 6 (boy, holes filled): mesh and Loop surface, 6 iterations; the head alone",
        model: corpus::BOY_FILLED,
        stand_in: StandIn::Bumps("icosphere:5"),
        scheme: Scheme::Loop,
        updates: 5,
        up: DVec3::Y,
        azimuth: 60.0,
        elevation: 12.0,
        shown: 0.22,
        size: (200, 185),
    },
    Printed {
        name: "pia-7-mushroom",
        caption: "PIA Fig. 7 (mushroom): mesh and Catmull-Clark surface, 8 iterations",
        model: corpus::MUSHROOM,
        stand_in: StandIn::Bumps("quad-sphere:3"),
        scheme: Scheme::CatmullClark,
        updates: 7,
        up: DVec3::Y,
        azimuth: 60.0,
        elevation: 20.0,
        shown: 1.0,
        size: (190, 150),
    },
];

/// The mesh beside its interpolating surface.
pub fn pia(album: &mut Album) -> Result<()> {
    for printed in &PRINTED {
        let subject = album.subject(&printed.model, printed.stand_in)?;
        let system = subject.system(printed.scheme)?;
        let (cage_mesh, error) = control(&subject, &system, Method::Pia, printed.updates);
        let surface = limit_surface(printed.scheme.refinement(), &cage_mesh)?;
        let view = view(printed.up, printed.azimuth, printed.elevation);
        let height = |p: &DVec3| p.dot(printed.up);
        let heights = || subject.surface.positions().iter().map(height);
        let (low, high) = (heights().fold(f64::INFINITY, f64::min), heights().fold(f64::NEG_INFINITY, f64::max));
        let shown = if album.context.real() { printed.shown } else { 1.0 };
        let what = if shown < 1.0 { "head of the " } else { "" };
        let framed: Vec<DVec3> = (surface.mesh.positions.iter())
            .chain(subject.surface.positions())
            .filter(|p| height(p) >= high - shown * (high - low))
            .copied()
            .collect();
        let panels = vec![
            Picture::new(format!("(a) {what}mesh, {} vertices", subject.surface.len()), view)
                .surface(cage(subject.surface.mesh(), GIVEN))
                .frame(&framed),
            Picture::new(format!("(b) {what}surface, {} updates", printed.updates), view)
                .surface(surface)
                .frame(&framed),
        ];
        let line = Line {
            name: printed.name,
            shows: printed.caption,
            subject: subject.points(),
            iterations: Some(printed.updates),
            error: Some(error),
        };
        album.add(&line, sheet(2, printed.size, panels))?;
    }
    Ok(())
}

/// Iterates of the series.
const SERIES: [usize; 6] = [0, 1, 2, 3, 5, 10];

/// The limit surfaces of Thall's iterates, with the points that they have to reach, and the last one's error.
fn thall_pictures(subject: &Subject, iterates: &[usize]) -> Result<(Vec<Picture>, f64)> {
    let system = subject.system(Scheme::CatmullClark)?;
    let size = subject.surface.diagonal();
    let view = view(DVec3::Y, 60.0, 12.0);
    let mut panels = Vec::new();
    let mut last = 0.0;
    for &k in iterates {
        let (cage_mesh, error) = control(subject, &system, Method::Thall, k);
        last = error;
        let caption = format!("k = {k}: error {:.2} %", 100.0 * error / size);
        let picture = Picture::new(caption, view)
            .surface(limit_surface(Refinement::CatmullClark, &cage_mesh)?)
            .points(Points { positions: subject.surface.positions().to_vec(), radius: 0.9, colour: POINT });
        panels.push(picture);
    }
    // Surfaces swell beyond the points.
    let all = panels.iter().flat_map(|panel| panel.surfaces.iter().flat_map(|surface| &surface.mesh.positions));
    let framed: Vec<DVec3> = subject.surface.positions().iter().chain(all).copied().collect();
    for panel in &mut panels {
        panel.framed = Some(framed.clone());
    }
    Ok((panels, last))
}

/// Thall's iteration: the limit surface of every iterate, with the points that it has to reach.
pub fn thall_series(album: &mut Album) -> Result<()> {
    let subject = album.subject(&corpus::SPOT_COARSE, StandIn::Bumps("quad-sphere:2"))?;
    let (panels, last) = thall_pictures(&subject, &SERIES)?;
    let line = Line {
        name: "thall-iterations",
        shows: "Thall's iteration, ω = ½: the Catmull-Clark surface of iterate 0, 1, 2, … and the given points",
        subject: subject.points(),
        iterations: SERIES.last().copied(),
        error: Some(last),
    };
    album.add(&line, sheet(3, (150, 150), panels))
}

/// The same, moving.
pub fn thall_animation(album: &mut Album) -> Result<()> {
    let subject = album.subject(&corpus::SPOT_COARSE, StandIn::Bumps("quad-sphere:2"))?;
    let iterates: Vec<usize> = (0..=6).collect();
    let (panels, last) = thall_pictures(&subject, &iterates)?;
    // A viewer that shows the first frame alone says so too.
    let frame = |panel: Picture| {
        let caption = format!("animation, {}", panel.caption);
        sheet(1, (190, 175), vec![Picture { caption, ..panel }])
    };
    let frames: Vec<Figure> = panels.into_iter().map(frame).collect();
    let line = Line {
        name: "thall-animation",
        shows: "Thall's iteration, ω = ½, as an animated PNG: iterates 0 to 6 and the given points",
        subject: subject.points(),
        iterations: iterates.last().copied(),
        error: Some(last),
    };
    album.animate(&line, frames)
}
