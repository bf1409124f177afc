//! Polygon surfaces from bytes: solids and discs grown by gluing, then Euler operations, tubes, further components, and
//! now and then damage. Most are closed manifolds, with valences from 2 on and faces of 3 to 60 corners and more.

use arbitrary::{Result, Unstructured};
use glam::DVec3;
use limitlab::mesh::generate::dual;
use limitlab::mesh::{Faces, Mesh};

use super::super::surface::euler_if_closed;

/// No further operation on drafts with more vertices.
const MOST_VERTICES: usize = 200;
const MOST_OPERATIONS: usize = 40;

/// Faces as lists of vertices, which are numbered without gaps.
pub struct Draft {
    vertices: usize,
    faces: Vec<Vec<u32>>,
}

impl Draft {
    pub fn decode(u: &mut Unstructured) -> Result<Draft> {
        let mut draft = Draft { vertices: 0, faces: Vec::new() };
        draft.add_component(u)?;
        let mut operations = 0;
        while !u.is_empty() && operations < MOST_OPERATIONS && draft.vertices <= MOST_VERTICES {
            draft.operate(u)?;
            operations += 1;
        }
        Ok(draft)
    }

    /// The mesh with points without any smoothness, of length below 2.
    pub fn mesh(&self) -> Mesh {
        let point = |v: usize| {
            let t = v as f64 + 0.5;
            DVec3::new((12.9898 * t).sin(), (78.233 * t).cos(), (37.719 * t).sin())
        };
        Mesh::new((0..self.vertices).map(point).collect(), Faces::from_lists(&self.faces))
    }

    fn new_vertices(&mut self, count: usize) -> Vec<u32> {
        let first = self.vertices;
        self.vertices += count;
        (first as u32..self.vertices as u32).collect()
    }

    fn add_component(&mut self, u: &mut Unstructured) -> Result<()> {
        match u.int_in_range(0..=4u8)? {
            0 => {
                // A pillow: two polygons back to back, all valences 2 as yet.
                let rim = self.polygon(u)?;
                self.faces.push(rim.iter().rev().copied().collect());
                self.faces.push(rim);
            }
            1 => {
                let rim = self.polygon(u)?;
                self.cone(rim.iter().rev().copied().collect());
                self.cone(rim);
            }
            2 => {
                let rim = self.polygon(u)?;
                self.faces.push(rim.iter().rev().copied().collect());
                self.inset(rim);
            }
            3 => {
                let (m, n) = (u.int_in_range(3..=8)?, u.int_in_range(3..=8)?);
                let grid = self.new_vertices(m * n);
                let at = |i: usize, j: usize| grid[i % m * n + j % n];
                let quad = |i, j| vec![at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                self.faces.extend((0..m).flat_map(|i| (0..n).map(move |j| (i, j))).map(|(i, j)| quad(i, j)));
            }
            _ => self.grow(u)?,
        }
        Ok(())
    }

    fn polygon(&mut self, u: &mut Unstructured) -> Result<Vec<u32>> {
        let size = if u.ratio(3, 4)? { u.int_in_range(3..=8)? } else { u.int_in_range(3..=60)? };
        Ok(self.new_vertices(size))
    }

    /// A disc: polygons one after the other, each glued to the rim along some of its sides; the rim is the last face.
    fn grow(&mut self, u: &mut Unstructured) -> Result<()> {
        let mut rim = self.polygon(u)?;
        self.faces.push(rim.iter().rev().copied().collect());
        for _ in 0..u.int_in_range(1..=20)? {
            let glued = u.int_in_range(1..=4.min(rim.len() - 2))?;
            let fresh = u.int_in_range(usize::from(glued == 1)..=4)?;
            let start = u.choose_index(rim.len())?;
            rim.rotate_left(start);
            let more = self.new_vertices(fresh);
            // Along the rim, then back by the new vertices.
            self.faces.push(rim[..=glued].iter().chain(more.iter().rev()).copied().collect());
            rim.splice(1..glued, more);
        }
        self.faces.push(rim);
        Ok(())
    }

    fn operate(&mut self, u: &mut Unstructured) -> Result<()> {
        let operation = u.int_in_range(0..=11u8)?;
        if operation == 11 {
            return self.add_component(u);
        }
        if self.faces.is_empty() {
            return Ok(());
        }
        let f = u.choose_index(self.faces.len())?;
        let k = u.choose_index(self.faces[f].len())?;
        match operation {
            0 | 1 => {
                let face = self.faces.swap_remove(f);
                self.cone(face);
            }
            2 => {
                let face = self.faces.swap_remove(f);
                self.inset(face);
            }
            3 | 4 => {
                let far = u.int_in_range(0..=self.faces[f].len())?;
                self.split_face(f, k, far);
            }
            5 => self.merge_faces(f, k),
            6 => self.contract_side(f, k),
            7 => self.split_side(f, k),
            8 => self.tube(f, k),
            9 => self.dual(),
            _ => self.damage(u, f, k)?,
        }
        Ok(())
    }

    /// Triangles from the sides of a face to a new vertex.
    fn cone(&mut self, face: Vec<u32>) {
        let apex = self.new_vertices(1)[0];
        self.faces.extend((0..face.len()).map(|k| vec![face[k], face[(k + 1) % face.len()], apex]));
    }

    /// A new face within, and quads around it.
    fn inset(&mut self, face: Vec<u32>) {
        let inner = self.new_vertices(face.len());
        self.band(&face, &inner);
        self.faces.push(inner);
    }

    /// Quads between two rims that run the same way.
    fn band(&mut self, outer: &[u32], inner: &[u32]) {
        for k in 0..outer.len() {
            let next = (k + 1) % outer.len();
            self.faces.push(vec![outer[k], outer[next], inner[next], inner[k]]);
        }
    }

    /// A new edge from corner `k` to the one `far` places on. It may join what is joined already.
    fn split_face(&mut self, f: usize, k: usize, far: usize) {
        let face = &mut self.faces[f];
        if (2..face.len() - 1).contains(&far) {
            face.rotate_left(k);
            let rest = face[far..].iter().chain(&face[..1]).copied().collect();
            face.truncate(far + 1);
            self.faces.push(rest);
        }
    }

    /// The face that has side `k` of face `f` the other way round, and the place of that side.
    fn across(&self, f: usize, k: usize) -> Option<(usize, usize)> {
        let [v, w] = self.side(f, k);
        let sides = (0..self.faces.len()).flat_map(|g| (0..self.faces[g].len()).map(move |j| (g, j)));
        sides.filter(|side| side.0 != f).find(|&(g, j)| self.side(g, j) == [w, v])
    }

    fn side(&self, f: usize, k: usize) -> [u32; 2] {
        let face = &self.faces[f];
        [face[k], face[(k + 1) % face.len()]]
    }

    /// The two faces at a side become one.
    fn merge_faces(&mut self, f: usize, k: usize) {
        let Some((g, j)) = self.across(f, k) else { return };
        let mut other = self.faces[g].clone();
        other.rotate_left(j);
        let face = &mut self.faces[f];
        let end = (k + 1) % face.len();
        face.rotate_left(end);
        face.extend(&other[2..]);
        self.faces.swap_remove(g);
    }

    /// The two ends of a side become one vertex; a triangle there becomes an edge.
    fn contract_side(&mut self, f: usize, k: usize) {
        let [v, w] = self.side(f, k);
        self.identify(v, w);
        for face in &mut self.faces {
            face.dedup();
            if face.len() > 1 && face[0] == face[face.len() - 1] {
                face.pop();
            }
        }
        self.faces.retain(|face| face.len() >= 3);
    }

    /// Two vertices become one. The last vertex takes the number that is free.
    fn identify(&mut self, v: u32, w: u32) {
        self.vertices -= 1;
        for x in self.faces.iter_mut().flatten() {
            if *x == w {
                *x = v;
            }
            if *x as usize == self.vertices {
                *x = w;
            }
        }
    }

    /// A new vertex of valence 2.
    fn split_side(&mut self, f: usize, k: usize) {
        let across = self.across(f, k);
        let middle = self.new_vertices(1)[0];
        self.faces[f].insert(k + 1, middle);
        if let Some((g, j)) = across {
            self.faces[g].insert(j + 1, middle);
        }
    }

    /// A tube to the first other face of as many corners: a handle, or a bridge between components.
    fn tube(&mut self, f: usize, k: usize) {
        let apart =
            |face: &Vec<u32>| face.len() == self.faces[f].len() && face.iter().all(|v| !self.faces[f].contains(v));
        let Some(g) = self.faces.iter().position(apart) else { return };
        let mut rims = [f.max(g), f.min(g)].map(|f| self.faces.swap_remove(f));
        rims[0].rotate_left(k);
        rims[1].reverse();
        let [one, other] = rims;
        self.band(&one, &other);
    }

    fn dual(&mut self) {
        let mesh = self.mesh();
        if euler_if_closed(&mesh).is_some() {
            let dual = dual(&mesh);
            self.vertices = dual.len();
            self.faces = dual.faces.iter().map(<[u32]>::to_vec).collect();
        }
    }

    /// What the validator must find.
    fn damage(&mut self, u: &mut Unstructured, f: usize, k: usize) -> Result<()> {
        match u.int_in_range(0..=5u8)? {
            0 => self.faces[f].reverse(),
            1 => drop(self.faces.swap_remove(f)),
            2 => self.faces.push(self.faces[f].clone()),
            3 => self.faces[f][k] = u.int_in_range(0..=self.vertices as u32)?,
            4 => self.vertices += 1,
            _ => {
                let g = u.choose_index(self.faces.len())?;
                let (v, w) = (self.faces[f][k], self.faces[g][0]);
                if v != w {
                    // Two umbrellas at one vertex, if the faces are apart.
                    self.identify(v, w);
                }
            }
        }
        Ok(())
    }
}
