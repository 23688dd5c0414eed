//! Elements with any number of bodies: the standard rope, taut and slack, in every way, and what is refused.

use std::fs;

use odyn::results::EventKind;
use odyn::session::RunReport;

use crate::contacts::try_run;
use crate::support::{column, difference, open_text, root};

/// All ways give the same table.
#[track_caller]
fn every_way_agrees(text: &str, tolerance: f64) -> RunReport {
    let first = try_run(text, &[], None).unwrap();
    assert_eq!(first.exit_code(), 0, "{} {:?}", first.summary.reason, first.summary.audit);
    for sets in [
        &["simulation.formulation=\"cartesian\""][..],
        &["simulation.formulation=\"joint\""],
        &["simulation.method=\"radau5\""],
        &["simulation.method=\"auto\"", "simulation.engine=\"interpreted\""],
        &["simulation.formulation=\"cartesian\"", "simulation.method=\"radau5\""],
    ] {
        let other = try_run(text, sets, None).unwrap();
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
        let error = try_run(&sound.replace(bodies, &format!("bodies = [{list}]")), &[], None).expect_err("refused");
        assert!(error.contains(words), "{error}");
    }
}

/// A load m on a rope from a drum of the radius 0.2 m with the moment of inertia J, on the ground; the drum turns with `speed` (to the left:
/// it takes rope in), `length` of rope is out. `more` goes behind the rope's parameters.
fn winch(t_end: f64, speed: f64, length: f64, more: &str) -> String {
    format!(
        "[plugins]\nlibraries = [\"odyn-joints\"]\n[simulation]\ngravity = [0, 0, -9.81]\nt_end = {t_end:?}\noutput_step = 0.01\n\
         tolerance = 1e-11\n[[body]]\nname = \"drum\"\nmass = 20\ninertia = [0.3, 0.4, 0.3]\nangular_velocity = [0, {:?}, 0]\n\
         [[body]]\nname = \"load\"\nmass = 10\ninertia = [0.1, 0.1, 0.1]\nposition = [0.2, 0, -1]\nvelocity = [0, 0, 0]\n\
         [[joint]]\nname = \"bearing\"\ntype = \"revolute\"\nbodies = [\"ground\", \"drum\"]\npoint = [0, 0, 0]\naxis = [0, -1, 0]\n\
         [[joint]]\nname = \"guide\"\ntype = \"translational\"\nbodies = [\"ground\", \"load\"]\npoint = [0.2, 0, -1]\naxis = [0, 0, 1]\n\
         [[joint]]\nname = \"winch\"\ntype = \"rope\"\nbodies = [\"drum\", \"ground\", \"load\"]\n\
         frames = [{{ position = [0, 0, 0], axis = [0, -1, 0] }}, {{ position = [0.2, 0, 0], axis = [0, -1, 0] }}, {{ position = [0, 0, 0] }}]\n\
         params.begin_drum = 0.2\nparams.length = {length:?}\n{more}\n\
         [[output]]\nname = \"z\"\nquantity = \"position\"\nof = \"load\"\ncomponent = \"z\"\n\
         [[output]]\nname = \"angle\"\nquantity = \"coordinate\"\nof = \"bearing\"\nchannel = \"angle\"\n\
         [[output]]\nname = \"tension\"\nquantity = \"reaction_force\"\nof = \"winch\"\non = \"load\"\ncomponent = \"z\"\n\
         [[output]]\nname = \"torque\"\nquantity = \"reaction_torque\"\nof = \"winch\"\non = \"drum\"\ncomponent = \"y\"\n\
         [[output]]\nname = \"bearing\"\nquantity = \"reaction_force\"\nof = \"bearing\"\non = \"drum\"\ncomponent = \"z\"\n",
        -speed
    )
}

#[test]
fn a_load_runs_off_a_drum_over_many_turns() {
    let report = every_way_agrees(&winch(4.0, 0.0, 1.0, ""), 1e-8);
    // m g - T = m a, T r = J a / r.
    let a = 9.81 / (1.0 + 0.4 / (10.0 * 0.04));
    let columns = ["z", "angle", "tension", "torque", "bearing"].map(|name| column(&report, name));
    for (k, t) in report.times.iter().enumerate() {
        let fall = 0.5 * a * t * t;
        // What turns the drum is a torque, about -y for a load that goes down; its bearing carries the drum's weight.
        let expected = [-1.0 - fall, -fall / 0.2, 10.0 * (9.81 - a), 0.2 * 10.0 * (9.81 - a), 20.0 * 9.81];
        for (found, expected) in columns.iter().zip(expected) {
            assert!((found[k] - expected).abs() < 1e-9 * expected.abs().max(1.0), "{t}: {} {expected}", found[k]);
        }
    }
    assert!(column(&report, "angle")[400] < -190.0);
}

#[test]
fn only_drums_count_turns() {
    for (text, name, counts) in [(winch(1.0, 0.0, 1.0, ""), "winch", true), (snatch(0.0), "rope", false)] {
        let session = open_text(&text, &[]);
        let rope = session.model.elements.iter().find(|element| element.name == name).unwrap();
        assert_eq!(rope.counts_turns(), counts, "{name}");
    }
}

#[test]
fn a_drum_winds_loose_rope_in_and_then_lifts_its_load() {
    // On a floor: 0.1 m of loose rope, wound in at 0.2 * 5 m/s.
    let floor = "params.slack = true\n[[joint]]\nname = \"floor\"\ntype = \"translational-stop\"\nbodies = [\"ground\", \"load\"]\n\
                 point = [0.2, 0, -1]\naxis = [0, 0, 1]\nparams = { lower = 0, restitution = 0 }\n";
    let report = every_way_agrees(&winch(0.3, 5.0, 1.1, floor), 1e-8);
    let impact =
        report.events.iter().find(|event| event.kind == EventKind::Impact && event.element == "winch").unwrap();
    assert!((impact.time - 0.1).abs() < 1e-10, "{impact:?}");
    // J w = (J + m r^2) w': both move on with half the speed, and then as a load on a drum does.
    let (z, speed, a) = (column(&report, "z"), 0.5, -9.81 / 2.0);
    for (k, t) in report.times.iter().enumerate() {
        let s = (t - 0.1).clamp(0.0, 0.5 / 9.81 * 4.0);
        assert!((z[k] - (-1.0 + speed * s + 0.5 * a * s * s).max(-1.0)).abs() < 1e-9, "{t}: {}", z[k]);
    }
    let lost = 0.5 * 0.4 * 25.0 / 2.0;
    assert!((impact.lost - lost).abs() < 1e-9, "{impact:?}");
}

#[test]
fn a_drum_needs_something_that_the_rope_leaves_it_on() {
    let text = winch(1.0, 0.0, 1.0, "params.end_drum = 0.1");
    let error = try_run(&text, &[], None).expect_err("two drums");
    assert!(error.contains("a rope with 2 drums connects 4 bodies or more"), "{error}");
    let error = try_run(&winch(1.0, 0.0, 1.0, ""), &["winch.params.begin_drum=-0.2"], None).expect_err("a radius");
    assert!(error.contains("begin_drum"), "{error}");
}
