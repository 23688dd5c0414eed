//! What `odyn plugin new` makes builds, passes its tests and runs; what is wrong with the elements of a library is said in words
//! that their author understands.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use element_api::Element;
use odyn::catalog::{Catalog, SearchPath};
use odyn::session::Session;
use odyn::workshop::{self, Contract, Exemption, Given, NewPlugin, Outcome, Template, Verdict};

use crate::fixtures::build;
use crate::support::{kept, options, root};

/// Makes a crate and leaves files that are as before untouched, so that cargo builds only what is new.
fn make(template: Template) -> PathBuf {
    let name = format!("made-{}", template.word());
    let (fresh, folder) = (kept("strangers/fresh").join(&name), kept("strangers/made").join(&name));
    let _ = fs::remove_dir_all(&fresh);
    let contract = Contract::Folder(root().join("element-api"));
    let made = workshop::create(&NewPlugin { folder: fresh.clone(), template, contract }).unwrap();
    assert_eq!(made.elements.len(), if template == Template::Library { 3 } else { 1 });
    for (file, _) in &made.files {
        let (from, to) = (fresh.join(file), folder.join(file));
        fs::create_dir_all(to.parent().unwrap()).unwrap();
        let text = fs::read_to_string(from).unwrap();
        if fs::read_to_string(&to).ok().as_deref() != Some(&text) {
            fs::write(to, text).unwrap();
        }
    }
    if template != Template::C {
        fs::copy(fresh.join("Cargo.lock"), folder.join("Cargo.lock")).expect("the versions of the sources come along");
    }
    folder
}

/// Runs a command of cargo as the author of a crate does, in a build folder that is kept.
fn cargo(command: &str, folder: &Path) -> PathBuf {
    let target = kept("strangers-target");
    let (profile, flags): (_, &[&str]) =
        if cfg!(debug_assertions) { ("debug", &[]) } else { ("release", &["--release"]) };
    let mut cargo = Command::new(env!("CARGO"));
    cargo.args([command, "--offline", "--quiet"]).args(flags).current_dir(folder).env("CARGO_TARGET_DIR", &target);
    let output = cargo.output().expect("cargo can be run");
    let text = String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "cargo {command} in {}:\n{text}", folder.display());
    assert!(!text.contains("warning:"), "cargo {command} in {}:\n{text}", folder.display());
    target.join(profile)
}

/// Builds a crate in C, where there is a compiler for it.
fn made_by_make(folder: &Path) -> Option<PathBuf> {
    let output = Command::new("make").current_dir(folder).output();
    let output = match output {
        Err(_) if std::env::var_os("ODYN_SKIP_C").is_some() => return None,
        output => output.expect("`make` can be run; set ODYN_SKIP_C=1 to leave out the tests that need a C compiler"),
    };
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && !text.contains("warning:"), "{text}");
    Some(folder.to_path_buf())
}

#[test]
fn a_new_crate_passes_its_tests_and_its_scene_holds() {
    for template in Template::ALL {
        let folder = make(template);
        let libraries = if template == Template::C {
            let Some(libraries) = made_by_make(&folder) else { continue };
            libraries
        } else {
            cargo("test", &folder);
            cargo("build", &folder)
        };
        let session = Session::open(&folder.join("scene.toml"), &options(&[], &[libraries]));
        let session = session.unwrap_or_else(|error| panic!("{template:?}: {error}"));
        assert!(session.warnings.iter().all(|warning| !warning.is_error()), "{:?}", session.warnings);
        let report = session.run(None, Box::new(|_| ()), &Default::default()).unwrap();
        assert!(!report.summary.checks.is_empty());
        assert_eq!(report.exit_code(), 0, "{template:?}: {:?}", report.summary.checks);
    }
}

/// A joint and a control in the crate of a force: listed, tested, loaded beside it.
#[test]
fn an_element_is_added_to_a_crate() {
    let (fresh, folder) = (kept("strangers/fresh").join("grown"), kept("strangers/made").join("grown"));
    let _ = fs::remove_dir_all(&fresh);
    let contract = Contract::Folder(root().join("element-api"));
    workshop::create(&NewPlugin { folder: fresh.clone(), template: Template::Force, contract }).unwrap();
    let mut files = vec!["Cargo.toml".into(), "Cargo.lock".into(), "src/tests.rs".into()];
    for (name, template) in [("wobble-rod", Template::Joint), ("slow", Template::Control)] {
        files.extend(workshop::add(name, template, &fresh).unwrap().files.into_iter().map(|(file, _)| file));
        let again = workshop::add(name, template, &fresh).unwrap_err();
        assert!(again.to_string().contains("exists already"), "{again}");
    }
    let refused = workshop::add("another", Template::Library, &fresh).unwrap_err();
    assert!(refused.to_string().contains("only a joint, a force or a control"), "{refused}");
    let nowhere = workshop::add("another", Template::Joint, &fresh.join("src")).unwrap_err();
    assert!(nowhere.to_string().contains("its Cargo.toml"), "{nowhere}");
    for file in files {
        let (from, to): (PathBuf, PathBuf) = (fresh.join(&file), folder.join(&file));
        fs::create_dir_all(to.parent().unwrap()).unwrap();
        fs::copy(from, to).unwrap();
    }
    cargo("test", &folder);
    let library = crate::fixtures::file(&cargo("build", &folder), "grown");
    let mut catalog = Catalog::new().with_copies_in(kept("library-copies"));
    catalog.add(library.to_str().unwrap(), &SearchPath::default()).unwrap();
    for name in ["grown", "wobble-rod", "slow"] {
        let element = catalog.find(name, None).unwrap();
        assert!(!element.descriptor().doc.is_empty(), "{name} has no manual page");
        assert!(workshop::examine(&element, &Given::default(), &[]).unwrap().passed(), "{name}");
    }
}

fn faulty() -> Catalog {
    let mut catalog = Catalog::new().with_copies_in(kept("library-copies"));
    let search = SearchPath::of(&[], &[build("faulty-plugin")], None, Path::new(""));
    catalog.add("faulty-plugin", &search).unwrap();
    catalog
}

/// What was found, as text.
fn found(verdict: &Verdict) -> String {
    let mut text = format!("{}\n", verdict.element);
    for check in verdict.checks.iter().filter(|check| check.outcome != Outcome::Ok) {
        text.push_str(&format!("  {}\n", check.check));
        check.findings.iter().for_each(|finding| text.push_str(&format!("    {finding}\n")));
    }
    text
}

#[test]
fn every_fault_is_told_in_words() {
    let catalog = faulty();
    let verdicts: Vec<Verdict> = catalog
        .elements()
        .map(|element| workshop::examine(&element, &Given::default(), &[]).expect("no parameters are needed"))
        .collect();
    assert_eq!(verdicts.len(), 20);
    let sound: Vec<&str> = verdicts.iter().filter(|v| v.passed()).map(|v| v.element.as_str()).collect();
    assert_eq!(sound, ["faulty-plugin/sound", "faulty-plugin/sound-spring"]);
    insta::assert_snapshot!(verdicts.iter().map(found).collect::<String>());
}

#[test]
fn what_an_author_exempts_does_not_fail() {
    let catalog = faulty();
    let element = catalog.find("on-one-body", None).unwrap();
    let exempt = |text: &str| Exemption::read(text, &[element.descriptor()]);
    let third_law = [exempt("on-one-body.third-law").unwrap()];
    let verdict = workshop::examine(&element, &Given::default(), &third_law).unwrap();
    assert!(verdict.passed(), "{verdict:?}");
    let check = verdict.checks.iter().find(|check| check.check == "third-law").unwrap();
    assert!(check.outcome == Outcome::Exempt && !check.findings.is_empty());
    let unknown = exempt("third-lav").unwrap_err();
    assert_eq!(unknown.help, ["did you mean `third-law`?"]);
    assert!(exempt("another.third-law").unwrap_err().message.contains("`another`"));
}

#[test]
fn costs_are_measured_both_ways() {
    let catalog = faulty();
    let cost = |name: &str| workshop::cost(&catalog.find(name, None).unwrap()).unwrap();
    let (recorded, called) = (cost("sound"), cost("wrong-first-derivative"));
    let traced = recorded.traced.expect("its equations are recorded");
    // Two rows x . (p_j - p_i): three differences, twice three products and two sums.
    assert_eq!(traced.operations, 13);
    assert!(traced.ns > 0.0 && recorded.called_ns > 0.0 && recorded.called_derivatives_ns > 0.0);
    assert!(called.traced.is_none() && called.called_ns > 0.0);
}

#[test]
fn parameters_are_written_as_in_a_scene_and_taken_from_their_range() {
    let name = <odyn_joints::distance_rod::DistanceRod as Element>::NAME;
    let mut catalog = Catalog::new();
    catalog.add_library(odyn_joints::library()).unwrap();
    let rod = catalog.find(name, None).unwrap();
    let length = |texts: &[&str]| {
        let texts: Vec<String> = texts.iter().map(ToString::to_string).collect();
        let given = Given::read(&texts).unwrap_or_else(|bad| panic!("{:?}", bad.diagnostics));
        given.check(&[rod.descriptor()]).unwrap();
        let verdict = workshop::examine(&rod, &given, &[]).map_err(|bad| bad.diagnostics)?;
        assert!(verdict.passed(), "{}", found(&verdict));
        Ok::<_, Vec<odyn::diagnostics::Diagnostic>>(verdict.parameters[0].value.clone())
    };
    assert_eq!(length(&[]).unwrap(), "1.0");
    assert_eq!(length(&["length=25cm"]).unwrap(), "0.25");
    assert_eq!(length(&["length = 3", "[distance-rod]\nlength = '2 m'"]).unwrap(), "2.0");
    assert_eq!(length(&["length=-1"]).unwrap_err()[0].code, "ODY0312");
    assert!(Given::read(&["= 3".to_string()]).is_err());
    let unknown = Given::read(&["lenght=1".to_string()]).unwrap().check(&[rod.descriptor()]).unwrap_err();
    assert_eq!(unknown.help, ["did you mean `length`?"]);
}

#[test]
fn every_standard_element_passes_without_options() {
    let mut catalog = Catalog::new();
    for library in
        [odyn_joints::library(), odyn_forces::library(), odyn_controls::library(), odyn_compressor::library()]
    {
        catalog.add_library(library).unwrap();
    }
    let verdicts: Vec<Verdict> = catalog
        .elements()
        .map(|element| workshop::examine(&element, &Given::default(), &[]).expect("defaults"))
        .collect();
    assert!(verdicts.len() >= 71, "{}", verdicts.len());
    let failed: String = verdicts.iter().filter(|verdict| !verdict.passed()).map(found).collect();
    assert!(failed.is_empty(), "{failed}");
}
