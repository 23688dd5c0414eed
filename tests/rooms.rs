//! The edges between the rooms of the host, and what the host must not know. The map is in the documentation of
//! `host/src/lib.rs`. Crates can use only what their manifests name, so the manifests are held to what they may name; rooms
//! that share a crate are held to each other.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use crate::support::root;

/// The crates of the host with the crates of this repository that each may use. A new edge is a decision about the architecture,
/// not a repair of this test.
const CRATES: &[(&str, &[&str])] = &[
    // Methods for element states along prescribed motions.
    ("host/analyses", &["odyn-catalog", "odyn-diagnostics", "odyn-motion", "odyn-numerics", "odyn-run", "odyn-scene"]),
    // FMUs are libraries with one class.
    ("host/catalog", &["odyn-diagnostics", "odyn-fmu", "element-api"]),
    ("host/desk", &["odyn-diagnostics", "odyn-run"]),
    ("host/diagnostics", &[]),
    // Sessions for their programs, the graph for the values that these are made of, no solvers.
    ("host/export", &["odyn-diagnostics", "odyn-graph", "odyn-motion", "odyn-run", "odyn-scene", "element-api"]),
    // Units of FMUs are read as scenes read theirs.
    ("host/fmu", &["odyn-scene", "element-api"]),
    ("host/graph", &["odyn-numerics", "element-api"]),
    // Meshes are read as results read them.
    ("host/import", &["odyn-diagnostics", "odyn-run"]),
    ("host/motion", &["odyn-catalog", "odyn-diagnostics", "odyn-graph", "odyn-numerics", "odyn-scene", "element-api"]),
    ("host/numerics", &[]),
    (
        "host/run",
        &[
            "odyn-catalog",
            "odyn-diagnostics",
            "odyn-graph",
            "odyn-motion",
            "odyn-numerics",
            "odyn-scene",
            "element-api",
        ],
    ),
    ("host/scene", &["odyn-diagnostics", "element-api"]),
    ("host/studio", &["odyn-catalog", "odyn-desk", "odyn-diagnostics", "odyn-run", "element-api"]),
    (
        "host/trials",
        &[
            "odyn-analyses",
            "odyn-catalog",
            "odyn-desk",
            "odyn-diagnostics",
            "odyn-motion",
            "odyn-numerics",
            "odyn-run",
            "odyn-scene",
            "element-api",
        ],
    ),
];

/// The rooms that share a crate, with those of the same crate that each may use.
const ROOMS: &[(&str, &[&str])] = &[
    ("motion/src/model", &[]),
    ("motion/src/plan", &["model"]),
    ("motion/src/program", &["model", "plan"]),
    ("motion/src/analysis", &["model", "plan", "program"]),
    ("run/src/results", &[]),
    ("run/src/session", &["pool", "results"]),
    ("trials/src/verification", &[]),
    ("trials/src/bench", &[]),
    ("trials/src/study", &[]),
    ("trials/src/stress", &[]),
    ("trials/src/manual", &["stress", "verification"]),
    ("trials/src/workshop", &[]),
];

/// The files of a folder and those below it.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(files(&path));
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
    found.sort();
    found
}

fn is_test(path: &Path) -> bool {
    path.components().any(|part| matches!(part.as_os_str().to_str(), Some("tests" | "tests.rs" | "testing")))
}

/// A file without its comments and documentation.
fn code(path: &Path) -> String {
    let text = fs::read_to_string(path).unwrap();
    let line = |line: &str| line.split("//").next().unwrap_or_default().to_string() + "\n";
    text.lines().map(line).collect()
}

/// The rooms that a text names as `crate::room`, also in lists `use crate::{room, ...}`, and, seen from the module of the
/// command line, as `odyn::room`.
fn rooms_in(text: &str) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    for root in ["crate::", "odyn::"] {
        for (at, _) in text.match_indices(root) {
            let rest = &text[at + root.len()..];
            let word = |text: &str| text.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect::<String>();
            match rest.strip_prefix('{') {
                None => {
                    found.insert(word(rest));
                }
                Some(list) => {
                    // Names at the first level of the list.
                    let mut depth = 0;
                    let mut begins = true;
                    for (k, c) in list.char_indices() {
                        match c {
                            '{' => depth += 1,
                            '}' if depth == 0 => break,
                            '}' => depth -= 1,
                            ',' => begins = depth == 0,
                            c if begins && depth == 0 && c.is_alphabetic() => {
                                found.insert(word(&list[k..]));
                                begins = false;
                            }
                            _ => {}
                        }
                    }
                }
            }
        }
    }
    found
}

#[test]
fn lists_of_rooms_are_read() {
    let found = rooms_in("use crate::{scene::{self, read}, model}; let x = crate::plan::Plan::new(); odyn::linalg::f");
    assert_eq!(found.into_iter().collect::<Vec<_>>(), ["linalg", "model", "plan", "scene"]);
}

/// The folders of rooms below `host`.
fn room_folders() -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    for krate in ["motion", "run", "trials"] {
        for entry in fs::read_dir(root().join("host").join(krate).join("src")).unwrap() {
            let entry = entry.unwrap();
            if entry.path().is_dir() && !is_test(&entry.path()) {
                found.insert(format!("{krate}/src/{}", entry.file_name().into_string().unwrap()));
            }
        }
    }
    found
}

#[test]
fn rooms_use_only_the_rooms_they_may() {
    let name = |folder: &str| folder.rsplit('/').next().unwrap().to_string();
    let mut edges = 0;
    for (room, allowed) in ROOMS {
        let krate = room.split('/').next().unwrap();
        let siblings: BTreeSet<String> =
            room_folders().iter().filter(|other| other.starts_with(krate)).map(|other| name(other)).collect();
        for file in files(&root().join("host").join(room)).iter().filter(|file| !is_test(file)) {
            for used in rooms_in(&code(file)) {
                if used == name(room) || !siblings.contains(&used) {
                    continue;
                }
                edges += 1;
                assert!(allowed.contains(&used.as_str()), "{} uses `{used}`, `{room}` may not", file.display());
            }
        }
    }
    assert!(edges > 20, "{edges} edges were seen: is this test still reading the right files?");
}

#[test]
fn every_room_is_in_the_table() {
    assert_eq!(room_folders(), ROOMS.iter().map(|(room, _)| room.to_string()).collect());
}

#[test]
fn every_room_says_what_it_is() {
    let inside = ROOMS.iter().map(|(room, _)| format!("host/{room}/mod.rs")).chain(["host/src/cli/mod.rs".to_string()]);
    let several = ["host/motion", "host/run", "host/trials"];
    let crates = CRATES.iter().map(|(folder, _)| *folder).filter(|folder| !several.contains(folder));
    for file in inside.chain(crates.map(|folder| format!("{folder}/src/lib.rs"))) {
        let text = fs::read_to_string(root().join(&file)).unwrap();
        assert!(text.starts_with("//!"), "{file} opens with its documentation");
        let mut at = 0;
        for part in ["**Takes**", "**Gives**", "**May touch**", "**Must not know**"] {
            let found = text[at..].find(part);
            at += found.unwrap_or_else(|| panic!("{file} does not say what it {part}, in this order"));
        }
    }
}

/// Names of the elements in the libraries of this repository, read from their sources.
fn element_names() -> Vec<String> {
    let mut names = Vec::new();
    for library in ["joints", "forces", "controls", "compressor"] {
        for file in files(&root().join("plugins").join(library).join("src")) {
            let text = code(&file);
            let parts = text.split("const NAME: &'static str = \"").skip(1);
            names.extend(parts.filter_map(|part| part.split('"').next()).map(str::to_string));
        }
    }
    names
}

#[test]
fn the_host_knows_no_element() {
    let names = element_names();
    assert!(names.len() >= 10 && names.iter().any(|name| name == "revolute"), "{names:?}");
    // Explanations and help may use elements as examples.
    let examples = ["diagnostics/src/codes.rs", "cli/args.rs"];
    // What is imported is written as a scene, in the words of the standard elements.
    let writes_scenes = root().join("host/import");
    for file in files(&root().join("host")) {
        if file.starts_with(&writes_scenes) || is_test(&file) || examples.iter().any(|example| file.ends_with(example))
        {
            continue;
        }
        let text = code(&file);
        let words: BTreeSet<&str> = text.split(|c: char| !(c.is_alphanumeric() || c == '-')).collect();
        // Words of scenes for places, curves and what signals are multiplied by, and of geometry for motions, too.
        let words_of_scenes = ["gain", "ground", "map", "planar", "point", "position"];
        // Words for how joints are drawn, by the motions that they leave.
        let words_of_pictures: &[&str] =
            if file.ends_with("plan/glyph.rs") { &["gear", "screw", "universal"] } else { &[] };
        let may_be_known = |name: &&String| ![&words_of_scenes, words_of_pictures].concat().contains(&name.as_str());
        for name in names.iter().filter(may_be_known) {
            let as_type: String = name.split('-').map(|w| w[..1].to_uppercase() + &w[1..]).collect();
            let known = text.contains(&format!("\"{name}\"")) || words.contains(as_type.as_str());
            assert!(!known, "{} knows the element `{name}`", file.display());
        }
        for crate_name in ["odyn_joints", "odyn_forces", "odyn_controls", "odyn_compressor"] {
            assert!(!text.contains(crate_name), "{} knows the library `{crate_name}`", file.display());
        }
    }
}

/// The names in all sections of dependencies of a manifest, those for some targets only, too.
fn dependencies(folder: &str) -> BTreeSet<String> {
    let text = fs::read_to_string(root().join(folder).join("Cargo.toml")).unwrap();
    let manifest: toml::Table = text.parse().unwrap();
    let targets = manifest.get("target").and_then(|targets| targets.as_table());
    let tables = targets.into_iter().flat_map(|targets| targets.values()).filter_map(|target| target.as_table());
    let sections = ["dependencies", "dev-dependencies", "build-dependencies"];
    let names = |table: &toml::Table| {
        let found = sections.iter().filter_map(|section| table.get(*section)?.as_table());
        found.flat_map(|section| section.keys().cloned()).collect::<Vec<_>>()
    };
    tables.chain([&manifest]).flat_map(names).collect()
}

#[test]
fn crates_depend_on_what_they_may() {
    for folder in ["plugins/joints", "plugins/forces", "plugins/controls", "plugins/compressor"] {
        for name in dependencies(folder) {
            // Bounds of profiles are numbers of a kind of their own, which take `Zero` and `One`.
            let of_bounds = (folder, name.as_str()) == ("plugins/joints", "num-traits");
            assert!(name == "element-api" || of_bounds, "{folder} may not depend on {name}");
        }
    }
    let ours = |name: &String| name.starts_with("odyn") || name.starts_with("element-api");
    for (folder, allowed) in CRATES {
        for name in dependencies(folder).into_iter().filter(ours) {
            assert!(allowed.contains(&name.as_str()), "{folder} may not depend on {name}");
        }
    }
    let rooms = CRATES.iter().map(|(folder, _)| folder.replace("host/", "odyn-"));
    let known: BTreeSet<String> = rooms.chain(["element-api".to_string()]).collect();
    let host: BTreeSet<String> = dependencies("host").into_iter().filter(ours).collect();
    assert_eq!(host, known, "the host links its rooms, and no library of elements");
}
