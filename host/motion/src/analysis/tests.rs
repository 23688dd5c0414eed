//! Accelerations, multipliers, projections and assembly against the equations they solve.

#![allow(clippy::unwrap_used)] // in a test, the panic is the message

mod assembly;
mod dynamics;
mod joint;
mod joint_ways;
mod linearisation;
mod long_trees;
mod passage;
mod projection;
mod twice;

use nalgebra::{DMatrix, DVector};

use super::*;
use crate::model::Model;
use crate::plan::Layout;
use crate::program::{Equations, Node, Program};
use crate::tests::{Prepared, Random, prepared, scenes};

/// A scene in the working form, its state at the start, and what the equations need to be looked at from outside.
struct Stand {
    model: Model,
    equations: Equations,
    layout: Layout,
    form: WorkingForm,
    state: Vec<f64>,
    length: f64,
}

#[track_caller]
fn stand(text: &str) -> Stand {
    let Prepared { mut model, equations, assembly, plan } = prepared(text);
    let length = assembly.scales.length;
    let mut form = WorkingForm::new(&equations, &mut model, &plan, length).unwrap();
    form.set_discrete(&assembly.references, &assembly.discrete);
    Stand { model, equations, layout: plan.layout, form, state: assembly.working, length }
}

/// The same scene in the paper's form.
#[track_caller]
fn reference(text: &str) -> ReferenceForm {
    let Prepared { mut model, assembly, plan, .. } = prepared(text);
    let mut form = ReferenceForm::new(&mut model, &plan, assembly.scales.length);
    form.set_discrete(&assembly.references, &assembly.discrete);
    form
}

/// Time at which states are looked at; not zero, since rows may depend on it.
const TIME: f64 = 0.1;

impl Stand {
    /// A random state on the constraints: positions off the start by about `size`, any velocities.
    fn consistent(&mut self, random: &mut Random, size: f64) -> Vec<f64> {
        let mut state = self.disturbed(random, size);
        self.form.next_step(TIME, &state).unwrap();
        self.form.project(TIME, &mut state).unwrap();
        state
    }

    /// The start with positions moved by about `size` and any velocities, on no constraint.
    fn disturbed(&self, random: &mut Random, size: f64) -> Vec<f64> {
        let mut state = self.state.clone();
        for body in 0..self.layout.bodies {
            let y = &mut state[13 * body..13 * (body + 1)];
            y[..7].iter_mut().for_each(|x| *x += size * random.next());
            y[7..].iter_mut().for_each(|x| *x = random.next());
            motion::normalise(&mut y[3..7]);
        }
        state
    }

    /// The numbers of some nodes at given inputs.
    fn values(&self, nodes: &[Node], inputs: &[f64]) -> DVector<f64> {
        let program = Program::compile(&self.equations.graph, nodes);
        let mut found = vec![f64::NAN; nodes.len()];
        program.run(inputs, self.form.sets(), &mut program.workspace(), &mut found).unwrap();
        DVector::from_vec(found)
    }

    /// Phi_q, all rows, dense.
    fn jacobian(&self, inputs: &[f64]) -> DMatrix<f64> {
        let mut matrix = DMatrix::zeros(self.layout.rows, self.layout.velocities());
        for (k, row) in self.equations.rows.iter().enumerate() {
            let nodes: Vec<Node> = row.jacobian.iter().map(|(_, node)| *node).collect();
            let values = self.values(&nodes, inputs);
            row.jacobian.iter().zip(&values).for_each(|((column, _), value)| matrix[(k, *column)] = *value);
        }
        matrix
    }

    fn mass(&self) -> DMatrix<f64> {
        let mut matrix = DMatrix::zeros(self.layout.velocities(), self.layout.velocities());
        for (b, body) in self.model.bodies.iter().enumerate() {
            (0..3).for_each(|k| matrix[(6 * b + k, 6 * b + k)] = body.mass);
            matrix.view_mut((6 * b + 3, 6 * b + 3), (3, 3)).copy_from(&body.inertia);
        }
        matrix
    }

    /// The inputs at a state; accelerations and multipliers too.
    fn inputs(&mut self, state: &[f64]) -> Vec<f64> {
        self.form.observe(TIME, state, true).unwrap().inputs.to_vec()
    }

    fn accelerations(&self, inputs: &[f64]) -> DVector<f64> {
        let slot = self.layout.acceleration_slot();
        DVector::from_column_slice(&inputs[slot..slot + self.layout.velocities()])
    }

    fn multipliers(&self, inputs: &[f64]) -> DVector<f64> {
        DVector::from_column_slice(&inputs[self.layout.multiplier_slot()..])
    }

    /// Velocities as a vector.
    fn velocities(&self, state: &[f64]) -> DVector<f64> {
        let bodies = (0..self.layout.bodies).flat_map(|b| &state[13 * b + 7..13 * b + 13]);
        DVector::from_iterator(self.layout.velocities(), bodies.copied())
    }
}

/// An orthonormal basis of the null space of a matrix, column by column.
fn null_space(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    let square = matrix.transpose() * matrix;
    let largest = square.diagonal().max();
    let eigen = square.symmetric_eigen();
    let columns: Vec<_> = (0..matrix.ncols())
        .filter(|k| eigen.eigenvalues[*k] < 1e-12 * largest)
        .map(|k| eigen.eigenvectors.column(k).into_owned())
        .collect();
    DMatrix::from_columns(&columns)
}

fn amax(v: &[f64]) -> f64 {
    v.iter().fold(0.0, |m, x| m.max(x.abs()))
}

fn difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    let off = a.iter().zip(b).map(|(a, b)| (a - b).abs());
    off.fold(0.0_f64, |m, x| if x <= m { m } else { x }) / amax(b).max(1e-300)
}
