//! The JSON schema of scene files: scenes that run are valid, and mistakes that a schema can see are not.

mod judge;

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use odyn::catalog::{Catalog, SearchPath};
use odyn::integrate::Methods;
use odyn::session::scene_schema;
use serde_json::{Value, json};

use crate::fixtures::build;
use crate::support::{kept, root};

/// The schema with the standard libraries, and a stranger's.
fn schema() -> &'static Value {
    static SCHEMA: OnceLock<Value> = OnceLock::new();
    SCHEMA.get_or_init(|| {
        let mut catalog = Catalog::new().with_copies_in(kept("library-copies"));
        let search = SearchPath::standard(&[build("good-plugin")], &[]);
        for library in ["joints", "forces", "controls", "compressor", "good-plugin"] {
            catalog.add(library, &search).unwrap_or_else(|error| panic!("{library}: {error}"));
        }
        scene_schema(&catalog, &Methods::default())
    })
}

/// What is wrong with a scene; nothing if it is valid.
fn faults(text: &str) -> Vec<String> {
    let scene: toml::Table = text.parse().unwrap();
    judge::faults(&serde_json::to_value(scene).unwrap(), schema(), schema(), "")
}

/// All files of scenes in a folder and below it.
fn scenes(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            scenes(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "toml") && !path.ends_with("suite.toml") {
            found.push(path);
        }
    }
}

#[test]
fn every_scene_is_valid() {
    let mut found = Vec::new();
    scenes(&root().join("scenes"), &mut found);
    assert!(found.len() > 90, "{} scenes", found.len());
    let judged = found.iter().flat_map(|path| {
        let faults = faults(&fs::read_to_string(path).unwrap()).into_iter();
        faults.map(|fault| format!("{}: {fault}", path.display()))
    });
    let faults: Vec<String> = judged.collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// A scene with one thing of every kind.
const SCENE: &str = r#"
[units]
length = "mm"
[plugins]
libraries = ["joints", { name = "good-plugin", version = "0.3" }]
[parameters]
rod.length = "25 cm"
[simulation]
t_end = 1
output_step = 0.1
method = "radau5"
[[body]]
name = "bob"
mass = 1
inertia = [1, 1, 1]
orientation = { axis = [0, 0, 1], angle = "30 deg" }
[[joint]]
name = "rod"
type = "good-plugin/rod"
bodies = ["ground", "bob"]
params.length = "rod.length"
[[control]]
name = "lag"
type = "transfer-function"
inputs.input = "x"
params = { numerator = [1], denominator = [1, 1] }
[[output]]
name = "x"
quantity = "position"
of = "bob"
component = "x"
[[check]]
name = "held"
kind = "position"
value = "x"
reference = { csv = "held.csv", column = "x" }
tolerance = 1e-9
"#;

#[test]
fn what_no_scene_can_have_is_not_valid() {
    assert_eq!(faults(SCENE), Vec::<String>::new());
    let mistakes = [
        ("[units]", "[unit]"),
        ("length = \"mm\"", "lenght = \"mm\""),
        ("length = \"mm\"", "length = 1"),
        ("version = \"0.3\"", "versions = \"0.3\""),
        ("version = \"0.3\"", "sha256 = \"0.3\""),
        ("t_end = 1", "t_stop = 1"),
        ("t_end = 1", ""),
        ("output_step = 0.1", "output_step = 0"),
        ("\"radau5\"", "\"radau6\""),
        ("mass = 1", "mas = 1"),
        ("mass = 1", "mass = true"),
        ("inertia = [1, 1, 1]", "inertia = [1, 1]"),
        ("axis = [0, 0, 1], angle", "axis = [0, 0, 1], angel"),
        ("axis = [0, 0, 1], angle", "x = [0, 0, 1], angle"),
        ("\"good-plugin/rod\"", "\"good-plugin/bar\""),
        ("bodies = [\"ground\", \"bob\"]", "bodies = [\"ground\"]"),
        ("params.length = \"rod.length\"", "params.lenght = \"rod.length\""),
        ("params.length = \"rod.length\"", "params.length = 0"),
        ("params.length = \"rod.length\"", ""),
        ("params.length = \"rod.length\"", "params.length = 1\ninputs.input = \"x\""),
        ("type = \"transfer-function\"", "type = \"rod\""),
        ("inputs.input", "inputs.imput"),
        ("quantity = \"position\"", "quantity = \"place\""),
        ("component = \"x\"", "component = \"w\""),
        ("kind = \"position\"", "kind = \"place\""),
        ("column = \"x\"", "columns = \"x\""),
        ("rod.length = \"25 cm\"", "rod.length = [25]"),
    ];
    for (right, wrong) in mistakes {
        assert!(SCENE.contains(right), "{right}");
        let scene = SCENE.replacen(right, wrong, 1);
        assert!(!faults(&scene).is_empty(), "`{wrong}` instead of `{right}` is taken for valid");
    }
}

#[test]
fn an_editor_learns_everything_about_a_strangers_element() {
    let items = &schema()["properties"]["joint"]["items"];
    let words = items["properties"]["type"]["enum"].as_array().unwrap();
    assert!(words.contains(&json!("rod")) && words.contains(&json!("good-plugin/rod")), "{words:?}");
    let place = words.iter().position(|word| word == "rod").unwrap();
    let doc = &items["properties"]["type"]["x-taplo"]["docs"]["enumValues"][place];
    assert_eq!(doc, "massless rod between two points (good-plugin 0.3.1)");
    let names = json!(["rod", "good-plugin/rod"]);
    let cases = items["allOf"].as_array().unwrap().iter();
    let mut cases = cases.filter(|case| case["if"]["properties"]["type"]["enum"] == names);
    let params = &cases.next().unwrap()["then"]["properties"]["params"];
    let expected = json!({
        "type": ["number", "string"],
        "description": "Distance of the two points. [m], > 0",
        "exclusiveMinimum": 0.0,
    });
    assert_eq!(params["properties"]["length"], expected);
    assert_eq!(params["required"], json!(["length"]));
    // Editors that do not look behind `if` offer the parameters of all types.
    assert!(items["properties"]["params"]["properties"]["length"]["description"].as_str().unwrap().contains("rod: "));
}
