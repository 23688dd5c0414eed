//! [`Variation`]: one input of an element that varies while the others are held, by a step and as jets.

use crate::descriptor::{Descriptor, Named};
use crate::geometry::Vec3;
use crate::jet::Jet;
use crate::recording::Input;
use crate::testkit::{Setting, turn};

/// What varies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Variation {
    Time,
    /// Shift in a ground direction (0..3) or rotation about one of the frame's own axes (3..6).
    Frame(usize, usize),
    /// Component of the velocity (0..3) or angular velocity (3..6).
    Twist(usize, usize),
    State(usize),
    Signal(usize),
    /// Component of the force (0..3) or torque (3..6) of a joint.
    Reaction(usize, usize),
    /// Everything along the motion that [`Setting::after`] follows.
    Motion,
}

impl Variation {
    /// What varies, as an author calls it.
    pub(super) fn text(self, descriptor: &Descriptor) -> String {
        let axis = |component: usize| ["x", "y", "z"][component % 3];
        let name =
            |list: &[Named], k: usize| list.get(k).map_or_else(|| k.to_string(), |named| format!("`{}`", named.name));
        match self {
            Self::Time => "time".into(),
            Self::Motion => "the motion".into(),
            Self::Frame(k, direction) => {
                let (frame, axis) = (name(&descriptor.frames, k), axis(direction));
                if direction < 3 {
                    format!("a shift of frame {frame} along {axis}")
                } else {
                    format!("a rotation of frame {frame} about its own {axis} axis")
                }
            }
            Self::Twist(k, component) => {
                let what = if component < 3 { "velocity" } else { "angular velocity" };
                format!("the {what} of frame {}, component {}", name(&descriptor.frames, k), axis(component))
            }
            Self::State(k) => format!("state {}", name(&descriptor.states, k)),
            Self::Signal(k) => match descriptor.inputs.get(k) {
                Some(input) => format!("input `{}`", input.name),
                None => format!("input {k}"),
            },
            Self::Reaction(k, component) => {
                let what = if component < 3 { "force" } else { "torque" };
                format!("the reaction {what} of joint {}, component {}", name(&descriptor.joints, k), axis(component))
            }
        }
    }

    /// The variations of all inputs of a setting, `motion` with or without what only force and control elements see.
    pub(super) fn all(setting: &Setting, velocities: bool) -> Vec<Self> {
        let components = |make: fn(usize, usize) -> Self, count: usize| {
            (0..count).flat_map(move |k| (0..6).map(move |component| make(k, component)))
        };
        let mut all = vec![Self::Time];
        all.extend(components(Self::Frame, setting.frames.len()));
        if velocities {
            all.extend(components(Self::Twist, setting.twists.len()));
        }
        all.extend((0..setting.states.len()).map(Self::State));
        all.extend((0..setting.signals.len()).map(Self::Signal));
        all.extend(components(Self::Reaction, setting.reactions.len()));
        all
    }

    /// The setting with a step of this variation.
    pub(super) fn step(self, setting: &Setting, h: f64) -> Setting {
        let mut other = match self {
            Self::Frame(frame, direction) => return setting.displaced(frame, direction, h),
            Self::Motion => return setting.after(h),
            _ => setting.clone(),
        };
        let vector = |component: usize| Vec3::ith(component % 3, h);
        match self {
            Self::Time => other.time += h,
            Self::Twist(k, component) if component < 3 => other.twists[k].velocity += vector(component),
            Self::Twist(k, component) => other.twists[k].angular_velocity += vector(component),
            Self::State(k) => other.states[k] += h,
            Self::Signal(k) => other.signals[k] += h,
            Self::Reaction(k, component) if component < 3 => other.reactions[k].force += vector(component),
            Self::Reaction(k, component) => other.reactions[k].torque += vector(component),
            Self::Frame(..) | Self::Motion => {}
        }
        other
    }

    /// An input as a jet along this variation.
    pub(super) fn jet(self, setting: &Setting, input: Input) -> Jet {
        let value = setting.read(input, &[]);
        let (first, second) = match input {
            Input::Time => (f64::from(u8::from(matches!(self, Self::Time | Self::Motion))), 0.0),
            Input::Position { frame, component } => (self.shift(setting, frame as usize)[component as usize], 0.0),
            Input::Rotation { frame, row, column } => {
                // A, A w~, A w~ w~ with w about the frame's own axes.
                let spin = self.spin(setting, frame as usize).cross_matrix();
                let first = setting.frames[frame as usize].rotation * spin;
                let place = (row as usize, column as usize);
                (first[place], (first * spin)[place])
            }
            Input::Velocity { frame, component } => (self.is(Self::Twist(frame as usize, component as usize)), 0.0),
            Input::AngularVelocity { frame, component } => {
                (self.is(Self::Twist(frame as usize, 3 + component as usize)), 0.0)
            }
            Input::State(k) => (self.is(Self::State(k as usize)), 0.0),
            Input::Signal(k) => (self.is(Self::Signal(k as usize)), 0.0),
            Input::ReactionForce { joint, component } => {
                (self.is(Self::Reaction(joint as usize, component as usize)), 0.0)
            }
            Input::ReactionTorque { joint, component } => {
                (self.is(Self::Reaction(joint as usize, 3 + component as usize)), 0.0)
            }
            Input::AngleReference(_) | Input::Discrete(_) | Input::Coordinate(_) => (0.0, 0.0),
            // It counts as a state.
            Input::Unknown(k) => (self.is(Self::State(setting.states.len() - 1 - k as usize)), 0.0),
        };
        Jet::new(value, first, second)
    }

    /// 1 for the variation itself, 0 for others.
    fn is(self, other: Self) -> f64 {
        f64::from(u8::from(self == other))
    }

    /// Velocity of a frame's origin.
    fn shift(self, setting: &Setting, frame: usize) -> Vec3<f64> {
        match self {
            Self::Motion => setting.twists[frame].velocity,
            Self::Frame(k, direction) if k == frame && direction < 3 => Vec3::ith(direction, 1.0),
            _ => Vec3::zeros(),
        }
    }

    /// Angular velocity of a frame about its own axes.
    fn spin(self, setting: &Setting, frame: usize) -> Vec3<f64> {
        match self {
            Self::Motion => setting.frames[frame].rotation.tr_mul(&setting.twists[frame].angular_velocity),
            Self::Frame(k, direction) if k == frame && direction >= 3 => Vec3::ith(direction - 3, 1.0),
            _ => Vec3::zeros(),
        }
    }
}

impl Setting {
    /// A number the host provides. `coordinates` are those of a joint's mobility; missing ones are zero.
    ///
    /// # Panics
    /// When the setting has no such number.
    #[must_use]
    pub fn read(&self, input: Input, coordinates: &[f64]) -> f64 {
        match input {
            Input::Time => self.time,
            Input::Position { frame, component } => self.frames[frame as usize].position[component as usize],
            Input::Rotation { frame, row, column } => {
                self.frames[frame as usize].rotation[(row as usize, column as usize)]
            }
            Input::Velocity { frame, component } => self.twists[frame as usize].velocity[component as usize],
            Input::AngularVelocity { frame, component } => {
                self.twists[frame as usize].angular_velocity[component as usize]
            }
            Input::AngleReference(k) => self.references[k as usize],
            Input::State(k) => self.states[k as usize],
            // Behind the states, the last one first.
            Input::Unknown(k) => self.states[self.states.len() - 1 - k as usize],
            Input::Discrete(k) => self.memory[k as usize],
            Input::Signal(k) => self.signals[k as usize],
            Input::ReactionForce { joint, component } => self.reactions[joint as usize].force[component as usize],
            Input::ReactionTorque { joint, component } => self.reactions[joint as usize].torque[component as usize],
            Input::Coordinate(k) => coordinates.get(k as usize).copied().unwrap_or(0.0),
        }
    }

    /// The setting after steps along several free directions: six numbers per frame, as in [`Setting::displaced`].
    #[must_use]
    pub fn moved(&self, steps: &[f64]) -> Self {
        let mut other = self.clone();
        for (frame, step) in other.frames.iter_mut().zip(steps.chunks_exact(6)) {
            frame.position += Vec3::from_column_slice(&step[..3]);
            frame.rotation *= turn(Vec3::from_column_slice(&step[3..]));
        }
        other
    }
}
