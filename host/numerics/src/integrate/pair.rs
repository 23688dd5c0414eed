//! [`Pair`]: the table of an explicit method.

/// A row of a tableau: `(stage, coefficient)`, without the zeros.
pub type Row = &'static [(usize, f64)];

/// An explicit pair with dense output. Stages `0..a.len()` make the step, stage `a.len()` is the derivative at its end,
/// those after it serve the dense output.
#[derive(Debug)]
pub struct Pair {
    /// Abscissae of all stages.
    pub c: &'static [f64],
    /// Arguments of the stages of the step: `y + h sum_j a_ij k_j`.
    pub a: &'static [Row],
    /// Weights of the step.
    pub b: Row,
    /// The error estimate.
    pub error: Estimate,
    /// Arguments of the stages for the dense output.
    pub a_dense: &'static [Row],
    /// Coefficients of the interpolation polynomial from the fourth power on.
    pub d: &'static [Row],
    /// The error estimate goes with `h^order`.
    pub order: f64,
    /// Weight of the previous error in the step control where the options give none.
    pub beta: f64,
    /// How much the exponent of the error falls by that weight.
    pub beta_share: f64,
    /// `h |lambda|` at the border of the region of stability.
    pub stability: f64,
}

impl Pair {
    /// The stages at which functions are felt, in the order of time: those that have a weight in the new state or in the error estimate,
    /// and both ends of the step. What the others alone see of a pulse changes neither.
    pub(super) fn weighty(&self) -> Vec<usize> {
        let estimates = match self.error {
            Estimate::Single(row) => [row, &[]],
            Estimate::FiveAndThree(row5, row3) => [row5, row3],
        };
        let rows = [self.b].into_iter().chain(estimates);
        let mut stages: Vec<usize> = rows.flatten().map(|(stage, _)| *stage).chain([0, self.a.len()]).collect();
        stages.sort_by(|a, b| self.c[*a].total_cmp(&self.c[*b]).then(a.cmp(b)));
        stages.dedup();
        stages
    }

    /// The stages that have a weight in the new state or in the rougher of the estimates, with both.
    pub(super) fn summed(&self) -> Vec<(usize, [f64; 2])> {
        let (Estimate::Single(rough) | Estimate::FiveAndThree(rough, _)) = self.error;
        let weight = |row: Row, stage: usize| row.iter().find(|(of, _)| *of == stage).map_or(0.0, |(_, x)| *x);
        let weights = |stage: usize| (stage, [self.b, rough].map(|row| weight(row, stage)));
        (0..=self.a.len()).map(weights).filter(|(_, weights)| *weights != [0.0; 2]).collect()
    }
}

/// Differences of the weights from those of lower-order methods.
#[derive(Debug)]
pub enum Estimate {
    /// One, which uses the derivative at the end of the step.
    Single(Row),
    /// Orders 5 and 3, see `Explicit::error_of_step`.
    FiveAndThree(Row, Row),
}

impl Estimate {
    pub(super) fn uses_end(&self) -> bool {
        matches!(self, Self::Single(_))
    }
}
