//! Reading and writing meshes, with tobj on the same OBJ file: `cargo bench --bench files`.
//!
//! By hand, at 10⁶ vertices and as many quads, 17 digits a coordinate (OBJ 91 MB, OFF and text PLY 89 MB, binary PLY 41 MB), in turn
//! on a machine of two cores that had no other work: milliseconds by the wall on two threads, the least of five, and of three such
//! the median; before reading and writing was done in parts and on one thread, and since.
//!
//! | | before | in parts | MB/s |
//! |---|---|---|---|
//! | OBJ, read / written | 379 / 330 | 120 / 126 | 757 / 720 |
//! | OFF, read / written | 325 / 322 | 115 / 121 | 772 / 734 |
//! | text PLY, read / written | 332 / 332 | 110 / 125 | 807 / 710 |
//! | the OBJ by fast_obj (d620667, one thread), rapidobj (fe4c779, two), both in single precision, read | 131, 130 | | 693, 698 |
//! | the OBJ by trimesh 5.2, meshio 5.3, read | 3761, 7722 | | 24, 12 |
//!
//! Binary PLY was read in 61.7 ms and is in 49.3 (831 MB/s); of bytes in memory 48.7 and 36.4. Nearly half of that is the
//! system's, which copies the file and clears memory, as it is of the time of a text file.

#![allow(missing_docs, reason = "the functions that criterion's macro writes")]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use limitlab::mesh::{builtin::builtin, io, noise::add_noise};

fn files(c: &mut Criterion) {
    let mut mesh = builtin("irregular-quad:100000").expect("a mesh");
    add_noise(&mut mesh, 0.1, 1);
    let folder = tempfile::tempdir().expect("a folder");
    let mut group = c.benchmark_group("files");
    group.sample_size(10);
    for ending in ["off", "obj", "ply", "usda"] {
        let path = folder.path().join(format!("mesh.{ending}"));
        io::write(&path, &mesh, None).expect("a file");
        let bytes = std::fs::metadata(&path).expect("a file").len();
        group.throughput(Throughput::Bytes(bytes));
        group.bench_function(format!("read {ending}"), |b| b.iter(|| io::read(&path)));
        group.bench_function(format!("write {ending}"), |b| {
            b.iter(|| io::write(&path, &mesh, None));
        });
        if ending == "obj" {
            group.bench_function("read obj by tobj", |b| {
                b.iter(|| tobj::load_obj(&path, &tobj::LoadOptions::default()));
            });
        }
    }
    group.finish();
}

criterion_group!(benches, files);
criterion_main!(benches);
