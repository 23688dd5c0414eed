//! The Newton-Euler balance of every body, from what a run reports.

use super::case::Balance;
use crate::model::{Axes, Channel, Level, Model, Quantity};
use crate::scene::Dimension;
use crate::session::{RunReport, Session};

/// Products of inertia and squared spin cancel in the torque of a body that turns about a principal axis, and leave the
/// round-off of what they were: this share of them counts as a load, so that it stays far below the bound.
const CANCELLING: f64 = 1e-5;

/// The reports that a balance needs, behind the channels that a scene asks for itself.
pub(super) struct Reports {
    /// Number of the first one among all channels.
    first: usize,
    /// What each of them is.
    kinds: Vec<Kind>,
    /// Names of the bodies.
    bodies: Vec<String>,
    /// Largest weight, N: a load too.
    weight: f64,
    /// Size of the scene, m.
    length: f64,
}

/// What a reported column means for the balance.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    /// A component of what is left of the equations of a body, SI.
    Left { body: usize, torque: bool },
    /// A component of a force, N, or of a torque, N m.
    Load { torque: bool },
    /// A component of the angular velocity of a body with this largest moment of inertia, kg m^2.
    Spin { inertia: f64 },
}

/// What a balance needs of a scene: the imbalance of every body, and all loads to judge it by.
fn wanted(model: &Model) -> Vec<(Kind, Quantity)> {
    let mut wanted: Vec<(Kind, Quantity)> = Vec::new();
    for (body, own) in model.bodies.iter().enumerate() {
        let inertia = own.inertia.diagonal().max();
        for component in 0..3 {
            for torque in [false, true] {
                let quantity = Quantity::Balance { body, torque, component };
                wanted.push((Kind::Left { body, torque }, quantity));
            }
            let level = Level::Velocity;
            wanted.push((Kind::Spin { inertia }, Quantity::Angular { body, level, axes: Axes::Ground, component }));
        }
    }
    let loaded =
        model.elements.iter().enumerate().filter(|(_, instance)| instance.class.kind != element_api::Kind::Control);
    for (element, instance) in loaded {
        for (frame, _) in instance.markers.iter().enumerate().filter(|(_, marker)| marker.body.is_some()) {
            for component in 0..3 {
                for torque in [false, true] {
                    let quantity = Quantity::Load { element, frame, torque, axes: Axes::Ground, component };
                    wanted.push((Kind::Load { torque }, quantity));
                }
            }
        }
    }
    wanted
}

/// The channels that a balance needs behind those of a scene, for [`crate::session::RunOptions::further_channels`].
pub(super) fn channels(model: &Model) -> Vec<Channel> {
    let channel = |(k, (_, quantity)): (usize, (Kind, Quantity))| Channel {
        name: format!("balance {k}"),
        quantity,
        unit: String::new(),
        factor: 1.0,
        dimension: Dimension::DIMENSIONLESS,
        place: String::new(),
    };
    wanted(model).into_iter().enumerate().map(channel).collect()
}

impl Reports {
    /// Those of a session with the [`channels`] that are needed.
    pub(super) fn of(session: &Session) -> Self {
        let model = &session.model;
        let kinds: Vec<Kind> = wanted(model).into_iter().map(|(kind, _)| kind).collect();
        let heaviest = model.bodies.iter().map(|body| body.mass).fold(0.0, f64::max);
        Self {
            first: model.channels.len() - kinds.len(),
            kinds,
            bodies: model.bodies.iter().map(|body| body.name.clone()).collect(),
            weight: heaviest * model.gravity.norm(),
            length: session.assembly.scales.length,
        }
    }

    /// The worst imbalance of a run of that scene; `None` without bodies or samples.
    ///
    /// The measure of forces is the largest force, weight, or torque over the size of the scene, and that of torques is this
    /// force times the size of the scene: where all forces are round-off, torques tell what that is small against, and the
    /// other way round.
    pub(super) fn judge(&self, report: &RunReport) -> Option<Balance> {
        let columns = &report.columns[self.first..];
        let mut largest = self.weight;
        for (kind, column) in self.kinds.iter().zip(columns) {
            let peak = column.iter().fold(0.0_f64, |peak, value| peak.max(value.abs()));
            largest = largest.max(match kind {
                Kind::Left { .. } => 0.0,
                Kind::Load { torque: false } => peak,
                Kind::Load { torque: true } => peak / self.length,
                Kind::Spin { inertia } => CANCELLING * inertia * peak * peak / self.length,
            });
        }
        let mut worst: Option<Balance> = None;
        for (kind, column) in self.kinds.iter().zip(columns) {
            let Kind::Left { body, torque } = *kind else { continue };
            let load = if torque { largest * self.length } else { largest };
            for (at, value) in report.times.iter().zip(column) {
                // Without any load, nothing may be left.
                let share = if *value == 0.0 { 0.0 } else { value.abs() / load };
                if worst.as_ref().is_none_or(|worst| share.is_nan() || share > worst.share) {
                    worst = Some(Balance { share, body: self.bodies[body].clone(), torque, at: *at });
                }
            }
        }
        worst
    }
}
