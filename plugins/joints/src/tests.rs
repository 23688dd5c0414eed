//! What each joint leaves free, what it blocks, and what its coordinates say.

mod contract;
mod coordinates;
mod directions;
mod places;
mod refusals;
mod turns;

use element_api::testkit::{Probe, Setting};
use element_api::{Constraint, Frame};

/// An instance of a joint.
fn probe<T: Constraint>(params: &str) -> Probe {
    Probe::joint::<T>(params).expect("the parameters are accepted")
}

/// Rows of a joint at frames at rest at time 0, angle references at the angles.
fn rows<T: Constraint>(params: &str, frames: Vec<Frame<f64>>) -> Vec<f64> {
    let probe = probe::<T>(params);
    let mut setting = Setting::at_rest(frames);
    probe.settle(&mut setting);
    probe.joint_values(&setting).residual().to_vec()
}

fn assert_satisfied<T: Constraint>(params: &str, frames: Vec<Frame<f64>>) {
    for (row, value) in rows::<T>(params, frames).iter().enumerate() {
        assert!(value.abs() < 1e-13, "{} {params}: row {row} is {value:e}", T::NAME);
    }
}
