//! [`Checkpoint`]: what a run that was killed is resumed from, as a file.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::options::{Afterwards, RunOptions};
use super::restart::{Format, Restart};
use super::simulation::{Creep, Extremes, Pressed};
use crate::catalog::{LibraryInfo, sha256};
use crate::diagnostics::{Diagnostic, Source, codes};
use crate::results::{AuditRecord, CHECKPOINT_FILE, Kept, ResultsError, Summary, Written, remove, seal, unseal};
use crate::scene::{AuditTolerance, Override};

/// What this version writes. 2: the scene by its SHA-256, remedies among the counts. 3: checksums of the record and of the rows. 5: events by their bytes. 6: what
/// is done afterwards, and where a run with `--from` began.
pub(super) const FORMAT: u32 = 6;

/// A run up to one of its checkpoints. What comes after depends on this, and on the scene, alone.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Checkpoint {
    /// Version of this record.
    pub(super) format: u32,
    /// Number of checkpoints before the state; zero at the start of the run.
    pub(super) taken: u64,
    /// How often the run was resumed so far.
    pub(super) resumed: u64,
    /// Start of the run, s.
    pub(super) t_start: f64,
    /// Mobility of the scene there, before joints let go.
    pub(super) mobility: u64,
    /// The part of the table that belongs to it.
    pub(super) table: Written,
    /// The part of the motion that belongs to it, where that is written.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) motion: Option<Written>,
    /// The part of the events that belongs to it, where there may be some.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) events: Option<Written>,
    /// What the run is made of; another one cannot continue.
    pub(super) identity: Identity,
    /// How the scene was opened.
    pub(super) origin: Option<Origin>,
    /// Work so far.
    pub(super) work: Work,
    /// The state that the run began in, where that is not the start of the scene.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) began: Option<Restart>,
    /// What else the next leg takes over; nothing at the start.
    pub(super) carried: Option<Carried>,
    /// The state; `None` is the start of the scene.
    pub(super) state: Option<Restart>,
}

/// What a run is made of.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Identity {
    /// Version of this program.
    odyn: String,
    /// SHA-256 of the scene's text and of all changes to it.
    scene: String,
    /// Libraries in use.
    libraries: Vec<LibraryIdentity>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct LibraryIdentity {
    package: String,
    version: String,
    abi: u32,
    /// None where it is linked in.
    sha256: Option<String>,
}

/// How a scene was opened: its file and the options, paths made absolute.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Origin {
    scene: PathBuf,
    set: Vec<String>,
    plugins: Vec<PathBuf>,
    audit_tolerance: Option<Judging>,
    afterwards: Afterwards,
}

/// [`AuditTolerance`] as a checkpoint has it: a number, or the word `none`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
enum Judging {
    Limit(f64),
    Not(String),
}

/// Counters and times of the legs so far.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Work {
    /// See [`Summary::stiff_from`].
    stiff_from: Option<f64>,
    /// See [`Summary::machine_code_from`].
    machine_code_from: Option<f64>,
    /// Bytes of machine code.
    machine_code_bytes: u64,
    /// See [`Summary::machine_code_time_s`].
    machine_code_time_s: f64,
    /// Integration, s.
    integration_time_s: f64,
    /// Everything, s.
    pub(super) wall_time_s: f64,
    /// Counters by their names in the summary.
    counts: BTreeMap<String, u64>,
}

/// What a leg of a run leaves to the next besides the state, SI units.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Carried {
    /// Length, speed, spin, energy that errors are shares of.
    pub(super) scales: [f64; 4],
    /// Way of bodies that cannot turn, m; zero where it does not count.
    #[serde(default)]
    pub(super) way: f64,
    /// The same for each element state.
    pub(super) state_sizes: Vec<f64>,
    /// Size of the next step, s; the method chooses where it is not known.
    pub(super) step: Option<f64>,
    /// Steps tried, accepted or not.
    pub(super) steps_tried: u64,
    /// The audit so far.
    pub(super) audit: AuditRecord,
    /// Contacts that were closed.
    #[serde(default)]
    pub(super) closed: Vec<usize>,
    /// Joints that had let go, by their elements.
    #[serde(default)]
    pub(super) released: Vec<usize>,
    /// The largest reactions of contacts lately: see `levels.rs`.
    #[serde(default)]
    pub(super) pressed: Pressed,
    /// Frictions that creep, and what is known of how they change.
    #[serde(default)]
    pub(super) creep: Creep,
    /// Reactions of contacts that were reported as indeterminate.
    #[serde(default)]
    pub(super) open_loads: Vec<usize>,
    /// What was seen of what elements want looked at.
    #[serde(default)]
    pub(super) margins: Vec<Extremes>,
}

impl Origin {
    /// Paths stay as they are where the current folder is not known.
    pub(super) fn new(scene: &Path, options: &RunOptions) -> Self {
        let absolute = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
        Self {
            scene: absolute(scene),
            set: options.overrides.iter().map(|one| one.text.clone()).collect(),
            plugins: options.plugins.iter().map(|path| absolute(path)).collect(),
            audit_tolerance: options.audit_tolerance.map(|tolerance| match tolerance {
                AuditTolerance::Limit(limit) => Judging::Limit(limit),
                AuditTolerance::None => Judging::Not("none".into()),
            }),
            afterwards: options.afterwards,
        }
    }
}

impl Identity {
    pub(super) fn of(source: &Source, libraries: &[LibraryInfo]) -> Self {
        // Not the name: that depends on where the user stands.
        let mut source = source.clone();
        source.name = String::new();
        let libraries = libraries.iter().map(|library| LibraryIdentity {
            package: library.package.clone(),
            version: library.version.clone(),
            abi: library.abi,
            sha256: library.sha256.clone(),
        });
        Self {
            odyn: env!("CARGO_PKG_VERSION").into(),
            scene: sha256(format!("{source:?}").as_bytes()),
            libraries: libraries.collect(),
        }
    }

    /// What is not the same, in words.
    pub(super) fn differences(&self, now: &Self) -> Vec<String> {
        let mut found = Vec::new();
        if self.odyn != now.odyn {
            found.push(format!("the run is one of odyn {}, this is {}", self.odyn, now.odyn));
        }
        if self.scene != now.scene {
            found.push("the scene file, or a change to it (`--set` and the like), is not what it was".into());
        }
        for was in &self.libraries {
            let name = &was.package;
            match now.libraries.iter().find(|is| is.package == *name) {
                None => found.push(format!("the library `{name}` is missing")),
                Some(is) if (is.version != was.version) || (is.abi != was.abi) => found.push(format!(
                    "the library `{name}` is {} (interface {}), it was {} (interface {})",
                    is.version, is.abi, was.version, was.abi
                )),
                Some(is) if is.sha256 != was.sha256 => {
                    found.push(format!("the library `{name}` is another build of {}", was.version));
                }
                Some(_) => {}
            }
        }
        let new = now.libraries.iter().filter(|is| !self.libraries.iter().any(|was| was.package == is.package));
        found.extend(new.map(|is| format!("the library `{}` was not in use", is.package)));
        found
    }
}

impl Work {
    /// Adds the work of a leg.
    pub(super) fn add(&mut self, part: &mut Summary) {
        for (name, count) in part.counts() {
            *self.counts.entry(name.into()).or_default() += *count;
        }
        self.stiff_from = self.stiff_from.or(part.stiff_from);
        self.machine_code_from = self.machine_code_from.or(part.machine_code_from);
        self.machine_code_bytes += part.machine_code_bytes;
        self.machine_code_time_s += part.machine_code_time_s;
        self.integration_time_s += part.integration_time_s;
    }

    /// Writes the work of all legs into the summary of the last.
    pub(super) fn tell(&self, summary: &mut Summary) {
        for (name, count) in summary.counts() {
            *count = self.counts.get(name).copied().unwrap_or(0);
        }
        summary.stiff_from = self.stiff_from;
        summary.machine_code_from = self.machine_code_from;
        summary.machine_code_bytes = self.machine_code_bytes;
        summary.machine_code_time_s = self.machine_code_time_s;
        summary.integration_time_s = self.integration_time_s;
    }

    /// Steps tried so far, accepted or not.
    pub(super) fn steps_tried(&self) -> u64 {
        ["steps", "rejected"].iter().filter_map(|name| self.counts.get(*name)).sum()
    }
}

impl Checkpoint {
    /// Reads the file of a folder of results.
    ///
    /// # Errors
    /// A missing file, or one that this program did not write, in words.
    pub fn read(folder: &Path) -> Result<Self, Box<Diagnostic>> {
        let path = folder.join(CHECKPOINT_FILE);
        let problem = |what: String| {
            let message = format!("cannot resume from {}: {what}", path.display());
            let help = "name the folder of results of a run with --checkpoint that did not reach its end; one whose \
                        checkpoint is damaged has to begin anew";
            Box::new(Diagnostic::error(codes::CANNOT_GO_ON, message).help(help))
        };
        let text = fs::read_to_string(&path).map_err(|error| problem(error.to_string()))?;
        Self::from_text(&text).map_err(problem)
    }

    /// What to say of a checkpoint in a folder whose scene was not read from a file.
    #[must_use]
    pub fn without_scene(folder: &Path) -> Box<Diagnostic> {
        let message = format!("cannot resume from {}: its scene was not read from a file", folder.display());
        Box::new(Diagnostic::error(codes::CANNOT_GO_ON, message).help("the program that made the scene can resume it"))
    }

    /// Removes the file from the folder of a run: it is at its end, and what was to be done afterwards is done.
    ///
    /// # Errors
    /// [`ResultsError::Write`]. A missing file is none.
    pub fn done(folder: &Path) -> Result<(), ResultsError> {
        remove(&folder.join(CHECKPOINT_FILE))
    }

    /// How far the files of the run belong to it.
    pub(super) fn kept(&self) -> Kept {
        Kept { table: self.table.clone(), motion: self.motion.clone(), events: self.events.clone() }
    }

    /// The text of the file. Every number reads back as the same bits.
    pub(super) fn to_text(&self) -> std::io::Result<String> {
        let text = toml::to_string(self).map_err(std::io::Error::other)?;
        Ok(seal(format!("# Up to here a run can be resumed: odyn resume THIS_FOLDER\n{text}")))
    }

    pub(super) fn from_text(text: &str) -> Result<Self, String> {
        let wrong = |error: toml::de::Error| error.message().to_owned();
        let content = unseal(text);
        // Before anything else, which another format may not have: not even a checksum.
        let format = toml::from_str(text).map(|Format { format }| format);
        if let Ok(format) = format
            && format != FORMAT
        {
            let whose = if format < FORMAT { "an older" } else { "a newer" };
            return Err(format!(
                "its format is {format}, that of {whose} odyn; this one knows {FORMAT}: resume with that one, or run anew"
            ));
        }
        toml::from_str(content?).map_err(wrong)
    }

    /// The scene file of the run and how it was opened; `None` if it was not opened from a file.
    #[must_use]
    pub fn opened(&self) -> Option<(&Path, RunOptions)> {
        let origin = self.origin.as_ref()?;
        let options = RunOptions {
            overrides: origin.set.iter().map(Override::new).collect(),
            plugins: origin.plugins.clone(),
            audit_tolerance: origin.audit_tolerance.as_ref().map(|judging| match judging {
                Judging::Limit(limit) => AuditTolerance::Limit(*limit),
                Judging::Not(_) => AuditTolerance::None,
            }),
            afterwards: origin.afterwards,
            ..RunOptions::default()
        };
        Some((&origin.scene, options))
    }
}
