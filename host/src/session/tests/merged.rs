//! Bodies that joints without freedom hold, merged and not: the same results, in the paper's coordinates too.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use super::pruning::{apart, in_bodies, saved, without};
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

/// Outputs of everything that is told of a body and of the joint that holds it.
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
    in_bodies(text)
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

/// Runs with and without, and compares; gives both.
#[track_caller]
fn both(text: &str, tolerance: f64) -> [RunReport; 2] {
    let [merged, twin] = [run(text), run(&without(text, "\"merged\""))];
    assert!(merged.summary.engine.contains("merged"), "{}", merged.summary.engine);
    assert!(!twin.summary.engine.contains("merged"), "{}", twin.summary.engine);
    let off = apart(&merged, &twin);
    assert!(off < tolerance, "{off:e}");
    let audit = &merged.summary.audit;
    assert!(audit.position_violation < 1e-12 && audit.energy_error_relative < 1e-8, "{audit:?}");
    [merged, twin]
}

#[test]
fn bodies_held_out_of_every_plane_move_as_one() {
    let text = clump(&scenes::tangle(), "", 0.0);
    let [merged, _] = both(&text, 1e-9);
    let reference = run(&by(&text, "reference"));
    assert!(reference.summary.engine.contains("reference"), "{}", reference.summary.engine);
    let off = apart(&merged, &reference);
    assert!(off < 1e-9, "{off:e}");
    for name in ["gap_first", "gap_third", "balance_force_c_x", "balance_torque_d_y", "velocity_e_x"] {
        assert!(super::off(&merged, name, |_| 0.0) < 1e-11, "{name}");
    }
    let told = saved(&text, "merged").unwrap_or_default();
    assert!(told.starts_with("39 of 65 states, 18 of 28 rows, "), "{told}");
    assert_eq!(saved(&without(&text, "\"merged\""), "merged"), None);
    let plan = format!("{}", open(&text).plan_report());
    assert!(plan.contains("the motion of 3 bodies (`e` on `ground` by `third`, `c` on `b` by `first`, "), "{plan}");
}

#[test]
fn opaque_elements_see_their_own_frames_on_merged_bodies() {
    both(&clump(&scenes::opaque_tangle(), "opaque-", 0.0), 1e-9);
}

#[test]
fn bodies_are_merged_where_assembly_put_them() {
    let text = clump(&scenes::tangle(), "", 0.01);
    assert!(open(&text).assembly.moves.iter().any(|moved| moved.body == "c"));
    both(&text, 1e-9);
}

#[test]
fn implicit_steps_see_the_jacobian_of_the_merged_bodies() {
    let settings = "t_end = 0.3\noutput_step = 0.05\nmethod = \"radau5\"\ntolerance = 1e-8\n";
    let text = clump(&scenes::tangle(), "", 0.0).replacen("t_end = 1\noutput_step = 0.1\n", settings, 1);
    let [merged, twin] = both(&text, 1e-8);
    assert!(merged.summary.newton_iterations <= twin.summary.newton_iterations + 20);
}

#[test]
fn all_rows_of_merged_bodies_may_stay_in_use() {
    let text = without(&clump(&scenes::tangle(), "", 0.0), "\"row-choice\"");
    let safe = run(&text);
    assert_eq!(safe.summary.engine.split(", ").skip(1).collect::<Vec<_>>(), ["merged", "rank-safe"]);
    let off = apart(&safe, &run(&clump(&scenes::tangle(), "", 0.0)));
    assert!(off < 1e-9, "{off:e}");
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
    in_bodies(&scenes::four_bar(1.1)).replace("[\"ground\", \"right\"]", "[\"base\", \"right\"]")
        + &flat(body("base", &identity, ""))
        + &flat(body("load", &frame([0.5 + c, s, 0.0], [0.0, 0.0, 1.0], 0.0), ""))
        + &weld("foot", ["ground", "base"], [&identity, &on_load])
        + &weld("bolts", ["coupler", "load"], [&identity, &on_load])
        + &told("load", "bolts")
        + &told("base", "foot")
}

#[test]
fn merged_bodies_move_in_a_plane() {
    let text = loaded_four_bar();
    // The weld's quarter turn is one but for round-off, so that without merging no plane can be proved.
    let [merged, _] = both(&text, 1e-9);
    assert!(merged.summary.engine.contains("merged, planar"), "{}", merged.summary.engine);
    let told = saved(&text, "planar").unwrap_or_default();
    assert!(told.ends_with("operations per evaluation, 9 of 17 rows, 9 of 18 velocities"), "{told}");
    let spatial = run(&without(&text, "\"planar\""));
    assert!(!spatial.summary.engine.contains("planar") && spatial.summary.engine.contains("merged"));
    let off = apart(&merged, &spatial);
    assert!(off < 1e-9, "{off:e}");
}

#[test]
fn a_driven_mechanism_with_merged_bodies_is_found() {
    let text = loaded_four_bar()
        + "[[joint]]\nname = \"motor\"\ntype = \"drive\"\nbodies = [\"ground\", \"left\"]\npoint = [0, 0, 0]\naxis = [0, 0, 1]\n\
           params = { speed = 2 }\n";
    for report in both(&text, 1e-9) {
        assert_eq!(report.summary.method, "kinematic");
    }
}

#[test]
fn a_run_with_merged_bodies_goes_on() {
    let folder = std::env::temp_dir().join(format!("odyn-merged-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let text = loaded_four_bar();
    let half = text.replacen("t_end = 1", "t_end = 0.5", 1);
    open(&half).run(Some(&folder), Box::new(|_| ()), &Arc::default()).unwrap();
    let mut second = open(&text);
    second.go_on_from(Restart::read(&folder).unwrap()).unwrap();
    let second = second.run(None, Box::new(|_| ()), &Arc::default()).unwrap();
    std::fs::remove_dir_all(folder).unwrap();
    assert!(second.summary.engine.contains("merged, planar"), "{}", second.summary.engine);
    let whole = run(&text);
    for name in ["position_load_x", "velocity_load_y", "reaction_torque_bolts_z"] {
        let (one, two) = (column(&whole, name).last().unwrap(), column(&second, name).last().unwrap());
        assert!((one - two).abs() < 1e-8, "{name}: {one} or {two}");
    }
}

/// What the plan says of merging that is not done.
fn refused(text: &str) -> Vec<String> {
    let list = open(text).plan_report().impossible;
    list.into_iter().filter(|text| text.starts_with("merged: ")).collect()
}

#[test]
fn bodies_held_twice_are_merged_once_and_their_reactions_stay_open() {
    let at = frame([0.1, 0.2, -0.1], [1.0, 2.0, -1.0], 0.8);
    let b = frame([0.9, 0.1, 0.4], [-1.0, 1.0, 0.5], 1.9);
    let text = in_bodies(&scenes::tangle())
        + &body("c", &(b * at * pose()), "")
        + &weld("first", ["b", "c"], [&at, &Isometry3::identity()])
        + &weld("again", ["b", "c"], [&at, &Isometry3::identity()])
        + &told("c", "first");
    let [merged, _] = both(&text, 1e-9);
    assert_eq!(merged.summary.redundant_rows, 6);
    let open_ones = merged.channels.iter().filter(|channel| !channel.unique).count();
    assert_eq!(open_ones, 6);
}

#[test]
fn what_elements_ask_for_keeps_bodies_apart() {
    let base = clump(&scenes::tangle(), "", 0.0);
    let push = |more: &str| {
        format!(
            "[[force]]\nname = \"push\"\ntype = \"push\"\nbodies = [\"ground\", \"a\"]\npoint = [0.2, 0, 0]\naxis = [0, 0, 1]\n\
             params.factor = 0.4\ninputs.signal = \"{more}\"\n"
        )
    };
    // A reaction of the merging joint: that one stays.
    let rub = "[[force]]\nname = \"rub\"\ntype = \"rub\"\njoints = [\"second\"]\nparams.factor = 0.1\n";
    let text = base.clone() + rub;
    assert_eq!(refused(&text), ["merged: by `second`: `rub` takes the reaction of `second`"]);
    both(&text, 1e-9);
    let text = base.clone() + &push("reaction_force_second_x");
    assert_eq!(refused(&text), ["merged: by `second`: `push` takes the reaction of `second`"]);
    both(&text, 1e-9);
    // The axes of a body that would be gone.
    let text = base.clone() + &push("angular_velocity_c_y");
    assert_eq!(refused(&text), ["merged: by `first`: `push` takes a quantity in the axes of `c`"]);
    both(&text, 1e-9);
    let text = base.clone() + &push("orientation_d_e1");
    assert_eq!(refused(&text), ["merged: by `second`: `push` takes a quantity in the axes of `d`"]);
    both(&text, 1e-9);
    // The height of what stands on the ground.
    let text = base.clone() + &push("V");
    assert_eq!(refused(&text), ["merged: by `third`: `push` takes the potential energy"]);
    both(&text, 1e-9);
    // All else is told of merged bodies as well; accelerations are found together with forces.
    for name in [
        "position_c_x",
        "velocity_d_y",
        "acceleration_c_z",
        "angular_acceleration_d_x",
        "position_e_y",
        "F",
        "T",
        "gap_first",
    ] {
        let text = base.clone() + &push(name);
        assert_eq!(refused(&text), Vec::<String>::new(), "{name}");
        both(&text, 1e-9);
    }
}

#[test]
fn friction_presses_with_the_reaction_of_a_merged_body() {
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
    let [merged, _] = both(&text, 1e-9);
    assert!(merged.summary.coupling_iterations > 0);
    assert!(off(&merged, "v", |t| 2.0 - 3.0 * t) < 1e-9);
}

#[test]
fn what_would_leave_nothing_or_a_wrong_place_is_not_merged() {
    let at = frame([0.2, 0.0, 0.1], [1.0, 2.0, 3.0], 0.4);
    let alone = in_bodies(&settings("t_end = 1; output_step = 0.5"))
        + &body("post", &pose(), "")
        + &weld("foot", ["ground", "post"], [&Isometry3::identity(), &Isometry3::identity()]);
    assert_eq!(refused(&alone), ["merged: by `foot`: nothing would be left that moves"]);
    // The rows of a weld are met by the turn the other way, too, which its mobility does not tell.
    let other = frame([0.0, 0.0, WELD_STEP], [0.0, 0.0, 1.0], -std::f64::consts::FRAC_PI_2);
    let text = scenes::pendulum(&in_bodies(&settings("gravity = [0, -9.81, 0]; t_end = 1; output_step = 0.5")))
        + &body("load", &(frame([0.5, 0.0, 0.0], [0.0, 0.0, 1.0], 0.0) * at * other), "")
        + &weld("bolts", ["rod", "load"], [&at, &Isometry3::identity()]);
    assert_eq!(refused(&text), ["merged: by `bolts`: its mobility does not tell the position that its rows ask for"]);
    assert!(!run(&text).summary.engine.contains("merged"));
    // Joints in coordinates of their own need no merging.
    assert_eq!(saved(&loaded_four_bar().replacen("cartesian", "joint", 1), "merged"), None);
}
