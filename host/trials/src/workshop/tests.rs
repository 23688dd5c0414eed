//! Crates that are made, and those that are not. That they build and run is shown in `tests/workshop.rs`.

use std::fs;
use std::path::{Path, PathBuf};

use element_api::manifest::INTERFACE;

use super::create::{Contract, NewPlugin, create};
use super::names;
use super::{Template, WorkshopError};

/// A folder of its own, removed at the end.
struct Scratch(PathBuf);

impl Scratch {
    fn new(test: &str) -> Self {
        let path = std::env::temp_dir().join(format!("odyn-workshop-{}-{test}", std::process::id()));
        let _ = fs::remove_dir_all(&path);
        fs::create_dir_all(&path).unwrap();
        Self(path.canonicalize().unwrap())
    }

    /// A folder that looks like the contract's.
    fn contract(&self) -> PathBuf {
        let folder = self.0.join("odyn/element-api");
        fs::create_dir_all(&folder).unwrap();
        fs::write(folder.join("Cargo.toml"), "[package]\nname = \"element-api\"\n").unwrap();
        folder
    }

    fn names(&self) -> Vec<String> {
        let mut names: Vec<String> =
            fs::read_dir(&self.0).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn version() -> Contract {
    Contract::Version("1.0".into())
}

#[test]
fn every_template_is_filled() {
    let scratch = Scratch::new("filled");
    for template in Template::ALL {
        let folder = scratch.0.join(format!("acme-{}", template.word()));
        let made = create(&NewPlugin { folder: folder.clone(), template, contract: version() }).unwrap();
        assert!(made.files.len() >= 6, "{:?}", made.files);
        for (file, lines) in &made.files {
            let text = fs::read_to_string(folder.join(file)).unwrap();
            // `${{ ... }}` is what the runner of the CI file replaces, `{{"name", ...` a list in C.
            let word = |at: usize| text[at + 2..].starts_with(|c: char| c.is_alphabetic());
            let open = text.match_indices("{{").find(|(at, _)| word(*at) && !text[..*at].ends_with('$'));
            assert!(open.is_none(), "{} of {template:?}: {text}", file.display());
            assert_eq!(text.lines().count(), *lines);
            assert!(text.ends_with('\n') && text.lines().all(|line| line.len() <= 130), "{}", file.display());
        }
        assert_eq!(Template::of_word(template.word()), Some(template));
        if template == Template::C {
            continue;
        }
        let manifest: toml::Table = fs::read_to_string(folder.join("Cargo.toml")).unwrap().parse().unwrap();
        assert_eq!(manifest["dependencies"]["element-api"]["version"].as_str(), Some("1.0"));
        assert!(manifest.contains_key("workspace"));
    }
}

#[test]
fn the_contract_is_named_as_seen_from_the_crate() {
    let scratch = Scratch::new("seen");
    let contract = scratch.contract();
    fs::write(scratch.0.join("odyn/Cargo.lock"), "version = 4\n").unwrap();
    fs::create_dir(scratch.0.join("mine")).unwrap();
    let folder = scratch.0.join("mine/rod");
    create(&NewPlugin { folder: folder.clone(), template: Template::Joint, contract: Contract::Folder(contract) })
        .unwrap();
    let manifest = fs::read_to_string(folder.join("Cargo.toml")).unwrap();
    assert!(manifest.contains("element-api = { path = \"../../odyn/element-api\" }"), "{manifest}");
    assert_eq!(fs::read_to_string(folder.join("Cargo.lock")).unwrap(), "version = 4\n");
}

#[test]
fn the_contract_is_found_in_the_sources_around_the_program() {
    let scratch = Scratch::new("found");
    let contract = scratch.contract();
    let program = scratch.0.join("odyn/target/release/odyn");
    assert_eq!(Contract::found_from(&[program]), Contract::Folder(contract));
    assert_eq!(Contract::found_from(&[PathBuf::from("/nowhere/odyn")]), Contract::Version(INTERFACE.into()));
}

#[test]
fn a_folder_and_a_version_are_told_apart() {
    assert_eq!(Contract::of_text("1.2"), Contract::Version("1.2".into()));
    assert_eq!(Contract::of_text("^1"), Contract::Version("^1".into()));
    assert_eq!(Contract::of_text("../element-api"), Contract::Folder("../element-api".into()));
}

#[test]
fn what_is_not_the_contract_is_refused_and_nothing_is_left() {
    let scratch = Scratch::new("refused");
    let nothing = NewPlugin {
        folder: scratch.0.join("rod"),
        template: Template::Joint,
        contract: Contract::Folder(scratch.0.join("absent")),
    };
    let error = create(&nothing).unwrap_err();
    assert!(matches!(error, WorkshopError::NoContract { .. }), "{error}");
    let below_nothing = NewPlugin { folder: scratch.0.join("absent/rod"), contract: version(), ..nothing.clone() };
    assert!(matches!(create(&below_nothing).unwrap_err(), WorkshopError::Write { .. }));
    assert_eq!(scratch.names(), Vec::<String>::new());

    let there = NewPlugin { contract: version(), ..nothing };
    create(&there).unwrap();
    let before = fs::read(there.folder.join("src/lib.rs")).unwrap();
    let error = create(&NewPlugin { template: Template::Force, ..there.clone() }).unwrap_err();
    assert!(error.to_string().ends_with("exists already") && error.help()[0].contains("another name"), "{error}");
    assert_eq!(fs::read(there.folder.join("src/lib.rs")).unwrap(), before);
    assert_eq!(scratch.names(), ["rod"]);
}

#[test]
fn names_are_those_of_crates_and_elements() {
    for name in ["rod", "acme-wobble", "geneva_2", "a"] {
        assert!(names::check(name).is_ok(), "{name}");
    }
    for (name, instead) in [
        ("Wobble Plate", Some("wobble-plate")),
        ("2nd", Some("nd")),
        ("loop", Some("loop-element")),
        ("proc_macro", Some("proc_macro-element")),
        ("rod-", Some("rod")),
        ("", None),
        ("..", None),
        ("é", None),
    ] {
        match names::check(name) {
            Err(WorkshopError::Name { instead: found, .. }) => assert_eq!(found.as_deref(), instead, "{name}"),
            other => panic!("{name}: {other:?}"),
        }
    }
    assert_eq!(names::type_name("acme-wobble_2"), "AcmeWobble2");
    assert_eq!(names::type_name("frame"), "FrameElement");
    assert_eq!((names::crate_name("a-b"), names::element_name("a_b")), ("a_b".into(), "a-b".into()));
}

#[test]
fn names_that_are_taken_are_told() {
    let scratch = Scratch::new("taken");
    let made =
        create(&NewPlugin { folder: scratch.0.join("rod"), template: Template::Joint, contract: version() }).unwrap();
    let text = "ODYN-MANIFEST 1\nabi=1\nconventions=1\ninterface=1.0.0\npackage=bars\nversion=1.0.0\nabout=x\n\
                entry=e\nprofile=release\nelement=joint rod\nend\n";
    let bars = element_api::manifest::Manifest::parse(text.as_bytes()).unwrap().remove(0);
    let told = made.collisions(&[(Path::new("libbars.so").into(), bars)]);
    assert_eq!(told, ["`bars` has a `rod`, too; scenes that name both libraries write `rod/rod`"]);
}
