//! [`elements`]: what can be inserted into a scene, with the text to insert and the manual page of each.

use element_api::descriptor::{Descriptor, Kind};
use element_api::documentation::{manual_page, scenes_of};
use element_api::params::{ParamKind, ParamSpec};
use odyn_catalog::{Catalog, ElementHandle, SearchPath};
use odyn_desk::page::html::markdown;
use odyn_diagnostics::shown;
use odyn_run::session::{RunOptions, scene_schema};
use serde_json::{Value, json};

/// All elements of all libraries that are found, and the schema of scenes that use them.
pub(crate) fn elements(search: &SearchPath, options: &RunOptions) -> Value {
    let (catalog, left_out) = Catalog::everything(search);
    let mut all: Vec<ElementHandle> = catalog.elements().collect();
    all.sort_by(|a, b| {
        (a.descriptor().kind.word(), &a.descriptor().name).cmp(&(b.descriptor().kind.word(), &b.descriptor().name))
    });
    let one = |element: &ElementHandle| {
        let descriptor = element.descriptor();
        json!({
            "name": descriptor.name,
            "library": element.library.package,
            "kind": descriptor.kind.word(),
            "summary": shown(&descriptor.summary),
            "frames": descriptor.frames.len(),
            "page": markdown(&manual_page(&descriptor.doc), 2),
            "text": text(descriptor),
        })
    };
    json!({
        "elements": all.iter().map(one).collect::<Vec<_>>(),
        "left_out": left_out.iter().map(ToString::to_string).collect::<Vec<_>>(),
        "schema": scene_schema(&catalog, &options.methods),
    })
}

/// What a scene says to have such an element: the part of the example on its manual page, else what its descriptor asks for.
fn text(descriptor: &Descriptor) -> String {
    let scenes = scenes_of(&manual_page(&descriptor.doc));
    scenes.iter().find_map(|scene| part(scene, descriptor)).unwrap_or_else(|| asked_for(descriptor))
}

/// The table of a scene that is an element of this type.
fn part(scene: &str, descriptor: &Descriptor) -> Option<String> {
    let header = format!("[[{}]]", descriptor.kind.word());
    let of_type = |line: &&str| {
        let value = line.strip_prefix("type").map(str::trim_start).and_then(|rest| rest.strip_prefix('='));
        let name = value.map(|value| value.trim().split('"').nth(1).unwrap_or_default());
        name.is_some_and(|name| name.rsplit('/').next() == Some(&descriptor.name))
    };
    let tables =
        scene.split("\n[").map(|table| if table.starts_with('[') { format!("[{table}") } else { table.to_owned() });
    let own =
        tables.filter(|table| table.starts_with(&header)).find(|table| table.lines().any(|line| of_type(&line)))?;
    Some(own.trim_end().to_owned() + "\n")
}

fn asked_for(descriptor: &Descriptor) -> String {
    let kind = descriptor.kind.word();
    let name = descriptor.name.replace('-', "_");
    let mut text = format!("[[{kind}]]\nname = \"{name}_1\"\ntype = \"{}\"\n", descriptor.name);
    let frames = descriptor.frames.len() + usize::from(descriptor.more_frames.is_some());
    if frames > 0 {
        let bodies: Vec<String> =
            (0..frames).map(|k| if k == 0 { "\"ground\"".into() } else { format!("\"body_{k}\"") }).collect();
        text.push_str(&format!("bodies = [{}]\npoint = [0, 0, 0]\n", bodies.join(", ")));
        if descriptor.kind == Kind::Joint {
            text.push_str("axis = [0, 0, 1]\n");
        }
    }
    if !descriptor.joints.is_empty() {
        let joints: Vec<String> = descriptor.joints.iter().map(|joint| format!("\"{}\"", joint.name)).collect();
        text.push_str(&format!("joints = [{}]\n", joints.join(", ")));
    }
    for input in descriptor.inputs.iter().filter(|input| input.default.is_none()) {
        text.push_str(&format!("inputs.{} = 0\n", input.name));
    }
    for param in descriptor.params.iter().filter(|param| param.default.is_none() && !param.optional) {
        let unit = if param.unit.is_empty() { String::new() } else { format!(" [{}]", param.unit) };
        text.push_str(&format!("params.{} = {} # {}{unit}\n", param.name, value(param), param.doc));
    }
    text
}

/// A value that such a parameter may have.
fn value(param: &ParamSpec) -> String {
    let number = match (param.above, param.min, param.max, param.below) {
        (Some(low), ..) => low + 1.0,
        (_, Some(low), ..) => low.max(1.0),
        (_, _, Some(high), _) => high.min(1.0),
        (.., Some(high)) => high - 1.0,
        _ => 1.0,
    };
    match param.kind {
        ParamKind::Number | ParamKind::Integer => number.to_string(),
        ParamKind::Boolean => "true".into(),
        ParamKind::Text => format!("\"{}\"", param.choices.first().map_or("", String::as_str)),
        ParamKind::Vector => "[0, 0, 1]".into(),
        ParamKind::List => format!("[{number}]"),
        ParamKind::Curve => "[[0, 0], [1, 1]]".into(),
        ParamKind::Surface => format!("{{ x = [0, 1], y = [0, 1], z = [[{number}, {number}], [{number}, {number}]] }}"),
        ParamKind::Function => format!("\"{}\"", if param.variable.is_empty() { "x" } else { &param.variable }),
    }
}
