//! The JSON schema of scene files, for editors: what each room knows of it, put together.

use serde_json::Value;

use super::options::{DEFAULT_METHOD, DEFAULT_TOLERANCE, ENGINES, FORMULATIONS, ISLANDS};
use crate::catalog::Catalog;
use crate::integrate::{Methods, Options};
use crate::model::schema::{self, replace};
use crate::plan::SAVINGS;
use crate::scene::page::page;
use crate::scene::schema::{one_of, schema as of_records};

/// The schema (JSON Schema, draft 2020-12) of scenes that use the elements of a catalog and these methods of integration.
///
/// It lists keys, kinds of values, words, and of each element type the parameters with description, unit, range and default.
/// It cannot tell what follows from the values: units of texts, names that refer to others, mobility. A scene that it accepts
/// may still be refused; one that it refuses has a mistake.
#[must_use]
pub fn scene_schema(catalog: &Catalog, methods: &Methods) -> Value {
    let mut schema = of_records();
    schema::add(&mut schema, catalog);
    let simulation = &mut schema["properties"]["simulation"]["properties"];
    replace(&mut simulation["method"], one_of(methods.list().iter().map(|method| (method.name, method.summary))));
    replace(&mut simulation["engine"], one_of(ENGINES.iter().copied()));
    replace(&mut simulation["formulation"], one_of(FORMULATIONS.iter().copied()));
    replace(&mut simulation["islands"], one_of(ISLANDS.iter().map(|(word, _)| (*word, ""))));
    replace(&mut simulation["without"]["items"], one_of(SAVINGS.iter().copied()));
    let defaults = [
        ("tolerance", DEFAULT_TOLERANCE.into()),
        ("method", DEFAULT_METHOD.into()),
        ("engine", ENGINES[0].0.into()),
        ("formulation", FORMULATIONS[0].0.into()),
        ("islands", ISLANDS[0].0.into()),
        ("max_steps", Options::default().max_steps.into()),
    ];
    for (key, default) in defaults {
        simulation[key]["default"] = default;
    }
    schema
}

/// The reference of the scene format, Markdown, with the elements of a catalog and these methods of integration: what
/// [`scene_schema`] has, for people.
#[must_use]
pub fn scene_page(catalog: &Catalog, methods: &Methods) -> String {
    page(&scene_schema(catalog, methods))
}
