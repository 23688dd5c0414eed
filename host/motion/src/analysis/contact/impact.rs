//! [`Strike`]: impacts of contacts that touch.
//!
//! One after the other, as in chains of balls, that which would take most energy by itself first: u^2 / A of its approach u, which depends
//! on no unit, neither of angles beside lengths nor of a size of the scene. Those that approach equally fast, or take as much energy, strike
//! together, so that round-off decides on no order: the corners of a box that falls flat. Each is compressed until it neither approaches nor
//! slides, then gives back its coefficient of restitution's share of the normal impulse (Poisson; where nothing sticks that is Newton's
//! law). No impact adds energy. What has not come to an end after [`MOST_STRIKES`] ends without restitution, all at once. Where more strike
//! together than rigid bodies share the impulse among, and the motion depends on that, it is told: see [`Meeting::shared`].

use nalgebra::DVector;

use super::decision::Decision;
use super::friction::{norm, pair};
use super::smallest::block;
use super::{Grip, Holder, Meeting, NO_SPEED, Pattern};

/// Size of errors of velocities, beyond which ending what is taken for one moves bodies.
const MOVED: f64 = 100.0;
/// Impacts one after the other at one instant.
const MOST_STRIKES: usize = 2000;

/// What happened to a contact in an impact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Strike {
    /// Which contact.
    pub contact: usize,
    /// Its rate before and after.
    pub rates: [f64; 2],
    /// Impulse along its row.
    pub impulse: f64,
    /// Energy lost in it, J.
    pub lost: f64,
}

/// Why there is no impact: the contact, as a place among those that touch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoSolution {
    /// It would have to pull in order not to slide.
    Pulls(usize),
    /// Neither sticking nor sliding was found to meet the law of friction.
    Undecided(usize),
}

impl Meeting {
    /// Lets those that approach strike, until none does that anything gives way to; `speed` is the size of speeds, and `same` the share of
    /// it below which differences are none.
    ///
    /// # Errors
    /// The contact whose impact has no solution.
    pub fn strike_all(&mut self, speed: f64, same: f64) -> Result<(), NoSolution> {
        for _ in 0..MOST_STRIKES {
            let mut all: Vec<usize> =
                (0..self.touching.len()).filter(|k| self.approaches(*k, speed) && self.gives_way(*k)).collect();
            let hardest = all.iter().copied().min_by(|a, b| self.blow(*a).total_cmp(&self.blow(*b)));
            let Some(hardest) = hardest else { return Ok(()) };
            all.retain(|k| self.strikes_with(*k, hardest, same * speed));
            self.strike(&all, NO_SPEED * speed)?;
        }
        let all: Vec<usize> = (0..self.touching.len()).collect();
        let rates = self.rates.clone();
        let held = self.held_in_impact(&all, speed);
        if let Some(pattern) = self.complementary(&rates, &all, held, &self.none(NO_SPEED * speed)) {
            self.push(pattern.forces);
        }
        Ok(())
    }

    /// The rate of the k-th of the touching contacts over the root of how much it gives way: minus the root of twice the energy that its
    /// impact takes, where it approaches.
    fn blow(&self, k: usize) -> f64 {
        self.rate(k) / self.way(k).sqrt()
    }

    fn way(&self, k: usize) -> f64 {
        self.delassus[(self.first[k], self.first[k])]
    }

    /// Whether one approaches as another does, but for this difference, m/s.
    fn strikes_with(&self, k: usize, other: usize, difference: f64) -> bool {
        let none = difference * self.sizes[self.first[k]];
        let is_as_hard = (self.blow(k) - self.blow(other)).abs() * self.way(k).sqrt() <= none;
        is_as_hard || (self.rate(k) - self.rate(other)).abs() <= none
    }

    /// The impact of some contacts together, none of which pulls in order not to slide; `unit` is the speed that is none.
    fn strike(&mut self, together: &[usize], unit: f64) -> Result<(), NoSolution> {
        let pulls = |k: &&usize| {
            let rows: Vec<usize> = (self.first[**k]..self.first[**k + 1]).collect();
            rows.len() > 1 && self.stopping(&rows, &self.rates)[0] <= 0.0
        };
        let Some((impulses, pattern)) = self.struck(together, unit) else {
            return Err(match together.iter().find(pulls) {
                Some(k) => NoSolution::Pulls(*k),
                None => NoSolution::Undecided(together[0]),
            });
        };
        for k in self.shared_in_impact(together, &pattern, unit).into_iter().chain(pattern.several) {
            if !self.shared.contains(&Holder::Contact(k)) {
                self.shared.push(Holder::Contact(k));
            }
        }
        self.push(impulses);
        Ok(())
    }

    /// Takes impulses.
    fn push(&mut self, impulses: DVector<f64>) {
        let before = self.rates.clone();
        self.rates += &self.delassus * &impulses;
        for k in 0..self.touching.len() {
            let rows = self.rows_with_friction(k);
            if rows.iter().all(|row| impulses[*row] == 0.0) {
                continue;
            }
            let mean = |row: usize| impulses[row] * 0.5 * (before[row] + self.rates[row]);
            let lost = 0.0 - rows.iter().map(|row| mean(*row)).sum::<f64>();
            let work = |row: &usize| mean(*row) + impulses[*row] * (self.driven[*row] - self.times[*row]);
            self.work += rows.iter().map(work).sum::<f64>();
            let normal = rows[0];
            let contact = self.touching[k];
            match self.strikes.iter_mut().find(|strike| strike.contact == contact) {
                Some(strike) => {
                    strike.rates[1] = self.rates[normal];
                    strike.impulse += impulses[normal];
                    // Round-off neither takes nor gives.
                    strike.lost = (strike.lost + lost).max(0.0);
                }
                None => {
                    let rates = [before[normal], self.rates[normal]];
                    self.strikes.push(Strike { contact, rates, impulse: impulses[normal], lost: lost.max(0.0) });
                }
            }
        }
        // One impact changes what others have left.
        for strike in &mut self.strikes {
            if let Some(k) = self.touching.iter().position(|contact| *contact == strike.contact) {
                strike.rates[1] = self.rates[self.first[k]];
            }
        }
        self.impulses += impulses;
    }

    /// An impact of contacts that do not approach, as there is where no accelerations meet all conditions while they slide: friction that
    /// presses ever harder ends the sliding at once (Painleve; "tangential impact": Genot & Brogliato, Eur. J. Mech. A 18, 1999; Stewart,
    /// SIAM Review 42, 2000). Impulses that change rates, and after which these meet the law of friction, with what sticks first. `false`
    /// where there are none.
    pub fn seize(&mut self, speed: f64) -> bool {
        let all: Vec<usize> = (0..self.touching.len()).collect();
        let unit = NO_SPEED * speed;
        let changes = |impulses: &DVector<f64>| {
            let change = &self.delassus * impulses;
            let loses = impulses.dot(&(&self.rates + 0.5 * &change)) < 0.0;
            loses && (0..self.rows.len()).any(|row| change[row].abs() > unit * self.sizes[row])
        };
        let decision = Decision { meeting: self, b: &self.rates, candidates: &all, none: &self.none(unit) };
        let start = decision.start(self.held_in_impact(&all, speed));
        let Some((_, impulses)) = decision.search(&start, changes) else { return false };
        self.push(impulses);
        true
    }

    /// Ends the motion of closed contacts and of what sticks, what is left of that of what begins to slide from rest, and what there may be
    /// of contacts that only touch: where rows have these accelerations while all contacts are open, and speeds are of this size. What slides takes the friction of these
    /// impulses, also of one that pulls. It stands for the bouncing that is left out, which gives that much less than the impulse before
    /// and the weight: all in all as much friction as normal impulse.
    pub fn come_to_rest(&mut self, pattern: &Pattern, of_rows: &DVector<f64>, speed: f64) {
        let impulses = self.impulses_to_rest(pattern, of_rows, speed, &self.rates);
        self.push(impulses);
    }

    /// The impulses of [`Meeting::come_to_rest`] for rows with these rates.
    fn impulses_to_rest(
        &self,
        pattern: &Pattern,
        of_rows: &DVector<f64>,
        speed: f64,
        rates: &DVector<f64>,
    ) -> DVector<f64> {
        let mut rows: Vec<usize> = pattern.closed.iter().flat_map(|k| self.first[*k]..self.first[k + 1]).collect();
        rows.extend(self.silent(pattern, of_rows, speed).into_iter().map(|k| self.first[k]));
        let sticking = self.grips.iter().filter(|grip| pattern.sticking.contains(&grip.number));
        rows.extend(sticking.flat_map(|grip| grip.rows.iter().copied()));
        rows.extend(self.beginning(pattern, speed).flat_map(|grip| grip.rows.iter().copied()));
        let sliding = self.sliding(pattern).filter_map(|grip| {
            let contact = grip.contact.filter(|contact| pattern.closed.contains(contact))?;
            Some((grip, contact, self.moving(grip, speed)?))
        });
        let sliding: Vec<(&Grip, usize, [f64; 2])> = sliding.collect();
        let mut matrix = block(&self.delassus, &rows);
        for (grip, contact, direction) in &sliding {
            self.drag(&mut matrix, &rows, *contact, (&grip.rows, grip.limit, *direction));
        }
        let found = self.solve(&rows, &matrix, DVector::from_fn(rows.len(), |i, _| -rates[rows[i]]));
        let mut impulses = DVector::zeros(self.rows.len());
        rows.iter().zip(found.iter()).for_each(|(row, value)| impulses[*row] = *value);
        for (grip, contact, direction) in sliding {
            let pressing = impulses[self.first[contact]];
            let own = grip.rows.iter().zip(direction);
            own.for_each(|(row, direction)| impulses[*row] = -grip.limit * pressing * direction);
        }
        impulses
    }

    /// Frictions in a plane that begin to slide from rest. Friction turns what is across its direction about as fast as it is slow: next to
    /// rest no step follows that.
    fn beginning(&self, pattern: &Pattern, speed: f64) -> impl Iterator<Item = &Grip> {
        self.sliding(pattern).filter(move |grip| grip.rows.len() > 1 && self.moving(grip, speed).is_none())
    }

    fn sliding(&self, pattern: &Pattern) -> impl Iterator<Item = &Grip> {
        self.grips.iter().filter(|grip| pattern.sliding.iter().any(|(number, _)| *number == grip.number))
    }

    /// A friction that is taken to be at rest although it moves: ending its motion, which is no more than an error by itself, would change the
    /// velocities of bodies by more than that. Two feet that are tied together hardly move against each other, however the machine turns
    /// on them. Of several the fastest; it moves from here on.
    pub fn lets_move(&mut self, pattern: &Pattern, of_rows: &DVector<f64>, speed: f64) -> bool {
        let slip = |grip: &Grip| norm(pair(&grip.rows, |row| self.rates[row] / self.sizes[row]));
        let holds = |grip: &&Grip| pattern.sticking.contains(&grip.number);
        let resting = self.grips.iter().filter(holds).chain(self.beginning(pattern, speed));
        let is_fast = |grip: &Grip| norm(pair(&grip.rows, |row| self.rates[row])) > self.unresolved_of(grip);
        let is_moving = |grip: &&Grip| !grip.fixed && slip(grip) > NO_SPEED * speed && is_fast(grip);
        let moving: Vec<&Grip> = resting.filter(is_moving).collect();
        let Some(fastest) = moving.iter().max_by(|a, b| slip(a).total_cmp(&slip(b))) else { return false };
        let number = fastest.number;
        let mut rates = DVector::zeros(self.rows.len());
        moving.iter().flat_map(|grip| &grip.rows).for_each(|row| rates[*row] = self.rates[*row]);
        let changed = self.changed_by(&self.impulses_to_rest(pattern, of_rows, speed, &rates));
        let is_moved = changed > MOVED * self.still * speed;
        if is_moved && let Some(grip) = self.grips.iter_mut().find(|grip| grip.number == number) {
            grip.moves = true;
        }
        is_moved
    }

    /// Whether something moves against the direction in which the pattern takes it to slide, where speeds are of this size: ending
    /// the motion of what closes may have turned it back.
    #[must_use]
    pub fn slides_back(&self, pattern: &Pattern, speed: f64) -> bool {
        pattern.sliding.iter().any(|(number, direction)| {
            let moving = self.grip(*number).and_then(|grip| self.moving(grip, speed));
            moving.is_some_and(|[x, y]| x * direction[0] + y * direction[1] < 0.0)
        })
    }
}
