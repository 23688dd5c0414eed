//! Islands as scenes of their own: whether they run apart, and what each has of the whole.

use std::collections::{BTreeSet, HashMap, HashSet};
use std::time::Instant;

use super::error::SessionError;
use super::opened::Session;
use super::restart::Restart;
use crate::analysis::Assembly;
use crate::plan::{Island, Layout};
use crate::scene::Scene;

/// Number of islands that switch from which on they run apart by themselves: with common steps each switch of one ends a step of all,
/// and makes equations of all.
const MANY_SWITCH: usize = 8;

impl Session {
    /// Whether islands are integrated apart: as the scene says; otherwise where many of them switch, and nothing asks for common steps.
    pub(super) fn runs_apart(&self) -> bool {
        let is_better = || {
            let simulation = &self.scene.simulation;
            simulation.checkpoint_every.is_none() && self.switching_islands() >= MANY_SWITCH && !self.has_fixed_steps()
        };
        self.plan.topology.islands.len() > 1 && self.apart.unwrap_or_else(is_better)
    }

    /// Number of islands with rows or memories that switch.
    fn switching_islands(&self) -> usize {
        let equations = &self.equations;
        let of_rows = equations.switching_rows().map(|row| self.plan.layout.element_of_row(row).0);
        let released = equations.releases.iter().map(|release| release.element);
        let elements: HashSet<usize> =
            of_rows.chain(released).chain(equations.latches.iter().map(|latch| latch.element)).collect();
        let switches = |island: &&Island| island.elements.iter().any(|element| elements.contains(element));
        self.plan.topology.islands.iter().filter(switches).count()
    }

    /// The islands as sessions of their own, from the start of this one.
    ///
    /// # Errors
    /// As for [`Session::open`]; whatever is wrong with an island is wrong with the whole scene, and reported there first.
    pub(super) fn islands(&self) -> Result<Vec<Session>, SessionError> {
        let records = Records::of(&self.scene);
        let open = |island| self.island(&records, island).map_err(|error| self.in_island(island, error));
        self.plan.topology.islands.iter().map(open).collect()
    }

    fn island(&self, records: &Records<'_>, island: &Island) -> Result<Session, SessionError> {
        let (model, mut scene) = (&self.model, records.common.clone());
        // Bodies that are fixed are part of the ground.
        let bodies =
            records.places(&records.bodies, island.bodies.iter().map(|k| &model.bodies[*k].name), &records.fixed);
        scene.bodies = bodies.into_iter().map(|place| self.scene.bodies[place].clone()).collect();
        let copies = island.bodies.iter().map(|k| (model.bodies[*k].name.as_str(), self.plan.topology.copies[*k]));
        let shared: HashMap<&str, usize> = copies.filter(|(_, copies)| *copies > 1).collect();
        for body in &mut scene.bodies {
            if let Some(copies) = shared.get(body.name.value.as_str()) {
                body.share_mass(*copies);
            }
        }
        let elements = records.places(&records.elements, island.elements.iter().map(|k| &model.elements[*k].name), &[]);
        scene.elements = elements.into_iter().map(|place| self.scene.elements[place].clone()).collect();
        let outputs = records.places(&records.outputs, island.channels.iter().map(|k| &model.channels[*k].name), &[]);
        scene.outputs = outputs.into_iter().map(|place| self.scene.outputs[place].clone()).collect();
        let start = Some((self.begins.time, self.share_of(island)));
        let mut own = Self::of_scene(scene, Vec::new(), &self.catalog, &self.options, start, Instant::now())?;
        if let Some(state) = &self.begins.state {
            own.stand_at(own.share_of_state(state))?;
        }
        Ok(own)
    }

    /// What this island, which begins with its share of the whole, has of the state that the whole continues from.
    fn share_of_state(&self, whole: &Restart) -> Restart {
        let own: HashSet<&str> = self.model.elements.iter().map(|element| element.name.as_str()).collect();
        let Assembly { working, references, discrete, .. } = &self.assembly;
        let mut share = Restart::new(&self.model, whole.time, working.clone(), references, discrete);
        share.released = whole.released.iter().filter(|name| own.contains(name.as_str())).cloned().collect();
        share.memories = whole.memories.iter().filter(|(name, _)| own.contains(name.as_str())).cloned().collect();
        share
    }

    /// What an island has of the assembled scene.
    fn share_of(&self, island: &Island) -> Assembly {
        let (layout, whole) = (&self.plan.layout, &self.assembly);
        let mut share = Assembly {
            working: island
                .bodies
                .iter()
                .flat_map(|body| &whole.working[13 * body..13 * (body + 1)])
                .copied()
                .collect(),
            references: Vec::new(),
            discrete: Vec::new(),
            moves: Vec::new(),
            missed: None,
            velocity_misses: Vec::new(),
            chosen: Vec::new(),
            ..*whole
        };
        for element in &island.elements {
            let own = Slices::of(layout, *element);
            share.working.extend(&whole.working[own.states]);
            share.references.extend(&whole.references[own.references]);
            share.discrete.extend(&whole.discrete[own.discrete]);
        }
        share.discrete.extend(&whole.discrete[layout.given_at..]);
        // No work yet.
        share.working.push(0.0);
        share
    }
}

/// The records of a scene by their names, for those of islands.
struct Records<'a> {
    /// What all islands have of the scene.
    common: Scene,
    /// Places of bodies that are fixed.
    fixed: Vec<usize>,
    bodies: HashMap<&'a str, usize>,
    elements: HashMap<&'a str, usize>,
    outputs: HashMap<&'a str, usize>,
}

impl<'a> Records<'a> {
    fn of(scene: &'a Scene) -> Self {
        let mut common = scene.clone();
        common.bodies.clear();
        common.elements.clear();
        common.outputs.clear();
        common.figures.clear();
        common.checks.clear();
        common.verification = None;
        common.simulation.islands = None;
        let is_fixed = |place: &usize| scene.bodies[*place].fixed;
        Self {
            common,
            fixed: (0..scene.bodies.len()).filter(is_fixed).collect(),
            bodies: scene.bodies.iter().enumerate().map(|(k, record)| (record.name.value.as_str(), k)).collect(),
            elements: scene.elements.iter().enumerate().map(|(k, record)| (record.name.value.as_str(), k)).collect(),
            outputs: scene.outputs.iter().enumerate().map(|(k, record)| (record.name.value.as_str(), k)).collect(),
        }
    }

    /// The places of these and of names that are records, ascending.
    fn places<'n>(
        &self,
        records: &HashMap<&str, usize>,
        names: impl Iterator<Item = &'n String>,
        these: &[usize],
    ) -> BTreeSet<usize> {
        names.filter_map(|name| records.get(name.as_str())).chain(these).copied().collect()
    }
}

/// Where the numbers of an element lie.
pub(super) struct Slices {
    /// In the working state.
    pub(super) states: std::ops::Range<usize>,
    pub(super) references: std::ops::Range<usize>,
    pub(super) discrete: std::ops::Range<usize>,
}

impl Slices {
    pub(super) fn of(layout: &Layout, element: usize) -> Self {
        let states = layout.states_of(element);
        let first = 13 * layout.bodies;
        Self {
            states: first + states.start..first + states.end,
            references: layout.references_of(element),
            discrete: layout.discrete_of(element),
        }
    }
}
