//! The schemes whose local matrices are studied, their refinement on a star, and their closed forms.

use std::f64::consts::{PI, TAU};
use std::fmt;

use nalgebra::Complex;

use super::star::Layout;
use crate::error::{Error, Result};
use crate::mesh::{Mesh, Surface};
use crate::names;
use crate::schemes::unified_sqrt3::{self, ALPHA_RANGE};
use crate::schemes::{Refinement, blend, catmull_clark, doo_sabin, kobbelt, labsik_greiner, loop_scheme, sqrt3};

/// Valences of local matrices. Below 3 a star is degenerate; the matrices are dense, and the largest (three rings
/// of quads) has 12n+1 rows.
pub const VALENCES: std::ops::RangeInclusive<usize> = 3..=100;

/// A scheme seen at one extraordinary vertex; of Doo-Sabin, at an extraordinary face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LocalScheme {
    /// Catmull-Clark, at a vertex among quads.
    CatmullClark,
    /// Loop, at a vertex among triangles.
    Loop,
    /// Doo-Sabin, at a face of n corners among quads.
    DooSabin,
    /// The blend of Lin & Luo with the same α everywhere: 0 is Kobbelt's √3 scheme, 1 the interpolatory one.
    /// One round is two steps, turned back by one sector: S̃ = R·S·S.
    Sqrt3 {
        /// The blend parameter α, from 0 to 2.
        alpha: f64,
    },
    /// The same [blend] of another scheme; with α = 0 it is that scheme.
    Blend {
        /// The scheme that is blended.
        of: Blended,
        /// The blend parameter α, from 0 to 2.
        alpha: f64,
    },
    /// Maillot & Stam's [push-back](blend::push_back) of another scheme; with β = 0 it is that scheme.
    PushBack {
        /// The scheme whose vertices are pushed back.
        of: Blended,
        /// How far, β, from 0 to 2; at 1 they stay.
        beta: f64,
    },
    /// The interpolatory √3 scheme of Labsik & Greiner, two steps turned back as of `Sqrt3`.
    LabsikGreiner,
    /// Kobbelt's interpolatory scheme, at a vertex among quads.
    Kobbelt,
}

/// What is blended in [`LocalScheme::Blend`], and pushed back in [`LocalScheme::PushBack`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Blended {
    /// Catmull-Clark, at a vertex among quads.
    CatmullClark,
    /// Loop, at a vertex among triangles.
    Loop,
}

impl Blended {
    fn scheme(self) -> LocalScheme {
        match self {
            Blended::CatmullClark => LocalScheme::CatmullClark,
            Blended::Loop => LocalScheme::Loop,
        }
    }

    fn refinement(self) -> Refinement {
        match self {
            Blended::CatmullClark => Refinement::CatmullClark,
            Blended::Loop => Refinement::Loop,
        }
    }
}

impl LocalScheme {
    /// The scheme called `name`, one of `catmull-clark`, `loop`, `doo-sabin`, `sqrt3`, `labsik-greiner`, `kobbelt`,
    /// `blended-catmull-clark`, `blended-loop`, `pushed-back-catmull-clark` and `pushed-back-loop`; `sqrt3` (0 unless told), the blends
    /// and, for β, the last two (1) take an `alpha`.
    ///
    /// # Errors
    /// [`Error::Unknown`] for another name, an `alpha` outside [`ALPHA_RANGE`], or one for a scheme without.
    pub fn new(name: &str, alpha: Option<f64>) -> Result<Self> {
        let all = [
            LocalScheme::CatmullClark,
            LocalScheme::Loop,
            LocalScheme::DooSabin,
            LocalScheme::Sqrt3 { alpha: alpha.unwrap_or(0.0) },
            LocalScheme::LabsikGreiner,
            LocalScheme::Blend { of: Blended::CatmullClark, alpha: alpha.unwrap_or(1.0) },
            LocalScheme::Blend { of: Blended::Loop, alpha: alpha.unwrap_or(1.0) },
            LocalScheme::PushBack { of: Blended::CatmullClark, beta: alpha.unwrap_or(1.0) },
            LocalScheme::PushBack { of: Blended::Loop, beta: alpha.unwrap_or(1.0) },
            LocalScheme::Kobbelt,
        ];
        let scheme =
            names::find("scheme with a splitting matrix", name, &all.map(|scheme| (scheme.name(), scheme)), &[])?;
        match (scheme, alpha) {
            (
                LocalScheme::Sqrt3 { alpha }
                | LocalScheme::Blend { alpha, .. }
                | LocalScheme::PushBack { beta: alpha, .. },
                _,
            ) if !ALPHA_RANGE.contains(&alpha) => {
                Err(Error::Unknown(format!("α = {alpha} is outside [{}, {}]", ALPHA_RANGE.start(), ALPHA_RANGE.end())))
            }
            (LocalScheme::Sqrt3 { .. } | LocalScheme::Blend { .. } | LocalScheme::PushBack { .. }, _) | (_, None) => {
                Ok(scheme)
            }
            (_, Some(_)) => Err(Error::Unknown(format!("{name} has no parameter α: leave it out or choose sqrt3"))),
        }
    }

    /// The name on the command line, without α.
    pub fn name(self) -> &'static str {
        match self {
            LocalScheme::CatmullClark => "catmull-clark",
            LocalScheme::Loop => "loop",
            LocalScheme::DooSabin => "doo-sabin",
            LocalScheme::Sqrt3 { .. } => "sqrt3",
            LocalScheme::LabsikGreiner => "labsik-greiner",
            LocalScheme::Blend { of: Blended::CatmullClark, .. } => "blended-catmull-clark",
            LocalScheme::Blend { of: Blended::Loop, .. } => "blended-loop",
            LocalScheme::PushBack { of: Blended::CatmullClark, .. } => "pushed-back-catmull-clark",
            LocalScheme::PushBack { of: Blended::Loop, .. } => "pushed-back-loop",
            LocalScheme::Kobbelt => "kobbelt",
        }
    }

    /// How the star is filled.
    pub fn layout(self) -> Layout {
        match self {
            LocalScheme::CatmullClark | LocalScheme::Kobbelt => Layout::Quads,
            LocalScheme::Loop | LocalScheme::Sqrt3 { .. } | LocalScheme::LabsikGreiner => Layout::Triangles,
            LocalScheme::DooSabin => Layout::QuadsAboutFace,
            LocalScheme::Blend { of, .. } | LocalScheme::PushBack { of, .. } => of.scheme().layout(),
        }
    }

    /// The fewest rings on which the local matrix closes: 1, but 2 for push-back and Kobbelt, and 3 for blends with α ≠ 0
    /// and Labsik-Greiner.
    pub fn least_rings(self) -> usize {
        match self {
            LocalScheme::Sqrt3 { alpha } | LocalScheme::Blend { alpha, .. } if alpha != 0.0 => 3,
            LocalScheme::PushBack { beta, .. } if beta != 0.0 => 2,
            LocalScheme::LabsikGreiner => 3,
            LocalScheme::Kobbelt => 2,
            LocalScheme::CatmullClark
            | LocalScheme::Loop
            | LocalScheme::DooSabin
            | LocalScheme::Sqrt3 { .. }
            | LocalScheme::Blend { .. }
            | LocalScheme::PushBack { .. } => 1,
        }
    }

    /// The rings of a control net that determines the surface on more than one ring about the middle.
    pub fn map_rings(self) -> usize {
        self.least_rings().max(2) + 1
    }

    /// How much finer the mesh becomes in one round: a 1-to-k² split.
    pub(super) fn factor(self) -> usize {
        if self.turns() { 3 } else { 2 }
    }

    /// Whether a step turns the star by half a sector, so that a round is two steps.
    fn turns(self) -> bool {
        matches!(self, LocalScheme::Sqrt3 { .. } | LocalScheme::LabsikGreiner)
    }

    /// # Errors
    /// [`Error::Unknown`] for a valence outside [`VALENCES`].
    pub(super) fn require_valence(n: usize) -> Result<()> {
        if VALENCES.contains(&n) {
            Ok(())
        } else {
            Err(Error::Unknown(format!(
                "valence {n} is outside {}..{}, the valences of splitting matrices",
                VALENCES.start(),
                VALENCES.end()
            )))
        }
    }

    pub(super) fn step(self, surface: &Surface) -> Result<Mesh> {
        match self {
            LocalScheme::CatmullClark => catmull_clark::refine(surface),
            LocalScheme::Loop => loop_scheme::refine(surface),
            LocalScheme::DooSabin => doo_sabin::refine(surface),
            LocalScheme::Sqrt3 { alpha: 0.0 } => sqrt3::refine(surface),
            LocalScheme::Sqrt3 { alpha } => {
                let (mesh, _) = unified_sqrt3::refine(surface, &vec![alpha; surface.len()])?;
                Ok(mesh)
            }
            LocalScheme::LabsikGreiner => labsik_greiner::refine(surface),
            LocalScheme::Blend { of, alpha: 0.0 } => of.scheme().step(surface),
            LocalScheme::Blend { of, alpha } => blend::refine(surface, of.refinement(), alpha),
            LocalScheme::PushBack { of, beta: 0.0 } => of.scheme().step(surface),
            LocalScheme::PushBack { of, beta } => blend::push_back(surface, of.refinement(), beta),
            LocalScheme::Kobbelt => kobbelt::step(surface),
        }
    }

    /// Where the half-edge `root` from the middle is found after a step; of √3 turned clockwise by half a sector.
    pub fn root_after_step(self, root: u32) -> u32 {
        match self {
            LocalScheme::CatmullClark | LocalScheme::Kobbelt => 4 * root,
            LocalScheme::Loop => 12 * (root / 3) + 3 * (root % 3),
            LocalScheme::DooSabin => root,
            LocalScheme::Blend { of, .. } | LocalScheme::PushBack { of, .. } => of.scheme().root_after_step(root),
            LocalScheme::Sqrt3 { .. } | LocalScheme::LabsikGreiner => 3 * root,
        }
    }

    /// The subdominant eigenvalue λ_1 = λ_2 in closed form; none for the blend with α ≠ 0, push-back and Kobbelt's scheme.
    ///
    /// Catmull-Clark (4 + A_n)/16 (Thall Eq. 15), Loop 3/8 + ¼cos(2π/n), Doo-Sabin ½, √3 and Labsik-Greiner
    /// (⅔cos(π/n))².
    ///
    /// ```
    /// use limitlab::analysis::splitting::LocalScheme;
    /// let lambda = LocalScheme::CatmullClark.subdominant_formula(3).unwrap();
    /// assert!((lambda - (9.0 + 17f64.sqrt()) / 32.0).abs() < 1e-15);
    /// ```
    pub fn subdominant_formula(self, n: usize) -> Option<f64> {
        let turn = TAU / n as f64;
        match self {
            LocalScheme::CatmullClark => Some((4.0 + catmull_clark::tangent_constant(n)) / 16.0),
            LocalScheme::Loop => Some(0.375 + 0.25 * turn.cos()),
            LocalScheme::DooSabin => Some(0.5),
            LocalScheme::Sqrt3 { alpha: 0.0 } => Some((2.0 / 3.0 * (PI / n as f64).cos()).powi(2)),
            LocalScheme::Blend { of, alpha: 0.0 } | LocalScheme::PushBack { of, beta: 0.0 } => {
                of.scheme().subdominant_formula(n)
            }
            LocalScheme::Sqrt3 { .. }
            | LocalScheme::Blend { .. }
            | LocalScheme::PushBack { .. }
            | LocalScheme::Kobbelt => None,
            LocalScheme::LabsikGreiner => Some(labsik_greiner::subdominant(n).powi(2)),
        }
    }

    /// All eigenvalues on one ring in closed form, by Fourier block, largest first; none for schemes that do not close
    /// on one ring.
    ///
    /// With c_k = cos(2πk/n): Catmull-Clark (5 + c_k ± cos(πk/n)√(2(9+c_k)))/16 for 0 < k < n, and beside 1 the
    /// roots of μ² − (3n−7)/(4n) μ + (n−3)/(16n); Loop 3/8 + ¼c_k, and (3/8 + ¼c_1)²; Doo-Sabin 1, ½, ½, ¼, …;
    /// √3 (⅔cos(πk/n))², and (⅔ − a_n)².
    pub fn eigenvalues_formula(self, n: usize) -> Option<Vec<Complex<f64>>> {
        let size = n as f64;
        let cosine = |k: usize| (TAU * k as f64 / size).cos();
        let half = |k: usize| (PI * k as f64 / size).cos();
        let mut all = vec![1.0];
        match self {
            LocalScheme::CatmullClark => {
                let (mean, product) = ((3.0 * size - 7.0) / (8.0 * size), (size - 3.0) / (16.0 * size));
                // Both roots are real: 5n² − 30n + 49 > 0.
                let spread = (mean * mean - product).sqrt();
                all.extend([mean + spread, mean - spread]);
                for k in 1..n {
                    let (middle, spread) = (5.0 + cosine(k), half(k) * (2.0 * (9.0 + cosine(k))).sqrt());
                    all.extend([(middle + spread) / 16.0, (middle - spread) / 16.0]);
                }
            }
            LocalScheme::Loop => {
                all.push((0.375 + 0.25 * cosine(1)).powi(2));
                all.extend((1..n).map(|k| 0.375 + 0.25 * cosine(k)));
            }
            LocalScheme::DooSabin => {
                all.extend((1..n).map(|k| if k == 1 || k == n - 1 { 0.5 } else { 0.25 }));
            }
            LocalScheme::Sqrt3 { alpha: 0.0 } => {
                all.push((2.0 / 3.0 - sqrt3::relaxation(n)).powi(2));
                all.extend((1..n).map(|k| (2.0 / 3.0 * half(k)).powi(2)));
            }
            LocalScheme::Blend { of, alpha: 0.0 } | LocalScheme::PushBack { of, beta: 0.0 } => {
                return of.scheme().eigenvalues_formula(n);
            }
            LocalScheme::Sqrt3 { .. }
            | LocalScheme::Blend { .. }
            | LocalScheme::PushBack { .. }
            | LocalScheme::LabsikGreiner
            | LocalScheme::Kobbelt => return None,
        }
        let mut all: Vec<_> = all.into_iter().map(Complex::from).collect();
        super::sort(&mut all);
        Some(all)
    }

    /// The limit mask in closed form, as weights of the middle and of each orbit of n positions on the first ring;
    /// for the blend only at α = 0 and, interpolating, at α = 1.
    pub fn limit_mask_formula(self, n: usize) -> Option<Vec<f64>> {
        match self {
            LocalScheme::CatmullClark => Some(catmull_clark::limit_mask(n).to_vec()),
            LocalScheme::Loop => Some(loop_scheme::limit_mask(n).to_vec()),
            LocalScheme::DooSabin => Some(vec![1.0 / n as f64]),
            LocalScheme::Sqrt3 { alpha: 0.0 } => Some(sqrt3::limit_mask(n).to_vec()),
            LocalScheme::Blend { of, alpha: 0.0 } | LocalScheme::PushBack { of, beta: 0.0 } => {
                of.scheme().limit_mask_formula(n)
            }
            LocalScheme::Blend { of: Blended::CatmullClark, alpha: 1.0 }
            | LocalScheme::PushBack { of: Blended::CatmullClark, beta: 1.0 }
            | LocalScheme::Kobbelt => Some(vec![1.0, 0.0, 0.0]),
            LocalScheme::Sqrt3 { alpha: 1.0 }
            | LocalScheme::Blend { of: Blended::Loop, alpha: 1.0 }
            | LocalScheme::PushBack { of: Blended::Loop, beta: 1.0 }
            | LocalScheme::LabsikGreiner => Some(vec![1.0, 0.0]),
            LocalScheme::Sqrt3 { .. } | LocalScheme::Blend { .. } | LocalScheme::PushBack { .. } => None,
        }
    }

    /// The weights of the cosine tangent mask in closed form, orbit by orbit on one ring (the sine mask has sines in
    /// their place); none for schemes that do not close on one ring.
    pub(super) fn cosine_mask_formula(self, n: usize) -> Option<Vec<f64>> {
        let ring = || (0..n).map(|j| (TAU * j as f64 / n as f64).cos());
        match self {
            LocalScheme::CatmullClark => {
                let mask = catmull_clark::tangent_mask(n);
                let orbit = |o: usize| mask.iter().map(move |pair| pair[o]);
                Some([0.0].into_iter().chain(orbit(0)).chain(orbit(1)).collect())
            }
            LocalScheme::DooSabin => Some(ring().collect()),
            LocalScheme::Loop | LocalScheme::Sqrt3 { alpha: 0.0 } => Some([0.0].into_iter().chain(ring()).collect()),
            LocalScheme::Blend { of, alpha: 0.0 } | LocalScheme::PushBack { of, beta: 0.0 } => {
                of.scheme().cosine_mask_formula(n)
            }
            LocalScheme::Sqrt3 { .. }
            | LocalScheme::Blend { .. }
            | LocalScheme::PushBack { .. }
            | LocalScheme::LabsikGreiner
            | LocalScheme::Kobbelt => None,
        }
    }
}

impl fmt::Display for LocalScheme {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            LocalScheme::Sqrt3 { alpha } | LocalScheme::Blend { alpha, .. } => {
                write!(f, "{}, α = {alpha}", self.name())
            }
            LocalScheme::PushBack { beta, .. } => write!(f, "{}, β = {beta}", self.name()),
            LocalScheme::CatmullClark
            | LocalScheme::Loop
            | LocalScheme::DooSabin
            | LocalScheme::LabsikGreiner
            | LocalScheme::Kobbelt => f.write_str(self.name()),
        }
    }
}

/// One round of refinement of a star, prepared: topologies do not depend on positions.
pub(super) struct Round {
    scheme: LocalScheme,
    /// The star before each step.
    surfaces: Vec<Surface>,
    /// The star's positions in the refined mesh, by their number in the star.
    pub(super) found: Vec<u32>,
}

impl Round {
    /// Refines `mesh`, whose half-edge 0 leaves the middle (or lies on the middle face), and looks up the positions
    /// of `rings` rings in the result. For √3 the two steps turn the star clockwise by one sector; the walk starts
    /// one sector further on, which is R.
    pub(super) fn new(scheme: LocalScheme, mesh: Mesh, n: usize, rings: usize) -> Result<Self> {
        let steps = if scheme.turns() { 2 } else { 1 };
        let mut refined = Surface::of_valid(mesh);
        let mut root = 0;
        let mut surfaces = Vec::with_capacity(steps);
        for _ in 0..steps {
            let next = Surface::of_valid(scheme.step(&refined)?);
            root = scheme.root_after_step(root);
            surfaces.push(std::mem::replace(&mut refined, next));
        }
        if steps == 2 {
            let turned = refined.topology().counter_clockwise(refined.faces(), root);
            root = turned.ok_or_else(|| Error::Computation("the star is open".into()))?;
        }
        let found = scheme.layout().walk(&refined, root, n, rings)?;
        Ok(Round { scheme, surfaces, found })
    }

    /// The refined positions of the star, by their number in it, from those before.
    pub(super) fn apply(&mut self, positions: &[glam::DVec3]) -> Result<Vec<glam::DVec3>> {
        let mut points: Option<Vec<glam::DVec3>> = None;
        for surface in &mut self.surfaces {
            surface.positions_mut().copy_from_slice(points.as_deref().unwrap_or(positions));
            points = Some(self.scheme.step(surface)?.positions);
        }
        let points = points.unwrap_or_default();
        Ok(self.found.iter().map(|&v| points[v as usize]).collect())
    }
}
