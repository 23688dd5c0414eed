//! Kinetic energies that elements bring: whether the mass matrix behind one is that of masses, and what such an element cannot meet.

use element_api::recording::{Input, Role};
use element_api::{Kind, Recording};
use nalgebra::{DMatrix, Matrix3, Vector3};

use super::types::{Body, Instance, Marker, rotation};
use crate::diagnostics::{Diagnostic, codes};
use crate::scene::Scene;

/// Share of the largest by which an eigenvalue of a matrix with ones on its diagonal may be negative, or is none.
const ROUND_OFF: f64 = 1e-9;

/// Checks the mass matrix of a recording's kinetic energy where the bodies are given: never negative, and positive for the flexible
/// coordinates alone, since the host solves for these.
///
/// # Errors
/// In words.
pub(super) fn check(recording: &Recording, markers: &[Marker], bodies: &[Body]) -> Result<(), String> {
    if recording.output(Role::Kinetic).is_none() {
        return Ok(());
    }
    let frames: Vec<(Vector3<f64>, Matrix3<f64>)> = markers
        .iter()
        .map(|marker| match marker.body {
            None => (marker.position, marker.rotation),
            Some(body) => {
                let turn = rotation(&bodies[body].orientation);
                (bodies[body].position + turn * marker.position, turn * marker.rotation)
            }
        })
        .collect();
    let (flexible, n) = (recording.flexible(), 6 * markers.len() + recording.flexible());
    // A quadratic form gives its matrix: T(a + b) - T(a) - T(b).
    let energy = |moved: [usize; 2]| {
        let speed = |k: usize| f64::from(u8::from(moved.contains(&k)));
        let read = |input: Input| match input {
            Input::Position { frame, component } => frames[frame as usize].0[component as usize],
            Input::Rotation { frame, row, column } => frames[frame as usize].1[(row as usize, column as usize)],
            Input::Velocity { frame, component } => speed(6 * frame as usize + component as usize),
            Input::AngularVelocity { frame, component } => speed(6 * frame as usize + 3 + component as usize),
            Input::State(k) if (k as usize) < flexible => recording.initial_states[k as usize],
            Input::State(k) => speed(6 * markers.len() + k as usize - flexible),
            _ => 0.0,
        };
        let found = recording.evaluate(read).into_iter().find(|(role, _)| *role == Role::Kinetic);
        found.map_or(f64::NAN, |(_, energy)| energy)
    };
    let mut mass = DMatrix::zeros(n, n);
    for k in 0..n {
        mass[(k, k)] = 2.0 * energy([k, k]);
    }
    for (row, column) in (0..n).flat_map(|row| (0..row).map(move |column| (row, column))) {
        let entry = energy([row, column]) - 0.5 * (mass[(row, row)] + mass[(column, column)]);
        (mass[(row, column)], mass[(column, row)]) = (entry, entry);
    }
    if mass.iter().any(|entry| !entry.is_finite()) {
        return Err("its kinetic energy has no value where the bodies are".into());
    }
    // In units in which each entry of the diagonal is one.
    let scale: Vec<f64> = (0..n).map(|k| mass[(k, k)].abs().max(f64::MIN_POSITIVE).sqrt().recip()).collect();
    for (row, column) in (0..n).flat_map(|row| (0..n).map(move |column| (row, column))) {
        mass[(row, column)] *= if mass[(row, column)] == 0.0 { 1.0 } else { scale[row] * scale[column] };
    }
    let own = mass.view((n - flexible, n - flexible), (flexible, flexible)).into_owned();
    let least =
        |matrix: DMatrix<f64>| matrix.symmetric_eigen().eigenvalues.iter().copied().fold(f64::INFINITY, f64::min);
    if flexible > 0 && least(own) <= ROUND_OFF {
        return Err("its kinetic energy does not grow with the velocity of each of its flexible coordinates".into());
    }
    if n > 0 && least(mass) < -ROUND_OFF * n as f64 {
        return Err("its kinetic energy is negative for some velocities".into());
    }
    Ok(())
}

/// Impacts and friction that sticks are solved for with the masses of bodies alone.
pub(super) fn meets_contacts(scene: &Scene, elements: &[Instance]) -> Option<Diagnostic> {
    let gives = |element: &Instance, wanted: fn(Role) -> bool| {
        element.recording.outputs.iter().any(|output| wanted(output.role))
    };
    let brings = elements.iter().find(|element| element.brings_kinetic())?;
    let contact = elements.iter().find(|element| {
        element.class.kind == Kind::Joint && gives(element, |role| matches!(role, Role::Unilateral(_) | Role::Limit(_)))
    })?;
    let place = |name: &str| {
        let record = scene.elements.iter().find(|record| record.name.value == name);
        record.map_or(0..0, |record| record.name.span.clone())
    };
    let message = format!(
        "`{}` brings kinetic energy, which the contact `{}` cannot take into account",
        brings.name, contact.name
    );
    Some(
        Diagnostic::error(codes::INERTIA_MEETS_CONTACT, message)
            .at(place(&brings.name), "its mass would have no part in impacts and sticking")
            .context(place(&contact.name), "strikes or sticks")
            .help("give the mass to the body (`point_masses`), or make the contact compliant (`bump-stop`, `contact-friction`)"),
    )
}
