//! Unilateral contacts along a prescribed motion.
//!
//! Where joints and prescribed quantities determine the motion, contacts are looked at, not met: one that is open gives nothing, one
//! that the motion goes through makes it impossible, and one that touches and stays may press. Where they leave something free, the
//! contacts that touch at the start and hold it are rows as those of joints: the motion leans on them, and has to press on them.

use super::{Driven, Rows};
use crate::analysis::Evaluator;
use crate::moves;
use crate::plan::Layout;
use crate::program::{Equations, Node};

/// Distances that are none, in sizes of the scene; deeper, a motion goes through a contact.
const TOUCHES: f64 = 1e-8;
/// Speeds and accelerations that are none, as a share of those in the scene.
const STAYS: f64 = 1e-7;
/// Speeds and accelerations beside which that is meant at least, in sizes of the scene and seconds.
const LEAST: f64 = 1e-3;

/// See the module documentation.
pub(super) struct Contacts {
    /// Per contact its value, rate and acceleration; then the rates of the rows that hold while it is closed.
    levels: Evaluator,
    of_velocities: Vec<bool>,
    sticking: Vec<usize>,
    /// Those without which the motion is not determined.
    lean: Vec<usize>,
}

/// What contacts do at a place of a motion.
#[derive(Debug, Default)]
pub(crate) struct Touching {
    /// Those that touch and stay, by number, ascending.
    pub(crate) closed: Vec<usize>,
    /// One that the motion goes through, and how far, as a share of the scene's size.
    pub(crate) passed: Option<(usize, f64)>,
    /// One that it runs into.
    pub(crate) struck: Option<usize>,
    /// One that touches without sliding, on which it slides.
    pub(crate) slips: Option<usize>,
}

impl Contacts {
    pub(super) fn new(equations: &mut Equations, layout: &Layout) -> Self {
        let mut nodes: Vec<Node> = Vec::new();
        let contacts = equations.contacts.clone();
        for contact in &contacts {
            let row = equations.rows[contact.row].clone();
            let rate = equations.row_rate(&row);
            let acceleration = equations.row_acceleration(&row, layout);
            nodes.extend([row.value, rate, acceleration]);
        }
        for row in contacts.iter().flat_map(|contact| contact.sticking.clone()) {
            let row = equations.rows[row].clone();
            nodes.push(equations.row_rate(&row));
        }
        Self {
            levels: Evaluator::new(&equations.graph, &nodes),
            of_velocities: contacts.iter().map(|contact| contact.of_velocities).collect(),
            sticking: contacts.iter().map(|contact| contact.sticking.len()).collect(),
            lean: Vec::new(),
        }
    }
}

impl Driven<'_> {
    /// Name of a contact.
    pub(crate) fn contact_name(&self, contact: usize) -> String {
        let (element, k) = self.layout.element_of_row(self.equations.contacts[contact].row);
        self.session.model.elements[element].row_name(k)
    }

    /// The contacts that the motion leans on.
    pub(crate) fn leans_on(&self) -> &[usize] {
        &self.contacts.lean
    }

    /// Puts the rows with these contacts closed in force. Multipliers of others are zero.
    pub(crate) fn close(&mut self, closed: &[usize]) {
        if self.rows.closed == closed {
            return;
        }
        let next = match self.other_rows.iter().position(|rows| rows.closed == closed) {
            Some(known) => self.other_rows.swap_remove(known),
            None => Rows::new(self.session, &self.equations, &self.layout, closed, self.counts),
        };
        let before = std::mem::replace(&mut self.rows, next);
        for row in before.local.rows() {
            if !self.rows.local.rows().contains(row) {
                self.inputs[self.layout.multiplier_slot() + row] = 0.0;
            }
        }
        self.other_rows.push(before);
    }

    /// The rows that determine the motion are in force again.
    pub(crate) fn close_those_it_leans_on(&mut self) {
        let lean = self.contacts.lean.clone();
        self.close(&lean);
    }

    fn levels(&mut self) -> Result<Vec<f64>, String> {
        let sets = &self.session.model.sets;
        Ok(self.contacts.levels.run(&self.inputs, sets).map_err(|error| error.to_string())?.to_vec())
    }

    /// Finds the contacts that hold what joints and prescribed quantities leave free beyond so many freedoms, where they are.
    pub(crate) fn lean(&mut self, wanted: usize) -> Result<(), String> {
        self.contacts.lean.clear();
        self.close(&[]);
        let mut left = self.count_free()?;
        if left <= wanted || self.equations.contacts.is_empty() {
            return Ok(());
        }
        let levels = self.levels()?;
        for contact in 0..self.equations.contacts.len() {
            if left <= wanted || self.contacts.of_velocities[contact] || levels[3 * contact] > TOUCHES * self.length {
                continue;
            }
            let with: Vec<usize> = self.contacts.lean.iter().copied().chain([contact]).collect();
            self.close(&with);
            let now = self.count_free()?;
            if now < left {
                (left, self.contacts.lean) = (now, with);
            }
        }
        self.close_those_it_leans_on();
        Ok(())
    }

    /// The contacts that the mechanism is beyond, where it is.
    pub(crate) fn beyond(&mut self) -> Result<Vec<usize>, String> {
        if self.equations.contacts.is_empty() {
            return Ok(Vec::new());
        }
        let levels = self.levels()?;
        let depth = TOUCHES * self.length;
        let beyond = |contact: &usize| !self.contacts.of_velocities[*contact] && levels[3 * contact] < -depth;
        Ok((0..self.equations.contacts.len()).filter(beyond).collect())
    }

    fn count_free(&mut self) -> Result<usize, String> {
        let found = self.expansion()?;
        Ok(self.freedom(&found, &self.holonomic(&found))?.count())
    }

    /// What contacts do where the mechanism is and moves.
    pub(crate) fn touching(&mut self) -> Result<Touching, String> {
        let mut found = Touching::default();
        let count = self.equations.contacts.len();
        if count == 0 {
            return Ok(found);
        }
        let levels = self.levels()?;
        let most = |values: nalgebra::DVector<f64>| {
            let part = |k: usize| if k % 6 < 3 { values[k].abs() } else { values[k].abs() * self.length };
            (0..values.len()).map(part).fold(LEAST * self.length, f64::max)
        };
        let speed = most(moves::velocities(&self.layout, &self.inputs));
        let acceleration =
            most(moves::accelerations(&self.layout, &self.inputs)).max(self.session.model.gravity.norm());
        let (depth, slow, none) = (TOUCHES * self.length, STAYS * speed, STAYS * acceleration);
        let mut rates = &levels[3 * count..];
        for contact in 0..count {
            let (own, rest) = rates.split_at(self.contacts.sticking[contact]);
            rates = rest;
            let [value, rate, second] = [0, 1, 2].map(|k| levels[3 * contact + k]);
            let leans = self.contacts.lean.contains(&contact);
            let closed = if self.contacts.of_velocities[contact] {
                if rate < -slow {
                    found.passed = found.passed.or(Some((contact, rate.abs() / speed)));
                }
                rate <= slow && second <= none
            } else {
                if value < -depth && !leans {
                    found.passed = found.passed.or(Some((contact, -value / self.length)));
                } else if value <= depth && rate < -slow && !leans {
                    found.struck = found.struck.or(Some(contact));
                }
                value.abs() <= depth && rate.abs() <= slow && second <= none
            };
            if closed || leans {
                found.closed.push(contact);
                if own.iter().any(|rate| rate.abs() > slow) {
                    found.slips = found.slips.or(Some(contact));
                }
            }
        }
        Ok(found)
    }
}
