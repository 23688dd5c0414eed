//! A switch with hysteresis: on below `low`, off above `high`, and in between as it was.
//!
//! "As it was" is a memory. The equations read it like an input; `next_memory` says what it is next, between steps, which end where
//! its conditions change.

use element_api::prelude::*;

/// The control element.
pub struct Thermostat(ThermostatParameters);

/// Its parameters, as a scene gives them.
#[derive(Parameters)]
pub struct ThermostatParameters {
    /// Switches on below.
    #[param(unit = "", example = -0.5)]
    low: f64,
    /// Switches off above.
    #[param(unit = "", example = 0.5)]
    high: f64,
    /// On at the start.
    #[param(default = true)]
    on: bool,
}

impl Element for Thermostat {
    const NAME: &'static str = "thermostat";
    const SUMMARY: &'static str = "switch with hysteresis";
    const DOC: &'static str = doc_of(include_str!("thermostat.rs"));
    const FRAMES: &'static [FrameSpec] = &[];
    type Parameters = ThermostatParameters;

    fn new(p: ThermostatParameters) -> Result<Self, ParamError> {
        if p.low >= p.high {
            return Err(ParamError::new("high", "must be above `low`"));
        }
        Ok(Self(p))
    }
}

impl Control for Thermostat {
    const INPUTS: &'static [InputSpec] = &[InputSpec::required("input", "", "the signal that is watched")];
    const OUTPUTS: &'static [ChannelSpec] = &[ChannelSpec::new("on", "1", "1 or 0")];

    fn outputs<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push(at.memory[0]);
    }

    fn initial_memory(&self) -> Vec<f64> {
        vec![f64::from(u8::from(self.0.on))]
    }

    fn next_memory<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let (input, low, high) = (at.inputs[0], S::from(self.0.low), S::from(self.0.high));
        let as_it_was = select(input.above(high), S::zero(), at.memory[0]);
        out.push(select(input.below(low), S::one(), as_it_was));
    }
}
