//! [`Shaking`]: the force and moment that a machine puts on the ground, by harmonics of its turning; and the counterweight that makes
//! them least.
//!
//! Over whole turns, sampled at equal angles theta, each component is f = a_0 + sum_k (a_k cos k theta + b_k sin k theta), fitted by least
//! squares: orders of the rotation, also where its speed changes within a turn. A mass m at s from the axis puts
//! -m (alpha x s + omega x (omega x s)) on the ground, which is linear in the unbalance U = m s: U minimises the sum of squares of
//! all harmonics of the force from the first on (least squares in two unknowns). (Norton, Design of Machinery, ch. 12 and 13: shaking forces, balancing of slider-cranks.)

use nalgebra::{DMatrix, DVector, Vector3};
use serde::Serialize;

use crate::analysis::Evaluator;
use crate::diagnostics::{Diagnostic, codes};
use crate::driven::cannot;
use crate::linalg::SingularValues;
use crate::linear::refuse;
use crate::model::{Axes, Level, Quantity, rotation};
use crate::plan::Layout;
use crate::prescribed::{Wanted, quantity};
use crate::program::Node;
use crate::scene::Dimension;
use crate::session::{Session, SessionError};

/// Samples of a turn at least, and for each harmonic.
const SAMPLES: usize = 64;
const PER_HARMONIC: usize = 12;
/// Accelerations of the axis above this share of the centrifugal one of the counterweight: the axis moves.
const STANDS: f64 = 1e-6;
/// An unbalance below this share of mass times radius of gyration of the turning body is round-off.
const NO_UNBALANCE: f64 = 1e-12;

/// What is looked at.
#[derive(Debug, Clone)]
pub struct Question {
    /// The coordinate that turns, `joint.channel`.
    pub turn: String,
    /// How many whole turns, the last ones of the run.
    pub turns: usize,
    /// Harmonics of it.
    pub harmonics: usize,
    /// The point of moments, m, ground axes.
    pub about: [f64; 3],
}

/// Amplitudes of a harmonic.
#[derive(Debug, Clone, Serialize)]
pub struct Harmonic {
    /// Its order; 0 is the mean.
    pub order: usize,
    /// Of the force on the ground, N.
    pub force: [f64; 3],
    /// Of the moment, N m.
    pub moment: [f64; 3],
}

/// Force and moment on the ground over whole turns.
#[derive(Debug, Clone, Serialize)]
pub struct Shaking {
    /// The angle, rad.
    pub angles: Vec<f64>,
    /// s.
    pub times: Vec<f64>,
    /// N, ground axes.
    pub force: Vec<[f64; 3]>,
    /// N m about the point of moments.
    pub moment: Vec<[f64; 3]>,
    /// By order.
    pub harmonics: Vec<Harmonic>,
    /// Root mean square of the force without its mean, N.
    pub force_rms: f64,
    /// Largest force without its mean, N.
    pub force_peak: f64,
    /// Root mean square of the moment without its mean, N m.
    pub moment_rms: f64,
    /// Mean speed, rad/s.
    pub speed: f64,
    /// Change of the mean speed from the first to the last turn, as a share of it.
    pub drift: f64,
}

/// A point mass on the turning body; 0 kg where none makes the force less.
#[derive(Debug, Clone, Serialize)]
pub struct Counterweight {
    /// The body.
    pub body: String,
    /// kg.
    pub mass: f64,
    /// From the axis, m.
    pub radius: f64,
    /// From the x axis of the joint's frame on the body, about its z axis, rad.
    pub phase: f64,
    /// Mass times radius, kg m.
    pub unbalance: f64,
    /// In the frame of the body, m.
    pub position: [f64; 3],
    /// The key and value of the scene that adds it, for `--set`; empty where there is none.
    pub set: String,
}

/// Shaking forces without and with the counterweight; SI.
#[derive(Debug, Clone, Serialize)]
pub struct Balanced {
    /// Without it.
    pub before: Shaking,
    /// What least squares gives.
    pub counterweight: Counterweight,
    /// With it, if the machine turned as before.
    pub predicted: Shaking,
    /// As a run with it shows.
    pub after: Shaking,
}

/// Size of a vector.
#[must_use]
pub fn size(of: &[f64; 3]) -> f64 {
    of.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Balances a scene, given at its start, and runs it again with the counterweight; `open` gives it anew for each run, with more set where
/// that is asked.
///
/// # Errors
/// Those of [`balance`] and [`Balance::counterweight`].
pub fn balanced(
    session: &Session,
    open: &dyn Fn(Option<&str>) -> Result<Session, SessionError>,
    question: &Question,
    radius: Option<f64>,
    progress: &mut dyn FnMut(f64),
) -> Result<Balanced, SessionError> {
    let before = balance(&|| open(None), question, &mut |share| progress(0.5 * share))?;
    let (counterweight, predicted) = before.counterweight(session, question, radius)?;
    let after = match counterweight.set.as_str() {
        "" => before.shaking.clone(),
        set => balance(&|| open(Some(set)), question, &mut |share| progress(0.5 + 0.5 * share))?.shaking,
    };
    Ok(Balanced { before: before.shaking, predicted, after, counterweight })
}

/// A machine that was looked at, with what is needed to balance it.
pub struct Balance {
    /// Without a counterweight.
    pub shaking: Shaking,
    turning: Vec<Turning>,
    joint: usize,
    frame: usize,
    body: usize,
}

/// How the turning body moves at a sample, ground axes.
struct Turning {
    axes: [Vector3<f64>; 2],
    spin: Vector3<f64>,
    acceleration: Vector3<f64>,
    /// Of the axis.
    point: Vector3<f64>,
    moves: f64,
}

/// The programs that are asked at an instant.
struct Watch {
    layout: Layout,
    values: Evaluator,
    points: usize,
}

/// Joint, frame and body of the coordinate that turns.
fn turning_joint(session: &Session, turn: &Wanted) -> Result<(usize, usize, usize), SessionError> {
    let model = &session.model;
    let refused = || {
        let help = "name the angle of a revolute or cylindrical joint, `bearing.angle`";
        cannot(session, format!("`{}` is no angle of a joint with a body that turns", turn.name), help)
    };
    let Quantity::Coordinate { element, .. } = turn.quantity else { return Err(refused()) };
    if turn.dimension != Dimension::ANGLE {
        return Err(refused());
    }
    let markers = &model.elements[element].markers;
    let frame = (0..markers.len()).rev().find(|frame| markers[*frame].body.is_some()).ok_or_else(refused)?;
    Ok((element, frame, markers[frame].body.unwrap_or(0)))
}

impl Watch {
    fn new(session: &Session, turn: &Wanted) -> Self {
        let (model, layout) = (&session.model, session.plan.layout.clone());
        let mut equations = session.equations.clone();
        // The angle, and its rate: that of a bearing between two bodies that turn is no speed of either.
        let mut rate = turn.quantity.clone();
        if let Quantity::Coordinate { level, .. } = &mut rate {
            *level = Level::Velocity;
        }
        let mut nodes: Vec<Node> =
            [&turn.quantity, &rate].map(|quantity| equations.observe(quantity, model, &layout)).into();
        let mut points = 0;
        for (element, instance) in model.elements.iter().enumerate() {
            let kind = instance.class.kind.word();
            let mut frames: Vec<usize> =
                (0..instance.markers.len()).filter(|frame| instance.markers[*frame].body.is_none()).collect();
            if kind == "control" {
                continue;
            }
            if kind == "joint" {
                frames.truncate(1);
            }
            for frame in frames {
                points += 1;
                let origin = instance.markers[frame].position;
                nodes.extend((0..3).map(|k| equations.graph.constant(origin[k])));
                for torque in [false, true] {
                    nodes.extend((0..3).map(|component| {
                        let load = Quantity::Load { element, frame, torque, axes: Axes::Ground, component };
                        equations.observe(&load, model, &layout)
                    }));
                }
            }
        }
        Self { values: Evaluator::new(&equations.graph, &nodes), layout, points }
    }

    /// Angle and its rate; force and moment about a point.
    fn at(&mut self, inputs: &[f64], about: Vector3<f64>) -> Result<([f64; 2], [Vector3<f64>; 2]), String> {
        let found = self.values.run(inputs, &[]).map_err(|error| error.to_string())?;
        let (mut force, mut moment) = (Vector3::zeros(), Vector3::zeros());
        for part in found[2..].chunks_exact(9) {
            let vector = |at: usize| Vector3::new(part[at], part[at + 1], part[at + 2]);
            force += vector(3);
            moment += vector(6) + (vector(0) - about).cross(&vector(3));
        }
        Ok(([found[0], found[1]], [force, moment]))
    }
}

/// An angle with the whole turns that bring it nearest to another.
fn unwrapped(angle: f64, near: f64) -> f64 {
    angle + ((near - angle) / std::f64::consts::TAU).round() * std::f64::consts::TAU
}

/// The cubic polynomial of angle and speed at both ends, inverted: the time at which it has a value.
fn time_of(angle: f64, ends: [[f64; 3]; 2]) -> f64 {
    let [[t0, a0, w0], [t1, a1, w1]] = ends;
    let h = t1 - t0;
    let at = |x: f64| {
        let (rise, p, q) = (a1 - a0, h * w0, h * w1);
        a0 + x * (p + x * (3.0 * rise - 2.0 * p - q + x * (p + q - 2.0 * rise)))
    };
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if (at(middle) < angle) == (a1 > a0) { low = middle } else { high = middle }
    }
    t0 + 0.5 * (low + high) * h
}

/// The shaking forces of a scene in its last whole turns. `open` gives the scene anew: it is run twice.
///
/// # Errors
/// A coordinate that does not turn so often; a run that fails.
pub fn balance(
    open: &dyn Fn() -> Result<Session, SessionError>,
    question: &Question,
    progress: &mut dyn FnMut(f64),
) -> Result<Balance, SessionError> {
    let session = open()?;
    if question.turns == 0 || question.harmonics == 0 {
        let what = if question.turns == 0 { "turns" } else { "harmonics" };
        let diagnostic = Diagnostic::error(codes::OUT_OF_RANGE, format!("`{what}` cannot be 0"));
        return Err(refuse(&session, diagnostic.help("give a whole number, 1 or more")));
    }
    let turn = quantity(&session, &question.turn)?;
    let (joint, frame, body) = turning_joint(&session, &turn)?;
    let mut watch = Watch::new(&session, &turn);
    if watch.points == 0 {
        let help = "hold the machine by a joint to the ground, or look at its joints by outputs";
        return Err(cannot(&session, "no element of the scene reaches the ground: nothing shakes it".into(), help));
    }
    let marker = session.model.elements[joint].markers[frame].clone();
    let unit = session.scene.units.factor(Dimension::TIME);
    let times: Vec<f64> =
        session.scene.simulation.sample_times(&session.scene.units).iter().map(|time| time.si).collect();
    let about = Vector3::from(question.about);
    let failed = |session: &Session, reason: String| cannot(session, reason, "see what a run says");
    let layout = watch.layout.clone();
    // Where the angle is when.
    let mut seen: Vec<[f64; 3]> = Vec::with_capacity(times.len());
    let mut run = session.prepare()?.start()?;
    for (k, time) in times.iter().enumerate() {
        progress(0.5 * k as f64 / times.len() as f64);
        run.advance(time / unit)?;
        let instant = run.instant()?;
        let ([angle, rate], ..) = watch.at(&instant.inputs, about).map_err(|reason| failed(run.session(), reason))?;
        // Angles that no output counts over many turns begin anew.
        let foreseen = seen.last().map_or(angle, |[before, last, was]| last + 0.5 * (was + rate) * (time - before));
        seen.push([*time, unwrapped(angle, foreseen), rate]);
    }
    let session = open()?;
    let whole = std::f64::consts::TAU * question.turns.max(1) as f64;
    let last = seen.last().copied().unwrap_or([0.0; 3]);
    let sign = if last[2] < 0.0 { -1.0 } else { 1.0 };
    let first = seen.iter().rposition(|one| sign * (last[1] - one[1]) >= whole);
    let Some(first) = first else {
        let message = format!("`{}` does not turn {} times until the end of the run", turn.name, question.turns);
        return Err(cannot(&session, message, "let the run last longer (`--t-end`), or ask for fewer `--turns`"));
    };
    if seen[first..].windows(2).any(|pair| sign * (pair[1][1] - pair[0][1]) <= 0.0) {
        let message = format!("`{}` does not turn in one direction in its last {} turns", turn.name, question.turns);
        return Err(cannot(&session, message, "harmonics are those of turning; look at the outputs over time"));
    }
    let per_turn = SAMPLES.max(PER_HARMONIC * question.harmonics);
    let count = per_turn * question.turns.max(1);
    let wished: Vec<f64> = (0..count).map(|k| last[1] + sign * whole * (k as f64 / count as f64 - 1.0)).collect();
    let mut found = Balance {
        shaking: Shaking {
            angles: Vec::new(),
            times: Vec::new(),
            force: Vec::new(),
            moment: Vec::new(),
            harmonics: Vec::new(),
            force_rms: 0.0,
            force_peak: 0.0,
            moment_rms: 0.0,
            speed: 0.0,
            drift: 0.0,
        },
        turning: Vec::new(),
        joint,
        frame,
        body,
    };
    let mut run = session.prepare()?.start()?;
    for (k, angle) in wished.iter().enumerate() {
        progress(0.5 + 0.5 * k as f64 / count as f64);
        // It may have been there before, if it has turned back since.
        let after = (first + 1..seen.len()).find(|at| sign * (seen[*at][1] - angle) >= 0.0).unwrap_or(seen.len() - 1);
        run.advance(time_of(*angle, [seen[after - 1], seen[after]]) / unit)?;
        let instant = run.instant()?;
        let inputs = &instant.inputs;
        let ([found_angle, _], [force, moment]) =
            watch.at(inputs, about).map_err(|reason| failed(run.session(), reason))?;
        let angle = unwrapped(found_angle, *angle);
        let shaking = &mut found.shaking;
        shaking.angles.push(angle);
        shaking.times.push(instant.time);
        shaking.force.push(force.into());
        shaking.moment.push(moment.into());
        let vector = |at: usize| Vector3::new(inputs[at], inputs[at + 1], inputs[at + 2]);
        let matrix = rotation(&std::array::from_fn(|e| inputs[layout.body_slot(body, 3 + e)]));
        let accelerations = layout.acceleration_slot() + 6 * body;
        let (spin, acceleration) = (matrix * vector(layout.body_slot(body, 10)), matrix * vector(accelerations + 3));
        let arm = matrix * marker.position;
        let of_point = vector(accelerations) + acceleration.cross(&arm) + spin.cross(&spin.cross(&arm));
        found.turning.push(Turning {
            axes: [0, 1].map(|axis| matrix * marker.rotation.column(axis)),
            spin,
            acceleration,
            point: vector(layout.body_slot(body, 0)) + arm,
            moves: of_point.norm(),
        });
    }
    let speeds = |range: std::ops::Range<usize>| {
        let (from, to) = (range.start, range.end - 1);
        (found.shaking.angles[to] - found.shaking.angles[from]) / (found.shaking.times[to] - found.shaking.times[from])
    };
    let (early, late) = (speeds(0..per_turn), speeds(count - per_turn..count));
    (found.shaking.speed, found.shaking.drift) = (speeds(0..count), (late - early) / speeds(0..count));
    found.shaking.judge(question.harmonics);
    Ok(found)
}

/// Samples by cosines and sines of an angle, up to an order.
fn harmonics_of(angles: &[f64], order: usize) -> DMatrix<f64> {
    DMatrix::from_fn(angles.len(), 2 * order + 1, |row, column| {
        let k = column.div_ceil(2) as f64;
        if column % 2 == 1 || column == 0 { (k * angles[row]).cos() } else { (k * angles[row]).sin() }
    })
}

/// Coefficients by least squares: cosines and sines of each order.
fn coefficients(basis: &DMatrix<f64>, values: &DMatrix<f64>) -> DMatrix<f64> {
    let qr = basis.clone().qr();
    let right = qr.q().transpose() * values;
    qr.r().solve_upper_triangular(&right).unwrap_or_else(|| DMatrix::zeros(basis.ncols(), values.ncols()))
}

fn table(rows: &[[f64; 3]]) -> DMatrix<f64> {
    DMatrix::from_fn(rows.len(), 3, |row, column| rows[row][column])
}

impl Shaking {
    /// Harmonics and sizes of what was sampled.
    fn judge(&mut self, order: usize) {
        let basis = harmonics_of(&self.angles, order);
        let (force, moment) = (coefficients(&basis, &table(&self.force)), coefficients(&basis, &table(&self.moment)));
        let amplitude = |of: &DMatrix<f64>, k: usize| {
            std::array::from_fn(|c| if k == 0 { of[(0, c)] } else { of[(2 * k - 1, c)].hypot(of[(2 * k, c)]) })
        };
        self.harmonics = (0..=order)
            .map(|k| Harmonic { order: k, force: amplitude(&force, k), moment: amplitude(&moment, k) })
            .collect();
        let left = |rows: &[[f64; 3]], mean: &[f64; 3]| -> Vec<f64> {
            rows.iter().map(|row| (0..3).map(|c| (row[c] - mean[c]).powi(2)).sum::<f64>()).collect()
        };
        let forces = left(&self.force, &self.harmonics[0].force);
        let moments = left(&self.moment, &self.harmonics[0].moment);
        let mean = |squares: &[f64]| (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
        (self.force_rms, self.moment_rms) = (mean(&forces), mean(&moments));
        self.force_peak = forces.iter().copied().fold(0.0, f64::max).sqrt();
    }
}

impl Balance {
    /// What a unit of unbalance along an axis of the joint's frame puts on the ground at a sample, N per kg m.
    fn unit(turning: &Turning, axis: usize) -> Vector3<f64> {
        let s = &turning.axes[axis];
        -(turning.acceleration.cross(s) + turning.spin.cross(&turning.spin.cross(s)))
    }

    /// The counterweight at a radius, m, that makes the harmonics of the force least (none, where that takes no mass); and what it is
    /// to leave, if the machine turns as before. Without a radius, the mass is a tenth of that of the body, or more, nearer to the axis, where that would add
    /// more than a tenth to its moment of inertia.
    ///
    /// # Errors
    /// An axis that moves: the counterweight's force then depends on more than its unbalance.
    pub fn counterweight(
        &self,
        session: &Session,
        question: &Question,
        radius: Option<f64>,
    ) -> Result<(Counterweight, Shaking), SessionError> {
        let count = self.turning.len();
        let basis = harmonics_of(&self.shaking.angles, question.harmonics);
        let force = coefficients(&basis, &table(&self.shaking.force));
        let units = [0, 1].map(|axis| {
            let rows: Vec<[f64; 3]> = self.turning.iter().map(|one| Self::unit(one, axis).into()).collect();
            coefficients(&basis, &table(&rows))
        });
        let rows = 3 * (basis.ncols() - 1);
        let stacked = |of: &DMatrix<f64>| DVector::from_fn(rows, |k, _| of[(1 + k / 3, k % 3)]);
        let mut system = DMatrix::zeros(rows, 2);
        (0..2).for_each(|axis| system.set_column(axis, &stacked(&units[axis])));
        let values = SingularValues::of(&system);
        let unbalance = values.map_or_else(|| DVector::zeros(2), |values| values.solve(&-stacked(&force), 0.0));
        let size = unbalance.norm();
        let own = &session.model.bodies[self.body];
        let marker = &session.model.elements[self.joint].markers[self.frame];
        let axis = marker.rotation.column(2);
        let inertia = axis.dot(&(own.own_inertia() * axis));
        // Balanced, or shaken by what has no first harmonic.
        if size <= NO_UNBALANCE * (inertia * own.own_mass()).sqrt() {
            let none = Counterweight {
                body: own.name.clone(),
                mass: 0.0,
                radius: 0.0,
                phase: 0.0,
                unbalance: 0.0,
                position: (marker.position + own.center_of_mass).into(),
                set: String::new(),
            };
            return Ok((none, self.shaking.clone()));
        }
        let (light, slow) = (size / (0.1 * own.own_mass()), 0.1 * inertia / size);
        let radius = radius.unwrap_or(if inertia > 0.0 { light.min(slow) } else { light });
        if !(size > 0.0 && radius > 0.0) {
            return Err(cannot(session, "no counterweight makes the force less".into(), "see the harmonics"));
        }
        let mass = size / radius;
        let steady = self.shaking.speed.powi(2) * radius;
        if let Some(moving) = self.turning.iter().find(|one| one.moves > STANDS * steady) {
            let message = format!(
                "the axis of `{}` moves, by {:.1e} m/s^2: a counterweight on `{}` does more than turn",
                question.turn, moving.moves, own.name
            );
            return Err(cannot(session, message, "name a joint whose axis stands still"));
        }
        let direction = (marker.rotation.column(0) * unbalance[0] + marker.rotation.column(1) * unbalance[1]) / size;
        let position = marker.position + own.center_of_mass + direction * radius;
        let units_of = &session.scene.units;
        let (l, m) = (units_of.factor(Dimension::LENGTH), units_of.factor(Dimension::MASS));
        // Masses that the body has already stay.
        let record = session.scene.bodies.iter().find(|body| body.name.value == own.name);
        let mut masses: Vec<(f64, [f64; 3])> = record
            .map_or_else(Vec::new, |body| body.point_masses.iter().map(|one| (one.mass.value, one.position)).collect());
        masses.push((mass, position.into()));
        let list: Vec<String> = masses
            .iter()
            .map(|(mass, [x, y, z])| {
                format!("{{ mass = {:?}, position = [{:?}, {:?}, {:?}] }}", mass / m, x / l, y / l, z / l)
            })
            .collect();
        let set = format!("{}.point_masses=[{}]", own.name, list.join(", "));
        let weight = mass * session.model.gravity;
        let mut left = self.shaking.clone();
        let about = Vector3::from(question.about);
        for k in 0..count {
            let one = &self.turning[k];
            let own = Self::unit(one, 0) * unbalance[0] + Self::unit(one, 1) * unbalance[1] + weight;
            let arm = one.point + (one.axes[0] * unbalance[0] + one.axes[1] * unbalance[1]) / mass - about;
            left.force[k] = (Vector3::from(left.force[k]) + own).into();
            left.moment[k] = (Vector3::from(left.moment[k]) + arm.cross(&own)).into();
        }
        left.judge(question.harmonics);
        let weight = Counterweight {
            body: own.name.clone(),
            mass,
            radius,
            phase: unbalance[1].atan2(unbalance[0]),
            unbalance: size,
            position: position.into(),
            set,
        };
        Ok((weight, left))
    }
}
