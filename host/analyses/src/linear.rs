//! [`Linear`]: a scene linearised at an instant, in as many coordinates as it has freedoms.
//!
//! With N a basis of the motions that the rows allow (null space of their Jacobian), small changes are delta x = N xi + X sigma for
//! positions and delta v = V (xi, sigma) + N' eta for velocities: sigma of element states, which may move rows (servos), X from the
//! rows, V from their rates, N' with the rows on velocities too.
//! Changes of accelerations and multipliers solve
//!
//! [dR/da dR/dlambda; -Phi_q 0] [da; dlambda] = -[dR; dG],   R = Q - M a - Phi_q^T lambda,  G = gamma - Phi_q a,
//!
//! with independent rows; forces that depend on a and lambda are in dR/da and dR/dlambda. (Haug 1989, ch. 9; Negrut & Ortiz 2006, "A
//! practical approach for the linearization of the constrained multibody dynamics equations".) Bases stay as they are, or turn with axes
//! W: then W x (delta x, delta v) is taken off their rates. The linearisation is frozen in time where the state moves, and exact where it is
//! at rest, turns about axes of symmetry, or turns as one with W.

mod motion;
mod solve;
mod steady;

use nalgebra::{DMatrix, Vector3};
use serde::Serialize;

use crate::analysis::{Direction, Expansion, Freedom, Function, Local};
use crate::diagnostics::{Diagnostic, codes, suggest};
use crate::eigen::Spectrum;
use crate::energies::{Carried, own_masses};
use crate::model::{Model as SceneModel, Quantity};
use crate::program::Equations;
use crate::round_off::{RoundOff, by_mass};
use crate::session::{Instant, Session, SessionError};
use solve::solve;

pub use crate::plain::Model;

/// Accelerations below this share of what a body's loads would give alone are none.
pub(crate) const NO_ACCELERATION: f64 = 1e-7;

/// Change of a mode, on its size and while it turns by a radian, from which on a model changes too fast for its eigenvalues.
pub(crate) const SLOW: f64 = 1e-3;

/// A signal that goes in or comes out.
#[derive(Debug, Clone, Serialize)]
pub struct Port {
    /// Name in the scene.
    pub name: String,
    /// Unit of its values.
    pub unit: String,
    /// One of these in SI.
    #[serde(skip)]
    pub factor: f64,
    /// Its value at the instant, in its unit.
    pub value: f64,
}

/// z' = A z + B u, y = C z + D u, for small changes. Time in s; z in SI; u and y in the units of their ports.
#[derive(Debug, Clone)]
pub struct Linear {
    /// s.
    pub time: f64,
    /// Rates by states.
    pub a: DMatrix<f64>,
    /// Rates by inputs.
    pub b: DMatrix<f64>,
    /// Outputs by states.
    pub c: DMatrix<f64>,
    /// Outputs by inputs.
    pub d: DMatrix<f64>,
    /// Names of the states: `q1`, ... independent coordinates, `u1`, ... their rates, then `element: state k`.
    pub states: Vec<String>,
    /// How many of them are coordinates.
    pub coordinates: usize,
    /// What goes in.
    pub inputs: Vec<Port>,
    /// What comes out.
    pub outputs: Vec<Port>,
    /// How many of them are states of elements, at the end.
    pub element_states: usize,
    /// Displacements and small turns of all bodies, six each, ground axes, by states.
    pub positions: DMatrix<f64>,
    /// Velocities and angular velocities of all bodies, the same.
    pub velocities: DMatrix<f64>,
    /// From displacements of all bodies to coordinates, and from changes of their velocities to those of the rates.
    components: [DMatrix<f64>; 2],
    /// The eigenvalues of [`Linear::a`], where they were needed already.
    pub(crate) spectrum: Option<Spectrum>,
    /// Loads of force elements by states, at fixed velocities and element states: see [`Load`].
    pub(crate) loads: DMatrix<f64>,
    pub(crate) expansion: Expansion,
    pub(crate) load_list: Vec<Load>,
    pub(crate) round_off: RoundOff,
    /// Names of the bodies.
    pub bodies: Vec<String>,
    /// Masses of bodies without those of elements, ground axes; elements with kinetic energy.
    pub(crate) own_masses: Vec<DMatrix<f64>>,
    pub(crate) carried: Vec<Carried>,
    /// What the linearisation does not say by itself.
    pub notes: Vec<String>,
    /// Whether the scene neither moves nor accelerates there.
    pub at_rest: bool,
    /// Angular velocity of the axes in which states are seen, rad/s, ground axes: that with which the scene turns as one, if it does,
    /// and the motion is not steady in axes of the ground.
    pub turning: Vector3<f64>,
    /// The largest change of a mode along the motion, on its size, while the mode turns by one radian; zero where the scene is at rest
    /// and its loads do not depend on time, and where the motion is steady in those axes.
    pub unsteadiness: f64,
}

/// The six components of a force element's load at a frame, among the derivatives that are kept for energies.
#[derive(Debug, Clone)]
pub(crate) struct Load {
    pub(crate) element: String,
    /// Whether it follows signals, as that of a controller: what it does is no potential energy.
    pub(crate) follows_signals: bool,
    pub(crate) body: usize,
    /// From the centre of mass to the frame, m, ground axes.
    pub(crate) arm: Vector3<f64>,
    /// At the instant, N.
    pub(crate) force: Vector3<f64>,
}

/// Refuses with a diagnostic of the scene.
pub(crate) fn refuse(session: &Session, diagnostic: Diagnostic) -> SessionError {
    SessionError::one(&session.scene.source, diagnostic)
}

/// Refuses elements that have no exact derivatives.
pub(crate) fn check_elements(session: &Session, what: &str) -> Result<(), SessionError> {
    let opaque = Local::opaque(&session.equations, &session.model);
    let Session { model, .. } = session;
    let foreign = model.elements.iter().find(|element| model.fmus.iter().any(|fmu| fmu.package == element.library));
    if let Some(element) = foreign {
        let message =
            format!("{what} need the equations of all elements, and those of the FMU `{}` are not known", element.name);
        let help = "leave it out (`enabled = false`) and give its outputs from elsewhere, or look at a run";
        return Err(refuse(session, Diagnostic::error(codes::UNKNOWN_METHOD, message).help(help)));
    }
    if opaque.is_empty() {
        return Ok(());
    }
    let message =
        format!("{what} need the derivatives of all elements, and those of {} are not known", opaque.join(", "));
    let help =
        "it is opaque: its equations are called, not recorded. Take an element whose equations are recorded, or a run";
    Err(refuse(session, Diagnostic::error(codes::UNKNOWN_METHOD, message).help(help)))
}

/// Rows of the equations in force with some contacts closed.
pub(crate) fn rows_in_force(equations: &Equations, closed: &[usize]) -> Vec<usize> {
    if !equations.switches_rows() {
        return equations.enforced().collect();
    }
    equations.with_closed(closed).enforced().collect()
}

/// Load quantities of all force elements on bodies, six per frame, with where they act.
fn loads_of(model: &SceneModel) -> (Vec<Quantity>, Vec<(usize, usize, usize)>) {
    let (mut quantities, mut places) = (Vec::new(), Vec::new());
    for (element, instance) in model.elements.iter().enumerate() {
        if instance.class.kind.word() != "force" {
            continue;
        }
        for (frame, marker) in instance.markers.iter().enumerate() {
            let Some(body) = marker.body else { continue };
            places.push((element, frame, body));
            for torque in [false, true] {
                quantities.extend((0..3).map(|component| Quantity::Load {
                    element,
                    frame,
                    torque,
                    axes: crate::model::Axes::Ground,
                    component,
                }));
            }
        }
    }
    (quantities, places)
}

impl Linear {
    /// Of a scene at an instant, with inputs and outputs by name; `None`: all of the scene.
    ///
    /// # Errors
    /// Opaque elements; names that the scene does not have; a state at which the motion is not determined.
    pub fn at(
        session: &Session,
        instant: &Instant,
        inputs: Option<&[String]>,
        outputs: Option<&[String]>,
    ) -> Result<Self, SessionError> {
        let (mut linear, mut local, in_ground_axes) = Self::of_instant(session, instant, inputs, outputs)?;
        let (layout, length) = (&session.plan.layout, session.assembly.scales.length);
        let axes = linear
            .ahead(session, instant)
            .map(|mut later| steady::axes(&linear, instant, &mut local, (layout, length), &mut *later));
        linear.stay(axes.unwrap_or_default(), in_ground_axes);
        linear.say(session, instant, &local);
        Ok(linear)
    }

    /// The same of a scene that is held at rest, with all inputs and outputs: loads that change with time are those of the instant.
    ///
    /// # Errors
    /// As for [`Linear::at`].
    pub(crate) fn at_rest(session: &Session, instant: &Instant) -> Result<Self, SessionError> {
        let (mut linear, local, in_ground_axes) = Self::of_instant(session, instant, None, None)?;
        linear.notes.extend(in_ground_axes);
        linear.say(session, instant, &local);
        Ok(linear)
    }

    /// Without what becomes of it later; with its derivatives, and what is to be said of its motion in axes of the ground.
    fn of_instant(
        session: &Session,
        instant: &Instant,
        inputs: Option<&[String]>,
        outputs: Option<&[String]>,
    ) -> Result<(Self, Local, Vec<String>), SessionError> {
        check_elements(session, "linearisations")?;
        let (model, layout) = (&session.model, &session.plan.layout);
        let chosen_in = choose(session, "input", inputs, model.inputs.iter().map(|input| input.name.as_str()))?;
        let chosen_out = choose(session, "output", outputs, model.channels.iter().map(|one| one.name.as_str()))?;
        let mut quantities: Vec<Quantity> =
            chosen_out.iter().map(|channel| model.channels[*channel].quantity.clone()).collect();
        let (loads, places) = loads_of(model);
        quantities.extend(loads);
        let rows = match instant.released == session.equations.released() {
            true => rows_in_force(&session.equations, &instant.closed),
            false => {
                let mut since = session.equations.clone();
                since.let_go(&instant.released);
                rows_in_force(&since, &instant.closed)
            }
        };
        let length = session.assembly.scales.length;
        let mut local = Local::new(&session.equations, model, layout, (&rows, length), &quantities);
        let failed = |error: &dyn std::fmt::Display| {
            let message = format!("the scene cannot be linearised at {} s: {error}", instant.time);
            refuse(session, Diagnostic::error(codes::SINGULAR_MASS, message))
        };
        let expansion = local.at(&instant.inputs).map_err(|error| failed(&error))?;
        let mut linear = reduce(&expansion).map_err(|reason| failed(&reason))?;
        linear.time = instant.time;
        linear.drop_round_off();
        // From SI to the units of the ports.
        let given = |input: usize| instant.inputs[layout.given_slot(input)];
        linear.inputs = (chosen_in.iter().map(|input| (&model.inputs[*input], given(*input))))
            .map(|(input, value)| Port {
                name: input.name.clone(),
                unit: input.unit.clone(),
                factor: input.factor,
                value: value / input.factor,
            })
            .collect();
        let values = expansion.value(Function::Outputs);
        linear.outputs = (chosen_out.iter().enumerate())
            .map(|(k, channel)| (&model.channels[*channel], values[k]))
            .map(|(channel, value)| Port {
                name: channel.name.clone(),
                unit: channel.unit.clone(),
                factor: channel.factor,
                value: value / channel.factor,
            })
            .collect();
        linear.b = linear.b.select_columns(chosen_in.iter());
        let (all_c, all_d) = (linear.c.clone(), linear.d.select_columns(chosen_in.iter()));
        linear.c = all_c.rows(0, chosen_out.len()).into_owned();
        linear.d = all_d.rows(0, chosen_out.len()).into_owned();
        for (k, port) in linear.inputs.iter().enumerate() {
            linear.b.column_mut(k).iter_mut().for_each(|entry| *entry *= port.factor);
            linear.d.column_mut(k).iter_mut().for_each(|entry| *entry *= port.factor);
        }
        for (k, port) in linear.outputs.iter().enumerate() {
            linear.c.row_mut(k).iter_mut().for_each(|entry| *entry /= port.factor);
            linear.d.row_mut(k).iter_mut().for_each(|entry| *entry /= port.factor);
        }
        linear.states.extend(model.elements.iter().enumerate().flat_map(|(element, instance)| {
            let own = layout.states_of(element).filter(|state| local.states().contains(state));
            own.enumerate().map(move |(k, _)| format!("{}: state {}", instance.name, k + 1))
        }));
        linear.bodies = model.bodies.iter().map(|body| body.name.clone()).collect();
        // How loads change with positions alone.
        let by_positions = expansion.slope(Function::Outputs, Direction::Positions);
        linear.loads = by_positions.rows(chosen_out.len(), 6 * places.len()) * &linear.positions;
        linear.load_list = places
            .iter()
            .enumerate()
            .map(|(k, (element, frame, body))| {
                let turn =
                    crate::model::rotation(&std::array::from_fn(|e| instant.inputs[layout.body_slot(*body, 3 + e)]));
                let at = chosen_out.len() + 6 * k;
                Load {
                    element: model.elements[*element].name.clone(),
                    follows_signals: model.elements[*element]
                        .signals()
                        .any(|signal| !matches!(signal, Quantity::Given { .. })),
                    body: *body,
                    arm: turn * model.elements[*element].markers[*frame].position,
                    force: Vector3::new(values[at], values[at + 1], values[at + 2]),
                }
            })
            .collect();
        linear.own_masses = own_masses(model, layout, &instant.inputs);
        linear.carried = Carried::all(&linear, model, layout, &instant.inputs, local.states());
        // Flexible coordinates bend with the bodies.
        for carried in &linear.carried {
            let Some(own) = &carried.loads else { continue };
            for (k, (_, frame, _)) in places.iter().enumerate().filter(|(_, place)| place.0 == carried.index) {
                linear.loads.rows_mut(6 * k, 6).copy_from(&own.rows(6 * frame, 6));
            }
        }
        let notes = linear.motion(session, instant, &local);
        Ok((linear, local, notes))
    }
}

/// Indices of names; all where none are given.
fn choose<'n>(
    session: &Session,
    what: &str,
    names: Option<&[String]>,
    known: impl Iterator<Item = &'n str>,
) -> Result<Vec<usize>, SessionError> {
    let known: Vec<&str> = known.collect();
    let Some(names) = names else { return Ok((0..known.len()).collect()) };
    let find = |name: &String| {
        known.iter().position(|one| one == name).ok_or_else(|| {
            let help = match suggest(name, known.iter().copied()) {
                Some(nearest) => format!("did you mean `{nearest}`?"),
                None if known.is_empty() => format!("the scene has no [[{what}]]"),
                None => format!("known are {}", known.join(", ")),
            };
            refuse(session, Diagnostic::error(codes::UNKNOWN_TARGET, format!("there is no {what} `{name}`")).help(help))
        })
    };
    names.iter().map(find).collect()
}

/// The reduction, in SI, in axes of the ground.
pub(crate) fn reduce(e: &Expansion) -> Result<Linear, String> {
    use Direction as D;
    use Function as F;
    let words = |error: crate::analysis::AnalysisError| error.to_string();
    let n = e.mass.nrows();
    let jacobian = e.jacobian();
    let holonomic = jacobian.select_rows(e.holonomic().iter());
    let with_idle = |rows: &DMatrix<f64>| {
        let mut all = DMatrix::zeros(rows.nrows() + e.idle.nrows(), n);
        all.rows_mut(0, rows.nrows()).copy_from(rows);
        all.rows_mut(rows.nrows(), e.idle.nrows()).copy_from(&e.idle);
        all
    };
    let freedom = |rows: &DMatrix<f64>| Freedom::of(&with_idle(rows), &e.scales).map_err(|error| words(error.into()));
    let (mut places, mut motions) = (freedom(&holonomic)?, freedom(&jacobian)?);
    // Rates of places are motions, component by component, where rows on velocities do not tell them apart.
    if places.count() == motions.count() {
        (places, motions) = (by_mass(places, &e.mass), by_mass(motions, &e.mass));
    }
    let s = e.slope(F::States, D::States).nrows();
    let inputs = e.slope(F::States, D::Inputs).ncols();
    let (p, q) = (places.count(), motions.count());
    let states = p + q + s;
    // Small changes of positions and velocities by states.
    let mut x = DMatrix::zeros(n, states);
    x.columns_mut(0, p).copy_from(&places.basis);
    x.columns_mut(p + q, s).copy_from(&places.moved_by(&e.slope(F::Rows, D::States).select_rows(e.holonomic().iter())));
    let mut w = DMatrix::zeros(s, states);
    w.columns_mut(p + q, s).fill_with_identity();
    let rates = e.slope(F::Rates, D::Positions) * &x + e.slope(F::Rates, D::States) * &w;
    let mut v = motions.moved_by(&rates);
    v.columns_mut(p, q).copy_from(&motions.basis);
    let along =
        |of: Function| e.slope(of, D::Positions) * &x + e.slope(of, D::Velocities) * &v + e.slope(of, D::States) * &w;
    // Accelerations and multipliers of the independent rows of joints.
    let rows: Vec<usize> = motions.independent.iter().copied().filter(|row| *row < jacobian.nrows()).collect();
    // Those that rows which mean nothing hold are not among them: without moments their bodies do not turn.
    let own = Freedom::of(&jacobian, &e.scales).map_err(|error| words(error.into()))?.independent;
    let rows = if own.len() == rows.len() { rows } else { own };
    let m = rows.len();
    let mut system = DMatrix::zeros(n + m, n + m);
    system.view_mut((0, 0), (n, n)).copy_from(&e.slope(F::Balance, D::Accelerations));
    system.view_mut((0, n), (n, m)).copy_from(&e.slope(F::Balance, D::Multipliers).select_columns(rows.iter()));
    let gammas = |matrix: DMatrix<f64>| matrix.select_rows(rows.iter());
    system.view_mut((n, 0), (m, n)).copy_from(&gammas(e.slope(F::Accelerations, D::Accelerations)));
    let mut right = DMatrix::zeros(n + m, states + inputs);
    right.view_mut((0, 0), (n, states)).copy_from(&-along(F::Balance));
    right.view_mut((n, 0), (m, states)).copy_from(&-gammas(along(F::Accelerations)));
    right.view_mut((0, states), (n, inputs)).copy_from(&-e.slope(F::Balance, D::Inputs));
    right.view_mut((n, states), (m, inputs)).copy_from(&-gammas(e.slope(F::Accelerations, D::Inputs)));
    let solved = solve(system, right, n).ok_or("masses and joints do not determine the accelerations")?;
    let accelerations = solved.rows(0, n).into_owned();
    let multipliers = solved.rows(n, m).into_owned();
    let respond = |of: Function| {
        let by_multipliers = e.slope(of, D::Multipliers).select_columns(rows.iter());
        let mut all = e.slope(of, D::Accelerations) * &accelerations + by_multipliers * &multipliers;
        let mut by_states = all.columns_mut(0, states);
        by_states += along(of);
        let mut by_inputs = all.columns_mut(states, inputs);
        by_inputs += e.slope(of, D::Inputs);
        all
    };
    // x' = v + omega x turn.
    let mut moving = v.clone();
    for (body, spin) in e.spins.iter().enumerate() {
        let turned = spin.cross_matrix() * x.rows(6 * body + 3, 3);
        let mut part = moving.rows_mut(6 * body + 3, 3);
        part += turned;
    }
    let mut whole = DMatrix::zeros(states, states + inputs);
    let coordinates = &places.components * moving;
    whole.view_mut((0, 0), (p, states)).copy_from(&coordinates);
    // What rows carry along has no components here.
    whole.rows_mut(p, q).copy_from(&(&motions.components * &accelerations));
    whole.rows_mut(p + q, s).copy_from(&respond(F::States));
    let outputs = respond(F::Outputs);
    let names = (1..=p).map(|k| format!("q{k}")).chain((1..=q).map(|k| format!("u{k}")));
    Ok(Linear {
        time: 0.0,
        a: whole.columns(0, states).into_owned(),
        b: whole.columns(states, inputs).into_owned(),
        c: outputs.columns(0, states).into_owned(),
        d: outputs.columns(states, inputs).into_owned(),
        states: names.collect(),
        coordinates: p,
        element_states: s,
        inputs: Vec::new(),
        outputs: Vec::new(),
        positions: x,
        velocities: v,
        components: [places.components, motions.components],
        spectrum: None,
        loads: DMatrix::zeros(0, states),
        expansion: e.clone(),
        load_list: Vec::new(),
        round_off: RoundOff::of(e, &motions.basis),
        own_masses: Vec::new(),
        carried: Vec::new(),
        bodies: Vec::new(),
        notes: Vec::new(),
        at_rest: false,
        turning: Vector3::zeros(),
        unsteadiness: 0.0,
    })
}
