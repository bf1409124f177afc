//! How small λ_min gets under Catmull-Clark where regions of valence 3 grow: B1, B2.

use std::collections::VecDeque;
use std::f64::consts::{PI, TAU};

use chacha20::ChaCha8Rng;
use limitlab_factorizations::dense::small_symmetric_eigenvalues;
use nalgebra::DMatrix;
use rand::{RngExt, SeedableRng};

use limitlab::Result;
use limitlab::analysis::dense;
use limitlab::assemble::LimitSystem;
use limitlab::mesh::{Faces, Mesh, Surface, builtin};
use limitlab::schemes::Scheme;

use super::Claim;
use super::finding::{Evidence, Finding};
use super::lab::{Lab, each, ends, largest, random_points, smallest, subject};

const ROUNDING: f64 = 1e-12;

pub const CLAIMS: &[Claim] = &[
    Claim {
        id: "B1",
        title: "The least λ_min of polygon meshes of N vertices",
        place: "beyond PIA §3 and Thall §2.2",
        printed: "Convergence is proven or hoped for; how slow it may be is not said.",
        slow: false,
        check: polygons,
    },
    Claim {
        id: "B2",
        title: "The least λ_min of quad meshes, however many vertices of valence 3",
        place: "beyond PIA §3 and Thall §2.2",
        printed: "Convergence on quad meshes is proven or hoped for; how slow it may be is not said.",
        slow: false,
        check: quads,
    },
];

type Lists = Vec<Vec<u32>>;

fn system(count: usize, faces: &Lists) -> Result<LimitSystem> {
    let surface = Surface::new(Mesh::new(random_points(count, 1), Faces::from_lists(faces)))?;
    LimitSystem::new(&surface, Scheme::CatmullClark)
}

/// Rungs u_i l_i, i < `rungs`, joined by quads. At its last rung K₄ less an edge (two triangles), at the first a cube less an edge,
/// and one face about all: 2·rungs + 12 vertices, all of valence 3.
fn capped_ladder(rungs: u32) -> (usize, Lists) {
    let (u, l) = (|i: u32| 2 * i, |i: u32| 2 * i + 1);
    let last = rungs - 1;
    let [a, b, c, d] = [0, 1, 2, 3].map(|k| 2 * rungs + k);
    let v: [u32; 8] = std::array::from_fn(|k| 2 * rungs + 4 + k as u32);
    let mut faces: Lists = (0..last).map(|i| vec![u(i), u(i + 1), l(i + 1), l(i)]).collect();
    faces.extend([vec![l(last), u(last), a, d, b], vec![d, a, c], vec![c, b, d]]);
    faces.push(vec![u(0), l(0), v[1], v[5], v[4], v[0]]);
    faces.extend([[3, 2, 6, 7], [2, 0, 4, 6], [1, 3, 7, 5], [4, 5, 7, 6]].map(|face| face.map(|k| v[k]).to_vec()));
    let mut around: Vec<u32> = (0..rungs).map(l).collect();
    around.extend([b, c, a]);
    around.extend((0..rungs).rev().map(u));
    around.extend([0, 2, 3, 1].map(|k| v[k]));
    faces.push(around);
    (2 * rungs as usize + 12, faces)
}

/// A ring of 2k vertices of valence 3, every other one joined to one pole, the rest to the other: 2k quads.
fn trapezohedron(k: u32) -> (usize, Lists) {
    let around = 2 * k;
    let at = |i: u32| i % around;
    let quad = |i: u32| match i % 2 {
        0 => vec![around, at(i), at(i + 1), at(i + 2)],
        _ => vec![around + 1, at(i + 2), at(i + 1), at(i)],
    };
    (around as usize + 2, (0..around).map(quad).collect())
}

/// λ_min of that ring, alternating, with its poles: the smaller root of (3 − 24λ)(k − (k + 5)λ) = 9.
fn trapezohedron_formula(k: f64) -> f64 {
    let (a, b, c) = (24.0 * (k + 5.0), 24.0 * k + 3.0 * (k + 5.0), 3.0 * k - 9.0);
    (b - (b * b - 4.0 * a * c).sqrt()) / (2.0 * a)
}

fn valences(count: usize, faces: &Lists) -> Vec<usize> {
    let mut valences = vec![0; count];
    faces.iter().flatten().for_each(|&v| valences[v as usize] += 1);
    valences
}

/// λ_min from the formula for M alone; valences of 2 occur on the way of a search.
fn least(count: usize, faces: &Lists) -> f64 {
    let valence = valences(count, faces);
    let mut m = DMatrix::zeros(count, count);
    for (v, &n) in valence.iter().enumerate() {
        m[(v, v)] = (n * n - n) as f64;
    }
    for face in faces {
        for (k, &i) in face.iter().enumerate() {
            let next = face[(k + 1) % face.len()];
            // Each edge has two faces.
            m[(i as usize, next as usize)] += 1.0;
            m[(next as usize, i as usize)] += 1.0;
            face.iter().for_each(|&j| m[(i as usize, j as usize)] += 4.0 / face.len() as f64);
        }
    }
    let scale = |v: usize| 1.0 / ((valence[v] * (valence[v] + 5)) as f64).sqrt();
    let scaled = DMatrix::from_fn(count, count, |i, j| scale(i) * m[(i, j)] * scale(j));
    smallest(small_symmetric_eigenvalues(scaled).iter().copied())
}

/// Takes out a random edge; the two faces become one, the last of the list. `None` where that has a vertex twice.
fn without_edge(faces: &Lists, rng: &mut ChaCha8Rng) -> Option<Lists> {
    let first = rng.random_range(0..faces.len());
    let k = rng.random_range(0..faces[first].len());
    // From its end all round the face.
    let from = |face: &[u32], k: usize| [&face[k..], &face[..k]].concat();
    let mut joined = from(&faces[first], (k + 1) % faces[first].len());
    let (b, a) = (joined[0], *joined.last()?);
    let side = |face: &Vec<u32>| (0..face.len()).find(|&m| face[m] == b && face[(m + 1) % face.len()] == a);
    let (second, m) = faces.iter().enumerate().find_map(|(f, face)| Some((f, side(face)?)))?;
    let other = from(&faces[second], (m + 1) % faces[second].len());
    joined.extend(&other[1..other.len() - 1]);
    let twice = (1..joined.len()).any(|i| joined[..i].contains(&joined[i]));
    if first == second || twice {
        return None;
    }
    let rest = faces.iter().enumerate().filter(|&(f, _)| f != first && f != second);
    Some(rest.map(|(_, face)| face.clone()).chain([joined]).collect())
}

/// Divides a face by a random diagonal.
fn with_edge(mut faces: Lists, face: usize, rng: &mut ChaCha8Rng) -> Option<Lists> {
    let corners = std::mem::take(&mut faces[face]);
    let size = corners.len();
    let [i, j] = [0; 2].map(|_| rng.random_range(0..size));
    let (i, j) = (i.min(j), i.max(j));
    if j - i < 2 || j - i > size - 2 {
        return None;
    }
    faces[face] = corners[i..=j].to_vec();
    faces.push([&corners[j..], &corners[..=i]].concat());
    Some(faces)
}

/// Simulated annealing of ln λ_min over the meshes that turned, removed and added edges make of one, faces all quads if they are
/// to be so: the least λ_min seen, singular meshes and those with valences below 3 not counted.
fn search(count: usize, start: &Lists, quads: bool, steps: usize, seed: u64) -> f64 {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (mut now, mut best) = (start.clone(), f64::INFINITY);
    // Quads are passed through with valence 2 as well, at a price.
    let value = |faces: &Lists| {
        let few = valences(count, faces).into_iter().filter(|&n| n < 3).count();
        match few {
            0 => Some(least(count, faces)).filter(|&x| x > 1e-9).or(Some(0.3)),
            few if quads && few < 6 => Some(0.2 * 1.6f64.powi(few as i32)),
            _ => None,
        }
    };
    let mut current = value(&now).unwrap_or(f64::INFINITY);
    for step in 0..steps {
        let kind: f64 = rng.random();
        let mut moved = || {
            if kind < 0.8 || quads {
                let without = without_edge(&now, &mut rng)?;
                let joined = without.len() - 1;
                return if kind < 0.6 || quads { with_edge(without, joined, &mut rng) } else { Some(without) };
            }
            let face = rng.random_range(0..now.len());
            with_edge(now.clone(), face, &mut rng)
        };
        let candidate = moved();
        let chance: f64 = rng.random();
        let Some(faces) = candidate.filter(|f| !quads || f.iter().all(|face| face.len() == 4)) else {
            continue;
        };
        let Some(found) = value(&faces).filter(|_| !valences(count, &faces).contains(&1)) else {
            continue;
        };
        let heat = if quads { 0.05 + 0.6 } else { 0.3 } * (1.0 - step as f64 / steps as f64);
        if (found / current).ln() <= -heat * chance.ln() {
            (now, current) = (faces, found);
            // What stands for a fault is larger.
            best = best.min(found);
        }
    }
    best
}

/// The least of four searches.
fn searches(count: usize, start: &Lists, quads: bool) -> f64 {
    smallest((1..=4).map(|seed| search(count, start, quads, 5000, seed)))
}

/// For the theorem on polygon meshes: with d the greatest distance from a vertex of valence 3 to one of a larger valence, ℓ the
/// greatest length of the shortest odd closed walk through a vertex of a component without these, the least of
/// 1/(9 + 6N₃(2d + 1)) and 1/(6Nℓ); `None` where there is no such walk.
fn bound(surface: &Surface) -> Option<f64> {
    let count = surface.len();
    let valence = |v: usize| surface.incidence().face_count(v);
    let mut neighbors = vec![Vec::new(); count];
    for face in surface.faces().iter() {
        for (k, &v) in face.iter().enumerate() {
            let next = face[(k + 1) % face.len()];
            neighbors[v as usize].push(next as usize);
            neighbors[next as usize].push(v as usize);
        }
    }
    // Vertex v in two layers, 2v and 2v + 1, between which each edge leads.
    let distances = |from: &[usize]| {
        let mut distance = vec![usize::MAX; 2 * count];
        let mut ahead: VecDeque<usize> = from.iter().copied().collect();
        from.iter().for_each(|&x| distance[x] = 0);
        while let Some(x) = ahead.pop_front() {
            for &w in &neighbors[x / 2] {
                let y = 2 * w + 1 - x % 2;
                if distance[y] == usize::MAX {
                    distance[y] = distance[x] + 1;
                    ahead.push_back(y);
                }
            }
        }
        distance
    };
    let high: Vec<usize> = (0..2 * count).filter(|x| valence(x / 2) > 3).collect();
    let to_high = distances(&high);
    let (mut farthest, mut longest) = (0, 0);
    for v in (0..count).filter(|&v| valence(v) == 3) {
        match to_high[2 * v] {
            usize::MAX => longest = longest.max(Some(distances(&[2 * v])[2 * v + 1]).filter(|&l| l < usize::MAX)?),
            d => farthest = farthest.max(d),
        }
    }
    let of_three = (0..count).filter(|&v| valence(v) == 3).count();
    let mixed = 1.0 / (9 + 6 * of_three * (2 * farthest + 1)) as f64;
    Some(if longest > 0 { mixed.min(1.0 / (6 * count * longest) as f64) } else { mixed })
}

fn polygons(lab: &Lab) -> Result<Finding> {
    // All eigenvalues of prisms: a frequency along the rings, and equal or opposite in both.
    let mut spectrum = 0.0f64;
    let mut minimum = 0.0f64;
    for k in (3..=31).step_by(2) {
        let prism = subject("prism", builtin::prism(k));
        let found = dense::eigenvalues(&prism.system(Scheme::CatmullClark)?)?.a;
        let of = |f: usize, sign: f64| {
            let cosine = (TAU * f as f64 / k as f64).cos();
            let of_ring = if f == 0 { 4.0 } else { 0.0 };
            (8.0 + of_ring + 6.0 * cosine + sign * (4.0 + 2.0 * cosine)) / 24.0
        };
        let mut all: Vec<f64> = (0..k).flat_map(|f| [of(f, 1.0), of(f, -1.0)]).collect();
        all.sort_by(f64::total_cmp);
        spectrum = largest(found.iter().zip(&all).map(|(a, b)| (a - b).abs()).chain([spectrum]));
        let closed = (PI / (2 * k) as f64).sin().powi(2) / 3.0;
        minimum = largest([minimum, (found[0] - closed).abs()]);
    }
    let scaled = |rungs: u32| -> Result<f64> {
        let (count, faces) = capped_ladder(rungs);
        Ok(ends(&system(count, &faces)?)?.min * (count * count) as f64)
    };
    let of_ladders = [4, 20, 100].map(scaled);
    let [short, middle, long] = of_ladders;
    let (short, middle, long) = (short?, middle?, long?);
    let rows = each(&lab.polygons()[..100], |subject| {
        Ok(match bound(&subject.surface) {
            Some(bound) => ends(&subject.system(Scheme::CatmullClark)?)?.min / bound,
            None => f64::INFINITY,
        })
    })?;
    let mut over = Vec::new();
    for rungs in [1, 2] {
        let (count, ladder) = capped_ladder(rungs);
        let prism: Lists = builtin::prism(count / 2).faces.iter().map(<[u32]>::to_vec).collect();
        over.push(searches(count, &prism, false) / least(count, &ladder));
    }
    let (count, ladder) = capped_ladder(30);
    let ladder = subject("ladder", Mesh::new(random_points(count, 1), Faces::from_lists(&ladder)));
    let of_ladder = ends(&ladder.system(Scheme::CatmullClark)?)?.min / bound(&ladder.surface).unwrap_or(f64::NAN);
    Ok(Finding::settled(vec![
        Evidence::at_most("largest deviation of the eigenvalues of odd prisms, k = 3…31, from the closed form", spectrum, ROUNDING),
        Evidence::at_most("largest deviation of their λ_min from sin²(π/2k)/3", minimum, ROUNDING),
        Evidence::shown("N² λ_min of the capped ladder of 20 vertices", short),
        Evidence::shown("N² λ_min of the capped ladder of 52 vertices", middle),
        Evidence::at_most(
            "N² λ_min of the capped ladder of 212 vertices over π²/12",
            long / (PI * PI / 12.0),
            1.03,
        ),
        Evidence::at_least("the same, from below", long / (PI * PI / 12.0), 1.0),
        Evidence::at_least(
            "smallest λ_min over the bound by distances, 100 random polygon meshes",
            smallest(rows.iter().copied()),
            1.0,
        ),
        Evidence::shown("of these singular, and left out", rows.iter().filter(|x| x.is_infinite()).count()),
        Evidence::at_least("λ_min over the bound by distances, capped ladder of 72 vertices", of_ladder, 1.0),
        Evidence::at_least(
            "least λ_min found by a search over meshes of 14 vertices, over that of the capped ladder",
            over[0],
            1.0 - 1e-9,
        ),
        Evidence::at_least("the same, 16 vertices", over[1], 1.0 - 1e-9),
    ])
    .remark(
        "The search anneals ln λ_min over meshes of sphere type with valences from 3, from a prism, by turning, removing and \
         adding edges. The capped ladder is a row of quads with K₄ less an edge at one end and a cube less an edge at the other: the \
         colouring ±1 fits at one end and not at the other.",
    ))
}

fn quads(lab: &Lab) -> Result<Finding> {
    let mut closed = 0.0f64;
    for k in 3..=20 {
        let (count, faces) = trapezohedron(k);
        closed = largest([closed, (ends(&system(count, &faces)?)?.min - trapezohedron_formula(f64::from(k))).abs()]);
    }
    let least_known = (41.0 - 1393.0f64.sqrt()) / 144.0;
    let mut found = Vec::new();
    for k in [4, 5, 6, 7] {
        let (count, faces) = trapezohedron(k);
        found.push(searches(count, &faces, true));
    }
    let all_quads = lab.polygons().iter().filter(|s| s.surface.faces().uniform_size() == Some(4));
    let mut random = Vec::new();
    for subject in all_quads {
        random.push(ends(&subject.system(Scheme::CatmullClark)?)?.min);
    }
    let many = trapezohedron(200);
    Ok(Finding::settled(vec![
        Evidence::at_most(
            "largest deviation of λ_min of the trapezohedra, k = 3…20, from the smaller root of (3 − 24λ)(k − (k + 5)λ) = 9",
            closed,
            ROUNDING,
        ),
        Evidence::at_most(
            "deviation of the root at k = 4 from (41 − √1393)/144",
            (trapezohedron_formula(4.0) - least_known).abs(),
            ROUNDING,
        ),
        Evidence::shown("(41 − √1393)/144", least_known),
        Evidence::at_least("λ_min with 400 vertices of valence 3, in a ring", ends(&system(many.0, &many.1)?)?.min, 1.0 / 97.0),
        Evidence::at_least("smallest λ_min of random quad meshes", smallest(random.iter().copied()), 1.0 / 97.0),
        Evidence::shown("random quad meshes", random.len()),
        Evidence::at_least(
            "least λ_min found by a search over quad meshes of 10, 12, 14 and 16 vertices, less (41 − √1393)/144",
            smallest(found.iter().copied()) - least_known,
            -ROUNDING,
        ),
        Evidence::shown("the least of 12", found[1]),
        Evidence::shown("the least of 14", found[2]),
        Evidence::shown("the least of 16", found[3]),
    ])
    .remark(
        "Proven: 1/97 for every connected closed orientable quad mesh but the cube. Sharp it is not: (41 − √1393)/144 is the \
         least found, at ten vertices, eight of valence 3 in a ring between two of valence 4.",
    ))
}
