//! [`Inverse`]: the forces and torques of named actuators that cause a prescribed motion.
//!
//! With positions, velocities and accelerations known (`driven.rs`), the balance of all bodies
//!
//! R(lambda, u) = Q(lambda, u) - M a - Phi_q^T lambda = 0
//!
//! is solved for the multipliers of independent rows of joints and the efforts u of the actuators by Newton's method with exact
//! derivatives: friction that follows reactions is in dR/dlambda. Z spans what dR/dlambda leaves out (its left null space, in
//! coordinates scaled by what bodies move), so that Z^T dR/du du = -Z^T R are as many equations as the scene has freedoms. Where
//! actuators are more than that, u is the one of least norm; where what is left lies in a direction that none of them moves, there is
//! no solution, and the direction is named. (Nakamura & Ghodoussi 1989, "Dynamics computation of closed-link robot mechanisms with
//! nonredundant and redundant actuators".)

mod actuators;
mod outputs;

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use crate::analysis::{Direction, Expansion, Freedom, Function};
use crate::driven::{Driven, cannot, seen};
use crate::linalg::SingularValues;
use crate::linear::Port;
use crate::moves;
use crate::prescribed::Motion;
use crate::results::significant;
use crate::scene::Dimension;
use crate::session::{Restart, Session, SessionError};
use actuators::{choose, effort_unit};
use outputs::Outputs;

/// Share of an actuator's own load, at full leverage, below which it moves nothing.
const RANK: f64 = 1e-9;
/// What round-off leaves of loads, as a share of those on a body, and of the largest on any.
const LOADS: f64 = 1e-12;
/// The same that passes where iterations gain nothing any more.
const PASSES: f64 = 1e-9;
const BESIDE: f64 = 1e-3;
/// Share of the loads beyond which a closed contact pulls.
const PULLS: f64 = 1e-9;
/// Newton steps where loads depend on reactions.
const ITERATIONS: usize = 40;

/// Efforts over time.
#[derive(Debug, Clone, Serialize)]
pub struct Inverse {
    /// s.
    pub times: Vec<f64>,
    /// The actuators, with their unit; the value is that at the end.
    pub actuators: Vec<Port>,
    /// Their efforts, actuator by actuator, in their units.
    pub efforts: Vec<Vec<f64>>,
    /// The outputs of the scene that a prescribed motion determines.
    pub outputs: Vec<Port>,
    /// Their values, output by output, in their units.
    pub values: Vec<Vec<f64>>,
    /// Degrees of freedom that the joints leave.
    pub freedoms: usize,
    /// Largest force or moment left on a body, as a share of the loads on it.
    pub balance: f64,
    /// What has to be known about it.
    pub notes: Vec<String>,
    /// The state at the first time, to run from.
    #[serde(skip)]
    pub start: Restart,
}

/// What gives the effort.
enum Actuator {
    /// An `[[input]]`, by its number.
    Input(usize),
    /// A force along a quantity: the place of its row behind those that are met.
    Along(usize),
}

/// A solution at one time.
struct Balanced {
    share: f64,
    freedoms: usize,
    rank: usize,
    /// Contacts that are closed, and whether any that touches would pull.
    touching: usize,
    left_out: bool,
}

struct Solver<'s> {
    driven: Driven<'s>,
    actuators: Vec<Actuator>,
    names: Vec<String>,
    /// SI efforts that count as one in the norm.
    weights: DVector<f64>,
}

impl Solver<'_> {
    /// The number of the row along which an effort acts.
    fn row_along(&self, place: usize) -> usize {
        let rows = &self.driven.rows;
        rows.local.rows()[rows.held + place]
    }

    fn effort(&self, k: usize) -> f64 {
        let layout = &self.driven.layout;
        match self.actuators[k] {
            Actuator::Input(input) => self.driven.inputs[layout.given_slot(input)],
            Actuator::Along(place) => -self.driven.inputs[layout.multiplier_slot() + self.row_along(place)],
        }
    }

    fn set_effort(&mut self, k: usize, value: f64) {
        let layout = &self.driven.layout;
        match self.actuators[k] {
            Actuator::Input(input) => self.driven.inputs[layout.given_slot(input)] = value,
            Actuator::Along(place) => {
                let slot = layout.multiplier_slot() + self.row_along(place);
                self.driven.inputs[slot] = -value;
            }
        }
    }

    /// What a unit of each effort puts on the bodies.
    fn loads(&self, e: &Expansion) -> DMatrix<f64> {
        let by_inputs = e.slope(Function::Balance, Direction::Inputs);
        let by_rows = e.slope(Function::Balance, Direction::Multipliers);
        let mut loads = DMatrix::zeros(by_rows.nrows(), self.actuators.len());
        for (k, actuator) in self.actuators.iter().enumerate() {
            match actuator {
                Actuator::Input(input) => loads.set_column(k, &by_inputs.column(*input)),
                Actuator::Along(place) => loads.set_column(k, &-by_rows.column(self.driven.rows.held + place)),
            }
        }
        loads
    }

    /// What is left on the bodies, as a share of the loads there; largest of all.
    fn left(&self, e: &Expansion) -> f64 {
        let residual = e.value(Function::Balance);
        let weigh = |vector: &DVector<f64>, body: usize| {
            (0..6).map(|k| (vector[6 * body + k] * e.scales[6 * body + k]).abs()).fold(0.0, f64::max)
        };
        let bodies = residual.len() / 6;
        let most = (0..bodies).map(|body| weigh(&e.sizes, body)).fold(f64::MIN_POSITIVE, f64::max);
        (0..bodies).map(|body| weigh(&residual, body) / (weigh(&e.sizes, body) + BESIDE * most)).fold(0.0, f64::max)
    }

    /// Multipliers and efforts that balance all bodies where they are. Contacts that touch push: one that would have to pull is left
    /// out, that which pulls most first. The rows of those that push stay in force.
    fn balance_with_contacts(&mut self) -> Result<Balanced, String> {
        let touching = self.driven.touching()?;
        let name = |contact: usize| self.driven.contact_name(contact);
        if let Some((contact, share)) = touching.passed {
            return Err(format!("the motion goes through `{}` by {share:.1e} of the scene's size", name(contact)));
        }
        if let Some(contact) = touching.struck {
            return Err(format!("the motion runs into `{}`: an impact takes an impulse, not an effort", name(contact)));
        }
        if let Some(contact) = touching.slips {
            return Err(format!(
                "the motion slides on `{}`, which holds without sliding while it is closed",
                name(contact)
            ));
        }
        let mut closed = touching.closed;
        let mut pulls: Vec<String> = Vec::new();
        let found = loop {
            self.driven.close(&closed);
            let found = self.balance();
            let pulling = if found.is_ok() { self.pulling(&closed)? } else { None };
            match pulling {
                Some(contact) => {
                    closed.retain(|one| *one != contact);
                    pulls.push(self.driven.contact_name(contact));
                }
                None => break found,
            }
        };
        match found {
            Ok(mut found) => {
                found.touching = closed.len();
                found.left_out = !pulls.is_empty();
                Ok(found)
            }
            Err(reason) if pulls.is_empty() => Err(reason),
            Err(reason) => Err(format!("`{}` would have to pull, and without it {reason}", pulls.join("`, `"))),
        }
    }

    /// The closed contact that pulls most.
    fn pulling(&mut self, closed: &[usize]) -> Result<Option<usize>, String> {
        if closed.is_empty() {
            return Ok(None);
        }
        let e = self.driven.acting()?;
        let (jacobian, size) = (e.jacobian(), e.sizes.amax());
        let pull = |contact: &usize| {
            let row = self.driven.equations.contacts[*contact].row;
            let place = self.driven.rows.local.rows().iter().position(|one| *one == row)?;
            let value = self.driven.inputs[self.driven.layout.multiplier_slot() + row] * jacobian.row(place).norm();
            (value > PULLS * size).then_some((*contact, value))
        };
        let worst = closed.iter().filter_map(pull).max_by(|a, b| a.1.total_cmp(&b.1));
        Ok(worst.map(|(contact, _)| contact))
    }

    /// Multipliers and efforts that balance all bodies with the rows in force.
    fn balance(&mut self) -> Result<Balanced, String> {
        let own = self.driven.rows.own;
        let mut last = f64::INFINITY;
        let mut unmoved: Option<String> = None;
        let (mut freedoms, mut rank) = (0, 0);
        for iteration in 0..ITERATIONS {
            let e = self.driven.acting()?;
            if e.value(Function::Balance).iter().any(|value| !value.is_finite()) {
                return Err("a load has no finite value".into());
            }
            let share = self.left(&e);
            if iteration > 0 && (share <= LOADS || share <= PASSES && share >= 0.5 * last) {
                return Ok(Balanced { share, freedoms, rank, touching: 0, left_out: false });
            }
            if iteration > 3
                && let Some(direction) = unmoved
            {
                return Err(format!("no actuator moves this: {direction}"));
            }
            last = share;
            unmoved = None;
            let n = e.mass.nrows();
            let mut rows = DMatrix::zeros(own + e.idle.nrows(), n);
            rows.rows_mut(0, own).copy_from(&e.jacobian().rows(0, own));
            rows.rows_mut(own, e.idle.nrows()).copy_from(&e.idle);
            let words = |error: crate::analysis::AnalysisError| error.to_string();
            let independent = Freedom::of(&rows, &e.scales).map_err(|error| words(error.into()))?.independent;
            if iteration == 0 {
                // Rows that follow from others take nothing.
                let first = self.driven.layout.multiplier_slot();
                for row in (0..own).filter(|row| !independent.contains(row)) {
                    self.driven.inputs[first + self.driven.rows.local.rows()[row]] = 0.0;
                }
            }
            // What multipliers put on the bodies, friction that follows them included; rows that mean nothing take any moment.
            let slopes = e.slope(Function::Balance, Direction::Multipliers);
            let mut held = DMatrix::zeros(independent.len(), n);
            for (k, row) in independent.iter().enumerate() {
                if *row < own {
                    held.set_row(k, &slopes.column(*row).transpose());
                } else {
                    held.set_row(k, &e.idle.row(*row - own));
                }
            }
            let space = Freedom::of(&held, &e.scales).map_err(|error| words(error.into()))?;
            if space.independent.len() < independent.len() {
                return Err("friction leaves the reactions undetermined".into());
            }
            freedoms = space.count();
            let loads = self.loads(&e);
            let residual = e.value(Function::Balance);
            let count = self.actuators.len();
            let efforts = DVector::from_fn(count, |k, _| self.effort(k));
            // Z^T B W x = Z^T (B u - R), u = W x of least norm.
            let moved = space.basis.transpose() * &loads;
            let wished = &moved * &efforts - space.basis.transpose() * &residual;
            let next = if count == 0 || freedoms == 0 {
                rank = 0;
                DVector::zeros(count)
            } else {
                let scaled = &moved * DMatrix::from_diagonal(&self.weights);
                let values = SingularValues::of(&scaled).ok_or("no singular values")?;
                // On what the actuators put on the bodies by themselves: at a dead point none of it moves anything.
                let strength = |k: usize| loads.column(k).component_mul(&e.scales).norm() * self.weights[k];
                let least = RANK * (0..count).map(strength).fold(0.0, f64::max);
                rank = values.rank(least);
                if rank < freedoms {
                    let moving = values.left().columns_range(..rank);
                    let rest = &wished - moving * moving.tr_mul(&wished);
                    unmoved = Some(self.driven.described(&(&space.basis * &rest), &e.scales));
                }
                values.solve(&wished, least).component_mul(&self.weights)
            };
            if freedoms > 0 && rank == 0 {
                unmoved = Some(self.driven.described(&(&space.basis * &wished), &e.scales));
            }
            let change = &next - &efforts;
            (0..count).for_each(|k| self.set_effort(k, next[k]));
            let taken = space.lift.transpose() * -(residual + loads * change);
            let first = self.driven.layout.multiplier_slot();
            for (k, row) in independent.iter().enumerate().filter(|(_, row)| **row < own) {
                self.driven.inputs[first + self.driven.rows.local.rows()[*row]] += taken[k];
            }
        }
        Err(match unmoved {
            Some(direction) => format!("no actuator moves this: {direction}"),
            None => format!("reactions and friction find no balance: {last:.1e} of the loads are left"),
        })
    }
}

/// The efforts that a motion needs, at its rows or at other times within them.
///
/// `by` names the actuators: `[[input]]`s, or quantities along which an effort acts; all inputs where it is `None`, and where there are
/// none, the prescribed quantities themselves.
///
/// # Errors
/// Elements with a memory that changes between steps; a motion that joints do not allow, that leaves something free, goes through a
/// contact, runs into one or would need it to pull; a freedom that no actuator moves.
pub fn inverse(
    session: &Session,
    motion: &Motion,
    by: Option<&[String]>,
    times: Option<&[f64]>,
    progress: &mut dyn FnMut(f64),
) -> Result<Inverse, SessionError> {
    let mut notes = Vec::new();
    let (chosen, along) = choose(session, motion, by, &mut notes)?;
    let driven = Driven::new(session, &motion.wanted, &along, ("inverse dynamics", true))?;
    if let Some(input) = chosen.iter().flatten().find(|input| driven.states_follow(**input)) {
        let message = format!(
            "the actuator `{}` acts by way of a state of an element: what it has to be depends on what it was",
            session.model.inputs[*input].name
        );
        let help =
            "ask for the effort itself: `--by` names a coordinate along which it acts, and a controller follows that";
        return Err(cannot(session, message, help));
    }
    if let Some(open) = session.plan.undetermined.iter().find(|one| one.load) {
        let message = format!(
            "the load of `{}` depends on a reaction that redundant joints leave undetermined, and so do the efforts",
            session.model.elements[open.element].name
        );
        return Err(cannot(session, message, "`odyn check` names the redundant rows: take joints with fewer"));
    }
    let length = driven.length;
    let (mut ports, mut actuators, mut weights) = (Vec::new(), Vec::new(), Vec::new());
    let mut rest = along.iter();
    let mut place = 0;
    let mut plain = false;
    for input in chosen {
        let (name, unit, factor, dimension) = if let Some(input) = input {
            actuators.push(Actuator::Input(input));
            let signal = &session.model.inputs[input];
            (signal.name.clone(), signal.unit.clone(), signal.factor, signal.dimension)
        } else {
            let Some(wanted) = rest.next() else { continue };
            actuators.push(Actuator::Along(place));
            place += 1;
            let (unit, factor, dimension) = effort_unit(session, wanted);
            (format!("{}.effort", wanted.name), unit, factor, dimension)
        };
        weights.push(match dimension {
            Dimension::FORCE => 1.0,
            Dimension::TORQUE => length,
            _ => {
                plain = true;
                factor
            }
        });
        ports.push(Port { name, unit, factor, value: 0.0 });
    }
    let names = ports.iter().map(|port| port.name.clone()).collect();
    let mut solver = Solver { driven, actuators, names, weights: DVector::from_vec(weights) };
    let own_times: Vec<f64> = times.map_or_else(|| motion.times.clone(), <[f64]>::to_vec);
    let span = [motion.times[0], motion.times[motion.times.len() - 1]];
    if let Some(time) = own_times.iter().find(|time| !(span[0]..=span[1]).contains(*time)) {
        let message = format!("the motion is prescribed from {} s to {} s, not at {time} s", span[0], span[1]);
        return Err(cannot(session, message, "give rows for that time, or other times"));
    }
    let mut watch =
        Outputs::new(&solver.driven, solver.actuators.iter().any(|one| matches!(one, Actuator::Along(_))), &mut notes);
    let first = motion.at(own_times[0]);
    let at = |time: f64, reason: &str| {
        let help = "see `odyn check` for what the joints leave free; `--by` names other actuators";
        cannot(session, format!("at t = {} s: {reason}", significant(time, 7)), help)
    };
    solver.driven.begin(own_times[0], &first).map_err(|reason| at(own_times[0], &reason))?;
    if let Some(motion) = solver.driven.free().map_err(|reason| at(own_times[0], &reason))? {
        let message = format!("joints and prescribed quantities leave this free: {motion}");
        return Err(cannot(session, message, "prescribe it, too, or take a joint that holds it"));
    }
    let mut found = Inverse {
        times: own_times.clone(),
        efforts: vec![Vec::with_capacity(own_times.len()); ports.len()],
        actuators: ports,
        outputs: watch.ports.clone(),
        values: vec![Vec::with_capacity(own_times.len()); watch.ports.len()],
        freedoms: 0,
        balance: 0.0,
        notes: Vec::new(),
        start: moves::restart(session, &solver.driven.inputs),
    };
    let (mut still, mut spare, mut left_out) = (None, 0, false);
    let mut touched: Option<[usize; 2]> = None;
    for (number, time) in own_times.iter().enumerate() {
        progress(number as f64 / own_times.len() as f64);
        let mut look = |solver: &mut Solver<'_>| {
            let balanced = solver.balance_with_contacts()?;
            found.balance = found.balance.max(balanced.share);
            found.freedoms = found.freedoms.max(balanced.freedoms);
            spare = spare.max(solver.actuators.len() - balanced.rank);
            left_out |= balanced.left_out;
            let [least, most] = touched.unwrap_or([balanced.touching; 2]);
            touched = Some([least.min(balanced.touching), most.max(balanced.touching)]);
            if still.is_none() && solver.driven.still.contains(&true) {
                still = Some(*time);
            }
            let efforts = (0..found.actuators.len()).map(|k| solver.effort(k)).collect::<Vec<_>>();
            Ok([efforts, watch.at(&solver.driven)?].concat())
        };
        let seen: Result<Vec<f64>, String> = if number == 0 {
            look(&mut solver)
        } else {
            solver.driven.close_those_it_leans_on();
            seen(&mut solver, &|solver| &mut solver.driven, (*time, &|time| motion.at(time)), &mut look)
        };
        let seen = seen.map_err(|reason| at(solver.driven.time(), &reason))?;
        let (efforts, outputs) = seen.split_at(found.actuators.len());
        for ((port, column), effort) in found.actuators.iter_mut().zip(&mut found.efforts).zip(efforts) {
            port.value = effort / port.factor;
            column.push(port.value);
        }
        for ((port, column), value) in found.outputs.iter_mut().zip(&mut found.values).zip(outputs) {
            port.value = *value;
            column.push(*value);
        }
    }
    if spare > 0 {
        notes.push(format!(
            "{} actuators ({}) for {} freedoms: of all efforts that cause this motion, these have the least sum of squares, forces in N \
             and torques in N m divided by the scene's size ({length:.4} m){}",
            solver.actuators.len(),
            solver.names.join(", "),
            found.freedoms,
            if plain { ", other signals in their own units" } else { "" }
        ));
    }
    solver.driven.say(touched, &mut notes);
    if spare > 0 && left_out {
        notes.push("contacts that would have to pull are open: the least sum is that of what is left".into());
    }
    if let Some(time) = still {
        notes.push(format!(
            "friction that could stick takes no load where nothing slides (first at t = {time} s): there efforts may differ by as much as it holds"
        ));
    }
    if !session.plan.redundant_rows.is_empty() {
        notes.push(
            "rows of joints are redundant: efforts are unique, reactions that are not share loads as they come".into(),
        );
    }
    found.notes = notes;
    Ok(found)
}
