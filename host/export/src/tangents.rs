//! [`Tangents`]: exact derivatives of what a machine computes along a direction, by the chain rule from the operations of its programs.

use odyn_graph::{Node, condense};

use crate::analysis::Quantities;
use crate::machine::{Machine, Slot};
use crate::program::{Program, Seeds, derivatives};

/// Programs of derivatives. Beyond the inputs of the other programs they take the direction: along time, states and inputs.
#[derive(Debug, Clone)]
pub struct Tangents {
    /// Of accelerations, multipliers, rates of element states and power.
    pub motion: Program,
    /// Of the outputs, SI; where these take accelerations or multipliers, from the derivatives of those as well.
    pub outputs: Option<Program>,
    /// Of the functions that change their sign where equations switch.
    pub switches: Option<Program>,
}

impl Tangents {
    /// The derivatives of a machine's programs; `None` where one calls opaque elements.
    pub(crate) fn of(machine: &Machine) -> Option<Self> {
        let of = |found: &Option<Quantities>| match found {
            // A Rosenbrock method takes those of the motion only.
            Some(found) if machine.derivatives => {
                tangent(machine, &found.program, found.program.output_count()).map(Some)
            }
            _ => Some(None),
        };
        Some(Self {
            motion: tangent(machine, &machine.portable.motion, machine.pivots_from())?,
            outputs: of(&machine.quantities)?,
            switches: of(&machine.switches)?,
        })
    }
}

/// The derivatives of the first so many outputs of a program.
fn tangent(machine: &Machine, program: &Program, outputs: usize) -> Option<Program> {
    let listing = program.listing()?;
    let mut seeds = Seeds::default();
    let (mut graph, nodes) = listing.graph();
    let first = machine.portable.coordinates.input_count;
    for (value, node) in listing.values.iter().zip(&nodes) {
        let odyn_graph::Value::Input(slot) = value else { continue };
        let seed = match machine.slot(*slot as usize) {
            Slot::Time => first,
            Slot::State(entry) => first + 1 + entry,
            Slot::Input(number) => first + 1 + machine.dim() + number,
            Slot::Solved(number) => first + machine.seeds() + number,
            // What is counted or sampled stays as it is meanwhile.
            Slot::Reference(_)
            | Slot::Memory(_)
            | Slot::Unused
            | Slot::Seed(_)
            | Slot::SolvedTangent(_)
            | Slot::Followed(_) => continue,
        };
        seeds.insert(*node, graph.input(seed));
    }
    let wanted: Vec<Node> = listing.outputs[..outputs].iter().map(|value| nodes[*value as usize]).collect();
    let found = derivatives(&mut graph, &wanted, &seeds);
    let (graph, found) = condense(&graph, &found).unwrap_or((graph, found));
    Some(Program::compile(&graph, &found))
}
