//! What [`Recording::check`] refuses: a plugin is a stranger.

use crate::prelude::*;
use crate::recording::{Input, Limits, MOST_OPS, Op, Output, RawOp, Recording, Role};
use crate::set::CreateError;
use crate::testkit::Probe;
use crate::tests::{BELLOWS, Bellows, Screw};

type Damage = fn(&mut Recording);

/// Each damage to the recording of a [`Bellows`], and words of the refusal.
const DEFECTS: &[(&str, Damage, &str)] = &[
    ("an operation of a later version", |r| r.ops[5].code = 99, "operation 5 has the unknown code 99"),
    ("an input of a later version", |r| r.ops[5] = RawOp { code: 1, args: [99, 0, 0, 0] }, "operation 5"),
    ("a forward reference", |r| r.ops[5] = Op::Neg(6).encode(), "operation 5 uses operation 6"),
    ("an operation on itself", |r| r.ops[5] = Op::Add(0, 5).encode(), "operation 5 uses operation 5"),
    ("a forward reference in a select", |r| r.ops[9] = Op::Select(0, 1, 2, 9).encode(), "uses operation 9"),
    ("a constant that is not there", |r| r.ops[5] = Op::Constant(1000).encode(), "constant 1000"),
    ("an exponent that is not there", |r| r.ops[5] = Op::Powf(0, 1000).encode(), "constant 1000"),
    ("a table that is not there", |r| r.ops[5] = Op::Table(1, 0).encode(), "table 1 of 1"),
    ("a third frame", |r| r.ops[5] = input(Input::Position { frame: 2, component: 0 }), "frame 2 of 2"),
    ("a third frame's rotation", |r| r.ops[5] = input(Input::Rotation { frame: 2, row: 0, column: 0 }), "frame 2"),
    ("a third frame's velocity", |r| r.ops[5] = input(Input::Velocity { frame: 2, component: 0 }), "frame 2"),
    ("a third frame's spin", |r| r.ops[5] = input(Input::AngularVelocity { frame: 2, component: 0 }), "frame 2"),
    ("an angle it does not declare", |r| r.ops[5] = input(Input::AngleReference(0)), "angle 0 of 0"),
    ("a state it does not declare", |r| r.ops[5] = input(Input::State(1)), "state 1 of 1"),
    ("a discrete state it does not have", |r| r.ops[5] = input(Input::Discrete(1)), "discrete state 1 of 1"),
    ("a mobility it does not offer", |r| r.ops[5] = input(Input::Coordinate(0)), "joint coordinate 0 of 0"),
    ("a signal it does not take", |r| r.ops[5] = input(Input::Signal(0)), "signal 0 of 0"),
    (
        "the force of a joint it does not name",
        |r| r.ops[5] = input(Input::ReactionForce { joint: 0, component: 2 }),
        "joint 0 of 0",
    ),
    (
        "the torque of a joint it does not name",
        |r| r.ops[5] = input(Input::ReactionTorque { joint: 1, component: 0 }),
        "joint 1 of 0",
    ),
    ("a signal out", |r| r.outputs[0].role = Role::Signal(0), "reserved"),
    ("a constant that is not a number", |r| r.constants[0] = f64::NAN, "constant 0 is NaN"),
    ("an infinite constant", |r| r.constants[0] = f64::INFINITY, "constant 0 is inf"),
    ("a table with a hole", |r| r.tables[0].breaks[1] = f64::NAN, "table 0"),
    ("a table that goes back", |r| r.tables[0].breaks[1] = -1.0, "table 0"),
    ("a table of the wrong length", |r| r.tables[0].pieces.truncate(1), "table 0"),
    ("an empty table", |r| (r.tables[0].pieces, r.tables[0].breaks) = (Vec::new(), vec![0.0]), "table 0"),
    ("a result that is not computed", |r| r.outputs[0].node = 1_000_000, "operation 1000000, which does not exist"),
    ("a row of a force", |r| r.outputs[0].role = Role::Residual(0), "Residual(0)"),
    ("a force on a third frame", |r| r.outputs[0].role = Role::Force(6), "Force(6)"),
    ("a torque on a third frame", |r| r.outputs[0].role = Role::Torque(6), "Torque(6)"),
    ("an angle out", |r| r.outputs[0].role = Role::Angle(0), "Angle(0)"),
    ("a coordinate out", |r| r.outputs[0].role = Role::Coordinate(0), "Coordinate(0)"),
    ("a rate too many", |r| r.outputs[0].role = Role::StateRate(1), "StateRate(1)"),
    ("a discrete state too many", |r| r.outputs[0].role = Role::NextDiscrete(1), "NextDiscrete(1)"),
    ("a channel too many", |r| r.outputs[0].role = Role::Channel(1), "Channel(1)"),
    ("a fourth position", |r| r.outputs[0].role = Role::PosePosition(3), "PosePosition(3)"),
    ("a tenth rotation entry", |r| r.outputs[0].role = Role::PoseRotation(9), "PoseRotation(9)"),
    ("one result twice", |r| r.outputs.push(r.outputs[0]), "Force(0) is given twice"),
    ("a state without rate", |r| r.initial_states.push(0.0), "state 1 has no rate"),
    ("a state without start", |r| r.initial_states.clear(), "uses state 0 of 0"),
    ("a state that starts nowhere", |r| r.initial_states[0] = f64::NAN, "a state is NaN at the start"),
    ("a discrete state that starts nowhere", |r| r.initial_discrete[0] = f64::INFINITY, "inf at the start"),
    ("a state without rate", |r| r.outputs.retain(|o| o.role != Role::StateRate(0)), "state 0 has no rate"),
    ("a coordinate of a force", |r| r.outputs[0].role = Role::PosePosition(0), "no result of a force"),
    ("endless operations", |r| r.ops = vec![Op::Input(Input::Time).encode(); MOST_OPS + 1], "at most"),
];

#[test]
fn every_defect_is_named() {
    let (sound, limits) = bellows();
    assert_eq!(sound.check(&limits), Ok(()));
    for (name, damage, words) in DEFECTS {
        let mut recording = sound.clone();
        damage(&mut recording);
        let message = recording.check(&limits).expect_err(name);
        assert!(message.contains(words), "{name}: `{message}` does not say `{words}`");
    }
}

#[test]
fn a_random_change_of_one_number_is_refused_or_harmless() {
    let (sound, limits) = bellows();
    let setting =
        Probe::force::<Bellows>(BELLOWS).expect("accepted").random_setting(&mut crate::testkit::Random::new(3));
    let mut random = crate::testkit::Random::new(21);
    let mut refused = 0;
    for _ in 0..2000 {
        let mut recording = sound.clone();
        let op = random.between(0.0, recording.ops.len() as f64) as usize;
        let value = random.between(0.0, 40.0) as u32;
        match random.between(0.0, 3.0) as u32 {
            0 => recording.ops[op].code = value,
            1 => recording.ops[op].args[random.between(0.0, 4.0) as usize] = value,
            _ => {
                let output = random.between(0.0, recording.outputs.len() as f64) as usize;
                recording.outputs[output] = Output { node: value * 9, ..recording.outputs[output] };
            }
        }
        match recording.check(&limits) {
            Err(_) => refused += 1,
            // Must not index out of range.
            Ok(()) => drop(crate::testkit::interpret(&recording, &setting, &[])),
        }
    }
    assert!((200..1900).contains(&refused), "{refused} of 2000 refused");
}

#[test]
fn a_joint_may_not_give_rows_or_coordinates_it_does_not_declare() {
    let probe = Probe::joint::<Screw>("pitch = 1.0").expect("accepted");
    for (role, words) in [(Role::Residual(5), "Residual(5)"), (Role::Coordinate(1), "Coordinate(1)")] {
        let mut recording = probe.recording.clone();
        recording.outputs[0].role = role;
        let message = recording.check(&probe.descriptor.limits()).expect_err("too many");
        assert!(message.contains(words), "{message}");
    }
}

#[test]
fn a_joint_keeps_what_it_says_how_to_keep_and_has_no_loads() {
    let probe = Probe::joint::<Screw>("pitch = 1.0").expect("accepted");
    let refused = |damage: fn(&mut Recording)| {
        let mut recording = probe.recording.clone();
        damage(&mut recording);
        recording.check(&probe.descriptor.limits()).expect_err("not of a joint")
    };
    assert_eq!(refused(|r| r.initial_states.push(0.0)), "state 0 has no rate");
    assert_eq!(refused(|r| r.initial_discrete.push(0.0)), "discrete state 0 is not given for after a step");
    assert_eq!(refused(|r| r.outputs[0].role = Role::Force(0)), "Force(0) is no result of a joint element");
}

/// A brake whose limit follows a signal, which it may, or memory, and a slide whose unknown follows a signal.
struct Told<const WHERE: u32>;

impl<const WHERE: u32> Element for Told<WHERE> {
    const NAME: &'static str = "told";
    const SUMMARY: &'static str = "follows what it must not";
    const FRAMES: &'static [FrameSpec] = &[FrameSpec::new("i", ""), FrameSpec::new("j", "")];
    const UNKNOWNS: &'static [ChannelSpec] = &[ChannelSpec::new("y", "m", "")];
    type Parameters = NoParameters;
    fn new(_: NoParameters) -> Result<Self, ParamError> {
        Ok(Self)
    }
    fn conditions<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Values<'_, S>) {
        out.push(at.unknowns()[0] - if WHERE == 1 { at.inputs[0] } else { S::one() });
    }
}

impl<const WHERE: u32> Constraint for Told<WHERE> {
    const ROWS: &'static [&'static str] = &[];
    const VELOCITY_ROWS: &'static [&'static str] = &["spin"];
    const INPUTS: &'static [InputSpec] = &[InputSpec::optional("signal", "m", 0.0, "")];
    fn residual<S: Scalar>(&self, _: &Configuration<'_, S>, _: &mut Rows<'_, S>) {}
    fn velocity_residual<S: Scalar>(&self, at: &Motion<'_, S>, rows: &mut Rows<'_, S>) {
        rows.push(at.spin_about_z(0, 1));
    }
    fn limit<S: Scalar>(&self, _: usize, at: &Motion<'_, S>) -> Option<S> {
        Some(match WHERE {
            2 => at.inputs[0],
            3 => at.memory[0],
            _ => S::one(),
        })
    }
    fn initial_memory(&self) -> Vec<f64> {
        vec![0.0]
    }
}

#[test]
fn conditions_of_joints_follow_no_signal_and_limits_no_memory() {
    fn said<const WHERE: u32>() -> String {
        match Probe::joint::<Told<WHERE>>("") {
            Err(CreateError::Fault(text)) => text,
            Ok(_) => String::new(),
            other => panic!("{other:?}"),
        }
    }
    assert_eq!(said::<0>(), "");
    assert!(said::<1>().contains("condition 0 on the unknowns of a joint depends on a state, a signal or memory"));
    assert_eq!(said::<2>(), "");
    assert!(said::<3>().contains("the limit of row 0 depends on memory: give that as a channel"));
}

fn bellows() -> (Recording, Limits) {
    let probe = Probe::force::<Bellows>(BELLOWS).expect("accepted");
    (probe.recording, probe.descriptor.limits())
}

fn input(input: Input) -> RawOp {
    Op::Input(input).encode()
}
