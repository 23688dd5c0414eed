//! A signal of its own: a constant, an expression in time, or a curve. A set point that changes, a disturbance, a test
//! signal.
//!
//! ## Equations
//! ```text
//! y = f(t)                                                                  (1)
//! ```
//! f is a number, an expression in t (s), or given by points: between them it is monotone, linear, a spline or made of
//! steps, as `interpolation` says (monotone where it says nothing); beyond them the end values are held, or the range
//! repeats.
//!
//! ## Signs
//! The value is passed on as it is.
//!
//! ## Singular cases
//! None of its own; expressions that are not finite within the run end it. A jump is a point of `steps`; a spline leaves
//! the values of its points near one.
//!
//! ## Example
//! ```toml
//! title = "A test signal"
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
//! params.function = "20 sin(10 pi t)"
//!
//! [[output]]
//! name = "wave"
//! quantity = "value"
//! of = "wave"
//! channel = "output"
//! ```

use element_api::prelude::*;

/// The element.
#[derive(Debug, Clone)]
pub struct SignalSource {
    function: Function,
}

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Parameters)]
pub struct SignalSourceParameters {
    /// The signal over time, in SI units.
    #[param(unit = "s -> 1", variable = "t")]
    pub function: Function,
}

impl Element for SignalSource {
    const NAME: &'static str = "signal-source";
    const SUMMARY: &'static str = "signal as a function of time";
    const DOC: &'static str = doc_of(include_str!("signal_source.rs"));
    const FRAMES: &'static [FrameSpec] = &[];
    type Parameters = SignalSourceParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        Ok(Self { function: p.function })
    }
}

impl Control for SignalSource {
    const OUTPUTS: &'static [ChannelSpec] = &[ChannelSpec::new("output", "", "value of the function")];

    fn outputs<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        // (1)
        out.push(self.function.at(at.time()));
    }
}
