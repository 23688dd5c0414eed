//! [`Motion`]: a mechanism in some coordinates, at some state. What it asks of the engines that solve for it is [`Engines`];
//! everything else is here, in [`super::newton`] and in [`super::passage`], for all coordinates alike.

use std::sync::Arc;

use super::formulation::{AnalysisError, Counters, Group};
use super::passage::Passage;
use crate::linalg::Health;
use crate::plan::{Coordinates, Layout, Measure};

/// Share of the rank-safe engine's pivot ratio at the start below which nothing is solved, but interpolated: see
/// [`Passage`].
pub(super) const NEAR_SINGULAR: f64 = 0.03;
/// Share of the smallest singular value at the start below which stages are brought to the constraints before they are
/// evaluated. Two reasons, both about states off the constraints, where the stages of a method are by its local error. At a
/// singular position the acceleration there has a pole, (offset) / (distance), which a method would approach with ever
/// smaller steps. And redundant rows contradict each other there, so that it makes a difference which of them are solved.
/// On the constraints neither is the case.
pub(super) const APPROACH: f64 = 0.5;
/// Share of the scene's size by which the stages of a step may be off the constraints where their rows seem dependent.
const FAR_OFF: f64 = 1e-2;
/// A plain pivot ratio below which nothing is left but round-off.
pub(super) const SICK_TREE: f64 = 1e-12;

/// See the module documentation.
pub(super) struct Motion {
    pub(super) layout: Layout,
    pub(super) coordinates: Coordinates,
    /// What each entry of the state is.
    pub(super) groups: Vec<Group>,
    /// Of the scene, m.
    pub(super) length: f64,
    /// Joint and row of every row.
    pub(super) row_names: Arc<[String]>,
    /// The inputs of programs.
    pub(super) inputs: Vec<f64>,
    /// By velocity: accelerations, or the correction of positions or velocities that was solved for last.
    pub(super) accelerations: Vec<f64>,
    /// Rates of the element states, then the power.
    pub(super) rates: Vec<f64>,
    /// Take the step under way with care, see [`APPROACH`].
    pub(super) careful: bool,
    /// Violations of positions beyond this share of the scene's size are not corrected, see [`super::Formulation::bound_corrections`].
    pub(super) most_off: f64,
    /// Whether the correction solved last went through the rank-safe engine.
    pub(super) corrected_safely: bool,
    /// Rank and pivot ratio of the rank-safe engine at the start.
    pub(super) at_start: Health,
    /// The same as it was planned.
    planned: Health,
    pub(super) passage: Passage,
    pub(super) counters: Counters,
}

/// Which engine solved.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Used {
    Regular,
    Safe,
}

/// How independent the regular engine's rows are, whatever the masses; squared.
pub(super) struct Independence {
    pub(super) now: f64,
    pub(super) at_start: f64,
}

/// Coordinates with the engines that solve for them: a regular one for independent rows, and a rank-safe one for all.
pub(super) trait Engines {
    fn motion(&self) -> &Motion;
    fn motion_mut(&mut self) -> &mut Motion;
    /// Number of rows of the rank-safe engine.
    fn rows(&self) -> usize;
    /// Where the rank-safe engine factored last.
    fn safe_health(&self) -> Health;
    /// Accelerations, rates of states and power at the inputs' state.
    ///
    /// # Errors
    /// See [`AnalysisError`].
    fn solve_dynamics(&mut self) -> Result<Used, AnalysisError>;
    /// Prepares for corrections of a state that is taken with care.
    ///
    /// # Errors
    /// See [`AnalysisError`].
    fn before_corrections(&mut self) -> Result<(), AnalysisError> {
        Ok(())
    }
    /// Finds the smallest move (in the metric of the mass) that meets the rows to first order. Gives the worst violation, m, and its
    /// row. Unless `finely`, violations that are round-off are left alone.
    ///
    /// # Errors
    /// See [`AnalysisError`].
    fn correct_positions(&mut self, finely: bool) -> Result<(f64, Option<usize>), AnalysisError>;
    /// Finds the smallest change of velocities that meets the rows.
    ///
    /// # Errors
    /// See [`AnalysisError`].
    fn correct_velocities(&mut self) -> Result<(), AnalysisError>;
    /// Evaluates all rows at the inputs' position and factors them by the rank-safe engine; `anew` with as many of them as are
    /// independent there.
    ///
    /// # Errors
    /// See [`AnalysisError`].
    fn factor_safely(&mut self, anew: bool) -> Result<Health, AnalysisError>;
    /// The most rows that the rank-safe engine takes from now on.
    fn limit_rank(&mut self, rank: usize);
    /// How independent the rows of the regular engine are at the inputs' position, before a step; `None` where there is no such
    /// engine.
    ///
    /// # Errors
    /// See [`AnalysisError`].
    fn independence(&mut self, was_careful: bool) -> Result<Option<Independence>, AnalysisError>;
    /// Takes that as the measure of sound rows from now on, if all rows are in use.
    fn accept_independence(&mut self, now: f64) -> bool;
    /// The largest violation of all rows on positions at the inputs' position, m, and its row.
    ///
    /// # Errors
    /// See [`AnalysisError`].
    fn worst_violation(&mut self) -> Result<(f64, Option<usize>), AnalysisError>;
    /// The rows that depend on time at the inputs' position and time, each with its share of what the smallest velocities that meet
    /// all rows take: next to a singular position, its share of what is asked for there and cannot be had.
    ///
    /// # Errors
    /// See [`AnalysisError`].
    fn asked_by_time(&mut self) -> Result<Vec<(usize, f64)>, AnalysisError>;
    /// Puts accelerations and the rate of the work into the equations at the inputs' state.
    ///
    /// # Errors
    /// [`AnalysisError::Uncertified`] where they do not hold.
    fn try_motion(&mut self, accelerations: &[f64], power: f64) -> Result<(), AnalysisError>;

    /// Refuses to solve with care where the rows in use seem dependent only because a step under error control went far off the
    /// constraints: a shorter one costs less.
    ///
    /// # Errors
    /// [`AnalysisError::LeftConstraints`].
    fn refuse_far_off(&mut self) -> Result<(), AnalysisError> {
        let most = FAR_OFF.max(self.motion().most_off) * self.motion().length;
        let (worst, row) = self.worst_violation()?;
        if worst <= most {
            return Ok(());
        }
        let what = self.motion().row_name(row);
        Err(AnalysisError::LeftConstraints { what, violation: worst / self.motion().length })
    }

    /// Whether the constraints themselves (not only the regular engine's choice of rows) have lost rank, or nearly so, where the
    /// rank-safe engine factored last.
    fn is_singular(&self, share: f64) -> bool {
        let (health, at_start) = (self.safe_health(), self.motion().at_start);
        health.rank < at_start.rank || health.smallest_pivot_ratio < share * at_start.smallest_pivot_ratio
    }
}

impl Motion {
    /// `at_start`: of the rank-safe engine as it was planned.
    pub(super) fn new(
        layout: &Layout,
        coordinates: Coordinates,
        length: f64,
        row_names: Arc<[String]>,
        at_start: Health,
    ) -> Self {
        let dim = coordinates.motion + layout.states + 1;
        Self {
            groups: groups(&coordinates, layout),
            length,
            row_names,
            inputs: vec![0.0; coordinates.input_count],
            accelerations: vec![0.0; coordinates.columns],
            rates: vec![0.0; layout.states + 1],
            careful: false,
            most_off: f64::INFINITY,
            corrected_safely: false,
            at_start,
            planned: at_start,
            passage: Passage::new(dim, dim.max(coordinates.columns + layout.rows)),
            counters: Counters::default(),
            layout: layout.clone(),
            coordinates,
        }
    }

    /// As at the start.
    pub(super) fn forget(&mut self) {
        self.at_start = self.planned;
        (self.careful, self.corrected_safely) = (false, false);
    }

    /// Writes time and state into the inputs of programs.
    pub(super) fn load(&mut self, t: f64, state: &[f64]) {
        self.inputs[Layout::TIME] = t;
        for (range, slot) in &self.coordinates.inputs {
            self.inputs[*slot..slot + range.len()].copy_from_slice(&state[range.clone()]);
        }
        if self.layout.states > 0 {
            let (slot, from) = (self.layout.state_slot(), self.coordinates.motion);
            self.inputs[slot..slot + self.layout.states].copy_from_slice(&state[from..from + self.layout.states]);
        }
    }

    /// Writes accelerations and multipliers into the inputs of programs. Of all rows of the rank-safe engine, those that are not in
    /// use have none.
    pub(super) fn publish(&mut self, all: &[usize], rows: &[usize], multipliers: &[f64]) {
        let slot = self.coordinates.acceleration_slot;
        self.inputs[slot..slot + self.accelerations.len()].copy_from_slice(&self.accelerations);
        let slot = self.layout.multiplier_slot();
        all.iter().for_each(|row| self.inputs[slot + row] = 0.0);
        for (row, value) in rows.iter().zip(multipliers) {
            self.inputs[slot + row] = *value;
        }
    }

    /// The rates of a state with the accelerations solved for.
    pub(super) fn write_rates(&self, state: &[f64], rates: &mut [f64]) {
        for line in &self.coordinates.lines {
            rates[line.position] = state[line.velocity];
            rates[line.velocity] = self.accelerations[line.column];
        }
        for rotation in &self.coordinates.rotations {
            let w = [0, 1, 2].map(|k| state[rotation.velocity + k]);
            let turn = parameter_rates(parameters(state, rotation.position), w);
            rates[rotation.position..rotation.position + 4].copy_from_slice(&turn);
            let spin = &self.accelerations[rotation.column..rotation.column + 3];
            rates[rotation.velocity..rotation.velocity + 3].copy_from_slice(spin);
        }
        rates[self.coordinates.motion..].copy_from_slice(&self.rates);
    }

    /// The accelerations among the rates of a state.
    pub(super) fn accelerations_of(&self, rates: &[f64]) -> Vec<f64> {
        let mut accelerations = vec![0.0; self.coordinates.columns];
        for line in &self.coordinates.lines {
            accelerations[line.column] = rates[line.velocity];
        }
        for rotation in &self.coordinates.rotations {
            let spin = &rates[rotation.velocity..rotation.velocity + 3];
            accelerations[rotation.column..rotation.column + 3].copy_from_slice(spin);
        }
        accelerations
    }

    /// The velocities among the inputs, by column.
    pub(super) fn velocities(&self) -> Vec<f64> {
        self.coordinates.velocity_slots.iter().map(|slot| self.inputs[*slot]).collect()
    }

    /// Brings Euler parameters to length 1.
    pub(super) fn normalise(&self, state: &mut [f64]) {
        for rotation in &self.coordinates.rotations {
            normalise(&mut state[rotation.position..rotation.position + 4]);
        }
    }

    /// Largest rate of the positions, in radians or lengths of the scene, 1/s.
    pub(super) fn fastest(&self, state: &[f64]) -> f64 {
        let scale = |measure: Measure| if measure == Measure::Length { self.length } else { 1.0 };
        let lines = self.coordinates.lines.iter().map(|line| state[line.velocity].abs() / scale(line.measure));
        let spins = self.coordinates.rotations.iter().flat_map(|rotation| (0..3).map(|k| rotation.velocity + k));
        lines.chain(spins.map(|at| state[at].abs())).fold(0.0, f64::max)
    }

    /// The state after a time, s, in which nothing moves by more than 1e-8 radians or lengths of the scene, with the accelerations
    /// solved for; with that time. `None` where nothing moves nor is accelerated.
    pub(super) fn shortly_after(&self, state: &[f64]) -> Option<(Vec<f64>, f64)> {
        let mut rates = vec![0.0; state.len()];
        self.write_rates(state, &mut rates);
        // What is at rest may take its own time: velocities are linear in those of the coordinates.
        let frequency = (self.fastest(state) * 1e8).max(self.fastest(&rates).sqrt());
        let duration = 1.0 / frequency;
        let mut moved = state.to_vec();
        self.shift(state, duration, &mut moved);
        let lines = self.coordinates.lines.iter().map(|line| line.velocity);
        let spins = self.coordinates.rotations.iter().flat_map(|rotation| rotation.velocity..rotation.velocity + 3);
        lines.chain(spins).for_each(|at| moved[at] += duration * rates[at]);
        duration.is_finite().then_some((moved, duration))
    }

    /// `moved := (q + s q', v)`
    pub(super) fn shift(&self, state: &[f64], s: f64, moved: &mut [f64]) {
        moved.copy_from_slice(state);
        for line in &self.coordinates.lines {
            moved[line.position] += s * state[line.velocity];
        }
        for rotation in &self.coordinates.rotations {
            let d = [0, 1, 2].map(|k| s * state[rotation.velocity + k]);
            turn(&mut moved[rotation.position..rotation.position + 4], d);
        }
    }

    /// Moves positions along the correction solved for; gives its size, m.
    pub(super) fn move_along(&self, state: &mut [f64]) -> f64 {
        let mut size = 0.0_f64;
        for line in &self.coordinates.lines {
            let step = self.accelerations[line.column];
            state[line.position] += step;
            let scale = if line.measure == Measure::Length { 1.0 } else { self.length };
            size = size.max(step.abs() * scale);
        }
        for rotation in &self.coordinates.rotations {
            let d = [0, 1, 2].map(|k| self.accelerations[rotation.column + k]);
            turn(&mut state[rotation.position..rotation.position + 4], d);
            size = d.iter().fold(size, |size, step| size.max(step.abs() * self.length));
        }
        size
    }

    /// Adds the correction solved for to the velocities.
    pub(super) fn change_velocities(&self, state: &mut [f64]) {
        for line in &self.coordinates.lines {
            state[line.velocity] += self.accelerations[line.column];
        }
        for rotation in &self.coordinates.rotations {
            for k in 0..3 {
                state[rotation.velocity + k] += self.accelerations[rotation.column + k];
            }
        }
    }

    /// Joint and row.
    pub(super) fn row_name(&self, row: Option<usize>) -> String {
        row.and_then(|row| self.row_names.get(row)).cloned().unwrap_or_default()
    }
}

/// Prepares for a step from an accepted state, see [`super::Formulation::next_step`].
///
/// # Errors
/// See [`AnalysisError`].
pub(super) fn next_step<F: Engines>(form: &mut F, t: f64, state: &[f64]) -> Result<(), AnalysisError> {
    if form.rows() == 0 {
        return Ok(());
    }
    form.motion_mut().load(t, state);
    let was_careful = std::mem::take(&mut form.motion_mut().careful);
    let found = form.independence(was_careful)?;
    let careful = match &found {
        Some(Independence { now, at_start }) => *now < APPROACH * APPROACH * at_start,
        None => form.rows() > form.motion().at_start.rank,
    };
    form.motion_mut().careful = careful;
    if !careful {
        return Ok(());
    }
    // On the constraints the rank is what it is; a scene that starts in a singular position may gain some.
    let found_rank = form.factor_safely(true)?.rank;
    let rank = form.motion().at_start.rank.max(found_rank);
    form.motion_mut().at_start.rank = rank;
    form.limit_rank(rank);
    let now = found.map_or(0.0, |found| found.now);
    if !form.is_singular(APPROACH) && now > SICK_TREE && form.accept_independence(now) {
        // All rows are in use and independent: their order in the regular engine is to blame.
        form.motion_mut().careful = false;
    }
    Ok(())
}

/// The rows that depend on time, with their shares of `multipliers . times`.
pub(super) fn shares_of_time(rows: &[usize], times: &[f64], multipliers: &[f64]) -> Vec<(usize, f64)> {
    let products = times.iter().zip(multipliers).map(|(time, multiplier)| (time * multiplier).abs());
    let sum: f64 = products.clone().sum();
    let driven = rows.iter().zip(times).zip(products).filter(|((_, time), _)| **time != 0.0);
    driven.map(|((row, _), product)| (*row, if sum > 0.0 { product / sum } else { 0.0 })).collect()
}

fn groups(coordinates: &Coordinates, layout: &Layout) -> Vec<Group> {
    let mut groups = vec![Group::Parameter; coordinates.motion];
    for line in &coordinates.lines {
        let (position, velocity) = match line.measure {
            Measure::Length => (Group::Position, Group::Velocity),
            Measure::Angle => (Group::Parameter, Group::AngularVelocity),
        };
        groups[line.position] = position;
        groups[line.velocity] = velocity;
    }
    for rotation in &coordinates.rotations {
        groups[rotation.velocity..rotation.velocity + 3].fill(Group::AngularVelocity);
    }
    groups.extend(std::iter::repeat_n(Group::State, layout.states));
    groups.push(Group::Work);
    groups
}

fn parameters(state: &[f64], at: usize) -> [f64; 4] {
    [0, 1, 2, 3].map(|k| state[at + k])
}

/// Turns Euler parameters by a small rotation in the axes of what turns: p + G^T dpi' / 2, normalised (Haug 1989, eq. 9.3.33).
fn turn(p: &mut [f64], d: [f64; 3]) {
    let rate = parameter_rates(parameters(p, 0), d);
    p.iter_mut().zip(rate).for_each(|(e, step)| *e += step);
    normalise(p);
}

/// Moves a body's (r, p).
pub(super) fn move_body(pose: &mut [f64], d: &[f64]) {
    let (r, p) = pose.split_at_mut(3);
    r.iter_mut().zip(d).for_each(|(x, step)| *x += step);
    turn(&mut p[..4], [d[3], d[4], d[5]]);
}

pub(super) fn normalise(p: &mut [f64]) {
    let length = p.iter().map(|e| e * e).sum::<f64>().sqrt();
    p.iter_mut().for_each(|e| *e /= length);
}

/// G^T omega' / 2 (Haug 1989, eq. 9.3.33).
pub(super) fn parameter_rates([e0, e1, e2, e3]: [f64; 4], [x, y, z]: [f64; 3]) -> [f64; 4] {
    [
        0.5 * (-e1 * x - e2 * y - e3 * z),
        0.5 * (e0 * x - e3 * y + e2 * z),
        0.5 * (e3 * x + e0 * y - e1 * z),
        0.5 * (-e2 * x + e1 * y + e0 * z),
    ]
}
