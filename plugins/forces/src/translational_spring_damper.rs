//! A spring and a damper side by side along the line between two points, linear, with given characteristics, or both.
//!
//! ## Equations
//! With d = p_j - p_i, l = |d|, u = d / l (Haug, Computer Aided Kinematics and Dynamics of Mechanical Systems, 1989,
//! chapter 11, translational spring-damper-actuator):
//!
//! ```text
//! l' = u . (v_j - v_i)                                              (1)
//! f  = k (l - l0) + c l' + f0 + F(l - l0) + D(l')                   (2)
//! force on i: f u      force on j: -f u                             (3)
//! V  = k (l - l0)^2 / 2 + f0 (l - l0)                               (4)
//! P_dissipated = c l'^2 + D(l') l'                                  (5)
//! ```
//!
//! F and D are the characteristics `force_of_elongation` and `force_of_speed`; without them they are zero. With F there
//! is no closed form (4): the work of the element is integrated instead.
//!
//! ## Signs
//! `f` is tension, positive when it pulls the points together; the preload f0 is additional tension.
//!
//! ## Singular cases
//! At l = 0 the direction u is undefined and the results are not numbers. Only a plain spring needs no direction: with
//! l0 = 0, f0 = 0, c = 0 and no characteristic, (3) is k d, and so it is written; that element passes through l = 0.
//!
//! ## Example
//! ```toml
//! title = "Mass on a spring"
//!
//! [plugins]
//! libraries = ["odyn-forces"]
//!
//! [simulation]
//! t_end = 0.5
//! output_step = 0.1
//!
//! [[body]]
//! name = "mass"
//! mass = 2
//! inertia = [1, 1, 1]
//! position = [1.5, 0, 0]
//!
//! [[force]]
//! name = "spring"
//! type = "translational-spring-damper"
//! bodies = ["ground", "mass"]
//! points = [[0, 0, 0], [1.5, 0, 0]]
//! params.stiffness = "100 N/m"
//! params.damping = "3 N s/m"
//! params.free_length = "1 m"
//!
//! [[output]]
//! name = "x"
//! quantity = "position"
//! of = "mass"
//! component = "x"
//! ```

use element_api::prelude::*;

use crate::value;

/// The element.
#[derive(Debug, Clone)]
pub struct TranslationalSpringDamper(TranslationalSpringDamperParameters);

/// Its parameters, as a scene gives them.
#[derive(Debug, Clone, Parameters)]
pub struct TranslationalSpringDamperParameters {
    /// Tension per elongation.
    #[param(unit = "N/m", min = 0.0)]
    pub stiffness: f64,
    /// Tension per rate of elongation.
    #[param(unit = "N s/m", min = 0.0, default = 0.0)]
    pub damping: f64,
    /// Distance of the points at which the spring is relaxed.
    #[param(unit = "m", min = 0.0, default = 0.0)]
    pub free_length: f64,
    /// Constant tension, added to the spring's.
    #[param(unit = "N", default = 0.0)]
    pub preload: f64,
    /// Additional tension over the elongation l - l0.
    #[param(unit = "m -> N", variable = "x")]
    pub force_of_elongation: Option<Function>,
    /// Additional tension over the rate of elongation.
    #[param(unit = "m/s -> N", variable = "v")]
    pub force_of_speed: Option<Function>,
}

impl Element for TranslationalSpringDamper {
    const NAME: &'static str = "translational-spring-damper";
    const SUMMARY: &'static str = "spring and damper along the line between two points";
    const DOC: &'static str = doc_of(include_str!("translational_spring_damper.rs"));
    const FRAMES: &'static [FrameSpec] =
        &[FrameSpec::new("i", "its origin is the first end"), FrameSpec::new("j", "its origin is the second end")];
    type Parameters = TranslationalSpringDamperParameters;

    fn new(parameters: Self::Parameters) -> Result<Self, ParamError> {
        Ok(Self(parameters))
    }
}

/// Length and its rate, (1).
struct Line<S> {
    /// From i to j, m.
    d: Vec3<S>,
    length: S,
    rate: S,
}

impl TranslationalSpringDamper {
    fn line<S: Scalar>(&self, at: &Motion<'_, S>) -> Line<S> {
        let d = at.frames()[1].position - at.frames()[0].position;
        let length = if self.needs_direction() { length(d) } else { length_or_zero(d) };
        Line { d, length, rate: d.dot(&at.relative_velocity(0, 1)) / length }
    }

    fn is_damped(&self) -> bool {
        self.0.damping != 0.0 || self.0.force_of_speed.is_some()
    }

    fn needs_direction(&self) -> bool {
        self.0.free_length != 0.0 || self.0.preload != 0.0 || self.is_damped() || self.0.force_of_elongation.is_some()
    }

    /// (2)
    fn tension<S: Scalar>(&self, line: &Line<S>) -> S {
        let elongation = line.length - self.0.free_length;
        let spring = elongation * self.0.stiffness + self.0.preload + value(&self.0.force_of_elongation, elongation);
        // Without a damper l' is left out: it is not a number at l = 0.
        if self.is_damped() { spring + self.resistance(line.rate) } else { spring }
    }

    /// The part of (2) that depends on the rate.
    fn resistance<S: Scalar>(&self, rate: S) -> S {
        rate * self.0.damping + value(&self.0.force_of_speed, rate)
    }
}

/// The length of a vector, without a derivative where it vanishes: a plain spring must not see one that is not a
/// number.
fn length_or_zero<S: Scalar>(d: Vec3<S>) -> S {
    let (square, tiny) = (d.dot(&d), S::from(f64::MIN_POSITIVE));
    S::select(square, tiny, S::zero(), square.max(tiny).sqrt())
}

impl Force for TranslationalSpringDamper {
    const CHANNELS: &'static [ChannelSpec] = &[
        ChannelSpec::new("force", "N", "tension, positive when it pulls the points together"),
        ChannelSpec::new("length", "m", "distance of the points"),
    ];

    fn wrench<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Wrenches<'_, S>) {
        let line = self.line(at);
        let per_length =
            if self.needs_direction() { self.tension(&line) / line.length } else { S::from(self.0.stiffness) };
        // Along the line of the origins: no torque on either frame.
        let pull = line.d * per_length;
        out.force(0, pull);
        out.force(1, -pull);
    }

    fn channels<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        let line = self.line(at);
        out.push(self.tension(&line));
        out.push(line.length);
    }

    fn potential<S: Scalar>(&self, at: &Motion<'_, S>) -> Option<S> {
        if self.0.force_of_elongation.is_some() {
            return None;
        }
        let elongation = self.line(at).length - self.0.free_length;
        Some(elongation * elongation * (0.5 * self.0.stiffness) + elongation * self.0.preload)
    }

    fn dissipation<S: Scalar>(&self, at: &Motion<'_, S>) -> Option<S> {
        // Without (4) the host integrates the power of the whole element.
        if self.0.force_of_elongation.is_some() || !self.is_damped() {
            return None;
        }
        let rate = self.line(at).rate;
        Some(self.resistance(rate) * rate)
    }
}
