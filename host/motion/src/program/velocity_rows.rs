//! Rows on velocities, linear in them: their derivatives, and what of them is left at rest.

use element_api::recording::{Input, Role};
use odyn_graph::{Graph, Node, Seeds, derivatives, import};

use super::equations::{Equations, Form, Row, own_input};
use super::kinematics::FrameNodes;
use crate::model::Instance;
use crate::plan::Layout;

impl Equations {
    /// A velocity row of a joint with all velocities zero.
    pub(super) fn at_rest(
        &mut self,
        index: usize,
        element: &Instance,
        frames: &[FrameNodes],
        layout: &Layout,
        row: usize,
    ) -> Node {
        let still = |g: &mut Graph, input: Input| match input {
            Input::Velocity { .. } | Input::AngularVelocity { .. } => g.constant(0.0),
            _ => own_input(g, input, index, frames, layout),
        };
        let nodes = import(&mut self.graph, &element.recording, still);
        let output = element.recording.output(Role::VelocityResidual(row as u32));
        output.map_or_else(|| self.graph.constant(f64::NAN), |at| nodes[at as usize])
    }

    /// The row for a function c = a . v + b, with b: its derivatives along the rates of coordinates, and -dc/dt with all
    /// accelerations zero.
    pub(super) fn row_of_velocities(&mut self, rate: Node, at_rest: Node, bodies: &[usize]) -> Row {
        let columns = self.form.columns();
        let one = self.graph.constant(1.0);
        let mut jacobian = Vec::new();
        for body in bodies {
            let nodes = &self.bodies[*body];
            let velocities: Vec<Node> = match self.form {
                Form::Working => nodes.v.into_iter().chain(nodes.w).collect(),
                Form::Reference => nodes.v.into_iter().chain(nodes.p_rate).collect(),
            };
            for (k, velocity) in velocities.into_iter().enumerate() {
                let slope = derivatives(&mut self.graph, &[rate], &Seeds::from_iter([(velocity, one)]))[0];
                if !self.graph.is_zero(slope) {
                    jacobian.push((columns * body + k, slope));
                }
            }
        }
        let seeds = self.motion_seeds(bodies);
        let change = derivatives(&mut self.graph, &[rate], &seeds)[0];
        let value = self.graph.constant(0.0);
        Row { value, time: at_rest, gamma: self.graph.neg(change), jacobian, of_velocities: true }
    }
}
