//! [`Restart`]: the state at the end of a run, as a file from which another run continues.

use std::fs;
use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::diagnostics::{Diagnostic, codes};
use crate::model::Model;
use crate::results::{ResultsError, STATE_FILE, replace, seal, unseal};

/// What this version writes. 2: a checksum at its end; 3: what the scene gave its inputs.
const FORMAT: u32 = 3;

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
    /// What the scene gave its inputs, SI: where a scene gives another value now, that is meant, and not what the input had.
    pub given: Vec<f64>,
    /// Names of the joints that had let go.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub released: Vec<String>,
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
            given: model.inputs.iter().map(|input| input.value).collect(),
            released: Vec::new(),
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
        let text = text
            .map(|text| seal(format!("# Where a run ended. To continue: odyn run SCENE --from THIS_FOLDER\n{text}")));
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
                Diagnostic::error(codes::CANNOT_GO_ON, format!("cannot continue from {}: {what}", path.display()))
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
