//! Refinement with sharp edges by hash maps, straight from the rules, as a witness for the rows.

use std::collections::BTreeMap;

use glam::DVec3;
use limitlab::mesh::features::Tags;
use limitlab::mesh::validate::Boundary;
use limitlab::mesh::{Faces, Mesh, Surface};

/// A mesh with the sharpness of its edges, those of the boundary too, and of its vertices; 10 and more is for ever.
#[derive(Clone)]
pub struct Creased {
    pub mesh: Mesh,
    pub sharp: BTreeMap<[u32; 2], f64>,
    pub corners: BTreeMap<u32, f64>,
}

/// What is left of a sharpness after a step.
fn lowered(sharpness: f64) -> f64 {
    if sharpness >= 10.0 { sharpness } else { sharpness - 1.0 }
}

pub fn edge(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

fn sides(face: &[u32]) -> impl Iterator<Item = [u32; 2]> + '_ {
    (0..face.len()).map(|k| edge(face[k], face[(k + 1) % face.len()]))
}

/// The faces on every edge.
pub fn faces_by_edge(mesh: &Mesh) -> BTreeMap<[u32; 2], Vec<usize>> {
    let mut edges: BTreeMap<[u32; 2], Vec<usize>> = BTreeMap::new();
    for (f, face) in mesh.faces.iter().enumerate() {
        sides(face).for_each(|side| edges.entry(side).or_default().push(f));
    }
    edges
}

impl Creased {
    pub fn of(surface: &Surface, tags: &Tags) -> Self {
        let mesh = surface.mesh().clone();
        let edges = faces_by_edge(&mesh);
        let mut sharp: BTreeMap<[u32; 2], f64> = BTreeMap::new();
        for &([a, b], s) in &tags.creases {
            let here = sharp.entry(edge(a, b)).or_insert(0.0);
            *here = here.max(s);
        }
        sharp.extend(edges.iter().filter(|(_, faces)| faces.len() == 1).map(|(side, _)| (*side, 10.0)));
        let mut corners: BTreeMap<u32, f64> = BTreeMap::new();
        for &(v, s) in &tags.corners {
            let here = corners.entry(v).or_insert(0.0);
            *here = here.max(s);
        }
        for v in 0..mesh.len() as u32 {
            let at = mesh.faces.iter().filter(|face| face.contains(&v)).count();
            let is_boundary = edges.iter().any(|(side, faces)| faces.len() == 1 && side.contains(&v));
            if at == 1 && is_boundary && tags.boundary == Boundary::EdgeAndCorner {
                corners.insert(v, 10.0);
            }
        }
        Creased { mesh, sharp, corners }
    }

    /// The surface with all this as tags. What is a corner by its only face stays one in `corners`.
    pub fn surface(&self) -> Surface {
        let surface = Surface::examined(self.mesh.clone(), None, Boundary::EdgeOnly).unwrap();
        let tags = Tags {
            boundary: Boundary::EdgeOnly,
            creases: self.sharp.iter().map(|(&side, &s)| (side, s)).collect(),
            corners: self.corners.iter().map(|(&v, &s)| (v, s)).collect(),
        };
        surface.tagged(&tags).unwrap()
    }

    /// The sharp edges at a vertex, by their other ends, after so many lowerings.
    pub fn sharp_at(&self, v: u32, later: bool) -> Vec<(u32, f64)> {
        let left = |s: f64| if later { lowered(s) } else { s };
        let at = self.sharp.iter().filter(|(side, _)| side.contains(&v));
        at.map(|(&[a, b], &s)| (if a == v { b } else { a }, left(s))).filter(|e| e.1 > 0.0).collect()
    }

    /// Where a vertex goes by its rule now, or by the one of the next level; `smooth` is where it goes without sharp edges.
    fn by_rule(&self, v: u32, later: bool, smooth: DVec3) -> (Vec<u32>, bool, DVec3) {
        let at = |v: u32| self.mesh.positions[v as usize];
        let own = self.corners.get(&v).copied().unwrap_or(0.0);
        let own = if later { lowered(own) } else { own };
        let ends: Vec<u32> = self.sharp_at(v, later).into_iter().map(|e| e.0).collect();
        let is_corner = own > 0.0 || ends.len() > 2;
        let place = match ends[..] {
            _ if is_corner => at(v),
            [a, b] => 0.75 * at(v) + 0.125 * (at(a) + at(b)),
            _ => smooth,
        };
        // Darts follow the rule of smooth vertices, and are told apart from them.
        (ends, is_corner, place)
    }

    /// Where a vertex goes.
    fn vertex_point(&self, v: u32, smooth: DVec3) -> DVec3 {
        let (now, corner, here) = self.by_rule(v, false, smooth);
        let (then, later_corner, there) = self.by_rule(v, true, smooth);
        let kind = |ends: &[u32], corner: bool| if corner { 3 } else { ends.len() };
        if kind(&now, corner) == kind(&then, later_corner) && (corner || now == then) {
            return here;
        }
        let mut vanishing: Vec<f64> = self.sharp_at(v, false).into_iter().map(|e| e.1).collect();
        vanishing.extend(self.corners.get(&v));
        vanishing.retain(|&s| s > 0.0 && s <= 1.0);
        let w = (vanishing.iter().sum::<f64>() / vanishing.len() as f64).min(1.0);
        w * here + (1.0 - w) * there
    }

    /// The sharpness of an edge.
    fn of_edge(&self, side: [u32; 2]) -> f64 {
        self.sharp.get(&side).copied().unwrap_or(0.0)
    }

    /// The children of sharp edges, whose midpoints have these numbers.
    fn children(&self, midpoints: &BTreeMap<[u32; 2], u32>) -> BTreeMap<[u32; 2], f64> {
        let left = self.sharp.iter().map(|(side, &s)| (side, lowered(s))).filter(|e| e.1 > 0.0);
        left.flat_map(|(side, s)| side.map(|v| (edge(v, midpoints[side]), s))).collect()
    }

    fn lowered_corners(&self) -> BTreeMap<u32, f64> {
        self.corners.iter().map(|(&v, &s)| (v, lowered(s))).filter(|e| e.1 > 0.0).collect()
    }

    /// A Catmull-Clark step. The old vertices keep their numbers.
    pub fn catmull_clark(&self) -> Self {
        let (mesh, edges) = (&self.mesh, faces_by_edge(&self.mesh));
        let at = |v: u32| mesh.positions[v as usize];
        let centroids: Vec<DVec3> =
            mesh.faces.iter().map(|face| face.iter().map(|&v| at(v)).sum::<DVec3>() / face.len() as f64).collect();
        let mut positions: Vec<DVec3> = (0..mesh.len() as u32)
            .map(|v| {
                let around: Vec<usize> = (0..mesh.faces.len()).filter(|&f| mesh.faces.face(f).contains(&v)).collect();
                let n = around.len() as f64;
                let faces = around.iter().map(|&f| centroids[f]).sum::<DVec3>() / n;
                let middles = edges.keys().filter(|side| side.contains(&v));
                let middles = middles.map(|&[a, b]| 0.5 * (at(a) + at(b))).sum::<DVec3>() / n;
                self.vertex_point(v, (faces + 2.0 * middles + (n - 3.0) * at(v)) / n)
            })
            .collect();
        let mut midpoints = BTreeMap::new();
        for (&side, faces) in &edges {
            midpoints.insert(side, positions.len() as u32);
            let middle = 0.5 * (at(side[0]) + at(side[1]));
            positions.push(match faces[..] {
                [f, g] => {
                    let s = self.of_edge(side).min(1.0);
                    (1.0 - s) * (0.5 * middle + 0.25 * (centroids[f] + centroids[g])) + s * middle
                }
                _ => middle,
            });
        }
        let first_face = positions.len() as u32;
        positions.extend(&centroids);
        let mut faces = Faces::default();
        for (f, face) in mesh.faces.iter().enumerate() {
            for k in 0..face.len() {
                let (before, v, after) = (face[(k + face.len() - 1) % face.len()], face[k], face[(k + 1) % face.len()]);
                faces.push(&[v, midpoints[&edge(v, after)], first_face + f as u32, midpoints[&edge(before, v)]]);
            }
        }
        let sharp = self.children(&midpoints);
        Creased { mesh: Mesh::new(positions, faces), sharp, corners: self.lowered_corners() }
    }

    /// A Loop step.
    pub fn loop_step(&self) -> Self {
        let (mesh, edges) = (&self.mesh, faces_by_edge(&self.mesh));
        let at = |v: u32| mesh.positions[v as usize];
        let mut positions: Vec<DVec3> = (0..mesh.len() as u32)
            .map(|v| {
                let ring: Vec<u32> =
                    edges.keys().filter(|side| side.contains(&v)).map(|&[a, b]| if a == v { b } else { a }).collect();
                let n = ring.len() as f64;
                let part = 0.625 - (0.375 + 0.25 * (std::f64::consts::TAU / n).cos()).powi(2);
                self.vertex_point(v, (1.0 - part) * at(v) + part * ring.iter().map(|&w| at(w)).sum::<DVec3>() / n)
            })
            .collect();
        let mut midpoints = BTreeMap::new();
        for (&side, faces) in &edges {
            midpoints.insert(side, positions.len() as u32);
            let middle = 0.5 * (at(side[0]) + at(side[1]));
            let opposite = |f: usize| mesh.faces.face(f).iter().copied().find(|v| !side.contains(v)).unwrap();
            positions.push(match faces[..] {
                [f, g] => {
                    let s = self.of_edge(side).min(1.0);
                    (1.0 - s) * (0.75 * middle + 0.125 * (at(opposite(f)) + at(opposite(g)))) + s * middle
                }
                _ => middle,
            });
        }
        self.in_four(positions, &midpoints)
    }

    /// Every triangle in four, by the numbers of the new vertices on its sides.
    fn in_four(&self, positions: Vec<DVec3>, midpoints: &BTreeMap<[u32; 2], u32>) -> Self {
        let mut faces = Faces::default();
        for face in self.mesh.faces.iter() {
            let [a, b, c] = face.try_into().unwrap();
            let [ab, bc, ca] = [edge(a, b), edge(b, c), edge(c, a)].map(|side| midpoints[&side]);
            [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]].iter().for_each(|face| faces.push(face));
        }
        let sharp = self.children(midpoints);
        Creased { mesh: Mesh::new(positions, faces), sharp, corners: self.lowered_corners() }
    }

    /// The vertices about a smooth vertex, in order, from one on.
    pub fn ring(&self, v: u32, first: u32) -> Vec<u32> {
        let faces: Vec<[u32; 3]> = self.mesh.faces.iter().map(|face| face.try_into().unwrap()).collect();
        let after = |w: u32| {
            let found = faces.iter().find(|f| (0..3).any(|k| f[k] == v && f[(k + 1) % 3] == w)).unwrap();
            found.iter().copied().find(|&x| x != v && x != w).unwrap()
        };
        std::iter::successors(Some(first), |&w| Some(after(w)).filter(|&x| x != first)).collect()
    }

    /// The four points of a curve about its edge from `a` to `b`, mirrored beyond its ends.
    pub fn along(&self, [a, b]: [u32; 2]) -> [DVec3; 4] {
        let at = |v: u32| self.mesh.positions[v as usize];
        let beyond = |from: u32, v: u32| {
            let ends: Vec<u32> = self.sharp_at(v, false).into_iter().map(|e| e.0).collect();
            match ends[..] {
                [a, b] if !self.corners.contains_key(&v) => at(if a == from { b } else { a }),
                _ => 2.0 * at(v) - at(from),
            }
        };
        [beyond(b, a), at(a), at(b), beyond(a, b)]
    }

    pub fn is_smooth(&self, v: u32) -> bool {
        !self.corners.contains_key(&v) && self.sharp_at(v, false).is_empty()
    }

    /// A modified Butterfly step, by the published masks.
    pub fn butterfly(&self) -> Self {
        let (mesh, edges) = (&self.mesh, faces_by_edge(&self.mesh));
        let at = |v: u32| mesh.positions[v as usize];
        let opposite = |f: usize, side: [u32; 2]| {
            let third = mesh.faces.face(f).iter().copied().find(|v| !side.contains(v));
            at(third.unwrap())
        };
        let mut positions = mesh.positions.clone();
        let mut midpoints = BTreeMap::new();
        for (&side, faces) in &edges {
            midpoints.insert(side, positions.len() as u32);
            if self.sharp.contains_key(&side) {
                let [before, a, b, after] = self.along(side);
                positions.push((9.0 * (a + b) - before - after) / 16.0);
                continue;
            }
            let by_ring: Vec<DVec3> = (0..2)
                .filter_map(|k| {
                    let (v, w) = (side[k], side[1 - k]);
                    let ring = if self.is_smooth(v) { self.ring(v, w) } else { return None };
                    let n = ring.len();
                    let weight = |j: usize| {
                        let angle = std::f64::consts::TAU * j as f64 / n as f64;
                        match n {
                            3 => [5.0, -1.0, -1.0][j] / 12.0,
                            4 => [3.0, 0.0, -1.0, 0.0][j] / 8.0,
                            _ => (0.25 + angle.cos() + 0.5 * (2.0 * angle).cos()) / n as f64,
                        }
                    };
                    let sum: DVec3 = ring.iter().enumerate().map(|(j, &w)| weight(j) * at(w)).sum();
                    (n != 6).then_some(0.75 * at(v) + sum)
                })
                .collect();
            if !by_ring.is_empty() {
                positions.push(by_ring.iter().sum::<DVec3>() / by_ring.len() as f64);
                continue;
            }
            let mut point = 0.5 * (at(side[0]) + at(side[1]));
            for &f in faces {
                let tip = mesh.faces.face(f).iter().copied().find(|v| !side.contains(v)).unwrap();
                point += at(tip) / 8.0;
                for (v, w) in [(side[0], side[1]), (side[1], side[0])] {
                    let rim = edge(v, tip);
                    let wing = match edges[&rim][..] {
                        [g, h] if !self.sharp.contains_key(&rim) => opposite(if g == f { h } else { g }, rim),
                        _ => at(v) + at(tip) - at(w),
                    };
                    point -= wing / 16.0;
                }
            }
            positions.push(point);
        }
        self.in_four(positions, &midpoints)
    }

    /// A √3 step: centroids, smooth vertices relaxed, edges flipped that are not sharp; all that is sharp rests.
    pub fn sqrt3(&self) -> Self {
        let (mesh, edges) = (&self.mesh, faces_by_edge(&self.mesh));
        let at = |v: u32| mesh.positions[v as usize];
        let mut positions: Vec<DVec3> = (0..mesh.len() as u32)
            .map(|v| {
                if self.corners.contains_key(&v) || !self.sharp_at(v, false).is_empty() {
                    return at(v);
                }
                let ring: Vec<u32> =
                    edges.keys().filter(|side| side.contains(&v)).map(|&[a, b]| if a == v { b } else { a }).collect();
                let n = ring.len() as f64;
                let part = (4.0 - 2.0 * (std::f64::consts::TAU / n).cos()) / 9.0;
                (1.0 - part) * at(v) + part * ring.iter().map(|&w| at(w)).sum::<DVec3>() / n
            })
            .collect();
        let first = positions.len() as u32;
        positions.extend(mesh.faces.iter().map(|face| face.iter().map(|&v| at(v)).sum::<DVec3>() / 3.0));
        let mut faces = Faces::default();
        for (f, face) in mesh.faces.iter().enumerate() {
            for k in 0..3 {
                let (v, w) = (face[k], face[(k + 1) % 3]);
                let side = edge(v, w);
                match edges[&side][..] {
                    // Once for both sides: the two triangles across the flipped edge.
                    [a, b] if !self.sharp.contains_key(&side) => {
                        if f == a {
                            faces.push(&[v, first + b as u32, first + a as u32]);
                            faces.push(&[w, first + a as u32, first + b as u32]);
                        }
                    }
                    _ => faces.push(&[v, w, first + f as u32]),
                }
            }
        }
        Creased { mesh: Mesh::new(positions, faces), sharp: self.sharp.clone(), corners: self.corners.clone() }
    }

    /// A step of Doo-Sabin's kind: corner k of an m-gon goes to the sum over j of `weight(m, j)` times the corner j further on.
    /// Sharp edges are cut at their quarters, and corners stay, joined to the faces between each two sharp edges; inside the
    /// surface with less than three of these, by triangles.
    pub fn dual(&self, weight: impl Fn(usize, usize) -> f64) -> Self {
        let (mesh, edges) = (&self.mesh, faces_by_edge(&self.mesh));
        let at = |v: u32| mesh.positions[v as usize];
        let is_sharp = |a: u32, b: u32| self.sharp.contains_key(&edge(a, b));
        let mut positions = Vec::new();
        let mut number = BTreeMap::new();
        let mut put = |key: (u8, u32, u32), point: DVec3| {
            number.insert(key, positions.len() as u32);
            positions.push(point);
        };
        for (f, face) in mesh.faces.iter().enumerate() {
            let m = face.len();
            for k in 0..m {
                let terms = (0..m).map(|j| weight(m, j) * at(face[(k + j) % m]));
                put((0, f as u32, face[k]), terms.sum());
            }
        }
        for &[a, b] in self.sharp.keys() {
            put((1, a, b), 0.75 * at(a) + 0.25 * at(b));
            put((1, b, a), 0.75 * at(b) + 0.25 * at(a));
        }
        let sharp_at = |v: u32| self.sharp.keys().filter(|side| side.contains(&v)).count();
        let is_corner = |v: u32| self.corners.contains_key(&v) || sharp_at(v) > 2;
        (0..mesh.len() as u32).filter(|&v| is_corner(v)).for_each(|v| put((2, v, v), at(v)));
        let of_corner = |f: usize, v: u32| number[&(0, f as u32, v)];
        let on_edge = |a: u32, b: u32| number[&(1, a, b)];

        let mut faces = Faces::default();
        for (f, face) in mesh.faces.iter().enumerate() {
            faces.push(&face.iter().map(|&v| of_corner(f, v)).collect::<Vec<_>>());
        }
        let mut sharp = BTreeMap::new();
        for (f, face) in mesh.faces.iter().enumerate() {
            for k in 0..face.len() {
                let (a, b) = (face[k], face[(k + 1) % face.len()]);
                let other = edges[&edge(a, b)].iter().copied().find(|&g| g != f);
                match other {
                    _ if is_sharp(a, b) => {
                        faces.push(&[of_corner(f, b), of_corner(f, a), on_edge(a, b), on_edge(b, a)]);
                        sharp.insert(edge(on_edge(a, b), on_edge(b, a)), 10.0);
                    }
                    Some(g) if f < g => {
                        faces.push(&[of_corner(f, b), of_corner(f, a), of_corner(g, a), of_corner(g, b)]);
                    }
                    _ => {}
                }
            }
        }
        let mut corners = BTreeMap::new();
        for v in 0..mesh.len() as u32 {
            // Faces with the vertices before and after v.
            let around: Vec<(usize, u32, u32)> = mesh
                .faces
                .iter()
                .enumerate()
                .filter_map(|(f, face)| {
                    let k = face.iter().position(|&w| w == v)?;
                    Some((f, face[(k + face.len() - 1) % face.len()], face[(k + 1) % face.len()]))
                })
                .collect();
            let inside = around.iter().all(|&(_, before, _)| edges[&edge(v, before)].len() == 2);
            let own = is_corner(v).then(|| number[&(2, v, v)]);
            corners.extend(own.map(|own| (own, 10.0)));
            let mut starts: Vec<_> = around.iter().filter(|face| is_sharp(v, face.2)).collect();
            if starts.is_empty() {
                starts.push(&around[0]);
            }
            for &start in starts {
                let mut ring = Vec::new();
                if is_sharp(v, start.2) {
                    ring.push(on_edge(v, start.2));
                }
                let mut here = start;
                loop {
                    ring.push(of_corner(here.0, v));
                    if is_sharp(v, here.1) {
                        ring.push(on_edge(v, here.1));
                        break;
                    }
                    here = *around.iter().find(|face| face.2 == here.1).unwrap();
                    if here == start {
                        break;
                    }
                }
                let ends = [ring[0], ring[ring.len() - 1]];
                let Some(own) = own else {
                    if sharp_at(v) > 0 {
                        sharp.insert(edge(ends[0], ends[1]), 10.0);
                    }
                    faces.push(&ring);
                    continue;
                };
                if inside && sharp_at(v) < 3 {
                    if sharp_at(v) == 0 {
                        ring.push(ring[0]);
                    }
                    ring.windows(2).for_each(|pair| faces.push(&[pair[0], pair[1], own]));
                } else {
                    ring.push(own);
                    faces.push(&ring);
                }
                if sharp_at(v) > 0 {
                    sharp.extend(ends.map(|end| (edge(end, own), 10.0)));
                }
            }
        }
        Creased { mesh: Mesh::new(positions, faces), sharp, corners }
    }
}
