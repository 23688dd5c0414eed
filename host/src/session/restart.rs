//! [`Restart`]: the state at the end of a run, as a file from which another run goes on.

use std::fs;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::error::{Exit, SessionError};
use super::open::Session;
use crate::diagnostics::{Diagnostic, codes};
use crate::model::Model;
use crate::results::{ResultsError, STATE_FILE, replace, seal, unseal};

/// What this version writes. 2: a checksum at its end.
const FORMAT: u32 = 2;

/// The version of a record.
#[derive(Deserialize)]
pub(super) struct Format {
    pub(super) format: u32,
}

/// Everything that changes during a run, SI units.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Restart {
    /// Version of this record.
    pub format: u32,
    /// Time, s.
    pub time: f64,
    /// Names of the bodies, in order.
    pub bodies: Vec<String>,
    /// Names of the elements, in order.
    pub elements: Vec<String>,
    /// Per body r, p, v, omega'; then element states; then work.
    pub working: Vec<f64>,
    /// References of the multi-turn angles, rad.
    pub references: Vec<f64>,
    /// Discrete element states.
    pub discrete: Vec<f64>,
    /// Private memories of opaque elements: name and bytes.
    pub memories: Vec<(String, Vec<u8>)>,
}

impl Restart {
    /// A state with nothing of opaque elements yet.
    #[must_use]
    pub fn new(model: &Model, time: f64, working: Vec<f64>, references: &[f64], discrete: &[f64]) -> Self {
        Self {
            format: FORMAT,
            time,
            bodies: model.bodies.iter().map(|body| body.name.clone()).collect(),
            elements: model.elements.iter().map(|element| element.name.clone()).collect(),
            working,
            references: references.to_vec(),
            discrete: discrete.to_vec(),
            memories: Vec::new(),
        }
    }

    /// Writes the file into a folder of results.
    ///
    /// # Errors
    /// [`ResultsError::Write`].
    pub fn write(&self, folder: &Path) -> Result<(), ResultsError> {
        let path = folder.join(STATE_FILE);
        let text = toml::to_string(self).map_err(std::io::Error::other);
        let text =
            text.map(|text| seal(format!("# Where a run ended. To go on: odyn run SCENE --from THIS_FOLDER\n{text}")));
        let text = text.map_err(|cause| ResultsError::write(&path, cause))?;
        replace(&path, text.as_bytes(), false)
    }

    /// Reads the file of a folder of results.
    ///
    /// # Errors
    /// A missing file, or one that this program did not write, in words.
    pub fn read(folder: &Path) -> Result<Self, Box<Diagnostic>> {
        let path = folder.join(STATE_FILE);
        let problem = |what: String| {
            Box::new(
                Diagnostic::error(codes::CANNOT_GO_ON, format!("cannot go on from {}: {what}", path.display()))
                    .help("name the folder of results of a run of the same scene; run that one again where its state is damaged"),
            )
        };
        let text = fs::read_to_string(&path).map_err(|error| problem(error.to_string()))?;
        let format = toml::from_str(&text).map(|Format { format }| format);
        if let Ok(format) = format
            && format != FORMAT
        {
            return Err(problem(format!("its format is {format}, this program knows {FORMAT}")));
        }
        let content = unseal(&text).map_err(problem)?;
        toml::from_str(content).map_err(|error| problem(error.message().to_owned()))
    }
}

impl Session {
    /// Goes on from where another run of the scene ended, instead of from the scene's start.
    ///
    /// # Errors
    /// A state of other bodies or elements; one that is not before the scene's end; an opaque element that refuses its
    /// memory.
    pub fn go_on_from(&mut self, state: Restart) -> Result<(), SessionError> {
        let names: Vec<&str> = self.model.elements.iter().map(|element| element.name.as_str()).collect();
        let bodies: Vec<&str> = self.model.bodies.iter().map(|body| body.name.as_str()).collect();
        let layout = &self.plan.layout;
        let same = state.bodies == bodies
            && state.elements == names
            && state.working.len() == self.assembly.working.len()
            && (state.references.len(), state.discrete.len()) == (layout.references, layout.discrete);
        let refuse = |message: String, help: &str| {
            let diagnostic = Diagnostic::error(codes::CANNOT_GO_ON, message).help(help);
            Err(SessionError::one(Exit::Scene, &self.scene.source, diagnostic))
        };
        if !same {
            let found = format!("{} bodies and {} elements", state.bodies.len(), state.elements.len());
            let message = format!("the state to go on from belongs to another scene ({found})");
            return refuse(message, "bodies and elements must be the same, in the same order");
        }
        let finite = |list: &[f64]| list.iter().all(|x| x.is_finite());
        if !(finite(&state.working) && finite(&state.references) && finite(&state.discrete) && state.time.is_finite()) {
            return refuse("the state to go on from contains numbers that are not finite".into(), "start anew");
        }
        if state.time >= self.scene.simulation.t_end {
            let message = format!("the run to go on from ended at {} s, not before this scene's end", state.time);
            return refuse(message, "give a later end: --t-end");
        }
        self.load_memories(&state.memories)?;
        self.gone_on_from = Some(state.clone());
        self.assembly.chosen.clear();
        self.scene.simulation.t_start = state.time;
        self.assembly.working = state.working;
        let merged = self.merged.as_ref().map(|case| self.assembly.merged(&case.merging).working);
        let working = merged.as_ref().unwrap_or(&self.assembly.working);
        if self.planar.as_ref().is_some_and(|case| !case.planar.contains(working, self.assembly.scales.length)) {
            self.planar = None;
        }
        // The audit begins anew.
        if let Some(work) = self.assembly.working.last_mut() {
            *work = 0.0;
        }
        self.assembly.references = state.references;
        self.assembly.discrete = state.discrete;
        self.memories = state.memories;
        Ok(())
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
                return Err(SessionError::one(Exit::Plugin, &self.scene.source, diagnostic));
            }
        }
        Ok(())
    }
}
