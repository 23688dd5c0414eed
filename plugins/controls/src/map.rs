//! A map: the output is a function of two inputs, given by values on a grid. An engine's torque over speed and throttle, a
//! pump's flow over pressure and stroke.
//!
//! ## Equations
//! ```text
//! y = f(a, b) = sum over k of g_k(a) h_k(b)                                 (1)
//! ```
//! f goes through the values on the grid and is held outside of it. Between them, `interpolation` says what it is:
//!
//! | `interpolation` | in a cell of the grid |
//! |---|---|
//! | `monotone` | bicubic and smooth, between the values at the four corners |
//! | `linear` | bilinear, with kinks at the edges |
//! | `spline` | bicubic with continuous curvature, natural at the edges of the grid; may leave the values of its points |
//!
//! The factors g_k, h_k are tables (de Boor, A Practical Guide to Splines, 2001, ch. XVII; the coefficients of `monotone` in
//! Bernstein form lie between the corners: Farin, Curves and Surfaces for CAGD, 2002, ch. 16). There are as many as values of
//! b (for `monotone` twice as many), so let b be the input with fewer.
//!
//! ## Signs
//! The value is passed on as it is. Arguments and values are in SI units; in `grid`, numbers may have units, and a file may give them:
//! `params.grid = { file = "engine.csv" }`.
//!
//! ## Singular cases
//! A run that leaves `grid` ends with a warning (ODY0751). Where the inputs leave the grid, slopes jump to zero; those of `linear` jump at every line of the grid.
//!
//! ## Example
//! ```toml
//! title = "Torque of an engine over speed and throttle"
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
//! name = "speed"
//! type = "signal-source"
//! params.function = "100 + 2000 t"
//!
//! [[control]]
//! name = "throttle"
//! type = "signal-source"
//! params.function = 0.7
//!
//! [[control]]
//! name = "engine"
//! type = "map"
//! inputs = { a = "speed.output", b = "throttle.output" }
//! params.grid.x = [100, 200, 300]
//! params.grid.y = [0, 0.5, 1]
//! params.grid.z = [
//!     [-10, 60, 80],
//!     [-15, 75, 110],
//!     [-25, 55, 100],
//! ]
//!
//! [[output]]
//! name = "torque"
//! quantity = "value"
//! of = "engine"
//! channel = "output"
//! ```

use element_api::prelude::*;

/// The element.
#[derive(Debug, Clone)]
pub struct Map {
    surface: Surface,
}

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Parameters)]
pub struct MapParameters {
    /// The function on a grid: x is the first input, y the second. Numbers without units are in SI. Or `a`, `b` and `values`.
    #[param(unit = "")]
    pub grid: Option<Surface>,
    /// Values of the first input at which the grid has lines, increasing, in SI units.
    #[param(unit = "1", example = vec![0.0, 1.0])]
    pub a: Option<Vec<f64>>,
    /// Values of the second input at which the grid has lines, increasing, in SI units.
    #[param(unit = "1", example = vec![0.0, 1.0])]
    pub b: Option<Vec<f64>>,
    /// Values of the output, in SI units: all of the first `a` in the order of `b`, then all of the second, and so on.
    #[param(unit = "1", example = vec![0.0, 1.0, 2.0, 4.0])]
    pub values: Option<Vec<f64>>,
    /// What the function is between the points of `a` and `b`, monotone if left out; `grid` has a key of its own.
    #[param(choices = ["monotone", "linear", "spline"])]
    pub interpolation: Option<String>,
}

impl Element for Map {
    const NAME: &'static str = "map";
    const SUMMARY: &'static str = "signal as a function of two signals, by values on a grid";
    const DOC: &'static str = doc_of(include_str!("map.rs"));
    const FRAMES: &'static [FrameSpec] = &[];
    type Parameters = MapParameters;

    fn new(p: Self::Parameters) -> Result<Self, ParamError> {
        if p.grid.is_some() && p.interpolation.is_some() {
            return Err(ParamError::new("interpolation", "belongs into `grid`: `grid.interpolation`"));
        }
        let (a, b, values) = match (p.grid, p.a, p.b, p.values) {
            (Some(surface), None, None, None) => return Ok(Self { surface }),
            (None, Some(a), Some(b), Some(values)) => (a, b, values),
            (Some(_), ..) => {
                return Err(ParamError::new("grid", "is given besides `a`, `b` or `values`: leave these out"));
            }
            _ => return Err(ParamError::new("grid", "is missing: give it, or all of `a`, `b` and `values`")),
        };
        let interpolation = p.interpolation.and_then(|name| name.parse().ok()).unwrap_or_default();
        let surface = Surface::through(&a, &b, &values, interpolation).map_err(|error| {
            let path = match error.path.as_str() {
                "x" => "a",
                "y" => "b",
                path => path,
            };
            ParamError::new(path, error.message)
        })?;
        Ok(Self { surface })
    }
}

impl Control for Map {
    const INPUTS: &'static [InputSpec] =
        &[InputSpec::required("a", "", "first argument"), InputSpec::required("b", "", "second argument")];
    const OUTPUTS: &'static [ChannelSpec] = &[ChannelSpec::new("output", "", "value of the function")];

    fn outputs<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        // (1)
        out.push(self.surface.at(at.inputs[0], at.inputs[1]));
    }
}
