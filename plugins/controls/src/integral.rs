//! Adds a signal up over time, optionally between two limits at which it stops and from which it leaves as soon as the
//! signal turns.
//!
//! ## Equations
//! ```text
//! x' = gain u,   x(0) = initial                                             (1)
//! x' = min(gain u, 0)   where x >= high                                     (2)
//! x' = max(gain u, 0)   where x <= low                                      (3)
//! y = min(max(x, low), high)                                                (4)
//! ```
//! (2) and (3) are the limited integrator: it does not wind up beyond its limits. A limit that is not given does not act.
//!
//! ## Signs
//! A positive gain makes the output grow with a positive signal.
//!
//! ## Singular cases
//! None. At the limits the rate jumps; step control finds the place, which costs some steps. The state may overshoot by
//! the tolerance of the integration, the output (4) does not.
//!
//! ## Example
//! ```toml
//! title = "A tank that is full"
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
//! name = "tank"
//! type = "integral"
//! inputs = { input = 20.0 }
//! params.high = 1.0
//!
//! [[output]]
//! name = "level"
//! quantity = "value"
//! of = "tank"
//! channel = "output"
//! ```

use element_api::prelude::*;

use crate::Limits;

/// The element.
#[derive(Debug, Clone)]
pub struct Integral {
    gain: f64,
    initial: f64,
    limits: Limits,
}

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Parameters)]
pub struct IntegralParameters {
    /// Factor of the signal.
    #[param(unit = "", default = 1.0)]
    pub gain: f64,
    /// Output at the start.
    #[param(unit = "", default = 0.0)]
    pub initial: f64,
    /// Smallest output.
    #[param(unit = "")]
    pub low: Option<f64>,
    /// Largest output.
    #[param(unit = "")]
    pub high: Option<f64>,
}

impl Element for Integral {
    const NAME: &'static str = "integral";
    const SUMMARY: &'static str = "integral of a signal over time, with limits";
    const DOC: &'static str = doc_of(include_str!("integral.rs"));
    const FRAMES: &'static [FrameSpec] = &[];
    type Parameters = IntegralParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        let limits = Limits::new(p.low, p.high)?;
        if !limits.contain(p.initial) {
            return Err(ParamError::new("initial", "must lie between `low` and `high`"));
        }
        Ok(Self { gain: p.gain, initial: p.initial, limits })
    }
}

impl Control for Integral {
    const INPUTS: &'static [InputSpec] = &[InputSpec::required("input", "", "the signal")];
    const OUTPUTS: &'static [ChannelSpec] = &[ChannelSpec::new("output", "", "the integral")];
    const STATES: &'static [ChannelSpec] = &[ChannelSpec::new("integral", "", "the integral")];

    fn outputs<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        // (4)
        out.push(self.limits.apply(at.states[0]));
    }

    fn initial_states(&self) -> Vec<f64> {
        vec![self.initial]
    }

    fn rates<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        // (1)
        let (x, mut rate) = (at.states[0], at.inputs[0] * self.gain);
        if let Some(high) = self.limits.high {
            // (2)
            rate = S::select(x, S::from(high), rate, rate.min(S::zero()));
        }
        if let Some(low) = self.limits.low {
            // (3)
            rate = S::select(S::from(low), x, rate, rate.max(S::zero()));
        }
        out.push(rate);
    }
}
