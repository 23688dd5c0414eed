//! Parameters for an examination: given ones, defaults, and for the rest a sensible value inside the stated range.

use element_api::descriptor::Descriptor;
use element_api::params::{ParamKind, ParamSpec, Table};
use serde::Serialize;

use crate::diagnostics::{Diagnostic, Source, codes, help_for};
use crate::model;
use crate::scene;

/// Where the value of a parameter comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Origin {
    /// Given by the caller.
    Given,
    /// The element's default.
    Default,
    /// Not given: the element's example.
    Example,
    /// Required and not given, without an example: a value inside its range.
    Taken,
}

/// A parameter as the element gets it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Value {
    /// Name of the parameter.
    pub name: String,
    /// The value in SI units, as TOML writes it.
    pub value: String,
    /// Its unit; may be empty.
    pub unit: String,
    /// Where it comes from.
    pub origin: Origin,
}

/// Parameters that cannot be had: what is wrong, and the text that places refer to.
#[derive(Debug)]
pub struct BadValues {
    /// All mistakes.
    pub diagnostics: Vec<Diagnostic>,
    /// The text.
    pub source: Source,
}

/// Values for the parameters of several elements, written as in a scene, with units.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Given {
    /// Tables by the name of an element; other values are for every element that has such a parameter.
    table: Table,
}

impl Given {
    /// Reads texts, each a TOML document or one `KEY=VALUE`, where a value that is not TOML stands for a text (`length=25 cm`).
    /// A key `ELEMENT.KEY`, or a table of an element's name, is for that element only.
    ///
    /// # Errors
    /// A text that is neither.
    pub fn read(texts: &[String]) -> Result<Self, BadValues> {
        let mut table = Table::new();
        for text in texts {
            for (key, value) in document(text)? {
                match (table.get_mut(&key), value) {
                    (Some(toml::Value::Table(known)), toml::Value::Table(more)) => known.extend(more),
                    (_, value) => {
                        table.insert(key, value);
                    }
                }
            }
        }
        Ok(Self { table })
    }

    /// Whether every name is that of an element, or of a parameter of one.
    ///
    /// # Errors
    /// The first one that is not.
    pub fn check(&self, elements: &[&Descriptor]) -> Result<(), Box<Diagnostic>> {
        for (key, value) in &self.table {
            let of_element = value.is_table() && elements.iter().any(|element| element.name == *key);
            let of_parameter = elements.iter().any(|element| element.params.iter().any(|spec| spec.name == *key));
            if !of_element && !of_parameter {
                let names = elements.iter().flat_map(|e| e.params.iter().map(|spec| spec.name.as_str()));
                let mut names: Vec<&str> = names.chain(elements.iter().map(|e| e.name.as_str())).collect();
                names.sort_unstable();
                names.dedup();
                let text = format!("`{key}` is no parameter of an element that is examined, and no such element");
                let help = help_for(key, &names, "names");
                return Err(Box::new(Diagnostic::error(codes::EXAMINED_WITH, text).help_if(help)));
            }
        }
        Ok(())
    }

    /// What is given for one element.
    pub(super) fn of(&self, descriptor: &Descriptor) -> Table {
        let own = self.table.get(&descriptor.name).and_then(toml::Value::as_table);
        let known = |name: &str| descriptor.params.iter().any(|spec| spec.name == name);
        let common = self.table.iter().filter(|(key, value)| known(key) && (!value.is_table() || own.is_none()));
        let mut table: Table = common.map(|(key, value)| (key.clone(), value.clone())).collect();
        table.extend(own.cloned().unwrap_or_default());
        table
    }
}

/// A text of parameters as a table.
fn document(text: &str) -> Result<Table, BadValues> {
    let error = match text.parse::<Table>() {
        Ok(table) => return Ok(table),
        Err(error) => error,
    };
    if let (Some((key, value)), true) = (text.split_once('='), text.lines().count() == 1) {
        let quoted = format!("{} = {}", key.trim(), toml::Value::String(value.trim().into()));
        if let Ok(table) = quoted.parse::<Table>() {
            return Ok(table);
        }
    }
    let place = error.span().unwrap_or(0..text.len());
    let diagnostic = Diagnostic::error(codes::EXAMINED_WITH, "parameters that are not TOML")
        .at(place, error.message().to_string())
        .help("KEY=VALUE, or a file with a table `[ELEMENT]` of such lines");
    Err(BadValues { diagnostics: vec![diagnostic], source: Source::new("--params", text) })
}

/// The parameters of one element: complete, in SI units, inside their ranges.
pub(super) fn complete(descriptor: &Descriptor, given: &Given) -> Result<(Table, Vec<Value>), BadValues> {
    let mut written = given.of(descriptor);
    let mut origins: Vec<(&ParamSpec, Origin)> = Vec::new();
    for spec in &descriptor.params {
        let origin = match (written.contains_key(&spec.name), &spec.default, spec.optional) {
            (true, ..) => Origin::Given,
            (false, Some(_), _) if spec.example.is_none() => Origin::Default,
            (false, None, true) if spec.example.is_none() => continue,
            _ => {
                let value = spec.example.clone().unwrap_or_else(|| sensible(spec));
                written.insert(spec.name.clone(), value);
                if spec.example.is_some() { Origin::Example } else { Origin::Taken }
            }
        };
        origins.push((spec, origin));
    }
    let table = resolve(descriptor, &written)?;
    let value = |(spec, origin): (&ParamSpec, Origin)| Value {
        name: spec.name.clone(),
        value: table.get(&spec.name).map(ToString::to_string).unwrap_or_default(),
        unit: spec.unit.clone(),
        origin,
    };
    let values = origins.into_iter().map(value).collect();
    Ok((table, values))
}

/// What a scene with an element of these parameters would hand to it.
fn resolve(descriptor: &Descriptor, written: &Table) -> Result<Table, BadValues> {
    // Of all kinds of elements, a control element asks for least around it.
    let mut text =
        "[simulation]\nt_end = 1\noutput_step = 1\n[[control]]\nname = \"examined\"\ntype = \"examined\"\n".to_string();
    for (key, value) in written {
        text.push_str(&format!("params.{} = {value}\n", toml::Value::String(key.clone())));
    }
    let source = Source::new("--params", text);
    let (scene, _) = scene::parse(source, &[])
        .map_err(|rejected| BadValues { diagnostics: rejected.diagnostics, source: rejected.source })?;
    let mut found = Vec::new();
    let record = scene.elements.first().expect("the text has one element");
    let table = model::resolve_parameters(
        &scene,
        record,
        (&descriptor.params, &descriptor.catalog),
        &descriptor.name,
        descriptor.kind,
        &mut found,
    );
    if found.is_empty() { Ok(table) } else { Err(BadValues { diagnostics: found, source: scene.source }) }
}

/// A value inside the range of a parameter, in SI units.
fn sensible(spec: &ParamSpec) -> toml::Value {
    let number = toml::Value::Float(number(spec));
    let list = |items: &[toml::Value]| toml::Value::Array(items.to_vec());
    match spec.kind {
        // A constant is the simplest function.
        ParamKind::Number | ParamKind::Function => number,
        ParamKind::Integer => toml::Value::Integer(integer(spec)),
        ParamKind::Boolean => toml::Value::Boolean(true),
        ParamKind::Text => toml::Value::String(spec.choices.first().cloned().unwrap_or_else(|| "text".into())),
        ParamKind::Vector if spec.contains(0.0) && spec.contains(1.0) => list(&[0.0, 0.0, 1.0].map(toml::Value::Float)),
        ParamKind::Vector => list(&[number.clone(), number.clone(), number]),
        ParamKind::List => list(&[number]),
        ParamKind::Curve => {
            // It ends as it begins, in case it is periodic.
            let point = |x: f64| list(&[toml::Value::Float(x), number.clone()]);
            list(&[point(0.0), point(1.0), point(2.0)])
        }
        ParamKind::Surface => {
            let axis = list(&[0.0, 1.0].map(toml::Value::Float));
            let row = list(&[number.clone(), number]);
            let entries = [("x", axis.clone()), ("y", axis), ("z", list(&[row.clone(), row]))];
            toml::Value::Table(entries.into_iter().map(|(key, value)| (key.to_owned(), value)).collect())
        }
    }
}

/// One, if that is allowed, otherwise something between the bounds.
fn number(spec: &ParamSpec) -> f64 {
    let low = [spec.min, spec.above].into_iter().flatten().fold(f64::NEG_INFINITY, f64::max);
    let high = [spec.max, spec.below].into_iter().flatten().fold(f64::INFINITY, f64::min);
    let candidates = [1.0, 0.5, 0.5 * (low + high), low + 1.0, high - 1.0, 2.0 * low, 0.5 * high, low, high];
    candidates.into_iter().find(|x| x.is_finite() && spec.contains(*x)).unwrap_or(1.0)
}

/// The same for whole numbers.
fn integer(spec: &ParamSpec) -> i64 {
    let low = [spec.min, spec.above].into_iter().flatten().fold(f64::NEG_INFINITY, f64::max);
    let start = if low.is_finite() { low.floor() as i64 } else { 0 };
    let candidates = [1, start, start + 1];
    candidates.into_iter().find(|x| spec.contains(*x as f64)).unwrap_or(1)
}
