//! Kinetic energies and flexible coordinates: what of them is recorded, and what is refused.

use crate::prelude::*;
use crate::recording::Role;
use crate::testkit::{self, Probe};

/// A mass on a spring inside a body, by ways that are right and wrong.
macro_rules! rider {
    ($name:ident, $flexible:expr, $states:expr, $opaque:expr, $forces:expr, $kinetic:expr) => {
        struct $name;
        impl Element for $name {
            const NAME: &'static str = "rider";
            const SUMMARY: &'static str = "a mass that slides on a body";
            const FRAMES: &'static [FrameSpec] = &[FrameSpec::new("i", "")];
            const OPAQUE: bool = $opaque;
            type Parameters = NoParameters;
            fn new(_: NoParameters) -> Result<Self, ParamError> {
                Ok(Self)
            }
        }
        impl Force for $name {
            fn wrench<S: Scalar>(&self, _: &Motion<'_, S>, _: &mut Wrenches<'_, S>) {}
            fn initial_states(&self) -> Vec<f64> {
                vec![0.5; $states]
            }
            fn rates<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
                at.states[2 * $flexible..].iter().for_each(|state| out.push(-*state));
            }
            fn flexible(&self) -> usize {
                $flexible
            }
            fn flexible_forces<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
                let forces: fn(&Motion<'_, S>) -> Option<S> = $forces;
                forces(at).into_iter().for_each(|value| out.push(value));
            }
            fn potential<S: Scalar>(&self, at: &Motion<'_, S>) -> Option<S> {
                ($flexible == 1).then(|| at.states[0] * at.states[0] * 2.0)
            }
            fn kinetic<S: Scalar>(&self, at: &Motion<'_, S>) -> Option<S> {
                let kinetic: fn(&Motion<'_, S>) -> Option<S> = $kinetic;
                kinetic(at)
            }
        }
    };
}

fn speed<S: Scalar>(at: &Motion<'_, S>) -> Vec3<S> {
    at.twists[0].velocity + at.frames()[0].x() * at.states[1]
}
fn half_square<S: Scalar>(v: Vec3<S>) -> Option<S> {
    Some(v.dot(&v) * 0.5)
}

rider!(Right, 1, 3, false, |at| Some(at.states[0] * -4.0), |at| half_square(speed(at)));
rider!(Forgets, 1, 2, false, |_| None, |at| half_square(speed(at)));
rider!(TooFewStates, 1, 1, false, |at| Some(at.states[0]), |at| half_square(speed(at)));
rider!(WithoutEnergy, 1, 2, false, |at| Some(at.states[0]), |_| None);
rider!(Called, 0, 0, true, |_| None, |at| half_square(at.twists[0].velocity));
rider!(Linear, 0, 0, false, |_| None, |at| Some(at.twists[0].velocity.x));
rider!(Mixed, 0, 0, false, |_| None, |at| Some(at.twists[0].velocity.x.powi(2) + at.twists[0].velocity.y));
rider!(Root, 0, 0, false, |_| None, |at| Some((at.twists[0].velocity.x.powi(4) + 1.0).sqrt()));
rider!(OfTime, 0, 0, false, |_| None, |at| half_square(at.twists[0].velocity * at.time()));
rider!(OfState, 0, 1, false, |_| None, |at| half_square(at.twists[0].velocity * at.states[0]));
rider!(Quotient, 0, 0, false, |_| None, |at| half_square(at.twists[0].velocity / (at.frames()[0].position.x + 9.0)));
rider!(Negative, 0, 0, false, |_| None, |at| half_square(at.twists[0].velocity).map(|energy| -energy));

#[test]
fn energy_forces_and_rates_are_recorded() {
    let probe = Probe::force::<Right>("").expect("it is sound");
    let recording = &probe.recording;
    assert_eq!(recording.flexible(), 1);
    for (role, given) in [
        (Role::Kinetic, true),
        (Role::FlexibleForce(0), true),
        (Role::StateRate(0), true),
        (Role::StateRate(1), false),
        (Role::StateRate(2), true),
    ] {
        assert_eq!(recording.output(role).is_some(), given, "{role:?}");
        let (number, k) = role.encode();
        assert_eq!(Role::decode(number, k), Some(role));
    }
    testkit::check_force::<Right>("");
    testkit::check_force::<Quotient>("");
}

/// Why an element is refused.
fn refusal<T: Force>() -> String {
    match Probe::force::<T>("") {
        Ok(probe) => probe.recording.check(&probe.descriptor.limits()).expect_err("it is wrong"),
        Err(error) => format!("{error:?}"),
    }
}

#[test]
fn what_is_no_kinetic_energy_is_refused() {
    let of_velocities = "the kinetic energy is not a sum of products of two velocities each";
    let of_more = "the kinetic energy depends on more than frames and flexible coordinates";
    for (words, expected) in [
        (refusal::<Forgets>(), "declares the force on flexible coordinate 0, but does not give it"),
        (refusal::<TooFewStates>(), "1 flexible coordinates need 2 states"),
        (refusal::<WithoutEnergy>(), "flexible coordinates without a kinetic energy"),
        (refusal::<Called>(), "has a kinetic energy, which an opaque element cannot have"),
        (refusal::<Linear>(), of_velocities),
        (refusal::<Mixed>(), of_velocities),
        (refusal::<Root>(), of_velocities),
        (refusal::<OfTime>(), of_more),
        (refusal::<OfState>(), of_more),
    ] {
        assert!(words.contains(expected), "{words}");
    }
}

#[test]
fn the_test_kit_finds_a_negative_energy() {
    let report = testkit::examine_force::<Negative>("");
    assert!(report.to_string().contains("the kinetic energy is negative"), "{report}");
}
