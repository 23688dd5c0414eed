//! From requested output channels to nodes.
//!
//! Accelerations and multipliers are inputs here: they come from the solver. What a channel does not use is not computed.

use element_api::Kind;

use super::equations::{Equations, Form, Row};
use super::graph::Node;
use super::vector::V3;
use crate::model::{Axes, Level, Model, Quantity};
use crate::plan::Layout;

impl Equations {
    /// The node of a requested quantity, SI. Working form only.
    pub fn observe(&mut self, quantity: &Quantity, model: &Model, layout: &Layout) -> Node {
        debug_assert_eq!(self.form, Form::Working, "reports are written in working coordinates");
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
                let row = self.elements[*element].coordinates[*coordinate].clone();
                match level {
                    Level::Position => row.value,
                    Level::Velocity => self.row_rate(&row),
                    Level::Acceleration => self.row_acceleration(&row, layout),
                }
            }
            Quantity::Load { element, frame, torque, axes, component } => {
                let (force, moment) = match model.elements[*element].class.kind {
                    Kind::Force => {
                        let load = self.elements[*element].loads[*frame];
                        (load.force, load.torque)
                    }
                    Kind::Joint => self.reaction(*element, *frame, model, layout),
                };
                let vector = if *torque { moment } else { force };
                self.component(vector, *axes, *component)
            }
            Quantity::Value { element, channel } => self.elements[*element].channels[*channel],
            Quantity::KineticEnergy => self.kinetic,
            Quantity::PotentialEnergy => self.potential,
            Quantity::TotalEnergy => self.graph.add(self.kinetic, self.potential),
        }
    }

    /// A component of a ground vector in the axes asked for.
    fn component(&mut self, vector: V3, axes: Axes, component: usize) -> Node {
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
            let nodes = &self.bodies[column / 6];
            let speed = if column % 6 < 3 { nodes.v[column % 6] } else { nodes.w[column % 6 - 3] };
            let product = self.graph.mul(*slope, speed);
            sum = self.graph.add(sum, product);
        }
        sum
    }

    /// The second derivative with respect to time: Phi_q a - gamma.
    fn row_acceleration(&mut self, row: &Row, layout: &Layout) -> Node {
        let mut sum = self.graph.neg(row.gamma);
        for (column, slope) in &row.jacobian {
            let acceleration = self.graph.input(layout.acceleration_slot() + column);
            let product = self.graph.mul(*slope, acceleration);
            sum = self.graph.add(sum, product);
        }
        sum
    }

    /// Force and torque of a joint on the body of a frame, at that frame's origin, ground axes: the load -Phi_q^T lambda
    /// on the body, moved from the centre of mass to the marker. On ground: the opposite of all others, moved likewise.
    fn reaction(&mut self, element: usize, frame: usize, model: &Model, layout: &Layout) -> (V3, V3) {
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
        let mut load = [zero; 6];
        for k in 0..rows {
            let row = layout.row_at[element] + k;
            let multiplier = self.graph.input(layout.multiplier_slot() + row);
            for (column, slope) in self.rows[row].jacobian.clone() {
                if column / 6 == body {
                    let product = self.graph.mul(slope, multiplier);
                    load[column % 6] = self.graph.sub(load[column % 6], product);
                }
            }
        }
        let force = [load[0], load[1], load[2]];
        let moment = self.graph.apply(&self.bodies[body].a, [load[3], load[4], load[5]]);
        (force, moment)
    }
}
