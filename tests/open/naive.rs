//! Refinement with sharp edges by hash maps, straight from the rules, as a witness for the rows.

use std::collections::{BTreeMap, BTreeSet};

use glam::DVec3;
use limitlab::mesh::features::Tags;
use limitlab::mesh::validate::Boundary;
use limitlab::mesh::{Faces, Mesh, Surface};

/// A mesh with its sharp edges, those of the boundary too, and its corners.
#[derive(Clone)]
pub struct Creased {
    pub mesh: Mesh,
    pub sharp: BTreeSet<[u32; 2]>,
    pub corners: BTreeSet<u32>,
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
        let mut sharp: BTreeSet<[u32; 2]> = tags.creases.iter().map(|&([a, b], _)| edge(a, b)).collect();
        sharp.extend(edges.iter().filter(|(_, faces)| faces.len() == 1).map(|(side, _)| *side));
        let mut corners: BTreeSet<u32> = tags.corners.iter().map(|c| c.0).collect();
        for v in 0..mesh.len() as u32 {
            let at = mesh.faces.iter().filter(|face| face.contains(&v)).count();
            let is_boundary = edges.iter().any(|(side, faces)| faces.len() == 1 && side.contains(&v));
            if sharp.iter().filter(|side| side.contains(&v)).count() > 2
                || (at == 1 && is_boundary && tags.boundary == Boundary::EdgeAndCorner)
            {
                corners.insert(v);
            }
        }
        Creased { mesh, sharp, corners }
    }

    /// The surface with all this as tags. What is a corner by its only face stays one in `corners`.
    pub fn surface(&self) -> Surface {
        let surface = Surface::examined(self.mesh.clone(), None, Boundary::EdgeOnly).unwrap();
        let tags = Tags {
            boundary: Boundary::EdgeOnly,
            creases: self.sharp.iter().map(|&side| (side, 10.0)).collect(),
            corners: self.corners.iter().map(|&v| (v, 10.0)).collect(),
        };
        surface.tagged(&tags).unwrap()
    }

    fn is_sharp(&self, v: u32) -> bool {
        self.corners.contains(&v) || self.sharp.iter().any(|side| side.contains(&v))
    }

    /// Where a vertex goes, but for smooth ones.
    fn sharp_vertex(&self, v: u32) -> Option<DVec3> {
        let at = |v: u32| self.mesh.positions[v as usize];
        if self.corners.contains(&v) {
            return Some(at(v));
        }
        let ends: Vec<u32> =
            self.sharp.iter().filter(|side| side.contains(&v)).map(|&[a, b]| if a == v { b } else { a }).collect();
        match ends[..] {
            // A dart follows the smooth rule.
            [] | [_] => None,
            [a, b] => Some(0.75 * at(v) + 0.125 * (at(a) + at(b))),
            _ => panic!("a corner that is not listed"),
        }
    }

    /// The children of sharp edges, whose midpoints have these numbers.
    fn children(&self, midpoints: &BTreeMap<[u32; 2], u32>) -> BTreeSet<[u32; 2]> {
        self.sharp.iter().flat_map(|side| side.map(|v| edge(v, midpoints[side]))).collect()
    }

    /// A Catmull-Clark step. The old vertices keep their numbers.
    pub fn catmull_clark(&self) -> Self {
        let (mesh, edges) = (&self.mesh, faces_by_edge(&self.mesh));
        let at = |v: u32| mesh.positions[v as usize];
        let centroids: Vec<DVec3> =
            mesh.faces.iter().map(|face| face.iter().map(|&v| at(v)).sum::<DVec3>() / face.len() as f64).collect();
        let mut positions: Vec<DVec3> = (0..mesh.len() as u32)
            .map(|v| {
                self.sharp_vertex(v).unwrap_or_else(|| {
                    let around: Vec<usize> =
                        (0..mesh.faces.len()).filter(|&f| mesh.faces.face(f).contains(&v)).collect();
                    let n = around.len() as f64;
                    let faces = around.iter().map(|&f| centroids[f]).sum::<DVec3>() / n;
                    let middles = edges.keys().filter(|side| side.contains(&v));
                    let middles = middles.map(|&[a, b]| 0.5 * (at(a) + at(b))).sum::<DVec3>() / n;
                    (faces + 2.0 * middles + (n - 3.0) * at(v)) / n
                })
            })
            .collect();
        let mut midpoints = BTreeMap::new();
        for (&side, faces) in &edges {
            midpoints.insert(side, positions.len() as u32);
            let middle = 0.5 * (at(side[0]) + at(side[1]));
            positions.push(match faces[..] {
                [f, g] if !self.sharp.contains(&side) => 0.5 * middle + 0.25 * (centroids[f] + centroids[g]),
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
        Creased { mesh: Mesh::new(positions, faces), sharp, corners: self.corners.clone() }
    }

    /// A Loop step.
    pub fn loop_step(&self) -> Self {
        let (mesh, edges) = (&self.mesh, faces_by_edge(&self.mesh));
        let at = |v: u32| mesh.positions[v as usize];
        let mut positions: Vec<DVec3> = (0..mesh.len() as u32)
            .map(|v| {
                self.sharp_vertex(v).unwrap_or_else(|| {
                    let ring: Vec<u32> = edges
                        .keys()
                        .filter(|side| side.contains(&v))
                        .map(|&[a, b]| if a == v { b } else { a })
                        .collect();
                    let n = ring.len() as f64;
                    let part = 0.625 - (0.375 + 0.25 * (std::f64::consts::TAU / n).cos()).powi(2);
                    (1.0 - part) * at(v) + part * ring.iter().map(|&w| at(w)).sum::<DVec3>() / n
                })
            })
            .collect();
        let mut midpoints = BTreeMap::new();
        for (&side, faces) in &edges {
            midpoints.insert(side, positions.len() as u32);
            let middle = 0.5 * (at(side[0]) + at(side[1]));
            let opposite = |f: usize| mesh.faces.face(f).iter().copied().find(|v| !side.contains(v)).unwrap();
            positions.push(match faces[..] {
                [f, g] if !self.sharp.contains(&side) => 0.75 * middle + 0.125 * (at(opposite(f)) + at(opposite(g))),
                _ => middle,
            });
        }
        let mut faces = Faces::default();
        for face in mesh.faces.iter() {
            let [a, b, c] = face.try_into().unwrap();
            let [ab, bc, ca] = [edge(a, b), edge(b, c), edge(c, a)].map(|side| midpoints[&side]);
            [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]].iter().for_each(|face| faces.push(face));
        }
        let sharp = self.children(&midpoints);
        Creased { mesh: Mesh::new(positions, faces), sharp, corners: self.corners.clone() }
    }

    /// A √3 step: centroids, smooth vertices relaxed, edges flipped that are not sharp; all that is sharp rests.
    pub fn sqrt3(&self) -> Self {
        let (mesh, edges) = (&self.mesh, faces_by_edge(&self.mesh));
        let at = |v: u32| mesh.positions[v as usize];
        let mut positions: Vec<DVec3> = (0..mesh.len() as u32)
            .map(|v| {
                if self.is_sharp(v) {
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
                    [a, b] if !self.sharp.contains(&side) => {
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
}
