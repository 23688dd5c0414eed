//! Manual pages: every element of the standard libraries has one, complete, and the scene on it runs.

use element_api::documentation::{manual_page, scenes_of};
use odyn::catalog::{Catalog, ElementHandle, SearchPath};
use odyn::session::Session;

use crate::support::{Scratch, kept, options};

/// The parts of a page after its picture in words, in their order.
const HEADINGS: [&str; 4] = ["## Equations", "## Signs", "## Singular cases", "## Example"];

/// The catalog of one library.
fn catalog(library: &str) -> Catalog {
    let mut catalog = Catalog::new().with_copies_in(kept("library-copies"));
    catalog.add(library, &SearchPath::standard(&[], &[])).unwrap_or_else(|error| panic!("{library}: {error}"));
    catalog
}

/// What is wrong with the page; nothing if it is as it should be.
fn faults(page: &str, name: &str) -> Vec<String> {
    let mut faults = Vec::new();
    if page.is_empty() || page.starts_with('#') {
        faults.push("does not begin with a picture in words".to_string());
    }
    let found: Vec<&str> = page.lines().filter(|line| line.starts_with('#')).collect();
    if found != HEADINGS {
        faults.push(format!("has the headings {found:?}"));
    }
    match scenes_of(page).as_slice() {
        [scene] => {
            if !scene.contains(&format!("type = \"{name}\"")) {
                faults.push("has an example without the element".to_string());
            }
            faults.extend(run(scene));
        }
        scenes => faults.push(format!("has {} scenes", scenes.len())),
    }
    faults
}

/// Why the scene does not run to its end.
fn run(scene: &str) -> Option<String> {
    let scratch = Scratch::new();
    let session = match Session::open(&scratch.file("example.toml", scene), &options(&[], &[])) {
        Ok(session) => session,
        Err(error) => return Some(format!("has an example that is refused:\n{}", error.render(false))),
    };
    match session.run(None, Box::new(|_| ()), &Default::default()) {
        Ok(report) if report.exit_code() == 0 => None,
        Ok(report) => Some(format!("has an example that stops: {}", report.summary.reason)),
        Err(error) => Some(format!("has an example that fails:\n{}", error.render(false))),
    }
}

#[track_caller]
fn check(library: &str) {
    let catalog = catalog(library);
    let elements: Vec<ElementHandle> = catalog.elements().collect();
    assert!(!elements.is_empty());
    let of = |element: &ElementHandle| {
        let descriptor = element.descriptor();
        let faults = faults(&manual_page(&descriptor.doc), &descriptor.name).into_iter();
        faults.map(|fault| format!("the page of {} {fault}", element.full_name())).collect::<Vec<_>>()
    };
    let faults: Vec<String> = elements.iter().flat_map(of).collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn pages_of_the_joints_are_complete_and_their_examples_run() {
    check("odyn-joints");
}

#[test]
fn pages_of_the_forces_are_complete_and_their_examples_run() {
    check("odyn-forces");
}

#[test]
fn pages_of_the_controls_are_complete_and_their_examples_run() {
    check("odyn-controls");
}

#[test]
fn pages_of_the_compressor_are_complete_and_their_examples_run() {
    check("odyn-compressor");
}

#[test]
fn a_page_with_gaps_is_noticed() {
    let scene = "[simulation]\nt_end = 1\noutput_step = 1\n[[joint]]\ntype = \"hinge\"\n";
    let page = format!("## Equations\n## Signs\n## Example\n```toml\n{scene}```\n");
    let found = faults(&page, "rod");
    for (fault, words) in
        found.iter().zip(["picture in words", "has the headings", "without the element", "is refused"])
    {
        assert!(fault.contains(words), "{fault}");
    }
    assert_eq!(found.len(), 4, "{found:?}");
    assert!(faults("", "rod").iter().any(|fault| fault.contains("0 scenes")));
}
