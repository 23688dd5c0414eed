//! [`Modes`]: how a scene vibrates, decays or grows near a state.

use nalgebra::Complex;
use serde::Serialize;

use crate::diagnostics::{Diagnostic, codes};
use crate::eigen::{ComplexVector, spectrum};
use crate::energies::{complex, energies};
use crate::linear::{Linear, refuse};
use crate::session::{Session, SessionError};

/// Residuals above this are told.
const RESIDUAL: f64 = 1e-10;
/// Shares below this are not told.
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
    /// Some eigenvalues are zero, or so near to it that round-off decides: to first order nothing can be said.
    Undecided,
}

impl Stability {
    /// In words.
    #[must_use]
    pub fn words(self) -> &'static str {
        match self {
            Self::Unstable => "unstable: at least one mode grows",
            Self::Stable => "stable: all modes decay",
            Self::Undamped => "no mode grows, some do not decay (undamped)",
            Self::Undecided => "not decided: no mode grows, some are zero (neutral directions, or within round-off)",
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
    /// By how much round-off may have moved the eigenvalue, 1/s.
    pub uncertainty: f64,
    /// Whether the sign of the real part is beyond that.
    pub decided: bool,
    /// Shares of the kinetic energy by body, and by element that brings some, largest first.
    pub kinetic: Vec<Share>,
    /// Potential energies of force elements on the kinetic energy of all (both averaged over a period); what is missing to one is
    /// in weights and preloads, by way of the joints.
    pub potential: Vec<Share>,
    /// Element states that take part, on the largest entry of the vector (SI).
    pub states: Vec<Share>,
    /// How bodies move, largest displacement (turns on the size of the scene) one.
    pub shape: Vec<BodyShape>,
}

/// A motion that meets no resistance.
#[derive(Debug, Clone, Serialize)]
pub struct Neutral {
    /// The bodies that take part, by their share of displacements.
    pub bodies: Vec<Share>,
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
    /// What the eigenvalues say.
    pub stability: Stability,
    /// Eigenvalues that are zero.
    pub zeros: usize,
    /// Directions of motion that meet no resistance: rigid motions, chains of loose parts.
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
        let Some(found) = spectrum(&linear.a) else {
            let message =
                "the eigenvalues were not found: the iteration did not converge, or derivatives are not finite";
            return Err(refuse(session, Diagnostic::error(codes::MOTION_NOT_FINITE, message)));
        };
        let length = session.assembly.scales.length;
        let mut notes = linear.notes.clone();
        let mut modes = Vec::with_capacity(found.pairs.len());
        for (k, pair) in found.pairs.iter().enumerate() {
            let value = pair.value;
            let energies = energies(linear, &pair.vector);
            let shape = shape(linear, &pair.vector, length);
            let size = value.norm();
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
                uncertainty: pair.uncertainty,
                decided: value.re.abs() > pair.uncertainty,
                kinetic: energies.0,
                potential: energies.1,
                states: element_states(linear, &pair.vector),
                shape,
            });
        }
        let open = |mode: &Mode| mode.real.hypot(mode.imaginary) <= mode.uncertainty;
        let stability = if modes.iter().any(|mode| mode.decided && mode.real > 0.0) {
            Stability::Unstable
        } else if found.zeros > 0 || modes.iter().any(|mode| open(mode) || mode.imaginary == 0.0 && !mode.decided) {
            Stability::Undecided
        } else if modes.iter().all(|mode| mode.decided) {
            Stability::Stable
        } else {
            Stability::Undamped
        };
        let neutral = (0..found.null.ncols())
            .map(|k| &linear.positions * found.null.column(k))
            .filter(|moved| moved.norm() > 0.0)
            .map(|moved| {
                let size = |body: usize| {
                    moved.rows(6 * body, 3).norm_squared() + (length * moved.rows(6 * body + 3, 3).norm()).powi(2)
                };
                let all: f64 = (0..linear.bodies.len()).map(size).sum();
                Neutral { bodies: shares((0..linear.bodies.len()).map(|b| (linear.bodies[b].clone(), size(b) / all))) }
            });
        Ok(Self {
            time: linear.time,
            length,
            coordinates: linear.coordinates,
            states: linear.a.nrows(),
            stability,
            zeros: found.zeros,
            neutral: neutral.collect(),
            modes,
            notes,
        })
    }
}

impl Modes {
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

fn shape(linear: &Linear, vector: &ComplexVector, length: f64) -> Vec<BodyShape> {
    let x = complex(&linear.positions, vector);
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
