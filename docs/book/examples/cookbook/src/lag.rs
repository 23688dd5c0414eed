//! A first-order lag: the output follows the input with a time constant, T y' = u - y.

use element_api::prelude::*;

/// The control element.
pub struct Lag(LagParameters);

/// Its parameters, as a scene gives them.
#[derive(Parameters)]
pub struct LagParameters {
    /// T.
    #[param(unit = "s", above = 0.0)]
    time_constant: f64,
    /// Output at the start; its unit is that of the signal.
    #[param(unit = "", default = 0.0)]
    initial: f64,
}

impl Element for Lag {
    const NAME: &'static str = "lag";
    const SUMMARY: &'static str = "follows a signal with a time constant";
    const DOC: &'static str = doc_of(include_str!("lag.rs"));
    // It sees no body.
    const FRAMES: &'static [FrameSpec] = &[];
    type Parameters = LagParameters;

    fn new(p: LagParameters) -> Result<Self, ParamError> {
        Ok(Self(p))
    }
}

impl Control for Lag {
    const INPUTS: &'static [InputSpec] = &[InputSpec::required("input", "", "u, any unit")];
    const OUTPUTS: &'static [ChannelSpec] = &[ChannelSpec::new("output", "", "y, in the unit of u")];
    const STATES: &'static [ChannelSpec] = &[ChannelSpec::new("output", "", "y")];

    fn outputs<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push(at.states[0]);
    }

    fn initial_states(&self) -> Vec<f64> {
        vec![self.0.initial]
    }

    fn rates<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push((at.inputs[0] - at.states[0]) * (1.0 / self.0.time_constant));
    }
}
