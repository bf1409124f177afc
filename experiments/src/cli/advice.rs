//! Errors of the library and failed runs in the words of the programs: with the flags that help on the mesh at hand.

use limitlab::analysis::failed::Failed;
use limitlab::error::{Error, one_of};
use limitlab::mesh::Surface;
use limitlab::mesh::validate::Validation;
use limitlab::schemes::{Scheme, SingularSet};
use limitlab::solvers::Outcome;

/// What a singular system leaves to do, whatever the points.
const ANOTHER_SYSTEM: &str = "use --scheme nasri, which is never singular, or --scheme catmull-clark with --method \
                              halstead, whose control mesh is two refinements finer";

/// The defects of a mesh, and the flag that would do.
pub fn of_defects(report: &Validation) -> String {
    let line = report.summary_line();
    let or = match (report.is_open_only(), report.is_repairable) {
        (true, _) => ", or leave out --boundary refuse",
        (false, true) => "; --repair makes it valid",
        (false, false) => "",
    };
    line + or
}

/// Which tools show the surface of a control mesh of `scheme`, and what to ask for where they do not.
pub fn of_tools(scheme: Scheme) -> &'static str {
    match scheme {
        Scheme::CatmullClark => {
            "Catmull-Clark's, as Blender (Subdivision Surface with Use Limit Surface), Maya, Rhino, OpenSubdiv and USD \
             show it"
        }
        Scheme::Loop => {
            "Loop's, as OpenSubdiv, USD, CGAL and MeshLab show it; Blender, Maya and Rhino subdivide by Catmull-Clark, \
             and would miss the points: use --scheme catmull-clark for these"
        }
        Scheme::Sqrt3 => {
            "the √3 scheme's, as CGAL shows it; use --scheme catmull-clark for Blender, Maya, Rhino and USD, or write the \
             surface with --subdivide 3 --limit"
        }
        Scheme::Nasri => {
            "Doo-Sabin's, as CGAL shows it; use --scheme catmull-clark for Blender, Maya, Rhino and USD, or write the \
             surface with --subdivide 3 --limit"
        }
        Scheme::ZhengCai | Scheme::MidEdge => {
            "of a scheme that this program alone refines by: write it with --subdivide 3 --limit; use --scheme \
             catmull-clark for Blender, Maya, Rhino and USD"
        }
    }
}

/// An error of a computation on `surface`.
pub fn of_error(error: &Error, surface: &Surface) -> String {
    let with = |flags: String| format!("{error}{flags}");
    match error {
        // On an open mesh no other scheme would do.
        Error::NotTriangles { .. } if surface.is_closed() => {
            with(format!(" or use --scheme {}", names(|s| !s.needs_triangles())))
        }
        Error::Open { .. } => with(": --boundary edge-and-corner".into()),
        Error::NotOffered { what, schemes } => format!("{what}: use --scheme {}", one_of(schemes)),
        Error::TooFewLevels { needed, .. } => with(format!(": use --subdivide {needed} or more")),
        other => other.to_string(),
    }
}

/// The names of some schemes, to choose one from.
fn names(which: impl Fn(Scheme) -> bool) -> String {
    let names: Vec<&str> = Scheme::ALL.into_iter().filter(|&s| which(s)).map(Scheme::name).collect();
    one_of(&names)
}

/// After a search for the fairest surface that did not converge.
pub fn of_unfair(outcome: Outcome) -> &'static str {
    match outcome {
        Outcome::MaxIterations => "raise --max-iter or --membrane, or interpolate more vertices",
        Outcome::Rounding | Outcome::Stagnated => "no steps that small can be told in doubles: raise --tol",
        Outcome::Converged | Outcome::Diverged | Outcome::Singular | Outcome::Breakdown | Outcome::Stopped => {
            "the energy is too uneven for doubles: choose --thin-plate and --membrane nearer to 1"
        }
    }
}

/// After a run that did not converge: something to do that is not what has just failed. `unit` is what a length of one
/// measures in the units of the mesh.
pub fn of_failed(failed: &Failed, unit: f64) -> String {
    if let Some(component) = failed.unreachable() {
        return format!(
            "the points have a part that no control mesh reaches, {:.3e} at each of the {} vertices of the \
             component of vertex {}, which has {}, so that the matrix is singular; {ANOTHER_SYSTEM}",
            unit * component.unreachable.length(),
            component.vertices,
            component.first_vertex,
            failed.verdict.set.condition().unwrap_or_default()
        );
    }
    let reachable = unit * failed.reachable();
    let chosen = failed.chosen;
    match failed.outcome {
        Outcome::MaxIterations if chosen => "the iterations ran out: raise --max-iter, or use --method auto".into(),
        Outcome::MaxIterations => "the iterations ran out: raise --max-iter".into(),
        Outcome::Rounding | Outcome::Stagnated | Outcome::Diverged | Outcome::Breakdown if failed.is_rounding() => {
            format!(
                "the error is the rounding of such coordinates, whose last digit is {:.1e}, and the tolerance lies \
                 below: use --tol-absolute {reachable:.0e}",
                unit * failed.last_digit
            )
        }
        Outcome::Singular if chosen => {
            "the matrix is singular, but these points have a control mesh: use --method auto".into()
        }
        _ if chosen => "use --method auto".into(),
        _ => match failed.verdict.set {
            SingularSet::Bipartite { .. } => format!("the matrix is singular, or nearly so; {ANOTHER_SYSTEM}"),
            SingularSet::Never => format!(
                "the error that can be reached is larger than the tolerance: use --tol-absolute {reachable:.0e}"
            ),
        },
    }
}

#[cfg(test)]
mod tests {
    use limitlab::assemble::LimitSystem;
    use limitlab::mesh::validate::Boundary;
    use limitlab::mesh::{Faces, Mesh, builtin};

    use super::*;

    fn refused(surface: &Surface, scheme: Scheme) -> String {
        of_error(&LimitSystem::new(surface, scheme).unwrap_err(), surface)
    }

    fn opened(name: &str) -> Mesh {
        let mesh = builtin::builtin(name).unwrap();
        let faces = Faces::from_lists(mesh.faces.iter().skip(1));
        Mesh::new(mesh.positions, faces)
    }

    #[test]
    fn flags_are_those_that_help_on_the_mesh_at_hand() {
        let cube = Surface::new(builtin::cube()).unwrap();
        let others = " or use --scheme catmull-clark, nasri, zheng-cai or mid-edge";
        assert!(refused(&cube, Scheme::Loop).ends_with(others), "{}", refused(&cube, Scheme::Loop));

        let report = Surface::examined(opened("icosphere:1"), None, Boundary::Refuse).unwrap_err();
        let line = of_defects(&report);
        assert!(line.ends_with("stitch the faces, or leave out --boundary refuse"), "{line}");
        let open = Surface::examined(opened("icosphere:1"), None, Boundary::AsInterior).unwrap();
        let line = refused(&open, Scheme::CatmullClark);
        assert!(line.ends_with("or take the boundary as edge-and-corner: --boundary edge-and-corner"), "{line}");
        assert!(LimitSystem::new(&open, Scheme::Loop).is_ok());

        // Of quads: no other scheme would do as interior, and none is named.
        let open = Surface::examined(opened("torus:5x4"), None, Boundary::AsInterior).unwrap();
        assert!(refused(&open, Scheme::CatmullClark).ends_with(": --boundary edge-and-corner"));
        assert!(refused(&open, Scheme::Loop).ends_with("triangulate the mesh"));
    }
}
