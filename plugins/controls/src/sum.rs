//! Adds up to four signals, each with its own factor: a comparison of set point and measurement, a feed-forward, a mean.
//!
//! ## Equations
//! ```text
//! y = gain_a a + gain_b b + gain_c c + gain_d d                             (1)
//! ```
//!
//! ## Signs
//! All factors are 1 unless given; a difference a - b has `gain_b = -1`. Inputs that are not connected are zero.
//!
//! ## Singular cases
//! None.
//!
//! ## Example
//! ```toml
//! title = "Difference of two signals"
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
//! name = "ramp"
//! type = "signal-source"
//! params.function = "3 t"
//!
//! [[control]]
//! name = "error"
//! type = "sum"
//! inputs = { a = 1.0, b = "ramp.output" }
//! params.gain_b = -1.0
//!
//! [[output]]
//! name = "error"
//! quantity = "value"
//! of = "error"
//! channel = "output"
//! ```

use element_api::prelude::*;

/// The element.
#[derive(Debug, Clone)]
pub struct Sum {
    gains: [f64; 4],
}

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Parameters)]
pub struct SumParameters {
    /// Factor of a.
    #[param(unit = "", default = 1.0)]
    pub gain_a: f64,
    /// Factor of b.
    #[param(unit = "", default = 1.0)]
    pub gain_b: f64,
    /// Factor of c.
    #[param(unit = "", default = 1.0)]
    pub gain_c: f64,
    /// Factor of d.
    #[param(unit = "", default = 1.0)]
    pub gain_d: f64,
}

impl Element for Sum {
    const NAME: &'static str = "sum";
    const SUMMARY: &'static str = "sum of up to four signals with factors";
    const DOC: &'static str = doc_of(include_str!("sum.rs"));
    const FRAMES: &'static [FrameSpec] = &[];
    type Parameters = SumParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        Ok(Self { gains: [p.gain_a, p.gain_b, p.gain_c, p.gain_d] })
    }
}

impl Control for Sum {
    const INPUTS: &'static [InputSpec] = &[
        InputSpec::optional("a", "", 0.0, "first signal"),
        InputSpec::optional("b", "", 0.0, "second signal"),
        InputSpec::optional("c", "", 0.0, "third signal"),
        InputSpec::optional("d", "", 0.0, "fourth signal"),
    ];
    const OUTPUTS: &'static [ChannelSpec] = &[ChannelSpec::new("output", "", "the sum")];

    fn outputs<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let mut sum = S::zero();
        for (signal, gain) in at.inputs.iter().zip(self.gains) {
            // (1)
            sum += *signal * gain;
        }
        out.push(sum);
    }
}
