//! Small motions of bodies in the inputs of programs: displacements and turns in ground axes, six numbers per body.

use nalgebra::{DMatrix, DVector, Quaternion, Vector3};

use crate::analysis::Evaluator;
use crate::model::rotation;
use crate::plan::Layout;
use crate::session::{Restart, Session};

/// An angle that has moved this far from its reference gets a new one, rad.
const NEW_REFERENCE: f64 = 1.0;

/// Moves bodies by displacements and small turns.
pub(crate) fn go(layout: &Layout, inputs: &mut [f64], step: &DVector<f64>) {
    for body in 0..layout.bodies {
        let slot = layout.body_slot(body, 0);
        (0..3).for_each(|k| inputs[slot + k] += step[6 * body + k]);
        let turn = Vector3::new(step[6 * body + 3], step[6 * body + 4], step[6 * body + 5]);
        let half = 0.5 * turn.norm();
        let share = if half > 0.0 { half.sin() / half } else { 1.0 };
        let by = Quaternion::from_parts(half.cos(), turn * (0.5 * share));
        let at = &mut inputs[slot + 3..slot + 7];
        let turned = (by * Quaternion::new(at[0], at[1], at[2], at[3])).normalize();
        at.copy_from_slice(&[turned.w, turned.i, turned.j, turned.k]);
    }
}

/// Adds to the six numbers per body that begin at a slot of each: angular parts are kept in the axes of the body.
fn add(layout: &Layout, inputs: &mut [f64], change: &DVector<f64>, slot_of: &dyn Fn(usize) -> usize) {
    for body in 0..layout.bodies {
        let turn = rotation(&std::array::from_fn(|k| inputs[layout.body_slot(body, 3 + k)]));
        let own = turn.transpose() * change.fixed_rows::<3>(6 * body + 3);
        let slot = slot_of(body);
        (0..3).for_each(|k| {
            inputs[slot + k] += change[6 * body + k];
            inputs[slot + 3 + k] += own[k];
        });
    }
}

/// Adds to velocities and angular velocities.
pub(crate) fn hasten(layout: &Layout, inputs: &mut [f64], change: &DVector<f64>) {
    add(layout, inputs, change, &|body| layout.body_slot(body, 7));
}

/// Adds to accelerations and angular accelerations.
pub(crate) fn accelerate(layout: &Layout, inputs: &mut [f64], change: &DVector<f64>) {
    add(layout, inputs, change, &|body| layout.acceleration_slot() + 6 * body);
}

/// What stands in the six slots per body, ground axes.
fn read(layout: &Layout, inputs: &[f64], slot_of: &dyn Fn(usize) -> usize) -> DVector<f64> {
    let mut found = DVector::zeros(layout.velocities());
    for body in 0..layout.bodies {
        let turn = rotation(&std::array::from_fn(|k| inputs[layout.body_slot(body, 3 + k)]));
        let at = slot_of(body);
        let spin = turn * Vector3::new(inputs[at + 3], inputs[at + 4], inputs[at + 5]);
        (0..3).for_each(|k| (found[6 * body + k], found[6 * body + 3 + k]) = (inputs[at + k], spin[k]));
    }
    found
}

/// Velocities and angular velocities, ground axes.
pub(crate) fn velocities(layout: &Layout, inputs: &[f64]) -> DVector<f64> {
    read(layout, inputs, &|body| layout.body_slot(body, 7))
}

/// Accelerations and angular accelerations, ground axes.
pub(crate) fn accelerations(layout: &Layout, inputs: &[f64]) -> DVector<f64> {
    read(layout, inputs, &|body| layout.acceleration_slot() + 6 * body)
}

/// Velocities, accelerations and multipliers are zero.
pub(crate) fn rest(layout: &Layout, inputs: &mut [f64]) {
    for body in 0..layout.bodies {
        let slot = layout.body_slot(body, 7);
        inputs[slot..slot + 10].fill(0.0);
    }
    inputs[layout.acceleration_slot()..].fill(0.0);
}

/// The state in the inputs of programs, to continue from.
pub(crate) fn restart(session: &Session, inputs: &[f64]) -> Restart {
    let layout = &session.plan.layout;
    let mut working: Vec<f64> = Vec::new();
    (0..layout.bodies).for_each(|body| working.extend(&inputs[layout.body_slot(body, 0)..][..13]));
    working.extend(&inputs[layout.state_slot()..layout.reference_slot()]);
    working.push(0.0);
    let references = &inputs[layout.reference_slot()..layout.discrete_slot()];
    let discrete = &inputs[layout.discrete_slot()..layout.acceleration_slot()];
    Restart::new(&session.model, inputs[Layout::TIME], working, references, discrete)
}

/// Angles are counted on from where they are.
pub(crate) fn count(layout: &Layout, angles: &mut Evaluator, inputs: &mut [f64]) -> Result<(), String> {
    let found = angles.run(inputs, &[]).map_err(|error| error.to_string())?;
    for (k, angle) in found.iter().enumerate() {
        let slot = layout.reference_slot() + k;
        if (angle - inputs[slot]).abs() > NEW_REFERENCE {
            inputs[slot] = *angle;
        }
    }
    Ok(())
}

/// Largest distance of a row from being met, m, and which row it is.
pub(crate) fn violation(jacobian: &DMatrix<f64>, values: &DVector<f64>, scales: &DVector<f64>) -> (f64, usize) {
    let gradient =
        |row: usize| (0..jacobian.ncols()).map(|k| (jacobian[(row, k)] * scales[k]).powi(2)).sum::<f64>().sqrt();
    let share = |row: usize| values[row].abs() / gradient(row).max(f64::MIN_POSITIVE);
    (0..values.len()).map(|row| (share(row), row)).fold((0.0, 0), |a, b| if b.0 > a.0 { b } else { a })
}
