//! [`Question`]: any analysis of this crate as data, and its [`Answer`] as data: what scenes that verify an analysis, and programs in
//! other languages, write and read. Keys are the long options of the commands, answers are what these print with `--json`.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::balance::{self, Balanced, balanced};
use crate::diagnostics::{Diagnostic, codes};
use crate::fit::{self, Fit};
use crate::inverse::{Inverse, inverse};
use crate::kinematics::{Drive, Kinematics, kinematics};
use crate::linear::{self, refuse};
use crate::loads::{Loads, loads};
use crate::modes::Modes;
use crate::place::{At, Placed, place};
use crate::prescribed::{Motion, amount};
use crate::scene::{Dimension, Override};
use crate::sensitivity::{self, Sensitivities};
use crate::session::{RunOptions, Session, SessionError};
use crate::statics::{Equilibria, equilibria, equilibrium};

/// Names of the analyses, as commands and scenes write them.
pub const ANALYSES: [&str; 9] =
    ["statics", "modes", "linearise", "kinematics", "inverse", "balance", "loads", "sensitivity", "fit"];

/// An analysis with what it is asked. Times are in the scene's unit; relative files begin at the scene's folder.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(tag = "analysis", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Question {
    /// Equilibria.
    Statics {
        /// From so many starts; from the scene's own where absent.
        all: Option<usize>,
    },
    /// Frequencies, damping and stability.
    Modes {
        /// `start`, `equilibrium` or a time.
        #[serde(default = "start")]
        at: String,
    },
    /// A, B, C, D.
    Linearise {
        /// As for modes.
        #[serde(default = "start")]
        at: String,
        /// Names of inputs; all where absent.
        inputs: Option<Vec<String>>,
        /// Names of outputs; all where absent.
        outputs: Option<Vec<String>>,
    },
    /// Where a mechanism goes.
    Kinematics {
        /// `NAME` or `NAME=FROM:TO:COUNT`; the scene's own drivers where absent.
        drive: Option<String>,
    },
    /// Efforts of a prescribed motion.
    Inverse {
        /// The motion file.
        motion: PathBuf,
        /// Quantities of it that are taken; all where absent.
        follow: Option<Vec<String>>,
        /// Actuators.
        by: Option<Vec<String>>,
        /// Spacing of times; the rows of the file where absent.
        every: Option<f64>,
    },
    /// Shaking force and counterweight.
    Balance {
        /// The angle that turns.
        turn: String,
        /// Whole turns.
        #[serde(default = "two")]
        turns: usize,
        /// Harmonics.
        #[serde(default = "eight")]
        harmonics: usize,
        /// Of the counterweight, with its unit.
        radius: Option<String>,
        /// Point of moments, in the scene's unit of length.
        #[serde(default)]
        about: [f64; 3],
    },
    /// Everything that acts on a body.
    Loads {
        /// Its name.
        body: String,
        /// Times; the peaks where absent.
        at: Option<Vec<f64>>,
    },
    /// Derivatives.
    Sensitivity {
        /// Outputs and figures; all where empty.
        #[serde(default)]
        of: Vec<String>,
        /// Numbers of the scene.
        to: Vec<String>,
        /// h as a share of each number.
        step: Option<f64>,
    },
    /// Numbers of the scene from measurements.
    Fit {
        /// The table.
        measured: Option<PathBuf>,
        /// `KEY=MIN:MAX` each.
        vary: Vec<String>,
        /// Pairs of column and output.
        #[serde(default)]
        columns: Vec<(String, String)>,
        /// Standard deviations of columns.
        #[serde(default)]
        noise: Vec<(String, f64)>,
        /// Figures: name, value, standard deviation.
        #[serde(default)]
        figures: Vec<(String, f64, Option<f64>)>,
    },
}

fn start() -> String {
    "start".into()
}

fn two() -> usize {
    2
}

fn eight() -> usize {
    8
}

/// What an analysis found.
#[derive(Debug, Clone, Serialize)]
#[serde(untagged)]
#[allow(clippy::large_enum_variant)] // one at a time
pub enum Answer {
    /// Of [`Question::Statics`].
    Statics(Equilibria),
    /// Of [`Question::Modes`].
    Modes(Modes),
    /// Of [`Question::Linearise`].
    Linearise(linear::Model),
    /// Of [`Question::Kinematics`].
    Kinematics(Kinematics),
    /// Of [`Question::Inverse`].
    Inverse(Inverse),
    /// Of [`Question::Balance`].
    Balance(Balanced),
    /// Of [`Question::Loads`].
    Loads(Loads),
    /// Of [`Question::Sensitivity`].
    Sensitivity(Sensitivities),
    /// Of [`Question::Fit`].
    Fit(Fit),
}

/// A question that cannot be asked of a scene.
fn wrong(session: &Session, message: String, help: &str) -> SessionError {
    refuse(session, Diagnostic::error(codes::UNKNOWN_WORD, message).help(help))
}

impl Question {
    /// Reads keys and values: `{"analysis": "modes", "at": "equilibrium"}`.
    ///
    /// # Errors
    /// Unknown analyses and keys, values of other types, in words.
    pub fn read(value: Value) -> Result<Self, String> {
        let name = value.get("analysis").and_then(Value::as_str).unwrap_or_default().to_owned();
        if !ANALYSES.contains(&name.as_str()) {
            return Err(format!("`{name}` is no analysis: known are {}", ANALYSES.join(", ")));
        }
        serde_json::from_value(value).map_err(|error| format!("`{name}` is asked in a wrong way: {error}"))
    }

    /// The name of the analysis.
    #[must_use]
    pub fn analysis(&self) -> &'static str {
        match self {
            Self::Statics { .. } => "statics",
            Self::Modes { .. } => "modes",
            Self::Linearise { .. } => "linearise",
            Self::Kinematics { .. } => "kinematics",
            Self::Inverse { .. } => "inverse",
            Self::Balance { .. } => "balance",
            Self::Loads { .. } => "loads",
            Self::Sensitivity { .. } => "sensitivity",
            Self::Fit { .. } => "fit",
        }
    }

    /// Asks it of a scene file.
    ///
    /// # Errors
    /// Mistakes in the scene or the question; what the analysis refuses.
    pub fn ask(
        &self,
        path: &Path,
        options: &RunOptions,
        progress: &(dyn Fn(f64) + Sync),
        stop: &Arc<AtomicBool>,
    ) -> Result<Answer, SessionError> {
        let open = |more: Option<&str>| {
            let mut options = options.clone();
            options.overrides.extend(more.map(Override::new));
            Session::open(path, &options)
        };
        let mut listen = |share: f64| progress(share);
        Ok(match self {
            Self::Statics { all } => Answer::Statics(match all {
                Some(starts) => equilibria(&open(None)?, *starts, &mut listen)?,
                None => {
                    let found = vec![equilibrium(&open(None)?, &mut listen)?];
                    Equilibria { found, failed: Vec::new(), starts: 1 }
                }
            }),
            Self::Modes { at } => {
                let placed = Self::place(&open, at, &mut listen)?;
                let linear = placed.linear(Some(&[]), Some(&[]))?;
                Answer::Modes(Modes::of(&placed.session, &linear)?)
            }
            Self::Linearise { at, inputs, outputs } => {
                let placed = Self::place(&open, at, &mut listen)?;
                Answer::Linearise(placed.linear(inputs.as_deref(), outputs.as_deref())?.plain())
            }
            Self::Kinematics { drive } => {
                let session = open(None)?;
                let drive = drive.as_ref().map(|text| Drive::read(&session, text)).transpose()?;
                Answer::Kinematics(kinematics(&session, &drive.unwrap_or(Drive::Time), &mut listen)?)
            }
            Self::Inverse { motion, follow, by, every } => {
                let session = open(None)?;
                let motion = Motion::read(&session, &session.scene.source.beside(motion), follow.as_deref())?;
                let spaced = |every: f64| motion.spaced(session.scene.units.to_si(every, Dimension::TIME));
                if every.is_some_and(|every| every.is_nan() || every <= 0.0) {
                    return Err(wrong(&session, "`every` is not positive".into(), "give a spacing of times"));
                }
                let times = every.map(spaced);
                Answer::Inverse(inverse(&session, &motion, by.as_deref(), times.as_deref(), &mut listen)?)
            }
            Self::Balance { turn, turns, harmonics, radius, about } => {
                let session = open(None)?;
                let length = session.scene.units.factor(Dimension::LENGTH);
                let of = |text: &String| {
                    let found = amount(text, Dimension::LENGTH, length).filter(|radius| *radius > 0.0);
                    found.ok_or_else(|| {
                        let help = "give a positive number, in the scene's unit of length or with its own";
                        wrong(&session, format!("`{text}` is no radius"), help)
                    })
                };
                let radius = radius.as_ref().map(of).transpose()?;
                let question = balance::Question {
                    turn: turn.clone(),
                    turns: *turns,
                    harmonics: (*harmonics).max(1),
                    about: about.map(|x| x * length),
                };
                Answer::Balance(balanced(&session, &open, &question, radius, &mut listen)?)
            }
            Self::Loads { body, at } => Answer::Loads(loads(open(None)?, body, at.as_deref(), &mut listen, stop)?),
            Self::Sensitivity { of, to, step } => {
                let request = sensitivity::Request { of: of.clone(), to: to.clone(), step: *step, jobs: options.jobs };
                Answer::Sensitivity(Sensitivities::of(path, options, &request, progress, stop)?)
            }
            Self::Fit { measured, vary, columns, noise, figures } => {
                let request = fit::Request {
                    vary: vary.clone(),
                    columns: columns.clone(),
                    noise: noise.clone(),
                    figures: figures.clone(),
                    most_iterations: None,
                    jobs: options.jobs,
                };
                let folder = path.parent().unwrap_or(Path::new(""));
                let table = measured.as_ref().map(|file| folder.join(file));
                Answer::Fit(Fit::of(path, table.as_deref(), options, &request, progress, stop)?)
            }
        })
    }

    fn place(
        open: &dyn Fn(Option<&str>) -> Result<Session, SessionError>,
        at: &str,
        listen: &mut dyn FnMut(f64),
    ) -> Result<Placed, SessionError> {
        let Some(at) = At::read(at) else {
            let help = "give `start`, `equilibrium` or a time: in the scene's unit, or with its own such as `0.2 s`";
            return Err(wrong(&open(None)?, format!("`{at}` is no state of a scene"), help));
        };
        place(&|| open(None), at, listen)
    }
}

impl Answer {
    /// The answer as the command prints it with `--json`.
    ///
    /// # Errors
    /// None that is known: numbers that are none become `null`.
    pub fn value(&self) -> serde_json::Result<Value> {
        serde_json::to_value(self)
    }
}

/// Keys by which an entry of a list is named.
const NAMES: [&str; 8] = ["name", "body", "key", "figure", "output", "number", "order", "of"];

/// What stands at a place of an answer: keys of tables, places in lists from 0 or names of their entries, joined by `/`:
/// `modes/0/frequency`, `found/0/outputs/angle/value`.
///
/// # Errors
/// The part that is not there, with what there is.
pub fn at<'v>(answer: &'v Value, place: &str) -> Result<&'v Value, String> {
    let mut here = answer;
    for part in place.split('/') {
        let found = match here {
            Value::Object(table) => table.get(part),
            Value::Array(list) => match part.parse::<usize>() {
                Ok(number) => list.get(number),
                Err(_) => list.iter().find(|one| {
                    let named = |key: &&str| one.get(*key).and_then(Value::as_str) == Some(part);
                    NAMES.iter().any(named)
                }),
            },
            _ => None,
        };
        here = found.ok_or_else(|| {
            let known = match here {
                Value::Object(table) => table.keys().map(String::as_str).collect::<Vec<_>>().join(", "),
                Value::Array(list) => {
                    let names = list.iter().filter_map(|one| NAMES.iter().find_map(|key| one.get(*key)?.as_str()));
                    format!("{} entries from 0; {}", list.len(), names.collect::<Vec<_>>().join(", "))
                }
                _ => "a single value".into(),
            };
            format!("the answer has no `{place}`: no `{part}` among {known}")
        })?;
    }
    Ok(here)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // in a test, the panic is the message
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn questions_are_read_and_mistakes_in_them_named() {
        let found = Question::read(json!({ "analysis": "modes" })).unwrap();
        assert_eq!(found, Question::Modes { at: "start".into() });
        for name in ANALYSES {
            let error = Question::read(json!({ "analysis": name, "nonsense": 1 })).unwrap_err();
            assert!(error.contains("nonsense") || error.contains("missing field"), "{error}");
        }
        assert!(Question::read(json!({ "analysis": "mode" })).unwrap_err().contains("known are statics, modes"));
    }

    #[test]
    fn places_in_answers_are_found_by_number_and_by_name() {
        let answer = json!({ "modes": [{ "frequency": 2.0 }], "outputs": [{ "name": "x", "value": 1.5 }] });
        assert_eq!(at(&answer, "modes/0/frequency"), Ok(&json!(2.0)));
        assert_eq!(at(&answer, "outputs/x/value"), Ok(&json!(1.5)));
        assert!(at(&answer, "outputs/y/value").unwrap_err().contains("no `y` among 1 entries from 0; x"));
        assert!(at(&answer, "mode").unwrap_err().contains("among modes, outputs"));
        assert!(at(&answer, "modes/0/frequency/x").unwrap_err().contains("a single value"));
    }
}
