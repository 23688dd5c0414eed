//! Projection onto the constraints: there, no further than needed, and no second time.

use super::*;

/// Largest residual of positions, and of velocities, as the rows have them.
fn residuals(stand: &mut Stand, state: &[f64]) -> (f64, f64) {
    let inputs = stand.form.observe(TIME, state, false).unwrap().inputs.to_vec();
    let of = |stand: &Stand, of: fn(&crate::program::Row) -> Node| {
        let nodes: Vec<Node> = stand.equations.rows.iter().map(of).collect();
        stand.values(&nodes, &inputs)
    };
    let rates = stand.jacobian(&inputs) * stand.velocities(state) + of(stand, |row| row.time);
    (of(stand, |row| row.value).amax(), rates.amax())
}

fn all_scenes() -> [String; 3] {
    [scenes::tangle(), scenes::opaque_tangle(), scenes::four_bar(1.1)]
}

#[test]
fn projected_states_meet_positions_and_velocities_to_round_off() {
    let mut random = Random(137);
    for text in all_scenes() {
        let mut stand = stand(&text);
        for size in [1e-9, 1e-4, 0.1] {
            let mut state = stand.disturbed(&mut random, size);
            stand.form.project(TIME, &mut state).unwrap();
            let (position, velocity) = residuals(&mut stand, &state);
            assert!(position < 1e-14 * stand.length && velocity < 1e-13, "{position:e} {velocity:e}");
            for body in 0..stand.layout.bodies {
                let p = &state[13 * body + 3..13 * body + 7];
                assert!((p.iter().map(|e| e * e).sum::<f64>() - 1.0).abs() < 1e-15);
            }
        }
    }
}

#[test]
fn a_second_projection_changes_nothing() {
    let mut random = Random(139);
    for text in all_scenes() {
        let mut stand = stand(&text);
        let once = stand.consistent(&mut random, 0.1);
        let mut twice = once.clone();
        stand.form.project(TIME, &mut twice).unwrap();
        assert!(difference(&twice, &once) < 2e-14, "{:e}", difference(&twice, &once));
    }
}

#[test]
fn corrections_are_orthogonal_to_every_motion_in_the_metric_of_the_mass() {
    let mut random = Random(149);
    for text in all_scenes() {
        let mut stand = stand(&text);
        // Positions by a small step from the constraints, which are flat as far as it goes.
        stand.state = stand.consistent(&mut random, 0.05);
        let size = 1e-6;
        let disturbed = stand.disturbed(&mut random, size);
        let mut state = disturbed.clone();
        stand.form.project(TIME, &mut state).unwrap();
        let inputs = stand.inputs(&state);
        let motions = null_space(&stand.jacobian(&inputs));
        assert!(motions.ncols() > 0);
        let moved = displacement(&stand, &disturbed, &state);
        assert!(moved.amax() > 0.01 * size);
        let along = motions.transpose() * stand.mass() * &moved;
        assert!(along.amax() < 1e-5 * moved.amax(), "positions: {:e}", along.amax() / moved.amax());
        // Velocities exactly: the change of momentum is of the kind Phi_q^T mu.
        let faster = stand.velocities(&state) - stand.velocities(&disturbed);
        let along = motions.transpose() * stand.mass() * &faster;
        assert!(along.amax() < 1e-12 * faster.amax(), "velocities: {:e}", along.amax() / faster.amax());
    }
}

/// (dr, dpi') of all bodies between two states that lie close together.
fn displacement(stand: &Stand, from: &[f64], to: &[f64]) -> DVector<f64> {
    let mut list = Vec::new();
    for body in 0..stand.layout.bodies {
        let (a, b) = (&from[13 * body..], &to[13 * body..]);
        list.extend((0..3).map(|k| b[k] - a[k]));
        let quaternion = |y: &[f64]| nalgebra::Quaternion::new(y[3], y[4], y[5], y[6]);
        list.extend((quaternion(a).conjugate() * quaternion(b) * 2.0).imag().iter());
    }
    DVector::from_vec(list)
}

#[test]
fn both_forms_project_velocities_alike() {
    let mut random = Random(151);
    for text in all_scenes() {
        let (mut stand, mut twin) = (stand(&text), reference(&text));
        let mut state = stand.consistent(&mut random, 0.05);
        for body in 0..stand.layout.bodies {
            state[13 * body + 7..13 * body + 13].copy_from_slice(&random.vector(6));
        }
        let mut theirs = vec![0.0; twin.groups().len()];
        twin.state_of(&state, &mut theirs);
        twin.project(TIME, &mut theirs).unwrap();
        stand.form.project(TIME, &mut state).unwrap();
        let mut ours = theirs.clone();
        twin.state_of(&state, &mut ours);
        assert!(difference(&theirs, &ours) < 1e-13, "{:e}", difference(&theirs, &ours));
    }
}

#[test]
fn a_position_that_is_not_a_number_is_refused_with_its_row() {
    let mut stand = stand(&scenes::tangle());
    let mut state = stand.state.clone();
    state[0] = f64::NAN;
    let error = stand.form.project(TIME, &mut state).unwrap_err();
    assert!(matches!(&error, AnalysisError::NotFinite { what } if what.starts_with("constraint b")), "{error}");
}

#[test]
fn a_position_out_of_reach_is_refused_with_its_row() {
    // Two rods of 1 m from the origin to a carriage that is driven away: at 0.1 s it is 4.2 m off.
    let body = |name: &str, x: f64, y: f64| {
        format!("[[body]]\nname = \"{name}\"\nmass = 1\ninertia = [0.1, 0.1, 0.1]\nposition = [{x:?}, {y:?}, 0]\n")
    };
    let joint = |name: &str, kind: &str, i: &str, j: &str, point: [f64; 3], more: &str| {
        format!(
            "[[joint]]\nname = \"{name}\"\ntype = \"{kind}\"\nbodies = [\"{i}\", \"{j}\"]\npoint = {point:?}\n{more}"
        )
    };
    let drive = "axis = [1, 0, 0]\nparams = { pitch = 0, speed = 30 }\n";
    let text = body("a", 0.3, 0.4)
        + &body("b", 0.9, 0.4)
        + &body("carriage", 1.2, 0.0)
        + &joint("one", "ball", "ground", "a", [0.0, 0.0, 0.0], "")
        + &joint("two", "ball", "a", "b", [0.6, 0.8, 0.0], "")
        + &joint("three", "ball", "b", "carriage", [1.2, 0.0, 0.0], "")
        + &joint("rail", "screw", "ground", "carriage", [1.2, 0.0, 0.0], drive);
    let mut stand = stand(&text);
    let mut state = stand.state.clone();
    let error = stand.form.project(TIME, &mut state).unwrap_err();
    assert!(matches!(error, AnalysisError::LeftConstraints { violation, .. } if violation > 0.1), "{error}");
}
