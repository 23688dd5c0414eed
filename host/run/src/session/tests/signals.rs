//! Signals between elements, and forces that depend on what is solved for.

use super::*;

/// A body of 2 kg on a rail along x; gravity presses it down.
fn cart(settings_text: &str, velocity: f64) -> String {
    settings(settings_text)
        + &format!(
            "[[body]]\nname = \"cart\"\nmass = 2\ninertia = [0.1, 0.1, 0.1]\nvelocity = [{velocity:?}, 0, 0]\n\
             [[joint]]\nname = \"rail\"\ntype = \"slide\"\nbodies = [\"ground\", \"cart\"]\npoint = [0, 0, 0]\n\
             axis = [1, 0, 0]\n"
        )
        + &output("x", "quantity = \"position\"; of = \"cart\"; component = \"x\"")
        + &output("v", "quantity = \"velocity\"; of = \"cart\"; component = \"x\"")
        + &output("a", "quantity = \"acceleration\"; of = \"cart\"; component = \"x\"")
}

fn element(kind: &str, name: &str, type_name: &str, factor: f64, more: &str) -> String {
    let bodies = if kind == "control" { "" } else { "bodies = [\"ground\", \"cart\"]\n" };
    format!(
        "[[{kind}]]\nname = \"{name}\"\ntype = \"{type_name}\"\n{bodies}params.factor = {factor:?}\n{}\n",
        more.replace("; ", "\n")
    )
}

#[test]
fn a_force_that_takes_a_position_is_a_spring() {
    for push in ["push", "opaque-push"] {
        let text = cart("t_end = 2; output_step = 0.05", 1.0)
            + &element("control", "turned", "amplifier", -1.0, "inputs = { in = \"x\", bias = 0.5 }")
            + &element("force", "spring", push, 50.0, "inputs.signal = \"turned.out\"")
            + &output("f", "quantity = \"value\"; of = \"spring\"")
            + &output("bias", "quantity = \"value\"; of = \"turned\"; channel = \"bias\"");
        let report = run(&text);
        // 2 x'' = 50 (0.5 - x): w = 5, about 0.5.
        let x = |t: f64| 0.5 - 0.5 * (5.0 * t).cos() + 0.2 * (5.0 * t).sin();
        assert!(off(&report, "x", x) < 1e-9, "{push}");
        assert!(off(&report, "f", |t| 50.0 * (0.5 - x(t))) < 1e-7);
        assert!(off(&report, "bias", |_| 0.5) == 0.0);
        assert_eq!(report.summary.coupling_iterations, 0, "positions are known");
    }
}

#[test]
fn a_force_that_takes_the_acceleration_is_added_mass() {
    for engine in ["interpreted", "reference"] {
        let text = cart(&format!("t_end = 1; output_step = 0.1; engine = \"{engine}\""), 0.0)
            + &element("force", "constant", "push", 6.0, "inputs.signal = 1")
            + &element("force", "mass", "push", -1.0, "inputs.signal = \"a\"");
        let report = run(&text);
        // (2 + 1) a = 6.
        assert!(off(&report, "a", |_| 2.0) < 1e-12, "{engine}");
        assert!(off(&report, "x", |t| t * t) < 1e-11);
        assert!(report.summary.coupling_iterations > 0);
    }
}

#[test]
fn friction_grows_with_the_reaction_it_reads() {
    // The side force is the weight, and friction takes a lever of nothing: v' = -mu g until standstill.
    for (rub, engine) in [("rub", "interpreted"), ("opaque-rub", "interpreted"), ("rub", "reference")] {
        let keys = format!("gravity = [0, -10, 0]; t_end = 0.4; output_step = 0.05; engine = \"{engine}\"");
        let text = cart(&keys, 2.0)
            + "[[force]]\nname = \"friction\"\ntype = \"TYPE\"\njoints = [\"rail\"]\nparams.factor = 0.3\n"
                .replace("TYPE", rub)
                .as_str()
            + &output("n", "quantity = \"value\"; of = \"friction\"")
            + &output("left", "quantity = \"balance_force\"; of = \"cart\"; component = \"x\"")
            + &output("turning", "quantity = \"balance_torque\"; of = \"cart\"; component = \"z\"");
        let report = run(&text);
        assert!(off(&report, "v", |t| 2.0 - 3.0 * t) < 1e-10, "{rub}, {engine}");
        assert!(off(&report, "n", |_| 20.0) < 1e-9);
        assert!(off(&report, "left", |_| 0.0) < 1e-12 && off(&report, "turning", |_| 0.0) < 1e-12);
        assert!(report.summary.audit.energy_error_relative < 1e-9, "{:?}", report.summary.audit);
    }
}

#[test]
fn a_smoothed_signal_lags_by_its_time_constant() {
    for smoother in ["smoother", "opaque-smoother"] {
        let text = cart("t_end = 1; output_step = 0.05", 1.0)
            + &element("control", "slow", smoother, 0.2, "inputs.in = \"x\"")
            + &output("lagging", "quantity = \"value\"; of = \"slow\"");
        // 0.2 y' = t - y, y(0) = 0.
        assert!(off(&run(&text), "lagging", |t| t - 0.2 + 0.2 * (-5.0 * t).exp()) < 1e-9, "{smoother}");
    }
}

#[test]
fn opaque_elements_may_feed_opaque_elements() {
    let text = |push: &str, smoother: &str| {
        cart("t_end = 1; output_step = 0.1", 1.0)
            + &element("control", "slow", smoother, 0.2, "inputs.in = \"x\"")
            + &element("force", "back", push, -20.0, "inputs.signal = \"slow.out\"")
            + &element("force", "again", push, 0.5, "inputs.signal = \"back.force\"")
    };
    let (traced, opaque) = (run(&text("push", "smoother")), run(&text("opaque-push", "opaque-smoother")));
    for (a, b) in column(&traced, "x").iter().zip(column(&opaque, "x")) {
        assert!((a - b).abs() < 1e-13);
    }
}

#[test]
fn elements_may_be_written_before_what_they_take() {
    let push = element("force", "spring", "push", 50.0, "inputs.signal = \"b.out\"");
    let a = element("control", "a", "amplifier", -1.0, "inputs.in = \"x\"");
    let b = element("control", "b", "amplifier", 2.0, "inputs.in = \"a.out\"");
    let first = cart("t_end = 1; output_step = 0.1", 1.0);
    let (forth, back) = (run(&(first.clone() + &push + &a + &b)), run(&(first + &push + &b + &a)));
    assert!(off(&forth, "x", |t| 0.1 * 2.0_f64.sqrt() * (50.0_f64.sqrt() * t).sin()) < 1e-9);
    assert_eq!(column(&forth, "x"), column(&back, "x"));
}

/// The messages about a scene that must be refused.
#[track_caller]
fn refused(more: &str) -> String {
    let text = cart("t_end = 1; output_step = 0.1", 1.0) + more;
    let result = Session::with_catalog(scene(&text), Vec::new(), &catalog(), &RunOptions::default());
    result.err().unwrap_or_else(|| panic!("accepted")).to_string()
}

#[test]
fn connections_that_make_no_sense_are_named() {
    let push = |inputs: &str| element("force", "f", "push", 1.0, inputs);
    for (more, expected) in [
        (push(""), "nothing is connected to the input `signal` of `f`"),
        (push("inputs.signal = \"y\""), "there is no signal `y`"),
        (push("inputs.signal = \"rail.angle\""), "`rail` (slide) has no channel `angle`"),
        (push("inputs = { signal = 1, sgnal = 2 }"), "unknown input `sgnal` for `push`"),
        (push("inputs.signal = 1; joints = [\"rail\"]"), "`f` names 1 joints, `push` takes the reactions of 0"),
        (element("force", "f", "rub", 1.0, "joints = [\"rial\"]"), "there is no joint `rial`"),
        (element("force", "f", "rub", 1.0, ""), "`f` names 0 joints, `rub` takes the reactions of 1"),
        (element("control", "c", "smoother", 1.0, "inputs.in = \"v\""), "expected a length, found a velocity"),
        (
            element("control", "a", "amplifier", 1.0, "inputs.in = \"b.out\"")
                + &element("control", "b", "amplifier", 1.0, "inputs.in = \"a.out\""),
            "the signal of `a` depends on itself",
        ),
    ] {
        let found = refused(&more);
        assert!(found.contains(expected), "{expected}\n{found}");
    }
}

#[test]
fn a_loop_through_an_output_that_does_not_depend_on_it_is_none() {
    let text = cart("t_end = 0.1; output_step = 0.1", 1.0)
        + &element("control", "a", "amplifier", 1.0, "inputs = { in = \"b.bias\", bias = 3 }")
        + &element("control", "b", "amplifier", 1.0, "inputs = { in = \"a.out\", bias = 4 }")
        + &output("seven", "quantity = \"value\"; of = \"a\"; channel = \"out\"");
    assert!(off(&run(&text), "seven", |_| 7.0) == 0.0);
}

#[test]
fn forces_without_a_common_solution_are_reported_as_such() {
    // -2 a on 2 kg: (2 - 2) a = 6.
    let text = cart("t_end = 1; output_step = 0.1", 0.0)
        + &element("force", "constant", "push", 6.0, "inputs.signal = 1")
        + &element("force", "mass", "push", 2.0, "inputs.signal = \"a\"");
    let error = open(&text).run(None, Box::new(|_| ()), &Arc::default()).err().map(|e| e.to_string());
    let error = error.unwrap_or_default();
    for words in ["depend on reactions or accelerations", "`mass` takes `a`", "change a gain"] {
        assert!(error.contains(words), "{words}: {error}");
    }
}

/// A spring stores what its force takes, whatever moves its other end: a dashpot inside it, time, or a signal, which may be measured
/// from the motion itself.
#[test]
fn energies_balance_whatever_moves_the_end_of_a_spring() {
    let spring = |kind: &str, more: &str| {
        format!(
            "[[force]]\nname = \"spring\"\ntype = \"{kind}\"\nbodies = [\"ground\", \"cart\"]\npoint = [0, 0, 0]\n{more}\n"
        )
    };
    let smoothed = element("control", "lagging", "smoother", 0.3, "inputs.in = \"x\"");
    let at_once = element("control", "turned", "amplifier", -0.4, "inputs.in = \"x\"");
    let from_speed = element("control", "turned", "amplifier", -0.1, "inputs.in = \"v\"");
    let clock = element("control", "turned", "smoother", 0.5, "inputs.in = 0.7");
    let speed = at_once.replace("turned", "speedy").replace("\"x\"", "\"lagging.out\"");
    for (case, text) in [
        ("a dashpot", spring("maxwell", "")),
        ("time", spring("shaken", "")),
        ("a state elsewhere", clock + &spring("pulled", "inputs.end = \"turned.out\"")),
        ("a state that follows", smoothed.clone() + &spring("pulled", "inputs.end = \"lagging.out\"")),
        ("a state that follows, turned", smoothed + &speed + &spring("pulled", "inputs.end = \"speedy.out\"")),
        ("the position", at_once + &spring("pulled", "inputs.end = \"turned.out\"")),
        ("the speed", from_speed + &spring("pulled", "inputs.end = \"turned.out\"")),
    ] {
        for engine in ["interpreted", "reference"] {
            let report = run(&(cart(&format!("t_end = 3; output_step = 0.1; engine = \"{engine}\""), 1.0) + &text));
            let audit = &report.summary.audit;
            assert!(audit.energy_error_relative < 1e-8, "{case}, {engine}: {audit:?}");
            assert_eq!(report.summary.status, Status::Completed, "{case}: {}", report.summary.reason);
            assert!(case == "the position" || audit.work.abs() > 1e-2, "{case}: {audit:?}");
        }
    }
    let report = run(&(cart("t_end = 3; output_step = 0.1", 1.0) + &spring("maxwell", "")));
    let audit = &report.summary.audit;
    assert!((audit.dissipated + audit.work).abs() < 1e-12 && audit.work_in == 0.0, "all work is heat: {audit:?}");
}
