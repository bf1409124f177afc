//! Reading and writing meshes, with tobj on the same OBJ file: `cargo bench --bench files`.

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
