//! [`Model`]: a linear model as plain rows.

use nalgebra::DMatrix;
use serde::Serialize;

use crate::linear::{Linear, Port};

/// [`Linear`] as plain rows, for files and programs.
#[derive(Debug, Clone, Serialize)]
pub struct Model {
    /// s.
    pub time: f64,
    /// Whether the scene neither moves nor accelerates there.
    pub at_rest: bool,
    /// Angular velocity of the axes in which states are seen, rad/s, ground axes; zero: those of the ground.
    pub turning: [f64; 3],
    /// Names of the states.
    pub states: Vec<String>,
    /// What goes in.
    pub inputs: Vec<Port>,
    /// What comes out.
    pub outputs: Vec<Port>,
    /// Rows of A.
    pub a: Vec<Vec<f64>>,
    /// Rows of B.
    pub b: Vec<Vec<f64>>,
    /// Rows of C.
    pub c: Vec<Vec<f64>>,
    /// Rows of D.
    pub d: Vec<Vec<f64>>,
    /// What the linearisation does not say by itself.
    pub notes: Vec<String>,
}

impl Linear {
    /// The same as plain rows.
    #[must_use]
    pub fn plain(&self) -> Model {
        let rows =
            |matrix: &DMatrix<f64>| matrix.row_iter().map(|row| row.iter().copied().collect()).collect::<Vec<_>>();
        Model {
            time: self.time,
            at_rest: self.at_rest,
            turning: self.turning.into(),
            states: self.states.clone(),
            inputs: self.inputs.clone(),
            outputs: self.outputs.clone(),
            a: rows(&self.a),
            b: rows(&self.b),
            c: rows(&self.c),
            d: rows(&self.d),
            notes: self.notes.clone(),
        }
    }
}
