//! What a motor adds to its joint whether it drives or not: the inertia of its rotor and its damping, behind the gear (MuJoCo, XML
//! reference, "actuator/general").

use roxmltree::Node;

use super::Reader;
use crate::mechanism::Kind;
use crate::words::MOTORS;

impl<'a, 'i: 'a> Reader<'_, 'a, 'i> {
    pub(super) fn actuator(&mut self, node: Node<'a, 'i>) {
        let of = self.classes.of_one_of(node, MOTORS, None);
        let (armature, damping) = (self.first(&of, "armature"), self.first(&of, "damping"));
        if armature == 0.0 && damping == 0.0 {
            return;
        }
        // Of the numbers of a gear only balls and free bodies have more than the first.
        let gear = self.numbers(&of, "gear").first().copied().unwrap_or(1.0);
        let name = of.text("joint").or_else(|| of.text("jointinparent"));
        let mut joints = self.mechanism.joints_mut();
        let moved = |joint: &&mut crate::mechanism::Joint| {
            matches!(joint.kind, Kind::Hinge | Kind::Slide) && name == Some(joint.name.as_str())
        };
        if let Some(joint) = joints.find(moved) {
            joint.armature += gear * gear * armature;
            joint.damping += gear * gear * damping;
            return;
        }
        drop(joints);
        let name = node.attribute("name").unwrap_or(node.tag_name().name());
        self.left_out(format!("motor `{name}`: its armature and damping act on no hinge or slide"));
    }
}
