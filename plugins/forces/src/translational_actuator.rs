//! A cylinder or linear motor: its force is a sum of given functions of time, length and speed, and of a signal. It
//! acts along the line between two points (`along = "line"`, a cylinder between two eyes), or along z of frame i
//! (`along = "axis"`, a linear motor on its rail).
//!
//! ## Equations
//! With d = p_j - p_i, and l, its rate l' and the unit vector u
//!
//! ```text
//! line:  l = |d|        u = d / l     l' = u . (v_j - v_i)                             (1)
//! axis:  l = z_i . d    u = z_i       l' = z_i . (v_j - v_i - omega_i x d)             (2)
//! F = A(t) + B(l) + C(l') + g s                                                        (3)
//! force on j at p_j: F u      on i the opposite along the same line                    (4)
//! ```
//!
//! (Newton's third law; A, B, C are `of_time`, `of_length`, `of_speed`, each zero where it is not given, s is the input
//! `signal`, g the `gain`.) The power F l' is integrated as work done on the scene.
//!
//! ## Signs
//! A positive force pushes the points apart (drives body j along z of frame i).
//!
//! ## Singular cases
//! `line`: at l = 0 the direction is undefined and the results are not numbers. `axis`: none.
//!
//! ## Example
//! ```toml
//! title = "Linear motor"
//!
//! [plugins]
//! libraries = ["odyn-joints", "odyn-forces"]
//!
//! [simulation]
//! t_end = 1
//! output_step = 0.1
//!
//! [[body]]
//! name = "carriage"
//! mass = 2
//! inertia = [1, 1, 1]
//!
//! [[joint]]
//! name = "rail"
//! type = "translational"
//! bodies = ["ground", "carriage"]
//! point = [0, 0, 0]
//! axis = [1, 0, 0]
//!
//! [[force]]
//! name = "motor"
//! type = "translational-actuator"
//! bodies = ["ground", "carriage"]
//! axis = [1, 0, 0]
//! params.along = "axis"
//! params.of_time = "10 sin(2 pi t)"
//! params.of_speed = "-3 v"
//!
//! [[output]]
//! name = "x"
//! quantity = "position"
//! of = "carriage"
//! component = "x"
//! ```

use element_api::prelude::*;

use crate::bump_stop::slide;
use crate::value;

/// The element.
#[derive(Debug, Clone)]
pub struct TranslationalActuator(TranslationalActuatorParameters);

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Parameters)]
pub struct TranslationalActuatorParameters {
    /// Line of action: between the points, or the z axis of frame i.
    #[param(choices = ["line", "axis"], default = "line")]
    pub along: String,
    /// Force over time.
    #[param(unit = "s -> N", variable = "t")]
    pub of_time: Option<Function>,
    /// Force over the length.
    #[param(unit = "m -> N", variable = "l")]
    pub of_length: Option<Function>,
    /// Force over the rate of the length.
    #[param(unit = "m/s -> N", variable = "v")]
    pub of_speed: Option<Function>,
    /// Force per unit (SI) of the signal.
    #[param(unit = "N", default = 1.0)]
    pub gain: f64,
}

impl Element for TranslationalActuator {
    const NAME: &'static str = "translational-actuator";
    const SUMMARY: &'static str = "force along a line or axis as functions of time, length, speed and of a signal";
    const DOC: &'static str = doc_of(include_str!("translational_actuator.rs"));
    const FRAMES: &'static [FrameSpec] = &[
        FrameSpec::new("i", "its origin is the first end; with `axis`, its z axis is the line of action"),
        FrameSpec::new("j", "its origin is the second end, where the force acts"),
    ];
    type Parameters = TranslationalActuatorParameters;

    fn new(parameters: Self::Parameters) -> Result<Self, ParamError> {
        Ok(Self(parameters))
    }
}

/// Direction, length and its rate.
struct Line<S> {
    direction: Vec3<S>,
    length: S,
    rate: S,
}

impl TranslationalActuator {
    /// (1) or (2)
    fn line<S: Scalar>(&self, at: &Motion<'_, S>) -> Line<S> {
        if self.0.along == "axis" {
            let (length, rate) = slide(at);
            return Line { direction: at.frames()[0].z(), length, rate };
        }
        let d = at.frames()[1].position - at.frames()[0].position;
        let length = length(d);
        let direction = d / length;
        Line { direction, length, rate: direction.dot(&at.relative_velocity(0, 1)) }
    }

    /// (3)
    fn force<S: Scalar>(&self, at: &Motion<'_, S>, line: &Line<S>) -> S {
        value(&self.0.of_time, at.time())
            + value(&self.0.of_length, line.length)
            + value(&self.0.of_speed, line.rate)
            + at.inputs[0] * self.0.gain
    }
}

impl Force for TranslationalActuator {
    const INPUTS: &'static [InputSpec] =
        &[InputSpec::optional("signal", "", 0.0, "times `gain` it is added to the force")];
    const CHANNELS: &'static [ChannelSpec] = &[
        ChannelSpec::new("force", "N", "positive when it pushes the points apart, or the second along z"),
        ChannelSpec::new("length", "m", "distance of the points, or displacement along z"),
        ChannelSpec::new("power", "W", "done on the bodies"),
    ];

    fn wrench<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Wrenches<'_, S>) {
        let line = self.line(at);
        out.force_pair(0, 1, line.direction * self.force(at, &line));
    }

    fn channels<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let line = self.line(at);
        let force = self.force(at, &line);
        out.push(force);
        out.push(line.length);
        out.push(force * line.rate);
    }
}
