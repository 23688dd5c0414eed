//! Parameters of an element: described once, checked by the host, read by the plugin.
//!
//! The struct deriving [`Parameters`] is the single source: names, units, defaults, ranges and texts come from it. A
//! scene is checked against the [`ParamSpec`]s before the plugin sees a value, so [`crate::Element::new`] only has to
//! check what one range cannot say.
//!
//! What the plugin receives is complete and plain: every number is in SI units, every default is filled in.

use serde::{Deserialize, Serialize};

/// The table of values a plugin reads its parameters from.
pub type Table = toml::Table;

/// What the scene gives an element. Derive it: `#[derive(Parameters)]`.
pub trait Parameters: Sized {
    /// One entry per parameter, in the order of the struct.
    fn specs() -> Vec<ParamSpec>;
    /// Reads the struct from a table that the host has checked against [`Parameters::specs`].
    ///
    /// # Errors
    /// Names the key whose value is missing or of another type.
    fn read(table: &Table) -> Result<Self, ParamError>;
}

/// For elements without parameters.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct NoParameters;

impl Parameters for NoParameters {
    fn specs() -> Vec<ParamSpec> {
        Vec::new()
    }
    fn read(_: &Table) -> Result<Self, ParamError> {
        Ok(Self)
    }
}

/// A parameter that cannot be used, by name and in words the user of a scene understands.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ParamError {
    /// Name of the parameter; empty when the mistake is not in a single one. The host points at it in the scene.
    pub path: String,
    /// What is wrong and what would be right.
    pub message: String,
}

impl ParamError {
    /// An error about the parameter `path`.
    pub fn new(path: impl Into<String>, message: impl Into<String>) -> Self {
        Self { path: path.into(), message: message.into() }
    }
}

impl std::fmt::Display for ParamError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if self.path.is_empty() { f.write_str(&self.message) } else { write!(f, "{}: {}", self.path, self.message) }
    }
}

impl std::error::Error for ParamError {}

/// The description of one parameter.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ParamSpec {
    /// Key in the scene's `params` table.
    pub name: String,
    /// What kind of value is expected.
    pub kind: ParamKind,
    /// Unit of the values the plugin receives (SI), for example `"N/m"`; its dimension is what scenes are checked
    /// against; empty: any. For a curve or function, `"rad/s -> N m"`: unit of the argument, arrow, unit of the value; for a
    /// surface, `"rad/s, 1 -> N m"`.
    pub unit: String,
    /// One sentence for the user.
    pub doc: String,
    /// May be left out although there is no default.
    #[serde(default)]
    pub optional: bool,
    /// Value used when the scene gives none.
    #[serde(default)]
    pub default: Option<toml::Value>,
    /// A value that the element takes, for `odyn plugin check`, which takes it in the place of a default too. Contract 1.2.
    #[serde(default)]
    pub example: Option<toml::Value>,
    /// Smallest allowed number (inclusive).
    #[serde(default)]
    pub min: Option<f64>,
    /// Largest allowed number (inclusive).
    #[serde(default)]
    pub max: Option<f64>,
    /// Numbers must be larger than this.
    #[serde(default)]
    pub above: Option<f64>,
    /// Numbers must be smaller than this.
    #[serde(default)]
    pub below: Option<f64>,
    /// The texts that are allowed; empty: any.
    #[serde(default)]
    pub choices: Vec<String>,
    /// Name of a function's variable in expressions; empty: `x`.
    #[serde(default)]
    pub variable: String,
}

impl ParamSpec {
    /// A parameter of the Rust type `T`.
    #[must_use]
    pub fn new<T: ParamType>(name: &str, unit: &str, doc: &str) -> Self {
        Self {
            name: name.into(),
            kind: T::KIND,
            unit: unit.into(),
            doc: doc.into(),
            optional: T::OPTIONAL,
            default: None,
            example: None,
            min: None,
            max: None,
            above: None,
            below: None,
            choices: Vec::new(),
            variable: String::new(),
        }
    }

    /// With a value for scenes that give none.
    #[must_use]
    pub fn default_value(mut self, value: toml::Value) -> Self {
        self.default = Some(value);
        self
    }

    /// With a value that the element takes.
    #[must_use]
    pub fn example_value(mut self, value: toml::Value) -> Self {
        self.example = Some(value);
        self
    }

    /// With a smallest allowed number.
    #[must_use]
    pub fn min(mut self, bound: f64) -> Self {
        self.min = Some(bound);
        self
    }

    /// With a largest allowed number.
    #[must_use]
    pub fn max(mut self, bound: f64) -> Self {
        self.max = Some(bound);
        self
    }

    /// Numbers must be larger than `bound`.
    #[must_use]
    pub fn above(mut self, bound: f64) -> Self {
        self.above = Some(bound);
        self
    }

    /// Numbers must be smaller than `bound`.
    #[must_use]
    pub fn below(mut self, bound: f64) -> Self {
        self.below = Some(bound);
        self
    }

    /// With the texts that are allowed.
    #[must_use]
    pub fn choices(mut self, choices: &[&str]) -> Self {
        self.choices = choices.iter().map(ToString::to_string).collect();
        self
    }

    /// With the name of a function's variable.
    #[must_use]
    pub fn variable(mut self, name: &str) -> Self {
        self.variable = name.into();
        self
    }

    /// The range in words, for example `">= 0"`; empty when there is none.
    #[must_use]
    pub fn range_text(&self) -> String {
        let parts = [("> ", self.above), (">= ", self.min), ("< ", self.below), ("<= ", self.max)];
        let texts: Vec<String> = parts.iter().filter_map(|(sign, bound)| bound.map(|b| format!("{sign}{b}"))).collect();
        texts.join(" and ")
    }

    /// Whether one number lies in the range. NaN never does.
    #[must_use]
    pub fn contains(&self, x: f64) -> bool {
        !x.is_nan()
            && self.min.is_none_or(|b| x >= b)
            && self.max.is_none_or(|b| x <= b)
            && self.above.is_none_or(|b| x > b)
            && self.below.is_none_or(|b| x < b)
    }
}

/// Kinds of parameter values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ParamKind {
    /// A number with a unit.
    Number,
    /// A whole number.
    Integer,
    /// `true` or `false`.
    Boolean,
    /// A text.
    Text,
    /// Three numbers with a unit.
    Vector,
    /// Any number of numbers with a unit.
    List,
    /// Pairs of argument and value.
    Curve,
    /// A function of one variable: see [`crate::Function`].
    Function,
    /// A function of two variables, given on a grid: see [`crate::Surface`]. Contract 1.2.
    Surface,
}

impl ParamKind {
    /// The kind in words.
    #[must_use]
    pub fn text(self) -> &'static str {
        match self {
            Self::Number => "number",
            Self::Integer => "whole number",
            Self::Boolean => "true or false",
            Self::Text => "text",
            Self::Vector => "list of 3 numbers",
            Self::List => "list of numbers",
            Self::Curve => "list of [argument, value] pairs",
            Self::Function => "number, expression or list of [argument, value] pairs",
            Self::Surface => "grid `{ x = [...], y = [...], z = [[...], ...] }`",
        }
    }
}

/// Key under which an element that takes any number of frames is given how many it has, among its parameters. No parameter can be
/// called so. Contract 1.2.
pub const FRAME_COUNT: &str = "#frames";

/// Rust types that a parameter can have.
pub trait ParamType: Sized {
    /// The kind a scene must give.
    const KIND: ParamKind;
    /// Whether a scene may leave it out.
    const OPTIONAL: bool = false;
    /// Reads the value; `None` when it is of another kind.
    fn read_value(value: &toml::Value) -> Option<Self>;
    /// Reads the value of the parameter `name`.
    ///
    /// # Errors
    /// When it is of another kind, or can't be used.
    fn read_named(value: &toml::Value, name: &str) -> Result<Self, ParamError> {
        Self::read_value(value).ok_or_else(|| {
            ParamError::new(name, format!("must be a {}, found {}", Self::KIND.text(), value.type_str()))
        })
    }
    /// The value as TOML.
    fn write(&self) -> toml::Value;
    /// What stands for a value that is not there; `None`: it must be there.
    #[must_use]
    fn absent() -> Option<Self> {
        None
    }
}

/// Reads the parameter `name` from `table`.
///
/// # Errors
/// When it is missing and not optional, or of another kind.
pub fn read<T: ParamType>(table: &Table, name: &str) -> Result<T, ParamError> {
    match table.get(name) {
        None => T::absent().ok_or_else(|| ParamError::new(name, format!("is missing: a {} is needed", T::KIND.text()))),
        Some(value) => T::read_named(value, name),
    }
}

impl ParamType for f64 {
    const KIND: ParamKind = ParamKind::Number;
    fn read_value(value: &toml::Value) -> Option<Self> {
        // TOML distinguishes 1 and 1.0; users don't.
        value.as_float().or_else(|| value.as_integer().map(|i| i as f64))
    }
    fn write(&self) -> toml::Value {
        toml::Value::Float(*self)
    }
}

impl ParamType for i64 {
    const KIND: ParamKind = ParamKind::Integer;
    fn read_value(value: &toml::Value) -> Option<Self> {
        value.as_integer()
    }
    fn write(&self) -> toml::Value {
        toml::Value::Integer(*self)
    }
}

impl ParamType for bool {
    const KIND: ParamKind = ParamKind::Boolean;
    fn read_value(value: &toml::Value) -> Option<Self> {
        value.as_bool()
    }
    fn write(&self) -> toml::Value {
        toml::Value::Boolean(*self)
    }
}

impl ParamType for String {
    const KIND: ParamKind = ParamKind::Text;
    fn read_value(value: &toml::Value) -> Option<Self> {
        value.as_str().map(Into::into)
    }
    fn write(&self) -> toml::Value {
        toml::Value::String(self.clone())
    }
}

impl ParamType for [f64; 3] {
    const KIND: ParamKind = ParamKind::Vector;
    fn read_value(value: &toml::Value) -> Option<Self> {
        Vec::<f64>::read_value(value)?.try_into().ok()
    }
    fn write(&self) -> toml::Value {
        self.to_vec().write()
    }
}

impl ParamType for Vec<f64> {
    const KIND: ParamKind = ParamKind::List;
    fn read_value(value: &toml::Value) -> Option<Self> {
        value.as_array()?.iter().map(f64::read_value).collect()
    }
    fn write(&self) -> toml::Value {
        toml::Value::Array(self.iter().map(f64::write).collect())
    }
}

impl ParamType for Vec<[f64; 2]> {
    const KIND: ParamKind = ParamKind::Curve;
    fn read_value(value: &toml::Value) -> Option<Self> {
        value.as_array()?.iter().map(|pair| Vec::<f64>::read_value(pair)?.try_into().ok()).collect()
    }
    fn write(&self) -> toml::Value {
        toml::Value::Array(self.iter().map(|pair| pair.to_vec().write()).collect())
    }
}

impl<T: ParamType> ParamType for Option<T> {
    const KIND: ParamKind = T::KIND;
    const OPTIONAL: bool = true;
    fn read_value(value: &toml::Value) -> Option<Self> {
        T::read_value(value).map(Some)
    }
    fn read_named(value: &toml::Value, name: &str) -> Result<Self, ParamError> {
        T::read_named(value, name).map(Some)
    }
    fn write(&self) -> toml::Value {
        self.as_ref().map_or(toml::Value::Boolean(false), T::write)
    }
    fn absent() -> Option<Self> {
        Some(None)
    }
}
