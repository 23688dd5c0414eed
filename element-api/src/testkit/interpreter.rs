//! The plainest evaluation of a [`Recording`]: the oracle of the host's programs.

use crate::recording::{Input, Recording, Role};
use crate::scalar::Scalar;
use crate::testkit::Setting;

/// Carries out a recording operation by operation and gives its results with their meaning.
///
/// # Panics
/// When the recording refers to something that is not there; [`Recording::check`] finds that beforehand.
#[must_use]
pub fn interpret(recording: &Recording, setting: &Setting, coordinates: &[f64]) -> Vec<(Role, f64)> {
    interpret_with(recording, |input| setting.read(input, coordinates))
}

/// [`interpret`] with any scalar, for example with [`crate::Jet`], which differentiates the recording.
///
/// # Panics
/// As [`interpret`].
#[must_use]
pub fn interpret_with<S: Scalar>(recording: &Recording, read: impl Fn(Input) -> S) -> Vec<(Role, S)> {
    let mut results = recording.evaluate(read);
    // Conditions on unknowns lie behind the rates of states among plain numbers, the last one first.
    let conditions = if recording.unknowns() > 0 { &mut results[..] } else { &mut [] };
    conditions.sort_by_key(|(role, _)| match role {
        Role::Force(_) | Role::Torque(_) | Role::StateRate(_) | Role::FlexibleForce(_) => (0, 0),
        Role::Condition(k) => (1, u32::MAX - k),
        _ => (2, 0),
    });
    results
}
