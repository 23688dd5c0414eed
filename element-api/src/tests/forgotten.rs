//! What is declared and not given is refused by its name.

use crate::prelude::*;
use crate::testkit::Probe;

/// An element of a kind that declares a state and two channels, and gives one of the channels.
macro_rules! forgetful {
    ($name:ident, $rates:expr) => {
        struct $name;
        impl Element for $name {
            const NAME: &'static str = "forgetful";
            const SUMMARY: &'static str = "declares more than it gives";
            const FRAMES: &'static [FrameSpec] = &[FrameSpec::new("i", ""), FrameSpec::new("j", "")];
            type Parameters = NoParameters;
            fn new(_: NoParameters) -> Result<Self, ParamError> {
                Ok(Self)
            }
        }
        impl Constraint for $name {
            const ROWS: &'static [&'static str] = &["row"];
            const STATES: &'static [ChannelSpec] = STATES;
            const CHANNELS: &'static [ChannelSpec] = CHANNELS;
            fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
                rows.push(blocks::displacement_along_z(&at.frames()[0], &at.frames()[1]));
            }
            fn rates<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
                at.states[..$rates].iter().for_each(|state| out.push(-*state));
            }
            fn channels<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
                out.push(at.time());
            }
        }
        impl Force for $name {
            const STATES: &'static [ChannelSpec] = STATES;
            const CHANNELS: &'static [ChannelSpec] = CHANNELS;
            fn wrench<S: Scalar>(&self, _: &Motion<'_, S>, _: &mut Wrenches<'_, S>) {}
            fn rates<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
                at.states[..$rates].iter().for_each(|state| out.push(-*state));
            }
            fn channels<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
                out.push(at.time());
            }
        }
    };
}

const STATES: &[ChannelSpec] = &[ChannelSpec::new("wear", "m", "how much is gone")];
const CHANNELS: &[ChannelSpec] = &[ChannelSpec::new("now", "s", "the time"), ChannelSpec::new("left", "m", "the rest")];

forgetful!(WithoutRate, 0);
forgetful!(WithoutChannel, 1);

#[test]
fn it_is_named() {
    let said = |probe: Result<Probe, _>| format!("{:?}", probe.err());
    for (words, expected) in [
        (said(Probe::joint::<WithoutRate>("")), "declares the rate of state `wear`, but does not give it"),
        (said(Probe::force::<WithoutRate>("")), "declares the rate of state `wear`, but does not give it"),
        (said(Probe::joint::<WithoutChannel>("")), "declares channel `left`, but does not give it"),
        (said(Probe::force::<WithoutChannel>("")), "declares channel `left`, but does not give it"),
    ] {
        assert!(words.contains(expected), "{words}");
    }
}
