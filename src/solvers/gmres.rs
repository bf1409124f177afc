//! GMRES (Saad & Schultz 1986) without restarts, for small systems that are known by their products alone.

use glam::DVec3;

/// What became of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Gmres {
    /// The last iterate.
    pub solution: Vec<DVec3>,
    /// Products made.
    pub products: usize,
    /// ‖b − A x‖₂ over that of the start, as the recurrence has it.
    pub reduction: f64,
}

fn dot(a: &[DVec3], b: &[DVec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum()
}

/// Solves A x = b from x = 0 until ‖b − A x‖₂ ≤ `reduction`·‖b‖₂, with `limit` products at most; the three coordinates
/// are one vector. Each product costs O(k) inner products, k being the number of the step, and all directions are kept.
///
/// ```
/// use glam::DVec3;
/// use limitlab::solvers::gmres::gmres;
/// // A rotation by a right angle and a scale: no symmetric method would do.
/// let product = |x: &[DVec3]| Ok::<_, ()>(vec![2.0 * x[1], -x[0]]);
/// let found = gmres(product, &[DVec3::X, DVec3::Y], 1e-14, 10).unwrap();
/// assert!(found.solution[0].distance(-DVec3::Y) < 1e-14 && found.solution[1].distance(0.5 * DVec3::X) < 1e-14);
/// ```
///
/// # Errors
/// Those of `product`.
pub fn gmres<E>(
    mut product: impl FnMut(&[DVec3]) -> Result<Vec<DVec3>, E>,
    b: &[DVec3],
    reduction: f64,
    limit: usize,
) -> Result<Gmres, E> {
    let start = dot(b, b).sqrt();
    let mut basis: Vec<Vec<DVec3>> = Vec::new();
    // Columns of R, the rotations that made them, and the right-hand side that they leave.
    let (mut columns, mut turns): (Vec<Vec<f64>>, Vec<(f64, f64)>) = (Vec::new(), Vec::new());
    let mut rest = vec![start];
    if start > 0.0 && start.is_finite() {
        basis.push(b.iter().map(|&x| x / start).collect());
    }
    let reached = |rest: &[f64]| rest.last().is_none_or(|r| r.abs() <= reduction * start);
    while columns.len() < limit && !reached(&rest) {
        let Some(direction) = basis.get(columns.len()) else { break };
        let mut next = product(direction)?;
        let mut column = Vec::with_capacity(columns.len() + 2);
        // Twice is enough.
        for round in 0..2 {
            for (k, q) in basis.iter().enumerate() {
                let part = dot(q, &next);
                next.iter_mut().zip(q).for_each(|(x, &q)| *x -= part * q);
                if round == 0 { column.push(part) } else { column[k] += part }
            }
        }
        let length = dot(&next, &next).sqrt();
        column.push(length);
        for (k, &(c, s)) in turns.iter().enumerate() {
            let (a, b) = (column[k], column[k + 1]);
            (column[k], column[k + 1]) = (c * a + s * b, c * b - s * a);
        }
        let k = columns.len();
        let size = column[k].hypot(column[k + 1]);
        if size == 0.0 || !size.is_finite() {
            break;
        }
        let (c, s) = (column[k] / size, column[k + 1] / size);
        turns.push((c, s));
        column[k] = size;
        column.truncate(k + 1);
        columns.push(column);
        let last = rest[k];
        rest[k] = c * last;
        rest.push(-s * last);
        if length > 0.0 {
            basis.push(next.into_iter().map(|x| x / length).collect());
        }
    }
    let mut weights = rest[..columns.len()].to_vec();
    for k in (0..weights.len()).rev() {
        weights[k] /= columns[k][k];
        for i in 0..k {
            weights[i] -= columns[k][i] * weights[k];
        }
    }
    let mut solution = vec![DVec3::ZERO; b.len()];
    for (q, &weight) in basis.iter().zip(&weights) {
        solution.iter_mut().zip(q).for_each(|(x, &q)| *x += weight * q);
    }
    let last = rest.last().map_or(0.0, |r| r.abs());
    Ok(Gmres { solution, products: columns.len(), reduction: if start > 0.0 { last / start } else { 0.0 } })
}
