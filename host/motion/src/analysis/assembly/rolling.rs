//! Contacts that roll where a scene starts.

use super::{Assembly, AssemblyError, start_inputs};
use crate::analysis::contact::{Contacts, Gap};
use crate::model::Model;
use crate::plan::Layout;
use crate::program::{Contact, Equations};

/// Contacts that are open by at most this share of the scene's size touch; with rates up to this share of its speeds they rest.
const AT_CONTACT: f64 = 1e-9;

/// The contacts whose bodies cannot slide on each other (they have rows that stick whatever it takes) and that touch where the scene
/// is assembled: all of them, then those that neither strike nor part with the velocities found without them, if these are others.
pub(super) fn rolling(
    equations: &Equations,
    model: &Model,
    layout: &Layout,
    t: f64,
    assembly: &Assembly,
) -> Result<Vec<Vec<usize>>, AssemblyError> {
    let rolls = |contact: &Contact| !contact.sticking.is_empty() && !contact.of_velocities;
    if !equations.contacts.iter().any(rolls) {
        return Ok(Vec::new());
    }
    let (length, inputs) = (assembly.scales.length, start_inputs(layout, t, assembly));
    let speed = assembly.scales.speed_scale().max(assembly.scales.spin_scale() * length);
    let mut contacts = Contacts::new(&mut equations.clone(), model, layout, length)?;
    let gaps = contacts.look(&inputs, &layout.velocities_in(&inputs), &model.sets)?;
    let touches = |number: &usize| gaps[*number].apart().abs() <= AT_CONTACT * length;
    let rests = |gap: &Gap| gap.rate.abs() <= AT_CONTACT * speed * gap.size;
    let all: Vec<usize> =
        (0..gaps.len()).filter(|number| rolls(&equations.contacts[*number]) && touches(number)).collect();
    let resting: Vec<usize> = all.iter().copied().filter(|number| rests(&gaps[*number])).collect();
    let mut found = vec![all, resting];
    found.dedup();
    found.retain(|contacts| !contacts.is_empty());
    Ok(found)
}
