//! What is written in a scene and cannot act is said, and what acts is not.

use odyn::diagnostics::codes;
use odyn::session::{RunOptions, Session};

use crate::support::{Scratch, open_text, options};

/// The scene as `odyn check` opens it.
fn examined(text: &str) -> Session {
    let thorough = RunOptions { thoroughly: true, ..options(&[], &[]) };
    Session::open(&Scratch::new().file("scene.toml", text), &thorough).unwrap_or_else(|error| panic!("{error}"))
}

/// A weight that slides along x and a wheel that turns about z, a signal, and whatever follows.
fn scene(elements: &str) -> String {
    let body = |name: &str| format!("[[body]]\nname = \"{name}\"\nmass = 1\ninertia = [1, 1, 1]\n");
    let joint = |name: &str, kind: &str, body: &str, axis: &str| {
        format!(
            "[[joint]]\nname = \"{name}\"\ntype = \"{kind}\"\nbodies = [\"ground\", \"{body}\"]\npoint = [0, 0, 0]\naxis = {axis}\n"
        )
    };
    "title = \"idle\"\nplugins.libraries = [\"odyn-joints\", \"odyn-forces\", \"odyn-controls\"]\n\
     [simulation]\nt_end = 1\noutput_step = 0.5\n"
        .to_owned()
        + &body("weight")
        + &body("wheel")
        + &joint("slide", "translational", "weight", "[1, 0, 0]")
        + &joint("hinge", "revolute", "wheel", "[0, 0, 1]")
        + "[[control]]\nname = \"wave\"\ntype = \"signal-source\"\nparams.function = \"sin(t)\"\n"
        + elements
}

/// The places of the parameters of `tried` that are said to change nothing.
fn idle(table: &str, keys: &str) -> Vec<String> {
    let session = examined(&scene(&format!("[[{table}]]\nname = \"tried\"\n{}\n", keys.replace("; ", "\n"))));
    let warnings = session.warnings.iter().filter(|warning| warning.code == codes::IDLE_PARAMETER);
    warnings.map(|warning| session.scene.source.text[warning.span().unwrap()].to_owned()).collect()
}

#[test]
fn a_parameter_that_cannot_act_is_warned_of_where_it_stands() {
    let friction = |kind: &str, params: &str| {
        let joint = if kind == "rotation" { "hinge" } else { "slide" };
        format!(
            "type = \"joint-friction\"; joints = [\"{joint}\"]; params = {{ kind = \"{kind}\", mu = 0.3, {params} }}"
        )
    };
    let sensor = |params: &str| format!("type = \"sensor\"; inputs.input = \"wave.output\"; params = {{ {params} }}");
    let pid = |params: &str| {
        format!(
            "type = \"pid\"; inputs = {{ set_point = 1, measured = \"wave.output\" }}; params = {{ kp = 2, {params} }}"
        )
    };
    let actuator = |more: &str| {
        let on = "bodies = [\"ground\", \"weight\"]; axis = [1, 0, 0]; params = { along = \"axis\", of_time = \"t\", gain = 7 }";
        format!("type = \"translational-actuator\"; {on}{more}")
    };
    let sum = |more: &str| {
        format!(
            "type = \"sum\"; inputs = {{ a = 1, b = \"wave.output\"{more} }}; params = {{ gain_b = -2, gain_d = 7 }}"
        )
    };
    let coupler = "type = \"coupler\"; bodies = [\"ground\", \"wheel\", \"ground\", \"weight\"]; \
                   axes = [[0, 0, 1], [0, 0, 1], [1, 0, 0], [1, 0, 0]]; params = { second = \"translation\", lead = 1, ";
    let wheel = "bodies = [\"ground\", \"wheel\"]; axis = [0, 0, 1]; params = { ";
    // What stands for a number, and whether it acts.
    let cases: [(&str, String, &[&str]); 27] = [
        ("force", friction("translation", "thrust_radius = 7"), &["7"]),
        ("force", friction("translation", "guide_length = 7"), &[]),
        ("force", friction("rotation", "radius = 0.1, guide_length = 7"), &["7"]),
        ("force", friction("rotation", "radius = 0.1, thrust_radius = 7"), &[]),
        ("force", friction("translation", "stribeck_speed = 7"), &["7"]),
        ("force", friction("translation", "stribeck_speed = 7, mu_static = 0.3"), &[]),
        ("force", friction("translation", "transition_speed = 7").replace("mu = 0.3", "mu = 0"), &[]),
        ("control", sensor("initial = 7"), &["7"]),
        ("control", sensor("initial = 7, time_constant = 0.1"), &[]),
        ("control", sensor("initial = 7, time_constant = 0"), &[]),
        ("control", sensor("initial = 0"), &[]),
        ("control", sensor("gain = 7, low = -1, high = 1"), &[]),
        ("control", pid("filter_time = 7"), &["7"]),
        ("control", pid("kd = 0, filter_time = 7"), &[]),
        ("control", pid("kd = 1, filter_time = 7"), &[]),
        ("control", pid("ki = 1, tracking_time = 7"), &["7"]),
        ("control", pid("ki = 1, tracking_time = 7, high = 1"), &[]),
        ("control", pid("initial_integral = 7"), &[]),
        ("control", sum(""), &["7"]),
        ("control", sum(", d = \"wave.output\""), &[]),
        ("force", actuator(""), &["7"]),
        ("force", actuator("; inputs.signal = \"wave.output\""), &[]),
        ("joint", format!("{coupler} displacement_offset = 0.1 }}"), &[]),
        ("joint", format!("type = \"rotational-stop\"; {wheel} lower = -1, upper = 1, restitution = 0.5 }}"), &[]),
        ("joint", format!("type = \"clutch\"; {wheel} capacity = 0 }}"), &[]),
        ("force", format!("type = \"rotational-spring-damper\"; {wheel} stiffness = 0, free_angle = 7 }}"), &[]),
        ("force", "type = \"added-mass\"; bodies = [\"weight\"]; params = { apparent_mass = [1, 2, 3], gravity = [0, 0, -7] }".into(), &["[0, 0, -7]"]),
    ];
    for (table, keys, expected) in &cases {
        assert_eq!(idle(table, keys), *expected, "{keys}");
    }
}

#[test]
fn elements_that_are_given_the_same_are_all_warned_of() {
    let meter = |name: &str, more: &str| {
        format!(
            "[[control]]\nname = \"{name}\"\ntype = \"sensor\"\ninputs.input = \"wave.output\"\nparams = {{ initial = 2{more} }}\n\
             [[output]]\nname = \"{name}-shown\"\nquantity = \"value\"\nof = \"{name}\"\nchannel = \"output\"\n"
        )
    };
    let elements = meter("one", "") + &meter("two", "") + &meter("lag", ", time_constant = 1") + &meter("three", "");
    let session = examined(&scene(&elements));
    let said: Vec<&str> = session.warnings.iter().map(|warning| &warning.message[..7]).collect();
    assert_eq!(said, ["`one` d", "`two` d", "`three`"]);
    assert!(session.warnings.iter().all(|warning| warning.code == codes::IDLE_PARAMETER));
    // A run starts sooner.
    assert!(open_text(&scene(&elements), &[]).warnings.is_empty());
}
