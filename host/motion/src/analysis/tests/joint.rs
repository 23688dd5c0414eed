//! The coordinates of joints against those of bodies.

use super::*;
use crate::analysis::Folding;
use crate::program::JointEquations;

/// A body on a ball joint that carries one on a slide by its first frame, and a free body held by a strut: all kinds of
/// coordinates, a joint that is met from its second frame, and a tree of two parts.
pub(super) fn branches() -> String {
    let body = |name: &str, at: [f64; 3]| {
        format!(
            "[[body]]\nname = \"{name}\"\nmass = 1.3\ninertia = [0.11, 0.13, 0.17, 0.01, -0.02, 0.015]\n\
             com = [0.1, -0.05, 0.02]\nposition = {at:?}\norientation = {{ axis = [1, 2, 3], angle = 0.7 }}\n"
        )
    };
    let joint = |name: &str, kind: &str, i: &str, j: &str, at: [f64; 3]| {
        format!(
            "[[joint]]\nname = \"{name}\"\ntype = \"{kind}\"\nbodies = [\"{i}\", \"{j}\"]\npoint = {at:?}\n\
             axis = [0.2, 1, -0.4]\n"
        )
    };
    [
        "[simulation]\ngravity = [0.3, -9.81, 0.5]\nt_end = 1\noutput_step = 0.1\n".to_string(),
        body("a", [0.3, 0.2, -0.1]),
        body("b", [0.9, 0.1, 0.4]),
        body("c", [-0.5, 0.3, 0.2]),
        body("d", [2.0, 0.3, 0.2]),
        joint("ball", "ball", "ground", "a", [0.1, 0.1, 0.0]),
        joint("way", "slide", "b", "a", [0.6, 0.2, 0.1]),
        joint("pin", "hinge", "c", "a", [-0.2, 0.2, 0.1]),
        "[[force]]\nname = \"stay\"\ntype = \"strut\"\nbodies = [\"a\", \"d\"]\n\
         points = [[0.4, 1, 0], [1.8, 0.3, 0.5]]\nparams = { stiffness = 50, damping = 3, free_length = 0.8 }\n"
            .to_string(),
    ]
    .concat()
}

/// A pendulum whose angle is prescribed: a row that depends on time stays.
fn driven() -> String {
    scenes::pendulum("[simulation]\ngravity = [0, -9.81, 0]\nt_end = 1\noutput_step = 0.1\n")
        + "[[joint]]\nname = \"motor\"\ntype = \"drive\"\nbodies = [\"ground\", \"rod\"]\npoint = [0, 0, 0]\n\
           axis = [0, 0, 1]\nparams = { speed = 2 }\n"
}

/// A chain whose first and last rod share a point: a loop in space, closed between bodies that move.
fn tied() -> String {
    chain(4) + "[[joint]]\nname = \"tie\"\ntype = \"ball\"\nbodies = [\"rod0\", \"rod3\"]\npoint = [0.5, 0.7, 0.3]\n"
}

pub(super) fn all_scenes() -> Vec<String> {
    vec![scenes::tangle(), scenes::opaque_tangle(), scenes::four_bar(1.1), branches(), driven(), tied()]
}

/// A state of the bodies in the coordinates of joints.
fn in_joints(form: &mut JointForm, working: &[f64]) -> Vec<f64> {
    let mut state = vec![f64::NAN; form.groups().len()];
    form.state_of(working, &mut state);
    state
}

/// A scene in the coordinates of joints, planned, with all coordinates of the tree.
pub(super) fn joint_plan(text: &str) -> (Prepared, JointPlan) {
    joint_plan_by(text, false)
}

/// The same; `folds`: coordinates that follow others are written out.
pub(super) fn joint_plan_by(text: &str, folds: bool) -> (Prepared, JointPlan) {
    let prepared = prepared(text);
    let Prepared { model, equations, assembly, plan, .. } = &prepared;
    let tree = JointPlan::tree(equations, model, assembly).unwrap();
    let folding = if folds { Folding::WherePossible } else { Folding::Never };
    let planned = JointPlan::new(equations, model, &plan.layout, tree, (assembly, 0.0), folding).unwrap().unwrap();
    (prepared, planned)
}

/// What was found for one state of the bodies is not taken for another one.
#[test]
fn the_state_follows_the_bodies() {
    for text in all_scenes() {
        let mut form = joint_form(&text);
        let Prepared { model, assembly, .. } = prepared(&text);
        let mut faster = assembly.working.clone();
        faster.chunks_exact_mut(13).take(model.bodies.len()).for_each(|body| {
            body[7..].iter_mut().for_each(|velocity| *velocity = 2.0 * *velocity + 0.5);
        });
        let first = in_joints(&mut form, &assembly.working);
        let other = in_joints(&mut form, &faster);
        assert_ne!(first, other);
        assert_eq!(in_joints(&mut form, &assembly.working), first);
        assert_eq!(in_joints(&mut joint_form(&text), &faster), other);
    }
}

fn joint_form(text: &str) -> JointForm {
    joint_form_by(text, false)
}

fn joint_form_by(text: &str, folds: bool) -> JointForm {
    let (Prepared { mut model, equations, assembly, plan }, planned) = joint_plan_by(text, folds);
    let length = assembly.scales.length;
    let bodies = WorkingParts::new(&equations, &model, &plan, length);
    let mut form = JointForm::new(planned, &mut model, &plan.layout, bodies).unwrap();
    form.set_discrete(&assembly.references, &assembly.discrete);
    form
}

/// A parallelogram on a body that turns about an oblique axis.
fn carried_four_bar() -> String {
    scenes::four_bar(1.1).replace("\"ground\"", "\"base\"")
        + "[[body]]\nname = \"base\"\nmass = 2.5\ninertia = [0.3, 0.2, 0.4]\nposition = [0, 0, 0]\n\
           [[joint]]\nname = \"turntable\"\ntype = \"hinge\"\nbodies = [\"ground\", \"base\"]\npoint = [0.2, 0, 0.1]\n\
           axis = [0.3, 1, 0.2]\n"
}

/// All scenes with all coordinates, and those with coordinates that follow others without these.
fn all_forms() -> Vec<(String, bool)> {
    let mut list: Vec<(String, bool)> = all_scenes().into_iter().map(|text| (text, false)).collect();
    list.extend([scenes::four_bar(1.1), carried_four_bar(), two_of(&scenes::four_bar(1.1))].map(|text| (text, true)));
    list
}

/// A four-bar with a second one beside it that shares its crank.
fn two_of(four_bar: &str) -> String {
    let (s, c) = 1.1_f64.sin_cos();
    let hinge = |name: &str, i: &str, j: &str, from: [f64; 2], local: f64| {
        format!(
            "[[joint]]\nname = \"{name}\"\ntype = \"hinge\"\nbodies = [\"{i}\", \"{j}\"]\n\
             frames = [{{ position = [{:?}, {:?}, 0] }}, {{ position = [{local:?}, 0, 0] }}]\n",
            from[0], from[1]
        )
    };
    let rod = |name: &str, x: f64, y: f64, angle: f64| {
        format!(
            "[[body]]\nname = \"{name}\"\nmass = 1.5\ninertia = [0.01, 0.1, 0.1]\nposition = [{x:?}, {y:?}, 0]\n\
             orientation = {{ axis = [0, 0, 1], angle = {angle:?} }}\n"
        )
    };
    four_bar.to_string()
        + &rod("far", 2.0 + 0.5 * c, 0.5 * s, 1.1)
        + &rod("second", 1.5 + c, s, 0.0)
        + &hinge("E", "ground", "far", [2.0, 0.0], -0.5)
        + &hinge("F", "right", "second", [0.5, 0.0], -0.5)
        + &hinge("G", "second", "far", [0.5, 0.0], 0.5)
}

/// Positions and velocities of all bodies at a state of the joints.
fn bodies_at(form: &mut JointForm, state: &[f64], bodies: usize, layout: &Layout) -> Vec<f64> {
    let inputs = form.observe(TIME, state, false).unwrap().inputs;
    (0..bodies).flat_map(|body| inputs[layout.body_slot(body, 0)..][..13].to_vec()).collect()
}

/// Euler parameters of either sign mean the same.
fn same_sign(ours: &mut [f64], theirs: &[f64]) {
    for (y, other) in ours.chunks_exact_mut(13).zip(theirs.chunks_exact(13)) {
        if y[3..7].iter().zip(&other[3..7]).map(|(a, b)| a * b).sum::<f64>() < 0.0 {
            y[3..7].iter_mut().for_each(|e| *e = -*e);
        }
    }
}

#[test]
fn bodies_come_back_from_the_coordinates_of_their_joints() {
    let mut random = Random(401);
    for (text, folds) in all_forms() {
        let mut form = joint_form_by(&text, folds);
        let mut stand = stand(&text);
        for _ in 0..10 {
            let working = stand.consistent(&mut random, 0.2);
            let state = in_joints(&mut form, &working);
            let bodies = stand.layout.bodies;
            let mut found = bodies_at(&mut form, &state, bodies, &stand.layout);
            same_sign(&mut found, &working[..13 * bodies]);
            let off = difference(&found, &working[..13 * bodies]);
            assert!(off < 1e-11, "{off:e}");
        }
    }
}

#[test]
fn the_bodies_accelerate_as_in_their_own_coordinates() {
    let mut random = Random(403);
    for (text, folds) in all_forms() {
        let mut form = joint_form_by(&text, folds);
        let mut stand = stand(&text);
        let bodies = stand.layout.bodies;
        for _ in 0..10 {
            let working = stand.consistent(&mut random, 0.1);
            let inputs = stand.inputs(&working);
            let expected = stand.accelerations(&inputs);
            let state = in_joints(&mut form, &working);
            let mut rates = vec![f64::NAN; state.len()];
            form.rates(TIME, &state, &mut rates).unwrap();
            // Velocities of the bodies a little later and a little earlier.
            let step = 1e-5;
            let mut velocities = |sign: f64| -> Vec<f64> {
                let moved: Vec<f64> = state.iter().zip(&rates).map(|(y, rate)| y + sign * step * rate).collect();
                let found = bodies_at(&mut form, &moved, bodies, &stand.layout);
                found.chunks_exact(13).flat_map(|y| y[7..13].to_vec()).collect()
            };
            let (after, before) = (velocities(1.0), velocities(-1.0));
            let found: Vec<f64> = after.iter().zip(&before).map(|(a, b)| (a - b) / (2.0 * step)).collect();
            let off = difference(&found, expected.as_slice());
            assert!(off < 1e-7, "{off:e}");
            // Rates of element states and power need no differences.
            let from = state.len() - stand.layout.states - 1;
            let mut theirs = vec![f64::NAN; working.len()];
            stand.form.rates(TIME, &working, &mut theirs).unwrap();
            let off = difference(&rates[from..], &theirs[13 * bodies..]);
            assert!(off < 1e-11, "{off:e}");
        }
    }
}

#[test]
fn rates_straight_from_the_regular_engine_are_those_of_the_long_way() {
    let mut random = Random(403);
    let mut plain = 0;
    for (text, folds) in all_forms() {
        let mut form = joint_form_by(&text, folds);
        let mut stand = stand(&text);
        for _ in 0..10 {
            let working = stand.consistent(&mut random, 0.1);
            let mut state = in_joints(&mut form, &working);
            let (mut expected, mut found) = (vec![f64::NAN; state.len()], vec![f64::NAN; state.len()]);
            crate::analysis::passage::rates(&mut form, TIME, &state, &mut expected).unwrap();
            let before = form.counters().evaluations;
            if form.plain_rates(TIME, &state, &mut found).unwrap() {
                plain += 1;
                assert!(found.iter().zip(&expected).all(|(a, b)| a.to_bits() == b.to_bits()), "{found:?} {expected:?}");
                assert_eq!(form.counters().evaluations, before + 1);
            }
            // What has no rates is left to the long way, which says so.
            state[0] = f64::NAN;
            assert!(!form.plain_rates(TIME, &state, &mut found).unwrap());
            form.rates(TIME, &state, &mut found).unwrap_err();
        }
    }
    assert!(plain >= 60, "{plain}");
}

#[test]
fn projection_closes_loops_and_keeps_them_closed() {
    let mut random = Random(405);
    for text in [scenes::four_bar(1.1), driven(), tied()] {
        let mut form = joint_form(&text);
        let mut stand = stand(&text);
        let mut start = vec![0.0; form.groups().len()];
        let working = stand.consistent(&mut random, 0.0);
        form.state_of(&working, &mut start);
        for _ in 0..10 {
            let mut state: Vec<f64> = start.iter().map(|x| x + 0.05 * random.next()).collect();
            form.project(TIME, &mut state).unwrap();
            let bodies = bodies_at(&mut form, &state, stand.layout.bodies, &stand.layout);
            let mut working = working.clone();
            working[..bodies.len()].copy_from_slice(&bodies);
            let inputs = stand.form.observe(TIME, &working, false).unwrap().inputs.to_vec();
            let values: Vec<Node> = stand.equations.rows.iter().map(|row| row.value).collect();
            assert!(stand.values(&values, &inputs).amax() < 1e-14);
            let times: Vec<Node> = stand.equations.rows.iter().map(|row| row.time).collect();
            let rates = stand.jacobian(&inputs) * stand.velocities(&working) + stand.values(&times, &inputs);
            assert!(rates.amax() < 1e-13, "{:e}", rates.amax());
        }
    }
}

#[test]
fn states_that_nothing_constrains_stay_as_they_are() {
    let mut random = Random(419);
    // A chain has neither rows nor Euler parameters, branches have the latter, a loop has rows.
    for (text, is_free, stepped) in [(chain(3), true, 1), (branches(), false, 1), (scenes::four_bar(1.1), false, 3)] {
        let mut form = joint_form(&text);
        assert_eq!(form.is_free(), is_free);
        // Corrections are programs of every step where there are rows.
        assert_eq!(form.programs().iter().filter(|used| used.stepped).count(), stepped);
        let state = random.vector(form.groups().len());
        let mut projected = state.clone();
        if is_free {
            form.project(TIME, &mut projected).unwrap();
            assert_eq!(projected, state);
        }
    }
}

#[test]
fn derivatives_of_the_rates_are_what_differences_say() {
    let mut random = Random(407);
    for text in [scenes::tangle(), scenes::four_bar(1.1), branches(), driven(), tied(), scenes::coupled_tangle()] {
        let mut form = joint_form(&text);
        let mut stand = stand(&text);
        let n = form.groups().len();
        for _ in 0..5 {
            let working = stand.consistent(&mut random, 0.05);
            let state = in_joints(&mut form, &working);
            let mut matrix = vec![0.0; n * n];
            assert!(form.jacobian(TIME, &state, &mut |i, j, value| matrix[i + n * j] += value).unwrap());
            for _ in 0..5 {
                let direction: Vec<f64> = (0..n).map(|_| random.next()).collect();
                let step = 1e-5;
                let mut rates = |sign: f64| {
                    // Rates do not depend on the lengths of Euler parameters, but those of the parameters themselves do.
                    let moved: Vec<f64> = state.iter().zip(&direction).map(|(y, d)| y + sign * step * d).collect();
                    let mut rates = vec![0.0; n];
                    form.rates(TIME, &moved, &mut rates).unwrap();
                    rates
                };
                let (after, before) = (rates(1.0), rates(-1.0));
                let found: Vec<f64> = after.iter().zip(&before).map(|(a, b)| (a - b) / (2.0 * step)).collect();
                let exact: Vec<f64> = (0..n).map(|i| (0..n).map(|j| matrix[i + n * j] * direction[j]).sum()).collect();
                assert!(difference(&exact, &found) < 1e-6, "{:e}", difference(&exact, &found));
            }
        }
    }
}

#[test]
fn the_tree_takes_what_offers_coordinates_and_leaves_the_rest() {
    let named = |text: &str| -> Vec<(Option<String>, bool)> {
        let (prepared, planned) = joint_plan(text);
        let name = |element: usize| prepared.model.elements[element].name.clone();
        planned.tree.joints.iter().map(|joint| (joint.element.map(name), joint.reversed)).collect()
    };
    let some = |name: &str, reversed: bool| (Some(name.to_string()), reversed);
    // The screw's mobility is not offered; its body floats and keeps the rows.
    assert_eq!(named(&scenes::tangle()), [some("base", false), (None, false)]);
    assert_eq!(named(&scenes::opaque_tangle()), [(None, false), (None, false)]);
    // The joint furthest from the ground closes the loop.
    assert_eq!(named(&scenes::four_bar(1.1)), [some("A", false), some("B", false), some("C", false)]);
    assert_eq!(named(&branches()), [some("ball", false), some("way", true), some("pin", true), (None, false)]);
}

#[test]
fn rows_that_hold_wherever_the_joints_are_are_left_out() {
    let (_, planned) = joint_plan(&scenes::four_bar(1.1));
    // One hinge of five rows closes the loop; out of the plane three of them always hold.
    let velocities = planned.equations.coordinates.columns;
    assert_eq!((velocities, planned.rows.len(), planned.independent.len(), planned.met.len()), (3, 2, 2, 3));
}

#[test]
fn parallelograms_need_one_coordinate_and_no_rows() {
    for (text, velocities) in [(scenes::four_bar(1.1), 1), (carried_four_bar(), 2), (two_of(&scenes::four_bar(1.1)), 1)]
    {
        let (_, planned) = joint_plan_by(&text, true);
        let (_, all) = joint_plan(&text);
        assert_eq!((planned.equations.coordinates.columns, planned.rows.len()), (velocities, 0));
        assert_eq!(planned.met.len(), all.met.len() + all.rows.len());
        assert!(planned.tree.followers.iter().flat_map(|f| &f.of).all(|(_, factor)| factor.abs() == 1.0));
    }
    // A coupler that is longer by a few nanometres.
    let end = "[{ position = [0.5, 0.0, 0] }, { position = [0.5, 0, 0] }]";
    let longer = scenes::four_bar(1.1).replace(end, "[{ position = [0.500000003, 0, 0] }, { position = [0.5, 0, 0] }]");
    assert_ne!(longer, scenes::four_bar(1.1));
    let (_, planned) = joint_plan_by(&longer, true);
    assert_eq!((planned.equations.coordinates.columns, planned.rows.len()), (3, 2));
    // Wholly, or not at all.
    let wholly = |text: &str| {
        let Prepared { model, equations, assembly, plan, .. } = &prepared(text);
        let tree = JointPlan::tree(equations, model, assembly).unwrap();
        let planned = JointPlan::new(equations, model, &plan.layout, tree, (assembly, 0.0), Folding::Wholly).unwrap();
        planned.map(|planned| (planned.equations.coordinates.columns, planned.rows.len()))
    };
    assert_eq!(wholly(&two_of(&scenes::four_bar(1.1))), Some((1, 0)));
    assert_eq!(wholly(&longer), None);
}

/// A chain of hinges about axes that lie askew, each rod hung on the end of the one before.
pub(super) fn chain(rods: usize) -> String {
    let mut text = "[simulation]\ngravity = [0, 0, -9.81]\nt_end = 1\noutput_step = 0.1\n".to_string();
    for k in 0..rods {
        let before = if k == 0 { "ground".to_string() } else { format!("rod{}", k - 1) };
        let axis = if k % 2 == 0 { [0.1, 1.0, 0.2] } else { [-0.3, 0.2, 1.0] };
        text += &format!(
            "[[body]]\nname = \"rod{k}\"\nmass = 0.7\ninertia = [0.01, 0.08, 0.08]\nposition = [{}, 0, 0]\n\
             [[joint]]\nname = \"hinge{k}\"\ntype = \"hinge\"\nbodies = [\"{before}\", \"rod{k}\"]\n\
             point = [{k}, 0, 0]\naxis = {axis:?}\n",
            k as f64 + 0.5
        );
    }
    text
}

#[test]
fn rows_without_their_frame_are_shorter_and_vanish_with_those_in_it() {
    let mut stand = stand(&tied());
    let (Prepared { model, equations, plan, .. }, planned) = joint_plan(&tied());
    let straight = JointEquations::build_turned(&equations, &model, &plan.layout, &planned.tree).unwrap();
    let in_frame = JointEquations::build(&equations, &model, &plan.layout, &planned.tree);
    let rows = planned.rows.clone();
    assert_eq!(rows.len(), 3);
    let operations = |written: &JointEquations| {
        let chosen = rows.iter().map(|row| &written.rows[*row]);
        let nodes: Vec<Node> =
            chosen.flat_map(|row| row.jacobian.iter().map(|(_, slope)| *slope).chain([row.gamma])).collect();
        Evaluator::new(&written.graph, &nodes).program().operations()
    };
    let (short, long) = (operations(&straight), operations(&in_frame));
    assert!(5 * short < 4 * long, "{short} {long}");
    // Lengths of the three rows together, of their gradients and of gamma do not turn.
    let mut form = joint_form(&tied());
    let mut random = Random(413);
    for _ in 0..5 {
        let working = stand.consistent(&mut random, 0.1);
        let state = in_joints(&mut form, &working);
        let coordinates = &straight.coordinates;
        let mut inputs = vec![0.0; coordinates.input_count];
        (0..coordinates.motion).for_each(|k| inputs[coordinates.slot_of(k)] = state[k]);
        let found = [&straight, &in_frame].map(|written| {
            let columns = coordinates.columns;
            let chosen = || rows.iter().map(|row| &written.rows[*row]);
            let mut nodes: Vec<Node> = chosen().map(|row| row.value).collect();
            nodes.extend(chosen().map(|row| row.gamma));
            nodes.extend(chosen().flat_map(|row| row.jacobian.iter().map(|(_, slope)| *slope)));
            let places: Vec<usize> = chosen().flat_map(|row| row.jacobian.iter().map(|(column, _)| *column)).collect();
            let mut evaluator = Evaluator::new(&written.graph, &nodes);
            let outputs = evaluator.run(&inputs, &model.sets).unwrap();
            assert!(outputs[..3].iter().all(|value| value.abs() < 1e-13));
            let mut squares = vec![0.0; columns + 1];
            squares[columns] = outputs[3..6].iter().map(|x| x * x).sum();
            places.iter().zip(&outputs[6..]).for_each(|(column, slope)| squares[*column] += slope * slope);
            squares
        });
        assert!(difference(&found[0], &found[1]) < 1e-11, "{found:?}");
    }
}

#[test]
fn quantities_are_the_same_with_and_without_the_bodies() {
    let mut random = Random(401);
    for text in all_scenes() {
        let mut form = joint_form(&text);
        let mut stand = stand(&text);
        let Prepared { equations, .. } = prepared(&text);
        let mut nodes = vec![equations.kinetic, equations.potential];
        nodes.extend(&equations.angles);
        nodes.extend(equations.bodies.iter().flat_map(|body| body.r.into_iter().chain(body.v).chain(body.w)));
        let Some(mut own) = form.own_program(&equations, &nodes) else {
            assert!(!equations.graph.calls.is_empty());
            continue;
        };
        let mut by_bodies = Evaluator::new(&equations.graph, &nodes);
        for _ in 0..10 {
            let working = stand.consistent(&mut random, 0.1);
            let state = in_joints(&mut form, &working);
            let inputs = form.observe(TIME, &state, false).unwrap().inputs.to_vec();
            let expected = by_bodies.run(&inputs, form.sets()).unwrap();
            let off = difference(form.run_own(TIME, &state, &mut own).unwrap(), expected);
            assert!(off < 1e-11, "{off:e}");
        }
    }
}

#[test]
fn accelerations_and_reactions_along_the_tree_are_those_of_the_bodies() {
    let mut random = Random(1307);
    let mut along_the_tree = 0;
    for text in all_scenes() {
        let mut form = joint_form(&text);
        let mut stand = stand(&text);
        let Prepared { mut equations, plan, .. } = prepared(&text);
        let layout = plan.layout.clone();
        let mut nodes: Vec<Node> =
            (layout.acceleration_slot()..layout.multiplier_slot()).map(|slot| equations.graph.input(slot)).collect();
        let multipliers: Vec<Node> =
            (layout.multiplier_slot()..layout.inputs()).map(|slot| equations.graph.input(slot)).collect();
        // What the reactions do to each body is unique even where they are not.
        let mut on_bodies = vec![equations.graph.constant(0.0); layout.velocities()];
        for (row, multiplier) in equations.rows.iter().zip(&multipliers) {
            for (column, slope) in &row.jacobian {
                let term = equations.graph.mul(*slope, *multiplier);
                on_bodies[*column] = equations.graph.add(on_bodies[*column], term);
            }
        }
        nodes.extend(on_bodies);
        if plan.redundant_rows.is_empty() {
            nodes.extend(multipliers);
        }
        let Some(mut solved) = form.solved_program(&equations, &nodes) else {
            assert!(!equations.graph.calls.is_empty());
            continue;
        };
        let mut by_bodies = Evaluator::new(&equations.graph, &nodes);
        for _ in 0..10 {
            let working = stand.consistent(&mut random, 0.1);
            let state = in_joints(&mut form, &working);
            let inputs = form.observe(TIME, &state, true).unwrap().inputs.to_vec();
            let expected = by_bodies.run(&inputs, form.sets()).unwrap();
            let size = expected.iter().fold(1.0_f64, |most, x| most.max(x.abs()));
            let Some(imbalance) = form.run_solved(TIME, &state, &mut solved).unwrap() else { continue };
            along_the_tree += 1;
            let (of_bodies, found) = (&expected[..layout.velocities()], form.accelerations(TIME, &state).unwrap());
            let largest = of_bodies.iter().fold(1.0_f64, |most, x| most.max(x.abs()));
            let off = difference(&found.unwrap(), of_bodies) / largest;
            assert!(off < 1e-6, "{off:e}");
            let off = difference(solved.outputs(), expected) / size;
            assert!(off < 1e-11 && imbalance.share < 1e-12, "{off:e} {imbalance:?}");
        }
    }
    assert!(along_the_tree >= 40, "{along_the_tree}");
}

#[test]
fn reactions_in_a_mode_look_at_nothing_that_is_apart() {
    let mut random = Random(2713);
    let text = scenes::four_bar(1.1)
        + "[[body]]\nname = \"far\"\nmass = 1.5\ninertia = [0.01, 0.1, 0.1]\nposition = [4, 0, 0]\n\
           [[joint]]\nname = \"E\"\ntype = \"hinge\"\nbodies = [\"ground\", \"far\"]\npoint = [3.5, 0, 0]\naxis = [0, 0, 1]\n";
    let (mut form, mut stand) = (joint_form(&text), stand(&text));
    let Prepared { mut equations, plan, .. } = prepared(&text);
    let layout = plan.layout.clone();
    let slots = layout.multiplier_slot()..layout.multiplier_slot() + layout.rows_of(0).len();
    let nodes: Vec<Node> = slots.map(|slot| equations.graph.input(slot)).collect();
    let in_mode = equations.in_mode(&[], &layout);
    let [mut whole, mut own] = [&equations, &in_mode].map(|those| form.solved_program(those, &nodes).unwrap());
    let operations = [&whole, &own].map(|solved| solved.evaluator.program().operations());
    assert!(operations[0] > operations[1] + 20, "{operations:?}");
    for _ in 0..10 {
        let working = stand.consistent(&mut random, 0.1);
        let state = in_joints(&mut form, &working);
        let judged = [&mut whole, &mut own].map(|solved| form.run_solved(TIME, &state, solved).unwrap().is_some());
        assert_eq!(judged, [true; 2]);
        assert_eq!(whole.outputs(), own.outputs());
    }
}

#[test]
fn what_hangs_on_more_than_coordinates_is_left_to_the_bodies() {
    let form = joint_form(&scenes::four_bar(1.1));
    let Prepared { equations, plan, .. } = prepared(&scenes::four_bar(1.1));
    assert!(form.own_program(&equations, &equations.bodies[0].r).is_some());
    assert!(form.own_program(&equations, &equations.bodies[0].p).is_none());
    let mut graph = equations.clone();
    let accelerations = [graph.graph.input(plan.layout.acceleration_slot())];
    assert!(form.own_program(&graph, &accelerations).is_none());
}
