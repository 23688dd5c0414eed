//! The schema has the keys of the reader, no fewer and no others, and expects the same quantities.

use serde_json::Value;

use super::super::schema::{self, DIMENSION, Key, ORDER};
use super::super::{KEYS, bodies, elements, inputs, outputs, page, release, settings, shapes, verification};
use super::reject;

#[track_caller]
fn same(schema: &[Key], reader: &[&str]) {
    let mut schema: Vec<&str> = schema.iter().map(|(key, ..)| *key).collect();
    let mut reader = reader.to_vec();
    schema.sort_unstable();
    reader.sort_unstable();
    assert_eq!(schema, reader);
}

#[test]
fn every_key_of_the_reader_is_in_the_schema() {
    same(&schema::root_keys(), KEYS);
    same(&schema::plugin_keys(), settings::PLUGIN_KEYS);
    same(&schema::library_keys(), settings::LIBRARY_KEYS);
    same(&schema::simulation_keys(), settings::SIMULATION_KEYS);
    same(&schema::body_keys(), bodies::KEYS);
    same(&schema::shape_keys(), shapes::KEYS);
    same(&schema::element_keys("joint"), &[elements::KEYS, &[release::RELEASE_KEY]].concat());
    same(&schema::release_keys(), release::KEYS);
    same(&schema::element_keys("control"), &[elements::KEYS, &[elements::JOINTS_KEY]].concat());
    same(&schema::element_keys("force"), &[elements::KEYS, &[elements::JOINTS_KEY, release::RELEASE_KEY]].concat());
    same(&schema::input_keys(), inputs::KEYS);
    same(&schema::output_keys(), outputs::OUTPUT_KEYS);
    same(&schema::figure_keys(), outputs::FIGURE_KEYS);
    same(&schema::check_keys(), verification::CHECK_KEYS);
    same(&schema::verification_keys(), verification::VERIFICATION_KEYS);
    same(&schema::number_keys(), verification::NUMBER_KEYS);
}

#[test]
fn every_key_has_a_sentence() {
    for (key, _, doc) in [
        schema::root_keys(),
        schema::simulation_keys(),
        schema::body_keys(),
        schema::shape_keys(),
        schema::output_keys(),
    ]
    .concat()
    {
        assert!(doc.ends_with('.'), "`{key}`: {doc}");
    }
}

/// A value as text, with the dimensions that a reader must say it expects instead of those written there.
type Strange = (String, Vec<String>);

/// The ways to write a value of this schema with quantities of a dimension that nothing has, each with the dimensions that a
/// reader must say it expects instead.
fn strange(value: &Value) -> Vec<Strange> {
    if let Some(choices) = value["anyOf"].as_array().or(value["oneOf"].as_array()) {
        return choices.iter().flat_map(strange).collect();
    }
    if let Some(order) = value[ORDER].as_array() {
        let keys: Vec<(&str, Vec<Strange>)> =
            order.iter().filter_map(Value::as_str).map(|key| (key, strange(&value["properties"][key]))).collect();
        let entries = keys.iter().filter_map(|(key, ways)| Some(format!("{key} = {}", ways.first()?.0)));
        let text = format!("{{ {} }}", entries.collect::<Vec<_>>().join(", "));
        let expected: Vec<String> =
            keys.iter().filter_map(|(_, ways)| Some(ways.first()?.1.clone())).flatten().collect();
        return if expected.is_empty() { Vec::new() } else { vec![(text, expected)] };
    }
    if value["type"] == "array" {
        let count = value["minItems"].as_u64().unwrap_or(1) as usize;
        let list = |(item, expected)| (format!("[{}]", vec![item; count].join(", ")), expected);
        return strange(&value["items"]).into_iter().map(list).collect();
    }
    match value[DIMENSION].as_str() {
        Some(dimension) if value["type"] != "string" => vec![("\"1 kg^5\"".into(), vec![dimension.into()])],
        _ => Vec::new(),
    }
}

#[test]
fn the_schema_tells_the_dimensions_that_the_reader_expects() {
    let tables = [
        ("[simulation]", schema::simulation_keys()),
        ("[[body]]\nname = \"b\"", schema::body_keys()),
        ("[[joint]]\nname = \"j\"\ntype = \"t\"", schema::element_keys("joint")),
        ("[[output]]\nname = \"o\"", schema::output_keys()),
        ("[[figure]]\nname = \"f\"", schema::figure_keys()),
        ("[[check]]\nname = \"c\"", schema::check_keys()),
    ];
    let mut seen = 0;
    for (header, keys) in tables {
        for (key, value, _) in keys {
            for (text, expected) in strange(&value) {
                let told = reject(&format!("{header}\n{key} = {text}\n")).rendered();
                for dimension in expected {
                    seen += 1;
                    assert!(told.contains(&format!("{dimension}, found a")), "`{key} = {text}`, {dimension}: {told}");
                }
            }
        }
    }
    assert!(seen > 40, "{seen} dimensions");
}

#[test]
fn the_page_has_every_key_and_every_sentence() {
    let page = page::page(&schema::schema());
    for (key, _, doc) in [
        schema::root_keys(),
        schema::simulation_keys(),
        schema::body_keys(),
        schema::shape_keys(),
        schema::element_keys("force"),
    ]
    .concat()
    {
        let named = [format!("| `{key}`"), format!("| `[{key}]`"), format!("| `[[{key}]]`")];
        assert!(named.iter().any(|name| page.contains(name)) && page.contains(doc), "`{key}`: {doc}");
    }
}
