//! What elements add to the JSON schema of scene files: the words for `type`, and parameters, signals and number of bodies
//! of each.

use std::collections::BTreeMap;

use element_api::params::{ParamKind, ParamSpec};
use element_api::{Descriptor, Interpolation, Kind};
use serde_json::{Map, Value, json};

use super::catalogue::{self, Catalogue};
use super::channels::QUANTITIES;
use super::fmus;
use super::parameters::{dimension_of, variable};
use crate::catalog::{Catalog, ElementHandle};
use crate::scene::Dimension;
use crate::scene::schema::{ORDER, one_of, quantity, signal, vector};

/// Adds the elements of a catalog, and the quantities of outputs.
pub fn add(schema: &mut Value, catalog: &Catalog) {
    for kind in [Kind::Joint, Kind::Force, Kind::Control] {
        let elements: Vec<ElementHandle> = catalog.elements().filter(|e| e.descriptor().kind == kind).collect();
        add_kind(&mut schema["properties"][kind.word()]["items"], &elements, catalog);
    }
    let quantities = one_of(QUANTITIES.iter().copied());
    replace(&mut schema["properties"]["output"]["items"]["properties"]["quantity"], quantities);
}

/// Another schema with the same description.
pub fn replace(place: &mut Value, mut schema: Value) {
    if let Some(description) = place.get("description") {
        schema["description"] = description.clone();
    }
    *place = schema;
}

/// Names that lead to an element: the full one, and the short one where that is unique.
fn names(element: &ElementHandle, catalog: &Catalog) -> Vec<String> {
    let short = &element.descriptor().name;
    let kind = element.descriptor().kind;
    let unique = catalog.find(short, Some(kind)).is_ok();
    unique.then(|| short.clone()).into_iter().chain([element.full_name()]).collect()
}

fn add_kind(items: &mut Value, elements: &[ElementHandle], catalog: &Catalog) {
    let mut words: Vec<(String, String)> = Vec::new();
    let mut cases: Vec<Value> = Vec::new();
    // Editors that do not follow `if` offer all of these.
    let mut parameters: BTreeMap<&str, Vec<String>> = BTreeMap::new();
    for element in elements {
        let descriptor = element.descriptor();
        let library = &element.library;
        let names = names(element, catalog);
        for name in &names {
            words.push((name.clone(), format!("{} ({} {})", descriptor.summary, library.package, library.version)));
        }
        for spec in &descriptor.params {
            parameters.entry(&spec.name).or_default().push(format!("{}: {}", names[0], sentence(spec)));
        }
        let is_type = json!({ "properties": { "type": { "enum": names } }, "required": ["type"] });
        cases.push(json!({ "if": is_type, "then": of_element(element) }));
    }
    words.sort();
    let words = one_of(words.iter().map(|(word, doc)| (word.as_str(), doc.as_str())));
    replace(&mut items["properties"]["type"], words);
    let offered = parameters.into_iter().map(|(name, docs)| (name.into(), json!({ "description": docs.join("\n\n") })));
    items["properties"]["params"]["properties"] = Value::Object(offered.collect());
    if !cases.is_empty() {
        items["allOf"] = cases.into();
    }
}

/// What holds for the record of an element of this type.
fn of_element(element: &ElementHandle) -> Value {
    let descriptor = element.descriptor();
    let mut properties = Map::new();
    let mut required: Vec<&str> = Vec::new();
    let row = rows_of(descriptor).map(|schema| (catalogue::USE.to_owned(), schema));
    let parameters = descriptor.params.iter().map(|spec| (spec.name.clone(), parameter(spec))).chain(row.clone());
    let needed: Vec<&str> =
        descriptor.params.iter().filter(|s| !s.optional && s.default.is_none()).map(|s| s.name.as_str()).collect();
    // A row may have any of them.
    let needed = if row.is_some() { Vec::new() } else { needed };
    if !needed.is_empty() {
        required.push("params");
    }
    let parameters = Value::Object(parameters.collect());
    let order: Vec<&str> = descriptor.params.iter().map(|spec| spec.name.as_str()).collect();
    let order: Vec<&str> = row.iter().map(|_| catalogue::USE).chain(order).collect();
    properties.insert("params".into(), closed(parameters, &order, &needed));
    if element.library.package == fmus::GENERAL {
        // What a file has is not known here.
        let about = "Values of the FMU's own parameters, by their names.";
        properties["params"]["properties"][fmus::PARAMETERS] = json!({ "type": "object", "description": about });
        if let Some(order) = properties["params"][ORDER].as_array_mut() {
            order.push(fmus::PARAMETERS.into());
        }
        return json!({ "properties": properties, "required": required });
    }
    let inputs = descriptor.inputs.iter().map(|input| {
        let mut schema = signal();
        let unit = if input.unit.is_empty() { String::new() } else { format!(" [{}]", input.unit) };
        schema["description"] = format!("{}{unit}", input.doc).into();
        (input.name.clone(), schema)
    });
    let inputs = Value::Object(inputs.collect());
    let order: Vec<&str> = descriptor.inputs.iter().map(|input| input.name.as_str()).collect();
    let needed: Vec<&str> = descriptor.inputs.iter().filter(|i| i.default.is_none()).map(|i| i.name.as_str()).collect();
    if !needed.is_empty() {
        required.push("inputs");
    }
    properties.insert("inputs".into(), closed(inputs, &order, &needed));
    let (least, most) = descriptor.frame_counts();
    let each = descriptor.frames.iter().map(|frame| format!("{}: {}", frame.name, frame.doc));
    let more = descriptor.more_frames.iter().map(|frame| format!("{} (any number): {}", frame.name, frame.doc));
    let each: Vec<String> = each.chain(more).collect();
    properties
        .insert("bodies".into(), json!({ "minItems": least, "maxItems": most, "description": each.join("\n\n") }));
    properties.insert("frames".into(), json!({ "minItems": least, "maxItems": most }));
    json!({ "properties": properties, "required": required })
}

/// The rows of a catalogue.
fn rows_of(descriptor: &Descriptor) -> Option<Value> {
    let offered = catalogue::is_offered(&descriptor.params, &descriptor.catalog);
    let rows = Catalogue::read(&descriptor.catalog).ok().flatten().filter(|_| offered)?.rows;
    let mut schema = one_of(rows.iter().map(|row| (row[0].as_str(), "")));
    schema["description"] = "Row of the catalogue with recommended parameters; what is given beside it wins.".into();
    Some(schema)
}

/// A table with these keys and no others.
fn closed(properties: Value, order: &[&str], required: &[&str]) -> Value {
    json!({ "properties": properties, "additionalProperties": false, "required": required, ORDER: order })
}

/// What a parameter means, with unit, range and default (SI), in a sentence.
fn sentence(spec: &ParamSpec) -> String {
    let mut text = spec.doc.clone();
    let range = spec.range_text();
    if !spec.unit.is_empty() {
        text.push_str(&format!(" [{}]", spec.unit));
    } else if !range.is_empty() || spec.default.is_some() {
        text.truncate(text.trim_end_matches('.').len());
    }
    if !range.is_empty() {
        text.push_str(&format!(", {range}"));
    }
    if spec.kind == ParamKind::Function {
        text.push_str(&format!(", function of `{}`", variable(spec)));
    }
    if let Some(default) = &spec.default {
        text.push_str(&format!(", default {default}"));
    }
    text
}

/// The schema of one parameter.
pub(super) fn parameter(spec: &ParamSpec) -> Value {
    let pairs = || {
        json!({ "type": "array", "items": {
        "type": "array", "items": quantity(), "minItems": 2, "maxItems": 2,
    } })
    };
    let interpolation = || {
        let mut words = one_of(Interpolation::ALL.map(|(word, _)| (word, "")));
        words["description"] =
            "What the curve is between its points; where nothing is written, spline for joints, monotone for others."
                .into();
        words
    };
    let mut schema = match spec.kind {
        ParamKind::Number => number(spec),
        ParamKind::Integer => bounded(json!({ "type": "integer" }), spec, |_| true),
        ParamKind::Boolean => json!({ "type": "boolean" }),
        ParamKind::Text if spec.choices.is_empty() => json!({ "type": "string" }),
        ParamKind::Text => one_of(spec.choices.iter().map(|choice| (choice.as_str(), ""))),
        ParamKind::Vector => vector(),
        ParamKind::List => {
            let list = json!({ "type": "array", "items": number(spec) });
            json!({ "anyOf": [list, from_file(json!({}))] })
        }
        ParamKind::Curve => {
            let table = closed(
                json!({ "points": pairs(), "interpolation": interpolation() }),
                &["points", "interpolation"],
                &["points"],
            );
            json!({ "anyOf": [pairs(), table, from_file(json!({ "interpolation": interpolation() }))] })
        }
        ParamKind::Function => {
            let flag = || json!({ "type": "boolean", "default": false });
            let entries = json!({ "points": pairs(), "interpolation": interpolation(), "periodic": flag() });
            let table = closed(entries, &["points", "interpolation", "periodic"], &["points"]);
            json!({ "anyOf": [quantity(), pairs(), table, from_file(json!({ "interpolation": interpolation(), "periodic": flag() }))] })
        }
        ParamKind::Surface => {
            let list = || json!({ "type": "array", "items": quantity(), "minItems": 2 });
            let rows = json!({ "type": "array", "items": list(), "description": "Values, one list per value of x." });
            let entries = json!({ "x": list(), "y": list(), "z": rows, "interpolation": interpolation() });
            let table = closed(entries, &["x", "y", "z", "interpolation"], &["x", "y", "z"]);
            json!({ "anyOf": [table, from_file(json!({ "interpolation": interpolation() }))] })
        }
    };
    schema["description"] = sentence(spec).into();
    // Defaults are in SI, and plain numbers of a scene may not be; an editor would write the default as it stands.
    let same = matches!(spec.kind, ParamKind::Integer | ParamKind::Boolean | ParamKind::Text) || scale_free(spec);
    if let Some(default) = spec.default.as_ref().filter(|_| same)
        && let Ok(default) = serde_json::to_value(default)
    {
        schema["default"] = default;
    }
    schema
}

/// A table whose points are in a file.
fn from_file(mut entries: Value) -> Value {
    let texts = |what: &str| json!({ "type": "array", "items": { "type": "string" }, "description": what });
    entries["file"] = json!({ "type": "string", "description": "CSV file, relative to the folder of the scene." });
    entries["columns"] = texts("Names of its columns: arguments, then the value. Left out: the first two, or a grid.");
    entries["units"] = texts("Units of arguments and value, where the first line of the file does not name them.");
    closed(entries, &["file", "columns", "units", "interpolation", "periodic"], &["file"])
}

fn number(spec: &ParamSpec) -> Value {
    bounded(quantity(), spec, |bound| bound == 0.0 || scale_free(spec))
}

/// Whether plain numbers mean the same in every system of units.
fn scale_free(spec: &ParamSpec) -> bool {
    dimension_of(&spec.unit).is_ok_and(|dimension| dimension == Dimension::DIMENSIONLESS)
}

/// With those bounds of the range that hold for plain numbers in any units; texts are not looked at.
fn bounded(mut schema: Value, spec: &ParamSpec, holds: impl Fn(f64) -> bool) -> Value {
    let bounds = [
        ("minimum", spec.min),
        ("maximum", spec.max),
        ("exclusiveMinimum", spec.above),
        ("exclusiveMaximum", spec.below),
    ];
    for (word, bound) in bounds {
        if let Some(bound) = bound.filter(|bound| holds(*bound)) {
            schema[word] = bound.into();
        }
    }
    schema
}
