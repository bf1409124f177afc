//! Refinement with sharp edges, and rows, held against OpenSubdiv in Rust: others read the same rules. Its weights are in
//! single precision. Its limit masks know no darts, and take what is semi-sharp as sharp for ever.

use std::collections::BTreeMap;

use glam::DVec3;
use limitlab::interpolate::limit_points;
use limitlab::mesh::Surface;
use limitlab::mesh::features::{Rule, SHARP, Tags};
use limitlab::mesh::validate::Boundary;
use limitlab::schemes::Scheme;
use opensubdiv_rs::far::{PrimvarRefiner, TopologyDescriptor, TopologyRefiner, TopologyRefinerFactory, UniformOptions};
use opensubdiv_rs::sdc::{Options, SchemeType, VtxBoundaryInterpolation};

use super::naive::edge;
use super::{random_creased, random_semi_sharp};
use crate::common::tol;

/// As many as take all of a sharpness below 4.
const LEVELS: usize = 4;
/// In vertices, of which each level has four times as many.
const LARGEST: usize = 30;

fn refiner(surface: &Surface, tags: &Tags, kind: SchemeType) -> TopologyRefiner {
    // Of an edge that is named twice the last one counts there.
    let mut creases: BTreeMap<[u32; 2], f64> = BTreeMap::new();
    for &([a, b], s) in &tags.creases {
        let here = creases.entry(edge(a, b)).or_default();
        *here = here.max(s.min(SHARP));
    }
    let mut corners: BTreeMap<u32, f64> = BTreeMap::new();
    for &(v, s) in &tags.corners {
        let here = corners.entry(v).or_default();
        *here = here.max(s.min(SHARP));
    }
    let single = |values: Vec<f64>| -> Vec<f32> { values.into_iter().map(|s| s as f32).collect() };
    let (ends, sharpness): (Vec<[u32; 2]>, Vec<f64>) = creases.into_iter().unzip();
    let (vertices, own): (Vec<u32>, Vec<f64>) = corners.into_iter().unzip();
    let (sharpness, own) = (single(sharpness), single(own));
    let sizes: Vec<usize> = surface.faces().iter().map(<[u32]>::len).collect();
    let descriptor = TopologyDescriptor::new(surface.len(), &sizes, surface.faces().corners());
    let descriptor = descriptor.with_creases(&ends, &sharpness).with_corners(&vertices, &own);
    let boundary = match tags.boundary {
        Boundary::EdgeOnly => VtxBoundaryInterpolation::EdgeOnly,
        _ => VtxBoundaryInterpolation::EdgeAndCorner,
    };
    let options = Options::default().with_vtx_boundary_interpolation(boundary);
    let mut refiner = TopologyRefinerFactory::create(descriptor, kind, options).unwrap();
    refiner.refine_uniform(UniformOptions::new(LEVELS));
    refiner
}

/// The numbers that the vertices of our refined mesh have in the witness's level `k` + 1, from those of the coarse mesh.
fn refined_numbers(coarse: &Surface, refiner: &TopologyRefiner, k: usize, numbers: &[u32]) -> Vec<u32> {
    let (level, step) = (refiner.level(k), refiner.refinement(k + 1));
    let (faces, topology) = (coarse.faces(), coarse.topology());
    let mut refined: Vec<u32> = numbers.iter().map(|&v| step.vertex_child_vertex(v as usize)).collect();
    let corners = faces.corners();
    for c in (0..corners.len() as u32).filter(|&c| topology.twin(c).is_none_or(|t| c < t)) {
        let [a, b] = [c, topology.incidence.next(faces, c)].map(|c| numbers[corners[c as usize] as usize]);
        refined.push(step.edge_child_vertex(level.find_edge(a, b).unwrap() as usize));
    }
    if refiner.scheme_type() == SchemeType::Catmark {
        refined.extend(faces.iter().enumerate().map(|(f, face)| {
            // After a step the first and the third corner, an old vertex and the point of a face, have one face in common.
            let [first, third] = [0, 2].map(|k| numbers[face[k] as usize]);
            let holds_both = |&&f: &&u32| level.face_vertices(f as usize).contains(&third);
            let at = level.vertex_faces(first as usize).iter().find(holds_both).unwrap();
            step.face_child_vertex(if k == 0 { f } else { *at as usize })
        }));
    }
    refined
}

fn hold(scheme: Scheme, kind: SchemeType, random: fn(Scheme, u64) -> Option<(Surface, Tags)>) -> usize {
    let mut held = 0;
    for seed in 0..100 {
        let Some((surface, tags)) = random(scheme, seed).filter(|(surface, _)| surface.len() <= LARGEST) else {
            continue;
        };
        let hold = |ours: DVec3, theirs: [f64; 3], what: &str| {
            let off = ours.distance(DVec3::from_array(theirs));
            assert!(off <= tol::SINGLE, "{scheme}, seed {seed}, {what}: {off:e}");
        };
        let refiner = refiner(&surface, &tags, kind);
        let witness = PrimvarRefiner::new(&refiner);
        let mut numbers: Vec<u32> = (0..surface.len() as u32).collect();
        let mut points: Vec<[f64; 3]> = surface.positions().iter().map(|p| p.to_array()).collect();
        let mut ours = surface.clone();
        for k in 0..LEVELS {
            numbers = refined_numbers(&ours, &refiner, k, &numbers);
            ours = scheme.refinement().refined(&ours).unwrap();
            let mut refined = vec![[0.0; 3]; refiner.level(k + 1).num_vertices()];
            witness.interpolate(k + 1, &points, &mut refined);
            points = refined;
            assert_eq!((ours.len(), numbers.len()), (points.len(), points.len()));
            for (v, &number) in numbers.iter().enumerate() {
                hold(ours.positions()[v], points[number as usize], "a refined point");
            }
        }
        let mut limits = points.clone();
        witness.limit(&points, &mut limits);
        let rows = limit_points(&surface, scheme).unwrap();
        let is_dart = |v: usize| surface.features().is_some_and(|f| f.rules()[v] == Rule::Dart);
        for v in (0..surface.len()).filter(|&v| !is_dart(v)) {
            hold(rows[v], limits[numbers[v] as usize], "a limit point");
            held += 1;
        }
    }
    held
}

fn hold_all(scheme: Scheme, kind: SchemeType) {
    for random in [random_creased, random_semi_sharp] {
        let held = hold(scheme, kind, random);
        assert!(held > 300, "{scheme}: {held}");
    }
}

#[test]
fn catmull_clark_refines_and_ends_as_opensubdiv() {
    hold_all(Scheme::CatmullClark, SchemeType::Catmark);
}

#[test]
fn loop_refines_and_ends_as_opensubdiv() {
    hold_all(Scheme::Loop, SchemeType::Loop);
}
