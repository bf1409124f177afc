//! The unified curve scheme (§3): the four-point scheme where α = 0, the cubic B-spline where α = 1.

use glam::DVec3;

/// Whether the last point is followed by the first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ends {
    /// A closed polygon: indices are taken modulo the number of points.
    Closed,
    /// A point more is put beyond each end, mirrored at it: P_{−1} = 2P_0 − P_1. So the ends stay whatever their α is,
    /// and lines are reproduced. The paper has no rule for ends.
    Open,
}

/// One step: the refined points and their parameters. Point i becomes point 2i,
/// α/8 P_{i−1} + (1 − α/4) P_i + α/8 P_{i+1}; point 2i+1 is new, between i and i+1, with
/// weights (α−1, 9−α, 9−α, α−1)/16 and the mean α of its two neighbours. Any α is allowed. Of n points an open polygon
/// makes 2n − 1; of one point nothing can be made but that point.
///
/// # Panics
/// If there is not one α a point.
///
/// ```
/// use glam::DVec3;
/// use limitlab::interpolate::lin_luo::curve::{Ends, refine};
/// let square = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]].map(DVec3::from_array);
/// // The four-point scheme keeps the corners; (−1, 9, 9, −1)/16 puts the new point of a side outside it.
/// let (points, _) = refine(&square, &[0.0; 4], Ends::Closed);
/// assert_eq!((points[0], points[1]), (square[0], DVec3::new(0.5, -0.125, 0.0)));
/// let (points, _) = refine(&square, &[1.0; 4], Ends::Open);
/// assert_eq!((points.len(), points[0], points[6]), (7, square[0], square[3]));
/// ```
pub fn refine(points: &[DVec3], alpha: &[f64], ends: Ends) -> (Vec<DVec3>, Vec<f64>) {
    assert_eq!(points.len(), alpha.len(), "one α a point");
    let n = points.len();
    if ends == Ends::Open && n < 2 {
        return (points.to_vec(), alpha.to_vec());
    }
    // Place k counts from the point before the first.
    let at = |k: usize| match (ends, k) {
        (Ends::Closed, _) => points[(k + n - 1) % n],
        (Ends::Open, 0) => 2.0 * points[0] - points[1],
        (Ends::Open, _) if k > n => 2.0 * points[n - 1] - points[n - 2],
        (Ends::Open, _) => points[k - 1],
    };
    let mut refined = Vec::with_capacity(2 * n);
    let mut parameters = Vec::with_capacity(2 * n);
    for i in 0..n {
        let [before, here, next] = [at(i), at(i + 1), at(i + 2)];
        let a = alpha[i];
        // As a displacement, so that a point that stays does so exactly.
        refined.push(here + a / 8.0 * (before - 2.0 * here + next));
        parameters.push(a);
        if ends == Ends::Open && i + 1 == n {
            break;
        }
        let a = 0.5 * (alpha[i] + alpha[(i + 1) % n]);
        let (outer, inner) = (before + at(i + 3), here + next);
        refined.push((a - 1.0) / 16.0 * outer + (9.0 - a) / 16.0 * inner);
        parameters.push(a);
    }
    (refined, parameters)
}

/// `levels` steps; none gives a copy.
///
/// # Panics
/// As [`refine`].
pub fn refine_n(points: &[DVec3], alpha: &[f64], ends: Ends, levels: usize) -> (Vec<DVec3>, Vec<f64>) {
    let start = (points.to_vec(), alpha.to_vec());
    (0..levels).fold(start, |(points, alpha), _| refine(&points, &alpha, ends))
}

/// The forward divided differences Δ^order P / spacing^order of a closed polygon with equal parameter steps (not
/// divided by the factorial: they approach derivatives).
pub fn divided_differences(points: &[DVec3], order: usize, spacing: f64) -> Vec<DVec3> {
    let n = points.len();
    (0..order).fold(points.to_vec(), |p, _| (0..n).map(|i| (p[(i + 1) % n] - p[i]) / spacing).collect())
}

/// The largest jump between neighbouring divided differences of `order` at each of the levels 0 to `levels`, with
/// spacing 2^−level. The limit curve is C^order only if the jumps tend to 0; that they do so geometrically is
/// sufficient.
///
/// # Panics
/// As [`refine`].
pub fn jumps(points: &[DVec3], alpha: &[f64], levels: usize, order: usize) -> Vec<f64> {
    let mut level = (points.to_vec(), alpha.to_vec());
    let mut spacing = 1.0;
    let mut jumps = Vec::with_capacity(levels + 1);
    for k in 0..=levels {
        if k > 0 {
            level = refine(&level.0, &level.1, Ends::Closed);
            spacing *= 0.5;
        }
        let differences = divided_differences(&level.0, order, spacing);
        let next = differences.iter().cycle().skip(1);
        let pairs = differences.iter().zip(next);
        jumps.push(pairs.map(|(a, b)| a.distance(*b)).fold(0.0, f64::max));
    }
    jumps
}

/// The constant α for which the limit curve is C¹ for all data; at both ends and outside it is not. The paper says
/// "α constant gives C¹" without a range.
///
/// At the image of a control point the rule of the jumps of divided differences, with the mask
/// ((α−1)/8, ¼, (3−α)/4, ¼, (α−1)/8), has the eigenvalues of [`fixed_point_radius`]; they reach −1 at α = 6 and 1 at
/// α = −2, and then some jumps never shrink. Inside, [`jump_norm`] falls below 1 after finitely many steps, which
/// proves C¹: tested with up to 15 steps on a grid from −1.7 to 5.8; nearer to the ends more steps are needed.
pub const C1_RANGE: (f64, f64) = (-2.0, 6.0);

/// The spectral radius at a control point of the scheme that maps the jumps of divided differences from level to
/// level, for constant α: the largest modulus of the roots of λ² − (1 − α/4) λ + (2−α)/8, and the odd one, ¼. C¹
/// needs it below 1.
pub fn fixed_point_radius(alpha: f64) -> f64 {
    let (trace, determinant) = (1.0 - alpha / 4.0, (2.0 - alpha) / 8.0);
    let discriminant = trace * trace / 4.0 - determinant;
    let even = if discriminant >= 0.0 { (trace / 2.0).abs() + discriminant.sqrt() } else { determinant.sqrt() };
    even.max(0.25)
}

/// The norm ‖S^steps‖_∞ of the jump scheme for constant α: by how much `steps` levels can at most enlarge the
/// largest jump of divided differences. Below 1 for some number of steps is sufficient for C¹ (Dyn, Gregory & Levin
/// 1991). Time and memory 2^steps.
///
/// # Panics
/// If `steps` > 24.
pub fn jump_norm(alpha: f64, steps: u32) -> f64 {
    assert!(steps <= 24, "the mask of {steps} steps is too long");
    let outer = (alpha - 1.0) / 8.0;
    let mask = [outer, 0.25, (3.0 - alpha) / 4.0, 0.25, outer];
    // The mask of k+1 steps: b_{k+1}(z) = b(z) b_k(z²).
    let mut iterated = vec![1.0];
    for _ in 0..steps {
        let mut longer = vec![0.0; 2 * (iterated.len() - 1) + mask.len()];
        for (i, &x) in iterated.iter().enumerate() {
            for (place, &w) in longer[2 * i..].iter_mut().zip(&mask) {
                *place += w * x;
            }
        }
        iterated = longer;
    }
    let stride = 1 << steps;
    (0..stride).map(|r| iterated.iter().skip(r).step_by(stride).map(|w| w.abs()).sum()).fold(0.0, f64::max)
}
