//! What the paper on progressive interpolation says on its way (P18–P20).

use limitlab_factorizations::dense::small_eigenvalues;
use nalgebra::{Complex, DMatrix};

use limitlab::Result;
use limitlab::schemes::Scheme;
use limitlab::solvers::Method;

use super::Claim;
use super::finding::{Evidence, Finding};
use super::lab::{Lab, each, entries_per_vertex, iterations, largest, random_points, smallest};

pub const CLAIMS: &[Claim] = &[
    Claim {
        id: "P18",
        title: "Lemma 1: AB has positive eigenvalues if A and B are positive definite",
        place: "§2.1, Lemma 1",
        printed: "If A and B are positive definite, the eigenvalues of AB are positive.",
        slow: false,
        check: products,
    },
    Claim {
        id: "P19",
        title: "Property (3): zeros of B are symmetric",
        place: "§2.1",
        printed: "If a_ij = 0, then a_ji = 0.",
        slow: false,
        check: symmetric_zeros,
    },
    Claim {
        id: "P20",
        title: "The method is much simpler than that with nearest points",
        place: "§2",
        printed: "The method is much simpler than the algorithm of [1], which needs a complicated shortest point computation.",
        slow: false,
        check: simpler,
    },
];

fn products(_: &Lab) -> Result<Finding> {
    const SIZE: usize = 24;
    /// Numbers between −1 and 1.
    fn random(seed: u64) -> DMatrix<f64> {
        let numbers = random_points(SIZE * SIZE / 3, seed);
        DMatrix::from_iterator(SIZE, SIZE, numbers.iter().flat_map(|p| p.to_array()))
    }
    fn eigenvalues(m: &DMatrix<f64>) -> Vec<Complex<f64>> {
        small_eigenvalues(m.clone(), f64::EPSILON, 0).expect("iterations without end")
    }
    let (mut least, mut imaginary, mut general) = (f64::INFINITY, 0.0f64, f64::INFINITY);
    for seed in 0..100 {
        let definite = |seed| -> DMatrix<f64> {
            let half: DMatrix<f64> = random(seed);
            let product: DMatrix<f64> = &half * half.transpose();
            product + DMatrix::<f64>::identity(SIZE, SIZE) * 0.1
        };
        let (a, b): (DMatrix<f64>, DMatrix<f64>) = (definite(2 * seed), definite(2 * seed + 1));
        let product: DMatrix<f64> = &a * &b;
        let found = eigenvalues(&product);
        let size = largest(found.iter().map(|z| z.norm()));
        least = smallest([least, smallest(found.iter().map(|z| z.re)) / size]);
        imaginary = largest([imaginary, largest(found.iter().map(|z| z.im.abs())) / size]);
        // Positive definite, but not symmetric: xᵀAx > 0 is not enough.
        let half: DMatrix<f64> = random(1000 + seed);
        let skew: DMatrix<f64> = &half - half.transpose();
        let turned: DMatrix<f64> = &a + skew * 50.0;
        let square: DMatrix<f64> = &turned * &turned;
        general = smallest([general, smallest(eigenvalues(&square).iter().map(|z| z.re)) / size]);
    }
    Ok(Finding::reproduced(vec![
        Evidence::above("smallest real part over the largest modulus, 100 pairs of symmetric matrices of order 24", least, 0.0),
        Evidence::at_most("largest imaginary part over the largest modulus", imaginary, 1e-10),
        Evidence::below("smallest real part where A = B is not symmetric, xᵀAx > 0", general, 0.0),
    ])
    .remark(
        "AB is similar to A^½BA^½, which is symmetric and positive definite. The lemma, which does not say it, needs symmetric \
         matrices, as D and S are.",
    ))
}

fn symmetric_zeros(lab: &Lab) -> Result<Finding> {
    let rows = each(lab.triangles(), |subject| {
        let b = subject.system(Scheme::Loop)?.a;
        let (mut one_sided, mut unequal) = (0, 0.0f64);
        for i in 0..b.len() {
            for (j, value) in b.row(i).filter(|(_, value)| *value != 0.0) {
                one_sided += usize::from(b.get(j, i) == 0.0);
                unequal = largest([unequal, (value - b.get(j, i)).abs()]);
            }
        }
        Ok((one_sided, unequal))
    })?;
    Ok(Finding::reproduced(vec![
        Evidence::equal(
            "entries with a zero across the diagonal, random triangle meshes",
            rows.iter().map(|r| r.0).sum::<usize>(),
            0.0,
        ),
        Evidence::above(
            "largest difference of two entries across: B itself is not symmetric",
            largest(rows.iter().map(|r| r.1)),
            0.01,
        ),
    ]))
}

fn simpler(lab: &Lab) -> Result<Finding> {
    let subject = lab.context.stand_in("icosphere:3")?;
    let system = subject.system(Scheme::Loop)?;
    let count = |tolerance| iterations(&system, &subject, Method::Pia, tolerance).unwrap_or(usize::MAX);
    Ok(Finding::not_decided(
        vec![
            Evidence::shown("coefficients a vertex in a step, icosphere:3", entries_per_vertex(&system)),
            Evidence::shown("steps to 10⁻³ L", count(1e-3)),
            Evidence::shown("steps to 10⁻⁶ L", count(1e-6)),
        ],
        "A step here is one product with B. What a step of [1] takes, its search for the nearest point and its local adjusting, \
         is not described in the paper, and [1] is not at hand: simplicity has no number to be compared with.",
    ))
}
