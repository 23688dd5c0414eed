//! The joint side of the contract: forgotten rows, rows left out, angles over many turns.

use crate::prelude::*;
use crate::recording::Role;
use crate::set::CreateError;
use crate::testkit::{Check, Probe, Random, Setting, examine_joint, on_common_axis};
use crate::tests::Screw;

/// Declares two rows and sets one.
struct Forgetful;

impl Element for Forgetful {
    const NAME: &'static str = "forgetful";
    const SUMMARY: &'static str = "forgets a row";
    const FRAMES: &'static [FrameSpec] = &[FrameSpec::new("i", "")];
    type Parameters = NoParameters;
    fn new(_: NoParameters) -> Result<Self, ParamError> {
        Ok(Self)
    }
}

impl Constraint for Forgetful {
    const ROWS: &'static [&'static str] = &["first", "second"];
    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        rows.set(1, at.frames[0].position.x);
    }
}

/// Sets more rows than it declares, or asks for an angle it does not declare.
struct Greedy(bool);

#[derive(Parameters)]
struct GreedyParameters {
    /// Rows rather than angles.
    rows: bool,
}

impl Element for Greedy {
    const NAME: &'static str = "greedy";
    const SUMMARY: &'static str = "takes too much";
    const FRAMES: &'static [FrameSpec] = &[FrameSpec::new("i", ""), FrameSpec::new("j", "")];
    type Parameters = GreedyParameters;
    fn new(p: GreedyParameters) -> Result<Self, ParamError> {
        Ok(Self(p.rows))
    }
}

impl Constraint for Greedy {
    const ROWS: &'static [&'static str] = &["only"];
    fn residual<S: Scalar>(&self, at: &Configuration<'_, S>, rows: &mut Rows<'_, S>) {
        if self.0 {
            rows.push_vector(at.frames[0].position);
        } else {
            rows.push(at.angle_about_z(0, 0, 1));
        }
    }
}

#[test]
fn a_forgotten_row_is_not_a_number_and_refused_by_name_when_recorded() {
    let class = crate::adapt::joint::<Forgetful>();
    let mut set = class.new_set();
    let instance = set.add(&crate::params::Table::new()).expect("no parameters");
    let setting = Setting::at_rest(vec![Random::new(1).frame()]);
    let mut out = vec![0.0; 2 * 9];
    let batch = crate::set::Batch {
        instances: &[0],
        inputs: &setting.inputs(),
        wanted: crate::set::Wanted { jacobian: false, second: false },
    };
    set.evaluate(&batch, &mut out).expect("fits");
    assert!(out[0].is_nan());
    assert_eq!(out[1], setting.frames[0].position.x);
    let fault = set.record(instance).expect_err("a row is missing");
    assert_eq!(fault.message, "declares the row `first`, but does not set it");
}

#[test]
fn rows_and_angles_beyond_the_declared_ones_panic_with_the_count() {
    for (params, words) in
        [("rows = true", "row 1 is set, but the element declares 1 of them"), ("rows = false", "ANGLES = 0")]
    {
        let payload = std::panic::catch_unwind(|| Probe::joint::<Greedy>(params)).expect_err("must panic");
        let message = payload.downcast_ref::<String>().cloned().unwrap_or_default();
        assert!(message.contains(words), "{message}");
    }
}

struct Stray;

impl Element for Stray {
    const NAME: &'static str = "stray";
    const SUMMARY: &'static str = "acts on a frame that it does not have";
    const FRAMES: &'static [FrameSpec] = &[FrameSpec::new("on", "")];
    type Parameters = NoParameters;
    fn new(_: NoParameters) -> Result<Self, ParamError> {
        Ok(Self)
    }
}

impl Force for Stray {
    fn wrench<S: Scalar>(&self, at: &Motion<'_, S>, out: &mut Wrenches<'_, S>) {
        out.force_at(1, at.frames()[0].position, Vec3::zeros());
    }
}

#[test]
fn mistakes_are_told_at_the_line_of_the_author() {
    let here = |message: &str| message.contains(file!());
    for params in ["rows = true", "rows = false"] {
        let message = crate::fence::fenced(|| Probe::joint::<Greedy>(params)).expect_err("must panic");
        assert!(here(&message), "{message}");
    }
    let message = crate::fence::fenced(|| Probe::force::<Stray>("")).expect_err("must panic");
    assert!(here(&message), "{message}");
}

#[test]
fn rows_that_an_instance_does_not_use_are_neither_recorded_nor_evaluated() {
    let roles = |held: bool| -> Vec<Role> {
        let probe = Probe::joint::<Screw>(&format!("pitch = 1.0\nheld = {held}")).expect("accepted");
        let outputs = probe.recording.outputs.iter().map(|o| o.role);
        outputs.filter(|role| matches!(role, Role::Residual(_))).collect()
    };
    assert_eq!(roles(true), (0..5).map(Role::Residual).collect::<Vec<_>>());
    assert_eq!(roles(false), (0..3).map(Role::Residual).collect::<Vec<_>>());
    let free = Probe::joint::<Screw>("pitch = 1.0\nheld = false").expect("accepted");
    let values = free.joint_values(&free.random_setting(&mut Random::new(2)));
    assert_eq!((values.rows, values.values.len(), values.jacobian.len()), (3, 4, 4));
    assert!(values.values.iter().all(|v| v.is_finite()));
}

#[test]
fn angles_are_continuous_over_ten_thousand_turns_given_their_references() {
    let probe = Probe::joint::<Screw>("pitch = 1.0").expect("accepted");
    let base = Random::new(3).frame();
    let mut random = Random::new(4);
    for turns in [-10_000.0, -3.0, 0.0, 17.0, 10_000.0] {
        for _ in 0..20 {
            let reference = turns * std::f64::consts::TAU + random.between(-3.0, 3.0);
            // Less than half a turn from the reference, on either side.
            let angle = reference + random.between(-3.1, 3.1);
            let mut setting = Setting::at_rest(vec![base, on_common_axis(&base, angle, 0.0)]);
            setting.references = vec![reference];
            let found = probe.joint_values(&setting);
            assert!((found.angles[0] - angle).abs() < 1e-10, "{} instead of {angle}", found.angles[0]);
            assert_eq!(found.angles[0], found.coordinates()[0]);
        }
    }
}

#[test]
fn the_recorded_angle_is_the_reference_of_the_next_step() {
    let probe = Probe::joint::<Screw>("pitch = 1.0").expect("accepted");
    let setting = probe.random_setting(&mut Random::new(6));
    let recorded = probe.recorded(&setting, &[0.0]);
    let angle = recorded.iter().find(|(role, _)| *role == Role::Angle(0)).map(|(_, value)| *value);
    assert_eq!(angle, Some(probe.joint_values(&setting).angles[0]));
}

#[test]
fn parameters_an_element_refuses_come_back_by_name() {
    let error = Probe::joint::<Greedy>("").expect_err("`rows` has no default");
    assert_eq!(error, CreateError::Parameter(ParamError::new("rows", "is missing: a true or false is needed")));
}

/// A wheel on a road that is pushed along with a time function, and variants that are wrong.
struct Roller;

#[derive(Debug, Clone, Copy, PartialEq)]
enum Wrong {
    Nothing,
    Square,
    Forgotten,
    OneSided,
}

impl Roller {
    fn rate<S: Scalar>(wrong: Wrong, at: &Motion<'_, S>, rows: &mut Rows<'_, S>) {
        let (i, j) = (&at.frames()[0], &at.frames()[1]);
        let carried = at.twists[0].angular_velocity.cross(&(j.position - i.position));
        let across = j.z().dot(&(at.relative_velocity(0, 1) - carried));
        match wrong {
            Wrong::Nothing => rows.push(across - at.time().sin()),
            Wrong::Square => rows.push(across * across),
            Wrong::Forgotten => {}
            Wrong::OneSided => rows.push(j.z().dot(&at.twists[1].velocity)),
        }
    }
}

macro_rules! roller {
    ($name:ident, $wrong:expr) => {
        struct $name(#[allow(dead_code)] Roller);
        impl Element for $name {
            const NAME: &'static str = "roller";
            const SUMMARY: &'static str = "a blade that is driven across";
            const FRAMES: &'static [FrameSpec] = &[FrameSpec::new("i", "road"), FrameSpec::new("j", "wheel")];
            type Parameters = NoParameters;
            fn new(_: NoParameters) -> Result<Self, ParamError> {
                Ok(Self(Roller))
            }
        }
        impl Constraint for $name {
            const ROWS: &'static [&'static str] = &[];
            const VELOCITY_ROWS: &'static [&'static str] = &["across"];
            fn residual<S: Scalar>(&self, _: &Configuration<'_, S>, _: &mut Rows<'_, S>) {}
            fn velocity_residual<S: Scalar>(&self, at: &Motion<'_, S>, rows: &mut Rows<'_, S>) {
                Roller::rate($wrong, at, rows);
            }
        }
    };
}

roller!(Driven, Wrong::Nothing);
roller!(Square, Wrong::Square);
roller!(Forgotten, Wrong::Forgotten);
roller!(OneSided, Wrong::OneSided);

#[test]
fn rows_on_velocities_are_linear_in_them_and_act_on_both_bodies() {
    let probe = Probe::joint::<Driven>("").expect("it is sound");
    assert_eq!(probe.recording.outputs.iter().map(|o| o.role).collect::<Vec<_>>(), [Role::VelocityResidual(0)]);
    assert_eq!(probe.descriptor.rows, ["across"]);
    let mut setting = probe.random_setting(&mut Random::new(3));
    setting.twists[1].velocity += setting.frames[1].z() * 2.0;
    let (faster, mut slower) = (probe.velocity_rows(&setting)[0].1, setting.clone());
    slower.twists[1].velocity -= setting.frames[1].z() * 2.0;
    assert!((faster - probe.velocity_rows(&slower)[0].1 - 2.0).abs() < 1e-14);
    let sound = examine_joint::<Driven>("");
    assert!(sound.failed().is_empty(), "{sound}");
    let failed = examine_joint::<OneSided>("");
    assert!(failed.failed().contains(&Check::Dependence), "{failed}");
    let limits = |probe: &Probe| probe.descriptor.limits();
    let square = Probe::joint::<Square>("");
    let words = match square {
        Ok(probe) => probe.recording.check(&limits(&probe)).expect_err("it is not linear"),
        Err(error) => format!("{error:?}"),
    };
    assert!(words.contains("velocity row 0 is not linear in velocities"), "{words}");
    let forgotten = Probe::joint::<Forgotten>("").expect_err("a row is missing");
    let forgotten = format!("{forgotten:?}");
    assert!(forgotten.contains("declares the velocity row `across`, but does not set it"), "{forgotten}");
}
