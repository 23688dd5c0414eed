//! Accelerations of bodies and reactions of joints from the motion of the joints: inverse dynamics along the tree.
//!
//! With the accelerations u' of the joints, and the multipliers of the rows that close loops, each body's own equations
//! `M a + Phi_q^T lambda = Q` leave the multipliers of the joint that it hangs on: from the tips inwards, one joint after the
//! other (Featherstone, "Rigid Body Dynamics Algorithms", 2008, ch. 5). What no multiplier takes up shows how well they hold.

use std::ops::Range;

use crate::linalg::connected_blocks;
use odyn_graph::{Elimination, Expr, Graph, Node, Rewriting, Seeds, derivatives, magnitudes};
use rustc_hash::{FxHashMap, FxHashSet};

use super::carry::{carried_bodies, is_open};
use super::equations::Equations;
use super::joint::JointEquations;
use super::kinematics::entries;
use super::rate_sizes::OF_TERMS;
use crate::plan::{Layout, SpanningTree};

/// Quantities with accelerations and multipliers as functions of the inputs of [`JointEquations`]: of the coordinates, of u' at
/// [`crate::plan::Coordinates::acceleration_slot`] and of the multipliers of rows that close loops.
pub struct Reactions {
    /// All operations.
    pub graph: Graph,
    /// The quantities.
    pub nodes: Vec<Node>,
    /// What is left of the equations of motion, six per body.
    pub left: Vec<Node>,
    /// Sums of the squares of the terms that they are made of.
    pub squares: Vec<Node>,
    /// For each row of the joints: what is left of it across those before it, and the sum of the magnitudes that this is made of.
    pub pivots: Vec<[Node; 2]>,
}

/// The working form of a scene.
pub struct Working<'a> {
    /// Its equations.
    pub equations: &'a Equations,
    /// Where its inputs lie.
    pub layout: &'a Layout,
    /// Lower triangle of its mass matrix.
    pub mass: &'a [(usize, usize, f64)],
}

/// Bodies as a joint's rows see them.
struct Balance {
    left: Vec<Node>,
    squares: Vec<Node>,
}

impl Balance {
    /// Takes a term off a body's equation.
    fn take(&mut self, g: &mut Graph, column: usize, term: Node) {
        self.left[column] = g.sub(self.left[column], term);
        let square = g.mul(term, term);
        self.squares[column] = g.add(self.squares[column], square);
    }

    /// Counts what cancels in a load, the sum of the magnitudes of its terms, as far as its round-off needs it.
    fn count(&mut self, g: &mut Graph, column: usize, terms: Node) {
        let share = g.constant(OF_TERMS);
        let size = g.mul(share, terms);
        let square = g.mul(size, size);
        self.squares[column] = g.add(self.squares[column], square);
    }
}

impl JointEquations {
    /// Nodes of the working form that may depend on accelerations and multipliers; `None` where they depend on more than these
    /// and what [`JointEquations::carry`] takes, or where a joint of the tree has rows that its coordinates do not make up for.
    /// `length` makes torques comparable with forces. Accelerations and multipliers that are inputs at `slots` of the working form
    /// follow the nodes.
    #[must_use]
    pub fn reactions(
        &self,
        working: &Working<'_>,
        tree: &SpanningTree,
        length: f64,
        nodes: &[Node],
        slots: &[usize],
    ) -> Option<Reactions> {
        let Working { equations, layout, mass } = working;
        if !tree.followers.is_empty() {
            // The rows that followers make up for have reactions, too.
            return None;
        }
        let mut g = self.room_for_bodies();
        let mut own = Rewriting::new(&self.graph, &mut g, FxHashMap::default());
        let replaced = carried_bodies(&mut g, &mut own, equations, self);
        let concerned = concerned(working, tree, nodes, slots);
        let accelerations = self.accelerations(&mut g, &mut own, &concerned);
        let zero = g.constant(0.0);
        let mut balance = Balance { left: vec![zero; layout.velocities()], squares: vec![zero; layout.velocities()] };
        let mut rewriting = Rewriting::new(&equations.graph, &mut g, replaced);
        if self.has_inertia {
            // Accelerations that loads depend on were not solved for by themselves.
            let known = |slot: usize| accelerations.get(slot.checked_sub(layout.acceleration_slot())?).copied();
            replace_inputs(&mut rewriting, equations, &equations.loads, known);
        }
        for (column, load) in equations.loads.iter().enumerate().filter(|(column, _)| concerned[column / 6]) {
            let load = rewriting.carry(&mut g, *load);
            let minus = g.neg(load);
            balance.take(&mut g, column, minus);
        }
        if self.has_inertia {
            let loads = rewriting.carry_all(&mut g, &equations.loads);
            let made_of = magnitudes(&mut g, &loads, &FxHashMap::default());
            made_of.into_iter().enumerate().for_each(|(column, terms)| balance.count(&mut g, column, terms));
        }
        for (row, column, value) in mass.iter().filter(|(row, ..)| concerned[row / 6]) {
            let value = g.constant(*value);
            for (at, other) in
                if row == column { vec![(*row, *column)] } else { vec![(*row, *column), (*column, *row)] }
            {
                let term = g.mul(value, accelerations[other]);
                balance.take(&mut g, at, term);
            }
        }
        let mut multipliers = vec![zero; layout.rows];
        let mut pivots = Vec::new();
        let elements = layout.row_at.len();
        let used = tree.used(elements);
        let closing = (0..elements).filter(|element| !used[*element]).map(|element| layout.rows_of(element));
        let closing: Vec<Range<usize>> = closing.filter(|rows| !rows.is_empty()).collect();
        let acts = |row: &usize| {
            let holds = !equations.of_mode || equations.is_enforced(*row);
            holds && bodies_of(equations, *row).all(|body| concerned[body])
        };
        for row in closing.iter().flat_map(Clone::clone).filter(acts) {
            multipliers[row] = g.input(layout.multiplier_slot() + row);
            for (column, slope) in &self.row_slopes[row] {
                let slope = own.carry(&mut g, *slope);
                let term = g.mul(slope, multipliers[row]);
                balance.take(&mut g, *column, term);
            }
        }
        for joint in tree.joints.iter().rev() {
            let Some(element) = joint.element.filter(|_| concerned[joint.child]) else { continue };
            let rows = layout.rows_of(element);
            if rows.len() + joint.coordinates + 3 * usize::from(joint.rotates) != 6 {
                return None;
            }
            let child = 6 * joint.child..6 * joint.child + 6;
            let parent = joint.parent.map_or(0..0, |parent| 6 * parent..6 * parent + 6);
            let wrench: Vec<Node> = balance.left[child.clone()].to_vec();
            let (found, jacobian) =
                solve_rows(&mut g, &mut rewriting, equations, rows.clone(), &child, (&wrench, length), &mut pivots);
            for (row, (multiplier, entries)) in rows.zip(found.into_iter().zip(jacobian)) {
                multipliers[row] = multiplier;
                for (column, slope) in entries {
                    if !child.contains(&column) && !parent.contains(&column) {
                        return None;
                    }
                    let term = g.mul(slope, multiplier);
                    balance.take(&mut g, column, term);
                }
            }
        }
        if self.turned {
            // These rows are solved for in ground axes: their reactions, in the axes that they are written in.
            for rows in closing {
                let body = self.row_slopes[rows.start].first()?.0 / 6;
                let columns = 6 * body..6 * body + 6;
                let mut wrench = vec![zero; 6];
                for row in rows.clone() {
                    for (column, slope) in self.row_slopes[row].iter().filter(|(column, _)| columns.contains(column)) {
                        let slope = own.carry(&mut g, *slope);
                        let term = g.mul(slope, multipliers[row]);
                        wrench[column - columns.start] = g.add(wrench[column - columns.start], term);
                    }
                }
                let (found, _) = solve_rows(
                    &mut g,
                    &mut rewriting,
                    equations,
                    rows.clone(),
                    &columns,
                    (&wrench, length),
                    &mut pivots,
                );
                rows.zip(found).for_each(|(row, multiplier)| multipliers[row] = multiplier);
            }
        }
        let solved = |slot: usize| {
            let acceleration = slot.checked_sub(layout.acceleration_slot()).and_then(|k| accelerations.get(k));
            acceleration.or_else(|| multipliers.get(slot.checked_sub(layout.multiplier_slot())?)).copied()
        };
        replace_inputs(&mut rewriting, equations, nodes, solved);
        let mut nodes = rewriting.carry_all(&mut g, nodes);
        nodes.extend(slots.iter().filter_map(|slot| solved(*slot)));
        let reactions = Reactions { nodes, left: balance.left, squares: balance.squares, pivots, graph: g };
        let mut all = reactions.nodes.clone();
        all.extend(reactions.left.iter().chain(&reactions.squares).chain(reactions.pivots.iter().flatten()));
        let of_bodies = 1..layout.state_slot();
        let of_accelerations = layout.acceleration_slot()..layout.multiplier_slot();
        // What loads depend on is given.
        let given = |slot: usize| !self.has_inertia && equations.coupling.iter().any(|input| input.slot == slot);
        let foreign = |slot: usize| of_bodies.contains(&slot) || of_accelerations.contains(&slot) && !given(slot);
        (!is_open(&reactions.graph, &all, foreign)).then_some(reactions)
    }

    /// [v'; omega''] of all bodies that are concerned; zero of the others.
    fn accelerations(&self, g: &mut Graph, own: &mut Rewriting<'_>, concerned: &[bool]) -> Vec<Node> {
        let coordinates = &self.coordinates;
        let slot = |at: usize| coordinates.slot_of(at);
        let solved = |column: usize| coordinates.acceleration_slot + column;
        let mut seeds = Seeds::default();
        for line in &coordinates.lines {
            let velocity = g.input(slot(line.velocity));
            seeds.insert(g.input(slot(line.position)), velocity);
            let acceleration = g.input(solved(line.column));
            seeds.insert(velocity, acceleration);
        }
        for (rotation, matrix) in coordinates.rotations.iter().zip(&self.rotations) {
            let spin = std::array::from_fn(|k| g.input(slot(rotation.velocity + k)));
            let matrix = matrix.map(|row| row.map(|node| own.carry(g, node)));
            let rate = g.times_skew(&matrix, spin);
            seeds.extend(entries(&matrix).zip(entries(&rate)));
            for (k, spin) in spin.into_iter().enumerate() {
                let acceleration = g.input(solved(rotation.column + k));
                seeds.insert(spin, acceleration);
            }
        }
        let zero = g.constant(0.0);
        let mut velocities = Vec::with_capacity(6 * concerned.len());
        for (body, concerned) in self.bodies.iter().zip(concerned) {
            if !concerned {
                velocities.extend([zero; 6]);
                continue;
            }
            velocities.extend(body.v.into_iter().chain(body.w).map(|node| own.carry(g, node)));
        }
        derivatives(g, &velocities, &seeds)
    }
}

/// Puts what is known in place of the inputs that nodes depend on.
fn replace_inputs(
    rewriting: &mut Rewriting<'_>,
    equations: &Equations,
    nodes: &[Node],
    known: impl Fn(usize) -> Option<Node>,
) {
    for node in equations.graph.live(nodes) {
        if let Expr::Input(slot) = equations.graph.expr(node)
            && let Some(new) = known(slot as usize)
        {
            rewriting.replace(node, new);
        }
    }
}

/// The bodies that a row acts on.
fn bodies_of(equations: &Equations, row: usize) -> impl Iterator<Item = usize> + '_ {
    equations.rows[row].jacobian.iter().map(|(column, _)| column / 6)
}

/// The bodies whose equations share unknowns with what is asked for. Where rows come and go they are all; in a mode, nothing that is open
/// joins what does not share bodies otherwise.
fn concerned(working: &Working<'_>, tree: &SpanningTree, nodes: &[Node], slots: &[usize]) -> Vec<bool> {
    let Working { equations, layout, mass } = working;
    if !equations.of_mode || !equations.coupling.is_empty() || !slots.is_empty() {
        return vec![true; layout.bodies];
    }
    let tree = tree.joints.iter().filter_map(|joint| Some((joint.parent?, joint.child)));
    let masses = mass.iter().map(|(row, column, _)| (row / 6, column / 6));
    let rows = equations.enforced().flat_map(|row| {
        let first = bodies_of(equations, row).next();
        bodies_of(equations, row).filter_map(move |body| Some((first?, body)))
    });
    let asked: FxHashSet<usize> = asked_of(equations, layout, nodes).collect();
    let mut concerned = vec![false; layout.bodies];
    for part in connected_blocks(layout.bodies, tree.chain(masses).chain(rows)) {
        if part.iter().any(|body| asked.contains(body)) {
            part.into_iter().for_each(|body| concerned[body] = true);
        }
    }
    concerned
}

/// The bodies whose accelerations, or multipliers of whose rows, nodes depend on.
fn asked_of<'a>(equations: &'a Equations, layout: &Layout, nodes: &[Node]) -> impl Iterator<Item = usize> + 'a {
    let (accelerations, multipliers) = (layout.acceleration_slot(), layout.multiplier_slot());
    let (velocities, rows) = (layout.velocities(), layout.rows);
    equations.graph.live(nodes).into_iter().flat_map(move |node| {
        let Expr::Input(slot) = equations.graph.expr(node) else { return Vec::new() };
        let place = |first: usize, count: usize| (slot as usize).checked_sub(first).filter(|k| *k < count);
        let body = place(accelerations, velocities).map(|column| column / 6);
        let of_row = place(multipliers, rows).map(|row| bodies_of(equations, row));
        body.into_iter().chain(of_row.into_iter().flatten()).collect::<Vec<_>>()
    })
}

/// The multipliers of an element's rows that make up a force and torque on a body, with the rows' Jacobian.
fn solve_rows(
    g: &mut Graph,
    rewriting: &mut Rewriting<'_>,
    equations: &Equations,
    rows: Range<usize>,
    columns: &Range<usize>,
    (wrench, length): (&[Node], f64),
    pivots: &mut Vec<[Node; 2]>,
) -> (Vec<Node>, Vec<Vec<(usize, Node)>>) {
    let jacobian: Vec<Vec<(usize, Node)>> = equations.rows[rows]
        .iter()
        .map(|row| row.jacobian.iter().map(|(column, slope)| (*column, rewriting.carry(g, *slope))).collect())
        .collect();
    let of_body: Vec<Vec<(usize, Node)>> = jacobian
        .iter()
        .map(|row| row.iter().filter(|(c, _)| columns.contains(c)).map(|(c, s)| (c - columns.start, *s)).collect())
        .collect();
    let mass: Vec<(usize, usize, Node)> =
        (0..6).map(|k| (k, k, g.constant(if k < 3 { 1.0 } else { length * length }))).collect();
    let elimination = Elimination::new(g, 6, &mass, &of_body);
    pivots.extend(elimination.row_pivots.iter().zip(&elimination.row_magnitudes).map(|(pivot, sum)| [*pivot, *sum]));
    let still = vec![g.constant(0.0); of_body.len()];
    let (_, found) = elimination.solve(g, wrench, &still);
    (found, jacobian)
}
