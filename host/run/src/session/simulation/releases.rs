//! Joints that let go for good, during a run: where steps must end for it, and what of contacts is gone with them.

use std::borrow::Cow;

use super::Simulation;
use super::contacts::Touch;
use super::part::Part;
use crate::analysis::{AnalysisError, Contacts, Formulation};
use crate::model::{Instance, Model};
use crate::plan::Layout;
use crate::program::{Equations, Node, Releasing};
use crate::results::{Event, EventKind, significant};

/// What is left of a bound, as a share of its size, below which it is reached.
const REACHED: f64 = 1e-9;

/// The same beyond which what began at a bound has left it; steps end where it is twice as much.
const BEYOND: f64 = 5e-14;
/// How far ahead it is looked for a jump, as a share of the last step, and in roundings of the time.
const JUMP: f64 = 1e-12;
const ROUNDINGS: f64 = 16.0;
/// The same for what leaves a bound, as a share of the last step and of the time that it takes to move by the size of the scene.
const SOON: f64 = 1e-4;

/// The joints of a scene that may be released.
pub(super) struct Releases {
    list: Vec<Releasing>,
    /// What decides of each, SI.
    values: Part,
    /// What the rest of a bound is compared with.
    sizes: Vec<f64>,
    /// Whether each is decided by the time.
    of_time: Vec<bool>,
    /// What has been within its bounds since the run began: it is over as soon as one is reached. What begins at a bound has to go
    /// beyond it.
    was_within: Vec<bool>,
    /// Name of each, of what decides, and its unit with that in SI.
    names: Vec<(String, String, String, f64)>,
}

impl Releases {
    pub(super) fn new(equations: &Equations, model: &Model, layout: &Layout, formulation: &dyn Formulation) -> Self {
        let list = equations.releases.clone();
        let nodes: Vec<Node> = list.iter().map(|one| one.value).collect();
        let names = list.iter().filter_map(|one| {
            let element = &model.elements[one.element];
            let release = element.release.as_ref()?;
            Some((element.name.clone(), release.name.clone(), release.unit.clone(), release.factor))
        });
        Self {
            values: Part::near(formulation, equations, &nodes, layout),
            sizes: vec![1.0; list.len()],
            of_time: list.iter().map(|one| is_of_time(&model.elements[one.element])).collect(),
            was_within: vec![false; list.len()],
            names: names.collect(),
            list,
        }
    }

    pub(super) fn count(&self) -> usize {
        self.list.len()
    }

    pub(super) fn used(&mut self) -> impl Iterator<Item = crate::program::Used<'_>> {
        self.values.used()
    }

    /// What is left of the bounds of each, over its size; nothing of those that are gone.
    fn left(&self, k: usize, values: &[f64]) -> Option<f64> {
        let one = &self.list[k];
        (!one.gone).then(|| one.left(values[k]) / self.sizes[k])
    }

    /// Those of which as much is left as `is_due` says, with what decides.
    fn due(&self, values: &[f64], is_due: impl Fn(usize, f64) -> bool) -> Vec<(usize, f64)> {
        let due = (0..self.list.len()).filter(|k| self.left(*k, values).is_some_and(|left| is_due(*k, left)));
        due.map(|k| (self.list[k].element, values[k])).collect()
    }

    /// What bounds and values are of the size of, at a value.
    fn size(one: &Releasing, value: f64) -> f64 {
        let size = one.bounds.iter().map(|(_, bound)| bound.abs()).fold(value.abs(), f64::max);
        if size > 0.0 { size } else { 1.0 }
    }
}

fn is_of_time(joint: &Instance) -> bool {
    joint.release.as_ref().is_some_and(|release| release.quantity.is_none())
}

impl Touch {
    /// What stays still within steps: what is closed or sticks, and, behind these, what was released.
    pub(super) fn still(&self) -> Cow<'_, [usize]> {
        let first = self.levels.len();
        let mut gone: Vec<usize> = (0..self.releases.count()).filter(|k| self.releases.list[*k].gone).collect();
        if gone.is_empty() {
            return Cow::Borrowed(&self.closed);
        }
        gone.iter_mut().for_each(|k| *k += first);
        gone.extend((0..first).filter(|k| self.contacts.is_gone(*k)));
        gone.extend(&self.closed);
        gone.sort_unstable();
        Cow::Owned(gone)
    }
}

impl Simulation<'_> {
    /// What decides on releases, SI; nothing is looked at where all are over.
    fn deciding(&mut self, t: f64, state: &[f64]) -> Result<Vec<f64>, AnalysisError> {
        let Some(touch) = &mut self.touch else { return Ok(Vec::new()) };
        let Releases { list, values, names, .. } = &mut touch.releases;
        if list.iter().all(|one| one.gone) {
            return Ok(vec![0.0; list.len()]);
        }
        let found = values.at(self.formulation.as_mut(), &mut self.observed, t, state)?;
        match list.iter().zip(found).position(|(one, value)| !one.gone && value.is_nan()) {
            None => Ok(found.to_vec()),
            Some(k) => {
                let (joint, name, ..) = &names[k];
                Err(AnalysisError::NotFinite { what: format!("`{name}`, which decides on the release of `{joint}`,") })
            }
        }
    }

    /// What is left until each joint is released, over its size.
    pub(super) fn left_until_release(&mut self, t: f64, state: &[f64], left: &mut [f64]) -> Result<(), AnalysisError> {
        if left.is_empty() {
            return Ok(());
        }
        let values = self.deciding(t, state)?;
        let Some(Touch { releases, .. }) = &mut self.touch else { return Ok(()) };
        for (k, left) in left.iter_mut().enumerate() {
            let one = &releases.list[k];
            *left = if one.gone { 1.0 } else { one.left(values[k]) / releases.sizes[k] };
            releases.was_within[k] |= *left > REACHED;
        }
        Ok(())
    }

    /// The joints that are released at an accepted state, by their elements, with what decided, SI; the sizes of the others are taken
    /// anew. `again`: steps have ended at this time before, so that something must be.
    ///
    /// # Errors
    /// See [`AnalysisError`].
    pub(in crate::session) fn due_releases(
        &mut self,
        t: f64,
        state: &[f64],
        again: bool,
    ) -> Result<Vec<(usize, f64)>, AnalysisError> {
        let values = self.deciding(t, state)?;
        let Some(Touch { releases, .. }) = &mut self.touch else { return Ok(Vec::new()) };
        for ((one, size), value) in releases.list.iter().zip(&mut releases.sizes).zip(&values) {
            *size = Releases::size(one, *value);
        }
        let reached = |k: usize| releases.of_time[k] || releases.was_within[k];
        let due = releases.due(&values, |k, left| left <= if reached(k) { REACHED } else { -BEYOND });
        if !due.is_empty() || !again {
            return Ok(due);
        }
        // Steps end here once more, and nothing is due: what decides jumps, or leaves a bound that it began at.
        let step = self.last_steps[0].max(self.last_steps[1]);
        let behind = self.deciding_ahead(JUMP * step + ROUNDINGS * f64::EPSILON * t.abs(), t, state)?;
        let there = self.deciding_ahead((SOON * step).max(SOON * self.scales.length / self.speed()), t, state)?;
        let Some(Touch { releases, .. }) = &self.touch else { return Ok(Vec::new()) };
        let is_at = |k: usize| releases.left(k, &values).is_some_and(|left| left <= REACHED);
        let leaves = |k: usize| is_at(k) && releases.left(k, &there).is_some_and(|left| left < 0.0);
        Ok(releases.due(&behind, |k, left| left <= -REACHED || leaves(k)))
    }

    /// What decides on releases a moment later.
    fn deciding_ahead(&mut self, ahead: f64, t: f64, state: &[f64]) -> Result<Vec<f64>, AnalysisError> {
        let there = self.state_ahead(ahead, t, state)?;
        self.deciding(t + ahead, &there)
    }

    /// The state a moment later.
    pub(super) fn state_ahead(&mut self, ahead: f64, t: f64, state: &[f64]) -> Result<Vec<f64>, AnalysisError> {
        let mut rates = [vec![0.0; state.len()], vec![0.0; state.len()]];
        self.formulation.rates(t, state, &mut rates[0])?;
        let mut there: Vec<f64> = state.iter().zip(&rates[0]).map(|(y, rate)| y + ahead * rate).collect();
        self.formulation.rates(t + ahead, &there, &mut rates[1])?;
        for (k, y) in there.iter_mut().enumerate() {
            *y = state[k] + 0.5 * ahead * (rates[0][k] + rates[1][k]);
        }
        Ok(there)
    }

    /// Whether steps ended at this time before.
    pub(in crate::session) fn was_met_at(&self, t: f64) -> bool {
        self.touch.as_ref().is_some_and(|touch| touch.was_met_at(t))
    }

    /// Reports that joints have let go.
    ///
    /// # Errors
    /// See [`AnalysisError`].
    pub(in crate::session) fn report_releases(&mut self, t: f64, due: &[(usize, f64)]) -> Result<(), AnalysisError> {
        let Some(Touch { releases, .. }) = &self.touch else { return Ok(()) };
        let event = |(element, value): &(usize, f64)| {
            let k = releases.list.iter().position(|one| one.element == *element)?;
            let (joint, name, unit, factor) = releases.names[k].clone();
            let unit = if unit == "1" { String::new() } else { format!(" {unit}") };
            let row = format!("{name} = {}{unit}", significant(value / factor, 9));
            let kind = EventKind::Releases;
            Some(Event { time: t, element: joint, row, kind, rates: [0.0; 2], impulse: 0.0, lost: 0.0 })
        };
        let events: Vec<Event> = due.iter().filter_map(event).collect();
        self.send(&events)
    }

    /// Knows which joints have let go, as `equations` have it: other equations than those made from these are not to be used any more.
    ///
    /// # Errors
    /// When the linear algebra refuses the model.
    pub(in crate::session) fn forget_released(
        &mut self,
        equations: &mut Equations,
        model: &Model,
    ) -> Result<(), AnalysisError> {
        let (layout, length) = (&self.layout, self.scales.length);
        let Some(touch) = &mut self.touch else { return Ok(()) };
        touch.forget_modes();
        touch.contacts = Contacts::new(equations, model, layout, length)?;
        touch.releases.list.iter_mut().zip(&equations.releases).for_each(|(own, one)| own.gone = one.gone);
        Ok(())
    }

    /// Begins anew at another time.
    pub(super) fn forget_bounds(&mut self) {
        self.touch.iter_mut().for_each(|touch| touch.releases.was_within.fill(false));
    }

    /// The joints that have let go, by their elements.
    pub(in crate::session) fn released(&self) -> Vec<usize> {
        let list = self.touch.as_ref().map_or(&[][..], |touch| &touch.releases.list);
        list.iter().filter(|one| one.gone).map(|one| one.element).collect()
    }
}
