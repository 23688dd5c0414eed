//! Elements that store energy: in a spring whose other end moves by a state, by time, or by a signal.

use element_api::prelude::*;

/// A spring of 40 N/m along the x axis of the ground, between a body and an end that moves along that axis.
pub struct EndedSpring<const END: u8>;

/// The end gives way as a dashpot of 8 N s/m does: a Maxwell element.
pub const DASHPOT: u8 = 0;
/// The end moves by time.
pub const CLOCK: u8 = 1;
/// The end moves by a signal.
pub const SIGNAL: u8 = 2;

const STIFFNESS: f64 = 40.0;
const DAMPING: f64 = 8.0;

#[derive(Parameters)]
pub struct Nothing {}

impl<const END: u8> Element for EndedSpring<END> {
    const NAME: &'static str = match END {
        DASHPOT => "maxwell",
        CLOCK => "shaken",
        _ => "pulled",
    };
    const SUMMARY: &'static str = "a spring to an end that moves";
    const FRAMES: &'static [FrameSpec] = &[FrameSpec::new("i", "ground"), FrameSpec::new("j", "body")];
    type Parameters = Nothing;
    fn new(_: Nothing) -> Result<Self, ParamError> {
        Ok(Self)
    }
}

impl<const END: u8> EndedSpring<END> {
    fn tension<S: Scalar>(at: &Motion<'_, S>) -> S {
        let end = match END {
            DASHPOT => at.states[0],
            CLOCK => (at.time() * 3.0).sin() * 0.5,
            _ => at.inputs[0],
        };
        (at.frames()[1].position.x - at.frames()[0].position.x - end) * STIFFNESS
    }
}

impl<const END: u8> Force for EndedSpring<END> {
    const INPUTS: &'static [InputSpec] =
        if END == SIGNAL { &[InputSpec::required("end", "", "where the end is, m")] } else { &[] };
    const STATES: &'static [ChannelSpec] =
        if END == DASHPOT { &[ChannelSpec::new("creep", "m", "how far the end gave way")] } else { &[] };

    fn wrench<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Wrenches<'_, S>) {
        out.force_pair(0, 1, -at.frames()[0].x() * Self::tension(at));
    }
    fn rates<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        if END == DASHPOT {
            out.push(Self::tension(at) * (1.0 / DAMPING));
        }
    }
    fn potential<S: Scalar>(&self, at: &Motion<'_, S>) -> Option<S> {
        Some(Self::tension(at).powi(2) * (0.5 / STIFFNESS))
    }
    fn dissipation<S: Scalar>(&self, at: &Motion<'_, S>) -> Option<S> {
        (END == DASHPOT).then(|| Self::tension(at).powi(2) * (1.0 / DAMPING))
    }
}
