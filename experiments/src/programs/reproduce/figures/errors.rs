//! Maps of interpolation errors, and of the modes in which they last.

use glam::DVec3;

use crate::report::{ColourScale, Picture, ShadedMesh};
use limitlab::Result;
use limitlab::analysis::spectrum::spectrum;
use limitlab::assemble::LimitSystem;
use limitlab::error::Error;
use limitlab::mesh::{Surface, builtin};
use limitlab::schemes::Scheme;
use limitlab::solvers::{Method, System};

use super::stand_ins::StandIn;
use super::{Album, FINE_EDGE, FINEST_EDGE, Line, control, maps, plain, power, view};
use crate::programs::reproduce::corpus;

/// Iterates of the maps.
const SHOWN: [usize; 6] = [0, 1, 2, 5, 10, 20];

/// ‖p_i − (A v)_i‖ on the mesh while PIA goes on.
pub fn error_maps(album: &mut Album) -> Result<()> {
    let subject = album.subject(&corpus::HORSE, StandIn::Knot("tri-torus:39x6"))?;
    let system = subject.system(Scheme::Loop)?;
    let size = subject.surface.diagonal();
    let view = view(DVec3::Y, 30.0, 12.0);
    let iterates = SHOWN.map(|k| control(&subject, &system, Method::Pia, k));
    let [first, .., last] = iterates.each_ref().map(|(_, error)| error / size);
    let scale = ColourScale::logarithmic("error / L", decades(last, first));
    let picture = |(k, (iterate, error)): (usize, &(Surface, f64))| {
        let errors = (0..system.len())
            .map(|v| (subject.surface.positions()[v] - system.row(v, iterate.positions())).length() / size)
            .collect();
        let surface =
            ShadedMesh::smooth(subject.surface.mesh().clone()).scalars(errors, scale.clone()).edges(FINEST_EDGE);
        Picture::new(format!("k = {k}: at most {}", power(error / size)), view).surface(surface)
    };
    let panels = SHOWN.into_iter().zip(&iterates).map(picture).collect();
    let line = Line {
        name: "error-maps",
        shows: "PIA, Loop: ‖p_i − (A v)_i‖ at every vertex after 0, 1, 2, 5, 10, 20 updates, L the bounding box's \
                diagonal",
        subject: subject.points(),
        iterations: SHOWN.last().copied(),
        error: Some(last * size),
    };
    let title = "PIA, Loop: distance of every vertex from its limit point after k updates";
    album.add(&line, maps(3, (150, 140), scale, panels).headed(title))
}

/// The powers of ten about the largest errors of the last and the first map, a decade lower: most errors are smaller than the
/// largest.
fn decades(last: f64, first: f64) -> (f64, f64) {
    (10f64.powf(last.log10().floor() - 1.0), 10f64.powf(first.log10().ceil()))
}

/// The eigenvectors of Catmull-Clark's matrix that PIA is slowest to remove.
pub fn slow_modes(album: &mut Album) -> Result<()> {
    let plain = |name: &str| plain(name, builtin::builtin(name)?);
    let mut subjects = vec![plain("truncated-octahedron")?, plain("prism:17")?, plain("torus:24x12")?];
    subjects.push(album.subject(&corpus::SPOT_COARSE, StandIn::Plain("quad-sphere:2"))?);
    let scale = ColourScale::signed("eigenvector / largest", 1.0);
    let mut panels = Vec::new();
    for subject in &subjects {
        let system = subject.system(Scheme::CatmullClark)?;
        let (lambda, mode) = slowest(&system, &subject.name)?;
        let view = view(DVec3::Y, 30.0, 25.0);
        // Where the mode is; elsewhere there is nothing to see.
        let framed: Vec<DVec3> =
            (subject.surface.positions().iter().zip(&mode)).filter(|(_, x)| x.abs() > 0.01).map(|(&p, _)| p).collect();
        let part = if framed.len() < system.len() { ", part" } else { "" };
        let caption = format!("{}{part}: λ = {}", subject.name, significant(lambda));
        let mut picture = Picture::new(caption, view)
            .surface(ShadedMesh::flat(subject.surface.mesh().clone()).scalars(mode, scale.clone()).edges(FINE_EDGE));
        picture.framed = Some(framed);
        panels.push(picture);
    }
    let line = Line {
        name: "slow-modes",
        shows: "Catmull-Clark: the eigenvector of the least eigenvalue of A on the truncated octahedron (whose matrix \
                is singular), a 17-sided prism, a 24×12 torus and this mesh, where it is not zero",
        subject: subjects[3].points(),
        iterations: None,
        error: None,
    };
    album.add(
        &line,
        maps(2, (190, 160), scale, panels).headed("Catmull-Clark: eigenvectors of the least eigenvalue of A"),
    )
}

/// Steps of the power iteration; it ends before where it has converged.
const STEPS: usize = 200_000;

/// The least eigenvalue of A and an eigenvector whose largest entry is 1: the power iteration on I − A, whose
/// eigenvalues lie in [0, 1).
///
/// # Errors
/// If the eigenvalue is not the one that the spectrum has.
fn slowest(system: &LimitSystem, name: &str) -> Result<(f64, Vec<f64>)> {
    let n = system.len();
    // Multiples of the golden ratio: no symmetry of the mesh is one of the start.
    let mut x: Vec<f64> = (1..=n).map(|i| (i as f64 * 0.618_033_988_749_895).fract() - 0.5).collect();
    let mut residual = f64::INFINITY;
    for _ in 0..STEPS {
        let mut next: Vec<f64> = (0..n).map(|i| x[i] - system.a.row_times(i, &x)).collect();
        let largest = next.iter().copied().fold(0.0, |m: f64, v| if v.abs() > m.abs() { v } else { m });
        next.iter_mut().for_each(|v| *v /= largest);
        residual = (x.iter().zip(&next)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        x = next;
        if residual < 1e-9 {
            break;
        }
    }
    let at = (0..n).fold(0, |best, i| if x[i].abs() > x[best].abs() { i } else { best });
    let lambda = system.a.row_times(at, &x) / x[at];
    let known = spectrum(system)?.a.min;
    if (lambda - known).abs() > 1e-6 {
        return Err(Error::Computation(format!(
            "{name}: the power iteration ended at eigenvalue {lambda} with a change of {residual:.1e} a step, but the \
             least is {known}"
        )));
    }
    Ok((lambda, x))
}

/// Three digits; rounding is 0.
fn significant(x: f64) -> String {
    if x.abs() < 1e-9 { "0".into() } else { format!("{x:.4}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scale_of_errors_has_room_for_the_last_map() {
        for ((last, first), exponents) in
            [((5.1e-5, 3.8e-2), [-6, -1]), ((3.2e-8, 2.2e-2), [-9, -1]), ((1e-3, 1e-1), [-4, -1])]
        {
            let (least, largest) = decades(last, first);
            let [a, b] = exponents.map(|k| 10f64.powi(k));
            assert!((least / a - 1.0).abs() < 1e-12 && (largest / b - 1.0).abs() < 1e-12, "{least} {largest}");
        }
    }
}
