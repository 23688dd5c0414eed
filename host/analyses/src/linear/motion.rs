//! How a scene moves where it is linearised, and what the user has to know about that place.

use nalgebra::DVector;

use super::steady::{self, Axes};
use super::{Linear, NO_ACCELERATION};
use crate::analysis::{Direction, Evaluator, Function, Local};
use crate::model::Model;
use crate::moves::restart;
use crate::plan::Layout;
use crate::program::{Equations, Expr, Node};
use crate::round_off::ROUND_OFF;
use crate::scene::Dimension;
use crate::session::{Instant, Run, Session};

/// Velocities below this, in lengths of the scene and radians per second, are none.
const NO_VELOCITY: f64 = 1e-12;
/// Distance below which a contact touches, as a share of the scene's size.
const TOUCHES: f64 = 1e-9;

impl Linear {
    /// The model in axes in which it changes least, with what is to be said of its motion in axes of the ground.
    pub(super) fn stay(&mut self, axes: Axes, in_ground_axes: Vec<String>) {
        self.unsteadiness = axes.unsteadiness;
        if let Some(turned) = axes.turned {
            (self.a, self.turning) = (turned, axes.turning);
            self.drop_round_off();
            let turning: [f64; 3] = axes.turning.map(|part| format!("{part:.5e}").parse().unwrap_or(part)).into();
            self.notes.push(format!(
                "the scene turns steadily: states are seen in axes that turn with {turning:?} rad/s, in which the coefficients stay the \
                 same; those of inputs and outputs do where these turn with it, or do not depend on how it stands"
            ));
            return;
        }
        self.spectrum = axes.of_ground;
        self.notes.extend(in_ground_axes);
        if !self.at_rest && self.unsteadiness == 0.0 {
            self.notes.push("the coefficients stay the same along the motion, in axes of the ground".into());
        } else if self.unsteadiness.is_infinite() {
            self.notes.push(
                "whether the coefficients change along the motion is not known: no later instant could be compared (a run from here \
                 does not get there in the steps that it may take, or contacts switch before); they are those of this instant"
                    .into(),
            );
        } else if self.unsteadiness > 0.0 {
            self.notes.push(format!(
                "the coefficients change along the motion, by up to {:.1e} while a mode turns by a radian; they are those of this instant",
                self.unsteadiness
            ));
        }
    }

    /// What is to be said where the scene is not at rest.
    pub(super) fn motion(&mut self, session: &Session, instant: &Instant, local: &Local) -> Vec<String> {
        let layout = &session.plan.layout;
        let length = session.assembly.scales.length;
        let mut fastest = (0.0_f64, String::new());
        let mut quickest = (0.0_f64, 0.0_f64, String::new());
        let stiff = self.expansion.slope(Function::Balance, Direction::Positions).abs() * &self.expansion.scales;
        for (index, body) in session.model.bodies.iter().enumerate() {
            let norm = |slot: usize| (0..3).map(|k| instant.inputs[slot + k].powi(2)).sum::<f64>().sqrt();
            let speed = norm(layout.body_slot(index, 7)).max(length * norm(layout.body_slot(index, 10)));
            if speed > fastest.0 {
                fastest = (speed, body.name.clone());
            }
            let at = layout.acceleration_slot() + 6 * index;
            let acceleration = norm(at).max(length * norm(at + 3));
            let [alone, displaced] =
                [&self.expansion.sizes, &stiff].map(|sizes| alone(sizes, &session.model, length, index));
            let none = NO_ACCELERATION * alone + ROUND_OFF * length * displaced;
            if acceleration > none && acceleration > quickest.0 {
                quickest = (acceleration, acceleration / alone, body.name.clone());
            }
        }
        let moves = fastest.0 > NO_VELOCITY * length;
        let changing = self.changing_states(session, instant, local);
        self.at_rest = !moves && quickest.0 == 0.0 && changing.is_empty();
        let mut notes = Vec::new();
        if quickest.0 > 0.0 {
            notes.push(format!(
                "not an equilibrium: `{}` accelerates by {:.3e} m/s^2 (rotations on the size of the scene, {length:.3} m), {:.1e} of \
                 what its loads alone would give; the linearisation is frozen at this instant",
                quickest.2, quickest.0, quickest.1
            ));
        }
        if moves {
            notes.push(format!("the scene moves (`{}` with {:.3e} m/s)", fastest.1, fastest.0));
        }
        if !changing.is_empty() {
            notes.push(format!(
                "not at rest: states of {} still change; the linearisation is frozen at this instant",
                changing.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
            ));
        }
        notes
    }

    /// The elements whose states change by more than round-off of what their rates are made of.
    fn changing_states(&self, session: &Session, instant: &Instant, local: &Local) -> Vec<String> {
        let layout = &session.plan.layout;
        let rates = self.expansion.value(Function::States);
        let by_states = self.expansion.slope(Function::States, Direction::States);
        let slope = |along: Direction| self.expansion.slope(Function::States, along).abs();
        let count = rates.len();
        let fastest = (0..count).map(|k| by_states[(k, k)].abs()).fold(0.0, f64::max);
        let per_time = if fastest > 0.0 { fastest } else { 1.0 };
        // What places and velocities of the size of the scene would do, what loads would give bodies alone, and reactions as they are.
        let length = session.assembly.scales.length;
        let alone: Vec<f64> = (0..session.model.bodies.len())
            .map(|body| alone(&self.expansion.sizes, &session.model, length, body))
            .collect();
        let accelerations =
            DVector::from_fn(6 * alone.len(), |k, _| alone[k / 6] / if k % 6 < 3 { 1.0 } else { length });
        let first = layout.multiplier_slot();
        let multipliers = local.rows().iter().map(|row| instant.inputs[first + row].abs());
        let multipliers = DVector::from_iterator(local.rows().len(), multipliers);
        let moved = &self.expansion.scales * length;
        let by_motion = slope(Direction::Positions) * &moved
            + slope(Direction::Velocities) * &moved * per_time
            + slope(Direction::Accelerations) * accelerations
            + slope(Direction::Multipliers) * multipliers;
        // States that are zero are as large as what they follow would be.
        let mut sizes: Vec<f64> =
            (0..count).map(|k| instant.inputs[layout.state_slot() + local.states()[k]].abs()).collect();
        let terms = |sizes: &[f64], k: usize| -> f64 {
            by_motion[k] + (0..count).map(|other| by_states[(k, other)].abs() * sizes[other]).sum::<f64>()
        };
        for k in (0..count).chain(0..count) {
            let own = by_states[(k, k)].abs();
            if own > 0.0 {
                sizes[k] = sizes[k].max(terms(&sizes, k) / own);
            }
        }
        let mut names: Vec<String> = Vec::new();
        for (k, rate) in rates.iter().enumerate() {
            let name = &session.model.elements[layout.element_of_state(local.states()[k])].name;
            if rate.abs() > NO_ACCELERATION * terms(&sizes, k) && !names.contains(name) {
                names.push(name.clone());
            }
        }
        names
    }

    /// The scene at later times, for one after the other: where a run from here takes it; where it is at rest, and stays so, with the loads
    /// of these times. `None` where nothing changes.
    pub(super) fn ahead<'s>(&self, session: &'s Session, instant: &'s Instant) -> Option<Box<steady::Later<'s>>> {
        let state = |time: f64| {
            let mut state = restart(session, &instant.inputs);
            state.time = time;
            let name = |element: &usize| session.model.elements[*element].name.clone();
            state.released = instant.released.iter().map(name).collect();
            state
        };
        if self.at_rest {
            let equations = &session.equations;
            let driven = equations.enforced().any(|row| !equations.graph.is_zero(equations.rows[row].time));
            if driven || !loads_depend_on_time(equations) {
                return None;
            }
            return Some(Box::new(move |time, _| {
                let at = instant.time + time;
                session.moving_on(state(at), at + time).ok()?.instant().ok()
            }));
        }
        let mut run: Option<Run<'static>> = None;
        Some(Box::new(move |time, last| {
            let to = instant.time + time;
            if run.is_none() {
                run = Some(session.moving_on(state(instant.time), instant.time + last).ok()?);
            }
            let run = run.as_mut()?;
            run.advance(to / session.scene.units.factor(Dimension::TIME)).ok()?;
            run.instant().ok()
        }))
    }

    /// What else the user has to know about where this was done.
    pub(super) fn say(&mut self, session: &Session, instant: &Instant, local: &Local) {
        let (layout, equations) = (&session.plan.layout, &session.equations);
        if equations.enforced().any(|row| !equations.graph.is_zero(equations.rows[row].time)) {
            let how = if !self.at_rest {
                "goes on"
            } else {
                "stands still, and what it causes (centrifugal and gyroscopic forces) is left out"
            };
            self.notes.push(format!("joints are driven: their prescribed motion {how}"));
        }
        if self.at_rest && loads_depend_on_time(equations) {
            self.notes.push("loads depend on time: they are those of this instant".into());
        }
        for one in &equations.releases {
            let state = if instant.released.contains(&one.element) { "has let go" } else { "is taken to hold" };
            self.notes.push(format!("`{}` may be released: it {state}", session.model.elements[one.element].name));
        }
        let gaps: Vec<Node> = equations.contacts.iter().map(|contact| equations.rows[contact.row].value).collect();
        let mut gaps = Evaluator::new(&equations.graph, &gaps);
        let gaps = gaps.run(&instant.inputs, &session.model.sets).unwrap_or(&[]);
        for (number, contact) in equations.contacts.iter().enumerate() {
            let (element, k) = layout.element_of_row(contact.row);
            let name = session.model.elements[element].row_name(k);
            let touches = !contact.of_velocities
                && gaps.get(number).is_some_and(|gap| gap.abs() <= TOUCHES * session.assembly.scales.length);
            let state = match instant.closed.contains(&number) {
                true => "closed: it is taken to hold",
                false if touches => "open: it touches, and nothing presses it",
                false => "open",
            };
            self.notes.push(format!("the contact `{name}` is {state}"));
        }
        if local.has_branches() {
            self.notes.push(
                "some equations have branches (friction, stops, tables): linearised in the branch in force".into(),
            );
        }
        if layout.given_at > 0 {
            self.notes.push("element states that change only between steps are held".into());
        }
        if !session.plan.redundant_rows.is_empty() && !self.outputs.is_empty() {
            self.notes.push(
                "some rows are redundant: outputs that show reactions which are not unique share them as they come"
                    .into(),
            );
        }
    }
}

/// Whether loads or rates of states are given functions of time.
fn loads_depend_on_time(equations: &Equations) -> bool {
    let graph = &equations.graph;
    let loads: Vec<Node> = equations.loads.iter().chain(&equations.state_rates).copied().collect();
    let of_time = |node: &Node| matches!(graph.expr(*node), Expr::Input(slot) if slot as usize == Layout::TIME);
    graph.live(&loads).iter().any(of_time)
}

/// The acceleration that loads of these sizes would give a body alone, m/s^2, rotations on the size of the scene.
fn alone(sizes: &DVector<f64>, model: &Model, length: f64, index: usize) -> f64 {
    let body = &model.bodies[index];
    let moment = body.inertia.trace().max(f64::MIN_POSITIVE) / 3.0;
    (sizes.fixed_rows::<3>(6 * index).norm() / body.mass)
        .max(length * sizes.fixed_rows::<3>(6 * index + 3).norm() / moment)
}
