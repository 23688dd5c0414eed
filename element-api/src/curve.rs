//! [`Curve`]: points of a function as a parameter.

use crate::params::{ParamError, ParamKind, ParamType};
use crate::table::{Interpolation, Outside, Table};

/// Points that a scene gives, and how it wants them joined: `[[0, 0], [1, 5]]` or
/// `{ points = [[0, 0], [1, 5]], interpolation = "linear" }`.
///
/// A parameter for elements that look at the points themselves, or decide what is outside of them; others take a
/// [`crate::Function`]. A parameter of the type `Vec<[f64; 2]>` is given as the first form only, and leaves the user no
/// choice of interpolation.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// Pairs of argument and value, in the units of the parameter's description.
    pub points: Vec<[f64; 2]>,
    /// What the scene asks for.
    pub interpolation: Option<Interpolation>,
}

impl Curve {
    /// The function: as the scene wants it, or monotone.
    ///
    /// # Errors
    /// As [`Table::through`].
    pub fn table(&self, outside: Outside) -> Result<Table, ParamError> {
        Table::through(&self.points, self.interpolation.unwrap_or_default(), outside)
    }
}

impl ParamType for Curve {
    const KIND: ParamKind = ParamKind::Curve;

    fn read_value(value: &toml::Value) -> Option<Self> {
        Self::read_named(value, "").ok()
    }

    fn read_named(value: &toml::Value, name: &str) -> Result<Self, ParamError> {
        let table = value.as_table();
        let points = table.map_or(Some(value), |table| table.get("points"));
        let points = points.and_then(Vec::<[f64; 2]>::read_value).ok_or_else(|| {
            ParamError::new(
                name,
                "must be a list of [argument, value] pairs or `{ points = [...], interpolation = ... }`",
            )
        })?;
        let interpolation = table.map_or(Ok(None), Interpolation::of);
        Ok(Self { points, interpolation: interpolation.map_err(|error| ParamError::new(name, error.message))? })
    }

    fn write(&self) -> toml::Value {
        let Some(interpolation) = self.interpolation else { return self.points.write() };
        let mut entry = toml::Table::new();
        entry.insert("points".into(), self.points.write());
        entry.insert("interpolation".into(), interpolation.name().into());
        toml::Value::Table(entry)
    }
}
