//! [`Checks`]: what must hold of any mechanism.
//!
//! At the start, in both coordinates, by the reference engine and with all that is pruned left in: the constraints and their
//! first and second derivatives hold, the equations of motion leave nothing, accelerations agree, the rates of joint
//! coordinates move the bodies as these say, and a scene turned and moved as a whole turns its accelerations. In short runs:
//! interpreted and compiled give the same bits; both coordinates, the reference, runs without savings, a run in two parts
//! and a turned scene the same motion; energy and momentum are kept; reported loads balance.

use std::sync::Arc;

use nalgebra::{Matrix3, Vector3};
use odyn::analyses::statics;
use odyn::analysis::Formulation;
use odyn::catalog::Catalog;
use odyn::diagnostics::Source;
use odyn::plan::Layout;
use odyn::program::{Node, Program};
use odyn::results::Status;
use odyn::scene::{Override, parse};
use odyn::session::{Exit, Restart, RunOptions, RunReport, Session, SessionError};

use super::mechanism::{Mechanism, Place};
use super::numbers::Random;
use crate::support::Scratch;

/// Nothing, or what does not hold.
pub type Verdict = Result<(), String>;

/// The run of a mechanism.
pub const SHORT: &str = "t_end = 0.2\noutput_step = 0.05\ntolerance = 1e-10";

/// Velocities beyond this at the start, m/s or rad/s, come from a loop next to a singular position: what is asked of the other
/// bodies was of the order of one.
const LIVELY: f64 = 20.0;
/// The same, as the pivot ratio of the constraints.
const NEAR_SINGULAR: f64 = 1e-3;
/// Share of the sum of all its terms that may be left of an equation.
const LEFT: f64 = 1e-10;
/// Share of the largest acceleration that two ways of finding it may differ by.
const APART: f64 = 1e-8;
/// The same for a difference quotient.
const QUOTIENT: f64 = 1e-5;
/// Share of the largest value of its kind that columns of two runs may differ by.
const RUNS_APART: f64 = 1e-6;
/// What may be lost of energy or momentum, as a share of the largest there was.
const LOST: f64 = 1e-7;
/// What may be left of the balance of reported loads, as a share of the largest.
const UNBALANCED: f64 = 1e-8;

/// Settings whose runs must agree.
const ALIKE: [&[&str]; 5] = [
    &["formulation=joint"],
    &["formulation=cartesian"],
    &["formulation=joint", "without=[\"row-choice\", \"events\", \"audit\", \"on-demand\"]"],
    &["formulation=cartesian", "without=[\"row-choice\", \"kinematic\"]"],
    &["engine=reference"],
];

/// See the module documentation.
pub struct Checks {
    catalog: Catalog,
}

/// What is known at the start of a scene.
struct Start {
    layout: Layout,
    /// Time, state, accelerations, multipliers.
    inputs: Vec<f64>,
    /// Largest acceleration, rotations taken on the scene's length.
    peak: f64,
    /// Largest difference of the accelerations to those that the rates of the state make, as a share of the peak.
    off: f64,
}

pub fn largest(values: impl IntoIterator<Item = f64>) -> f64 {
    // `max` would lose what is not a number.
    values.into_iter().fold(0.0, |most: f64, x| if x.abs() <= most { most } else { x.abs() })
}

pub fn below(what: &str, value: f64, limit: f64) -> Verdict {
    if value <= limit { Ok(()) } else { Err(format!("{what}: {value:.1e}, allowed {limit:.0e}")) }
}

pub fn column<'a>(report: &'a RunReport, name: &str) -> &'a [f64] {
    let k = report.channels.iter().position(|channel| channel.name == name);
    k.map_or(&[], |k| &report.columns[k])
}

fn vectors(report: &RunReport, name: &str) -> Vec<Vector3<f64>> {
    let [x, y, z] = ["x", "y", "z"].map(|c| column(report, &format!("{name}_{c}")));
    (0..report.times.len()).map(|k| Vector3::new(x[k], y[k], z[k])).collect()
}

impl Checks {
    pub fn new() -> Self {
        let mut catalog = Catalog::new();
        for library in [odyn_joints::library(), odyn_forces::library(), odyn_controls::library()] {
            catalog.add_library(library).unwrap();
        }
        Self { catalog }
    }

    /// A scene with changed settings, ready to run.
    pub fn session(&self, text: &str, settings: &[&str]) -> Result<Session, SessionError> {
        let overrides: Vec<Override> =
            settings.iter().map(|setting| Override::new(format!("simulation.{setting}"))).collect();
        let (scene, warnings) = parse(Source::new("scene.toml", text), &overrides).map_err(|rejected| {
            SessionError { exit: Exit::Scene, diagnostics: rejected.diagnostics, source: Box::new(rejected.source) }
        })?;
        let options = RunOptions { equilibrium: Some(statics::start), ..RunOptions::default() };
        Session::with_catalog(scene, warnings, &self.catalog, &options)
    }

    fn open(&self, text: &str, settings: &[&str]) -> Result<Session, String> {
        self.session(text, settings).map_err(|error| format!("{settings:?}: {error}"))
    }

    fn run(&self, text: &str, settings: &[&str]) -> Result<RunReport, String> {
        let report = self.open(text, settings)?.run(None, Box::new(|_| ()), &Arc::default());
        let report = report.map_err(|error| format!("{settings:?}: {error}"))?;
        if report.summary.status != Status::Completed {
            return Err(format!("{settings:?}: {:?}: {}", report.summary.status, report.summary.reason));
        }
        Ok(report)
    }

    /// The mechanism with velocities that its loops allow; `None` if it starts too near a singular position. Masses do not
    /// matter for that, so that those of ordinary bodies are taken.
    pub fn settled(&self, mechanism: &Mechanism) -> Result<Option<Mechanism>, String> {
        let mut ordinary = mechanism.clone();
        for body in &mut ordinary.bodies {
            (body.heavier, body.thinner) = (1.0, Vector3::repeat(1.0));
        }
        let session = self.open(&ordinary.text(&Place::as_it_is(), SHORT), &["formulation=cartesian"])?;
        let length = session.assembly.scales.length;
        let moved = largest(session.assembly.moves.iter().map(|moved| (moved.distance / length).max(moved.angle)));
        below("what fits by construction is moved", moved, 1e-9)?;
        let mut settled = mechanism.clone();
        let mut fastest = 0.0_f64;
        for (body, state) in settled.bodies.iter_mut().zip(session.assembly.working.chunks_exact(13)) {
            let spin = body.axes * Vector3::from_column_slice(&state[10..13]);
            body.velocity = Vector3::from_column_slice(&state[7..10]) - spin.cross(&(body.axes * body.com));
            body.spin = spin;
            fastest = fastest.max(body.velocity.amax()).max(spin.amax());
        }
        let health = session.plan.health.smallest_pivot_ratio;
        // Zero stands for a tree, whose ratio is not known.
        let singular = health > 0.0 && health < NEAR_SINGULAR;
        Ok(Some(settled).filter(|_| fastest < LIVELY && !singular))
    }

    /// The equations at the start, in every form.
    pub fn equations(&self, mechanism: &Mechanism, seed: u64) -> Verdict {
        let text = mechanism.text(&Place::as_it_is(), SHORT);
        let reference = self.start(&text, &["engine=reference"])?;
        let ours = self.start(&text, &["formulation=cartesian"])?;
        for (name, other) in [
            ("the reference", reference),
            ("all rows", self.start(&text, &["formulation=cartesian", "without=[\"row-choice\"]"])?),
            ("joint coordinates", self.start(&text, &["formulation=joint"])?),
        ] {
            below(&format!("rates of the state, {name}"), other.off, QUOTIENT)?;
            let slots = ours.layout.acceleration_slot()..ours.layout.multiplier_slot();
            let pairs = ours.inputs[slots.clone()].iter().zip(&other.inputs[slots]);
            below(&format!("accelerations, {name}"), largest(pairs.map(|(a, b)| a - b)) / ours.peak, APART)?;
        }
        let place = Place::random(&mut Random::new(seed ^ 0x5eed));
        let turned = self.start(&mechanism.text(&place, SHORT), &["formulation=cartesian"])?;
        let slot = ours.layout.acceleration_slot();
        for body in 0..ours.layout.bodies {
            let vector =
                |start: &Start, k: usize| Vector3::from_column_slice(&start.inputs[slot + 6 * body + k..][..3]);
            let off = vector(&turned, 0) - place.turn * vector(&ours, 0);
            let off = off.amax().max((vector(&turned, 3) - vector(&ours, 3)).amax());
            below("accelerations of a turned scene", off / ours.peak, APART)?;
        }
        Ok(())
    }

    /// The start of a scene by some settings, where its equations must hold.
    fn start(&self, text: &str, settings: &[&str]) -> Result<Start, String> {
        let mut session = self.open(text, settings)?;
        let engine =
            session.scene.simulation.engine.as_ref().map_or("interpreted", |word| word.value.as_str()).to_string();
        let mut form = session.formulation(&engine).map_err(|error| format!("{settings:?}: {error}"))?;
        form.set_discrete(&session.assembly.references, &session.assembly.discrete);
        let mut state = vec![0.0; form.groups().len()];
        form.state_of(&session.assembly.working, &mut state);
        let broken = |error: &dyn std::fmt::Display| format!("{settings:?}: {error}");
        form.next_step(0.0, &state).map_err(|error| broken(&error))?;
        let inputs = form.observe(0.0, &state, true).map_err(|error| broken(&error))?.inputs.to_vec();
        let layout = session.plan.layout.clone();
        self.hold(&session, form.as_ref(), &inputs).map_err(|why| broken(&why))?;
        let accelerations = &inputs[layout.acceleration_slot()..layout.multiplier_slot()];
        let peak = largest(accelerations.iter().copied()).max(1.0);
        let velocities = |inputs: &[f64]| -> Vec<f64> {
            (0..layout.velocities()).map(|k| inputs[layout.body_slot(k / 6, 7 + k % 6)]).collect()
        };
        // How the rates of the state change the velocities of the bodies.
        let h = 1e-5;
        let mut rates = vec![0.0; state.len()];
        form.rates(0.0, &state, &mut rates).map_err(|error| broken(&error))?;
        let mut near = |h: f64| -> Result<Vec<f64>, String> {
            let moved: Vec<f64> = state.iter().zip(&rates).map(|(y, rate)| y + h * rate).collect();
            Ok(velocities(form.observe(h, &moved, false).map_err(|error| broken(&error))?.inputs))
        };
        let (ahead, behind) = (near(h)?, near(-h)?);
        let quotients = ahead.iter().zip(&behind).map(|(a, b)| (a - b) / (2.0 * h));
        let off = largest(quotients.zip(accelerations).map(|(quotient, a)| quotient - a)) / peak;
        Ok(Start { layout, inputs, peak, off })
    }

    /// The constraints, their derivatives, and the equations of motion.
    fn hold(&self, session: &Session, form: &dyn Formulation, inputs: &[f64]) -> Verdict {
        let (equations, layout, model) = (&session.equations, &session.plan.layout, &session.model);
        let mut nodes: Vec<Node> = equations.loads.clone();
        for row in equations.rows.iter() {
            nodes.extend([row.value, row.time, row.gamma]);
            nodes.extend(row.jacobian.iter().map(|(_, slope)| *slope));
        }
        let program = Program::compile(&equations.graph, &nodes);
        let mut found = vec![f64::NAN; nodes.len()];
        let ran = program.run(inputs, form.sets(), &mut program.workspace(), &mut found);
        ran.map_err(|(set, fault)| format!("element set {set}: {}", fault.message))?;
        let (loads, mut rest) = found.split_at(layout.velocities());
        let velocity = |column: usize| inputs[layout.body_slot(column / 6, 7 + column % 6)];
        let acceleration = |column: usize| inputs[layout.acceleration_slot() + column];
        // What is left of M a + Phi_q^T lambda - Q, and the sum of the magnitudes of its terms.
        let mut left: Vec<(f64, f64)> = loads.iter().map(|load| (-load, load.abs())).collect();
        let add = |(sum, size): &mut (f64, f64), term: f64| (*sum, *size) = (*sum + term, *size + term.abs());
        for (b, body) in model.bodies.iter().enumerate() {
            for k in 0..3 {
                add(&mut left[6 * b + k], body.mass * acceleration(6 * b + k));
                for l in 0..3 {
                    add(&mut left[6 * b + 3 + k], body.inertia[(k, l)] * acceleration(6 * b + 3 + l));
                }
            }
        }
        let length = session.assembly.scales.length;
        for (number, row) in equations.rows.iter().enumerate() {
            let (own, others) = rest.split_at(3 + row.jacobian.len());
            rest = others;
            let [value, time, gamma] = [own[0], own[1], own[2]];
            let (mut rate, mut bend) = ((time, time.abs()), (-gamma, gamma.abs()));
            let multiplier = inputs[layout.multiplier_slot() + number];
            for ((column, _), slope) in row.jacobian.iter().zip(&own[3..]) {
                add(&mut rate, slope * velocity(*column));
                add(&mut bend, slope * acceleration(*column));
                add(&mut left[*column], slope * multiplier);
            }
            let (element, k) = layout.element_of_row(number);
            let name = model.elements[element].row_name(k);
            below(&format!("constraint {name}"), value.abs(), 1e-11 * length.max(1.0))?;
            below(&format!("rate of {name}"), rate.0.abs(), LEFT * (rate.1 + 1.0))?;
            below(&format!("second derivative of {name}"), bend.0.abs(), LEFT * (bend.1 + 1.0))?;
        }
        let most = largest(left.iter().map(|(_, size)| *size));
        for (k, (sum, size)) in left.iter().enumerate() {
            let what = format!("equation of motion {} of {}", k % 6, model.bodies[k / 6].name);
            below(&what, sum.abs(), LEFT * size + 0.01 * LEFT * most)?;
        }
        Ok(())
    }

    /// Short runs of a mechanism.
    pub fn runs(&self, mechanism: &Mechanism, seed: u64) -> Verdict {
        let text = mechanism.text(&Place::as_it_is(), SHORT);
        self.all_runs_agree(&text)?;
        let ours = self.run(&text, &[])?;
        let place = Place::random(&mut Random::new(seed ^ 0x5eed));
        let turned = self.run(&mechanism.text(&place, SHORT), &[])?;
        for k in 0..mechanism.bodies.len() {
            let off = |name: &str, shift: Vector3<f64>| {
                let pairs =
                    vectors(&ours, &format!("{name}_{k}")).into_iter().zip(vectors(&turned, &format!("{name}_{k}")));
                largest(pairs.map(|(here, there)| (place.turn * here + shift - there).amax()))
            };
            let off = off("r", place.shift).max(off("v", Vector3::zeros())).max(off("w", Vector3::zeros()));
            below(&format!("body_{k} of a turned scene"), off, 10.0 * RUNS_APART)?;
        }
        if mechanism.floats { momentum(mechanism, &ours) } else { Ok(()) }
    }

    /// Everything that can be said of the runs of a scene that is given as text.
    pub fn all_runs_agree(&self, text: &str) -> Verdict {
        let ours = self.run(text, &["engine=interpreted"])?;
        let compiled = self.run(text, &["engine=compiled"])?;
        if ours.columns != compiled.columns {
            return Err("interpreted and compiled differ".into());
        }
        sound(&ours)?;
        for settings in ALIKE {
            let other = self.run(text, settings)?;
            alike(&ours, &other, 1).map_err(|why| format!("{settings:?}: {why}"))?;
            sound(&other).map_err(|why| format!("{settings:?}: {why}"))?;
        }
        self.goes_on(text, &ours)
    }

    /// A run in two parts ends where the whole one does.
    fn goes_on(&self, text: &str, whole: &RunReport) -> Verdict {
        let folder = Scratch::new();
        let middle = format!("t_end={:?}", 0.5 * whole.summary.t_end);
        let first = self.open(text, &[&middle])?.run(Some(folder.path()), Box::new(|_| ()), &Arc::default());
        first.map_err(|error| format!("first half: {error}"))?;
        let state = Restart::read(folder.path()).map_err(|error| error.message.clone())?;
        let mut session = self.open(text, &[])?;
        session.go_on_from(state).map_err(|error| format!("second half: {error}"))?;
        let second =
            session.run(None, Box::new(|_| ()), &Arc::default()).map_err(|error| format!("second half: {error}"))?;
        alike(whole, &second, whole.times.len()).map_err(|why| format!("second half: {why}"))
    }
}

/// Columns of two runs are the same; from sample `from` on, or only the last ones where the runs have different ones.
fn alike(ours: &RunReport, theirs: &RunReport, from: usize) -> Verdict {
    if ours.channels.len() != theirs.channels.len() {
        return Err("other channels".into());
    }
    let last = |columns: &[f64]| columns[columns.len() - 1];
    for (k, channel) in ours.channels.iter().enumerate() {
        let is_load = channel.name.starts_with(['F', 'T']);
        // Loads that redundant rows leave open are what each engine makes of them; what is left of balances is round-off.
        let open = is_load && !(channel.unique && theirs.channels[k].unique);
        if open || channel.name.starts_with(['f', 't']) {
            continue;
        }
        let same_unit = ours.channels.iter().zip(&ours.columns).filter(|(other, _)| other.unit == channel.unit);
        let size = largest(same_unit.flat_map(|(_, column)| column.iter().copied())).max(1e-3);
        let (a, b) = (&ours.columns[k], &theirs.columns[k]);
        let off = if from < a.len() { largest(a.iter().zip(b).map(|(a, b)| a - b)) } else { (last(a) - last(b)).abs() };
        let limit = if is_load { 100.0 * RUNS_APART } else { RUNS_APART };
        below(&format!("`{}` differs", channel.name), off / size, limit)?;
    }
    Ok(())
}

/// Constraints, energy and balances of a run.
fn sound(report: &RunReport) -> Verdict {
    let audit = &report.summary.audit;
    below("position violation", audit.position_violation, 1e-11)?;
    below("velocity violation", audit.velocity_violation, 1e-9)?;
    below("energy", audit.energy_error_relative, LOST)?;
    let peak = |letters: [char; 2]| {
        let named = report.channels.iter().zip(&report.columns).filter(|(c, _)| c.name.starts_with(letters));
        largest(named.flat_map(|(_, column)| column.iter().copied()))
    };
    below("balance of loads", peak(['f', 't']) / peak(['F', 'T']).max(1e-2), UNBALANCED)
}

/// Momentum and angular momentum of what nothing acts on.
fn momentum(mechanism: &Mechanism, report: &RunReport) -> Verdict {
    let mut totals = vec![(Vector3::zeros(), Vector3::zeros()); report.times.len()];
    let mut sizes = (0.0_f64, 0.0_f64);
    for (k, body) in mechanism.bodies.iter().enumerate() {
        let [r, v, w] = ["r", "v", "w"].map(|name| vectors(report, &format!("{name}_{k}")));
        let e = ["e0", "e1", "e2", "e3"].map(|name| column(report, &format!("p_{k}_{name}")));
        for (n, (linear, angular)) in totals.iter_mut().enumerate() {
            let axes = odyn::model::rotation(&[e[0][n], e[1][n], e[2][n], e[3][n]]);
            let push = v[n] * body.heavier * body.mass;
            let swing = r[n].cross(&push) + axes * Matrix3::from_diagonal(&body.moments()) * axes.transpose() * w[n];
            (*linear, *angular) = (*linear + push, *angular + swing);
            sizes = (sizes.0.max(push.norm()), sizes.1.max(swing.norm()));
        }
    }
    let (linear, angular) = totals[0];
    let off =
        totals.iter().map(|(p, l)| ((p - linear).norm() / (sizes.0 + 1e-9), (l - angular).norm() / (sizes.1 + 1e-9)));
    let off = off.fold((0.0_f64, 0.0_f64), |worst, (p, l)| (worst.0.max(p), worst.1.max(l)));
    below("momentum", off.0, LOST)?;
    below("angular momentum", off.1, LOST)
}
