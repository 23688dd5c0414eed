//! [`Release`]: when a joint or a force lets go of its bodies, for good.

use element_api::Kind;

use super::signals;
use super::types::{Channel, Instance, Quantity};
use crate::diagnostics::{Diagnostic, codes};
use crate::scene::{Dimension, ReleaseWhen, Scene};

/// When an element is released.
#[derive(Debug, Clone, PartialEq)]
pub struct Release {
    /// What decides, as the scene has it; `time`.
    pub name: String,
    /// The quantity that is not to leave its bounds; `None`: the time.
    pub quantity: Option<Quantity>,
    /// Its largest value, SI; of the time, the instant of the release.
    pub above: Option<f64>,
    /// Its least value, SI.
    pub below: Option<f64>,
    /// Its unit in the scene.
    pub unit: String,
    /// One of these in SI.
    pub factor: f64,
}

/// Fills in [`Instance::release`]. Mistakes are added to `found`.
pub(super) fn resolve(scene: &Scene, channels: &[Channel], instances: &mut [Instance], found: &mut Vec<Diagnostic>) {
    for record in scene.elements.iter().filter(|record| record.enabled) {
        let Some(release) = &record.release else { continue };
        let Some(index) = instances.iter().position(|instance| instance.name == record.name.value) else { continue };
        let instance = &instances[index];
        if instance.class.kind == Kind::Force && (instance.brings_kinetic() || instance.recording.flexible() > 0) {
            let message = format!("`{}` cannot let go: it brings inertia, which stays", record.name.value);
            let help = "fasten what has the mass by an element that may be released";
            found.push(Diagnostic::error(codes::UNKNOWN_KEY, message).at(release.span.clone(), "").help(help));
            continue;
        }
        let made = match &release.when {
            ReleaseWhen::At(at) => Ok(Release {
                name: "time".into(),
                quantity: None,
                above: Some(*at),
                below: None,
                unit: scene.units.label(Dimension::TIME),
                factor: scene.units.factor(Dimension::TIME),
            }),
            ReleaseWhen::Signal { name, above, below } => {
                signals::named(&name.value, &name.span, scene, channels, instances).and_then(|(quantity, dimension)| {
                    let bound = |raw: &Option<_>| raw.as_ref().map(|raw| scene.quantity(raw, dimension)).transpose();
                    let (above, below) = (bound(above)?, bound(below)?);
                    if let (Some(above), Some(below)) = (above, below)
                        && above <= below
                    {
                        let message = format!(
                            "`release` of `{}` leaves no range: `above` is not more than `below`",
                            record.name.value
                        );
                        let diagnostic = Diagnostic::error(codes::OUT_OF_RANGE, message).at(release.span.clone(), "");
                        return Err(Box::new(diagnostic.help("it holds as long as the signal is between them")));
                    }
                    let channel = channels.iter().find(|channel| channel.name == name.value);
                    let units = &scene.units;
                    let plain = || (units.label(dimension), units.factor(dimension));
                    let (unit, factor) = channel.map_or_else(plain, |channel| (channel.unit.clone(), channel.factor));
                    Ok(Release { name: name.value.clone(), quantity: Some(quantity), above, below, unit, factor })
                })
            }
        };
        match made {
            Ok(release) => instances[index].release = Some(release),
            Err(diagnostic) => found.push(*diagnostic),
        }
    }
}
