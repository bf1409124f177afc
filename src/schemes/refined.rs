//! The topology of a refined mesh, by index arithmetic on that of the coarse one: nothing is searched or sorted but
//! the four to six corners at a new vertex. Equal to [`Topology::new`] of the result, entry by entry.
//!
//! Half-edge c leaves corner c; t is its twin, V, E, F, C count the coarse mesh's vertices, edges, faces, corners. On a
//! valid mesh no two faces share more than one edge (the vertex between two would have valence 2), and no face has the
//! same one twice (it would name a vertex twice), so that no two new edges have the same ends, and the refined mesh is
//! valid too.

use std::sync::Arc;

use glam::DVec3;

use super::star::{next_in_triangle, prev_in_triangle, stars};
use crate::Result;
use crate::mesh::edge_numbers::{EdgeNumbers, FirstSides};
use crate::mesh::features::Features;
use crate::mesh::incidence::split_rows;
use crate::mesh::renumbered::Renumbered;
use crate::mesh::topology::{NONE, Scatter};
use crate::mesh::{Incidence, Mesh, Surface, Topology};
use crate::pages::large;
use crate::parallel;

/// New faces, edges or vertices of one task.
const CHUNK: usize = 4096;

/// What the points of a step are points of.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Of {
    Vertices,
    Edges,
    Faces,
}

/// The points of a step: `make` gives one for each of the vertices, edges or faces of a surface without sharp edges, in
/// these `parts` one after the other; edges come by their first half-edges. Where vertices lie scattered in memory, it is called with
/// the surface as it is [renumbered](Surface::renumbered) inside, and the points are put in the order of the file: the
/// same to the last bit.
pub(super) fn points(
    surface: &Surface,
    edges: &EdgeNumbers,
    parts: &[Of],
    make: &dyn Fn(&Surface, &FirstSides) -> Vec<DVec3>,
) -> Vec<DVec3> {
    let Some(inside) = surface.renumbered() else {
        return make(surface, edges.firsts());
    };
    let firsts = inside.first_sides();
    let made = make(&inside.surface(surface.positions()), &firsts);
    put_back(surface, inside, parts, &made, |points, made| {
        let (faces, incidence) = (surface.faces(), surface.incidence());
        edges.extend(points, |c| made[firsts.edge(inside.corner(faces, incidence.face_of(c), c)) as usize]);
    })
}

/// As [`points`], where there are none of edges: of the vertices, then of the faces.
pub(super) fn points_in_faces(surface: &Surface, make: &dyn Fn(&Surface) -> Vec<DVec3>) -> Vec<DVec3> {
    match surface.renumbered() {
        None => make(surface),
        Some(inside) => {
            let made = make(&inside.surface(surface.positions()));
            put_back(surface, inside, &[Of::Vertices, Of::Faces], &made, |_, _| {})
        }
    }
}

/// The points in the order of the file. `put_edges` appends those of edges, from all that are left.
fn put_back(
    surface: &Surface,
    inside: &Renumbered,
    parts: &[Of],
    made: &[DVec3],
    put_edges: impl Fn(&mut Vec<DVec3>, &[DVec3]),
) -> Vec<DVec3> {
    let mut points = large(Vec::with_capacity(made.len() + surface.boundary_edges()));
    for part in parts {
        let made = &made[points.len()..];
        let place = match part {
            Of::Vertices => inside.numbering.place(),
            Of::Faces => inside.face_place(),
            Of::Edges => {
                put_edges(&mut points, made);
                continue;
            }
        };
        parallel::extend(&mut points, place.len(), |_| |k| made[place[k] as usize]);
    }
    points
}

/// After the split of every face into quads, one a corner: quad c is (vertex, edge of c, face, edge of prev c).
pub(super) fn of_quads(surface: &Surface, refined: &Mesh) -> Topology {
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
    let at_side = |c| {
        let (here, after) = (4 * c + 1, 4 * next(c) + 3);
        [here.min(after), here.max(after)]
    };
    set_by_sides(at_edges, &offsets[incidence.vertices()..], topology, at_side, |c, t| {
        let ([a, b], [d, e]) = (at_side(c), at_side(t));
        let mut corners = [a, b, d, e];
        corners.sort_unstable();
        corners
    });
    set_rows(at_faces, |c| [4 * c + 2]);
    let first = 3 * count as u32;
    parallel::extend(&mut offsets, faces.len(), |_| |f| first + faces.range(f).end as u32);
    halved(surface, refined, [offsets, corners, twins], halves_in_quads)
}

/// After the split of every triangle f in four: triangle 4f + i is (vertex, edge of c, edge of prev c) with c = 3f + i,
/// triangle 4f + 3 has the three edges.
pub(super) fn of_fours(surface: &Surface, refined: &Mesh) -> Topology {
    let topology = surface.topology();
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
    set_by_sides(at_edges, &offsets[incidence.vertices()..], topology, at_side, |c, t| {
        let ([a, b, m], [d, e, n]) = (at_side(c), at_side(t));
        [a, b, m, d, e, n]
    });
    halved(surface, refined, [offsets, corners, twins], halves_in_fours)
}

/// Puts the half-edges along half-edge c after the split into quads.
pub(super) fn halves_in_quads(surface: &Surface, c: u32, put: &mut Vec<u32>) {
    put.extend([4 * c, 4 * surface.incidence().next(surface.faces(), c) + 3]);
}

/// Puts the half-edges along half-edge c after the split of triangles in four.
pub(super) fn halves_in_fours(_: &Surface, c: u32, put: &mut Vec<u32>) {
    put.extend([outer(c), outer(next_in_triangle(c) as u32) + 2]);
}

/// The features after a step, where `pieces` puts the half-edges of the refined mesh along a sharp half-edge, in this order.
pub(super) fn features_of_pieces(
    surface: &Surface,
    refined: &Mesh,
    topology: &Topology,
    pieces: fn(&Surface, u32, &mut Vec<u32>),
) -> Result<Option<Features>> {
    let Some(features) = surface.features() else { return Ok(None) };
    let pieces = |c, put: &mut Vec<u32>| pieces(surface, c, put);
    Ok(features.refined(&refined.faces, topology, surface.topology(), pieces))
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

/// What becomes of a twin; [`NONE`] of none.
fn there(twin: u32, map: impl Fn(u32) -> u32) -> u32 {
    if twin == NONE { NONE } else { map(twin) }
}

/// The topology with these offsets, corners and twins, where every side without a twin became its two `halves`.
fn halved(
    surface: &Surface,
    refined: &Mesh,
    [offsets, corners, twins]: [Vec<u32>; 3],
    halves: fn(&Surface, u32, &mut Vec<u32>),
) -> Topology {
    let incidence = Incidence::from_parts(offsets, corners, &refined.faces);
    let mut boundary = Vec::with_capacity(2 * surface.boundary_edges());
    surface.boundary_half_edges().iter().for_each(|&c| halves(surface, c, &mut boundary));
    boundary.sort_unstable();
    Topology::open(Arc::new(incidence), twins, boundary)
}

/// Appends the ends of a row for every edge, of `size` entries a side, that begin after the last end.
fn push_ends_by_edge(offsets: &mut Vec<u32>, topology: &Topology, size: u32) {
    let start = offsets[offsets.len() - 1];
    let edges = topology.edge_numbers();
    let single: Vec<u32> = topology.boundary_half_edges().iter().map(|&c| edges.of(c)).collect();
    parallel::extend(offsets, topology.edges(), |first| {
        let mut before = single.partition_point(|&e| (e as usize) < first);
        let single = &single;
        move |e| {
            before += usize::from(single.get(before) == Some(&(e as u32)));
            start + size * (2 * (e + 1) - before) as u32
        }
    });
}

/// Gives every edge, in order, a row: `one` of its side, or `two` of its first side and the other. Rows end as in `offsets`.
fn set_by_sides<const ONE: usize, const TWO: usize>(
    values: &mut [u32],
    offsets: &[u32],
    topology: &Topology,
    one: impl Fn(u32) -> [u32; ONE] + Sync,
    two: impl Fn(u32, u32) -> [u32; TWO] + Sync,
) {
    let (edges, twin) = (topology.edge_numbers(), topology.twins());
    parallel::parts(split_rows(offsets, CHUNK, values), |rows, mut part| {
        for c in edges.firsts_from(rows.start as u32).take(rows.len()) {
            let t = twin[c as usize];
            part = if t == NONE { put(part, one(c)) } else { put(part, two(c, t)) };
        }
    });
}

/// Writes a row to the beginning of `part`, and gives the rest.
fn put<const N: usize>(part: &mut [u32], row: [u32; N]) -> &mut [u32] {
    let (here, rest) = part.split_at_mut(N);
    here.copy_from_slice(&row);
    rest
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
    Topology::closed(Arc::new(incidence), twins)
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::features::Tags;
    use crate::mesh::random::{random_creased, random_polygons, random_semi_sharp, random_triangulation};
    use crate::mesh::validate::Boundary;
    use crate::schemes::Refinement;

    /// Closed, open, with creases and with semi-sharp edges.
    fn surfaces(closed: &Mesh, seed: u64) -> Vec<(Surface, Option<Tags>)> {
        let tagged = [random_creased(closed, seed), random_semi_sharp(closed, seed)].into_iter().flatten();
        let plain = (Surface::new(closed.clone()).unwrap(), None);
        std::iter::once(plain).chain(tagged.map(|(surface, tags)| (surface, Some(tags)))).collect()
    }

    #[test]
    fn a_step_in_another_order_inside_is_the_same_to_the_last_bit() {
        let bits = |s: &Surface| s.positions().iter().map(|p| p.to_array().map(f64::to_bits)).collect::<Vec<_>>();
        let mut steps = [0; 2];
        for seed in 0..20 {
            let meshes = [random_polygons(seed), random_triangulation(seed)];
            for (surface, tags) in meshes.iter().flat_map(|mesh| surfaces(mesh, seed)) {
                let boundary = tags.as_ref().map_or(Boundary::Refuse, |tags| tags.boundary);
                let inside = Surface::scattered(surface.mesh().clone(), boundary);
                let inside = tags.as_ref().map_or(inside.clone(), |tags| inside.tagged(tags).unwrap());
                assert!(inside.renumbered().is_some() && inside.features() == surface.features());
                assert!(inside.topology() == surface.topology() && inside.incidence() == surface.incidence());
                for scheme in Refinement::ALL {
                    match [scheme.refined(&surface), scheme.refined(&inside)] {
                        [Ok(expected), Ok(found)] => {
                            let what = format!("{scheme}, seed {seed}, {} vertices", surface.len());
                            assert!(bits(&found) == bits(&expected), "{what}");
                            assert!(found.faces() == expected.faces(), "{what}");
                            assert!(found.topology() == expected.topology(), "{what}");
                            steps[usize::from(tags.is_some())] += 1;
                        }
                        results => {
                            let told = results.map(|result| result.err().map(|e| e.to_string()));
                            assert_eq!(told[0], told[1], "{scheme}, seed {seed}");
                        }
                    }
                }
            }
        }
        assert!(steps.iter().all(|&steps| steps > 100), "{steps:?}");
    }
}
