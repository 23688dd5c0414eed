//! Dimensions: which quantities may be compared, added or given for each other.

use std::fmt;

/// Exponents of length, mass, time and angle.
///
/// The angle is a dimension of its own so that degrees convert and `rpm` is not mistaken for `1/s`; being
/// a ratio of lengths it may nevertheless be left out, see [`Dimension::compatible`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Dimension {
    /// Exponent of the length.
    pub length: i8,
    /// Exponent of the mass.
    pub mass: i8,
    /// Exponent of the time.
    pub time: i8,
    /// Exponent of the angle.
    pub angle: i8,
}

impl Dimension {
    /// A plain number.
    pub const DIMENSIONLESS: Self = Self::new(0, 0, 0, 0);
    /// Length, m.
    pub const LENGTH: Self = Self::new(1, 0, 0, 0);
    /// Mass, kg.
    pub const MASS: Self = Self::new(0, 1, 0, 0);
    /// Time, s.
    pub const TIME: Self = Self::new(0, 0, 1, 0);
    /// Angle, rad.
    pub const ANGLE: Self = Self::new(0, 0, 0, 1);
    /// Area, m^2.
    pub const AREA: Self = Self::new(2, 0, 0, 0);
    /// Volume, m^3.
    pub const VOLUME: Self = Self::new(3, 0, 0, 0);
    /// Velocity, m/s.
    pub const VELOCITY: Self = Self::new(1, 0, -1, 0);
    /// Acceleration, m/s^2.
    pub const ACCELERATION: Self = Self::new(1, 0, -2, 0);
    /// Angular velocity, rad/s.
    pub const ANGULAR_VELOCITY: Self = Self::new(0, 0, -1, 1);
    /// Angular acceleration, rad/s^2.
    pub const ANGULAR_ACCELERATION: Self = Self::new(0, 0, -2, 1);
    /// Frequency, 1/s.
    pub const FREQUENCY: Self = Self::new(0, 0, -1, 0);
    /// Moment of inertia, kg m^2.
    pub const INERTIA: Self = Self::new(2, 1, 0, 0);
    /// Momentum, kg m/s.
    pub const MOMENTUM: Self = Self::new(1, 1, -1, 0);
    /// Angular momentum, kg m^2/s.
    pub const ANGULAR_MOMENTUM: Self = Self::new(2, 1, -1, 0);
    /// Force, N.
    pub const FORCE: Self = Self::new(1, 1, -2, 0);
    /// Torque, N m; the same dimension as [`Dimension::ENERGY`].
    pub const TORQUE: Self = Self::new(2, 1, -2, 0);
    /// Energy, J; the same dimension as [`Dimension::TORQUE`].
    pub const ENERGY: Self = Self::new(2, 1, -2, 0);
    /// Power, W.
    pub const POWER: Self = Self::new(2, 1, -3, 0);
    /// Pressure and stress, Pa.
    pub const PRESSURE: Self = Self::new(-1, 1, -2, 0);
    /// Density, kg/m^3.
    pub const DENSITY: Self = Self::new(-3, 1, 0, 0);
    /// Stiffness of a spring, N/m.
    pub const STIFFNESS: Self = Self::new(0, 1, -2, 0);
    /// Damping of a spring, N s/m.
    pub const DAMPING: Self = Self::new(0, 1, -1, 0);
    /// Stiffness of a rotational spring, N m/rad.
    pub const ROTATIONAL_STIFFNESS: Self = Self::new(2, 1, -2, -1);
    /// Damping of a rotational spring, N m s/rad.
    pub const ROTATIONAL_DAMPING: Self = Self::new(2, 1, -1, -1);

    /// Exponents of length, mass, time and angle.
    pub const fn new(length: i8, mass: i8, time: i8, angle: i8) -> Self {
        Dimension { length, mass, time, angle }
    }

    /// True if nothing but perhaps an angle is left.
    pub fn is_number(self) -> bool {
        (self.length, self.mass, self.time) == (0, 0, 0)
    }

    /// True if a quantity of one dimension may be given for the other.
    ///
    /// Exponents of length, mass and time must agree; those of the angle too, unless one side has no
    /// angle at all: `N m s` is accepted for `N m s/rad`, `1/s` for `rad/s`, and a number for an angle.
    pub fn compatible(self, other: Self) -> bool {
        (self.length, self.mass, self.time) == (other.length, other.mass, other.time)
            && (self.angle == other.angle || self.angle == 0 || other.angle == 0)
    }

    /// Dimension of a product; `None` if an exponent leaves the range of `i8`.
    pub fn times(self, other: Self) -> Option<Self> {
        Some(Dimension {
            length: self.length.checked_add(other.length)?,
            mass: self.mass.checked_add(other.mass)?,
            time: self.time.checked_add(other.time)?,
            angle: self.angle.checked_add(other.angle)?,
        })
    }

    /// Dimension of a quotient; `None` if an exponent leaves the range of `i8`.
    pub fn over(self, other: Self) -> Option<Self> {
        Some(Dimension {
            length: self.length.checked_sub(other.length)?,
            mass: self.mass.checked_sub(other.mass)?,
            time: self.time.checked_sub(other.time)?,
            angle: self.angle.checked_sub(other.angle)?,
        })
    }

    /// Dimension of a power; `None` if an exponent would not be a whole number in the range of `i8`.
    pub fn power(self, exponent: f64) -> Option<Self> {
        let scaled = |own: i8| -> Option<i8> {
            let product = f64::from(own) * exponent;
            let whole = product.round();
            let fits = (product - whole).abs() < 1e-9 && whole.abs() <= f64::from(i8::MAX);
            fits.then_some(whole as i8)
        };
        Some(Dimension {
            length: scaled(self.length)?,
            mass: scaled(self.mass)?,
            time: scaled(self.time)?,
            angle: scaled(self.angle)?,
        })
    }

    /// The four exponents in the order length, mass, time, angle.
    pub fn exponents(self) -> [i8; 4] {
        [self.length, self.mass, self.time, self.angle]
    }

    /// Its name without an article: `length`, `moment of inertia`.
    pub(super) fn noun(self) -> String {
        let name = self.to_string();
        name.split_once(' ').map_or(name.as_str(), |(_article, noun)| noun).to_owned()
    }

    /// The coherent SI unit, for example `kg m^2`, `N/m`, `rad/s`; `1` for a plain number.
    pub fn si_unit(self) -> String {
        super::UnitSystem::default().label(self)
    }
}

/// How a message names the dimension: `a length`, `a torque or energy`, or `a quantity in kg m/s^4`.
impl fmt::Display for Dimension {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = match *self {
            Self::DIMENSIONLESS => "a plain number",
            Self::LENGTH => "a length",
            Self::MASS => "a mass",
            Self::TIME => "a time",
            Self::ANGLE => "an angle",
            Self::AREA => "an area",
            Self::VOLUME => "a volume",
            Self::VELOCITY => "a velocity",
            Self::ACCELERATION => "an acceleration",
            Self::ANGULAR_VELOCITY => "an angular velocity",
            Self::ANGULAR_ACCELERATION => "an angular acceleration",
            Self::FREQUENCY => "a frequency",
            Self::INERTIA => "a moment of inertia",
            Self::FORCE => "a force",
            Self::TORQUE => "a torque or energy",
            Self::POWER => "a power",
            Self::PRESSURE => "a pressure",
            Self::DENSITY => "a density",
            Self::STIFFNESS => "a stiffness",
            Self::DAMPING => "a damping coefficient",
            Self::ROTATIONAL_STIFFNESS => "a rotational stiffness",
            Self::ROTATIONAL_DAMPING => "a rotational damping coefficient",
            other => return write!(f, "a quantity in {}", other.si_unit()),
        };
        f.write_str(name)
    }
}
