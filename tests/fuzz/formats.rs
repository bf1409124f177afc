//! The mesh formats that are read and written, and what all of them keep.

use std::io::Write;
use std::path::Path;

use glam::DVec3;
use limitlab::Result;
use limitlab::mesh::io::Loaded;
use limitlab::mesh::{Mesh, obj, off, ply, usd};

pub type Read = fn(&[u8], &Path) -> Result<Loaded>;
type WriteTo = fn(&mut dyn Write, &Mesh, Option<&[DVec3]>) -> std::io::Result<()>;

/// A mesh format: what reads it, and what writes it.
pub struct Format {
    pub ending: &'static str,
    pub read: Read,
    pub write: WriteTo,
}

pub const FORMATS: [Format; 4] = [
    Format { ending: ".obj", read: obj::read_bytes, write: obj::write_to },
    Format { ending: ".off", read: off::read_bytes, write: off::write_to },
    Format { ending: ".ply", read: ply::read_bytes, write: ply::write_to },
    Format { ending: ".usda", read: usd::read_bytes, write: usd::write_to },
];

/// All formats keep every bit of a mesh; USD keeps nine digits, and what it has once given.
pub fn writes_and_reads_back(mesh: &Mesh, normals: Option<&[DVec3]>) {
    for Format { ending, read, write } in &FORMATS {
        let mut bytes = Vec::new();
        write(&mut bytes, mesh, normals).unwrap();
        let back = read(&bytes, Path::new("x.mesh")).unwrap();
        assert_eq!(back.mesh.faces, mesh.faces, "{ending}");
        if *ending == ".usda" {
            let mut again = Vec::new();
            write(&mut again, &back.mesh, back.normals.as_deref()).unwrap();
            assert_eq!(again, bytes);
            continue;
        }
        same_bits(&back.mesh.positions, &mesh.positions);
        if let (Some(back), Some(normals)) = (&back.normals, normals) {
            same_bits(back, normals);
        }
    }
}

fn same_bits(a: &[DVec3], b: &[DVec3]) {
    let bits = |points: &[DVec3]| -> Vec<[u64; 3]> { points.iter().map(|p| p.to_array().map(f64::to_bits)).collect() };
    assert_eq!(bits(a), bits(b));
}
