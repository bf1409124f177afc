//! Products of the small symmetric matrices of elements with points.
//!
//! They are compiled for what processors may have, and chosen when the program runs: four numbers at once (AVX2) take half the
//! time of two, which all x86-64 have. No multiplication is fused with a sum, so that results are the same on all.

use pulp::{Simd, bytemuck};

/// Rows of a matrix are filled up to a multiple of this: the most numbers that a processor of any kind takes at once.
const LANES: usize = 8;

/// Numbers of a row of a matrix.
pub(super) fn stride(points: usize) -> usize {
    points.next_multiple_of(LANES)
}

/// Adds K x of one element with the points x: some rows at once, by columns, the matrix being symmetric.
#[inline(always)]
pub(super) fn product<S: Simd>(simd: S, form: &[f64], own: &[[f64; 3]], places: &[u16], sums: &mut [[f64; 3]]) {
    let (registers, _) = S::as_simd_f64s(form);
    let mut rows = places.chunks(S::F64_LANES);
    let mut first = 0;
    // Two registers of each coordinate, so that no sum need wait for the one before it.
    while let Some(one) = rows.next() {
        if let Some(other) = rows.next() {
            let [part, next] = of_rows(simd, registers, first, own);
            scatter(simd, part, one, sums);
            scatter(simd, next, other, sums);
        } else {
            let [part] = of_rows(simd, registers, first, own);
            scatter(simd, part, one, sums);
        }
        first += 2;
    }
}

/// What R registers of rows from the `first` on give.
#[inline(always)]
fn of_rows<S: Simd, const R: usize>(
    simd: S,
    registers: &[S::f64s],
    first: usize,
    own: &[[f64; 3]],
) -> [[S::f64s; 3]; R] {
    let mut sums = [[simd.splat_f64s(0.0); 3]; R];
    for (column, x) in registers.chunks_exact(stride(own.len()) / S::F64_LANES).zip(own) {
        let column = &column[first..first + R];
        let x = [simd.splat_f64s(x[0]), simd.splat_f64s(x[1]), simd.splat_f64s(x[2])];
        for r in 0..R {
            for axis in 0..3 {
                sums[r][axis] = simd.add_f64s(sums[r][axis], simd.mul_f64s(column[r], x[axis]));
            }
        }
    }
    sums
}

#[inline(always)]
fn scatter<S: Simd>(_: S, part: [S::f64s; 3], places: &[u16], sums: &mut [[f64; 3]]) {
    let part: [&[f64]; 3] = std::array::from_fn(|axis| bytemuck::cast_slice(std::slice::from_ref(&part[axis])));
    for (lane, &place) in places.iter().enumerate() {
        let y = &mut sums[place as usize];
        for axis in 0..3 {
            y[axis] += part[axis][lane];
        }
    }
}

#[cfg(test)]
mod tests {
    use pulp::{Arch, Scalar, WithSimd};

    use super::super::Kind;
    use super::*;

    struct One<'a>(&'a [f64], &'a [[f64; 3]], &'a [u16], &'a mut [[f64; 3]]);

    impl WithSimd for One<'_> {
        type Output = ();

        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) {
            product(simd, self.0, self.1, self.2, self.3);
        }
    }

    #[test]
    fn products_have_the_same_bits_by_all_instructions() {
        for points in [1, 3, 4, 5, 8, 13, 16, 25, 33] {
            let entry = |i: usize, j: usize| ((7 * i.min(j) + 3 * i.max(j)) as f64).sin();
            let kind = Kind::new(points, |i, j| [entry(i, j), 0.0]);
            let own: Vec<[f64; 3]> = (0..points).map(|i| [0.3, 1.7, 2.9].map(|a| (a * i as f64).cos())).collect();
            let places: Vec<u16> = (0..points as u16).rev().collect();
            let mut expected = vec![[1.0; 3]; points];
            for (i, &place) in places.iter().enumerate() {
                for axis in 0..3 {
                    expected[place as usize][axis] += (0..points).fold(0.0, |sum, j| sum + entry(i, j) * own[j][axis]);
                }
            }
            let (mut one_by_one, mut at_hand) = (vec![[1.0; 3]; points], vec![[1.0; 3]; points]);
            One(&kind.forms[0], &own, &places, &mut one_by_one).with_simd(Scalar);
            Arch::new().dispatch(One(&kind.forms[0], &own, &places, &mut at_hand));
            assert_eq!(one_by_one, expected, "{points}");
            assert_eq!(at_hand, expected, "{points}");
        }
    }
}
