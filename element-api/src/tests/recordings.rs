//! A recording says what the equations say, and its shape depends on the element, not on the numbers.

use crate::recording::{Input, Op, Recording, Role};
use crate::testkit::{self, Probe};
use crate::tests::{BELLOWS, Bellows, Screw};

#[test]
fn recordings_of_joints_compute_what_the_equations_say() {
    testkit::check_joint::<Screw>("pitch = 0.1");
    // The mobility of this one does not fit its rows, so only the equations are compared.
    let probe = Probe::joint::<Screw>("pitch = 0.1\nheld = false").expect("accepted");
    let setting = probe.random_setting(&mut testkit::Random::new(5));
    let expected = probe.joint_values(&setting);
    let recorded = probe.recorded(&setting, &[0.0]);
    assert_eq!(expected.rows, 3);
    for (k, (role, value)) in recorded.iter().take(4).enumerate() {
        assert_eq!(*role, if k < 3 { Role::Residual(k as u32) } else { Role::Coordinate(0) });
        assert_eq!(*value, expected.values[k], "{role:?}");
    }
}

#[test]
fn recordings_of_forces_compute_what_the_equations_say() {
    for latches in 0..=3 {
        testkit::check_force::<Bellows>(&format!("{BELLOWS}\nlatches = {latches}"));
    }
    testkit::check_internal::<Bellows>(BELLOWS);
}

#[test]
fn instances_that_differ_only_in_numbers_record_the_same_operations() {
    let recording = |pitch: &str| Probe::joint::<Screw>(&format!("pitch = {pitch}")).expect("accepted").recording;
    let (first, second) = (recording("0.25"), recording("-3.5"));
    // Also with the numbers that simplify: 0, 1 and -0.
    for special in ["0.0", "1.0", "-0.0"] {
        assert_eq!(shape(&recording(special)), shape(&first), "pitch {special}");
    }
    assert_eq!(shape(&first), shape(&second));
    assert_ne!(first.constants, second.constants);
    let bellows = |text: &str| Probe::force::<Bellows>(text).expect("accepted").recording;
    let (first, second) = (bellows(BELLOWS), bellows("curve = [[0.0, 1.0], [3.0, 2.0]]\nrelaxation = 2.0"));
    assert_eq!(shape(&first), shape(&second));
    assert_ne!(first.tables, second.tables);
}

#[test]
fn a_table_used_several_times_is_recorded_once() {
    assert_eq!(Probe::force::<Bellows>(BELLOWS).expect("accepted").recording.tables.len(), 1);
}

#[test]
fn a_switch_stays_visible() {
    let recording = Probe::force::<Bellows>(BELLOWS).expect("accepted").recording;
    let ops = recording.ops.iter().filter_map(|raw| Op::decode(*raw));
    assert!(ops.into_iter().any(|op| matches!(op, Op::Select(..))));
}

#[test]
fn operations_inputs_and_roles_survive_their_encoding() {
    let inputs = (0..4).flat_map(|k| {
        let (frame, component) = (k, k % 3);
        [
            Input::Time,
            Input::Position { frame, component },
            Input::Rotation { frame, row: component, column: (k + 1) % 3 },
            Input::Velocity { frame, component },
            Input::AngularVelocity { frame, component },
            Input::AngleReference(k),
            Input::State(k),
            Input::Discrete(k),
            Input::Signal(k),
            Input::Coordinate(k),
            Input::ReactionForce { joint: frame, component },
            Input::ReactionTorque { joint: frame, component },
            Input::Unknown(k),
        ]
    });
    let plain = [
        Op::Constant(3),
        Op::Add(1, 2),
        Op::Sub(1, 2),
        Op::Mul(1, 2),
        Op::Div(1, 2),
        Op::Neg(1),
        Op::Sqrt(1),
        Op::Sin(1),
        Op::Cos(1),
        Op::Atan2(1, 2),
        Op::Exp(1),
        Op::Ln(1),
        Op::Tanh(1),
        Op::Powi(1, -3),
        Op::Powf(1, 2),
        Op::Select(1, 2, 3, 4),
        Op::Table(1, 2),
    ];
    let mut seen = Vec::new();
    for op in plain.into_iter().chain(inputs.map(Op::Input)) {
        let raw = op.encode();
        assert_eq!(Op::decode(raw), Some(op));
        seen.push(raw.code);
    }
    seen.sort_unstable();
    seen.dedup();
    assert_eq!(seen, (0..18).collect::<Vec<u32>>(), "every code is one operation");
    let mut codes = Vec::new();
    let known = || (0..19).chain([25, 30, 31]);
    for code in known() {
        let role = Role::decode(code, if code == 14 { 0 } else { 2 }).expect("known role");
        codes.push(role.encode().0);
        assert_eq!(Role::decode(role.encode().0, role.encode().1), Some(role));
    }
    assert_eq!(codes, known().collect::<Vec<u32>>());
    assert!((19..25).chain(26..30).chain(32..40).all(|code| Role::decode(code, 0).is_none()));
}

/// The recording with its numbers taken out; their counts remain.
fn shape(recording: &Recording) -> Recording {
    let mut shape = recording.clone();
    shape.constants.fill(0.0);
    shape.initial_states.fill(0.0);
    shape.initial_discrete.fill(0.0);
    for table in &mut shape.tables {
        (table.breaks, table.pieces) = (Vec::new(), Vec::new());
    }
    shape
}
