//! Axes out of line: closed loops that lock, a drive that strains them, elements that act about another axis than their joint.

use odyn::diagnostics::codes;
use odyn::results::Status;
use odyn::session::Session;

use crate::support::open_text;

/// A slider-crank in the plane y = 0 with these axes of its hinges and this direction of its slider, and what follows.
fn slider_crank(axes: [[f64; 3]; 3], direction: [f64; 3], more: &str) -> Session {
    let mut text = "[plugins]\nlibraries = [\"odyn-joints\"]\n[units]\nangle = \"deg\"\n\
                    [simulation]\ngravity = [0, 0, -9.81]\nt_end = 0.2\noutput_step = 0.1\n"
        .to_owned();
    for (name, position) in [("crank", [0.1, 0.0, 0.1]), ("rod", [0.6, 0.0, 0.1]), ("piston", [1.0, 0.0, 0.0])] {
        text += &format!("[[body]]\nname = \"{name}\"\nmass = 1\ninertia = [0.1, 0.1, 0.1]\nposition = {position:?}\n");
    }
    let mut joint = |name: &str, kind: &str, bodies: [&str; 2], point: [f64; 3], axis: [f64; 3]| {
        text += &format!(
            "[[joint]]\nname = \"{name}\"\ntype = \"{kind}\"\nbodies = {bodies:?}\npoint = {point:?}\naxis = {axis:?}\n"
        );
    };
    joint("main", "revolute", ["ground", "crank"], [0.0; 3], axes[0]);
    joint("pin", "revolute", ["crank", "rod"], [0.2, 0.0, 0.2], axes[1]);
    joint("gudgeon", "revolute", ["rod", "piston"], [1.0, 0.0, 0.0], axes[2]);
    joint("guide", "translational", ["ground", "piston"], [1.0, 0.0, 0.0], direction);
    open_text(&(text + more), &[])
}

/// What is said of locked loops: the text at the joint that is marked.
fn said(session: &Session) -> Vec<String> {
    let found = session.warnings.iter().filter(|warning| warning.code == codes::LOCKED_LOOP);
    found.map(|warning| format!("{warning:?}")).collect()
}

const Y: [f64; 3] = [0.0, 1.0, 0.0];
const X: [f64; 3] = [1.0, 0.0, 0.0];

#[test]
fn a_slider_crank_that_is_out_of_its_plane_is_warned_of() {
    for angle in [0.05_f64, 3.0] {
        let (s, c) = angle.to_radians().sin_cos();
        let slider = said(&slider_crank([Y; 3], [c, s, 0.0], ""));
        assert_eq!(slider.len(), 1);
        let off = format!("it slides {angle} deg off the plane that the axis of `main` is normal to");
        assert!(slider[0].contains(&off), "{slider:?}");
        let pin = said(&slider_crank([Y, [s, c, 0.0], Y], X, ""));
        assert_eq!(pin.len(), 1);
        assert!(pin[0].contains(&format!("its axis is {angle} deg off that of `main`")), "{pin:?}");
    }
    assert_eq!(said(&slider_crank([Y; 3], X, "")), Vec::<String>::new());
    assert_eq!(said(&slider_crank([Y, [0.0, -2.0, 0.0], Y], [-3.0, 0.0, 0.0], "")), Vec::<String>::new());
}

#[test]
fn a_drive_that_strains_rows_taken_for_redundant_is_suspect_with_the_cause() {
    let drive = "[[joint]]\nname = \"drive\"\ntype = \"rotation-driver\"\nbodies = [\"ground\", \"crank\"]\naxis = [0, 1, 0]\n\
                 params.angle = \"2*t\"\n";
    let run = |session: Session| {
        session.run(None, Box::new(|_| ()), &Default::default()).unwrap_or_else(|error| panic!("{error}")).summary
    };
    let strained = run(slider_crank([Y, [1e-6, 1.0, 0.0], Y], X, drive));
    assert_eq!(strained.status, Status::Suspect);
    assert!(strained.reason.contains("axes of a planar mechanism must be parallel"), "{}", strained.reason);
    assert_eq!(run(slider_crank([Y; 3], X, drive)).status, Status::Completed);
}

/// Two ways from the first shaft to the last, by two layshafts; the number of teeth of the last wheel of the second.
fn two_ways(teeth: u32) -> Session {
    let mut text =
        "[plugins]\nlibraries = [\"odyn-joints\"]\n[simulation]\nt_end = 0.2\noutput_step = 0.1\n".to_owned();
    for (name, x) in [("in", 0.0), ("left", -0.2), ("right", 0.2), ("out", 0.0)] {
        let z = if name == "out" { 0.1 } else { 0.0 };
        text += &format!(
            "[[body]]\nname = \"{name}\"\nmass = 1\ninertia = [0.1, 0.1, 0.1]\nposition = [{x:?}, 0, {z:?}]\n\
             [[joint]]\nname = \"bearing-{name}\"\ntype = \"revolute\"\nbodies = [\"ground\", \"{name}\"]\npoint = [{x:?}, 0, {z:?}]\n\
             axis = [0, 0, 1]\n"
        );
    }
    let wheels =
        [("in", "left", 20, 40), ("in", "right", 20, 40), ("left", "out", 25, 35), ("right", "out", 25, teeth)];
    for (first, second, a, b) in wheels {
        text += &format!(
            "[[joint]]\nname = \"{first}-{second}\"\ntype = \"gear\"\nbodies = [\"ground\", \"{first}\", \"ground\", \"{second}\"]\n\
             point = [0, 0, 0]\nparams = {{ teeth_1 = {a}, teeth_2 = {b} }}\n"
        );
    }
    open_text(&text, &[])
}

#[test]
fn gears_whose_ratios_do_not_fit_around_a_loop_are_warned_of() {
    let fits = two_ways(35);
    assert_eq!((fits.plan.mobility, said(&fits)), (1, Vec::<String>::new()));
    let locked = two_ways(36);
    let said = said(&locked);
    assert_eq!((locked.plan.mobility, said.len()), (0, 1));
    assert!(said[0].contains("`in-left`") && said[0].contains("ratios must multiply to one"), "{said:?}");
}

/// An arm on a hinge about x and a wheel that turns about it, with one more element.
fn arm(element: &str) -> Session {
    let text = "[plugins]\nlibraries = [\"odyn-joints\", \"odyn-forces\"]\n[simulation]\nt_end = 0.1\noutput_step = 0.1\n\
        [[body]]\nname = \"arm\"\nmass = 1\ninertia = [0.1, 0.1, 0.1]\nposition = [0, 0.3, 0]\n\
        [[body]]\nname = \"wheel\"\nmass = 1\ninertia = [0.1, 0.1, 0.1]\nposition = [0, 0.6, 0]\n\
        [[joint]]\nname = \"hinge\"\ntype = \"revolute\"\nbodies = [\"ground\", \"arm\"]\npoint = [0, 0, 0]\naxis = [1, 0, 0]\n\
        [[joint]]\nname = \"bearing\"\ntype = \"revolute\"\nbodies = [\"arm\", \"wheel\"]\npoint = [0, 0.6, 0]\naxis = [1, 0, 0]\n";
    open_text(&format!("{text}{element}"), &[])
}

/// What is said of elements that act about or along other axes than their joints.
fn crosswise(session: &Session) -> Vec<String> {
    let found = session.warnings.iter().filter(|warning| warning.code == codes::CROSSWISE);
    found.map(|warning| format!("{warning:?}")).collect()
}

#[test]
fn what_acts_about_another_axis_than_its_joint_is_warned_of() {
    let elements = [
        ("force", "rotational-spring-damper", "params.stiffness = 2"),
        ("force", "rotational-actuator", "params.of_time = \"1\""),
        ("force", "rotational-inerter", "params.inertance = 2"),
        ("force", "rotational-bump-stop", "params = { upper = 1, torque = 1, depth = 0.1 }"),
        ("joint", "rotational-stop", "params = { upper = 1 }"),
        ("joint", "freewheel", ""),
    ];
    for (table, kind, parameters) in elements {
        let element = |axis: &str| {
            arm(&format!(
                "[[{table}]]\nname = \"it\"\ntype = \"{kind}\"\nbodies = [\"ground\", \"arm\"]\npoint = [0, 0, 0]\n{axis}{parameters}\n"
            ))
        };
        for axis in ["axis = [1, 0, 0]\n", "axis = [-2, 0, 0]\n"] {
            assert_eq!(crosswise(&element(axis)), Vec::<String>::new(), "{kind}");
        }
        for (axis, angle) in [("", "1.57"), ("axis = [1, 0, 0.001]\n", "0.001")] {
            let found = crosswise(&element(axis));
            let off = format!("is {angle} rad off the axis of `hinge`");
            assert!(found.len() == 1 && found[0].contains(&off), "{kind}: {found:?}");
        }
    }
    // Between bodies that several joints separate, only frames that are not parallel at the start are certain to be wrong.
    let far = |axes: &str| {
        arm(&format!(
            "[[force]]\nname = \"it\"\ntype = \"rotational-spring-damper\"\nbodies = [\"ground\", \"wheel\"]\nparams.stiffness = 2\n{axes}"
        ))
    };
    assert_eq!(crosswise(&far("axis = [1, 0, 0]\n")), Vec::<String>::new());
    let found = crosswise(&far("frames = [{}, { axis = [0, 1, 1] }]\n"));
    assert!(found.len() == 1 && found[0].contains("of its frames `i` and `j` are 0.785 rad apart"), "{found:?}");
    let mesh = |second: &str| {
        let bodies = "bodies = [\"ground\", \"arm\", \"arm\", \"wheel\"]";
        arm(&format!(
            "[[joint]]\nname = \"mesh\"\ntype = \"gear\"\n{bodies}\naxes = [[1, 0, 0], [1, 0, 0], {second}, {second}]\nparams = {{ teeth_1 = 20, teeth_2 = 40 }}\n"
        ))
    };
    assert_eq!(crosswise(&mesh("[1, 0, 0]")), Vec::<String>::new());
    let found = crosswise(&mesh("[0, 0, 1]"));
    assert!(found.len() == 1 && found[0].contains("`carrier_2` is 1.57 rad off the axis of `bearing`"), "{found:?}");
}

/// Bodies on the ground, each on a joint of its own, and one more element.
fn on_joints(joints: &[(&str, [f64; 3])], element: &str) -> Session {
    let mut text =
        "[plugins]\nlibraries = [\"joints\", \"forces\", \"compressor\"]\n[simulation]\nt_end = 0.1\noutput_step = 0.1\n".to_owned();
    for (k, (kind, axis)) in joints.iter().enumerate() {
        text += &format!(
            "[[body]]\nname = \"b{k}\"\nmass = 1\ninertia = [0.1, 0.1, 0.1]\n[[joint]]\nname = \"j{k}\"\ntype = \"{kind}\"\n\
             bodies = [\"ground\", \"b{k}\"]\npoint = [0, 0, 0]\naxis = {axis:?}\n"
        );
    }
    open_text(&(text + element), &[])
}

fn between(table: &str, kind: &str, bodies: [&str; 2], more: &str) -> String {
    format!("[[{table}]]\nname = \"it\"\ntype = \"{kind}\"\nbodies = {bodies:?}\npoint = [0, 0, 0]\n{more}\n")
}

/// A table that moves in a plane: what acts along z acts along what the table is free to move in, whatever it turns about.
#[test]
fn what_acts_along_a_plane_is_not_crosswise() {
    let elements = [
        ("displacement-driver", "params.displacement = \"0.1 t^2\""),
        ("servo-displacement", "params = { displacement = \"0.1\", frequency = 10 }"),
        ("translational-stop", "params.upper = 0.2"),
        ("dry-friction", "params.force = 3"),
    ];
    for (kind, parameters) in elements {
        let driven = |plane: [f64; 3]| {
            let more = format!("axis = [1, 0, 0]\n{parameters}");
            crosswise(&on_joints(&[("planar", plane)], &between("joint", kind, ["ground", "b0"], &more)))
        };
        assert_eq!(driven([0.0, 0.0, 1.0]), Vec::<String>::new(), "{kind}");
        if kind.ends_with("stop") || kind == "dry-friction" {
            let found = driven([1.0, 0.0, 0.0]);
            assert!(found.len() == 1 && found[0].contains("is 1.57 rad off where `j0` slides"), "{kind}: {found:?}");
        }
    }
    let turning = between("joint", "dry-friction", ["ground", "b0"], "axis = [1, 0, 0]\nparams.torque = 3");
    let found = crosswise(&on_joints(&[("planar", [0.0, 0.0, 1.0])], &turning));
    assert!(found.len() == 1 && found[0].contains("is 1.57 rad off the axis of `j0`"), "{found:?}");
}

/// Two shafts with bearings of their own, and an element between them whose axis was forgotten.
#[test]
fn what_acts_about_another_axis_than_those_of_two_shafts_is_warned_of() {
    let elements = [
        ("joint", "freewheel", ""),
        ("joint", "clutch", "params.capacity = 5"),
        ("joint", "dry-friction", "params.torque = 5"),
        ("joint", "rotational-stop", "params.upper = 1"),
        ("force", "rotational-spring-damper", "params.stiffness = 2"),
        ("force", "rotational-actuator", "params.of_time = \"1\""),
    ];
    for (table, kind, parameters) in elements {
        let said = |shafts: [[f64; 3]; 2], axis: &str| {
            let element = between(table, kind, ["b0", "b1"], &format!("{axis}\n{parameters}"));
            crosswise(&on_joints(&shafts.map(|axis| ("revolute", axis)), &element))
        };
        let found = said([X, X], "");
        assert!(found.len() == 1 && found[0].contains("is 1.57 rad off the axis of `j0`"), "{kind}: {found:?}");
        assert_eq!(said([X, X], "axis = [1, 0, 0]"), Vec::<String>::new(), "{kind}");
        // One that turns about it is enough.
        assert_eq!(said([X, [0.0, 0.0, 1.0]], ""), Vec::<String>::new(), "{kind}");
    }
}

/// Elements that push along z across a guide can have no effect. On a lever they can, as soon as it turns.
#[test]
fn what_pushes_across_all_that_slides_is_warned_of() {
    let elements = [
        ("bump-stop", "params = { upper = 0.2, force = 100, depth = 0.01 }"),
        ("translational-actuator", "params = { along = \"axis\", of_time = \"1\" }"),
        ("inerter", "params = { inertance = 2, guided = true }"),
    ];
    for (kind, parameters) in elements {
        let said = |joint: &str, axis: &str| {
            let element = between("force", kind, ["ground", "b0"], &format!("{axis}\n{parameters}"));
            crosswise(&on_joints(&[(joint, X)], &element))
        };
        let found = said("translational", "");
        assert!(found.len() == 1 && found[0].contains("is 1.57 rad off where `j0` slides"), "{kind}: {found:?}");
        for (joint, axis) in [("translational", "axis = [1, 0, 0.1]"), ("revolute", ""), ("cylindrical", "")] {
            assert_eq!(said(joint, axis), Vec::<String>::new(), "{kind} on {joint}");
        }
    }
    let spring = "[[force]]\nname = \"it\"\ntype = \"translational-spring-damper\"\nbodies = [\"ground\", \"b0\"]\n\
                  points = [[0, 0, 1], [0, 0, 0]]\nparams = { stiffness = 3, free_length = 1 }\n";
    assert_eq!(crosswise(&on_joints(&[("translational", X)], spring)), Vec::<String>::new());
}

/// Elements of a machine whose axes were forgotten: what turns a shaft, and each pair of what couples two motions.
#[test]
fn drives_and_couplings_about_other_axes_are_warned_of() {
    let machine = [("revolute", X), ("translational", Y)];
    let said = |element: String| crosswise(&on_joints(&machine, &element));
    let shaft = [("motor-torque", "params.curve = [[0, 1], [100, 1]]"), ("rolling-resistance", "params.damping = 1")];
    for (kind, parameters) in shaft {
        let found = said(between("force", kind, ["ground", "b0"], parameters));
        assert!(
            found.len() == 1 && found[0].contains("`housing` is 1.57 rad off the axis of `j0`"),
            "{kind}: {found:?}"
        );
        let along = said(between("force", kind, ["ground", "b0"], &format!("axis = [1, 0, 0]\n{parameters}")));
        assert_eq!(along, Vec::<String>::new(), "{kind}");
    }
    let gas = |axes: &str, joints: &[(&str, [f64; 3])]| {
        let text = format!(
            "[[force]]\nname = \"it\"\ntype = \"compression-force\"\nbodies = [\"ground\", \"b1\", \"ground\", \"b0\"]\n\
             {axes}\nparams.cosine = [10, 5]\n"
        );
        crosswise(&on_joints(joints, &text))
    };
    let found = gas("", &machine);
    assert!(found.len() == 1 && found[0].contains("`housing` is 1.57 rad off the axis of `j0`"), "{found:?}");
    let axes = "axes = [[0, 1, 0], [0, 1, 0], [1, 0, 0], [1, 0, 0]]";
    assert_eq!(gas(axes, &machine), Vec::<String>::new());
    // What turns in a plane is held against its axis, not against where it slides.
    assert_eq!(gas(axes, &[("planar", X), ("translational", Y)]), Vec::<String>::new());
    let couplings = [
        ("coupler", "{ first = \"rotation\", second = \"translation\", lead = 0.1 }", ["first_i", "second_i"]),
        ("rack-and-pinion", "{ radius = 0.1 }", ["pinion_carrier", "rack_carrier"]),
    ];
    for (kind, parameters, [first, second]) in couplings {
        let coupled = |axes: [[f64; 3]; 2]| {
            let [a, b] = axes;
            said(format!(
                "[[joint]]\nname = \"it\"\ntype = \"{kind}\"\nbodies = [\"ground\", \"b0\", \"ground\", \"b1\"]\n\
                 axes = [{a:?}, {a:?}, {b:?}, {b:?}]\nparams = {parameters}\n"
            ))
        };
        assert_eq!(coupled([X, Y]), Vec::<String>::new(), "{kind}");
        let found = coupled([[1.0, 1.0, 0.0], Y]);
        let off = format!("`{first}` is 0.785 rad off the axis of `j0`");
        assert!(found.len() == 1 && found[0].contains(&off), "{kind}: {found:?}");
        let found = coupled([X, [1.0, 1.0, 0.0]]);
        let off = format!("`{second}` is 0.785 rad off where `j1` slides");
        assert!(found.len() == 1 && found[0].contains(&off), "{kind}: {found:?}");
    }
}
