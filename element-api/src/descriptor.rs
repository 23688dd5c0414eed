//! [`Descriptor`]: what the host knows about an element class before it has an instance.

use serde::{Deserialize, Serialize};

use crate::params::ParamSpec;
use crate::recording::Limits;

/// Kinds of elements.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// Constrains the motion ([`crate::Constraint`]).
    Joint,
    /// Acts on bodies ([`crate::Force`]).
    Force,
    /// Turns signals into signals ([`crate::Control`]).
    Control,
}

impl Kind {
    /// The word used in scenes and manifests.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Joint => "joint",
            Self::Force => "force",
            Self::Control => "control",
        }
    }
}

/// A name with a unit and a sentence.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Named {
    /// Name used in scenes.
    pub name: String,
    /// SI unit; empty where none applies.
    #[serde(default)]
    pub unit: String,
    /// One sentence for the user.
    #[serde(default)]
    pub doc: String,
}

/// A signal that an element class takes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NamedInput {
    /// Name used in scenes.
    pub name: String,
    /// SI unit; empty: any.
    #[serde(default)]
    pub unit: String,
    /// One sentence for the user.
    #[serde(default)]
    pub doc: String,
    /// Value where nothing is connected; `None`: it must be connected.
    #[serde(default)]
    pub default: Option<f64>,
}

/// What pictures of mechanisms know. At its last frame a joint and at its first another element is shown as `hinge`, `slider`,
/// `cylinder` and `screw` (about and along z), `ball`, `universal`, `plane` (across z), `weld`, `gear` (about z) or `torque`
/// (about z); between its first two frames as `rod` or `spring`; `none` is not shown.
pub const GLYPHS: [&str; 13] = [
    "hinge",
    "slider",
    "cylinder",
    "screw",
    "ball",
    "universal",
    "plane",
    "weld",
    "gear",
    "torque",
    "rod",
    "spring",
    "none",
];

/// An element class. Travels as TOML text: fields that a later version adds are ignored by an earlier host, and fields
/// that an earlier plugin lacks take their defaults.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Descriptor {
    /// Word used in scenes.
    pub name: String,
    /// What kind of element.
    pub kind: Kind,
    /// One sentence for the user.
    pub summary: String,
    /// Its manual page, Markdown; may be empty.
    #[serde(default)]
    pub doc: String,
    /// Called at run time instead of recorded.
    #[serde(default)]
    pub opaque: bool,
    /// Number of multi-turn angles.
    #[serde(default)]
    pub angles: usize,
    /// Number of mobility coordinates of a joint that offers them.
    #[serde(default)]
    pub mobility: Option<usize>,
    /// Whether the second frame turns freely on top of the mobility's pose.
    #[serde(default)]
    pub turns_freely: bool,
    /// How pictures show it, one of [`GLYPHS`]; empty: found from its equations.
    #[serde(default)]
    pub glyph: String,
    /// Frames it connects.
    #[serde(default)]
    pub frames: Vec<Named>,
    /// What each further frame is, where it takes any number of them. Contract 1.2.
    #[serde(default)]
    pub more_frames: Option<Named>,
    /// Largest number of frames in all, where it takes any number; 0 otherwise. Contract 1.2.
    #[serde(default)]
    pub most_frames: usize,
    /// Constraint rows.
    #[serde(default)]
    pub rows: Vec<String>,
    /// Signals it takes.
    #[serde(default)]
    pub inputs: Vec<NamedInput>,
    /// Joints whose reactions it takes.
    #[serde(default)]
    pub joints: Vec<Named>,
    /// Joint coordinates (joints), reported values (forces), signals it gives (control elements).
    #[serde(default)]
    pub channels: Vec<Named>,
    /// Names of the continuous states; an instance may have more.
    #[serde(default)]
    pub states: Vec<Named>,
    /// Parameters.
    #[serde(default)]
    pub params: Vec<ParamSpec>,
    /// Names of checks of the test kit that do not apply, with the reasons. Contract 1.2.
    #[serde(default)]
    pub exempt: Vec<(String, String)>,
    /// Conditions under which it may be used: name, unit of the margin, what is wrong where it is negative. Contract 1.2.
    #[serde(default)]
    pub checks: Vec<Named>,
    /// Rows of recommended parameters, CSV; may be empty. Contract 1.2.
    #[serde(default)]
    pub catalog: String,
    /// What reports say of an instance, Markdown; may be empty. Contract 1.2.
    #[serde(default)]
    pub report: String,
    /// Names of the internal unknowns; an instance may have more. Contract 1.2.
    #[serde(default)]
    pub unknowns: Vec<Named>,
    /// Values that a joint reports besides its coordinates. Contract 1.2.
    #[serde(default)]
    pub values: Vec<Named>,
    /// Pairs of frames, by number, whose z axes joints must keep parallel. Contract 1.2.
    #[serde(default)]
    pub parallel_axes: Vec<[usize; 2]>,
}

impl Descriptor {
    /// Sizes that no sensible element has would make the host allocate without bound; of two things of one name a scene reaches
    /// only the first.
    ///
    /// # Errors
    /// Which size is too large, and what is declared twice.
    pub fn check(&self) -> Result<(), String> {
        const MOST: usize = 1000;
        let sizes = [
            ("frames", self.frames.len().max(self.most_frames)),
            ("rows", self.rows.len()),
            ("angles", self.angles),
            ("mobility coordinates", self.mobility.unwrap_or(0)),
            ("channels", self.channels.len()),
            ("inputs", self.inputs.len()),
            ("joints", self.joints.len()),
            ("states", self.states.len()),
            ("exemptions", self.exempt.len()),
            ("checks", self.checks.len()),
            ("unknowns", self.unknowns.len()),
            ("values", self.values.len()),
            ("pairs of parallel axes", self.parallel_axes.len()),
        ];
        if self.opaque && !self.checks.is_empty() {
            return Err(format!("`{}` is opaque and declares checks, which only recorded elements have", self.name));
        }
        if self.parallel_axes.iter().flatten().any(|frame| *frame >= self.frames.len()) {
            return Err(format!("`{}` declares parallel axes of frames that it does not have", self.name));
        }
        if let Some((what, name)) = self.declared_twice() {
            return Err(format!(
                "`{}` declares two {what} with the name `{name}`; a scene reaches each by its name",
                self.name
            ));
        }
        match sizes.iter().find(|(_, count)| *count > MOST) {
            Some((what, count)) => Err(format!("`{}` declares {count} {what}; at most {MOST}", self.name)),
            None if self.more_frames.is_some() && self.most_frames <= self.frames.len() => Err(format!(
                "`{}` takes further frames, but at most {} in all; it has {} already",
                self.name,
                self.most_frames,
                self.frames.len()
            )),
            None => Ok(()),
        }
    }

    /// A name that two things of one kind have.
    fn declared_twice(&self) -> Option<(&'static str, &str)> {
        fn named(list: &[Named]) -> Vec<&str> {
            list.iter().map(|one| one.name.as_str()).collect()
        }
        let lists = [
            ("frames", named(&self.frames)),
            ("rows", self.rows.iter().map(String::as_str).collect()),
            ("inputs", self.inputs.iter().map(|one| one.name.as_str()).collect()),
            ("joints", named(&self.joints)),
            ("channels", named(&self.channels)),
            ("values", named(&self.values)),
            ("states", named(&self.states)),
            ("unknowns", named(&self.unknowns)),
            ("checks", named(&self.checks)),
            ("parameters", self.params.iter().map(|one| one.name.as_str()).collect()),
        ];
        let twice = |names: &[&str]| (1..names.len()).find(|k| names[..*k].contains(&names[*k]));
        lists.into_iter().find_map(|(what, names)| twice(&names).map(|k| (what, names[k])))
    }

    /// The values that it reports, for the quantity `value`: those of a joint besides its coordinates.
    #[must_use]
    pub fn reported(&self) -> &[Named] {
        if self.kind == Kind::Joint { &self.values } else { &self.channels }
    }

    /// The numbers of frames that it takes, the smallest and the largest.
    #[must_use]
    pub fn frame_counts(&self) -> (usize, usize) {
        let least = self.frames.len();
        (least, if self.more_frames.is_some() { self.most_frames } else { least })
    }

    /// That of an instance with this number of frames, which [`Descriptor::frame_counts`] allow: the further ones among the others,
    /// called by their name and a number.
    #[must_use]
    pub fn with_frames(&self, count: usize) -> Self {
        let mut own = self.clone();
        if let Some(more) = own.more_frames.take() {
            let numbered = (1..).map(|k| Named { name: format!("{} {k}", more.name), ..more.clone() });
            own.frames.extend(numbered.take(count.saturating_sub(self.frames.len())));
            own.most_frames = 0;
        }
        own
    }

    /// What recordings of this class may refer to: of any instance, or of the one that [`Descriptor::with_frames`] describes.
    #[must_use]
    pub fn limits(&self) -> Limits {
        let (coordinates, channels) = match self.kind {
            Kind::Joint => (self.channels.len(), self.values.len()),
            Kind::Force | Kind::Control => (0, self.channels.len()),
        };
        Limits {
            kind: self.kind,
            frames: self.frame_counts().1,
            rows: self.rows.len(),
            angles: self.angles,
            coordinates,
            mobility: self.mobility.unwrap_or(0),
            channels,
            inputs: self.inputs.len(),
            joints: self.joints.len(),
            checks: if self.kind == Kind::Joint || self.opaque { 0 } else { self.checks.len() },
        }
    }
}
