//! Degenerate positions: vertices on the same point, faces on the same points, faces without area.

use std::sync::atomic::{AtomicU64, Ordering};

use glam::DVec3;
use rayon::slice::ParallelSliceMut;

use super::Faces;
use super::frame::magnitude;
use super::origin::Numbers;
use crate::error::counted;
use crate::pages::large;
use crate::parallel;
use crate::prefetch::prefetch;

/// A remark for each kind of oddity that occurs, with its count and first place, in the [`Numbers`] of the file.
///
/// # Panics
/// If a face names a vertex that does not exist.
pub(super) fn remarks(positions: &[DVec3], faces: &Faces, numbers: &Numbers) -> Vec<String> {
    let mut remarks = Vec::new();
    let copies = duplicate_positions(positions);
    if let Some([v, original]) = copies.first().map(|&(v, w)| [v, w].map(|v| numbers.vertex(v))) {
        remarks.push(format!(
            "{} (first: vertex {v} lies on vertex {original})",
            counted(copies.len(), "duplicate position")
        ));
    }
    let copies = duplicate_faces(faces, positions.len(), &copies);
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
/// Zeros of either sign are equal; vertices that are not finite do not count. O(n log n).
fn duplicate_positions(positions: &[DVec3]) -> Vec<(u32, u32)> {
    // Adding +0 makes −0 to +0.
    let bits = |v: u32| (positions[v as usize] + DVec3::ZERO).to_array().map(f64::to_bits);
    let key = |v: u32| {
        let is_finite = positions[v as usize].is_finite();
        is_finite.then(|| bits(v).into_iter().fold(0, |h, b| mix(h ^ b)))
    };
    copies(positions.len() as u32, key, bits)
}

/// The faces whose corners, in any order, lie on the same positions as those of a face before them, with the
/// first such face; ascending. O(n log n). `same` are the duplicate positions.
fn duplicate_faces(faces: &Faces, vertices: usize, same: &[(u32, u32)]) -> Vec<(u32, u32)> {
    let mut table: Vec<u32> = Vec::new();
    if !same.is_empty() {
        table.extend(0..vertices as u32);
        for &(v, original) in same {
            table[v as usize] = original;
        }
    }
    let place = |&v: &u32| table.get(v as usize).copied().unwrap_or(v);
    let key = |f: u32| {
        // A sum does not depend on the order of the corners.
        let places = faces.face(f as usize).iter().map(place);
        Some(places.fold(0u64, |h, p| h.wrapping_add(mix(u64::from(p)))))
    };
    copies(faces.len() as u32, key, |f| {
        let mut places: Vec<u32> = faces.face(f as usize).iter().map(place).collect();
        places.sort_unstable();
        places
    })
}

/// Of `count` items, those equal to one before them by `value`, each with the first of its equals. Equal values must
/// have equal keys; few unequal ones may. Items without a key have no equals.
///
/// Only items that share a bit of a table with another are sorted, an eighth if all are different.
fn copies<T: Ord>(count: u32, key: impl Fn(u32) -> Option<u64> + Sync, value: impl Fn(u32) -> T) -> Vec<(u32, u32)> {
    const BITS_PER_ITEM: usize = 16;
    const BLOCK: usize = 64;
    let bits = (BITS_PER_ITEM * count as usize).next_power_of_two().max(64);
    let table = || -> Vec<AtomicU64> {
        let mut words = large(Vec::with_capacity(bits / 64));
        parallel::extend(&mut words, bits / 64, |_| |_| AtomicU64::new(0));
        words
    };
    let (met, met_again) = (table(), table());
    let place = |key: u64| {
        let bit = key as usize & (bits - 1);
        (bit / 64, 1u64 << (bit % 64))
    };
    // Each look into a table is a wait for memory, unless it is asked for some items before.
    let block = |k: u32, table: &[AtomicU64]| {
        let items = k * BLOCK as u32..count.min((k + 1) * BLOCK as u32);
        let mut keys = [None; BLOCK];
        for (slot, item) in keys.iter_mut().zip(items.clone()) {
            *slot = key(item);
            if let Some(key) = *slot {
                prefetch(table, place(key).0);
            }
        }
        items.zip(keys).filter_map(|(item, key)| Some((key?, item)))
    };
    let blocks = count.div_ceil(BLOCK as u32) as usize;
    parallel::each(blocks, |k| {
        for (key, _) in block(k as u32, &met) {
            let (word, bit) = place(key);
            if met[word].fetch_or(bit, Ordering::Relaxed) & bit != 0 {
                met_again[word].fetch_or(bit, Ordering::Relaxed);
            }
        }
    });
    let shares_a_bit = |&(key, _): &(u64, u32)| {
        let (word, bit) = place(key);
        met_again[word].load(Ordering::Relaxed) & bit != 0
    };
    let mut keys: Vec<(u64, u32)> = parallel::flat_map(blocks, BLOCK, |range| {
        range.flat_map(|k| block(k as u32, &met_again).filter(shares_a_bit)).collect()
    });
    keys.par_sort_unstable();
    let mut copies = Vec::new();
    for run in keys.chunk_by(|a, b| a.0 == b.0).filter(|run| run.len() > 1) {
        let mut values: Vec<(T, u32)> = run.iter().map(|&(_, item)| (value(item), item)).collect();
        values.sort_unstable();
        for equal in values.chunk_by(|a, b| a.0 == b.0) {
            copies.extend(equal[1..].iter().map(|&(_, item)| (item, equal[0].1)));
        }
    }
    copies.sort_unstable();
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
        let copies = duplicate_faces(&faces, 5, &[(4, 2)]);
        assert_eq!(copies, [(2, 0), (3, 0), (4, 1)]);
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
