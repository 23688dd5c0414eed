//! Rows on velocities, linear in them: their derivatives, and what of them is left at rest.

use element_api::recording::{Input, Role};
use odyn_graph::{Graph, Node, derivatives, derivatives_along_each, import};

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
        let speeds = |body: &usize| {
            let nodes = &self.bodies[*body];
            let turning = match self.form {
                Form::Working => &nodes.w[..],
                Form::Reference => &nodes.p_rate,
            };
            nodes.v.iter().chain(turning).copied().collect::<Vec<Node>>()
        };
        let velocities: Vec<Node> = bodies.iter().flat_map(speeds).collect();
        let slopes = derivatives_along_each(&mut self.graph, &[rate], &velocities);
        let column = |k: usize| columns * bodies[k / columns] + k % columns;
        let of_one = slopes.into_iter().enumerate().map(|(k, slope)| (column(k), slope[0]));
        let jacobian = of_one.filter(|(_, slope)| !self.graph.is_zero(*slope)).collect();
        let seeds = self.motion_seeds(bodies);
        let change = derivatives(&mut self.graph, &[rate], &seeds)[0];
        let value = self.graph.constant(0.0);
        Row { value, time: at_rest, gamma: self.graph.neg(change), jacobian, of_velocities: true }
    }
}
