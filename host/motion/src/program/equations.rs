//! [`Equations`]: the whole scene as one graph.
//!
//! Working form (design.md, 5): per body the velocities v of the centre of mass (ground axes) and omega' (body axes);
//! M [v'; omega'] + Phi_q^T lambda = Q, Phi_q [v'; omega'] = gamma, with Phi_q the derivatives along (dr, dpi').
//! Reference form: the paper's Eq. (6) with the seven coordinates (r, p) per body.

use std::sync::{Arc, OnceLock};

use element_api::Kind;
use element_api::recording::{Input, Role};
use odyn_graph::{Graph, Node, Program, Seeds, V3, derivatives, import};

use super::acting::Stored;
use super::contacts::Contact;
use super::coupling::CoupledInput;
use super::inertia::FreeInertia;
use super::kinematics::{BodyNodes, FrameNodes, body_nodes, dot4, frame_nodes, g_matrix, transposed};
use super::latches::Latch;
use super::opaque::{call_inputs, opaque_results};
use super::releases::Releasing;
use super::sliding::Friction;
use crate::model::{Body, Instance, Marker, Model};
use crate::plan::Layout;

/// Joints in a scene beyond which room is made for all of them by what the first so many take.
const MANY: usize = 500;
const SAMPLED: usize = 50;
/// Nodes that there is room for at first, per body and element.
const NODES: usize = 250;
/// And at most.
const MOST_ROOM: usize = 8_000;

/// Which coordinates the equations are written in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// Six velocities per body.
    Working,
    /// The paper's seven coordinates per body.
    Reference,
}

impl Form {
    /// Columns of the constraint Jacobian per body.
    #[must_use]
    pub const fn columns(self) -> usize {
        match self {
            Self::Working => 6,
            Self::Reference => 7,
        }
    }
}

/// A scalar function of the configuration with its first derivatives, and its second along the motion; or a function that is linear in
/// velocities, a . v + b, in the place of a first derivative.
#[derive(Debug, Clone)]
pub struct Row {
    /// The value: zero for a constraint that holds, and where only a rate is constrained.
    pub value: Node,
    /// Partial derivative with respect to time; b of a function of velocities.
    pub time: Node,
    /// Minus the second derivative along the motion with all accelerations zero (Haug 1989, eq. 9.2.12).
    pub gamma: Node,
    /// Nonzero derivatives with respect to the coordinates, or to their rates: (column, node), columns ascending.
    pub jacobian: Vec<(usize, Node)>,
    /// Whether it constrains velocities and leaves positions free.
    pub of_velocities: bool,
}

/// What a force element does to one of its frames, at the frame's origin, ground axes.
#[derive(Debug, Clone, Copy)]
pub struct FrameLoad {
    /// Force, N.
    pub force: V3,
    /// Torque, N m.
    pub torque: V3,
}

/// The equations of one element.
#[derive(Debug, Clone, Default)]
pub struct ElementEquations {
    /// Joint coordinates.
    pub coordinates: Vec<Node>,
    /// The same with their derivatives, where these are known; see [`Equations::coordinate`].
    pub(super) coordinate_rows: Vec<Row>,
    /// Loads of a force element, per frame.
    pub loads: Vec<FrameLoad>,
    /// Reported values of a force element.
    pub channels: Vec<Node>,
    /// Margins of its checks.
    pub checks: Vec<Node>,
    /// Arguments of its grids.
    pub grids: Vec<Node>,
}

/// The scene as a graph, with the nodes that mean something.
#[derive(Clone)]
pub struct Equations {
    /// All operations.
    pub graph: Graph,
    /// The coordinates they are written in.
    pub form: Form,
    /// The bodies.
    pub bodies: Vec<BodyNodes>,
    /// All constraint rows, element after element. Copies have them in common.
    pub rows: Arc<Vec<Row>>,
    /// Those of them that only push, in their order.
    pub contacts: Vec<Contact>,
    /// Those of them that hold up to a limit, in their order.
    pub frictions: Vec<Friction>,
    /// Joints that may be released, in their order.
    pub releases: Vec<Releasing>,
    /// Memories that jump at instants, and what decides on the releases of forces.
    pub latches: Vec<Latch>,
    /// The rows that are not enforced, ascending: those of contacts that are open, of frictions that slide, and of joints that were
    /// released.
    pub(super) open: Vec<usize>,
    /// Whether these rows stay so for as long as the equations are used: see [`Equations::in_mode`].
    pub(super) of_mode: bool,
    /// Right side Q of the equations of motion, six (seven) per body: applied and velocity-dependent forces.
    pub loads: Vec<Node>,
    /// Rates of the continuous element states.
    pub state_rates: Vec<Node>,
    /// Multi-turn angles, one per reference.
    pub angles: Vec<Node>,
    /// Discrete states after an accepted step, and the signals from outside as they were.
    pub next_discrete: Vec<Node>,
    /// Kinetic energy, J.
    pub kinetic: Node,
    /// Potential energy of gravity and elements, J.
    pub potential: Node,
    /// Power of everything that has no potential, W: what changes the mechanical energy.
    pub power: Node,
    /// Its parts that elements turn into heat, W, not negative; they count negative in `power`.
    pub dissipation: Vec<Node>,
    /// All its other parts, W.
    pub supplied: Vec<Node>,
    /// Lower triangle of the mass matrix of the Euler parameters, ten per body (reference form only).
    pub mass_p: Vec<Node>,
    /// Per element of the model.
    pub elements: Arc<Vec<ElementEquations>>,
    /// Accelerations and multipliers that the loads depend on.
    pub coupling: Vec<CoupledInput>,
    /// Whether elements bring kinetic energy: the loads contain their inertia.
    pub inertial: bool,
    /// Whether nothing but this inertia depends on accelerations of bodies: no load that an element gives.
    pub(super) inertial_alone: bool,
    /// What of it is met by impulses, where rows switch.
    pub(super) free_inertia: FreeInertia,
    /// Whether there are any, or [`Equations::solved_in_rates`], with some choice of closed contacts.
    pub(super) may_need_solution: bool,
    /// The inputs that are accelerations or multipliers which rates of states or the power depend on, ascending.
    pub solved_in_rates: Vec<usize>,
    /// See [`Equations::channels`].
    pub(super) channels: Vec<Node>,
    /// See [`Equations::program_of_rows`].
    pub(super) of_rows: OnceLock<Program>,
    /// Whether second derivatives of recorded rows are left to [`Equations::write_gammas`]; until then they are not numbers.
    pub(super) gammas_are_due: bool,
}

impl Equations {
    /// Writes down the equations of a model.
    #[must_use]
    pub fn build(model: &Model, layout: &Layout, form: Form) -> Self {
        Self::build_by(model, layout, form, true)
    }

    /// The same in the working form, without the second derivatives of rows where nothing in the equations asks for them: for
    /// trees, which the coordinates of joints meet all rows of. [`Equations::write_gammas`] adds them.
    #[must_use]
    pub fn build_for_tree(model: &Model, layout: &Layout) -> Self {
        let mut equations = Self::build_by(model, layout, Form::Working, false);
        let plain = !equations.switches_rows() && equations.coupling.is_empty();
        if !plain || layout.states > 0 {
            equations.write_gammas();
        }
        equations
    }

    fn build_by(model: &Model, layout: &Layout, form: Form, with_gammas: bool) -> Self {
        let mut graph = Graph::with_room((NODES * (model.bodies.len() + model.elements.len())).min(MOST_ROOM));
        let zero = graph.constant(0.0);
        let bodies: Vec<BodyNodes> = (0..layout.bodies).map(|b| body_nodes(&mut graph, layout, b, form)).collect();
        let columns = form.columns();
        let mut equations = Self {
            loads: vec![zero; columns * bodies.len()],
            state_rates: vec![zero; layout.states],
            angles: vec![zero; layout.references],
            next_discrete: vec![zero; layout.discrete],
            kinetic: zero,
            potential: zero,
            power: zero,
            dissipation: Vec::new(),
            supplied: Vec::new(),
            mass_p: Vec::new(),
            elements: Arc::new(vec![ElementEquations::default(); model.elements.len()]),
            rows: Arc::new(Vec::with_capacity(layout.rows)),
            contacts: Vec::new(),
            frictions: Vec::new(),
            releases: Vec::new(),
            latches: Vec::new(),
            open: Vec::new(),
            of_mode: false,
            coupling: Vec::new(),
            may_need_solution: false,
            inertial: false,
            inertial_alone: false,
            free_inertia: FreeInertia::default(),
            solved_in_rates: Vec::new(),
            channels: Vec::new(),
            of_rows: OnceLock::new(),
            gammas_are_due: !with_gammas,
            graph,
            form,
            bodies,
        };
        equations.add_releases(model, layout);
        for input in 0..model.inputs.len() {
            equations.next_discrete[layout.given_at + input] = equations.graph.input(layout.given_slot(input));
        }
        for (b, body) in model.bodies.iter().enumerate() {
            equations.add_body(b, body, model);
            equations.take_back(b, body, layout);
        }
        let joints = || model.elements.iter().enumerate().filter(|(_, element)| element.class.kind == Kind::Joint);
        let (count, before) = (joints().count(), equations.graph.len());
        for (number, (index, element)) in joints().enumerate() {
            if number == SAMPLED && count > MANY {
                let own = equations.graph.len() - before;
                equations.graph.reserve(before + own * count / SAMPLED);
            }
            equations.add_joint(index, element, layout);
        }
        equations.set_open(&[]);
        // Force and control elements may ask for reactions and for each other's results.
        let stored = equations.add_acting_elements(model, layout);
        equations.add_rates_of_unknowns(layout);
        equations.add_explicit_power(layout, &stored);
        equations.find_coupling(layout);
        equations.may_need_solution = equations.needs_solution();
        equations.watch_releases(model, layout);
        equations.add_releases_of_forces(model, layout);
        equations
    }

    /// The Jacobian of all rows that are enforced, row after row; then the value of each, then its derivative with respect to time.
    /// Made once: most of what is decided before a run asks for it.
    #[must_use]
    pub fn program_of_rows(&self) -> &Program {
        self.of_rows.get_or_init(|| {
            let rows = || self.enforced().map(|row| &self.rows[row]);
            let mut nodes: Vec<Node> = rows().flat_map(|row| row.jacobian.iter().map(|(_, node)| *node)).collect();
            nodes.extend(rows().map(|row| row.value));
            nodes.extend(rows().map(|row| row.time));
            Program::compile(&self.graph, &nodes)
        })
    }

    /// A copy to which few nodes are to be added.
    #[must_use]
    pub fn resting(&self) -> Self {
        Self {
            graph: self.graph.at_rest(),
            form: self.form,
            bodies: self.bodies.clone(),
            rows: Arc::clone(&self.rows),
            contacts: self.contacts.clone(),
            frictions: self.frictions.clone(),
            releases: self.releases.clone(),
            latches: self.latches.clone(),
            open: self.open.clone(),
            of_mode: self.of_mode,
            loads: self.loads.clone(),
            state_rates: self.state_rates.clone(),
            angles: self.angles.clone(),
            next_discrete: self.next_discrete.clone(),
            kinetic: self.kinetic,
            potential: self.potential,
            power: self.power,
            dissipation: self.dissipation.clone(),
            supplied: self.supplied.clone(),
            mass_p: self.mass_p.clone(),
            elements: Arc::clone(&self.elements),
            coupling: self.coupling.clone(),
            may_need_solution: self.may_need_solution,
            inertial: self.inertial,
            inertial_alone: self.inertial_alone,
            free_inertia: self.free_inertia.clone(),
            solved_in_rates: self.solved_in_rates.clone(),
            channels: self.channels.clone(),
            of_rows: OnceLock::new(),
            gammas_are_due: self.gammas_are_due,
        }
    }

    /// The equations of an element, to be written.
    pub(super) fn element_mut(&mut self, index: usize) -> &mut ElementEquations {
        &mut Arc::make_mut(&mut self.elements)[index]
    }

    /// Notes a part of the power that is no heat.
    pub(super) fn note_supplied(&mut self, part: Node) {
        if !self.graph.is_zero(part) {
            self.supplied.push(part);
        }
    }

    /// Potentials that depend on time or on signals (a spring whose end is driven) change although no body moves: dV/dt along
    /// these is power that comes from outside. The states of an element move inside it: what its loads and its potential lose
    /// by them is its own dissipation, and nothing comes from outside.
    fn add_explicit_power(&mut self, layout: &Layout, stored: &Stored) {
        let mut seeds = Seeds::default();
        let time = self.graph.input(Layout::TIME);
        seeds.insert(time, self.graph.constant(1.0));
        let states: Vec<Node> = (0..layout.states).map(|k| self.graph.input(layout.state_slot() + k)).collect();
        seeds.extend(states.iter().copied().zip(self.state_rates.iter().copied()));
        let mut change = derivatives(&mut self.graph, &[stored.shared], &seeds)[0];
        for (potential, own) in &stored.own {
            let mut others = seeds.clone();
            states[own.clone()].iter().for_each(|state| {
                others.remove(state);
            });
            let part = derivatives(&mut self.graph, &[*potential], &others)[0];
            change = self.graph.add(change, part);
        }
        self.power = self.graph.add(self.power, change);
        self.note_supplied(change);
    }

    /// Gravity, gyroscopic terms, energies of a body.
    fn add_body(&mut self, b: usize, body: &Body, model: &Model) {
        let nodes = self.bodies[b].clone();
        let g = &mut self.graph;
        let weight = g.vector(&(body.own_mass() * model.gravity));
        let inertia = g.matrix(&body.inertia);
        let momentum = g.apply(&inertia, nodes.w);
        // Kinetic energy: (m v.v + omega'.J' omega') / 2; potential: -m g.r.
        let mass = g.constant(0.5 * body.own_mass());
        let half = g.constant(0.5);
        let vv = g.dot3(nodes.v, nodes.v);
        let own_momentum = match &body.lent {
            Some(lent) => {
                let own = g.matrix(&lent.own_inertia);
                g.apply(&own, nodes.w)
            }
            None => momentum,
        };
        let wjw = g.dot3(nodes.w, own_momentum);
        let (translation, rotation) = (g.mul(mass, vv), g.mul(half, wjw));
        let kinetic = g.add(translation, rotation);
        self.kinetic = g.add(self.kinetic, kinetic);
        let lift = g.dot3(weight, nodes.r);
        self.potential = g.sub(self.potential, lift);
        let columns = self.form.columns();
        self.loads[columns * b..columns * b + 3].copy_from_slice(&weight);
        match self.form {
            Form::Working => {
                // Euler: J' omega'' = n' - omega' x J' omega'.
                let gyroscopic = g.cross(nodes.w, momentum);
                let negative = g.neg3(gyroscopic);
                self.loads[columns * b + 3..columns * b + 6].copy_from_slice(&negative);
            }
            Form::Reference => {
                // Haug 1989, eq. 11.3.18: mass 4 G^T J' G, velocity terms 8 G_rate^T J' G_rate p.
                let (matrix, rate) = (g_matrix(g, &nodes.p), g_matrix(g, &nodes.p_rate));
                let spun: V3 = std::array::from_fn(|i| dot4(g, &rate[i], &nodes.p));
                let carried = g.apply(&inertia, spun);
                let eight = g.constant(8.0);
                for (k, column) in transposed(&rate).into_iter().enumerate() {
                    let sum = g.dot3(column, carried);
                    self.loads[columns * b + 3 + k] = g.mul(eight, sum);
                }
                let four = g.constant(4.0);
                let axes = transposed(&matrix);
                for (i, left) in axes.iter().enumerate() {
                    let carried = g.apply(&inertia, *left);
                    for right in &axes[..=i] {
                        let product = g.dot3(carried, *right);
                        self.mass_p.push(g.mul(four, product));
                    }
                }
            }
        }
    }

    /// Position, rotation and motion of an element's frames.
    pub(super) fn frames(&mut self, markers: &[Marker]) -> Vec<FrameNodes> {
        markers.iter().map(|marker| frame_nodes(&mut self.graph, marker, &self.bodies)).collect()
    }

    fn add_joint(&mut self, index: usize, element: &Instance, layout: &Layout) {
        let frames = self.frames(&element.markers);
        let (values, opaque) = self.joint_values(index, element, &frames, layout);
        let value_of = |role: Role| values.iter().find(|(r, _)| *r == role).map(|(_, node)| *node);
        let missing = self.graph.constant(f64::NAN);
        let zero = self.graph.constant(0.0);
        let value_of_row = |row: &usize| {
            // What constrains velocities has no value.
            let rate = value_of(Role::VelocityResidual(*row as u32)).map(|_| zero);
            rate.or_else(|| value_of(Role::Residual(*row as u32))).unwrap_or(missing)
        };
        let coordinates = (0..element.class.channels.len()).map(|k| Role::Coordinate(k as u32));
        let coordinates: Vec<Node> = coordinates.map(|role| value_of(role).unwrap_or(missing)).collect();
        let mut wanted: Vec<Node> = element.rows.iter().map(value_of_row).collect();
        let bodies = bodies_of(&element.markers);
        let mut rows = match opaque {
            None if self.gammas_are_due => self.rows_without_gammas(&wanted, &bodies),
            None => self.traced_rows(&wanted, &bodies),
            Some(call) => {
                wanted.extend(&coordinates);
                self.opaque_rows(&wanted, call, element, &frames, &bodies)
            }
        };
        for (row, number) in rows.iter_mut().zip(&element.rows) {
            let Some(rate) = value_of(Role::VelocityResidual(*number as u32)) else { continue };
            let still = self.at_rest(index, element, &frames, layout, *number);
            *row = self.row_of_velocities(rate, still, &bodies);
        }
        let written = self.element_mut(index);
        written.coordinates = coordinates;
        written.coordinate_rows = rows.split_off(element.rows.len());
        self.add_contacts(element, layout.row_at[index]);
        Arc::make_mut(&mut self.rows).extend(rows);
        if !element.limits_follow() {
            self.add_frictions(index, element, &values, layout);
        }
    }

    /// Takes off as a load what elements lend to a body: m v', and J omega'' + omega' x J omega'.
    fn take_back(&mut self, b: usize, body: &Body, layout: &Layout) {
        let Some(lent) = &body.lent else { return };
        let w = self.bodies[b].w;
        let g = &mut self.graph;
        let slot = layout.acceleration_slot() + 6 * b;
        let (mass, inertia) = (g.constant(lent.mass), g.matrix(&lent.inertia));
        let (acceleration, turning) = (g.input_vector(slot), g.input_vector(slot + 3));
        let force = g.scale3(mass, acceleration);
        let change = g.apply(&inertia, turning);
        let momentum = g.apply(&inertia, w);
        let carried = g.cross(w, momentum);
        let moment = g.add3(change, carried);
        self.add_generalised(b, force, moment);
    }

    /// Adds a load at a marker to the right side of its body.
    pub(super) fn apply_load(&mut self, body: usize, force: V3, torque: V3, frame: &FrameNodes) {
        let local = self.moment_on(body, force, torque, frame);
        self.add_generalised(body, force, local);
    }

    /// The moment of a load at a marker about the centre of mass, body axes: n' = A^T (T + s x F).
    pub(super) fn moment_on(&mut self, body: usize, force: V3, torque: V3, frame: &FrameNodes) -> V3 {
        let g = &mut self.graph;
        let lever = g.cross(frame.arm, force);
        let moment = g.add3(torque, lever);
        g.apply_transposed(&self.bodies[body].a, moment)
    }

    /// Adds a force (ground axes) and a moment about the centre of mass (body axes) to the right side of a body.
    fn add_generalised(&mut self, body: usize, force: V3, local: V3) {
        let g = &mut self.graph;
        let nodes = &self.bodies[body];
        let columns = self.form.columns();
        let at = columns * body;
        let mut generalised = force.to_vec();
        match self.form {
            Form::Working => generalised.extend(local),
            Form::Reference => {
                // Generalised force of the Euler parameters: 2 G^T n'.
                let matrix = g_matrix(g, &nodes.p);
                let two = g.constant(2.0);
                for column in transposed(&matrix) {
                    let sum = g.dot3(column, local);
                    generalised.push(g.mul(two, sum));
                }
            }
        }
        for (load, part) in self.loads[at..at + columns].iter_mut().zip(generalised) {
            *load = g.add(*load, part);
        }
    }

    /// The joint's results by role; for an opaque joint also its call.
    fn joint_values(
        &mut self,
        index: usize,
        element: &Instance,
        frames: &[FrameNodes],
        layout: &Layout,
    ) -> (Vec<(Role, Node)>, Option<usize>) {
        let recording = &element.recording;
        let provide = |g: &mut Graph, input: Input| own_input(g, input, index, frames, layout);
        let (values, call) = if element.class.opaque {
            let arguments = call_inputs(element).map(|input| provide(&mut self.graph, input)).collect();
            let call = self.add_call(element, arguments);
            (opaque_results(&mut self.graph, element, call), Some(call))
        } else {
            self.add_unknowns_of_joint(index, element, frames, layout);
            let nodes = import(&mut self.graph, recording, provide);
            self.element_mut(index).grids = element.grids.iter().map(|grid| nodes[grid.argument as usize]).collect();
            (recording.outputs.iter().map(|o| (o.role, nodes[o.node as usize])).collect(), None)
        };
        for (role, node) in &values {
            if let Role::Angle(k) = role {
                self.angles[layout.reference_at[index] + *k as usize] = *node;
            }
        }
        (values, call)
    }
}

/// An input that stands for nothing but the element's own frames and numbers. Signals and reactions, which do, and the
/// coordinates of a mobility, which this formulation does not use, are zero.
pub(super) fn own_input(g: &mut Graph, input: Input, index: usize, frames: &[FrameNodes], layout: &Layout) -> Node {
    match input {
        Input::Time => g.input(Layout::TIME),
        Input::Position { frame, component } => frames[frame as usize].position[component as usize],
        Input::Rotation { frame, row, column } => frames[frame as usize].rotation[row as usize][column as usize],
        Input::Velocity { frame, component } => frames[frame as usize].velocity[component as usize],
        Input::AngularVelocity { frame, component } => frames[frame as usize].angular_velocity[component as usize],
        Input::AngleReference(k) => g.input(layout.reference_slot() + layout.reference_at[index] + k as usize),
        Input::State(k) => g.input(layout.state_slot() + layout.state_at[index] + k as usize),
        Input::Unknown(k) => {
            let missing = g.constant(f64::NAN);
            g.unknown_at(layout.state_slot() + layout.unknown_at[index] + k as usize).unwrap_or(missing)
        }
        Input::Discrete(k) => g.input(layout.discrete_slot() + layout.discrete_at[index] + k as usize),
        Input::Coordinate(_) | Input::Signal(_) | Input::ReactionForce { .. } | Input::ReactionTorque { .. } => {
            g.constant(0.0)
        }
    }
}

/// The bodies among an element's markers, each once.
pub(super) fn bodies_of(markers: &[Marker]) -> Vec<usize> {
    let mut bodies: Vec<usize> = markers.iter().filter_map(|marker| marker.body).collect();
    bodies.sort_unstable();
    bodies.dedup();
    bodies
}
