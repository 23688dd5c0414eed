//! From requested output channels to nodes.
//!
//! Accelerations and multipliers are inputs here: they come from the solver. What a channel does not use is not computed.

use element_api::Kind;
use odyn_graph::{Expr, Node, V3};

use super::equations::{Equations, Form, Row, bodies_of};
use super::kinematics::{dot4, g_matrix, transposed};
use crate::model::{Axes, Level, MAGNITUDE, Model, Quantity, Shown, Watched, WatchedValue};
use crate::plan::Layout;

/// Keeps the derivative of the length of a vector finite where it is zero.
const NOTHING: f64 = 1e-300;

impl Equations {
    /// The nodes of all channels of the model, SI; written down when they are first asked for.
    pub fn channels(&mut self, model: &Model, layout: &Layout) -> Vec<Node> {
        if self.channels.len() != model.channels.len() {
            let channels = model.channels.iter();
            self.channels = channels.map(|channel| self.observe(&channel.quantity, model, layout)).collect();
        }
        self.channels.clone()
    }

    /// The node of a requested quantity, SI.
    pub fn observe(&mut self, quantity: &Quantity, model: &Model, layout: &Layout) -> Node {
        match quantity {
            Quantity::Point { body, point, level, axes, component } => {
                let vector = self.point(*body, point, *level, layout);
                self.component(vector, *axes, *component)
            }
            Quantity::EulerParameter { body, component } => self.bodies[*body].p[*component],
            Quantity::Angular { body, level, axes, component } => {
                let local = match level {
                    Level::Acceleration => self.graph.input_vector(layout.acceleration_slot() + 6 * body + 3),
                    _ => self.bodies[*body].w,
                };
                if *axes == Axes::Body(*body) {
                    return local[*component];
                }
                let vector = self.graph.apply(&self.bodies[*body].a, local);
                self.component(vector, *axes, *component)
            }
            Quantity::Coordinate { element, coordinate, level } => {
                if *level == Level::Position {
                    return self.elements[*element].coordinates[*coordinate];
                }
                let row = self.coordinate(*element, *coordinate, model);
                if *level == Level::Velocity { self.row_rate(&row) } else { self.row_acceleration(&row, layout) }
            }
            Quantity::Load { element, frame, torque, axes, component } => {
                let (force, moment) = match model.elements[*element].class.kind {
                    Kind::Force | Kind::Control => {
                        let load = self.elements[*element].loads[*frame];
                        (load.force, load.torque)
                    }
                    Kind::Joint => self.reaction(*element, *frame, model, layout),
                };
                let vector = if *torque { moment } else { force };
                self.component(vector, *axes, *component)
            }
            Quantity::Value { element, channel } => self.elements[*element].channels[*channel],
            Quantity::Given { input } => self.graph.input(layout.given_slot(*input)),
            Quantity::Balance { body, torque, component } => self.balance(*body, *torque, model, layout)[*component],
            Quantity::KineticEnergy => self.kinetic,
            Quantity::PotentialEnergy => self.potential,
            Quantity::TotalEnergy => self.graph.add(self.kinetic, self.potential),
        }
    }

    /// A coordinate of a joint with its derivatives: few are asked for, so that they are written down then.
    pub(super) fn coordinate(&mut self, element: usize, coordinate: usize, model: &Model) -> Row {
        if self.elements[element].coordinate_rows.is_empty() {
            let values = self.elements[element].coordinates.clone();
            let bodies = bodies_of(&model.elements[element].markers);
            let rows = self.traced_rows(&values, &bodies);
            self.element_mut(element).coordinate_rows = rows;
        }
        self.elements[element].coordinate_rows[coordinate].clone()
    }

    /// The node of a value that is looked at, SI.
    #[must_use]
    pub fn watched(&self, watched: &Watched) -> Node {
        let element = &self.elements[watched.element];
        match watched.value {
            WatchedValue::Channel(k) => element.channels[k],
            WatchedValue::Check(k) => element.checks[k],
            WatchedValue::Grid(k) => element.grids[k],
        }
    }

    /// The angle references that the equations, memories between steps or requested quantities depend on, ascending: how often
    /// the other angles have turned is of no consequence.
    pub fn counted_angles(&mut self, model: &Model, layout: &Layout) -> Vec<usize> {
        if layout.references == 0 {
            return Vec::new();
        }
        let mut roots: Vec<Node> = self.channels(model, layout);
        roots.extend(model.watched().iter().map(|watched| self.watched(watched)));
        roots.extend([self.kinetic, self.potential]);
        roots.extend(self.releases.iter().map(|one| one.value));
        roots.extend(self.latches.iter().flat_map(|latch| &latch.inputs));
        let lists = [&self.next_discrete, &self.dissipation, &self.supplied];
        roots.extend(lists.into_iter().flatten());
        for element in self.elements.iter() {
            roots.extend(element.loads.iter().flat_map(|load| load.force.into_iter().chain(load.torque)));
        }
        roots.extend(self.nodes_of_motion());
        self.references_below(&roots, layout)
    }

    /// Whether the motion depends on how often angles have turned; otherwise only memories and what is reported may.
    #[must_use]
    pub fn turns_act(&self, layout: &Layout) -> bool {
        layout.references > 0 && !self.references_below(&self.nodes_of_motion(), layout).is_empty()
    }

    /// What the rates of a state are made of.
    fn nodes_of_motion(&self) -> Vec<Node> {
        let mut nodes = [&self.loads[..], &self.state_rates, &[self.power]].concat();
        for row in self.rows.iter() {
            nodes.extend([row.value, row.time, row.gamma]);
            nodes.extend(row.jacobian.iter().map(|(_, node)| *node));
        }
        nodes.extend(self.graph.calls.iter().flat_map(|call| &call.arguments));
        nodes.extend(self.releases.iter().map(|one| one.value));
        nodes.extend(self.latches.iter().flat_map(|latch| &latch.inputs));
        nodes
    }

    /// The angle references that nodes depend on, ascending.
    fn references_below(&self, nodes: &[Node], layout: &Layout) -> Vec<usize> {
        let slots = layout.reference_slot()..layout.discrete_slot();
        let mut references: Vec<usize> = self
            .graph
            .live(nodes)
            .into_iter()
            .filter_map(|node| match self.graph.expr(node) {
                Expr::Input(slot) if slots.contains(&(slot as usize)) => Some(slot as usize - slots.start),
                _ => None,
            })
            .collect();
        references.sort_unstable();
        references
    }

    /// What a picture of the motion shows of the bodies, SI, ground axes: per body the position of the origin of its frame, then
    /// the rows of the matrix body -> ground.
    pub fn poses(&mut self, model: &Model, layout: &Layout) -> Vec<Node> {
        let mut nodes = Vec::with_capacity(12 * model.bodies.len());
        for (body, own) in model.bodies.iter().enumerate() {
            nodes.extend(self.point(body, &-own.center_of_mass, Level::Position, layout));
            nodes.extend(self.bodies[body].a.iter().flatten());
        }
        nodes
    }

    /// The loads that a picture of the motion shows ([`Model::shown_loads`]), SI, ground axes: per load the force, then the torque
    /// at the origin of its frame.
    pub fn shown_loads(&mut self, model: &Model, layout: &Layout) -> Vec<Node> {
        let mut nodes = Vec::new();
        for Shown { element, frame } in model.shown_loads() {
            for torque in [false, true] {
                for component in 0..3 {
                    let load = Quantity::Load { element, frame, torque, axes: Axes::Ground, component };
                    nodes.push(self.observe(&load, model, layout));
                }
            }
        }
        nodes
    }

    /// A component of a ground vector in the axes asked for.
    pub(super) fn component(&mut self, vector: V3, axes: Axes, component: usize) -> Node {
        if component == MAGNITUDE {
            let g = &mut self.graph;
            let square = g.dot3(vector, vector);
            let nothing = g.constant(NOTHING);
            let more = g.add(square, nothing);
            let length = g.sqrt(more);
            return g.div(square, length);
        }
        match axes {
            Axes::Ground => vector[component],
            Axes::Body(body) => {
                let a = self.bodies[body].a;
                self.graph.apply_transposed(&a, vector)[component]
            }
        }
    }

    /// Position, velocity or acceleration of a body-fixed point, ground axes.
    fn point(&mut self, body: usize, point: &nalgebra::Vector3<f64>, level: Level, layout: &Layout) -> V3 {
        let nodes = self.bodies[body].clone();
        let g = &mut self.graph;
        let s = g.vector(point);
        let local = match level {
            Level::Position => s,
            Level::Velocity => g.cross(nodes.w, s),
            Level::Acceleration => {
                // omega'' x s + omega' x (omega' x s)
                let spin = g.input_vector(layout.acceleration_slot() + 6 * body + 3);
                let tangential = g.cross(spin, s);
                let swept = g.cross(nodes.w, s);
                let inward = g.cross(nodes.w, swept);
                g.add3(tangential, inward)
            }
        };
        let carried = g.apply(&nodes.a, local);
        let origin = match level {
            Level::Position => nodes.r,
            Level::Velocity => nodes.v,
            Level::Acceleration => g.input_vector(layout.acceleration_slot() + 6 * body),
        };
        g.add3(origin, carried)
    }

    /// d/dt of a function of the configuration: its Jacobian times the velocities, plus its own dependence on time.
    pub fn row_rate(&mut self, row: &Row) -> Node {
        let mut sum = row.time;
        for (column, slope) in &row.jacobian {
            let speed = self.speed(*column);
            let product = self.graph.mul(*slope, speed);
            sum = self.graph.add(sum, product);
        }
        sum
    }

    /// The second derivative with respect to time: Phi_q a - gamma.
    pub fn row_acceleration(&mut self, row: &Row, layout: &Layout) -> Node {
        let mut sum = self.graph.neg(row.gamma);
        for (column, slope) in &row.jacobian {
            let acceleration = self.acceleration(*column, layout);
            let product = self.graph.mul(*slope, acceleration);
            sum = self.graph.add(sum, product);
        }
        sum
    }

    /// Force and torque of a joint on the body of a frame, at that frame's origin, ground axes: the load -Phi_q^T lambda
    /// on the body, moved from the centre of mass to the marker. On ground: the opposite of all others, moved likewise.
    pub(super) fn reaction(&mut self, element: usize, frame: usize, model: &Model, layout: &Layout) -> (V3, V3) {
        let instance = &model.elements[element];
        let zero = self.graph.constant(0.0);
        let marker = &instance.markers[frame];
        if let Some(body) = marker.body {
            let (force, moment) = self.body_reaction(element, body, instance.rows.len(), layout);
            let arm = self.graph.vector(&marker.position);
            let arm = self.graph.apply(&self.bodies[body].a, arm);
            let lever = self.graph.cross(arm, force);
            return (force, self.graph.sub3(moment, lever));
        }
        let origin = self.graph.vector(&marker.position);
        let (mut force, mut moment) = ([zero; 3], [zero; 3]);
        let mut bodies: Vec<usize> = instance.markers.iter().filter_map(|m| m.body).collect();
        bodies.sort_unstable();
        bodies.dedup();
        for body in bodies {
            let (f, n) = self.body_reaction(element, body, instance.rows.len(), layout);
            let arm = self.graph.sub3(self.bodies[body].r, origin);
            let lever = self.graph.cross(arm, f);
            let total = self.graph.add3(n, lever);
            force = self.graph.sub3(force, f);
            moment = self.graph.sub3(moment, total);
        }
        (force, moment)
    }

    /// Force and moment about the centre of mass of a body that an element's rows cause, ground axes.
    fn body_reaction(&mut self, element: usize, body: usize, rows: usize, layout: &Layout) -> (V3, V3) {
        let zero = self.graph.constant(0.0);
        let columns = self.form.columns();
        let mut load = [zero; 7];
        for k in 0..rows {
            let row = layout.row_at[element] + k;
            let multiplier = self.multiplier(row, layout);
            for (column, slope) in self.rows[row].jacobian.clone() {
                if column / columns == body {
                    let product = self.graph.mul(slope, multiplier);
                    load[column % columns] = self.graph.sub(load[column % columns], product);
                }
            }
        }
        let force = [load[0], load[1], load[2]];
        let local = match self.form {
            Form::Working => [load[3], load[4], load[5]],
            Form::Reference => {
                // Q_p = 2 G^T n', hence n' = G Q_p / 2.
                let g = &mut self.graph;
                let matrix = g_matrix(g, &self.bodies[body].p);
                let half = g.constant(0.5);
                std::array::from_fn(|i| {
                    let sum = dot4(g, &matrix[i], &[load[3], load[4], load[5], load[6]]);
                    g.mul(half, sum)
                })
            }
        };
        let moment = self.graph.apply(&self.bodies[body].a, local);
        (force, moment)
    }

    /// The rate of a coordinate of the Jacobian's columns.
    pub(super) fn speed(&self, column: usize) -> Node {
        let (body, k) = (column / self.form.columns(), column % self.form.columns());
        let nodes = &self.bodies[body];
        match self.form {
            _ if k < 3 => nodes.v[k],
            Form::Working => nodes.w[k - 3],
            Form::Reference => nodes.p_rate[k - 3],
        }
    }

    /// Its second derivative, from the accelerations among the inputs.
    pub(super) fn acceleration(&mut self, column: usize, layout: &Layout) -> Node {
        let (body, k) = (column / self.form.columns(), column % self.form.columns());
        let slot = layout.acceleration_slot() + 6 * body;
        let g = &mut self.graph;
        if k < 3 || self.form == Form::Working {
            return g.input(slot + k);
        }
        // p'' = G^T omega'' / 2 - (p'.p') p: omega' = 2 G p' (Haug 1989, eq. 9.3.32) and p.p = 1, differentiated.
        let nodes = &self.bodies[body];
        let spin = g.input_vector(slot + 3);
        let matrix = g_matrix(g, &nodes.p);
        let sum = g.dot3(transposed(&matrix)[k - 3], spin);
        let half = g.constant(0.5);
        let turning = g.mul(half, sum);
        let square = dot4(g, &nodes.p_rate, &nodes.p_rate);
        let inward = g.mul(square, nodes.p[k - 3]);
        g.sub(turning, inward)
    }

    /// Loads on a body as they are reported, against its acceleration: see [`Quantity::Balance`].
    fn balance(&mut self, body: usize, torque: bool, model: &Model, layout: &Layout) -> V3 {
        let own = &model.bodies[body];
        let nodes = self.bodies[body].clone();
        let zero = self.graph.constant(0.0);
        let (mut force, mut moment) = (self.graph.vector(&(own.own_mass() * model.gravity)), [zero; 3]);
        for (index, element) in model.elements.iter().enumerate() {
            let mut done = false;
            for (frame, marker) in element.markers.iter().enumerate() {
                if marker.body != Some(body) {
                    continue;
                }
                let (f, n) = match element.class.kind {
                    // A joint's reaction on a body is one, however many of its frames are there.
                    Kind::Joint if done => continue,
                    Kind::Joint => self.reaction(index, frame, model, layout),
                    Kind::Force => (self.elements[index].loads[frame].force, self.elements[index].loads[frame].torque),
                    Kind::Control => continue,
                };
                done = true;
                let g = &mut self.graph;
                let arm = g.vector(&marker.position);
                let arm = g.apply(&nodes.a, arm);
                let lever = g.cross(arm, f);
                let turning = g.add3(n, lever);
                force = g.add3(force, f);
                moment = g.add3(moment, turning);
            }
        }
        let g = &mut self.graph;
        let slot = layout.acceleration_slot() + 6 * body;
        if !torque {
            let acceleration = g.input_vector(slot);
            let mass = g.constant(own.own_mass());
            let inertial = g.scale3(mass, acceleration);
            return g.sub3(force, inertial);
        }
        let inertia = g.matrix(&own.own_inertia());
        let spin = g.input_vector(slot + 3);
        let tangential = g.apply(&inertia, spin);
        let momentum = g.apply(&inertia, nodes.w);
        let gyroscopic = g.cross(nodes.w, momentum);
        let change = g.add3(tangential, gyroscopic);
        let change = g.apply(&nodes.a, change);
        g.sub3(moment, change)
    }
}
