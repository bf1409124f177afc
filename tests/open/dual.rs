//! Dual refinement of open and creased meshes: against a step by hand, the surface against the points that it
//! interpolates, normals on a boundary against those of ever smaller faces.

use std::collections::BTreeSet;
use std::f64::consts::TAU;

use glam::DVec3;
use limitlab::Error;
use limitlab::interpolate::surface::{SurfaceOptions, check, surface};
use limitlab::interpolate::zheng_cai::{self, Constraints, PhaseOne, Sweep, auxiliary};
use limitlab::interpolate::{Options, Tolerance, interpolate, limit_points};
use limitlab::mesh::features::{Rule, Tags};
use limitlab::mesh::validate::Boundary;
use limitlab::mesh::{Faces, Mesh, Surface, builtin};
use limitlab::schemes::doo_sabin::{self, CornerRule};
use limitlab::schemes::{Refinement, Scheme};

use super::naive::Creased;
use super::{grid, open, random_creased, random_points};
use crate::common::meshes::small_mesh;

const SCHEMES: [(Scheme, CornerRule); 3] = [
    (Scheme::Nasri, CornerRule::DooSabin),
    (Scheme::ZhengCai, CornerRule::ZhengCai),
    (Scheme::MidEdge, CornerRule::MidEdge),
];

/// The rule of all steps but the first.
fn further(rule: CornerRule) -> CornerRule {
    match rule {
        CornerRule::DooSabin | CornerRule::ZhengCai => CornerRule::DooSabin,
        CornerRule::MidEdge => CornerRule::MidEdge,
    }
}

/// The weight in corner 0 of an m-gon of the corner j further on.
fn weight(rule: CornerRule, m: usize, j: usize) -> f64 {
    let (size, own) = (m as f64, if j == 0 { 1.0 } else { 0.0 });
    match rule {
        CornerRule::DooSabin => 0.25 * own + (3.0 + 2.0 * (TAU * j as f64 / size).cos()) / (4.0 * size),
        CornerRule::ZhengCai => 0.5 * own + 0.5 / size,
        CornerRule::MidEdge => 0.5 * own + if j == 1 || j == m - 1 { 0.25 } else { 0.0 },
    }
}

/// A step by a rule, with topology and features.
fn refined(rule: CornerRule, coarse: &Surface) -> Surface {
    let fine = doo_sabin::refine_by(rule, coarse).unwrap();
    let scheme = if rule == CornerRule::MidEdge { Refinement::MidEdge } else { Refinement::DooSabin };
    let plain = if coarse.features().is_none() { Refinement::DooSabin } else { scheme }.refined(coarse).unwrap();
    assert_eq!(fine.faces, plain.mesh().faces);
    plain.with_positions(fine.positions)
}

/// Each face from its least vertex on.
fn turned(faces: &Faces, number: impl Fn(u32) -> u32) -> BTreeSet<Vec<u32>> {
    let face = |face: &[u32]| {
        let mut face: Vec<u32> = face.iter().map(|&v| number(v)).collect();
        let least = (0..face.len()).min_by_key(|&k| face[k]).unwrap();
        face.rotate_left(least);
        face
    };
    faces.iter().map(face).collect()
}

#[test]
fn a_step_is_the_one_by_hand_and_carries_features_over() {
    for (scheme, rule) in SCHEMES {
        let (mut held, mut corners) = (0, [0; 4]);
        for seed in 0..150 {
            let Some((coarse, tags)) = random_creased(scheme, seed) else { continue };
            let (mut fine, mut by_hand) = (coarse.clone(), Creased::of(&coarse, &tags));
            for (level, rule) in [rule, further(rule)].into_iter().enumerate() {
                if level == 1 && fine.len() > 300 {
                    continue;
                }
                fine = refined(rule, &fine);
                by_hand = by_hand.dual(|m, j| weight(rule, m, j));
                let theirs = &by_hand.mesh;
                assert_eq!(fine.len(), theirs.len(), "{scheme}, seed {seed}");
                // Points at random tell the vertices apart.
                let nearest = |p: &DVec3| {
                    let off = |v: &usize| theirs.positions[*v].distance(*p);
                    let v = (0..theirs.len()).min_by(|a, b| off(a).total_cmp(&off(b))).unwrap();
                    assert!(off(&v) <= 1e-14, "{scheme}, seed {seed}, level {level}: {:e}", off(&v));
                    v as u32
                };
                let place: Vec<u32> = fine.positions().iter().map(nearest).collect();
                assert_eq!(place.iter().collect::<BTreeSet<_>>().len(), place.len());
                let ours = turned(fine.faces(), |v| place[v as usize]);
                assert_eq!((fine.faces().len(), theirs.faces.len()), (ours.len(), ours.len()));
                assert!(ours == turned(&theirs.faces, |v| v), "{scheme}, seed {seed}, level {level}");
                // What is sharp, given anew on faces that are found valid.
                let mut back = vec![0; place.len()];
                place.iter().zip(0..).for_each(|(&there, v)| back[there as usize] = v);
                let creases = by_hand.sharp.keys().map(|side| (side.map(|v| back[v as usize]), 10.0)).collect();
                let corners = by_hand.corners.keys().map(|&v| (back[v as usize], 10.0)).collect();
                let anew = Surface::examined(fine.mesh().clone(), None, fine.boundary()).unwrap();
                let anew = anew.tagged(&Tags { boundary: fine.boundary(), creases, corners }).unwrap();
                assert!(fine.features() == anew.features(), "{scheme}, seed {seed}, level {level}");
                assert!(fine.topology() == anew.topology());
            }
            held += usize::from(coarse.features().is_some());
            for v in (0..coarse.len()).filter(|&v| coarse.features().is_some_and(|f| f.rules()[v] == Rule::Corner)) {
                let sharp = Creased::of(&coarse, &tags).sharp.keys().filter(|side| side.contains(&(v as u32))).count();
                corners[sharp.min(3)] += 1;
            }
        }
        // Corners of every number of sharp edges.
        assert!(held > 100 && corners.iter().all(|&count| count > 15), "{scheme}: {held}, {corners:?}");
    }
}

/// The limit points of a mesh are those of the rows of A; on the next level, of a smooth vertex the centroid of its face, which
/// keeps its number, of a crease vertex the middle between two points of its curve, of a corner itself.
#[test]
fn limit_points_are_those_of_the_rows_and_stay_under_refinement() {
    for (scheme, rule) in SCHEMES {
        for seed in 0..100 {
            let Some((coarse, _)) = random_creased(scheme, seed) else { continue };
            let limits = doo_sabin::limit_positions(rule, &coarse).unwrap();
            for (a, b) in limits.iter().zip(limit_points(&coarse, scheme).unwrap()) {
                assert!(a.distance(b) <= 1e-14, "{scheme}, seed {seed}");
            }
            let first = doo_sabin::first_vertex_face(&coarse);
            let mut fine = refined(rule, &coarse);
            for level in 1..4 {
                for (v, limit) in limits.iter().enumerate() {
                    let at = |v: u32| fine.positions()[v as usize];
                    let near = match coarse.features().map_or(Rule::Smooth, |features| features.rules()[v]) {
                        Rule::Smooth => {
                            let face = fine.faces().face(first + v);
                            face.iter().map(|&v| at(v)).sum::<DVec3>() / face.len() as f64
                        }
                        Rule::Crease => {
                            let side = |&c: &u32| {
                                let face = fine.faces().range(fine.incidence().face_of(c));
                                let next = if c as usize + 1 == face.end { face.start } else { c as usize + 1 };
                                0.5 * (at(fine.faces().corners()[c as usize]) + at(fine.faces().corners()[next]))
                            };
                            let middles = fine.features().unwrap().sharp_half_edges().iter().map(side);
                            middles.min_by(|a, b| a.distance(*limit).total_cmp(&b.distance(*limit))).unwrap()
                        }
                        _ => {
                            let rules = fine.features().unwrap().rules();
                            let corners = (0..fine.len()).filter(|&w| rules[w] == Rule::Corner);
                            let corners = corners.map(|w| fine.positions()[w]);
                            corners.min_by(|a, b| a.distance(*limit).total_cmp(&b.distance(*limit))).unwrap()
                        }
                    };
                    assert!(near.distance(*limit) <= 1e-14, "{scheme}, seed {seed}, vertex {v}, level {level}");
                }
                fine = refined(further(rule), &fine);
            }
        }
    }
}

/// The whole way: control mesh, levels, limit points, which come near the given points, on curves and beside them.
#[test]
fn the_surface_of_an_open_mesh_comes_to_its_points() {
    for (scheme, _) in SCHEMES {
        let mut held = 0;
        for seed in 0..40 {
            let Some((given, _)) = random_creased(scheme, seed) else { continue };
            if given.features().is_none() || given.faces().corners().len() > 150 {
                continue;
            }
            let options = Options { tolerance: Tolerance::Relative(1e-13), ..Options::default() };
            let Ok(found) = interpolate(&given, scheme, &options) else { continue };
            let control = given.with_positions(found.points);
            let mut before = f64::INFINITY;
            for levels in 0..5 {
                let request = SurfaceOptions { levels, limit: true, normals: true, ..SurfaceOptions::default() };
                let made = surface(control.clone(), scheme, given.positions(), &request).unwrap();
                assert!(made.normals.unwrap().iter().all(|n| n.is_finite()));
                let reached =
                    |p: &DVec3| made.surface.positions().iter().map(|q| p.distance(*q)).fold(f64::INFINITY, f64::min);
                let off = given.positions().iter().map(reached).fold(0.0, f64::max);
                if levels == 0 {
                    assert!(off <= 1e-11, "{scheme}, seed {seed}: {off:e}");
                    continue;
                }
                // About a vertex of valence n mid-edge shrinks by cos²(π/n).
                let factor = if scheme == Scheme::MidEdge { 0.97 } else { 0.75 };
                assert!(off < factor * before, "{scheme}, seed {seed}, {levels} levels: {off} after {before}");
                before = off;
            }
            held += 1;
        }
        assert!(held > 8, "{scheme}: {held}");
    }
}

/// A vertex inside the surface with two faces only: its face of type V has four corners, whose centroid is the limit point, and
/// all vertices of the refined mesh have three faces or more.
#[test]
fn vertices_with_two_faces_are_refined() {
    // One, two and three of them on the edge 5–9 of a grid, and the first one smooth or at rest.
    for count in 1..4 {
        for tags in [Vec::new(), vec![(16, 10.0)]] {
            let grid = grid(4, 4, false);
            let faces = grid.faces.iter().map(|face| {
                let mut face = face.to_vec();
                if let Some(k) = (0..4).find(|&k| [face[k], face[(k + 1) % 4]] == [5, 9]) {
                    face.splice(k + 1..k + 1, 16..16 + count);
                } else if let Some(k) = (0..4).find(|&k| [face[k], face[(k + 1) % 4]] == [9, 5]) {
                    face.splice(k + 1..k + 1, (16..16 + count).rev());
                }
                face
            });
            let faces = Faces::from_lists(faces);
            let mesh = Mesh::new(random_points(16 + count as usize, 3), faces);
            let tags = Tags { boundary: Boundary::EdgeAndCorner, corners: tags, ..Tags::default() };
            let coarse = open(mesh, Boundary::EdgeAndCorner).tagged(&tags).unwrap();
            assert_eq!((16..16 + count).map(|v| coarse.incidence().face_count(v as usize)).max(), Some(2));
            for (_, rule) in SCHEMES {
                let limits = doo_sabin::limit_positions(rule, &coarse).unwrap();
                let first = doo_sabin::first_vertex_face(&coarse);
                let mut fine = refined(rule, &coarse);
                for _ in 0..3 {
                    let anew = Surface::examined(fine.mesh().clone(), None, Boundary::EdgeAndCorner).unwrap();
                    assert_eq!(fine.topology(), anew.topology());
                    assert_eq!(fine.topology().euler_characteristic(fine.faces()), 1);
                    let inside = |&v: &usize| fine.features().unwrap().is_smooth(v);
                    let least = (0..fine.len()).filter(inside).map(|v| fine.incidence().face_count(v)).min();
                    assert!(least >= Some(3), "{least:?}");
                    for v in (0..coarse.len()).filter(|&v| coarse.features().unwrap().is_smooth(v)) {
                        let face = fine.faces().face(first + v);
                        assert!(face.len() > 3 || face.len() == coarse.incidence().face_count(v));
                        let center =
                            face.iter().map(|&w| fine.positions()[w as usize]).sum::<DVec3>() / face.len() as f64;
                        assert!(center.distance(limits[v]) < 1e-14, "{count}, {rule:?}, vertex {v}");
                    }
                    fine = refined(further(rule), &fine);
                }
            }
        }
    }
}

/// The faces next to the limit point of a boundary vertex, level by level: their normals come to that of the surface.
#[test]
fn normals_on_a_boundary_are_the_limits_of_those_of_the_faces() {
    for (scheme, rule) in SCHEMES {
        let mut held = [0; 2];
        for seed in 0..60 {
            let Some((coarse, _)) = random_creased(scheme, seed) else { continue };
            if coarse.faces().corners().len() > 60 || coarse.features().is_none() {
                continue;
            }
            let (limits, normals) =
                (doo_sabin::limit_positions(rule, &coarse).unwrap(), doo_sabin::limit_normals(rule, &coarse).unwrap());
            let mut fine = refined(rule, &coarse);
            for _ in 0..4 {
                fine = refined(further(rule), &fine);
            }
            let sharp: Vec<usize> = (0..coarse.len()).filter(|&v| !coarse.features().unwrap().is_smooth(v)).collect();
            let mut off = vec![Vec::new(); coarse.len()];
            for level in 5..7 {
                for &v in sharp.iter().filter(|&&v| normals[v] != DVec3::ZERO) {
                    off[v].push(spread(&fine, limits[v], normals[v]));
                }
                if level < 6 {
                    fine = refined(further(rule), &fine);
                }
            }
            for (v, off) in off.iter().enumerate().filter(|(_, off)| !off.is_empty()) {
                let is_corner = coarse.features().unwrap().rules()[v] == Rule::Corner;
                assert!(
                    off[1] < 0.6 * off[0].max(1e-7) || is_corner && off[1] < 1e-6,
                    "{scheme}, seed {seed}, vertex {v}: {off:?}"
                );
                held[usize::from(is_corner)] += 1;
            }
        }
        assert!(held[0] > 30 && held[1] > 5, "{scheme}: {held:?}");
    }
}

/// The greatest angle between `normal` and the faces at the edge of a curve with the middle `point`, or at the corner there.
fn spread(fine: &Surface, point: DVec3, normal: DVec3) -> f64 {
    let (faces, at) = (fine.faces(), |v: u32| fine.positions()[v as usize]);
    let near = |face: &&[u32]| {
        (0..face.len()).any(|k| {
            let (a, b) = (at(face[k]), at(face[(k + 1) % face.len()]));
            a.distance(point) < 1e-12 || (0.5 * (a + b)).distance(point) < 1e-12
        })
    };
    let angle = |face: &[u32]| {
        let origin = at(face[0]);
        let fan = face.windows(2).map(|w| (at(w[0]) - origin).cross(at(w[1]) - origin));
        let facet = fan.sum::<DVec3>();
        facet.cross(normal).length().atan2(facet.dot(normal))
    };
    faces.iter().filter(near).map(angle).fold(0.0, f64::max)
}

/// On a closed mesh the rule is two steps of mid-edge: their vertices are the corners, in the order of the edges between the
/// edges of the first step.
#[test]
fn the_rule_of_mid_edge_is_two_of_its_steps() {
    for seed in 0..20 {
        let surface = Surface::new(small_mesh(Scheme::MidEdge, seed)).unwrap();
        // Points at random tell the vertices apart.
        let surface = surface.with_positions(random_points(surface.len(), seed));
        let once = doo_sabin::refine_by(CornerRule::MidEdge, &surface).unwrap();
        let twice = Refinement::MidEdge.refine_n(&surface, 2).unwrap();
        assert_eq!((once.len(), once.faces.len()), (twice.len(), twice.faces.len()));
        let nearest = |p: &DVec3| {
            let off = |v: &usize| twice.positions[*v].distance(*p);
            let v = (0..twice.len()).min_by(|a, b| off(a).total_cmp(&off(b))).unwrap();
            assert!(off(&v) <= 1e-14 * surface.diagonal());
            v as u32
        };
        let place: Vec<u32> = once.positions.iter().map(nearest).collect();
        assert_eq!(place.iter().collect::<BTreeSet<_>>().len(), place.len());
        assert_eq!(turned(&once.faces, |v| place[v as usize]), turned(&twice.faces, |v| v), "seed {seed}");
    }
}

/// Phase one is Gauss-Seidel on the smooth vertices after exact curves, so that it comes to the solution of the system, and
/// phase two puts the limit points on the given ones from any start.
#[test]
fn two_phases_meet_the_points_of_open_and_creased_meshes() {
    let mut held = 0;
    for seed in 0..60 {
        let Some((given, _)) = random_creased(Scheme::ZhengCai, seed) else { continue };
        let Some(features) = given.features() else { continue };
        let marks: Vec<bool> = (0..given.len()).map(|v| (v + seed as usize) % 5 < 4).collect();
        for interpolated in [None, Some(&marks[..])] {
            let is_asked = |v: usize| interpolated.is_none_or(|marks| marks[v]);
            let options = Options { interpolated, tolerance: Tolerance::Absolute(1e-13), ..Options::default() };
            let solved = interpolate(&given, Scheme::ZhengCai, &options).unwrap().points;
            for sweep in [Sweep::GaussSeidel(None), Sweep::Jacobi] {
                let phase = PhaseOne { sweep, max_iterations: 200, eps: 1e-13 };
                let found = auxiliary(&given, interpolated, &phase).unwrap();
                assert!(found.passed);
                let off = found.surface.positions().iter().zip(&solved).map(|(a, b)| a.distance(*b));
                assert!(off.fold(0.0, f64::max) < 1e-11, "seed {seed}, {sweep:?}");
            }
            // A single sweep: curves are exact, and phase two does the rest.
            let handles: Vec<f64> = (0..given.len())
                .map(|v| if features.is_smooth(v) && is_asked(v) { 0.5 + (v % 3) as f64 } else { 1.0 })
                .collect();
            let mut normals = vec![None; given.len()];
            let smooth = (0..given.len()).find(|&v| features.is_smooth(v) && is_asked(v));
            smooth.into_iter().for_each(|v| normals[v] = Some(DVec3::new(0.3, -0.5, 0.8)));
            let constraints = Constraints { interpolated, handles: Some(&handles), normals: Some(&normals) };
            let phase = PhaseOne { max_iterations: 1, ..PhaseOne::default() };
            let made = zheng_cai::interpolate(&given, &constraints, &phase).unwrap();
            let auxiliary = &made.auxiliary.surface;
            let fine = Refinement::DooSabin.refined_n(&made.first.surface, 2).unwrap();
            assert_eq!(made.first.at_level(3).unwrap().positions, fine.positions());
            let by_rows = doo_sabin::limit_positions(CornerRule::ZhengCai, auxiliary).unwrap();
            for (v, point) in given.positions().iter().enumerate().filter(|(v, _)| is_asked(*v)) {
                let reached = match features.is_smooth(v) {
                    true => {
                        let face = fine.faces().face(made.first.first_vertex_face + v);
                        face.iter().map(|&w| fine.positions()[w as usize]).sum::<DVec3>() / face.len() as f64
                    }
                    false => by_rows[v],
                };
                assert!(reached.distance(*point) < 1e-14, "seed {seed}, vertex {v}");
            }
            if let Some(v) = smooth {
                let normal = doo_sabin::face_normals(fine.mesh())[made.first.first_vertex_face + v];
                assert!(normal.cross(normals[v].unwrap().normalize()).length() < 1e-9, "seed {seed}: {normal}");
            }
        }
        held += 1;
    }
    assert!(held > 30, "{held}");
    let message = |normals: &[Option<DVec3>], handles: &[f64]| {
        let sheet = open(grid(3, 3, false), Boundary::EdgeAndCorner);
        let constraints = Constraints { normals: Some(normals), handles: Some(handles), ..Constraints::default() };
        zheng_cai::interpolate(&sheet, &constraints, &PhaseOne::default()).unwrap_err().to_string()
    };
    let (mut normals, mut handles) = (vec![None; 9], vec![1.0; 9]);
    handles[3] = 2.0;
    assert!(message(&normals, &handles).contains("vertex 3 is sharp"));
    normals[0] = Some(DVec3::Z);
    assert!(message(&normals, &handles).contains("vertex 0 is sharp"));
}

#[test]
fn what_has_no_rule_is_refused_before_any_work() {
    let cube = Surface::new(builtin::cube()).unwrap();
    let dart = cube.tagged(&Tags { creases: vec![([0, 1], 10.0)], ..Tags::default() }).unwrap();
    assert!(matches!(Refinement::DooSabin.check(&dart), Err(Error::Dart { vertex: 0, .. })));
    assert!(matches!(Refinement::DooSabin.refine(&dart), Err(Error::Dart { .. })));
    let semi = cube.tagged(&Tags { creases: vec![([0, 1], 2.5)], ..Tags::default() }).unwrap();
    assert!(matches!(Refinement::DooSabin.check(&semi), Err(Error::SemiSharp { vertex: 0, .. })));
    let sheet = open(grid(4, 4, false), Boundary::EdgeAndCorner);
    let wanted = |levels, normals| SurfaceOptions { levels, normals, ..SurfaceOptions::default() };
    let refused = |scheme, levels, normals| check(&sheet, scheme, &wanted(levels, normals)).is_err();
    assert!(SCHEMES.iter().all(|&(scheme, _)| !refused(scheme, 2, true)));
    assert!(!refused(Scheme::Sqrt3, 0, false) && refused(Scheme::Sqrt3, 1, false));
    let mut normals = vec![None; sheet.len()];
    normals[1] = Some(DVec3::Z);
    let constraints = Constraints { normals: Some(&normals), ..Constraints::default() };
    let request = SurfaceOptions { levels: 2, constraints, ..SurfaceOptions::default() };
    let message = check(&sheet, Scheme::ZhengCai, &request).unwrap_err().to_string();
    assert!(message.contains("vertex 1 is sharp"), "{message}");
}
