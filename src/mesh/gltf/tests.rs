use std::path::PathBuf;

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use serde_json::{Value, json};

use super::*;

const POINTS: [[f32; 3]; 5] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.1], [0.0, 2.0, 0.0], [0.0, 2.0, 0.0], [3.0, 2.0, 1.0]];
/// Two triangles side by side, whose common edge has one vertex twice.
const CORNERS: [u32; 6] = [0, 1, 2, 3, 1, 4];

/// Positions at byte 0, with a normal after each; indices of 1, 2 and 4 bytes at 120, 128 and 140.
fn binary() -> Vec<u8> {
    let mut bytes: Vec<u8> =
        POINTS.iter().flat_map(|p| p.iter().chain(&[0.0, 0.0, 1.0])).flat_map(|x| x.to_le_bytes()).collect();
    bytes.extend(CORNERS.map(|v| v as u8));
    bytes.extend([0, 0]);
    bytes.extend(CORNERS.iter().flat_map(|&v| (v as u16).to_le_bytes()));
    bytes.extend(CORNERS.iter().flat_map(|v| v.to_le_bytes()));
    bytes
}

fn document() -> Value {
    let index =
        |view: usize, kind: u64| json!({"bufferView": view, "componentType": kind, "count": 6, "type": "SCALAR"});
    let at = |offset: usize, length: usize| json!({"buffer": 0, "byteOffset": offset, "byteLength": length});
    json!({
        "asset": {"version": "2.0"},
        "meshes": [{"name": "Sail", "primitives": [
            {"attributes": {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 7}, "indices": 3, "material": 0}
        ]}],
        "accessors": [
            {"bufferView": 0, "componentType": FLOAT, "count": 5, "type": "VEC3"},
            {"bufferView": 0, "componentType": FLOAT, "count": 5, "type": "VEC3", "byteOffset": 12},
            index(1, UNSIGNED_BYTE),
            index(2, UNSIGNED_SHORT),
            index(3, UNSIGNED_INT),
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": 120, "byteStride": 24},
            at(120, 6), at(128, 12), at(140, 24),
        ],
        "buffers": [{"byteLength": 164}],
    })
}

fn glb(document: &Value) -> Vec<u8> {
    let mut json = document.to_string().into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let binary = binary();
    let chunk =
        |kind: u32, bytes: &[u8]| [&(bytes.len() as u32).to_le_bytes()[..], &kind.to_le_bytes(), bytes].concat();
    let chunks = [chunk(0x4E4F_534A, &json), chunk(0x004E_4942, &binary)].concat();
    [&b"glTF\x02\0\0\0"[..], &(chunks.len() as u32 + 12).to_le_bytes(), &chunks].concat()
}

fn parse(bytes: &[u8]) -> Result<Loaded> {
    read_bytes(bytes, Path::new("a.glb"))
}

/// The document with one value changed, by its JSON pointer; null takes it away.
fn changed(pointer: &str, value: Value) -> Value {
    let mut document = document();
    let (parent, key) = pointer.rsplit_once('/').unwrap();
    let parent = document.pointer_mut(parent).unwrap();
    match (parent, value) {
        (Value::Object(map), Value::Null) => drop(map.remove(key)),
        (Value::Object(map), value) => drop(map.insert(key.into(), value)),
        (Value::Array(list), value) => list[key.parse::<usize>().unwrap()] = value,
        _ => panic!("{pointer}"),
    }
    document
}

fn refusal(bytes: &[u8]) -> String {
    let text = parse(bytes).unwrap_err().to_string();
    assert!(!text.contains('\n'), "{text}");
    text
}

/// The points as doubles.
fn points() -> Vec<DVec3> {
    POINTS.map(|p| DVec3::from(p.map(f64::from))).to_vec()
}

/// Without the second of the two at one position.
fn joined_points() -> Vec<DVec3> {
    let mut points = points();
    points.remove(3);
    points
}

#[test]
fn split_vertices_are_joined_and_indices_may_be_of_any_size() {
    for accessor in [2, 3, 4] {
        let loaded = parse(&glb(&changed("/meshes/0/primitives/0/indices", accessor.into()))).unwrap();
        assert_eq!(loaded.mesh.positions, joined_points());
        assert_eq!(loaded.mesh.faces.corners(), [0, 1, 2, 2, 1, 3]);
        assert!(loaded.lines.is_none() && loaded.normals.is_none());
        assert_eq!((loaded.stage.is_z_up, loaded.stage.meters_per_unit), (Some(false), Some(1.0)));
        let joined = "5 vertices lie at 4 positions, each of which is one vertex: glTF splits them where normals or \
                      texture coordinates differ";
        assert_eq!(loaded.remarks, ["not kept: NORMAL, TEXCOORD_0, materials", joined]);
    }
}

#[test]
fn buffers_are_in_the_file_or_beside_it() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("two words.bin"), binary()).unwrap();
    let data = |padding: &str| {
        let text = BASE64_STANDARD.encode(binary());
        format!("data:application/octet-stream;base64,{}{padding}", text.trim_end_matches('='))
    };
    for uri in ["two%20words.bin".to_owned(), "./two words.bin".into(), data(""), data("=")] {
        let path = folder.path().join("a.gltf");
        let text = serde_json::to_string_pretty(&changed("/buffers/0/uri", uri.into())).unwrap();
        std::fs::write(&path, &text).unwrap();
        let loaded = crate::mesh::io::read(&path).unwrap();
        assert_eq!((loaded.mesh.positions, loaded.checksum), (joined_points(), Some(crc32fast::hash(text.as_bytes()))));
    }
    let folder = folder.path().file_name().unwrap().to_string_lossy().into_owned();
    let absolute = PathBuf::from("/").join(folder);
    for (uri, what) in [
        ("gone.bin", "buffers[0]: cannot read \"gone.bin\": "),
        ("..", "buffers[0]: \"..\" is no file"),
        ("https://example.org/a.bin", "is no file beside"),
        (absolute.to_str().unwrap(), "is no file beside"),
        ("data:text/plain,x", "buffers[0]: its data are not in base64"),
        ("data:;base64,A*", "buffers[0]: its data are not in base64: "),
        ("data:;base64,AAAA", "buffers[0]: 3 of its 164 bytes are there"),
    ] {
        let found = refusal(&glb(&changed("/buffers/0/uri", uri.into())));
        assert!(found.contains(what), "{found}");
    }
}

#[test]
fn primitives_share_positions_and_need_no_indices() {
    let mut document = document();
    let primitive =
        |indices: Option<u64>, mode: u64| json!({"attributes": {"POSITION": 0}, "indices": indices, "mode": mode});
    document["accessors"][0]["count"] = 3.into();
    document["meshes"][0]["primitives"] = json!([primitive(None, 4), primitive(None, 4), primitive(Some(9), 1)]);
    let loaded = parse(&glb(&document)).unwrap();
    assert_eq!((loaded.mesh.len(), loaded.mesh.faces.corners()), (3, &[0, 1, 2, 0, 1, 2][..]));
    assert_eq!(loaded.remarks, ["not kept: primitives of points and lines (1)"]);
}

#[test]
fn the_transform_of_the_node_and_of_those_above_is_applied() {
    // Twice as large, a quarter turn around z, then 10 upward: (x, y, z) → (−2y, 2x, 2z + 10).
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let turned = json!({"mesh": 0, "scale": [2, 2, 2], "rotation": [0, 0, half, half]});
    let above = json!({"children": [1], "translation": [0, 0, 10]});
    let by_columns = json!({"mesh": 0, "matrix": [0, 2, 0, 0, -2, 0, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1]});
    let expected = |p: DVec3| DVec3::new(-2.0 * p.y, 2.0 * p.x, 2.0 * p.z + 10.0);
    for nodes in [json!([above, turned]), json!([above, by_columns])] {
        for scenes in [json!(null), json!([{"nodes": [0]}])] {
            let mut document = changed("/nodes", nodes.clone());
            if scenes.is_array() {
                document["scenes"] = scenes;
            }
            let mesh = parse(&glb(&document)).unwrap().mesh;
            let far = mesh.positions.iter().zip(joined_points()).map(|(p, q)| (*p - expected(q)).length());
            assert!(far.fold(0.0, f64::max) < 1e-14, "{mesh:?}");
            assert_eq!(mesh.faces.corners(), [0, 1, 2, 2, 1, 3]);
        }
    }
    let mirrored = parse(&glb(&changed("/nodes", json!([{"mesh": 0, "scale": [-1, 1, 1]}])))).unwrap().mesh;
    assert_eq!(mirrored.positions[1].to_array(), [-1.0, 0.0, f64::from(0.1f32)]);
    assert_eq!(mirrored.faces.corners(), [0, 2, 1, 2, 3, 1]);
    for (nodes, remark) in [
        (json!([{"mesh": 0, "skin": 0, "scale": [2, 2, 2]}]), Some("its skin is not applied")),
        (json!([{"scale": [2, 2, 2]}]), Some("no node of the scene shows the mesh")),
        (json!([{"mesh": 0}]), None),
    ] {
        let loaded = parse(&glb(&changed("/nodes", nodes))).unwrap();
        assert_eq!(loaded.mesh.positions, joined_points());
        assert_eq!(remark.is_some_and(|r| loaded.remarks[0].starts_with(r)), remark.is_some());
    }
}

#[test]
fn what_is_not_read_is_refused_with_its_place() {
    let primitive = "/meshes/0/primitives/0";
    let at = |part: &str| format!("{primitive}{part}");
    let in_primitive = |what: &str| format!("meshes[0].primitives[0]: {what}");
    for (pointer, value, message) in [
        ("/meshes".into(), json!([]), "the file holds no mesh".to_owned()),
        (
            "/meshes".into(),
            json!([{"name": "A", "primitives": []}, {"name": "B\u{1b}", "primitives": []}]),
            "2 meshes, \"A\", \"B\\u{1b}\": save them in a file each".into(),
        ),
        ("/nodes".into(), json!([{"mesh": 0}, {"mesh": 0}]), "2 nodes show the mesh, nodes[0] and nodes[1]".into()),
        (
            "/nodes".into(),
            json!([{"children": [1]}, {"children": [1]}]),
            "nodes[1] hangs on two nodes, or on itself".into(),
        ),
        ("/nodes".into(), json!([{"children": [5]}]), "nodes[5] is not there".into()),
        ("/scene".into(), json!(3), "scenes[3] is not there".into()),
        (
            "/extensionsRequired".into(),
            json!(["KHR_materials_unlit", "KHR_draco_mesh_compression"]),
            "the file requires the extension \"KHR_draco_mesh_compression\", which is not read".into(),
        ),
        (at("/mode"), json!(5), in_primitive("mode 5, strips and fans")),
        (at("/mode"), json!(7), in_primitive("7 is no mode of glTF")),
        (at("/attributes/POSITION"), json!(null), in_primitive("it has no POSITION")),
        (at("/attributes/POSITION"), json!(9), in_primitive("accessors[9] is not there")),
        (
            at("/attributes/POSITION"),
            json!(3),
            in_primitive("accessors[3] is \"SCALAR\" of components 5123, where VEC3 of 5126"),
        ),
        (
            at("/indices"),
            json!(0),
            in_primitive("accessors[0] is \"VEC3\" of components 5126, where SCALAR of 5121, 5123, 5125"),
        ),
        (at("/indices"), json!(null), in_primitive("its 5 corners are no whole number of triangles")),
        ("/accessors/0/count".into(), json!(4), in_primitive("index 5 of accessors[3] is 4, and there are 4 vertices")),
        ("/accessors/0/count".into(), json!(6), in_primitive("accessors[0] reaches beyond bufferViews[0]")),
        ("/accessors/0/count".into(), json!(u64::MAX), in_primitive("accessors[0] reaches beyond bufferViews[0]")),
        ("/accessors/3/byteOffset".into(), json!(1), in_primitive("accessors[3] reaches beyond bufferViews[2]")),
        ("/accessors/0/sparse".into(), json!({"count": 1}), in_primitive("accessors[0] is sparse")),
        ("/accessors/0/bufferView".into(), json!(null), in_primitive("accessors[0] has no bufferView")),
        ("/accessors/0/bufferView".into(), json!(8), in_primitive("bufferViews[8] is not there")),
        ("/bufferViews/0/byteStride".into(), json!(8), in_primitive("bufferViews[0] has elements of 8 bytes")),
        ("/bufferViews/2/byteOffset".into(), json!(160), in_primitive("bufferViews[2] reaches beyond buffers[0]")),
        ("/bufferViews/2/byteOffset".into(), json!(u64::MAX), in_primitive("bufferViews[2] reaches beyond buffers[0]")),
        ("/bufferViews/0/buffer".into(), json!(1), in_primitive("buffers[1] is not there")),
        ("/buffers/0/byteLength".into(), json!(165), "buffers[0]: 164 of its 165 bytes are there".into()),
        ("/buffers/0".into(), json!({"byteLength": -1}), "line 1, column ".into()),
        ("/accessors/0/count".into(), json!("many"), "line 1, column ".into()),
    ] {
        let found = refusal(&glb(&changed(&pointer, value)));
        assert!(found.starts_with(&format!("a.glb: {message}")), "{found}");
    }
}

#[test]
fn broken_containers_and_broken_json_are_refused_with_their_place() {
    let whole = glb(&document());
    for (bytes, message) in [
        (&whole[..whole.len() - 1], "a.glb: the file ends within the chunk at byte "),
        (&whole[..10], "a.glb: the file ends within the chunk at byte 8"),
        (&b"glTF\x01\0\0\0\x0C\0\0\0"[..], "a.glb: binary glTF of version 1 is not read: export 2.0"),
        (&b"glTF\x02\0\0\0\x0C\0\0\0"[..], "a.glb: the file has no chunk of JSON"),
        (&b"PK\x03\x04"[..], "a.glb: not a glTF file: it is a zip archive"),
        (&b"solid"[..], "a.glb: not a glTF file: it is an STL file: let its name end in .stl"),
        (&b"v 0 0 0\n"[..], "a.glb: not a glTF file: it begins neither"),
        (&b"{\"meshes\":\n  [}"[..], "a.glb, line 2: column 4: expected value: not glTF 2.0"),
        (&b"{\"meshes\": {}}"[..], "a.glb, line 1: column 11: invalid type: map, expected a sequence: not glTF 2.0"),
        (&b"{}"[..], "a.glb: the file holds no mesh"),
    ] {
        let found = refusal(bytes);
        assert!(found.starts_with(message), "{found}");
    }
    assert!(
        refusal(&serde_json::to_vec(&document()).unwrap()).ends_with("buffers[0]: the file brings no bytes for it")
    );
}

#[test]
fn coordinates_that_are_no_numbers_are_left_to_the_validator() {
    let mut bytes = glb(&document());
    let at = bytes.len() - binary().len();
    bytes[at + 24..at + 28].copy_from_slice(&f32::NAN.to_le_bytes());
    let loaded = parse(&bytes).unwrap();
    let report = crate::mesh::validate::validate(&loaded.mesh, None, crate::mesh::validate::Boundary::EdgeAndCorner);
    assert!(report.summary_line().contains("vertex 1"), "{}", report.summary_line());
}
