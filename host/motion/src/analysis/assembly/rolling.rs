//! Contacts that roll where a scene starts.

use super::{Assembly, AssemblyError, start_inputs};
use crate::analysis::constraints::Constraints;
use crate::analysis::working::BODY_STATES;
use crate::model::Model;
use crate::plan::Layout;
use crate::program::{Contact, Equations};

/// Contacts that are open by at most this share of the scene's size touch; with rates up to this share of its speeds they rest.
const AT_CONTACT: f64 = 1e-9;

/// The contacts whose bodies cannot slide on each other (they have rows that stick whatever it takes) and that touch where the scene
/// is assembled, neither striking nor parting.
pub(super) fn rolling(
    equations: &Equations,
    model: &Model,
    layout: &Layout,
    t: f64,
    assembly: &Assembly,
) -> Result<Vec<usize>, AssemblyError> {
    let rolls = |contact: &Contact| !contact.sticking.is_empty() && !contact.of_velocities;
    if !equations.contacts.iter().any(rolls) {
        return Ok(Vec::new());
    }
    let all: Vec<usize> = (0..layout.rows).collect();
    let mut rows = Constraints::new(equations, &all, &[|row| row.value, |row| row.time], &[])?;
    rows.evaluate(&start_inputs(layout, t, assembly), &model.sets)?;
    let length = assembly.scales.length;
    let speed = assembly.scales.speed_scale().max(assembly.scales.spin_scale() * length);
    let (mut rates, mut squares) = (rows.function(1).to_vec(), vec![0.0; all.len()]);
    for ((row, column), slope) in rows.structure.jacobian.iter().zip(rows.jacobian()) {
        rates[*row] += slope * assembly.working[BODY_STATES * (column / 6) + 7 + column % 6];
        squares[*row] += (slope * if column % 6 < 3 { 1.0 } else { 1.0 / length }).powi(2);
    }
    let rests = |contact: &Contact| {
        let (row, size) = (contact.row, squares[contact.row].sqrt());
        rolls(contact)
            && rows.function(0)[row].abs() <= AT_CONTACT * length * size
            && rates[row].abs() <= AT_CONTACT * speed * size
    };
    let contacts = equations.contacts.iter().enumerate().filter(|(_, contact)| rests(contact));
    Ok(contacts.map(|(number, _)| number).collect())
}
