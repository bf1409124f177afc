//! The schemes of the form A = H·M: each is [`Definition`] in a file of its own, and this is the list.

use std::f64::consts::TAU;
use std::fmt;
use std::str::FromStr;

use super::doo_sabin::CornerRule;
use super::local_limit::StarRule;
use super::{Refinement, catmull_clark, loop_scheme, mid_edge, nasri, sqrt3, zheng_cai};
use crate::error::Error;
use crate::mesh::Faces;
use crate::mesh::file_tags::Subdivision;
use crate::names;

/// What a scheme tells the assembler. `M = diag(d(n)) + w·Adj + Σ_F circulant(|F|)`, `H = diag(h(n))`, `A = H·M`.
pub trait Masks: Sync {
    /// The diagonal entry of H at a vertex of valence `n` ≥ 3.
    fn h(&self, n: usize) -> f64;
    /// The vertex's own part of M's diagonal.
    fn vertex_weight(&self, n: usize) -> f64;
    /// The entry of M that each edge adds between its two ends.
    fn edge_weight(&self) -> f64;
    /// The entry that a face of `size` corners adds to M between a corner and the one `steps` further,
    /// 0 ≤ `steps` < `size`.
    fn face_weight(&self, size: usize, steps: usize) -> f64;
    /// Whether faces add nothing to M: then only edges couple vertices.
    fn edges_only(&self) -> bool {
        false
    }
}

/// The circulant of a face of m corners: `identity·δ + constant + cosine·cos(2π(s−t)/m)` between the places s and t.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Circulant {
    /// The same for all sizes.
    pub(crate) identity: f64,
    pub(crate) constant: f64,
    /// Zero for all sizes or for none.
    pub(crate) cosine: f64,
}

/// On which closed meshes with valences of 3 and more the matrix A is singular.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SingularSet {
    /// On none of them.
    Never,
    /// Where the edge graph of a connected component is bipartite and, if a valence is given, all of its vertices have
    /// that one. The null vector is the ±1 colouring.
    Bipartite {
        /// The valence that all vertices of the component must have; `None` if any will do.
        valence: Option<usize>,
    },
}

impl SingularSet {
    /// What a component has on which A is singular, in words; `None` where it never is.
    pub fn condition(self) -> Option<String> {
        match self {
            SingularSet::Never => None,
            SingularSet::Bipartite { valence: None } => Some("a bipartite graph".into()),
            SingularSet::Bipartite { valence: Some(n) } => Some(format!("all valences {n} and a bipartite graph")),
        }
    }
}

/// All that defines a scheme.
pub(super) struct Definition {
    pub(super) name: &'static str,
    pub(super) paper_names: PaperNames,
    /// h(n).
    pub(super) h: fn(usize) -> f64,
    /// d(n), the vertex's own part of M's diagonal.
    pub(super) vertex_weight: fn(usize) -> f64,
    /// w, the entry of M between the ends of an edge.
    pub(super) edge_weight: f64,
    /// What a face of m corners adds to M; `None` if faces add nothing.
    pub(super) circulant: Option<fn(f64) -> Circulant>,
    pub(super) needs_triangles: bool,
    /// What a vertex of valence n ≥ 3 allows λ_min(A) to be on a closed mesh, of triangles only or not: b_n with
    /// `M ⪰ H⁻¹ diag(b)`.
    pub(super) lambda_min_at: fn(usize, bool) -> f64,
    /// What λ_min(A) usually is, or a little less. Nothing is proven by it.
    pub(super) usual_lambda_min: f64,
    pub(super) singular: SingularSet,
    /// The least value of the symbol of A on a regular mesh, and a_ii there: valence 6 among triangles for a scheme of
    /// triangles, else valence 4 among quads.
    pub(super) regular_symbol: (f64, f64),
    /// The refinement whose limit points A V are.
    pub(super) refinement: Refinement,
    /// The rule of the first step, where that is a Doo-Sabin step.
    pub(super) first_rule: Option<CornerRule>,
    /// w: on a curve of sharp edges the limit point is `w a + (1 − 2w) v + w b`, a and b the neighbours along it.
    pub(super) curve_weight: f64,
    /// How stars with darts and semi-sharp edges are refined; `None` if the scheme has no rule for these.
    pub(super) star_rule: Option<StarRule>,
}

/// Of cubic B-splines, as which curves are subdivided by the primal schemes: their value at a knot.
pub(super) const CUBIC: f64 = 1.0 / 6.0;
/// Of quadratic B-splines, as which curves are subdivided by the dual schemes: their value in the middle of a span.
pub(super) const QUADRATIC: f64 = 1.0 / 8.0;

/// A subdivision scheme whose limit points the control mesh is asked to interpolate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Scheme {
    /// Catmull-Clark on polygons of any size: Thall §2, PIA §3 (C = H·M).
    CatmullClark,
    /// Loop on triangles: PIA §2 (B = D·S).
    Loop,
    /// Kobbelt's √3 on triangles.
    Sqrt3,
    /// Doo-Sabin with its own first step: Nasri's matrix, Zheng-Cai §2.
    Nasri,
    /// Doo-Sabin with the modified first step `(V + centroid)/2`: Zheng-Cai Eq. 6.
    ZhengCai,
    /// Peters & Reif's midpoints of edges: A = ½(I + D⁻¹Adj), in none of the papers.
    MidEdge,
}

/// How the papers name the three matrices of a scheme: `system = diagonal · symmetric`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PaperNames {
    /// The letter of A.
    pub system: &'static str,
    /// The letter of H.
    pub diagonal: &'static str,
    /// The letter of M.
    pub symmetric: &'static str,
}

impl PaperNames {
    /// The letters of this house, for schemes to which no paper gives others.
    pub(super) const OURS: PaperNames = PaperNames { system: "A", diagonal: "H", symmetric: "M" };
}

impl Scheme {
    /// All of them, in the order in which messages list them.
    pub const ALL: [Scheme; 6] =
        [Scheme::CatmullClark, Scheme::Loop, Scheme::Sqrt3, Scheme::Nasri, Scheme::ZhengCai, Scheme::MidEdge];

    fn definition(self) -> &'static Definition {
        match self {
            Scheme::CatmullClark => &catmull_clark::DEFINITION,
            Scheme::Loop => &loop_scheme::DEFINITION,
            Scheme::Sqrt3 => &sqrt3::DEFINITION,
            Scheme::Nasri => &nasri::DEFINITION,
            Scheme::ZhengCai => &zheng_cai::DEFINITION,
            Scheme::MidEdge => &mid_edge::DEFINITION,
        }
    }

    /// The name on the command line, which `parse` reads back.
    pub fn name(self) -> &'static str {
        self.definition().name
    }

    /// The papers' letters for A, H and M. Zheng-Cai print no letters; their Eq. 6 is row i of `M V = H⁻¹P`.
    pub fn paper_names(self) -> PaperNames {
        self.definition().paper_names
    }

    /// What a face of `size` corners adds to M.
    pub(crate) fn circulant(self, size: usize) -> Circulant {
        let nothing = Circulant { identity: 0.0, constant: 0.0, cosine: 0.0 };
        self.definition().circulant.map_or(nothing, |circulant| circulant(size as f64))
    }

    /// Whether the scheme is defined on triangles only.
    pub fn needs_triangles(self) -> bool {
        self.definition().needs_triangles
    }

    /// Whether a mesh with these faces can be used, and if not, the first face that forbids it.
    pub fn first_unsuitable_face(self, faces: &Faces) -> Option<usize> {
        if self.needs_triangles() { faces.iter().position(|f| f.len() != 3) } else { None }
    }

    /// The scheme that is meant when none is named: Loop on triangles, else Catmull-Clark.
    pub fn default_for(faces: &Faces) -> Scheme {
        if faces.uniform_size() == Some(3) { Scheme::Loop } else { Scheme::CatmullClark }
    }

    /// What a vertex of valence `n` ≥ 3 allows λ_min(A) to be on a closed mesh: λ_min(A) ≥ min over the vertices. The
    /// scheme's file has the proof.
    pub fn lambda_min_at(self, n: usize, triangles_only: bool) -> f64 {
        (self.definition().lambda_min_at)(n, triangles_only)
    }

    /// What λ_min(A) usually is, or a little less, on meshes that the scheme was tried on (`spectrum`). Nothing is
    /// proven by it.
    pub fn usual_lambda_min(self) -> f64 {
        self.definition().usual_lambda_min
    }

    /// On which closed meshes with valences of 3 and more A is singular. The scheme's file has the proof.
    pub fn singular_set(self) -> SingularSet {
        self.definition().singular
    }

    /// The least value of the symbol of A on a regular mesh, and a_ii there: valence 6 among triangles for a scheme that
    /// [needs triangles](Self::needs_triangles), else valence 4 among quads.
    pub fn regular_symbol(self) -> (f64, f64) {
        self.definition().regular_symbol
    }

    /// The refinement whose surface the limit points A V lie on.
    pub fn refinement(self) -> Refinement {
        self.definition().refinement
    }

    /// What the scheme is to a subdivision tool, in a USD file: the faces themselves where tools do not have it.
    pub fn subdivision(self) -> Subdivision {
        match self {
            Scheme::CatmullClark => Subdivision::CatmullClark,
            Scheme::Loop => Subdivision::Loop,
            Scheme::Sqrt3 | Scheme::Nasri | Scheme::ZhengCai | Scheme::MidEdge => Subdivision::None,
        }
    }

    pub(crate) fn star_rule(self) -> Option<StarRule> {
        self.definition().star_rule
    }

    /// w: on a curve of sharp edges, a boundary or a crease, the limit point is `w a + (1 − 2w) v + w b`, a and b being the
    /// neighbours along the curve. 1/6, as of cubic B-splines, for the primal schemes; 1/8, as of quadratic ones, for the
    /// dual.
    pub fn curve_weight(self) -> f64 {
        self.definition().curve_weight
    }

    /// The rule of the first step, where the [`refinement`](Self::refinement) is Doo-Sabin's.
    pub fn first_rule(self) -> Option<CornerRule> {
        self.definition().first_rule
    }
}

impl fmt::Display for Scheme {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for Scheme {
    type Err = Error;

    fn from_str(s: &str) -> Result<Self, Error> {
        let aliases = [("cc", Scheme::CatmullClark), ("√3", Scheme::Sqrt3)];
        names::find("scheme", s, &Scheme::ALL.map(|scheme| (scheme.name(), scheme)), &aliases)
    }
}

/// h(n) and d(n) of a scheme that gives the vertex the weight β and each of its n neighbours (1 − β)/n.
pub(super) fn from_limit_weight(beta: f64, n: usize) -> [f64; 2] {
    [(1.0 - beta) / n as f64, n as f64 * beta / (1.0 - beta)]
}

impl Masks for Scheme {
    fn h(&self, n: usize) -> f64 {
        (self.definition().h)(n)
    }

    fn vertex_weight(&self, n: usize) -> f64 {
        (self.definition().vertex_weight)(n)
    }

    fn edge_weight(&self) -> f64 {
        self.definition().edge_weight
    }

    fn face_weight(&self, size: usize, steps: usize) -> f64 {
        let circulant = self.circulant(size);
        let own = if steps == 0 { circulant.identity } else { 0.0 };
        if circulant.cosine == 0.0 {
            return own + circulant.constant;
        }
        // Symmetric in steps ↔ size − steps to the last bit: the angle is taken the short way round.
        let turn = TAU * steps.min(size - steps) as f64 / size as f64;
        own + circulant.constant + circulant.cosine * turn.cos()
    }

    fn edges_only(&self) -> bool {
        self.definition().circulant.is_none()
    }
}
