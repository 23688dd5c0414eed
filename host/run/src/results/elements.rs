//! [`ElementRecord`]: what elements themselves have to say of a run, and how far their conditions held.

use serde::Serialize;

use super::text::significant;

/// An element with a section of its own in reports. Times in the summary's `time_unit`, numbers in the units named beside them.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct ElementRecord {
    /// Its name in the scene.
    pub element: String,
    /// Its type.
    #[serde(rename = "type")]
    pub type_name: String,
    /// The library that provides the type.
    pub library: String,
    /// What the library says of it, Markdown; may be empty.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub text: String,
    /// What it reports: the extremes, at accepted steps and samples.
    pub values: Vec<ValueRange>,
    /// Conditions under which it may be used.
    pub checks: Vec<ElementCheck>,
    /// Grids that it looked up.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub grids: Vec<GridRange>,
}

/// The extremes of a value.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct ValueRange {
    /// Its name.
    pub name: String,
    /// Its unit; may be empty.
    pub unit: String,
    /// The smallest.
    pub smallest: f64,
    /// Its time.
    pub smallest_at: f64,
    /// The largest.
    pub largest: f64,
    /// Its time.
    pub largest_at: f64,
}

/// A condition that an element declares.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct ElementCheck {
    /// Its name.
    pub name: String,
    /// What is wrong where it does not hold, in the library's words.
    pub words: String,
    /// Whether it held wherever it was looked at.
    pub holds: bool,
    /// The smallest margin; negative where it did not hold.
    pub margin: f64,
    /// Unit of the margin; may be empty.
    pub unit: String,
    /// The time it is at.
    pub at: f64,
    /// First time at which it did not hold.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub first: Option<f64>,
    /// Whether rigid bodies determine what it depends on.
    pub unique: bool,
}

/// The arguments with which an element looked up a grid, or a joint a curve that ends with a slope.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct GridRange {
    /// Name of the parameter.
    pub parameter: String,
    /// Which argument, and how far it went.
    #[serde(flatten)]
    pub argument: ValueRange,
    /// First and last value of the grid.
    pub grid: [f64; 2],
    /// First time outside.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub first: Option<f64>,
    /// Whether it is a curve of a joint, which bodies cannot follow beyond its ends.
    #[serde(skip)]
    pub of_joint: bool,
}

impl ElementRecord {
    /// A check of it that did not hold, in words: `` `main` (forces/bearing-rating) is loaded beyond its rating: ... ``.
    #[must_use]
    pub fn failed(&self, check: &ElementCheck, time_unit: &str) -> String {
        let margin = with_unit(check.margin, &check.unit);
        let [first, at] = [check.first.unwrap_or(check.at), check.at].map(|t| with_unit(t, time_unit));
        let doubt = if check.unique { "" } else { "; it depends on a reaction that is not unique" };
        format!(
            "`{}` ({}/{}) {}: first at t = {first}, margin of `{}` at the worst {margin} at t = {at}{doubt}",
            self.element, self.library, self.type_name, check.words, check.name
        )
    }

    /// Grids that were left, in words.
    pub fn left_grids(&self, time_unit: &str) -> impl Iterator<Item = String> {
        self.grids.iter().filter(|grid| !grid.of_joint && grid.first.is_some()).map(move |grid| {
            let ValueRange { name, unit, smallest, largest, .. } = &grid.argument;
            // A curve that ends level continues so.
            let ends: Vec<String> = grid.grid.iter().filter(|end| end.is_finite()).map(|end| significant(*end, 6)).collect();
            let range = [*smallest, *largest].map(|value| significant(value, 6));
            let first = with_unit(grid.first.unwrap_or_default(), time_unit);
            let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
            format!(
                "`{}`: {name} goes from {} to {}{unit}, the values of `{}` end at {}{unit}, where they are held; first outside at \
                 t = {first}",
                self.element,
                range[0],
                range[1],
                grid.parameter,
                ends.join(" and ")
            )
        })
    }

    /// Curves of a joint that bodies left by an end with a slope, in words.
    pub fn passed_ends(&self, time_unit: &str) -> impl Iterator<Item = String> {
        self.grids.iter().filter(|grid| grid.of_joint).filter_map(move |grid| {
            let ValueRange { name, unit, smallest, .. } = &grid.argument;
            let first = with_unit(grid.first?, time_unit);
            let (which, end) = if *smallest < grid.grid[0] { ("first", grid.grid[0]) } else { ("last", grid.grid[1]) };
            Some(format!(
                "`{}` passes the {which} point of the curve of `{}` at {name} = {} (t = {first}), where it arrives with a slope and continues \
                 level: the velocity is turned there without an impact; give points beyond the motion, or let the curve end level (two \
                 equal values)",
                self.element,
                grid.parameter,
                with_unit(end, unit)
            ))
        })
    }
}

fn with_unit(number: f64, unit: &str) -> String {
    let number = significant(number, 6);
    if unit.is_empty() { number } else { format!("{number} {unit}") }
}
