//! H, M and A against the plain assembly of the same formulas by other libraries, and the identities that every limit
//! system satisfies.

use glam::DVec3;
use limitlab::assemble::{Csr, LimitSystem};
use limitlab::mesh::generate::permute_vertices;
use limitlab::mesh::order::Order;
use limitlab::mesh::random::{random_polygons, random_triangulation};
use limitlab::mesh::{Mesh, builtin};
use limitlab::schemes::Scheme;
use nalgebra_sparse::CsrMatrix;
use rayon::prelude::*;

use crate::common::formulas::assemble;
use crate::common::meshes::*;
use crate::common::tol;

/// The largest difference of an entry in units of `scale` of its row; entries that one side does not store are 0.
fn difference(ours: &Csr, plain: &CsrMatrix<f64>, scale: impl Fn(usize) -> f64) -> f64 {
    assert_eq!(ours.len(), plain.nrows());
    let mut largest = 0.0f64;
    for i in 0..ours.len() {
        let row = plain.row(i);
        let mut theirs = vec![0.0; ours.len()];
        for (&j, &x) in row.col_indices().iter().zip(row.values()) {
            theirs[j] = x;
        }
        for (j, x) in ours.row(i) {
            theirs[j] -= x;
        }
        largest = theirs.iter().fold(largest, |l, d| l.max(d.abs() / scale(i)));
    }
    largest
}

fn hold_against_formulas(system: &LimitSystem, scheme: Scheme, mesh: &Mesh, what: &str) {
    let plain = assemble(scheme, mesh);
    for (ours, theirs) in system.h.iter().zip(&plain.h) {
        assert!((ours - theirs).abs() <= tol::rounding(1) * theirs, "{scheme}, {what}: H");
    }
    // All faces at a vertex add to its diagonal entry.
    let terms = (0..mesh.len()).map(|i| system.a.row(i).len()).max().unwrap();
    let a = difference(&system.a, &plain.a, |_| 1.0);
    assert!(a <= tol::rounding(terms), "{scheme}, {what}: A differs by {a:e}");
    let m = difference(&system.m, &plain.m, |i| 1.0 / plain.h[i]);
    assert!(m <= tol::rounding(terms), "{scheme}, {what}: M differs by {m:e} of its row sum");
}

fn hold_identities(system: &LimitSystem, scheme: Scheme, what: &str) {
    let n = system.len();
    assert!(system.h.iter().all(|&h| h > 0.0 && h.is_finite()));
    assert!(system.a.values().iter().all(|&a| a >= 0.0), "{scheme}, {what}: a negative entry");
    let mut columns = vec![0.0; n];
    let mut largest_column = vec![0usize; n];
    for i in 0..n {
        let sum: f64 = system.a.row_values(i).iter().sum();
        let error = (sum - 1.0).abs();
        assert!(error <= tol::rounding(system.a.row(i).len()), "{scheme}, {what}: row {i} sums to 1 + {error:e}");
        assert_eq!(system.diagonal[i], system.a.get(i, i));
        for ((j, a), (k, m)) in system.a.row(i).zip(system.m.row(i)) {
            assert_eq!((j, a), (k, system.h[i] * m), "{scheme}, {what}: A = H·M");
            assert_eq!(m.to_bits(), system.m.get(j, i).to_bits(), "{scheme}, {what}: M = Mᵀ");
            columns[j] += a / system.h[i];
            largest_column[j] += 1;
        }
    }
    // w = H⁻¹1: wᵀA = wᵀ.
    for (j, sum) in columns.iter().enumerate() {
        let error = (sum * system.h[j] - 1.0).abs();
        assert!(error <= tol::rounding(largest_column[j]), "{scheme}, {what}: wᵀA, column {j}");
    }
}

#[test]
fn systems_are_those_of_the_formulas() {
    for scheme in Scheme::ALL {
        (0..100u64).into_par_iter().for_each(|seed| {
            let mesh = small_mesh(scheme, seed);
            let system = system(&mesh, scheme);
            hold_against_formulas(&system, scheme, &mesh, &format!("seed {seed}"));
            hold_identities(&system, scheme, &format!("seed {seed}"));
        });
    }
}

#[test]
fn identities_hold_at_large_valences_and_on_large_faces() {
    for scheme in Scheme::ALL {
        (0..60u64).into_par_iter().for_each(|seed| {
            let mesh = if scheme.needs_triangles() { random_triangulation(seed) } else { random_polygons(seed) };
            hold_identities(&system(&mesh, scheme), scheme, &format!("seed {seed}"));
        });
    }
}

/// Two faces with two common edges; stars that share all their neighbours; the smallest meshes.
#[test]
fn everything_counts_with_multiplicity() {
    let spliced = spliced_cubes();
    // Neither on an edge, but in both octagons: 4/8 from each.
    let octagons = system(&spliced, Scheme::CatmullClark);
    assert_eq!(octagons.m.get(0, 1), 1.0);
    assert_eq!(octagons.m.get(1, 8), 2.0 + 1.0);

    let mut meshes = vec![spliced];
    for name in ["tetrahedron", "bipyramid:3", "octahedron", "prism:3", "torus:3x3", "tri-torus:3x3"] {
        meshes.push(built_in(name));
    }
    for k in [50, 400] {
        meshes.push(builtin::bipyramid(k));
        meshes.push(builtin::prism(k));
    }
    for mesh in &meshes {
        for scheme in Scheme::ALL {
            if scheme.first_unsuitable_face(&mesh.faces).is_none() {
                let what = format!("{} vertices", mesh.len());
                let system = system(mesh, scheme);
                hold_against_formulas(&system, scheme, mesh, &what);
                hold_identities(&system, scheme, &what);
            }
        }
    }
}

#[test]
fn a_small_system_can_be_checked_by_hand() {
    // The cube under Catmull-Clark: n²−n = 6 and 3·4/4 on the diagonal; an edge 2 + 1 + 1; a face diagonal 1.
    let mesh = built_in("cube");
    let cube = system(&mesh, Scheme::CatmullClark);
    for i in 0..8 {
        let mut row: Vec<f64> = cube.m.row_values(i).to_vec();
        row.sort_by(f64::total_cmp);
        assert_eq!(row, [1.0, 1.0, 1.0, 4.0, 4.0, 4.0, 9.0]);
        assert_eq!(cube.h[i], 1.0 / 24.0);
    }
}

/// Zheng-Cai Eq. 6 in its own scaling: row i is n V_i + Σ_F centroid_F = 2n I_i, which is M V = H⁻¹P entry by entry.
#[test]
fn zheng_cai_rows_are_their_equation_6() {
    for seed in 0..30 {
        let mesh = scattered(&small_polygons(seed), seed);
        let system = system(&mesh, Scheme::ZhengCai);
        let right = system.symmetric_right_hand_side(&mesh.positions);
        let v = random_points(mesh.len(), seed + 1);
        let mut left = vec![DVec3::ZERO; mesh.len()];
        let mut faces = vec![0.0; mesh.len()];
        for face in mesh.faces.iter() {
            let sum: DVec3 = face.iter().map(|&c| v[c as usize]).sum();
            for &c in face {
                left[c as usize] += v[c as usize] + sum / face.len() as f64;
                faces[c as usize] += 1.0;
            }
        }
        for i in 0..mesh.len() {
            let allowed = tol::rounding(system.m.row(i).len()) * 4.0 * faces[i];
            assert!((system.m.row_times(i, &v) - left[i]).length() <= allowed);
            assert!((right[i] - 2.0 * faces[i] * mesh.positions[i]).length() <= allowed);
        }
    }
}

#[test]
fn products_are_those_of_sprs() {
    for scheme in Scheme::ALL {
        for seed in 0..20 {
            let mesh = small_mesh(scheme, seed);
            let system = system(&mesh, scheme);
            let pattern = system.a.pattern();
            let theirs = sprs::CsMatI::<f64, u32>::new(
                (mesh.len(), mesh.len()),
                pattern.offsets().to_vec(),
                pattern.columns().to_vec(),
                system.a.values().to_vec(),
            );
            let x = random_points(mesh.len(), seed);
            let numbers: Vec<f64> = x.iter().map(|p| p.y).collect();
            let mut y = vec![0.0; mesh.len()];
            sprs::prod::mul_acc_mat_vec_csr(theirs.view(), numbers.as_slice(), y.as_mut_slice());
            for (i, &y) in y.iter().enumerate() {
                let allowed = tol::rounding(system.a.row(i).len());
                assert!((system.a.row_times(i, &x).y - y).abs() <= allowed);
                assert!((system.a.row_times(i, &numbers) - y).abs() <= allowed);
            }
            // sprs finds the same factorization A = H·M.
            let mut scaled = theirs.clone();
            for (mut row, h) in scaled.outer_iterator_mut().zip(&system.h) {
                row.iter_mut().for_each(|(_, a)| *a /= h);
            }
            let transposed = scaled.transpose_view().to_csr();
            let largest = (scaled.data().iter().zip(transposed.data()))
                .map(|(a, b)| (a - b).abs() / a.abs().max(1.0))
                .fold(0.0, f64::max);
            assert!(largest <= tol::rounding(2), "{scheme} {seed}: {largest:e}");
        }
    }
}

#[test]
fn renumbering_vertices_permutes_the_system() {
    for scheme in Scheme::ALL {
        for seed in 0..20 {
            let mesh = small_mesh(scheme, seed);
            let order = Order::Random(seed + 7).order(&mesh, &topology(&mesh).incidence);
            let (before, after) = (system(&mesh, scheme), system(&permute_vertices(&mesh, &order), scheme));
            for (k, &i) in order.iter().enumerate() {
                assert_eq!(after.h[k], before.h[i as usize]);
                assert_eq!(after.a.row(k).len(), before.a.row(i as usize).len());
                for (l, a) in after.a.row(k) {
                    let moved = before.a.get(i as usize, order[l] as usize);
                    assert!((a - moved).abs() <= tol::rounding(4), "{scheme} {seed}");
                }
            }
        }
    }
}

#[test]
fn systems_do_not_depend_on_the_number_of_threads() {
    let mesh = noisy("irregular-tri:20000");
    for scheme in Scheme::ALL {
        let systems = [1, 2, 3].map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| system(&mesh, scheme))
        });
        for other in &systems[1..] {
            assert_eq!((&systems[0].a, &systems[0].m), (&other.a, &other.m), "{scheme}");
        }
    }
}
