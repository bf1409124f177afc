//! √3, Labsik-Greiner and the unified √3 scheme on open and creased meshes, both steps: against refinement by hand, rows, and
//! polynomials.

use std::collections::BTreeMap;

use chacha20::ChaCha8Rng;
use glam::DVec3;
use limitlab::Error;
use limitlab::interpolate::lin_luo::limit::limits;
use limitlab::interpolate::lin_luo::surface::refine_n;
use limitlab::interpolate::surface::{SurfaceOptions, surface};
use limitlab::interpolate::{Options, interpolate, limit_points};
use limitlab::mesh::features::Tags;
use limitlab::mesh::validate::Boundary;
use limitlab::mesh::{Faces, Mesh, Surface};
use limitlab::schemes::{Refinement, Scheme, sqrt3, unified_sqrt3};
use rand::{RngExt, SeedableRng};

use super::naive::{Creased, edge, faces_by_edge};
use super::{grid, open, random_creased};

/// A mesh by hand, with the α of its vertices, and whether the next step splits sharp edges.
struct Level {
    at: Creased,
    alpha: Vec<f64>,
    splits: bool,
}

/// What a new vertex stands for: a face, or the third of a sharp edge at its first end.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum New {
    Face(usize),
    Third([u32; 2]),
}

impl Level {
    fn of(surface: &Surface, tags: &Tags, alpha: &[f64]) -> Self {
        Level { at: Creased::of(surface, tags), alpha: alpha.to_vec(), splits: false }
    }

    fn point(&self, v: u32) -> DVec3 {
        self.at.mesh.positions[v as usize]
    }

    fn is_sharp(&self, side: [u32; 2]) -> bool {
        self.at.sharp.contains_key(&edge(side[0], side[1]))
    }

    fn sides(&self, f: usize) -> [[u32; 2]; 3] {
        let [a, b, c] = self.at.mesh.faces.face(f).try_into().unwrap();
        [[a, b], [b, c], [c, a]]
    }

    fn third(&self, f: usize, [a, b]: [u32; 2]) -> u32 {
        self.at.mesh.faces.face(f).iter().copied().find(|&v| v != a && v != b).unwrap()
    }

    /// Across from a sharp edge of the face, if it has one: the vertex there, and the mirrored one.
    fn sharp_of(&self, f: usize) -> Option<([u32; 2], u32, DVec3)> {
        let side = self.sides(f).into_iter().find(|&side| self.is_sharp(side))?;
        let z = self.third(f, side);
        Some((side, z, self.point(side[0]) + self.point(side[1]) - self.point(z)))
    }

    /// By √3: where a vertex goes.
    fn relaxed(&self, v: u32, edges: &BTreeMap<[u32; 2], Vec<usize>>) -> DVec3 {
        let here = self.point(v);
        if !self.at.is_smooth(v) {
            let ends: Vec<u32> = self.at.sharp_at(v, false).into_iter().map(|e| e.0).collect();
            return match ends[..] {
                [a, b] if self.splits && !self.at.corners.contains_key(&v) => {
                    (4.0 * self.point(a) + 19.0 * here + 4.0 * self.point(b)) / 27.0
                }
                _ => here,
            };
        }
        let mut ring: Vec<DVec3> =
            edges.keys().filter(|s| s.contains(&v)).map(|&[a, b]| self.point(if a == v { b } else { a })).collect();
        if self.splits {
            let across = (0..self.at.mesh.faces.len()).filter_map(|f| self.sharp_of(f)).filter(|s| s.1 == v);
            ring.extend(across.map(|s| s.2));
        }
        let n = ring.len() as f64;
        let part = (4.0 - 2.0 * (std::f64::consts::TAU / n).cos()) / 9.0;
        (1.0 - part) * here + part * ring.iter().sum::<DVec3>() / n
    }

    /// What lies across a side of a face, and the two beyond that.
    fn across(&self, f: usize, side: [u32; 2], edges: &BTreeMap<[u32; 2], Vec<usize>>) -> (DVec3, DVec3) {
        let [x, y] = side.map(|v| self.point(v));
        let z = self.point(self.third(f, side));
        if self.is_sharp(side) {
            let tip = x + y - z;
            return (tip, (x + tip - y) + (y + tip - x));
        }
        let g = edges[&edge(side[0], side[1])].iter().copied().find(|&g| g != f).unwrap();
        if let (true, Some((sharp, z, tip))) = (self.splits, self.sharp_of(g)) {
            // The triangle beyond the side ends at the mirrored vertex: its other neighbours are that of the sharp edge's
            // other half, and a mirrored one.
            let [near, far] = if side.contains(&sharp[0]) { sharp } else { [sharp[1], sharp[0]] };
            return (tip, self.point(far) + (self.point(near) + tip - self.point(z)));
        }
        let tip = self.third(g, side);
        let beyond = self.sides(g).into_iter().filter(|&s| s.contains(&tip)).map(|s| {
            let h = edges[&edge(s[0], s[1])].iter().copied().find(|&h| h != g);
            match h {
                Some(h) if !self.is_sharp(s) => match self.sharp_of(h) {
                    Some((_, _, mirrored)) if self.splits => mirrored,
                    _ => self.point(self.third(h, s)),
                },
                _ => self.point(s[0]) + self.point(s[1]) - self.point(self.third(g, s)),
            }
        });
        (self.point(tip), beyond.sum())
    }

    /// The new vertex of a face by Labsik & Greiner.
    fn labsik_greiner(&self, f: usize, edges: &BTreeMap<[u32; 2], Vec<usize>>) -> DVec3 {
        let corners: [u32; 3] = self.at.mesh.faces.face(f).try_into().unwrap();
        let by_ring: Vec<DVec3> = (0..3)
            .filter_map(|k| {
                let v = corners[k];
                if !self.at.is_smooth(v) {
                    return None;
                }
                let ring = self.at.ring(v, corners[(k + 1) % 3]);
                let beyond = (0..self.at.mesh.faces.len()).filter_map(|f| self.sharp_of(f)).any(|s| s.1 == v);
                if ring.len() == 6 || self.splits && beyond {
                    return None;
                }
                let n = ring.len();
                let (center, mask) = limitlab::schemes::labsik_greiner::extraordinary_mask(n);
                let sum: DVec3 = (0..n).map(|j| mask[j] * self.point(ring[j])).sum();
                Some(center * self.point(v) + sum)
            })
            .collect();
        if !by_ring.is_empty() {
            return by_ring.iter().sum::<DVec3>() / by_ring.len() as f64;
        }
        let mut point = corners.iter().map(|&v| 32.0 * self.point(v)).sum::<DVec3>();
        for side in self.sides(f) {
            let (tip, wings) = self.across(f, side, edges);
            point -= tip + 2.0 * wings;
        }
        point / 81.0
    }

    /// A step; `interpolates` for Labsik & Greiner's masks of faces, and otherwise those of the unified scheme. With what every
    /// new vertex stands for.
    fn step(&self, interpolates: bool) -> (Self, Vec<New>) {
        let (mesh, edges) = (&self.at.mesh, faces_by_edge(&self.at.mesh));
        let relaxed: Vec<DVec3> = (0..mesh.len() as u32).map(|v| self.relaxed(v, &edges)).collect();
        let moved = |v: u32, part: f64| self.point(v) + part * (relaxed[v as usize] - self.point(v));
        let mut positions: Vec<DVec3> =
            (0..mesh.len() as u32).map(|v| moved(v, 1.0 - self.alpha[v as usize])).collect();
        let mut alpha = self.alpha.clone();
        let mut new = Vec::new();
        let mut number = BTreeMap::new();
        for f in 0..mesh.faces.len() {
            if self.splits && self.sharp_of(f).is_some() {
                continue;
            }
            let face = mesh.faces.face(f);
            number.insert(New::Face(f), positions.len() as u32);
            new.push(New::Face(f));
            positions.push(match interpolates {
                true => self.labsik_greiner(f, &edges),
                false => face.iter().map(|&v| moved(v, -self.alpha[v as usize])).sum::<DVec3>() / 3.0,
            });
            alpha.push(face.iter().map(|&v| self.alpha[v as usize]).sum::<f64>() / 3.0);
        }
        if self.splits {
            for &[a, b] in self.at.sharp.keys() {
                for ends in [[a, b], [b, a]] {
                    number.insert(New::Third(ends), positions.len() as u32);
                    new.push(New::Third(ends));
                    let four = self.at.along(ends);
                    let at = |weights: [f64; 4]| weights.iter().zip(four).map(|(&w, p)| w * p).sum::<DVec3>();
                    let t = (2.0 * self.alpha[ends[0] as usize] + self.alpha[ends[1] as usize]) / 3.0;
                    let (spline, cubic) = (at([1.0, 16.0, 10.0, 0.0]) / 27.0, at([-5.0, 60.0, 30.0, -4.0]) / 81.0);
                    positions.push(spline + t * (cubic - spline));
                    alpha.push(t);
                }
            }
        }
        // On the side of the face, where an edge that is not sharp is flipped.
        let apex = |f: usize, side: [u32; 2]| match self.sharp_of(f) {
            Some((sharp, _, _)) if self.splits => {
                let [near, far] = if side.contains(&sharp[0]) { sharp } else { [sharp[1], sharp[0]] };
                number[&New::Third([near, far])]
            }
            _ => number[&New::Face(f)],
        };
        let mut faces = Faces::default();
        for f in 0..mesh.faces.len() {
            for side in self.sides(f) {
                let [v, w] = side;
                if !self.is_sharp(side) {
                    let g = edges[&edge(v, w)].iter().copied().find(|&g| g != f).unwrap();
                    faces.push(&[v, apex(g, side), apex(f, side)]);
                } else if self.splits {
                    let [first, second] = [[v, w], [w, v]].map(|ends| number[&New::Third(ends)]);
                    faces.push(&[first, second, self.third(f, side)]);
                } else {
                    faces.push(&[v, w, number[&New::Face(f)]]);
                }
            }
        }
        let sharp = match self.splits {
            false => self.at.sharp.clone(),
            true => {
                let parts = self.at.sharp.keys().flat_map(|&[a, b]| {
                    let [c, d] = [[a, b], [b, a]].map(|ends| number[&New::Third(ends)]);
                    [edge(a, c), edge(c, d), edge(d, b)]
                });
                parts.map(|side| (side, 10.0)).collect()
            }
        };
        let at = Creased { mesh: Mesh::new(positions, faces), sharp, corners: self.at.corners.clone() };
        let splits = !self.splits && !at.sharp.is_empty();
        (Level { at, alpha, splits }, new)
    }
}

/// The numbers that the vertices made by hand have in the refined surface, as documented.
fn numbers(coarse: &Surface, new: &[New]) -> Vec<usize> {
    let n = coarse.len();
    let faces = coarse.faces();
    let side = |[a, b]: [u32; 2]| {
        (0..faces.corners().len()).find(|&c| {
            let face = faces.face(c / 3);
            [face[c % 3], face[(c + 1) % 3]] == [a, b]
        })
    };
    let of = |new: &New| match *new {
        New::Face(f) => n + f,
        New::Third([a, b]) => match side([a, b]) {
            Some(c) => n + c / 3,
            None => {
                let c = side([b, a]).unwrap();
                n + faces.len() + coarse.boundary_half_edges().iter().position(|&b| b as usize == c).unwrap()
            }
        },
    };
    (0..n).chain(new.iter().map(of)).collect()
}

/// A refined surface against one by hand: points, faces, rules and curves.
fn hold(coarse: &Surface, fine: &Surface, level: &Level, new: &[New], what: &str) -> Vec<usize> {
    let place = numbers(coarse, new);
    assert_eq!(place.len(), fine.len(), "{what}");
    for (v, &there) in place.iter().enumerate() {
        let off = fine.positions()[there].distance(level.at.mesh.positions[v]);
        assert!(off <= 1e-13, "{what}, vertex {v}: {off:e}");
    }
    for (ours, theirs) in fine.faces().iter().zip(level.at.mesh.faces.iter()) {
        assert!(ours.iter().map(|&v| v as usize).eq(theirs.iter().map(|&v| place[v as usize])), "{what}");
    }
    let tags = Tags {
        boundary: coarse.boundary(),
        creases: level.at.sharp.keys().map(|s| (s.map(|v| place[v as usize] as u32), 10.0)).collect(),
        corners: level.at.corners.keys().map(|&v| (place[v as usize] as u32, 10.0)).collect(),
    };
    let anew = Surface::examined(fine.mesh().clone(), None, fine.boundary()).unwrap().tagged(&tags).unwrap();
    match (fine.features(), anew.features()) {
        (Some(found), Some(anew)) => {
            assert_eq!(found.rules()[..coarse.len()], anew.rules()[..coarse.len()], "{what}");
            assert_eq!(found.sharp_half_edges(), anew.sharp_half_edges(), "{what}");
            assert_eq!(found.curves(), anew.curves(), "{what}");
            assert_eq!(found.creased_edges(), anew.creased_edges(), "{what}");
            assert_eq!(found.is_midway(), level.splits, "{what}");
        }
        (found, _) => assert!(found.is_none(), "{what}"),
    }
    place
}

fn small_creased(seed: u64) -> Option<(Surface, Tags, Vec<f64>)> {
    let (coarse, tags) = random_creased(Scheme::Sqrt3, seed)?;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let alpha = (0..coarse.len()).map(|_| rng.random_range(0..5) as f64 / 2.0).map(|a: f64| a.min(1.5)).collect();
    (coarse.len() <= 30).then_some((coarse, tags, alpha))
}

#[test]
fn both_steps_are_those_by_hand() {
    let mut tried = 0;
    for seed in 0..150 {
        let Some((coarse, tags, alpha)) = small_creased(seed) else { continue };
        let ways: [(&str, Option<Refinement>, Vec<f64>); 3] = [
            ("sqrt3", Some(Refinement::Sqrt3), vec![0.0; coarse.len()]),
            ("labsik-greiner", Some(Refinement::LabsikGreiner), vec![1.0; coarse.len()]),
            ("unified", None, alpha),
        ];
        for (name, refinement, mut alpha) in ways {
            let mut surface = coarse.clone();
            let mut level = Level::of(&coarse, &tags, &alpha);
            for step in 0..3 {
                let what = format!("{name}, seed {seed}, step {step}");
                let (by_hand, new) = level.step(refinement == Some(Refinement::LabsikGreiner));
                let fine;
                (fine, alpha) = match refinement {
                    Some(refinement) => (refinement.refined(&surface).unwrap(), alpha),
                    None => unified_sqrt3::refined(&surface, &alpha).unwrap(),
                };
                let place = hold(&surface, &fine, &by_hand, &new, &what);
                if refinement.is_none() {
                    for (v, &there) in place.iter().enumerate() {
                        assert!((by_hand.alpha[v] - alpha[there]).abs() < 1e-14, "{what}, α of vertex {v}");
                    }
                }
                // On from the numbers of ours.
                let mut tags = Tags { boundary: Boundary::EdgeOnly, ..Tags::default() };
                tags.creases = by_hand.at.sharp.keys().map(|s| (s.map(|v| place[v as usize] as u32), 10.0)).collect();
                tags.corners = by_hand.at.corners.keys().map(|&v| (place[v as usize] as u32, 10.0)).collect();
                let mut values = vec![0.0; fine.len()];
                place.iter().enumerate().for_each(|(v, &there)| values[there] = by_hand.alpha[v]);
                level = Level { at: Creased::of(&fine, &tags), alpha: values, splits: by_hand.splits };
                surface = fine;
            }
        }
        tried += usize::from(!coarse.is_closed());
    }
    assert!(tried > 30, "{tried}");
}

/// Rows of A at a mesh that is given, and limit points after one step and two.
#[test]
fn limit_points_stay_through_both_steps() {
    let (mut tried, mut between) = (0, 0);
    for seed in 0..200 {
        let Some((coarse, _)) = random_creased(Scheme::Sqrt3, seed) else { continue };
        let rows = limit_points(&coarse, Scheme::Sqrt3).unwrap();
        let mut surface = coarse.clone();
        let mut limits = sqrt3::limit_positions(&coarse).unwrap();
        for step in 0..=3 {
            let found = sqrt3::limit_positions(&surface).unwrap();
            for (v, (a, b)) in rows.iter().zip(&found).enumerate() {
                assert!(a.distance(*b) <= 1e-13, "seed {seed}, step {step}, vertex {v}: {:e}", a.distance(*b));
            }
            for (v, (a, b)) in limits.iter().zip(&found).enumerate() {
                assert!(a.distance(*b) <= 1e-13, "seed {seed}, step {step}, vertex {v}: {:e}", a.distance(*b));
            }
            // The closed form between the steps.
            let Some(features) = surface.features().filter(|f| f.is_midway()) else {
                limits = found;
                surface = Refinement::Sqrt3.refined(&surface).unwrap();
                continue;
            };
            let at = |v: u32| surface.positions()[v as usize];
            let mut sums: BTreeMap<u32, (usize, DVec3)> = BTreeMap::new();
            let neighbours = |v: u32, other: u32| {
                let crease = features.curves().iter().find_map(|curve| {
                    let n = curve.vertices.len();
                    let place = curve.vertices.iter().position(|&w| w == v)?;
                    let is_end = !curve.closed && (place == 0 || place + 1 == n);
                    (!is_end).then(|| [curve.vertices[(place + n - 1) % n], curve.vertices[(place + 1) % n]])
                });
                crease.map_or(2.0 * at(v) - at(other), |[a, b]| at(if a == other { b } else { a }))
            };
            for (f, face) in surface.faces().iter().enumerate() {
                for k in 0..3 {
                    let c = (3 * f + k) as u32;
                    let first = surface.topology().twin(c).map_or(c, |t| t.min(c));
                    if features.sharp_half_edges().contains(&first) {
                        let [x, y, z] = [face[k], face[(k + 1) % 3], face[(k + 2) % 3]];
                        let change = (neighbours(x, y) - at(x) - at(y) + neighbours(y, x)) / 27.0;
                        let (count, sum) = sums.entry(z).or_default();
                        *count += 1;
                        *sum += at(x) + at(y) - at(z) + change;
                    }
                }
            }
            for (z, (count, sum)) in sums {
                let ring: Vec<u32> =
                    surface.faces().iter().filter(|face| face.contains(&z)).flatten().copied().collect();
                // Every neighbour is in two faces.
                let around = 0.5 * ring.iter().filter(|&&v| v != z).map(|&v| at(v)).sum::<DVec3>();
                let n = ring.len() / 3 + count;
                assert_eq!(n, 6);
                let [own, other] = sqrt3::limit_mask(n);
                let exact = own * at(z) + other * (around + sum);
                assert!(exact.distance(found[z as usize]) < 1e-13, "seed {seed}, step {step}, vertex {z}");
                between += 1;
            }
            limits = found;
            surface = Refinement::Sqrt3.refined(&surface).unwrap();
            if surface.len() > 20_000 {
                break;
            }
        }
        tried += 1;
    }
    assert!(tried > 100 && between > 1000, "{tried}, {between}");
}

/// Of a plane lattice all stays: every new point lies where the lattice has it. Curves interpolate cubics but next to corners.
#[test]
fn lattices_are_reproduced_and_cubics_along_curves() {
    let (p, q) = (8, 7);
    let corners = [0, q - 1, (p - 1) * q, p * q - 1].map(|v| (v as u32, 10.0));
    let tags = Tags { boundary: Boundary::EdgeOnly, corners: corners.to_vec(), ..Tags::default() };
    let cubic = |at: DVec3| 0.03 * at.x.powi(3) - 0.05 * at.x * at.x + at.x + 0.04 * at.y.powi(3) - 0.2 * at.y * at.y;
    let mut mesh = grid(p, q, true);
    for point in &mut mesh.positions {
        point.z = cubic(*point);
    }
    let coarse = open(mesh, Boundary::EdgeOnly).tagged(&tags).unwrap();
    let alpha: Vec<f64> = (0..coarse.len()).map(|v| (v % 4) as f64 / 2.0).collect();
    let fine = |name: &str| match name {
        "unified" => refine_n(&coarse, &alpha, 2).unwrap().0,
        name => name.parse::<Refinement>().unwrap().refined_n(&coarse, 2).unwrap(),
    };
    for name in ["sqrt3", "labsik-greiner", "unified"] {
        let fine = fine(name);
        assert_eq!(fine.faces().len(), 9 * coarse.faces().len());
        let mut held = 0;
        for (v, point) in fine.positions().iter().enumerate() {
            let flat = 3.0 * point.truncate();
            assert!(flat.distance(flat.round()) < 1e-13, "{name}, vertex {v}: {point}");
            let from_end = |at: f64, count: usize| at.min(count as f64 - 1.0 - at);
            let ends = [from_end(point.x, p), from_end(point.y, q)];
            if name == "labsik-greiner" && ends[0].min(ends[1]).abs() < 1e-12 && ends[0].max(ends[1]) > 1.0 - 1e-12 {
                assert!((point.z - cubic(*point)).abs() < 1e-13, "vertex {v}: {point}");
                held += 1;
            }
        }
        if name == "labsik-greiner" {
            assert_eq!(held, 2 * (3 * (p - 3) + 1 + 3 * (q - 3) + 1));
        }
    }
}

/// By the rows, and by many steps.
#[test]
fn unified_limits_are_those_of_sqrt3_and_of_many_steps() {
    let mut tried = 0;
    for seed in 0..120 {
        let Some((coarse, _, alpha)) = small_creased(seed) else { continue };
        let Some(features) = coarse.features() else { continue };
        if coarse.len() > 16 {
            continue;
        }
        let found = limits(&coarse, &vec![0.0; coarse.len()]).unwrap();
        let rows = limit_points(&coarse, Scheme::Sqrt3).unwrap();
        for (v, (a, b)) in found.positions.iter().zip(&rows).enumerate() {
            assert!(a.distance(*b) < 1e-13, "seed {seed}, vertex {v}: {:e}", a.distance(*b));
            assert!(features.is_smooth(v) || found.normals[v] == DVec3::ZERO);
        }
        let found = limits(&coarse, &alpha).unwrap();
        for (v, (p, q)) in found.positions.iter().zip(coarse.positions()).enumerate() {
            assert!(alpha[v] != 1.0 || p == q, "seed {seed}, vertex {v}");
        }
        for levels in [1, 2] {
            let (fine, finer) = refine_n(&coarse, &alpha, levels).unwrap();
            let again = limits(&fine, &finer).unwrap();
            for (v, (a, b)) in found.positions.iter().zip(&again.positions).enumerate() {
                let off = a.distance(*b);
                assert!(off < 1e-12, "seed {seed}, {levels} steps, vertex {v}: {off:e}");
                assert!(found.normals[v].distance(again.normals[v]) < 1e-6 || found.normals[v] == DVec3::ZERO);
            }
        }
        let (fine, _) = refine_n(&coarse, &alpha, 6).unwrap();
        for (v, a) in found.positions.iter().enumerate().filter(|&(v, _)| !features.is_smooth(v)) {
            // By 3^-3 a double step of the curve, squared.
            assert!(a.distance(fine.positions()[v]) < 0.01, "seed {seed}, vertex {v}");
        }
        tried += 1;
    }
    assert!(tried > 15, "{tried}");
}

/// The whole way, after any number of steps.
#[test]
fn the_surface_by_sqrt3_interpolates() {
    let mut held = 0;
    for seed in 0..60 {
        let Some((given, _)) = random_creased(Scheme::Sqrt3, seed) else { continue };
        let found = interpolate(&given, Scheme::Sqrt3, &Options::default()).unwrap();
        let control = given.with_positions(found.points);
        for levels in 0..4 {
            let request = SurfaceOptions { levels, limit: true, normals: true, ..SurfaceOptions::default() };
            let made = surface(control.clone(), Scheme::Sqrt3, given.positions(), &request).unwrap();
            assert_eq!(made.surface.boundary_edges(), 3_usize.pow(levels as u32 / 2) * given.boundary_edges());
            for (v, (a, b)) in made.surface.positions().iter().zip(given.positions()).enumerate() {
                assert!(a.distance(*b) <= 1e-8 * control.diagonal(), "seed {seed}, vertex {v}, {levels} levels");
            }
            held += 1;
        }
    }
    assert!(held > 100, "{held}");
}

#[test]
fn darts_are_refused_by_name() {
    let mesh = grid(5, 5, true);
    let tags = Tags { boundary: Boundary::EdgeOnly, creases: vec![([6, 7], 10.0)], ..Tags::default() };
    let surface = open(mesh, Boundary::EdgeOnly).tagged(&tags).unwrap();
    for refinement in [Refinement::Sqrt3, Refinement::LabsikGreiner] {
        assert!(matches!(refinement.refined(&surface), Err(Error::Dart { vertex: 6, .. })));
        assert!(matches!(refinement.limit_normals(&surface), Err(Error::Dart { vertex: 6, .. })));
    }
    assert!(matches!(unified_sqrt3::refine(&surface, &[0.0; 25]), Err(Error::Dart { .. })));
    assert!(Refinement::Butterfly.refined(&surface).is_ok());
}
