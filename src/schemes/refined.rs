//! The topology of a refined mesh, by index arithmetic on that of the coarse one: nothing is searched or sorted but
//! the four to six corners at a new vertex. Equal to [`Topology::new`] of the result, entry by entry.
//!
//! Half-edge c leaves corner c; t is its twin, V, E, F, C count the coarse mesh's vertices, edges, faces, corners. On a
//! valid mesh no two faces share more than one edge (the vertex between two would have valence 2), and no face has the
//! same one twice (it would name a vertex twice), so that no two new edges have the same ends, and the refined mesh is
//! valid too.

use super::star::{next_in_triangle, prev_in_triangle, stars};
use crate::mesh::incidence::split_rows;
use crate::mesh::topology::{NONE, Scatter};
use crate::mesh::{Incidence, Mesh, Surface, Topology};
use crate::pages::large;
use crate::parallel;

/// New faces, edges or vertices of one task.
const CHUNK: usize = 4096;

/// After the split of every face into quads, one a corner: quad c is (vertex, edge of c, face, edge of prev c).
pub(super) fn of_quads(surface: &Surface, refined: &Mesh) -> Topology {
    if !surface.is_closed() {
        return of_quads_with_boundary(surface, refined);
    }
    let (mesh, topology) = (surface.mesh(), surface.topology());
    let (faces, incidence, twin) = (&mesh.faces, &topology.incidence, topology.twins());
    let count = twin.len();
    let (next, prev) = (|c| incidence.next(faces, c), |c| incidence.prev(faces, c));
    let mut twins = large(vec![0; 4 * count]);
    set_rows(&mut twins, |c| {
        let before = prev(c);
        [4 * next(twin[c as usize]) + 3, 4 * next(c) + 2, 4 * before + 1, 4 * twin[before as usize]]
    });

    let mut corners = large(vec![0; 4 * count]);
    let (at_vertices, rest) = corners.split_at_mut(count);
    let (at_edges, at_faces) = rest.split_at_mut(2 * count);
    scale(at_vertices, incidence.corners(), |c| 4 * c);
    set_by_edge(at_edges, topology, |c| {
        let t = twin[c as usize];
        let mut corners = [4 * c + 1, 4 * next(c) + 3, 4 * t + 1, 4 * next(t) + 3];
        corners.sort_unstable();
        corners
    });
    set_rows(at_faces, |c| [4 * c + 2]);

    let mut offsets = large(Vec::with_capacity(refined.len() + 1));
    parallel::append(&mut offsets, incidence.offsets());
    push_ends(&mut offsets, count, 4, count / 2);
    let first = 3 * count as u32;
    parallel::extend(&mut offsets, faces.len(), |_| |f| first + faces.range(f).end as u32);
    closed(refined, offsets, corners, twins)
}

/// After the split of every triangle f in four: triangle 4f + i is (vertex, edge of c, edge of prev c) with c = 3f + i,
/// triangle 4f + 3 has the three edges.
pub(super) fn of_fours(topology: &Topology, refined: &Mesh) -> Topology {
    if !topology.is_closed() {
        return of_fours_with_boundary(topology, refined);
    }
    let (incidence, twin) = (&topology.incidence, topology.twins());
    let count = twin.len();
    let mut twins = large(vec![0; 4 * count]);
    set_rows(&mut twins, |f| {
        let mut twins = [0; 12];
        let middle = 12 * f + 9;
        for i in 0..3 {
            let (next, prev) = ((i + 1) % 3, (i + 2) % 3);
            let t = twin[(3 * f + i) as usize];
            let entering = twin[(3 * f + prev) as usize];
            let at = 3 * i as usize;
            twins[at] = outer(next_in_triangle(t) as u32) + 2;
            twins[at + 1] = middle + prev;
            twins[at + 2] = outer(entering);
            twins[9 + i as usize] = outer(3 * f + next) + 1;
        }
        twins
    });

    let mut corners = large(vec![0; 4 * count]);
    let (at_vertices, at_edges) = corners.split_at_mut(count);
    scale(at_vertices, incidence.corners(), outer);
    set_by_edge(at_edges, topology, |c| {
        let ([a, b, m], [d, e, n]) = (at_side(c), at_side(twin[c as usize]));
        [a, b, m, d, e, n]
    });

    let mut offsets = large(Vec::with_capacity(refined.len() + 1));
    parallel::append(&mut offsets, incidence.offsets());
    push_ends(&mut offsets, count, 6, count / 2);
    closed(refined, offsets, corners, twins)
}

/// The half-edges along half-edge c after the split into quads.
pub(super) fn halves_in_quads(surface: &Surface, c: u32) -> [u32; 2] {
    [4 * c, 4 * surface.incidence().next(surface.faces(), c) + 3]
}

/// The half-edges along half-edge c after the split of triangles in four.
pub(super) fn halves_in_fours(c: u32) -> [u32; 2] {
    [outer(c), outer(next_in_triangle(c) as u32) + 2]
}

/// After the split of triangles in four, the first corner of the triangle at corner c.
fn outer(c: u32) -> u32 {
    3 * (c + c / 3)
}

/// After the split of triangles in four, the corners at the vertex of the edge of c in the face of c, ascending.
fn at_side(c: u32) -> [u32; 3] {
    let (here, after) = (outer(c) + 1, outer(next_in_triangle(c) as u32) + 2);
    [here.min(after), here.max(after), 12 * (c / 3) + 9 + c % 3]
}

/// As [`of_quads`], of an open mesh.
fn of_quads_with_boundary(surface: &Surface, refined: &Mesh) -> Topology {
    let (mesh, topology) = (surface.mesh(), surface.topology());
    let (faces, incidence, twin) = (&mesh.faces, &topology.incidence, topology.twins());
    let count = twin.len();
    let (next, prev) = (|c| incidence.next(faces, c), |c| incidence.prev(faces, c));
    let mut twins = large(vec![0; 4 * count]);
    set_rows(&mut twins, |c| {
        let before = prev(c);
        let leaving = there(twin[c as usize], |t| 4 * next(t) + 3);
        let entering = there(twin[before as usize], |t| 4 * t);
        [leaving, 4 * next(c) + 2, 4 * before + 1, entering]
    });

    let mut offsets = large(Vec::with_capacity(refined.len() + 1));
    parallel::append(&mut offsets, incidence.offsets());
    push_ends_by_edge(&mut offsets, topology, 2);
    let mut corners = large(vec![0; 4 * count]);
    let (at_vertices, rest) = corners.split_at_mut(count);
    let (at_edges, at_faces) = rest.split_at_mut(2 * count);
    scale(at_vertices, incidence.corners(), |c| 4 * c);
    set_sides_by_edge(at_edges, &offsets[incidence.vertices()..], topology, |c, row: &mut [[u32; 2]]| {
        for (side, c) in row.iter_mut().zip([c, twin[c as usize]]) {
            *side = [4 * c + 1, 4 * next(c) + 3];
        }
        row.as_flattened_mut().sort_unstable();
    });
    set_rows(at_faces, |c| [4 * c + 2]);
    let first = 3 * count as u32;
    parallel::extend(&mut offsets, faces.len(), |_| |f| first + faces.range(f).end as u32);
    let boundary = halved(topology, |c| halves_in_quads(surface, c));
    Topology::open(Incidence::from_parts(offsets, corners, &refined.faces), twins, boundary)
}

/// As [`of_fours`], of an open mesh.
fn of_fours_with_boundary(topology: &Topology, refined: &Mesh) -> Topology {
    let (incidence, twin) = (&topology.incidence, topology.twins());
    let count = twin.len();
    let mut twins = large(vec![0; 4 * count]);
    set_rows(&mut twins, |f| {
        let mut twins = [0; 12];
        let middle = 12 * f + 9;
        for i in 0..3 {
            let (next, prev) = ((i + 1) % 3, (i + 2) % 3);
            let at = 3 * i as usize;
            twins[at] = there(twin[(3 * f + i) as usize], |t| outer(next_in_triangle(t) as u32) + 2);
            twins[at + 1] = middle + prev;
            twins[at + 2] = there(twin[(3 * f + prev) as usize], outer);
            twins[9 + i as usize] = outer(3 * f + next) + 1;
        }
        twins
    });

    let mut offsets = large(Vec::with_capacity(refined.len() + 1));
    parallel::append(&mut offsets, incidence.offsets());
    push_ends_by_edge(&mut offsets, topology, 3);
    let mut corners = large(vec![0; 4 * count]);
    let (at_vertices, at_edges) = corners.split_at_mut(count);
    scale(at_vertices, incidence.corners(), outer);
    set_sides_by_edge(at_edges, &offsets[incidence.vertices()..], topology, |c, row: &mut [[u32; 3]]| {
        for (side, c) in row.iter_mut().zip([c, twin[c as usize]]) {
            *side = at_side(c);
        }
    });
    let boundary = halved(topology, halves_in_fours);
    Topology::open(Incidence::from_parts(offsets, corners, &refined.faces), twins, boundary)
}

/// What becomes of a twin; [`NONE`] of none.
fn there(twin: u32, map: impl Fn(u32) -> u32) -> u32 {
    if twin == NONE { NONE } else { map(twin) }
}

/// The halves of the sides without a twin, ascending.
fn halved(topology: &Topology, halves: impl Fn(u32) -> [u32; 2]) -> Vec<u32> {
    let mut halved: Vec<u32> = topology.boundary_half_edges().iter().flat_map(|&c| halves(c)).collect();
    halved.sort_unstable();
    halved
}

/// Appends the ends of a row for every edge, of `size` entries a side, that begin after the last end.
fn push_ends_by_edge(offsets: &mut Vec<u32>, topology: &Topology, size: u32) {
    let edges = topology.edge_numbers();
    let start = offsets[offsets.len() - 1];
    let rim: Vec<u32> = topology.boundary_half_edges().iter().map(|&c| edges.of(c)).collect();
    parallel::extend(offsets, topology.edges(), |first| {
        let rim = &rim;
        // How many edges up to this one have one side.
        let mut single = rim.partition_point(|&e| (e as usize) < first);
        move |e| {
            single += usize::from(rim.get(single) == Some(&(e as u32)));
            start + size * (2 * (e + 1) - single) as u32
        }
    });
}

/// Has `set(c, row)` write the row of every edge, c its first half-edge, of N entries a side; rows end as in `offsets`.
fn set_sides_by_edge<const N: usize>(
    values: &mut [u32],
    offsets: &[u32],
    topology: &Topology,
    set: impl Fn(u32, &mut [[u32; N]]) + Sync,
) {
    let edges = topology.edge_numbers();
    parallel::parts(split_rows(offsets, CHUNK, values), |rows, mut part| {
        for (e, c) in rows.clone().zip(edges.firsts_from(rows.start as u32)) {
            let (row, rest) = part.split_at_mut((offsets[e + 1] - offsets[e]) as usize);
            set(c, row.as_chunks_mut().0);
            part = rest;
        }
    });
}

/// After the split of every triangle in three and the flip of every old edge: triangle c is (vertex, face of t, face
/// of c). With sharp edges, which rest or are split in three, it is found anew.
pub(super) fn of_flips(surface: &Surface, refined: &Mesh) -> Topology {
    if surface.features().is_some() {
        return Topology::new(&refined.faces, refined.len());
    }
    let (mesh, topology) = (surface.mesh(), surface.topology());
    let (incidence, twin) = (&topology.incidence, topology.twins());
    let count = twin.len();
    let mut twins = large(vec![0; 3 * count]);
    set_rows(&mut twins, |c| {
        let t = twin[c as usize];
        [3 * next_in_triangle(t) as u32 + 2, 3 * t + 1, 3 * twin[prev_in_triangle(c)]]
    });

    let mut corners = large(vec![0; 3 * count]);
    let (at_vertices, at_faces) = corners.split_at_mut(count);
    scale(at_vertices, incidence.corners(), |c| 3 * c);
    set_rows(at_faces, |f| {
        let mut corners = [0; 6];
        let own = [0, 1, 2].map(|i| 3 * f + i);
        let [a, b, c] = own.map(|c| twin[c as usize]);
        let (low, high) = (a.min(b), a.max(b));
        let across = [low.min(c), low.max(c).min(high), high.max(c)];
        // Its own corners stand together. No branch: there is no pattern to foresee.
        let before = across.map(|t| usize::from(t < own[0]));
        let first = before.iter().sum::<usize>();
        for (i, c) in own.into_iter().enumerate() {
            corners[first + i] = 3 * c + 2;
        }
        for (i, (t, before)) in across.into_iter().zip(before).enumerate() {
            corners[i + 3 * (1 - before)] = 3 * t + 1;
        }
        corners
    });

    let mut offsets = large(Vec::with_capacity(refined.len() + 1));
    parallel::append(&mut offsets, incidence.offsets());
    push_ends(&mut offsets, count, 6, mesh.faces.len());
    closed(refined, offsets, corners, twins)
}

/// After Doo-Sabin's split: vertex c for every corner; the old faces, then (next c, c, next t, t) for every edge whose
/// first side is c, then the corners around every vertex.
pub(super) fn of_corners(surface: &Surface, refined: &Mesh) -> Topology {
    let (mesh, topology) = (surface.mesh(), surface.topology());
    let (faces, incidence, twin) = (&mesh.faces, &topology.incidence, topology.twins());
    let count = twin.len();
    let edges = topology.edge_numbers();
    let (next, prev) = (|c| incidence.next(faces, c), |c| incidence.prev(faces, c));
    let first_edge = count as u32;
    let first_star = 3 * count as u32;
    let stars = &refined.faces.corners()[3 * count..];
    // Where each corner stands in the face of its vertex.
    let place = Scatter::new(count);
    parallel::each(count, |p| place.set(stars[p], first_star + p as u32));
    let place = place.into_vec();
    // Of the quad of the edge of c, the corner that is c, and the corner that is next c.
    let in_edge = |c: u32| {
        let second = if c < twin[c as usize] { 0 } else { 2 };
        first_edge + 4 * edges.of(c) + second
    };

    let mut twins = large(vec![0; 4 * count]);
    let (of_faces, rest) = twins.split_at_mut(count);
    let (of_edges, of_vertices) = rest.split_at_mut(2 * count);
    set_rows(of_faces, |c| [in_edge(c)]);
    set_by_edge(of_edges, topology, |c| {
        let t = twin[c as usize];
        let at = |c: u32| place[next(c) as usize];
        [c, at(t), t, at(c)]
    });
    set_rows(of_vertices, |p| {
        let ahead = twin[prev(stars[p as usize]) as usize];
        [in_edge(ahead) + 1]
    });

    let mut corners = large(vec![0; 4 * count]);
    set_rows(&mut corners, |c| {
        let (leaving, entering) = (in_edge(c) + 1, in_edge(prev(c)));
        [c, leaving.min(entering), leaving.max(entering), place[c as usize]]
    });
    let offsets = parallel::collect(count + 1, |c| 4 * c as u32);
    closed(refined, offsets, corners, twins)
}

/// After the mid-edge split: a vertex for every edge; the old faces, then the corners around every vertex.
pub(super) fn of_midpoints(surface: &Surface, refined: &Mesh) -> Topology {
    let (mesh, topology) = (surface.mesh(), surface.topology());
    let (faces, incidence, twin) = (&mesh.faces, &topology.incidence, topology.twins());
    let count = twin.len();
    let stars = stars(surface);
    // Where each corner stands in the face of its vertex.
    let place = Scatter::new(count);
    parallel::each(count, |p| place.set(stars[p], (count + p) as u32));
    let place = place.into_vec();

    let mut twins = large(vec![0; 2 * count]);
    let (of_faces, of_vertices) = twins.split_at_mut(count);
    set_rows(of_faces, |c| [place[incidence.next(faces, c) as usize]]);
    set_rows(of_vertices, |p| [incidence.prev(faces, stars[p as usize])]);

    let mut corners = large(vec![0; 2 * count]);
    set_by_edge(&mut corners, topology, |c| {
        let t = twin[c as usize];
        let [a, b] = [place[c as usize], place[t as usize]];
        [c, t, a.min(b), a.max(b)]
    });
    let offsets = parallel::collect(count / 2 + 1, |e| 4 * e as u32);
    closed(refined, offsets, corners, twins)
}

fn closed(refined: &Mesh, offsets: Vec<u32>, corners: Vec<u32>, twins: Vec<u32>) -> Topology {
    let incidence = Incidence::from_parts(offsets, corners, &refined.faces);
    Topology::closed(incidence, twins)
}

/// Gives every edge, in order, a row: that of its first half-edge.
pub(super) fn set_by_edge<const N: usize>(
    values: &mut [u32],
    topology: &Topology,
    row: impl Fn(u32) -> [u32; N] + Sync,
) {
    let edges = topology.edge_numbers();
    parallel::chunks(values, CHUNK * N, |first, part| {
        for (to, c) in part.as_chunks_mut().0.iter_mut().zip(edges.firsts_from((first / N) as u32)) {
            *to = row(c);
        }
    });
}

/// Gives every k a row of N entries.
pub(super) fn set_rows<const N: usize>(values: &mut [u32], row: impl Fn(u32) -> [u32; N] + Sync) {
    parallel::chunks(values, CHUNK * N, |first, part| {
        for (k, to) in (first / N..).zip(part.as_chunks_mut().0) {
            *to = row(k as u32);
        }
    });
}

fn scale(to: &mut [u32], from: &[u32], map: impl Fn(u32) -> u32 + Sync) {
    parallel::fill(to, |k| map(from[k]));
}

/// Appends the ends of `count` rows of `size` entries that begin at `start`.
pub(super) fn push_ends(offsets: &mut Vec<u32>, start: usize, size: u32, count: usize) {
    parallel::extend(offsets, count, |_| |k| start as u32 + size * (k as u32 + 1));
}
