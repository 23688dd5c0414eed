//! Columns with all of their entries.

use super::super::{add_scaled, dot, two_norm};

/// Dense storage of a [`super::PivotedQr`], column-major.
///
/// `S` puts rows with large entries first: errors of each row are then round-off of that row, however much rows differ in size
/// (Powell & Reid 1969; Cox & Higham, BIT 38, 1998).
#[derive(Debug, Clone)]
pub(super) struct WholeColumns {
    rows: usize,
    columns: usize,
    /// `A`, then `R` on and above the diagonal and the reflectors below it. Allocated by the first [`WholeColumns::clear`].
    entries: Vec<f64>,
    /// `S`: row of `A` at each place; and the size of each row, or scratch.
    row_order: Vec<usize>,
    row_size: Vec<f64>,
}

impl WholeColumns {
    pub(super) fn new(rows: usize, columns: usize) -> Self {
        Self { rows, columns, entries: Vec::new(), row_order: (0..rows).collect(), row_size: vec![0.0; rows] }
    }

    pub(super) fn clear(&mut self) {
        self.entries.clear();
        self.entries.resize(self.rows * self.columns, 0.0);
    }

    pub(super) fn set(&mut self, row: usize, column: usize, value: f64) {
        self.entries[row + self.rows * column] = value;
    }

    fn column(&self, column: usize) -> &[f64] {
        &self.entries[column * self.rows..(column + 1) * self.rows]
    }

    fn column_mut(&mut self, column: usize) -> &mut [f64] {
        &mut self.entries[column * self.rows..(column + 1) * self.rows]
    }

    pub(super) fn length(&self, column: usize, from: usize) -> f64 {
        two_norm(&self.column(column)[from..])
    }

    pub(super) fn divide(&mut self, column: usize, by: f64) {
        self.column_mut(column).iter_mut().for_each(|value| *value /= by);
    }

    pub(super) fn vanish(&mut self, column: usize) {
        self.column_mut(column).fill(0.0);
    }

    /// Puts rows with large entries first.
    pub(super) fn begin(&mut self) {
        self.row_size.fill(0.0);
        for column in self.entries.chunks_exact(self.rows.max(1)) {
            self.row_size.iter_mut().zip(column).for_each(|(size, value)| *size = size.max(value.abs()));
        }
        let size = &self.row_size;
        self.row_order.iter_mut().enumerate().for_each(|(place, row)| *row = place);
        self.row_order.sort_unstable_by(|a, b| size[*b].total_cmp(&size[*a]).then(a.cmp(b)));
        for column in self.entries.chunks_exact_mut(self.rows.max(1)) {
            self.row_size.copy_from_slice(column);
            column.iter_mut().zip(&self.row_order).for_each(|(value, row)| *value = self.row_size[*row]);
        }
    }

    /// Annihilates a column below row `k` and updates the columns that remain; gives the factor of the reflector.
    pub(super) fn reflect(
        &mut self,
        k: usize,
        column: usize,
        length: f64,
        remaining: &[usize],
        changed: &mut Vec<(usize, f64)>,
    ) -> f64 {
        // v = x - beta e_1 with beta = -sign(x_1) |x|, stored with v_1 = 1 understood.
        let pivot_column = &mut self.column_mut(column)[k..];
        let alpha = pivot_column[0];
        let beta = if alpha < 0.0 { length } else { -length };
        let tau = (beta - alpha) / beta;
        for value in &mut pivot_column[1..] {
            *value /= alpha - beta;
        }
        pivot_column[0] = beta;

        for other in remaining {
            let [own, other_entries] = self.pair(column, *other);
            let (reflector, tail) = (&own[k + 1..], &mut other_entries[k..]);
            let product = tau * (tail[0] + dot(reflector, &tail[1..]));
            // Joints that share no body have columns without common rows.
            if product != 0.0 {
                tail[0] -= product;
                add_scaled(&mut tail[1..], -product, reflector);
            }
            changed.push((*other, tail[0]));
        }
        tau
    }

    fn pair(&mut self, a: usize, b: usize) -> [&mut [f64]; 2] {
        let rows = self.rows;
        let (left, right) = self.entries.split_at_mut(a.max(b) * rows);
        let (low, high) = (&mut left[a.min(b) * rows..(a.min(b) + 1) * rows], &mut right[..rows]);
        if a < b { [low, high] } else { [high, low] }
    }

    fn apply_reflector(&self, k: usize, column: usize, tau: f64, x: &mut [f64]) {
        let reflector = &self.column(column)[k + 1..];
        let product = tau * (x[k] + dot(reflector, &x[k + 1..]));
        x[k] -= product;
        add_scaled(&mut x[k + 1..], -product, reflector);
    }

    /// `x := S^T Q x`
    pub(super) fn apply_q(&mut self, pivots: &[usize], tau: &[f64], x: &mut [f64]) {
        for (k, column) in pivots.iter().enumerate().rev() {
            self.apply_reflector(k, *column, tau[k], x);
        }
        self.row_size.copy_from_slice(x);
        for (value, &row) in self.row_size.iter().zip(&self.row_order) {
            x[row] = *value;
        }
    }

    /// `x := Q^T S x`
    pub(super) fn apply_q_transposed(&mut self, pivots: &[usize], tau: &[f64], x: &mut [f64]) {
        self.row_size.copy_from_slice(x);
        for (value, &row) in x.iter_mut().zip(&self.row_order) {
            *value = self.row_size[row];
        }
        for (k, column) in pivots.iter().enumerate() {
            self.apply_reflector(k, *column, tau[k], x);
        }
    }

    pub(super) fn diagonal(&self, k: usize, column: usize) -> f64 {
        self.column(column)[k]
    }

    /// Product of the first `k` entries of a column of `R` with a vector.
    pub(super) fn product(&self, k: usize, column: usize, x: &[f64]) -> f64 {
        dot(&self.column(column)[..k], &x[..k])
    }

    /// `x += factor` times the first `k` entries of a column of `R`.
    pub(super) fn add(&self, k: usize, column: usize, factor: f64, x: &mut [f64]) {
        add_scaled(&mut x[..k], factor, &self.column(column)[..k]);
    }
}
