//! Multiplies two signals: a power from torque and speed, a signal that scales another.
//!
//! ## Equations
//! ```text
//! y = gain a b                                                              (1)
//! ```
//!
//! ## Signs
//! Equal signs of a and b give the sign of the gain.
//!
//! ## Singular cases
//! None.
//!
//! ## Example
//! ```toml
//! title = "A wave that grows"
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
//! name = "ramp"
//! type = "signal-source"
//! params.function = "2 t"
//!
//! [[control]]
//! name = "growing"
//! type = "product"
//! inputs = { a = "wave.output", b = "ramp.output" }
//!
//! [[output]]
//! name = "growing"
//! quantity = "value"
//! of = "growing"
//! channel = "output"
//! ```

use element_api::prelude::*;

/// The element.
#[derive(Debug, Clone)]
pub struct Product {
    gain: f64,
}

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Parameters)]
pub struct ProductParameters {
    /// Factor of the product.
    #[param(unit = "", default = 1.0)]
    pub gain: f64,
}

impl Element for Product {
    const NAME: &'static str = "product";
    const SUMMARY: &'static str = "product of two signals";
    const DOC: &'static str = doc_of(include_str!("product.rs"));
    const FRAMES: &'static [FrameSpec] = &[];
    type Parameters = ProductParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        Ok(Self { gain: p.gain })
    }
}

impl Control for Product {
    const INPUTS: &'static [InputSpec] =
        &[InputSpec::required("a", "", "first signal"), InputSpec::required("b", "", "second signal")];
    const OUTPUTS: &'static [ChannelSpec] = &[ChannelSpec::new("output", "", "the product")];

    fn outputs<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        // (1)
        out.push(at.inputs[0] * at.inputs[1] * self.gain);
    }
}
