//! Opaque elements: called at run time, their own derivatives carried over to the bodies.

use element_api::Kind;
use element_api::recording::{Input, Role};
use element_api::set::Layout as CallLayout;
use odyn_graph::{Call, Graph, Node, V3};

use super::equations::{Equations, Form, Row};
use super::kinematics::{FrameNodes, g_matrix};
use crate::model::Instance;

impl Equations {
    /// Rows of an opaque joint: its own derivatives with respect to its frames, carried over to the bodies.
    pub(super) fn opaque_rows(
        &mut self,
        values: &[Node],
        call: usize,
        element: &Instance,
        frames: &[FrameNodes],
        bodies: &[usize],
    ) -> Vec<Row> {
        let (count, per_row) = (values.len(), 6 * frames.len());
        let columns = self.form.columns();
        let mut rows = Vec::with_capacity(count);
        for (row, value) in values.iter().enumerate() {
            let mut jacobian = Vec::new();
            for body in bodies {
                for k in 0..columns {
                    let (shift, turn) = self.coordinate_direction(*body, k);
                    let mut sum = self.graph.constant(0.0);
                    for (f, (frame, marker)) in frames.iter().zip(&element.markers).enumerate() {
                        if marker.body != Some(*body) {
                            continue;
                        }
                        let slope = |g: &mut Graph, j| g.call_result(call, count + row * per_row + 6 * f + j);
                        let g = &mut self.graph;
                        let (along, about): (V3, V3) =
                            (std::array::from_fn(|j| slope(g, j)), std::array::from_fn(|j| slope(g, 3 + j)));
                        // Shift of the marker's origin: dr + A (dpi' x s); turn about its own axes: C^T dpi'.
                        let local = g.vector(&marker.position);
                        let swept = g.cross(turn, local);
                        let carried = g.apply(&self.bodies[*body].a, swept);
                        let moved = g.add3(shift, carried);
                        let mounting = g.matrix(&marker.rotation);
                        let turned = g.apply_transposed(&mounting, turn);
                        let (p, q) = (g.dot3(along, moved), g.dot3(about, turned));
                        let both = g.add(p, q);
                        sum = g.add(sum, both);
                        debug_assert_eq!(frame.body, Some(*body));
                    }
                    if !self.graph.is_zero(sum) {
                        jacobian.push((columns * body + k, sum));
                    }
                }
            }
            let g = &mut self.graph;
            let time = g.call_result(call, count * (1 + per_row) + row);
            // The element's second derivative has frames at zero acceleration; markers off the centre of mass have the
            // centripetal one, omega x (omega x s).
            let mut second = g.call_result(call, count * (2 + per_row) + row);
            for (f, (frame, marker)) in frames.iter().zip(&element.markers).enumerate() {
                let Some(body) = marker.body else { continue };
                let along: V3 = std::array::from_fn(|j| g.call_result(call, count + row * per_row + 6 * f + j));
                let w = self.bodies[body].w;
                let local = g.vector(&marker.position);
                let swept = g.cross(w, local);
                let inward = g.cross(w, swept);
                let centripetal = g.apply(&self.bodies[body].a, inward);
                let extra = g.dot3(along, centripetal);
                second = g.add(second, extra);
                debug_assert!(frame.body.is_some());
            }
            rows.push(Row { value: *value, time, gamma: self.graph.neg(second), jacobian, of_velocities: false });
        }
        rows
    }

    /// Shift (ground axes) and turn (body axes) of a body along one of its coordinates.
    fn coordinate_direction(&mut self, body: usize, k: usize) -> (V3, V3) {
        let g = &mut self.graph;
        let (zero, one) = (g.constant(0.0), g.constant(1.0));
        let unit = |i: usize| -> V3 { std::array::from_fn(|j| if i == j { one } else { zero }) };
        if k < 3 {
            return (unit(k), [zero; 3]);
        }
        match self.form {
            Form::Working => ([zero; 3], unit(k - 3)),
            Form::Reference => {
                // dpi' = 2 G dp.
                let matrix = g_matrix(g, &self.bodies[body].p);
                let two = g.constant(2.0);
                ([zero; 3], std::array::from_fn(|i| g.mul(two, matrix[i][k - 3])))
            }
        }
    }

    /// Adds the call of an instance with the nodes of its [`call_inputs`]; gives its number.
    pub(super) fn add_call(&mut self, element: &Instance, arguments: Vec<Node>) -> usize {
        let g = &mut self.graph;
        let layout = call_layout(element);
        let values = layout.values;
        let (results, jacobian_from, second_from) = match element.class.kind {
            Kind::Joint => (layout.joint_results(), values, values * (2 + 6 * layout.frames)),
            Kind::Force | Kind::Control => (layout.force_results(), usize::MAX, usize::MAX),
        };
        g.calls.push(Call {
            set: element.set,
            instance: element.index,
            arguments,
            results,
            jacobian_from,
            second_from,
            second_to: second_from.saturating_add(values),
        });
        g.calls.len() - 1
    }
}

/// The inputs of an opaque element, in the order of [`CallLayout`].
pub(super) fn call_inputs(element: &Instance) -> impl Iterator<Item = Input> + use<> {
    let layout = call_layout(element);
    let list = |count: usize, kind: fn(u32) -> Input| (0..count as u32).map(kind);
    let reactions = (0..layout.joints as u32).flat_map(|joint| {
        let forces = (0..3).map(move |component| Input::ReactionForce { joint, component });
        forces.chain((0..3).map(move |component| Input::ReactionTorque { joint, component }))
    });
    let frames = (0..layout.frames as u32).flat_map(|frame| {
        let position = (0..3).map(move |component| Input::Position { frame, component });
        let rotation = (0..9).map(move |k| Input::Rotation { frame, row: k / 3, column: k % 3 });
        let velocity = (0..3).map(move |component| Input::Velocity { frame, component });
        let spin = (0..3).map(move |component| Input::AngularVelocity { frame, component });
        position.chain(rotation).chain(velocity).chain(spin)
    });
    std::iter::once(Input::Time)
        .chain(list(layout.angles, Input::AngleReference))
        .chain(list(layout.states, Input::State))
        .chain(list(layout.memory, Input::Discrete))
        .chain(list(layout.signals, Input::Signal))
        .chain(reactions)
        .chain(frames)
}

/// Sizes of an opaque element's inputs and results.
fn call_layout(element: &Instance) -> CallLayout {
    CallLayout {
        frames: element.markers.len(),
        angles: element.class.angles,
        states: element.recording.initial_states.len(),
        memory: element.recording.initial_discrete.len(),
        signals: element.class.inputs.len(),
        joints: element.class.joints.len(),
        values: element.value_count(),
    }
}

/// The results of an opaque element's call by role, where [`CallLayout`] says they are.
pub(super) fn opaque_results(g: &mut Graph, element: &Instance, call: usize) -> Vec<(Role, Node)> {
    let layout = call_layout(element);
    let given = |role: &Role| element.recording.outputs.iter().any(|o| o.role == *role);
    let mut next = 0;
    let mut list = Vec::new();
    let mut take = |g: &mut Graph, role: Role| {
        if given(&role) {
            list.push((role, g.call_result(call, next)));
        }
        next += 1;
    };
    match element.class.kind {
        Kind::Joint => {
            element.rows.iter().for_each(|row| take(g, Role::Residual(*row as u32)));
            (0..element.class.channels.len()).for_each(|k| take(g, Role::Coordinate(k as u32)));
            let angles_at = layout.joint_results() - layout.angles;
            for k in 0..layout.angles {
                list.push((Role::Angle(k as u32), g.call_result(call, angles_at + k)));
            }
        }
        Kind::Force | Kind::Control => {
            (0..3 * layout.frames).for_each(|k| take(g, Role::Force(k as u32)));
            (0..3 * layout.frames).for_each(|k| take(g, Role::Torque(k as u32)));
            (0..layout.states).for_each(|k| take(g, Role::StateRate(k as u32)));
            (0..layout.memory).for_each(|k| take(g, Role::NextDiscrete(k as u32)));
            (0..layout.values).for_each(|k| take(g, Role::Channel(k as u32)));
            take(g, Role::Potential);
            take(g, Role::Dissipation);
            (0..layout.angles).for_each(|k| take(g, Role::Angle(k as u32)));
        }
    }
    list
}
