//! The controller of most machines: its output is proportional to the error, its integral and its filtered derivative. The
//! output has limits, and the integral is led back while they act, so that it does not wind up.
//!
//! ## Equations
//! ```text
//! e = set_point - measured                                                  (1)
//! T_f d' = e - d,   d(0) = 0                     D = kd (e - d) / T_f       (2)
//! v = kp e + I + D + feed_forward                                           (3)
//! u = min(max(v, low), high)                                                (4)
//! I' = ki e + (u - v) / T_t,   I(0) = initial_integral                      (5)
//! ```
//! (2) is kd s / (T_f s + 1), the derivative behind a lag of first order; the last term of (5) is anti-windup by
//! back-calculation (Åström & Hägglund, Advanced PID Control, 2006, ch. 3). Without `tracking_time` it is the
//! rule given there: T_t = sqrt(T_i T_d) = sqrt(kd / ki) with a derivative part, T_t = T_i = kp / ki without.
//!
//! Parts with a gain of zero are left out together with their states. An integral part at the start stays without `ki`: it is a
//! constant then, without a state, led back at a limit only with `tracking_time`.
//!
//! ## Signs
//! Positive gains drive a plant whose measured value grows with the output. All three gains are negative for the opposite.
//! Gains and limits are in SI units of output per input: a torque for a speed has kp in N m s/rad, ki in N m/rad.
//!
//! ## Singular cases
//! None. Since d starts at zero, an error at the start gives the derivative part a kick of kd e / T_f that dies away with
//! T_f. At the limits the output has a kink.
//!
//! ## Example
//! ```toml
//! title = "A controller whose output saturates"
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
//! name = "plant"
//! type = "transfer-function"
//! inputs = { input = "controller.output" }
//! params.numerator = [1.0]
//! params.denominator = [0.01, 1.0]
//!
//! [[control]]
//! name = "controller"
//! type = "pid"
//! inputs = { set_point = 1.0, measured = "plant.output" }
//! params.kp = 2.0
//! params.ki = 100.0
//! params.low = -1.5
//! params.high = 1.5
//!
//! [[output]]
//! name = "measured"
//! quantity = "value"
//! of = "plant"
//! channel = "output"
//! ```

use element_api::prelude::*;

use crate::Limits;

/// The element.
#[derive(Debug, Clone)]
pub struct Pid {
    kp: f64,
    integral: Option<Integral>,
    /// An integral part that nothing changes.
    bias: f64,
    derivative: Option<Derivative>,
    limits: Limits,
}

#[derive(Debug, Clone, Copy)]
struct Integral {
    gain: f64,
    initial: f64,
    /// 1 / T_t, 1/s; zero without limits.
    tracking_rate: f64,
}

#[derive(Debug, Clone, Copy)]
struct Derivative {
    gain: f64,
    filter_time: f64,
}

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Parameters)]
pub struct PidParameters {
    /// Output per error.
    #[param(unit = "", default = 0.0)]
    pub kp: f64,
    /// Rate of the output per error, kp / T_i.
    #[param(unit = "", default = 0.0)]
    pub ki: f64,
    /// Output per rate of the error, kp T_d.
    #[param(unit = "", default = 0.0)]
    pub kd: f64,
    /// Time constant of the derivative's filter, T_f; needed with `kd`.
    #[param(unit = "s", above = 0.0)]
    pub filter_time: Option<f64>,
    /// Smallest output.
    #[param(unit = "")]
    pub low: Option<f64>,
    /// Largest output.
    #[param(unit = "")]
    pub high: Option<f64>,
    /// Time constant with which the integral is led back at a limit, T_t; left out: from the gains.
    #[param(unit = "s", above = 0.0)]
    pub tracking_time: Option<f64>,
    /// Integral part at the start.
    #[param(unit = "", default = 0.0)]
    pub initial_integral: f64,
}

impl Element for Pid {
    const NAME: &'static str = "pid";
    const SUMMARY: &'static str = "PID controller with limits and anti-windup";
    const DOC: &'static str = doc_of(include_str!("pid.rs"));
    const FRAMES: &'static [FrameSpec] = &[];
    type Parameters = PidParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        let limits = Limits::new(p.low, p.high)?;
        let derivative = match p.filter_time {
            _ if p.kd == 0.0 => None,
            Some(filter_time) => Some(Derivative { gain: p.kd, filter_time }),
            None => return Err(ParamError::new("filter_time", "is missing: a derivative part needs a filter")),
        };
        let is_led_back = limits.exist() && (p.ki != 0.0 || (p.tracking_time.is_some() && p.initial_integral != 0.0));
        let (integral, bias) = if p.ki != 0.0 || is_led_back {
            let tracking_rate = if is_led_back { 1.0 / tracking_time(&p)? } else { 0.0 };
            (Some(Integral { gain: p.ki, initial: p.initial_integral, tracking_rate }), 0.0)
        } else {
            (None, p.initial_integral)
        };
        Ok(Self { kp: p.kp, integral, bias, derivative, limits })
    }
}

/// T_t as given, or by the rule.
fn tracking_time(p: &PidParameters) -> Result<f64, ParamError> {
    let rule = if p.kd == 0.0 { p.kp / p.ki } else { (p.kd / p.ki).sqrt() };
    let time = p.tracking_time.unwrap_or(rule);
    if time > 0.0 {
        return Ok(time);
    }
    Err(ParamError::new(
        "tracking_time",
        "is missing: it can be had from gains of one sign only, from ki and kp, or ki and kd if that is not zero",
    ))
}

/// What (1) to (4) give.
struct Signals<S> {
    error: S,
    unlimited: S,
    output: S,
}

impl Pid {
    /// d of (2), the state after that of the integral.
    fn filtered<S: Scalar>(&self, at: &Motion<'_, S>) -> S {
        at.states[usize::from(self.integral.is_some())]
    }

    fn signals<S: Scalar>(&self, at: &Motion<'_, S>) -> Signals<S> {
        let error = at.inputs[0] - at.inputs[1];
        let mut unlimited = error * self.kp + at.inputs[2];
        if self.integral.is_some() {
            unlimited += at.states[0];
        } else if self.bias != 0.0 {
            unlimited += S::from(self.bias);
        }
        if let Some(derivative) = self.derivative {
            unlimited += (error - self.filtered(at)) * (derivative.gain / derivative.filter_time);
        }
        Signals { error, unlimited, output: self.limits.apply(unlimited) }
    }
}

impl Control for Pid {
    const INPUTS: &'static [InputSpec] = &[
        InputSpec::required("set_point", "", "what the measured value is to be"),
        InputSpec::required("measured", "", "the measured value"),
        InputSpec::optional("feed_forward", "", 0.0, "added to the output before it is limited"),
    ];
    const OUTPUTS: &'static [ChannelSpec] = &[
        ChannelSpec::new("output", "", "the limited output"),
        ChannelSpec::new("error", "", "set point minus measured value"),
        ChannelSpec::new("unlimited", "", "the output before it is limited"),
    ];

    fn outputs<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let Signals { error, unlimited, output } = self.signals(at);
        out.push(output);
        out.push(error);
        out.push(unlimited);
    }

    fn initial_states(&self) -> Vec<f64> {
        let integral = self.integral.map(|integral| integral.initial);
        let filtered = self.derivative.map(|_| 0.0);
        integral.into_iter().chain(filtered).collect()
    }

    fn rates<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let Signals { error, unlimited, output } = self.signals(at);
        if let Some(integral) = self.integral {
            // (5)
            out.push(error * integral.gain + (output - unlimited) * integral.tracking_rate);
        }
        if let Some(derivative) = self.derivative {
            // (2)
            out.push((error - self.filtered(at)) / derivative.filter_time);
        }
    }
}
