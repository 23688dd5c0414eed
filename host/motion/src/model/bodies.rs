//! Masses and inertias; which bodies can move.

use nalgebra::{Matrix3, Vector3};
use rustc_hash::FxHashMap;

use super::types::{Body, Thin, rotation};
use crate::diagnostics::{Diagnostic, codes, suggest};
use crate::scene::{BodyRecord, Dimension, GROUND, Scene, Spanned};

/// What a body name of the scene stands for.
#[derive(Debug, Clone)]
pub(super) enum Target {
    /// A body that can move, by index.
    Movable(usize),
    /// The ground, or a body fixed to it: where its frame is.
    Fixed {
        /// Origin of its frame, ground.
        origin: Vector3<f64>,
        /// Rotation body -> ground.
        rotation: Matrix3<f64>,
    },
}

/// The bodies of a scene.
pub(super) struct Bodies {
    pub(super) movable: Vec<Body>,
    /// Their frames at the start, as given: origin, rotation body -> ground.
    pub(super) frames: Vec<(Vector3<f64>, Matrix3<f64>)>,
    /// Every name with what it stands for; ground first.
    named: Vec<(String, Target)>,
    /// Place of each name in `named`, of its first one where it is there twice.
    place_of: FxHashMap<String, usize>,
}

impl Bodies {
    fn name(&mut self, name: &str, target: Target) {
        self.place_of.entry(name.into()).or_insert(self.named.len());
        self.named.push((name.into(), target));
    }

    /// What a name stands for.
    pub(super) fn find(&self, name: &Spanned<String>) -> Result<&Target, Diagnostic> {
        self.place_of.get(&name.value).map(|place| &self.named[*place].1).ok_or_else(|| {
            let names: Vec<&str> = self.named.iter().map(|(known, _)| known.as_str()).collect();
            let nearest = suggest(&name.value, names.iter().copied());
            Diagnostic::error(codes::UNKNOWN_BODY, format!("there is no body `{}`", name.value))
                .at(name.span.clone(), "not a body of this scene")
                .help(match nearest {
                    Some(nearest) => format!("did you mean `{nearest}`?"),
                    None => format!("the bodies are {}", quoted(&names)),
                })
        })
    }
}

/// Names in back quotes, separated by commas.
pub(super) fn quoted<S: AsRef<str>>(names: &[S]) -> String {
    names.iter().map(|name| format!("`{}`", name.as_ref())).collect::<Vec<_>>().join(", ")
}

pub(super) fn resolve(scene: &Scene, found: &mut Vec<Diagnostic>) -> Bodies {
    let ground = Target::Fixed { origin: Vector3::zeros(), rotation: Matrix3::identity() };
    let mut bodies =
        Bodies { movable: Vec::new(), frames: Vec::new(), named: Vec::new(), place_of: FxHashMap::default() };
    bodies.name(GROUND, ground);
    for record in &scene.bodies {
        let attitude = rotation(&record.orientation);
        let origin = Vector3::from(record.position);
        let target = if record.fixed {
            Target::Fixed { origin, rotation: attitude }
        } else {
            check(record, scene, found);
            let (mass, center_of_mass, mut inertia) = composed(record);
            let thin = raise_vanishing(&mut inertia);
            bodies.frames.push((origin, attitude));
            bodies.movable.push(Body {
                name: record.name.value.clone(),
                mass,
                inertia,
                center_of_mass,
                position: origin + attitude * center_of_mass,
                orientation: record.orientation,
                velocity: record.velocity.value,
                angular_velocity: record.angular_velocity.value,
                lent: None,
                particle: record.particle,
                thin,
            });
            Target::Movable(bodies.movable.len() - 1)
        };
        bodies.name(&record.name.value, target);
    }
    bodies.movable.shrink_to_fit();
    bodies
}

/// Share of its largest principal moment below which a moment of a body counts as none, and which it is given.
const THIN: f64 = 1e-12;
/// Share of the kinetic energy that such a moment may hold.
const THIN_ENERGY: f64 = 1e-6;
/// Negative moments of this share of the largest are round-off of what the tensor was computed from.
const ROUND_OFF: f64 = 1e-12;
/// Share by which the largest moment of a plate can exceed the sum of the other two where all are rounded to three digits, as published
/// ones are: 1.005 and twice 0.4995.
const ROUNDED: f64 = 6.1e-3;

/// Mass, centre of mass and inertia about it of a body with its point masses (Haug 1989, section 11.2: parallel axes).
///
/// A particle gets an inertia all the same, so that its equations can be solved. It stays at zero angular velocity as long
/// as no torque acts on it, which is watched.
fn composed(record: &BodyRecord) -> (f64, Vector3<f64>, Matrix3<f64>) {
    let mass = record.mass.as_ref().map_or(1.0, |m| m.value);
    let center = Vector3::from(record.com);
    let inertia = match &record.inertia {
        Some(inertia) => tensor(inertia.value),
        None => Matrix3::identity() * mass,
    };
    let parts = || {
        let points = record.point_masses.iter().map(|point| (point.mass.value, Vector3::from(point.position)));
        std::iter::once((mass, center)).chain(points)
    };
    if record.point_masses.is_empty() {
        return (mass, center, inertia);
    }
    let total: f64 = parts().map(|(mass, _)| mass).sum();
    let common = parts().map(|(mass, at)| at * mass).sum::<Vector3<f64>>() / total;
    let moved = |(mass, at): (f64, Vector3<f64>)| {
        let d = at - common;
        (Matrix3::identity() * d.norm_squared() - d * d.transpose()) * mass
    };
    (total, common, inertia + parts().map(moved).sum::<Matrix3<f64>>())
}

/// Raises principal moments that vanish beside the largest one, as those of thin rods about their axes, so that the equations can be
/// solved: by so little that no result within the reach of a tolerance changes. Gives the raised ones.
fn raise_vanishing(inertia: &mut Matrix3<f64>) -> Vec<Thin> {
    let eigen = nalgebra::SymmetricEigen::new(*inertia);
    let moment = THIN * eigen.eigenvalues.max();
    let is_diagonal = *inertia == Matrix3::from_diagonal(&inertia.diagonal());
    let mut thin = Vec::new();
    for k in 0..3 {
        // The axes of a diagonal tensor are those of the body, without round-off.
        let (own, axis) = match is_diagonal {
            true => (inertia[(k, k)], Vector3::ith(k, 1.0)),
            false => (eigen.eigenvalues[k], eigen.eigenvectors.column(k).into_owned()),
        };
        if own < moment {
            *inertia += axis * axis.transpose() * (moment - own);
            thin.push(Thin { axis, moment, share: THIN_ENERGY });
        }
    }
    thin
}

fn tensor([xx, yy, zz, xy, yz, zx]: [f64; 6]) -> Matrix3<f64> {
    Matrix3::new(xx, xy, zx, xy, yy, yz, zx, yz, zz)
}

/// Mass and inertia must be positive; an inertia that no body can have is used as given, with a warning.
fn check(record: &BodyRecord, scene: &Scene, found: &mut Vec<Diagnostic>) {
    let name = &record.name.value;
    if let Some(mass) = &record.mass
        && mass.value <= 0.0
    {
        found.push(
            Diagnostic::error(codes::BAD_MASS, format!("the mass of `{name}` must be positive"))
                .at(mass.span.clone(), "not a positive mass")
                .help("a body that is not to move is declared with `fixed = true`"),
        );
    }
    for point in record.point_masses.iter().filter(|point| point.mass.value <= 0.0) {
        found.push(
            Diagnostic::error(codes::BAD_MASS, format!("the point masses of `{name}` must be positive"))
                .at(point.mass.span.clone(), "not a positive mass"),
        );
    }
    let Some(inertia) = &record.inertia else { return };
    let moments = nalgebra::SymmetricEigen::new(tensor(inertia.value)).eigenvalues;
    let (least, largest, sum) = (moments.min(), moments.max(), moments.sum());
    let negative = least < -ROUND_OFF * largest || least.is_nan();
    if negative || largest <= 0.0 {
        let what = if negative { "has a negative principal moment" } else { "has no principal moment above zero" };
        let [xx, yy, zz, ..] = inertia.value;
        let by_products = negative && [xx, yy, zz].iter().all(|moment| *moment >= 0.0);
        let help = if by_products {
            "products of inertia are too large beside the moments: they are in one unit, in the order xx, yy, zz, xy, yz, zx"
        } else {
            "a body without extent is declared with `particle = true` and needs no inertia; a thin rod has one moment 0"
        };
        found.push(
            Diagnostic::error(
                codes::BAD_INERTIA,
                format!("no principal moment of inertia of `{name}` may be negative, nor all zero"),
            )
            .at(inertia.span.clone(), what)
            .help(help),
        );
    } else if largest > (sum - largest) * (1.0 + ROUNDED) {
        let moment = |value: f64| in_digits(scene.units.from_si(value, Dimension::INERTIA));
        let others = [least, sum - largest - least].map(moment);
        let [largest, others, unit] = [moment(largest), others.join(" and "), scene.units.label(Dimension::INERTIA)];
        found.push(
            Diagnostic::warning(codes::UNREAL_INERTIA, format!("no rigid body can have the inertia of `{name}`"))
                .at(inertia.span.clone(), format!("the principal moments {others} {unit} together are less than the third, {largest} {unit}"))
                .help("the inertia is used as given; each principal moment of a real body is at most the sum of the other two")
                .help("moments must be about the centre of mass, all in one unit, and products of inertia have the signs of the tensor"),
        );
    }
}

/// A number with the four digits that tell it.
pub(super) fn in_digits(value: f64) -> String {
    format!("{value:.3e}").parse::<f64>().unwrap_or(value).to_string()
}
