//! A linear system with one input and one output, given as a ratio of polynomials: a filter, an actuator's lag, a lead-lag
//! controller, a plant.
//!
//! ## Equations
//! ```text
//! G(s) = (b_n s^n + ... + b_0) / (a_n s^n + ... + a_0),   a_n not 0         (1)
//! ```
//! as states in controllable canonical form (Kailath, Linear Systems, 1980, ch. 2), in the time sigma t with a rate
//! sigma that brings the states to about the size of the input:
//! ```text
//! c_k = a_k sigma^(k-n) / a_n,   d_k = b_k sigma^(k-n) / a_n                (2)
//! x_k' = sigma x_(k+1)                               k = 1 .. n-1           (3)
//! x_n' = sigma (u - c_0 x_1 - ... - c_(n-1) x_n)                            (4)
//! y = (d_0 - c_0 d_n) x_1 + ... + (d_(n-1) - c_(n-1) d_n) x_n + d_n u       (5)
//! ```
//! All states are zero at the start. sigma = |a_m / a_n|^(1/(n-m)) with the lowest power m < n whose a_m is not zero, 1
//! where there is none; it has no influence on y.
//!
//! ## Signs
//! Coefficients have the highest power first: `denominator = [1, 2, 5]` is s^2 + 2 s + 5, with s in 1/s.
//!
//! ## Singular cases
//! The numerator must not have more powers than the denominator (a derivative of the input). With equally many, the input
//! acts on the output at once; loops of such elements can't be solved. Poles with a positive real part grow without bounds.
//!
//! ## Example
//! ```toml
//! title = "Step response of a filter of second order"
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
//! name = "filter"
//! type = "transfer-function"
//! inputs = { input = 1.0 }
//! params.numerator = [1.0e4]
//! params.denominator = [1.0, 100.0, 1.0e4]
//!
//! [[output]]
//! name = "filtered"
//! quantity = "value"
//! of = "filter"
//! channel = "output"
//! ```

use element_api::prelude::*;

/// The element.
#[derive(Debug, Clone)]
pub struct TransferFunction {
    /// sigma, 1/s.
    rate: f64,
    /// c_0 .. c_(n-1) of (2).
    feedback: Vec<f64>,
    /// Factors of the states in (5).
    output: Vec<f64>,
    /// d_n.
    direct: f64,
}

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Parameters)]
pub struct TransferFunctionParameters {
    /// Coefficients b_n .. b_0, highest power first.
    #[param(unit = "")]
    pub numerator: Vec<f64>,
    /// Coefficients a_n .. a_0, highest power first.
    #[param(unit = "")]
    pub denominator: Vec<f64>,
}

impl Element for TransferFunction {
    const NAME: &'static str = "transfer-function";
    const SUMMARY: &'static str = "linear system as a ratio of polynomials";
    const DOC: &'static str = doc_of(include_str!("transfer_function.rs"));
    const FRAMES: &'static [FrameSpec] = &[];
    type Parameters = TransferFunctionParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        if p.numerator.is_empty() {
            return Err(ParamError::new("numerator", "needs at least one coefficient"));
        }
        // Lowest power first from here on.
        let a: Vec<f64> = p.denominator.iter().rev().copied().collect();
        let mut b: Vec<f64> = p.numerator.iter().rev().copied().collect();
        let Some(leading) = a.last().copied().filter(|leading| *leading != 0.0) else {
            return Err(ParamError::new("denominator", "needs a first coefficient that is not zero"));
        };
        let n = a.len() - 1;
        if b.iter().rposition(|b| *b != 0.0).is_some_and(|degree| degree > n) {
            return Err(ParamError::new("numerator", "must not have higher powers than the denominator"));
        }
        b.resize(n + 1, 0.0);
        let lowest = a[..n].iter().position(|a| *a != 0.0);
        let rate = lowest.map_or(1.0, |m| (a[m] / leading).abs().powf(1.0 / (n - m) as f64));
        // (2)
        let scaled = |list: &[f64]| -> Vec<f64> {
            let power = |k: usize| rate.powi(k as i32 - n as i32) / leading;
            list.iter().enumerate().map(|(k, value)| value * power(k)).collect()
        };
        let (mut c, mut d) = (scaled(&a), scaled(&b));
        c.truncate(n);
        let direct = d[n];
        d.truncate(n);
        let output = d.iter().zip(&c).map(|(d, c)| d - c * direct).collect();
        Ok(Self { rate, feedback: c, output, direct })
    }
}

impl Control for TransferFunction {
    const INPUTS: &'static [InputSpec] = &[InputSpec::required("input", "", "the signal")];
    const OUTPUTS: &'static [ChannelSpec] = &[ChannelSpec::new("output", "", "the answer")];

    fn outputs<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        // (5)
        let start = if self.direct == 0.0 { S::zero() } else { at.inputs[0] * self.direct };
        let terms = at.states.iter().zip(&self.output).filter(|(_, factor)| **factor != 0.0);
        out.push(terms.fold(start, |sum, (x, factor)| sum + *x * *factor));
    }

    fn initial_states(&self) -> Vec<f64> {
        vec![0.0; self.feedback.len()]
    }

    fn rates<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        if at.states.is_empty() {
            return;
        }
        // (3)
        for x in &at.states[1..] {
            out.push(*x * self.rate);
        }
        // (4)
        let mut last = at.inputs[0];
        for (x, c) in at.states.iter().zip(&self.feedback) {
            last -= *x * *c;
        }
        out.push(last * self.rate);
    }
}
