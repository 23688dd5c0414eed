//! From an author's element to an [`ElementClass`]: recording, and evaluation with plain numbers.

use std::cell::Cell;
use std::marker::PhantomData;

use nalgebra::{Matrix3, Vector3};

use crate::descriptor::{Descriptor, Kind, Named};
use crate::element::{ChannelSpec, Configuration, Constraint, Element, Force, Motion, Rows, Wrenches};
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
    Box::new(Class::<T, JointSet<T>> { descriptor, marker: PhantomData })
}

/// The class of a force element.
#[must_use]
pub fn force<T: Force>() -> Box<dyn ElementClass> {
    let descriptor = describe::<T>(Kind::Force, T::CHANNELS, T::STATES);
    Box::new(Class::<T, ForceSet<T>> { descriptor, marker: PhantomData })
}

fn describe<T: Element>(kind: Kind, channels: &[ChannelSpec], states: &[ChannelSpec]) -> Descriptor {
    let named = |list: &[ChannelSpec]| -> Vec<Named> {
        list.iter().map(|c| Named { name: c.name.into(), unit: c.unit.into(), doc: c.doc.into() }).collect()
    };
    Descriptor {
        name: T::NAME.into(),
        kind,
        summary: T::SUMMARY.into(),
        opaque: T::OPAQUE,
        angles: T::ANGLES,
        mobility: None,
        frames: T::FRAMES
            .iter()
            .map(|f| Named { name: f.name.into(), unit: String::new(), doc: f.doc.into() })
            .collect(),
        rows: Vec::new(),
        channels: named(channels),
        states: named(states),
        params: T::Parameters::specs(),
    }
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
    frames: Vec<Frame<S>>,
    twists: Vec<Twist<S>>,
    angles: Vec<Cell<Option<S>>>,
}

impl<S: Scalar> Given<S> {
    fn configuration(&self) -> Configuration<'_, S> {
        Configuration { frames: &self.frames, time: self.time, references: &self.references, angles: &self.angles }
    }
    fn motion(&self) -> Motion<'_, S> {
        Motion::new(self.configuration(), &self.twists, &self.states, &self.memory)
    }
}

/// All inputs written down on the tape. Those that no equation uses are dead operations; the host drops them.
fn recorded_inputs(layout: &Layout) -> Given<Recorded> {
    let list = |count: usize, kind: fn(u32) -> Input| (0..count).map(|k| input(kind(k as u32))).collect();
    let vector = |frame: u32, make: fn(u32, u32) -> Input| Vec3::from_fn(|row, _| input(make(frame, row as u32)));
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
    Given {
        time: input(Input::Time),
        references: list(layout.angles, Input::AngleReference),
        states: list(layout.states, Input::State),
        memory: list(layout.memory, Input::Discrete),
        frames,
        twists,
        angles: (0..layout.angles).map(|_| Cell::new(None)).collect(),
    }
}

fn angle_outputs(given: &Given<Recorded>) -> impl Iterator<Item = (Role, Recorded)> {
    let computed = given.angles.iter().enumerate();
    computed.filter_map(|(k, cell)| cell.get().map(|angle| (Role::Angle(k as u32), angle)))
}

/// Reads an instance's part of a batch. `lift(k, value)` turns input number `k` into a scalar.
fn plain_inputs<S: Scalar>(layout: &Layout, numbers: &[f64], lift: impl Fn(usize, f64) -> S) -> Given<S> {
    let at = |k: usize| lift(k, numbers[k]);
    let list = |from: usize, count: usize| (from..from + count).map(at).collect::<Vec<S>>();
    let base = |frame: usize| layout.frames_at() + 18 * frame;
    let vector = |from: usize| Vec3::from_fn(|row, _| at(from + row));
    Given {
        time: at(0),
        references: list(1, layout.angles),
        states: list(1 + layout.angles, layout.states),
        memory: list(1 + layout.angles + layout.states, layout.memory),
        frames: (0..layout.frames)
            .map(|f| Frame {
                position: vector(base(f)),
                rotation: Mat3::from_fn(|row, column| at(base(f) + 3 + 3 * row + column)),
            })
            .collect(),
        twists: (0..layout.frames)
            .map(|f| Twist { velocity: vector(base(f) + 12), angular_velocity: vector(base(f) + 15) })
            .collect(),
        angles: (0..layout.angles).map(|_| Cell::new(None)).collect(),
    }
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

/// Instances of a class may differ in rows in use and discrete states; those of a batch may not.
fn same_layout(instance: usize, expected: &Layout, found: &Layout) -> Result<(), Fault> {
    if expected == found {
        return Ok(());
    }
    let message = format!("a batch needs instances of one layout: the first has {expected:?}, this one {found:?}");
    Err(Fault { instance, message })
}

struct JointSet<T> {
    instances: Vec<T>,
}

impl<T> Default for JointSet<T> {
    fn default() -> Self {
        Self { instances: Vec::new() }
    }
}

impl<T: Constraint> JointSet<T> {
    fn used_rows(element: &T) -> Vec<usize> {
        (0..T::ROWS.len()).filter(|row| element.uses_row(*row)).collect()
    }

    fn layout() -> Layout {
        Layout { frames: T::FRAMES.len(), angles: T::ANGLES, states: 0, memory: 0, values: T::COORDINATES.len() }
    }

    /// With the rows that this instance uses.
    fn layout_of(element: &T) -> Layout {
        Layout { values: Self::used_rows(element).len() + T::COORDINATES.len(), ..Self::layout() }
    }

    /// Used residual rows, then coordinates; a row the author forgot is NaN.
    fn values<S: Scalar>(element: &T, given: &Given<S>) -> Vec<S> {
        let forgotten = || S::from(f64::NAN);
        Self::given_values(element, given).into_iter().map(|value| value.unwrap_or_else(forgotten)).collect()
    }

    /// Used residual rows, then coordinates, as far as the author gives them.
    fn given_values<S: Scalar>(element: &T, given: &Given<S>) -> Vec<Option<S>> {
        let at = given.configuration();
        let mut values = vec![None; T::ROWS.len()];
        element.residual(&at, &mut Rows { values: &mut values, next: 0 });
        let coordinates = element.coordinates(&at);
        let rows = Self::used_rows(element).into_iter().map(|row| values[row]);
        rows.chain((0..T::COORDINATES.len()).map(|k| coordinates.get(k).copied())).collect()
    }

    fn evaluate_one(element: &T, numbers: &[f64], jacobian: bool, second: bool, out: &mut [f64]) {
        let layout = Self::layout();
        let count = Self::used_rows(element).len() + T::COORDINATES.len();
        let frames = layout.frames;
        let plain = plain_inputs(&layout, numbers, |_, x| x);
        for (slot, value) in out.iter_mut().zip(Self::values(element, &plain)) {
            *slot = value;
        }
        let angles_at = count * (3 + 6 * frames);
        for (k, cell) in plain.angles.iter().enumerate() {
            out[angles_at + k] = cell.get().unwrap_or(f64::NAN);
        }
        if jacobian {
            for direction in 0..6 * frames {
                let rates = frame_rates(&plain, direction);
                let given = moved(&plain, &rates, 0.0);
                for (row, value) in Self::values(element, &given).into_iter().enumerate() {
                    out[count + row * 6 * frames + direction] = value.first;
                }
            }
            let still = vec![FrameRates::default(); frames];
            for (row, value) in Self::values(element, &moved(&plain, &still, 1.0)).into_iter().enumerate() {
                out[count + count * 6 * frames + row] = value.first;
            }
        }
        if second {
            let rates: Vec<FrameRates> =
                plain.twists.iter().zip(&plain.frames).map(|(t, f)| FrameRates::of(t, f)).collect();
            for (row, value) in Self::values(element, &moved(&plain, &rates, 1.0)).into_iter().enumerate() {
                out[count + count * (6 * frames + 1) + row] = value.second;
            }
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
}

/// The unit motion number `direction`: six per frame, three shifts, three rotations.
fn frame_rates(plain: &Given<f64>, direction: usize) -> Vec<FrameRates> {
    let mut rates = vec![FrameRates::default(); plain.frames.len()];
    let axis = Vector3::ith(direction % 3, 1.0);
    let frame = &mut rates[direction / 6];
    if direction % 6 < 3 {
        frame.velocity = axis
    } else {
        frame.rotation = axis
    }
    rates
}

/// The inputs as jets along a motion: r, v, 0 and A, A w~, A w~ w~ with w about the frame's own axes.
fn moved(plain: &Given<f64>, rates: &[FrameRates], time_rate: f64) -> Given<Jet> {
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
    let lift = |list: &[f64]| list.iter().map(|x| Jet::from(*x)).collect::<Vec<_>>();
    Given {
        time: Jet::new(plain.time, time_rate, 0.0),
        references: lift(&plain.references),
        states: lift(&plain.states),
        memory: lift(&plain.memory),
        frames: frames.collect(),
        twists: plain
            .twists
            .iter()
            .map(|t| Twist { velocity: t.velocity.map(Jet::from), angular_velocity: t.angular_velocity.map(Jet::from) })
            .collect(),
        angles: plain.angles.iter().map(|_| Cell::new(None)).collect(),
    }
}

impl<T: Constraint> ElementSet for JointSet<T> {
    fn add(&mut self, params: &Table) -> Result<usize, CreateError> {
        self.instances.push(create(params)?);
        Ok(self.instances.len() - 1)
    }

    fn record(&self, instance: usize) -> Result<Recording, Fault> {
        let element = &self.instances[instance];
        let rows = Self::used_rows(element);
        if T::OPAQUE {
            let coordinates = (0..T::COORDINATES.len()).map(|k| Role::Coordinate(k as u32));
            let angles = (0..T::ANGLES).map(|k| Role::Angle(k as u32));
            let roles = rows.iter().map(|row| Role::Residual(*row as u32)).chain(coordinates).chain(angles);
            return Ok(announce(roles, Vec::new(), Vec::new()));
        }
        let mut forgotten = None;
        let recording = record(|| {
            let given = recorded_inputs(&Self::layout());
            let values = Self::given_values(element, &given);
            forgotten = values.iter().position(Option::is_none);
            let coordinates = (0..T::COORDINATES.len()).map(|k| Role::Coordinate(k as u32));
            let roles = rows.iter().map(|row| Role::Residual(*row as u32)).chain(coordinates);
            let mut results: Vec<(Role, Recorded)> =
                roles.zip(values).filter_map(|(role, value)| Some((role, value?))).collect();
            results.extend(angle_outputs(&given));
            if let Some(count) = T::MOBILITY {
                let q: Vec<Recorded> = (0..count).map(|k| input(Input::Coordinate(k as u32))).collect();
                let pose = element.pose(&q);
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
        let message = match rows.get(k) {
            Some(row) => format!("declares the row `{}`, but does not set it", T::ROWS[*row]),
            None => format!("declares the coordinate `{}`, but does not give it", T::COORDINATES[k - rows.len()].name),
        };
        Err(Fault { instance, message })
    }

    fn evaluate(&self, batch: &Batch<'_>, out: &mut [f64]) -> Result<(), Fault> {
        let Some(first) = first_of(batch, &self.instances)? else { return Ok(()) };
        let layout = Self::layout_of(first);
        each_instance(batch, self.instances.len(), layout.joint_results(), &layout, out, |k, numbers, results| {
            let element = &self.instances[k];
            same_layout(k, &layout, &Self::layout_of(element))?;
            Self::evaluate_one(element, numbers, batch.wanted.jacobian, batch.wanted.second, results);
            Ok(())
        })
    }

    fn accept(&mut self, instance: usize, inputs: &[f64]) -> Result<(), Fault> {
        self.instances[instance].accept(&plain_inputs(&Self::layout(), inputs, |_, x| x).motion());
        Ok(())
    }

    fn save(&self, instance: usize) -> Result<Vec<u8>, Fault> {
        Ok(self.instances[instance].save())
    }

    fn load(&mut self, instance: usize, memory: &[u8]) -> Result<(), Fault> {
        self.instances[instance].load(memory).map_err(|message| Fault { instance, message })
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

struct ForceSet<T> {
    instances: Vec<T>,
}

impl<T> Default for ForceSet<T> {
    fn default() -> Self {
        Self { instances: Vec::new() }
    }
}

/// What the author forgot is NaN.
fn padded<S: Scalar>(mut list: Vec<S>, count: usize) -> Vec<S> {
    list.resize(list.len().max(count), S::from(f64::NAN));
    list
}

/// Everything a force gives, in the order of [`Layout`].
struct ForceResults<S> {
    forces: Vec<Vec3<S>>,
    torques: Vec<Vec3<S>>,
    rates: Vec<S>,
    memory: Vec<S>,
    channels: Vec<S>,
    potential: Option<S>,
    dissipation: Option<S>,
}

impl<T: Force> ForceSet<T> {
    fn layout(element: &T) -> Layout {
        Layout {
            frames: T::FRAMES.len(),
            angles: T::ANGLES,
            states: T::STATES.len(),
            memory: element.initial_memory().len(),
            values: T::CHANNELS.len(),
        }
    }

    fn results<S: Scalar>(element: &T, given: &Given<S>) -> ForceResults<S> {
        let at = given.motion();
        let zero = vec![Vec3::from_element(S::zero()); T::FRAMES.len()];
        let (mut forces, mut torques) = (zero.clone(), zero);
        element.wrench(&at, &mut Wrenches { frames: &given.frames, forces: &mut forces, torques: &mut torques });
        ForceResults {
            forces,
            torques,
            rates: padded(element.rates(&at), T::STATES.len()),
            memory: padded(element.next_memory(&at), given.memory.len()),
            channels: padded(element.channels(&at), T::CHANNELS.len()),
            potential: element.potential(&at),
            dissipation: element.dissipation(&at),
        }
    }
}

impl<T: Force> ElementSet for ForceSet<T> {
    fn add(&mut self, params: &Table) -> Result<usize, CreateError> {
        self.instances.push(create(params)?);
        Ok(self.instances.len() - 1)
    }

    fn record(&self, instance: usize) -> Result<Recording, Fault> {
        let element = &self.instances[instance];
        let layout = Self::layout(element);
        let outputs = |given: &Given<Recorded>| {
            let found = Self::results(element, given);
            let numbered = |list: Vec<Recorded>, role: fn(u32) -> Role| {
                list.into_iter().enumerate().map(move |(k, value)| (role(k as u32), value))
            };
            let flat = |list: &[Vec3<Recorded>]| list.iter().flat_map(|v| v.iter().copied()).collect::<Vec<_>>();
            let mut results: Vec<(Role, Recorded)> = numbered(flat(&found.forces), Role::Force).collect();
            results.extend(numbered(flat(&found.torques), Role::Torque));
            results.extend(numbered(found.rates, Role::StateRate));
            results.extend(numbered(found.memory, Role::NextDiscrete));
            results.extend(numbered(found.channels, Role::Channel));
            results.extend(found.potential.map(|v| (Role::Potential, v)));
            results.extend(found.dissipation.map(|v| (Role::Dissipation, v)));
            results.extend(angle_outputs(given));
            results
        };
        let mut recording = record(|| outputs(&recorded_inputs(&layout)));
        recording.initial_states = element.initial_states();
        recording.initial_discrete = element.initial_memory();
        if T::OPAQUE {
            let roles: Vec<Role> = recording.outputs.iter().map(|o| o.role).collect();
            recording = announce(roles.into_iter(), recording.initial_states, recording.initial_discrete);
        }
        Ok(recording)
    }

    fn evaluate(&self, batch: &Batch<'_>, out: &mut [f64]) -> Result<(), Fault> {
        let Some(first) = first_of(batch, &self.instances)? else { return Ok(()) };
        let layout = Self::layout(first);
        each_instance(batch, self.instances.len(), layout.force_results(), &layout, out, |k, numbers, results| {
            same_layout(k, &layout, &Self::layout(&self.instances[k]))?;
            let given = plain_inputs(&layout, numbers, |_, x| x);
            let found = Self::results(&self.instances[k], &given);
            let forces = found.forces.iter().flat_map(|v| v.iter().copied());
            let torques = found.torques.iter().flat_map(|v| v.iter().copied());
            let energies = [found.potential.unwrap_or(f64::NAN), found.dissipation.unwrap_or(f64::NAN)];
            let values = forces
                .chain(torques)
                .chain(found.rates.into_iter().take(layout.states))
                .chain(found.memory.into_iter().take(layout.memory))
                .chain(found.channels.into_iter().take(layout.values))
                .chain(energies)
                .chain(given.angles.iter().map(|cell| cell.get().unwrap_or(f64::NAN)));
            for (slot, value) in results.iter_mut().zip(values) {
                *slot = value;
            }
            Ok(())
        })
    }

    fn accept(&mut self, instance: usize, inputs: &[f64]) -> Result<(), Fault> {
        let layout = Self::layout(&self.instances[instance]);
        self.instances[instance].accept(&plain_inputs(&layout, inputs, |_, x| x).motion());
        Ok(())
    }

    fn save(&self, instance: usize) -> Result<Vec<u8>, Fault> {
        Ok(self.instances[instance].save())
    }

    fn load(&mut self, instance: usize, memory: &[u8]) -> Result<(), Fault> {
        self.instances[instance].load(memory).map_err(|message| Fault { instance, message })
    }
}
