//! The scenes of `scenes/verification/`: every check within its tolerance, every body in balance, every element of the standard
//! libraries verified, and the work pinned.
//!
//! A new case is a scene file there; `odyn verify` shows it.

use insta::assert_snapshot;
use odyn::analyses::question::ANALYSES;
use odyn::verification::{Case, Coverage, Element, Settings, Verifier, scenes_in};

use crate::support::{kept, root};

/// The libraries whose elements must all be verified.
const LIBRARIES: [&str; 4] = ["odyn-compressor", "odyn-controls", "odyn-forces", "odyn-joints"];

/// Runs all scenes.
fn verified() -> (Vec<Case>, Vec<Element>) {
    let scenes = scenes_in(&root().join("scenes/verification")).unwrap();
    let settings = Settings { library_copies: Some(kept("library-copies")), ..Settings::default() };
    let mut verifier = Verifier::new(settings);
    let cases = verifier.verify_all(&scenes, 0, &|_| ());
    (cases, verifier.elements().to_vec())
}

/// What is wrong with a case; empty if nothing is.
fn complaints(case: &Case) -> String {
    let measured = match &case.outcome {
        Ok(measured) => measured,
        Err(reason) => return format!("{}: {reason}\n", case.name),
    };
    let mut found = String::new();
    for check in measured.checks.iter().filter(|check| !check.passed) {
        let (off, at, tolerance) = (check.largest, check.at, check.tolerance);
        let problem = check.problem.as_deref().unwrap_or_default();
        found +=
            &format!("{}: `{}` off by {off:.2e} at {at}, allowed {tolerance:e} {problem}\n", case.name, check.name);
    }
    if let Some(balance) = measured.balance.as_ref().filter(|balance| !balance.passed()) {
        found += &format!("{}: {balance:?}\n", case.name);
    }
    found
}

/// One line per scene. A change here is a change of speed: say why in the commit.
fn work(cases: &[Case]) -> String {
    let mut table =
        format!("{:34}{:>8}{:>10}{:>13}{:>16}\n", "scene", "steps", "rejected", "evaluations", "factorisations");
    // Analyses take no steps.
    for case in cases.iter().filter(|case| case.analysis.is_none()) {
        let Ok(measured) = &case.outcome else { continue };
        let work = &measured.work;
        table += &format!(
            "{:34}{:>8}{:>10}{:>13}{:>16}\n",
            case.name, work.steps, work.rejected, work.evaluations, work.factorisations
        );
    }
    table
}

#[test]
fn every_element_is_verified_and_every_scene_passes_with_the_pinned_work() {
    let (cases, elements) = verified();
    let failed: String = cases.iter().map(complaints).collect();
    assert!(failed.is_empty(), "\n{failed}");
    let coverage = Coverage::of(&cases, &elements);
    assert_eq!(coverage.libraries, LIBRARIES);
    assert!(coverage.gaps.is_empty(), "no scene verifies {}", coverage.gaps.join(", "));
    for analysis in ANALYSES {
        assert!(cases.iter().any(|case| case.analysis.as_deref() == Some(analysis)), "no scene verifies {analysis}");
    }
    // Step counts depend on the last digits of the system's functions such as `sin`.
    if cfg!(all(target_arch = "x86_64", target_os = "linux")) {
        assert_snapshot!(work(&cases));
    }
}

/// A page of the manual names its scene; a scene without elements and without an analysis has no page.
#[test]
fn every_scene_belongs_to_an_element_or_an_analysis() {
    for path in scenes_in(&root().join("scenes/verification")).unwrap() {
        let (scene, _) = odyn::scene::read(&path, &[]).unwrap_or_else(|r| panic!("{:?}", r.diagnostics));
        let verification = scene.verification.unwrap_or_else(|| panic!("{}: no [verification]", path.display()));
        let belongs = !verification.elements.is_empty() || verification.analysis.is_some();
        assert!(belongs && !verification.text.is_empty(), "{}", path.display());
        assert!(!scene.title.is_empty(), "{}: no title", path.display());
    }
}
