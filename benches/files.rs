//! Reading and writing meshes, with tobj on the same OBJ file: `cargo bench --bench files`.
//!
//! By hand, at 10⁶ vertices and as many quads, 17 digits a coordinate (OBJ 91 MB, OFF 89 MB), least of three in turn, on two
//! cores that had other work too: milliseconds of the processor for all threads, before reading and writing was done in parts
//! and on one thread, and since.
//!
//! | | before | in parts |
//! |---|---|---|
//! | OBJ, read / written | 390 / 333 | 207 / 190 |
//! | OFF, read / written | 373 / 327 | 235 / 180 |
//! | text PLY, read / written | 360 / 340 | 297 / 213 |
//! | the OBJ by fast_obj (d620667, one thread), rapidobj (fe4c779, two), both in single precision, read | 159, 250 | |
//! | the OBJ by trimesh 5.2, meshio 5.3, read | 3761, 7722 | |
//!
//! The system takes some 45 % of a read, to copy the file and to clear memory.

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
