//! Elements that take and give signals, and forces that depend on reactions.

use element_api::prelude::*;

const PAIR: &[FrameSpec] = &[FrameSpec::new("i", "first body"), FrameSpec::new("j", "second body")];

/// A number that elements of this file are made from.
#[derive(Parameters)]
pub struct Factor {
    /// The number.
    factor: f64,
}

/// Names of an element that is made from one number.
macro_rules! factor_element {
    ($type:ident, $name:expr, $opaque:expr, $frames:expr $(, $constant:ident)?) => {
        pub struct $type $(<const $constant: bool>)? {
            factor: f64,
        }
        impl $(<const $constant: bool>)? Element for $type $(<$constant>)? {
            const NAME: &'static str = $name;
            const SUMMARY: &'static str = "takes or gives signals";
            const FRAMES: &'static [FrameSpec] = $frames;
            const OPAQUE: bool = $opaque;
            type Parameters = Factor;
            fn new(p: Factor) -> Result<Self, ParamError> {
                Ok(Self { factor: p.factor })
            }
        }
    };
}

factor_element!(Push, if OPAQUE { "opaque-push" } else { "push" }, OPAQUE, PAIR, OPAQUE);

/// A force along the x axis of the first frame on the second body: factor times signal.
impl<const OPAQUE: bool> Force for Push<OPAQUE> {
    const INPUTS: &'static [InputSpec] = &[InputSpec::required("signal", "", "what to push with")];
    const CHANNELS: &'static [ChannelSpec] = &[ChannelSpec::new("force", "N", "on the second body")];
    fn wrench<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Wrenches<'_, S>) {
        out.force_pair(0, 1, at.frames()[0].x() * (at.inputs[0] * self.factor));
    }
    fn channels<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push(at.inputs[0] * self.factor);
    }
}

factor_element!(Rub, if OPAQUE { "opaque-rub" } else { "rub" }, OPAQUE, PAIR, OPAQUE);

/// Friction of a slide along z of the first frame: factor times the size of the side force, against the motion.
impl<const OPAQUE: bool> Force for Rub<OPAQUE> {
    const JOINTS: &'static [FrameSpec] = &[FrameSpec::new("slide", "the joint whose reaction presses")];
    const CHANNELS: &'static [ChannelSpec] = &[ChannelSpec::new("pressure", "N", "side force")];
    fn wrench<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Wrenches<'_, S>) {
        let z = at.frames()[0].z();
        let v = at.relative_velocity(0, 1).dot(&z);
        out.force_pair(0, 1, -z * (side(at) * (v / 1e-3).tanh() * self.factor));
    }
    fn channels<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push(side(at));
    }
}

/// Size of the reaction across z.
fn side<S: Scalar>(at: &Motion<'_, S>) -> S {
    let force = at.reactions[0].force;
    let (x, y) = (force.dot(&at.frames()[0].x()), force.dot(&at.frames()[0].y()));
    (x * x + y * y + 1e-12).sqrt()
}

factor_element!(Amplifier, "amplifier", false, &[]);

/// Gives factor times what it takes, at once.
impl Control for Amplifier {
    const INPUTS: &'static [InputSpec] = &[
        InputSpec::required("in", "", "what to amplify"),
        InputSpec::optional("bias", "", 0.0, "added to the result"),
    ];
    const OUTPUTS: &'static [ChannelSpec] =
        &[ChannelSpec::new("out", "", "amplified"), ChannelSpec::new("bias", "", "the bias alone")];
    fn outputs<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push(at.inputs[0] * self.factor + at.inputs[1]);
        out.push(at.inputs[1]);
    }
}

factor_element!(Smoother, if OPAQUE { "opaque-smoother" } else { "smoother" }, OPAQUE, &[], OPAQUE);

/// Follows its input with the time constant `factor`, s.
impl<const OPAQUE: bool> Control for Smoother<OPAQUE> {
    const INPUTS: &'static [InputSpec] = &[InputSpec::required("in", "m", "what to follow")];
    const OUTPUTS: &'static [ChannelSpec] = &[ChannelSpec::new("out", "m", "smoothed")];
    const STATES: &'static [ChannelSpec] = &[ChannelSpec::new("out", "m", "smoothed")];
    fn outputs<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push(at.states[0]);
    }
    fn rates<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push((at.inputs[0] - at.states[0]) / self.factor);
    }
}

factor_element!(Follower, "follower", false, &[]);

/// The same for anything.
impl Control for Follower {
    const INPUTS: &'static [InputSpec] = &[InputSpec::required("in", "", "what to follow")];
    const OUTPUTS: &'static [ChannelSpec] = &[ChannelSpec::new("out", "", "smoothed")];
    const STATES: &'static [ChannelSpec] = &[ChannelSpec::new("out", "", "smoothed")];
    fn outputs<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push(at.states[0]);
    }
    fn rates<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push((at.inputs[0] - at.states[0]) / self.factor);
    }
}
