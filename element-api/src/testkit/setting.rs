//! [`Setting`]: everything an element may depend on at one instant, and ways to make and move one.

use nalgebra::Rotation3;

use crate::element::Reaction;
use crate::geometry::{Frame, Mat3, Twist, Vec3};

/// Where the frames of an element are, how they move, and what the host keeps for it.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    /// Time, s.
    pub time: f64,
    /// Reference of each multi-turn angle, rad.
    pub references: Vec<f64>,
    /// Continuous states.
    pub states: Vec<f64>,
    /// Discrete states.
    pub memory: Vec<f64>,
    /// Signals taken.
    pub signals: Vec<f64>,
    /// Reactions of the joints that the element depends on.
    pub reactions: Vec<Reaction<f64>>,
    /// Frames in the element's order.
    pub frames: Vec<Frame<f64>>,
    /// Their velocities.
    pub twists: Vec<Twist<f64>>,
}

impl Setting {
    /// Frames that stand still at time 0, nothing else.
    #[must_use]
    pub fn at_rest(frames: Vec<Frame<f64>>) -> Self {
        let still = Twist { velocity: Vec3::zeros(), angular_velocity: Vec3::zeros() };
        let twists = vec![still; frames.len()];
        Self {
            time: 0.0,
            references: Vec::new(),
            states: Vec::new(),
            memory: Vec::new(),
            signals: Vec::new(),
            reactions: Vec::new(),
            frames,
            twists,
        }
    }

    /// The setting after `dt`: each origin keeps its velocity, each frame its angular velocity.
    #[must_use]
    pub fn after(&self, dt: f64) -> Self {
        let mut later = self.clone();
        later.time += dt;
        for (frame, twist) in later.frames.iter_mut().zip(&self.twists) {
            frame.position += twist.velocity * dt;
            frame.rotation = turn(twist.angular_velocity * dt) * frame.rotation;
        }
        later
    }

    /// The setting with one frame displaced along unit direction 0..6: three shifts in ground directions, three rotations
    /// about the frame's own axes.
    #[must_use]
    pub fn displaced(&self, frame: usize, direction: usize, step: f64) -> Self {
        let mut other = self.clone();
        let vector = Vec3::ith(direction % 3, step);
        let frame = &mut other.frames[frame];
        if direction < 3 {
            frame.position += vector;
        } else {
            frame.rotation *= turn(vector);
        }
        other
    }

    /// The same setting after the whole world has been placed on `world`.
    #[must_use]
    pub fn carried_by(&self, world: &Frame<f64>) -> Self {
        let mut other = self.clone();
        for frame in &mut other.frames {
            frame.position = world.position + world.rotation * frame.position;
            frame.rotation = world.rotation * frame.rotation;
        }
        for twist in &mut other.twists {
            twist.velocity = world.rotation * twist.velocity;
            twist.angular_velocity = world.rotation * twist.angular_velocity;
        }
        for reaction in &mut other.reactions {
            reaction.force = world.rotation * reaction.force;
            reaction.torque = world.rotation * reaction.torque;
        }
        other
    }

    /// The same setting with the frames in reverse order.
    #[must_use]
    pub fn exchanged(&self) -> Self {
        let mut other = self.clone();
        other.frames.reverse();
        other.twists.reverse();
        other
    }

    /// The numbers of an opaque instance's part of a batch; see [`crate::set::Layout`].
    #[must_use]
    pub fn inputs(&self) -> Vec<f64> {
        let mut numbers = vec![self.time];
        for list in [&self.references, &self.states, &self.memory, &self.signals] {
            numbers.extend(list);
        }
        for reaction in &self.reactions {
            numbers.extend(&reaction.force);
            numbers.extend(&reaction.torque);
        }
        for (frame, twist) in self.frames.iter().zip(&self.twists) {
            numbers.extend(&frame.position);
            numbers.extend(&frame.rotation.transpose());
            numbers.extend(&twist.velocity);
            numbers.extend(&twist.angular_velocity);
        }
        numbers
    }
}

/// The rotation by the vector's length (rad) about the vector.
#[must_use]
pub fn turn(vector: Vec3<f64>) -> Mat3<f64> {
    Rotation3::new(vector).into_inner()
}

/// `frame` turned by `angle` about its z axis and moved by `distance` along it.
#[must_use]
pub fn on_common_axis(frame: &Frame<f64>, angle: f64, distance: f64) -> Frame<f64> {
    Frame {
        position: frame.position + frame.z() * distance,
        rotation: frame.rotation * turn(Vec3::new(0.0, 0.0, angle)),
    }
}

/// Random numbers that are the same in every run (SplitMix64: Steele, Lea & Flood 2014).
#[derive(Debug, Clone)]
pub struct Random(u64);

impl Random {
    /// A sequence that depends on the seed only.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// Uniform in [low, high).
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^= z >> 31;
        low + (high - low) * (z >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Components uniform in [-size, size).
    pub fn vector(&mut self, size: f64) -> Vec3<f64> {
        Vec3::from_fn(|_, _| self.between(-size, size))
    }

    /// A frame within 1 m of the ground's origin, turned anyhow.
    pub fn frame(&mut self) -> Frame<f64> {
        Frame { position: self.vector(1.0), rotation: turn(self.vector(3.0)) }
    }

    /// Velocities up to 1 m/s and 1 rad/s per component.
    pub fn twist(&mut self) -> Twist<f64> {
        Twist { velocity: self.vector(1.0), angular_velocity: self.vector(1.0) }
    }
}
