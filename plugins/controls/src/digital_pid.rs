//! A PID controller in a computer: it measures at whole multiples of its period, computes, and holds its output until the next time.
//!
//! ## Equations
//!
//! At the start and at every whole multiple t = k T behind it, with e = set point - measured and the output u limited:
//!
//! ```text
//! I_k = I_(k-1) + k_i T e_k                                                 (1)
//! v_k = k_p e_k + I_k + k_d (e_k - e_(k-1)) / T + feed forward              (2)
//! u_k = min(max(v_k, low), high)                                            (3)
//! ```
//!
//! Where v_k is beyond a limit and k_i e_k drives it further, I_k stays I_(k-1), and (2) and (3) hold with that (clamping); the
//! derivative is zero at the first sample.
//! With `delay`, what is computed at one sample goes out at the next, as in a controller that needs its period to compute.
//!
//! Source: Astrom & Wittenmark, Computer-Controlled Systems (1997), section 8.5.
//!
//! ## Signs
//!
//! Positive gains drive the measured value towards the set point if a larger output makes it larger.
//!
//! ## Singular cases
//!
//! After a start at no multiple of T the second sample follows sooner than a period, and counts as one. A row of results at the
//! very time of a sample has the output that was held until then, but for that at the start. A function of time that jumps at a
//! sampling instant is sampled after the jump; an input from an element that samples at the same time is what that held before,
//! so that of filters and controllers in a row each adds a period of delay. Steps end at every sample: a period that is short
//! beside the motion decides the run time.
//!
//! ## Example
//!
//! ```toml
//! title = "A digital controller holds a level"
//!
//! [plugins]
//! libraries = ["odyn-controls"]
//!
//! [simulation]
//! t_end = 1
//! output_step = 0.05
//!
//! [[body]]
//! name = "bystander"
//! mass = 1.0
//! inertia = [1.0, 1.0, 1.0]
//!
//! [[control]]
//! name = "level"
//! type = "integral"
//! inputs = { input = "controller.output" }
//!
//! [[control]]
//! name = "wanted"
//! type = "signal-source"
//! params.function = "1"
//!
//! [[control]]
//! name = "controller"
//! type = "digital-pid"
//! inputs = { set_point = "wanted.output", measured = "level.output" }
//! params.period = "0.1 s"
//! params.kp = 4.0
//!
//! [[output]]
//! name = "level"
//! quantity = "value"
//! of = "level"
//! channel = "output"
//! ```

use element_api::prelude::*;

use crate::Limits;

/// The element.
#[derive(Debug, Clone)]
pub struct DigitalPid {
    p: DigitalPidParameters,
    limits: Limits,
}

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Parameters)]
pub struct DigitalPidParameters {
    /// Time from sample to sample, T.
    #[param(unit = "s", above = 0.0)]
    pub period: f64,
    /// Output per error.
    #[param(unit = "", default = 0.0)]
    pub kp: f64,
    /// Rate of the output per error, kp / T_i.
    #[param(unit = "", default = 0.0)]
    pub ki: f64,
    /// Output per rate of the error, kp T_d.
    #[param(unit = "", default = 0.0)]
    pub kd: f64,
    /// Smallest output.
    #[param(unit = "")]
    pub low: Option<f64>,
    /// Largest output.
    #[param(unit = "")]
    pub high: Option<f64>,
    /// Whether what is computed at a sample goes out at the next one.
    #[param(default = false)]
    pub delay: bool,
    /// Integral part before the first sample.
    #[param(unit = "", default = 0.0)]
    pub initial_integral: f64,
}

impl Element for DigitalPid {
    const NAME: &'static str = "digital-pid";
    const SUMMARY: &'static str = "PID controller that samples with a period and holds its output";
    const DOC: &'static str = doc_of(include_str!("digital_pid.rs"));
    const FRAMES: &'static [FrameSpec] = &[];
    type Parameters = DigitalPidParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        let limits = Limits::new(p.low, p.high)?;
        Ok(Self { p, limits })
    }
}

/// Places in the memory.
const OUTPUT: usize = 0;
const COMPUTED: usize = 1;
const INTEGRAL: usize = 2;
const ERROR: usize = 3;
const SAMPLED: usize = 4;

impl Control for DigitalPid {
    const INPUTS: &'static [InputSpec] = &[
        InputSpec::required("set_point", "", "what the measured value is to be"),
        InputSpec::optional("measured", "", 0.0, "the measured value"),
        InputSpec::optional("feed_forward", "", 0.0, "added to the output before it is limited"),
    ];
    const OUTPUTS: &'static [ChannelSpec] = &[
        ChannelSpec::new("output", "", "the limited output, held between samples"),
        ChannelSpec::new("error", "", "set point minus measured value at the last sample"),
    ];

    fn outputs<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push(at.memory[OUTPUT]);
        out.push(at.memory[ERROR]);
    }

    fn initial_memory(&self) -> Vec<f64> {
        vec![0.0, 0.0, self.p.initial_integral, 0.0, 0.0]
    }

    fn sample_period(&self) -> Option<f64> {
        Some(self.p.period)
    }

    fn next_memory<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let p = &self.p;
        let error = at.inputs[0] - at.inputs[1];
        let change = (error - at.memory[ERROR]) * at.memory[SAMPLED];
        let step = error * (p.ki * p.period);
        let integral = at.memory[INTEGRAL] + step;
        let unlimited = error * p.kp + integral + change * (p.kd / p.period) + at.inputs[2];
        let limited = self.limits.apply(unlimited);
        // Beyond a limit and driven further: (v - u) and the step have the same sign.
        let driven = (unlimited - limited) * step;
        let integral = S::select(S::zero(), driven, at.memory[INTEGRAL], integral);
        // With the integral held, (2) is asked once more.
        let held = error * p.kp + integral + change * (p.kd / p.period) + at.inputs[2];
        let computed = self.limits.apply(held);
        out.push(if p.delay { at.memory[COMPUTED] } else { computed });
        out.push(computed);
        out.push(integral);
        out.push(error);
        out.push(S::one());
    }
}
