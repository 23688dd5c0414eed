//! [`Contacts`]: unilateral rows where they touch. Impacts, and which of them are closed afterwards.
//!
//! A contact has a row c(q, t) >= 0 whose reaction p >= 0 acts only where c = 0 (Pfeiffer & Glocker, "Multibody Dynamics with
//! Unilateral Contacts", 1996; Brogliato, "Nonsmooth Mechanics", 3rd ed. 2016). With the rows that always hold eliminated, what
//! an impulse P of the contacts changes of their rates u = c' is `A P` with Delassus' matrix `A = J M^-1 J^T`, M^-1 across the
//! other rows; M has the mass of elements, too. Everything here is said in `A`, which is as large as there are contacts that touch.
//!
//! - **Impacts**: see [`Strike`].
//! - **Which are closed**: p >= 0, w = A p + b >= 0, p w = 0, with b the accelerations c'' while all are open. By principal pivoting with
//!   the least index (Murty 1974), which never closes a row that the closed ones imply.
//! - **Friction**: see [`Grip`].

mod decision;
mod friction;
mod impact;
mod indeterminate;
mod response;
mod shares;
mod smallest;
#[cfg(test)]
mod tests;

pub use friction::{Grip, Pattern};
pub use impact::{NoSolution, Strike};
use indeterminate::Bearing;
pub use indeterminate::{Holder, Indeterminate};
pub use shares::{Balance, Shares};

use std::cell::Cell;

use nalgebra::{DMatrix, DVector};

use super::constraints::{Constraints, mass_values};
use super::formulation::AnalysisError;
use super::working::clusters;
use crate::linalg::{Clusters, KktSolver, KktStructure, SparseFirst, connected_blocks};
use crate::model::Model;
use crate::plan::{Layout, body_scales};
use crate::program::{Contact, Equations, Friction, Sets, Used};
use smallest::{block, smallest};

/// Rank tolerance for the rows that always hold, and for Delassus' matrix.
const RANK_TOLERANCE: f64 = 1e-9;
/// Share of a row's gradient, squared, that other rows leave free, below which they determine how it moves. What an axis with a fine screw, or a
/// short lever, moves by is small beside the size of a scene.
const DETERMINED: f64 = 1e-12;
/// Share of the accelerations in a scene below which a contact's is none.
const NO_ACCELERATION: f64 = 1e-9;
/// Share of the largest acceleration in a scene below which all are round-off.
const LEAST_ACCELERATION: f64 = 1e-5;
/// The same of rows whose motion others determine: what these leave of loads that cancel.
const LEAST_DETERMINED: f64 = 1e-2;
/// Share of what two rows would have to do with each other if nothing but they held their bodies below which it is round-off.
const APART: f64 = 1e-13;
/// Share of the speeds in a scene below which a contact's is none.
const NO_SPEED: f64 = 1e-11;

/// See the module documentation.
pub struct Contacts {
    contacts: Vec<Contact>,
    frictions: Vec<Friction>,
    /// By contact, then by friction: whether its joint was released.
    gone: Vec<bool>,
    /// Jacobian, values, derivatives by time and gammas of all rows of the scene.
    rows: Constraints,
    /// The places of each row's entries in the Jacobian.
    entries: Vec<std::ops::Range<usize>>,
    /// Those that always hold.
    always: Vec<usize>,
    /// What the rate of each row may be off by: see [`Contacts::note_changes`].
    unresolved: Vec<f64>,
    structure: KktStructure,
    clusters: Clusters,
    mass: Vec<f64>,
    elements: response::Places,
    scales: Vec<f64>,
    length: f64,
}

/// A contact at a state.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Gap {
    /// Its value; zero for a row on velocities.
    pub value: f64,
    /// Its rate.
    pub rate: f64,
    /// What that may be off by: see [`Contacts::note_changes`].
    pub unresolved: f64,
    /// The largest rate of the rows that stick while it is closed, whatever it takes, beyond what it may be off by, over the length of its
    /// gradient.
    pub slip: f64,
    /// Length of its gradient, rotations taken on the length of the scene: value over size is a distance.
    pub size: f64,
    /// Whether it is a row on velocities.
    pub of_velocities: bool,
}

impl Gap {
    /// How far it is apart, m; nothing for a row on velocities.
    #[must_use]
    pub fn apart(&self) -> f64 {
        if self.of_velocities { 0.0 } else { self.value / self.size }
    }

    /// Whether it touches: it is no further apart than `near`, m, or than it moves within `instant`, s.
    #[must_use]
    pub fn touches(&self, near: f64, instant: f64) -> bool {
        self.of_velocities || self.apart() <= near.max(self.rate.abs() / self.size * instant)
    }

    /// Whether it closes, where speeds are of this size.
    #[must_use]
    pub fn approaches(&self, speed: f64) -> bool {
        self.rate < -self.no_rate(speed)
    }

    /// How fast it may be without moving.
    fn no_rate(&self, speed: f64) -> f64 {
        (NO_SPEED * speed * self.size).max(self.unresolved)
    }

    /// Whether it comes as fast as another, but for this difference, m/s: as they are, like feet of a table that falls flat, or relative to
    /// the lengths of their gradients.
    #[must_use]
    pub fn comes_with(&self, other: &Self, difference: f64) -> bool {
        let relative = |gap: &Self| gap.rate / gap.size;
        let is_as_fast = (self.rate - other.rate).abs() <= difference * self.size;
        is_as_fast || (relative(self) - relative(other)).abs() <= difference
    }

    /// Whether an impulse ends what slides although it cannot, where speeds are of this size: if it touches and does not part.
    #[must_use]
    pub fn grips(&self, speed: f64) -> bool {
        self.rate <= self.no_rate(speed) && self.slip > NO_SPEED * speed
    }
}

/// Contacts that touch, at a position.
pub struct Meeting {
    /// Which they are.
    pub touching: Vec<usize>,
    /// What holds up to a limit there.
    pub grips: Vec<Grip>,
    /// Their rates, and those of the rows that stick with them: each contact's row is followed by these; then those of
    /// friction.
    pub rates: DVector<f64>,
    /// Impulses so far.
    pub impulses: DVector<f64>,
    /// What happened to each contact so far.
    pub strikes: Vec<Strike>,
    /// Work of impulses so far on what moves, J: that of driven rows included.
    pub work: f64,
    /// Those that struck together such that the motion depends on how they share the impulse, which rigid bodies leave open.
    pub shared: Vec<Holder>,
    /// Share of the size of speeds below which frictions in a plane are at rest: errors of velocities, whose direction means nothing.
    pub still: f64,
    /// Iterations for directions of sliding that are left.
    turns: Cell<usize>,
    restitution: Vec<f64>,
    sizes: Vec<f64>,
    /// What the rates of the rows may be off by: see [`Contacts::note_changes`].
    unresolved: Vec<f64>,
    /// Delassus' matrix of bodies that all have the same mass: what rows have to do with each other, as a question of geometry.
    geometry: DMatrix<f64>,
    bearing: Bearing,
    /// Rows that have to do with each other: what touches a body whose motion is prescribed moves nothing else by it.
    blocks: Vec<Vec<usize>>,
    /// How large accelerations are around each row, m/s^2: see [`Meeting::accelerations`].
    around: Vec<f64>,
    /// Numbers of the rows among all.
    rows: Vec<usize>,
    /// Where each contact's rows begin; then their number.
    first: Vec<usize>,
    delassus: DMatrix<f64>,
    /// Velocities of bodies, six each, for a unit impulse of each row.
    responses: Vec<Vec<f64>>,
    /// Impulse of each row that always holds times its derivative by time, for the same.
    driven: Vec<f64>,
    /// Derivatives of the rows by time.
    times: Vec<f64>,
    jacobian: Vec<Vec<(usize, f64)>>,
}

impl Contacts {
    /// Those of a scene; `length` is its size, m.
    ///
    /// # Errors
    /// When the linear algebra refuses the model.
    pub fn new(equations: &mut Equations, model: &Model, layout: &Layout, length: f64) -> Result<Self, AnalysisError> {
        let all: Vec<usize> = (0..equations.rows.len()).collect();
        let (elements, masses) = response::Places::new(equations.element_mass(model, layout));
        let rows = Constraints::new(equations, &all, &[|row| row.value, |row| row.time, |row| row.gamma], &masses)?;
        let open = equations.with_closed(&[]);
        let always: Vec<usize> = open.enforced().collect();
        let entries = all.iter().map(|row| rows.structure.row(*row)).collect();
        Ok(Self {
            structure: super::constraints::structure(equations, &always)?,
            clusters: clusters(layout, &always),
            mass: mass_values(model),
            elements,
            scales: body_scales(model, length),
            contacts: equations.contacts.clone(),
            frictions: equations.frictions.clone(),
            gone: equations.switching_rows().map(|row| equations.is_gone(row)).collect(),
            unresolved: vec![0.0; all.len()],
            rows,
            entries,
            always,
            length,
        })
    }

    /// Evaluates everything at a state, and gives the contacts there. `velocities`: six per body.
    ///
    /// # Errors
    /// What an opaque element did wrong.
    pub fn look(&mut self, inputs: &[f64], velocities: &[f64], sets: &Sets) -> Result<Vec<Gap>, AnalysisError> {
        self.rows.evaluate(inputs, sets)?;
        let gap = |(number, contact): (usize, &Contact)| {
            if self.gone[number] {
                return Gap { value: f64::INFINITY, size: 1.0, ..Gap::default() };
            }
            let rate = |row: usize| {
                let entries = self.row(row);
                let rate: f64 = entries.iter().map(|(column, slope)| slope * velocities[*column]).sum();
                (rate + self.rows.function(1)[row], self.size(&entries))
            };
            let slip = |row: usize| {
                let (rate, size) = rate(row);
                (rate.abs() - self.unresolved[row]) / size
            };
            let (row, slip) = (contact.row, contact.sticking.iter().map(|row| slip(*row)).fold(0.0, f64::max));
            let (rate, size) = rate(row);
            let (value, unresolved) = (self.rows.function(0)[row], self.unresolved[row]);
            Gap { value, rate, unresolved, slip, size, of_velocities: contact.of_velocities }
        };
        Ok(self.contacts.iter().enumerate().map(gap).collect())
    }

    /// Whether a contact, or behind these a friction, is one of a joint that was released.
    #[must_use]
    pub fn is_gone(&self, number: usize) -> bool {
        self.gone[number]
    }

    /// Length of the gradient of each contact where [`Contacts::look`] looked last, then of each friction, the longest of its rows.
    /// Rotations are taken on the length of the scene: a value over it is a distance, whether the row is one or an angle.
    #[must_use]
    pub fn sizes(&self) -> Vec<f64> {
        let size = |row: &usize| self.size(&self.row(*row));
        let of_contacts = self.contacts.iter().map(|contact| size(&contact.row));
        let of_frictions = self.frictions.iter().map(|friction| friction.rows.iter().map(size).fold(0.0, f64::max));
        of_contacts.chain(of_frictions).collect()
    }

    /// The gammas of all rows at a state.
    ///
    /// # Errors
    /// What an opaque element did wrong.
    pub fn gammas(&mut self, inputs: &[f64], sets: &Sets) -> Result<&[f64], AnalysisError> {
        self.rows.evaluate(inputs, sets)?;
        Ok(self.rows.function(2))
    }

    /// Takes note of what the rates of rows may be off by where contacts meet: what they change by within `instant`, s, which is how exactly
    /// the time of that is known, where bodies have these accelerations before it, six each. What comes to rest late and quickly does so to
    /// that. `again`: it is the instant noted last, where the larger counts.
    ///
    /// # Errors
    /// What an opaque element did wrong.
    pub fn note_changes(
        &mut self,
        (inputs, of_bodies): (&[f64], &[f64]),
        sets: &Sets,
        (instant, again): (f64, bool),
    ) -> Result<(), AnalysisError> {
        self.rows.evaluate(inputs, sets)?;
        let of_contacts = self.contacts.iter().flat_map(Contact::rows);
        for row in of_contacts.chain(self.frictions.iter().flat_map(|friction| friction.rows.iter().copied())) {
            let change = instant * (dot(&self.row(row), of_bodies) - self.rows.function(2)[row]).abs();
            self.unresolved[row] = if again { change.max(self.unresolved[row]) } else { change };
        }
        Ok(())
    }

    /// The program of all rows, with how often it was run.
    pub fn used(&mut self) -> Used<'_> {
        self.rows.used(false)
    }

    /// Which rows they are of.
    #[must_use]
    pub fn contacts(&self) -> &[Contact] {
        &self.contacts
    }

    fn unit(&self, column: usize) -> f64 {
        if column % 6 < 3 { 1.0 } else { 1.0 / self.length }
    }

    /// Length of the gradient of a row, rotations taken on the length of the scene.
    fn size(&self, entries: &[(usize, f64)]) -> f64 {
        let square: f64 = entries.iter().map(|(column, slope)| (slope * self.unit(*column)).powi(2)).sum();
        if square > 0.0 { square.sqrt() } else { 1.0 }
    }

    /// How much of a row's rate an impulse along it changes if no other row holds its bodies, 1/kg.
    fn alone(&self, entries: &[(usize, f64)]) -> f64 {
        let places = self.structure.mass.iter().zip(&self.mass);
        let of = |column: usize| places.clone().find(|((row, other), _)| *row == column && *other == column);
        entries.iter().filter_map(|(column, slope)| Some(slope * slope / of(*column)?.1)).sum()
    }

    /// The Jacobian of the rows that always hold, and of these contacts and their frictions, where [`Contacts::look`] looked last.
    #[must_use]
    pub fn gradients(&self, touching: &[usize]) -> Vec<f64> {
        let of_contacts = touching.iter().flat_map(|k| self.contacts[*k].rows());
        let is_own = |friction: &&Friction| friction.contact.is_none_or(|contact| touching.contains(&contact));
        let of_frictions = self.frictions.iter().filter(is_own).flat_map(|friction| friction.rows.iter().copied());
        let rows = self.always.iter().copied().chain(of_contacts).chain(of_frictions);
        rows.flat_map(|row| self.rows.jacobian()[self.entries[row].clone()].iter().copied()).collect()
    }

    /// The Jacobian of a row where it was evaluated last.
    fn row(&self, row: usize) -> Vec<(usize, f64)> {
        let pattern = &self.rows.structure.jacobian;
        let own = self.entries[row].clone();
        pattern[own.clone()].iter().zip(&self.rows.jacobian()[own]).map(|((_, c), slope)| (*c, *slope)).collect()
    }

    /// The frictions of the scene.
    #[must_use]
    pub fn frictions(&self) -> &[Friction] {
        &self.frictions
    }

    /// Contacts that touch where [`Contacts::look`] looked last, and frictions with the limit of each, whether it stuck, and the speed
    /// that it creeps with, if it does.
    ///
    /// # Errors
    /// Rows that have no solution there.
    pub fn meeting(
        &self,
        touching: &[usize],
        limits: impl Fn(usize) -> (f64, bool, Option<f64>),
        velocities: &[f64],
    ) -> Result<Meeting, AnalysisError> {
        let mut rows = Vec::new();
        let mut first = Vec::new();
        for contact in touching.iter().map(|k| &self.contacts[*k]) {
            first.push(rows.len());
            rows.extend(contact.rows());
        }
        first.push(rows.len());
        let mut grips = Vec::new();
        for (number, friction) in self.frictions.iter().enumerate() {
            let contact = friction.contact.map(|contact| touching.iter().position(|k| *k == contact));
            if contact == Some(None) || self.gone[self.contacts.len() + number] {
                continue;
            }
            let (limit, stuck, creeps) = limits(number);
            let own = rows.len()..rows.len() + friction.rows.len();
            grips.push(Grip {
                number,
                limit,
                contact: contact.flatten(),
                stuck,
                creeps: creeps.filter(|_| friction.rows.len() > 1),
                moves: false,
                rows: own.collect(),
                only: None,
                fixed: false,
            });
            rows.extend(&friction.rows);
        }
        let values: Vec<f64> =
            self.always.iter().flat_map(|row| self.row(*row).into_iter().map(|(_, slope)| slope)).collect();
        let mut solver = SparseFirst::new(&self.structure, &self.clusters, RANK_TOLERANCE)?;
        solver.set_measure(&self.scales);
        solver.set_mass(&self.mass)?;
        solver.refactor(&values)?;
        let jacobian: Vec<Vec<(usize, f64)>> = rows.iter().map(|row| self.row(*row)).collect();
        let times: Vec<f64> = rows.iter().map(|row| self.rows.function(1)[*row]).collect();
        let answers = self.responses(&mut solver, &jacobian, true)?;
        let driven = self.driven(&answers);
        let responses: Vec<Vec<f64>> = answers.into_iter().map(|(velocities, _)| velocities).collect();
        let sizes: Vec<f64> = jacobian.iter().map(|entries| self.size(entries)).collect();
        let delassus = coupled(jacobian.len(), |i, j| dot(&jacobian[i], &responses[j]), |k| self.alone(&jacobian[k]));
        let rates = DVector::from_fn(rows.len(), |i, _| dot(&jacobian[i], velocities) + times[i]);
        // The same of bodies that all have one mass, as products of what moves: round-off of what others determine is a square there.
        let unit = |(row, column): &(usize, usize)| if row == column { self.unit(*column).powi(-2) } else { 0.0 };
        solver.set_mass(&self.structure.mass.iter().map(unit).collect::<Vec<_>>())?;
        solver.refactor(&values)?;
        let (of_geometry, taken): (Vec<_>, Vec<_>) = self.responses(&mut solver, &jacobian, false)?.into_iter().unzip();
        let product = |i: usize, j: usize| {
            let pairs = of_geometry[i].iter().zip(&of_geometry[j]).enumerate();
            pairs.map(|(column, (a, b))| a * b / self.unit(column).powi(2)).sum()
        };
        let geometry = coupled(jacobian.len(), product, |k| sizes[k].powi(2));
        let always = self.always.iter().map(|row| (*row, self.row(*row)));
        let bearing = Bearing::new(always, |entries| self.size(entries), taken);
        grips.iter_mut().for_each(|grip: &mut Grip| grip.look(&geometry, &sizes));
        Ok(Meeting {
            blocks: blocks_of([&delassus, &geometry], &first, &grips),
            around: vec![0.0; rows.len()],
            geometry,
            bearing,
            restitution: touching.iter().map(|k| self.contacts[*k].restitution).collect(),
            sizes,
            unresolved: rows.iter().map(|row| self.unresolved[*row]).collect(),
            impulses: DVector::zeros(rows.len()),
            touching: touching.to_vec(),
            grips,
            strikes: Vec::new(),
            work: 0.0,
            shared: Vec::new(),
            still: 0.0,
            turns: Cell::new(friction::MOST_IN_ALL),
            rows,
            first,
            delassus,
            rates,
            responses,
            driven,
            times,
            jacobian,
        })
    }
}

fn dot(entries: &[(usize, f64)], v: &[f64]) -> f64 {
    entries.iter().map(|(column, slope)| slope * v[*column]).sum()
}

/// Delassus' matrix of so many rows, without round-off between those that rows that always hold keep apart; `alone`: what its diagonal would
/// be without these.
fn coupled(count: usize, entry: impl Fn(usize, usize) -> f64, alone: impl Fn(usize) -> f64) -> DMatrix<f64> {
    let alone: Vec<f64> = (0..count).map(|k| alone(k).sqrt()).collect();
    DMatrix::from_fn(count, count, |i, j| {
        let entry = entry(i, j);
        if i != j && entry.abs() <= APART * alone[i] * alone[j] { 0.0 } else { entry }
    })
}

/// Rows that have to do with each other, by these matrices or as those of one contact and its friction.
fn blocks_of(matrices: [&DMatrix<f64>; 2], first: &[usize], grips: &[Grip]) -> Vec<Vec<usize>> {
    let n = matrices[0].nrows();
    let pairs = (0..n).flat_map(|i| (0..i).map(move |j| (i, j)));
    let coupled = pairs.filter(|(i, j)| matrices.iter().any(|a| a[(*i, *j)] != 0.0 || a[(*j, *i)] != 0.0));
    let of_contacts = first.windows(2).flat_map(|own| (own[0]..own[1]).map(|row| (own[0], row)));
    let of_grips = grips.iter().flat_map(|grip| {
        let with = grip.contact.map_or(grip.rows[0], |contact| first[contact]);
        grip.rows.iter().map(move |row| (with, *row))
    });
    connected_blocks(n, coupled.chain(of_contacts).chain(of_grips))
}

impl Meeting {
    /// The rate of the k-th of the touching contacts.
    #[must_use]
    pub fn rate(&self, k: usize) -> f64 {
        self.rates[self.first[k]]
    }

    /// How fast it may approach without doing so, where speeds are of this size.
    fn no_rate(&self, k: usize, speed: f64) -> f64 {
        let row = self.first[k];
        (NO_SPEED * speed * self.sizes[row]).max(self.unresolved[row])
    }

    /// Whether the k-th of them approaches, where speeds are of this size.
    #[must_use]
    pub fn approaches(&self, k: usize, speed: f64) -> bool {
        self.rate(k) < -self.no_rate(k, speed)
    }

    /// Whether those that approach come from no higher than this, m, where accelerations are of this size, and fall, each by its number.
    #[must_use]
    pub fn comes_from_below(
        &self,
        height: f64,
        [speed, acceleration]: [f64; 2],
        falls: impl Fn(usize) -> bool,
    ) -> bool {
        let low = |k: usize| {
            let rate = self.rate(k) / self.sizes[self.first[k]];
            falls(self.touching[k]) && rate * rate <= 2.0 * acceleration * height
        };
        (0..self.touching.len()).filter(|k| self.approaches(*k, speed)).all(low)
    }

    /// Whether the k-th of them neither approaches nor leaves.
    #[must_use]
    pub fn stays(&self, k: usize, speed: f64) -> bool {
        self.rate(k).abs() <= self.no_rate(k, speed)
    }

    /// How small an acceleration of a row is none.
    fn no_acceleration(&self, row: usize) -> f64 {
        NO_ACCELERATION * self.around[row] * self.sizes[row]
    }

    /// The largest acceleration that touching contacts would give, each with a reaction of this size, m/s^2.
    #[must_use]
    pub fn acceleration_by(&self, reaction: impl Fn(usize) -> f64) -> f64 {
        let given = self.touching.iter().zip(&self.first).map(|(contact, row)| {
            let size = self.sizes[*row];
            if size > 0.0 { reaction(*contact) * self.delassus[(*row, *row)] / size } else { 0.0 }
        });
        given.fold(0.0, f64::max)
    }

    /// Contacts that touch, as places among those, and frictions, each with the number of the block that it belongs to: what is in others has
    /// nothing to do with it.
    pub fn parts(&self) -> impl Iterator<Item = (Holder, usize)> {
        let block = |row: usize| self.blocks.iter().position(|rows| rows.binary_search(&row).is_ok()).unwrap_or(0);
        let contacts = (0..self.touching.len()).map(move |k| (Holder::Contact(k), block(self.first[k])));
        contacts.chain(self.grips.iter().map(move |grip| (Holder::Friction(grip.number), block(grip.rows[0]))))
    }

    /// What a closed contact may pull with and a friction that sticks take without anything being decided by it: opened, or given way to, it
    /// would hardly accelerate.
    #[must_use]
    pub fn undecided(&self, pattern: &Pattern) -> Vec<(Holder, f64)> {
        let holds = |grip: &&Grip| pattern.sticking.contains(&grip.number);
        let contacts = pattern.closed.iter().map(|k| {
            let row = self.first[*k];
            let others =
                pattern.closed.iter().filter(|other| *other != k).flat_map(|k| self.first[*k]..self.first[k + 1]);
            let frictions = self.grips.iter().filter(holds).filter(|grip| grip.contact != Some(*k));
            let rows: Vec<usize> = others.chain(frictions.flat_map(|grip| grip.rows.iter().copied())).collect();
            let column = self.delassus.column(row).into_owned();
            let held: f64 =
                self.stopping(&rows, &column).iter().zip(&rows).map(|(force, row)| force * column[*row]).sum();
            let (alone, free) = (column[row], column[row] + held);
            let way = if free > indeterminate::TAKES_PART * alone { free } else { alone };
            (Holder::Contact(*k), if way > 0.0 { self.no_acceleration(row) / way } else { 0.0 })
        });
        let frictions = self.grips.iter().filter(holds).map(|grip| {
            let force = |row: &usize| {
                if self.row_gives_way(*row) { self.no_acceleration(*row) / self.delassus[(*row, *row)] } else { 0.0 }
            };
            (Holder::Friction(grip.number), grip.rows.iter().map(force).fold(0.0, f64::max))
        });
        contacts.chain(frictions).collect()
    }

    /// Whether anything gives way to the k-th of them: not where other rows determine how it moves.
    #[must_use]
    pub fn gives_way(&self, k: usize) -> bool {
        self.row_gives_way(self.first[k])
    }

    fn row_gives_way(&self, row: usize) -> bool {
        self.geometry[(row, row)] > DETERMINED * self.sizes[row].powi(2)
    }

    /// A rough contact that would be pressed if it could slide, and that would have to pull in order not to (or hardly pushes, and is about
    /// to), where rows have these accelerations while all contacts are open.
    #[must_use]
    pub fn pulling(&self, of_rows: &DVector<f64>, speed: f64) -> Option<usize> {
        (0..self.touching.len()).find(|k| {
            let rows: Vec<usize> = (self.first[*k]..self.first[*k + 1]).collect();
            let (normal, none) = (rows[0], self.no_acceleration(rows[0]));
            let hardly = |force: f64| force * self.delassus[(normal, normal)] <= none;
            let is_pressed = of_rows[normal] < -none;
            rows.len() > 1 && self.stays(*k, speed) && is_pressed && hardly(self.stopping(&rows, of_rows)[0])
        })
    }

    /// What acts along some rows, and nothing along others, so that it brings their rates to zero from these, which are of all rows. Where
    /// that is not unique, the smallest.
    fn stopping(&self, rows: &[usize], rates: &DVector<f64>) -> DVector<f64> {
        self.solve(
            rows,
            &block(&self.delassus, rows),
            DVector::from_iterator(rows.len(), rows.iter().map(|row| -rates[*row])),
        )
    }

    /// The smallest solution for what acts along some rows: of their block of Delassus' matrix, or of one that differs from it by what depends on
    /// what acts. Nothing acts along a row that nothing gives way to: its part of the matrix is round-off.
    fn solve(&self, rows: &[usize], matrix: &DMatrix<f64>, right: DVector<f64>) -> DVector<f64> {
        if rows.is_empty() {
            return right;
        }
        // Rows of all units alike.
        let unit = |row: &usize| if self.row_gives_way(*row) { 1.0 / self.delassus[(*row, *row)].sqrt() } else { 0.0 };
        let scale = DVector::from_iterator(rows.len(), rows.iter().map(unit));
        let scaled = DMatrix::from_fn(rows.len(), rows.len(), |i, j| scale[i] * matrix[(i, j)] * scale[j]);
        smallest(&scaled, &right.component_mul(&scale)).component_mul(&scale)
    }

    /// What the impulses so far change of the velocities of bodies, six each.
    #[must_use]
    pub fn change(&self) -> Vec<f64> {
        self.change_by(&self.impulses)
    }

    fn change_by(&self, impulses: &DVector<f64>) -> Vec<f64> {
        let mut change = vec![0.0; self.responses.first().map_or(0, Vec::len)];
        for (response, impulse) in self.responses.iter().zip(impulses.iter()) {
            change.iter_mut().zip(response).for_each(|(sum, part)| *sum += impulse * part);
        }
        change
    }

    /// The most that impulses change of the velocity of a body, m/s.
    fn changed_by(&self, impulses: &DVector<f64>) -> f64 {
        let norm = |v: &[f64]| v.iter().take(3).map(|part| part * part).sum::<f64>().sqrt();
        self.change_by(impulses).chunks(6).map(norm).fold(0.0, f64::max)
    }

    /// Accelerations c'' of all rows where bodies have these accelerations, six each, and velocities that belong to the gammas.
    ///
    /// Takes note of how large accelerations are around each row, among the rows that have to do with it: by what its own is made of, by what
    /// these weights of bodies, six each, would give it, and by what contacts would that press with these reactions. What moves elsewhere, or
    /// presses on what others hold, says nothing of it, but for round-off of the `largest` acceleration in the scene, m/s^2.
    #[must_use]
    pub fn accelerations(
        &mut self,
        (of_bodies, gammas): (&[f64], &[f64]),
        weights: &[f64],
        reaction: impl Fn(usize) -> f64,
        largest: f64,
    ) -> DVector<f64> {
        let found = DVector::from_fn(self.rows.len(), |i, _| dot(&self.jacobian[i], of_bodies) - gammas[self.rows[i]]);
        let mut own: Vec<f64> = (0..self.rows.len())
            .map(|i| {
                let parts = self.jacobian[i].iter().map(|(column, slope)| (slope * of_bodies[*column]).abs());
                // In whatever direction: a pendulum that hangs straight down does so to round-off.
                let norm = |of: &[f64]| of.iter().take(3).map(|part| part * part).sum::<f64>().sqrt();
                let weights =
                    self.responses[i].chunks(6).zip(weights.chunks(6)).map(|(gives, of)| norm(gives) * norm(of));
                parts.sum::<f64>() + gammas[self.rows[i]].abs() + weights.sum::<f64>()
            })
            .collect();
        for (contact, row) in self.touching.iter().zip(&self.first) {
            own[*row] = own[*row].max(reaction(*contact) * self.delassus[(*row, *row)]);
        }
        let relative = |row: &usize| own[*row] / self.sizes[*row];
        let all = self.blocks.iter().map(|rows| rows.iter().map(relative).fold(0.0, f64::max)).collect::<Vec<_>>();
        let most = all.iter().copied().fold(largest, f64::max);
        for (rows, size) in self.blocks.iter().zip(all) {
            for row in rows {
                let least = if self.row_gives_way(*row) { LEAST_ACCELERATION } else { LEAST_DETERMINED };
                self.around[*row] = size.max(least * most);
            }
        }
        found
    }

    /// Which contacts (places among those that touch) are closed, where rows have these accelerations while all contacts are open: of those
    /// that neither approach nor leave, and of those whose bouncing stays below `height`, m, while the others that are closed hold. `None`
    /// where that is not found.
    #[must_use]
    pub fn closed(
        &self,
        of_rows: &DVector<f64>,
        [speed, height]: [f64; 2],
        may_bounce: impl Fn(usize) -> bool,
    ) -> Option<Pattern> {
        let all = 0..self.touching.len();
        let none: Vec<f64> = (0..self.rows.len()).map(|row| self.no_acceleration(row)).collect();
        let held = self.held(speed, of_rows, &none);
        let mut candidates: Vec<usize> = all.clone().filter(|k| self.stays(*k, speed)).collect();
        loop {
            let pattern = self.at_rest(of_rows, &candidates, held.clone(), &none)?;
            let w = &self.delassus * &pattern.forces + of_rows;
            let is_low = |k: usize| {
                let (rate, row) = (self.rate(k), self.first[k]);
                w[row] < -none[row] && rate * rate <= -2.0 * w[row] * height * self.sizes[row]
            };
            let count = candidates.len();
            let low = all.clone().filter(|k| !candidates.contains(k) && may_bounce(self.touching[*k]) && is_low(*k));
            let low: Vec<usize> = low.collect();
            candidates.extend(low);
            if candidates.len() == count {
                return Some(pattern);
            }
        }
    }
}
