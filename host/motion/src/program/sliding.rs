//! [`Friction`]: rows on velocities that hold up to a limit, and what they do while they slide.
//!
//! With the limit b, the velocity v of the row, and the direction d into which it slides, which is kept between steps, the row's
//! multiplier while it slides is b e, and the loads are -Phi_q^T b e: e = d of a single row. Of two rows in a plane e is along v,
//!
//! e = (d + r d') / sqrt(1 + r^2),   r = (d' . v) (d . v) / ((d . v)^2 + s^2),   d' across d
//!
//! the same for v and -v, so that the equations are smooth where the sliding comes to its end: steps end there. After every step
//! d is what e was. Where d is zero, nothing slides. s is a speed as small as the errors of velocities, kept behind d.
//!
//! Where s is below zero and d is zero, two rows creep: e = v / sqrt(v^2 + s^2), which is what slides but for speeds below s, where friction
//! is viscous. Nothing happens to such rows: they neither come to rest nor begin to slide.

use element_api::recording::Role;
use odyn_graph::Node;

use super::equations::Equations;
use crate::model::{Instance, Model};
use crate::plan::Layout;

/// Keeps the direction zero where nothing slides.
const NOTHING: f64 = 1e-300;

/// A row on velocities, or two, that hold up to a limit.
#[derive(Debug, Clone, PartialEq)]
pub struct Friction {
    /// Their numbers among all rows.
    pub rows: Vec<usize>,
    /// The limit: N or N m, or the share of the reaction of a contact.
    pub limit: Node,
    /// The number of that contact.
    pub contact: Option<usize>,
    /// Where the direction of each row is among the discrete states; behind those of two rows, the speed below which it is none, with
    /// a minus where they creep.
    pub direction_at: usize,
    /// Rates of the rows.
    pub rates: Vec<Node>,
    /// What they have as multipliers while they slide.
    multipliers: Vec<Node>,
}

impl Equations {
    /// Whether rows come and go during the motion: those of contacts, those that hold up to a limit, and those of joints that may be
    /// released.
    #[must_use]
    pub fn switches_rows(&self) -> bool {
        !self.contacts.is_empty() || !self.frictions.is_empty() || !self.releases.is_empty()
    }

    /// The first row of each contact, then of each friction.
    pub fn switching_rows(&self) -> impl Iterator<Item = usize> + '_ {
        let contacts = self.contacts.iter().map(|contact| contact.row);
        contacts.chain(self.frictions.iter().map(|friction| friction.rows[0]))
    }

    /// A row whose limit depends on accelerations or multipliers, which follow from it.
    #[must_use]
    pub fn solved_limit(&self, layout: &Layout) -> Option<usize> {
        let found = self.frictions.iter().find(|friction| !self.solved_inputs(&[friction.limit], layout).is_empty());
        found.map(|friction| friction.rows[0])
    }

    /// The multiplier of a row: that which is solved for, or that of a row that slides.
    pub(super) fn multiplier(&mut self, row: usize, layout: &Layout) -> Node {
        let solved = self.graph.input(layout.multiplier_slot() + row);
        let friction = self.frictions.iter().find_map(|friction| {
            let k = friction.rows.iter().position(|own| *own == row)?;
            Some(friction.multipliers[k])
        });
        friction.map_or(solved, |sliding| self.graph.add(solved, sliding))
    }

    /// The speed of a friction in its direction.
    pub fn sliding_speed(&mut self, friction: &Friction, layout: &Layout) -> Node {
        let mut sum = self.graph.constant(0.0);
        for (k, rate) in friction.rates.iter().enumerate() {
            let direction = self.graph.input(layout.discrete_slot() + friction.direction_at + k);
            let part = self.graph.mul(direction, *rate);
            sum = self.graph.add(sum, part);
        }
        sum
    }

    /// The limit, N or N m.
    fn limit_of(&mut self, friction: &Friction, layout: &Layout) -> Node {
        let Some(contact) = friction.contact else { return friction.limit };
        let normal = self.graph.input(layout.multiplier_slot() + self.contacts[contact].row);
        let product = self.graph.mul(friction.limit, normal);
        self.graph.neg(product)
    }

    /// What a limit that changes is where it comes below zero, and nothing holds: without this it would drive what slides, in a step
    /// whose ends do not show it.
    fn not_below_zero(&mut self, limit: Node) -> Node {
        let zero = self.graph.constant(0.0);
        self.graph.select(limit, zero, zero, limit)
    }

    /// The rows of a joint that hold up to a limit; its results by role. See [`Instance::limits_follow`].
    pub(super) fn add_frictions(&mut self, index: usize, element: &Instance, values: &[(Role, Node)], layout: &Layout) {
        let (recording, first) = (&element.recording, layout.row_at[index]);
        let place = |number: u32| {
            let k = element.rows.iter().position(|row| *row as u32 == number)?;
            Some(first + k)
        };
        // Where they follow signals, which may be numbers, too.
        let follow = element.inputs.iter().any(|source| source.quantity().is_some());
        let mut direction_at = layout.discrete_at[index] + recording.initial_discrete.len();
        for number in element.rows.iter().map(|number| *number as u32) {
            let Some((_, limit)) = values.iter().find(|(role, _)| *role == Role::Limit(number)) else { continue };
            let fixed = self.graph.value(*limit).is_some() && !follow;
            let pair = recording.slides_with(number).and_then(place);
            let rows: Vec<usize> = place(number).into_iter().chain(pair).collect();
            let unilateral = recording.sticks_with(number).and_then(place);
            let contact = unilateral.and_then(|row| self.contacts.iter().position(|contact| contact.row == row));
            let rates = rows.iter().map(|row| {
                let row = self.rows[*row].clone();
                self.row_rate(&row)
            });
            let rates: Vec<Node> = rates.collect();
            let limit = if fixed { *limit } else { self.not_below_zero(*limit) };
            let count = if rows.len() > 1 { 3 } else { 1 };
            let friction = Friction { rows, limit, contact, direction_at, rates, multipliers: Vec::new() };
            direction_at += count;
            self.slide(friction, layout);
        }
    }

    /// The frictions of joints whose limits follow signals, in their place among the others.
    pub(super) fn add_signalled_frictions(
        &mut self,
        limits: Vec<(usize, Vec<(Role, Node)>)>,
        model: &Model,
        layout: &Layout,
    ) {
        for (index, values) in limits {
            self.add_frictions(index, &model.elements[index], &values, layout);
        }
        self.frictions.sort_by_key(|friction| friction.rows[0]);
        self.set_open(&[]);
    }

    /// Loads and power of a friction while it slides.
    fn slide(&mut self, mut friction: Friction, layout: &Layout) {
        let limit = self.limit_of(&friction, layout);
        let directions = self.directions(&friction, layout);
        let zero = self.graph.constant(0.0);
        let (mut heat, mut driven) = (zero, zero);
        for (k, direction) in directions.into_iter().enumerate() {
            let row = self.rows[friction.rows[k]].clone();
            let g = &mut self.graph;
            let multiplier = g.mul(limit, direction);
            for (column, slope) in &row.jacobian {
                let part = g.mul(*slope, multiplier);
                self.loads[*column] = g.sub(self.loads[*column], part);
            }
            let lost = g.mul(multiplier, friction.rates[k]);
            heat = g.add(heat, lost);
            let given = g.mul(multiplier, row.time);
            driven = g.add(driven, given);
            self.next_discrete[friction.direction_at + k] = direction;
            friction.multipliers.push(multiplier);
        }
        if friction.rows.len() > 1 {
            let still = self.graph.input(layout.discrete_slot() + friction.direction_at + 2);
            for k in 0..2 {
                let next = self.next_discrete[friction.direction_at + k];
                self.next_discrete[friction.direction_at + k] = self.graph.select(still, zero, zero, next);
            }
            self.next_discrete[friction.direction_at + 2] = still;
        }
        self.power = self.graph.sub(self.power, heat);
        self.power = self.graph.add(self.power, driven);
        self.dissipation.push(heat);
        self.note_supplied(driven);
        self.frictions.push(friction);
    }

    /// Into which directions its rows slide.
    fn directions(&mut self, friction: &Friction, layout: &Layout) -> Vec<Node> {
        let first = layout.discrete_slot() + friction.direction_at;
        let g = &mut self.graph;
        let [d, v] = [g.input(first), friction.rates[0]];
        let Some(w) = friction.rates.get(1).copied() else { return vec![d] };
        let e = g.input(first + 1);
        let sum = |g: &mut odyn_graph::Graph, [a, b]: [Node; 2], [c, d]: [Node; 2]| {
            let (x, y) = (g.mul(a, b), g.mul(c, d));
            g.add(x, y)
        };
        let along = sum(g, [d, v], [e, w]);
        let minus = g.neg(e);
        let across = sum(g, [d, w], [minus, v]);
        let still = g.input(first + 2);
        let (zero, nothing) = (g.constant(0.0), g.constant(NOTHING));
        let square = sum(g, [along, along], [still, still]);
        let square = g.add(square, nothing);
        let product = g.mul(across, along);
        let r = g.div(product, square);
        let one = g.constant(1.0);
        let length = sum(g, [d, d], [e, e]);
        let longer = sum(g, [r, r], [one, one]);
        let size = sum(g, [length, longer], [nothing, one]);
        let size = g.sqrt(size);
        let x = sum(g, [d, one], [r, minus]);
        let y = sum(g, [e, one], [r, d]);
        let slides = [g.div(x, size), g.div(y, size)];
        let speed = sum(g, [v, v], [w, w]);
        let speed = sum(g, [still, still], [speed, one]);
        let speed = g.add(speed, nothing);
        let speed = g.sqrt(speed);
        let creeps = [g.div(v, speed), g.div(w, speed)];
        creeps.into_iter().zip(slides).map(|(creeps, slides)| g.select(still, zero, creeps, slides)).collect()
    }
}
