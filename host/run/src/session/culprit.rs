//! Which element gives what is not a number, and by which operation.

use super::opened::Session;
use super::run::Run;
use crate::analysis::unknown_name;
use crate::integrate::{IntegrateError, Status, StopReason};
use crate::model::Body;
use crate::program::{Equations, Expr, Node, Program};
use crate::results::significant;
use crate::scene::ElementRecord;
use element_api::descriptor::Kind;

/// Ratio of masses from which on they are named where a run ends.
const FAR_APART: f64 = 1e6;

/// A result of an element, in words, with its node.
struct Wanted {
    element: usize,
    what: String,
    node: Node,
}

impl Session {
    /// The first result of an element that is not finite for these inputs of the working form, with the operation that made it
    /// so; `None` where all are finite.
    pub(super) fn culprit(&self, inputs: &[f64]) -> Option<String> {
        let wanted = self.results_of_elements();
        let nodes: Vec<Node> = wanted.iter().map(|one| one.node).collect();
        let values = self.values(&nodes, inputs)?;
        // Operations come after their operands: of an element and what takes its signals as they are, or not, it is the element.
        let takes = |element: usize| self.model.elements[element].class.kind != Kind::Control;
        let not_finite = wanted.iter().zip(&values).filter(|(_, value)| !value.is_finite());
        let (one, _) = not_finite.min_by_key(|(one, _)| (one.node, takes(one.element)))?;
        let instance = &self.model.elements[one.element];
        let operation = self.first_not_finite(one.node, inputs).map_or_else(String::new, |text| format!(" ({text})"));
        let record = self.scene.elements.iter().find(|record| record.name.value == instance.name);
        let functions = record.map(functions_of).unwrap_or_default();
        let look = if functions.is_empty() { String::new() } else { format!("; look at {}", functions.join(", ")) };
        let text = format!("{} of `{}` is not a finite number{operation}{look}", one.what, instance.name);
        Some(match self.points_together(one.element, inputs) {
            Some(met) => format!("{met}: {text}"),
            None => text,
        })
    }

    /// The lightest and the heaviest body, where elimination loses as many digits as may end a run.
    pub(super) fn masses_far_apart(&self) -> Option<String> {
        let by_mass = |a: &&Body, b: &&Body| a.mass.total_cmp(&b.mass);
        let light = self.model.bodies.iter().min_by(by_mass)?;
        let heavy = self.model.bodies.iter().max_by(by_mass)?;
        let ratio = heavy.mass / light.mass;
        (ratio >= FAR_APART).then(|| {
            format!(
                "; masses may be the cause: `{}` is {} times as heavy as `{}`, and elimination loses digits by that; try other coordinates \
                 (`--formulation cartesian` or `joint`), or masses nearer to each other",
                heavy.name,
                significant(ratio, 1),
                light.name
            )
        })
    }

    /// Conditions on unknowns, rows with their derivatives, limits, loads, rates of states and values of all elements.
    fn results_of_elements(&self) -> Vec<Wanted> {
        let (equations, layout) = (&self.equations, &self.plan.layout);
        let mut wanted = Vec::new();
        for solved in &equations.graph.solved {
            let element = layout.element_of_state(solved.slot - layout.state_slot());
            let names = (0..solved.unknowns.len()).map(|k| unknown_name(&self.model.elements[element].class, k));
            let what = format!("a condition on the internal unknown `{}`", names.collect::<Vec<_>>().join("`, `"));
            wanted.extend(solved.conditions.iter().map(|node| Wanted { element, what: what.clone(), node: *node }));
        }
        let named = |row: usize| {
            let (element, k) = layout.element_of_row(row);
            (element, self.model.elements[element].row(k))
        };
        for (number, row) in equations.rows.iter().enumerate() {
            let (element, name) = named(number);
            wanted.push(Wanted { element, what: format!("the row `{name}`"), node: row.value });
            let what = format!("a derivative of the row `{name}`");
            wanted.extend(row.jacobian.iter().map(|(_, node)| Wanted { element, what: what.clone(), node: *node }));
        }
        for friction in &equations.frictions {
            let (element, name) = named(friction.rows[0]);
            wanted.push(Wanted { element, what: format!("the limit of the row `{name}`"), node: friction.limit });
        }
        for (element, instance) in self.model.elements.iter().enumerate() {
            let own = &equations.elements[element];
            for (load, marker) in own.loads.iter().zip(&instance.markers) {
                let on = marker.body.map_or("the ground", |body| self.model.bodies[body].name.as_str());
                for (what, components) in [("force", &load.force), ("torque", &load.torque)] {
                    let what = format!("the {what} on {on}");
                    wanted.extend(components.iter().map(|node| Wanted { element, what: what.clone(), node: *node }));
                }
            }
            let states = instance.recording.initial_states.len();
            let rates = &equations.state_rates[layout.state_at[element]..layout.state_at[element] + states];
            let name =
                |k: usize| instance.class.states.get(k).map_or_else(|| k.to_string(), |state| state.name.clone());
            for (k, node) in rates.iter().enumerate() {
                wanted.push(Wanted { element, what: format!("the rate of state `{}`", name(k)), node: *node });
            }
            for (channel, node) in instance.class.reported().iter().zip(&own.channels) {
                wanted.push(Wanted { element, what: format!("the value `{}`", channel.name), node: *node });
            }
        }
        wanted
    }

    fn values(&self, nodes: &[Node], inputs: &[f64]) -> Option<Vec<f64>> {
        let program = Program::compile(&self.equations.graph, nodes);
        let mut values = vec![0.0; nodes.len()];
        // An element that fails is reported as such.
        program.run(inputs, &self.model.sets, &mut program.workspace(), &mut values).ok()?;
        Some(values)
    }

    /// The operation below a node that is the first not to be finite, with its operands.
    fn first_not_finite(&self, node: Node, inputs: &[f64]) -> Option<String> {
        let Equations { graph, .. } = &self.equations;
        let below = graph.ancestors(&[node], |_| false);
        let values = self.values(&below, inputs)?;
        let first = values.iter().position(|value| !value.is_finite())?;
        let value = |node: Node| below.binary_search(&node).map_or(f64::NAN, |k| values[k]);
        Some(match graph.expr(below[first]) {
            Expr::Sqrt(a) => format!("the square root of {:e}", value(a)),
            Expr::Ln(a) => format!("the logarithm of {:e}", value(a)),
            Expr::Div(a, b) => format!("{:e} divided by {:e}", value(a), value(b)),
            Expr::Powf(a, _) | Expr::Powi(a, _) => format!("a power of {:e}", value(a)),
            Expr::Exp(a) => format!("the exponential of {:e}", value(a)),
            Expr::Constant(_) => "a constant is none".into(),
            Expr::Input(_) => "a state is none".into(),
            Expr::Call { .. } => "called at run time".into(),
            _ => return None,
        })
    }
}

/// The functions that a scene gives an element, as written.
pub(super) fn functions_of(record: &ElementRecord) -> Vec<String> {
    let texts = record.params.entries.iter().filter_map(|(key, value)| {
        let text = value.as_text()?;
        // Numbers with units and names of choices have no arguments or operations.
        text.contains(['(', '/', '^']).then(|| format!("`{} = {text:?}`", key.value))
    });
    texts.collect()
}

impl Run<'_> {
    /// See [`super::summary::Ended::cause`].
    pub(super) fn cause(&mut self, outcome: &Result<Status, IntegrateError>) -> Option<String> {
        match outcome {
            Ok(
                Status::StoppedEarly { reason: StopReason::Requested | StopReason::StepLimit { .. }, .. }
                | Status::Completed,
            ) => None,
            _ => {
                let inputs = self.system.working_inputs(self.time, &self.state).ok();
                let met = inputs.and_then(|inputs| self.session.points_met(&inputs));
                met.or_else(|| self.system.lost_unknown())
            }
        }
    }
}
