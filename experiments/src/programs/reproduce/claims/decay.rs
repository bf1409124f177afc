//! The decay of A⁻¹ from ring to ring, sharp on regular meshes: B3.

use std::f64::consts::TAU;

use glam::DVec3;

use limitlab::Result;
use limitlab::schemes::Scheme;
use limitlab::solvers::{Method, Stop, run};

use super::Claim;
use super::finding::{Evidence, Finding};
use super::lab::{Lab, exact, largest};

pub const CLAIMS: &[Claim] = &[Claim {
    id: "B3",
    title: "The decay of A⁻¹ by ring on regular meshes",
    place: "beyond Thall §2.2 and Zheng-Cai §3.1",
    printed: "Moving one point changes all control points, by how much is not said.",
    slow: false,
    check: decay,
}];

/// The symbol of A on a regular mesh as a(φ) + b(φ) cos ψ, φ along a row and ψ across rows; b ≥ 0 for |φ| ≤ π. On triangles ψ is
/// the phase of two edges from row to row that have φ between them.
fn symbol(scheme: Scheme, phi: f64) -> Option<[f64; 2]> {
    let c = phi.cos();
    Some(match scheme {
        Scheme::CatmullClark => [2.0 * (2.0 + c) / 9.0, (2.0 + c) / 9.0],
        Scheme::Loop | Scheme::Sqrt3 => [0.5 + c / 6.0, (phi / 2.0).cos() / 3.0],
        Scheme::Nasri => [3.0 * (3.0 + c) / 16.0, (3.0 + c) / 16.0],
        Scheme::ZhengCai => [0.5 + (1.0 + c) / 8.0, (1.0 + c) / 8.0],
        // 0 at φ = ψ = π: no inverse on tori with even sides, no exponential decay on an infinite mesh.
        Scheme::MidEdge => return None,
    })
}

/// The largest |A⁻¹| in ring r about a vertex of an infinite mesh: the mean over φ of ζ^r/√(a² − b²), where −ζ is the zero of
/// a + b(z + 1/z)/2 within the unit circle. On triangles for even r.
fn in_ring(scheme: Scheme, r: i32) -> Option<f64> {
    // The mean of an analytic periodic function over equidistant points.
    const POINTS: usize = 4000;
    let value = |k: usize| {
        let [a, b] = symbol(scheme, TAU * ((k as f64 + 0.5) / POINTS as f64 - 0.5))?;
        let root = (a * a - b * b).sqrt();
        Some((b / (a + root)).powi(r) / root)
    };
    let sum: Option<f64> = (0..POINTS).map(value).sum();
    sum.map(|sum| sum / POINTS as f64)
}

/// The largest entries of a column of A⁻¹ in the rings about its vertex on a regular torus of `size` × `size` vertices.
fn on_torus(scheme: Scheme, size: usize) -> Result<Vec<f64>> {
    let name = if scheme.needs_triangles() { "tri-torus" } else { "torus" };
    let subject = exact(&format!("{name}:{size}x{size}"))?;
    let system = subject.system(scheme)?;
    let mut points = vec![DVec3::ZERO; system.len()];
    points[0] = DVec3::X;
    let column = run(&system, &points, Method::Cholesky, &Stop { tolerance: 1e-15, max_iterations: 3 }).points;
    let mut ring = vec![usize::MAX; system.len()];
    ring[0] = 0;
    let mut found = vec![column[0].x.abs()];
    let mut front = vec![0];
    while !front.is_empty() {
        let mut next = Vec::new();
        for &i in &front {
            for (j, _) in system.m.row(i) {
                if ring[j] == usize::MAX {
                    ring[j] = found.len();
                    next.push(j);
                }
            }
        }
        if !next.is_empty() {
            found.push(largest(next.iter().map(|&j| column[j].x.abs())));
        }
        front = next;
    }
    Ok(found)
}

fn decay(_: &Lab) -> Result<Finding> {
    /// Far out, where ratios are steady.
    const FAR: i32 = 300;
    const SIZE: usize = 40;
    let mut evidence = Vec::new();
    for scheme in Scheme::ALL {
        // Its decay and the power of r beside it, and λ_min.
        let (rate, power, least): (f64, f64, f64) = match scheme {
            Scheme::CatmullClark => (2.0 - 3.0f64.sqrt(), 0.0, 1.0 / 9.0),
            Scheme::Loop | Scheme::Sqrt3 => (2.0 - 3.0f64.sqrt(), 0.25, 0.25),
            Scheme::Nasri => (3.0 - 8.0f64.sqrt(), 0.0, 0.25),
            Scheme::ZhengCai => (3.0 - 8.0f64.sqrt(), 0.5, 0.5),
            Scheme::MidEdge => continue,
        };
        let value = |r: i32| in_ring(scheme, r).unwrap_or(f64::NAN);
        let factor = (f64::from(FAR + 2) / f64::from(FAR)).powf(power);
        let found = (value(FAR + 2) / value(FAR) * factor).sqrt();
        let torus = on_torus(scheme, SIZE)?;
        // Below a half of the size, where both ways round the torus meet, and above rounding.
        let pairs = (0..14).step_by(2).map(|r| (torus[r], value(r as i32)));
        let name = scheme.name();
        evidence.extend([
            Evidence::at_most(
                format!("{name}: deviation of the decay a ring, far out, from that of the nearest zero of the symbol"),
                (found / rate - 1.0).abs(),
                1e-4,
            ),
            Evidence::shown(format!("{name}: decay a ring"), rate),
            Evidence::at_most(
                format!("{name}: largest relative deviation of rings 0, 2 … 12 of a torus of {SIZE} × {SIZE} from the integral"),
                largest(pairs.map(|(found, value)| (found / value - 1.0).abs())),
                1e-6,
            ),
            Evidence::shown(
                format!("{name}: decay a ring that Demko, Moss and Smith's bound has there"),
                (1.0 - least.sqrt()) / (1.0 + least.sqrt()),
            ),
        ]);
    }
    Ok(Finding::settled(evidence).remark(
        "Rings are those of the rows of A. Decay rates are 2 − √3 and 3 − 2√2; beside it is a factor \
         r^-¼ under Loop and √3, r^-½ under Zheng-Cai. Under mid-edge the symbol vanishes at (π, π), and there is no such decay.",
    ))
}
