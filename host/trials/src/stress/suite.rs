//! [`Suite`]: the trials, read from TOML.

use std::path::{Path, PathBuf};

use serde::Deserialize;
use toml::Spanned;

use crate::diagnostics::{Diagnostic, Source, codes, help_for};
use crate::session::SessionError;

/// All trials.
#[derive(Debug, Clone, PartialEq)]
pub struct Suite {
    /// The trials in the order of the file.
    pub trials: Vec<Trial>,
}

/// A scene and what must come out of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    /// Its name, of which there is one in a suite.
    pub name: String,
    /// What it belongs to.
    pub family: String,
    /// What it is about.
    pub text: String,
    /// Where its bounds come from; may be empty.
    pub why: String,
    /// The scene file, below the folder of the suite or relative to it.
    pub scene: PathBuf,
    /// The scene file as the suite names it.
    pub named: String,
    /// Changes of the scene, as `--set`.
    pub set: Vec<String>,
    /// Formulations to run it in, at least one.
    pub formulations: Vec<String>,
    /// Further changes for the short form.
    pub short: Vec<String>,
    /// Not part of the short form.
    pub only_full: bool,
    /// What must come out.
    pub expected: Expected,
    /// Warnings that must be given.
    pub warns: Option<Message>,
    /// What it must be equal to.
    pub equals: Option<Equals>,
    /// Which reactions are unique.
    pub reactions: Reactions,
}

/// How a trial must end.
#[derive(Debug, Clone, PartialEq)]
pub enum Expected {
    /// At its end, with all checks of the scene passed.
    Completed(Bounds),
    /// Before it begins.
    Refused(Message),
    /// Before its end, with all checks of the scene passed up to there.
    Stopped(Message, Bounds),
}

/// Largest values of the audit that pass; what is absent is not judged.
#[derive(Debug, Clone, Copy, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Bounds {
    /// Violation of a joint equation, as a share of the size of the scene.
    pub position: Option<f64>,
    /// Violation of the rate of one, as a share of the largest speed.
    pub velocity: Option<f64>,
    /// Error of the energy balance, as a share of the largest energy.
    pub energy: Option<f64>,
    /// Switches left to error control because they followed each other closely.
    pub chatters: Option<f64>,
}

/// Something the program must say.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Message {
    /// Its code.
    pub code: String,
    /// Pieces of text that must be in it.
    #[serde(default)]
    pub words: Vec<String>,
}

/// Another trial whose outputs must be the same.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Equals {
    /// Name of the other trial.
    pub trial: String,
    /// Largest difference, as a share of each output's largest value.
    pub within: f64,
    /// Formulation in which the other trial is meant; the same where absent.
    pub formulation: Option<String>,
    /// A length here over the same length there.
    #[serde(default = "one")]
    pub length: f64,
    /// A mass here over the same mass there.
    #[serde(default = "one")]
    pub mass: f64,
    /// A time here over the same time there.
    #[serde(default = "one")]
    pub time: f64,
}

/// Components of reactions, such as `hinge on door: force z`.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Reactions {
    /// Those that rigid bodies determine.
    #[serde(default)]
    pub unique: Vec<String>,
    /// Those that they do not, and that must be marked so.
    #[serde(default)]
    pub shared: Vec<String>,
}

/// The file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    #[serde(default)]
    trial: Vec<WrittenTrial>,
}

/// `[[trial]]`.
#[derive(Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenTrial {
    name: Spanned<String>,
    family: String,
    text: String,
    #[serde(default)]
    why: String,
    scene: String,
    #[serde(default)]
    set: Vec<String>,
    #[serde(default)]
    grid: Vec<Vec<String>>,
    #[serde(default)]
    formulations: Vec<String>,
    #[serde(default)]
    short: Vec<String>,
    #[serde(default)]
    only_full: bool,
    bounds: Option<Bounds>,
    refused: Option<Message>,
    stopped: Option<Message>,
    warns: Option<Message>,
    equals: Option<Equals>,
    #[serde(default)]
    reactions: Reactions,
}

fn one() -> f64 {
    1.0
}

impl Suite {
    /// Reads a suite.
    ///
    /// # Errors
    /// The file cannot be read, or what is written is no suite; all contradictions between trials are reported at once.
    pub fn read(path: &Path) -> Result<Self, SessionError> {
        let name = path.display().to_string();
        let text = std::fs::read_to_string(path).map_err(|cause| {
            let diagnostic = Diagnostic::error(codes::UNREADABLE, format!("cannot read the suite `{name}`: {cause}"));
            SessionError::one(&Source::new(name.clone(), ""), diagnostic)
        })?;
        Self::parse(Source::new(name, text), path.parent().unwrap_or(Path::new("")))
    }

    /// Reads a suite from its text; scenes are named relative to `folder`.
    ///
    /// # Errors
    /// As for [`Suite::read`].
    pub fn parse(source: Source, folder: &Path) -> Result<Self, SessionError> {
        let written: Written = toml::from_str(&source.text).map_err(|error| {
            let diagnostic = Diagnostic::error(codes::BAD_SUITE, error.message().to_owned());
            let diagnostic = diagnostic.at(error.span().unwrap_or(0..0), "");
            SessionError::one(&source, diagnostic)
        })?;
        let mut diagnostics = Vec::new();
        let mut trials: Vec<Trial> = Vec::new();
        for trial in written.trial.into_iter().flat_map(WrittenTrial::spread) {
            let span = trial.name.span();
            match trial.resolve(folder, &trials) {
                Ok(trial) => trials.push(trial),
                Err(message) => diagnostics.push(Diagnostic::error(codes::BAD_SUITE, message).at(span, "")),
            }
        }
        match diagnostics.is_empty() {
            true => Ok(Self { trials }),
            false => Err(SessionError::new(&source, diagnostics)),
        }
    }

    /// The places of the trials that are meant by these names (all of them where there are none; all of a grid by the name
    /// before the slash), and of those they are compared with, in the order of the suite. Trials that are not part of the short
    /// form have to be named for it.
    ///
    /// # Errors
    /// A name that no trial has.
    pub(super) fn select(&self, names: &[String], full: bool) -> Result<Vec<usize>, Box<Diagnostic>> {
        let is_called = |trial: &Trial, name: &str| {
            trial.name.strip_prefix(name).is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
        };
        for name in names {
            if !self.trials.iter().any(|trial| is_called(trial, name)) {
                let own = self.trials.iter().filter_map(|trial| trial.name.split('/').next());
                let mut known: Vec<&str> = own.collect();
                known.dedup();
                let diagnostic = Diagnostic::error(codes::BAD_SUITE, format!("the suite has no trial `{name}`"));
                return Err(Box::new(diagnostic.help_if(help_for(name, &known, "trials"))));
            }
        }
        let meant = |trial: &Trial| match names.is_empty() {
            true => full || !trial.only_full,
            false => names.iter().any(|name| is_called(trial, name)),
        };
        let needed = |trial: &Trial| {
            let mut others = self.trials.iter().filter(|other| meant(other)).filter_map(|other| other.equals.as_ref());
            others.any(|equals| equals.trial == trial.name)
        };
        let chosen = |(_, trial): &(usize, &Trial)| meant(trial) || needed(trial);
        Ok(self.trials.iter().enumerate().filter(chosen).map(|(place, _)| place).collect())
    }
}

impl WrittenTrial {
    /// A trial for each combination of the changes in the rows of its grid, its name followed by them.
    fn spread(self) -> Vec<Self> {
        let mut trials = vec![Self { grid: Vec::new(), ..self.clone() }];
        for row in &self.grid {
            let with = |trial: &Self, change: &String| {
                let mut other = trial.clone();
                let (key, value) = change.split_once('=').unwrap_or((change, ""));
                let key = key.rsplit('.').next().unwrap_or(key).trim();
                // A name is one word: it is an address on the page.
                let value: Vec<&str> = value.split_whitespace().collect();
                let named = format!("/{key}={}", value.join("-"));
                other.name = Spanned::new(self.name.span(), format!("{}{named}", trial.name.get_ref()));
                other.set.push(change.clone());
                other
            };
            trials = trials.iter().flat_map(|trial| row.iter().map(move |change| with(trial, change))).collect();
        }
        trials
    }

    /// The trial behind others, or what is wrong with it.
    fn resolve(mut self, folder: &Path, before: &[Trial]) -> Result<Trial, String> {
        let name = std::mem::take(self.name.get_mut());
        if before.iter().any(|other| other.name == name) {
            return Err(format!("there are two trials `{name}`"));
        }
        let bounds = self.bounds.unwrap_or_default();
        let numbers = [bounds.position, bounds.velocity, bounds.energy, bounds.chatters];
        let within = self.equals.as_ref().map(|equals| equals.within);
        if numbers.into_iter().chain([within]).flatten().any(|bound| bound.is_nan() || bound < 0.0) {
            return Err(format!("a bound of `{name}` is no number, or below zero"));
        }
        let expected = match (self.bounds, self.refused, self.stopped) {
            (Some(bounds), None, None) => Expected::Completed(bounds),
            (None, Some(message), None) => Expected::Refused(message),
            (_, None, Some(message)) => Expected::Stopped(message, bounds),
            _ => return Err(format!("`{name}` needs `bounds`, `refused` or `stopped`, and not several of them")),
        };
        let formulations = match self.formulations.is_empty() {
            true => vec!["auto".to_owned()],
            false => self.formulations,
        };
        let refused = matches!(expected, Expected::Refused(_));
        if refused && (self.warns.is_some() || self.equals.is_some() || self.reactions != Reactions::default()) {
            return Err(format!("`{name}` is to be refused, so that nothing else can be expected of it"));
        }
        if let Some(equals) = &mut self.equals {
            // One of a grid is compared with that of the same place in the other grid, if it is one.
            let place = name.split_once('/').map(|(_, place)| format!("{}/{place}", equals.trial));
            let called = |wanted: &String| before.iter().find(|other| other.name == *wanted);
            let other = place.as_ref().and_then(called).or_else(|| called(&equals.trial));
            let other = other.ok_or_else(|| format!("there is no trial `{}` before `{name}`", equals.trial))?;
            equals.trial.clone_from(&other.name);
            let meant = |one| other.formulations.contains(equals.formulation.as_ref().unwrap_or(one));
            if other.equals.is_some() || !formulations.iter().all(meant) {
                return Err(format!(
                    "`{}`, which `{name}` is compared with, must be run in the same formulations, and not be compared itself",
                    other.name
                ));
            }
        }
        Ok(Trial {
            name,
            family: self.family,
            text: self.text,
            why: self.why,
            scene: folder.join(&self.scene),
            named: self.scene,
            set: self.set,
            formulations,
            short: self.short,
            only_full: self.only_full,
            expected,
            warns: self.warns,
            equals: self.equals,
            reactions: self.reactions,
        })
    }
}
