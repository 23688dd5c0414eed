//! Force and control elements: what they give, and whom they ask.
//!
//! An element's signals may come from another one's results, a reported quantity or a reaction. Results are therefore
//! written down when they are first asked for, operation by operation: an output that does not depend on an input does not
//! wait for it. The model has made sure that nothing depends on itself in this way. Reactions and accelerations do not
//! count: they are inputs of the programs, which the analysis finds together with everything that depends on them.

use element_api::Kind;
use element_api::recording::{Input, Op, Role};
use odyn_graph::{Expr, Graph, Node, V3, operation};
use rustc_hash::FxHashMap;

use super::equations::{Equations, FrameLoad, own_input};
use super::inertia::Inertia;
use super::kinematics::FrameNodes;
use super::opaque::{call_inputs, opaque_results};
use super::unknowns;
use crate::model::{Model, Quantity, Source};
use crate::plan::Layout;

/// The margin of what has let go.
const SAFE: f64 = f64::MAX;

/// What is known of one element so far.
#[derive(Default)]
struct Import {
    frames: Vec<FrameNodes>,
    /// Node of each operation of its recording that was written down.
    nodes: Vec<Option<Node>>,
    /// Where its tables begin in the graph.
    first_table: u32,
    /// Results of an opaque element.
    results: Option<Vec<(Role, Node)>>,
    /// What its kinetic energy does, where it brings some.
    inertia: Option<Inertia>,
}

/// Potential energies of elements, by the states that their own.
pub(super) struct Stored {
    /// The sum of those of elements without states.
    pub(super) shared: Node,
    /// Each of the others, with the states of its element.
    pub(super) own: Vec<(Node, std::ops::Range<usize>)>,
}

impl Stored {
    fn add(&mut self, graph: &mut Graph, potential: Node, states: std::ops::Range<usize>) {
        if states.is_empty() {
            self.shared = graph.add(self.shared, potential);
        } else {
            self.own.push((potential, states));
        }
    }
}

/// The elements of a model while they are written down.
pub(super) struct Imports<'m> {
    model: &'m Model,
    layout: &'m Layout,
    elements: Vec<Import>,
    /// Potential energy of the bodies alone.
    weight: Node,
    /// What elements store.
    stored: Stored,
    reactions: FxHashMap<usize, (V3, V3)>,
    /// Loads as force elements give them, without inertia.
    given: Vec<Node>,
}

impl Equations {
    /// Writes down all force and control elements. Bodies and joints are there already. Gives what the elements store.
    pub(super) fn add_acting_elements(&mut self, model: &Model, layout: &Layout) -> Stored {
        let elements = model.elements.iter().map(|element| {
            if element.class.kind == Kind::Joint && !element.gives_more_than_rows() && !element.limits_follow() {
                return Import::default();
            }
            let first_table = self.graph.tables.len() as u32;
            self.graph.tables.extend(element.recording.tables.iter().cloned());
            let nodes = vec![None; element.recording.ops.len()];
            Import { frames: self.frames(&element.markers), nodes, first_table, ..Import::default() }
        });
        let elements: Vec<Import> = elements.collect();
        let stored = Stored { shared: self.graph.constant(0.0), own: Vec::new() };
        let reactions = FxHashMap::default();
        let given = Vec::new();
        let mut imports = Imports { model, layout, elements, weight: self.potential, stored, reactions, given };
        // Signals may be measured from all kinetic energy.
        for index in 0..model.elements.len() {
            if let Some(energy) = self.kinetic_of(index, &mut imports) {
                self.kinetic = self.graph.add(self.kinetic, energy);
                self.inertial = true;
            }
        }
        self.add_limits_of_signals(&mut imports);
        for (index, element) in model.elements.iter().enumerate() {
            if element.class.kind != Kind::Joint {
                self.add_acting(index, &mut imports);
            } else if element.gives_more_than_rows() {
                self.add_values(index, &mut imports);
            }
        }
        self.move_rows_with_states(model, layout);
        let of_bodies = layout.acceleration_slot()..layout.multiplier_slot();
        let is_free = |slot: &usize| !of_bodies.contains(slot);
        self.inertial_alone = self.inertial && self.solved_inputs(&imports.given, layout).iter().all(is_free);
        imports.stored
    }

    /// What rows of joints hold up to, where that follows signals; no reaction is behind these ([`Equations::solved_limit`]).
    fn add_limits_of_signals(&mut self, imports: &mut Imports<'_>) {
        let mut limits = Vec::new();
        for (index, element) in imports.model.elements.iter().enumerate().filter(|(_, one)| one.limits_follow()) {
            let roles = element.rows.iter().map(|row| Role::Limit(*row as u32));
            let own = roles.filter_map(|role| Some((role, self.role(index, role, imports)?))).collect();
            limits.push((index, own));
        }
        if !limits.is_empty() {
            self.add_signalled_frictions(limits, imports.model, imports.layout);
            // Reactions contain from here on what these have while they slide.
            imports.reactions.clear();
            imports.elements.iter_mut().for_each(|import| import.nodes.fill(None));
        }
    }

    /// What any element gives: channels, rates of states, discrete states after a step.
    fn add_values(&mut self, index: usize, imports: &mut Imports<'_>) {
        let (element, layout) = (&imports.model.elements[index], imports.layout);
        let missing = self.graph.constant(f64::NAN);
        for k in 0..element.class.reported().len() {
            let node = self.reported(index, k, imports).unwrap_or(missing);
            self.element_mut(index).channels.push(node);
        }
        for k in 0..element.recording.initial_states.len() {
            let node = self.role(index, Role::StateRate(k as u32), imports).unwrap_or(missing);
            self.state_rates[layout.state_at[index] + k] = node;
        }
        self.add_unknowns_of(index, imports);
        for k in 0..element.recording.initial_discrete.len() {
            let node = self.role(index, Role::NextDiscrete(k as u32), imports).unwrap_or(missing);
            self.next_discrete[layout.discrete_at[index] + k] = node;
        }
        self.add_latch(index, element, &imports.elements[index].nodes, layout);
        if let Some(Inertia { rates, .. }) = self.inertia(index, imports) {
            let first = imports.layout.state_at[index] + rates.len();
            self.state_rates[first..first + rates.len()].copy_from_slice(&rates);
        }
    }

    /// The kinetic energy that an element brings.
    fn kinetic_of(&mut self, element: usize, imports: &mut Imports<'_>) -> Option<Node> {
        let instance = &imports.model.elements[element];
        let brings = instance.class.kind == Kind::Force && instance.recording.output(Role::Kinetic).is_some();
        if brings { self.role(element, Role::Kinetic, imports) } else { None }
    }

    /// What it does to the bodies and to the element's flexible coordinates.
    fn inertia(&mut self, element: usize, imports: &mut Imports<'_>) -> Option<Inertia> {
        self.kinetic_of(element, imports)?;
        if imports.elements[element].inertia.is_none() {
            let recording = &imports.model.elements[element].recording;
            let missing = self.graph.constant(f64::NAN);
            let count = recording.flexible() as u32;
            let forces: Vec<Node> =
                (0..count).map(|k| self.role(element, Role::FlexibleForce(k), imports).unwrap_or(missing)).collect();
            let layout = imports.layout;
            let slot = layout.state_slot() + layout.state_at[element];
            let Import { first_table, frames, .. } = &imports.elements[element];
            let written = self.write_inertia((recording, *first_table), frames, slot, &forces, layout);
            imports.elements[element].inertia = written;
        }
        imports.elements[element].inertia.clone()
    }

    /// The power of the forces on an element's flexible coordinates.
    fn flexible_power(&mut self, element: usize, imports: &mut Imports<'_>) -> Node {
        let mut power = self.graph.constant(0.0);
        let n = imports.model.elements[element].recording.flexible();
        let first = imports.layout.state_slot() + imports.layout.state_at[element] + n;
        for k in 0..n {
            let Some(force) = self.role(element, Role::FlexibleForce(k as u32), imports) else { continue };
            let speed = self.graph.input(first + k);
            let part = self.graph.mul(force, speed);
            power = self.graph.add(power, part);
        }
        power
    }

    fn add_acting(&mut self, index: usize, imports: &mut Imports<'_>) {
        let element = &imports.model.elements[index];
        let layout = imports.layout;
        let zero = self.graph.constant(0.0);
        let missing = self.graph.constant(f64::NAN);
        let mut power = zero;
        if element.class.kind == Kind::Force {
            for (f, marker) in element.markers.iter().enumerate() {
                let given = self.given_load(index, f, imports);
                imports.given.extend(given.force.into_iter().chain(given.torque));
                let load = self.load(index, f, imports);
                self.element_mut(index).loads.push(load);
                let frame = &imports.elements[index].frames[f];
                let g = &mut self.graph;
                // What inertia does is a change of kinetic energy.
                let (p, q) = (g.dot3(given.force, frame.velocity), g.dot3(given.torque, frame.angular_velocity));
                let both = g.add(p, q);
                power = g.add(power, both);
                if let Some(body) = marker.body {
                    self.apply_load(body, load.force, load.torque, frame);
                }
            }
            let flexible = self.flexible_power(index, imports);
            power = self.graph.add(power, flexible);
        }
        let acts = self.acts(index, imports.model, layout);
        let potential = self.potential_of(index, imports);
        let dissipation = self.role(index, Role::Dissipation, imports).map(|heat| self.while_it_acts(heat, acts));
        let told = if self.potential_takes_motion(index, imports) { None } else { potential.or(dissipation) };
        match (told, potential) {
            (None, _) => {
                self.power = self.graph.add(self.power, power);
                self.note_supplied(power);
            }
            (Some(_), potential) => {
                let potential = potential.unwrap_or(zero);
                self.potential = self.graph.add(self.potential, potential);
                self.power = self.graph.sub(self.power, dissipation.unwrap_or(zero));
                let states = element.recording.initial_states.len();
                let first = layout.state_at[index];
                imports.stored.add(&mut self.graph, potential, first..first + states);
            }
        }
        let heat = dissipation.filter(|heat| !self.graph.is_zero(*heat));
        self.dissipation.extend(heat);
        self.add_values(index, imports);
        for k in 0..element.class.checks.len() {
            let node = self.role(index, Role::Check(k as u32), imports).unwrap_or(missing);
            // What has let go is in no danger.
            let node = self.choose_while_it_acts(node, SAFE, acts);
            self.element_mut(index).checks.push(node);
        }
        for grid in &element.grids {
            let node = self.operation(index, grid.argument, imports);
            self.element_mut(index).grids.push(node);
        }
        for k in 0..element.class.angles {
            if let Some(node) = self.role(index, Role::Angle(k as u32), imports) {
                self.angles[layout.reference_at[index] + k] = node;
            }
        }
    }

    /// Potential energy of an element, unless it depends on signals that are measured from the motion: its force is not the
    /// derivative of such a potential, and the power of the force counts as work.
    fn potential_of(&mut self, element: usize, imports: &mut Imports<'_>) -> Option<Node> {
        if self.potential_takes_motion(element, imports) {
            return None;
        }
        let potential = self.role(element, Role::Potential, imports)?;
        let acts = self.acts(element, imports.model, imports.layout);
        Some(self.while_it_acts(potential, acts))
    }

    /// Whether a potential depends on a signal that depends on where the bodies are, how they move, or what is solved for.
    fn potential_takes_motion(&mut self, element: usize, imports: &mut Imports<'_>) -> bool {
        let instance = &imports.model.elements[element];
        let Some(wanted) = instance.recording.output(Role::Potential) else { return false };
        // What an opaque element makes of its signals is not known.
        let signals: Vec<u32> = if instance.class.opaque {
            (0..instance.inputs.len() as u32).collect()
        } else {
            let op = |k: u32| {
                Op::decode(instance.recording.ops[k as usize]).expect("recordings are checked when the model is built")
            };
            let unknown = vec![None; instance.recording.ops.len()];
            let needed = missing_operations(wanted, &unknown, op);
            let signal = |k: &u32| match op(*k) {
                Op::Input(Input::Signal(signal)) => Some(signal),
                _ => None,
            };
            needed.iter().filter_map(signal).collect()
        };
        signals.into_iter().any(|signal| {
            let node = self.input_node(element, Input::Signal(signal), imports);
            let motion = imports.layout.body_slot(0, 0)..imports.layout.state_slot();
            let solved = imports.layout.acceleration_slot();
            self.graph.ancestors(&[node], |_| false).into_iter().any(|below| match self.graph.expr(below) {
                Expr::Input(slot) => motion.contains(&(slot as usize)) || slot as usize >= solved,
                _ => false,
            })
        })
    }

    /// What a force element does to one of its frames, with its inertia.
    fn load(&mut self, element: usize, frame: usize, imports: &mut Imports<'_>) -> FrameLoad {
        let given = self.given_load(element, frame, imports);
        let Some(inertia) = self.inertia(element, imports) else { return given };
        let (g, own) = (&mut self.graph, &inertia.loads[frame]);
        FrameLoad { force: g.add3(given.force, own.force), torque: g.add3(given.torque, own.torque) }
    }

    /// The load that a force element says it puts on one of its frames.
    fn given_load(&mut self, element: usize, frame: usize, imports: &mut Imports<'_>) -> FrameLoad {
        let zero = self.graph.constant(0.0);
        let acts = self.acts(element, imports.model, imports.layout);
        let mut component = |role: fn(u32) -> Role, k: usize| {
            let own = self.role(element, role((3 * frame + k) as u32), imports).unwrap_or(zero);
            self.while_it_acts(own, acts)
        };
        FrameLoad {
            force: std::array::from_fn(|k| component(Role::Force, k)),
            torque: std::array::from_fn(|k| component(Role::Torque, k)),
        }
    }

    /// A value that an element reports.
    fn reported(&mut self, element: usize, k: usize, imports: &mut Imports<'_>) -> Option<Node> {
        let value = self.role(element, Role::Channel(k as u32), imports)?;
        let acts = self.acts(element, imports.model, imports.layout);
        let acts = acts.filter(|_| imports.model.elements[element].is_of_load(k));
        Some(self.while_it_acts(value, acts))
    }

    /// A result of an element; `None` when it does not give it.
    fn role(&mut self, element: usize, role: Role, imports: &mut Imports<'_>) -> Option<Node> {
        let instance = &imports.model.elements[element];
        if !instance.class.opaque {
            let wanted = instance.recording.output(role)?;
            return Some(self.operation(element, wanted, imports));
        }
        if imports.elements[element].results.is_none() {
            let inputs = call_inputs(instance);
            let arguments: Vec<Node> = inputs.map(|input| self.input_node(element, input, imports)).collect();
            let call = self.add_call(instance, arguments);
            imports.elements[element].results = Some(opaque_results(&mut self.graph, instance, call));
        }
        let results = imports.elements[element].results.as_ref()?;
        results.iter().find(|(known, _)| *known == role).map(|(_, node)| *node)
    }

    /// An operation of a recording, after everything it needs.
    fn operation(&mut self, element: usize, wanted: u32, imports: &mut Imports<'_>) -> Node {
        let recording = &imports.model.elements[element].recording;
        let op =
            |k: u32| Op::decode(recording.ops[k as usize]).expect("recordings are checked when the model is built");
        for k in missing_operations(wanted, &imports.elements[element].nodes, op) {
            let node = match op(k) {
                Op::Input(input) => self.input_node(element, input, imports),
                other => {
                    let import = &imports.elements[element];
                    let at = |k: u32| import.nodes[k as usize].expect("operands come before their operation");
                    operation(&mut self.graph, recording, other, import.first_table, at)
                }
            };
            imports.elements[element].nodes[k as usize] = Some(node);
        }
        imports.elements[element].nodes[wanted as usize].expect("written down above")
    }

    /// Writes down the internal unknowns of an element, if it has some and they are not there yet.
    fn add_unknowns_of(&mut self, element: usize, imports: &mut Imports<'_>) {
        let recording = &imports.model.elements[element].recording;
        let slot = imports.layout.state_slot() + imports.layout.unknown_at[element];
        if recording.unknowns() == 0 || self.graph.unknown_at(slot).is_some() {
            return;
        }
        let inputs = unknowns::inputs_of_conditions(recording);
        let given = inputs.into_iter().map(|input| (input, self.input_node(element, input, imports))).collect();
        unknowns::add(&mut self.graph, recording, slot, imports.elements[element].first_table, &given);
    }

    fn input_node(&mut self, element: usize, input: Input, imports: &mut Imports<'_>) -> Node {
        let instance = &imports.model.elements[element];
        match input {
            Input::Signal(k) => {
                let source = instance.inputs[k as usize].clone();
                self.source(&source, imports)
            }
            Input::ReactionForce { joint, component } => {
                self.joint_reaction(instance.joints[joint as usize], imports).0[component as usize]
            }
            Input::ReactionTorque { joint, component } => {
                self.joint_reaction(instance.joints[joint as usize], imports).1[component as usize]
            }
            Input::Unknown(_) => {
                self.add_unknowns_of(element, imports);
                own_input(&mut self.graph, input, element, &imports.elements[element].frames, imports.layout)
            }
            own => own_input(&mut self.graph, own, element, &imports.elements[element].frames, imports.layout),
        }
    }

    fn source(&mut self, source: &Source, imports: &mut Imports<'_>) -> Node {
        match source {
            Source::Constant(value) => self.graph.constant(*value),
            Source::Quantity(quantity, factor) => {
                let signal = self.signal(quantity, imports);
                let factor = self.graph.constant(*factor);
                self.graph.mul(factor, signal)
            }
        }
    }

    fn signal(&mut self, quantity: &Quantity, imports: &mut Imports<'_>) -> Node {
        let missing = self.graph.constant(f64::NAN);
        match quantity {
            Quantity::Value { element, channel } => self.reported(*element, *channel, imports).unwrap_or(missing),
            Quantity::Load { element, frame, torque, axes, component }
                if imports.model.elements[*element].class.kind == Kind::Force =>
            {
                let load = self.load(*element, *frame, imports);
                self.component(if *torque { load.torque } else { load.force }, *axes, *component)
            }
            Quantity::PotentialEnergy => self.whole_potential(imports),
            Quantity::TotalEnergy => {
                let potential = self.whole_potential(imports);
                self.graph.add(self.kinetic, potential)
            }
            other => self.observe(other, imports.model, imports.layout),
        }
    }

    /// Potential energy of everything, also of elements that are not written down yet.
    fn whole_potential(&mut self, imports: &mut Imports<'_>) -> Node {
        let mut sum = imports.weight;
        for element in 0..imports.model.elements.len() {
            if imports.model.elements[element].class.kind == Kind::Force
                && let Some(part) = self.potential_of(element, imports)
            {
                sum = self.graph.add(sum, part);
            }
        }
        sum
    }

    /// The reaction of a joint on the last of its bodies, at the last frame, ground axes.
    fn joint_reaction(&mut self, joint: usize, imports: &mut Imports<'_>) -> (V3, V3) {
        if let Some(known) = imports.reactions.get(&joint) {
            return *known;
        }
        let last = imports.model.elements[joint].markers.len() - 1;
        let found = self.reaction(joint, last, imports.model, imports.layout);
        imports.reactions.insert(joint, found);
        found
    }
}

/// Operations that `wanted` needs and that are not known yet, itself included, in ascending order.
fn missing_operations(wanted: u32, known: &[Option<Node>], op: impl Fn(u32) -> Op) -> Vec<u32> {
    let mut seen = vec![false; known.len()];
    let mut list = Vec::new();
    let mut open = vec![wanted];
    while let Some(k) = open.pop() {
        if known[k as usize].is_none() && !std::mem::replace(&mut seen[k as usize], true) {
            list.push(k);
            open.extend(op(k).operands());
        }
    }
    list.sort_unstable();
    list
}
