//! From an author's element to an [`ElementClass`]: recording, and evaluation with plain numbers.
//!
//! Evaluation works on lists that are kept from call to call, so that it allocates only in the first one.

mod acting;
mod joint;

use acting::{ActingSet, AsControl, AsForce};
use joint::JointSet;

use std::cell::{Cell, RefCell};
use std::marker::PhantomData;

use nalgebra::{Matrix3, Vector3};

use crate::descriptor::{Descriptor, Kind, Named, NamedInput};
use crate::documentation::manual_page;
use crate::element::{
    ChannelSpec, Configuration, Constraint, Control, Element, Force, FrameSpec, InputSpec, Motion, Reaction, Values,
    Wrenches,
};
use crate::fence;
use crate::geometry::{Frame, Mat3, Twist, Vec3};
use crate::jet::Jet;
use crate::params::{FRAME_COUNT, ParamError, Parameters, Table};
use crate::recorded::{Recorded, input, record};
use crate::recording::{Input, Output, Recording, Role};
use crate::scalar::Scalar;
use crate::set::{Batch, CreateError, ElementClass, ElementSet, Fault, Layout};

/// The class of a joint.
#[must_use]
pub fn joint<T: Constraint>() -> Box<dyn ElementClass> {
    let mut descriptor = describe::<T>(Kind::Joint, T::COORDINATES, T::STATES);
    descriptor.inputs = inputs(T::INPUTS);
    descriptor.rows = T::ROWS.iter().chain(T::VELOCITY_ROWS).map(ToString::to_string).collect();
    descriptor.values = named(T::CHANNELS);
    descriptor.mobility = T::MOBILITY;
    descriptor.turns_freely = T::TURNS_FREELY;
    Box::new(Class::<T, JointSet<T>> { descriptor, marker: PhantomData })
}

/// The class of a force element.
#[must_use]
pub fn force<T: Force>() -> Box<dyn ElementClass> {
    let mut descriptor = describe::<T>(Kind::Force, T::CHANNELS, T::STATES);
    descriptor.inputs = inputs(T::INPUTS);
    descriptor.joints = frames(T::JOINTS);
    descriptor.checks = named(T::CHECKS);
    Box::new(Class::<T, ActingSet<T, AsForce>> { descriptor, marker: PhantomData })
}

/// The class of a control element.
#[must_use]
pub fn control<T: Control>() -> Box<dyn ElementClass> {
    let mut descriptor = describe::<T>(Kind::Control, T::OUTPUTS, T::STATES);
    descriptor.inputs = inputs(T::INPUTS);
    descriptor.checks = named(T::CHECKS);
    Box::new(Class::<T, ActingSet<T, AsControl>> { descriptor, marker: PhantomData })
}

fn describe<T: Element>(kind: Kind, channels: &[ChannelSpec], states: &[ChannelSpec]) -> Descriptor {
    Descriptor {
        name: T::NAME.into(),
        kind,
        summary: T::SUMMARY.into(),
        doc: manual_page(T::DOC),
        opaque: T::OPAQUE,
        angles: T::ANGLES,
        mobility: None,
        turns_freely: false,
        glyph: T::GLYPH.to_owned(),
        frames: frames(T::FRAMES),
        more_frames: T::MORE_FRAMES.and_then(|more| frames(&[more]).pop()),
        most_frames: if T::MORE_FRAMES.is_some() { T::MOST_FRAMES } else { 0 },
        rows: Vec::new(),
        inputs: Vec::new(),
        joints: Vec::new(),
        channels: named(channels),
        states: named(states),
        params: T::Parameters::specs(),
        unknowns: named(T::UNKNOWNS),
        exempt: T::EXEMPT.iter().map(|(check, reason)| ((*check).into(), (*reason).into())).collect(),
        checks: Vec::new(),
        values: Vec::new(),
        catalog: T::CATALOG.into(),
        report: T::REPORT.into(),
        parallel_axes: T::PARALLEL_AXES.to_vec(),
    }
}

fn named(list: &[ChannelSpec]) -> Vec<Named> {
    list.iter().map(|c| Named { name: c.name.into(), unit: c.unit.into(), doc: c.doc.into() }).collect()
}

fn frames(list: &[FrameSpec]) -> Vec<Named> {
    list.iter().map(|f| Named { name: f.name.into(), unit: String::new(), doc: f.doc.into() }).collect()
}

fn inputs(list: &[InputSpec]) -> Vec<NamedInput> {
    let one =
        |i: &InputSpec| NamedInput { name: i.name.into(), unit: i.unit.into(), doc: i.doc.into(), default: i.default };
    list.iter().map(one).collect()
}

struct Class<T, Set> {
    descriptor: Descriptor,
    marker: PhantomData<fn() -> (T, Set)>,
}

impl<T: Element, Set: ElementSet + Default + 'static> ElementClass for Class<T, Set> {
    fn descriptor(&self) -> &Descriptor {
        &self.descriptor
    }
    fn new_set(&self) -> Box<dyn ElementSet> {
        Box::new(Set::default())
    }
}

/// The element, and its number of frames.
fn create<T: Element>(params: &Table) -> Result<(T, usize), CreateError> {
    let element = T::Parameters::read(params).and_then(T::new).map_err(CreateError::Parameter)?;
    let least = T::FRAMES.len();
    if T::MORE_FRAMES.is_none() {
        return Ok((element, least));
    }
    let count = params.get(FRAME_COUNT).map_or(Some(least), |count| usize::try_from(count.as_integer()?).ok());
    let Some(count) = count.filter(|count| (least..=T::MOST_FRAMES).contains(count)) else {
        let message = format!("`{}` takes {least} to {} frames", T::NAME, T::MOST_FRAMES);
        return Err(CreateError::Parameter(ParamError::new("bodies", message)));
    };
    Ok((element.with_frames(count).map_err(CreateError::Parameter)?, count))
}

/// Inputs of an element as scalars of type `S`.
struct Given<S> {
    time: S,
    references: Vec<S>,
    states: Vec<S>,
    unknowns: Vec<S>,
    memory: Vec<S>,
    signals: Vec<S>,
    reactions: Vec<Reaction<S>>,
    frames: Vec<Frame<S>>,
    twists: Vec<Twist<S>>,
    angles: Vec<Cell<Option<S>>>,
}

impl<S: Scalar> Given<S> {
    /// Nothing yet.
    fn empty() -> Self {
        Self {
            time: S::zero(),
            references: Vec::new(),
            states: Vec::new(),
            unknowns: Vec::new(),
            memory: Vec::new(),
            signals: Vec::new(),
            reactions: Vec::new(),
            frames: Vec::new(),
            twists: Vec::new(),
            angles: Vec::new(),
        }
    }
    fn configuration(&self) -> Configuration<'_, S> {
        Configuration {
            frames: &self.frames,
            time: self.time,
            unknowns: &self.unknowns,
            references: &self.references,
            angles: &self.angles,
        }
    }
    fn motion(&self) -> Motion<'_, S> {
        Motion {
            configuration: self.configuration(),
            twists: &self.twists,
            states: &self.states,
            memory: &self.memory,
            inputs: &self.signals,
            reactions: &self.reactions,
        }
    }
    /// Plain numbers have the unknowns behind the states, the last one first.
    fn take_unknowns(&mut self, count: usize) {
        self.unknowns.clear();
        for _ in 0..count {
            self.unknowns.extend(self.states.pop());
        }
    }
    fn forget_angles(&mut self, count: usize) {
        self.angles.clear();
        self.angles.resize_with(count, || Cell::new(None));
    }
}

/// Puts other values into a list that keeps its memory.
fn refill<T>(list: &mut Vec<T>, values: impl Iterator<Item = T>) {
    list.clear();
    list.extend(values);
}

/// `count` values that are not given yet.
fn unset<S: Clone>(list: &mut Vec<Option<S>>, count: usize) {
    list.clear();
    list.resize(count, None);
}

/// All inputs written down on the tape. Those that no equation uses are dead operations; the host drops them.
fn recorded_inputs(layout: &Layout, unknowns: usize) -> Given<Recorded> {
    let list = |count: usize, kind: fn(u32) -> Input| (0..count).map(|k| input(kind(k as u32))).collect();
    let vector = |index: u32, make: fn(u32, u32) -> Input| Vec3::from_fn(|row, _| input(make(index, row as u32)));
    let frames = (0..layout.frames as u32)
        .map(|frame| Frame {
            position: vector(frame, |frame, component| Input::Position { frame, component }),
            rotation: Mat3::from_fn(|row, column| {
                input(Input::Rotation { frame, row: row as u32, column: column as u32 })
            }),
        })
        .collect();
    let twists = (0..layout.frames as u32)
        .map(|frame| Twist {
            velocity: vector(frame, |frame, component| Input::Velocity { frame, component }),
            angular_velocity: vector(frame, |frame, component| Input::AngularVelocity { frame, component }),
        })
        .collect();
    let reactions = (0..layout.joints as u32)
        .map(|joint| Reaction {
            force: vector(joint, |joint, component| Input::ReactionForce { joint, component }),
            torque: vector(joint, |joint, component| Input::ReactionTorque { joint, component }),
        })
        .collect();
    Given {
        time: input(Input::Time),
        references: list(layout.angles, Input::AngleReference),
        states: list(layout.states - unknowns, Input::State),
        unknowns: list(unknowns, Input::Unknown),
        memory: list(layout.memory, Input::Discrete),
        signals: list(layout.signals, Input::Signal),
        reactions,
        frames,
        twists,
        angles: (0..layout.angles).map(|_| Cell::new(None)).collect(),
    }
}

fn angle_outputs(given: &Given<Recorded>) -> impl Iterator<Item = (Role, Recorded)> {
    let computed = given.angles.iter().enumerate();
    computed.filter_map(|(k, cell)| cell.get().map(|angle| (Role::Angle(k as u32), angle)))
}

/// Reads an instance's part of a batch.
fn read_inputs(layout: &Layout, unknowns: usize, numbers: &[f64], given: &mut Given<f64>) {
    let (lists, frames) = numbers.split_at(layout.frames_at());
    let (head, reactions) = lists.split_at(lists.len() - 6 * layout.joints);
    let vector = |from: &[f64]| Vec3::new(from[0], from[1], from[2]);
    given.time = head[0];
    let mut rest = &head[1..];
    for (list, count) in [
        (&mut given.references, layout.angles),
        (&mut given.states, layout.states),
        (&mut given.memory, layout.memory),
        (&mut given.signals, layout.signals),
    ] {
        let (own, others) = rest.split_at(count);
        refill(list, own.iter().copied());
        rest = others;
    }
    refill(
        &mut given.reactions,
        reactions.chunks_exact(6).map(|part| Reaction { force: vector(part), torque: vector(&part[3..]) }),
    );
    refill(
        &mut given.frames,
        frames
            .chunks_exact(18)
            .map(|part| Frame { position: vector(part), rotation: Mat3::from_row_slice(&part[3..12]) }),
    );
    refill(
        &mut given.twists,
        frames
            .chunks_exact(18)
            .map(|part| Twist { velocity: vector(&part[12..]), angular_velocity: vector(&part[15..]) }),
    );
    given.take_unknowns(unknowns);
    given.forget_angles(layout.angles);
}

/// Splits a batch into instances and their inputs and results.
fn each_instance(
    batch: &Batch<'_>,
    count: usize,
    results: usize,
    layout: &Layout,
    out: &mut [f64],
    mut evaluate: impl FnMut(usize, &[f64], &mut [f64]) -> Result<(), Fault>,
) -> Result<(), Fault> {
    let n = batch.instances.len();
    if batch.inputs.len() != n * layout.inputs() || out.len() != n * results {
        let message = format!(
            "a batch of {n} needs {} inputs and {} results, found {} and {}",
            n * layout.inputs(),
            n * results,
            batch.inputs.len(),
            out.len()
        );
        return Err(Fault { instance: 0, message });
    }
    for (k, instance) in batch.instances.iter().enumerate() {
        let instance = *instance as usize;
        if instance >= count {
            return Err(Fault { instance, message: format!("instance {instance} does not exist ({count} do)") });
        }
        fence::enter(instance);
        evaluate(
            instance,
            &batch.inputs[k * layout.inputs()..(k + 1) * layout.inputs()],
            &mut out[k * results..(k + 1) * results],
        )?;
    }
    Ok(())
}

/// The first instance of a batch; `None` for an empty batch.
fn first_of<'a, T>(batch: &Batch<'_>, instances: &'a [T]) -> Result<Option<&'a T>, Fault> {
    let Some(&first) = batch.instances.first() else { return Ok(None) };
    let (instance, count) = (first as usize, instances.len());
    let message = || format!("instance {instance} does not exist ({count} do)");
    instances.get(instance).map(Some).ok_or_else(|| Fault { instance, message: message() })
}

/// Instances of a class may differ in rows in use, states and memory; those of a batch may not.
fn same_layout(instance: usize, expected: &Layout, found: &Layout) -> Result<(), Fault> {
    if expected == found {
        return Ok(());
    }
    let message = format!("a batch needs instances of one layout: the first has {expected:?}, this one {found:?}");
    Err(Fault { instance, message })
}

/// What an element declares and does not give, by its name where it has one.
fn not_given(instance: usize, what: &str, number: usize, named: Option<&ChannelSpec>) -> Fault {
    let name = named.map_or_else(|| number.to_string(), |spec| format!("`{}`", spec.name));
    Fault { instance, message: format!("declares {what} {name}, but does not give it") }
}

fn unknown_memory(instance: usize) -> impl FnOnce(String) -> Fault {
    move |message| Fault { instance, message }
}

/// The conditions on an element's unknowns, as far as the author gives them.
fn conditions<T: Element, S: Scalar>(element: &T, unknowns: usize, given: &Given<S>) -> Vec<Option<S>> {
    let mut values = Vec::new();
    unset(&mut values, unknowns);
    element.conditions(&given.motion(), &mut Values::new(&mut values, "condition"));
    values
}

/// What a recording has of the unknowns: conditions, the last one first, and starting guesses.
///
/// # Errors
/// The first condition that is not given, in words.
fn unknown_outputs<T: Element>(
    element: &T,
    guesses: &[f64],
    given: &Given<Recorded>,
) -> Result<Vec<(Role, Recorded)>, String> {
    let found = conditions(element, guesses.len(), given);
    if let Some(k) = found.iter().position(Option::is_none) {
        return Err(format!("declares {} internal unknowns, but does not give condition {k}", guesses.len()));
    }
    let numbered = found.into_iter().enumerate().rev();
    let mut outputs: Vec<(Role, Recorded)> =
        numbered.filter_map(|(k, value)| Some((Role::Condition(k as u32), value?))).collect();
    outputs.extend(guesses.iter().enumerate().map(|(k, guess)| (Role::Guess(k as u32), Recorded::from(*guess))));
    Ok(outputs)
}

/// What opaque elements cannot have.
fn refuse_opaque_unknowns(instance: usize, opaque: bool, unknowns: usize) -> Result<(), Fault> {
    if opaque && unknowns > 0 {
        let message = "has internal unknowns, which an opaque element cannot have: let it be recorded".into();
        return Err(Fault { instance, message });
    }
    Ok(())
}

/// The recording of an opaque element: which results it gives, all referring to a single dummy operation.
fn announce(roles: impl Iterator<Item = Role>, states: Vec<f64>, memory: Vec<f64>) -> Recording {
    let mut recording = record(|| vec![(Role::Potential, Recorded::from(0.0))]);
    recording.outputs = roles.map(|role| Output { role, node: 0 }).collect();
    recording.initial_states = states;
    recording.initial_discrete = memory;
    recording
}
