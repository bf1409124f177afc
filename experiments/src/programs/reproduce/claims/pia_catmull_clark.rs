//! PIA with Catmull-Clark surfaces: the matrix, when it is singular, other than quad meshes (P6–P9).

use std::collections::HashMap;

use limitlab::Result;
use limitlab::analysis::singularity::Singularity;
use limitlab::schemes::Scheme;
use limitlab::solvers::{Method, Outcome};

use super::finding::{Evidence, Finding};
use super::lab::{Lab, each, ends, exact, largest, random_points, smallest, solve_random};

const ROUNDING: f64 = 1e-12;

/// Below this an eigenvalue of A counts as zero.
const ZERO: f64 = 1e-12;

pub fn catmull_clark_matrix(_: &Lab) -> Result<Finding> {
    let (mut weights, mut asymmetry, mut norm) = (0.0f64, 0.0f64, 0.0f64);
    for name in ["irregular-quad:500", "quad-sphere:3", "torus:7x9"] {
        let subject = exact(name)?;
        let system = subject.system(Scheme::CatmullClark)?;
        let n = system.len();
        // Edge by edge and face by face, as the paper counts them.
        let mut wanted = vec![HashMap::<usize, f64>::new(); n];
        for (v, row) in wanted.iter_mut().enumerate() {
            let valence = subject.surface.incidence().face_count(v) as f64;
            row.insert(v, valence * valence);
        }
        for face in subject.surface.faces().iter() {
            for k in 0..4 {
                let [v, next, opposite] = [0, 1, 2].map(|s| face[(k + s) % 4] as usize);
                // Each edge has two faces, and each brings half of the 4 to either end.
                *wanted[v].entry(next).or_default() += 2.0;
                *wanted[next].entry(v).or_default() += 2.0;
                *wanted[v].entry(opposite).or_default() += 1.0;
            }
        }
        for (i, row) in wanted.iter().enumerate() {
            for (j, m) in system.m.row(i) {
                weights = largest([weights, (m - row.get(&j).copied().unwrap_or(0.0)).abs()]);
                asymmetry = largest([asymmetry, (m - system.m.get(j, i)).abs()]);
            }
            let sum: f64 = system.a.row_values(i).iter().map(|a| a.abs()).sum();
            norm = largest([norm, (sum - 1.0).abs()]);
        }
    }
    Ok(Finding::reproduced(vec![
        Evidence::at_most("largest deviation of an entry of M, three quad meshes", weights, ROUNDING),
        Evidence::equal("largest |m_ij − m_ji|", asymmetry, 0.0),
        Evidence::at_most("largest deviation of ‖C‖_∞ from 1", norm, ROUNDING),
    ]))
}

pub fn when_singular(lab: &Lab) -> Result<Finding> {
    let special = [
        "cube",
        "cubes:2",
        "prism:3",
        "prism:4",
        "prism:5",
        "prism:6",
        "prism:8",
        "prism:9",
        "tetrahedron",
        "octahedron",
        "icosahedron",
        "dodecahedron",
        "truncated-octahedron",
        "torus:3x3",
        "torus:4x4",
        "torus:5x4",
        "quad-sphere:1",
        "irregular-quad:60",
    ];
    let judge = |subject: &crate::programs::reproduce::context::Subject| -> Result<(usize, usize, f64)> {
        let all = limitlab::analysis::dense::eigenvalues(&subject.system(Scheme::CatmullClark)?)?.a;
        let kernel = all.iter().filter(|l| l.abs() < ZERO).count();
        Ok((kernel, Singularity::detect(&subject.surface, Scheme::CatmullClark).kernel_dimension(), all[0]))
    };
    let mut rows = each(lab.polygons(), judge)?;
    for name in special {
        rows.push(judge(&exact(name)?)?);
    }
    let cube = exact("cube")?;
    let run = solve_random(&cube.system(Scheme::CatmullClark)?, Method::Pia, 1e-6, 10_000);
    Ok(Finding::settled(vec![
        Evidence::equal(
            "meshes whose kernel is not of the dimension that theory says",
            rows.iter().filter(|r| r.0 != r.1).count(),
            0.0,
        ),
        Evidence::above("singular meshes among them", rows.iter().filter(|r| r.0 > 0).count(), 0.0),
        Evidence::at_least("smallest eigenvalue of C", smallest(rows.iter().map(|r| r.2)), -ZERO),
        Evidence::above(
            "maximum error of PIA on the cube after 10 000 steps or stagnation, random points",
            run.report.last().max,
            1e-6,
        ),
        Evidence::shown("meshes", rows.len()),
    ])
    .remark(
        "M is positive semidefinite on every closed polygon mesh of valences from 3, and singular exactly when a \
         component has all valences 3 and a bipartite vertex graph. The iteration converges for all data exactly when \
         there is none such; on the cube it leaves the part of the data in the kernel.",
    ))
}

pub fn quadratic_form(_: &Lab) -> Result<Finding> {
    let (mut printed, mut right) = (0.0f64, 0.0f64);
    for (name, seed) in [("cube", 1), ("torus:5x7", 2), ("quad-sphere:2", 3), ("irregular-quad:200", 4)] {
        let subject = exact(name)?;
        let system = subject.system(Scheme::CatmullClark)?;
        let x: Vec<f64> = random_points(system.len(), seed).iter().map(|p| p.x).collect();
        let form: f64 = (0..system.len()).map(|i| x[i] * system.m.row_times(i, &x)).sum();
        let (mut sums, mut squares, mut own) = (0.0, 0.0, 0.0);
        for face in subject.surface.faces().iter() {
            let sum: f64 = face.iter().map(|&v| x[v as usize]).sum();
            sums += sum;
            squares += sum * sum;
            for k in 0..4 {
                // Half of each edge from either face.
                let edge = x[face[k] as usize] + x[face[(k + 1) % 4] as usize];
                sums += 0.5 * edge;
                squares += edge * edge;
            }
        }
        for (v, x) in x.iter().enumerate() {
            let n = subject.surface.incidence().face_count(v) as f64;
            own += (n * n - 3.0 * n) * x * x;
        }
        printed = largest([printed, ((sums + own) / form - 1.0).abs()]);
        right = largest([right, ((squares + own) / form - 1.0).abs()]);
    }
    Ok(Finding::corrected(
        "largest relative deviation from xᵀMx, random x on four quad meshes",
        printed,
        right,
        ROUNDING,
    )
    .remark("The terms of faces and edges are squares, and edges weigh 2."))
}

pub fn arbitrary_meshes(lab: &Lab) -> Result<Finding> {
    let rows = each(lab.polygons(), |subject| {
        let system = subject.system(Scheme::CatmullClark)?;
        let ends = ends(&system)?;
        let fast = ends.min > 1e-3;
        let outcome = fast.then(|| solve_random(&system, Method::Pia, 1e-6, 60_000).report.outcome);
        // The form of P8 for faces of any size, on a random vector.
        let x: Vec<f64> = random_points(system.len(), 5).iter().map(|p| p.x).collect();
        let form: f64 = (0..system.len()).map(|i| x[i] * system.m.row_times(i, &x)).sum();
        let mut squares = 0.0;
        for face in subject.surface.faces().iter() {
            let sum: f64 = face.iter().map(|&v| x[v as usize]).sum();
            squares += 4.0 / face.len() as f64 * sum * sum;
            for (k, &v) in face.iter().enumerate() {
                let edge = x[v as usize] + x[face[(k + 1) % face.len()] as usize];
                squares += edge * edge;
            }
        }
        for (v, x) in x.iter().enumerate() {
            let n = subject.surface.incidence().face_count(v) as f64;
            squares += (n * n - 3.0 * n) * x * x;
        }
        let bound = ends.min - system.bounds.lambda_min;
        Ok((ends.min, bound, (squares / form - 1.0).abs(), outcome))
    })?;
    let ran = rows.iter().filter_map(|r| r.3);
    Ok(Finding::settled(vec![
        Evidence::at_least(
            "smallest eigenvalue of C, random polygon meshes",
            smallest(rows.iter().map(|r| r.0)),
            -ROUNDING,
        ),
        Evidence::at_most(
            "largest relative deviation of Σ 4/|F| (Σx)² + 2Σ(x_i+x_j)² + Σ(n²−3n)x² from xᵀMx",
            largest(rows.iter().map(|r| r.2)),
            1e-10,
        ),
        Evidence::at_least(
            "smallest λ_min less its bound min (n−3)/(n+5)",
            smallest(rows.iter().map(|r| r.1)),
            -ROUNDING,
        ),
        Evidence::equal(
            "runs from random points that did not converge to 10⁻⁶, of those with λ_min > 10⁻³",
            ran.clone().filter(|&o| o != Outcome::Converged).count(),
            0.0,
        ),
        Evidence::shown("runs", ran.count()),
    ])
    .remark("The same sum of squares with weight 4/|F| covers faces of any size: convergence as in P7."))
}
