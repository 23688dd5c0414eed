//! Force and control elements.

use super::*;

/// What force and control elements have in common, and where they differ.
trait Acting<T: Element>: 'static {
    /// Whether it acts on its bodies.
    const LOADS: bool;
    const INPUTS: usize;
    const JOINTS: usize;
    const CHANNELS: &'static [ChannelSpec];
    const CHECKS: &'static [ChannelSpec];
    const STATES: &'static [ChannelSpec];
    fn initial_states(element: &T) -> Vec<f64>;
    fn initial_memory(element: &T) -> Vec<f64>;
    fn sample_period(element: &T) -> Option<f64>;
    fn wrench<S: Scalar>(element: &T, at: &Motion<'_, S>, out: &mut Wrenches<'_, S>);
    fn rates<S: Scalar>(element: &T, at: &Motion<'_, S>, out: &mut Values<'_, S>);
    fn next_memory<S: Scalar>(element: &T, at: &Motion<'_, S>, out: &mut Values<'_, S>);
    fn channels<S: Scalar>(element: &T, at: &Motion<'_, S>, out: &mut Values<'_, S>);
    fn energies<S: Scalar>(element: &T, at: &Motion<'_, S>) -> [Option<S>; 2];
    fn checks<S: Scalar>(element: &T, at: &Motion<'_, S>, out: &mut Values<'_, S>);
    fn flexible(element: &T) -> usize {
        let _ = element;
        0
    }
    fn flexible_forces<S: Scalar>(element: &T, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let _ = (element, at, out);
    }
    fn kinetic<S: Scalar>(element: &T, at: &Motion<'_, S>) -> Option<S> {
        let _ = (element, at);
        None
    }
}

pub(super) struct AsForce;

impl<T: Force> Acting<T> for AsForce {
    const LOADS: bool = true;
    const INPUTS: usize = T::INPUTS.len();
    const JOINTS: usize = T::JOINTS.len();
    const CHANNELS: &'static [ChannelSpec] = T::CHANNELS;
    const CHECKS: &'static [ChannelSpec] = T::CHECKS;
    const STATES: &'static [ChannelSpec] = T::STATES;
    fn initial_states(element: &T) -> Vec<f64> {
        element.initial_states()
    }
    fn initial_memory(element: &T) -> Vec<f64> {
        element.initial_memory()
    }
    fn sample_period(element: &T) -> Option<f64> {
        element.sample_period()
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
    fn checks<S: Scalar>(element: &T, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        element.checks(at, out);
    }
    fn flexible(element: &T) -> usize {
        element.flexible()
    }
    fn flexible_forces<S: Scalar>(element: &T, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        element.flexible_forces(at, out);
    }
    fn kinetic<S: Scalar>(element: &T, at: &Motion<'_, S>) -> Option<S> {
        element.kinetic(at)
    }
}

pub(super) struct AsControl;

impl<T: Control> Acting<T> for AsControl {
    const LOADS: bool = false;
    const INPUTS: usize = T::INPUTS.len();
    const JOINTS: usize = 0;
    const CHANNELS: &'static [ChannelSpec] = T::OUTPUTS;
    const CHECKS: &'static [ChannelSpec] = T::CHECKS;
    const STATES: &'static [ChannelSpec] = T::STATES;
    fn initial_states(element: &T) -> Vec<f64> {
        element.initial_states()
    }
    fn initial_memory(element: &T) -> Vec<f64> {
        element.initial_memory()
    }
    fn sample_period(element: &T) -> Option<f64> {
        element.sample_period()
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
    fn checks<S: Scalar>(element: &T, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        element.checks(at, out);
    }
}

struct ActingEntry<T> {
    element: T,
    /// Starting guesses of the internal unknowns.
    guesses: Vec<f64>,
    /// Number of flexible coordinates; the states begin with these and their rates.
    flexible: usize,
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
        let (rates, unknowns) = self.rates.split_at_mut(entry.layout.states - entry.guesses.len());
        // Of flexible coordinates: q', then the forces that q'' follows from.
        let n = entry.flexible;
        rates[..n].iter_mut().zip(&given.states[n..]).for_each(|(rate, speed)| *rate = Some(*speed));
        let forces = &mut Values::new(&mut rates[n..2 * n], "flexible force");
        K::flexible_forces(&entry.element, &at, forces);
        K::rates(&entry.element, &at, &mut Values::new(&mut rates[2 * n..], "rate"));
        if !unknowns.is_empty() {
            let found = conditions(&entry.element, unknowns.len(), given);
            unknowns.iter_mut().rev().zip(found).for_each(|(slot, value)| *slot = value);
        }
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
pub(super) struct ActingSet<T, K> {
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
        let (element, frames) = create::<T>(params)?;
        let guesses = element.initial_unknowns();
        let layout = Layout {
            frames,
            angles: T::ANGLES,
            states: K::initial_states(&element).len() + guesses.len(),
            memory: K::initial_memory(&element).len(),
            signals: K::INPUTS,
            joints: K::JOINTS,
            values: K::CHANNELS.len(),
        };
        let flexible = K::flexible(&element);
        if layout.states - guesses.len() < 2 * flexible {
            let message = format!("{flexible} flexible coordinates need {} states, q and q'", 2 * flexible);
            return Err(CreateError::Fault(message));
        }
        self.instances.push(ActingEntry { element, guesses, flexible, layout });
        Ok(self.instances.len() - 1)
    }

    fn record(&self, instance: usize) -> Result<Recording, Fault> {
        let entry = &self.instances[instance];
        let mut forgotten = None;
        refuse_opaque_unknowns(instance, T::OPAQUE, entry.guesses.len())?;
        let mut missing = None;
        let mut recording = record(|| {
            let given = recorded_inputs(&entry.layout, entry.guesses.len());
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
            let mut checks = Vec::new();
            if !T::OPAQUE {
                unset(&mut checks, K::CHECKS.len());
                K::checks(&entry.element, &given.motion(), &mut Values::new(&mut checks, "check"));
            }
            for (list, role, what) in [
                (&found.rates, Role::StateRate as fn(u32) -> Role, "the rate of state"),
                (&found.memory, Role::NextDiscrete, "discrete state"),
                (&found.channels, Role::Channel, "channel"),
                (&checks, Role::Check, "check"),
            ] {
                let of_states = matches!(role(0), Role::StateRate(_));
                let list = &list[..list.len() - if of_states { entry.guesses.len() } else { 0 }];
                let n = entry.flexible;
                if let (Some(k), None) = (list.iter().position(Option::is_none), &forgotten) {
                    forgotten = match k.checked_sub(n) {
                        Some(force) if of_states && force < n => Some(("the force on flexible coordinate", force)),
                        _ => Some((what, k)),
                    };
                }
                let role_of = |k: usize| match k.checked_sub(n) {
                    Some(force) if of_states && force < n => Role::FlexibleForce(force as u32),
                    _ => role(k as u32),
                };
                results.extend(list.iter().enumerate().filter_map(|(k, value)| Some((role_of(k), (*value)?))));
                if of_states && !entry.guesses.is_empty() {
                    match unknown_outputs(&entry.element, &entry.guesses, &given) {
                        Ok(outputs) => results.extend(outputs),
                        Err(message) => missing = Some(message),
                    }
                }
            }
            results.extend(found.energies[0].map(|v| (Role::Potential, v)));
            results.extend(found.energies[1].map(|v| (Role::Dissipation, v)));
            results.extend(K::kinetic(&entry.element, &given.motion()).map(|energy| (Role::Kinetic, energy)));
            results.extend(angle_outputs(&given));
            results.extend(K::sample_period(&entry.element).map(|period| (Role::SamplePeriod, Recorded::from(period))));
            results
        });
        if let Some(message) = missing {
            return Err(Fault { instance, message });
        }
        if let Some((what, k)) = forgotten {
            let named = match what {
                "channel" => K::CHANNELS.get(k),
                "check" => K::CHECKS.get(k),
                "the rate of state" => K::STATES.get(k),
                _ => None,
            };
            return Err(not_given(instance, what, k, named));
        }
        recording.initial_states = K::initial_states(&entry.element);
        recording.initial_discrete = K::initial_memory(&entry.element);
        if T::OPAQUE {
            let roles: Vec<Role> = recording.outputs.iter().map(|o| o.role).collect();
            if roles.iter().any(|role| matches!(role, Role::Kinetic | Role::FlexibleForce(_))) {
                let message = "has a kinetic energy, which an opaque element cannot have: let it be recorded".into();
                return Err(Fault { instance, message });
            }
            let period = recording.sample_period();
            recording = announce(roles.into_iter(), recording.initial_states, recording.initial_discrete);
            if let (Some(period), Some(number)) = (period, recording.constants.first_mut()) {
                // What all results refer to is never computed.
                *number = period;
            }
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
            read_inputs(&layout, entry.guesses.len(), numbers, given);
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
        read_inputs(&entry.layout, entry.guesses.len(), inputs, given);
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
