//! [`Loads`]: everything that acts on one body at some instants, in the axes of the body, as a finite-element program takes it.
//!
//! By d'Alembert the reactions of joints, the loads of force elements and the weight are in balance with the loads of inertia,
//! -m a at the centre of mass and -(J alpha + omega x J omega). What is left of their sum is reported: it is round-off, or the deck is
//! not to be used. (R. R. Craig & A. J. Kurdila, Fundamentals of Structural Dynamics, 2006, on inertia relief.)
//!
//! Of a body that turns, inertia is a field: g - a along all of it, omega^2 r from the axis through the centre of mass, and
//! -alpha x r. Finite elements with the body's mass make the first two of it (gravity, centrifugal load); the third has no such load in
//! CalculiX and is given as the moment -J alpha.

use std::fmt::Write as _;
use std::sync::atomic::{AtomicBool, Ordering};

use nalgebra::{Matrix3, Vector3};
use serde::Serialize;

use crate::analysis::Evaluator;
use crate::diagnostics::{Diagnostic, codes, suggest};
use crate::linear::refuse;
use crate::model::{Axes, Quantity, rotation};
use crate::program::Node;
use crate::scene::Dimension;
use crate::session::{Instant, Session, SessionError};

/// A peak counts from this share of the largest force, or moment, on.
const PEAK: f64 = 1e-6;
/// What is nearer to the largest than this share of it is as large, but for round-off.
const ALIKE: f64 = 1e-9;
/// Characters of names of node sets that come from an element; CalculiX reads 80.
const LONGEST_NAME: usize = 64;

/// Where an element holds or loads a body.
#[derive(Debug, Clone, Serialize)]
pub struct Attachment {
    /// The element.
    pub element: String,
    /// `joint` or `force`.
    pub kind: String,
    /// Which of its frames, from 1.
    pub frame: usize,
    /// The frame's origin in the frame of the body, m.
    pub point: [f64; 3],
}

/// A force, N, and a moment about the point where it acts, N m; axes of the body.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Wrench {
    /// N.
    pub force: [f64; 3],
    /// N m.
    pub moment: [f64; 3],
}

/// The loads at one instant.
#[derive(Debug, Clone, Serialize)]
pub struct Case {
    /// s.
    pub time: f64,
    /// Why this time was taken.
    pub why: String,
    /// By attachment.
    pub wrenches: Vec<Wrench>,
    /// Gravity less the acceleration of the centre of mass, m/s^2: what acts on every kilogram.
    pub field: [f64; 3],
    /// Weight, at the centre of mass, N.
    pub weight: [f64; 3],
    /// -m a and -(J alpha + omega x J omega), at the centre of mass.
    pub inertia: Wrench,
    /// Angular velocity, rad/s.
    pub spin: [f64; 3],
    /// -J alpha, N m: the part of it that is no gravity and no centrifugal load.
    pub euler: [f64; 3],
    /// What is left of all forces, and of all moments about the centre of mass, as a share of their sizes.
    pub left: [f64; 2],
}

/// The loads of a body.
#[derive(Debug, Clone, Serialize)]
pub struct Loads {
    /// Its name.
    pub body: String,
    /// kg.
    pub mass: f64,
    /// The centre of mass in the frame of the body, m.
    pub center_of_mass: [f64; 3],
    /// About it, axes of the body, kg m^2.
    pub inertia: [[f64; 3]; 3],
    /// What holds or loads it.
    pub attachments: Vec<Attachment>,
    /// At each instant.
    pub cases: Vec<Case>,
    /// What has to be known about them.
    pub notes: Vec<String>,
}

/// Evaluates the loads of one body at instants of a run.
pub struct Watch {
    body: usize,
    layout: crate::plan::Layout,
    gravity: Vector3<f64>,
    tensor: Matrix3<f64>,
    values: Evaluator,
    /// What was found so far.
    pub loads: Loads,
}

impl Watch {
    /// Of a body of a session, before that is prepared to run.
    ///
    /// # Errors
    /// The names of the bodies, if there is none of this name.
    pub fn new(session: &Session, name: &str) -> Result<Self, SessionError> {
        let (model, layout) = (&session.model, session.plan.layout.clone());
        let Some(body) = model.bodies.iter().position(|body| body.name == name) else {
            let known: Vec<&str> = model.bodies.iter().map(|body| body.name.as_str()).collect();
            let help = match suggest(name, known.iter().copied()) {
                Some(nearest) => format!("did you mean `{nearest}`?"),
                None => format!("known are {}", known.join(", ")),
            };
            let message = format!("there is no body `{name}` that moves");
            return Err(refuse(session, Diagnostic::error(codes::UNKNOWN_TARGET, message).help(help)));
        };
        let mut equations = session.equations.clone();
        let own = &model.bodies[body];
        let (mut nodes, mut attachments): (Vec<Node>, Vec<Attachment>) = (Vec::new(), Vec::new());
        let mut notes = Vec::new();
        for (element, instance) in model.elements.iter().enumerate() {
            let kind = instance.class.kind.word();
            if kind == "control" {
                continue;
            }
            let mut frames: Vec<usize> =
                (0..instance.markers.len()).filter(|frame| instance.markers[*frame].body == Some(body)).collect();
            if kind == "joint" {
                // What a joint does to a body is reported at its first frame there.
                frames.truncate(1);
            }
            for frame in frames {
                for torque in [false, true] {
                    nodes.extend((0..3).map(|component| {
                        let load = Quantity::Load { element, frame, torque, axes: Axes::Body(body), component };
                        equations.observe(&load, model, &layout)
                    }));
                }
                let point = instance.markers[frame].position + own.center_of_mass;
                attachments.push(Attachment {
                    element: instance.name.clone(),
                    kind: kind.into(),
                    frame: frame + 1,
                    point: point.into(),
                });
            }
            let shared = session.plan.reactions.iter().any(|one| one.element == element && !one.is_unique());
            if kind == "joint" && shared && instance.markers.iter().any(|marker| marker.body == Some(body)) {
                notes.push(format!(
                    "`{}` shares its reaction with redundant joints: it is one of many that are in balance",
                    instance.name
                ));
            }
        }
        if own.particle {
            notes.push("it is a particle: it has no moments".into());
        }
        let inertia = own.own_inertia();
        Ok(Self {
            body,
            gravity: model.gravity,
            tensor: inertia,
            values: Evaluator::new(&equations.graph, &nodes),
            layout,
            loads: Loads {
                body: name.into(),
                mass: own.own_mass(),
                center_of_mass: own.center_of_mass.into(),
                inertia: std::array::from_fn(|i| std::array::from_fn(|j| inertia[(i, j)])),
                attachments,
                cases: Vec::new(),
                notes,
            },
        })
    }

    /// The loads at an instant.
    ///
    /// # Errors
    /// An element that fails, in words.
    pub fn at(&mut self, instant: &Instant, why: &str) -> Result<Case, String> {
        let inputs = &instant.inputs;
        let found = self.values.run(inputs, &[]).map_err(|error| error.to_string())?;
        let vector = |at: usize| Vector3::new(inputs[at], inputs[at + 1], inputs[at + 2]);
        let turn = rotation(&std::array::from_fn(|k| inputs[self.layout.body_slot(self.body, 3 + k)]));
        let spin = vector(self.layout.body_slot(self.body, 10));
        let at = self.layout.acceleration_slot() + 6 * self.body;
        let (acceleration, angular) = (turn.transpose() * vector(at), vector(at + 3));
        let gravity = turn.transpose() * self.gravity;
        let mass = self.loads.mass;
        let euler = -(self.tensor * angular);
        let gyroscopic = -spin.cross(&(self.tensor * spin));
        let center = Vector3::from(self.loads.center_of_mass);
        let (mut force, mut moment) = (mass * (gravity - acceleration), euler + gyroscopic);
        let mut sizes = [mass * (gravity.norm() + acceleration.norm()), euler.norm() + gyroscopic.norm()];
        // Loads that all pass through the centre of mass have arms of round-off: the size of a moment is that on the radius of gyration.
        // Likewise forces that are round-off of the torques beside them.
        let gyration = self.loads.gyration();
        let mut torques = sizes[1];
        let mut wrenches = Vec::with_capacity(self.loads.attachments.len());
        for (attachment, values) in self.loads.attachments.iter().zip(found.chunks_exact(6)) {
            let (own, torque) =
                (Vector3::new(values[0], values[1], values[2]), Vector3::new(values[3], values[4], values[5]));
            let arm = Vector3::from(attachment.point) - center;
            force += own;
            moment += torque + arm.cross(&own);
            sizes[0] += own.norm();
            torques += torque.norm();
            sizes[1] += torque.norm() + arm.norm().max(gyration) * own.norm();
            wrenches.push(Wrench { force: own.into(), moment: torque.into() });
        }
        if gyration > 0.0 {
            sizes[0] = sizes[0].max(torques / gyration);
        }
        let share = |left: f64, size: f64| if size > 0.0 { left / size } else { 0.0 };
        Ok(Case {
            time: instant.time,
            why: why.into(),
            wrenches,
            field: (gravity - acceleration).into(),
            weight: (mass * gravity).into(),
            inertia: Wrench { force: (-mass * acceleration).into(), moment: (euler + gyroscopic).into() },
            spin: spin.into(),
            euler: euler.into(),
            left: [share(force.norm(), sizes[0]), share(moment.norm(), sizes[1])],
        })
    }
}

/// The loads on a body: at times, in the scene's unit, or where a force or moment on it is largest among the output times. `stop` leaves
/// out the times that are left.
///
/// # Errors
/// Those of [`Watch::new`]; a run that does not get there; an element that fails.
pub fn loads(
    session: Session,
    body: &str,
    times: Option<&[f64]>,
    progress: &mut dyn FnMut(f64),
    stop: &AtomicBool,
) -> Result<Loads, SessionError> {
    let mut watch = Watch::new(&session, body)?;
    let units = &session.scene.units;
    let unit = units.factor(Dimension::TIME);
    let mut all: Vec<f64> = match times {
        Some(times) => times.to_vec(),
        None => session.scene.simulation.sample_times(units).iter().map(|time| time.si / unit).collect(),
    };
    all.sort_by(f64::total_cmp);
    let mut run = session.prepare()?.start()?;
    let mut cases = Vec::with_capacity(all.len());
    for (k, time) in all.iter().enumerate() {
        if stop.load(Ordering::Relaxed) {
            break;
        }
        progress(k as f64 / all.len() as f64);
        run.advance(*time)?;
        let instant = run.instant()?;
        let case = watch.at(&instant, "asked for");
        cases.push(case.map_err(|reason| refuse(run.session(), Diagnostic::error(codes::MOTION_NOT_FINITE, reason)))?);
    }
    let mut found = watch.loads;
    found.cases = if times.is_none() { peaks(&found, &cases) } else { cases };
    Ok(found)
}

/// The peaks of loads: for each attachment the cases of the largest force and the largest moment, each time once. Of what is constant
/// but for round-off that is the first.
#[must_use]
pub fn peaks(loads: &Loads, cases: &[Case]) -> Vec<Case> {
    let size = |of: &[f64; 3]| of.iter().map(|x| x * x).sum::<f64>().sqrt();
    let mut chosen: Vec<(usize, String)> = Vec::new();
    // What round-off leaves has no peak.
    let largest = |of: &dyn Fn(&Wrench) -> f64| {
        let all = cases.iter().flat_map(|case| case.wrenches.iter().chain([&case.inertia]));
        all.map(of).fold(0.0, f64::max)
    };
    let (force, moment) = (largest(&|one| size(&one.force)), largest(&|one| size(&one.moment)));
    let gyration = loads.gyration();
    let of_moment = if gyration > 0.0 { moment / gyration } else { 0.0 };
    let least = [PEAK * force.max(PEAK * of_moment), PEAK * moment];
    for (k, attachment) in loads.attachments.iter().enumerate() {
        for moment in [false, true] {
            let of = |case: &Case| {
                let wrench = &case.wrenches[k];
                size(if moment { &wrench.moment } else { &wrench.force })
            };
            let largest = cases.iter().map(of).fold(0.0, f64::max);
            if largest <= least[usize::from(moment)] {
                continue;
            }
            let Some(at) = cases.iter().position(|case| of(case) >= (1.0 - ALIKE) * largest) else { continue };
            let why = format!("largest {} of {}", if moment { "moment" } else { "force" }, attachment.element);
            match chosen.iter_mut().find(|(place, _)| *place == at) {
                Some((_, own)) => {
                    own.push_str(", ");
                    own.push_str(&why);
                }
                None => chosen.push((at, why)),
            }
        }
    }
    chosen.sort_by_key(|(at, _)| *at);
    chosen.into_iter().map(|(at, why)| Case { why, ..cases[at].clone() }).collect()
}

/// The node set that takes the moment of angular acceleration.
const EULER: &str = "N_EULER";

/// A set of units in which a finite-element model is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Consistent {
    /// m, N, kg, s.
    Metres,
    /// mm, N, t, s.
    Millimetres,
}

impl Consistent {
    fn length(self) -> f64 {
        if self == Self::Metres { 1.0 } else { 1e3 }
    }

    fn words(self) -> &'static str {
        if self == Self::Metres { "m, N, kg, s" } else { "mm, N, t, s" }
    }
}

impl Loads {
    /// The radius of gyration about the mean axis, m; zero of a particle, and without mass.
    fn gyration(&self) -> f64 {
        let trace: f64 = (0..3).map(|k| self.inertia[k][k]).sum();
        if self.mass > 0.0 { (0.5 * trace / self.mass).sqrt() } else { 0.0 }
    }

    /// What is left of all loads at worst, as a share of their sizes.
    #[must_use]
    pub fn left(&self) -> f64 {
        self.cases.iter().flat_map(|case| case.left).fold(0.0, f64::max)
    }

    /// One row per case and load: at its point in the frame of the body, in the axes of the body.
    #[must_use]
    pub fn csv(&self, units: Consistent) -> String {
        let l = units.length();
        let unit = if units == Consistent::Metres { "m" } else { "mm" };
        let mut text = format!("# axes and origin of the frame of the body; units {}\n", units.words());
        text += "t [s],load,kind,";
        let _ = writeln!(
            text,
            "x [{unit}],y [{unit}],z [{unit}],Fx [N],Fy [N],Fz [N],Mx [N {unit}],My [N {unit}],Mz [N {unit}]"
        );
        for case in &self.cases {
            let mut row = |name: &str, kind: &str, point: &[f64; 3], force: &[f64; 3], moment: &[f64; 3]| {
                let _ = write!(text, "{:?},{},{kind}", case.time, crate::files::cell(name));
                let values =
                    point.iter().map(|x| x * l).chain(force.iter().copied()).chain(moment.iter().map(|x| x * l));
                values.for_each(|value| {
                    let _ = write!(text, ",{value:?}");
                });
                text.push('\n');
            };
            for (attachment, wrench) in self.attachments.iter().zip(&case.wrenches) {
                row(&attachment.element, &attachment.kind, &attachment.point, &wrench.force, &wrench.moment);
            }
            row("weight", "gravity", &self.center_of_mass, &case.weight, &[0.0; 3]);
            row("inertia", "inertia", &self.center_of_mass, &case.inertia.force, &case.inertia.moment);
        }
        text
    }

    /// A node set for each attachment, all different: CalculiX does not tell small letters from capitals.
    fn node_sets(&self) -> Vec<String> {
        let mut names = vec![EULER.to_owned()];
        for attachment in &self.attachments {
            let usable = |c: char| if c.is_ascii_alphanumeric() { c.to_ascii_uppercase() } else { '_' };
            let mut name: String =
                "N_".chars().chain(attachment.element.chars().map(usable)).take(LONGEST_NAME).collect();
            if self.attachments.iter().filter(|one| one.element == attachment.element).count() > 1 {
                let _ = write!(name, "_{}", attachment.frame);
            }
            let others = (2..).map(|count| format!("{name}_{count}"));
            let free = std::iter::once(name.clone()).chain(others).find(|free| !names.contains(free));
            names.extend(free);
        }
        names.split_off(1)
    }

    /// Reference nodes with rigid bodies on node sets of the mesh, and a static step per case: `*CLOAD` at the reference nodes,
    /// gravity and centrifugal loads on an element set (CalculiX CrunchiX User's Manual 2.20, `*RIGID BODY`, `*DLOAD`). The first text is
    /// for the part of the input file before its steps, the others for its end, one for each job:
    /// CalculiX 2.20 takes a centrifugal load in its first step only.
    #[must_use]
    pub fn calculix(&self, units: Consistent, elements: &str, first_node: usize) -> (String, Vec<String>) {
        let l = units.length();
        let center = self.center_of_mass.map(|x| x * l);
        let mut names = self.node_sets();
        names.push(EULER.into());
        let mut head = format!(
            "** Loads on `{}`: reference nodes in the frame of the body. Units: {}.\n\
             ** Define a node set of the mesh for each: the surface that the joint or force takes hold of.\n\
             ** N_EULER takes the moment of angular acceleration, and is held: a few nodes near the centre of mass that no other set has.\n",
            self.body,
            units.words()
        );
        let points = self.attachments.iter().map(|one| one.point.map(|x| x * l)).chain([center]);
        for (k, (point, name)) in points.zip(&names).enumerate() {
            let node = first_node + 2 * k;
            let [x, y, z] = point;
            if let Some(Attachment { element, kind, frame, .. }) = self.attachments.get(k) {
                let _ = writeln!(head, "** {name}: {kind} `{element}`, frame {frame}");
            }
            let _ = write!(
                head,
                "*NODE, NSET=REF{name}\n{node}, {x:.12e}, {y:.12e}, {z:.12e}\n{}, {x:.12e}, {y:.12e}, {z:.12e}\n\
                 *RIGID BODY, NSET={name}, REF NODE={node}, ROT NODE={}\n",
                node + 1,
                node + 1
            );
        }
        let held = first_node + 2 * self.attachments.len();
        let _ = write!(head, "*BOUNDARY\n{held}, 1, 3\n{}, 1, 3\n", held + 1);
        let begin = format!(
            "** `{}`: all loads of an instant, as a job of its own. They are in balance: what is printed for N_EULER is the\n\
             ** share of GRAV and CENTRIF of its own nodes (RF has all external forces there), its moment, and what is left.\n\
             ** The elements must have the mass {:.9e} and the centre of mass ({:.6e}, {:.6e}, {:.6e}).\n",
            self.body,
            if units == Consistent::Metres { self.mass } else { self.mass * 1e-3 },
            center[0],
            center[1],
            center[2]
        );
        let step = |case: &Case| {
            let mut steps = begin.clone();
            let _ = writeln!(steps, "** t = {:?} s: {}", case.time, case.why);
            steps += "*STEP\n*STATIC\n*CLOAD, OP=NEW\n";
            let euler = Wrench { force: [0.0; 3], moment: case.euler };
            for (k, wrench) in case.wrenches.iter().chain([&euler]).enumerate() {
                let node = first_node + 2 * k;
                for (at, values) in [(node, wrench.force), (node + 1, wrench.moment.map(|x| x * l))] {
                    for (direction, value) in values.iter().enumerate().filter(|(_, value)| **value != 0.0) {
                        let _ = writeln!(steps, "{at}, {}, {value:.12e}", direction + 1);
                    }
                }
            }
            steps += "*DLOAD, OP=NEW\n";
            let field = Vector3::from(case.field) * l;
            let size = field.norm();
            if size > 0.0 {
                let n = field / size;
                let _ = writeln!(steps, "{elements}, GRAV, {size:.12e}, {:.12e}, {:.12e}, {:.12e}", n.x, n.y, n.z);
            }
            let spin = Vector3::from(case.spin);
            let square = spin.norm_squared();
            if square > 0.0 {
                let n = spin / square.sqrt();
                let _ = writeln!(
                    steps,
                    "{elements}, CENTRIF, {square:.12e}, {:.12e}, {:.12e}, {:.12e}, {:.12e}, {:.12e}, {:.12e}",
                    center[0], center[1], center[2], n.x, n.y, n.z
                );
            }
            steps += "*NODE PRINT, NSET=REFN_EULER\nRF\n*END STEP\n";
            steps
        };
        let steps = self.cases.iter().map(step).collect();
        (head, steps)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Loads whose attachments have these elements, with a moment of each at some times, s.
    fn of(elements: &[(&str, usize)], moments: &[&[f64]]) -> Loads {
        let attachment = |(element, frame): &(&str, usize)| Attachment {
            element: (*element).into(),
            kind: "force".into(),
            frame: *frame,
            point: [0.0; 3],
        };
        let none = Wrench { force: [0.0; 3], moment: [0.0; 3] };
        let case = |(k, moments): (usize, &&[f64])| Case {
            time: k as f64,
            why: "asked for".into(),
            wrenches: moments.iter().map(|moment| Wrench { moment: [0.0, *moment, 0.0], ..none }).collect(),
            field: [0.0; 3],
            weight: [0.0; 3],
            inertia: none,
            spin: [0.0; 3],
            euler: [0.0; 3],
            left: [0.0; 2],
        };
        Loads {
            body: "body".into(),
            mass: 1.0,
            center_of_mass: [0.0; 3],
            inertia: [[0.0; 3]; 3],
            attachments: elements.iter().map(attachment).collect(),
            cases: moments.iter().enumerate().map(case).collect(),
            notes: Vec::new(),
        }
    }

    #[test]
    fn what_is_constant_has_its_peak_at_the_start() {
        let moments: [&[f64]; 4] = [&[2.0, 1.0], &[2.0 + 5e-16, 3.0], &[2.0 - 4e-16, 3.0 + 1e-6], &[2.0 + 9e-16, 3.0]];
        let loads = of(&[("twist", 2), ("spring", 2)], &moments);
        let found: Vec<(f64, String)> =
            peaks(&loads, &loads.cases).into_iter().map(|case| (case.time, case.why)).collect();
        let expected = [(0.0, "largest moment of twist".to_owned()), (2.0, "largest moment of spring".to_owned())];
        assert_eq!(found, expected);
    }

    #[test]
    fn node_sets_are_all_different() {
        let long = "x".repeat(100);
        let elements =
            [("Ball", 1), ("ball", 2), ("euler", 1), ("a-b", 1), ("a_b", 1), ("a_b_2", 1), ("rod", 1), ("rod", 2)];
        let elements: Vec<(&str, usize)> = elements.into_iter().chain([(long.as_str(), 1)]).collect();
        let loads = of(&elements, &[]);
        let names = loads.node_sets();
        let expected = ["N_BALL", "N_BALL_2", "N_EULER_2", "N_A_B", "N_A_B_2", "N_A_B_2_2", "N_ROD_1", "N_ROD_2"];
        assert_eq!(names[..8], expected);
        assert!(names.iter().all(|name| name.len() <= 72), "{names:?}");
        let (head, _) = loads.calculix(Consistent::Metres, "EALL", 1);
        for said in ["** N_BALL_2: force `ball`, frame 2\n*NODE, NSET=REFN_BALL_2\n3, ", "NSET=N_EULER, REF NODE=19, "]
        {
            assert!(head.contains(said), "{said}: {head}");
        }
    }
}
