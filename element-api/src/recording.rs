//! [`Recording`]: an element's equations as data. This is what crosses the binary interface.
//!
//! A recording is a list of operations in an order in which each uses only earlier ones. Constants are kept apart from
//! the operations and are not folded, so two instances of one element that differ only in numbers record the same list.

mod check;
mod read;

use serde::{Deserialize, Serialize};

use crate::descriptor::Kind;
use crate::scalar::Scalar;
use crate::table::Table;

/// One operation: a code and up to four arguments. What the arguments are depends on the code, see [`Op`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[repr(C)]
pub struct RawOp {
    /// Which operation.
    pub code: u32,
    /// Its arguments; unused ones are zero.
    pub args: [u32; 4],
}

/// An operation with its arguments named. Numbers `a`, `b`, `x`, `y` are indices of earlier operations.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Op {
    /// The constant with this index.
    Constant(u32),
    /// A number the host provides.
    Input(Input),
    /// a + b
    Add(u32, u32),
    /// a - b
    Sub(u32, u32),
    /// a b
    Mul(u32, u32),
    /// a / b
    Div(u32, u32),
    /// -a
    Neg(u32),
    /// Square root.
    Sqrt(u32),
    /// Sine.
    Sin(u32),
    /// Cosine.
    Cos(u32),
    /// Angle of the point (b, a).
    Atan2(u32, u32),
    /// Exponential.
    Exp(u32),
    /// Natural logarithm.
    Ln(u32),
    /// Hyperbolic tangent.
    Tanh(u32),
    /// a to a whole power.
    Powi(u32, i32),
    /// a to a real power, given as the index of a constant.
    Powf(u32, u32),
    /// x where a < b, otherwise y: `Select(a, b, x, y)`.
    Select(u32, u32, u32, u32),
    /// A table, by index, at a.
    Table(u32, u32),
}

impl Op {
    /// The form that crosses the interface.
    #[must_use]
    pub fn encode(self) -> RawOp {
        let raw = |code, args| RawOp { code, args };
        match self {
            Self::Constant(k) => raw(0, [k, 0, 0, 0]),
            Self::Input(input) => {
                let (kind, index) = input.encode();
                raw(1, [kind, index, 0, 0])
            }
            Self::Add(a, b) => raw(2, [a, b, 0, 0]),
            Self::Sub(a, b) => raw(3, [a, b, 0, 0]),
            Self::Mul(a, b) => raw(4, [a, b, 0, 0]),
            Self::Div(a, b) => raw(5, [a, b, 0, 0]),
            Self::Neg(a) => raw(6, [a, 0, 0, 0]),
            Self::Sqrt(a) => raw(7, [a, 0, 0, 0]),
            Self::Sin(a) => raw(8, [a, 0, 0, 0]),
            Self::Cos(a) => raw(9, [a, 0, 0, 0]),
            Self::Atan2(a, b) => raw(10, [a, b, 0, 0]),
            Self::Exp(a) => raw(11, [a, 0, 0, 0]),
            Self::Ln(a) => raw(12, [a, 0, 0, 0]),
            Self::Tanh(a) => raw(13, [a, 0, 0, 0]),
            Self::Powi(a, n) => raw(14, [a, n.cast_unsigned(), 0, 0]),
            Self::Powf(a, k) => raw(15, [a, k, 0, 0]),
            Self::Select(a, b, x, y) => raw(16, [a, b, x, y]),
            Self::Table(table, a) => raw(17, [table, a, 0, 0]),
        }
    }

    /// The operation behind a raw one; `None` for a code this version does not know.
    #[must_use]
    pub fn decode(raw: RawOp) -> Option<Self> {
        let [a, b, x, y] = raw.args;
        Some(match raw.code {
            0 => Self::Constant(a),
            1 => Self::Input(Input::decode(a, b)?),
            2 => Self::Add(a, b),
            3 => Self::Sub(a, b),
            4 => Self::Mul(a, b),
            5 => Self::Div(a, b),
            6 => Self::Neg(a),
            7 => Self::Sqrt(a),
            8 => Self::Sin(a),
            9 => Self::Cos(a),
            10 => Self::Atan2(a, b),
            11 => Self::Exp(a),
            12 => Self::Ln(a),
            13 => Self::Tanh(a),
            14 => Self::Powi(a, b.cast_signed()),
            15 => Self::Powf(a, b),
            16 => Self::Select(a, b, x, y),
            17 => Self::Table(a, b),
            _ => return None,
        })
    }

    /// The earlier operations this one uses.
    pub fn operands(self) -> impl Iterator<Item = u32> {
        let list: [Option<u32>; 4] = match self {
            Self::Constant(_) | Self::Input(_) => [None; 4],
            Self::Add(a, b) | Self::Sub(a, b) | Self::Mul(a, b) | Self::Div(a, b) | Self::Atan2(a, b) => {
                [Some(a), Some(b), None, None]
            }
            Self::Neg(a)
            | Self::Sqrt(a)
            | Self::Sin(a)
            | Self::Cos(a)
            | Self::Exp(a)
            | Self::Ln(a)
            | Self::Tanh(a)
            | Self::Powi(a, _)
            | Self::Powf(a, _)
            | Self::Table(_, a) => [Some(a), None, None, None],
            Self::Select(a, b, x, y) => [Some(a), Some(b), Some(x), Some(y)],
        };
        list.into_iter().flatten()
    }
}

/// What the host provides to an element. Frames are numbered as in the element's descriptor; vectors are in the ground
/// frame, in SI units.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Input {
    /// Time, s.
    Time,
    /// Component 0..3 of the origin of a frame, m.
    Position {
        /// Which frame.
        frame: u32,
        /// Which component.
        component: u32,
    },
    /// Entry (row, column) of the rotation matrix frame -> ground.
    Rotation {
        /// Which frame.
        frame: u32,
        /// Row, a ground direction.
        row: u32,
        /// Column, a frame axis.
        column: u32,
    },
    /// Component of the velocity of a frame's origin, m/s.
    Velocity {
        /// Which frame.
        frame: u32,
        /// Which component.
        component: u32,
    },
    /// Component of a frame's angular velocity, rad/s, ground directions.
    AngularVelocity {
        /// Which frame.
        frame: u32,
        /// Which component.
        component: u32,
    },
    /// Multi-turn reference of an angle, rad; changes only between steps.
    AngleReference(u32),
    /// Continuous state of the element.
    State(u32),
    /// Discrete state of the element; changes only between steps.
    Discrete(u32),
    /// Signal that the element takes.
    Signal(u32),
    /// Joint coordinate, in the recording of a mobility.
    Coordinate(u32),
    /// Component of the reaction force of a joint that the element depends on, N, ground directions.
    ReactionForce {
        /// Which of the element's joints.
        joint: u32,
        /// Which component.
        component: u32,
    },
    /// Component of the reaction torque of a joint that the element depends on, N m, ground directions.
    ReactionTorque {
        /// Which of the element's joints.
        joint: u32,
        /// Which component.
        component: u32,
    },
    /// Internal unknown of the element. Contract 1.2.
    Unknown(u32),
}

impl Input {
    fn encode(self) -> (u32, u32) {
        match self {
            Self::Time => (0, 0),
            Self::Position { frame, component } => (1, 3 * frame + component),
            Self::Rotation { frame, row, column } => (2, 9 * frame + 3 * row + column),
            Self::Velocity { frame, component } => (3, 3 * frame + component),
            Self::AngularVelocity { frame, component } => (4, 3 * frame + component),
            Self::AngleReference(k) => (5, k),
            Self::State(k) => (6, k),
            Self::Discrete(k) => (7, k),
            Self::Signal(k) => (8, k),
            Self::Coordinate(k) => (9, k),
            Self::ReactionForce { joint, component } => (10, 3 * joint + component),
            Self::ReactionTorque { joint, component } => (11, 3 * joint + component),
            Self::Unknown(k) => (12, k),
        }
    }

    fn decode(kind: u32, index: u32) -> Option<Self> {
        let (frame, component) = (index / 3, index % 3);
        Some(match kind {
            0 => Self::Time,
            1 => Self::Position { frame, component },
            2 => Self::Rotation { frame: index / 9, row: index % 9 / 3, column: index % 3 },
            3 => Self::Velocity { frame, component },
            4 => Self::AngularVelocity { frame, component },
            5 => Self::AngleReference(index),
            6 => Self::State(index),
            7 => Self::Discrete(index),
            8 => Self::Signal(index),
            9 => Self::Coordinate(index),
            10 => Self::ReactionForce { joint: frame, component },
            11 => Self::ReactionTorque { joint: frame, component },
            12 => Self::Unknown(index),
            _ => return None,
        })
    }

    /// The frame this input belongs to, if any.
    #[must_use]
    pub fn frame(self) -> Option<u32> {
        match self {
            Self::Position { frame, .. }
            | Self::Rotation { frame, .. }
            | Self::Velocity { frame, .. }
            | Self::AngularVelocity { frame, .. } => Some(frame),
            _ => None,
        }
    }
}

/// What an operation's value means to the host.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Role {
    /// Constraint row: zero when the joint holds.
    Residual(u32),
    /// Component of the force on the body of a frame, at the frame's origin, N, index 3 frame + component.
    Force(u32),
    /// Component of the torque on the body of a frame, N m, index 3 frame + component.
    Torque(u32),
    /// Multi-turn angle, rad; becomes the next reference after an accepted step.
    Angle(u32),
    /// Joint coordinate to report.
    Coordinate(u32),
    /// Rate of a continuous state.
    StateRate(u32),
    /// Value of a discrete state after the step is accepted.
    NextDiscrete(u32),
    /// Signal to other elements (reserved).
    Signal(u32),
    /// Quantity to report.
    Channel(u32),
    /// Potential energy, J.
    Potential,
    /// Dissipated power, W, not negative.
    Dissipation,
    /// Component of the position of frame 1 in frame 0, in the recording of a mobility.
    PosePosition(u32),
    /// Entry 3 row + column of the rotation frame 1 -> frame 0, in the recording of a mobility.
    PoseRotation(u32),
    /// Constraint row on velocities, linear in them: zero when the joint holds. Numbered with the others. Contract 1.2.
    VelocityResidual(u32),
    /// Period of an element that samples, s; a constant. Contract 1.2.
    SamplePeriod,
    /// The row is unilateral, with this coefficient of restitution; a constant. Contract 1.2.
    Unilateral(u32),
    /// The row holds only while the unilateral row of this number is closed; a constant. Contract 1.2.
    SticksWith(u32),
    /// The row holds up to this limit, N or N m, or up to this share of the row that it sticks with. Contract 1.2.
    Limit(u32),
    /// The row and the row of this number have one limit, a circle; a constant. Contract 1.2.
    SlidesWith(u32),
    /// Margin of a check, positive while all is well. Contract 1.2.
    Check(u32),
    /// Condition on the internal unknowns: zero. Contract 1.2.
    Condition(u32),
    /// Starting guess of an internal unknown; a constant. Contract 1.2.
    Guess(u32),
    /// Kinetic energy of mass that the element brings, J. Contract 1.2.
    Kinetic,
    /// Generalised force on a flexible coordinate. Contract 1.2.
    FlexibleForce(u32),
}

impl Role {
    /// The form that crosses the interface.
    #[must_use]
    pub fn encode(self) -> (u32, u32) {
        match self {
            Self::Residual(k) => (0, k),
            Self::Force(k) => (1, k),
            Self::Torque(k) => (2, k),
            Self::Angle(k) => (3, k),
            Self::Coordinate(k) => (4, k),
            Self::StateRate(k) => (5, k),
            Self::NextDiscrete(k) => (6, k),
            Self::Signal(k) => (7, k),
            Self::Channel(k) => (8, k),
            Self::Potential => (9, 0),
            Self::Dissipation => (10, 0),
            Self::PosePosition(k) => (11, k),
            Self::PoseRotation(k) => (12, k),
            Self::VelocityResidual(k) => (13, k),
            Self::SamplePeriod => (14, 0),
            Self::Unilateral(k) => (15, k),
            Self::SticksWith(k) => (16, k),
            Self::Limit(k) => (30, k),
            Self::SlidesWith(k) => (31, k),
            Self::Check(k) => (25, k),
            Self::Condition(k) => (17, k),
            Self::Guess(k) => (18, k),
            Self::Kinetic => (40, 0),
            Self::FlexibleForce(k) => (41, k),
        }
    }

    /// The role behind its two numbers.
    #[must_use]
    pub fn decode(role: u32, k: u32) -> Option<Self> {
        Some(match role {
            0 => Self::Residual(k),
            1 => Self::Force(k),
            2 => Self::Torque(k),
            3 => Self::Angle(k),
            4 => Self::Coordinate(k),
            5 => Self::StateRate(k),
            6 => Self::NextDiscrete(k),
            7 => Self::Signal(k),
            8 => Self::Channel(k),
            9 => Self::Potential,
            10 => Self::Dissipation,
            11 => Self::PosePosition(k),
            12 => Self::PoseRotation(k),
            13 => Self::VelocityResidual(k),
            14 if k == 0 => Self::SamplePeriod,
            15 => Self::Unilateral(k),
            16 => Self::SticksWith(k),
            30 => Self::Limit(k),
            31 => Self::SlidesWith(k),
            25 => Self::Check(k),
            17 => Self::Condition(k),
            18 => Self::Guess(k),
            40 if k == 0 => Self::Kinetic,
            41 => Self::FlexibleForce(k),
            _ => return None,
        })
    }
}

/// A result of a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Output {
    /// What it means.
    pub role: Role,
    /// The operation whose value it is.
    pub node: u32,
}

impl Role {
    /// Whether elements of this kind give it.
    fn is_of(self, kind: Kind) -> bool {
        match self {
            Self::Residual(_)
            | Self::VelocityResidual(_)
            | Self::Unilateral(_)
            | Self::SticksWith(_)
            | Self::Limit(_)
            | Self::SlidesWith(_)
            | Self::Coordinate(_)
            | Self::PosePosition(_)
            | Self::PoseRotation(_) => kind == Kind::Joint,
            Self::Force(_) | Self::Torque(_) | Self::Kinetic | Self::FlexibleForce(_) => kind == Kind::Force,
            Self::Check(_) | Self::Potential | Self::Dissipation => kind != Kind::Joint,
            Self::Angle(_)
            | Self::Signal(_)
            | Self::StateRate(_)
            | Self::NextDiscrete(_)
            | Self::SamplePeriod
            | Self::Channel(_)
            | Self::Condition(_)
            | Self::Guess(_) => true,
        }
    }
}

/// An element instance's equations.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Recording {
    /// Operations; each uses only earlier ones.
    pub ops: Vec<RawOp>,
    /// Numbers that operations refer to.
    pub constants: Vec<f64>,
    /// Tables that operations refer to.
    pub tables: Vec<Table>,
    /// Results.
    pub outputs: Vec<Output>,
    /// Values of the continuous states at the start.
    pub initial_states: Vec<f64>,
    /// Values of the discrete states at the start.
    pub initial_discrete: Vec<f64>,
}

/// What a recording may refer to; from the element's descriptor.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    /// What kind of element.
    pub kind: Kind,
    /// Number of frames.
    pub frames: usize,
    /// Number of constraint rows.
    pub rows: usize,
    /// Number of multi-turn angles.
    pub angles: usize,
    /// Number of joint coordinates.
    pub coordinates: usize,
    /// Number of mobility coordinates.
    pub mobility: usize,
    /// Number of channels.
    pub channels: usize,
    /// Number of signals taken.
    pub inputs: usize,
    /// Number of joints whose reactions are taken.
    pub joints: usize,
    /// Number of checks.
    pub checks: usize,
}

/// Largest number of internal unknowns of one element instance: they are eliminated by determinants.
pub const MOST_UNKNOWNS: usize = 8;
/// Largest number of operations the host accepts from one element instance.
pub const MOST_OPS: usize = 4_000_000;
