//! What the tests of several rooms share: elements that no library provides, and short ways from the text of a scene to a
//! model and to its equations.

#![allow(clippy::unwrap_used)] // in a test, the panic is the message

mod curves;
mod elements;
#[path = "../testing/random.rs"]
mod random;
pub mod scenes;
mod signal_elements;
mod stored_elements;
mod troublesome_elements;

use curves::*;
use element_api::adapt::{control, force, joint};
use element_api::manifest::Library;
pub use elements::WELD_STEP;
use elements::*;
use nalgebra::Matrix3;
pub use random::Random;
use signal_elements::*;
use stored_elements::*;
use troublesome_elements::*;

use crate::analysis::{Assembly, Constraints, assemble, mass_values, sparse_engine, start_inputs};
use crate::catalog::Catalog;
use crate::diagnostics::{Diagnostic, Source};
use crate::linalg::KktSolver;
use crate::model::{Model, resolve, rotation};
use crate::plan::{Layout, Plan, Probe, body_scales};
use crate::program::{Equations, Form};
use crate::scene::{Scene, parse};

/// The elements of the tests, as a crate would export them.
pub fn library(package: &str) -> Library {
    Library {
        package: package.into(),
        version: "1.0.0".into(),
        about: "foreign elements".into(),
        classes: vec![
            joint::<Hinge<false>>(),
            joint::<Hinge<true>>(),
            joint::<Screw<false>>(),
            joint::<Screw<true>>(),
            joint::<Ball>(),
            joint::<Slide>(),
            joint::<Weld>(),
            joint::<Drive>(),
            joint::<Forgetful>(),
            joint::<NoRows>(),
            force::<Strut<false>>(),
            force::<Strut<true>>(),
            force::<Friction>(),
            force::<Lag>(),
            force::<Relay>(),
            force::<Sill>(),
            force::<Drain>(),
            force::<Tally>(),
            force::<Echo>(),
            force::<Pull>(),
            force::<Early>(),
            joint::<Lead>(),
            force::<Panics>(),
            force::<Push<false>>(),
            force::<Push<true>>(),
            force::<Rub<false>>(),
            force::<Rub<true>>(),
            force::<EndedSpring<DASHPOT>>(),
            force::<EndedSpring<CLOCK>>(),
            force::<EndedSpring<SIGNAL>>(),
            control::<Amplifier>(),
            control::<Smoother<false>>(),
            control::<Smoother<true>>(),
        ],
    }
}

/// A catalog of the elements of the tests.
pub fn catalog() -> Catalog {
    let mut catalog = Catalog::new();
    catalog.add_library(library("foreign")).unwrap();
    catalog
}

/// A scene that must be readable; the section `[simulation]` is added unless it is there.
#[track_caller]
pub fn scene(text: &str) -> Scene {
    let simulation = if text.contains("[simulation]") { "" } else { "[simulation]\nt_end = 1\noutput_step = 0.1\n" };
    let source = Source::new("scene.toml", format!("{text}\n{simulation}"));
    parse(source, &[]).unwrap_or_else(|rejected| panic!("{:#?}", rejected.diagnostics)).0
}

/// The model of a scene, with what the user should know, or all mistakes.
#[track_caller]
pub fn resolved(text: &str) -> Result<(Model, Vec<Diagnostic>), Vec<Diagnostic>> {
    resolve(&scene(text), &catalog())
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
    /// Pivot ratio of the sparse engine at the start; zero where that has none.
    pub start_health: f64,
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
    let body = |k: usize| &assembly.working[13 * k..];
    let rotations: Vec<Matrix3<f64>> =
        (0..layout.bodies).map(|k| rotation(&[body(k)[3], body(k)[4], body(k)[5], body(k)[6]])).collect();
    let mass = mass_values(&model);
    let probe = Probe {
        structure: &rows.structure,
        mass: &mass,
        jacobian: rows.jacobian(),
        rotations: &rotations,
        length: assembly.scales.length,
        scales: &body_scales(&model, assembly.scales.length),
    };
    let mut start_health = 0.0;
    let plan = Plan::decide(&model, &layout, &probe, |chosen, mass| {
        let mut solver = sparse_engine(&equations, chosen, &layout)?;
        solver.set_mass(mass)?;
        let entries = rows.structure.jacobian.iter().zip(rows.jacobian());
        let picked: Vec<f64> = entries.filter(|((row, _), _)| chosen.contains(row)).map(|(_, value)| *value).collect();
        let health = solver.refactor(&picked)?;
        start_health = health.smallest_pivot_ratio;
        Ok(health)
    })
    .unwrap();
    Prepared { model, equations, assembly, plan, start_health }
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
