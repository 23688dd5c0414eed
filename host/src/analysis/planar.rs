//! [`PlanarForm`]: the working form of a motion that is proved to stay parallel to a plane.

use element_api::ElementSet;

use super::formulation::{AnalysisError, Counters, Formulation, Group, Observed};
use super::working::WorkingForm;
use crate::model::Model;
use crate::plan::Plan;
use crate::program::{Equations, Graph, Node, Planar, Used};

/// A [`WorkingForm`] of the planar equations. The state is that of the spatial form; what lies across the plane never
/// changes.
pub struct PlanarForm {
    form: WorkingForm,
    /// Entries of the state across the plane.
    still: Vec<usize>,
    /// Their values.
    values: Vec<f64>,
}

impl PlanarForm {
    /// Prepares programs and engines; `plan` is that of the rows along the plane.
    ///
    /// # Errors
    /// When the linear algebra refuses the model's mass matrix.
    pub fn new(
        planar: &Planar,
        model: &mut Model,
        plan: &Plan,
        length: f64,
        start_health: f64,
    ) -> Result<Self, AnalysisError> {
        let form = WorkingForm::new(&planar.equations, model, plan, length, start_health)?;
        let values = planar.still.iter().map(|at| planar.start[*at]).collect();
        Ok(Self { form, still: planar.still.clone(), values })
    }

    /// Operations per evaluation of the right side.
    #[must_use]
    pub fn operations(&self) -> usize {
        self.form.operations()
    }

    fn hold(&self, state: &mut [f64]) {
        self.still.iter().zip(&self.values).for_each(|(at, value)| state[*at] = *value);
    }
}

impl Formulation for PlanarForm {
    fn name(&self) -> &'static str {
        match self.form.name() {
            "sparse" => "planar, sparse",
            _ => "planar, rank-safe",
        }
    }

    fn groups(&self) -> &[Group] {
        self.form.groups()
    }

    fn state_of(&mut self, working: &[f64], state: &mut [f64]) {
        self.form.state_of(working, state);
        self.hold(state);
    }

    fn forget(&mut self, working: &[f64]) {
        self.form.forget(working);
    }

    fn set_discrete(&mut self, references: &[f64], discrete: &[f64]) {
        self.form.set_discrete(references, discrete);
    }

    fn rates(&mut self, t: f64, state: &[f64], rates: &mut [f64]) -> Result<(), AnalysisError> {
        self.form.rates(t, state, rates)?;
        self.still.iter().for_each(|at| rates[*at] = 0.0);
        Ok(())
    }

    fn project(&mut self, t: f64, state: &mut [f64]) -> Result<(), AnalysisError> {
        self.form.project(t, state)?;
        self.hold(state);
        Ok(())
    }

    fn certify(&mut self, t: f64, state: &[f64]) -> Result<(), AnalysisError> {
        self.form.certify(t, state)
    }

    fn next_step(&mut self, t: f64, state: &[f64]) -> Result<(), AnalysisError> {
        self.form.next_step(t, state)
    }

    fn observe(&mut self, t: f64, state: &[f64], dynamics: bool) -> Result<Observed<'_>, AnalysisError> {
        self.form.observe(t, state, dynamics)
    }

    fn entry_of(&self, slot: usize) -> Option<usize> {
        self.form.entry_of(slot)
    }

    fn written_in_state(&self, equations: &Equations, nodes: &[Node]) -> Option<(Graph, Vec<Node>)> {
        self.form.written_in_state(equations, nodes)
    }

    fn programs(&mut self) -> Vec<Used<'_>> {
        self.form.programs()
    }

    fn offer_jacobian(&mut self, equations: &Equations) {
        // Directions must be inputs, not the numbers that the planar equations have in their place.
        self.form.offer_jacobian(equations);
    }

    fn jacobian(&mut self, t: f64, state: &[f64], matrix: &mut [f64]) -> Result<bool, AnalysisError> {
        let known = self.form.jacobian(t, state, matrix)?;
        // Across the plane nothing depends on anything.
        let n = state.len();
        for at in &self.still {
            matrix[n * at..n * (at + 1)].fill(0.0);
            matrix.iter_mut().skip(*at).step_by(n).for_each(|entry| *entry = 0.0);
        }
        Ok(known)
    }

    fn leaves_rows_out(&self) -> bool {
        self.form.leaves_rows_out()
    }

    fn counters(&self) -> Counters {
        self.form.counters()
    }

    fn sets_mut(&mut self) -> &mut [Box<dyn ElementSet>] {
        self.form.sets_mut()
    }

    fn sets(&self) -> &[Box<dyn ElementSet>] {
        self.form.sets()
    }
}
