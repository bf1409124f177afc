//! Frames of an animation: new points on the same faces, solved from what the last frame left.

use std::time::Instant;

use crate::report::{Column, Columns, Table};
use glam::DVec3;
use limitlab::Result;
use limitlab::interpolate::{Interpolator, Options, interpolate};
use limitlab::mesh::noise::{mean_edge_length, move_vertices};
use limitlab::mesh::{Mesh, Surface};
use limitlab::schemes::Scheme;
use limitlab::solvers::Stop;

/// Movements from one frame to the next, in parts of the mean edge.
const MOTIONS: [f64; 3] = [0.001, 0.01, 0.1];
/// Relative to the diagonal of the bounding box.
const TOLERANCES: [f64; 4] = [1e-4, 1e-6, 1e-8, 1e-10];
/// Frames of one row, of which the fastest counts.
const FRAMES: usize = 5;
/// Waves along the diagonal of the bounding box.
const WAVES: f64 = 3.0;

/// How points move from frame to frame.
#[derive(Clone, Copy)]
enum Motion {
    /// Along a wave that travels through space, as bodies bend.
    Wave,
    /// Each by itself, normally distributed: the worst for what a solution has to follow.
    Noise,
}

/// Where a frame's solution starts.
#[derive(Clone, Copy, PartialEq)]
enum Start {
    /// Nothing is kept: `auto`, its set-up counted.
    Scratch,
    /// From V = P, with the operator that is kept.
    Points,
    /// From the last frame's control points.
    Last,
    /// From these, each moved as its point was.
    Moved,
}

impl Start {
    const ALL: [Start; 4] = [Start::Scratch, Start::Points, Start::Last, Start::Moved];

    fn name(self) -> &'static str {
        match self {
            Start::Scratch => "from scratch",
            Start::Points => "V = P",
            Start::Last => "last frame",
            Start::Moved => "last frame, moved with P",
        }
    }
}

/// A start under a motion and a tolerance.
pub struct Row {
    scheme: Scheme,
    name: String,
    motion: Motion,
    part: f64,
    tolerance: f64,
    start: Start,
    iterations: usize,
    seconds: f64,
    /// From scratch, under the same.
    scratch: f64,
}

/// The table of frames.
pub fn frames_table(rows: &[Row]) -> Table {
    let motion = |r: &Row| match r.motion {
        Motion::Wave => "wave",
        Motion::Noise => "noise",
    };
    let columns = Columns::<Row>::new()
        .col(Column::key("scheme"), |r| r.scheme.name())
        .col(Column::key("mesh"), |r| r.name.clone())
        .col(Column::key("motion"), motion)
        .col(Column::key("part_of_edge"), |r| r.part.to_string())
        .col(Column::key("tolerance"), |r| format!("{:e}", r.tolerance))
        .col(Column::key("start"), |r| r.start.name())
        .col(Column::count("iterations"), |r| r.iterations)
        .col(Column::time("seconds"), |r| r.seconds)
        .col(Column::time("of_scratch"), |r| r.seconds / r.scratch);
    let mut table = columns.table("scaling-frames", "Frames on the same faces", rows);
    table.note(format!(
        "From frame to frame the points move by this part of the mean edge: at most, along a wave through space, or as \
         the standard deviation of noise. Solved to this part of L. The fastest of {FRAMES} frames, and the iterations of the last. From \
         scratch: `auto`, set-up counted. The others keep order, operator and arrays. A frame thirty times a second has 0.033 s."
    ));
    table
}

/// Frames of one mesh.
pub fn frames(name: &str, mesh: Mesh, scheme: Scheme, rows: &mut Vec<Row>) -> Result<()> {
    let surface = Surface::new(mesh)?;
    let edge = mean_edge_length(surface.mesh());
    let mut interpolator = Interpolator::new(&surface, scheme, None)?;
    for motion in [Motion::Wave, Motion::Noise] {
        for part in MOTIONS {
            for tolerance in TOLERANCES {
                let stop = Stop { tolerance: tolerance * surface.diagonal(), max_iterations: 10_000 };
                let mut scratch = f64::NAN;
                for start in Start::ALL {
                    let moves = |frame| motion.steps(&surface, edge, part, frame);
                    let (seconds, iterations) = fastest(&surface, scheme, &mut interpolator, start, &stop, moves)?;
                    if start == Start::Scratch {
                        scratch = seconds;
                    }
                    let name = name.to_owned();
                    rows.push(Row { scheme, name, motion, part, tolerance, start, iterations, seconds, scratch });
                }
            }
        }
    }
    Ok(())
}

/// The seconds of the fastest of [`FRAMES`], whose points `moves` makes of the frames before, and the iterations of the last.
fn fastest(
    surface: &Surface,
    scheme: Scheme,
    interpolator: &mut Interpolator,
    start: Start,
    stop: &Stop,
    moves: impl Fn(usize) -> Vec<DVec3>,
) -> Result<(f64, usize)> {
    let mut points = surface.clone();
    let mut control = Vec::new();
    interpolator.solve(points.positions(), &mut control, stop);
    let (mut seconds, mut iterations) = (f64::INFINITY, 0);
    for frame in 0..FRAMES {
        let steps = moves(frame);
        points.positions_mut().iter_mut().zip(&steps).for_each(|(p, step)| *p += *step);
        let clock = Instant::now();
        if start == Start::Points {
            control.copy_from_slice(points.positions());
        } else if start == Start::Moved {
            control.iter_mut().zip(&steps).for_each(|(v, step)| *v += *step);
        }
        let report = if start == Start::Scratch {
            interpolate(&points, scheme, &Options::from(*stop))?.report
        } else {
            interpolator.solve(points.positions(), &mut control, stop)
        };
        seconds = seconds.min(clock.elapsed().as_secs_f64());
        iterations = report.iterations;
    }
    Ok((seconds, iterations))
}

impl Motion {
    /// How each point moves from the frame before to this one, in parts of the mean edge.
    fn steps(self, surface: &Surface, edge: f64, part: f64, frame: usize) -> Vec<DVec3> {
        let at = surface.positions();
        match self {
            Motion::Wave => {
                let length = surface.diagonal();
                at.iter().map(|p| part * edge * wave(*p / length, frame)).collect()
            }
            Motion::Noise => {
                let mut moved = surface.clone();
                move_vertices(&mut moved, part, frame as u64);
                moved.positions().iter().zip(at).map(|(p, at)| *p - *at).collect()
            }
        }
    }
}

/// The movement of a place, in parts of the diagonal, from one frame to the next: a direction of length 1 at most.
fn wave(place: DVec3, frame: usize) -> DVec3 {
    let phase = std::f64::consts::TAU * (WAVES * place + DVec3::splat(0.05 * frame as f64));
    DVec3::new(phase.y.sin(), phase.z.sin(), phase.x.sin()) / 3f64.sqrt()
}
