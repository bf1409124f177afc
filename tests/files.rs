//! Mesh files as a whole: round trips, a second reader, the collection of models, damaged files.

use std::io::Write;
use std::path::{Path, PathBuf};

use glam::DVec3;
use limitlab::mesh::io::{self, Loaded};
use limitlab::mesh::{Faces, Mesh, gltf, obj, off, ply, stl, usd, weld};
use proptest::prelude::*;

type Read = fn(&[u8], &Path) -> limitlab::Result<Loaded>;
type Save = fn(&mut dyn Write, &Mesh, Option<&[DVec3]>) -> std::io::Result<()>;

const FORMATS: [(&str, Read, Save); 5] = [
    ("obj", obj::read_bytes, obj::write_to),
    ("off", off::read_bytes, off::write_to),
    ("ply", ply::read_bytes, ply::write_to),
    ("text ply", ply::read_bytes, ply::write_text_to),
    ("usda", usd::read_bytes, usd::write_to),
];

/// Those that are read and not written.
const READ_ONLY: [(&str, Read, Save); 3] = [
    ("stl", stl::read_bytes, write_stl),
    ("text stl", stl::read_bytes, write_text_stl),
    ("glb", gltf::read_bytes, write_glb),
];

/// The corners of the triangles that fans make of the faces, whose vertices are taken round those there are, as numbers.
fn triangles(mesh: &Mesh) -> Vec<[u32; 3]> {
    let there = |v: u32| v % mesh.len() as u32;
    let fan = |f: &[u32]| -> Vec<[u32; 3]> { (2..f.len()).map(|k| [f[0], f[k - 1], f[k]].map(there)).collect() };
    mesh.faces.iter().flat_map(fan).collect()
}

fn write_stl(out: &mut dyn Write, mesh: &Mesh, _: Option<&[DVec3]>) -> std::io::Result<()> {
    let triangles = triangles(mesh);
    out.write_all(&[0x20; 80])?;
    out.write_all(&(triangles.len() as u32).to_le_bytes())?;
    for t in triangles {
        out.write_all(&[0; 12])?;
        for x in t.iter().flat_map(|&v| mesh.positions[v as usize].to_array()) {
            out.write_all(&(x as f32).to_le_bytes())?;
        }
        out.write_all(&[0; 2])?;
    }
    Ok(())
}

fn write_text_stl(out: &mut dyn Write, mesh: &Mesh, _: Option<&[DVec3]>) -> std::io::Result<()> {
    writeln!(out, "solid")?;
    for t in triangles(mesh) {
        writeln!(out, "facet normal 0 0 0\nouter loop")?;
        for p in t.map(|v| mesh.positions[v as usize]) {
            writeln!(out, "vertex {:e} {:e} {:e}", p.x, p.y, p.z)?;
        }
        writeln!(out, "endloop\nendfacet")?;
    }
    writeln!(out, "endsolid")
}

fn write_glb(out: &mut dyn Write, mesh: &Mesh, _: Option<&[DVec3]>) -> std::io::Result<()> {
    let indices = triangles(mesh).concat();
    let coordinates = mesh.positions.iter().flat_map(|p| p.to_array());
    let mut binary: Vec<u8> = coordinates.flat_map(|x| (x as f32).to_le_bytes()).collect();
    let before = binary.len();
    binary.extend(indices.iter().flat_map(|v| v.to_le_bytes()));
    let mut json = serde_json::json!({
        "asset": {"version": "2.0"},
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": mesh.len(), "type": "VEC3"},
            {"bufferView": 1, "componentType": 5125, "count": indices.len(), "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": before},
            {"buffer": 0, "byteOffset": before, "byteLength": binary.len() - before},
        ],
        "buffers": [{"byteLength": binary.len()}],
    })
    .to_string();
    json += &" ".repeat(json.len().next_multiple_of(4) - json.len());
    out.write_all(b"glTF\x02\0\0\0")?;
    out.write_all(&(12 + 8 + json.len() as u32 + 8 + binary.len() as u32).to_le_bytes())?;
    for (kind, chunk) in [(b"JSON", json.as_bytes()), (b"BIN\0", &binary)] {
        out.write_all(&(chunk.len() as u32).to_le_bytes())?;
        out.write_all(kind)?;
        out.write_all(chunk)?;
    }
    Ok(())
}

/// USD holds nine digits: what was read once, reads back equal.
fn as_kept(name: &str, read: Read, write: Save, mesh: &Mesh) -> Mesh {
    match name {
        "usda" => read(&bytes_of(write, mesh, None), Path::new(name)).unwrap().mesh,
        _ => mesh.clone(),
    }
}

fn bytes_of(write: Save, mesh: &Mesh, normals: Option<&[DVec3]>) -> Vec<u8> {
    let mut bytes = Vec::new();
    write(&mut bytes, mesh, normals).unwrap();
    bytes
}

/// The bits of all coordinates; NaNs count as one.
fn bits(points: &[DVec3]) -> Vec<[u64; 3]> {
    let one = |x: f64| if x.is_nan() { f64::NAN } else { x }.to_bits();
    points.iter().map(|p| p.to_array().map(one)).collect()
}

/// Any doubles, all bit patterns among them, and faces of 3 to 9 corners that may point anywhere.
fn any_mesh() -> impl Strategy<Value = (Mesh, Vec<DVec3>)> {
    let coordinate = || {
        prop_oneof![any::<u64>().prop_map(f64::from_bits), -1e3..1e3f64, (-99..99i32).prop_map(f64::from), Just(-0.0),]
    };
    let point = move || [coordinate(), coordinate(), coordinate()].prop_map(DVec3::from);
    let index = prop_oneof![0..20u32, any::<u32>()];
    let faces = prop::collection::vec(prop::collection::vec(index, 3..10), 0..20);
    (prop::collection::vec((point(), point()), 1..20), faces).prop_map(|(points, faces)| {
        let (positions, normals) = points.into_iter().unzip();
        (Mesh::new(positions, Faces::from_lists(faces)), normals)
    })
}

#[test]
fn comments_stand_near_the_top_of_every_format_and_readers_pass_over_them() {
    let positions = [[0.0, 0.0, 0.5], [1.0, 0.25, 0.0], [0.0, 1.0, 0.0]].map(DVec3::from).to_vec();
    let mesh = Mesh::new(positions, Faces::from_lists([[0, 1, 2]]));
    let normals = [DVec3::Z; 3];
    let comments = ["command: x 'y z' # f 1 2 3".to_owned(), "end_header 1".into()];
    for (ending, sign, ascii) in [
        ("obj", "#", false),
        ("off", "#", false),
        ("ply", "comment", false),
        ("ply", "comment", true),
        ("usda", "#", false),
    ] {
        let format: io::Format = ending.parse().unwrap();
        for normals in [None, Some(&normals[..])] {
            let options = io::WriteOptions { normals, ascii, comments: &comments, ..Default::default() };
            let mut bytes = Vec::new();
            io::write_control_to(&mut bytes, format, &mesh, &options).unwrap();
            let top = String::from_utf8_lossy(&bytes[..bytes.len().min(150)]);
            assert!(
                comments.iter().all(|comment| top.contains(&format!("\n{sign} {comment}\n"))
                    || top.starts_with(&format!("{sign} {comment}\n"))),
                "{top}"
            );
            let read = io::read_from(&bytes[..], format, Path::new(ending)).unwrap();
            assert_eq!((&read.mesh.positions, &read.mesh.faces), (&mesh.positions, &mesh.faces), "{ending}");
            // By the polynomial, bit by bit.
            let step = |sum: u32, _| if sum & 1 == 1 { sum >> 1 ^ 0xEDB8_8320 } else { sum >> 1 };
            let sum = bytes.iter().fold(u32::MAX, |sum, &byte| (0..8).fold(sum ^ u32::from(byte), step));
            assert_eq!(read.checksum, Some(!sum), "{ending}");
        }
    }
}

proptest! {
    #[test]
    fn every_mesh_reads_back_bit_by_bit((mesh, normals) in any_mesh(), with_normals: bool) {
        for (name, read, write) in FORMATS {
            let mesh = as_kept(name, read, write, &mesh);
            let normals = as_kept(name, read, write, &Mesh::new(normals.clone(), Faces::default())).positions;
            let normals = with_normals.then_some(normals.as_slice());
            let loaded = read(&bytes_of(write, &mesh, normals), Path::new(name)).unwrap();
            prop_assert_eq!(bits(&loaded.mesh.positions), bits(&mesh.positions));
            prop_assert_eq!(&loaded.mesh.faces, &mesh.faces);
            if name == "obj" {
                prop_assert!(loaded.normals.is_none());
                prop_assert_eq!(loaded.attributes.normals.len(), normals.map_or(0, <[DVec3]>::len));
            } else {
                prop_assert_eq!(loaded.normals.as_deref().map(bits), normals.map(bits));
            }
        }
    }

    /// Of positions there is one vertex each, in the order of the first, and triangles stay as they are.
    #[test]
    fn triangles_of_formats_that_split_vertices_read_back_welded((mesh, _) in any_mesh()) {
        let triangles = triangles(&mesh);
        let corners = triangles.iter().flatten().map(|&v| mesh.positions[v as usize]).collect();
        let soup = Mesh::new(corners, Faces::from_lists((0..triangles.len() as u32).map(|t| [0, 1, 2].map(|k| 3 * t + k))));
        let indexed = Mesh::new(mesh.positions.clone(), Faces::from_lists(&triangles));
        for ((name, read, write), (mut given, single)) in
            READ_ONLY.into_iter().zip([(soup.clone(), true), (soup, false), (indexed, true)])
        {
            if single {
                given.positions.iter_mut().for_each(|p| *p = p.as_vec3().as_dvec3());
            }
            // The bits of a number that is none are not kept in text.
            given.positions.iter_mut().for_each(|p| *p = p.to_array().map(|x| if x.is_nan() { f64::NAN } else { x }).into());
            let found = read(&bytes_of(write, &given, None), Path::new(name)).unwrap();
            let expected = weld::weld(&given).mesh;
            prop_assert_eq!(bits(&found.mesh.positions), bits(&expected.positions), "{}", name);
            prop_assert_eq!(&found.mesh.faces, &expected.faces, "{}", name);
            prop_assert_eq!(found.remarks.len(), usize::from(expected.len() < given.len()), "{}", name);
        }
    }

    #[test]
    fn no_bytes_make_a_reader_panic(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        for (_, read, _) in FORMATS.into_iter().chain(READ_ONLY) {
            refused_or_consistent(read, &bytes);
        }
    }

    #[test]
    fn no_words_of_the_formats_make_a_reader_panic(
        words in prop::collection::vec(prop::sample::select(WORDS.as_slice()), 0..40),
        start in prop::sample::select(["", "OFF\n", PLY_ASCII, PLY_BIG, USD_BODY, USD_LIST, STL, GLTF].as_slice()),
    ) {
        let text = format!("{start}{}", words.concat());
        for (_, read, _) in FORMATS.into_iter().chain(READ_ONLY) {
            refused_or_consistent(read, text.as_bytes());
        }
    }

    #[test]
    fn no_damage_makes_a_reader_panic(
        (mesh, normals) in any_mesh(),
        damage in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0..4usize), 1..8),
    ) {
        for (_, read, write) in FORMATS.into_iter().chain(READ_ONLY) {
            let mut bytes = bytes_of(write, &mesh, Some(&normals));
            for &(place, value, kind) in &damage {
                let at = place.index(bytes.len());
                match kind {
                    0 => bytes[at] = value,
                    1 => bytes.insert(at, value),
                    2 => bytes[at] ^= 1 << (value % 8),
                    _ => { bytes.splice(at..(at + usize::from(value)).min(bytes.len() - 1), []); }
                }
            }
            refused_or_consistent(read, &bytes);
        }
    }
}

const WORDS: [&str; 57] = [
    "facet normal 0 0 1 ",
    "outer loop ",
    "vertex 1 2 3 ",
    "endloop ",
    "endfacet ",
    "endsolid\n",
    "\"accessors\": ",
    "\"POSITION\": ",
    "\"indices\": ",
    "\"primitives\": ",
    "\"nodes\": ",
    "\"count\": ",
    "v ",
    "f ",
    "vn ",
    "0",
    "1",
    "-1",
    "3 ",
    " ",
    "\n",
    "\r",
    "\\\n",
    "#",
    "/",
    "//",
    "1.5 ",
    "nan ",
    "1e999 ",
    "4294967296 ",
    "99999999999999999999 ",
    "\n3 0 1 2\n",
    "v 0 0 0\n",
    "f 1 2 3\n",
    "1 1 0\n",
    "NOFF\n",
    "property ",
    "element face 1000000000000\n",
    "list uchar int vertex_indices\n",
    "end_header\n",
    "\0",
    "\u{e9}",
    "t crease 2/1/0 0 1 10\n",
    "t corner 1/1/0 ",
    "[",
    "]",
    "(0, 0, 0), ",
    ")",
    "{",
    "}",
    ",",
    "\"",
    "= ",
    "int[] faceVertexCounts = [3]\n",
    "int[] faceVertexIndices = [0, 0, 0]\n",
    "int[] creaseIndices = [0, 0]\nint[] creaseLengths = [2]\nfloat[] creaseSharpnesses = [1]\n",
    "def Mesh \"m\" ",
];
const PLY_ASCII: &str = "ply\nformat ascii 1.0\nelement vertex 1\nproperty int x\nproperty char y\nproperty double z\n\
                         element face 2\nproperty list char int vertex_index\nend_header\n";
const PLY_BIG: &str = "ply\nformat binary_big_endian 1.0\nelement vertex 1\nproperty char x\nproperty char y\n\
                       property char z\nelement face 2\nproperty list char char vertex_index\nend_header\n";

const STL: &str = "solid x\nfacet normal 0 0 1 outer loop vertex 0 0 0 vertex 1 0 0 vertex 0 1 0 endloop ";
const GLTF: &str = "{\"meshes\": [{\"primitives\": [{\"attributes\": {\"POSITION\": 0}}]}], ";
const USD_BODY: &str = "#usda 1.0\ndef Mesh \"m\" {\n";
const USD_LIST: &str = "#usda 1.0\ndef Mesh \"m\" {\npoint3f[] points = [(0, 0, 0), (1";

/// A reader may refuse, in one line that starts with the path; what it gives must agree with itself.
fn refused_or_consistent(read: Read, bytes: &[u8]) {
    match read(bytes, Path::new("some.file")) {
        Err(error) => {
            let text = error.to_string();
            assert!(text.starts_with("some.file"), "{text}");
            assert!(!text.contains(['\n', '\r']), "{text}");
        }
        Ok(loaded) => {
            assert!(loaded.mesh.faces.iter().all(|f| f.len() >= 3));
            let vertices = loaded.mesh.len();
            assert!(loaded.normals.is_none_or(|n| n.len() == vertices));
            if let Some(lines) = loaded.lines {
                assert_eq!(lines.vertices.len(), vertices);
                assert_eq!(lines.faces.len(), loaded.mesh.faces.len());
                assert!(lines.vertices.is_sorted() && lines.faces.is_sorted());
            }
        }
    }
}

fn prism() -> Mesh {
    let ring = |z: f64| {
        (0..3).map(move |k| {
            let (sin, cos) = (f64::from(k) * std::f64::consts::TAU / 3.0).sin_cos();
            DVec3::new(cos, sin, z)
        })
    };
    let faces: [&[u32]; 5] = [&[2, 1, 0], &[3, 4, 5], &[0, 1, 4, 3], &[1, 2, 5, 4], &[2, 0, 3, 5]];
    Mesh::new(ring(0.0).chain(ring(1.0)).collect(), Faces::from_lists(faces))
}

#[test]
fn a_file_cut_anywhere_is_refused_or_says_so() {
    let mesh = prism();
    let normals = mesh.positions.clone();
    for normals in [None, Some(normals.as_slice())] {
        for (name, read, write) in FORMATS {
            let bytes = bytes_of(write, &mesh, normals);
            for length in 0..bytes.len() {
                let cut = &bytes[..length];
                let Ok(loaded) = read(cut, Path::new(name)) else {
                    continue;
                };
                match name {
                    // No counts are announced: whole lines are a file, and a part of a line is remarked.
                    "obj" => {
                        let starting = |word: &[u8]| cut.split(|&b| b == b'\n').filter(|l| l.starts_with(word)).count();
                        assert_eq!(loaded.mesh.len(), starting(b"v "));
                        assert_eq!(loaded.mesh.faces.len(), starting(b"f"));
                        let told = loaded.remarks.iter().any(|r| r.contains("cut off"));
                        assert_eq!(told, cut.last() != Some(&b'\n'));
                    }
                    // Without the last line end, nothing is missing.
                    "off" | "text ply" => assert_eq!((length, &loaded.mesh), (bytes.len() - 1, &mesh)),
                    "usda" => assert_eq!((length, &loaded.mesh.faces), (bytes.len() - 1, &mesh.faces)),
                    _ => panic!("{length} of {} bytes were taken for the whole", bytes.len()),
                }
            }
        }
    }
}

#[test]
fn absurd_counts_are_refused_where_the_data_end() {
    for text in [
        "OFF\n1000000000000 1000000000000 0\n0 0 0\n",
        "OFF\n1 1 0\n0 0 0\n1000000000000 0 0 0\n",
        "ply\nformat ascii 1.0\nelement vertex 1000000000000\nproperty float x\nproperty float y\nproperty float z\n\
         element face 1000000000000\nproperty list int int vertex_index\nend_header\n0 0 0\n",
        "ply\nformat binary_little_endian 1.0\nelement junk 1000000000000\nelement other 1000000000000\n\
         property list uint double w\nelement vertex 0\nproperty float x\nproperty float y\nproperty float z\n\
         element face 0\nproperty list int int vertex_index\nend_header\nabc",
    ] {
        let read = if text.starts_with("OFF") { off::read_bytes } else { ply::read_bytes };
        let error = read(text.as_bytes(), Path::new("a")).unwrap_err().to_string();
        assert!(error.contains("the file ends where"), "{error}");
    }
}

/// The faces as lists of positions, which do not depend on the numbering of the vertices.
fn by_position(mesh: &Mesh) -> Vec<Vec<[u64; 3]>> {
    let positions = bits(&mesh.positions);
    mesh.faces.iter().map(|face| face.iter().map(|&v| positions[v as usize]).collect()).collect()
}

/// Of a corner the position, the texture coordinates and the normal.
type SeenCorner = [Vec<f64>; 3];

/// What `tobj` makes of an OBJ file: for every run of faces its group, its material, and its corners.
fn seen_by_tobj(bytes: &[u8]) -> Vec<(String, Option<usize>, Vec<SeenCorner>)> {
    let named = |name: &str| tobj::Material { name: name.into(), ..Default::default() };
    let materials = |_: &Path| {
        let names = ["wood", "dark stone"];
        Ok((names.map(named).into(), names.into_iter().map(String::from).zip(0..).collect()))
    };
    let mut reader = std::io::BufReader::new(bytes);
    let (models, _) = tobj::load_obj_buf(&mut reader, &tobj::LoadOptions::default(), materials).unwrap();
    let of_model = |tobj::Model { mesh, name }| {
        let at = |values: &[f64], indices: &[u32], k: usize, size: usize| -> Vec<f64> {
            let place = indices.get(k).map_or(0, |&i| i as usize) * size;
            values.get(place..place + size).unwrap_or_default().to_vec()
        };
        let corner = |k: usize| {
            [
                at(&mesh.positions, &mesh.indices, k, 3),
                at(&mesh.texcoords, &mesh.texcoord_indices, k, 2),
                at(&mesh.normals, &mesh.normal_indices, k, 3),
            ]
        };
        (name, mesh.material_id, (0..mesh.indices.len()).map(corner).collect())
    };
    models.into_iter().map(of_model).collect()
}

/// What `tobj` makes of an OBJ file. It gives each group vertices of its own, numbered by first use.
fn by_position_tobj(bytes: &[u8]) -> Vec<Vec<[u64; 3]>> {
    let options = tobj::LoadOptions::default();
    let mut reader = std::io::BufReader::new(bytes);
    let (models, _) = tobj::load_obj_buf(&mut reader, &options, |_| Ok(Default::default())).unwrap();
    let mut faces = Vec::new();
    for model in models {
        let mesh = model.mesh;
        let positions: Vec<_> = mesh.positions.chunks_exact(3).map(DVec3::from_slice).collect();
        let positions = bits(&positions);
        let mut indices = mesh.indices.iter();
        let sizes = match mesh.face_arities.as_slice() {
            [] => vec![3; mesh.indices.len() / 3],
            sizes => sizes.to_vec(),
        };
        for size in sizes {
            let face = indices.by_ref().take(size as usize);
            faces.push(face.map(|&i| positions[i as usize]).collect());
        }
    }
    faces
}

proptest! {
    /// Texture coordinates, normals, groups and materials are the same to another reader after we have read and written them.
    #[test]
    fn attributes_reach_tobj_unchanged(
        faces in prop::collection::vec(
            (prop::collection::vec((1..6i64, 1..8i64, 1..5i64), 3..7), 0..4usize, any::<bool>(), 0..7usize),
            1..20,
        ),
    ) {
        let mut text = String::from("mtllib a.mtl\n");
        (0..5).for_each(|k| text += &format!("v {k} {} 0.1\n", k * k));
        (0..7).for_each(|k| text += &format!("vt 0.{k} {k}e-3\n"));
        (0..4).for_each(|k| text += &format!("vn {k} 0 -1\n"));
        for (corners, form, negative, before) in faces {
            text += ["g one\n", "o two\n", "usemtl wood\n", "usemtl dark stone\n", "s 1\n", "s off\n", ""][before];
            text += "f";
            for (v, t, n) in corners {
                let back = if negative { [6, 8, 5] } else { [0; 3] };
                let [v, t, n] = [v - back[0], t - back[1], n - back[2]];
                text += &[format!(" {v}"), format!(" {v}/{t}"), format!(" {v}//{n}"), format!(" {v}/{t}/{n}")][form];
            }
            text += "\n";
        }
        let loaded = obj::read_bytes(text.as_bytes(), Path::new("a.obj")).unwrap();
        prop_assert!(loaded.remarks.is_empty(), "{:?}", loaded.remarks);
        let mut written = Vec::new();
        let options = io::WriteOptions { attributes: Some(&loaded.attributes), ..Default::default() };
        obj::write_control_to(&mut written, &loaded.mesh, &options).unwrap();
        prop_assert_eq!(seen_by_tobj(&written), seen_by_tobj(text.as_bytes()));
    }

    /// Random meshes written in all the ways that OBJ has, read by us and by `tobj`.
    #[test]
    fn obj_agrees_with_tobj(
        points in prop::collection::vec(prop::array::uniform3(-1e9..1e9f64), 3..12),
        faces in prop::collection::vec(
            (prop::collection::vec(any::<prop::sample::Index>(), 3..7), 0..4usize, any::<bool>(), 0..6usize),
            1..20,
        ),
    ) {
        let mut text = String::from("# made up\nvt 0 1\nvn 0 0 1\n");
        for [x, y, z] in &points {
            text += &format!("v {x} {y:e}\t{z}\n");
        }
        for (corners, form, negative, before) in faces {
            text += ["g one two\n", "o three\n", "s off\n", "\n", "# f 1 2 3\n", ""][before];
            text += "f";
            for corner in corners {
                let v = corner.index(points.len()) as i64;
                let v = if negative { v - points.len() as i64 } else { v + 1 };
                text += &format!(" {v}{}", ["", "/1", "//1", "/1/1"][form]);
            }
            text += if before == 3 { "\r\n" } else { "\n" };
        }
        let ours = obj::read_bytes(text.as_bytes(), Path::new("a.obj")).unwrap();
        prop_assert_eq!(by_position(&ours.mesh), by_position_tobj(text.as_bytes()));
    }
}

/// The folder of models beside the repository, if it is there.
fn collection() -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/meshes");
    if !folder.is_dir() {
        let _ = writeln!(std::io::stderr(), "skipped: no ../shared/meshes");
        return None;
    }
    Some(folder)
}

#[test]
fn the_collection_is_read_with_its_listed_counts() {
    let Some(folder) = collection() else { return };
    let manifest = std::fs::read_to_string(folder.join("MANIFEST.tsv")).unwrap();
    let mut rows =
        csv::ReaderBuilder::new().delimiter(b'\t').quoting(false).flexible(true).from_reader(manifest.as_bytes());
    let mut listed = 0;
    for row in rows.records() {
        let row = row.unwrap();
        let file = &row[0];
        listed += 1;
        let result = io::read(&folder.join(file));
        if file.contains("4off") {
            let error = result.unwrap_err().to_string();
            assert!(error.contains("line 1: \"4OFF\" is not a mesh in space"), "{error}");
            continue;
        }
        let loaded = result.unwrap();
        let counts = [loaded.mesh.len(), loaded.mesh.faces.len()].map(|n| n.to_string());
        assert_eq!(counts, [&row[2], &row[4]], "{file}");
        let sizes =
            |wanted: fn(usize) -> bool| loaded.mesh.faces.iter().filter(|f| wanted(f.len())).count().to_string();
        let sizes = [sizes(|n| n == 3), sizes(|n| n == 4), sizes(|n| n > 4)];
        assert_eq!(sizes, [&row[5], &row[6], &row[7]], "{file}");
    }
    let files: usize =
        ["closed", "open", "bad"].iter().map(|part| std::fs::read_dir(folder.join(part)).unwrap().count()).sum();
    assert_eq!(listed, files);
}

#[test]
fn the_collection_goes_through_all_formats_and_past_tobj() {
    let Some(folder) = collection() else { return };
    for part in ["closed", "open"] {
        for entry in std::fs::read_dir(folder.join(part)).unwrap() {
            let mesh = io::read(&entry.unwrap().path()).unwrap().mesh;
            for (name, read, write) in FORMATS {
                let mesh = as_kept(name, read, write, &mesh);
                let bytes = bytes_of(write, &mesh, None);
                assert_eq!(read(&bytes, Path::new(name)).unwrap().mesh, mesh);
                if name == "obj" {
                    assert_eq!(by_position_tobj(&bytes), by_position(&mesh));
                }
            }
        }
    }
}

/// Writing where nothing may be written. Root may write into a locked folder, but creates nothing in `/sys`.
#[test]
#[cfg(unix)]
fn an_unwritable_folder_is_an_error() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    let locked = folder.path().join("locked");
    std::fs::create_dir(&locked).unwrap();
    std::fs::set_permissions(&locked, std::fs::Permissions::from_mode(0o555)).unwrap();
    let path = if std::fs::write(locked.join("probe"), "").is_ok() {
        PathBuf::from("/sys/limitlab.off")
    } else {
        locked.join("a.off")
    };
    let error = io::write(&path, &prism(), None).unwrap_err().to_string();
    assert!(error.starts_with(&format!("{}: cannot write: ", path.display())), "{error}");
}
