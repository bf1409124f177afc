//! Valid meshes: closed or open manifolds, oriented, with their topology; made by validation alone.

use std::sync::{Arc, OnceLock};

use glam::DVec3;

use super::boundary::Boundary;
use super::features::{Features, Rule, SHARP, Tags};
use super::numbering::Numbering;
use super::origin::Numbers;
use super::renumbered::Renumbered;
use super::space_filling::{along_curve, is_scattered};
use super::validate::{Validation, boundary_remark, validate};
use super::{Faces, Incidence, Mesh, Topology, degenerate};
use crate::error::counted;
use crate::{Error, Result, parallel};

/// From this many vertices on, a scattered mesh is renumbered. Tuned.
const SCATTERED: usize = 50_000;

/// A mesh that the validator has passed, with its topology: an oriented manifold, closed unless a boundary was allowed,
/// of faces with three different vertices or more, every vertex finite and of valence 3 or more.
///
/// Faces and topology never change; points may move. Copies share the topology, which is made when it is first asked
/// for: a closed mesh is known to be valid by its [`Incidence`] alone.
///
/// ```
/// use limitlab::mesh::{Surface, builtin};
/// let surface = Surface::new(builtin::builtin("cube")?)?;
/// assert!(surface.is_closed());
/// assert_eq!(surface.topology().edges(), 12);
/// let mut mesh = surface.into_mesh();
/// mesh.faces = limitlab::mesh::Faces::from_lists(mesh.faces.iter().skip(1));
/// let message = Surface::new(mesh).unwrap_err().to_string();
/// assert!(message.starts_with("4 boundary edges (first: face 1, vertices 0 and 1)"), "{message}");
/// # Ok::<(), limitlab::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Surface {
    mesh: Mesh,
    connectivity: Arc<Connectivity>,
}

/// What is known of the faces.
#[derive(Clone, Debug)]
struct Connectivity {
    is_closed: bool,
    /// What boundary edges are, where there may be some.
    boundary: Boundary,
    /// The half-edges of boundary edges, ascending.
    sides: Vec<u32>,
    /// Where not all vertices are smooth.
    features: Option<Features>,
    incidence: OnceLock<Arc<Incidence>>,
    topology: OnceLock<Arc<Topology>>,
    renumbered: Option<Renumbered>,
}

impl Surface {
    /// A closed mesh, validated. O(corners), in parallel; from some ten thousand vertices on, a mesh whose vertices lie
    /// [scattered](is_scattered) in memory is renumbered inside.
    ///
    /// # Errors
    /// [`Error::Defects`] with all that is wrong.
    pub fn new(mesh: Mesh) -> Result<Self> {
        Self::examined(mesh, None, Boundary::Refuse).map_err(Error::Defects)
    }

    /// As [`new`](Self::new), with another treatment of boundaries, and the 1-based lines of the vertices and of the
    /// faces in the file for the report.
    ///
    /// # Errors
    /// The report of [`validate`].
    pub fn examined(
        mesh: Mesh,
        lines: Option<(&[u32], &[u32])>,
        boundary: Boundary,
    ) -> std::result::Result<Self, Box<Validation>> {
        if let Some(connectivity) = Connectivity::manifold(&mesh, boundary) {
            return Ok(Surface { mesh, connectivity: Arc::new(connectivity) });
        }
        let mut report = validate(&mesh, lines, boundary);
        match report.topology.take() {
            Some(topology) if report.is_valid() => {
                let tags = Tags { boundary, ..Tags::default() };
                // Without tags there is nothing that could be wrong.
                let sides = topology.boundary_half_edges();
                let features = Features::new(&mesh.faces, &topology.incidence, sides, &tags).unwrap_or_default();
                Ok(Self::of_parts(mesh, topology, boundary, features))
            }
            topology => {
                report.topology = topology;
                Err(Box::new(report))
            }
        }
    }

    /// A mesh that is valid by the way it was made: the refinement of a valid one.
    pub(crate) fn of_topology(mesh: Mesh, topology: Topology) -> Self {
        debug_assert!(topology.is_closed());
        Self::of_parts(mesh, topology, Boundary::Refuse, None)
    }

    /// As [`of_topology`](Self::of_topology), open or with sharp edges and vertices.
    pub(crate) fn of_parts(mesh: Mesh, topology: Topology, boundary: Boundary, features: Option<Features>) -> Self {
        debug_assert!(topology.incidence.vertices() == mesh.len() && topology.irregular_edges().is_empty());
        let connectivity = Connectivity {
            boundary,
            sides: topology.boundary_half_edges().to_vec(),
            features,
            incidence: OnceLock::from(Arc::clone(&topology.incidence)),
            ..Connectivity::new(topology.is_closed())
        };
        let connectivity = Connectivity { topology: OnceLock::from(Arc::new(topology)), ..connectivity };
        Surface { mesh, connectivity: Arc::new(connectivity) }
    }

    /// A valid mesh as it is [renumbered](Renumbered) inside, with all vertices smooth.
    pub(super) fn near(mesh: Mesh, topology: Arc<Topology>) -> Self {
        let connectivity = Connectivity {
            incidence: OnceLock::from(Arc::clone(&topology.incidence)),
            sides: topology.boundary_half_edges().to_vec(),
            ..Connectivity::new(topology.is_closed())
        };
        let connectivity = Connectivity { topology: OnceLock::from(topology), ..connectivity };
        Surface { mesh, connectivity: Arc::new(connectivity) }
    }

    /// As [`examined`](Self::examined), renumbered inside however small the mesh, and wherever its vertices lie.
    ///
    /// # Panics
    /// If the mesh is not valid.
    #[cfg(test)]
    pub(crate) fn scattered(mesh: Mesh, boundary: Boundary) -> Self {
        let connectivity = Connectivity::checked(&mesh, boundary, along_curve(&mesh));
        Surface { mesh, connectivity: Arc::new(connectivity.expect("a valid mesh")) }
    }

    /// A closed mesh that is valid by the way it was made. Its topology is made if it is asked for.
    pub(crate) fn of_valid(mesh: Mesh) -> Self {
        let connectivity = Connectivity::new(true);
        Surface { mesh, connectivity: Arc::new(connectivity) }
    }

    /// The same mesh with these sharp edges and vertices, and none of others; its boundary is as the tags say.
    ///
    /// # Errors
    /// As [`Features::new`]; [`Error::Defects`] if the mesh is open and the tags refuse that.
    ///
    /// ```
    /// use limitlab::mesh::features::{Rule, Tags};
    /// use limitlab::mesh::{Surface, builtin};
    /// let cube = Surface::new(builtin::builtin("cube")?)?;
    /// let top = [[4, 5], [5, 7], [7, 6], [6, 4]];
    /// let tags = Tags { creases: top.map(|edge| (edge, 10.0)).to_vec(), ..Tags::default() };
    /// let creased = cube.tagged(&tags)?;
    /// let features = creased.features().unwrap();
    /// assert_eq!((features.count(Rule::Crease), features.curves().len()), (4, 1));
    /// # Ok::<(), limitlab::Error>(())
    /// ```
    pub fn tagged(&self, tags: &Tags) -> Result<Self> {
        self.clone().into_tagged(tags)
    }

    /// As [`tagged`](Self::tagged), without a copy of the mesh.
    ///
    /// # Errors
    /// As [`tagged`](Self::tagged).
    pub fn into_tagged(self, tags: &Tags) -> Result<Self> {
        if !self.is_closed() && tags.boundary == Boundary::Refuse {
            return Self::examined(self.mesh, None, Boundary::Refuse).map_err(Error::Defects);
        }
        let features = Features::new(self.faces(), self.incidence(), self.boundary_half_edges(), tags)?;
        let Surface { mesh, connectivity } = self;
        let connectivity = Connectivity { boundary: tags.boundary, features, ..Arc::unwrap_or_clone(connectivity) };
        Ok(Surface { mesh, connectivity: Arc::new(connectivity) })
    }

    /// The tags that give these [features](Self::features): sharp edges with two faces, corners, what is semi-sharp, and
    /// the boundary. Those of a refined mesh are on its own edges. O(N).
    pub fn tags(&self) -> Tags {
        let boundary = self.boundary();
        let Some(features) = self.features() else { return Tags { boundary, ..Tags::default() } };
        let (faces, topology) = (self.faces(), self.topology());
        let ends = |c: u32| [c, topology.incidence.next(faces, c)].map(|c| faces.corners()[c as usize]);
        let sharp = features.sharp_half_edges().iter().filter(|&&c| topology.twin(c).is_some()).map(|&c| (c, SHARP));
        let creases = sharp.chain(features.semi_sharp_edges().iter().copied()).map(|(c, s)| (ends(c), s)).collect();
        let resting = features.with_rule(Rule::Corner).into_iter().map(|v| (v as u32, SHARP));
        let corners = resting.chain(features.semi_sharp_vertices().iter().copied()).collect();
        Tags { boundary, creases, corners }
    }

    /// The same faces with other points.
    ///
    /// # Panics
    /// If there is not one point a vertex.
    pub fn with_positions(&self, positions: Vec<DVec3>) -> Self {
        assert_eq!(positions.len(), self.len(), "one point a vertex");
        let mesh = Mesh::new(positions, self.mesh.faces.clone());
        Surface { mesh, connectivity: Arc::clone(&self.connectivity) }
    }

    /// Positions and faces.
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// Positions and faces, without their topology.
    pub fn into_mesh(self) -> Mesh {
        self.mesh
    }

    /// The faces, in the numbering of the mesh that was given.
    pub fn faces(&self) -> &Faces {
        &self.mesh.faces
    }

    /// One point a vertex, in mesh units.
    pub fn positions(&self) -> &[DVec3] {
        &self.mesh.positions
    }

    /// The points, to be moved; nothing checks that they stay finite.
    pub fn positions_mut(&mut self) -> &mut [DVec3] {
        &mut self.mesh.positions
    }

    /// Takes the points out, to write others in their memory.
    pub(crate) fn take_positions(&mut self) -> Vec<DVec3> {
        std::mem::take(&mut self.mesh.positions)
    }

    /// The number of vertices N.
    pub fn len(&self) -> usize {
        self.mesh.len()
    }

    /// Never: a valid mesh has vertices.
    pub fn is_empty(&self) -> bool {
        self.mesh.is_empty()
    }

    /// Whether every edge has two faces.
    pub fn is_closed(&self) -> bool {
        self.connectivity.is_closed
    }

    /// The corners at every vertex.
    pub fn incidence(&self) -> &Incidence {
        self.shared_incidence()
    }

    fn shared_incidence(&self) -> &Arc<Incidence> {
        self.connectivity.incidence.get_or_init(|| {
            let faces = &self.mesh.faces;
            Arc::new(match self.renumbered() {
                Some(inside) => inside.incidence_of(faces),
                None => Incidence::new(faces, self.mesh.len()),
            })
        })
    }

    /// Opposite half-edges, edges, stars. The first call may take as long as validation did.
    pub fn topology(&self) -> &Topology {
        self.connectivity.topology.get_or_init(|| {
            let incidence = Arc::clone(self.shared_incidence());
            Arc::new(match self.renumbered() {
                Some(inside) => inside.topology_of(&self.mesh.faces, incidence),
                None => Topology::of(incidence, &self.mesh.faces),
            })
        })
    }

    /// Rules and curves, where not all vertices are smooth: on an open mesh, unless its boundary is treated as interior,
    /// and on one with [tags](Self::tagged).
    pub fn features(&self) -> Option<&Features> {
        self.connectivity.features.as_ref()
    }

    /// What boundary edges are, where there are some.
    pub fn boundary(&self) -> Boundary {
        self.connectivity.boundary
    }

    /// The number of edges with one face.
    pub fn boundary_edges(&self) -> usize {
        self.connectivity.sides.len()
    }

    /// The half-edges of edges with one face, ascending.
    pub fn boundary_half_edges(&self) -> &[u32] {
        &self.connectivity.sides
    }

    /// The number of closed walks along edges with one face. O(b log b) for b of them.
    pub fn boundary_loops(&self) -> usize {
        let (faces, incidence) = (self.faces(), self.incidence());
        let corners = faces.corners();
        let ends = |&c: &u32| (corners[c as usize], corners[incidence.next(faces, c) as usize]);
        // At every vertex one arrives and one leaves.
        let mut walks: Vec<(u32, u32)> = self.boundary_half_edges().iter().map(ends).collect();
        walks.sort_unstable();
        let mut seen = vec![false; walks.len()];
        let mut loops = 0;
        for start in 0..walks.len() {
            let mut at = start;
            if !seen[at] {
                loops += 1;
            }
            while !std::mem::replace(&mut seen[at], true) {
                at = walks.partition_point(|walk| walk.0 < walks[at].1);
            }
        }
        loops
    }

    /// The [`diagonal`](super::diagonal) of the points.
    pub fn diagonal(&self) -> f64 {
        self.mesh.diagonal()
    }

    /// Oddities that no method minds, as in [`Validation::remarks`]: duplicate positions, faces without area, a boundary.
    /// Places are told in the `numbers` of the file.
    pub fn remarks(&self, numbers: &Numbers) -> Vec<String> {
        let mut remarks = Vec::new();
        if !self.is_closed() {
            let (edges, loops) = (self.boundary_edges(), self.boundary_loops());
            remarks.push(boundary_remark(edges, Some(loops), self.boundary()));
        }
        if let Some(features) = self.features() {
            let creased = features.creased_edges();
            let parts = [
                (creased, "creased edge"),
                (features.count(Rule::Corner), "corner"),
                (features.count(Rule::Dart), "dart"),
                (features.semi_sharp_edges().len(), "semi-sharp edge"),
            ];
            let parts: Vec<String> =
                parts.iter().filter(|p| p.0 > 0).map(|&(count, one)| counted(count, one)).collect();
            if !parts.is_empty() {
                remarks.push(parts.join(", "));
            }
        }
        if let Some(renumbered) = self.renumbered() {
            // Looking for what is not there is many times faster so. What is there needs the file's own numbers.
            let positions = renumbered.numbering.there(self.positions());
            let faces = (&renumbered.faces, &renumbered.incidence);
            if degenerate::remarks(&positions, faces, &Numbers::default(), self.is_closed()).is_empty() {
                return remarks;
            }
        }
        let faces = (self.faces(), self.incidence());
        remarks.extend(degenerate::remarks(self.positions(), faces, numbers, self.is_closed()));
        remarks
    }

    pub(crate) fn renumbered(&self) -> Option<&Renumbered> {
        self.connectivity.renumbered.as_ref()
    }
}

impl Connectivity {
    /// With all vertices smooth.
    fn new(is_closed: bool) -> Self {
        let (incidence, topology) = (OnceLock::new(), OnceLock::new());
        let (boundary, sides) = (Boundary::Refuse, Vec::new());
        Connectivity { is_closed, boundary, sides, features: None, incidence, topology, renumbered: None }
    }

    /// That of a mesh without defects, closed, or open with a boundary that is sharp; `None` if there are any, or it is
    /// another boundary.
    fn manifold(mesh: &Mesh, boundary: Boundary) -> Option<Self> {
        let renumbered = if mesh.len() >= SCATTERED && is_scattered(&mesh.faces) { along_curve(mesh) } else { None };
        Self::checked(mesh, boundary, renumbered)
    }

    /// As [`manifold`](Self::manifold), of what is renumbered.
    fn checked(mesh: &Mesh, boundary: Boundary, renumbered: Option<(Mesh, Numbering, Vec<u32>)>) -> Option<Self> {
        let (faces, points) = match &renumbered {
            Some((moved, ..)) => (&moved.faces, &moved.positions),
            None => (&mesh.faces, &mesh.positions),
        };
        let has_sides = faces.uniform_size().is_some_and(|size| size >= 3)
            || parallel::all(faces.len(), |f| faces.range(f).len() >= 3);
        if faces.is_empty() || !has_sides {
            return None;
        }
        let incidence = Incidence::checked(faces, points.len())?;
        let is_sharp = matches!(boundary, Boundary::EdgeAndCorner | Boundary::EdgeOnly);
        let least = if is_sharp { 1 } else { 3 };
        let sound = parallel::all(points.len(), |v| points[v].is_finite() && incidence.face_count(v) >= least);
        let on_boundary = if sound { incidence.boundary_vertices(faces)? } else { return None };
        if on_boundary.is_empty() {
            if !parallel::all(points.len(), |v| incidence.face_count(v) >= 3) {
                return None;
            }
        } else if !is_sharp {
            return None;
        } else {
            return Self::open(mesh, boundary, (incidence, on_boundary), renumbered);
        }
        let (incidence, renumbered) = match renumbered {
            Some((moved, numbering, order)) => {
                (OnceLock::new(), Some(Renumbered::new(moved.faces, incidence, numbering, order)))
            }
            None => (OnceLock::from(Arc::new(incidence)), None),
        };
        Some(Connectivity { incidence, renumbered, ..Connectivity::new(true) })
    }
}

impl Connectivity {
    /// That of an open manifold, from its incidence and the vertices on its boundary, of the faces as renumbered if they are.
    fn open(
        mesh: &Mesh,
        boundary: Boundary,
        (incidence, on_boundary): (Incidence, Vec<u32>),
        renumbered: Option<(Mesh, Numbering, Vec<u32>)>,
    ) -> Option<Self> {
        let (incidence, vertices, renumbered) = match renumbered {
            Some((moved, numbering, order)) => {
                let vertices = on_boundary.iter().map(|&v| numbering.order()[v as usize]).collect();
                let renumbered = Renumbered::new(moved.faces, incidence, numbering, order);
                (renumbered.incidence_of(&mesh.faces), vertices, Some(renumbered))
            }
            None => (incidence, on_boundary, None),
        };
        let side = |&v: &u32| incidence.boundary_side(&mesh.faces, v as usize);
        let mut sides: Vec<u32> = vertices.iter().map(side).collect::<Option<_>>()?;
        sides.sort_unstable();
        let tags = Tags { boundary, ..Tags::default() };
        let features = Features::new(&mesh.faces, &incidence, &sides, &tags).ok()?;
        let incidence = OnceLock::from(Arc::new(incidence));
        Some(Connectivity { boundary, sides, features, incidence, renumbered, ..Connectivity::new(false) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::builtin;
    use crate::mesh::generate::permute_vertices;
    use crate::mesh::order::Order;
    use crate::mesh::random::random_polygons;

    /// The short way to the verdict, and the report.
    fn agree(mesh: &Mesh) -> bool {
        let valid = validate(mesh, None, Boundary::Refuse).is_valid();
        assert_eq!(Connectivity::manifold(mesh, Boundary::Refuse).is_some(), valid, "{:?}", mesh.faces);
        // With a boundary too, its edges and loops.
        let report = validate(mesh, None, Boundary::EdgeOnly);
        let open = Connectivity::manifold(mesh, Boundary::EdgeOnly);
        assert_eq!(open.is_some(), report.is_valid(), "{:?}", mesh.faces);
        if let Some(open) = open {
            let surface = Surface { mesh: mesh.clone(), connectivity: Arc::new(open) };
            let topology = surface.topology();
            assert_eq!(surface.boundary_half_edges(), topology.boundary_half_edges());
            assert_eq!(surface.boundary_loops(), topology.boundary_loops(surface.faces()).len());
            assert_eq!(surface.is_closed(), topology.is_closed());
            let slow = Features::new(
                surface.faces(),
                &topology.incidence,
                topology.boundary_half_edges(),
                &Tags { boundary: Boundary::EdgeOnly, ..Tags::default() },
            );
            assert_eq!(surface.features(), slow.unwrap().as_ref());
        }
        valid
    }

    #[test]
    fn a_mesh_is_taken_if_the_validator_reports_no_defect() {
        let mut valid = 0;
        for seed in 0..200 {
            let mesh = random_polygons(seed);
            assert!(agree(&mesh));
            // One corner led elsewhere, one face less, one face twice, one turned round, one point lost.
            let lists: Vec<Vec<u32>> = mesh.faces.iter().map(<[u32]>::to_vec).collect();
            let f = seed as usize * 7 % lists.len();
            let with = |change: &dyn Fn(&mut Vec<Vec<u32>>)| {
                let mut lists = lists.clone();
                change(&mut lists);
                Mesh::new(mesh.positions.clone(), Faces::from_lists(lists))
            };
            let elsewhere = |v: u32| (v + 1 + seed as u32) % mesh.len() as u32;
            valid += usize::from(agree(&with(&|lists| lists[f][0] = elsewhere(lists[f][0]))));
            assert!(!agree(&with(&|lists| drop(lists.remove(f)))));
            assert!(!agree(&with(&|lists| lists.push(lists[f].clone()))));
            assert!(!agree(&with(&|lists| lists[f].reverse())));
            assert!(!agree(&with(&|lists| lists[f][1] = mesh.len() as u32)));
            let mut lost = mesh.clone();
            lost.positions[f % mesh.len()].y = f64::NAN;
            assert!(!agree(&lost));
            let mut isolated = mesh.clone();
            isolated.positions.push(DVec3::ONE);
            assert!(!agree(&isolated));
        }
        assert!(valid < 20, "{valid} of 200");
        assert!(!agree(&Mesh::new(Vec::new(), Faces::default())));
        assert!(!agree(&Mesh::new(vec![DVec3::X], Faces::default())));
    }

    #[test]
    fn meshes_with_one_defect_each_are_refused() {
        let at = |k: usize| DVec3::new(k as f64, (k * k) as f64, (k * k * k) as f64);
        let mesh = |n: usize, faces: &[&[u32]]| Mesh::new((0..n).map(at).collect(), Faces::from_lists(faces));
        let tetrahedra = |shift: [u32; 4]| {
            let [a, b, c, d] = shift;
            [[a, b, c], [a, c, d], [a, d, b], [b, d, c]]
        };
        // Two tetrahedra that share a vertex: every edge has two sides, and one vertex two umbrellas.
        let joined = [tetrahedra([0, 1, 2, 3]), tetrahedra([3, 4, 5, 6])].concat();
        let pinched = Mesh::new((0..7).map(at).collect(), Faces::from_lists(joined));
        assert!(!agree(&pinched));
        // A triangle and its back: valence 2.
        assert!(!agree(&mesh(3, &[&[0, 1, 2], &[0, 2, 1]])));
        // A vertex that one face passes twice, under one umbrella.
        let twice = mesh(5, &[&[0, 1, 2, 0, 3, 4], &[0, 2, 1], &[0, 4, 3]]);
        assert!(!agree(&twice));
        // So too beside a boundary, where valences may be low and nothing else is wrong; and a side from a vertex to itself.
        assert!(!agree(&mesh(8, &[&[0, 1, 2, 0, 3, 4], &[0, 2, 1], &[0, 4, 3], &[5, 6, 7]])));
        assert!(!agree(&mesh(6, &[&[0, 1, 2], &[3, 4, 3, 5]])));
        assert!(!agree(&mesh(5, &[&[0, 1, 2], &[3, 3, 4]])));
        assert!(agree(&mesh(4, &[&[0, 1, 2], &[0, 2, 3], &[0, 3, 1], &[1, 3, 2]])));
        // A face of many corners, one of them twice.
        let prism = builtin::prism(40);
        assert!(agree(&prism));
        let mut lists: Vec<Vec<u32>> = prism.faces.iter().map(<[u32]>::to_vec).collect();
        let large = lists.iter().position(|f| f.len() == 40).unwrap();
        lists[large][20] = lists[large][0];
        assert!(!agree(&Mesh::new(prism.positions, Faces::from_lists(lists))));
    }

    #[test]
    fn a_scattered_mesh_is_renumbered_inside_and_keeps_its_own_numbers() {
        let good = builtin::quad_sphere(7);
        let order = Order::Random(3).order(&good, &Incidence::new(&good.faces, good.len()));
        let scattered = permute_vertices(&good, &order);
        let surface = Surface::new(scattered.clone()).unwrap();
        assert!(surface.renumbered().is_some() && Surface::new(good).unwrap().renumbered().is_none());
        assert_eq!(*surface.mesh(), scattered);
        assert_eq!(*surface.topology(), Topology::new(&scattered.faces, scattered.len()));
        assert_eq!(surface.incidence(), &*surface.topology().incidence);
    }

    #[test]
    fn an_open_mesh_is_valid_where_a_boundary_is_allowed() {
        let mut lists: Vec<Vec<u32>> = builtin::icosphere(1).faces.iter().map(<[u32]>::to_vec).collect();
        lists.remove(0);
        let open = Mesh::new(builtin::icosphere(1).positions, Faces::from_lists(lists));
        assert!(Surface::new(open.clone()).is_err());
        let surface = Surface::examined(open, None, Boundary::AsInterior).unwrap();
        assert_eq!((surface.is_closed(), surface.boundary_edges()), (false, 3));
        assert!(surface.features().is_none());
    }
}
