//! Bodies that follow the time, whatever else moves: a belt on its guide and its drive, a table that is bolted to the ground.

use element_api::Kind;
use element_api::recording::Role;
use nalgebra::DMatrix;

use super::decide::Probe;
use super::layout::Layout;
use super::topology::{follows_time, of_time_alone};
use crate::model::{Axes, Instance, MAGNITUDE, Model, Quantity};

/// Least ratio of singular values of the rows that hold a body, each of unit length: far from where a drive has no hold on it.
const FIRM: f64 = 1e-2;

/// Bodies that follow the time, and the joints that make them do so.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Led {
    /// Of each body whether it follows the time. Empty: none does.
    pub bodies: Vec<bool>,
    /// Of each element whether it is one of the joints between such bodies and the ground.
    pub holding: Vec<bool>,
}

impl Led {
    /// Finds them: a body with six independent rows, at the position of the probe, against the ground and others that are found. Left out are
    /// bodies whose joints do anything that does not add up where each of several copies of them bears a share of what they bear in all:
    /// friction, stops, values of their own, reactions that others take, magnitudes of reactions that are reported.
    #[must_use]
    pub fn find(model: &Model, layout: &Layout, probe: &Probe<'_>) -> Self {
        let of_time = of_time_alone(model);
        let mut holding: Vec<bool> = model.elements.iter().map(|element| holds(element, &of_time)).collect();
        let loads_of = |quantity: &Quantity| match quantity {
            Quantity::Load { element, .. } => Some(*element),
            _ => None,
        };
        let mut taken: Vec<usize> = model.elements.iter().flat_map(|element| &element.joints).copied().collect();
        taken.extend(model.elements.iter().flat_map(Instance::signals).filter_map(loads_of));
        let adds_up = |quantity: &Quantity| {
            !matches!(
                quantity,
                Quantity::Load { component: MAGNITUDE, .. } | Quantity::Load { axes: Axes::Body(_), .. }
            )
        };
        let shown = model.channels.iter().map(|channel| &channel.quantity).filter(|quantity| !adds_up(quantity));
        taken.extend(shown.filter_map(loads_of));
        taken.into_iter().for_each(|element| holding[element] = false);
        let balances = model.elements.iter().flat_map(Instance::signals).any(|signal| {
            matches!(
                signal,
                Quantity::Balance { .. } | Quantity::KineticEnergy | Quantity::PotentialEnergy | Quantity::TotalEnergy
            )
        });
        let none = Self { bodies: vec![false; model.bodies.len()], holding: vec![false; model.elements.len()] };
        if balances {
            return none;
        }
        let mut joints_of: Vec<Vec<usize>> = vec![Vec::new(); model.bodies.len()];
        for (number, element) in model.elements.iter().enumerate().filter(|(_, one)| one.class.kind == Kind::Joint) {
            bodies_of(element).for_each(|body| joints_of[body].push(number));
        }
        let mut led = none.bodies.clone();
        let mut open: Vec<usize> = (0..led.len()).collect();
        while !open.is_empty() {
            let is_new = |body: &usize| {
                let within = |joint: &&usize| bodies_of(&model.elements[**joint]).all(|own| own == *body || led[own]);
                let joints: Vec<usize> = joints_of[*body].iter().filter(within).copied().collect();
                !led[*body] && joints.iter().all(|joint| holding[*joint]) && is_held(*body, &joints, layout, probe)
            };
            let new: Vec<usize> = open.iter().filter(|body| is_new(body)).copied().collect();
            new.iter().for_each(|body| led[*body] = true);
            // Those that hang on these may be held now.
            let joints = new.iter().flat_map(|body| &joints_of[*body]);
            open = joints.flat_map(|joint| bodies_of(&model.elements[*joint])).filter(|body| !led[*body]).collect();
            open.sort_unstable();
            open.dedup();
        }
        for (element, holds) in model.elements.iter().zip(&mut holding) {
            let is_between = bodies_of(element).next().is_some() && bodies_of(element).all(|body| led[body]);
            if is_between && element.class.kind == Kind::Joint && !*holds {
                return none;
            }
            *holds &= is_between;
        }
        Self { bodies: led, holding }
    }

    /// Whether a body follows the time.
    pub(super) fn body(&self, body: usize) -> bool {
        self.bodies.get(body).is_some_and(|led| *led)
    }

    /// Whether an element is one of the joints that hold such bodies.
    pub(super) fn holds(&self, element: usize) -> bool {
        self.holding.get(element).is_some_and(|holds| *holds)
    }
}

fn bodies_of(element: &Instance) -> impl Iterator<Item = usize> {
    element.markers.iter().filter_map(|marker| marker.body)
}

/// Whether a joint does no more than hold places that follow the time.
fn holds(element: &Instance, of_time: &[bool]) -> bool {
    let plain = |role: &Role| {
        !matches!(
            role,
            Role::VelocityResidual(_)
                | Role::Unilateral(_)
                | Role::SticksWith(_)
                | Role::Limit(_)
                | Role::Condition(_)
                | Role::Kinetic
                | Role::Potential
                | Role::Dissipation
        )
    };
    element.class.kind == Kind::Joint
        && !element.class.opaque
        && !element.rows.is_empty()
        && !element.has_states()
        && element.recording.initial_discrete.is_empty()
        && element.release.is_none()
        && element.joints.is_empty()
        && element.recording.outputs.iter().all(|output| plain(&output.role))
        && element.signals().all(|signal| follows_time(signal, of_time))
        && bodies_of(element).next().is_some()
}

/// Whether rows of these joints hold a body in all directions, wherever the others are.
fn is_held(body: usize, joints: &[usize], layout: &Layout, probe: &Probe<'_>) -> bool {
    let own = 6 * body..6 * (body + 1);
    let mut rows: Vec<f64> = Vec::new();
    for joint in joints {
        for row in layout.rows_of(*joint) {
            let mut values = [0.0; 6];
            for (_, column, value) in probe.entries(row..row + 1).filter(|(_, column, _)| own.contains(column)) {
                values[column - own.start] = value * if column - own.start < 3 { probe.length } else { 1.0 };
            }
            let size = values.iter().map(|value| value * value).sum::<f64>().sqrt();
            if size > 0.0 {
                rows.extend(values.map(|value| value / size));
            }
        }
    }
    if rows.len() < 36 {
        return false;
    }
    let sizes = DMatrix::from_row_slice(rows.len() / 6, 6, &rows).singular_values();
    sizes.min() >= FIRM * sizes.max()
}
