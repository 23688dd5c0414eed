//! [`Equal`]: eigenvalues that are equal but for round-off and have fewer vectors, as those of many critically damped oscillators.

use nalgebra::{Complex, DMatrix, DVector};

use super::zeros::Parted;
use super::{ComplexVector, Pair};

/// An eigenvalue of a matrix that is several times there.
pub(super) struct Equal {
    /// The places of its copies among all eigenvalues.
    pub(super) members: Vec<usize>,
    /// The mean of these, which round-off moves no more than a single eigenvalue.
    pub(super) value: Complex<f64>,
    /// How many of them have one vector in common, at most: the largest of Jordan's blocks.
    pub(super) block: usize,
    /// Vectors, of unit length, as many as there are: each has the largest entries that the others do not have; with one from the left each.
    pub(super) vectors: Vec<[ComplexVector; 2]>,
}

impl Equal {
    /// Of these members of all eigenvalues of a matrix of a size. `None` where the matrix less their mean has another number of zeros, one
    /// after the other with singular values up to a limit: they are not equal.
    pub(super) fn of(
        matrix: &DMatrix<f64>,
        all: &[Complex<f64>],
        members: &[usize],
        (size, limit): (f64, f64),
    ) -> Option<Self> {
        let (n, count) = (matrix.nrows(), members.len());
        let mut value = members.iter().map(|k| all[*k]).sum::<Complex<f64>>() / count as f64;
        let is_real = members.iter().any(|k| all[*k].im <= 0.0);
        let parted = if is_real {
            value.im = 0.0;
            Parted::of(&(matrix - DMatrix::from_diagonal_element(n, n, value.re)), size, limit)?
        } else {
            let of_both = DMatrix::from_fn(2 * n, 2 * n, |row, column| {
                let own = if row % n == column % n { value } else { Complex::ZERO };
                match (row < n, column < n) {
                    (true, true) | (false, false) => matrix[(row % n, column % n)] - own.re,
                    (true, false) => own.im,
                    (false, true) => -own.im,
                }
            });
            Parted::of(&of_both, size, limit)?
        };
        if parted.zeros != if is_real { count } else { 2 * count } {
            return None;
        }
        let null = DMatrix::from_fn(n, parted.null.ncols(), |row, k| {
            Complex::new(parted.null[(row, k)], if is_real { 0.0 } else { parted.null[(n + row, k)] })
        });
        let shift = value + Complex::new(3.0, 1.0) * (f64::EPSILON * size);
        let shifted = matrix.map(Complex::from) - DMatrix::from_diagonal_element(n, n, shift);
        let factors = shifted.adjoint().lu();
        let with_left = |vector: ComplexVector| {
            // A second iteration would start from a vector that the first has found, in which a block of several has no share to grow.
            let mut left = factors.solve(&vector)?;
            left.unscale_mut(left.norm());
            Some([vector, left])
        };
        let vectors =
            parted_basis(null, if is_real { 1 } else { 2 }).into_iter().map(with_left).collect::<Option<Vec<_>>>()?;
        (!vectors.is_empty()).then(|| Self { members: members.to_vec(), value, block: parted.rounds, vectors })
    }

    /// Each of them with one of the vectors, in turn.
    pub(super) fn pairs(&self, matrix: &DMatrix<f64>, size: f64) -> Vec<Pair> {
        let moved = |[vector, _]: &[ComplexVector; 2]| {
            let part = |part: fn(&Complex<f64>) -> f64| matrix * vector.map(|entry| part(&entry));
            part(|entry| entry.re).zip_map(&part(|entry| entry.im), Complex::new)
        };
        let moved: Vec<ComplexVector> = self.vectors.iter().map(moved).collect();
        let own = |copy: usize| {
            let number = copy % self.vectors.len();
            Pair::of(self.value, self.block, self.vectors[number].clone(), &moved[number], size)
        };
        (0..self.members.len()).map(own).collect()
    }
}

/// The vectors of unit length that columns span, one for so many of these, in each of which the entries are zero that are largest in the
/// others.
fn parted_basis(mut columns: DMatrix<Complex<f64>>, copies: usize) -> Vec<ComplexVector> {
    let count = columns.ncols() / copies;
    let mut done: Vec<usize> = Vec::new();
    for _ in 0..count {
        let open = (0..columns.ncols()).filter(|k| !done.contains(k));
        let largest = open
            .map(|k| (k, columns.column(k).icamax()))
            .max_by(|(a, i), (b, k)| columns[(*i, *a)].norm().total_cmp(&columns[(*k, *b)].norm()));
        let Some((own, row)) = largest.filter(|(k, row)| columns[(*row, *k)] != Complex::ZERO) else { break };
        let column: DVector<Complex<f64>> = columns.column(own) / columns[(row, own)];
        for k in (0..columns.ncols()).filter(|k| *k != own) {
            let share = columns[(row, k)];
            columns.column_mut(k).axpy(-share, &column, Complex::ONE);
        }
        columns.set_column(own, &column);
        done.push(own);
    }
    done.iter().map(|k| columns.column(*k).normalize()).collect()
}
