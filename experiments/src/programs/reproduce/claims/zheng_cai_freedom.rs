//! What Zheng and Cai leave open at the end: the degrees of freedom of the first refined mesh, and shape handles (Z32).

use limitlab::Result;
use limitlab::interpolate::fair_refinement::FirstFairness;
use limitlab::interpolate::halstead::{Energies, Weights};
use limitlab::solvers::Outcome;

use super::Claim;
use super::finding::{Evidence, Finding};
use super::lab::{Lab, each, largest, median, smallest};
use crate::programs::reproduce::context::Subject;
use crate::programs::reproduce::freedom::Surfaces;

pub const CLAIMS: &[Claim] = &[Claim {
    id: "Z32",
    title: "The degrees of freedom and the shape handles",
    place: "§5",
    printed: "How to make use of these degrees of freedom and the shape handles to create visually pleasing shapes is an \
              interesting problem.",
    slow: true,
    check: freedom,
}];

/// Of energies at the end of iterations.
const ROUNDING: f64 = 1e-9;

/// Of one mesh.
struct Measured {
    /// Of the weighted energies: two-phase and best handles over all freedom, best handles over two-phase.
    two_phase: f64,
    handled: f64,
    gain: f64,
    /// Thin plate, two-phase over all freedom.
    bending: f64,
    error: f64,
    handles: (f64, f64),
    not_positive: usize,
    iterations: [usize; 2],
    not_converged: usize,
}

fn measured(subject: &Subject) -> Result<Measured> {
    let surface = &subject.surface;
    let weights = Weights::default();
    let fairness = FirstFairness::new(surface)?;
    let found = Surfaces::new(surface, &fairness, weights)?;
    let two_phase = fairness.energies(found.two_phase.surface.positions());
    let fair = [&found.handled, &found.free];
    let [handled, free] = fair.map(|fair| fair.energies);
    let ratio = |a: Energies, b: Energies| a.weighted(weights) / b.weighted(weights);
    Ok(Measured {
        two_phase: ratio(two_phase, free),
        handled: ratio(handled, free),
        gain: ratio(handled, two_phase),
        bending: two_phase.thin_plate / free.thin_plate,
        error: largest(fair.map(|fair| fair.errors.max / surface.diagonal())),
        handles: (smallest(found.handles.iter().copied()), largest(found.handles.iter().copied())),
        not_positive: found.handles.iter().filter(|&&s| s <= 0.0).count(),
        iterations: fair.map(|fair| fair.report.iterations),
        not_converged: fair.iter().filter(|fair| fair.report.outcome != Outcome::Converged).count(),
    })
}

fn freedom(lab: &Lab) -> Result<Finding> {
    let mut found = each(lab.polygons(), measured)?;
    let random = found.len();
    found.extend(each(lab.subjects()?, measured)?);
    let models = &found[random..];
    let of = |some: &[Measured], value: &dyn Fn(&Measured) -> f64| -> Vec<f64> { some.iter().map(value).collect() };
    let grown = ["irregular-quad:1000", "irregular-quad:30000"].map(|name| measured(&lab.context.stand_in(name)?));
    let [small, large] = grown;
    let (small, large) = (small?, large?);
    let growth = |k: usize| large.iterations[k] as f64 / small.iterations[k] as f64;
    Ok(Finding::settled(vec![
        Evidence::equal(
            "runs that did not converge, random polygon meshes and models",
            found.iter().map(|m| m.not_converged).sum::<usize>(),
            0.0,
        ),
        Evidence::at_most(
            "largest distance from a point over L, best handles and all freedom",
            largest(of(&found, &|m| m.error)),
            1e-12,
        ),
        Evidence::at_most(
            "largest energy of the best handles over two-phase",
            largest(of(&found, &|m| m.gain)),
            1.0 + ROUNDING,
        ),
        // The same where symmetry leaves no other freedom.
        Evidence::at_least(
            "smallest energy of the best handles over all freedom",
            smallest(of(&found, &|m| m.handled)),
            1.0 - ROUNDING,
        ),
        Evidence::shown("median energy of two-phase over all freedom, models", median(of(models, &|m| m.two_phase))),
        Evidence::shown("the largest such, models", largest(of(models, &|m| m.two_phase))),
        Evidence::shown("median energy of the best handles over all freedom, models", median(of(models, &|m| m.handled))),
        Evidence::shown("median thin-plate energy of two-phase over all freedom, models", median(of(models, &|m| m.bending))),
        Evidence::shown("smallest handle, models", smallest(of(models, &|m| m.handles.0))),
        Evidence::shown("largest handle, models", largest(of(models, &|m| m.handles.1))),
        Evidence::shown("handles that are not positive, models", models.iter().map(|m| m.not_positive).sum::<usize>()),
        Evidence::shown("smallest handle, random polygon meshes", smallest(of(&found[..random], &|m| m.handles.0))),
        Evidence::shown(
            "handles that are not positive, random polygon meshes",
            found[..random].iter().map(|m| m.not_positive).sum::<usize>(),
        ),
        Evidence::shown("iterations of the best handles at 30 000 vertices, irregular-quad", large.iterations[0]),
        Evidence::at_most("the same over those at 1000 vertices", growth(0), 1.5),
        Evidence::shown("iterations of all freedom at 30 000 vertices, irregular-quad", large.iterations[1]),
        Evidence::at_most("the same over those at 1000 vertices, all freedom", growth(1), 1.5),
    ])
    .remark(
        "Least thin-plate plus membrane energy, weights 1 and 1, under which either question has one answer. Iterations are \
         conjugate gradients to 10⁻¹⁰ of the diagonal.",
    ))
}
