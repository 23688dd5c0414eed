//! A spring and a damper side by side between two points.
//!
//! Equations, with d = p_j - p_i, l = |d|, u = d / l (Haug 1989, chapter 11, translational spring-damper-actuator):
//!
//! ```text
//! l' = u . (v_j - v_i)                                              (1)
//! f  = k (l - l0) + c l' + f0                                       (2)
//! force on i: f u      force on j: -f u                             (3)
//! V  = k (l - l0)^2 / 2 + f0 (l - l0)      P_dissipated = c l'^2    (4)
//! ```
//!
//! Sign: `f` is tension, positive when it pulls the points together; the preload f0 is additional tension.
//!
//! Singular case: at l = 0 the direction u is undefined and the results are not numbers. Only a plain spring needs no
//! direction: with l0 = 0, f0 = 0 and c = 0, (3) is k d, and so it is written; that element passes through l = 0.

use element_api::prelude::*;

/// The element.
#[derive(Debug, Clone, Copy)]
pub struct TranslationalSpringDamper(TranslationalSpringDamperParameters);

/// What a scene tells it.
#[derive(Debug, Clone, Copy, Parameters)]
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
}

impl Element for TranslationalSpringDamper {
    const NAME: &'static str = "translational-spring-damper";
    const SUMMARY: &'static str = "spring and damper along the line between two points";
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

fn line<S: Scalar>(at: &Motion<'_, S>) -> Line<S> {
    let d = at.frames()[1].position - at.frames()[0].position;
    let length = length(d);
    Line { d, length, rate: d.dot(&at.relative_velocity(0, 1)) / length }
}

impl TranslationalSpringDamper {
    fn needs_direction(&self) -> bool {
        self.0.free_length != 0.0 || self.0.preload != 0.0 || self.0.damping != 0.0
    }

    /// (2)
    fn tension<S: Scalar>(&self, line: &Line<S>) -> S {
        let spring = (line.length - self.0.free_length) * self.0.stiffness + self.0.preload;
        // Without a damper l' is left out: it is not a number at l = 0.
        if self.0.damping == 0.0 { spring } else { spring + line.rate * self.0.damping }
    }
}

impl Force for TranslationalSpringDamper {
    const CHANNELS: &'static [ChannelSpec] = &[
        ChannelSpec::new("force", "N", "tension, positive when it pulls the points together"),
        ChannelSpec::new("length", "m", "distance of the points"),
    ];

    fn wrench<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Wrenches<'_, S>) {
        let line = line(at);
        let per_length =
            if self.needs_direction() { self.tension(&line) / line.length } else { S::from(self.0.stiffness) };
        // Along the line of the origins: no torque on either frame.
        let pull = line.d * per_length;
        out.force(0, pull);
        out.force(1, -pull);
    }

    fn channels<S: Scalar>(&self, at: &Motion<'_, S>) -> Vec<S> {
        let line = line(at);
        vec![self.tension(&line), line.length]
    }

    fn potential<S: Scalar>(&self, at: &Motion<'_, S>) -> Option<S> {
        let elongation = line(at).length - self.0.free_length;
        Some(elongation * elongation * (0.5 * self.0.stiffness) + elongation * self.0.preload)
    }

    fn dissipation<S: Scalar>(&self, at: &Motion<'_, S>) -> Option<S> {
        if self.0.damping == 0.0 {
            return None;
        }
        let rate = line(at).rate;
        Some(rate * rate * self.0.damping)
    }
}
