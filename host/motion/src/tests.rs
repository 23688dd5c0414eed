//! What the tests of several rooms share: short ways from the text of a scene to a model and to its equations.

#![allow(clippy::unwrap_used)] // in a test, the panic is the message

#[path = "../../testing/foreign/mod.rs"]
mod foreign;

pub use foreign::*;

use crate::analysis::{Assembly, Constraints, assemble, mass_values, sparse_engine, start_inputs};
use crate::diagnostics::Diagnostic;
use crate::linalg::KktSolver;
use crate::model::{Model, resolve};
use crate::plan::{Layout, Plan, Probe, body_scales, poses_of_bodies};
use crate::program::{Equations, Form};

/// The model of a scene, with what the user should know, or all mistakes.
#[track_caller]
pub fn resolved(text: &str) -> Result<(Model, Vec<Diagnostic>), Vec<Diagnostic>> {
    resolve(&scene(text), &catalog(), false)
}

/// The model of a scene that has no mistakes.
#[track_caller]
pub fn model(text: &str) -> Model {
    resolved(text).unwrap_or_else(|found| panic!("{found:#?}")).0
}

/// A model with its equations, its start and its plan.
pub struct Prepared {
    pub model: Model,
    pub equations: Equations,
    pub assembly: Assembly,
    pub plan: Plan,
}

/// Everything before time starts, in the order of the rooms.
#[track_caller]
pub fn prepared(text: &str) -> Prepared {
    let model = model(text);
    let layout = Layout::new(&model);
    let equations = Equations::build(&model, &layout, Form::Working);
    let assembly = assemble(&equations, &model, &layout, 0.0).unwrap_or_else(|error| panic!("{error}"));
    let all: Vec<usize> = (0..layout.rows).collect();
    let mut rows = Constraints::new(&equations, &all, &[], &[]).unwrap();
    rows.evaluate(&start_inputs(&layout, 0.0, &assembly), &model.sets).unwrap();
    let (positions, rotations) = poses_of_bodies(&assembly.working, layout.bodies);
    let mass = mass_values(&model);
    let probe = Probe {
        rows: &all,
        structure: &rows.structure,
        mass: &mass,
        jacobian: rows.jacobian(),
        positions: &positions,
        rotations: &rotations,
        length: assembly.scales.length,
        scales: &body_scales(&model, assembly.scales.length),
    };
    let plan = Plan::decide(&model, &layout, &probe, None, |chosen, mass| {
        let mut solver = sparse_engine(&equations, chosen, &layout)?;
        solver.set_mass(mass)?;
        let entries = rows.structure.jacobian.iter().zip(rows.jacobian());
        let picked: Vec<f64> = entries.filter(|((row, _), _)| chosen.contains(row)).map(|(_, value)| *value).collect();
        solver.refactor(&picked)
    })
    .unwrap();
    Prepared { model, equations, assembly, plan }
}

impl Random {
    /// Euler parameters of length one.
    pub fn euler_parameters(&mut self) -> [f64; 4] {
        loop {
            let p: [f64; 4] = std::array::from_fn(|_| self.next());
            let length = p.iter().map(|e| e * e).sum::<f64>().sqrt();
            if length > 0.1 {
                return p.map(|e| e / length);
            }
        }
    }
}
