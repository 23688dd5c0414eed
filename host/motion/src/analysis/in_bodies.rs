//! [`InBodies`]: a scene in coordinates of bodies, beside its form in those of joints.
//!
//! Where bodies are and how they move is known at once. Accelerations and multipliers are found along the tree of the joints;
//! what remains, next to singular positions, is solved by [`WorkingForm`], which is made when it is first asked for.

use element_api::ElementSet;

use super::assembly::load;
use super::formulation::{AnalysisError, Counters, Formulation, Observed, Traces};
use super::working::{WorkingForm, WorkingParts};
use crate::plan::Layout;
use crate::program::Used;

/// See the module documentation.
pub(super) struct InBodies {
    parts: WorkingParts,
    form: Option<Box<WorkingForm>>,
    /// The opaque elements of the scene.
    pub(super) sets: Vec<Box<dyn ElementSet>>,
    layout: Layout,
    /// The inputs of programs of the form in coordinates of bodies.
    inputs: Vec<f64>,
}

impl InBodies {
    pub(super) fn new(parts: WorkingParts, layout: &Layout, sets: Vec<Box<dyn ElementSet>>) -> Self {
        Self { parts, form: None, sets, layout: layout.clone(), inputs: vec![0.0; layout.inputs()] }
    }

    /// Entries of the mass matrix, as [`mass_values`](super::mass_values).
    pub(super) fn masses(&self) -> &[f64] {
        &self.parts.masses
    }

    /// As [`Formulation::set_discrete`].
    pub(super) fn set_discrete(&mut self, references: &[f64], discrete: &[f64]) {
        self.layout.write_discrete(&mut self.inputs, references, discrete);
        if let Some(form) = &mut self.form {
            form.set_discrete(references, discrete);
        }
    }

    /// As [`Formulation::forget`].
    pub(super) fn forget(&mut self, working: &[f64]) {
        if let Some(form) = &mut self.form {
            form.forget(working);
        }
    }

    /// As [`Formulation::traces`].
    pub(super) fn traces(&self) -> Traces {
        self.form.as_ref().map_or_else(Traces::default, |form| form.traces())
    }

    /// As [`Formulation::forget_since`].
    pub(super) fn forget_since(&mut self, traces: &Traces) {
        if let Some(form) = &mut self.form {
            form.forget_since(traces);
        }
    }

    /// As [`Formulation::observe`], for a state of the bodies.
    pub(super) fn observe(&mut self, t: f64, working: &[f64], dynamics: bool) -> Result<Observed<'_>, AnalysisError> {
        load(&self.layout, t, working, &mut self.inputs);
        let imbalance = if dynamics { self.solve(t, working)? } else { Default::default() };
        Ok(Observed { inputs: &self.inputs, imbalance })
    }

    /// Writes accelerations and multipliers into the inputs.
    fn solve(&mut self, t: f64, working: &[f64]) -> Result<super::Imbalance, AnalysisError> {
        let (references, discrete) = (self.layout.reference_slot(), self.layout.discrete_slot());
        let solved = self.layout.acceleration_slot();
        let form = match &mut self.form {
            Some(form) => form,
            empty => {
                self.parts.equations.write_gammas();
                let mut form = Box::new(WorkingForm::of(&self.parts, Vec::new())?);
                form.set_discrete(&self.inputs[references..discrete], &self.inputs[discrete..solved]);
                empty.insert(form)
            }
        };
        form.trade_sets(&mut self.sets);
        let observed = form.observe(t, working, true);
        let result = observed.map(|observed| {
            self.inputs[solved..].copy_from_slice(&observed.inputs[solved..]);
            observed.imbalance
        });
        form.trade_sets(&mut self.sets);
        result
    }

    /// The programs that are run, if there are any.
    pub(super) fn programs(&mut self) -> Vec<Used<'_>> {
        self.form.as_mut().map_or_else(Vec::new, |form| form.programs())
    }

    /// Work done so far.
    pub(super) fn counters(&self) -> Counters {
        self.form.as_ref().map_or_else(Counters::default, |form| form.counters())
    }
}
