//! What outputs and rates depend on: the operations that they are computed by tell.

use odyn_graph::{Listing, Value};

use crate::machine::{Machine, Slot};
use crate::program::Program;

/// Which states, inputs and parameters a quantity depends on, in this order.
pub(super) type Known = Vec<bool>;

/// Outputs, then the rates of all states.
#[derive(Clone)]
pub(super) struct Dependencies {
    pub(super) outputs: Vec<Known>,
    pub(super) rates: Vec<Known>,
}

impl Dependencies {
    /// While time passes.
    pub(super) fn of(machine: &Machine) -> Self {
        Self::with(machine, &[])
    }

    /// At the start, where what samples does so for the first time.
    pub(super) fn initially(machine: &Machine) -> Self {
        let motion = found(machine, &machine.portable.motion, &[], &[]);
        let memories = machine.sampled.next.as_ref();
        let memories = memories.map(|next| found(machine, &next.program, &motion, &[])).unwrap_or_default();
        Self::with(machine, &memories)
    }

    fn with(machine: &Machine, memories: &[Known]) -> Self {
        let n = machine.dim();
        let none = vec![false; known(machine)];
        let motion = found(machine, &machine.portable.motion, &[], memories);
        let quantities = machine.quantities.as_ref();
        let outputs = quantities.map(|quantities| found(machine, &quantities.program, &motion, memories));
        let coordinates = &machine.portable.coordinates;
        let mut rates = vec![none.clone(); n];
        for line in &coordinates.lines {
            rates[line.position][line.velocity] = true;
            rates[line.velocity].clone_from(&motion[line.column]);
        }
        for rotation in &coordinates.rotations {
            for k in 0..4 {
                (0..4).for_each(|other| rates[rotation.position + k][rotation.position + other] = true);
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

/// Which parameters may change while time passes: those that no row of a joint follows. A state would have to jump with the others.
pub(super) fn tunable(machine: &Machine) -> Vec<bool> {
    let (columns, m) = (machine.portable.coordinates.columns, machine.portable.rows.len());
    let mut tunable = vec![true; machine.parameters.settable.len()];
    if m > 0 {
        let first = machine.dim() + machine.inputs.len();
        for row in &found(machine, &machine.portable.position, &[], &[])[columns..columns + m] {
            tunable.iter_mut().zip(&row[first..]).for_each(|(tunable, follows)| *tunable &= !follows);
        }
    }
    tunable
}

/// Number of states, inputs and parameters.
fn known(machine: &Machine) -> usize {
    machine.dim() + machine.inputs.len() + machine.parameters.settable.len()
}

/// What the outputs of a program depend on; `motion`, `memories`: what accelerations and multipliers, and memories, do.
fn found(machine: &Machine, program: &Program, motion: &[Known], memories: &[Known]) -> Vec<Known> {
    let (n, inputs, all) = (machine.dim(), machine.inputs.len(), known(machine));
    let Some(listing) = program.listing() else { return vec![vec![true; all]; program.output_count()] };
    let Listing { values, outputs, .. } = &listing;
    let mut depends: Vec<Known> = Vec::with_capacity(values.len());
    for value in values {
        let mut own = vec![false; all];
        if let Value::Input(slot) = *value {
            match machine.slot(slot as usize) {
                Slot::State(entry) => {
                    own[entry] = true;
                    // The direction of Euler parameters takes all four.
                    let rotations = &machine.portable.coordinates.rotations;
                    let four = rotations.iter().map(|rotation| rotation.position..rotation.position + 4);
                    four.filter(|four| four.contains(&entry)).for_each(|four| own[four].fill(true));
                }
                Slot::Input(number) => own[n + number] = true,
                Slot::Solved(number) if number < motion.len() => own.clone_from(&motion[number]),
                Slot::Memory(number) if number < memories.len() => own.clone_from(&memories[number]),
                Slot::Followed(number) => {
                    machine.parameters.of(number).for_each(|parameter| own[n + inputs + parameter] = true);
                }
                _ => {}
            }
        }
        value.operands(|operand| {
            let from = &depends[operand as usize];
            own.iter_mut().zip(from).for_each(|(own, from)| *own |= from);
        });
        depends.push(own);
    }
    outputs.iter().map(|output| depends[*output as usize].clone()).collect()
}
