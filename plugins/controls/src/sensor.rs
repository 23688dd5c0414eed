//! A measuring device: takes any channel of a joint, force or control element or any output of the scene, scales and
//! shifts it, answers with a lag of first order, and saturates at the ends of its range.
//!
//! ## Equations
//! ```text
//! m = gain u + offset                                                       (1)
//! T s' = m - s,   s(0) = initial         with a time constant T > 0         (2)
//! y = min(max(s, low), high)             (s = m without a time constant)    (3)
//! ```
//! (2) is the lag of first order, G(s) = 1 / (T s + 1); for a step it reaches 63 % after T (Åström & Murray, Feedback
//! Systems, 2nd ed. 2021, ch. 9). A limit that is not given does not act.
//!
//! ## Signs
//! A positive gain keeps the sign of what is measured. The range (3) and `initial` are those of the reading y, not of the
//! measured u.
//!
//! ## Singular cases
//! None. At the ends of the range the reading has a kink. With a time constant the reading at the start is `initial`, not
//! the measured value.
//!
//! ## Example
//! ```toml
//! title = "A thermometer-like lag: a step read with a time constant of 20 ms"
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
//! name = "meter"
//! type = "sensor"
//! inputs = { input = 5.0 }
//! params.gain = 2.0
//! params.time_constant = "20 ms"
//!
//! [[output]]
//! name = "reading"
//! quantity = "value"
//! of = "meter"
//! channel = "output"
//! ```

use element_api::prelude::*;

use crate::Limits;

/// The element.
#[derive(Debug, Clone)]
pub struct Sensor {
    gain: f64,
    offset: f64,
    time_constant: f64,
    initial: f64,
    limits: Limits,
}

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Parameters)]
pub struct SensorParameters {
    /// Factor of the measured value.
    #[param(unit = "", default = 1.0)]
    pub gain: f64,
    /// Added after the factor.
    #[param(unit = "", default = 0.0)]
    pub offset: f64,
    /// Time constant of the lag; 0: none.
    #[param(unit = "s", default = 0.0, min = 0.0)]
    pub time_constant: f64,
    /// Reading at the start; used with a time constant only.
    #[param(unit = "", default = 0.0)]
    pub initial: f64,
    /// Lower end of the range.
    #[param(unit = "")]
    pub low: Option<f64>,
    /// Upper end of the range.
    #[param(unit = "")]
    pub high: Option<f64>,
}

impl Element for Sensor {
    const NAME: &'static str = "sensor";
    const SUMMARY: &'static str = "measured value with gain, offset, lag and range";
    const DOC: &'static str = doc_of(include_str!("sensor.rs"));
    const FRAMES: &'static [FrameSpec] = &[];
    type Parameters = SensorParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        let limits = Limits::new(p.low, p.high)?;
        Ok(Self { gain: p.gain, offset: p.offset, time_constant: p.time_constant, initial: p.initial, limits })
    }
}

impl Sensor {
    /// (1)
    fn measured<S: Scalar>(&self, at: &Motion<'_, S>) -> S {
        at.inputs[0] * self.gain + self.offset
    }
}

impl Control for Sensor {
    const INPUTS: &'static [InputSpec] = &[InputSpec::required("input", "", "what is measured")];
    const OUTPUTS: &'static [ChannelSpec] = &[ChannelSpec::new("output", "", "the reading")];
    const STATES: &'static [ChannelSpec] = &[ChannelSpec::new("reading", "", "reading before the range is applied")];

    fn outputs<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let reading = if self.time_constant > 0.0 { at.states[0] } else { self.measured(at) };
        // (3)
        out.push(self.limits.apply(reading));
    }

    fn initial_states(&self) -> Vec<f64> {
        if self.time_constant > 0.0 { vec![self.initial] } else { Vec::new() }
    }

    fn rates<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        if self.time_constant > 0.0 {
            // (2)
            out.push((self.measured(at) - at.states[0]) / self.time_constant);
        }
    }
}
