//! Taking down the equations of a C element: the functions behind `odyn_recorder`.
//!
//! They are called from foreign code, so nothing in them may panic: every number is looked at, and the first mistake is
//! kept for the message while later calls give values that stand for nothing.

// The functions get back, as a plain pointer, the tape that `take_down` made for them.
#![allow(unsafe_code)]

use std::collections::BTreeSet;
use std::ffi::{c_char, c_void};
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::thread::{self, ThreadId};

use element_api::descriptor::{Descriptor, Kind};
use element_api::function::Function;
use element_api::params::{ParamType, Table as Params};
use element_api::recorded::{Recorded, input, record};
use element_api::recording::{Input, MOST_OPS, Op, RawOp, Recording, Role};
use element_api::scalar::Scalar;
use element_api::surface::Surface;
use element_api::table::{Outside, Table};

use super::describe::optional;
use super::table::{self, Value};

type Unary = fn(Recorded) -> Recorded;
type Binary = fn(Recorded, Recorded) -> Recorded;

/// Stands for a value that could not be given; what is computed from it is one, too.
const NOTHING: Value = Value { tape: u32::MAX, node: u32::MAX };
/// Most points of a table.
const MOST_POINTS: usize = 1_000_000;

/// An instance, as its equations are taken down.
pub struct Subject<'a> {
    pub element: &'a table::Element,
    pub instance: *const c_void,
    pub descriptor: &'a Descriptor,
    pub params: &'a Params,
    /// The rows that this instance has, without those on velocities.
    pub rows: &'a [usize],
    /// Its rows on velocities.
    pub velocity_rows: &'a [usize],
    pub states: &'a [f64],
    pub memory: &'a [f64],
    /// Starting guesses of the internal unknowns.
    pub guesses: &'a [f64],
}

/// The equations of an instance.
///
/// # Errors
/// What is wrong with them, in words, with the name of the row or other result.
pub fn take_down(subject: &Subject<'_>) -> Result<Recording, String> {
    let Some(function) = subject.element.record else { return Err("`record` is null".into()) };
    let mut outcome = Ok(());
    let mut recording = record(|| {
        let mut tape = Tape::new(subject);
        let recorder = table::Recorder {
            size: size_of::<table::Recorder>() as u32,
            reserved: 0,
            context: (&raw mut tape).cast(),
            constant,
            input: input_of_host,
            operation,
            power,
            real_power,
            table: table_at,
            function: function_at,
            result,
            surface: surface_at,
            slope: slope_at,
        };
        let mut error = table::Error::empty();
        let status = function(subject.instance, &raw const recorder, &raw mut error);
        outcome = tape.finish(status, &error);
        tape.results
    });
    outcome?;
    recording.initial_states = subject.states.to_vec();
    recording.initial_discrete = subject.memory.to_vec();
    recording.check(&subject.descriptor.limits())?;
    Ok(recording)
}

struct Tape<'a> {
    subject: &'a Subject<'a>,
    /// Tells its values from those of other recordings.
    serial: u32,
    thread: ThreadId,
    /// Whether another thread used it.
    strayed: AtomicBool,
    values: Vec<Recorded>,
    results: Vec<(Role, Recorded)>,
    forces: Vec<Recorded>,
    torques: Vec<Recorded>,
    /// The first mistake.
    mistake: Option<String>,
    /// The first result that a mistake went into.
    spoiled: Option<Role>,
}

impl<'a> Tape<'a> {
    fn new(subject: &'a Subject<'a>) -> Self {
        static SERIAL: AtomicU32 = AtomicU32::new(1);
        // Zero is what forgotten values have, the largest number what stands for nothing.
        let serial = SERIAL.fetch_add(1, Ordering::Relaxed).clamp(1, u32::MAX - 1);
        let loads = if subject.descriptor.kind == Kind::Force { 3 * subject.descriptor.frames.len() } else { 0 };
        Self {
            subject,
            serial,
            thread: thread::current().id(),
            strayed: AtomicBool::new(false),
            values: Vec::new(),
            results: Vec::new(),
            forces: vec![Recorded::from(0.0); loads],
            torques: vec![Recorded::from(0.0); loads],
            mistake: None,
            spoiled: None,
        }
    }

    /// Notes a mistake.
    fn wrong(&mut self, message: impl Into<String>) -> Value {
        self.mistake.get_or_insert_with(|| message.into());
        NOTHING
    }

    fn give(&mut self, value: Recorded) -> Value {
        if self.values.len() >= MOST_OPS {
            return self.wrong(format!("records more than {MOST_OPS} values"));
        }
        self.values.push(value);
        Value { tape: self.serial, node: self.values.len() as u32 - 1 }
    }

    /// The value behind a handle.
    fn get(&mut self, handle: Value, user: &str) -> Option<Recorded> {
        if handle == NOTHING && self.mistake.is_some() {
            return None;
        }
        let known = self.values.len();
        if handle.tape == self.serial && (handle.node as usize) < known {
            return Some(self.values[handle.node as usize]);
        }
        self.wrong(match handle {
            Value { tape: 0, .. } => format!("{user} uses a value that was never set"),
            Value { tape, node } if tape == self.serial => {
                format!("{user} uses value number {node}, but only {known} exist")
            }
            _ => format!("{user} uses a value of another recording"),
        });
        None
    }

    /// What is missing is completed or an error.
    fn finish(&mut self, status: i32, error: &table::Error) -> Result<(), String> {
        if self.strayed.load(Ordering::Relaxed) {
            return Err("uses its recorder on another thread than the one that it was passed on".into());
        }
        if let Some(mistake) = &self.mistake {
            let into = self.spoiled.map(|role| format!(" (it goes into {})", self.name_of(role))).unwrap_or_default();
            return Err(format!("{mistake}{into}"));
        }
        if status != table::OK {
            return Err(error.texts().1);
        }
        let mut given: BTreeSet<Role> = self.results.iter().map(|(role, _)| *role).collect();
        for k in (0..self.subject.memory.len() as u32).filter(|k| !given.contains(&Role::NextDiscrete(*k))) {
            self.results.push((Role::NextDiscrete(k), input(Input::Discrete(k))));
        }
        // Of flexible coordinates: q'. What q'' is, the host finds.
        let flexible = self.flexible();
        if self.subject.states.len() < 2 * flexible {
            return Err(format!("{flexible} flexible coordinates need {} states, q and q'", 2 * flexible));
        }
        for k in 0..flexible as u32 {
            if given.contains(&Role::StateRate(k)) {
                return Err(format!(
                    "gives {}, which is state {}",
                    self.name_of(Role::StateRate(k)),
                    flexible + k as usize
                ));
            }
            self.results.push((Role::StateRate(k), input(Input::State(flexible as u32 + k))));
        }
        let guesses = self.subject.guesses.iter().enumerate();
        self.results.extend(guesses.map(|(k, guess)| (Role::Guess(k as u32), Recorded::from(*guess))));
        let numbered = |list: &[Recorded], role: fn(u32) -> Role| {
            list.iter().enumerate().map(|(k, value)| (role(k as u32), *value)).collect::<Vec<_>>()
        };
        self.results.extend(numbered(&self.forces, Role::Force));
        self.results.extend(numbered(&self.torques, Role::Torque));
        given.extend(self.results.iter().map(|(role, _)| *role));
        let needed = self.needed();
        let declared = self.subject.descriptor.rows.len();
        let is_row =
            |role: Role| matches!(role, Role::Residual(row) | Role::VelocityResidual(row) if (row as usize) < declared);
        if let Some(role) = given.iter().find(|role| is_row(**role) && !needed.contains(role)) {
            return Err(format!("sets {}, which `uses_row` leaves out", self.name_of(*role)));
        }
        match needed.into_iter().find(|role| !given.contains(role)) {
            None => Ok(()),
            Some(role @ (Role::Residual(_) | Role::VelocityResidual(_))) => {
                Err(format!("declares {}, but does not set it", self.name_of(role)))
            }
            Some(role) => Err(format!("declares {}, but does not give it", self.name_of(role))),
        }
    }

    /// Number of flexible coordinates.
    fn flexible(&self) -> usize {
        let numbers = self.results.iter().filter_map(|(role, _)| match role {
            Role::FlexibleForce(k) => Some(*k as usize + 1),
            _ => None,
        });
        numbers.max().unwrap_or(0)
    }

    /// The results that its class and instance promise.
    fn needed(&self) -> Vec<Role> {
        let Subject { descriptor, rows, velocity_rows, states, guesses, .. } = *self.subject;
        let list = |count: usize, role: fn(u32) -> Role| (0..count as u32).map(role);
        let mut needed: Vec<Role> = rows.iter().map(|row| Role::Residual(*row as u32)).collect();
        needed.extend(velocity_rows.iter().map(|row| Role::VelocityResidual(*row as u32)));
        if descriptor.kind == Kind::Joint {
            needed.extend(list(descriptor.channels.len(), Role::Coordinate));
        }
        needed.extend(list(descriptor.reported().len(), Role::Channel));
        let found_by_host = self.flexible()..2 * self.flexible();
        let rates = (0..states.len()).filter(|k| !found_by_host.contains(k));
        needed.extend(rates.map(|k| Role::StateRate(k as u32)));
        needed.extend(list(descriptor.checks.len(), Role::Check));
        needed.extend(list(guesses.len(), Role::Condition));
        if descriptor.mobility.is_some() {
            needed.extend(list(3, Role::PosePosition));
            needed.extend(list(9, Role::PoseRotation));
        }
        needed
    }

    fn name_of(&self, role: Role) -> String {
        let d = self.subject.descriptor;
        let of = |name: Option<&String>, what: &str, k: u32| match name {
            Some(name) => format!("the {what} `{name}`"),
            None => format!("the {what} number {k}"),
        };
        let named =
            |list: &'a [element_api::Named], what: &str, k: u32| of(list.get(k as usize).map(|n| &n.name), what, k);
        match role {
            Role::Residual(k) | Role::VelocityResidual(k) => of(d.rows.get(k as usize), "row", k),
            Role::Coordinate(k) => named(&d.channels, "coordinate", k),
            Role::Channel(k) => named(d.reported(), "channel", k),
            Role::Check(k) => named(&d.checks, "check", k),
            Role::Condition(k) => format!("condition {k} on the internal unknowns"),
            Role::StateRate(k) => named(&d.states, "rate of state", k),
            Role::Force(k) => named(&d.frames, "force on frame", k / 3),
            Role::Torque(k) => named(&d.frames, "torque on frame", k / 3),
            Role::Kinetic => "the kinetic energy".into(),
            Role::FlexibleForce(k) => named(&d.states, "force on flexible coordinate", k),
            Role::PosePosition(_) | Role::PoseRotation(_) => "the pose of frame 1".into(),
            other => format!("{other:?}"),
        }
    }

    fn set(&mut self, role: u32, index: u32, handle: Value) {
        // Starting guesses come from `guess`.
        let Some(role) = Role::decode(role, index).filter(|role| !matches!(role, Role::Guess(_))) else {
            self.wrong(format!("gives a result of the unknown meaning {role}"));
            return;
        };
        let user = self.name_of(role);
        let Some(value) = self.get(handle, &user) else {
            self.spoiled.get_or_insert(role);
            return;
        };
        let loads = match role {
            Role::Force(_) => &mut self.forces,
            Role::Torque(_) => &mut self.torques,
            _ => {
                if self.results.len() > MOST_OPS {
                    self.wrong(format!("gives more than {MOST_OPS} results"));
                } else {
                    self.results.push((role, value));
                }
                return;
            }
        };
        match loads.get_mut(index as usize) {
            Some(sum) => *sum += value,
            None if self.subject.descriptor.kind != Kind::Force => {
                self.wrong("gives a force or torque, which only forces do");
            }
            None => {
                self.wrong(format!("gives a force or torque of frame {}, which it does not have", index / 3));
            }
        }
    }
}

/// Lets a function of the recorder work on its tape.
fn with(context: *mut c_void, body: impl FnOnce(&mut Tape<'_>) -> Value) -> Value {
    let tape = context.cast::<Tape<'_>>();
    if tape.is_null() {
        return NOTHING;
    }
    // SAFETY: the tape that `take_down` passed, alive until the library's `record` returns. These two fields may be read by
    // any thread.
    let (thread, strayed) = unsafe { ((*tape).thread, &(*tape).strayed) };
    if thread != thread::current().id() {
        strayed.store(true, Ordering::Relaxed);
        return NOTHING;
    }
    // SAFETY: as above; the one thread that may use it is in this very call.
    body(unsafe { &mut *tape })
}

extern "C" fn constant(context: *mut c_void, value: f64) -> Value {
    with(context, |tape| tape.give(Recorded::from(value)))
}

extern "C" fn input_of_host(context: *mut c_void, kind: u32, index: u32) -> Value {
    const INPUT: u32 = 1;
    with(context, |tape| match Op::decode(RawOp { code: INPUT, args: [kind, index, 0, 0] }) {
        Some(Op::Input(known)) => tape.give(input(known)),
        _ => tape.wrong(format!("asks for the unknown input {kind}")),
    })
}

extern "C" fn operation(context: *mut c_void, code: u32, a: Value, b: Value, x: Value, y: Value) -> Value {
    with(context, |tape| {
        let user = |name: &str| format!("an operation `{name}`");
        let unary: Option<(&str, Unary)> = match code {
            6 => Some(("neg", |a| -a)),
            7 => Some(("sqrt", Scalar::sqrt)),
            8 => Some(("sin", Scalar::sin)),
            9 => Some(("cos", Scalar::cos)),
            11 => Some(("exp", Scalar::exp)),
            12 => Some(("ln", Scalar::ln)),
            13 => Some(("tanh", Scalar::tanh)),
            _ => None,
        };
        if let Some((name, apply)) = unary {
            let Some(a) = tape.get(a, &user(name)) else { return NOTHING };
            return tape.give(apply(a));
        }
        let binary: Option<(&str, Binary)> = match code {
            2 => Some(("add", |a, b| a + b)),
            3 => Some(("sub", |a, b| a - b)),
            4 => Some(("mul", |a, b| a * b)),
            5 => Some(("div", |a, b| a / b)),
            10 => Some(("atan2", Scalar::atan2)),
            _ => None,
        };
        if let Some((name, apply)) = binary {
            let (Some(a), Some(b)) = (tape.get(a, &user(name)), tape.get(b, &user(name))) else { return NOTHING };
            return tape.give(apply(a, b));
        }
        if code != 16 {
            return tape.wrong(format!("uses the unknown operation {code}"));
        }
        let name = user("select");
        match [a, b, x, y].map(|handle| tape.get(handle, &name)) {
            [Some(a), Some(b), Some(x), Some(y)] => tape.give(Recorded::select(a, b, x, y)),
            _ => NOTHING,
        }
    })
}

extern "C" fn power(context: *mut c_void, a: Value, n: i32) -> Value {
    with(context, |tape| {
        let Some(a) = tape.get(a, "an operation `powi`") else { return NOTHING };
        tape.give(a.powi(n))
    })
}

extern "C" fn real_power(context: *mut c_void, a: Value, exponent: f64) -> Value {
    with(context, |tape| {
        let Some(a) = tape.get(a, "an operation `powf`") else { return NOTHING };
        tape.give(a.powf(exponent))
    })
}

extern "C" fn table_at(context: *mut c_void, a: Value, points: *const f64, count: usize, outside: u32) -> Value {
    with(context, |tape| {
        let Some(a) = tape.get(a, "a table") else { return NOTHING };
        if points.is_null() || count > MOST_POINTS {
            return tape.wrong(format!("gives a table of {count} points that is a null pointer or too long"));
        }
        // SAFETY: two numbers for each of so many points, as the header says.
        let numbers = unsafe { std::slice::from_raw_parts(points, 2 * count) };
        let points = numbers.as_chunks::<2>().0;
        // The continuation and, above it, what is between the points.
        let interpolation = table::INTERPOLATIONS.iter().find(|(code, _)| *code == outside & !0xf);
        let (Some((_, interpolation)), Some(outside)) = (interpolation, Outside::decode(outside & 0xf)) else {
            return tape.wrong(format!("gives a table with the unknown continuation {outside}"));
        };
        match Table::through(points, *interpolation, outside) {
            Ok(table) => tape.give(a.lookup(&table)),
            Err(error) => tape.wrong(format!("gives a table that {}", error.message)),
        }
    })
}

extern "C" fn function_at(context: *mut c_void, name: *const c_char, x: Value) -> Value {
    parameter_at(context, name, [x], |function: &Function, [x]| function.at(x))
}

extern "C" fn slope_at(context: *mut c_void, name: *const c_char, x: Value) -> Value {
    parameter_at(context, name, [x], |function: &Function, [x]| function.slope(x))
}

extern "C" fn surface_at(context: *mut c_void, name: *const c_char, x: Value, y: Value) -> Value {
    parameter_at(context, name, [x, y], |surface: &Surface, [x, y]| surface.at(x, y))
}

/// What `evaluate` makes of a parameter that the scene gives as a function.
fn parameter_at<T: ParamType, const N: usize>(
    context: *mut c_void,
    name: *const c_char,
    arguments: [Value; N],
    evaluate: fn(&T, [Recorded; N]) -> Recorded,
) -> Value {
    with(context, |tape| {
        // SAFETY: a text of the header, or null.
        let name = match unsafe { optional(name, "name of a function") } {
            Ok(name) => name.unwrap_or_default(),
            Err(error) => return tape.wrong(error),
        };
        let mut values = [Recorded::from(0.0); N];
        for (value, handle) in values.iter_mut().zip(arguments) {
            let Some(known) = tape.get(handle, &format!("the function `{name}`")) else { return NOTHING };
            *value = known;
        }
        match tape.subject.params.get(&name).map(|value| T::read_named(value, &name)) {
            Some(Ok(function)) => tape.give(evaluate(&function, values)),
            Some(Err(error)) => tape.wrong(format!("asks for the function {error}")),
            None => tape.wrong(format!("asks for the function `{name}`, which is no parameter of it")),
        }
    })
}

extern "C" fn result(context: *mut c_void, role: u32, index: u32, value: Value) {
    with(context, |tape| {
        tape.set(role, index, value);
        NOTHING
    });
}
