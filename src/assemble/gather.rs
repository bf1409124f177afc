//! The rows of M and A, gathered from the faces at each vertex, in parallel.

use std::ops::Range;

use rayon::prelude::*;

use crate::error::{Error, Result};
use crate::memory::require;
use crate::mesh::incidence::{next_in, prev_in, split_rows};
use crate::mesh::numbering::{Numbering, rows_back};
use crate::mesh::{Faces, Surface, Topology};
use crate::pages::large;
use crate::parallel;
use crate::schemes::Masks;

/// Rows handed to one task: large enough to pay for it, small enough to share out evenly.
const CHUNK: usize = 8192;

/// For every face size that occurs, what a face adds between a corner and the one k steps further: its
/// circulant, and half of the edge weight at its sides (the other half comes from the face across). Adding
/// the halves face by face, in ascending order of faces, makes M symmetric to the last bit.
pub(super) struct FaceBlocks {
    by_size: Vec<Vec<f64>>,
    half_edge: f64,
    /// Only the corner itself and its two neighbours matter.
    sides_only: bool,
}

impl FaceBlocks {
    pub(super) fn new(faces: &Faces, masks: &impl Masks) -> Self {
        let half_edge = 0.5 * masks.edge_weight();
        let mut by_size: Vec<Vec<f64>> = Vec::new();
        let mut add = |size: usize| {
            if by_size.len() <= size {
                by_size.resize(size + 1, Vec::new());
            }
            if by_size[size].is_empty() {
                by_size[size] = (0..size)
                    .map(|k| {
                        let side = k == 1 || k + 1 == size;
                        masks.face_weight(size, k) + if side { half_edge } else { 0.0 }
                    })
                    .collect();
            }
        };
        match faces.uniform_size() {
            Some(size) => add(size),
            None => faces.iter().for_each(|face| add(face.len())),
        }
        FaceBlocks { by_size, half_edge, sides_only: masks.edges_only() }
    }
}

/// What the rows are made from.
pub(super) struct Gather<'a> {
    faces: &'a Faces,
    topology: &'a Topology,
    blocks: &'a FaceBlocks,
    /// The entry of H and the vertex weight.
    by_valence: &'a [[f64; 2]],
    valence: &'a [u32],
    /// Every side at a vertex that has a row of its own has a twin.
    closed: bool,
    /// Where the faces are in another order than the rows, which are wanted in that of the file: the way to it.
    numbering: Option<&'a Numbering>,
}

/// All rows of M and A.
pub(super) struct Arrays {
    pub(super) offsets: Vec<u32>,
    pub(super) columns: Vec<u32>,
    pub(super) m: Vec<f64>,
    pub(super) a: Vec<f64>,
    pub(super) diagonal: Vec<f64>,
}

/// One row while it is made.
#[derive(Default)]
struct Row {
    /// Column in the upper half; in the lower the place of the contribution, which keeps the contributions to one
    /// entry in the order of faces.
    keys: Vec<u64>,
    contributions: Vec<f64>,
    columns: Vec<u32>,
    values: Vec<f64>,
    /// The place of the diagonal entry.
    own: usize,
    short: Short,
}

impl Row {
    #[inline]
    fn add(&mut self, column: u32, value: f64) {
        let key = u64::from(column) << 32 | self.contributions.len() as u64;
        self.keys.push(key);
        self.contributions.push(value);
    }

    /// One entry, on the diagonal.
    fn unit(&mut self, row: usize, value: f64) {
        self.columns.clear();
        self.columns.push(row as u32);
        self.values.clear();
        self.values.push(value);
        self.own = 0;
    }

    /// Sums the contributions to each entry.
    fn sum(&mut self, row: usize) {
        self.keys.sort_unstable();
        self.columns.clear();
        self.values.clear();
        let mut last = None;
        for &key in &self.keys {
            let column = (key >> 32) as u32;
            let value = self.contributions[key as u32 as usize];
            if last == Some(column) {
                if let Some(sum) = self.values.last_mut() {
                    *sum += value;
                }
                continue;
            }
            if column as usize == row {
                self.own = self.columns.len();
            }
            self.columns.push(column);
            self.values.push(value);
            last = Some(column);
        }
    }
}

/// Entries of a short row, sorted by counting for each how many are smaller: no branch depends on their order, for which
/// there is no pattern that a processor could foresee.
#[derive(Default)]
struct Short {
    /// Columns, in an order that signed numbers have; beyond the length the greatest.
    columns: [i32; Self::MOST],
    values: [f64; Self::MOST],
    /// Of all entries that were added, also of those that found no room.
    len: usize,
}

impl Short {
    const MOST: usize = 24;
    /// Compared at once.
    const LANES: usize = 8;
    const SIGN: u32 = 1 << 31;

    fn clear(&mut self) {
        self.len = 0;
    }

    #[inline]
    fn add(&mut self, column: u32, value: f64) {
        if self.len < Self::MOST {
            self.columns[self.len] = (column ^ Self::SIGN) as i32;
            self.values[self.len] = value;
        }
        self.len += 1;
    }

    /// Writes the entries in order and returns the place of the one that was added last, unless they are too many or
    /// two have the same column.
    #[inline]
    fn sort_into(&mut self, columns: &mut Vec<u32>, values: &mut Vec<f64>) -> Option<usize> {
        let n = self.len;
        if n > Self::MOST {
            return None;
        }
        self.columns[n..].fill(i32::MAX);
        columns.resize(n, 0);
        values.resize(n, 0.0);
        let lanes = n.next_multiple_of(Self::LANES);
        let (mut met, mut place) = (0u32, 0);
        for (&column, &value) in self.columns[..n].iter().zip(&self.values) {
            let mut smaller = [0; Self::LANES];
            for others in self.columns[..lanes].as_chunks::<{ Self::LANES }>().0 {
                for (smaller, &other) in smaller.iter_mut().zip(others) {
                    *smaller += i32::from(other < column);
                }
            }
            place = smaller.iter().sum::<i32>() as usize;
            columns[place] = column as u32 ^ Self::SIGN;
            values[place] = value;
            met |= 1 << place;
        }
        (met.count_ones() as usize == n).then_some(place)
    }
}

/// Moves rows that are shorter than their place together by `shift(from, to)`, in ascending order, and returns the
/// new end.
fn close_gaps(offsets: &mut [u32], lengths: &[u32], mut shift: impl FnMut(Range<usize>, usize)) -> usize {
    let mut end = 0;
    for (offset, &length) in offsets.iter_mut().zip(lengths) {
        let start = *offset as usize;
        if start != end {
            shift(start..start + length as usize, end);
        }
        *offset = end as u32;
        end += length as usize;
    }
    offsets[lengths.len()] = end as u32;
    end
}

impl<'a> Gather<'a> {
    /// Valences are those of the faces that the rows are made from: as they are [renumbered](Surface::renumbered) inside, if
    /// they are.
    pub(super) fn new(
        surface: &'a Surface,
        blocks: &'a FaceBlocks,
        by_valence: &'a [[f64; 2]],
        valence: &'a [u32],
    ) -> Self {
        let (faces, topology, numbering) = match surface.renumbered() {
            Some(inside) => (&inside.faces, inside.topology(), Some(&inside.numbering)),
            None => (surface.faces(), surface.topology(), None),
        };
        let closed = surface.is_closed() || surface.features().is_some();
        Gather { faces, topology, blocks, by_valence, valence, closed, numbering }
    }

    /// The column of vertex `v`.
    #[inline]
    fn column(&self, v: u32) -> u32 {
        self.numbering.map_or(v, |numbering| numbering.order()[v as usize])
    }

    /// All rows.
    ///
    /// # Errors
    /// More than 2³² − 1 entries, or than memory has room for.
    pub(super) fn arrays(&self) -> Result<Arrays> {
        let mut lengths = self.greatest_lengths();
        let mut offsets = parallel::offsets(lengths.len(), |i| lengths[i]).map_err(|total| Error::TooLarge {
            what: format!("the matrix would have {total} entries"),
            advice: "use a smaller mesh or one without very large faces",
        })?;
        let end = offsets[lengths.len()];
        let total = u64::from(end);
        // A column and a value of M and of A each, and numbers for every row. To be put in order, the first two twice.
        let each = if self.numbering.is_some() { 32 } else { 20 };
        let bytes = total * each + lengths.len() as u64 * 24;
        let what = || format!("the matrix with {total} entries");
        require(
            bytes,
            what,
            "use a smaller mesh or one without very large faces, or a method without a stored matrix",
        )?;
        let mut columns = large(vec![0u32; end as usize]);
        let mut m = large(vec![0.0; end as usize]);
        // Rows that will be put in order have their part of A then.
        let mut a = if self.numbering.is_some() { Vec::new() } else { large(vec![0.0; end as usize]) };
        let mut diagonal = large(vec![0.0; lengths.len()]);
        let a_parts: Vec<&mut [f64]> = match self.numbering {
            Some(_) => (0..lengths.len()).step_by(CHUNK).map(|_| Default::default()).collect(),
            None => split_rows(&offsets, CHUNK, &mut a).into_iter().map(|(_, a)| a).collect(),
        };
        let parts = split_rows(&offsets, CHUNK, &mut columns)
            .into_par_iter()
            .zip(split_rows(&offsets, CHUNK, &mut m))
            .zip(a_parts)
            .zip(diagonal.par_chunks_mut(CHUNK))
            .zip(lengths.par_chunks_mut(CHUNK));
        parts.for_each_init(Row::default, |row, parts| {
            let (((((rows, columns), (_, m)), a), diagonal), lengths) = parts;
            let first = offsets[rows.start] as usize;
            for ((v, diagonal), length) in rows.zip(diagonal).zip(lengths) {
                self.row(v, row);
                let h = self.by_valence[self.valence[v] as usize][0];
                *diagonal = h * row.values[row.own];
                let start = offsets[v] as usize - first;
                let range = start..start + row.columns.len();
                assert!(row.columns.len() <= *length as usize, "the longest rows of a manifold");
                columns[range.clone()].copy_from_slice(&row.columns);
                m[range.clone()].copy_from_slice(&row.values);
                for (a, m) in a.get_mut(range).unwrap_or_default().iter_mut().zip(&row.values) {
                    *a = h * m;
                }
                *length = row.columns.len() as u32;
            }
        });
        if let Some(numbering) = self.numbering {
            return Ok(self.in_file_order(numbering, (&offsets, &lengths), columns, m, &diagonal));
        }
        let filled = close_gaps(&mut offsets, &lengths, |from, to| {
            columns.copy_within(from.clone(), to);
            m.copy_within(from.clone(), to);
            a.copy_within(from, to);
        });
        columns.truncate(filled);
        m.truncate(filled);
        a.truncate(filled);
        Ok(Arrays { offsets, columns, m, a, diagonal })
    }

    /// The rows in the order of the file; `starts` and `lengths` tell where they are.
    fn in_file_order(
        &self,
        numbering: &Numbering,
        (starts, lengths): (&[u32], &[u32]),
        columns: Vec<u32>,
        m: Vec<f64>,
        diagonal: &[f64],
    ) -> Arrays {
        let place = numbering.place();
        let offsets = parallel::offsets(place.len(), |v| lengths[place[v] as usize]);
        let offsets = offsets.expect("as many entries as before");
        let moved = rows_back(numbering, &columns, starts, &offsets);
        drop(columns);
        let columns = moved;
        let moved = rows_back(numbering, &m, starts, &offsets);
        drop(m);
        let m = moved;
        let mut a = large(vec![0.0; m.len()]);
        parallel::parts(split_rows(&offsets, CHUNK, &mut a), |rows, mut part| {
            for v in rows {
                let h = self.by_valence[self.valence[place[v] as usize] as usize][0];
                let m = &m[offsets[v] as usize..offsets[v + 1] as usize];
                let (row, rest) = part.split_at_mut(m.len());
                row.iter_mut().zip(m).for_each(|(a, m)| *a = h * m);
                part = rest;
            }
        });
        Arrays { offsets, columns, m, a, diagonal: numbering.back(diagonal) }
    }

    /// The greatest length of every row on a manifold, attained where faces share an edge or a vertex at most.
    fn greatest_lengths(&self) -> Vec<u32> {
        let incidence = &self.topology.incidence;
        let length = |v: usize| {
            let edges = self.valence[v];
            if self.blocks.sides_only || edges == 0 {
                return edges + 1;
            }
            let at = incidence.corners_at(v);
            let others = at.iter().map(|&c| {
                let size = self.faces.range(incidence.face_of(c)).len() as u32;
                size.saturating_sub(3)
            });
            edges + 1 + others.sum::<u32>()
        };
        parallel::collect(self.valence.len(), length)
    }

    /// Row `v` of M on a closed mesh, if it is short and no vertex occurs twice in the faces at `v` but by their common
    /// edges: the same entries to the last bit, with half the contributions. Otherwise `false`.
    fn usual_row(&self, v: usize, row: &mut Row) -> bool {
        let (faces, incidence, blocks) = (self.faces, &self.topology.incidence, self.blocks);
        let (corners, twins) = (faces.corners(), self.topology.twins());
        let block_at = |c: u32| {
            let range = faces.range(incidence.face_of(c));
            (&blocks.by_size[range.len()], range)
        };
        let short = &mut row.short;
        short.clear();
        let [_, mut own] = self.by_valence[self.valence[v] as usize];
        for &c in incidence.corners_at(v) {
            let (block, range) = block_at(c);
            if block.len() < 3 {
                return false;
            }
            own += block[0];
            // Both halves of the edge that leaves; the one that enters leaves in another face.
            let (across, _) = block_at(twins[c as usize]);
            let mut other = next_in(&range, c);
            short.add(self.column(corners[other as usize]), block[1] + across[across.len() - 1]);
            if !blocks.sides_only {
                for &weight in &block[2..block.len() - 1] {
                    other = next_in(&range, other);
                    short.add(self.column(corners[other as usize]), weight);
                }
            }
        }
        short.add(self.column(v as u32), own);
        let sorted = short.sort_into(&mut row.columns, &mut row.values);
        row.own = sorted.unwrap_or(0);
        sorted.is_some()
    }

    /// Row `v` of M.
    fn row(&self, v: usize, row: &mut Row) {
        if self.valence[v] == 0 {
            return row.unit(self.column(v as u32) as usize, self.by_valence[0][1]);
        }
        if self.closed && self.usual_row(v, row) {
            return;
        }
        let (faces, topology, blocks) = (self.faces, self.topology, self.blocks);
        let corners = faces.corners();
        let has_boundary = topology.boundary_edges() > 0;
        row.keys.clear();
        row.contributions.clear();
        let [_, mut own] = self.by_valence[self.valence[v] as usize];
        for &c in topology.incidence.corners_at(v) {
            let range = faces.range(topology.incidence.face_of(c));
            let block = &blocks.by_size[range.len()];
            own += block[0];
            let (next, prev) = (next_in(&range, c), prev_in(&range, c));
            if blocks.sides_only {
                row.add(self.column(corners[next as usize]), block[1]);
                row.add(self.column(corners[prev as usize]), block[range.len() - 1]);
            } else {
                let place = c as usize - range.start;
                let face = &corners[range];
                for (&w, &weight) in face[place + 1..].iter().zip(&block[1..]) {
                    row.add(self.column(w), weight);
                }
                for (&w, &weight) in face[..place].iter().zip(&block[block.len() - place..]) {
                    row.add(self.column(w), weight);
                }
            }
            if has_boundary {
                // A side without a face across it brings the edge's other half itself.
                for (side, end) in [(c, next), (prev, prev)] {
                    if topology.twin(side).is_none() {
                        row.add(self.column(corners[end as usize]), blocks.half_edge);
                    }
                }
            }
        }
        let column = self.column(v as u32);
        row.add(column, own);
        row.sum(column as usize);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assemble::stages::free;
    use crate::assemble::system::{rows_of, valences};
    use crate::mesh::Mesh;
    use crate::mesh::builtin::builtin;
    use crate::mesh::features::Tags;
    use crate::mesh::random::{random_creased, random_polygons, random_triangulation};
    use crate::schemes::{Masks, Scheme};

    /// How many rows of M are made the usual way, after comparing them with those made the general way.
    fn usual_rows(mesh: &Mesh, scheme: Scheme) -> usize {
        let surface = Surface::new(mesh.clone()).unwrap();
        assert!(surface.is_closed());
        let valence = valences(&surface);
        let most = valence.iter().max().map_or(0, |&n| n as usize);
        let by_valence: Vec<[f64; 2]> = (0..=most).map(|n| [scheme.h(n), scheme.vertex_weight(n)]).collect();
        let blocks = FaceBlocks::new(&mesh.faces, &scheme);
        let mut rows = Gather::new(&surface, &blocks, &by_valence, &valence);
        rows.closed = false;
        let (mut usual, mut general) = (Row::default(), Row::default());
        let same = |v: &usize| {
            let taken = rows.usual_row(*v, &mut usual);
            if taken {
                rows.row(*v, &mut general);
                assert_eq!(usual.columns, general.columns, "{scheme}, row {v}");
                let bits = |row: &Row| row.values.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
                assert_eq!(bits(&usual), bits(&general), "{scheme}, row {v}");
                assert_eq!(usual.own, general.own);
            }
            taken
        };
        (0..mesh.len()).filter(same).count()
    }

    #[test]
    fn usual_rows_are_the_general_ones_to_the_last_bit() {
        let quads = builtin("irregular-quad:2000").unwrap();
        let polygons = builtin("irregular-poly:2000").unwrap();
        let triangles = builtin("irregular-tri:2000").unwrap();
        for scheme in Scheme::ALL {
            if scheme.needs_triangles() {
                assert!(usual_rows(&triangles, scheme) > triangles.len() * 9 / 10);
            } else {
                assert!(usual_rows(&quads, scheme) > quads.len() * 9 / 10);
                assert!(usual_rows(&polygons, scheme) > polygons.len() / 2);
            }
            // Several components, large faces, large valences.
            for seed in 0..20 {
                let triangles = random_triangulation(seed);
                assert!(usual_rows(&triangles, scheme) > triangles.len() / 2);
                if !scheme.needs_triangles() {
                    assert!(usual_rows(&random_polygons(seed), scheme) > 0);
                }
            }
        }
    }

    #[test]
    fn rows_made_in_another_order_are_those_of_the_file_to_the_last_bit() {
        let mut meshes = 0;
        for seed in 0..20 {
            for closed in [random_polygons(seed), random_triangulation(seed)] {
                let whole = (Surface::new(closed.clone()).unwrap(), Tags::default());
                for (surface, tags) in std::iter::once(whole).chain(random_creased(&closed, seed)) {
                    let inside = Surface::scattered(surface.mesh().clone(), tags.boundary);
                    let inside = if tags == Tags::default() { inside } else { inside.tagged(&tags).unwrap() };
                    assert!(inside.renumbered().is_some());
                    let free = free(&surface, None).unwrap();
                    let suits = |scheme: &Scheme| scheme.first_unsuitable_face(surface.faces()).is_none();
                    for scheme in Scheme::ALL.into_iter().filter(suits) {
                        let [expected, found] =
                            [&surface, &inside].map(|surface| rows_of(surface, &scheme, free.as_deref()).unwrap());
                        let what = format!("{scheme}, seed {seed}, {} vertices", surface.len());
                        assert!(found.m == expected.m && found.a == expected.a, "{what}");
                        assert!(found.h == expected.h && found.diagonal == expected.diagonal, "{what}");
                    }
                    meshes += 1;
                }
            }
        }
        assert!(meshes > 50);
    }

    #[test]
    fn long_rows_are_left_to_the_general_way() {
        // The two apexes have too long rows, the others meet both apexes and their neighbours on the rim.
        let bipyramid = builtin("bipyramid:40").unwrap();
        assert_eq!(usual_rows(&bipyramid, Scheme::Loop), 40);
    }
}
