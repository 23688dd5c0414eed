//! [`SparseLu`]: elimination of a general square matrix with few entries.

use nalgebra::DMatrix;

/// Share of the largest entry of its column from which on an entry may be a pivot.
const THRESHOLD: f64 = 0.1;

/// Sparse `P A Q = L U`. The next column is the one with the fewest entries left, its pivot the entry of the shortest row among those
/// that are large enough (Markowitz 1957; threshold pivoting as in Duff, Erisman & Reid, "Direct Methods for Sparse Matrices", 2nd ed.
/// 2017, ch. 7). Along chains and trees it costs as much as they have entries, and one pass over the columns per pivot.
#[derive(Debug, Clone)]
pub struct SparseLu {
    steps: Vec<Step>,
}

/// The elimination of an unknown.
#[derive(Debug, Clone)]
struct Step {
    row: usize,
    column: usize,
    pivot: f64,
    /// What is left of the pivot's row.
    right: Vec<(usize, f64)>,
    /// How much of the row was taken off which others.
    below: Vec<(usize, f64)>,
}

impl SparseLu {
    /// Factors a square matrix. `None` where it is singular (a column without an entry is left) or not finite.
    #[must_use]
    pub fn of(matrix: &DMatrix<f64>) -> Option<Self> {
        if matrix.iter().any(|value| !value.is_finite()) {
            return None;
        }
        let n = matrix.nrows();
        let mut rows: Vec<Vec<(usize, f64)>> = vec![Vec::new(); n];
        // Rows with an entry in each column; entries that cancel stay.
        let mut columns: Vec<Vec<usize>> = vec![Vec::new(); n];
        for (column, values) in matrix.column_iter().enumerate() {
            for (row, value) in values.iter().enumerate().filter(|(_, value)| **value != 0.0) {
                rows[row].push((column, *value));
                columns[column].push(row);
            }
        }
        let mut open: Vec<usize> = (0..n).collect();
        let mut steps = Vec::with_capacity(n);
        let mut place = vec![usize::MAX; n];
        while let Some(at) = (0..open.len()).min_by_key(|at| columns[open[*at]].len()) {
            let column = open.swap_remove(at);
            let entries: Vec<(usize, f64)> = std::mem::take(&mut columns[column])
                .into_iter()
                .map(|row| (row, rows[row].iter().find(|entry| entry.0 == column).map_or(0.0, |entry| entry.1)))
                .collect();
            let largest = entries.iter().map(|(_, value)| value.abs()).max_by(f64::total_cmp)?;
            if !(largest > 0.0 && largest.is_finite()) {
                return None;
            }
            let large = entries.iter().filter(|(_, value)| value.abs() >= THRESHOLD * largest);
            let (row, pivot) = *large.min_by_key(|(row, _)| rows[*row].len())?;
            let mut right = std::mem::take(&mut rows[row]);
            right.retain(|entry| entry.0 != column);
            for (other, _) in &right {
                columns[*other].retain(|one| *one != row);
            }
            let mut below = Vec::with_capacity(entries.len() - 1);
            for (target, value) in entries.into_iter().filter(|entry| entry.0 != row) {
                let factor = value / pivot;
                below.push((target, factor));
                let left = &mut rows[target];
                left.retain(|entry| entry.0 != column);
                left.iter().enumerate().for_each(|(k, entry)| place[entry.0] = k);
                for (other, value) in &right {
                    match left.get_mut(place[*other]).filter(|entry| entry.0 == *other) {
                        Some(entry) => entry.1 -= factor * value,
                        None => {
                            left.push((*other, -factor * value));
                            columns[*other].push(target);
                        }
                    }
                }
            }
            steps.push(Step { row, column, pivot, right, below });
        }
        Some(Self { steps })
    }

    /// Solves for each column of a right side.
    #[must_use]
    pub fn solve(&self, right: &DMatrix<f64>) -> DMatrix<f64> {
        let mut left = right.clone();
        let mut found = DMatrix::zeros(right.nrows(), right.ncols());
        for (mut left, mut found) in left.column_iter_mut().zip(found.column_iter_mut()) {
            for step in &self.steps {
                let own = left[step.row];
                if own != 0.0 {
                    step.below.iter().for_each(|(row, factor)| left[*row] -= factor * own);
                }
            }
            for step in self.steps.iter().rev() {
                let known: f64 = step.right.iter().map(|(column, value)| value * found[*column]).sum();
                found[step.column] = (left[step.row] - known) / step.pivot;
            }
        }
        found
    }

    /// Numbers that the factors are made of.
    #[cfg(test)]
    pub(super) fn entries(&self) -> usize {
        self.steps.iter().map(|step| 1 + step.right.len() + step.below.len()).sum()
    }
}
