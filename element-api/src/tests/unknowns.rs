//! Internal unknowns: what of them is recorded, and what is refused.

use crate::prelude::*;
use crate::recording::Role;
use crate::testkit::Probe;

/// A joint with one unknown, in ways that are right and wrong.
macro_rules! joint {
    ($name:ident, $guesses:expr, $mobility:expr, $opaque:expr, $condition:expr) => {
        struct $name;
        impl Element for $name {
            const NAME: &'static str = "solved";
            const SUMMARY: &'static str = "a joint with an unknown";
            const FRAMES: &'static [FrameSpec] = &[FrameSpec::new("i", ""), FrameSpec::new("j", "")];
            const UNKNOWNS: &'static [ChannelSpec] = &[ChannelSpec::new("y", "m", "a length")];
            const OPAQUE: bool = $opaque;
            type Parameters = NoParameters;
            fn new(_: NoParameters) -> Result<Self, ParamError> {
                Ok(Self)
            }
            fn initial_unknowns(&self) -> Vec<f64> {
                $guesses
            }
            fn conditions<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
                let condition: fn(&Motion<'_, S>) -> Option<S> = $condition;
                condition(at).into_iter().for_each(|value| out.push(value));
            }
        }
        impl Constraint for $name {
            const ROWS: &'static [&'static str] = &["row"];
            const MOBILITY: Option<usize> = $mobility;
            fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
                rows.push(blocks::displacement_along_z(&at.frames()[0], &at.frames()[1]) - at.unknowns()[0]);
            }
        }
    };
}

joint!(Right, vec![0.5], None, false, |at| Some(at.unknowns()[0] * at.unknowns()[0] - at.frames()[1].position.x));
joint!(Forgets, vec![0.5], None, false, |_| None);
joint!(Moves, vec![0.5], None, false, |at| Some(at.unknowns()[0] - at.twists[1].velocity.x));
joint!(Mobile, vec![0.5], Some(1), false, |at| Some(at.unknowns()[0]));
joint!(NoNumber, vec![f64::NAN], None, false, |at| Some(at.unknowns()[0]));
joint!(Called, vec![0.5], None, true, |at| Some(at.unknowns()[0]));

#[test]
fn conditions_and_guesses_are_recorded() {
    let probe = Probe::joint::<Right>("").expect("it is sound");
    assert!(probe.recording.check(&probe.descriptor.limits()).is_ok());
    assert_eq!(probe.recording.guesses(), [0.5]);
    assert!(probe.recording.output(Role::Condition(0)).is_some());
    assert_eq!(probe.descriptor.unknowns[0].name, "y");
}

/// Why an element is refused.
fn refusal<T: Constraint>() -> String {
    match Probe::joint::<T>("") {
        Ok(probe) => probe.recording.check(&probe.descriptor.limits()).expect_err("it is wrong"),
        Err(error) => format!("{error:?}"),
    }
}

#[test]
fn what_makes_no_sense_is_refused() {
    for (words, expected) in [
        (refusal::<Forgets>(), "declares 1 internal unknowns, but does not give condition 0"),
        (refusal::<Moves>(), "condition 0 on the unknowns of a joint depends on velocities"),
        (refusal::<Mobile>(), "a joint with internal unknowns has no coordinates of its own"),
        (refusal::<NoNumber>(), "is NaN"),
        (refusal::<Called>(), "has internal unknowns, which an opaque element cannot have"),
    ] {
        assert!(words.contains(expected), "{words}");
    }
}
