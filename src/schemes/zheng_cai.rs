//! Zheng and Cai's system: Doo-Sabin after a first step that moves corners half-way to the centroid of their face (Zheng
//! & Cai 2005, Eq. 4 and 6), on any closed polygon mesh.

use super::Refinement;
use super::doo_sabin::CornerRule;
use super::scheme::{Circulant, Definition, PaperNames, QUADRATIC, SingularSet};

/// h(n) = 1/(2n), d(n) = n; a face of m corners adds 1/m between all of them.
///
/// The faces' part of M is semidefinite, so λ_min(A) ≥ ½; A is diagonally dominant.
pub(super) const DEFINITION: Definition = Definition {
    name: "zheng-cai",
    paper_names: PaperNames::OURS,
    h: |n| 0.5 / n as f64,
    vertex_weight: |n| n as f64,
    edge_weight: 0.0,
    circulant: Some(|m| Circulant { identity: 0.0, constant: 1.0 / m, cosine: 0.0 }),
    needs_triangles: false,
    lambda_min_at: |_, _| 0.5,
    usual_lambda_min: 0.5,
    singular: SingularSet::Never,
    regular_symbol: (0.5, 0.625),
    refinement: Refinement::DooSabin,
    first_rule: Some(CornerRule::ZhengCai),
    curve_weight: QUADRATIC,
    star_rule: None,
};
