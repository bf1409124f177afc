//! Degenerate positions: vertices on the same point, faces on the same points, faces without area.

use glam::DVec3;

use super::frame::magnitude;
use super::incidence::NONE;
use super::numbering::add_up;
use super::origin::Numbers;
use super::{Faces, Incidence};
use crate::error::counted;
use crate::parallel;

/// A remark for each kind of oddity that occurs, with its count and first place, in the [`Numbers`] of the file.
///
/// A mesh that `is_closed` is a closed surface with valences from 3 on. Two of its triangles on three vertices would share
/// all edges, and no other face could be at these vertices: there they need not be looked for.
///
/// # Panics
/// If a face names a vertex that does not exist.
pub(super) fn remarks(
    positions: &[DVec3],
    (faces, incidence): (&Faces, &Incidence),
    numbers: &Numbers,
    is_closed: bool,
) -> Vec<String> {
    let mut remarks = Vec::new();
    let copies = duplicate_positions(positions);
    if let Some([v, original]) = copies.first().map(|&(v, w)| [v, w].map(|v| numbers.vertex(v))) {
        remarks.push(format!(
            "{} (first: vertex {v} lies on vertex {original})",
            counted(copies.len(), "duplicate position")
        ));
    }
    let copies = if is_closed && copies.is_empty() && faces.uniform_size() == Some(3) {
        Vec::new()
    } else {
        duplicate_faces(faces, incidence, &copies)
    };
    if let Some([f, original]) = copies.first().map(|&(f, g)| [f, g].map(|f| numbers.face(f))) {
        remarks.push(format!(
            "{} on the same positions as another (first: face {f} lies on face {original})",
            counted(copies.len(), "face")
        ));
    }
    let flat = zero_area_faces(positions, faces);
    if let Some(&f) = flat.first() {
        let faces = counted(flat.len(), "zero-area face");
        remarks.push(format!("{faces} (first: face {})", numbers.face(f)));
    }
    remarks
}

/// The vertices whose coordinates equal those of a vertex before them, with the first such vertex; ascending.
/// Zeros of either sign are equal; vertices that are not finite do not count. O(n).
///
/// Equal vertices have equal keys, and fall into one of 256 parts by the first bits of these. A part stays in cache; there,
/// only items that share a bit of a table with another are sorted, an eighth if all are different.
fn duplicate_positions(positions: &[DVec3]) -> Vec<(u32, u32)> {
    const PARTS: usize = 256;
    const CHUNK: usize = 1 << 16;
    let key = |v: usize| bits_of(positions[v]).into_iter().fold(0, |h, b| mix(h ^ b));
    let part = |item: u64| (item >> 56) as usize;
    let chunks = parallel::map(positions.len(), CHUNK, |range| {
        let finite = range.filter(|&v| positions[v].is_finite());
        // The upper half of the key, and the vertex.
        let items: Vec<u64> = finite.map(|v| key(v) >> 32 << 32 | v as u64).collect();
        let mut starts = [0u32; PARTS + 1];
        for &item in &items {
            starts[part(item) + 1] += 1;
        }
        add_up(&mut starts);
        let mut next = starts;
        let mut sorted = vec![0; items.len()];
        for &item in &items {
            let next = &mut next[part(item)];
            sorted[*next as usize] = item;
            *next += 1;
        }
        (starts, sorted)
    });
    let mut copies = parallel::flat_map(PARTS, 1, |range| {
        let part = |k: usize| {
            let lists = chunks.iter().map(move |(starts, sorted)| &sorted[starts[k] as usize..starts[k + 1] as usize]);
            lists.flatten().copied()
        };
        let count = part(range.start).count();
        let bits = (16 * count).next_power_of_two().max(64);
        let place = |item: u64| {
            let bit = (item >> 32) as usize & (bits - 1);
            (bit / 64, 1u64 << (bit % 64))
        };
        let mut met = vec![[0u64; 2]; bits / 64];
        for item in part(range.start) {
            let (word, bit) = place(item);
            let [once, again] = &mut met[word];
            *again |= *once & bit;
            *once |= bit;
        }
        let shared = part(range.start).filter(|&item| {
            let (word, bit) = place(item);
            met[word][1] & bit != 0
        });
        equal_by(shared.map(|item| ((item >> 32) as u32, item as u32)), |v| bits_of(positions[v as usize]))
    });
    copies.sort_unstable();
    copies
}

/// Of a position, alike for zeros of either sign: adding +0 makes −0 to +0.
fn bits_of(position: DVec3) -> [u64; 3] {
    (position + DVec3::ZERO).to_array().map(f64::to_bits)
}

/// The faces whose corners, in any order, lie on the same positions as those of a face before them, with the first such face;
/// ascending. `same` are the duplicate positions. O(corners), with sorts among the faces that have one smallest vertex.
fn duplicate_faces(faces: &Faces, incidence: &Incidence, same: &[(u32, u32)]) -> Vec<(u32, u32)> {
    if same.is_empty() {
        return faces_on_the_same_vertices(faces, incidence);
    }
    let mut place: Vec<u32> = (0..incidence.vertices() as u32).collect();
    for &(v, original) in same {
        place[v as usize] = original;
    }
    let mut moved = faces.copied();
    parallel::change(moved.corners_mut(), |_, v| *v = place[*v as usize]);
    let incidence = Incidence::new(&moved, place.len());
    faces_on_the_same_vertices(&moved, &incidence)
}

/// Faces on the same vertices are among those that have one smallest vertex.
fn faces_on_the_same_vertices(faces: &Faces, incidence: &Incidence) -> Vec<(u32, u32)> {
    let smallest = parallel::collect(faces.len(), |f| faces.face(f).iter().copied().min().unwrap_or(NONE));
    let mut copies = parallel::flat_map(incidence.vertices(), 4096, |range| {
        let (mut copies, mut met) = (Vec::new(), Vec::new());
        for v in range {
            met.clear();
            for &c in incidence.corners_at(v) {
                let f = incidence.face_of(c) as u32;
                // A face may pass the vertex more than once.
                if smallest[f as usize] == v as u32 && met.last() != Some(&f) {
                    met.push(f);
                }
            }
            if met.len() > 1 {
                copies.extend(equal_by(met.iter().map(|&f| (sum_of(faces.face(f as usize)), f)), |f| {
                    let mut vertices = faces.face(f as usize).to_vec();
                    vertices.sort_unstable();
                    vertices
                }));
            }
        }
        copies
    });
    copies.sort_unstable();
    copies
}

/// A number that does not depend on the order of the corners.
fn sum_of(face: &[u32]) -> u64 {
    face.iter().fold(0, |sum: u64, &v| sum.wrapping_add(mix(u64::from(v))))
}

/// Of items by their keys, those equal to one before them by `value`, each with the first of its equals. Equal values must have
/// equal keys; few unequal ones may.
fn equal_by<K: Ord + Copy, T: Ord>(items: impl Iterator<Item = (K, u32)>, value: impl Fn(u32) -> T) -> Vec<(u32, u32)> {
    let mut items: Vec<(K, u32)> = items.collect();
    items.sort_unstable();
    let mut copies = Vec::new();
    for run in items.chunk_by(|a, b| a.0 == b.0).filter(|run| run.len() > 1) {
        let mut values: Vec<(T, u32)> = run.iter().map(|&(_, item)| (value(item), item)).collect();
        values.sort_unstable();
        for equal in values.chunk_by(|a, b| a.0 == b.0) {
            copies.extend(equal[1..].iter().map(|&(_, item)| (item, equal[0].1)));
        }
    }
    copies
}

/// Spreads the bits of a word: the finaliser of SplitMix64 (Steele, Lea and Flood 2014).
fn mix(word: u64) -> u64 {
    let z = word.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// The faces whose vector area ½ Σ (pᵢ − p₀) × (pᵢ₊₁ − p₀) vanishes to the rounding of its terms.
fn zero_area_faces(positions: &[DVec3], faces: &Faces) -> Vec<u32> {
    // Each product of differences carries a relative error of at most 4 units in the last place.
    const ROUNDING: f64 = 8.0 * f64::EPSILON;
    // Of a face whose corner k lies at `at(k)` from the first.
    let vanishes = |size: usize, at: &dyn Fn(usize) -> DVec3| {
        let (mut area, mut scale) = (DVec3::ZERO, 0.0);
        for k in 2..size {
            let (a, b) = (at(k - 1), at(k));
            area += a.cross(b);
            scale += a.length() * b.length();
        }
        // What is not a number, too, is not clearly larger.
        area.length().partial_cmp(&(ROUNDING * scale)) != Some(std::cmp::Ordering::Greater)
    };
    let is_flat = |f: usize| {
        let face = faces.face(f);
        let corner = |k: usize| positions[face[k] as usize];
        if !vanishes(face.len(), &|k| corner(k) - corner(0)) {
            return false;
        }
        // Products of lengths may have left the range of doubles: the same at order one.
        let largest = |vectors: &mut dyn Iterator<Item = DVec3>| {
            magnitude(vectors.fold(DVec3::ZERO, |m, v| m.max(v.abs())).max_element())
        };
        let unit = largest(&mut (0..face.len()).map(corner));
        let mut sides: Vec<DVec3> = (0..face.len()).map(|k| corner(k) / unit - corner(0) / unit).collect();
        let unit = largest(&mut sides.iter().copied());
        sides.iter_mut().for_each(|side| *side /= unit);
        vanishes(face.len(), &|k| sides[k])
    };
    parallel::flat_map(faces.len(), 4096, |range| range.filter(|&f| is_flat(f)).map(|f| f as u32).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Mesh;

    #[test]
    fn duplicates_are_found_in_order_and_zeros_of_either_sign_are_one() {
        let p = |x: f64| DVec3::new(x, 0.0, 1.0);
        let positions = [p(1.0), p(-0.0), p(2.0), p(0.0), p(1.0), p(f64::NAN), p(f64::NAN), p(1.0)];
        assert_eq!(duplicate_positions(&positions), [(3, 1), (4, 0), (7, 0)]);
    }

    #[test]
    fn faces_are_compared_by_position_in_any_rotation_and_direction() {
        let faces = Faces::from_lists([[0u32, 1, 2], [2, 3, 1], [1, 0, 4], [1, 2, 0], [4, 1, 3]]);
        // 4 lies on 2.
        let copies = duplicate_faces(&faces, &Incidence::new(&faces, 5), &[(4, 2)]);
        assert_eq!(copies, [(2, 0), (3, 0), (4, 1)]);
    }

    /// More than one chunk of them, some far apart, against a map of all.
    #[test]
    fn duplicates_are_found_among_many() {
        use std::collections::HashMap;
        let position = |v: u32| {
            let v = if v % 97 == 5 { v / 3 } else { v };
            DVec3::new(f64::from(v % 1000), f64::from(v / 1000), 0.5)
        };
        let positions: Vec<DVec3> = (0..200_000).map(position).collect();
        let mut first = HashMap::new();
        let expected: Vec<(u32, u32)> = (0..)
            .zip(&positions)
            .filter_map(|(v, p)| {
                let original = *first.entry(p.to_array().map(f64::to_bits)).or_insert(v);
                (original != v).then_some((v, original))
            })
            .collect();
        assert!(expected.len() > 2000);
        assert_eq!(duplicate_positions(&positions), expected);
    }

    /// Quads on the same vertices in another order share two edges, and may be part of a surface.
    #[test]
    fn faces_of_one_smallest_vertex_are_compared_with_each_other() {
        let faces = Faces::from_lists([[0u32, 1, 2, 3], [4, 1, 0, 5], [0, 2, 1, 3], [0, 1, 2, 6], [3, 4, 5, 6]]);
        assert_eq!(duplicate_faces(&faces, &Incidence::new(&faces, 7), &[]), [(2, 0)]);
        // More than can be at a vertex of a surface, the same face passing one of its vertices twice.
        let mut lists: Vec<Vec<u32>> = (1..60).map(|k| vec![0, k, k + 1]).collect();
        lists.extend([vec![0, 7, 0, 8], vec![8, 0, 7], vec![41, 0, 40]]);
        let faces = Faces::from_lists(lists);
        assert_eq!(duplicate_faces(&faces, &Incidence::new(&faces, 61), &[]), [(60, 6), (61, 39)]);
    }

    #[test]
    fn zero_area_means_collinear_or_coincident() {
        let third = 1.0 / 3.0;
        let positions = vec![
            DVec3::ZERO,
            DVec3::new(0.1, 0.2, 0.3),
            DVec3::new(0.2, 0.4, 0.6),
            DVec3::new(1.0, third, 0.7),
            // Far from collinear compared with rounding, though small.
            DVec3::new(1e-9, 2e-9, 3e-9 + 1e-20),
        ];
        let faces =
            Faces::from_lists(vec![vec![0, 1, 2], vec![0, 1, 3], vec![3, 3, 1], vec![0, 1, 3, 2], vec![0, 1, 4]]);
        let mesh = Mesh::new(positions, faces);
        assert_eq!(zero_area_faces(&mesh.positions, &mesh.faces), [0, 2]);
        for size in [2f64.powi(-900), 2f64.powi(-560), 2f64.powi(560), 2f64.powi(1020)] {
            let positions: Vec<DVec3> = mesh.positions.iter().map(|p| size * *p).collect();
            assert_eq!(zero_area_faces(&positions, &mesh.faces), [0, 2], "{size:e}");
        }
    }

    /// Right triangles of height h over a side of length 1 lose their area at the rounding of a few products.
    #[test]
    fn a_sliver_has_an_area_down_to_rounding() {
        let heights = [1e-3, 1e-8, 1e-12, 1e-13, 1e-14, 1e-16, 0.0];
        let mut positions = vec![DVec3::ZERO, DVec3::X];
        positions.extend(heights.map(|h| DVec3::new(1.0, h, 0.0)));
        let slivers: Vec<[u32; 3]> = (0..heights.len() as u32).map(|k| [0, 1, k + 2]).collect();
        let flat = zero_area_faces(&positions, &Faces::from_lists(slivers));
        assert_eq!(flat, [5, 6]);
    }
}
