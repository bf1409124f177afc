//! One extraordinary vertex (or face) in a regular surrounding: positions by sector, ring and place, the closed
//! mesh that the refinement rules are applied to, and the walk that finds the same positions after refinement.

use crate::error::{Error, Result};
use crate::mesh::incidence::{next_in, prev_in};
use crate::mesh::{Faces, Surface, Topology};

/// How the n sectors of a star are filled. A position is (sector, i, j): i steps along the sector's first axis,
/// then j towards its second, which is the first axis of the next sector.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layout {
    /// About a vertex, three edges in every direction: ring r has the positions (r−j, j), j < r, of each sector.
    Triangles,
    /// About a vertex: ring r has (r, 0), …, (r, r), (r−1, r), …, (1, r) of each sector.
    Quads,
    /// About a face, valence 4 elsewhere: a position is the corner of a sector's own grid, and ring r, which is
    /// counted from 1, has max(i, j) = r−1.
    QuadsAboutFace,
}

impl Layout {
    /// 1 where the star has a vertex in the middle.
    pub fn centre(self) -> usize {
        usize::from(self != Layout::QuadsAboutFace)
    }

    /// Positions of one sector in this many rings, the middle not counted.
    pub fn orbits(self, rings: usize) -> usize {
        match self {
            Layout::Triangles => rings * (rings + 1) / 2,
            Layout::Quads => rings * (rings + 1),
            Layout::QuadsAboutFace => rings * rings,
        }
    }

    /// Vertices of a star of valence `n`: 1 + 3r(r+1)·n/6, 1 + r(r+1)·n or r²·n.
    pub fn len(self, n: usize, rings: usize) -> usize {
        self.centre() + n * self.orbits(rings)
    }

    /// The number of a position: the middle is 0, then orbit by orbit in ring order, n sectors each. For Quads,
    /// one ring, that is v, e_1…e_n, f_1…f_n with f_j between e_j and e_{j+1}.
    fn index(self, n: usize, sector: usize, i: usize, j: usize) -> u32 {
        let orbit = match self {
            Layout::QuadsAboutFace => {
                let ring = i.max(j);
                ring * ring + around_corner(i, j)
            }
            _ if (i, j) == (0, 0) => return 0,
            // The second axis belongs to the next sector.
            _ if i == 0 => return self.index(n, sector + 1, j, 0),
            Layout::Triangles => {
                let ring = i + j;
                ring * (ring - 1) / 2 + j
            }
            Layout::Quads => {
                let ring = i.max(j);
                ring * (ring - 1) + around_corner(i, j)
            }
        };
        (self.centre() + orbit * n + sector % n) as u32
    }

    /// The number of the position i steps along the first axis of a sector and j towards its second, about the middle of n
    /// sectors, as [`walk`](Self::walk) orders them. One of both may be negative, which is in the sector beside.
    ///
    /// # Panics
    /// If both are negative.
    pub fn position(self, n: usize, sector: usize, i: i64, j: i64) -> u32 {
        let (turn, i, j) = match self {
            // With axes e_s: e_{s+1} = e_s + e_{s+2} and e_s = e_{s+1} + e_{s−1}.
            Layout::Triangles if i < 0 => (1, i + j, -i),
            Layout::Triangles if j < 0 => (n - 1, -j, i + j),
            Layout::Quads if i < 0 => (1, j, -i),
            Layout::Quads if j < 0 => (n - 1, -j, i),
            // (0, 0) lies half a step from both axes.
            Layout::QuadsAboutFace if i < 0 => (1, j, -i - 1),
            Layout::QuadsAboutFace if j < 0 => (n - 1, -j - 1, i),
            Layout::Triangles | Layout::Quads | Layout::QuadsAboutFace => (0, i, j),
        };
        self.index(n, sector + turn, i as usize, j as usize)
    }

    /// The name of position `index`: `v` for the middle, else `sector:i,j`, sectors from 0.
    pub fn label(self, n: usize, index: usize) -> String {
        let Some(rest) = index.checked_sub(self.centre()) else {
            return "v".into();
        };
        let (orbit, sector) = (rest / n, rest % n);
        let inner = (0..).take_while(|&r| self.orbits(r + 1) <= orbit).count();
        let place = orbit - self.orbits(inner);
        let (i, j) = match self {
            Layout::Triangles => (inner + 1 - place, place),
            _ => {
                let ring = inner + self.centre();
                (ring.min(2 * ring - place), place.min(ring))
            }
        };
        format!("{sector}:{i},{j}")
    }

    /// The faces of the disc, counter-clockwise. Corner 0 is the middle, followed by (0, 1, 0); about a face, the
    /// middle face comes first.
    pub fn faces(self, n: usize, rings: usize) -> Faces {
        let mut faces = Faces::default();
        let at = |s, i, j| self.index(n, s, i, j);
        if self == Layout::QuadsAboutFace {
            let middle: Vec<u32> = (0..n).map(|s| at(s, 0, 0)).collect();
            faces.push(&middle);
        }
        for s in 0..n {
            match self {
                Layout::Triangles => {
                    for ring in 0..rings {
                        for j in 0..=ring {
                            let i = ring - j;
                            faces.push(&[at(s, i, j), at(s, i + 1, j), at(s, i, j + 1)]);
                            if i > 0 {
                                faces.push(&[at(s, i, j), at(s, i, j + 1), at(s, i - 1, j + 1)]);
                            }
                        }
                    }
                }
                Layout::Quads | Layout::QuadsAboutFace => {
                    let cells = rings - (1 - self.centre());
                    for i in 0..cells {
                        for j in 0..cells {
                            faces.push(&[at(s, i, j), at(s, i + 1, j), at(s, i + 1, j + 1), at(s, i, j + 1)]);
                        }
                    }
                    if self == Layout::QuadsAboutFace {
                        // The strip between this sector's grid and the next one's.
                        for j in 0..cells {
                            faces.push(&[at(s, 0, j), at(s, 0, j + 1), at(s + 1, j + 1, 0), at(s + 1, j, 0)]);
                        }
                    }
                }
            }
        }
        faces
    }

    /// The outermost ring, counter-clockwise.
    pub fn boundary(self, n: usize, rings: usize) -> Vec<u32> {
        let orbits = self.orbits(rings - 1)..self.orbits(rings);
        (0..n).flat_map(|s| orbits.clone().map(move |o| o * n + s)).map(|i| (self.centre() + i) as u32).collect()
    }

    /// The disc and one vertex more, joined to the outermost ring, which makes it a closed mesh.
    pub fn closed(self, n: usize, rings: usize) -> Faces {
        let mut faces = self.faces(n, rings);
        let apex = self.len(n, rings) as u32;
        let ring = self.boundary(n, rings);
        for (k, &v) in ring.iter().enumerate() {
            faces.push(&[ring[(k + 1) % ring.len()], v, apex]);
        }
        faces
    }

    /// The isoparametric lines of the disc, every `step`-th in each family.
    pub fn lines(self, n: usize, rings: usize, step: usize) -> Vec<Vec<u32>> {
        let at = |s, i, j| self.index(n, s, i, j);
        let mut lines = Vec::new();
        let last = rings - (1 - self.centre());
        for s in 0..n {
            for fixed in (0..=last).step_by(step) {
                match self {
                    Layout::Triangles => {
                        lines.push((0..=last - fixed).map(|j| at(s, fixed, j)).collect());
                        lines.push((0..=last - fixed).map(|i| at(s, i, fixed)).collect());
                        lines.push((0..=fixed).map(|j| at(s, fixed - j, j)).collect());
                    }
                    Layout::Quads | Layout::QuadsAboutFace => {
                        lines.push((0..=last).map(|j| at(s, fixed, j)).collect());
                        lines.push((0..=last).map(|i| at(s, i, fixed)).collect());
                    }
                }
                if self == Layout::QuadsAboutFace {
                    lines.push(vec![at(s, 0, fixed), at(s + 1, fixed, 0)]);
                }
            }
        }
        lines
    }

    /// The vertices of a mesh at the positions of a star, by number, found by walking straight on and turning left
    /// from half-edge `root`: that from the middle to (0, 1, 0), or of the middle face at (0, 0, 0). O(1) a vertex.
    ///
    /// # Errors
    /// [`Error::Computation`] if the walk meets a boundary.
    pub fn walk(self, surface: &Surface, root: u32, n: usize, rings: usize) -> Result<Vec<u32>> {
        let mut found = vec![0; self.len(n, rings)];
        let walker = Walker { faces: surface.faces(), topology: surface.topology() };
        self.try_walk(&walker, root, n, rings, &mut found).ok_or_else(|| {
            Error::Computation(format!("the star of valence {n} has fewer than {rings} rings before a boundary"))
        })?;
        Ok(found)
    }

    fn try_walk(self, walker: &Walker<'_>, root: u32, n: usize, rings: usize, found: &mut [u32]) -> Option<()> {
        let half = if self == Layout::Triangles { 3 } else { 2 };
        if self.centre() == 1 {
            found[0] = walker.origin(root);
        }
        let mut spoke = root;
        for s in 0..n {
            let mut visit = |i, j, v| found[self.index(n, s, i, j) as usize] = v;
            // The half-edge along the first axis, and how far the grid reaches.
            let (mut along, reach) = if self == Layout::QuadsAboutFace {
                let second = walker.clockwise(spoke)?;
                visit(0, 0, walker.origin(spoke));
                walker.line(second, half, rings - 1, |j, v| visit(0, j, v))?;
                (walker.clockwise(second)?, rings - 1)
            } else {
                (spoke, rings)
            };
            for i in 1..=reach {
                if i > 1 {
                    along = walker.straight(along, half)?;
                }
                visit(i, 0, walker.end(along));
                // Only through inner vertices: the last ring may lie on a boundary.
                let columns = if self == Layout::Triangles { reach - i } else { reach };
                if columns > 0 {
                    let left = walker.clockwise(walker.topology.twin(along)?)?;
                    let left = if self == Layout::Triangles { walker.clockwise(left)? } else { left };
                    walker.line(left, half, columns, |j, v| visit(i, j, v))?;
                }
            }
            spoke = if self == Layout::QuadsAboutFace {
                walker.next(spoke)
            } else {
                walker.topology.counter_clockwise(walker.faces, spoke)?
            };
        }
        Some(())
    }
}

/// The place of (i, j) on its ring: (r, 0), …, (r, r), (r−1, r), ….
fn around_corner(i: usize, j: usize) -> usize {
    if i >= j { j } else { 2 * j - i }
}

struct Walker<'a> {
    faces: &'a Faces,
    topology: &'a Topology,
}

impl Walker<'_> {
    fn origin(&self, c: u32) -> u32 {
        self.faces.corners()[c as usize]
    }

    fn next(&self, c: u32) -> u32 {
        next_in(&self.faces.range(self.topology.incidence.face_of(c)), c)
    }

    fn end(&self, c: u32) -> u32 {
        self.origin(self.next(c))
    }

    fn clockwise(&self, c: u32) -> Option<u32> {
        self.topology.clockwise(self.faces, c)
    }

    /// On through the vertex at the end of `c`, which has 2·`half` edges.
    fn straight(&self, c: u32, half: usize) -> Option<u32> {
        let mut back = self.topology.twin(c)?;
        for _ in 0..half {
            let range = self.faces.range(self.topology.incidence.face_of(back));
            back = self.topology.twin(prev_in(&range, back))?;
        }
        Some(back)
    }

    /// Visits the ends of `steps` half-edges in a straight line that starts with `c`, numbered from 1.
    fn line(&self, mut c: u32, half: usize, steps: usize, mut visit: impl FnMut(usize, u32)) -> Option<()> {
        for step in 1..=steps {
            if step > 1 {
                c = self.straight(c, half)?;
            }
            visit(step, self.end(c));
        }
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::mesh::{Incidence, Mesh};

    const LAYOUTS: [Layout; 3] = [Layout::Triangles, Layout::Quads, Layout::QuadsAboutFace];

    #[test]
    fn stars_are_spheres_and_the_walk_finds_every_position() {
        for layout in LAYOUTS {
            for n in [3, 4, 5, 6, 9] {
                for rings in 1..=4 {
                    // One ring more than is walked: the outermost is not regular.
                    let faces = layout.closed(n, rings + 1);
                    let vertices = layout.len(n, rings + 1) + 1;
                    let surface = Surface::new(Mesh::new(vec![DVec3::ZERO; vertices], faces)).expect("closed");
                    assert_eq!(surface.topology().euler_characteristic(surface.faces()), 2);
                    let found = layout.walk(&surface, 0, n, rings).expect("closed");
                    let all: Vec<u32> = (0..layout.len(n, rings) as u32).collect();
                    assert_eq!(found, all, "{layout:?} {n} {rings}");
                }
            }
        }
    }

    #[test]
    fn labels_name_the_positions_in_order() {
        for layout in LAYOUTS {
            let (n, rings) = (5, 4);
            for index in layout.centre()..layout.len(n, rings) {
                let label = layout.label(n, index);
                let numbers: Vec<usize> = label.split([':', ',']).map(|x| x.parse().expect("a number")).collect();
                let &[sector, i, j] = numbers.as_slice() else {
                    panic!("{label}");
                };
                assert_eq!(layout.index(n, sector, i, j) as usize, index, "{layout:?} {label}");
            }
        }
        assert_eq!(Layout::Quads.label(5, 0), "v");
    }

    #[test]
    fn the_inner_vertices_are_regular() {
        for (layout, valence) in [(Layout::Triangles, 6), (Layout::Quads, 4), (Layout::QuadsAboutFace, 4)] {
            let (n, rings) = (5, 3);
            let faces = layout.closed(n, rings);
            let incidence = Incidence::new(&faces, layout.len(n, rings) + 1);
            for v in layout.centre()..layout.len(n, rings - 1) {
                assert_eq!(incidence.face_count(v), valence, "{layout:?} {v}");
            }
            if layout.centre() == 1 {
                assert_eq!(incidence.face_count(0), n);
            }
        }
    }

    #[test]
    fn lines_follow_edges() {
        for layout in LAYOUTS {
            let (n, rings) = (7, 4);
            let faces = layout.faces(n, rings);
            let mut edges = std::collections::HashSet::new();
            for face in faces.iter() {
                for k in 0..face.len() {
                    let (v, w) = (face[k], face[(k + 1) % face.len()]);
                    edges.insert((v.min(w), v.max(w)));
                }
            }
            let mut drawn = std::collections::HashSet::new();
            for line in layout.lines(n, rings, 1) {
                for pair in line.windows(2) {
                    drawn.insert((pair[0].min(pair[1]), pair[0].max(pair[1])));
                }
            }
            assert_eq!(drawn, edges, "{layout:?}");
        }
    }
}
