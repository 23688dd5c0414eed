//! Points of an element that have come together: the line between them, along which it acts, has no direction there.

use nalgebra::Vector3;

use super::opened::Session;
use crate::analysis::Scales;
use crate::model::{Instance, needs_distance, origins, rotation, together};
use crate::plan::Layout;
use crate::results::significant;
use crate::scene::Dimension;

/// Size of a scene beside its distance from the origin of the ground frame, by which positions have round-off.
const FAR: f64 = 1e-5;

impl Session {
    /// What to say of an element two points of which lie together for these inputs of the working form.
    pub(super) fn points_together(&self, element: usize, inputs: &[f64]) -> Option<String> {
        let instance = &self.model.elements[element];
        let pair = self.pair_together(instance, inputs)?;
        let [one, other] = pair.map(|marker| match instance.markers[marker].body {
            None => "the ground".to_string(),
            Some(body) => format!("`{}`", self.model.bodies[body].name),
        });
        let units = &self.scene.units;
        let time = significant(inputs[Layout::TIME] / units.factor(Dimension::TIME), 6);
        let guided = instance.class.params.iter().any(|spec| spec.name == "guided");
        let own = if guided { ", or give it one by `params.guided = true`" } else { "" };
        Some(format!(
            "the points of `{}` on {one} and {other} are together at t = {time} {}, where the line between them has no direction to act \
             along; put one of them further out, so that they stay apart{own}",
            instance.name,
            units.label(Dimension::TIME),
        ))
    }

    /// The same of the first element of which that is so.
    pub(super) fn points_met(&self, inputs: &[f64]) -> Option<String> {
        (0..self.model.elements.len()).find_map(|element| self.points_together(element, inputs))
    }

    /// Two of its points that lie together and must not.
    fn pair_together(&self, instance: &Instance, inputs: &[f64]) -> Option<[usize; 2]> {
        let Scales { length, far, .. } = self.assembly.scales;
        let points = origins(&instance.markers, |body| {
            let y = &inputs[self.plan.layout.body_slot(body, 0)..];
            (Vector3::new(y[0], y[1], y[2]), rotation(&[y[3], y[4], y[5], y[6]]))
        });
        let pair = together(&points, length.max(FAR * far))?;
        needs_distance(&instance.recording, &points, pair, length).then_some(pair)
    }
}
