//! Joints that let go: what a run keeps of that, where it continues; and what says that it cannot.

use odyn::results::Status;
use odyn::session::{RunReport, Session};

use crate::contacts::{run, try_run};
use crate::release::{door, output, pendulum, released, time_to};
use crate::support::{Scratch, column, difference, leg, open_text, options};

#[test]
fn what_has_let_go_is_kept() {
    let text = pendulum("{ when = \"T\", above = \"40 N\" }", 1.0);
    let whole = run(&text, &[]);
    // In memory: back before the release, and again behind it.
    let mut run = open_text(&text, &[]).prepare().unwrap().start().unwrap();
    run.advance(0.2).unwrap();
    let before = run.save().unwrap();
    run.advance(0.8).unwrap();
    let behind = run.save().unwrap();
    run.advance(1.0).unwrap();
    let first = run.output("x").unwrap();
    run.restore(&before).unwrap();
    assert!(run.output("T").unwrap() > 1.0);
    run.advance(1.0).unwrap();
    assert!((run.output("x").unwrap() - first).abs() < 1e-10);
    run.restore(&behind).unwrap();
    assert_eq!(run.output("T").unwrap(), 0.0);
    run.advance(1.0).unwrap();
    assert_eq!(run.output("x").unwrap(), first);
    // In files.
    let scratch = Scratch::new();
    scratch.file("scene.toml", &text);
    leg(&scratch, "simulation.t_end = 0.8", "first", None);
    let report = leg(&scratch, "simulation.t_end = 1", "second", Some("first"));
    assert!(report.events.is_empty() && column(&report, "T").iter().all(|load| *load == 0.0));
    let x = |report: &RunReport| *column(report, "x").last().unwrap();
    assert!((x(&report) - x(&whole)).abs() < 1e-10);
    let legs = leg(&scratch, "simulation.checkpoint_every = 0.13", "legs", None);
    assert!((x(&legs) - x(&whole)).abs() < 1e-10);
    assert_eq!(legs.summary.releases.len(), 1);
    // A scene in which the joint stays cannot go on from there.
    let held = scratch.file("held.toml", text.replace("release = ", "# "));
    let mut session = Session::open(&held, &options(&[], &[])).unwrap();
    let error = session.go_on_from(odyn::session::Restart::read(&scratch.path().join("first")).unwrap()).unwrap_err();
    assert!(error.to_string().contains("`cord` had let go"), "{error}");
}

#[test]
fn islands_let_go_by_themselves() {
    let other = "[[body]]\nname = \"far\"\nmass = 1\nparticle = true\nposition = [5, 0, -1]\n[[joint]]\nname = \"thread\"\n\
                 type = \"distance-rod\"\nbodies = [\"ground\", \"far\"]\npoints = [[5, 0, 0], [5, 0, -1]]\nparams.length = 1\n";
    // Its own time, or by what happens on another island: they are one then.
    for (release, at) in [("release = { at = 0.25 }", 0.25), ("release = { when = \"x\", below = 0 }", time_to(0.0))] {
        let text = pendulum("{ at = 0.9 }", 1.0) + other + release + "\n" + &output("far", "position", "far", "z");
        let (whole, apart) = (run(&text, &[]), run(&text, &["simulation.islands = \"apart\""]));
        for report in [&whole, &apart] {
            let event = released(report).into_iter().find(|event| event.element == "thread").unwrap();
            assert!((event.time - at).abs() < 1e-9, "{event:?}");
        }
        for (a, b) in whole.columns.iter().zip(&apart.columns) {
            assert!(difference(a, b) < 1e-8);
        }
    }
}

#[test]
fn what_cannot_let_go_says_so() {
    let text = pendulum("{ at = 0.4 }", 1.0);
    let refused = |sets: &[&str]| try_run(&text, sets, None).unwrap_err();
    let fixed = refused(&["simulation.method = \"rk4\"", "simulation.fixed_step = 0.001"]);
    assert!(fixed.contains("`cord` may be released") && fixed.contains("fixed size"), "{fixed}");
    assert!(refused(&["simulation.engine = \"reference\""]).contains("knows no joints that let go"));
    let right = open_text(&text, &[]).prepare().unwrap().right_side().map(drop).unwrap_err();
    assert!(right.to_string().contains("`cord` lets go"), "{right}");
    // A load that two hinges share is no load of one of them.
    let shared = door("release = { when = \"Fy\", above = 1 }", "") + &output("Fy", "reaction_force", "one", "y");
    let report = try_run(&shared, &[], None).unwrap();
    assert_eq!(report.summary.status, Status::Suspect);
    assert!(report.summary.reason.contains("the release of `one` depends on a reaction"), "{}", report.summary.reason);
}
