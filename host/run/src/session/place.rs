//! Where the run of a session begins: at the end of another, or at a checkpoint of its own.

use std::time::Instant;

use super::checkpoint::{Checkpoint, Identity};
use super::error::SessionError;
use super::opened::Session;
use super::restart::Restart;
use super::run::Run;
use super::savings::plural;
use crate::catalog::sha256;
use crate::diagnostics::{Diagnostic, codes};
use crate::scene::OutputTimes;

/// Tolerance of how a scene moves on, and steps that this may take.
const TIGHT: f64 = 1e-11;
const MOST_STEPS: u64 = 5000;

impl Session {
    /// Goes on from where another run of the scene ended, instead of from the scene's start: as [`Session::stand_at`].
    ///
    /// # Errors
    /// As there; a state that is not before the scene's end.
    pub fn go_on_from(&mut self, state: Restart) -> Result<(), SessionError> {
        let time = state.time;
        self.stand_at(state)?;
        if time >= self.scene.simulation.t_end {
            let message = format!("the run to continue from ended at {time} s, not before this scene's end");
            let diagnostic = Diagnostic::error(codes::CANNOT_GO_ON, message).help("give a later end: --t-end");
            return Err(SessionError::one(&self.scene.source, diagnostic));
        }
        Ok(())
    }

    /// Begins in the state where a run of the scene ended, be it at the scene's end. Inputs have the values that they had there, those that
    /// the scene gives another value than it did then have that one.
    ///
    /// # Errors
    /// A state of other bodies, elements or inputs; an opaque element that refuses its memory.
    pub fn stand_at(&mut self, mut state: Restart) -> Result<(), SessionError> {
        let refuse = |message: String, help: &str| {
            let diagnostic = Diagnostic::error(codes::CANNOT_GO_ON, message).help(help);
            Err(SessionError::one(&self.scene.source, diagnostic))
        };
        if let Some((difference, help)) = self.differs_from(&state) {
            return refuse(format!("the state to continue from belongs to another scene: {difference}"), help);
        }
        let finite = |list: &[f64]| list.iter().all(|x| x.is_finite());
        if !(finite(&state.working) && finite(&state.references) && finite(&state.discrete) && state.time.is_finite()) {
            return refuse("the state to continue from contains numbers that are not finite".into(), "start anew");
        }
        self.load_memories(&state.memories)?;
        // An input keeps the value that it had, but where the scene has been given another one since.
        let inputs = state.discrete[self.plan.layout.given_at..].iter_mut().zip(&self.model.inputs);
        for ((had, input), given) in inputs.zip(&mut state.given) {
            if *given != input.value {
                (*had, *given) = (input.value, input.value);
            }
        }
        self.assembly.chosen.clear();
        (self.begins.time, self.begins.sampled_from) = (state.time, state.time);
        self.assembly.working.clone_from(&state.working);
        // The audit begins anew.
        if let Some(work) = self.assembly.working.last_mut() {
            *work = 0.0;
        }
        self.assembly.references.clone_from(&state.references);
        self.assembly.discrete.clone_from(&state.discrete);
        self.begin_released(&state.released)?;
        self.begins.state = Some(state);
        Ok(())
    }

    /// In what a state is none of this scene, and what to do about it.
    fn differs_from(&self, state: &Restart) -> Option<(String, &'static str)> {
        let bodies: Vec<&str> = self.model.bodies.iter().map(|body| body.name.as_str()).collect();
        let elements: Vec<&str> = self.model.elements.iter().map(|element| element.name.as_str()).collect();
        let lists = [("body", "bodies", &state.bodies, bodies), ("element", "elements", &state.elements, elements)];
        for (one, many, had, now) in lists {
            if *had != now {
                let difference = match other_names(had, &now) {
                    [Some(gone), _] => format!("it has the {one} `{gone}`, which this scene has not"),
                    [None, Some(new)] => format!("it has not the {one} `{new}` of this scene"),
                    [None, None] => format!("its {many} are in another order"),
                };
                return Some((difference, "bodies and elements must be the same, in the same order"));
            }
        }
        let (had, now) = (state.given.len(), self.model.inputs.len());
        if had != now {
            let difference = format!("it has {}, this scene {now}", plural(had, "`[[input]]`", "`[[input]]`s"));
            return Some((difference, "inputs must be as many, in the same order; one that nothing takes may stay"));
        }
        let layout = &self.plan.layout;
        let same = state.working.len() == self.assembly.working.len()
            && (state.references.len(), state.discrete.len()) == (layout.references, layout.discrete);
        (!same).then(|| {
            let difference = "elements of the same names have other states there".into();
            (difference, "types, and parameters that give states (memories, orders of filters), must be the same")
        })
    }

    /// Gives opaque elements back their private memories: names and bytes. Those of elements that are not here are left out.
    pub(super) fn load_memories(&mut self, memories: &[(String, Vec<u8>)]) -> Result<(), SessionError> {
        for (name, memory) in memories {
            let Some(element) = self.model.elements.iter().find(|element| element.name == *name) else { continue };
            let (set, index) = (element.set, element.index as usize);
            if let Err(fault) = self.model.sets[set].load(index, memory) {
                let diagnostic = Diagnostic::error(
                    codes::PLUGIN_MISBEHAVED,
                    format!("`{name}` does not accept its memory: {}", fault.message),
                );
                return Err(SessionError::one(&self.scene.source, diagnostic));
            }
        }
        Ok(())
    }

    /// SHA-256 of what a run is made of: this program's version, the scene's text with all changes to it, the libraries. Runs
    /// with the same fingerprint give the same results.
    #[must_use]
    pub fn fingerprint(&self) -> String {
        sha256(format!("{:?}", Identity::of(&self.scene.source, &self.libraries)).as_bytes())
    }

    /// Makes [`Session::run`] continue from a checkpoint, in the folder that it is from. Until then, the session is where that run
    /// began.
    ///
    /// # Errors
    /// A checkpoint of another scene, library or program: what differs. As for [`Session::go_on_from`] otherwise.
    pub fn resume(&mut self, point: Checkpoint) -> Result<(), SessionError> {
        let differences = point.identity.differences(&Identity::of(&self.scene.source, &self.libraries));
        if !differences.is_empty() {
            let message = format!("the checkpoint belongs to another run: {}", differences.join("; "));
            let diagnostic = Diagnostic::error(codes::CANNOT_GO_ON, message).help(
                "make it as it was, or start anew; a changed scene can continue from the end of a run with --from",
            );
            return Err(SessionError::one(&self.scene.source, diagnostic));
        }
        if let Some(state) = &point.began {
            self.go_on_from(state.clone())?;
        }
        self.begins.checkpoint = Some(point);
        Ok(())
    }

    /// Places the session at a checkpoint.
    ///
    /// # Errors
    /// As for [`Session::go_on_from`].
    pub(super) fn place_at(&mut self, point: &Checkpoint) -> Result<(), SessionError> {
        if let Some(state) = &point.state {
            self.go_on_from(state.clone())?;
            if let (Some(_), Some(work), Some(was)) =
                (&point.carried, self.assembly.working.last_mut(), state.working.last())
            {
                // The audit continues.
                *work = *was;
            }
        }
        self.begins.sampled_from = point.t_start;
        Ok(())
    }

    /// A run of the scene from a state of it up to a time, s, be that behind its end: how it moves on from there. Without samples, at a
    /// tight tolerance, and no further than some thousands of steps.
    ///
    /// # Errors
    /// As for [`Session::stand_at`]; where the motion cannot start.
    pub fn moving_on(&self, state: Restart, to: f64) -> Result<Run<'static>, SessionError> {
        let mut scene = self.scene.clone();
        let settings = &mut scene.simulation;
        (settings.t_end, settings.output) = (to, OutputTimes::Times(Vec::new()));
        (settings.tolerance, settings.max_steps) = (Some(TIGHT), Some(MOST_STEPS));
        (settings.first_step, settings.fixed_step, settings.checkpoint_every) = (None, None, None);
        let start = Some((self.begins.time, self.assembly.clone()));
        let mut again = Self::of_scene(scene, Vec::new(), &self.catalog, &self.options, start, Instant::now())?;
        again.stand_at(state)?;
        again.prepare()?.start()
    }

    /// The same scene, opened anew.
    ///
    /// # Errors
    /// As for [`Session::open`].
    pub(super) fn again(&self) -> Result<Self, SessionError> {
        let (catalog, options) = (&self.catalog, &self.options);
        let mut again = Self::of_scene(self.scene.clone(), Vec::new(), catalog, options, None, Instant::now())?;
        again.origin.clone_from(&self.origin);
        Ok(again)
    }
}

/// The first name of one list that the other has not, and the reverse.
fn other_names<'a>(had: &'a [String], now: &[&'a str]) -> [Option<&'a str>; 2] {
    let gone = had.iter().map(String::as_str).find(|name| !now.contains(name));
    [gone, now.iter().copied().find(|name| !had.iter().any(|other| other == name))]
}
