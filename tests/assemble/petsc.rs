//! PETSc's files: the bytes read here, by the layout of its manual, against the stored matrix; solutions read back; what is refused.

use std::path::Path;

use glam::DVec3;
use limitlab::assemble::petsc::{Export, Index, ORDER, read_control, read_indices, read_points, read_vector};
use limitlab::assemble::{LimitSystem, Stages, StreamedSystem};
use limitlab::interpolate::{Options, Tolerance, interpolate};
use limitlab::mesh::random::random_creased;
use limitlab::mesh::{Surface, builtin};
use limitlab::schemes::Scheme;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use tempfile::tempdir;

use crate::common::meshes::*;

/// Takes numbers from the front of a file.
struct Bytes<'a> {
    rest: &'a [u8],
    wide: bool,
}

impl Bytes<'_> {
    fn take<const N: usize>(&mut self) -> [u8; N] {
        let (first, rest) = self.rest.split_first_chunk().expect("no more bytes");
        self.rest = rest;
        *first
    }

    fn index(&mut self) -> i64 {
        if self.wide { i64::from_be_bytes(self.take()) } else { i32::from_be_bytes(self.take()).into() }
    }

    fn double(&mut self) -> f64 {
        f64::from_be_bytes(self.take())
    }

    fn indices(&mut self, count: usize) -> Vec<i64> {
        (0..count).map(|_| self.index()).collect()
    }
}

/// What is written, read here.
struct Written {
    rows: Vec<Vec<(usize, f64)>>,
    right: Vec<f64>,
    weights: Vec<f64>,
    order: Vec<i64>,
}

fn written(system: &StreamedSystem, points: &[DVec3], index: Index) -> Written {
    let export = Export::new(system, index).unwrap();
    let wide = index == Index::Bits64;
    let mut files = [const { Vec::new() }; 4];
    export.write_matrix(&mut files[0]).unwrap();
    export.write_right_hand_side(points, &mut files[1]).unwrap();
    export.write_weights(&mut files[2]).unwrap();
    export.write_order(&mut files[3]).unwrap();
    let [mut matrix, mut right, mut weights, mut order] = files.each_ref().map(|file| Bytes { rest: file, wide });
    let n = system.len();
    assert_eq!(matrix.indices(4), [1_211_216, n as i64, n as i64, export.entries() as i64]);
    let lengths = matrix.indices(n);
    let columns: Vec<Vec<i64>> = lengths.iter().map(|&length| matrix.indices(length as usize)).collect();
    let rows = columns.iter().map(|row| row.iter().map(|&j| (j as usize, matrix.double())).collect()).collect();
    let vector = |file: &mut Bytes, length: usize| -> Vec<f64> {
        assert_eq!(file.indices(2), [1_211_214, length as i64]);
        (0..length).map(|_| file.double()).collect()
    };
    let (right_numbers, weight_numbers) = (vector(&mut right, 3 * n), vector(&mut weights, n));
    assert_eq!(order.indices(2), [1_211_218, n as i64]);
    let places = order.indices(n);
    for rest in [matrix.rest, right.rest, weights.rest, order.rest] {
        assert!(rest.is_empty(), "{} bytes too many", rest.len());
    }
    Written { rows, right: right_numbers, weights: weight_numbers, order: places }
}

fn shuffled(n: usize, seed: u64) -> Vec<u32> {
    let mut order: Vec<u32> = (0..n as u32).collect();
    order.shuffle(&mut chacha20::ChaCha8Rng::seed_from_u64(seed));
    order
}

/// Holds the files of a system against the stored block, whose row k is that of `vertices[k]`, within a few last digits.
fn hold(files: &Written, block: &LimitSystem, right: &[DVec3], vertices: &[u32], what: &str) {
    let place = |v: i64| vertices.binary_search(&(v as u32)).unwrap();
    assert_eq!(files.rows.len(), block.len(), "{what}");
    let symmetric = block.symmetric_right_hand_side(right);
    let size = right.iter().map(|p| p.length()).fold(0.0, f64::max);
    for (row, &v) in files.rows.iter().zip(&files.order) {
        let i = place(v);
        assert!(row.is_sorted_by(|a, b| a.0 < b.0), "{what}: columns of the row of {v}");
        let mut theirs: Vec<(usize, f64)> = row.iter().map(|&(j, m)| (place(files.order[j]), m)).collect();
        theirs.sort_by_key(|e| e.0);
        let ours: Vec<(usize, f64)> = block.m.row(i).collect();
        assert_eq!(
            theirs.iter().map(|e| e.0).collect::<Vec<_>>(),
            ours.iter().map(|e| e.0).collect::<Vec<_>>(),
            "{what}"
        );
        for (a, b) in theirs.iter().zip(&ours) {
            assert!((a.1 - b.1).abs() <= 1e-14 * b.1.abs(), "{what}: entry ({i}, {}): {} and {}", a.0, a.1, b.1);
        }
    }
    for (k, &v) in files.order.iter().enumerate() {
        let i = place(v);
        assert!((files.weights[k] - block.h[i]).abs() <= 1e-15 * block.h[i], "{what}");
        let r = DVec3::from_slice(&files.right[3 * k..3 * k + 3]);
        assert!(r.distance(symmetric[i]) <= 1e-14 * size / block.h[i], "{what}: right-hand side of {v}");
    }
}

#[test]
fn files_hold_the_stored_matrix_in_any_order_and_width() {
    for scheme in Scheme::ALL {
        for seed in 0..8 {
            let mesh = scattered(&small_mesh(scheme, seed), seed);
            let (what, n) = (format!("{scheme} {seed}"), mesh.len());
            let block = system(&mesh, scheme);
            let surface = Surface::new(mesh).unwrap();
            let order = shuffled(n, seed);
            let streamed = StreamedSystem::new(&surface, scheme, &order).unwrap();
            assert_eq!(streamed.vertices(), order, "{what}");
            let all: Vec<u32> = (0..n as u32).collect();
            for index in [Index::Bits32, Index::Bits64] {
                let files = written(&streamed, surface.positions(), index);
                hold(&files, &block, surface.positions(), &all, &what);
            }
        }
    }
}

#[test]
fn files_hold_the_block_of_smooth_vertices() {
    let mut seen = 0;
    for scheme in Scheme::ALL {
        for seed in 0..12 {
            let Some((surface, _)) = random_creased(&small_mesh(scheme, seed), seed) else { continue };
            let Ok(streamed) = StreamedSystem::new(&surface, scheme, &shuffled(surface.len(), seed)) else { continue };
            let stages = Stages::new(&surface, scheme, None).unwrap();
            let points = random_points(surface.len(), seed);
            let right = stages.right_hand_side(&stages.known(&points));
            let vertices = stages.vertices().unwrap();
            seen += 1;
            hold(
                &written(&streamed, &points, Index::Bits32),
                stages.block(),
                &right,
                vertices,
                &format!("{scheme} {seed}"),
            );
        }
    }
    assert!(seen > 20, "{seen}");
}

fn vector(numbers: &[f64]) -> Vec<u8> {
    let head = [1_211_214u32.to_be_bytes(), (numbers.len() as u32).to_be_bytes()].concat();
    [head, numbers.iter().flat_map(|x| x.to_be_bytes()).collect()].concat()
}

#[test]
fn a_solution_read_back_is_the_control_mesh_also_with_creases() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("X.petsc");
    for (k, scheme) in Scheme::ALL.into_iter().enumerate() {
        let mesh = noisy(if scheme.needs_triangles() { "icosphere:2" } else { "quad-sphere:2" });
        let closed = Surface::new(mesh).unwrap();
        let creased = (0..20).find_map(|seed| random_creased(closed.mesh(), seed)).map(|(surface, _)| surface).unwrap();
        for surface in [&closed, &creased] {
            let Ok(streamed) = StreamedSystem::new(surface, scheme, &shuffled(surface.len(), k as u64)) else {
                continue;
            };
            let options = Options { tolerance: Tolerance::Relative(1e-13), ..Options::default() };
            let found = interpolate(surface, scheme, &options).unwrap();
            let numbers: Vec<f64> =
                streamed.vertices().iter().flat_map(|&v| found.points[v as usize].to_array()).collect();
            std::fs::write(&path, vector(&numbers)).unwrap();
            let export = Export::new(&streamed, Index::Bits64).unwrap();
            limitlab::output::write_file(&folder.path().join(ORDER), |out| export.write_order(out)).unwrap();
            let control = read_control(&path, surface, scheme).unwrap();
            assert!(distance(&control, &found.points) < 1e-12 * surface.diagonal(), "{scheme}");
        }
        // Of another mesh.
        let other =
            Surface::new(noisy(if scheme.needs_triangles() { "icosphere:1" } else { "quad-sphere:1" })).unwrap();
        let error = read_control(&path, &other, scheme).unwrap_err().to_string();
        assert!(error.contains("rows, and this mesh has") && error.ends_with("other creases and corners"), "{error}");
    }
}

#[test]
fn bad_files_are_told_by_what_is_wrong_with_them() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("x.petsc");
    let good = vector(&[1.0, 2.0, 3.0]);
    let little: Vec<u8> = [&1_211_214u32.to_le_bytes()[..], &[3, 0, 0, 0], &good[8..]].concat();
    let wide_little = [&1_211_214u64.to_le_bytes()[..], &3u64.to_le_bytes(), &good[8..]].concat();
    let with = |at: usize, bytes: &[u8]| {
        let mut all = good.clone();
        all[at..at + bytes.len()].copy_from_slice(bytes);
        all
    };
    let refused = |bytes: &[u8], read: &dyn Fn(&Path) -> limitlab::Result<()>, parts: &[&str]| {
        std::fs::write(&path, bytes).unwrap();
        let error = read(&path).unwrap_err().to_string();
        for part in parts {
            assert!(error.contains(part), "{error}: no {part}");
        }
        assert!(error.starts_with(path.to_str().unwrap()) && !error.contains(char::is_control), "{error}");
    };
    let points = |path: &Path| read_points(path).map(drop);
    let indices = |path: &Path| read_indices(path).map(drop);
    refused(b"", &points, &["the file is empty", "begins with the number 1211214"]);
    refused(&good[..6], &points, &["ends within its head"]);
    refused(
        &good[..20],
        &points,
        &["3 numbers are announced, 32 bytes with the head, and the file has 20: is it complete?"],
    );
    refused(&[&good[..], &[0]].concat(), &points, &["the file has 33: it goes on after them"]);
    refused(&little, &points, &["little-endian", "big-endian on every machine"]);
    refused(&wide_little, &points, &["little-endian"]);
    refused(&with(4, &(-1i32).to_be_bytes()), &points, &["-1 numbers are announced"]);
    refused(&with(0, &1_211_216u32.to_be_bytes()), &points, &["it holds a matrix, and a vector is needed"]);
    refused(&1_211_216u64.to_be_bytes(), &points, &["it holds a matrix"]);
    refused(&good, &indices, &["it holds a vector, and a list of indices is needed"]);
    refused(b"%%MatrixMarket matrix", &points, &["no binary file of PETSc", "25, 25, 4d"]);
    refused(&with(16, &f64::NAN.to_be_bytes()), &points, &["number 1 is NaN"]);
    refused(&with(8, &f64::INFINITY.to_be_bytes()), &points, &["number 0 is inf"]);
    refused(&vector(&[1.0; 4]), &points, &["4 numbers, and points have three each"]);
    let list = |i: i32| [1_211_218i32, 1, i].map(i32::to_be_bytes).concat();
    refused(&list(-3), &indices, &["index 0 is -3"]);
    let wide = [1_211_218i64, 1, 1 << 32].map(i64::to_be_bytes).concat();
    refused(&wide, &indices, &["index 0 is 4294967296"]);
    refused(&wide[..12], &indices, &["ends within its head"]);

    // What is right, in both widths.
    std::fs::write(&path, &good).unwrap();
    assert_eq!(read_vector(&path).unwrap(), [1.0, 2.0, 3.0]);
    std::fs::write(&path, [&1_211_214u64.to_be_bytes()[..], &3u64.to_be_bytes(), &good[8..]].concat()).unwrap();
    assert_eq!(read_points(&path).unwrap(), [DVec3::new(1.0, 2.0, 3.0)]);
    std::fs::write(&path, list(7)).unwrap();
    assert_eq!(read_indices(&path).unwrap(), [7]);
    assert!(read_vector(&folder.path().join("none")).unwrap_err().to_string().contains("cannot read"));
}

#[test]
fn rows_that_are_not_those_of_the_mesh_are_refused() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("X.petsc");
    let surface = Surface::new(builtin::builtin("tetrahedron").unwrap()).unwrap();
    let read = |order: &[u32], points: usize| {
        std::fs::write(&path, vector(&vec![0.5; 3 * points])).unwrap();
        let head = [1_211_218, order.len() as u32];
        let bytes: Vec<u8> = head.iter().chain(order).flat_map(|i| i.to_be_bytes()).collect();
        std::fs::write(folder.path().join(ORDER), bytes).unwrap();
        read_control(&path, &surface, Scheme::Loop).map_err(|e| e.to_string())
    };
    assert_eq!(read(&[3, 0, 2, 1], 4).unwrap(), [DVec3::splat(0.5); 4]);
    for (order, points, part) in [
        (&[0, 1, 2, 3][..], 3, "X.petsc: 3 points, and the system beside it has 4 rows"),
        (&[0, 1, 2], 3, "3 rows, and this mesh has 4 smooth vertices"),
        (&[0, 1, 2, 4], 4, "row 3 is that of vertex 4, which this mesh does not have"),
        (&[0, 1, 1, 2], 4, "row 2 is that of vertex 1, as one before it is"),
    ] {
        let error = read(order, points).unwrap_err();
        assert!(error.contains(part), "{error}");
    }
    std::fs::remove_file(folder.path().join(ORDER)).unwrap();
    let error = read_control(&path, &surface, Scheme::Loop).unwrap_err().to_string();
    assert!(
        error.contains("order.petsc: there is no such file: a solution is read in the folder of the system"),
        "{error}"
    );
}
