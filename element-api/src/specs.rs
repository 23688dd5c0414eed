//! What an element class declares of its frames, values and signals.

/// A frame of an element class.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FrameSpec {
    /// Short name.
    pub name: &'static str,
    /// What its origin and axes mean to the element.
    pub doc: &'static str,
}

impl FrameSpec {
    /// A frame with its meaning.
    #[must_use]
    pub const fn new(name: &'static str, doc: &'static str) -> Self {
        Self { name, doc }
    }
}

/// A reported value of an element class.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ChannelSpec {
    /// Name used in scenes.
    pub name: &'static str,
    /// SI unit of the value.
    pub unit: &'static str,
    /// One sentence for the user.
    pub doc: &'static str,
}

impl ChannelSpec {
    /// A value with its unit and meaning.
    #[must_use]
    pub const fn new(name: &'static str, unit: &'static str, doc: &'static str) -> Self {
        Self { name, unit, doc }
    }
}

/// A signal that an element class takes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InputSpec {
    /// Name used in scenes, under `inputs`.
    pub name: &'static str,
    /// SI unit of the value; empty: any.
    pub unit: &'static str,
    /// One sentence for the user.
    pub doc: &'static str,
    /// Value where a scene connects nothing; `None`: it must be connected.
    pub default: Option<f64>,
}

impl InputSpec {
    /// A signal that must be connected.
    #[must_use]
    pub const fn required(name: &'static str, unit: &'static str, doc: &'static str) -> Self {
        Self { name, unit, doc, default: None }
    }
    /// A signal that has a constant value (SI) where nothing is connected.
    #[must_use]
    pub const fn optional(name: &'static str, unit: &'static str, default: f64, doc: &'static str) -> Self {
        Self { name, unit, doc, default: Some(default) }
    }
}
