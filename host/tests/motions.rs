//! `inverse`, `kinematics`, `loads` and `balance` as a user meets them: exit codes, streams, files. The scenes here need no library of
//! elements.
#![cfg(feature = "cli")]
#![allow(clippy::unwrap_used)] // in a test, the panic is the message

use std::fs;

mod support;

use support::{Scratch, rows};

/// A point mass of 2 kg.
const POINT: &str = r#"
title = "Point"
[simulation]
gravity = [0, 0, -10]
t_end = 1
output_step = 0.1
[[body]]
name = "point"
mass = 2
particle = true
velocity = [1, 0, 0]
[[output]]
name = "x"
quantity = "position"
of = "point"
component = "x"
[[output]]
name = "y"
quantity = "position"
of = "point"
component = "y"
[[output]]
name = "z"
quantity = "position"
of = "point"
component = "z"
"#;

#[test]
fn efforts_go_into_files_that_scenes_and_reports_take() {
    let scratch = Scratch::new("inverse");
    scratch.file("point.toml", POINT);
    let lines =
        ["t [s],x [mm],x' [m/s],x'' [m/s^2],y,y',y'',z,z',z''", "0,0,0,2,0,0,0,0,0,0", "0.5,250,1,2,0,0,0,0,0,0"];
    scratch.file("motion.csv", &lines.join("\n"));
    let ran = scratch.odyn("inverse point.toml --motion motion.csv --every 0.1").ends_with(0);
    assert!(ran.out().contains("x.effort: 4 to 4 N"), "{}", ran.out());
    let efforts = fs::read_to_string(scratch.0.join("results/point-inverse/efforts.csv")).unwrap();
    assert!(efforts.starts_with("t [s],x.effort [N],y.effort [N],z.effort [N]\n0.0,4.0,0.0,20.0\n"), "{efforts}");
    assert_eq!(rows(&scratch.0.join("results/point-inverse/results.csv")), 6);
    scratch.odyn("report results/point-inverse -o page.html").ends_with(0);
    let json = scratch.odyn("inverse point.toml --motion motion.csv --json -o out").ends_with(0).json();
    assert_eq!((&json["freedoms"], &json["efforts"][2][1]), (&3.into(), &20.0.into()));
    // What is not prescribed is free; what nothing moves is named.
    let ran = scratch.odyn("inverse point.toml --motion motion.csv --follow x,y").ends_with(5);
    assert!(ran.err().contains("leave this free: `point` moves along (0.000, 0.000, "), "{}", ran.err());
    let ran = scratch.odyn("inverse point.toml --motion motion.csv --by x,y").ends_with(5);
    assert!(ran.err().contains("no actuator moves this: `point` moves along (0.000, 0.000, "), "{}", ran.err());
    scratch.odyn("inverse point.toml --motion none.csv").ends_with(8);
}

#[test]
fn mechanisms_without_drive_or_ground_are_refused() {
    let scratch = Scratch::new("kinematics");
    scratch.file("point.toml", POINT);
    let ran = scratch.odyn("kinematics point.toml").ends_with(5);
    assert!(ran.err().contains("no joint of the scene depends on time"), "{}", ran.err());
    scratch.odyn("kinematics point.toml --drive x=1:2").ends_with(2);
    // As any name that the scene does not have.
    scratch.odyn("kinematics point.toml --drive nothing").ends_with(3);
    let ran = scratch.odyn("kinematics point.toml --drive x").ends_with(5);
    assert!(ran.err().contains("3 freedoms"), "{}", ran.err());
    let ran = scratch.odyn("balance point.toml --turn x").ends_with(5);
    assert!(ran.err().contains("no angle of a joint"), "{}", ran.err());
    for turns in ["0", "-1", "1.5", "two"] {
        let ran = scratch.odyn(&format!("balance point.toml --turn x --turns {turns}")).ends_with(2);
        assert!(ran.err().contains("not a whole number of 1 or more"), "{}", ran.err());
    }
}

#[test]
fn loads_are_written_for_finite_elements() {
    let scratch = Scratch::new("loads");
    let ran = scratch.odyn("loads brick.toml --body brick --at 0,0.5s --format calculix --units m").ends_with(0);
    assert!(ran.out().starts_with("loads on brick at 2 times; in balance to "), "{}", ran.out());
    let folder = scratch.0.join("results/brick-loads");
    let step = fs::read_to_string(folder.join("step-2.inp")).unwrap();
    assert!(step.contains("EALL, CENTRIF, ") && step.contains("*STATIC"), "{step}");
    assert_eq!(rows(&folder.join("loads.csv")), 5);
    // Fewer instants leave no step of those before.
    scratch.odyn("loads brick.toml --body brick --at 0 --format calculix --units m").ends_with(0);
    assert!(folder.join("step-1.inp").exists() && !folder.join("step-2.inp").exists());
    // Of a body that falls, nothing but its weight is against its inertia: both are printed.
    let falls =
        scratch.odyn("loads brick.toml --body brick --at 0 --set simulation.gravity=[0,0,-10] -o fall").ends_with(0);
    let sizes = |name: &str| {
        let rows = falls.out();
        let row = rows.lines().find_map(|line| line.trim().strip_prefix(name)).unwrap_or_else(|| panic!("{rows}"));
        row.split_whitespace().next().unwrap().parse::<f64>().unwrap()
    };
    assert!(sizes("weight") > 0.0 && sizes("weight") == sizes("inertia"), "{}", falls.out());
    let ran = scratch.odyn("loads brick.toml --body brock").ends_with(3);
    assert!(ran.err().contains("did you mean `brick`?"), "{}", ran.err());
    for wrong in ["soon", "start", "0,equilibrium", "0.2kg"] {
        scratch.odyn(&format!("loads brick.toml --body brick --at {wrong}")).ends_with(2);
    }
    for wrong in
        ["--first-node 0", "--first-node -1", "--first-node 99999999999", "--elset 1", "--elset a,b", "--elset ="]
    {
        scratch.odyn(&format!("loads brick.toml --body brick --format calculix {wrong}")).ends_with(2);
    }
}

/// A folder of results names its scene: loads are those of the scene as it is, which may not be that of the run any more.
#[test]
fn loads_of_results_say_whether_the_scene_was_changed_since() {
    let scratch = Scratch::new("loads-of-results");
    scratch.file("point.toml", POINT);
    scratch.odyn("run point.toml").ends_with(0);
    let loads = || scratch.odyn("loads results/point --body point --at 0 -o loads").ends_with(0).out().to_string();
    assert!(!loads().contains("was changed"), "{}", loads());
    scratch.file("point.toml", &POINT.replace("mass = 2", "mass = 3"));
    let note =
        "note: point.toml was changed since the run in results/point: these are the loads of the scene as it is now";
    assert!(loads().contains(note), "{}", loads());
}
