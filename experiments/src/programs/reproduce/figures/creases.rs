//! Creases: frozen ones against those of the system (Thall §2.7), and the same points with and without.

use glam::DVec3;

use crate::report::{Finish, Picture, Points};
use limitlab::Result;
use limitlab::interpolate::{Options, interpolate};
use limitlab::mesh::features::{SHARP, Tags};
use limitlab::schemes::{Refinement, Scheme};

use super::{Album, Line, POINT, limit_surface, plain, sheet, view};
use crate::programs::reproduce::context::Subject;
use crate::programs::reproduce::creases::{Artifacts, Crease, closed_loop, rims, split_cube, torus_loop};

/// Thall §2.7: vertices of a crease frozen from the start, in both ways, against a crease that is solved for.
pub fn frozen(album: &mut Album) -> Result<()> {
    let subject = Subject::built_in("torus:10x8")?;
    let points = subject.surface.positions();
    let tags = Tags { creases: closed_loop(torus_loop(10, 8, 2), SHARP), ..Tags::default() };
    let (mut panels, mut below) = (Vec::new(), Vec::new());
    let reflections = ["(d) reflections of (a)", "(e) of (b)", "(f) of (c)"];
    let mut gap = 0.0;
    for crease in Crease::ALL {
        let control = crease.control(&subject.surface, &tags)?;
        let found = Artifacts::new(&control, points, 5)?;
        gap = found.gap;
        let caption = match crease {
            Crease::Resting => format!("(a) resting: kinks of {:.0}°", found.turn),
            Crease::Averaged => format!("(b) averaged: {:.1} % off", 100.0 * gap / subject.surface.diagonal()),
            Crease::Solved => "(c) solved for".into(),
        };
        let crease: Vec<DVec3> = torus_loop(10, 8, 2).map(|v| points[v as usize]).collect();
        let surface = limit_surface(Refinement::CatmullClark, &control)?;
        let picture = Picture::new(caption, view(DVec3::Z, 15.0, 40.0)).frame(points);
        below.push(Picture {
            caption: reflections[below.len()].into(),
            ..picture.clone().surface(surface.clone().finish(Finish::ReflectionLines))
        });
        panels.push(picture.surface(surface).points(Points { positions: crease, radius: 1.3, colour: POINT }));
    }
    panels.append(&mut below);
    let line = Line {
        name: "thall-creases",
        shows: "Thall §2.7: a crease of vertices frozen at the start, resting or averaged along it, and one solved for",
        subject: subject.points(),
        iterations: None,
        error: Some(gap),
    };
    album.add(&line, sheet(3, (200, 165), panels))
}

/// The same points on a smooth surface, with creases, with semi-sharp ones, and with creases that end.
pub fn same_points(album: &mut Album) -> Result<()> {
    let subject = plain("cube of 26 points", split_cube())?;
    let points = subject.surface.positions();
    let of = |creases| Tags { creases, ..Tags::default() };
    let upper = |rims: Vec<([u32; 2], f64)>| rims.into_iter().filter(|(edge, _)| points[edge[0] as usize].z > 0.0);
    // An open part of the upper rim, between darts, about a corner.
    let part = upper(rims(SHARP)).filter(|(edge, _)| edge.iter().all(|&v| points[v as usize].x > -1.0));
    let corner = (0..points.len() as u32).find(|&v| points[v as usize] == DVec3::ONE).map(|v| (v, SHARP));
    let ending = Tags { corners: corner.into_iter().collect(), ..of(part.collect()) };
    let mut panels = Vec::new();
    let tagged = [
        ("(a) smooth", of(vec![])),
        ("(b) two creases", of(rims(SHARP))),
        ("(c) of sharpness 1.5", of(rims(1.5))),
        ("(d) creases to darts", ending),
    ];
    for (caption, tags) in tagged {
        let surface = subject.surface.tagged(&tags)?;
        let control = interpolate(&surface, Scheme::CatmullClark, &Options::default())?;
        let picture = Picture::new(caption, view(DVec3::Z, 30.0, 28.0))
            .surface(limit_surface(Refinement::CatmullClark, &surface.with_positions(control.points))?)
            .points(Points { positions: points.to_vec(), radius: 1.1, colour: POINT })
            .frame(points);
        panels.push(picture);
    }
    let line = Line {
        name: "creases-same-points",
        shows: "The same 26 points on Catmull-Clark surfaces: smooth, with two creases, semi-sharp, with creases to darts",
        subject: subject.points(),
        iterations: None,
        error: None,
    };
    album.add(&line, sheet(panels.len(), (180, 190), panels))
}
