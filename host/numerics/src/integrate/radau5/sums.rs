//! Sums over the stages of a step.

/// The collocation polynomial at the share `s` of the step after its end (negative inside it), less its value there.
pub(super) fn rise<const S: usize>(c: &[f64; S], polynomial: &[Vec<f64>; S], k: usize, s: f64) -> f64 {
    let mut sum = polynomial[S - 1][k];
    for i in (0..S - 1).rev() {
        sum = polynomial[i][k] + (s - (c[S - 2 - i] - 1.0)) * sum;
    }
    s * sum
}

/// `out_i := sum_j matrix_ij vectors_j`
pub(super) fn transform<const S: usize>(matrix: &[[f64; S]; S], vectors: &[Vec<f64>; S], out: &mut [Vec<f64>; S]) {
    let [first, rest @ ..] = &vectors[..] else { return };
    for (row, out) in matrix.iter().zip(out) {
        out.iter_mut().zip(first).for_each(|(sum, number)| *sum = row[0] * number);
        for (factor, vector) in row[1..].iter().zip(rest) {
            out.iter_mut().zip(vector).for_each(|(sum, number)| *sum += factor * number);
        }
    }
}

/// The sum of products, from the first on.
#[inline]
pub(super) fn product<const S: usize>(row: &[f64; S], numbers: &[f64; S]) -> f64 {
    (1..S).fold(row[0] * numbers[0], |sum, i| sum + row[i] * numbers[i])
}
