//! [`Margins`]: what elements want looked at while a scene runs: margins of their checks, arguments of grids, what they report.

use serde::{Deserialize, Serialize};

use super::Part;
use crate::analysis::{AnalysisError, Formulation};
use crate::model::{Model, Watched, WatchedValue};
use crate::plan::Layout;
use crate::program::{Equations, Node, Used};

/// An argument counts as outside of a grid from this share of the grid's length; less is round-off.
const OUTSIDE: f64 = 1e-9;

/// The extremes of a value, SI units.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(in crate::session) struct Extremes {
    /// The smallest, and its time, s.
    pub(in crate::session) smallest: [f64; 2],
    /// The largest, and its time, s.
    pub(in crate::session) largest: [f64; 2],
    /// First time beyond its bounds, s.
    #[serde(default)]
    pub(in crate::session) first: Option<f64>,
}

/// Values that are looked at in accepted states and at samples.
pub(super) struct Margins {
    part: Part,
    bounds: Vec<[f64; 2]>,
    /// Nothing before the first look.
    found: Vec<Extremes>,
}

impl Margins {
    /// Of a model in which there is something to look at.
    pub(super) fn new(
        equations: &Equations,
        model: &Model,
        layout: &Layout,
        formulation: &dyn Formulation,
    ) -> Option<Self> {
        let watched = model.watched();
        if watched.is_empty() {
            return None;
        }
        let nodes: Vec<Node> = watched.iter().map(|one| equations.watched(one)).collect();
        let bounds = watched.iter().map(|one| bounds(model, one)).collect();
        Some(Self { part: Part::near(formulation, equations, &nodes, layout), bounds, found: Vec::new() })
    }

    pub(super) fn used(&mut self) -> impl Iterator<Item = Used<'_>> {
        self.part.used()
    }

    pub(super) fn part(&self) -> &Part {
        &self.part
    }

    /// Looks at a state; `inputs` is room for those of the working form.
    pub(super) fn look(
        &mut self,
        formulation: &mut dyn Formulation,
        inputs: &mut Vec<f64>,
        t: f64,
        state: &[f64],
    ) -> Result<(), AnalysisError> {
        let values = self.part.at(formulation, inputs, t, state)?;
        if self.found.is_empty() {
            let first = |value: &f64| Extremes { smallest: [*value, t], largest: [*value, t], first: None };
            self.found = values.iter().map(first).collect();
        }
        for ((found, value), [low, high]) in self.found.iter_mut().zip(values).zip(&self.bounds) {
            let value = *value;
            // What is not a number stays.
            if value < found.smallest[0] || value.is_nan() && !found.smallest[0].is_nan() {
                found.smallest = [value, t];
            }
            if value > found.largest[0] || value.is_nan() && !found.largest[0].is_nan() {
                found.largest = [value, t];
            }
            let within = *low <= value && value <= *high;
            if !within && found.first.is_none_or(|first| t < first) {
                found.first = Some(t);
            }
        }
        Ok(())
    }

    /// What was seen so far, in the order of [`Model::watched`].
    pub(super) fn found(&self) -> &[Extremes] {
        &self.found
    }

    /// Goes on from what was seen before.
    pub(super) fn carry_on(&mut self, found: &[Extremes]) {
        if found.is_empty() || found.len() == self.bounds.len() {
            self.found = found.to_vec();
        }
    }
}

fn bounds(model: &Model, watched: &Watched) -> [f64; 2] {
    match watched.value {
        WatchedValue::Channel(_) => [f64::NEG_INFINITY, f64::INFINITY],
        WatchedValue::Check(_) => [0.0, f64::INFINITY],
        WatchedValue::Grid(k) => {
            let [low, high] = model.elements[watched.element].grids[k].bounds;
            let length = if (high - low).is_finite() { high - low } else { low.abs().min(high.abs()) };
            let least = OUTSIDE * length;
            [low - least, high + least]
        }
    }
}
