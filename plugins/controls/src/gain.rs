//! An amplifier: multiplies a signal by a constant and limits the result. With a gain of 1 it is a saturation.
//!
//! ## Equations
//! ```text
//! y = min(max(gain u, low), high)                                           (1)
//! ```
//! A limit that is not given does not act.
//!
//! ## Signs
//! A negative gain inverts; the limits are those of the result.
//!
//! ## Singular cases
//! None. The result has a kink where a limit is reached.
//!
//! ## Example
//! ```toml
//! title = "Saturation"
//!
//! [plugins]
//! libraries = ["odyn-controls"]
//!
//! [simulation]
//! t_end = 0.1
//! output_step = 0.01
//!
//! [[body]]
//! name = "bystander"
//! mass = 1.0
//! inertia = [1.0, 1.0, 1.0]
//!
//! [[control]]
//! name = "wave"
//! type = "signal-source"
//! params.function = "sin(100 t)"
//!
//! [[control]]
//! name = "amplifier"
//! type = "gain"
//! inputs = { input = "wave.output" }
//! params.gain = 5.0
//! params.low = -3.0
//! params.high = 3.0
//!
//! [[output]]
//! name = "amplified"
//! quantity = "value"
//! of = "amplifier"
//! channel = "output"
//! ```

use element_api::prelude::*;

use crate::Limits;

/// The element.
#[derive(Debug, Clone)]
pub struct Gain {
    gain: f64,
    limits: Limits,
}

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Parameters)]
pub struct GainParameters {
    /// Factor of the signal.
    #[param(unit = "", default = 1.0)]
    pub gain: f64,
    /// Smallest result.
    #[param(unit = "")]
    pub low: Option<f64>,
    /// Largest result.
    #[param(unit = "")]
    pub high: Option<f64>,
}

impl Element for Gain {
    const NAME: &'static str = "gain";
    const SUMMARY: &'static str = "signal times a constant, with limits";
    const DOC: &'static str = doc_of(include_str!("gain.rs"));
    const FRAMES: &'static [FrameSpec] = &[];
    type Parameters = GainParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        Ok(Self { gain: p.gain, limits: Limits::new(p.low, p.high)? })
    }
}

impl Control for Gain {
    const INPUTS: &'static [InputSpec] = &[InputSpec::required("input", "", "the signal")];
    const OUTPUTS: &'static [ChannelSpec] = &[ChannelSpec::new("output", "", "the signal, multiplied and limited")];

    fn outputs<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        // (1)
        out.push(self.limits.apply(at.inputs[0] * self.gain));
    }
}
