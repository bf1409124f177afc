//! Renumbering along a space-filling curve, for meshes whose vertices lie scattered through memory.

use std::sync::atomic::{AtomicBool, Ordering};

use glam::DVec3;

use super::incidence::sorted_by;
use super::numbering::Numbering;
use super::{Faces, Mesh, bounding_box};
use crate::pages::large;
use crate::parallel;

/// Whether vertices that faces bring together lie scattered through memory: of the vertices that a face does not
/// share with the face before it, fewer than a quarter are within 128 places of one of that face's. Looks
/// at 16 384 faces at the most; O(C log C) in their corners C.
pub fn is_scattered(faces: &Faces) -> bool {
    const NEAR: u32 = 128;
    const NEAR_SHARE: f64 = 0.25;
    const SAMPLE: usize = 1 << 14;
    let (mut fresh, mut near) = (0u32, 0u32);
    let mut before = Vec::new();
    for f in (1..faces.len()).step_by(faces.len() / SAMPLE + 1) {
        before.clear();
        before.extend_from_slice(faces.face(f - 1));
        before.sort_unstable();
        for &v in faces.face(f) {
            let above = before.partition_point(|&w| w < v);
            if before.get(above) == Some(&v) {
                continue;
            }
            fresh += 1;
            let neighbours = &before[above.saturating_sub(1)..before.len().min(above + 1)];
            near += u32::from(neighbours.iter().any(|&w| v.abs_diff(w) <= NEAR));
        }
    }
    f64::from(near) < NEAR_SHARE * f64::from(fresh)
}

/// The mesh with its vertices along Morton's curve through the cells of a grid of 64³ and its faces by smallest vertex, that
/// numbering, and the order of the faces. Every later pass over the mesh then runs through memory almost in order.
/// `None` if a face names a vertex that does not exist. Two counting sorts, of vertices and of faces, in parallel.
pub fn along_curve(mesh: &Mesh) -> Option<(Mesh, Numbering, Vec<u32>)> {
    let numbering = Numbering::new(morton_cells(&mesh.positions));
    let place = numbering.place();
    let old = mesh.faces.corners();
    let missing = AtomicBool::new(false);
    let mut corners = large(Vec::with_capacity(old.len()));
    parallel::extend(&mut corners, old.len(), |_| {
        |c| {
            place.get(old[c] as usize).copied().unwrap_or_else(|| {
                missing.store(true, Ordering::Relaxed);
                0
            })
        }
    });
    if missing.into_inner() {
        return None;
    }
    let smallest =
        parallel::collect(mesh.faces.len(), |f| corners[mesh.faces.range(f)].iter().copied().min().unwrap_or(0));
    let (_, order) = sorted_by(&smallest, mesh.len());
    let faces = mesh.faces.in_order(&order, &corners);
    let positions = numbering.there(&mesh.positions);
    Some((Mesh::new(positions, faces), numbering, order))
}

/// One counting sort by the highest bits of the codes, and a sort of each of the short lists that this gives.
pub(super) fn morton(positions: &[DVec3]) -> Vec<u32> {
    /// Bits of a coordinate that the counting sort looks at.
    const FIRST: u32 = 5;
    let codes = morton_codes(positions, |code| code);
    let highest = morton_codes(positions, |code| (code >> (3 * (21 - FIRST))) as u32);
    let (_, mut order) = sorted_by(&highest, 1 << (3 * FIRST));
    let mut lists: Vec<&mut [u32]> = order.chunk_by_mut(|&v, &w| highest[v as usize] == highest[w as usize]).collect();
    parallel::chunks(&mut lists, 64, |_, lists| {
        for list in lists {
            list.sort_unstable_by_key(|&v| (codes[v as usize], v));
        }
    });
    order
}

/// The positions by the cells of a grid of 64³ along the curve, within a cell as they come: near enough for memory.
fn morton_cells(positions: &[DVec3]) -> Vec<u32> {
    const BITS: u32 = 6;
    let cells = morton_codes(positions, |code| (code >> (3 * (21 - BITS))) as u32);
    sorted_by(&cells, 1 << (3 * BITS)).1
}

/// `take` of the place of every position along the curve, 21 bits a coordinate.
fn morton_codes<T: Send>(positions: &[DVec3], take: impl Fn(u64) -> T + Send + Sync) -> Vec<T> {
    const CELLS: f64 = ((1u64 << 21) - 1) as f64;
    let (low, high) = bounding_box(positions).unwrap_or((DVec3::ZERO, DVec3::ZERO));
    let scale = CELLS / (high - low).max_element().max(f64::MIN_POSITIVE);
    parallel::collect(positions.len(), |v| {
        // A coordinate that is not a number becomes 0.
        let cell = ((positions[v] - low) * scale).to_array().map(|x| spread(x as u64));
        take(cell[0] | cell[1] << 1 | cell[2] << 2)
    })
}

/// Puts two zeros between the lowest 21 bits.
fn spread(x: u64) -> u64 {
    let mut x = x & 0x1f_ffff;
    for (shift, mask) in [
        (32, 0x001f_0000_0000_ffff),
        (16, 0x001f_0000_ff00_00ff),
        (8, 0x100f_00f0_0f00_f00f),
        (4, 0x10c3_0c30_c30c_30c3),
        (2, 0x1249_2492_4924_9249),
    ] {
        x = (x | x << shift) & mask;
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_are_spread_by_threes() {
        for x in [0, 1, 2, 0x15_5555, 0x1f_ffff, 0x12_3456] {
            let plain: u64 = (0..21).map(|bit| (x >> bit & 1) << (3 * bit)).sum();
            assert_eq!(spread(x), plain);
        }
    }
}
