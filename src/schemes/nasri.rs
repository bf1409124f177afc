//! Nasri's system: Doo-Sabin with its own first step, on any closed polygon mesh (Nasri 1987; Zheng-Cai §2).

use super::Refinement;
use super::doo_sabin::CornerRule;
use super::scheme::{Circulant, Definition, PaperNames, QUADRATIC, SingularSet};

/// h(n) = 1/n; a face of m corners adds the circulant of Doo-Sabin's corner rule: ¼ on its diagonal,
/// ¾/m + ½cos(2πk/m)/m between corners k steps apart.
///
/// The circulants have the eigenvalues 1, ½, ½, ¼, …, so λ_min(A) ≥ ¼, and ½ where all faces are triangles.
pub(super) const DEFINITION: Definition = Definition {
    name: "nasri",
    paper_names: PaperNames { system: "[C]", ..PaperNames::OURS },
    h: |n| 1.0 / n as f64,
    vertex_weight: |_| 0.0,
    edge_weight: 0.0,
    circulant: Some(|m| Circulant { identity: 0.25, constant: 0.75 / m, cosine: 0.5 / m }),
    needs_triangles: false,
    lambda_min_at: |_, triangles_only| if triangles_only { 0.5 } else { 0.25 },
    usual_lambda_min: 0.25,
    singular: SingularSet::Never,
    regular_symbol: (0.25, 9.0 / 16.0),
    refinement: Refinement::DooSabin,
    first_rule: Some(CornerRule::DooSabin),
    curve_weight: QUADRATIC,
    star_rule: None,
};
