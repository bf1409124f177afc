//! The tables, pictures and JSON object about the iteration matrices of stationary methods.

use serde_json::{Value, json};

use super::style;
use crate::cli::{Progress, Subject, number};
use crate::report::{Colour, Column, Columns, Dash, Figure, LinePlot, Scale, Series, Table, palette};
use limitlab::analysis::comparison::with_spectrum;
use limitlab::analysis::dense;
use limitlab::analysis::iteration_matrix::{Hump, IterationMatrix, Norm, outermost_eigenvalues};
use limitlab::analysis::pseudospectrum::least_singular_values;
use limitlab::analysis::spectral_radius::RitzValue;
use limitlab::analysis::spectrum::Spectra;
use limitlab::error::short;
use limitlab::solvers::{Method, System};
use limitlab::{Error, Result};

/// Eigenvalues looked for where not all are computed.
const OUTERMOST: usize = 24;
/// Powers at most, and the norm at which they end: steps to it are counted.
const POWERS: usize = 60;
const REDUCTION: f64 = 1e-6;
/// ε of the contours: powers of 10, from this to that exponent, and points of the grid in a row.
const LEVELS: [f64; 5] = [-0.5, -1.0, -1.5, -2.0, -3.0];
const GRID: usize = 60;

/// A stationary method with its ω, as `METHOD[:ω]`.
///
/// # Errors
/// A name that is none; a method that is not stationary, or has no ω.
pub fn stationary(text: &str) -> std::result::Result<Method<'static>, String> {
    let (name, omega) = text.split_once(':').map_or((text, None), |(name, omega)| (name, Some(omega)));
    let method: Method = name.trim().parse().map_err(|e: Error| e.to_string())?;
    let all = || {
        let names = Method::ALL.into_iter().filter(|m| m.is_stationary()).map(Method::name);
        names.collect::<Vec<_>>().join(", ")
    };
    if !method.is_stationary() {
        return Err(format!("{method} has no iteration matrix; choose among {}", all()));
    }
    let Some(omega) = omega else { return Ok(method) };
    let omega = crate::cli::positive(omega.trim())?;
    method.at_omega(omega).ok_or_else(|| format!("{method} has no ω"))
}

/// What is found of one method.
pub struct Found {
    method: &'static str,
    colour: Colour,
    omega: f64,
    order: String,
    /// The largest modulus first; the residual is no less than rounding, Nε, which it is where all are computed.
    pub eigenvalues: Vec<RitzValue>,
    /// Whether these are all.
    complete: bool,
    pub norms: [Option<f64>; 3],
    numerical_radius: Option<f64>,
    /// ‖T^k‖ from k = 1 on.
    pub powers: Vec<[Option<f64>; 3]>,
    pseudospectrum: Option<Pseudospectrum>,
}

/// σ_min(z − T) on a grid of the upper half plane.
struct Pseudospectrum {
    re: Vec<f64>,
    im: Vec<f64>,
    values: Vec<f64>,
}

/// What is asked for beside the eigenvalues.
#[derive(Clone, Copy)]
pub struct Wish {
    /// All eigenvalues wherever they can be computed.
    pub full: bool,
    pub pseudospectra: bool,
}

impl Found {
    /// Of `method`, which has its ω and the vertex order of its sweeps, called `order`.
    ///
    /// # Errors
    /// Those of the computations.
    pub fn new<S: System>(system: &S, method: Method, order: &str, wish: Wish) -> Result<Self> {
        let omega = method.omega().unwrap_or(f64::NAN);
        let order = if method.in_order(None) == method { "" } else { order };
        let mut found = Found {
            method: method.name(),
            colour: style::of(method, "").colour,
            omega,
            order: order.into(),
            eigenvalues: Vec::new(),
            complete: false,
            norms: [None; 3],
            numerical_radius: None,
            powers: Vec::new(),
            pseudospectrum: None,
        };
        let small = system.len() <= dense::LARGEST;
        let rounding = system.len() as f64 * f64::EPSILON;
        if !(wish.full || wish.pseudospectra || small) {
            found.eigenvalues = outermost_eigenvalues(system, method, OUTERMOST)?;
            // The process tells of residuals that no product could show.
            found.eigenvalues.iter_mut().for_each(|z| z.residual = z.residual.max(rounding));
            return Ok(found);
        }
        let t = IterationMatrix::new(system, method)?;
        found.eigenvalues = t.eigenvalues()?.into_iter().map(|value| RitzValue { value, residual: rounding }).collect();
        found.complete = true;
        // First, as it is refused on the smallest meshes.
        if wish.pseudospectra {
            found.pseudospectrum = Some(Pseudospectrum::new(&t, found.radius())?);
        }
        if small {
            found.powers = t.powers(POWERS, REDUCTION)?;
            found.norms = found.powers.first().copied().unwrap_or_default();
            found.numerical_radius = Some(t.numerical_radius()?);
        } else {
            for (slot, norm) in found.norms.iter_mut().zip(Norm::ALL) {
                *slot = t.norm(norm)?;
            }
        }
        Ok(found)
    }

    /// ρ(T).
    pub fn radius(&self) -> f64 {
        self.eigenvalues.first().map_or(0.0, |first| first.value.norm())
    }

    /// Whether its step is a sweep in some order.
    pub fn is_swept(&self) -> bool {
        !self.order.is_empty()
    }

    /// ‖T^k‖ in the energy norm, or in the Euclidean where there is none.
    fn main_norm(&self) -> impl Iterator<Item = f64> + '_ {
        self.powers.iter().filter_map(|norms| norms[0].or(norms[1]))
    }

    fn hump(&self) -> Option<Hump> {
        Hump::new(self.main_norm(), self.radius())
    }

    /// The least k with ‖T^k‖ ≤ 10⁻⁶, where it is among the powers.
    fn steps(&self) -> Option<usize> {
        self.main_norm().position(|norm| norm <= REDUCTION).map(|at| at + 1)
    }

    /// The same by the radius alone.
    fn steps_by_radius(&self) -> Option<usize> {
        let radius = self.radius();
        (radius > 0.0 && radius < 1.0).then(|| (REDUCTION.ln() / radius.ln()).ceil() as usize)
    }

    fn name(&self) -> String {
        let order = if self.order.is_empty() { String::new() } else { format!(", {}", self.order) };
        format!("{} (ω={}{order})", self.method, shown_omega(self.omega))
    }
}

impl Pseudospectrum {
    fn new(t: &IterationMatrix, radius: f64) -> Result<Self> {
        // What lies beyond is within 10^-½ of no eigenvalue of a normal matrix.
        let reach = (radius + 0.5).max(1.1);
        let at = |k: usize, n: usize, from: f64| from + (reach - from) * k as f64 / (n - 1) as f64;
        let re: Vec<f64> = (0..GRID).map(|k| at(k, GRID, -reach)).collect();
        let im: Vec<f64> = (0..GRID / 2).map(|k| at(k, GRID / 2, 0.0)).collect();
        let values = least_singular_values(t, &re, &im)?;
        Ok(Pseudospectrum { re, im, values })
    }

    /// The largest modulus on a level: at the points of the grid.
    fn radius(&self, epsilon: f64) -> f64 {
        let points = self.im.iter().flat_map(|y| self.re.iter().map(move |x| x.hypot(*y)));
        points.zip(&self.values).filter(|(_, value)| **value <= epsilon).map(|(r, _)| r).fold(0.0, f64::max)
    }

    /// The contours on both sides of the real axis.
    fn series(&self) -> Vec<Series> {
        let im: Vec<f64> = self.im.iter().skip(1).rev().map(|y| -y).chain(self.im.iter().copied()).collect();
        let rows = self.values.chunks(self.re.len());
        let values: Vec<f64> = rows.clone().skip(1).rev().chain(rows).flatten().copied().collect();
        let contour = |(k, exponent): (usize, &f64)| {
            let name = format!("ε = 10^{{{}}}", short(*exponent));
            Series::contour(name, &self.re, &im, &values, 10f64.powf(*exponent)).colour(palette(k)).dash(Dash::Solid)
        };
        LEVELS.iter().enumerate().map(contour).collect()
    }
}

/// ω to six decimals: one that comes of a spectrum has sixteen.
fn shown_omega(omega: f64) -> String {
    short((omega * 1e6).round() / 1e6)
}

/// |Im λ|, and 0 where it is rounding.
fn imaginary(im: f64) -> f64 {
    const ROUNDING: f64 = 1e-7;
    if im.abs() < ROUNDING { 0.0 } else { im.abs() }
}

/// The columns of a method, after `keys` that say where it runs.
pub fn columns<'a, R: 'a>(keys: Columns<'a, R>, of: fn(&R) -> &Found) -> Columns<'a, R> {
    let norm = move |k: usize| move |r: &R| of(r).norms[k];
    let first = move |value: fn(&RitzValue) -> f64| move |r: &R| of(r).eigenvalues.first().map(value);
    keys.col(Column::key("method"), move |r| of(r).method)
        .col(Column::key("omega"), move |r| shown_omega(of(r).omega))
        .col(Column::key("order"), move |r| of(r).order.clone())
        .col(Column::number("rho", 1e-5, 6), move |r| of(r).radius())
        .col(Column::number("residual", 1e3, 2).floor(1e-6).detail(), first(|z| z.residual))
        .col(Column::number("real", 1e-3, 4).floor(1e-3).detail(), first(|z| z.value.re))
        .col(Column::number("imaginary", 1e-3, 4).floor(1e-3).detail(), first(|z| imaginary(z.value.im)))
        .col(Column::number("imaginary_max", 1e-2, 3).floor(1e-3).detail(), move |r| {
            of(r).eigenvalues.iter().map(|z| imaginary(z.value.im)).reduce(f64::max)
        })
        .col(Column::number("energy_norm", 1e-5, 5), norm(0))
        .col(Column::number("two_norm", 1e-5, 5), norm(1))
        .col(Column::number("maximum_norm", 1e-5, 5), norm(2))
        .col(Column::number("numerical_radius", 1e-5, 5), move |r| of(r).numerical_radius)
        .col(Column::number("hump", 2e-2, 3), move |r| of(r).hump().map(|hump| hump.height))
        .col(Column::count("hump_length").detail(), move |r| of(r).hump().map(|hump| hump.length))
        .col(Column::count("steps"), move |r| of(r).steps())
        .col(Column::count("steps_by_rho"), move |r| of(r).steps_by_radius())
}

/// One row a method.
pub fn table(subject: &Subject, all: &[Found]) -> Table {
    let columns = columns(Columns::<Found>::new(), |f| f);
    let title = format!("Iteration matrices on {}", subject.title);
    let mut table = columns.table(subject.stem("spectrum-iteration"), title, all);
    table.note(format!("{}. T = I − N⁻¹A takes the error of an iterate to that of the next.", subject.size));
    table.note(format!(
        "`real` and `imaginary` are those of the eigenvalue of largest modulus, ρ; `imaginary_max` is the largest |Im λ|. The energy norm is \
         ‖e‖² = eᵀMe, in which sweeps contract for 0 < ω < 2; `numerical_radius` is max |x*T x| of unit vectors. `hump` is max ‖T^k‖/ρ^k \
         over the powers up to {POWERS} in the energy norm (the 2-norm where M is not definite), first within a hundredth of it at \
         `hump_length`; `steps` the least k with ‖T^k‖ ≤ {REDUCTION:e}, `steps_by_rho` with ρ^k."
    ));
    if all.iter().any(|f| !f.complete) {
        table.note(
            "By an Arnoldi process: the outermost eigenvalues alone, each within its residual times its condition. All of \
             them, and norms, up to 600 vertices; up to 2000 if all are asked for (--full).",
        );
    }
    table
}

/// A row an eigenvalue.
pub fn eigenvalue_table(subject: &Subject, all: &[Found]) -> Table {
    let rows: Vec<(&Found, usize)> = all.iter().flat_map(|f| (0..f.eigenvalues.len()).map(move |k| (f, k))).collect();
    let columns = Columns::<(&Found, usize)>::new()
        .col(Column::key("method"), |(f, _)| f.method)
        .col(Column::key("omega"), |(f, _)| shown_omega(f.omega))
        .col(Column::key("order"), |(f, _)| f.order.clone())
        .col(Column::key("index"), |(_, k)| k.to_string())
        .col(Column::number("real", 1e-6, 10), |(f, k)| f.eigenvalues[*k].value.re)
        .col(Column::number("imaginary", 1e-6, 10), |(f, k)| f.eigenvalues[*k].value.im)
        .col(Column::number("modulus", 1e-6, 10), |(f, k)| f.eigenvalues[*k].value.norm())
        .col(Column::number("residual", 1e3, 2).floor(1e-6), |(f, k)| f.eigenvalues[*k].residual);
    let title = format!("Eigenvalues of iteration matrices on {}", subject.title);
    columns.table(subject.stem("spectrum-iteration-eigenvalues"), title, &rows)
}

/// The norms of powers, a row each; `None` where there are none.
pub fn power_table(subject: &Subject, all: &[Found]) -> Option<Table> {
    let rows: Vec<(&Found, usize)> = all.iter().flat_map(|f| (0..f.powers.len()).map(move |k| (f, k))).collect();
    let norm = |n: usize| move |(f, k): &(&Found, usize)| f.powers[*k][n];
    let columns = Columns::<(&Found, usize)>::new()
        .col(Column::key("method"), |(f, _)| f.method)
        .col(Column::key("omega"), |(f, _)| shown_omega(f.omega))
        .col(Column::key("order"), |(f, _)| f.order.clone())
        .col(Column::key("k"), |(_, k)| (k + 1).to_string())
        .col(Column::number("energy_norm", 1e-4, 5), norm(0))
        .col(Column::number("two_norm", 1e-4, 5), norm(1))
        .col(Column::number("maximum_norm", 1e-4, 5), norm(2))
        .col(Column::number("rho_to_k", 1e-4, 5), |(f, k)| f.radius().powi(*k as i32 + 1));
    let title = format!("Powers of iteration matrices on {}", subject.title);
    (!rows.is_empty()).then(|| columns.table(subject.stem("spectrum-iteration-powers"), title, &rows))
}

/// A circle about 0.
fn circle(name: impl Into<String>, radius: f64) -> Series {
    let points = (0..=180).map(|k| std::f64::consts::TAU * f64::from(k) / 180.0);
    Series::line(name, points.map(|t| (radius * t.cos(), radius * t.sin()))).colour(palette(6))
}

fn grid(panels: Vec<LinePlot>) -> Figure {
    let columns = panels.len().min(2);
    let rows = panels.len().div_ceil(columns.max(1)) as u32;
    Figure { width: 440 * columns as u32, height: 340 * rows, columns, share_x: false, ..Figure::row(panels) }
}

/// The eigenvalues in the complex plane, a panel a method, with the circle of radius ρ, all on one scale.
pub fn plane(caption: &str, all: &[&Found]) -> Figure {
    let largest = all.iter().map(|f| f.radius()).fold(0.0, f64::max);
    let reach = if largest > 0.0 { 1.12 * largest } else { 1.0 };
    let panel = |f: &&Found| {
        let unit = (reach >= 1.0).then(|| circle("unit circle", 1.0).dash(Dash::Dotted));
        let found = [
            circle(format!("ρ = {:.4}", f.radius()), f.radius()).dash(Dash::Dashed),
            Series::cloud("eigenvalues", f.eigenvalues.iter().map(|z| (z.value.re, z.value.im))).colour(f.colour),
        ];
        LinePlot {
            title: f.name(),
            x_label: "Re λ".into(),
            y_label: "Im λ".into(),
            x_range: Some((-reach, reach)),
            y_range: Some((-reach, reach)),
            equal_units: true,
            series: unit.into_iter().chain(found).collect(),
            ..LinePlot::default()
        }
    };
    Figure { title: caption.into(), ..grid(all.iter().map(panel).collect()) }
}

/// ‖T^k‖ over k, a panel a method; `None` where there are no powers.
pub fn powers(caption: &str, all: &[&Found]) -> Option<Figure> {
    let panel = |f: &&Found| {
        let series = |k: usize, norm: Norm| {
            let values = f.powers.iter().map(move |norms| norms[k].unwrap_or(f64::NAN));
            Series::line(format!("‖T^{{k}}‖, {}", norm.name()), (1..).map(f64::from).zip(values)).colour(palette(k))
        };
        let mut all: Vec<Series> = Norm::ALL.into_iter().enumerate().map(|(k, norm)| series(k, norm)).collect();
        all.retain(|s| s.points.iter().any(|p| p.1.is_finite()));
        let by_radius = (1..=f.powers.len() as i32).map(|k| (f64::from(k), f.radius().powi(k)));
        all.push(Series::line("ρ^{k}", by_radius).colour(palette(6)).dash(Dash::Dashed));
        LinePlot {
            title: f.name(),
            x_label: "k".into(),
            y_label: "norm of the power".into(),
            y_scale: Scale::Log,
            series: all,
            ..LinePlot::default()
        }
    };
    let panels: Vec<LinePlot> = all.iter().filter(|f| !f.powers.is_empty()).map(panel).collect();
    (!panels.is_empty()).then(|| Figure { title: caption.into(), ..grid(panels) })
}

/// The contours of pseudospectra, a panel a method, with the eigenvalues; `None` where there are none.
pub fn pseudospectra(caption: &str, all: &[&Found]) -> Option<Figure> {
    let panel = |f: &&Found| {
        let pseudospectrum = f.pseudospectrum.as_ref()?;
        let reach = pseudospectrum.re.last().copied()?;
        let mut series = pseudospectrum.series();
        series.push(circle("unit circle", 1.0).dash(Dash::Dotted));
        let eigenvalues = f.eigenvalues.iter().map(|z| (z.value.re, z.value.im));
        series.push(Series::cloud("eigenvalues", eigenvalues).colour(palette(6)));
        let reach = reach.max(1.08);
        let range = Some((-reach, reach));
        Some(LinePlot {
            title: f.name(),
            x_label: "Re z".into(),
            y_label: "Im z".into(),
            x_range: range,
            y_range: range,
            equal_units: true,
            series,
            ..LinePlot::default()
        })
    };
    let panels: Vec<LinePlot> = all.iter().filter_map(panel).collect();
    (!panels.is_empty()).then(|| Figure { title: caption.into(), ..grid(panels) })
}

/// The fields of the JSON object.
pub fn json(all: &[Found]) -> Value {
    let one = |f: &Found| {
        let pair = |z: &RitzValue| json!([z.value.re, z.value.im]);
        let radii = |p: &Pseudospectrum| {
            LEVELS.map(
                |exponent| json!({ "epsilon": 10f64.powf(exponent), "radius": number(p.radius(10f64.powf(exponent))) }),
            )
        };
        let norms = Norm::ALL.iter().zip(f.norms);
        let norms = norms.map(|(norm, size)| (norm.name().to_owned(), size.map_or(Value::Null, number)));
        json!({
            "method": f.method,
            "omega": number(f.omega),
            "order": f.order,
            "rho": number(f.radius()),
            "complete": f.complete,
            "eigenvalues": f.eigenvalues.iter().map(pair).collect::<Vec<_>>(),
            "residuals": f.eigenvalues.iter().map(|z| number(z.residual)).collect::<Vec<_>>(),
            "norms": Value::Object(norms.collect()),
            "numerical_radius": f.numerical_radius.map(number),
            "powers": f.powers.iter().map(|norms| norms.map(|norm| norm.map(number))).collect::<Vec<_>>(),
            "hump": f.hump().map(|hump| json!({ "height": number(hump.height), "length": hump.length })),
            "pseudospectral_radii": f.pseudospectrum.as_ref().map(radii),
        })
    };
    json!({ "iteration_matrices": all.iter().map(one).collect::<Vec<_>>() })
}

/// Of all methods, those whose ω is open with the best by the spectrum, each named on a bar while it is at work.
///
/// # Errors
/// Those of [`Found::new`].
pub fn all<S: System, K: Spectra>(
    system: &S,
    spectra: &dyn Fn() -> Result<K>,
    methods: &[Method],
    (order, name): (&[u32], &str),
    wish: Wish,
    progress: &Progress,
) -> Result<Vec<Found>> {
    let one = |method: &Method| {
        progress.message(format!("iteration matrix of {method}"));
        let method = with_spectrum(system, *method, spectra)?;
        let found = Found::new(system, method.in_order(Some(order)), name, wish);
        progress.step();
        found
    };
    methods.iter().map(one).collect()
}
