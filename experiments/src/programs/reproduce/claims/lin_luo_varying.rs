//! The unified √3 scheme with an α of its own at every vertex: extraordinary vertices and surfaces (L17).

use glam::{DVec2, DVec3};
use limitlab_factorizations::dense::small_lu;
use nalgebra::{DMatrix, DVector};

use limitlab::Result;
use limitlab::analysis::splitting::{Layout, LocalScheme, SplittingMatrix};
use limitlab::interpolate::lin_luo::surface::refine_n;
use limitlab::mesh::{Mesh, Surface};
use limitlab::schemes::unified_sqrt3;

use super::Claim;
use super::finding::{Evidence, Finding};
use super::lab::{Lab, exact, largest, random_points, smallest};

pub const CLAIMS: &[Claim] = &[Claim {
    id: "L17",
    title: "Different α at extraordinary vertices and on surfaces",
    place: "§6 and §7",
    printed: "Convergence and smoothness are analysed for one α; those of the non-uniform scheme are left to the future.",
    slow: false,
    check: varying,
}];

/// Rings that two steps map to themselves.
const RINGS: usize = 3;

/// Rounds of two steps that rings are followed through.
const ROUNDS: usize = 40;

/// Steps to the six neighbours in a regular mesh, counter-clockwise.
const AROUND: [[i64; 2]; 6] = [[1, 0], [1, 1], [0, 1], [-1, 0], [-1, -1], [0, -1]];

fn moved([x, y]: [i64; 2], direction: usize) -> [i64; 2] {
    let [a, b] = AROUND[direction % 6];
    [x + a, y + b]
}

/// The second difference across an edge, from a vertex in one of six directions: both opposite vertices less both ends.
trait Differences {
    fn across(&self, vertex: [i64; 2], direction: usize) -> f64;

    /// Δ = a₆ (mean of the neighbours − vertex), 1/18 of the sum over the edges at the vertex.
    fn displacement(&self, vertex: [i64; 2]) -> f64 {
        (0..6).map(|k| self.across(vertex, k)).sum::<f64>() / 18.0
    }

    /// The same by the weights 2, 3/2, ½, 0, ½, 3/2 from one edge on: h_1 + h_2 = h_4 + h_5 of the edges at a vertex, as both are
    /// the second difference along a line.
    fn displacement_towards(&self, vertex: [i64; 2], first: usize) -> f64 {
        let weights = [2.0, 1.5, 0.5, 0.0, 0.5, 1.5];
        let parts = weights.iter().enumerate().map(|(k, w)| *w * self.across(vertex, first + k));
        parts.sum::<f64>() / 18.0
    }

    /// The second difference after a step with one α, of the edge from `vertex` of the finer mesh. Its vertex (x + y, 2y − x) is
    /// vertex (x, y) of the coarser one, the others are centroids. Affine in α.
    fn refined(&self, vertex: [i64; 2], direction: usize, alpha: f64) -> f64 {
        // The vertex of the coarser mesh, if there.
        let old = |[u, v]: [i64; 2]| ((2 * u - v) % 3 == 0).then(|| [(2 * u - v) / 3, (u + v) / 3]);
        for (end, along) in [(vertex, direction), (moved(vertex, direction), direction + 3)] {
            if let Some(p) = old(end) {
                // From p to the centroid between its edges `along` and `along` + 1.
                let inner = self.across(p, along) + self.across(p, along + 1);
                let outer = self.across(p, along + 5) + self.across(p, along + 2);
                let share = 1.0 - 2.0 * alpha / 3.0;
                let beside = self.displacement(moved(p, along + 5)) + self.displacement(moved(p, along + 2));
                return ((6.0 - 2.0 * share) * inner - share * outer) / 18.0 - alpha / 3.0 * beside;
            }
        }
        // Between two centroids, across an edge of the coarser mesh.
        let [b, c] = [1, 5].map(|turn| old(moved(vertex, direction + turn)).unwrap_or_default());
        let along = (0..6).find(|&k| moved(b, k) == c).unwrap_or_default();
        let ends = self.displacement_towards(b, along) + self.displacement_towards(c, along + 3);
        let beside = self.displacement(moved(b, along + 1)) + self.displacement(moved(b, along + 5));
        (1.0 - alpha / 3.0) * ends + alpha / 3.0 * beside - self.across(b, along) / 3.0
    }
}

/// Second differences that vanish but within a distance of the origin.
struct Patch {
    reach: i64,
    /// Of the edges in directions 0, 1, 2.
    values: Vec<f64>,
}

impl Patch {
    fn place(&self, [x, y]: [i64; 2], direction: usize) -> Option<usize> {
        let side = 2 * self.reach + 1;
        let within = x.abs() <= self.reach && y.abs() <= self.reach;
        within.then(|| (((x + self.reach) * side + y + self.reach) * 3) as usize + direction)
    }

    fn edges(reach: i64) -> impl Iterator<Item = ([i64; 2], usize)> {
        (-reach..=reach).flat_map(move |x| (-reach..=reach).flat_map(move |y| (0..3).map(move |k| ([x, y], k))))
    }
}

impl Differences for Patch {
    fn across(&self, vertex: [i64; 2], direction: usize) -> f64 {
        let direction = direction % 6;
        let place = if direction < 3 {
            self.place(vertex, direction)
        } else {
            self.place(moved(vertex, direction), direction - 3)
        };
        place.map_or(0.0, |place| self.values[place])
    }
}

/// Patches without what is zero about all of them.
fn cropped(patches: Vec<Patch>) -> Vec<Patch> {
    let edges = |patch: &Patch| Patch::edges(patch.reach).zip(patch.values.clone()).collect::<Vec<_>>();
    let away = |[x, y]: [i64; 2]| x.abs().max(y.abs()).max((x - y).abs());
    let used = patches.iter().flat_map(edges).filter(|(_, value)| *value != 0.0);
    let reach = used.map(|((vertex, _), _)| away(vertex)).max().unwrap_or(0);
    let within = |patch: &Patch| {
        let kept = Patch::edges(reach).map(|(vertex, k)| patch.across(vertex, k));
        Patch { reach, values: kept.collect() }
    };
    patches.iter().map(within).collect()
}

/// A bound of 3^(L/2)·‖D(α)^L‖_∞ for all α in [a, b], L even: with D(α) = (1 − t)D(a) + tD(b) the power is a mean, by binomial weights, of
/// the mean products of j factors D(b) and L − j factors D(a), and these are the L + 1 numbers.
fn norms(ends: [f64; 2], steps: usize) -> Vec<f64> {
    let side = 3i64.pow(steps as u32 / 2);
    // L steps map vertex (x, y) to 3^(L/2) times a turned one: rows are told apart by their remainders.
    let row = |[x, y]: [i64; 2], k: usize| ((x.rem_euclid(side) * side + y.rem_euclid(side)) * 3) as usize + k;
    let mut sums = vec![vec![0.0f64; (3 * side * side) as usize]; steps + 1];
    // One edge of each direction.
    for direction in 0..3 {
        let mut start = Patch { reach: 0, values: vec![0.0; 3] };
        start.values[direction] = 1.0;
        // By the number of factors D(b): sums over the products.
        let mut now = vec![start];
        for step in 0..steps {
            // A step takes a vertex at most twice as many edges away, and sees three edges around.
            let reach = 2 * now[0].reach + 7;
            let next = (0..=step + 1).map(|count| {
                let values = Patch::edges(reach).map(|(vertex, k)| {
                    // Turned by a sixth, the rows of one direction are those of the next.
                    if step + 1 == steps && k > 0 {
                        return 0.0;
                    }
                    let by = |from: Option<&Patch>, alpha: f64| from.map_or(0.0, |p| p.refined(vertex, k, alpha));
                    by(now.get(count), ends[0]) + by(count.checked_sub(1).and_then(|c| now.get(c)), ends[1])
                });
                Patch { reach, values: values.collect() }
            });
            now = cropped(next.collect());
        }
        for (sums, patch) in sums.iter_mut().zip(&now) {
            for ((vertex, k), value) in Patch::edges(patch.reach).zip(&patch.values) {
                sums[row(vertex, k)] += value.abs();
            }
        }
    }
    let scale = 3f64.powi(steps as i32 / 2);
    let mut products = 1.0;
    let norm = |(count, sums): (usize, &Vec<f64>)| {
        if count > 0 {
            products *= (steps + 1 - count) as f64 / count as f64;
        }
        scale * largest(sums.iter().copied()) / products
    };
    sums.iter().enumerate().map(norm).collect()
}

/// Second differences of points on a torus of [`Torus::SIZE`] × SIZE vertices.
struct Torus<'a>(&'a [f64]);

impl Torus<'_> {
    const SIZE: i64 = 9;

    fn number([x, y]: [i64; 2]) -> usize {
        (x.rem_euclid(Self::SIZE) * Self::SIZE + y.rem_euclid(Self::SIZE)) as usize
    }
}

impl Differences for Torus<'_> {
    fn across(&self, vertex: [i64; 2], direction: usize) -> f64 {
        let at = |direction: usize| self.0[Self::number(moved(vertex, direction))];
        at(direction + 1) + at(direction + 5) - self.0[Self::number(vertex)] - at(direction)
    }
}

/// How far the rule of second differences is from those of the mesh that the scheme makes.
fn off_scheme(alpha: f64) -> Result<f64> {
    let size = Torus::SIZE;
    let torus = exact(&format!("tri-torus:{size}x{size}"))?.surface;
    let points = random_points(torus.len(), 1);
    let torus = torus.with_positions(points.clone());
    let (fine, _) = unified_sqrt3::refine(&torus, &vec![alpha; torus.len()])?;
    // Cells have the triangles (i, j), (i + 1, j), (i + 1, j + 1) and (i, j), (i + 1, j + 1), (i, j + 1), in this order.
    let at = |[u, v]: [i64; 2]| {
        let (x, y) = (2 * u - v, u + v);
        let cell = Torus::number([x.div_euclid(3), y.div_euclid(3)]);
        match x.rem_euclid(3) {
            0 => fine.positions[cell],
            2 => fine.positions[torus.len() + 2 * cell],
            _ => fine.positions[torus.len() + 2 * cell + 1],
        }
    };
    let values: Vec<f64> = points.iter().map(|p| p.x).collect();
    let coarse = Torus(&values);
    let off = Patch::edges(6).map(|(vertex, k)| {
        let ends = at(vertex) + at(moved(vertex, k));
        let found = at(moved(vertex, k + 1)) + at(moved(vertex, k + 5)) - ends;
        (found.x - coarse.refined(vertex, k, alpha)).abs()
    });
    Ok(largest(off))
}

/// Three rings about a vertex of valence n, points and α at random, followed through rounds of two steps: for each round the distance of the
/// rings from the nearest image of the uniform scheme's characteristic net in space, in parts of their size, and the largest
/// difference between an α of the rings and the vertex's.
fn rings(n: usize, alpha: f64, rounds: usize, seed: u64) -> Result<Vec<[f64; 2]>> {
    let layout = Layout::Triangles;
    let scheme = LocalScheme::Sqrt3 { alpha };
    let count = layout.len(n, RINGS);
    let net = SplittingMatrix::on_rings(scheme, n, RINGS)?.characteristic_net()?;
    let mut points = random_points(count + 1, seed);
    let mut alphas: Vec<f64> = random_points(count + 1, seed + 1).iter().map(|p| 0.5 + 0.5 * p.x).collect();
    alphas[0] = alpha;
    let closed = layout.closed(n, RINGS);
    let mut found = Vec::new();
    for _ in 0..rounds {
        let surface = Surface::new(Mesh::new(points.clone(), closed.clone()))?;
        let (fine, after) = refine_n(&surface, &alphas, 2)?;
        // Turned by a sector against the last round, which the images are as well.
        let star = layout.walk(&fine, 0, n, RINGS)?;
        let middle = fine.positions()[star[0] as usize];
        // Enlarged, so that nothing underflows.
        for (k, &v) in star.iter().enumerate() {
            points[k] = 3.0 * (fine.positions()[v as usize] - middle);
            alphas[k] = after[v as usize];
        }
        let differences = alphas[..count].iter().map(|a| (a - alpha).abs());
        found.push([off_image(&points[..count], &net), largest(differences)]);
    }
    Ok(found)
}

/// The factor of a round by which rings approach images of the characteristic net: that of the mode behind the leading pair, or
/// of the α, (2/3)².
fn rate(n: usize, alpha: f64) -> Result<f64> {
    let modes = SplittingMatrix::on_rings(LocalScheme::Sqrt3 { alpha }, n, RINGS)?.modes()?;
    let of = |pair: bool| modes.iter().filter(move |m| (m.frequency == 1) == pair).map(|m| m.value.norm());
    let leading = largest(of(true));
    // Of frequency 1 the pair, of frequency 0 the eigenvalue 1 are left out.
    let others = of(true).chain(of(false)).filter(|&x| x < 1.0 - 1e-9 && x != leading);
    Ok(largest(others.chain([4.0 / 9.0 * leading])) / leading)
}

/// The distance of points from the nearest image of the net under c + p₁x + p₂y, in parts of their size.
fn off_image(points: &[DVec3], net: &[DVec2]) -> f64 {
    let columns = DMatrix::from_fn(net.len(), 3, |i, j| [1.0, net[i].x, net[i].y][j]);
    let gram = small_lu(columns.transpose() * &columns);
    let mut off = vec![DVec3::ZERO; points.len()];
    for axis in 0..3 {
        let own = DVector::from_fn(points.len(), |i, _| points[i][axis]);
        let Some(solution) = gram.solve(&(columns.transpose() * &own)) else {
            return f64::NAN;
        };
        let image = &columns * solution;
        off.iter_mut().zip(own.iter().zip(image.iter())).for_each(|(off, (own, image))| off[axis] = own - image);
    }
    largest(off.iter().map(|d| d.length())) / largest(points.iter().map(|p| p.length()))
}

fn varying(lab: &Lab) -> Result<Finding> {
    // How differences of α between neighbours shrink anywhere.
    let mut ratio = 0.0f64;
    for subject in &lab.triangles()[..20] {
        let across = |surface: &Surface, alphas: &[f64]| {
            let faces = surface.faces().iter();
            largest(faces.flat_map(|f| (0..3).map(|k| (alphas[f[k] as usize] - alphas[f[(k + 1) % 3] as usize]).abs())))
        };
        let alphas: Vec<f64> = random_points(subject.surface.len(), 7).iter().map(|p| 1.0 + p.x).collect();
        let (fine, after) = refine_n(&subject.surface, &alphas, 1)?;
        ratio = largest([ratio, across(&fine, &after) / across(&subject.surface, &alphas)]);
    }
    let (mut first, mut last, mut slower, mut shrinking) = (0.0f64, 0.0f64, 0.0f64, 0.0f64);
    for n in [4, 5, 7, 8, 12] {
        for (seed, alpha) in [(1, 0.0), (2, 0.5), (3, 1.0), (4, 1.4)] {
            let found = rings(n, alpha, ROUNDS, seed)?;
            first = largest([first, found[4][0]]);
            if alpha <= 1.0 {
                last = largest([last, found[ROUNDS - 1][0]]);
            }
            // Above what rounding leaves.
            if found[ROUNDS - 1][0] > 1e-10 {
                let factor = (found[ROUNDS - 1][0] / found[9][0]).powf(1.0 / (ROUNDS - 10) as f64);
                slower = largest([slower, factor / rate(n, alpha)?]);
            }
            shrinking = largest([shrinking, (found[19][1] / found[9][1]).powf(0.05)]);
        }
    }
    let at_three = |alpha: f64| -> Result<Vec<f64>> {
        let found =
            (0..20).map(|seed| Ok(largest(rings(3, alpha, ROUNDS, 2 * seed)?[ROUNDS - 8..].iter().map(|r| r[0]))));
        found.collect()
    };
    let off = largest([off_scheme(0.0)?, off_scheme(0.6)?, off_scheme(1.0)?, off_scheme(1.7)?]);
    let contraction = norms([0.0, 1.0], 6);
    Ok(Finding::settled(vec![
        Evidence::at_most(
            "largest difference of α along an edge after a step over that before, 20 random triangle meshes",
            ratio,
            2.0 / 3.0 + 1e-12,
        ),
        Evidence::at_most(
            "factor a step of the largest difference between an α of three rings and the vertex's, largest over steps 20 to 40",
            shrinking,
            2.0 / 3.0 + 1e-3,
        ),
        Evidence::shown("distance of three rings from an image of the uniform scheme's map over their size, after 10 steps", first),
        Evidence::at_most("the same after 80 steps, valences 4, 5, 7, 8, 12, α_v = 0, ½, 1", last, 0.01),
        Evidence::shown("largest factor of that distance a round over that of the theorem, α_v = 1.4 as well", slower),
        Evidence::at_most("largest distance of second differences after a step from their rule, α = 0, 0.6, 1, 1.7", off, 1e-12),
        Evidence::below("3³‖D(α)⁶‖ of second differences in the regular part, all α in [0, 1]", largest(contraction.iter().copied()), 1.0),
        Evidence::shown("the same at α = 0", smallest(contraction.iter().copied())),
        Evidence::at_least(
            "least distance of three rings from such an image, at its largest over the last 16 of 80 steps, valence 3, α_v = 1, 20 stars",
            smallest(at_three(1.0)?),
            0.1,
        ),
        Evidence::at_most("the largest such distance, α_v = ½", largest(at_three(0.5)?), 1e-4),
    ])
    .remark(
        "The α at an extraordinary vertex decides: rings about it tend to affine images of the characteristic map of the uniform scheme with \
         this α, whatever the others are. α of the rings are in [0, 1] at first.",
    ))
}
