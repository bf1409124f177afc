//! The Matrix Market reader: against the writer, against sums of triplets made here, against sprs; what it refuses, and
//! where.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use chacha20::ChaCha8Rng;
use glam::DVec3;
use limitlab::Error;
use limitlab::assemble::matrix_market::{
    read_matrix, read_points, read_system, read_vector, write_general, write_points, write_symmetric, write_vector,
};
use limitlab::assemble::{Csr, LimitSystem};
use limitlab::output::write_file;
use limitlab::schemes::Scheme;
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use sprs::io::read_matrix_market;
use tempfile::{TempDir, tempdir};

use crate::common::meshes::*;

/// A folder with a file of this text.
struct File {
    folder: TempDir,
    path: PathBuf,
}

fn file(text: impl AsRef<[u8]>) -> File {
    let folder = tempdir().unwrap();
    let path = folder.path().join("x.mtx");
    std::fs::write(&path, text).unwrap();
    File { folder, path }
}

fn matrix(text: &str) -> limitlab::Result<Csr> {
    read_matrix(&file(text).path)
}

/// Of an error at a line: the line, and what is said.
fn refused<T: std::fmt::Debug>(result: limitlab::Result<T>) -> (Option<usize>, String) {
    let error = result.unwrap_err();
    let whole = error.to_string();
    assert!(!whole.contains(char::is_control), "not one line: {whole:?}");
    match error {
        Error::Parse { path, line, what } => {
            assert!(whole.starts_with(&path.display().to_string()), "{whole}");
            (line, what)
        }
        other => (None, other.to_string()),
    }
}

#[test]
fn systems_read_back_bit_by_bit() {
    let comments = ["command: any %d # of them".to_owned(), String::new()];
    for scheme in Scheme::ALL {
        for seed in 0..6 {
            let mesh = scattered(&small_mesh(scheme, seed), seed);
            let system = system(&mesh, scheme);
            let folder = tempdir().unwrap();
            let path = |name: &str| folder.path().join(name);
            write_file(&path("A.mtx"), |out| write_general(&system.a, &comments, out)).unwrap();
            write_file(&path("M.mtx"), |out| write_symmetric(&system.m, &comments, out)).unwrap();
            write_file(&path("H.mtx"), |out| write_vector(&system.h, &comments, out)).unwrap();
            write_file(&path("P.mtx"), |out| write_points(&mesh.positions, &comments, out)).unwrap();
            let text = std::fs::read_to_string(path("A.mtx")).unwrap();
            assert_eq!(text.lines().nth(1), Some("% command: any %d # of them"));
            assert_eq!(read_matrix(&path("A.mtx")).unwrap(), system.a);
            let (read, points) = read_system(folder.path()).unwrap();
            assert_eq!(
                (&read.h, &read.m, &read.a, &read.diagonal),
                (&system.h, &system.m, &system.a, &system.diagonal)
            );
            assert_eq!(points, mesh.positions);
            let b = &read.bounds;
            assert!(b.lambda_max >= 1.0 && b.lambda_max < 1.0 + 1e-13);
            assert!(b.lambda_min <= 1.0 && b.jacobi_lambda_max >= 1.0);
            // No H is the identity.
            std::fs::remove_file(path("H.mtx")).unwrap();
            let (read, _) = read_system(folder.path()).unwrap();
            assert_eq!((read.a, read.h), (read.m, vec![1.0; mesh.len()]));
        }
    }
}

#[derive(Clone, Copy, Debug)]
struct Style {
    symmetric: bool,
    /// 0: lower triangle, 1: upper, 2: both.
    triangle: u8,
    line_end: &'static str,
    loud: bool,
    integer: bool,
    comments: bool,
}

fn style() -> impl Strategy<Value = Style> {
    let flags = (any::<bool>(), 0..3u8, any::<bool>(), any::<bool>(), any::<bool>());
    (flags, prop_oneof![Just("\n"), Just("\r\n"), Just("\r")]).prop_map(
        |((symmetric, triangle, loud, integer, comments), line_end)| Style {
            symmetric,
            triangle,
            line_end,
            loud,
            integer,
            comments,
        },
    )
}

/// A file of these entries (of the lower triangle if it is symmetric) in any style that the format allows, and what it
/// means.
fn written(n: usize, entries: &[(usize, usize, i32)], style: Style) -> (String, BTreeMap<(usize, usize), f64>) {
    let Style { symmetric, triangle, line_end, loud, integer, comments } = style;
    let mut meant = BTreeMap::new();
    let mut lines = Vec::new();
    for &(i, j, a) in entries {
        let (i, j) = if symmetric { (i.max(j), i.min(j)) } else { (i, j) };
        // Halves and quarters are summed without rounding, in any order.
        let a = if integer { f64::from(a) } else { f64::from(a) * 0.25 };
        *meant.entry((i, j)).or_insert(0.0) += a;
        let number = if integer { format!("{a}") } else { format!("{a:e}") };
        let mut both = vec![(i, j)];
        if symmetric && i != j {
            *meant.entry((j, i)).or_insert(0.0) += a;
            both = [vec![(i, j)], vec![(j, i)], vec![(i, j), (j, i)]][usize::from(triangle)].clone();
        }
        lines.extend(both.iter().map(|(i, j)| format!(" {}\t{}  {number}", i + 1, j + 1)));
    }
    let banner = format!(
        "%%MatrixMarket matrix coordinate {} {}",
        if integer { "integer" } else { "real" },
        if symmetric { "symmetric" } else { "general" }
    );
    let mut all = vec![if loud { banner.to_uppercase() } else { banner }];
    if comments {
        all.extend(["% 1 1 1", "", "  %x"].map(String::from));
    }
    all.push(format!("{n} {n} {}", lines.len()));
    for line in lines {
        all.push(line);
        if comments {
            all.push(String::new());
            all.push("%".into());
        }
    }
    (all.join(line_end) + line_end, meant)
}

proptest! {
    #[test]
    fn all_styles_mean_the_sums_of_their_entries(
        (n, entries) in (1..9usize).prop_flat_map(|n| {
            (Just(n), proptest::collection::vec((0..n, 0..n, -50..50i32), 0..40))
        }),
        style in style(),
    ) {
        let (text, meant) = written(n, &entries, style);
        let file = file(&text);
        let read = read_matrix(&file.path).unwrap();
        prop_assert_eq!(read.len(), n);
        prop_assert_eq!(read.values().len(), meant.len(), "{}", text);
        for (&(i, j), &a) in &meant {
            prop_assert_eq!(read.get(i, j), a, "({}, {}) of {}", i, j, &text);
        }
        // sprs knows neither these spaces nor both triangles, and integers only as such.
        let plain = !style.integer && !style.comments && !style.loud && style.line_end == "\n";
        if plain && (!style.symmetric || style.triangle == 0) {
            let theirs = read_matrix_market::<f64, usize, _>(&file.path).unwrap().to_csr::<usize>();
            for (&(i, j), &a) in &meant {
                prop_assert_eq!(theirs.get(i, j).copied(), Some(a));
            }
        }
    }
}

#[test]
fn arrays_of_both_symmetries_are_read() {
    let general = "%%MatrixMarket matrix array real general\n2 2\n1\n\n0\n% x\n-3e0\n4\n";
    let m = matrix(general).unwrap();
    assert_eq!([(0, 0), (1, 0), (0, 1), (1, 1)].map(|(i, j)| m.get(i, j)), [1.0, 0.0, -3.0, 4.0]);
    assert_eq!(m.values().len(), 3);
    let symmetric = "%%matrixmarket Matrix Array Integer Symmetric\r\n3 3\r\n1\r\n2\r\n3\r\n4\r\n5\r\n6";
    let m = matrix(symmetric).unwrap();
    for (i, row) in [[1.0, 2.0, 3.0], [2.0, 4.0, 5.0], [3.0, 5.0, 6.0]].iter().enumerate() {
        assert_eq!(m.row_values(i), row);
    }
    let read = |text: &str| read_points(&file(text).path).unwrap();
    assert_eq!(read("%%MatrixMarket matrix array real general\n2 1\n5\n7\n"), [DVec3::X * 5.0, DVec3::X * 7.0]);
    assert_eq!(read("%%MatrixMarket matrix array real general\n1 2\n5\n7\n"), [DVec3::new(5.0, 7.0, 0.0)]);
    let sparse = "%%MatrixMarket matrix coordinate real general\n2 3 3\n2 3 1\n1 1 2\n2 3 4\n";
    assert_eq!(read(sparse), [DVec3::X * 2.0, DVec3::Z * 5.0]);
    assert!(read("%%MatrixMarket matrix array real general\n0 3\n").is_empty());
    assert_eq!(matrix("%%MatrixMarket matrix coordinate real general\n0 0 0\n").unwrap().len(), 0);
}

#[test]
fn what_is_not_read_is_refused_by_name_and_line() {
    let coordinate = |rest: &str| format!("%%MatrixMarket matrix coordinate real general\n{rest}");
    let symmetric = |rest: &str| format!("%%MatrixMarket matrix coordinate real symmetric\n{rest}");
    let banner = |rest: &str| format!("%%MatrixMarket {rest}\n1 1 1\n1 1 1\n");
    for (text, line, what) in [
        (String::new(), None, "the file is empty"),
        ("\n\n".into(), Some(1), "begins with %%MatrixMarket"),
        ("%MatrixMarket matrix\n".into(), Some(1), "begins with %%MatrixMarket"),
        ("hello\n1 1\n".into(), Some(1), "begins with %%MatrixMarket"),
        ("ply\nformat ascii 1.0\n".into(), Some(1), "it is a PLY file"),
        ("%%MatrixMarketing matrix\n".into(), Some(1), "\"%%matrixmarketing\" is not %%MatrixMarket"),
        (banner("matrix coordinate pattern general"), Some(1), "\"pattern\" is no kind of number that is read"),
        (banner("matrix coordinate complex general"), Some(1), "\"complex\" is no kind of number that is read"),
        (banner("matrix coordinate real skew-symmetric"), Some(1), "\"skew-symmetric\" is no symmetry"),
        (banner("matrix coordinate real Hermitian"), Some(1), "\"hermitian\" is no symmetry"),
        (banner("vector coordinate real general"), Some(1), "\"vector\" is no object"),
        (banner("matrix list real general"), Some(1), "\"list\" is no format"),
        (banner("matrix coordinate real"), Some(1), "the line ends where the symmetry should be"),
        (banner("matrix coordinate real general x"), Some(1), "\"x\" is one word too many"),
        (coordinate(""), Some(1), "the file ends where the number of rows"),
        (coordinate("% only\n"), Some(2), "the file ends where the number of rows"),
        (coordinate("3 3\n1 1 1\n"), Some(2), "the line ends where the number of entries"),
        (coordinate("-3 3 1\n1 1 1\n"), Some(2), "\"-3\" is not the number of rows"),
        (coordinate("3 3 1 1\n1 1 1\n"), Some(2), "\"1\" is not the end of the line"),
        (coordinate("3 4 1\n1 1 1\n"), None, "3 rows and 4 columns: it must be square"),
        (symmetric("3 4 1\n1 1 1\n"), Some(2), "a symmetric matrix of 3 rows and 4 columns"),
        (coordinate("3 3 2\n1 1 1\n"), Some(2), "2 lines of entries are announced"),
        (coordinate("3 3 2\n1 1 1000000\n"), Some(3), "the file ends where the row of entry 2 of 2"),
        (coordinate("3 3 1\n1 1 1\n2 2 1\n"), Some(4), "the file goes on after 1 entries"),
        (coordinate("3 3 1\n0 1 1\n"), Some(3), "the row of entry 1 of 1 is \"0\": the matrix has 3, counted from 1"),
        (coordinate("3 3 1\n1 4 1\n"), Some(3), "the column of entry 1 of 1 is \"4\""),
        (coordinate("3 3 1\n1 1.5 1\n"), Some(3), "\"1.5\" is not the column of entry 1 of 1"),
        (coordinate("3 3 2\n1 1 1\n1 2\n3 3 4\n"), Some(4), "the line ends where entry 2 of 2 should be"),
        (coordinate("3 3 2\n1 1 1\n1 2 2 3\n"), Some(4), "\"3\" is one value too many"),
        (coordinate("3 3 1\n1 1 nan\n"), Some(3), "entry 1 of 1 is \"nan\": a finite number is needed"),
        (coordinate("3 3 1\n1 1 -inf\n"), Some(3), "a finite number is needed"),
        (coordinate("3 3 1\n1 1 1e999\n"), Some(3), "a finite number is needed"),
        (coordinate("3 3 1\n1 1 1,5\n"), Some(3), "decimal point"),
        (coordinate("3 3 1\n1 1 1.0D+05\n"), Some(3), "exponents with e"),
        (coordinate("3 3 2\n1 1 1e308\n1 1 1e308\n"), None, "beyond the largest double"),
        (symmetric("3 3 3\n2 1 5\n3 1 6\n1 2 4\n"), Some(5), "entry (1, 2) is 4e0 and entry (2, 1) is 5e0"),
        (
            "%%MatrixMarket matrix coordinate integer general\n1 1 1\n1 1 1.5\n".into(),
            Some(3),
            "the banner says integer",
        ),
        (
            "%%MatrixMarket matrix array real symmetric\n2 2\n1\n2\n3\n4\n".into(),
            Some(6),
            "the file goes on after 3 entries",
        ),
        ("%%MatrixMarket matrix array real general\n2 2\n1\n2\n".into(), Some(2), "4 numbers are announced"),
    ] {
        let (at, told) = refused(matrix(&text));
        assert!(told.contains(what) && at == line, "{text:?}: line {at:?}: {told}");
    }
    for (bytes, what) in [(&b"\x1f\x8b\x08\0"[..], "gzip"), (b"\xff\xfe%\0%\0", "UTF-16"), (b"\0\0\0\0", "binary")] {
        let told = refused(read_matrix(&file(bytes).path)).1;
        assert!(told.contains(what), "{told}");
    }
    let three = "%%MatrixMarket matrix array real general\n1 3\n1\n2\n3\n";
    assert!(refused(read_vector(&file(three).path)).1.contains("3 columns: a vector has 1"));
    let four = "%%MatrixMarket matrix array real general\n1 4\n1\n2\n3\n4\n";
    assert!(refused(read_points(&file(four).path)).1.contains("4 columns: points have 3"));
    assert!(refused(read_matrix(Path::new("no-such.mtx"))).1.contains("cannot read"));
}

/// Nothing is allocated for what a header announces: these would take up to all memory there is.
#[test]
fn sizes_without_their_entries_ask_for_no_memory() {
    for sizes in [
        "18446744073709551615 18446744073709551615 1",
        "4294967296 4294967296 1",
        "4294967295 4294967295 1",
        "3 3 18446744073709551615",
        "3 3 99999999999999999999999",
    ] {
        let text = format!("%%MatrixMarket matrix coordinate real general\n{sizes}\n1 1 1\n");
        let (_, told) = refused(matrix(&text));
        let known = ["announced", "32-bit indices", "of memory, of which", "is not the number"];
        assert!(known.iter().any(|k| told.contains(k)), "{sizes}: {told}");
        let text = text.replace("4967295 4294967295", "4967295 3");
        assert!(read_points(&file(&text).path).is_err(), "{sizes}");
    }
    for sizes in ["18446744073709551615 18446744073709551615", "9000000000 9000000000", "4000000000 3", "99999 99999"] {
        for symmetry in ["general", "symmetric"] {
            let (_, told) = refused(matrix(&format!("%%MatrixMarket matrix array real {symmetry}\n{sizes}\n1\n2\n")));
            assert!(told.contains("announced") || told.contains("a symmetric matrix of"), "{told}");
        }
    }
}

/// Files with bytes changed, cut and added: read or refused in one line.
#[test]
fn damaged_files_are_read_or_refused() {
    let seeds = [
        "%%MatrixMarket matrix coordinate real symmetric\n%c\n3 3 5\n1 1 4e0\n2 1 -1\n2 2 4\n3 3 4.5\n1 2 -1\n",
        "%%MatrixMarket matrix array integer general\r\n2 3\r\n1\r\n2\r\n3\r\n-4\r\n5\r\n6\r\n",
        "%%MatrixMarket matrix array real symmetric\n2 2\n1\n2\n3\n",
    ];
    let mut read = 0;
    for seed in 0..6000u64 {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut bytes = seeds[seed as usize % 3].as_bytes().to_vec();
        for _ in 0..rng.random_range(0..4) {
            let at = rng.random_range(30..bytes.len());
            match rng.random_range(0..3) {
                0 => bytes[at] = *b"0123456789 .-e%\n\\\0\xff".get(rng.random_range(0..19)).unwrap(),
                1 => drop(bytes.drain(at..(at + rng.random_range(1..5)).min(bytes.len()))),
                _ => bytes.insert(at, *b"0123456789 .-e%\n\r#".get(rng.random_range(0..18)).unwrap()),
            }
        }
        let file = file(&bytes);
        match read_matrix(&file.path) {
            Ok(m) => {
                read += 1;
                assert!(m.values().iter().all(|v| v.is_finite()));
                let again = file.folder.path().join("again.mtx");
                write_file(&again, |out| write_general(&m, &[], out)).unwrap();
                assert_eq!(read_matrix(&again).unwrap(), m);
            }
            error => drop(refused(error)),
        }
        for error in [read_points(&file.path).err(), read_vector(&file.path).err()].into_iter().flatten() {
            drop(refused::<()>(Err(error)));
        }
    }
    assert!(read > 500, "{read} of the files are still good");
}

#[test]
fn systems_whose_parts_do_not_fit_are_refused() {
    let folder = tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    let told = || refused(read_system(folder.path()).map(|_| ())).1;
    assert!(told().contains("there is no M.mtx in this folder"));
    write("M.mtx", "%%MatrixMarket matrix coordinate real symmetric\n2 2 2\n1 1 1\n2 2 1\n");
    assert!(told().contains("there is no P.mtx in this folder"));
    write("P.mtx", "%%MatrixMarket matrix array real general\n3 1\n1\n1\n1\n");
    assert!(told().contains("3 rows beside a matrix M of 2"));
    write("P.mtx", "%%MatrixMarket matrix array real general\n2 1\n1\n1\n");
    assert_eq!(read_system(folder.path()).unwrap().0.len(), 2);
    write("H.mtx", "%%MatrixMarket matrix array real general\n1 1\n1\n");
    assert!(told().contains("1 rows beside a matrix M of 2"));
    write("H.mtx", "%%MatrixMarket matrix array real general\n2 1\n1\n-2\n");
    assert!(told().contains("entry 1 of H is -2"), "{}", told());
    #[cfg(unix)]
    {
        std::fs::remove_file(folder.path().join("H.mtx")).unwrap();
        std::os::unix::fs::symlink("nowhere", folder.path().join("H.mtx")).unwrap();
        assert!(told().contains("cannot read"), "{}", told());
    }
    assert!(
        LimitSystem::from_parts(vec![1.0], matrix("%%MatrixMarket matrix array real general\n1 1\n1\n").unwrap())
            .is_ok()
    );
}
