//! [`Contact`]: rows that only push, and which rows are enforced.

use std::sync::OnceLock;

use element_api::recording::Role;
use odyn_graph::{Expr, Node, Rewriting};
use rustc_hash::FxHashSet;

use super::equations::Equations;
use crate::model::Instance;
use crate::plan::Layout;

/// A row that only pushes: its value, of a row on velocities its rate, is never negative.
#[derive(Debug, Clone, PartialEq)]
pub struct Contact {
    /// Its number among all rows.
    pub row: usize,
    /// Coefficient of restitution.
    pub restitution: f64,
    /// Whether it is a row on velocities.
    pub of_velocities: bool,
    /// Rows that hold while it is closed, whatever it takes.
    pub sticking: Vec<usize>,
}

impl Contact {
    /// The row, then those that hold while it is closed.
    pub fn rows(&self) -> impl Iterator<Item = usize> + '_ {
        std::iter::once(self.row).chain(self.sticking.iter().copied())
    }
}

impl Equations {
    /// The rows that are enforced, ascending: all but those of open contacts, and of joints that were released.
    pub fn enforced(&self) -> impl Iterator<Item = usize> + Clone + '_ {
        (0..self.rows.len()).filter(|row| self.is_enforced(*row))
    }

    /// Whether a row is.
    #[must_use]
    pub fn is_enforced(&self, row: usize) -> bool {
        self.open.binary_search(&row).is_err()
    }

    /// The value of a contact; of a row on velocities its rate.
    pub fn stop_of(&mut self, contact: &Contact, layout: &Layout) -> Node {
        let row = self.rows[contact.row].clone();
        if !row.of_velocities {
            return row.value;
        }
        let g = &mut self.graph;
        let mut rate = row.time;
        for (column, slope) in row.jacobian {
            let velocity = g.input(layout.body_slot(column / 6, 7 + column % 6));
            let part = g.mul(slope, velocity);
            rate = g.add(rate, part);
        }
        rate
    }

    /// The same equations with these contacts closed, by their number, and the others open. Numbers behind those of contacts are of
    /// frictions that stick.
    #[must_use]
    pub fn with_closed(&self, closed: &[usize]) -> Self {
        let mut equations = self.clone();
        equations.of_rows = OnceLock::new();
        equations.set_open(closed);
        equations
    }

    /// The same, with nothing left in loads, rates of states and power of what is zero with this choice: multipliers of rows that are
    /// not enforced, and directions into which nothing slides. As long as it lasts they are what they were.
    #[must_use]
    pub fn in_mode(&self, closed: &[usize], layout: &Layout) -> Self {
        let mut equations = self.with_closed(closed);
        equations.of_mode = true;
        if !self.loads_switch() {
            return equations;
        }
        let off: FxHashSet<usize> = equations.nothing(layout).collect();
        let nodes = || self.loads.iter().chain(&self.state_rates).chain([&self.power]).copied();
        let live = self.graph.live(&nodes().collect::<Vec<_>>());
        let is_off =
            |node: &Node| matches!(self.graph.expr(*node), Expr::Input(slot) if off.contains(&(slot as usize)));
        let off: Vec<Node> = live.into_iter().filter(is_off).collect();
        if off.is_empty() || !self.graph.calls.is_empty() {
            return equations;
        }
        let mut g = std::mem::take(&mut equations.graph);
        let zero = g.constant(0.0);
        let mut rewriting = Rewriting::new(&self.graph, &mut g, off.into_iter().map(|node| (node, zero)).collect());
        let others = equations.state_rates.iter_mut().chain([&mut equations.power]);
        equations.loads.iter_mut().chain(others).for_each(|node| *node = rewriting.carry(&mut g, *node));
        equations.graph = g;
        equations.coupling.clear();
        equations.find_coupling(layout);
        equations
    }

    /// The reaction of each contact, then of each friction what it may hold, or which share of the reaction of its contact, and what it
    /// holds along each of its rows: N or N m. Nothing of what is not closed here.
    pub fn pressing(&mut self, layout: &Layout) -> Vec<Node> {
        let zero = self.graph.constant(0.0);
        let holds = |equations: &mut Self, row: Option<&usize>| match row {
            Some(row) if equations.is_enforced(*row) => equations.graph.input(layout.multiplier_slot() + row),
            _ => zero,
        };
        let contacts: Vec<usize> = self.contacts.iter().map(|contact| contact.row).collect();
        let mut nodes = Vec::with_capacity(contacts.len() + 3 * self.frictions.len());
        for row in contacts {
            let multiplier = holds(self, Some(&row));
            nodes.push(self.graph.neg(multiplier));
        }
        for friction in self.frictions.clone() {
            let held = [0, 1].map(|k| holds(self, friction.rows.get(k)));
            nodes.extend([friction.limit, held[0], held[1]]);
        }
        nodes
    }

    /// Whether loads, rates of states or the power may contain what is zero with some choice of closed contacts.
    #[must_use]
    pub fn loads_switch(&self) -> bool {
        self.switches_rows() && (!self.frictions.is_empty() || self.may_need_solution)
    }

    /// Inputs that are zero with this choice of closed contacts.
    fn nothing(&self, layout: &Layout) -> impl Iterator<Item = usize> + '_ {
        let (multipliers, directions) = (layout.multiplier_slot(), layout.discrete_slot());
        let still = self.frictions.iter().filter(|friction| {
            let is_open = |number: usize| !self.is_enforced(self.contacts[number].row);
            let first = friction.rows[0];
            self.is_enforced(first) || self.is_gone(first) || friction.contact.is_some_and(is_open)
        });
        let directions = still.flat_map(move |friction| {
            let first = directions + friction.direction_at;
            let creeps = usize::from(friction.rows.len() > 1);
            first..first + friction.rows.len() + creeps
        });
        self.open.iter().map(move |row| multipliers + row).chain(directions)
    }

    pub(super) fn set_open(&mut self, closed: &[usize]) {
        let contacts = self.contacts.iter().map(|contact| contact.rows().collect());
        let all = contacts.chain(self.frictions.iter().map(|friction| friction.rows.clone()));
        let open = all.enumerate().filter(|(number, _)| !closed.contains(number));
        self.open = open.flat_map(|(_, rows): (usize, Vec<usize>)| rows).collect();
        self.open.extend(self.releases.iter().filter(|one| one.gone).flat_map(|one| one.rows.clone()));
        self.open.sort_unstable();
        self.open.dedup();
    }

    /// The unilateral rows of a joint whose rows begin at `first`.
    pub(super) fn add_contacts(&mut self, element: &Instance, first: usize) {
        let recording = &element.recording;
        for (k, number) in element.rows.iter().enumerate() {
            let Some(restitution) = recording.restitution(*number as u32) else { continue };
            let limited = |row: usize| {
                let pair = |other: &&usize| recording.slides_with(**other as u32) == Some(row as u32);
                recording.output(Role::Limit(row as u32)).is_some() || element.rows.iter().any(|other| pair(&other))
            };
            let sticks =
                |other: &usize| recording.sticks_with(*other as u32) == Some(*number as u32) && !limited(*other);
            let others = element.rows.iter().enumerate().filter(|(_, other)| sticks(other));
            let sticking = others.map(|(k, _)| first + k).collect();
            let of_velocities = recording.output(Role::VelocityResidual(*number as u32)).is_some();
            self.contacts.push(Contact { row: first + k, restitution, of_velocities, sticking });
        }
    }
}
