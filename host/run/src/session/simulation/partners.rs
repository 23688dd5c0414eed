//! Elements that compute by themselves from one communication point to the next: models of other tools.
//!
//! At a point t each of them first computes up to there with what it was given at its last one; then all other elements that
//! sample do so; then what it is given from t on is looked up, from values of the same instant (Jacobi's scheme: what it gives
//! at t does not depend on what it takes at t). Steps end at the points, and a step that was accepted is never taken back, so no
//! communication step is repeated.

use std::ops::Range;

use super::Simulation;
use crate::analysis::{AnalysisError, Formulation};
use crate::model::Model;
use crate::plan::Layout;
use element_api::set::Fault;

/// Times that inputs and outputs at the start are passed on, in search of values that fit each other.
const MOST_PASSES: usize = 50;
/// Differences of them that are round-off.
const SETTLED: f64 = 1e-12;

/// An instance that computes by itself between its samples.
#[derive(Debug, Clone)]
pub(super) struct Partner {
    pub(super) set: usize,
    pub(super) instance: usize,
    /// Its discrete states, among all.
    pub(super) memory: Range<usize>,
}

impl Partner {
    /// Those of a model.
    pub(super) fn all(model: &Model, layout: &Layout, formulation: &dyn Formulation) -> Vec<Self> {
        let elements = model.elements.iter().enumerate();
        let partners = elements.filter(|(_, element)| formulation.sets()[element.set].communicates());
        let partners = partners.map(|(number, element)| {
            let first = layout.discrete_at[number];
            let memory = first..first + element.recording.initial_discrete.len();
            Self { set: element.set, instance: element.index as usize, memory }
        });
        partners.collect()
    }
}

impl Simulation<'_> {
    /// Lets those that are due at an accepted time compute up to it; whether there were any.
    ///
    /// # Errors
    /// One of them failed.
    pub(super) fn communicate(&mut self, t: f64) -> Result<bool, AnalysisError> {
        let mut any = false;
        for number in 0..self.partners.len() {
            if let Some(instant) = self.clocks.instant(&self.partners[number].memory, t) {
                self.ask_partner(number, instant, false)?;
                any = true;
            }
        }
        if any {
            self.tell_discrete();
        }
        Ok(any)
    }

    fn ask_partner(&mut self, number: usize, t: f64, begins: bool) -> Result<(), AnalysisError> {
        let Partner { set, instance, memory } = self.partners[number].clone();
        let done = self.formulation.sets_mut()[set].communicate(instance, t, begins, &mut self.discrete[memory]);
        done.map_err(|fault| AnalysisError::Element { set, fault })
    }

    /// Looks up what they are given from the time `t` on, as it is just `behind` that: [`Clocks::behind`]. All of them, since those that
    /// are not due hold what they took.
    ///
    /// [`Clocks::behind`]: crate::session::clocks::Clocks::behind
    ///
    /// # Errors
    /// Equations without a value there.
    pub(super) fn give_to_partners(&mut self, t: f64, behind: f64, state: &[f64]) -> Result<(), AnalysisError> {
        let found = self.accept.at(self.formulation.as_mut(), &mut self.observed, behind, state)?;
        let discrete = &found[self.counted.len()..];
        for Partner { memory, .. } in &self.partners {
            if self.clocks.has_sampled(memory, t) {
                self.discrete[memory.clone()].copy_from_slice(&discrete[memory.clone()]);
            }
        }
        self.tell_discrete();
        Ok(())
    }

    /// Starts them, where the run does not continue from another one, and passes values on until those at the start fit each other.
    ///
    /// # Errors
    /// One of them failed, or there are no such values.
    pub(super) fn begin_partners(&mut self, t: f64, state: &[f64]) -> Result<(), AnalysisError> {
        if self.partners.is_empty() || self.clocks.are_carried() {
            return Ok(());
        }
        for _ in 0..MOST_PASSES {
            let before = self.discrete.clone();
            self.begin_partners_once(t, state)?;
            let close = |(a, b): (&f64, &f64)| a == b || (a - b).abs() <= SETTLED * a.abs().max(b.abs());
            if before.iter().zip(&self.discrete).all(close) {
                return Ok(());
            }
        }
        let Partner { set, instance, .. } = self.partners[0];
        let message = "its outputs at the start depend on its inputs and these on its outputs, and no values were found that fit: put \
                       something with a state between (a transfer function, a sensor with a time constant)";
        Err(AnalysisError::Element { set, fault: Fault { instance, message: message.into() } })
    }

    /// One pass of that: inputs looked up, outputs taken.
    pub(super) fn begin_partners_once(&mut self, t: f64, state: &[f64]) -> Result<(), AnalysisError> {
        if self.partners.is_empty() || self.clocks.are_carried() {
            return Ok(());
        }
        let found = self.accept.at(self.formulation.as_mut(), &mut self.observed, t, state)?;
        let discrete = &found[self.counted.len()..];
        for Partner { memory, .. } in &self.partners {
            self.discrete[memory.clone()].copy_from_slice(&discrete[memory.clone()]);
        }
        for number in 0..self.partners.len() {
            self.ask_partner(number, t, true)?;
        }
        self.tell_discrete();
        Ok(())
    }
}
