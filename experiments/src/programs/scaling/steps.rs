//! Time of the steps around the solve: topology, validation, explicit assembly, refinement, files.

use std::path::Path;
use std::time::Instant;

use crate::cli::{Printer, Progress};
use crate::report::{Column, Columns, Provenance, Table};
use limitlab::Result;
use limitlab::assemble::LimitSystem;
use limitlab::error::Error;
use limitlab::mesh::generate::{permute_vertices, shuffle_faces};
use limitlab::mesh::order::Order;
use limitlab::mesh::validate::{Boundary, validate};
use limitlab::mesh::{Mesh, Surface, io};
use limitlab::schemes::{Refinement, Scheme, unified_sqrt3};

use super::noisy;
use super::threads::on_threads;

/// Runs of which the fastest counts.
const RUNS: usize = 3;

/// Measures all steps at about `n` vertices and writes the table to `folder`, which also takes the mesh files for a
/// while.
pub fn steps(
    n: usize,
    folder: &Path,
    progress: &Progress,
    printer: &mut Printer,
    provenance: &Provenance,
) -> Result<()> {
    let mut rows = Vec::new();
    let quads = noisy(&format!("irregular-quad:{}", n & !1))?;
    let triangles = noisy(&format!("irregular-tri:{n}"))?;
    let polygons = noisy(&format!("irregular-poly:{n}"))?;
    let mut threads = vec![1, rayon::current_num_threads()];
    threads.dedup();
    for (name, good) in [("quad", quads), ("tri", triangles), ("poly", polygons)] {
        let surface = Surface::new(good.clone())?;
        let order = Order::Random(7).order(&good, surface.incidence());
        let random = shuffle_faces(&permute_vertices(&good, &order), 7);
        for (order, mesh) in [("good", &good), ("random", &random)] {
            for &threads in &threads {
                let name = format!("irregular-{name}:{n}");
                progress.message(format!("steps around the solve: {name}, {order} order, threads: {threads}"));
                let on = On { name, order, threads, vertices: mesh.len() };
                on_threads(threads, || Rows { rows: &mut rows, mesh, on }.measure(folder))??;
                table(&rows).write(folder, provenance)?;
                progress.step();
            }
        }
    }
    printer.table(&table(&rows))
}

fn table(rows: &[Row]) -> Table {
    let columns = Columns::<Row>::new()
        .col(Column::key("step"), |r| r.step.clone())
        .col(Column::key("scheme"), |r| r.scheme)
        .col(Column::key("mesh"), |r| r.on.name.clone())
        .col(Column::key("order"), |r| r.on.order)
        .col(Column::key("threads"), |r| r.on.threads.to_string())
        .col(Column::count("vertices"), |r| r.on.vertices)
        .col(Column::count("new_vertices"), |r| (r.vertices != r.on.vertices).then_some(r.vertices))
        .col(Column::time("seconds"), |r| r.seconds)
        .col(Column::time("nanoseconds_per_vertex"), |r| 1e9 * r.seconds / r.vertices as f64)
        .col(Column::time("megabytes_per_second"), |r| r.speed.map(|s| s / 1e6));
    let mut table = columns.table("scaling-steps", "The steps around the solve", rows);
    table.note(
        "Memory to memory but for the files; the fastest of three runs. A mesh in random order is renumbered once, in its \
         validation. Topology: of a validated mesh. Refinement: from a validated mesh with its \
         topology to the refined mesh with its topology, nanoseconds per new vertex; \"from faces\" finds the topology \
         of the coarse mesh too, not validated. Assembly: from faces to A and M. Files: positions with all 17 digits; PLY is binary.",
    );
    table
}

/// What steps are measured on.
#[derive(Clone)]
struct On {
    name: String,
    order: &'static str,
    threads: usize,
    vertices: usize,
}

/// One step.
struct Row {
    step: String,
    scheme: &'static str,
    on: On,
    /// After the step.
    vertices: usize,
    seconds: f64,
    /// Bytes a second.
    speed: Option<f64>,
}

/// The rows of one mesh and number of threads.
struct Rows<'a> {
    rows: &'a mut Vec<Row>,
    mesh: &'a Mesh,
    on: On,
}

impl Rows<'_> {
    fn measure(&mut self, folder: &Path) -> Result<()> {
        let mesh = self.mesh;
        self.validated("validation", "", Ok)?;
        let validated = || Surface::new(mesh.clone());
        let (seconds, _) = fastest(validated, |surface| {
            let surface = surface?;
            surface.topology();
            Ok(surface)
        })?;
        self.push("topology", "", mesh.len(), seconds, None);
        self.plain("report on defects", "", || Ok(validate(mesh, None, Boundary::Refuse)))?;
        let triangles = mesh.faces.uniform_size() == Some(3);
        for scheme in Scheme::ALL {
            if scheme.needs_triangles() == triangles {
                self.validated("assembly", scheme.name(), |surface| LimitSystem::new(&surface, scheme))?;
            }
        }
        for scheme in Refinement::ALL {
            if scheme.needs_triangles() == triangles {
                self.refinement(scheme.name(), |surface| scheme.refined(surface))?;
            }
        }
        if triangles {
            let alpha = vec![0.5; mesh.len()];
            self.refinement("unified-sqrt3", |surface| Ok(unified_sqrt3::refined(surface, &alpha)?.0))?;
        }
        if self.on.order == "good" && mesh.faces.uniform_size().is_some() {
            for ending in ["off", "obj", "ply"] {
                self.files(&folder.join(format!("scaling-steps.{ending}")), ending)?;
            }
        }
        Ok(())
    }

    fn plain<T>(&mut self, step: &str, scheme: &'static str, work: impl Fn() -> Result<T>) -> Result<()> {
        let (seconds, _) = fastest(|| (), |()| work())?;
        self.push(step, scheme, self.mesh.len(), seconds, None);
        Ok(())
    }

    /// With validation, and topology where it is needed.
    fn validated<T>(&mut self, step: &str, scheme: &'static str, work: impl Fn(Surface) -> Result<T>) -> Result<()> {
        let (seconds, _) = fastest(|| self.mesh.clone(), |mesh| work(Surface::new(mesh)?))?;
        self.push(step, scheme, self.mesh.len(), seconds, None);
        Ok(())
    }

    fn refinement(&mut self, scheme: &'static str, step: impl Fn(&Surface) -> Result<Surface>) -> Result<()> {
        let mesh = self.mesh;
        let surface = Surface::new(mesh.clone())?;
        surface.topology();
        let (seconds, fine) = fastest(|| (), |()| step(&surface))?;
        self.push("refinement", scheme, fine.len(), seconds, None);
        drop(fine);
        let (seconds, fine) = fastest(|| mesh.clone(), |mesh| step(&Surface::new(mesh)?))?;
        self.push("refinement, from faces", scheme, fine.len(), seconds, None);
        Ok(())
    }

    fn files(&mut self, path: &Path, ending: &str) -> Result<()> {
        let (seconds, ()) = fastest(|| (), |()| io::write(path, self.mesh, None))?;
        let bytes = std::fs::metadata(path).map_err(|e| Error::io(path, "read", e))?.len() as f64;
        let n = self.mesh.len();
        let step = format!("write {ending}");
        self.push(&step, "", n, seconds, Some(bytes / seconds));
        let (seconds, _) = fastest(|| (), |()| io::read(path))?;
        let step = format!("read {ending}");
        self.push(&step, "", n, seconds, Some(bytes / seconds));
        std::fs::remove_file(path).map_err(|e| Error::io(path, "remove", e))
    }

    fn push(&mut self, step: &str, scheme: &'static str, vertices: usize, seconds: f64, speed: Option<f64>) {
        let (step, on) = (step.to_owned(), self.on.clone());
        self.rows.push(Row { step, scheme, on, vertices, seconds, speed });
    }
}

/// The fastest of some runs and the last result, whose destruction is not counted, nor is what they start from.
fn fastest<P, T>(prepare: impl Fn() -> P, work: impl Fn(P) -> Result<T>) -> Result<(f64, T)> {
    let timed = || {
        let prepared = prepare();
        let start = Instant::now();
        let result = work(prepared)?;
        Ok((start.elapsed().as_secs_f64(), result))
    };
    let (mut best, mut result) = timed()?;
    for _ in 1..RUNS {
        drop(result);
        let seconds;
        (seconds, result) = timed()?;
        best = f64::min(best, seconds);
    }
    Ok((best, result))
}
