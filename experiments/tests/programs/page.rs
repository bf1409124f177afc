//! The interactive page of `compare-solvers`: its data held against the JSON rows and against each other, its size, and that it
//! asks for nothing. What it does in a browser is checked by `experiments/browser`.

use tempfile::tempdir;

use super::*;

/// Runs `compare-solvers` with a page, and gives its data and its JSON object.
fn page(folder: &Path, arguments: &[&str]) -> (Value, Value) {
    page_of(COMPARE, folder, arguments)
}

fn page_of(program: &str, folder: &Path, arguments: &[&str]) -> (Value, Value) {
    let output = run(program, folder, [arguments, &["--html", "page.html", "--json", "--quiet"]].concat());
    assert_done(&output, &arguments.join(" "));
    let html = fs::read_to_string(folder.join("page.html")).unwrap();
    assert!(html.len() < limitlab_experiments::report::page::LIMIT, "{} bytes", html.len());
    let elsewhere = html.replace("http://www.w3.org/2000/svg", "");
    assert!(!elsewhere.contains("http:") && !elsewhere.contains("https"), "an address");
    let island = html.split("id=\"data\">").nth(1).unwrap().split("</script>").next().unwrap();
    (serde_json::from_str(island).unwrap(), json(&output))
}

/// The bytes of a packed array.
fn bytes(packed: &Value) -> Vec<u8> {
    let value = |c: u8| match c {
        b'A'..=b'Z' => c - b'A',
        b'a'..=b'z' => c - b'a' + 26,
        b'0'..=b'9' => c - b'0' + 52,
        b'+' => 62,
        b'/' => 63,
        _ => panic!("{}", char::from(c)),
    };
    let digits: Vec<u8> = packed.as_str().unwrap().trim_end_matches('=').bytes().map(value).collect();
    let groups = digits.chunks(4).map(|four| (four.iter().fold(0u32, |sum, &d| sum << 6 | u32::from(d)), four.len()));
    groups.flat_map(|(sum, n)| (sum << (6 * (4 - n))).to_be_bytes()[1..n].to_vec()).collect()
}

fn u32s(packed: &Value) -> Vec<u32> {
    bytes(packed).chunks_exact(4).map(|four| u32::from_le_bytes(four.try_into().unwrap())).collect()
}

fn f64s(packed: &Value) -> Vec<f64> {
    bytes(packed).chunks_exact(8).map(|eight| f64::from_le_bytes(eight.try_into().unwrap())).collect()
}

fn points(packed: &Value) -> Vec<[f32; 3]> {
    let all: Vec<f32> =
        bytes(packed).chunks_exact(4).map(|four| f32::from_le_bytes(four.try_into().unwrap())).collect();
    assert_eq!(all.len() % 3, 0);
    all.chunks_exact(3).map(|p| p.try_into().unwrap()).collect()
}

/// Arrays of a mesh that agree; the number of its vertices and of its faces.
fn assert_solid(solid: &Value) -> (usize, usize) {
    let n = points(&solid["points"]).len();
    let corners = u32s(&solid["corners"]);
    assert!(corners.iter().all(|c| ((c & !(1 << 31)) as usize) < n));
    assert!(corners.last().unwrap() >> 31 == 1);
    let creases = u32s(&solid["creases"]);
    assert!(creases.len().is_multiple_of(2) && creases.iter().all(|&v| (v as usize) < n));
    (n, corners.iter().filter(|&c| c >> 31 == 1).count())
}

/// Curves that agree with the rows, and frames with the curves.
fn assert_curves(data: &Value, object: &Value) {
    let shown = data["view"].as_object().map(|view| points(&view["given"]["points"]).len());
    let rows: Vec<&Value> = object["rows"].as_array().unwrap().iter().collect();
    assert_eq!(data["rows"].as_array().unwrap().len(), rows.len());
    for curve in data["curves"].as_array().unwrap() {
        let name = curve["name"].as_str().unwrap();
        let of = |row: &&&Value| {
            let [method, parameter] = ["method", "parameter"].map(|field| row[field].as_str().unwrap());
            name == format!("{method} ({parameter})") || (parameter.is_empty() && name == method)
        };
        let row = rows.iter().find(of).unwrap_or_else(|| panic!("no row {name}"));
        let iterations = row["iterations"].as_u64().unwrap();
        assert_eq!((&curve["outcome"], &curve["iterations"]), (&row["status"], &row["iterations"]), "{name}");
        let (at, max) = (u32s(&curve["at"]), f64s(&curve["max"]));
        assert_eq!(at.len(), max.len(), "{name}");
        assert_eq!((at[0], u64::from(at[at.len() - 1])), (0, iterations), "{name}");
        assert!(at.windows(2).all(|w| w[0] < w[1]), "{name}");
        let last = row["max_error"].as_f64().unwrap_or(f64::NAN);
        assert!(!last.is_finite() || (max[max.len() - 1] / last - 1.0).abs() < 1e-9 || last == 0.0, "{name}: {last:e}");
        let Some(n) = shown else {
            assert!(curve["frames"].is_null());
            continue;
        };
        if curve["frames"].is_null() {
            assert!(name.starts_with("auto") || (iterations == 0 && row["status"] == "breakdown"), "{name}");
            continue;
        }
        let (frames, errors) = (u32s(&curve["frames"]["at"]), bytes(&curve["frames"]["errors"]));
        assert_eq!(errors.len(), frames.len() * n, "{name}");
        assert_eq!((frames[0], u64::from(frames[frames.len() - 1])), (0, iterations), "{name}");
        // The largest byte of a frame is that of the largest error, which the history has; but conjugate gradients
        // that break down know theirs no more.
        if row["status"] != "converged" {
            continue;
        }
        let [low, high] = [0, 1].map(|k| data["view"]["range"][k].as_f64().unwrap().ln());
        for (frame, k) in errors.chunks_exact(n).zip(&frames) {
            if let Ok(entry) = at.binary_search(k) {
                let expected = (255.0 * (max[entry].ln() - low) / (high - low)).clamp(0.0, 255.0);
                let found = f64::from(*frame.iter().max().unwrap());
                assert!((found - expected).abs() < 0.51, "{name}, iteration {k}: {found} and {expected}");
            }
        }
    }
}

#[test]
fn a_page_holds_what_the_rows_say_of_all_kinds_of_mesh() {
    let folder = tempdir().unwrap();
    fs::write(folder.path().join("dart"), "0 1 10\n").unwrap();
    fs::write(folder.path().join("ring"), "0 1 10\n1 2 10\n2 3 10\n3 4 10\n4 0 10\n").unwrap();
    let faces: String =
        (0..16).map(|f| format!("4 {} {} {} {}\n", f + f / 4, f + f / 4 + 1, f + f / 4 + 6, f + f / 4 + 5)).collect();
    let grid: String = (0..25).map(|v| format!("{} {} {}\n", v % 5, v / 5, v * v % 3)).collect();
    fs::write(folder.path().join("open.off"), format!("OFF\n25 16 0\n{grid}{faces}")).unwrap();
    for (arguments, faces, refined) in [
        // Triangles, thrice refined; a singular system without a control mesh; polygons under Doo-Sabin.
        (&["icosphere:1", "--noise", "0.1"][..], 80, Some(80 * 64)),
        (&["cube", "--noise", "0.1"], 6, None),
        (&["prism:7", "--scheme", "nasri"], 9, Some(674)),
        (&["torus:5x5", "--creases", "ring", "--noise", "0.1"], 25, Some(25 * 64)),
        (&["torus:5x5", "--creases", "dart", "--noise", "0.1"], 25, Some(25 * 64)),
        (&["open.off"], 16, Some(16 * 64)),
    ] {
        let what = arguments.join(" ");
        let (data, object) = page(folder.path(), arguments);
        assert_curves(&data, &object);
        let view = &data["view"];
        let (n, f) = assert_solid(&view["given"]);
        assert_eq!((n as u64, f), (object["vertices"].as_u64().unwrap(), faces), "{what}");
        assert_eq!(view["cage"].is_null(), refined.is_none(), "{what}");
        if let Some(refined) = refined {
            assert_eq!(points(&view["cage"]).len(), n, "{what}");
            let (fine, f) = assert_solid(&view["limit"]);
            assert_eq!(f, refined, "{what}");
            let shown_by = u32s(&view["limit"]["shown_by"]);
            assert!(shown_by.len() == fine && shown_by.iter().all(|&v| (v as usize) < n), "{what}");
            // The limit surface goes through the given points.
            let (given, surface) = (points(&view["given"]["points"]), points(&view["limit"]["points"]));
            for p in &given {
                let near = surface.iter().map(|q| (0..3).map(|k| (p[k] - q[k]).abs()).fold(0.0, f32::max));
                let near = near.fold(f32::INFINITY, f32::min);
                assert!(near < 1e-5 || what.contains("nasri"), "{what}: {near}");
            }
        } else {
            assert!(view["about"].as_str().unwrap().contains("No control mesh"), "{view}");
        }
        for (spectrum, matrix) in data["spectra"].as_array().unwrap().iter().zip(["A", "D⁻¹A"]) {
            assert_eq!(spectrum["matrix"], matrix);
            let [re, im] = [0, 1].map(|k| f64s(&spectrum["all"][k]));
            let unknowns = if what.contains("ring") {
                20
            } else if what.contains("open") {
                9
            } else {
                n
            };
            assert_eq!((re.len(), im.len()), (unknowns, unknowns), "{what}");
            let least = re.iter().copied().fold(f64::INFINITY, f64::min);
            assert!((least - spectrum["ends"][0].as_f64().unwrap()).abs() < 1e-9, "{what}");
        }
        let runs = data["sweep"].as_array().unwrap().iter().map(|sweep| sweep["runs"].as_array().unwrap().len());
        assert_eq!(runs.collect::<Vec<_>>(), [24, 40, 40], "{what}");
        let refused = data["refused"].as_str().unwrap_or_default();
        assert_eq!(refused.contains("left out cholesky"), what.contains("dart"), "{what}: {refused}");
        let creases = u32s(&view["given"]["creases"]).len() / 2;
        let expected = if what.contains("ring") {
            5
        } else if what.contains("dart") {
            1
        } else if what.contains("open") {
            16
        } else {
            0
        };
        assert_eq!(creases, expected, "{what}");
    }
}

#[test]
fn a_page_of_a_folder_has_no_view() {
    let folder = tempdir().unwrap();
    assert_done(&run(ASSEMBLE, folder.path(), ["prism:7", "--noise", "0.1", "--out", "d", "--quiet"]), "assemble");
    let (data, object) = page(folder.path(), &["d"]);
    assert_curves(&data, &object);
    assert!(data["view"].is_null() && data["title"] == "d");
}

#[test]
fn a_run_that_is_cut_short_is_told() {
    let folder = tempdir().unwrap();
    let (data, object) = page(folder.path(), &["cube", "--noise", "0.1", "--method", "sor", "--max-iter", "30"]);
    assert_curves(&data, &object);
    assert_eq!(data["curves"][0]["outcome"], "max-iterations");
}

#[test]
fn a_page_is_of_one_mesh_and_its_place_is_checked_before_the_work() {
    let folder = tempdir().unwrap();
    let output = run(COMPARE, folder.path(), ["cube", "torus:5x5", "--html", "page.html"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output.stderr).contains("2 are named: run the program once for each"), "{}", text(&output.stderr));
    let more = ["--html", "no/page.html", "--method", "pia"];
    let line =
        assert_refused(&run(COMPARE, folder.path(), [&["torus:300x300", "--quiet"], &more[..]].concat()), "no folder");
    assert!(line.contains("no/page.html") && line.contains("create it first"), "{line}");
    assert_no_files(folder.path(), "pages");
}

#[test]
fn a_hostile_name_stays_a_name() {
    let folder = tempdir().unwrap();
    let name = "<script>alert(1)<!--\u{2028}\"'&.off";
    fs::write(folder.path().join(name), "OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n")
        .unwrap();
    let (data, _) = page(folder.path(), &[name, "--method", "pia"]);
    assert_eq!(data["title"], format!("{name} under loop"));
    let html = fs::read_to_string(folder.path().join("page.html")).unwrap();
    assert_eq!((html.matches("<script").count(), html.contains("alert(1)<")), (2, false));
}

#[test]
fn reproduce_writes_the_page_of_the_horse() {
    let folder = tempdir().unwrap();
    let (mut by_reproduce, _) = page_of(REPRODUCE, folder.path(), &["--only", "T8"]);
    let (mut compared, _) = page(folder.path(), &["irregular-tri:233", "--noise", "0.1"]);
    for data in [&mut by_reproduce, &mut compared] {
        for row in data["rows"].as_array_mut().unwrap() {
            assert!(row.as_object_mut().unwrap().remove("seconds").is_some());
        }
    }
    assert!(by_reproduce == compared);
}

#[test]
fn a_page_is_a_file() {
    let folder = tempdir().unwrap();
    for program in [COMPARE, REPRODUCE] {
        let output = run(program, folder.path(), ["--html", "-"]);
        assert_eq!(output.status.code(), Some(2));
        let error = String::from_utf8(output.stderr).unwrap();
        assert!(error.contains("a file is needed") && below(folder.path()).is_empty(), "{error}");
    }
}
