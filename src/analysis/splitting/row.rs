//! Rows of the tables of splitting matrices: one valence of one scheme as plain numbers.

use nalgebra::{Complex, DVector};

use super::characteristic::{Check, characteristic_map};
use super::largest_difference;
use super::matrix::SplittingMatrix;
use super::scheme::LocalScheme;
use super::spectrum::distance_to_space;
use crate::error::Result;
use crate::parallel;

/// What the local matrix of one valence is like, computed, and its deviations from the closed forms.
#[derive(Clone, Debug)]
pub struct StarRow {
    /// The scheme whose local matrix it is.
    pub scheme: LocalScheme,
    /// Sectors n about the middle vertex or face.
    pub valence: usize,
    /// The fewest rings on which the matrix closes.
    pub rings: usize,
    /// All N, by falling modulus.
    pub eigenvalues: Vec<Complex<f64>>,
    /// λ_1, largest modulus after λ_0 = 1.
    pub lambda_subdominant: Complex<f64>,
    /// λ_1 in closed form; `None` for the blend with α ≠ 0.
    pub lambda_subdominant_formula: Option<f64>,
    /// max |computed − formula| over all eigenvalues, both sorted.
    pub eigenvalue_error: Option<f64>,
    /// N weights in the order of the matrix, sum 1.
    pub limit_mask: Vec<f64>,
    /// max |computed − formula|.
    pub limit_mask_error: Option<f64>,
    /// Cosine and sine masks; `None` where the leading pair of frequency 1 is complex.
    pub tangent_masks: Option<[Vec<f64>; 2]>,
    /// The relative distance of the closed-form cosine mask from the left eigenspace of λ_1.
    pub tangent_mask_distance: Option<f64>,
    /// max ‖S·X − X·(XᵀSX)‖ over all invariant subspaces, right and left.
    pub residual_right: f64,
    /// max ‖SᵀY − Y·(YᵀSᵀY)‖ over the left ones.
    pub residual_left: f64,
    /// λ_0 = 1 > λ_1 = λ_2 > λ_3, the pair real and of frequency 1.
    pub pair_leads: bool,
    /// The characteristic map, refined [`MAP_ROUNDS`] times; `None` where there is none.
    pub map: Option<Check>,
}

/// Rounds of refinement before a characteristic map is checked: 17 rings, of √3 42, with α ≠ 0 30.
pub const MAP_ROUNDS: usize = 3;

/// Rows of a scheme for several valences, in parallel.
///
/// # Errors
/// [`Error::Unknown`](crate::Error::Unknown) for a valence outside [`VALENCES`](super::VALENCES).
pub fn rows(scheme: LocalScheme, valences: &[usize]) -> Result<Vec<StarRow>> {
    parallel::try_map(valences, |&n| row(scheme, n))
}

fn row(scheme: LocalScheme, valence: usize) -> Result<StarRow> {
    let matrix = SplittingMatrix::new(scheme, valence)?;
    let eigenvalues = matrix.eigenvalues()?;
    let spaces = matrix.eigenspaces()?;
    let residuals = spaces.iter().map(|s| s.residuals(&matrix.entries));
    let [residual_right, residual_left] = residuals.fold([0.0_f64; 2], |[a, b], [x, y]| [a.max(x), b.max(y)]);
    let limit_mask = matrix.limit_mask()?;
    let formula = scheme.eigenvalues_formula(valence);
    let has_pair = matrix.leading_pair().is_ok();
    let tangent_mask_distance =
        scheme.cosine_mask_formula(valence).map(|mask| distance_to_space(&DVector::from_vec(mask), &spaces[1].left));
    Ok(StarRow {
        scheme,
        valence,
        rings: matrix.rings,
        lambda_subdominant: eigenvalues[1],
        lambda_subdominant_formula: scheme.subdominant_formula(valence),
        eigenvalue_error: formula.map(|f| largest_difference(&f, &eigenvalues)),
        limit_mask_error: scheme.limit_mask_formula(valence).map(|f| mask_error(&f, &limit_mask, &matrix)),
        limit_mask: limit_mask.as_slice().to_vec(),
        tangent_masks: match has_pair {
            true => Some(matrix.tangent_masks()?.map(|m| m.as_slice().to_vec())),
            false => None,
        },
        tangent_mask_distance,
        pair_leads: matrix.pair_leads()?,
        residual_right,
        residual_left,
        map: match has_pair {
            true => {
                let net = characteristic_map(scheme, valence, scheme.map_rings())?;
                Some(net.refine(MAP_ROUNDS)?.check())
            }
            false => None,
        },
        eigenvalues,
    })
}

/// The first ring's weights against the formula's, and those of further rings against 0.
fn mask_error(formula: &[f64], mask: &DVector<f64>, matrix: &SplittingMatrix) -> f64 {
    let layout = matrix.scheme.layout();
    let expected = |i: usize| {
        let orbit = match i.checked_sub(layout.centre()) {
            Some(i) => layout.centre() + i / matrix.valence,
            None => 0,
        };
        formula.get(orbit).copied().unwrap_or(0.0)
    };
    let weights = mask.iter().enumerate();
    weights.map(|(i, w)| (w - expected(i)).abs()).fold(0.0, f64::max)
}
