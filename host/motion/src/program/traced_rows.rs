//! Rows from recorded functions of the configuration: derivatives along the coordinates of bodies, and along the motion.

use std::sync::Arc;

use odyn_graph::{Below, Node, Seeds, V3, derivatives, derivatives_among};

use super::equations::{Equations, Form, Row};
use super::kinematics::{entries, transposed, turned_parameters};
use crate::plan::Layout;

impl Equations {
    /// Derivatives of recorded functions along each coordinate of the bodies they may depend on.
    pub(super) fn traced_rows(&mut self, values: &[Node], bodies: &[usize]) -> Vec<Row> {
        let (mut rows, below) = self.traced_slopes(values, bodies);
        let gammas = self.traced_gammas(values, bodies, &below);
        rows.iter_mut().zip(gammas).for_each(|(row, gamma)| row.gamma = gamma);
        rows
    }

    /// The same without second derivatives, which are not numbers: [`Equations::write_gammas`] adds them.
    pub(super) fn rows_without_gammas(&mut self, values: &[Node], bodies: &[usize]) -> Vec<Row> {
        self.traced_slopes(values, bodies).0
    }

    /// The same, with what the functions depend on.
    fn traced_slopes(&mut self, values: &[Node], bodies: &[usize]) -> (Vec<Row>, Below) {
        let mut jacobian: Vec<Vec<(usize, Node)>> = vec![Vec::new(); values.len()];
        let columns = self.form.columns();
        let below = self.below(values, bodies);
        for body in bodies {
            for k in 0..columns {
                let seeds = self.coordinate_seeds(*body, k, &below);
                let slopes = derivatives_among(&mut self.graph, &below, values, &seeds);
                for (row, slope) in jacobian.iter_mut().zip(slopes) {
                    if !self.graph.is_zero(slope) {
                        row.push((columns * body + k, slope));
                    }
                }
            }
        }
        let time_input = self.graph.input(Layout::TIME);
        let one = self.graph.constant(1.0);
        let times = derivatives_among(&mut self.graph, &below, values, &Seeds::from_iter([(time_input, one)]));
        let gamma = self.graph.constant(f64::NAN);
        let mut rows = Vec::with_capacity(values.len());
        for ((value, time), mut jacobian) in values.iter().zip(times).zip(jacobian) {
            jacobian.sort_unstable_by_key(|(column, _)| *column);
            jacobian.shrink_to_fit();
            rows.push(Row { value: *value, time, gamma, jacobian, of_velocities: false });
        }
        (rows, below)
    }

    /// What functions depend on. All directions start at the coordinates of the bodies.
    fn below(&self, values: &[Node], bodies: &[usize]) -> Below {
        let mut coordinates: Vec<Node> = Vec::new();
        for body in bodies {
            let nodes = &self.bodies[*body];
            coordinates.extend(nodes.r);
            match self.form {
                Form::Working => coordinates.extend(entries(&nodes.a)),
                Form::Reference => coordinates.extend(nodes.p),
            }
        }
        coordinates.sort_unstable();
        Below::new(&self.graph, values, |node| coordinates.binary_search(&node).is_ok())
    }

    /// [`Row::gamma`] of recorded functions of the coordinates of bodies.
    fn traced_gammas(&mut self, values: &[Node], bodies: &[usize], below: &Below) -> Vec<Node> {
        let seeds = self.motion_seeds_among(bodies, |node| below.contains(node));
        let first = derivatives_among(&mut self.graph, below, values, &seeds);
        let second = derivatives(&mut self.graph, &first, &seeds);
        second.into_iter().map(|second| self.graph.neg(second)).collect()
    }

    /// Adds the second derivatives of rows, where they are still due: the accelerations and multipliers of all forms in coordinates of
    /// bodies depend on them.
    pub fn write_gammas(&mut self) {
        if !std::mem::take(&mut self.gammas_are_due) {
            return;
        }
        for number in 0..self.rows.len() {
            let Row { value, gamma, ref jacobian, .. } = self.rows[number];
            if self.graph.value(gamma).is_some_and(f64::is_nan) {
                // What the value does not change with changes nothing of its second derivative either.
                let mut bodies: Vec<usize> = jacobian.iter().map(|(column, _)| column / self.form.columns()).collect();
                bodies.dedup();
                let below = self.below(&[value], &bodies);
                let gamma = self.traced_gammas(&[value], &bodies, &below)[0];
                Arc::make_mut(&mut self.rows)[number].gamma = gamma;
            }
        }
    }

    /// The direction of one coordinate of a body, for what `below` has.
    fn coordinate_seeds(&mut self, body: usize, k: usize, below: &Below) -> Seeds {
        let nodes = &self.bodies[body];
        let g = &mut self.graph;
        let (zero, one) = (g.constant(0.0), g.constant(1.0));
        if k < 3 {
            return Seeds::from_iter([(nodes.r[k], one)]);
        }
        match self.form {
            Form::Working => {
                // A rotation dpi' about the body axis k: dA = A e_k~.
                let axis: V3 = std::array::from_fn(|i| if i == k - 3 { one } else { zero });
                let rate = g.times_skew(&nodes.a, axis);
                let mut seeds: Seeds = entries(&nodes.a).zip(entries(&rate)).collect();
                // Of orientations that are signals.
                if nodes.p.iter().any(|parameter| below.contains(*parameter)) {
                    seeds.extend(nodes.p.into_iter().zip(turned_parameters(g, &nodes.p)[k - 3]));
                }
                seeds
            }
            Form::Reference => Seeds::from_iter([(nodes.p[k - 3], one)]),
        }
    }

    /// The direction of the motion: every derivative with respect to time that is not an acceleration.
    pub(super) fn motion_seeds(&mut self, bodies: &[usize]) -> Seeds {
        self.motion_seeds_among(bodies, |_| true)
    }

    /// The same for what these nodes depend on.
    fn motion_seeds_among(&mut self, bodies: &[usize], contains: impl Fn(Node) -> bool) -> Seeds {
        let mut seeds = Seeds::default();
        let time = self.graph.input(Layout::TIME);
        seeds.insert(time, self.graph.constant(1.0));
        for body in bodies {
            let nodes = &self.bodies[*body];
            seeds.extend(nodes.r.iter().copied().zip(nodes.v));
            match self.form {
                Form::Working => {
                    let g = &mut self.graph;
                    let rate = g.times_skew(&nodes.a, nodes.w);
                    seeds.extend(entries(&nodes.a).zip(entries(&rate)));
                    if nodes.p.iter().any(|parameter| contains(*parameter)) {
                        let about = transposed(&turned_parameters(g, &nodes.p));
                        seeds.extend(nodes.p.into_iter().zip(about.map(|along| g.dot3(along, nodes.w))));
                    }
                }
                Form::Reference => seeds.extend(nodes.p.iter().copied().zip(nodes.p_rate)),
            }
        }
        seeds
    }
}
