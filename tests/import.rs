//! Robots of URDF and MJCF files, as scenes: accelerations are those of MuJoCo (`peers/mujoco_robots.py`), loops close, nothing is lost
//! unsaid.

use std::collections::BTreeMap;
use std::path::PathBuf;

use odyn::import::{Base, Imported, Options, read};
use odyn::session::{RunReport, Session};

use crate::support::{Scratch, column, kept, options, root};

const ROBOTS: [&str; 5] = ["arm.urdf", "gantry.urdf", "walker.xml", "snake.xml", "crane.urdf"];

fn robot(name: &str) -> PathBuf {
    root().join("tests/robots").join(name)
}

#[track_caller]
fn imported(name: &str, options: &Options) -> Imported {
    read(&robot(name), &kept("robots"), options).unwrap_or_else(|refused| panic!("{:?}", refused.diagnostics))
}

/// Runs the text of a scene.
#[track_caller]
fn run_text(scene: &str, sets: &[&str]) -> RunReport {
    let path = kept("robots").join("robot.toml");
    let session = Session::open_text(&path, scene.to_owned(), &options(sets, &[]));
    let session = session.unwrap_or_else(|error| panic!("{error}\n{scene}"));
    let report = session.run(None, Box::new(|_| ()), &Default::default()).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(report.exit_code(), 0, "{} {:?}", report.summary.reason, report.summary.audit);
    report
}

/// The accelerations of all joints at the start, in the formulation.
fn accelerations(imported: &Imported, formulation: &str) -> BTreeMap<String, f64> {
    let scene = imported.scene.replace("quantity = \"coordinate\"", "quantity = \"coordinate_acceleration\"");
    let formulation = format!("simulation.formulation={formulation}");
    let sets = ["simulation.t_end=1e-6", "simulation.output_step=1e-6", &formulation];
    let report = run_text(&scene, &sets);
    imported.joints.iter().map(|joint| (joint.clone(), column(&report, joint)[0])).collect()
}

/// The largest difference from MuJoCo at the kept states, as a share of the largest acceleration of the state.
fn compared(name: &str, formulation: &str, states: usize) -> f64 {
    let stem = name.split('.').next().unwrap();
    let table = std::fs::read_to_string(root().join(format!("tests/robots/{stem}.csv"))).unwrap();
    let mut lines = table.lines();
    let head: Vec<(&str, &str)> = lines.next().unwrap().split(',').map(|name| name.split_once(':').unwrap()).collect();
    let mut largest = 0.0_f64;
    for line in lines.take(states) {
        let numbers = line.split(',').map(|number| number.parse::<f64>().unwrap());
        let mut of: BTreeMap<&str, BTreeMap<String, f64>> = BTreeMap::new();
        for ((kind, joint), number) in head.iter().zip(numbers) {
            of.entry(kind).or_default().insert((*joint).to_owned(), number);
        }
        // MuJoCo has no limits here either.
        let start = Options { pose: of["q"].clone(), speeds: of["v"].clone(), limits: false, ..Options::default() };
        let ours = accelerations(&imported(name, &start), formulation);
        assert_eq!(ours.len(), of["a"].len(), "{name}: as many joints");
        let size = of["a"].values().fold(1.0_f64, |size, a| size.max(a.abs()));
        for (joint, theirs) in &of["a"] {
            // A body of the same name keeps it.
            let ours = ours.get(joint).or_else(|| ours.get(&format!("{joint}-joint"))).unwrap();
            largest = largest.max((ours - theirs).abs() / size);
        }
    }
    largest
}

#[test]
fn robots_accelerate_as_in_mujoco() {
    for name in ROBOTS {
        let difference = compared(name, "joint", 4);
        assert!(difference < 1e-10, "{name}: {difference:e}");
    }
}

#[test]
fn robots_accelerate_as_in_mujoco_in_coordinates_of_bodies() {
    // Of light bodies between joints in a row, elimination leaves fewer digits.
    for name in ["arm.urdf", "gantry.urdf", "crane.urdf"] {
        let difference = compared(name, "cartesian", 2);
        assert!(difference < 1e-9, "{name}: {difference:e}");
    }
}

#[test]
fn robots_run_with_their_limits() {
    for name in ROBOTS {
        let imported = imported(name, &Options::default());
        let report = run_text(&imported.scene, &["simulation.t_end=0.3"]);
        assert_eq!(report.columns.len(), imported.joints.len(), "{name}");
    }
    let free = Options { base: Base::Free, limits: false, ..Options::default() };
    let scene = imported("arm.urdf", &free).scene;
    run_text(&scene, &["simulation.t_end=0.1"]);
}

#[test]
fn loops_that_connect_closes_stay_closed() {
    let linkage = imported("linkage.xml", &Options::default());
    assert!(linkage.left_out.iter().any(|what| what.contains("<actuator>")), "{:?}", linkage.left_out);
    let report = run_text(&linkage.scene, &[]);
    // Crank 0.1 m, coupler from its end to (0.4, 0.1) m away, rocker 0.2 m about (0.4, 0) m: the coupler's length is what it was.
    let (crank, rocker) = (column(&report, "crank-joint"), column(&report, "rocker-joint"));
    assert!(crank.iter().any(|angle| angle.abs() > 0.5), "it moves: {crank:?}");
    let length = |crank: f64, rocker: f64| {
        let from = (-0.1 * crank.sin(), 0.1 * crank.cos());
        let to = (0.4 - 0.2 * rocker.sin(), 0.2 * rocker.cos());
        (to.0 - from.0).hypot(to.1 - from.1)
    };
    for (crank, rocker) in crank.iter().zip(rocker) {
        assert!((length(*crank, *rocker) - 0.4_f64.hypot(0.1)).abs() < 1e-9, "{crank} {rocker}");
    }
}

#[test]
fn a_joint_that_mimics_another_follows_it() {
    let text = std::fs::read_to_string(robot("gantry.urdf")).unwrap();
    let follows = text.replace(
        "<axis xyz=\"0 -1 0\"/>",
        "<axis xyz=\"0 -1 0\"/><mimic joint=\"left_finger\" multiplier=\"0.5\" offset=\"0.004\"/>",
    );
    assert_ne!(text, follows);
    let scratch = Scratch::new();
    let file = scratch.file("gripper.urdf", follows);
    let pose = BTreeMap::from([("left_finger".to_owned(), 0.01)]);
    let speeds = BTreeMap::from([("left_finger".to_owned(), 0.02), ("wrist".to_owned(), 3.0)]);
    let options = Options { limits: false, pose, speeds, ..Options::default() };
    let scene = read(&file, scratch.path(), &options).unwrap().scene;
    let report = run_text(&scene, &["simulation.t_end=0.2"]);
    let (left, right) = (column(&report, "left_finger"), column(&report, "right_finger"));
    assert!((left[0] - 0.01).abs() < 1e-12 && (left[20] - left[0]).abs() > 1e-3, "{left:?}");
    for (left, right) in left.iter().zip(right) {
        assert!((right - (0.5 * left + 0.004)).abs() < 1e-10, "{left} {right}");
    }
}

#[test]
fn links_without_mass_change_nothing() {
    let text = std::fs::read_to_string(robot("arm.urdf")).unwrap();
    let at = text.find("<inertial><mass value=\"0.2\"/>").unwrap();
    let bare = [&text[..at], text[at..].split_once("</inertial>").unwrap().1].concat();
    // The same with a wrist that weighs next to nothing, as MuJoCo wants it.
    let light = text.replace("<mass value=\"0.2\"/><inertia ixx=\"0.0002\" iyy=\"0.0001\" izz=\"0.0003\"", {
        "<mass value=\"1e-9\"/><inertia ixx=\"1e-9\" iyy=\"1e-9\" izz=\"1e-9\""
    });
    let scratch = Scratch::new();
    let options = Options { limits: false, ..Options::default() };
    let of = |name: &str, text: String| {
        let imported = read(&scratch.file(name, text), scratch.path(), &options).unwrap();
        (accelerations(&imported, "joint"), imported.left_out)
    };
    let (bare, said) = of("bare.urdf", bare);
    let (light, _) = of("light.urdf", light);
    assert!(said.iter().any(|what| what.contains("`wrist`") && what.contains("no mass")), "{said:?}");
    for (joint, acceleration) in bare {
        assert!((acceleration - light[&joint]).abs() < 1e-5 * acceleration.abs().max(1.0), "{joint}");
    }
}

/// A slide with spring, damper and rotor that falls by more than it begins from: a damped oscillation about where it hangs.
#[test]
fn springs_dampers_and_rotors_of_slides_act_on_both_sides_of_zero() {
    let file = "<mujoco><option gravity=\"0 0 -9.81\"/><worldbody><body><geom size=\"0.1\" mass=\"2\"/><joint name=\"s\" type=\"slide\" \
                stiffness=\"3\" springref=\"0.5\" damping=\"0.4\" armature=\"1\"/></body></worldbody></mujoco>";
    let scratch = Scratch::new();
    let scene = read(&scratch.file("fall.xml", file), scratch.path(), &Options::default()).unwrap().scene;
    let (decay, hangs) = (0.4 / 6.0, 0.5 - 2.0 * 9.81 / 3.0);
    let rate = (1.0_f64 - decay * decay).sqrt();
    for formulation in ["joint", "cartesian"] {
        let report = run_text(&scene, &["simulation.t_end=3", &format!("simulation.formulation={formulation}")]);
        for (k, x) in column(&report, "s").iter().enumerate() {
            let t = 0.01 * k as f64;
            let swing = (rate * t).cos() + decay / rate * (rate * t).sin();
            let exact = hangs * (1.0 - (-decay * t).exp() * swing);
            assert!((x - exact).abs() < 1e-8, "{formulation} {t}: {x} {exact}");
        }
    }
}

/// The places of bodies in a scene, in the order of the file.
fn places(scene: &str) -> Vec<Vec<f64>> {
    let lists = scene.lines().filter_map(|line| line.strip_prefix("position = [")?.strip_suffix(']'));
    lists.map(|list| list.split(", ").map(|number| number.parse().unwrap()).collect()).collect()
}

/// All turns by right angles: what two axes say is what becomes of a point.
#[test]
fn axes_of_mjcf_are_those_of_its_bodies() {
    let axes: Vec<[f64; 3]> = (0..6)
        .map(|k| std::array::from_fn(|i| if i == k % 3 { if k < 3 { 1.0 } else { -1.0 } } else { 0.0 }))
        .collect();
    let scratch = Scratch::new();
    for (x, y) in axes.iter().flat_map(|x| axes.iter().map(move |y| (x, y))) {
        if x.iter().zip(y).any(|(x, y)| x * y != 0.0) {
            continue;
        }
        let words = [x, y].map(|axis| axis.map(|number| number.to_string()).join(" ")).join(" ");
        let file = format!(
            "<mujoco><worldbody><body xyaxes=\"{words}\"><geom size=\"1\"/><body pos=\"1 2 3\"><geom size=\"1\"/></body></body>\
             </worldbody></mujoco>"
        );
        let scene = read(&scratch.file("axes.xml", file), scratch.path(), &Options::default()).unwrap().scene;
        let z = [x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]];
        let place = places(&scene).pop().unwrap();
        for (k, found) in place.iter().enumerate() {
            let exact = x[k] + 2.0 * y[k] + 3.0 * z[k];
            assert!((found - exact).abs() < 1e-12, "{words}: {place:?}");
        }
    }
}

/// MuJoCo takes what ties a body to the ground where that is fixed; a scene has no joint from the ground to itself.
#[test]
fn what_ties_nothing_that_moves_is_listed() {
    let file = "<mujoco><worldbody><body name=\"base\"><geom size=\"0.1\"/></body><body name=\"arm\"><joint name=\"j\"/>\
                <geom size=\"0.1\" pos=\"0.3 0 0\"/></body></worldbody><equality><connect name=\"tie\" body1=\"base\" anchor=\"0 0 1\"/>\
                <weld name=\"seam\" body1=\"base\" body2=\"world\"/></equality></mujoco>";
    let scratch = Scratch::new();
    let imported = read(&scratch.file("tied.xml", file), scratch.path(), &Options::default()).unwrap();
    for name in ["`tie`", "`seam`"] {
        assert!(imported.left_out.iter().any(|what| what.starts_with(name)), "{name}: {:?}", imported.left_out);
    }
    run_text(&imported.scene, &[]);
}

/// An orientation that a shape gives stands in place of that of its class, whichever ways the two are given in.
#[test]
fn the_orientation_of_a_shape_counts_before_that_of_its_class() {
    let ways = [
        "quat=\"1 0.5 0.2 0.1\"",
        "euler=\"20 30 40\"",
        "zaxis=\"0.2 0.4 1\"",
        "axisangle=\"1 2 3 50\"",
        "xyaxes=\"1 0.2 0 -0.3 1 0.4\"",
    ];
    let scratch = Scratch::new();
    let scene = |of_class: &str, own: &str| {
        let file = format!(
            "<mujoco><default><default class=\"a\"><geom {of_class}/></default></default><worldbody><body><joint/>\
             <geom class=\"a\" type=\"box\" size=\"0.1 0.2 0.3\" {own}/></body></worldbody></mujoco>"
        );
        read(&scratch.file("turned.xml", file), scratch.path(), &Options::default()).unwrap().scene
    };
    for own in ways {
        for of_class in ways {
            assert_eq!(scene(of_class, own), scene("", own), "{of_class}, {own}");
        }
        assert_eq!(scene(own, ""), scene("", own), "{own}");
    }
}

/// MuJoCo moves and turns a mesh by its `refpos` and `refquat` before it scales it.
#[test]
fn meshes_are_scaled_along_their_own_axes() {
    let scratch = Scratch::new();
    let brick = "v 0 0 0\nv 1 0 0\nv 1 2 0\nv 0 2 0\nv 0 0 3\nv 1 0 3\nv 1 2 3\nv 0 2 3\n\
                 f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
    scratch.file("brick.obj", brick);
    // The middle at (0.5, 1, 1.5); a quarter turn back about z takes (x, y) to (y, -x).
    let expected = [
        ("", [0.5, 1.0, 1.5]),
        ("refpos=\"0.1 0.2 0.3\"", [0.4, 0.8, 1.2]),
        ("scale=\"1 2 0.5\" refpos=\"0.1 0.2 0.3\"", [0.4, 1.6, 0.6]),
        ("scale=\"2 2 2\" refpos=\"0.1 0.2 0.3\" refquat=\"1 0 0 1\"", [1.6, -0.8, 2.4]),
        ("scale=\"1 2 0.5\" refpos=\"0.1 0.2 0.3\" refquat=\"1 0 0 1\"", [0.8, -0.8, 0.6]),
        ("scale=\"-1 2 0.5\" refquat=\"1 0 0 1\"", [-1.0, -1.0, 0.75]),
    ];
    for (how, middle) in expected {
        let file = format!(
            "<mujoco><asset><mesh name=\"m\" file=\"brick.obj\" {how}/></asset><worldbody><body><joint/>\
             <geom type=\"mesh\" mesh=\"m\"/></body></worldbody></mujoco>"
        );
        let scene = read(&scratch.file("brick.xml", file), scratch.path(), &Options::default()).unwrap().scene;
        let com = scene.lines().find_map(|line| line.strip_prefix("com = [")).unwrap().trim_end_matches(']');
        let com: Vec<f64> = com.split(", ").map(|number| number.parse().unwrap()).collect();
        let off = com.iter().zip(middle).map(|(found, exact)| (found - exact).abs()).fold(0.0, f64::max);
        assert!(off < 1e-12, "{how}: {com:?}");
    }
}
