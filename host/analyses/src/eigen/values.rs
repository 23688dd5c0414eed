//! [`eigenvalues`] of a real matrix, by the double-shift QR iteration.

use std::ops::Range;

use nalgebra::{Complex, DMatrix};

/// Sweeps, per row: one or two as a rule, some ten where pairs that nearly coincide lie beside others millions of times as large.
const MOST_SWEEPS: usize = 200;
/// After so many without an eigenvalue, a sweep has other shifts.
const PATIENCE: usize = 10;
/// Reflections that what is far from the diagonal takes at once, and how many columns do so side by side.
const TOGETHER: usize = 32;
const ABREAST: usize = 8;

/// The eigenvalues of a matrix in Hessenberg's form, of conjugates both; `None` where they are not found.
///
/// Francis' iteration (Golub & Van Loan, "Matrix Computations", 4th ed. 2013, section 7.5) with the shifts of EISPACK's `hqr` and LAPACK's
/// `dlahqr`: those of the last two rows, and now and then exceptional ones. Without these, matrices whose eigenvalues stand in a ring about
/// zero are turned round and round: what stands upright and turns has a, -a and their conjugates, and shifts that see their squares only.
pub(super) fn eigenvalues(mut form: DMatrix<f64>) -> Option<Vec<Complex<f64>>> {
    let mut found = Vec::with_capacity(form.nrows());
    let mut left = MOST_SWEEPS * form.nrows();
    let (mut rows, mut sweeps) = (form.nrows(), 0);
    while rows > 0 {
        let last = rows - 1;
        let first = (1..rows).rev().find(|k| is_parted(&form, *k, last)).unwrap_or(0);
        if last - first > 1 {
            sweeps += 1;
            left = left.checked_sub(1)?;
            let shifts = if sweeps % PATIENCE == 0 {
                let from = if sweeps % (2 * PATIENCE) == 0 { last - 2 } else { first };
                Shifts::exceptional(&form, from)
            } else {
                Shifts::of(&form, last - 1)
            };
            sweep(&mut form, first, last, &shifts);
            continue;
        }
        if first == last {
            found.push(Complex::new(form[(last, last)], 0.0));
        } else {
            found.extend(Shifts::of(&form, first).values());
        }
        (rows, sweeps) = (first, 0);
    }
    Some(found)
}

/// Whether the entry beside the diagonal between row `k` and the one before is round-off.
fn is_parted(form: &DMatrix<f64>, k: usize, last: usize) -> bool {
    let beside = |row: usize| form[(row, row - 1)].abs();
    let mut size = form[(k - 1, k - 1)].abs() + form[(k, k)].abs();
    if size == 0.0 {
        size = if k > 1 { beside(k - 1) } else { 0.0 } + if k < last { beside(k + 1) } else { 0.0 };
    }
    beside(k) <= f64::EPSILON * size
}

/// Two shifts, as the eigenvalues of two rows.
struct Shifts {
    upper: f64,
    lower: f64,
    /// Product of the entries beside the diagonal.
    across: f64,
}

impl Shifts {
    fn of(form: &DMatrix<f64>, k: usize) -> Self {
        Self { upper: form[(k, k)], lower: form[(k + 1, k + 1)], across: form[(k, k + 1)] * form[(k + 1, k)] }
    }

    /// With the numbers of `dlahqr`, which have no meaning.
    fn exceptional(form: &DMatrix<f64>, k: usize) -> Self {
        let size = form[(k + 1, k)].abs() + form[(k + 2, k + 1)].abs();
        let own = form[(k, k)] + 0.75 * size;
        Self { upper: own, lower: own, across: -0.4375 * size * size }
    }

    fn values(&self) -> [Complex<f64>; 2] {
        let half = 0.5 * (self.upper - self.lower);
        let square = half * half + self.across;
        if square < 0.0 {
            let value = Complex::new(self.lower + half, (-square).sqrt());
            return [value, value.conj()];
        }
        let far = half + square.sqrt().copysign(half);
        let near = if far == 0.0 { 0.0 } else { -self.across / far };
        [Complex::new(self.lower + far, 0.0), Complex::new(self.lower + near, 0.0)]
    }
}

/// A reflection I - axis scaled^T of three rows or columns, or of two where the third entries are zero.
#[derive(Clone, Copy, Default)]
struct Reflection {
    axis: [f64; 3],
    scaled: [f64; 3],
}

impl Reflection {
    /// The one that leaves of a vector its first entry only, with that; `None` where there is nothing to leave.
    fn of(mut axis: [f64; 3]) -> Option<(Self, f64)> {
        let size = axis.iter().fold(0.0_f64, |size, entry| size.max(entry.abs()));
        if size == 0.0 {
            return None;
        }
        axis.iter_mut().for_each(|entry| *entry /= size);
        let length = -axis.iter().map(|entry| entry * entry).sum::<f64>().sqrt().copysign(axis[0]);
        axis[0] -= length;
        let factor = -1.0 / (length * axis[0]);
        Some((Self { axis, scaled: axis.map(|entry| factor * entry) }, length * size))
    }

    /// Three entries, or two.
    fn turn(&self, entries: &mut [f64]) {
        let along: f64 = self.scaled.iter().zip(&*entries).map(|(scaled, entry)| scaled * entry).sum();
        entries.iter_mut().zip(&self.axis).for_each(|(entry, axis)| *entry -= along * axis);
    }

    /// Three columns, or two, in some rows.
    fn turn_columns(&self, columns: &mut [f64], n: usize, rows: Range<usize>) {
        let (first, others) = columns.split_at_mut(n);
        let (second, third) = others.split_at_mut(n);
        let ([a, b, c], [u, v, w]) = (self.axis, self.scaled);
        let pairs = first[rows.clone()].iter_mut().zip(&mut second[rows.clone()]);
        if third.is_empty() {
            for (x, y) in pairs {
                let along = u * *x + v * *y;
                (*x, *y) = (*x - along * a, *y - along * b);
            }
            return;
        }
        for ((x, y), z) in pairs.zip(&mut third[rows]) {
            let along = u * *x + v * *y + w * *z;
            (*x, *y, *z) = (*x - along * a, *y - along * b, *z - along * c);
        }
    }
}

/// One step for the rows from `first` to `last`, at least three: the bulge that the shifts make is chased down the diagonal. What is
/// far from it takes several reflections at once, so that its entries are read once for all of them.
fn sweep(form: &mut DMatrix<f64>, first: usize, last: usize, shifts: &Shifts) {
    let n = form.nrows();
    let (top, next, below) = (form[(first, first)], form[(first + 1, first + 1)], form[(first + 1, first)]);
    let (from_upper, from_lower) = (top - shifts.upper, top - shifts.lower);
    let mut axis = [
        from_upper * from_lower - shifts.across + form[(first, first + 1)] * below,
        below * (from_upper + next - shifts.lower),
        below * form[(first + 2, first + 1)],
    ];
    for from in (first..last).step_by(TOGETHER) {
        let to = last.min(from + TOGETHER);
        let end = (to + 2).min(last + 1);
        let mut reflections = [Reflection::default(); TOGETHER];
        let columns = |k: usize| k * n..(k + 3).min(last + 1) * n;
        for k in from..to {
            let width = 3.min(last + 1 - k);
            if k > first {
                axis = std::array::from_fn(|i| if i < width { form[(k + i, k - 1)] } else { 0.0 });
            }
            let Some((reflection, left)) = Reflection::of(axis) else { continue };
            if k > first {
                form[(k, k - 1)] = left;
                (1..width).for_each(|i| form[(k + i, k - 1)] = 0.0);
            }
            let entries = form.as_mut_slice();
            (k..end).for_each(|column| reflection.turn(&mut entries[column * n + k..column * n + k + width]));
            reflection.turn_columns(&mut entries[columns(k)], n, from..(k + 4).min(last + 1));
            reflections[k - from] = reflection;
        }
        let entries = form.as_mut_slice();
        for (k, reflection) in (from..to).zip(&reflections) {
            reflection.turn_columns(&mut entries[columns(k)], n, first..from);
        }
        turn_rows(&reflections, &mut entries[end * n..(last + 1) * n], n, from..end);
    }
}

/// Applies reflections, of three rows from the first on and each a row further down, to columns.
fn turn_rows(reflections: &[Reflection; TOGETHER], columns: &mut [f64], n: usize, rows: Range<usize>) {
    for some in columns.chunks_mut(ABREAST * n) {
        let mut abreast = [[0.0; ABREAST]; TOGETHER + 2];
        for (k, column) in some.chunks_exact(n).enumerate() {
            abreast.iter_mut().zip(&column[rows.clone()]).for_each(|(entries, entry)| entries[k] = *entry);
        }
        for (k, Reflection { axis, scaled }) in reflections.iter().enumerate() {
            let [x, y, z] = [abreast[k], abreast[k + 1], abreast[k + 2]];
            let along: [f64; ABREAST] = std::array::from_fn(|i| scaled[0] * x[i] + scaled[1] * y[i] + scaled[2] * z[i]);
            for (at, entries) in [x, y, z].into_iter().enumerate() {
                abreast[k + at] = std::array::from_fn(|i| entries[i] - along[i] * axis[at]);
            }
        }
        for (k, column) in some.chunks_exact_mut(n).enumerate() {
            column[rows.clone()].iter_mut().zip(&abreast).for_each(|(entry, entries)| *entry = entries[k]);
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // in a test, the panic is the message
mod tests {
    use nalgebra::Schur;

    use super::*;

    fn sorted(mut values: Vec<Complex<f64>>) -> Vec<Complex<f64>> {
        values.sort_by(|a, b| a.re.total_cmp(&b.re).then(a.im.total_cmp(&b.im)));
        values
    }

    /// For each value the nearest of the others, each of which is taken once.
    fn largest_difference(values: &[Complex<f64>], mut others: Vec<Complex<f64>>) -> f64 {
        assert_eq!(values.len(), others.len());
        let mut largest = 0.0_f64;
        for value in values {
            let distance = |other: &Complex<f64>| (other - value).norm();
            let k = (0..others.len()).min_by(|a, b| distance(&others[*a]).total_cmp(&distance(&others[*b]))).unwrap();
            largest = largest.max(distance(&others.swap_remove(k)));
        }
        largest
    }

    #[test]
    fn what_stands_upright_and_turns_has_four_of_one_magnitude() {
        // Hessenberg's form of a top: lambda^2 = g +- i h sqrt(g). The shifts of its last rows are real, one the negative of the other.
        for h in [1e-3, 0.1, 1.0, 5.0, 50.0] {
            let g = 64.0;
            #[rustfmt::skip]
            let top = DMatrix::from_row_slice(4, 4, &[
                0.0, 1.0, 0.0, -h,
                g, 0.0, 0.0, 0.0,
                0.0, h, 0.0, g,
                0.0, 0.0, 1.0, 0.0,
            ]);
            let root = Complex::new(g, h * 8.0).sqrt();
            let known = [root, root.conj(), -root, -root.conj()];
            let found = eigenvalues(top.hessenberg().unpack_h()).unwrap();
            assert!(largest_difference(&known, found.clone()) < 1e-11, "{h}: {found:?}");
        }
    }

    #[test]
    fn rings_of_eigenvalues_are_found() {
        for n in 3..20 {
            let ring = DMatrix::from_fn(n, n, |i, j| if (j + 1) % n == i { 1.0 } else { 0.0 });
            let known: Vec<_> =
                (0..n).map(|k| Complex::from_polar(1.0, std::f64::consts::TAU * k as f64 / n as f64)).collect();
            assert!(largest_difference(&known, eigenvalues(ring.hessenberg().unpack_h()).unwrap()) < 1e-13, "{n}");
        }
    }

    #[test]
    fn matrices_without_structure_have_those_of_the_schur_form() {
        let mut state = 1_u64;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        for n in (1..20).chain([34, 35, 40, 76, 130]) {
            let a = DMatrix::from_fn(n, n, |_, _| next());
            let known = Schur::try_new(a.clone(), f64::EPSILON, 10_000).unwrap().complex_eigenvalues();
            let found = eigenvalues(a.clone().hessenberg().unpack_h()).unwrap();
            assert!(largest_difference(known.as_slice(), found.clone()) < 1e-11 * a.norm(), "{n}");
            let conjugates = found.iter().map(Complex::conj).collect();
            assert_eq!(sorted(found), sorted(conjugates));
        }
    }
}
