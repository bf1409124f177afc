//! What iterations cost until the whole surface is within a tolerance, not its vertices alone: B4.

use glam::DVec3;

use limitlab::Result;
use limitlab::mesh::Surface;
use limitlab::schemes::{Refinement, Scheme, catmull_clark, loop_scheme};
use limitlab::solvers::{Accelerated, Method, Stop, run};

use super::Claim;
use super::finding::{Evidence, Finding};
use super::lab::{Lab, ends, exact, iterates, largest};
use crate::programs::reproduce::context::Subject;

pub const CLAIMS: &[Claim] = &[Claim {
    id: "B4",
    title: "Iterations until the surface is within a tolerance everywhere",
    place: "beyond PIA §4 and Thall §2.4",
    printed: "Errors and iterations are those at the vertices.",
    slow: false,
    check: everywhere,
}];

/// Iterates at the most.
const MOST: usize = 400;

/// Points of the surface of a control mesh: limits of all vertices after two refinements, linear in the points.
fn samples(surface: &Surface, scheme: Scheme, control: Vec<DVec3>) -> Result<Vec<DVec3>> {
    let control = surface.with_positions(control);
    if scheme == Scheme::Loop {
        return loop_scheme::limit_positions(&Refinement::Loop.refined_n(&control, 2)?);
    }
    catmull_clark::limit_positions(&Refinement::CatmullClark.refined_n(&control, 2)?)
}

/// max_u Σ_i |l_i(u)| over the samples, l_i the surface that is 1 at vertex i and 0 at the others.
fn lebesgue_constant(subject: &Subject, scheme: Scheme) -> Result<f64> {
    let system = subject.system(scheme)?;
    let count = system.len();
    let mut sums = Vec::new();
    for first in (0..count).step_by(3) {
        let mut points = vec![DVec3::ZERO; count];
        (0..3.min(count - first)).for_each(|axis| points[first + axis][axis] = 1.0);
        let stop = Stop { tolerance: 1e-13, max_iterations: 3 };
        let control = run(&system, &points, Method::Cholesky, &stop).points;
        let found = samples(&subject.surface, scheme, control)?;
        sums.resize(found.len(), 0.0);
        sums.iter_mut().zip(found).for_each(|(sum, p)| *sum += p.abs().element_sum());
    }
    Ok(largest(sums))
}

/// The largest distance of a surface from another with control points that differ by this.
fn reach(surface: &Surface, scheme: Scheme, difference: Vec<DVec3>) -> Result<f64> {
    Ok(largest(samples(surface, scheme, difference)?.into_iter().map(DVec3::length)))
}

fn everywhere(_: &Lab) -> Result<Finding> {
    let spline = (1.0 + 27.0f64.sqrt()) / 4.0;
    let regular = lebesgue_constant(&exact("torus:24x24")?, Scheme::CatmullClark)?;
    let mut evidence = vec![Evidence::at_most(
        "deviation of the Lebesgue constant of torus:24x24, Catmull-Clark, from ((1 + 3√3)/4)²",
        (regular - spline * spline).abs(),
        1e-5,
    )];
    let (mut excess, mut extra) = (f64::NEG_INFINITY, 0);
    for (name, scheme) in [("irregular-quad:250", Scheme::CatmullClark), ("irregular-tri:250", Scheme::Loop)] {
        let subject = exact(name)?;
        let (surface, system) = (&subject.surface, subject.system(scheme)?);
        let constant = lebesgue_constant(&subject, scheme)?;
        evidence.push(Evidence::shown(format!("Lebesgue constant, {name}"), constant));
        let points = surface.positions();
        let exactly = run(&system, points, Method::Cholesky, &Stop { tolerance: 1e-13, max_iterations: 3 }).points;
        let spectrum = ends(&system)?;
        for (method, of) in [
            (Method::Pia, "PIA"),
            (Method::GaussSeidel { order: None }, "Gauss-Seidel"),
            (Method::Chebyshev { interval: Some((spectrum.min, spectrum.max)) }, "Chebyshev"),
            (Method::Cg, "conjugate gradients"),
            (Method::Anderson { of: Accelerated::Pia { omega: Some(1.0) }, window: 5 }, "Anderson on PIA"),
        ] {
            let all = iterates(&system, points, method, MOST);
            let at_vertices = |control: &[DVec3]| {
                largest((0..points.len()).map(|v| (points[v] - system.a.row_times(v, control)).length()))
            };
            for (digits, tolerance) in [(3, 1e-3), (6, 1e-6)] {
                let tolerance = tolerance * surface.diagonal();
                let Some(first) = all.iter().position(|control| at_vertices(control) <= tolerance) else {
                    continue;
                };
                // Vertices are points of the surface, so it is not there before they are.
                let mut last = first;
                while let Some(control) = all.get(last) {
                    let off = reach(surface, scheme, control.iter().zip(&exactly).map(|(a, b)| *a - *b).collect())?;
                    excess = largest([excess, off / at_vertices(control) / constant]);
                    if off <= tolerance {
                        break;
                    }
                    last += 1;
                }
                extra = extra.max(last - first);
                let label = format!("{name}, {of}, to 10^-{digits} of L");
                evidence.push(Evidence::shown(format!("{label}: iterations until all vertices are there"), first + 1));
                evidence.push(Evidence::shown(format!("{label}: until the surface is"), last + 1));
            }
        }
    }
    evidence.push(Evidence::at_most(
        "largest error of the surface over that at the vertices, over the Lebesgue constant",
        excess,
        1.0 + 1e-6,
    ));
    evidence.push(Evidence::at_most("most iterations from the vertices to the surface", extra, 5.0));
    Ok(Finding::settled(evidence).remark(
        "The surface of all control meshes is linear in their limit points, so its error is at most Λ times the largest one at the \
         vertices, Λ = max Σ |l_i| the Lebesgue constant of interpolation, for every method. Surfaces are sampled at the limit points of two refinements, 16 for one.",
    ))
}
