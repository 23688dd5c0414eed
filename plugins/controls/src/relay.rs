//! A relay: a switch with hysteresis, for thermostats, two-position valves, on-off controllers.
//!
//! ## Equations
//!
//! The relay is on or off, and stays as it is between its bounds:
//!
//! ```text
//! off -> on   where input > upper                                           (1)
//! on -> off   where input < lower                                           (2)
//! output = on where it is on, off otherwise                                 (3)
//! ```
//!
//! Steps end where it switches, at the instant at which the input comes to the bound. A relay that begins beyond a bound switches at the
//! start.
//!
//! Source: Gelb & Vander Velde, Multiple-Input Describing Functions and Nonlinear System Design (1968), section 2.3.
//!
//! ## Signs
//!
//! A relay that is to heat below a temperature has the larger output where it is off: `on = 0`, `off = 1`.
//!
//! ## Singular cases
//!
//! The bounds must be apart: with one bound, an output that drives its own input back would switch without end. A relay with a dead zone
//! between three outputs is the sum of two. A row of results at the very time of a switch has the output from before.
//!
//! ## Example
//!
//! ```toml
//! title = "A heater holds a temperature between two bounds"
//!
//! [plugins]
//! libraries = ["odyn-controls"]
//!
//! [simulation]
//! t_end = 10
//! output_step = 0.05
//!
//! [[body]]
//! name = "bystander"
//! mass = 1.0
//! inertia = [1.0, 1.0, 1.0]
//!
//! [[control]]
//! name = "temperature"
//! type = "transfer-function"
//! inputs = { input = "heater.output" }
//! params.numerator = [1]
//! params.denominator = [1, 1]
//!
//! [[control]]
//! name = "heater"
//! type = "relay"
//! inputs = { input = "temperature.output" }
//! params.lower = 19.0
//! params.upper = 21.0
//! params.on = 10.0
//! params.off = 30.0
//!
//! [[output]]
//! name = "temperature"
//! quantity = "value"
//! of = "temperature"
//! channel = "output"
//! ```

use element_api::prelude::*;

/// The element.
#[derive(Debug, Clone)]
pub struct Relay(RelayParameters);

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Parameters)]
pub struct RelayParameters {
    /// It switches off where the input falls below this.
    #[param(unit = "", example = -0.5)]
    pub lower: f64,
    /// It switches on where the input rises above this.
    #[param(unit = "", example = 0.5)]
    pub upper: f64,
    /// Output where it is on.
    #[param(unit = "", default = 1.0)]
    pub on: f64,
    /// Output where it is off.
    #[param(unit = "", default = 0.0)]
    pub off: f64,
    /// Whether it is on before the start.
    #[param(default = false)]
    pub initially_on: bool,
}

impl Element for Relay {
    const NAME: &'static str = "relay";
    const SUMMARY: &'static str = "switch with hysteresis: a thermostat, an on-off controller";
    const DOC: &'static str = doc_of(include_str!("relay.rs"));
    const FRAMES: &'static [FrameSpec] = &[];
    type Parameters = RelayParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        if p.lower >= p.upper {
            let message = format!("must be larger than `lower`, {}; it is {}", p.lower, p.upper);
            return Err(ParamError::new("upper", message));
        }
        Ok(Self(p))
    }
}

impl Control for Relay {
    const INPUTS: &'static [InputSpec] = &[InputSpec::required("input", "", "the signal that it watches")];
    const OUTPUTS: &'static [ChannelSpec] = &[ChannelSpec::new("output", "", "one of two values")];

    fn outputs<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let is_on = at.memory[0].above(0.5);
        out.push(select(is_on, S::from(self.0.on), S::from(self.0.off)));
    }

    fn initial_memory(&self) -> Vec<f64> {
        vec![f64::from(u8::from(self.0.initially_on))]
    }

    /// One where it is on, zero where it is off. At a bound itself it stays as it is.
    fn next_memory<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let (input, is_on) = (at.inputs[0], at.memory[0]);
        let beyond = select(is_on.above(0.5), -input + self.0.lower, input - self.0.upper);
        out.push(select(beyond.above(0.0), S::one() - is_on, is_on));
    }
}
