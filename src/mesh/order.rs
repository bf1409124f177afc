//! Vertex orders, for sweeps in place and for renumbering: order `o` puts vertex `o[k]` at the k-th place.

use std::collections::BTreeSet;
use std::fmt;
use std::str::FromStr;

use chacha20::ChaCha8Rng;
use rand::{SeedableRng, seq::SliceRandom};

use super::breadth_first::breadth_first;
use super::cuthill_mckee::reverse_cuthill_mckee;
use super::incidence::Incidence;
pub use super::numbering::{Numbering, inverse};
use super::space_filling::morton;
use super::{Faces, Mesh};
use crate::{Error, Result, names};

/// `--order file|reverse|bfs|rcm|morton|valence|multicolour|random[:SEED]`.
///
/// Neighbours in `Bfs` and `Rcm` are vertices that share a face: the pattern of the limit matrices.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Order {
    /// As in the file.
    #[default]
    File,
    /// The file's order, last vertex first.
    Reverse,
    /// Breadth first from the first vertex of every component, neighbours by face.
    Bfs,
    /// Reverse Cuthill-McKee: breadth first from a pseudo-peripheral vertex of every component, neighbours by
    /// ascending degree, all in reverse (Cuthill and McKee 1969; start by George and Liu 1979).
    Rcm,
    /// Along the space-filling curve of Morton through the bounding box, 21 bits a coordinate.
    Morton,
    /// By ascending number of faces, ties as in the file.
    Valence,
    /// Colour by colour, where vertices of one colour share no face: a greedy colouring in the file's order. All
    /// vertices of a colour may be relaxed at once.
    Multicolour,
    /// Shuffled from a seed.
    Random(u64),
}

impl FromStr for Order {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        const NAMES: [(&str, Order); 9] = [
            ("file", Order::File),
            ("reverse", Order::Reverse),
            ("bfs", Order::Bfs),
            ("rcm", Order::Rcm),
            ("morton", Order::Morton),
            ("valence", Order::Valence),
            ("multicolour", Order::Multicolour),
            ("random", Order::Random(1)),
            // For messages: what starts so is read before.
            ("random:SEED", Order::Random(1)),
        ];
        match text.split_once(':') {
            Some((name, seed)) if names::same(name, "random") => seed
                .parse()
                .map(Order::Random)
                .map_err(|_| Error::Unknown(format!("unknown vertex order \"{text}\": the seed is a whole number"))),
            _ => names::find(
                "vertex order",
                text,
                &NAMES,
                &[("multicolor", Order::Multicolour), ("curve", Order::Morton)],
            ),
        }
    }
}

impl fmt::Display for Order {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = match self {
            Order::File => "file",
            Order::Reverse => "reverse",
            Order::Bfs => "bfs",
            Order::Rcm => "rcm",
            Order::Morton => "morton",
            Order::Valence => "valence",
            Order::Multicolour => "multicolour",
            Order::Random(seed) => return write!(f, "random:{seed}"),
        };
        f.write_str(name)
    }
}

impl Order {
    /// The numbers below `count` in this order, if it goes by the numbers alone.
    pub fn of_numbers(&self, count: usize) -> Option<Vec<u32>> {
        let file = 0..count as u32;
        match *self {
            Order::File => Some(file.collect()),
            Order::Reverse => Some(file.rev().collect()),
            Order::Random(seed) => {
                let mut order: Vec<u32> = file.collect();
                order.shuffle(&mut ChaCha8Rng::seed_from_u64(seed));
                Some(order)
            }
            Order::Bfs | Order::Rcm | Order::Morton | Order::Valence | Order::Multicolour => None,
        }
    }

    /// The vertices of `mesh` in this order. O(corners), but for the sort of `Morton` and, within the
    /// neighbours of each vertex, of `Rcm`.
    pub fn order(&self, mesh: &Mesh, incidence: &Incidence) -> Vec<u32> {
        if let Some(order) = self.of_numbers(mesh.len()) {
            return order;
        }
        let file = 0..mesh.len() as u32;
        match *self {
            Order::Bfs => breadth_first(&mesh.faces, incidence),
            Order::Rcm => reverse_cuthill_mckee(&mesh.faces, incidence),
            Order::Morton => morton(&mesh.positions),
            Order::Valence => {
                let mut order: Vec<u32> = file.collect();
                order.sort_by_key(|&v| incidence.face_count(v as usize));
                order
            }
            Order::Multicolour => {
                let colour = colouring(&mesh.faces, incidence);
                let mut order: Vec<u32> = file.collect();
                order.sort_by_key(|&v| colour[v as usize]);
                order
            }
            Order::File | Order::Reverse | Order::Random(_) => unreachable!("these go by the numbers"),
        }
    }
}

/// The least colour for every vertex, in the file's order, that no earlier vertex of its faces has. O(C log C) for C
/// corners.
pub fn colouring(faces: &Faces, incidence: &Incidence) -> Vec<u32> {
    const NONE: u32 = u32::MAX;
    let mut colour = vec![NONE; incidence.vertices()];
    let mut palettes: Vec<Option<Palette>> = Vec::new();
    if (0..faces.len()).any(|f| faces.range(f).len() > LARGE) {
        palettes.extend((0..faces.len()).map(|f| (faces.range(f).len() > LARGE).then(Palette::default)));
    }
    // The last vertex among whose neighbours a colour was found.
    let mut found: Vec<u32> = Vec::new();
    for v in 0..incidence.vertices() {
        let at = || incidence.corners_at(v).iter().map(|&c| incidence.face_of(c));
        let palette = |f: usize| palettes.get(f).and_then(Option::as_ref);
        let mut free = 0;
        for f in at() {
            if let Some(palette) = palette(f) {
                free = free.max(palette.least_free);
                continue;
            }
            for &w in faces.face(f) {
                let taken = colour[w as usize];
                if taken != NONE {
                    found[taken as usize] = v as u32;
                }
            }
        }
        let is_taken = |colour: u32| {
            found.get(colour as usize) == Some(&(v as u32))
                || at().any(|f| palette(f).is_some_and(|palette| palette.colours.contains(&colour)))
        };
        while is_taken(free) {
            free += 1;
        }
        if free as usize >= found.len() {
            found.resize(free as usize + 1, NONE);
        }
        colour[v] = free;
        if !palettes.is_empty() {
            at().for_each(|f| palettes[f].iter_mut().for_each(|palette| palette.add(free)));
        }
    }
    colour
}

/// Faces of more corners keep the colours of theirs, instead of being looked through at each.
const LARGE: usize = 16;

/// The colours of one face.
#[derive(Clone, Debug, Default)]
struct Palette {
    colours: BTreeSet<u32>,
    least_free: u32,
}

impl Palette {
    fn add(&mut self, colour: u32) {
        self.colours.insert(colour);
        while self.colours.contains(&self.least_free) {
            self.least_free += 1;
        }
    }
}

/// How far apart an order puts neighbours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Locality {
    /// The greatest difference of the places of two vertices of one face: the bandwidth of the limit matrix.
    pub bandwidth: u32,
    /// The mean difference of the places of the two ends of a face side; 0 without faces.
    pub mean_distance: f64,
}

/// The locality of `order`. O(corners).
///
/// # Panics
/// If `order` is not a permutation of vertices that include all of the faces'.
pub fn locality(faces: &Faces, order: &[u32]) -> Locality {
    let place = inverse(order);
    let (mut bandwidth, mut total) = (0, 0u64);
    for face in faces.iter() {
        let (mut min, mut max) = (u32::MAX, 0);
        let mut before = face.last().map_or(0, |&v| place[v as usize]);
        for &v in face {
            let here = place[v as usize];
            min = min.min(here);
            max = max.max(here);
            total += u64::from(here.abs_diff(before));
            before = here;
        }
        bandwidth = bandwidth.max(max.saturating_sub(min));
    }
    Locality { bandwidth, mean_distance: total as f64 / faces.corners().len().max(1) as f64 }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::mesh::builtin;
    use crate::mesh::generate::{permute_vertices, union};
    use crate::mesh::random::random_polygons;

    const ALL: [Order; 7] =
        [Order::File, Order::Reverse, Order::Bfs, Order::Rcm, Order::Morton, Order::Valence, Order::Random(8)];

    fn ordered(order: Order, mesh: &Mesh) -> Vec<u32> {
        order.order(mesh, &Incidence::new(&mesh.faces, mesh.len()))
    }

    fn shuffled(mesh: &Mesh) -> Mesh {
        permute_vertices(mesh, &ordered(Order::Random(3), mesh))
    }

    #[test]
    fn colours_are_the_least_that_no_earlier_vertex_of_a_face_has() {
        let large = ["prism:40", "bipyramid:40"].map(|name| builtin::builtin(name).unwrap());
        let meshes = (0..40).map(random_polygons).chain(large.iter().flat_map(|mesh| [mesh.clone(), shuffled(mesh)]));
        for mesh in meshes {
            let colour = colouring(&mesh.faces, &Incidence::new(&mesh.faces, mesh.len()));
            let mut taken = vec![BTreeSet::new(); mesh.len()];
            for v in 0..mesh.len() {
                let least = (0..).find(|c| !taken[v].contains(c)).unwrap();
                assert_eq!(colour[v], least, "vertex {v}");
                for face in mesh.faces.iter().filter(|face| face.contains(&(v as u32))) {
                    for &w in face {
                        taken[w as usize].insert(least);
                    }
                }
            }
        }
        // Linear in the corners, or this would not end.
        let prism = builtin::builtin("prism:100000").unwrap();
        let colour = colouring(&prism.faces, &Incidence::new(&prism.faces, prism.len()));
        assert!(colour.iter().max() >= Some(&99_999));
    }

    #[test]
    fn every_order_is_a_permutation_and_always_the_same() {
        for seed in 0..60 {
            let mut mesh = random_polygons(seed);
            // Isolated vertices too.
            mesh.positions.push(DVec3::ONE);
            mesh.positions.insert(0, DVec3::ZERO);
            for order in ALL {
                let o = ordered(order, &mesh);
                let places = inverse(&o);
                assert_eq!(o.len(), mesh.len());
                assert!((0..o.len()).all(|k| places[o[k] as usize] == k as u32));
                assert_eq!(o, ordered(order, &mesh));
            }
        }
        let empty = Mesh::new(Vec::new(), Faces::default());
        for order in ALL {
            assert!(ordered(order, &empty).is_empty());
        }
    }

    #[test]
    fn names_are_read_as_they_are_written() {
        for order in ALL {
            assert_eq!(order.to_string().parse::<Order>().unwrap(), order);
        }
        assert_eq!("random".parse::<Order>().unwrap(), Order::Random(1));
        assert_eq!("RCM".parse::<Order>().unwrap(), Order::Rcm);
        for bad in ["", "random:", "random:x", "random:SEED", "random:1:2", "bfs:3"] {
            assert!(bad.parse::<Order>().is_err(), "{bad}");
        }
        assert!("randmo:3".parse::<Order>().unwrap_err().to_string().ends_with("multicolour, random or random:SEED"));
    }

    /// Levels of the vertices by distance from the first in its component, by brute force over face sharing.
    fn levels(mesh: &Mesh, start: u32) -> Vec<Option<u32>> {
        let mut level = vec![None; mesh.len()];
        level[start as usize] = Some(0);
        for distance in 0.. {
            let mut grown = false;
            for face in mesh.faces.iter() {
                if face.iter().any(|&v| level[v as usize] == Some(distance)) {
                    for &v in face {
                        if level[v as usize].is_none() {
                            level[v as usize] = Some(distance + 1);
                            grown = true;
                        }
                    }
                }
            }
            if !grown {
                break;
            }
        }
        level
    }

    #[test]
    fn breadth_first_orders_go_level_by_level() {
        for seed in 0..20 {
            let mesh = random_polygons(seed);
            for order in [Order::Bfs, Order::Rcm] {
                let mut o = ordered(order, &mesh);
                if order == Order::Rcm {
                    o.reverse();
                }
                let mut rest = &o[..];
                while let Some(&start) = rest.first() {
                    let level = levels(&mesh, start);
                    let size = level.iter().flatten().count();
                    // The component comes in one piece, nearer vertices first.
                    let (component, others) = rest.split_at(size);
                    let found: Vec<_> = component.iter().map(|&v| level[v as usize].unwrap()).collect();
                    assert!(found.is_sorted(), "{order}");
                    rest = others;
                }
            }
        }
    }

    #[test]
    fn locality_is_that_of_the_grid() {
        // Row by row on an n × m torus: the greatest step leads from the first row to the last, diagonally.
        let (n, m) = (9, 7);
        let mesh = builtin::torus(n, m);
        let file = locality(&mesh.faces, &ordered(Order::File, &mesh));
        assert_eq!(file.bandwidth as usize, n * m - 1);
        // Along the rows m − 1 steps of 1 and one of m − 1; across n − 1 of m and one of (n − 1) m.
        let along = 2.0 * (m - 1) as f64 / m as f64;
        let across = 2.0 * ((n - 1) * m) as f64 / n as f64;
        assert!((file.mean_distance - (along + across) / 2.0).abs() < 1e-12);
        let reverse = locality(&mesh.faces, &ordered(Order::Reverse, &mesh));
        assert_eq!(reverse, file);
        let empty = locality(&Faces::default(), &[0, 1]);
        assert_eq!((empty.bandwidth, empty.mean_distance), (0, 0.0));
    }

    /// The definition, replayed: what each vertex meets first comes next, by ascending number of neighbours.
    #[test]
    fn cuthill_mckee_appends_the_neighbours_of_each_vertex_by_degree() {
        for mesh in [builtin::irregular_tri(300, 1), builtin::star(7)] {
            let mesh = shuffled(&mesh);
            let mut neighbours = vec![std::collections::BTreeSet::new(); mesh.len()];
            for face in mesh.faces.iter() {
                for &v in face {
                    neighbours[v as usize].extend(face.iter().copied().filter(|&w| w != v));
                }
            }
            let mut order = ordered(Order::Rcm, &mesh);
            order.reverse();
            let mut expected = vec![order[0]];
            for next in 0..mesh.len() {
                let met = neighbours[expected[next] as usize].iter();
                let mut new: Vec<u32> = met.copied().filter(|w| !expected.contains(w)).collect();
                new.sort_by_key(|&w| neighbours[w as usize].len());
                expected.extend(new);
            }
            assert_eq!(order, expected);
        }
    }

    #[test]
    fn reverse_cuthill_mckee_is_as_narrow_as_the_one_of_sprs() {
        for (mesh, name) in [
            (builtin::torus(60, 9), "torus"),
            (builtin::tri_torus(40, 12), "triangle torus"),
            (builtin::irregular_tri(2000, 1), "irregular triangles"),
            (builtin::irregular_poly(2000, 1), "irregular polygons"),
            (builtin::irregular_quad(2000, 1), "irregular quads"),
            (builtin::quad_sphere(4), "quad sphere"),
            (union(&[builtin::icosphere(2), builtin::torus(12, 5)]), "two components"),
        ] {
            let mesh = shuffled(&mesh);
            let mut pattern = sprs::TriMat::new((mesh.len(), mesh.len()));
            for face in mesh.faces.iter() {
                for &v in face {
                    for &w in face {
                        pattern.add_triplet(v as usize, w as usize, 1.0);
                    }
                }
            }
            let matrix: sprs::CsMat<f64> = pattern.to_csr();
            let theirs = sprs::linalg::ordering::reverse_cuthill_mckee(matrix.view());
            let theirs: Vec<u32> = theirs.perm.vec().iter().map(|&v| v as u32).collect();
            let theirs = locality(&mesh.faces, &theirs).bandwidth;
            let ours = locality(&mesh.faces, &ordered(Order::Rcm, &mesh)).bandwidth;
            let shuffled = locality(&mesh.faces, &ordered(Order::File, &mesh)).bandwidth;
            assert!(f64::from(ours) <= 1.1 * f64::from(theirs), "{name}: {ours}, sprs {theirs}");
            assert!(4 * ours < shuffled, "{name}: {ours}, shuffled {shuffled}");
        }
    }

    #[test]
    fn reverse_cuthill_mckee_finds_the_band_of_a_long_tube() {
        // From a vertex of the n × m torus, n ≫ m, each level after the first few has two rows of m vertices,
        // and neighbours are at most two levels' fill apart: bandwidth below 4m + O(1), above 2m.
        let (n, m) = (200, 6);
        let mesh = shuffled(&builtin::torus(n, m));
        let band = locality(&mesh.faces, &ordered(Order::Rcm, &mesh)).bandwidth as usize;
        assert!((2 * m..=4 * m + 2).contains(&band), "{band}");
    }

    #[test]
    fn morton_follows_the_curve() {
        // The corners of a cube, by their signs as bits: z is the highest.
        assert_eq!(ordered(Order::Morton, &builtin::cube()), [0, 1, 2, 3, 4, 5, 6, 7]);
        // Far better than chance, as it should be.
        let mesh = shuffled(&builtin::quad_sphere(5));
        let [random, morton] =
            [Order::File, Order::Morton].map(|o| locality(&mesh.faces, &ordered(o, &mesh)).mean_distance);
        assert!(morton < random / 10.0);
        // All in one point, and one that is not finite.
        let flat = Mesh::new(vec![DVec3::ONE, DVec3::NAN, DVec3::ONE], Faces::default());
        assert_eq!(ordered(Order::Morton, &flat), [0, 1, 2]);
    }

    #[test]
    fn valence_ascends_and_ties_keep_the_order_of_the_file() {
        let mesh = builtin::star(9);
        let o = ordered(Order::Valence, &mesh);
        let four: Vec<u32> = (0..9).collect();
        assert_eq!(o[..9], four);
        assert_eq!(o[mesh.len() - 2..], [9, 10]);
        assert!(o[9..mesh.len() - 2].is_sorted());
    }
}
