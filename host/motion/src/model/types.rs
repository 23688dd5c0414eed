//! The resolved scene: indices instead of names, SI units, checked parameters.

use std::sync::Arc;

use element_api::recording::Role;
use element_api::set::ElementSet;
use element_api::{Descriptor, Kind, Recording};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

use super::parameters::dimension_of;
use super::release::Release;
use crate::catalog::LibraryInfo;
use crate::scene::Dimension;

/// Everything the mathematics needs to know about a scene, and the elements themselves.
pub struct Model {
    /// Bodies that can move.
    pub bodies: Vec<Body>,
    /// Joints, force elements and control elements that are switched on.
    pub elements: Vec<Instance>,
    /// The element sets instances live in, one per class used.
    pub sets: Vec<Box<dyn ElementSet>>,
    /// The FMUs among the elements, which no catalog lists.
    pub fmus: Vec<LibraryInfo>,
    /// Gravity, m/s^2, ground frame.
    pub gravity: Vector3<f64>,
    /// Signals that are given from outside, which stay as they are from one change to the next.
    pub inputs: Vec<Signal>,
    /// Requested output channels.
    pub channels: Vec<Channel>,
}

/// A signal that is given from outside.
#[derive(Debug, Clone)]
pub struct Signal {
    /// Name in the scene.
    pub name: String,
    /// Its value at the start, SI.
    pub value: f64,
    /// Its dimension.
    pub dimension: Dimension,
    /// The unit that its values are given in, as text.
    pub unit: String,
    /// One of these in SI.
    pub factor: f64,
}

/// A rigid body. The mathematics works in its centroidal frame: origin at the centre of mass, axes of the body frame.
#[derive(Debug, Clone)]
pub struct Body {
    /// Name in the scene.
    pub name: String,
    /// Mass, kg, with what elements lend.
    pub mass: f64,
    /// Inertia about the centre of mass, body axes, kg m^2, with what elements lend.
    pub inertia: Matrix3<f64>,
    /// What elements that bring mass of their own lend to the body.
    pub lent: Option<Lent>,
    /// Centre of mass in the body frame, m.
    pub center_of_mass: Vector3<f64>,
    /// Position of the centre of mass at the start as given, m, ground frame.
    pub position: Vector3<f64>,
    /// Euler parameters body -> ground at the start as given, scalar first, normalised.
    pub orientation: [f64; 4],
    /// Velocity of the body frame's origin at the start, m/s, ground frame; `None`: free.
    pub velocity: [Option<f64>; 3],
    /// Angular velocity at the start, rad/s, ground frame; `None`: free.
    pub angular_velocity: [Option<f64>; 3],
    /// A point mass: its inertia has no meaning, and no torque may act on it.
    pub particle: bool,
    /// Axes about which it has no moment of inertia, as a thin rod along its length, and about which no torque may act.
    pub thin: Vec<Thin>,
}

/// A principal axis about which a body has no moment of inertia worth mentioning.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Thin {
    /// The axis, body axes, length 1.
    pub axis: Vector3<f64>,
    /// The moment that it is given all the same, kg m^2.
    pub moment: f64,
    /// Share of the kinetic energy that it may hold, so that this changes no result.
    pub share: f64,
}

/// Mass that the equations of motion count to a body on both sides: among what is solved for, and taken off again as a load in proportion to
/// accelerations. So a light body that carries the mass of an element is solved for as a heavy one, without loss of digits.
#[derive(Debug, Clone, PartialEq)]
pub struct Lent {
    /// kg.
    pub mass: f64,
    /// About the centre of mass, body axes, kg m^2.
    pub inertia: Matrix3<f64>,
    /// The body's own mass, kg.
    pub own_mass: f64,
    /// The same for its inertia.
    pub own_inertia: Matrix3<f64>,
}

impl Body {
    /// Its centre of mass and rotation to the ground as given.
    #[must_use]
    pub fn given(&self) -> (Vector3<f64>, Matrix3<f64>) {
        (self.position, rotation(&self.orientation))
    }

    /// Its mass without what is lent, kg.
    #[must_use]
    pub fn own_mass(&self) -> f64 {
        self.lent.as_ref().map_or(self.mass, |lent| lent.own_mass)
    }

    /// Its inertia without what is lent, kg m^2.
    #[must_use]
    pub fn own_inertia(&self) -> Matrix3<f64> {
        self.lent.as_ref().map_or(self.inertia, |lent| lent.own_inertia)
    }

    /// The root of the trace of its own inertia over its own mass, m: a size of it, whatever elements lend it. Zero of a particle, whose
    /// inertia has no meaning, and without mass of its own.
    #[must_use]
    pub fn gyration(&self) -> f64 {
        let squared = self.own_inertia().trace() / self.own_mass();
        if self.particle || !squared.is_finite() { 0.0 } else { squared.sqrt() }
    }

    /// Gives an axis without moment of inertia, about which nothing holds the body and about which it does not turn, as much
    /// as the others: it keeps on not turning, without round-off being taken for motion.
    pub fn calm(&mut self, number: usize) {
        let moment = self.inertia.trace() / 2.0;
        let thin = &mut self.thin[number];
        self.inertia += thin.axis * thin.axis.transpose() * (moment - thin.moment);
        (thin.moment, thin.share) = (moment, 1e-18);
    }
}

/// A marker: where an element is attached.
#[derive(Debug, Clone, PartialEq)]
pub struct Marker {
    /// Index of the body; `None`: ground.
    pub body: Option<usize>,
    /// Origin in the body's centroidal frame (or the ground frame), m.
    pub position: Vector3<f64>,
    /// Rotation marker -> body (or ground).
    pub rotation: Matrix3<f64>,
}

/// A joint, force element or control element of the scene.
#[derive(Debug, Clone)]
pub struct Instance {
    /// Name in the scene.
    pub name: String,
    /// Its class.
    pub class: Arc<Descriptor>,
    /// Library that provides the class.
    pub library: String,
    /// Which of [`Model::sets`].
    pub set: usize,
    /// Which instance of the set.
    pub index: u32,
    /// Where it is attached, one marker per frame of the class.
    pub markers: Vec<Marker>,
    /// Its equations, checked; instances that are alike have them in common.
    pub recording: Arc<Recording>,
    /// Constraint rows in use, by their number in the class.
    pub rows: Vec<usize>,
    /// What is connected to each signal that the class takes.
    pub inputs: Vec<Source>,
    /// The joints whose reactions it takes, as indices of elements.
    pub joints: Vec<usize>,
    /// When it lets go of its bodies, for good; of a joint or a force that may.
    pub release: Option<Release>,
    /// How it looks up the grids that the scene gave it; of joints, curves that end with a kink.
    pub grids: Vec<GridUse>,
}

/// An argument with which an element looks up a grid.
#[derive(Debug, Clone, PartialEq)]
pub struct GridUse {
    /// Name of the parameter.
    pub parameter: String,
    /// `x` or `y`; of a curve, its variable.
    pub axis: String,
    /// SI unit of the argument; may be empty.
    pub unit: String,
    /// The operation of the recording that computes it.
    pub argument: u32,
    /// First and last value of the grid; infinite where a curve ends level.
    pub bounds: [f64; 2],
}

impl Instance {
    /// Whether it has continuous states.
    #[must_use]
    pub fn has_states(&self) -> bool {
        !self.recording.initial_states.is_empty()
    }

    /// Whether it brings kinetic energy of its own.
    #[must_use]
    pub fn brings_kinetic(&self) -> bool {
        self.recording.output(element_api::recording::Role::Kinetic).is_some()
    }

    /// Whether it gives anything but rows, coordinates, loads and energies: channels, or what it keeps.
    #[must_use]
    pub fn gives_more_than_rows(&self) -> bool {
        self.has_states() || !self.recording.initial_discrete.is_empty() || !self.class.reported().is_empty()
    }

    /// Whether what its rows hold up to is made of signals: these are written down behind the joints.
    #[must_use]
    pub fn limits_follow(&self) -> bool {
        !self.inputs.is_empty() && self.rows.iter().any(|row| !self.signals_of(Role::Limit(*row as u32)).is_empty())
    }

    /// Whether anything that it gives depends on how often angles have turned; only the angles that it takes are written down.
    #[must_use]
    pub fn counts_turns(&self) -> bool {
        let mut outputs = self.recording.outputs.iter();
        self.class.angles > 0 && (self.class.opaque || outputs.any(|output| matches!(output.role, Role::Angle(_))))
    }

    /// Whether it is a force that may let go.
    #[must_use]
    pub fn may_end(&self) -> bool {
        self.class.kind == Kind::Force && self.release.is_some()
    }

    /// Whether a value that it reports is a load, a power or an energy: nothing of a force that has let go.
    #[must_use]
    pub fn is_of_load(&self, value: usize) -> bool {
        let unit = &self.class.reported()[value].unit;
        let of_load = [Dimension::FORCE, Dimension::TORQUE, Dimension::POWER];
        dimension_of(unit).is_ok_and(|dimension| of_load.contains(&dimension))
    }

    /// Whether it is a joint with states or memory: where its rows hold is then no matter of positions and time alone.
    #[must_use]
    pub fn is_joint_with_values(&self) -> bool {
        self.is_joint_with_states() || self.class.kind == Kind::Joint && !self.recording.initial_discrete.is_empty()
    }

    /// Whether it is a joint with states, which may move its rows.
    #[must_use]
    pub fn is_joint_with_states(&self) -> bool {
        self.class.kind == Kind::Joint && self.has_states()
    }
}

/// What is connected to a signal input.
#[derive(Debug, Clone, PartialEq)]
pub enum Source {
    /// A constant, SI.
    Constant(f64),
    /// Anything that can be reported, times a factor, SI.
    Quantity(Quantity, f64),
}

impl Source {
    /// What is reported; nothing of a constant.
    #[must_use]
    pub fn quantity(&self) -> Option<&Quantity> {
        match self {
            Self::Constant(_) => None,
            Self::Quantity(quantity, _) => Some(quantity),
        }
    }
}

impl Instance {
    /// What it takes as signals, and what decides on its release.
    pub fn signals(&self) -> impl Iterator<Item = &Quantity> {
        let decides = self.release.iter().filter_map(|release| release.quantity.as_ref());
        self.inputs.iter().filter_map(Source::quantity).chain(decides)
    }

    /// Name of row `k` of those in use, for reports: `bearing: about x`.
    #[must_use]
    pub fn row_name(&self, k: usize) -> String {
        format!("{}: {}", self.name, self.row(k))
    }

    /// Name of row `k` of those in use, as its class has it: `about x`.
    #[must_use]
    pub fn row(&self, k: usize) -> &str {
        self.rows.get(k).and_then(|row| self.class.rows.get(*row)).map_or("?", String::as_str)
    }

    /// Number of values an instance that is called gives before derivatives: rows in use and coordinates, or channels. Rows on
    /// velocities are never called.
    #[must_use]
    pub fn value_count(&self) -> usize {
        let of_velocities = self.recording.outputs.iter().filter(|o| matches!(o.role, Role::VelocityResidual(_)));
        self.rows.len() - of_velocities.count() + self.class.channels.len()
    }
}

/// A requested output.
#[derive(Debug, Clone)]
pub struct Channel {
    /// Column name.
    pub name: String,
    /// What is asked.
    pub quantity: Quantity,
    /// Its dimension.
    pub dimension: Dimension,
    /// Unit of the column, as text.
    pub unit: String,
    /// One scene unit in SI.
    pub factor: f64,
    /// Where it is taken, in words, for the metadata: body, point, frame.
    pub place: String,
}

/// In which axes a vector is given.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axes {
    /// Ground axes.
    Ground,
    /// Axes of a body.
    Body(usize),
}

/// Position, velocity or acceleration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// The quantity itself.
    Position,
    /// Its first derivative with respect to time.
    Velocity,
    /// Its second derivative with respect to time.
    Acceleration,
}

/// The component that is the length of a load.
pub const MAGNITUDE: usize = 3;

/// What an output column contains.
#[derive(Debug, Clone, PartialEq)]
pub enum Quantity {
    /// Component of the position, velocity or acceleration of a body-fixed point.
    Point {
        /// Which body.
        body: usize,
        /// The point in the centroidal frame, m.
        point: Vector3<f64>,
        /// Position, velocity or acceleration.
        level: Level,
        /// Directions of the components.
        axes: Axes,
        /// 0, 1, 2.
        component: usize,
    },
    /// Euler parameter of a body.
    EulerParameter {
        /// Which body.
        body: usize,
        /// 0 (scalar) to 3.
        component: usize,
    },
    /// Component of the angular velocity or acceleration of a body.
    Angular {
        /// Which body.
        body: usize,
        /// Velocity or acceleration.
        level: Level,
        /// Directions of the components.
        axes: Axes,
        /// 0, 1, 2.
        component: usize,
    },
    /// A joint coordinate, its rate or its acceleration.
    Coordinate {
        /// Which element.
        element: usize,
        /// Which coordinate of the class.
        coordinate: usize,
        /// Value, rate or acceleration.
        level: Level,
    },
    /// Force or torque of a joint or force element on the body of one of its frames, at that frame's origin.
    Load {
        /// Which element.
        element: usize,
        /// Which frame.
        frame: usize,
        /// Torque instead of force.
        torque: bool,
        /// Directions of the components.
        axes: Axes,
        /// 0, 1, 2; [`MAGNITUDE`].
        component: usize,
    },
    /// A value reported by a force element, or a signal of a control element.
    Value {
        /// Which element.
        element: usize,
        /// Which channel of the class.
        channel: usize,
    },
    /// A signal that is given from outside.
    Given {
        /// Which of [`Model::inputs`].
        input: usize,
    },
    /// What is left of the equations of motion of a body when all reported loads and its weight are set against its
    /// acceleration (Newton, Euler): zero but for round-off. Ground axes; torques about the centre of mass.
    Balance {
        /// Which body.
        body: usize,
        /// Torque instead of force.
        torque: bool,
        /// 0, 1, 2.
        component: usize,
    },
    /// Kinetic energy of all bodies.
    KineticEnergy,
    /// Potential energy of gravity and of all elements that have one.
    PotentialEnergy,
    /// Kinetic and potential energy.
    TotalEnergy,
}

impl Quantity {
    /// Whether it is the sum of what each of several copies of a body gives, with shares of its mass, or what each of them gives.
    #[must_use]
    pub fn adds_up(&self) -> bool {
        let energy = matches!(self, Self::KineticEnergy | Self::PotentialEnergy | Self::TotalEnergy);
        energy || matches!(self, Self::Load { .. } | Self::Balance { .. })
    }
}

/// The matrix of `v x`.
#[must_use]
pub fn skew(v: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::new(0.0, -v.z, v.y, v.z, 0.0, -v.x, -v.y, v.x, 0.0)
}

/// Euler parameters of a rotation matrix, scalar first; the twin of [`rotation`].
#[must_use]
pub fn euler_parameters(rotation: &Matrix3<f64>) -> [f64; 4] {
    let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(*rotation)).into_inner();
    [turn.w, turn.i, turn.j, turn.k]
}

/// Rotation matrix of Euler parameters of any length but zero (Haug 1989, eq. 9.3.7, divided by the squared length).
#[must_use]
pub fn rotation(p: &[f64; 4]) -> Matrix3<f64> {
    let [e0, e1, e2, e3] = *p;
    let n = e0 * e0 + e1 * e1 + e2 * e2 + e3 * e3;
    Matrix3::new(
        e0 * e0 + e1 * e1 - e2 * e2 - e3 * e3,
        2.0 * (e1 * e2 - e0 * e3),
        2.0 * (e1 * e3 + e0 * e2),
        2.0 * (e1 * e2 + e0 * e3),
        e0 * e0 - e1 * e1 + e2 * e2 - e3 * e3,
        2.0 * (e2 * e3 - e0 * e1),
        2.0 * (e1 * e3 - e0 * e2),
        2.0 * (e2 * e3 + e0 * e1),
        e0 * e0 - e1 * e1 - e2 * e2 + e3 * e3,
    ) / n
}
