//! Internal unknowns: contact points on ellipses, by every formulation and method.

use std::f64::consts::PI;

use odyn::session::{RunReport, Session};

use crate::support::{Scratch, column, difference, options};

fn try_run(text: &str, sets: &[&str]) -> Result<RunReport, String> {
    let scratch = Scratch::new();
    let path = scratch.file("scene.toml", text);
    let session = Session::open(&path, &options(sets, &[])).map_err(|error| error.to_string())?;
    session.run(None, Box::new(|_| ()), &Default::default()).map_err(|error| error.to_string())
}

/// An elliptic cam that turns freely under an elliptic roller on a spring.
fn cam(contact: &str) -> String {
    format!(
        r#"
[plugins]
libraries = ["odyn-joints", "odyn-forces"]
[simulation]
gravity = [-9.81, 0, 0]
t_end = 1
output_step = 0.05
tolerance = 1e-10
[[body]]
name = "cam"
mass = 1
inertia = [0.01, 0.01, 0.02]
position = [0, 0, 0]
angular_velocity = [0, 0, 7]
[[body]]
name = "rod"
mass = 0.5
inertia = [0.01, 0.01, 0.01]
position = [0.17, 0.1, 0]
[[body]]
name = "roller"
mass = 0.5
inertia = [0.01, 0.01, 0.01]
position = [0.17, 0, 0]
[[joint]]
name = "shaft"
type = "revolute"
bodies = ["ground", "cam"]
point = [0, 0, 0]
axis = [0, 0, 1]
[[joint]]
name = "guide"
type = "translational"
bodies = ["ground", "rod"]
point = [0.17, 0.1, 0]
axis = [1, 0, 0]
[[joint]]
name = "hinge"
type = "revolute"
bodies = ["rod", "roller"]
point = [0.17, 0, 0]
axis = [0, 0, 1]
[[joint]]
name = "contact"
bodies = ["cam", "roller"]
points = [[0.01, 0, 0], [0.17, 0, 0]]
{contact}
[[force]]
name = "spring"
type = "translational-spring-damper"
bodies = ["ground", "roller"]
points = [[0.4, 0, 0], [0.17, 0.03, 0]]
params.stiffness = 400
params.free_length = 0.3
[[output]]
name = "x"
quantity = "position"
of = "rod"
component = "x"
[[output]]
name = "w"
quantity = "angular_velocity"
of = "roller"
component = "z"
[[output]]
name = "F"
quantity = "reaction_force"
of = "contact"
on = "roller"
component = "x"
"#
    )
}

fn ellipses(a_i: f64, b_i: f64, a_j: f64, b_j: f64) -> String {
    cam(&format!(
        "type = \"ellipse-contact\"\nparams.a_i = {a_i}\nparams.b_i = {b_i}\nparams.a_j = {a_j}\nparams.b_j = {b_j}"
    ))
}

#[track_caller]
fn agree(first: &RunReport, other: &RunReport, tolerance: f64, what: &str) {
    for (channel, (a, b)) in first.channels.iter().zip(first.columns.iter().zip(&other.columns)) {
        let off = difference(a, b);
        assert!(off < tolerance, "{what}: `{}` differs by {off:.1e}", channel.name);
    }
}

#[test]
fn every_formulation_and_method_gives_the_motion_of_ellipses_that_touch() {
    let text = ellipses(0.1, 0.07, 0.06, 0.04);
    let first = try_run(&text, &[]).unwrap();
    assert_eq!(first.exit_code(), 0, "{}", first.summary.reason);
    for sets in [
        &["simulation.formulation=\"cartesian\""][..],
        &["simulation.method=\"radau5\""],
        &["simulation.engine=\"reference\""],
        &["simulation.engine=\"interpreted\""],
        &["simulation.method=\"dopri5\""],
        &["simulation.formulation=\"cartesian\"", "simulation.method=\"radau5\""],
    ] {
        let other = try_run(&text, sets).unwrap();
        assert_eq!(other.exit_code(), 0, "{sets:?} {}", other.summary.reason);
        agree(&first, &other, 1e-7, &format!("{sets:?}"));
    }
}

#[test]
fn circles_that_touch_are_a_rod_between_their_centres() {
    let circles = try_run(&ellipses(0.1, 0.1, 0.06, 0.06), &[]).unwrap();
    let rod = try_run(&cam("type = \"distance-rod\"\nparams.length = 0.16"), &[]).unwrap();
    agree(&circles, &rod, 1e-8, "rod");
}

#[test]
fn a_start_without_a_contact_names_element_and_unknown() {
    // Every point of a circle is as near to the centre of another one about it.
    let text = ellipses(0.1, 0.1, 0.06, 0.06).replace("points = [[0.01, 0, 0]", "points = [[0.17, 0, 0]");
    let error = try_run(&text, &[]).map(|report| report.summary.reason).unwrap_err();
    assert!(error.contains("`contact`: its internal unknown `"), "{error}");
}

/// A flat tappet that a force holds on an eccentric, on a side of it.
fn tappet(length: &str, side: f64, start: &str) -> String {
    format!(
        r#"
[plugins]
libraries = ["odyn-joints", "odyn-forces"]
[units]
length = "{length}"
[parameters]
R = "18 mm"
e = "5 mm"
w = "20 rad/s"
d = {side}
[simulation]
gravity = [0, 0, 0]
t_end = 0.2
output_step = 0.02
[[body]]
name = "cam"
mass = 1
inertia = ["1e-3 kg m^2", "1e-3 kg m^2", "1e-3 kg m^2"]
[[body]]
name = "tappet"
mass = 0.12
inertia = ["1e-4 kg m^2", "1e-4 kg m^2", "1e-4 kg m^2"]
position = ["(R + e * cos(d)) * cos(d)", "(R + e * cos(d)) * sin(d)", 0]
velocity = ["e * w * sin(d) * cos(d)", "e * w * sin(d)^2", 0]
[[joint]]
name = "shaft"
type = "revolute"
bodies = ["ground", "cam"]
axis = [0, 0, 1]
[[joint]]
name = "drive"
type = "rotation-driver"
bodies = ["ground", "cam"]
axis = [0, 0, 1]
params.angle = "w * t"
[[joint]]
name = "guide"
type = "translational"
bodies = ["ground", "tappet"]
axis = ["cos(d)", "sin(d)", 0]
[[joint]]
name = "contact"
type = "profile-contact"
bodies = ["cam", "tappet"]
points = [[0, 0, 0], ["(R + e * cos(d)) * cos(d)", "(R + e * cos(d)) * sin(d)", 0]]
axis = [0, 0, 1]
x_axes = [[1, 0, 0], ["cos(d)", "sin(d)", 0]]
params = {{ radius = "e * cos(phi) + sqrt(R^2 - e^2 * sin(phi)^2)", follower = "flat", unilateral = true{start} }}
[[force]]
name = "spring"
type = "translational-actuator"
bodies = ["ground", "tappet"]
axis = ["cos(d)", "sin(d)", 0]
params = {{ along = "axis", of_length = "-10 N" }}
[[output]]
name = "x"
quantity = "position"
of = "tappet"
component = "x"
[[output]]
name = "y"
quantity = "position"
of = "tappet"
component = "y"
"#
    )
}

#[test]
fn a_flat_tappet_follows_the_near_side_of_its_cam_from_any_start() {
    for (unit, length) in [(1.0, "m"), (1e3, "mm")] {
        for (side, start) in
            [(0.5 * PI, ""), (0.5 * PI, ", start = -0.2"), (0.0, ", start = 3"), (-2.0, ""), (2.5, ", start = -1")]
        {
            let report = try_run(&tappet(length, side, start), &[]).unwrap();
            assert_eq!(report.exit_code(), 0, "{side}{start}: {}", report.summary.reason);
            let last = |k: usize| *report.columns[k].last().unwrap() / unit;
            let lift = 0.018 + 0.005 * (4.0 - side).cos();
            let off = (last(0) - lift * side.cos()).hypot(last(1) - lift * side.sin());
            assert!(off < 1e-9, "{length}, {side}{start}: off by {off:e} m");
        }
    }
}

#[test]
fn ellipses_strike_on_every_side_from_the_starts_that_nobody_gave() {
    for quarter in 0..4 {
        let side = 0.5 * PI * f64::from(quarter);
        let text = format!(
            r#"
[plugins]
libraries = ["odyn-joints"]
[simulation]
gravity = [0, 0, 0]
t_end = 1
output_step = 0.1
[[body]]
name = "disc"
mass = 1
inertia = [1, 1, 1]
position = ["0.3 * cos({side})", "0.3 * sin({side})", 0]
velocity = ["-0.6 * cos({side})", "-0.6 * sin({side})", 0]
[[joint]]
name = "plane"
type = "planar"
bodies = ["ground", "disc"]
[[joint]]
name = "contact"
type = "ellipse-contact"
bodies = ["ground", "disc"]
points = [[0, 0, 0], ["0.3 * cos({side})", "0.3 * sin({side})", 0]]
axis = [0, 0, 1]
x_axis = [1, 0, 0]
params = {{ a_i = 0.1, b_i = 0.08, a_j = 0.1, b_j = 0.08, unilateral = true, restitution = 0.5 }}
[[output]]
name = "x"
quantity = "position"
of = "disc"
component = "x"
[[output]]
name = "y"
quantity = "position"
of = "disc"
component = "y"
"#
        );
        let report = try_run(&text, &[]).unwrap();
        assert_eq!(report.exit_code(), 0, "{side}: {}", report.summary.reason);
        let last = |k: usize| *report.columns[k].last().unwrap();
        let touching = if quarter % 2 == 0 { 0.2 } else { 0.16 };
        let end = touching + 0.3 * (1.0 - (0.3 - touching) / 0.6);
        let off = (last(0) - end * side.cos()).hypot(last(1) - end * side.sin());
        assert!(off < 1e-9, "{side}: off by {off:e} m");
    }
}

/// A disc that starts at the top of a profile in the x-y plane, along which the joint guides it.
fn disc(name: &str, height: f64, speed: f64, settings: &str, joint: &str) -> String {
    format!(
        r#"
[plugins]
libraries = ["odyn-joints"]
[simulation]
gravity = [0, -9.81, 0]
{settings}
[[body]]
name = "{name}"
mass = 1
inertia = [0.01, 0.01, 0.01]
position = [0, {height}, 0]
velocity = [{speed:?}, 0, 0]
[[joint]]
name = "plane"
type = "planar"
bodies = ["ground", "{name}"]
axis = [0, 0, 1]
[[joint]]
bodies = ["ground", "{name}"]
points = [[0, 0, 0], [0, {height}, 0]]
{joint}
[[output]]
name = "x"
quantity = "position"
of = "{name}"
component = "x"
"#
    )
}

/// A wheel that slides down a slope and over its end, or what is behind `from`.
fn rail(ends: &str) -> String {
    let joint = format!(
        "name = \"rail\"\ntype = \"rail-contact\"\nparams.height = \"cos(x)\"\nparams.wheel_radius = 0.1\n{ends}"
    );
    disc("wheel", 1.1, 0.5, "t_end = 2\noutput_step = 0.05", &joint)
        + "[[output]]\nname = \"place\"\nquantity = \"coordinate\"\nof = \"rail\"\nchannel = \"place\"\n"
}

#[test]
fn a_wheel_that_leaves_its_profile_ends_the_run_with_the_name_of_the_rail() {
    for (ends, sign) in [("params.from = -1\nparams.to = 0.6", 1.0), ("params.from = -0.6\nparams.to = 1", -1.0)] {
        let text = rail(ends).replace("[0.5, 0, 0]", &format!("[{:?}, 0, 0]", 0.5 * sign));
        for sets in [
            &[][..],
            &["simulation.formulation=\"cartesian\""],
            &["simulation.method=\"radau5\""],
            &["simulation.method=\"rk4\"", "simulation.fixed_step=0.001"],
        ] {
            let report = try_run(&text, sets).unwrap();
            let reason = &report.summary.reason;
            assert_ne!(report.exit_code(), 0, "{sets:?}: {reason}");
            assert!(reason.contains("`rail`") && reason.contains("`place`"), "{sets:?}: {reason}");
            let last = *report.columns[1].last().unwrap();
            assert!(sign * last > 0.4 && sign * last <= 0.6, "{sets:?}: {last}");
        }
    }
}

/// A disc that is thrown from the top of a profile, and may part from it.
fn thrown(speed: f64, end: f64, radius: f64, top: f64, contact: &str) -> String {
    let joint = format!("name = \"contact\"\nparams.unilateral = true\n{contact}");
    disc("disc", top + radius, speed, &format!("t_end = {end}\noutput_step = 0.002"), &joint)
        + "[[output]]\nname = \"y\"\nquantity = \"position\"\nof = \"disc\"\ncomponent = \"y\"\n"
}

/// Runs a disc that is thrown, in several ways: it parts from its profile, lands on it, and is never in it. `profile` gives points all
/// along it, `is_inside` whether its material is there.
fn stays_outside(text: &str, radius: f64, profile: &[[f64; 2]], is_inside: impl Fn(f64, f64) -> bool) {
    for sets in [&[][..], &["simulation.formulation=\"cartesian\""], &["simulation.method=\"radau5\""]] {
        let report = try_run(text, sets).unwrap();
        assert_eq!(report.exit_code(), 0, "{sets:?}: {}", report.summary.reason);
        let (mut parted, mut landed) = (false, false);
        for (t, (x, y)) in report.times.iter().zip(report.columns[0].iter().zip(&report.columns[1])) {
            let nearest = profile.iter().map(|[a, b]| (x - a).hypot(y - b)).fold(f64::INFINITY, f64::min);
            let gap = if is_inside(*x, *y) { -nearest } else { nearest } - radius;
            assert!(gap > -1e-6, "{sets:?}: {gap:e} inside at t = {t}");
            parted |= gap > 0.02;
            landed |= parted && gap < 1e-6;
        }
        assert!(landed, "{sets:?}: does not part and land");
    }
}

/// The nearest place on the hill that it comes from is not where it lands.
#[test]
fn a_wheel_that_jumps_over_a_valley_lands_on_its_other_side() {
    let height = |x: f64| (2.5 * x).cos();
    let profile: Vec<[f64; 2]> = (0..20_000).map(|k| f64::from(k) * 2e-4 - 1.0).map(|x| [x, height(x)]).collect();
    for (speed, end) in [(4.0, 0.5), (5.0, 0.44), (6.0, 0.36)] {
        let contact = "type = \"rail-contact\"\nparams.height = \"cos(2.5 x)\"\nparams.wheel_radius = 0.1\n\
                       params.from = -3\nparams.to = 9";
        stays_outside(&thrown(speed, end, 0.1, 1.0, contact), 0.1, &profile, |x, y| y < height(x));
    }
}

#[test]
fn a_roller_that_jumps_off_a_cam_lands_on_its_next_lobe() {
    let radius = |phi: f64| 0.3 + 0.1 * (3.0 * phi).sin();
    let place = |k: u32| f64::from(k) * std::f64::consts::TAU / 2e4;
    let profile: Vec<[f64; 2]> =
        (0..20_000).map(place).map(|phi| [radius(phi) * phi.cos(), radius(phi) * phi.sin()]).collect();
    let turned = |x: f64, y: f64| x.hypot(y) < radius(y.atan2(x));
    let top = -std::f64::consts::FRAC_PI_2;
    assert!((radius(top) - 0.4).abs() < 1e-15);
    for speed in [0.1, 0.15, 0.2, 0.3] {
        // The profile upside down, so that a lobe is on top.
        let contact = "type = \"profile-contact\"\nx_axis = [-1, 0, 0]\nparams.radius = \"0.3 + 0.1 sin(3 phi)\"\n\
                       params.roller_radius = 0.02\nparams.start = \"-90 deg\"";
        let text = thrown(speed, 0.6, 0.02, 0.4, contact);
        let above: Vec<[f64; 2]> = profile.iter().map(|[x, y]| [-x, -y]).collect();
        stays_outside(&text, 0.02, &above, |x, y| turned(-x, -y));
    }
}

/// A rigid body that swings about a spherical joint, with a hydraulic damper whose first end is at its centre: the damper keeps its
/// length.
fn rigid_damper(passages: &str) -> String {
    format!(
        r#"
[plugins]
libraries = ["odyn-joints", "odyn-forces"]
[simulation]
gravity = [1, -9.81, 0.3]
t_end = 1
output_step = 0.1
[[body]]
name = "body"
mass = 1
inertia = [1, 1.3, 1.7]
position = [0.5, 0.1, 0.2]
angular_velocity = [1, 2, 0.4]
[[joint]]
name = "pivot"
type = "spherical"
bodies = ["ground", "body"]
point = [0.1, 0.3, -0.7]
[[force]]
name = "damper"
type = "hydraulic-damper"
bodies = ["ground", "body"]
points = [[0.1, 0.3, -0.7], [0.55, 0.23, 0.1]]
{passages}
[[output]]
name = "flow"
quantity = "value"
of = "damper"
channel = "flow_1"
[[output]]
name = "x"
quantity = "position"
of = "body"
component = "x"
[[output]]
name = "y"
quantity = "position"
of = "body"
component = "y"
"#
    )
}

#[test]
fn nothing_flows_in_a_damper_that_keeps_its_length() {
    let passages = [
        "params.area = 1\nparams.laminar_1 = 1\nparams.turbulent_1 = 4\nparams.laminar_2 = 2",
        "params.area = 1\nparams.turbulent_1 = 4\nparams.laminar_2 = 2",
        "params.area = 1e-3\nparams.turbulent_1 = 4e12\nparams.laminar_2 = 1e10",
    ];
    let text = rigid_damper(passages[0]);
    let free = text.replace("params.area = 1\n", "params.area = 1e-9\n");
    let reference = try_run(&free, &["simulation.tolerance=1e-10"]).unwrap();
    for passages in passages {
        for set in ["dop853", "dopri5", "auto"].map(|method| format!("simulation.method=\"{method}\"")) {
            for formulation in ["cartesian", "joint"] {
                let sets = [&set, &format!("simulation.formulation=\"{formulation}\""), "simulation.max_steps=20000"];
                let what = format!("{set} {formulation} {passages}");
                let run = try_run(&rigid_damper(passages), &sets).unwrap_or_else(|error| panic!("{what}: {error}"));
                agree(&reference, &run, 1e-6, &what);
            }
        }
    }
}

#[test]
fn a_damper_that_keeps_its_length_starts_from_rest() {
    let passages = "params.area = 0.738\nparams.laminar_1 = 1.8e-6\nparams.turbulent_1 = 9.5\nparams.laminar_2 = 0.062\n\
                    params.turbulent_2 = 0.325";
    let at_rest = rigid_damper(passages).replace("angular_velocity = [1, 2, 0.4]", "");
    let free = at_rest.replace("params.area = 0.738\n", "params.area = 1e-9\n");
    let reference = try_run(&free, &["simulation.tolerance=1e-10"]).unwrap();
    for method in ["dop853", "dopri5", "radau5"] {
        let run = try_run(&at_rest, &[&format!("simulation.method=\"{method}\"")]).unwrap();
        agree(&reference, &run, 1e-5, method);
    }
}

/// A mass that falls from rest on two orifices, whose resistance is that of one of k = (k_1^-1/2 + k_2^-1/2)^-2: its speed is
/// w tanh(g t / w), w^2 = m g / (k A^3).
#[test]
fn orifices_alone_share_the_flow_from_rest_on() {
    let (mass, area, first, second): (f64, f64, f64, f64) = (3.0, 1e-3, 4e9, 9e9);
    let one = (first.sqrt().recip() + second.sqrt().recip()).powi(-2);
    let limit = (mass * 9.81 / (one * area.powi(3))).sqrt();
    let text = format!(
        r#"
[plugins]
libraries = ["odyn-joints", "odyn-forces"]
[simulation]
gravity = [9.81, 0, 0]
t_end = 2
output_step = 0.1
[[body]]
name = "body"
mass = {mass}
inertia = [1, 1, 1]
position = [0.5, 0, 0]
[[joint]]
name = "guide"
type = "translational"
bodies = ["ground", "body"]
axis = [1, 0, 0]
[[force]]
name = "damper"
type = "hydraulic-damper"
bodies = ["ground", "body"]
points = [[0, 0, 0], [0.5, 0, 0]]
params.area = {area}
params.turbulent_1 = {first}
params.turbulent_2 = {second}
[[output]]
name = "v"
quantity = "velocity"
of = "body"
component = "x"
"#
    );
    for method in ["dop853", "radau5"] {
        let set = format!("simulation.method=\"{method}\"");
        let run = try_run(&text, &[&set]).unwrap_or_else(|error| panic!("{method}: {error}"));
        for (t, v) in run.times.iter().zip(&run.columns[0]) {
            let expected = limit * (9.81 * t / limit).tanh();
            assert!((v - expected).abs() < 1e-6 * limit, "{method}: {v} is not {expected} at {t}");
        }
    }
}

/// A mass that falls from rest on two pipes, whose resistance is that of one of r = 1 / (1 / r_1 + 1 / r_2): its speed is
/// w (1 - exp(-g t / w)), w = m g / (r A^2). Whatever the pipes: the pressure is zero at the start, and has no size of its own there.
#[test]
fn pipes_alone_share_the_flow_from_rest_on() {
    let area = 1e-2;
    for step in 0..40 {
        let (first, second) = (1e3 * 1.37_f64.powi(step % 9), 1e4 * 0.81_f64.powi(step));
        let limit = 9.81 * (first.recip() + second.recip()) / (area * area);
        let text = format!(
            "[plugins]\nlibraries = [\"odyn-joints\", \"odyn-forces\"]\n[simulation]\ngravity = [9.81, 0, 0]\nt_end = 0.3\n\
             output_step = 0.1\n[[body]]\nname = \"body\"\nmass = 1\ninertia = [1, 1, 1]\nposition = [0.5, 0, 0]\n[[force]]\n\
             name = \"damper\"\ntype = \"hydraulic-damper\"\nbodies = [\"ground\", \"body\"]\npoints = [[0, 0, 0], [0.5, 0, 0]]\n\
             params.area = {area}\nparams.laminar_1 = {first}\nparams.laminar_2 = {second}\n[[output]]\nname = \"v\"\n\
             quantity = \"velocity\"\nof = \"body\"\ncomponent = \"x\"\n"
        );
        let run = try_run(&text, &[]).unwrap_or_else(|error| panic!("{first}, {second}: {error}"));
        for (t, v) in run.times.iter().zip(&run.columns[0]) {
            let expected = -limit * (-9.81 * t / limit).exp_m1();
            assert!((v - expected).abs() < 1e-8 * expected.max(1.0), "{first}, {second}: {v} is not {expected} at {t}");
        }
    }
}

/// A mass that passes the anchor of what acts along the line between them.
#[test]
fn points_that_meet_are_named_where_a_run_ends() {
    let scene = |element: &str| {
        format!(
            r#"
[plugins]
libraries = ["odyn-joints", "odyn-forces"]
[units]
time = "ms"
[simulation]
gravity = [0, 0, 0]
t_end = "1 s"
output_step = "0.1 s"
[[body]]
name = "mass"
mass = 1
inertia = [1, 1, 1]
position = [0.5, 0, 0]
velocity = ["-3 m/s", 0, 0]
[[joint]]
name = "guide"
type = "translational"
bodies = ["ground", "mass"]
axis = [1, 0, 0]
[[force]]
name = "line"
bodies = ["ground", "mass"]
points = [[0, 0, 0], [0.5, 0, 0]]
{element}
"#
        )
    };
    let damper = "type = \"hydraulic-damper\"\nparams.area = \"1 cm^2\"\nparams.laminar_1 = \"1e6 Pa s/m^3\"\n\
                  params.turbulent_1 = \"4e10 kg/m^7\"\nparams.laminar_2 = \"2e7 Pa s/m^3\"";
    let gravity = "type = \"point-gravity\"\nparams.gravitational_parameter = \"1 m^3/s^2\"\nparams.mass = 1";
    for (element, time) in [(damper, "167.54"), (gravity, "127.836")] {
        for method in ["dop853", "radau5"] {
            let run = try_run(&scene(element), &[&format!("simulation.method=\"{method}\"")]).unwrap();
            let said = format!("the points of `line` on the ground and `mass` are together at t = {time}");
            assert!(run.summary.reason.contains(&said), "{method}: {}", run.summary.reason);
            assert!(run.summary.reason.contains("put one of them further out"), "{}", run.summary.reason);
        }
    }
    let further_out = scene(damper).replace("[[0, 0, 0], [0.5", "[[-9, 0, 0], [0.5");
    assert_eq!(try_run(&further_out, &[]).unwrap().exit_code(), 0);
    let start = scene(damper).replace("position = [0.5", "position = [0").replace("0], [0.5", "0], [0");
    let refused = try_run(&start, &[]).err().unwrap();
    assert!(refused.contains("two of its points lie together"), "{refused}");
}

/// The first step of an explicit method where a state begins with next to nothing: no step was short enough.
#[test]
fn a_start_with_unknowns_that_are_next_to_zero_has_a_first_step() {
    let text = "[plugins]\nlibraries = [\"joints\", \"forces\"]\n[simulation]\ngravity = [50, 0, 0]\nt_end = 1e-3\noutput_step = 1e-4\n\
        [[body]]\nname = \"body\"\nmass = 1\ninertia = [1e-12, 1e-12, 1e-12]\n\
        [[joint]]\nname = \"guide\"\ntype = \"translational\"\nbodies = [\"ground\", \"body\"]\naxis = [1, 0, 0]\n\
        [[force]]\nname = \"piston\"\ntype = \"hydraulic-damper\"\nbodies = [\"ground\", \"body\"]\n\
        points = [[-1e-5, 0, 0], [0, 0, 0]]\nparams = { area = 1e-12, laminar_1 = 1e26, laminar_2 = 1e26 }\n\
        [[output]]\nname = \"x\"\nquantity = \"position\"\nof = \"body\"\ncomponent = \"x\"\n";
    let run = try_run(text, &[]).unwrap();
    // A damping of 50 kg/s.
    let (t, rate) = (1e-3, 50.0_f64);
    let exact = t - (1.0 - (-rate * t).exp()) / rate;
    let off = run.columns[0].last().unwrap() / exact - 1.0;
    assert!(off.abs() < 1e-6 && run.summary.steps < 50, "{off:e} {}", run.summary.steps);
}

/// A leg that rests against its stop beneath what falls with it: the points do not move against each other but for round-off, whose square is
/// all that the pressure is made of.
#[test]
fn a_damper_of_orifices_between_points_that_fly_together_has_no_pressure() {
    let body = |name: &str, mass: f64, at: [f64; 3]| {
        format!(
            "[[body]]\nname = \"{name}\"\nmass = {mass:?}\nposition = {at:?}\ninertia = [100, 100, 100]\n\
             velocity = [10, 0, -4.090818565826579]\nangular_velocity = [0, 0, 0]\n"
        )
    };
    let guide = |name: &str, kind: &str, params: &str| {
        format!(
            "[[joint]]\nname = \"{name}\"\ntype = \"{kind}\"\nbodies = [\"fus\", \"leg\"]\npoint = [0.3, 0, 1]\naxis = [0.07, 0, 1]\n{params}"
        )
    };
    let text = "[plugins]\nlibraries = [\"odyn-joints\", \"odyn-forces\"]\n\
                [simulation]\ngravity = [0, 0, -10]\nt_end = 0.9\noutput_step = 0.1\n"
        .to_string()
        + &body("fus", 8000.0, [0.6, 0.0, 2.4])
        + &body("leg", 100.0, [0.3, 0.0, 1.0])
        + &guide("oleo", "translational", "")
        + &guide("stop", "translational-stop", "params.lower = 0\n")
        + "[[force]]\nname = \"oil\"\ntype = \"hydraulic-damper\"\nbodies = [\"fus\", \"leg\"]\npoints = [[0.4, 0, 2], [0.3, 0, 1]]\n\
           params = { area = 0.008, turbulent_1 = 2.049e7, turbulent_2 = 1.02e8 }\n\
           [[force]]\nname = \"lift\"\ntype = \"vector-force\"\nbodies = [\"ground\", \"fus\"]\npoints = [[0.6, 0, 2.4], [0.6, 0, 2.4]]\n\
           params = { z = 79951.5 }\n\
           [[output]]\nname = \"p\"\nquantity = \"value\"\nof = \"oil\"\nchannel = \"pressure\"\n";
    for method in ["dop853", "radau5", "auto"] {
        for formulation in ["joint", "cartesian"] {
            let sets = [format!("simulation.method={method}"), format!("simulation.formulation={formulation}")];
            let report = try_run(&text, &[&sets[0], &sets[1]]).unwrap();
            assert!(report.summary.steps < 200, "{method} {formulation}: {}", report.summary.steps);
            let pressure = column(&report, "p").iter().fold(0.0_f64, |most, p| most.max(p.abs()));
            assert!(pressure < 1e-12, "{method} {formulation}: {pressure:e}");
        }
    }
}
