//! How a mechanism starts: which velocities are given, which were chosen, and by what rule.

use super::objections::place_of_body;
use super::opened::Session;
use crate::analysis::{Assembly, Chosen};
use crate::diagnostics::{Diagnostic, codes};
use crate::results::StartVelocity;
use crate::scene::{Dimension, Scene};

/// A chosen velocity is worth a warning from this share of the largest given one on.
const LARGE: f64 = 0.5;
/// Chosen velocities that are named in a warning.
const MOST_NAMED: usize = 6;

/// A warning where a chosen velocity is not small beside what was given.
pub(super) fn warning(assembly: &Assembly, scene: &Scene) -> Option<Diagnostic> {
    let length = assembly.scales.length;
    let speed = |one: &Chosen| if one.angular { one.value.abs() * length } else { one.value.abs() };
    let large: Vec<&Chosen> = assembly.chosen.iter().filter(|one| speed(one) > LARGE * assembly.given_speed).collect();
    let first = large.first()?;
    let texts: Vec<String> = large.iter().take(MOST_NAMED).map(|one| velocity(one, scene).to_string()).collect();
    let more = match large.len().saturating_sub(MOST_NAMED) {
        0 => String::new(),
        more => format!(", and {more} more"),
    };
    let message = "velocities at the start that are not given were chosen, and are not small";
    let text = format!("{}{more}", texts.join(", "));
    Some(
        Diagnostic::warning(codes::CHOSEN_VELOCITY, message)
            .at(place_of_body(scene, &first.body), text)
            .help("the rule is the least kinetic energy (least change in the metric of mass) with what is given")
            .help("give them if something else is meant, 0 for rest; `odyn check` lists all"),
    )
}

fn velocity(chosen: &Chosen, scene: &Scene) -> StartVelocity {
    start_velocity(scene, &chosen.body, chosen.angular, chosen.component, chosen.value)
}

fn start_velocity(scene: &Scene, body: &str, angular: bool, component: usize, value: f64) -> StartVelocity {
    let (quantity, dimension) = match angular {
        true => ("angular velocity", Dimension::ANGULAR_VELOCITY),
        false => ("velocity", Dimension::VELOCITY),
    };
    StartVelocity {
        body: body.into(),
        quantity,
        component: ["x", "y", "z"][component],
        value: value / scene.units.factor(dimension),
        unit: scene.units.label(dimension),
    }
}

impl Session {
    /// The velocities at the start that were chosen.
    pub(super) fn chosen_velocities(&self) -> Vec<StartVelocity> {
        self.assembly.chosen.iter().map(|chosen| velocity(chosen, &self.scene)).collect()
    }

    /// The velocities at the start that the scene gives, without zeros.
    pub(super) fn given_velocities(&self) -> Vec<StartVelocity> {
        let mut given = Vec::new();
        for body in &self.model.bodies {
            for (angular, components) in [(false, &body.velocity), (true, &body.angular_velocity)] {
                let values = components.iter().enumerate().filter_map(|(k, value)| value.map(|value| (k, value)));
                let values = values.filter(|(_, value)| *value != 0.0);
                given.extend(values.map(|(k, value)| start_velocity(&self.scene, &body.name, angular, k, value)));
            }
        }
        given
    }
}

/// What `odyn check` says of velocities at the start; nothing where nothing is given, driven or chosen.
pub(super) fn described(given: &[StartVelocity], chosen: &[StartVelocity]) -> String {
    let listed = |list: &[StartVelocity]| -> String { list.iter().map(|one| format!("    {one}\n")).collect() };
    let mut text = String::new();
    if !given.is_empty() {
        text.push_str(&format!("velocities given at the start:\n{}", listed(given)));
    }
    if !chosen.is_empty() {
        let rule = "least kinetic energy with what is given or driven, the least change in the metric of mass";
        text.push_str(&format!("velocities chosen at the start ({rule}):\n{}", listed(chosen)));
    }
    if !(given.is_empty() && chosen.is_empty()) {
        text.push_str("all other velocities are zero, or follow from the joints\n");
    }
    text
}
