//! A linear system with one input and one output, given by its matrices: a controller from a design program, an observer, a
//! reduced model of a plant.
//!
//! ## Equations
//! ```text
//! x' = A x + b u,   x(0) = initial                                          (1)
//! y = c . x + d u                                                           (2)
//! ```
//! (Kailath, Linear Systems, 1980, ch. 2). A is given row after row; its size n is the length of b.
//!
//! ## Signs
//! None of its own. Coefficients are in SI units.
//!
//! ## Singular cases
//! None. With d other than zero the input acts on the output at once; loops of such elements can't be solved. Eigenvalues
//! of A with a positive real part grow without bounds.
//!
//! ## Example
//! ```toml
//! title = "An oscillator as a signal"
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
//! name = "oscillator"
//! type = "state-space"
//! inputs = { input = 0.0 }
//! params.a = [0.0, 50.0, -50.0, 0.0]
//! params.b = [0.0, 1.0]
//! params.c = [1.0, 0.0]
//! params.initial = [1.0, 0.0]
//!
//! [[output]]
//! name = "wave"
//! quantity = "value"
//! of = "oscillator"
//! channel = "output"
//! ```

use element_api::prelude::*;

/// The element.
#[derive(Debug, Clone)]
pub struct StateSpace {
    a: Vec<f64>,
    b: Vec<f64>,
    c: Vec<f64>,
    d: f64,
    initial: Vec<f64>,
}

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Parameters)]
pub struct StateSpaceParameters {
    /// Matrix A, row after row, n times n numbers.
    #[param(unit = "")]
    pub a: Vec<f64>,
    /// Vector b, n numbers.
    #[param(unit = "")]
    pub b: Vec<f64>,
    /// Vector c, n numbers.
    #[param(unit = "")]
    pub c: Vec<f64>,
    /// Factor of the input in the output.
    #[param(unit = "", default = 0.0)]
    pub d: f64,
    /// States at the start, n numbers; left out: zero.
    #[param(unit = "")]
    pub initial: Option<Vec<f64>>,
}

impl Element for StateSpace {
    const NAME: &'static str = "state-space";
    const SUMMARY: &'static str = "linear system by its matrices";
    const DOC: &'static str = doc_of(include_str!("state_space.rs"));
    const FRAMES: &'static [FrameSpec] = &[];
    type Parameters = StateSpaceParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        let n = p.b.len();
        if n == 0 {
            return Err(ParamError::new("b", "needs at least one number"));
        }
        let initial = p.initial.unwrap_or_else(|| vec![0.0; n]);
        for (name, found, needed) in [("a", p.a.len(), n * n), ("c", p.c.len(), n), ("initial", initial.len(), n)] {
            if found != needed {
                let message = format!("needs {needed} numbers, since `b` has {n}; it has {found}");
                return Err(ParamError::new(name, message));
            }
        }
        Ok(Self { a: p.a, b: p.b, c: p.c, d: p.d, initial })
    }
}

/// weights . x + weight u, without the terms that are zero.
fn combined<S: Scalar>(weights: &[f64], weight: f64, at: &Motion<'_, S>) -> S {
    let terms = weights.iter().zip(at.states).filter(|(weight, _)| **weight != 0.0);
    let start = if weight == 0.0 { S::zero() } else { at.inputs[0] * weight };
    terms.fold(start, |sum, (weight, x)| sum + *x * *weight)
}

impl Control for StateSpace {
    const INPUTS: &'static [InputSpec] = &[InputSpec::required("input", "", "the signal u")];
    const OUTPUTS: &'static [ChannelSpec] = &[ChannelSpec::new("output", "", "the answer y")];

    fn outputs<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        // (2)
        out.push(combined(&self.c, self.d, at));
    }

    fn initial_states(&self) -> Vec<f64> {
        self.initial.clone()
    }

    fn rates<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        // (1)
        for (row, weight) in self.a.chunks(self.b.len()).zip(&self.b) {
            out.push(combined(row, *weight, at));
        }
    }
}
