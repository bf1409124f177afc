//! The Matrix Market files, read back by sprs and by a reader that knows arrays.

use std::io::Write;
use std::path::{Path, PathBuf};

use limitlab::assemble::{Csr, matrix_market};
use limitlab::output::write_file;
use limitlab::schemes::Scheme;
use sprs::io::read_matrix_market;

use crate::common::matrix_market::read_array;
use crate::common::meshes::*;

fn write(folder: &Path, name: &str, fill: impl FnOnce(&mut dyn Write) -> std::io::Result<()>) -> PathBuf {
    let path = folder.join(name);
    write_file(&path, fill).unwrap();
    path
}

/// Reads with sprs; 17 digits give every double back.
fn assert_reads_back(path: &Path, matrix: &Csr) {
    let read = read_matrix_market::<f64, u32, _>(path).unwrap().to_csr::<u32>();
    assert_eq!(read.shape(), (matrix.len(), matrix.len()));
    assert_eq!(read.nnz(), matrix.values().len());
    assert_eq!(read.indices(), matrix.pattern().columns());
    assert_eq!(read.data(), matrix.values());
}

#[test]
fn matrices_and_arrays_read_back_bit_by_bit() {
    let folder = tempfile::tempdir().unwrap();
    for scheme in Scheme::ALL {
        for seed in 0..10 {
            let mesh = scattered(&small_mesh(scheme, seed), seed);
            let system = system(&mesh, scheme);
            let path = write(folder.path(), "A.mtx", |out| matrix_market::write_general(&system.a, &[], out));
            assert_reads_back(&path, &system.a);
            let path = write(folder.path(), "M.mtx", |out| matrix_market::write_symmetric(&system.m, &[], out));
            let text = std::fs::read_to_string(&path).unwrap();
            assert!(text.starts_with("%%MatrixMarket matrix coordinate real symmetric\n"));
            let lower = (0..mesh.len()).flat_map(|i| system.m.row(i).filter(move |e| e.0 <= i)).count();
            assert_eq!(text.lines().count(), 2 + lower);
            assert_reads_back(&path, &system.m);

            let path = write(folder.path(), "H.mtx", |out| matrix_market::write_vector(&system.h, &[], out));
            assert_eq!(read_array(&path), vec![system.h.clone()]);
            let path = write(folder.path(), "P.mtx", |out| matrix_market::write_points(&mesh.positions, &[], out));
            let columns: Vec<Vec<f64>> = (0..3).map(|axis| mesh.positions.iter().map(|p| p[axis]).collect()).collect();
            assert_eq!(read_array(&path), columns);
        }
    }
}
