//! The numerical stress suite (`scenes/stress/suite.toml`) in its short form: everything within its bounds, and some work pinned.
//!
//! A new trial is a table there; `odyn stress` shows it, `odyn stress --full` runs all of it for as long as the scenes say.

use std::collections::BTreeSet;
use std::sync::Arc;

use insta::assert_snapshot;
use odyn::stress::{Outcome, Settings, Suite, run};

use crate::support::{kept, root};

/// Trials whose work is pinned, one of each kind of difficulty.
const PINNED: [&str; 9] = [
    "four-bars-5",
    "slider-crank-bifurcation",
    "gimbal-lock",
    "bennett",
    "doors",
    "micrometres",
    "light-between-stiff",
    "assembly-off-1e-1",
    "chaos-15-s",
];

fn suite() -> Suite {
    Suite::read(&root().join("scenes/stress/suite.toml")).unwrap_or_else(|error| panic!("{error}"))
}

/// What is wrong with an outcome; empty if nothing is.
fn complaints(outcome: &Outcome) -> String {
    let name = format!("{} ({})", outcome.trial, outcome.formulation);
    let mut text: String = outcome.faults.iter().map(|fault| format!("{name}: {fault}\n")).collect();
    for measure in outcome.measures.iter().filter(|measure| !measure.passed()) {
        text += &format!("{name}: `{}` is {:.3e}, allowed {:e}\n", measure.what, measure.found, measure.bound);
    }
    text
}

/// One line per pinned run. A change here is a change of speed: say why in the commit.
fn work(outcomes: &[Outcome]) -> String {
    let mut table = format!("{:34}{:>8}{:>10}{:>13}{:>11}\n", "trial", "steps", "rejected", "evaluations", "rank-safe");
    for outcome in outcomes.iter().filter(|outcome| PINNED.contains(&outcome.trial.as_str())) {
        let work = &outcome.work;
        let name = format!("{} ({})", outcome.trial, outcome.formulation);
        table +=
            &format!("{name:34}{:>8}{:>10}{:>13}{:>11}\n", work.steps, work.rejected, work.evaluations, work.rank_safe);
    }
    table
}

#[test]
fn the_short_form_is_within_its_bounds() {
    let settings = Settings { library_copies: Some(kept("library-copies")), ..Settings::default() };
    let outcomes = run(&suite(), &[], &settings, &|_| (), &Arc::default()).unwrap();
    let complaints: String = outcomes.iter().map(complaints).collect();
    assert!(complaints.is_empty(), "\n{complaints}");
    assert_snapshot!(work(&outcomes));
}

#[test]
fn every_family_and_every_kind_of_expectation_is_there() {
    let suite = suite();
    let families: BTreeSet<&str> = suite.trials.iter().map(|trial| trial.family.as_str()).collect();
    let expected = [
        "assembly",
        "drift",
        "long runs",
        "missed",
        "proportions",
        "redundant joints",
        "scale",
        "singular positions",
        "stiffness",
    ];
    assert_eq!(families.into_iter().collect::<Vec<_>>(), expected);
    for trial in &suite.trials {
        assert!(trial.scene.is_file(), "`{}`: no scene `{}`", trial.name, trial.named);
    }
}

#[test]
fn a_broken_bound_is_told_with_what_was_found() {
    let mut suite = suite();
    let trial = suite.trials.iter_mut().find(|trial| trial.name == "bennett").unwrap();
    trial.set.push("check.angles at A and B.reference=0.1".to_owned());
    let settings = Settings { library_copies: Some(kept("library-copies")), ..Settings::default() };
    let outcomes = run(&suite, &["bennett".into()], &settings, &|_| (), &Arc::default()).unwrap();
    assert_eq!(outcomes.len(), 2, "in both formulations");
    for outcome in &outcomes {
        assert!(!outcome.passed());
        let said = complaints(outcome);
        assert!(said.contains("`angles at A and B` is ") && said.lines().count() == 1, "{said}");
    }
}
