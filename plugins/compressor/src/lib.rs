//! Elements of a reciprocating compressor: what drives it, what loads it, what brakes it. One file per element: picture,
//! equations, sign convention, singular cases, tests.
//!
//! All angles and speeds are those of a rotor frame against a housing frame about their common z axis, the shaft.

#![forbid(unsafe_code)]

pub mod compression_force;
pub mod motor_torque;
pub mod rolling_resistance;

use element_api::{FrameSpec, ParamError, Table};

element_api::export_plugin! {
    about: "Elements of a reciprocating compressor",
    forces: [
        motor_torque::MotorTorque,
        compression_force::CompressionForce,
        rolling_resistance::RollingResistance,
    ],
}

/// Frames of the elements that act between housing and rotor.
const SHAFT_FRAMES: &[FrameSpec] = &[
    FrameSpec::new("housing", "on the housing; its z axis is the shaft"),
    FrameSpec::new("rotor", "on the rotor; its z axis is kept parallel by a bearing"),
];

/// Says of a curve that cannot be used which parameter it is.
fn named(curve: Result<Table, ParamError>, parameter: &str) -> Result<Table, ParamError> {
    curve.map_err(|error| ParamError::new(parameter, error.message))
}

#[cfg(test)]
mod tests;
