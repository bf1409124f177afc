//! Extreme or all eigenvalues, proven bounds, singularity: `spectrum [MESH|SYSTEM_DIR…]`.

use std::process::ExitCode;

use clap::{Parser, ValueHint};
use glam::DVec3;
use serde_json::{Map, Value, json};

use crate::cli::{
    self, CommonFlags, Given, Input, List, Matrix, MeshFlags, OutputFlags, Progress, StopFlags, Subject, number,
};
use crate::report::series::Bars;
use crate::report::{Column, Columns, Figure, LinePlot, Provenance, Rule, Table};
use crate::studies::complex_spectrum::{ComplexFindings, radii_of_sweeps};
use crate::studies::{iteration_matrix as iteration, modes as mode_study};
use limitlab::Result;
use limitlab::analysis::a_priori::{IterationCounts, Promise};
use limitlab::analysis::complex_spectrum::ComplexSpectrum;
use limitlab::analysis::dense;
use limitlab::analysis::inertia::{Certificate, certify};
use limitlab::analysis::singularity::{Singularity, SlowModes, modes};
use limitlab::analysis::spectral_radius::SpectralRadius;
use limitlab::analysis::spectrum::{Estimate, Extremes, Spectrum, SpectrumEnds, ends, excited, mesh_ends, spectrum};
use limitlab::analysis::subspace_iteration::End;
use limitlab::analysis::symmetric::SymmetricForm;
use limitlab::assemble::LimitSystem;
use limitlab::assemble::bounds::SpectralBounds;
use limitlab::mesh::features::Features;
use limitlab::mesh::order::Order;
use limitlab::solvers::direct::SINGULAR;
use limitlab::solvers::{Method, Stop, System};

/// In its help.
const EXAMPLES: [&str; 3] = [
    "spectrum model.off --modes 6",
    "spectrum icosphere:2 --scheme loop --full --json",
    "spectrum torus:16x16 --iteration-matrix gauss-seidel,sor:1.1 --order bfs --pseudospectra",
];

/// Extreme eigenvalues of A and D⁻¹A, rates of all methods, proven bounds, and whether the system is singular.
///
/// Rates are the spectral radii of the methods' error matrices. A folder is taken for a system of anybody, as
/// `compare-solvers` does: then the bounds are those of its entries, and singular is what rounding cannot tell from it.
///
/// Where a mesh has darts or semi-sharp vertices, no diagonal makes A symmetric: all eigenvalues, which may be complex, are
/// computed (up to 2000 vertices), without bounds, which are proven for symmetric matrices.
#[derive(Parser)]
#[command(name = "spectrum", version = cli::VERSION, after_help = cli::ending(&EXAMPLES, cli::DONE_ANYHOW, None))]
pub struct Arguments {
    /// Mesh files (.obj, .off, .ply, .usda, .stl, .glb, .gltf), built-in names, or folders with M.mtx, H.mtx and P.mtx; unless told, four
    /// built-in ones with --noise 0.1
    #[arg(value_name = "MESH|SYSTEM_DIR", value_hint = ValueHint::AnyPath)]
    meshes: Vec<String>,
    /// Compute all eigenvalues (up to 4000 vertices), with a histogram
    #[arg(long)]
    full: bool,
    /// Compute the K slowest modes, of the least eigenvalues of A, with multiplicities: a table, the modes at the vertices as CSV,
    /// and of a mesh as PLY, with a property and colours for viewers, and as a picture. On an open or creased mesh they
    /// are those of the smooth vertices, and 0 elsewhere
    #[arg(long, value_name = "K", default_value_t = 0, value_parser = clap::value_parser!(u16).range(0..=56))]
    modes: u16,
    /// Enclose the ends between proven numbers, by Cholesky factorizations of M − σH⁻¹ and the like and by Rayleigh
    /// quotients, with all rounding bounded; and bound the rates (memory: the factor)
    #[arg(long)]
    certify: bool,
    /// Leave out the spectral radii of Gauss-Seidel, SOR and SSOR, which take the longest on large meshes
    #[arg(long)]
    no_sweeps: bool,
    /// Leave out what part of the spectra the points excite
    #[arg(long)]
    no_data: bool,
    /// In place of all this, the iteration matrices T = I − N⁻¹A of stationary methods (jacobi, thall, gauss-seidel, sor, ssor, pia,
    /// w-pia): eigenvalues in the complex plane, norms, numerical radius, and the powers of T beside those of its radius. All
    /// eigenvalues up to 600 vertices, with --full up to 2000; the outermost beyond
    #[arg(long, value_name = "METHOD[:ω],…", value_parser = stationary)]
    iteration_matrix: Option<List<Method<'static>>>,
    /// Vertex order of the sweeps of --iteration-matrix: file, reverse, bfs, rcm, morton, valence, multicolour, random or random:SEED
    #[arg(long, value_name = "NAME", requires = "iteration_matrix", default_value_t = Order::File)]
    order: Order,
    /// Draw the ε-pseudospectra of the iteration matrices too (up to 400 vertices)
    #[arg(long, requires = "iteration_matrix")]
    pseudospectra: bool,
    #[command(flatten)]
    mesh: MeshFlags,
    #[command(flatten)]
    stop: StopFlags,
    #[command(flatten)]
    output: OutputFlags,
    #[command(flatten)]
    common: CommonFlags,
}

/// What begins the names of its files.
const STEMS: [&str; 6] =
    ["spectrum", "spectrum-rates", "spectrum-full", "spectrum-modes", "spectrum-histogram", "spectrum-eigenvalues"];
/// The same, of iteration matrices.
const ITERATION_STEMS: [&str; 4] = [
    "spectrum-iteration",
    "spectrum-iteration-eigenvalues",
    "spectrum-iteration-powers",
    "spectrum-iteration-pseudospectra",
];

/// What `spectrum` runs on without arguments.
const BUILT_IN: [&str; 4] = ["torus:32x32", "quad-sphere:4", "icosphere:3", "prism:9"];
const BINS: usize = 60;
/// How near the ends certificates are tried first, relative.
const WITHIN: f64 = 1e-8;

/// Methods that have an iteration matrix, as a `value_parser`.
fn stationary(text: &str) -> std::result::Result<List<Method<'static>>, String> {
    text.split(',').map(iteration::stationary).collect::<std::result::Result<_, _>>().map(List)
}

/// Runs the program.
pub fn main(mut arguments: Arguments, provenance: Provenance) -> ExitCode {
    cli::exit(|| {
        let provenance = arguments.common.apply(provenance)?;
        arguments.mesh.or_built_in(&mut arguments.meshes, &BUILT_IN);
        run(&arguments, &provenance)
    })
}

/// All that is known of one mesh, or of a system without one.
struct Findings {
    bounds: SpectralBounds,
    ends: SpectrumEnds,
    full: Option<dense::Eigenvalues>,
    sweeps: Vec<(Method<'static>, f64, SpectralRadius)>,
    /// What theory says of a mesh.
    verdict: Option<Singularity>,
    promise: Promise,
    /// `None` where all points coincide.
    counts: Option<IterationCounts>,
    data: [Option<Extremes>; 2],
    /// At the vertices of a mesh file, at the rows of a system without one; `None` unless asked for.
    modes: Option<SlowModes>,
    certificates: [Option<Certificate>; 4],
    /// On an open or creased mesh the rest is about the smooth vertices. The eigenvalues of its curves, and its corners.
    curves: Vec<f64>,
    corners: usize,
}

/// A method's factor per iteration.
struct Rate {
    method: &'static str,
    parameter: String,
    /// The spectral radius of the error matrix, or what follows from the condition number.
    rho: f64,
    /// No greater, as the certificates prove.
    certified: Option<f64>,
}

/// An end of a spectrum.
struct Quantity {
    name: &'static str,
    estimate: Estimate,
    bound: f64,
    /// What factorizations prove of it: a bound, and that some eigenvalue reaches as far as this.
    certificate: Option<Certificate>,
    /// The end of what the points excite.
    excited: Option<f64>,
}

impl Findings {
    /// The ends of the spectra of A and D⁻¹A.
    fn quantities(&self) -> [Quantity; 4] {
        let quantity =
            |name, estimate, bound, certificate, excited| Quantity { name, estimate, bound, certificate, excited };
        let (e, b) = (&self.ends, &self.bounds);
        let [a, jacobi] = self.data;
        let [lowest, highest, jacobi_lowest, jacobi_highest] = self.certificates;
        let (low, high) = (|d: Extremes| d.min, |d: Extremes| d.max);
        [
            quantity("lambda_min", e.lambda_min, b.lambda_min, lowest, a.map(low)),
            quantity("lambda_max", e.lambda_max, b.lambda_max, highest, a.map(high)),
            quantity("jacobi_lambda_min", e.jacobi_lambda_min, b.jacobi_lambda_min, jacobi_lowest, jacobi.map(low)),
            quantity("jacobi_lambda_max", e.jacobi_lambda_max, b.jacobi_lambda_max, jacobi_highest, jacobi.map(high)),
        ]
    }

    fn spectrum(&self) -> Spectrum {
        self.ends.spectrum()
    }

    /// The least eigenvalue of curves and the greatest.
    fn ends_of_curves(&self) -> Option<(f64, f64)> {
        let least = self.curves.iter().copied().min_by(f64::total_cmp)?;
        Some((least, self.curves.iter().copied().max_by(f64::total_cmp)?))
    }

    /// How many null vectors there are: by theory on a mesh, else as far as rounding tells.
    fn kernel_dimension(&self, n: usize) -> Option<usize> {
        match &self.verdict {
            Some(verdict) => Some(verdict.kernel_dimension()),
            None if self.is_singular(n) => self.ends.lambda_min.multiplicity.map(|m| m.count),
            None => Some(0),
        }
    }

    fn is_singular(&self, n: usize) -> bool {
        match &self.verdict {
            Some(verdict) => verdict.is_singular(),
            None => self.ends.lambda_min.value.abs() <= SINGULAR * n as f64 * f64::EPSILON * self.bounds.lambda_max,
        }
    }

    /// The intervals that the certificates prove to hold the spectra of A and of D⁻¹A.
    fn certified(&self) -> Option<Spectrum> {
        let [a_min, a_max, jacobi_min, jacobi_max] = self.certificates;
        let pair =
            |min: Option<Certificate>, max: Option<Certificate>| Some(Extremes { min: min?.bound, max: max?.bound });
        Some(Spectrum { a: pair(a_min, a_max)?, jacobi: pair(jacobi_min, jacobi_max)? })
    }

    fn rates(&self) -> Vec<Rate> {
        let of_ends = |ends: &Spectrum, omegas: &Spectrum| {
            let (a, jacobi) = (ends.a, ends.jacobi);
            let rates = [a, a, jacobi].map(Extremes::krylov_rate);
            let radii = [
                a.radius(1.0),
                a.radius(omegas.a.optimal_omega()),
                jacobi.radius(0.5),
                jacobi.radius(1.0),
                jacobi.radius(omegas.jacobi.optimal_omega()),
            ];
            (radii, rates)
        };
        let spectrum = self.spectrum();
        let (radii, rates) = of_ends(&spectrum, &spectrum);
        let certified = self.certified().map(|ends| of_ends(&ends, &spectrum));
        // A rate is computed in a dozen roundings of numbers of size 1.
        let up = |rho: f64| rho + 16.0 * f64::EPSILON;
        let best = |omega: f64| format!("ω={omega:.6} (optimal)");
        let names = [
            ("pia", "ω=1".into()),
            ("w-pia", best(spectrum.a.optimal_omega())),
            ("thall", "ω=0.5".into()),
            ("jacobi", "ω=1".into()),
            ("jacobi_optimal", best(spectrum.jacobi.optimal_omega())),
        ];
        let mut all = Vec::new();
        for (k, (method, parameter)) in names.into_iter().enumerate() {
            all.push(Rate { method, parameter, rho: radii[k], certified: certified.map(|c| up(c.0[k])) });
        }
        for (method, omega, radius) in &self.sweeps {
            let parameter = format!("ω={omega}, file order");
            all.push(Rate { method: method.name(), parameter, rho: radius.value, certified: None });
        }
        for (k, method) in ["chebyshev", "cg", "pcg-jacobi"].into_iter().enumerate() {
            let parameter = "(√κ−1)/(√κ+1)".into();
            all.push(Rate { method, parameter, rho: rates[k], certified: certified.map(|c| up(c.1[k])) });
        }
        all
    }
}

fn run(arguments: &Arguments, provenance: &Provenance) -> Result<()> {
    if arguments.mesh.print_defects(&arguments.meshes, &arguments.common, provenance)? {
        return Ok(());
    }
    arguments.output.prepare()?;
    let mut results = Vec::new();
    for name in &arguments.meshes {
        if let Some(methods) = &arguments.iteration_matrix {
            results.push(iteration_matrices(name, &methods.0, arguments, provenance)?);
            continue;
        }
        let (subject, findings, n, mesh) = match arguments.mesh.given(name)? {
            Some(given) => {
                arguments.output.settle(STEMS.map(|stem| given.subject.stem(stem)))?;
                let findings = analyse_given(&given, arguments)?;
                (given.subject, findings, given.points.len(), None)
            }
            None => {
                let input = arguments.mesh.input(name, &arguments.common)?;
                arguments.output.settle(STEMS.map(|stem| input.stem(stem)))?;
                if input.surface.features().is_some_and(Features::has_stars) {
                    results.push(complex(&input, arguments, provenance)?);
                    continue;
                }
                let mut findings = analyse(&input, arguments)?;
                for mode in findings.modes.iter_mut().flat_map(|modes| &mut modes.modes) {
                    mode.values = input.file_values(&mode.values);
                }
                let mesh = findings.modes.is_some().then(|| input.file_mesh());
                (input.subject(), findings, input.surface.len(), mesh)
            }
        };
        let out = &arguments.output.out;
        let made = &provenance.about(&subject.source);
        let print = |table: &Table| if arguments.output.json { Ok(()) } else { cli::print_table(table) };
        for table in &[eigenvalue_table(&subject, &findings, n), radius_table(&subject, &findings)] {
            table.write(out, made)?;
            print(table)?;
        }
        if let Some(full) = &findings.full {
            full_table(&subject, full).write(out, made)?;
            let figure = histogram(&subject, full, &findings.promise);
            arguments.output.figure(&subject.stem("spectrum-histogram"), &figure, made)?;
        }
        if let Some(modes) = &findings.modes {
            let table = mode_study::table(&subject, modes);
            mode_study::write(&table, &subject, modes, mesh.as_ref(), &arguments.output, made)?;
            print(&table)?;
        }
        results.push(json(&subject, &findings, n));
    }
    cli::finish(results, &arguments.output, &arguments.common, provenance)
}

/// Writes what there is to say of a mesh with darts or semi-sharp vertices, and gives its JSON object.
fn complex(input: &Input, arguments: &Arguments, provenance: &Provenance) -> Result<Value> {
    let left_out = [("--modes", arguments.modes > 0), ("--certify", arguments.certify)];
    for (flag, _) in left_out.into_iter().filter(|flag| flag.1) {
        arguments.common.remark(format_args!(
            "{}: {flag} is left out, as no diagonal makes the matrix symmetric where there are darts or semi-sharp vertices",
            input.name
        ));
    }
    let progress = Progress::open(&input.name, arguments.common.quiet);
    let found = ComplexFindings::new(input, !arguments.no_sweeps, &progress).map_err(|e| input.named(e))?;
    drop(progress);
    let subject = input.subject();
    let out = &arguments.output.out;
    let made = &provenance.about(&subject.source);
    for table in found.tables(&subject) {
        table.write(out, made)?;
        if !arguments.output.json {
            cli::print_table(&table)?;
        }
    }
    if arguments.full {
        found.full_table(&subject).write(out, made)?;
        arguments.output.figure(&subject.stem("spectrum-eigenvalues"), &found.figure(&subject), made)?;
    }
    Ok(subject.json(found.json(arguments.full)))
}

/// Writes what there is to say of the iteration matrices of `methods`, and gives the JSON object.
fn iteration_matrices(
    name: &str,
    methods: &[Method<'static>],
    arguments: &Arguments,
    provenance: &Provenance,
) -> Result<Value> {
    let problem = arguments.mesh.problem(name, &arguments.stop, arguments.order, &arguments.common)?;
    let subject = &problem.subject;
    arguments.output.settle(ITERATION_STEMS.map(|stem| subject.stem(stem)))?;
    let progress = Progress::new(name, methods.len(), arguments.common.quiet);
    let order = (&problem.order[..], &*arguments.order.to_string());
    let wish = iteration::Wish { full: arguments.full, pseudospectra: arguments.pseudospectra };
    let all = match problem.matrix() {
        Matrix::Symmetric(system) => iteration::all(system, &|| spectrum(system), methods, order, wish, &progress),
        Matrix::General(system, _) => {
            iteration::all(system, &|| ComplexSpectrum::new(system), methods, order, wish, &progress)
        }
    };
    let all = all.map_err(|e| limitlab::Error::mesh(name, e.to_string()))?;
    drop(progress);
    let (out, made) = (&arguments.output.out, &provenance.about(&subject.source));
    let table = iteration::table(subject, &all);
    table.write(out, made)?;
    if !arguments.output.json {
        cli::print_table(&table)?;
    }
    iteration::eigenvalue_table(subject, &all)
        .write_csv_file(&out.join(format!("{}.csv", subject.stem(ITERATION_STEMS[1]))), made)?;
    let (caption, drawn) = (subject.caption(), all.iter().collect::<Vec<_>>());
    arguments.output.figure(&table.id, &iteration::plane(&caption, &drawn), made)?;
    if let Some(table) = iteration::power_table(subject, &all) {
        table.write_csv_file(&out.join(format!("{}.csv", table.id)), made)?;
    }
    let further = [iteration::powers(&caption, &drawn), iteration::pseudospectra(&caption, &drawn)];
    for (stem, figure) in ITERATION_STEMS[2..].iter().zip(further) {
        if let Some(figure) = figure {
            arguments.output.figure(&subject.stem(stem), &figure, made)?;
        }
    }
    Ok(subject.json(iteration::json(&all)))
}

/// All findings: from `acting`, and where entries are asked for, from `system`, which is the same with entries.
fn analyse_any(
    system: Option<&LimitSystem>,
    acting: &impl System,
    (points, start): (&[DVec3], &[DVec3]),
    parts: Parts,
    progress: &Progress,
    arguments: &Arguments,
) -> Result<Findings> {
    let Parts { name, bounds, verdict, stop, ends } = parts;
    let promise = Promise::new(&bounds);
    progress.message("iterations that suffice");
    let counts = match stop {
        Ok(stop) => Some(promise.counts(acting, (points, start), stop.tolerance)),
        Err(error) => {
            arguments.common.remark(format_args!("no iterations are promised: {error}"));
            None
        }
    };
    if arguments.full {
        progress.message("all eigenvalues");
    }
    let full = system.filter(|_| arguments.full).map(dense::full_eigenvalues).transpose()?;
    progress.step();
    progress.message("ends of the spectra");
    let ends = ends()?;
    if !ends.converged() {
        arguments.common.remark(format_args!(
            "{name}: an end of the spectrum is the edge of a dense band; its error is in the table"
        ));
    }
    progress.step();
    let sweeps = system.filter(|_| !arguments.no_sweeps).map(|system| radii_of_sweeps(system, progress));
    let sweeps = sweeps.transpose()?.unwrap_or_default();
    progress.step();
    progress.message("what the points excite, and slow modes");
    let data = if arguments.no_data {
        [None; 2]
    } else {
        let excited = |which| excited(acting, (points, start), which);
        [excited(SymmetricForm::A)?, excited(SymmetricForm::Jacobi)?]
    };
    let count = arguments.modes.into();
    let modes = system.filter(|_| count > 0).map(|s| modes(s, SymmetricForm::A, End::Lowest, count)).transpose()?;
    progress.step();
    let mut certificates = [None; 4];
    progress.message("certificates");
    if let Some(system) = system.filter(|_| arguments.certify) {
        let Spectrum { a, jacobi } = ends.spectrum();
        for (slot, (which, end, estimate)) in certificates.iter_mut().zip([
            (SymmetricForm::A, End::Lowest, a.min),
            (SymmetricForm::A, End::Highest, a.max),
            (SymmetricForm::Jacobi, End::Lowest, jacobi.min),
            (SymmetricForm::Jacobi, End::Highest, jacobi.max),
        ]) {
            *slot = certify(system, which, end, estimate, WITHIN)?;
        }
    }
    progress.step();
    let (curves, corners) = (Vec::new(), 0);
    Ok(Findings { bounds, ends, full, sweeps, verdict, promise, counts, data, modes, certificates, curves, corners })
}

/// What is known otherwise of a mesh and of a system without one.
struct Parts<'a> {
    name: &'a str,
    bounds: SpectralBounds,
    verdict: Option<Singularity>,
    stop: Result<Stop>,
    ends: &'a dyn Fn() -> Result<SpectrumEnds>,
}

/// The smooth vertices of an open or creased mesh.
fn analyse_stages(input: &Input, arguments: &Arguments) -> Result<Findings> {
    let stages = input.stages()?;
    let block = stages.block();
    let known = stages.known(input.surface.positions());
    let (right, start) = (stages.right_hand_side(&known), stages.restricted(&known));
    let progress = Progress::new(&input.name, 5, arguments.common.quiet);
    let parts = Parts {
        name: &input.name,
        bounds: block.bounds,
        verdict: Some(Singularity::detect(&input.surface, input.scheme)),
        stop: input.stop(&arguments.stop),
        ends: &|| ends(block),
    };
    let found = analyse_any(Some(block), block, (&right, &start), parts, &progress, arguments);
    let mut found = found.map_err(|e| input.named(e))?;
    found.curves = stages.curves().eigenvalues();
    found.corners = input.surface.len() - stages.curves().len() - block.len();
    for mode in found.modes.iter_mut().flat_map(|modes| &mut modes.modes) {
        mode.values = stages.joined(vec![0.0; stages.len()], std::mem::take(&mut mode.values));
    }
    if let Some(full) = &mut found.full {
        // The other stages have 1 and the eigenvalues of the curves, over their diagonals too.
        let diagonal = 1.0 - 2.0 * stages.curves().weight();
        let add = |all: &mut Vec<f64>, scale: f64| {
            all.extend(found.curves.iter().map(|x| x / scale));
            all.extend(std::iter::repeat_n(1.0, found.corners));
            all.sort_unstable_by(f64::total_cmp);
        };
        add(&mut full.a, 1.0);
        add(&mut full.jacobi, diagonal);
    }
    Ok(found)
}

fn analyse(input: &Input, arguments: &Arguments) -> Result<Findings> {
    if input.surface.features().is_some() {
        return analyse_stages(input, arguments);
    }
    // Only some of what can be asked for needs entries.
    let explicit = arguments.full || !arguments.no_sweeps || arguments.modes > 0 || arguments.certify;
    let system =
        explicit.then(|| LimitSystem::new(&input.surface, input.scheme)).transpose().map_err(|e| input.named(e))?;
    let surface = &input.surface;
    let mesh = surface.mesh();
    let operator = limitlab::assemble::Operator::new(surface, input.scheme).map_err(|e| input.named(e))?;
    let progress = Progress::new(&input.name, 5, arguments.common.quiet);
    let parts = Parts {
        name: &input.name,
        bounds: operator.bounds(),
        verdict: Some(Singularity::detect(surface, input.scheme)),
        stop: input.stop(&arguments.stop),
        ends: &|| mesh_ends(surface, input.scheme),
    };
    analyse_any(system.as_ref(), &operator, (&mesh.positions, &mesh.positions), parts, &progress, arguments)
        .map_err(|e| input.named(e))
}

fn analyse_given(given: &Given, arguments: &Arguments) -> Result<Findings> {
    let Given { subject, system, points, .. } = given;
    let progress = Progress::new(&subject.name, 5, arguments.common.quiet);
    let stop = given.stop(&arguments.stop);
    let parts = Parts { name: &subject.name, bounds: system.bounds, verdict: None, stop, ends: &|| ends(system) };
    let found = analyse_any(Some(system), system, (points, points), parts, &progress, arguments);
    found.map_err(|e| limitlab::Error::mesh(&subject.name, e.to_string()))
}

fn eigenvalue_table(subject: &Subject, found: &Findings, n: usize) -> Table {
    let columns = Columns::<Quantity>::new()
        .col(Column::key("quantity"), |q| q.name)
        .col(Column::number("value", 1e-7, 10), |q| q.estimate.value)
        .col(Column::number("residual", 1e3, 2).floor(1e-6), |q| q.estimate.residual)
        .col(Column::number("error", 1e3, 2).floor(1e-6), |q| q.estimate.error)
        .col(Column::text("source"), |q| q.estimate.source.name())
        .col(Column::count("multiplicity"), |q| q.estimate.multiplicity.map(|m| m.count))
        .col(Column::number("equal_within", 1e-3, 1), |q| q.estimate.multiplicity.map(|m| m.within))
        .col(Column::number("proven_bound", 1e-9, 10), |q| q.bound)
        .col(Column::number("certified", 1e-6, 10), |q| q.certificate.map(|c| c.bound))
        .col(Column::number("attained", 1e-6, 10), |q| q.certificate.map(|c| c.attained))
        .col(Column::number("excited_by_data", 1e-3, 6), |q| q.excited);
    let title = format!("Spectrum of {}", subject.title);
    let mut table = columns.table(subject.stem("spectrum"), title, &found.quantities());
    table.note(match &found.verdict {
        Some(verdict) => format!("{}, {}", subject.size, of_a_mesh(verdict)),
        None => format!("{}; {}", subject.size, of_a_system(found, n)),
    });
    table.note(format!(
        "`residual` is ‖Sx − λx‖₂ of the symmetric matrix similar to A or D⁻¹A: an eigenvalue lies that close. `error` \
         estimates the error of the value as the end of the spectrum. {} products of a matrix with a vector were made. \
         `multiplicity` counts the eigenvalues that equal this \
         end up to `equal_within`, relative, where that was decided. ω of Jacobi is safe below {:.6} by proof, below {:.6} by \
         the spectrum; of W-PIA below {:.6}.",
        found.ends.applications,
        found.promise.safe_omega_jacobi,
        found.spectrum().jacobi.critical_omega(),
        found.promise.safe_omega_pia
    ));
    table.note(format!(
        "Proven: `proven_bound`, by a theorem, from {} (its formula, to rounding); that the end lies between `certified` and `attained` (--certify), by a \
         Cholesky factorization and a Rayleigh quotient whose rounding is bounded before they are made; values of `source` \
         proven (a vector attains the bound, to rounding) and bracketed (within `error`, by counts of eigenvalues whose rounding \
         is bounded). Converged to `residual`, but not proven to be the end: lanczos; dense is as good as the backward error of \
         a dense eigenvalue solver. Measured: unconverged, and what the points excite.",
        if found.verdict.is_some() { "valences and face sizes alone" } else { "the entries (Gershgorin)" },
    ));
    if let Some((least, greatest)) = found.ends_of_curves() {
        table.note(format!(
            "All of this is about the smooth vertices. Those on curves have eigenvalues of their own, {} from {least:.6} to \
             {greatest:.6}, and each corner has 1: the spectrum of A is the union.",
            found.curves.len()
        ));
    }
    table.note(match &found.counts {
        Some(counts) => format!(
            "Iterations that suffice by proof for this tolerance from V = P: PIA {}, W-PIA {}, Thall {}, Chebyshev {}.",
            promised(counts.pia),
            promised(counts.w_pia),
            promised(counts.thall),
            promised(counts.chebyshev)
        ),
        None => "All points coincide: no tolerance is relative to their extent, and no iterations are promised.".into(),
    });
    table
}

/// The components of a mesh, and what theory says of its system.
fn of_a_mesh(verdict: &Singularity) -> String {
    let kernel = verdict.kernel_dimension();
    let components = |n: usize| format!("{n} {}", if n == 1 { "component" } else { "components" });
    let mut text = format!(
        "{}; {}",
        components(verdict.components),
        if kernel > 0 {
            format!(
                "**singular**: {} (the first begins at vertex {}) {} {}, the null vectors are \
                 their ±1 colourings, and the points {} a part that no control points reach.",
                components(kernel),
                verdict.singular[0].first_vertex,
                if kernel == 1 { "has" } else { "have" },
                verdict.set.condition().unwrap_or_default(),
                if verdict.excited { "have" } else { "do not have" }
            )
        } else {
            match verdict.set.condition() {
                Some(condition) => format!("non-singular: no component has {condition}."),
                None => "non-singular, as on every mesh under this scheme.".into(),
            }
        }
    );
    if kernel > 0 {
        text += &format!(
            " PIA {}; Gauss-Seidel {}; Cholesky {}.",
            verdict.prediction(Method::Pia).name(),
            verdict.prediction(Method::GaussSeidel { order: None }).name(),
            verdict.prediction(Method::Cholesky).name()
        );
    }
    text
}

/// What the computed spectrum says of a system without a mesh.
fn of_a_system(found: &Findings, n: usize) -> &'static str {
    if found.is_singular(n) {
        "**singular** to rounding: λ_min is below 4·N·ε·λ_max."
    } else if found.ends.lambda_min.value < 0.0 {
        "**indefinite**: λ_min is negative, and the methods for positive definite matrices need not converge."
    } else {
        "positive definite, as far as the computed λ_min tells."
    }
}

fn promised(count: f64) -> String {
    if count.is_finite() { count.to_string() } else { "unknown (no positive bound for λ_min)".into() }
}

fn radius_table(subject: &Subject, found: &Findings) -> Table {
    let mut columns = Columns::<Rate>::new()
        .col(Column::key("method"), |r| r.method)
        .col(Column::key("parameter"), |r| r.parameter.clone())
        .col(Column::number("rho", 1e-5, 6), |r| r.rho);
    if found.certified().is_some() {
        columns = columns.col(Column::number("certified", 1e-5, 6), |r| r.certified);
    }
    let title = format!("Predicted rates on {}", subject.title);
    let mut table = columns.table(subject.stem("spectrum-rates"), title, &found.rates());
    table.note(
        "Factors per iteration: the spectral radius of the error matrix; for Chebyshev and conjugate gradients the bound \
         from the condition number. They are as well known as the ends that they follow from; those of Gauss-Seidel, SOR and \
         SSOR are measured. What --certify proves stands in a column `certified`: no rate is greater."
            .to_string(),
    );
    table
}

fn full_table(subject: &Subject, full: &dense::Eigenvalues) -> Table {
    let columns = Columns::<usize>::new()
        .col(Column::key("index"), |i| i.to_string())
        .col(Column::number("a", 1e-9, 10), |&i| full.a[i])
        .col(Column::number("jacobi", 1e-9, 10), |&i| full.jacobi[i]);
    let title = format!("All eigenvalues of {}", subject.title);
    columns.table(subject.stem("spectrum-full"), title, &Vec::from_iter(0..full.a.len()))
}

fn histogram(subject: &Subject, full: &dense::Eigenvalues, promise: &Promise) -> Figure {
    let panel = |values: &[f64], name: &str, label: &str, bounds: Extremes| LinePlot {
        x_label: format!("eigenvalue of {label}"),
        y_label: "eigenvalues".into(),
        bars: vec![Bars::histogram(name, values, BINS)],
        vertical_lines: vec![Rule::new(bounds.min, "proven bounds"), Rule::new(bounds.max, "")],
        ..LinePlot::default()
    };
    let a = LinePlot { title: subject.caption(), ..panel(&full.a, "A", "A (PIA, CG, Chebyshev)", promise.a) };
    let jacobi = panel(&full.jacobi, "D⁻¹A", "D⁻¹A (Jacobi)", promise.jacobi);
    let mut figure = Figure::stack([a, jacobi]);
    figure.share_x = false;
    figure
}

fn json(subject: &Subject, found: &Findings, n: usize) -> Value {
    let e = &found.ends;
    let Spectrum { a, jacobi } = found.spectrum();
    let quantities = found.quantities();
    let each = |value: fn(&Quantity) -> Value| quantities.iter().map(|q| (q.name, value(q))).collect::<Value>();
    let promised = |count: fn(&IterationCounts) -> f64| found.counts.as_ref().map(|c| number(count(c)));
    let mut rho = Map::new();
    let rates = found.rates();
    for rate in &rates {
        rho.insert(rate.method.into(), number(rate.rho));
    }
    let mut object = json!({
        "lambda_min": number(e.lambda_min.value),
        "lambda_max": number(e.lambda_max.value),
        "lambda_min_bound": number(found.bounds.lambda_min),
        "jacobi_lambda_min": number(e.jacobi_lambda_min.value),
        "jacobi_lambda_max": number(e.jacobi_lambda_max.value),
        "jacobi_lambda_min_bound": number(found.bounds.jacobi_lambda_min),
        "jacobi_lambda_max_bound": number(found.bounds.jacobi_lambda_max),
        "residuals": each(|q| number(q.estimate.residual)),
        "multiplicities": each(|q| {
            let multiplicity = q.estimate.multiplicity;
            multiplicity.map(|m| json!({ "count": m.count, "within": m.within })).into()
        }),
        "sources": each(|q| q.estimate.source.name().into()),
        "converged": e.converged(),
        "applications": e.applications,
        "rho": rho,
        "optimal_omega": {
            "w-pia": number(a.optimal_omega()),
            "jacobi": number(jacobi.optimal_omega()),
        },
        "critical_omega_jacobi": number(jacobi.critical_omega()),
        "safe_omega_jacobi": number(found.promise.safe_omega_jacobi),
        "promised_iterations": {
            "pia": promised(|c| c.pia),
            "w-pia": promised(|c| c.w_pia),
            "thall": promised(|c| c.thall),
            "chebyshev": promised(|c| c.chebyshev),
        },
        "singular": found.is_singular(n),
        "kernel_dimension": found.kernel_dimension(n),
        "curves": found.ends_of_curves().map(|(least, greatest)| json!({
            "unknowns": found.curves.len(), "lambda_min": number(least), "lambda_max": number(greatest),
        })),
        "kernel_excited": found.verdict.as_ref().map(|v| v.excited),
    });
    if let Value::Object(map) = &mut object {
        let of_ends = |value: fn(&Certificate) -> f64| {
            let proven = |q: &Quantity| Some((q.name.to_owned(), number(value(q.certificate.as_ref()?))));
            quantities.iter().filter_map(proven).collect::<Map<_, _>>()
        };
        let of_rates = rates.iter().filter_map(|r| Some((r.method.to_owned(), number(r.certified?)))).collect();
        let proofs =
            [("certified", of_ends(|c| c.bound)), ("attained", of_ends(|c| c.attained)), ("certified_rho", of_rates)];
        for (field, values) in proofs.into_iter().filter(|(_, values)| !values.is_empty()) {
            map.insert(field.into(), Value::Object(values));
        }
        if let Some(verdict) = found.verdict.as_ref().filter(|v| v.is_singular()) {
            let all = Method::ALL.iter().map(|&m| (m.name().to_owned(), Value::from(verdict.prediction(m).name())));
            map.insert("predictions".into(), Value::Object(all.collect()));
        }
        if let Some(full) = &found.full {
            map.insert("eigenvalues".into(), json!({ "a": full.a, "jacobi": full.jacobi }));
        }
        if let Some(modes) = &found.modes {
            map.extend(mode_study::json(modes).map(|(field, value)| (field.to_owned(), value)));
        }
    }
    subject.json(object)
}
