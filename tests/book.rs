//! The author's guide (`docs/book`): its examples are sound and run, and what its pages refer to is there.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use element_api::manifest::Manifest;
use odyn::catalog::read_manifest;
use odyn::diagnostics::codes;
use odyn::results::Remedy;
use odyn::session::Session;
use odyn::workshop::{Contract, NewPlugin, Template, create};

use crate::fixtures::{build_crate, file, test_crate};
use crate::support::{Scratch, options, root};

fn book() -> PathBuf {
    root().join("docs/book")
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Opens and runs a scene of the book; its checks must hold.
fn run(scene: &Path, library: &Path) {
    let options = options(&[], &[library.to_path_buf()]);
    let session = Session::open(scene, &options).unwrap_or_else(|error| panic!("{}\n{error}", scene.display()));
    assert!(session.warnings.is_empty(), "{}: {:?}", scene.display(), session.warnings);
    assert!(!session.scene.checks.is_empty(), "{} checks nothing", scene.display());
    let report = session.run(None, Box::new(|_| ()), &Default::default()).unwrap_or_else(|error| panic!("{error}"));
    let summary = &report.summary;
    assert_eq!(report.exit_code(), 0, "{}: {} {:?}", scene.display(), summary.reason, summary.checks);
}

/// The book begins with `odyn plugin new wobble --kind joint`, and changes three files of what that makes.
#[test]
fn the_first_joint_begins_as_a_new_plugin() {
    let scratch = Scratch::new();
    let contract = Contract::Version("1".into());
    let new = NewPlugin { folder: scratch.path().join("wobble"), template: Template::Joint, contract };
    let created = create(&new).unwrap();
    let example = book().join("examples/wobble");
    for file in ["Cargo.toml", "scene.toml", "src/lib.rs", "src/tests.rs"] {
        assert!(created.files.iter().any(|(path, _)| path == Path::new(file)), "{file} is not among {created:?}");
        assert!(example.join(file).is_file(), "{file}");
    }
    let same = |line: &&str| !line.starts_with("description = ") && !line.starts_with("element-api = ");
    let lines = |path: &Path| read(path).lines().filter(same).map(str::to_owned).collect::<Vec<_>>();
    assert_eq!(lines(&example.join("Cargo.toml")), lines(&new.folder.join("Cargo.toml")));
}

#[test]
fn the_first_joint_is_sound_and_runs() {
    let example = book().join("examples/wobble");
    test_crate(&example);
    run(&example.join("scene.toml"), &build_crate(&example));
}

#[test]
fn the_recipes_of_the_cookbook_are_sound_and_run() {
    let example = book().join("examples/cookbook");
    test_crate(&example);
    let library = build_crate(&example);
    let Manifest { elements, .. } = read_manifest(&file(&library, "cookbook")).unwrap();
    let mut used = BTreeSet::new();
    for entry in fs::read_dir(example.join("scenes")).unwrap() {
        let scene = entry.unwrap().path();
        run(&scene, &library);
        let text = read(&scene);
        used.extend(elements.iter().map(|e| &e.name).filter(|name| text.contains(&format!("type = \"{name}\""))));
    }
    assert_eq!(used.len(), elements.len(), "only {used:?} are in scenes");
}

/// `odyn explain --markdown > docs/book/src/messages.md` brings the page up to date.
#[test]
fn the_page_of_messages_is_up_to_date() {
    let written = read(&book().join("src/messages.md"));
    assert!(
        written == codes::page() + &Remedy::page(),
        "write it with `odyn explain --markdown > docs/book/src/messages.md`"
    );
}

/// The pages of the book.
fn pages() -> Vec<PathBuf> {
    let files = fs::read_dir(book().join("src")).unwrap().map(|entry| entry.unwrap().path());
    let mut pages: Vec<PathBuf> = files.filter(|path| path.extension().is_some_and(|e| e == "md")).collect();
    pages.sort();
    pages
}

/// Targets of the links of a text, those to other sites left out.
fn links(text: &str) -> Vec<&str> {
    let targets = text.split("](").skip(1).filter_map(|rest| rest.split(')').next());
    targets.filter(|target| !target.contains("://")).collect()
}

/// The includes of a text: file, and anchor where there is one.
fn includes(text: &str) -> Vec<(&str, Option<&str>)> {
    let named = text.split("{{#include ").skip(1).filter_map(|rest| rest.split("}}").next());
    named.map(|place| place.split_once(':').map_or((place, None), |(file, anchor)| (file, Some(anchor)))).collect()
}

#[test]
fn every_page_is_in_the_summary() {
    let summary = read(&book().join("src/SUMMARY.md"));
    let listed: BTreeSet<&str> = links(&summary).into_iter().collect();
    for page in pages() {
        let name = page.file_name().unwrap().to_str().unwrap();
        assert!(name == "SUMMARY.md" || listed.contains(name), "{name} is not in the summary");
    }
    for name in listed {
        assert!(book().join("src").join(name).is_file(), "the summary has {name}, which is not there");
    }
}

#[test]
fn what_pages_refer_to_is_there() {
    let mut seen = 0;
    for page in pages() {
        let (text, folder) = (read(&page), page.parent().unwrap());
        for link in links(&text) {
            let target = link.split('#').next().unwrap();
            assert!(target.is_empty() || folder.join(target).exists(), "{}: no {link}", page.display());
        }
        for (name, anchor) in includes(&text) {
            seen += 1;
            let included = read(&folder.join(name));
            // A page of `docs` is read there, and here.
            for link in links(&included).into_iter().filter(|_| name.ends_with(".md")) {
                let target = link.split('#').next().unwrap();
                for place in [folder, folder.join(name).parent().unwrap()] {
                    assert!(place.join(target).exists(), "{}: no {link} in {}", page.display(), place.display());
                }
            }
            if let Some(anchor) = anchor {
                let (begin, end) = (format!("ANCHOR: {anchor}\n"), format!("ANCHOR_END: {anchor}\n"));
                assert!(included.contains(&begin) && included.contains(&end), "{}: {name}:{anchor}", page.display());
            }
        }
    }
    assert!(seen > 10, "{seen} includes were seen: is this test still reading the right files?");
}

/// Code that is shown is code that is tested: blocks of Rust and scenes hold includes and nothing else, unless they are
/// marked with `ignore`.
#[test]
fn code_is_included_from_files_that_are_tested() {
    let mut seen = 0;
    for page in pages() {
        let text = read(&page);
        for (k, block) in text.split("```").enumerate().filter(|(k, _)| k % 2 == 1) {
            let (word, content) = block.split_once('\n').unwrap_or((block, ""));
            if !["rust", "toml"].contains(&word) {
                continue;
            }
            seen += 1;
            let mut lines = content.lines().map(str::trim).filter(|line| !line.is_empty());
            let included = lines.all(|line| line.starts_with("{{#include ") && line.ends_with("}}"));
            assert!(included, "{}: block {} is neither included nor marked", page.display(), k / 2 + 1);
        }
    }
    assert!(seen > 10, "{seen} blocks");
}
