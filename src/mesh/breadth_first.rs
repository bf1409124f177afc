//! Breadth-first vertex orders for sweeps over many rows, and orders that put rows of one kind together.

use std::ops::Range;

use super::numbering::Numbering;
use super::{Faces, Incidence};
use crate::pages::large;
use crate::parallel;
use crate::prefetch::prefetch;

/// One bit for each of some things: whether it was met.
struct Met(Vec<u64>);

impl Met {
    fn new(count: usize) -> Self {
        Met(vec![0; count.div_ceil(64)])
    }

    /// Whether this is the first time.
    #[inline]
    fn meet(&mut self, k: usize) -> bool {
        let bit = 1u64 << (k % 64);
        let word = &mut self.0[k / 64];
        let first = *word & bit == 0;
        *word |= bit;
        first
    }
}

/// The vertices breadth first from the first of every component, over faces. Each face is opened once: O(corners).
pub fn breadth_first(faces: &Faces, incidence: &Incidence) -> Vec<u32> {
    // Among triangles, and among quads, a corner's face takes no look-up.
    match faces.uniform_size() {
        Some(3) => search(faces, incidence, |c| (c / 3, c / 3 * 3..c / 3 * 3 + 3)),
        Some(4) => search(faces, incidence, |c| (c / 4, c / 4 * 4..c / 4 * 4 + 4)),
        _ => search(faces, incidence, |c| {
            let f = incidence.face_of(c as u32);
            (f, faces.range(f))
        }),
    }
}

/// The queue of a breadth-first search, which is the order in the end: the first vertices have left it.
struct Queue {
    met: Met,
    // One place more, for what is written there and not kept.
    order: Vec<u32>,
    next: usize,
    end: usize,
}

impl Queue {
    /// All vertices, from the first of every component: `visit(queue, k)` lets in the neighbours of the vertex at place k.
    #[inline]
    fn search(vertices: usize, mut visit: impl FnMut(&mut Queue, usize)) -> Vec<u32> {
        let mut queue = Queue { met: Met::new(vertices), order: large(vec![0; vertices + 1]), next: 0, end: 0 };
        for seed in 0..vertices as u32 {
            queue.let_in(seed);
            while queue.next < queue.end {
                let k = queue.next;
                queue.next += 1;
                visit(&mut queue, k);
            }
        }
        queue.order.truncate(vertices);
        queue.order
    }

    /// Lets a vertex in that was not met yet. No branch on what was met: there is no pattern that a processor could predict.
    #[inline]
    fn let_in(&mut self, v: u32) {
        self.order[self.end] = v;
        self.end += usize::from(self.met.meet(v as usize));
    }
}

fn search(faces: &Faces, incidence: &Incidence, face_at: impl Fn(usize) -> (usize, Range<usize>)) -> Vec<u32> {
    let mut opened = Met::new(faces.len());
    Queue::search(incidence.vertices(), |queue, k| {
        // Places of the queue that are not taken yet hold a vertex too.
        incidence.fetch_ahead(faces, &queue.order, k);
        for &c in incidence.corners_at(queue.order[k] as usize) {
            let (f, range) = face_at(c as usize);
            if opened.meet(f) {
                faces.corners()[range].iter().for_each(|&w| queue.let_in(w));
            }
        }
    })
}

/// The vertices breadth first from the first of every component, over lists of neighbours, those of v from `starts[v]` on.
fn along(starts: &[u32], neighbours: &[u32]) -> Vec<u32> {
    /// Vertices between one look-up and the next. Tuned.
    const AHEAD: usize = 12;
    let row = |v: u32| starts[v as usize] as usize..starts[v as usize + 1] as usize;
    Queue::search(starts.len() - 1, |queue, k| {
        if let Some(&v) = queue.order.get(k + 2 * AHEAD) {
            prefetch(starts, v as usize);
        }
        if let Some(&v) = queue.order.get(k + AHEAD) {
            let row = row(v);
            prefetch(neighbours, row.start);
            prefetch(neighbours, row.end);
        }
        neighbours[row(queue.order[k])].iter().for_each(|&w| queue.let_in(w));
    })
}

/// An order for sweeps that share passes over memory: breadth first, so that neighbours lie within a narrow band, and [rows of
/// one kind](in_kinds) together.
///
/// Among triangles the search goes along their sides, each from the vertex that it leaves: on a closed mesh they leave both of
/// their ends, and the levels are those of [`breadth_first`]. Listed by all threads before, that is half the work of the
/// search, which is one thread's.
pub fn in_fronts(faces: &Faces, incidence: &Incidence) -> Numbering {
    if faces.uniform_size() != Some(3) {
        return grouped(faces, incidence, breadth_first(faces, incidence));
    }
    let (corners, at) = (faces.corners(), incidence.corners());
    let mut ends = large(Vec::with_capacity(at.len()));
    parallel::extend(&mut ends, at.len(), |_| |k| corners[incidence.next(faces, at[k]) as usize]);
    in_fronts_along(faces, incidence, (incidence.offsets(), &ends))
}

/// As [`in_fronts`], along lists of neighbours, those of v from `starts[v]` on.
pub(crate) fn in_fronts_along(
    faces: &Faces,
    incidence: &Incidence,
    (starts, neighbours): (&[u32], &[u32]),
) -> Numbering {
    grouped(faces, incidence, along(starts, neighbours))
}

fn grouped(faces: &Faces, incidence: &Incidence, mut order: Vec<u32>) -> Numbering {
    group_kinds(faces, incidence, &mut order);
    Numbering::new(order)
}

/// The file's order, but with rows of one kind together: each 256 consecutive vertices by their number of faces and the
/// kind of these. Few enough to leave neighbours near, enough for a branch predictor (tuned). `None` where the file is
/// like this already. O(corners), in parallel.
pub fn in_kinds(faces: &Faces, incidence: &Incidence) -> Option<Numbering> {
    let mut order: Vec<u32> = (0..incidence.vertices() as u32).collect();
    group_kinds(faces, incidence, &mut order);
    (!order.is_sorted()).then(|| Numbering::new(order))
}

/// Sorts each 256 consecutive vertices by valence, those among triangles, among quads and among others apart. Those of
/// one kind are left as they come.
fn group_kinds(faces: &Faces, incidence: &Incidence, order: &mut [u32]) {
    const GROUP: usize = 256;
    /// Vertices between a look-up and the one that is fetched for it.
    const AHEAD: usize = 16;
    /// Larger valences count as one.
    const MOST: usize = 63;
    let uniform = faces.uniform_size();
    // One bit for each size that occurs.
    let bit = |size: usize| 1u32 << size.min(31);
    let key = |v: u32| {
        let at = incidence.corners_at(v as usize);
        let n = at.len().min(MOST);
        let sizes = at.iter().map(|&c| faces.range(incidence.face_of(c)).len());
        let met = uniform.map_or_else(|| sizes.fold(0, |met, size| met | bit(size)), bit);
        // Triangles only, quads only, others.
        let kinds = u32::from(met != bit(3)) + u32::from(met != bit(3) && met != bit(4));
        kinds as usize * (MOST + 1) + n
    };
    parallel::chunks(order, GROUP, |_, group| {
        let mut vertices = [(0, 0); GROUP];
        let vertices = &mut vertices[..group.len()];
        let mut starts = [0; 3 * (MOST + 1) + 1];
        for (k, (slot, &v)) in vertices.iter_mut().zip(&*group).enumerate() {
            if let Some(&later) = group.get(k + AHEAD) {
                prefetch(incidence.offsets(), later as usize);
            }
            *slot = (v, key(v));
            starts[slot.1 + 1] += 1;
        }
        for k in 1..starts.len() {
            starts[k] += starts[k - 1];
        }
        for &(v, key) in &*vertices {
            group[starts[key]] = v;
            starts[key] += 1;
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::builtin;

    #[test]
    fn rows_of_one_kind_come_together_and_stay_near() {
        for name in ["irregular-tri:1000", "irregular-poly:1000"] {
            let mesh = builtin::builtin(name).unwrap();
            let incidence = Incidence::new(&mesh.faces, mesh.len());
            let numbering = in_kinds(&mesh.faces, &incidence).unwrap();
            // The valence, and the size of the faces where all are triangles or quads.
            let kind = |v: &u32| {
                let at = incidence.corners_at(*v as usize);
                let size = |c: u32| mesh.faces.face(incidence.face_of(c)).len();
                let alike = [3, 4].into_iter().find(|&m| at.iter().all(|&c| size(c) == m));
                (at.len(), alike)
            };
            let changes = |order: &[u32]| {
                let pairs = order.windows(2);
                pairs.filter(|w| kind(&w[0]) != kind(&w[1])).count()
            };
            let file: Vec<u32> = (0..mesh.len() as u32).collect();
            assert!(4 * changes(numbering.order()) < changes(&file), "{name}");
            for (block, from) in numbering.order().chunks(256).zip(file.chunks(256)) {
                let mut block = block.to_vec();
                block.sort_unstable();
                assert_eq!(block, from, "{name}: the same vertices");
            }
            let values: Vec<u32> = numbering.there(&file);
            let mut back = vec![0; file.len()];
            numbering.back_into(&values, &mut back);
            assert_eq!(back, file);
        }
        let regular = builtin::builtin("torus:20x20").unwrap();
        let incidence = Incidence::new(&regular.faces, regular.len());
        assert!(in_kinds(&regular.faces, &incidence).is_none());
    }
}
