//! Any polygon mesh through everything that is computed from connectivity: the validator against a second opinion,
//! files, refinement, and for every scheme the explicit matrix, the matrix-free operator and the solvers against formulas.

mod draft;
mod refinement;
mod systems;

use std::sync::LazyLock;

use arbitrary::{Result, Unstructured};
use glam::DVec3;
use limitlab::mesh::frame::Frame;
use limitlab::mesh::validate::{Boundary, validate};
use limitlab::mesh::{Mesh, Surface};
use limitlab::schemes::Scheme;
use rayon::{ThreadPool, ThreadPoolBuilder};

use super::formats::writes_and_reads_back;
use super::surface::euler_if_closed;
use draft::Draft;

/// A mesh, and what else a run is told.
struct Case {
    /// In a frame of about unit size, as the programs compute.
    mesh: Mesh,
    /// The points where they came from.
    given: Vec<DVec3>,
    /// Relative to the bounding box's diagonal.
    tolerance: f64,
    /// Of a renumbering.
    seed: u64,
    /// Whether to go on with a mesh of thousands of vertices.
    refine: bool,
}

impl Case {
    fn decode(u: &mut Unstructured) -> Result<Case> {
        let tolerance = 0.1f64.powi(u.int_in_range(2..=10)?);
        let seed = u.arbitrary::<u8>()?.into();
        let refine = u.ratio(1, 16)?;
        let place: u8 = u.int_in_range(0..=7)?;
        let exponent = u.int_in_range(-30..=30)?;
        let mut mesh = Draft::decode(u)?.mesh();
        for p in &mut mesh.positions {
            *p = match place {
                // Many points coincide, faces have no area.
                0 => p.round(),
                1 => *p + DVec3::new(100.0, -1000.0, 0.0),
                // Not far from the range of single precision, in which corrections are computed.
                2 => *p * 2f64.powi(exponent),
                // Where squares overflow or vanish.
                3 => *p * 2f64.powi(32 * exponent),
                _ => *p,
            };
        }
        let given = mesh.positions.clone();
        if place == 3
            && let Ok(frame) = Frame::of(&given)
        {
            frame.enter(&mut mesh.positions);
        }
        Ok(Case { mesh, given, tolerance, seed, refine })
    }
}

pub fn check(data: &[u8]) {
    let Ok(case) = Case::decode(&mut Unstructured::new(data)) else { return };
    let mesh = &case.mesh;
    let euler = euler_if_closed(mesh);
    let report = validate(mesh, None, Boundary::Refuse);
    assert_eq!(report.is_valid(), euler.is_some(), "{euler:?}: {}", report.summary_line());
    let surface = Surface::new(mesh.clone()).ok();
    assert_eq!(surface.is_some(), euler.is_some(), "{}", report.summary_line());
    let Some((surface, euler)) = surface.zip(euler) else { return };
    writes_and_reads_back(&Mesh { positions: case.given.clone(), ..mesh.clone() }, None);
    refinement::keeps_surfaces(&surface, euler);
    for scheme in suitable(mesh) {
        systems::matrices_agree(&surface, scheme);
        systems::solutions_agree(&case, &surface, scheme);
    }
    if case.refine && mesh.diagonal() > 0.0 {
        refinement::large(&surface, euler, case.tolerance);
    }
}

fn suitable(mesh: &Mesh) -> impl Iterator<Item = Scheme> {
    Scheme::ALL.into_iter().filter(|scheme| scheme.first_unsuitable_face(&mesh.faces).is_none())
}

/// The same work on one thread and on two, with the same result to the last bit.
fn on_any_threads<T: PartialEq + Send>(work: impl Fn() -> T + Sync) -> T {
    static POOLS: LazyLock<[ThreadPool; 2]> =
        LazyLock::new(|| [1, 2].map(|n| ThreadPoolBuilder::new().num_threads(n).build().unwrap()));
    let [one, two] = POOLS.each_ref().map(|pool| pool.install(&work));
    assert!(one == two, "the number of threads matters");
    one
}
