//! What a picture of the motion takes of a state, beside the channels.

use nalgebra::Matrix3;

use super::system::failure;
use super::{Part, Simulation};
use crate::analysis::{AnalysisError, Formulation};
use crate::integrate::Failure;
use crate::model::{Model, euler_parameters};
use crate::plan::Layout;
use crate::program::{Equations, Used};
use crate::results::POSE;

/// Programs of their own: what the channels need stays as it is.
pub(super) struct Picture {
    poses: Part,
    /// None where nothing acts.
    loads: Option<Part>,
    /// Seven values per body, six per load.
    values: Vec<f64>,
    /// Room for the inputs of the working form.
    observed: Vec<f64>,
}

impl Picture {
    /// For the bodies and loads of a model.
    pub(super) fn new(formulation: &dyn Formulation, equations: &Equations, model: &Model, layout: &Layout) -> Self {
        // A copy: whatever goes through all equations does not meet these nodes.
        let mut equations = equations.clone();
        let (poses, loads) = (equations.poses(model, layout), equations.shown_loads(model, layout));
        Self {
            poses: Part::near(formulation, &equations, &poses, layout),
            loads: (!loads.is_empty()).then(|| Part::near(formulation, &equations, &loads, layout)),
            values: vec![0.0; POSE * model.bodies.len() + loads.len()],
            observed: Vec::with_capacity(layout.inputs()),
        }
    }

    /// Poses and loads at a state. Loads that cannot be found there are no numbers.
    ///
    /// # Errors
    /// See [`AnalysisError`].
    fn take(&mut self, formulation: &mut dyn Formulation, t: f64, state: &[f64]) -> Result<&[f64], AnalysisError> {
        let found = self.poses.at(formulation, &mut self.observed, t, state)?;
        let (poses, loads) = self.values.split_at_mut(POSE * found.len() / 12);
        for (pose, found) in poses.chunks_exact_mut(POSE).zip(found.chunks_exact(12)) {
            pose[..3].copy_from_slice(&found[..3]);
            pose[3..].copy_from_slice(&euler_parameters(&Matrix3::from_row_slice(&found[3..])));
        }
        if let Some(part) = &mut self.loads {
            match part.at(formulation, &mut self.observed, t, state) {
                Ok(found) => loads.copy_from_slice(found),
                Err(_) => loads.fill(f64::NAN),
            }
        }
        Ok(&self.values)
    }

    pub(super) fn used(&mut self) -> impl Iterator<Item = Used<'_>> {
        self.poses.used().chain(self.loads.iter_mut().flat_map(Part::used))
    }
}

impl Simulation<'_> {
    /// Gives a picture to whoever takes the rows, if they take pictures. Nothing of it shows in what follows.
    pub(super) fn take_picture(&mut self, number: usize, t: f64, state: &[f64]) -> Result<(), Failure> {
        let Some(picture) = &mut self.picture else { return Ok(()) };
        let traces = self.formulation.traces();
        let values = picture.take(self.formulation.as_mut(), t, state);
        self.formulation.forget_since(&traces);
        let values = values.map_err(failure)?;
        self.rows_taken.sink().picture(number, values).map_err(|error| Failure::Fatal(Box::new(error)))
    }
}
