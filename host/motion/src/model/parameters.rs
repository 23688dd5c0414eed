//! Parameters of an element against their descriptions: complete, in SI units, inside their ranges.

use element_api::params::{ParamKind, ParamSpec, Table};
use element_api::{Interpolation, Kind};
use std::ops::Range;

use super::bodies::quoted;
use super::catalogue;
use crate::diagnostics::{Diagnostic, codes, help_for, suggest};
use crate::scene::{Dimension, ElementRecord, RawKind, RawTable, RawValue, Scene, parse_unit};

/// The table that the plugin receives: what the scene gives, else what the row of the element's catalogue has that it picks, else
/// defaults. Mistakes are added to `found`; the table is then incomplete.
pub fn resolve(
    scene: &Scene,
    record: &ElementRecord,
    (specs, catalog): (&[ParamSpec], &str),
    type_name: &str,
    kind: Kind,
    found: &mut Vec<Diagnostic>,
) -> Table {
    let mut table = Table::new();
    for (key, _) in &record.params.entries {
        let picks_row = key.value == catalogue::USE && catalogue::is_offered(specs, catalog);
        if !picks_row && !specs.iter().any(|spec| spec.name == key.value) {
            found.push(unknown(&key.value, key.span.clone(), specs, type_name));
        }
    }
    let row = match catalogue::chosen(&record.params, specs, catalog, type_name) {
        Ok(row) => row,
        Err(diagnostic) => {
            found.push(*diagnostic);
            return table;
        }
    };
    let of_row = |name: &str| row.iter().find(|(column, _)| column == name).map(|(_, value)| value);
    for spec in specs {
        let value = match record.params.get(&spec.name).or_else(|| of_row(&spec.name)) {
            Some(raw) => match convert(scene, raw, spec) {
                Ok(value) => with_interpolation(value, spec, kind),
                Err(diagnostic) => {
                    found.push(*diagnostic);
                    continue;
                }
            },
            None => match &spec.default {
                Some(default) => default.clone(),
                None => {
                    if !spec.optional {
                        found.push(missing(&record.params, spec, record, type_name));
                    }
                    continue;
                }
            },
        };
        table.insert(spec.name.clone(), value);
    }
    table
}

/// The name of the variable of a parameter that is a function.
pub(super) fn variable(spec: &ParamSpec) -> &str {
    if spec.variable.is_empty() { "x" } else { &spec.variable }
}

/// Where a parameter is written; the table of all where it is not.
pub(super) fn place(record: &ElementRecord, name: &str) -> Range<usize> {
    // `axis_i[2]` is written inside `axis_i`.
    let name = name.split(['[', '.']).next().unwrap_or(name);
    record.params.get(name).map_or_else(|| record.params.span.clone(), |raw| raw.span.clone())
}

fn unknown(key: &str, span: Range<usize>, specs: &[ParamSpec], type_name: &str) -> Diagnostic {
    let names: Vec<&str> = specs.iter().map(|spec| spec.name.as_str()).collect();
    let diagnostic =
        Diagnostic::error(codes::UNKNOWN_ELEMENT_PARAMETER, format!("unknown parameter `{key}` for `{type_name}`"))
            .at(span, format!("not a parameter of `{type_name}`"));
    let nearest = suggest(key, names.iter().copied());
    match nearest.and_then(|nearest| specs.iter().find(|spec| spec.name == nearest)) {
        Some(spec) => diagnostic.help(format!("did you mean `{}`? {}", spec.name, meaning(spec))),
        None if names.is_empty() => diagnostic.help(format!("`{type_name}` has no parameters")),
        None => diagnostic.help(format!("the parameters are {}", quoted(&names))),
    }
}

fn missing(params: &RawTable, spec: &ParamSpec, record: &ElementRecord, type_name: &str) -> Diagnostic {
    let span = if params.is_empty() { record.span.clone() } else { params.span.clone() };
    Diagnostic::error(
        codes::MISSING_ELEMENT_PARAMETER,
        format!("`{}` needs the parameter `{}`", record.name.value, spec.name),
    )
    .at(span, format!("`{type_name}` has no default for it"))
    .help(format!("params.{} = ...   # {}", spec.name, meaning(spec)))
}

/// The sentence about a parameter, with its unit: `Tension per elongation [N/m].`
fn meaning(spec: &ParamSpec) -> String {
    let doc = spec.doc.trim_end_matches('.');
    match (doc.is_empty(), spec.unit.is_empty()) {
        (true, true) => String::new(),
        (true, false) => format!("[{}]", spec.unit),
        (false, true) => format!("{doc}."),
        (false, false) => format!("{doc} [{}].", spec.unit),
    }
}

/// A raw value as the plugin receives it.
fn convert(scene: &Scene, raw: &RawValue, spec: &ParamSpec) -> Result<toml::Value, Box<Diagnostic>> {
    let wrong_kind = || {
        Diagnostic::error(codes::WRONG_TYPE, format!("`{}` must be a {}", spec.name, spec.kind.text()))
            .at(raw.span.clone(), format!("this is {}", raw.kind.describe()))
            .help_if(text_of(spec))
    };
    let number = |raw: &RawValue, dimension: Dimension| -> Result<toml::Value, Box<Diagnostic>> {
        // A unit that is not named is any: the gain of a controller, the limit of a signal.
        let value = if spec.unit.is_empty() { scene.any_quantity(raw)?.0 } else { scene.quantity(raw, dimension)? };
        if spec.contains(value) { Ok(toml::Value::Float(value)) } else { Err(out_of_range(raw, spec)) }
    };
    let list = |dimension: Dimension| -> Result<Vec<toml::Value>, Box<Diagnostic>> {
        let items = raw.as_array().ok_or_else(wrong_kind)?;
        items.iter().map(|item| number(item, dimension)).collect()
    };
    match spec.kind {
        ParamKind::Number => number(raw, dimension_of(&spec.unit)?),
        ParamKind::Integer => match raw.kind {
            RawKind::Integer(value) if spec.contains(value as f64) => Ok(toml::Value::Integer(value)),
            RawKind::Integer(_) => Err(Box::new(
                Diagnostic::error(codes::ELEMENT_PARAMETER_RANGE, format!("`{}` is out of range", spec.name))
                    .at(raw.span.clone(), format!("must be {}", spec.range_text())),
            )),
            _ => Err(Box::new(wrong_kind())),
        },
        ParamKind::Boolean => match raw.kind {
            RawKind::Bool(value) => Ok(toml::Value::Boolean(value)),
            _ => Err(Box::new(wrong_kind())),
        },
        ParamKind::Text => {
            let text = raw.as_text().ok_or_else(|| Box::new(wrong_kind()))?;
            check_choice(text, raw, spec)?;
            Ok(toml::Value::String(text.into()))
        }
        ParamKind::Vector => {
            let items = list(dimension_of(&spec.unit)?)?;
            if items.len() == 3 { Ok(toml::Value::Array(items)) } else { Err(Box::new(wrong_kind())) }
        }
        ParamKind::List => Ok(toml::Value::Array(list(dimension_of(&spec.unit)?)?)),
        ParamKind::Function => {
            let (argument, value) = spec.unit.split_once("->").unwrap_or(("1", spec.unit.as_str()));
            let (argument, value) = (dimension_of(argument.trim())?, dimension_of(value.trim())?);
            let function = scene.function(raw, variable(spec), argument, value)?;
            check_function_range(&function, raw, spec)?;
            Ok(function)
        }
        ParamKind::Surface => {
            let (arguments, value) = spec.unit.split_once("->").unwrap_or(("", spec.unit.as_str()));
            let (x, y) = arguments.split_once(',').unwrap_or((arguments, ""));
            // A unit that is not named is any, as for numbers.
            let of = |unit: &str| (!unit.trim().is_empty()).then(|| dimension_of(unit)).transpose();
            let surface = scene.surface(raw, &spec.name, [of(x)?, of(y)?, of(value)?])?;
            let all = surface.get("z").and_then(toml::Value::as_array).into_iter().flatten();
            let all = all.filter_map(toml::Value::as_array).flatten().filter_map(toml::Value::as_float);
            if !all.into_iter().all(|value| spec.contains(value)) { Err(out_of_range(raw, spec)) } else { Ok(surface) }
        }
        ParamKind::Curve => {
            let (argument, value) = spec.unit.split_once("->").unwrap_or(("1", spec.unit.as_str()));
            let (argument, value) = (dimension_of(argument.trim())?, dimension_of(value.trim())?);
            if let Some(curve) = scene.curve(raw, argument, value) {
                let curve = curve?;
                check_function_range(&curve, raw, spec)?;
                return Ok(curve);
            }
            // Pairs alone need not be those of a function: they may be the corners of an outline.
            let pairs = raw.as_array().ok_or_else(wrong_kind)?.iter().map(|pair| {
                let Some([x, y]) = pair.as_array() else {
                    return Err(Box::new(
                        Diagnostic::error(codes::WRONG_TYPE, format!("`{}` is a list of pairs", spec.name))
                            .at(pair.span.clone(), "expected [argument, value]"),
                    ));
                };
                Ok(toml::Value::Array(vec![number(x, argument)?, number(y, value)?]))
            });
            Ok(toml::Value::Array(pairs.collect::<Result<_, _>>()?))
        }
    }
}

/// A function given by points names its interpolation when it reaches the element: `spline` for joints, whose equations are
/// differentiated twice, `monotone` for others.
fn with_interpolation(value: toml::Value, spec: &ParamSpec, kind: Kind) -> toml::Value {
    let default = if kind == Kind::Joint { Interpolation::Spline } else { Interpolation::Monotone };
    let mut table = match value {
        toml::Value::Array(_) if spec.kind == ParamKind::Function => Table::from_iter([("points".to_owned(), value)]),
        toml::Value::Table(table) if table.contains_key("points") || spec.kind == ParamKind::Surface => table,
        other => return other,
    };
    table.entry("interpolation").or_insert_with(|| default.name().into());
    toml::Value::Table(table)
}

fn out_of_range(raw: &RawValue, spec: &ParamSpec) -> Box<Diagnostic> {
    let unit = if spec.unit.is_empty() { String::new() } else { format!(" (in {})", spec.unit) };
    Box::new(
        Diagnostic::error(codes::ELEMENT_PARAMETER_RANGE, format!("`{}` is out of range", spec.name))
            .at(raw.span.clone(), format!("must be {}{unit}", spec.range_text()))
            .help_if(text_of(spec)),
    )
}

/// The sentence about a parameter; libraries in C and files of elements may have none.
fn text_of(spec: &ParamSpec) -> Option<String> {
    (!spec.doc.is_empty()).then(|| spec.doc.clone())
}

fn check_choice(text: &str, raw: &RawValue, spec: &ParamSpec) -> Result<(), Box<Diagnostic>> {
    if spec.choices.is_empty() || spec.choices.iter().any(|choice| choice == text) {
        return Ok(());
    }
    let choices: Vec<&str> = spec.choices.iter().map(String::as_str).collect();
    Err(Box::new(
        Diagnostic::error(codes::UNKNOWN_WORD, format!("`{}` cannot be `{text}`", spec.name))
            .at(raw.span.clone(), "")
            .help_if(help_for(text, &choices, "words"))
            .help_if(text_of(spec)),
    ))
}

/// Constants and points must be in the range; what an expression gives is known to nobody before it is evaluated.
fn check_function_range(function: &toml::Value, raw: &RawValue, spec: &ParamSpec) -> Result<(), Box<Diagnostic>> {
    if let Some(value) = function.as_float() {
        return if spec.contains(value) { Ok(()) } else { Err(out_of_range(raw, spec)) };
    }
    let points = function.as_array().or_else(|| function.get("points").and_then(toml::Value::as_array));
    let written = raw.as_table().and_then(|table| table.get("points")).unwrap_or(raw).as_array();
    for (point, written) in points.into_iter().flatten().zip(written.into_iter().flatten()) {
        if point.get(1).and_then(toml::Value::as_float).is_some_and(|value| !spec.contains(value)) {
            return Err(out_of_range(written, spec));
        }
    }
    Ok(())
}

/// The dimension of a unit that a plugin declares.
pub(super) fn dimension_of(unit: &str) -> Result<Dimension, Box<Diagnostic>> {
    if unit.trim().is_empty() {
        return Ok(Dimension::DIMENSIONLESS);
    }
    parse_unit(unit).map(|(dimension, _)| dimension).map_err(|error| {
        Box::new(Diagnostic::error(
            codes::PLUGIN_MISBEHAVED,
            format!("a plugin declares the unit `{unit}`, which can't be read: {}", error.message),
        ))
    })
}
