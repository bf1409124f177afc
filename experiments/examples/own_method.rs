//! A method of one's own beside those of the house: `cargo run --release --example own_method`.

use std::path::Path;

use faer::sparse::SparseColMat;
use glam::DVec3;
use limitlab::analysis::comparison::{MethodRow, compare, entries};
use limitlab::analysis::{custom_methods::Own, spectrum::spectrum, sweep::rounding_floor, sweep::sweep};
use limitlab::assemble::LimitSystem;
use limitlab::mesh::{Surface, builtin, noise::move_vertices};
use limitlab::schemes::Scheme;
use limitlab::solvers::{Errors, Failure, Iterate, Method, Stop, system::Rows};
use limitlab_experiments::report::Provenance;
use limitlab_experiments::studies::comparison::{figure, table};
use nalgebra_sparse::CsrMatrix;

/// Steepest descent on M V = H⁻¹P in the inner product of H: V ← V + α e, e = P − A V, α = ⟨e, H⁻¹e⟩/⟨e, M e⟩.
struct SteepestDescent<'a>(&'a LimitSystem, &'a [DVec3], Vec<DVec3>);
impl Iterate for SteepestDescent<'_> {
    fn errors(&mut self) -> Errors {
        Rows::new(self.1.len()).errors(self.0, self.1, &self.2)
    }
    fn advance(&mut self) -> Result<(), Failure> {
        let Self(system, points, v) = self;
        let e: Vec<DVec3> = (0..v.len()).map(|i| points[i] - system.a.row_times(i, v)).collect();
        let square: f64 = (0..v.len()).map(|i| e[i].length_squared() / system.h[i]).sum();
        let curvature: f64 = (0..v.len()).map(|i| e[i].dot(system.m.row_times(i, &e))).sum();
        v.iter_mut().zip(&e).for_each(|(v, e)| *v += square / curvature * *e);
        Ok(())
    }
    fn points(&self) -> &[DVec3] {
        &self.2
    }
}

fn main() -> limitlab::Result<()> {
    run("out".as_ref()).map(drop)
}

pub fn run(out: &Path) -> limitlab::Result<Vec<MethodRow<'static>>> {
    let mut surface = Surface::new(builtin::builtin("torus:16x12")?)?; // or mesh::io::read(path)?.mesh
    move_vertices(&mut surface, 0.1, 1);
    let (system, points) = (LimitSystem::new(&surface, Scheme::CatmullClark)?, surface.positions());
    let (theirs, columns) = (CsrMatrix::from(&system.a), SparseColMat::<u32, f64>::from(&system.a));
    println!("A has {} entries in nalgebra-sparse and {} in faer", theirs.nnz(), columns.compute_nnz());

    let spectrum = spectrum(&system)?;
    println!("λ(A) ∈ [{:.6}, {:.6}]", spectrum.a.min, spectrum.a.max);
    let stop = Stop { tolerance: 1e-8 * surface.diagonal(), max_iterations: 1000 };
    let (name, parameter) = ("steepest-descent".into(), "mine".into());
    let mine = Own { name, parameter, start: &|s, points| Ok(Box::new(SteepestDescent(s, points, points.to_vec()))) };
    let lines = entries(&system, &spectrum, &[Method::WPia { omega: None }, Method::Cg, Method::Lu], None, "file")?;
    let rows = compare(&system, &spectrum, (points, points), &lines, &[mine], &stop, &mut || ())?;
    println!("{}", table("own".into(), "My method".into(), "A torus.".into(), &rows).to_markdown());
    limitlab::output::create_dir(out)?;
    let made = Provenance { program: "own_method".into(), ..Provenance::default() };
    figure("My method".into(), "mesh units", &rows).render()?.save(&out.join("own_method.png"), &made)?;
    let grid = vec![(Method::Pia, (1..=20).map(|k| f64::from(k) / 10.0).collect())];
    let found =
        sweep((&system, &spectrum), (points, points), &grid, None, &stop, rounding_floor(surface.diagonal()), &|_| ())?;
    println!("best ω of PIA: {:?}", found.best(Method::Pia).map(|row| (row.omega, row.iterations)));
    Ok(rows)
}
