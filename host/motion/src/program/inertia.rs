//! Inertia that elements bring: what a kinetic energy does to the bodies, and how it moves flexible coordinates.
//!
//! With T(p, A, v, omega; q, q') of an element's frames and flexible coordinates, a quadratic form of velocities, and the momenta
//! h_v = dT/dv, h_w = dT/domega, h_q = dT/dq', Lagrange's equations in the frames' own velocities are
//!
//! F = dT/dp - h_v',   M = dT/dtheta + omega x h_w - h_w',   h_q' = dT/dq + Q
//!
//! for force and torque on each frame, at its origin, in ground axes. d/dtheta_k turns A by the ground axis k and holds omega
//! (Meirovitch, Methods of Analytical Dynamics, 1970, section 4.12). The last equation is solved for q'': T has a matrix M_qq of its
//! own for it, and where that is constant its factors are numbers. What is left is linear in the accelerations of the bodies; they are
//! inputs here, which are found together with these loads as with all others that depend on them (`coupling.rs`).
//!
//! An impulse meets the same inertia: positions stay, T is a quadratic form, so the changes of velocities dv and of momenta are
//! related by the matrix that relates v' to the loads, and flexible velocities jump by the matrix that relates v' to q'', forces
//! apart ([`ElementMass`]).

use std::collections::BTreeMap;

use element_api::Recording;
use element_api::recording::{Input, Op, Role};
use odyn_graph::{Elimination, Graph, Node, Rewriting, Seeds, V3, derivatives, derivatives_along_each, operation};
use rustc_hash::FxHashMap;

use super::equations::{Equations, Form, FrameLoad};
use super::kinematics::{FrameNodes, entries};
use crate::model::{Model, operations_behind};
use crate::plan::Layout;

/// Inputs per frame of an element by itself: position, rotation, twist, accelerations.
const PER_FRAME: usize = 24;

/// The inertia of one element.
#[derive(Clone)]
pub(super) struct Inertia {
    /// Per frame.
    pub(super) loads: Vec<FrameLoad>,
    /// q'' of each flexible coordinate.
    pub(super) rates: Vec<Node>,
}

/// Inertia of all elements with no forces on flexible coordinates, where rows switch.
#[derive(Debug, Clone, Default)]
pub(super) struct FreeInertia {
    /// Loads on bodies: column, node.
    loads: Vec<(usize, Node)>,
    /// q'': number of the state that is q', node.
    rates: Vec<(usize, Node)>,
}

/// The mass matrix of elements, beyond what they lend to the bodies of the model: columns and rows are velocities of bodies, six
/// each. Flexible velocities are eliminated: no impulse acts on them.
#[derive(Debug, Clone, Default)]
pub struct ElementMass {
    /// Columns that are not empty, ascending.
    pub columns: Vec<usize>,
    /// Entries that are not zero: row, place among the columns, node.
    pub entries: Vec<(usize, usize, Node)>,
    /// What flexible velocities change by as the bodies' do: number of the state, place among the columns, node.
    pub flexible: Vec<(usize, usize, Node)>,
}

/// An element by itself: everything that its kinetic energy depends on is an input.
struct Alone {
    graph: Graph,
    /// Six per frame, then q''.
    nodes: Vec<Node>,
    frames: usize,
    flexible: usize,
}

impl Alone {
    fn frame(g: &mut Graph, frame: usize, from: usize) -> V3 {
        g.input_vector(PER_FRAME * frame + from)
    }

    /// Slots of q, of q' and of the forces on them.
    fn flexible_slot(&self, kind: usize, k: usize) -> usize {
        PER_FRAME * self.frames + kind * self.flexible + k
    }

    fn new(recording: &Recording, frames: usize, (first_table, main): (u32, &Graph)) -> Option<Self> {
        let kinetic = recording.output(Role::Kinetic)?;
        let flexible = recording.flexible();
        let mut alone = Self { graph: Graph::default(), nodes: Vec::new(), frames, flexible };
        alone.graph.tables.clone_from(&main.tables);
        let energy = alone.import(recording, kinetic, first_table);
        let slots = |kind: usize| (0..flexible).map(|k| alone.flexible_slot(kind, k)).collect::<Vec<_>>();
        let [q_slots, speed_slots, force_slots] = [0, 1, 2].map(slots);
        let g = &mut alone.graph;
        let one = g.constant(1.0);
        let [q, speeds, forces] = [q_slots, speed_slots, force_slots]
            .map(|slots| slots.into_iter().map(|slot| g.input(slot)).collect::<Vec<Node>>());
        let along = |g: &mut Graph, nodes: &[Node], at: Node| derivatives(g, nodes, &Seeds::from_iter([(at, one)]));
        // Everything moves, flexible velocities apart.
        let mut motion: Seeds = q.iter().copied().zip(speeds.iter().copied()).collect();
        let mut velocities = Vec::with_capacity(6 * frames);
        for frame in 0..frames {
            let [position, velocity, spin, acceleration, turning] =
                [0, 12, 15, 18, 21].map(|from| Self::frame(g, frame, from));
            motion.extend(position.into_iter().zip(velocity));
            motion.extend(velocity.into_iter().zip(acceleration).chain(spin.into_iter().zip(turning)));
            motion.extend(Self::turned(g, frame, spin));
            velocities.extend(velocity.into_iter().chain(spin));
        }
        let momenta: Vec<Node> =
            velocities.iter().chain(&speeds).map(|velocity| along(g, &[energy], *velocity)[0]).collect();
        let changes = derivatives(g, &momenta, &motion);
        let mut left: Vec<Node> = changes.into_iter().map(|change| g.neg(change)).collect();
        for frame in 0..frames {
            let [position, spin] = [0, 15].map(|from| Self::frame(g, frame, from));
            let at = 6 * frame;
            let carried = g.cross(spin, [momenta[at + 3], momenta[at + 4], momenta[at + 5]]);
            for k in 0..3 {
                let pushed = along(g, &[energy], position[k])[0];
                left[at + k] = g.add(left[at + k], pushed);
                let zero = g.constant(0.0);
                let axis = std::array::from_fn(|i| if i == k { one } else { zero });
                let seeds = Self::turned(g, frame, axis);
                let turned = derivatives(g, &[energy], &seeds)[0];
                let sum = g.add(turned, carried[k]);
                left[at + 3 + k] = g.add(left[at + 3 + k], sum);
            }
        }
        let at = 6 * frames;
        let mut mass = Vec::new();
        let mut coupling: Vec<Vec<Node>> = Vec::with_capacity(flexible);
        for k in 0..flexible {
            let pushed = along(g, &[energy], q[k])[0];
            let sum = g.add(pushed, forces[k]);
            left[at + k] = g.add(left[at + k], sum);
            let slopes = along(g, &momenta, speeds[k]);
            mass.extend((k..flexible).map(|row| (row, k, slopes[at + row])));
            coupling.push(slopes[..at].to_vec());
        }
        let elimination = Elimination::new(g, flexible, &mass, &[]);
        let (rates, _) = elimination.solve(g, &left[at..], &[]);
        for (slopes, rate) in coupling.iter().zip(&rates) {
            for (load, slope) in left.iter_mut().zip(slopes) {
                let part = g.mul(*slope, *rate);
                *load = g.sub(*load, part);
            }
        }
        left.truncate(at);
        left.extend(rates);
        alone.nodes = left;
        Some(alone)
    }

    /// The rates of a frame's rotation matrix that turns about an axis, ground axes: A' = omega~ A.
    fn turned(g: &mut Graph, frame: usize, axis: V3) -> Seeds {
        let [x, y, z]: [V3; 3] = [3, 6, 9].map(|from| Self::frame(g, frame, from));
        let mut seeds = Seeds::default();
        for ((x, y), z) in x.into_iter().zip(y).zip(z) {
            let column = [x, y, z];
            let rate = g.cross(axis, column);
            seeds.extend(column.into_iter().zip(rate));
        }
        seeds
    }

    /// An operation of the recording, with everything it needs.
    fn import(&mut self, recording: &Recording, wanted: u32, first_table: u32) -> Node {
        let mut nodes: Vec<Option<Node>> = vec![None; recording.ops.len()];
        for (k, op) in operations_behind(recording, [wanted]) {
            let node = match op {
                Op::Input(input) => {
                    let slot = self.slot(input);
                    match slot {
                        Some(slot) => self.graph.input(slot),
                        None => self.graph.constant(f64::NAN),
                    }
                }
                other => {
                    let at = |k: u32| nodes[k as usize].expect("operands come before their operation");
                    operation(&mut self.graph, recording, other, first_table, at)
                }
            };
            nodes[k as usize] = Some(node);
        }
        nodes[wanted as usize].expect("written down above")
    }

    fn slot(&self, input: Input) -> Option<usize> {
        let place = |frame: u32, from: usize, k: u32| Some(PER_FRAME * frame as usize + from + k as usize);
        match input {
            Input::Position { frame, component } => place(frame, 0, component),
            Input::Rotation { frame, row, column } => place(frame, 3, 3 * row + column),
            Input::Velocity { frame, component } => place(frame, 12, component),
            Input::AngularVelocity { frame, component } => place(frame, 15, component),
            Input::State(k) => Some(self.flexible_slot(0, k as usize)),
            // A checked recording's kinetic energy depends on nothing else.
            _ => None,
        }
    }
}

impl Equations {
    /// The inertia of an element with these frames, whose states begin at a slot and whose flexible coordinates are driven by
    /// `forces`.
    pub(super) fn write_inertia(
        &mut self,
        (recording, first_table): (&Recording, u32),
        frames: &[FrameNodes],
        state_slot: usize,
        forces: &[Node],
        layout: &Layout,
    ) -> Option<Inertia> {
        let mut alone = Alone::new(recording, frames.len(), (first_table, &self.graph))?;
        if self.switches_rows() && self.form == Form::Working {
            let nothing = vec![self.graph.constant(0.0); forces.len()];
            let free = self.carry_inertia(&mut alone, frames, state_slot, &nothing, layout);
            for (frame, load) in frames.iter().zip(&free.loads) {
                let Some(body) = frame.body else { continue };
                let moment = self.moment_on(body, load.force, load.torque, frame);
                let columns = 6 * body..6 * body + 6;
                self.free_inertia.loads.extend(columns.zip(load.force.into_iter().chain(moment)));
            }
            let first = state_slot - layout.state_slot() + forces.len();
            self.free_inertia.rates.extend((first..).zip(free.rates));
        }
        Some(self.carry_inertia(&mut alone, frames, state_slot, forces, layout))
    }

    fn carry_inertia(
        &mut self,
        alone: &mut Alone,
        frames: &[FrameNodes],
        state_slot: usize,
        forces: &[Node],
        layout: &Layout,
    ) -> Inertia {
        let n = alone.flexible;
        let mut replaced: FxHashMap<Node, Node> = FxHashMap::default();
        for (f, frame) in frames.iter().enumerate() {
            let accelerations = self.accelerations_of(frame, layout);
            let here = frame.position.into_iter().chain(entries(&frame.rotation)).chain(frame.velocity);
            let here = here.chain(frame.angular_velocity).chain(accelerations);
            for (k, node) in here.enumerate() {
                replaced.insert(alone.graph.input(PER_FRAME * f + k), node);
            }
        }
        for (k, force) in forces.iter().enumerate() {
            for (kind, node) in
                [(0, self.graph.input(state_slot + k)), (1, self.graph.input(state_slot + n + k)), (2, *force)]
            {
                let slot = alone.flexible_slot(kind, k);
                replaced.insert(alone.graph.input(slot), node);
            }
        }
        let mut rewriting = Rewriting::new(&alone.graph, &mut self.graph, replaced);
        let mut nodes = rewriting.carry_all(&mut self.graph, &alone.nodes);
        let rates = nodes.split_off(6 * frames.len());
        let three = |from: &[Node]| [from[0], from[1], from[2]];
        let load = |six: &[Node]| FrameLoad { force: three(six), torque: three(&six[3..]) };
        Inertia { loads: nodes.chunks_exact(6).map(load).collect(), rates }
    }

    /// What bodies feel of the elements' mass in an impact; of a scene whose rows switch.
    pub fn element_mass(&mut self, model: &Model, layout: &Layout) -> ElementMass {
        let FreeInertia { loads, rates } = self.free_inertia.clone();
        let nodes: Vec<Node> = loads.iter().chain(&rates).map(|(_, node)| *node).collect();
        let mut mass: BTreeMap<(usize, usize), Node> = BTreeMap::new();
        let mut flexible = Vec::new();
        let mut columns = self.solved_inputs(&nodes, layout);
        columns.retain(|slot| *slot < layout.acceleration_slot() + layout.velocities());
        let inputs: Vec<Node> = columns.iter().map(|slot| self.graph.input(*slot)).collect();
        columns.iter_mut().for_each(|slot| *slot -= layout.acceleration_slot());
        for (column, slopes) in columns.into_iter().zip(derivatives_along_each(&mut self.graph, &nodes, &inputs)) {
            let (of_loads, of_rates) = slopes.split_at(loads.len());
            for ((row, _), slope) in loads.iter().zip(of_loads) {
                let before = mass.get(&(column, *row)).copied().unwrap_or_else(|| self.graph.constant(0.0));
                mass.insert((column, *row), self.graph.sub(before, *slope));
            }
            flexible.extend(rates.iter().zip(of_rates).map(|((state, _), slope)| (*state, column, *slope)));
        }
        for (b, body) in model.bodies.iter().enumerate() {
            let Some(lent) = &body.lent else { continue };
            let translation = (0..3).map(|k| ((6 * b + k, 6 * b + k), lent.mass));
            let pairs = (0..3).flat_map(|column| (0..3).map(move |row| (column, row)));
            let rotation = pairs.map(|(c, r)| ((6 * b + 3 + c, 6 * b + 3 + r), lent.inertia[(r, c)]));
            for (place, value) in translation.chain(rotation) {
                let (zero, value) = (self.graph.constant(0.0), self.graph.constant(value));
                let before = mass.get(&place).copied().unwrap_or(zero);
                mass.insert(place, self.graph.sub(before, value));
            }
        }
        mass.retain(|_, node| !self.graph.is_zero(*node));
        flexible.retain(|(_, _, node)| !self.graph.is_zero(*node));
        let mut columns: Vec<usize> = mass.keys().map(|(column, _)| *column).collect();
        columns.extend(flexible.iter().map(|(_, column, _)| *column));
        columns.sort_unstable();
        columns.dedup();
        let place = |column: usize| columns.partition_point(|known| *known < column);
        let entries = mass.into_iter().map(|((column, row), node)| (row, place(column), node)).collect();
        let flexible = flexible.into_iter().map(|(state, column, node)| (state, place(column), node)).collect();
        ElementMass { entries, flexible, columns }
    }

    /// Acceleration of a frame's origin and angular acceleration, ground axes, from the accelerations among the inputs.
    fn accelerations_of(&mut self, frame: &FrameNodes, layout: &Layout) -> Vec<Node> {
        let mut velocities = frame.velocity.to_vec();
        velocities.extend(frame.angular_velocity);
        let Some(body) = frame.body else { return vec![self.graph.constant(0.0); 6] };
        let mut seeds = self.motion_seeds(&[body]);
        let columns = self.form.columns();
        for column in columns * body..columns * (body + 1) {
            let acceleration = self.acceleration(column, layout);
            seeds.insert(self.speed(column), acceleration);
        }
        derivatives(&mut self.graph, &velocities, &seeds)
    }
}
