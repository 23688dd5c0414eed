//! `[parameters]`: named quantities that expressions refer to.

use super::expression::{self, Expression, is_parameter_name, is_reserved};
use super::quantity::{Names, Quantity, UNUSABLE, evaluate};
use super::raw::{RawKind, RawTable, RawValue};
use super::reader::{expression_diagnostic, unusable};
use super::unit_system::UnitSystem;
use odyn_diagnostics::{Diagnostic, Source, codes};
use std::collections::{HashMap, HashSet};
use std::ops::Range;

/// Parameters of a scene by their dotted names, in the order of the text.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Parameters {
    entries: Vec<Parameter>,
    index: HashMap<String, usize>,
}

/// One parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Dotted name, `crank.radius`.
    pub name: String,
    /// Its value. A parameter given as a plain number stays one and takes the unit of its place of use.
    pub value: Quantity,
    /// Byte range of the value.
    pub span: Range<usize>,
}

impl Parameters {
    /// The parameter of that dotted name.
    pub fn get(&self, name: &str) -> Option<&Parameter> {
        self.index.get(name).map(|&index| &self.entries[index])
    }

    /// All parameters in the order of the text.
    pub fn iter(&self) -> impl Iterator<Item = &Parameter> {
        self.entries.iter()
    }

    /// Number of parameters.
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// True if there are none.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }
}

impl Names for Parameters {
    fn value(&self, name: &str) -> Option<Quantity> {
        self.get(name).map(|parameter| parameter.value)
    }

    fn names(&self) -> Vec<&str> {
        self.iter().map(|parameter| parameter.name.as_str()).collect()
    }
}

/// A parameter before its value is known.
struct Unresolved<'a> {
    name: String,
    raw: &'a RawValue,
    definition: Definition,
}

enum Definition {
    Number(f64),
    Text(Expression),
    /// Already reported.
    Broken,
}

/// Reads the table and computes all parameters, whatever their order.
pub(super) fn read(
    table: &RawTable,
    units: &UnitSystem,
    source: &Source,
    diagnostics: &mut Vec<Diagnostic>,
) -> Parameters {
    let mut flat: Vec<(String, &RawValue)> = Vec::new();
    flatten(table, "", &mut flat, diagnostics);
    let names: HashSet<&str> = flat.iter().map(|(name, _)| name.as_str()).collect();
    let is_parameter = |name: &str| names.contains(name);

    let mut all: Vec<Unresolved<'_>> = Vec::new();
    for (name, raw) in &flat {
        let definition = match &raw.kind {
            RawKind::Number(value) => Definition::Number(*value),
            RawKind::Integer(value) => Definition::Number(*value as f64),
            RawKind::Text(text) => match expression::parse(text, &is_parameter) {
                Ok(parsed) => Definition::Text(parsed),
                Err(error) => {
                    diagnostics.push(expression_diagnostic(&error, raw, source));
                    Definition::Broken
                }
            },
            _ => {
                diagnostics.push(
                    Diagnostic::error(
                        codes::WRONG_TYPE,
                        format!("parameter `{name}` must be a number or an expression"),
                    )
                    .at(raw.span.clone(), format!("found {}", raw.kind.describe())),
                );
                Definition::Broken
            }
        };
        all.push(Unresolved { name: name.clone(), raw, definition });
    }
    resolve(&all, units, source, diagnostics)
}

/// Warns of parameters whose names stand in no text of the scene, those of other parameters among them.
pub(super) fn warn_of_unused(root: &RawTable, parameters: &Parameters, diagnostics: &mut Vec<Diagnostic>) {
    if parameters.is_empty() {
        return;
    }
    let mut unused: HashSet<&str> = parameters.iter().map(|parameter| parameter.name.as_str()).collect();
    take_words(root, &mut unused);
    for parameter in parameters.iter().filter(|parameter| unused.contains(parameter.name.as_str())) {
        let name = &parameter.name;
        diagnostics.push(
            Diagnostic::warning(codes::UNUSED_PARAMETER, format!("nothing uses the parameter `{name}`"))
                .at(parameter.span.clone(), "changing it changes nothing")
                .help(format!("write `\"{name}\"` where it is meant, or take it away")),
        );
    }
}

/// Takes away the names that stand in the texts of a table.
fn take_words(table: &RawTable, names: &mut HashSet<&str>) {
    let mut open: Vec<&RawValue> = table.entries.iter().map(|(_, value)| value).collect();
    while let Some(value) = open.pop().filter(|_| !names.is_empty()) {
        match &value.kind {
            RawKind::Text(text) => {
                for word in text.split(|c: char| !(c.is_alphanumeric() || matches!(c, '_' | '.'))) {
                    names.remove(word.trim_matches('.'));
                }
            }
            RawKind::Array(items) => open.extend(items),
            RawKind::Table(inner) => open.extend(inner.entries.iter().map(|(_, value)| value)),
            _ => {}
        }
    }
}

/// Collects the leaves of nested tables under their dotted names.
///
/// Recursion is as deep as the nesting, which [`super::raw`] has limited.
fn flatten<'a>(
    table: &'a RawTable,
    prefix: &str,
    flat: &mut Vec<(String, &'a RawValue)>,
    diagnostics: &mut Vec<Diagnostic>,
) {
    for (key, value) in &table.entries {
        let name = match prefix {
            "" => key.value.clone(),
            _ => format!("{prefix}.{}", key.value),
        };
        if !is_parameter_name(&key.value) {
            diagnostics
                .push(unusable(&name, key.span.clone()).help("a parameter has a name of letters, digits and `_`"));
            continue;
        }
        if is_reserved(&name) {
            diagnostics.push(
                Diagnostic::error(codes::BAD_NAME, format!("`{name}` has a meaning of its own in expressions"))
                    .at(key.span.clone(), "cannot be the name of a parameter"),
            );
            continue;
        }
        match &value.kind {
            RawKind::Table(inner) => flatten(inner, &name, flat, diagnostics),
            _ => flat.push((name, value)),
        }
    }
}

/// Computes parameters in an order in which each comes after those it refers to (Kahn 1962); what is left
/// over depends on a cycle.
fn resolve(
    all: &[Unresolved<'_>],
    units: &UnitSystem,
    source: &Source,
    diagnostics: &mut Vec<Diagnostic>,
) -> Parameters {
    let index: HashMap<&str, usize> =
        all.iter().enumerate().map(|(i, parameter)| (parameter.name.as_str(), i)).collect();
    let needs: Vec<Vec<usize>> = all.iter().map(|parameter| references(&parameter.definition, &index)).collect();
    let mut users: Vec<Vec<usize>> = vec![Vec::new(); all.len()];
    for (user, needed) in needs.iter().enumerate() {
        for &one in needed {
            users[one].push(user);
        }
    }
    let mut open: Vec<usize> = needs.iter().map(Vec::len).collect();
    let mut ready: Vec<usize> = (0..all.len()).rev().filter(|&i| open[i] == 0).collect();
    let mut known = Known { all, index, values: vec![None; all.len()] };
    while let Some(next) = ready.pop() {
        let value = match &all[next].definition {
            Definition::Number(value) => Some(Quantity::number(*value)),
            Definition::Broken => None,
            Definition::Text(parsed) => match evaluate(parsed, &known, units) {
                Ok(value) => Some(value),
                Err(error) => {
                    if !error.reported {
                        diagnostics.push(expression_diagnostic(&error, all[next].raw, source));
                    }
                    None
                }
            },
        };
        known.values[next] = value;
        for &user in &users[next] {
            open[user] -= 1;
            if open[user] == 0 {
                ready.push(user);
            }
        }
    }
    report_cycles(all, &needs, &open, diagnostics);
    collect(all, &known.values)
}

fn collect(all: &[Unresolved<'_>], values: &[Option<Quantity>]) -> Parameters {
    let mut parameters = Parameters::default();
    for (parameter, value) in all.iter().zip(values) {
        parameters.index.insert(parameter.name.clone(), parameters.entries.len());
        parameters.entries.push(Parameter {
            name: parameter.name.clone(),
            value: value.unwrap_or(UNUSABLE),
            span: parameter.raw.span.clone(),
        });
    }
    parameters
}

/// Parameters that an expression refers to, each once.
fn references(definition: &Definition, index: &HashMap<&str, usize>) -> Vec<usize> {
    let Definition::Text(parsed) = definition else {
        return Vec::new();
    };
    let mut found: Vec<usize> = parsed.parameters().filter_map(|name| index.get(name).copied()).collect();
    found.sort_unstable();
    found.dedup();
    found
}

/// Reports each circle once: from a parameter that is left over, following one open need after the other
/// leads into a circle, since each one left over has such a need.
fn report_cycles(all: &[Unresolved<'_>], needs: &[Vec<usize>], open: &[usize], diagnostics: &mut Vec<Diagnostic>) {
    let mut visited_from: Vec<Option<usize>> = vec![None; all.len()];
    for start in (0..all.len()).filter(|&i| open[i] > 0) {
        let mut path: Vec<usize> = Vec::new();
        let mut current = start;
        while visited_from[current].is_none() {
            visited_from[current] = Some(start);
            path.push(current);
            current = *needs[current]
                .iter()
                .find(|&&needed| open[needed] > 0)
                .expect("what is left over needs something left over");
        }
        if visited_from[current] != Some(start) {
            continue; // ran into a circle already reported
        }
        let entrance = path.iter().position(|&i| i == current).expect("the walk came back to its own path");
        let circle: Vec<&str> = path[entrance..].iter().chain([&current]).map(|&i| all[i].name.as_str()).collect();
        diagnostics.push(
            Diagnostic::error(codes::PARAMETER_CYCLE, format!("parameter `{}` needs itself", all[current].name))
                .at(all[current].raw.span.clone(), shorten(&circle))
                .help("give one of them as a number"),
        );
    }
}

/// `a needs b needs a`, with a gap if there are many.
fn shorten(circle: &[&str]) -> String {
    const SHOWN: usize = 8;
    if circle.len() <= SHOWN {
        return circle.join(" needs ");
    }
    let last = circle.last().copied().unwrap_or_default();
    format!("{} needs ... needs {last}", circle[..SHOWN].join(" needs "))
}

/// Values known so far.
struct Known<'a> {
    all: &'a [Unresolved<'a>],
    index: HashMap<&'a str, usize>,
    values: Vec<Option<Quantity>>,
}

impl Names for Known<'_> {
    fn value(&self, name: &str) -> Option<Quantity> {
        let &index = self.index.get(name)?;
        Some(self.values[index].unwrap_or(UNUSABLE))
    }

    fn names(&self) -> Vec<&str> {
        self.all.iter().map(|one| one.name.as_str()).collect()
    }
}
