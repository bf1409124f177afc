//! The energies as a sum over elements: a small matrix, which depends on nothing but how the faces about a fine face lie,
//! and the fine vertices that it acts on.
//!
//! A matrix for all entries takes 10 KB a vertex of the given mesh, the elements under 1 KB. Vertices are renumbered, so
//! that those near one another are a block of memory, which a thread takes as a whole with those around it: it works through all
//! elements that touch the block and keeps what they add to the block. An element at the edge of blocks is worked through for
//! each of them, in exchange no two threads write to one place, and sums do not depend on how many there are.

use std::collections::HashMap;
use std::ops::Range;

use glam::DVec3;
use pulp::{Arch, Simd, WithSimd};

use super::energy::{
    Gram, QUARTER, Sectors, StepMasks, WHOLE, Weighted, Weights, patch_grams, pulled_back, regular_patch,
};
use crate::memory::require;
use crate::mesh::Surface;
use crate::mesh::order::{Numbering, Order};
use crate::parallel;
use crate::{Error, Result};

mod product;

use product::{product, stride};

/// Vertices of a block, about: with those around it, which are a tenth, a block and its product stay in the second-level cache.
const BLOCK: usize = 4096;
/// Groups of four fine faces of one task.
const CHUNK: usize = 2048;

/// The elements of one mesh. Points are in the order of the [numbering](Self::there) within.
#[derive(Clone, Debug)]
pub(crate) struct Elements {
    /// For each fine vertex, in the order of the mesh, one of the given mesh.
    owner: Vec<u32>,
    numbering: Numbering,
    kinds: Vec<Kind>,
    blocks: Vec<Block>,
}

/// Elements whose surroundings look alike.
#[derive(Clone, Debug)]
pub(in crate::interpolate) struct Kind {
    points: usize,
    /// Thin plate and membrane: `points` rows of [`stride`] numbers.
    forms: [Vec<f64>; 2],
}

/// Vertices with consecutive numbers, and the elements that touch one of them.
#[derive(Clone, Debug)]
struct Block {
    vertices: Range<usize>,
    /// Other vertices of the elements, ascending.
    around: Vec<u32>,
    /// Kinds with the number of elements of each.
    runs: Vec<(u32, u32)>,
    /// The vertices of the elements, in the order of the runs: places in the block, and then in `around`.
    places: Vec<u16>,
}

/// The vertex of the given mesh that each vertex of the next level belongs to: its own, or that of the least end of its edge
/// or corner of its face. So the 1-ring of a given vertex belongs to it two levels down.
pub(super) fn owners(surface: &Surface, owner: Vec<u32>) -> Vec<u32> {
    let (faces, topology) = (surface.faces(), surface.topology());
    let corners = faces.corners();
    let mut new = owner.clone();
    topology.edge_numbers().extend(&mut new, |c| {
        let ends = [c, topology.incidence.next(faces, c)].map(|c| corners[c as usize]);
        owner[ends[0].min(ends[1]) as usize]
    });
    parallel::extend(&mut new, faces.len(), |_| |f| owner[faces.face(f).iter().copied().min().unwrap_or(0) as usize]);
    new
}

/// What the surroundings of an element look like: how many faces meet at its corners, in numbers of its vertices.
type Signature = Vec<u32>;

/// An element: over a fine face, or over the four of a face of the level before, which have consecutive numbers. Element
/// 5g + k is over face 4g + k, 5g + 4 over all four.
type Element = u32;

/// What elements look like, as far as it can be told without their matrix.
enum Look {
    /// A patch with these sharp sides.
    Patch(usize),
    /// Four patches without any.
    Four,
    /// By its signature.
    Quarters,
}

/// The kinds before those by signature: of patches, and of four.
const FOUR: usize = 16;

/// What tells elements.
#[derive(Default)]
struct Probe {
    /// Of an element that is no patch.
    signature: Signature,
    vertices: Vec<u32>,
    /// The places of vertices after the first [`FEW`].
    more: HashMap<u32, usize>,
}

/// Vertices that are looked through one by one.
const FEW: usize = 64;

impl Probe {
    /// Visits the elements over four faces with all that is known of each.
    fn each(&mut self, fine: &Surface, group: usize, mut visit: impl FnMut(Element, Look, &Probe)) {
        let four = 5 * group as Element + 4;
        if self.look(fine, four).is_some() {
            return visit(four, Look::Four, self);
        }
        for element in four - 4..four {
            if let Some(look) = self.look(fine, element) {
                visit(element, look, self);
            }
        }
    }

    /// Lists the vertices of an element. None if four faces are not one.
    fn look(&mut self, fine: &Surface, element: Element) -> Option<Look> {
        self.vertices.clear();
        let (group, k) = (element as usize / 5, element as usize % 5);
        if k == 4 {
            self.vertices.resize(25, 0);
            for k in 0..4 {
                let patch = regular_patch(fine, 4 * group + k).filter(|patch| patch.sharp == 0)?;
                for (at, v) in patch.points() {
                    self.vertices[of_four(k, at)] = v;
                }
            }
            return Some(Look::Four);
        }
        let f = 4 * group + k;
        if let Some(patch) = regular_patch(fine, f) {
            self.vertices.extend(patch.points().map(|point| point.1));
            return Some(Look::Patch(patch.sharp));
        }
        self.signature.clear();
        self.more.clear();
        let sectors = Sectors { surface: fine };
        let range = fine.faces().range(f);
        // From the corner that is not regular: every vertex of that valence then looks alike.
        let first = range.clone().position(|c| !sectors.is_regular(c as u32)).unwrap_or(0);
        for k in 0..range.len() {
            let start = (range.start + (first + k) % range.len()) as u32;
            let mut corner = start;
            while let Some(c) = sectors.clockwise(corner) {
                corner = c;
                if c == start {
                    break;
                }
            }
            self.signature.extend([sectors.rule(start) as u32, u32::MAX]);
            let from = corner;
            loop {
                let [v, next, opposite, prev] = ring(fine, corner);
                self.mention(v);
                self.mention(next);
                self.mention(opposite);
                match sectors.counter_clockwise(corner) {
                    Some(c) if c == from => {
                        self.signature.push(u32::MAX);
                        break;
                    }
                    Some(c) => corner = c,
                    None => {
                        self.mention(prev);
                        break;
                    }
                }
            }
        }
        Some(Look::Quarters)
    }

    fn mention(&mut self, v: u32) {
        let mut few = self.vertices.iter().take(FEW);
        let place = few.position(|&w| w == v).or_else(|| self.more.get(&v).copied()).unwrap_or_else(|| {
            let place = self.vertices.len();
            self.vertices.push(v);
            if place >= FEW {
                self.more.insert(v, place);
            }
            place
        });
        self.signature.push(place as u32);
    }
}

/// The place among the 5 × 5 points over four faces of a point of the patch over one of them. The k-th has the k-th corner
/// of all four as its first, so that its u turns with k.
fn of_four(k: usize, at: usize) -> usize {
    let (i, j) = (at / 4, at % 4);
    let [i, j] = [[i, j], [4 - j, i], [4 - i, 4 - j], [j, 4 - i]][k];
    5 * i + j
}

/// The corners of a quad from corner `c` on.
fn ring(fine: &Surface, c: u32) -> [u32; 4] {
    let (faces, incidence) = (fine.faces(), fine.incidence());
    let mut c = c;
    std::array::from_fn(|_| {
        let v = faces.corners()[c as usize];
        c = incidence.next(faces, c);
        v
    })
}

impl Kind {
    /// `entry(i, j)`: of thin plate and membrane, symmetric.
    pub(in crate::interpolate) fn new(points: usize, entry: impl Fn(usize, usize) -> [f64; 2]) -> Self {
        let mut forms = [(); 2].map(|()| vec![0.0; points * stride(points)]);
        for i in 0..points {
            for j in 0..points {
                for (form, value) in forms.iter_mut().zip(entry(i, j)) {
                    form[i * stride(points) + j] = value;
                }
            }
        }
        Kind { points, forms }
    }

    fn patch(sharp: usize) -> Self {
        let [thin_plate, membrane] = patch_grams(sharp);
        // Points beyond a sharp side have no piece of the spline.
        let there: Vec<usize> = (0..16).filter(|&k| membrane[k][k] != 0.0).collect();
        Kind::new(there.len(), |i, j| [WHOLE * thin_plate[there[i]][there[j]], membrane[there[i]][there[j]]])
    }

    fn four([thin_plate, membrane]: &[Gram; 2]) -> Self {
        let mut sums = vec![[0.0; 2]; 25 * 25];
        for k in 0..4 {
            for i in 0..16 {
                for j in 0..16 {
                    let sum = &mut sums[25 * of_four(k, i) + of_four(k, j)];
                    sum[0] += WHOLE * thin_plate[i][j];
                    sum[1] += membrane[i][j];
                }
            }
        }
        Kind::new(25, |i, j| sums[25 * i + j])
    }

    /// Of a face that is no patch, from the vertices in the order of its [`Probe`].
    fn quarters(fine: &Surface, masks: &StepMasks, f: usize, vertices: &[u32], grams: &[[Gram; 2]]) -> Self {
        let none: Vec<Weighted> = vertices.iter().map(|&v| (v, [0.0; 16])).collect();
        let mut quarters = Vec::new();
        for c in fine.faces().range(f) {
            let mut local = none.clone();
            if let Some(sharp) = masks.quarter(c as u32, &mut local) {
                debug_assert_eq!(local.len(), none.len(), "a quarter takes vertices about its face");
                quarters.push((sharp, local));
            }
        }
        Kind::new(vertices.len(), |i, j| {
            let mut sums = [0.0; 2];
            for (sharp, local) in &quarters {
                let [thin_plate, membrane] = &grams[*sharp];
                sums[0] += QUARTER * pulled_back(thin_plate, &local[i].1, &local[j].1);
                sums[1] += pulled_back(membrane, &local[i].1, &local[j].1);
            }
            sums
        })
    }
}

/// What is made of a block that is done: of its number, x, and the block of y.
pub(in crate::interpolate) type OfBlock<'a, R> = dyn Fn(usize, &[DVec3], &mut [DVec3]) -> R + Sync + 'a;

impl Elements {
    /// `owner`: for each vertex of `fine` one of the given mesh.
    ///
    /// # Errors
    /// A vertex whose faces have more vertices than fit a block, or whose matrices memory has no room for.
    pub(super) fn new(given: &Surface, fine: &Surface, owner: Vec<u32>) -> Result<Self> {
        /// Of the elements, and of what the iterations keep, a fine vertex.
        const BYTES: u64 = 160;
        let what = || format!("the energy of the surface of {} vertices", given.len());
        require(BYTES * fine.len() as u64, what, "use a coarser mesh, or another method")?;
        let greatest = (0..fine.len()).map(|v| fine.incidence().face_count(v)).max().unwrap_or(0);
        // Two rings, and what the other corners see.
        require_room(2 * greatest + 8, greatest)?;
        let (numbering, ranges) = numbered(given, &owner);
        let block_of = blocks_of(&numbering, &ranges);
        let masks = StepMasks::new(fine);
        let grams: Vec<[Gram; 2]> = (0..16).map(patch_grams).collect();
        // Where each kind occurs first, and which blocks each element touches.
        let found = parallel::map(fine.faces().len() / 4, CHUNK, |range| {
            let mut probe = Probe::default();
            let mut firsts: HashMap<Signature, Element> = HashMap::new();
            let mut touched: Vec<(u32, Element)> = Vec::new();
            for group in range {
                probe.each(fine, group, |element, look, probe| {
                    if matches!(look, Look::Quarters) && !firsts.contains_key(&probe.signature) {
                        firsts.insert(probe.signature.clone(), element);
                    }
                    let start = touched.len();
                    for &v in &probe.vertices {
                        let block = block_of[v as usize];
                        if touched[start..].iter().all(|t| t.0 != block) {
                            touched.push((block, element));
                        }
                    }
                });
            }
            (firsts, touched)
        });
        let mut kinds: Vec<Kind> = (0..FOUR).map(Kind::patch).collect();
        kinds.push(Kind::four(&grams[0]));
        let mut known: HashMap<Signature, u32> = HashMap::new();
        let mut elements_of = vec![Vec::new(); ranges.len()];
        let mut probe = Probe::default();
        for (firsts, touched) in found {
            let mut firsts: Vec<Element> = firsts.into_values().collect();
            firsts.sort_unstable();
            for element in firsts {
                probe.look(fine, element);
                if !known.contains_key(&probe.signature) {
                    known.insert(probe.signature.clone(), kinds.len() as u32);
                    let f = (element / 5 * 4 + element % 5) as usize;
                    kinds.push(Kind::quarters(fine, &masks, f, &probe.vertices, &grams));
                }
            }
            for (block, element) in touched {
                elements_of[block as usize].push(element);
            }
        }
        let blocks = parallel::map(ranges.len(), 1, |k| {
            let mut probe = Probe::default();
            let look = &mut |element, vertices: &mut Vec<u32>| {
                let kind = match probe.look(fine, element)? {
                    Look::Patch(sharp) => sharp as u32,
                    Look::Four => FOUR as u32,
                    Look::Quarters => known[&probe.signature],
                };
                vertices.extend_from_slice(&probe.vertices);
                Some(kind)
            };
            Block::new(ranges[k.start].clone(), &elements_of[k.start], look, &numbering)
        });
        Ok(Elements { owner, numbering, kinds, blocks: blocks.into_iter().collect::<Result<_>>()? })
    }

    /// `count` elements over as many vertices, those that belong to given ones: `list` appends the vertices of an
    /// element, no two of them the same, and tells its kind.
    ///
    /// # Errors
    /// Elements that are too large for a block.
    pub(in crate::interpolate) fn of_list(
        given: &Surface,
        owner: Vec<u32>,
        kinds: Vec<Kind>,
        list: &(dyn Fn(u32, &mut Vec<u32>) -> u32 + Sync),
    ) -> Result<Self> {
        let (numbering, ranges) = numbered(given, &owner);
        let block_of = blocks_of(&numbering, &ranges);
        let touched = parallel::map(owner.len(), CHUNK, |range| {
            let mut touched: Vec<(u32, Element)> = Vec::new();
            let mut vertices = Vec::new();
            for element in range {
                vertices.clear();
                list(element as Element, &mut vertices);
                let start = touched.len();
                for &v in &vertices {
                    let block = block_of[v as usize];
                    if touched[start..].iter().all(|t| t.0 != block) {
                        touched.push((block, element as Element));
                    }
                }
            }
            touched
        });
        let mut elements_of = vec![Vec::new(); ranges.len()];
        touched.into_iter().flatten().for_each(|(block, element)| elements_of[block as usize].push(element));
        let blocks = parallel::map(ranges.len(), 1, |k| {
            let look = &mut |element, vertices: &mut Vec<u32>| Some(list(element, vertices));
            Block::new(ranges[k.start].clone(), &elements_of[k.start], look, &numbering)
        });
        Ok(Elements { owner, numbering, kinds, blocks: blocks.into_iter().collect::<Result<_>>()? })
    }

    /// Values in the order within.
    pub(in crate::interpolate) fn there<T: Copy + Send + Sync>(&self, values: &[T]) -> Vec<T> {
        self.numbering.there(values)
    }

    /// Values in the order of the mesh.
    pub(in crate::interpolate) fn back<T: Copy + Send + Sync>(&self, values: &[T]) -> Vec<T> {
        self.numbering.back(values)
    }

    /// For each fine vertex, in the order within, the point of the given vertex that it belongs to.
    pub(in crate::interpolate) fn spread(&self, points: &[DVec3]) -> Vec<DVec3> {
        let order = self.numbering.order();
        parallel::collect(order.len(), |i| points[self.owner[order[i] as usize] as usize])
    }

    /// The place of each vertex in the order within.
    pub(in crate::interpolate) fn place(&self) -> &[u32] {
        self.numbering.place()
    }

    /// The vertices of the blocks, in the order within.
    pub(in crate::interpolate) fn blocks(&self) -> impl ExactSizeIterator<Item = Range<usize>> + '_ {
        self.blocks.iter().map(|block| block.vertices.clone())
    }

    /// The block of each given vertex, in which all that belongs to it lies.
    pub(super) fn block_of_given(&self) -> Vec<u32> {
        let mut block_of = Vec::new();
        for (k, block) in self.blocks.iter().enumerate() {
            for &v in &self.numbering.order()[block.vertices.clone()] {
                let given = self.owner[v as usize] as usize;
                if block_of.len() <= given {
                    block_of.resize(given + 1, 0);
                }
                block_of[given] = k as u32;
            }
        }
        block_of
    }

    /// The matrices of all kinds for one energy.
    pub(in crate::interpolate) fn weighted(&self, weights: Weights) -> Vec<Vec<f64>> {
        let kinds = self.kinds.iter();
        kinds
            .map(|kind| {
                let [thin_plate, membrane] = &kind.forms;
                let entries = thin_plate.iter().zip(membrane);
                entries.map(|(t, m)| weights.thin_plate * t + weights.membrane * m).collect()
            })
            .collect()
    }

    /// y = K x. When a block of y is done, `then` sees its number, x and the block, and what it makes of them comes back in
    /// the order of the blocks.
    pub(in crate::interpolate) fn apply<R: Send>(
        &self,
        forms: &[Vec<f64>],
        x: &[DVec3],
        y: &mut [DVec3],
        then: &OfBlock<R>,
    ) -> Vec<R> {
        let arch = Arch::new();
        parallel::parts(self.parts(y), |k, part| {
            let block = &self.blocks[k.start];
            let local = block.gather(x);
            let mut sums = vec![[0.0; 3]; local.len()];
            arch.dispatch(Products { elements: self, block, forms, local: &local, sums: &mut sums });
            part.iter_mut().zip(&sums).for_each(|(y, sum)| *y = DVec3::from_array(*sum));
            then(k.start, x, part)
        })
    }

    /// xᵀKx of thin plate and membrane, the elements of faces counted once.
    pub(in crate::interpolate) fn energies(&self, x: &[DVec3]) -> [f64; 2] {
        [[1.0, 0.0], [0.0, 1.0]].map(|[thin_plate, membrane]| {
            let forms = self.weighted(Weights { thin_plate, membrane });
            let mut product = vec![DVec3::ZERO; x.len()];
            let sums = self.apply(&forms, x, &mut product, &|k, x: &[DVec3], y: &mut [DVec3]| {
                let x = &x[self.blocks[k].vertices.clone()];
                x.iter().zip(&*y).map(|(x, y)| x.dot(*y)).sum::<f64>()
            });
            sums.into_iter().sum()
        })
    }

    /// The diagonal of K.
    pub(in crate::interpolate) fn diagonal(&self, forms: &[Vec<f64>]) -> Vec<f64> {
        let mut diagonal = vec![0.0; self.numbering.order().len()];
        parallel::parts(self.parts(&mut diagonal), |k, part| {
            let block = &self.blocks[k.start];
            self.each_element(block, |kind, places| {
                for (i, &place) in places.iter().enumerate() {
                    if let Some(d) = part.get_mut(place as usize) {
                        *d += forms[kind][i * stride(places.len()) + i];
                    }
                }
            });
        });
        diagonal
    }

    /// An array in the order within as the parts of the blocks, with their numbers.
    pub(super) fn parts<'a, T>(&self, mut values: &'a mut [T]) -> Vec<(Range<usize>, &'a mut [T])> {
        let mut parts = Vec::with_capacity(self.blocks.len());
        for (k, block) in self.blocks.iter().enumerate() {
            let (part, rest) = values.split_at_mut(block.vertices.len());
            parts.push((k..k + 1, part));
            values = rest;
        }
        parts
    }

    /// Calls `visit` with the kind and the places of each element that touches a block.
    #[inline(always)]
    fn each_element(&self, block: &Block, mut visit: impl FnMut(usize, &[u16])) {
        let mut places = block.places.as_slice();
        for &(kind, count) in &block.runs {
            let points = self.kinds[kind as usize].points;
            let (of_run, rest) = places.split_at(count as usize * points);
            for places in of_run.chunks_exact(points) {
                visit(kind as usize, places);
            }
            places = rest;
        }
    }
}

impl Block {
    /// `look` appends the vertices of an element, and tells its kind.
    fn new(
        vertices: Range<usize>,
        touching: &[Element],
        look: &mut dyn FnMut(Element, &mut Vec<u32>) -> Option<u32>,
        numbering: &Numbering,
    ) -> Result<Self> {
        let mut elements: Vec<(u32, Range<usize>)> = Vec::with_capacity(touching.len());
        let mut all = Vec::new();
        for &element in touching {
            let start = all.len();
            if let Some(kind) = look(element, &mut all) {
                elements.push((kind, start..all.len()));
            }
        }
        all.iter_mut().for_each(|v| *v = numbering.place()[*v as usize]);
        let is_inside = |v: u32| vertices.contains(&(v as usize));
        let mut around: Vec<u32> = all.iter().copied().filter(|&v| !is_inside(v)).collect();
        around.sort_unstable();
        around.dedup();
        around.shrink_to_fit();
        if vertices.len() + around.len() > usize::from(u16::MAX) {
            return Err(too_great());
        }
        elements.sort_by_key(|e| e.0);
        let mut runs: Vec<(u32, u32)> = Vec::new();
        let mut places = Vec::with_capacity(all.len());
        for (kind, own) in elements {
            match runs.last_mut() {
                Some((last, count)) if *last == kind => *count += 1,
                _ => runs.push((kind, 1)),
            }
            places.extend(all[own].iter().map(|&v| {
                let place = match is_inside(v) {
                    true => v as usize - vertices.start,
                    false => vertices.len() + around.partition_point(|&w| w < v),
                };
                place as u16
            }));
        }
        Ok(Block { vertices, around, runs, places })
    }

    fn gather(&self, x: &[DVec3]) -> Vec<[f64; 3]> {
        let mut local = Vec::with_capacity(self.vertices.len() + self.around.len());
        local.extend(x[self.vertices.clone()].iter().map(|p| p.to_array()));
        local.extend(self.around.iter().map(|&v| x[v as usize].to_array()));
        local
    }
}

/// The order within, and the blocks: the vertices that belong to given ones, which lie along a space-filling curve.
fn numbered(given: &Surface, owner: &[u32]) -> (Numbering, Vec<Range<usize>>) {
    let order = Order::Morton.order(given.mesh(), given.incidence());
    let mut starts = vec![0u32; given.len()];
    owner.iter().for_each(|&v| starts[v as usize] += 1);
    let mut ranges = Vec::new();
    let (mut first, mut next) = (0, 0);
    for v in order {
        let count = starts[v as usize] as usize;
        if next > first && next + count - first > BLOCK {
            ranges.push(first..next);
            first = next;
        }
        starts[v as usize] = next as u32;
        next += count;
    }
    ranges.push(first..next);
    let mut order = vec![0; owner.len()];
    for (w, &v) in (0..).zip(owner) {
        let slot = &mut starts[v as usize];
        order[*slot as usize] = w;
        *slot += 1;
    }
    (Numbering::new(order), ranges)
}

/// The block of each vertex.
fn blocks_of(numbering: &Numbering, ranges: &[Range<usize>]) -> Vec<u32> {
    let mut block_of = vec![0u32; numbering.order().len()];
    for (k, range) in ranges.iter().enumerate() {
        numbering.order()[range.clone()].iter().for_each(|&v| block_of[v as usize] = k as u32);
    }
    block_of
}

fn too_great() -> Error {
    Error::TooLarge {
        what: "the energy about a vertex or face takes more than 65 535 control points".into(),
        advice: "split the face or the vertex of the greatest valence",
    }
}

/// The matrix of an element of so many points, about a vertex or in a face of such a valence.
pub(in crate::interpolate) fn require_room(points: usize, valence: usize) -> Result<()> {
    if points > usize::from(u16::MAX) {
        return Err(too_great());
    }
    // Two forms, and their weighted sum.
    let bytes = 24 * (points * stride(points)) as u64;
    let what = || format!("the energy of the surface about a vertex or in a face of valence {valence}");
    require(bytes, what, "use a mesh of smaller valences")
}

/// K x of all elements that touch a block, to be added to `sums`.
struct Products<'a> {
    elements: &'a Elements,
    block: &'a Block,
    forms: &'a [Vec<f64>],
    local: &'a [[f64; 3]],
    sums: &'a mut [[f64; 3]],
}

impl WithSimd for Products<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let mut own = Vec::new();
        self.elements.each_element(
            self.block,
            #[inline(always)]
            |kind, places| {
                own.clear();
                own.extend(places.iter().map(|&place| self.local[place as usize]));
                product(simd, &self.forms[kind], &own, places, self.sums);
            },
        );
    }
}
