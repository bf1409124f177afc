//! The reverse order of Cuthill and McKee (1969), with the start of George and Liu (1979).

use super::{Faces, Incidence};

/// Breadth first from a pseudo-peripheral vertex of every component, neighbours by ascending degree, all in reverse.
/// O(corners), but for the sort of the neighbours of each vertex.
pub(super) fn reverse_cuthill_mckee(faces: &Faces, incidence: &Incidence) -> Vec<u32> {
    Search::new(faces, incidence).order()
}

/// Searches over vertices that share a face. Every face is opened once, so large faces cost no more than their
/// corners. (The reverse Cuthill-McKee of sprs looks for each component's start among all vertices,
/// which is quadratic for many components, and needs an assembled matrix.)
struct Search<'a> {
    faces: &'a Faces,
    incidence: &'a Incidence,
    /// The last search that met the vertex or face.
    vertex_seen: Vec<u32>,
    face_seen: Vec<u32>,
    round: u32,
}

impl<'a> Search<'a> {
    fn new(faces: &'a Faces, incidence: &'a Incidence) -> Self {
        Search {
            faces,
            incidence,
            vertex_seen: vec![0; incidence.vertices()],
            face_seen: vec![0; faces.len()],
            round: 0,
        }
    }

    /// Appends the unseen neighbours of `v`.
    fn visit(&mut self, v: u32, queue: &mut Vec<u32>) {
        for &c in self.incidence.corners_at(v as usize) {
            let f = self.incidence.face_of(c);
            if self.face_seen[f] == self.round {
                continue;
            }
            self.face_seen[f] = self.round;
            for &w in self.faces.face(f) {
                if self.vertex_seen[w as usize] != self.round {
                    self.vertex_seen[w as usize] = self.round;
                    queue.push(w);
                }
            }
        }
    }

    fn order(mut self) -> Vec<u32> {
        let n = self.incidence.vertices();
        // On a closed mesh whose faces share an edge or a vertex at most: the number of neighbours.
        let degree: Vec<u32> = (0..n)
            .map(|v| {
                let faces = self.incidence.corners_at(v).iter();
                faces
                    .map(|&c| self.faces.range(self.incidence.face_of(c)).len() as u32)
                    .map(|size| size.saturating_sub(2))
                    .sum()
            })
            .collect();
        let mut order: Vec<u32> = Vec::with_capacity(n);
        let mut placed = vec![false; n];
        let mut levels = Vec::new();
        for seed in 0..n as u32 {
            if placed[seed as usize] {
                continue;
            }
            let start = self.pseudo_peripheral(seed, &degree, &mut levels);
            self.round += 1;
            self.vertex_seen[start as usize] = self.round;
            let mut next = order.len();
            order.push(start);
            while next < order.len() {
                let v = order[next];
                placed[v as usize] = true;
                let new = order.len();
                self.visit(v, &mut order);
                order[new..].sort_unstable_by_key(|&w| (degree[w as usize], w));
                next += 1;
            }
        }
        order.reverse();
        order
    }

    /// A vertex far from others: from `seed`, moves to a vertex of least degree in the last level of the search
    /// as long as that gives more levels.
    fn pseudo_peripheral(&mut self, seed: u32, degree: &[u32], level: &mut Vec<u32>) -> u32 {
        // The number of levels grows with each round; two or three are usual, and this bounds the time.
        const ROUNDS: usize = 8;
        let mut start = seed;
        let mut height = 0;
        for _ in 0..ROUNDS {
            self.round += 1;
            self.vertex_seen[start as usize] = self.round;
            level.clear();
            level.push(start);
            let (mut first, mut levels) = (0, 1);
            loop {
                let end = level.len();
                for k in first..end {
                    self.visit(level[k], level);
                }
                if level.len() == end {
                    break;
                }
                first = end;
                levels += 1;
            }
            if levels <= height {
                break;
            }
            height = levels;
            let last = level[first..].iter().copied();
            let Some(far) = last.min_by_key(|&v| (degree[v as usize], v)) else {
                break;
            };
            start = far;
        }
        start
    }
}
