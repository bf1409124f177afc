//! What Thall prints of the splitting matrices of Catmull-Clark (§3.1, §4, §4.1), held against computed matrices.
//!
//! His order is v, f_1…f_n, e_1…e_n with f_j between e_{j−1} and e_j (his matrices say so); ours has f_j between e_j
//! and e_{j+1}. His formulas for c_2 and c_3 use Halstead's order, which is ours; §4.1 gives the map between
//! them: e_j of the tables is e_{j+1} of the formulas, f_j stays.

use std::f64::consts::TAU;

use glam::DVec2;
use nalgebra::{DMatrix, DVector};

use super::matrix::SplittingMatrix;
use super::scheme::LocalScheme;
use super::spectrum::distance_to_space;
use crate::error::{Error, Result};
use crate::schemes::catmull_clark::tangent_constant;

/// A printed number and the computed one.
#[derive(Clone, Debug, PartialEq)]
pub struct PrintedNumber {
    /// Where in the paper.
    pub place: &'static str,
    /// The valence n of the star.
    pub valence: usize,
    /// Which number there.
    pub item: String,
    /// The number in the paper, divided by the common divisor where one is printed.
    pub printed: f64,
    /// The same from our matrix; for c_2 and c_3 from the formula of the paper.
    pub computed: f64,
}

/// A printed mask and its relative distance ‖v − QQᵀv‖/‖v‖ from the computed left eigenspace of λ_2 = λ_3.
#[derive(Clone, Debug, PartialEq)]
pub struct Membership {
    /// Where in the paper.
    pub place: &'static str,
    /// The valence n of the star.
    pub valence: usize,
    /// What the mask is called there, such as `m_2`.
    pub mask: String,
    /// From 0, a member of the eigenspace, to 1, orthogonal to it.
    pub distance: f64,
    /// The same with all edge weights multiplied by A_n.
    pub distance_scaled: f64,
}

/// Which way m_2 × m_3 points, for a star in the plane counter-clockwise in the paper's order: positive is outward.
#[derive(Clone, Debug, PartialEq)]
pub struct MaskOrientation {
    /// Where in the paper.
    pub place: &'static str,
    /// The valence n of the star.
    pub valence: usize,
    /// Whether m_2 and m_3 are those printed or those by the formulas.
    pub masks: &'static str,
    /// m_2 × m_3 over |m_2|·|m_3| on the star e_j = cis(2πj/n), f_j = √2·cis(2π(j−½)/n).
    pub sine: f64,
}

/// All of Thall's local matrices and masks against computed ones.
#[derive(Clone, Debug, PartialEq)]
pub struct ThallTables {
    /// Matrices, eigenvalues, limit masks and tangent masks, number by number.
    pub entries: Vec<PrintedNumber>,
    /// Tangent masks and left eigenvectors at valences 3 and 4.
    pub memberships: Vec<Membership>,
    /// At valences 3 and 4, each as printed and by the formulas.
    pub orientations: Vec<MaskOrientation>,
}

/// §3.1: 16·S at valence 4.
const MATRIX_4: [[f64; 9]; 9] = [
    [9.0, 0.25, 0.25, 0.25, 0.25, 1.5, 1.5, 1.5, 1.5],
    [4.0, 4.0, 0.0, 0.0, 0.0, 4.0, 0.0, 0.0, 4.0],
    [4.0, 0.0, 4.0, 0.0, 0.0, 4.0, 4.0, 0.0, 0.0],
    [4.0, 0.0, 0.0, 4.0, 0.0, 0.0, 4.0, 4.0, 0.0],
    [4.0, 0.0, 0.0, 0.0, 4.0, 0.0, 0.0, 4.0, 4.0],
    [6.0, 1.0, 1.0, 0.0, 0.0, 6.0, 1.0, 0.0, 1.0],
    [6.0, 0.0, 1.0, 1.0, 0.0, 1.0, 6.0, 1.0, 0.0],
    [6.0, 0.0, 0.0, 1.0, 1.0, 0.0, 1.0, 6.0, 1.0],
    [6.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 1.0, 6.0],
];

/// §4: 12·S at valence 3.
const MATRIX_3: [[f64; 7]; 7] = [
    [5.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0, 2.0, 2.0, 2.0],
    [3.0, 3.0, 0.0, 0.0, 3.0, 0.0, 3.0],
    [3.0, 0.0, 3.0, 0.0, 3.0, 3.0, 0.0],
    [3.0, 0.0, 0.0, 3.0, 0.0, 3.0, 3.0],
    [4.5, 0.75, 0.75, 0.0, 4.5, 0.75, 0.75],
    [4.5, 0.0, 0.75, 0.75, 0.75, 4.5, 0.75],
    [4.5, 0.75, 0.0, 0.75, 0.75, 0.75, 4.5],
];

/// Table I: the divisor and the weight of the vertex at valence 3, 4, …; edges weigh 4 and faces 1.
const TABLE_I: [[f64; 2]; 10] = [
    [24.0, 9.0],
    [36.0, 16.0],
    [50.0, 25.0],
    [66.0, 36.0],
    [84.0, 49.0],
    [104.0, 64.0],
    [126.0, 81.0],
    [150.0, 100.0],
    [176.0, 121.0],
    [204.0, 144.0],
];

/// §3.1: l_2 and l_3 found with MATLAB at valence 4.
const MATLAB_4: [[f64; 9]; 2] = [
    [
        0.0,
        -0.02063816984618,
        -0.47936183015382,
        0.02063816984618,
        0.47936183015382,
        -1.0,
        -0.91744732061529,
        1.0,
        0.91744732061529,
    ],
    [
        0.0,
        0.47385759580580,
        -0.02614240419420,
        -0.47385759580580,
        0.02614240419420,
        0.89543038322319,
        -1.0,
        -0.89543038322319,
        1.0,
    ],
];

/// §4: the same at valence 3.
const MATLAB_3: [[f64; 7]; 2] = [
    [
        0.0,
        -0.29639444898437,
        0.16358333275582,
        0.13281111622855,
        -0.34020268834752,
        0.75923003449683,
        -0.41902734614931,
    ],
    [
        0.0,
        -0.10092784247726,
        -0.19137106863820,
        0.29229891111546,
        -0.74873909794875,
        0.25853199878834,
        0.49020709916041,
    ],
];

/// Table III, and m_2, m_3 of §3.1.
const TABLE_III: [[f64; 9]; 2] =
    [[0.0, -1.0, -1.0, 1.0, 1.0, -4.0, 0.0, 4.0, 0.0], [0.0, 1.0, -1.0, -1.0, 1.0, 0.0, -4.0, 0.0, 4.0]];

/// §3.1: the masks quoted from Havemann.
const HAVEMANN: [[f64; 9]; 2] =
    [[0.0, 1.0, 1.0, -1.0, -1.0, 1.0, 0.0, -1.0, 0.0], [0.0, 0.0, 2.0, 0.0, -2.0, 1.0, 1.0, -1.0, -1.0]];

/// Table II, and m_2, m_3 of §4.
fn table_ii() -> [[f64; 7]; 2] {
    let (low, high) = (-1.0 - 17f64.sqrt(), 2.0 + 2.0 * 17f64.sqrt());
    [[0.0, -4.0, 2.0, 2.0, low, high, low], [0.0, 2.0, 2.0, -4.0, high, low, low]]
}

/// §4: λ_2 = λ_3 as printed at valence 3.
const LAMBDA_3: f64 = 0.4109705080055;

/// Computes everything anew and puts it beside what is printed.
///
/// # Errors
/// If eigenvalues do not converge.
pub fn thall_tables() -> Result<ThallTables> {
    let three = Star::new(3)?;
    let four = Star::new(4)?;
    let mut entries = Vec::new();
    three.matrix_entries("§4", &MATRIX_3.map(|row| row.map(|x| x / 12.0)), &mut entries);
    four.matrix_entries("§3.1", &MATRIX_4.map(|row| row.map(|x| x / 16.0)), &mut entries);
    for (place, star, printed) in [("§4", &three, LAMBDA_3), ("§3.1", &four, 0.5)] {
        entries.push(PrintedNumber {
            place,
            valence: star.n,
            item: "λ_2 = λ_3".into(),
            printed,
            computed: star.lambda,
        });
    }
    for (n, [divisor, vertex]) in (3..).zip(TABLE_I) {
        let mask = Star::new(n)?.limit_mask;
        let weights = std::iter::once(vertex).chain(std::iter::repeat_n(1.0, n)).chain(std::iter::repeat_n(4.0, n));
        for (i, weight) in weights.enumerate() {
            entries.push(PrintedNumber {
                place: "Table I",
                valence: n,
                item: format!("l_1[{}]", label(n, i)),
                printed: weight / divisor,
                computed: mask[i],
            });
        }
    }
    mask_entries("Table II", 3, 4.0, &table_ii(), &mut entries);
    mask_entries("Table III", 4, 1.0, &TABLE_III, &mut entries);

    let mut memberships = Vec::new();
    three.memberships("§4", ["l_2", "l_3"], &MATLAB_3, &mut memberships);
    three.memberships("Table II", ["m_2", "m_3"], &table_ii(), &mut memberships);
    four.memberships("§3.1", ["l_2", "l_3"], &MATLAB_4, &mut memberships);
    four.memberships("Table III", ["m_2", "m_3"], &TABLE_III, &mut memberships);
    four.memberships("§3.1", ["Havemann's m_2", "Havemann's m_3"], &HAVEMANN, &mut memberships);

    let formula = |n| [0, 1].map(|shift| formula_mask(n, shift));
    Ok(ThallTables {
        entries,
        memberships,
        orientations: vec![
            orientation("Table II", 3, "printed", &table_ii().map(|m| m.to_vec())),
            orientation("§4", 3, "by the formulas", &formula(3)),
            orientation("Table III", 4, "printed", &TABLE_III.map(|m| m.to_vec())),
            orientation("§3.1", 4, "by the formulas", &formula(4)),
        ],
    })
}

/// A valence, computed, in Thall's order.
struct Star {
    n: usize,
    matrix: DMatrix<f64>,
    lambda: f64,
    limit_mask: Vec<f64>,
    /// The left eigenspace of λ_2 = λ_3.
    left: DMatrix<f64>,
}

impl Star {
    fn new(n: usize) -> Result<Self> {
        let own = SplittingMatrix::new(LocalScheme::CatmullClark, n)?;
        let order: Vec<usize> = (0..=2 * n).map(|i| to_own(n, i)).collect();
        let spaces = own.eigenspaces()?;
        let subdominant = spaces
            .get(1)
            .filter(|s| s.multiplicity() == 2)
            .ok_or_else(|| Error::Computation(format!("valence {n} has no subdominant pair")))?;
        let mask = own.limit_mask()?;
        Ok(Star {
            n,
            matrix: own.entries.select_rows(&order).select_columns(&order),
            lambda: subdominant.value.re,
            limit_mask: order.iter().map(|&i| mask[i]).collect(),
            left: subdominant.left.select_rows(&order),
        })
    }

    fn matrix_entries<const N: usize>(
        &self,
        place: &'static str,
        printed: &[[f64; N]; N],
        entries: &mut Vec<PrintedNumber>,
    ) {
        for (i, row) in printed.iter().enumerate() {
            for (j, &printed) in row.iter().enumerate() {
                entries.push(PrintedNumber {
                    place,
                    valence: self.n,
                    item: format!("S[{}, {}]", label(self.n, i), label(self.n, j)),
                    printed,
                    computed: self.matrix[(i, j)],
                });
            }
        }
    }

    fn memberships<const N: usize>(
        &self,
        place: &'static str,
        names: [&str; 2],
        masks: &[[f64; N]; 2],
        memberships: &mut Vec<Membership>,
    ) {
        let distance = |mask: &[f64]| distance_to_space(&DVector::from_column_slice(mask), &self.left);
        for (name, mask) in names.into_iter().zip(masks) {
            let mut scaled = *mask;
            for weight in &mut scaled[self.n + 1..] {
                *weight *= tangent_constant(self.n);
            }
            memberships.push(Membership {
                place,
                valence: self.n,
                mask: name.to_owned(),
                distance: distance(mask),
                distance_scaled: distance(&scaled),
            });
        }
    }
}

/// The position in our order of Thall's `i`-th: his f_j lies between e_{j−1} and e_j, ours between e_j and e_{j+1}.
fn to_own(n: usize, i: usize) -> usize {
    match i {
        0 => 0,
        _ if i <= n => 1 + n + (i - 1 + n - 1) % n,
        _ => i - n,
    }
}

/// v, f_1, …, e_1, …
fn label(n: usize, i: usize) -> String {
    match i {
        0 => "v".into(),
        _ if i <= n => format!("f_{i}"),
        _ => format!("e_{}", i - n),
    }
}

/// c_2 (shift 0) or c_3 (shift 1) by the paper's formula, in the order of its tables:
/// Σ_j A_n cos(2πj/n) e_{j+shift} + (cos(2πj/n) + cos(2π(j+1)/n)) f_{j+shift}, with e_{j+1} written as e_j.
pub fn formula_mask(n: usize, shift: usize) -> Vec<f64> {
    // The weight of Halstead's e_m or f_m, m = 1…n, has j = m − shift.
    let cosine = |j: usize| (TAU * j as f64 / n as f64).cos();
    let edge = |m: usize| tangent_constant(n) * cosine(m + n - shift);
    let face = |m: usize| cosine(m + n - shift) + cosine(m + n + 1 - shift);
    std::iter::once(0.0).chain((1..=n).map(face)).chain((1..=n).map(|m| edge(m % n + 1))).collect()
}

fn mask_entries<const N: usize>(
    place: &'static str,
    n: usize,
    scale: f64,
    printed: &[[f64; N]; 2],
    entries: &mut Vec<PrintedNumber>,
) {
    for (shift, mask) in printed.iter().enumerate() {
        for (i, (&printed, computed)) in mask.iter().zip(formula_mask(n, shift)).enumerate().skip(1) {
            entries.push(PrintedNumber {
                place,
                valence: n,
                item: format!("c_{}[{}]", shift + 2, label(n, i)),
                printed,
                computed: scale * computed,
            });
        }
    }
}

fn orientation(place: &'static str, n: usize, masks: &'static str, [first, second]: &[Vec<f64>; 2]) -> MaskOrientation {
    let angle = |turns: f64| DVec2::from_angle(TAU * turns / n as f64);
    let point = |i: usize| match i {
        0 => DVec2::ZERO,
        _ if i <= n => 2f64.sqrt() * angle(i as f64 - 0.5),
        _ => angle((i - n) as f64),
    };
    let apply = |mask: &[f64]| -> DVec2 { mask.iter().enumerate().map(|(i, &w)| w * point(i)).sum() };
    let (a, b) = (apply(first), apply(second));
    MaskOrientation { place, valence: n, masks, sine: a.perp_dot(b) / (a.length() * b.length()) }
}
