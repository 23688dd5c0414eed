//! [`Undetermined`]: elements whose results depend on reactions that rigid bodies do not determine.
//!
//! Reactions that differ by a null load (multipliers with Phi_q^T lambda = 0) cause the same motion. Where the load of an
//! element changes with such a difference, infinitely many motions satisfy the equations.

use element_api::recording::{Input, Role};
use nalgebra::{Matrix3, Vector3};
use odyn_numerics::draw::SplitMix64;
use rustc_hash::FxHashMap;

use super::decide::Reaction;
use crate::model::{Instance, Model, Quantity, Source};

/// Share of the change that a load of the same size in any direction causes, below which a change is round-off.
const SHOWS: f64 = 1e-7;

/// Sizes of what is tried, such as reactions in N or N m: an element may feel them beyond a limit only.
pub(super) const SIZES: [f64; 7] = [1e-3, 1.0, 1e2, 1e4, 1e6, 1e8, 1e10];

/// What the reactions that rigid bodies do not determine leave open of an element.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Undetermined {
    /// Which element.
    pub element: usize,
    /// Its load on bodies: then the motion itself is not determined. Otherwise only what it reports.
    pub load: bool,
    /// Its channels.
    pub channels: Vec<bool>,
    /// Margins of its checks.
    pub checks: Vec<bool>,
}

/// A force and a torque that a null vector puts on the body of a frame, ground axes.
pub(super) type NullLoads = FxHashMap<(usize, usize), (Vector3<f64>, Vector3<f64>)>;

/// The elements whose results depend on null loads, by their recordings: at the assembled orientations, with other inputs
/// drawn. Opaque elements count as dependent.
pub(super) fn undetermined(
    model: &Model,
    rotations: &[Matrix3<f64>],
    null_loads: &[NullLoads],
    reactions: &[Reaction],
) -> Vec<Undetermined> {
    let mut found: Vec<Undetermined> = Vec::new();
    if null_loads.is_empty() {
        return found;
    }
    // Signals pass on what is open, against the order of the elements, too.
    loop {
        let before = found.clone();
        for (element, instance) in model.elements.iter().enumerate() {
            let is_open = |source: &Source| source.quantity().is_some_and(|signal| is_open(signal, reactions, &before));
            let signals = (0..instance.inputs.len()).filter(|k| is_open(&instance.inputs[*k]));
            let mut directions: Vec<Vec<(Input, f64)>> =
                signals.map(|k| vec![(Input::Signal(k as u32), 1.0)]).collect();
            if !instance.joints.is_empty() {
                directions.extend(null_loads.iter().filter_map(|loads| on_joints(instance, model, loads)));
            }
            if directions.is_empty() {
                continue;
            }
            let (load, channels, checks) = if instance.class.opaque {
                (!instance.markers.is_empty(), vec![true; instance.class.reported().len()], Vec::new())
            } else {
                effect(instance, rotations, directions)
            };
            found.retain(|known| known.element != element);
            if load || channels.contains(&true) || checks.contains(&true) {
                found.push(Undetermined { element, load, channels, checks });
            }
        }
        for (element, instance) in model.elements.iter().enumerate() {
            let decides = instance.release.as_ref().and_then(|release| release.quantity.as_ref());
            if !decides.is_some_and(|quantity| is_open(quantity, reactions, &before)) {
                continue;
            }
            match found.iter_mut().find(|known| known.element == element) {
                Some(known) => known.load = true,
                None => {
                    let channels = vec![false; instance.class.reported().len()];
                    let checks = vec![false; instance.class.checks.len()];
                    found.push(Undetermined { element, load: true, channels, checks });
                }
            }
        }
        found.sort_by_key(|known| known.element);
        if found == before {
            return found;
        }
    }
}

/// Whether a signal carries what is not determined.
fn is_open(signal: &Quantity, reactions: &[Reaction], known: &[Undetermined]) -> bool {
    match signal {
        Quantity::Load { element, frame, torque, .. } => {
            let of = |r: &&Reaction| r.element == *element && r.frame == *frame;
            let components = |r: &Reaction| if *torque { r.torque } else { r.force };
            reactions.iter().find(of).is_some_and(|r| components(r).contains(&false))
                || known.iter().any(|open| open.element == *element && open.load)
        }
        Quantity::Value { element, channel } => {
            known.iter().any(|open| open.element == *element && open.channels[*channel])
        }
        _ => false,
    }
}

/// What a null vector adds to the reactions that an element takes, of size 1.
fn on_joints(instance: &Instance, model: &Model, loads: &NullLoads) -> Option<Vec<(Input, f64)>> {
    let mut direction = Vec::new();
    for (k, joint) in instance.joints.iter().enumerate() {
        let last = model.elements[*joint].markers.len() - 1;
        let Some((force, torque)) = loads.get(&(*joint, last)) else { continue };
        let joint = k as u32;
        for component in 0..3u32 {
            direction.push((Input::ReactionForce { joint, component }, force[component as usize]));
            direction.push((Input::ReactionTorque { joint, component }, torque[component as usize]));
        }
    }
    let size = direction.iter().map(|(_, x)| x.abs()).fold(0.0, f64::max);
    direction.iter_mut().for_each(|(_, x)| *x /= size);
    (size > 0.0).then_some(direction)
}

/// Whether loads and channels of an element change along one of the directions. States whose rates change do, too.
fn effect(
    instance: &Instance,
    rotations: &[Matrix3<f64>],
    mut directions: Vec<Vec<(Input, f64)>>,
) -> (bool, Vec<bool>, Vec<bool>) {
    let (mut load, mut channels) = (false, vec![false; instance.class.reported().len()]);
    let mut checks = vec![false; instance.class.checks.len()];
    let mut states: Vec<Input> = Vec::new();
    while let Some(direction) = directions.pop() {
        for role in changed(instance, rotations, &direction) {
            let state = match role {
                Role::Force(_) | Role::Torque(_) | Role::Residual(_) | Role::VelocityResidual(_) => {
                    load = true;
                    continue;
                }
                Role::Channel(k) => {
                    channels[k as usize] = true;
                    continue;
                }
                Role::Check(k) => {
                    checks[k as usize] = true;
                    continue;
                }
                Role::Condition(k) => Input::Unknown(k),
                Role::StateRate(k) => Input::State(k),
                Role::NextDiscrete(k) => Input::Discrete(k),
                _ => continue,
            };
            if !states.contains(&state) {
                states.push(state);
                directions.push(vec![(state, 1.0)]);
            }
        }
    }
    (load, channels, checks)
}

/// Results that change along a direction, by more than round-off of what a change in any direction does to them.
fn changed(instance: &Instance, rotations: &[Matrix3<f64>], direction: &[(Input, f64)]) -> Vec<Role> {
    let frames: Vec<Matrix3<f64>> = instance
        .markers
        .iter()
        .map(|marker| marker.body.map_or(marker.rotation, |body| rotations[body] * marker.rotation))
        .collect();
    let mut along = vec![0.0f64; instance.recording.outputs.len()];
    let mut anywhere = along.clone();
    for (k, size) in SIZES.into_iter().enumerate() {
        let evaluate = |change: &dyn Fn(Input) -> f64| {
            instance.recording.evaluate(|input| match input {
                Input::Rotation { frame, row, column } => frames[frame as usize][(row as usize, column as usize)],
                Input::ReactionForce { .. } | Input::ReactionTorque { .. } => size * (drawn(input, k) + change(input)),
                _ => drawn(input, k) + change(input),
            })
        };
        let of = |list: &[(Input, f64)], input: Input| list.iter().find(|(i, _)| *i == input).map_or(0.0, |(_, x)| *x);
        let here = evaluate(&|_| 0.0);
        let there = evaluate(&|input| of(direction, input));
        let elsewhere =
            evaluate(&|input| if direction.iter().any(|(i, _)| *i == input) { drawn(input, k + 64) } else { 0.0 });
        for (j, (_, value)) in here.iter().enumerate() {
            let by = |other: f64| if (other - value).is_finite() { (other - value).abs() } else { 0.0 };
            along[j] = along[j].max(by(there[j].1));
            anywhere[j] = anywhere[j].max(by(elsewhere[j].1));
        }
    }
    let roles = instance.recording.outputs.iter().map(|output| output.role);
    roles
        .zip(along.iter().zip(&anywhere))
        .filter(|(_, (along, anywhere))| **along > SHOWS * **anywhere)
        .map(|(role, _)| role)
        .collect()
}

/// A number between -1 and 1 that differs from input to input and from time to time.
pub(super) fn drawn(input: Input, k: usize) -> f64 {
    let mut hasher = rustc_hash::FxHasher::default();
    std::hash::Hash::hash(&(input, k), &mut hasher);
    SplitMix64::new(std::hash::Hasher::finish(&hasher)).either_way()
}
