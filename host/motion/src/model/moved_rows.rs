//! What the rate of a state that moves a row may depend on.
//!
//! The second derivative of a row Phi(q, s, t) with s' = f contains f': where f depends on velocities it contains accelerations,
//! which the equations do not look for there, and where f jumps velocities would jump. So f may depend on positions, time and
//! states; the rates of states behind it may depend on velocities and jump, but not on what is solved for with the accelerations.

use element_api::recording::{Input, Role};

use super::signals::{Result_, results_behind};
use super::types::{Instance, Level, Quantity, Source};
use crate::diagnostics::{Diagnostic, codes};
use crate::scene::Scene;

/// How many derivatives of a row are still taken of what is looked at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Depth {
    /// It moves a row: its derivative is taken.
    Rate,
    /// It moves what moves a row.
    Behind,
}

/// A state that moves a row, with what its rate must not depend on.
struct Fault {
    joint: usize,
    state: usize,
    on: String,
}

/// Refuses states of joints whose rates depend on more than rows can follow.
pub(super) fn check(scene: &Scene, instances: &[Instance], found: &mut Vec<Diagnostic>) {
    for (joint, instance) in instances.iter().enumerate().filter(|(_, instance)| instance.is_joint_with_states()) {
        let mut states = Vec::new();
        for row in &instance.rows {
            for input in instance.inputs_of(Role::Residual(*row as u32)).unwrap_or_default() {
                if let Input::State(k) = input {
                    states.push(k as usize);
                }
            }
        }
        states.sort_unstable();
        states.dedup();
        for state in states {
            let mut seen = Vec::new();
            let result = (joint, Role::StateRate(state as u32));
            if let Some(on) = forbidden(result, Depth::Rate, instances, &mut seen) {
                found.push(refusal(&Fault { joint, state, on }, scene, instances));
            }
        }
    }
}

fn refusal(fault: &Fault, scene: &Scene, instances: &[Instance]) -> Diagnostic {
    let instance = &instances[fault.joint];
    let name = instance.class.states.get(fault.state).map_or_else(|| fault.state.to_string(), |s| s.name.clone());
    let record = scene.elements.iter().find(|record| record.name.value == instance.name);
    let message = format!(
        "the rate of the state `{name}` of joint `{}` depends on {}, and a row of the joint depends on that state",
        instance.name, fault.on
    );
    Diagnostic::error(codes::ROW_MOVED_BY_VELOCITY, message)
        .at(record.map_or(0..0, |record| record.name.span.clone()), "its rows cannot follow")
        .help("put one more state between: a filter of first order, in the joint or before its input")
}

/// What a result depends on and must not, in words.
fn forbidden(
    result: Result_,
    depth: Depth,
    instances: &[Instance],
    seen: &mut Vec<(Result_, Depth)>,
) -> Option<String> {
    if seen.contains(&(result, depth)) {
        return None;
    }
    seen.push((result, depth));
    let (element, role) = result;
    let instance = &instances[element];
    let Some(inputs) = instance.inputs_of(role) else {
        return Some(format!("`{}`, of which is not known what it depends on", instance.name));
    };
    for input in inputs {
        let fault = match (input, depth) {
            (Input::Velocity { .. } | Input::AngularVelocity { .. }, Depth::Rate) => {
                Some(format!("velocities of the frames of `{}`", instance.name))
            }
            (Input::Discrete(k), Depth::Rate) => {
                Some(format!("the discrete state {k} of `{}`, which jumps", instance.name))
            }
            (Input::ReactionForce { .. } | Input::ReactionTorque { .. }, _) => {
                Some(format!("reactions, by way of `{}`", instance.name))
            }
            (Input::State(k), Depth::Rate) => forbidden((element, Role::StateRate(k)), Depth::Behind, instances, seen),
            (Input::Signal(k), _) => match instance.inputs.get(k as usize) {
                Some(Source::Quantity(quantity, _)) => forbidden_quantity(quantity, depth, instances, seen),
                _ => None,
            },
            _ => None,
        };
        if fault.is_some() {
            return fault;
        }
    }
    None
}

fn forbidden_quantity(
    quantity: &Quantity,
    depth: Depth,
    instances: &[Instance],
    seen: &mut Vec<(Result_, Depth)>,
) -> Option<String> {
    let too_high = |level: &Level, what: &str| match (level, depth) {
        (Level::Position, _) | (Level::Velocity, Depth::Behind) => None,
        (Level::Velocity, Depth::Rate) => Some(format!("the velocity of a {what}")),
        (Level::Acceleration, _) => Some(format!("the acceleration of a {what}")),
    };
    match quantity {
        Quantity::Point { level, .. } => too_high(level, "point"),
        Quantity::Angular { level, .. } => too_high(level, "body"),
        Quantity::Coordinate { level, .. } => too_high(level, "coordinate"),
        Quantity::EulerParameter { .. } => None,
        Quantity::Given { .. } if depth == Depth::Rate => Some("a signal from outside, which jumps".into()),
        Quantity::Given { .. } => None,
        Quantity::Value { .. } => {
            results_behind(quantity, instances).into_iter().find_map(|next| forbidden(next, depth, instances, seen))
        }
        _ => Some("a force, a reaction or an energy".into()),
    }
}
