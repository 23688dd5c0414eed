//! Elements with any number of bodies: the standard rope, taut and slack, in every way, and what is refused.

use std::fs;

use odyn::results::EventKind;
use odyn::session::{RunReport, Session};

use crate::support::{Scratch, column, difference, options, root};

fn try_run(text: &str, sets: &[&str]) -> Result<RunReport, String> {
    let scratch = Scratch::new();
    let path = scratch.file("scene.toml", text);
    let session = Session::open(&path, &options(sets, &[])).map_err(|error| error.to_string())?;
    session.run(None, Box::new(|_| ()), &Default::default()).map_err(|error| error.to_string())
}

/// All ways give the same table.
#[track_caller]
fn every_way_agrees(text: &str, tolerance: f64) -> RunReport {
    let first = try_run(text, &[]).unwrap();
    assert_eq!(first.exit_code(), 0, "{} {:?}", first.summary.reason, first.summary.audit);
    for sets in [
        &["simulation.formulation=\"cartesian\""][..],
        &["simulation.formulation=\"joint\""],
        &["simulation.method=\"radau5\""],
        &["simulation.method=\"auto\"", "simulation.engine=\"interpreted\""],
        &["simulation.formulation=\"cartesian\"", "simulation.method=\"radau5\""],
    ] {
        let other = try_run(text, sets).unwrap();
        for (channel, (a, b)) in first.channels.iter().zip(first.columns.iter().zip(&other.columns)) {
            let off = difference(a, b);
            assert!(off < tolerance, "{sets:?}: `{}` differs by {off:.1e}", channel.name);
        }
    }
    first
}

/// A weight and another one hang on guides; without gravity the first one flies off and tightens the rope over two pulleys.
fn snatch(restitution: f64) -> String {
    let mut text = format!(
        "[plugins]\nlibraries = [\"odyn-joints\"]\n[simulation]\ngravity = [0, 0, 0]\nt_end = 0.5\noutput_step = 0.01\n\
         tolerance = 1e-10\n[[joint]]\nname = \"rope\"\ntype = \"rope\"\nbodies = [\"one\", \"ground\", \"ground\", \"other\"]\n\
         points = [[0, 0, -1], [0, 0, 0], [1, 0, 0], [1, 0, -2]]\nparams.length = 4.5\nparams.slack = true\n\
         params.restitution = {restitution:?}\n"
    );
    for (name, mass, x, z, speed) in [("one", 2.0, 0.0, -1.0, -2.0), ("other", 3.0, 1.0, -2.0, 0.0)] {
        text += &format!(
            "[[body]]\nname = \"{name}\"\nmass = {mass:?}\ninertia = [1, 1, 1]\nposition = [{x:?}, 0, {z:?}]\n\
             velocity = [0, 0, {speed:?}]\n[[joint]]\nname = \"guide_{name}\"\ntype = \"translational\"\n\
             bodies = [\"ground\", \"{name}\"]\npoint = [{x:?}, 0, {z:?}]\naxis = [0, 0, 1]\n[[output]]\n\
             name = \"v_{name}\"\nquantity = \"velocity\"\nof = \"{name}\"\ncomponent = \"z\"\n"
        );
    }
    text
}

#[test]
fn a_rope_that_becomes_taut_pulls_both_ends_by_the_laws_of_impact() {
    for restitution in [0.0, 0.6] {
        let report = every_way_agrees(&snatch(restitution), 1e-8);
        let impacts: Vec<_> = report.events.iter().filter(|event| event.kind == EventKind::Impact).collect();
        // Slack 0.5 m, taken up at 2 m/s.
        assert!((impacts[0].time - 0.25).abs() < 1e-9 && impacts[0].element == "rope", "{impacts:?}");
        let impulse = (1.0 + restitution) * 2.0 / (1.0 / 2.0 + 1.0 / 3.0);
        let (one, other) = (column(&report, "v_one"), column(&report, "v_other"));
        assert!((one[40] - (-2.0 + impulse / 2.0)).abs() < 1e-9, "{restitution}: {}", one[40]);
        assert!((other[40] - impulse / 3.0).abs() < 1e-9, "{restitution}: {}", other[40]);
    }
}

#[test]
fn a_block_and_tackle_moves_the_same_in_every_way() {
    let text = fs::read_to_string(root().join("scenes/verification/rope.toml")).unwrap();
    every_way_agrees(&text, 1e-9);
}

#[test]
fn a_wrong_number_of_bodies_is_told_at_their_list() {
    let bodies = "bodies = [\"one\", \"ground\", \"ground\", \"other\"]\npoints = [[0, 0, -1], [0, 0, 0], [1, 0, 0], [1, 0, -2]]";
    let sound = snatch(0.0);
    assert!(sound.contains(bodies));
    let many = vec!["\"one\", \"ground\""; 40].join(", ");
    for (list, words) in [("\"one\"", "connects 1 body, `rope` needs 2 to 64"), (many.as_str(), "connects 80 bodies")] {
        let error = try_run(&sound.replace(bodies, &format!("bodies = [{list}]")), &[]).expect_err("refused");
        assert!(error.contains(words), "{error}");
    }
}
