//! Sums over the stages of a step, and the polynomial through it, several entries of the state at a time.

use super::pair::Row;

/// `out := y + h sum_j a_j k_j`; without `y`, the sum alone. Each entry has its terms added in the order of the row, however many
/// entries are summed side by side.
pub(super) fn combine(row: Row, stages: &[f64], h: f64, y: Option<&[f64]>, out: &mut [f64]) {
    /// One function for each of the lengths.
    macro_rules! by_length {
        ($($n:literal)*) => {
            match out.len() {
                $($n => combine_few::<$n>(row, stages, h, y, out),)*
                _ => combine_many(row, stages, h, y, out),
            }
        };
    }
    by_length!(1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16)
}

/// The same for as many entries as stay in the processor's registers.
fn combine_few<const N: usize>(row: Row, stages: &[f64], h: f64, y: Option<&[f64]>, out: &mut [f64]) {
    let (stages, _) = stages.as_chunks::<N>();
    let out = out.as_mut_array::<N>().expect("chosen by the length");
    let mut sums = y.map_or([0.0; N], |y| *y.as_array().expect("as many as there are sums"));
    for &(j, coefficient) in row {
        let (factor, stage) = (h * coefficient, &stages[j]);
        for k in 0..N {
            sums[k] += factor * stage[k];
        }
    }
    *out = sums;
}

/// The same for more entries than that: blocks, the last one summed with some of the entries before once more.
fn combine_many(row: Row, stages: &[f64], h: f64, y: Option<&[f64]>, out: &mut [f64]) {
    let n = out.len();
    for at in (0..n).step_by(16) {
        if n - at > 8 {
            combine_block::<16>(row, (stages, n), h, y, out, at.min(n - 16));
        } else {
            combine_block::<8>(row, (stages, n), h, y, out, n - 8);
        }
    }
}

/// The same for so many entries from `at` on; stages have `n` entries each.
#[inline]
fn combine_block<const N: usize>(
    row: Row,
    (stages, n): (&[f64], usize),
    h: f64,
    y: Option<&[f64]>,
    out: &mut [f64],
    at: usize,
) {
    let mut sums = y.map_or([0.0; N], |y| *y[at..].first_chunk().expect("as many as there are sums"));
    let stages = &stages[at..];
    for &(j, coefficient) in row {
        let factor = h * coefficient;
        let stage: &[f64; N] = stages[j * n..].first_chunk().expect("stages have the entries of the state");
        for k in 0..N {
            sums[k] += factor * stage[k];
        }
    }
    out[at..at + N].copy_from_slice(&sums);
}

/// Evaluates the polynomial of `Explicit::prepare_interpolation`, of so many coefficients, at the share `s` of the step.
pub(super) fn interpolate(polynomial: &[f64], coefficients: usize, s: f64, out: &mut [f64]) {
    match out.len() {
        0 => {}
        1 => interpolate_lanes::<1>(polynomial, coefficients, s, out),
        2 => interpolate_lanes::<2>(polynomial, coefficients, s, out),
        3 => interpolate_lanes::<3>(polynomial, coefficients, s, out),
        4 => interpolate_lanes::<4>(polynomial, coefficients, s, out),
        5 => interpolate_lanes::<5>(polynomial, coefficients, s, out),
        6 => interpolate_lanes::<6>(polynomial, coefficients, s, out),
        7 => interpolate_lanes::<7>(polynomial, coefficients, s, out),
        _ => interpolate_lanes::<8>(polynomial, coefficients, s, out),
    }
}

/// The same, so many entries at a time.
fn interpolate_lanes<const N: usize>(polynomial: &[f64], coefficients: usize, s: f64, out: &mut [f64]) {
    let n = out.len();
    for at in (0..n).step_by(N) {
        let at = at.min(n - N);
        let mut sums = [0.0; N];
        // Factors alternate: s outside odd coefficients, 1 - s outside even ones, and none outside the first.
        let (mut factor, mut other) = if coefficients.is_multiple_of(2) { (s, 1.0 - s) } else { (1.0 - s, s) };
        let mut lines = polynomial[..coefficients * n].chunks_exact(n);
        let Some(first) = lines.next() else { return };
        let line =
            |line: &[f64]| -> [f64; N] { *line[at..].first_chunk().expect("lines have the entries of the state") };
        for coefficients in lines.rev().map(line) {
            for k in 0..N {
                sums[k] = factor * (coefficients[k] + sums[k]);
            }
            (factor, other) = (other, factor);
        }
        let first = line(first);
        for k in 0..N {
            out[at + k] = first[k] + sums[k];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrate::dop853::PAIR;

    /// Numbers of many sizes.
    fn numbers(count: usize) -> Vec<f64> {
        (0..count).map(|k| (k as f64 * 0.7 + 0.3).sin() * 10.0_f64.powi(k as i32 % 7 - 3)).collect()
    }

    #[test]
    fn every_number_of_entries_gives_the_sums_of_one_after_the_other() {
        let row = PAIR.a[PAIR.a.len() - 1];
        for n in 1..40 {
            let (stages, y) = (numbers(16 * n), numbers(n));
            for start in [None, Some(&y[..])] {
                let mut found = vec![f64::NAN; n];
                combine(row, &stages, 0.37, start, &mut found);
                for (k, found) in found.iter().enumerate() {
                    let start = start.map_or(0.0, |y| y[k]);
                    let sum = row.iter().fold(start, |sum, (j, a)| sum + (0.37 * a) * stages[j * n + k]);
                    assert_eq!(found.to_bits(), sum.to_bits(), "entry {k} of {n}");
                }
            }
        }
    }

    #[test]
    fn every_number_of_entries_gives_the_polynomial_of_one() {
        for (n, coefficients) in (1..20).flat_map(|n| (1..9).map(move |coefficients| (n, coefficients))) {
            let (polynomial, s) = (numbers(coefficients * n), 0.3);
            let mut found = vec![f64::NAN; n];
            interpolate(&polynomial, coefficients, s, &mut found);
            for (k, found) in found.iter().enumerate() {
                let mut sum = 0.0;
                for c in (0..coefficients).rev() {
                    let factor = [1.0 - s, s][c % 2];
                    sum = if c == 0 { 1.0 } else { factor } * (polynomial[c * n + k] + sum);
                }
                assert_eq!(found.to_bits(), sum.to_bits(), "entry {k} of {n}");
            }
        }
    }
}
