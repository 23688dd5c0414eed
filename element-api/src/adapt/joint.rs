//! Joints: rows, coordinates, and their exact derivatives.

use super::*;

/// A joint with what does not change about it.
struct JointEntry<T> {
    element: T,
    rows: Vec<usize>,
    /// Starting guesses of the internal unknowns.
    guesses: Vec<f64>,
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

pub(super) struct JointSet<T> {
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
        let at = given.motion();
        unset(values, T::ROWS.len() + T::COORDINATES.len());
        let (rows, coordinates) = values.split_at_mut(T::ROWS.len());
        self.element.residual_in_motion(&at, &mut Values::new(rows, "row"));
        self.element.coordinates(&at.configuration, &mut Values::new(coordinates, "coordinate"));
    }

    /// Where the rows in use and the coordinates are among [`JointEntry::values`].
    fn used(&self) -> impl Iterator<Item = usize> {
        self.rows.iter().copied().chain(T::ROWS.len()..T::ROWS.len() + T::COORDINATES.len())
    }

    fn evaluate(&self, numbers: &[f64], jacobian: bool, second: bool, scratch: &mut JointScratch, out: &mut [f64]) {
        let JointScratch { plain, moved, rates, values, jets } = scratch;
        let (count, frames) = (self.layout.values, self.layout.frames);
        read_inputs(&self.layout, self.guesses.len(), numbers, plain);
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
    refill(&mut moved.unknowns, plain.unknowns.iter().map(|x| Jet::from(*x)));
    // Rows take no velocities; whoever does so all the same reads what the recording is refused for.
    let still =
        Twist { velocity: Vec3::from_element(Jet::from(0.0)), angular_velocity: Vec3::from_element(Jet::from(0.0)) };
    refill(&mut moved.twists, plain.frames.iter().map(|_| still));
    refill(&mut moved.states, plain.states.iter().map(|x| Jet::from(*x)));
    refill(&mut moved.memory, plain.memory.iter().map(|x| Jet::from(*x)));
    refill(&mut moved.signals, plain.signals.iter().map(|x| Jet::from(*x)));
    refill(&mut moved.references, plain.references.iter().map(|x| Jet::from(*x)));
    moved.forget_angles(plain.angles.len());
}

impl<T: Constraint> ElementSet for JointSet<T> {
    fn add(&mut self, params: &Table) -> Result<usize, CreateError> {
        let (element, frames) = create::<T>(params)?;
        let rows: Vec<usize> = (0..T::ROWS.len()).filter(|row| element.uses_row(*row)).collect();
        let guesses = element.initial_unknowns();
        let layout = Layout {
            frames,
            angles: T::ANGLES,
            states: element.initial_states().len() + guesses.len(),
            memory: element.initial_memory().len(),
            signals: T::INPUTS.len(),
            joints: 0,
            values: rows.len() + T::COORDINATES.len(),
        };
        self.instances.push(JointEntry { element, rows, guesses, layout });
        Ok(self.instances.len() - 1)
    }

    fn record(&self, instance: usize) -> Result<Recording, Fault> {
        let entry = &self.instances[instance];
        let coordinates = || (0..T::COORDINATES.len()).map(|k| Role::Coordinate(k as u32));
        let roles = entry.rows.iter().map(|row| Role::Residual(*row as u32)).chain(coordinates());
        refuse_opaque_unknowns(instance, T::OPAQUE, entry.guesses.len())?;
        if T::OPAQUE && !T::VELOCITY_ROWS.is_empty() {
            let message = "has velocity rows, which an opaque element cannot have: let it be recorded".into();
            return Err(Fault { instance, message });
        }
        let used = (0..T::ROWS.len() + T::VELOCITY_ROWS.len()).filter(|row| entry.element.uses_row(*row));
        let unilateral =
            used.clone().filter_map(|row| Some((Role::Unilateral(row as u32), entry.element.unilateral(row)?)));
        let sticking =
            used.clone().filter_map(|row| Some((Role::SticksWith(row as u32), entry.element.sticks_with(row)? as f64)));
        let sliding =
            used.clone().filter_map(|row| Some((Role::SlidesWith(row as u32), entry.element.slides_with(row)? as f64)));
        let switching: Vec<(Role, f64)> = unilateral.chain(sticking).chain(sliding).collect();
        if T::OPAQUE && !switching.is_empty() {
            let message = "has unilateral rows, which an opaque element cannot have: let it be recorded".into();
            return Err(Fault { instance, message });
        }
        if T::OPAQUE && entry.layout.states + entry.layout.memory + entry.layout.signals + T::CHANNELS.len() > 0 {
            let message =
                "has states, memory or channels, or takes signals, which an opaque joint cannot: let it be recorded"
                    .into();
            return Err(Fault { instance, message });
        }
        if T::OPAQUE {
            let angles = (0..T::ANGLES).map(|k| Role::Angle(k as u32));
            return Ok(announce(roles.chain(angles), Vec::new(), Vec::new()));
        }
        let (mut forgotten, mut forgotten_rate, mut forgotten_value) = (None, None, None);
        let mut missing = None;
        let mut recording = record(|| {
            let given = recorded_inputs(&entry.layout, entry.guesses.len());
            let mut values = Vec::new();
            entry.values(&given, &mut values);
            forgotten = entry.used().find(|k| values[*k].is_none());
            let found = entry.used().map(|k| values[k]);
            let mut results: Vec<(Role, Recorded)> =
                roles.zip(found).filter_map(|(role, value)| Some((role, value?))).collect();
            let first = T::ROWS.len();
            let mut rates = vec![None; T::VELOCITY_ROWS.len()];
            entry.element.velocity_residual(&given.motion(), &mut Values::new(&mut rates, "velocity row"));
            for (k, rate) in rates.into_iter().enumerate().filter(|(k, _)| entry.element.uses_row(first + k)) {
                match rate {
                    Some(rate) => results.push((Role::VelocityResidual((first + k) as u32), rate)),
                    None => forgotten_rate = forgotten_rate.or(Some(k)),
                }
            }
            let at = given.motion();
            let mut moving = vec![None; entry.layout.states - entry.guesses.len()];
            entry.element.rates(&at, &mut Values::new(&mut moving, "rate"));
            let mut memory = vec![None; entry.layout.memory];
            entry.element.next_memory(&at, &mut Values::new(&mut memory, "discrete state"));
            let mut channels = vec![None; T::CHANNELS.len()];
            entry.element.channels(&at, &mut Values::new(&mut channels, "channel"));
            for (list, role, what) in [
                (moving, Role::StateRate as fn(u32) -> Role, "the rate of state"),
                (memory, Role::NextDiscrete, "discrete state"),
                (channels, Role::Channel, "channel"),
            ] {
                forgotten_value = forgotten_value.or(list.iter().position(Option::is_none).map(|k| (what, k)));
                let numbered = list.into_iter().enumerate();
                results.extend(numbered.filter_map(|(k, value)| Some((role(k as u32), value?))));
            }
            results.extend(entry.element.sample_period().map(|period| (Role::SamplePeriod, Recorded::from(period))));
            results.extend(switching.iter().map(|(role, value)| (*role, Recorded::from(*value))));
            let limit = |row: usize| Some((Role::Limit(row as u32), entry.element.limit(row, &given.motion())?));
            results.extend(used.clone().filter_map(limit));
            match unknown_outputs(&entry.element, &entry.guesses, &given) {
                Ok(outputs) => results.extend(outputs),
                Err(message) => missing = Some(message),
            }
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
        if let Some(message) = missing {
            return Err(Fault { instance, message });
        }
        recording.initial_states = entry.element.initial_states();
        recording.initial_discrete = entry.element.initial_memory();
        if let Some((what, k)) = forgotten_value {
            let named = match what {
                "channel" => T::CHANNELS.get(k),
                "discrete state" => None,
                _ => T::STATES.get(k),
            };
            return Err(not_given(instance, what, k, named));
        }
        let message = match forgotten.map(|k| (k, T::ROWS.get(k))) {
            None => match forgotten_rate {
                None => return Ok(recording),
                Some(k) => format!("declares the velocity row `{}`, but does not set it", T::VELOCITY_ROWS[k]),
            },
            Some((_, Some(row))) => format!("declares the row `{row}`, but does not set it"),
            Some((k, None)) => {
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
        read_inputs(&entry.layout, entry.guesses.len(), inputs, plain);
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
