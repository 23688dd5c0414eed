//! Positions and velocities before time starts.

mod rolling;
pub(super) mod velocities;

use rolling::rolling;
use velocities::velocities;

use std::f64::consts::{PI, TAU};

use nalgebra::Vector3;

use super::conflict::{Gap, Measure, conflict};
use super::constraints::{Constraints, mass_values};
use super::formulation::AnalysisError;
use super::motion::move_body;
use super::scales::{AT_REST, CONTRADICTION, Scales};
use super::turning::turning;
use super::unknowns::{Unknowns, unknown_name};
use super::working::{BODY_STATES, clusters};
use crate::linalg::{KktSolver, KktStructure, LIGHT, LinalgError, SparseFirst};
use crate::model::{Model, rotation, skew};
use crate::plan::{Layout, body_scales};
use crate::program::{Equations, Program};

/// Newton steps before assembly gives up.
const MOST_STEPS: usize = 60;
/// Rank tolerance while positions are still off: rows that are nearly dependent must not throw bodies around.
const ASSEMBLY_RANK_TOLERANCE: f64 = 1e-8;
/// Assembled means: every violation below this share of the scene's size.
const ASSEMBLED: f64 = 1e-12;
/// Initial velocities that miss what was asked by more than this share of the largest one are reported.
const VELOCITY_MISS: f64 = 1e-9;
/// Velocities that differ by more than this share of the largest one between two metrics are not determined.
const OPEN: f64 = 1e-6;
/// Velocities that miss the rows by at most this share of what these are made of meet them but for round-off.
const AS_ASKED: f64 = 1e-12;

/// How far along the velocities [`ahead`] looks, rad or lengths of the scene; the first place that can be assembled counts.
const AHEAD: [f64; 4] = [0.4, 0.2, 0.1, 0.05];

/// The start of a simulation.
#[derive(Debug, Clone)]
pub struct Assembly {
    /// State in working coordinates: per body r, p, v, omega'; element states; work.
    pub working: Vec<f64>,
    /// Angle references.
    pub references: Vec<f64>,
    /// Discrete element states.
    pub discrete: Vec<f64>,
    /// Sizes typical of the scene.
    pub scales: Scales,
    /// How far each body was moved to meet the joints; only bodies that moved more than round-off.
    pub moves: Vec<Move>,
    /// Where bodies were moved, the row that is missed most where the scene puts them.
    pub missed: Option<Gap>,
    /// Newton steps taken.
    pub steps: usize,
    /// Initial velocities that the joints do not allow.
    pub velocity_misses: Vec<VelocityMiss>,
    /// Initial velocities that neither the scene nor the joints determine, where they are not zero.
    pub chosen: Vec<Chosen>,
    /// Largest velocity that the scene gives or drives, m/s; of angular ones on the size of the scene.
    pub given_speed: f64,
}

/// An initial velocity that neither the scene nor the joints determine. Of all that are possible, those with the least kinetic
/// energy are taken: from rest, the least change in the metric of mass.
#[derive(Debug, Clone, PartialEq)]
pub struct Chosen {
    /// The body's name.
    pub body: String,
    /// Angular velocity instead of that of the body frame's origin.
    pub angular: bool,
    /// Component along the ground's axes: 0, 1, 2.
    pub component: usize,
    /// m/s or rad/s.
    pub value: f64,
}

/// An initial velocity that the joints do not allow.
#[derive(Debug, Clone, PartialEq)]
pub struct VelocityMiss {
    /// The body's name.
    pub body: String,
    /// Angular instead of translational.
    pub angular: bool,
    /// Component along the ground's axes: 0, 1, 2.
    pub component: usize,
    /// As the scene gives it, m/s or rad/s.
    pub given: f64,
    /// As the joints make it, m/s or rad/s.
    pub found: f64,
}

/// How far assembly moved a body.
#[derive(Debug, Clone, PartialEq)]
pub struct Move {
    /// The body's name.
    pub body: String,
    /// Displacement of the centre of mass, m.
    pub distance: f64,
    /// Rotation, rad.
    pub angle: f64,
}

/// Why there is no start.
#[derive(Debug, thiserror::Error)]
pub enum AssemblyError {
    /// Joints that can't all hold.
    #[error("the joints cannot be assembled: {}", culprits(.rows))]
    Impossible {
        /// What contradicts each other, with the gaps at the positions that miss least; worst first.
        rows: Vec<Gap>,
    },
    /// Joints that ask for velocities which cannot all be had.
    #[error("the joints ask for velocities that contradict each other: {}", misses(.rows))]
    Contradiction {
        /// What remains of their rates; worst first.
        rows: Vec<Gap>,
    },
    /// A row whose equation has no value, or no derivative, at the given positions.
    #[error("`{joint}` is not defined here: row `{row}` or its derivative is not finite")]
    Undefined {
        /// The joint's name.
        joint: String,
        /// The row's name.
        row: String,
    },
    /// The analysis failed.
    #[error(transparent)]
    Analysis(#[from] AnalysisError),
}

fn culprits(rows: &[Gap]) -> String {
    let texts: Vec<String> = rows.iter().take(6).map(Gap::to_string).collect();
    texts.join("; ")
}

fn misses(rows: &[Gap]) -> String {
    let texts: Vec<String> = rows.iter().take(6).map(|gap| format!("{gap}/s")).collect();
    texts.join("; ")
}

/// Finds positions that meet all joints near the given ones, then velocities that meet the joints and everything the
/// scene prescribes, with the least kinetic energy in what is left open. Contacts at rest that do not slide whatever it takes are met as
/// joints are.
///
/// # Errors
/// When the joints can't be met, naming those that remain violated.
pub fn assemble(equations: &Equations, model: &Model, layout: &Layout, t: f64) -> Result<Assembly, AssemblyError> {
    let assembly = assemble_from(equations, model, layout, t, None)?;
    // Velocities that are open are found so that all roll. Where the scene gives some that strike, part or slide, impulses end that at once.
    for closed in rolling(equations, model, layout, t, &assembly)? {
        let rolled = assemble_from(&equations.with_closed(&closed), model, layout, t, None);
        let allowed = |rolled: &Assembly| rolled.velocity_misses.len() <= assembly.velocity_misses.len();
        if let Some(rolled) = rolled.ok().filter(allowed) {
            return Ok(rolled);
        }
    }
    Ok(assembly)
}

/// The same from another place than the scene gives: `(working, references)` as in [`Assembly`]. Velocities in it are not looked at;
/// they are those of the scene.
///
/// # Errors
/// See [`assemble`].
pub fn assemble_from(
    equations: &Equations,
    model: &Model,
    layout: &Layout,
    t: f64,
    place: Option<(&[f64], &[f64])>,
) -> Result<Assembly, AssemblyError> {
    let mut state = as_given(model, layout);
    let mut inputs = vec![0.0; layout.inputs()];
    load_discrete(model, layout, &mut inputs);
    if let Some((working, references)) = place {
        state.copy_from_slice(working);
        state[..BODY_STATES * layout.bodies].chunks_exact_mut(BODY_STATES).for_each(|body| body[7..].fill(0.0));
        let discrete = inputs[layout.discrete_slot()..layout.acceleration_slot()].to_vec();
        layout.write_discrete(&mut inputs, references, &discrete);
    }
    let scales = Scales::new(model, &state);
    let given = state.clone();
    if let Some(element) = equations.unknowns_of_solution(layout) {
        let element = &model.elements[element];
        let why = "its conditions depend on an acceleration or a reaction by way of a signal, and these are found only after it";
        let unknown = unknown_name(&element.class, 0);
        return Err(AnalysisError::Unsolved { element: element.name.clone(), unknown, why }.into());
    }
    let mut unknowns = Unknowns::new(equations, model, layout);
    let steps = match positions(equations, model, layout, (t, scales.length), &mut state, &mut inputs, &mut unknowns) {
        Err(AssemblyError::Impossible { rows: left }) => {
            let mut rows = Constraints::of_positions(equations)?;
            let found = conflict(&mut rows, model, layout, t, &given, &mut inputs, scales.length)?;
            return Err(AssemblyError::Impossible { rows: if found.is_empty() { left } else { found } });
        }
        result => result?,
    };
    let moves = moved(model, &given, &state, scales.length);
    let missed = if moves.is_empty() {
        None
    } else {
        let mut rows = Constraints::of_positions(equations)?;
        let reached = inputs.clone();
        evaluate(&mut rows, model, layout, t, &given, &mut inputs, scales.length)?;
        inputs = reached;
        Measure::new(&rows).gaps(&rows, model, layout, scales.length).into_iter().next()
    };
    let (mut chosen, mut given_speed) = (Vec::new(), 0.0);
    let velocity_misses = {
        let free = (&mut chosen, &mut given_speed);
        velocities(equations, model, layout, t, &mut state, &mut inputs, scales.length, free)?
    };
    load(layout, t, &state, &mut inputs);
    let references = match place {
        Some((_, references)) => references.to_vec(),
        None => references(equations, model, layout, &inputs)?,
    };
    let discrete = inputs[layout.discrete_slot()..layout.acceleration_slot()].to_vec();
    layout.write_discrete(&mut inputs, &references, &discrete);
    unknowns.solve(&mut inputs, model, false)?;
    take_unknowns(layout, &inputs, &mut state);
    let sizes = scales;
    let mut scales = Scales { length: sizes.length, extent: sizes.length, ..Scales::new(model, &state) };
    if Scales::where_turn(model, &given, |_| false).length != sizes.length {
        let mut rows = Constraints::of_positions(equations)?;
        evaluate(&mut rows, model, layout, t, &state, &mut inputs, sizes.length)?;
        let turning = turning(model, layout, &rows, sizes.length);
        scales.without_still(&Scales::where_turn(model, &given, |body| turning[body]));
    }
    scales.grow(&state, layout.bodies);
    Ok(Assembly {
        working: state,
        references,
        discrete,
        scales,
        moves,
        missed,
        steps,
        velocity_misses,
        chosen,
        given_speed,
    })
}

/// A place that the motion comes to: the start, at time `t`, moved along its velocities and brought to the joints, with the
/// time there. `None` where nothing moves in `duration`, or no such place was found: the motion need not come to where velocities at
/// the start point, and equations may have no solution there.
///
/// At the start itself the joints may be in a singular position, in which more rows depend on each other than anywhere else.
#[must_use]
pub fn ahead(
    equations: &Equations,
    model: &Model,
    layout: &Layout,
    start: &Assembly,
    t: f64,
    duration: f64,
) -> Option<(f64, Assembly)> {
    let length = start.scales.length;
    let bodies = start.working[..BODY_STATES * layout.bodies].chunks_exact(BODY_STATES);
    let speeds = bodies.flat_map(|y| y[7..13].iter().enumerate());
    let fastest = speeds.fold(0.0_f64, |most, (k, speed)| most.max(speed.abs() / if k < 3 { length } else { 1.0 }));
    if fastest.is_nan() || fastest * duration < AT_REST {
        return None;
    }
    for distance in AHEAD {
        let s = distance / fastest;
        let mut place = start.clone();
        for body in place.working[..BODY_STATES * layout.bodies].chunks_exact_mut(BODY_STATES) {
            let (pose, velocity) = body.split_at_mut(7);
            let step: Vec<f64> = velocity.iter().map(|speed| s * speed).collect();
            move_body(pose, &step);
        }
        let mut inputs = start_inputs(layout, t + s, &place);
        let mut unknowns = Unknowns::new(equations, model, layout);
        if positions(equations, model, layout, (t + s, length), &mut place.working, &mut inputs, &mut unknowns).is_ok()
        {
            return Some((t + s, place));
        }
    }
    None
}

/// The inputs of every program at the start.
#[must_use]
pub fn start_inputs(layout: &Layout, t: f64, assembly: &Assembly) -> Vec<f64> {
    let mut inputs = vec![0.0; layout.inputs()];
    load(layout, t, &assembly.working, &mut inputs);
    layout.write_discrete(&mut inputs, &assembly.references, &assembly.discrete);
    inputs
}

fn as_given(model: &Model, layout: &Layout) -> Vec<f64> {
    let mut state = Vec::with_capacity(BODY_STATES * layout.bodies + layout.states + 1);
    for body in &model.bodies {
        state.extend(body.position.iter());
        state.extend(body.orientation);
        state.extend([0.0; 6]);
    }
    for element in &model.elements {
        state.extend(&element.recording.initial_states);
        state.extend(element.recording.guesses());
    }
    state.push(0.0);
    state
}

fn load_discrete(model: &Model, layout: &Layout, inputs: &mut [f64]) {
    for (number, (element, first)) in model.elements.iter().zip(&layout.discrete_at).enumerate() {
        let slot = layout.discrete_slot() + first;
        let values = &element.recording.initial_discrete;
        inputs[slot..slot + values.len()].copy_from_slice(values);
        if let Some(acts) = layout.acts_at(number, model) {
            inputs[layout.discrete_slot() + acts] = 1.0;
        }
    }
    for (k, input) in model.inputs.iter().enumerate() {
        inputs[layout.given_slot(k)] = input.value;
    }
}

pub(super) fn load(layout: &Layout, t: f64, state: &[f64], inputs: &mut [f64]) {
    inputs[Layout::TIME] = t;
    for body in 0..layout.bodies {
        let to = layout.body_slot(body, 0);
        inputs[to..to + BODY_STATES].copy_from_slice(&state[BODY_STATES * body..BODY_STATES * (body + 1)]);
    }
    let states = BODY_STATES * layout.bodies;
    let slot = layout.state_slot();
    inputs[slot..slot + layout.states].copy_from_slice(&state[states..states + layout.states]);
}

/// Newton's method with the smallest mass-weighted step (minimum norm where rows are dependent), shortened where it is
/// longer than the scene or does not reduce the violation.
fn positions(
    equations: &Equations,
    model: &Model,
    layout: &Layout,
    (t, length): (f64, f64),
    state: &mut [f64],
    inputs: &mut [f64],
    unknowns: &mut Unknowns,
) -> Result<usize, AssemblyError> {
    load(layout, t, state, inputs);
    unknowns.solve(inputs, model, true)?;
    take_unknowns(layout, inputs, state);
    let mut rows = Constraints::of_positions(equations)?;
    if rows.rows.is_empty() {
        return Ok(0);
    }
    let clusters = clusters(layout, &rows.rows);
    let mut solver =
        SparseFirst::new(&rows.structure, &clusters, ASSEMBLY_RANK_TOLERANCE).map_err(AnalysisError::from)?;
    solver.set_measure(&body_scales(model, length));
    solver.set_mass(&mass_values(model)).map_err(AnalysisError::from)?;
    let n = layout.velocities();
    let (mut step, mut multipliers, zero) = (vec![0.0; n], vec![0.0; rows.rows.len()], vec![0.0; n]);
    let mut best = evaluate(&mut rows, model, layout, t, state, inputs, length)?;
    let mut few_rows = true;
    solver.enforce_few_rows(few_rows);
    for count in 0..MOST_STEPS {
        if best <= 1e-15 * length {
            return Ok(count);
        }
        solver.refactor(rows.jacobian()).map_err(AnalysisError::from)?;
        let right: Vec<f64> = rows.values().iter().map(|x| -x).collect();
        solver.solve(&zero, &right, &mut step, &mut multipliers).map_err(AnalysisError::from)?;
        let size = step.chunks_exact(3).enumerate().fold(0.0_f64, |size, (k, d)| {
            let scale = if k % 2 == 0 { 1.0 / length } else { 1.0 };
            d.iter().fold(size, |m, x| m.max(x.abs() * scale))
        });
        if !size.is_finite() {
            break;
        }
        let mut factor = if size > 0.5 { 0.5 / size } else { 1.0 };
        let mut improved = false;
        for _ in 0..12 {
            let mut trial = state.to_vec();
            for body in 0..layout.bodies {
                let d: Vec<f64> = step[6 * body..6 * body + 6].iter().map(|x| factor * x).collect();
                move_body(&mut trial[BODY_STATES * body..BODY_STATES * body + 7], &d);
            }
            load(layout, t, &trial, inputs);
            if unknowns.solve(inputs, model, true).is_err() {
                factor *= 0.5;
                continue;
            }
            take_unknowns(layout, inputs, &mut trial);
            let violation = evaluate(&mut rows, model, layout, t, &trial, inputs, length)?;
            if violation < best {
                state.copy_from_slice(&trial);
                best = violation;
                improved = true;
                break;
            }
            factor *= 0.5;
        }
        if !improved {
            let reached = evaluate(&mut rows, model, layout, t, state, inputs, length)?;
            if reached <= ASSEMBLED * length {
                return Ok(count);
            }
            if !few_rows {
                break;
            }
            few_rows = false;
            solver.enforce_few_rows(few_rows);
        }
    }
    if best <= ASSEMBLED * length {
        return Ok(MOST_STEPS);
    }
    // Some rows are left to the others: what the conflict is, is found in another way.
    Err(AssemblyError::Impossible { rows: Measure::new(&rows).gaps(&rows, model, layout, length) })
}

/// Carries the values of unknowns and states that are among the inputs.
fn take_unknowns(layout: &Layout, inputs: &[f64], state: &mut [f64]) {
    let (from, slot) = (BODY_STATES * layout.bodies, layout.state_slot());
    state[from..from + layout.states].copy_from_slice(&inputs[slot..slot + layout.states]);
}

/// Largest violation at a state, m.
fn evaluate(
    rows: &mut Constraints,
    model: &Model,
    layout: &Layout,
    t: f64,
    state: &[f64],
    inputs: &mut [f64],
    length: f64,
) -> Result<f64, AssemblyError> {
    load(layout, t, state, inputs);
    rows.evaluate(inputs, &model.sets)?;
    let (worst, row) = rows.worst(rows.values(), length);
    let slopes = rows.structure.jacobian.iter().zip(rows.jacobian());
    let undefined = slopes.filter(|(_, slope)| !slope.is_finite()).map(|((row, _), _)| rows.rows[*row]).min();
    let Some(row) = row.filter(|_| !worst.is_finite()).or(undefined) else { return Ok(worst) };
    let (element, k) = layout.element_of_row(row);
    let element = &model.elements[element];
    Err(AssemblyError::Undefined { joint: element.name.clone(), row: element.row(k).to_string() })
}

/// Share of a gradient or an angular velocity along an axis that is round-off.
const IDLE: f64 = 1e-9;

/// The axes without moment of inertia, by body and place among its own, about which no joint holds the body and about which it
/// does not turn at the start.
///
/// # Errors
/// When the equations have no value there.
pub fn idle_axes(
    equations: &Equations,
    model: &Model,
    layout: &Layout,
    t: f64,
    assembly: &Assembly,
) -> Result<Vec<(usize, usize)>, AssemblyError> {
    let mut idle = Vec::new();
    if model.bodies.iter().all(|body| body.thin.is_empty()) {
        return Ok(idle);
    }
    // Those of contacts that are open, too.
    let all: Vec<usize> = (0..layout.rows).collect();
    let mut rows = Constraints::new(equations, &all, &[], &[])?;
    rows.evaluate(&start_inputs(layout, t, assembly), &model.sets)?;
    // By body: its rotation's share in each row that it has one in.
    let mut slopes: Vec<Vec<(usize, nalgebra::Vector3<f64>)>> = vec![Vec::new(); model.bodies.len()];
    for ((row, column), slope) in rows.structure.jacobian.iter().zip(rows.jacobian()).filter(|((_, k), _)| k % 6 >= 3) {
        let own = &mut slopes[column / 6];
        if own.last().is_none_or(|(last, _)| last != row) {
            own.push((*row, nalgebra::Vector3::zeros()));
        }
        own.iter_mut().last().expect("just pushed").1[column % 6 - 3] = *slope;
    }
    for (index, (body, slopes)) in model.bodies.iter().zip(&slopes).enumerate() {
        let spin = nalgebra::Vector3::from_column_slice(&assembly.working[13 * index + 10..13 * index + 13]);
        for (number, thin) in body.thin.iter().enumerate() {
            let held = slopes.iter().any(|(_, slope)| slope.dot(&thin.axis).abs() > IDLE * slope.norm());
            if !held && spin.dot(&thin.axis).abs() <= IDLE * spin.norm() {
                idle.push((index, number));
            }
        }
    }
    Ok(idle)
}

/// How far each body went.
fn moved(model: &Model, given: &[f64], state: &[f64], length: f64) -> Vec<Move> {
    let mut moves = Vec::new();
    for (index, body) in model.bodies.iter().enumerate() {
        let (before, after) = (&given[BODY_STATES * index..], &state[BODY_STATES * index..]);
        let distance = (0..3).map(|k| (after[k] - before[k]).powi(2)).sum::<f64>().sqrt();
        // |p - p0| is the sine of a quarter of the angle, doubled; small angles keep their digits.
        let chord = (3..7).map(|k| (after[k] - before[k]).powi(2)).sum::<f64>().sqrt();
        let angle = 4.0 * (chord / 2.0).min(1.0).asin();
        if distance > 1e-12 * length || angle > 1e-12 {
            moves.push(Move { body: body.name.clone(), distance, angle });
        }
    }
    moves
}

/// How near to half a turn an angle at the start counts as positive, rad: what data with six digits leave open.
const HALF_TURN: f64 = 1e-6;

/// The multi-turn angles at the start, in (-pi, pi]. Half a turn is positive, whatever round-off makes of it: springs and stops
/// count from there.
fn references(
    equations: &Equations,
    model: &Model,
    layout: &Layout,
    inputs: &[f64],
) -> Result<Vec<f64>, AnalysisError> {
    let program = Program::compile(&equations.graph, &equations.angles);
    let mut angles = vec![0.0; layout.references];
    program
        .run(inputs, &model.sets, &mut program.workspace(), &mut angles)
        .map_err(|(set, fault)| AnalysisError::Element { set, fault })?;
    for angle in &mut angles {
        if *angle <= HALF_TURN - PI {
            *angle += TAU;
        }
    }
    Ok(angles)
}
