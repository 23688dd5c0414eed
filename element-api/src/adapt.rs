//! From an author's element to an [`ElementClass`]: recording, and evaluation with plain numbers.
//!
//! Evaluation works on lists that are kept from call to call, so that it allocates only in the first one.

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
use crate::params::{Parameters, Table};
use crate::recorded::{Recorded, input, record};
use crate::recording::{Input, Output, Recording, Role};
use crate::scalar::Scalar;
use crate::set::{Batch, CreateError, ElementClass, ElementSet, Fault, Layout};

/// The class of a joint.
#[must_use]
pub fn joint<T: Constraint>() -> Box<dyn ElementClass> {
    let mut descriptor = describe::<T>(Kind::Joint, T::COORDINATES, &[]);
    descriptor.rows = T::ROWS.iter().map(ToString::to_string).collect();
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
    Box::new(Class::<T, ActingSet<T, AsForce>> { descriptor, marker: PhantomData })
}

/// The class of a control element.
#[must_use]
pub fn control<T: Control>() -> Box<dyn ElementClass> {
    let mut descriptor = describe::<T>(Kind::Control, T::OUTPUTS, T::STATES);
    descriptor.inputs = inputs(T::INPUTS);
    Box::new(Class::<T, ActingSet<T, AsControl>> { descriptor, marker: PhantomData })
}

fn describe<T: Element>(kind: Kind, channels: &[ChannelSpec], states: &[ChannelSpec]) -> Descriptor {
    let named = |list: &[ChannelSpec]| -> Vec<Named> {
        list.iter().map(|c| Named { name: c.name.into(), unit: c.unit.into(), doc: c.doc.into() }).collect()
    };
    Descriptor {
        name: T::NAME.into(),
        kind,
        summary: T::SUMMARY.into(),
        doc: manual_page(T::DOC),
        opaque: T::OPAQUE,
        angles: T::ANGLES,
        mobility: None,
        turns_freely: false,
        frames: frames(T::FRAMES),
        rows: Vec::new(),
        inputs: Vec::new(),
        joints: Vec::new(),
        channels: named(channels),
        states: named(states),
        params: T::Parameters::specs(),
    }
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

fn create<T: Element>(params: &Table) -> Result<T, CreateError> {
    T::Parameters::read(params).and_then(T::new).map_err(CreateError::Parameter)
}

/// Inputs of an element as scalars of type `S`.
struct Given<S> {
    time: S,
    references: Vec<S>,
    states: Vec<S>,
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
            memory: Vec::new(),
            signals: Vec::new(),
            reactions: Vec::new(),
            frames: Vec::new(),
            twists: Vec::new(),
            angles: Vec::new(),
        }
    }
    fn configuration(&self) -> Configuration<'_, S> {
        Configuration { frames: &self.frames, time: self.time, references: &self.references, angles: &self.angles }
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
fn recorded_inputs(layout: &Layout) -> Given<Recorded> {
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
        states: list(layout.states, Input::State),
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
fn read_inputs(layout: &Layout, numbers: &[f64], given: &mut Given<f64>) {
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

fn unknown_memory(instance: usize) -> impl FnOnce(String) -> Fault {
    move |message| Fault { instance, message }
}

/// A joint with what does not change about it.
struct JointEntry<T> {
    element: T,
    rows: Vec<usize>,
    layout: Layout,
}

/// Lists for the evaluation of joints.
struct JointScratch {
    plain: Given<f64>,
    moved: Given<Jet>,
    rates: Vec<FrameRates>,
    values: Vec<Option<f64>>,
    jets: Vec<Option<Jet>>,
}

struct JointSet<T> {
    instances: Vec<JointEntry<T>>,
    scratch: RefCell<JointScratch>,
}

impl<T> Default for JointSet<T> {
    fn default() -> Self {
        let scratch = JointScratch {
            plain: Given::empty(),
            moved: Given::empty(),
            rates: Vec::new(),
            values: Vec::new(),
            jets: Vec::new(),
        };
        Self { instances: Vec::new(), scratch: RefCell::new(scratch) }
    }
}

impl<T: Constraint> JointEntry<T> {
    /// All residual rows, then coordinates, as far as the author gives them.
    fn values<S: Scalar>(&self, given: &Given<S>, values: &mut Vec<Option<S>>) {
        let at = given.configuration();
        unset(values, T::ROWS.len() + T::COORDINATES.len());
        let (rows, coordinates) = values.split_at_mut(T::ROWS.len());
        self.element.residual(&at, &mut Values::new(rows, "row"));
        self.element.coordinates(&at, &mut Values::new(coordinates, "coordinate"));
    }

    /// Where the rows in use and the coordinates are among [`JointEntry::values`].
    fn used(&self) -> impl Iterator<Item = usize> {
        self.rows.iter().copied().chain(T::ROWS.len()..T::ROWS.len() + T::COORDINATES.len())
    }

    fn evaluate(&self, numbers: &[f64], jacobian: bool, second: bool, scratch: &mut JointScratch, out: &mut [f64]) {
        let JointScratch { plain, moved, rates, values, jets } = scratch;
        let (count, frames) = (self.layout.values, self.layout.frames);
        read_inputs(&self.layout, numbers, plain);
        self.values(plain, values);
        // A row the author forgot is NaN.
        for (slot, k) in out.iter_mut().zip(self.used()) {
            *slot = values[k].unwrap_or(f64::NAN);
        }
        let angles_at = count * (3 + 6 * frames);
        for (k, cell) in plain.angles.iter().enumerate() {
            out[angles_at + k] = cell.get().unwrap_or(f64::NAN);
        }
        let mut along = |rates: &[FrameRates], time_rate: f64, take: &mut dyn FnMut(usize, Jet)| {
            move_along(plain, rates, time_rate, moved);
            self.values(moved, jets);
            for (row, k) in self.used().enumerate() {
                take(row, jets[k].unwrap_or(Jet::new(f64::NAN, f64::NAN, f64::NAN)));
            }
        };
        if jacobian {
            for direction in 0..6 * frames {
                refill(rates, (0..frames).map(|frame| FrameRates::unit(frame, direction)));
                along(rates, 0.0, &mut |row, value| out[count + row * 6 * frames + direction] = value.first);
            }
            refill(rates, (0..frames).map(|_| FrameRates::default()));
            along(rates, 1.0, &mut |row, value| out[count * (1 + 6 * frames) + row] = value.first);
        }
        if second {
            refill(rates, plain.twists.iter().zip(&plain.frames).map(|(t, f)| FrameRates::of(t, f)));
            along(rates, 1.0, &mut |row, value| out[count * (2 + 6 * frames) + row] = value.second);
        }
    }
}

/// First and second derivative of a frame along a motion with constant velocity and constant body-fixed rotation rate.
#[derive(Debug, Clone, Copy, Default)]
struct FrameRates {
    velocity: Vector3<f64>,
    /// About the frame's own axes.
    rotation: Vector3<f64>,
}

impl FrameRates {
    fn of(twist: &Twist<f64>, frame: &Frame<f64>) -> Self {
        Self { velocity: twist.velocity, rotation: frame.rotation.tr_mul(&twist.angular_velocity) }
    }

    /// A frame's part of the unit motion number `direction`: six per frame, three shifts, three rotations.
    fn unit(frame: usize, direction: usize) -> Self {
        let mut rates = Self::default();
        if frame == direction / 6 {
            let axis = Vector3::ith(direction % 3, 1.0);
            if direction % 6 < 3 {
                rates.velocity = axis;
            } else {
                rates.rotation = axis;
            }
        }
        rates
    }
}

/// The inputs as jets along a motion: r, v, 0 and A, A w~, A w~ w~ with w about the frame's own axes.
fn move_along(plain: &Given<f64>, rates: &[FrameRates], time_rate: f64, moved: &mut Given<Jet>) {
    let frames = plain.frames.iter().zip(rates).map(|(frame, rate)| {
        let spin = Matrix3::new(
            0.0,
            -rate.rotation.z,
            rate.rotation.y,
            rate.rotation.z,
            0.0,
            -rate.rotation.x,
            -rate.rotation.y,
            rate.rotation.x,
            0.0,
        );
        let first = frame.rotation * spin;
        let second = first * spin;
        Frame {
            position: Vec3::from_fn(|k, _| Jet::new(frame.position[k], rate.velocity[k], 0.0)),
            rotation: Mat3::from_fn(|i, j| Jet::new(frame.rotation[(i, j)], first[(i, j)], second[(i, j)])),
        }
    });
    refill(&mut moved.frames, frames);
    moved.time = Jet::new(plain.time, time_rate, 0.0);
    refill(&mut moved.references, plain.references.iter().map(|x| Jet::from(*x)));
    moved.forget_angles(plain.angles.len());
}

impl<T: Constraint> ElementSet for JointSet<T> {
    fn add(&mut self, params: &Table) -> Result<usize, CreateError> {
        let element: T = create(params)?;
        let rows: Vec<usize> = (0..T::ROWS.len()).filter(|row| element.uses_row(*row)).collect();
        let layout = Layout {
            frames: T::FRAMES.len(),
            angles: T::ANGLES,
            states: 0,
            memory: 0,
            signals: 0,
            joints: 0,
            values: rows.len() + T::COORDINATES.len(),
        };
        self.instances.push(JointEntry { element, rows, layout });
        Ok(self.instances.len() - 1)
    }

    fn record(&self, instance: usize) -> Result<Recording, Fault> {
        let entry = &self.instances[instance];
        let coordinates = || (0..T::COORDINATES.len()).map(|k| Role::Coordinate(k as u32));
        let roles = entry.rows.iter().map(|row| Role::Residual(*row as u32)).chain(coordinates());
        if T::OPAQUE {
            let angles = (0..T::ANGLES).map(|k| Role::Angle(k as u32));
            return Ok(announce(roles.chain(angles), Vec::new(), Vec::new()));
        }
        let mut forgotten = None;
        let recording = record(|| {
            let given = recorded_inputs(&entry.layout);
            let mut values = Vec::new();
            entry.values(&given, &mut values);
            forgotten = entry.used().find(|k| values[*k].is_none());
            let used = entry.used().map(|k| values[k]);
            let mut results: Vec<(Role, Recorded)> =
                roles.zip(used).filter_map(|(role, value)| Some((role, value?))).collect();
            results.extend(angle_outputs(&given));
            if let Some(count) = T::MOBILITY {
                let q: Vec<Recorded> = (0..count).map(|k| input(Input::Coordinate(k as u32))).collect();
                let pose = entry.element.pose(&q);
                for k in 0..3 {
                    results.push((Role::PosePosition(k as u32), pose.position[k]));
                }
                for k in 0..9 {
                    results.push((Role::PoseRotation(k as u32), pose.rotation[(k / 3, k % 3)]));
                }
            }
            results
        });
        let Some(k) = forgotten else { return Ok(recording) };
        let message = match T::ROWS.get(k) {
            Some(row) => format!("declares the row `{row}`, but does not set it"),
            None => {
                format!("declares the coordinate `{}`, but does not give it", T::COORDINATES[k - T::ROWS.len()].name)
            }
        };
        Err(Fault { instance, message })
    }

    fn evaluate(&self, batch: &Batch<'_>, out: &mut [f64]) -> Result<(), Fault> {
        let Some(first) = first_of(batch, &self.instances)? else { return Ok(()) };
        let layout = first.layout;
        let scratch = &mut *self.scratch.borrow_mut();
        each_instance(batch, self.instances.len(), layout.joint_results(), &layout, out, |k, numbers, results| {
            let entry = &self.instances[k];
            same_layout(k, &layout, &entry.layout)?;
            entry.evaluate(numbers, batch.wanted.jacobian, batch.wanted.second, scratch, results);
            Ok(())
        })
    }

    fn accept(&mut self, instance: usize, inputs: &[f64]) -> Result<(), Fault> {
        let entry = &mut self.instances[instance];
        let plain = &mut self.scratch.borrow_mut().plain;
        read_inputs(&entry.layout, inputs, plain);
        entry.element.accept(&plain.motion());
        Ok(())
    }

    fn save(&self, instance: usize) -> Result<Vec<u8>, Fault> {
        Ok(self.instances[instance].element.save())
    }

    fn load(&mut self, instance: usize, memory: &[u8]) -> Result<(), Fault> {
        self.instances[instance].element.load(memory).map_err(unknown_memory(instance))
    }
}

/// The recording of an opaque element: which results it gives, all referring to a single dummy operation.
fn announce(roles: impl Iterator<Item = Role>, states: Vec<f64>, memory: Vec<f64>) -> Recording {
    let mut recording = record(|| vec![(Role::Potential, Recorded::from(0.0))]);
    recording.outputs = roles.map(|role| Output { role, node: 0 }).collect();
    recording.initial_states = states;
    recording.initial_discrete = memory;
    recording
}

/// What force and control elements have in common, and where they differ.
trait Acting<T: Element>: 'static {
    /// Whether it acts on its bodies.
    const LOADS: bool;
    const INPUTS: usize;
    const JOINTS: usize;
    const CHANNELS: &'static [ChannelSpec];
    fn initial_states(element: &T) -> Vec<f64>;
    fn initial_memory(element: &T) -> Vec<f64>;
    fn wrench<S: Scalar>(element: &T, at: &Motion<'_, S>, out: &mut Wrenches<'_, S>);
    fn rates<S: Scalar>(element: &T, at: &Motion<'_, S>, out: &mut Values<'_, S>);
    fn next_memory<S: Scalar>(element: &T, at: &Motion<'_, S>, out: &mut Values<'_, S>);
    fn channels<S: Scalar>(element: &T, at: &Motion<'_, S>, out: &mut Values<'_, S>);
    fn energies<S: Scalar>(element: &T, at: &Motion<'_, S>) -> [Option<S>; 2];
}

struct AsForce;

impl<T: Force> Acting<T> for AsForce {
    const LOADS: bool = true;
    const INPUTS: usize = T::INPUTS.len();
    const JOINTS: usize = T::JOINTS.len();
    const CHANNELS: &'static [ChannelSpec] = T::CHANNELS;
    fn initial_states(element: &T) -> Vec<f64> {
        element.initial_states()
    }
    fn initial_memory(element: &T) -> Vec<f64> {
        element.initial_memory()
    }
    fn wrench<S: Scalar>(element: &T, at: &Motion<'_, S>, out: &mut Wrenches<'_, S>) {
        element.wrench(at, out);
    }
    fn rates<S: Scalar>(element: &T, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        element.rates(at, out);
    }
    fn next_memory<S: Scalar>(element: &T, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        element.next_memory(at, out);
    }
    fn channels<S: Scalar>(element: &T, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        element.channels(at, out);
    }
    fn energies<S: Scalar>(element: &T, at: &Motion<'_, S>) -> [Option<S>; 2] {
        [element.potential(at), element.dissipation(at)]
    }
}

struct AsControl;

impl<T: Control> Acting<T> for AsControl {
    const LOADS: bool = false;
    const INPUTS: usize = T::INPUTS.len();
    const JOINTS: usize = 0;
    const CHANNELS: &'static [ChannelSpec] = T::OUTPUTS;
    fn initial_states(element: &T) -> Vec<f64> {
        element.initial_states()
    }
    fn initial_memory(element: &T) -> Vec<f64> {
        element.initial_memory()
    }
    fn wrench<S: Scalar>(_: &T, _: &Motion<'_, S>, _: &mut Wrenches<'_, S>) {}
    fn rates<S: Scalar>(element: &T, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        element.rates(at, out);
    }
    fn next_memory<S: Scalar>(element: &T, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        element.next_memory(at, out);
    }
    fn channels<S: Scalar>(element: &T, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        element.outputs(at, out);
    }
    fn energies<S: Scalar>(_: &T, _: &Motion<'_, S>) -> [Option<S>; 2] {
        [None, None]
    }
}

struct ActingEntry<T> {
    element: T,
    layout: Layout,
}

/// Everything a force or control element gives, in the order of [`Layout`].
struct Found<S> {
    forces: Vec<Vec3<S>>,
    torques: Vec<Vec3<S>>,
    rates: Vec<Option<S>>,
    memory: Vec<Option<S>>,
    channels: Vec<Option<S>>,
    energies: [Option<S>; 2],
}

impl<S: Scalar> Found<S> {
    fn empty() -> Self {
        Self {
            forces: Vec::new(),
            torques: Vec::new(),
            rates: Vec::new(),
            memory: Vec::new(),
            channels: Vec::new(),
            energies: [None, None],
        }
    }

    fn evaluate<T: Element, K: Acting<T>>(&mut self, entry: &ActingEntry<T>, given: &Given<S>) {
        let at = given.motion();
        for list in [&mut self.forces, &mut self.torques] {
            refill(list, given.frames.iter().map(|_| Vec3::from_element(S::zero())));
        }
        unset(&mut self.rates, entry.layout.states);
        unset(&mut self.memory, entry.layout.memory);
        unset(&mut self.channels, entry.layout.values);
        let (forces, torques) = (&mut self.forces[..], &mut self.torques[..]);
        K::wrench(&entry.element, &at, &mut Wrenches { frames: &given.frames, forces, torques });
        K::rates(&entry.element, &at, &mut Values::new(&mut self.rates, "rate"));
        K::next_memory(&entry.element, &at, &mut Values::new(&mut self.memory, "discrete state"));
        K::channels(&entry.element, &at, &mut Values::new(&mut self.channels, "channel"));
        self.energies = K::energies(&entry.element, &at);
    }
}

struct ActingScratch {
    given: Given<f64>,
    found: Found<f64>,
}

/// Force elements (`K` is [`AsForce`]) or control elements.
struct ActingSet<T, K> {
    instances: Vec<ActingEntry<T>>,
    scratch: RefCell<ActingScratch>,
    kind: PhantomData<fn() -> K>,
}

impl<T, K> Default for ActingSet<T, K> {
    fn default() -> Self {
        let scratch = RefCell::new(ActingScratch { given: Given::empty(), found: Found::empty() });
        Self { instances: Vec::new(), scratch, kind: PhantomData }
    }
}

impl<T: Element, K: Acting<T>> ElementSet for ActingSet<T, K> {
    fn add(&mut self, params: &Table) -> Result<usize, CreateError> {
        let element: T = create(params)?;
        let layout = Layout {
            frames: T::FRAMES.len(),
            angles: T::ANGLES,
            states: K::initial_states(&element).len(),
            memory: K::initial_memory(&element).len(),
            signals: K::INPUTS,
            joints: K::JOINTS,
            values: K::CHANNELS.len(),
        };
        self.instances.push(ActingEntry { element, layout });
        Ok(self.instances.len() - 1)
    }

    fn record(&self, instance: usize) -> Result<Recording, Fault> {
        let entry = &self.instances[instance];
        let mut forgotten = None;
        let mut recording = record(|| {
            let given = recorded_inputs(&entry.layout);
            let mut found = Found::empty();
            found.evaluate::<T, K>(entry, &given);
            let mut results: Vec<(Role, Recorded)> = Vec::new();
            if K::LOADS {
                let flat = |list: &[Vec3<Recorded>]| list.iter().flat_map(|v| v.iter().copied()).collect::<Vec<_>>();
                let numbered = |list: Vec<Recorded>, role: fn(u32) -> Role| {
                    list.into_iter().enumerate().map(move |(k, value)| (role(k as u32), value))
                };
                results.extend(numbered(flat(&found.forces), Role::Force));
                results.extend(numbered(flat(&found.torques), Role::Torque));
            }
            for (list, role, what) in [
                (&found.rates, Role::StateRate as fn(u32) -> Role, "the rate of state"),
                (&found.memory, Role::NextDiscrete, "discrete state"),
                (&found.channels, Role::Channel, "channel"),
            ] {
                if let (Some(k), None) = (list.iter().position(Option::is_none), &forgotten) {
                    forgotten = Some((what, k));
                }
                results.extend(list.iter().enumerate().filter_map(|(k, value)| Some((role(k as u32), (*value)?))));
            }
            results.extend(found.energies[0].map(|v| (Role::Potential, v)));
            results.extend(found.energies[1].map(|v| (Role::Dissipation, v)));
            results.extend(angle_outputs(&given));
            results
        });
        if let Some((what, k)) = forgotten {
            let name = match what {
                "channel" => format!("`{}`", K::CHANNELS[k].name),
                _ => k.to_string(),
            };
            return Err(Fault { instance, message: format!("declares {what} {name}, but does not give it") });
        }
        recording.initial_states = K::initial_states(&entry.element);
        recording.initial_discrete = K::initial_memory(&entry.element);
        if T::OPAQUE {
            let roles: Vec<Role> = recording.outputs.iter().map(|o| o.role).collect();
            recording = announce(roles.into_iter(), recording.initial_states, recording.initial_discrete);
        }
        Ok(recording)
    }

    fn evaluate(&self, batch: &Batch<'_>, out: &mut [f64]) -> Result<(), Fault> {
        let Some(first) = first_of(batch, &self.instances)? else { return Ok(()) };
        let layout = first.layout;
        let ActingScratch { given, found } = &mut *self.scratch.borrow_mut();
        each_instance(batch, self.instances.len(), layout.force_results(), &layout, out, |k, numbers, results| {
            let entry = &self.instances[k];
            same_layout(k, &layout, &entry.layout)?;
            read_inputs(&layout, numbers, given);
            found.evaluate::<T, K>(entry, given);
            let loads = found.forces.iter().chain(&found.torques).flat_map(|v| v.iter().copied());
            let lists = [&found.rates, &found.memory, &found.channels].into_iter().flatten();
            let others = lists.chain(&found.energies).copied().chain(given.angles.iter().map(Cell::get));
            let values = loads.chain(others.map(|value| value.unwrap_or(f64::NAN)));
            for (slot, value) in results.iter_mut().zip(values) {
                *slot = value;
            }
            Ok(())
        })
    }

    fn accept(&mut self, instance: usize, inputs: &[f64]) -> Result<(), Fault> {
        let entry = &mut self.instances[instance];
        let given = &mut self.scratch.borrow_mut().given;
        read_inputs(&entry.layout, inputs, given);
        entry.element.accept(&given.motion());
        Ok(())
    }

    fn save(&self, instance: usize) -> Result<Vec<u8>, Fault> {
        Ok(self.instances[instance].element.save())
    }

    fn load(&mut self, instance: usize, memory: &[u8]) -> Result<(), Fault> {
        self.instances[instance].element.load(memory).map_err(unknown_memory(instance))
    }
}
