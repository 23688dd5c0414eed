//! [`Constraints`]: rows, Jacobian values and violations at a configuration.

use nalgebra::Matrix3;

use super::formulation::AnalysisError;
use crate::linalg::{KktStructure, LinalgError};
use crate::model::Model;
use crate::program::{Equations, Node, Program, Sets, Used, Workspace};

/// A program that gives chosen functions of a choice of rows together with their Jacobian.
#[derive(Clone)]
pub struct Constraints {
    /// Patterns of mass matrix and Jacobian for this choice.
    pub structure: KktStructure,
    /// The rows, by their number among all.
    pub rows: Vec<usize>,
    program: Program,
    workspace: Workspace,
    outputs: Vec<f64>,
}

impl Constraints {
    /// Prepares the Jacobian of `rows` and, per row, what `functions` names; further nodes follow.
    ///
    /// # Errors
    /// When the patterns are inconsistent, which would be a defect of the equations.
    pub fn new(
        equations: &Equations,
        rows: &[usize],
        functions: &[fn(&crate::program::Row) -> Node],
        further: &[Node],
    ) -> Result<Self, AnalysisError> {
        let entries = rows.iter().flat_map(|row| &equations.rows[*row].jacobian);
        let mut nodes: Vec<Node> = entries.map(|(_, node)| *node).collect();
        for function in functions {
            nodes.extend(rows.iter().map(|row| function(&equations.rows[*row])));
        }
        nodes.extend_from_slice(further);
        Self::by(equations, rows, Program::compile(&equations.graph, &nodes))
    }

    /// All rows that are enforced, with their values and their derivatives with respect to time as functions: as [`Constraints::new`]
    /// gives them, by a program that is made once.
    ///
    /// # Errors
    /// As for [`Constraints::new`].
    pub fn of_all(equations: &Equations) -> Result<Self, AnalysisError> {
        let all: Vec<usize> = equations.enforced().collect();
        Self::by(equations, &all, equations.program_of_rows().clone())
    }

    /// The same of the rows that constrain positions: of all but those of velocities.
    ///
    /// # Errors
    /// As for [`Constraints::new`].
    pub fn of_positions(equations: &Equations) -> Result<Self, AnalysisError> {
        let all = equations.enforced();
        let rows: Vec<usize> = all.clone().filter(|row| !equations.rows[*row].of_velocities).collect();
        if rows.len() == all.count() {
            return Self::of_all(equations);
        }
        Self::new(equations, &rows, &[|row| row.value, |row| row.time], &[])
    }

    fn by(equations: &Equations, rows: &[usize], program: Program) -> Result<Self, AnalysisError> {
        Ok(Self {
            structure: structure(equations, rows)?,
            rows: rows.to_vec(),
            workspace: program.workspace(),
            outputs: vec![0.0; program.output_count()],
            program,
        })
    }

    /// Their values, of [`Constraints::of_all`].
    #[must_use]
    pub fn values(&self) -> &[f64] {
        self.function(0)
    }

    /// Their derivatives with respect to time, of [`Constraints::of_all`].
    #[must_use]
    pub fn rates_in_time(&self) -> &[f64] {
        self.function(1)
    }

    /// Evaluates everything. `[hot, no allocation]`
    ///
    /// # Errors
    /// What an opaque element did wrong.
    pub fn evaluate(&mut self, inputs: &[f64], sets: &Sets) -> Result<(), AnalysisError> {
        self.program
            .run(inputs, sets, &mut self.workspace, &mut self.outputs)
            .map_err(|(set, fault)| AnalysisError::Element { set, fault })
    }

    /// Values of the Jacobian, aligned with the pattern.
    #[must_use]
    pub fn jacobian(&self) -> &[f64] {
        &self.outputs[..self.structure.jacobian.len()]
    }

    /// Values of function number `k`, one per row.
    #[must_use]
    pub fn function(&self, k: usize) -> &[f64] {
        let from = self.structure.jacobian.len() + k * self.rows.len();
        &self.outputs[from..from + self.rows.len()]
    }

    /// Values of the further nodes after `functions` functions.
    #[must_use]
    pub fn further(&self, functions: usize) -> &[f64] {
        &self.outputs[self.structure.jacobian.len() + functions * self.rows.len()..]
    }

    /// The program, with how often it was run.
    pub fn used(&mut self, spare: bool) -> Used<'_> {
        Used::new(&mut self.program, self.workspace.runs(), spare)
    }

    /// The program, for its counts.
    #[must_use]
    pub fn program(&self) -> &Program {
        &self.program
    }

    /// Calls `found(k, gradient)` with the length of the gradient of each row, rotations taken on `length`.
    fn gradients(&self, length: f64, mut found: impl FnMut(usize, f64)) {
        let mut at = 0;
        let entries = &self.structure.jacobian;
        let numbers = self.jacobian();
        for k in 0..self.rows.len() {
            let mut square = 0.0;
            while at < entries.len() && entries[at].0 == k {
                let scale = if entries[at].1 % 6 < 3 { 1.0 } else { 1.0 / length };
                square += (numbers[at] * scale).powi(2);
                at += 1;
            }
            found(k, f64::sqrt(square));
        }
    }

    /// How far each row is from being met, as a displacement: value over the length of its gradient, rotations taken on
    /// `length`. Calls `found(row, violation)`.
    pub fn violations(&self, values: &[f64], length: f64, mut found: impl FnMut(usize, f64)) {
        self.gradients(length, |k, gradient| found(self.rows[k], violation(values[k], gradient)));
    }

    /// Largest violation of `values`, and its row.
    #[must_use]
    pub fn worst(&self, values: &[f64], length: f64) -> (f64, Option<usize>) {
        let [worst] = self.worst_of([values], length);
        worst
    }

    /// The same of several values of each row.
    #[must_use]
    pub fn worst_of<const N: usize>(&self, values: [&[f64]; N], length: f64) -> [(f64, Option<usize>); N] {
        let mut worst = [(0.0, None); N];
        self.gradients(length, |k, gradient| {
            for (worst, values) in worst.iter_mut().zip(values) {
                let violation = violation(values[k], gradient);
                // NaN wins, so that it is not lost.
                if violation.is_nan() || violation > worst.0 {
                    *worst = (violation, Some(self.rows[k]));
                }
            }
        });
        worst
    }
}

/// How far a row with such a value and gradient is from being met.
fn violation(value: f64, gradient: f64) -> f64 {
    if gradient > 0.0 { value.abs() / gradient } else { value.abs() }
}

/// Patterns of the mass matrix and of the Jacobian of a choice of rows.
pub(super) fn structure(equations: &Equations, rows: &[usize]) -> Result<KktStructure, LinalgError> {
    let mut jacobian = Vec::with_capacity(rows.iter().map(|row| equations.rows[*row].jacobian.len()).sum());
    for (k, row) in rows.iter().enumerate() {
        jacobian.extend(equations.rows[*row].jacobian.iter().map(|(column, _)| (k, *column)));
    }
    let bodies = equations.bodies.len();
    KktStructure::new(6 * bodies, rows.len(), mass_pattern(bodies), jacobian)
}

/// Entries of the mass matrix per body.
const MASSES: usize = 9;

/// Lower triangles of one diagonal translation block and one full rotation block per body, by columns.
fn mass_pattern(bodies: usize) -> Vec<(usize, usize)> {
    let mut pattern = Vec::with_capacity(MASSES * bodies);
    for body in 0..bodies {
        let at = 6 * body;
        pattern.extend((0..3).map(|k| (at + k, at + k)));
        for column in 3..6 {
            pattern.extend((column..6).map(|row| (at + row, at + column)));
        }
    }
    pattern
}

/// The lower triangle of the mass matrix with [`mass_values`]: (row, column, value).
pub(super) fn mass_entries(masses: &[f64]) -> Vec<(usize, usize, f64)> {
    let pattern = mass_pattern(masses.len() / MASSES);
    pattern.into_iter().zip(masses).map(|((row, column), value)| (row, column, *value)).collect()
}

/// Values of the mass matrix, aligned with the pattern.
#[must_use]
pub fn mass_values(model: &Model) -> Vec<f64> {
    masses(model.bodies.iter().map(|body| (body.mass, body.inertia)))
}

/// The same of any masses and inertias.
pub(super) fn masses(bodies: impl Iterator<Item = (f64, Matrix3<f64>)>) -> Vec<f64> {
    let mut values = Vec::with_capacity(MASSES * bodies.size_hint().0);
    for (mass, inertia) in bodies {
        values.extend([mass; 3]);
        for column in 0..3 {
            values.extend((column..3).map(|row| inertia[(row, column)]));
        }
    }
    values
}
