//! The standard joints. One file per joint, whose documentation is the joint's page of the manual.
//!
//! Frame `i` is the first body's, frame `j` the second's; the joint axis is the frames' z axis. Equations follow Haug,
//! Computer Aided Kinematics and Dynamics of Mechanical Systems (1989), section 9.4; unlike there, rows that compare
//! positions are in the axes of frame `i`.
//!
//! Row names: `x`, `y`, `z` hold the origin of `j` in that direction of frame `i`; `about x` etc. hold the rotation about
//! that axis.
//!
//! Rows that relate an angle to something that continues over many turns (driver, gear, rack, screw, coupler) are the
//! difference of two angles within half a turn, [`element_api::blocks::ahead_of`].

#![forbid(unsafe_code)]

pub mod ball_contact;
pub mod bracket;
pub mod cam;
pub mod clutch;
pub mod constant_velocity;
pub mod coupler;
pub mod cylindrical;
pub mod displacement_driver;
pub mod distance_rod;
pub mod dry_friction;
pub mod ellipse_contact;
mod enclosed;
pub mod freewheel;
pub mod gear;
pub mod gear_backlash;
pub mod ground;
pub mod knife_edge;
pub mod parallel_axes;
pub mod perpendicular_axes;
pub mod planar;
pub mod plane_contact;
pub mod point;
pub mod point_in_plane;
pub mod point_on_curve;
pub mod point_on_line;
pub mod position;
mod profile;
pub mod profile_contact;
pub mod rack_and_pinion;
pub mod rail_contact;
pub mod revolute;
pub mod rolling_disc;
pub mod rope;
pub mod rotation_driver;
pub mod rotational_stop;
pub mod screw;
mod servo;
pub mod servo_displacement;
pub mod servo_rotation;
pub mod spherical;
pub mod stepper_rotation;
pub mod translational;
pub mod translational_stop;
pub mod universal;

use element_api::{ChannelSpec, FrameSpec, ParamError};

element_api::export_plugin! {
    about: "Standard joints",
    joints: [
        ground::Ground,
        bracket::Bracket,
        position::Position,
        point::Point,
        point_in_plane::PointInPlane,
        point_on_line::PointOnLine,
        point_on_curve::PointOnCurve,
        cam::Cam,
        ellipse_contact::EllipseContact,
        profile_contact::ProfileContact,
        rail_contact::RailContact,
        revolute::Revolute,
        cylindrical::Cylindrical,
        translational::Translational,
        spherical::Spherical,
        universal::Universal,
        planar::Planar,
        screw::Screw,
        constant_velocity::ConstantVelocity,
        distance_rod::DistanceRod,
        rope::Rope,
        parallel_axes::ParallelAxes,
        perpendicular_axes::PerpendicularAxes,
        gear::Gear,
        gear_backlash::GearBacklash,
        rack_and_pinion::RackAndPinion,
        coupler::Coupler,
        knife_edge::KnifeEdge,
        rolling_disc::RollingDisc,
        plane_contact::PlaneContact,
        ball_contact::BallContact,
        translational_stop::TranslationalStop,
        rotational_stop::RotationalStop,
        freewheel::Freewheel,
        clutch::Clutch,
        dry_friction::DryFriction,
        rotation_driver::RotationDriver,
        displacement_driver::DisplacementDriver,
        servo_rotation::ServoRotation,
        servo_displacement::ServoDisplacement,
        stepper_rotation::StepperRotation,
    ],
}

/// The two frames of a joint with an axis.
const FRAMES: &[FrameSpec] = &[
    FrameSpec::new("i", "on the first body; its z axis is the joint axis"),
    FrameSpec::new("j", "on the second body; on frame i when all joint coordinates are zero"),
];

/// The coordinate of a rotation about the joint axis.
const ANGLE: ChannelSpec =
    ChannelSpec::new("angle", "rad", "rotation of the second body about z, counted over many turns");

/// The coordinate of a shift along the joint axis.
const DISPLACEMENT: ChannelSpec = ChannelSpec::new("displacement", "m", "shift of the second body along z");

/// The coordinates of a shift in the first frame's axes.
const SHIFTS: [ChannelSpec; 3] = [
    ChannelSpec::new("x", "m", "shift of the second frame along x of the first"),
    ChannelSpec::new("y", "m", "shift of the second frame along y of the first"),
    ChannelSpec::new("z", "m", "shift of the second frame along z of the first"),
];

/// Refuses stops without ends, or with ends that leave no room.
fn refuse_no_ends(lower: Option<f64>, upper: Option<f64>) -> Result<(), ParamError> {
    match (lower, upper) {
        (None, None) => Err(ParamError::new("lower", "give `lower`, `upper` or both")),
        (Some(lower), Some(upper)) if lower >= upper => Err(ParamError::new("upper", "must be above `lower`")),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests;
