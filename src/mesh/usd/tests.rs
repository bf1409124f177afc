use super::*;
use crate::mesh::Faces;
use crate::mesh::features::Tags;
use crate::mesh::file_tags::{CornerTag, CreaseTag, FileTags, Subdivision};
use proptest::prelude::*;

fn parse(text: &str) -> Result<Loaded> {
    read_bytes(text.as_bytes(), Path::new("a.usda"))
}

fn refusal(text: &str) -> String {
    let text = parse(text).unwrap_err().to_string();
    assert!(!text.contains(char::is_control), "{text:?}");
    text
}

/// A quad of vertices 0 to 3 and a triangle 0, 3, 4, from line 2 on, then `more` on line 6.
fn scene(more: &str) -> String {
    format!(
        "#usda 1.0\ndef Mesh \"m\" {{\npoint3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (-1, 1, 0)]\n\
         int[] faceVertexCounts = [4, 3]\nint[] faceVertexIndices = [0, 1, 2, 3, 0, 3, 4]\n{more}\n}}\n"
    )
}

#[test]
fn a_scene_as_blender_saves_it() {
    let text = r#"#usda 1.0
(
    customLayerData = { string creator = "a } b"; dictionary more = { int[] x = [1, 2] } }
    defaultPrim = "root" # a ) in a comment
    doc = """Blender "v5"
        over ) two lines"""
    metersPerUnit = 1
    upAxis = "Z"
)

def Xform "root" (
    customData = { dictionary Blender = { bool generated = 1 } }
    prepend references = [@./other (1).usda@</root>, @@@odd@name@@@]
)
{
    float3 xformOp:rotateXYZ = (0, -0, 0)
    uniform token[] xformOpOrder = ["xformOp:rotateXYZ"]

    /* def Mesh "commented" {
    } */
    class Mesh "kept_aside" { point3f[] points = [(9, 9, 9)] }
    over "elsewhere" { def Mesh "inside" { int[] faceVertexCounts = [1] } }
    def Scope "group"
    {
        def Mesh "cage" (active = true)
        {
            uniform bool doubleSided = 1
            custom string note # a declaration without a value
            float3[] extent = [(-1, -1, 0), (1, 1, 0)]
            int[] faceVertexCounts = [4,
                3]
            int[] faceVertexIndices = [0, 1, 2, 3,
                0, 3, 4,]; rel material:binding = </scene/_materials/M>
            normal3f[] normals = [(0, 0, 1), (0, 0, 1), (0, 0, 1), (0, 0, 1), (0, 0, 1), (0, 0, 1), (0, 0, 1)] (
                interpolation = "faceVarying"
            )
            point3f[] points = [(0, 0, 0), (1, .5, -1e-3), // two
                (1, 1, 0), (0, 1, 0),
                (-1, 1, 0)]
            texCoord2f[] primvars:st = [(0, 0), (1, 1)] (
                interpolation = "faceVarying"
            )
            int[] primvars:st:indices = [0, 1]
            point3f[] velocities.timeSamples = { 0: [(0, 0, 0)], 1: None }
            uniform token interpolateBoundary = "edgeOnly"
            uniform token subdivisionScheme = "loop"
            int[] creaseIndices = [0, 1, 2,
                3, 0]
            int[] creaseLengths = [3, 2]
            float[] creaseSharpnesses = [10, 2.5]
            int[] cornerIndices = [4]
            float[] cornerSharpnesses = [inf]

            def GeomSubset "part" ( doc = '''it's''' )
            {
                int[] indices = [0]
                uniform token elementType = "face"
            }
            variantSet "look" = { "red" { def Mesh "other" {} } "blue" ( doc = "b" ) { } }
        }
    }
    reorder nameChildren = ["group"]
}
"#;
    let loaded = parse(text).unwrap();
    assert_eq!(loaded.mesh.faces, Faces::from_lists([&[0, 1, 2, 3][..], &[0, 3, 4]]));
    assert_eq!(loaded.mesh.positions[1], DVec3::new(1.0, 0.5, -1e-3));
    let line = |part: &str| 1 + text[..text.find(part).unwrap()].matches('\n').count() as u32;
    let lines = loaded.lines.unwrap();
    let point = line("point3f[] points = [(0, 0");
    assert_eq!(lines.vertices, [point, point, point + 1, point + 1, point + 2]);
    assert_eq!(lines.faces, [line("= [0, 1, 2, 3"), line("= [0, 1, 2, 3") + 1]);
    let at = line("creaseIndices");
    let crease = |ends, sharpness, line| CreaseTag { ends, sharpness, line };
    let tags = FileTags {
        boundary: Some(Boundary::EdgeOnly),
        creases: vec![crease([0, 1], 10.0, at), crease([1, 2], 10.0, at), crease([3, 0], 2.5, at + 1)],
        corners: vec![CornerTag { vertex: 4, sharpness: f64::INFINITY, line: line("cornerIndices") }],
    };
    assert_eq!(loaded.tags, tags);
    assert_eq!(loaded.subdivision, Some(Subdivision::Loop));
    assert_eq!(loaded.normals, None);
    assert_eq!(
        loaded.remarks,
        [
            "not kept: 1 primvars, normals that are not one a vertex",
            "transforms (xformOp) are not applied: the points are in the mesh's own coordinates",
        ]
    );
    // All line ends are one.
    for ends in ["\r\n", "\r"] {
        let other = parse(&text.replace('\n', ends)).unwrap();
        assert_eq!((other.tags, other.lines.unwrap()), (tags.clone(), lines.clone()));
    }
}

#[test]
fn transforms_count_only_above_the_mesh() {
    let mesh = scene("").replace("#usda 1.0\n", "");
    let moved = "double3 xformOp:translate = (1, 0, 0)";
    for (text, told) in [
        (format!("#usda 1.0\ndef Camera \"c\" {{ {moved} }}\n{mesh}"), false),
        (format!("#usda 1.0\n{mesh}def Camera \"c\" {{ {moved} }}\n"), false),
        (format!("#usda 1.0\ndef Xform \"x\" {{\n{mesh}{moved}\n}}"), true),
        (scene(moved), true),
    ] {
        assert_eq!(parse(&text).unwrap().remarks.iter().any(|r| r.starts_with("transforms")), told, "{text}");
    }
}

#[test]
fn normals_of_vertices_are_kept() {
    let five = "normal3f[] normals = [(0, 0, 1), (0, 0, 1), (0, 1, 0), (0, 0, 1), (1, 0, 0)]";
    for metadata in ["", "(\ninterpolation = \"vertex\"\n)", "( doc = \"x\" interpolation = 'varying')"] {
        let loaded = parse(&scene(&format!("{five} {metadata}"))).unwrap();
        assert_eq!(loaded.normals.unwrap()[2], DVec3::Y);
        assert!(loaded.remarks.is_empty());
    }
    for normals in ["normal3f[] normals = [(0, 0, 1)]".to_owned(), format!("{five} (interpolation = \"faceVarying\")")]
    {
        let loaded = parse(&scene(&normals)).unwrap();
        assert_eq!((loaded.normals, loaded.remarks.len()), (None, 1));
    }
}

#[test]
fn sharpness_is_one_a_crease_or_one_an_edge() {
    let sharpness = |given: &str| {
        let tags = "int[] creaseIndices = [0, 1, 2, 3, 4]\nint[] creaseLengths = [3, 2]\nfloat[] creaseSharpnesses = ";
        let loaded = parse(&scene(&format!("{tags}{given}"))).unwrap();
        loaded.tags.creases.iter().map(|c| (c.ends, c.sharpness)).collect::<Vec<_>>()
    };
    let ends = [[0, 1], [1, 2], [3, 4]];
    let with = |s: [f64; 3]| ends.into_iter().zip(s).collect::<Vec<_>>();
    assert_eq!(sharpness("[10, 3]"), with([10.0, 10.0, 3.0]));
    assert_eq!(sharpness("[10, 3, 0]"), with([10.0, 3.0, 0.0]));
}

#[test]
fn rules_of_boundaries_and_what_is_blocked() {
    for (rule, boundary, remarks) in [
        ("edgeAndCorner", Some(Boundary::EdgeAndCorner), 0),
        ("edgeOnly", Some(Boundary::EdgeOnly), 0),
        ("none", None, 1),
    ] {
        let loaded = parse(&scene(&format!("uniform token interpolateBoundary = \"{rule}\""))).unwrap();
        assert_eq!((loaded.tags.boundary, loaded.remarks.len()), (boundary, remarks));
    }
    let loaded = parse(&scene("int[] creaseIndices = None\nfloat[] creaseSharpnesses = []\nint[] cornerIndices = []"));
    assert!(loaded.unwrap().tags.is_empty());
    let loaded = parse(&scene("int[] holeIndices = [1]\nuniform token orientation = \"leftHanded\"")).unwrap();
    assert_eq!(
        loaded.remarks,
        ["not kept: holes (holeIndices), the left-handed orientation, in which faces run clockwise"]
    );
}

#[test]
fn errors_name_the_line_and_what_is_wrong() {
    for (more, start) in [
        ("int[] faceVertexCounts = [3]", "6: faceVertexCounts are given twice"),
        ("point3f[] points.timeSamples = { 1: [] }", "6: points are given over time (timeSamples): save one frame"),
        ("int[] creaseIndices = [0, 1]", "6: creaseLengths add up to 0, and creaseIndices (line 6) has 2 values"),
        (
            "int[] creaseIndices = [0, 1]\nint[] creaseLengths = [2]",
            "6: creaseSharpnesses has 0 values: one for each of the 1 creases, or of their 1 edges, is needed",
        ),
        (
            "int[] creaseIndices = [0, 1, 2]\nint[] creaseLengths = [2,\n1]\nfloat[] creaseSharpnesses = [10, 10]",
            "8: crease 1 has the length 1: an edge needs two vertices",
        ),
        (
            "int[] creaseIndices = [0, 1, 2]\nint[] creaseLengths = [2]\nfloat[] creaseSharpnesses = [10]",
            "7: creaseLengths add up to 2, and creaseIndices (line 6) has 3 values",
        ),
        (
            "int[] creaseIndices = [0, 1, 2, 3]\nint[] creaseLengths = [4]\nfloat[] creaseSharpnesses = [10, 10]",
            "8: creaseSharpnesses has 2 values: one for each of the 1 creases, or of their 3 edges",
        ),
        (
            "int[] creaseIndices = [0,\n5]\nint[] creaseLengths = [2]\nfloat[] creaseSharpnesses = [10]",
            "7: creaseIndices: vertex 5 is not in the mesh: it has 5, numbered from 0",
        ),
        ("float[] creaseSharpnesses = [10,\n-1]", "7: creaseSharpnesses has at place 1 the sharpness -1: a number"),
        ("float[] cornerSharpnesses = [nan]", "6: cornerSharpnesses has at place 0 the sharpness NaN: a number"),
        ("float[] cornerSharpnesses = [10]", "6: cornerSharpnesses has 1 values, and cornerIndices 0"),
        ("int[] cornerIndices = [0]", "6: cornerSharpnesses has 0 values, and cornerIndices 1"),
        (
            "int[] cornerIndices = [\n7]\nfloat[] cornerSharpnesses = [10]",
            "7: cornerIndices: vertex 7 is not in the mesh: it has 5, numbered from 0",
        ),
        ("int[] cornerIndices = [-1]", "6: \"-1\" is not the whole number of cornerIndices at place 0"),
        ("int[] cornerIndices = [1.5]", "6: \"1.5\" is not the whole number of cornerIndices at place 0"),
        ("int[] cornerIndices = 1", "6: \"1\" is not the list of cornerIndices, in brackets"),
        ("int[] cornerIndices = [1 2]", "6: \"2\" is not a comma, or the bracket that closes cornerIndices"),
        ("uniform token subdivisionScheme = \"doo\"", "6: \"doo\" is no subdivisionScheme: use catmullClark, loop,"),
        ("uniform token interpolateBoundary = \"x\"", "6: \"x\" is no interpolateBoundary: use edgeOnly, edgeAndC"),
        ("uniform token interpolateBoundary = 1", "6: \"1\" is not the value of interpolateBoundary, in quotes"),
        ("\ndef Mesh \"other\" {}", "7: two meshes, \"m\" (line 2) and \"other\": save them in a file each"),
        ("normal3f[] normals = [(0, 0)]", "6: \")\" is not the point (x, y, z) of normals at place 0"),
        ("normal3f[] normals = [(0, x, 0)]", "6: \"x\" is not the coordinate y of normals at place 0"),
        ("string s = \"a\nb\"", "6: the string that begins here has no end"),
        ("string s = \"\"\"a\nb\"", "6: the string that begins here has no end"),
        ("asset a = @a.png\n", "6: the asset path that begins here has no end"),
        ("rel r = </a\n", "6: the path that begins here has no end"),
        ("/* x\n", "6: the comment that begins here has no end"),
        ("double3[] other = [(1, 2, 3]]", "6: \"]\" is not the ) that closes the bracket of line 6"),
        ("double x = ;", "6: \";\" is not a value"),
        ("? = 1", "6: \"?\" is not a property or a prim"),
        ("def Mesh noname", "6: \"noname\" is not the name of a prim, in quotes"),
        ("def Mesh \"x\" =", "6: \"=\" is not the { that opens the prim \"x\""),
        ("}\n}", "7: \"}\" is not a prim"),
        ("def Scope \"s\" {", "7: the file ends where the } that closes the prim \"m\" of line 2 should be"),
    ] {
        let text = refusal(&scene(more));
        assert!(text.starts_with(&format!("a.usda, line {start}")), "{more}\n{text}");
    }
}

#[test]
fn faces_and_arrays_that_do_not_fit_are_told() {
    let with = |from: &str, to: &str| refusal(&scene("").replace(from, to));
    for (from, to, start) in [
        ("[4, 3]", "[4, 4]", "4: faceVertexCounts add up to 8, and faceVertexIndices (line 5) has 7 values"),
        ("[4, 3]", "[5,\n2]", "5: face 1 has 2 corners, a face needs at least 3"),
        ("[4, 3]", "[4, -3]", "4: \"-3\" is not the whole number of faceVertexCounts at place 1"),
        ("0, 3, 4]", "0, 3, 4294967296]", "5: \"4294967296\" is not the whole number of faceVertexIndices"),
        ("point3f[] points", "point3f[] velocities", "2: the mesh \"m\" has no points"),
        ("faceVertexCounts =", "counts =", "2: the mesh \"m\" has no faceVertexCounts"),
        ("faceVertexIndices =", "indices =", "2: the mesh \"m\" has no faceVertexIndices"),
        ("(1, 0, 0)", "(1, 0, 0", "3: \",\" is not the point (x, y, z) of points at place 1"),
        ("(1, 0, 0)", "1", "3: \"1\" is not the point (x, y, z) of points at place 1"),
    ] {
        let text = with(from, to);
        assert!(text.starts_with(&format!("a.usda, line {start}")), "{to}: {text}");
    }
    // Left to the validation.
    let loaded = parse(&scene("").replace("0, 3, 4]", "0, 3, 9]").replace("(1, 0, 0)", "(nan, -inf, 1e999)")).unwrap();
    assert_eq!(loaded.mesh.faces.face(1), [0, 3, 9]);
    assert!(loaded.mesh.positions[1].x.is_nan());
}

#[test]
fn other_kinds_of_files_and_scenes_without_a_mesh_are_told() {
    for (text, message) in [
        ("PXR-USDC\0\0", "a.usda: binary USD is not read: save it as text, .usda"),
        ("PK\u{3}\u{4}\0", "a.usda: an archive, such as .usdz, is not read: unpack it, and save the scene as .usda"),
        ("ply\n", "a.usda: not a USD file: it is a PLY file: let its name end in .ply"),
        ("v 0 0 0\n", "a.usda, line 1: the first line is not \"#usda 1.0\": the file is no USD, or not as text"),
        ("", "a.usda, line 1: the first line is not \"#usda 1.0\": the file is no USD, or not as text"),
        (
            "#usda 1.0\ndef Xform \"x\" {}\nclass Mesh \"y\" {}",
            "a.usda: no mesh in it (a prim `def Mesh`): variants are not looked into, and files that it refers to are \
             not read",
        ),
    ] {
        assert_eq!(refusal(text), message);
    }
    assert!(parse(&format!("\u{feff}{}", scene(""))).is_ok());
}

#[test]
fn what_is_written_is_short_and_has_its_tags() {
    let mesh = Mesh::new(
        vec![DVec3::ZERO, DVec3::X, DVec3::new(1.0 / 3.0, 2e6 / 3.0, -2e-6 / 3.0)],
        Faces::from_lists([[0, 1, 2]]),
    );
    let tags =
        Tags { boundary: Boundary::EdgeOnly, creases: vec![([0, 1], 10.0), ([2, 1], 12.5)], corners: vec![(2, 10.0)] };
    let mut text = Vec::new();
    let options = WriteOptions {
        normals: Some(&[DVec3::Z; 3]),
        subdivision: Subdivision::CatmullClark,
        tags: Some(&tags),
        ..WriteOptions::default()
    };
    write_control_to(&mut text, &mesh, &options).unwrap();
    let expected = r#"#usda 1.0
(
    defaultPrim = "mesh"
)

def Mesh "mesh"
{
    uniform token subdivisionScheme = "catmullClark"
    uniform token interpolateBoundary = "edgeOnly"
    float3[] extent = [
        (0, 0, -6.66666667e-7),
        (1, 666666.667, 0)
    ]
    int[] faceVertexCounts = [
        3
    ]
    int[] faceVertexIndices = [
        0, 1, 2
    ]
    point3f[] points = [
        (0, 0, 0),
        (1, 0, 0),
        (0.333333333, 666666.667, -6.66666667e-7)
    ]
    normal3f[] normals = [
        (0, 0, 1),
        (0, 0, 1),
        (0, 0, 1)
    ] (
        interpolation = "vertex"
    )
    int[] creaseIndices = [
        0, 1, 2, 1
    ]
    int[] creaseLengths = [
        2, 2
    ]
    float[] creaseSharpnesses = [
        10, 12.5
    ]
    int[] cornerIndices = [
        2
    ]
    float[] cornerSharpnesses = [
        10
    ]
}
"#;
    assert_eq!(String::from_utf8(text).unwrap(), expected);
}

proptest! {
    #[test]
    fn meshes_and_tags_read_back(
        points in prop::collection::vec(prop::array::uniform3(prop_oneof![
            any::<f32>().prop_map(f64::from),
            any::<u64>().prop_map(f64::from_bits),
            -1e3..1e3f64,
        ]), 1..20),
        faces in prop::collection::vec(prop::collection::vec(any::<u32>(), 3..8), 0..10),
        creases in prop::collection::vec((0..20u32, 0..20u32, 0.0..20.0f64), 0..40),
        corners in prop::collection::vec((0..20u32, prop_oneof![0.0..20.0f64, Just(f64::INFINITY)]), 0..40),
        rule in 0..4usize,
        scheme in 0..4usize,
        with_normals: bool,
    ) {
        let positions: Vec<DVec3> = points.into_iter().map(DVec3::from).collect();
        let n = positions.len() as u32;
        let tags = Tags {
            boundary: [Boundary::EdgeAndCorner, Boundary::EdgeOnly, Boundary::AsInterior, Boundary::Refuse][rule],
            creases: creases.into_iter().map(|(a, b, s)| ([a % n, b % n], s)).collect(),
            corners: corners.into_iter().map(|(v, s)| (v % n, s)).collect(),
        };
        let mesh = Mesh::new(positions.clone(), Faces::from_lists(faces));
        let written = |mesh: &Mesh, normals: Option<&[DVec3]>| {
            let mut bytes = Vec::new();
            let options =
                WriteOptions { normals, subdivision: Subdivision::ALL[scheme], tags: Some(&tags), ..WriteOptions::default() };
            write_control_to(&mut bytes, mesh, &options).unwrap();
            bytes
        };
        let bytes = written(&mesh, with_normals.then_some(&positions[..]));
        let back = read_bytes(&bytes, Path::new("a.usda")).unwrap();
        prop_assert_eq!(&back.mesh.faces, &mesh.faces);
        prop_assert_eq!(back.subdivision, Some(Subdivision::ALL[scheme]));
        prop_assert_eq!(back.tags.boundary, [Some(Boundary::EdgeAndCorner), Some(Boundary::EdgeOnly), None, None][rule]);
        prop_assert_eq!(back.remarks.len(), usize::from(tags.boundary == Boundary::AsInterior));
        prop_assert_eq!(back.tags.creases.iter().map(|c| (c.ends, c.sharpness)).collect::<Vec<_>>(), tags.creases.clone());
        prop_assert_eq!(back.tags.corners.iter().map(|c| (c.vertex, c.sharpness)).collect::<Vec<_>>(), tags.corners.clone());
        for (found, given) in back.mesh.positions.iter().zip(&positions) {
            for axis in 0..3 {
                let (found, given) = (found[axis], given[axis]);
                let near = (found - given).abs() <= 5.001e-9 * given.abs() + f64::from_bits(1) || found == given;
                let sign = found.is_sign_negative() == given.is_sign_negative();
                prop_assert!(near && sign || found.is_nan() && given.is_nan(), "{given:e} read back as {found:e}");
                // Single precision survives.
                if f64::from(given as f32) == given {
                    prop_assert_eq!(found as f32, given as f32);
                }
            }
        }
        let as_points = with_normals.then_some(&back.mesh.positions);
        prop_assert_eq!(format!("{:?}", back.normals.as_ref()), format!("{as_points:?}"));
        // A second time, nothing changes.
        prop_assert_eq!(written(&back.mesh, back.normals.as_deref()), bytes);
    }
}

#[test]
fn what_holds_for_all_coordinates_goes_from_file_to_file() {
    let mesh = Mesh::new(vec![DVec3::ZERO, DVec3::X, DVec3::Y], Faces::from_lists([[0, 1, 2]]));
    let body = scene("").split_once('\n').unwrap().1.to_owned();
    for (head, expected) in [
        ("", (None, None)),
        ("(upAxis = \"Z\")", (Some(true), None)),
        ("(\n    \"of the scene\"\n    metersPerUnit = 0.01\n    upAxis = 'Y'\n)", (Some(false), Some(0.01))),
        (
            "( customLayerData = { string upAxis = \"Z\" } subLayers = [ @upAxis@ ] metersPerUnit = 1e-3 )",
            (None, Some(1e-3)),
        ),
        ("(metersPerUnit = 0; upAxis = \"X\")", (None, None)),
        ("(metersPerUnit = -1, upAxis = \"\"\"Z\"\"\")", (Some(true), None)),
    ] {
        let stage = parse(&format!("#usda 1.0\n{head}\n{body}")).unwrap().stage;
        assert_eq!((stage.is_z_up, stage.meters_per_unit), expected, "{head}");
        let mut text = Vec::new();
        write_control_to(&mut text, &mesh, &WriteOptions { stage, ..WriteOptions::default() }).unwrap();
        assert_eq!(parse(std::str::from_utf8(&text).unwrap()).unwrap().stage, stage, "{head}");
    }
}
