//! [`Unknowns`]: the values of internal unknowns at the start, and whether they can be followed.

use nalgebra::Vector3;
use odyn_numerics::draw::SplitMix64;

use super::evaluator::Evaluator;
use super::formulation::AnalysisError;
use crate::model::{Model, needs_distance, origins, rotation, together};
use crate::plan::Layout;
use crate::program::{Equations, Sets};

/// Newton steps before the search gives up.
const MOST_STEPS: usize = 100;
/// Shortest share of a Newton step.
const SHORTEST: f64 = 1e-9;
/// Steps this small, against the size of the unknown, end the search.
const FOUND: f64 = 1e-13;
/// Steps that do not become smaller any more are round-off below this share.
const ROUND_OFF: f64 = 1e-8;
/// An unknown has at least this share of the largest one, in units that bring the matrix to one size: what is smaller is round-off of
/// the others.
const LEAST_SIZE: f64 = 64.0 * f64::EPSILON;
/// Pivots below this share of their row make a matrix singular.
const SINGULAR: f64 = 1e-14;
/// What is left of conditions that cannot become smaller is round-off up to so many times what the last digits of the inputs change ...
const NOISE: f64 = 8.0;
/// ... in so many trials.
const TRIALS: u64 = 4;
/// How often rows and columns of a matrix are brought to one size, in turns; each leaves about a fourth of the decades that are left.
const BALANCINGS: usize = 8;
/// How often elements that take signals from each other are solved in turns.
const ROUNDS: usize = 3;
/// Why unknowns of an element that acts along a line may not be found.
const TOGETHER: &str = "two of its points lie together, where the line between them has no direction to act along";

/// The unknowns of one element.
struct Own {
    element: usize,
    slot: usize,
    count: usize,
    of_joint: bool,
    /// Conditions and their derivatives at the carried values.
    conditions: Evaluator,
}

/// See the module documentation.
pub struct Unknowns {
    elements: Vec<Own>,
    /// Where the places of bodies begin among the inputs.
    bodies: Vec<usize>,
}

impl Unknowns {
    /// Those of a scene.
    #[must_use]
    pub fn new(equations: &Equations, model: &Model, layout: &Layout) -> Self {
        let own = |solved: &odyn_graph::Solved| {
            let element = layout.element_of_state(solved.slot - layout.state_slot());
            Own {
                element,
                slot: solved.slot,
                count: solved.unknowns.len(),
                of_joint: model.elements[element].class.kind == element_api::Kind::Joint,
                conditions: Evaluator::new(&equations.graph, &solved.at_carried),
            }
        };
        let bodies = (0..layout.bodies).map(|body| layout.body_slot(body, 0)).collect();
        Self { elements: equations.graph.solved.iter().map(own).collect(), bodies }
    }

    /// Finds the values that the conditions ask for near those in `inputs`, by Newton's method with steps shortened until the next one
    /// becomes smaller (Deuflhard, Newton Methods for Nonlinear Problems (2004), section 3.3). `rows_only`: those of joints.
    ///
    /// # Errors
    /// [`AnalysisError::Unsolved`].
    pub fn solve(&mut self, inputs: &mut [f64], model: &Model, rows_only: bool) -> Result<(), AnalysisError> {
        let rounds = if self.elements.len() > 1 { ROUNDS } else { 1 };
        for _ in 0..rounds {
            for own in self.elements.iter_mut().filter(|own| own.of_joint || !rows_only) {
                own.solve(inputs, &model.sets).map_err(|stop| match stop {
                    Stop::Analysis(error) => error,
                    Stop::At(unknown, why) => {
                        let element = &model.elements[own.element];
                        let unknown = unknown_name(&element.class, unknown);
                        let points = origins(&element.markers, |body| {
                            let y = &inputs[self.bodies[body]..];
                            (Vector3::new(y[0], y[1], y[2]), rotation(&[y[3], y[4], y[5], y[6]]))
                        });
                        let size = points.iter().map(|point| point.norm()).fold(0.0, f64::max);
                        let met = together(&points, size);
                        let needs = |pair| needs_distance(&element.recording, &points, pair, size.max(1.0));
                        let why = if met.is_some_and(needs) { TOGETHER } else { why };
                        AnalysisError::Unsolved { element: element.name.clone(), unknown, why }
                    }
                })?;
            }
        }
        Ok(())
    }
}

/// An unknown's name, or its number.
#[must_use]
pub fn unknown_name(class: &element_api::Descriptor, k: usize) -> String {
    class.unknowns.get(k).map_or_else(|| k.to_string(), |named| named.name.clone())
}

enum Stop {
    Analysis(AnalysisError),
    At(usize, &'static str),
}

impl Own {
    fn solve(&mut self, inputs: &mut [f64], sets: &Sets) -> Result<(), Stop> {
        let at = self.slot..self.slot + self.count;
        let n = self.count;
        let mut sizes: Vec<f64> = inputs[at.clone()].iter().map(|y| y.abs()).collect();
        let mut found = self.conditions.run(inputs, sets).map_err(Stop::Analysis)?.to_vec();
        if let Some(k) = found[..n].iter().position(|value| !value.is_finite()) {
            return Err(Stop::At(k, "a condition is not a finite number at the starting guess"));
        }
        let mut before = f64::INFINITY;
        for _ in 0..MOST_STEPS {
            let (values, matrix) = found.split_at(n);
            let (step, units) =
                solve(matrix, values).map_err(|k| Stop::At(k, "the conditions do not determine it (singular)"))?;
            for ((size, y), step) in sizes.iter_mut().zip(&inputs[at.clone()]).zip(&step) {
                *size = size.max(y.abs()).max(step.abs());
            }
            let most = sizes.iter().zip(&units).fold(0.0_f64, |most, (size, unit)| most.max(size / unit));
            for (size, unit) in sizes.iter_mut().zip(&units) {
                let least = LEAST_SIZE * most * unit;
                if least.is_finite() {
                    *size = size.max(least);
                }
            }
            let share = |step: &[f64], y: &[f64]| {
                let sizes = y.iter().map(|y| y.abs().max(f64::MIN_POSITIVE));
                step.iter().zip(sizes).fold(0.0_f64, |most, (step, size)| most.max(step.abs() / size))
            };
            let weighed = |step: &[f64]| {
                let parts = step.iter().zip(&sizes).map(|(step, size)| step.abs() / size.max(f64::MIN_POSITIVE));
                parts.fold(0.0, f64::max)
            };
            let whole = weighed(&step);
            let start = inputs[at.clone()].to_vec();
            if whole == 0.0 || share(&step, &start) <= FOUND || (whole <= ROUND_OFF && whole > 0.25 * before) {
                // What comes down to zero ends where numbers lose their digits.
                let found = |y: f64| if y.abs() < f64::MIN_POSITIVE { 0.0 } else { y };
                inputs[at].iter_mut().zip(&step).for_each(|(y, step)| *y = found(*y - step));
                return Ok(());
            }
            before = whole;
            let mut factor = 1.0;
            loop {
                for ((y, start), step) in inputs[at.clone()].iter_mut().zip(&start).zip(&step) {
                    *y = start - factor * step;
                }
                let trial = self.conditions.run(inputs, sets).map_err(Stop::Analysis)?;
                let next = solve(matrix, &trial[..n]).ok().map(|(step, _)| weighed(&step));
                let sound = trial.iter().all(|value| value.is_finite());
                if sound && next.is_some_and(|next| next <= (1.0 - 0.25 * factor) * whole || whole <= ROUND_OFF) {
                    found = trial.to_vec();
                    break;
                }
                factor *= 0.5;
                if factor < SHORTEST {
                    inputs[at.clone()].copy_from_slice(&start);
                    if self.is_round_off(inputs, sets, &found[..n])? {
                        return Ok(());
                    }
                    let k = (0..n).max_by(|a, b| found[*a].abs().total_cmp(&found[*b].abs())).unwrap_or(0);
                    return Err(Stop::At(k, "no solution was found from the starting guess"));
                }
            }
        }
        Err(Stop::At(0, "no solution was found from the starting guess"))
    }

    /// Whether conditions are no larger than what the last digits of the inputs make of them: an unknown that is zero has no size of
    /// its own to judge its steps by.
    fn is_round_off(&mut self, inputs: &[f64], sets: &Sets, left: &[f64]) -> Result<bool, Stop> {
        let mut noise = vec![0.0_f64; left.len()];
        let mut numbers = SplitMix64::new(0);
        for _ in 0..TRIALS {
            let mut near = |x: f64| x * (1.0 + f64::EPSILON.copysign(numbers.either_way()));
            let moved: Vec<f64> = inputs.iter().map(|x| near(*x)).collect();
            let found = self.conditions.run(&moved, sets).map_err(Stop::Analysis)?;
            for ((noise, found), left) in noise.iter_mut().zip(found).zip(left) {
                *noise = noise.max((found - left).abs());
            }
        }
        Ok(left.iter().zip(&noise).all(|(left, noise)| left.abs() <= NOISE * noise))
    }
}

/// x of A x = b, rows of A one after the other, with row pivots. The geometric mean of the largest and the smallest entry of rows, and of
/// columns, is brought to one, and then the largest of rows: whether the matrix is singular does not depend on units, of unknowns or of
/// conditions (after Fulkerson & Wolfe, An algorithm for scaling matrices, 1962). Besides x, the units of the unknowns that do so.
///
/// # Errors
/// The column without a pivot.
fn solve(matrix: &[f64], right: &[f64]) -> Result<(Vec<f64>, Vec<f64>), usize> {
    let n = right.len();
    let mut rows: Vec<Vec<f64>> = (0..n).map(|k| [&matrix[n * k..n * (k + 1)], &right[k..=k]].concat()).collect();
    let mut units = vec![1.0; n];
    for _ in 0..BALANCINGS {
        for row in &mut rows {
            if let Some(size) = middle(row[..n].iter().copied()) {
                row.iter_mut().for_each(|x| *x /= size);
            }
        }
        for (k, unit) in units.iter_mut().enumerate() {
            if let Some(size) = middle(rows.iter().map(|row| row[k])) {
                rows.iter_mut().for_each(|row| row[k] /= size);
                *unit /= size;
            }
        }
    }
    for row in &mut rows {
        let size = row[..n].iter().fold(0.0_f64, |size, x| size.max(x.abs()));
        if size > 0.0 {
            row.iter_mut().for_each(|x| *x /= size);
        }
    }
    for k in 0..n {
        let best = (k..n).max_by(|a, b| rows[*a][k].abs().total_cmp(&rows[*b][k].abs())).unwrap_or(k);
        rows.swap(k, best);
        let pivot = rows[k][k];
        if pivot.is_nan() || pivot.abs() <= SINGULAR {
            return Err(k);
        }
        let (above, below) = rows.split_at_mut(k + 1);
        for row in below {
            let factor = row[k] / pivot;
            row.iter_mut().zip(&above[k]).for_each(|(x, y)| *x -= factor * y);
        }
    }
    let mut x = vec![0.0; n];
    for k in (0..n).rev() {
        let sum: f64 = (k + 1..n).map(|j| rows[k][j] * x[j]).sum();
        x[k] = (rows[k][n] - sum) / rows[k][k];
    }
    x.iter_mut().zip(&units).for_each(|(x, unit)| *x *= unit);
    Ok((x, units))
}

/// The geometric mean of the largest and the smallest magnitude that is not zero.
fn middle(entries: impl Iterator<Item = f64>) -> Option<f64> {
    let sizes = entries.map(f64::abs).filter(|size| *size > 0.0 && size.is_finite());
    let ends = sizes.fold(None, |ends, size| {
        let (low, high) = ends.unwrap_or((size, size));
        Some((f64::min(low, size), f64::max(high, size)))
    });
    ends.map(|(low, high)| low.sqrt() * high.sqrt())
}

/// The determinant of a matrix, rows one after the other.
#[must_use]
pub fn determinant(matrix: &[f64], n: usize) -> f64 {
    let mut rows: Vec<Vec<f64>> = matrix.chunks_exact(n).map(<[f64]>::to_vec).collect();
    let mut product = 1.0;
    for k in 0..n {
        let best = (k..n).max_by(|a, b| rows[*a][k].abs().total_cmp(&rows[*b][k].abs())).unwrap_or(k);
        if best != k {
            rows.swap(k, best);
            product = -product;
        }
        let pivot = rows[k][k];
        product *= pivot;
        if pivot == 0.0 {
            return 0.0;
        }
        let (above, below) = rows.split_at_mut(k + 1);
        for row in below {
            let factor = row[k] / pivot;
            row.iter_mut().zip(&above[k]).for_each(|(x, y)| *x -= factor * y);
        }
    }
    product
}

#[cfg(test)]
mod tests {
    use super::solve;

    /// Passages of a damper at rest, whose resistances are next to nothing in SI.
    #[test]
    fn small_resistances_do_not_make_it_singular() {
        for (first, second) in [(3e-15, 3e-15), (3e-15, 2e-13), (1e-100, 1e-90), (4e40, 1e44)] {
            let matrix = [0.0, 1.0, 1.0, -1.0, first, 0.0, -1.0, 0.0, second];
            let (x, _) =
                solve(&matrix, &[5.0, 0.0, 0.0]).unwrap_or_else(|k| panic!("{first}, {second}: {k} is not determined"));
            let pressure = 5.0 * first * (second / (first + second));
            assert!((x[0] - pressure).abs() <= 1e-13 * pressure, "{first}, {second}: {x:?}");
            assert!((x[1] + x[2] - 5.0).abs() <= 1e-13 * 5.0, "{first}, {second}: {x:?}");
        }
        assert!(solve(&[0.0, 1.0, 1.0, -1.0, 0.0, 0.0, -1.0, 0.0, 0.0], &[5.0, 0.0, 0.0]).is_err());
    }

    /// Flows of a damper, and its pressure in units up to 1e24 times larger: the same solution, and singular where it is in any.
    #[test]
    fn large_units_do_not_make_it_singular() {
        for unit in [1.0, 1e-6, 1e-12] {
            let matrix = [0.0, 1.0, 1.0, -unit, 2.0 / unit, 0.0, -unit, 0.0, 3.0 / unit];
            let (x, _) = solve(&matrix, &[5.0, 1.0, 2.0]).expect("not singular");
            for (row, right) in matrix.chunks(3).zip([5.0, 1.0, 2.0]) {
                let left: f64 = row.iter().zip(&x).map(|(a, x)| a * x).sum();
                let size: f64 = row.iter().zip(&x).map(|(a, x)| (a * x).abs()).sum();
                assert!((left - right).abs() <= 1e-14 * size, "{unit}: {left} is not {right}");
            }
            let singular = [0.0, 1.0, 1.0, -unit, 2.0 / unit, 0.0, -2.0 * unit, 4.0 / unit, 0.0];
            assert!(solve(&singular, &[1.0; 3]).is_err(), "{unit}");
        }
    }
}
