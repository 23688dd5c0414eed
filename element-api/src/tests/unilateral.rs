//! Rows that only push: what of them is recorded, and what is refused.

use crate::prelude::*;
use crate::recording::Role;
use crate::testkit::Probe;

/// A point above a plane, in ways that are right and wrong.
macro_rules! contact {
    ($name:ident, $restitution:expr, $sticks:expr, $mobility:expr) => {
        struct $name;
        impl Element for $name {
            const NAME: &'static str = "contact";
            const SUMMARY: &'static str = "a point above a plane";
            const FRAMES: &'static [FrameSpec] = &[FrameSpec::new("i", ""), FrameSpec::new("j", "")];
            type Parameters = NoParameters;
            fn new(_: NoParameters) -> Result<Self, ParamError> {
                Ok(Self)
            }
        }
        impl Constraint for $name {
            const ROWS: &'static [&'static str] = &["gap"];
            const VELOCITY_ROWS: &'static [&'static str] = &["slip"];
            const MOBILITY: Option<usize> = $mobility;
            fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
                rows.push(blocks::displacement_along_z(&at.frames()[0], &at.frames()[1]));
            }
            fn velocity_residual<S: Scalar>(&self, at: &Motion<'_, S>, rows: &mut Rows<'_, S>) {
                rows.push(at.frames()[0].x().dot(&at.relative_velocity(0, 1)));
            }
            fn unilateral(&self, row: usize) -> Option<f64> {
                (row == 0).then_some($restitution)
            }
            fn sticks_with(&self, row: usize) -> Option<usize> {
                (row == 1).then_some($sticks)
            }
        }
    };
}

contact!(Right, 0.5, 0, None);
contact!(TooElastic, 1.5, 0, None);
contact!(SticksWithItself, 0.5, 1, None);
contact!(Mobile, 0.5, 0, Some(2));

#[test]
fn restitution_and_sticking_are_recorded() {
    let probe = Probe::joint::<Right>("").expect("it is sound");
    assert!(probe.recording.check(&probe.descriptor.limits()).is_ok());
    assert_eq!(probe.recording.restitution(0), Some(0.5));
    assert_eq!(probe.recording.restitution(1), None);
    assert_eq!(probe.recording.sticks_with(1), Some(0));
    assert!(probe.recording.output(Role::Unilateral(0)).is_some());
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
    let words = refusal::<TooElastic>();
    assert!(words.contains("the coefficient of restitution of row 0 is not a constant from 0 to 1"), "{words}");
    let words = refusal::<SticksWithItself>();
    assert!(words.contains("row 1 does not stick with a unilateral row"), "{words}");
    let words = refusal::<Mobile>();
    assert!(words.contains("a joint with unilateral rows has no coordinates of its own"), "{words}");
}

/// A clutch, in ways that are right and wrong.
macro_rules! limited {
    ($name:ident, $slides:expr, $limited:expr, $mobility:expr) => {
        struct $name;
        impl Element for $name {
            const NAME: &'static str = "limited";
            const SUMMARY: &'static str = "friction in a plane";
            const FRAMES: &'static [FrameSpec] = &[FrameSpec::new("i", ""), FrameSpec::new("j", "")];
            type Parameters = NoParameters;
            fn new(_: NoParameters) -> Result<Self, ParamError> {
                Ok(Self)
            }
        }
        impl Constraint for $name {
            const ROWS: &'static [&'static str] = &["gap"];
            const VELOCITY_ROWS: &'static [&'static str] = &["x", "y"];
            const MOBILITY: Option<usize> = $mobility;
            fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
                rows.push(blocks::displacement_along_z(&at.frames()[0], &at.frames()[1]));
            }
            fn velocity_residual<S: Scalar>(&self, at: &Motion<'_, S>, rows: &mut Rows<'_, S>) {
                let slip = at.relative_velocity(0, 1);
                rows.push(at.frames()[0].x().dot(&slip));
                rows.push(at.frames()[0].y().dot(&slip));
            }
            fn limit<S: Scalar>(&self, row: usize, at: &Motion<'_, S>) -> Option<S> {
                (row == $limited).then(|| at.time() + 1.0)
            }
            fn slides_with(&self, row: usize) -> Option<usize> {
                (row == 1).then_some($slides)
            }
        }
    };
}

limited!(Sliding, 2, 1, None);
limited!(SlidesWithItself, 1, 1, None);
limited!(SlidesWithAGap, 0, 1, None);
limited!(LimitedGap, 2, 0, None);
limited!(LimitedMobile, 2, 1, Some(2));

#[test]
fn limits_and_pairs_are_recorded() {
    let probe = Probe::joint::<Sliding>("").expect("it is sound");
    assert!(probe.recording.check(&probe.descriptor.limits()).is_ok());
    assert_eq!((probe.recording.slides_with(1), probe.recording.slides_with(2)), (Some(2), None));
    assert_eq!(probe.recording.sliding_numbers(), 3);
    let values = probe.recording.evaluate(|_| 4.0);
    assert!(values.contains(&(Role::Limit(1), 5.0)));
    assert_eq!((Role::Limit(3).encode(), Role::SlidesWith(3).encode()), ((30, 3), (31, 3)));
}

#[test]
fn limits_that_make_no_sense_are_refused() {
    for words in [refusal::<SlidesWithItself>(), refusal::<SlidesWithAGap>()] {
        assert!(words.contains("row 1 slides with another, but has no limit, or the other one is not"), "{words}");
    }
    let words = refusal::<LimitedGap>();
    assert!(words.contains("row 0 has a limit, but is not a row on velocities"), "{words}");
    let words = refusal::<LimitedMobile>();
    assert!(words.contains("rows that hold up to a limit has no coordinates of its own"), "{words}");
}
