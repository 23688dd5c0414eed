//! What `<flag>` in `<option>` switches off (MuJoCo, XML reference, "option/flag").

use nalgebra::Vector3;
use roxmltree::Node;

use crate::mechanism::Mechanism;
use crate::xml::children;

/// Takes out of the mechanism what the file switches off; contacts of shapes are reported where they are on.
pub(super) fn apply(root: Node<'_, '_>, touching: bool, mechanism: &mut Mechanism) {
    let options = children(root).filter(|node| node.has_tag_name("option")).flat_map(children);
    let flags: Vec<_> = options.filter(|node| node.has_tag_name("flag")).collect();
    // Of flags that are given twice, the last counts.
    let off = |name: &str| flags.iter().rev().find_map(|flag| flag.attribute(name)) == Some("disable");
    if off("gravity") {
        mechanism.gravity = Vector3::zeros();
    }
    let [constraint, passive] = ["constraint", "passive"].map(off);
    for joint in mechanism.joints_mut() {
        if passive || off("spring") {
            joint.stiffness = 0.0;
        }
        if passive || off("damper") {
            joint.damping = 0.0;
        }
        if constraint || off("frictionloss") {
            joint.friction = 0.0;
        }
        if constraint || off("limit") {
            joint.range = None;
        }
    }
    if constraint || off("equality") {
        mechanism.closures.iter_mut().for_each(|closure| closure.active = false);
        mechanism.couplings.iter_mut().for_each(|coupling| coupling.active = false);
    }
    if touching && !constraint && !off("contact") {
        mechanism.left_out.push("contacts of shapes (`contype`, `conaffinity`): bodies do not touch each other".into());
    }
}
