//! The book (`docs/book`): its examples are sound and run, what its pages refer to is there, and the pages that commands write
//! are those that they write now. The README, and the map of the sources.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use element_api::manifest::Manifest;
use odyn::catalog::{Catalog, SearchPath, read_manifest};
use odyn::diagnostics::codes;
use odyn::integrate::Methods;
use odyn::results::Remedy;
use odyn::session::{Session, scene_page};
use odyn::verification::scenes_in;
use odyn::workshop::{Contract, Given, NewPlugin, Outcome, Template, Verdict, create, examine};

use crate::fixtures::{build_crate, file, test_crate};
use crate::support::{Scratch, kept, options, root};

fn book() -> PathBuf {
    root().join("docs/book")
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Opens and runs a scene of the book with a library and the standard ones; its checks must hold.
fn run(scene: &Path, library: Option<&Path>) {
    let options = options(&[], &library.map(Path::to_path_buf).into_iter().collect::<Vec<_>>());
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
    run(&example.join("scene.toml"), Some(&build_crate(&example)));
}

#[test]
fn the_scenes_of_the_first_half_run() {
    let scenes = scenes_in(&book().join("examples/scenes")).unwrap();
    assert!(scenes.len() >= 3, "{scenes:?}");
    scenes.iter().for_each(|scene| run(scene, None));
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
        run(&scene, Some(&library));
        let text = read(&scene);
        used.extend(elements.iter().map(|e| &e.name).filter(|name| text.contains(&format!("type = \"{name}\""))));
    }
    assert_eq!(used.len(), elements.len(), "only {used:?} are in scenes");
    // What `odyn plugin check` says, with what the library itself says of its elements.
    let mut catalog = Catalog::new().with_copies_in(kept("library-copies"));
    catalog.add(&file(&library, "cookbook").display().to_string(), &SearchPath::default()).unwrap();
    let verdicts: Vec<Verdict> =
        catalog.elements().map(|element| examine(&element, &Given::default(), &[]).unwrap()).collect();
    assert!(verdicts.iter().all(Verdict::passed), "{verdicts:?}");
    let exempt = verdicts.iter().flat_map(|verdict| &verdict.checks).filter(|check| check.outcome == Outcome::Exempt);
    let exempt: Vec<&String> = exempt.flat_map(|check| &check.findings).collect();
    assert!(
        matches!(exempt[..], [reason] if reason.starts_with("by its library: the reaction of the air")),
        "{exempt:?}"
    );
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

/// `odyn schema --markdown > docs/book/src/scene.md` brings the page up to date, with the standard libraries only.
#[test]
fn the_reference_of_the_scene_format_is_up_to_date() {
    let mut catalog = Catalog::new().with_copies_in(kept("library-copies"));
    let search = SearchPath::standard(&[], &[]);
    for library in ["compressor", "controls", "forces", "joints"] {
        catalog.add(library, &search).unwrap_or_else(|error| panic!("{library}: {error}"));
    }
    let catalog = catalog.with_fmus();
    assert!(
        read(&book().join("src/scene.md")) == scene_page(&catalog, &Methods::default()),
        "write it with `odyn schema --markdown > docs/book/src/scene.md`"
    );
}

/// Every function and parameter type that authors have is on the page of the vocabulary.
#[test]
fn the_vocabulary_is_complete() {
    let page = read(&book().join("src/vocabulary.md"));
    let source = |name: &str| read(&root().join("element-api/src").join(name));
    // The functions of a trait, of the types of an element's arguments, of a module.
    let functions = |text: &str, begin: &str, end: &str, function: &str| -> Vec<String> {
        let parts = text.split(begin).skip(1).filter_map(|part| part.split(end).next());
        let names = parts.flat_map(|part| part.split(function).skip(1));
        names.filter_map(|rest| rest.split(['(', '<']).next()).map(|name| format!("{name}(")).collect()
    };
    let mut words = functions(&source("scalar.rs"), "pub trait Scalar:", "\n}\n", "    fn ");
    words.extend(functions(&source("motion.rs"), "impl<S: Scalar> ", "\n}\n", "    pub fn "));
    words.extend(functions(&source("motion.rs"), "impl<'a, S: Scalar> Values", "\n}\n", "    pub fn "));
    words.extend(functions(&source("geometry.rs"), "impl<S: Scalar> Frame<S>", "\n}\n", "    pub fn "));
    let blocks = source("blocks.rs");
    words.extend(
        blocks.split("\npub fn ").skip(1).filter_map(|rest| rest.split('<').next()).map(|n| format!("blocks::{n}(")),
    );
    assert!(words.len() > 45, "{words:?}");
    for file in ["params.rs", "curve.rs", "function.rs"] {
        let text = source(file);
        let types = text.split("ParamType for ").skip(1).filter_map(|rest| rest.split(" {").next().map(str::to_string));
        words.extend(types.map(|name| format!("`{name}`")));
    }
    let missing: Vec<&String> = words.iter().filter(|word| !page.contains(word.as_str())).collect();
    assert!(missing.is_empty(), "not in docs/book/src/vocabulary.md: {missing:?}");
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

/// Pages that stand alone: their links lead somewhere, and the README is short.
#[test]
fn what_the_readme_and_its_kin_refer_to_is_there() {
    for (page, least) in [("README.md", 10), ("CONTRIBUTING.md", 2)] {
        let text = read(&root().join(page));
        let links = links(&text);
        assert!(links.len() >= least, "{page}: {links:?}");
        for link in links {
            assert!(root().join(link.split('#').next().unwrap()).exists(), "{page}: no {link}");
        }
    }
    assert!(read(&root().join("README.md")).len() < 9000, "what is more belongs into the book");
}

/// The walk of `docs/architecture.md`: each file is there, and has the function or type that the row names.
#[test]
fn the_map_of_the_sources_is_true() {
    let text = read(&root().join("docs/architecture.md"));
    let names = |cell: &str| cell.split('`').skip(1).step_by(2).map(str::to_owned).collect::<Vec<_>>();
    let mut seen = 0;
    for row in text.lines().filter(|line| line.starts_with('|')) {
        let cells: Vec<&str> = row.trim_matches('|').split(" | ").collect();
        let [_, items, files] = cells[..] else { continue };
        let files = names(files);
        if files.iter().all(|file| !file.ends_with(".rs")) {
            continue;
        }
        let source = |file: &String| {
            let path = root().join("host").join(file);
            if path.is_dir() { String::new() } else { read(&path) }
        };
        let sources: String = files.iter().map(source).collect();
        for item in names(items) {
            seen += 1;
            let last = item.rsplit("::").next().unwrap();
            let defined = |kind: &str| {
                let definition = format!("{kind} {last}");
                let mut rest = sources.split(&definition).skip(1);
                rest.any(|rest| !rest.starts_with(|c: char| c.is_alphanumeric() || c == '_'))
            };
            assert!(["fn", "struct", "trait", "enum"].iter().any(|kind| defined(kind)), "no `{item}` in {files:?}");
        }
    }
    assert!(seen > 20, "{seen} items: is this test still reading the right table?");
    let folders =
        text.lines().filter_map(|line| line.strip_prefix("| `")?.split('`').next()).filter(|f| f.ends_with('/'));
    for folder in folders {
        assert!(root().join(folder).is_dir(), "no {folder}");
    }
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
