//! Sums over the stages of a step, and the polynomial through it, several entries of the state at a time.

#![allow(
    unsafe_code,
    reason = "the only way to call what is compiled for a wider vector unit; the uses say why they hold"
)]

use super::pair::Row;

/// Lengths of vectors are made up to a multiple of this, with entries that are zero: whole vectors of the widest unit in use.
const LANES: usize = 4;

/// The length of a vector of so many entries, made up to whole lanes.
pub(super) fn whole_lanes(entries: usize) -> usize {
    entries.next_multiple_of(LANES)
}

/// `out := y + h sum_j a_j k_j`; without `y`, the sum alone. All vectors have whole lanes ([`whole_lanes`]). Each entry has its
/// terms added in the order of the row, however many entries are summed side by side.
#[inline(always)]
pub(super) fn combine(row: Row, stages: &[f64], h: f64, y: Option<&[f64]>, out: &mut [f64]) {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") {
        // SAFETY: this machine has what the function was compiled for.
        return unsafe { wide::combine(row, stages, h, y, out) };
    }
    combine_in_lanes(row, stages, h, y, out);
}

#[inline(always)]
fn combine_in_lanes(row: Row, stages: &[f64], h: f64, y: Option<&[f64]>, out: &mut [f64]) {
    /// One function for each of the lengths whose sums stay in the processor's registers.
    macro_rules! by_length {
        ($($n:literal)*) => {
            match out.len() {
                $($n => combine_block::<$n>(row, (stages, $n), h, y, out, 0),)*
                n => {
                    for at in (0..n).step_by(16) {
                        match n - at {
                            4 => combine_block::<4>(row, (stages, n), h, y, out, at),
                            8 => combine_block::<8>(row, (stages, n), h, y, out, at),
                            12 => combine_block::<12>(row, (stages, n), h, y, out, at),
                            _ => combine_block::<16>(row, (stages, n), h, y, out, at),
                        }
                    }
                }
            }
        };
    }
    by_length!(4 8 12 16 20 24)
}

/// Where sums without a state start.
static ZEROS: [f64; 24] = [0.0; 24];

/// The same for so many entries from `at` on; stages have `n` entries each.
#[inline(always)]
fn combine_block<const N: usize>(
    row: Row,
    (stages, n): (&[f64], usize),
    h: f64,
    y: Option<&[f64]>,
    out: &mut [f64],
    at: usize,
) {
    // One load of whole lanes.
    let start = y.map_or(&ZEROS[..], |y| &y[at..]);
    let mut sums: [f64; N] = *start.first_chunk().expect("as many as there are sums");
    let stages = &stages[at..];
    for &(j, coefficient) in row {
        let factor = h * coefficient;
        let stage: &[f64; N] = stages[j * n..].first_chunk().expect("stages have the entries of the state");
        for k in 0..N {
            sums[k] += factor * stage[k];
        }
    }
    *out[at..].first_chunk_mut().expect("as many as there are sums") = sums;
}

/// Evaluates the polynomial of `Explicit::prepare_interpolation`, of so many coefficients in whole lanes, at the share `s` of the
/// step.
pub(super) fn interpolate(polynomial: &[f64], coefficients: usize, s: f64, out: &mut [f64]) {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") {
        // SAFETY: this machine has what the function was compiled for.
        return unsafe { wide::interpolate(polynomial, coefficients, s, out) };
    }
    interpolate_in_lanes(polynomial, coefficients, s, out);
}

#[inline(always)]
fn interpolate_in_lanes(polynomial: &[f64], coefficients: usize, s: f64, out: &mut [f64]) {
    let n = whole_lanes(out.len());
    for at in (0..n).step_by(16) {
        match n - at {
            4 => interpolate_block::<4>(polynomial, coefficients, s, (out, n), at),
            8 => interpolate_block::<8>(polynomial, coefficients, s, (out, n), at),
            12 => interpolate_block::<12>(polynomial, coefficients, s, (out, n), at),
            _ => interpolate_block::<16>(polynomial, coefficients, s, (out, n), at),
        }
    }
}

/// The same for so many entries from `at` on; coefficients have `n` entries each.
#[inline(always)]
fn interpolate_block<const N: usize>(
    polynomial: &[f64],
    coefficients: usize,
    s: f64,
    (out, n): (&mut [f64], usize),
    at: usize,
) {
    let mut sums = [0.0; N];
    // Factors alternate: s outside odd coefficients, 1 - s outside even ones, and none outside the first.
    let (mut factor, mut other) = if coefficients.is_multiple_of(2) { (s, 1.0 - s) } else { (1.0 - s, s) };
    let mut lines = polynomial[..coefficients * n].chunks_exact(n);
    let Some(first) = lines.next() else { return };
    let line = |line: &[f64]| -> [f64; N] { *line[at..].first_chunk().expect("lines have the entries of the state") };
    for coefficients in lines.rev().map(line) {
        for k in 0..N {
            sums[k] = factor * (coefficients[k] + sums[k]);
        }
        (factor, other) = (other, factor);
    }
    let first = line(first);
    for k in 0..N {
        sums[k] += first[k];
    }
    let out = &mut out[at..];
    match out.first_chunk_mut::<N>() {
        Some(out) => *out = sums,
        None => out.iter_mut().zip(sums).for_each(|(out, sum)| *out = sum),
    }
}

/// The same in vectors of four numbers, whole ones throughout: of what is written for any processor the compiler splits some.
#[cfg(target_arch = "x86_64")]
mod wide {
    use std::arch::x86_64::{
        __m256d, _mm256_add_pd, _mm256_loadu_pd, _mm256_mul_pd, _mm256_set1_pd, _mm256_setzero_pd, _mm256_storeu_pd,
    };

    use super::{LANES, Row, interpolate_in_lanes, whole_lanes};

    #[inline]
    #[target_feature(enable = "avx2")]
    fn load(numbers: &[f64; LANES]) -> __m256d {
        // SAFETY: as many numbers are read as a vector has.
        unsafe { _mm256_loadu_pd(numbers.as_ptr()) }
    }

    #[inline]
    #[target_feature(enable = "avx2")]
    fn store(vector: __m256d, numbers: &mut [f64; LANES]) {
        // SAFETY: as many numbers are written as a vector has.
        unsafe { _mm256_storeu_pd(numbers.as_mut_ptr(), vector) };
    }

    #[inline]
    #[target_feature(enable = "avx2")]
    pub(super) fn combine(row: Row, stages: &[f64], h: f64, y: Option<&[f64]>, out: &mut [f64]) {
        match out.len() {
            4 => combine_all::<4, 1>(row, stages, h, y, out),
            8 => combine_all::<8, 2>(row, stages, h, y, out),
            12 => combine_all::<12, 3>(row, stages, h, y, out),
            16 => combine_all::<16, 4>(row, stages, h, y, out),
            20 => combine_all::<20, 5>(row, stages, h, y, out),
            24 => combine_all::<24, 6>(row, stages, h, y, out),
            _ => combine_parts(row, stages, h, y, out),
        }
    }

    /// Sixteen entries at a time, then the rest.
    #[inline(never)]
    #[target_feature(enable = "avx2")]
    fn combine_parts(row: Row, stages: &[f64], h: f64, y: Option<&[f64]>, out: &mut [f64]) {
        let n = out.len();
        for at in (0..n).step_by(16) {
            let (y, out) = (y.map(|y| &y[at..]), &mut out[at..]);
            let stage = |j: usize| &stages[j * n + at..];
            match n - at {
                4 => combine_block::<4, 1>(row, first(stage), h, y, out),
                8 => combine_block::<8, 2>(row, first(stage), h, y, out),
                12 => combine_block::<12, 3>(row, first(stage), h, y, out),
                _ => combine_block::<16, 4>(row, first(stage), h, y, out),
            }
        }
    }

    /// The first N entries of what is given.
    #[inline(always)]
    fn first<'s, const N: usize>(from: impl Fn(usize) -> &'s [f64]) -> impl Fn(usize) -> &'s [f64; N] {
        move |j| from(j).first_chunk().expect("stages have the entries of the state")
    }

    /// For N entries in all, in V vectors.
    #[inline(never)]
    #[target_feature(enable = "avx2")]
    fn combine_all<const N: usize, const V: usize>(
        row: Row,
        stages: &[f64],
        h: f64,
        y: Option<&[f64]>,
        out: &mut [f64],
    ) {
        let stages = stages.as_chunks::<N>().0;
        combine_block::<N, V>(row, |j| &stages[j], h, y, out);
    }

    /// For the first N entries, in V vectors.
    #[inline]
    #[target_feature(enable = "avx2")]
    fn combine_block<'s, const N: usize, const V: usize>(
        row: Row,
        stage: impl Fn(usize) -> &'s [f64; N],
        h: f64,
        y: Option<&[f64]>,
        out: &mut [f64],
    ) {
        const { assert!(N == LANES * V) };
        let mut sums = [_mm256_setzero_pd(); V];
        if let Some(y) = y {
            let y: &[f64; N] = y.first_chunk().expect("as many as there are sums");
            for (sum, y) in sums.iter_mut().zip(y.as_chunks().0) {
                *sum = load(y);
            }
        }
        for &(j, coefficient) in row {
            let factor = _mm256_set1_pd(h * coefficient);
            for (sum, stage) in sums.iter_mut().zip(stage(j).as_chunks().0) {
                *sum = _mm256_add_pd(*sum, _mm256_mul_pd(factor, load(stage)));
            }
        }
        let out: &mut [f64; N] = out.first_chunk_mut().expect("as many as there are sums");
        for (out, sum) in out.as_chunks_mut().0.iter_mut().zip(sums) {
            store(sum, out);
        }
    }

    /// Longer ones lose more at each vector than the compiler does at the last.
    #[inline(never)]
    #[target_feature(enable = "avx2")]
    fn interpolate_long(polynomial: &[f64], coefficients: usize, s: f64, out: &mut [f64]) {
        interpolate_in_lanes(polynomial, coefficients, s, out);
    }

    /// One vector here, more of them there.
    #[target_feature(enable = "avx2")]
    pub(super) fn interpolate(polynomial: &[f64], coefficients: usize, s: f64, out: &mut [f64]) {
        if whole_lanes(out.len()) != LANES {
            return interpolate_long(polynomial, coefficients, s, out);
        }
        let Some((first, rest)) = polynomial.as_chunks().0[..coefficients].split_first() else { return };
        let (s, other) = (_mm256_set1_pd(s), _mm256_set1_pd(1.0 - s));
        // As in `interpolate_block`.
        let (mut factor, mut next) = if coefficients.is_multiple_of(2) { (s, other) } else { (other, s) };
        let mut sums = _mm256_setzero_pd();
        for line in rest.iter().rev() {
            sums = _mm256_mul_pd(factor, _mm256_add_pd(load(line), sums));
            (factor, next) = (next, factor);
        }
        sums = _mm256_add_pd(sums, load(first));
        if let Some(out) = out.first_chunk_mut() {
            return store(sums, out);
        }
        let mut numbers = [0.0; LANES];
        store(sums, &mut numbers);
        // One by one: a call that copies them costs more.
        match out {
            [a, b, c] => [*a, *b, *c, _] = numbers,
            [a, b] => [*a, *b, ..] = numbers,
            [a] => [*a, ..] = numbers,
            _ => {}
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

    /// Vectors of n entries, made up to whole lanes.
    fn vectors(count: usize, n: usize) -> Vec<f64> {
        let numbers = numbers(count * n);
        let mut vectors = vec![0.0; count * whole_lanes(n)];
        for (vector, entries) in vectors.chunks_exact_mut(whole_lanes(n)).zip(numbers.chunks_exact(n)) {
            vector[..n].copy_from_slice(entries);
        }
        vectors
    }

    #[test]
    fn every_number_of_entries_gives_the_sums_of_one_after_the_other() {
        let row = PAIR.a[PAIR.a.len() - 1];
        for n in 1..80 {
            let (stages, y, whole) = (vectors(16, n), vectors(1, n), whole_lanes(n));
            for start in [None, Some(&y[..])] {
                let ways = [combine, combine_in_lanes as fn(Row, &[f64], f64, Option<&[f64]>, &mut [f64])];
                for (way, combine) in ways.iter().enumerate() {
                    let mut found = vec![f64::NAN; whole];
                    combine(row, &stages, 0.37, start, &mut found);
                    for (k, found) in found.iter().enumerate() {
                        let start = start.map_or(0.0, |y| y[k]);
                        let sum = row.iter().fold(start, |sum, (j, a)| sum + (0.37 * a) * stages[j * whole + k]);
                        assert_eq!(found.to_bits(), sum.to_bits(), "entry {k} of {n}, way {way}");
                    }
                }
            }
        }
    }

    #[test]
    fn every_number_of_entries_gives_the_polynomial_of_one() {
        for (n, coefficients) in (1..40).flat_map(|n| (1..9).map(move |coefficients| (n, coefficients))) {
            let (polynomial, s, whole) = (vectors(coefficients, n), 0.3, whole_lanes(n));
            let ways = [interpolate, interpolate_in_lanes as fn(&[f64], usize, f64, &mut [f64])];
            for (way, interpolate) in ways.iter().enumerate() {
                let mut found = vec![f64::NAN; n];
                interpolate(&polynomial, coefficients, s, &mut found);
                for (k, found) in found.iter().enumerate() {
                    let mut sum = 0.0;
                    for c in (0..coefficients).rev() {
                        let factor = [1.0 - s, s][c % 2];
                        sum = if c == 0 { 1.0 } else { factor } * (polynomial[c * whole + k] + sum);
                    }
                    assert_eq!(found.to_bits(), sum.to_bits(), "entry {k} of {n}, way {way}");
                }
            }
        }
    }
}
