//! A filter in a computer, given by its difference equation: a low-pass, a notch, a mean over some samples, a controller designed in
//! discrete time, a transport delay.
//!
//! ## Equations
//!
//! At the start and at every whole multiple t = k T behind it, u_k is the input:
//!
//! ```text
//! a_0 y_k = b_0 u_k + b_1 u_(k-1) + ... - a_1 y_(k-1) - a_2 y_(k-2) - ...   (1)
//! H(z) = (b_0 + b_1 z^-1 + ...) / (a_0 + a_1 z^-1 + ...)                    (2)
//! output = y_(k-d),   d = delay / T                                         (3)
//! ```
//!
//! and the output is held until the next sample. (1) is computed in the transposed direct form II, with as many numbers as the longer
//! list needs. Before the start, the input was `initial_input` for so long that the filter had settled: y = H(1) times that.
//!
//! Source: Oppenheim & Schafer, Discrete-Time Signal Processing, 3rd ed. (2010), section 6.3.
//!
//! ## Signs
//!
//! Coefficients have the newest sample first, as in `scipy.signal.lfilter` and MATLAB's `filter`.
//!
//! ## Singular cases
//!
//! Poles outside of the unit circle grow without bounds. A filter that adds up (the a_i sum up to zero) settles at nothing: its
//! `initial_input` is zero. An input from an element that samples at the same time is what that held before: of filters and
//! controllers in a row, each adds a period of delay. After a start at no multiple of T the second sample follows sooner than a
//! period, and counts as one. A row of results at the very time of a sample has the output that was held until then, but for that
//! at the start. Steps end at every sample: a period that is short beside the motion decides the run time.
//!
//! ## Example
//!
//! ```toml
//! title = "A signal that arrives 20 ms later"
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
//! name = "line"
//! type = "digital-filter"
//! inputs = { input = "wave.output" }
//! params.period = "1 ms"
//! params.numerator = [1]
//! params.delay = "20 ms"
//!
//! [[output]]
//! name = "later"
//! quantity = "value"
//! of = "line"
//! channel = "output"
//! ```

use element_api::prelude::*;

/// The largest part of a period by which a delay may miss a whole number of them.
const ROUND_OFF: f64 = 1e-6;
/// Samples that may be on their way: each takes a place in the memory, and the program that moves it.
const MOST_ON_THEIR_WAY: f64 = 10_000.0;

/// The element.
#[derive(Debug, Clone)]
pub struct DigitalFilter {
    period: f64,
    /// b_k / a_0 and a_k / a_0, equally many.
    b: Vec<f64>,
    a: Vec<f64>,
    /// d of (3).
    late: usize,
    initial_input: f64,
}

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Parameters)]
pub struct DigitalFilterParameters {
    /// Time from sample to sample, T.
    #[param(unit = "s", above = 0.0)]
    pub period: f64,
    /// Coefficients b_0, b_1, ..., newest sample first.
    #[param(unit = "")]
    pub numerator: Vec<f64>,
    /// Coefficients a_0, a_1, ..., newest sample first; left out: 1.
    #[param(unit = "")]
    pub denominator: Option<Vec<f64>>,
    /// How much later what is computed goes out: a whole number of periods.
    #[param(unit = "s", default = 0.0, min = 0.0)]
    pub delay: f64,
    /// Input before the start, to which the filter has settled.
    #[param(unit = "", default = 0.0)]
    pub initial_input: f64,
}

impl Element for DigitalFilter {
    const NAME: &'static str = "digital-filter";
    const SUMMARY: &'static str = "filter or delay that samples with a period and holds its output";
    const DOC: &'static str = doc_of(include_str!("digital_filter.rs"));
    const FRAMES: &'static [FrameSpec] = &[];
    type Parameters = DigitalFilterParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        let (mut b, mut a) = (p.numerator, p.denominator.unwrap_or_else(|| vec![1.0]));
        if b.is_empty() {
            return Err(ParamError::new("numerator", "needs at least one coefficient"));
        }
        let Some(leading) = a.first().copied().filter(|leading| *leading != 0.0) else {
            return Err(ParamError::new("denominator", "needs a first coefficient that is not zero"));
        };
        let late = (p.delay / p.period).round();
        if (p.delay / p.period - late).abs() > ROUND_OFF {
            let message =
                format!("must be a whole number of periods of {} s; it is {} of them", p.period, p.delay / p.period);
            return Err(ParamError::new("delay", message));
        }
        if late > MOST_ON_THEIR_WAY {
            let message =
                format!("must be at most {MOST_ON_THEIR_WAY} periods; it is {late} of them: choose a longer period");
            return Err(ParamError::new("delay", message));
        }
        let length = b.len().max(a.len());
        for list in [&mut b, &mut a] {
            list.resize(length, 0.0);
            list.iter_mut().for_each(|value| *value /= leading);
        }
        let filter = Self { period: p.period, b, a, late: late as usize, initial_input: p.initial_input };
        if p.initial_input != 0.0 && !filter.settled().is_finite() {
            let message = "must be zero: a filter whose denominator sums up to zero settles at nothing";
            return Err(ParamError::new("initial_input", message));
        }
        Ok(filter)
    }
}

impl DigitalFilter {
    /// What comes out where the input has always been [`DigitalFilter::initial_input`].
    fn settled(&self) -> f64 {
        if self.initial_input == 0.0 {
            return 0.0;
        }
        self.initial_input * self.b.iter().sum::<f64>() / self.a.iter().sum::<f64>()
    }
}

impl Control for DigitalFilter {
    const INPUTS: &'static [InputSpec] = &[InputSpec::required("input", "", "the signal that is sampled")];
    const OUTPUTS: &'static [ChannelSpec] = &[ChannelSpec::new("output", "", "the answer, held between samples")];

    fn outputs<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push(at.memory[0]);
    }

    /// The output; what goes out later, next first; sums of (1) that are still to be completed.
    fn initial_memory(&self) -> Vec<f64> {
        let (u, y) = (self.initial_input, self.settled());
        let mut memory = vec![y; 1 + self.late];
        let left = |k: usize| -> f64 { self.b[k..].iter().zip(&self.a[k..]).map(|(b, a)| b * u - a * y).sum() };
        memory.extend((1..self.b.len()).map(left));
        memory
    }

    fn sample_period(&self) -> Option<f64> {
        Some(self.period)
    }

    fn next_memory<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let (on_their_way, sums) = at.memory[1..].split_at(self.late);
        let u = at.inputs[0];
        let y = sums.first().map_or(u * self.b[0], |sum| u * self.b[0] + *sum);
        out.push(on_their_way.first().copied().unwrap_or(y));
        on_their_way.iter().skip(1).for_each(|later| out.push(*later));
        if self.late > 0 {
            out.push(y);
        }
        for k in 1..self.b.len() {
            let sum = u * self.b[k] - y * self.a[k];
            out.push(sums.get(k).map_or(sum, |next| sum + *next));
        }
    }
}
