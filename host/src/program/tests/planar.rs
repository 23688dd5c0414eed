//! Planar equations against the spatial ones they come from; why other scenes have none.

use super::scene_values;
use crate::model::Model;
use crate::plan::Layout;
use crate::program::{Equations, Node, NotPlanar, Planar, Program};
use crate::tests::{Random, prepared, scenes};

fn find(text: &str) -> (Model, Layout, Equations, Result<Planar, NotPlanar>) {
    let found = prepared(text);
    let layout = found.plan.layout;
    let (equations, model, assembly) = (found.equations, found.model, found.assembly);
    let planar = Planar::find(&equations, &model, &layout, &assembly.working, assembly.scales.length);
    (model, layout, equations, planar)
}

/// Why the plane x-y is none.
#[track_caller]
fn refusal(text: &str) -> String {
    let why = find(text).3.err().unwrap_or_else(|| panic!("planar:\n{text}")).why;
    assert!(why.contains("; y-z: ") && why.contains("; z-x: "), "{why}");
    why.split("; ").next().unwrap().to_owned()
}

/// Random inputs in the plane of a scene.
fn inputs_in_plane(planar: &Planar, layout: &Layout, random: &mut Random) -> Vec<f64> {
    let mut inputs = random.vector(layout.inputs());
    for at in &planar.still {
        let (body, k) = (at / 13, at % 13);
        inputs[layout.body_slot(body, k)] = planar.start[*at];
        // Accelerations across the plane have the place of their velocities.
        if k >= 7 {
            inputs[layout.acceleration_slot() + 6 * body + k - 7] = 0.0;
        }
    }
    for row in (0..layout.rows).filter(|row| !planar.rows.contains(row)) {
        inputs[layout.multiplier_slot() + row] = 0.0;
    }
    inputs
}

/// Everything that the working form evaluates, in two sets of equations of one motion.
fn pairs(spatial: &Equations, planar: &Planar) -> (Vec<Node>, Vec<Node>) {
    let (mut a, mut b) = (spatial.loads.clone(), planar.equations.loads.clone());
    for (old, new) in spatial.rows.iter().zip(&planar.equations.rows) {
        a.extend([old.value, old.time, old.gamma]);
        b.extend([new.value, new.time, new.gamma]);
        for (column, slope) in &old.jacobian {
            // In the plane only what was dropped is zero there.
            let kept = new.jacobian.iter().find(|(k, _)| k == column);
            a.push(*slope);
            b.push(kept.map_or_else(|| zero(planar), |(_, node)| *node));
        }
    }
    for (old, new) in [(spatial.kinetic, planar.equations.kinetic), (spatial.power, planar.equations.power)] {
        a.push(old);
        b.push(new);
    }
    (a, b)
}

fn zero(planar: &Planar) -> Node {
    planar.equations.rows.iter().find(|row| row.jacobian.is_empty()).map(|row| row.value).unwrap()
}

/// Derivatives across the plane of rows that act across it are the one thing that planar equations leave out.
fn differences(spatial: &Equations, planar: &Planar, model: &Model, layout: &Layout, random: &mut Random) -> f64 {
    let inputs = inputs_in_plane(planar, layout, random);
    let (old, new) = pairs(spatial, planar);
    let (old, new) =
        (scene_values(spatial, model, &old, &inputs), scene_values(&planar.equations, model, &new, &inputs));
    let mut worst = 0.0_f64;
    let mut at = layout.velocities();
    let mut compare = |k: usize| {
        let off = (old[k] - new[k]).abs() / old[k].abs().max(1.0);
        worst = if off <= worst { worst } else { off };
    };
    (0..at).for_each(&mut compare);
    for (row, entries) in spatial.rows.iter().enumerate() {
        let acts_along = planar.rows.contains(&row);
        (at..at + 3).for_each(&mut compare);
        for (k, (column, _)) in entries.jacobian.iter().enumerate() {
            let along = [(planar.normal + 1) % 3, (planar.normal + 2) % 3, 3 + planar.normal].contains(&(column % 6));
            if acts_along || along {
                compare(at + 3 + k);
            }
        }
        at += 3 + entries.jacobian.len();
    }
    (at..old.len()).for_each(&mut compare);
    worst
}

#[test]
fn a_four_bar_moves_in_its_plane_and_its_equations_are_those_of_space() {
    let (model, layout, spatial, planar) = find(&scenes::four_bar(1.1));
    let planar = planar.unwrap_or_else(|reason| panic!("{}", reason.why));
    assert_eq!((planar.normal, planar.plane()), (2, "x-y"));
    // x and y of every hinge.
    assert_eq!(planar.rows, [0, 1, 5, 6, 10, 11, 15, 16]);
    assert_eq!(planar.still.len(), 3 * 6);
    let mut random = Random(11);
    for _ in 0..10 {
        let off = differences(&spatial, &planar, &model, &layout, &mut random);
        assert!(off < 1e-13, "{off:e}");
    }
    let operations = |equations: &Equations, rows: &[usize]| {
        let rows = rows.iter().map(|row| &equations.rows[*row]);
        let entries = rows.flat_map(|row| row.jacobian.iter().map(|(_, node)| *node).chain([row.gamma]));
        let nodes: Vec<Node> = equations.loads.iter().copied().chain(entries).collect();
        Program::compile(&equations.graph, &nodes).operations()
    };
    let all: Vec<usize> = (0..20).collect();
    let (before, after) = (operations(&spatial, &all), operations(&planar.equations, &planar.rows));
    assert!(4 * after < before, "{after} of {before}");
}

#[test]
fn the_plane_may_be_any_of_the_grounds_and_bodies_may_be_turned_over() {
    let turned = |text: &str, from: &str, to: &str| text.replace(from, to);
    let pendulum = scenes::pendulum("[simulation]\ngravity = [0, -9.81, 0]\nt_end = 1\noutput_step = 0.1");
    let (.., planar) = find(&pendulum);
    assert_eq!(planar.map(|p| p.normal).ok(), Some(2));
    // Upright in the plane y-z.
    let other = turned(&pendulum, "axis = [0, 0, 1]", "axis = [1, 0, 0]");
    let other = turned(&other, "position = [0.5, 0, 0]", "position = [0, 0.5, 0]");
    let other = turned(&other, "gravity = [0, -9.81, 0]", "gravity = [0, 0, -9.81]");
    let (.., planar) = find(&other);
    assert_eq!(planar.map(|p| p.normal).ok(), Some(0));
    // Half a turn about an axis in the plane.
    let over = turned(
        &pendulum,
        "position = [0.5, 0, 0]",
        "position = [0.5, 0, 0]\norientation = { axis = [1, 1, 0], angle = \"180 deg\" }",
    );
    let (model, layout, spatial, planar) = find(&over);
    let planar = planar.unwrap_or_else(|reason| panic!("{}", reason.why));
    let off = differences(&spatial, &planar, &model, &layout, &mut Random(5));
    assert!(off < 1e-13, "{off:e}");
}

#[test]
fn what_leaves_the_plane_is_named() {
    let gravity = |g: &str| format!("[simulation]\ngravity = [{g}]\nt_end = 1\noutput_step = 0.1");
    let pendulum = scenes::pendulum(&gravity("0, -9.81, 0"));
    assert_eq!(refusal(&scenes::pendulum(&gravity("0, -9.81, 1"))), "x-y: a force on `rod` may act across it");
    let with = |key: &str| pendulum.replace("position = [0.5, 0, 0]", &format!("position = [0.5, 0, 0]\n{key}"));
    assert_eq!(refusal(&with("com = [0, 0, 0.1]")), "x-y: `pivot: x` holds along and across it");
    let tilted = "orientation = { axis = [1, 0, 0], angle = 0.3 }";
    assert_eq!(refusal(&with(tilted)), "x-y: `rod` is turned out of it at the start");
    let mixed = pendulum.replace("[0.01, 0.1, 0.1]", "[0.01, 0.1, 0.1, 0, 0.01, 0]");
    assert_eq!(refusal(&mixed), "x-y: `rod` has products of inertia with its normal");
    let free = pendulum.split("[[joint]]").next().unwrap().to_owned() + "velocity = [0, 0, 1]\n";
    let thrown = free.replace("[0, -9.81, 0]", "[1, -9.81, 0]");
    assert_eq!(refusal(&thrown), "x-y: `rod` moves out of it at the start");
    let opaque = find(&scenes::opaque_tangle()).3.err().unwrap().why;
    assert_eq!(opaque, "equations of opaque elements are not known");
}
