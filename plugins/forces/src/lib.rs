//! The standard force elements. One file per element: its documentation is its page in the manual.

#![forbid(unsafe_code)]

pub mod added_mass;
pub mod beam;
pub mod bearing_rating;
pub mod bump_stop;
pub mod bushing;
mod contact;
pub mod contact_friction;
mod deformation;
pub mod drag;
pub mod field;
pub mod hydraulic_damper;
pub mod inerter;
pub mod joint_friction;
mod matrix;
pub mod modal_body;
pub mod point_gravity;
pub mod rotational_actuator;
pub mod rotational_bump_stop;
pub mod rotational_inerter;
pub mod rotational_spring_damper;
pub mod translational_actuator;
pub mod translational_spring_damper;
pub mod uniform_gravity;
pub mod vector_force;
pub mod vector_torque;

use element_api::{ChannelSpec, Function, Scalar};

element_api::export_plugin! {
    about: "Standard force elements",
    forces: [
        translational_spring_damper::TranslationalSpringDamper,
        rotational_spring_damper::RotationalSpringDamper,
        beam::Beam,
        bushing::Bushing,
        field::Field,
        joint_friction::JointFriction,
        contact_friction::ContactFriction,
        bump_stop::BumpStop,
        rotational_bump_stop::RotationalBumpStop,
        translational_actuator::TranslationalActuator,
        rotational_actuator::RotationalActuator,
        vector_force::VectorForce,
        vector_torque::VectorTorque,
        drag::Drag,
        bearing_rating::BearingRating,
        hydraulic_damper::HydraulicDamper,
        point_gravity::PointGravity,
        uniform_gravity::UniformGravity,
        inerter::Inerter,
        rotational_inerter::RotationalInerter,
        added_mass::AddedMass,
        modal_body::ModalBody,
    ],
}

/// What bushing and field report: load of body j on the element and deformation, in axes of frame i.
const DEFORMATION_CHANNELS: &[ChannelSpec] = &[
    ChannelSpec::new("force_x", "N", "force of the second body on the element along x of the first frame"),
    ChannelSpec::new("force_y", "N", "the same along y"),
    ChannelSpec::new("force_z", "N", "the same along z"),
    ChannelSpec::new("torque_x", "N m", "torque of the second body on the element about x of the first frame"),
    ChannelSpec::new("torque_y", "N m", "the same about y"),
    ChannelSpec::new("torque_z", "N m", "the same about z"),
    ChannelSpec::new("x", "m", "displacement of the second frame along x of the first"),
    ChannelSpec::new("y", "m", "the same along y"),
    ChannelSpec::new("z", "m", "the same along z"),
    ChannelSpec::new("rotation_x", "rad", "component about x of the rotation vector of the second frame"),
    ChannelSpec::new("rotation_y", "rad", "the same about y"),
    ChannelSpec::new("rotation_z", "rad", "the same about z"),
];

/// The value of a characteristic, zero where none is given.
fn value<S: Scalar>(function: &Option<Function>, x: S) -> S {
    function.as_ref().map_or_else(S::zero, |function| function.at(x))
}

#[cfg(test)]
mod tests;
