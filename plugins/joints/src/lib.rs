//! The standard joints. One file per joint: picture, equations, sign convention, singular cases, tests.
//!
//! Frame `i` is the first body's, frame `j` the second's; the joint axis is the frames' z axis. Equations follow Haug,
//! Computer Aided Kinematics and Dynamics of Mechanical Systems (1989), section 9.4; unlike there, rows that compare
//! positions are in the axes of frame `i`.
//!
//! Row names: `x`, `y`, `z` hold the origin of `j` in that direction of frame `i`; `about x` etc. hold the rotation about
//! that axis.

#![forbid(unsafe_code)]

pub mod cylindrical;
pub mod fixed;
pub mod revolute;
pub mod spherical;
pub mod translational;

use element_api::FrameSpec;

element_api::export_plugin! {
    about: "Standard joints",
    joints: [
        fixed::Fixed,
        revolute::Revolute,
        cylindrical::Cylindrical,
        translational::Translational,
        spherical::Spherical,
    ],
}

/// The two frames of every joint of this library.
const FRAMES: &[FrameSpec] = &[
    FrameSpec::new("i", "on the first body; its z axis is the joint axis"),
    FrameSpec::new("j", "on the second body; on frame i when all joint coordinates are zero"),
];

#[cfg(test)]
mod tests;
