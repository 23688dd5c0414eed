//! Ranks, unique reactions, islands and offsets of small mechanisms whose answers statics gives.

#![allow(clippy::unwrap_used)] // in a test, the panic is the message

use super::decide::{Rank, unique_reactions};
use super::*;
use crate::analysis::{Constraints, mass_values, start_inputs};
use crate::tests::{Prepared, model, prepared, scenes};

const BODY: &str = "[[body]]\nname = \"NAME\"\nmass = 2\ninertia = [0.2, 0.3, 0.4]\nposition = [0.5, 0, 0]\n";

fn body(name: &str) -> String {
    BODY.replace("NAME", name)
}

fn element(table: &str, name: &str, kind: &str, bodies: [&str; 2], point: [f64; 3]) -> String {
    format!(
        "[[{table}]]\nname = \"{name}\"\ntype = \"{kind}\"\nbodies = {bodies:?}\npoint = {point:?}\naxis = [0, 0, 1]\n"
    )
}

/// A door on the ground with bearings of the given types at the given heights on the z axis.
fn door(bearings: &[(&str, f64)]) -> Prepared {
    let mut text = body("door");
    for (k, (kind, height)) in bearings.iter().enumerate() {
        text += &element("joint", &format!("bearing{k}"), kind, ["ground", "door"], [0.0, 0.0, *height]);
    }
    prepared(&text)
}

/// Uniqueness of force and torque of an element on its second body.
fn on_second(plan: &Plan, element: usize) -> ([bool; 3], [bool; 3]) {
    let reaction = plan.reactions.iter().find(|r| r.element == element && r.frame == 1).unwrap();
    (reaction.force, reaction.torque)
}

const ALL: [bool; 3] = [true; 3];
const NONE: [bool; 3] = [false; 3];

#[test]
fn a_hinge_leaves_one_freedom_and_a_unique_reaction() {
    let plan = door(&[("hinge", 0.0)]).plan;
    assert_eq!((plan.health.rank, plan.mobility, plan.independent_rows.len()), (5, 1, 5));
    assert!(plan.redundant_rows.is_empty() && plan.reactions.iter().all(Reaction::is_unique));
    assert_eq!(plan.always_rank_safe, None);
}

#[test]
fn a_free_body_has_six_freedoms_and_no_rows() {
    let plan = prepared(&body("stone")).plan;
    assert_eq!((plan.health.rank, plan.mobility, plan.layout.rows), (0, 6, 0));
    assert!(plan.reactions.is_empty() && plan.always_rank_safe.is_none());
}

#[test]
fn two_hinges_on_one_axis_share_everything_but_the_torque_about_it() {
    let plan = door(&[("hinge", 0.0), ("hinge", 2.0)]).plan;
    assert_eq!((plan.layout.rows, plan.health.rank, plan.mobility), (10, 5, 1));
    assert_eq!((plan.independent_rows.len(), plan.redundant_rows.len()), (5, 5));
    for hinge in 0..2 {
        assert_eq!(on_second(&plan, hinge), (NONE, [false, false, true]));
        assert!(!plan.is_unique(hinge, 1, false, Some(0)) && plan.is_unique(hinge, 1, true, Some(2)));
        assert!(!plan.is_unique(hinge, 1, true, None));
    }
}

#[test]
fn a_ball_beside_a_hinge_bears_no_torque() {
    let plan = door(&[("hinge", 0.0), ("ball", 2.0)]).plan;
    // Any force at the ball can be taken back by the hinge: 3 self-stresses.
    assert_eq!((plan.health.rank, plan.mobility, plan.redundant_rows.len()), (5, 1, 3));
    assert_eq!(on_second(&plan, 0), (NONE, [false, false, true]));
    assert_eq!(on_second(&plan, 1), (NONE, ALL));
}

#[test]
fn two_balls_stress_each_other_along_their_line_only() {
    let plan = door(&[("ball", 0.0), ("ball", 2.0)]).plan;
    assert_eq!((plan.health.rank, plan.mobility, plan.redundant_rows.len()), (5, 1, 1));
    for ball in 0..2 {
        assert_eq!(on_second(&plan, ball), ([true, true, false], ALL));
    }
    let name = &plan.redundant_rows[0].name;
    assert!(["bearing0: z", "bearing1: z"].contains(&name.as_str()), "{name}");
}

#[test]
fn two_hinges_with_skew_axes_hold_a_door_still() {
    let mut text = body("door");
    text += &element("joint", "one", "hinge", ["ground", "door"], [0.0, 0.0, 0.0]);
    text += &element("joint", "two", "hinge", ["ground", "door"], [0.0, 0.0, 2.0]).replace("[0, 0, 1]", "[1, 0, 0]");
    let plan = prepared(&text).plan;
    assert_eq!((plan.health.rank, plan.mobility, plan.redundant_rows.len()), (6, 0, 4));
}

#[test]
fn a_planar_four_bar_of_spatial_hinges_is_unique_in_its_plane() {
    let plan = prepared(&scenes::four_bar(1.1)).plan;
    assert_eq!((plan.layout.rows, plan.health.rank, plan.mobility), (20, 17, 1));
    assert_eq!((plan.redundant_rows.len(), plan.always_rank_safe.as_ref()), (3, None));
    for hinge in 0..4 {
        assert_eq!(on_second(&plan, hinge), ([true, true, false], [false, false, true]));
        // On the ground, or the first body, as on the second.
        let first = plan.reactions.iter().find(|r| r.element == hinge && r.frame == 0).unwrap();
        assert_eq!((first.force, first.torque), on_second(&plan, hinge));
    }
    // Every row is either enforced or redundant, and the lists ascend.
    let mut rows: Vec<usize> = plan.redundant_rows.iter().map(|r| r.row).chain(plan.independent_rows.clone()).collect();
    rows.sort_unstable();
    assert_eq!(rows, (0..20).collect::<Vec<_>>());
    assert!(plan.independent_rows.is_sorted() && plan.redundant_rows.is_sorted_by_key(|r| r.row));
}

#[test]
fn a_flat_four_bar_has_lost_another_rank() {
    let plan = prepared(&scenes::four_bar(0.0)).plan;
    assert_eq!((plan.health.rank, plan.mobility, plan.redundant_rows.len()), (16, 2, 4));
}

#[test]
fn decisions_do_not_depend_on_units_of_length_and_mass() {
    let plain = prepared(&scenes::four_bar(1.1)).plan;
    let scaled = prepared(&format!("[units]\nlength = \"um\"\nmass = \"t\"\n{}", scenes::four_bar(1.1))).plan;
    assert_eq!(scaled.independent_rows, plain.independent_rows);
    assert_eq!((scaled.redundant_rows, scaled.reactions), (plain.redundant_rows, plain.reactions));
    let ratio = scaled.health.smallest_pivot_ratio / plain.health.smallest_pivot_ratio;
    assert!((ratio - 1.0).abs() < 1e-9, "{ratio}");
}

#[test]
fn reactions_of_force_elements_are_always_unique() {
    let mut text = body("a");
    text += "[[force]]\nname = \"stay\"\ntype = \"strut\"\nbodies = [\"ground\", \"a\"]\npoints = [[0, 0, 0], [1, 0, 0]]\n\
             params = { stiffness = 1 }\n";
    let plan = prepared(&text).plan;
    assert!(plan.is_unique(0, 1, false, None) && plan.is_unique(0, 0, true, Some(1)));
}

/// Bodies a, b, c, d with the elements given.
fn topology(elements: &[String]) -> Topology {
    Topology::new(&model(&(["a", "b", "c", "d"].map(body).concat() + &elements.concat())), &Led::default())
}

fn parts(topology: &Topology) -> Vec<(Vec<usize>, usize)> {
    topology.islands.iter().map(|island| (island.bodies.clone(), island.loops)).collect()
}

#[test]
fn ground_connects_nothing() {
    let at = [0.0; 3];
    let hung = |k: usize, name: &str| element("joint", &format!("j{k}"), "hinge", ["ground", name], at);
    let found = topology(&[hung(0, "a"), hung(1, "c")]);
    assert_eq!(parts(&found), [(vec![0], 0), (vec![1], 0), (vec![2], 0), (vec![3], 0)]);
    assert_eq!(found.islands[2].elements, [1]);
}

#[test]
fn joints_and_forces_connect_but_only_joints_close_loops() {
    let at = [0.0; 3];
    let joint = |k: usize, i: &str, j: &str| element("joint", &format!("j{k}"), "hinge", [i, j], at);
    let friction = element("force", "f", "friction", ["a", "d"], at);
    let found = topology(&[joint(0, "a", "b"), joint(1, "ground", "d"), friction.clone()]);
    assert_eq!(parts(&found), [(vec![0, 1, 3], 0), (vec![2], 0)]);
    assert_eq!(found.islands[0].elements, [0, 1, 2]);
    // a - b - ground - a
    let found = topology(&[joint(0, "a", "b"), joint(1, "ground", "a"), joint(2, "b", "ground"), friction]);
    assert_eq!(parts(&found), [(vec![0, 1, 3], 1), (vec![2], 0)]);
}

#[test]
fn what_follows_time_alone_connects_nothing_and_goes_with_all_that_take_it() {
    let control = |name: &str, of: &str| {
        format!("[[control]]\nname = \"{name}\"\ntype = \"amplifier\"\nparams.factor = 2\ninputs.in = {of}\n")
    };
    let push = |body: &str, signal: &str| {
        format!(
            "[[force]]\nname = \"on_{body}\"\ntype = \"push\"\nbodies = [\"ground\", \"{body}\"]\nparams.factor = 1\n\
             inputs.signal = {signal}\n"
        )
    };
    let seen = "[[output]]\nname = \"SEEN\"\nquantity = \"value\"\nof = \"OF\"\nchannel = \"out\"\n";
    let found = topology(&[
        control("one", "1"),
        control("two", "\"one.out\""),
        control("idle", "\"two.out\""),
        push("b", "\"two.out\""),
        push("d", "\"two.out\""),
        push("c", "\"one.out\""),
        seen.replace("SEEN", "x").replace("OF", "two"),
        seen.replace("SEEN", "y").replace("OF", "idle"),
    ]);
    let of = |of: fn(&Island) -> &Vec<usize>| found.islands.iter().map(|island| of(island).clone()).collect::<Vec<_>>();
    assert_eq!(of(|island| &island.bodies), [[0], [1], [2], [3]]);
    assert_eq!(of(|island| &island.elements), [vec![5], vec![0, 3, 4], vec![2, 3], vec![1, 3, 4]]);
    assert_eq!(of(|island| &island.channels), [vec![1], vec![0], vec![], vec![]]);
}

/// In how many islands each of a table, a body that is welded to it and two that hang on it is.
fn copies(holding: &str) -> Vec<usize> {
    let at = [0.0; 3];
    let bodies = ["table", "cup", "a", "b"].map(body).concat();
    let seat = "[[joint]]\nname = \"seat\"\ntype = \"weld\"\nbodies = [\"table\", \"cup\"]\n\
                frames = [{ position = [0, 0, -0.125] }, { position = [0, 0, 0], axis = [0, 0, 1], x_axis = [0, 1, 0] }]\n";
    let hung = ["a", "b"].map(|name| element("joint", &format!("on_{name}"), "hinge", ["table", name], at)).concat();
    prepared(&(bodies + holding + seat + &hung)).plan.topology.copies
}

#[test]
fn bodies_follow_the_time_where_six_rows_hold_them() {
    let at = [0.0; 3];
    let pin = element("joint", "pin", "hinge", ["ground", "table"], at);
    let drive = element("joint", "motor", "drive", ["ground", "table"], at) + "params.speed = 1\n";
    assert_eq!(copies(&(pin.clone() + &drive)), [2, 2, 1, 1]);
    // Without a drive, or with one that is driven itself by a body that moves.
    assert_eq!(copies(&pin), [1, 1, 1, 1]);
    let other = element("joint", "motor", "drive", ["a", "table"], at) + "params.speed = 1\n";
    assert_eq!(copies(&(pin.clone() + &other)), [1, 1, 1, 1]);
    // Rows that hold twice what others hold are no six; with a drive they are seven, and their loads add up as well.
    let again = element("joint", "again", "hinge", ["ground", "table"], [0.0, 0.0, 1.0]);
    assert_eq!(copies(&(pin.clone() + &again)), [1, 1, 1, 1]);
    assert_eq!(copies(&(pin.clone() + &again + &drive)), [2, 2, 1, 1]);
    // A force that takes its reactions may do so with any power of them.
    let friction = element("force", "friction", "friction", ["ground", "table"], at);
    assert_eq!(copies(&(pin + &drive + &friction)), [2, 2, 1, 1]);
}

/// A strut between two tables that follow the time makes one of them: what stands on either has copies of both.
#[test]
fn what_joins_bodies_that_follow_the_time_belongs_to_all_of_them() {
    let at = [0.0; 3];
    let table = |name: &str, k: usize| {
        element("joint", &format!("pin{k}"), "hinge", ["ground", name], at)
            + &element("joint", &format!("motor{k}"), "drive", ["ground", name], at)
            + "params.speed = 1\n"
    };
    let hung = |name: &str, on: &str| element("joint", &format!("on_{name}"), "hinge", [on, name], at);
    let strut = |name: &str, i: &str, j: &str| {
        format!(
            "[[force]]\nname = \"{name}\"\ntype = \"strut\"\nbodies = [\"{i}\", \"{j}\"]\npoints = [[0, 0, 0], [1, 0, 0]]\n\
             params = {{ stiffness = 1 }}\n"
        )
    };
    let bodies =
        ["one", "two", "three", "a", "b"].map(body).concat() + &table("one", 1) + &table("two", 2) + &table("three", 3);
    let text = bodies + &hung("a", "one") + &hung("b", "one") + &strut("s", "one", "two") + &strut("t", "two", "three");
    let topology = prepared(&text).plan.topology;
    assert_eq!(topology.copies, [2, 2, 2, 1, 1]);
    // The struts act on what follows the time: one island has them.
    let elements: usize = topology.islands.iter().map(|island| island.elements.len()).sum();
    assert_eq!(elements, 2 * 6 + 2 + 2);
}

#[test]
fn every_joint_beyond_a_tree_closes_a_loop() {
    let at = [0.0; 3];
    let joint = |k: usize, i: &str, j: &str| element("joint", &format!("j{k}"), "hinge", [i, j], at);
    let twice = topology(&[joint(0, "a", "b"), joint(1, "b", "a"), joint(2, "a", "b")]);
    assert_eq!(parts(&twice)[0], (vec![0, 1], 2));
    assert_eq!(Topology::new(&model(&scenes::four_bar(1.1)), &Led::default()).islands[0].loops, 1);
}

#[test]
fn a_joint_that_holds_a_body_twice_closes_no_loop_of_its_own() {
    let mut model = model(&(["a", "b"].map(body).concat() + &element("joint", "j", "hinge", ["a", "b"], [0.0; 3])));
    let again = model.elements[0].markers[0].clone();
    model.elements[0].markers.push(again);
    assert_eq!(parts(&Topology::new(&model, &Led::default())), [(vec![0, 1], 0)]);
}

#[test]
fn offsets_are_contiguous_and_rows_find_their_element() {
    let text = scenes::tangle()
        + "[[force]]\nname = \"lag\"\ntype = \"lag\"\nbodies = [\"a\"]\nparams = { tau = 1 }\n"
        + "[[force]]\nname = \"tally\"\ntype = \"tally\"\nbodies = [\"b\"]\n"
        + &element("joint", "again", "ball", ["a", "b"], [0.6, 0.2, 0.1]);
    let model = model(&text);
    let layout = Layout::new(&model);
    // Joints come before forces: hinge 5, screw 5, ball 3 rows.
    assert_eq!(layout.row_at, [0, 5, 10, 13, 13, 13, 13]);
    assert_eq!((layout.rows, layout.states, layout.references, layout.discrete), (13, 1, 2, 2));
    assert_eq!((layout.state_at[5], layout.discrete_at[6], &layout.reference_at[..3]), (0, 0, &[0, 1, 2][..]));
    for row in 0..layout.rows {
        let (element, k) = layout.element_of_row(row);
        assert_eq!(layout.row_at[element] + k, row);
        assert!(k < model.elements[element].rows.len());
    }
}

#[test]
fn every_input_has_a_slot_of_its_own() {
    let model = model(&scenes::tangle());
    let layout = Layout::new(&model);
    let mut slots = vec![Layout::TIME];
    for body in 0..layout.bodies {
        slots.extend((0..17).map(|k| layout.body_slot(body, k)));
    }
    let starts = [
        (layout.state_slot(), layout.states),
        (layout.reference_slot(), layout.references),
        (layout.discrete_slot(), layout.discrete),
        (layout.acceleration_slot(), layout.velocities()),
        (layout.multiplier_slot(), layout.rows),
    ];
    starts.iter().for_each(|(start, count)| slots.extend(*start..start + count));
    assert_eq!(slots, (0..layout.inputs()).collect::<Vec<_>>());
}

/// Windows side by side in the plane z = 0: three redundant rows each. Turned out of any axis, so that no row vanishes.
fn windows(count: usize) -> String {
    let mut text = String::new();
    let named = |name: String, x: f64, y: f64| {
        format!("[[body]]\nname = \"{name}\"\nmass = 1\ninertia = [0.1, 0.2, 0.3]\nposition = [{x}, {y}, 0]\n")
    };
    for k in 0..=count {
        let x = k as f64;
        text += &named(format!("link{k}"), x + 0.2, 0.5);
        text += &element("joint", &format!("a{k}"), "hinge", ["ground", &format!("link{k}")], [x, 0.0, 0.0]);
        if k > 0 {
            let coupler = format!("coupler{k}");
            text += &named(coupler.clone(), x - 0.1, 1.0);
            let (left, right) = (format!("link{}", k - 1), format!("link{k}"));
            text += &element("joint", &format!("b{k}"), "hinge", [&left, &coupler], [x - 0.6, 1.0, 0.0]);
            text += &element("joint", &format!("c{k}"), "hinge", [&coupler, &right], [x + 0.4, 1.0, 0.0]);
        }
    }
    text
}

#[test]
fn elimination_finds_the_dense_rank_and_the_same_unique_reactions() {
    let texts = [windows(1), windows(7), scenes::four_bar(1.1), scenes::tangle()];
    for text in texts {
        let Prepared { model, equations, assembly, plan, .. } = prepared(&text);
        let layout = &plan.layout;
        let all: Vec<usize> = (0..layout.rows).collect();
        let mut rows = Constraints::new(&equations, &all, &[], &[]).unwrap();
        rows.evaluate(&start_inputs(layout, 0.0, &assembly), &model.sets).unwrap();
        let (positions, rotations) = poses_of_bodies(&assembly.working, layout.bodies);
        let mass = mass_values(&model);
        let probe = Probe {
            rows: &all,
            structure: &rows.structure,
            mass: &mass,
            jacobian: rows.jacobian(),
            positions: &positions,
            rotations: &rotations,
            length: assembly.scales.length,
            scales: &body_scales(&model, assembly.scales.length),
        };
        let dense = Rank::dense(&probe, &(0..probe.rows.len()).collect::<Vec<_>>()).unwrap();
        let sparse = Rank::by_elimination(layout, &probe).unwrap().unwrap();
        assert_eq!(sparse.health.rank, dense.health.rank);
        assert_eq!(sparse.null_space.len(), dense.null_space.len());
        let reactions = |rank: &Rank| unique_reactions(&model, layout, &probe, &rank.null_space).0;
        assert_eq!(reactions(&sparse), reactions(&dense));
    }
}

#[test]
fn the_length_of_a_row_of_bodies_says_nothing_about_each() {
    let Prepared { model, .. } = door(&[("hinge", 0.0), ("hinge", 0.2)]);
    let scales = body_scales(&model, 1.0);
    for length in [10.0, 400.0, 600.0, 1e6] {
        assert_eq!(body_scales(&model, length), scales, "{length}");
    }
    // A body that is held at its centre only is judged by the others.
    let held = body("door").replace("position = [0.5, 0, 0]", "position = [0, 0, 0]") + &body("other");
    let text = held
        + &element("joint", "centre", "hinge", ["ground", "door"], [0.0; 3])
        + &element("joint", "arm", "hinge", ["ground", "other"], [0.0; 3]);
    let Prepared { model, .. } = prepared(&text);
    let turn = |length: f64| 1.0 / body_scales(&model, length)[3];
    assert_eq!((turn(1.0), turn(20.0)), (1.0, 20.0));
    assert_eq!(turn(1e6), turn(1e3));
}

#[test]
fn a_frame_at_the_centre_of_mass_up_to_round_off_is_no_arm() {
    let held = |position: &str| {
        let held = body("rotor")
            .replace("position = [0.5, 0, 0]", &format!("com = [1.1, 0, 0]\nposition = [{position}, 0, 0]"));
        prepared(&(held + &element("joint", "centre", "hinge", ["ground", "rotor"], [0.0; 3]))).model
    };
    for length in [0.5, 2.0] {
        assert_eq!(body_scales(&held("-1.1000000000000012"), length), body_scales(&held("-1.1"), length));
    }
}

/// A four-bar of hinges about y, but the third about this axis.
fn four_bar(third: [f64; 3]) -> String {
    let places = [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [2.0, 0.0, 2.0], [2.0, 0.0, 0.0]];
    let bars = ["ground", "crank", "coupler", "rocker", "ground"];
    let bodies: String = bars[1..4].iter().map(|name| body(name)).collect();
    let hinge = |k: usize| {
        let axis = if k == 2 { third } else { [0.0, 1.0, 0.0] };
        element("joint", &format!("hinge{k}"), "hinge", [bars[k], bars[k + 1]], places[k])
            .replace("[0, 0, 1]", &format!("{axis:?}"))
    };
    bodies + &(0..4).map(hinge).collect::<String>()
}

#[test]
fn a_loop_whose_axes_are_not_parallel_is_locked_by_the_one_that_is_off() {
    for angle in [1e-7_f64, 1e-5, 1e-3, 0.1] {
        let plan = prepared(&four_bar([angle.sin(), angle.cos(), 0.0])).plan;
        assert_eq!(plan.mobility, 0);
        let [Locked { joints, askew: Some(askew), geared: false }] = &plan.locked[..] else {
            panic!("{:?}", plan.locked)
        };
        assert_eq!((&joints[..], askew.joint, askew.slides), (&[0, 1, 2, 3][..], 2, false));
        assert!((askew.angle - angle).abs() < 1e-9, "{angle}: {askew:?}");
    }
    // Where it is far off, none is nearly in line with the others.
    assert_eq!(
        prepared(&four_bar([0.0, 0.0, 1.0])).plan.locked,
        [Locked { joints: vec![0, 1, 2, 3], askew: None, geared: false }]
    );
    assert_eq!(prepared(&four_bar([0.0, 1.0, 0.0])).plan.locked, []);
    assert_eq!(prepared(&four_bar([0.0, -1.0, 1e-12])).plan.locked, []);
}

#[test]
fn a_locked_loop_is_found_beside_joints_that_move() {
    // A free link in front of the loop, and one behind it.
    let text = four_bar([0.0, 1.0, 1e-4]).replace("\"ground\"", "\"carrier\"");
    let text = body("carrier")
        + &body("tail")
        + &text
        + &element("joint", "front", "hinge", ["ground", "carrier"], [0.0; 3])
        + &element("joint", "behind", "hinge", ["rocker", "tail"], [0.5, 0.0, 0.0]);
    let plan = prepared(&text).plan;
    assert_eq!(plan.mobility, 2);
    assert_eq!(plan.locked.len(), 1);
    assert_eq!((&plan.locked[0].joints[..], plan.locked[0].askew.unwrap().joint), (&[0, 1, 2, 3][..], 2));
}

#[test]
fn what_holds_a_body_just_enough_is_no_locked_loop() {
    for bearings in [&[("ball", 0.0), ("ball", 1.0)][..], &[("hinge", 0.0), ("hinge", 2.0)], &[("hinge", 0.0)]] {
        assert_eq!(door(bearings).plan.locked, []);
    }
}
