//! Which joints contradict each other, where no position meets all of them.
//!
//! The bodies are brought where the joints miss least: where the sum of the squared gaps `r` is smallest, and so `J^T r = 0`. There
//! each row pulls with its gap, and the pulls balance. A row that could be met whatever the others want has nothing to balance
//! its pull, so that its gap is zero: the rows with a gap are those that contradict each other. The method is that of Levenberg
//! and Marquardt, its linear systems solved by conjugate gradients (Paige & Saunders 1982, CGLS).

use super::assembly::load;
use super::constraints::Constraints;
use super::formulation::AnalysisError;
use super::motion::move_body;
use super::working::BODY_STATES;
use crate::model::Model;
use crate::plan::Layout;

/// Steps before the gaps are taken as they are.
const MOST_STEPS: usize = 200;
/// Iterations for a step.
const MOST_ITERATIONS: usize = 2000;
/// Products of entries beyond which large scenes get fewer steps, some seconds; there more rows than contradict each other may
/// still have a gap.
const MOST_WORK: usize = 1_000_000_000;
const FEWEST_STEPS: usize = 5;
/// Relative decrease of the sum of squares at which it counts as smallest.
const SMALLEST: f64 = 1e-14;
/// Rows with more than this share of the largest gap contradict each other.
const NOTABLE: f64 = 1e-4;
/// A gap of so many turns is that of a row with a derivative of round-off.
const FLAT: f64 = 1e6;
/// A largest gap below this share of the scene's size is none.
const NO_GAP: f64 = 1e-9;
/// The longest step, rad or lengths of the scene.
const LONGEST: f64 = 0.5;

/// A joint equation that is not met, or whose rate is not.
#[derive(Debug, Clone, PartialEq)]
pub struct Gap {
    /// The joint's name.
    pub joint: String,
    /// The name of the row.
    pub row: String,
    /// By how much it is not met, m or rad, of rates m/s or rad/s; not negative.
    pub size: f64,
    /// Whether that is an angle.
    pub angular: bool,
    /// Whether no small motion changes the row, so that it has a value and no size: what must be perpendicular is parallel.
    pub flat: bool,
}

impl std::fmt::Display for Gap {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if self.flat {
            return write!(f, "{}: {} is off, and no small motion changes it", self.joint, self.row);
        }
        let unit = if self.angular { "rad" } else { "m" };
        write!(f, "{}: {} is off by {:.3e} {unit}", self.joint, self.row, self.size)
    }
}

/// What makes the values of rows gaps: the largest size of a row's gradient by a body's position, or, where it depends on
/// orientations only, by a body's orientation.
pub(super) struct Measure {
    gradients: Vec<f64>,
    angular: Vec<bool>,
    /// Without any gradient.
    constant: Vec<bool>,
}

impl Measure {
    /// Of rows that are evaluated.
    pub(super) fn new(rows: &Constraints) -> Self {
        let count = rows.rows.len();
        // Squared sizes by position and by orientation: of the body whose columns are being read, and the largest.
        let mut own = vec![(usize::MAX, [0.0_f64; 2]); count];
        let mut largest = vec![[0.0_f64; 2]; count];
        for ((row, column), slope) in rows.structure.jacobian.iter().zip(rows.jacobian()) {
            let (body, squares) = &mut own[*row];
            if *body != column / 6 {
                (*body, *squares) = (column / 6, [0.0; 2]);
            }
            let kind = column % 6 / 3;
            squares[kind] += slope * slope;
            largest[*row][kind] = largest[*row][kind].max(squares[kind]);
        }
        let angular: Vec<bool> = largest.iter().map(|[position, turn]| *position == 0.0 && *turn > 0.0).collect();
        let gradient = |([position, turn], angular): (&[f64; 2], &bool)| {
            let gradient = if *angular { turn.sqrt() } else { position.sqrt() };
            if gradient > 0.0 { gradient } else { 1.0 }
        };
        let constant = largest.iter().map(|sizes| *sizes == [0.0; 2]).collect();
        Self { gradients: largest.iter().zip(&angular).map(gradient).collect(), angular, constant }
    }

    /// What a value of a row is multiplied with to be a gap in m, angles taken on `length`.
    fn weight(&self, k: usize, length: f64) -> f64 {
        (if self.angular[k] { length } else { 1.0 }) / self.gradients[k]
    }

    /// The rows whose values are notable, worst first.
    pub(super) fn gaps(&self, rows: &Constraints, model: &Model, layout: &Layout, length: f64) -> Vec<Gap> {
        let values = rows.function(0);
        let sizes: Vec<f64> = values.iter().enumerate().map(|(k, x)| x.abs() * self.weight(k, length)).collect();
        let worst = sizes.iter().copied().fold(0.0, f64::max);
        let mut off: Vec<usize> = (0..sizes.len()).filter(|k| sizes[*k] > NOTABLE * worst).collect();
        off.sort_by(|a, b| sizes[*b].total_cmp(&sizes[*a]));
        off.into_iter().map(|k| self.gap(k, rows.rows[k], values[k], model, layout)).collect()
    }

    /// What a value of the `k`th of the rows, or its rate, amounts to.
    pub(super) fn gap(&self, k: usize, row: usize, value: f64, model: &Model, layout: &Layout) -> Gap {
        let (element, row) = layout.element_of_row(row);
        let instance = &model.elements[element];
        let (size, angular) = (value.abs() / self.gradients[k], self.angular[k]);
        Gap {
            row: instance.row(row).to_string(),
            joint: instance.name.clone(),
            size,
            angular,
            flat: if angular { size > FLAT } else { self.constant[k] },
        }
    }
}

/// The rows that contradict each other near the positions of `given`, with their gaps where these are smallest; none where all
/// of them can be met. `rows` are all rows with their values as function 0.
///
/// # Errors
/// See [`AnalysisError`].
pub(super) fn conflict(
    rows: &mut Constraints,
    model: &Model,
    layout: &Layout,
    t: f64,
    given: &[f64],
    inputs: &mut [f64],
    length: f64,
) -> Result<Vec<Gap>, AnalysisError> {
    let mut state = given.to_vec();
    load(layout, t, &state, inputs);
    rows.evaluate(inputs, &model.sets)?;
    let measure = Measure::new(rows);
    let weights: Vec<f64> = (0..rows.rows.len()).map(|k| measure.weight(k, length)).collect();
    let weighted = |rows: &Constraints| -> Vec<f64> {
        rows.function(0).iter().zip(&weights).map(|(value, weight)| value * weight).collect()
    };
    let mut gaps = weighted(rows);
    // Unknowns are displacements, rotations taken on the length.
    let weighted_slopes = |rows: &Constraints| -> Vec<(usize, usize, f64)> {
        let entries = rows.structure.jacobian.iter().zip(rows.jacobian());
        let scale = |column: usize| if column % 6 < 3 { 1.0 } else { length };
        entries.map(|((row, column), slope)| (*row, *column, slope * weights[*row] / scale(*column))).collect()
    };
    let mut slopes = weighted_slopes(rows);
    let iterations = MOST_ITERATIONS.min(4 * layout.velocities());
    let affordable = (MOST_WORK / (slopes.len() * iterations).max(1)).max(FEWEST_STEPS);
    let (mut best, mut damping) = (square(&gaps), 1e-3);
    for _ in 0..MOST_STEPS.min(affordable) {
        let mut step = least_squares(&slopes, &gaps, layout.velocities(), damping, iterations);
        let longest = step.iter().fold(0.0_f64, |most, d| most.max(d.abs())) / (LONGEST * length);
        step.iter_mut().for_each(|d| *d /= longest.max(1.0));
        let mut trial = state.clone();
        for (body, d) in step.chunks_exact(6).enumerate() {
            let d = [d[0], d[1], d[2], d[3] / length, d[4] / length, d[5] / length];
            move_body(&mut trial[BODY_STATES * body..BODY_STATES * body + 7], &d);
        }
        load(layout, t, &trial, inputs);
        rows.evaluate(inputs, &model.sets)?;
        let found = weighted(rows);
        let sum = square(&found);
        if sum <= best {
            let gain = best - sum;
            (state, gaps, best) = (trial, found, sum);
            slopes = weighted_slopes(rows);
            damping = (0.1 * damping).max(1e-12);
            if gain <= SMALLEST * best {
                break;
            }
        } else {
            damping *= 10.0;
            if damping > 1e8 {
                break;
            }
        }
    }
    load(layout, t, &state, inputs);
    rows.evaluate(inputs, &model.sets)?;
    let worst = weighted(rows).iter().fold(0.0_f64, |most, gap| most.max(gap.abs()));
    // Not a number, too, is nothing that could be reported.
    if worst > NO_GAP * length { Ok(measure.gaps(rows, model, layout, length)) } else { Ok(Vec::new()) }
}

fn square(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum()
}

/// The `d` that makes `|J d + r|^2 + damping |d|^2` smallest; `slopes` are the entries of `J`, `n` is the length of `d`, `most`
/// how many iterations there may be.
fn least_squares(slopes: &[(usize, usize, f64)], r: &[f64], n: usize, damping: f64, most: usize) -> Vec<f64> {
    let transposed = |s: &[f64], d: &[f64]| {
        let mut g: Vec<f64> = d.iter().map(|d| -damping * d).collect();
        slopes.iter().for_each(|(row, column, slope)| g[*column] += slope * s[*row]);
        g
    };
    let mut d = vec![0.0; n];
    let mut s: Vec<f64> = r.iter().map(|r| -r).collect();
    let mut g = transposed(&s, &d);
    let mut p = g.clone();
    let first = square(&g);
    let mut size = first;
    for _ in 0..most {
        if size <= 1e-30 * first {
            break;
        }
        let mut q = vec![0.0; r.len()];
        slopes.iter().for_each(|(row, column, slope)| q[*row] += slope * p[*column]);
        let share = size / (square(&q) + damping * square(&p));
        d.iter_mut().zip(&p).for_each(|(d, p)| *d += share * p);
        s.iter_mut().zip(&q).for_each(|(s, q)| *s -= share * q);
        g = transposed(&s, &d);
        let before = std::mem::replace(&mut size, square(&g));
        p.iter_mut().zip(&g).for_each(|(p, g)| *p = g + size / before * *p);
    }
    d
}
