//! [`Mechanism`]: links and joints as robots have them, whichever file they come from.

use std::path::PathBuf;

use nalgebra::{Isometry3, Matrix3, Point3, Unit, Vector3};

/// Share of moments of inertia that is round-off of finding the principal ones.
const ROUND_OFF: f64 = 1e-12;

/// A tree of links with what closes loops in it. SI units, angles in rad.
#[derive(Debug, Clone, Default)]
pub(crate) struct Mechanism {
    /// Its name.
    pub(crate) title: String,
    /// Acceleration of gravity, ground axes, m/s^2.
    pub(crate) gravity: Vector3<f64>,
    /// Parents before their children.
    pub(crate) links: Vec<Link>,
    /// Joints between links that are in the tree already.
    pub(crate) closures: Vec<Closure>,
    /// Linear relations of two coordinates.
    pub(crate) couplings: Vec<Coupling>,
    /// What the ground looks like.
    pub(crate) ground: Vec<Shape>,
    /// What a scene does not say, in words.
    pub(crate) left_out: Vec<String>,
}

impl Mechanism {
    /// All joints of all links.
    pub(crate) fn joints(&self) -> impl Iterator<Item = &Joint> {
        self.links.iter().flat_map(|link| link.hold.joints())
    }

    /// The same, to change them.
    pub(crate) fn joints_mut(&mut self) -> impl Iterator<Item = &mut Joint> {
        self.links.iter_mut().flat_map(|link| match &mut link.hold {
            Hold::Joints(joints) => joints.as_mut_slice(),
            Hold::Fixed | Hold::Free => &mut [],
        })
    }

    /// Masses of all links that have one.
    pub(crate) fn solids_mut(&mut self) -> impl Iterator<Item = &mut Solid> {
        self.links.iter_mut().filter_map(|link| link.solid.as_mut())
    }
}

/// A rigid part with what holds it on its parent.
#[derive(Debug, Clone)]
pub(crate) struct Link {
    pub(crate) name: String,
    /// `None` is the ground.
    pub(crate) parent: Option<usize>,
    /// Its frame in that of its parent, where all its joints are at their references.
    pub(crate) pose: Isometry3<f64>,
    pub(crate) hold: Hold,
    /// `None`: no mass was given.
    pub(crate) solid: Option<Solid>,
    pub(crate) shapes: Vec<Shape>,
    /// Written behind the link.
    pub(crate) remark: Option<String>,
}

impl Link {
    /// Whether it has no mass.
    pub(crate) fn is_bare(&self) -> bool {
        self.solid.is_none_or(|solid| solid.mass == 0.0)
    }
}

/// What holds a link on its parent.
#[derive(Debug, Clone)]
pub(crate) enum Hold {
    /// Nothing moves.
    Fixed,
    /// Nothing holds it.
    Free,
    /// It moves by these, the first one next to the parent.
    Joints(Vec<Joint>),
}

impl Hold {
    pub(crate) fn joints(&self) -> &[Joint] {
        match self {
            Hold::Joints(joints) => joints,
            Hold::Fixed | Hold::Free => &[],
        }
    }
}

/// Mass, centre, and inertia about the centre in the axes of the link.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Solid {
    pub(crate) mass: f64,
    pub(crate) com: Vector3<f64>,
    pub(crate) inertia: Matrix3<f64>,
}

impl Solid {
    /// The same part in a frame where its own frame has the given pose.
    pub(crate) fn moved(&self, pose: &Isometry3<f64>) -> Self {
        let turn = pose.rotation.to_rotation_matrix();
        Self {
            mass: self.mass,
            com: (pose * Point3::from(self.com)).coords,
            inertia: turn * self.inertia * turn.transpose(),
        }
    }

    /// Whether it has mass or inertia; files round the mass of small parts to zero and keep their inertia.
    pub(crate) fn is_something(&self) -> bool {
        self.mass > 0.0 || self.inertia != Matrix3::zeros()
    }

    /// The same part with a mass and principal moments of inertia that are not below these.
    pub(crate) fn at_least(mut self, mass: f64, moment: f64) -> Self {
        let principal = self.inertia.symmetric_eigen();
        if principal.eigenvalues.min() < moment {
            let moments = Matrix3::from_diagonal(&principal.eigenvalues.map(|m| m.max(moment)));
            self.inertia = principal.eigenvectors * moments * principal.eigenvectors.transpose();
        }
        Self { mass: self.mass.max(mass), ..self }
    }

    /// The same part with the mean of its principal moments of inertia for each, where one is larger than the sum of the others.
    pub(crate) fn balanced(self) -> Self {
        let moments = self.inertia.symmetric_eigenvalues();
        if moments.sum() - 2.0 * moments.max() >= -ROUND_OFF * moments.amax() {
            return self;
        }
        Self { inertia: Matrix3::identity() * moments.mean(), ..self }
    }

    /// Both as one part (Steiner).
    pub(crate) fn and(&self, other: &Self) -> Self {
        let mass = self.mass + other.mass;
        if mass == 0.0 {
            return *self;
        }
        let com = (self.com * self.mass + other.com * other.mass) / mass;
        let inertia = [self, other].iter().map(|part| part.inertia + point_inertia(part.mass, &(part.com - com))).sum();
        Self { mass, com, inertia }
    }
}

/// Inertia of a point mass at `arm` about the origin.
pub(crate) fn point_inertia(mass: f64, arm: &Vector3<f64>) -> Matrix3<f64> {
    (Matrix3::identity() * arm.norm_squared() - arm * arm.transpose()) * mass
}

/// Which motion a joint leaves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Rotation about the axis.
    Hinge,
    /// Translation along the axis.
    Slide,
    /// Rotation about the place.
    Ball,
}

/// A joint of a link with the link's parent.
#[derive(Debug, Clone)]
pub(crate) struct Joint {
    pub(crate) name: String,
    /// Whether the file has one joint of another name for several.
    pub(crate) is_part: bool,
    pub(crate) kind: Kind,
    /// In the frame of the link.
    pub(crate) place: Point3<f64>,
    /// In the frame of the link; of no meaning for a ball.
    pub(crate) axis: Unit<Vector3<f64>>,
    /// Coordinate in which the link has its `pose`.
    pub(crate) reference: f64,
    /// Coordinate and its rate at the start.
    pub(crate) value: f64,
    pub(crate) speed: f64,
    /// Per rate of the coordinate.
    pub(crate) damping: f64,
    /// Largest dry friction.
    pub(crate) friction: f64,
    pub(crate) stiffness: f64,
    /// Coordinate in which the spring is relaxed.
    pub(crate) relaxed: f64,
    /// Inertia that is added to that of the coordinate: a geared rotor.
    pub(crate) armature: f64,
    pub(crate) range: Option<(f64, f64)>,
}

impl Joint {
    /// Whether one number says where it is.
    pub(crate) fn has_coordinate(&self) -> bool {
        self.kind != Kind::Ball
    }

    pub(crate) fn new(name: impl Into<String>, kind: Kind, axis: Unit<Vector3<f64>>) -> Self {
        Self {
            name: name.into(),
            is_part: false,
            kind,
            place: Point3::origin(),
            axis,
            reference: 0.0,
            value: 0.0,
            speed: 0.0,
            damping: 0.0,
            friction: 0.0,
            stiffness: 0.0,
            relaxed: 0.0,
            armature: 0.0,
            range: None,
        }
    }
}

/// A joint that closes a loop, at the references of all joints.
#[derive(Debug, Clone)]
pub(crate) struct Closure {
    pub(crate) name: String,
    /// `None` is the ground.
    pub(crate) links: [Option<usize>; 2],
    /// One frame on each link; where a point is held, their origins are that point.
    pub(crate) frames: [Isometry3<f64>; 2],
    /// Whether orientations are held as well.
    pub(crate) rigid: bool,
    pub(crate) active: bool,
}

/// second = ratio first + offset, for two joints by their names.
#[derive(Debug, Clone)]
pub(crate) struct Coupling {
    pub(crate) name: String,
    pub(crate) first: String,
    pub(crate) second: String,
    pub(crate) ratio: f64,
    pub(crate) offset: f64,
    pub(crate) active: bool,
}

/// What a link looks like, in its frame.
#[derive(Debug, Clone)]
pub(crate) struct Shape {
    pub(crate) form: Form,
    pub(crate) pose: Isometry3<f64>,
    /// Such as `#c0392b`.
    pub(crate) color: Option<String>,
}

/// A shape about the origin; a cylinder or capsule along z.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Form {
    /// Edges.
    Box(Vector3<f64>),
    Sphere(f64),
    /// Half axes. A scene has no such shape; it has mass all the same.
    Ellipsoid(Vector3<f64>),
    /// Radius, length.
    Cylinder(f64, f64),
    /// Radius, length without the caps.
    Capsule(f64, f64),
    /// A file, and what takes its numbers to lengths: factors along each axis, or along axes that are turned against those of the file.
    Mesh {
        path: PathBuf,
        scale: Matrix3<f64>,
    },
}
