//! Internal unknowns brought to their conditions, as the host does at the start of a run.

use nalgebra::{DMatrix, DVector};

use crate::recording::Role;
use crate::testkit::variation::Variation;
use crate::testkit::{Probe, Setting, interpret_with};

/// Most Newton steps.
const MOST_STEPS: usize = 100;
/// Shortest share of a Newton step.
const SHORTEST: f64 = 1e-9;
/// Steps this small, against the size of an unknown, end the search.
const FOUND: f64 = 1e-13;
/// Steps that do not become smaller any more are round-off below this share.
const ROUND_OFF: f64 = 1e-8;

impl Probe {
    /// Brings the internal unknowns to their conditions with everything else held: Newton's method from where they are, with steps
    /// shortened until the next one becomes smaller (Deuflhard, Newton Methods for Nonlinear Problems (2004), section 3.3). Gives
    /// whether it arrived.
    ///
    /// # Panics
    /// When the setting does not fit.
    pub fn solve_unknowns(&self, setting: &mut Setting) -> bool {
        let count = self.recording.unknowns();
        if count == 0 {
            return true;
        }
        let place = |setting: &Setting, k: usize| setting.states.len() - 1 - k;
        let mut sizes: Vec<f64> = (0..count).map(|k| setting.states[place(setting, k)].abs()).collect();
        let (mut values, mut matrix) = self.conditions(setting, count);
        let mut before = f64::INFINITY;
        for _ in 0..MOST_STEPS {
            let Some(step) = solution(&matrix, &values) else { return false };
            for (k, size) in sizes.iter_mut().enumerate() {
                *size = size.max(setting.states[place(setting, k)].abs()).max(step[k].abs());
            }
            let weighed = |step: &DVector<f64>| {
                let parts = step.iter().zip(&sizes).map(|(step, size)| step.abs() / size.max(f64::MIN_POSITIVE));
                parts.fold(0.0, f64::max)
            };
            let (whole, start) = (weighed(&step), setting.clone());
            let mut factor = 1.0;
            loop {
                for k in 0..count {
                    let own = place(setting, k);
                    setting.states[own] = start.states[own] - factor * step[k];
                }
                if whole <= FOUND || (whole <= ROUND_OFF && whole > 0.25 * before) {
                    return true;
                }
                let trial = self.conditions(setting, count);
                let next = solution(&matrix, &trial.0).map_or(f64::NAN, |step| weighed(&step));
                if next <= (1.0 - 0.25 * factor) * whole || (whole <= ROUND_OFF && next.is_finite()) {
                    (values, matrix) = trial;
                    break;
                }
                factor *= 0.5;
                if factor < SHORTEST {
                    return false;
                }
            }
            before = whole;
        }
        false
    }

    /// The conditions, and their derivatives with respect to the unknowns.
    fn conditions(&self, setting: &Setting, count: usize) -> (DVector<f64>, DMatrix<f64>) {
        let (mut values, mut matrix) = (DVector::zeros(count), DMatrix::zeros(count, count));
        for unknown in 0..count {
            let along = Variation::State(setting.states.len() - 1 - unknown);
            for (role, jet) in interpret_with(&self.recording, |input| along.jet(setting, input)) {
                if let Role::Condition(k) = role {
                    values[k as usize] = jet.value;
                    matrix[(k as usize, unknown)] = jet.first;
                }
            }
        }
        (values, matrix)
    }
}

/// x of A x = b, rows brought to one size; `None` where A is singular or a number is not finite.
fn solution(matrix: &DMatrix<f64>, right: &DVector<f64>) -> Option<DVector<f64>> {
    let (mut matrix, mut right) = (matrix.clone(), right.clone());
    for (mut row, value) in matrix.row_iter_mut().zip(right.iter_mut()) {
        let size = row.amax();
        if size > 0.0 {
            row /= size;
            *value /= size;
        }
    }
    matrix.lu().solve(&right).filter(|step| step.iter().all(|x| x.is_finite()))
}
