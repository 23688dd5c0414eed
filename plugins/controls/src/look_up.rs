//! A characteristic curve: the output is a function of the input, given by points, an expression or a number.
//!
//! ## Equations
//! ```text
//! y = f(x)                                                                  (1)
//! ```
//! f is given by points, or by an expression in x. Between points it is monotone, linear, a spline or made of steps, as
//! `interpolation` says (monotone where it says nothing); beyond them the end values are held, or the range repeats.
//!
//! ## Signs
//! The value is passed on as it is. Argument and value are in SI units.
//!
//! ## Singular cases
//! At the first and last point of a curve whose ends are held, the slope jumps to zero; so does that of `linear` at every
//! point, and the value of `steps`. Expressions that are not finite
//! end the run.
//!
//! ## Example
//! ```toml
//! title = "A valve's characteristic"
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
//! name = "lift"
//! type = "signal-source"
//! params.function = "30 t"
//!
//! [[control]]
//! name = "valve"
//! type = "look-up"
//! inputs = { input = "lift.output" }
//! params.function = [[0, 0], [1, 0.2], [2, 0.9], [3, 1]]
//!
//! [[output]]
//! name = "flow"
//! quantity = "value"
//! of = "valve"
//! channel = "output"
//! ```

use element_api::prelude::*;

/// The element.
#[derive(Debug, Clone)]
pub struct LookUp {
    function: Function,
}

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Parameters)]
pub struct LookUpParameters {
    /// Output over input, both in SI units.
    #[param(unit = "1 -> 1", variable = "x")]
    pub function: Function,
}

impl Element for LookUp {
    const NAME: &'static str = "look-up";
    const SUMMARY: &'static str = "signal as a function of a signal, by points or expression";
    const DOC: &'static str = doc_of(include_str!("look_up.rs"));
    const FRAMES: &'static [FrameSpec] = &[];
    type Parameters = LookUpParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        Ok(Self { function: p.function })
    }
}

impl Control for LookUp {
    const INPUTS: &'static [InputSpec] = &[InputSpec::required("input", "", "argument of the function")];
    const OUTPUTS: &'static [ChannelSpec] = &[ChannelSpec::new("output", "", "value of the function")];

    fn outputs<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        // (1)
        out.push(self.function.at(at.inputs[0]));
    }
}
