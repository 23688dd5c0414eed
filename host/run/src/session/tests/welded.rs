//! Bodies that joints without freedom hold, in all formulations: the same results.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use super::pruning::{apart, in_bodies};
use super::*;
use crate::tests::WELD_STEP;

/// A body frame or a marker on it.
fn frame(position: [f64; 3], axis: [f64; 3], angle: f64) -> Isometry3<f64> {
    let turn = UnitQuaternion::from_axis_angle(&nalgebra::Unit::new_normalize(Vector3::from(axis)), angle);
    Isometry3::from_parts(Translation3::from(Vector3::from(position)), turn)
}

/// The pose of a weld's second frame in its first.
fn pose() -> Isometry3<f64> {
    frame([0.0, 0.0, WELD_STEP], [0.0, 0.0, 1.0], std::f64::consts::FRAC_PI_2)
}

fn numbers(v: Vector3<f64>) -> [f64; 3] {
    [v.x, v.y, v.z]
}

fn body(name: &str, at: &Isometry3<f64>, more: &str) -> String {
    let axis_angle = at.rotation.scaled_axis();
    let angle = axis_angle.norm();
    let axis = if angle > 0.0 { axis_angle / angle } else { Vector3::z() };
    format!(
        "[[body]]\nname = \"{name}\"\nmass = 0.6\ninertia = [0.02, 0.03, 0.04, 0.002, -0.003, 0.004]\ncom = [0.02, -0.05, 0.03]\n\
         position = {:?}\norientation = {{ axis = {:?}, angle = {angle:?} }}\n{more}\n",
        numbers(at.translation.vector),
        numbers(axis)
    )
}

fn weld(name: &str, bodies: [&str; 2], frames: [&Isometry3<f64>; 2]) -> String {
    let marker = |at: &Isometry3<f64>| {
        let (axis, x_axis) = (at.rotation * Vector3::z(), at.rotation * Vector3::x());
        let [position, axis, x_axis] = [at.translation.vector, axis, x_axis].map(numbers);
        format!("{{ position = {position:?}, axis = {axis:?}, x_axis = {x_axis:?} }}")
    };
    format!(
        "[[joint]]\nname = \"{name}\"\ntype = \"weld\"\nbodies = {bodies:?}\nframes = [{}, {}]\n",
        marker(frames[0]),
        marker(frames[1])
    )
}

/// Outputs of everything that is reported of a body and of the joint that holds it.
fn told(body: &str, weld: &str) -> String {
    let mut text = output(&format!("gap_{weld}"), &format!("quantity = \"coordinate\"; of = \"{weld}\""));
    for (quantity, of, more) in [
        ("position", body, ""),
        ("velocity", body, "; point = [0.1, 0.2, 0.3]"),
        ("acceleration", body, "; point = [0.1, 0.2, 0.3]"),
        ("angular_velocity", body, "; frame = \"BODY\""),
        ("angular_acceleration", body, ""),
        ("reaction_force", weld, "; on = \"BODY\""),
        ("reaction_torque", weld, "; on = \"BODY\"; frame = \"BODY\""),
        ("balance_force", body, ""),
        ("balance_torque", body, ""),
    ] {
        for k in ["x", "y", "z"] {
            let keys = format!("quantity = \"{quantity}\"; of = \"{of}\"; component = \"{k}\"{more}");
            text += &output(&format!("{quantity}_{of}_{k}"), &keys.replace("BODY", body));
        }
    }
    for k in ["e0", "e1", "e2", "e3"] {
        let keys = format!("quantity = \"orientation\"; of = \"{body}\"; component = \"{k}\"");
        text += &output(&format!("orientation_{body}_{k}"), &keys);
    }
    text
}

/// Two bodies out of every plane; on the second of them a third and on that a fourth, held by its joint the other way round; a
/// fifth on the ground, from which a strut goes to the fourth. Moved by `off`, which assembly must mend.
fn clump(text: &str, form: &str, off: f64) -> String {
    let on_b = frame([0.1, 0.2, -0.1], [1.0, 2.0, -1.0], 0.8);
    let (on_c, from_c) =
        (frame([-0.2, 0.05, 0.1], [0.3, -1.0, 1.0], -1.3), frame([0.3, 0.1, 0.0], [1.0, 0.0, 1.0], 2.1));
    let on_d = frame([0.05, -0.1, 0.2], [0.0, 1.0, 0.4], 0.5);
    let (on_ground, on_e) =
        (frame([1.0, 1.0, 0.5], [1.0, 1.0, 0.0], 0.7), frame([0.1, 0.0, 0.1], [0.0, 1.0, 1.0], 0.9));
    let b = frame([0.9, 0.1, 0.4], [-1.0, 1.0, 0.5], 1.9);
    let c = b * on_b * pose() * on_c.inverse();
    let d = c * from_c * pose().inverse() * on_d.inverse();
    let e = on_ground * pose() * on_e.inverse();
    let moved = Translation3::new(off, -off, 0.5 * off) * c;
    text.to_string()
        + &body("c", &moved, "[[body.point_masses]]\nmass = 0.1\nposition = [0.1, 0, 0.2]\n")
        + &body("d", &d, "")
        + &body("e", &e, "")
        + &weld("first", ["b", "c"], [&on_b, &on_c])
        + &weld("second", ["d", "c"], [&on_d, &from_c])
        + &weld("third", ["ground", "e"], [&on_ground, &on_e])
        + &format!(
            "[[force]]\nname = \"rope\"\ntype = \"{form}strut\"\nbodies = [\"e\", \"d\"]\nframes = [{{ position = [0.1, 0, 0] }}, \
             {{ position = [0, 0.2, 0] }}]\nparams = {{ stiffness = 20, damping = 1, free_length = 0.5 }}\n"
        )
        + &told("c", "first")
        + &told("d", "second")
        + &told("e", "third")
        + &output("F", "quantity = \"reaction_force\"; of = \"between\"; on = \"b\"; component = \"x\"")
        + &output("pull", "quantity = \"value\"; of = \"rope\"; channel = \"tension\"")
        + &output("T", "quantity = \"kinetic_energy\"")
        + &output("V", "quantity = \"potential_energy\"")
}

/// The same with another engine.
fn by(text: &str, engine: &str) -> String {
    text.replacen("t_end = ", &format!("engine = \"{engine}\"\nt_end = "), 1)
}

/// Runs in coordinates of joints and of bodies, and compares; gives both.
#[track_caller]
fn both(text: &str, tolerance: f64) -> [RunReport; 2] {
    let [joint, twin] = [run(text), run(&in_bodies(text))];
    assert!(joint.summary.engine.contains("joint"), "{}", joint.summary.engine);
    assert!(!twin.summary.engine.contains("joint"), "{}", twin.summary.engine);
    let off = apart(&joint, &twin);
    assert!(off < tolerance, "{off:e}");
    for report in [&joint, &twin] {
        let audit = &report.summary.audit;
        assert!(audit.position_violation < 1e-12 && audit.energy_error_relative < 1e-8, "{audit:?}");
    }
    [joint, twin]
}

#[test]
fn bodies_held_out_of_every_plane_move_as_one() {
    let text = clump(&scenes::tangle(), "", 0.0);
    let [joint, _] = both(&text, 1e-9);
    let reference = run(&by(&text, "reference"));
    assert!(reference.summary.engine.contains("reference"), "{}", reference.summary.engine);
    let off = apart(&joint, &reference);
    assert!(off < 1e-9, "{off:e}");
    for name in ["gap_first", "gap_third", "balance_force_c_x", "balance_torque_d_y", "velocity_e_x"] {
        assert!(super::off(&joint, name, |_| 0.0) < 1e-11, "{name}");
    }
}

#[test]
fn opaque_elements_see_their_own_frames() {
    both(&clump(&scenes::opaque_tangle(), "opaque-", 0.0), 1e-9);
}

#[test]
fn bodies_are_where_assembly_put_them() {
    let text = clump(&scenes::tangle(), "", 0.01);
    assert!(open(&text).assembly.moves.iter().any(|moved| moved.body == "c"));
    both(&text, 1e-9);
}

#[test]
fn implicit_steps_see_the_same_jacobian() {
    let settings = "t_end = 0.3\noutput_step = 0.05\nmethod = \"radau5\"\ntolerance = 1e-8\n";
    let text = clump(&scenes::tangle(), "", 0.0).replacen("t_end = 1\noutput_step = 0.1\n", settings, 1);
    let [joint, twin] = both(&text, 1e-8);
    assert!(joint.summary.newton_iterations <= twin.summary.newton_iterations + 20);
}

/// The four-bar with a load on its coupler and its ground link a body.
fn loaded_four_bar() -> String {
    let identity = Isometry3::identity();
    let (s, c) = 1.1_f64.sin_cos();
    // Turned so that the weld's own turn ends in the coupler's attitude.
    let on_load = frame([0.0, 0.0, WELD_STEP], [0.0, 0.0, 1.0], std::f64::consts::FRAC_PI_2);
    let flat = |text: String| {
        text.replace("[0.02, 0.03, 0.04, 0.002, -0.003, 0.004]", "[0.02, 0.03, 0.04]")
            .replace("-0.05, 0.03]", "-0.05, 0]")
    };
    scenes::four_bar(1.1).replace("[\"ground\", \"right\"]", "[\"base\", \"right\"]")
        + &flat(body("base", &identity, ""))
        + &flat(body("load", &frame([0.5 + c, s, 0.0], [0.0, 0.0, 1.0], 0.0), ""))
        + &weld("foot", ["ground", "base"], [&identity, &on_load])
        + &weld("bolts", ["coupler", "load"], [&identity, &on_load])
        + &told("load", "bolts")
        + &told("base", "foot")
}

#[test]
fn loads_move_with_a_mechanism_in_a_plane() {
    both(&loaded_four_bar(), 1e-9);
}

#[test]
fn a_driven_mechanism_is_found() {
    let text = loaded_four_bar()
        + "[[joint]]\nname = \"motor\"\ntype = \"drive\"\nbodies = [\"ground\", \"left\"]\npoint = [0, 0, 0]\naxis = [0, 0, 1]\n\
           params = { speed = 2 }\n";
    for report in both(&text, 1e-9) {
        assert_eq!(report.summary.method, "kinematic");
    }
}

#[test]
fn a_run_goes_on() {
    let folder = std::env::temp_dir().join(format!("odyn-welded-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let text = loaded_four_bar();
    let half = text.replacen("t_end = 1", "t_end = 0.5", 1);
    open(&half).run(Some(&folder), Box::new(|_| ()), &Arc::default()).unwrap();
    let mut second = open(&text);
    second.go_on_from(Restart::read(&folder).unwrap()).unwrap();
    let second = second.run(None, Box::new(|_| ()), &Arc::default()).unwrap();
    std::fs::remove_dir_all(folder).unwrap();
    let whole = run(&text);
    for name in ["position_load_x", "velocity_load_y", "reaction_torque_bolts_z"] {
        let (one, two) = (column(&whole, name).last().unwrap(), column(&second, name).last().unwrap());
        assert!((one - two).abs() < 1e-8, "{name}: {one} or {two}");
    }
}

#[test]
fn reactions_of_bodies_held_twice_stay_open() {
    let at = frame([0.1, 0.2, -0.1], [1.0, 2.0, -1.0], 0.8);
    let b = frame([0.9, 0.1, 0.4], [-1.0, 1.0, 0.5], 1.9);
    let text = scenes::tangle()
        + &body("c", &(b * at * pose()), "")
        + &weld("first", ["b", "c"], [&at, &Isometry3::identity()])
        + &weld("again", ["b", "c"], [&at, &Isometry3::identity()])
        + &told("c", "first");
    for report in both(&text, 1e-9) {
        assert_eq!(report.summary.redundant_rows, 6);
        assert_eq!(report.channels.iter().filter(|channel| !channel.unique).count(), 6);
    }
}

#[test]
fn forces_follow_any_quantity() {
    let base = clump(&scenes::tangle(), "", 0.0);
    let push = |more: &str| {
        format!(
            "[[force]]\nname = \"push\"\ntype = \"push\"\nbodies = [\"ground\", \"a\"]\npoint = [0.2, 0, 0]\naxis = [0, 0, 1]\n\
             params.factor = 0.4\ninputs.signal = \"{more}\"\n"
        )
    };
    let rub = "[[force]]\nname = \"rub\"\ntype = \"rub\"\njoints = [\"second\"]\nparams.factor = 0.1\n";
    both(&(base.clone() + rub), 1e-9);
    for name in [
        "reaction_force_second_x",
        "angular_velocity_c_y",
        "V",
        "position_c_x",
        "velocity_d_y",
        "acceleration_c_z",
        "angular_acceleration_d_x",
        "position_e_y",
        "F",
        "T",
        "gap_first",
    ] {
        println!("{name}");
        both(&(base.clone() + &push(name)), 1e-9);
    }
    // Joints do not tell Euler parameters.
    let text = base.clone() + &push("orientation_d_e1");
    let [chosen, reference] = [run(&text), run(&by(&text, "reference"))];
    assert!(!chosen.summary.engine.contains("joint"));
    let off = apart(&chosen, &reference);
    assert!(off < 1e-9, "{off:e}");
}

#[test]
fn friction_presses_with_the_weight_of_a_held_body() {
    let rail = "[[body]]\nname = \"cart\"\nmass = 2\ninertia = [0.1, 0.1, 0.1]\nvelocity = [2, 0, 0]\n\
                [[joint]]\nname = \"rail\"\ntype = \"slide\"\nbodies = [\"ground\", \"cart\"]\npoint = [0, 0, 0]\naxis = [1, 0, 0]\n\
                [[force]]\nname = \"friction\"\ntype = \"rub\"\njoints = [\"rail\"]\nparams.factor = 0.3\n";
    let at = frame([0.0, 0.2, 0.0], [1.0, 2.0, -1.0], 0.8);
    let text = settings("gravity = [0, -10, 0]; t_end = 0.4; output_step = 0.05")
        + rail
        + &body("load", &(at * pose()), "")
        + &weld("bolts", ["cart", "load"], [&at, &Isometry3::identity()])
        + &told("load", "bolts")
        + &output("v", "quantity = \"velocity\"; of = \"cart\"; component = \"x\"");
    for report in both(&text, 1e-9) {
        assert!(report.summary.coupling_iterations > 0);
        assert!(off(&report, "v", |t| 2.0 - 3.0 * t) < 1e-9);
    }
}
