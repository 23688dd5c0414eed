//! [`RateSizes`]: what the rates of element states are made of.
//!
//! A state that follows an acceleration, a reaction or a coordinate which is zero but for round-off is round-off itself. How much
//! of a rate is round-off does not show in its value, but in the terms that cancel in it.

use odyn_graph::{Below, Expr, Graph, Node, Rewriting, Seeds, derivatives_among, largest_solution, magnitudes};
use rustc_hash::FxHashMap;

use super::equations::Equations;
use crate::model::Model;
use crate::plan::Layout;

/// A load counts as no less than this share of the terms that cancel in it, where it depends on what is solved for: a millionth of that, which
/// it may be missed by, is thousands of times their round-off.
pub const OF_TERMS: f64 = 1e-6;

/// Nodes in a graph of their own, which takes further inputs behind those of [`Layout`]: see [`RateSizes::inputs`].
pub struct RateSizes {
    /// The operations.
    pub graph: Graph,
    /// Per state the sum of the magnitudes of the terms of its rate; then per state how fast it runs by itself and with others, 1/s.
    /// Both are zero for internal unknowns, which conditions give: then per state what its value is made of by these, zero for others.
    pub nodes: Vec<Node>,
}

impl RateSizes {
    /// Number of inputs: after those of all programs the magnitude of each state, then the sizes of positions, velocities and
    /// angular velocities.
    #[must_use]
    pub fn inputs(layout: &Layout) -> usize {
        layout.inputs() + layout.states + 3
    }

    /// For the rates of all states, in the working form.
    #[must_use]
    pub fn new(equations: &Equations, model: &Model, layout: &Layout) -> Self {
        let mut graph = Graph::default();
        let g = &mut graph;
        let mut rewriting = Rewriting::new(&equations.graph, g, FxHashMap::default());
        let zero = g.constant(0.0);
        let is_solved = |state: usize| equations.graph.unknown_at(layout.state_slot() + state).is_some();
        let rates = equations.state_rates.iter().enumerate();
        let rates: Vec<Node> =
            rates.map(|(state, rate)| if is_solved(state) { zero } else { rewriting.carry(g, *rate) }).collect();
        let mut sizes = sizes_of_motion(g, layout);
        // Directions are known to round-off of 1, whatever they are computed from.
        let directions = equations.bodies.iter().flat_map(|body| body.a.iter().flatten());
        let one = g.constant(1.0);
        for direction in directions {
            let direction = rewriting.carry(g, *direction);
            if g.value(direction).is_none() {
                sizes.insert(direction, one);
            }
        }
        let values = sizes_of_unknowns(g, equations, &mut rewriting, layout, &mut sizes);
        let solved = solved_inputs(g, &rates, layout);
        if !solved.is_empty() {
            sizes.extend(Terms { equations, model, layout, g, rewriting }.sizes_of(&solved));
        }
        let mut nodes = magnitudes(g, &rates, &sizes);
        nodes.extend(paces(g, &rates, layout));
        nodes.extend(values);
        Self { graph, nodes }
    }
}

/// Per body the sum of the magnitudes of the forces on it, N, and behind these of the torques, N m, those of joints included, in a
/// graph that takes the inputs of [`Layout`].
#[must_use]
pub fn sizes_of_forces(equations: &Equations, model: &Model, layout: &Layout) -> (Graph, Vec<Node>) {
    let mut graph = Graph::default();
    let rewriting = Rewriting::new(&equations.graph, &mut graph, FxHashMap::default());
    let bodies: Vec<usize> = (0..layout.bodies).collect();
    let loads = Terms { equations, model, layout, g: &mut graph, rewriting }.loads(&bodies);
    let of = |kind: usize| bodies.iter().map(move |body| 2 * body + kind);
    let nodes = of(0).chain(of(1)).map(|load| loads[&load]).collect();
    (graph, nodes)
}

/// Per entry of the loads, six per body, the sum of the magnitudes of the terms that it is made of, N or N m, in a graph that takes the
/// inputs of [`Layout`].
#[must_use]
pub fn sizes_of_terms(equations: &Equations) -> (Graph, Vec<Node>) {
    let mut graph = Graph::default();
    let loads =
        Rewriting::new(&equations.graph, &mut graph, FxHashMap::default()).carry_all(&mut graph, &equations.loads);
    let sizes = magnitudes(&mut graph, &loads, &FxHashMap::default());
    (graph, sizes)
}

/// Three nodes per row that a function of time drives, in a graph that takes the inputs of [`Layout`]: the sum of the magnitudes of the
/// terms of its derivative with respect to time, how much of the row is displacement of its bodies, and how much is their rotation.
#[must_use]
pub fn sizes_of_drives(equations: &Equations) -> (Graph, Vec<Node>) {
    let mut graph = Graph::default();
    let g = &mut graph;
    let mut rewriting = Rewriting::new(&equations.graph, g, FxHashMap::default());
    let mut nodes = Vec::new();
    for row in equations.rows.iter().filter(|row| !equations.graph.is_zero(row.time)) {
        let rate = rewriting.carry(g, row.time);
        nodes.extend(magnitudes(g, &[rate], &FxHashMap::default()));
        for kind in [0, 1] {
            let part = row.jacobian.iter().filter(|(column, _)| column / 3 % 2 == kind);
            let part: Vec<Node> = part.map(|(_, entry)| rewriting.carry(g, *entry)).collect();
            nodes.push(norm(g, &part));
        }
    }
    (graph, nodes)
}

/// The accelerations and multipliers that nodes depend on, by slots, ascending.
fn solved_inputs(g: &Graph, nodes: &[Node], layout: &Layout) -> Vec<usize> {
    let solved = layout.acceleration_slot()..layout.inputs();
    let slot = |node: &Node| match g.expr(*node) {
        Expr::Input(slot) if solved.contains(&(slot as usize)) => Some(slot as usize),
        _ => None,
    };
    let mut slots: Vec<usize> = g.live(nodes).iter().filter_map(slot).collect();
    slots.sort_unstable();
    slots
}

/// Motion and states count with what they are given.
fn sizes_of_motion(g: &mut Graph, layout: &Layout) -> FxHashMap<Node, Node> {
    let mut sizes = FxHashMap::default();
    let given = layout.inputs();
    let [length, speed, spin] = [0, 1, 2].map(|k| g.input(given + layout.states + k));
    let one = g.constant(1.0);
    for body in 0..layout.bodies {
        let kinds = [(0..3, length), (3..7, one), (7..10, speed), (10..13, spin), (13..17, spin)];
        for (k, size) in kinds.into_iter().flat_map(|(range, size)| range.map(move |k| (k, size))) {
            sizes.insert(g.input(layout.body_slot(body, k)), size);
        }
    }
    for k in 0..layout.states {
        sizes.insert(g.input(layout.state_slot() + k), g.input(given + k));
    }
    sizes
}

/// Internal unknowns are as large as the terms of their conditions make them; entered among `sizes`, and given per state.
fn sizes_of_unknowns(
    g: &mut Graph,
    equations: &Equations,
    rewriting: &mut Rewriting<'_>,
    layout: &Layout,
    sizes: &mut FxHashMap<Node, Node>,
) -> Vec<Node> {
    let mut values = vec![g.constant(0.0); layout.states];
    for solved in &equations.graph.solved {
        let at_carried = rewriting.carry_all(g, &solved.at_carried);
        let (conditions, matrix) = at_carried.split_at(solved.unknowns.len());
        let terms = magnitudes(g, conditions, sizes);
        let found = largest_solution(g, matrix, &terms);
        for (k, (unknown, size)) in solved.unknowns.iter().zip(found).enumerate() {
            sizes.insert(rewriting.carry(g, *unknown), size);
            values[solved.slot - layout.state_slot() + k] = size;
        }
    }
    values
}

fn norm(g: &mut Graph, nodes: &[Node]) -> Node {
    let mut sum = g.constant(0.0);
    for node in nodes {
        let square = g.mul(*node, *node);
        sum = g.add(sum, square);
    }
    g.sqrt(sum)
}

/// What accelerations and multipliers are made of, by the equations of motion `M a = Q - Phi_q^T lambda` and `Phi_q a = gamma`:
/// those of a body at rest are round-off of the loads on it, those of a joint that bears nothing of what moves its bodies.
/// Loads count in all directions alike.
struct Terms<'a> {
    equations: &'a Equations,
    model: &'a Model,
    layout: &'a Layout,
    g: &'a mut Graph,
    rewriting: Rewriting<'a>,
}

impl Terms<'_> {
    /// The sizes of the inputs at some slots.
    fn sizes_of(mut self, slots: &[usize]) -> Vec<(Node, Node)> {
        let (first, rows) = (self.layout.acceleration_slot(), self.layout.multiplier_slot());
        let mut bodies: Vec<usize> = Vec::new();
        for slot in slots {
            match slot.checked_sub(rows) {
                Some(row) => bodies.extend(self.equations.rows[row].jacobian.iter().map(|(column, _)| column / 6)),
                None => bodies.push((slot - first) / 6),
            }
        }
        bodies.sort_unstable();
        bodies.dedup();
        let accelerations = self.accelerations(&bodies);
        let mut found = Vec::with_capacity(slots.len());
        for slot in slots {
            let size = match slot.checked_sub(rows) {
                Some(row) => self.multiplier(row, &accelerations),
                None => accelerations[&(slot - first)],
            };
            found.push((self.g.input(*slot), size));
        }
        found
    }

    /// Forces and torques on some bodies, by twice the number of a body, and the one behind that.
    fn loads(&mut self, bodies: &[usize]) -> FxHashMap<usize, Node> {
        let mut loads: FxHashMap<usize, Node> = FxHashMap::default();
        for body in bodies {
            let own = self.rewriting.carry_all(self.g, &self.equations.loads[6 * body..6 * body + 6]);
            let weight = self.g.constant(self.model.bodies[*body].mass * self.model.gravity.norm());
            let (force, torque) = (norm(self.g, &own[..3]), norm(self.g, &own[3..]));
            loads.insert(2 * body, self.g.add(force, weight));
            loads.insert(2 * body + 1, torque);
        }
        for (index, row) in self.equations.rows.iter().enumerate() {
            for part in row.jacobian.chunk_by(|(a, _), (b, _)| a / 3 == b / 3) {
                let Some(sum) = loads.get_mut(&(part[0].0 / 3)) else { continue };
                let entries: Vec<Node> = part.iter().map(|(_, entry)| self.rewriting.carry(self.g, *entry)).collect();
                let (length, multiplier) = (norm(self.g, &entries), self.of_joint(index));
                let load = self.g.mul(length, multiplier);
                *sum = self.g.add(*sum, load);
            }
        }
        loads
    }

    /// Of some bodies, by column.
    fn accelerations(&mut self, bodies: &[usize]) -> FxHashMap<usize, Node> {
        let loads = self.loads(bodies);
        let columns = bodies.iter().flat_map(|body| 6 * body..6 * body + 6);
        let of_column = |column: usize| {
            let ease: f64 = self.mobility(column).iter().sum();
            let ease = self.g.constant(ease);
            (column, self.g.mul(ease, loads[&(column / 3)]))
        };
        columns.map(of_column).collect()
    }

    /// Magnitudes of the inverse of a body's mass or inertia, in the row of a column.
    fn mobility(&self, column: usize) -> [f64; 3] {
        let body = &self.model.bodies[column / 6];
        let own = column % 3;
        if column % 6 < 3 {
            return std::array::from_fn(|k| if k == own { 1.0 / body.mass } else { 0.0 });
        }
        let turning = body.inertia.try_inverse().unwrap_or_default();
        std::array::from_fn(|k| turning[(own, k)].abs())
    }

    /// Size of the multipliers of the joint that a row belongs to.
    fn of_joint(&mut self, row: usize) -> Node {
        let slots = self.layout.solved_peers(self.layout.multiplier_slot() + row);
        let multipliers: Vec<Node> = slots.map(|slot| self.g.input(slot)).collect();
        norm(self.g, &multipliers)
    }

    /// That of its joint; and what moves its bodies along it, against how easily these are moved.
    fn multiplier(&mut self, row: usize, accelerations: &FxHashMap<usize, Node>) -> Node {
        let own = self.of_joint(row);
        let row = &self.equations.rows[row];
        let gamma = self.rewriting.carry(self.g, row.gamma);
        let (mut moved, mut eased) = (self.g.abs(gamma), self.g.constant(f64::MIN_POSITIVE));
        for (column, entry) in &row.jacobian {
            let entry = self.rewriting.carry(self.g, *entry);
            let size = self.g.abs(entry);
            let part = self.g.mul(size, accelerations[column]);
            moved = self.g.add(moved, part);
            let mobility = self.mobility(*column)[column % 3];
            let (mobility, square) = (self.g.constant(mobility), self.g.mul(entry, entry));
            let part = self.g.mul(mobility, square);
            eased = self.g.add(eased, part);
        }
        let more = self.g.div(moved, eased);
        self.g.add(own, more)
    }
}

/// How fast states change by themselves, and against others that act back on them: the derivative of a rate by its own state,
/// and the roots of the products of those by each other's.
fn paces(g: &mut Graph, rates: &[Node], layout: &Layout) -> Vec<Node> {
    let one = g.constant(1.0);
    let states: Vec<Node> = (0..rates.len()).map(|k| g.input(layout.state_slot() + k)).collect();
    let mut slopes: Vec<FxHashMap<usize, Node>> = Vec::with_capacity(rates.len());
    for rate in rates {
        let below = Below::new(g, &[*rate], |_| false);
        let used = (0..states.len()).filter(|k| below.contains(states[*k]));
        let slope = |k| (k, derivatives_among(g, &below, &[*rate], &Seeds::from_iter([(states[k], one)]))[0]);
        slopes.push(used.map(slope).collect());
    }
    let mut paces = Vec::with_capacity(rates.len());
    for (k, by_state) in slopes.iter().enumerate() {
        let mut pace = g.constant(0.0);
        let mut list: Vec<(usize, Node)> = by_state.iter().map(|(j, slope)| (*j, *slope)).collect();
        list.sort_unstable();
        for (j, by_other) in list {
            let Some(back) = slopes[j].get(&k) else { continue };
            let product = g.mul(by_other, *back);
            let product = g.abs(product);
            let root = if j == k { g.abs(by_other) } else { g.sqrt(product) };
            pace = g.add(pace, root);
        }
        paces.push(pace);
    }
    paces
}
