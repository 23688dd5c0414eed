//! [`Jacobian`]: the derivatives that implicit methods need, exact where the system knows them.

use std::ops::Range;

use super::StopReason;
use super::fill::Fill;
use super::run::{Run, Trouble, all_finite};

/// Change of a rate, as a share of its size, over the step of a difference from which on it may be a jump.
const JUMP: f64 = 1e-3;

/// Entries of the state below this share of their size are taken for as large (Hairer and Wanner, radau5, for sizes of 1).
const NEAR_ZERO: f64 = 1e-5;

/// A matrix by columns; entries that are zero are left out.
#[derive(Debug, Clone, Default)]
pub(super) struct Columns {
    /// Where the entries of each column lie.
    places: Vec<Range<usize>>,
    rows: Vec<u32>,
    values: Vec<f64>,
}

impl Columns {
    /// All entries of a matrix with `n` columns are zero.
    pub(super) fn clear(&mut self, n: usize) {
        self.places.clear();
        self.places.resize(n, 0..0);
        self.rows.clear();
        self.values.clear();
    }

    /// Puts an entry.
    ///
    /// # Panics
    /// Where entries of another column came between those of its own.
    pub(super) fn put(&mut self, row: usize, column: usize, value: f64) {
        if value == 0.0 {
            return;
        }
        let end = self.rows.len();
        let place = &mut self.places[column];
        if place.start == place.end {
            *place = end..end;
        }
        assert_eq!(place.end, end, "entries of a column come one after the other");
        place.end += 1;
        self.rows.push(row as u32);
        self.values.push(value);
    }

    /// Row and value of the entries of a column.
    pub(super) fn column(&self, column: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let place = self.places[column].clone();
        self.rows[place.clone()].iter().map(|row| *row as usize).zip(self.values[place].iter().copied())
    }

    fn is_finite(&self) -> bool {
        all_finite(&self.values)
    }
}

/// `f_y` at the start of a step.
#[derive(Debug, Clone, Default)]
pub(super) struct Jacobian {
    pub(super) matrix: Columns,
    /// How `shift I - f_y` is eliminated.
    pub(super) fill: Fill,
    /// Whether that has changed since it was last eliminated.
    pub(super) fill_is_new: bool,
    argument: Vec<f64>,
    rates: Vec<f64>,
    beyond: Vec<f64>,
}

impl Jacobian {
    /// Room for `n` entries of the state.
    pub(super) fn resize(&mut self, n: usize) {
        self.matrix.clear(n);
        self.fill.resize(n);
        self.fill_is_new = true;
        for work in [&mut self.argument, &mut self.rates, &mut self.beyond] {
            work.clear();
            work.resize(n, 0.0);
        }
    }

    /// Its matrices are eliminated with row pivoting throughout from now on.
    pub(super) fn leave_dense(&mut self) {
        self.fill.leave_dense(&self.matrix);
        self.fill_is_new = true;
    }

    /// `f_y` at the accepted state `y`, where `f` is `start`: the system's own, or differences of its right side where it has none
    /// or they are not finite.
    pub(super) fn take(&mut self, run: &mut Run<'_>, y: &[f64], start: &[f64]) -> Result<(), Trouble> {
        run.counters.jacobians += 1;
        self.matrix.clear(y.len());
        let exact = run.jacobian(run.t, y, &mut |row, column, value| self.matrix.put(row, column, value))?;
        // Derivatives of 1 / (1 + e^x) are no number where e^x is infinite, though it is 0 there.
        if !exact || !self.matrix.is_finite() {
            self.matrix.clear(y.len());
            self.differences(run, y, start)?;
        }
        if !self.matrix.is_finite() {
            return Err(Trouble::Retry(StopReason::NotFinite { step: 0.0 }));
        }
        self.fill_is_new |= self.fill.take(&self.matrix);
        Ok(())
    }

    /// By differences of the right side, column by column.
    fn differences(&mut self, run: &mut Run<'_>, y: &[f64], start: &[f64]) -> Result<(), Trouble> {
        let Self { matrix, argument, rates, beyond, .. } = self;
        argument.copy_from_slice(y);
        for (j, value) in y.iter().enumerate() {
            // Along the motion: away from a switch that was just passed.
            let size = Some(run.system.entry_size(j)).filter(|size| *size > 0.0).unwrap_or(1.0);
            let step = (f64::EPSILON * size * value.abs().max(NEAR_ZERO * size)).sqrt().copysign(start[j]);
            argument[j] = value + step;
            let step = argument[j] - value;
            run.rhs(run.t, argument, rates, step.abs())?;
            // Beyond a switch that is nearer than that: the derivative on its other side.
            let mut jumps = run.system.conditions() > 0 && start.iter().zip(&*rates).any(is_jump);
            if jumps {
                argument[j] = value + 2.0 * step;
                run.rhs(run.t, argument, beyond, step.abs())?;
                let mut rows = start.iter().zip(&*rates).zip(&*beyond);
                jumps =
                    rows.any(|((from, to), then)| is_jump((from, to)) && 2.0 * (then - to).abs() < (to - from).abs());
            }
            argument[j] = *value;
            for row in 0..y.len() {
                let change = if jumps { beyond[row] - rates[row] } else { rates[row] - start[row] };
                matrix.put(row, j, change / step);
            }
        }
        Ok(())
    }
}

/// Whether a rate changes by so much over the step of a difference that it may have jumped.
fn is_jump((from, to): (&f64, &f64)) -> bool {
    (to - from).abs() > JUMP * (from.abs() + to.abs())
}
