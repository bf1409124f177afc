//! Any flags of any program on small meshes, as a user runs them: status 0, 1 or 2, never a panic, never endless; one
//! line `error: …` if it failed; with `--json` one object.

use std::fs;
use std::path::Path;
use std::time::Duration;

use arbitrary::{Result, Unstructured};
use assert_cmd::Command;
use serde_json::Value;

/// A flag and values for it, good and bad, with `|` between them.
type Flag = (&'static str, &'static str);
const SWITCH: &str = "";

struct Program {
    name: &'static str,
    /// How many meshes it takes at the most.
    meshes: usize,
    /// What it needs, or would take long without.
    needed: &'static [Flag],
    groups: &'static [&'static [Flag]],
}

const COMMON: &[Flag] = &[("--threads", "1|2|3|0|many"), ("--quiet", SWITCH)];
const JSON: &[Flag] = &[("--json", SWITCH)];
const ON_MESHES: &[Flag] = &[
    ("--scheme", "catmull-clark|loop|sqrt3|nasri|zheng-cai|doo-sabin"),
    ("--noise", "0|0.1|0.01:7|1e-9|3|-1|0.1:x"),
    ("--boundary", "as-interior|refuse|maybe"),
    ("--defects", SWITCH),
];
const STOP: &[Flag] = &[
    ("--tol", "1e-3|1e-8|0.5|10|0|-1|nan"),
    ("--tol-absolute", "1e-3|1e-6|inf"),
    ("--max-iter", "0|1|50|-5"),
    ("--monitor", SWITCH),
];
const FOLDER: &[Flag] = &[("--out", "out|new/folder|closed.off|")];
const METHODS: &str = "lu|jacobi,pia|sor,ssor,gauss-seidel|cg,pcg-ic0|pia,pia||no-such|auto,cg";
const ORDERS: &str = "file|reverse|bfs|rcm|morton|valence|multicolour|random:3|no-such";

const PROGRAMS: &[Program] = &[
    Program {
        name: "interpolate",
        meshes: 1,
        needed: &[("-o", "v.obj|v.off|v.ply|v.stl|closed.off|.")],
        groups: &[
            COMMON,
            JSON,
            ON_MESHES,
            STOP,
            &[
                (
                    "--method",
                    "auto|lu|cholesky|ldlt|jacobi|thall|gauss-seidel|sor|ssor|pia|w-pia|chebyshev|cg|\
                     pcg-jacobi|pcg-ssor|pcg-ic0|two-phase|halstead|fair-refinement|butterfly|labsik-greiner|no-such",
                ),
                ("--order", ORDERS),
            ],
            &[
                ("--subdivide", "1|2|3|0|13"),
                ("--limit", SWITCH),
                ("--write-normals", SWITCH),
                ("--vertices", "0|0..3|1,3|vertices.txt|99|x|"),
                ("--normals", "normals.txt|normals.off|closed.off|no-such.txt"),
                ("--normal-threshold", "0|10|181|nan"),
                ("--normal-tolerance", "5|-1"),
                ("--normal-levels", "1|3|9"),
                ("--shape-handle", "0.5|2|fair|numbers.txt|0|-1|nan|no-such.txt"),
                ("--alpha", "0|1|2|0.5|numbers.txt|3|nan"),
                ("--ite-max", "0|1|30"),
                ("--eps", "1e-9|1|0"),
                ("--thin-plate", "0|1|1e9|-1|nan"),
                ("--membrane", "1|1e-9|0"),
                ("--solution", "no-such.petsc|closed.off"),
                ("--picture", "p.png|p.svg|p.pdf|p.gif|no/p.png"),
            ],
        ],
    },
    Program {
        name: "assemble",
        meshes: 1,
        needed: &[("--out", "out|new/folder|closed.off")],
        groups: &[
            COMMON,
            JSON,
            ON_MESHES,
            &[("--format", "petsc|matrix-market|off|no-such"), ("--order", ORDERS), ("--index", "32|64|16")],
        ],
    },
    Program {
        name: "compare-solvers",
        meshes: 2,
        needed: &[],
        groups: &[
            COMMON,
            JSON,
            ON_MESHES,
            STOP,
            FOLDER,
            &[("--method", METHODS), ("--order", ORDERS), ("--errors-at", "0|1,2|5,0,900|x")],
        ],
    },
    Program {
        name: "sweep-omega",
        meshes: 2,
        needed: &[("--omega", "0.5:1:0.25|1:1:1|1.9:2.1:0.1|1e-13:1:0.5|2:1:1|0:1:0.5|1")],
        groups: &[
            COMMON,
            JSON,
            ON_MESHES,
            STOP,
            FOLDER,
            &[
                ("--method", "jacobi|pia,sor|sor|cg||no-such"),
                ("--order", ORDERS),
                ("--history", "0.7|0.5,0.9|0|x"),
                ("--eigenvalues", SWITCH),
            ],
        ],
    },
    Program {
        name: "spectrum",
        meshes: 2,
        needed: &[],
        groups: &[
            COMMON,
            JSON,
            ON_MESHES,
            FOLDER,
            &[
                ("--full", SWITCH),
                ("--modes", "1|6|56|57|x"),
                ("--certify", SWITCH),
                ("--no-sweeps", SWITCH),
                ("--no-data", SWITCH),
            ],
            &[
                ("--iteration-matrix", "pia|sor:1.5,ssor|jacobi,gauss-seidel|cg|sor:0|no-such||thall:"),
                ("--order", ORDERS),
                ("--pseudospectra", SWITCH),
            ],
        ],
    },
    Program {
        name: "splitting",
        meshes: 0,
        needed: &[("--valence", "3|3..5|100|2|5..3|101|x")],
        groups: &[
            COMMON,
            JSON,
            FOLDER,
            &[
                ("--scheme", "catmull-clark|loop|doo-sabin|sqrt3|labsik-greiner|nasri"),
                ("--alpha", "0|1|2|0.3|3|-1|nan"),
            ],
        ],
    },
    Program {
        name: "reproduce",
        meshes: 0,
        needed: &[("--only", "no-such|T19|T22")],
        groups: &[
            COMMON,
            JSON,
            &[
                ("--list", SWITCH),
                ("--quick", SWITCH),
                ("--times", SWITCH),
                ("--meshes", "no-such|."),
                ("--check", "no-such|."),
            ],
        ],
    },
    Program {
        name: "scaling",
        meshes: 0,
        needed: &[
            ("--sizes", "0|7|x||100"),
            ("--profile", "0"),
            ("--gains", "0"),
            ("--frames", "0|100"),
            ("--steps", "0|100"),
            ("--runs", "1|0"),
        ],
        groups: &[
            COMMON,
            JSON,
            FOLDER,
            &[
                ("--scheme", "loop|nasri,sqrt3||no-such"),
                ("--tol", "1e-3|10|0"),
                ("--most-cholesky", "0|-1"),
                ("--most-lu", "0"),
                ("--most-stored", "0"),
                ("--most-edits", "0"),
            ],
        ],
    },
];

/// Files that flags and meshes name.
const FILES: &[(&str, &str)] = &[
    ("closed.off", "OFF\n4 4 0\n1 1 1\n-1 -1 1\n-1 1 -1\n1 -1 -1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n"),
    ("normals.off", "NOFF\n3 1 0\n0 0 0 0 0 1\n1 0 0 0 0 1\n0 1 0 0 0 0\n3 0 1 2\n"),
    ("open.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0.5\nf 1 2 3\nf 2 4 3\n"),
    (
        "turned.ply",
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty double x\nproperty double y\nproperty double z\n\
         element face 4\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n0 0 nan\n\
         3 0 1 2\n3 0 1 3\n3 0 2 3\n3 1 2 3\n",
    ),
    ("same.off", "OFF\n4 4 0\n1 1 1\n1 1 1\n1 1 1\n1 1 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n"),
    ("empty.off", "OFF\n0 0 0\n"),
    ("missing.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 3 2 9\n"),
    ("missing.off", "OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n3 2 1 3\n"),
    ("cut.obj", "v 0 0 0\nv 1 0\nf 1 2 3\n"),
    ("vertices.txt", "0 2..3 # some\n"),
    ("normals.txt", "0 0 0 1\n2 1 1 0\n"),
    ("numbers.txt", "0 0.5\n1 1\n"),
];

const MESHES: &str = "\
    closed.off|open.obj|turned.ply|same.off|empty.off|missing.obj|missing.off|cut.obj|no-such.off|no-such|cube|\
    tetrahedron|octahedron|icosahedron|dodecahedron|prism:3|prism:40|bipyramid:9|star:5|torus:4x3|\
    torus:2x2|tri-torus:4x3|cubes:2|quad-sphere:1|irregular-tri:30|irregular-poly:40";

/// Runs the program that `data` chooses, from the folder `programs`, in a folder of its own.
pub fn check(data: &[u8], programs: &Path) {
    let Ok((program, arguments)) = decode(&mut Unstructured::new(data)) else { return };
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in FILES {
        fs::write(folder.path().join(name), text).unwrap();
    }
    let mut command = Command::new(programs.join(program));
    command.current_dir(folder.path()).args(&arguments).timeout(Duration::from_secs(120));
    let output = command.output().unwrap();
    let what = format!("{program} {}", arguments.join(" "));
    let error = String::from_utf8(output.stderr).unwrap();
    assert!(!error.contains("panicked"), "{what}\n{error}");
    let errors = error.lines().filter(|line| line.starts_with("error:")).count();
    match output.status.code() {
        Some(0) => {
            assert_eq!(errors, 0, "{what}\n{error}");
            if arguments.contains(&"--json") {
                let object: Value = serde_json::from_slice(&output.stdout).expect(&what);
                assert!(object.is_object(), "{what}");
            }
        }
        Some(1 | 2) => assert_eq!(errors, 1, "{what}\n{error}"),
        other => panic!("{what}: {other:?}\n{error}"),
    }
}

/// A program and arguments for it, most of them such that it has something to do.
fn decode(u: &mut Unstructured) -> Result<(&'static str, Vec<&'static str>)> {
    let program = u.choose(PROGRAMS)?;
    let mut arguments = Vec::new();
    for _ in 0..program.meshes {
        if arguments.is_empty() || u.ratio(1, 8)? {
            arguments.push(one_of(u, MESHES)?);
        }
    }
    for flag in program.needed {
        add(u, flag, &mut arguments)?;
    }
    let flags: Vec<&Flag> = program.groups.iter().copied().flatten().collect();
    while !u.is_empty() && arguments.len() < 16 {
        let flag = u.choose(&flags)?;
        add(u, flag, &mut arguments)?;
    }
    Ok((program.name, arguments))
}

fn add(u: &mut Unstructured, (name, values): &Flag, arguments: &mut Vec<&'static str>) -> Result<()> {
    arguments.push(name);
    if *values != SWITCH {
        arguments.push(one_of(u, values)?);
    }
    Ok(())
}

fn one_of(u: &mut Unstructured, values: &'static str) -> Result<&'static str> {
    let values: Vec<&str> = values.split('|').collect();
    u.choose(&values).copied()
}
