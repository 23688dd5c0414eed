//! Accelerations and multipliers.

use super::*;
use crate::analysis::balance::Balance;
use crate::model::{Axes, Quantity};
use crate::program::Row;

/// Tree, tree called at run time, closed loop with redundant rows, driven.
fn all_scenes() -> Vec<String> {
    let driven = scenes::pendulum("[simulation]\ngravity = [0, -9.81, 0]\nt_end = 1\noutput_step = 0.1\n")
        + "[[joint]]\nname = \"motor\"\ntype = \"drive\"\nbodies = [\"ground\", \"rod\"]\npoint = [0, 0, 0]\n\
           axis = [0, 0, 1]\nparams = { speed = 2 }\n";
    vec![scenes::tangle(), scenes::opaque_tangle(), scenes::four_bar(1.1), driven]
}

#[test]
fn accelerations_and_multipliers_solve_the_equations_of_motion() {
    let mut random = Random(101);
    for text in all_scenes() {
        let mut stand = stand(&text);
        let gammas: Vec<Node> = stand.equations.rows.iter().map(|row| row.gamma).collect();
        for _ in 0..10 {
            let state = stand.consistent(&mut random, 0.1);
            let inputs = stand.inputs(&state);
            let (a, lambda) = (stand.accelerations(&inputs), stand.multipliers(&inputs));
            let phi = stand.jacobian(&inputs);
            let loads = stand.values(&stand.equations.loads, &inputs);
            // M a + Phi_q^T lambda = Q
            let reaction = phi.transpose() * lambda;
            let rest = stand.mass() * &a + &reaction - &loads;
            assert!(rest.amax() < 1e-12 * (loads.amax() + reaction.amax()), "{:e}", rest.amax());
            // Phi_q a = gamma
            let gamma = stand.values(&gammas, &inputs);
            let miss = &phi * &a - &gamma;
            assert!(miss.amax() < 1e-12 * (gamma.amax() + a.amax()), "{:e}", miss.amax());
        }
    }
}

/// All reactions that are unique, in one list.
fn unique_reactions(text: &str) -> (Stand, Vec<Node>) {
    let plan = prepared(text).plan;
    let mut stand = stand(text);
    let mut nodes = Vec::new();
    for reaction in &plan.reactions {
        for (torque, unique) in [(false, reaction.force), (true, reaction.torque)] {
            for component in (0..3).filter(|k| unique[*k]) {
                let (element, frame, axes) = (reaction.element, reaction.frame, Axes::Ground);
                let wanted = Quantity::Load { element, frame, torque, axes, component };
                nodes.push(stand.equations.observe(&wanted, &stand.model, &stand.layout));
            }
        }
    }
    (stand, nodes)
}

#[test]
fn both_forms_give_the_same_accelerations_and_unique_reactions() {
    let mut random = Random(103);
    for text in all_scenes() {
        let (mut stand, reactions) = unique_reactions(&text);
        assert!(!reactions.is_empty());
        let mut twin = reference(&text);
        for _ in 0..10 {
            let state = stand.consistent(&mut random, 0.1);
            let inputs = stand.inputs(&state);
            let mut theirs = vec![0.0; twin.groups().len()];
            twin.state_of(&state, &mut theirs);
            let others = twin.observe(TIME, &theirs, true).unwrap().inputs.to_vec();
            let off = difference(stand.accelerations(&others).as_slice(), stand.accelerations(&inputs).as_slice());
            assert!(off < 1e-11, "accelerations differ by {off:e}");
            let (ours, theirs) = (stand.values(&reactions, &inputs), stand.values(&reactions, &others));
            let off = difference(theirs.as_slice(), ours.as_slice());
            assert!(off < 1e-11, "reactions differ by {off:e}");
        }
    }
}

#[test]
fn there_are_as_many_idle_reactions_as_redundant_rows() {
    let text = scenes::four_bar(1.1);
    let (mut stand, plan) = (stand(&text), prepared(&text).plan);
    let state = stand.consistent(&mut Random(107), 0.1);
    let inputs = stand.inputs(&state);
    // Null vectors of Phi_q^T: multipliers that hold each other in balance.
    let idle = null_space(&stand.jacobian(&inputs).transpose());
    assert_eq!(idle.ncols(), plan.redundant_rows.len());
}

#[test]
fn rates_are_velocities_then_accelerations() {
    let mut stand = stand(&scenes::tangle());
    let state = stand.consistent(&mut Random(109), 0.1);
    let inputs = stand.inputs(&state);
    let a = stand.accelerations(&inputs);
    let mut rates = vec![f64::NAN; state.len()];
    stand.form.rates(TIME, &state, &mut rates).unwrap();
    for b in 0..stand.layout.bodies {
        let (y, dy) = (&state[13 * b..13 * (b + 1)], &rates[13 * b..13 * (b + 1)]);
        assert_eq!(dy[..3], y[7..10]);
        assert!(difference(&dy[7..], &a.as_slice()[6 * b..6 * b + 6]) < 1e-14);
        // omega' = 2 G p', and p.p' = 0
        let p = nalgebra::Quaternion::new(y[3], y[4], y[5], y[6]);
        let rate = nalgebra::Quaternion::new(dy[3], dy[4], dy[5], dy[6]);
        let spin = p.conjugate() * rate * 2.0;
        assert!(spin.w.abs() < 1e-14 && difference(spin.imag().as_slice(), &y[10..13]) < 1e-14);
    }
}

#[test]
fn a_drive_works_against_its_reaction() {
    // With the motion driven, work is what changes the energy: power of the drive = d(T + V)/dt.
    let text = all_scenes().pop().unwrap();
    let mut stand = stand(&text);
    let state = stand.consistent(&mut Random(113), 0.0);
    let mut rates = vec![0.0; state.len()];
    stand.form.rates(TIME, &state, &mut rates).unwrap();
    let energy = |stand: &mut Stand, h: f64| -> f64 {
        let moved: Vec<f64> = state.iter().zip(&rates).map(|(y, dy)| y + h * dy).collect();
        let inputs = stand.form.observe(TIME + h, &moved, false).unwrap().inputs.to_vec();
        stand.values(&[stand.equations.kinetic, stand.equations.potential], &inputs).sum()
    };
    let h = 1e-5;
    let change = (energy(&mut stand, h) - energy(&mut stand, -h)) / (2.0 * h);
    let power = rates.last().unwrap();
    assert!(power.abs() > 1.0 && (change - power).abs() < 1e-6 * power.abs(), "{change} {power}");
}

#[test]
fn the_rank_safe_engine_takes_over_near_a_singular_position_without_a_jump() {
    // At 0.01 rad the four-bar is as good as flat; the paper's form is factored with complete pivoting.
    for angle in [0.3, 0.1, 0.03, 0.01] {
        let text = scenes::four_bar(angle);
        // Planned where the mechanism is healthy.
        let (mut stand, mut twin) = (stand(&scenes::four_bar(1.1)), reference(&scenes::four_bar(1.1)));
        let mut state = prepared(&text).assembly.working;
        // All cranks turn at 2 rad/s, the coupler does not turn.
        let mut random = Random(127);
        (0..3).for_each(|b| state[13 * b + 7..13 * b + 13].copy_from_slice(&random.vector(6)));
        stand.form.next_step(TIME, &state).unwrap();
        stand.form.project(TIME, &mut state).unwrap();
        let inputs = stand.inputs(&state);
        let mut theirs = vec![0.0; twin.groups().len()];
        twin.state_of(&state, &mut theirs);
        let others = twin.observe(TIME, &theirs, true).unwrap().inputs.to_vec();
        let off = difference(stand.accelerations(&others).as_slice(), stand.accelerations(&inputs).as_slice());
        // Round-off of the state over the distance, twice.
        assert!(off < 1e-14 / angle.powi(3) + 1e-12, "{angle}: {off:e}");
        if angle < 0.02 {
            assert!(stand.form.counters().rank_safe > 0, "at {angle}");
        }
    }
}

#[test]
fn factorisations_are_reused_while_the_position_stays() {
    let mut stand = stand(&scenes::tangle());
    let state = stand.consistent(&mut Random(131), 0.1);
    let mut rates = vec![0.0; state.len()];
    stand.form.rates(TIME, &state, &mut rates).unwrap();
    let before = stand.form.counters();
    let mut faster = state.clone();
    faster[7] += 1.0;
    stand.form.rates(TIME, &faster, &mut rates).unwrap();
    let after = stand.form.counters();
    assert_eq!((after.factorisations, after.reused), (before.factorisations, before.reused + 1));
    faster[0] += 1.0;
    stand.form.rates(TIME, &faster, &mut rates).unwrap();
    assert_eq!(stand.form.counters().factorisations, after.factorisations + 1);
}

#[test]
fn what_is_solved_for_balances_and_what_is_not_names_its_body() {
    let mut random = Random(107);
    for text in all_scenes() {
        let mut stand = stand(&text);
        let state = stand.consistent(&mut random, 0.1);
        let found = stand.form.observe(TIME, &state, true).unwrap().imbalance;
        assert!(found.share < 1e-13, "{found:?}");
        let inputs = stand.inputs(&state);
        let rows: Vec<usize> = (0..stand.layout.rows).collect();
        let gamma: fn(&Row) -> Node = |row| row.gamma;
        let mut dynamics = Constraints::new(&stand.equations, &rows, &[gamma], &stand.equations.loads).unwrap();
        dynamics.evaluate(&inputs, stand.form.sets()).unwrap();
        let (a, lambda) = inputs[stand.layout.acceleration_slot()..].split_at(stand.layout.velocities());
        let mut balance = Balance::new(mass_values(&stand.model), [a.len(), lambda.len()], stand.length);
        let loads = dynamics.further(1).to_vec();
        balance.take(&dynamics, &loads, a, lambda);
        assert!(balance.of_bodies().share < 1e-13 && balance.of_all() < 1e-13);
        for body in 0..stand.layout.bodies {
            let mut wrong = a.to_vec();
            // A ten thousandth of the body's largest acceleration: too little to be seen beside what is heavy.
            let linear = &mut wrong[6 * body..6 * body + 3];
            linear.iter_mut().for_each(|a| *a *= 1.0 + 1e-4);
            balance.take(&dynamics, &loads, &wrong, lambda);
            let Imbalance { share, body: named } = balance.of_bodies();
            let still = a[6 * body..6 * body + 3].iter().all(|a| *a == 0.0);
            assert!(still || (share > 1e-9 && named == body), "{share:e} at {named}, not {body}");
        }
    }
}
