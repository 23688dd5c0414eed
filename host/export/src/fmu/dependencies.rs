//! What outputs and rates depend on: the operations that they are computed by tell.

use odyn_graph::{Listing, Value};

use crate::machine::Machine;
use crate::program::Program;

/// Which states and inputs a quantity depends on: states first, then inputs.
pub(super) type Known = Vec<bool>;

/// Outputs, then the rates of all states.
pub(super) struct Dependencies {
    pub(super) outputs: Vec<Known>,
    pub(super) rates: Vec<Known>,
}

impl Dependencies {
    pub(super) fn of(machine: &Machine) -> Self {
        let (n, inputs) = (machine.dim(), machine.inputs.len());
        let none = vec![false; n + inputs];
        let motion = found(machine, &machine.portable.motion, &[]);
        let outputs = machine.quantities.as_ref().map(|quantities| found(machine, &quantities.program, &motion));
        let coordinates = &machine.portable.coordinates;
        let mut rates = vec![none.clone(); n];
        for line in &coordinates.lines {
            rates[line.position][line.velocity] = true;
            rates[line.velocity].clone_from(&motion[line.column]);
        }
        for rotation in &coordinates.rotations {
            for k in 0..4 {
                for other in (0..4).filter(|other| *other != k) {
                    rates[rotation.position + k][rotation.position + other] = true;
                }
                (0..3).for_each(|axis| rates[rotation.position + k][rotation.velocity + axis] = true);
            }
            for k in 0..3 {
                rates[rotation.velocity + k].clone_from(&motion[rotation.column + k]);
            }
        }
        let from = coordinates.columns + machine.portable.rows.len();
        for state in coordinates.motion..n {
            rates[state].clone_from(&motion[from + state - coordinates.motion]);
        }
        Self { outputs: outputs.unwrap_or_default(), rates }
    }
}

/// What the outputs of a program depend on; `motion`: what accelerations and multipliers do.
fn found(machine: &Machine, program: &Program, motion: &[Known]) -> Vec<Known> {
    let (n, inputs) = (machine.dim(), machine.inputs.len());
    let Some(listing) = program.listing() else { return vec![vec![true; n + inputs]; program.output_count()] };
    let Listing { values, outputs, .. } = &listing;
    let (layout, coordinates) = (&machine.layout, &machine.portable.coordinates);
    let mut known: Vec<Known> = Vec::with_capacity(values.len());
    for value in values {
        let mut own = vec![false; n + inputs];
        if let Value::Input(slot) = *value {
            let slot = slot as usize;
            let given = layout.given_slot(0);
            let solved = coordinates.acceleration_slot..coordinates.acceleration_slot + coordinates.columns;
            let row = slot.checked_sub(layout.multiplier_slot());
            let row = row.and_then(|row| machine.portable.rows.iter().position(|used| *used == row));
            if let Some(entry) = coordinates.entry_of(slot, layout) {
                own[entry] = true;
            } else if (given..given + inputs).contains(&slot) {
                own[n + slot - given] = true;
            } else if let Some(of_motion) = solved.contains(&slot).then(|| motion.get(slot - solved.start)).flatten() {
                own.clone_from(of_motion);
            } else if let Some(of_motion) = row.and_then(|row| motion.get(coordinates.columns + row)) {
                own.clone_from(of_motion);
            }
        }
        value.operands(|operand| {
            let from = &known[operand as usize];
            own.iter_mut().zip(from).for_each(|(own, from)| *own |= from);
        });
        known.push(own);
    }
    outputs.iter().map(|output| known[*output as usize].clone()).collect()
}
