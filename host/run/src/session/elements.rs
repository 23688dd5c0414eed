//! What elements themselves have to say of a run: their sections, and warnings where their conditions did not hold.

use super::opened::Session;
use super::simulation::Extremes;
use crate::diagnostics::codes;
use crate::model::{Watched, WatchedValue};
use crate::results::{ElementCheck, ElementRecord, GridRange, Summary, ValueRange};
use crate::scene::{Dimension, parse_unit};
use element_api::descriptor::Kind;

impl Session {
    /// The records of elements, from what was seen of what [`crate::model::Model::watched`] lists.
    pub(super) fn element_records(&self, found: &[Extremes]) -> Vec<ElementRecord> {
        let mut records: Vec<ElementRecord> = Vec::new();
        let mut last = None;
        for (Watched { element, value }, seen) in self.model.watched().into_iter().zip(found) {
            let instance = &self.model.elements[element];
            if last.replace(element) != Some(element) {
                records.push(ElementRecord {
                    element: instance.name.clone(),
                    type_name: instance.class.name.clone(),
                    library: instance.library.clone(),
                    text: if instance.has_section() { instance.class.report.clone() } else { String::new() },
                    ..ElementRecord::default()
                });
            }
            let Some(record) = records.last_mut() else { continue };
            match value {
                WatchedValue::Channel(k) => {
                    let named = &instance.class.channels[k];
                    record.values.push(self.range(&named.name, &named.unit, seen));
                }
                WatchedValue::Check(k) => {
                    let named = &instance.class.checks[k];
                    let range = self.range(&named.name, &named.unit, seen);
                    let open = self.plan.undetermined.iter().find(|open| open.element == element);
                    record.checks.push(ElementCheck {
                        name: named.name.clone(),
                        words: named.doc.clone(),
                        holds: seen.first.is_none(),
                        margin: range.smallest,
                        unit: range.unit,
                        at: range.smallest_at,
                        first: seen.first.map(|t| t / self.unit_of_time()),
                        unique: !open.is_some_and(|open| open.checks[k]),
                    });
                }
                WatchedValue::Grid(k) => {
                    let grid = &instance.grids[k];
                    let (factor, _) = self.unit_of(&grid.unit);
                    let range = GridRange {
                        parameter: grid.parameter.clone(),
                        argument: self.range(&grid.axis, &grid.unit, seen),
                        grid: grid.bounds.map(|bound| bound / factor),
                        first: seen.first.map(|t| t / self.unit_of_time()),
                        of_joint: instance.class.kind == Kind::Joint,
                    };
                    // Computed twice by the element, it is the same argument.
                    if !record.grids.contains(&range) {
                        record.grids.push(range);
                    }
                }
            }
        }
        records
    }

    /// Warns of conditions that did not hold, once the run has ended. The status stays.
    pub(super) fn warn_of_elements(&self, summary: &mut Summary) {
        let unit = &summary.time_unit;
        let failed = failed(&summary.elements, unit).into_iter().map(|text| (codes::ELEMENT_CHECK, text));
        let left = summary.elements.iter().flat_map(|one| one.left_grids(unit).map(|text| (codes::LEFT_GRID, text)));
        let warnings: Vec<String> = failed.chain(left).map(|(code, text)| format!("{code}: {text}")).collect();
        summary.warnings.extend(warnings);
        // What has no section of its own was there for this only.
        summary.elements.retain(|one| {
            !one.text.is_empty() || !one.values.is_empty() || one.checks.iter().any(|check| !check.holds)
        });
    }

    fn range(&self, name: &str, unit: &str, seen: &Extremes) -> ValueRange {
        let (factor, unit) = self.unit_of(unit);
        let ([smallest, smallest_at], [largest, largest_at]) = (seen.smallest, seen.largest);
        let time = self.unit_of_time();
        ValueRange {
            name: name.into(),
            unit,
            smallest: smallest / factor,
            smallest_at: smallest_at / time,
            largest: largest / factor,
            largest_at: largest_at / time,
        }
    }

    /// The scene's unit for one that an element declares: its factor, and how it is written.
    fn unit_of(&self, unit: &str) -> (f64, String) {
        match parse_unit(unit) {
            Ok((dimension, _)) if !unit.is_empty() && unit != "1" => {
                (self.scene.units.factor(dimension), self.scene.units.label_as(dimension, unit))
            }
            _ => (1.0, String::new()),
        }
    }

    fn unit_of_time(&self) -> f64 {
        self.scene.units.factor(Dimension::TIME)
    }
}

/// Elements of a type that are named beside the first whose check did not hold.
const NAMED: usize = 3;

/// Checks that did not hold, in words: of elements of one type, the first that failed, and names of others.
fn failed(elements: &[ElementRecord], time_unit: &str) -> Vec<String> {
    let mut groups: Vec<Vec<(&ElementRecord, &ElementCheck)>> = Vec::new();
    for (element, check) in elements.iter().flat_map(|one| one.checks.iter().map(move |check| (one, check))) {
        let alike = |(other, same): &(&ElementRecord, &ElementCheck)| {
            (&other.library, &other.type_name, &same.name) == (&element.library, &element.type_name, &check.name)
        };
        match groups.iter_mut().find(|group| alike(&group[0])) {
            _ if check.holds => (),
            Some(group) => group.push((element, check)),
            None => groups.push(vec![(element, check)]),
        }
    }
    let words = |group: Vec<(&ElementRecord, &ElementCheck)>| {
        let time = |check: &ElementCheck| check.first.unwrap_or(check.at);
        let first = (0..group.len()).min_by(|a, b| time(group[*a].1).total_cmp(&time(group[*b].1)))?;
        let (element, check) = group[first];
        let others: Vec<String> = (group.iter().enumerate().filter(|(k, _)| *k != first))
            .map(|(_, (one, _))| format!("`{}`", one.element))
            .collect();
        let also = match others.len() {
            0 => String::new(),
            n if n <= NAMED => format!("; also {}", others.join(", ")),
            n => format!("; also {} and {} more", others[..NAMED].join(", "), n - NAMED),
        };
        Some(element.failed(check, time_unit) + &also)
    };
    groups.into_iter().filter_map(words).collect()
}
