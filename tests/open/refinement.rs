//! Refinement of open and creased meshes, its limit points and normals: against refinement by hand, against tags given anew,
//! and against themselves after a step.

use std::collections::BTreeMap;

use glam::DVec3;
use limitlab::Error;
use limitlab::interpolate::surface::{SurfaceOptions, surface};
use limitlab::interpolate::{Options, interpolate, limit_points};
use limitlab::mesh::features::{Rule, Tags};
use limitlab::mesh::validate::Boundary;
use limitlab::mesh::{Faces, Mesh, Surface, Topology};
use limitlab::schemes::{Refinement, Scheme, catmull_clark, loop_scheme};

use super::naive::{Creased, edge, faces_by_edge};
use super::{grid, open, random_creased, random_points, random_semi_sharp};

type Step = fn(&Creased) -> Creased;
const SCHEMES: [(Scheme, Refinement, Step); 2] = [
    (Scheme::CatmullClark, Refinement::CatmullClark, Creased::catmull_clark),
    (Scheme::Loop, Refinement::Loop, Creased::loop_step),
];

/// As [`random_creased`], every third one with the darts that its corners hide, every third one with semi-sharp tags.
fn random_tagged(scheme: Scheme, seed: u64) -> Option<(Surface, Tags)> {
    if seed % 3 == 2 {
        return random_semi_sharp(scheme, seed);
    }
    let (surface, mut tags) = random_creased(scheme, seed)?;
    if seed % 3 == 1 {
        return Some((surface, tags));
    }
    tags.corners.clear();
    Some((surface.tagged(&tags).unwrap(), tags))
}

/// The refined surface with these tags.
fn tagged_anew(fine: &Surface, creases: Vec<([u32; 2], f64)>, corners: Vec<(u32, f64)>) -> Surface {
    let tags = Tags { boundary: fine.boundary(), creases, corners };
    Surface::examined(fine.mesh().clone(), None, fine.boundary()).unwrap().tagged(&tags).unwrap()
}

/// Topology and features against those found from the refined faces alone, where the new vertices on edges stand in the
/// order of their edges' first half-edges.
fn hold_against_tags(coarse: &Surface, fine: &Surface) {
    assert!(*fine.topology() == Topology::new(fine.faces(), fine.len()));
    assert_eq!(fine.boundary_edges(), 2 * coarse.boundary_edges());
    let Some(features) = coarse.features() else {
        assert!(fine.features().is_none());
        return;
    };
    assert_eq!(fine.boundary(), coarse.boundary());
    assert!(fine.tagged(&fine.tags()).unwrap().features() == fine.features());
    let topology = coarse.topology();
    let numbers: BTreeMap<u32, u32> = topology.edge_sides().zip(coarse.len() as u32..).collect();
    let corners = coarse.faces().corners();
    let halves = |(c, s): (u32, f64)| {
        let face = coarse.faces().range(topology.incidence.face_of(c));
        let next = if c as usize + 1 == face.end { face.start } else { c as usize + 1 };
        [([corners[c as usize], numbers[&c]], s), ([numbers[&c], corners[next]], s)]
    };
    let lowered = |list: &[(u32, f64)]| list.iter().map(|&(k, s)| (k, (s - 1.0).max(0.0))).collect::<Vec<_>>();
    let sharp = features.sharp_half_edges().iter().map(|&c| (c, 10.0));
    let creases = sharp.chain(lowered(features.semi_sharp_edges())).flat_map(halves).collect();
    let resting = (0..coarse.len() as u32).filter(|&v| features.rules()[v as usize] == Rule::Corner);
    let resting = resting.map(|v| (v, 10.0)).chain(lowered(features.semi_sharp_vertices())).collect();
    let anew = tagged_anew(fine, creases, resting);
    assert!(fine.features() == anew.features());
    let Some(found) = fine.features() else { return };
    for (v, (before, after)) in features.rules().iter().zip(found.rules()).enumerate() {
        assert!(before == after || (*before, *after) == (Rule::SemiSharp, Rule::Smooth), "vertex {v}");
    }
    assert_eq!(found.creased_edges(), 2 * features.creased_edges());
}

#[test]
fn a_step_is_the_one_by_hand_and_carries_features_over() {
    let butterfly: (Scheme, Refinement, Step) = (Scheme::Loop, Refinement::Butterfly, Creased::butterfly);
    for (scheme, refinement, step) in SCHEMES.into_iter().chain([butterfly]) {
        let (mut open, mut darts, mut semi_sharp) = (0, 0, 0);
        for seed in 0..300 {
            let Some((coarse, tags)) = random_tagged(scheme, seed) else { continue };
            if refinement.check(&coarse).is_err() {
                continue;
            }
            let by_hand = step(&Creased::of(&coarse, &tags));
            let fine = refinement.refined(&coarse).unwrap();
            assert_eq!(fine.mesh().faces, refinement.refine(&coarse).unwrap().faces);
            // By hand, edges come in the order of their ends.
            let edges: BTreeMap<[u32; 2], u32> = faces_by_edge(coarse.mesh()).into_keys().zip(0..).collect();
            let n = coarse.len();
            let mut place: Vec<u32> = (0..fine.len() as u32).collect();
            let topology = coarse.topology();
            for (e, c) in topology.edge_sides().enumerate() {
                let face = coarse.faces().face(topology.incidence.face_of(c));
                let k = c as usize - coarse.faces().range(topology.incidence.face_of(c)).start;
                place[n + e] = n as u32 + edges[&edge(face[k], face[(k + 1) % face.len()])];
            }
            for (v, &there) in place.iter().enumerate() {
                let off = fine.positions()[v].distance(by_hand.mesh.positions[there as usize]);
                assert!(off <= 1e-14, "{scheme}, seed {seed}, vertex {v}: {off:e}");
            }
            for (ours, theirs) in fine.faces().iter().zip(by_hand.mesh.faces.iter()) {
                assert!(ours.iter().map(|&v| place[v as usize]).eq(theirs.iter().copied()), "{scheme}, seed {seed}");
            }
            if refinement == Refinement::CatmullClark {
                let in_place = catmull_clark::refine_in_place(coarse.clone()).unwrap();
                assert_eq!(in_place.faces, *fine.faces());
                let off = crate::common::meshes::distance(&in_place.positions, fine.positions());
                assert!(off < 1e-13, "seed {seed}, in place: {off:e}");
            }
            hold_against_tags(&coarse, &fine);
            hold_against_tags(&fine, &refinement.refined(&fine).unwrap());
            open += usize::from(!coarse.is_closed());
            darts += coarse.features().map_or(0, |f| f.count(Rule::Dart));
            semi_sharp += coarse.features().map_or(0, |f| f.semi_sharp_edges().len());
        }
        assert!(open > 100 && darts > 70, "{refinement}: {open}, {darts}");
        let expected = refinement != Refinement::Butterfly;
        assert_eq!(semi_sharp > 100, expected, "{refinement}: {semi_sharp}");
    }
}

/// Meshes of many tasks, with holes and creases in all of them.
#[test]
fn large_meshes_are_refined_as_small_ones() {
    for (refinement, triangles) in [(Refinement::CatmullClark, false), (Refinement::Loop, true)] {
        let (p, q) = (110, 120);
        let mut mesh = grid(p, q, triangles);
        let is_inside = |&v: &u32| (2..p - 2).contains(&(v as usize / q)) && (2..q - 2).contains(&(v as usize % q));
        let faces = mesh.faces.iter().enumerate();
        let kept = faces.filter(|(f, face)| f % 1013 != 500 || !face.iter().all(is_inside));
        mesh.faces = Faces::from_lists(kept.map(|(_, face)| face));
        let coarse = open(mesh, Boundary::EdgeAndCorner);
        let at = |i: usize, j: usize| (i * q + j) as u32;
        let columns = (1..p - 1).step_by(9).flat_map(|i| (1..q - 20).map(move |j| [at(i, j), at(i, j + 1)]));
        let creases = columns.filter(|&ends| coarse.incidence().half_edge(coarse.faces(), ends).is_some());
        let creases = creases.map(|ends| (ends, 10.0)).collect();
        let tags = Tags { boundary: Boundary::EdgeAndCorner, creases, corners: vec![(at(50, 50), 10.0)] };
        let coarse = coarse.tagged(&tags).unwrap();
        let fine = refinement.refined(&coarse).unwrap();
        hold_against_tags(&coarse, &fine);
        let (features, topology) = (coarse.features().unwrap(), coarse.topology());
        assert!(features.creased_edges() > 1000 && features.count(Rule::Dart) > 10);
        let mut held = 0;
        for (e, c) in topology.edge_sides().enumerate() {
            if features.sharp_half_edges().binary_search(&c).is_ok() {
                let face = coarse.faces().face(topology.incidence.face_of(c));
                let k = c as usize - coarse.faces().range(topology.incidence.face_of(c)).start;
                let ends = [face[k], face[(k + 1) % face.len()]].map(|v| coarse.positions()[v as usize]);
                assert_eq!(fine.positions()[coarse.len() + e], 0.5 * (ends[0] + ends[1]));
                held += 1;
            }
        }
        assert_eq!(held, features.sharp_half_edges().len());
    }
}

#[test]
fn limit_points_are_those_of_the_rows_and_stay_under_refinement() {
    for (scheme, refinement, _) in SCHEMES {
        let (mut darts, mut semi_sharp) = (0, 0);
        for seed in 0..300 {
            let Some((coarse, _)) = random_tagged(scheme, seed) else { continue };
            let limits = refinement.limit_positions(&coarse).unwrap();
            for (a, b) in limits.iter().zip(limit_points(&coarse, scheme).unwrap()) {
                assert!(a.distance(b) <= 1e-14, "{scheme}, seed {seed}");
            }
            darts += coarse.features().map_or(0, |f| f.count(Rule::Dart));
            semi_sharp += coarse.features().map_or(0, |f| f.count(Rule::SemiSharp));
            let mut finer = coarse;
            // What is semi-sharp lives for three levels there.
            for level in 1..4 {
                if level > 1 && !finer.features().is_some_and(|f| f.is_semi_sharp()) {
                    break;
                }
                finer = refinement.refined(&finer).unwrap();
                for (v, (a, b)) in limits.iter().zip(refinement.limit_positions(&finer).unwrap()).enumerate() {
                    let off = a.distance(b);
                    assert!(off <= 1e-14, "{scheme}, seed {seed}, vertex {v}, level {level}: {off:e}");
                }
            }
        }
        assert!(darts > 70 && semi_sharp > 150, "{darts}, {semi_sharp}");
    }
}

#[test]
fn masks_of_darts_are_the_exact_ones() {
    let hold = |found: Vec<f64>, expected: Vec<f64>| {
        assert!(found.len() == expected.len());
        assert!(found.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-15), "{found:?} {expected:?}");
    };
    let four = [752., 210., 29., 160., 44., 180., 44., 160., 29.].map(|x| x / 1608.0);
    hold(catmull_clark::dart_mask(4), four.to_vec());
    let six = vec![110. / 213., 7. / 71., 29. / 426., 35. / 426., 6. / 71., 35. / 426., 29. / 426.];
    hold(loop_scheme::dart_mask(6), six);
}

/// A fan of m faces at vertex 0, on a boundary, its points at random about a bent disc.
fn fan(m: usize, triangles: bool, seed: u64) -> Mesh {
    let rays = if triangles { m } else { 2 * m };
    let noise = random_points(rays + 2, seed);
    let ray = |j: usize| {
        let angle = std::f64::consts::PI * j as f64 / rays as f64;
        DVec3::new(angle.cos(), angle.sin(), 0.0) + 0.2 * noise[j]
    };
    let positions = std::iter::once(0.2 * noise[rays + 1]).chain((0..=rays).map(ray)).collect();
    let face = |j: u32| match triangles {
        true => vec![0, j + 1, j + 2],
        false => vec![0, 2 * j + 1, 2 * j + 2, 2 * j + 3],
    };
    Mesh::new(positions, Faces::from_lists((0..m as u32).map(face)))
}

/// The faces at vertex 0 after a step, twice as large, or after two of √3, three times: all that the next step there needs.
fn next_star(refinement: Refinement, star: &Surface) -> Surface {
    let limit = refinement.limit_positions(star).unwrap()[0];
    let (steps, scale) = if refinement == Refinement::Sqrt3 { (2, 3.0) } else { (1, 2.0) };
    let fine = refinement.refine_n(star, steps).unwrap();
    let mut number = vec![u32::MAX; fine.len()];
    let mut positions = Vec::new();
    let mut faces = Faces::default();
    for face in fine.faces.iter().filter(|face| face.contains(&0)) {
        let mut face = face.to_vec();
        let place = face.iter().position(|&v| v == 0).unwrap();
        face.rotate_left(place);
        for v in &mut face {
            let old = *v as usize;
            if number[old] == u32::MAX {
                number[old] = positions.len() as u32;
                positions.push(scale * (fine.positions[old] - limit));
            }
            *v = number[old];
        }
        faces.push(&face);
    }
    open(Mesh::new(positions, faces), star.boundary())
}

/// The greatest angle between the normal at vertex 0 and those of the triangles there, two a quad.
fn spread(star: &Surface, normal: DVec3) -> f64 {
    let incidence = star.incidence();
    let angles = incidence.corners_at(0).iter().flat_map(|&c| {
        let face = star.faces().face(incidence.face_of(c));
        let place = face.iter().position(|&v| v == 0).unwrap();
        let at = move |k: usize| star.positions()[face[(place + k) % face.len()] as usize] - star.positions()[0];
        (1..face.len() - 1).map(move |k| {
            let facet = at(k).cross(at(k + 1));
            facet.cross(normal).length().atan2(facet.dot(normal))
        })
    });
    angles.fold(0.0, f64::max)
}

#[test]
fn normals_on_a_boundary_are_the_limits_of_those_of_the_faces() {
    let of = |refinement, triangles, largest: usize| {
        for m in 1..=largest + 2 {
            for (seed, boundary) in [(1, Boundary::EdgeOnly), (2, Boundary::EdgeOnly), (3, Boundary::EdgeAndCorner)] {
                let mut star = open(fan(m, triangles, seed), boundary);
                let normal = Refinement::limit_normals(refinement, &star).unwrap()[0];
                if m > largest {
                    assert_eq!(normal, DVec3::ZERO);
                    continue;
                }
                assert!((normal.length() - 1.0).abs() < 1e-15);
                let mut off = vec![spread(&star, normal)];
                for _ in 0..40 {
                    star = next_star(refinement, &star);
                    off.push(spread(&star, normal));
                }
                let what = format!("{refinement}, {m} faces, {boundary:?}: {off:?}");
                if triangles && m == 1 {
                    // The triangle is in its plane from the start, and ever narrower.
                    assert!(off[10] < 1e-10, "{what}");
                    continue;
                }
                assert!(off[12] < off[3] && off[24] < off[12] && off[30] < off[24], "{what}");
                // By the third eigenvalue over ½, to the power of the level.
                let tolerance = match (triangles, m) {
                    // 1/k with a smooth boundary.
                    (false, 1) => 0.1,
                    (false, 3) => 0.82_f64.powi(30),
                    (true, 4) => 0.75_f64.powi(30),
                    (true, 5) => 0.905_f64.powi(30),
                    _ => 0.5_f64.powi(20),
                };
                assert!(off[30] < 5.0 * tolerance, "{what}");
            }
        }
    };
    of(Refinement::CatmullClark, false, 3);
    of(Refinement::Loop, true, 5);
    of(Refinement::Sqrt3, true, 5);
}

/// The vertices that are semi-sharp themselves, or at semi-sharp edges.
fn at_semi_sharp(surface: &Surface) -> Vec<u32> {
    let Some(features) = surface.features() else { return Vec::new() };
    let (faces, corners) = (surface.faces(), surface.faces().corners());
    let ends = features.semi_sharp_edges().iter().flat_map(|&(c, _)| {
        let face = faces.range(surface.incidence().face_of(c));
        let next = if c as usize + 1 == face.end { face.start } else { c as usize + 1 };
        [corners[c as usize], corners[next]]
    });
    ends.chain(features.semi_sharp_vertices().iter().map(|s| s.0)).collect()
}

#[test]
fn normals_stay_under_refinement_and_are_none_where_there_are_several() {
    for (scheme, refinement, _) in SCHEMES {
        let mut held = [0; 4];
        for seed in 0..200 {
            let Some((coarse, _)) = random_tagged(scheme, seed) else { continue };
            let before = refinement.limit_normals(&coarse).unwrap();
            let after = refinement.limit_normals(&refinement.refined(&coarse).unwrap()).unwrap();
            let mut star = Vec::new();
            let semi_sharp = at_semi_sharp(&coarse);
            for (v, (a, b)) in before.iter().zip(after).enumerate() {
                let rule = coarse.features().map_or(Rule::Smooth, |f| f.rules()[v]);
                if rule != Rule::Corner && semi_sharp.contains(&(v as u32)) {
                    // One after, where nothing semi-sharp is left.
                    assert_eq!(*a, DVec3::ZERO);
                    continue;
                }
                let is_boundary = !coarse.topology().star(coarse.faces(), v, &mut star);
                let most = if scheme == Scheme::Loop { 5 } else { 3 };
                let has_one = match rule {
                    Rule::Smooth => star.len() > 2,
                    Rule::Dart | Rule::SemiSharp => false,
                    Rule::Crease => is_boundary && star.len() <= most,
                    Rule::Corner => is_boundary && star.len() == 1,
                };
                let what = format!("{scheme}, seed {seed}, vertex {v}, {rule:?}, {} faces: {a} {b}", star.len());
                assert_eq!((*a != DVec3::ZERO, b != DVec3::ZERO), (has_one, has_one), "{what}");
                assert!(a.distance(b) < 1e-10, "{what}");
                held[rule as usize] += usize::from(has_one);
            }
        }
        let [smooth, dart, crease, corner] = held;
        assert!(smooth > 1500 && dart == 0 && crease > 200 && corner > 10, "{scheme}: {held:?}");
    }
}

/// The whole way: control mesh, two steps, limit points.
#[test]
fn the_surface_of_an_open_mesh_interpolates_it() {
    for (scheme, _, _) in SCHEMES {
        let mut held = 0;
        for seed in 0..40 {
            let Some((given, _)) = random_creased(scheme, seed) else { continue };
            let Ok(found) = interpolate(&given, scheme, &Options::default()) else { continue };
            let control = given.with_positions(found.points);
            for levels in 0..3 {
                let request = SurfaceOptions { levels, limit: true, normals: true, ..SurfaceOptions::default() };
                let made = surface(control.clone(), scheme, given.positions(), &request).unwrap();
                assert_eq!(made.surface.boundary_edges(), given.boundary_edges() << levels);
                let size = control.diagonal();
                for (v, (a, b)) in made.surface.positions().iter().zip(given.positions()).enumerate() {
                    assert!(a.distance(*b) <= 1e-8 * size, "{scheme}, seed {seed}, vertex {v}, {levels} levels");
                }
                held += 1;
            }
            // Without limit points nothing needs a topology, and yet the boundary is one.
            let request = SurfaceOptions { levels: 1, ..SurfaceOptions::default() };
            let made = surface(control.clone(), scheme, given.positions(), &request).unwrap();
            assert_eq!(made.surface.boundary_edges(), 2 * given.boundary_edges());
            assert_eq!(made.surface.features().is_some(), given.features().is_some());
        }
        assert!(held > 60, "{scheme}: {held}");
    }
}

/// A grid of triangles over the unit lattice, its height that of a cubic.
fn cubic_grid(p: usize, q: usize) -> (Surface, impl Fn(DVec3) -> f64) {
    let cubic = |at: DVec3| {
        let [x, y] = [at.x / 4.0, at.y / 4.0];
        0.7 * x.powi(3) - 1.3 * x * x * y + 0.4 * x * y * y + 0.9 * y.powi(3) - 0.6 * x * x + 0.8 * x * y + y - 0.3
    };
    let mut mesh = grid(p, q, true);
    for point in &mut mesh.positions {
        point.z = cubic(*point);
    }
    let corners = [0, q - 1, (p - 1) * q, p * q - 1].map(|v| (v as u32, 10.0));
    let tags = Tags { boundary: Boundary::EdgeOnly, corners: corners.to_vec(), ..Tags::default() };
    (open(mesh, Boundary::EdgeOnly).tagged(&tags).unwrap(), cubic)
}

/// Along curves cubics are reproduced but next to corners, and inside where no stencil is cut; the lattice everywhere.
#[test]
fn butterfly_reproduces_cubics_along_the_boundary_and_lines_everywhere() {
    let (p, q) = (9, 7);
    let (coarse, cubic) = cubic_grid(p, q);
    let fine = Refinement::Butterfly.refined(&coarse).unwrap();
    let (mut curve, mut inside) = (0, 0);
    for (e, c) in coarse.topology().edge_sides().enumerate() {
        let face = coarse.faces().face(c as usize / 3);
        let ends = [face[c as usize % 3], face[(c as usize + 1) % 3]].map(|v| coarse.positions()[v as usize]);
        let point = fine.positions()[coarse.len() + e];
        let middle = 0.5 * (ends[0] + ends[1]);
        assert!((point - middle).truncate().length() < 1e-14, "{point}");
        let [x, y] = [point.x, point.y];
        let from_ends = |at: f64, count: usize| at.min(count as f64 - 1.0 - at);
        let [dx, dy] = [from_ends(x, p), from_ends(y, q)];
        let off = (point.z - cubic(point)).abs();
        if dx == 0.0 || dy == 0.0 {
            if dx.max(dy) > 1.0 {
                assert!(off < 1e-14, "{point}: {off:e}");
                curve += 1;
            }
        } else if dx.min(dy) >= 1.5 {
            assert!(off < 1e-14, "{point}: {off:e}");
            inside += 1;
        }
    }
    assert_eq!(curve, 2 * (p - 3) + 2 * (q - 3));
    assert!(inside > 50, "{inside}");
}

/// At smooth vertices, beside the boundary too, those of the faces in the limit; none at sharp ones.
#[test]
fn normals_of_interpolatory_schemes_are_limits_up_to_the_boundary() {
    for refinement in [Refinement::Butterfly, Refinement::LabsikGreiner] {
        let mut held = 0;
        for seed in 0..60 {
            let Some((coarse, _)) = random_creased(Scheme::Loop, seed) else { continue };
            let Some(features) = coarse.features() else { continue };
            if coarse.len() > 40 {
                continue;
            }
            let before = refinement.limit_normals(&coarse).unwrap();
            let fine = refinement.refined(&coarse).unwrap();
            let after = refinement.limit_normals(&fine).unwrap();
            for (v, a) in before.iter().enumerate() {
                assert_eq!(*a != DVec3::ZERO, features.is_smooth(v), "{refinement}, seed {seed}, vertex {v}");
                assert!(a.distance(after[v]) < 1e-9, "{refinement}, seed {seed}, vertex {v}");
                held += usize::from(features.is_smooth(v));
            }
        }
        assert!(held > 50, "{refinement}: {held}");
    }
}

#[test]
fn what_has_no_rules_is_refused() {
    // One semi-sharp edge, and one dart at each of its ends.
    let octahedron = Surface::new(limitlab::mesh::builtin::octahedron()).unwrap();
    let tagged = |sharpness| {
        let edge = [octahedron.faces().corners()[0], octahedron.faces().corners()[1]];
        octahedron.tagged(&Tags { creases: vec![(edge, sharpness)], ..Tags::default() }).unwrap()
    };
    for refinement in Refinement::ALL {
        let takes = |sharpness| match refinement.check(&tagged(sharpness)) {
            Ok(()) => true,
            Err(Error::Dart { .. }) => false,
            Err(error) => panic!("{refinement}: {error}"),
        };
        let semi_sharp = refinement.check(&tagged(0.5));
        let (darts, semi) = (takes(10.0), semi_sharp.is_ok());
        let has_stars = matches!(refinement, Refinement::CatmullClark | Refinement::Loop);
        assert_eq!((darts, semi), (has_stars || refinement == Refinement::Butterfly, has_stars), "{refinement}");
        assert!(semi || matches!(semi_sharp, Err(Error::SemiSharp { .. })), "{refinement}");
    }
    // A boundary of vertices of valence 3 and more, without rules.
    let cube = limitlab::mesh::builtin::icosahedron();
    let mesh = Mesh::new(cube.positions.clone(), Faces::from_lists(cube.faces.iter().skip(1)));
    let interior = open(mesh, Boundary::AsInterior);
    for refinement in Refinement::ALL {
        assert!(matches!(refinement.refined(&interior), Err(Error::Open { edges: 3, .. })), "{refinement}");
        assert!(matches!(refinement.limit_positions(&interior), Err(Error::Open { .. })), "{refinement}");
        assert!(matches!(refinement.limit_normals(&interior), Err(Error::Open { .. })), "{refinement}");
    }
    // Two triangles back to back, beside a third.
    let faces = Faces::from_lists([[0, 1, 2], [0, 2, 1], [3, 4, 5]]);
    let pillow = open(Mesh::new(random_points(6, 1), faces), Boundary::EdgeOnly);
    let message = Refinement::Loop.refined(&pillow).unwrap_err().to_string();
    assert!(message.contains("vertex 0 has two triangles with the same corners"), "{message}");
    let fine = Refinement::CatmullClark.refined(&pillow).unwrap();
    hold_against_tags(&pillow, &fine);
}
