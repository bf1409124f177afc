//! Why fronts have the least spectral radius and the worst counts, and what an order of Gauss-Seidel can cost: Z31.

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use limitlab_factorizations::dense::{small_cholesky, small_complex_eigenvalues, small_symmetric_eigenvalues};
use nalgebra::{Complex, DMatrix};

use limitlab::Result;
use limitlab::analysis::spectral_radius::sweep_radius;
use limitlab::analysis::symmetric::{SymmetricForm, symmetric};
use limitlab::assemble::LimitSystem;
use limitlab::mesh::order::Order;
use limitlab::schemes::Scheme;
use limitlab::solvers::system::sweep;

use super::Claim;
use super::finding::{Evidence, Finding};
use super::lab::{Lab, each, ends, exact, largest, smallest};
use crate::programs::reproduce::context::Subject;

pub const CLAIMS: &[Claim] = &[Claim {
    id: "Z31",
    title: "What an order of Gauss-Seidel can cost, and why fronts are slow",
    place: "§5",
    printed: "The order of the vertices affects the speed; which one to choose is worth investigating.",
    slow: false,
    check: orders,
}];

/// Gauss-Seidel on I + L + Lᵀ, which is D^-½MD^-½ in the order of the sweep, as seen in the energy norm.
struct Sweep {
    /// CᵀTC^-ᵀ with T = −(I + L)⁻¹Lᵀ the error matrix, C the Cholesky factor: its 2-norm is ‖T‖_A.
    matrix: DMatrix<f64>,
    /// sup ‖Lᵀx‖²/xᵀ(I + L + Lᵀ)x
    upper: f64,
}

impl Sweep {
    /// `None` where the matrix is not positive definite.
    fn new(system: &LimitSystem, order: &[u32]) -> Option<Sweep> {
        let whole = symmetric(system, SymmetricForm::Jacobi);
        let n = order.len();
        let whole = DMatrix::from_fn(n, n, |i, j| whole.get(order[i] as usize, order[j] as usize));
        let mut lower = whole.lower_triangle();
        let factor = small_cholesky(whole)?.l();
        let swept = lower.solve_lower_triangular(&factor)?;
        let matrix = DMatrix::identity(n, n) - factor.transpose() * swept;
        lower -= DMatrix::identity(n, n);
        let upper = norm(&factor.solve_lower_triangular(&lower)?).powi(2);
        Some(Sweep { matrix, upper })
    }

    /// ‖T^k‖_A^(1/k) for k = 1, 2, 4, …, 2^`doublings`.
    fn powers(&self, doublings: u32) -> Vec<f64> {
        let mut power = self.matrix.clone();
        let mut found = vec![norm(&power)];
        for k in 1..=doublings {
            power = &power * &power;
            found.push(norm(&power).powf(0.5f64.powi(k as i32)));
        }
        found
    }
}

/// ‖B‖₂
fn norm(matrix: &DMatrix<f64>) -> f64 {
    largest(small_symmetric_eigenvalues(matrix.transpose() * matrix).iter().copied()).max(0.0).sqrt()
}

fn radius(system: &LimitSystem, order: &[u32]) -> Result<f64> {
    let zero = vec![DVec3::ZERO; order.len()];
    sweep_radius(system, |x| sweep(system, &zero, 1.0, order.iter().map(|&i| i as usize), x))
}

fn order_of(subject: &Subject, order: Order) -> Vec<u32> {
    order.order(subject.surface.mesh(), subject.surface.incidence())
}

/// The row of A on an infinite regular mesh: steps along both directions, and the entry there.
struct Row(Vec<([i64; 2], f64)>);

impl Row {
    /// Read off a torus of `size` × `size` vertices.
    fn new(system: &LimitSystem, size: usize) -> Row {
        let signed = |k: usize| if 2 * k > size { k as i64 - size as i64 } else { k as i64 };
        Row(system.a.row(0).map(|(j, a)| ([signed(j / size), signed(j % size)], a)).collect())
    }

    /// The symbol −Lᴴ/(D + L) of a sweep row by row, each in one direction. It is the factor of a wave on the infinite mesh.
    fn front(&self, wave: [f64; 2]) -> Complex<f64> {
        let (mut own, mut before) = (0.0, Complex::new(0.0, 0.0));
        for &(step, a) in &self.0 {
            match step.cmp(&[0, 0]) {
                std::cmp::Ordering::Less => {
                    before += Complex::from_polar(a, wave[0] * step[0] as f64 + wave[1] * step[1] as f64)
                }
                std::cmp::Ordering::Equal => own = a,
                std::cmp::Ordering::Greater => {}
            }
        }
        -before.conj() / (own + before)
    }

    /// The largest |symbol| over 180 × 180 waves, π among them.
    fn front_most(&self) -> f64 {
        let angle = |k: usize| TAU * k as f64 / 180.0;
        largest((0..180).flat_map(|i| (0..180).map(move |j| [angle(i), angle(j)])).map(|wave| self.front(wave).norm()))
    }

    /// The spectral radius of a sweep colour by colour at one wave, which couples as many as there are colours.
    fn coloured(&self, colours: usize, colour: fn([i64; 2]) -> usize, wave: [f64; 2]) -> f64 {
        let mut block = DMatrix::from_element(colours, colours, Complex::new(0.0, 0.0));
        for site in (0..3).flat_map(|i| (0..3).map(move |j| [i, j])) {
            let own = colour(site);
            if block[(own, own)].re > 0.0 {
                continue;
            }
            for &(step, a) in &self.0 {
                let other = colour([site[0] + step[0], site[1] + step[1]]);
                block[(own, other)] += Complex::from_polar(a, wave[0] * step[0] as f64 + wave[1] * step[1] as f64);
            }
        }
        let error = block.lower_triangle().solve_lower_triangular(&(block.lower_triangle() - &block));
        let values = error.and_then(|t| small_complex_eigenvalues(t, f64::EPSILON, 1000));
        values.map_or(f64::NAN, |values| largest(values.iter().map(|z| z.norm())))
    }
}

/// Four colours of quads, in the order (even, even), (even, odd), …; three of triangles.
fn of_quads([i, j]: [i64; 2]) -> usize {
    (2 * i.rem_euclid(2) + j.rem_euclid(2)) as usize
}

fn of_triangles([i, j]: [i64; 2]) -> usize {
    (i + j).rem_euclid(3) as usize
}

/// What orders do to one small system: each number is to be at most 0, but for the last two.
struct Bounds {
    /// |‖T‖_A² − (1 − 1/(1 + c))|
    identity: f64,
    /// Lower bound less ‖T‖_A; ‖T‖_A less the upper bound.
    below: f64,
    above: f64,
    /// 1/(1 − ‖T‖_A²), the largest over the smallest, and the bound of that.
    ratio: f64,
    most: f64,
}

fn bounds(subject: &Subject, scheme: Scheme) -> Result<Option<Bounds>> {
    let system = subject.system(scheme)?;
    let ends = ends(&system)?;
    let (least, most) = (ends.jacobi_min, ends.jacobi_max);
    if least < 1e-6 {
        return Ok(None);
    }
    let row = largest(system.diagonal.iter().map(|a| 1.0 / a - 1.0));
    let lower = ((1.0 - least) / (1.0 + least)).max((most - 1.0) / (most + 1.0));
    let upper = 1.0 - least / (least + row * row);
    let mut found = Bounds {
        identity: 0.0,
        below: f64::NEG_INFINITY,
        above: f64::NEG_INFINITY,
        ratio: 1.0,
        most: 4.0 * (least + row * row) / (1.0 + least).powi(2),
    };
    let mut reductions = Vec::new();
    for order in [Order::File, Order::Bfs, Order::Multicolour, Order::Random(1), Order::Random(2), Order::Random(3)] {
        let Some(sweep) = Sweep::new(&system, &order_of(subject, order)) else {
            return Ok(None);
        };
        let size = norm(&sweep.matrix);
        found.identity = largest([found.identity, (size * size - (1.0 - 1.0 / (1.0 + sweep.upper))).abs()]);
        found.below = largest([found.below, lower - size]);
        found.above = largest([found.above, size - upper.sqrt()]);
        reductions.push(1.0 + sweep.upper);
    }
    found.ratio = largest(reductions.iter().copied()) / smallest(reductions.iter().copied());
    Ok(Some(found))
}

fn orders(lab: &Lab) -> Result<Finding> {
    const SMALL: usize = 40;
    let mut rows = Vec::new();
    for scheme in Scheme::ALL {
        let random = if scheme.needs_triangles() { lab.triangles() } else { lab.polygons() };
        let some = random.get(..40).unwrap_or(random);
        let small = |subject: &Subject| subject.surface.len() <= SMALL;
        let found = each(some, |subject| if small(subject) { bounds(subject, scheme) } else { Ok(None) })?;
        rows.extend(found.into_iter().flatten());
    }
    let mut evidence = vec![
        Evidence::at_most(
            "largest deviation of ‖T‖_A² from 1 − 1/(1 + sup ‖L^T x‖²/x^T A x), small random meshes, six orders each",
            largest(rows.iter().map(|r| r.identity)),
            1e-7,
        ),
        Evidence::at_most("largest excess of the lower bound over ‖T‖_A", largest(rows.iter().map(|r| r.below)), 1e-9),
        Evidence::at_most("largest excess of ‖T‖_A over the upper bound", largest(rows.iter().map(|r| r.above)), 1e-9),
        Evidence::at_most(
            "largest ratio of 1/(1 − ‖T‖_A²) between orders, over 4(μ + r²)/(1 + μ)²",
            largest(rows.iter().map(|r| r.ratio / r.most)),
            1.0,
        ),
        Evidence::shown(
            "largest ratio of 1/(1 − ‖T‖_A²) between two of six orders",
            largest(rows.iter().map(|r| r.ratio)),
        ),
        Evidence::shown("pairs of mesh and scheme", rows.len()),
    ];
    for scheme in [Scheme::CatmullClark, Scheme::Nasri, Scheme::ZhengCai, Scheme::Loop] {
        let name = scheme.name();
        let triangles = scheme.needs_triangles();
        let (torus, size, colours) = if triangles { ("tri-torus:9x9", 9, 3) } else { ("torus:8x8", 8, 4) };
        let colour = if triangles { of_triangles } else { of_quads };
        let subject = exact(torus)?;
        let system = subject.system(scheme)?;
        let row = Row::new(&system, size);
        let place = |v: u32| [(v as usize / size) as i64, (v as usize % size) as i64];
        let mut order: Vec<u32> = (0..(size * size) as u32).collect();
        order.sort_by_key(|&v| colour(place(v)));
        let whole = radius(&system, &order)?;
        let angle = |k: usize| TAU * k as f64 / size as f64;
        let waves = (0..size).flat_map(|i| (0..size).map(move |j| [angle(i), angle(j)]));
        let blocks = largest(waves.map(|wave| row.coloured(colours, colour, wave)));
        evidence.push(Evidence::at_most(
            format!("{name}: deviation of the radius colour by colour from that of blocks of {colours}, {torus}"),
            (whole - blocks).abs(),
            1e-7,
        ));
        evidence.push(Evidence::shown(format!("{name}: radius colour by colour"), blocks));
        let front = row.front_most();
        evidence.push(Evidence::shown(format!("{name}: factor of a front on an infinite mesh"), front));
        evidence.push(Evidence::above(
            format!("{name}: that of a front less the radius colour by colour"),
            front - blocks,
            0.0,
        ));
        let ends = ends(&system)?;
        let lower =
            ((1.0 - ends.jacobi_min) / (1.0 + ends.jacobi_min)).max((ends.jacobi_max - 1.0) / (ends.jacobi_max + 1.0));
        if matches!(scheme, Scheme::CatmullClark | Scheme::Nasri) {
            evidence.push(Evidence::at_most(
                format!(
                    "{name}: deviation of the factor of a front from (1 − μ)/(1 + μ), the least ‖T‖_A of all orders"
                ),
                (front - lower).abs(),
                1e-9,
            ));
        }
        if scheme == Scheme::CatmullClark {
            // How far the slowest wave moves in a sweep, backward across rows: what its phase gains from wave to wave.
            let step = 1e-5;
            let turn = row.front([PI + step, PI]) / row.front([PI - step, PI]);
            evidence.push(Evidence::at_most(
                "deviation of the rows that a front's slowest wave crosses in a sweep, Catmull-Clark, from 2/15",
                (turn.arg().abs() / (2.0 * step) - 2.0 / 15.0).abs(),
                1e-6,
            ));
        }
    }
    let subject = exact("torus:12x12")?;
    let system = subject.system(Scheme::CatmullClark)?;
    for (order, name) in [(Order::Bfs, "breadth first"), (Order::Multicolour, "colour by colour")] {
        let order = order_of(&subject, order);
        let Some(sweep) = Sweep::new(&system, &order) else {
            continue;
        };
        evidence.push(Evidence::shown(format!("torus:12x12, Catmull-Clark, {name}: ρ"), radius(&system, &order)?));
        for (k, value) in sweep.powers(4).into_iter().enumerate().filter(|(k, _)| matches!(k, 0 | 2 | 4)) {
            let power = 1 << k;
            evidence
                .push(Evidence::shown(format!("torus:12x12, Catmull-Clark, {name}: ‖T^{power}‖_A^(1/{power})"), value));
        }
    }
    Ok(Finding::settled(evidence).remark(
        "T is the error matrix of Gauss-Seidel, μ and Λ are the ends of the spectrum of D⁻¹A, r = max (1/a_ii − 1). For every order \
         max((1 − μ)/(1 + μ), (Λ − 1)/(Λ + 1)) ≤ ‖T‖_A ≤ (1 − μ/(μ + r²))^½, whatever N: orders differ by a bounded factor. A front on an \
         infinite mesh multiplies every wave by its own number in each sweep, and keeps its first, best factor; colours begin \
         worse and end better.",
    ))
}
