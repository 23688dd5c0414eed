//! The schema has the keys of the reader, no fewer and no others.

use super::super::schema::{self, Key};
use super::super::{KEYS, bodies, elements, outputs, settings, verification};

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
    same(&schema::element_keys(false), elements::KEYS);
    same(&schema::element_keys(true), &[elements::KEYS, &elements::SIGNAL_KEYS].concat());
    same(&schema::output_keys(), outputs::OUTPUT_KEYS);
    same(&schema::figure_keys(), outputs::FIGURE_KEYS);
    same(&schema::check_keys(), verification::CHECK_KEYS);
    same(&schema::verification_keys(), verification::VERIFICATION_KEYS);
}

#[test]
fn every_key_has_a_sentence() {
    for (key, _, doc) in
        [schema::root_keys(), schema::simulation_keys(), schema::body_keys(), schema::output_keys()].concat()
    {
        assert!(doc.ends_with('.'), "`{key}`: {doc}");
    }
}
