//! [`Modes`]: how a scene vibrates, decays or grows near a state.

use nalgebra::{Complex, DMatrix, DVector};
use serde::Serialize;

use crate::diagnostics::{Diagnostic, codes};
use crate::eigen::{ComplexVector, spectrum};
use crate::energies::{Moved, energies};
use crate::linalg::SingularValues;
use crate::linear::{Linear, SLOW, refuse};
use crate::session::{Session, SessionError};

/// Residuals above this are reported.
const RESIDUAL: f64 = 1e-10;
/// On what round-off does to an eigenvalue to first order: a pair that it makes of a double one is off by twice that.
const MARGIN: f64 = 2.0;
/// Share of an eigenvalue above which a real part is growth that is not decided rather than the round-off of a mode without damping.
const GROWS: f64 = 1e-4;
/// Shares below this are not reported.
const LEAST_SHARE: f64 = 1e-6;

/// What the eigenvalues say about a state, to first order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Stability {
    /// Some eigenvalue has a real part that is positive beyond round-off.
    Unstable,
    /// All real parts are negative beyond round-off.
    Stable,
    /// Nothing grows and nothing is zero, but some modes do not decay: stable where loads have a potential.
    Undamped,
    /// Some eigenvalues are zero, or so near to it that round-off decides, or grow by no more than round-off may have moved them: to
    /// first order nothing can be said.
    Undecided,
    /// Rows on velocities, as those of friction that sticks, hold what is neutral: places next to this rest as well. All modes decay,
    /// and what leaves the place comes to rest near it.
    Held,
    /// No degree of freedom and no state is left: nothing can move, and nothing be stable or not.
    Immobile,
    /// The linear model changes along the motion that it is of, as that of a pendulum on a shaft that turns does in axes of the ground,
    /// or no later instant could be compared: the eigenvalues of an instant say nothing about what grows.
    Frozen,
}

impl Stability {
    /// In words.
    #[must_use]
    pub fn words(self) -> &'static str {
        match self {
            Self::Unstable => "unstable: at least one mode grows",
            Self::Stable => "stable: all modes decay",
            Self::Undamped => "no mode grows, some do not decay (undamped)",
            Self::Held => "held: it rests here and in places next to this, and all modes decay",
            Self::Immobile => "no degree of freedom: it cannot move, so there is nothing to be stable or unstable",
            Self::Frozen => {
                "frozen: coefficients change along the motion, or are not known to stay the same, and eigenvalues of an instant do not say \
                 what grows"
            }
            Self::Undecided => {
                "not decided: no mode grows beyond round-off, some are zero or may grow (neutral directions, or within round-off)"
            }
        }
    }
}

/// A share of something.
#[derive(Debug, Clone, Serialize)]
pub struct Share {
    /// Body or element.
    pub name: String,
    /// Between zero and one for energies that add up; potential energies may be negative.
    pub share: f64,
}

/// The motion of a body in a mode, ground axes: amplitude and phase as real and imaginary part.
#[derive(Debug, Clone, Serialize)]
pub struct BodyShape {
    /// Its name.
    pub body: String,
    /// Displacement of the centre of mass: real parts.
    pub displacement: [f64; 3],
    /// Imaginary parts.
    pub displacement_imaginary: [f64; 3],
    /// Small turn, rad: real parts.
    pub turn: [f64; 3],
    /// Imaginary parts.
    pub turn_imaginary: [f64; 3],
}

/// A mode.
#[derive(Debug, Clone, Serialize)]
pub struct Mode {
    /// Number, from 1.
    pub number: usize,
    /// Real part of the eigenvalue, 1/s.
    pub real: f64,
    /// Imaginary part, rad/s; zero: no oscillation.
    pub imaginary: f64,
    /// Im / 2 pi, Hz: of the oscillation as it is seen.
    pub frequency: f64,
    /// |lambda| / 2 pi, Hz: without damping, where that is proportional.
    pub natural_frequency: f64,
    /// - Re / |lambda|.
    pub damping_ratio: f64,
    /// - 1 / Re, s, of eigenvalues that are real; negative: it grows.
    pub time_constant: Option<f64>,
    /// |A v - lambda v| / (|A| |v|), balanced.
    pub residual: f64,
    /// By how much round-off of the matrix, of loads in balance and of places may have moved the eigenvalue, 1/s.
    pub uncertainty: f64,
    /// Whether the sign of the real part is beyond that.
    pub decided: bool,
    /// Shares of the kinetic energy by body, and by element that brings some, largest first.
    pub kinetic: Vec<Share>,
    /// Potential energies of force elements as shares of that of all; what is missing to one is in weights and preloads, by way of
    /// the joints, and in forces that follow signals.
    pub potential: Vec<Share>,
    /// Element states that take part, on the largest entry of the vector (SI).
    pub states: Vec<Share>,
    /// How bodies move, largest displacement (turns on the size of the scene) one.
    pub shape: Vec<BodyShape>,
}

/// A direction along which nothing drives back.
#[derive(Debug, Clone, Serialize)]
pub struct Neutral {
    /// Whether rows on velocities, as those of friction that sticks, let nothing move along it: places next to this rest as well.
    /// Otherwise it meets no resistance.
    pub held: bool,
    /// The bodies that take part, by their share of displacements.
    pub bodies: Vec<Share>,
}

impl Neutral {
    /// In words.
    #[must_use]
    pub fn words(&self) -> &'static str {
        if self.held { "held, and at rest in places next to this as well" } else { "free to move" }
    }
}

/// All modes at a state.
#[derive(Debug, Clone, Serialize)]
pub struct Modes {
    /// s.
    pub time: f64,
    /// Size of the scene, m: turns times it are compared with displacements.
    pub length: f64,
    /// Degrees of freedom of positions.
    pub coordinates: usize,
    /// States in all.
    pub states: usize,
    /// Angular velocity of the axes in which states are seen, rad/s, ground axes; zero: those of the ground.
    pub turning: [f64; 3],
    /// What the eigenvalues say.
    pub stability: Stability,
    /// Eigenvalues that are zero.
    pub zeros: usize,
    /// Directions along which nothing drives back: rigid motions, chains of loose parts; what friction holds.
    pub neutral: Vec<Neutral>,
    /// The others, by magnitude; one of each pair.
    pub modes: Vec<Mode>,
    /// What is to be known.
    pub notes: Vec<String>,
}

impl Modes {
    /// Of a linear model.
    ///
    /// # Errors
    /// Eigenvalues that are not found.
    pub fn of(session: &Session, linear: &Linear) -> Result<Self, SessionError> {
        let found = linear.spectrum.clone().or_else(|| spectrum(&linear.a));
        let Some(found) = found else {
            let message =
                "the eigenvalues were not found: the iteration did not converge, or derivatives are not finite";
            return Err(refuse(session, Diagnostic::error(codes::MOTION_NOT_FINITE, message)));
        };
        let vectors = DMatrix::from_fn(linear.a.nrows(), found.pairs.len(), |row, k| found.pairs[k].vector[row]);
        let moved = Moved::of(linear, &vectors);
        let length = session.assembly.scales.length;
        let mut notes = linear.notes.clone();
        let mut modes = Vec::with_capacity(found.pairs.len());
        for (k, pair) in found.pairs.iter().enumerate() {
            let value = pair.value;
            let moved = moved.by(k);
            let energies = energies(linear, &pair.vector, &moved);
            let shape = shape(linear, &moved.displacements, length);
            let size = value.norm();
            let uncertainty = MARGIN * (pair.uncertainty + linear.open(pair, &moved.displacements));
            if pair.residual > RESIDUAL {
                notes.push(format!("mode {}: its vector is inaccurate, residual {:.1e}", k + 1, pair.residual));
            }
            modes.push(Mode {
                number: k + 1,
                real: value.re,
                imaginary: value.im,
                frequency: value.im / std::f64::consts::TAU,
                natural_frequency: size / std::f64::consts::TAU,
                damping_ratio: -value.re / size,
                time_constant: (value.im == 0.0).then(|| -1.0 / value.re),
                residual: pair.residual,
                uncertainty,
                decided: value.re.abs() > uncertainty,
                kinetic: energies.0,
                potential: energies.1,
                states: element_states(linear, &pair.vector),
                shape,
            });
        }
        let open = |mode: &Mode| mode.real.hypot(mode.imaginary) <= mode.uncertainty;
        let may_grow = |mode: &Mode| !mode.decided && mode.real > GROWS * mode.real.hypot(mode.imaginary);
        let (free, held) = neutral(linear, &found.null, length);
        let zeros_are_held = found.zeros == held.ncols();
        let stability = if linear.a.is_empty() {
            Stability::Immobile
        } else if linear.unsteadiness > SLOW {
            Stability::Frozen
        } else if modes.iter().any(|mode| mode.decided && mode.real > 0.0) {
            Stability::Unstable
        } else if !zeros_are_held
            || modes.iter().any(|mode| open(mode) || may_grow(mode) || mode.imaginary == 0.0 && !mode.decided)
        {
            Stability::Undecided
        } else if !modes.iter().all(|mode| mode.decided) {
            Stability::Undamped
        } else if held.ncols() > 0 {
            Stability::Held
        } else {
            Stability::Stable
        };
        let described = |held: bool, moved: &DVector<f64>| {
            let size =
                |body: usize| moved.rows(6 * body, 3).norm_squared() + moved.rows(6 * body + 3, 3).norm_squared();
            let all: f64 = (0..linear.bodies.len()).map(size).sum();
            let bodies = shares((0..linear.bodies.len()).map(|b| (linear.bodies[b].clone(), size(b) / all)));
            Neutral { held, bodies }
        };
        let columns = |held: bool, all: &DMatrix<f64>| -> Vec<Neutral> {
            all.column_iter().map(|moved| described(held, &moved.into_owned())).collect()
        };
        let neutral = [columns(false, &free), columns(true, &held)].concat();
        Ok(Self {
            time: linear.time,
            length,
            coordinates: linear.coordinates,
            states: linear.a.nrows(),
            turning: linear.turning.into(),
            stability,
            zeros: found.zeros,
            neutral,
            modes,
            notes,
        })
    }
}

/// Sine of the angle to what velocities are allowed below which a direction is among them.
const ALLOWED: f64 = 1e-6;
/// Share of the largest singular value of columns that one needs to count.
const SPANS: f64 = 1e-12;

/// Displacements of all bodies without resistance, turns times the size of the scene: those that the rows on velocities allow, and
/// those that they hold.
fn neutral(linear: &Linear, null: &DMatrix<f64>, length: f64) -> (DMatrix<f64>, DMatrix<f64>) {
    let sized = |mut moves: DMatrix<f64>| {
        (0..moves.nrows()).filter(|k| k % 6 >= 3).for_each(|k| moves.row_mut(k).scale_mut(length));
        moves
    };
    let none = || DMatrix::zeros(6 * linear.bodies.len(), 0);
    let moves = sized(&linear.positions * null);
    let rates = linear.velocities.ncols() - linear.element_states - linear.coordinates;
    if rates == linear.coordinates {
        let moving: Vec<usize> = (0..moves.ncols()).filter(|k| moves.column(*k).norm() > 0.0).collect();
        return (moves.select_columns(moving.iter()), none());
    }
    let moves = spanned(&moves);
    if moves.ncols() == 0 {
        return (moves, none());
    }
    let allowed = spanned(&sized(linear.velocities.columns(linear.coordinates, rates).into_owned()));
    let off = &moves - &allowed * (allowed.transpose() * &moves);
    let Some(values) = SingularValues::of(&off) else { return (moves, none()) };
    let held = values.right().columns_range(..values.rank(ALLOWED));
    (&moves * values.null_space(ALLOWED), &moves * held)
}

/// An orthonormal basis of what columns span; those that are no displacement are left out.
fn spanned(columns: &DMatrix<f64>) -> DMatrix<f64> {
    let Some(values) = SingularValues::of(columns) else { return DMatrix::zeros(columns.nrows(), 0) };
    let rank = values.rank(SPANS * values.largest());
    values.left().columns_range(..rank).into_owned()
}

impl Modes {
    /// The first modes, at most so many, and behind them the others that grow: the fastest, as many again, one at least.
    #[must_use]
    pub fn foremost(&self, most: usize) -> Vec<&Mode> {
        let (first, others) = self.modes.split_at(most.min(self.modes.len()));
        let mut growing: Vec<&Mode> = others.iter().filter(|mode| mode.decided && mode.real > 0.0).collect();
        growing.sort_by(|a, b| b.real.total_cmp(&a.real));
        growing.truncate(most.max(1));
        growing.sort_by_key(|mode| mode.number);
        first.iter().chain(growing).collect()
    }

    /// One row per mode.
    #[must_use]
    pub fn csv(&self) -> String {
        let mut text = String::from(
            "mode,real [1/s],imaginary [rad/s],frequency [Hz],natural frequency [Hz],damping ratio,time constant [s],residual,uncertainty [1/s]\n",
        );
        for mode in &self.modes {
            let constant = mode.time_constant.map_or_else(String::new, |value| format!("{value:?}"));
            text.push_str(&format!(
                "{},{:?},{:?},{:?},{:?},{:?},{constant},{:?},{:?}\n",
                mode.number,
                mode.real,
                mode.imaginary,
                mode.frequency,
                mode.natural_frequency,
                mode.damping_ratio,
                mode.residual,
                mode.uncertainty
            ));
        }
        text
    }
}

fn element_states(linear: &Linear, vector: &ComplexVector) -> Vec<Share> {
    let first = linear.velocities.ncols() - linear.element_states;
    shares((first..linear.states.len()).map(|k| (linear.states[k].clone(), vector[k].norm())))
}

/// Those that are worth telling, largest first.
pub(crate) fn shares(list: impl Iterator<Item = (String, f64)>) -> Vec<Share> {
    let mut list: Vec<Share> = list.map(|(name, share)| Share { name, share }).collect();
    list.retain(|one| one.share.abs() > LEAST_SHARE);
    list.sort_by(|a, b| b.share.abs().total_cmp(&a.share.abs()));
    list
}

/// Of displacements.
fn shape(linear: &Linear, x: &ComplexVector, length: f64) -> Vec<BodyShape> {
    let sized = |k: usize| if k % 6 < 3 { x[k] } else { x[k] * length };
    let largest = (0..x.len()).max_by(|a, b| sized(*a).norm().total_cmp(&sized(*b).norm()));
    let Some(largest) = largest.map(sized).filter(|z| z.norm() > 0.0) else { return Vec::new() };
    let scaled = x.map(|z| z / largest * Complex::new(1.0, 0.0));
    (linear.bodies.iter().enumerate())
        .map(|(body, name)| {
            let part = |at: usize, f: fn(Complex<f64>) -> f64| [0, 1, 2].map(|k| f(scaled[6 * body + at + k]));
            BodyShape {
                body: name.clone(),
                displacement: part(0, |z| z.re),
                displacement_imaginary: part(0, |z| z.im),
                turn: part(3, |z| z.re),
                turn_imaginary: part(3, |z| z.im),
            }
        })
        .collect()
}
