//! The schemes: each is four small functions of valence and face size, from which `A = H·M` follows
//! (theory: one symmetric circulant block a face, one weight an edge, one number a vertex).

use std::f64::consts::TAU;
use std::fmt;
use std::str::FromStr;

use crate::error::Error;
use crate::mesh::Faces;

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
pub(super) struct Modes {
    /// The same for all sizes.
    pub(super) identity: f64,
    pub(super) constant: f64,
    /// Zero for all sizes or for none.
    pub(super) cosine: f64,
}

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
}

/// How the papers name the three matrices of a scheme: `system = diagonal · symmetric`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PaperNames {
    pub system: &'static str,
    pub diagonal: &'static str,
    pub symmetric: &'static str,
}

impl Scheme {
    pub const ALL: [Scheme; 5] = [Scheme::CatmullClark, Scheme::Loop, Scheme::Sqrt3, Scheme::Nasri, Scheme::ZhengCai];

    pub fn name(self) -> &'static str {
        match self {
            Scheme::CatmullClark => "catmull-clark",
            Scheme::Loop => "loop",
            Scheme::Sqrt3 => "sqrt3",
            Scheme::Nasri => "nasri",
            Scheme::ZhengCai => "zheng-cai",
        }
    }

    /// The papers' letters for A, H and M. Zheng-Cai print no letters; their Eq. 6 is row i of `M V = H⁻¹P`.
    pub fn paper_names(self) -> PaperNames {
        let (system, diagonal, symmetric) = match self {
            Scheme::CatmullClark => ("C", "H", "M"),
            Scheme::Loop => ("B", "D", "S"),
            Scheme::Sqrt3 | Scheme::ZhengCai => ("A", "H", "M"),
            Scheme::Nasri => ("[C]", "H", "M"),
        };
        PaperNames { system, diagonal, symmetric }
    }

    /// What a face of `size` corners adds to M.
    pub(super) fn modes(self, size: usize) -> Modes {
        let m = size as f64;
        let (identity, constant, cosine) = match self {
            Scheme::CatmullClark => (0.0, 4.0 / m, 0.0),
            Scheme::Loop | Scheme::Sqrt3 => (0.0, 0.0, 0.0),
            Scheme::Nasri => (0.25, 0.75 / m, 0.5 / m),
            Scheme::ZhengCai => (0.0, 1.0 / m, 0.0),
        };
        Modes { identity, constant, cosine }
    }

    /// Whether the scheme is defined on triangles only.
    pub fn needs_triangles(self) -> bool {
        matches!(self, Scheme::Loop | Scheme::Sqrt3)
    }

    /// Whether a mesh with these faces can be used, and if not, the first face that forbids it.
    pub fn first_unsuitable_face(self, faces: &Faces) -> Option<usize> {
        if self.needs_triangles() { faces.iter().position(|f| f.len() != 3) } else { None }
    }

    /// The scheme that is meant when none is named: Loop on triangles, else Catmull-Clark.
    pub fn default_for(faces: &Faces) -> Scheme {
        if faces.uniform_size() == Some(3) { Scheme::Loop } else { Scheme::CatmullClark }
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
        Scheme::ALL.into_iter().find(|scheme| scheme.name() == s).ok_or_else(|| {
            let names = Scheme::ALL.map(Scheme::name).join(", ");
            Error::Unknown(format!("unknown scheme \"{s}\"; the schemes are {names}"))
        })
    }
}

/// Loop's limit weight of a vertex of valence `n` (PIA Eq. 1): β_n = 3/(11 − 8(3/8 + (3/8 + ¼cos(2π/n))²)).
pub fn loop_beta(n: usize) -> f64 {
    let c = 0.375 + 0.25 * (TAU / n as f64).cos();
    3.0 / (11.0 - 8.0 * (0.375 + c * c))
}

/// The limit weight of a vertex of valence `n` under Kobbelt's √3 scheme: 1/(1 + 3a_n), a_n = (4 − 2cos(2π/n))/9.
pub fn sqrt3_beta(n: usize) -> f64 {
    let a = (4.0 - 2.0 * (TAU / n as f64).cos()) / 9.0;
    1.0 / (1.0 + 3.0 * a)
}

impl Masks for Scheme {
    fn h(&self, n: usize) -> f64 {
        let x = n as f64;
        match self {
            Scheme::CatmullClark => 1.0 / (x * (x + 5.0)),
            Scheme::Loop => (1.0 - loop_beta(n)) / x,
            Scheme::Sqrt3 => (1.0 - sqrt3_beta(n)) / x,
            Scheme::Nasri => 1.0 / x,
            Scheme::ZhengCai => 0.5 / x,
        }
    }

    fn vertex_weight(&self, n: usize) -> f64 {
        let x = n as f64;
        let from_beta = |beta: f64| x * beta / (1.0 - beta);
        match self {
            Scheme::CatmullClark => x * x - x,
            Scheme::Loop => from_beta(loop_beta(n)),
            Scheme::Sqrt3 => from_beta(sqrt3_beta(n)),
            Scheme::Nasri => 0.0,
            Scheme::ZhengCai => x,
        }
    }

    fn edge_weight(&self) -> f64 {
        match self {
            Scheme::CatmullClark => 2.0,
            Scheme::Loop | Scheme::Sqrt3 => 1.0,
            Scheme::Nasri | Scheme::ZhengCai => 0.0,
        }
    }

    fn face_weight(&self, size: usize, steps: usize) -> f64 {
        let modes = self.modes(size);
        let own = if steps == 0 { modes.identity } else { 0.0 };
        if modes.cosine == 0.0 {
            return own + modes.constant;
        }
        // Symmetric in steps ↔ size − steps to the last bit: the angle is taken the short way round.
        let turn = TAU * steps.min(size - steps) as f64 / size as f64;
        own + modes.constant + modes.cosine * turn.cos()
    }

    fn edges_only(&self) -> bool {
        self.needs_triangles()
    }
}
