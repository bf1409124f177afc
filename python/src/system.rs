//! The limit system of a mesh: its matrices as views of what the library holds, its products, its solutions.

use std::sync::OnceLock;

use glam::DVec3;
use limitlab::analysis::Spectrum;
use limitlab::analysis::comparison::with_spectrum;
use limitlab::analysis::complex_spectrum::ComplexSpectrum;
use limitlab::analysis::failed::Failed;
use limitlab::analysis::spectrum::spectrum;
use limitlab::assemble::bounds::SpectralBounds;
use limitlab::assemble::{Csr, GeneralSystem, LimitSystem, Operator, Stages};
use limitlab::error::Result;
use limitlab::interpolate::{Interpolator, Options, interpolate_watched, staged};
use limitlab::mesh::Surface;
use limitlab::mesh::features::Rule;
use limitlab::mesh::frame::Frame;
use limitlab::schemes::Scheme;
use limitlab::solvers::system::product;
use limitlab::solvers::{Method, Outcome, Solution, Step, Stop, run_from};
use numpy::ndarray::ArrayView1;
use numpy::{Element, PyArray1, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::advice;
use crate::arrays::{Rows, array_of, index_array, points_of, require_length};
use crate::errors::raised;
use crate::interpolate::told;
use crate::options::Asked;
use crate::surface::{PySurface, placed};
use crate::watch::Watch;

/// A V = P of one mesh, assembled.
#[pyclass(frozen, name = "System")]
pub struct PySystem {
    mesh: Py<PySurface>,
    pub scheme: Scheme,
    pub stages: Stages,
    /// What is made when first asked for: all rows, where they are not those of the block; the ends of the block's spectra; the
    /// rows without entries.
    whole: OnceLock<GeneralSystem>,
    spectrum: OnceLock<Spectrum>,
    operator: OnceLock<Operator>,
}

/// Values, columns and offsets of compressed sparse rows.
type CsrParts<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<i32>>, Bound<'py, PyArray1<i32>>);

/// A read-only array in the memory of a system, which it keeps alive.
fn view<'py, T: Element>(owner: &Bound<'py, PySystem>, of: impl Fn(&PySystem) -> &[T]) -> Bound<'py, PyArray1<T>> {
    let data = ArrayView1::from(of(owner.get()));
    // SAFETY: the numbers lie in `owner`, which the array keeps alive and which is frozen, so that they neither move nor
    // change; the array is made read-only before anybody else sees it.
    let array = unsafe { PyArray1::borrow_from_array(&data, owner.clone().into_any()) };
    array.readwrite().make_nonwriteable();
    array
}

/// Views of a matrix. Its indices are below 2³¹ as long as it has fewer entries, which [`PySystem::new`] sees to.
fn csr<'py>(owner: &Bound<'py, PySystem>, of: impl Fn(&PySystem) -> &Csr + Copy) -> CsrParts<'py> {
    (
        view(owner, move |system| of(system).values()),
        view(owner, move |system| bytemuck::cast_slice(of(system).pattern().columns())),
        view(owner, move |system| bytemuck::cast_slice(of(system).pattern().offsets())),
    )
}

#[pymethods]
impl PySystem {
    #[new]
    fn new(py: Python<'_>, mesh: &Bound<'_, PySurface>, scheme: Option<&str>) -> PyResult<Self> {
        let surface = &mesh.get().surface;
        let scheme = mesh.get().scheme_of(py, scheme)?;
        let stages = py.detach(|| Stages::new(surface, scheme, None)).map_err(|e| raised(py, e))?;
        // Rows of curves and stars have no more entries than those of smooth vertices.
        if i32::try_from(stages.block().a.values().len()).is_err() {
            return Err(pyo3::exceptions::PyMemoryError::new_err(
                "the matrix has more than 2³¹ − 1 entries, which 32-bit indices of SciPy do not reach; use interpolate",
            ));
        }
        Ok(PySystem {
            mesh: mesh.clone().unbind(),
            scheme,
            stages,
            whole: OnceLock::new(),
            spectrum: OnceLock::new(),
            operator: OnceLock::new(),
        })
    }

    fn __len__(&self) -> usize {
        self.stages.len()
    }

    #[getter]
    fn scheme(&self) -> &'static str {
        self.scheme.name()
    }

    /// All rows of A.
    fn a<'py>(slf: &Bound<'py, Self>) -> CsrParts<'py> {
        let this = slf.get();
        slf.py().detach(|| this.all());
        csr(slf, PySystem::all)
    }

    /// A of the smooth vertices.
    fn block_a<'py>(slf: &Bound<'py, Self>) -> CsrParts<'py> {
        csr(slf, |system| &system.stages.block().a)
    }

    /// M of the smooth vertices.
    fn block_m<'py>(slf: &Bound<'py, Self>) -> CsrParts<'py> {
        csr(slf, |system| &system.stages.block().m)
    }

    /// The diagonal of H of the smooth vertices.
    fn block_h<'py>(slf: &Bound<'py, Self>) -> Bound<'py, PyArray1<f64>> {
        view(slf, |system| &system.stages.block().h)
    }

    /// λ_min, λ_max of A and of D⁻¹A, as far as they are proven.
    fn bounds(&self) -> (f64, f64, f64, f64) {
        let SpectralBounds { lambda_min, lambda_max, jacobi_lambda_min, jacobi_lambda_max, .. } =
            match self.is_unsymmetric() {
                true => self.general().bounds(),
                false => self.stages.block().bounds,
            };
        (lambda_min, lambda_max, jacobi_lambda_min, jacobi_lambda_max)
    }

    /// The vertices of each stage: smooth, on curves, corners, darts and semi-sharp ones.
    fn blocks<'py>(&self, py: Python<'py>) -> [Bound<'py, PyArray1<i32>>; 4] {
        let stars = self.stages.stars().map_or_else(Vec::new, |stars| stars.vertices().to_vec());
        let smooth = match self.stages.vertices() {
            Some(vertices) => vertices.to_vec(),
            None => (0..self.stages.len() as u32).collect(),
        };
        let rules = self.surface().features().map_or(&[][..], |features| features.rules());
        let of_rule = |rule| (0..).zip(rules).filter(|&(_, &r)| r == rule).map(|(v, _)| v).collect::<Vec<u32>>();
        [smooth, of_rule(Rule::Crease), of_rule(Rule::Corner), stars].map(|vertices| index_array(py, vertices))
    }

    /// A x of one number a vertex, without a stored matrix where all vertices are smooth.
    fn times<'py>(&self, py: Python<'py>, x: PyReadonlyArray1<'py, f64>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let x = x.as_slice()?;
        require_length(x.len(), self.stages.len(), "x")?;
        let mut image = vec![0.0; x.len()];
        py.detach(|| self.product(x, &mut image)).map_err(|e| raised(py, e))?;
        Ok(crate::interpolate::numbers(py, image))
    }

    /// A X of one point a vertex.
    fn times_points<'py>(&self, py: Python<'py>, x: PyReadonlyArray2<'py, f64>) -> PyResult<Rows<'py>> {
        let x = points_of(&x, self.stages.len(), "X")?;
        let mut image = vec![DVec3::ZERO; x.len()];
        py.detach(|| self.product(x, &mut image)).map_err(|e| raised(py, e))?;
        Ok(array_of(py, image))
    }

    /// Solves A V = P, from V = `start` where there is one.
    #[pyo3(signature = (points, start, asked))]
    fn solve<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray2<'py, f64>,
        start: Option<PyReadonlyArray2<'py, f64>>,
        asked: Asked,
    ) -> PyResult<Bound<'py, PyDict>> {
        let n = self.stages.len();
        let (points, frame) = placed(py, points_of(&points, n, "P")?.to_vec())?;
        let start = start.as_ref().map(|start| points_of(start, n, "x0")).transpose()?.map(|start| {
            let mut start = start.to_vec();
            frame.enter(&mut start);
            start
        });
        let method = asked.solver(py)?;
        let order = method.map_or_else(|| Ok(Vec::new()), |_| asked.order(py, self.surface()))?;
        let options = asked.options(&frame, None)?;
        let stop = options.stop(&points).map_err(|e| raised(py, e))?;
        let mut watch = Watch::new(asked.callback, frame.scale());
        let solution = py.detach(|| match method {
            None => self.by_auto(&points, start, &options, &stop, &mut watch),
            Some(method) => self.by_method(&points, start.as_deref(), method.in_order(Some(&order)), &stop, &mut watch),
        });
        watch.end()?;
        let solution = solution.map_err(|e| raised(py, e))?;
        let mesh = self.mesh(points, frame);
        let failed = failed(py, &mesh, self.scheme, method.is_some(), &solution, &stop);
        let found = told(py, solution, (stop.tolerance, failed), &mesh)?;
        found.set_item("scheme", self.scheme.name())?;
        Ok(found)
    }
}

/// What to do about a run that did not converge.
pub fn failed(
    py: Python<'_>,
    mesh: &PySurface,
    scheme: Scheme,
    chosen: bool,
    solution: &Solution,
    stop: &Stop,
) -> Option<String> {
    match solution.report.outcome {
        Outcome::Converged | Outcome::Stopped => None,
        Outcome::Rounding
        | Outcome::Diverged
        | Outcome::MaxIterations
        | Outcome::Stagnated
        | Outcome::Singular
        | Outcome::Breakdown => {
            let made = || Failed::new((&mesh.surface, scheme), None, chosen, &solution.report, stop);
            Some(advice::of_failed(&py.detach(made), mesh.frame.scale()))
        }
    }
}

impl PySystem {
    fn surface(&self) -> &Surface {
        &self.mesh.get().surface
    }

    /// The mesh of the system with other points, in their frame.
    pub fn mesh(&self, points: Vec<DVec3>, frame: Frame) -> PySurface {
        PySurface { surface: self.surface().with_positions(points), frame }
    }

    /// Whether no diagonal makes A symmetric on what is not known.
    pub fn is_unsymmetric(&self) -> bool {
        self.stages.stars().is_some()
    }

    /// All rows at once, for methods that need no symmetry.
    pub fn general(&self) -> &GeneralSystem {
        self.whole.get_or_init(|| self.stages.whole())
    }

    /// The system whose symmetry methods use.
    pub fn block(&self) -> &LimitSystem {
        self.stages.block()
    }

    fn all(&self) -> &Csr {
        match self.stages.vertices() {
            None => &self.stages.block().a,
            Some(_) => self.general().matrix(),
        }
    }

    /// The ends of the spectra of the block.
    ///
    /// # Errors
    /// If an eigenvalue computation does not converge.
    pub fn spectrum(&self) -> Result<Spectrum> {
        if let Some(spectrum) = self.spectrum.get() {
            return Ok(*spectrum);
        }
        let found = spectrum(self.stages.block())?;
        Ok(*self.spectrum.get_or_init(|| found))
    }

    fn product<P: limitlab::assemble::weights::Point>(&self, x: &[P], image: &mut [P]) -> Result<()> {
        if self.stages.vertices().is_some() {
            product(self.general(), x, image);
            return Ok(());
        }
        let operator = match self.operator.get() {
            Some(operator) => operator,
            None => {
                let made = Operator::new(self.surface(), self.scheme)?;
                self.operator.get_or_init(|| made)
            }
        };
        product(operator, x, image);
        Ok(())
    }

    /// The whole chain; from a start that is given its first two steps.
    fn by_auto(
        &self,
        points: &[DVec3],
        start: Option<Vec<DVec3>>,
        options: &Options<'_>,
        stop: &Stop,
        watch: &mut Watch,
    ) -> Result<Solution> {
        let see = &mut |method: &'static str, step: &Step| watch.see(method, step);
        let surface = self.surface().with_positions(points.to_vec());
        let Some(mut control) = start else {
            return interpolate_watched(&surface, self.scheme, options, see);
        };
        let begin = std::time::Instant::now();
        let mut interpolator = Interpolator::new(&surface, self.scheme, None)?;
        let setup_seconds = begin.elapsed().as_secs_f64();
        let begin = std::time::Instant::now();
        let (method, report) = interpolator.solve_watched(points, &mut control, stop, see);
        let solve_seconds = begin.elapsed().as_secs_f64();
        Ok(Solution { points: control, method, report, setup_seconds, solve_seconds, fill: None })
    }

    fn by_method(
        &self,
        points: &[DVec3],
        start: Option<&[DVec3]>,
        method: Method<'_>,
        stop: &Stop,
        watch: &mut Watch,
    ) -> Result<Solution> {
        let see = &mut |step: &Step| watch.see(method.name(), step);
        let start = start.unwrap_or(points);
        if let Some(stars) = self.stages.stars() {
            if method.needs_symmetry() {
                return Err(method.refused_at(stars.vertices()[0] as usize));
            }
            let system = self.general();
            let method = with_spectrum(system, method, &|| ComplexSpectrum::new(system))?;
            return Ok(run_from(system, points, start, method, stop, see));
        }
        let order = method.order().map(|order| self.stages.order(order));
        let method = with_spectrum(self.block(), method.in_order(order.as_deref()), &|| self.spectrum())?;
        Ok(staged::run_from(&self.stages, points, start, method, stop, see))
    }
}
