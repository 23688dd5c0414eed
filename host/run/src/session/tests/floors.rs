//! States that follow what is zero but for round-off: no step is made for them, and true ones beside them are as good as ever.

use super::*;

/// A chain of three pendulums in the x-z plane; two of its bodies lie askew, so that what is zero across the plane is round-off.
fn pendulums(settings_text: &str) -> String {
    let body = |name: &str, mass: f64, inertia: f64, x: f64, axis: &str| {
        format!(
            "[[body]]\nname = \"{name}\"\nmass = {mass:?}\ninertia = [{inertia:?}, {inertia:?}, {inertia:?}]\n\
             position = [{x:?}, 0, 0.3]\norientation = {{ axis = {axis}, angle = 0.7 }}\n"
        )
    };
    let hinge = |name: &str, i: &str, j: &str, x: f64| {
        format!(
            "[[joint]]\nname = \"{name}\"\ntype = \"hinge\"\nbodies = [\"{i}\", \"{j}\"]\npoint = [{x:?}, 0, 0.3]\n\
             axis = [0, 1, 0]\n"
        )
    };
    settings(&format!("gravity = [0, 0, -9.81]; t_end = 1; output_step = 0.05; max_steps = 5000; {settings_text}"))
        + &body("upper", 1.2, 0.1, 0.25, "[1, 2, 3]")
        + &body("lower", 0.7, 0.05, 0.75, "[3, -2, 1]")
        + "[[body]]\nname = \"straight\"\nmass = 0.1\ninertia = [0.1, 0.1, 0.1]\nposition = [1, 0, 0.3]\n\
           orientation = { axis = [0, 1, 0], angle = 0.4 }\n"
        + &hinge("A", "ground", "upper", 0.0)
        + &hinge("B", "upper", "lower", 0.5)
        + &hinge("C", "lower", "straight", 1.0)
}

/// A quantity, and an element that follows it.
fn followed(name: &str, keys: &str) -> String {
    output(name, keys) + &following(&format!("slow_{name}"), name, 0.05)
}

fn following(name: &str, signal: &str, factor: f64) -> String {
    format!(
        "[[control]]\nname = \"{name}\"\ntype = \"follower\"\nparams.factor = {factor:?}\ninputs.in = \"{signal}\"\n"
    ) + &output(&format!("{name}_read"), &format!("quantity = \"value\"; of = \"{name}\"; channel = \"out\""))
}

/// Across the plane; at the end, in coordinates of bodies, an Euler parameter that stays zero beside others of round-off.
fn nothing(way: &str) -> String {
    let text = followed("force", "quantity = \"reaction_force\"; of = \"A\"; component = \"y\"")
        + &followed("torque", "quantity = \"reaction_torque\"; of = \"B\"; component = \"x\"")
        + &followed("acceleration", "quantity = \"acceleration\"; of = \"lower\"; component = \"y\"")
        + &followed("spin", "quantity = \"angular_acceleration\"; of = \"upper\"; component = \"x\"")
        + &followed("speed", "quantity = \"velocity\"; of = \"lower\"; component = \"y\"")
        + &followed("place", "quantity = \"position\"; of = \"lower\"; component = \"y\"")
        // Round-off is handed on.
        + &following("again", "slow_force.out", 0.1)
        + &following("and_again", "again.out", 0.02);
    let parameter = followed("parameter", "quantity = \"orientation\"; of = \"straight\"; component = \"e1\"");
    if way == "joint" { text } else { text + &parameter }
}

const WAYS: [(&str, &str); 6] = [
    ("joint", "dop853"),
    ("joint", "dopri5"),
    ("joint", "radau5"),
    ("cartesian", "dop853"),
    ("cartesian", "dopri5"),
    ("cartesian", "radau5"),
];

#[track_caller]
fn run_way(text: &str, (formulation, method): (&str, &str)) -> RunReport {
    let keys = format!("max_steps = 5000\nformulation = \"{formulation}\"\nmethod = \"{method}\"");
    run(&text.replace("max_steps = 5000", &keys))
}

#[test]
fn what_follows_nothing_takes_no_steps() {
    for way in WAYS {
        let alone = run_way(&pendulums(""), way).summary;
        let report = run_way(&(pendulums("") + &nothing(way.0)), way);
        let summary = &report.summary;
        assert_eq!(summary.status, Status::Completed, "{way:?}: {}", summary.reason);
        let [before, after] = [&alone, summary].map(|summary| summary.steps + summary.rejected);
        assert!(10 * after <= 13 * before + 50, "{way:?}: {before} {after}");
        let reads = report.channels.iter().zip(&report.columns).filter(|(channel, _)| channel.name.ends_with("_read"));
        for (channel, column) in reads {
            let most = column.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
            assert!(most < 1e-9, "{way:?}: {} reads {most:e}", channel.name);
        }
    }
}

#[test]
fn a_small_state_beside_nothing_is_as_accurate_as_any() {
    // 0.02 x' = size - x
    for way in WAYS {
        for size in [1.0, 1e-9, 1e-15] {
            let text = pendulums("")
                + &nothing(way.0)
                + &format!(
                    "[[control]]\nname = \"source\"\ntype = \"amplifier\"\nparams.factor = {size:?}\ninputs.in = 1\n"
                )
                + &following("small", "source.out", 0.02);
            let report = run_way(&text, way);
            assert_eq!(report.summary.status, Status::Completed, "{way:?}");
            let error = off(&report, "small_read", |t| size * (1.0 - (-t / 0.02).exp())) / size;
            assert!(error < 1e-8, "{way:?}: {error:e} of {size:e}");
        }
    }
}
