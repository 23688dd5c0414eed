//! The standard control elements: signals in, signals out. One file per element: picture, equations, sign convention,
//! singular cases, example.
//!
//! Signals are in SI units whatever the units of the scene; so are gains, limits and coefficients, which are plain numbers.

#![forbid(unsafe_code)]

pub mod digital_filter;
pub mod digital_pid;
pub mod gain;
pub mod integral;
pub mod look_up;
pub mod map;
pub mod pid;
pub mod product;
pub mod relay;
pub mod sensor;
pub mod signal_source;
pub mod state_space;
pub mod sum;
pub mod transfer_function;

use element_api::{ParamError, Scalar};

element_api::export_plugin! {
    about: "Standard control elements",
    controls: [
        signal_source::SignalSource,
        sensor::Sensor,
        sum::Sum,
        gain::Gain,
        product::Product,
        look_up::LookUp,
        map::Map,
        relay::Relay,
        integral::Integral,
        pid::Pid,
        digital_pid::DigitalPid,
        digital_filter::DigitalFilter,
        transfer_function::TransferFunction,
        state_space::StateSpace,
    ],
}

/// Bounds of a signal; either may be missing.
#[derive(Debug, Clone, Copy)]
struct Limits {
    low: Option<f64>,
    high: Option<f64>,
}

impl Limits {
    /// From the parameters `low` and `high`.
    fn new(low: Option<f64>, high: Option<f64>) -> Result<Self, ParamError> {
        match (low, high) {
            (Some(low), Some(high)) if low >= high => {
                Err(ParamError::new("high", format!("must be larger than `low`, {low}; it is {high}")))
            }
            _ => Ok(Self { low, high }),
        }
    }

    /// Whether there is any.
    fn exist(self) -> bool {
        self.low.is_some() || self.high.is_some()
    }

    /// Whether a number lies within them.
    fn contain(self, value: f64) -> bool {
        self.low.is_none_or(|low| value >= low) && self.high.is_none_or(|high| value <= high)
    }

    /// The nearest value within them.
    fn apply<S: Scalar>(self, value: S) -> S {
        let raised = self.low.map_or(value, |low| value.max(S::from(low)));
        self.high.map_or(raised, |high| raised.min(S::from(high)))
    }
}

#[cfg(test)]
mod tests;
