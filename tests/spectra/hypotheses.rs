//! Theorems about the spectra, each on random meshes that fulfil its hypothesis, and each seen to fail on a mesh that does
//! not: where valences of 2, bipartite graphs, other faces or a boundary come in, the statement is false, so that the hypothesis
//! is no ornament. The systems of meshes that the library refuses are assembled here, from the masks.

use std::collections::BTreeSet;

use limitlab::analysis::dense;
use limitlab::assemble::{Csr, LimitSystem};
use limitlab::mesh::generate::quad_split;
use limitlab::mesh::{Faces, Mesh};
use limitlab::schemes::{Masks, Scheme};
use nalgebra_sparse::{CooMatrix, CsrMatrix};

use super::{assemble, named};
use crate::common::meshes::{small_mesh, small_polygons};
use crate::common::tol;

/// A mesh, its system under a scheme, and all eigenvalues, ascending.
struct Case {
    name: String,
    faces: Vec<usize>,
    /// Of the vertices of each component.
    components: Vec<Component>,
    closed: bool,
    system: LimitSystem,
    a: Vec<f64>,
    jacobi: Vec<f64>,
}

struct Component {
    valences: Vec<usize>,
    bipartite: bool,
}

impl Case {
    /// The system by definition, M = diag d(n) + w·Adj + Σ_F circulant, n being the number of edges at a vertex.
    fn by_definition(name: &str, faces: &[Vec<u32>], scheme: Scheme) -> Case {
        let (edges, count) = edges(faces);
        let valences = valences(&edges, count);
        let mut m = CooMatrix::new(count, count);
        for (v, &n) in valences.iter().enumerate() {
            m.push(v, v, scheme.vertex_weight(n));
        }
        for &(i, j) in &edges {
            m.push(i, j, scheme.edge_weight());
            m.push(j, i, scheme.edge_weight());
        }
        for face in faces {
            for (s, &i) in face.iter().enumerate() {
                for (t, &j) in face.iter().enumerate() {
                    m.push(i as usize, j as usize, scheme.face_weight(face.len(), s.abs_diff(t)));
                }
            }
        }
        let m = Csr::try_from(&CsrMatrix::from(&m)).expect("a matrix");
        let h = valences.iter().map(|&n| scheme.h(n)).collect();
        Case::new(name.into(), faces, LimitSystem::from_parts(h, m).expect("a system"))
    }

    fn of_mesh(name: String, mesh: &Mesh, scheme: Scheme) -> Case {
        let faces: Vec<Vec<u32>> = mesh.faces.iter().map(<[u32]>::to_vec).collect();
        Case::new(name, &faces, assemble(mesh, scheme))
    }

    fn named(name: &str, scheme: Scheme) -> Case {
        Case::of_mesh(format!("{name} under {scheme}"), &named(name), scheme)
    }

    fn new(name: String, faces: &[Vec<u32>], system: LimitSystem) -> Case {
        let all = dense::eigenvalues(&system).expect("small");
        let (edges, count) = edges(faces);
        let half_edges: usize = faces.iter().map(Vec::len).sum();
        Case {
            name,
            faces: faces.iter().map(Vec::len).collect(),
            components: components(&edges, count),
            closed: half_edges == 2 * edges.len(),
            system,
            a: all.a,
            jacobi: all.jacobi,
        }
    }

    fn valences(&self) -> impl Iterator<Item = usize> {
        self.components.iter().flat_map(|c| c.valences.iter().copied())
    }

    fn least_valence(&self) -> usize {
        self.valences().min().expect("vertices")
    }

    fn all_faces(&self, suit: impl Fn(usize) -> bool) -> bool {
        self.faces.iter().all(|&m| suit(m))
    }

    /// What rounding may change eigenvalues by.
    fn slack(&self) -> f64 {
        tol::eigenvalues(self.a.len(), 4.0)
    }

    fn lambda_min(&self) -> f64 {
        self.a[0]
    }

    fn jacobi_lambda_max(&self) -> f64 {
        self.jacobi[self.jacobi.len() - 1]
    }

    /// Zero to far more than rounding; no other eigenvalue of these meshes is as small.
    fn is_singular(&self) -> bool {
        self.a.iter().any(|l| l.abs() < 1e-10)
    }

    /// ρ(I − ½D⁻¹A) < 1 by more than rounding.
    fn thall_converges(&self) -> bool {
        self.jacobi.iter().all(|l| (1.0 - 0.5 * l).abs() < 1.0 - 1e-10)
    }
}

fn edges(faces: &[Vec<u32>]) -> (BTreeSet<(usize, usize)>, usize) {
    let sides = faces.iter().flat_map(|f| f.iter().zip(f.iter().cycle().skip(1)));
    let edges: BTreeSet<_> = sides.map(|(&i, &j)| (i.min(j) as usize, i.max(j) as usize)).collect();
    let count = edges.iter().map(|e| e.1 + 1).max().unwrap_or(0);
    (edges, count)
}

fn valences(edges: &BTreeSet<(usize, usize)>, count: usize) -> Vec<usize> {
    let mut valences = vec![0; count];
    for &(i, j) in edges {
        valences[i] += 1;
        valences[j] += 1;
    }
    valences
}

fn components(edges: &BTreeSet<(usize, usize)>, count: usize) -> Vec<Component> {
    let mut neighbours = vec![Vec::new(); count];
    for &(i, j) in edges {
        neighbours[i].push(j);
        neighbours[j].push(i);
    }
    let mut colour = vec![0i8; count];
    let mut found = Vec::new();
    for seed in 0..count {
        if colour[seed] != 0 {
            continue;
        }
        colour[seed] = 1;
        let (mut waiting, mut component) = (vec![seed], Component { valences: Vec::new(), bipartite: true });
        while let Some(i) = waiting.pop() {
            component.valences.push(neighbours[i].len());
            for &j in &neighbours[i] {
                if colour[j] == 0 {
                    colour[j] = -colour[i];
                    waiting.push(j);
                }
                component.bipartite &= colour[j] == -colour[i];
            }
        }
        found.push(component);
    }
    found
}

/// A statement about every mesh that fulfils a hypothesis.
struct Theorem {
    name: &'static str,
    hypothesis: fn(&Case) -> bool,
    statement: fn(&Case) -> bool,
    /// Fulfil all of the hypothesis but for one part, and not the statement.
    counterexamples: Vec<Case>,
}

/// Random meshes of all kinds that the scheme is defined on, quads among them.
fn random_cases(scheme: Scheme) -> Vec<Case> {
    let plain = (0..40).map(|seed| (format!("{scheme}, seed {seed}"), small_mesh(scheme, seed)));
    let quads = (0..if scheme.needs_triangles() { 0 } else { 6 })
        .map(|seed| (format!("{scheme}, quads of seed {seed}"), quad_split(&small_polygons(5 * seed + 1))));
    let small = plain.chain(quads).filter(|(_, mesh)| mesh.len() <= 150);
    small.map(|(name, mesh)| Case::of_mesh(name, &mesh, scheme)).collect()
}

/// Holds the theorems against random meshes, at least `least` of which fulfil each hypothesis, and their counterexamples.
fn hold(scheme: Scheme, least: usize, theorems: &[Theorem]) {
    let cases = random_cases(scheme);
    for theorem in theorems {
        let mut count = 0;
        for case in cases.iter().filter(|case| (theorem.hypothesis)(case)) {
            assert!((theorem.statement)(case), "{}: false on {}", theorem.name, case.name);
            count += 1;
        }
        assert!(count >= least, "{}: only {count} meshes fulfil the hypothesis", theorem.name);
        for case in &theorem.counterexamples {
            assert!(!(theorem.hypothesis)(case), "{}: {} fulfils the hypothesis", theorem.name, case.name);
            assert!(!(theorem.statement)(case), "{}: true on {} too", theorem.name, case.name);
        }
    }
}

/// Two faces of `m` corners back to back: closed, all valences 2.
fn pillow(m: u32, scheme: Scheme) -> Case {
    let faces = [(0..m).collect(), (0..m).rev().collect()];
    Case::by_definition(&format!("two {m}-gons back to back under {scheme}"), &faces, scheme)
}

/// A ring of 2k triangles, open on both sides, all valences 4.
fn ring_of_triangles(k: u32, scheme: Scheme) -> Case {
    let n = 2 * k;
    let faces: Vec<Vec<u32>> = (0..n).map(|i| vec![i, (i + 1) % n, (i + 2) % n]).collect();
    Case::by_definition(&format!("an open ring of {n} triangles under {scheme}"), &faces, scheme)
}

/// A ring of k quads, open on both sides, all valences 3.
fn ring_of_quads(k: u32, scheme: Scheme) -> Case {
    let faces: Vec<Vec<u32>> = (0..k).map(|i| vec![i, (i + 1) % k, k + (i + 1) % k, k + i]).collect();
    Case::by_definition(&format!("an open ring of {k} quads under {scheme}"), &faces, scheme)
}

/// Under masks that are made for triangles.
fn cube_by_definition(scheme: Scheme) -> Case {
    let faces: Vec<Vec<u32>> = named("cube").faces.iter().map(<[u32]>::to_vec).collect();
    Case::by_definition(&format!("the cube under {scheme}"), &faces, scheme)
}

fn bipartite_of_valence_3(c: &Component) -> bool {
    c.bipartite && c.valences.iter().all(|&n| n == 3)
}

#[test]
fn systems_by_definition_are_those_of_the_library() {
    for scheme in Scheme::ALL {
        for seed in [0, 7, 12] {
            let mesh = small_mesh(scheme, seed);
            let faces: Vec<Vec<u32>> = mesh.faces.iter().map(<[u32]>::to_vec).collect();
            let (ours, library) = (Case::by_definition("", &faces, scheme), assemble(&mesh, scheme));
            assert_eq!(Faces::from_lists(&faces), mesh.faces);
            for (i, j) in (0..library.len()).flat_map(|i| library.a.row(i).map(move |(j, _)| (i, j))) {
                let (x, y) = (ours.system.a.get(i, j), library.a.get(i, j));
                assert!((x - y).abs() <= tol::rounding(8), "{scheme} {seed} ({i}, {j}): {x} {y}");
            }
        }
    }
}

#[test]
fn hypotheses_under_catmull_clark_are_needed() {
    let scheme = Scheme::CatmullClark;
    hold(
        scheme,
        5,
        &[
            Theorem {
                name: "no eigenvalue is negative where valences are 3 and more",
                hypothesis: |c| c.least_valence() >= 3,
                statement: |c| c.lambda_min() >= -c.slack(),
                counterexamples: vec![pillow(4, scheme), pillow(7, scheme)],
            },
            Theorem {
                name: "non-singular where no component has all valences 3 and is bipartite",
                hypothesis: |c| !c.components.iter().any(bipartite_of_valence_3),
                statement: |c| !c.is_singular(),
                counterexamples: ["cube", "prism:6", "truncated-octahedron"].map(|m| Case::named(m, scheme)).into(),
            },
            Theorem {
                name: "(n − 3)/(n + 5) is a lower bound, the mean of both sides an upper one on bipartite graphs",
                hypothesis: |c| c.components.iter().all(|c| c.bipartite),
                statement: |c| {
                    let of = |shift: f64| move |n: usize| n as f64 * (n as f64 + shift);
                    let sum = |f: &dyn Fn(usize) -> f64| c.valences().map(f).sum::<f64>();
                    let mean = sum(&of(-3.0)) / sum(&of(5.0));
                    let n = c.least_valence() as f64;
                    c.lambda_min() >= (n - 3.0) / (n + 5.0) - c.slack() && c.lambda_min() <= mean + c.slack()
                },
                counterexamples: ["tetrahedron", "prism:5"].map(|m| Case::named(m, scheme)).into(),
            },
            Theorem {
                name: "λ_max(D⁻¹A) < 4 where valences are 3 and more",
                hypothesis: |c| c.least_valence() >= 3,
                statement: |c| c.jacobi_lambda_max() < 4.0,
                counterexamples: vec![pillow(8, scheme)],
            },
            Theorem {
                name: "λ_max(D⁻¹A) ≤ 8/3 on quads",
                hypothesis: |c| c.all_faces(|m| m == 4),
                statement: |c| c.jacobi_lambda_max() <= 8.0 / 3.0 + c.slack(),
                counterexamples: vec![Case::named("dodecahedron", scheme)],
            },
            Theorem {
                name: "ω = ½ converges where valences are 3 and more and A is non-singular",
                hypothesis: |c| c.least_valence() >= 3 && !c.components.iter().any(bipartite_of_valence_3),
                statement: Case::thall_converges,
                counterexamples: vec![Case::named("cube", scheme), pillow(4, scheme)],
            },
        ],
    );
    // Singular, the other way round: both parts of the condition are needed.
    for (name, bipartite, valence) in [("torus:6x8", true, 4), ("prism:5", false, 3), ("dodecahedron", false, 3)] {
        let case = Case::named(name, scheme);
        let component = &case.components[0];
        assert_eq!((component.bipartite, component.valences[0]), (bipartite, valence), "{name}");
        assert!(!case.is_singular(), "{name}");
    }
    // λ_max ≤ 9/4 on quads of valence 4 and more, so that ω < 8/9 is safe: the torus attains it, the cube exceeds it.
    let [torus, cube] = ["torus:6x8", "cube"].map(|m| Case::named(m, scheme).jacobi_lambda_max());
    assert!((torus - 9.0 / 4.0).abs() < 1e-13 && (cube - 8.0 / 3.0).abs() < 1e-13, "{torus} {cube}");
}

#[test]
fn hypotheses_under_the_schemes_of_triangles_are_needed() {
    // What valences prove, the least 1/a_ii at valence 3, and the same at valence 2, which is more.
    for (scheme, most) in [(Scheme::Loop, 2.5), (Scheme::Sqrt3, 8.0 / 3.0)] {
        let theorems = [
            Theorem {
                name: "λ_min(A) ≥ (3β − 1)/2 > 0 on closed meshes of triangles",
                hypothesis: |c| c.closed && c.all_faces(|m| m == 3),
                statement: |c| {
                    let least = c.system.diagonal.iter().map(|b| 0.5 * (3.0 * b - 1.0)).fold(f64::INFINITY, f64::min);
                    least > 0.0 && c.lambda_min() >= least - c.slack()
                },
                counterexamples: vec![cube_by_definition(scheme), ring_of_triangles(8, scheme)],
            },
            Theorem {
                name: "ω = ½ converges on closed meshes of triangles",
                hypothesis: |c| c.all_faces(|m| m == 3),
                statement: Case::thall_converges,
                counterexamples: vec![cube_by_definition(scheme)],
            },
        ];
        hold(scheme, 20, &theorems);
        for case in random_cases(scheme) {
            assert!(case.jacobi_lambda_max() <= most + case.slack(), "{}", case.name);
        }
        assert!(pillow(3, scheme).jacobi_lambda_max() > most + 0.1, "{scheme}");
    }
}

/// Σ_j |a_ij| < a_ii in every row, without the diagonal entry.
fn is_dominant(c: &Case) -> bool {
    (0..c.a.len()).all(|i| {
        let off: f64 = c.system.m.row(i).filter(|&(j, _)| j != i).map(|(_, v)| v.abs()).sum();
        c.system.m.get(i, i) > off + 1e-12
    })
}

#[test]
fn hypotheses_under_the_dual_schemes_are_needed() {
    let nasri = Scheme::Nasri;
    hold(
        nasri,
        5,
        &[
            Theorem {
                name: "[¼, 1] holds all eigenvalues on closed meshes",
                hypothesis: |c| c.closed,
                statement: |c| c.lambda_min() >= 0.25 - c.slack() && c.a[c.a.len() - 1] <= 1.0 + c.slack(),
                counterexamples: vec![ring_of_quads(8, nasri)],
            },
            Theorem {
                name: "[½, 1] on closed meshes of triangles",
                hypothesis: |c| c.closed && c.all_faces(|m| m == 3),
                statement: |c| c.lambda_min() >= 0.5 - c.slack(),
                counterexamples: vec![Case::named("torus:6x8", nasri)],
            },
            Theorem {
                name: "diagonally dominant on triangles and quads",
                hypothesis: |c| c.all_faces(|m| m <= 4),
                statement: is_dominant,
                counterexamples: ["dodecahedron", "truncated-octahedron"].map(|m| Case::named(m, nasri)).into(),
            },
            Theorem {
                name: "ω = ½ converges",
                hypothesis: |_| true,
                statement: Case::thall_converges,
                counterexamples: Vec::new(),
            },
        ],
    );
    // Zheng and Cai's system needs no hypothesis: what is refused elsewhere is no worse under it.
    let zheng_cai = Scheme::ZhengCai;
    let all_is_well = |c: &Case| {
        c.lambda_min() >= 0.5 - c.slack() && c.a[c.a.len() - 1] <= 1.0 + c.slack() && c.jacobi_lambda_max() < 2.0
    };
    for case in random_cases(zheng_cai).into_iter().chain([pillow(4, zheng_cai), ring_of_quads(8, zheng_cai)]) {
        assert!(all_is_well(&case) && is_dominant(&case), "{}", case.name);
    }
    // So undamped Jacobi converges under it; under the others it need not.
    for (name, scheme, exact) in [
        ("torus:6x8", Scheme::CatmullClark, 9.0 / 4.0),
        ("torus:6x8", Scheme::MidEdge, 2.0),
        ("dodecahedron", Scheme::Nasri, 2.0),
    ] {
        assert!((Case::named(name, scheme).jacobi_lambda_max() - exact).abs() < 1e-13, "{name} {scheme}");
    }
    let mid_edge = Scheme::MidEdge;
    hold(
        mid_edge,
        5,
        &[
            Theorem {
                name: "non-singular, and ω = ½ converges, where no component is bipartite",
                hypothesis: |c| !c.components.iter().any(|c| c.bipartite),
                statement: |c| !c.is_singular() && c.thall_converges(),
                counterexamples: ["cube", "torus:6x8", "quad-sphere:1"].map(|m| Case::named(m, mid_edge)).into(),
            },
            Theorem {
                name: "singular where a component is bipartite, of any valences",
                hypothesis: |c| c.components.iter().any(|c| c.bipartite),
                statement: Case::is_singular,
                counterexamples: ["torus:6x7", "tetrahedron"].map(|m| Case::named(m, mid_edge)).into(),
            },
            Theorem {
                name: "no eigenvalue is negative",
                hypothesis: |_| true,
                statement: |c| c.lambda_min() >= -c.slack(),
                counterexamples: Vec::new(),
            },
        ],
    );
}

/// Nasri's bounds hold for every principal submatrix, which is the system of a subset of vertices; under a matrix that is
/// singular on the whole mesh they are positive as soon as one vertex of each component is left out, and not before.
#[test]
fn subsets_keep_the_bounds() {
    for seed in 0..12 {
        let case = Case::of_mesh(format!("seed {seed}"), &small_mesh(Scheme::Nasri, seed), Scheme::Nasri);
        let chosen: Vec<usize> = (0..case.a.len()).filter(|i| !(i * 7 + seed as usize).is_multiple_of(3)).collect();
        let least = submatrix_lambda_min(&case.system, &chosen);
        assert!(least >= 0.25 - case.slack(), "{}: {least}", case.name);
    }
    for name in ["cube", "prism:6", "truncated-octahedron"] {
        let case = Case::named(name, Scheme::CatmullClark);
        let all: Vec<usize> = (0..case.a.len()).collect();
        assert!(submatrix_lambda_min(&case.system, &all).abs() < 1e-13, "{name}");
        assert!(submatrix_lambda_min(&case.system, &all[1..]) > 1e-3, "{name}");
    }
}

/// λ_min of the principal submatrix of A of these rows.
fn submatrix_lambda_min(system: &LimitSystem, rows: &[usize]) -> f64 {
    let mut m = CooMatrix::new(rows.len(), rows.len());
    for (k, &i) in rows.iter().enumerate() {
        for (l, &j) in rows.iter().enumerate() {
            let value = system.m.get(i, j);
            if value != 0.0 {
                m.push(k, l, value);
            }
        }
    }
    let m = Csr::try_from(&CsrMatrix::from(&m)).expect("a matrix");
    let h = rows.iter().map(|&i| system.h[i]).collect();
    let system = LimitSystem::from_parts(h, m).expect("a system");
    dense::eigenvalues(&system).expect("small").a[0]
}
